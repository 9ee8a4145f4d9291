"""The house rules, read off the source: imports only go down, each fact has its place, files stay small."""

import ast
from pathlib import Path

import pytest

import scla_mj

PACKAGE = Path(scla_mj.__file__).parent
ROOT = Path(__file__).parents[1]
LEAVES = "leaf"
LAYERS = {LEAVES: 0, "world": 1, "sense": 1, "brain": 1, "control": 1, "telemetry": 1, "runs": 1}
LAYERS |= {"loop": 2, "engine": 3, "experiments": 4, "cli": 5}
LINES_AT_MOST = 300
FUNCTION_LINES_AT_MOST = 50

MODULES = sorted(PACKAGE.rglob("*.py"))
SOURCES = [*MODULES, *sorted((ROOT / "scripts").rglob("*.py")), *sorted((ROOT / "tests").rglob("*.py"))]


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT if ROOT in path.parents else PACKAGE.parent))


def layer_of(module: str) -> str:
    """Return the layer of a dotted module of ours, such as `scla_mj.brain.kernel` or `scla_mj.grid`."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and (PACKAGE / parts[1]).is_dir() else LEAVES


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


def foreign(path: Path) -> set[str]:
    return {module.split(".")[0] for module in imports(path)}


def own(path: Path) -> str:
    return layer_of(".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts))


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_only_go_down(path):
    layer = own(path)
    assert layer in LAYERS, f"{layer} is a new room: give it a floor in LAYERS"
    for module in imports(path):
        if module.split(".")[0] != "scla_mj":
            continue
        below = layer_of(module)
        assert below == layer or LAYERS[below] < LAYERS[layer], f"{name_of(path)} ({layer}) imports {module} ({below})"


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_physics_knows_no_neurons_and_neurons_no_physics(path):
    used = foreign(path)
    if own(path) in ("brain", "sense", "runs", LEAVES):
        assert not used & {"mujoco", "dm_control"}, f"{name_of(path)} imports physics"
    if own(path) in ("world", "control"):
        assert not [module for module in imports(path) if "anatomy" in module], f"{name_of(path)} knows neurons"


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_only_telemetry_records_and_only_the_command_line_parses(path):
    used = foreign(path)
    if own(path) != "telemetry":
        assert "rerun" not in used, f"{name_of(path)} imports rerun: only telemetry may"
    if own(path) != "cli" and path.name != "config.py":
        assert "tyro" not in used, f"{name_of(path)} imports tyro: only the command line and the configuration may"


@pytest.mark.parametrize("path", sorted((ROOT / "scripts").glob("*.py")), ids=name_of)
def test_a_script_that_calls_the_command_line_does_nothing_else(path):
    ours = {layer_of(module) for module in imports(path) if module.startswith("scla_mj")}
    assert "cli" not in ours or ours == {"cli"}


def test_leaves_have_no_import_cycles():
    """`if TYPE_CHECKING` aside, which never runs: every leaf can be loaded after the leaves that it needs."""
    needs = {}
    for path in PACKAGE.glob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        modules = [node.module for node in tree.body if isinstance(node, ast.ImportFrom) and node.module]
        needs[path.stem] = {module.split(".")[1] for module in modules if module.startswith("scla_mj.")}
    loaded: set[str] = set()
    while ready := {name for name in needs.keys() - loaded if needs[name] <= loaded}:
        loaded |= ready
    assert loaded == needs.keys()


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
    assert not foreign(path) & {"random", "pickle", "shelve", "marshal"}
