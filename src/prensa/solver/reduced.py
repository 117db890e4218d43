"""The free part of the system: Newton's matrix on the dofs that are not prescribed, analysed once, factored as often as asked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prensa.fem.system import Evaluation, System
from prensa.model import problem as model
from prensa.solver.eliminated import Tied
from prensa.solver.linear import Factorisation, running
from prensa.solver.multipliers import Equations, determined
from prensa.solver.policy import DEFAULT, Policy

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def weights_of(system: System) -> Array:
    """Weights (ndof,) with which residuals are summed: rows of rotations are moments, divided by a length they are forces."""
    weight = np.ones(system.ndof)
    for t in range(len(system.tools)):
        weight[system.tool_dof(t) + 2] = 1.0 / system.length
    return weight


def equations_of(system: System, fixed: Index) -> list[Equations]:
    """Multiplier equations of the exact contacts, with ``fixed`` dofs prescribed."""
    free = np.ones(system.ndof, dtype=bool)
    free[fixed] = False
    return [
        Equations(i, s, system.pair_slots(s)[:, -2:], free[s.coupled]) for i, s in enumerate(system.surfaces) if s.exact
    ]


class Reduced:
    """The free part of the system: indices of free dofs, their sub-matrix, its factorisation analysed once."""

    def __init__(
        self, system: System, fixed: Index, numerics: model.Numerics, symmetric: bool = False, policy: Policy = DEFAULT
    ):
        n = system.ndof
        self.fixed, self.policy = fixed, policy
        mask = np.ones(n, dtype=bool)
        mask[fixed] = False
        self.free = np.flatnonzero(mask)
        indptr, indices = system.pattern.indptr, system.pattern.indices
        cols = np.repeat(np.arange(n, dtype=np.int32), np.diff(indptr))
        self.tied: Tied | None = None
        if system.ties is not None:
            self.tied = Tied(system.ties, n, fixed, indices, cols)
            self.free = self.tied.free
            pattern = self.tied.indptr, self.tied.indices
        else:
            number = np.cumsum(mask, dtype=np.int32) - 1
            self.entries = mask[indices] & mask[cols]  # as flags: their places take as much memory as the matrix
            ends = running(self.entries)[indptr]
            pattern = np.append(ends[self.free], ends[-1]), number[indices[self.entries]]
        del cols
        # multipliers make a matrix indefinite; without them that takes a free tool, or large compression
        definite = not any(s.exact for s in system.surfaces)
        self.factorisation = Factorisation(
            len(self.free), *pattern, numerics.solver, numerics.threads, symmetric, definite, policy
        )
        self.symmetric = symmetric
        self.weight = weights_of(system)[self.free]
        self.equations = equations_of(system, fixed)
        self.shape = (n, n)
        self.indptr, self.indices = indptr, indices

    def norm(self, r: Array) -> float:
        """Sum of the absolute free residuals, moments divided by a length."""
        return float(np.abs(self.weight * self.part(r)).sum())

    def part(self, r: Array) -> Array:
        """Residuals of the free dofs, those of tied nodes with their masters'."""
        return r[self.free] if self.tied is None else self.tied.part(r)

    def whole(self, x: Array, n: int) -> Array:
        """All dofs (n,) from the free ones, zero where prescribed."""
        if self.tied is not None:
            return self.tied.whole(x)
        out = np.zeros(n)
        out[self.free] = x
        return out

    def apply(self, data: Array, delta: Array) -> Array:
        """K δ with the whole matrix."""
        from scipy.sparse import csc_matrix

        return np.asarray(csc_matrix((data, self.indices, self.indptr), self.shape) @ delta)

    def matrix(self, e: Evaluation, b: Array) -> Array:
        """Values of K_ff for the matrix of an evaluation and the right-hand side b (ndof,) it is for; a copy.

        With it the evaluation can let its own go before the factors come: a tenth of what a run takes at its peak.
        """
        assert e.data is not None
        data = determined(e, b, self.equations, self.policy) if self.equations else e.data
        return data[self.entries] if self.tied is None else self.tied.values(data)

    def solve(self, matrix: Array, b: Array) -> Array:
        """Free dofs (ndof,) with K_ff x_f = b_f, zero where prescribed."""
        return self.whole(self.factorisation.solve(matrix, self.part(b)), len(b))

    def again(self, b: Array) -> Array:
        """As `solve`, with the last factors, unchecked: only for corrections whose effect is looked at."""
        return self.whole(self.factorisation.again(self.part(b)), len(b))
