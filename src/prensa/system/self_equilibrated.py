"""Stresses that are released: forces in equilibrium with themselves whatever the shape of the body.

The forces r_a of an element on its nodes have neither resultant nor moment. Strings between its nodes carry them: a symmetric
matrix K (a, a) without resultant, K 1 = 0, with K x = r, the one of least norm (the symmetric Procrustes problem, Higham 1988).
On any other shape y the forces K y have no resultant, because K is symmetric and K 1 = 0, and no moment, because it is the same
along all axes. So the forces of tools that are gone, as the strings of all elements hold them, can go to zero while the body
turns and springs, and no support has to take part; dead forces would turn it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from prensa.materials.laws import At
from prensa.system.assembly import Block, sweep
from prensa.system.interaction import Context, Discretisation, Part, Request, Response
from prensa.system.state import State
from prensa.types import Array, Index


def self_equilibrated_stiffness(system: Discretisation, state: State) -> Array:
    """Matrices (elements, a, a) of all blocks in a committed state, flattened together."""
    x = system.positions(state.u)
    return np.concatenate(
        [_matrices(x[b.cells], _forces(system, b, x, h)).ravel() for b, h in zip(system.blocks, state.history)]
    )


def self_equilibrated_forces(system: Discretisation, u: Array, self_equilibrated: Array) -> Array:
    """Forces (ndof,) of strings at degrees of freedom u (ndof,)."""
    out, x = np.zeros(system.ndof), system.positions(u)
    for b, K in zip(system.blocks, per_block(system, self_equilibrated)):
        np.add.at(out, system.dofs.displacement.dofs(b.cells), np.matmul(K, x[b.cells]))
    return out


def per_block(system: Discretisation, self_equilibrated: Array) -> list[Array]:
    """Matrices (m, a, a) of each block."""
    sizes = [(len(b), b.cells.shape[1], b.cells.shape[1]) for b in system.blocks]
    parts = np.split(self_equilibrated, np.cumsum([m * a * a for m, a, _ in sizes])[:-1])
    return [part.reshape(size) for part, size in zip(parts, sizes)]


def _forces(system: Discretisation, block: Block, x: Array, history: Array) -> Array:
    """Forces (m, a, d) of the elements on their nodes when nothing moves."""
    (m, a), d = block.cells.shape, x.shape[1]
    alone = replace(block, cells=np.arange(m * a).reshape(m, a))
    r, x = np.zeros(d * m * a), np.ascontiguousarray(x[block.cells].reshape(-1, d))
    out = sweep(alone, x, np.zeros_like(x), history, At(1.0, 0.0, False), r, None, system.pattern)
    assert not out.failed, "a committed state can be evaluated"
    return r.reshape(m, a, d)


def _matrices(x: Array, r: Array) -> Array:
    """Symmetric K (m, a, a) of least norm with K x = r, K 1 = 0, for places and self-equilibrated forces, each (m, a, d)."""
    ones = np.ones((*x.shape[:2], 1))
    X = np.concatenate([ones, x - x.mean(axis=1, keepdims=True)], axis=2)
    R = np.concatenate([0.0 * ones, r], axis=2)
    # A pseudo-inverse: an element has more nodes than 1 + d, so that K x = r does not determine K.
    back = np.linalg.pinv(X)  # (m, 1 + d, a)
    # The closed form of the symmetric Procrustes problem: what acts outside the span of 1 and x is zero, since that has least
    # norm.
    half = R @ back
    along = X @ back  # onto the span of 1 and the coordinates
    return np.asarray(half + (half - along @ half).transpose(0, 2, 1))


@dataclass(frozen=True)
class SelfEquilibrated:
    """Self-equilibrated stresses of one body, released linearly over the step."""

    system: Discretisation
    block: Block
    K: Array

    def couplings(self) -> list[Index]:
        """Of the nodes of each element, which its stiffness couples too."""
        return [self.system.dofs.displacement.dofs(self.block.cells).reshape(len(self.block), -1)]

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        left = c.plan.left(c.time)
        if left == 0.0:
            return Response(external=True)
        (dofs,) = self.couplings()
        r = left * np.matmul(self.K, self.system.positions(ask.u)[self.block.cells])
        stiffness = None
        if ask.stiffness:
            (m, a), d = self.block.cells.shape, self.system.dofs.dimension
            blocks = np.zeros((m, a, d, a, d))
            for axis in range(d):  # the same along all axes, and none couples two: else K y would have a moment
                blocks[:, :, axis, :, axis] = -left * self.K
            stiffness = blocks.reshape(m, d * a, d * a)
        part = Part(f"strings {self.block.body}", dofs, r.reshape(len(dofs), -1), stiffness)
        return Response([part], external=True)
