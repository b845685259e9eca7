"""Calls from compiled code to a force law by its address.

The integrator is compiled once and knows no law; laws are compiled one by one. So a combination of
effects, or a law written by a user, needs no new compilation of the integrator.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def _call_law(
    typing_context: Any,
    address: Any,
    y: Any,
    v: Any,
    d: Any,
    t: Any,
    z: Any,
    touching: Any,
    p: Any,
    q: Any,
) -> Any:
    """Value of the law at `address`; `p` and `q` are addresses of float64 arrays."""
    signature = types.float64(types.int64, *[types.float64] * 6, types.uintp, types.uintp)

    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        double, pointer = ir.DoubleType(), ir.DoubleType().as_pointer()
        kind = ir.FunctionType(double, [double] * 6 + [pointer] * 2)
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        numbers = list(arguments[1:7])
        pointers = [builder.inttoptr(a, pointer) for a in arguments[7:]]
        return builder.call(function, numbers + pointers)

    return signature, generate


def _pointer(kind: Any) -> Any:
    """The address of an array as a pointer to numbers of this kind.

    A pointer owns nothing, so compiled code passes it around without counting references: two
    thirds of the time of a step otherwise.
    """

    pointer_type: Any = types.CPointer(kind)  # type: ignore[no-untyped-call]

    def pointer(typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(pointer_type))

        return pointer_type(types.uintp), generate

    return intrinsic(pointer)


call_law: Any = _call_law
floats_at: Any = _pointer(types.float64)
integers_at: Any = _pointer(types.int64)
