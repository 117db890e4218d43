"""Bodies in space that tools push through openings so narrow, or so steep, that their elements wear out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import ALONG, NO_DIFFERENCE, SLIGHT, TOUCHING_DEPTH, TOWARDS
from prensa.contact.masters import Seen
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.mesh.quality import POOR
from prensa.precision import SMALLEST
from prensa.system.contact_surfaces import always_held
from prensa.system.moments import Moment, moments
from prensa.system.system import System
from prensa.types import Array


WORN = float(np.sqrt(1.0 / POOR**2 - 1.0))
"""Shear at which the scaled Jacobian of a rectangle, 1/√(1 + γ²), is `POOR`."""


class Opening(NamedTuple):
    """What a body is pushed through: the share ``passes`` of its width, and the ``slope`` (tangent) of the way to there.

    ``layers``: how far it is pushed along the die, in elements.
    """

    passes: float
    slope: float
    layers: float = 0.0


def extruded(system: System, body: str) -> Iterator[Finding]:
    """What there is to say of a body that a container surrounds, if it is pushed through an opening by more than elements bear."""
    for across in np.eye(3):
        wide = spread(system, body, across)
        if not wide or confined(system, body, across) == 0.0:
            continue
        found = opening(system, body, across, wide)
        if found is not None and (shear := sheared_in(found, len(wide))) > WORN:
            yield Finding(
                f"bodies.{body}",
                f"tools push {body!r} through an opening of {found.passes:.2g} of its width, at up to "
                f"{np.degrees(np.arctan(found.slope)):.0f}°: along the die its elements are sheared, by up to {shear:.2g}, and a run "
                "in space, which has no new meshes, may end before that, with what it has by then; give the die a smaller slope, "
                "push less far, or compute a section in the plane with 'remesh: auto'",
                seen_in_run=True,
            )


def sheared_in(o: Opening, wide: int) -> float:
    """Shear along the die of what converges towards the point, or line, in which its sides would meet.

    Along radii from there metal at an angle θ flows as cos θ / r^m, so that the volume flow is that of the billet (B. Avitzur,
    Metal forming, 1968); ``wide``: m, the axes along which it becomes narrower. From r to r c it comes to be later than in the
    middle, in its own direction over the distance across, by tan α (k (1 + q) − q), k = c^−(m + 1), q = 1/((m + 1) cos² α): tan α
    where it turns into the die, and what that and the longer way become in the stretch. Next to what stands the layer of elements
    is sheared by the way over its thickness, and by no more.
    """
    k, q = o.passes ** -(wide + 1.0), (1.0 + o.slope**2) / (wide + 1.0)
    return float(min(o.slope * (k * (1.0 + q) - q), o.layers * o.passes**-wide))


def opening(system: System, body: str, across: Array, wide: dict[int, Array]) -> Opening | None:
    """The narrowest that a body, moved on with what pushes it ``across``, comes to; None where nothing goes through.

    Its section is made smaller as a whole, about what does not move, until no node is inside a tool. ``wide``: its `spread`.
    """
    if (always_held(system.problem, body, system.meshes[body]) @ across > 0.0).any():
        return None  # it stands
    reach = np.zeros_like(system.X)
    for axis, places in wide.items():
        reach[system.span(body), axis] = places
    out, before = Opening(1.0, 0.0), np.zeros(len(across))
    for moment in moments(system):
        way, pushing = _pushed(system, body, moment, across)
        dies = [s for s in system.tool_contacts if s.body == body and s.against not in pushing]
        if not pushing or not dies:
            continue
        now = min((_narrowest(system, s, moment, way, reach, out.passes) for s in dies), key=lambda one: one.passes)
        if now.passes < SLIGHT:
            return None  # closed
        gone = float(np.linalg.norm(way - before))
        mean = (out.passes - now.passes) * float(np.linalg.norm(reach, axis=1).max()) / max(gone, SMALLEST)
        layers = out.layers + (gone / max(float(s.points.depth.max()) for s in dies) if now.passes < 1.0 else 0.0)
        out = Opening(now.passes, max(out.slope, now.slope, mean), layers)
        before = way
    return out if out.passes < 1.0 else None


def _pushed(system: System, body: str, moment: Moment, across: Array) -> tuple[Array, list[str]]:
    """How far (d,) tools that touch a body at first, ``across`` their way, have pushed it at a moment; their names."""
    way, names, start = np.zeros(len(across)), [], system.initial().u
    for s in system.tool_contacts:
        master = system.tool_masters[s.against]
        moved = (master.place(moment.u) - master.place(start))[: len(across)]
        if s.body != body or not moment.known[master.number] or abs(moved @ across) < ALONG * np.linalg.norm(moved) or not moved.any():
            continue
        seen = master.seen(system.X[s.points.nodes], start)
        touching = seen.g <= TOUCHING_DEPTH * s.points.depth.min()
        if (seen.n[touching] @ moved > ALONG * np.linalg.norm(moved)).any():
            names.append(s.against)
            way = moved if np.linalg.norm(moved) > np.linalg.norm(way) else way
    return way, names


def _narrowest(system: System, s: Surface, moment: Moment, way: Array, reach: Array, most: float) -> Opening:
    """The largest share of its width, up to ``most``, at which the nodes of a contact, moved by ``way``, are not inside their tool.

    With the slope of the tool to the way where they touch it then.
    """
    master, nodes, deepest = system.tool_masters[s.against], s.points.nodes, TOUCHING_DEPTH * s.points.depth.min()

    def seen(share: float) -> Seen:
        return master.seen(system.X[nodes] + way - (1.0 - share) * reach[nodes], moment.u)

    now = seen(most)
    if now.g.min() >= -deepest:
        return Opening(most, 0.0)
    inside, outside = most, 0.0
    while inside - outside > NO_DIFFERENCE:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if seen(middle).g.min() < -deepest else (inside, middle)
    now = seen(outside)
    against = abs(float(now.n[int(np.argmin(now.g))] @ way)) / float(np.linalg.norm(way))
    return Opening(outside, against / max(np.sqrt(1.0 - against**2), NO_DIFFERENCE))


def confined(system: System, body: str, across: Array) -> float:
    """Length along ``across`` (d,) on which tools touch a body at the start from all sides, as the container of a shank does."""
    normals, along = [np.zeros((0, len(across)))], [np.zeros(0)]
    for s in system.tool_contacts:
        if s.body == body:
            X = system.X[s.points.nodes]
            seen = system.tool_masters[s.against].seen(X, system.initial().u)
            beside = (seen.g <= TOUCHING_DEPTH * s.points.depth.min()) & (np.abs(seen.n @ across) < TOWARDS)
            normals.append(seen.n[beside])
            along.append(X[beside] @ across)
    n, at = np.concatenate(normals), np.concatenate(along)
    surrounded = len(n) > 0 and np.linalg.matrix_rank(n - np.outer(n @ across, across), tol=TOWARDS) == len(across) - 1
    return float(np.ptp(at)) if surrounded else 0.0


def spread(system: System, body: str, across: Array) -> dict[int, Array]:
    """By each axis that is not ``across`` (d,), places (n,) of a body's nodes from where it does not move as its width changes.

    From a side that supports hold, else from the middle; axes along which they hold both sides are left out.
    """
    mesh = system.meshes[body]
    X, held = mesh.points, always_held(system.problem, body, mesh)
    out = {}
    for a in range(X.shape[1]):
        ends = [X[:, a].min(), X[:, a].max()]
        fixed = [bool(held[X[:, a] <= ends[0] + NO_DIFFERENCE * np.ptp(ends), a].all()),
                 bool(held[X[:, a] >= ends[1] - NO_DIFFERENCE * np.ptp(ends), a].all())]  # fmt: skip
        if abs(across[a]) < ALONG and not all(fixed):
            out[a] = X[:, a] - (ends[fixed.index(True)] if any(fixed) else 0.5 * sum(ends))
    return out
