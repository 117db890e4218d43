"""A shape from a signed distance: what a user's tool does not state is derived from its zero level.

The surface is found once: a grid over a square, crossings of its edges by linear interpolation, each moved to its foot, and
pieces that turn halved until they do not. Its polygon gives the surface coordinate of a foot,

    s = s_i + d α / sin α,   d the distance to the vertex before, 2α the angle between the two normals,

exact on lines and circles and of fifth order in d elsewhere; sharp corners are the vertices where the normal jumps.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.geometry.outline import around, width
from prensa.geometry.plane import angle, cross, turned
from prensa.precision import COMPLEX_STEP, FIRST_DIFFERENCE, NEGLIGIBLE, SECOND_DIFFERENCE
from prensa.tools.analytic import Closest, marched_along
from prensa.types import Array, Index

GRID = 200  # of the grid along a side of the square in which the surface is looked at
TURN = 0.05  # radians that a piece of the polygon may turn before it is halved
HALVINGS = 24  # of a piece: then its turn is a corner
SHARP = 0.1  # turn (rad) of a piece that can be halved no more which makes it a corner


class TraceError(PrensaError):
    """A surface that cannot be found from its distance."""


class Surface(NamedTuple):
    """A traced surface: vertices (m, 2), normals (m, 2), surface coordinates (m,), lines as lists of vertices, their lengths.

    The length of a line that does not close is infinite.
    """

    x: Array
    n: Array
    s: Array
    runs: list[Index]
    lengths: list[float]


class Implicit:
    """`Tool` of a description that states ``distance`` or ``closest``."""

    half_space = False
    cylinder = np.inf

    def __init__(self, tool: Any, stated: bool) -> None:
        """``stated``: the description states ``closest`` itself."""
        self.tool = tool
        self._stated = stated

    # ------------------------------------------------------------------------------------------- distance and normal
    def g(self, x: Array) -> Array:
        """Signed distance (k,)."""
        if self._stated:
            return np.asarray(self.tool.closest(x)[0], dtype=np.float64)
        return np.array(self.tool.distance(x), dtype=np.float64) + np.zeros(len(x))

    def _normal(self, x: Array) -> Array:
        """∇g (k, 2) made a unit vector: by the complex step, or by central differences where g takes real numbers only."""
        if self._stated:
            return np.asarray(self.tool.closest(x)[1], dtype=np.float64)
        out = np.empty_like(x)
        for j in range(2):
            h = (COMPLEX_STEP if self._takes_complex else FIRST_DIFFERENCE) * self.unit
            step = np.zeros(2)
            step[j] = h
            if self._takes_complex:
                out[:, j] = np.imag(self.tool.distance(x + 1j * step)) / h
            else:
                out[:, j] = (self.g(x + step) - self.g(x - step)) / (2 * h)
        size = np.hypot(out[:, 0], out[:, 1])
        good = np.isfinite(size) & (size > 0)
        down = np.array([0.0, -1.0])  # where g has no direction, such as in the centre of a circle
        return np.where(good[:, None], out / np.where(good, size, 1.0)[:, None], down)

    @cached_property
    def _takes_complex(self) -> bool:
        """Whether g is a function of complex numbers whose derivative is that of real ones."""
        x = np.random.default_rng(0).normal(size=(50, 2)) * self.unit
        h = FIRST_DIFFERENCE * self.unit
        for j in range(2):
            step = np.zeros(2)
            step[j] = 1.0
            try:
                with np.errstate(all="ignore"):
                    y = np.asarray(self.tool.distance(x + 1j * COMPLEX_STEP * self.unit * step))
            except (TypeError, ValueError):
                return False
            if not np.iscomplexobj(y):
                return False
            slope = np.imag(y) / (COMPLEX_STEP * self.unit)
            ahead, behind = self.g(x + h * step) - self.g(x), self.g(x) - self.g(x - h * step)
            # A user's abs, min or clip may drop imaginary parts without a word: slopes are held against differences, away from
            # kinks.
            smooth = np.abs(ahead - behind) <= 1e-3 * h
            if not np.allclose(slope[smooth], (ahead + behind)[smooth] / (2 * h), rtol=0.0, atol=1e-5):
                return False
        return True

    @cached_property
    def unit(self) -> float:
        """A length of the tool: steps of differences are shares of it."""
        given = float(getattr(self.tool, "reach", 0.0) or 0.0)
        return given or float(self._bounded or 1.0)

    @cached_property
    def _bounded(self) -> float:
        """Farthest point of the surface from the reference point, by its distance from afar; 0 where there is none."""
        angle = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        away = np.column_stack([np.cos(angle), np.sin(angle)])
        for size in 10.0 ** np.arange(-6.0, 9.0):
            if (np.abs(np.abs(self.g(size * away)) - size) <= 0.1 * size).all():
                # From afar a bounded tool is a point: |x| − g is how far it reaches from the reference point that way.
                far = 1e4 * size
                return float(np.abs(np.abs(self.g(far * away)) - far).max())
        return 0.0

    # -------------------------------------------------------------------------------------------------- closest point
    def closest(self, xi: Array) -> Closest:
        """Points (k, 2) → `Closest`."""
        if self._stated:
            return Closest(*(np.asarray(v, dtype=np.float64) for v in self.tool.closest(xi)))
        g, n = self.g(xi), self._normal(xi)
        return Closest(g, n, self._curvature(xi, n), self._coordinate(xi - g[:, None] * n, n))

    def _curvature(self, x: Array, n: Array) -> Array:
        """∂n/∂x along e; at an edge 1/g."""
        h = (FIRST_DIFFERENCE if self._takes_complex else SECOND_DIFFERENCE) * self.unit
        e = turned(n)
        c = ((self._normal(x + h * e) - self._normal(x - h * e)) * e).sum(axis=1) / (2 * h)
        return np.asarray(np.where(np.isfinite(c), c, 0.0))

    def _coordinate(self, foot: Array, n: Array) -> Array:
        if not len(foot):
            return np.zeros(0)
        surface = self.surface
        _, i = self._tree.query(foot)
        y, m = surface.x[i], surface.n[i]
        way = foot - y
        along = np.sign((way * turned(m)).sum(axis=1))
        # the normals of a corner are several: only the plain distance counts there
        half = 0.5 * np.abs(angle(m, n))
        half = np.where(half < 4 * TURN, half, 0.0)
        return np.asarray(surface.s[i] + along * np.hypot(way[:, 0], way[:, 1]) * _over_sine(half))

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.surface.x)

    # -------------------------------------------------------------------------------------------------------- surface
    @cached_property
    def _half(self) -> float:
        """Half the side of a square about the reference point that the surface lies in; 0 where none is known."""
        return float(getattr(self.tool, "reach", 0.0) or 0.0) or 1.1 * self._bounded

    @cached_property
    def _square(self) -> float:
        half = self._half
        if not half > 0:
            raise TraceError(
                f"the surface of {type(self.tool).__name__} has no end: give 'reach', half the side (length) of the square about "
                "the reference point beyond which it goes on straight"
            )
        return half

    @cached_property
    def surface(self) -> Surface:
        """The traced surface."""
        half = self._square
        lines = contours(self.g, half, GRID)
        if not lines:
            raise TraceError(
                f"the distance of {type(self.tool).__name__} is nowhere zero within {half:g} of the reference point; "
                "give 'reach', half the side (length) of the square in which the surface is"
            )
        pieces, begin = [], 0.0
        for line in sorted(lines, key=lambda line: -len(line)):
            pieces.append(self._measured(line, begin))
            begin += (
                float(pieces[-1].s[-1] - pieces[-1].s[0]) if np.isinf(pieces[-1].lengths[0]) else pieces[-1].lengths[0]
            )
        first = np.cumsum([0, *(len(p.x) for p in pieces)])
        runs = [p.runs[0] + k for p, k in zip(pieces, first)]
        x, n, s = (np.concatenate([p[k] for p in pieces]) for k in range(3))
        return Surface(x, n, s, runs, [p.lengths[0] for p in pieces])

    def _measured(self, line: Array, begin: float) -> Surface:
        """One line, moved onto the surface, refined where it turns, with the tool on its left."""
        closed = bool(np.array_equal(line[0], line[-1]))
        x = self._refined(self._on(line))
        n = self._normal(x)
        if float((np.diff(x, axis=0) * turned(n)[:-1]).sum()) < 0:
            x, n = x[::-1], n[::-1]
        half = 0.5 * np.abs(angle(n[:-1], n[1:]))
        length = np.hypot(*np.diff(x, axis=0).T) * _over_sine(np.where(half < 4 * TURN, half, 0.0))
        s = begin + np.concatenate([[0.0], np.cumsum(length)])
        last = len(x) - closed
        return Surface(x[:last], n[:last], s[:last], [np.arange(last)], [float(s[-1] - s[0]) if closed else np.inf])

    def _on(self, x: Array) -> Array:
        """Points moved to their feet."""
        for _ in range(3):
            x = x - self.g(x)[:, None] * self._normal(x)
        return x

    @property
    def _least(self) -> float:
        """Length of pieces below which normals by differences see both sides of a corner."""
        return (1e-7 if self._takes_complex and not self._stated else 2e-5) * self.unit

    def _refined(self, x: Array) -> Array:
        for _ in range(HALVINGS):
            n = self._normal(x)
            far = np.hypot(*np.diff(x, axis=0).T) > self._least
            split = np.flatnonzero((np.abs(angle(n[:-1], n[1:])) > TURN) & far)
            if not len(split):
                break
            x = np.insert(x, split + 1, self._on(0.5 * (x[split] + x[split + 1])), axis=0)
        keep = np.concatenate([[True], np.hypot(*np.diff(x, axis=0).T) > NEGLIGIBLE * self.unit])
        keep[-1] = True
        return x[keep]

    @cached_property
    def period(self) -> float:
        """Length of a closed surface; inf of others."""
        given = getattr(self.tool, "period", None)
        if given is not None or self._stated:
            return float(given if given is not None else np.inf)
        lengths = self.surface.lengths
        return lengths[0] if len(lengths) == 1 else np.inf

    @cached_property
    def cavity(self) -> bool:
        """Whether the tool is all around: its surface is closed, and walked clockwise."""
        if hasattr(self.tool, "cavity"):
            return bool(self.tool.cavity)
        return bool(np.isfinite(self.period)) and not self._stated and _area(self.surface.x) < 0

    @cached_property
    def centre(self) -> Array:
        """Middle of a closed surface, the reference point of others."""
        if not np.isfinite(self.period) or self._stated:
            return np.zeros(2)
        x = self.surface.x
        return np.asarray(0.5 * (x.min(axis=0) + x.max(axis=0)))

    @cached_property
    def extent(self) -> float:
        """Twice the farthest point from the reference point, where the surface is traced."""
        return 2.0 * float(self._bounded or getattr(self.tool, "reach", 0.0) or 0.0)

    @cached_property
    def edges(self) -> Array:
        """Sharp convex edges (k, 4): place, and the unit vector along e across the mean normal."""
        if hasattr(self.tool, "edges"):
            return np.asarray(self.tool.edges, dtype=np.float64).reshape(-1, 4)
        if self._stated:
            return np.zeros((0, 4))
        out: list[Array] = []
        x, n, _, runs, lengths = self.surface
        for run, length in zip(runs, lengths):
            a, b = (run[:-1], run[1:]) if np.isinf(length) else (run, np.roll(run, -1))
            sharp = (np.abs(angle(n[a], n[b])) > 0.5 * SHARP) & (np.hypot(*(x[b] - x[a]).T) < 4 * self._least)
            clear = np.flatnonzero(~sharp)
            if not len(clear):
                continue
            order = np.roll(np.arange(len(a)), -int(clear[0]))  # begin where nothing is sharp
            for group in np.split(order, np.flatnonzero(np.diff(sharp[order].astype(int))) + 1):
                i, j = a[group[0]], b[group[-1]]
                if sharp[group[0]] and float(angle(n[[i]], n[[j]])[0]) > SHARP:
                    e = turned(n[[i]] + n[[j]])[0]
                    # where the tangents of the two sides meet
                    meet = np.linalg.solve(np.array([n[i], n[j]]), np.array([n[i] @ x[i], n[j] @ x[j]]))
                    out.append(np.concatenate([meet, e / np.hypot(*e)]))
        return np.array(out).reshape(-1, 4)

    @cached_property
    def radius(self) -> float:
        """Smallest radius of curvature of a convex part, 0 with sharp edges."""
        if len(self.edges):
            return 0.0
        if self._stated:
            return np.inf
        most = float(self._curvature(self.surface.x, self.surface.n).max())
        return 1.0 / most if most > NEGLIGIBLE / self.unit else np.inf

    # ----------------------------------------------------------------------------------------------- rays and pictures
    def along(self, xi: Array, direction: Array, limit: float) -> Array:
        """Distance (k,) along the unit direction to the surface, negative from inside; inf where a ray misses it."""
        return marched_along(self.g, self._normal, self.unit, xi, direction, limit)

    def across(self, direction: Array, depth: float) -> tuple[float, float]:
        """Width of what lies within ``depth`` of the end in a unit direction, and of the whole."""
        frame = np.array([direction, [-direction[1], direction[0]]]).T
        x, _, _, runs, lengths = self.surface
        lines = [x[run] if np.isinf(length) else x[[*run, run[0]]] for run, length in zip(runs, lengths)]
        return width([line @ frame for line in lines], depth)

    def outline(self, depth: float) -> list[Array]:
        """Closed polygons, each (n, 2): the traced surface, or what of an endless tool is within ``depth`` of it."""
        if np.isfinite(self.period) and not self._stated:
            return [around(self.surface.x, depth) if self.cavity else self.surface.x]
        half = self._half + depth

        def cut(x: Array) -> Array:
            return np.asarray(np.maximum(self.g(x), np.abs(x).max(axis=1) - half))

        return [self._rounded(line[:-1], half) for line in contours(cut, 1.05 * half, GRID)]

    def _rounded(self, polygon: Array, half: float) -> Array:
        """A polygon with those of its vertices that are on the surface moved there, and pieces that turn halved."""
        on = (np.abs(polygon).max(axis=1) < (1.0 - 1.0 / GRID) * half).astype(int)
        if self._stated or not on.any():
            return polygon
        polygon, on = (np.roll(v, -int(np.argmin(on)), axis=0) for v in (polygon, on))
        parts = np.split(polygon, np.flatnonzero(np.diff(on)) + 1)
        flags = on[np.concatenate([[0], np.flatnonzero(np.diff(on)) + 1])]
        return np.vstack([self._refined(self._on(p)) if f and len(p) > 2 else p for p, f in zip(parts, flags)])


def _over_sine(half: Array) -> Array:
    """α / sin α."""
    return np.asarray(1.0 / np.sinc(half / np.pi))


def _area(x: Array) -> float:
    after = np.roll(x, -1, axis=0)
    return 0.5 * float(cross(x, after).sum())


# corners of a cell 0 … 3 counter-clockwise from the lower left, edges 0 … 3 begin at them; walked with the inside left
# Of saddles (5 and 10) the insides are taken to be apart.
_SEGMENTS = {
    1: [(3, 0)], 2: [(0, 1)], 3: [(3, 1)], 4: [(1, 2)], 5: [(3, 0), (1, 2)], 6: [(0, 2)], 7: [(3, 2)],
    8: [(2, 3)], 9: [(2, 0)], 10: [(0, 1), (2, 3)], 11: [(2, 1)], 12: [(1, 3)], 13: [(1, 0)], 14: [(0, 3)],
}  # fmt: skip


def contours(g: Any, half: float, cells: int) -> list[Array]:
    """Zero lines of g in the square |x|, |y| ≤ half, each (n, 2); a closed one ends with its first point.

    Marching squares: Lorensen & Cline (1987) in the plane.
    """
    ticks = np.linspace(-half, half, cells + 1) + 1e-7 * half  # no symmetric tool has its corners on the grid
    grid = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1)
    values = g(grid.reshape(-1, 2)).reshape(cells + 1, cells + 1)
    neg = values < 0.0
    corner = [(0, 0), (1, 0), (1, 1), (0, 1)]
    kind = sum((1 << k) * neg[i : cells + i, j : cells + j] for k, (i, j) in enumerate(corner))
    after: dict[tuple[int, int, int], tuple[int, int, int]] = {}

    def edge(i: int, j: int, k: int) -> tuple[int, int, int]:
        """An edge by its lower or left node and axis, the same from both cells."""
        return [(i, j, 0), (i + 1, j, 1), (i, j + 1, 0), (i, j, 1)][k]

    for i, j in np.argwhere((np.asarray(kind) > 0) & (np.asarray(kind) < 15)).tolist():
        for a, b in _SEGMENTS[int(np.asarray(kind)[i, j])]:
            after[edge(i, j, a)] = edge(i, j, b)

    def place(at: tuple[int, int, int]) -> Array:
        i, j, axis = at
        k, m = (i + 1, j) if axis == 0 else (i, j + 1)
        a, b = values[i, j], values[k, m]
        return np.asarray(grid[i, j] + (grid[k, m] - grid[i, j]) * (a / (a - b)))

    out = []
    ends = set(after.values())
    starts = [key for key in after if key not in ends]
    while after:
        key = starts.pop() if starts else next(iter(after))
        line = [key]
        while key in after:
            key = after.pop(key)
            line.append(key)
        out.append(np.array([place(k) for k in line]))
    return out
