"""Bodies that lie in one another at the beginning: they do not feel it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from prensa.checks.before.solids_overlap import Solid, deepest, lies_on, solid
from prensa.checks.thresholds import TOUCHING_DEPTH
from prensa.errors import Finding, coordinates
from prensa.mesh.mesh import segments
from prensa.system.contact_surfaces import distance
from prensa.system.interference import with_all_shares
from prensa.system.system import System
from prensa.types import Array, Flags, Index


class Overlap(NamedTuple):
    """Two bodies in the order of the description, and the ``place`` (d,) of one that lies deepest in the other."""

    first: str
    second: str
    place: tuple[float, ...]
    depth: float


class _Outline(NamedTuple):
    """A body: ``places`` (n, 2) to look at, node positions ``points``, ``edges`` (k, 2), the length of the shortest."""

    body: str
    places: Array
    points: Array
    edges: Index
    shortest: float


def overlaps(system: System) -> Iterator[Overlap]:
    """Pairs of bodies that lie in one another."""
    x = _placed(system)
    if system.dofs.dimension == 3:
        for one, other in combinations(_solids(system, x), 2):
            place, depth = max(deepest(one, other), deepest(other, one), key=lambda found: found[1])
            if depth > 0.0:
                yield Overlap(one.body, other.body, tuple(place.tolist()), depth)
        return
    outlines = [_outline(system, body, x) for body in system.meshes]
    for a, b in combinations(outlines, 2):
        worst = max(_deepest(a, b), _deepest(b, a), key=lambda found: found.depth)
        if worst.depth > TOUCHING_DEPTH * min(a.shortest, b.shortest):
            yield worst._replace(first=a.body, second=b.body)


def neighbours(system: System) -> Iterator[Overlap]:
    """Pairs of bodies that lie on one another along an edge at least, without tie or contact; the middle of such an edge."""
    x = _placed(system)
    if system.dofs.dimension == 3:
        yield from _solids_beside(system, x)
        return
    outlines = [_outline(system, body, x) for body in system.meshes]
    for a, b in combinations(outlines, 2):
        if b.body in system.tied_bodies(a.body) or _in_contact(system, a.body, b.body):
            continue
        for one, other in ((a, b), (b, a)):
            ends = one.points[one.edges]
            middles = ends.mean(axis=1)
            near = TOUCHING_DEPTH * min(a.shortest, b.shortest)
            low, high = other.points.min(axis=0) - near, other.points.max(axis=0) + near
            close = np.flatnonzero(((ends > low) & (ends < high)).all(axis=(1, 2)))
            if not len(close):
                continue
            # Both ends and the middle: an edge that meets the other outline in one point does not lie on it.
            places = np.stack([ends[close, 0], middles[close], ends[close, 1]]).reshape(-1, 2)
            on = (distance(places, other.points, other.edges).reshape(3, -1) <= near).all(axis=0)
            if on.any():
                k = close[np.argmax(on)]
                yield Overlap(a.body, b.body, tuple(middles[k].tolist()), 0.0)
                break


def _solids(system: System, x: Array) -> list[Solid]:
    """All bodies in space."""
    first = system.offsets
    return [solid(b, x[first[b] :][: len(m.points)], m.cells, m.boundary) for b, m in system.meshes.items()]


def _solids_beside(system: System, x: Array) -> Iterator[Overlap]:
    """As `neighbours`, in space: the middle of a face that lies on the other body."""
    for one, other in combinations(_solids(system, x), 2):
        if other.body in system.tied_bodies(one.body) or _in_contact(system, one.body, other.body):
            continue
        found = lies_on(one, other)
        found = lies_on(other, one) if found is None else found
        if found is not None:
            yield Overlap(one.body, other.body, tuple(found.tolist()), 0.0)


def _placed(system: System) -> Array:
    """Node positions (n, d) at the beginning, without the overlaps that ties are meant to have."""
    return system.positions(system.with_slaves(with_all_shares(system.dofs, system.initial().u)))


def _in_contact(system: System, *bodies: str) -> bool:
    """Whether there is a contact between two bodies."""
    return any(s.opposite is not None and set(s.bodies) == set(bodies) for s in system.surfaces)


def _outline(system: System, body: str, x: Array) -> _Outline:
    mesh = system.meshes[body]
    own = x[system.span(body)]
    edges = segments(mesh.boundary)
    # Centres too: of two bars that cross, no node of either outline need lie in the other.
    places = np.concatenate([own[np.unique(edges)], own[mesh.cells].mean(axis=1)])
    return _Outline(body, places, own, edges, float(np.hypot(*(own[edges[:, 1]] - own[edges[:, 0]]).T).min()))


def _deepest(one: _Outline, other: _Outline) -> Overlap:
    """The place of one body that lies deepest in another; of depth 0 if none does."""
    low, high = other.points.min(axis=0), other.points.max(axis=0)
    places = one.places[((one.places > low) & (one.places < high)).all(axis=1)]
    places = places[within(places, other.points[other.edges[:, 0]], other.points[other.edges[:, 1]])]
    if not len(places):
        return Overlap(one.body, other.body, (0.0, 0.0), 0.0)
    d = distance(places, other.points, other.edges)
    k = int(np.argmax(d))
    return Overlap(one.body, other.body, tuple(places[k].tolist()), float(d[k]))


def within(x: Array, a: Array, b: Array) -> Flags:
    """Whether places x (n, 2) lie in the outline of straight edges from a (k, 2) to b: a ray meets it an odd number of times."""
    across = (a[:, 1] > x[:, 1:]) != (b[:, 1] > x[:, 1:])
    # Edges along the ray never count as met: the number in the place of their zero only keeps the division finite.
    rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
    crossing = a[:, 0] + (x[:, 1:] - a[:, 1]) / rise * (b[:, 0] - a[:, 0])
    return np.asarray((across & (crossing > x[:, :1])).sum(axis=1) % 2 == 1)


def within_faces(x: Array, points: Array, faces: Index) -> Flags:
    """Whether places x (n, 3) lie in a body of closed ``faces`` (k, 4 | 6): they see it all around them, or nothing on balance.

    Solid angles of the triangles between corners, two of a quadrilateral (van Oosterom and Strackee 1983).
    """
    angle = np.zeros(len(x))
    for corners in (faces[:, :3],) if faces.shape[1] == 6 else (faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]):
        a, b, c = (points[corners[:, k]] - x[:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=2)
        below = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
        angle += 2.0 * np.arctan2(volume, below).sum(axis=1)
    return np.asarray(angle > 2.0 * np.pi)


def unjoined(system: System) -> set[str]:
    """Bodies that lie in another or on another without a tie or contact: that they are free to move follows of it."""
    return {body for o in (*overlaps(system), *neighbours(system)) for body in (o.first, o.second)}


def overlapping_bodies(system: System) -> Iterator[Finding]:
    """Bodies that lie in one another, or on one another without a tie."""
    overlapping = list(overlaps(system))
    for o in overlapping:
        meets = "no contact acts between the two; move it ('origin'), and join the two with 'ties' where they meet"
        if _in_contact(system, o.first, o.second):
            meets = "their contact presses them apart from the first increment on; move it ('origin') if no such fit is meant"
        yield Finding(
            f"bodies.{o.second}",
            f"it overlaps body {o.first!r}, by {o.depth:.3g} {system.problem.units.length} at ({coordinates(o.place)}): {meets}",
        )
    for o in neighbours(system):
        if any({o.first, o.second} == {p.first, p.second} for p in overlapping):
            continue  # reported already; parts of their outlines coincide besides
        yield Finding(
            f"bodies.{o.second}",
            f"it lies on body {o.first!r} at ({coordinates(o.place)}), and nothing holds the two together or apart; join them "
            "with 'ties', or make one a tool",
        )
