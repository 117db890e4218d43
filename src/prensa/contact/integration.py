"""Where the contact terms are integrated: points on a candidate surface with shape values and tributary weights.

The nodal (trapezoid) rule has one point a node and weight w_A = ∫ N_A dΓ, integrated exactly on the committed
configuration, thickness or 2πr inside: n + 1 constraints for n + 1 nodes, the only rule whose point pressures do not
oscillate (THEORY 6; the paper's open question).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class NodalPoints:
    """k contact points, one a node: ``nodes`` (k,) global node numbers in walking order, ``edges`` (m, 2) of the surface.

    ``depth`` (k,): size of the adjacent elements into the body, in the initial mesh.
    """

    nodes: Index
    edges: Index
    depth: Array
    axisymmetric: bool
    thickness: float

    def weights(self, x: Array) -> Array:
        """Tributary areas (k,) = ∫ N_A dΓ on node positions x (n, 2) of the whole system."""
        a, b = x[self.edges[:, 0]], x[self.edges[:, 1]]
        length = np.hypot(*(b - a).T)
        if self.axisymmetric:
            wa = 2 * np.pi * length * (2 * a[:, 0] + b[:, 0]) / 6
            wb = 2 * np.pi * length * (a[:, 0] + 2 * b[:, 0]) / 6
        else:
            wa = wb = 0.5 * self.thickness * length
        out = np.zeros(len(x))
        np.add.at(out, self.edges[:, 0], wa)
        np.add.at(out, self.edges[:, 1], wb)
        return out[self.nodes]

    def slopes(self, x: Array) -> Array:
        """∂w/∂x (m, 2, 2, 2) on positions x (n, 2): edge, end whose weight it is, end that moves, axis."""
        a, b = x[self.edges[:, 0]], x[self.edges[:, 1]]
        t = b - a
        length = np.hypot(*t.T)
        dL = np.stack([-t, t], axis=1) / length[:, None, None]
        if not self.axisymmetric:
            return np.repeat(0.5 * self.thickness * dL[:, None], 2, axis=1)
        radius = np.stack([2 * a[:, 0] + b[:, 0], a[:, 0] + 2 * b[:, 0]], axis=1) / 6
        out = 2 * np.pi * radius[:, :, None, None] * dL[:, None]
        out[:, :, :, 0] += 2 * np.pi * length[:, None, None] * np.array([[2.0, 1.0], [1.0, 2.0]]) / 6
        return out

    def normals(self, x: Array) -> Array:
        """Outward unit normals (k, 2) of the surface at the nodes, weighted by edge length, body on the left."""
        t = x[self.edges[:, 1]] - x[self.edges[:, 0]]
        n = np.stack([t[:, 1], -t[:, 0]], axis=1)
        out = np.zeros_like(x)
        np.add.at(out, self.edges[:, 0], n)
        np.add.at(out, self.edges[:, 1], n)
        out = out[self.nodes]
        return out / np.hypot(out[:, 0], out[:, 1])[:, None]


def behind(edges: Index, cells: Index) -> Index:
    """Elements (m,) of which the oriented edges (m, 2) are a side, cells (e, a)."""
    a = cells.shape[1]
    sides = np.concatenate([cells[:, [i, (i + 1) % a]] for i in range(a)])
    owner = {(p, q): e % len(cells) for e, (p, q) in enumerate(sides.tolist())}
    return np.array([owner[p, q] for p, q in edges.tolist()], dtype=np.int64)


def depth_of(nodes: Index, edges: Index, cells: Index, points: Array) -> Array:
    """Mean size (k,) into the body of the elements behind the surface edges at each node: area over edge length."""
    total, count = np.zeros(len(points)), np.zeros(len(points))
    for (a, b), e in zip(edges.tolist(), behind(edges, cells)):
        x = points[cells[e]]
        d1, d2 = x[2] - x[0], x[3] - x[1]
        h = 0.5 * (d1[0] * d2[1] - d1[1] * d2[0]) / np.hypot(*(points[b] - points[a]))
        for n in (a, b):
            total[n] += h
            count[n] += 1
    return total[nodes] / count[nodes]
