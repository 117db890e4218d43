"""Motions of everything at once: bodies that move together with pushed tools, and bodies that tools push away."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.before.overlap import unjoined
from prensa.checks.before.rigid_motions import contact_rows, loaded
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.contact.pairing import Pairs
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity
from prensa.linear.rigid_modes import Frame, free_in_words, rows_of, support_rows
from prensa.model.problem import tools_removed
from prensa.system.moments import stages
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Index


class _Met(NamedTuple):
    """A contact with a tool: places x (k, 2) of its nodes at first, what they see of it, and whether it rubs in a step."""

    surface: Surface
    x: Array
    pairs: Pairs
    rubs: bool


class _Columns(NamedTuple):
    """Rigid motions of everything: those of the ``frames`` of bodies, then the ``free`` degrees of freedom of tools.

    ``kept``: which of the three motions of a body count; about an axis of revolution that along it alone.
    """

    frames: dict[str, Frame]
    kept: Index
    free: Index

    @property
    def width(self) -> int:
        """Columns of the bodies."""
        return len(self.frames) * len(self.kept)

    def of(self, body: str) -> slice:
        """The columns of a body."""
        first = list(self.frames).index(body) * len(self.kept)
        return slice(first, first + len(self.kept))

    def blank(self, count: int) -> Array:
        """Rows (count, columns) of nothing."""
        return np.zeros((count, self.width + len(self.free)))

    def rows(self, system: System, body: str, met: _Met, way: Array) -> Array:
        """Rows (k, columns) of what points of a contact see along ``way`` (k, 5): of the body, and of the tool."""
        out = self.blank(len(way))
        out[:, self.of(body)] = rows_of(self.frames[body], met.x, way[:, :2])[:, self.kept]
        for k, dof in enumerate(system.tool_masters[met.surface.against].dofs):
            # turns are measured by the length of the model, so that all columns are displacements
            out[:, self.width :] += np.outer(way[:, 2 + k] / (system.length if k == 2 else 1.0), self.free == dof)
        return out


def joint_motions(system: System) -> Iterator[Finding]:
    """Bodies that nothing holds against the tools which press them."""
    if system.problem.body_contacts:
        return  # they push each other on
    frames = Frame.of_all(system)
    reported: set[str] = set()
    for stage in stages(system):
        if tools_removed(system.problem, stage.plan.number):
            continue
        for body, frame in frames.items():
            if body not in reported and (way := _flight(system, body, frame, stage.plan)) is not None:
                reported.add(body)
                if len(frames) > 1 and body in unjoined(system):
                    continue
                yield Finding(
                    f"bodies.{body}",
                    f"it is free to move along {_axis(way)}, away from the tools of step {stage.plan.name!r}: hold its other "
                    "side with 'fixed', or let a tool stand against it",
                )
        # what moves together with pushed tools is not looked for in space yet
        names, words = _together(system, frames, stage.plan) if system.dofs.dimension == 2 else ([], "")
        if names and reported.isdisjoint(names):
            reported |= set(names)
            yield Finding(
                f"bodies.{names[0]}",
                f"in step {stage.plan.name!r} {words}: hold one of them, with 'fixed', or with 'move' in the place of 'push'",
                Severity.REFUSE,
            )


def _axis(way: Array) -> str:
    """A direction (d,) in words."""
    sign = "-" if way[np.argmax(np.abs(way))] < 0 else "+"
    return f"{sign}{'xyz'[int(np.argmax(np.abs(way)))]}"


def _met(system: System, body: str, plan: StepPlan) -> Iterator[_Met]:
    """The contacts with tools of a body and of those tied to it."""
    u = system.initial().u
    x = system.positions(u)
    for s, law in zip(system.tool_contacts, plan.friction_at(plan.t1)):
        if s.body in system.tied_bodies(body):
            own = x[s.points.nodes]
            yield _Met(s, own, system.tool_masters[s.against].seen(own, u), not system.frictionless(law))


def _flight(system: System, body: str, frame: Frame, plan: StepPlan) -> Array | None:
    """The translation (d,) by which a body leaves all tools at once, and which its supports allow; None if there is none.

    Loads may press it against them, and where no tool is driven towards it nothing is asked of the contacts.
    """
    from scipy.linalg import null_space

    if loaded(system, system.tied_bodies(body), plan.number):
        return None
    normals, driven = [], False
    at, moved = plan.values(plan.t0), plan.values(plan.t1)
    for met in _met(system, body, plan):
        seen = ~np.isnan(met.pairs.g)
        n, tangents = met.pairs.n[seen], np.moveaxis(met.pairs.e[seen], 1, 0)
        # Friction up to the pressure itself may hold it, as rolls grip a strip: no force of that cone may push it back.
        normals += [n + side * e for e in tangents for side in (1.0, -1.0)] if met.rubs else [n]
        own = system.tool_masters[met.surface.against].dofs
        way = np.array([float((moved - at)[plan.fixed == dof].sum()) for dof in own[: n.shape[1]]])
        driven |= bool(np.isin(own, list(plan.push)).any() or (n @ way > 0.0).any())
    if not driven or not sum(map(len, normals)):
        return None
    cone = np.concatenate(normals)
    d = system.dofs.dimension
    held = support_rows(system, frame, plan)[:, :d]
    if system.axisymmetric:
        held = np.concatenate([held, [[1.0, 0.0]]])
    free = null_space(held, rcond=NO_DIFFERENCE) if len(held) else np.eye(d)
    if not free.shape[1]:
        return None
    away = free @ _along_all(cone @ free)
    return away if (cone @ away > NO_DIFFERENCE).all() else None


def _along_all(n: Array) -> Array:
    """The direction (d,) that has the largest angle to being across any of vectors n (k, d), if there is one."""
    if n.shape[1] == 1:
        return np.sign(n[0])
    if n.shape[1] == 3:
        return _along_all_in_space(n)
    angles = np.sort(np.arctan2(n[:, 1], n[:, 0]))
    gaps = np.diff(angles, append=angles[0] + 2.0 * np.pi)
    # opposite to the middle of the largest sector without a vector
    opposite = angles[np.argmax(gaps)] + 0.5 * float(gaps.max()) + np.pi
    return np.array([np.cos(opposite), np.sin(opposite)])


def _along_all_in_space(n: Array) -> Array:
    """The direction (3,) in the cube about the origin that goes farthest along all of vectors n (k, 3) at once."""
    from scipy.optimize import linprog

    behind = np.hstack([-n, np.ones((len(n), 1))])
    found = linprog([0.0, 0.0, 0.0, -1.0], behind, np.zeros(len(n)), bounds=[(-1.0, 1.0)] * 3 + [(0.0, None)])
    return np.asarray(found.x[:3]) if found.success else np.zeros(3)


def _together(system: System, frames: dict[str, Frame], plan: StepPlan) -> tuple[list[str], str]:
    """Bodies and tools that are free to move together in a step, and a sentence about it; empty if there are none."""
    from scipy.linalg import null_space

    own = system.dofs.tool.dofs(np.arange(len(system.tools))).ravel()
    kept = np.array([1]) if system.axisymmetric else np.arange(3)
    columns = _Columns(frames, kept, own[np.isin(own, list(plan.push))])
    if not len(columns.free):
        return [], ""
    rows = [columns.blank(0)]
    for body, frame in frames.items():
        held = support_rows(system, frame, plan)
        rows.append(columns.blank(len(held)))
        rows[-1][:, columns.of(body)] = held[:, kept]
        for met in _met(system, body, plan):
            ways = (met.pairs.dg, met.pairs.ds[:, 0]) if met.rubs else (met.pairs.dg,)
            rows += [columns.rows(system, body, met, way)[~np.isnan(met.pairs.g)] for way in ways]
    springs = np.isin(columns.free, list(plan.springs))
    rows.append(columns.blank(int(springs.sum())))
    rows[-1][:, columns.width :] = np.eye(len(springs))[springs]
    null = null_space(np.concatenate(rows), rcond=NO_DIFFERENCE).T
    moves = {body: null[:, columns.of(body)] for body in frames}
    bodies = [body for body in frames if (np.abs(moves[body]) > NO_DIFFERENCE).any() and _held(system, body, frames[body], plan)]
    moving = columns.free[(np.abs(null[:, columns.width :]) > NO_DIFFERENCE).any(axis=0)]
    tools = [t.name for i, t in enumerate(system.tools) if np.isin(system.dofs.tool.dofs(i), moving).any()]
    if not bodies or not tools:
        return [], ""
    # the rows that leave exactly these motions of the first body free
    rest = np.zeros((0, 3)) if system.axisymmetric else null_space(moves[bodies[0]], rcond=NO_DIFFERENCE).T
    words = free_in_words(system, frames[bodies[0]], rest)
    listed = ", ".join(repr(name) for name in (*bodies, *tools))
    return bodies, f"{listed} are free to {words} together, since no motion of these tools is prescribed"


def _held(system: System, body: str, frame: Frame, plan: StepPlan) -> bool:
    """Whether supports, and contacts with tools that stood still, hold a body; of others `rigid_motions` speaks."""
    rows = [support_rows(system, frame, plan), contact_rows(system, body, frame, plan, False)]
    return not free_in_words(system, frame, np.concatenate(rows))
