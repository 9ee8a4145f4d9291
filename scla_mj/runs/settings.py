"""A dataclass tree from JSON, every key and every type checked: the way back from `dataclasses.asdict`."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from typing import Any, Final, Literal, TypeVar, Union

from scla_mj.errors import SclaError

Settings = TypeVar("Settings")

ADDED_LATER: Final = frozenset({"localisation", "disturbance"})
"""Keys that a file written by an older version lacks; each takes its default there, which is what that version did."""


def settings_from_json(kind: type[Settings], content: Any, where: str) -> Settings:
    """Build the dataclass `kind` from what JSON made of it.

    `where` names the place in error messages, such as `config.json`; the key follows, as in `config.json: grid.target`.

    Raises:
        SclaError: a key is unknown or missing, or a value has the wrong type; the sentence names it.
    """
    return typing.cast("Settings", _build(kind, content, f"{where}: "))


def _build(kind: Any, content: Any, where: str) -> Any:
    if not isinstance(content, dict):
        raise SclaError(f"{where.rstrip('.: ')} is {_shown(content)}: it must be an object of settings")
    hints = typing.get_type_hints(kind)
    names = [field.name for field in dataclasses.fields(kind) if field.init]
    for key in content:
        if key not in names:
            raise SclaError(f"{where}{key} is not a setting: known are {', '.join(names)}")
    names = [name for name in names if name in content or name not in ADDED_LATER]
    for name in names:
        if name not in content:
            raise SclaError(
                f"{where}{name} is missing: the file was cut short or written by another version of scla-mj"
            )
    return kind(**{name: _value(hints[name], content[name], where + name) for name in names})


def _value(hint: Any, value: Any, where: str) -> Any:
    origin = typing.get_origin(hint)
    if dataclasses.is_dataclass(hint):
        return _build(hint, value, f"{where}.")
    if origin is Literal:
        return _one_of(typing.get_args(hint), value, where)
    if origin is tuple:
        return _tuple(typing.get_args(hint), value, where)
    if origin in (Union, types.UnionType):
        return _optional(typing.get_args(hint), value, where)
    return _scalar(hint, value, where)


def _one_of(allowed: tuple[Any, ...], value: Any, where: str) -> Any:
    if value not in allowed or not isinstance(value, type(allowed[0])):
        raise SclaError(f"{where} is {_shown(value)}: it must be one of {', '.join(map(str, allowed))}")
    return value


def _tuple(items: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise SclaError(f"{where} is {_shown(value)}: it must be a list")
    if len(items) == 2 and items[1] is Ellipsis:
        items = (items[0],) * len(value)
    if len(value) != len(items):
        raise SclaError(f"{where} is {_shown(value)}: it must hold {len(items)} values")
    return tuple(_value(hint, item, f"{where}[{i}]") for i, (hint, item) in enumerate(zip(items, value, strict=True)))


def _optional(choices: tuple[Any, ...], value: Any, where: str) -> Any:
    if value is None and type(None) in choices:
        return None
    present = [choice for choice in choices if choice is not type(None)]
    return _value(present[0], value, where)


def _scalar(hint: type, value: Any, where: str) -> Any:
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        return _finite(value, where)
    if hint is float or type(value) is not hint:
        word = {int: "an integer", float: "a number", str: "a text", bool: "true or false"}.get(hint, hint.__name__)
        raise SclaError(f"{where} is {_shown(value)}: it must be {word}")
    return value


def _finite(value: float, where: str) -> float:
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise SclaError(f"{where} is {_shown(value)}: it must be a finite number")
    return number


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."
