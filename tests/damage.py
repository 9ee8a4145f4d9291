"""Damages files of a run in every way a disk, a cable or a hand could, and opens them as a user would."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from scla_mj import paths
from scla_mj.cli.main import COMMANDS, main
from scla_mj.config import RunConfig
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.runs.brain import read_brain
from scla_mj.runs.checkpoint import read_checkpoint
from scla_mj.runs.decisions import read_decisions
from scla_mj.runs.folder import open_run
from scla_mj.runs.seal import check_seal
from scla_mj.runs.summary import read_summary

Random = np.random.Generator
_GIANT: Final = [2**31 - 1, 2**32 - 1, 2**40, 2**63 - 1, 2**64 - 1]
FIGURES: Final = (paths.LEARNING_PNG, paths.WEIGHTS_PNG, paths.POLICY_PNG)
_SHAPE: Final = {"epochs": 3, "decisions": 80}
_CUT_AT: Final = (3, 50)
"""Epoch and decision where the killed run's folder is copied: two batches and the recording's first columns are out."""


def flip_bits(content: bytearray, rng: Random) -> bytearray:
    for _ in range(int(rng.choice([1, 1, 1, 2, 16]))):
        content[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
    return content


def cut(content: bytearray, rng: Random) -> bytearray:
    return content[: rng.integers(len(content))]


def overwrite(content: bytearray, rng: Random) -> bytearray:
    start, size = int(rng.integers(len(content))), int(rng.choice([1, 8, 64, 512, 4096]))
    size = min(size, len(content) - start)
    content[start : start + size] = [bytes(size), b"\xff" * size, rng.bytes(size)][rng.integers(3)]
    return content


def insert(content: bytearray, rng: Random) -> bytearray:
    start = int(rng.integers(len(content) + 1))
    content[start:start] = rng.bytes(int(rng.choice([1, 4, 100, 5000])))
    return content


def take_out(content: bytearray, rng: Random) -> bytearray:
    start = int(rng.integers(len(content)))
    del content[start : start + int(rng.choice([1, 4, 100, 5000]))]
    return content


def swap(content: bytearray, rng: Random) -> bytearray:
    size = max(1, min(int(rng.choice([1, 16, 512])), len(content) // 3))
    first, second = sorted(rng.integers(len(content) - size + 1, size=2).tolist())
    one, other = bytes(content[first : first + size]), bytes(content[second : second + size])
    content[first : first + size], content[second : second + size] = other, one
    return content


def claim_much(content: bytearray, rng: Random) -> bytearray:
    """Write a giant number where a length may stand, mostly at the ends of the file, where formats keep theirs."""
    size, span = int(rng.choice([4, 8])), min(len(content), 4096)
    near = int(rng.integers(span))
    start = [near, len(content) - near - 1, int(rng.integers(len(content)))][rng.integers(3)]
    value = int(rng.choice(np.array(_GIANT, dtype=np.uint64))) & (256**size - 1)
    content[start : start + size] = value.to_bytes(size, "little" if rng.integers(2) else "big")
    return content


def foreign(content: bytearray, rng: Random) -> bytearray:
    others = [b"", b"\x89PNG\r\n\x1a\n", b"PK\x05\x06" + bytes(17), b"PAR1", b"RRF2", b"{}", b"null", b"[" * 100_000]
    others += [b"\x1f\x8b\x08" + rng.bytes(200), rng.bytes(5000), b"PAR1" + rng.bytes(2000) + b"PAR1", b"1e999"]
    return bytearray(others[rng.integers(len(others))])


BYTES: Final[tuple[Callable[[bytearray, Random], bytearray], ...]] = (
    flip_bits, flip_bits, cut, overwrite, insert, take_out, swap, claim_much, foreign,
)  # fmt: skip


def folder(path: Path, rng: Random) -> None:
    path.mkdir()


def pipe(path: Path, rng: Random) -> None:
    os.mkfifo(path)


def link(path: Path, rng: Random) -> None:
    targets = ["/dev/zero", "/dev/urandom", path.name, "no-such-file", "/etc/passwd", "config.json"]
    path.symlink_to(targets[rng.integers(len(targets))])


PLACES: Final[tuple[Callable[[Path, Random], None], ...]] = (folder, pipe, link)


def damage(path: Path, rng: Random) -> str:
    """Damage one file; return how."""
    if rng.random() < 0.04:
        place = PLACES[rng.integers(len(PLACES))]
        path.unlink()
        place(path, rng)
        return place.__name__
    kind = BYTES[rng.integers(len(BYTES))]
    path.write_bytes(kind(bytearray(path.read_bytes()), rng))
    return kind.__name__


def make_runs(work: Path) -> None:
    """Make the run folders that are damaged: `finished`, `unsealed` and `killed`, and what the killed one would be."""
    config = RunConfig(brain="scla", telemetry="light", **_SHAPE)

    def copy(record: Any, epoch: Any) -> None:
        if (record.epoch, record.decision) == _CUT_AT:
            shutil.copytree(work / "finished", work / "killed")

    rollout(config, work / "finished", watch=copy, checkpoint_period_s=0.0)
    shutil.copytree(work / "finished", work / "unsealed")
    (work / "unsealed" / paths.SEAL_JSON).unlink()


class Way(NamedTuple):
    """One way to open a run after one of its files is damaged; `told` is False where bytes have no digest at all."""

    run: str
    file: str
    open: str
    told: bool
    share: int


WAYS: Final = (
    *(Way("finished", name, "read", True, 70) for name in
      ("config.json", "summary.json", "decisions.parquet", "brain.npz", "seal.json", "recording.rrd")),
    *(Way("finished", name, "inspect", True, 3) for name in
      ("config.json", "summary.json", "decisions.parquet", "brain.npz", "seal.json")),
    Way("finished", "recording.rrd", "inspect", True, 20),
    *(Way("unsealed", name, "read", True, 50) for name in ("config.json", "summary.json")),
    *(Way("unsealed", name, "read", True, 100) for name in ("decisions.parquet", "brain.npz")),
    Way("unsealed", "recording.rrd", "inspect", False, 30),
    *(Way("finished", name, "figures", True, 4) for name in
      ("config.json", "summary.json", "decisions.parquet", "brain.npz", "seal.json", "learning.png", "policy.png")),
    *(Way("unsealed", name, "figures", True, 4) for name in
      ("config.json", "summary.json", "brain.npz", "weights.png")),
    *(Way("finished", name, "inspect", True, 3) for name in FIGURES),
    Way("killed", "config.json", "read", True, 20),
    Way("killed", "decisions.partial.arrows", "read", True, 100),
    Way("killed", "checkpoint.npz", "read", True, 120),
    Way("killed", "recording.rrd", "inspect", False, 20),
    *(Way("killed", name, "resume", True, 6) for name in
      ("config.json", "checkpoint.npz", "decisions.partial.arrows", "recording.rrd")),
)  # fmt: skip


def read(run: Path) -> dict[str, Any]:
    """Return what the run's files say, each checked against the seal before its reader sees it."""
    readers: dict[str, Callable[[Path], Any]] = {
        paths.CONFIG_JSON: lambda run: repr(open_run(run)[1:]),
        paths.SUMMARY_JSON: lambda run: repr(read_summary(run)),
        paths.DECISIONS_PARQUET: lambda run: read_decisions(run).to_pydict(),
        paths.DECISIONS_PARTIAL: lambda run: read_decisions(run).to_pydict(),
        paths.BRAIN_NPZ: lambda run: [None if part is None else part.tobytes() for part in read_brain(run)],
        paths.CHECKPOINT_NPZ: lambda run: None if (state := read_checkpoint(run)) is None else _plain(state),
        paths.RECORDING_RRD: lambda run: None,
    }
    found = {}
    for name, reader in readers.items():
        if os.path.lexists(run / name):
            check_seal(run, name)
            found[name] = reader(run)
    return found


def _plain(state: Any) -> Any:
    """Return a state that `==` compares to the bit."""
    if isinstance(state, dict):
        return {key: _plain(value) for key, value in state.items()}
    return state.tobytes() if isinstance(state, np.ndarray) else repr(state)


def call(*arguments: str) -> tuple[int, str, str]:
    """Return the exit code and what the command printed."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(list(arguments))
    return code, out.getvalue(), err.getvalue()


def seen(run: Path, way: Way) -> tuple[str, Any]:
    """Open the run; return `refused` and the sentence, or `opened` and what was found."""
    if way.open == "read":
        try:
            return "opened", read(run)
        except SclaError as error:
            return "refused", str(error)
    code, out, err = call(way.open, str(run))
    if code == 0 and way.open == "resume":
        return "opened", [(run / name).read_bytes() for name in (paths.DECISIONS_PARQUET, paths.BRAIN_NPZ)]
    if code == 0 and way.open == "figures":
        return "opened", [(run / name).read_bytes() for name in FIGURES]
    return ("opened", out) if code == 0 else ("refused", err.splitlines()[-1] if err else out.splitlines()[0])


def ways() -> list[Way]:
    """Return the ways that this version's command line and run folders know."""
    return [way for way in WAYS if way.open in ("read", *COMMANDS)]


class Case(NamedTuple):
    """What became of one damaged file: `outcome` is one of GOOD or BAD, the rest says how to see it again."""

    number: int
    way: Way
    how: str
    outcome: str
    said: str


GOOD: Final = ("refused", "harmless", "shorter", "unnoticed, no digest")
"""`harmless`: opened, and says what the whole run says. `shorter`: a killed run's, cut before its last batch."""
BAD: Final = ("taken for sound", "traceback", "many lines", "outside touched")


def way_of(seed: int, number: int) -> Way:
    """Return which file a case damages and how it is opened then."""
    known = ways()
    shares = np.array([way.share for way in known])
    return known[np.random.default_rng([seed, number]).choice(len(known), p=shares / shares.sum())]


def try_case(work: Path, seed: int, number: int, truths: dict[Any, Any]) -> Case:
    """Damage one file of a copy of a run and open it; `truths` keeps what whole runs say."""
    way, rng = way_of(seed, number), np.random.default_rng([seed, number, 1])
    place = work / "case"
    shutil.rmtree(place, ignore_errors=True)
    run = Path(shutil.copytree(work / way.run, place / "run"))
    if (way.run, way.open) not in truths:
        first, truths[way.run, way.open] = seen(run, way)
        assert first == "opened" or (way.run, way.open) == ("killed", "inspect"), truths
        shutil.rmtree(place)
        shutil.copytree(work / way.run, run)
    how = damage(run / way.file, rng)
    before = set(files_below(run))
    try:
        outcome, said = _judged(*seen(run, way), truths[way.run, way.open], way)
    except Exception as error:
        outcome, said = "traceback", f"{type(error).__name__}: {error}"
    outside = [name for name in files_below(place) if name != "run" and not name.startswith("run/")]
    if outside or list(Path(os.environ.get("TMPDIR", "/nowhere")).glob("*")):
        outcome, said = "outside touched", str(outside)
    elif way.open != "resume" and set(files_below(run)) != before:
        outcome, said = "outside touched", str(set(files_below(run)) ^ before)
    return Case(number, way, how, outcome, said)


def _judged(first: str, found: Any, truth: Any, way: Way) -> tuple[str, str]:
    if first == "refused":
        return ("many lines" if "\n" in found.strip() else "refused"), found
    if found == truth:
        return "harmless", ""
    if way.open == "read" and way.run == "killed" and _is_start(found, truth):
        return "shorter", ""
    return ("taken for sound" if way.told else "unnoticed, no digest"), ""


def _is_start(found: dict[str, Any], truth: dict[str, Any]) -> bool:
    """Return whether the decisions are the first of the truth, and all else is the truth."""
    rows, whole = found.get(paths.DECISIONS_PARTIAL, {}), truth[paths.DECISIONS_PARTIAL]
    others = {name: value for name, value in found.items() if name != paths.DECISIONS_PARTIAL}
    if others.get(paths.CHECKPOINT_NPZ, "") is None:  # a link to nothing: as if there had been no checkpoint yet
        del others[paths.CHECKPOINT_NPZ]
    same = all(truth[name] == value for name, value in others.items())
    return same and all(whole[name][: len(column)] == column for name, column in rows.items())


def files_below(path: Path) -> Iterator[str]:
    """Yield every file below a folder, to see whether one came or went."""
    for root, folders, files in os.walk(path):
        for name in (*folders, *files):
            yield os.path.relpath(os.path.join(root, name), path)  # noqa: PTH118 (100 times faster than Path)
