"""Lines of symmetry and the axis of revolution as rigid smooth planes, for free outlines that come to them.

What is modelled ends there, and so does its image: a bore that closes or a skin that folds meets itself on the line. The planes
are tools and contacts that are added to the problem when a free node comes near one; before, they cost nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from prensa.contact.record import ContactRecord
from prensa.mesh.mesh import segments
from prensa.model import problem as model
from prensa.model.names import SYMMETRY
from prensa.precision import NEGLIGIBLE
from prensa.registry import DOORS
from prensa.system.contact_surfaces import symmetry_lines
from prensa.system.discretise import discretise, on_meshes
from prensa.system.mesh_state import Remeshed
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array, Index

NEAR_LINE = 0.25  # distance over the length of an edge of the outline at which a node of it is near a line …
WITHIN = 0.5  # … if it is that close to it over the length that the edges at it had at first


@dataclass(frozen=True)
class Line:
    """A line of symmetry: ``axis`` of its normal, place ``at`` on it, ``side`` (±1) on which the ``bodies`` lie."""

    axis: int
    at: float
    side: float
    bodies: tuple[str, ...]

    def __str__(self) -> str:
        return f"{'xy'[self.axis]} = {self.at:g}"

    def distance(self, x: Array) -> Array:
        """Distance (...) of places (..., 2) from it, positive where the bodies lie."""
        return np.asarray(self.side * (x[..., self.axis] - self.at))


class Nearing(Exception):
    """An increment in which a free outline comes to a line of symmetry, to be done again with a plane there."""


class Watched(NamedTuple):
    """Free outlines off a ``line``: ``ends`` (k, 2) of their segments.

    ``room`` (n,): distances of their nodes, before they moved, from where they are close to it, ``dofs`` (n,) what changes these.
    """

    line: Line
    ends: Index
    room: Array
    dofs: Index


@dataclass(frozen=True)
class Guard:
    """What to look at in a system: the free outlines off each of its lines."""

    system: System
    watched: tuple[Watched, ...]

    @property
    def lines(self) -> list[Line]:
        """The lines."""
        return [w.line for w in self.watched]

    def near(self, u: Array) -> list[tuple[Line, Array]]:
        """Lines to which a free node has come near in degrees of freedom u (ndof,), and where the nearest one is."""
        out = []
        for w in self.watched:
            if (w.room + w.line.side * u[w.dofs]).min() >= 0.0:
                continue  # few come close, so that the rest is seldom looked at
            a, b = self.system.positions(u)[w.ends.T]
            share = np.minimum(w.line.distance(a), w.line.distance(b)) / np.hypot(*(b - a).T)
            k = int(np.argmin(share))
            if share[k] < NEAR_LINE:
                out.append((w.line, a[k]))
        return out

    def on(self, system: System, u: Array) -> Guard:
        """The same lines, to be looked at in the system on a new mesh, which begins with degrees of freedom u (ndof,)."""
        return Guard(system, tuple(_watched(system, self.lines, u)))


def guard_of(system: System) -> Guard | None:
    """What to look at in a system; None if it has no line that a free outline could come to.

    In small strain nothing comes near what it was not near at; systems with further fields, or with contact between bodies, are
    left as they are.
    """
    p = system.problem
    if system.dofs.dimension != 2 or system.more or p.body_contacts:
        return None
    if p.kinematics == "small" or p.contact_geometry == "reference":
        return None
    u = system.initial().u
    watched = _watched(system, _lines(system, system.positions(u)), u)
    return Guard(system, tuple(watched)) if watched else None


def _watched(system: System, lines: Sequence[Line], u: Array) -> list[Watched]:
    """What to look at off some lines, on a mesh that begins with degrees of freedom u (ndof,)."""
    x, watched = system.positions(u), []
    for line in lines:
        ends = np.concatenate([_free(system, line, body, x) for body in line.bodies])
        if len(ends):
            nodes, place = np.unique(ends, return_inverse=True)
            length = np.full(len(nodes), np.inf)
            np.minimum.at(length, place.reshape(-1, 2), np.hypot(*(x[ends[:, 1]] - x[ends[:, 0]]).T)[:, None])
            dofs = system.dofs.displacement.dof(nodes, "xy"[line.axis])
            watched.append(Watched(line, ends, line.distance(system.X[nodes]) - WITHIN * length, dofs))
    return watched


def lines_of(system: System, body: str, x: Array) -> list[Line]:
    """Lines that hold part of a body's outline along their normal and nothing along themselves, and the axis of revolution.

    Only those on one side of which the body lies, its nodes and all others being at x (n, 2), and where no plane of the
    description stands already; none if ``no_contact`` excepts the body.
    """
    p, mesh = system.problem, system.meshes[body]
    if any(e.against == SYMMETRY and SYMMETRY not in p.tools and body in e.surface for e in p.no_contact):
        return []
    own, places = x[system.span(body)], symmetry_lines(p, body, mesh)
    if p.space == "axisymmetric":
        places.add((0, 0.0))
    out = []
    for axis, at in sorted(places):
        for line in (Line(axis, at, side, (body,)) for side in (1.0, -1.0)):
            beside = line.distance(own).min() >= -NEGLIGIBLE * system.length
            if beside and not _stands(system, body, line, len(system.tools) - system.mirrors):
                out.append(line)
    return out


def _lines(system: System, x: Array) -> list[Line]:
    """The lines of all bodies (see `lines_of`) on which no plane stands, with those on the same side of each."""
    bodies: dict[tuple[int, float, float], list[str]] = {}
    for body in system.meshes:
        for line in lines_of(system, body, x):
            if not _stands(system, body, line, len(system.tools)):
                bodies.setdefault((line.axis, line.at, line.side), []).append(body)
    return [Line(*key, tuple(names)) for key, names in sorted(bodies.items())]


def _stands(system: System, body: str, line: Line, tools: int) -> bool:
    """Whether one of the first ``tools`` that a body has contact with is a plane on a line, on the other side of which it is."""
    names = list(system.tool_masters)[:tools]
    for s in system.tool_contacts:
        master = system.tool_masters[s.against]
        tool = master.tool
        if s.body != body or s.against not in names:
            continue
        if tool.description.type == "plane" and line.side * tool.direction[line.axis] > 1 - NEGLIGIBLE:
            place = master.at + master.place(system.initial().u)[:2]
            if abs(place[line.axis] - line.at) <= NEGLIGIBLE * system.length:
                return True
    return False


def _free(system: System, line: Line, body: str, x: Array) -> Index:
    """Segments (k, 2) of a body's outline both ends of which are off a line."""
    ends = segments(system.meshes[body].boundary) + system.offsets[body]
    off = line.distance(x[ends]) > NEGLIGIBLE * system.length
    return np.asarray(ends[off.all(axis=1)])


# ------------------------------------------------------------------------------------------------------- with planes there
def names_of(problem: model.Problem, lines: Sequence[Line]) -> list[str]:
    """Names of the tools that stand for the lines, none of which another tool has."""
    out: list[str] = []
    for line in lines:
        name, k = f"symmetry_{'xy'[line.axis]}", 1
        while name in problem.tools or name in out:
            k += 1
            name = f"symmetry_{'xy'[line.axis]}{k}"
        out.append(name)
    return out


def with_planes(guard: Guard) -> System:
    """The system of the same problem with a smooth plane at every line, last among its tools and contacts."""
    p, lines = guard.system.problem, guard.lines
    plane, smooth = DOORS["tool"].find("plane"), DOORS["friction"].find("coulomb")(mu=0.0)
    tools, contacts, beyond = dict(p.tools), list(p.contacts), list[model.NoContact]()
    for name, line in zip(names_of(p, lines), lines):
        normal, at = [0.0, 0.0], [0.0, 0.0]
        normal[line.axis], at[line.axis] = line.side, line.at
        tools[name] = plane(normal=tuple(normal), at=tuple(at))
        contacts += [model.Contact((body,), name, friction=smooth) for body in line.bodies]
        others = tuple(body for body in p.bodies if body not in line.bodies)
        beyond += [model.NoContact((body,), name) for body in others]
    # The planes come last, so that the numbers of all tools and contacts of the description stay what they were.
    system = discretise(replace(p, tools=tools, contacts=tuple(contacts), no_contact=(*p.no_contact, *beyond)))
    return replace(system, mirrors=len(lines))


def on_mesh_of(system: System, state: State) -> System:
    """The system with planes on the mesh of a state: that of the description, or one made since."""
    return system if state.remeshed is None else on_meshes(system, _wider_motions(state.remeshed, system))


def _wider_motions(remeshed: Remeshed, new: System) -> Remeshed:
    """Meshes made during a run, with the motions of the tools of a system that has planes too, which stand still."""
    more = len(new.tools) - len(remeshed.tools)
    return replace(remeshed, tools=np.concatenate([remeshed.tools, np.zeros((more, remeshed.tools.shape[1]))]))


def extended(state: State, old: System, new: System) -> State:
    """A state of a system as one of that with planes, which carry nothing yet."""

    def wider(values: Array) -> Array:
        return _wider(values, np.zeros(new.ndof), old, new)

    first = new.undeformed().contact
    record = ContactRecord(**{
        key: np.concatenate([values, getattr(first, key)[len(values) :]]) for key, values in vars(state.contact).items()
    })  # fmt: skip
    lam = np.concatenate([state.lam, np.zeros((len(record.closed) - len(state.lam), state.lam.shape[1]))])
    return replace(
        state, u=wider(state.u), du=wider(state.du), second_difference=wider(state.second_difference), contact=record,
        lam=lam, work=wider(state.work), step_start=wider(state.step_start),
        release=None if state.release is None else wider(state.release),
        remeshed=None if state.remeshed is None else _wider_motions(state.remeshed, new),
        tool_work=np.append(state.tool_work, np.zeros(len(new.tools) - len(state.tool_work))),
        tool_wear=np.append(state.tool_wear, np.zeros(len(new.tools) - len(state.tool_wear))),
    )  # fmt: skip


def extended_derivatives(
    carried: Mapping[str, Array], initial: Mapping[str, Array], old: System, new: System
) -> dict[str, Array]:
    """Derivatives of `State.moving` arrays as those on the system with planes, where what is new has what it has initially."""
    out = dict(carried)
    for name, values in carried.items():
        if values.shape == (old.ndof,):
            out[name] = _wider(values, initial.get(name, np.zeros(new.ndof)), old, new)
        elif name in initial and initial[name].shape != values.shape:  # of contact points
            out[name] = np.concatenate([values, initial[name][len(values) :]])
    return out


def _wider(values: Array, rest: Array, old: System, new: System) -> Array:
    """Values (ndof,) of the degrees of freedom of a system as those of the one with planes, of which the ``rest`` is."""
    out = rest.copy()
    for name, field in old.dofs.fields.items():
        new.dofs.fields[name].of(out)[: field.count] = field.of(values)
    return out


def system_of(state: State, system: System) -> System:
    """The system that a committed state belongs to: that of the description, or the one with planes at its lines."""
    if state.remeshed is None:
        if state.u.shape == (system.ndof,):
            return system
    elif len(state.remeshed.tools) <= len(system.tools):  # none where the meshes are of an earlier run
        return system
    guard = guard_of(system)
    wider = None if guard is None else with_planes(guard)
    if wider is None or (state.remeshed is None and state.u.shape != (wider.ndof,)):
        return system
    return wider
