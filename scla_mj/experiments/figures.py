"""Figures of one or of several runs for a paper: what they earned, their synapses, their policies.

Runs that differ in nothing but the seed are one line with a band: `statistics.band`.
"""

from __future__ import annotations

import dataclasses
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from scla_mj.engine.stored_run import StoredRun
from scla_mj.errors import SclaError
from scla_mj.experiments import statistics
from scla_mj.experiments.report.charts import DASHES, SERIES
from scla_mj.experiments.report.wording import band_text, seeds_text
from scla_mj.experiments.sweeps.plan import titles
from scla_mj.paths import BRAIN_NPZ, DECISIONS_PARQUET, SUMMARY_JSON
from scla_mj.runs import drawing, plots
from scla_mj.runs.atomic import replacing, writing
from scla_mj.runs.seal import check_seal

COLUMN_MM: Final = 85.0
_POINTS: Final = 60
"""Of a band of weights: more than the eye parts on a log axis."""
_BINS: Final = 40
_KINDS: Final = ("the same direction", "opposite directions")
"""What sensor and motor of a solid and of a dashed projection are of."""
_KEY_SHARE: Final = 0.6
"""Of the axis of a histogram, left free above it for its key."""
_LEGEND_LETTERS: Final = 56
_LONGEST_NAME: Final = 60
_TAKEN: Final = "{} is already there: choose another folder for the figures, or remove it first"


class Group(NamedTuple):
    """Runs of the same settings, one or more seeds, and what the legend calls them."""

    runs: tuple[StoredRun, ...]
    label: str

    @property
    def first(self) -> StoredRun:
        """The run whose arena and anatomy stand for all."""
        return self.runs[0]

    @property
    def seeds(self) -> str:
        """Which seeds, in words."""
        seeds = [run.config.seed for run in self.runs]
        return seeds_text(seeds) if len(seeds) > 1 else f"seed {seeds[0]}"

    @property
    def setting(self) -> str:
        """Brain, protocol, arena and seeds in words."""
        return plots.setting(self.first.summary, self.seeds)

    @property
    def has_weights(self) -> bool:
        """Whether the brain has synapses that change."""
        return self.first.brain.weights is not None and self.first.anatomy is not None


def draw_runs(
    folders: Sequence[Path], out: Path, *, kinds: Sequence[drawing.Kind] = ("png", "pdf", "svg")
) -> list[Path]:
    """Draw `learning`, and for every group with synapses `weights`, with automata `policy`; return the files.

    Raises:
        SclaError: a run is missing, damaged or twice, or has no summary; a file is already in `out`, or cannot be
            written.
    """
    for folder in folders:
        check_seal(folder, SUMMARY_JSON, DECISIONS_PARQUET, BRAIN_NPZ)
    groups = _grouped([StoredRun(folder) for folder in folders])
    figures = {"learning": _learning(groups)}
    for group, suffix in zip(groups, _suffixes(groups), strict=True):
        if group.has_weights:
            figures[f"weights{suffix}"] = _weights(group)
        if group.first.brain.probabilities is not None:
            figures[f"policy{suffix}"] = _policy(group)
    return _written(figures, out, kinds)


def _grouped(runs: Sequence[StoredRun]) -> list[Group]:
    alike: dict[str, list[StoredRun]] = {}
    for run in runs:
        alike.setdefault(repr(dataclasses.replace(run.config, seed=0, telemetry="off")), []).append(run)
    firsts = [own[0] for own in alike.values()]
    plain = [dataclasses.replace(run.config.task, crossed_epoch=0) for run in firsts]  # it has words of its own
    named = titles([dataclasses.replace(r.config, telemetry="off", task=t) for r, t in zip(firsts, plain, strict=True)])
    names = [f"{name}{plots.crossed(run.summary)}" for name, run in zip(named, firsts, strict=True)]
    groups = []
    for name, own in zip(names, alike.values(), strict=True):
        seeds = [run.config.seed for run in own]
        if len(set(seeds)) < len(seeds):
            twice = next(run for run in own if seeds.count(run.config.seed) > 1)
            raise SclaError(f"{twice.path} has the settings and the seed of another of the runs: name each run once")
        groups.append(Group(tuple(own), name if names.count(name) == 1 else f"{name}, {own[0].path.name}"))
    return groups


def _suffixes(groups: Sequence[Group]) -> list[str]:
    """Return what tells the groups' files apart."""
    if len(groups) == 1:
        return [""]
    words = [re.sub(r"[^\w.]+", "-", group.label)[:_LONGEST_NAME].strip("-") for group in groups]
    return [f"-{name}" if words.count(name) == 1 else f"-{name}-{number}" for number, name in enumerate(words, 1)]


def _learning(groups: Sequence[Group]) -> Figure:
    """Return hits over the decisions and, of a single group with synapses, mean weights and their histogram."""
    alone = len(groups) == 1 and groups[0].has_weights
    with drawing.canvas(height_mm=62 if alone else 80, columns=3 if alone else 1) as (figure, grid):
        axes: Axes = grid[0, 0]
        alike = len({group.seeds for group in groups}) == 1
        for index, group in enumerate(groups):
            x, curve = _hits(group)
            label = group.label if alike else f"{group.label}, {group.seeds}"
            label = textwrap.fill(label, _LEGEND_LETTERS, break_on_hyphens=False)
            look = SERIES[index % len(SERIES)], DASHES[index % len(DASHES)]
            drawing.draw_line(axes, x, curve, *look, label, marked=True)
        plots.draw_bounds(axes, *(group.first.summary for group in groups))
        figure.suptitle(_caption(groups), fontsize=6.5, color=drawing.SOFT)
        if len(groups) > 1:
            figure.legend(loc="outside lower left", ncols=2, handlelength=2.6)
        if alone:
            _draw_weights(grid[0, 1], groups[0])
            _draw_histogram(grid[0, 2], groups[0])
            for panel, letter, title in zip(grid[0], "abc", ("Hits", "Synapses", "Weights at the end"), strict=True):
                panel.set_title(f"{letter}  {title}", pad=14)
        return figure


def _caption(groups: Sequence[Group]) -> str:
    """Return what all groups share, and what their bands are."""
    named = zip(*((*plots.parts(group.first.summary), group.seeds) for group in groups), strict=True)
    shared = ", ".join(own[0] for own in named if len(set(own)) == 1)
    return "; ".join(filter(None, (groups[0].setting if len(groups) == 1 else shared, _band(*groups))))


def _band(*groups: Group) -> str:
    """Return what the bands are, in words; empty where there are none."""
    text = band_text(len(group.runs) for group in groups)
    return text and f"band: {text}"


def _hits(group: Group) -> tuple[drawing.Array, drawing.Curve]:
    hits = [run.decisions["hit"].to_numpy() for run in group.runs]
    edges = drawing.block_edges(min(map(len, hits)))
    blocks = np.array([drawing.block_hits(own, edges) for own in hits])
    return drawing.block_middles(edges), statistics.band(blocks)


def _draw_weights(axes: Axes, group: Group) -> None:
    assert group.first.anatomy is not None
    histories = [run.weight_history for run in group.runs]
    count = min(len(history.decision) for history in histories)
    spaced = np.geomspace(1, count, _POINTS if len(histories) > 1 else count)
    kept = np.unique(np.round(spaced).astype(int)) - 1
    means = np.array([history.mean_weights[kept] for history in histories])
    x = histories[0].decision[kept].astype(float)
    drawing.draw_weights(axes, x, statistics.band(means), group.first.anatomy.projections)
    drawing.over_decisions(axes, plots.epoch_ends(group.first.summary))


def _draw_histogram(axes: Axes, group: Group) -> None:
    """Draw the shares of synapses by weight: of the paper's brain by whether sensor and motor agree."""
    assert group.first.anatomy is not None
    projections = group.first.anatomy.projections
    dashed = [[projection.name for projection in projections if projection.dashed is kind] for kind in (False, True)]
    kinds = dict(zip(_KINDS, dashed, strict=True)) if all(dashed) else {"": dashed[0] + dashed[1]}
    weights = [group.first.anatomy.by_projection(run.brain.weights) for run in group.runs]
    ends = [end for projection in projections for end in projection.weight_range or ()]
    ends += [end(own[projection.name]) for own in weights for projection in projections for end in (np.min, np.max)]
    bins = np.linspace(min(ends), max(ends), _BINS + 1).tolist()
    looks: tuple[dict[str, Any], ...] = (
        {"histtype": "stepfilled", "color": drawing.INK, "alpha": 0.85},
        {"histtype": "step", "color": SERIES[1]},
    )
    for (kind, names), look in zip(kinds.items(), looks, strict=False):
        values = np.concatenate([own[name].ravel() for own in weights for name in names]).astype(float)
        axes.hist(values, bins, weights=np.full(len(values), 100.0 / max(len(values), 1)), label=kind, **look)
    axes.set_yscale("log")
    axes.set_xlabel("weight (mV)")
    axes.set_ylabel("share of synapses (%)")
    if len(kinds) > 1:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (high / low) ** _KEY_SHARE)
        axes.yaxis.set_major_locator(FixedLocator([10.0**power for power in range(-9, 3)]))  # none above 100 %
        axes.yaxis.set_minor_locator(NullLocator())
        axes.legend(title="sensor and motor of", loc="upper left", handlelength=1.2, alignment="left", fontsize=6.5,
                    title_fontsize=6.5, borderaxespad=0.0)  # fmt: skip


def _weights(group: Group) -> Figure:
    with drawing.canvas(width_mm=130, height_mm=75) as (figure, grid):
        _draw_weights(grid[0, 0], group)
        assert group.first.anatomy is not None
        title = f"Mean weights of the projections{plots.dashes(group.first.anatomy.projections)}"
        plots.entitle(figure, title, group.setting, _band(group))
        return figure


def _policy(group: Group) -> Figure:
    arena = group.first.checked.grid(group.first.summary.epochs[-1].epoch)
    mean = np.mean([np.asarray(run.brain.probabilities) for run in group.runs], axis=0)
    width_mm, height_mm = plots.policy_size(*arena.cells)
    with drawing.canvas(width_mm=max(width_mm, COLUMN_MM), height_mm=height_mm) as (figure, grid):
        shades = drawing.draw_policy(grid[0, 0], arena, mean)
        grid[0, 0].set(xlabel="x", ylabel="y")
        figure.colorbar(shades, ax=grid[0, 0], label="probability", shrink=0.85)
        mean_of = f", mean over {len(group.runs)} seeds" if len(group.runs) > 1 else ""
        plots.entitle(figure, f"Action probabilities of the cells{mean_of}", group.setting, drawing.POLICY_KEY)
        return figure


def _written(figures: dict[str, Figure], out: Path, kinds: Sequence[drawing.Kind]) -> list[Path]:
    files = {out / f"{name}.{kind}": (figure, kind) for name, figure in figures.items() for kind in kinds}
    for file in files:
        if file.exists():
            raise SclaError(_TAKEN.format(file))
    with writing(out, folder="--out"):
        out.mkdir(parents=True, exist_ok=True)
    for file, (figure, kind) in files.items():
        with replacing(file, taken=_TAKEN.format(file), folder="--out") as scratch:
            drawing.save(figure, scratch, kind=kind, salt=file.stem)
    return list(files)
