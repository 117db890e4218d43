"""The mean stress of quadratic elements as a field that is continuous from one element to the next.

Metal that flows keeps its volume, and quadratic elements keep it at each of their points. Those are as many conditions as a
pressure has unknowns that is linear in each element and jumps between them: more than displacements can follow everywhere, so
that next to singular edges the pressures of the points alternate about the right ones, by as much as the flow stress and on any
mesh (Sani, Gresho, Lee & Griffiths 1981, Int. J. Numer. Methods Fluids 1). Forces do not feel it; laws of ratios of stresses do.
The means of the elements are right: with one pressure each they are a stable pair (Crouzeix & Raviart 1973). In the plane linear
patches through these means (Zienkiewicz & Zhu 1992) give values at the corners, of second order at the skin too. In space, where
there are no patches, the field linear between the corners that is nearest to the points' (Hinton & Campbell 1974; Lee, Gresho &
Sani 1979, Int. J. Numer. Methods Eng. 8, 14), which is the pressure of Hood and Taylor's element. Linear fields stay what they
are. Elements with one dilatation (F-bar) have one pressure each, and nothing to be fitted.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from prensa.contact.recovery import recover
from prensa.materials.plane_stress import PlaneStress
from prensa.precision import ROUND_OFF
from prensa.system.assembly import Block
from prensa.types import Array, Index


def with_continuous_mean(block: Block, x: Array, stress: Array) -> Array:
    """Stresses (m q, c) of the points of a block with a mean stress that is continuous, where each point has one of its own.

    x (n, d): nodes of the whole system now. Bilinear elements keep theirs, and so do all in plane stress, where nothing keeps a
    volume.
    """
    if not block.element.quadratic or isinstance(block.law, PlaneStress):
        return stress
    mean = stress[:, :3].mean(axis=1)
    values, out = mean.reshape(block.volume.shape), stress.copy()
    fitted = by_patches(block, x, values) if x.shape[1] == 2 else nearest(block, values)
    out[:, :3] += (fitted.ravel() - mean)[:, None]
    return out


def by_patches(block: Block, x: Array, values: Array) -> Array:
    """The field (m, q), linear between the corners, of patches through the means of values (m, q); nodes at x (n, 2)."""
    corners, _ = block.corner_fields
    nodes, cells = np.unique(block.corners, return_inverse=True)
    cells = cells.reshape(block.corners.shape)
    share = block.volume / block.volume.sum(axis=1, keepdims=True)
    at = np.einsum("mq,mqd->md", share, block.positions(x))[:, None]
    means = np.einsum("mq,mq->m", share, values)[:, None, None]
    return np.asarray(recover(x[nodes], cells, at, means)[cells, 0] @ corners.T)


def nearest(block: Block, values: Array) -> Array:
    """Values (m, q) of the field, linear between the corners, that is nearest to values (m, q): squares over initial volumes."""
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
