"""Rigid-body motions of the bodies that neither supports nor contacts resist.

A support contributes the row of its direction to the matrix of rigid-body modes, a contact point that of its normal and, with
friction, of its tangents; what is left of the three modes, in space of the six, is free.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.errors import coordinates
from prensa.linear.motions_in_words import in_words
from prensa.system.interaction import Context
from prensa.system.rigid import seen_along
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Index

CLOSED = 1e-6  # gap over element depth below which a tool counts as touching, or as reaching into the body


def free_to_move(system: System, body: str, c: Context, contacts: bool = True) -> str:
    """Rigid-body motions of a body that neither supports nor the contacts closed in the committed state resist, in words.

    Without ``contacts`` supports count alone.
    """
    frame = Frame.of(system, body)
    rows = [support_rows(system, frame, c.plan)]
    for s, law in zip(c.surfaces, c.laws):
        if contacts and s.acts_on(system.tied_bodies(body)):
            closed = c.state.contact.closed[s.rows]
            pairs = system.stencils(s, c.state.u)
            x = s.X[closed]
            rows.append(rows_of(frame, x, pairs.n[closed]))
            for k in range(pairs.e.shape[1] if law is not None else 0):
                rows.append(rows_of(frame, x, pairs.e[closed, k]))
    return free_in_words(system, frame, np.concatenate(rows))


class Loose(NamedTuple):
    """Bodies tied to one another that supports leave free to move.

    ``motions`` (m, 3): what is left, along x, along y, and the turn about the middle of the ``nodes`` times their ``size``.
    """

    bodies: list[str]
    nodes: Index
    size: float
    motions: Array


def loose_bodies(system: System, plan: StepPlan) -> list[Loose]:
    """Bodies that the supports of a step leave free to move, contacts apart; in the plane only."""
    if system.dofs.dimension != 2:
        return []
    out = []
    for bodies in dict.fromkeys(tuple(system.tied_bodies(b)) for b in system.problem.bodies):
        frame = Frame.of(system, bodies[0])
        motions = free_motions(system, support_rows(system, frame, plan))
        if len(motions):
            out.append(Loose(list(bodies), frame.nodes, frame.size, motions))
    return out


def leaves_free(system: System, plan: StepPlan) -> bool:
    """Whether the supports of a step leave a body free to move, contacts apart."""
    frames = Frame.of_all(system).values()
    return any(len(free_motions(system, support_rows(system, frame, plan))) > 0 for frame in frames)


def _nodes(system: System, body: str) -> Index:
    """Nodes of a body and of those tied to it: they move as one."""
    return np.concatenate([system.nodes_of(b) for b in system.tied_bodies(body)])


class Frame(NamedTuple):
    """A body with those tied to it: its ``nodes``, their ``centre`` (d,) and ``size``, by which turns are reported."""

    nodes: Index
    centre: Array
    size: float

    @classmethod
    def of(cls, system: System, body: str) -> Frame:
        """That of a body by its name."""
        nodes = _nodes(system, body)
        x = system.X[nodes]
        return cls(nodes, x.mean(axis=0), float(np.ptp(x, axis=0).max()))

    @classmethod
    def of_all(cls, system: System) -> dict[str, Frame]:
        """Those of all bodies, by the first name of bodies that are tied to one another."""
        return {name: cls.of(system, name) for name in (system.tied_bodies(b)[0] for b in system.problem.bodies)}


def rows_of(frame: Frame, x: Array, n: Array) -> Array:
    """Rigid-body modes (k, 3|6) seen at points x along directions n, each (k, d): translations, turns over the size."""
    return seen_along((x - frame.centre) / frame.size, n)


def along_all(frame: Frame, x: Array) -> Array:
    """Rows of points x (k, d) along all axes: of what sticks in any direction."""
    return np.concatenate([rows_of(frame, x, np.broadcast_to(axis, x.shape)) for axis in np.eye(x.shape[1])])


def support_rows(system: System, frame: Frame, plan: StepPlan) -> Array:
    """Rows (k, 3|6) of the supports of a body in a step (see `rows_of`)."""
    field = system.dofs.displacement
    nodes, axis = field.split(plan.fixed[field.owns(plan.fixed)])
    mine = np.isin(nodes, frame.nodes)
    rows = rows_of(frame, system.X[nodes[mine]], np.eye(field.width)[axis[mine]])
    if system.ties is None or system.ties.inclined is None:
        return rows
    inclined = system.ties.inclined
    own = np.isin(inclined.nodes, frame.nodes)
    return np.concatenate([rows, rows_of(frame, system.X[inclined.nodes[own]], inclined.normals[own])])


def free_motions(system: System, rows: Array) -> Array:
    """Rigid-body motions (m, 3|6) outside the span of the rows (k, 3|6): along the axes, turns times the size."""
    if system.axisymmetric:
        # About an axis of revolution the motion along it is the only rigid one: a radial one stretches hoops.
        return np.zeros((0, 3)) if (np.abs(rows[:, 1]) > 1e-6).any() else np.array([[0.0, 1.0, 0.0]])
    # Rows of zeros, so that there are as many singular values as motions however few supports there are.
    whole = np.eye(rows.shape[1])
    _, values, v = np.linalg.svd(np.concatenate([rows, 0.0 * whole]), full_matrices=False)
    return np.asarray(v[values <= 1e-6 * max(float(values[0]), 1e-300)] if values[0] > 0 else whole)


def free_in_words(system: System, frame: Frame, rows: Array) -> str:
    """The rigid-body motions outside the span of the rows, in words; '' if there is none."""
    null = free_motions(system, rows)
    if system.axisymmetric:
        return "move along the axis y" if len(null) else ""
    if rows.shape[1] == 6:
        return in_words(null, frame.centre, frame.size) if len(null) else ""
    if len(null) == 3:
        return "move along x and y and to turn"
    centre, size = frame.centre, frame.size
    words = []
    if len(null) == 2:  # the turn first, then what is left of translations
        q = null[:, 2]
        turn, slide = (
            (q[0] * null[0] + q[1] * null[1], q[1] * null[0] - q[0] * null[1]) if np.abs(q).max() > 1e-6 else null
        )
        null = np.stack([slide, turn])
    for a, b, c in null:
        if abs(c) <= 1e-6:
            along = "x" if abs(b) < 1e-6 else "y" if abs(a) < 1e-6 else f"({a:.3g}, {b:.3g})"
            words.append(f"move along {along}")
        else:
            at = np.array([centre[0] - b * size / c, centre[1] + a * size / c])
            at[np.abs(at) <= 1e-6 * size] = 0.0  # round-off of a place in a body of this size
            words.append(f"turn about ({coordinates(at)})")
    return " and to ".join(words)
