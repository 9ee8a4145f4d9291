"""The Python interface: light to import, complete, and exactly what its page shows."""

import json
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

import scla_mj

DOCS = Path(__file__).parents[1] / "docs"
PAGES = [DOCS / name for name in ("quickstart.md", "python.md", "environments.md", "network.md", "../README.md")]
IMPORT_S = 0.05


def blocks(page: Path) -> list[str]:
    """Return a page's Python, one program per heading: the blocks under it belong together."""
    programs = ["\n".join(re.findall(r"(?<!-->\n)```python\n(.*?)```", part, re.DOTALL))
                for part in page.read_text(encoding="utf-8").split("\n## ")]  # fmt: skip
    return [program for program in programs if program]


@pytest.mark.parametrize(
    ("page", "number"), [(page, number) for page in PAGES if page.exists() for number in range(len(blocks(page)))]
)
def test_every_program_of_the_page_runs(page, number, tmp_path, monkeypatch):
    if "from stable_baselines3" in blocks(page)[number]:
        pytest.importorskip("stable_baselines3")  # its torch is not in the lock
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    program = types.ModuleType("__main__")  # where a brain of the program's own is found
    monkeypatch.setitem(sys.modules, "__main__", program)
    exec(compile(blocks(page)[number], f"{page.name}, program {number + 1}", "exec"), program.__dict__)


def test_the_notebook_runs(monkeypatch):
    import matplotlib.pyplot as plt

    notebook = json.loads((DOCS / "first-brain.ipynb").read_text(encoding="utf-8"))
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    program = types.ModuleType("__main__")
    monkeypatch.setitem(sys.modules, "__main__", program)
    exec(compile("\n".join(cells).replace("DECISIONS = 600", "DECISIONS = 60"), "notebook", "exec"), program.__dict__)
    assert plt.gcf().axes
    plt.close("all")


def test_importing_the_package_imports_nothing_heavy_and_takes_no_time():
    program = (
        "import sys, time; started = time.perf_counter(); import scla_mj; took = time.perf_counter() - started; "
        "print(took, *sorted({name.split('.')[0] for name in sys.modules}))"
    )
    tries = [subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
             for _ in range(5)]  # fmt: skip
    assert min(float(words[0]) for words in tries) < IMPORT_S
    assert not {"numpy", "numba", "mujoco", "rerun", "pyarrow", "pydantic", "tyro", "scipy"} & set(tries[0])


def test_every_public_name_is_there_and_documented():
    assert len(scla_mj.__all__) > 35
    for name in scla_mj.__all__:
        thing = getattr(scla_mj, name)
        assert name in dir(scla_mj)
        assert not callable(thing) or thing.__doc__, f"{name} has no docstring"


def test_a_name_that_does_not_exist_is_an_attribute_error():
    with pytest.raises(AttributeError, match="rolout"):
        _ = scla_mj.rolout
