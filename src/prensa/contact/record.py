"""What is remembered of contact points from one increment to the next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class ContactRecord:
    """Committed contact points with t tangential components, one in the plane and two in space.

    ``traction`` (points, t) along the tangents of the tool, ``slip`` (points,) accumulated, ``coordinate`` (points, t) on the
    tool's surface, ``closed`` (points,) flags.
    """

    traction: Array
    slip: Array
    coordinate: Array
    closed: Flags

    @classmethod
    def initial(cls, points: int, t: int) -> ContactRecord:
        """Points that nothing has happened to yet."""
        return cls(np.zeros((points, t)), np.zeros(points), np.zeros((points, t)), np.zeros(points, dtype=bool))

    def __len__(self) -> int:
        return len(self.slip)

    def of(self, rows: Any) -> ContactRecord:
        """Some of the points, as views where ``rows`` is a slice."""
        return ContactRecord(self.traction[rows], self.slip[rows], self.coordinate[rows], self.closed[rows])

    def replaced(self, rows: Any, other: ContactRecord) -> ContactRecord:
        """A copy with other values of some of the points."""
        out = ContactRecord(self.traction.copy(), self.slip.copy(), self.coordinate.copy(), self.closed.copy())
        out.traction[rows], out.slip[rows] = other.traction, other.slip
        out.coordinate[rows], out.closed[rows] = other.coordinate, other.closed
        return out


def magnitude(vectors: Array) -> Array:
    """Sizes (k,) of tangential vectors (k, t)."""
    if vectors.shape[1] == 1:
        return np.abs(vectors[:, 0])
    return np.asarray(np.sqrt((vectors**2).sum(axis=1)))
