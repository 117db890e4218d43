"""Vectors of the plane, many at once: cross products, angles between them, rotations."""

from __future__ import annotations

import numpy as np

from prensa.types import Array

ONE_NORMAL = np.cos(np.radians(5.0))  # cosine of the angle to the mean normal up to which a boundary counts as straight


def cross(a: Array, b: Array) -> Array:
    """A × b (…) of vectors (…, 2): the area of the parallelogram, positive where b lies to the left of a."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def angle(a: Array, b: Array) -> Array:
    """Angles (…) from vectors a (…, 2) to b, between −π and π, positive to the left."""
    return np.asarray(np.arctan2(cross(a, b), (a * b).sum(axis=-1)))


def turned(n: Array) -> Array:
    """Vectors (…, 2) turned by +90°."""
    return np.stack([-n[..., 1], n[..., 0]], axis=-1)


def rotated(x: Array, by: float) -> Array:
    """Vectors (n, 2) rotated by an angle (rad), positive to the left."""
    c, s = np.cos(by), np.sin(by)
    return np.asarray(x @ np.array([[c, s], [-s, c]]))
