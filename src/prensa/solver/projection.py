"""Contact nodes put at a given gap: each is moved along the normal of its master, whatever asked for the gap.

A straight step along a curved tool changes the gap by d²/2R, more than the penetration p/k_n: Newton's steps and
extrapolations need the nodes back where the contact law means them to be.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from prensa.contact.masters import Seen
from prensa.contact.surface import Surface
from prensa.policy import DEFAULT, Policy
from prensa.system.interaction import Context
from prensa.system.system import Evaluation, System
from prensa.types import Array, Flags


def project(system: System, s: Surface, u: Array, change: Callable[[Seen], Array]) -> None:
    """Move the nodes (k,) of a surface in u (ndof,), in place, by the ``change`` (k,) of their gaps."""
    system.displacement(u)[s.points.nodes] += system.masters[s.against].moved(s, system, u, change)


def to_gap(target: Array, where: Flags, pairs: Seen) -> Array:
    """Change (k,) that takes the nodes ``where`` to the gap ``target``; zero elsewhere, gaps that are not finite included."""
    where = where & np.isfinite(pairs.g)  # a step may take a node beyond the end of its master
    return np.where(where, target, 0.0) - np.where(where, pairs.g, 0.0)


def project_prediction(system: System, c: Context, u: Array, policy: Policy = DEFAULT) -> None:
    """Put extrapolated contact nodes of u (ndof,), in place, at their extrapolated gap if closed, others out of the tool.

    Gaps are extrapolated and not positions: along a curved tool these leave it by d²/2R, while gaps change as pressures do, by
    what a penalty lets nodes sink in. A node that has just landed stays at its committed gap: at the speed it came with, it
    would be extrapolated deep into the tool.
    """
    state = c.state
    share = c.extrapolated_for / state.dt_last if state.dt_last > 0.0 else 0.0
    for s, now in zip(system.surfaces_at(c.time), c.surfaces):
        closed = s.points.any_at_nodes(state.contact.closed[s.rows])
        moves = s.points.has_point
        if s.sharp:  # of a cut edge the point between its nodes has a gap to keep, neither of these
            moves = moves & ~now.points.any_at_nodes(now.points.N[:, 0] < 1.0)
        committed, before = system.nodes_seen(s, state.u).g, system.nodes_seen(s, state.u - state.du).g
        touched = (before <= 0.0) & np.isfinite(committed)
        grown = share * np.subtract(committed, before, out=np.zeros_like(before), where=touched)
        landed = -policy.landed_start_ratio * s.points.depth.min()

        def change(
            pairs: Seen,
            closed: Flags = closed,
            held: Array = committed + grown,
            committed: Array = committed,
            moves: Flags = moves,
            landed: float = landed,
        ) -> Array:
            # an open node may lie inside: points of rules that are not the nodes, or of quadratic edges, are what contact holds
            target = np.where(closed, held, np.maximum(pairs.g, np.minimum(committed, landed)))
            return to_gap(target, moves & np.isfinite(pairs.g) & np.isfinite(target), pairs)

        project(system, s, u, change)


def contact_corrected(system: System, c: Context, e: Evaluation, u: Array, step: Array, lam: Array) -> Array:
    """U + step, with closed contact nodes put at the gap that the linear model gave them; e: the evaluation at u.

    Without the correction a Newton step along a curved tool opens points that stay closed. Supported nodes are left where
    they are.
    """
    moved = u + step
    # On the undeformed surface gaps are linear in the displacements: a straight step needs no correction.
    if system.problem.contact_geometry != "current":
        return moved
    after_lam = system.multipliers(moved, lam)
    for s, f, scale in zip(system.surfaces_at(c.time), e.contacts, c.scales):
        nodes = s.points.nodes
        target = f.stencils.linear_gap(step)
        stays = s.points.any_at_nodes(after_lam[s.rows, 0] - scale.k_n * target > 0)
        stays &= ~system.supported(nodes, c.plan)
        if not s.points.are_nodes:
            target = _linear_gap(system, s, u, step)
        project(system, s, moved, partial(to_gap, target, stays))
    return system.with_slaves(moved)


def _linear_gap(system: System, s: Surface, u: Array, step: Array) -> Array:
    """Gaps (k,) of the nodes of a surface after a step (ndof,) from u, by the linear model."""
    master, d = system.tool_masters[s.against], system.dofs.dimension
    pairs, by_master = master.node_pairs(s, system, u), step[master.dofs]
    way = system.displacement(step)[s.points.nodes]
    return np.asarray(pairs.g + (pairs.dg[:, :d] * way).sum(axis=1) + pairs.dg[:, d:] @ by_master)


def linear_gaps(e: Evaluation, step: Array) -> list[Array]:
    """Gaps (k,) of each contact after a step (ndof,) from the evaluation e, by the linear model."""
    return [f.stencils.linear_gap(step) for f in e.contacts]
