"""Edges of contact surfaces: boundaries by name, and what is left of a body's outline for a contact with the whole of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from prensa.mesh.bricks import BrickMesh
from prensa.mesh.mesh import Mesh, MeshError, keys
from prensa.model import problem as model
from prensa.types import Array, Flags, Index

STRAIGHT = 0.999  # cosine from which an edge's normal is along x or y
ON_TIE = 0.05  # distance over the length of an edge below which it lies on the other side of a tie


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
    if contact.surface == (body,) and not isinstance(mesh, BrickMesh):
        return _rest_of_outline(problem, contact, body, meshes)
    edges = named_edges(mesh, contact.surface)
    if isinstance(mesh, BrickMesh):
        return edges
    for other in problem.contacts[: problem.contacts.index(contact)]:
        if other.against != contact.against or other.surface[0].partition(".")[0] != body or other.surface == (body,):
            continue
        twice = edges[np.isin(_keys(edges, mesh), _keys(named_edges(mesh, other.surface), mesh))]
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


def _keys(edges: Index, mesh: Mesh) -> Index:
    return keys(edges[:, :2], len(mesh.points))


def _rest_of_outline(problem: model.Problem, contact: model.Contact, body: str, meshes: dict[str, Mesh]) -> Index:
    """The outline of a body without the sides that are named for the same tool, and without what can touch nothing."""
    mesh, outline = meshes[body], meshes[body].boundary
    entries: tuple[model.Contact | model.NoContact, ...] = (*problem.contacts, *problem.no_contact)
    for entry in entries:
        named = tuple(s for s in entry.surface if s.startswith(f"{body}."))
        if entry.against == contact.against and named:
            outline = outline[~np.isin(_keys(outline, mesh), _keys(named_edges(mesh, named), mesh))]
    if not len(outline):
        raise MeshError(
            f"contacts.{problem.contacts.index(contact)}: other entries name all sides of {body!r} with tool "
            f"{contact.against!r}: nothing of its outline is left for this one; remove it"
        )
    left = outline[~(symmetric(problem, body, mesh, outline) | _tied(problem, body, meshes, outline))]
    return np.unique(left if len(left) else outline, axis=0)


def symmetry_lines(problem: model.Problem, body: str, mesh: Mesh) -> set[tuple[int, float]]:
    """Lines (axis of the normal, place) all outline on which is held along the normal in all steps, and not along itself."""
    edges, held = mesh.boundary[:, :2], always_held(problem, body, mesh)
    ends, out, near = mesh.points[edges], set(), 1e-9 * float(mesh.extent.max())
    for axis in (0, 1):
        flat = np.ptp(ends[..., axis], axis=1) <= near
        for at in np.unique(ends[flat, 0, axis]).tolist():
            there = edges[flat & (np.abs(ends[:, 0, axis] - at) <= near)]
            if held[there, axis].all() and not held[there, 1 - axis].all(axis=1).any():
                out.add((axis, at))
    return out


def always_held(problem: model.Problem, body: str, mesh: Mesh) -> Flags:
    """Components (n, d) of the nodes that supports hold where they are in all steps: none moves, releases or feeds them."""
    held, axes = np.zeros(mesh.points.shape, dtype=bool), model.SPATIAL_AXES[: mesh.points.shape[1]]
    for name, support in problem.fixed.items():
        for nodes in _own_nodes(name, body, mesh):
            for axis, key in enumerate(axes):
                held[nodes, axis] |= getattr(support, key) == "held"
    for step in problem.steps:
        for name, support in step.fixed.items():
            for nodes in _own_nodes(name, body, mesh):
                for axis, key in enumerate(axes):
                    if support.free or getattr(support, key) not in (None, "held"):
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
    """Edges (k,) on the axis of revolution, and those that supports hold along their normal in all steps."""
    held, ends = always_held(problem, body, mesh), mesh.points[edges[:, :2]]
    if problem.space == "axisymmetric":
        held[:, 0] |= mesh.points[:, 0] <= 1e-12 * float(mesh.extent.max())
    t = ends[:, 1] - ends[:, 0]
    normal = np.abs(np.stack([t[:, 1], t[:, 0]], axis=1)) / np.hypot(*t.T)[:, None]
    return np.asarray((held[edges].all(axis=1) & (normal > STRAIGHT)).any(axis=1))


def _tied(problem: model.Problem, body: str, meshes: dict[str, Mesh], edges: Index) -> Flags:
    """Edges (k,) that lie on the other side of a tie."""
    points = meshes[body].points
    middle, length = points[edges[:, :2]].mean(axis=1), np.hypot(*(points[edges[:, 1]] - points[edges[:, 0]]).T)
    out = np.zeros(len(edges), dtype=bool)
    for tie in problem.ties:
        for mine, other in ((tie.slave, tie.master), (tie.master, tie.slave)):
            if mine.partition(".")[0] == body:
                mesh = meshes[other.partition(".")[0]]
                own = np.isin(_keys(edges, meshes[body]), _keys(named_edges(meshes[body], (mine,)), meshes[body]))
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
