"""A hint to the processor: fetch a record of an array that is read soon, and lies where it would not look."""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

_BYTE: Any = ir.IntType(8).as_pointer()
_INT: Any = ir.IntType(32)


@intrinsic  # type: ignore[untyped-decorator]
def prefetch(typing: Any, array: Any, index: Any) -> Any:
    """Fetch `array[index]` for writing; `index` must not be negative. Nothing changes, whatever lies there."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        struct = context.make_array(array)(context, builder, arguments[0])
        place = cgutils.get_item_pointer(context, builder, array, struct, [arguments[1]], wraparound=False)
        hint = builder.module.declare_intrinsic(
            "llvm.prefetch", [_BYTE], ir.FunctionType(ir.VoidType(), [_BYTE] + [_INT] * 3)
        )
        builder.call(hint, [builder.bitcast(place, _BYTE), *(_INT(number) for number in (1, 3, 1))])
        return context.get_dummy_value()

    return types.none(array, index), generate
