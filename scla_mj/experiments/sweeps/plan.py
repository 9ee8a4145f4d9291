"""What a sweep runs: every combination of the values of some settings, a list of runs, or both, with their seeds."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final

from annotated_types import Interval

from scla_mj.checked import check, option
from scla_mj.config import RunConfig, options_of
from scla_mj.errors import SclaError
from scla_mj.experiments.experiment import Experiment
from scla_mj.runs.atomic import reading, spelling
from scla_mj.validation import Section, shown, validated

MOST_RUNS: Final = 100_000
"""More than a year of one core; whoever wants more has misplaced a digit."""
_MOST_PLAN_BYTES: Final = 1e8
_LONGEST_NAME: Final = 40
_FROM_FILES: Final = ("floor-text", "robot-sha256")
"""What a run keeps of the files that it names."""
_OF_A_FLOOR: Final = ("cells", "target", "closed-cells")

Keys = tuple[str, ...]
"""The names that lead to a setting, as in `config.json`: ("automaton", "reward_rate")."""
_SEED: Final[Keys] = ("seed",)
_DEFAULTS: Final[dict[Keys, Any]] = {("telemetry",): "off"}
"""Where a sweep departs from `RunConfig`: a recording of every run would take most of its disk."""


@dataclass(frozen=True)
class Plan(Section):
    """What `--plan FILE.toml` may hold.

    `settings` are common to all runs and `runs` lists more of them, one by one; each is run with every combination of
    the lists in `vary`, which have precedence, and with `seeds` seeds from 0.
    """

    seeds: Annotated[int, Interval(ge=1, le=MOST_RUNS)] = 0
    settings: dict[str, Any] = field(default_factory=dict)
    vary: dict[str, Any] = field(default_factory=dict)
    runs: tuple[dict[str, Any], ...] = ()


def read_plan(path: Path) -> Plan:
    """Return the plan that a TOML file holds.

    Raises:
        SclaError: it is missing, not TOML, or has a key that a plan does not have.
    """
    if not path.exists():
        raise SclaError(f"--plan {path} does not exist: name a TOML file (docs/sweeps.md)")
    with reading(path, "TOML", most_bytes=_MOST_PLAN_BYTES, fault="is not a plan"):
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    return validated(Plan, content, spell=spelling(path))


def configurations(
    plan: Plan, vary: Mapping[Keys, Sequence[Any]], *, seeds: int | None = None, file: Path | None = None
) -> list[RunConfig]:
    """Return every run of a plan, read from `file`; `vary` and `seeds` override what it has of them.

    Raises:
        SclaError: a setting is unknown or out of its range, a list is empty, nothing is asked for, or far too much.
    """
    spell = option if file is None else spelling(file)
    axes = dict(_leaves(plan.vary))
    for keys, values in axes.items():
        if not isinstance(values, list):
            raise SclaError(f"{spell(('vary', *keys))} is {shown(values)}: it must be a list of values")
    given = seeds or (0 if _SEED in vary else plan.seeds)
    if seeds:
        axes.pop(_SEED, None)
    axes |= {keys: list(values) for keys, values in vary.items()}
    bases = [dict(_leaves(plan.settings)) | dict(_leaves(run)) for run in plan.runs or ({},)]
    if given and (_SEED in axes or any(_SEED in base for base in bases)):
        raise SclaError("seeds and seed are both given: leave one out (seeds 3 is seed 0 1 2)")
    axes |= {_SEED: list(range(given))} if given else {}
    for keys, values in axes.items():
        if not values:
            raise SclaError(f"{spell(('vary', *keys))} is an empty list: give it a value or leave it out")
    if not axes and not plan.runs:
        raise SclaError(
            "nothing is asked for: give --seeds N, any option of rollout with one value or several, or --plan FILE"
        )
    count = len(bases) * math.prod(map(len, axes.values()))
    if count > MOST_RUNS:
        raise SclaError(f"{count} runs are asked for: at most {MOST_RUNS} go into one sweep")
    combinations = [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]
    return [
        validated(RunConfig, _nested(_DEFAULTS | base | combination), spell=spell)
        for base, combination in itertools.product(bases, combinations)
    ]


def grouped(configs: Sequence[RunConfig]) -> tuple[Experiment, ...]:
    """Return runs that differ in their seed alone as one experiment; its name is that of its runs' folder.

    The name follows from the settings, so that another sweep into the same OUT finds the runs that they share.

    Raises:
        SclaError: a run cannot be made, or is asked for twice.
    """
    from scla_mj.brain.registry import check_brain  # imports numba

    seeds: dict[str, list[int]] = {}
    settings: dict[str, RunConfig] = {}
    for config in configs:
        plain = dataclasses.replace(check(config).config, seed=0)
        key = json.dumps(dataclasses.asdict(plain), sort_keys=True)
        if key not in settings:
            check_brain(plain)
        settings.setdefault(key, plain)
        seeds.setdefault(key, []).append(config.seed)
    names = titles(list(settings.values()))
    for title, own in zip(names, seeds.values(), strict=True):
        for seed in own:
            if own.count(seed) > 1:
                raise SclaError(f"{title}, seed {seed}, is asked for {own.count(seed)} times: once is enough")
    return tuple(
        Experiment(_name(config.brain, key), "ablation", title, "", config, tuple(seeds[key]))
        for title, (key, config) in zip(names, settings.items(), strict=True)
    )


def varied(configs: Sequence[RunConfig]) -> dict[str, list[Any]]:
    """Return the settings that differ between configurations, by their options' names, with a value for each; None
    where a brain has no such setting of its own, or a floor stands for it. Seeds are not among them."""
    rows = [_row(config) for config in configs]
    pairs = list(zip(rows, configs, strict=True))
    names = dict.fromkeys(itertools.chain(*rows))
    columns = {name: [row.get(name, _default(config.brain, name)) for row, config in pairs] for name in names}
    return {name: values for name, values in columns.items() if _differ(name, values)}


def _default(brain: str, name: str) -> Any:
    """Return a setting that a brain of ours has of its own and that was not given."""
    from scla_mj.brain.registry import BRAINS  # imports numba

    section, _, own = name.partition(".")
    kind = getattr(BRAINS.get(brain), "Settings", None) if section == "brain" else None
    return getattr(kind, own.replace("-", "_"), None)


def _differ(name: str, values: Sequence[Any]) -> bool:
    kinds = set(map(repr, values))
    return len(kinds - {repr(None)} if name in _OF_A_FLOOR else kinds) > 1


def titles(configs: Sequence[RunConfig]) -> list[str]:
    """Return for each configuration how it differs from the others, or its brain where nothing can be named."""
    columns = varied(configs)
    named = [
        ", ".join(f"{name} {text(values[index])}" for name, values in columns.items() if values[index] is not None)
        for index in range(len(configs))
    ]
    return [title or config.brain for title, config in zip(named, configs, strict=True)]


def text(value: Any) -> str:
    """Return a setting's value as a label shows it."""
    if isinstance(value, str):
        return value or "none"
    return str(value).lower() if isinstance(value, bool) else shown(value)


def _row(config: RunConfig) -> dict[str, Any]:
    without = {"seed", *_FROM_FILES, *(_OF_A_FLOOR if config.grid.floor else ())}
    return {name: value for name, value in options_of(config).items() if name not in without}


def _name(brain: str, settings: str) -> str:
    words = re.sub(r"[^A-Za-z0-9]+", "-", brain.rpartition(":")[2])[-_LONGEST_NAME:].strip("-")
    return f"{words or 'brain'}-{hashlib.sha256(settings.encode()).hexdigest()[:10]}"


def _leaves(content: Mapping[str, Any], above: Keys = ()) -> Iterator[tuple[Keys, Any]]:
    for key, value in content.items():
        if isinstance(value, dict):
            yield from _leaves(value, (*above, key))
        else:
            yield (*above, key), value


def _nested(leaves: Mapping[Keys, Any]) -> dict[str, Any]:
    content: dict[str, Any] = {}
    for keys, value in leaves.items():
        place = content
        for key in keys[:-1]:
            place = place.setdefault(key, {})
            if not isinstance(place, dict):
                raise SclaError(f"{key} is {shown(place)}: it holds settings, such as {'.'.join(keys)}")
        place[keys[-1]] = value
    return content
