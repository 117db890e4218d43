"""Maps of a measure over two parameters: values between the runs of a grid, from their values and gradients.

Cubic in each direction whose derivative is known (Hermite's polynomials), linear in the other. With both derivatives that is the
bicubic patch of Ferguson (1964, J. ACM 11, 221-228), its mixed derivatives being differences of the slopes in the place of zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from prensa.types import Array


@dataclass(frozen=True)
class Map:
    """Values ``z`` (n, m) over increasing ``v`` (n,) and ``u`` (m,), and their slopes by both, None where they are not known.

    What is not a number leaves the cells around it without values.
    """

    u: Array
    v: Array
    z: Array
    by_u: Array | None = None
    by_v: Array | None = None

    def between(self, x: Array, y: Array) -> Array:
        """Values (len(y), len(x)) at places inside."""
        mixed = self._mixed()
        across = _along(self.u, self.z.T, None if self.by_u is None else self.by_u.T, x)
        if self.by_v is None:
            return _along(self.v, across.T, None, y)
        slopes = _along(self.u, self.by_v.T, None if mixed is None else mixed.T, x)
        return _along(self.v, across.T, slopes.T, y)

    def _mixed(self) -> Array | None:
        """Derivatives (n, m) by both, from differences of the slopes."""
        if self.by_u is None or self.by_v is None:
            return None
        return np.asarray(0.5 * (np.gradient(self.by_v, self.u, axis=1) + np.gradient(self.by_u, self.v, axis=0)))

    @property
    def bilinear(self) -> Map:
        """The same without slopes."""
        return Map(self.u, self.v, self.z)

    def left_out(self) -> float:
        """How far runs are missed that are left out, each between its neighbours along a line of the grid.

        Root of the mean square, over the range of the values; not a number where no line has three runs.
        """
        missed = []
        for u, z, slopes in ((self.u, self.z.T, self.by_u), (self.v, self.z, self.by_v)):
            slope = None if slopes is None else slopes.T if u is self.u else slopes
            for k in range(1, len(u) - 1):
                ends = [k - 1, k + 1]
                guess = _along(u[ends], z[ends], None if slope is None else slope[ends], u[k : k + 1])[0]
                missed.append(guess - z[k])
        errors = np.concatenate(missed) if missed else np.zeros(0)
        errors = errors[np.isfinite(errors)]
        size = float(np.nanmax(self.z) - np.nanmin(self.z)) if np.isfinite(self.z).any() else 0.0
        return float(np.sqrt(np.mean(errors**2))) / size if len(errors) and size > 0.0 else math.nan


def _along(t: Array, f: Array, slope: Array | None, at: Array) -> Array:
    """Values (k, w) at places (k,) from those (n, w) at t (n,), cubic by their slopes (n, w) or linear."""
    cell = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    h = (t[cell + 1] - t[cell])[:, None]
    s = (at - t[cell])[:, None] / h
    a, b = f[cell], f[cell + 1]
    # what is not a number across the cell is none on its border
    line = np.where(s == 0.0, a, np.where(s == 1.0, b, a + s * (b - a)))
    if slope is None:
        return np.asarray(line)
    bend = (1.0 - s) * (h * slope[cell] - (b - a)) - s * (h * slope[cell + 1] - (b - a))
    return np.asarray(np.where((s == 0.0) | (s == 1.0), line, line + s * (1.0 - s) * bend))
