"""Limit loads of rigid, perfectly plastic bodies of revolution: upper bounds by stream functions.

r v = (−∂ψ/∂z, ∂ψ/∂r) keeps the volume whatever ψ is. With ψ quadratic in triangles and continuous, velocities may jump
along the tangents between triangles, as in the plane programs of Sloan and Kleeman (1995), Upper bound limit analysis using
discontinuous velocity fields, Comput. Methods Appl. Mech. Engrg. 127; those that dissipate least bound the load from above
(Prager and Hodge 1951). They are found by reweighted least squares; any of them gives a bound.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from prensa.types import Index

from ._check import ACCURACY, Array, not_negative, positive

REWEIGHTINGS = 60  # reweighted least squares
STATIONARY = 1e-5  # change of the power over the power that ends them, and rates over their mean below which they count as none
SIDE_PLACES = np.array([0.0, 0.5, 1.0])  # along a side at which jumps are looked at
# Gauss points of a triangle, exact for degree 5: Radon (1948)
RADON_A, RADON_B = (6 - np.sqrt(15)) / 21, (6 + np.sqrt(15)) / 21
RADON_POINTS = np.array(
    [[1 / 3, 1 / 3], *([a, b] for p in (RADON_A, RADON_B) for a, b in ((p, p), (1 - 2 * p, p), (p, 1 - 2 * p)))]
)
RADON_WEIGHTS = np.array([9 / 40, *[(155 - np.sqrt(15)) / 1200] * 3, *[(155 + np.sqrt(15)) / 1200] * 3])


def axisymmetric_bound(points: Any, triangles: Any, stress: float, walls: Any) -> float:
    """Points (p, 2) (r, z), triangles (t, 3) counter-clockwise, flow stress (von Mises), `Wall`s -> least power.

    With one wall that moves at unit velocity it is a bound of the force on that wall. Edges on no wall are free; the axis
    needs none. The power of the strain rates is summed over seven Gauss points of each triangle.
    Source: see above.
    Raises ValueError for a stress <= 0, an m outside 0 ... 1, folded triangles, points beyond the axis, walls that meet at
    different speeds, and walls that nothing stands against.
    """
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    positive(stress=stress)
    x, cells = np.asarray(points, dtype=float), np.asarray(triangles, dtype=np.int64)
    body = _Body(x, cells)
    rates, sizes = body.rates()
    slips, across, given = body.slips(walls, stress / np.sqrt(3.0))
    to_free, known = body.free(walls)
    B, J = (rates @ to_free).tocsr(), (slips @ to_free).tocsr()
    b0, j0 = rates @ known, slips @ known - given
    sizes = 2 * np.pi * stress * sizes
    w, u = np.repeat(sizes, 4), across.copy()
    last, least = np.inf, np.inf
    for _ in range(REWEIGHTINGS):
        A = (B.T @ diags_array(w) @ B + J.T @ diags_array(u) @ J).tocsc()
        q = splu(A).solve(-(B.T @ (w * b0) + J.T @ (u * j0)))
        rate, jump = B @ q + b0, J @ q + j0
        size = np.sqrt((rate.reshape(-1, 4) ** 2).sum(axis=1))
        power = float(sizes @ size) + _jumped(jump, across)
        least = min(least, power)
        if abs(last - power) <= STATIONARY * power:
            break
        last = power
        w = np.repeat(sizes / np.maximum(size, STATIONARY * size.mean()), 4)
        u = across / np.maximum(np.abs(jump), STATIONARY * np.abs(jump).mean())
    return least


def _jumped(jump: Array, across: Array) -> float:
    """Power of jumps (3 e,) at start, middle and end of sides, linear between the ends, whose sign may change there."""
    a, _, b = jump.reshape(-1, 3).T
    total = np.abs(a) + np.abs(b)
    mean = np.where(a * b >= 0, 0.5 * total, 0.5 * (a**2 + b**2) / np.where(total > 0, total, 1.0))
    return float(across.reshape(-1, 3).sum(axis=1) @ mean)


class _Body:
    """Triangles with a node in the middle of each side: ``x`` (n, 2), ``cells`` (t, 6)."""

    def __init__(self, x: Array, cells: Index) -> None:
        sides = x[cells[:, [1, 2, 0]]] - x[cells]
        twice = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
        if not (twice > 0).all():
            raise ValueError("triangles: some are folded, or walked clockwise")
        self.tiny = ACCURACY * float(np.ptp(x, axis=0).max())
        if x[:, 0].min() < -self.tiny:
            raise ValueError("points: some lie beyond the axis")
        pairs = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        self.sides, number = np.unique(pairs, axis=0, return_inverse=True)
        self.corners = len(x)
        self.x = np.concatenate([x, x[self.sides].mean(axis=1)])
        self.cells = np.concatenate([cells, self.corners + number.reshape(-1, 3)], axis=1)
        self.area = 0.5 * twice
        facing = sides[:, [1, 2, 0]] / twice[:, None, None]
        self.dL = np.stack([-facing[..., 1], facing[..., 0]], axis=-1)  # (t, 3, 2)

    def _gradient(self, L: Array, of: Index | slice = slice(None)) -> Array:
        """Derivatives (…, 6, 2) of the quadratic functions of some triangles at area coordinates L (…, 3)."""
        dL = self.dL[of]
        a, b = [0, 1, 2], [1, 2, 0]
        middles = 4 * (L[..., a, None] * dL[:, b] + L[..., b, None] * dL[:, a])
        return np.concatenate([(4 * L - 1)[..., None] * dL, middles], axis=-2)

    def _rows(self, columns: Index, values: Array) -> Any:
        from scipy.sparse import coo_array

        r = np.repeat(np.arange(len(columns)), columns.shape[1])
        return coo_array((values.ravel(), (r, columns.ravel())), shape=(len(columns), len(self.x))).tocsr()

    def rates(self) -> tuple[Any, Array]:
        """Rows (4 k, n) of r times the strain rates of k Gauss points, whose norm is the equivalent one, and areas (k,)."""
        dL = self.dL
        a, b = [0, 1, 2], [1, 2, 0]
        second = np.concatenate([
            4 * dL[:, :, :, None] * dL[:, :, None, :],
            4 * (dL[:, a, :, None] * dL[:, b, None, :] + dL[:, b, :, None] * dL[:, a, None, :]),
        ], axis=1)  # fmt: skip
        rr, zz, rz = second[..., 0, 0], second[..., 1, 1], second[..., 0, 1]
        values, share = [], []
        for (p, q), weight in zip(RADON_POINTS, RADON_WEIGHTS):
            L = np.array([p, q, 1 - p - q])
            r = (self.x[self.cells[:, :3], 0] @ L)[:, None]
            d = self._gradient(np.broadcast_to(L, (len(self.cells), 3)))
            around = -d[..., 1] / r
            parts = [-rz - around, around, rz, (rr - zz - d[..., 0] / r) / np.sqrt(2.0)]
            values.append(np.sqrt(2.0 / 3.0) * np.stack(parts, axis=1))
            share.append(weight * self.area)
        rows = np.concatenate(values).reshape(-1, 6)
        columns = np.repeat(np.tile(self.cells, (len(RADON_WEIGHTS), 1)), 4, axis=0)
        return self._rows(columns, rows), np.concatenate(share)

    def _along(self, triangle: Index, corner: Index, at: float) -> Array:
        """Velocity along a side times r (k, 6) by ψ of its triangle, from its corner on, at a place 0 … 1 of it."""
        L = np.zeros((len(triangle), 3))
        k = np.arange(len(triangle))
        L[k, corner], L[k, (corner + 1) % 3] = 1 - at, at
        way = self._way(triangle, corner)
        way /= np.hypot(*way.T)[:, None]
        d = self._gradient(L, triangle)
        return d[..., 0] * way[:, None, 1] - d[..., 1] * way[:, None, 0]

    def slips(self, walls: Any, k: float) -> tuple[Any, Array, Array]:
        """Rows (3 e, n) of r times the jumps at start, middle and end of sides, their powers per unit, what walls move by."""
        from scipy.sparse import vstack

        sides = np.stack(np.meshgrid(np.arange(len(self.cells)), np.arange(3), indexing="ij"), -1).reshape(-1, 2).tolist()
        at = {(int(self.cells[t, c]), int(self.cells[t, (c + 1) % 3])): (t, c) for t, c in sides}
        t, c, s, d = np.array([(*at[a, b], *at[b, a]) for a, b in at if a < b and (b, a) in at]).T
        values = [np.concatenate([self._along(t, c, a), self._along(s, d, 1 - a)], axis=1) for a in SIDE_PLACES]
        columns = np.concatenate([self.cells[t], self.cells[s]], axis=1)
        rows = [self._rows(np.repeat(columns, 3, axis=0), np.stack(values, axis=1).reshape(-1, 12))]
        power, given = [self._power(t, c, k)], [np.zeros(3 * len(t))]
        for wall in walls:
            not_negative(m=wall.m)
            if wall.m > 1:
                raise ValueError(f"m = {wall.m!r}: a friction factor lies between 0 and 1")
            if not len(wall.edges) or wall.m == 0:
                continue
            t, c = np.array([at[int(a), int(b)] for a, b in np.asarray(wall.edges)]).T
            along = np.stack([self._along(t, c, a) for a in SIDE_PLACES], axis=1).reshape(-1, 6)
            rows.append(self._rows(np.repeat(self.cells[t], 3, axis=0), along))
            power.append(self._power(t, c, wall.m * k))
            start, way = self.x[self.cells[t, c]], self._way(t, c)
            speed = way @ np.asarray(wall.velocity, dtype=float) / np.hypot(*way.T)
            given.append((speed[:, None] * (start[:, :1] + way[:, :1] * SIDE_PLACES)).ravel())
        return vstack(rows).tocsr(), np.concatenate(power), np.concatenate(given)

    def _way(self, t: Index, c: Index) -> Array:
        """Vectors (k, 2) along sides of triangles, each from its corner on."""
        return np.asarray(self.x[self.cells[t, (c + 1) % 3]] - self.x[self.cells[t, c]])

    def _power(self, t: Index, c: Index, strength: float) -> Array:
        """Power (3 k,) of r times the jumps at three places of sides, by Simpson's rule."""
        length = np.hypot(*self._way(t, c).T)
        return np.asarray((2 * np.pi * strength * length[:, None] * np.array([1, 4, 1]) / 6).ravel())

    def free(self, walls: Any) -> tuple[Any, Array]:
        """ψ (n,) = P q + ψ_0 with free q: P (n, f), ψ_0 (n,). It is 0 on the axis, and known but for a constant along walls."""
        n = len(self.x)
        number = {tuple(s): self.corners + i for i, s in enumerate(self.sides.tolist())}
        neighbours: dict[int, list[tuple[int, float]]] = {}
        for wall in walls:
            v = np.asarray(wall.velocity, dtype=float)
            for a, b in np.asarray(wall.edges, dtype=np.int64).reshape(-1, 2).tolist():
                m = number[min(a, b), max(a, b)]
                way = self.x[b] - self.x[a]
                through = float(v @ np.array([way[1], -way[0]]))  # along the outward normal, times the length
                for i, j in ((a, m), (m, b)):
                    flux = -through * 0.25 * float(self.x[i, 0] + self.x[j, 0])
                    neighbours.setdefault(i, []).append((j, flux))
                    neighbours.setdefault(j, []).append((i, -flux))
        on_axis = self.x[:, 0] <= self.tiny
        group, value, groups = np.where(on_axis, 0, -1), np.zeros(n), 1
        for seed in [*np.flatnonzero(on_axis).tolist(), *list(neighbours)]:
            if group[seed] < 0:
                group[seed], groups = groups, groups + 1
            todo = [seed]
            while todo:
                i = todo.pop()
                for j, step in neighbours.pop(i, []):
                    if group[j] < 0:
                        group[j], value[j] = group[i], value[i] + step
                        todo.append(j)
                    elif group[j] == group[i] and abs(value[j] - value[i] - step) > self.tiny * n:
                        raise ValueError("walls: they leave the body no way to flow")
        rest, parent, share = group < 0, np.arange(n), np.ones(n)
        touching = on_axis[self.sides].sum(axis=1) == 1
        for i in np.flatnonzero(touching & rest[self.corners :]).tolist():  # the gradient of ψ is 0 on the axis
            a, b = self.sides[i].tolist()
            node = self.corners + i
            parent[node], share[node], rest[node] = b if on_axis[a] else a, 0.25, False
        group[rest] = groups + np.arange(int(rest.sum()))
        return self._onto(group[parent], share, share * value[parent])

    @staticmethod
    def _onto(column: Index, share: Array, known: Array) -> tuple[Any, Array]:
        """The matrix of nodes whose ψ is a ``share`` of an unknown, numbered from 1 on; those of number 0 are ``known``."""
        from scipy.sparse import coo_array

        rows = np.flatnonzero(column > 0)
        if not len(rows):
            raise ValueError("walls: they leave the body no way to flow")
        P = coo_array((share[rows], (rows, column[rows] - 1)), shape=(len(column), int(column.max()))).tocsr()
        return P, known
