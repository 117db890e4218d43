"""The linear solver seam: ``analyze(pattern)``, ``factor(values)``, ``solve(b)``; no answer leaves without its residual checked.

In ``auto`` the first that is installed of PARDISO, rslab, SuperLU is used, and the next one takes over when a residual
is too large, with a line in the log: beta solvers are fast but are not believed.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

log = logging.getLogger("prensa")
Array = NDArray[np.float64]

BACKWARD_ERROR = 1e-10  # ‖Ax − b‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞) above which an answer is refused


REFINE = 1e-13  # backward error above which the answer is refined


class SingularError(ArithmeticError):
    """No solver could factor the matrix to an acceptable residual."""


def _superlu(n: int, indptr: Any, indices: Any) -> Callable[[Array], Callable[[Array], Array]]:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    def factor(values: Array) -> Callable[[Array], Array]:
        return splu(csc_matrix((values, indices, indptr), (n, n)), permc_spec="COLAMD").solve

    return factor


def _rslab(n: int, indptr: Any, indices: Any, threads: int = 1) -> Callable[[Array], Callable[[Array], Array]]:
    import rslab
    from scipy.sparse import csc_matrix

    pattern = csc_matrix((np.ones(len(indices)), indices, indptr), (n, n))
    symbolic = rslab.analyze(pattern, path="lu", threads=threads, matching=False)

    def factor(values: Array) -> Callable[[Array], Array]:
        return symbolic.factor(values).solve

    return factor


def _pardiso(n: int, indptr: Any, indices: Any) -> Callable[[Array], Callable[[Array], Array]]:
    import pypardiso
    from scipy.sparse import csc_matrix

    solver = pypardiso.PyPardisoSolver(mtype=11)
    analysed = False

    def factor(values: Array) -> Callable[[Array], Array]:
        nonlocal analysed
        matrix = csc_matrix((values, indices, indptr), (n, n)).tocsr()
        matrix.sort_indices()
        if not analysed:
            solver.set_phase(11)
            solver._call_pardiso(matrix, np.zeros(n))
            analysed = True
        solver.set_phase(22)
        solver._call_pardiso(matrix, np.zeros(n))

        def solve(b: Array) -> Array:
            solver.set_phase(33)
            return np.asarray(solver._call_pardiso(matrix, np.ascontiguousarray(b))).ravel()

        return solve

    return factor


def available(choice: str) -> list[str]:
    """Solvers to try, in order, for a ``numerics.solver`` value."""
    import importlib.util

    if choice != "auto":
        return [choice, *(["superlu"] if choice != "superlu" else [])]
    order = ["pardiso"] if importlib.util.find_spec("pypardiso") else []
    if importlib.util.find_spec("rslab"):
        order.append("rslab")
    return [*order, "superlu"]


class Factorisation:
    """Solver for matrices of one sparsity pattern (CSC ``indptr``, ``indices``, n × n)."""

    def __init__(
        self, n: int, indptr: NDArray[np.int32], indices: NDArray[np.int32], solver: str = "auto", threads: int = 1
    ):
        self.n, self.indptr, self.indices = n, indptr, indices
        self.order = available(solver)
        self.threads = threads
        self._factor: Callable[[Array], Callable[[Array], Array]] | None = None
        self._solve: Callable[[Array], Array] | None = None

    @property
    def factored(self) -> bool:
        """Whether there are factors of an earlier `solve` to use `again`."""
        return self._solve is not None

    def again(self, b: Array) -> Array:
        """Solution (n,) with the factors of the last `solve`; its residual is not checked."""
        assert self._solve is not None
        return np.asarray(self._solve(b))

    def _analyze(self) -> Callable[[Array], Callable[[Array], Array]]:
        name = self.order[0]
        if name == "rslab":
            return _rslab(self.n, self.indptr, self.indices, self.threads)
        return {"superlu": _superlu, "pardiso": _pardiso}[name](self.n, self.indptr, self.indices)

    def solve(self, values: Array, b: Array) -> Array:
        """Solution x (n,) of A x = b for the matrix values (nnz,); raises `SingularError`."""
        from scipy.sparse import csc_matrix

        if self.n == 0:
            return np.zeros(0)
        A = csc_matrix((values, self.indices, self.indptr), (self.n, self.n))
        norm = np.bincount(self.indices, np.abs(values), self.n).max()
        reason = "the matrix has entries that are not numbers"
        if not np.isfinite(values).all():
            raise SingularError(reason)
        fallback = 0
        while True:
            try:
                if self._factor is None:
                    self._factor = self._analyze()
                solve = self._factor(values)
                x = np.asarray(solve(b))
                for _ in range(3):
                    r = b - A @ x
                    error = np.abs(r).max() / (norm * np.abs(x).max() + np.abs(b).max() + 1e-300)
                    if not error > REFINE:
                        break
                    x = x + np.asarray(solve(r))
                if error <= BACKWARD_ERROR:
                    self._solve = solve
                    return x
                reason = f"backward error {error:.1e}"
            except (RuntimeError, ArithmeticError, ValueError) as error:
                reason = str(error)
            if fallback + 1 >= len(self.order):
                raise SingularError(reason)
            # a singular matrix is singular for every solver: the next one confirms it, and only a success is kept
            fallback += 1
            self.order = self.order[1:] + self.order[:1]
            self._factor = None
            log.info("linear solver: %s (%s); trying %s", self.order[-1], reason, self.order[0])
