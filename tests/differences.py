"""Derivatives of surfaces in space by differences."""

from __future__ import annotations

import numpy as np


def belongs_together(shape, x, h=1e-5):
    """Largest errors of n = ∇g and of ∂n/∂x over 1 + |∂n/∂x|², by differences of fourth order, at points (k,)."""
    close, slopes, bends = shape.closest(x), [], []
    for e in h * np.eye(3):
        after, before, twice_after, twice_before = (shape.closest(x + s * e) for s in (1, -1, 2, -2))
        slopes.append((8 * (after.g - before.g) - (twice_after.g - twice_before.g)) / (12 * h))
        bends.append((8 * (after.n - before.n) - (twice_after.n - twice_before.n)) / (12 * h))
    size = 1.0 + np.abs(close.c).max(axis=(1, 2)) ** 2
    slope, bend = np.stack(slopes, axis=1), np.stack(bends, axis=2)
    return np.abs(slope - close.n).max(axis=1), np.abs(bend - close.c).max(axis=(1, 2)) / size
