"""Real powers for force laws, in half the time of `math.pow` where each waits for the last one.

x^p = 2^(p log2 x). Both halves follow the table-driven scheme of Tang (1989, ACM Trans. Math.
Softw. 15:144; 1990, 16:378): the upper bits of the argument choose a table entry, a cubic does the
rest. The order of operations keeps the chain from x to the result short. Relative error below
3e-14 (1 + |p|), which the integrator's own error hides.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from bayesimpact.model.jit.compiled import compiled

_MANTISSA, _BIAS = 52, 1023
_LOG_BITS, _EXP_BITS = 10, 9
_LOG_CELLS, _EXP_CELLS = 1 << _LOG_BITS, 1 << _EXP_BITS
_FRACTION, _ONE = (1 << _MANTISSA) - 1, _BIAS << _MANTISSA
_INVERSE = 1.0 / (1.0 + (np.arange(_LOG_CELLS) + 0.5) / _LOG_CELLS)  # of the cells' centres
_LOG = -np.log2(_INVERSE)
_ROOTS = (2.0 ** (np.arange(_EXP_CELLS) / _EXP_CELLS)).view(np.int64)
_SHIFT = 1.5 * 2.0 ** (_MANTISSA - _EXP_BITS)  # its sum with a number is rounded to a cell
_SHIFT_BITS = int(np.array(_SHIFT).view(np.int64))
_LN2 = math.log(2.0)
_L1, _L2, _L3 = 1.0 / _LN2, -0.5 / _LN2, 1.0 / (3.0 * _LN2)
_E1, _E2, _E3 = _LN2, _LN2**2 / 2.0, _LN2**3 / 6.0
_LARGEST = 1000.0  # of |p log2 x|


def _same_bits(source: Any, result: Any) -> Any:
    def same_bits(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, _: Any, arguments: Any) -> ir.Value:
            return builder.bitcast(arguments[0], context.get_value_type(result))

        return result(source), generate

    return intrinsic(same_bits)


_bits_of: Any = _same_bits(types.float64, types.int64)
_float_of: Any = _same_bits(types.int64, types.float64)


@compiled(forceinline=True, fastmath={"contract"})
def power(x: float, p: float) -> float:
    """x to the power p, for a normal x > 0."""
    bits = _bits_of(x)
    cell = (bits >> (_MANTISSA - _LOG_BITS)) & (_LOG_CELLS - 1)
    r = _float_of((bits & _FRACTION) | _ONE) * _INVERSE[cell] - 1.0
    first = p * (((bits >> _MANTISSA) - _BIAS) + _LOG[cell]) + (p * _L1) * r
    if not -_LARGEST < first < _LARGEST:
        return float(x**p)
    near = first + _SHIFT
    k = _bits_of(near) - _SHIFT_BITS
    f = (first - (near - _SHIFT)) + (r * r) * (p * _L2 + (p * _L3) * r)
    rest = (1.0 + _E1 * f) + (f * f) * (_E2 + _E3 * f)
    root = _ROOTS[k & (_EXP_CELLS - 1)] + ((k >> _EXP_BITS) << _MANTISSA)
    return float(_float_of(root) * rest)
