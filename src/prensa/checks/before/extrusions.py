"""Bodies in space that tools push through openings so narrow, or so steep, that their elements wear out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.during.distortion import IN_A_SECTION
from prensa.checks.thresholds import ALONG, NO_DIFFERENCE, SLIGHT, TOUCHING_DEPTH, TOWARDS
from prensa.contact.masters import Seen
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.mesh.faces import area_vectors
from prensa.model.problem import support_names
from prensa.precision import NEGLIGIBLE, SMALLEST
from prensa.system.held import held
from prensa.system.moments import Moment, moments
from prensa.system.once import once
from prensa.system.system import System
from prensa.types import Array, Flags


class Opening(NamedTuple):
    """What a body is pushed through: the share ``passes`` of its width, and the ``slope`` (tangent) of the way to there.

    ``way``: how far it is pushed after it has first met the die; ``radius``: how far it reaches from where it does not move;
    ``element``: size of its elements at the die.
    """

    passes: float
    slope: float
    way: float
    radius: float
    element: float


def extruded(system: System, body: str) -> Iterator[Finding]:
    """What there is to say of a body in a container that is pushed through an opening by more than elements bear."""
    for across in _ways_pushed(system, body):
        wide = spread(system, body, across)
        if not len(wide.ways) or confined(system, body, across) == 0.0:
            continue
        found = opening(system, body, across, wide)
        if found is not None and (angle := corner_angle(found, len(wide.ways))) > np.pi:
            yield Finding(
                f"bodies.{body}",
                f"tools push {body!r} through an opening of {found.passes:.2g} of its width, at up to "
                f"{np.degrees(np.arctan(found.slope)):.0f}°: corners of elements that pass its edge open up to "
                f"{np.degrees(angle):.0f}°, they fold, and a run in space, which has no new meshes, may end before that, with "
                f"what it has by then; give the die a smaller slope, push less far, or compute {IN_A_SECTION}",
                seen_in_run=True,
            )


def corner_angle(o: Opening, wide: int) -> float:
    """Angle to which a corner of 90° of elements along the die opens where it has just passed the edge of the opening.

    Of metal that converges towards the point, or line, in which the sides of the die would meet: along radii from there it flows
    at an angle θ as cos θ / r^m, so that the volume flow is that of the billet (B. Avitzur, Metal forming, 1968); ``wide``: m,
    the axes along which it becomes narrower. What was straight across lags behind the middle at the outside by the slope
    s = tan α (c^−(m + 1) − 1)(1 + 1/((m + 1) cos² α)) at the end, and from the edge on backwards the side of the element still
    lies along the die, as far as that is as long: 90° + atan s + α. The outside has come there when the billet has gone on by
    R (1 − c^(m + 1))/((m + 1) sin α cos α); 90° before that.
    """
    n = wide + 1.0
    cos2 = 1.0 / (1.0 + o.slope**2)
    if o.way < o.radius * (1.0 - o.passes**n) / (n * o.slope * cos2):
        return 0.5 * np.pi
    lag, chord = o.slope * (o.passes**-n - 1.0) * (1.0 + 1.0 / (n * cos2)), (1.0 - o.passes) * o.radius / o.element
    return float(0.5 * np.pi + np.arctan(lag) + np.arctan(min(o.slope, chord)))


def opening(system: System, body: str, across: Array, wide: Spread) -> Opening | None:
    """The narrowest that a body, moved on with what pushes it ``across``, comes to; None where nothing goes through.

    Its section is made smaller as a whole, about what does not move, until no node is inside a tool. ``wide``: its `spread`.
    """
    if held(system, body).along(across).any():
        return None  # it stands
    reach = np.zeros_like(system.X)
    reach[system.span(body)] = wide.places @ wide.ways
    out, before = Opening(1.0, 0.0, 0.0, float(np.linalg.norm(reach, axis=1).max()), 0.0), np.zeros(len(across))
    for moment in moments(system):
        way, pushing = _pushed(system, body, moment, across)
        dies = [s for s in system.tool_contacts if s.body == body and s.against not in pushing]
        if not pushing or not dies:
            continue
        passes, slope = min(_narrowest(system, s, moment, way, reach, out.passes) for s in dies)
        if passes < SLIGHT:
            return None  # closed
        gone = float(np.linalg.norm(way - before))
        mean = (out.passes - passes) * out.radius / max(gone, SMALLEST)
        element = max(float(s.points.depth.max()) for s in dies)
        out = Opening(passes, max(out.slope, slope, mean), out.way + gone * (passes < 1.0), out.radius, element)
        before = way
    return out if out.passes < 1.0 else None


def _ways_pushed(system: System, body: str) -> Iterator[Array]:
    """Unit vectors (d,) along which tools, or sides that are moved, push a body, each once."""
    found = list[Array]()
    for moment in moments(system):
        for way, _ in _pushes(system, body, moment):
            across = way / np.linalg.norm(way)
            if all(abs(across @ known) < 1.0 - NEGLIGIBLE for known in found):
                found.append(across)
                yield across


def _pushed(system: System, body: str, moment: Moment, across: Array) -> tuple[Array, list[str]]:
    """How far (d,) tools and sides, ``across`` their way, have pushed a body at a moment; their names."""
    found = [(w, name) for w, name in _pushes(system, body, moment) if abs(w @ across) > ALONG * np.linalg.norm(w)]
    return max((w for w, _ in found), key=np.linalg.norm, default=np.zeros(len(across))), [name for _, name in found]


def _pushes(system: System, body: str, moment: Moment) -> Iterator[tuple[Array, str]]:
    """Ways (d,) of the tools that touch a body at first, and of its flat sides, that have pushed it at a moment; their names."""
    start, d = system.initial().u, system.dofs.dimension
    for s in system.tool_contacts:
        master = system.tool_masters[s.against]
        moved = (master.place(moment.u) - master.place(start))[:d]
        if s.body != body or not moment.known[master.number] or not moved.any():
            continue
        seen = master.seen(system.X[s.points.nodes], start)
        touching = seen.g <= TOUCHING_DEPTH * s.points.depth.min()
        if (seen.n[touching] @ moved > ALONG * np.linalg.norm(moved)).any():
            yield moved, s.against
    for name in support_names(system.problem):
        owner, _, side = name.partition(".")
        if owner == body and side in system.meshes[body].edges:
            faces = system.meshes[body].edges[side]
            moved = moment.u[system.dofs.displacement.dofs(np.unique(faces) + system.offsets[body])].mean(axis=0)
            area = area_vectors(system.meshes[body].points[faces])[1].sum(axis=(0, 1))
            if moved.any() and -area @ moved > ALONG * np.linalg.norm(moved) * np.linalg.norm(area):
                yield moved, name


def _narrowest(system: System, s: Surface, moment: Moment, way: Array, reach: Array, most: float) -> tuple[float, float]:
    """The largest share of its width, up to ``most``, at which nodes of a contact, moved by ``way``, are not inside their tool.

    With the slope of the tool to the way where they touch it then.
    """
    master, nodes, deepest = system.tool_masters[s.against], s.points.nodes, TOUCHING_DEPTH * s.points.depth.min()

    def seen(share: float) -> Seen:
        return master.seen(system.X[nodes] + way - (1.0 - share) * reach[nodes], moment.u)

    now = seen(most)
    if now.g.min() >= -deepest:
        return most, 0.0
    inside, outside = most, 0.0
    while inside - outside > NO_DIFFERENCE:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if seen(middle).g.min() < -deepest else (inside, middle)
    now = seen(outside)
    against = abs(float(now.n[int(np.argmin(now.g))] @ way)) / float(np.linalg.norm(way))
    return outside, float(against / max(np.sqrt(1.0 - against**2), NO_DIFFERENCE))


def beside(system: System, s: Surface, across: Array) -> Flags:
    """Nodes (k,) of a contact that touch their tool at the start where it lies along ``across`` (d,), as walls do."""
    seen = system.tool_masters[s.against].seen(system.X[s.points.nodes], system.initial().u)
    return np.asarray((seen.g <= TOUCHING_DEPTH * s.points.depth.min()) & (np.abs(seen.n @ across) < TOWARDS))


def mouth(system: System, body: str, across: Array) -> tuple[float, float]:
    """How far beyond their end the walls of a container have turned by 45°, and how long an element is there; inf if they do not.

    Beside a straight wall that is the radius by which a mouth is rounded.
    """
    found, cells = (float("inf"), 0.0), system.meshes[body].cells + system.offsets[body]
    for s in system.tool_contacts:
        if s.body != body or not (walls := beside(system, s, across)).any():
            continue
        at = system.X[s.points.nodes]
        for way in (across, -across):
            node = s.points.nodes[walls][int(np.argmax(at[walls] @ way))]
            last, far = system.X[node], float((system.X[system.span(body)] @ way).max())
            free = far - float(last @ way)
            if free > 0.0 and _turned(system, s, last + free * way, across):
                near = 0.0
                while free - near > NO_DIFFERENCE * abs(far):
                    middle = 0.5 * (near + free)
                    near, free = (near, middle) if _turned(system, s, last + middle * way, across) else (middle, free)
                element = np.ptp(system.X[cells[(cells == node).any(axis=1)]] @ way, axis=1)
                found = min(found, (free, float(element.max())))
    return found


def _turned(system: System, s: Surface, x: Array, across: Array) -> bool:
    """Whether the tool of a contact at a place (d,) looks more along ``across`` than beside it."""
    n = system.tool_masters[s.against].seen(x[None], system.initial().u).n[0]
    return bool(2.0 * (n @ across) ** 2 > 1.0)


def confined(system: System, body: str, across: Array) -> float:
    """Length along ``across`` (d,) on which tools touch a body at the start from all sides, as the container of a shank does."""
    normals, along, u = [np.zeros((0, len(across)))], [np.zeros(0)], system.initial().u
    for s in system.tool_contacts:
        if s.body == body:
            X, walls = system.X[s.points.nodes], beside(system, s, across)
            normals.append(system.tool_masters[s.against].seen(X[walls], u).n)
            along.append(X[walls] @ across)
    n, at = np.concatenate(normals), np.concatenate(along)
    surrounded = len(n) > 0 and np.linalg.matrix_rank(n - np.outer(n @ across, across), tol=TOWARDS) == len(across) - 1
    return float(np.ptp(at)) if surrounded else 0.0


class Spread(NamedTuple):
    """Orthonormal ``ways`` (m, d) along which the width of a body changes, and ``places`` (n, m) along them of its nodes.

    Places count from where the body does not move.
    """

    ways: Array
    places: Array

    @property
    def distances(self) -> Array:
        """Distances (n,) of the nodes from where the body does not move."""
        return np.asarray(np.linalg.norm(self.places, axis=1))


def spread(system: System, body: str, across: Array) -> Spread:
    """How the nodes of a body lie about what does not move as its width changes: along all ways but ``across`` (d,).

    From flat sides that supports hold along their normals, whatever the axes, else from the middle; ways along which they hold
    two sides are left out. A sector has the ways and places of the whole. It is found once for each direction.
    """
    return _spread(system, body, tuple(across.tolist()))


@once
def _spread(system: System, body: str, across: tuple[float, ...]) -> Spread:
    X = system.meshes[body].points
    ways = _beside(np.eye(X.shape[1]), np.array([across]))
    closed, single = _held_ends(system, body, ways)
    if len(closed):
        ways = _beside(ways, np.array(closed))
    normals = np.array([n for n, _ in single]).reshape(-1, X.shape[1]) @ ways.T
    seen = np.linalg.norm(normals, axis=1) > NO_DIFFERENCE
    normals, at = normals[seen], np.array([place for _, place in single])[seen]
    rank = int(np.linalg.matrix_rank(normals, tol=NO_DIFFERENCE)) if len(normals) else 0
    places = X @ ways.T
    middle = 0.5 * (places.min(axis=0, initial=np.inf) + places.max(axis=0, initial=-np.inf))
    if rank < len(ways) and (np.abs(normals).max(axis=1, initial=0.0) < 1.0 - NEGLIGIBLE).any():
        rest = _beside(np.eye(len(ways)), normals)  # ways in whose direction no side is held, of which some are inclined
        turned = np.vstack([np.linalg.svd(normals)[2][:rank], rest])
        ways, normals, places = turned @ ways, normals @ turned.T, places @ turned.T
        middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    # what no held side says is that of the middle
    off = np.linalg.lstsq(normals, at - normals @ middle, rcond=None)[0] if rank else np.zeros(len(ways))
    return Spread(ways, places - (middle + off))


def _beside(ways: Array, others: Array) -> Array:
    """Orthonormal rows (m, d) of what ``ways`` (k, d) span beside ``others`` (j, d), the ways themselves where they are."""
    straight = ways[(np.abs(ways @ others.T) <= NO_DIFFERENCE).all(axis=1)]
    inside = others @ ways.T
    left = len(ways) - int(np.linalg.matrix_rank(inside, tol=NO_DIFFERENCE))
    if len(straight) == left:
        return straight
    return np.asarray(np.linalg.svd(inside)[2][len(ways) - left :] @ ways)


def _held_ends(system: System, body: str, ways: Array) -> tuple[list[Array], list[tuple[Array, float]]]:
    """Directions (d,) within ``ways`` (m, d) at both ends of which supports hold flat sides; those at one end, with its place."""
    mesh, holds = system.meshes[body], held(system, body)
    closed, single = list[Array](), list[tuple[Array, float]]()
    for k, n in enumerate(holds.ways):
        if np.linalg.norm(ways @ n) < 1.0 - NEGLIGIBLE:
            continue
        x = mesh.points @ n
        ends = [x.min(), x.max()]
        near = [np.abs(x - end) <= NO_DIFFERENCE * np.ptp(ends) for end in ends]
        sides = [mesh.boundary[there[mesh.boundary].all(axis=1)] for there in near]
        fixed = [len(side) > 0 and bool(holds.flags[side, k].all()) for side in sides]
        if all(fixed):
            closed.append(n)
        elif any(fixed):
            single.append((n, float(ends[fixed.index(True)])))
    return closed, single
