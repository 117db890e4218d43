"""Positions of tools and supports through the steps, bodies at rest: what the checks before a run look at."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.model.feed import ends_early
from prensa.model.problem import Problem, Step, tools_removed
from prensa.system.once import once
from prensa.system.planning import plan_step
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Flags

SAMPLES = 17
"""Moments of a step at which tools are looked at, with corners of tables: few tools pass a body in a sixteenth of their way."""


class Stage(NamedTuple):
    """A step by its plan and the one ``before``, with degrees of freedom (ndof,) at its ``start`` and ``end``.

    ``known``, ``known_after`` (ndof,): those that are prescribed up to the start, and up to the end.
    """

    plan: StepPlan
    before: StepPlan | None
    start: Array
    known: Flags
    end: Array
    known_after: Flags


@once
def stages(system: System) -> tuple[Stage, ...]:
    """The steps of a problem, one after the other, with bodies where supports leave them."""
    return tuple(_stages(system))


def _stages(system: System) -> Iterator[Stage]:
    start, known, before = system.initial().u, np.ones(system.ndof, dtype=bool), None
    for number, step in enumerate(system.problem.steps):
        plan = plan_step(system, number, start)
        after = known & np.isin(np.arange(system.ndof), plan.fixed)
        if ends_early(step):  # which may end it anywhere on the way
            after[plan.fixed] &= plan.values(plan.t1) == start[plan.fixed]
        else:
            after |= _ends_at_a_place(system, plan)
        end = start.copy()
        end[plan.fixed] = plan.values(plan.t1)
        yield Stage(plan, before, start, known, end, after)
        start, known, before = system.step_begun(end), after, plan


def _ends_at_a_place(system: System, plan: StepPlan) -> Flags:
    """Unknowns (ndof,) that a step brings to a given place, wherever they were: not by a way, a speed or a crank."""
    out, step = np.zeros(system.ndof, dtype=bool), system.problem.steps[plan.number]
    for g in plan.groups:
        out[g.dofs] = g.amplitude is not None and not g.amplitude.relative
    for t, name in enumerate(system.problem.tools):
        for dof, key in zip(system.dofs.tool.dofs(t), system.dofs.tool.components):
            out[dof] &= all(getattr(kind.get(name), key, None) is None for kind in (step.velocity, step.crank))
    return out


class Moment(NamedTuple):
    """Bodies at rest at time t: degrees of freedom u (ndof,), and which tools have a place that is prescribed here.

    That of a tool that forces, or the end of a step, have left anywhere is so again at the end of its next absolute motion.
    """

    plan: StepPlan
    t: float
    u: Array
    known: Flags


def moments(system: System) -> Iterator[Moment]:
    """Moments of all steps, in order."""
    known = np.ones(len(system.tools), dtype=bool)
    for plan, _, start, _, _, after in stages(system):
        gone, early = tools_removed(system.problem, plan.number), ends_early(system.problem.steps[plan.number])
        at_end = np.zeros_like(known)
        for t in range(len(system.tools)):
            dofs = system.dofs.tool.dofs(t)
            own = np.isin(plan.fixed, dofs)
            # what ends a step may do so anywhere on its way, and tools that are removed are nowhere
            still = not gone and (not early or np.array_equal(plan.values(plan.t1)[own], start[plan.fixed[own]]))
            known[t] &= still and bool(np.isin(dofs[: system.dofs.dimension], plan.fixed).all())
            at_end[t] = known[t] or (not gone and bool(after[dofs].all()))  # a motion to a given place finds it again
        for t in np.unique(np.concatenate([np.linspace(plan.t0, plan.t1, SAMPLES), plan.corners()])):
            u = start.copy()
            u[plan.fixed] = plan.values(float(t))
            yield Moment(plan, float(t), u, at_end.copy() if t == plan.t1 else known.copy())
        known = at_end


def driven(system: System, body: str) -> bool:
    """Whether something besides tools can move a body."""
    p = system.problem
    owners: tuple[Problem | Step, ...] = (p, *p.steps)
    if any(name.partition(".")[0] == body for step in p.steps for name in p.driven(step)):
        return True
    for owner in owners:
        if any(name.partition(".")[0] == body for name in owner.loads) or body in owner.body_force:
            return True
        for name, f in owner.fixed.items():
            if name.partition(".")[0] == body and any(v is not None and v != "held" for v in (f.x, f.y, f.z, f.normal)):
                return True
    return False


def contact_path(system: System, i: int) -> str:
    """The path of a contact, or of its tool where no contact is written."""
    if "contacts" in system.problem.stated or not system.problem.stated:
        return f"contacts.{i}"
    return f"tools.{system.surfaces[i].against}"
