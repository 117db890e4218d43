"""A Newton step in which the linearised contact conditions hold as the inequalities that they are.

Newton's matrix assumes which points are closed, and an iteration corrects that assumption. Where bodies are soft in bending
and lie flat (a sheet between binder and die), each correction makes the next one necessary: points open and close for ever,
however short the increment. Here bodies are linearised alone (Josephy 1979), and which points are closed comes out of a small
complementarity problem of pressures p ≥ 0 and gaps k_n g ≥ 0. Newton's order stays, and the number of points that change
does not matter. It costs a substitution for each candidate, so it is for increments that Newton's method gave up.

Every candidate rests on a foundation, a spring of a share θ of its k_n that acts open or closed; that keeps the matrix regular
where bodies are held by contact alone. What the pressure is besides the spring's,

    Δp = θ Δ(λ − k_n g) + v,   λ − k_n g = x − y,   p = x ≥ 0,   y ≥ 0,   x y = 0,   so v = (1 − θ) Δx + θ Δy,

acts on the bodies through the response S = −∂(λ − k_n g)/∂v, and (1 − θ S) Δy − (1 + (1 − θ) S) Δx = −Δ(λ − k_n g) of the
springs alone. Friction follows the pressures with its slope ∂t/∂p.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, vstack

from prensa.contact.forces import ContactForces, Scale
from prensa.contact.surface import Surface
from prensa.linear.factorisations import SingularError
from prensa.policy import Policy
from prensa.solver.complementarity import complementary
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.friction_step import Friction, as_rows, tractions
from prensa.solver.projection import linear_gaps
from prensa.system.system import Evaluation
from prensa.types import Array, Flags, Index


class Candidates(NamedTuple):
    """m points that may be closed: forces (m, ndof) by v, −∂r/∂v; slopes (m, ndof) of the trial pressure λ − k_n g, (m,)."""

    forces: csr_matrix
    slopes: csr_matrix
    trial: Array


class ContactStep(NamedTuple):
    """A step (ndof,), and whether it found out itself which points slip, too."""

    step: Array
    decided: bool


def contact_step(
    eq: Equilibrium, u: Array, lam: Array, e: Evaluation, stick: Flags | None, most: int | None = None
) -> ContactStep | None:  # fmt: skip
    """Step from the iterate u (ndof,), whose evaluation is e; None where there is none or it would cost too much.

    stick (points,): contact points that are forced to stick where the step does not decide that; ``most``: candidates to
    begin with at most, `Policy.max_candidates` if not given.

    Few points near a tool are all candidates. Of many (a flange lies near its binder everywhere and touches it nowhere but
    on a ridge) those that are closed are, and then those that a step would take through a tool, until it takes none.
    """
    near, taken = _near(eq, e), _first(eq, e)
    if most is not None and taken.sum() > most:
        return None
    while 0 < taken.sum() <= eq.policy.max_candidates:
        try:
            found = _step_of(eq, u, lam, e, stick, taken)
        except SingularError:
            if taken.sum() == near.sum():
                raise
            found, taken = None, near
            continue
        if found is None or taken.sum() == near.sum():
            return found
        missed = near & ~taken & _passed(eq, e, found.step)
        if not missed.any():
            return found
        taken = taken | missed
    return None


def _step_of(
    eq: Equilibrium, u: Array, lam: Array, e: Evaluation, stick: Flags | None, near: Flags
) -> ContactStep | None:  # fmt: skip
    """As `contact_step`, with the candidates ``near`` (points,)."""
    rubbing = _rubbing(eq, e, near)
    if decided := rubbing is not None:
        stick = None
    else:
        rubbing = np.zeros_like(near)
    shares = eq.policy.foundation_ratio * np.stack([near, rubbing], axis=1).astype(np.float64)
    base = eq.evaluate(u, lam, stick=stick, foundation=shares)
    if base.failed:
        return None
    all_lam = eq.system.multipliers(u, lam)
    points = _candidates(eq, base, near, all_lam)
    friction = rubbed(eq, base, rubbing, all_lam) if rubbing.any() else None
    r = base.r
    with eq.report.timed("factorisation and solve"):
        matrix, base = eq.reduced.matrix(base, -r, spent=True), base._replace(data=None)
        alone = eq.reduced.solve(matrix, -r)
        forces, slopes = points.forces, points.slopes
        if friction is not None:
            forces, slopes = (
                vstack([forces, friction.forces], format="csr"),
                vstack([slopes, friction.slopes], format="csr"),
            )
        S = -eq.reduced.responses(forces, slopes)
        ahead = slopes @ alone
        if friction is None:
            found = _pressures(eq.policy, points.trial, S, ahead)
        else:
            found = tractions(eq.policy, points.trial, friction, rubbing[near], S, ahead)
        step = None if found is None else alone + eq.reduced.solve_with_factors(forces.T @ found)
    # they are not those of Newton's matrix, which finishing substitutions want
    eq.reduced.factorisation.begin()
    return None if step is None else ContactStep(step, decided)


def affordable(eq: Equilibrium, e: Evaluation) -> bool:
    """Whether a contact step from the evaluation e costs no more than another iteration, so that Newton takes them anyway."""
    return not e.contacts or int(_first(eq, e).sum()) <= eq.policy.few_candidates


def decides_friction(eq: Equilibrium, e: Evaluation) -> bool:
    """Whether a contact step from the evaluation e may find out itself which points slip, too; so it does where none can."""
    return _rubbing(eq, e, _first(eq, e)) is not None


def _first(eq: Equilibrium, e: Evaluation) -> Flags:
    """Points (points,) that are candidates from the beginning."""
    near = _near(eq, e)
    if near.sum() <= eq.policy.few_candidates:
        return near
    return near & (np.concatenate([f.p > 0 for f in e.contacts]) | eq.context.state.contact.closed)


def _passed(eq: Equilibrium, e: Evaluation, step: Array) -> Flags:
    """Points (points,) that a step (ndof,) from the evaluation e takes through their tool."""
    return np.concatenate(linear_gaps(e, step)) < 0.0


def _near(eq: Equilibrium, e: Evaluation) -> Flags:
    """Candidates (points,)."""
    share, scales = eq.policy.candidate_gap_ratio, eq.context.scales
    return np.concatenate([np.where(np.isfinite(f.g), f.g, np.inf) < share * sc.h for f, sc in zip(e.contacts, scales)])


def _rubbing(eq: Equilibrium, e: Evaluation, near: Flags) -> Flags | None:
    """Candidates (points,) with friction, which is decided with their pressure; None where that is not done."""
    rubbing = np.zeros_like(near)
    for s, f, law in zip(eq.context.surfaces, e.contacts, eq.context.laws):
        if law is None or law.frictionless or f.bound is None:
            continue
        if s.exact or law.hardens or f.t.shape[1] != 1 or eq.context.picard_friction:
            return None
        rubbing[s.rows] = near[s.rows]
    return rubbing if rubbing.sum() <= eq.policy.few_candidates else None


def _pressures(policy: Policy, trial: Array, S: Array, ahead: Array) -> Array | None:
    """Share v (m,) of the candidates' pressures; ahead (m,): changes of their trial pressures by the springs alone."""
    m, share = len(trial), policy.foundation_ratio
    x, y = np.maximum(trial, 0.0), np.maximum(-trial, 0.0)
    left, right = np.eye(m) - share * S, np.eye(m) + (1.0 - share) * S
    found = complementary(left, right, left @ y - right @ x - ahead, policy)
    return None if found is None else (1.0 - share) * (found[0] - x) + share * (found[1] - y)


def _candidates(eq: Equilibrium, base: Evaluation, near: Flags, lam: Array) -> Candidates:
    """The candidates of all contacts, from an evaluation on their foundation; lam (points, 1 + t) multipliers."""
    parts = [
        _of_surface(s, f, scale, np.flatnonzero(near[s.rows]), lam[s.rows], eq.system.ndof)
        for s, f, scale in zip(eq.context.surfaces, base.contacts, eq.context.scales)
    ]
    return Candidates(
        vstack([p.forces for p in parts], format="csr"),
        vstack([p.slopes for p in parts], format="csr"),
        np.concatenate([p.trial for p in parts]),
    )


def pressed(f: ContactForces) -> Array:
    """Forces (k, m) on the unknowns of stencils of a unit of pressure at their points, with the friction that follows it."""
    along = ((f.area[:, None] * _friction_by_pressure(f))[:, :, None] * f.stencils.e).sum(axis=1)
    return f.stencils.act(f.weight[:, None] * f.stencils.n + along)


def _shares(f: ContactForces) -> Array:
    """Part (k,) of its spring that each point has in the matrix; 1 where it has none."""
    return np.where(f.dp[:, 0] > 0, f.dp[:, 0], 1.0)


def _friction_by_pressure(f: ContactForces) -> Array:
    """∂t/∂p (k, t)."""
    return np.asarray(f.dt[:, :, 0] / _shares(f)[:, None])


def _of_surface(s: Surface, f: ContactForces, scale: Scale, at: Index, lam: Array, ndof: int) -> Candidates:
    """The candidates ``at`` (m,) of one contact."""
    t, share = f.t.shape[1], _shares(f)
    by_p, forces = _friction_by_pressure(f), pressed(f)[at]
    slopes = (f.dp[:, 1 + t :] / share[:, None])[at]
    if s.exact:
        # r has −F and the multipliers' equations w c (p − λ)/k; the trial pressure has λ = c ℓ itself
        c = f.weight * scale.unit
        by_row = np.hstack([np.ones((len(by_p), 1)), by_p])
        if f.redundant is not None:
            by_row[f.redundant.points.tangential, 1] = f.redundant.by_p[f.redundant.points.tangential]
            by_row[f.redundant.points.normal, 0] = 0.0
        rows = -(c[:, None] * by_row / np.stack([scale.k_n, *[scale.k_t] * t], axis=1))[at]
        own = np.zeros((len(at), 1 + t))
        own[:, 0] = scale.unit[at]
        forces, slopes = np.hstack([forces, rows]), np.hstack([slopes, own])
    dofs = s.coupled[at]
    trial = lam[at, 0] - scale.k_n[at] * f.g[at]
    return Candidates(as_rows(forces, dofs, ndof), as_rows(slopes, dofs, ndof), trial)


def rubbed(eq: Equilibrium, base: Evaluation, rubbing: Flags, lam: Array) -> Friction:
    """The candidates with friction of all contacts, from an evaluation on their foundation; lam (points, 2) multipliers."""
    ndof, share = eq.system.ndof, eq.policy.foundation_ratio
    parts = []
    for s, f, scale in zip(eq.context.surfaces, base.contacts, eq.context.scales):
        at = np.flatnonzero(rubbing[s.rows])
        if not len(at):
            continue
        assert f.bound is not None
        forces = f.stencils.act(f.area[:, None] * f.stencils.e[:, 0])[at]
        slopes = (f.dt[:, 0, 2:] / share)[at]
        slid = f.s - eq.context.state.contact.coordinate[s.rows]
        trial = lam[s.rows, 1] - scale.k_t * slid[:, 0]
        dofs = s.coupled[at]
        parts.append(
            Friction(
                as_rows(forces, dofs, ndof), as_rows(slopes, dofs, ndof), trial[at], f.t[at, 0], f.p[at], *f.bound[at].T
            )
        )
    return Friction(
        vstack([p.forces for p in parts], format="csr"),
        vstack([p.slopes for p in parts], format="csr"),
        *(np.concatenate(values) for values in list(zip(*parts))[2:]),
    )
