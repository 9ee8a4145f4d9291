"""Complete means complete: what is missing of a run whose decisions are all made is finished, or named."""

import dataclasses
import logging
import shutil
import subprocess
import sys

import pytest
from stopped_runs import QUICK, stopped

import scla_mj
from scla_mj import paths
from scla_mj.cli.main import main
from scla_mj.engine.resume import resume
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.runs import plots
from scla_mj.runs.decisions import take_back

CONFIG = dataclasses.replace(QUICK, brain="automaton")
LAST = CONFIG.epochs * CONFIG.decisions
FIGURES = (paths.LEARNING_PNG, paths.POLICY_PNG)  # an automaton has no weights


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "run"
    rollout(CONFIG, path)
    return path


@pytest.fixture
def run(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "run")


def files(path):
    return {file.name: file.read_bytes() for file in path.iterdir()}


def remove(*names):
    return lambda run: [(run / name).unlink() for name in names]


def damage(name):
    return lambda run: (run / name).write_bytes((run / name).read_bytes()[:100])


def stop_in_the_stream(run):
    """Leave the stream of decisions that the Parquet file is made of, as a kill between the two does."""
    remove(paths.SEAL_JSON, *FIGURES)(run)
    take_back(run, LAST)


def both_logs(run):
    remove(paths.SEAL_JSON)(run)
    parquet = (run / paths.DECISIONS_PARQUET).read_bytes()
    take_back(run, LAST)
    (run / paths.DECISIONS_PARQUET).write_bytes(parquet)


MISSING = {
    "seal": remove(paths.SEAL_JSON),
    "a figure": remove(FIGURES[1]),
    "half a figure": damage(FIGURES[0]),
    "seal and figures": remove(paths.SEAL_JSON, *FIGURES),
    "the Parquet file": stop_in_the_stream,
    "nothing but order": both_logs,
}


@pytest.mark.parametrize("lose", MISSING.values(), ids=MISSING)
def test_what_is_missing_is_finished_to_the_same_bytes(lose, run, whole, capsys):
    lose(run)
    (run / ".policy.png.7-8.tmp").write_bytes(b"half a figure")
    assert main(["inspect", str(run)]) == 2 or "unfinished" in capsys.readouterr().out
    resume(run)
    assert files(run) == files(whole)
    assert scla_mj.load_run(run).is_complete
    with pytest.raises(SclaError, match="is complete: there is nothing to resume"):
        resume(run)


def test_the_command_says_in_a_line_what_it_wrote(run, capsys):
    remove(FIGURES[1])(run)
    assert main(["resume", str(run)]) == 0
    assert capsys.readouterr().out == f"{run} had all its decisions; written: learning.png, policy.png, seal.json\n"


@pytest.mark.parametrize("name", [paths.DECISIONS_PARQUET, paths.BRAIN_NPZ, paths.SUMMARY_JSON])
def test_what_nothing_else_holds_is_named_and_no_file_is_touched(name, run):
    remove(name)(run)
    before = files(run)
    with pytest.raises(SclaError, match=rf"{name} is missing: seal.json lists it; `scla-mj rollout NEW --config"):
        resume(run)
    assert files(run) == before
    assert not scla_mj.load_run(run).is_complete


def test_a_seal_never_makes_damage_sound(run):
    remove(paths.SEAL_JSON)(run)
    damage(paths.DECISIONS_PARQUET)(run)
    with pytest.raises(SclaError, match=r"decisions\.parquet is damaged"):
        resume(run)
    assert not (run / paths.SEAL_JSON).exists()


@pytest.mark.parametrize("error", [RuntimeError("no latex\nat all"), OSError(28, "No space left"), MemoryError()])
def test_figures_that_cannot_be_drawn_harm_no_run_and_are_drawn_later(error, whole, tmp_path, monkeypatch, caplog):
    def fail(*_):
        raise error

    with monkeypatch.context() as patch, caplog.at_level(logging.WARNING):
        patch.setattr(plots, "plot_policy", fail)
        rollout(CONFIG, tmp_path / "run")
        (said,) = [record.getMessage() for record in caplog.records]
        assert main(["figures", str(tmp_path / "run")]) == 2
    assert "cannot be drawn" in said and f"`scla-mj figures {tmp_path / 'run'}` draws them" in said and "\n" not in said
    assert scla_mj.load_run(tmp_path / "run").is_complete
    assert scla_mj.load_run(tmp_path / "run").inspect().verdict == "sound"
    assert main(["figures", str(tmp_path / "run")]) == 0
    assert scla_mj.load_run(tmp_path / "run").inspect().verdict == "sound"
    for name in FIGURES:
        assert (tmp_path / "run" / name).read_bytes() == (whole / name).read_bytes()


def test_a_stopped_runs_figures_are_drawn_again_and_it_can_still_be_resumed(tmp_path, capsys):
    run = stopped(CONFIG, tmp_path / "run", 20)
    assert main(["figures", str(run)]) == 0
    assert capsys.readouterr().out.count("Drawn:") == 2
    assert main(["inspect", str(run)]) == 0
    resume(run, pictures=False)


def test_figures_of_what_is_damaged_or_no_run_are_refused(run, tmp_path, capsys):
    damage(paths.BRAIN_NPZ)(run)
    before = files(run)
    assert main(["figures", str(run)]) == main(["figures", str(tmp_path / "nowhere")]) == 2
    assert "brain.npz is damaged" in capsys.readouterr().err
    assert files(run) == before


KILLED = """
import os, signal, sys
import scla_mj
from scla_mj.engine import session
from scla_mj.runs import decisions, figures, plots
config = scla_mj.RunConfig(brain="automaton", epochs=2, decisions=30, telemetry="off")

def kill(*_, **__):
    os.kill(os.getpid(), signal.SIGKILL)

for module, name in [(decisions, "remove"), (session, "write_brain"), (plots, "plot_policy"), (session, "remove"),
                     (session, "write_seal")]:
    if os.fork() == 0:
        setattr(module, name, kill)
        scla_mj.rollout(config, os.path.join(sys.argv[1], name + module.__name__))
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.wait()[1]) == -signal.SIGKILL
"""


def test_a_run_killed_anywhere_at_its_end_is_resumed_to_the_same_bytes(whole, tmp_path):
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=True)
    runs = list(tmp_path.iterdir())
    assert len(runs) == 5
    for run in runs:
        assert not scla_mj.load_run(run).is_complete
        resume(run)
        assert scla_mj.load_run(run).is_complete
        for name in (paths.DECISIONS_PARQUET, paths.BRAIN_NPZ, *FIGURES):
            assert (run / name).read_bytes() == (whole / name).read_bytes(), (run, name)
        assert not [file for file in run.iterdir() if file.name.endswith(".tmp")]
