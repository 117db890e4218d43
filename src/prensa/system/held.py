"""What supports hold in all steps, by what they prescribe in each: components of nodes, directions, faces on planes of symmetry.

There is one answer, that of the solver: supports of the problem and of steps, zero motions, feeds and releases, nodes that ties
have made one or lead, sides held along their normals. It needs meshes and ties alone, so that contacts can be found with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.geometry.reflections import Plane, axis_plane, plane_through
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.faces import area_vectors
from prensa.mesh.mesh import Mesh
from prensa.precision import NEGLIGIBLE
from prensa.system.bodies import Bodies
from prensa.system.inclined import side_normal
from prensa.system.once import once
from prensa.system.planning import Ends, support_groups
from prensa.types import Array, Flags, Index

STRAIGHT = 0.999  # cosine from which a face's normal is along the direction in which it is held
NO_ANGLE = float(np.sqrt(2.0 * NEGLIGIBLE))  # angle whose cosine is 1 but for what is negligible


@once
def _still(bodies: Bodies) -> Flags:
    """Components (n d,) of the nodes that supports prescribe to stay where they were made, in each step."""
    steps = range(len(bodies.problem.steps)) or (-1,)
    field = bodies.dofs.displacement
    start = np.zeros(field.size)
    out = np.asarray(np.abs(bodies.displaced).ravel() <= NEGLIGIBLE * bodies.length)
    for number in steps:
        groups = [g for g in support_groups(bodies, number, start, Ends(None)) if g.support is not None]
        still = np.zeros(field.size, dtype=bool)
        for g in groups:
            still[g.dofs] = g.amplitude is None or not np.any(g.amplitude.values)
        out &= still
    return out


def held_along(bodies: Bodies, body: str, normal: Array, axis: bool = True) -> Flags:
    """Nodes (n,) of a body that supports hold along a unit vector (d,) where they were made, in all steps.

    They are those that no motion which supports, ties and sides held along their normals leave has a part along it.
    ``axis``: whether the axis of revolution is a support, too.
    """
    own, d, free = bodies.span(body), bodies.X.shape[1], ~_still(bodies)
    if axis:
        free = free.copy()
        free[bodies.axis_nodes * d] = False
    if bodies.ties is None:
        moves = np.abs(np.where(free.reshape(-1, d)[own], normal, 0.0)).max(axis=1)
        return np.asarray(moves <= NO_ANGLE)
    rows, columns = slice(own.start * d, own.stop * d), np.flatnonzero(free)
    follows = [bodies.ties.matrix[rows][:, columns]]
    if bodies.ties.jump is not None:
        follows.append(bodies.ties.jump[rows])
    out = np.ones(own.stop - own.start, dtype=bool)
    for matrix in follows:
        along = sum(float(normal[c]) * matrix[c::d] for c in range(d))
        out &= np.asarray(abs(along).sum(axis=1)).ravel() <= NO_ANGLE
    return out


@once
def directions(bodies: Bodies) -> Array:
    """Unit vectors (k, d) along which supports hold: the axes, then inclined normals of sides held along these."""
    out = list(np.eye(bodies.X.shape[1]))
    inclined = bodies.ties.inclined if bodies.ties is not None else None
    for name in inclined.names if inclined is not None else ():
        normal = side_normal(name, bodies.meshes)
        if all(abs(normal @ known) < 1.0 - NEGLIGIBLE for known in out):
            out.append(normal)
    return np.array(out)


class Held(NamedTuple):
    """Directions (k, d), the axes first, and whether supports hold each of n nodes along them in all steps: flags (n, k)."""

    ways: Array
    flags: Flags

    def along(self, across: Array) -> Flags:
        """Nodes (n,) that are held along a vector (d,), or partly along it."""
        return np.asarray((self.flags & (np.abs(self.ways @ across) > NEGLIGIBLE)).any(axis=1))

    def towards(self, ends: Index, across: Array, least: float) -> Flags:
        """Groups (s, e) of nodes ``ends`` (s, e, a), all held along directions with a cosine > ``least`` to ``across`` (s, d)."""
        near = np.abs(across @ self.ways.T) > least
        holds = np.asarray((self.flags[ends] & near[:, None, None, :]).any(axis=3))
        return np.asarray(holds.all(axis=2))


def held(bodies: Bodies, body: str) -> Held:
    """The directions along which supports hold nodes of a body in all steps; the axis of revolution is none."""
    ways = directions(bodies)
    return Held(ways, np.stack([held_along(bodies, body, way, axis=False) for way in ways], axis=1))


def symmetric(bodies: Bodies, body: str, edges: Index) -> Flags:
    """Edges, in space faces (k,) on the axis of revolution, and those that supports hold along their normal in all steps."""
    mesh, out = bodies.meshes[body], np.zeros(len(edges), dtype=bool)
    faces = edges if isinstance(mesh, BrickMesh) else edges[:, :2]
    normal = _face_normals(mesh.points[faces])
    for way in directions(bodies):
        out |= held_along(bodies, body, way)[faces].all(axis=1) & (np.abs(normal @ way) > STRAIGHT)
    return out


def _face_normals(x: Array) -> Array:
    """Mean unit normals (k, d) of faces x (k, 4 | 6, 3), in the plane those of edges x (k, 2, 2)."""
    if x.shape[2] == 2:
        t = x[:, 1] - x[:, 0]
        return np.asarray(np.stack([t[:, 1], -t[:, 0]], axis=1) / np.hypot(*t.T)[:, None])
    area = area_vectors(x)[1].sum(axis=0)
    return np.asarray(area / np.linalg.norm(area, axis=1)[:, None])


def straight_corners(mesh: Mesh) -> Index:
    """Faces (k, 4 | 6) of a mesh in space; in the plane the ends (k, 2) of its edges."""
    return mesh.boundary if isinstance(mesh, BrickMesh) else mesh.boundary[:, :2]


def symmetry_planes(bodies: Bodies, body: str) -> list[Plane]:
    """Planes, in the plane lines, all boundary on which is held along the normal in all steps, and not along itself.

    Where another one ends a side, that holds the side's nodes along its own normal: that counts for nothing.
    """
    mesh = bodies.meshes[body]
    d = mesh.points.shape[1]
    faces, along_axes = straight_corners(mesh), held(bodies, body).flags[:, :d]
    x, near = mesh.points[faces], NEGLIGIBLE * float(mesh.extent.max())
    candidates: list[Plane] = []
    itself = along_axes.copy()  # components along which nodes are held, but not because a side across them is
    for axis in range(d):
        across = (np.ptp(x[..., axis], axis=1) <= near) & along_axes[faces, axis].all(axis=1)
        itself[faces[across], axis] = False
        candidates += [axis_plane(axis, at, d) for at in np.unique(x[across, 0, axis]).tolist()]
    candidates += _inclined_planes(bodies, body)
    out: list[Plane] = []
    for plane in sorted(candidates, key=lambda p: ([-n for n in p.normal], p.place)):
        if any(plane.same(known, near) for known in out):
            continue
        there = faces[(np.abs(plane.distance(x)) <= near).all(axis=1)]
        beside = np.abs(plane.normal) < 1.0 - NEGLIGIBLE  # an axis inclined to it is partly along it
        along = along_axes[there][..., beside].all(axis=1) & itself[there][..., beside].any(axis=1)
        if held_along(bodies, body, np.array(plane.normal), axis=False)[there].all() and not along.any():
            out.append(plane)
    return out


def _inclined_planes(bodies: Bodies, body: str) -> list[Plane]:
    """Planes through the sides of a body that are held along their normals, whatever the axes."""
    if bodies.ties is None or bodies.ties.inclined is None:
        return []
    mesh, out = bodies.meshes[body], []
    for name in bodies.ties.inclined.names:
        owner, _, side = name.partition(".")
        if owner == body:
            out.append(plane_through(side_normal(name, {body: mesh}), mesh.points[mesh.nodes(side, name)]))
    return out
