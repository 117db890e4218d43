"""`solve` with derivatives: the increments of a run, each with the derivatives of whatever is asked of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import TOUCH
from prensa.contact.record import magnitude
from prensa.errors import ArgumentError, PrensaError, take
from prensa.fem.context import Context
from prensa.fem.discretise import discretise
from prensa.fem.mirrors import Guard, extended_derivatives, guard_of, system_of
from prensa.fem.state import State
from prensa.fem.system import System
from prensa.measures.measure import Measure
from prensa.model import problem as model
from prensa.model.feed import ends_early
from prensa.model.remeshing import remeshing_of
from prensa.sensitivity.closed import Beside, Bundle, covers, differentiate
from prensa.sensitivity.direct import Columns, Direction, Neighbour, Solution
from prensa.solver import time_stepping
from prensa.solver.equilibrium import NewtonResult
from prensa.solver.increment import Derivatives, Increment, Monitor
from prensa.solver.passages import Passages
from prensa.solver.policy import Policy
from prensa.solver.reporting import Messages
from prensa.solver.stabilisation import stabilised
from prensa.solver.step_control import StepControl
from prensa.solver.time_stepping import Timer, TimeStepping, belongs, told_before

Array = NDArray[np.float64]

BORNE = 1e-9  # share of the bound of friction within which a traction is all that friction bears


def solve(
    problem: model.Problem | System,
    numerics: model.Numerics | None = None,
    start: State | None = None,
    monitor: Monitor | None = None,
    timer: Timer | None = None,
    policy: Policy | None = None,
    passages: Passages | None = None,
    times: Sequence[float] | None = None,
    stops: Sequence[float] = (),
    derivatives: Sequence[str] = (),
) -> Iterator[Increment]:
    """Yield the converged increments of a problem, in order.

    Parameters
    ----------
    problem, numerics, monitor, timer, policy, passages
        As `prensa.solver.time_stepping.solve`, which this is where no derivatives are asked for.
    start
        A committed state to continue from; it carries the derivatives of the run that led to it.
    times
        Ends of all increments, among them those of the steps (step number k, from 0, is the time from k to k + 1); none is cut.
    stops
        Times at which an increment ends, among those that are chosen.
    derivatives
        Paths of parameters, as ``--set`` writes them: ``friction.mu``, ``bodies.ring.material.flow.K``, ``steps.0.move.die.y``.
        `Increment.derivative` then gives derivatives by them, at the same times.

    Raises
    ------
    PrensaError
        For a description that cannot be discretised, a path without a number, and what has no derivative (augmented contacts,
        cases that start from a run); `SolveError` when an increment does not converge after all cut-backs.

    """
    if isinstance(derivatives, str):
        derivatives = [derivatives]
    check_paths("solve", "derivatives", derivatives)
    if not derivatives:
        return time_stepping.solve(problem, numerics, start, monitor, timer, policy, passages, times, stops)
    time_stepping.check_arguments(problem, numerics, start, monitor, timer, policy)
    system = base = problem if isinstance(problem, System) else discretise(problem)
    refuse(system, start, derivatives)
    if start is None:
        told_before(system)
    elif not belongs(start, system):
        system = system_of(start, system)
    policy = policy or Policy()
    stepping = Differentiated(system, numerics or model.Numerics(), policy, Messages(system, monitor), timer or Timer())
    stepping.passages = passages or stepping.passages
    stepping.guard = guard_of(system) if system is base else None
    stepping.planes = list(system.problem.tools)[len(base.problem.tools) :]
    begin = start or system.initial()
    stepping.prescribe(begin, times, stops)
    share = policy.parameter_step
    stepping.directions = [Direction.of(system, path, share, policy, begin) for path in derivatives]
    return stepping.run(begin)


def _refuse_to_move(guard: Guard | None, d: Direction) -> None:
    """Tell where a line of symmetry lies elsewhere with another parameter."""
    here = None if guard is None else guard.lines
    for system in d.systems:
        beside = guard_of(system)
        if (None if beside is None else beside.lines) != here:
            raise ArgumentError(
                f"derivatives: a free side comes to a line of symmetry, which {d.parameter.path!r} moves, and the plane that "
                "stands there from now on does not move with it; describe it: a smooth plane among the tools, and a contact of "
                "the whole body with it"
            )


def refuse(system: System, start: State | None, derivatives: Sequence[str]) -> None:
    """Tell what has no derivative."""
    if system.courses is not None or system.more:
        raise ArgumentError(
            "derivatives: a system that is more than its description (of bricks, or with extensions) has no numbers to vary; "
            "solve a Problem"
        )
    augmented = [s.name for s in system.surfaces if s.description.enforcement.max_updates]
    if augmented:
        raise ArgumentError(
            f"derivatives: contact {augmented[0]!r} is augmented: its answer depends on where the updates of its "
            "multipliers stop, which has no derivative; give 'enforcement: {type: exact}', which meets the same conditions"
        )
    if system.beginning is not None:
        raise ArgumentError(
            "derivatives: the case starts from a run, whose derivatives are not known; describe both in one case, with more steps"
        )
    if remeshing_of(system.problem) is not None:
        raise ArgumentError("derivatives: a new mesh has other nodes, so nothing is known of its derivatives; give 'remesh: off'")
    until = next((s.name for s in system.problem.steps if ends_early(s)), None)
    if until is not None:
        raise ArgumentError(
            f"derivatives: step {until!r} ends by its 'until' or 'feed', at another time for other parameters; give the travel "
            "or the force at which it ended"
        )
    led = next((s.name for s in system.problem.steps if s.control), None)
    if led is not None:
        raise ArgumentError(
            f"derivatives: the loads of step {led!r} follow by its 'control', which has no derivatives yet; move the tool ('by')"
        )
    steps = enumerate(system.problem.steps)
    viscous = next((s.name for k, s in steps if stabilised(system.problem, k) != "off"), None)
    if viscous is not None:
        raise ArgumentError(
            f"derivatives: step {viscous!r} is stabilised; how viscous it is follows from the run, which has no derivative: "
            "give 'stabilise: off'"
        )
    removes = next((s.name for s in system.problem.steps if s.remove_tools), None)
    if removes is not None:
        raise ArgumentError(
            f"derivatives: step {removes!r} removes the tools, and what they leave is not followed; move them away ('by')"
        )
    if start is not None and start.clock.number:
        missing = [path for path in derivatives if path not in start.derivatives]
        if missing:
            raise ArgumentError(
                f"derivatives: the state to start from does not carry those by {missing[0]!r}; run from the beginning with them"
            )
    if len(set(derivatives)) < len(derivatives):
        repeated = next(path for path in derivatives if derivatives.count(path) > 1)
        raise ArgumentError(f"derivatives: {repeated!r} is listed twice")


def check_paths(function: str, name: str, paths: object) -> None:
    """Refuse what is no list of paths of parameters."""
    take(function, name, paths, Sequence, "give a list of paths, for example ['friction.mu']")
    assert isinstance(paths, Sequence)
    for k, path in enumerate(paths):
        take(function, f"{name}[{k}]", path, str, "give a path, for example 'friction.mu'")


@dataclass(frozen=True)
class _Derivatives(Derivatives):
    """See `Derivatives`: central differences of any observable between neighbours that are linear in the parameter."""

    neighbours: Mapping[str, tuple[Beside | Neighbour, Beside | Neighbour]]
    before: State
    led_from: Mapping[str, Mapping[str, Array]]
    """By path: the derivatives that belong to the state ``before``."""
    state: State
    ended: bool
    measures: dict[str, Measure]
    """Those that have been asked for in the run, by their texts."""

    _made: dict[str, tuple[Increment, Increment]] = field(default_factory=dict)

    def measure(self, name: str, problem: model.Problem) -> Measure:
        """See `Derivatives`."""
        if name not in self.measures:
            self.measures[name] = super().measure(name, problem)
        return self.measures[name]

    def _increments(self, path: str) -> tuple[Increment, Increment]:
        """Neighbouring increments by a parameter, made when first asked for."""
        if path not in self._made:
            both = []
            for side, sign in zip(self.neighbours[path], (1.0, -1.0)):
                step = sign * side.step
                before = self.before.moved(self.led_from[path], step)
                state = self.state.moved(self.state.derivatives[path], step)
                both.append(side.increment(before, state, self.ended))
            self._made[path] = both[0], both[1]
        return self._made[path]

    def of(self, observable: Measure | Callable[[Increment], float], increment: Increment) -> dict[str, float]:
        """See `Derivatives`."""
        slope = observable.gradient(increment) if isinstance(observable, Measure) else None
        value = observable.value if isinstance(observable, Measure) else observable
        out = {}
        for path, beside in self.neighbours.items():
            known = None if slope is None else beside[0].slope(slope)
            if known is None:
                a, b = self._increments(path)
                known = (float(value(a)) - float(value(b))) / (2.0 * beside[0].step)
            out[path] = known
        return out


class Followed(TimeStepping):
    """A run whose increments derivatives follow: elastic bodies are not condensed."""

    def __init__(
        self, system: System, numerics: model.Numerics, policy: Policy, messages: Messages, timer: Timer
    ) -> None:
        super().__init__(system, numerics, policy, messages, timer, condense=False)


class Differentiated(Followed):
    """A run that carries derivatives of the committed state along; its increments are those of a run without, bit for bit."""

    keeps_matrix = True

    def __init__(
        self, system: System, numerics: model.Numerics, policy: Policy, messages: Messages, timer: Timer
    ) -> None:
        super().__init__(system, numerics, policy, messages, timer)
        self.directions: Sequence[Direction] = ()
        self.bundle: Bundle | None = None
        self.mixtures: dict[tuple[str, ...], Direction | None] = {}
        self.finer: dict[tuple[str, float], Direction] = {}
        self.told: set[str] = set()
        self.measures: dict[str, Measure] = {}

    def onto(self, system: System) -> Differentiated:
        """As `TimeStepping.onto`; derivatives go on from where they are.

        Raises
        ------
        ArgumentError
            If a parameter moves a line of symmetry, at which the plane stands still.

        """
        rest = Differentiated(system, self.numerics, self.policy, Messages(system, self.messages.monitor), self.timer)
        rest.told, share = self.told, self.policy.parameter_step
        for d in self.directions:
            _refuse_to_move(self.guard, d)
            there = Direction.of(system, d.parameter.path, share, self.policy, system.initial())
            there.carried = extended_derivatives(d.carried, there.carried, self.system, system)
            rest.directions = [*rest.directions, there]
        return rest

    def commit(
        self, c: Context, control: StepControl, result: NewtonResult, spent: int, cutbacks: int
    ) -> tuple[State, Increment]:
        """As `TimeStepping.commit`, with the derivatives of what it commits."""
        state, increment = super().commit(c, control, result, spent, cutbacks)
        led_from = self._carried()
        with self.timer("derivatives"):
            neighbours, flat = self.differentiate(c, result, state)
        state = replace(state, derivatives=self._carried())
        counts = self._switched(c, result), self._at_kinks(c, result)
        found = _Derivatives(flat, *counts, neighbours, c.state, led_from, state, increment.end_of_step, self.measures)
        return state, replace(increment, derivatives=found, _state=lambda: state)

    def _carried(self) -> dict[str, Mapping[str, Array]]:
        return {d.parameter.path: d.carried for d in self.directions}

    def differentiate(
        self, c: Context, result: NewtonResult, state: State
    ) -> tuple[dict[str, tuple[Beside | Neighbour, Beside | Neighbour]], dict[str, float]]:
        """Both neighbours of an increment by each parameter, and what is left of its residual along them.

        Raises
        ------
        PrensaError
            If the residual beside the solution cannot be evaluated.

        """
        assert self.reduced is not None
        assert result.evaluation is not None
        lagged, c, system = c.lagged, replace(c, lagged=False) if c.lagged else c, self.system
        at = Solution(system, c, result.u, result.evaluation)
        if at.e.data is None or lagged:  # else it has its own branches
            at.e = system.evaluate(c, result.u, system.initial_multipliers(c.state), like=at.branches)
        columns = Columns(self.reduced, at.e, system.pattern)
        known = [d for d in self.directions if d.is_known(c)] if covers(c) else []
        known.sort(key=lambda d: d.change is not None and d.change.X is not None)  # those that move bodies go last
        found = self._closed(at, columns, known, state)
        for d in self.directions:
            if d.parameter.path not in found:
                found[d.parameter.path] = self._by_differences(at, columns, d, result, state)
        paths = [d.parameter.path for d in self.directions]
        return {p: found[p][0] for p in paths}, {p: found[p][1] for p in paths}

    def _closed(self, at: Solution, columns: Columns, known: Sequence[Direction], state: State) -> dict[str, Any]:
        """Neighbours and what is left along the parameters whose derivatives are known in closed form."""
        if not known:
            return {}
        bundle = self.bundle
        if bundle is None or bundle.directions != tuple(known):
            bundle = Bundle.of(known)
        self.bundle, found = differentiate(at, columns, bundle, state)
        assert self.reduced is not None
        look, beside = at.c.ends_step or at.c.state.clock.number == 0, {}
        looked = self._looked(at, bundle, found.x) if look else np.zeros(len(known))
        unmet = np.sum([p.unmet() for p in found.points], axis=0) if found.points else np.zeros(len(known))
        left = np.maximum(self.reduced.weight @ np.abs(self.reduced.restriction.part(found.reaction)), looked) + unmet
        for k, (d, rest) in enumerate(zip(known, left)):
            both = tuple(Beside(system, d, sign, k, at, found) for sign, system, _ in d.sides)
            beside[d.parameter.path] = both, self._proved(at, d, rest)
        self.bundle.hand_on()
        return beside

    def _looked(self, at: Solution, before: Bundle, x: Array) -> Array:
        """Norms (d,) of what the residual itself does along derivatives x (ndof, d): of the closed forms it knows nothing.

        Along a mixture of all of them: two residuals show that none is wrong. Where one is, each is looked at.
        """
        assert self.reduced is not None
        known, sizes = before.directions, before.sizes
        shares: Array = 0.5 + 0.5 * np.fmod(0.618034 * np.arange(len(known)), 1.0)  # no two alike, so that errors do not cancel
        mixed = self._mixed(known, shares) if len(known) > 1 else None
        if mixed is not None:
            mixed.carried = before.mixed(shares * sizes)
            rest = self.reduced.norm(mixed.rest(at, x @ (shares * sizes)))
            if rest <= 0.5 * self._may_be_left(at, mixed):
                return rest / sizes
        return np.array([self._left_along(at, d, x[:, k]) for k, d in enumerate(known)])

    def _left_along(self, at: Solution, d: Direction, x: Array) -> float:
        """Norm of what the residual does along a derivative x (ndof,), with finer steps where there is too much."""
        assert self.reduced is not None
        rest = self.reduced.norm(d.rest(at, x))
        for share in self.policy.finer_steps:
            if rest <= self._may_be_left(at, d):
                break
            rest = min(rest, self.reduced.norm(self._with_steps(d, share, d.carried).rest(at, x)))
        return rest

    def _with_steps(self, d: Direction, share: float, carried: Mapping[str, Array]) -> Direction:
        """The parameter with steps of another share of its size, carrying the same."""
        path = d.parameter.path
        if (path, share) not in self.finer:
            self.finer[path, share] = Direction.of(self.system, path, share, self.policy, self.system.initial())
        out = self.finer[path, share]
        out.carried = carried
        return out

    def _mixed(self, known: Sequence[Direction], shares: Array) -> Direction | None:
        """The direction in which all parameters change by shares (d,) of their sizes; None if they cannot together."""
        paths = tuple(d.parameter.path for d in known)
        if paths not in self.mixtures:
            try:
                made = Direction.together(self.system, [d.parameter for d in known], shares, self.policy)
            except PrensaError:
                made = None
            self.mixtures[paths] = made
        return self.mixtures[paths]

    def _by_differences(self, at: Solution, columns: Columns, d: Direction, result: NewtonResult, state: State) -> Any:
        """The same along a parameter for which differences are taken, with finer steps where too much of the residual is left."""
        carried, taken = d.carried, d
        neighbours, rest = self._differences(at, columns, d, result, state)
        for share in self.policy.finer_steps:
            if rest <= self._may_be_left(at, taken):
                break
            finer = self._with_steps(d, share, carried)
            found = self._differences(at, columns, finer, result, state)
            if found[1] < rest:
                (neighbours, rest), taken = found, finer
        if neighbours is None:
            raise PrensaError(f"derivatives: the increment beside, with another {d.parameter.path}, cannot be evaluated")
        d.carried = taken.carried
        return neighbours, self._proved(at, taken, rest)

    def _differences(
        self, at: Solution, columns: Columns, d: Direction, result: NewtonResult, state: State
    ) -> tuple[tuple[Neighbour, Neighbour] | None, float]:
        """The neighbours along a parameter, which carries their difference on, and the norm of what is left between them.

        None and infinity where the increment beside cannot be evaluated.
        """
        assert self.reduced is not None
        sides = d.at_fixed_dofs(at)
        if any(side.e.failed for side in sides):
            return None, np.inf
        dr, given = d.equation(at, sides)
        size, r = d.parameter.size, dr[:, None] + columns.times(given[:, None])
        left = -size * r
        x = columns.begun(left, d.ways(at))
        x = (x + columns.solve(left)) / size
        reaction = left[:, 0] / -size  # r + K x
        neighbours, rest, unmet = d.neighbours(at, sides, given + x[:, 0], reaction, result, state.clock.dt)
        return neighbours, self.reduced.norm(rest) + unmet

    def _proved(self, at: Solution, d: Direction, rest: float) -> float:
        """What is left of the residual along a derivative, over the forces, for a change of the parameter by its size."""
        left = rest * d.parameter.size / at.e.scale
        if not rest <= self._may_be_left(at, d) and d.parameter.path not in self.told:
            self.told.add(d.parameter.path)
            self.messages.warn(
                [
                    f"step {at.c.plan.name!r}, time {at.c.time:.6g}: the derivative by {d.parameter.path} is not exact: along it "
                    f"{left:.1e} of the forces is left where there should be nothing; a corner of a law or of a tool's "
                    "outline, or a node that supports hold on a tool, is in the way, and what comes later is not exact either"
                ]
            )
        return left

    def _may_be_left(self, at: Solution, d: Direction) -> float:
        """Norm of the residual along a derivative that is as it should be."""
        return self.policy.flat * at.e.scale / d.parameter.size + at.e.floor / d.step

    def _switched(self, c: Context, result: NewtonResult) -> dict[str, int]:
        """Points of each contact that have closed or opened in an increment: forces have kinks there."""
        assert result.evaluation is not None
        pairs = zip(self.system.surfaces, result.evaluation.contacts)
        return {s.name: int((f.branches.closed != c.state.contact.closed[s.rows]).sum()) for s, f in pairs}

    def _at_kinks(self, c: Context, result: NewtonResult) -> dict[str, int]:
        """Points of each contact that just touch, or stick on the bound of friction; what supports keep there is no kink."""
        assert result.evaluation is not None
        out = {}
        for s, f, scale in zip(self.system.surfaces, result.evaluation.contacts, c.scales):
            least = TOUCH * scale.h
            at = (np.abs(f.g) <= least) & (f.p <= scale.k_n * least)
            if f.bound is not None:
                bound = f.bound[:, 0]
                full = ~f.slip & (f.p > scale.k_n * least) & (magnitude(f.t) >= (1.0 - BORNE) * bound) & (bound > 0.0)
                at = at | full if f.kept is None else at | (full & ~f.kept.held.bounded)
            out[s.name] = int(at.sum())
        return out
