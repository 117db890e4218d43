"""SIMD transposition between array-of-structures and structure-of-arrays layout, eight points at a time.

Kernels that answer for many points at once take a quantity of all of them as one row of their scratch. Numbers that are carried
there and back one by one take up to half of such a kernel's time. Here eight points go at a time: eight numbers of each are one
vector, and the matrix of them is transposed by exchanges between rows that are 1, 2 and 4 apart.

Each of these functions takes ``points``, an array in C order, ``at``, the place in it of the first number of the first of the
eight points, and ``step`` from one point to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

WIDE = 8
"""Points that are carried at a time, and the most numbers of each."""
EIGHTS_OF_25 = (0, 8, 16, 17)
"""First columns of the eights that are carried of 25, the last of which overlap."""
_NARROW = 4
_DOUBLE, _LONG, _SHORT = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
_VECTOR, _NARROW_VECTOR = ir.VectorType(_DOUBLE, WIDE), ir.VectorType(_DOUBLE, _NARROW)


def _base(context: Any, builder: Any, type_: Any, array: Any) -> Any:
    """Where the numbers of an array begin."""
    return context.make_array(type_)(context, builder, array).data


def _contiguous(array: Any) -> None:
    if not (isinstance(array, types.Array) and array.layout == "C" and array.dtype == types.float64):
        raise TypingError(f"points are carried between arrays of double precision in C order, not {array}")


def _shuffled(builder: Any, first: Any, second: Any, places: list[int]) -> Any:
    return builder.shuffle_vector(first, second, ir.Constant(ir.VectorType(_SHORT, len(places)), places))


def transposed(builder: Any, v: list[Any]) -> list[Any]:
    """Eight vectors, as rows of a matrix → its columns."""
    for far in (1, 2, 4):
        low = [j - far + WIDE if j & far else j for j in range(WIDE)]
        high = [j + WIDE if j & far else j + far for j in range(WIDE)]
        for j in range(WIDE):
            if not j & far:
                a, b = v[j], v[j + far]
                v[j], v[j + far] = _shuffled(builder, a, b, low), _shuffled(builder, a, b, high)
    return v


def load(builder: Any, place: Any, columns: int = WIDE) -> Any:
    """A vector that begins with the first ``columns`` numbers from a place on."""
    type_ = _VECTOR if columns == WIDE else _NARROW_VECTOR
    value = builder.load(builder.bitcast(place, type_.as_pointer()))
    value.align = 8
    if columns == WIDE:
        return value
    value = _shuffled(builder, value, ir.Constant(_NARROW_VECTOR, ir.Undefined), list(range(WIDE)))
    for k in range(_NARROW, columns):
        number = builder.load(builder.gep(place, [ir.Constant(_LONG, k)]))
        value = builder.insert_element(value, number, ir.Constant(_SHORT, k))
    return value


def store(builder: Any, value: Any, place: Any, columns: int = WIDE) -> None:
    """The first ``columns`` numbers of a vector from a place on."""
    type_ = _VECTOR if columns == WIDE else _NARROW_VECTOR
    part = value if columns == WIDE else _shuffled(builder, value, value, list(range(_NARROW)))
    builder.store(part, builder.bitcast(place, type_.as_pointer()), align=8)
    for k in range(_NARROW, 0 if columns == WIDE else columns):
        number = builder.extract_element(value, ir.Constant(_SHORT, k))
        builder.store(number, builder.gep(place, [ir.Constant(_LONG, k)]))


def _carrier(columns: int, inwards: bool) -> Callable[..., None]:
    """(points, at, step, last, rows, to, apart): ``columns`` numbers of eight points to or from as many rows of the scratch.

    The first row begins at ``to`` in rows (n,), the next ones ``apart`` from each other. Of the points only those up to the
    number ``last`` are there: beyond it what is read is that one again, and nothing is written.
    """

    def typed(_: Any, points: Any, at: Any, step: Any, last: Any, rows: Any, to: Any, apart: Any) -> Any:
        _contiguous(points)
        _contiguous(rows)

        def generated(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            points, at, step, last, rows, to, apart = args
            of_points, of_rows = _base(context, builder, sig.args[0], points), _base(context, builder, sig.args[4], rows)
            near, far = [], []
            for j in range(WIDE):
                number = ir.Constant(_LONG, j)
                here = builder.select(builder.icmp_signed("<", number, last), number, last)
                near.append(builder.gep(of_points, [builder.add(at, builder.mul(step, here))]))
                far.append(builder.gep(of_rows, [builder.add(to, builder.mul(apart, number))]))
            if inwards:
                found = transposed(builder, [load(builder, place, columns) for place in near])
                for value, place in zip(found[:columns], far):
                    store(builder, value, place)
            else:
                nothing = [ir.Constant(_VECTOR, ir.Undefined)] * (WIDE - columns)
                found = transposed(builder, [load(builder, place) for place in far[:columns]] + nothing)
                # backwards: the last point comes after those beyond it, which are written in its place
                for value, place in reversed(list(zip(found, near))):
                    store(builder, value, place, columns)
            return context.get_dummy_value()

        return types.void(points, types.intp, types.intp, types.intp, rows, types.intp, types.intp), generated

    return intrinsic(typed)


def _announcer(write: bool) -> Callable[..., None]:
    """(points, at, step): what begins at the first numbers of eight points is wanted soon, to be read or to be written.

    It comes from memory meanwhile. There need not be such points.
    """

    def typed(_: Any, points: Any, at: Any, step: Any) -> Any:
        _contiguous(points)

        def generated(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            points, at, step = args
            byte = ir.IntType(8).as_pointer()
            type_ = ir.FunctionType(ir.VoidType(), [byte, _SHORT, _SHORT, _SHORT])
            function = builder.module.declare_intrinsic("llvm.prefetch", [byte], type_)
            how = [ir.Constant(_SHORT, k) for k in (int(write), 3, 1)]  # into all caches, of data
            base = _base(context, builder, sig.args[0], points)
            for j in range(WIDE):
                place = builder.gep(base, [builder.add(at, builder.mul(step, ir.Constant(_LONG, j)))])
                builder.call(function, [builder.bitcast(place, byte), *how])
            return context.get_dummy_value()

        return types.void(points, types.intp, types.intp), generated

    return intrinsic(typed)


into_rows, five_into_rows, four_into_rows = _carrier(WIDE, True), _carrier(5, True), _carrier(_NARROW, True)
out_of_rows, five_out_of_rows, four_out_of_rows = _carrier(WIDE, False), _carrier(5, False), _carrier(_NARROW, False)
to_be_read, to_be_written = _announcer(False), _announcer(True)
