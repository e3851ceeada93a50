"""Fixed point: one function a rounding and overflow mode, on int64 scalars inside numba (and arrays for half_up).

A narrowing names both: `half_up(x, n)` drops n fraction bits with ties to +infinity, `x >> n` is the floor, `sat_s`
saturates. Nothing wraps.
"""

from __future__ import annotations

import numba
from numba.extending import intrinsic


@numba.njit(inline="always", cache=True)
def half_up(x, n):
    """x / 2**n rounded to nearest, ties to +infinity; n >= 1."""
    return (x + (1 << (n - 1))) >> n


@numba.njit(inline="always", cache=True)
def sat_s(x, bits):
    """x limited to -2**(bits-1) .. 2**(bits-1) - 1."""
    return min(max(x, -(1 << (bits - 1))), (1 << (bits - 1)) - 1)


def _own(operation):
    """An operation on two integers in those of the first: numba's own work in 64 bits, which vectorises less well."""

    @intrinsic
    def own(typing, x, y):
        def lower(context, builder, signature, arguments):
            second = context.cast(builder, arguments[1], signature.args[1], signature.args[0])
            return getattr(builder, operation)(arguments[0], second)

        return x(x, y), lower

    return own


add, sub, mul, shl, floor = (_own(operation) for operation in ("add", "sub", "mul", "shl", "ashr"))  # floor: x >> y
