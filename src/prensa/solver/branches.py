"""Limit points of contact and friction: active sets whose tangents have determinants of opposite signs.

The equations of contact with friction are smooth on each active set (which points are closed, which of them slip) alone. Where
the tangents of two sets that an iteration goes to and fro between have determinants of opposite signs, the map is not coherently
oriented: the path of equilibria folds back where the sets meet, as at a limit point, and there is no equilibrium beyond
(Klarbring 1990, Ing. Arch. 60, 529; Scholtes 2012, Introduction to Piecewise Differentiable Equations, 2.3). No tangent
need be near singular there, so that the modes of a single one do not show it.
"""

from __future__ import annotations

import numpy as np

from prensa.contact.forces import ContactSets
from prensa.linear.factorisations import SingularError
from prensa.solver.equilibrium import Equilibrium
from prensa.system.interaction import ActiveSets
from prensa.system.outcome import NewtonResult
from prensa.types import Array, Index


def eigenvalue_across_sets(eq: Equilibrium, result: NewtonResult) -> float | None:
    """The negative eigenvalue that a tangent has on one of the active sets that the iteration tried and not on another.

    It is that of the tangent condensed onto the unknowns in which the two differ (a stiffness). None where all determinants have
    the same sign, and with multipliers, whose equations change with the set.
    """
    sets = list(result.active_sets.values())
    # Equations of multipliers are others on another set: their determinants do not compare.
    if eq.reduced.equations or len(sets) < 2:
        return None
    try:
        matrix = _tangent(eq, result, sets[-1])
        if matrix is None:
            return None
        eq.reduced.factorisation.solve(matrix, np.zeros(len(eq.reduced.free)))
        for other in sets[-2::-1]:
            there = _tangent(eq, result, other)
            if there is not None and (found := _negative(eq, matrix, there)) is not None:
                return found
    except (SingularError, np.linalg.LinAlgError):
        return None
    return None


def _tangent(eq: Equilibrium, result: NewtonResult, contacts: tuple[ContactSets, ...]) -> Array | None:
    """Values of the tangent in the free unknowns at the last iterate, with all contact points in the given sets."""
    sets = ActiveSets(contacts, (None,) * len(eq.system.blocks))
    e = eq.evaluate(result.u, result.lam, active_sets=sets)
    if e.failed:
        return None
    return eq.reduced.matrix(e, -e.r, spent=True)


def _negative(eq: Equilibrium, a: Array, b: Array) -> float | None:
    """The least real eigenvalue of a and b, condensed onto where they differ, if their determinants have opposite signs.

    det b / det a = det(1 + (b − a) a⁻¹), which is that of the rows and columns in which they differ; ``a`` has been factored.
    """
    whole = eq.reduced.restriction.sparse(b - a)
    at = np.unique(np.concatenate(whole.nonzero()))
    if not len(at):
        return None
    change, compliance = whole[at][:, at].toarray(), _compliance(eq, at)
    if not np.linalg.slogdet(np.eye(len(at)) + change @ compliance)[0] < 0:
        return None
    stiffness = np.linalg.inv(compliance)
    values = np.concatenate([np.linalg.eigvals(stiffness), np.linalg.eigvals(stiffness + change)])
    return float(values.real[values.imag == 0].min())


def _compliance(eq: Equilibrium, at: Index) -> Array:
    """Displacements (k, k) of the free unknowns ``at`` (k,) under unit forces on them, with the last factors."""
    width = eq.policy.columns_at_once
    out = np.empty((len(at), len(at)))
    for first in range(0, len(at), width):
        loaded = at[first : first + width]
        forces = np.zeros((len(eq.reduced.free), len(loaded)))
        forces[loaded, np.arange(len(loaded))] = 1.0
        out[:, first : first + width] = eq.reduced.factorisation.solve_with_factors(forces)[at]
    return out
