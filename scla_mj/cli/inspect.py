"""`scla-mj inspect RUN`: whether a run is sound, in one line; its contents; how it differs from another run."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import tyro.conf

from scla_mj.engine.interrupts import terminable
from scla_mj.errors import SclaError
from scla_mj.grid import said
from scla_mj.paths import CHECKPOINT_NPZ

if TYPE_CHECKING:
    from scla_mj.engine.difference import RunDifference
    from scla_mj.engine.inspection import RunInspection

_EXIT_CODES: Final = {"sound": 0, "disagrees": 1, "damaged": 2}
_SEALED: Final = "sealed: each file is checked against the SHA-256 that the run left in seal.json"
_UNSEALED: Final = "unsealed: the run did not end in order; damage shows only where files do not fit each other"


@dataclass(frozen=True)
class Inspect:
    """Print in one line whether a run is sound and its files agree, then what it holds. Exit code 0: sound; 1: files
    disagree, or the two runs differ; 2: damaged."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote."""
    against: Annotated[Path | None, tyro.conf.arg(metavar="RUN")] = None
    """A second run: compare settings, decisions, summaries and brains, to the bit."""
    verbose: bool = False
    """Print every table: hits, spikes, weights, and each figure that was compared."""
    json: bool = False
    """Print one JSON object instead (docs/command-line.md lists its keys)."""

    def run(self) -> int:
        """Print the verdict and what the run holds; return the exit code.

        Raises:
            SclaError: a folder holds no run.
        """
        from scla_mj.engine import difference, inspection  # noqa: F401 (before a signal becomes an exception)

        return self._inspect()

    @terminable()
    def _inspect(self) -> int:
        from scla_mj.engine.inspection import inspect_run

        if self.against is not None:
            return self._compare(self.against)
        found = inspect_run(self.path)
        if self.json:
            _print_json(_content(found))
        else:
            print(found.sentence())
            for line in _describe(found):
                print(line)
            if self.verbose:
                from scla_mj.cli.inspect_tables import print_tables

                print_tables(found)
        return _EXIT_CODES[found.verdict]

    def _compare(self, against: Path) -> int:
        from scla_mj.engine.difference import compare_runs
        from scla_mj.engine.inspection import inspect_run

        pair = [inspect_run(path, recording=False) for path in (self.path, against)]
        damaged = [found.sentence() for found in pair if found.faults]
        if damaged:
            raise SclaError(f"cannot compare: {'; '.join(damaged)}")
        difference = compare_runs(*pair)
        if self.json:
            _print_json({"same": difference.same, **difference._asdict()})
        else:
            print(f"{self.path} and {against} {difference.sentence()}")
            for line in _describe_difference(difference):
                print(line)
        return 0 if difference.same else 1


def _content(found: RunInspection) -> dict[str, Any]:
    return {
        "run": found.path,
        "verdict": found.verdict,
        "complete": found.complete,
        "sealed": found.sealed,
        "faults": found.faults,
        "disagreements": found.disagreements,
        "settings": None if found.run is None else found.run.config,
        "versions": None if found.run is None else found.run.versions,
        "decisions": found.made,
        "hits": found.hits,
        "percent_of_ceiling": found.percent_of_ceiling,
        "percent_above_chance": found.percent_above_chance,
        "epochs": found.epochs,
        "summary": found.summary,
        "recording": found.recording,
    }


def _print_json(content: dict[str, Any]) -> None:
    import json

    print(json.dumps(_plain(content), indent=2, allow_nan=False))


def _plain(value: Any) -> Any:
    """Return what JSON can hold: of an array its shape, and null for a number that is none: a fallen robot's place."""
    if hasattr(value, "_asdict"):
        value = value._asdict()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = dataclasses.asdict(value)
    if isinstance(value, dict):
        return {str(getattr(name, "value", name)): _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else list(getattr(value, "shape", ())) or value


def _describe(found: RunInspection) -> list[str]:
    """Return the lines below the verdict."""
    lines = []
    if found.run is not None:
        from scla_mj.checked import check

        config = found.run.config
        columns, rows = config.grid.cells
        lines.append(
            f"brain {config.brain}, {config.protocol}, {columns} x {rows} cells, {said(check(config).grid().targets)}, "
            f"seed {config.seed}, telemetry {config.telemetry}"
        )
        if config.task.crossed_epoch:
            lines.append(f"the wheels are crossed from epoch {config.task.crossed_epoch} on")
    if found.epochs:
        lines.append("hits per epoch: " + " ".join(str(epoch.hits) for epoch in found.epochs))
    lines += _describe_skill(found)
    lines.append(_SEALED if found.sealed else _UNSEALED)
    if found.verdict != "damaged" and not found.complete:
        from scla_mj.cli.run_command import resume_command
        from scla_mj.engine.lock import is_in_use

        assert found.run is not None
        command, own = resume_command(found.path, found.run.config), ":" in found.run.config.brain
        if is_in_use(found.path):
            lines.append("another process is running it")
        elif own and not found.run.file(CHECKPOINT_NPZ).exists():
            lines.append(f"no checkpoint: {command} starts it again, if its brain has state() and restore()")
        else:
            lines.append(f"{command} continues it")
    return lines


def _describe_skill(found: RunInspection) -> list[str]:
    """Return what the hits mean beside chance, and what does not depend on where the robot was put down."""
    if found.run is None or not found.made:
        return []
    from scla_mj.checked import check

    chance, above = check(found.run.config).chance_hits_per_1000(), found.percent_above_chance
    earned = "nothing earns more" if above is None else f"{above:.1f} % of the way from chance to the ceiling"
    lines = [f"chance {chance:.2f} per 1000: {earned}"]
    if found.summary is not None:
        regrets = [epoch.regret_per_episode for epoch in found.summary.epochs]
        for what, values in (
            ("moves nearer, %", [f"{100 * epoch.share_nearer:.1f}" for epoch in found.summary.epochs]),
            ("regret, moves per episode", ["-" if regret is None else f"{regret:.2f}" for regret in regrets]),
        ):
            lines.append(f"{what}: {' '.join(values)}")
    return lines


def _describe_difference(difference: RunDifference) -> list[str]:
    pairs = [(f"--{name}", tuple(map(_said, pair))) for name, pair in difference.settings.items()]
    first = difference.decisions
    if first is not None:
        here = f"epoch {first.epoch}, decision {first.decision}"
        pairs += [(f"{here}, {name}", pair) for name, pair in first.columns.items()]
    pairs += [(f"made with {name}", pair) for name, pair in difference.versions.items()]
    return [f"{name}: {one} | {other}" for name, (one, other) in pairs]


def _said(value: Any) -> Any:
    """Return a setting's value, in words where a run has none: a brain's own setting that was not given."""
    return "not given" if value is None else value
