"""Figures of several runs: what is drawn is what the runs' files say, in every format."""

import re

import numpy as np
import pytest
from PIL import Image

import scla_mj
from scla_mj.cli.main import main
from scla_mj.config import TaskConfig
from scla_mj.errors import SclaError
from scla_mj.experiments.figures import draw_runs


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
    assert "automaton, any-start, 2 seeds<" in text and "random, any-start, wheels crossed from epoch 2<" in text
    assert main(words) == 2
    assert "learning.svg is already there" in capsys.readouterr().err
    assert (tmp_path / "learning.svg").read_text(encoding="utf-8") == text


def test_a_run_named_twice_and_several_runs_without_a_folder_are_refused(runs, tmp_path, capsys):
    with pytest.raises(SclaError, match="name each run once"):
        draw_runs([runs[0], runs[0]], tmp_path)
    assert main(["figures", *map(str, runs)]) == 2
    assert (
        capsys.readouterr().err
        == "scla-mj: several runs have no folder in common: say with --out where their figures go\n"
    )
    assert main(["figures"]) == 2
