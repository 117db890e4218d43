"""The equations in the free dofs: assembly, restriction and factors put together; condensed bodies are another such three."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol, Unpack

import numpy as np

from prensa.linear.constraints import Tied
from prensa.linear.factorisations import Factorisation, KeptFactors, running
from prensa.linear.iterative import Iterative, ways_of
from prensa.linear.multipliers import Equations, determined
from prensa.linear.symmetric_part import SymmetricPart
from prensa.linear.threads import threads_of
from prensa.model import problem as model
from prensa.policy import DEFAULT, Policy
from prensa.system.assembly import Pattern
from prensa.system.interaction import Context, Overrides
from prensa.system.schedule import Control
from prensa.system.system import Evaluation, System
from prensa.types import Array, Flags, Index, Single

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix, csr_matrix


def weights_of(system: System) -> Array:
    """Weights (ndof,) with which residuals are summed: rows of rotations are moments, divided by a length they are forces."""
    weight = np.ones(system.ndof)
    for t in range(len(system.tools)):
        weight[system.dofs.tool.dofs(t)[system.dofs.dimension :]] = 1.0 / system.length
    return weight


def in_lengths(weight: Array) -> Array | None:
    """Powers of two next to weights (f,), which make rotations lengths and moments forces; None where there are none."""
    # Powers of two only move exponents: scaled and unscaled matrices have the same digits.
    return None if (weight == 1.0).all() else np.exp2(np.round(np.log2(weight)))


def equations_of(system: System, fixed: Index) -> list[Equations]:
    """Multiplier equations of the exact contacts, with ``fixed`` dofs prescribed."""
    free = np.ones(system.ndof, dtype=bool)
    free[system.prescribed(fixed)] = False
    supports, t = system.supports(system.surfaces, fixed), system.dofs.dimension - 1
    return [
        Equations(i, s, system.pair_slots(s)[:, -1 - t :], free[s.coupled], supports[i])
        for i, s in enumerate(system.surfaces)
        if s.exact
    ]


class Assembly(Protocol):
    """Where residuals and matrices in all dofs come from: a `System`, or what stands in for it."""

    def evaluate(
        self, c: Context, u: Array, lam: Array, stiffness: bool = True, **overrides: Unpack[Overrides]
    ) -> Evaluation:  # fmt: skip
        """As `System.evaluate`."""

    def apply(self, data: Array, delta: Array) -> Array:
        """K δ (ndof,) for the matrix values of an evaluation."""


class Restriction(Protocol):
    """From all dofs to the free ones (f,) and back."""

    @property
    def free(self) -> Index:
        """The free dofs (f,)."""

    @property
    def rows(self) -> Index:
        """The dofs (f,) whose equations are solved: the free ones; with displacement control that of the lead for the factor."""

    def part(self, r: Array) -> Array:
        """Residuals of the free dofs (f,), those of tied nodes with their masters'."""

    def whole(self, x: Array, n: int) -> Array:
        """All dofs (n,) or (n, k) from the free ones, zero where prescribed."""

    def values(self, data: Array, spent: bool = False) -> Array:
        """Values of K_ff for the matrix values of an evaluation; a copy, or in the place of those that are ``spent``."""

    def sparse(self, values: Array) -> csc_matrix:
        """The matrix (f, f) of such values."""


class Factors(Protocol):
    """Factors of K_ff."""

    @property
    def factored(self) -> bool:
        """Whether there are factors for `solve_with_factors`."""

    @property
    def positive(self) -> bool:
        """Whether they show that all eigenvalues are positive; False where they cannot show it."""

    @property
    def may_resolve_soft_modes(self) -> bool:
        """Whether they were made in this attempt, and are not known to be too far from their matrix to resolve soft modes."""

    def resolves_soft_modes(self, b: Array, x: Array) -> bool:
        """Whether they resolve the softest modes: x (f,) is what they answer to the forces b (f,) of the softest."""

    @property
    def made_from(self) -> Single | None:
        """Values of single precision whose factors they are; None where they are of double precision."""

    @property
    def iterates(self) -> bool:
        """Whether solutions are found by GMRES with factors of another matrix, which say nothing of this one."""

    @property
    def krylov_iterations(self) -> int:
        """Iterations of GMRES since `begin`, of systems that are solved so wherever they can be (in space); else 0."""

    def analyse(self) -> None:
        """Make ready what depends on the pattern alone."""

    @property
    def holds_matrix(self) -> bool:
        """Whether a matrix is kept beside the factors, as of large systems."""

    def begin(self, made_from: Single | None = None) -> None:
        """Forget the factors of earlier attempts; ``made_from``: values whose factors the next one begins with."""

    def step(self, matrix: Array, b: Array, share: float, changed: int | None = None) -> Array:
        """As `solve`, but for a ``share`` of b; ``changed``: points in which alone factors at hand are of another matrix."""

    @property
    def follows(self) -> bool:
        """Whether corrections had better be those of the matrix at an iterate (see `follow`)."""

    def follow(self, matrix: Array, changed: int) -> None:
        """Let corrections be those of another matrix; ``changed``: points with another status than in the last."""

    def correction(self, b: Array, share: float | None = None) -> Array:
        """Solution (f,) to a few digits, or but for a ``share``, of the last matrix, with whatever factors are at hand."""

    def exactly(self, b: Array, share: float) -> Array | None:
        """Solutions (f, k) of the last matrix but for a ``share``, by factors of this attempt; None if they are not to be had."""

    def coarse(self, matrix: Array) -> bool:
        """Factors of a matrix in single precision for `solve_with_factors`, unchecked; whether there are any."""

    def kept(self) -> KeptFactors | None:
        """The last factors, to keep them for the transpose of their matrix; None where that is not possible."""

    def detach(self) -> Factors:
        """The same with the factors at hand, which may go on to others by themselves, in another thread too."""

    def solve(self, matrix: Array, b: Array) -> Array:
        """Solution (f,) with the matrix of `Restriction.values`."""

    def solve_with_factors(self, b: Array) -> Array:
        """Solution (f,) with the last factors, unchecked."""


class Selected:
    """Boundary conditions (Dirichlet): which dofs are free, just those not prescribed.

    ``indptr``, ``indices``: pattern of their matrix (compressed columns).
    """

    def __init__(self, pattern: Pattern, fixed: Index, shared: bool = False) -> None:
        """``shared``: the pattern of all dofs keeps its rows by those of this one alone."""
        self.size, self.fixed = pattern.n, fixed
        rows, mask = pattern.indices, np.ones(pattern.n, dtype=bool)
        mask[fixed] = False
        self.free = self.rows = np.flatnonzero(mask)
        cols = np.repeat(np.arange(pattern.n, dtype=np.int32), np.diff(pattern.indptr))
        number = np.cumsum(mask, dtype=np.int32) - 1
        # as flags: their places take as much memory as the matrix
        inside = mask[rows] & mask[cols]
        ends = running(inside)[pattern.indptr]
        self.indptr, self.indices = np.append(ends[self.free], ends[-1]), number[rows[inside]]
        self.entries: Flags | Index = inside
        if shared:
            pattern.keep(self.indices, self.free, inside, rows)

    def part(self, r: Array) -> Array:
        """See `Restriction`."""
        return r.take(self.rows, axis=0)

    def of_columns(self, columns: csr_matrix) -> csr_matrix:
        """As `part` (f, m) for forces (ndof, m)."""
        return columns[self.rows]

    def whole(self, x: Array, n: int) -> Array:
        """See `Restriction`."""
        if x.ndim == 1 or not len(x):
            out = np.zeros((n, *x.shape[1:]))
            out[self.free] = x
            return out
        # Rows are taken several times faster than they are put.
        out = x.take(self.numbers, axis=0)
        out[self.fixed] = 0.0
        return out

    @cached_property
    def numbers(self) -> Index:
        """Numbers (n,) of the dofs among the free ones; for prescribed ones, which have none, any."""
        out = np.zeros(self.size, dtype=np.intp)
        out[self.free] = np.arange(len(self.free))
        return out

    def values(self, data: Array, spent: bool = False) -> Array:
        """See `Restriction`."""
        if not spent:
            return data[self.entries]
        # In place: what is kept only moves towards the front, so writing never overtakes reading.
        end, stretch = 0, DEFAULT.block_values
        for first in range(0, len(data), stretch):
            kept = data[first : first + stretch][self.entries[first : first + stretch]]
            data[end : end + len(kept)] = kept
            end += len(kept)
        return data[:end]

    def sparse(self, values: Array) -> csc_matrix:
        """See `Restriction`."""
        from scipy.sparse import csc_matrix

        return csc_matrix((values[: len(self.indices)], self.indices, self.indptr), (len(self.free),) * 2)


class Controlled(Selected):
    """As `Selected`, with the equation of the lead in the place of that of the factor; ``entries`` are places, out of order."""

    def __init__(self, pattern: Pattern, fixed: Index, control: Control) -> None:
        self.size, self.fixed = pattern.n, fixed
        self.free = np.setdiff1d(np.arange(pattern.n), fixed)
        self.rows = np.where(self.free == control.factor, control.control_dof, self.free)
        row, column = np.full((2, pattern.n), -1, dtype=np.int32)
        row[self.rows] = column[self.free] = np.arange(len(self.free), dtype=np.int32)
        i, j = row[pattern.indices], column[np.repeat(np.arange(pattern.n), np.diff(pattern.indptr))]
        kept = np.flatnonzero((i >= 0) & (j >= 0))
        # The row of the lead stands in another place: entries of a column are sorted anew, as factorisations want them.
        self.entries = kept[np.lexsort((i[kept], j[kept]))]
        self.indices = i[self.entries]
        self.indptr = np.searchsorted(j[self.entries], np.arange(len(self.free) + 1)).astype(np.int32)

    def values(self, data: Array, spent: bool = False) -> Array:
        """See `Restriction`."""
        return data[self.entries]


@dataclass(frozen=True)
class Reduced:
    """The equations in the free dofs: where they come from, how they are restricted, and the factors of their matrix."""

    fixed: Index
    symmetric: bool
    assembly: Assembly
    restriction: Restriction
    factorisation: Factors
    weight: Array
    equations: list[Equations]
    policy: Policy
    control: Control | None = None
    part: SymmetricPart | None = None
    """What P has beside A, of systems in space that are solved by iteration: it follows the values of their matrices."""
    kept: dict[str, Array] = field(default_factory=dict, compare=False, repr=False)
    """What depends on nothing but which unknowns are free, and is asked for in each increment."""

    @classmethod
    def of(
        cls, system: System, fixed: Index, numerics: model.Numerics, symmetric: bool = False, policy: Policy = DEFAULT,
        control: Control | None = None,
    ) -> Reduced:  # fmt: skip
        """The whole system with some dofs ``fixed``, its pattern analysed once; ``control``: what leads them."""
        restriction: Tied | Selected | Controlled
        if system.ties is not None:
            restriction = Tied(system.ties, system.pattern, fixed, control)
        elif control is not None:
            restriction = Controlled(system.pattern, fixed, control)
        else:
            # shared row indices are put together each time that the whole asks for its rows, which nonlinear elimination does in
            # each iteration where bodies flow
            shared = system.ndof >= policy.shared_pattern_from and not system.has_memory
            restriction = Selected(system.pattern, fixed, shared)
        weight = weights_of(system)[restriction.rows]
        # multipliers make a matrix indefinite; without them that takes a free tool, or large compression
        definite = not any(s.exact for s in system.surfaces)
        spatial, equations = system.dofs.dimension == 3, equations_of(system, fixed)
        ways = ways_of(numerics, len(restriction.free), policy) if spatial else ()
        direct = Factorisation(
            len(restriction.free), restriction.indptr, restriction.indices, numerics.solver,
            threads_of(numerics, system.ndof, policy), symmetric,
            definite, policy, in_lengths(weight), spatial,
        )  # fmt: skip
        factorisation: Factorisation | Iterative = direct
        part = None
        if ways and control is None and not equations:
            part = SymmetricPart(system, restriction, policy)
            factorisation = Iterative(direct, ways, part, system, restriction.free, policy)
        return cls(
            fixed,
            symmetric,
            system,
            restriction,
            factorisation,
            weight,
            equations,
            policy,
            control,
            part,
        )

    def detach(self) -> Reduced:
        """The same with the factors at hand, which may go on to others by themselves, in another thread too."""
        return replace(self, factorisation=self.factorisation.detach())

    @property
    def free(self) -> Index:
        """The free dofs (f,)."""
        return self.restriction.free

    @cached_property
    def plain(self) -> bool:
        """Whether all weights are 1: no rotation is free."""
        return bool((self.weight == 1.0).all())

    def lengths(self, n: int) -> Array | None:
        """What a unit of each dof (n,) is as a length: that of the system for free rotations, else 1; None if there are none."""
        return None if self.plain else self.restriction.whole(1.0 / self.weight, n)

    def norm(self, r: Array) -> float:
        """Sum of the absolute free residuals, moments divided by a length."""
        part = self.restriction.part(r)
        return float(np.abs(part if self.plain else self.weight * part).sum())

    def matrix(self, e: Evaluation, b: Array, spent: bool = False) -> Array:
        """Values of K_ff for the matrix of an evaluation and the right-hand side b (ndof,) it is for.

        A copy; of an evaluation whose matrix is ``spent``, which nobody looks at again, they take its place: two matrices
        would be a tenth of what a run takes at its peak.
        """
        assert e.data is not None
        data = determined(e, b, self.equations, self.policy) if self.equations else e.data
        values = self.restriction.values(data, spent or data is not e.data)
        return values if self.part is None else np.concatenate([values, self.part.of(e)])

    def solve(self, matrix: Array, b: Array) -> Array:
        """Free dofs (ndof,) with K_ff x_f = b_f, zero where prescribed."""
        return self.restriction.whole(self.factorisation.solve(matrix, self.restriction.part(b)), len(b))

    def step(self, matrix: Array, b: Array, relative: float, changed: int | None = None) -> Array:
        """As `solve`, to the digits that Newton's step needs from an iterate with such a ``relative`` residual, or promises.

        changed: contact points but for which the factors at hand are nearly those of the matrix; None where they are not.
        """
        policy = self.policy
        # Inexact Newton (Eisenstat and Walker): digits beyond what the iterate can use cost substitutions, not iterations.
        share = min(max(policy.forcing_ratio * relative, policy.min_forcing), policy.max_forcing)
        return self.restriction.whole(self.factorisation.step(matrix, self.restriction.part(b), share, changed), len(b))

    def correction(self, b: Array, share: float | None = None) -> Array:
        """A solution with the factors at hand, of the last matrix even where the factors are of one before.

        share: that may be left of b.
        """
        return self.restriction.whole(self.factorisation.correction(self.restriction.part(b), share), len(b))

    def responses(self, loads: csr_matrix, of: csr_matrix) -> Array:
        """Σ of_i x (n, k) of the solutions x for k loads, rows (k, ndof), with the last factors; of (n, ndof)."""
        ndof = loads.shape[1]
        # Many right-hand sides go through the factors in one pass, as many as there is room for beside them.
        width = max(1, min(self.policy.columns_at_once, self.policy.column_room_beside // ndof))
        out = np.empty((of.shape[0], loads.shape[0]))
        for first in range(0, loads.shape[0], width):
            block = slice(first, first + width)
            x = self.factorisation.solve_with_factors(self.restriction.part(loads[block].T.toarray()))
            out[:, block] = of @ self.restriction.whole(x, ndof)
        return out

    def solve_with_factors(self, b: Array) -> Array:
        """As `solve`, with the last factors, unchecked: only for corrections whose effect is looked at."""
        return self.restriction.whole(self.factorisation.solve_with_factors(self.restriction.part(b)), len(b))
