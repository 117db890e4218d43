"""Sides of bodies in space that are held along their normals, whatever the axes: planes of symmetry of sectors.

At a node the displacement has u · n = 0 for each such side, exactly, by elimination: the component that the normals see best
follows the others, as the slaves of ties follow their masters. Forces of the supports are λ n, λ from what is out of balance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from prensa.layout import Field
from prensa.mesh.faces import area_vectors
from prensa.mesh.mesh import Mesh, MeshError
from prensa.model import problem as model
from prensa.precision import DRAWN
from prensa.types import Array, Flags, Index


@dataclass(frozen=True)
class Inclined:
    """Conditions (q,) at ``nodes``, of ``sides`` by number: unit ``normals`` (q, 3), ``slaves`` (q,) eliminated.

    ``back``: rows, columns and values of the matrix (q, q) with λ = back r of the slaves; ``follow``: those of what slaves
    follow, in degrees of freedom.
    """

    names: tuple[str, ...]
    sides: Index
    nodes: Index
    normals: Array
    slaves: Index
    back: tuple[Index, Index, Array]
    follow: tuple[Index, Index, Array]

    def forces(self, r: Array) -> Array:
        """Forces (q, 3) of the supports on their nodes, for what is out of balance r (ndof,) at all degrees of freedom."""
        rows, columns, values = self.back
        factor = np.bincount(rows, values * r[self.slaves[columns]], len(self.slaves))
        return factor[:, None] * self.normals


def held_along_normals(problem: model.Problem) -> list[str]:
    """Names of the sides that the problem, or its first step, holds along their normals: in all steps."""
    if problem.space != "solid":
        return []
    given = [*problem.fixed.items(), *(problem.steps[0].fixed.items() if problem.steps else ())]
    return list(dict.fromkeys(name for name, support in given if support.normal is not None))


def inclined_of(
    problem: model.Problem, meshes: Mapping[str, Mesh], offsets: Mapping[str, int], owner: Index, field: Field, held: Flags
) -> Inclined | None:  # fmt: skip
    """The conditions of a problem; ``held`` (n, 3): components that something else prescribes or takes away. None without any.

    ``owner`` (n,): the nodes that stand for nodes which ties have made one.

    Raises
    ------
    MeshError
        For a side that is not flat, or a point, which has no normal.

    """
    names = held_along_normals(problem)
    if not names:
        return None
    normal = [side_normal(name, meshes) for name in names]
    at: dict[int, list[int]] = {}
    for k, name in enumerate(names):
        body, _, side = name.partition(".")
        for node in np.unique(owner[meshes[body].nodes(side, name) + offsets[body]]).tolist():
            at.setdefault(node, []).append(k)
    found: list[tuple[int, int, int]] = []  # side, node, component
    back: list[tuple[int, int, float]] = []
    follow: list[tuple[int, int, float]] = []
    for node, sides in at.items():
        own, pivots, rest = _solved(np.array([normal[k] for k in sides]), held[node])
        C, first = np.array([normal[sides[i]] for i in own]).reshape(-1, 3), len(found)
        dofs = field.dofs(node)
        inverse = np.linalg.inv(C[:, pivots])
        found += [(sides[i], node, c) for i, c in zip(own, pivots)]
        back += [(first + i, first + j, inverse[j, i]) for i in range(len(own)) for j in range(len(own))]
        weights = -inverse @ C[:, rest]
        follow += [(int(dofs[c]), int(dofs[o]), weights[i, j]) for i, c in enumerate(pivots) for j, o in enumerate(rest)]
    of, nodes, component = np.array(found, dtype=np.int64).reshape(-1, 3).T
    slaves = field.dofs(nodes)[np.arange(len(nodes)), component]
    return Inclined(tuple(names), of, nodes, np.array(normal)[of], slaves, _triplets(back), _triplets(follow))


def _triplets(entries: list[tuple[int, int, float]]) -> tuple[Index, Index, Array]:
    rows, columns, values = zip(*entries) if entries else ((), (), ())
    return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64), np.array(values, dtype=np.float64)


def side_normal(name: str, meshes: Mapping[str, Mesh]) -> Array:
    """Unit normal (3,) of a flat side."""
    body, _, side = name.partition(".")
    mesh = meshes[body]
    mesh.nodes(side, name)
    if side not in mesh.edges:
        raise MeshError(f"fixed: {name!r} is a point, which has no normal; hold it along x, y or z")
    x = mesh.points[mesh.edges[side]]
    area = area_vectors(x)[1].sum(axis=0)
    normal = area.sum(axis=0) / np.linalg.norm(area.sum(axis=0))
    off = float(np.abs((x.reshape(-1, 3) - x[0, 0]) @ normal).max())
    if off > DRAWN * float(np.ptp(x.reshape(-1, 3), axis=0).max()):
        raise MeshError(
            f"fixed: {name!r} is not flat (off by {off:.3g}) and has no one normal; hold it along x, y or z, or let a tool stand "
            "there"
        )
    return np.asarray(normal)


def _solved(C: Array, held: Flags) -> tuple[list[int], list[int], list[int]]:
    """Which of the conditions C (m, 3) of a node count, the components that they take away, and the other components.

    Conditions on what is held already, and those that follow from others, do not count.
    """
    from scipy.linalg import qr

    free = np.flatnonzero(~held)
    own: list[int] = []
    for i in range(len(C)):
        if len(own) < len(free) and np.linalg.matrix_rank(C[[*own, i]][:, free], tol=DRAWN) > len(own):
            own.append(i)
    if not own:
        return [], [], [0, 1, 2]
    order = qr(C[own][:, free], mode="r", pivoting=True)[1]
    pivots = [int(c) for c in free[order[: len(own)]]]
    return own, pivots, [c for c in range(3) if c not in pivots]
