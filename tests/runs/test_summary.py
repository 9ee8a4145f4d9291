"""`summary.json` against counts made another way."""

import dataclasses
import json

import numpy as np
import pytest

from scla_mj.checked import check
from scla_mj.config import RunConfig, TaskConfig
from scla_mj.engine.account import Account
from scla_mj.errors import SclaError
from scla_mj.grid import Cell
from scla_mj.paths import SUMMARY_JSON
from scla_mj.runs.atomic import read_json, write_json
from scla_mj.runs.decisions import DecisionLog, read_decisions
from scla_mj.runs.summary import epoch_summary, read_summary, write_summary
from scla_mj.signals import Localised, Outcome

KEYS = (
    "brain protocol seed cells target others crossed_epoch ceiling_hits_per_1000 chance_hits_per_1000 epochs "
    "transitions max_position_error_m simulated_s wall_s localisation"
)


def tallied(records, config=None):
    account = Account(check(config or RunConfig()))
    for record in records:
        account.add(record, 12.5)
    return dataclasses.replace(account.summary(), wall_s=0.25)


def test_the_file_has_exactly_the_documented_keys(tmp_path, walk):
    write_summary(tmp_path, tallied(walk(2, 50)))
    content = read_json(tmp_path / SUMMARY_JSON)
    assert list(content) == KEYS.split()
    assert list(content["epochs"][0]) == [
        "epoch", "decisions", "hits", "hits_per_1000", "moves_per_hit", "percent_of_ceiling",
        "ceiling_hits_per_1000", "moves_nearer", "share_nearer", "moves_beyond", "regret_per_episode", "mean_weights",
    ]  # fmt: skip
    assert list(content["transitions"]) == ["commanded", "completed", "blocked", "failed"]
    assert (content["cells"], content["target"], content["wall_s"]) == ([5, 5], [3, 3], 0.25)


def test_the_counts_are_those_of_the_decisions_table(tmp_path, walk):
    records = list(walk(3, 700))
    with DecisionLog(tmp_path, ("MU", "MD", "ML", "MR")) as log:
        for record in records:
            log.write(record)
    table, summary = read_decisions(tmp_path), tallied(records)
    epochs, hits = table["epoch"].to_numpy(), table["hit"].to_numpy()
    assert [epoch.hits for epoch in summary.epochs] == np.bincount(epochs, hits)[1:].tolist()
    assert {epoch.decisions for epoch in summary.epochs} == {700}
    outcomes = table["outcome"].to_pylist()
    transitions = summary.transitions
    assert (transitions.commanded, transitions.completed, transitions.blocked, transitions.failed) == (
        2100, outcomes.count("moved"), outcomes.count("blocked"), 0
    )  # fmt: skip
    assert summary.max_position_error_m == table["position_error_m"].to_numpy().max()


def test_the_papers_automaton_makes_28_75_percent_and_8_70_moves_a_hit():
    epoch = epoch_summary(1, 1000, 115, 400.0, nearer=300, beyond=1150)
    assert (epoch.hits_per_1000, epoch.percent_of_ceiling) == (115.0, 28.75)
    assert epoch.moves_per_hit == pytest.approx(8.6957, abs=1e-4)
    assert (epoch.share_nearer, epoch.regret_per_episode) == (0.3, 10.0)
    short = epoch_summary(2, 250, 100, 400.0, nearer=250, beyond=0)
    assert (short.hits_per_1000, short.percent_of_ceiling, short.moves_per_hit) == (400.0, 100.0, 2.5)


def test_the_regret_of_whole_episodes_is_their_moves_beyond_the_shortest_path(walk):
    """The walk starts every episode in the corner (1, 1), four moves away, and is cut after its last hit."""
    records = list(walk(1, 3000))
    records = records[: 1 + max(number for number, record in enumerate(records) if record.hit)]
    epoch = tallied(records).epochs[0]
    assert epoch.moves_beyond == len(records) - 4 * epoch.hits
    assert epoch.regret_per_episode == pytest.approx(epoch.moves_per_hit - 4)

    def away(cell):
        return abs(cell.x - 3) + abs(cell.y - 3)

    came_nearer = [away(record.move.after) < away(record.move.before) for record in records]
    assert (epoch.moves_nearer, epoch.share_nearer) == (sum(came_nearer), np.mean(came_nearer))


def test_moves_are_judged_by_the_target_of_their_epoch(walk):
    config = RunConfig(epochs=2, task=TaskConfig(jump_epoch=2, jump_target=(1, 1)))
    move = next(walk(1, 1)).move._replace(before=Cell(2, 1), after=Cell(1, 1))
    record = next(walk(1, 1))._replace(move=move, hit=False)
    summary = tallied([record, record._replace(epoch=2)], config)
    assert [(epoch.moves_nearer, epoch.moves_beyond) for epoch in summary.epochs] == [(0, 2), (1, 0)]
    assert [epoch.regret_per_episode for epoch in summary.epochs] == [None, None]


def test_an_epoch_without_a_hit_has_no_moves_per_hit(tmp_path, walk):
    summary = tallied(record._replace(hit=False) for record in walk(1, 5))
    write_summary(tmp_path, summary)
    assert json.loads((tmp_path / SUMMARY_JSON).read_text())["epochs"][0]["moves_per_hit"] is None
    assert read_summary(tmp_path) == summary


def test_failed_moves_are_counted_and_one_that_ended_nowhere_hides_no_other_error(walk):
    records = list(walk(1, 9))
    move = records[4].move._replace(outcome=Outcome.FAILED, position_error_m=float("nan"))
    summary = tallied([*records[:4], records[4]._replace(move=move), *records[5:]])
    assert summary.transitions.failed == 1
    others = [record.move.position_error_m for record in (*records[:4], *records[5:])]
    assert summary.max_position_error_m == max(others) > 0


def test_a_summary_is_read_back_as_it_was_written(tmp_path, walk):
    summary = tallied(walk(2, 90))
    write_summary(tmp_path, summary)
    assert read_summary(tmp_path) == summary


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("wall_s", "soon", "wall_s is 'soon': it must be a number"),
        ("epochs", [{}], r"epochs\[0\]\.epoch is missing"),
        ("surprise", 1, "surprise is not a setting"),
    ],
)
def test_a_damaged_summary_is_refused_by_its_key(tmp_path, walk, key, value, said):
    write_summary(tmp_path, tallied(walk(1, 5)))
    content = read_json(tmp_path / SUMMARY_JSON)
    write_json(tmp_path / SUMMARY_JSON, {**content, key: value})
    with pytest.raises(SclaError, match=said):
        read_summary(tmp_path)


def test_beliefs_are_counted_where_the_robot_finds_its_own_place(tmp_path, walk):
    errors = (0.01, 0.2, 0.03)
    records = [
        record._replace(localised=Localised(error_m, error_m < 0.15))
        for record, error_m in zip(walk(1, 3), errors, strict=True)
    ]
    account, later = (Account(check(RunConfig())) for _ in range(2))
    account.add(records[0], 1.0)
    later.restore(account.state())
    for record in records[1:]:
        later.add(record, 1.0)
    found = later.summary().localisation
    assert (found.max_error_m, found.mean_error_m, found.wrong_cells) == (0.2, pytest.approx(0.08), 1)
    assert tallied(walk(1, 3)).localisation is None
