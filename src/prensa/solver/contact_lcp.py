"""Contact and friction (the active set) in Newton's step: linear complementarity of points that open, close, stick and slip.

Newton's matrix assumes which points are closed and which of these stick, and an iteration corrects that assumption. Where bodies
are soft in bending and lie flat, or where all points slip and nothing holds a body along its tool, each correction makes the next
one necessary, however short the increment. Here the bodies are linearised alone (Josephy 1979), and the conditions of the points
stay inequalities; Newton's order stays, and how many points change does not matter. Each costs a substitution.

What the points do on bodies that answer linearly is `prensa.solver.friction_cone`: their matrix has a share a of the contact
stiffness of each, and what else their forces change acts on the bodies.

There are two such matrices. Newton's own has a = 1 in closed points and 0 in open ones: with its factors `edge_step` decides the
few points that its step changes. That of `contact_step` has all candidates on a foundation of a ≪ 1, closed or not, so that it is
regular where contact alone holds bodies; for an evaluation and a factorisation more it goes on where assumptions are wrong.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, vstack

from prensa.contact.forces import ContactForces, Scale
from prensa.contact.surface import Surface
from prensa.friction.law import bounded
from prensa.linear.factorisations import SingularError
from prensa.precision import NEGLIGIBLE
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.friction_cone import Bounds, Unknowns, moved_by
from prensa.solver.projection import linear_gaps
from prensa.system.loads import Release
from prensa.system.system import Evaluation
from prensa.types import Array, Flags, Index


class ContactStep(NamedTuple):
    """A step (ndof,), whether it found out itself which points slip, too, and the points (points,) that rested on springs."""

    step: Array
    decided: bool
    springs: Flags


# ------------------------------------------------------------------------------------------------ the two steps


def contact_step(
    eq: Equilibrium, u: Array, lam: Array, e: Evaluation, stick: Flags | None = None, most: int | None = None,
    for_friction: bool = False, given: Array | None = None, secant: float = 0.0,
) -> ContactStep | None:  # fmt: skip
    """Step from the iterate u (ndof,), whose evaluation is e; None where there is none or it would cost too much.

    stick (points,): contact points that are forced to stick where the step does not decide that; ``most``: candidates to
    begin with at most, `Policy.max_candidates` if not given; ``for_friction``: None where it cannot decide which points slip.
    ``given`` (ndof,): a change that is part of the step, for the first guess of an increment. ``secant``: how far the matrix goes
    to the secant moduli.
    """
    if not e.contacts:
        return None
    near, at = _near(eq, e), _first(eq, e)
    if (most is not None and at.sum() > most) or (for_friction and _rubbing(eq, e, at) is None):
        return None
    all_lam = eq.system.multipliers(u, lam)
    while 0 < at.sum() <= max_candidates(eq):
        rubbing = _rubbing(eq, e, at)
        rubs = np.zeros_like(at) if rubbing is None else rubbing
        # A weak foundation under all candidates keeps the matrix regular where contact alone holds a body.
        springs = eq.policy.foundation_ratio * np.stack([at, rubs], axis=1).astype(np.float64)
        held = stick if rubbing is None else None
        base = eq.evaluate(u, lam, stick=held, guess=given is not None, foundation=springs, secant=secant)
        if base.failed or base.data is None:
            return None
        r = base.r if given is None else base.r + eq.reduced.assembly.apply(base.data, given)
        try:
            with eq.report.timed("factorisation and solve"):
                matrix, base = eq.reduced.matrix(base, -r, spent=True), base._replace(data=None)
                alone = eq.reduced.solve(matrix, -r)
                alone = alone if given is None else alone + given
        except SingularError:
            if at.sum() == near.sum():
                raise
            at = near
            continue
        found = _decided(eq, base, all_lam, alone, at, rubs)
        # the factors are not those of Newton's matrix, which finishing substitutions want
        eq.reduced.factorisation.begin()
        if found is None:
            return None
        # Points that the step would take through a tool join the candidates, until it takes none.
        missed = _wrong(eq, base, all_lam, found) & near & ~at
        if not missed.any():
            return ContactStep(found, rubbing is not None, at)
        at = at | missed
    return None


def edge_step(eq: Equilibrium, e: Evaluation, lam: Array, step: Array) -> Array:
    """Newton's step (ndof,) from the evaluation e, by the factors at hand, with the points that it changes decided.

    At the edge of a growing contact a step closes a few points too many; the next one opens them, the pressure they carried moves
    to their neighbours, which open. Returns ``step`` unchanged if too many points change or there is no solution, and where
    tools are pushed or hang on springs, or loads act: other equilibria may be near. lam (points, 1 + t).
    """
    loads = eq.context.interactions[len(eq.context.surfaces) :]
    # A pushed tool was led past its limit point without notice: with forces, Newton's own steps decide (chapter 5).
    led = eq.tools_are_moved and all(isinstance(load, Release) for load in loads)
    if not (led and eq.globalised and e.contacts) or len(eq.reduced.free) > eq.policy.edge_max_unknowns:
        return step
    if eq.reduced.equations or not eq.reduced.factorisation.factored or eq.reduced.factorisation.iterates:
        return step  # by GMRES the response to each of these points costs about as much as an iteration
    at, nobody = np.zeros((2, len(lam)), dtype=bool)
    found, wrong = step, _wrong(eq, e, lam, step)
    while wrong.any():
        at = at | _with_those_ahead(eq, e, wrong)
        better = _decided(eq, e, lam, step, at, nobody) if at.sum() <= eq.policy.edge_max_points else None
        if better is None:
            break
        found, wrong = better, _wrong(eq, e, lam, better) & ~at
    return found


def few(eq: Equilibrium) -> int:
    """Candidates up to which a contact step costs no more than another iteration.

    Each costs substitutions. A factorisation of f equations is worth about √f of them in the plane and f^(2/3) in space (George
    1973: f^(3/2) and f² operations, f log f and f^(4/3) entries). Solutions by GMRES cost what they do there.
    """
    spatial = eq.system.dofs.dimension == 3 and not eq.reduced.factorisation.iterates
    return int(eq.policy.few_candidates * (len(eq.reduced.free) ** (1 / 6) if spatial else 1))


def affordable(eq: Equilibrium, e: Evaluation) -> bool:
    """Whether a contact step from the evaluation e costs no more than another iteration, so that Newton takes them anyway."""
    return not e.contacts or int(_first(eq, e).sum()) <= few(eq)


def max_candidates(eq: Equilibrium) -> int:
    """Points that a contact step considers at most.

    By GMRES the response to each takes as long as a step of Newton's or a fraction of it, where factors of the matrix take one
    substitution; and of the surfaces of bodies in space many points are near a tool.
    """
    return few(eq) if eq.reduced.factorisation.iterates else eq.policy.max_candidates


# ------------------------------------------------------------------------------------------------ which points


def _near(eq: Equilibrium, e: Evaluation) -> Flags:
    """Points (points,) that a contact step may close."""
    share, scales = eq.policy.candidate_gap_ratio, eq.context.scales
    return np.concatenate([np.where(np.isfinite(f.g), f.g, np.inf) < share * sc.h for f, sc in zip(e.contacts, scales)])


def _first(eq: Equilibrium, e: Evaluation) -> Flags:
    """Points (points,) that a contact step begins with: few are all those near a tool, of many those that are closed.

    A flange lies near its binder everywhere and touches it nowhere but on a ridge.
    """
    near = _near(eq, e)
    if near.sum() <= few(eq):
        return near
    # What is closed now or was when the increment began; points that are missed join later.
    return near & (np.concatenate([f.p > 0 for f in e.contacts]) | eq.context.state.contact.closed)


def _rubbing(eq: Equilibrium, e: Evaluation, at: Flags) -> Flags | None:
    """Those of the points ``at`` (points,) with friction, which is decided with their pressure; None where that is not done."""
    rubbing = np.zeros_like(at)
    for s, f, law in zip(eq.context.surfaces, e.contacts, eq.context.laws):
        if law is None or law.frictionless or f.bound is None:
            continue
        # Stick and slip are complementary where the bound depends on pressure alone (Klarbring 1986).
        if s.exact or law.hardens or eq.context.picard_friction:
            return None
        rubbing[s.rows] = at[s.rows]
    most = max_candidates(eq) if held_by_friction(eq, e) else few(eq)
    return rubbing if rubbing.sum() <= most else None


def held_by_friction(eq: Equilibrium, e: Evaluation) -> bool:
    """Whether a tool is free to move along its own surface, as an idle pulley that turns: no pressure resists that.

    Where all of its points slip the matrix has nothing against it, and which of them stick is worth any cost.
    """
    for s, f, law in zip(eq.context.surfaces, e.contacts, eq.context.laws):
        if law is None or law.frictionless:
            continue
        free = ~np.isin(s.dofs[0, s.of_master], eq.reduced.fixed)
        by_gap, by_way = (np.abs(of).max(axis=0, initial=0.0)[..., s.of_master] for of in (f.stencils.dg, f.stencils.ds))
        by_way = by_way.max(axis=0)
        if (free & (by_gap <= NEGLIGIBLE * by_way)).any():
            return True
    return False


def _wrong(eq: Equilibrium, e: Evaluation, lam: Array, step: Array) -> Flags:
    """Points (points,) that the matrix of e has open and its ``step`` (ndof,) closes, or the reverse; lam as `_decided`."""
    gaps, k_n = np.concatenate(linear_gaps(e, step)), np.concatenate([scale.k_n for scale in eq.context.scales])
    after = lam + eq.system.multipliers(step, np.zeros_like(lam))
    closed = np.where(np.isfinite(gaps), after[:, 0] - k_n * gaps, -np.inf) > 0.0
    return np.asarray(closed != e.touching)


def _with_those_ahead(eq: Equilibrium, e: Evaluation, wrong: Flags) -> Flags:
    """Points near a tool that are wrong, as many ahead, which may be so after them, and the next one behind."""
    out, acts = wrong.copy(), e.touching
    for s in eq.context.surfaces:
        here, a, taken = wrong[s.rows], acts[s.rows], out[s.rows]
        for k in range(1, 1 + int(here.sum())):
            for ahead, behind in ((slice(k, None), slice(None, -k)), (slice(None, -k), slice(k, None))):
                taken[ahead] |= here[behind] & ((a[ahead] == a[behind]) | (k == 1))
    return np.asarray(out & np.concatenate([np.isfinite(f.g) for f in e.contacts]))


# ------------------------------------------------------------------------------------------------ the problem


def _decided(eq: Equilibrium, e: Evaluation, lam: Array, alone: Array, at: Flags, rubs: Flags) -> Array | None:
    """Step (ndof,) with the points ``at`` (points,) decided, and with the friction of those that rub; None if there is none.

    e: the evaluation whose matrix has the factors at hand, ``alone`` its step; lam (points, 1 + t) the multipliers of all points.
    """
    points = _unknowns(eq, e, lam, at, rubs)
    with eq.report.timed("factorisation and solve"):
        response = eq.reduced.responses(points.forces, points.slopes)
        v = moved_by(eq.policy, points, points.trial + points.slopes @ alone, response)
        return None if v is None else alone + eq.reduced.solve_with_factors(points.forces.T @ v)


def _unknowns(eq: Equilibrium, e: Evaluation, lam: Array, at: Flags, rubs: Flags) -> Unknowns:
    """Of the points ``at`` (points,), with tractions where they rub; arguments as of `_decided`."""
    c, n = eq.context, eq.system.ndof
    normal, bounds, laws, first = [], [], [], 0
    along: list[list[tuple[csr_matrix, csr_matrix, Array, Array, Array]]] = [[] for _ in range(lam.shape[1] - 1)]
    for number, (s, f, scale, was) in enumerate(zip(c.surfaces, e.contacts, c.scales, c.committed)):
        here = np.flatnonzero(at[s.rows])
        dofs, trial = s.coupled[here], (lam[s.rows, 0] - scale.k_n * f.g)[here]
        forces, slopes = _by_pressure(s, f, scale, here)
        normal.append((_rows(forces, dofs, n), _rows(slopes, dofs, n), trial, np.maximum(trial, 0.0), f.dp[here, 0]))
        sliding = np.flatnonzero(rubs[s.rows][here])
        if len(sliding) and f.bound is not None:
            here, dofs = here[sliding], dofs[sliding]
            for i, component in enumerate(along):
                forces = f.stencils.act(f.area[:, None] * f.stencils.e[:, i])[here]
                slopes = (-scale.k_t[:, None] * f.stencils.ds[:, i])[here]
                trial = (lam[s.rows, 1 + i] - scale.k_t * (f.s - was.coordinate)[:, i])[here]
                component.append((_rows(forces, dofs, n), _rows(slopes, dofs, n), trial, f.t[here, i], f.dt[here, i, 1 + i]))
            bounds.append((first + sliding, *f.bound[here].T))
            if len(along) > 1 and not all(law is None or law.proportional for law in c.laws):
                laws.append(_law(eq, number, f, here))
        first += len(normal[-1][2])
    rows, columns, *values = zip(*normal, *itertools.chain(*along))
    nothing = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0)
    trial, f_now, spring = (np.concatenate(v) for v in values)
    rubbed, bound, by_pressure = (np.concatenate(v) for v in zip(nothing, *bounds))
    return Unknowns(
        vstack(rows, format="csr"), vstack(columns, format="csr"), trial, f_now, spring, rubbed, bound, by_pressure, len(along),
        _joined(laws, [len(own[0]) for own in bounds]) if laws else None,
    )  # fmt: skip


def _law(eq: Equilibrium, number: int, f: ContactForces, at: Index) -> Callable[[Array], Bounds]:
    """Bounds of the points ``at`` (m,) of a contact as functions of their pressures, at the slip and on the areas of f."""
    c, share, law = eq.context, (f.weight / f.area)[at], eq.context.laws[number]
    slip, k = c.committed[number].slip[at], c.law_at[number].rows(at)

    def bounds(p: Array) -> Bounds:
        assert law is not None
        value, slope, _ = bounded(law, p * share, slip, k)
        return Bounds(value, slope * share, p)

    return bounds


def _joined(laws: Sequence[Callable[[Array], Bounds]], sizes: Sequence[int]) -> Callable[[Array], Bounds]:
    """Bounds of several contacts, one after another."""
    ends = np.cumsum(sizes)[:-1]
    return lambda p: Bounds(*map(np.concatenate, zip(*(law(some) for law, some in zip(laws, np.split(p, ends))))))


def _by_pressure(s: Surface, f: ContactForces, scale: Scale, at: Index) -> tuple[Array, Array]:
    """Forces (m, c) on the coupled unknowns of a unit of pressure at the points ``at`` (m,), and slopes (m, c) of λ_n − k_n g.

    Friction of a point that slips follows its pressure, unless it is decided.
    """
    t, by_p = f.t.shape[1], f.by_p
    forces, slopes = f.stencils.act(f.by_pressure), -scale.k_n[:, None] * f.stencils.dg
    if s.exact:
        # r has −F and the multipliers' equations w c (p − λ)/k; the trial pressure has λ = c ℓ itself
        by_row = np.hstack([np.ones((len(by_p), 1)), by_p])
        if f.redundant is not None:
            f.redundant.follow(by_row)
        equations = -(f.weight * scale.unit)[:, None] * by_row / np.stack([scale.k_n, *[scale.k_t] * t], axis=1)
        own = np.hstack([scale.unit[:, None], np.zeros((len(by_p), t))])
        forces, slopes = np.hstack([forces, equations]), np.hstack([slopes, own])
    return forces[at], slopes[at]


def _rows(values: Array, dofs: Index, ndof: int) -> csr_matrix:
    """Rows (m, ndof) with values (m, k) at dofs (m, k)."""
    m, k = dofs.shape
    return csr_matrix((values.ravel(), dofs.ravel(), np.arange(0, m * k + 1, k)), (m, ndof))
