"""Tools that are free to turn and are pressed beside what they could rest on: no pressures hold their force."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Failed, ended_by
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.contact.masters import RigidMaster
from prensa.errors import Finding
from prensa.geometry.plane import cross, turned
from prensa.system.failure import TipsOver
from prensa.system.interaction import Context
from prensa.system.system import System
from prensa.types import Array

TIP_GAP_RATIO = 0.5
"""Gap over element depth up to which a point may come to carry a tool."""
TIP_FRICTION_LIMIT = 1.0
"""Coefficient of friction beyond which no tool is helped to stand."""


def tool_balance(system: System, given: Failed) -> Iterator[Finding]:
    """The first tool whose force nothing that it could rest on balances in an increment, whatever that failed of.

    Pressures of any size, with friction up to a coefficient of ``TIP_FRICTION_LIMIT``, are tried at all points that are near,
    as on a rigid body: what they cannot hold no increment holds.
    """
    if system.axisymmetric or system.dofs.dimension != 2:
        return  # no tool turns
    for master in system.tool_masters.values():
        if (found := _tips(system, given.context, master)) is not None:
            yield ended_by(found)
            return


def _tips(system: System, c: Context, master: RigidMaster) -> TipsOver | None:
    dofs, plan = master.dofs, c.plan
    free = np.array([d not in plan.fixed and d not in plan.springs for d in dofs])
    force = np.array([float(plan.push[d](c.time)) if free[k] and d in plan.push else 0.0 for k, d in enumerate(dofs)])
    size = float(np.hypot(*force[:2]))
    if not free[2] or not size > 0.0:
        return None
    from scipy.optimize import nnls  # takes a tenth of a second to import, for what few runs need

    at = master.at + master.place(c.state.u)[:2]
    places, normals = _near(system, c, master, TIP_GAP_RATIO)
    if not len(places):
        return None
    arm, along = places - at, turned(normals)
    # Any force in a friction cone of the plane is a sum of its two edges with factors ≥ 0, so equilibrium of the rigid tool is
    # a least-squares problem with factors ≥ 0: a rest says that there is none.
    rays = np.concatenate([-normals + TIP_FRICTION_LIMIT * way * along for way in (-1.0, 1.0)])
    arms = np.concatenate([arm, arm])
    length = float(np.abs(arm).max())
    # Over a length, so that moments and forces weigh alike in the residual.
    moments = cross(arms, rays) / length
    rows = np.concatenate([rays.T, moments[None]])[free]
    wanted = -np.array([force[0], force[1], force[2] / length])[free]
    if nnls(rows, wanted)[1] <= NO_DIFFERENCE * size:
        return None
    across = np.array([force[1], -force[0]]) / size
    x, y = at + force[2] / size * across
    first, last = places[np.argsort(arm @ across)[[0, -1]]]
    return TipsOver(master.name, (float(x), float(y)), (float(force[0]), float(force[1])), tuple(first), tuple(last))


def _near(system: System, c: Context, master: RigidMaster, reach: float) -> tuple[Array, Array]:
    """Places (k, 2) of contact points that are near a tool, all there are if none is, and the tool's normals (k, 2) there.

    reach: gap over the depth of the elements.
    """
    places, normals, near = [np.zeros((0, 2))], [np.zeros((0, 2))], [np.zeros(0, dtype=bool)]
    for s in system.against(master.name):
        x = system.positions(c.state.u)[s.points.nodes]
        pairs = master.seen(x, c.state.u)
        places.append(x)
        normals.append(pairs.n)
        near.append(pairs.g <= reach * float(s.points.depth.min()))
    chosen = np.concatenate(near) if any(k.any() for k in near) else slice(None)
    return np.concatenate(places)[chosen], np.concatenate(normals)[chosen]
