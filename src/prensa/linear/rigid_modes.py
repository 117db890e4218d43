"""Rigid-body motions of the bodies that neither supports nor contacts resist, by name.

A support contributes the row of its direction to the matrix of rigid-body modes, a contact point that of its normal and, with
friction, of its tangent; what is left of the three modes is free.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from prensa.errors import Finding, Severity
from prensa.model.problem import tools_removed
from prensa.system.interaction import Context
from prensa.system.planning import plan_step
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Index

CLOSED = 1e-6  # gap over element depth below which a tool counts as touching, or as reaching into the body


def modes(system: System) -> Iterator[Finding]:
    """Rigid-body motions of each body that nothing resists: named, fatal when not even a contact can."""
    at_start = system.initial().u
    reported: set[str] = set()
    frames = {name: _Frame.of(system, name) for name in (system.tied_bodies(b)[0] for b in system.problem.bodies)}
    for number in range(len(system.problem.steps)):
        plan = plan_step(system, number, at_start)
        for name, frame in frames.items():
            held = _support_rows(system, frame, plan)
            gone = tools_removed(system.problem, number)
            resting = [
                np.zeros((0, 3)) if gone else _contact_rows(system, name, frame, plan, touching) for touching in (True, False)
            ]
            for rows, fatal in ((resting[1], True), (resting[0], False)):
                words = _free(system, frame, np.concatenate([held, rows]))
                if not words or name in reported or (not fatal and number):
                    continue
                reported.add(name)
                step = f"in step {plan.name!r} " if number else ""
                remedy = (
                    "hold it there with 'fixed', or let friction do it"
                    if fatal
                    else ("start with the tool touching it ('touching:'), or hold it until then")
                )
                nothing = "no support and no contact resists" if fatal else "nothing resists until a tool touches it"
                severity = Severity.REFUSE if fatal else Severity.WARN
                yield Finding(f"bodies.{name}", f"{step}it is free to {words}: {nothing}; {remedy}", severity)
            along_axis = (np.abs(held[:, 1]) > 1e-6).any()
            if system.axisymmetric and not number and name not in reported and not along_axis and _pressed_alone(system,
                name, plan):
                yield Finding(
                    f"bodies.{name}",
                    "nothing but friction holds it along y against the tools that press it: where it is not pressed yet that is "
                    "nothing, and round-off says where it goes; hold a point of it ('fixed'), or let a tool touch it there",
                )
        values = at_start.copy()
        values[plan.fixed] = plan.values(plan.t1)
        at_start = values


def _pressed_alone(system: System, body: str, plan: StepPlan) -> bool:
    """Whether a tool that a step drives presses a body along the axis, and nothing but the friction of others bears it.

    Of those that touch it in the beginning. Loads may bear it too. In the plane a body between tools that press it is held by
    their friction from the first increment on, and a good case.
    """
    p, u = system.problem, system.initial().u
    at, moved = plan.values(plan.t0), plan.values(plan.t1)
    mine = system.tied_bodies(body)
    owners: list[Any] = [p, p.steps[plan.number]]
    if any(name.partition(".")[0] in mine for owner in owners for name in (*owner.loads, *owner.body_force)):
        return False
    driven: set[float] = set()
    bearing: set[float] = set()
    x, rubs = system.positions(u), False
    for s, law in zip(system.surfaces, plan.friction_at(plan.t1)):
        if s.body not in mine:
            continue
        pairs = system.master(s).seen(x[s.points.nodes], u)
        touching = pairs.n[pairs.g <= CLOSED * float(s.points.depth.min())]
        signs = set(np.sign(touching[np.abs(touching[:, 1]) > 1e-6, 1]).tolist())
        dof = int(system.master(s).dofs[1])
        bearing |= signs
        if dof in plan.push or (at != moved)[plan.fixed == dof].any():
            driven |= signs
        rubs |= bool((np.abs(touching[:, 0]) > 1e-6).any()) and not system.frictionless(law)
    return rubs and any(-sign not in bearing for sign in driven)


def free_to_move(system: System, body: str, c: Context, contacts: bool = True) -> str:
    """Rigid-body motions of a body that neither supports nor the contacts closed in the committed state resist, in words.

    Without ``contacts`` supports count alone.
    """
    if system.dofs.dimension != 2:  # rigid motions in space are not looked for yet
        return ""
    frame = _Frame.of(system, body)
    rows = [_support_rows(system, frame, c.plan)]
    for s, law in zip(system.surfaces, c.laws):
        if s.body in system.tied_bodies(body) and contacts:
            closed = c.state.contact.closed[s.rows]
            pairs = system.stencils(s, c.state.u)
            x = s.X[closed]
            rows.append(_rows(frame, x, pairs.n[closed]))
            if law is not None:
                rows.append(_rows(frame, x, pairs.e[closed, 0]))
    return _free(system, frame, np.concatenate(rows))


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
        frame = _Frame.of(system, bodies[0])
        motions = _left(system, _support_rows(system, frame, plan))
        if len(motions):
            out.append(Loose(list(bodies), frame.nodes, frame.size, motions))
    return out


def _nodes(system: System, body: str) -> Index:
    """Nodes of a body and of those tied to it: they move as one."""
    return np.concatenate(
        [system.offsets[b] + np.arange(len(system.meshes[b].points)) for b in system.tied_bodies(body)]
    )


class _Frame(NamedTuple):
    """A body with those tied to it: its ``nodes``, their ``centre`` (2,) and ``size``, by which turns are reported."""

    nodes: Index
    centre: Array
    size: float

    @classmethod
    def of(cls, system: System, body: str) -> _Frame:
        nodes = _nodes(system, body)
        x = system.X[nodes]
        return cls(nodes, x.mean(axis=0), float(np.ptp(x, axis=0).max()))


def _rows(frame: _Frame, x: Array, n: Array) -> Array:
    """Rigid-body modes (k, 3) seen at points x along directions n, each (k, 2): translations, turn over the size."""
    arm = (x - frame.centre) / frame.size
    return np.column_stack([n, arm[:, 0] * n[:, 1] - arm[:, 1] * n[:, 0]])


def _support_rows(system: System, frame: _Frame, plan: StepPlan) -> Array:
    field = system.dofs.displacement
    nodes, axis = field.split(plan.fixed[field.owns(plan.fixed)])
    mine = np.isin(nodes, frame.nodes)
    return _rows(frame, system.X[nodes[mine]], np.eye(field.width)[axis[mine]])


def _contact_rows(system: System, body: str, frame: _Frame, plan: StepPlan, touching: bool) -> Array:
    """Rows of the contacts of a body: normals and, with friction, tangents; of all of them, or of those that touch at first.

    Tools that are pushed are brought to touch before the solve.
    """
    rows = [np.zeros((0, 3))]
    for s, law in zip(system.surfaces, plan.friction_at(plan.t1)):
        if s.body not in system.tied_bodies(body):
            continue
        u = system.initial().u
        x = system.positions(u)[s.points.nodes]
        pairs = system.master(s).seen(x, u)
        seen = np.ones(len(x), dtype=bool)
        pushed = any(dof in plan.push for dof in system.master(s).dofs[: system.dofs.dimension].tolist())
        if touching and not pushed:
            seen = pairs.g <= CLOSED * float(s.points.depth.min())
        if pushed and not touching:
            seen = pairs.g <= np.inf
        rows.append(_rows(frame, x[seen], pairs.n[seen]))
        if not system.frictionless(law):
            rows.append(_rows(frame, x[seen], pairs.e[seen, 0]))
    return np.concatenate(rows)


def _left(system: System, rows: Array) -> Array:
    """Rigid-body motions (m, 3) outside the span of the rows (k, 3): along x, along y, turn times the size."""
    if system.axisymmetric:
        return np.zeros((0, 3)) if (np.abs(rows[:, 1]) > 1e-6).any() else np.array([[0.0, 1.0, 0.0]])
    _, values, v = np.linalg.svd(np.concatenate([rows, np.zeros((3, 3))]), full_matrices=False)
    return np.asarray(v[values <= 1e-6 * max(float(values[0]), 1e-300)] if values[0] > 0 else np.eye(3))


def _free(system: System, frame: _Frame, rows: Array) -> str:
    """The rigid-body motions outside the span of the rows, in words; '' if there is none."""
    null = _left(system, rows)
    if system.axisymmetric:
        return "move along the axis y" if len(null) else ""
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
            words.append(f"turn about ({centre[0] - b * size / c:.4g}, {centre[1] + a * size / c:.4g})")
    return " and to ".join(words)
