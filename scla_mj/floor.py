"""Files that settings name; a floor is a map of closed cells, targets that move, starts and grip (docs/floor.md)."""

from __future__ import annotations

import dataclasses
import hashlib
import re
from collections import defaultdict
from collections.abc import Collection
from typing import Any, Final, NamedTuple

from scla_mj.checked_path import checked_path
from scla_mj.config import GridConfig, RunConfig
from scla_mj.errors import SclaError
from scla_mj.grid import Cell
from scla_mj.paths import assets_folder, shipped_file
from scla_mj.validation import shown

_LEAST_GRIP: Final = 0.05
_MOST_GRIP: Final = 2.0
_MOST_CHARACTERS: Final = 100_000
_MEANINGS: Final = {".": "open", "#": "closed", "T": "target", "S": "start"}
_LEGEND: Final = re.compile(r"(\S)\s*=\s*(.*)")
_WORD: Final = re.compile(r"(open)|(closed)|(start)|target(?: from ([1-9]\d{0,8}))?|grip (\d+(?:\.\d+)?)")
_COMMENT: Final = ";"
_READ_FROM: Final = f"{_COMMENT} read from "
"""Begins the line that tells a text read from a file from one of the user's own: the file's name follows."""
_DIGEST: Final = re.compile(r"([0-9a-f]{64})?")
_ITS_OWN: Final = ("cells", "target", "closed_cells")
"""Settings that the map has in place of the command line."""


class Floor(NamedTuple):
    """What a map says: `targets` by the epoch from which they are there, the first from 1; `grip` as a factor."""

    cells: tuple[int, int]
    targets: dict[int, tuple[Cell, ...]]
    closed: tuple[Cell, ...]
    starts: frozenset[Cell]
    grip: dict[Cell, float]


def with_floor(grid: GridConfig) -> GridConfig:
    """Return the arena's settings with those of its map, read now unless they hold its text already.

    Raises:
        SclaError: the file cannot be read, is no map, or says other than settings beside it.
    """
    grid = _without_anothers(grid)
    if grid.floor and not grid.floor_text:
        grid = dataclasses.replace(grid, floor_text=_read(grid.floor))
    if not (grid.floor or grid.floor_text):
        return grid
    found = _own_settings(grid)
    for name in _ITS_OWN:
        if getattr(grid, name) not in (getattr(GridConfig, name), found[name]):
            option = f"--{name.replace('_', '-')}"
            raise SclaError(f"{option} is {shown(getattr(grid, name))}, but --floor has its own: leave {option} out")
    return dataclasses.replace(grid, **found)


def _own_settings(grid: GridConfig) -> dict[str, Any]:
    """Return what the map of these settings has in place of the command line."""
    floor = floor_of(grid)
    closed = tuple((x, y) for x, y in floor.closed)
    return dict(zip(_ITS_OWN, (floor.cells, tuple(floor.targets[1][0]), closed), strict=True))


def _without_anothers(grid: GridConfig) -> GridConfig:
    """Return the settings without the map of another file than they name, as `dataclasses.replace` leaves it there."""
    is_its = grid.floor_text.startswith(_header(grid.floor))
    is_users = not grid.floor and not grid.floor_text.startswith(_READ_FROM)
    if is_its or is_users or not grid.floor_text:
        return grid
    kept = {name: value for name, value in _own_settings(grid).items() if getattr(grid, name) == value}
    return dataclasses.replace(grid, **{name: getattr(GridConfig, name) for name in (*kept, "floor_text")})


def with_files(config: RunConfig) -> RunConfig:
    """Return the settings with what they need of the files that they name: a map's text, a robot's digest.

    Raises:
        SclaError: as `with_floor`; or the robot's file cannot be read.
    """
    config = dataclasses.replace(config, grid=with_floor(config.grid))
    if not _DIGEST.fullmatch(config.robot_sha256):
        raise SclaError(
            f"--robot-sha256 is {shown(config.robot_sha256)}: it must be 64 hexadecimal digits, or empty for any file"
        )
    path = checked_path(config.robot, "--robot")
    file = shipped_file(config.robot, ".xml")
    if file.parent == assets_folder():
        return dataclasses.replace(config, robot_sha256="")
    if config.robot_sha256:
        return config
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise SclaError(
            f"--robot {config.robot} cannot be read: {error.strerror}; name an MJCF file, burger or mouse"
        ) from error
    return dataclasses.replace(config, robot=str(file.absolute()), robot_sha256=digest)


def with_new_files(config: RunConfig, given: Collection[str]) -> RunConfig:
    """Return the settings without what they keep of files, where others are `given`: the names of the new settings."""
    if "robot" in given:
        config = dataclasses.replace(config, robot_sha256="")
    if "floor" in given:
        fresh = {name: getattr(GridConfig, name) for name in (*_ITS_OWN, "floor_text") if name not in given}
        config = dataclasses.replace(config, grid=dataclasses.replace(config.grid, **fresh))
    return config


def refuse_changed_floor(grid: GridConfig) -> None:
    """Refuse a map that has changed since it was read; one that has gone does not matter, as its text is kept.

    Raises:
        SclaError: it has changed.
    """
    try:
        changed = bool(grid.floor) and _read(grid.floor) != grid.floor_text
    except SclaError:
        return
    if changed:
        raise SclaError(
            f"the floor {grid.floor} has changed since the run began: put it back (config.json has it), move "
            "it away, or start a new run"
        )


def floor_of(grid: GridConfig) -> Floor:
    """Return what the map of these settings says.

    Raises:
        SclaError: it is no map; the sentence names the row, and what would be right.
    """
    where = f"--floor {grid.floor}" if grid.floor else "--floor-text"
    meanings, rows = dict(_MEANINGS), list[str]()
    for line in map(str.strip, grid.floor_text.splitlines()):
        legend = _LEGEND.fullmatch(line)
        if legend is not None:
            meanings[legend[1]] = legend[2]
        elif line and not line.startswith(_COMMENT):
            rows.append("".join(line.split()))
    if not rows:
        raise SclaError(f"{where} holds no map: write its rows, such as ..T")
    ragged = next((n for n, row in enumerate(rows, 1) if len(row) != len(rows[0])), None)
    if ragged is not None:
        raise SclaError(
            f"{where}: row {ragged} has {len(rows[ragged - 1])} cells, row 1 has {len(rows[0])}; make them equally long"
        )
    places: defaultdict[str, list[Cell]] = defaultdict(list)
    for y, row in enumerate(reversed(rows), 1):
        for x, key in enumerate(row, 1):
            if key not in meanings:
                raise SclaError(
                    f"{where}: row {len(rows) - y + 1} has {key!r}, which means nothing: use {' '.join(_MEANINGS)}, or "
                    f"add a line such as {key} = grip 0.3"
                )
            places[key].append(Cell(x, y))
    return _put_together(where, (len(rows[0]), len(rows)), meanings, places)


def _put_together(where: str, cells: tuple[int, int], meanings: dict[str, str], places: dict[str, list[Cell]]) -> Floor:
    targets: defaultdict[int, list[Cell]] = defaultdict(list)
    closed, starts, grip = list[Cell](), set[Cell](), dict[Cell, float]()
    for key, meaning in meanings.items():
        here = places.get(key, [])
        for word in map(str.strip, meaning.split(",")):
            found = _WORD.fullmatch(word)
            if found is None or (found[5] and not _LEAST_GRIP <= float(found[5]) <= _MOST_GRIP):
                raise SclaError(
                    f"{where}: {key} = {shown(word)[1:-1]} says nothing of a cell: write open, closed, start, target, "
                    f"target from EPOCH or grip FACTOR, {_LEAST_GRIP:g} to {_MOST_GRIP:g}; several with commas between"
                )
            if found[2]:
                closed += here
            elif found[3]:
                starts.update(here)
            elif found[5]:
                grip |= dict.fromkeys(here, float(found[5]))
            elif not found[1] and here:
                targets[int(found[4] or 1)] += here
    if not targets[1]:
        raise SclaError(f"{where} has no target: mark at least one cell with T")
    for epoch, there in targets.items():
        if len(there) != len(targets[1]):
            raise SclaError(
                f"{where} has {len(targets[1])} targets at first and {len(there)} from epoch {epoch}: mark as many"
            )
    by_epoch = {epoch: tuple(sorted(targets[epoch])) for epoch in sorted(targets)}
    return Floor(cells, by_epoch, tuple(sorted(closed)), frozenset(starts), grip)


def _header(floor: str) -> str:
    return f"{_READ_FROM}{floor}\n"


def _read(floor: str) -> str:
    checked_path(floor, "--floor")
    path = shipped_file(floor, ".txt")
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8"
        raise SclaError(f"--floor {path} cannot be read: {reason}; name a text file with a map") from error
    if len(text) > _MOST_CHARACTERS:
        raise SclaError(
            f"--floor {path} is too long for a map: name a text file of at most {_MOST_CHARACTERS} characters"
        )
    header = _header(floor)
    return text if text.startswith(header) else header + text
