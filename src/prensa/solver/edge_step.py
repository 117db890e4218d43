"""A Newton step that knows which points it opens and closes at the edges of contacts.

Newton's matrix takes the points as they are at the iterate. At the edge of a growing contact a step closes a few too many; the
next one opens them, what they bore opens their neighbours, and so on: three or four factorisations, each for fewer points.
Here the linearised conditions p ≥ 0, k_n g ≥ 0 of these points and of those beside them are met within the step (Josephy 1979),
as `contact_step` does for all that are near a tool, but with Newton's own matrix and factors, which serve afterwards. What a
point bears beside what the matrix has it bear is a force

    v = (1 − a) x + a y,   λ − k_n g = x − y,   x ≥ 0,   y ≥ 0,   x y = 0,

a = 1 where the matrix has the point's spring and 0 where it has none. Each of the points costs a substitution. Friction of a
point that slips follows its pressure; that of one that sticks is left to the next iterate.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, vstack

from prensa.solver.complementarity import complementary
from prensa.solver.contact_lcp import pressed
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.friction_step import as_rows
from prensa.solver.projection import linear_gaps
from prensa.system.loads import Release
from prensa.system.system import Evaluation
from prensa.types import Array, Flags, Index


def with_edges(eq: Equilibrium, e: Evaluation, lam: Array, step: Array) -> Array:
    """Newton's step (ndof,) from the evaluation e, made by the factors at hand, with the points that it changes decided.

    As it was where it changes none, or more than `Policy.edge_max_points`, and with multipliers that have equations;
    lam (points, 1 + t).
    """
    if not applies(eq, e):
        return step
    acts, alone = e.touching, _trial(eq, e, lam, step)
    wrong, near = (alone > 0) != acts, np.isfinite(alone)
    at, found = np.zeros(0, dtype=np.int64), step
    for _ in range(eq.policy.edge_max_rounds if wrong.any() else 0):
        taken = np.union1d(at, _with_those_ahead(eq, wrong, acts, near))
        if len(taken) == len(at) or len(taken) > eq.policy.edge_max_points:
            break
        at = taken
        forces, slopes = _rows(eq, e, at)
        v = _beside_the_matrix(eq, alone[at], eq.reduced.responses(forces, slopes), acts[at])
        if v is None:
            break
        found = step + eq.reduced.solve_with_factors(forces.T @ v)
        wrong = ((_trial(eq, e, lam, found) > 0) != acts) & ~np.isin(np.arange(len(acts)), at)
        if not wrong.any():
            break
    return found


def applies(eq: Equilibrium, e: Evaluation) -> bool:
    """Whether points have springs in the matrix whose factors are at hand, and the iteration may be helped.

    Tools that are pushed or hang on springs, and bodies under loads, may have other equilibria nearby: they are led to none.
    """
    loads = eq.context.interactions[len(eq.context.surfaces) :]
    led = eq.tools_are_moved and all(isinstance(load, Release) for load in loads)
    if not (led and eq.globalised and e.contacts) or len(eq.reduced.free) > eq.policy.edge_max_unknowns:
        return False
    return not eq.reduced.equations and eq.reduced.factorisation.factored


def _trial(eq: Equilibrium, e: Evaluation, lam: Array, step: Array) -> Array:
    """λ − k_n g (points,) after a step (ndof,) by the linear model; minus infinity far from a tool."""
    gaps, k_n = np.concatenate(linear_gaps(e, step)), np.concatenate([scale.k_n for scale in eq.context.scales])
    return np.where(np.isfinite(gaps), lam[:, 0] - k_n * gaps, -np.inf)


def _with_those_ahead(eq: Equilibrium, wrong: Flags, acts: Flags, near: Flags) -> Index:
    """Points ``near`` a tool that are wrong, as many ahead, which may be so after them, and the next one behind."""
    out = wrong.copy()
    for s in eq.context.surfaces:
        here, a, taken = wrong[s.rows], acts[s.rows], out[s.rows]
        for k in range(1, 1 + int(here.sum())):
            for ahead, behind in ((slice(k, None), slice(None, -k)), (slice(None, -k), slice(k, None))):
                taken[ahead] |= here[behind] & ((a[ahead] == a[behind]) | (k == 1))
    return np.flatnonzero(out & near)


def _rows(eq: Equilibrium, e: Evaluation, at: Index) -> tuple[csr_matrix, csr_matrix]:
    """Forces (m, ndof) of a unit of pressure of the points ``at`` (m,), and slopes (m, ndof) of their λ − k_n g."""
    forces, slopes = [], []
    for s, f, scale in zip(eq.context.surfaces, e.contacts, eq.context.scales):
        here = at[(at >= s.rows.start) & (at < s.rows.stop)] - s.rows.start
        dofs, by_gap = s.coupled[here], -scale.k_n[:, None] * f.stencils.dg
        forces.append(as_rows(pressed(f)[here], dofs, eq.system.ndof))
        slopes.append(as_rows(by_gap[here], dofs, eq.system.ndof))
    return vstack(forces, format="csr"), vstack(slopes, format="csr")


def _beside_the_matrix(eq: Equilibrium, alone: Array, response: Array, acts: Flags) -> Array | None:
    """What points (m,) bear beside what the matrix has; ``alone`` (m,): λ − k_n g by that, ``response`` (m, m) to such forces."""
    a = acts.astype(np.float64)
    left, right = np.eye(len(a)) + response * a, np.eye(len(a)) - response * (1.0 - a)
    found = complementary(left, right, -alone, eq.policy)
    return None if found is None else (1.0 - a) * found[0] + a * found[1]
