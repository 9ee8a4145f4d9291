"""The figures say what the data say: read off their pixels."""

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from scla_mj.anatomy import PROJECTIONS
from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.account import Account
from scla_mj.grid import Action, Cell, Grid
from scla_mj.palette import PROJECTION_COLOURS, TARGET_COLOUR
from scla_mj.paths import EPOCHS_PNG, POLICY_PNG, WEIGHTS_PNG
from scla_mj.runs.drawing import POLICY_SHADES
from scla_mj.runs.plots import BAR, CEILING, CHANCE, plot_epochs, plot_policy, plot_weights
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


def test_bars_are_as_high_as_the_hits(tmp_path):
    plot_epochs(tmp_path, summary_of([100, 200, 300, 400]))
    columns = mask(pixels(tmp_path / EPOCHS_PNG), BAR).sum(axis=0)
    edges = np.flatnonzero(np.diff((columns > 5).astype(int)))
    bars = [columns[start + 1 : stop].max() for start, stop in edges.reshape(-1, 2)]
    assert np.array(bars) / bars[0] == pytest.approx([1, 2, 3, 4], abs=0.1)


def test_a_target_that_jumps_changes_the_ceiling_and_ends_the_line_of_chance(tmp_path):
    """Bars of 400, 240 and 240 hits reach their epochs' ceilings: the line lies on top of each."""
    plot_epochs(tmp_path, summary_of([400, 240, 240], [400.0, 240.0, 240.0]))
    image = pixels(tmp_path / EPOCHS_PNG)
    bars = mask(image, BAR)
    edges = np.flatnonzero(np.diff((bars.sum(axis=0) > 20).astype(int))).reshape(-1, 2)
    above_axis = slice(int(0.85 * len(image)))
    ceiling, walk = mask(image[above_axis], CEILING), mask(image[above_axis], CHANCE)
    tops = []
    for start, stop in edges:
        assert ceiling[:, start:stop].sum(axis=1).max() > 0.4 * (stop - start)  # dashed
        tops.append(int(np.flatnonzero(bars[:, (start + stop) // 2])[0]))
        assert abs(int(ceiling[:, start:stop].sum(axis=1).argmax()) - tops[-1]) < 8
    assert tops[1] - tops[0] > 100 and abs(tops[1] - tops[2]) < 4  # the dashes hide a bar's edge, or do not
    dotted = [int(walk[tops[1] + 50 :, start:stop].sum(axis=1).max()) for start, stop in edges]
    assert dotted[0] > 20 and dotted[1:] == [0, 0]


def test_weights_are_drawn_in_warm_colours_where_sensor_and_motor_agree(tmp_path):
    time_s = np.linspace(0, 600, 50)
    means = np.array([[3.9 if projection.agrees else 0.3 for projection in PROJECTIONS]]) + np.zeros((50, 1))
    means += np.linspace(-0.25, 0.0, 8)
    plot_weights(tmp_path, WeightCurve(np.arange(50), time_s, means), PROJECTIONS, summary_of([400]))
    image = pixels(tmp_path / WEIGHTS_PNG)[:, : 5 * 150]  # left of the legend
    upper, lower = image[: image.shape[0] // 2], image[image.shape[0] // 2 :]
    for projection in PROJECTIONS:
        colour = PROJECTION_COLOURS[projection.name]
        own, other = (upper, lower) if projection.agrees else (lower, upper)
        assert mask(own, colour).sum() > 100
        assert mask(other, colour).sum() < 10


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


def test_the_same_data_give_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        plot_epochs(tmp_path / name, summary_of([3, 9]))
        plot_policy(tmp_path / name, PAPER, np.full((5, 5, 4), 0.25), summary_of([3, 9]))
    for name in (EPOCHS_PNG, POLICY_PNG):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


@pytest.mark.parametrize(("cells", "target"), [((2, 1), (1, 1)), ((1, 9), (1, 9)), ((30, 20), (7, 7))])
def test_grids_of_any_shape_and_runs_of_no_length_are_drawn(tmp_path, cells, target):
    plot_policy(tmp_path, Grid(cells, Cell(*target), 0.3), np.full((*cells, 4), 0.25), summary_of([]))
    plot_weights(tmp_path, WeightCurve(np.zeros(0, int), np.zeros(0), np.zeros((0, 8))), PROJECTIONS, summary_of([]))
    plot_epochs(tmp_path, summary_of([]))
    assert {path.name for path in tmp_path.iterdir()} == {POLICY_PNG, WEIGHTS_PNG, EPOCHS_PNG}


def test_a_figure_is_the_same_whatever_matplotlib_was_told_before(tmp_path):
    plot_epochs(tmp_path, summary_of([100]))
    plain = (tmp_path / EPOCHS_PNG).read_bytes()
    with mpl.rc_context({"text.usetex": True, "figure.dpi": 1, "savefig.dpi": 1, "font.family": "monospace"}):
        plot_epochs(tmp_path, summary_of([100]))
    assert (tmp_path / EPOCHS_PNG).read_bytes() == plain
