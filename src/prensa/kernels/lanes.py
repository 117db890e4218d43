"""SIMD transposition between array-of-structures and structure-of-arrays layout, eight points at a time.

Numbers that are moved one by one take up to half of the time of a kernel that answers for many points at once. Here eight
points go at a time: eight numbers of each are one vector, and the matrix of them is transposed by exchanges between rows that are
1, 2 and 4 apart.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir

WIDE = 8
"""Points that go at a time, and the most numbers of each."""
_NARROW = 4
_DOUBLE, _LONG, _SHORT = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
_VECTOR, _NARROW_VECTOR = ir.VectorType(_DOUBLE, WIDE), ir.VectorType(_DOUBLE, _NARROW)


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
    # Rows begin at any number: a vector is aligned as its numbers are, not to its own size.
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
