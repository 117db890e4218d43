"""Schedule of a step: boundary conditions (Dirichlet), tool forces and loads (Neumann) and friction, with amplitudes in time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from prensa.friction.fading import Fading
from prensa.friction.law import FrictionLaw
from prensa.model.crank import Crank
from prensa.precision import NEGLIGIBLE
from prensa.types import Array, Index

JOINED = 0.1  # share of a step without a number of increments in which tools and supports come to tables that begin elsewhere


@dataclass(frozen=True)
class Amplitude:
    """A function of time through (times, values), held before the first and after the last time.

    ``ramp``: given by its end alone; what follows it starts from wherever it is. ``relative``: values are the way from there.
    ``corners``: times at which increments end; None: all of ``times``.
    """

    times: Array
    values: Array
    ramp: bool = False
    corners: Array | None = None
    relative: bool = False

    @property
    def stops(self) -> Array:
        """Times at which increments end: those that were given, not those of samples between them."""
        return self.times if self.corners is None else self.corners

    def __call__(self, t: float) -> float:
        """Value at time t."""
        return float(np.interp(t, self.times, self.values))

    def joined(self, start: float, t0: float, t1: float, increments: int | None) -> Amplitude:
        """The same over the step t0 … t1 from *start* on, which comes to it over the first increment."""
        missing = start - self(t0)
        if missing == 0.0:
            return self
        there = meeting(t0, t1, increments, self.stops)
        t = np.union1d(self.times, [t0, there])
        left = np.clip((there - t) / (there - t0), 0.0, 1.0)
        return Amplitude(t, np.interp(t, self.times, self.values) + missing * left, corners=np.union1d(self.stops, [there]))

    def held(self, t: float) -> Amplitude:
        """The same up to time t, and its value there ever after."""
        before = self.times < t
        return Amplitude(np.append(self.times[before], t), np.append(self.values[before], self(t)))


@dataclass(frozen=True)
class Cranked(Amplitude):
    """The way of a crank from where it begins, between its times: exact at all times, with an increment's end at dead centre."""

    crank: Crank | None = None
    start: float = 0.0
    begins: float = 0.0

    def __call__(self, t: float) -> float:
        """Value at time t."""
        assert self.crank is not None
        until = float(np.clip(t, self.times[0], self.times[-1]))
        return self.start + self.crank.way(until - self.begins)

    def held(self, t: float) -> Amplitude:
        """The same up to time t, and its value there ever after."""
        return replace(self, times=np.array([self.times[0], t]))


def cranked(crank: Crank, start: float, t0: float, t1: float) -> Amplitude:
    """Course of a tool that a crank drives over the step t0 … t1."""
    centre = crank.dead_centre
    corners = np.array([] if centre is None else [t0 + centre * (t1 - t0)])
    times = np.array([t0, t1])
    return Cranked(times, start + np.array([0.0, crank.way(1.0)]), corners=corners, crank=crank, start=start, begins=t0)


Table = tuple[tuple[float, float], ...]
"""Pairs (global time, value)."""


def tabulated(table: Table) -> Amplitude:
    """Course of a table of (global time, value)."""
    return Amplitude(*np.array(table, dtype=np.float64).T)


def amplitude(value: float | Table, start: float, t0: float, t1: float) -> Amplitude:
    """Course of a number (ramp from start over the step t0 … t1) or a table (global time)."""
    if isinstance(value, tuple):
        return tabulated(value)
    return Amplitude(np.array([t0, t1]), np.array([start, float(value)]), ramp=True)


def way(value: float | Table, t0: float, t1: float) -> Amplitude:
    """Course of the way from wherever a thing is at t0: a number (ramp over the step t0 … t1) or a table (global time)."""
    c = amplitude(value, 0.0, t0, t1)
    return Amplitude(c.times, c.values, relative=True)


def integrated(value: float | Table, start: float, t0: float, t1: float, seconds: float = 1.0) -> Amplitude:
    """Displacement course of a velocity per second, over a step of so many *seconds*.

    Constant over the step, or a table of (time, velocity) integrated exactly.
    """
    if not isinstance(value, tuple):
        return Amplitude(np.array([t0, t1]), np.array([start, start + float(value) * (t1 - t0) * seconds]))
    tv, v = np.array(value, dtype=np.float64).T
    # the integral of a piecewise linear velocity is quadratic: sample it finely between its own points
    given = tv[(tv > t0) & (tv < t1)]
    t = np.unique(np.concatenate([np.linspace(t0, t1, 513), given]))
    rate = np.interp(t, tv, v)
    covered = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
    return Amplitude(t, start + covered * seconds, corners=given)


@dataclass
class Prescribed:
    """Boundary condition: dofs that follow one course, a ramp or a relative one each from its own start.

    What lies elsewhere when a table begins comes to it over the first increment: a jump is as long in any increment.
    ``support``: name of the boundary and axis, 'x' or 'y', that it holds; None for tools and the axis of revolution.
    ``found``: it was found for a released body, see `system/minimal_supports.py`.
    """

    dofs: Index
    start: Array
    amplitude: Amplitude | None = None
    support: tuple[str, str] | None = None
    found: bool = False

    def at(self, t: float, t0: float, there: float) -> Array:
        """Values (k,) of a table at time t; ``there``: time at which what lay elsewhere has come to it."""
        assert self.amplitude is not None
        way = self.start + self.amplitude(t) if self.amplitude.relative else np.full(len(self.dofs), self.amplitude(t))
        return way if t >= there else way + (there - t) / (there - t0) * self.missing(t0)

    def missing(self, t0: float) -> Array:
        """Way (k,) from where a table begins at t0 to where the unknowns are then; zero of what begins wherever they are."""
        if self.amplitude is None or self.amplitude.ramp:
            return np.zeros(len(self.dofs))
        return np.full(len(self.dofs), -self.amplitude(t0)) if self.amplitude.relative else self.start - self.amplitude(t0)


@dataclass(frozen=True)
class BoundaryLoad:
    """A load's parts: courses of pressure, shear and each component of a traction; and whether it follows the surface."""

    edges: Index
    follower: bool
    pressure: Amplitude
    shear: Amplitude
    traction: tuple[Amplitude, ...]

    @property
    def courses(self) -> dict[str, Amplitude]:
        """All of them by name: ``pressure``, ``shear``, ``tx``, ``ty`` and in space ``tz``."""
        along = {f"t{axis}": course for axis, course in zip("xyz", self.traction)}
        return {"pressure": self.pressure, "shear": self.shear, **along}


@dataclass(frozen=True)
class Control:
    """Displacement control: the ``lead``, a tool's dof, is prescribed, and its equation is that of the dof ``factor``.

    All that the step changes of its loads is multiplied by what the factor has grown by since its ``start``.
    """

    control_dof: int
    factor: int
    start: float


@dataclass
class StepPlan:
    """Everything prescribed in one step; ``t0``, ``t1`` its times.

    ``fixed`` (k,) prescribed dofs in increasing order; ``push`` tool degrees of freedom with force courses; ``springs`` tool
    degrees of freedom that hang on a spring, with its stiffness and the course of its mount; ``released`` what supports held
    in the step before and nothing prescribes now; ``control`` where one of the pushed ones leads; ``seconds`` that it lasts.
    """

    name: str
    number: int
    t0: float
    t1: float
    groups: list[Prescribed]
    push: dict[int, Amplitude]
    loads: dict[str, BoundaryLoad]
    body_force: dict[str, tuple[Amplitude, ...]]
    friction: list[FrictionLaw | None]
    increments: int | None
    springs: dict[int, tuple[float, Amplitude]] = field(default_factory=dict)
    released: list[Prescribed] = field(default_factory=list)
    control: Control | None = None
    seconds: float = 1.0
    fixed: Index = field(init=False)

    def __post_init__(self) -> None:
        stops = [g.amplitude.stops for g in self.groups if g.amplitude is not None and not g.amplitude.ramp]
        self._there = meeting(self.t0, self.t1, self.increments, np.concatenate([np.zeros(0), *stops]))
        dofs = np.concatenate([g.dofs for g in self.groups]) if self.groups else np.zeros(0, dtype=np.int64)
        self._order = np.argsort(dofs, kind="stable")
        self.fixed = dofs[self._order]
        # Held and ramped ones, as on a border of which each node has its own way, are found all at once.
        self._begin = np.concatenate([np.zeros(0), *(g.start for g in self.groups)])
        self._ramped, self._target = np.zeros(len(dofs), dtype=bool), self._begin.copy()
        self._others: list[tuple[slice, Prescribed]] = []
        ends = np.cumsum([0, *(len(g.dofs) for g in self.groups)]).tolist()
        for g, a, b in zip(self.groups, ends, ends[1:]):
            if g.amplitude is not None and g.amplitude.ramp:
                self._ramped[a:b], self._target[a:b] = True, g.amplitude.values[1]
            elif g.amplitude is not None:
                self._others.append((slice(a, b), g))

    def values(self, t: float) -> Array:
        """Values (k,) of the prescribed degrees of freedom at time t, in the order of ``fixed``."""
        s = min(max((t - self.t0) / (self.t1 - self.t0), 0.0), 1.0)
        # a ramp brings every unknown from where it is to the target
        out = np.where(self._ramped, (1.0 - s) * self._begin + s * self._target, self._begin)
        for own, g in self._others:
            out[own] = g.at(t, self.t0, self._there)
        return out[self._order]

    @property
    def held(self) -> Index:
        """Prescribed degrees of freedom with a reaction: all of ``fixed`` but the lead, whose force is given."""
        return self.fixed if self.control is None else self.fixed[self.fixed != self.control.control_dof]

    def left(self, t: float) -> float:
        """Share (1 … 0) that is left at time t of what the step releases."""
        return min(max((self.t1 - t) / (self.t1 - self.t0), 0.0), 1.0)

    def friction_at(self, t: float) -> list[FrictionLaw | None]:
        """Friction of the contacts at time t: what the step releases of the one before has gone at its end."""
        return [d.now if isinstance(d, Fading) and t >= self.t1 else d for d in self.friction]

    @property
    def moved(self) -> Index:
        """Unknowns whose motion is given: prescribed ones, then those on springs, whose mounts move."""
        return np.concatenate([self.fixed, np.array(list(self.springs), dtype=np.int64)])

    def motion(self, t: float) -> Array:
        """Values of the degrees of freedom ``moved`` at time t; of a spring that of its mount."""
        return np.concatenate([self.values(t), [mount(t) for _, mount in self.springs.values()]])

    def given(self, t: float) -> Array:
        """Values of all that is given at time t: motions, tool forces, loads, body forces."""
        amplitudes = [*self.push.values()]
        amplitudes += [c for load in self.loads.values() for c in load.courses.values()]
        amplitudes += [c for pair in self.body_force.values() for c in pair]
        return np.append(self.motion(t), [c(t) for c in amplitudes])

    def reverses(self, last: float, now: float, end: float) -> bool:
        """Whether anything given goes back, stops, or goes less than half as fast from *now* to *end* as from *last* on."""
        a, b, c = self.given(last), self.given(now), self.given(end)
        before, after = (b - a) / (now - last), (c - b) / (end - now)
        moved = np.abs(b - a) > NEGLIGIBLE * (np.abs(a) + np.abs(b))
        return bool((moved & (after * before < 0.5 * before**2)).any())

    def corners(self) -> Array:
        """Times inside the step at which a table has a corner: increments end there."""
        return self._corners

    @cached_property
    def _corners(self) -> Array:
        times = [g.amplitude.stops for g in self.groups if g.amplitude is not None]
        times += [c.stops for c in self.push.values()]
        times += [c.stops for _, c in self.springs.values()]
        for load in self.loads.values():
            times += [c.times for c in load.courses.values()]
        times += [c.times for pair in self.body_force.values() for c in pair]
        times += [np.array([self._there])] * any(g.missing(self.t0).any() for g in self.groups)
        t = np.unique(np.concatenate(times)) if times else np.zeros(0)
        return t[(t > self.t0 + 1e-9) & (t < self.t1 - 1e-9)]


def meeting(t0: float, t1: float, increments: int | None, stops: Array) -> float:
    """Time at which what lies elsewhere when a table begins, with the step t0 … t1, has come to it: after the first increment.

    Of a step without a number of increments that is the first `JOINED` of it; ``stops``: times at which increments end anyway.
    """
    first = t0 + (t1 - t0) * (JOINED if increments is None else 1.0 / increments)
    return float(min([first, *stops[stops > t0 + 1e-9 * (t1 - t0)]]))


def zero_amplitude() -> Amplitude:
    """Zero at all times."""
    return Amplitude(np.zeros(1), np.zeros(1))
