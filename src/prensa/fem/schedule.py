"""What happens when: prescribed displacements, tool forces, loads and friction of a step as functions of time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.model import problem as model

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Course:
    """A function of time through (times, values), held before the first and after the last time.

    ``ramp``: given by its end alone; what follows it starts from wherever it is.
    """

    times: Array
    values: Array
    ramp: bool = False

    def __call__(self, t: float) -> float:
        """Value at time t."""
        return float(np.interp(t, self.times, self.values))


def course(value: Any, start: float, t0: float, t1: float) -> Course:
    """Course of a number (ramp from start over the step t0 … t1) or a table (global time)."""
    if isinstance(value, tuple):
        return Course(*np.array(value, dtype=np.float64).T)
    return Course(np.array([t0, t1]), np.array([start, float(value)]), ramp=True)


def integrated(value: Any, start: float, t0: float, t1: float) -> Course:
    """Displacement course of a velocity: constant over the step, or a table of (time, velocity) integrated exactly."""
    if not isinstance(value, tuple):
        return Course(np.array([t0, t1]), np.array([start, start + float(value) * (t1 - t0)]))
    tv, v = np.array(value, dtype=np.float64).T
    # the integral of a piecewise linear velocity is quadratic: sample it finely between its own points
    t = np.unique(np.concatenate([np.linspace(t0, t1, 513), tv[(tv > t0) & (tv < t1)]]))
    rate = np.interp(t, tv, v)
    return Course(t, start + np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))]))


@dataclass
class Prescribed:
    """Group of unknowns that follow one course, each from its own start: value = start + share · (course − origin).

    ``support``: name of the boundary and axis, 'x' or 'y', that it holds; None for tools and the axis of revolution.
    """

    dofs: Index
    start: Array
    course: Course | None = None
    support: tuple[str, str] | None = None

    def at(self, t: float, t0: float, t1: float) -> Array:
        """Values (k,) at time t."""
        if self.course is None:
            return self.start
        if self.course.ramp:
            # a ramp brings every unknown from where it is to the target
            s = min(max((t - t0) / (t1 - t0), 0.0), 1.0)
            return (1.0 - s) * self.start + s * self.course.values[1]
        return np.full(len(self.dofs), self.course(t))


@dataclass(frozen=True)
class BoundaryLoad:
    """A load's parts: courses of pressure, shear, tx, ty; and whether it follows the surface."""

    edges: Index
    follower: bool
    pressure: Course
    shear: Course
    tx: Course
    ty: Course


@dataclass
class StepPlan:
    """Everything prescribed in one step; ``t0``, ``t1`` its times.

    ``fixed`` (k,) prescribed unknowns in increasing order; ``push`` tool unknowns with force courses; ``springs`` tool
    unknowns that hang on a spring, with its stiffness and the course of its mount.
    """

    name: str
    number: int
    t0: float
    t1: float
    groups: list[Prescribed]
    push: dict[int, Course]
    loads: dict[str, BoundaryLoad]
    body_force: dict[str, tuple[Course, Course]]
    friction: list[Any]
    increments: int | None
    springs: dict[int, tuple[float, Course]] = field(default_factory=dict)
    fixed: Index = field(init=False)

    def __post_init__(self) -> None:
        dofs = np.concatenate([g.dofs for g in self.groups]) if self.groups else np.zeros(0, dtype=np.int64)
        self._order = np.argsort(dofs, kind="stable")
        self.fixed = dofs[self._order]

    def values(self, t: float) -> Array:
        """Values (k,) of the prescribed unknowns at time t, in the order of ``fixed``."""
        if not self.groups:
            return np.zeros(0)
        return np.concatenate([g.at(t, self.t0, self.t1) for g in self.groups])[self._order]

    @property
    def moved(self) -> Index:
        """Unknowns whose motion is given: prescribed ones, then those on springs, whose mounts move."""
        return np.concatenate([self.fixed, np.array(list(self.springs), dtype=np.int64)])

    def motion(self, t: float) -> Array:
        """Values of the unknowns ``moved`` at time t; of a spring that of its mount."""
        return np.concatenate([self.values(t), [mount(t) for _, mount in self.springs.values()]])

    def corners(self) -> Array:
        """Times inside the step at which a table has a corner: increments end there."""
        times = [g.course.times for g in self.groups if g.course is not None and len(g.course.times) < 500]
        times += [c.times for c in self.push.values()]
        times += [c.times for _, c in self.springs.values() if len(c.times) < 500]
        for load in self.loads.values():
            times += [c.times for c in (load.pressure, load.shear, load.tx, load.ty)]
        times += [c.times for pair in self.body_force.values() for c in pair]
        t = np.unique(np.concatenate(times)) if times else np.zeros(0)
        return t[(t > self.t0 + 1e-9) & (t < self.t1 - 1e-9)]


def _zero() -> Course:
    return Course(np.zeros(1), np.zeros(1))


def plan_step(system: Any, number: int, anchor: Array) -> StepPlan:
    """Plan of step *number* (from 0) with the unknowns' values ``anchor`` (ndof,) at its start.

    Raises
    ------
    ValueError
        If an unknown is prescribed twice with different values.

    """
    p: model.Problem = system.problem
    t0, t1 = float(number), float(number + 1)
    # supports: the problem's, then each step's up to this one; a later entry replaces an earlier one of the boundary
    supports: dict[tuple[str, str], tuple[Any, int]] = {}
    for k, source in [(-1, p.fixed), *[(i, s.fixed) for i, s in enumerate(p.steps[: number + 1])]]:
        for name, f in source.items():
            if f.free:
                supports.pop((name, "x"), None)
                supports.pop((name, "y"), None)
            for c in ("x", "y"):
                if getattr(f, c) is not None:
                    supports[(name, c)] = (getattr(f, c), max(k, 0))
    groups: list[Prescribed] = []
    taken = np.zeros(system.ndof, dtype=bool)

    def add(dofs: Index, c: Course | None, support: tuple[str, str] | None = None) -> None:
        dofs = system.owners(dofs)
        dofs = dofs[~taken[dofs]]
        taken[dofs] = True
        if len(dofs):
            groups.append(Prescribed(dofs, anchor[dofs].copy(), c, support))

    for (name, axis), (value, since) in supports.items():
        dofs = 2 * system.boundary_nodes(name) + "xy".index(axis)
        held = value == "held" or (since < number and not isinstance(value, tuple))
        add(dofs, None if held else course(value, 0.0, t0, t1), (name, axis))
    add(2 * system.axis_nodes, None)
    step = p.steps[number]
    push: dict[int, Course] = {}
    springs: dict[int, tuple[float, Course]] = {}
    for t, name in enumerate(p.tools):
        for k, key in enumerate(("x", "y", "rz")):
            dof = system.tool_dof(t) + k
            move = getattr(step.move.get(name), key, None)
            speed = getattr(step.velocity.get(name), key, None)
            force = getattr(step.push.get(name), "m" if key == "rz" else key, None)
            stiffness = getattr(p.tools[name].spring, key, None)
            if stiffness is not None:
                springs[dof] = stiffness, _mount(p, name, key, number)
            elif force is not None:
                start = _push_before(p, name, key, number)
                push[dof] = course(force, start, t0, t1)
            elif speed is not None:
                groups.append(Prescribed(np.array([dof]), anchor[[dof]].copy(), integrated(speed, anchor[dof], t0, t1)))
            else:
                groups.append(
                    Prescribed(
                        np.array([dof]),
                        anchor[[dof]].copy(),
                        None if move is None else course(move, anchor[dof], t0, t1),
                    )
                )
    return StepPlan(
        step.name, number, t0, t1, groups, push, _loads(system, number), _body_forces(p, number), _friction(p, number),
        step.increments, springs,
    )  # fmt: skip


def _mount(p: model.Problem, tool: str, key: str, number: int) -> Course:
    """Course in step *number* of the mount of a tool: what its steps move, held where not mentioned."""
    now = _zero()
    for k, step in enumerate(p.steps[: number + 1]):
        move, speed = (getattr(kind.get(tool), key, None) for kind in (step.move, step.velocity))
        start, t0 = now(float(k)), float(k)
        if move is not None:
            now = course(move, start, t0, t0 + 1.0)
        elif speed is not None:
            now = integrated(speed, start, t0, t0 + 1.0)
        else:
            now = Course(np.array([t0]), np.array([start]))
    return now


def _push_before(p: model.Problem, tool: str, key: str, number: int) -> float:
    """Force at the end of the previous step if the unknown was pushed there, else zero."""
    if number == 0:
        return 0.0
    before = getattr(p.steps[number - 1].push.get(tool), "m" if key == "rz" else key, None)
    if before is None:
        return 0.0
    return course(before, 0.0, number - 1.0, float(number))(float(number))


def _history(sources: list[tuple[int, Any]], number: int) -> Course:
    """Course in step *number* of a quantity given by successive entries (step, value); held where not mentioned."""
    now = _zero()
    for k, value in sources:
        t0 = float(max(k, 0))
        if value is not None:
            now = course(value, now(t0), t0, t0 + 1.0)
    return now


def _loads(system: Any, number: int) -> dict[str, BoundaryLoad]:
    p: model.Problem = system.problem
    entries: dict[str, list[tuple[int, model.Load]]] = {}
    for k, source in [(-1, p.loads), *[(i, s.loads) for i, s in enumerate(p.steps[: number + 1])]]:
        for name, load in source.items():
            entries.setdefault(name, []).append((k, load))
    out = {}
    for name, items in entries.items():
        parts = {
            "pressure": [(k, ld.pressure) for k, ld in items],
            "shear": [(k, ld.shear) for k, ld in items],
            "tx": [(k, ld.traction[0] if ld.traction else None) for k, ld in items],
            "ty": [(k, ld.traction[1] if ld.traction else None) for k, ld in items],
        }
        follower = items[-1][1].follower and p.kinematics == "finite"
        out[name] = BoundaryLoad(
            system.boundary_edges(name), follower, **{c: _history(v, number) for c, v in parts.items()}
        )
    return out


def _body_forces(p: model.Problem, number: int) -> dict[str, tuple[Course, Course]]:
    out = {}
    for body in p.bodies:
        entries: list[tuple[int, Any]] = [(-1, p.body_force[body])] if body in p.body_force else []
        entries += [(i, s.body_force[body]) for i, s in enumerate(p.steps[: number + 1]) if body in s.body_force]
        if entries:
            out[body] = (
                _history([(k, b[0]) for k, b in entries], number),
                _history([(k, b[1]) for k, b in entries], number),
            )
    return out


def _friction(p: model.Problem, number: int) -> list[Any]:
    out = []
    for c in p.contacts:
        law = c.friction if c.friction is not None else p.friction
        for s in p.steps[: number + 1]:
            if c.name in s.friction:
                law = s.friction[c.name]
        out.append(law)
    return out
