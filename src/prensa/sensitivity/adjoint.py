"""Gradients of a few measures by many parameters: one run, and the same increments once more backwards (the adjoint method)."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from prensa.analysis import check_arguments, report_preflight
from prensa.checks.check import Solved
from prensa.errors import ArgumentError, take
from prensa.friction.point import values_of
from prensa.geometry.plane import cross
from prensa.linear.factorisations import KeptFactors
from prensa.linear.threads import ONE_OF_BLAS
from prensa.measures import parse
from prensa.measures.measure import Gradient, Measure
from prensa.model import problem as model
from prensa.model.not_in_space import words_of
from prensa.policy import Policy
from prensa.result.increment import Increment, Monitor
from prensa.result.results import increment_of
from prensa.sensitivity.change import Change, change_of, known
from prensa.sensitivity.closed import covers
from prensa.sensitivity.direct import alike
from prensa.sensitivity.landing import Landing, coordinates, landing_of
from prensa.sensitivity.parameters import Parameter, refuse_other_mesh
from prensa.sensitivity.solve import Followed, check_paths, refuse
from prensa.sensitivity.transposed import Adjoints, Converged, Stage, Touching, Weights, back
from prensa.solver.reporting import Messages
from prensa.solver.step_control import StepControl
from prensa.system.discretise import discretise
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.planning import plan_step
from prensa.system.state import State
from prensa.system.symmetry_planes import guard_of
from prensa.system.system import System
from prensa.timer import Timer
from prensa.types import Array


@dataclass(frozen=True)
class Slopes:
    """Measures of an increment and their derivatives by parameters.

    ``measures`` (m,) as they were asked for, with their ``units`` and ``values`` (m,); ``slopes`` (m, p): by the ``parameters``
    (p,), per unit of each; ``increment``: the one that they are of. ``slopes["friction.mu"]`` is the column of a parameter, a
    number where one measure was asked for by its name.
    """

    measures: tuple[str, ...]
    units: tuple[str, ...]
    parameters: tuple[str, ...]
    values: Array
    slopes: Array
    increment: Increment = field(repr=False, compare=False)
    single: bool = False

    @property
    def value(self) -> Any:
        """The value of the measure, or of all where a list of them was asked for."""
        return float(self.values[0]) if self.single else self.values

    def __getitem__(self, path: str) -> Any:
        """Derivative by a parameter."""
        if path not in self.parameters:
            raise KeyError(path)
        column = self.slopes[:, self.parameters.index(path)]
        return float(column[0]) if self.single else column

    def items(self) -> Iterator[tuple[str, Any]]:
        """Parameters and the derivatives by them."""
        return ((path, self[path]) for path in self.parameters)


class OnlyForwards(ArgumentError):
    """What cannot be followed backwards, but forwards."""


def gradient(
    problem: model.Problem,
    of: str | Sequence[str],
    by: Sequence[str],
    numerics: model.Numerics | None = None,
    step: str | None = None,
    times: Sequence[float] | None = None,
    monitor: Monitor | None = None,
    timer: Timer | None = None,
    policy: Policy | None = None,
) -> Slopes:
    """Derivatives of measures at the end of a run, or of a step, by any number of parameters.

    The run is solved once and gone through once more backwards, which takes less than half of the time of the run whatever the
    number of parameters. `solve` with ``derivatives`` gives derivatives in all increments instead, at a cost for each parameter.

    Parameters
    ----------
    problem, numerics, times, monitor, timer, policy
        As of `solve`.
    of
        A measure, such as ``punch.force.y`` or a name of the case, or a list of them: places and forces, which have a derivative.
    by
        Paths of parameters, as ``--set`` writes them: ``tools.die.points.3.1``.
    step
        Name of the step at whose end measures are taken, and the run ends; the last one if not given.

    Raises
    ------
    PrensaError
        For what `solve` with derivatives refuses, a measure without a derivative, and what only differences can follow:
        elements with enhanced modes, friction that is not stated for a point, springs, loads on boundaries.

    """
    by = [by] if isinstance(by, str) else by
    check_paths("gradient", "by", by)
    if not by:
        raise ArgumentError("gradient: by is empty; give a list of paths, for example ['tools.die.points.3.1']")
    take("gradient", "of", of, (str, Sequence), "give the name of a measure, such as 'punch.force.y', or a list of them")
    take("gradient", "step", step, (str, type(None)), "give the name of a step or None")
    take("gradient", "problem", problem, model.Problem, "give a Problem (case.problem of a case)")
    check_arguments(problem, numerics, None, monitor, timer, policy)
    names = (of,) if isinstance(of, str) else tuple(of)
    measures = _measures(names, problem)
    last, system, policy, timer = number_of(problem, step), discretise(problem), policy or Policy(), timer or Timer()
    _refuse(system, by)
    run = Recorded(system, numerics or model.Numerics(), policy, Messages(system, monitor), timer)
    run.prescribe(system.initial(), times)
    with timer("parameters"):
        parameters = [_Parameter.of(system, path, policy) for path in by]
    increment = run.until(last)
    c = run.kept[-1].c
    with timer("backwards"):
        slopes = [_slope(m, increment) for m in measures]
        start, adjoints, landings = _backwards(system, run, slopes, any(p.bends for p in parameters))
    with timer("parameters"):
        seen = _Seen(measures, slopes, run, c, increment)
        columns = np.stack([p.derivative(start, adjoints, landings, seen) for p in parameters], axis=1)
    values, units = np.array([m.value(increment) for m in measures]), tuple(m.unit for m in measures)
    return Slopes(names, units, tuple(by), values, columns, increment, isinstance(of, str))


def _refuse(system: System, by: Sequence[str]) -> None:
    """Refuse what has no derivative or none backwards, and what any run refuses before it begins."""
    refuse(system, None, by)
    if system.dofs.dimension == 3:
        raise OnlyForwards(f"gradient: {words_of('adjoint')}")
    if not known(system):
        raise OnlyForwards(
            "gradient: only plane elements that have no enhanced modes in finite strain, elastic or J2, and contacts on "
            "current geometry, by penalty or exact and with rounded tools, are covered by the adjoint; use "
            "solve(derivatives=...)"
        )
    report_preflight(system)


def _measures(names: Sequence[object], problem: model.Problem) -> list[Measure]:
    if not names:
        raise ArgumentError("gradient: of is empty; give the name of a measure, such as 'punch.force.y', or a list of them")
    return [_measure(name, problem) for name in names]


def _measure(name: object, problem: model.Problem) -> Measure:
    take("gradient", "of", name, str, "give the name of a measure, such as 'punch.force.y', or a list of them")
    assert isinstance(name, str)
    return parse(name, problem)


def number_of(problem: model.Problem, step: str | None) -> int:
    """Number of a step, of the last one for None; raises `ArgumentError`."""
    names = [s.name for s in problem.steps]
    if step is None:
        return len(names) - 1
    if step not in names:
        raise ArgumentError(f"gradient: there is no step {step!r}; the steps are {', '.join(names)}")
    return names.index(step)


def _slope(measure: Measure, increment: Increment) -> Gradient:
    slope = measure.gradient(increment)
    if slope is None:
        raise OnlyForwards(
            f"gradient: {measure.name!r} has no derivative with respect to positions and forces, from which the adjoint "
            "starts; use solve(derivatives=...), which takes differences of it, or a measure of a place or a tool's force"
        )
    return slope


class Recorded(Followed):
    """A run that keeps its increments for the way back."""

    def __init__(
        self, system: System, numerics: model.Numerics, policy: Policy, messages: Messages, timer: Timer
    ) -> None:
        super().__init__(system, numerics, policy, messages, timer)
        # Not recomputed from checkpoints: 133 increments of 64 × 48 elements take 0.1 GB.
        self.kept: list[Converged] = []
        self.state: State | None = None
        self.mirrors = guard_of(system)
        self.room, self.room_for_factors = policy.matrix_bytes, policy.factor_bytes

    @property
    def wants_matrices(self) -> bool:
        """See `Followed`."""
        return self.room > 0

    def look_inside(self, given: Solved) -> None:
        """As `TimeStepping.look_inside`; raises `OnlyForwards` too where a free side comes to a line of symmetry."""
        super().look_inside(given)
        c = given.context
        for close in self.mirrors.near(given.result.u) if self.mirrors is not None else ():
            raise OnlyForwards(
                f"gradient: step {c.plan.name!r}, time {c.time:.6g}: a free side reaches the {close.mirror.kind} {close.mirror} "
                f"near {close.where}, where a plane would be added from here on, which the adjoint does not cover; use "
                "solve(derivatives=...), or describe it: a smooth plane among the tools, and a contact of the whole body with "
                "it"
            )

    def until(self, step: int) -> Increment:
        """The last increment of a step (from 0), at which the run stops."""
        for increment in self.run(self.system.initial()):
            if increment.end_of_step and self.kept[-1].c.plan.number == step:
                return increment
        raise AssertionError("a run goes to the end of all steps, or raises")

    def commit(
        self, c: Context, control: StepControl, result: NewtonResult, spent: int, cutbacks: int
    ) -> tuple[State, Increment]:
        """As `TimeStepping.commit`."""
        if not covers(c):
            raise OnlyForwards(
                f"gradient: step {c.plan.name!r} has loads, springs, friction or released forces that the adjoint does not "
                "cover; it covers motions of tools, forces on them and friction that is stated for a point; use "
                "solve(derivatives=...)"
            )
        if c.through_air is not None and c.through_air[self.system.dofs.displacement.slice].any():
            raise OnlyForwards(
                f"gradient: step {c.plan.name!r}, time {c.time:.6g}: bodies move through air until something stops them, "
                "which the adjoint does not cover; use solve(derivatives=...)"
            )
        self.state, increment = super().commit(c, control, result, spent, cutbacks)
        assert self.reduced is not None
        assert result.evaluation is not None
        e = result.evaluation
        # Derivatives need the exact tangent; the paper's friction iteration leaves the pressure's part of it out.
        at = Converged(replace(c, picard_friction=False), result.u, self.system.active_sets(c, e), self.reduced,
            factors=self._factors())
        if e.data is not None and not c.picard_friction and self.room >= e.data.nbytes:
            self.room -= e.data.nbytes
            at = at._replace(evaluation=e)
        self.kept.append(at)
        return self.state, increment

    def _factors(self) -> KeptFactors | None:
        """Newton's last factors, of large ones only some; none where there is no room for more of them."""
        assert self.reduced is not None
        found, last = self.reduced.factorisation.kept(), self.kept[-1].factors if self.kept else None
        if found is None or (last is not None and found.factors is last.factors):
            return found
        recent = [at.factors for at in self.kept[len(self.kept) - self.policy.factor_interval + 1 :]]
        # All of them would take fresh memory that costs as much time as new factors do (0.5 to 0.7 ms a MB).
        beside = found.size > self.policy.factor_bytes_per_increment and any(f is not None for f in recent)
        if beside or found.size > self.room_for_factors:
            return None
        self.room_for_factors -= found.size
        return found


def _backwards(
    system: System, run: Recorded, slopes: Sequence[Gradient], tables: bool
) -> tuple[Weights, Adjoints, list[Landing]]:
    """Adjoints of the state in which the run began and of the system, its tables if asked, from measures with these slopes."""
    m = len(slopes)
    weights, adjoints, landings = Weights.none(system, m), Adjoints(system, m, tables), list[Landing]()
    for k, slope in enumerate(slopes):
        np.add.at(weights.u[k], *slope.displacements(system))
        np.add.at(weights.force[k], *slope.reactions(system))
    while run.kept:  # what was kept of an increment goes with it
        at = run.kept.pop()
        with ONE_OF_BLAS:
            weights = back(system, at, weights, adjoints, run.kept)
        if at.c.through_air is not None:
            landings.append(landing_of(system, at.c, weights))
    return weights, adjoints, landings


class _Seen(NamedTuple):
    """Measures of an increment at whose end a run stood, as they see the initial places too."""

    measures: Sequence[Measure]
    slopes: Sequence[Gradient]
    run: Recorded
    c: Context
    increment: Increment

    def values(self, system: System) -> Array:
        """The measures of places (m,) where the bodies began as those of a system beside and moved alike; 0 for others."""
        state, c = self.run.state, self.c
        assert state is not None
        e = system.evaluate(c, state.u, state.lam, stiffness=False)._replace(history=state.history)
        result = NewtonResult(True, None, state.u, None, state.lam, 0)
        beside = increment_of(system, state, c.plan, e, result, 0, 0, self.increment.end_of_step, c.state, parse=parse)
        return np.array([m.value(beside) if slope.nodes else 0.0 for m, slope in zip(self.measures, self.slopes)])


@dataclass(frozen=True)
class _Parameter:
    """A parameter: the systems a ``step`` above and below it, and what it changes of their arrays.

    ``policy.derivative_residual_share``: lengths over element depths by which changes of a parameter's size may move
    what stands still (`Still`).
    """

    path: str
    size: float
    step: float
    systems: tuple[System, System]
    change: Change | None
    shape: bool
    """Whether it is of a tool alone, and changes nothing but this one's shape and place."""
    policy: Policy

    @classmethod
    def of(cls, system: System, path: str, policy: Policy) -> _Parameter:
        """The parameter at a path."""
        parameter = Parameter.of(system.problem, path, system.length)
        step = policy.parameter_step_ratio * parameter.size
        shape = path.startswith("tools.")
        systems = parameter.tools_beside(system, step) if shape else parameter.neighbours(system, step)
        for other in systems:
            refuse_other_mesh(system, other, path)
        # A tool's shape goes its own way, through the points that touched it (`_of_shape`): `change_of` knows of no shapes.
        above, below = (_with_shapes(s, system) for s in systems)
        change = None if shape else change_of(above, below, step)
        if not shape and change is None:
            raise OnlyForwards(f"gradient: what {path} changes is not covered by the adjoint; use solve(derivatives=...)")
        return cls(path, parameter.size, step, systems, change, shape, policy)

    @property
    def bends(self) -> bool:
        """Whether it changes a table."""
        return self.change is not None and any(law.knots.any() or law.coefficients.any() for law in self.change.law)

    def difference(self, above: Any, below: Any) -> Array:
        """Derivative of what differs between both sides."""
        return np.asarray((np.asarray(above) - below) / (2.0 * self.step))

    def between(self, value: Callable[[System], Any]) -> Array:
        """Derivative of a number of the system."""
        return self.difference(*map(value, self.systems))

    def derivative(self, start: Weights, adjoints: Adjoints, landings: Sequence[Landing], seen: _Seen) -> Array:
        """Derivatives (m,) of the measures."""
        out = np.einsum("mta,ta->m", adjoints.at, self.between(lambda s: np.array([t.at for t in s.tools]).reshape(-1, 2)))
        for t, touching in enumerate(adjoints.touching):
            a, b = (s.tools[t] for s in self.systems)
            # By content: shapes hold arrays, which have no equality of their own.
            if touching and pickle.dumps(a.shape) != pickle.dumps(b.shape):
                out = out + self._of_shape(t, touching)
        out = out + self._of_start(start)
        for landing in landings:
            out = out + self._of_landing(landing, adjoints.stage(landing.c))
        if self.change is None:
            return out
        out = out + self._of_arrays(self.change, adjoints)
        for number, stage in adjoints.stages.items():
            out = out + self._of_step(number, stage)
        if self.change.X is not None:
            out = out + self.difference(*map(seen.values, self.systems))
        return out

    def _of_arrays(self, change: Change, adjoints: Adjoints) -> Array:
        """Through the bodies' places, moduli, flow curves and penalties."""
        out = adjoints.modulus @ change.modulus
        if change.X is not None:
            out = out + np.einsum("mna,na->m", adjoints.X, change.X)
        for law, by in zip(change.law, adjoints.law):
            out = out + by.p @ law.p + by.knots @ law.knots + np.einsum("mki,ki->m", by.coefficients, law.coefficients)
        for scale, w in zip(change.scale, adjoints.scale):
            out = out + np.einsum("mik,ik->m", w, scale)
        return out

    def _of_shape(self, t: int, touching: Sequence[Touching]) -> Array:
        """Through gaps, normals and coordinates of the points that touched a tool, where the tool now is another one."""
        x = np.concatenate([p.x for p in touching])
        g, turn, s = (np.concatenate([getattr(p, k) for p in touching], axis=1) for k in ("g", "turn", "s"))
        a, b = (system.tools[t].shape for system in self.systems)
        above, below = a.closest(x), b.closest(x)
        rate = self.difference(above.s, below.s)
        if np.isfinite(a.period):
            period = self.difference(a.period, b.period)
            round_ = 0.5 * (a.period + b.period)
            # Both sides may see a point on different sides of the cut of a closed surface: a whole turn is no change.
            jump = np.round((np.asarray(above.s) - below.s) / round_)
            rate = self.difference(above.s - jump * round_, below.s)
            rate = rate + np.concatenate([p.rounds for p in touching]) * period
        n, dn = above.n, self.difference(above.n, below.n)
        return np.asarray(g @ self.difference(above.g, below.g) + turn @ cross(n, dn) + s @ rate)

    def _of_landing(self, landing: Landing, stage: Stage) -> Array:
        """Through where points that a tool comes to through air begin to slip."""
        c, policy = landing.c, self.policy
        plans = (plan_step(s, c.plan.number, stage.step_start, stage.ends) for s in self.systems)
        above, below = (coordinates(s, plan, c, policy) for s, plan in zip(self.systems, plans))
        found = [w @ self.difference(a, b)[:, 0] for w, a, b in zip(landing.weights, above, below)]
        return np.asarray(np.sum(found, axis=0))

    def _of_start(self, start: Weights) -> Array:
        """Through the state in which the run began."""
        above, below = (s.initial() for s in self.systems)
        out = start.u @ self.difference(above.u, below.u) + start.step_start @ self.difference(above.step_start, below.step_start)
        for w, a, b in zip(start.history, above.history, below.history):
            out = out + np.einsum("meqh,eqh->m", w, self.difference(a, b))
        coordinate = self.difference(above.contact.coordinate, below.contact.coordinate)[:, 0]
        for surface, points in zip(self.systems[0].surfaces, start.contact):
            out = out + points.s @ coordinate[surface.rows]
        return np.asarray(out)

    def _of_step(self, number: int, stage: Stage) -> Array:
        """Through what a step prescribes: motions, forces, friction."""
        a, b = (plan_step(s, number, stage.step_start, stage.ends) for s in self.systems)
        if a.seconds != b.seconds:
            raise ArgumentError(
                f"gradient: {self.path} changes the duration of a step, which the adjoint does not cover; use "
                "solve(derivatives=...)"
            )
        out = np.zeros(len(stage.prescribed[0].motion))
        for w, p, q in zip(stage.laws, a.friction, b.friction):
            if not alike(p, q):
                raise OnlyForwards(
                    f"gradient: {self.path} changes a table of friction, which cannot be followed backwards; use "
                    "solve(derivatives=...)"
                )
            if w.shape[1] and p is not None and q is not None and p != q:
                out = out + w @ self.difference(values_of(p).numbers, values_of(q).numbers)
        for still in stage.still:
            moves = still.slopes @ (self.difference(*(p.values(still.time) - p.values(still.before) for p in (a, b))))
            if np.abs(moves * self.size).max(initial=0.0) > self.policy.derivative_residual_share:
                raise OnlyForwards(
                    f"gradient: {self.path} moves a node that supports hold at rest on a tool, which would begin to slide or "
                    f"open (step {a.name!r}, time {still.time:.6g}), which has no derivative; solve(derivatives=...) follows "
                    "the side on which it rests, and says so"
                )
        for at in stage.prescribed:
            out = out + at.motion @ self.difference(a.values(at.time), b.values(at.time))
            for dof, amplitude in a.push.items():
                out = out + at.force[:, dof] * self.difference(amplitude(at.time), b.push[dof](at.time))
        return np.asarray(out)


def _with_shapes(system: System, like: System) -> System:
    """A system with the tools' shapes of another."""
    return replace(system, tools=[replace(t, shape=o.shape, direction=o.direction) for t, o in zip(system.tools, like.tools)])


