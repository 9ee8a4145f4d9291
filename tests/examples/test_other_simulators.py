"""The brains in Brian2 and NEST drive the robot and are recorded under their own names, where these are installed."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

import scla_mj
from benchmarks.peers import INSTALL, PYTHON
from scla_mj.cli.main import main

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("simulator", ["brian2", "nest"])
def test_a_network_of_another_simulator_drives_the_robot_under_its_own_names(simulator, tmp_path, capfd):
    if not PYTHON.exists() or subprocess.run([PYTHON, "-c", f"import {simulator}"], capture_output=True).returncode:
        pytest.skip(f"{simulator} has no environment: {INSTALL}")
    brain = f"{PYTHON}:{ROOT / 'examples' / simulator}_brain.py"
    options = ["--brain", brain, "--protocol", "sensed-start", "--epochs", "1", "--decisions", "4"]
    for name in ("run", "again"):
        assert main(["rollout", str(tmp_path / name), *options]) == 0, capfd.readouterr().err
    assert main(["inspect", str(tmp_path / "run"), "--against", str(tmp_path / "again")]) == 0
    assert main(["inspect", str(tmp_path / "run")]) == 0 and "recording agrees" in capfd.readouterr().out
    run = scla_mj.load_run(tmp_path / "run")
    spikes = run.spikes(2)
    assert set(spikes.population) <= {"places", "up", "down", "left", "right"} and "places" in spikes.population
    for motor in ("up", "down", "left", "right"):
        assert np.sum(spikes.population == motor) == run.decisions[f"spikes_{motor}"][1].as_py()
    assert f"bridge.{simulator}" in run.versions
    assert run.brain.weights.shape == (4, 145, 10)
