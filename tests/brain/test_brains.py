"""The brains that SCLA is compared with, and a user's own."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from bodiless import build, live

from scla_mj.config import GridConfig
from scla_mj.errors import SclaError
from scla_mj.markov import hits_per_1000
from scla_mj.signals import Percept

BASE = "from scla_mj.brain import Brain as Base\n\nclass Brain(Base):\n    decide = learn = None\n"
OWN_BRAIN = Path(__file__).parents[2] / "docs" / "own-brain.md"


def test_the_automaton_alone_learns_the_four_cells_next_to_the_target_and_nothing_else():
    brain, grid = build("automaton")
    live(brain, grid, 20_000)
    probabilities = brain.snapshot().probabilities
    for cell in grid.open_cells():
        sensed = grid.sensed_from(cell)
        if sensed is None:
            assert probabilities[cell.x - 1, cell.y - 1].tolist() == [0.25] * 4
        else:
            assert probabilities[cell.x - 1, cell.y - 1, sensed] > 0.999
    assert hits_per_1000(grid, "any-start", probabilities) == pytest.approx(115.38, abs=0.02)


def test_the_random_brain_earns_what_the_random_walk_earns():
    brain, grid = build("random")
    hits = live(brain, grid, 20_000)
    # A hit's number of moves has a deviation about as large as its mean: renewal theory gives sqrt(hits).
    assert hits == pytest.approx(20 * 31.58, abs=5 * np.sqrt(20 * 31.58))


def test_the_shortest_path_brain_earns_the_ceiling():
    brain, grid = build("shortest-path", grid=GridConfig(closed_cells=((2, 3), (3, 2))))
    distances = grid.distances
    for cell in grid.open_cells():
        if cell != grid.target:
            action = brain.decide(Percept(cell, grid.sensed_from(cell))).action
            assert distances[grid.after(cell, action)] == distances[cell] - 1


def test_the_network_alone_never_changes_a_probability():
    brain, grid = build("network")
    live(brain, grid, 150)
    assert (brain.snapshot().probabilities == 0.25).all()
    assert brain.network.mean_weights().max() > 1.1


@pytest.fixture
def documented(tmp_path, monkeypatch):
    """The page's brain and its variant with settings, where an own brain lies."""
    brain, with_settings, _ = re.findall(r"```python\n(.*?)```", OWN_BRAIN.read_text(), re.DOTALL)
    assert len(brain.splitlines()) < 40
    (tmp_path / "my_brain.py").write_text(f"{brain}\n\n{with_settings}")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry not in ("", ".")])


def test_the_documented_brain_of_ones_own_works(documented):
    brain, grid = build("my_brain:LastGoodMove")
    live(brain, grid, 5_000)
    assert hits_per_1000(grid, "any-start", brain.snapshot().probabilities) == pytest.approx(115.38, abs=0.01)


def test_the_documented_settings_of_ones_own_are_taken_and_checked(documented):
    brain, _ = build("my_brain:MostlyGoodMove", brain_settings={"trust": 0.0})
    assert brain.trust == 0.0
    assert build("my_brain:MostlyGoodMove")[0].trust == 0.9
    with pytest.raises(SclaError, match=r"--brain.trust is 1.5: it must be .*1"):
        build("my_brain:MostlyGoodMove", brain_settings={"trust": 1.5})


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("oracle", "unknown"),
        ("os:getcwd", "is not a brain"),
        ("operator:eq", "not a brain"),
        ("no_such_module:Brain", "cannot be imported"),
        ("os:NoSuchClass", "no class"),
        ("../evil:Brain", "unknown"),
    ],
)
def test_what_is_no_brain_is_refused_in_a_sentence(name, word):
    with pytest.raises(SclaError, match=word):
        build(name)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("def half(:\n", "cannot be imported: SyntaxError: invalid syntax"),
        ("import sys\nsys.exit(3)\n", "cannot be imported: SystemExit: 3, {file} line 2"),
        ("1 / 0\n", "cannot be imported: ZeroDivisionError: division by zero, {file} line 1"),
        (
            "import absent_library\n",
            "cannot be imported: ModuleNotFoundError: No module named 'absent_library', {file}",
        ),
        ("import json\njson.loads('[')\n", "column 2 (char 1), {file} line 2"),
        (BASE + "    def __init__(self, checked):\n        checked.nothing\n", "'nothing', {file} line 6"),
        (
            BASE + "    def __init__(self, checked):\n        raise ValueError('two\\nlines')\n",
            "two lines, {file} line 6",
        ),
        (BASE + "    reads = 'network.'\n", "its reads must be a tuple, such as ('network.',)"),
        (
            "from dataclasses import dataclass\n" + BASE + "    @dataclass\n    class Settings:\n        rate: float\n",
            "its setting rate must have a default",
        ),
        (BASE + "    def __init__(self):\n        pass\n", "takes 1 positional argument but 2 were given"),
    ],
)
def test_a_brain_that_cannot_be_imported_or_made_is_told_with_its_file_and_line(source, said, tmp_path, monkeypatch):
    module = f"mistaken_{tmp_path.name}"
    file = tmp_path / f"{module}.py"
    file.write_text(source)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SclaError) as refusal:
        build(f"{module}:Brain")
    assert said.format(file=file) in str(refusal.value)
    assert str(refusal.value).count(str(file)) == (not any(word in said for word in ("positional", "must")))
    assert "\n" not in str(refusal.value)
