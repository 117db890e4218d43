"""Tables that begin elsewhere than where their tool, support or force is: found before a run, or when a step begins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import StepBegun, warning
from prensa.checks.thresholds import NO_DIFFERENCE, SLIGHT
from prensa.errors import Finding
from prensa.model.fields import force_along, motions_in
from prensa.system.moments import stages
from prensa.system.planning import plan_step
from prensa.system.schedule import Amplitude, StepPlan, Table, tabulated
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array, Flags


def table_starts(system: System) -> Iterator[Finding]:
    """Tables of displacement that begin elsewhere than where the steps before leave their tool or support."""
    for plan, before, start, known, *_ in stages(system):
        yield from _beginnings(system, plan, start, known, before)


def _beginnings(
    system: System, plan: StepPlan, at_start: Array, known: Flags, before: StepPlan | None
) -> Iterator[Finding]:
    """Tables of displacement whose value at the start of their step is not where the tool or the support is."""
    fixed = set(plan.fixed.tolist())
    h = min((float(s.points.depth.min()) for s in system.surfaces), default=system.length)
    for path, name, axis, value, dofs in _tables(system, plan.number):
        # Turns are held against a radian, ways against an element.
        least = SLIGHT * (h if axis[0] != "r" else 1.0)
        relative = path.split(".")[2] == "by"
        first = tabulated(value)(plan.t0)
        for dof in dofs:
            if dof in plan.springs:
                start = before.springs[dof][1](plan.t0) if before is not None and dof in before.springs else 0.0
            elif known[dof] and dof in fixed:
                start = float(at_start[dof])
            else:
                continue
            if abs(first if relative else first - start) > least:
                yield Finding(
                    path,
                    f"{name} would jump: the table has {first:.6g} at time {plan.t0:g}, where the step begins, and "
                    + (
                        f"'by' is measured from where it is then: begin it with [{plan.t0:g}, 0]"
                        if relative
                        else f"it is at {start:.6g} then: begin the table with [{plan.t0:g}, {start:.6g}], or measure it from "
                        "there with 'by'"
                    )
                    + f"; otherwise it is moved there over the first {_first(plan)}",
                )
                break


def _jumps(system: System, plan: StepPlan) -> Iterator[str]:
    """Sentences on tables of displacement that begin elsewhere than where their tool or support has come to.

    plan: with the true start of its step. What `table_starts` predicted, which knows it where nothing was driven by force,
    is left out.
    """
    here = dict(zip(plan.fixed.tolist(), plan.values(plan.t0).tolist()))
    missing = {int(dof): way for g in plan.groups for dof, way in zip(g.dofs, g.missing(plan.t0).tolist())}
    h = min((float(s.points.depth.min()) for s in system.surfaces), default=system.length)
    found = []
    for path, name, axis, value, dofs in _tables(system, plan.number):
        way = max(dofs, key=lambda dof: abs(missing.get(dof, 0.0)), default=-1)
        if abs(missing.get(way, 0.0)) > SLIGHT * (h if axis[0] != "r" else 1.0):
            found.append((path, name, tabulated(value)(plan.t0), here[way]))
    known = {n.path for n in table_starts(system)} if found else set()
    for path, name, first, place in found:
        if path not in known:
            relative = path.split(".")[2] == "by"
            yield (
                f"step {plan.name!r}, "
                f"{path.split('.', 2)[2]}: the table has "
                f"{first:.6g} at time {plan.t0:g}, where "
                f"{name} is at "
                f"{0.0 if relative else place:.6g}: it is "
                f"moved there over the first {_first(plan)} "
                "(let the table begin with "
                f"{0.0 if relative else place:.6g}" + (")" if relative else ", or measure it from there with 'by')")
            )


def table_jumps(system: System, given: StepBegun) -> Iterator[Finding]:
    """Tables that do not begin a step with the force that acts then, or where tools are: the difference is released."""
    yield from map(warning, _differences(system, given.state, given.plan))


def _differences(system: System, state: State, plan: StepPlan) -> Iterator[str]:
    """Sentences on such tables."""
    yield from _jumps(system, plan)
    before = plan_step(system, plan.number - 1, state.step_start, state.ends)
    ended = state.clock.time
    for dof, amplitude in plan.push.items():
        tool, component = (int(v) for v in system.dofs.tool.split(np.asarray(dof)))
        key = force_along(system.problem.space, system.dofs.tool.components[component])
        yield from _jump(f"push.{system.tools[tool].name}.{key}", amplitude, float(state.work[dof]), plan)
    for name, load in plan.loads.items():
        for key, course in load.courses.items():
            old = before.loads[name].courses[key](ended) if name in before.loads else 0.0
            yield from _jump(f"loads.{name}.{key}", course, old, plan)
    for body, amplitudes in plan.body_force.items():
        for i, amplitude in enumerate(amplitudes):
            old = before.body_force[body][i](ended) if body in before.body_force else 0.0
            yield from _jump(f"body_force.{body}.{'xyz'[i]}", amplitude, old, plan)


def _jump(path: str, amplitude: Amplitude, carried: float, plan: StepPlan) -> Iterator[str]:
    asked = amplitude(plan.t0)
    if not amplitude.ramp and abs(asked - carried) > NO_DIFFERENCE * max(abs(asked), abs(carried)):
        yield (
            f"step {plan.name!r}, {path}: the table has {asked:.6g} at time {plan.t0:g}, where {carried:.6g} acts; the "
            f"difference ramps down to 0 over the step (let the table begin with {carried:.6g})"
        )


def _first(plan: StepPlan) -> str:
    """The part of a step in which what lies elsewhere comes to its table, in words."""
    return "tenth of the step" if plan.increments is None else "increment"


def _tables(system: System, number: int) -> Iterator[tuple[str, str, str, Table, list[int]]]:
    """Path, words, axis, value and dofs of each table of displacement that begins to count in a step."""
    p, step = system.problem, system.problem.steps[number]
    for kind in ("move", "by"):
        for name, motion in getattr(step, kind).items():
            for i, axis in enumerate(motions_in(p.space)):
                if isinstance(value := getattr(motion, axis), tuple):
                    path = f"steps.{number}.{kind}.{name}.{axis}"
                    if name in p.tools:
                        first = system.tool_dof(list(p.tools).index(name))
                        yield path, f"tool {name!r}", axis, value, [first + i]
                    else:
                        yield path, f"{name!r}", axis, value, _dofs(system, name, axis)
    for prefix, owner in [("", p)] * (number == 0) + [(f"steps.{number}.", step)]:
        for name, support in owner.fixed.items():
            for axis in "xyz":
                if isinstance(value := getattr(support, axis), tuple):
                    yield f"{prefix}fixed.{name}.{axis}", f"{name!r}", axis, value, _dofs(system, name, axis)


def _dofs(system: System, boundary: str, axis: str) -> list[int]:
    return list(system.master_dofs(system.dofs.displacement.dof(system.boundary_nodes(boundary), axis)).tolist())
