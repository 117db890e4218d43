"""An increment backwards: adjoints of its beginning and of the numbers of the problem from those of its end, for many measures.

The transposes of the closed derivatives (`prensa.sensitivity.closed`), line by line in reverse: weights of the degrees of
freedom, histories and contact points after an increment become those before it, and on the way weights of the arrays of the
system (`Adjoints`). With λ = K⁻ᵀ (weights of the dofs) the residual has the weights −λ (Michaleris, Tortorelli and Vidal 1994).
All arrays have the measures m as first axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from prensa.contact.forces import ContactForces
from prensa.contact.redundant import RedundantMultipliers, closed_slopes
from prensa.elements import derivatives, q4
from prensa.elements.kinds.q4_fbar import Q4WithBar
from prensa.friction.point import values_of
from prensa.linear.factorisations import KeptFactors
from prensa.linear.reduction import Reduced, Selected
from prensa.materials.j2 import CURVE_AT
from prensa.sensitivity.bodies import SHIFT, Elements, elements_of, point_law
from prensa.sensitivity.contacts import slopes_of, strength_behind, turning
from prensa.sensitivity.substitutions import Solve, Substitutions, initial_guess
from prensa.system.assembly import Block, Pattern, scatter_forces
from prensa.system.interaction import ActiveSets, Context
from prensa.system.planning import plan_step
from prensa.system.schedule import StepPlan
from prensa.system.system import Evaluation, System
from prensa.types import Array, Index


class Converged(NamedTuple):
    """A converged increment as it is kept for the way back: context, dofs u (ndof,), branches, and the equations it solved.

    ``evaluation``: that at the solution with its matrix, ``factors``: Newton's last ones, of a matrix nearby; None where they
    are not kept.
    """

    c: Context
    u: Array
    active_sets: ActiveSets
    reduced: Reduced
    evaluation: Evaluation | None = None
    factors: KeptFactors | None = None


class ContactWeights(NamedTuple):
    """Of a contact's committed points, (m, k): ``p`` of pressures, ``lam`` of tangential multipliers, ``s`` of coordinates.

    ``slip``, ``speed``: of slips and of their speeds.
    """

    p: Array
    lam: Array
    s: Array
    slip: Array
    speed: Array


@dataclass
class Weights:
    """Of a committed state: ``u``, ``step_start`` (m, ndof); histories (m, e, q, h) by block; contact points by contact.

    ``force`` (m, ndof): of the forces of the bodies on tools, which only the last increment has.
    """

    u: Array
    step_start: Array
    history: list[Array]
    contact: list[ContactWeights]
    force: Array

    @classmethod
    def none(cls, system: System, m: int) -> Weights:
        """Adjoints of zero: nothing depends on the state."""
        u, step_start, force = np.zeros((3, m, system.ndof))
        history = [np.zeros((m, *b.undeformed.shape)) for b in system.blocks]
        contact = [ContactWeights(*np.zeros((5, m, len(s.points)))) for s in system.surfaces]
        return cls(u, step_start, history, contact, force)


class LawWeights(NamedTuple):
    """Of a `PointLaw`: its numbers (m, n), of a table its knots (m, k) and coefficients (m, k − 1, 4)."""

    p: Array
    knots: Array
    coefficients: Array


class Touching(NamedTuple):
    """Points (k, 2) of a tool's frame that were on it, with weights (m, k) of gaps, of turns of the normal, of coordinates.

    ``rounds`` (k,): how often a coordinate has gone round a closed surface.
    """

    x: Array
    g: Array
    turn: Array
    s: Array
    rounds: Array


class Prescribed(NamedTuple):
    """At a time of a step: weights of the prescribed dofs (m, fixed), of forces on tools (m, ndof)."""

    time: float
    motion: Array
    force: Array


class Still(NamedTuple):
    """Of an increment from ``before`` to ``time``: slopes (j, fixed) by the prescribed dofs of gaps and ways that these hold.

    Over the depths of the elements behind. Where these move, points that keep their multipliers begin to open or to slide.
    """

    time: float
    before: float
    slopes: Array


class Stage(NamedTuple):
    """Of a step: the dofs at its start and the ends of those before, of which plans are made; its increments, last one first.

    ``laws`` (m, n): weights of the numbers of the laws of friction, by contact. ``beside``: plans that start a ``way`` further
    and less far.
    """

    step_start: Array
    ends: Array
    prescribed: list[Prescribed]
    still: list[Still]
    laws: list[Array]
    beside: tuple[StepPlan, StepPlan]
    way: float

    def follows(self, time: float) -> Array:
        """What prescribed dofs (k,) at a time change by the places from which the step starts."""
        above, below = (plan.values(time) for plan in self.beside)
        return np.asarray((above - below) / (2.0 * self.way))


class Adjoints:
    """Weights of the arrays of a system, as a run backwards finds them; see `prensa.sensitivity.change.Change`.

    ``tables``: whether anybody asks for those of tables.
    """

    def __init__(self, system: System, m: int, tables: bool) -> None:
        self.system, self.tables = system, tables
        self.X = np.zeros((m, len(system.X), 2))
        self.at = np.zeros((m, len(system.tools), 2))
        self.modulus = np.zeros((m, len(system.blocks)))
        self.law = [_no_law(b, m) for b in system.blocks]
        self.scale = [np.zeros((m, 3, len(s.points))) for s in system.surfaces]
        self.touching: list[list[Touching]] = [[] for _ in system.tools]
        self.stages: dict[int, Stage] = {}
        self._common: Common | None = None

    def common(self, reduced: Reduced) -> Common:
        """What increments with these equations have in common."""
        if self._common is None or self._common.reduced is not reduced:
            self._common = Common(reduced)
        return self._common

    def stage(self, c: Context) -> Stage:
        """The adjoints of an increment's step."""
        old, number = c.state, c.plan.number
        if number not in self.stages:
            system = self.system
            laws = [np.zeros((len(self.X), 0 if law is None else len(values_of(law).numbers))) for law in c.laws]
            # Prescribed values are linear in where a step starts, so that the difference may be as long as the bodies and loses
            # no digits.
            above, below = (plan_step(system, number, old.step_start + s * system.length, old.ends) for s in (1.0, -1.0))
            self.stages[number] = Stage(old.step_start, old.ends, [], [], laws, (above, below), system.length)
        return self.stages[number]


def _no_law(b: Block, m: int) -> LawWeights:
    _, p, knots, coefficients = point_law(b, 0.0)
    return LawWeights(*(np.zeros((m, *np.shape(v))) for v in (p, knots, coefficients)))


class Nearby(NamedTuple):
    """Factors of an increment, and the diagonal (f,) of the matrix at its end."""

    factors: KeptFactors
    diagonal: Array

    def solve(self, diagonal: Array) -> Solve:
        """Their transposed substitution for a matrix with another diagonal, rows and columns scaled alike to that.

        Bodies that are pressed flatter have other stiffnesses along each axis, which that takes up; flow that turns and contact
        are left to what substitutions learn.
        """
        scale = _scales(self.diagonal, diagonal)
        return lambda b: scale * self.factors.transposed(scale * b)


def _scales(a: Array, b: Array) -> Array:
    """Lengths (f,) of unknowns that make one diagonal (f,) of a matrix the size of another."""
    return np.sqrt(np.abs(np.divide(a, b, out=np.ones(len(a)), where=(a != 0.0) & (b != 0.0))))


def departure(a: Array, b: Array) -> float:
    """How unlike two matrices are, by their diagonals (f,): scatter of the logarithms of the lengths between them."""
    return float(np.log(_scales(a, b)).std())


def diagonal_places(pattern: Pattern, free: Index) -> Index:
    """Where the diagonal of the free dofs (f,) stands among the values of the matrix of all."""
    columns = np.repeat(np.arange(pattern.n, dtype=pattern.indices.dtype), np.diff(pattern.indptr))
    return np.flatnonzero(pattern.indices == columns)[free]


class Common:
    """What the increments of a step have in common backwards: where transposes stand, the last solutions, room for steps."""

    def __init__(self, reduced: Reduced) -> None:
        self.reduced, policy = reduced, reduced.policy
        self.diagonal: Index | None = None
        """See `diagonal_places`."""
        self.nearby: Nearby | None = None
        """Factors that increments after were solved with, where they had none of Newton's."""
        self.solutions = np.empty((len(reduced.free), 0))
        """Of the last increments (f, k m), that of the last one first."""
        self.substitutions = Substitutions(len(reduced.free), policy.adjoint_max_steps, policy.adjoint_residual_share)

    @cached_property
    def places(self) -> Index | slice:
        """See `places_of`."""
        return places_of(self.reduced)

    def note(self, x: Array) -> None:
        """Keep solutions (f, m) for the next to begin with."""
        most = (self.reduced.policy.adjoint_start_solutions - 1) * x.shape[1]
        self.solutions = np.hstack([x, self.solutions[:, :most]])


class Backwards:
    """Solutions with the transpose of the matrix at a solution.

    Factors of a matrix nearby do where what they leave is solved for again: Newton's last ones, of an iterate before, which the
    run has left, or else those of an increment beside or of the matrix itself in single precision, which cost less than those in
    double precision.
    """

    def __init__(self, at: Converged, earlier: Sequence[Converged], e: Evaluation, pattern: Pattern, adjoints: Adjoints) -> None:
        from scipy.sparse import csr_matrix

        self.at, self.reduced, self.e, self.common = at, at.reduced, e, adjoints.common(at.reduced)
        self.earlier, self.pattern = earlier, pattern
        self.whole = csr_matrix((e.data, pattern.indices, pattern.indptr), (pattern.n, pattern.n))  # columns of K as rows
        r = self.reduced.restriction
        assert isinstance(r, Selected)
        assert e.data is not None
        self.part = csr_matrix((r.values(e.data), r.indices, r.indptr), (len(r.free), len(r.free)))

    def solve(self, b: Array) -> Array:
        """Dofs (ndof, m) of Kᵀ x = b for b (ndof, m), zero where prescribed."""
        part, x = self.reduced.restriction.part(b), None
        if self.at.factors is not None:
            x = self._refined(part, self.at.factors.transposed)
            self.common.nearby = Nearby(self.at.factors, self.diagonal)
        elif (nearby := self._nearby()) is not None:
            x = self._refined(part, nearby.solve(self.diagonal))
        if x is None:
            x = self._newly_factored(b, part)
        self.common.note(x)
        return self.reduced.restriction.whole(x, len(b))

    @cached_property
    def diagonal(self) -> Array:
        """Of the matrix in the free dofs, (f,)."""
        return self._diagonal(self.e)

    def _diagonal(self, e: Evaluation) -> Array:
        if self.common.diagonal is None:
            self.common.diagonal = diagonal_places(self.pattern, self.reduced.restriction.free)
        assert e.data is not None
        return e.data[self.common.diagonal]

    def _nearby(self) -> Nearby | None:
        """Factors of an increment like this one: those at hand, kept ones of one before, or new ones; None if there are none.

        New ones are of the furthest, which is in the middle of those that its factors serve.
        """
        far, common, reduced = self.reduced.policy.factor_distance, self.common, self.reduced
        if common.nearby is not None and departure(common.nearby.diagonal, self.diagonal) < far:
            return common.nearby
        common.nearby, found = None, None
        for at in reversed(self.earlier):
            if at.reduced is not reduced or at.evaluation is None or reduced.symmetric:
                break
            diagonal = self._diagonal(at.evaluation)
            if not departure(diagonal, self.diagonal) < far:
                break
            if at.factors is not None:
                common.nearby = Nearby(at.factors, diagonal)
                return common.nearby
            found = at.evaluation, diagonal
        if found is not None and (made := self._coarse(found[0])) is not None:
            common.nearby = Nearby(made, found[1])
        return common.nearby

    def _coarse(self, e: Evaluation) -> KeptFactors | None:
        """Factors of the matrix of an evaluation in single precision; None where there are none for its transpose."""
        matrix, factors = self.reduced.matrix(e, np.zeros(len(e.r))), self.reduced.factorisation
        return factors.kept() if factors.coarse(matrix) else None

    def _refined(self, b: Array, again: Solve) -> Array | None:
        """Free dofs (f, m) for b (f, m) by substitutions with factors nearby; None where they do not lead to it."""
        out = initial_guess(self.part, b, self.common.solutions, self.reduced.policy.column_dependence)
        for k in range(b.shape[1]):
            one, first = np.ascontiguousarray(b[:, k]), np.ascontiguousarray(out[:, k])
            x = self.common.substitutions.solve(self.part, again, one, first)
            if x is None:
                return None
            out[:, k] = x
        return out

    def _newly_factored(self, b: Array, part: Array) -> Array:
        """Free dofs (f, m) for b (ndof, m), of which ``part`` (f, m) are of those, by factors of the matrix at the solution.

        In single precision or, where that is not enough or the factors serve no transposes, those of the transpose in double,
        refined once where contacts are exact, which takes back what `determined` adds.
        """
        reduced, factors = self.reduced, self.reduced.factorisation
        matrix, self.common.nearby = reduced.matrix(self.e, np.zeros(len(b))), None
        if factors.coarse(matrix):
            made = factors.kept()
            self.common.nearby = Nearby(made, self.diagonal) if made is not None else None
            x = self._refined(part, made.transposed) if made is not None else None
            if x is None and reduced.symmetric:
                x = self._refined(part, factors.solve_with_factors)
            if x is not None:
                return x
        matrix = matrix[self.common.places]
        x = factors.solve(matrix, part[:, 0])[:, None]
        if part.shape[1] > 1:
            x = np.hstack([x, factors.solve_with_factors(part[:, 1:])])
        return x + factors.solve_with_factors(part - self.part @ x) if reduced.equations else x


def places_of(reduced: Reduced) -> Index | slice:
    """Where the values of the transpose of the matrix in the free dofs stand among its own: the pattern is symmetric."""
    from scipy.sparse import csc_matrix

    r = reduced.restriction
    if reduced.symmetric:
        return slice(None)
    assert isinstance(r, Selected)
    numbered = csc_matrix((np.arange(len(r.indices)), r.indices, r.indptr), (len(r.free), len(r.free))).T.tocsc()
    numbered.sort_indices()
    return np.asarray(numbered.data, dtype=np.int64)


def back(system: System, at: Converged, after: Weights, adjoints: Adjoints, earlier: Sequence[Converged] = ()) -> Weights:
    """Weights of the state before an increment from those of the state after it; adds to the ``adjoints`` of the system.

    ``earlier``: the increments before it, in order.
    """
    c, m = at.c, len(after.u)
    e = at.evaluation or system.evaluate(c, at.u, system.initial_multipliers(c.state), active_sets=at.active_sets)
    columns = Backwards(at, earlier, e, system.pattern, adjoints)
    elements = elements_of(system, c, at.u, e)
    x, step_start = after.u.copy(), after.step_start
    # The state at the end of a step is also the start of the next one.
    if c.ends_step:
        x, step_start = x + step_start, np.zeros_like(step_start)
    nodal = _nodal(system, x)
    for b, new in zip(elements, after.history):
        _follow(b, new, nodal)
    x[:, system.dofs.displacement.slice] = nodal.reshape(m, -1)
    points = [Points(system, at, k, f, after) for k, f in enumerate(e.contacts)]
    for p in points:
        p.vjp_motions(x)
    # λ = K⁻ᵀ (weights of the dofs); from here on −λ weighs the residual, line by line the reverse of `closed.differentiate`.
    r = -columns.solve(x.T)
    motion = (x + (columns.whole @ r).T)[:, c.plan.fixed]
    before = Weights.none(system, m)
    before.step_start = step_start
    _prescribed(system, c, motion, r.T, before, adjoints)
    r = np.ascontiguousarray(r.T)
    x_n, places = np.zeros((2, m, len(system.X), 2))
    for k, (b, new) in enumerate(zip(elements, after.history)):
        _element(b, k, r, new, x_n, places, before.history[k], adjoints)
    _unfolding(system, c, at.u, r, adjoints)
    for p in points:
        p.vjp(r, x_n, before, adjoints)
    before.u[:, system.dofs.displacement.slice] += x_n.reshape(m, -1)
    adjoints.X += x_n + places
    return before


def _nodal(system: System, x: Array) -> Array:
    return np.ascontiguousarray(x[:, system.dofs.displacement.slice]).reshape(len(x), -1, 2)


def _prescribed(system: System, c: Context, motion: Array, r: Array, before: Weights, adjoints: Adjoints) -> None:
    """Add the adjoints of the motions and forces that a step prescribes, and of the places from which it starts."""
    stage = adjoints.stage(c)
    before.step_start[:, c.plan.fixed] += motion * stage.follows(c.time)
    force = np.zeros_like(r)
    pushed = list(c.plan.push)
    force[:, pushed] = -r[:, pushed]
    stage.prescribed.append(Prescribed(c.time, motion, force))


def _follow(b: Elements, new: Array, nodal: Array) -> None:
    """Add to weights (m, n, 2) of the nodes' motions what those of the histories (m, e, q, h) after an increment give them."""
    for some, at in b.chunks:
        for w, out in zip(new, nodal):
            _to_nodes(derivatives.history_back(at, w[some]), b.block.cells[some], out)


def _to_nodes(w: Array, cells: Index, out: Array) -> None:
    """Add weights (e, a, 2) of the nodes of elements to those of nodes, out (n, 2)."""
    scatter_forces(w.reshape(len(w), -1), cells, out.reshape(-1))


def _element(
    b: Elements, k: int, r: Array, new: Array, x_n: Array, x: Array, old: Array, adjoints: Adjoints
) -> None:  # fmt: skip
    """Adjoints from forces and histories of block number k."""
    cells, stress, weights = b.block.cells, np.zeros((len(r), *b.block.volume.shape)), adjoints.law[k]
    dofs = (2 * cells[:, :, None] + np.arange(2)).reshape(len(cells), -1)
    for some, at in b.chunks:
        for i, w in enumerate(new):
            found = derivatives.back(at, w[some], r[i].take(dofs[some]))
            _to_nodes(found.X, cells[some], adjoints.X[i])
            _to_nodes(found.x_n, cells[some], x_n[i])
            _to_nodes(found.x, cells[some], x[i])
            old[i, some], stress[i, some] = found.committed, found.stress
            weights.p[i] += found.p
    form, _, knots, coefs = point_law(b.block, b.seconds)
    if not adjoints.tables or form.table_at is None:
        return
    strain, last = b.block.field(b.new, "plastic_strain")[..., 0], len(knots) - 1
    piece = np.clip(np.searchsorted(knots, strain, side="right") - 1, 0, last - 1)
    d = np.minimum(strain, knots[last]) - knots[piece]
    a3, a2, a1 = (coefs[piece, i] for i in range(3))
    slope = (3.0 * a3 * d + 2.0 * a2) * d + a1
    for out, w in enumerate(stress):
        for i, power in enumerate((d**3, d**2, d, np.ones_like(d))):
            np.add.at(weights.coefficients[out, :, i], piece, w * power)
        np.add.at(weights.knots[out], piece, -w * slope)


def _unfolding(system: System, c: Context, u: Array, r: Array, adjoints: Adjoints) -> None:
    """Adjoints of moduli and initial places from the forces that unfold elements, differenced along them."""
    du = system.displacement(u - c.state.u)
    for k, b in enumerate(system.blocks):
        if not isinstance(b.element, Q4WithBar) or not q4.folding(c.x_n.take(b.cells, axis=0), du.take(b.cells, axis=0)).any():
            continue
        W = r[:, system.dofs.displacement.dofs(b.cells).reshape(len(b), -1)]  # (m, e, 8)
        X, x_n, d = system.X[b.cells], c.x_n[b.cells], du[b.cells]

        def forces(X: Array, x_n: Array, b: Block = b, d: Array = d) -> Array:
            out, size = np.zeros((len(b), 8)), np.zeros(len(b))
            q4.unfold(X, x_n, d, b.mode.axisymmetric, b.mode.scale, size, False, out, np.empty((0, 8, 8)))
            return out

        adjoints.modulus[:, k] += np.einsum("mei,ei->m", W, forces(X, x_n))
        step = SHIFT * system.length
        for node in range(4):
            for axis in range(2):
                way = np.zeros((4, 2))
                way[node, axis] = step
                slope = b.law.modulus() * (forces(X + way, x_n + way) - forces(X - way, x_n - way)) / (2.0 * step)
                for out, w in zip(adjoints.X, W):
                    np.add.at(out[:, axis], b.cells[:, node], (w * slope).sum(axis=1))


class Points:
    """A contact in an increment, backwards: adjoints of the motions from its points, then of the rest from its forces.

    Weights of the answers of points go back through the generated derivatives of `prensa.contact.point`.
    """

    def __init__(self, system: System, at: Converged, number: int, f: ContactForces, after: Weights) -> None:
        c = at.c
        self.system, self.c, self.number, self.f, self.u = system, c, number, f, at.u
        self.surface, self.scale, self.adjoints = c.surfaces[number], c.scales[number], after.contact[number]
        self.by, self.turning = slopes_of(c, number, f, at.u), turning(f)
        self.forces = f.stencils.act(f.stencils.n), f.stencils.act(f.stencils.e[:, 0])
        self.F = after.force[:, self.surface.dofs]
        # Measures ask for forces on tools alone.
        self.F[:, :, : self.surface.of_master.start] = 0.0

    def _back(self, F: Array, p: Array, t: Array, bound: Array | None = None) -> tuple[dict[str, Array], Array]:
        """Weights of forces F (m, k, q), pressures and tractions (m, k), besides slips → of what points depend on, of motions."""
        P, T = ((F * e).sum(axis=2) for e in self.forces)
        weights = {"p": p, "t": t, "slip": self.adjoints.slip + self.adjoints.speed / self.c.seconds, "P": P, "T": T}
        if bound is not None:
            weights["bound"] = bound
        z = self.by.back({name: w[:, :, None] for name, w in weights.items()})
        stencils, way = self.f.stencils, z["way"] + self.adjoints.s[:, :, None]
        return z, z["g"] * stencils.dg + way * stencils.ds[:, 0] - np.einsum("mki,kij->mkj", F, self.turning)

    def vjp_motions(self, x: Array) -> None:
        """Add to weights x (m, ndof) of the dofs of the increment those from forces on tools, tractions and coordinates."""
        s = self.surface
        z, q = self._back(self.F, self.adjoints.p, self.adjoints.lam)
        for out, w in zip(x, q):
            np.add.at(out, s.dofs, w)
        if s.multipliers is not None:
            lam = np.concatenate([z["lam_n"], z["lam"]], axis=2)
            x[:, s.unknowns] += (lam * self.scale.unit[:, None]).reshape(len(x), -1)
        if self.f.stretched is not None:
            self._areas(z["area"][:, :, 0], self.system.positions(self.u), x[:, self.system.dofs.displacement.slice])

    def vjp(self, r: Array, x_n: Array, before: Weights, adjoints: Adjoints) -> None:
        """Adjoints from its forces, r (m, ndof) weighting the residual; adds to x_n (m, n, 2) and to the state ``before``."""
        f, s, scale, c = self.f, self.surface, self.scale, self.c
        F = self.F - r[:, s.dofs]
        p, t, bound = self.adjoints.p.copy(), self.adjoints.lam.copy(), None
        lam, kept = np.zeros((2, *p.shape, 2))
        stage = adjoints.stage(c)
        if s.exact:
            rows = r[:, s.unknowns].reshape(len(r), -1, 2) * (f.weight * scale.unit)[:, None]
            rows /= np.stack([scale.k_n, scale.k_t], axis=1)
            lam -= rows
            if f.redundant is not None:
                rows, kept, bound = _kept(f.redundant, rows)
                stage.still.append(self._still(f.redundant))
            p, t = p + rows[:, :, 0], t + rows[:, :, 1]
        z, q = self._back(F, p, t, bound)
        nodal = q[:, :, : s.of_master.start].reshape(*q.shape[:2], -1, 2)
        adjoints.at[:, self.system.tool_masters[s.against].number] += q[:, :, s.of_master][:, :, :2].sum(axis=1)
        for out, w in zip(adjoints.X, nodal):
            np.add.at(out, s.points.support, w)
        flat = {name: w[:, :, 0] for name, w in z.items() if name != "numbers"}
        weight, area = flat["weight"], flat["area"]
        if f.stretched is None:
            weight = weight + area
        else:
            self._areas(area, self.system.positions(self.u), adjoints.X)
        self._areas(weight, c.x_n, x_n)
        stage.laws[self.number] += z["numbers"].sum(axis=1)
        lam += np.concatenate([z["lam_n"], z["lam"]], axis=2)
        adjoints.scale[self.number][:, 0] += flat["k_n"]
        adjoints.scale[self.number][:, 1] += flat["k_t"]
        P, T = ((F * e).sum(axis=2) for e in self.forces)
        # A normal that turns carries the pressure into the tangent, and the traction into the normal, with the other sign.
        turn = f.weight * f.p * T - f.area * f.t[:, 0] * P
        self._touch(adjoints, flat["g"], turn, self.adjoints.s + flat["way"])
        if c.laws[self.number] is not None:
            self._strengths(flat["k"], before, adjoints)
        if s.multipliers is None:
            # Penalties begin with λ_n = 0: of what was committed the traction alone goes on.
            kept = lam * [0.0, 1.0]
        else:
            adjoints.scale[self.number][:, 2] += (lam * s.multipliers.of(self.u)).sum(axis=2)
        slip = flat["slip"] - self.adjoints.speed / c.seconds
        # Ways are counted from the committed coordinate, which has their weights with the other sign.
        before.contact[self.number] = ContactWeights(kept[:, :, 0], kept[:, :, 1], -flat["way"], slip, flat["speed"])

    def _strengths(self, k: Array, before: Weights, adjoints: Adjoints) -> None:
        """Adjoints of the committed histories and of the flow curve from shear yield stresses, weighted by k (m, points)."""
        s, law = self.surface, self.c.laws[self.number]
        if law is None or not law.asks_for_k:
            return
        block, found = strength_behind(self.system, self.c, s)
        points = before.history[block].shape[2]
        w = np.repeat(self.system.to_edges(s, k) / points, points, axis=1)
        history = np.einsum("mn,nh->mnh", w, found.by_history).reshape(len(k), len(s.behind), -1, 5)
        flow = adjoints.law[block]
        flow.p[:, CURVE_AT:] += w @ found.by_scalars
        for j in range(len(k)):
            np.add.at(before.history[block][j, :, :, :5], s.behind, history[j])
            np.add.at(flow.coefficients[j], found.piece, w[j, :, None] * found.powers)
            np.add.at(flow.knots[j], found.piece, w[j] * found.by_knot)

    def _still(self, redundant: RedundantMultipliers) -> Still:
        """See `Still`."""
        f, s, c = self.f, self.surface, self.c
        n, t, _ = (np.flatnonzero(which) for which in redundant.points[:3])
        normal, along = f.stencils.dg, f.stencils.ds[:, 0]
        free = ~np.isin(s.dofs, c.plan.fixed)
        slopes = np.vstack([normal[n], closed_slopes(free, normal, along)[t]]) / s.points.depth[np.append(n, t), None]
        out = np.zeros((len(slopes), self.system.ndof))
        np.add.at(out, (np.arange(len(out))[:, None], s.dofs[np.append(n, t)]), slopes)
        return Still(c.time, c.state.clock.time, out[:, c.plan.fixed])

    def _areas(self, area: Array, x: Array, adjoints: Array) -> None:
        """Add to ``adjoints`` (m, n, 2) of node positions x (n, 2) those from the areas there, weighted by (m, k)."""
        points = self.surface.points
        shares = points.shares
        slopes, nodes = points.slopes(x), points.edges[shares.edge]
        for out, w in zip(adjoints.reshape(len(adjoints), -1, 2), area):
            np.add.at(out, nodes, w[shares.point, None, None] * slopes)

    def _touch(self, adjoints: Adjoints, g: Array, turn: Array, s: Array) -> None:
        """Keep the points that depend on the shape of their tool."""
        on = np.flatnonzero(np.any((g != 0) | (turn != 0) | (s != 0), axis=0))
        master = self.system.tool_masters[self.surface.against]
        shape, place = master.shape, master.place(self.u)
        cos, sin = np.cos(place[2]), np.sin(place[2])
        local = self.f.stencils.arm[on] @ np.array([[cos, -sin], [sin, cos]])
        rounds = np.zeros(len(on))
        if np.isfinite(shape.period):
            rounds = np.round((self.f.s[on, 0] - shape.closest(local).s) / shape.period)
        adjoints.touching[master.number].append(Touching(local, g[:, on], turn[:, on], s[:, on], rounds))


def _kept(redundant: RedundantMultipliers, rows: Array) -> tuple[Array, Array, Array]:
    """Adjoints from weights (m, k, 2) of the multipliers' equations where supports leave multipliers undetermined.

    Weights of the pressures and tractions of the increment, of the committed ones (m, k, 2), of the bounds (m, k).
    """
    n, t, cut = redundant.points[:3]
    before, bound = rows * np.stack([n, t & ~cut], axis=1), np.where(cut, np.sign(redundant.t) * rows[:, :, 1], 0.0)
    return rows * ~np.stack([n, t], axis=1), before, bound
