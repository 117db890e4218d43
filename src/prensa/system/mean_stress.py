"""The mean stress of quadratic elements as a field that is continuous from one element to the next.

Metal that flows keeps its volume, and quadratic elements keep it at each of their points. Those are as many conditions as a
pressure has unknowns that is linear in each element and jumps between them: more than displacements can follow everywhere, so
that next to singular edges the pressures of the points alternate about the right ones, by as much as the flow stress and on any
mesh (Sani, Gresho, Lee & Griffiths 1981, Int. J. Numer. Methods Fluids 1). Forces do not feel it; laws of ratios of stresses do.
Fitted by least squares to fields that are linear between the corners (Hinton & Campbell 1974, Int. J. Numer. Methods Eng. 8; Lee,
Gresho & Sani 1979, ibid. 14) the pressure is one of Hood and Taylor's element, whose displacements follow all of its conditions
(Brezzi & Falk 1991, SIAM J. Numer. Anal. 28). Linear fields stay what they are: the fit is of second order. Elements with one
dilatation (F-bar) have one pressure each, and nothing to be fitted.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from prensa.materials.plane_stress import PlaneStress
from prensa.precision import ROUND_OFF
from prensa.system.assembly import Block
from prensa.types import Array, Index


def with_continuous_mean(block: Block, stress: Array) -> Array:
    """Stresses (m q, c) of the points of a block with a mean stress that is continuous, where each point has one of its own.

    Bilinear elements keep theirs, and so do all in plane stress, where nothing keeps a volume.
    """
    if not block.element.quadratic or isinstance(block.law, PlaneStress):
        return stress
    mean = stress[:, :3].mean(axis=1)
    out = stress.copy()
    out[:, :3] += (continuous(block, mean.reshape(block.volume.shape)).ravel() - mean)[:, None]
    return out


def continuous(block: Block, values: Array) -> Array:
    """Values (m, q) of the field, linear between the corners, that is nearest to values (m, q), squares over initial volumes."""
    corners, _ = block.corner_fields
    nodes, cells = np.unique(block.corners, return_inverse=True)
    cells = cells.reshape(block.corners.shape)
    share = block.volume[:, :, None] * corners
    mass = np.einsum("mqa,qb->mab", share, corners)

    def gathered(of: Array) -> Array:
        return np.bincount(cells.ravel(), of.ravel(), len(nodes)).astype(np.float64)

    return np.asarray(_solved(mass, gathered, cells, gathered(np.einsum("mqa,mq->ma", share, values)))[cells] @ corners.T)


# ------------------------------------------------------------------------------------------------------------- details
def _solved(mass: Array, gathered: Callable[[Array], Array], cells: Index, right: Array) -> Array:
    """Nodal values (n,) whose products with the masses (m, c, c) of cells (m, c) are ``right`` (n,), to round-off.

    Conjugate gradients over the diagonal: the condition of mass matrices has bounds that are those of one element (Wathen 1987,
    IMA J. Numer. Anal. 7), so that some thirty iterations do on any mesh.
    """
    diagonal = gathered(np.einsum("maa->ma", mass))
    x = right / gathered(mass.sum(axis=2))  # a constant field is found at once
    r = right - gathered(np.einsum("mab,mb->ma", mass, x[cells]))
    p = z = r / diagonal
    least = ROUND_OFF * np.linalg.norm(right)
    while np.linalg.norm(r) > least:
        Mp = gathered(np.einsum("mab,mb->ma", mass, p[cells]))
        before = r @ z
        x, r = x + before / (p @ Mp) * p, r - before / (p @ Mp) * Mp
        z = r / diagonal
        p = z + (r @ z) / before * p
    return x
