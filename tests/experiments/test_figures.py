"""Figures of several runs: what is drawn is what the runs' files say, in every format."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import scla_mj
from scla_mj.anatomy import PAPER_ANATOMY, Anatomy, Projection, stacked
from scla_mj.cli.main import main
from scla_mj.config import ControllerConfig, TaskConfig
from scla_mj.errors import SclaError
from scla_mj.experiments import statistics
from scla_mj.experiments.figures import _draw_histogram, draw_runs
from scla_mj.runs.drawing import canvas
from scla_mj.signals import Snapshot


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures")
    for seed in (0, 1):
        config = scla_mj.RunConfig(brain="automaton", seed=seed, epochs=2, decisions=60, telemetry="off")
        scla_mj.rollout(config, folder / f"automaton-{seed}")
    crossed = TaskConfig(crossed_epoch=2)
    config = scla_mj.RunConfig(brain="random", epochs=2, decisions=60, telemetry="off", task=crossed)
    scla_mj.rollout(config, folder / "random")
    return [folder / "automaton-0", folder / "automaton-1", folder / "random"]


def test_every_format_has_its_size_in_millimetres_and_text_that_stays_text(runs, tmp_path):
    files = draw_runs(runs[:2], tmp_path / "out")
    assert sorted(file.name for file in files) == sorted(
        f"{name}.{kind}" for name in ("learning", "policy") for kind in ("png", "pdf", "svg")
    )
    with Image.open(tmp_path / "out/learning.png") as image:
        assert image.size[0] == round(180 / 25.4 * 220)
    svg = (tmp_path / "out/learning.svg").read_text(encoding="utf-8")
    assert "2 seeds (0 to 1)" in svg and "hits per 1000 decisions" in svg
    width_pt = float(re.search(r'<svg[^>]* width="([\d.]+)pt"', svg)[1])
    assert width_pt == pytest.approx(180 / 25.4 * 72, abs=0.1)
    pdf = (tmp_path / "out/learning.pdf").read_bytes()
    assert b"/Type3" not in pdf and b"CreationDate" not in pdf
    again = draw_runs(runs[:2], tmp_path / "again")
    assert [file.read_bytes() for file in files] == [file.read_bytes() for file in again]


def test_the_figure_of_seeds_shows_the_mean_of_their_policies(runs, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr("scla_mj.runs.drawing.draw_policy", lambda axes, grid, mean: seen.append(mean))
    monkeypatch.setattr("matplotlib.figure.Figure.colorbar", lambda *_, **__: None)
    draw_runs(runs[:2], tmp_path, kinds=["svg"])
    both = [np.load(run / "brain.npz")["probabilities"] for run in runs[:2]]
    assert np.array_equal(seen[0], (both[0] + both[1]) / 2)


def test_runs_of_other_settings_are_lines_of_their_own_and_no_file_is_overwritten(runs, tmp_path, capsys):
    words = ["figures", *map(str, runs), "--out", str(tmp_path), "--formats", "svg"]
    assert main(words) == 0
    text = (tmp_path / "learning.svg").read_text(encoding="utf-8")
    assert "brain automaton, 2 seeds (0 to 1)<" in text and "brain random, wheels crossed from epoch 2, seed 0<" in text
    assert ">any-start, 5×5 cells, target (3, 3); band: range of 2 runs<" in text, "what all have in common"
    assert "Not drawn for automaton: weights (no synapses that change)\n" in capsys.readouterr().out
    assert main(words) == 2
    assert "learning.svg is already there" in capsys.readouterr().err
    assert (tmp_path / "learning.svg").read_text(encoding="utf-8") == text


def test_lines_are_named_by_the_settings_that_differ_and_by_folders_only_where_none_does(tmp_path):
    rates = {"default": {}, "low": {"learning_rate": 0.3}, "said": {"learning_rate": 1.0}}
    folders = [tmp_path / name for name in rates]
    for folder, own in zip(folders, rates.values(), strict=True):
        config = scla_mj.RunConfig(brain="q-learning", brain_settings=own, epochs=1, decisions=3, telemetry="off")
        scla_mj.rollout(config, folder, pictures=False)
    labels = [re.findall(r">(brain\..*)</text>", drawn) for drawn in _drawn(folders[:2], folders, tmp_path)]
    assert labels[0] == ["brain.learning-rate 1.0", "brain.learning-rate 0.3"]
    assert labels[1] == [
        "brain.learning-rate 1.0, default", "brain.learning-rate 0.3", "brain.learning-rate 1.0, said"
    ]  # fmt: skip


def _drawn(*of):
    *several, folder = of
    for number, runs in enumerate(several):
        draw_runs(runs, folder / str(number), kinds=["svg"])
        yield (folder / str(number) / "learning.svg").read_text(encoding="utf-8")


def test_every_line_has_its_own_ceiling_and_chance(runs, tmp_path):
    config = scla_mj.RunConfig(brain="random", protocol="sensed-start", epochs=1, decisions=30, telemetry="off")
    scla_mj.rollout(config, tmp_path / "sensed", pictures=False)
    (drawn,) = _drawn([tmp_path / "sensed", runs[2]], tmp_path)
    named = re.findall(r">((?:ceiling|chance) [\d.]+)</text>", drawn)
    assert named == ["ceiling 1000", "chance 333.3", "ceiling 400", "chance 31.58"]


def test_a_band_is_an_interval_only_of_as_many_seeds_as_give_one(tmp_path):
    for seed in range(4):
        config = scla_mj.RunConfig(brain="random", seed=seed, epochs=2, decisions=40, telemetry="off")
        scla_mj.rollout(config, tmp_path / str(seed), pictures=False)
    several = [[tmp_path / str(seed) for seed in range(count)] for count in (1, 3, 4)]
    one, few, enough = _drawn(*several, tmp_path / "out")
    assert "target (3, 3), seed 0<" in one and "3 seeds (0 to 2); band: range of 3 runs<" in few
    assert "band: 95 % interval of the mean over 4 seeds<" in enough
    hits = np.array([[100.0, 3.0], [200.0, 1.0], [900.0, 2.0]])
    assert [list(end) for end in statistics.band(hits)] == [[400.0, 2.0], [100.0, 1.0], [900.0, 3.0]]


def test_long_names_of_settings_leave_each_line_its_own_file(runs, tmp_path):
    folders = [tmp_path / name for name in ("short", "long")]
    for folder, timeout_s in zip(folders, (8.0, 9.0), strict=True):
        slow = ControllerConfig(max_speed_m_s=0.7, max_turn_rate_rad_s=7.0, timeout_s=timeout_s)
        config = scla_mj.RunConfig(brain="automaton", controller=slow, epochs=1, decisions=3, telemetry="off")
        scla_mj.rollout(config, folder, pictures=False)
    files = draw_runs([runs[0], *folders], tmp_path / "out", kinds=["svg"])
    assert len({file.name for file in files}) == 4
    assert all(len(file.name) < 80 for file in files)


def test_every_weight_of_every_brain_is_in_the_histogram():
    anatomy = Anatomy(stacked(("a", 2), ("b", 3)), (Projection("atob", "a", "b", (2, 3)),))
    weights = {"atob": np.array([[-2.0, 30.0, 70.0], [55.0, 55.0, 60.0]])}
    run = SimpleNamespace(anatomy=anatomy, brain=Snapshot(weights))
    with canvas(height_mm=50) as (_, grid):
        _draw_histogram(grid[0, 0], SimpleNamespace(first=run, runs=[run]))
        (steps,) = grid[0, 0].patches
    at, share = steps.get_xy().T
    assert (at.min(), at.max(), share.max()) == (-2.0, 70.0, pytest.approx(100 / 3))


def test_the_key_of_a_histogram_lies_in_its_panel_and_above_all_bars():
    rng = np.random.Generator(np.random.PCG64(0))
    spread = {p.name: rng.normal(1.0 + 2.0 * (not p.dashed), 0.3, p.shape) for p in PAPER_ANATOMY.projections}
    run = SimpleNamespace(anatomy=PAPER_ANATOMY, brain=Snapshot(spread))
    with canvas(height_mm=62, columns=3) as (figure, grid):
        axes = grid[0, 2]
        _draw_histogram(axes, SimpleNamespace(first=run, runs=[run]))
        figure.draw_without_rendering()
        key, panel = axes.get_legend().get_window_extent(), axes.get_window_extent()
        assert panel.x0 <= key.x0 < key.x1 <= panel.x1 and key.y1 <= panel.y1
        assert key.y0 > max(bars.get_window_extent().y1 for bars in axes.patches)


def test_a_figure_that_cannot_be_finished_leaves_no_part_of_its_file(runs, tmp_path, monkeypatch):
    def half(figure, file, **how):
        file.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr("scla_mj.runs.drawing.save", half)
    with pytest.raises(KeyboardInterrupt):
        draw_runs(runs[2:], tmp_path / "out")
    assert not list((tmp_path / "out").iterdir())


def test_a_run_named_twice_and_several_runs_without_a_folder_are_refused(runs, tmp_path, capsys):
    with pytest.raises(SclaError, match="name each run once"):
        draw_runs([runs[0], runs[0]], tmp_path)
    assert main(["figures", *map(str, runs)]) == 2
    assert (
        capsys.readouterr().err
        == "scla-mj: several runs have no folder in common: say with --out where their figures go\n"
    )
    assert main(["figures"]) == 2
