"""Learners that people know, and ours, with the same robot through the same environment: hits per 1000 decisions.

Every learner is measured with every seed, into OUT/curves; a finished curve is not computed again. Then figure, table
and data are written to OUT, and with `--take` to docs/learners, docs/learners.md and README.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import json
import re
import shutil
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
import tyro
from annotated_types import Ge

from scla_mj import envs
from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.experiments import exact, statistics
from scla_mj.experiments.report.charts import Level, Line, curve_rows, draw_curves
from scla_mj.experiments.report.origin import UNKNOWN, origin
from scla_mj.experiments.report.render import markdown_rows
from scla_mj.experiments.report.tables import INTERVAL, Figure, Table, measured, write_csv
from scla_mj.experiments.report.wording import seeds_text
from scla_mj.extras import need
from scla_mj.runs import drawing
from scla_mj.runs.atomic import read_json, replacing, write_json, writing
from scla_mj.runs.folder import package_versions

ROOT: Final = Path(__file__).resolve().parents[1]
FIGURE, DATA, MADE_BY, TEXT, SHORT = "learners.png", "csv", "made-by.json", "learners.md", "short.md"
_BLOCK: Final = re.compile(r"(<!-- learners -->\n)(.*?)(<!-- /learners -->\n)", re.DOTALL)
NAMES: Final = ("learner", SETTINGS := "settings")
_THOUSANDS: Final = {1: "1st", 2: "2nd", 3: "3rd", 10: "10th"}
_FOREIGN: Final = ("gymnasium", "stable_baselines3", "torch")
Learn = Callable[[Any, int, int], object]  # in an environment, for so many decisions, with a seed


class Learner(NamedTuple):
    """One line of the figure; `prepare` imports what it needs and returns how it learns, and its settings."""

    title: str
    prepare: Callable[[], tuple[Learn, Mapping[str, Any]]]
    observation: str = "sensing"


class Curve(NamedTuple):
    """What one learner earned with one seed: `hits` are numbers of decisions, from 1."""

    settings: Mapping[str, Any]
    seed: int
    decisions: int
    hits: Sequence[int]
    cpu_s: float
    origin: Mapping[str, Any]
    versions: Mapping[str, str]


def _example(name: str) -> Any:
    sys.path.insert(0, str(ROOT / "examples"))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.pop(0)


def _of_stable_baselines(algorithm: str, *, tuned: bool) -> tuple[Learn, Mapping[str, Any]]:
    need("stable_baselines3", algorithm.upper())
    module = _example("stable_baselines")
    settings = module.TUNED[algorithm] if tuned else {}
    return functools.partial(module.learn, algorithm=algorithm, **settings), settings


def _of_the_table() -> tuple[Learn, Mapping[str, Any]]:
    module = _example("tabular_q")
    given = inspect.signature(module.learn).parameters.values()
    return module.learn, {one.name: one.default for one in given if one.default is not one.empty}


def _of_a_brain(name: str, **settings: Any) -> tuple[Learn, Mapping[str, Any]]:
    def learn(env: Any, decisions: int, seed: int) -> None:
        config = RunConfig(brain=name, brain_settings=settings, seed=seed)
        envs.play(env, envs.BrainAgent.of_grid_move(config), decisions, seed=seed)

    return learn, {"brain": name} | {f"brain.{key}": value for key, value in settings.items()}


LEARNERS: Final = {
    "scla": Learner("SCLA with one dopamine", functools.partial(_of_a_brain, "scla")),
    "dyna-q": Learner("Dyna-Q with a reflex", functools.partial(_of_a_brain, "dyna-q", sensing="reflex")),
    "tabular-q": Learner("tabular Q, optimistic and greedy", _of_the_table, "index"),
    "dqn": Learner("DQN of Stable-Baselines3, tuned", functools.partial(_of_stable_baselines, "dqn", tuned=True)),
    "ppo": Learner("PPO of Stable-Baselines3, tuned", functools.partial(_of_stable_baselines, "ppo", tuned=True)),
    "dqn-defaults": Learner("DQN, the library's defaults", functools.partial(_of_stable_baselines, "dqn", tuned=False)),
    "ppo-defaults": Learner("PPO, the library's defaults", functools.partial(_of_stable_baselines, "ppo", tuned=False)),
}


@dataclass(frozen=True)
class Options:
    """Measure learners on the robot, then draw and tabulate them."""

    out: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="OUT")]
    """Folder of the curves and of what is made of them; what it holds of both is not computed again."""
    seeds: tuple[int, ...] = (10, 11, 12, 13, 14)
    """Of every learner."""
    decisions: Annotated[int, Ge(1000)] = 10_000
    """Decisions of a curve, a multiple of 1000."""
    learners: tuple[str, ...] = tuple(LEARNERS)
    """Which ones."""
    take: bool = False
    """Also put the results into docs/learners, docs/learners.md and README."""


def measure(name: str, seed: int, decisions: int, path: Path) -> None:
    """Write one learner's curve with one seed, unless it is there.

    Raises:
        SclaError: a curve of other settings is there; or a package is missing.
    """
    learner = LEARNERS[name]
    learn, settings = learner.prepare()
    if path.exists():
        held = Curve(**read_json(path))
        if (dict(held.settings), held.decisions) != (dict(settings), decisions):
            raise SclaError(f"{path} has other settings: choose another OUT or move that file away")
        return
    learn(_environment(learner), 10, seed)  # what is compiled or loaded at first is no learning
    env, began_s = _environment(learner), time.process_time()
    learn(env, decisions, seed)
    cpu_s = time.process_time() - began_s
    hits = (np.flatnonzero(env.hits[:decisions]) + 1).tolist()
    versions = package_versions() | {name: metadata.version(name) for name in _FOREIGN if find_spec(name)}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, Curve(settings, seed, decisions, hits, cpu_s, origin()._asdict(), versions)._asdict())


def _environment(learner: Learner) -> Any:
    """Return the robot in episodes that only a hit ends, as in a rollout."""
    make = functools.partial(need("gymnasium", "the environment").make, "scla_mj.envs:scla_mj/GridMove-v0")
    return envs.HitRecorder(make(observation=learner.observation, max_episode_steps=-1))


def measure_all(options: Options) -> dict[str, list[Curve]]:
    """Measure what OUT lacks; return all curves by learner.

    Raises:
        SclaError: an option is not possible, or as `measure`.
    """
    unknown = [name for name in options.learners if name not in LEARNERS]
    if unknown or not options.learners or not options.seeds or options.decisions % 1000:
        names = ", ".join(LEARNERS)
        raise SclaError(f"--learners takes names among {names}, --seeds one or more, --decisions a multiple of 1000")
    if options.take and set(options.learners) != set(LEARNERS):
        raise SclaError("--take puts all learners into the pages: leave --learners out")
    curves: dict[str, list[Curve]] = {}
    for name in options.learners:
        for seed in options.seeds:
            path = options.out / "curves" / name / f"seed-{seed:02d}.json"
            measure(name, seed, options.decisions, path)
            curves.setdefault(name, []).append(Curve(**read_json(path)))
    return curves


def table(curves: Mapping[str, Sequence[Curve]]) -> Table:
    """Return means and intervals over seeds of some thousands, with the mean cost."""
    columns: dict[str, int | None] = {**dict.fromkeys(NAMES), "seeds": None}
    decisions = _decisions(curves)
    thousands = [which for which in _THOUSANDS if 1000 * which <= decisions]
    for which in thousands:
        columns |= {f"{_THOUSANDS[which]} thousand": 1, f"{_THOUSANDS[which]}: {INTERVAL}": 1}
    columns[f"CPU s for {decisions}"] = 0
    rows = []
    for name, own in curves.items():
        hits = _rates(own, range(0, decisions + 1, 1000))
        cells = [cell for which in thousands for cell in measured(hits[:, which - 1])]
        settings = ", ".join(f"{key} {value}" for key, value in own[0].settings.items()) or "none"
        seeds = seeds_text([curve.seed for curve in own])
        rows.append((LEARNERS[name].title, settings, seeds, *cells, float(np.mean([curve.cpu_s for curve in own]))))
    return Table("learners", columns, rows)


def figure(curves: Mapping[str, Sequence[Curve]]) -> Figure:
    """Return the curves with their bands over seeds, on a logarithmic axis of decisions."""
    decisions, edges = _decisions(curves), [0]
    while edges[-1] < decisions:  # windows of a fifth of what went before, at least 100
        edges.append(min(decisions, edges[-1] + max(100, round(0.2 * edges[-1]))))
    x, ends = np.array(edges[1:], np.float64), np.array([90.0, 1.02 * decisions])
    lines = [Line(LEARNERS[name].title, index, x, statistics.learning_curve(_rates(own, edges)))
             for index, (name, own) in enumerate(curves.items())]  # fmt: skip
    bounds = {"ceiling": check(RunConfig()).ceiling_hits_per_1000(), "random walk": exact.random_walk("any-start")}
    levels = [Level(f"{name} {value:.1f}", ends, np.full(2, value)) for name, value in bounds.items()]
    chart = draw_curves(lines, levels, y_label="hits per 1000 decisions", x_label="decisions, logarithmic")
    axes = chart.axes[0]
    axes.set(xscale="log", xlim=ends)
    axes.xaxis.set_major_formatter("{x:,.0f}")
    rows = [row for line in lines for row in curve_rows(line.label, line.x, line.curve)]
    return Figure("learners", {"series": None, "decision": 0, "hits per 1000": 2, INTERVAL: 2}, rows, chart=chart)


def _decisions(curves: Mapping[str, Sequence[Curve]]) -> int:
    return next(iter(curves.values()))[0].decisions


def _rates(curves: Sequence[Curve], edges: Sequence[int]) -> statistics.Array:
    """Return hits per 1000 of every curve between edges (n + 1,): (curves, n)."""
    counts = [np.histogram(curve.hits, np.array(edges) + 0.5)[0] for curve in curves]
    return 1000.0 * np.array(counts) / np.diff(edges)


def write(out: Path, curves: Mapping[str, Sequence[Curve]]) -> None:
    """Write figure, tables, data, and which commits made the curves, to OUT."""
    chart, rows = figure(curves), table(curves)
    every = [curve for own in curves.values() for curve in own]
    same = len({json.dumps([curve.origin["bits"], curve.versions]) for curve in every}) == 1
    commits = ", ".join(sorted({curve.origin["commit"] for curve in every})) if same else UNKNOWN
    changed = any(curve.origin["changed"] for curve in every)
    by = {**every[0].origin, "commit": commits, "changed": changed, "versions": every[0].versions}
    (out / DATA).mkdir(parents=True, exist_ok=True)
    write_csv(out / chart.data, chart)
    write_csv(out / rows.data, rows)
    drawing.save(chart.chart, out / FIGURE)
    for file, text in (
        (TEXT, f"{_part(rows, lambda name: name != SETTINGS)}\n\n{_part(rows, lambda name: name in NAMES)}"),
        (SHORT, _part(rows, lambda name: name != SETTINGS and not name.endswith(INTERVAL))),
        (MADE_BY, json.dumps(by, indent=2)),
    ):
        with replacing(out / file) as scratch:
            scratch.write_text(text + "\n", encoding="utf-8")


def _part(whole: Table, wanted: Callable[[str], bool]) -> str:
    """Return some columns of a table as Markdown."""
    kept = [index for index, name in enumerate(whole.columns) if wanted(name)]
    columns = {name: decimals for name, decimals in whole.columns.items() if wanted(name)}
    return markdown_rows(Table(whole.key, columns, [tuple(row[index] for index in kept) for row in whole.rows]))


def texts(root: Path) -> dict[Path, str]:
    """Return what README and docs/learners.md should be: the tables in docs/learners in their places.

    Raises:
        SclaError: a page has no place for its table.
    """
    found = {}
    for page, source in ((root / "docs/learners.md", TEXT), (root / "README.md", SHORT)):
        held, rows = page.read_text(encoding="utf-8"), (root / "docs/learners" / source).read_text(encoding="utf-8")
        if len(_BLOCK.findall(held)) != 1:
            raise SclaError(f"{page} needs the lines <!-- learners --> and <!-- /learners -->, once each")
        found[page] = _BLOCK.sub(lambda part, rows=rows: f"{part[1]}{rows}{part[3]}", held)  # type: ignore[misc]
    return found


def take(out: Path, root: Path) -> None:
    """Put the results in OUT into docs and README.

    Raises:
        SclaError: they are not all of commits with the same bits.
    """
    made_by = json.loads((out / MADE_BY).read_text(encoding="utf-8"))
    if UNKNOWN in made_by["commit"] or made_by["changed"]:
        raise SclaError(f"{out} was not made by commits with the same bits and versions: commit, and use a new OUT")
    docs = root / "docs/learners"
    shutil.rmtree(docs, ignore_errors=True)
    (docs / DATA).mkdir(parents=True)
    for name in (FIGURE, MADE_BY, TEXT, SHORT, *(str(path.relative_to(out)) for path in (out / DATA).iterdir())):
        shutil.copyfile(out / name, docs / name)
    for page, text in texts(root).items():
        page.write_text(text, encoding="utf-8")


def main(options: Options) -> None:
    """Carry it out."""
    curves = measure_all(options)
    with writing(options.out, folder="OUT"):
        write(options.out, curves)
    if options.take:
        take(options.out, ROOT)
    print((options.out / SHORT).read_text(encoding="utf-8"), end="")


if __name__ == "__main__":
    try:
        main(tyro.cli(Options, description=__doc__))
    except SclaError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
