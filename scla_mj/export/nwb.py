"""`scla-mj export RUN --nwb FILE`: a run as Neurodata Without Borders (docs/export.md)."""

from __future__ import annotations

import json
import warnings
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from scla_mj.engine.stored_run import StoredRun
from scla_mj.errors import SclaError
from scla_mj.extras import need
from scla_mj.paths import CONFIG_JSON
from scla_mj.runs.atomic import replacing

if TYPE_CHECKING:
    from pynwb import NWBFile

START: Final = datetime(2000, 1, 1, tzinfo=UTC)
"""When every session starts: a run's time is simulated and has no date, and the same run gives the same data."""
_APART_S: Final = 2e-6
"""Between two trials: what touches to the microsecond is one interval to some readers."""
_COLUMNS: Final = {
    "epoch": "of the run, from 1",
    "decision": "in its epoch, from 1",
    "x": "column of the cell before the move, from 1",
    "y": "row of the cell before the move, from 1, upwards",
    "sensed": "direction of a target in a neighbouring cell, or none",
    "advised": "what an automaton advised, or none",
    "action": "the decided direction",
    "executed": "the direction in which the body was sent",
    "to_x": "column of the cell after the move",
    "to_y": "row of the cell after the move",
    "outcome": "moved, blocked or failed",
    "hit": "whether the target was reached",
    "position_error_m": "from the centre of the cell where the robot ended",
    "heading_error_rad": "from the heading that the robot keeps",
}


_TAKEN: Final = "--nwb {} is there already: choose another FILE, nothing is overwritten"


def require_new_file(file: Path) -> Any:
    """Return pynwb.

    Raises:
        SclaError: it is not installed, or the file is there or is no .nwb.
    """
    nwb = need("pynwb", "--nwb")
    if file.suffix != ".nwb":
        raise SclaError(f"--nwb {file} must end in .nwb: other programs know the format by it")
    if file.exists():
        raise SclaError(_TAKEN.format(file))
    return nwb


def write_nwb(run: StoredRun, file: Path) -> None:
    """Write a run's spikes as units, its decisions as trials, its poses as behaviour; nothing is overwritten.

    Raises:
        SclaError: pynwb is not installed, the file is there, is no .nwb or cannot be written, or the recording is
            damaged.
    """
    nwb = require_new_file(file)
    content = _session(run)
    _add_trials(content, run)
    _add_behaviour(content, run)
    if run.anatomy is not None:
        _add_neurons(content, run)
    with replacing(file, taken=_TAKEN.format(file), folder="FILE") as scratch, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*does not end in '.nwb'")  # it will when it is whole
        with nwb.NWBHDF5IO(str(scratch), "w") as stream:
            stream.write(content)


def _session(run: StoredRun) -> NWBFile:
    from pynwb import NWBFile
    from pynwb.file import Subject

    config, name = run.config, f"{run.config.brain}-seed-{run.config.seed}"
    content = NWBFile(
        session_description=f"{config.brain} drives a simulated robot to a target, {config.protocol}; times count from "
        "the run's start in simulated seconds",
        identifier=run.run_id,
        session_start_time=START,
        session_id=name,
        experiment_description="scla_mj, a simulation: spiking neurons and learning automata drive a robot in MuJoCo",
        experimenter=["Simulation, scla_mj"],
        institution="none: a simulation",
        keywords=["simulation", "spiking neural network", "robot", "reinforcement learning"],
        notes=json.dumps(json.loads((run.path / CONFIG_JSON).read_text(encoding="utf-8"))),
        source_script="scla-mj export",
        source_script_file_name="scla-mj",
        subject=Subject(
            subject_id=name,
            description="A simulated robot and its brain: no animal. Age, sex and species stand for none.",
            species="Simulated robot",
            sex="O",
            age="P0D",
        ),
    )
    content.create_device(
        name="robot",
        description=f"a differential-drive robot, simulated in MuJoCo {run.versions.get('mujoco', '')}",
    )
    return content


def _add_trials(content: NWBFile, run: StoredRun) -> None:
    """Add every decision, its thinking window and the drive that followed."""
    table = run.decisions
    begun = table["time_s"].to_numpy()
    driven = begun + run.checked.clock.thinking_window_s
    ended = driven + table["duration_s"].to_numpy()
    ended[:-1] = np.minimum(ended[:-1], begun[1:] - _APART_S)
    spikes = {name: f"spikes of {name} in the thinking window" for name in table.column_names if "spikes_" in name}
    described = {name: text for name, text in (_COLUMNS | spikes).items() if not table[name].null_count}
    content.add_trial_column("drive_time", "when the thinking window ended and the drive began, s")
    for name, text in described.items():
        content.add_trial_column(name, text)
    columns = {name: table[name].to_pylist() for name in described}
    for number, (start, drive, stop) in enumerate(zip(begun, driven, ended, strict=True)):
        values = {name: column[number] for name, column in columns.items()}
        content.add_trial(start_time=start, stop_time=stop, drive_time=drive, **values)


def _add_behaviour(content: NWBFile, run: StoredRun) -> None:
    from pynwb.behavior import CompassDirection, Position, SpatialSeries

    poses = run.trajectory()
    frame = "the arena's centre; x to the right, y upwards on the map"
    position = SpatialSeries(
        name="position",
        data=poses.position_m[:, :2],
        timestamps=poses.time_s,
        reference_frame=frame,
        unit="meters",
        description="x and y of the chassis's origin, midway between the wheels",
    )
    heading = SpatialSeries(
        name="heading",
        data=np.mod(poses.heading_rad, 2 * np.pi),
        timestamps=position,
        reference_frame="from +x towards +y",
        unit="radians",
        description="where the chassis's front points",
    )
    behaviour = content.create_processing_module("behavior", "the chassis, as the recording keeps it, at 20 Hz")
    behaviour.add(Position(spatial_series=position))
    behaviour.add(CompassDirection(spatial_series=heading))


def _add_neurons(content: NWBFile, run: StoredRun) -> None:
    """Add a unit for every neuron, silent ones too, and the mean weights."""
    from pynwb.misc import Units

    anatomy, spikes = run.anatomy, run.spikes()
    assert anatomy is not None
    order = np.argsort(spikes.neuron, kind="stable")  # within a neuron in the order of time
    trains = np.split(spikes.time_s[order], np.cumsum(np.bincount(spikes.neuron, minlength=anatomy.neurons))[:-1])
    kept = "all" if run.config.telemetry == "full" else "those of the thinking windows, from start_time to drive_time,"
    content.units = Units(
        name="units",
        description=f"every neuron of the brain; of its spikes {kept} are recorded",
        resolution=run.checked.clock.neural_step_ms / 1000,
    )
    content.add_unit_column("population", "the neuron's population")
    content.add_unit_column("role", "what its population is for")
    for population in anatomy.populations:
        labels = {"population": population.name, "role": population.role or "none"}
        for neuron in range(population.start, population.stop):
            content.add_unit(id=neuron, spike_times=trains[neuron], **labels)
    if run.brain.weights is not None:
        _add_weights(content, run, anatomy.projection_names)


def _add_weights(content: NWBFile, run: StoredRun, projections: tuple[str, ...]) -> None:
    from pynwb import TimeSeries

    history = run.weight_history
    series: Any = TimeSeries(
        name="mean_weights",
        data=history.mean_weights,
        timestamps=history.time_s,
        unit="mV",
        description=f"mean weight of each projection: {', '.join(projections)}",
    )
    content.add_analysis(series)
