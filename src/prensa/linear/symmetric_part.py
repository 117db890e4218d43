"""The symmetric P from which preconditioners in space are made, beside the tangent A: contact points, elements with F-bar.

P is (A + Aᵀ)/2 but for two things that A's unsymmetric part multiplies by large moduli:

* contact points have a stiffness of their own (`contact.forces.symmetric_stiffness`): the symmetric part of friction that
  follows the pressure would be indefinite, of the size of the penalty;
* elements with F-bar have P_e γ = A_eᵀ γ, γ the direction in which the dilatation of their centre grows. Their pressure answers
  to the gradient g₀ of that dilatation and acts by the mean one of their points, ĝ: the symmetric part of K ĝ ⊗ g₀ is that of the
  mean of both less K/4 of their difference, a stiffness that A does not have. With K g₀ ⊗ g₀ in P A P⁻¹ differs from 1 by
  pressures times ĝ − g₀, whatever the bulk modulus K is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np
from scipy.sparse import csr_matrix, hstack

from prensa.contact.forces import ContactForces, symmetric_stiffness
from prensa.kernels.dilatation import beside
from prensa.policy import DEFAULT, Policy
from prensa.precision import SMALLEST
from prensa.system.assembly import CHUNK, Block, scatter_matrix, scatter_stiffness
from prensa.system.system import Evaluation, System
from prensa.types import Array, Index


class Restricted(Protocol):
    """What is asked of a restriction to the free unknowns (`prensa.linear.reduction.Restriction`)."""

    def values(self, data: Array, spent: bool = False) -> Array:
        """Values of K_ff."""

    def of_columns(self, columns: csr_matrix) -> csr_matrix:
        """Rows (f, m) of the free unknowns of forces (ndof, m) in all."""


class Volumetric(NamedTuple):
    """Elements of a block along γ (m, n), of length 1: A γ and Aᵀ γ (m, n), ``right`` and ``left``.

    ``modulus`` (m,): the mean stiffness of their other motions over γᵀ A γ.
    """

    block: Block
    gamma: Array
    right: Array
    left: Array
    modulus: Array

    @property
    def own(self) -> Array:
        """γᵀ A γ (m,)."""
        return np.asarray((self.gamma * self.right).sum(axis=1))

    def apart(self, most: float) -> Array:
        """Share θ (m,) of γᵀ A γ that is a pressure by itself: what stays is as compressible as where the modulus is ``most``."""
        inside = (self.own > 0.0) & (self.modulus > 0.0) & (self.modulus < most)
        return np.where(inside, 1.0 - np.where(inside, self.modulus, 0.0) / max(most, SMALLEST), 0.0)


class SymmetricPart:
    """P beside A in the free unknowns, from numbers (size,) that follow the values of A.

    They are of contact points, at the ``places`` (k,) of the matrix, and after those of elements (`Volumetric`).
    """

    def __init__(self, system: System, restriction: Restricted, policy: Policy = DEFAULT) -> None:
        self.system, self.restriction, self.most = system, restriction, policy.multigrid_incompressible
        mask = np.zeros(system.pattern.entries)
        for s in system.surfaces:
            mask[system.pair_slots(s)] = 1.0
        self.places: Index = np.flatnonzero(restriction.values(mask))
        self.blocks = [k for k, b in enumerate(system.blocks) if not b.element.symmetric(b.mode)]
        self.size = len(self.places) + sum(int(np.prod(self._shape(k))) for k in self.blocks)

    def _shape(self, k: int) -> tuple[int, int]:
        """Of the numbers of a block."""
        cells = self.system.blocks[k].cells
        return len(cells), 3 * self.system.dofs.dimension * cells.shape[1] + 1

    def of(self, e: Evaluation) -> Array:
        """The numbers (size,) of an evaluation."""
        data = np.zeros(self.system.pattern.entries)
        for s, f in zip(self.system.surfaces, e.contacts):
            scatter_matrix(beyond(f), self.system.pair_slots(s), data)
        out = np.zeros(self.size)
        out[: len(self.places)] = self.restriction.values(data, True)[self.places]
        at = len(self.places)
        for k in self.blocks:
            size = int(np.prod(self._shape(k)))
            if e.volumetric and (found := e.volumetric[k]) is not None:
                out[at : at + size] = found.ravel()
            at += size
        return out

    def elements(self, numbers: Array) -> Iterator[Volumetric]:
        """What the numbers (size,) say of elements, block after block."""
        at = len(self.places)
        for k in self.blocks:
            m, width = self._shape(k)
            rows = numbers[at : at + m * width].reshape(m, width)
            gamma, right, left = (rows[:, i * (width // 3) : (i + 1) * (width // 3)] for i in range(3))
            yield Volumetric(self.system.blocks[k], gamma, right, left, rows[:, -1])
            at += m * width

    def of_elements(self, numbers: Array, apart: bool) -> Array:
        """Values of P − (A + Aᵀ)/2 by elements; ``apart``: less their share θ of (A γ) ⊗ (Aᵀ γ) / γᵀ A γ, made symmetric too."""
        pattern = self.system.pattern
        data = np.zeros(pattern.entries)
        for v in self.elements(numbers):
            share = self._over_own(v)
            for first in range(0, len(v.gamma), CHUNK):
                rows = slice(first, first + CHUNK)
                K = np.empty((len(share[rows]), *2 * v.gamma.shape[1:]))
                beside(v.gamma[rows], v.right[rows], v.left[rows], share[rows] if apart else np.zeros(CHUNK), K)
                scatter_stiffness(K, v.block.cells[rows], v.block.slots[rows], pattern.indptr, data)
        return np.asarray(self.restriction.values(data, True))

    def pressures(self, numbers: Array) -> tuple[csr_matrix, csr_matrix, Array]:
        """What is apart as B Gᵀ, B and G (f, m) in the free unknowns, a column each element; θ (m,)."""
        found = list(self.elements(numbers))
        B = [self._columns(v.block, v.right, np.sqrt(self._over_own(v))) for v in found]
        G = [self._columns(v.block, v.left, np.sqrt(self._over_own(v))) for v in found]
        return hstack(B, "csr"), hstack(G, "csr"), np.concatenate([v.apart(self.most) for v in found])

    def _over_own(self, v: Volumetric) -> Array:
        """θ / γᵀ A γ (m,)."""
        share = v.apart(self.most)
        return np.divide(share, v.own, out=np.zeros(len(share)), where=share > 0.0)

    def _columns(self, block: Block, vectors: Array, factor: Array) -> csr_matrix:
        """Vectors (m, n) of the elements of a block, times a factor each, as columns (f, m)."""
        dofs = self.system.dofs.displacement.dofs(block.cells).reshape(vectors.shape)
        m, n = vectors.shape
        rows = csr_matrix(((vectors * factor[:, None]).ravel(), dofs.ravel(), np.arange(0, m * n + 1, n)), (m, self.system.ndof))
        return self.restriction.of_columns(rows.T.tocsr())


def beyond(f: ContactForces) -> Array:
    """What the symmetric stand-in (k, m, m) for a contact's stiffness has beyond its symmetric part."""
    return np.ascontiguousarray(symmetric_stiffness(f) - 0.5 * (f.K + f.K.transpose(0, 2, 1)))
