"""What the steps prescribe, looked at before the solve: tables that begin elsewhere, steps that move nothing, bores held by a
symmetry line of plane problems, and tools that press small-strain bodies far.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from prensa.checks.check import StepBegun, warning
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.model.feed import ends_early
from prensa.model.problem import Step
from prensa.system.planning import plan_step
from prensa.system.schedule import Amplitude, StepPlan, Table, tabulated
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array, Flags

JUMP = 0.01  # way over the least element depth of the contacts that a table may begin elsewhere
SMALL = 0.1  # mean displacement gradient from which small-strain kinematics is remarked upon
ALONG = 0.9  # cosine from which a support acts along a tool's normal
DIFFERS = 1e-6  # share of a force from which a table that does not begin with it is reported
AXES = ("x", "y", "rz")


def motions(system: System) -> Iterator[Finding]:
    """Findings on what each step prescribes; bodies are taken where supports and steps before leave them."""
    yield from _bores(system)
    at_start, known = system.initial().u, np.ones(system.ndof, dtype=bool)
    before: StepPlan | None = None
    small = system.problem.kinematics == "small" and not system.problem.allow_large_strain
    reached: dict[str, tuple[float, float]] = {}
    driven: dict[str, tuple[float, float]] = {}
    for number in range(len(system.problem.steps)):
        plan = plan_step(system, number, at_start)
        yield from _beginnings(system, plan, at_start, known, before)
        if before is not None and known[plan.fixed].all():
            yield from _standstill(system, plan, at_start, before)
        yield from _never_there(system, plan, at_start, known)
        known &= np.isin(np.arange(system.ndof), plan.fixed)
        for g in plan.groups:  # which is at a given place in the end, wherever it was
            known[g.dofs] |= g.amplitude is not None and not g.amplitude.relative
        if ends_early(system.problem.steps[number]):  # which may end it anywhere on the way
            known[plan.fixed] &= plan.values(plan.t1) == at_start[plan.fixed]
        begun, at_start, before = at_start, at_start.copy(), plan
        at_start[plan.fixed] = plan.values(plan.t1)
        for body, depth, far in pressed_far(system, plan, begun, at_start, known) if small else ():
            reached[body] = max(reached.get(body, (0.0, 1.0)), (depth, far), key=lambda r: r[0] / r[1])
        for body, way, far in driven_apart(system, plan, at_start) if small else ():
            driven[body] = max(driven.get(body, (0.0, 1.0)), (way, far), key=lambda r: r[0] / r[1])
    yield from _small(reached, "tools press {} in by {:.4g} at {:.4g} from its support")
    yield from _small(driven, "supports of {} move by {:.4g} against each other, {:.4g} apart")


# ------------------------------------------------------------------------------------------------------------- beginnings
def _beginnings(
    system: System, plan: StepPlan, at_start: Array, known: Flags, before: StepPlan | None
) -> Iterator[Finding]:
    """Tables of displacement whose value at the start of their step is not where the tool or the support is."""
    fixed = set(plan.fixed.tolist())
    h = min((float(s.points.depth.min()) for s in system.surfaces), default=system.length)
    for path, name, axis, value, dofs in _tables(system, plan.number):
        least = JUMP * (h if axis != "rz" else 1.0)
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
                    + f"; as it stands, it comes there over the first {_first(plan)}",
                )
                break


def _jumps(system: System, plan: StepPlan) -> Iterator[str]:
    """Sentences on tables of displacement that begin elsewhere than where their tool or support has come to.

    plan: with the true start of its step. What `motions` predicted, which knows it where nothing was driven by force,
    is left out.
    """
    if system.dofs.dimension != 2:
        return
    here = dict(zip(plan.fixed.tolist(), plan.values(plan.t0).tolist()))
    missing = {int(dof): way for g in plan.groups for dof, way in zip(g.dofs, g.missing(plan.t0).tolist())}
    h = min((float(s.points.depth.min()) for s in system.surfaces), default=system.length)
    found = []
    for path, name, axis, value, dofs in _tables(system, plan.number):
        way = max(dofs, key=lambda dof: abs(missing.get(dof, 0.0)), default=-1)
        if abs(missing.get(way, 0.0)) > JUMP * (h if axis != "rz" else 1.0):
            found.append((path, name, tabulated(value)(plan.t0), here[way]))
    foretold = {n.path for n in motions(system)} if found else set()
    for path, name, first, place in found:
        if path not in foretold:
            relative = path.split(".")[2] == "by"
            yield (
                f"step {plan.name!r}, {path.split('.', 2)[2]}: the table has {first:.6g} at time {plan.t0:g}, where {name} is at "
                f"{0.0 if relative else place:.6g}: it comes there over the first {_first(plan)} (let the table begin with "
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
        key = "m" if system.dofs.tool.components[component] == "rz" else system.dofs.tool.components[component]
        yield from _jump(f"push.{system.tools[tool].name}.{key}", amplitude, float(state.work[dof]), plan)
    for name, load in plan.loads.items():
        for key in ("pressure", "shear", "tx", "ty"):
            old = getattr(before.loads[name], key)(ended) if name in before.loads else 0.0
            yield from _jump(f"loads.{name}.{key}", getattr(load, key), old, plan)
    for body, amplitudes in plan.body_force.items():
        for i, amplitude in enumerate(amplitudes):
            old = before.body_force[body][i](ended) if body in before.body_force else 0.0
            yield from _jump(f"body_force.{body}.{'xyz'[i]}", amplitude, old, plan)


def _jump(path: str, amplitude: Amplitude, carried: float, plan: StepPlan) -> Iterator[str]:
    asked = amplitude(plan.t0)
    if not amplitude.ramp and abs(asked - carried) > DIFFERS * max(abs(asked), abs(carried)):
        yield (
            f"step {plan.name!r}, {path}: the table has {asked:.6g} at time {plan.t0:g}, where {carried:.6g} is carried; the "
            f"difference goes linearly to 0 over the step (let the table begin with {carried:.6g})"
        )


def _first(plan: StepPlan) -> str:
    """The part of a step in which what lies elsewhere comes to its table, in words."""
    return "tenth of the step" if plan.increments is None else "increment"


def _tables(system: System, number: int) -> Iterator[tuple[str, str, str, Table, list[int]]]:
    """Path, words, axis, value and dofs of each table of displacement that begins to count in a step."""
    p, step = system.problem, system.problem.steps[number]
    for kind in ("move", "by"):
        for name, motion in getattr(step, kind).items():
            for i, axis in enumerate(AXES):
                if isinstance(value := getattr(motion, axis), tuple):
                    path = f"steps.{number}.{kind}.{name}.{axis}"
                    if name in p.tools:
                        first = system.tool_dof(list(p.tools).index(name))
                        yield path, f"tool {name!r}", axis, value, [first + i]
                    else:
                        yield path, f"{name!r}", axis, value, _dofs(system, name, axis)
    for prefix, owner in [("", p)] * (number == 0) + [(f"steps.{number}.", step)]:
        for name, support in owner.fixed.items():
            for axis in ("x", "y"):
                if isinstance(value := getattr(support, axis), tuple):
                    yield f"{prefix}fixed.{name}.{axis}", f"{name!r}", axis, value, _dofs(system, name, axis)


def _dofs(system: System, boundary: str, axis: str) -> list[int]:
    return list(system.master_dofs(system.dofs.displacement.dof(system.boundary_nodes(boundary), axis)).tolist())


# ------------------------------------------------------------------------------------------------------------ early ends
def _never_there(system: System, plan: StepPlan, at_start: Array, known: Flags) -> Iterator[Finding]:
    """Travels that are to end a step and that lie beyond what it prescribes."""
    until = system.problem.steps[plan.number].until
    for name, target in until.travel.items() if until is not None else ():
        first = system.tool_dof(list(system.problem.tools).index(name))
        for i, axis in enumerate(AXES):
            value, dof = getattr(target, axis), first + i
            if value is None or dof not in plan.fixed or not known[dof]:
                continue
            where = int(np.searchsorted(plan.fixed, dof))
            way = np.array([plan.values(float(t))[where] for t in [plan.t0, *plan.corners(), plan.t1]])
            start = float(at_start[dof])
            if not min(way.min(), start) <= value <= max(way.max(), start):
                aside = "let it go further" if value * way[-1] > 0.0 else "check the sign, which is that of history.csv"
                remedy = aside if np.ptp(way) else "it is not moved along that: name what the step moves"
                yield Finding(
                    f"steps.{plan.number}.until.travel.{name}.{axis}",
                    f"tool {name!r} never gets to {axis} = {value:g}: step {plan.name!r} moves it from {start:.6g} to "
                    f"{way[-1]:.6g}; {remedy}",
                )


# ------------------------------------------------------------------------------------------------------------- standstill
def _standstill(system: System, plan: StepPlan, at_start: Array, before: StepPlan) -> Iterator[Finding]:
    """A step that is to change something and in which nothing changes: totals of the step before, written again."""
    step = system.problem.steps[plan.number]
    written = next(_repeated(step, plan), None) or _nothing(step, plan)
    rests = step.duration is not None  # time is to pass
    if written is None or rests or not _unchanged(plan, before) or plan.friction != before.friction:
        return
    start = np.concatenate([at_start[plan.fixed], [mount(plan.t0) for _, mount in before.springs.values()]])
    for t in [*plan.corners(), plan.t1]:
        if not np.allclose(plan.motion(float(t)), start, rtol=1e-9, atol=1e-12 * system.length):
            return
    yield Finding(*written)


def _repeated(step: Step, plan: StepPlan) -> Iterator[tuple[str, str]]:
    """Path and words of each number of a step that says nothing new if nothing changes in it."""
    for name, motion in step.move.items():
        for axis in AXES:
            if isinstance(value := getattr(motion, axis), float) and value:
                yield (
                    f"steps.{plan.number}.move.{name}.{axis}",
                    f"step {plan.name!r} moves nothing: tool {name!r} is at {axis} = {value:g} already; 'move' is measured from "
                    f"the initial place: write {2 * value:g}, or 'by: {{{name}: {{{axis}: {value:g}}}}}' for as much again",
                )
    for name, support in step.fixed.items():
        for axis in ("x", "y"):
            if isinstance(value := getattr(support, axis), float) and value:
                yield (
                    f"steps.{plan.number}.fixed.{name}.{axis}",
                    f"step {plan.name!r} moves nothing: {name!r} is at {axis} = {value:g} already; 'fixed' is measured from the "
                    f"initial place: write {2 * value:g}, or 'by: {{{name}: {{{axis}: {value:g}}}}}' for as much again",
                )
    for kind, what in (("push", "push"), ("loads", "load")):
        for name, entry in getattr(step, kind).items():
            for axis, value in vars(entry).items():
                if isinstance(value, float) and value:
                    yield (
                        f"steps.{plan.number}.{kind}.{name}.{axis}",
                        f"step {plan.name!r} changes nothing: the {what} {axis} = {value:g} of {name!r} is there already; it is "
                        f"the whole {what}, not what is added: write {2 * value:g} for twice as much, or leave the step out",
                    )


def _nothing(step: Step, plan: StepPlan) -> tuple[str, str] | None:
    """Path and words of a step that says nothing at all."""
    bare = Step(step.name, increments=step.increments)
    return None if step != bare else (
        f"steps.{plan.number}",
        f"step {step.name!r} says nothing, so that all stays as it is: what moves has to be said in every step; say it, give a "
        "'duration' if time is to pass, or leave the step out",
    )  # fmt: skip


def _unchanged(plan: StepPlan, before: StepPlan) -> bool:
    """Whether supports, forces and loads of a step are those with which the one before ended, and stay so."""

    def levels(p: StepPlan, t: float) -> Array:
        amplitudes = [p.push[dof] for dof in sorted(p.push)]
        amplitudes += [c for _, ld in sorted(p.loads.items()) for c in (ld.pressure, ld.shear, ld.tx, ld.ty)]
        amplitudes += [c for _, pair in sorted(p.body_force.items()) for c in pair]
        return np.array([c(t) for c in amplitudes])

    same = np.array_equal(plan.fixed, before.fixed) and list(plan.springs) == list(before.springs)
    if not same or plan.loads.keys() != before.loads.keys() or plan.body_force.keys() != before.body_force.keys():
        return False
    if plan.push.keys() != before.push.keys():
        return False
    last = levels(before, before.t1)
    return all(np.array_equal(levels(plan, float(t)), last) for t in [*plan.corners(), plan.t1])


# ------------------------------------------------------------------------------------------------------------------ bores
def _bores(system: System) -> Iterator[Finding]:
    """The symmetry line of a plane problem, copied to a ring: a straight bore that is held radially and nothing else."""
    p = system.problem
    if not system.axisymmetric:
        return
    owners: list[tuple[str, Any]] = [("", p), *((f"steps.{i}.", s) for i, s in enumerate(p.steps))]
    for prefix, owner in owners:
        for name, support in owner.fixed.items():
            if support.x != "held" or support.y is not None:
                continue
            body = name.partition(".")[0]
            r, least = system.X[system.boundary_nodes(name), 0], float(system.meshes[body].points[:, 0].min())
            if len(r) > 1 and least > 0 and np.ptp(r) <= 1e-9 * system.length and r[0] <= least * (1 + 1e-9):
                yield Finding(
                    f"{prefix}fixed.{name}",
                    f"it holds a bore of radius {r[0]:.4g}: the symmetry line of a plane problem is the axis here, and a bore "
                    "opens and closes; leave it out, or write {x: 0} if a rigid mandrel is meant",
                )


# ------------------------------------------------------------------------------------------------------------ small strain
def pressed_far(
    system: System, plan: StepPlan, begun: Array, u: Array, known: Flags
) -> Iterator[tuple[str, float, float]]:
    """Body, share and distance of the deepest reach of tools at the end of a step, all of known places.

    The mean displacement gradient between a pressed node and a held one is at least the way over the distance. ``begun``, u
    (ndof,): at both ends of the step; a tool may be on the far side of a thin body in the end, if that does not bend.
    """
    for s in system.surfaces:
        if not known[system.master(s).dofs].all():
            continue
        way = (system.master(s).place(u) - system.master(s).place(begun))[: system.dofs.dimension]
        found = [_reach(system, s, plan, u, 0.0 * way), _reach(system, s, plan, begun, way)]
        deepest = max((f for f in found if f is not None), default=None, key=lambda f: f[0] / f[1])
        if deepest is not None:
            yield s.body, *deepest


def _reach(system: System, s: Surface, plan: StepPlan, u: Array, way: Array) -> tuple[float, float] | None:
    """How deep a tool presses a node in by a way (d,) from dofs u, and how far that is from what holds it against that."""
    pairs = system.node_stencils(s, u)
    k = int(np.argmin(np.where(np.abs(pairs.n).max(axis=1) > ALONG, pairs.g, np.inf)))
    depth, axis = float(way @ pairs.n[k] - pairs.g[k]), int(np.argmax(np.abs(pairs.n[k])))
    if not depth > 0 or abs(pairs.n[k, axis]) < ALONG:
        return None
    nodes, along = system.dofs.displacement.split(plan.fixed[system.dofs.displacement.owns(plan.fixed)])
    first = system.offsets[s.body]
    mine = (along == axis) & (nodes >= first) & (nodes < first + len(system.meshes[s.body].points))
    x = system.positions(u)
    far = float(np.hypot(*(x[nodes[mine]] - x[s.points.nodes[k]]).T).min()) if mine.any() else 0.0
    return (depth, far) if far > float(s.points.depth.min()) else None


def driven_apart(system: System, plan: StepPlan, u: Array) -> Iterator[tuple[str, float, float]]:
    """Body, way and distance of any two of its supports that a step moves against each other along one axis.

    Taken between their middles: the mean displacement gradient on the way from one to the other.
    """
    field = system.dofs.displacement
    held: list[tuple[str, str, Array, float]] = []
    for g in plan.groups:
        if g.support is None or not len(g.dofs):
            continue
        name, axis = g.support
        nodes, _ = field.split(g.dofs)
        here = (name.partition(".")[0], axis, system.X[nodes].mean(axis=0), float(u[g.dofs].mean()))
        for body, along, middle, value in held:
            far = float(np.hypot(*(here[2] - middle)))
            if (body, along) == here[:2] and far > 0 and here[3] != value:
                yield body, abs(here[3] - value), far
        held.append(here)


def _small(reached: dict[str, tuple[float, float]], words: str) -> Iterator[Finding]:
    """Small-strain kinematics where tools or supports go too far for it; ``words`` of the body, the way and the distance."""
    for body, (depth, far) in reached.items():
        if depth > SMALL * far:
            yield Finding(
                "kinematics",
                words.format(repr(body), depth, far)
                + f", strains or rotations of {depth / far:.2g}: 'small' neglects terms of that size, and is refused in the run "
                "where they are beyond 0.1 in a twentieth of the body; use 'finite'",
            )
