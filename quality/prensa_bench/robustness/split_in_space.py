"""Bricks and wedges split into quadratic tetrahedra, whose sides follow round bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.mesh.quality import POOR, quality
from prensa.types import Array, Index
from prensa_bench.robustness.cells_in_space import BRICK_SIDES, SIDE_MIDDLES, contact_points, outer_faces

ROUND_SIDES = ("outer", "inner")  # of bodies of revolution about y
ABOUT_Y = np.array([True, False, True])  # axes across it


def split(mesh: Any) -> pr.Tetrahedra:
    """A mesh of bricks as one of tetrahedra with the same sides; middles of the edges on `ROUND_SIDES` lie on the cone there."""
    made = mesh_of(mesh)
    corners = tetrahedra(made.points, made.cells)
    ends = np.sort(corners[:, list(SIDE_MIDDLES)], axis=2)
    edges, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    first = len(made.points)
    points = np.concatenate([made.points, made.points[edges].mean(axis=1)])
    cells = np.concatenate([corners, first + number.reshape(-1, 6)], axis=1)
    named = {name: made.nodes(name) for name in made.edges}
    faces = outer_faces(cells)
    for name in set(ROUND_SIDES) & set(named):
        on = np.unique(faces[np.isin(faces[:, :3], named[name]).all(axis=1), 3:])
        radii = np.hypot(*made.points[edges[on - first]][..., [0, 2]].transpose(2, 0, 1)).mean(axis=1)
        points[on] *= np.where(ABOUT_Y, (radii / np.hypot(points[on, 0], points[on, 2]))[:, None], 1.0)
    names = {name: tuple(nodes.tolist()) for name, nodes in named.items()}
    return pr.Tetrahedra(tuple(map(tuple, points.tolist())), tuple(map(tuple, cells.tolist())), names)


def well_shaped(mesh: pr.Tetrahedra) -> bool:
    """Whether a run would warn of none of its elements: flat bricks and wedges are split into slivers."""
    return bool((quality(mesh_of(mesh)).jacobian >= POOR).all())


def tetrahedra(x: Array, cells: Index) -> Index:
    """Corners (k, 4) of what bricks (m, 8) are split into, which meet side to side.

    From the corner with the lowest number to the sides that it is not on, these along their diagonal from their own lowest one
    (Dompierre, Labbé, Vallet & Camarero 1999). Where nodes stand twice, tetrahedra without a volume are left out.
    """
    found = []
    for cell in cells:
        lowest = int(cell.min())
        for side in BRICK_SIDES:
            ring = cell[list(side)]
            if lowest in ring:
                continue
            a, b, c, d = np.roll(ring, -int(np.argmin(ring)))
            found += [(a, b, c, lowest) for a, b, c in ((a, b, c), (a, c, d)) if len({a, b, c}) == 3]
    four = np.array(found, dtype=np.int64)
    a, b, c, e = (x[four[:, k]] for k in range(4))
    turned = np.einsum("mi,mi->m", np.cross(b - a, c - a), e - a) < 0.0
    four[turned, :2] = four[turned, 1::-1]
    return four


def contact_nodes(mesh: Any, side: str) -> Index:
    """Nodes of a side that bear contact: of tetrahedra those in the middle of edges."""
    return np.unique(contact_points(mesh_of(mesh).edges[side]))
