"""Edges of contact surfaces: boundaries by name, and what is left of a body's outline for a contact with the whole of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from prensa.geometry.reflections import Plane, axis_plane, plane_through
from prensa.mesh.bricks import BrickMesh, corner_keys
from prensa.mesh.faces import area_vectors
from prensa.mesh.mesh import Mesh, MeshError, keys
from prensa.model import problem as model
from prensa.precision import NEGLIGIBLE
from prensa.system.inclined import held_along_normals, side_normal
from prensa.types import Array, Flags, Index

STRAIGHT = 0.999  # cosine from which an edge's normal is along x or y
ON_TIE = 0.05  # distance over the length of an edge below which it lies on the other side of a tie

STILL = ("held", 0.0)
"""What a support says of a component that stays where it is."""


def contact_edges(problem: model.Problem, contact: model.Contact, meshes: dict[str, Mesh]) -> Index:
    """Edges (k, 2|3) of a contact in node numbers of its body, body on the left; in space faces (k, 4).

    Raises
    ------
    MeshError
        For a boundary that does not exist or is a point, for edges that another contact with the same tool has too, and for
        an outline of which nothing is left.

    """
    body = contact.surface[0].partition(".")[0]
    mesh = meshes[body]
    if contact.surface == (body,):
        return _rest_of_outline(problem, contact, body, meshes)
    edges = named_edges(mesh, contact.surface)
    if isinstance(mesh, BrickMesh):
        return edges
    for other in problem.contacts[: problem.contacts.index(contact)]:
        if other.against != contact.against or other.surface[0].partition(".")[0] != body or other.surface == (body,):
            continue
        twice = edges[_in(edges, named_edges(mesh, other.surface), mesh)]
        if len(twice):
            x, y = mesh.points[twice[0, :2]].mean(axis=0)
            raise MeshError(
                f"contacts.{problem.contacts.index(contact)}: the edge at ({x:.4g}, {y:.4g}) is in contact {other.name!r} "
                f"already, with the same tool: it is ambiguous which of the two applies there; remove it from one"
            )
    return edges


def named_edges(mesh: Mesh, names: tuple[str, ...]) -> Index:
    """Distinct edges (k, 2|3) of boundaries ``body.name`` of a mesh; of a body's name alone, its outline."""
    parts = []
    for s in names:
        _, dot, edge = s.partition(".")
        if not dot:
            parts.append(mesh.boundary)
            continue
        mesh.nodes(edge, s)
        if edge not in mesh.edges:
            raise MeshError(f"contact surface {s!r} is a point; it must be a boundary")
        parts.append(mesh.edges[edge])
    return np.asarray(np.unique(np.concatenate(parts), axis=0), dtype=np.int64)


def _in(edges: Index, others: Index, mesh: Mesh) -> Flags:
    """Which edges (k, 2|3) or faces (k, 4|6) are among others."""
    if isinstance(mesh, BrickMesh):
        own, theirs = corner_keys(edges), corner_keys(others)
        rows = np.unique(np.concatenate([own, theirs]), axis=0, return_inverse=True)[1].ravel()
        return np.isin(rows[: len(own)], rows[len(own) :])
    return np.isin(keys(edges[:, :2], len(mesh.points)), keys(others[:, :2], len(mesh.points)))


def _rest_of_outline(problem: model.Problem, contact: model.Contact, body: str, meshes: dict[str, Mesh]) -> Index:
    """The outline of a body without the sides that are named for the same tool, and without what can touch nothing."""
    mesh, outline = meshes[body], meshes[body].boundary
    entries: tuple[model.Contact | model.NoContact, ...] = (*problem.contacts, *problem.no_contact)
    for entry in entries:
        named = tuple(s for s in entry.surface if s.startswith(f"{body}."))
        if entry.against == contact.against and named:
            outline = outline[~_in(outline, named_edges(mesh, named), mesh)]
    if not len(outline):
        raise MeshError(
            f"contacts.{problem.contacts.index(contact)}: other entries name all sides of {body!r} with tool "
            f"{contact.against!r}: nothing of its outline is left for this one; remove it"
        )
    left = outline[~(symmetric(problem, body, mesh, outline) | _tied(problem, body, meshes, outline))]
    return np.unique(left if len(left) else outline, axis=0)


def symmetry_planes(problem: model.Problem, body: str, mesh: Mesh) -> list[Plane]:
    """Planes, in the plane lines, all boundary on which is held along the normal in all steps, and not along itself.

    Where another one ends a side, that holds the side's nodes along its own normal: that counts for nothing.
    """
    faces, held = _straight_corners(mesh), always_held(problem, body, mesh)
    x, near = mesh.points[faces], NEGLIGIBLE * float(mesh.extent.max())
    candidates: list[Plane] = []
    itself = held.copy()  # components along which nodes are held, but not because a side across them is
    for axis in range(held.shape[1]):
        across = (np.ptp(x[..., axis], axis=1) <= near) & held[faces, axis].all(axis=1)
        itself[faces[across], axis] = False
        candidates += [axis_plane(axis, at, held.shape[1]) for at in np.unique(x[across, 0, axis]).tolist()]
    candidates += [
        plane_through(normal, mesh.points[nodes]) for nodes, normal in _held_along_normals(problem, body, mesh)
    ]
    out: list[Plane] = []
    for plane in sorted(candidates, key=lambda p: ([-n for n in p.normal], p.place)):
        if any(plane.same(known, near) for known in out):
            continue
        there = faces[(np.abs(plane.distance(x)) <= near).all(axis=1)]
        partly = np.abs(plane.normal) < 1.0 - NEGLIGIBLE  # an axis inclined to it is partly along it
        along = held[there][..., partly].all(axis=1) & itself[there][..., partly].any(axis=1)
        if held_along(problem, body, mesh, np.array(plane.normal))[there].all() and not along.any():
            out.append(plane)
    return out


def _straight_corners(mesh: Mesh) -> Index:
    """Faces (k, 4 | 6) of a mesh in space; in the plane the ends (k, 2) of its edges."""
    return mesh.boundary if isinstance(mesh, BrickMesh) else mesh.boundary[:, :2]


def _held_along_normals(problem: model.Problem, body: str, mesh: Mesh) -> Iterator[tuple[Index, Array]]:
    """Nodes (k,) and unit normals (3,) of the sides of a body that are held along their normals, whatever the axes."""
    for name in held_along_normals(problem):
        for nodes in _own_nodes(name, body, mesh):
            yield nodes, side_normal(name, {body: mesh})


def held_along(problem: model.Problem, body: str, mesh: Mesh, normal: Array) -> Flags:
    """Nodes (n,) that supports hold along a unit vector (d,) where they are in all steps."""
    held = always_held(problem, body, mesh)
    out = np.asarray((held & (np.abs(normal) >= 1.0 - NEGLIGIBLE)).any(axis=1))
    for nodes, other in _held_along_normals(problem, body, mesh):
        if abs(other @ normal) >= 1.0 - NEGLIGIBLE:
            out[nodes] = True
    return out


def always_held(problem: model.Problem, body: str, mesh: Mesh) -> Flags:
    """Components (n, d) of the nodes that supports hold where they are in all steps: none moves, releases or feeds them.

    Those of the first step hold as those of the problem do.
    """
    held, axes = np.zeros(mesh.points.shape, dtype=bool), model.SPATIAL_AXES[: mesh.points.shape[1]]
    first = problem.steps[0].fixed if problem.steps else {}
    for name, support in (*problem.fixed.items(), *first.items()):
        for nodes in _own_nodes(name, body, mesh):
            for axis, key in enumerate(axes):
                held[nodes, axis] |= getattr(support, key) in STILL
    for step in problem.steps:
        for name, support in step.fixed.items():
            for nodes in _own_nodes(name, body, mesh):
                for axis, key in enumerate(axes):
                    if support.free or getattr(support, key) not in (None, *STILL):
                        held[nodes, axis] = False
        for name, driven in problem.driven(step).items():
            for nodes in _own_nodes(name, body, mesh):
                for axis, key in enumerate(axes):
                    if getattr(driven, key) is not None:
                        held[nodes, axis] = False
    return held


def _own_nodes(name: str, body: str, mesh: Mesh) -> Iterator[Index]:
    """The nodes of a boundary, if it is one of a body."""
    owner, _, edge = name.partition(".")
    if owner == body:
        yield mesh.nodes(edge, name)


def symmetric(problem: model.Problem, body: str, mesh: Mesh, edges: Index) -> Flags:
    """Edges, in space faces (k,) on the axis of revolution, and those that supports hold along their normal in all steps."""
    held = always_held(problem, body, mesh)
    if isinstance(mesh, BrickMesh):
        normal, faces = _face_normals(mesh.points[edges]), edges
    else:
        if problem.space == "axisymmetric":
            held[:, 0] |= mesh.points[:, 0] <= 1e-12 * float(mesh.extent.max())
        faces = edges[:, :2]
        t = mesh.points[faces[:, 1]] - mesh.points[faces[:, 0]]
        normal = np.stack([t[:, 1], t[:, 0]], axis=1) / np.hypot(*t.T)[:, None]
    out = np.asarray((held[faces].all(axis=1) & (np.abs(normal) > STRAIGHT)).any(axis=1))
    for nodes, other in _held_along_normals(problem, body, mesh):
        out |= np.isin(faces, nodes).all(axis=1) & (np.abs(normal @ other) > STRAIGHT)
    return out


def _face_normals(x: Array) -> Array:
    """Mean unit normals (k, 3) of faces x (k, 4 | 6, 3)."""
    area = area_vectors(x)[1].sum(axis=0)
    return np.asarray(area / np.linalg.norm(area, axis=1)[:, None])


def _tied(problem: model.Problem, body: str, meshes: dict[str, Mesh], edges: Index) -> Flags:
    """Edges (k,) that lie on the other side of a tie, in space faces of the slave's side, which lies on it all over."""
    points, out = meshes[body].points, np.zeros(len(edges), dtype=bool)
    if isinstance(meshes[body], BrickMesh):
        for tie in problem.ties:
            if tie.slave.partition(".")[0] == body:
                out |= _in(edges, named_edges(meshes[body], (tie.slave,)), meshes[body])
        return out
    middle, length = points[edges[:, :2]].mean(axis=1), np.hypot(*(points[edges[:, 1]] - points[edges[:, 0]]).T)
    for tie in problem.ties:
        for mine, other in ((tie.slave, tie.master), (tie.master, tie.slave)):
            if mine.partition(".")[0] == body:
                mesh = meshes[other.partition(".")[0]]
                own = _in(edges, named_edges(meshes[body], (mine,)), meshes[body])
                near = distance(middle, mesh.points, named_edges(mesh, (other,))) < ON_TIE * length
                out |= own & near
    return out


def distance(x: Array, points: Array, edges: Index) -> Array:
    """Distance (n,) of places x (n, 2) to the nearest of straight edges (k, 2|3)."""
    a = points[edges[:, 0]]
    t = points[edges[:, 1]] - a
    r = x[:, None] - a
    share = np.clip((r * t).sum(axis=2) / (t * t).sum(axis=1), 0.0, 1.0)
    d: Any = r - share[..., None] * t
    return np.asarray(np.hypot(d[..., 0], d[..., 1]).min(axis=1))
