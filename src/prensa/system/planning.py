"""The plan of a step: from what the description says of it to degrees of freedom and their courses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from prensa.friction.fading import Fading, fading
from prensa.friction.law import FrictionLaw
from prensa.model import problem as model
from prensa.model.fields import force_along
from prensa.model.seconds import duration_of
from prensa.system.bodies import Bodies
from prensa.system.control import FACTOR
from prensa.system.interference import share_groups
from prensa.system.minimal_supports import found_supports
from prensa.system.schedule import (
    Amplitude,
    BoundaryLoad,
    Control,
    Prescribed,
    StepPlan,
    Table,
    amplitude,
    cranked,
    integrated,
    way,
    zero_amplitude,
)
from prensa.system.system import System
from prensa.types import Array, Index


class Ends:
    """When the steps of a run ended: step k at time k + 1, if not earlier."""

    def __init__(self, times: Array | None) -> None:
        self.times = () if times is None else times

    def of(self, number: int) -> float:
        """Time at which step *number* (from 0) ended."""
        return float(self.times[number]) if number < len(self.times) else number + 1.0

    def early(self, number: int) -> bool:
        """Whether it did so before its time was over."""
        return self.of(number) < number + 1.0

    def cut(self, c: Amplitude, number: int) -> Amplitude:
        """A course of step *number* as it is afterwards."""
        return c.held(self.of(number)) if self.early(number) else c


def plan_step(system: System, number: int, step_start: Array, ends: Array | None = None) -> StepPlan:
    """Plan of step *number* (from 0) with the unknowns' values ``step_start`` (ndof,) at its start.

    ``ends`` (steps,): times at which the steps before it ended, if some of them ended early.

    Raises
    ------
    ValueError
        If an unknown is prescribed twice with different values.

    """
    p, step = system.problem, system.problem.steps[number]
    ended = Ends(ends)
    gone = model.tools_removed(p, number)
    groups = support_groups(system, number, step_start, ended)
    groups += share_groups(p, system.dofs, number, step_start)
    push: dict[int, Amplitude] = {}
    springs: dict[int, tuple[float, Amplitude]] = {}
    for t, name in enumerate(p.tools):
        for dof, key in zip(system.dofs.tool.dofs(t).tolist(), system.dofs.tool.components):
            force = None if gone else _push(p, name, key, number)
            stiffness = None if gone else getattr(p.tools[name].spring, key, None)
            if stiffness is not None:
                springs[dof] = stiffness, _mount(p, name, key, number, ended)
            elif force is not None:
                push[dof] = amplitude(force, _push_before(p, name, key, number, ended), float(number), float(number + 1))
                if (led := getattr(step.control.get(name), key, None)) is not None:
                    groups.append(
                        Prescribed(np.array([dof]), step_start[[dof]].copy(), way(led, float(number), number + 1.0))
                    )
            else:
                groups.append(_tool_group(step, name, key, dof, step_start, number))
    # Committed orientations of tools in space are updated at commits only; during an increment they are given, like supports.
    if len(own := system.dofs.orientation(np.arange(system.dofs.tool.count)).ravel()):
        groups.append(Prescribed(own, step_start[own].copy()))
    if gone:
        multipliers = [np.arange(s.unknowns.start, s.unknowns.stop) for s in system.surfaces or system.removed if s.exact]
        groups += [Prescribed(dofs, np.zeros(len(dofs))) for dofs in multipliers]
        groups += found_supports(system, groups, step_start)
    control = _control(system, push, groups, step_start)
    return StepPlan(
        step.name, number, float(number), float(number + 1), groups, push, _loads(system, number, ended),
        _body_forces(p, number, ended), _fading(p, number, ended), step.increments, springs,
        _released(system, number, step_start, groups, ended), control, duration_of(step),
    )  # fmt: skip


def _control(system: System, push: dict[int, Amplitude], groups: list[Prescribed], step_start: Array) -> Control | None:
    """The displacement control of a step, whose ``groups`` it adds the factor to where there is none; None without."""
    field = system.dofs.fields.get(FACTOR)
    if field is None:
        return None
    factor = field.dofs(0)
    lead = next((int(dof) for g in groups for dof in g.dofs if dof in push), None)
    if lead is None:
        groups.append(Prescribed(factor, step_start[factor].copy()))
        return None
    return Control(lead, int(factor[0]), float(step_start[factor[0]]))


def _supports(p: model.Problem, number: int) -> dict[tuple[str, str], tuple[float | Table, int, bool]]:
    """(boundary, axis) → value, step since which it holds, and whether the value is a way: each step's up to this one.

    The problem's come first; a later entry replaces an earlier one of the boundary.
    """
    supports: dict[tuple[str, str], tuple[float | Table, int, bool]] = {}
    for k, source in [(-1, p.fixed), *[(i, s.fixed) for i, s in enumerate(p.steps[: number + 1])]]:
        for name, f in source.items():
            for c in model.SPATIAL_AXES if f.free else ():
                supports.pop((name, c), None)
            for c in model.SPATIAL_AXES:
                if (value := getattr(f, c, None)) is not None:
                    supports[(name, c)] = (value, max(k, 0), False)
        for name, motion in p.driven(p.steps[k]).items() if k >= 0 else ():
            for c in model.SPATIAL_AXES:
                if (way := getattr(motion, c, None)) is not None:
                    supports[(name, c)] = (way, k, True)
        for name, feed in p.steps[k].feed.items() if 0 <= k < number else ():
            supports.pop((name, feed.axis), None)  # nothing holds what was fed
    return supports


def support_groups(system: Bodies, number: int, step_start: Array, ends: Ends) -> list[Prescribed]:
    """Displacements that supports and the axis of revolution prescribe in step *number*, each once; −1: before the first one."""
    groups: list[Prescribed] = []
    taken = np.zeros(system.dofs.displacement.size, dtype=bool)

    def add(dofs: Index, c: Amplitude | None, support: tuple[str, str] | None = None) -> None:
        # Merged nodes stand for one another, and the corner of two boundaries is in both: an unknown is prescribed once.
        dofs = system.master_dofs(dofs)
        dofs = dofs[~taken[dofs]]
        taken[dofs] = True
        if len(dofs):
            groups.append(Prescribed(dofs, step_start[dofs].copy(), c, support))

    t0, t1 = float(number), float(number + 1)
    for (name, axis), (value, since, relative) in _supports(system.problem, number).items():
        dofs = system.dofs.displacement.dof(system.boundary_nodes(name), axis)
        goes_on = isinstance(value, tuple) and not relative and not any(ends.early(k) for k in range(since, number))
        held = value == "held" or (since < number and not goes_on)
        add(dofs, None if held else way(value, t0, t1) if relative else amplitude(value, 0.0, t0, t1), (name, axis))
    add(system.dofs.displacement.dof(system.axis_nodes, "x"), None)
    return groups


def _released(system: System, number: int, step_start: Array, groups: list[Prescribed], ends: Ends) -> list[Prescribed]:
    """What supports held in the step before and these groups do not prescribe."""
    if number == 0:
        return []
    taken = np.concatenate([np.zeros(0, dtype=np.int64), *(g.dofs for g in groups)])
    out = []
    for g in support_groups(system, number - 1, step_start, ends):
        free = ~np.isin(g.dofs, taken)
        if free.any():
            out.append(Prescribed(g.dofs[free], g.start[free], support=g.support))
    return out


def _tool_group(step: model.Step, name: str, key: str, dof: int, step_start: Array, number: int) -> Prescribed:
    """One motion of a tool that a step prescribes, or holds where it says nothing."""
    t0, t1 = float(number), float(number + 1)
    by = getattr(step.by.get(name), key, None)
    c = way(by, t0, t1) if by is not None else _absolute(step, name, key, float(step_start[dof]), t0)
    return Prescribed(np.array([dof]), step_start[[dof]].copy(), c)


def _absolute(step: model.Step, tool: str, key: str, start: float, t0: float) -> Amplitude | None:
    """Course of a component of a tool, or of its mount, that begins a step at *start*; None where nothing moves it."""
    kinds = (step.move, step.velocity, step.crank)
    move, speed, crank = (getattr(kind.get(tool), key, None) for kind in kinds)
    if move is not None:
        return amplitude(move, start, t0, t0 + 1.0)
    if speed is not None:
        return integrated(speed, start, t0, t0 + 1.0, duration_of(step))
    return None if crank is None else cranked(crank, start, t0, t0 + 1.0)


def _mount(p: model.Problem, tool: str, key: str, number: int, ends: Ends) -> Amplitude:
    """Course in step *number* of the mount of a tool: what its steps move, held where not mentioned."""
    now = zero_amplitude()
    for k, step in enumerate(p.steps[: number + 1]):
        start, t0 = now(float(k)), float(k)
        if (by := getattr(step.by.get(tool), key, None)) is not None:
            onward = way(by, t0, t0 + 1.0)
            now = Amplitude(onward.times, start + onward.values)
        else:
            now = _absolute(step, tool, key, start, t0) or Amplitude(np.array([t0]), np.array([start]))
        now = now.joined(start, t0, t0 + 1.0, step.increments)
        if k < number:
            now = ends.cut(now, k)
    return now


def _push_before(p: model.Problem, tool: str, key: str, number: int, ends: Ends) -> float:
    """Force at the end of the previous step if the unknown was pushed there, else zero."""
    before = _push(p, tool, key, number - 1) if number else None
    if before is None:
        return 0.0
    t0 = number - 1.0
    # where a ramp begins matters if it is not gone to its end
    start = _push_before(p, tool, key, number - 1, ends) if ends.early(number - 1) else 0.0
    return amplitude(before, start, t0, t0 + 1.0)(ends.of(number - 1))


def _push(p: model.Problem, tool: str, key: str, number: int) -> float | Table | None:
    return getattr(p.steps[number].push.get(tool), force_along(p.space, key), None)


def _history(sources: list[tuple[int, float | Table | None]], number: int, ends: Ends) -> Amplitude:
    """Course in step *number* of a quantity given by successive entries (step, value); held where not mentioned."""
    now = zero_amplitude()
    for k in range(number + 1):
        t0 = float(k)
        for since, value in sources:
            if max(since, 0) == k and value is not None:
                now = amplitude(value, now(t0), t0, t0 + 1.0)
        if k < number:
            now = ends.cut(now, k)
    return now


def _loads(system: System, number: int, ends: Ends) -> dict[str, BoundaryLoad]:
    p: model.Problem = system.problem
    entries: dict[str, list[tuple[int, model.Load]]] = {}
    for k, source in [(-1, p.loads), *[(i, s.loads) for i, s in enumerate(p.steps[: number + 1])]]:
        for name, load in source.items():
            entries.setdefault(name, []).append((k, load))
    out = {}
    for name, items in entries.items():
        # a boundary has one kind of load: a traction replaces pressure and shear, and they replace a traction
        parts: dict[str, list[tuple[int, float | Table | None]]] = {
            "pressure": [(k, 0.0 if ld.traction else ld.pressure) for k, ld in items],
            "shear": [(k, 0.0 if ld.traction else ld.shear) for k, ld in items],
        }
        along: list[list[tuple[int, float | Table | None]]] = [
            [(k, ld.traction[axis] if ld.traction else 0.0) for k, ld in items] for axis in range(system.dofs.dimension)
        ]
        said = [ld.follower for _, ld in items if ld.follower is not None]
        follower = (said[-1] if said else True) and p.kinematics == "finite"
        out[name] = BoundaryLoad(
            system.boundary_edges(name), follower, **{c: _history(v, number, ends) for c, v in parts.items()},
            traction=tuple(_history(v, number, ends) for v in along),
        )  # fmt: skip
    return out


def _body_forces(p: model.Problem, number: int, ends: Ends) -> dict[str, tuple[Amplitude, ...]]:
    out = {}
    for body in p.bodies:
        entries = [(-1, p.body_force[body])] if body in p.body_force else []
        entries += [(i, s.body_force[body]) for i, s in enumerate(p.steps[: number + 1]) if body in s.body_force]
        if entries:
            axes = range(len(entries[0][1]))
            out[body] = tuple(_history([(k, b[axis]) for k, b in entries], number, ends) for axis in axes)
    return out


def _fading(p: model.Problem, number: int, ends: Ends) -> list[FrictionLaw | None]:
    """Friction of the contacts in a step; what the step before bore beyond it is released."""
    now: list[FrictionLaw | None] = _friction(p, 0)
    for k in range(1, number + 1):
        before = [
            (replace(law, held=ends.of(k - 1)) if ends.early(k - 1) else law.now) if isinstance(law, Fading) else law
            for law in now
        ]
        now = [fading(b, n, float(k), float(k + 1)) for b, n in zip(before, _friction(p, k))]
    return now


def _friction(p: model.Problem, number: int) -> list[FrictionLaw | None]:
    out = []
    for c in p.all_contacts:
        law = c.friction if c.friction is not None else p.friction
        for s in p.steps[: number + 1]:
            if c.name in s.friction:
                law = s.friction[c.name]
        out.append(law)
    return out
