"""Planes of symmetry, in the plane lines and the axis of revolution, as rigid smooth planes for free sides that come to them.

What is modelled ends there, and so does its image: a bore that closes or a skin that folds meets itself on the plane. The tools
and contacts that stand for them are added to the problem when a free node comes near one; before, they cost nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from prensa.contact.record import ContactRecord
from prensa.geometry.reflections import Plane, axis_plane, upright
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.mesh import segments
from prensa.model import problem as model
from prensa.model.names import SYMMETRY
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.registry import DOORS
from prensa.system.discretise import discretise, on_meshes
from prensa.system.held import symmetric, symmetry_planes
from prensa.system.mesh_state import Remeshed
from prensa.system.mirrored_sides import named_planes
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array, Index

NEAR = 0.25  # distance over the size of a face of the boundary at which a node of it is near a plane …
WITHIN = 0.5  # … if it is that close to it over the size that the faces at it had at first


@dataclass(frozen=True)
class Mirror:
    """A ``plane`` of symmetry, on one ``side`` (±1) of which along its normal the ``bodies`` lie."""

    plane: Plane
    side: float
    bodies: tuple[str, ...]

    def __str__(self) -> str:
        return str(self.plane)

    @property
    def kind(self) -> str:
        """What it is called."""
        return "line of symmetry" if len(self.plane.normal) == 2 else "plane of symmetry"

    @property
    def inwards(self) -> Array:
        """Unit normal (d,) into the bodies."""
        return np.asarray(self.side * np.array(self.plane.normal))

    def distance(self, x: Array) -> Array:
        """Distance (...) of places (..., d) from it, positive where the bodies lie."""
        return np.asarray(self.side * self.plane.distance(x))


class MirrorContact(model.Contact):
    """Contact of the free sides of a body with a plane of symmetry; in space, too, it names the whole of the body."""

    whole_in_space: ClassVar[bool] = True


class Nearing(Exception):
    """An increment in which a free side comes to a plane of symmetry, to be done again with a tool there."""


class Watched(NamedTuple):
    """Free sides of a body off a ``mirror``, or in it: nodes (k, 2), in space (k, 4 | 6), of their ``faces``.

    ``room`` (n,): distances of their nodes, before they moved, from where they are close to it, ``dofs`` (n, d) what
    changes these. ``least``: the distance over the size of a face below which they have come near: what lies in the mirror at
    first may lift off, and has come near when it goes through.
    """

    mirror: Mirror
    faces: Index
    room: Array
    dofs: Index
    least: float


class Close(NamedTuple):
    """A free side that is close to a ``mirror``: ``place`` (d,) of its nearest node, distance as a ``share`` of a face there.

    ``near``: whether it has come so near that a tool has to stand there.
    """

    mirror: Mirror
    place: Array
    share: float
    near: bool

    @property
    def where(self) -> str:
        """The place in words."""
        return f"({', '.join(f'{v:.4g}' for v in self.place)})"


@dataclass(frozen=True)
class Guard:
    """What to look at in a system: the free sides off each of its planes of symmetry."""

    system: System
    watched: tuple[Watched, ...]

    @property
    def mirrors(self) -> list[Mirror]:
        """The planes."""
        return list(dict.fromkeys(w.mirror for w in self.watched))

    def near(self, u: Array) -> list[Close]:
        """Planes to which a free node has come near in degrees of freedom u (ndof,), with the nearest one."""
        return [close for close in self.close(u) if close.near]

    def close(self, u: Array) -> list[Close]:
        """The nearest nodes where some have come close to a plane in degrees of freedom u (ndof,)."""
        out = []
        for w in self.watched:
            if (w.room + u[w.dofs] @ w.mirror.inwards).min() >= 0.0:
                continue  # few come close, so that the rest is seldom looked at
            x = self.system.positions(u)[w.faces]
            distance = w.mirror.distance(x)
            share = distance.min(axis=1) / _sizes(x)
            k = int(np.argmin(share))
            out.append(Close(w.mirror, x[k, np.argmin(distance[k])], float(share[k]), bool(share[k] < w.least)))
        return out

    def on(self, system: System, u: Array) -> Guard:
        """The same planes, to be looked at in the system on a new mesh, which begins with degrees of freedom u (ndof,)."""
        return Guard(system, tuple(_watched(system, self.mirrors, u)))


def _sizes(x: Array) -> Array:
    """The shortest side (k,) of faces x (k, 4 | 6, 3), in the plane the length of edges (k, 2, 2)."""
    corners = x[:, :3] if x.shape[1] == 6 else x
    length = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    # wedges name a node twice
    return np.asarray(np.where(length > 0.0, length, np.inf).min(axis=1))


def guard_of(system: System) -> Guard | None:
    """What to look at in a system; None if it has no plane that a free side could come to, or where no tool could stand there.

    In small strain nothing comes near what it was not near at; systems with further fields, or with contact between bodies, are
    left as they are (see `unguarded`).
    """
    return _guard(system) if _may_stand(system) else None


def unguarded(system: System) -> Guard | None:
    """What would be looked at in a system, where no tool can stand at a plane that a free side passes; None if one can."""
    return None if _may_stand(system) and not system.gone else _guard(system)


def _may_stand(system: System) -> bool:
    """Whether tools can stand at planes of symmetry during a run."""
    p = system.problem
    return not system.more and not p.body_contacts and p.kinematics != "small" and p.contact_geometry != "reference"


def _guard(system: System) -> Guard | None:
    u = system.initial().u
    watched = _watched(system, _mirrors(system, system.positions(u)), u)
    return Guard(system, tuple(watched)) if watched else None


def _watched(system: System, mirrors: Sequence[Mirror], u: Array) -> list[Watched]:
    """What to look at off some planes, on a mesh that begins with degrees of freedom u (ndof,)."""
    x, watched = system.positions(u), []
    for mirror in mirrors:
        for body in mirror.bodies:
            off, on = free_faces(system, mirror, body, x)
            for faces, within, least in ((off, WITHIN, NEAR), (on, 0.0, -DRAWN)):
                if not len(faces):
                    continue
                nodes, place = np.unique(faces, return_inverse=True)
                size = np.full(len(nodes), np.inf)
                np.minimum.at(size, place.reshape(faces.shape), _sizes(x[faces])[:, None])
                room = mirror.distance(system.X[nodes]) - within * size
                watched.append(Watched(mirror, faces, room, system.dofs.displacement.dofs(nodes), least))
    return watched


def mirrors_of(system: System, body: str, x: Array) -> list[Mirror]:
    """Planes of symmetry of a body that follow from supports (see `symmetry_planes`), or that its case names, and the axis.

    Only those on one side of which the body lies, its nodes and all others being at x (n, d), and where no plane of the
    description stands already; none if ``no_contact`` excepts the body.
    """
    p = system.problem
    if any(e.against == SYMMETRY and SYMMETRY not in p.tools and body in e.surface for e in p.no_contact):
        return []
    own, planes = x[system.span(body)], symmetry_planes(system, body)
    if p.space == "axisymmetric":
        axis = axis_plane(0, 0.0, 2)
        planes = [axis, *(plane for plane in planes if plane != axis)]
    for plane in map(upright, named_planes(system)):
        if not any(plane.same(known, DRAWN * system.length, DRAWN) for known in planes):
            planes.append(plane)
    out = []
    for plane in planes:
        for mirror in (Mirror(plane, side, (body,)) for side in (1.0, -1.0)):
            beside = mirror.distance(own).min() >= -NEGLIGIBLE * system.length
            if beside and not _stands(system, body, mirror, len(system.tools) - system.mirrors):
                out.append(mirror)
    return out


def _mirrors(system: System, x: Array) -> list[Mirror]:
    """The planes of all bodies (see `mirrors_of`) on which no tool stands, with those on the same side of each."""
    found: list[Mirror] = []
    for body in system.meshes:
        for mirror in mirrors_of(system, body, x):
            if _stands(system, body, mirror, len(system.tools)):
                continue
            for k, other in enumerate(found):
                if other.side == mirror.side and other.plane.same(mirror.plane, NEGLIGIBLE * system.length):
                    found[k] = replace(other, bodies=(*other.bodies, body))
                    break
            else:
                found.append(mirror)
    return sorted(found, key=lambda m: ([-n for n in m.plane.normal], m.plane.place, m.side))


def _stands(system: System, body: str, mirror: Mirror, tools: int) -> bool:
    """Whether one of the first ``tools`` that a body has contact with is a plane on a mirror, behind which it is."""
    names = list(system.tool_masters)[:tools]
    for s in system.tool_contacts:
        master = system.tool_masters[s.against]
        tool = master.tool
        if s.body != body or s.against not in names:
            continue
        if tool.description.type == "plane" and mirror.inwards @ tool.direction > 1 - NEGLIGIBLE:
            place = master.at + master.place(system.initial().u)[: len(master.at)]
            if abs(mirror.distance(place)) <= NEGLIGIBLE * system.length:
                return True
    return False


def free_faces(system: System, mirror: Mirror, body: str, x: Array) -> tuple[Index, Index]:
    """Faces (k, 4 | 6) of a body's boundary that no support holds along their normals, in the plane edges (k, 2).

    First those all nodes of which are off a mirror, then those which have all of them on it.
    """
    mesh = system.meshes[body]
    faces = mesh.boundary[~symmetric(system, body, mesh.boundary)]
    faces = (faces if isinstance(mesh, BrickMesh) else segments(faces)) + system.offsets[body]
    off = mirror.distance(x[faces]) > NEGLIGIBLE * system.length
    return faces[off.all(axis=1)], faces[~off.any(axis=1)]


# ------------------------------------------------------------------------------------------------------- with planes there
def names_of(problem: model.Problem, mirrors: Sequence[Mirror]) -> list[str]:
    """Names of the tools that stand for the planes of symmetry, none of which another tool has."""
    out: list[str] = []
    for mirror in mirrors:
        axis = mirror.plane.axis
        first, k = f"symmetry_{'n' if axis is None else 'xyz'[axis]}", 1
        name = first
        while name in problem.tools or name in out:
            k += 1
            name = f"{first}{k}"
        out.append(name)
    return out


def with_planes(guard: Guard) -> System:
    """The system of the same problem with a smooth rigid plane at every mirror, last among its tools and contacts."""
    p, mirrors = guard.system.problem, guard.mirrors
    plane, smooth = DOORS["tool"].find("plane"), DOORS["friction"].find("coulomb")(mu=0.0)
    tools, contacts, beyond = dict(p.tools), list(p.contacts), list[model.NoContact]()
    for name, mirror in zip(names_of(p, mirrors), mirrors):
        at = mirror.plane.place * np.array(mirror.plane.normal)
        tools[name] = plane(normal=tuple(mirror.inwards.tolist()), at=tuple(at.tolist()))
        contacts += [MirrorContact((body,), name, friction=smooth) for body in mirror.bodies]
        others = tuple(body for body in p.bodies if body not in mirror.bodies)
        beyond += [model.NoContact((body,), name) for body in others]
    # The planes come last, so that the numbers of all tools and contacts of the description stay what they were.
    made = replace(p, tools=tools, contacts=tuple(contacts), no_contact=(*p.no_contact, *beyond))
    system = discretise(made.with_mirrored(p.mirrored))
    return replace(system, mirrors=len(mirrors))


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
        made_from=None,  # a matrix of fewer degrees of freedom
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
    """The system that a committed state belongs to: that of the description, or the one with planes at its mirrors."""
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
