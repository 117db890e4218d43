"""Bodies that hardly change their volume: the larger part of their bulk stiffness as one unknown pressure an element, for GMRES.

Multigrid of a matrix whose bulk modulus is hundreds of times its shear moduli takes many iterations, most where bricks are no
parallelepipeds. With that part of it as B Gᵀ, a column each element, A x = b is

    [A − B Gᵀ  B] [x]   [b]
    [Gᵀ       −1] [p] = [0]

of the same x. The preconditioner is the block triangle of a cycle of multigrid for the first block, which is that of a
compressible body, and of the diagonal −1/(1 − θ) for the Schur complement: θ is the share that is apart of the bulk stiffness,
which alone holds against pressures of the size of an element (Elman, Silvester & Wathen 2014, Finite Elements and Fast Iterative
Solvers, chapters 3 and 4).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from prensa.types import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from prensa.linear.factorisations import Solve


class PressureApart:
    """A preconditioner of the matrix with pressures, for residuals (n + m,) of its rows.

    B, G (n, m); ``share`` θ (m,); ``cycle``: of multigrid for the symmetric part of A − B Gᵀ.
    """

    def __init__(self, B: csr_matrix, G: csr_matrix, share: Array, cycle: Solve) -> None:
        self.n, self.B, self.G = B.shape[0], B, G.T.tocsr()
        self.cycle, self.schur = cycle, 1.0 / (1.0 - share)
        # what is left of a row of pressures counts as the forces that it makes in its element
        size = np.sqrt(np.asarray(B.multiply(B).sum(axis=0)).ravel())
        self.weight = np.where(size > 0.0, size, 1.0)

    def __call__(self, r: Array) -> Array:
        """See the module."""
        p = -r[self.n :] / (self.weight * self.schur)
        return np.concatenate([self.cycle(r[: self.n] - self.B @ p), p])

    def of(self, A: csr_matrix) -> WithPressures:
        """The matrix with pressures that is equivalent to A."""
        return WithPressures(A, self)

    def extended(self, b: Array) -> Array:
        """A right-hand side (n + m,) for one of A."""
        return np.concatenate([b, np.zeros(len(self.weight))])


class WithPressures:
    """Products with the matrix with pressures of a matrix A."""

    def __init__(self, A: csr_matrix, apart: PressureApart) -> None:
        self.A, self.apart = A, apart

    def __matmul__(self, x: Array) -> Array:
        """The product (n + m,)."""
        a = self.apart
        u, p = x[: a.n], x[a.n :]
        beyond = a.G @ u - p
        return np.concatenate([self.A @ u - a.B @ beyond, a.weight * beyond])
