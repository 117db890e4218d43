"""Edges of contact surfaces: boundaries by name, and what is left of a body's outline for a contact with the whole of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from prensa.mesh.bricks import BrickMesh, corner_keys
from prensa.mesh.mesh import Mesh, MeshError, keys
from prensa.model import problem as model
from prensa.system.bodies import Bodies
from prensa.system.held import symmetric
from prensa.types import Array, Flags, Index

ON_TIE = 0.05  # distance over the length of an edge below which it lies on the other side of a tie


def contact_edges(bodies: Bodies, contact: model.Contact) -> Index:
    """Edges (k, 2|3) of a contact in node numbers of its body, body on the left; in space faces (k, 4).

    Raises
    ------
    MeshError
        For a boundary that does not exist or is a point, for edges that another contact with the same tool has too, and for
        an outline of which nothing is left.

    """
    body = contact.surface[0].partition(".")[0]
    problem, mesh = bodies.problem, bodies.meshes[body]
    if contact.surface == (body,):
        return _rest_of_outline(bodies, contact, body)
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


def _rest_of_outline(bodies: Bodies, contact: model.Contact, body: str) -> Index:
    """The outline of a body without the sides that are named for the same tool, and without what can touch nothing."""
    problem, mesh = bodies.problem, bodies.meshes[body]
    outline = mesh.boundary
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
    left = outline[~(symmetric(bodies, body, outline) | _tied(problem, body, bodies.meshes, outline))]
    return np.unique(left if len(left) else outline, axis=0)


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
