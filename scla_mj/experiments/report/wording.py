"""What captions and sentences say of runs: seeds, scales and settings, a range where experiments differ."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scla_mj.experiments import statistics
from scla_mj.experiments.experiment import Experiment
from scla_mj.experiments.report.evidence import Array, Evidence
from scla_mj.experiments.report.tables import INTERVAL, measured, number


def seeds_text(seeds: Sequence[int]) -> str:
    """Return how many seeds and which."""
    ordered = sorted(seeds)
    gapless = len(ordered) > 1 and ordered == list(range(ordered[0], ordered[-1] + 1))
    listed = f"{ordered[0]} to {ordered[-1]}" if gapless else ", ".join(map(str, ordered))
    return f"{len(ordered)} seed{'s' if len(ordered) != 1 else ''} ({listed})"


def band_text(counts: Iterable[int]) -> str:
    """Return what `statistics.band` is of groups of so many seeds; empty if each has one."""
    several = {count for count in counts if count > 1}
    few = {count for count in several if count < statistics.LEAST_SEEDS}
    kinds = {f"95 % interval of the mean over {_either([*several - few])} seeds": several - few,
             f"range of {_either([*few])} runs": few}  # fmt: skip
    return ", ".join(text for text, own in kinds.items() if own)


def averaged_text(spans: Iterable[tuple[int, int]]) -> str:
    """Return which epochs means are over, from the first to the last of each: settled if none is the run's first."""
    distinct = sorted(set(spans))
    if len(distinct) > 2:
        return "the last two thirds of the epochs"
    kind = "" if distinct[0][0] == 1 else "settled "
    return kind + " or ".join(
        f"epoch {last}" if first == last else f"epochs {first} to {last}" for first, last in distinct
    )


def distinct(items: Iterable[Evidence]) -> list[Evidence]:
    """Return every experiment once, in the order of the first ones."""
    return list({item.experiment.name: item for item in items}.values())


def labels(items: Sequence[Evidence]) -> list[str]:
    """Return the titles without the last parts, between commas, that all of them share."""
    parts = [item.experiment.title.split(", ") for item in items]
    while len(parts) > 1 and min(map(len, parts)) > 1 and len({each[-1] for each in parts}) == 1:
        parts = [each[:-1] for each in parts]
    return [", ".join(each) for each in parts]


def setting(*items: Evidence) -> str:
    """Return the sentence that ends a caption: protocol, ceiling, chance, seeds, epochs; a range where they differ."""
    by_protocol: dict[str, list[Evidence]] = {}
    for item in items:
        by_protocol.setdefault(item.experiment.config.protocol, []).append(item)
    protocols = " and ".join(f"{name} ({_bounds(own)})" for name, own in by_protocol.items())
    epochs = _several([item.epochs for item in items])
    decisions = _several([item.experiment.config.decisions for item in items])
    seeds = " or ".join(dict.fromkeys(seeds_text(item.seeds) for item in items))
    span = f"{epochs} epoch{'' if epochs == '1' else 's'} of {decisions} decisions"
    return f"Protocol {protocols}, in hits per 1000 decisions; {seeds}; {span}."


def _bounds(items: Sequence[Evidence]) -> str:
    ceilings = [value for item in items for value in item.ceilings]
    chances = [value for item in items for value in item.chances]
    return f"ceiling {_several(ceilings, '{:.2f}')}, chance {_several(chances, '{:.2f}')}"


def scale_text(experiments: Sequence[Experiment]) -> str:
    """Return the scale of some experiments in words: seeds, epochs and decisions, a range where they differ."""
    scales = [(len(each.seeds), each.config.epochs, each.config.decisions) for each in experiments]
    seeds, epochs, decisions = map(_either, zip(*scales, strict=True))
    seed, epoch = ("" if count == "1" else "s" for count in (seeds, epochs))
    return f"{seeds} seed{seed} and {epochs} epoch{epoch} of {decisions} decisions"


def _several(values: Sequence[float], form: str = "{}", both: str = " and ") -> str:
    distinct = list(dict.fromkeys(form.format(value) for value in sorted(values)))
    return both.join(distinct) if len(distinct) < 3 else f"{distinct[0]} to {distinct[-1]}"


def _either(values: Sequence[int]) -> str:
    return _several(values, both=" or ")


def mean_text(values: Array, decimals: int) -> str:
    """Return a mean over seeds and its interval in words."""
    mean, interval = measured(values)
    middle = number(mean, decimals)
    if interval is None:
        return middle
    return f"{middle} ({INTERVAL} {number(interval.low, decimals)} to {number(interval.high, decimals)})"
