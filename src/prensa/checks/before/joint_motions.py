"""Motions of everything at once: bodies that move together with pushed tools, and bodies that tools push away."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.before.overlap import unjoined
from prensa.checks.before.pushed_away import Met, flights, met_by, never_resisted
from prensa.checks.before.rigid_motions import contact_rows
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding, Severity
from prensa.linear.rigid_modes import Frame, free_in_words, rows_of, support_rows
from prensa.model.problem import tools_removed
from prensa.system.moments import stages
from prensa.system.rigid import seen_along
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Index


class _Columns(NamedTuple):
    """Rigid motions of everything: those of the ``frames`` of bodies, then the ``free`` degrees of freedom of tools.

    ``kept``: which of the three motions of a body, in space of the six, count; about an axis of revolution that along it alone.
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

    def rows(self, system: System, body: str, met: Met, along: Array) -> Array:
        """Rows (k, columns) of what points of a contact see along directions (k, d): of the body, less that of the tool."""
        out, d = self.blank(len(along)), along.shape[1]
        out[:, self.of(body)] = rows_of(self.frames[body], met.x, along)[:, self.kept]
        for k, (dof, seen) in enumerate(zip(system.tool_masters[met.surface.against].dofs, seen_along(met.pairs.arm, along).T)):
            # turns are measured by the length of the model, so that all columns are displacements
            out[:, self.width :] -= np.outer(seen / (system.length if k >= d else 1.0), self.free == dof)
        return out[~np.isnan(met.pairs.g)]


def joint_motions(system: System) -> Iterator[Finding]:
    """Bodies that nothing holds against the tools which press them."""
    if system.problem.body_contacts:
        return  # they push each other on
    frames = Frame.of_all(system)
    reported: set[str] = set()
    never = never_resisted(system)
    for stage in stages(system):
        if tools_removed(system.problem, stage.plan.number):
            continue
        for body in frames:
            if body in never and body not in reported:
                yield from _flies(system, body, stage.plan, True, reported)
        names, words = _together(system, frames, stage.plan)
        if names and reported.isdisjoint(names):
            reported |= set(names)
            yield Finding(
                f"bodies.{names[0]}",
                f"in step {stage.plan.name!r} {words}: hold one of them, with 'fixed', or with 'move' in the place of 'push'",
                Severity.REFUSE,
            )
        for body in frames:
            if body not in reported:
                yield from _flies(system, body, stage.plan, False, reported)


def _flies(system: System, body: str, plan: StepPlan, never: bool, reported: set[str]) -> Iterator[Finding]:
    """A body that tools push away in a step, whether they ``never`` meet resistance; it is among the ``reported`` ones then."""
    found = flights(system)[body][plan.number]
    if found is None or not found.way.any():
        return
    reported.add(body)
    if len(flights(system)) > 1 and body in unjoined(system):
        return
    nothing = "nothing carries what they press with; " if never else ""
    yield Finding(
        f"bodies.{body}",
        f"it is free to move along {axis_in_words(found.way)}, away from the tools of step {plan.name!r}: {nothing}"
        "hold its other side with 'fixed', or let a tool stand against it",
        Severity.REFUSE if never else Severity.WARN,
    )


def axis_in_words(way: Array) -> str:
    """A direction (d,) in words."""
    sign = "-" if way[np.argmax(np.abs(way))] < 0 else "+"
    return f"{sign}{'xyz'[int(np.argmax(np.abs(way)))]}"


def _together(system: System, frames: dict[str, Frame], plan: StepPlan) -> tuple[list[str], str]:
    """Bodies and tools that are free to move together in a step, and a sentence about it; empty if there are none."""
    from scipy.linalg import null_space

    own = system.dofs.tool.dofs(np.arange(len(system.tools))).ravel()
    motions = 3 if system.dofs.dimension == 2 else 6
    kept = np.array([1]) if system.axisymmetric else np.arange(motions)
    columns = _Columns(frames, kept, own[np.isin(own, list(plan.push))])
    if not len(columns.free):
        return [], ""
    # as many rows as columns say the same as those of all points
    null = null_space(np.linalg.qr(_resisted(system, columns, plan), mode="r"), rcond=NO_DIFFERENCE).T
    # without what tools may do alone, such as a ball that turns about its middle
    ways, values, _ = np.linalg.svd(null[:, : columns.width])
    joint = ways.T[: len(values)][values > NO_DIFFERENCE] @ null
    moves = {body: joint[:, columns.of(body)] for body in frames}
    bodies = [body for body in frames if (np.abs(moves[body]) > NO_DIFFERENCE).any() and _held(system, body, frames[body], plan)]
    moving = columns.free[(np.abs(joint[:, columns.width :]) > NO_DIFFERENCE).any(axis=0)]
    tools = [t.name for i, t in enumerate(system.tools) if np.isin(system.dofs.tool.dofs(i), moving).any()]
    if not bodies or not tools:
        return [], ""
    # the rows that leave exactly these motions of the first body free
    rest = np.zeros((0, 3)) if system.axisymmetric else null_space(moves[bodies[0]], rcond=NO_DIFFERENCE).T
    words = free_in_words(system, frames[bodies[0]], rest)
    listed = ", ".join(repr(name) for name in (*bodies, *tools))
    return bodies, f"{listed} are free to {words} together, since no motion of these tools is prescribed"


def _resisted(system: System, columns: _Columns, plan: StepPlan) -> Array:
    """Rows (k, columns) of all that resists in a step: supports of bodies, contacts with tools, and springs of these."""
    rows = [columns.blank(0)]
    for body, frame in columns.frames.items():
        held = support_rows(system, frame, plan)
        rows.append(columns.blank(len(held)))
        rows[-1][:, columns.of(body)] = held[:, columns.kept]
        for met in met_by(system, body, plan):
            tangents = np.moveaxis(met.pairs.e, 1, 0) if met.rubs else ()
            rows += [columns.rows(system, body, met, along) for along in (met.pairs.n, *tangents)]
    springs = np.isin(columns.free, list(plan.springs))
    rows.append(columns.blank(int(springs.sum())))
    rows[-1][:, columns.width :] = np.eye(len(springs))[springs]
    return np.concatenate(rows)


def _held(system: System, body: str, frame: Frame, plan: StepPlan) -> bool:
    """Whether supports, and contacts with tools that stood still, hold a body; of others `rigid_motions` speaks."""
    rows = [support_rows(system, frame, plan), contact_rows(system, body, frame, plan, False)]
    return not free_in_words(system, frame, np.concatenate(rows))
