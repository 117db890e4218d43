"""Surfaces with a corner whose gaps are measured along the undeformed normal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.contact.faces import FacePoints
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity, coordinates
from prensa.mesh.bricks import around_faces
from prensa.system.system import System
from prensa.types import Array, Index

KINKED = 0.766
"""Cosine of the angle, 40°, by which an undeformed surface may bend at a node and still have a normal there."""


def surface_corners(system: System) -> Iterator[Finding]:
    """Surfaces with a corner whose gaps are measured along the normal before they deform, which a corner does not have."""
    for i, s in enumerate(system.surfaces if system.problem.contact_geometry == "reference" else ()):
        if s.points.rule.type != "nodal":  # points between nodes have the normal of their edge
            continue
        if isinstance(s.points, FacePoints):
            yield from _edge(system, i, s, s.points.faces)
            continue
        ends = s.points.edges[:, :2]
        along = system.X[ends[:, 1]] - system.X[ends[:, 0]]
        along /= np.hypot(*along.T)[:, None]
        into = {int(node): k for k, node in enumerate(ends[:, 1])}
        for k, node in enumerate(ends[:, 0].tolist()):
            if node in into and float(along[into[node]] @ along[k]) < KINKED:
                yield _kink(i, s, "corner", system.X[node])
                break


def _edge(system: System, i: int, s: Surface, faces: Index) -> Iterator[Finding]:
    """The sharpest edge between two faces (m, 4 | 6) of a surface in space."""
    ring = around_faces(faces)
    x = system.X[ring]
    n = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1])
    n /= np.linalg.norm(n, axis=1)[:, None]
    edges = np.sort(np.stack([ring, np.roll(ring, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    of = np.repeat(np.arange(len(faces)), ring.shape[1])
    of, edges = of[edges[:, 0] != edges[:, 1]], edges[edges[:, 0] != edges[:, 1]]
    order = np.lexsort(edges.T)
    same = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    if not len(same):
        return
    one, other = of[order[same]], of[order[same + 1]]
    k = int(np.argmin((n[one] * n[other]).sum(axis=1)))
    if float(n[one[k]] @ n[other[k]]) < KINKED:
        yield _kink(i, s, "edge", system.X[edges[order[same[k]]]].mean(axis=0))


def _kink(i: int, s: Surface, what: str, at: Array) -> Finding:
    names = s.description.surface
    apart = "make two boundaries of it, each with a contact" if len(names) == 1 else "give each side a contact of its own"
    return Finding(
        f"contacts.{i}.surface",
        f"'contact_geometry: reference' measures gaps along the normal of the undeformed surface, which "
        f"{'+'.join(names)!r} does not have at its {what} at ({coordinates(at)}); {apart}",
        Severity.REFUSE,
    )
