"""Axes of the plane in which a section stands that is extruded in space."""

from __future__ import annotations

import numpy as np

from prensa.precision import NEGLIGIBLE
from prensa.types import Array


def section_axes(axis: Array) -> Array:
    """Axes (3, 2) of the section of an extrusion along a unit vector (3,): the second is y, or z where that runs along it.

    Of both directions across these the first axis is the one whose largest component is positive: x, or z along x.
    """
    up = np.eye(3)[1] if abs(axis[1]) < 1.0 - NEGLIGIBLE else np.eye(3)[2]
    up = up - (up @ axis) * axis
    up /= np.linalg.norm(up)
    across = np.cross(up, axis)
    return np.stack([across * np.sign(across[np.abs(across).argmax()]), up], axis=1)
