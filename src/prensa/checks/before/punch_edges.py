"""Punches that go into a part of the end of a body in a container, whose elements turn over at the edge of the punch."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.before.extrusions import beside, confined
from prensa.checks.during.distortion import IN_A_SECTION
from prensa.checks.thresholds import ALONG, NO_DIFFERENCE
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.mesh.faces import area_vectors
from prensa.precision import SMALLEST
from prensa.system.moments import Moment, moments
from prensa.system.system import System
from prensa.types import Array, Index


def past_edges(system: System, body: str, across: Array) -> Iterator[Finding]:
    """What there is to say of a body, pressed together along ``across`` (d,), into an end of which a punch goes too far.

    In a container metal beside the punch goes past its edge, back along the punch, and never down with it: when the punch has
    gone in by the height of an element at its face, the lower corner of the element at its edge, which has gone past, is level
    with the upper one, which the punch has taken along, and the element is flat. So it is where the ways by which the punch
    pushes neighbouring nodes differ by that height; under a round nose they differ by its slope.
    """
    if confined(system, body, across) == 0.0:
        return
    most, name, goes = 0.0, "", 0.0
    for moment in moments(system):
        for s in system.tool_contacts:
            master = system.tool_masters[s.against]
            way = (master.place(moment.u) - master.place(system.initial().u))[: len(across)]
            along = abs(way @ across) > ALONG * np.linalg.norm(way)
            if s.body == body and moment.known[master.number] and along:
                far = _elements_past(system, s, way, moment)
                most, name, goes = max((most, name, goes), (far, s.against, float(np.linalg.norm(way))))
    if most > 1.0:
        yield Finding(
            f"bodies.{body}",
            f"{name!r} goes {goes:.4g} into a part of an end of {body!r}, which a container surrounds, by {most:.2g} elements at "
            "its edge: there elements turn over after about one, since metal flows back past it, and a run in space, which has "
            f"no new meshes, may end before that, with what it has by then; press less far, or compute {IN_A_SECTION}",
            seen_in_run=True,
        )


def _elements_past(system: System, s: Surface, way: Array, moment: Moment) -> float:
    """By how many heights of elements the ways by which a tool pushes neighbouring nodes of an end differ at a moment, at most.

    0 where no container begins at that end.
    """
    mesh, along = system.meshes[s.body], way / np.linalg.norm(way)
    area = area_vectors(mesh.points[mesh.boundary])[1].sum(axis=0)
    faces = mesh.boundary[area @ along < -ALONG * np.linalg.norm(area, axis=1)] + system.offsets[s.body]
    if not len(faces):
        return 0.0
    height = np.full(system.nodes, np.inf)
    np.minimum.at(height, s.points.nodes, s.points.depth)
    corners = faces[:, :3] if faces.shape[1] == 6 else faces
    ends = np.stack([corners.ravel(), np.roll(corners, -1, axis=1).ravel()], axis=1)
    nodes, place = np.unique(ends, return_inverse=True)
    if not _walled(system, s.body, system.X[nodes] @ along, along, float(height[nodes].min())):
        return 0.0
    pushed = _ways_pushed(system, s, nodes, along, moment)[place.reshape(ends.shape)]
    further = pushed.argmax(axis=1)[:, None]
    return float((np.ptp(pushed, axis=1) / np.take_along_axis(height[ends], further, axis=1)[:, 0]).max())


def _walled(system: System, body: str, level: Array, along: Array, element: float) -> bool:
    """Whether walls of tools begin at an end, with nodes at levels (k,) along a unit vector (d,), or within an element of it."""
    walls = [system.X[s.points.nodes[beside(system, s, along)]] @ along for s in system.tool_contacts if s.body == body]
    return float(min((wall.min() for wall in walls if len(wall)), default=np.inf)) <= level.min() + element


def _ways_pushed(system: System, s: Surface, nodes: Index, along: Array, moment: Moment) -> Array:
    """Ways (k,) along a unit vector (d,) by which nodes go until they are no longer in the tool of a contact at a moment."""
    master, x, way = system.tool_masters[s.against], system.X[nodes], np.zeros(len(nodes))
    while True:  # a tool is no nearer than its distance
        inside = -master.seen(x + way[:, None] * along, moment.u).g
        if inside.max() <= NO_DIFFERENCE * system.length + SMALLEST:
            return way
        way += np.maximum(inside, 0.0)
