"""How the report came about: the command, the machine, the versions, every experiment's settings, and the method."""

from __future__ import annotations

import os
from importlib import metadata
from typing import Any, Final

import numpy as np

from scla_mj.config import RunConfig, flatten
from scla_mj.experiments import statistics
from scla_mj.experiments.report.document import (
    Block,
    Bullets,
    Cell,
    Code,
    Column,
    Listing,
    Paragraph,
    Section,
    Table,
    Text,
)
from scla_mj.experiments.report.evidence import Evidence, Study
from scla_mj.experiments.report.names import CSV
from scla_mj.experiments.report.sections import parts
from scla_mj.runs.folder import package_versions

_COMMAND: Final = (
    "This command wrote the report. It runs what it names and OUT lacks, and reports all that OUT then holds:"
)
_OF_THE_REPORT: Final = ("scipy", "matplotlib")
_OF_THE_EXPERIMENT: Final = ("seed", "telemetry")


def making(study: Study, command: str) -> Section:
    """Return what someone needs to make the report again and to judge its method."""
    blocks: list[Block] = [Paragraph(_COMMAND), Listing(command)]
    blocks += [_experiments(study), _defaults(), _versions(), Paragraph("Method:"), Bullets(_method())]
    return Section("making", "How this was made", tuple(blocks))


def _experiments(study: Study) -> Table:
    columns = (
        Column("experiment"),
        Column("settings that differ from the defaults"),
        Column("epochs × decisions"),
        Column("finished seeds"),
        Column("missing", 0),
        Column("failed moves", 0),
        Column("simulated, h", 2),
        Column("computed, min", 1),
    )
    caption = (
        "Every experiment of the report: its settings, its scale, and what its finished runs cost: hours of simulated "
        "time, and minutes of computing summed over its runs (they run side by side, so the clock shows less). Its "
        "protocol is among the settings; its ceiling stands in the tables above."
    )
    rows = [_experiment(item) for item in study.evidence]
    groups = [item.experiment.group for item in study.evidence]
    costs = np.array([row[4:] for row in rows], dtype=np.float64).reshape(-1, 4)
    for group in dict.fromkeys(groups):
        own = np.array([name == group for name in groups])
        rows.append((f"all of group {group}", None, None, None, *costs[own].sum(axis=0).tolist()))
    rows.append(("all", None, None, None, *costs.sum(axis=0).tolist()))
    return Table("experiments", caption, columns, tuple(rows))


def _experiment(item: Evidence) -> tuple[Cell, ...]:
    experiment, summaries = item.experiment, [run.summary for run in item.runs]
    return (
        experiment.name,
        _changes(experiment.config),
        f"{experiment.config.epochs} × {experiment.config.decisions}",
        parts.seeds_text(item.seeds) if item.measured else "none",
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


def _defaults() -> Table:
    settings = {name: value for name, value in flatten(RunConfig()).items() if name not in _OF_THE_EXPERIMENT}
    rows = tuple((name, _value(value)) for name, value in settings.items())
    caption = (
        "The default settings, by the name of their command-line option; epochs and seeds as each experiment says."
    )
    return Table("settings", caption, (Column("setting"), Column("default")), rows, long=True)


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return " ".join(str(part) if isinstance(part, tuple) else _value(part) for part in value) or "none"
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)


def _versions() -> Table:
    versions = package_versions() | {name: metadata.version(name) for name in _OF_THE_REPORT}
    rows = (*versions.items(), ("processors", str(os.cpu_count())))
    caption = (
        "Versions and machine on which the report was written; each run's own config.json names those it ran with."
    )
    return Table("versions", caption, (Column("package"), Column("version")), rows)


def _method() -> tuple[Text, ...]:
    window, share = statistics.WINDOW_DECISIONS, f"{100 * statistics.MASTERY:.0f} %"
    return (
        f"A seed is the unit. Means are over seeds; the {parts.INTERVAL} is a percentile bootstrap over seeds "
        f"({statistics.BOOTSTRAP_RESAMPLES} resamples), expanded for few seeds (Hesterberg 2015) so that it is as wide "
        "as Student's; with two or three seeds it is no wider than they lie apart.",
        "Settled: the last two thirds of the epochs, 11 to 30 of 30; after a jump of the target, the epochs from the "
        "second one on.",
        f"Decisions to {share}: the first decision at which the last {window} decisions earned {share} of their "
        "ceiling; the median over seeds, a seed that never did counting as last.",
        "The ceiling is an expectation: over finitely many decisions a sample may exceed it.",
        "A target is judged only at the catalogue's scale, and if every seed and every epoch it names is there.",
        ("The data of every table and figure lie beside this page in ", Code(f"{CSV}/"), ", in full precision."),
    )
