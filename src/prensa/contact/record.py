"""Contact history: the state of contact points that one increment leaves to the next."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from prensa.types import Array, Flags, Index

# what a column holds at each point: a number, t of them, or a flag; they begin as zero and false
_SCALAR = {"tangential": False, "dtype": np.float64}
_TANGENTIAL = {"tangential": True, "dtype": np.float64}
_FLAG = {"tangential": False, "dtype": np.bool_}


@dataclass(frozen=True)
class ContactRecord:
    """Committed contact points with t tangential components, one in the plane and two in space.

    ``traction`` (points, t) along the tangents of the tool, ``slip`` (points,) accumulated, ``coordinate`` (points, t) on the
    tool's surface, ``closed`` (points,) flags, ``speed`` (points,) of slip in the last increment, ``area`` (points,) that the
    tractions belonged to in it, ``time`` (points,) in contact (seconds) and ``path`` (points,) of sliding, without friction too,
    both since the beginning. A further column is a further line here, and whoever computes it fills it in.
    """

    traction: Array = field(metadata=_TANGENTIAL)
    slip: Array = field(metadata=_SCALAR)
    coordinate: Array = field(metadata=_TANGENTIAL)
    closed: Flags = field(metadata=_FLAG)
    speed: Array = field(metadata=_SCALAR)
    area: Array = field(metadata=_SCALAR)
    time: Array = field(metadata=_SCALAR)
    path: Array = field(metadata=_SCALAR)

    @classmethod
    def initial(cls, points: int, t: int) -> ContactRecord:
        """Points that nothing has happened to yet."""
        shapes = [((points, t) if f.metadata["tangential"] else (points,), f.metadata["dtype"]) for f in fields(cls)]
        return cls(*(np.zeros(shape, dtype) for shape, dtype in shapes))

    def __len__(self) -> int:
        return len(self.slip)

    def of(self, rows: slice | Index | Flags) -> ContactRecord:
        """Some of the points, as views where ``rows`` is a slice."""
        return ContactRecord(*(getattr(self, f.name)[rows] for f in fields(self)))

    def replaced(self, rows: slice | Index | Flags, other: ContactRecord) -> ContactRecord:
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
