"""Bodies of revolution in space: a section turned about its axis, where bricks collapse into wedges or make way for a core.

The core replaces the columns of the section next to the axis by squares, as in the mesh of a disc. In the planes in which the
pieces of the angle meet, the mesh is that of the section; at the corners of the core, three bricks meet at 120°.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from prensa.mesh.bricks import BrickMesh, with_boundaries
from prensa.mesh.mesh import Mesh, MeshError, boundary_edges, edges_between, named, ordered_nodes
from prensa.model import meshes as model
from prensa.precision import NEGLIGIBLE, ROUND_OFF
from prensa.types import Array, Flags, Index

_OF_RECTANGLE = {"bottom": "bottom", "top": "top", "outer": "right", "inner": "left"}
"""Sides of a cylinder by those of its rectangle."""
_CENTRES = {"bottom-centre": "bottom-left", "top-centre": "top-left"}


@dataclass(frozen=True)
class Turn:
    """``n`` layers of bricks around an ``angle``, which is a ``whole`` turn or ends in a plane of its own."""

    n: int
    angle: float
    whole: bool

    @property
    def directions(self) -> Array:
        """Cosines and sines (n + 1, 2) of the layers' planes; of a whole turn the last is the first."""
        at = np.linspace(0.0, self.angle, self.n + 1)
        out = np.column_stack([np.cos(at), np.sin(at)])
        out[np.abs(out) < ROUND_OFF] = 0.0  # a quarter ends in the plane x = 0
        return out

    @property
    def pieces(self) -> int:
        """Pieces of the core; none where they would be needles."""
        return model.pieces_around(self.angle)


def revolved(m: model.Revolution, section: Mesh) -> BrickMesh:
    """Mesh of a `prensa.Revolution` over the mesh of its section.

    Raises
    ------
    MeshError
        If the section crosses the axis, or has no room for the core that is asked for.

    """
    turn = Turn(m.n, m.angle, m.angle >= math.tau * (1.0 - NEGLIGIBLE))
    X = section.points.copy()
    at_axis = np.abs(X[:, 0]) <= NEGLIGIBLE * np.abs(X[:, 0]).max()
    X[at_axis, 0] = 0.0
    if X[:, 0].min() < 0.0:
        raise MeshError(f"the section crosses its axis: it comes to x = {X[:, 0].min():g}; draw it at x ≥ 0")
    found = _columns(section, X, at_axis) if at_axis.any() and m.core != "wedges" else np.zeros((0, 0), dtype=np.int64)
    if why := _no_core(turn, len(found) - 1) if at_axis.any() else "the section does not touch the axis":
        if m.core == "square":
            raise MeshError(f"no square core: {why}; leave 'core' out, and bricks at the axis are wedges")
        return _turned(section, X, at_axis, turn, None)
    return _turned(section, X, at_axis, turn, found)


def cylinder(m: model.Cylinder, section: Mesh) -> BrickMesh:
    """Mesh of a `prensa.Cylinder` over the mesh of its `profile_of`."""
    sides = {name: section.edges[side] for name, side in _OF_RECTANGLE.items() if side != "left" or m.bore}
    corners = {} if m.bore else {name: section.corners[corner] for name, corner in _CENTRES.items()}
    renamed = named(section, sides, corners, ())
    return revolved(model.Revolution(profile_of(m), m.n[2], m.angle, m.core), renamed)


def profile_of(m: model.Cylinder) -> model.Rectangle:
    """The rectangle that a cylinder is revolved of."""
    return model.Rectangle((m.radius - m.bore, m.height), m.n[:2], (m.bore, m.start))


def _no_core(turn: Turn, columns: int) -> str:
    """Why bricks at the axis have to be wedges, for so many columns of the section that lie along the axis; or nothing."""
    pieces = turn.pieces
    if not pieces:
        return f"{math.degrees(turn.angle):g}° are less than an eighth of a turn"
    if turn.n % (2 * pieces):
        return f"n = {turn.n} around {math.degrees(turn.angle):g}° is not a multiple of {2 * pieces}"
    core = turn.n // (2 * pieces)
    if columns < core + 1:
        return (
            f"n = {turn.n} around {math.degrees(turn.angle):g}° needs {core + 1} columns of the section's elements beside "
            f"the axis, with radii that grow outwards; there are {max(columns, 0)}"
        )
    return ""


def _columns(section: Mesh, X: Array, at_axis: Flags) -> Index:
    """Nodes (k + 1, m + 1) of a section X (n, 2) in columns of quadrilaterals, the axis first, from the top of each column down.

    Only as far as radii grow along all rows; none (0, 0) where the section touches the axis in more than one stretch.
    """
    edges = edges_between(boundary_edges(section.cells), np.flatnonzero(at_axis))
    chain = ordered_nodes(edges) if len(edges) else np.zeros(0, dtype=np.int64)
    if len(chain) != len(edges) + 1 or len(chain) != at_axis.sum():
        return np.zeros((0, 0), dtype=np.int64)
    # the two nodes across from each directed side of a quadrilateral, its follower first
    across = {
        (cell[i], cell[(i + 1) % 4]): (cell[(i + 3) % 4], cell[(i + 2) % 4]) for cell in section.cells.tolist() for i in range(4)
    }
    columns, seen = [chain.tolist()], set(chain.tolist())
    while True:
        pairs = [across.get(pair) for pair in pairwise(columns[-1])]
        known = [pair for pair in pairs if pair is not None]
        after = [pair[0] for pair in known] + [pair[1] for pair in known[-1:]]
        joined = len(known) == len(pairs) and all(a[1] == b[0] for a, b in pairwise(known))
        if not joined or seen.intersection(after) or not (X[after, 0] > X[columns[-1], 0]).all():
            return np.array(columns, dtype=np.int64)
        columns.append(after)
        seen.update(after)


def _turned(section: Mesh, X: Array, at_axis: Flags, turn: Turn, columns: Index | None) -> BrickMesh:
    """Bricks over a section with places X (n, 2); with a core in its ``columns`` (k + 1, m + 1), or wedges at the axis."""
    n, direction = len(X), turn.directions
    layers = len(direction) - turn.whole
    # number of each node of the section in each plane: on the axis all planes have the same
    number = np.arange(layers + 1)[:, None] * n + np.arange(n)
    number[:, at_axis] = np.flatnonzero(at_axis)
    if turn.whole:
        number[-1] = number[0]
    number = number[: turn.n + 1]
    points = np.stack([np.multiply.outer(direction[:, 0], X[:, 0]), np.tile(X[:, 1], (turn.n + 1, 1)),
                       np.multiply.outer(direction[:, 1], X[:, 0])], axis=-1)  # fmt: skip
    of = np.tile(np.arange(n), layers)
    replaced: Flags = np.zeros(len(section.cells), dtype=bool)
    inner = []
    if columns is not None:
        core = _Core(turn, X, columns)
        replaced = np.asarray(np.isin(section.cells, columns[: core.size + 1]).all(axis=1))
        points[:, columns[core.size : -1]] = core.rings()
        more, cells, ancestors = core.bricks(number, layers * n)
        inner = [cells]
        of = np.concatenate([of, ancestors])
        points = np.concatenate([points[:layers].reshape(-1, 3), more])
    else:
        points = points[:layers].reshape(-1, 3)
    outer = np.concatenate([number[:-1][:, section.cells[~replaced]], number[1:][:, section.cells[~replaced]]], axis=2)
    return _named(section, X, at_axis, turn, points, np.concatenate([outer.reshape(-1, 8), *inner]), of)


def _named(
    section: Mesh, X: Array, at_axis: Flags, turn: Turn, points: Array, cells: Index, of: Index
) -> BrickMesh:  # fmt: skip
    """Bricks with the section's boundaries and its points on the axis; ``of`` (nodes,): the section's node each comes from."""
    used = np.unique(cells)
    renumber = np.full(len(points), -1, dtype=np.int64)
    renumber[used] = np.arange(len(used))
    nodes: dict[str, Index] = {}
    for name, edges in section.edges.items():
        off_axis = edges[~at_axis[edges].all(axis=1)]  # along the axis there is no surface
        if len(off_axis):
            nodes[name] = renumber[used[np.isin(of[used], off_axis)]]
    nodes |= {name: renumber[[node]] for name, node in section.corners.items() if at_axis[node]}
    if not turn.whole:
        place, limit = points[used], ROUND_OFF * float(X[:, 0].max())
        c, s = turn.directions[-1]
        nodes["base"] = np.flatnonzero((np.abs(place[:, 2]) <= limit) & (place[:, 0] >= 0.0))
        ahead = place[:, 0] * c + place[:, 2] * s >= 0.0
        nodes["cap"] = np.flatnonzero((np.abs(place[:, 0] * s - place[:, 2] * c) <= limit) & ahead)
    return with_boundaries(points[used], renumber[cells], nodes)


class _Core:
    """Squares in place of the ``size`` columns next to the axis, in rings around it, and the rings from there to the last column.

    ``rows``: radii and heights (k + 1, m + 1, 2) of the columns.
    """

    def __init__(self, turn: Turn, X: Array, columns: Index) -> None:
        self.turn, self.columns, self.rows = turn, columns, X[columns]
        self.size = turn.n // (2 * turn.pieces)

    def _kite(self, piece: int) -> Array:
        """Places (size + 1, size + 1, m + 1, 2) across the axis of one piece, along its first side and its second."""
        start, end = self.turn.directions[2 * self.size * np.array([piece, piece + 1])]
        middle = self.turn.directions[self.size * (2 * piece + 1)]
        radius, last = self.rows[self.size, :, 0], self.rows[-1, :, 0]
        half = 0.5 * self.turn.angle / self.turn.pieces
        # The sides of a triangle with an angle of 60° at the corner, by the law of sines; no farther out than there is room.
        beyond = math.cos(half) + math.sin(half) / math.sqrt(3.0) - 1.0
        corner = radius + beyond * np.minimum(radius, last - radius)
        share = self.rows[: self.size + 1, :, 0] / radius
        s, t = share[:, None, :, None], share[None, :, :, None]
        ends = [np.multiply.outer(r, d) for r, d in ((radius, start), (radius, end), (corner, middle))]
        return np.asarray(s * ends[0] + t * ends[1] + s * t * (ends[2] - ends[0] - ends[1]))

    def _lifted(self, plan: Array) -> Array:
        """Places (…, m + 1, 3) on the rows of the section of those across the axis (…, m + 1, 2)."""
        radius = np.hypot(plan[..., 0], plan[..., 1])
        height = np.stack([np.interp(radius[..., j], *self.rows[:, j].T) for j in range(self.rows.shape[1])], axis=-1)
        return np.stack([plan[..., 0], height, plan[..., 1]], axis=-1)

    def rings(self) -> Array:
        """Places (n + 1, k − size, m + 1, 3) of the columns from the core on: its outline turns into the circle of the last."""
        sides = []
        for piece in range(self.turn.pieces):
            kite = self._kite(piece)
            sides += [kite[-1, :-1], kite[:0:-1, -1]]
        outline = np.concatenate([*sides, kite[:1, -1]])[:, None]
        radius = self.rows[self.size : -1, :, 0]
        share = ((radius - radius[0]) / (self.rows[-1, :, 0] - radius[0]))[None, :, :, None]
        circle = self.turn.directions[:, None, None] * self.rows[-1, :, 0][None, None, :, None]
        return self._lifted((1.0 - share) * outline + share * circle)

    def bricks(self, number: Index, first: int) -> tuple[Array, Index, Index]:
        """Places of the nodes inside the core, numbered from ``first`` on, its bricks (e, 8), and the section's nodes for them.

        ``number`` (n + 1, section's nodes): those of the planes.
        """
        size, (_, rows) = self.size, self.columns.shape
        plan: dict[tuple[int, int, int], int] = {}
        ids = np.zeros((self.turn.pieces, size + 1, size + 1, rows), dtype=np.int64)
        places: list[Array] = []
        ancestors: list[Index] = []
        for piece in range(self.turn.pieces):
            lifted = self._lifted(self._kite(piece))
            for a in range(size + 1):
                for b in range(size + 1):
                    ring = max(a, b)
                    if ring in (0, size):
                        around = 2 * size * piece + (b if a == size else 2 * size - a)
                        ids[piece, a, b] = number[around if ring else 0, self.columns[ring]]
                        continue
                    line = piece if b == 0 else (piece + 1) % (self.turn.pieces if self.turn.whole else math.inf)
                    key = (piece, a, b) if a and b else (int(line), ring, 0)
                    if key not in plan:
                        plan[key] = first + rows * len(plan)
                        places.append(lifted[a, b])
                        ancestors.append(self.columns[ring])
                    ids[piece, a, b] = plan[key] + np.arange(rows)
        quads = np.stack([ids[:, :-1, :-1], ids[:, 1:, :-1], ids[:, 1:, 1:], ids[:, :-1, 1:]], axis=-1)
        cells = np.concatenate([quads[..., :-1, :], quads[..., 1:, :]], axis=-1).reshape(-1, 8)
        nodes = np.array(ancestors, dtype=np.int64).reshape(-1)
        return np.array(places, dtype=np.float64).reshape(-1, 3), cells, nodes
