"""Runs that were stopped, and what they must equal once they were resumed."""

import dataclasses

import pytest

from scla_mj.config import RunConfig
from scla_mj.engine.resume import resume
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.paths import LOCK
from scla_mj.runs.summary import read_summary

QUICK = RunConfig(epochs=2, decisions=30, telemetry="off")
BITS = ("decisions.parquet", "brain.npz")


def stop_after(decisions):
    """Return a watch that interrupts once it has seen that many decisions."""
    seen = 0

    def watch(record, epoch):
        nonlocal seen
        seen += 1
        if seen == decisions:
            raise KeyboardInterrupt

    return watch


def stopped(config, path, *sessions, begin=True):
    """Leave a run that was stopped after each of these numbers of decisions, and resumed in between."""
    for number, decisions in enumerate(sessions):
        with pytest.raises(KeyboardInterrupt):
            if begin and number == 0:
                rollout(config, path, watch=stop_after(decisions), pictures=False)
            else:
                resume(path, brain=config.brain, watch=stop_after(decisions), pictures=False)
    return path


def whole(config, path):
    rollout(config, path, pictures=False)
    return path


def assert_same_run(first, second):
    for name in BITS:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name
    one, other = (dataclasses.replace(read_summary(path), wall_s=0.0) for path in (first, second))
    assert one == other


def refused(path, **how):
    files = {file.name: file.read_bytes() for file in path.iterdir() if file.name != LOCK}
    with pytest.raises(SclaError) as caught:
        resume(path, pictures=False, **how)
    assert "\n" not in str(caught.value)
    assert {file.name: file.read_bytes() for file in path.iterdir() if file.name != LOCK} == files
    return str(caught.value)
