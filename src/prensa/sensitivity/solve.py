"""`solve` with derivatives: the increments of a run, each with the derivatives of whatever is asked of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from prensa import analysis
from prensa.analysis import belongs, report_preflight
from prensa.checks.after.passages import Passages
from prensa.errors import ArgumentError, take
from prensa.linear.threads import threads_with_follower
from prensa.model import problem as model
from prensa.model.body_contacts import DERIVATIVES
from prensa.model.feed import ends_early
from prensa.model.remeshing import remeshing_of
from prensa.policy import Policy
from prensa.result.increment import Increment, Monitor
from prensa.sensitivity.direct import Direction
from prensa.sensitivity.follower import Follower
from prensa.sensitivity.increments import Differentiation
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.finer_contact import missed_on_finer
from prensa.solver.reporting import Messages
from prensa.solver.stabilisation import stabilised
from prensa.solver.step_control import StepControl
from prensa.solver.time_stepping import TimeStepping
from prensa.system.discretise import discretise
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.state import State
from prensa.system.symmetry_planes import Guard, extended_derivatives, guard_of, system_of
from prensa.system.system import System
from prensa.timer import Timer


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
        As `prensa.analysis.solve`, which this is where no derivatives are asked for.
    start
        A committed state to continue from; it carries the derivatives of the run that led to it.
    times
        Ends of all increments, among them those of the steps (step number k, from 0, is the time from k to k + 1); none is cut.
    stops
        Times at which an increment ends, among those that are chosen.
    derivatives
        Paths of parameters, as ``--set`` writes them: ``friction.mu``, ``bodies.ring.material.flow.K``, ``steps.0.move.die.y``.
        `Increment.derivative` then gives derivatives by them, at the same times. With more than one thread one of them finds
        these while the run goes on, which is an increment ahead of what is reported then.

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
        return analysis.solve(problem, numerics, start, monitor, timer, policy, passages, times, stops)
    analysis.check_arguments(problem, numerics, start, monitor, timer, policy)
    system = base = problem if isinstance(problem, System) else discretise(problem)
    refuse(system, start, derivatives)
    if start is None:
        report_preflight(system)
    elif not belongs(start, system):
        system = system_of(start, system)
    policy, timer, messages, begin = policy or Policy(), timer or Timer(), Messages(system, monitor), start or system.initial()
    numerics = numerics or model.Numerics()
    threads, follows = threads_with_follower(numerics, system.ndof, policy, system.dofs.dimension == 3)
    directions = [Direction.of(system, path, policy.parameter_step_ratio, policy, begin) for path in derivatives]
    stepping = Differentiated(system, replace(numerics, threads=threads), policy, messages, timer, directions)
    stepping.checks.between_nodes.on_finer = partial(missed_on_finer, numerics=numerics, policy=policy)
    # Planes from the beginning would make another run than the one without derivatives.
    stepping.passages, stepping.guard = passages or stepping.passages, guard_of(system) if system is base else None
    stepping.planes = list(system.problem.tools)[len(base.problem.tools) :]
    stepping.prescribe(begin, times, stops)
    stepping.follower = Follower(messages, timer) if follows else None
    return stepping.run(begin) if stepping.follower is None else stepping.follower.behind(stepping.run(begin))


def _refuse_to_move(guard: Guard | None, d: Direction) -> None:
    """Raise `ArgumentError` where a plane of symmetry lies elsewhere with another parameter."""
    here = None if guard is None else guard.mirrors
    for system in d.systems:
        beside = guard_of(system)
        if (None if beside is None else beside.mirrors) != here:
            kind = "line" if system.dofs.dimension == 2 else "plane"
            raise ArgumentError(
                f"derivatives: a free side comes to a {kind} of symmetry, which {d.parameter.path!r} moves, and the plane that "
                "stands there from now on does not move with it; describe it: a smooth plane among the tools, and a contact of "
                "the whole body with it"
            )


def refuse(system: System, start: State | None, derivatives: Sequence[str]) -> None:
    """Refuse what has no derivative."""
    if system.problem.heat is not None:
        raise ArgumentError("derivatives: those of temperatures are not available yet; leave 'derivatives' out")
    if system.problem.body_contacts:
        raise ArgumentError(f"derivatives: {DERIVATIVES}; leave 'derivatives' out")
    if system.interferes:
        raise ArgumentError(
            "derivatives: those of runs with 'interference' are not available yet; run the case with other values instead "
            "('sweep')"
        )
    if system.more:
        raise ArgumentError(
            "derivatives: a system that is more than its description (with extensions) has no numbers to vary; solve a Problem"
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
            f"derivatives: step {removes!r} removes the tools, which has no derivative yet; move them away ('by')"
        )
    if start is not None and start.clock.number:
        missing = [path for path in derivatives if path not in start.derivatives]
        if missing:
            raise ArgumentError(
                f"derivatives: the state to start from does not contain those by {missing[0]!r}; run from the beginning with them"
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


class Followed(TimeStepping):
    """A run that derivatives follow: its increments are those of a run without, bit for bit; elastic bodies are not condensed."""

    def __init__(
        self, system: System, numerics: model.Numerics, policy: Policy, messages: Messages, timer: Timer
    ) -> None:
        super().__init__(system, numerics, policy, messages, timer, condense=False)

    @property
    def wants_matrices(self) -> bool:
        """Whether there is use, and room, for matrices at solutions."""
        return True

    def equilibrium(self, c: Context, uncut: bool = False) -> Equilibrium:
        """As `TimeStepping.equilibrium`, with the matrix at the solution where there is use for it.

        Not where Newton would go otherwise then (see `Equilibrium.keeps_matrix`).
        """
        assert self.reduced is not None
        keeps = self.wants_matrices and not self.reduced.factorisation.follows
        return replace(super().equilibrium(c, uncut), keeps_matrix=keeps)


class Differentiated(Followed):
    """A run whose increments have derivatives."""

    def __init__(
        self, system: System, numerics: model.Numerics, policy: Policy, messages: Messages, timer: Timer,
        directions: Sequence[Direction],
    ) -> None:  # fmt: skip
        super().__init__(system, numerics, policy, messages, timer)
        self.differentiation = Differentiation(system, policy, directions)
        self.follower: Follower | None = None

    def onto(self, system: System) -> Differentiated:
        """As `TimeStepping.onto`; derivatives go on from where they are.

        Raises
        ------
        ArgumentError
            If a parameter moves a line of symmetry, at which the plane stands still.

        """
        if self.follower is not None:
            # Directions carry what is found of the last increment: it has to be there before it is taken over.
            self.follower.wait()
        share, directions = self.policy.parameter_step_ratio, []
        for d in self.differentiation.directions:
            _refuse_to_move(self.guard, d)
            there = Direction.of(system, d.parameter.path, share, self.policy, system.initial())
            there.carried = extended_derivatives(d.carried, there.carried, self.system, system)
            directions.append(there)
        messages = Messages(system, self.messages.monitor)
        rest = Differentiated(system, self.numerics, self.policy, messages, self.timer, directions)
        rest.follower, rest.differentiation.reported = self.follower, self.differentiation.reported
        rest.differentiation.largest = self.differentiation.largest
        return rest

    def commit(
        self, c: Context, control: StepControl, result: NewtonResult, spent: int, cutbacks: int
    ) -> tuple[State, Increment]:
        """As `TimeStepping.commit`, with the derivatives of what it commits, unless somebody follows to find them."""
        state, increment = super().commit(c, control, result, spent, cutbacks)
        assert self.reduced is not None
        # Factors of its own: new ones that derivatives need would take the place of Newton's, and the next increment would have
        # to make its own again.
        find = partial(self.differentiation.of, c, result, state, self.reduced.detach())
        if self.follower is not None:
            self.follower.follow(increment, find)
            return state, increment
        with self.timer("derivatives"):
            found = find()
        self.messages.warn(found.doubts)
        return found.state, found.of(increment)
