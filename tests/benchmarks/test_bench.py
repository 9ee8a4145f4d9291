"""The bench replays what really happened, bit for bit, and computes its ratios right: or it would be worth nothing."""

import collections
import json
import math
import threading
from pathlib import Path

import numpy as np
import pytest

from benchmarks import growth, kernel_parts, processes, replay, rollouts, suites, table, timing, workload
from scla_mj.brain.network.memory import arrays_of, copy_of
from scla_mj.brain.network.network import Network
from scla_mj.checked import check
from scla_mj.cli.main import main
from scla_mj.config import NetworkConfig, PlasticityConfig, RunConfig
from scla_mj.engine.build import simulate
from scla_mj.errors import SclaError
from scla_mj.loop.drive import Driver

CONFIG = RunConfig(epochs=1, decisions=30, protocol="sensed-start")


def exhaust(replay):
    """Let a replay go through to its end."""
    collections.deque(replay, maxlen=0)


@pytest.fixture(scope="module")
def recorded():
    """What a rollout recorded, and where it ended."""
    run = simulate(CONFIG)
    spikes = 0
    for _ in range(CONFIG.decisions):
        done = run.step()
        spikes += len(done.activity.spike_step)
    return replay.record(CONFIG), run, done.move.trajectory[-1, 1:10], spikes


def test_the_replayed_network_ends_where_the_rollouts_ended(recorded):
    played, run, _, spikes = recorded
    bare = rollouts.fresh_network(CONFIG)
    exhaust(replay.replay_network(bare, played))
    np.testing.assert_array_equal(bare.weights, run.brain.network.weights)
    np.testing.assert_array_equal(bare.arrays.v, run.brain.network.arrays.v)
    assert played.spikes == spikes
    assert played.network_ms == round(1000 * run.time_s)


def test_the_replayed_physics_and_moves_end_where_the_rollouts_ended(recorded):
    played, _, ended, _ = recorded
    clock = check(CONFIG).clock
    bare, moved = simulate(CONFIG).world, simulate(CONFIG).world
    exhaust(replay.replay_physics(bare, played, clock.physics_steps_per_control))
    np.testing.assert_array_equal(bare.data.qpos, ended)
    exhaust(replay.replay_moves(moved, Driver(moved, clock, CONFIG.controller), played, clock.thinking_controls))
    np.testing.assert_array_equal(moved.data.qpos, ended)
    assert moved.data.time == bare.data.time


def test_the_lower_bound_is_the_networks_own_neurons_and_noise():
    """Without synapses the kernel and the bare loop must take the same neurons to the same place."""
    network = Network(
        NetworkConfig(weight_low=0.0, weight_high=0.0, motor_to_inhibitory=0.0, inhibitory_to_motor=0.0),
        PlasticityConfig(learning_rate_per_ms=0.0),
        seed=1,
    )
    memory = copy_of(network.memory)
    spikes = network.run(200)
    kernel_parts.bare_neurons(memory, 200)
    bare = arrays_of(memory)
    assert len(spikes.step) > 100
    np.testing.assert_array_equal(bare.noise_low, network.arrays.noise_low)
    np.testing.assert_array_equal(bare.v, network.arrays.v)
    np.testing.assert_array_equal(bare.u, network.arrays.u)


def test_the_parts_of_a_network_ms_add_up_to_the_whole():
    measured = kernel_parts.Parts(
        bound=0.5, neurons=0.6, decay=0.1, stretch=0.2, sensory=0.15, dosed=0.35, motor=0.4, whole=3.5,
        chunked=3.9, sensory_spikes=2.0, motor_spikes=5.0, share=0.25,
    )  # fmt: skip
    assert sum(measured.shares.values()) == pytest.approx(measured.whole)
    assert measured.shares["motor spikes"] == pytest.approx(2.0)
    assert measured.shares["sensory spikes"] == pytest.approx(2.0 * 0.2)
    assert measured.over_bound == pytest.approx(7.8)
    assert ("network, 50 ms at a time", "3.90", "7.80", "≤ 3.5 missed") in kernel_parts.sheet(measured).rows


def test_a_decision_costs_what_a_long_run_takes_beyond_a_run_of_one():
    seconds = {"physics": 0.5, "network": 1.5}
    for name, whole in (("off", 2.3), ("light", 3.1), ("full", 5.1)):
        seconds |= {name: whole, f"one {name}": 0.3 + (whole - 0.3) / 1000}
    sizes = {"light": 6_500_000, "one light": 6000, "full": 14_494_000, "one full": 14_000, "long": 50_000_000}
    cost = rollouts.derive(seconds, sizes, decisions=1000, network_ms=950_000, spikes=2_000_000)
    assert cost.physics + cost.network == pytest.approx(2.0)
    assert cost.decision["off"] == pytest.approx(2.0)
    assert cost.fixed["off"] == pytest.approx(300)
    assert cost.ratio("off") == pytest.approx(1.0)
    assert cost.ratio_with_fixed("off") == pytest.approx(1.15)
    recording = rollouts.sheets(cost)[1].values
    assert recording["long_bytes_per_decision"] == 5000.0
    assert recording["bytes_per_spike"] == pytest.approx((14_480_000 - 6_494_000) / 999 / 2000)


def test_a_median_leaves_the_first_repetition_and_the_preparation_out():
    spent = iter([0.2, 0.01])

    def burn(seconds):
        end = timing.time.process_time() + seconds
        while timing.time.process_time() < end:
            pass

    contender = timing.Contender(lambda: burn(0.05), lambda _: burn(next(spent)))
    ticks = []
    found = timing.median_cpu_s({"burn": contender}, repetitions=1, watch=lambda: ticks.append(1))
    assert 0.009 < found["burn"] < 0.04
    assert len(ticks) == 2


def test_contenders_with_turns_take_them_in_step():
    seen = []

    def work(name, decisions):
        for number in range(decisions):
            seen.append(f"{name}{number // timing.TURN}")
            yield

    def rollout(watch):
        for number in range(60):
            seen.append(f"c{number // timing.TURN}")
            watch()

    contenders = {
        "a": timing.Contender(lambda: 60, lambda decisions: timing.turns(work("a", decisions))),
        "b": timing.Contender(timing.nothing, lambda _: timing.turns(work("b", 60))),
        "c": timing.Contender(timing.nothing, lambda _: timing.paced(rollout)),
    }
    assert timing.spent_s(contenders).keys() == contenders.keys()
    assert list(dict.fromkeys(seen)) == ["a0", "b0", "c0", "a1", "b1", "c1", "a2", "b2", "c2"]
    assert len(seen) == 180


def test_a_rollout_that_fails_in_its_thread_fails_here_and_one_that_is_left_ends():
    def failing(watch):
        for _ in range(timing.TURN):
            watch()
        raise SclaError("the disk is full")

    threads = threading.active_count()
    with pytest.raises(SclaError, match="the disk is full"):
        exhaust(timing.paced(failing))
    left = timing.paced(lambda watch: exhaust(watch() for _ in range(1000)))
    next(left)
    left.close()
    assert threading.active_count() == threads


def test_growth_is_judged_by_ten_times_as_many_neurons():
    points = [growth.Point(1000, 3.0), growth.Point(2000, 6.0), growth.Point(10_000, 33.0), growth.Point(20_000, 90.0)]
    rows = growth.neurons_sheet(points).rows
    assert [row[4:] for row in rows] == [("", ""), ("", ""), ("11.0", "≤ 12 met"), ("15.0", "≤ 12 missed")]


def test_a_larger_network_runs_its_share_of_the_work():
    rng = np.random.Generator(np.random.PCG64(0))
    work = workload.rewarded(20, drive=8.0, release=0.5, rng=rng, neurons=2000)
    assert (work.drives > 0).sum(axis=1).tolist() == [200] * 20
    assert np.count_nonzero(work.releases, axis=1).tolist() == [0] * 19 + [2]
    assert (work.releases * workload.SIGNS >= 0).all()
    network = Network(NetworkConfig(), PlasticityConfig(), seed=0, neurons=2000)
    assert workload.run_chunks(network, work).sum() > 2000


def test_a_long_runs_tail_is_its_last_thousand_over_its_second():
    ends = [5.0, 8.0, 11.0, 14.3]
    long = {"cpu_s": ends, "simulated_s": [10.0, 20.0, 30.0, 41.0], "peak_mb": 360.0, "total_cpu_s": 15.0}
    values = processes.long_sheet({"peak_mb": 330.0}, long, bare_s=[3.5, 2.5, 3.25, 2.75]).values
    assert values["tail"] == pytest.approx(1.1)
    assert values["tail_over_bare_parts"] == pytest.approx(1.0)
    assert values["tail_by_simulated_second"] == pytest.approx(1.0)
    assert values["growth_mb"] == pytest.approx(30.0)
    assert values["ratio"] == pytest.approx(1.25)


def test_the_first_decision_is_timed_in_a_process_of_its_own():
    took = processes._first_decision(None)
    assert 0.1 < took.cpu_s < 60
    assert took.wall_s > 0.1


def test_tables_are_put_into_their_places_on_a_page():
    sheet = table.Sheet("one", "Title", ("what", "ms"), (("a", "1.0"),), "A note.", {})
    page = "before\n<!-- bench: one -->\nold\n<!-- end -->\nafter\n<!-- bench: two -->\nkept\n<!-- end -->\n"
    filled = table.replace_tables(page, [sheet], machine="a machine")
    assert "| a | 1.0 |" in filled
    assert "old" not in filled
    assert filled.startswith("before\n<!-- bench: one -->")
    assert "kept" in filled
    assert table.replace_tables(filled, [sheet], machine="a machine") == filled
    with pytest.raises(SclaError, match="no line <!-- bench: three -->"):
        table.replace_tables(page, [sheet._replace(key="three")], machine="a machine")


def test_nothing_is_overwritten_and_that_is_said_before_anything_is_measured(tmp_path, capsys):
    (tmp_path / "neurons.png").touch()
    assert main(["bench", "--growth", "--out", str(tmp_path)]) == 2
    assert "neurons.png exists already" in capsys.readouterr().err
    for option, value in (("--json", tmp_path / "neurons.png"), ("--into", tmp_path / "none.md")):
        assert main(["bench", option, str(value)]) == 2


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--brain", "random"], "no network to replay"),
        (["--plasticity.dopamine-delay-s", "0.1"], "without delay"),
        (["--localisation", "odometry"], "an undisturbed robot"),
        (["--disturbance.tilt-deg", "1"], "an undisturbed robot"),
        (["--repetitions", "0"], "1 or more"),
    ],
)
def test_what_cannot_be_replayed_is_refused_in_a_sentence(options, sentence, capsys):
    assert main(["bench", *options]) == 2
    assert sentence in capsys.readouterr().err


def test_the_command_prints_and_writes_every_table(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(kernel_parts, "_CALLS", 50)
    monkeypatch.setattr(kernel_parts, "_SECONDS", 1)
    monkeypatch.setattr(suites.processes, "start_up", lambda **_: table.Sheet("start", "Start", (), (), "", {"s": 1.0}))
    file = tmp_path / "bench.json"
    assert main(["bench", "--repetitions", "1", "--decisions", "5", "--json", str(file), "--out", str(tmp_path)]) == 0
    figures = json.loads(file.read_text())
    assert set(suites.SUITES["rollout"].keys) == figures.keys() - {"machine"}
    assert all(math.isfinite(value) for key in ("rollout", "network", "move") for value in figures[key].values())
    assert figures["move"]["bare_ratio"] == 1.0
    assert {f"{key}.csv" for key in suites.SUITES["rollout"].keys} <= {path.name for path in tmp_path.iterdir()}
    assert "CPU time of a move" in capsys.readouterr().out


def test_the_page_has_a_place_for_every_table_and_picture():
    page = (Path(__file__).parents[2] / "docs" / "performance.md").read_text(encoding="utf-8")
    for suite in suites.SUITES.values():
        empty = [table.Sheet(key, "", (), (), "", {}) for key in suite.keys]
        table.replace_tables(page, empty, machine="")
        assert all(f"(performance/{picture})" in page for picture in suite.pictures)
