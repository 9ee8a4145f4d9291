"""Whatever is typed runs or is refused with one sentence; `SCLA_EXAMPLES=10000` in the environment tries more.

`SCLA_SEED=N` chooses other examples, so that a large number can be split. `SCLA_EXAMPLES_LOG=FILE` gets a line for
each, and their count at the end.
"""

import collections
import dataclasses
import os
import resource
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, seed, settings
from hypothesis import strategies as st
from wild import command_lines, hints, python_values

from scla_mj.checked import check
from scla_mj.cli.main import COMMANDS
from scla_mj.cli.options import parse
from scla_mj.config import RunConfig
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.runs.decisions import read_decisions

SEED = os.environ.get("SCLA_SEED")
EXAMPLES = int(os.environ.get("SCLA_EXAMPLES", "30"))
LOG = os.environ.get("SCLA_EXAMPLES_LOG")
DECISIONS = 2
LONGEST_S = 120.0
"""What two decisions may take at the very worst: both end by the longest timeout that is allowed."""
MOST_KILOBYTES = 1_000_000
"""Memory by which a run may raise this process's peak."""


came: collections.Counter[str] = collections.Counter()


@pytest.fixture(scope="module", autouse=True)
def count_at_the_end():
    yield
    if LOG and came:
        with Path(LOG).open("a") as log:
            log.write(f"{came['ran'] + came['refused']} completed: {came['ran']} ran, {came['refused']} refused\n")


def peak_kilobytes():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def run_two_decisions(line, folder):
    """Parse and run as the command does, without its figures; return what refused it, or None."""
    fixed = ["--epochs", "1", "--decisions", str(DECISIONS), "--telemetry", "off"]
    try:
        rollout(parse(COMMANDS, ["rollout", str(folder), *fixed, *line], prog="scla-mj").config, folder, pictures=False)
    except SclaError as refusal:
        return str(refusal)
    return None


@(seed(int(SEED)) if SEED else lambda test: test)
@settings(
    max_examples=EXAMPLES, deadline=None, derandomize=SEED is None and EXAMPLES < 1000, database=None, print_blob=False,
    suppress_health_check=list(HealthCheck),
)  # fmt: skip
@given(command_lines())
@example(["--clock.physics-step-ms", "1e-06", "--clock.base-step-ms", "1e-06"])
@example(["--clock.neural-step-ms", "1e-06", "--clock.base-step-ms", "1e-06"])
@example(["--clock.thinking-window-ms", "10000", "--clock.neural-step-ms", "0.5", "--clock.base-step-ms", "0.5"])
@example(["--cells", "20", "20", "--task.action-noise", "0.75"])
@example(["--plasticity.eligibility-tau-ms", "1"])
@example(["--plasticity.eligibility-tau-ms", "12", "--clock.neural-step-ms", "0.1", "--clock.base-step-ms", "0.1"])
@example(["--brain", "random", "--controller.timeout-s", "600", "--controller.max-speed-m-s", "0.01"])
def test_every_command_line_runs_or_is_refused_with_one_sentence(line):
    folder = Path(tempfile.mkdtemp())
    started, before = time.process_time(), peak_kilobytes()
    try:
        refusal = run_two_decisions(line, folder / "run")
        taken_s = time.process_time() - started
        came["ran" if refusal is None else "refused"] += 1
        if LOG:
            with Path(LOG).open("a") as log:
                log.write(f"{'ran' if refusal is None else 'refused'} {taken_s:.2f} {line} {refusal}\n")
        if refusal is not None:
            assert "\n" not in refusal and 10 < len(refusal) < 1000, refusal
            assert not (folder / "run").exists(), "a refused run leaves nothing behind"
        else:
            assert read_decisions(folder / "run").num_rows == DECISIONS
        assert taken_s < LONGEST_S
        assert peak_kilobytes() - before < MOST_KILOBYTES
    finally:
        shutil.rmtree(folder)


@settings(max_examples=max(200, EXAMPLES), deadline=None, derandomize=EXAMPLES < 1000, database=None)
@given(st.sampled_from(sorted(hints())), python_values())
def test_whatever_python_gives_for_a_setting_is_the_value_that_a_run_stores_or_refused_with_one_sentence(name, value):
    section, _, item = name.replace("-", "_").rpartition(".")
    section = section or ("grid" if hasattr(RunConfig().grid, item) else "")
    config = RunConfig()
    part = getattr(config, section) if section else config
    changed = dataclasses.replace(part, **{item: value})
    try:
        checked = check(dataclasses.replace(config, **{section: changed}) if section else changed).config
    except SclaError as refusal:
        assert "\n" not in str(refusal) and 10 < len(str(refusal)) < 1000, refusal
        return
    if name == "brain" and isinstance(value, type):  # a class is stored as where it is imported from
        value = f"{value.__module__}:{value.__qualname__}"
    stored = getattr(getattr(checked, section) if section else checked, item)
    assert type(stored) in (int, float, bool, str, tuple)
    assert stored == value or np.array_equal(stored, np.asarray(value))
    assert check(checked).config == checked
