"""A floor of one's own: a map says where closed cells, targets, starts and slippery cells are, and from which epoch."""

import dataclasses

import pytest

from scla_mj.checked import check
from scla_mj.config import GridConfig, RunConfig, TaskConfig
from scla_mj.engine.build import build_task
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.floor import refuse_changed_floor
from scla_mj.grid import Action, Cell
from scla_mj.markov import hits_per_1000, uniform_policy
from scla_mj.runs.folder import read_settings

ICE = "; ice\nS . ~ ~ .\n. # ~ # A\nT . ~ . B\n~ = grip 0.3\nA = target from 4\nB = start, target from 8\n"


@pytest.fixture
def floor(tmp_path):
    def write(text, **settings):
        file = tmp_path / "floor.txt"
        file.write_text(text, encoding="utf-8")
        return RunConfig(grid=GridConfig(floor=str(file)), brain="random", telemetry="off", **settings)

    return write


def test_a_map_is_read_with_its_top_row_first(floor):
    grid = check(floor(ICE)).grid()
    assert grid.cells == (5, 3)
    assert grid.targets == ((1, 1),)
    assert grid.closed == {(2, 2), (4, 2)}
    assert grid.start_cells("any-start") == [(1, 3), (5, 1)]
    assert grid.grip == dict.fromkeys([(3, 3), (4, 3), (3, 2), (3, 1)], 0.3)


def test_targets_move_from_epoch_to_epoch_and_each_stage_has_its_own_ceiling(floor):
    checked = check(floor(ICE))
    assert [checked.grid(epoch).target for epoch in (1, 3, 4, 7, 8, 99)] == [(1, 1)] * 2 + [(5, 2)] * 2 + [(5, 1)] * 2
    assert checked.ceiling_hits_per_1000(1) == pytest.approx(2000 / (2 + 4))  # by hand: (1, 3) in 2, (5, 1) in 4
    assert checked.ceiling_hits_per_1000(4) == pytest.approx(2000 / (5 + 1))
    assert checked.ceiling_hits_per_1000(8) == pytest.approx(1000 / 6)  # one start lies under the target


def test_the_mazes_ceiling_is_the_mean_way_to_the_nearest_of_its_two_targets():
    checked = check(RunConfig(grid=GridConfig(floor="maze")))
    grid = checked.grid()
    assert len(grid.targets) == 2
    starts = grid.start_cells("any-start")
    assert starts == [cell for cell in grid.open_cells() if cell not in grid.targets]
    way = sum(min(steps(grid, cell, target) for target in grid.targets) for cell in starts)
    assert checked.ceiling_hits_per_1000() == pytest.approx(1000 * len(starts) / way)


def steps(grid, start, target):
    """Return the shortest way by repeated relaxation."""
    far = dict.fromkeys(grid.open_cells(), 10**6) | {target: 0}
    for _ in far:
        far = {cell: min([far[cell], *(1 + far[beyond] for _, beyond in grid.neighbours(cell))]) for cell in far}
    return far[start]


def test_the_random_walk_between_two_targets_is_the_gamblers_ruin(floor):
    grid = check(floor("T . . . T")).grid()  # left or right with probability 1/4 each: k (n - k) * 2 moves
    assert hits_per_1000(grid, "any-start", uniform_policy(grid)) == pytest.approx(1000 / ((3 + 4 + 3) * 2 / 3))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds no map"),
        ("..T\n..", "row 2 has 2 cells, row 1 has 3"),
        ("..x\n..T", r"row 1 has 'x', which means nothing: use \. # T S"),
        ("...\n...", "has no target: mark at least one cell with T"),
        (".#T\n###", r"the cell \(1, 2\) is walled off from the target"),
        ("T#T\n.#.", r"the cell \(3, 1\) is walled off"),
        ("T.a\na = grip 9", "a = grip 9 says nothing of a cell: write open, closed"),
        ("T.a\na = start, closed", r"the start \(3, 1\) is a closed cell"),
        ("TTa.\na = target from 3", "has 2 targets at first and 1 from epoch 3"),
        ("T.S", None),
    ],
)
def test_a_map_that_cannot_be_is_refused_with_one_sentence(floor, text, said):
    config = floor(text)
    if said is None:
        check(config)
        return
    with pytest.raises(SclaError, match=said) as refused:
        check(config)
    assert "\n" not in str(refused.value)


def test_settings_beside_a_map_and_files_that_are_none_are_refused(floor, tmp_path):
    config = floor(ICE)
    with pytest.raises(SclaError, match="--cells is 7 7, but --floor has its own: leave --cells out"):
        check(dataclasses.replace(config, grid=dataclasses.replace(config.grid, cells=(7, 7))))
    with pytest.raises(SclaError, match="moves a single target"):
        check(dataclasses.replace(config, task=TaskConfig(jump_epoch=2)))
    with pytest.raises(SclaError, match=r"--protocol sensed-start has no cell to start in"):
        check(dataclasses.replace(config, protocol="sensed-start"))
    with pytest.raises(SclaError, match=r"nowhere\.txt cannot be read: No such file"):
        check(RunConfig(grid=GridConfig(floor=str(tmp_path / "nowhere.txt"))))


def test_a_run_keeps_its_map_and_only_resuming_minds_a_changed_file(floor, tmp_path):
    config = floor("T.A\nA = target from 2", epochs=2, decisions=5)
    summary = rollout(config, tmp_path / "run")
    assert [epoch.ceiling_hits_per_1000 for epoch in summary.epochs] == pytest.approx([2000 / 3, 2000 / 3])
    floor("..T")
    stored = read_settings(tmp_path / "run")
    assert check(stored).grid(2).targets == ((3, 1),)
    with pytest.raises(SclaError, match="has changed since the run began: put it back"):
        refuse_changed_floor(stored.grid)
    (tmp_path / "floor.txt").unlink()
    refuse_changed_floor(stored.grid)


def test_a_stored_configuration_with_another_floor_or_robot_has_no_part_of_the_old(floor):
    config = check(floor(ICE)).config
    config = check(dataclasses.replace(config, robot="mouse", robot_sha256="0" * 64)).config
    assert config.robot_sha256 == ""
    for other in ("maze", ""):
        found = check(dataclasses.replace(config, grid=dataclasses.replace(config.grid, floor=other)))
        assert found.config.grid == check(RunConfig(grid=GridConfig(floor=other))).config.grid
        assert check(found.config).grids == check(RunConfig(grid=GridConfig(floor=other))).grids
    with pytest.raises(SclaError, match="--target is 2 1, but --floor has its own"):
        check(dataclasses.replace(config, grid=dataclasses.replace(config.grid, floor="maze", target=(2, 1))))
    own = GridConfig(floor_text="; mine\n..T")
    assert check(RunConfig(grid=own)).grid().cells == (3, 1)


def test_a_robot_reaches_either_target_and_drives_over_ice_to_where_it_should(floor):
    task = build_task(floor("~ ~ ~ ~ ~\n~ ~ ~ ~ ~\nT . . . T\n~ = grip 0.3"))
    for action, target in ((Action.LEFT, Cell(1, 1)), (Action.RIGHT, Cell(5, 1))):
        hit = False
        while task.percept.cell.y > 1 or task.percept.cell.x in (1, 5):
            task.act(Action.DOWN)
        while not hit:
            step = task.act(action)
            hit = step.feedback.hit
        assert step.move.after == target
    world, slips = task.world, 0
    world.spawn(Cell(1, 3), 0.0)
    task._percept = None
    for action in [Action.RIGHT] * 4 + [Action.DOWN] + [Action.LEFT] * 4:
        before = task.percept.cell
        move = task.act(action).move
        slips += move.duration_s > 1.2  # careful: a third of the acceleration
        assert move.after == before.after(action)
        assert move.position_error_m < 0.03
    assert slips
