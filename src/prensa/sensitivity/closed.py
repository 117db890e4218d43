"""Closed derivatives of an increment along many directions at once: kernels where elements, materials and contacts are known.

They are the derivatives that differences with held branches approach (`prensa.sensitivity.direct`), without the differences: one
pass over the elements gives what all directions do to the residual at fixed degrees of freedom, one factorisation solves for
all of them, and a second pass gives what is committed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import ContactForces
from prensa.contact.record import ContactRecord
from prensa.elements.q4_directions import slots
from prensa.fem.context import Context
from prensa.fem.loads import ToolForce
from prensa.fem.state import Stability, State
from prensa.fem.surface import ContactInteraction
from prensa.fem.system import System
from prensa.friction.laws.coulomb import Coulomb
from prensa.measures.measure import Gradient
from prensa.sensitivity.bodies import elements_of, unfolding
from prensa.sensitivity.change import Change
from prensa.sensitivity.contacts import Committed, Points
from prensa.sensitivity.direct import BEFORE, LAST, Columns, Direction, Solution, onwards
from prensa.solver.equilibrium import NewtonResult
from prensa.solver.increment import Increment
from prensa.solver.results import increment_of

Array = NDArray[np.float64]
Arrays = dict[str, Array]


CONTACT = tuple(f"contact.{f.name}" for f in fields(ContactRecord) if f.name != "closed")


def covers(c: Context) -> bool:
    """Whether the closed derivatives know all that acts in an increment: motions, forces on tools, constant coefficients."""
    loads = all(isinstance(i, ContactInteraction | ToolForce) for i in c.interactions)
    return loads and c.plan.control is None and all(law is None or _constant(law) for law in c.laws)


def _constant(law: Any) -> bool:
    return isinstance(law, Coulomb) and not law.hardens


class Prescribed(NamedTuple):
    """What directions (d) change of the plan of a step at a time: motions (ndof, d), forces (ndof, d), μ (d, contacts)."""

    motion: Array
    force: Array
    mu: Array


def prescribed(c: Context, directions: Sequence[Direction], n: int) -> Prescribed:
    """Of the plans of both sides of each direction."""
    out = Prescribed(np.zeros((n, len(directions))), np.zeros((n, len(directions))), np.zeros((len(directions), len(c.laws))))
    for k, d in enumerate(directions):
        if d.leaves_plan(c):
            continue
        a, b = d.plans(c)
        out.motion[c.plan.fixed, k] = d.difference(a.values(c.time), b.values(c.time))
        for dof, course in a.push.items():
            out.force[dof, k] = (course(c.time) - b.push[dof](c.time)) / (2.0 * d.step)
        for i, (law, p, q) in enumerate(zip(c.laws, a.friction, b.friction)):
            out.mu[k, i] = 0.0 if law is None else (p.mu - q.mu) / (2.0 * d.step)
    return out


@dataclass
class Bundle:
    """Derivatives of committed states along directions, the last axis of each array, where histories have ``slots``."""

    directions: tuple[Direction, ...]
    arrays: Arrays
    slots: list[int]

    @classmethod
    def of(cls, directions: Sequence[Direction]) -> Bundle:
        """What the directions carry; those that move bodies come last."""
        first, moving = directions[0].carried, sum(d.change is not None and d.change.X is not None for d in directions)
        at, width = slots(len(directions), moving)
        arrays = {}
        for name in first:
            stacked = np.stack([d.carried[name] for d in directions], axis=-1)
            if name.startswith("history_"):
                arrays[name] = np.zeros((*stacked.shape[:-1], width))
                arrays[name][..., at] = stacked
            else:
                arrays[name] = stacked
        return cls(tuple(directions), arrays, at)

    def hand_on(self) -> None:
        """Let each direction carry its own."""
        for k, d in enumerate(self.directions):
            d.carried = {n: a[..., self.slots[k] if n.startswith("history_") else k] for n, a in self.arrays.items()}


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
            out, tools = slopes @ self.x[dofs], system.dofs.tool
            for dof, slope in zip(*of.reactions(system)):
                tool, axis = divmod(int(dof) - tools.first, tools.width)
                out += slope * sum(p.F[:, :, 2 + axis].sum(axis=1) for p in self.points if p.surface.tool == tool)
            self._slopes = of, out
        return self._slopes[1]


def differentiate(
    at: Solution, columns: Columns, before: Bundle, changes: Sequence[Change], state: State
) -> tuple[Bundle, Closed]:
    """What is committed of an increment that led to ``state``, and its derivatives; ``changes`` that move bodies come last."""
    system, c, carried = at.system, at.c, before.arrays
    elements = elements_of(system, c, at.u, at.e)
    given = prescribed(c, before.directions, system.ndof)
    m, first = len(changes), system.dofs.displacement.slice
    du = carried["u"][first].reshape(-1, 2, m)
    X = None if all(ch.X is None for ch in changes) else _places(changes, du.shape)
    dxn = du if X is None else du + X
    still = sum(ch.X is None for ch in changes)
    dx = np.empty((len(du), 2, 0)) if X is None else np.ascontiguousarray(X[..., still:])
    r = -given.force
    bodies = [b.at_fixed(changes, k, dxn, dx, carried[f"history_{k}"], r) for k, b in enumerate(elements)]
    unfolding(system, c, at.u, changes, r)
    points = [Points.of(c, k, f, _committed(at, k, f, carried, changes, dxn, X, given)) for k, f in enumerate(at.e.contacts)]
    for p in points:
        p.add_to(r)
    sizes = np.array([d.parameter.size for d in before.directions])
    if given.motion.any():
        r += columns.times(given.motion)
    x, left = columns.begun(-sizes * r, onwards(carried, c.plan.fixed))
    x = (x + columns.solve(left)) / sizes
    r, x = r + columns.times(x), x + given.motion
    nodal = x[first].reshape(-1, 2, m)
    for b, (dnew, energy) in zip(elements, bodies):
        b.along(nodal, dnew, energy, dx.shape[2])
    for p in points:
        p.follow(system, x)
    found = Closed(x, r, given.force, points)
    after = _carried_on(at, before, found, [b[0] for b in bodies], sum(b[1] for b in bodies), state, changes)
    return Bundle(before.directions, after, before.slots), found


def _places(changes: Sequence[Change], shape: tuple[int, ...]) -> Array:
    out = np.zeros(shape)
    for k, ch in enumerate(changes):
        if ch.X is not None:
            out[:, :, k] = ch.X
    return out


def _committed(
    at: Solution, k: int, f: ContactForces, carried: Arrays, changes: Sequence[Change], dxn: Array, X: Array | None,
    given: Prescribed,
) -> Committed:  # fmt: skip
    """What directions change of contact number k before the increment; dxn, X (n, 2, d): of committed, initial places."""
    c, s, m = at.c, at.c.surfaces[k], len(changes)
    scale = np.stack([ch.scale[k] for ch in changes])
    lam = np.moveaxis(carried["lam"][s.rows], -1, 0).copy()
    lam[:, :, 0] = 0.0
    if s.multipliers is not None:
        lam = scale[:, 2, :, None] * s.multipliers.of(at.u)
    shares = s.points.shares
    growth = np.einsum("saxd,sax->ds", dxn[s.points.edges[shares.edge]], s.points.slopes(c.x_n))
    area = np.empty((m, len(s.points)))
    for out, parts in zip(area, growth):
        out[:] = np.bincount(shares.point, parts, len(out))
    q = None
    if X is not None or any(ch.at.any() for ch in changes):
        q = np.zeros((m, len(s.points), 5))
        if X is not None:
            q[:, :, :2] = np.einsum("kaxd,ka->dkx", X[s.points.support], s.points.N)
        q[:, :, 2:4] = np.stack([ch.at[s.tool] for ch in changes])[:, None]
    slip, coordinate = carried["contact.slip"][s.rows].T, carried["contact.coordinate"][s.rows, 0].T
    return Committed(lam, slip, coordinate, area, scale[:, 0], scale[:, 1], given.mu[:, k], q)


def _carried_on(
    at: Solution, before: Bundle, found: Closed, histories: list[Array], elastic: Any, state: State, changes: Sequence[Change]
) -> Arrays:  # fmt: skip
    """The derivatives of the committed state."""
    c, was = at.c, before.arrays
    x, m = found.x, len(changes)
    work = found.force.copy()
    work[c.plan.fixed] += found.reaction[c.plan.fixed]
    out: Arrays = {"u": x, LAST: was["u"], BEFORE: was[LAST]} | {f"history_{k}": h for k, h in enumerate(histories)}
    out |= {k: was[k].copy() for k in (*CONTACT, "lam")}
    for p in found.points:
        rows = p.surface.rows
        out["contact.traction"][rows, 0], out["contact.slip"][rows] = p.t.T, p.kappa.T
        out["contact.coordinate"][rows, 0] = p.s.T
        out["contact.speed"][rows] = (p.kappa - p.before.kappa).T / c.seconds
        out["lam"][rows, 0], out["lam"][rows, 1] = p.p.T, p.t.T
    energy = _energies(at, before, found, out | {"work": work}, elastic, state, changes)
    out |= {f"energy.{k}": v for k, v in energy.items()}
    out |= {"work": work, "step_start": x if c.ends_step else was["step_start"]}
    return out | {f"stability.{k}": np.zeros(m) for k in Stability._fields if k != "negative"}


def _energies(
    at: Solution, before: Bundle, found: Closed, now: Arrays, elastic: Array, state: State, changes: Sequence[Change]
) -> Arrays:
    """Derivatives (d,) of the ledger of energies, term by term as in `prensa.solver.ledger`."""
    system, was, old = at.system, before.arrays, at.c.state
    external = was["energy.external"] + 0.5 * ((state.u - old.u) @ (was["work"] + now["work"]))
    external += 0.5 * (old.work + state.work) @ (now["u"] - was["u"])
    plastic, friction, contact = np.zeros(len(changes)), was["energy.friction"].copy(), np.zeros(len(changes))
    for k, b in enumerate(system.blocks):
        if b.law.plastic:
            plastic += np.einsum("eqs,eq->s", now[f"history_{k}"][:, :, 5], b.volume)[before.slots]
        moving = [d for d, ch in enumerate(changes) if ch.X is not None]
        density = b.law.energy(b.at_law(state.history[k])) if moving else np.zeros(0)
        for d in moving:
            elastic[d] += np.vdot(changes[d].volume[k], density)
            if b.law.plastic:
                plastic[d] += np.vdot(changes[d].volume[k], state.history[k][..., 5])
    for p in found.points:
        rows, f, by = p.surface.rows, p.f, p.before
        t0, t1 = old.contact.traction[rows, 0], f.t[:, 0]
        total = np.abs(t0) + np.abs(t1)
        change = np.sign(t0) * was["contact.traction"][rows, 0].T + np.sign(t1) * p.t
        friction += 0.5 * ((by.area * total + f.weight * change) * p.slid + f.weight * total * (p.kappa - by.kappa)).sum(axis=1)
        if not p.surface.exact:
            for value, rate, k_, dk in ((f.p, p.p, p.scale.k_n, by.k_n), (t1, p.t, p.scale.k_t, by.k_t)):
                stored = 0.5 * (by.area - f.weight * dk / k_) * value**2 + f.weight * value * rate
                contact += (stored / k_).sum(axis=1)
    viscous = was["energy.viscous"]
    imbalance = external - (elastic + plastic + friction + contact + viscous)
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
            pairs = self.system.pairs(s, state.u, before)._replace(s=f.s + step * p.s[k][:, None])
            area = f.weight + step * p.before.area[k]
            contacts.append(
                f._replace(
                    pairs=pairs, p=f.p + step * p.p[k], t=f.t + step * p.t[k][:, None], kappa=f.kappa + step * p.kappa[k],
                    F=f.F + step * p.F[k], weight=area, area=area, points=s.points,
                )
            )  # fmt: skip
        e = self.at.e._replace(
            r=self.at.e.r + step * found.reaction[:, k], f_ext=self.at.e.f_ext + step * found.force[:, k],
            contacts=tuple(contacts), history=state.history,
        )  # fmt: skip
        result = NewtonResult(True, None, state.u, None, state.lam, 0)
        return increment_of(self.system, state, plan, e, result, 0, 0, ended, before)
