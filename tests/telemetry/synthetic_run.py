"""A made-up run with the shapes and the statistics of a real one, and recorders for it: for the telemetry's tests."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from scla_mj.anatomy import NEURON_COUNT, NEURONS_PER_SIDE, PAPER_ANATOMY, PROJECTIONS
from scla_mj.checked import check
from scla_mj.config import RunConfig, TaskConfig, Telemetry
from scla_mj.grid import Action, Cell, Grid
from scla_mj.paths import recording_part
from scla_mj.signals import Activity, Decision, DecisionRecord, Move, Outcome, Percept, Snapshot
from scla_mj.telemetry.recording import RerunRecorder

GRID = Grid((5, 5), Cell(3, 3), 0.3)
PERIOD_S = 0.01
THINKING_STEPS = 50

MODEL_XML = """
<mujoco>
  <asset><material name="paint" rgba="1 0.5 0.25 1"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 0.1" group="2"/>
    <geom name="wall_left" type="box" size="0.01 0.75 0.05" pos="-0.76 0 0.05" group="2"/>
    <geom name="unseen" type="box" size="1 1 1" group="3"/>
    <body name="chassis" pos="0 0 0.033">
      <freejoint/>
      <geom name="plate" type="box" size="0.07 0.06 0.02" group="2" material="paint" mass="1"/>
      <geom name="ball" type="sphere" size="0.006" pos="-0.08 0 -0.027" group="2"/>
      <body name="wheel_left" pos="0 0.08 0">
        <joint type="hinge" axis="0 1 0"/>
        <geom name="tyre_left" type="cylinder" size="0.033 0.009" euler="90 0 0" group="2" mass="0.1"/>
      </body>
      <body name="wheel_right" pos="0 -0.08 0">
        <joint type="hinge" axis="0 1 0"/>
        <geom name="tyre_right" type="cylinder" size="0.033 0.009" euler="90 0 0" group="2" mass="0.1"/>
      </body>
      <body name="bumper" pos="0.05 0 0.05">
        <geom name="bumper_bar" type="capsule" fromto="0 0.09 0 0 -0.09 0" size="0.006" group="2" mass="0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


class Recorder(RerunRecorder):
    """Closed at the end of a `with` block."""

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def open_recorder(
    path: Path,
    mode: Telemetry = "light",
    config: RunConfig | None = None,
    *,
    run_id: str = "a run",
    first: int = 1,
    memory: Snapshot | None = None,
) -> Recorder:
    """Open the recording of a run that has no robot but that of `MODEL_XML`."""
    checked = check(dataclasses.replace(config or RunConfig(seed=7), telemetry=mode))
    model = mujoco.MjModel.from_xml_string(MODEL_XML)
    named = {"run_id": run_id, "first_decision": first, "memory": memory}
    return Recorder(path, checked, anatomy=PAPER_ANATOMY, model=model, **named)


def open_part(folder: Path, number: int, mode: Telemetry, *, seed: int = 7, **more: Any) -> Recorder:
    """Open a part of a recording under its own name, of a run whose target jumps."""
    config = RunConfig(seed=seed, task=TaskConfig(jump_epoch=2, jump_target=(1, 5)))
    return open_recorder(folder / recording_part(number), mode, config, **more)


def record_run(
    path: Path, mode: Telemetry, run: list[DecisionRecord], last: Snapshot | None = None, **more: Any
) -> None:
    """Record a whole run."""
    with open_recorder(path, mode, **more) as recorder:
        for record in run:
            recorder.write(record)
        recorder.close(last)


def records(
    *, epochs: int, decisions: int, seed: int = 0, spikes: int = 8000, thinking_spikes: int = 350
) -> Iterator[DecisionRecord]:
    """Yield decisions of a robot that drives straight from cell to cell and learns as it goes."""
    generator = np.random.default_rng(seed)
    grid, time_s, cell = GRID, 0.0, Cell(1, 1)
    for number in range(epochs * decisions):
        learnt = 1 - np.exp(-number / (0.3 * epochs * decisions))
        action = _choose(grid, cell, learnt, generator)
        beyond = grid.after(cell, action)
        move = _move(grid, cell, beyond, time_s, generator)
        hit = beyond == grid.target
        activity = _activity(move, learnt, generator, spikes, thinking_spikes)
        chosen = Decision(action, None, (3, 2, 1, 0))
        epoch, decision = number // decisions + 1, number % decisions + 1
        yield DecisionRecord(
            epoch, decision, time_s, Percept(cell, grid.sensed_from(cell)), chosen, action, move, hit, activity
        )
        time_s = round(float(move.trajectory[-1, 0]), 6)
        starts = grid.start_cells("any-start")
        cell = starts[generator.integers(len(starts))] if hit else beyond


def snapshot(generator: np.random.Generator, learnt: float = 0.5) -> Snapshot:
    """Return a memory of random weights, agreeing ones high, and probabilities that sum to 1."""
    means = [1 + 2.5 * learnt if projection.agrees else 1 - 0.7 * learnt for projection in PROJECTIONS]
    noise = generator.normal(size=(len(PROJECTIONS), NEURONS_PER_SIDE, NEURONS_PER_SIDE))
    weights = np.clip(np.array(means)[:, None, None] + 0.3 * noise, 0, 4).astype(np.float32)
    return Snapshot(weights, generator.dirichlet(np.full(4, 1 - 0.8 * learnt), size=(5, 5)))


def _choose(grid: Grid, cell: Cell, learnt: float, generator: np.random.Generator) -> Action:
    best = min(Action, key=lambda action: grid.distances[grid.after(cell, action)])
    return best if generator.random() < learnt else Action(int(generator.integers(4)))


def _move(grid: Grid, before: Cell, after: Cell, time_s: float, generator: np.random.Generator) -> Move:
    periods = int(generator.integers(45, 90))
    (x0, y0), (x1, y1) = grid.centre_m(before), grid.centre_m(after)
    share = np.clip(np.linspace(-0.1, 1.0, periods), 0, 1)
    share = share * share * (3 - 2 * share)
    rows = np.zeros((periods, 12))
    rows[:, 0] = time_s + PERIOD_S * np.arange(1, periods + 1)
    wobble = generator.normal(size=(periods, 3)) * 1e-4
    rows[:, 1:4] = np.column_stack([x0 + share * (x1 - x0), y0 + share * (y1 - y0), np.full(periods, 0.033)]) + wobble
    heading = np.arctan2(y1 - y0, x1 - x0) + 1e-3 * generator.normal(size=periods)
    rows[:, 4], rows[:, 7] = np.cos(heading / 2), np.sin(heading / 2)
    rows[:, 8] = share * 0.3 / 0.033
    rows[:, 9] = 0.9 * rows[:, 8]
    outcome = Outcome.MOVED if after != before else Outcome.BLOCKED
    return Move(outcome, before, after, PERIOD_S * (periods - 5), 0.001 * float(generator.random()), 0.01, False, rows)


def _activity(move: Move, learnt: float, generator: np.random.Generator, spikes: int, thinking_spikes: int) -> Activity:
    steps = len(move.trajectory) * 10
    thinking = int(generator.poisson(thinking_spikes))
    driving = int(generator.poisson(spikes - thinking_spikes))
    step = np.concatenate(
        [
            np.sort(generator.integers(0, THINKING_STEPS, thinking)),
            np.sort(generator.integers(THINKING_STEPS, steps, driving)),
        ]
    )
    means = np.array([1 + 2.5 * learnt if projection.agrees else 1 - 0.7 * learnt for projection in PROJECTIONS])
    return Activity(
        spike_step=step.astype(np.int32),
        spike_neuron=generator.integers(0, NEURON_COUNT, len(step)).astype(np.int32),
        thinking_spikes=thinking,
        thinking_steps=THINKING_STEPS,
        steps=steps,
        mean_weights=means + 0.01 * generator.normal(size=8),
        dopamine=0.5 * generator.random(8) * (generator.random() < 0.4),
    )
