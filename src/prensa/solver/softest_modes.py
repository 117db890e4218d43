"""The lowest modes of Newton's matrix, from the factors at hand.

An equilibrium is left for another one, without any change of what drives it, where the matrix has a negative eigenvalue. Of
the direct solvers only LDLᵀ counts those (Sylvester's law of inertia): where it finds none there is nothing to look for. LU has
no inertia, its determinant only the parity, and multipliers add negative ones that mean nothing. There the modes are looked at
themselves: a block of forces goes through the factors twice, which leaves the softest modes (subspace iteration; Bathe 1996,
11.6), and the eigenvalues of the map from forces on the free displacements and tools to their displacements, within that block,
say how these answer. Where the symmetric part of the matrix is positive definite none of them can be negative, whatever the
block; where multipliers hold points, what they hold does not move.

Modes that go soft with compression are the lowest ones long before they turn, so that a few columns find them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.linear.factorisations import SingularError
from prensa.linear.reduction import Reduced
from prensa.policy import Policy
from prensa.solver.equilibrium import Equilibrium
from prensa.system.outcome import NewtonResult
from prensa.system.system import System
from prensa.types import Array, Flags


class Modes(NamedTuple):
    """The softest modes of a matrix: how many of them are ``negative``, the ``least`` eigenvalue, its ``mode`` (ndof,).

    Eigenvalues are stiffnesses of modes of unit length, ``stiffness`` (modes,) all of them in order. The mode has a largest
    displacement of 1.
    """

    negative: int
    least: float
    mode: Array
    stiffness: Array


STABLE = Modes(0, np.inf, np.zeros(0), np.zeros(0))


def softest_modes(system: System, reduced: Reduced, policy: Policy, exactly: bool = False) -> Modes | None:
    """The softest modes of the matrix of the last factors; None without factors or free unknowns, or if they are too coarse.

    exactly: of the last matrix by GMRES, for which factors that do not resolve them are a preconditioner; None where that fails.
    """
    factors, free = reduced.factorisation, reduced.free
    bodily = free < system.dofs.tool.slice.stop  # multipliers come last
    if not factors.factored or not bodily.any():
        return None
    # Several are watched: the one that turns may be the third.
    columns = min(policy.watched_modes, int(bodily.sum()))
    # as much as may be left of the softest mode for its sign to count; what the answer misses of stiffer ones does not matter
    share = policy.soft_mode_error if factors.iterates else policy.mode_residual_share
    forces = None
    for sweep in range(policy.max_mode_sweeps):
        basis = _begun(reduced, bodily, columns) if forces is None else np.linalg.qr(forces)[0]
        answer = factors.exactly(basis, share) if exactly else factors.solve_with_factors(basis)
        if answer is None or not np.isfinite(answer).all():
            return None
        forces = np.where(bodily[:, None], answer, 0.0)
        compliance, vectors = np.linalg.eig(basis.T @ forces)
        negative = (compliance.real < 0) & (np.abs(compliance.imag) <= policy.max_mode_residual * np.abs(compliance))
        if not negative.any():
            if sweep > 0:  # one sweep leaves too much of stiffer modes in a random block to say that none is negative
                break
            continue
        # a negative one counts when it is an eigenvalue, not only a Ritz value of a block that is not there yet
        error = np.linalg.norm(forces @ vectors - (basis @ vectors) * compliance, axis=0)
        sure = negative & (error <= policy.max_mode_residual * np.abs(compliance))
        if sweep > 0 and sure.any() and (sure == negative).all():
            break
        negative = sure
    softest = vectors[:, int(np.argmax(np.abs(compliance)))]
    if not exactly and not factors.resolves_soft_modes((basis @ softest).real, (answer @ softest).real):
        return None
    # What is held has no compliance, and a stiffness without bound.
    stiffness = 1.0 / np.where(compliance == 0, np.inf, compliance).real
    at = int(np.argmin(np.where(negative, compliance.real, np.inf)) if negative.any() else np.argmax(compliance.real))
    mode = reduced.restriction.whole((basis @ vectors[:, at]).real, system.ndof)
    mode /= max(float(np.abs(mode[system.dofs.displacement.slice]).max()), 1e-300)
    return Modes(int(negative.sum()), float(stiffness[at]), mode, np.sort(stiffness))


def _begun(reduced: Reduced, bodily: Flags, columns: int) -> Array:
    """Orthonormal forces (f, columns) on ``bodily`` degrees of freedom (f,) to begin with, the same ones each time."""
    kept = reduced.kept.get("forces")
    if kept is None:
        # Not Newton's step or the load: these have the symmetry of the problem, which the buckling mode may not have (chapter 8).
        random = np.random.default_rng(0).standard_normal((len(bodily), columns))
        kept = np.linalg.qr(np.where(bodily[:, None], random, 0.0))[0]
        if len(bodily) < reduced.policy.reuse_max_unknowns:  # of large systems they take more room than making them takes time
            reduced.kept["forces"] = kept
    return kept


def modes_after(eq: Equilibrium, result: NewtonResult) -> Modes | None:
    """The modes of a converged attempt, from its last factors where there are any.

    A contact step may have left none, and those at hand may be of an increment before: then of the matrix at the end, whose
    factors, of double precision, take twice the room.
    """
    factors = eq.reduced.factorisation
    if factors.factored and factors.may_resolve_soft_modes and (modes := softest_modes(eq.system, eq.reduced,
        eq.policy)) is not None:
        return modes
    if factors.factored and (modes := softest_modes(eq.system, eq.reduced, eq.policy, exactly=True)) is not None:
        return modes
    return modes_at(eq, result.u, result.lam, mode=False)


def modes_at(eq: Equilibrium, u: Array, lam: Array, mode: bool = True) -> Modes | None:
    """The modes of the matrix at the dofs u (ndof,) themselves: the last factors are of the iterate before, or of another.

    ``mode``: whether the softest one is wanted where none is negative, too.
    """
    e, factors = eq.evaluate(u, lam), eq.reduced.factorisation
    if e.failed:  # the matrix of a last iterate may be a secant, which is stiffer than the tangent
        return None
    matrix = eq.reduced.matrix(e, -e.r, spent=True)
    try:
        if factors.iterates:
            eq.reduced.step(matrix, -e.r, 1.0)
        else:
            eq.reduced.solve(matrix, -e.r)
    except SingularError:
        return None
    if factors.positive and not mode:
        return STABLE
    return softest_modes(eq.system, eq.reduced, eq.policy, exactly=factors.iterates)
