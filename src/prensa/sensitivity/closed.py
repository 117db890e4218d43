"""Closed derivatives of an increment along many directions at once: kernels where elements, materials and contacts are known.

They are the derivatives that differences with fixed active sets approach (`prensa.sensitivity.direct`), without the differences:
one pass over the elements gives what all directions do to the residual at fixed degrees of freedom, one factorisation solves for
all of them, and a second pass gives what is committed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from prensa.contact.record import ContactRecord
from prensa.friction.point import values_of
from prensa.materials.j2 import CURVE_AT
from prensa.materials.laws import J2
from prensa.measures import parse
from prensa.measures.measure import Gradient
from prensa.precision import ROUND_OFF
from prensa.result.increment import Increment
from prensa.result.results import increment_of
from prensa.sensitivity.bodies import Histories, elements_of, unfolding
from prensa.sensitivity.change import Changes
from prensa.sensitivity.contacts import Committed, Points, area_rates, strength_behind
from prensa.sensitivity.direct import Columns, Direction, Solution, handed_down, predictor_basis
from prensa.system.contact_interaction import ContactInteraction
from prensa.system.interaction import Context
from prensa.system.loads import ToolForce
from prensa.system.outcome import NewtonResult
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array

Arrays = dict[str, Array]


CONTACT = tuple(f"contact.{f.name}" for f in fields(ContactRecord) if f.name not in ("closed", "time"))


def covers(c: Context) -> bool:
    """Whether closed derivatives know all that acts in an increment: motions, forces on tools, friction stated for a point."""
    loads = all(isinstance(i, ContactInteraction | ToolForce) for i in c.interactions)
    laws = all(law is None or law.is_of_point for law in c.laws)
    return loads and c.plan.control is None and laws and all(map(_strength_is_known, _asking(c)))


def _asking(c: Context) -> list[object]:
    """Laws of the bodies whose shear yield stress friction asks for."""
    contacts = [i for i in c.interactions if isinstance(i, ContactInteraction)]
    asking = [i for i in contacts if (law := c.laws[i.number]) is not None and law.asks_for_k]
    return [b.law for i in asking for b in i.system.blocks if b.body == i.surface.body]


def _strength_is_known(law: object) -> bool:
    return isinstance(law, J2) and law.flow is not None


class Prescribed(NamedTuple):
    """What directions (d) change of the plan of a step at a time: those ``moved`` (m,) motions and forces, all the friction.

    motion, force (ndof, m); ``laws`` (n, d): numbers of the laws, by contact.
    """

    moved: list[int]
    motion: Array
    force: Array
    laws: list[Array]


def prescribed(c: Context, before: Bundle) -> Prescribed:
    """Of the plans of both sides of each direction."""
    if before.step is None or before.step[0] != c.plan.number:
        laws = [np.zeros((0 if law is None else len(values_of(law).numbers), len(before.directions))) for law in c.laws]
        for k, d in enumerate(before.directions):
            for out, p, q in zip(laws, *(plan.friction for plan in d.plans(c))):
                if len(out) and p != q:
                    out[:, k] = d.difference(values_of(p).numbers, values_of(q).numbers)
        before.step = c.plan.number, laws, [k for k, d in enumerate(before.directions) if not d.leaves_motions(c)]
    _, laws, moved = before.step
    motion, force = np.zeros((2, len(before.arrays["u"]), len(moved)))
    for k, number in enumerate(moved):
        d = before.directions[number]
        a, b = d.plans(c)
        motion[c.plan.fixed, k] = d.difference(a.values(c.time), b.values(c.time))
        for dof, amplitude in a.push.items():
            force[dof, k] = (amplitude(c.time) - b.push[dof](c.time)) / (2.0 * d.step)
    return Prescribed(moved, motion, force, laws)


@dataclass
class Bundle:
    """Derivatives of committed states along directions, the last axis of each array.

    ``histories`` (e, q, h, s) by block and group of s directions; ``arrays``: all else that is carried.
    ``sizes`` (d,) of the parameters; ``changes``: what these change of the system; ``step``: the number of the last step, numbers
    (n, d) of its laws of friction by contact, which directions change its motions or forces; ``rooms`` for histories, by block.
    """

    directions: tuple[Direction, ...]
    sizes: Array
    changes: Changes
    arrays: Arrays
    histories: list[list[Array]]
    rooms: list[Histories]
    step: tuple[int, list[Array], list[int]] | None = None

    @classmethod
    def of(cls, directions: Sequence[Direction]) -> Bundle:
        """What the directions carry, all of which the closed derivatives know."""
        system = directions[0].systems[0]
        sizes = np.array([d.parameter.size for d in directions])
        changes = Changes.of([d.change for d in directions if d.change is not None])
        names = [f"history_{k}" for k in range(len(system.blocks))]
        own = [
            [np.stack([d.carried[name] for d in directions[g.first : g.first + g.size]], axis=-1) for g in changes.groups]
            for name in names
        ]
        # what only some carry comes from steps in which forces are released, of which closed derivatives know nothing
        common = [name for name in directions[0].carried if name not in names and all(name in d.carried for d in directions)]
        arrays = {name: np.stack([d.carried[name] for d in directions], axis=-1) for name in common}
        return cls(tuple(directions), sizes, changes, arrays, own, [Histories() for _ in system.blocks])

    def is_of(self, directions: Sequence[Direction]) -> bool:
        """Whether it is what these carry now: after a step of differences, where forces are released, it is out of date."""
        handed_on = (isinstance(d.carried, LaneOfArrays) and d.carried.arrays is self.arrays for d in directions)
        return self.directions == tuple(directions) and all(handed_on)

    def mixed(self, shares: Array) -> Arrays:
        """What a direction carries that goes along each of these by ``shares`` (d,)."""
        out = {name: np.asarray(a @ shares) for name, a in self.arrays.items()}
        for k, groups in enumerate(self.histories):
            out[f"history_{k}"] = np.zeros(groups[0].shape[:-1])
            for group, some in zip(self.changes.groups, groups):
                own = shares[group.first : group.first + group.size]
                out[f"history_{k}"] += (some.reshape(-1, len(own)) @ own).reshape(some.shape[:-1])
        return out

    def hand_on(self) -> None:
        """Let each direction carry its own."""
        for number, group in enumerate(self.changes.groups):
            own = {f"history_{b}": groups[number] for b, groups in enumerate(self.histories)}
            for lane in range(group.size):
                self.directions[group.first + lane].carried = LaneOfArrays(self.arrays, group.first + lane, own, lane)


class LaneOfArrays(Mapping[str, Array]):
    """What one of many directions carries: direction number k of ``arrays``, and the ``lane`` of histories that it has there.

    Parts are taken when they are asked for: most are in none but the last increment.
    """

    __slots__ = ("arrays", "histories", "k", "lane")

    def __init__(self, arrays: Arrays, k: int, histories: Arrays, lane: int) -> None:
        self.arrays, self.k, self.histories, self.lane = arrays, k, histories, lane

    def __getitem__(self, name: str) -> Array:
        """The part of this direction."""
        if name in self.arrays:
            return self.arrays[name][..., self.k]
        return self.histories[name][..., self.lane]

    def __iter__(self) -> Iterator[str]:
        """Names of what is carried."""
        yield from self.arrays
        yield from self.histories

    def __len__(self) -> int:
        """How many they are."""
        return len(self.arrays) + len(self.histories)


@dataclass
class Closed:
    """Derivatives of an increment: of the dofs ``x``, the residual ``reaction``, the loads ``force`` (ndof, d), contacts."""

    x: Array
    reaction: Array
    force: Array
    points: list[Points]
    _slopes: tuple[Gradient, Array] | None = None

    def slopes(self, of: Gradient, system: System) -> Array:
        """Derivatives (d,) of a measure that is a linear map of motions and forces; those of the last one asked for are kept."""
        if self._slopes is None or self._slopes[0] is not of:
            dofs, slopes = of.displacements(system)
            out = slopes @ self.x[dofs]
            for dof, slope in zip(*of.reactions(system)):
                if slope == 0.0:
                    continue
                out += slope * sum(p.F[p.surface.dofs == dof].sum(axis=0) for p in self.points)
            self._slopes = of, out
        return self._slopes[1]


def differentiate(at: Solution, columns: Columns, before: Bundle, state: State) -> tuple[Bundle, Closed]:
    """What is committed of an increment that led to ``state``, and its derivatives; directions that move bodies come last."""
    system, c, carried, changes = at.system, at.c, before.arrays, before.changes
    elements = elements_of(system, c, at.u, at.e, before.rooms)
    given = prescribed(c, before)
    m, first = len(before.sizes), system.dofs.displacement.slice
    dxn = carried["u"][first].reshape(-1, 2, m)
    if len(changes.X):
        dxn = dxn + changes.X
    force = np.zeros((system.ndof, m))
    force[:, given.moved] = given.force
    r = -force
    for k, b in enumerate(elements):
        b.forces_along(changes, k, dxn, before.histories[k], r)
    unfolding(system, c, at.u, changes.each, r)
    points, x_now = [], system.positions(at.u)
    for k, (s, f) in enumerate(zip(c.surfaces, at.e.contacts)):
        was = _committed_contact(at, before, k, dxn, given.laws[k])
        points.append(Points.of(c, k, f, was, carried["lam"][s.rows].copy(), at.u, x_now, r))
    if given.moved:
        r[:, given.moved] += columns.times(given.motion)
    # By changes of each parameter's own size, so that one tolerance judges columns of all units.
    left = -before.sizes * r
    x = columns.initial_guess(left, predictor_basis(carried, c.plan.fixed))
    x = (x + columns.solve(left)) / before.sizes
    x[:, given.moved] += given.motion
    reaction = left / -before.sizes  # r + K x
    moved = x[first].reshape(-1, 2, m)
    bodies = [b.histories_along(changes, k, dxn, moved, before.histories[k]) for k, b in enumerate(elements)]
    for b, volumes, (_, energy) in zip(elements, changes.volume, bodies):
        b.in_volumes(volumes, energy[:, m - volumes.shape[-1] :])
    for p in points:
        p.follow(x, moved)
    found = Closed(x, reaction, force, points)
    after = _carried_on(at, before, found, np.sum([b[1] for b in bodies], axis=0), state)
    return replace(before, arrays=after, histories=[b[0] for b in bodies]), found


def _committed_contact(at: Solution, before: Bundle, k: int, dxn: Array, law: Array) -> Committed:
    """Contact number k as an increment begins, with nodes that move by dxn (n, 2, d) and numbers (n, d) of its law."""
    system, c, changes = at.system, at.c, before.changes
    s = c.surfaces[k]
    names = ("area", "slip", "speed", "coordinate", "traction")
    area_was, slip, speed, coordinate, traction = (before.arrays[f"contact.{name}"][s.rows] for name in names)
    if c.through_air is not None:
        # Where a tool lands depends on the parameter: slip is counted from that place.
        coordinate = np.stack([d.coordinates(at, k) for d in before.directions], axis=-1)
    area, strong = area_rates(s.points, c.x_n, dxn), _strengths(system, c, k, before)
    place = changes.place[system.tool_masters[s.against].number]
    return Committed(slip, area, area_was, strong, speed, coordinate, traction, changes.scale[k], law, place, changes.X)


def _strengths(system: System, c: Context, number: int, before: Bundle) -> Array:
    """Rates (k, d) of the shear yield stresses that the law of a contact asks for, as an increment begins; else 0."""
    s, law = c.surfaces[number], c.laws[number]
    if law is None or not law.asks_for_k:
        return np.zeros((len(s.points), len(before.sizes)))
    block, found = strength_behind(system, c, s)
    rates = np.zeros((len(found.k), len(before.sizes)))
    for g, old in zip(before.changes.groups, before.histories[block]):
        own, change = rates[:, g.first : g.first + g.size], old[s.behind][:, :, :5]
        own += np.einsum("nh,nhd->nd", found.by_history, change.reshape(len(rates), 5, -1))
        own += found.by_scalars @ g.p[block][CURVE_AT:]
        knots, coefficients = g.tables[block]
        own += np.einsum("ni,nid->nd", found.powers, coefficients[found.piece]) + found.by_knot[:, None] * knots[found.piece]
    return system.at_points(s, rates.reshape(len(s.behind), -1, rates.shape[1]).mean(axis=1))


def _carried_on(at: Solution, before: Bundle, found: Closed, stored: Array, state: State) -> Arrays:
    """The derivatives of the committed state but for histories; ``stored`` (2, d): of what bodies store, of plastic work."""
    c, was = at.c, before.arrays
    x, m = found.x, len(before.sizes)
    work = found.force.copy()
    work[c.plan.fixed] += found.reaction[c.plan.fixed]
    out: Arrays = {"u": x} | handed_down(was)
    out |= {k: was[k].copy() for k in (*CONTACT, "lam")}
    for k, p in enumerate(found.points):
        rows = p.surface.rows
        out["contact.traction"][rows, 0], out["contact.slip"][rows] = p.t, p.kappa
        out["contact.coordinate"][rows, 0], out["contact.area"][rows] = p.s, p.area
        out["contact.speed"][rows] = (p.kappa - p.before.slip) / c.seconds
        out["contact.path"][rows] += _slid(p, k, c, at.u)
        out["lam"][rows, 0], out["lam"][rows, 1] = p.p, p.t
    energy = _energies(at, before, found, x, work, stored, state)
    out |= {f"energy.{k}": v for k, v in energy.items()}
    out["tool_work"] = _work_of_tools(at, before, x, work, state)
    out["tool_wear"] = _wear_of_tools(at, before, found.points)
    out |= {"work": work, "step_start": x if c.ends_step else was["step_start"]}
    return out | {k: np.zeros(m) for k in was if k.startswith("stability.")}


def _slid(p: Points, number: int, c: Context, u: Array) -> Array:
    """Derivatives (k, d) of what `ContactForces.slid` adds to paths in an increment to u (ndof,), contact number *number*."""
    if c.laws[number] is not None:
        return p.kappa - p.before.slip
    way = np.einsum("ktm,km->k", p.f.stencils.ds, (u - c.state.u)[p.f.stencils.dofs])
    return np.where(p.f.p > 0, np.sign(way), 0.0)[:, None] * (p.s - p.before.coordinate[:, 0])


def _work_of_tools(at: Solution, before: Bundle, u: Array, work: Array, state: State) -> Array:
    """Derivatives (tools, d) of the work of the tools in a step, as `prensa.result.energy_balance.tool_work` counts it."""
    was, old, count = before.arrays, at.c.state, len(at.system.tools)
    way, ways = _ways(at, before, u, state)
    each = 0.5 * ((was["work"] + work) * way[:, None] + (old.work + state.work)[:, None] * ways)
    done = each[at.system.dofs.tool.dofs(np.arange(count))].sum(axis=1)
    return done + was["tool_work"] if old.clock.time > at.c.plan.t0 and len(old.tool_work) == count else done


def _wear_of_tools(at: Solution, before: Bundle, points: Sequence[Points]) -> Array:
    """Derivatives (tools, d) of normal force times way of slip, as `prensa.result.energy_balance.tool_wear` counts it."""
    was, number = before.arrays["tool_wear"], {tool.name: k for k, tool in enumerate(at.system.tools)}
    out = was.copy() if len(was) == len(number) else np.zeros((len(number), len(before.sizes)))
    for p, committed in zip(points, at.c.committed):
        if p.surface.against in number:
            f, way = p.f, p.f.kappa - committed.slip
            force = f.weight[:, None] * p.p + f.p[:, None] * p.before.area
            out[number[p.surface.against]] += way @ force + (f.weight * f.p) @ (p.kappa - p.before.slip)
    return out


def _ways(at: Solution, before: Bundle, u: Array, state: State) -> tuple[Array, Array]:
    """Motions (ndof,) against forces in an increment, without those through air, and their derivatives (ndof, d)."""
    way, ways = state.u - at.c.state.u, u - before.arrays["u"]
    if at.c.through_air is not None:
        way, ways = way - at.c.through_air, ways - np.stack([d.through_air(at) for d in before.directions], axis=-1)
    return way, ways


def _energies(at: Solution, before: Bundle, found: Closed, u: Array, work: Array, stored: Array, state: State) -> Arrays:
    """Derivatives (d,) of the energy balance, term by term as in `prensa.result.energy_balance`; u, work (ndof, d)
    as committed.
    """
    was, old = before.arrays, at.c.state
    way, ways = _ways(at, before, u, state)
    external = was["energy.external"] + 0.5 * (way @ (was["work"] + work))
    external += 0.5 * (old.work + state.work) @ ways
    (elastic, plastic), friction, contact = stored, was["energy.friction"].copy(), np.zeros(len(before.sizes))
    for p in found.points:
        friction += p.friction
        # Multipliers have no springs that hold energy.
        contact += 0.0 if p.surface.exact else p.stored
    viscous = was["energy.viscous"]
    spent = elastic + plastic + friction + contact + viscous
    freed = state.energy.external - old.energy.external - 0.5 * float(way @ (old.work + state.work))
    least = ROUND_OFF * abs(state.energy.external)
    if not old.clock.number and freed > least and abs(state.energy.imbalance) <= least:
        external = spent  # the work of tools that begin inside bodies is what the balance asks for
    imbalance = external - spent
    names = ("external", "elastic", "plastic", "friction", "contact", "imbalance", "viscous")
    return dict(zip(names, (external, elastic, plastic, friction, contact, imbalance, viscous)))


class Beside(NamedTuple):
    """The increment beside the one at hand, a step along one of its closed derivatives: made when somebody looks at it."""

    system: System
    d: Direction
    sign: float
    number: int
    at: Solution
    found: Closed

    @property
    def step(self) -> float:
        """How far it is beside."""
        return self.d.step

    def slope(self, of: Gradient) -> float | None:
        """The derivative of a measure that is a linear map of motions and forces; None of places that begin elsewhere."""
        assert self.d.change is not None
        if self.d.change.moves and (of.nodes or of.places):
            return None
        return float(self.found.slopes(of, self.at.system)[self.number])

    def increment(self, before: State, state: State, ended: bool) -> Increment:
        """What users see of it, with the committed states that it led from and to."""
        c, step, found, k = self.at.c, self.sign * self.d.step, self.found, self.number
        plan = self.d.plans(c)[0 if self.sign > 0 else 1]
        contacts = []
        for p in found.points:
            f, s = p.f, self.system.surfaces[self.at.c.surfaces.index(p.surface)]
            stencils = self.system.stencils(s, state.u, before)._replace(s=f.s + step * p.s[:, k, None])
            weight, area = f.weight + step * p.before.area[:, k], f.area + step * p.area[:, k]
            contacts.append(
                f._replace(
                    stencils=stencils, p=f.p + step * p.p[:, k], t=f.t + step * p.t[:, k, None],
                    kappa=f.kappa + step * p.kappa[:, k],
                    F=f.F + step * p.F[:, :, k], weight=weight, area=area, points=s.points,
                )
            )  # fmt: skip
        e = self.at.e._replace(
            r=self.at.e.r + step * found.reaction[:, k], f_ext=self.at.e.f_ext + step * found.force[:, k],
            contacts=tuple(contacts), history=state.history,
        )  # fmt: skip
        result = NewtonResult(True, None, state.u, None, state.lam, 0)
        return increment_of(self.system, state, plan, e, result, 0, 0, ended, before, parse=parse)
