"""The controller's own source, compiled for Warp: `begin` and `tick` of scla_mj/control, in float32.

Warp reads a subset of Python. Only the form is changed: no annotated assignments, and tuples name by name.
"""

from __future__ import annotations

import ast
import inspect
import linecache
import math
from types import ModuleType
from typing import Any, Final

import warp as wp

from benchmarks.gpu.structs import fields_of, struct
from scla_mj.control import caution, controller, motion, profile

_SAME: Final = ("atan", "atan2", "copysign", "cos", "isfinite", "sin", "sqrt")
"""Functions of `math` that Warp has under their names."""


@wp.func
def _hypot(x: wp.float32, y: wp.float32) -> wp.float32:
    return wp.sqrt(x * x + y * y)


class _Plain(ast.NodeTransformer):
    """Rewrites what Warp does not read."""

    def visit_Import(self, node: ast.Import) -> None:
        return None

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST | None:
        return node if node.module == "__future__" else None

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        return ast.copy_location(ast.Assign([node.target], node.value or ast.Constant(None)), node)

    def visit_Assign(self, node: ast.Assign) -> Any:
        value, target = node.value, node.targets[0]
        if isinstance(value, ast.IfExp) and isinstance(value.body, ast.Tuple) and isinstance(value.orelse, ast.Tuple):
            pairs = zip(value.body.elts, value.orelse.elts, strict=True)
            value = ast.Tuple([ast.IfExp(value.test, one, other) for one, other in pairs], ast.Load())
        if not (isinstance(value, ast.Tuple) and isinstance(target, ast.Tuple)):
            return node
        held = [f"held_{node.lineno}_{number}" for number in range(len(value.elts))]
        first = [ast.Assign([ast.Name(name, ast.Store())], part) for name, part in zip(held, value.elts, strict=True)]
        then = [ast.Assign([part], ast.Name(name, ast.Load())) for name, part in zip(held, target.elts, strict=True)]
        return first + then


def _translated() -> dict[str, Any]:
    """Return the names that the controller's modules define, with Warp's functions in place of compiled ones."""
    ours = ModuleType("math")
    vars(ours).update({name: getattr(wp, name) for name in _SAME}, hypot=_hypot, nan=math.nan, pi=math.pi)
    names: dict[str, Any] = {name: value for name, value in vars(motion).items() if isinstance(value, int)}
    names |= {name: struct(name, fields_of(getattr(motion, name))) for name in ("Motion", "Goal", "Gains", "State")}
    names |= {"math": ours, "leaf_njit": lambda **_: wp.func, "__name__": __name__}
    for module in (profile, caution, controller):
        plain = _Plain().visit(ast.parse(inspect.getsource(module)))
        text, file = ast.unparse(ast.fix_missing_locations(plain)), f"<{module.__name__} for Warp>"
        linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)  # where Warp looks for it
        exec(compile(text, file, "exec"), names)
    return names


_NAMES: Final = _translated()
begin: Any = _NAMES["begin"]
tick: Any = _NAMES["tick"]
Motion: Any = _NAMES["Motion"]
Goal: Any = _NAMES["Goal"]
Gains: Any = _NAMES["Gains"]
State: Any = _NAMES["State"]
