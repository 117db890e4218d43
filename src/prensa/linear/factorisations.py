"""Sparse factorisations: ``analyze(pattern)``, ``factor(values)``, ``solve(b)``; the residual of every solution is checked.

In ``auto`` the first that is installed of PARDISO, rslab, SuperLU is used, and the next one takes over when a residual
is too large, with a line in the log: beta solvers are fast but are not believed.

Newton's steps need no factors of double precision, nor those of their own matrix: where `Factorisation.step` may, it takes
factors in single precision, or ones of a matrix before, and a few iterations of GMRES with the matrix itself (book, chapter 9).

A matrix whose problem makes it symmetric is factored as LDLᵀ from its lower triangle, at half the cost of LU, and where it
is expected to be definite and the solver has it as LLᵀ, at a third. The residual is that of the whole matrix: one that were
not symmetric would fail the check and go to LU.
"""

from __future__ import annotations

import importlib
import logging
import math
import os
import sys
import threading
import weakref
from collections.abc import Callable, Iterable
from copy import copy
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from prensa.model.problem import SPATIAL_SOLVERS
from prensa.policy import DEFAULT, Policy
from prensa.types import Array, Flags, Ints, Single

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix, csr_matrix

log = logging.getLogger("prensa")
Digits = TypeVar("Digits", np.float64, np.float32)
Solve = Callable[[Array], Array]
Factor = Callable[[Array | Single], Solve]


NO_VALUES = np.zeros(0)


class SingularError(ArithmeticError):
    """No solver could factor the matrix to an acceptable residual."""


GENERAL, SYMMETRIC, DEFINITE = "LU", "LDLᵀ", "LLᵀ"


class Structure(NamedTuple):
    """Structurally symmetric pattern of a matrix, compressed sparse columns, sorted; its ``kind`` of factors; threads to use.

    What factors it is given the lower triangle alone, but for LU. ``spatial``: of bodies in space.
    """

    n: int
    indptr: Ints
    indices: Ints
    kind: str
    threads: int
    spatial: bool = False

    def lower(self) -> tuple[Ints, Ints, Flags]:
        """Index pointers and row indices of the lower triangle, and which of the values are in it."""
        inside = self.indices >= np.repeat(np.arange(self.n, dtype=np.int32), np.diff(self.indptr))
        return running(inside)[self.indptr], self.indices[inside], inside


def running(flags: Flags) -> Ints:
    """Number (n + 1,) of flags (n,) that are set before each place."""
    out = np.zeros(len(flags) + 1, dtype=np.int32)
    np.cumsum(flags, out=out[1:])
    return out


def _superlu(a: Structure) -> Factor:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    def factor(values: Array | Single) -> Solve:
        factors = splu(csc_matrix((values, a.indices, a.indptr), (a.n, a.n)), permc_spec="COLAMD")
        # Eight bytes a value and four an index.
        return _Lasting(factors.solve, lambda b: factors.solve(b, "T"), 12 * factors.nnz)

    return factor


# rslab races fill-reducing orderings. On plane meshes of up to a million dofs nested dissection never won over minimum
# degree and minimum fill, and takes four fifths of the analysis: it stays out
RACE = {"race_nd_min_n": 10**9, "race_eager_nd_min_nnz": 10**12}
# scaling, done by one thread, takes a twentieth of a factorisation; factors that GMRES goes on from are as good without
UNSCALED = {"scaling": "identity"}


def _load_rslab() -> ModuleType:
    """rslab, loaded by a thread that does not end before the process: its memory goes with that thread, and then runs crash."""
    if sys.modules.get("rslab") is None and threading.current_thread() is not threading.main_thread():
        loaded = threading.Event()

        def load_and_stay() -> None:
            try:
                importlib.import_module("rslab")
            finally:
                loaded.set()
            threading.Event().wait()

        threading.Thread(target=load_and_stay, name="rslab", daemon=True).start()
        loaded.wait()
    return importlib.import_module("rslab")


def _rslab(a: Structure) -> Factor:
    from scipy.sparse import csc_matrix

    rslab = _load_rslab()
    pattern = csc_matrix((np.ones(len(a.indices)), a.indices, a.indptr), (a.n, a.n))
    race = {} if a.spatial else RACE  # in space nested dissection wins
    if a.kind == SYMMETRIC:
        ldlt = rslab.analyze(pattern, path="ldlt", threads=a.threads, **race)
        return _Analysed(
            lambda values: _ldlt(ldlt.factor(values, **(UNSCALED if values.dtype == np.float32 else {}))), ldlt.factor_nnz
        )
    # The pattern is analysed with ones for values, by which nothing can be matched.
    symbolic = rslab.analyze(pattern, path="lu", threads=a.threads, matching=False, **race)
    return _Analysed(lambda values: _lu(symbolic.factor(values)), symbolic.factor_nnz)


class _Analysed:
    """A `Factor` whose factors are known to have so many ``entries``."""

    def __init__(self, factor: Factor, entries: int) -> None:
        self.factor, self.entries = factor, entries

    def __call__(self, values: Array | Single) -> Solve:
        return self.factor(values)


class _Factored(Protocol):
    """Factors of rslab."""

    n: int
    dtype: str
    solve: Callable[[Array], Array]
    solve_many: Callable[[Array], Array]


class _Symmetric(_Factored, Protocol):
    """Factors LDLᵀ, with the numbers of positive, negative and zero pivots."""

    inertia: tuple[int, int, int]
    n_perturbed: int


class _General(_Factored, Protocol):
    """Factors LU."""

    solve_transpose: Callable[[Array], Array]
    heap_bytes: int


class _Definite:
    """A `Solve` with factors that say whether all eigenvalues are ``positive``: all pivots are (Sylvester's law of inertia)."""

    def __init__(self, solve: Solve, positive: bool) -> None:
        self.solve, self.positive = solve, positive

    def __call__(self, b: Array) -> Array:
        return self.solve(b)


class _Lasting:
    """A `Solve` with factors that no later ones overwrite; ``transposed``: that of the transpose; ``size``: their bytes."""

    def __init__(self, solve: Solve, transposed: Solve, size: int) -> None:
        self.solve, self.transposed, self.size = solve, transposed, size

    def __call__(self, b: Array) -> Array:
        return self.solve(b)


def _ldlt(factors: _Symmetric) -> Solve:
    """Solve with rslab's factors LDLᵀ."""
    # A pivot that was perturbed has no sign to believe in.
    return _Definite(_columns(factors), factors.inertia[0] == factors.n and not factors.n_perturbed)


def _lu(factors: _General) -> Solve:
    """Solve with rslab's factors LU."""
    return _Lasting(_columns(factors), _in_range(factors, factors.solve_transpose), factors.heap_bytes)


def _columns(factors: _Factored) -> Solve:
    """Solve with rslab's factors for one right-hand side (n,) or for several at once (n, k)."""
    return _in_range(factors, lambda b: factors.solve(b) if b.ndim == 1 else factors.solve_many(b))


def _in_range(factors: _Factored, solve: Solve) -> Solve:
    """A `Solve` with rslab's factors that takes and gives double precision, whatever that of the factors."""
    if factors.dtype != "float32":
        return lambda b: np.asarray(solve(b))

    def of_single(b: Array) -> Array:
        # residuals become smaller than the smallest number of single precision
        size = np.abs(b).max(axis=0)
        size = np.where(size > 0, size, 1.0)
        return size * np.asarray(solve(np.asarray(b / size, dtype=np.float32))).astype(np.float64)

    return of_single


MTYPES = {DEFINITE: 2, SYMMETRIC: -2, GENERAL: 11}


class _Pardiso:
    """PARDISO's handle for one pattern; its memory, which Python does not see, goes with it."""

    def __init__(self, a: Structure) -> None:
        import pypardiso
        from pypardiso.pardiso_wrapper import PyPardisoError

        self.solver = pypardiso.PyPardisoSolver(mtype=MTYPES[a.kind])
        # where it has found MKL: it looks through the whole environment for that each time, and a step makes some of these
        os.environ.setdefault("PYPARDISO_MKL_RT", str(self.solver.libmkl._name))
        # its defaults but for scaling and matching, which would make the analysis, and with it a resumed run, depend on
        # values; our columns are the rows of the transpose, so that is what LU factors (12: solve with its transpose)
        tiny = 8 if a.kind == SYMMETRIC else 13
        for number, value in {1: 1, 2: 2, 10: tiny, 11: 0, 12: 2 if a.kind == GENERAL else 0, 13: 0, 21: 1}.items():
            self.solver.set_iparm(number, value)
        self.error, self.n, self.kind = PyPardisoError, a.n, a.kind
        # the lower triangle by columns is the upper one by rows, which the symmetric types want
        self.indptr, self.indices = a.indptr, a.indices
        self.analysed = False
        weakref.finalize(self, self.solver.free_memory, everything=True).atexit = False

    def call(self, phase: int, matrix: csr_matrix, b: Array) -> Array:
        """One phase: 11 analysis, 22 factors, 33 solution."""
        self.solver.set_phase(phase)
        try:
            return np.asarray(self.solver._call_pardiso(matrix, b))
        except self.error as error:
            raise ArithmeticError(str(error)) from None

    def factor(self, values: Array | Single) -> Solve:
        """Factors of a matrix with these values."""
        from scipy.sparse import csr_matrix

        matrix = csr_matrix((values, self.indices, self.indptr), (self.n, self.n))
        if not self.analysed:
            self.call(11, matrix, np.zeros(self.n))
            self.analysed = True
        self.call(22, matrix, np.zeros(self.n))
        # it replaces zero pivots and goes on: the solution could be anything
        if replaced := int(self.solver.get_iparm(14)):
            raise ArithmeticError(f"{replaced} pivots are zero")
        return _Definite(
            lambda b: self.call(33, matrix, np.asfortranarray(b)).reshape(b.shape, order="F"), self.kind == DEFINITE
        )


def _pardiso(a: Structure) -> Factor:
    return _Pardiso(a).factor


BACKENDS: dict[str, Callable[[Structure], Factor]] = {"superlu": _superlu, "rslab": _rslab, "pardiso": _pardiso}
# solvers that take values of single precision and answer with factors of it
SINGLE = {"rslab"}
# solvers whose factors are overwritten by later ones of the same pattern
OVERWRITTEN = {"pardiso"}


def may_be_detached(solvers: Iterable[str], unknowns: int, policy: Policy = DEFAULT) -> bool:
    """Whether factors stay when later ones are made by any of these solvers, and there is room for both."""
    return not OVERWRITTEN.intersection(solvers) and unknowns <= policy.detach_max_unknowns


# factors that a solver has for symmetric matrices, the cheapest first; all have LU
KINDS = {"superlu": (), "rslab": (SYMMETRIC,), "pardiso": (DEFINITE, SYMMETRIC)}


def available(choice: str) -> list[str]:
    """Direct solvers to try, in order, for a ``numerics.solver`` value; by themselves for one that says how to iterate."""
    import importlib.util

    if choice not in ("auto", *SPATIAL_SOLVERS):
        return [choice, *(["superlu"] if choice != "superlu" else [])]
    order = ["pardiso"] if importlib.util.find_spec("pypardiso") else []
    if importlib.util.find_spec("rslab"):
        order.append("rslab")
    return [*order, "superlu"]


class KeptFactors(NamedTuple):
    """Factors that outlive those that come after them; ``scale``: see `Factorisation`."""

    factors: _Lasting
    scale: Array | None

    @property
    def size(self) -> int:
        """Their bytes."""
        return self.factors.size

    def transposed(self, b: Array) -> Array:
        """Solution (n,) of Aᵀ x = b, unchecked."""
        scale, solve = self.scale, self.factors.transposed
        return solve(b) if scale is None else scale * solve(scale * b)


class Factorisation:
    """Solver for matrices of one sparsity pattern (CSC ``indptr``, ``indices``, n × n).

    ``symmetric``: their values are so too; ``definite``: most of those are expected to be positive definite. One that is
    not goes to LDLᵀ, at the cost of an attempt that ends early. ``scale`` (n,): of rows and columns alike, powers of two that
    make all of one unit, so that pivots and residuals do not depend on it.

    ``made_from``: values in single precision, scaled, of the matrix whose factors are at hand, of its lower triangle where it is
    symmetric; None where the factors are of double precision.
    """

    krylov_iterations, iterates = 0, False  # those of `step` are few, and with factors of the matrix itself

    def __init__(
        self,
        n: int,
        indptr: Ints,
        indices: Ints,
        solver: str = "auto",
        threads: int = 1,
        symmetric: bool = False,
        definite: bool = False,
        policy: Policy = DEFAULT,
        scale: Array | None = None,
        spatial: bool = False,
    ):
        self.policy, self.scale = policy, scale
        self.structure = Structure(n, indptr, indices, GENERAL, threads, spatial)
        # The fastest solver first, its cheapest factors first; LU of the next one takes over where residuals are too large.
        self.first = [
            (name, kind)
            for name in available(solver)
            for kind in (*(KINDS[name] if symmetric else ()), GENERAL)
            if definite or kind != DEFINITE
        ]
        self.order = list(self.first)
        self._factors: dict[tuple[str, str], Factor] = {}
        self._inside: Flags | None = None  # which of the values are in the lower triangle
        self._solve: Solve | None = None
        self.made_from: Single | None = None
        self._own, self._single = False, True
        self._matrix: Any = None
        self._frame: Any = None  # a matrix of the pattern, for the values of the one that is being solved
        self._points_changed = 0  # contact points that have another status in that matrix than in that of the factors
        self._to_check: Any = None  # the matrix of factors in single precision that may not resolve soft modes
        self._soft_mode_error = True

    def begin(self, made_from: Single | None = None) -> None:
        """Forget factors and fallbacks of earlier attempts, so that an attempt depends on its arguments alone.

        made_from: values of single precision whose factors an attempt begins with; if they are not at hand they are made again.
        """
        # Nothing of an earlier attempt may remain, or a resumed run, which knows of none, would have other bits.
        self.order, self._single, self._own, self._matrix = list(self.first), True, False, None
        self._to_check, self._points_changed = None, 0
        if made_from is not None and made_from is self.made_from and self._solve is not None:
            return
        self._solve, self.made_from = None, None
        if made_from is None or not self._worth_single:
            return
        self._solve = self._of_single(made_from)
        self.made_from = made_from if self._solve is not None else None

    @property
    def _worth_single(self) -> bool:
        """Whether factors of single precision may be taken, and save something."""
        # Below that size little is saved, and runs with derivatives, which need factors in double precision there, must take
        # the same increments as runs without.
        return self._single and self.structure.n >= self.policy.single_precision_from and self.order[0][0] in SINGLE

    @property
    def factored(self) -> bool:
        """Whether there are factors of an earlier `solve` of this attempt for `solve_with_factors`."""
        return self._solve is not None

    @property
    def own(self) -> bool:
        """Whether the factors were made since `begin`, and are so near their matrix that they resolve its softest modes."""
        if self._own and self._to_check is not None:
            assert self._solve is not None
            self._soft_mode_error = self.believed(self._to_check, self._solve)
            self._to_check = None
        return self._own and self._soft_mode_error

    def believed(self, A: csc_matrix | csr_matrix, solve: Solve) -> bool:
        """Whether factors of single precision of a matrix near A are so near that they resolve its softest modes."""
        return departure(A, solve) <= self.policy.soft_mode_error

    @property
    def may_resolve_soft_modes(self) -> bool:
        """Whether the factors were made since `begin`, and nothing is known yet against their softest modes."""
        return self._own and (self._to_check is not None or self._soft_mode_error)

    def resolves_soft_modes(self, b: Array, x: Array) -> bool:
        """As `own`, where x (n,) is what the factors answer to the forces b (n,) of the softest mode."""
        if self._own and self._to_check is not None:
            scale = 1.0 if self.scale is None else self.scale
            b, x = scale * b, x / scale
            self._soft_mode_error = length(self._to_check @ x - b) <= self.policy.soft_mode_error * length(b)
            self._to_check = None
        return self._own and self._soft_mode_error

    @property
    def positive(self) -> bool:
        """Whether the last factors show that all eigenvalues of their matrix are positive; False where they cannot show it."""
        return bool(getattr(self._solve, "positive", False)) and self.own

    def solve_with_factors(self, b: Array) -> Array:
        """Solution of b (n,) or (n, k) with the factors of the last `solve`; its residual is not checked."""
        assert self._solve is not None
        if self.scale is None:
            return np.asarray(self._solve(b))
        scale = self.scale if b.ndim == 1 else self.scale[:, None]
        return scale * np.asarray(self._solve(scale * b))

    def kept(self) -> KeptFactors | None:
        """The last factors, to keep them; None where later ones take their place, or they are symmetric, which are cheap."""
        return KeptFactors(self._solve, self.scale) if isinstance(self._solve, _Lasting) else None

    def detach(self) -> Factorisation:
        """The same with the factors at hand; what the two do to theirs from here on is their own, in threads of their own too.

        Itself where a solver's later factors take the place of those at hand, or there may be no room for twice as many.
        """
        if not may_be_detached((name for name, _ in self.order), self.structure.n, self.policy):
            return self
        out = copy(self)
        out.order, out._factors, out._frame = list(self.order), dict(self._factors), None
        return out

    @property
    def holds_matrix(self) -> bool:
        """Whether the matrix of the last `step` is kept for corrections: that of a large system, by GMRES."""
        return self._matrix is not None

    @property
    def follows(self) -> bool:
        """Whether corrections had better be those of the matrix at an iterate: factors LDLᵀ are too cheap to be saved by that."""
        return self._worth_single and self.order[0][1] == GENERAL

    def follow(self, values: Array, changed: int) -> None:
        """Let corrections be those of another matrix (nnz,), near the last one but for contact points that have ``changed``."""
        from scipy.sparse import csc_matrix

        n, indptr, indices = self.structure[:3]
        self._matrix = csc_matrix((self.scaled(values), indices, indptr), (n, n))
        self._points_changed += changed

    def correction(self, b: Array, share: float | None = None) -> Array:
        """Solution of b (n,) to a few digits, or but for a ``share``, of the matrix of the last `step`, `solve` or `follow`."""
        if self._matrix is not None and self._solve is not None:
            scale = 1.0 if self.scale is None else self.scale
            outliers, usual = self.policy.gmres_iterations_per_point * self._points_changed, self.policy.expected_rate
            # Where GMRES misses what was asked for it is tried with the usual rate, before the factors alone, which may be of a
            # matrix before.
            for left in (usual,) if share is None or share >= usual else (share, usual):
                x = krylov(self._matrix, self._solve, scale * b, self.policy.gmres_max_iterations, left, outliers)
                if x is not None:
                    return scale * x
        return self.solve_with_factors(b)

    def exactly(self, b: Array, share: float) -> Array | None:
        """Solutions (n, k) of b (n, k), but for a ``share``, of the last matrix by factors of single precision of this attempt.

        None where there are none, they have a negative pivot, or GMRES does not lead there.
        """
        if self._matrix is None or self._solve is None or not (self._own and getattr(self._solve, "positive", True)):
            return None
        scale = np.ones(len(b)) if self.scale is None else self.scale
        out = np.empty_like(b)
        for k in range(b.shape[1]):
            x = krylov(self._matrix, self._solve, scale * b[:, k], self.policy.gmres_max_iterations, share)
            if x is None:
                return None
            out[:, k] = scale * x
        return out

    def _factor(self) -> Factor:
        """Factoriser of the solver in turn, analysed when first asked for: that depends on the pattern alone."""
        name, kind = self.order[0]
        if self.order[0] not in self._factors:
            part = self.structure._replace(kind=kind)
            if kind != GENERAL:
                indptr, indices, self._inside = self.structure.lower()
                part = part._replace(indptr=indptr, indices=indices)
            self._factors[name, kind] = BACKENDS[name](part)
        return self._factors[name, kind]

    def _part(self, values: Array, kind: type[Digits]) -> NDArray[Digits]:
        """Of matrix values (nnz,) those that the solver in turn takes, as numbers of a ``kind``; infinite beyond its range."""
        self._factor()  # knows which they are
        with np.errstate(over="ignore"):
            if self.order[0][1] == GENERAL:
                return values.astype(kind, copy=False)
            assert self._inside is not None
            out, end, stretch = np.empty(np.count_nonzero(self._inside), dtype=kind), 0, DEFAULT.block_values
            for first in range(0, len(values), stretch):
                kept = values[first : first + stretch][self._inside[first : first + stretch]]
                out[end : end + len(kept)] = kept
                end += len(kept)
        return out

    def _single_part(self, values: Array) -> Single | None:
        """As `_part` in single precision; None beyond its range."""
        try:
            out = self._part(values, np.float32)
        except (RuntimeError, ArithmeticError, ValueError):
            return None
        return out if np.isfinite(out).all() else None

    def analyse(self) -> None:
        """Analyse the pattern now, for the solver that is tried first: the first matrix need not wait for it then."""
        self._factor()

    @property
    def size(self) -> int:
        """Bytes of factors in double precision by the solver that is tried first; 0 where it does not say that before."""
        return np.dtype(np.float64).itemsize * int(getattr(self._factor(), "entries", 0))

    def step(self, values: Array, b: Array, share: float, changed: int | None = None) -> Array:
        """As `solve`, but for a ``share`` of b that may be left of it; raises `SingularError`.

        changed: contact points but for which the factors at hand are likely to be of a matrix close to this one; None where
        they are not.
        """
        from scipy.sparse import csc_matrix

        policy, (n, indptr, indices) = self.policy, self.structure[:3]
        if not self._worth_single:
            return self.solve(values, b)
        scale = 1.0 if self.scale is None else self.scale
        A = csc_matrix((self.scaled(values), indices, indptr), (n, n))
        x, self._matrix = None, None
        apart = None if changed is None else self._points_changed + changed
        # factors LDLᵀ are too cheap to be replaced by as many iterations as points apart take
        few = policy.same_matrix_points if self.order[0][1] == GENERAL else 0
        if apart is not None and apart <= few and self._solve is not None:
            x = krylov(A, self._solve, scale * b, policy.gmres_max_iterations, share, policy.gmres_iterations_per_point * apart)
            if x is not None:
                self._matrix, self._points_changed = A, apart
        if x is None:
            x = self._in_single(A, scale * b, share)
        if x is None:
            # For the rest of the attempt: where a matrix defeats single precision, those after it do too, and each try costs a
            # factorisation.
            self._single = False
            return self.solve(values, b)
        return scale * x

    def _in_single(self, A: csc_matrix, b: Array, share: float) -> Array | None:
        """As `step`, by factors in single precision, which stay; None where they do not lead to it."""
        self._solve, self.made_from, self._to_check, self._points_changed = None, None, None, 0
        single = self._single_part(A.data)
        solve = None if single is None else self._of_single(single)
        x = None if solve is None else krylov(A, solve, b, self.policy.gmres_max_iterations, share)
        if x is not None:
            self._solve, self.made_from, self._own, self._to_check, self._matrix = solve, single, True, A, A
        return x

    def coarse(self, values: Array) -> bool:
        """Factors in single precision for `solve_with_factors`, unchecked; whether there are any."""
        self._solve, self.made_from, self._matrix, self._to_check = None, None, None, None
        if self.order[0][0] in SINGLE:
            single = self._single_part(self.scaled(values))
            self._solve = None if single is None else self._of_single(single)
            self.made_from = single if self._solve is not None else None
        return self._solve is not None

    def _of_single(self, values: Single) -> Solve | None:
        """Factors of those values that the solver takes, in single precision, scaled; None if there are none."""
        try:
            return self._factor()(values)
        except (RuntimeError, ArithmeticError, ValueError):
            return None

    def scaled(self, values: Array) -> Array:
        """Matrix values (nnz,) in the units of ``scale``."""
        if self.scale is None:
            return values
        return values * self.scale[self.structure.indices] * np.repeat(self.scale, np.diff(self.structure.indptr))

    def solve(self, values: Array, b: Array) -> Array:
        """Solution x (n,) of A x = b for the matrix values (nnz,), as exact as it can be; raises `SingularError`."""
        if self.structure.n == 0:
            return np.zeros(0)
        if self.scale is not None:
            values, b = self.scaled(values), self.scale * b
        largest = max(float(values.max(initial=0.0)), -float(values.min(initial=0.0)))
        if not np.isfinite(largest):
            raise SingularError("the matrix has entries that are not numbers")
        A = self._framed(values)
        try:
            return self._by_some_solver(A, largest, values, b)
        finally:
            # The frame outlives the solve: with its values it would hold a matrix that nobody needs.
            A.data = NO_VALUES

    def _framed(self, values: Array) -> csc_matrix:
        """The matrix with these values, always the same object: to make one takes longer than to multiply with it."""
        if self._frame is None:
            from scipy.sparse import csc_matrix

            n, indptr, indices = self.structure[:3]
            self._frame = csc_matrix((values, indices, indptr), (n, n))
        self._frame.data = values
        return self._frame

    def _by_some_solver(self, A: csc_matrix, largest: float, values: Array, b: Array) -> Array:
        """Solution by the first solver that finds one; see `_checked`."""
        fallback = 0
        while True:
            try:
                x = self._checked(A, largest, values, b)
                return x if self.scale is None else self.scale * x
            except (RuntimeError, ArithmeticError, ValueError) as error:
                reason = str(error)
            if fallback + 1 >= len(self.order):
                raise SingularError(reason)
            # a singular matrix is singular for every solver: the next one confirms it, and only a success is kept
            fallback += 1
            self.order = self.order[1:] + self.order[:1]
            last, now = (" ".join(way) for way in (self.order[-1], self.order[0]))
            log.info("linear solver: %s (%s); trying %s", last, reason, now)

    def _checked(self, A: csc_matrix, largest: float, values: Array, b: Array) -> Array:
        """Solution by the solver in turn, refined as needed; raises `ArithmeticError` if its residual stays too large.

        ``largest``: size of the largest of the values.
        """
        policy = self.policy
        # the old factors go before the new ones come
        self._solve, self.made_from, self._matrix, self._to_check, self._points_changed = None, None, None, None, 0
        factor = self._factor()
        solve = factor(self._part(values, np.float64))
        x = np.asarray(solve(b))
        for _ in range(policy.max_refinements):
            r = b - A @ x
            error = _backward_error(A, x, b, r, largest, policy.refine_backward_error)
            if not error > policy.refine_backward_error:
                break
            x = x + np.asarray(solve(r))
        if not error <= policy.max_backward_error:
            raise ArithmeticError(f"backward error {error:.1e}")
        self._solve, self._own, self._soft_mode_error = solve, True, True
        return x


def _backward_error(A: csc_matrix | csr_matrix, x: Array, b: Array, r: Array, largest: float, enough: float) -> float:
    """‖r‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞) of a solution x (n,) that leaves r (n,), or a bound of it that is no more than ``enough``.

    ``largest``: size of the largest entry of A, which ‖A‖∞ is no less than. That bounds it without a look at all of A.
    """
    left, size, forces = (float(np.abs(v).max()) for v in (r, x, b))
    bound = left / (largest * size + forces + 1e-300)
    if bound <= enough:
        return bound
    rows = np.zeros(len(b))
    for first in range(0, len(A.data), DEFAULT.block_values):  # beside the factors there is no room for a second matrix
        part = slice(first, first + DEFAULT.block_values)
        rows += np.bincount(A.indices[part], np.abs(A.data[part]), len(b))
    return left / (float(rows.max()) * size + forces + 1e-300)


def krylov(
    A: csc_matrix | csr_matrix, solve: Solve, b: Array, most: int, share: float, outliers: int = 0, least: int = 1
) -> Array | None:  # fmt: skip
    """Solution x (n,) of A x = b but for a ``share`` of b, by GMRES (Saad & Schultz 1986) with ``solve`` as preconditioner.

    None where ``most`` iterations are not enough or, at the rate of those so far, would not be. ``outliers``: eigenvalues that
    are expected to lie apart, each of which takes an iteration more, that says nothing of the rate. ``least``: iterations after
    which the rate is believed. Flexible (Saad 1993): with factors of single precision the preconditioner is not quite linear.
    """
    # GMRES and not iterative refinement, which may diverge with factors of an earlier matrix where this takes one more
    # iteration.
    size = length(b)
    if not np.isfinite(size):
        return None
    if size == 0.0:
        return np.zeros_like(b)
    most += outliers
    V, Z, R, turns, g = [b / size], list[Array](), list[list[float]](), list[tuple[float, float]](), [size]
    for j in range(most):
        Z.append(solve(V[j]))
        # Modified Gram and Schmidt: few vectors, each product once.
        w, column = A @ Z[j], list[float]()
        for v in V:
            column.append(product(w, v))
            w -= column[-1] * v
        beyond = length(w)
        # Givens' rotations make the Hessenberg matrix an upper triangle R, column by column
        for i, (c, s) in enumerate(turns):
            column[i], column[i + 1] = c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]
        radius = math.hypot(column[j], beyond)
        if not (radius > 0.0 and all(map(math.isfinite, (radius, *column)))):
            return None
        turns.append((column[j] / radius, beyond / radius))
        column[j] = radius
        R.append(column)
        g[j:] = turns[j][0] * g[j], -turns[j][1] * g[j]
        left = abs(g[j + 1]) / size
        if left <= share or beyond == 0.0:
            x = np.zeros_like(b)
            for z, factor in zip(Z, _backwards(R, g)):
                x += factor * z
            # The recurrence may promise more than there is; the factor 2 is the margin between it and the true residual.
            return x if length(b - A @ x) <= 2.0 * share * size else None
        # At the mean rate so far, would all iterations leave more than the share? Outlying eigenvalues take iterations that
        # say nothing of the rate.
        counted = j + 1 - outliers
        if j >= least and counted > 0 and counted * math.log(share) < (most + 1 - outliers) * math.log(left):
            return None
        V.append(w / beyond)
    return None


def _backwards(R: list[list[float]], g: list[float]) -> list[float]:
    """Solution y of R y = g for the columns of an upper triangle."""
    y = g[: len(R)]
    for k in reversed(range(len(R))):
        y[k] /= R[k][k]
        for i in range(k):
            y[i] -= R[k][i] * y[k]
    return y


def departure(A: csc_matrix | csr_matrix, solve: Solve, sweeps: int = 2) -> float:
    """|A x − b| / |b| where factors of a matrix near A say A x = b and x is the softest of its modes, by inverse iteration.

    Above 1 those factors may have the wrong sign of that mode's stiffness, far below it they have the right one.
    """
    # Not Newton's step or its load: with the symmetry of the problem they have no part in the mode in which a column buckles.
    # A bound by norms and unit round-off would refuse large sound bodies long before slender ones.
    x = np.random.default_rng(0).standard_normal(A.shape[0])
    b = x
    for _ in range(sweeps):
        b = x / length(x)
        x = solve(b)
        if not np.isfinite(x).all() or not x.any():
            return np.inf
    return length(A @ x - b)


def product(a: Array, b: Array) -> float:
    """a·b of vectors (n,), the same whatever number of threads the numerical library has: it shares out long ones."""
    return float(a @ b) if len(a) <= DEFAULT.serial_dot_length else float(np.einsum("i,i->", a, b))


def length(a: Array) -> float:
    """|a| of a vector (n,), see `product`."""
    return float(np.sqrt(product(a, a)))


class DenseFactors:
    """Factors of a dense matrix, with what attempts use of the interface of `Factorisation`."""

    made_from: Single | None = None
    may_resolve_soft_modes = True
    krylov_iterations, iterates = 0, False

    def __init__(self, policy: Policy, scale: Array | None = None) -> None:
        self.policy, self.scale = policy, scale
        self._factors: tuple[Array, Any] | None = None

    def begin(self, made_from: Single | None = None) -> None:
        """Forget the factors of earlier attempts."""
        self._factors = None

    def step(self, values: Array, b: Array, share: float, changed: int | None = None) -> Array:
        """As `solve`."""
        return self.solve(values, b)

    holds_matrix = follows = False

    def follow(self, values: Array, changed: int) -> None:
        """Nothing: corrections are those of the factors."""

    def correction(self, b: Array, share: float | None = None) -> Array:
        """As `solve_with_factors`."""
        return self.solve_with_factors(b)

    def analyse(self) -> None:
        """Nothing: there is no pattern."""

    def exactly(self, b: Array, share: float) -> Array | None:
        """As `solve_with_factors`."""
        return self.solve_with_factors(b)

    def coarse(self, values: Array) -> bool:
        """False: dense factors are of double precision."""
        return False

    def detach(self) -> DenseFactors:
        """As `Factorisation.detach`."""
        return copy(self)

    def kept(self) -> KeptFactors | None:
        """None: nobody goes backwards with dense factors."""
        return None

    def resolves_soft_modes(self, b: Array, x: Array) -> bool:
        """True: dense factors are of double precision."""
        return True

    @property
    def factored(self) -> bool:
        """Whether there are factors for `solve_with_factors`."""
        return self._factors is not None

    @property
    def positive(self) -> bool:
        """False: the signs of the eigenvalues are not known."""
        return False

    def solve_with_factors(self, b: Array) -> Array:
        """Solution with the factors of the last `solve`."""
        from scipy.linalg.lapack import dgetrs

        assert self._factors is not None
        if not len(b):
            return b
        scale: Any = 1.0 if self.scale is None else self.scale if b.ndim == 1 else self.scale[:, None]
        return np.asarray(scale * dgetrs(*self._factors, scale * b)[0])

    def solve(self, M: Array, b: Array) -> Array:
        """Solution of M x = b, refined once; raises `SingularError`."""
        from scipy.linalg.lapack import dgetrf

        if not len(b):
            return b
        if not np.isfinite(M).all():
            raise SingularError("the matrix has entries that are not numbers")
        scale: Any = 1.0 if self.scale is None else self.scale
        M = M if self.scale is None else scale[:, None] * M * scale
        lu, pivots, info = dgetrf(M)
        if info > 0:
            raise SingularError("a pivot is zero")
        self._factors = lu, pivots
        x = self.solve_with_factors(b)
        x = x + self.solve_with_factors(b - M @ (x / scale) / scale)
        b, y = scale * b, x / scale
        norm = np.abs(M).sum(axis=1).max()
        error = np.abs(b - M @ y).max() / (norm * np.abs(y).max() + np.abs(b).max() + 1e-300)
        if not error <= self.policy.max_backward_error:
            self._factors = None
            raise SingularError(f"backward error {error:.1e}")
        return x
