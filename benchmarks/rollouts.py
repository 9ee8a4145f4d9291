"""What a rollout costs compared with its bare parts: bare physics and bare neurons, replaying its very inputs."""

from __future__ import annotations

import dataclasses
import itertools
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final, NamedTuple

from benchmarks.replay import Recorded, record, replay_network, replay_physics
from benchmarks.table import BOUND_ABOVE, Sheet, against, doubted
from benchmarks.timing import Contender, Watch, median_cpu_s, nothing, paced, turns
from scla_mj import paths
from scla_mj.brain.network.network import Network
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import check
from scla_mj.config import RunConfig, Telemetry
from scla_mj.engine.build import simulate
from scla_mj.engine.rollout import rollout

TELEMETRY: Final[tuple[Telemetry, ...]] = ("off", "light", "full")
RATIO_TARGETS: Final = {"off": 1.10, "light": 1.25, "full": 2.0}
_LIGHT_KB_TARGET: Final = 8.0
_LONG: Final = 10
"""How many times as long is the run whose recording is weighed: its first tenth has half of the weights' pictures."""
_SPIKE_BYTES_TARGET: Final = 6.0


class Cost(NamedTuple):
    """CPU milliseconds, medians over repetitions, and bytes.

    `physics`, `network`: a decision of the bare parts. `decision`: one of the whole rollout, by telemetry;
    `fixed`: what a run costs beyond its decisions: building the world, opening and closing the files.
    `recording_bytes`: recording.rrd per decision, light and full, and light of a "long" run; `spikes`: per decision.
    """

    decisions: int
    network_ms: float
    spikes: float
    physics: float
    network: float
    decision: dict[str, float]
    fixed: dict[str, float]
    recording_bytes: dict[str, float]

    def ratio(self, telemetry: Telemetry) -> float:
        """Return a whole decision's cost over that of its bare parts."""
        return self.decision[telemetry] / (self.physics + self.network)

    def ratio_with_fixed(self, telemetry: Telemetry) -> float:
        """Return the same with the run's fixed cost spread over its decisions."""
        whole = self.decision[telemetry] + self.fixed[telemetry] / self.decisions
        return whole / (self.physics + self.network)


def measure(config: RunConfig, *, repetitions: int, watch: Watch) -> Cost:
    """Time bare parts and whole rollouts of the same decisions in turn.

    A whole rollout is run at its full length and with one decision: the difference is what the decisions cost, the rest
    is fixed.

    Raises:
        SclaError: the configuration has no network to replay.
    """
    recorded = record(config)
    decisions = config.epochs * config.decisions
    sizes = {"long": _recording_size(dataclasses.replace(config, epochs=_LONG * config.epochs, telemetry="light"))}
    seconds = median_cpu_s(_contenders(config, recorded, sizes), repetitions=repetitions, watch=watch)
    return derive(seconds, sizes, decisions=decisions, network_ms=recorded.network_ms, spikes=recorded.spikes)


def derive(seconds: dict[str, float], sizes: dict[str, int], *, decisions: int, network_ms: int, spikes: int) -> Cost:
    """Turn the contenders' CPU seconds and the recordings' sizes into costs per decision; see `measure`."""
    more = max(decisions - 1, 1)
    decision: dict[str, float] = {name: 1000.0 * (seconds[name] - seconds[f"one {name}"]) / more for name in TELEMETRY}
    return Cost(
        decisions=decisions,
        network_ms=network_ms / decisions,
        spikes=spikes / decisions,
        physics=1000.0 * seconds["physics"] / decisions,
        network=1000.0 * seconds["network"] / decisions,
        decision=decision,
        fixed={name: 1000.0 * seconds[f"one {name}"] - decision[name] for name in TELEMETRY},
        recording_bytes={name: (sizes[name] - sizes[f"one {name}"]) / more for name in TELEMETRY[1:]}
        | {"long": sizes["long"] / (_LONG * decisions)},
    )


def sheets(cost: Cost) -> list[Sheet]:
    """Return the tables of a rollout's cost."""
    return [_cost_sheet(cost), _recording_sheet(cost)]


def _cost_sheet(cost: Cost) -> Sheet:
    rows = [
        ("bare mj_step", f"{cost.physics:.3f}", "", "", "", ""),
        ("bare network kernel", f"{cost.network:.3f}", "", "", "", ""),
    ]
    values = {"physics_ms": cost.physics, "network_ms": cost.network, "neural_steps_a_decision": cost.network_ms}
    for name in TELEMETRY:
        ratio, whole = cost.ratio(name), cost.ratio_with_fixed(name)
        rows.append(
            (
                f"rollout, telemetry {name}",
                f"{cost.decision[name]:.3f}",
                f"{ratio:.2f}",
                against(ratio, RATIO_TARGETS[name]),
                f"{cost.fixed[name]:.0f}",
                f"{whole:.2f}",
            )
        )
        values |= {f"{name}_ms": cost.decision[name], f"{name}_fixed_ms": cost.fixed[name], f"{name}_ratio": ratio}
        values |= {f"{name}_ratio_with_fixed": whole, f"{name}_decisions_per_s": 1000.0 / cost.decision[name]}
    table = Sheet(
        "rollout",
        f"CPU time per decision, {cost.decisions} decisions",
        ("what", "ms", "over bare parts", "target", "fixed ms", "fixed included"),
        tuple(rows),
        "The bare parts replay the rollout's own controls and inputs. Fixed: once per run, building the world, letting "
        f"the robot settle, opening and closing files; included: spread over these decisions. {cost.network_ms:.0f} ms "
        f"of network time per decision; {1000.0 / cost.decision['light']:.0f} decisions per CPU second with telemetry "
        "light.",
        values,
    )
    ratios = list(map(cost.ratio, TELEMETRY))
    return doubted(table, BOUND_ABOVE) if ratios[0] < 1 or ratios != sorted(ratios) else table


def _recording_sheet(cost: Cost) -> Sheet:
    light, full, long = (cost.recording_bytes[name] for name in ("light", "full", "long"))
    spike = (full - light) / cost.spikes
    return Sheet(
        "recording",
        "Size of recording.rrd",
        ("what", "size", "target"),
        (
            (
                f"light, per decision of {_LONG * cost.decisions:,}",
                f"{long / 1000:.2f} kB",
                against(long / 1000, _LIGHT_KB_TARGET),
            ),
            (f"light, per decision of {cost.decisions:,}", f"{light / 1000:.2f} kB", ""),
            ("full beyond light, per spike", f"{spike:.2f} bytes", against(spike, _SPIKE_BYTES_TARGET)),
        ),
        f"{cost.spikes:.0f} spikes per decision. A short run has more pictures of all weights per decision.",
        {
            "long_bytes_per_decision": long,
            "light_bytes_per_decision": light,
            "full_bytes_per_decision": full,
            "bytes_per_spike": spike,
        },
    )


def fresh_network(config: RunConfig) -> Network:
    """Return the network of a run, before its first decision."""
    brain = simulate(config).brain
    assert isinstance(brain, SclaBrain) and isinstance(brain.network, Network)
    return brain.network


def bare_stretches(config: RunConfig, decisions: int) -> Iterator[float]:
    """Yield the CPU seconds of the bare parts of every stretch of so many decisions; compilers are warmed up before.

    Raises:
        SclaError: the configuration has no network to replay.
    """
    _ = list(_bare_decisions(dataclasses.replace(config, epochs=1, decisions=1)))
    replay = _bare_decisions(config)
    for _ in range(config.epochs * config.decisions // decisions):
        started_s = time.process_time()
        for _ in itertools.islice(replay, decisions):
            pass
        yield time.process_time() - started_s


def _bare_decisions(config: RunConfig) -> Iterator[object]:
    world, steps = simulate(config).world, check(config).clock.physics_steps_per_control
    recorded = record(config)
    return zip(replay_physics(world, recorded, steps), replay_network(fresh_network(config), recorded), strict=True)


def _contenders(config: RunConfig, recorded: Recorded, sizes: dict[str, int]) -> dict[str, Contender]:
    world, steps = simulate(config).world, check(config).clock.physics_steps_per_control
    contenders = {
        "physics": Contender(nothing, lambda _: turns(replay_physics(world, recorded, steps))),
        "network": Contender(lambda: fresh_network(config), lambda network: turns(replay_network(network, recorded))),
    }
    one = dataclasses.replace(config, epochs=1, decisions=1)
    for telemetry in TELEMETRY:
        contenders[telemetry] = whole(config, telemetry, telemetry, sizes)
        contenders[f"one {telemetry}"] = whole(one, telemetry, f"one {telemetry}", sizes)
    return contenders


def whole(config: RunConfig, telemetry: Telemetry, name: str, sizes: dict[str, int]) -> Contender:
    """Return a whole rollout, files and all, to be timed; the recording's size goes to `sizes` under `name`."""
    chosen = dataclasses.replace(config, telemetry=telemetry)

    def run_through(watch: Callable[..., None]) -> None:
        sizes[name] = _recording_size(chosen, watch)

    return Contender(nothing, lambda _: paced(run_through))


def _recording_size(config: RunConfig, watch: Callable[..., None] | None = None) -> int:
    """Run through a rollout, files and all; return its recording's bytes."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        rollout(config, run, watch=watch, pictures=False)
        return 0 if config.telemetry == "off" else (run / paths.RECORDING_RRD).stat().st_size
