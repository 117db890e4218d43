"""Supports that a released body finds by itself: as many as rigid-body motions are left, so that they carry nothing.

Statically determinate supports of a body without loads have no reactions, whichever they are: they say where it lies, not what
shape it has.
"""

from __future__ import annotations

import numpy as np

from prensa.precision import DRAWN
from prensa.system.rigid import displacements, seen_along
from prensa.system.schedule import Prescribed
from prensa.system.system import System
from prensa.types import Array, Index


def found_supports(system: System, groups: list[Prescribed], step_start: Array) -> list[Prescribed]:
    """Degrees of freedom that hold what the groups leave free of each body, where it is at the degrees of freedom (ndof,)."""
    held = np.concatenate([np.zeros(0, dtype=np.int64), *(g.dofs for g in groups)])
    slaves = system.ties.slaves if system.ties is not None else np.zeros(0, dtype=np.int64)
    out = []
    for body in dict.fromkeys(system.tied_bodies(b)[0] for b in system.problem.bodies):
        dofs = _chosen(system, body, held, slaves, step_start)
        out += [Prescribed(np.array([dof]), step_start[[dof]].copy(), found=True) for dof in dofs.tolist()]
    return out


def _chosen(system: System, body: str, held: Index, slaves: Index, u: Array) -> Index:
    """Degrees of freedom of a body, and of those tied to it, that see its free motions best: far apart, across its arms."""
    from scipy.linalg import qr

    nodes = np.concatenate([system.nodes_of(b) for b in system.tied_bodies(body)])
    x = (system.positions(u) if system.problem.kinematics == "finite" else system.X)[nodes]
    x = x / float(np.abs(x).max())  # a sum of places as far away as numbers go is none
    arm = (x - x.mean(axis=0)) / float(np.ptp(x, axis=0).max())
    dofs = system.dofs.displacement.dofs(nodes)
    motions = displacements(arm)  # of each degree of freedom when the body moves along the axes, and turns
    if system.axisymmetric:
        motions[..., [0, 2]] = 0.0
    seen, dofs = motions.reshape(-1, motions.shape[2]), dofs.ravel()
    if system.ties is not None:  # nodes that a tie has made one
        dofs = system.ties.owner[dofs]
    rows = seen[np.isin(dofs, held)]
    if system.ties is not None and (inclined := system.ties.inclined) is not None:
        place = np.full(system.nodes, -1)
        place[nodes] = np.arange(len(nodes))
        own = place[inclined.nodes] >= 0
        rows = np.vstack([rows, seen_along(arm[place[inclined.nodes[own]]], inclined.normals[own])])
    _, values, ways = np.linalg.svd(np.vstack([rows, np.zeros((seen.shape[1],) * 2)]), full_matrices=False)
    # what an arm shorter than digits of files holds is left
    left = ways[values <= DRAWN * max(float(values[0]), 1.0)]
    if system.axisymmetric:
        left = left[np.abs(left[:, 1]) > DRAWN]
    can = np.flatnonzero(~np.isin(dofs, held) & ~np.isin(dofs, slaves))
    sight = seen[can] @ left.T
    if not len(left):
        return np.zeros(0, dtype=np.int64)
    # Column pivoting picks one degree of freedom for each motion, the least dependent ones: a minor that is far from singular.
    _, _, order = qr(sight.T, mode="economic", pivoting=True)
    return dofs[can[order[: len(left)]]]
