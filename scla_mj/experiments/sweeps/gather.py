"""What a sweep found: one row for every configuration, with intervals over its seeds, and a figure of them."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib import figure as mpl
from matplotlib.ticker import AutoLocator

from scla_mj.errors import SclaError
from scla_mj.experiments import statistics
from scla_mj.experiments.experiment import Experiment
from scla_mj.experiments.report.charts import Level, Line, draw_curves, draw_dots
from scla_mj.experiments.report.evidence import Array, Evidence
from scla_mj.experiments.report.study import gather
from scla_mj.experiments.report.wording import averaged_text, band_text, setting
from scla_mj.experiments.sweeps.plan import text, varied
from scla_mj.runs import drawing
from scla_mj.runs.atomic import replacing

SWEEP_PARQUET: Final = "sweep.parquet"
SWEEP_PNG: Final = "sweep.png"
_MOST_LINES: Final = 8
"""As many curves as there are colours."""
_LEAST_POINTS: Final = 3
_WIDE: Final = 50.0
"""Values that lie so many times apart are shown on a logarithmic axis."""
_TITLE_LETTERS: Final = 100
_LINE_INCHES: Final = 0.11
"""Of a title."""


def write_table(out: Path, experiments: Sequence[Experiment]) -> Path:
    """Write `sweep.parquet` and `sweep.png` from the complete runs in `out`; return the table's path.

    Raises:
        SclaError: no run is complete, or the folder cannot be written to.
    """
    study = gather(out, experiments)
    items = [item for item in study.evidence if item.runs]
    if not items:
        gap = next(reason for _, _, reason in study.gaps())
        raise SclaError(f"{out} holds no complete run of the sweep ({gap}): workers must write into this very folder")
    with replacing(out / SWEEP_PARQUET) as scratch:
        pq.write_table(table(items), scratch, compression="zstd")
    figure = chart(items)
    title = _title(items)
    figure.suptitle(title, x=0.006, ha="left", fontsize=6.5, color=drawing.INK)
    figure.set_figheight(figure.get_figheight() + _LINE_INCHES * (1 + title.count("\n")))
    drawing.save(figure, out / SWEEP_PNG)
    return out / SWEEP_PARQUET


def _title(items: Sequence[Evidence]) -> str:
    """Return what all runs share, broken into lines at its commas and full stops."""
    brains = {item.experiment.config.brain for item in items}
    said = f"Brain {brains.pop()}. {setting(*items)}" if len(brains) == 1 else setting(*items)
    return textwrap.fill(re.sub(r"(?<![,;.]) ", "\N{NO-BREAK SPACE}", said), _TITLE_LETTERS, break_on_hyphens=False)


def table(items: Sequence[Evidence]) -> pa.Table:
    """Return one row per configuration: what was varied, where its runs lie, and what they earned (docs/sweeps.md)."""
    configs = [item.experiment.config for item in items]
    settings: dict[str, list[Any]] = {
        "brain": [config.brain for config in configs],
        "protocol": [config.protocol for config in configs],
    }
    columns = {name: _column(values) for name, values in (settings | varied(configs)).items()}
    rows = [_measures(item) for item in items]
    return pa.table(columns | {name: pa.array([row[name] for row in rows]) for name in rows[0]})


def _column(values: Sequence[Any]) -> pa.Array:
    """Return settings as they are, or where one type does not hold them as text."""
    try:
        return pa.array(values)
    except pa.ArrowException:  # of one of several kinds, by which type comes first
        return pa.array([None if value is None else text(value) for value in values])


def _measures(item: Evidence) -> dict[str, Any]:
    first, last = item.settled_within(item.epochs)
    settled = item.settled
    row: dict[str, Any] = {
        "folder": f"runs/{item.experiment.name}",
        "epochs": item.epochs,
        "decisions": item.experiment.config.decisions,
        "seeds": list(item.seeds),
        "missing_seeds": list(item.gaps),
        "ceiling_hits_per_1000": float(item.ceilings[-1]),
        "chance_hits_per_1000": float(item.chances[-1]),
        "settled_from_epoch": first,
    }
    measures = {
        "first_hits_per_1000": item.hits[:, 0],
        "hits_per_1000": settled.hits,
        "percent_of_ceiling": settled.percent,
        "percent_above_chance": settled.above_chance,
        "percent_nearer": settled.nearer,
        "regret_per_episode": settled.regret,
    }
    for name, values in measures.items():
        ends = _estimate(values)
        row |= {name: _known(ends.mean), f"{name}_low": _known(ends.low), f"{name}_high": _known(ends.high)}
    row["decisions_to_90_percent"] = [run.mastery for run in item.runs]
    row["hits_per_1000_by_seed_and_epoch"] = item.hits[:, :last].tolist()
    return row


def _estimate(values: Array) -> statistics.Estimate:
    """Return a mean with its interval; a seed that never hit has no finite regret, and some worlds have only chance."""
    if np.isfinite(values).all():
        return statistics.estimate(values)
    return statistics.Estimate(float(values.mean()), math.nan, math.nan)


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def chart(items: Sequence[Evidence]) -> mpl.Figure:
    """Draw the percent of the ceiling with its intervals.

    If a setting has numbers for values, over the one that has most of them, with a curve for every combination of the
    others; else a row for every configuration.
    """
    settings = varied([item.experiment.config for item in items])
    numbers = {name: set(values) for name, values in settings.items() if all(map(_is_number, values))}
    over = max(numbers, key=lambda name: len(numbers[name]), default="")
    labels = [item.experiment.title for item in items]
    if over and len(numbers[over]) >= _LEAST_POINTS:
        curves: dict[str, list[tuple[float, Evidence]]] = {}
        for label, x, item in zip(labels, settings[over], items, strict=True):
            others = ", ".join(part for part in label.split(", ") if part != f"{over} {text(x)}")
            curves.setdefault(others, []).append((float(x), item))
        if len(curves) <= _MOST_LINES:
            return _over_numbers(over, {name: sorted(own, key=lambda each: each[0]) for name, own in curves.items()})
    bands = np.array([statistics.band(item.settled.percent) for item in items])
    chances, band = np.array([_chance(item) for item in items]), _band(items)
    return draw_dots(
        labels,
        bands[:, 0],
        bands[:, 1:],
        chances,
        quantity=_quantity(items),
        mean=f"mean; bar: {band}" if band else "each run",
        runs=[item.settled.percent for item in items] if band else (),
    )


def _quantity(items: Sequence[Evidence]) -> str:
    return f"percent of ceiling, {averaged_text(item.settled_within(item.epochs) for item in items)}"


def _band(items: Sequence[Evidence]) -> str:
    return band_text(len(item.runs) for item in items)


def _over_numbers(over: str, curves: dict[str, list[tuple[float, Evidence]]]) -> mpl.Figure:
    lines = []
    for index, (label, points) in enumerate(curves.items()):
        bands = np.array([statistics.band(item.settled.percent) for _, item in points])
        lines.append(Line(label, index, np.array([x for x, _ in points]), statistics.Curve(*bands.T)))
    x = np.unique(np.concatenate([line.x for line in lines]))
    levels = [Level("ceiling", x, np.full(len(x), 100.0))]
    chances = {_chance(item) for points in curves.values() for _, item in points}
    levels += [Level("chance", x, np.full(len(x), value)) for value in chances if len(chances) == 1]
    items = [item for points in curves.values() for _, item in points]
    y_label = "\nband: ".join(filter(None, (_quantity(items), _band(items))))
    figure = draw_curves(lines, levels, y_label=y_label, x_label=over)
    axes = figure.axes[0]
    axes.xaxis.set_major_locator(AutoLocator())
    axes.set_xlim(auto=True)
    axes.autoscale(axis="x")
    if x[0] > 0.0 and x[-1] / x[0] > _WIDE:
        axes.set_xscale("log")
    return figure


def _chance(item: Evidence) -> float:
    return 100.0 * float(item.chances[-1] / item.ceilings[-1])


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
