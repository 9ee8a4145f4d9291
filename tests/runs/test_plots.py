"""The figures say what the data say: read off their pixels."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.quiver import Quiver
from PIL import Image

from scla_mj.anatomy import PROJECTIONS
from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.account import Account
from scla_mj.grid import Action, Cell, Grid
from scla_mj.palette import PROJECTION_COLOURS, TARGET_COLOUR
from scla_mj.paths import LEARNING_PNG, POLICY_PNG, WEIGHTS_PNG
from scla_mj.runs.drawing import (
    POLICY_SHADES,
    block_edges,
    block_hits,
    block_middles,
    canvas,
    draw_policy,
    draw_weights,
    of_one_run,
    over_decisions,
)
from scla_mj.runs.plots import CEILING, CHANCE, HITS, plot_learning, plot_policy, plot_weights
from scla_mj.runs.summary import epoch_summary
from scla_mj.signals import WeightCurve

PAPER = Grid((5, 5), Cell(3, 3), 0.3)


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def mask(image, colour):
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
    return (np.abs(image - rgb) < 12).all(axis=2)


def summary_of(hits, ceilings=()):
    summary = Account(check(RunConfig())).summary()
    own = ceilings or [400.0] * len(hits)
    epochs = tuple(epoch_summary(n + 1, 1000, count, own[n], nearer=0, beyond=0) for n, count in enumerate(hits))
    return type(summary)(**{**vars(summary), "epochs": epochs})


def test_blocks_share_no_decision_and_leave_none_out():
    hits = np.random.Generator(np.random.PCG64(3)).random(4321) < 0.3
    edges = block_edges(len(hits))
    assert edges[0] == 0 and edges[-1] == len(hits)
    lengths = np.diff(edges)
    assert lengths.min() >= 25 and lengths.max() <= 1000 + 25
    assert (block_hits(hits, edges) * lengths / 1000).sum() == pytest.approx(hits.sum(), abs=1e-9)
    assert (block_middles(edges) > edges[:-1]).all() and (block_middles(edges) <= edges[1:]).all()


@pytest.mark.parametrize("decisions", [1, 24, 25, 49, 50])
def test_a_short_run_is_one_block_or_two(decisions):
    edges = block_edges(decisions)
    assert edges.tolist() == ([0, decisions] if decisions < 50 else [0, 25, 50])
    assert block_hits(np.ones(decisions, bool), edges) == pytest.approx(1000.0)


def test_the_ceiling_steps_where_the_target_jumps_and_the_line_of_chance_ends_there(tmp_path):
    """All of 1000 decisions hit, then none of 1000: the scale; the ceilings of the epochs are 800 and 500."""
    hits = np.repeat([True, False], 1000)
    plot_learning(tmp_path, summary_of([1000, 0], [800.0, 500.0]), hits)
    image = pixels(tmp_path / LEARNING_PNG)
    curve, ceiling = mask(image, HITS), mask(image, CEILING)
    columns = np.flatnonzero(curve.any(axis=0))
    top, bottom = (int(np.flatnonzero(curve[:, columns[side]]).mean()) for side in (20, -2))
    dashed = top + np.flatnonzero(ceiling[top:bottom, columns[0] : columns[-1]].sum(axis=1) > 30)
    for level in (800.0, 500.0):
        assert abs(dashed - (bottom + (top - bottom) * level / 1000.0)).min() < 4
    assert len(dashed) < 12  # and there is no other
    chance = mask(image[bottom - 25 : bottom - 8], CHANCE).any(axis=0)
    after = np.flatnonzero(chance[columns[0] : columns[-1]])
    assert after.max() < 0.93 * (columns[-1] - columns[0])  # the last third of a decade is the second epoch


def test_weights_are_solid_where_sensor_and_motor_agree_else_dashed_in_the_colour_of_the_sensor(tmp_path):
    time_s = np.linspace(0, 600, 50)
    means = np.array([[3.9 if projection.agrees else 0.3 for projection in PROJECTIONS]]) + np.zeros((50, 1))
    means += np.linspace(-0.25, 0.0, 8)
    plot_weights(tmp_path, WeightCurve(np.arange(1, 51) * 20, time_s, means), PROJECTIONS, summary_of([400]))
    image = pixels(tmp_path / WEIGHTS_PNG)[:, : 4 * 220]  # left of the legend
    upper, lower = image[: image.shape[0] // 2], image[image.shape[0] // 2 :]
    for colour in set(PROJECTION_COLOURS.values()):
        solid, dashed = (mask(half, colour).any(axis=0).sum() for half in (upper, lower))
        assert 0.4 * solid < dashed < 0.85 * solid


def test_weights_below_zero_are_in_the_picture():
    with canvas(height_mm=50) as (_, grid):
        draw_weights(grid[0, 0], np.arange(9.0), of_one_run(np.full((9, 8), -1.5)), PROJECTIONS)
        low, high = grid[0, 0].get_ylim()
    assert low < -1.5 < high


def test_the_policys_dark_quarter_lies_where_the_action_leads(tmp_path):
    """x to the right and y upwards: up is the upper quarter of the picture's cell."""
    certain = {Cell(1, 1): Action.UP, Cell(5, 1): Action.LEFT, Cell(1, 5): Action.RIGHT, Cell(5, 5): Action.DOWN}
    probabilities = np.full((5, 5, 4), 0.25)
    for cell, action in certain.items():
        probabilities[cell.x - 1, cell.y - 1] = np.eye(4)[action]
    plot_policy(tmp_path, PAPER, probabilities, summary_of([400]))
    image = pixels(tmp_path / POLICY_PNG)
    image = image[:, : int(image.shape[1] * 0.84)]  # without the colour bar
    assert POLICY_SHADES == "Blues"
    rows, columns = np.nonzero(mask(image, "#08306b"))
    y_target, x_target = (np.mean(places) for places in np.nonzero(mask(image, TARGET_COLOUR)))
    pixels_per_cell = (columns.max() - x_target) / 2.5
    for cell, action in certain.items():
        centre_x, centre_y = x_target + (cell.x - 3) * pixels_per_cell, y_target - (cell.y - 3) * pixels_per_cell
        inside = (abs(columns - centre_x) < pixels_per_cell / 2) & (abs(rows - centre_y) < pixels_per_cell / 2)
        step = np.array([columns[inside].mean() - centre_x, centre_y - rows[inside].mean()]) / pixels_per_cell
        assert step @ action.step == pytest.approx(1 / 3, abs=0.08)  # a triangle's centroid
        assert abs(step @ Action(3 - action).step) < 0.05


def test_an_arrow_points_at_an_action_and_never_between_two():
    probabilities = np.full((5, 5, 4), 0.25)
    probabilities[0, 0] = [0.5, 0.5, 0.0, 0.0]
    with canvas(height_mm=50) as (_, grid):
        draw_policy(grid[0, 0], PAPER, probabilities)
        (arrows,) = (each for each in grid[0, 0].collections if isinstance(each, Quiver))
    first, second = (Action(number).step for number in (0, 1))
    assert np.allclose(np.column_stack([arrows.U, arrows.V]), 0.5 * np.array([first, second]))


@pytest.mark.parametrize(("ends", "named"), [([150, 300], "epoch 1 2"), ([1000, 2000, 3000], "epoch 1 3"),
                                             ([1000 * n for n in range(1, 12)], "epoch 1 3 10")])  # fmt: skip
def test_the_last_epoch_is_named_where_there_is_room(ends, named):
    with canvas(height_mm=50) as (_, grid):
        over_decisions(grid[0, 0], ends)
        (top,) = grid[0, 0].child_axes
        assert " ".join(label.get_text() for label in top.get_xticklabels()) == named


def test_the_same_data_give_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        plot_learning(tmp_path / name, summary_of([3, 9]), np.arange(2000) % 3 == 0)
        plot_policy(tmp_path / name, PAPER, np.full((5, 5, 4), 0.25), summary_of([3, 9]))
    for name in (LEARNING_PNG, POLICY_PNG):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


@pytest.mark.parametrize(("cells", "target"), [((2, 1), (1, 1)), ((1, 9), (1, 9)), ((30, 20), (7, 7))])
def test_grids_of_any_shape_and_runs_of_no_length_are_drawn(tmp_path, cells, target):
    plot_policy(tmp_path, Grid(cells, Cell(*target), 0.3), np.full((*cells, 4), 0.25), summary_of([]))
    plot_weights(tmp_path, WeightCurve(np.zeros(0, int), np.zeros(0), np.zeros((0, 8))), PROJECTIONS, summary_of([]))
    plot_learning(tmp_path, summary_of([]), np.zeros(0, bool))
    assert {path.name for path in tmp_path.iterdir()} == {POLICY_PNG, WEIGHTS_PNG, LEARNING_PNG}


def test_a_figure_is_the_same_whatever_matplotlib_was_told_before(tmp_path):
    plot_learning(tmp_path, summary_of([100]), np.arange(1000) % 10 == 0)
    plain = (tmp_path / LEARNING_PNG).read_bytes()
    with mpl.rc_context({"text.usetex": True, "figure.dpi": 1, "savefig.dpi": 1, "font.family": "monospace"}):
        plot_learning(tmp_path, summary_of([100]), np.arange(1000) % 10 == 0)
    assert (tmp_path / LEARNING_PNG).read_bytes() == plain
