"""Dataclasses checked by pydantic: one sentence for whatever does not fit, from Python, JSON or the command line."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import numbers
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Final, TypeVar, get_args, get_origin, get_type_hints

from annotated_types import Ge, Interval

from scla_mj.errors import SclaError

Checked = TypeVar("Checked")
Spell = Callable[[tuple[str | int, ...]], str]

_WANTED: Final = {
    "int": "a whole number",
    "float": "a number",
    "bool": "true or false",
    "string": "a text",
    "tuple": "a list",
    "dict": "an object of settings",
    "dataclass": "an object of settings",
    "finite": "a finite number",
}
"""What to say, by the first word of pydantic's error type."""
_LONGEST_SHOWN: Final = 40
_LONGEST_NAME: Final = 4200
"""A path of the longest that a system allows, and the keys in its file."""


class Section:
    """A dataclass of settings: nothing is converted, nothing unknown or infinite is taken."""

    __pydantic_config__: ClassVar = {"extra": "forbid", "strict": True, "allow_inf_nan": False}


def validated(kind: type[Checked], content: Any, *, spell: Spell, complete: bool = False) -> Checked:
    """Return the dataclass `kind` built from what `dataclasses.asdict` makes of one, or JSON.

    Tuples may be lists, and numpy's scalars are taken for the numbers that they are.

    Args:
        kind: the class; its nested dataclasses are `Section`s.
        content: a nested mapping of plain values.
        spell: how a sentence names a value, from the keys and places that lead to it.
        complete: refuse a content that leaves a field to its default.

    Raises:
        SclaError: a key is unknown or missing, a value has the wrong type or lies out of its range; one sentence.
    """
    from pydantic import ValidationError

    name = _in_one_line(spell)
    try:
        text = json.dumps(content, default=_plain)
    except (TypeError, ValueError) as error:
        raise SclaError(_unspeakable(content, name) or f"{name(())} holds what is not a setting") from error
    try:
        checked: Checked = _adapter(kind).validate_json(text)  # type: ignore[arg-type]
    except ValidationError as error:
        raise SclaError(_sentence(kind, error.errors(include_url=False)[0], name)) from None
    if complete:
        _require_all(kind, content, (), name)
    return checked


def _in_one_line(spell: Spell) -> Spell:
    """Return a `spell` whose names fit into a sentence, whatever somebody has chosen for a key."""

    def spelt(path: tuple[str | int, ...]) -> str:
        name = "".join(char if char.isprintable() else "?" for char in spell(path))
        return name if len(name) <= _LONGEST_NAME else name[:_LONGEST_NAME] + "..."

    return spelt


@functools.cache
def _adapter(kind: Any) -> Any:
    from pydantic import TypeAdapter  # takes longer to import than a command takes to say its help

    if not hasattr(kind, "__pydantic_config__"):  # a dataclass of a user's own
        kind.__pydantic_config__ = Section.__pydantic_config__
    return TypeAdapter(kind)


def bounds(hint: Any) -> tuple[float, float]:
    """Return the least and the greatest value that an annotated type allows; infinite where it states none."""
    low: Any = -math.inf
    high: Any = math.inf
    for mark in get_args(hint)[1:] if get_origin(hint) is Annotated else ():
        if isinstance(mark, Ge | Interval) and mark.ge is not None:
            low = mark.ge
        if isinstance(mark, Interval) and mark.le is not None:
            high = mark.le
    return low, high


def hint_at(kind: Any, path: tuple[str | int, ...]) -> Any:
    """Return the annotated type of the value that a path leads to, from a dataclass through names and places."""
    hint = kind
    for part in path:
        bare = _bare(hint)
        if dataclasses.is_dataclass(bare):
            hint = get_type_hints(bare, include_extras=True).get(str(part), Any)
        else:
            items = [item for item in get_args(bare) if item is not Ellipsis]
            hint = items[min(int(part), len(items) - 1)] if items and isinstance(part, int) else Any
    return hint


def _bare(hint: Any) -> Any:
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint


def whole_number(value: Any, name: str, least: int, most: int) -> int:
    """Return a whole number, which may be numpy's, as Python's.

    Raises:
        SclaError: it is none, or is not `least` to `most`; the sentence calls it `name`.
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or not least <= int(value) <= most:
        raise SclaError(f"{name} is {shown(value)}: it must be a whole number, {least} to {most}")
    return int(value)


def shown(value: Any) -> str:
    """Return a value as a sentence shows it: short, on one line."""
    if isinstance(value, tuple | list) and value and all(isinstance(part, int | float) for part in value):
        return " ".join(map(str, value))
    words = isinstance(value, tuple) and value and all(isinstance(part, str) for part in value)  # as options have them
    text = " ".join((" ".join(value) if words else repr(value)).split())
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 3] + "..."


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):  # numpy's scalars and arrays
        return value.tolist()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    raise TypeError(f"{shown(value)} ({type(value).__name__})")


def _unspeakable(content: Any, spell: Spell, path: tuple[str | int, ...] = ()) -> str | None:
    """Find the first value that is not plain data, and say so."""
    if isinstance(content, dict):
        items: list[tuple[str | int, Any]] = [(str(key), value) for key, value in content.items()]
    elif isinstance(content, list | tuple):
        items = list(enumerate(content))
    elif isinstance(content, str | int | float | None) or hasattr(content, "tolist"):
        return None
    else:
        return f"{spell(path)} is {shown(content)} ({type(content).__name__}): it must be plain data"
    found = (_unspeakable(value, spell, (*path, key)) for key, value in items)
    return next((sentence for sentence in found if sentence is not None), None)


def _sentence(kind: Any, error: Any, spell: Spell) -> str:
    path, what, value = tuple(error["loc"]), str(error["type"]), error["input"]
    if what in ("unexpected_keyword_argument", "extra_forbidden"):
        known = ", ".join(field.name for field in dataclasses.fields(_bare(hint_at(kind, path[:-1]))))
        return f"{spell(path)} is not a setting: known are {known}"
    if what.startswith("missing") and path and isinstance(path[-1], int):
        return f"{spell(path[:-1])} is {shown(value)}: it must hold {_items(hint_at(kind, path[:-1]))} values"
    if what.startswith("missing"):
        return f"{spell(path)} is missing: the file was cut short or written by another version of scla-mj"
    wanted = _wanted(kind, path, what, error.get("ctx", {}))
    return f"{spell(path)} is {shown(value)}: it must be {wanted}"


def _wanted(kind: Any, path: tuple[str | int, ...], what: str, context: dict[str, Any]) -> str:
    hint = hint_at(kind, path)
    if what == "literal_error":
        return f"one of {', '.join(map(str, get_args(hint)))}"
    if what in ("too_short", "too_long"):
        return f"a list of {_items(hint)} values"
    low, high = bounds(hint)
    if what in ("greater_than_equal", "less_than_equal"):
        return f"{_number(low)} or more" if math.isinf(high) else f"{_number(low)} to {_number(high)}"
    return _WANTED.get(what.split("_")[0], what.replace("_", " "))


def _items(hint: Any) -> int:
    return len([item for item in get_args(hint) if item is not Ellipsis])


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:g}"


def _require_all(kind: Any, content: Any, path: tuple[str | int, ...], spell: Spell) -> None:
    for name, hint in get_type_hints(kind).items():
        if name.startswith("__"):
            continue
        if name not in content:
            raise SclaError(
                f"{spell((*path, name))} is missing: the file was cut short or written by another version of scla-mj"
            )
        if dataclasses.is_dataclass(hint):
            _require_all(hint, content[name], (*path, name), spell)
