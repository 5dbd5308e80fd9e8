"""Asking for memory before it is needed."""

from typing import Any

from llvmlite import ir
from numba import void
from numba.core import cgutils
from numba.extending import intrinsic

_TO_READ, _KEEP, _DATA = 0, 3, 1
"""Arguments of llvm.prefetch, by definition in LLVM's language reference: a read, to stay in all levels of
the cache, of data rather than instructions."""


def _prefetch(_context: Any, array: Any, row: Any, column: Any) -> Any:
    """Have an element of an array (rows, columns) brought to the cache, without waiting for it."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0])
        indices = list(arguments[1:])
        place = cgutils.get_item_pointer(context, builder, signature.args[0], data, indices)  # type: ignore[no-untyped-call]
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [place.type, number, number, number])
        function = builder.module.declare_intrinsic("llvm.prefetch", (place.type,), kind)
        builder.call(function, [place, number(_TO_READ), number(_KEEP), number(_DATA)])
        return context.get_dummy_value()

    return void(array, row, column), generate


prefetch: Any = intrinsic(_prefetch)
