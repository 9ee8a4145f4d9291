"""The words of a command line: which option each belongs to, and whether it can mean what it says.

tyro makes values of words, but of an option that is given twice it keeps the last, `--switch=False` switches on, and a
list takes RUN for its last value, all without a word. So words are sorted and checked here first.
"""

from __future__ import annotations

import dataclasses
import difflib
import itertools
import types
import typing
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple, Union

import tyro.conf

from scla_mj.checked_path import checked_path
from scla_mj.errors import SclaError

HELP: Final = ("-h", "--help")
_END: Final = "--"
"""What follows is not an option, whatever it begins with."""
_TRUTHS: Final = {"true", "false", "yes", "no", "on", "off", "0", "1"}
_SPECIAL_NUMBERS: Final = {"inf", "infinity", "nan"}
_WANTED: Final = {int: "a whole number", float: "a number", str: "a name", Path: "a path"}
_PLURALS: Final = {int: "whole numbers", float: "numbers"}


class Option(NamedTuple):
    """What an option takes: values of one `kind` in groups of `size`, as many groups as there are if it is a list."""

    size: int
    kind: Any
    is_list: bool = False
    opposite: str = ""
    """Of a switch, which takes nothing: the option that sets it the other way."""

    @property
    def wants(self) -> str:
        """The values that are right, in words."""
        if isinstance(self.kind, tuple):
            return f"one of {', '.join(self.kind)}"
        if self.is_list and self.size == 2:
            return f"pairs of {_PLURALS.get(self.kind, 'values')}"
        if self.size > 1:
            return f"{self.size} {_PLURALS.get(self.kind, 'values')}"
        return _WANTED.get(self.kind, "a value")


class Syntax(NamedTuple):
    """What a command line may hold: its options by their names, and the names of its positional arguments.

    Where it `repeats`, there may be any number of the last of these.
    """

    options: dict[str, Option]
    required: tuple[str, ...]
    optional: tuple[str, ...]
    repeats: bool = False
    remarks: Callable[[Iterable[str]], Mapping[str, str]] = lambda options: dict.fromkeys(options, "")
    """Returns these options, and others that there could be, each with what speaks against it."""


class Line(NamedTuple):
    """A command line, sorted: every option once, with its words, and the positional arguments."""

    options: dict[str, list[str]]
    positionals: list[str]

    def words(self) -> list[str]:
        """Return the words for tyro: none of them can be taken for another's."""
        words = []
        for name, values in self.options.items():
            words += [f"{name}={values[0]}", *values[1:]] if values else [name]
        return [*words, _END, *self.positionals] if self.positionals else words


def syntax_of(command: type, prefix: str = "") -> Syntax:
    """Read the syntax off a dataclass, as tyro does."""
    options: dict[str, Option] = {}
    positionals: dict[bool, list[str]] = {True: [], False: []}
    repeats = False
    hints = typing.get_type_hints(command, include_extras=True)
    for field in dataclasses.fields(command):
        hint, extras = _without_extras(hints[field.name])
        if tyro.conf.Suppress in extras:
            continue
        if tyro.conf.Positional in extras:
            metavar = next(extra.metavar for extra in extras if hasattr(extra, "metavar"))
            positionals[field.default is dataclasses.MISSING].append(metavar)
            repeats |= typing.get_origin(hint) is tuple
            continue
        name = next((extra.name for extra in extras if getattr(extra, "name", None) is not None), field.name)
        if dataclasses.is_dataclass(hint):
            options |= syntax_of(typing.cast("type", hint), f"{prefix}{name}." if name else prefix).options
        else:
            options |= _options(f"--{prefix}{name}".replace("_", "-"), hint)
    return Syntax(options, tuple(positionals[True]), tuple(positionals[False]), repeats)


def _without_extras(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    return (hint.__origin__, hint.__metadata__) if typing.get_origin(hint) is Annotated else (hint, ())


def _options(name: str, hint: Any) -> dict[str, Option]:
    """Return the options that set a value: one, or of a switch the two that turn it on and off."""
    if hint is bool:
        section, dot, last = name.rpartition(".") if "." in name else ("--", "", name.removeprefix("--"))
        opposite = f"{section}{dot}no-{last}"
        return {name: Option(0, bool, opposite=opposite), opposite: Option(0, bool, opposite=name)}
    option = _shape(hint)
    if option is None:
        raise SclaError(f"{name} is of type {hint}: use bool, int, float, str, Literal, Path or tuples of one of them")
    return {name: option}


def _shape(hint: Any) -> Option | None:
    hint, _ = _without_extras(hint)
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if hint in (int, float, str, Path):
        return Option(1, hint)
    if origin is Literal:
        return Option(1, tuple(map(str, inner)))
    shapes = {_shape(item) for item in inner if item not in (Ellipsis, types.NoneType)}
    shape = shapes.pop() if len(shapes) == 1 else None
    if shape is None or shape.is_list or origin not in (tuple, Union, types.UnionType):
        return None
    if origin is not tuple:
        return shape
    is_list = inner[-1] is Ellipsis
    return Option(shape.size * (1 if is_list else len(inner)), shape.kind, is_list)


def sort_words(syntax: Syntax, words: Sequence[str]) -> Line:
    """Give every word to its option.

    Raises:
        SclaError: an option is unknown, given twice or of the wrong kind, or there are too few or too many arguments.
    """
    line, rest = Line({}, []), deque(words)
    while rest:
        word = rest.popleft()
        if word == _END:
            line.positionals.extend(rest)
            break
        if _is_option(word) or _is_number(word):
            name, values = _read_option(syntax, word, rest)
            _add(line.options, syntax.options[name], name, values)
        else:
            line.positionals.append(word)
    names = _positional_names(syntax, line.positionals)
    paths = [str(checked_path(word, name)) for name, word in zip(names, line.positionals, strict=False)]
    return line._replace(positionals=paths)


def value_of(words: Sequence[str], name: str) -> str | None:
    """Return what follows an option, before the words are sorted; None if it is not there."""
    before = list(itertools.takewhile(lambda word: word != _END, words))
    for word, following in itertools.pairwise([*before, ""]):
        if word == name or word.startswith(f"{name}="):
            return word.partition("=")[2] or following
    return None


def _is_option(word: str) -> bool:
    return word.startswith("-") and len(word) > 1 and not _is_number(word)


def _is_number(word: str) -> bool:
    """Return whether a word is a number below zero, a value in spite of its dash."""
    first, rest = word[:1], word[1:]
    return first == "-" and (rest[:1].isdigit() or rest[:1] == "." or rest.lower() in _SPECIAL_NUMBERS)


def _read_option(syntax: Syntax, word: str, rest: deque[str]) -> tuple[str, list[str]]:
    """Return an option's name and its values, taken off `rest`."""
    name, equals, value = word.partition("=")
    name = name.replace("_", "-")
    if name not in syntax.options:
        raise SclaError(_unknown(name, syntax.remarks(syntax.options)))
    option, values = syntax.options[name], [value] if equals else []
    if option.size == 0:
        if equals or (rest and rest[0].lower() in _TRUTHS):
            raise SclaError(
                f"{name} takes no value, such as {value or rest[0]}: it stands alone, and {option.opposite} says no"
            )
        return name, []
    while rest and not _is_option(rest[0]) and (option.is_list or len(values) < option.size):
        values.append(rest.popleft())
    if not _is_right(option, values):
        raise SclaError(_wrong(syntax, name, values))
    return name, [str(checked_path(value, name)) for value in values] if option.kind is Path else values


def _unknown(name: str, remarks: Mapping[str, str]) -> str:
    """Return the sentence for an option that there is not."""
    known = [option.removeprefix("--") for option in sorted(remarks, key=lambda option: remarks[option] != "")]
    last = name.rpartition(".")[2].strip("-")
    near = [option for option in known if last and option.rpartition(".")[2] == last]
    near += difflib.get_close_matches(name.strip("-"), known, n=1)
    meant = f"did you mean --{near[0]}{remarks[f'--{near[0]}']}?" if near else "see --help of the command"
    return f"{name} is not an option: {meant}"


def _is_right(option: Option, values: list[str]) -> bool:
    whole = bool(values) and len(values) % option.size == 0
    return whole and all(value.strip() and _is_of(option.kind, value) for value in values)


def _wrong(syntax: Syntax, name: str, values: list[str]) -> str:
    """Return the sentence for values that an option cannot take."""
    option = syntax.options[name]
    strange = [value for value in values if not _is_of(option.kind, value)]
    shown = " ".join(strange[:1] or values)
    fault = f"is {shown}" if shown.strip() else "has no value"
    hint = f"; {' '.join(syntax.required + syntax.optional)} goes before it or after {_END}" if option.is_list else ""
    return f"{name} {fault}: it must be {option.wants}{hint}"


def _is_of(kind: Any, word: str) -> bool:
    if isinstance(kind, tuple):
        return word in kind
    try:
        kind(word)
    except ValueError:
        return False
    return True


def _add(given: dict[str, list[str]], option: Option, name: str, values: list[str]) -> None:
    """Keep an option's values; only a list may be given in pieces."""
    if option.opposite in given:
        raise SclaError(f"{option.opposite} and {name} are both given: leave one out")
    if name in given and not option.is_list:
        both = f": {' '.join(given[name])} and {' '.join(values)}" if values else ""
        raise SclaError(f"{name} is given twice{both}")
    given.setdefault(name, []).extend(values)


def _positional_names(syntax: Syntax, positionals: list[str]) -> tuple[str, ...]:
    names = (*syntax.required, *syntax.optional)
    if len(positionals) < len(syntax.required):
        raise SclaError(f"{syntax.required[len(positionals)]} is missing: name a folder")
    if syntax.repeats:
        names += names[-1:] * (len(positionals) - len(names))
    if len(positionals) > len(names):
        before = f": {names[-1]} is {positionals[len(names) - 1]} already" if names else ": it belongs to no option"
        raise SclaError(f"{positionals[len(names)]} is one word too many{before}")
    return names
