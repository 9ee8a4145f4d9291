"""Warp structs with the fields of the package's NamedTuples."""

from __future__ import annotations

import typing
from collections.abc import Mapping
from typing import Any, Final

import warp as wp

_KINDS: Final[dict[Any, Any]] = {float: wp.float32, int: wp.int32, bool: wp.bool, Any: wp.float32}


def struct(name: str, fields: Mapping[str, Any]) -> Any:
    """Return a struct with these fields, types of Warp's by name."""
    return wp.struct(type(name, (), {"__annotations__": dict(fields), "__module__": __name__, "__qualname__": name}))


def fields_of(named: type) -> dict[str, Any]:
    """Return the fields of a NamedTuple as Warp's types: numbers are float32, like those of the kernel's own format."""
    return {name: _KINDS[kind] for name, kind in typing.get_type_hints(named).items()}


def filled(made: Any, values: Mapping[str, Any]) -> Any:
    """Return a struct with these values in it."""
    for name, value in values.items():
        setattr(made, name, value)
    return made
