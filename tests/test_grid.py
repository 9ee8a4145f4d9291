"""The discrete world against hand arithmetic and the exact ceilings of docs/errata.md."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scla_mj.errors import SclaError
from scla_mj.grid import PROTOCOLS, Action, Cell, Grid

PAPER = Grid((5, 5), Cell(3, 3), 0.3)


@pytest.mark.parametrize(
    ("cells", "target", "ceiling"),
    [
        ((5, 5), (3, 3), 400.0),
        ((5, 5), (1, 1), 240.0),
        ((5, 5), (5, 2), 4800 / 17),
        ((7, 7), (4, 4), 2000 / 7),
    ],
)
def test_the_any_start_ceiling_is_that_of_docs_errata(cells, target, ceiling):
    assert Grid(cells, Cell(*target), 0.3).ceiling_hits_per_1000("any-start") == pytest.approx(ceiling, rel=1e-12)


def test_the_sensed_start_ceiling_is_a_hit_a_decision():
    assert PAPER.ceiling_hits_per_1000("sensed-start") == 1000.0


def test_distances_on_an_open_floor_are_city_block():
    for cell in PAPER.all_cells():
        assert PAPER.distances[cell] == abs(cell.x - 3) + abs(cell.y - 3)


def test_a_closed_cell_makes_the_way_round_longer():
    grid = Grid((3, 2), Cell(1, 1), 0.3, frozenset({Cell(2, 1)}))
    assert grid.distances[Cell(3, 1)] == 4  # up, left, left, down
    assert grid.after(Cell(3, 1), Action.LEFT) == Cell(3, 1)
    assert Cell(2, 1) not in grid.start_cells("any-start")


def test_x_grows_to_the_right_and_y_upwards_from_one():
    assert [Cell(2, 2).after(action) for action in Action] == [Cell(2, 3), Cell(2, 1), Cell(1, 2), Cell(3, 2)]
    assert PAPER.all_cells()[0] == Cell(1, 1)
    assert PAPER.all_cells()[-1] == Cell(5, 5)


def test_an_action_and_its_opposite_cancel():
    for action in Action:
        assert Cell(3, 3).after(action).after(action.opposite) == Cell(3, 3)
        assert action.opposite.opposite is action


def test_walls_stop_a_move_at_every_edge():
    edges = {Action.UP: Cell(2, 5), Action.DOWN: Cell(2, 1), Action.LEFT: Cell(1, 2), Action.RIGHT: Cell(5, 2)}
    for action, cell in edges.items():
        assert PAPER.after(cell, action) == cell
    blocked = sum(PAPER.after(cell, action) == cell for cell, action in itertools.product(PAPER.all_cells(), Action))
    assert blocked == 20  # the floor's circumference, in cells


def test_a_sensor_sees_the_target_one_cell_away_and_no_further():
    seen = {cell: PAPER.sensed_from(cell) for cell in PAPER.all_cells()}
    directions = {Cell(3, 2): Action.UP, Cell(3, 4): Action.DOWN, Cell(4, 3): Action.LEFT, Cell(2, 3): Action.RIGHT}
    assert {cell: action for cell, action in seen.items() if action is not None} == directions


def test_the_protocols_start_in_24_cells_and_in_4():
    assert len(PAPER.start_cells("any-start")) == 24
    assert set(PAPER.start_cells("sensed-start")) == {Cell(3, 2), Cell(3, 4), Cell(2, 3), Cell(4, 3)}
    assert len(Grid((5, 5), Cell(1, 1), 0.3).start_cells("sensed-start")) == 2


def test_the_floor_is_centred_on_the_origin():
    assert PAPER.centre_m(Cell(3, 3)) == pytest.approx((0.0, 0.0))
    assert PAPER.centre_m(Cell(1, 5)) == pytest.approx((-0.6, 0.6))


grids = st.tuples(st.integers(1, 12), st.integers(1, 12)).filter(lambda cells: cells[0] * cells[1] > 1)


@given(grids, st.data(), st.floats(0.05, 5.0))
def test_every_point_within_a_cell_belongs_to_it(cells, data, size_m):
    target = Cell(data.draw(st.integers(1, cells[0])), data.draw(st.integers(1, cells[1])))
    grid = Grid(cells, target, size_m)
    x_m, y_m = grid.centre_m(target)
    for dx, dy in itertools.product((-0.49, 0.0, 0.49), repeat=2):
        assert grid.cell_at(x_m + dx * size_m, y_m + dy * size_m) == target


@given(grids, st.data())
def test_a_ceiling_lies_between_a_hit_a_decision_and_a_hit_a_longest_path(cells, data):
    target = Cell(data.draw(st.integers(1, cells[0])), data.draw(st.integers(1, cells[1])))
    grid = Grid(cells, target, 0.3)
    for protocol in PROTOCOLS:
        assert 1000 / (cells[0] + cells[1] - 2) <= grid.ceiling_hits_per_1000(protocol) <= 1000.0


def test_points_beyond_the_walls_belong_to_the_nearest_cell():
    assert PAPER.cell_at(-9.0, 9.0) == Cell(1, 5)
    assert PAPER.cell_at(9.0, -9.0) == Cell(5, 1)


@pytest.mark.parametrize(
    ("cells", "target", "size_m", "closed", "said"),
    [
        ((5, 5), (6, 3), 0.3, (), r"the target \(6, 3\) is off the 5x5 grid: x must be 1 to 5"),
        ((5, 5), (0, 3), 0.3, (), "off the 5x5 grid"),
        ((0, 5), (1, 1), 0.3, (), "at least two cells"),
        ((1, 1), (1, 1), 0.3, (), "at least two cells"),
        ((5, 5), (3, 3), 0.0, (), "above 0 and finite"),
        ((5, 5), (3, 3), float("inf"), (), "above 0 and finite"),
        ((5, 5), (3, 3), float("nan"), (), "must be above 0"),
        ((5, 5), (3, 3), 0.3, ((6, 6),), r"the closed cell \(6, 6\) is off"),
        ((5, 5), (3, 3), 0.3, ((3, 3),), "is a closed cell"),
        ((5, 5), (3, 3), 0.3, ((1, 2), (2, 1)), r"the cell \(1, 1\) is walled off"),
        ((2, 1), (1, 1), 0.3, ((2, 1),), "leave at least one open"),
    ],
)
def test_an_impossible_grid_is_refused_in_one_sentence(cells, target, size_m, closed, said):
    with pytest.raises(SclaError, match=said) as caught:
        Grid(cells, Cell(*target), size_m, frozenset(Cell(*cell) for cell in closed))
    assert "\n" not in str(caught.value)
