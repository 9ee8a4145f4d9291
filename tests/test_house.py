"""The house rules, read off the source: imports only go down, rooms and files stay small, nothing draws globally."""

import ast
from pathlib import Path

import pytest
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

import scla_mj

PACKAGE = Path(scla_mj.__file__).parent
ROOT = Path(__file__).parents[1]
LINES_AT_MOST = 300
FUNCTION_LINES_AT_MOST = 50
PACKAGE_LINES_AT_MOST = 28_000
"""Anatomies, networks by description, environments, exports, sweeps, other bodies and videos; fewer are wanted."""
ROOM_SHARE_AT_MOST = 0.25
CORE_SHARE_AT_LEAST = 0.35
CORE_ROOMS = {"brain", "loop", "world", "sense", "control"}
CORE_LEAVES = {"anatomy", "checked", "clock", "config", "disturbances", "grid", "markov", "randomness", "signals",
               "validation"}  # fmt: skip
"""What the project exists for: the brain, the coupling, the embodiment, and the task that they share."""

MODULES = sorted(PACKAGE.rglob("*.py"))
SOURCES = [
    *MODULES,
    *(path for folder in ("benchmarks", "scripts", "tests") for path in sorted((ROOT / folder).rglob("*.py"))),
]


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT if ROOT in path.parents else PACKAGE.parent))


def imports(path: Path) -> set[str]:
    """Return every module that a file imports, anywhere in it; `from a import b` counts as a.b."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name_of(path)} imports relatively: write the whole name"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def lines_by_room() -> dict[str, int]:
    """Return the lines of every folder of the package, and of every module that lies in none, by its name."""
    lines: dict[str, int] = {}
    for path in MODULES:
        room = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        lines[room] = lines.get(room, 0) + len(path.read_text(encoding="utf-8").splitlines())
    return lines


def test_imports_only_go_down_in_no_circle_and_each_library_has_its_rooms(monkeypatch):
    monkeypatch.chdir(ROOT)  # the contracts are in pyproject.toml; imports under TYPE_CHECKING count
    monkeypatch.setattr("logging.config.dictConfig", lambda _: None)  # it would switch all other loggers off
    assert lint_imports(cache_dir=None) == EXIT_STATUS_SUCCESS


def test_the_package_stays_small_no_room_outgrows_the_others_and_its_core_is_what_it_is_for():
    lines = lines_by_room()
    total = sum(lines.values())
    assert total <= PACKAGE_LINES_AT_MOST
    for room, count in lines.items():
        assert count <= ROOM_SHARE_AT_MOST * total, f"{room} has {count} of {total} lines"
    assert sum(lines[room] for room in CORE_ROOMS | CORE_LEAVES) >= CORE_SHARE_AT_LEAST * total


@pytest.mark.parametrize("path", sorted((ROOT / "scripts").glob("*.py")), ids=name_of)
def test_a_script_that_calls_the_command_line_does_nothing_else(path):
    ours = {module.split(".")[1] for module in imports(path) if module.startswith("scla_mj.")}
    assert "cli" not in ours or ours == {"cli"}


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_files_and_functions_stay_small(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LINES_AT_MOST
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            assert length <= FUNCTION_LINES_AT_MOST, f"{node.name} has {length} lines"


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_no_module_draws_from_a_global_generator_or_unpickles(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute):
            assert ast.unparse(node) not in {
                "np.random.seed",
                "np.random.rand",
                "np.random.randn",
                "np.random.default_rng",
            }
    foreign = {module.split(".")[0] for module in imports(path)}
    assert not foreign & {"random", "pickle", "shelve", "marshal"}
