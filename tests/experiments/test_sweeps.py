"""Sweeps: what a plan asks for, and that Dask makes it, whatever becomes of its workers, to the bits of single runs."""

import contextlib
import dataclasses
import os
import re
import socket
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import kill_workers
import pyarrow.parquet as pq
import pytest

from scla_mj.cli.main import main
from scla_mj.config import GridConfig, RunConfig
from scla_mj.engine.lock import running
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.experiments import statistics
from scla_mj.experiments.campaign import run_folder
from scla_mj.experiments.report.study import gather
from scla_mj.experiments.report.wording import averaged_text
from scla_mj.experiments.sweeps.gather import _column, chart, write_table
from scla_mj.experiments.sweeps.plan import Plan, configurations, grouped, read_plan, text
from scla_mj.experiments.sweeps.sweep import sweep

TINY = {("epochs",): [3], ("decisions",): [12]}


def written(folder, content):
    path = folder / "plan.toml"
    path.write_text(content)
    return path


def test_every_combination_of_values_is_run_with_every_seed():
    vary = {("brain",): ["scla", "scla-printed"], ("automaton", "reward_rate"): [0.3, 0.5, 0.7]}
    configs = configurations(Plan(), vary, seeds=4)
    asked = {(config.brain, config.automaton.reward_rate, config.seed) for config in configs}
    assert len(configs) == len(asked) == 2 * 3 * 4
    assert {config.telemetry for config in configs} == {"off"}
    titles = [experiment.title for experiment in grouped(configs)]
    assert titles[0] == "brain scla, automaton.reward-rate 0.3"
    assert len(set(titles)) == 6


def test_a_title_has_what_a_brain_leaves_to_its_default_and_a_floor_by_its_name_alone():
    configs = [
        RunConfig(brain="q-learning", brain_settings={"epsilon": 0.1}),
        RunConfig(brain="q-learning", grid=GridConfig(floor="maze")),
    ]
    titles = [experiment.title for experiment in grouped(configs)]
    assert titles == ["floor none, brain.epsilon 0.1", "floor maze, brain.epsilon 0.0"]


def test_a_file_lists_runs_one_by_one_and_the_command_line_overrides_it(tmp_path, capsys):
    plan = written(
        tmp_path,
        """
        seeds = 2
        [settings]
        epochs = 1
        grid.cells = [7, 7]
        [vary]
        decisions = [100, 200]
        [[runs]]
        brain = "dyna-q"
        brain_settings.planning_steps = 50
        [[runs]]
        brain = "random"
        telemetry = "light"
        """,
    )
    configs = configurations(read_plan(plan), {("grid", "cells"): [(4, 4)]}, file=plan)
    found = {(c.brain, c.decisions, c.seed, c.telemetry, c.grid.cells, c.brain_settings.get("planning_steps"))
             for c in configs}  # fmt: skip
    rows = (("dyna-q", "off", 50), ("random", "light", None))
    assert found == {(b, d, s, t, (4, 4), p) for b, t, p in rows for d in (100, 200) for s in (0, 1)}
    assert main(["sweep", str(tmp_path / "out"), "--plan", str(plan), "--seed", "7", "--list"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "4 configurations, 4 runs"
    assert not (tmp_path / "out").exists()


def test_another_sweep_into_the_same_folder_finds_the_runs_that_both_ask_for():
    one = grouped(configurations(Plan(), {("brain",): ["scla"]}, seeds=2))
    more = grouped(configurations(Plan(), {("brain",): ["random", "scla"], ("epochs",): [5, 10]}, seeds=3))
    assert {experiment.name for experiment in one} <= {experiment.name for experiment in more}
    assert len({experiment.name for experiment in more}) == 4


@pytest.mark.parametrize(
    ("plan", "words", "said"),
    [
        ("", [], "nothing is asked for"),
        ("[vary]\nbrain = []", [], "vary.brain is an empty list"),
        ("[vary]\nbrain = 'scla'", [], "vary.brain is 'scla': it must be a list of values"),
        ("[setings]\nepochs = 3", [], "setings is not a setting: known are seeds, settings, vary, runs"),
        ("[settings]\nepoch = 3", ["--seeds", "2"], "epoch is not a setting: known are protocol, epochs"),
        ("[settings]\nepochs = 'many'", ["--seeds", "2"], "epochs is 'many': it must be a whole number"),
        ("[settings]\nepochs = 3\nepochs.two = 4", [], "is not a plan: it must hold TOML"),
        ("[settings]\ntask = 3", ["--seeds", "2", "--task.action-noise", "0.1"], "task is 3: it holds settings"),
        ("seeds = 0", [], "seeds is 0: it must be 1 to 100000"),
        ("seeds = 3\n[settings]\nseed = 4", [], "seeds and seed are both given"),
        ("seeds = 2\n[[runs]]\n[[runs]]", [], "seed 0, is asked for 2 times"),
        ("", ["--seeds", "2", "--seed", "3"], "seeds and seed are both given"),
        ("", ["--seeds", "100000", "--epochs", "1", "2"], "200000 runs are asked for"),
        ("", ["--seeds", "2", "--brain", "random", "--network.motor-noise", "1", "2"], "--brain random does not read"),
        (
            "",
            ["--seeds", "2", "--brain", "dyna-q", "--brain.steps", "1"],
            "--brain.steps is not a setting of --brain dyna-q: its own are",
        ),
        ("", ["--seeds", "2", "--automaton.local-rule", "perhaps"], "it must be one of true, false"),
        ("", ["--seeds", "2", "--workers", "1", "--scheduler", "tcp://127.0.0.1:1"], "leave one out"),
        ("", ["--seeds", "2", "--scheduler", "nowhere"], "no scheduler answers at --scheduler nowhere"),
        ("", ["--seeds", "0"], "--seeds is 0: it must be 1 or more"),
    ],
)
def test_a_sweep_that_cannot_be_gets_one_sentence_and_leaves_nothing(plan, words, said, tmp_path, capsys):
    file = written(tmp_path, plan)
    out = tmp_path / "out"
    assert main(["sweep", str(out), "--plan", str(file), *words]) == 2
    printed = capsys.readouterr().err.splitlines()
    assert said in printed[-1]
    assert printed[-1].startswith("scla-mj: ")
    assert not list(out.glob("runs")) and len(printed) <= 2


def test_a_scheduler_that_never_answers_is_told_in_time(tmp_path, capsys, monkeypatch):
    from scla_mj.experiments.sweeps import cluster

    clients, start = [], cluster._Client.start
    monkeypatch.setattr(cluster._Client, "start", lambda one, **how: (clients.append(one), start(one, **how)))
    monkeypatch.setattr(cluster, "_CONNECT_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        assert main(["sweep", str(tmp_path), "--seeds", "1", "--scheduler", address]) == 2
    assert f"no scheduler answers at --scheduler {address} within 0.5 s" in capsys.readouterr().err
    assert [client.status for client in clients] == ["closed"], "nothing is left to a finaliser"


def test_a_machine_that_starts_no_scheduler_of_its_own_is_not_asked_for_an_address(tmp_path, capsys, monkeypatch):
    from scla_mj.experiments.sweeps import cluster

    monkeypatch.setattr(cluster, "_START_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        monkeypatch.setattr(cluster, "_local", lambda workers: contextlib.nullcontext(address))
        assert main(["sweep", str(tmp_path), "--seeds", "1"]) == 2
    said = capsys.readouterr().err
    assert "Dask has not started within 0.5 s" in said and "--scheduler" not in said


@pytest.mark.parametrize("values", [["auto", 3], [3, "auto"], [True, 2], [None, 0.5, "x"]])
def test_a_setting_of_several_types_is_a_column_of_text(values):
    assert _column(values).to_pylist() == [None if value is None else text(value) for value in values]


def test_without_dask_a_sentence_names_the_line_that_installs_it(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["sweep", str(tmp_path / "out"), "--seeds", "1"]) == 2
    assert "pip install 'scla-mj[sweep]'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_table_has_a_row_for_every_configuration_with_intervals_over_its_seeds(tmp_path):
    vary = TINY | {("brain",): ["random", "shortest-path"], ("task", "action_noise"): [0.0, 0.1, 0.2]}
    experiments = grouped(configurations(Plan(), vary, seeds=3))
    for experiment in experiments:
        for seed in experiment.seeds:
            folder = tmp_path / "runs" / experiment.name / f"seed-{seed:02d}"
            if (experiment.config.brain, seed) != ("random", 2):
                rollout(dataclasses.replace(experiment.config, seed=seed), folder, pictures=False)
    table = pq.read_table(write_table(tmp_path, experiments)).to_pylist()
    assert [(row["brain"], row["task.action-noise"]) for row in table] == [
        (brain, noise) for brain in ("random", "shortest-path") for noise in (0.0, 0.1, 0.2)
    ]
    for row in table:
        missing = row["brain"] == "random"
        assert (row["seeds"], row["missing_seeds"]) == (([0, 1], [2]) if missing else ([0, 1, 2], []))
        hits = [sum(seed[1:]) / 2 for seed in row["hits_per_1000_by_seed_and_epoch"]]  # settled: the last two thirds
        estimate = statistics.estimate(hits)
        assert (row["hits_per_1000"], row["hits_per_1000_low"]) == pytest.approx((estimate.mean, estimate.low))
        assert row["percent_of_ceiling"] == pytest.approx(100 * estimate.mean / row["ceiling_hits_per_1000"])
        for seed in row["seeds"]:
            decisions = pq.read_table(tmp_path / row["folder"] / f"seed-{seed:02d}" / "decisions.parquet")
            earned = 1000 * sum(decisions["hit"].to_pylist()) / 36
            assert sum(row["hits_per_1000_by_seed_and_epoch"][seed]) / 3 == pytest.approx(earned)
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")
    items = gather(tmp_path, experiments).evidence
    label = "percent of ceiling, settled epochs 2 to 3\nband: range of 2 or 3 runs"
    assert chart(items).axes[0].get_ylabel() == label
    (key,) = chart(items[3:5]).legends
    assert [text.get_text() for text in key.get_texts()] == ["each run", "mean; bar: range of 3 runs", "chance"]


def test_epochs_are_called_settled_only_where_others_came_before_them():
    spans = [statistics.settled_span(epochs) for epochs in (1, 2, 3, 30)]
    said = [averaged_text([span]) for span in spans]
    assert said == ["epoch 1", "epochs 1 to 2", "settled epochs 2 to 3", "settled epochs 11 to 30"]
    assert averaged_text(spans[1:3]) == "epochs 1 to 2 or epochs 2 to 3"


@pytest.fixture
def threads(monkeypatch):
    """Sweeps on threads of this process, which start at once."""
    from distributed import LocalCluster, WorkerPlugin

    from scla_mj.experiments.sweeps import cluster

    how = {
        "processes": False,
        "threads_per_worker": 1,
        "dashboard_address": "127.0.0.1:0",
        "host": "127.0.0.1",
        "protocol": "tcp://",
    }
    monkeypatch.setattr(cluster, "_local", lambda workers: LocalCluster(n_workers=workers, **how))
    monkeypatch.setattr(cluster, "_IgnoringTheTerminal", WorkerPlugin)
    return cluster


def test_a_run_in_use_is_waited_for_and_a_damaged_one_told_while_all_others_are_made(tmp_path, caplog, threads):
    configs = configurations(Plan(), TINY | {("brain",): ["random"]}, seeds=4)
    (experiment,) = grouped(configs)
    used, damaged, *_ = (run_folder(tmp_path, experiment, seed) for seed in experiment.seeds)
    used.mkdir(parents=True)
    damaged.mkdir()
    (damaged / "config.json").write_text("{")
    held, done = Event(), []

    def hold():
        with running(used):
            held.set()
            end = time.monotonic() + 60.0
            while len(done) < 2 and time.monotonic() < end:
                time.sleep(0.05)

    with ThreadPoolExecutor(1) as other:
        holding = other.submit(hold)
        held.wait()
        with caplog.at_level("INFO", "scla_mj"), pytest.raises(SclaError) as refused:
            sweep(configs, tmp_path, workers=2, watch=lambda count, total, job: done.extend([job] if job else []))
        holding.result()
    assert "1 of 4 runs are not complete" in str(refused.value) and "config.json is damaged" in str(refused.value)
    assert [job.folder for job in done][-1] == used, "those that are free come first"
    assert caplog.text.count(f"another process is making {used}") == 1
    row = pq.read_table(tmp_path / "sweep.parquet").to_pylist()[0]
    assert (row["seeds"], row["missing_seeds"]) == ([0, 2, 3], [1])


def test_workers_with_other_versions_are_refused(tmp_path, monkeypatch, threads):
    mine = threads._versions()
    monkeypatch.setattr(threads, "_versions", iter([mine | {"mujoco": "1.0"}, *[mine] * 9]).__next__)
    with pytest.raises(SclaError, match=rf"a worker has mujoco {mine['mujoco']} \(here 1\.0\)"):
        sweep(configurations(Plan(), TINY, seeds=1), tmp_path, workers=1)
    assert not list(tmp_path.glob("runs/*/*/seal.json"))


def test_the_page_does_what_it_says(tmp_path, monkeypatch, threads, capsys):
    monkeypatch.chdir(tmp_path)
    page = (Path(__file__).parents[2] / "docs/sweeps.md").read_text(encoding="utf-8")
    page = page.replace("--seeds 5 --epochs 3 --decisions 500", "--seeds 4 --epochs 3 --decisions 2")
    (command,) = re.findall(r"^    scla-mj (sweep runs/rates .*)$", page, re.MULTILINE)
    plan, (table, many) = (
        re.findall(r"```toml\n(.*?)```", page, re.DOTALL),
        re.findall(r"```python\n(.*?)```", page, re.DOTALL),
    )
    assert main(command.split()) == 0
    said = capsys.readouterr().out.splitlines()
    assert "".join(f"    {line}\n" for line in said[-3:]) in page
    headings, rates = said[1].replace("┃", " ").split(), [line.split()[1] for line in said if line.startswith("│")]
    assert " ".join(headings) == "automaton.reward-rate seeds hits per 1000 % of ceiling"
    assert rates == ["0.1", "0.3", "0.5", "0.7"]
    exec(table)
    assert len(capsys.readouterr().out.splitlines()) == 1 + 4
    exec(many.replace("decisions=200", "decisions=5"), {"__name__": "__main__"})
    assert capsys.readouterr().out == "runs/epsilon/sweep.parquet\n"
    assert main(["sweep", "runs/planned", "--plan", str(written(tmp_path, *plan)), "--list"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "6 configurations, 60 runs"


@pytest.mark.skipif(not os.path.exists("/proc/self/task"), reason="processes are looked up in /proc")  # noqa: PTH110
def test_a_sweep_whose_worker_is_killed_has_the_bits_of_runs_made_one_by_one(tmp_path):
    expected = kill_workers.one_by_one(tmp_path / "one-by-one", 1, 500)
    words = kill_workers.options(1, 500)
    kill_workers.try_kills(tmp_path / "out", words, 1, expected, workers=1)
    before = (tmp_path / "out" / "sweep.parquet").read_bytes()
    assert main(["sweep", str(tmp_path / "out"), *words]) == 0  # needs no worker
    assert (tmp_path / "out" / "sweep.parquet").read_bytes() == before
