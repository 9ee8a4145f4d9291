"""How the report came about: the machine, the versions, every experiment's settings and cost."""

from __future__ import annotations

import os
from importlib import metadata
from typing import Any, Final

import numpy as np

from scla_mj.config import RunConfig, flatten
from scla_mj.experiments.report.evidence import Evidence
from scla_mj.experiments.report.study import Study
from scla_mj.experiments.report.tables import Row, Table
from scla_mj.experiments.report.wording import seeds_text
from scla_mj.runs.folder import package_versions

_OF_THE_REPORT: Final = ("scipy", "matplotlib")
_OF_THE_EXPERIMENT: Final = ("seed", "telemetry")


def provenance(study: Study) -> tuple[Table, Table, Table]:
    """Return what someone needs to make the report again: the experiments, the default settings, the versions."""
    defaults = [(name, _value(value)) for name, value in flatten(RunConfig()).items() if name not in _OF_THE_EXPERIMENT]
    versions = package_versions() | {name: metadata.version(name) for name in _OF_THE_REPORT}
    versions["processors"] = str(os.cpu_count())
    return (
        _experiments(study),
        Table("settings", {"setting": None, "default": None}, defaults),
        Table("versions", {"package": None, "version": None}, list(versions.items())),
    )


def _experiments(study: Study) -> Table:
    columns = {
        "experiment": None, "settings that differ from the defaults": None, "epochs × decisions": None,
        "finished seeds": None, "missing": 0, "failed moves": 0, "simulated, h": 2, "computed, min": 1,
    }  # fmt: skip
    rows = [_row(item) for item in study.evidence]
    groups = [item.experiment.group for item in study.evidence]
    costs = np.array([row[4:] for row in rows], dtype=np.float64).reshape(-1, 4)
    for group in dict.fromkeys(groups):
        own = np.array([name == group for name in groups])
        rows.append((f"all of group {group}", None, None, None, *costs[own].sum(axis=0).tolist()))
    return Table("experiments", columns, [*rows, ("all", None, None, None, *costs.sum(axis=0).tolist())])


def _row(item: Evidence) -> Row:
    experiment, summaries = item.experiment, [run.summary for run in item.runs]
    return (
        experiment.name,
        _changes(experiment.config),
        f"{experiment.config.epochs} × {experiment.config.decisions}",
        seeds_text(item.seeds) if item.runs else "none",
        len(item.gaps),
        sum(summary.transitions.failed for summary in summaries),
        sum(summary.simulated_s for summary in summaries) / 3600,
        sum(summary.wall_s for summary in summaries) / 60,
    )


def _changes(config: RunConfig) -> str:
    defaults, own = flatten(RunConfig()), flatten(config)
    left_out = (*_OF_THE_EXPERIMENT, "epochs", "decisions")
    changed = [f"{name} {_value(own[name])}" for name in own if own[name] != defaults[name] and name not in left_out]
    return ", ".join(changed) or "none"


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return " ".join(str(part) if isinstance(part, tuple) else _value(part) for part in value) or "none"
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)
