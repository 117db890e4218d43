"""Rigid-body motions of places: three in the plane, along x and y and the turn; six in space, along and about x, y and z."""

from __future__ import annotations

import numpy as np

from prensa.geometry.plane import cross
from prensa.types import Array


def seen_along(arm: Array, n: Array) -> Array:
    """Rigid-body motions (k, m) as they are seen along directions n (k, d) at arms (k, d) from where turns are about."""
    if arm.shape[1] == 3:
        return np.hstack([n, np.cross(arm, n)])  # n · (e × arm) = e · (arm × n)
    return np.column_stack([n, cross(arm, n)])


def displacements(arm: Array) -> Array:
    """Displacements (k, d, m) of arms (k, d) for a unit of each motion."""
    k, d = arm.shape
    directions = [np.broadcast_to(e, (k, d)) for e in np.eye(d)]
    return np.stack([seen_along(arm, n) for n in directions], axis=1)
