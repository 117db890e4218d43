"""Direct differentiation of committed increments: r(u, p, h_n) = 0 along a parameter, with all branches held.

The derivative u′ of the dofs solves K u′ = −∂r, where ∂r is what the residual does when the parameter and with it the committed
state change and the free dofs do not; the derivative of what is committed follows from u′ and goes into the next increment
(Michaleris, Tortorelli and Vidal 1994). ∂r and the derivative of the histories are central differences of the residual, in
which contact points stay open or closed and stuck or slipping, and material points plastic or elastic, as in the increment
itself: between these kinks the residual is smooth, and the differences are those of any law, element and tool there is.
Pressures and tangential tractions are not differenced where displacements change: their gaps times the penalty stiffness
would be round-off. Their changes are those of the matrix.
"""

from __future__ import annotations

import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from prensa.contact.forces import ContactForces
from prensa.contact.record import magnitude
from prensa.contact.surface import Surface
from prensa.friction.law import FrictionLaw
from prensa.friction.point import values_of
from prensa.linear.reduction import Reduced
from prensa.linear.rigid_modes import loose_bodies
from prensa.measures import parse
from prensa.measures.measure import Gradient
from prensa.policy import Policy
from prensa.result.increment import Increment
from prensa.result.results import increment_of
from prensa.sensitivity.change import Change, change_of, known, places_matter
from prensa.sensitivity.combinations import basis_columns, combined, nearest, sums
from prensa.sensitivity.parameters import Parameter, neighbours
from prensa.solver.approach import approach_of_bodies, approach_of_tools
from prensa.solver.commit import committed
from prensa.solver.stabilisation import Stabilisation
from prensa.system.assembly import Pattern, scatter_vector
from prensa.system.interaction import ActiveSets, Context
from prensa.system.outcome import NewtonResult
from prensa.system.planning import plan_step
from prensa.system.release import release_forces
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.system import Evaluation, System
from prensa.types import Array, Index

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix


DROPPED = np.zeros(0)
# Three increments with the present one: six save one substitution in twenty, for twice the products and sums.
EARLIER = ("u_last", "u_before")
"""What carries the derivatives of the dofs one, two … increments earlier, from which the next ones are predicted."""
PAST = ("u", *EARLIER)


def predictor_basis(carried: Mapping[str, Array], fixed: Index) -> Array:
    """Of what d derivatives of the free dofs after an increment are expected to consist (ndof, k d), zero at the prescribed ones.

    That is those carried, how they change, how that changes, and so on.
    """
    # of one direction they may be its column among others, or not: the kernel is for rows that follow each other
    past = tuple(a if a.ndim == 2 else np.ascontiguousarray(a)[:, None] for a in (carried[name] for name in PAST))
    out = np.empty((len(past[0]), len(past) * past[0].shape[1]))
    basis_columns(past, fixed, out)
    return out


def handed_down(carried: Mapping[str, Array]) -> dict[str, Array]:
    """The `EARLIER` derivatives of the dofs after an increment that began with those carried."""
    return {name: carried[before] for name, before in zip(EARLIER, PAST)}


@dataclass
class Solution:
    """A converged increment: its context, dofs u (ndof,), evaluation with its matrix."""

    system: System
    c: Context
    u: Array
    e: Evaluation

    @cached_property
    def active_sets(self) -> ActiveSets:
        """Sides of the kinks on which its points are, for those that look beside it."""
        return self.system.active_sets(self.c, self.e)


class Side(NamedTuple):
    """An increment with the parameter a step to one side: its context, dofs u (ndof,), multipliers lam, evaluation there.

    ``pushed`` (points, 1 + t): multipliers in the evaluation that lam has not, see `Direction.at_fixed_dofs`.
    """

    c: Context
    u: Array
    lam: Array
    e: Evaluation
    pushed: Array


class Neighbour(NamedTuple):
    """What the increment a ``step`` beside has that does not follow from the committed state: its system, plan and forces."""

    system: System
    plan: StepPlan
    e: Evaluation
    step: float

    def slope(self, of: Gradient) -> float | None:
        """None: the derivative of a measure is not at hand without the measure in both increments beside."""
        return None

    def increment(self, before: State, state: State, ended: bool) -> Increment:
        """What users see of it, with the committed states that it led from and to."""
        result = NewtonResult(True, None, state.u, None, state.lam, 0)
        e = self.e._replace(history=state.history)
        return increment_of(self.system, state, self.plan, e, result, 0, 0, ended, before, parse=parse)


@dataclass
class _StepBeside:
    """The ``plans`` of a step, by its ``number``, with a parameter a step above and below."""

    number: int
    plans: tuple[StepPlan, StepPlan]

    @cached_property
    def leaves_motions(self) -> bool:
        """Whether both are the same but for friction."""
        above, below = self.plans
        return above is below or pickle.dumps(vars(above) | {"friction": None}) == pickle.dumps(vars(below) | {"friction": None})

    @cached_property
    def leaves_laws(self) -> bool:
        """Whether both take the same time, and laws of friction differ in numbers alone."""
        above, below = self.plans
        return above.seconds == below.seconds and all(map(alike, above.friction, below.friction))


@dataclass
class Direction:
    """A parameter: the systems a ``step`` above and below it, and the derivative of the committed state by it."""

    parameter: Parameter
    step: float
    systems: tuple[System, System]
    stabilisations: tuple[Stabilisation, Stabilisation]
    carried: Mapping[str, Array]
    change: Change | None = None
    """What it changes of the system, where the closed derivatives know of it; None: differences are taken."""
    _step: _StepBeside | None = None

    @classmethod
    def of(cls, system: System, path: str, share: float, policy: Policy, start: State) -> Direction:
        """The parameter at a path, with steps of a ``share`` of its size, from the state a run begins with."""
        parameter = Parameter.of(system.problem, path, system.length)
        step = share * parameter.size
        systems = parameter.neighbours(system, step)
        viscous = Stabilisation(systems[0], policy), Stabilisation(systems[1], policy)
        change = change_of(*systems, step) if known(system) else None
        if path in start.derivatives:
            stored = start.derivatives[path]  # one that was stored before may know fewer of the `EARLIER`
            return cls(parameter, step, systems, viscous, dict.fromkeys(EARLIER, stored["u"]) | dict(stored), change)
        if change is not None and not change.moves and not places_matter(system):  # the run begins where it did
            carried = {k: np.zeros(a.shape) for k, a in system.initial().moving().items()}
        else:
            above, below = (s.initial().moving() for s in systems)
            carried = {k: (a - below[k]) / (2 * step) for k, a in above.items()}
        return cls(parameter, step, systems, viscous, carried | dict.fromkeys(EARLIER, carried["u"]), change)

    @classmethod
    def together(cls, system: System, parameters: Sequence[Parameter], shares: Array, policy: Policy) -> Direction:
        """The direction in which parameters change by ``shares`` (d,) of their sizes; what it carries is left to be said.

        Raises
        ------
        PrensaError
            If they cannot be varied together.

        """
        step = policy.parameter_step_ratio
        systems = neighbours(system, parameters, [step * share * p.size for p, share in zip(parameters, shares)])
        viscous = Stabilisation(systems[0], policy), Stabilisation(systems[1], policy)
        return cls(Parameter("all of them", 1.0, 1.0), step, systems, viscous, {})

    @property
    def sides(self) -> tuple[tuple[float, System, Stabilisation], ...]:
        """Sign, system and viscous forces of both sides."""
        return ((1.0, self.systems[0], self.stabilisations[0]), (-1.0, self.systems[1], self.stabilisations[1]))

    def difference(self, above: Array, below: Array) -> Array:
        """Derivative of what differs between both sides."""
        return (above - below) / (2.0 * self.step)

    def plans(self, c: Context) -> tuple[StepPlan, StepPlan]:
        """Plans of both sides for the step of an increment; they begin where the step did."""
        return self._in_step(c).plans

    def _in_step(self, c: Context) -> _StepBeside:
        """Both sides of the step of an increment, found once a step."""
        if self._step is None or self._step.number != c.plan.number:
            self._step = _StepBeside(c.plan.number, (c.plan, c.plan) if self._keeps_plan(c) else self._planned(c))
        return self._step

    def _keeps_plan(self, c: Context) -> bool:
        """Whether the step of an increment has the same plan on both sides as in it: a number of a body, and all begins alike."""
        plan, way = c.plan, self.carried["step_start"]
        same = self.parameter.path.startswith("bodies.") and not plan.released and plan.control is None
        return same and not any(way[g.dofs].any() or g.found for g in plan.groups) and self._same_axis

    @cached_property
    def _same_axis(self) -> bool:
        """Whether the same nodes lie on the axis of revolution on both sides."""
        above, below = self.systems
        return np.array_equal(above.axis_nodes, below.axis_nodes)

    def _planned(self, c: Context) -> tuple[StepPlan, StepPlan]:
        old, way = c.state, self.carried["step_start"]
        above, below = (
            plan_step(system, c.plan.number, old.step_start + sign * self.step * way, old.ends)
            for sign, system, _ in self.sides
        )
        return above, below

    def leaves_motions(self, c: Context) -> bool:
        """Whether the step of an increment has the same plan on both sides but for friction: no motion, no force changes."""
        return self._in_step(c).leaves_motions

    def is_known(self, c: Context) -> bool:
        """Whether closed derivatives know what it changes in the step of an increment; of damage they know nothing."""
        return self.change is not None and self._in_step(c).leaves_laws and not c.state.damage

    # ------------------------------------------------------------------------------------------------------ equilibrium
    def at_fixed_dofs(self, at: Solution) -> tuple[Side, Side]:
        """Both sides with the committed state that belongs to them and the dofs of the solution.

        A tool of another shape lies deep in the bodies then, or far from them: steps are long against the penetrations of
        penalties, and laws would be asked about pressures beyond reason. So multipliers take back what gaps and slips change,
        and their share, which is linear, is left to the matrix.
        """
        return self._side(at, *self.sides[0]), self._side(at, *self.sides[1])

    def equation(self, at: Solution, sides: tuple[Side, Side]) -> tuple[Array, Array]:
        """∂r (ndof,) at fixed dofs, and how the prescribed dofs (ndof,) change."""
        system = at.system
        dr = self.difference(sides[0].e.r, sides[1].e.r)
        pushed = self.difference(sides[0].pushed, sides[1].pushed)
        for k, s in enumerate(at.c.surfaces):
            f, by = at.e.contacts[k], pushed[s.rows]
            P, T = f.weight * (f.dp[:, : by.shape[1]] * by).sum(axis=1), f.area[:, None] * _tangential(f, by)
            F = f.stencils.act(P[:, None] * f.stencils.n + np.einsum("kt,kti->ki", T, f.stencils.e))
            scatter_vector(F, s.dofs, dr)  # r has −F, and what was pushed is to be taken back
        given = np.zeros(len(dr))
        given[at.c.plan.fixed] = self.difference(*(side.c.plan.values(side.c.time) for side in sides))
        return dr, system.with_slaves(given)

    def ways(self, at: Solution) -> Array:
        """Of what the derivative of the free dofs is expected to consist (ndof, k), 0 for the prescribed ones."""
        ways = predictor_basis(self.carried, at.c.plan.fixed)
        return np.stack([at.system.with_slaves(way) for way in ways.T], axis=-1)

    def _context(self, at: Solution, sign: float, system: System, stabilisation: Stabilisation) -> Context:
        """The increment beside, from the committed state that belongs to it."""
        old = at.c.state.moved(self.carried, sign * self.step)
        plan = self.plans(at.c)[0 if sign > 0 else 1]
        # Forces that a step releases are those of each side's own state; they are found once, as the step begins.
        if at.c.state.release is not None and at.c.state.clock.time == plan.t0:
            carried = release_forces(system, replace(old, release=None), plan)
            old = replace(old, release=np.zeros(system.ndof) if carried is None else carried)
        c = system.context(old, plan, at.c.time, at.c.rule)
        c = replace(c, interactions=[*c.interactions, *stabilisation.forces(c)])
        return c if at.c.through_air is None else system.through_air(c, self._through_air(system, c, stabilisation.policy))

    def through_air(self, at: Solution) -> Array:
        """Derivative (ndof,) of the way that tools and bodies go through air in an increment."""
        ways = [self._context(at, *side).through_air for side in self.sides]
        return self.difference(*(np.zeros(at.system.ndof) if way is None else way for way in ways))

    def coordinates(self, at: Solution, k: int) -> Array:
        """Derivatives (points, t) of the coordinates from which the points of contact k slip after a way through air."""
        return self.difference(*(self._context(at, *side).committed[k].coordinate for side in self.sides))

    def _through_air(self, system: System, c: Context, policy: Policy) -> Array | None:
        """Way (ndof,) that tools and bodies go through air in an increment beside, as in `TimeStepping.solved`."""
        loose = loose_bodies(system, c.plan)
        to = approach_of_bodies(system, c, loose, policy) if loose else None
        if to is None or to.through_air is None:
            to = approach_of_tools(system, c, policy)
        return to.through_air

    def rest(self, at: Solution, x: Array) -> Array:
        """What the residual (ndof,) does along the parameter and the derivative x (ndof,) of the dofs: nothing, if right."""
        beside = []
        for sign, system, stabilisation in self.sides:
            c = self._context(at, sign, system, stabilisation)
            u, lam = at.u + sign * self.step * x, system.initial_multipliers(c.state)
            beside.append(system.evaluate(c, u, lam, stiffness=False, active_sets=at.active_sets))
        if any(e.failed for e in beside):
            return np.full_like(x, np.inf)
        return self.difference(beside[0].r, beside[1].r)

    def _side(self, at: Solution, sign: float, system: System, stabilisation: Stabilisation) -> Side:
        c = self._context(at, sign, system, stabilisation)
        old = c.state
        u, lam = system.with_slaves(at.u.copy()), system.initial_multipliers(old)
        pushed = np.zeros_like(lam)
        for k, s in enumerate(c.surfaces):
            own = self._pushed(at, system, c, k, u)
            if s.multipliers is None:
                pushed[s.rows] = own
            else:
                u[s.multipliers.slice] += (own / c.scales[k].unit[:, None]).ravel()
        return Side(c, u, lam, system.evaluate(c, u, lam + pushed, stiffness=False, active_sets=at.active_sets), pushed)

    def _pushed(self, at: Solution, system: System, c: Context, k: int, u: Array) -> Array:
        """Multipliers (k, 1 + t) that leave the trial tractions of closed points as they are though gaps and slips change."""
        f, s, closed = at.e.contacts[k], c.surfaces[k], at.active_sets.contacts[k].closed
        x, scale, before = system.stencils(s, u, c.state), c.scales[k], at.c.scales[k]
        n = scale.k_n * np.where(closed, x.g, 0.0) - before.k_n * np.where(closed, f.g, 0.0)
        ways = (x.s - c.committed[k].coordinate) * scale.k_t[:, None]
        ways -= (f.s - at.c.committed[k].coordinate) * before.k_t[:, None]
        return np.hstack([n[:, None], np.where(closed[:, None], ways, 0.0)])

    # ------------------------------------------------------------------------------------------------------- what follows
    def neighbours(
        self, at: Solution, fixed: tuple[Side, Side], x: Array, reaction: Array, how: NewtonResult, dt: float
    ) -> tuple[tuple[Neighbour, Neighbour], Array, float]:
        """The increment on both sides, whose difference is carried on, and the derivative (ndof,) of the residual between them.

        That is zero if all is right, as is what comes last (see `_unmet`). x (ndof,): derivative of the dofs beyond what they
        differ by at the sides already; reaction (ndof,): ∂r + K x.
        """
        moved = []
        for (sign, system, _), side in zip(self.sides, fixed):
            u = side.u + sign * self.step * x
            e = system.evaluate(side.c, u, side.lam, stiffness=False, active_sets=at.active_sets)
            moved.append(side._replace(u=u, e=e))
        flat = self.difference(moved[0].e.r, moved[1].e.r)
        unmet = sum(self._unmet(at, moved[0], moved[1], k) for k in range(len(at.c.surfaces)))
        contacts = [self._contact(at, fixed, (moved[0], moved[1]), x, k) for k in range(len(at.c.surfaces))]
        out, states = [], []
        for k, ((sign, system, stabilisation), side) in enumerate(zip(self.sides, moved)):
            # Reactions are those of the matrix, as pressures are: differenced, gaps times penalties would be round-off.
            e = side.e._replace(r=at.e.r + sign * self.step * reaction, contacts=tuple(pair[k] for pair in contacts))
            result = replace(how, u=side.u, lam=side.lam.copy(), evaluation=e, recover=None, energy=None)
            states.append(committed(system, side.c, result, e, dt, stabilisation).moving())
            beyond = self._folded(at, side.c, e)
            states[k]["energy.friction"] -= beyond
            states[k]["energy.imbalance"] += beyond
            # Neighbours are kept with their increment, and nobody asks them for stiffnesses.
            slim = tuple(f._replace(K=DROPPED, dp=DROPPED, dt=DROPPED) for f in e.contacts)
            out.append(Neighbour(system, side.c.plan, e._replace(contacts=slim, history=()), self.step))
        earlier = handed_down(self.carried)
        self.carried = {k: self.difference(a, states[1][k]) for k, a in states[0].items()} | earlier
        return (out[0], out[1]), flat, unmet

    def _unmet(self, at: Solution, above: Side, below: Side, k: int) -> float:
        """What conditions that supports prescribe move apart, as forces: points that slide or open from a state of rest."""
        redundant = at.e.contacts[k].redundant
        if redundant is None:
            return 0.0
        ends = [(side.e.contacts[k], side.c.committed[k].coordinate) for side in (above, below)]
        g, s = (self.difference(a, b) for a, b in zip(*((f.g, f.s - was) for f, was in ends)))
        size = at.e.contacts[k].weight * at.c.scales[k].unit
        return float(redundant.points.moved_apart(size * g, size[:, None] * s))

    def _folded(self, at: Solution, side: Context, e: Evaluation) -> float:
        """What the work of friction on a side has from sizes of tractions that a step turns round: of points that just touch.

        The increment's tractions keep their directions, as all branches are kept, and so sizes go on below zero.
        """
        out = 0.0
        for s, f, g in zip(side.surfaces, at.e.contacts, e.contacts):
            was, then = at.c.state.contact.of(s.rows), side.state.contact.of(s.rows)
            excess = _beyond(was.traction, then.traction) + _beyond(f.t, g.t)
            out += 0.5 * float((g.area * excess * (g.kappa - then.slip)).sum())
        return out

    def _contact(
        self, at: Solution, fixed: tuple[Side, Side], moved: tuple[Side, Side], x: Array, k: int
    ) -> list[ContactForces]:
        """Forces of contact number k on both sides: pressures, tractions and places as the matrix has them change along x."""
        f, s = at.e.contacts[k], at.c.surfaces[k]
        a, b = (side.e.contacts[k] for side in fixed)
        q, lam = _motions(at.system, s, x)
        # What multipliers held back at fixed degrees of freedom is given back here, by the matrix.
        lam = lam - self.difference(fixed[0].pushed[s.rows], fixed[1].pushed[s.rows])
        with_lam = np.hstack([lam, q])
        dp = self.difference(a.p, b.p) + (f.dp * with_lam).sum(axis=1)
        dt = self.difference(a.t, b.t) + (f.dt * with_lam[:, None, :]).sum(axis=2)
        ds = self.difference(a.s, b.s) + (f.stencils.ds * q[:, None, :]).sum(axis=2)
        if f.stretched is not None:
            # the bound is one at P/a: areas that grow along x lower the pressure
            areas = [side.e.contacts[k].area for side in (*moved, *fixed)]
            growth = self.difference(areas[0] - areas[2], areas[1] - areas[3]) / f.area
            dt -= (f.t - f.stretched) * growth[:, None]
        out = []
        for (sign, *_), side in zip(self.sides, moved):
            g, step = side.e.contacts[k], sign * self.step
            p, t = f.p + step * dp, f.t + step * dt
            g = g._replace(p=p, t=t, stencils=g.stencils._replace(s=f.s + step * ds))
            out.append(g._replace(F=g.stencils.act(g.vectors)))
        return out


def alike(p: FrictionLaw | None, q: FrictionLaw | None) -> bool:
    """Whether two laws differ in numbers alone, and not in their tables."""
    if p is q or p == q or p is None or q is None:
        return p == q
    if not (p.is_of_point and q.is_of_point):
        return False
    a, b = values_of(p), values_of(q)
    return a.form == b.form and all(map(np.array_equal, a.tables, b.tables))


def _motions(system: System, s: Surface, x: Array) -> tuple[Array, Array]:
    """Motions along x (ndof,) of the unknowns q (k, m) of the stencils of a contact and of its multipliers λ (k, 1 + t)."""
    q, t = x[s.dofs], system.dofs.dimension - 1
    lam = np.zeros((len(q), 1 + t))
    if s.multipliers is not None:
        lam = s.multipliers.of(x) * s.unit[:, None]
    return q, lam


def _beyond(here: Array, beside: Array) -> Array:
    """Sizes (k,) of tractions (k, t) beside these, less their parts along these."""
    size = magnitude(here)
    along = (here * beside).sum(axis=1) / np.where(size > 0.0, size, 1.0)
    return np.asarray(np.where(size > 0.0, magnitude(beside) - along, 0.0))


def _tangential(f: ContactForces, lam: Array) -> Array:
    """Tractions (k, t) that multipliers lam (k, 1 + t) make."""
    return np.asarray((f.dt[:, :, : lam.shape[1]] * lam[:, None, :]).sum(axis=2))


class Columns:
    """Solutions for many right-hand sides with the matrix at a solution.

    Newton's last factors are those of a matrix a step away, and substitutions for many columns together cost a tenth of new
    factors: a few of them, each with the residual of the matrix at the solution, do for all columns.
    """

    def __init__(self, reduced: Reduced, e: Evaluation, pattern: Pattern) -> None:
        self.reduced, self.e, self.pattern = reduced, e, pattern

    @cached_property
    def whole(self) -> csc_matrix:
        """K."""
        from scipy.sparse import csc_matrix

        n = len(self.e.r)
        return csc_matrix((self.e.data, self.pattern.indices, self.pattern.indptr), (n, n))

    def times(self, x: Array) -> Array:
        """K x for x (ndof, d)."""
        return np.asarray(self.whole @ x)

    def initial_guess(self, left: Array, ways: Array) -> Array:
        """Where the solution of K x = b (ndof, d) begins; ``left`` is b, and becomes what that leaves of it.

        It is the combination of ways (ndof, k d), by column, that leaves least of the free rows; they are zero where dofs are
        prescribed.
        """
        reduced, part = self.reduced, self.reduced.restriction.part
        images, x, d = self.times(ways), np.empty_like(left), left.shape[1]
        share = np.zeros((ways.shape[1] // d, d))
        nearest(part(images), part(left), reduced.weight, reduced.policy.column_dependence, share)
        combined(ways, images, share, x, left)
        return x

    def solve(self, left: Array) -> Array:
        """Dofs x of K x = b for b (ndof, d), zero where prescribed; ``left`` is b, and becomes b − K x.

        b: of parameters that change by their sizes.

        Raises
        ------
        SingularError
            If no solver can factor K.

        """
        x, factors = np.zeros_like(left), self.reduced.factorisation
        if factors.factored and self._substituted(x, left):
            return x
        # of exact contacts `determined` adds to the matrix, which substitutions take back
        matrix = self.reduced.matrix(self.e, np.zeros(len(left)))
        if not (factors.follows and factors.coarse(matrix) and self._substituted(x, left)):
            self.reduced.solve(matrix, left[:, 0])
            self._substituted(x, left)
        return x

    def _substituted(self, x: Array, left: Array) -> bool:
        """Improve dofs x, for which ``left`` is still to do, with the factors at hand; whether what is left then is enough.

        Columns of which enough is done stay as they are. It ends where new factors would be cheaper than the substitutions that
        are still to come.
        """
        reduced, policy, n = self.reduced, self.reduced.policy, len(x)
        part = reduced.restriction.part(left)
        sizes, todo, found, rest, enough = self._shares(part), np.arange(left.shape[1]), x, left, True
        while enough and not (fine := sizes <= policy.column_residual_share).all():
            if fine.any():
                x[:, todo], left[:, todo] = found, rest
                on = np.flatnonzero(~fine)
                todo, sizes = todo[on], sizes[on]
                found, rest, part = (a.take(on, axis=1) for a in (found, rest, part))
            step = reduced.restriction.whole(reduced.factorisation.solve_with_factors(part), n)
            after = self.times(step)
            np.subtract(rest, after, out=after)
            part = reduced.restriction.part(after)
            before, sizes = sizes.max(), self._shares(part)
            # Factors of a nearly singular matrix, or of one too far away, lead nowhere: the matrix at the solution is factored.
            if not sizes.max() < before:
                enough = False
                break
            found += step
            rest = after
            # At the present rate, would as many substitutions as a factorisation costs leave more than is allowed?
            rate = sizes.max() / before
            enough = not sizes.max() * rate**policy.substitutions_per_factorisation > policy.column_residual_share
        if found is x:
            left[:] = rest
        else:
            x[:, todo], left[:, todo] = found, rest
        return enough

    def _shares(self, part: Array) -> Array:
        """Norms (d,) of free rows (f, d), moments divided by a length, over the forces."""
        return np.asarray(sums(self.reduced.weight, part)) / self.e.scale
