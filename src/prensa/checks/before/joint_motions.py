"""Motions of everything at once: bodies that move together with pushed tools, and bodies that tools push away."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.contact.pairing import Pairs
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity
from prensa.linear.rigid_modes import Frame, free_in_words, rows_of, support_rows
from prensa.model import problem as model
from prensa.model.problem import tools_removed
from prensa.system.moments import stages
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Index


class _Columns(NamedTuple):
    """Rigid motions of everything: those of the ``frames`` of bodies, then the ``free`` degrees of freedom of tools.

    ``kept``: which of the three motions of a body count; about an axis of revolution that along it alone.
    """

    frames: dict[str, Frame]
    kept: Index
    free: Index

    def rows(self, system: System, s: Surface, pairs: Pairs, way: Array) -> Array:
        """Rows (k, columns) of what points of a contact see along ``way`` (k, 5): of the body, and of the tool."""
        out = np.zeros((len(way), len(self.frames) * len(self.kept) + len(self.free)))
        name = system.tied_bodies(s.body)[0]
        first = list(self.frames).index(name) * len(self.kept)
        x = system.positions(system.initial().u)[s.points.nodes]
        out[:, first : first + len(self.kept)] = rows_of(self.frames[name], x, way[:, :2])[:, self.kept]
        own = system.tool_masters[s.against].dofs
        for column, dof in enumerate(self.free.tolist()):
            for k in np.flatnonzero(own == dof):
                # turns are measured by the length of the model, so that all columns are displacements
                out[:, len(self.frames) * len(self.kept) + column] = way[:, 2 + k] / (system.length if k == 2 else 1.0)
        return out


def joint_motions(system: System) -> Iterator[Finding]:
    """Bodies that nothing holds against the tools which press them."""
    if system.problem.body_contacts:
        return  # they push each other on
    frames = {name: Frame.of(system, name) for name in (system.tied_bodies(b)[0] for b in system.problem.bodies)}
    reported: set[str] = set()
    for stage in stages(system):
        if tools_removed(system.problem, stage.plan.number):
            continue
        for body, frame in frames.items():
            if body not in reported and (way := _flight(system, body, frame, stage.plan)) is not None:
                reported.add(body)
                yield Finding(
                    f"bodies.{body}",
                    f"it is free to move along {_axis(way)}, away from the tools of step {stage.plan.name!r}: hold its other "
                    "side with 'fixed', or let a tool stand against it",
                )
        names, words = _together(system, frames, stage.plan)
        if names and reported.isdisjoint(names):
            reported |= set(names)
            yield Finding(
                f"bodies.{names[0]}",
                f"in step {stage.plan.name!r} {words}: hold one of them, with 'fixed', or with 'move' in the place of 'push'",
                Severity.REFUSE,
            )


def _axis(way: Array) -> str:
    """A direction (2,) in words."""
    sign = "-" if way[np.argmax(np.abs(way))] < 0 else "+"
    return f"{sign}{'xy'[int(np.argmax(np.abs(way)))]}"


def _contacts(system: System, body: str) -> Iterator[tuple[Surface, Pairs]]:
    """The contacts of a body and of those tied to it, with what its points see of the tools in the beginning."""
    u = system.initial().u
    for s in system.tool_contacts:
        if s.body in system.tied_bodies(body):
            yield s, system.tool_masters[s.against].seen(system.positions(u)[s.points.nodes], u)


def _flight(system: System, body: str, frame: Frame, plan: StepPlan) -> Array | None:
    """The translation (2,) by which a body leaves all tools at once, and which its supports allow; None if there is none.

    Loads may press it against them, and where no tool is driven towards it nothing is asked of the contacts.
    """
    from scipy.linalg import null_space

    p = system.problem
    owners: tuple[model.Problem | model.Step, ...] = (p, p.steps[plan.number])
    mine = system.tied_bodies(body)
    if any(name.partition(".")[0] in mine for owner in owners for name in (*owner.loads, *owner.body_force)):
        return None
    normals, driven = [], False
    laws = dict(zip((s.name for s in system.surfaces), plan.friction_at(plan.t1)))
    at, moved = plan.values(plan.t0), plan.values(plan.t1)
    for s, pairs in _contacts(system, body):
        n, e = pairs.n[~np.isnan(pairs.g)], pairs.e[~np.isnan(pairs.g), 0]
        # Friction up to the pressure itself may hold it, as rolls grip a strip: no force of that cone may push it back.
        normals += [n] if system.frictionless(laws[s.name]) else [n + e, n - e]
        own = system.tool_masters[s.against].dofs
        way = np.array([float((moved - at)[plan.fixed == dof].sum()) for dof in own[:2]])
        driven |= bool(np.isin(own, list(plan.push)).any() or (n @ way > 0.0).any())
    if not driven or not sum(map(len, normals)):
        return None
    held = support_rows(system, frame, plan)[:, :2]
    if system.axisymmetric:
        held = np.concatenate([held, [[1.0, 0.0]]])
    free = null_space(held, rcond=NO_DIFFERENCE) if len(held) else np.eye(2)
    if not free.shape[1]:
        return None
    seen = np.concatenate(normals) @ free
    way = free @ _along_all(seen)
    return way if (np.concatenate(normals) @ way > NO_DIFFERENCE).all() else None


def _along_all(n: Array) -> Array:
    """The direction (d,) that has the largest angle to being across any of vectors n (k, d), d being 1 or 2, if there is one."""
    if n.shape[1] == 1:
        return np.sign(n[0])
    angles = np.sort(np.arctan2(n[:, 1], n[:, 0]))
    gaps = np.diff(angles, append=angles[0] + 2.0 * np.pi)
    # opposite to the middle of the largest sector without a vector
    opposite = angles[np.argmax(gaps)] + 0.5 * float(gaps.max()) + np.pi
    return np.array([np.cos(opposite), np.sin(opposite)])


def _together(system: System, frames: dict[str, Frame], plan: StepPlan) -> tuple[list[str], str]:
    """Bodies and tools that are free to move together in a step, and a sentence about it; empty if there are none."""
    from scipy.linalg import null_space

    own = system.dofs.tool.dofs(np.arange(len(system.tools))).ravel()
    free = own[np.isin(own, list(plan.push))]
    kept = np.array([1]) if system.axisymmetric else np.arange(3)
    columns = _Columns(frames, kept, free)
    if not len(free) or system.dofs.dimension != 2:
        return [], ""
    width = len(frames) * len(kept)
    rows = [np.zeros((0, width + len(free)))]
    alone: dict[str, list[Array]] = {}
    laws = dict(zip((s.name for s in system.surfaces), plan.friction_at(plan.t1)))
    for k, (body, frame) in enumerate(frames.items()):
        held = support_rows(system, frame, plan)
        rows.append(np.zeros((len(held), width + len(free))))
        rows[-1][:, k * len(kept) : (k + 1) * len(kept)] = held[:, kept]
        alone[body] = [held]
        for s, pairs in _contacts(system, body):
            seen, rubs = ~np.isnan(pairs.g), not system.frictionless(laws[s.name])
            for way in (pairs.dg, pairs.ds[:, 0])[: 2 if rubs else 1]:
                both = columns.rows(system, s, pairs, way)[seen]
                rows.append(both)
                alone[body].append(rows_of(frame, system.positions(system.initial().u)[s.points.nodes][seen], way[seen, :2]))
    springs = np.isin(free, list(plan.springs))
    rows.append(np.eye(width + len(free))[width:][springs])
    null = null_space(np.concatenate(rows), rcond=NO_DIFFERENCE).T
    bodies = [
        body for k, body in enumerate(frames)
        if (np.abs(null[:, k * len(kept) : (k + 1) * len(kept)]) > NO_DIFFERENCE).any()
        and not free_in_words(system, frames[body], np.concatenate(alone[body]))
    ]  # fmt: skip
    moving = free[(np.abs(null[:, width:]) > NO_DIFFERENCE).any(axis=0)]
    tools = [t.name for i, t in enumerate(system.tools) if np.isin(system.dofs.tool.dofs(i), moving).any()]
    if not bodies or not tools:
        return [], ""
    k = list(frames).index(bodies[0]) * len(kept)
    full = np.zeros((len(null), 3))
    full[:, kept] = null[:, k : k + len(kept)]
    # the rows that leave exactly these motions of the first body free
    rest = null_space(full, rcond=NO_DIFFERENCE).T if not system.axisymmetric else np.zeros((0, 3))
    words = free_in_words(system, frames[bodies[0]], rest)
    listed = ", ".join(repr(name) for name in (*bodies, *tools))
    return bodies, f"{listed} are free to {words} together, since no motion of these tools is prescribed"
