"""Many runs in parallel: the same bits as one after another, and safe to interrupt."""

import contextlib
import dataclasses
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from scla_mj.checked import check
from scla_mj.cli.main import main
from scla_mj.engine.lock import exclusive, running
from scla_mj.engine.rollout import rollout
from scla_mj.experiments.campaign import open_jobs, run_folder, run_jobs
from scla_mj.experiments.catalogue import CATALOGUE
from scla_mj.experiments.experiment import Experiment, with_settings
from scla_mj.experiments.scale import TEN_SEEDS
from scla_mj.runs.atomic import read_json

TINY = with_settings(CATALOGUE[0].config, epochs=1, decisions=12)
EXPERIMENTS = (
    Experiment("one", "paper", "one", "?", TINY, (0, 1)),
    Experiment("two", "paper", "two", "?", with_settings(TINY, brain="random"), (0,)),
)


def test_runs_side_by_side_give_the_bits_of_runs_one_after_another(tmp_path):
    jobs = open_jobs(tmp_path, EXPERIMENTS)
    assert len(jobs) == 3
    done = []
    run_jobs(jobs, workers=2, watch=lambda job: done.append(job.folder))
    assert sorted(done) == sorted(job.folder for job in jobs)
    for job in jobs:
        alone = tmp_path / "alone" / job.experiment.name / job.folder.name
        rollout(job.config, alone, pictures=False)
        for name in ("decisions.parquet", "brain.npz"):
            assert (alone / name).read_bytes() == (job.folder / name).read_bytes()
    assert open_jobs(tmp_path, EXPERIMENTS) == []


def test_an_interrupted_run_is_resumed_bit_identically(tmp_path):
    (job,) = open_jobs(tmp_path, [dataclasses.replace(EXPERIMENTS[0], seeds=(3,))])
    rollout(job.config, tmp_path / "whole", pictures=False)

    def stop(record, epoch):
        if record.decision == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rollout(job.config, job.folder, watch=stop, pictures=False)
    identity = read_json(job.folder / "config.json")["run_id"]
    assert run_jobs([job], workers=1, watch=lambda job: None) == []
    assert read_json(job.folder / "config.json")["run_id"] == identity, "the very run, not another one"
    for name in ("decisions.parquet", "brain.npz"):
        assert (job.folder / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_what_is_in_use_or_damaged_is_told_and_left_and_all_else_is_run_and_reported(tmp_path, capsys):
    experiment = next(e for e in CATALOGUE if e.name == "random-any-start").at_scale(TEN_SEEDS[:4], 1, 12)
    whole, used, damaged, missing = (run_folder(tmp_path, experiment, seed) for seed in experiment.seeds)
    rollout(dataclasses.replace(experiment.config, seed=experiment.seeds[0]), whole, pictures=False)
    written = (whole / "summary.json").stat().st_mtime_ns
    used.mkdir()
    damaged.mkdir()
    (damaged / "config.json").write_text("{")
    campaign = ["reproduce", str(tmp_path), "--only", experiment.name, "--seeds", "4", "--epochs", "1"]
    campaign += ["--decisions", "12", "--workers", "1"]
    with running(used):
        assert main(campaign) == 2
        said = capsys.readouterr().err.splitlines()[-1]
        assert "2 of 3 runs are not complete" in said and "report.html leaves them out" in said
        assert "seed-201 is in use" in said or "seed-202/config.json is damaged" in said
        assert {path.name for path in used.iterdir()} == {".lock"}
    assert (whole / "summary.json").stat().st_mtime_ns == written
    assert (damaged / "config.json").read_text() == "{"
    assert (missing / "seal.json").exists()
    shutil.rmtree(damaged)
    assert main(campaign) == 0
    assert (used / "seal.json").exists() and (damaged / "seal.json").exists()
    assert open_jobs(tmp_path, [experiment]) == []


def test_a_run_of_other_settings_is_neither_reused_nor_overwritten(tmp_path, capsys):
    options = ["--only", "random-any-start", "--seeds", "1", "--epochs", "1", "--workers", "1"]
    assert main(["reproduce", str(tmp_path), *options, "--decisions", "10"]) == 0
    folder = run_folder(tmp_path, next(e for e in CATALOGUE if e.name == "random-any-start"), TEN_SEEDS[0])
    before = (folder / "decisions.parquet").read_bytes()
    capsys.readouterr()
    assert main(["reproduce", str(tmp_path), *options, "--decisions", "11"]) == 2
    assert "other settings" in capsys.readouterr().err
    assert (folder / "decisions.parquet").read_bytes() == before
    assert (tmp_path / "report.html").is_file()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--only", "everything"], "choose paper"),
        (["--workers", "0"], "1 or more"),
        (["--seeds", "0"], "1 or more"),
        (["--decisions", "0"], "--decisions is 0: it must be 1 or more"),
        (["--only"], "--only has no value"),
    ],
)
def test_a_bad_option_of_reproduce_gets_one_sentence(options, words, tmp_path, capsys):
    assert main(["reproduce", str(tmp_path / "out"), *options]) == 2
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.startswith("scla-mj: ")
    assert printed.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_folder_takes_one_campaign_at_a_time(tmp_path, capsys):
    with exclusive(tmp_path):
        assert main(["reproduce", str(tmp_path), "--only", "random-any-start"]) == 2
        assert f"{tmp_path} is in use by another reproduce" in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == [".lock"]
    with exclusive(tmp_path):
        pass


def test_an_out_that_is_a_file_or_without_a_name_is_refused(tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert main(["reproduce", str(tmp_path / "file")]) == 2
    said = capsys.readouterr().err
    assert "cannot write" in said and "OUT" in said
    assert main(["reproduce", ""]) == 2
    assert capsys.readouterr().err == "scla-mj: OUT is empty: name a folder\n"
    assert (tmp_path / "file").read_text() == "mine"


@contextlib.contextmanager
def campaign_in(out):
    options = ["--only", "random-any-start", "--seeds", "2", "--workers", "2"]
    command = [sys.executable, "-m", "scla_mj.cli.main", "reproduce", str(out), *options]
    pipes = {"stderr": subprocess.PIPE, "stdout": subprocess.DEVNULL}
    with subprocess.Popen(command, **pipes, text=True, start_new_session=True) as campaign:
        try:
            yield campaign
        finally:
            campaign.kill()


def processes_at_work(campaign):
    """The pids of the processes that a campaign has started, by the system."""
    children = Path(f"/proc/{campaign.pid}/task/{campaign.pid}/children").read_text().split()
    return [pid for pid in children if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def is_alive(pid):
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    return False


def wait_for(what, limit_s=60.0):
    end = time.monotonic() + limit_s
    while not what():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="processes are looked up in /proc")
@pytest.mark.parametrize(
    ("number", "to", "code", "word"),
    [
        (signal.SIGTERM, "parent", 143, "terminated; what was complete is on disk"),
        (signal.SIGKILL, "parent", -signal.SIGKILL, ""),
        (signal.SIGKILL, "worker", 2, "a run's process was killed"),
    ],
)
def test_no_process_outlives_its_campaign_however_that_ends(number, to, code, word, tmp_path):
    with campaign_in(tmp_path) as campaign:
        wait_for(lambda: len(list(tmp_path.rglob("decisions.partial.arrows"))) == 2)
        workers = processes_at_work(campaign)
        os.kill(campaign.pid if to == "parent" else int(workers[0]), number)
        _, printed = campaign.communicate(timeout=30)
    assert campaign.returncode == code
    assert "Traceback" not in printed
    assert word in (printed.splitlines() or [""])[-1]
    assert len(workers) == 2
    wait_for(lambda: not any(is_alive(pid) for pid in workers), limit_s=5.0)
    with exclusive(tmp_path):
        assert not list(tmp_path.rglob("summary.json"))


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="processes are looked up in /proc")
def test_ctrl_c_which_a_terminal_sends_to_every_process_is_told_once(tmp_path):
    with campaign_in(tmp_path) as campaign:
        wait_for(lambda: len(processes_at_work(campaign)) == 2)
        time.sleep(0.2)  # the processes now import, and would complain
        os.killpg(campaign.pid, signal.SIGINT)
        _, printed = campaign.communicate(timeout=30)
    assert campaign.returncode == 130
    assert "Traceback" not in printed
    assert printed.endswith("scla-mj: interrupted; what was complete is on disk\n")


def test_the_list_of_experiments_names_them_whole_on_a_narrow_terminal(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["reproduce", str(tmp_path), "--list"]) == 0
    printed = capsys.readouterr().out
    for experiment in CATALOGUE:
        assert f"{experiment.name}  ({experiment.group}; " in printed


def test_every_experiment_of_the_catalogue_can_run_and_names_what_there_is():
    names = [experiment.name for experiment in CATALOGUE]
    assert len(set(names)) == len(names)
    for experiment in CATALOGUE:
        check(experiment.config)
        assert experiment.baseline is None or experiment.baseline in names
        for target in experiment.targets:
            assert 1 <= target.first_epoch <= target.last_epoch <= experiment.config.epochs
            assert set(target.rivals) <= set(names)
