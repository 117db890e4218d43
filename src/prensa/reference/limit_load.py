"""Limit loads of rigid, perfectly plastic bodies in plane strain: strict upper bounds by linear programming.

Of all velocities that are linear in triangles, and may jump along their tangents between them, those that dissipate least
bound the load from above (Prager and Hodge 1951). Source: Sloan and Kleeman (1995), Upper bound limit analysis using
discontinuous velocity fields, Comput. Methods Appl. Mech. Engrg. 127. The program knows the power by tangents, the bound is the
very power of the velocities that it finds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from prensa.types import Index

from ._check import Array, not_negative, positive

TANGENTS = 12  # strain rates at which the power of a triangle is taken at first
PROGRAMS = 6  # programs at most, with further tangents where the last one ended
AGREEMENT = 1e-3  # difference of program and power over the power that ends them


@dataclass(frozen=True)
class Wall:
    """A rigid face: ``edges`` (n, 2) of the body that lie on it, its velocity, its friction factor m (0: smooth)."""

    edges: Any
    velocity: tuple[float, float] = (0.0, 0.0)
    m: float = 0.0


def crossed(x: Any, y: Any, inside: Any = None) -> tuple[Array, Index]:
    """Coordinates (n,), (m,) of the lines of a grid -> points (p, 2), triangles (t, 3): four in each rectangle.

    inside: middles (r, 2) -> (r,) which rectangles there are (None: all).

    Source: the crossed triangles that do not lock, Nagtegaal, Parks and Rice (1974).
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    corners = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    middles = 0.25 * (corners[:-1, :-1] + corners[1:, :-1] + corners[:-1, 1:] + corners[1:, 1:]).reshape(-1, 2)
    n, m = len(x), len(y)
    first = (np.arange(n - 1)[:, None] * m + np.arange(m - 1)).ravel()
    around = np.stack([first, first + m, first + m + 1, first + 1], axis=1)
    here = np.ones(len(middles), dtype=bool) if inside is None else np.asarray(inside(middles), dtype=bool)
    centre = n * m + np.arange(len(middles))
    parts = [np.stack([around[:, k], around[:, (k + 1) % 4], centre], axis=1)[here] for k in range(4)]
    triangles = np.concatenate(parts)
    used, number = np.unique(triangles, return_inverse=True)
    return np.concatenate([corners.reshape(-1, 2), middles])[used], number.reshape(triangles.shape)


def halved(points: Any, triangles: Any) -> tuple[Array, Index]:
    """Points (p, 2), triangles (t, 3) -> the same with sides of half the length, four triangles in each.

    Source: plain geometry.
    """
    x, cells = np.asarray(points, dtype=float), np.asarray(triangles, dtype=np.int64)
    pairs = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    sides, number = np.unique(pairs, axis=0, return_inverse=True)
    middle = len(x) + number.reshape(-1, 3)
    a, b, c = cells.T
    ab, bc, ca = middle.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([x, x[sides].mean(axis=1)]), np.concatenate([np.stack(p, axis=1) for p in parts])


def outline(triangles: Any) -> Index:
    """Triangles (t, 3), counter-clockwise -> edges (n, 2) that belong to one of them alone, the body on the left.

    Source: plain geometry.
    """
    cells = np.asarray(triangles, dtype=np.int64)
    n, c = _sides(cells)[2].T
    return np.stack([cells[n, c], cells[n, (c + 1) % 3]], axis=1)


@dataclass(frozen=True)
class _Jumps:
    """Jumps of velocity at both ends (2 e) of edges: ``columns`` (2 e, 4) of the components of which they are made.

    ``across``, ``along`` (2 e, 4): their factors in the normal and the tangential jump; ``wall_across``, ``wall_along`` (2 e,):
    what a wall adds; ``power`` (2 e,): of a tangential jump of one at that end. First ends stand before all second ones.
    """

    columns: Index
    across: Array
    along: Array
    wall_across: Array
    wall_along: Array
    power: Array

    def dissipated(self, jump: Array) -> float:
        """Power of tangential jumps (2 e,) that are linear between the ends, whose sign may change there."""
        a, b = np.split(jump, 2)
        total = np.abs(a) + np.abs(b)
        mean = np.where(a * b >= 0, 0.5 * total, 0.5 * (a**2 + b**2) / np.where(total > 0, total, 1.0))
        return float(2 * self.power[: len(a)] @ mean)


def plane_strain_bound(points: Any, triangles: Any, k: float, walls: Any) -> float:
    """Points (p, 2), triangles (t, 3) counter-clockwise, shear yield stress k, `Wall`s -> least power per thickness.

    With one wall that moves at unit velocity it is a bound of the force on that wall. Edges on no wall are free.
    Source: Sloan and Kleeman (1995), see above.
    Raises ValueError for k <= 0, an m outside 0 ... 1, folded triangles, and walls that leave the body no way to flow.
    """
    from scipy.optimize import linprog
    from scipy.sparse import block_array, coo_array, eye_array, vstack

    positive(k=k)
    x, cells = np.asarray(points, dtype=float), np.asarray(triangles, dtype=np.int64)
    sides = x[cells[:, [1, 2, 0]]] - x[cells]  # from each corner to the next
    twice = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    if not (twice > 0).all():
        raise ValueError("triangles: some are folded, or walked clockwise")
    t, j = len(cells), _jumps(x, cells, k, walls)
    e = len(j.power)

    def rows(columns: Any, values: Any) -> Any:
        """Sparse rows with values (r, c) in columns (r, c) of the velocities' components."""
        r = np.repeat(np.arange(len(columns)), columns.shape[1])
        return coo_array((np.ravel(values), (r, np.ravel(columns))), shape=(len(columns), 6 * t)).tocsr()

    facing = sides[:, [1, 2, 0]] / twice[:, None, None]  # of each corner
    dN = np.stack([-facing[..., 1], facing[..., 0]], axis=-1)
    own = np.arange(6 * t).reshape(t, 6)
    xx, yy, xy = (rows(own, part.reshape(t, 6)) for part in (dN * [1, 0], dN * [0, 1], 0.5 * dN[..., ::-1]))
    normal, along = rows(j.columns, j.across), rows(j.columns, j.along)
    equal = block_array([[vstack([xx + yy, normal]), coo_array((t + e, t + e))]])
    cost = np.concatenate([np.zeros(6 * t), k * twice, j.power])
    bounds = np.full((len(cost), 2), [0.0, np.inf])
    bounds[: 6 * t, 0] = -np.inf
    tangents = [np.full(t, a) for a in 2 * np.pi * np.arange(TANGENTS) / TANGENTS]
    least = np.inf
    for _ in range(PROGRAMS):
        rates = vstack([np.cos(a)[:, None] * xx + np.sin(a)[:, None] * xy for a in tangents])
        sizes = vstack([-eye_array(t)] * len(tangents))
        below = block_array([[rates, sizes, None], [along, None, -eye_array(e)], [-along, None, -eye_array(e)]])
        above = np.concatenate([np.zeros(t * len(tangents)), j.wall_along, -j.wall_along])
        out = linprog(cost, below, above, equal, np.append(np.zeros(t), j.wall_across), bounds, "highs-ipm")
        if out.status != 0:
            raise ValueError(f"walls: no velocities of the body go with them ({out.message})")
        v = out.x[: 6 * t]
        least = min(least, float(k * twice @ np.hypot(xx @ v, xy @ v)) + j.dissipated(along @ v - j.wall_along))
        if least - out.fun <= AGREEMENT * least:
            break
        tangents.append(np.arctan2(xy @ v, xx @ v))
    return least


def _jumps(x: Array, cells: Index, k: float, walls: Any) -> _Jumps:
    """The jumps between triangles, of a power of k, and between them and walls, of m k."""
    inner, other, free = _sides(cells)
    here, there = (np.stack([_unknowns(*s.T), _unknowns(s[:, 0], (s[:, 1] + 1) % 3)]) for s in (inner, other))
    columns = [np.concatenate([here, there[::-1]], axis=2)]
    ends = [np.stack([cells[inner[:, 0], inner[:, 1]], cells[inner[:, 0], (inner[:, 1] + 1) % 3]], axis=1)]
    velocity, strength = [np.zeros((len(inner), 2))], [np.full(len(inner), k)]
    number = {tuple(sorted(cells[n][[c, (c + 1) % 3]].tolist())): (n, c) for n, c in free.tolist()}
    for wall in walls:
        not_negative(m=wall.m)
        if wall.m > 1:
            raise ValueError(f"m = {wall.m!r}: a friction factor lies between 0 and 1")
        s = np.array([number[tuple(sorted(edge))] for edge in np.asarray(wall.edges).tolist()])
        own = np.stack([_unknowns(*s.T), _unknowns(s[:, 0], (s[:, 1] + 1) % 3)])
        columns.append(np.concatenate([own, own], axis=2))
        ends.append(np.stack([cells[s[:, 0], s[:, 1]], cells[s[:, 0], (s[:, 1] + 1) % 3]], axis=1))
        velocity.append(np.tile(wall.velocity, (len(s), 1)))
        strength.append(np.full(len(s), wall.m * k))
    nodes, v = np.concatenate(ends), np.concatenate(velocity)
    way = x[nodes[:, 1]] - x[nodes[:, 0]]
    length = np.hypot(*way.T)
    along = way / length[:, None]
    across = np.stack([along[:, 1], -along[:, 0]], axis=1)
    to = np.repeat([-1.0, 0.0], [len(inner), len(nodes) - len(inner)])[:, None]  # a wall has no triangle behind it

    def both(of: Array) -> Array:
        return np.tile(np.concatenate([of, to * of], axis=1), (2, 1))

    return _Jumps(
        np.concatenate(columns, axis=1).reshape(-1, 4), both(across), both(along), np.tile((across * v).sum(axis=1), 2),
        np.tile((along * v).sum(axis=1), 2), np.tile(0.5 * length * np.concatenate(strength), 2),
    )  # fmt: skip


def _unknowns(triangle: Index, corner: Index) -> Index:
    """Numbers (n, 2) of the velocity components at corners of triangles."""
    return np.asarray(6 * triangle[:, None] + 2 * corner[:, None] + np.arange(2), dtype=np.int64)


def _sides(cells: Index) -> tuple[Index, Index, Index]:
    """Triangle and corner (n, 2) at which sides begin: shared ones in both triangles, then free ones (f, 2)."""
    starts = np.stack(np.meshgrid(np.arange(len(cells)), np.arange(3), indexing="ij"), axis=-1).reshape(-1, 2)
    ends = np.stack([cells[starts[:, 0], starts[:, 1]], cells[starts[:, 0], (starts[:, 1] + 1) % 3]], axis=1)
    at = {tuple(e): n for n, e in enumerate(ends.tolist())}
    other = np.array([at.get((b, a), -1) for a, b in ends.tolist()])
    once = np.flatnonzero((other >= 0) & (np.arange(len(other)) < other))
    return starts[once], starts[other[once]], starts[other < 0]
