"""Spacing of mesh lines."""

from __future__ import annotations

import numpy as np

from prensa.mesh.mesh import MeshError
from prensa.precision import ROUND_OFF, SMALLEST
from prensa.types import Array


def graded(
    start: float, end: float, n: int, towards: tuple[float, ...], ratio: float, between: tuple[float, float] | None = None
) -> Array:  # fmt: skip
    """Coordinates (n + 1,) from start to end, element size growing linearly with the distance from the nearest target.

    ``ratio`` = largest size wanted / smallest. Every target inside the range becomes a coordinate, and both ends of a stretch
    ``between`` two coordinates, along which sizes are the smallest.

    Raises
    ------
    MeshError
        If a target lies outside, or n is too small to keep every target.

    """
    towards = (*towards, *(between or ()))
    if not towards:
        return np.linspace(start, end, n + 1)
    targets = np.unique(np.asarray(towards, dtype=np.float64))
    span = end - start
    if targets[0] < start - ROUND_OFF * span or targets[-1] > end + ROUND_OFF * span:
        raise MeshError(f"grading target {targets.tolist()} lies outside {start:g} … {end:g}")
    fine = np.linspace(start, end, 20_001)
    fine = np.unique(np.concatenate([fine, targets]))
    distance = np.min(np.abs(fine[:, None] - targets[None, :]), axis=1)
    if between is not None:
        distance[(fine >= between[0]) & (fine <= between[1])] = 0.0
    # Lines lie where the integral of the density is a whole number: sizes go as its inverse, linearly with the distance.
    density = 1.0 / (1.0 + (ratio - 1.0) * distance / max(distance.max(), SMALLEST))
    count = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))])
    knots = np.unique(np.concatenate([[start], targets, [end]]))
    knots = knots[np.concatenate([[True], np.diff(knots) > ROUND_OFF * span])]
    if n < len(knots) - 1:
        raise MeshError(f"{n} elements cannot keep {len(knots) - 2} grading targets as mesh lines")
    share = np.diff(np.interp(knots, fine, count))
    exact = n * share / share.sum()
    # Each stretch between targets has a whole number of elements, so that targets become lines.
    parts = np.maximum(1, np.floor(exact).astype(int))
    for k in np.argsort(parts - exact):  # largest remainder first
        if parts.sum() >= n:
            break
        parts[k] += 1
    # One element at least in every stretch may have been too many: those with most to spare give back.
    while parts.sum() > n:
        parts[np.argmax(np.where(parts > 1, parts - exact, -np.inf))] -= 1
    out = [np.array([knots[0]])]
    for a, b, m in zip(knots[:-1], knots[1:], parts):
        levels = np.linspace(float(np.interp(a, fine, count)), float(np.interp(b, fine, count)), int(m) + 1)
        x = np.interp(levels[1:], count, fine)
        x[-1] = b
        out.append(x)
    return np.concatenate(out)
