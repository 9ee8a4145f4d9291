"""Command lines as somebody might type them: any option, any value, mostly possible ones."""

from __future__ import annotations

import dataclasses
import math
import typing
from decimal import Decimal
from fractions import Fraction
from typing import Any, Literal

import numpy as np
from hypothesis import strategies as st

from scla_mj.brain.registry import BRAINS
from scla_mj.config import RunConfig, flatten, option_of
from scla_mj.disturbances import ALL, SETS
from scla_mj.validation import bounds

FIXED = {"epochs", "decisions", "telemetry"}
"""What the test sets itself, so that a run that is carried out stays short."""
WILD = ["nan", "inf", "-inf", "-0.0", "1e308", "-1e308", "5e-324", "0", "-1", "1", "1e999", "", " ", "none", "None",
        "many", "0x10", "1_0", "½", "True", "--", "é\u202e", "9" * 40, "1.5", "[1]", "1,2", "\t"]  # fmt: skip
OWN = [name for name, brain in BRAINS.items() if brain.Settings]
LARGE = 1000.0
"""Where a range has no end, most values are drawn below this."""


def hints(kind: Any = RunConfig, *path: str) -> dict[str, Any]:
    """Return every option's annotated type by its name on the command line."""
    found: dict[str, Any] = {}
    for name, hint in typing.get_type_hints(kind, include_extras=True).items():
        bare = typing.get_args(hint)[0] if typing.get_origin(hint) is typing.Annotated else hint
        if dataclasses.is_dataclass(bare):
            found |= hints(bare, name)
        elif not name.startswith("__") and name != "brain_settings" and "Suppress" not in repr(hint):
            found[option_of(*path, name)] = hint
    return found


def number(hint: Any, default: Any, tame: bool) -> st.SearchStrategy[str]:
    """Return numbers within the option's range, its ends and, unless `tame`, what lies just beyond."""
    low, high = bounds(hint)
    low, high = max(low, -LARGE), min(high, 1e30)
    top = min(high, max(low, LARGE))
    if isinstance(default, int):
        inside = st.integers(math.ceil(low), int(top))
        edges = [low, low + 1, top] if tame else [low, low - 1, low + 1, top, top + 1, 2**31, 2**63, 10**30]
        return st.one_of(inside, inside, inside, st.sampled_from([int(edge) for edge in edges])).map(str)
    inside = st.floats(low, top)
    beyond = [] if tame else [math.nextafter(low, -math.inf), math.nextafter(top, math.inf)]
    near = st.sampled_from([low, top, default, *beyond] + [default / 2] * (not tame or low <= default / 2))
    scale = st.floats(-6, 3).map(lambda exponent: 10.0**exponent).filter(lambda value: low <= value <= high)
    return st.one_of(inside, near, near, scale).map(repr)


def words(option: str, hint: Any, default: Any, tame: bool) -> st.SearchStrategy[list[str]]:
    """Return the words that follow an option, most of them possible."""
    if option == "brain":
        strange = [
            "os:system",
            "no.such:Brain",
            "json:loads",
            "../brain:Brain",
            "scla_mj.brain.scla:SclaBrain",
            "scla:",
        ]
        return st.sampled_from([*BRAINS] if tame else [*BRAINS, *BRAINS, *strange]).map(lambda word: [word])
    if option == "robot":
        strange = ["mouse.xml", "/etc/passwd", "..", "no-such"]
        return st.sampled_from(["burger", "mouse"] if tame else ["burger", "mouse", *strange]).map(lambda word: [word])
    if option == "floor":
        return st.sampled_from(["maze"] if tame else ["maze", "maze.txt", "/dev/null", ""]).map(lambda word: [word])
    if typing.get_origin(hint) is Literal:
        return st.sampled_from(typing.get_args(hint)).map(lambda word: [str(word)])
    if option == "closed-cells":
        if tame:
            return st.sampled_from([["1", "1"], ["2", "2", "4", "4"], ["5", "1", "5", "2"]])
        return st.lists(st.integers(0, 6).map(str), max_size=9)
    if option.endswith("projections"):
        names = st.sampled_from(
            ["SUtoML", "SLtoMU", "MUtoMD:-0.5", *([] if tame else ["SUtoMU", "XtoMU", "SUtoML:99"])]
        )
        return st.lists(names, min_size=1, max_size=2, unique=True)
    if typing.get_origin(hint) is tuple:
        kind = typing.get_args(hint)[0]
        if isinstance(default[0], int):
            any_size = st.one_of(st.integers(1, 6), st.integers(-1, 120))
            return st.lists((st.integers(4, 5) if tame else any_size).map(str), min_size=2, max_size=2)
        pair = st.lists(number(kind, default[0], tame), min_size=2, max_size=2)
        return pair.map(lambda ends: sorted(ends, key=float)) if tame else pair
    return number(hint, default, tame).map(lambda word: [word])


@st.composite
def command_lines(draw: st.DrawFn) -> list[str]:
    """Draw the options of a rollout: up to eight, in three lines of four all possible, otherwise one in ten wild."""
    types, defaults = hints(), flatten(RunConfig())
    chosen = draw(st.lists(st.sampled_from(sorted(types.keys() - FIXED)), max_size=8, unique=True))
    own = draw(st.sampled_from(OWN)) if draw(st.integers(0, 3)) == 0 else None
    if own is not None or "brain" not in chosen:  # leave out what goes unread, or most lines would be refused for it
        reads = tuple(BRAINS[own or RunConfig().brain].reads)
        chosen = [
            option
            for option in chosen
            if option != "brain"
            and (option.startswith(reads) or not option.startswith(("network.", "plasticity.", "automaton.")))
        ]
    line: list[str] = []
    tame = draw(st.integers(0, 3)) > 0
    for option in chosen:
        if types[option] is bool:
            section, _, name = option.rpartition(".")
            line.append(draw(st.sampled_from([f"--{option}", f"--{section}.no-{name}" if section else f"--no-{name}"])))
            continue
        wild = st.lists(st.sampled_from(WILD), max_size=3)
        is_wild = not tame and draw(st.integers(0, 9)) == 0
        values = wild if is_wild else words(option, types[option], defaults[option], tame)
        line += draw(spellings(option, draw(values), tame))
    if draw(st.integers(0, 3)) == 0:
        line += ["--disturb", *draw(st.lists(st.sampled_from([*SETS, ALL]), min_size=1, max_size=3, unique=True))]
    return line if own is None else line + draw(own_settings(own, tame))


@st.composite
def own_settings(draw: st.DrawFn, name: str, tame: bool) -> list[str]:
    """Draw one or two of the settings that a brain has of its own."""
    kind: Any = BRAINS[name].Settings
    every = typing.get_type_hints(kind, include_extras=True)
    types = {field.name: every[field.name] for field in dataclasses.fields(kind)}
    line = ["--brain", name]
    for field in draw(st.lists(st.sampled_from(sorted(types)), min_size=1, max_size=2, unique=True)):
        option = option_of("brain", field)
        if types[field] is bool:
            line.append(draw(st.sampled_from([f"--{option}", f"--brain.no-{option_of(field)}"])))
        else:
            line += [f"--{option}", *draw(words(option, types[field], getattr(kind(), field), tame))]
    return line


def python_values() -> st.SearchStrategy[Any]:
    """Draw what a Python caller might give for a number."""
    plain = st.one_of(st.integers(-5, 2**65), st.floats(), st.booleans(), st.none(), st.text(max_size=3))
    numbers = [np.int8, np.uint64, np.float16, np.float32, np.float64, np.bool_, np.array]
    numpys = st.tuples(st.sampled_from([*numbers, Fraction, Decimal, complex, str]), st.integers(0, 100)).map(
        lambda pair: pair[0](pair[1])
    )
    return st.one_of(plain, numpys, st.lists(plain, max_size=3), st.just(b"1"), st.just(object))


@st.composite
def spellings(draw: st.DrawFn, option: str, values: list[str], tame: bool) -> list[str]:
    """Draw how an option and its values are written: with `=`, with underscores, unless `tame` now and then twice."""
    name = f"--{draw(st.sampled_from([option, option, option.replace('-', '_')]))}"
    written = [f"{name}={values[0]}", *values[1:]] if values and draw(st.booleans()) else [name, *values]
    return written * (2 if not tame and draw(st.integers(0, 19)) == 0 else 1)
