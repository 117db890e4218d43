"""What is remembered of contact points from one increment to the next."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


def _column(tangential: bool = False, flags: bool = False) -> Any:
    """A named column: t numbers a point or one, which begin as zero, or flags that begin as false."""
    return field(metadata={"tangential": tangential, "dtype": np.bool_ if flags else np.float64})


@dataclass(frozen=True)
class ContactRecord:
    """Committed contact points with t tangential components, one in the plane and two in space.

    ``traction`` (points, t) along the tangents of the tool, ``slip`` (points,) accumulated, ``coordinate`` (points, t) on the
    tool's surface, ``closed`` (points,) flags. A further column is a further line here, and whoever computes it fills it in.
    """

    traction: Array = _column(tangential=True)
    slip: Array = _column()
    coordinate: Array = _column(tangential=True)
    closed: Flags = _column(flags=True)

    @classmethod
    def initial(cls, points: int, t: int) -> ContactRecord:
        """Points that nothing has happened to yet."""
        shapes = [((points, t) if f.metadata["tangential"] else (points,), f.metadata["dtype"]) for f in fields(cls)]
        return cls(*(np.zeros(shape, dtype) for shape, dtype in shapes))

    def __len__(self) -> int:
        return len(self.slip)

    def of(self, rows: Any) -> ContactRecord:
        """Some of the points, as views where ``rows`` is a slice."""
        return ContactRecord(*(getattr(self, f.name)[rows] for f in fields(self)))

    def replaced(self, rows: Any, other: ContactRecord) -> ContactRecord:
        """A copy with other values of some of the points."""
        columns = [getattr(self, f.name).copy() for f in fields(self)]
        for column, f in zip(columns, fields(self)):
            column[rows] = getattr(other, f.name)
        return ContactRecord(*columns)


def magnitude(vectors: Array) -> Array:
    """Sizes (k,) of tangential vectors (k, t)."""
    if vectors.shape[1] == 1:
        return np.abs(vectors[:, 0])
    return np.asarray(np.sqrt((vectors**2).sum(axis=1)))
