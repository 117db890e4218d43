"""Time stepping: choose the increment, attempt it, commit it or cut it.

The only commit of the package is here; the new state is made in `prensa.solver.commit`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

import numpy as np

from prensa.checks.after.passages import Passages
from prensa.checks.check import Committed, Failed, Finished, Rejected, Solved, StepBegun
from prensa.checks.during.closing import KnownFolds
from prensa.checks.thresholds import IMBALANCE
from prensa.errors import SolveError
from prensa.linear.threads import ONE_OF_BLAS
from prensa.measures import parse
from prensa.model import problem as model
from prensa.policy import Policy
from prensa.result.folding import Fold, Outlined
from prensa.result.increment import Increment
from prensa.result.results import increment_of
from prensa.solver.approach import first_touch, starts_inside
from prensa.solver.balance import balanced, blow_energy
from prensa.solver.before_folds import before_it_closes
from prensa.solver.commit import committed
from prensa.solver.diagnosis import InUse, failed_increment, hint, last_good
from prensa.solver.given_times import given_times, increasing
from prensa.solver.increment_solver import IncrementSolver
from prensa.solver.reporting import Messages
from prensa.solver.stability import at_limit, stability_warnings
from prensa.solver.step_control import StepControl
from prensa.solver.until import Outcome, Stopping
from prensa.system.failure import Failure, LimitPoint, sentence
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.planning import plan_step
from prensa.system.release import minimal_supports_in_words, release_forces, removed_tools
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.symmetry_planes import Guard, Nearing, extended, names_of, with_planes
from prensa.system.system import System
from prensa.system.time_integration import growths, unsteadiness
from prensa.timer import Timer
from prensa.types import Array

log = logging.getLogger("prensa")


def at_rest(system: System) -> Increment | None:
    """The initial state as an increment, number 0: what there is to look at when the first increment fails; None if nothing."""
    state = system.initial()
    plan = plan_step(system, 0, state.step_start)
    e = system.evaluate(system.context(state, plan, 0.0), state.u, state.lam, stiffness=False)
    result = NewtonResult(True, None, state.u, e, state.lam, 0)
    return None if e.failed else increment_of(system, state, plan, e, result, 0, 0, False, parse=parse)


class Due(Protocol):
    """Time at which a tool has gone the way after which a mesh is due."""

    def __call__(self, state: State, plan: StepPlan, until: float, reached: Array | None = None) -> float:
        """That after a committed state and up to the time ``until``, infinite where there is none.

        Tools whose motion is not given are taken to go on as in the last increments, or to the dofs ``reached`` (ndof,) by then;
        infinite too where these are hardly beyond that way.
        """


class TimeStepping(IncrementSolver):
    """A run: the steps of a problem one after the other, each in increments."""

    def __init__(
        self, system: System, numerics: model.Numerics, policy: Policy, messages: Messages, timer: Timer, condense: bool
    ) -> None:
        super().__init__(system, numerics, policy, messages, timer, condense)
        self.last: Increment | None = None
        self.passages = Passages(system)
        self.guard: Guard | None = None  # of planes of symmetry that free sides may come to
        self.planes: list[str] = []  # tools that stand for them, once one has
        self.due: Due | None = None  # when a mesh is due, where that is known before
        self.stopping: Stopping
        self.stops: Array | None = None

    def prescribe(self, start: State, times: Sequence[float] | None, stops: Sequence[float] = ()) -> None:
        """Let increments after a state end at given times: at these and no others, or at ``stops`` too.

        Raises
        ------
        ArgumentError
            For times that do not increase, are over already, or leave the end of a step out.

        """
        self.stops = increasing("stops", stops)
        self.times = None if times is None else given_times(self.system.problem, start.clock.time, times)

    def run(self, state: State) -> Iterator[Increment]:
        """Increments from a committed state to the end of the last step."""
        self.note_touch(state)
        steps = self.system.problem.steps
        for number in range(state.clock.step, len(steps)):
            if not self.system.gone and model.tools_removed(self.system.problem, number):
                if state.clock.time <= number:
                    self.messages.report(self.checks.tools_leave, Finished(self.passages.met, self.planes))
                self.refuse_to_part(state, number)
                yield from self.without_tools().run(state)
                return
            plan = plan_step(self.system, number, state.step_start, state.ends)
            self.stopping = Stopping(self.system, plan, self.policy, self.view)
            entered = state
            if state.clock.time <= plan.t0:
                state = self.begin(state, plan)
            self.prepare(plan)
            second, steady = self.second_order(plan), self.numerics.time_rule == "auto"
            tolerance = self.numerics.time_tolerance
            control = StepControl(
                self.system, plan, self.policy, self.times, self.stops, second, second and steady, tolerance if second else None
            )
            while state.clock.step == number:
                try:
                    with ONE_OF_BLAS:
                        state, increment = self.advance(state, plan, control)
                except Nearing as nearing:
                    if self.remeshes:
                        raise
                    self.messages.note(state, plan, str(nearing))
                    rest = self.with_planes()
                    rest.checks = self.checks.of(rest.system)
                    begun = state if state.clock.time > plan.t0 else entered
                    yield from rest.run(extended(begun, self.system, rest.system))
                    return
                self.last = increment
                self.note_touch(state)
                yield increment
        if len(steps):
            self.messages.report(self.checks.run_ends, Finished(self.passages.met, self.planes))

    def note_touch(self, state: State) -> None:
        """Note the tools that have touched something by a committed state."""
        contact = state.contact
        for s in self.system.tool_contacts:
            name = s.against
            if name not in self.passages.met and (contact.closed[s.rows].any() or (contact.slip[s.rows] > 0).any()):
                self.passages.met.add(name)

    def without_tools(self) -> TimeStepping:
        """The rest of the run, when the tools are gone."""
        rest = self.onto(self.system.without_tools())
        rest.checks = self.checks.of(rest.system)
        rest.passages, rest.remeshes, rest.last = self.passages, self.remeshes, self.last
        rest.times, rest.stops = self.times, self.stops
        return rest

    def with_planes(self) -> TimeStepping:
        """The rest of the run, with tools at the planes of symmetry."""
        assert self.guard is not None
        rest = self.onto(with_planes(self.guard))
        rest.passages, rest.last, rest.times, rest.stops = self.passages, self.last, self.times, self.stops
        rest.planes = names_of(self.system.problem, self.guard.mirrors)
        return rest

    def onto(self, system: System) -> TimeStepping:
        """Another part of the run, on a system with other tools."""
        messages = Messages(system, self.messages.monitor)
        return TimeStepping(system, self.numerics, self.policy, messages, self.timer, condense=False)

    def refuse_to_part(self, state: State, number: int) -> None:
        """Raise `SolveError` if tools are to be removed while a free side is pressed on a plane of symmetry."""
        pressed = [s for s in self.system.surfaces if s.against in self.planes]
        if any(state.contact.closed[s.rows].any() for s in pressed):  # all contacts would end
            kind = "line" if self.system.dofs.dimension == 2 else "plane"
            raise SolveError(
                f"step {self.system.problem.steps[number].name!r}: 'remove_tools' ends all contacts, and a free side of "
                f"{pressed[0].body!r} is pressed on a {kind} of symmetry, which stays. What to try: move the tools away ('by').",
                self.last,
            )

    def begin(self, state: State, plan: StepPlan) -> State:
        """The state in which a step begins; what an early end left of the time before is passed over."""
        problem, number = self.system.problem, plan.number
        if model.tools_removed(problem, number) and not model.tools_removed(problem, number - 1):
            state = removed_tools(self.system, state, plan)
            if words := minimal_supports_in_words(self.system, plan):
                self.messages.note(state, plan, words)
            state = replace(state, clock=state.clock._replace(time=plan.t0))
        elif number:
            released = release_forces(self.system, state, plan)
            self.messages.report(self.checks.step_begins, StepBegun(state, plan))
            state = replace(state, release=released, self_equilibrated=None, clock=state.clock._replace(time=plan.t0))
        return self.stopping.begin(state)

    def advance(self, state: State, plan: StepPlan, control: StepControl) -> tuple[State, Increment]:
        """One committed increment, cut as often as needed."""
        now, dt = state.clock.time, state.clock.dt
        dt = dt if dt > 0 else control.first()
        spent: list[int] = []
        cutbacks, most = 0, self.most_cutbacks(state)
        while True:
            due = np.inf if self.due is None else self.due(state, plan, min(now + 2.0 * dt, plan.t1))
            end, notes = control.end(now, dt, due), list[str]()
            if self.times is None:
                end, notes = first_touch(self.system, state, plan, end, self.policy)
            for message in notes:
                self.messages.note(state, plan, message)
            solve = partial(self.solved, state, plan, control, cutbacks, spent)
            c, result = solve(end)
            if result.converged and self.due is not None and self.times is None:
                due = self.due(state, plan, c.time, result.u)
                c, result = solve(due) if due < c.time else (c, result)
            if result.converged:
                c, result = self.as_long_as_balanced((c, result), solve, control)
            if result.converged:
                given = self.before_folds_close((c, result), solve)
                # An increment is a function of its end: a search from the same committed state leaves nothing to be undone.
                c, result = outcome = self.stopping.search((given.context, given.result), solve)
                given = given if result is given.result else self.looked_at(outcome)
            if result.converged:
                # These end the run instead of cutting: a node that came there gradually gets there with shorter increments, too.
                self.look_inside(given)
                self.stopping.refuse(c)
                if notes and c.time >= end:
                    c = replace(c, touches=True)
                return self.commit(c, control, result, sum(spent), cutbacks)
            self.messages.rejected(state, plan, c.time, result)
            assert result.reason is not None
            dt = control.cut(c.dt)
            # a first attempt may have released a body that only contact holds by a far step: the next has none
            came_free = control.comes_free(result.reason, c.dt) and not (self.loose and cutbacks == 0)
            last = cutbacks == most or control.exhausted(dt) or came_free
            rejected = Rejected(c, result.reason, control.longest(None))
            # Cuts that cannot help only delay the message: a strip flattened with μ 0.5 took 534 increments to its end, now 37.
            hopeless = self.messages.report(self.checks.rejected, rejected) or self.stays_inside(state, cutbacks)
            result.reason = hopeless or result.reason
            if last or hopeless or (isinstance(result.reason, LimitPoint) and at_limit(c, self.policy)):
                raise self.diagnosis(c, result, cutbacks)
            cutbacks += 1

    def as_long_as_balanced(self, outcome: Outcome, solve: Callable[[float], Outcome], control: StepControl) -> Outcome:
        """An increment, shorter where its work would not be accurate enough and its length is not asked for.

        That is where its balance misses so much of the largest energy that the run would warn of it, were the energies to grow
        to the end of the step as they did in it so far; in a blow where it misses `Numerics.energy_tolerance` of that.
        """
        (c, result), plan = outcome, outcome[0].plan
        if plan.increments or self.times is not None:
            return outcome

        def missing(outcome: Outcome) -> float:
            return self.stabilisation.energies(*outcome).imbalance - c.state.energy.imbalance

        if blow := blow_energy(self.system.problem, plan.number):
            return balanced(outcome, solve, missing, self.numerics.energy_tolerance * blow)
        before, largest = c.state.largest_energies.tolist()
        now = self.stabilisation.energies(c, result)
        grown = max(largest, now.largest) - before
        at_end = before + grown * (plan.t1 - plan.t0) / (c.time - plan.t0)
        # Bodies that nothing resists yet are carried along by forces that are round-off.
        nothing = self.system.round_off * float(np.abs(self.system.displacement(result.u - c.state.u)).max())
        allowed = max(IMBALANCE * at_end, nothing)
        if abs(now.imbalance - c.state.energy.imbalance) <= allowed:
            return outcome
        return balanced(outcome, solve, missing, allowed, control.first())

    def before_folds_close(self, outcome: Outcome, solve: Callable[[float], Outcome]) -> Solved:
        """An increment, shorter where a fold would begin and close in it; reported all the same where its end is given."""
        if not self.checks.closing.applies:
            return self.looked_at(outcome)
        looked: list[Solved] = []

        def new(tried: Outcome) -> list[Fold]:
            if not looked or looked[-1].result is not tried[1]:
                looked.append(self.looked_at(tried))
            return self.checks.closing.new(looked[-1])

        plan = outcome[0].plan
        halved = before_it_closes(new, outcome, solve, self.policy.min_share * (plan.t1 - plan.t0))
        if self.times is not None and halved.found:
            self.messages.report([self.checks.closing], looked[-1])
        return looked[-1] if self.times is None and halved.found else looked[0]

    def looked_at(self, outcome: Outcome) -> Solved:
        """An increment as checks are given it."""
        c, result = outcome
        outlines = Outlined(self.system, self.outlines(result), c.state.step_start)
        return Solved(c, result, outlines, result.recover is None, self.guard)

    def reported_folds(self, state: State) -> KnownFolds:
        """Folds that were reported, where the outlines are in a state."""
        return self.checks.closing.reported(state.u)

    def know_folds(self, reported: KnownFolds, state: State) -> None:
        """Report no fold again that was reported on other meshes, from a state on."""
        self.checks.closing.know(reported, state.u)

    def outlines(self, result: NewtonResult) -> Array:
        """Degrees of freedom (ndof,) that are right on the outlines of the bodies."""
        return result.u if result.recover is None or self.condensed is None else self.condensed.outlined(result.u)

    def stays_inside(self, state: State, cutbacks: int) -> Failure | None:
        """The tool that starts deepest inside a body, if the first increment fails on: shorter ones have the same overlap."""
        inside = starts_inside(self.system, state, self.policy) if cutbacks >= self.policy.retry_after_cuts else []
        return max((reason for reason, *_ in inside), key=lambda reason: reason.elements, default=None)

    def view(self, c: Context, result: NewtonResult) -> Increment:
        """The increment that an outcome would be, if it were committed."""
        assert result.evaluation is not None
        state = committed(self.system, c, result, result.evaluation, 0.0, self.stabilisation)
        return increment_of(self.system, state, c.plan, result.evaluation, result, 0, 0, False, c.state, parse=parse)

    def commit(
        self, c: Context, control: StepControl, result: NewtonResult, spent: int, cutbacks: int
    ) -> tuple[State, Increment]:
        """The state that follows, the increment that led to it, and what there is to say of it."""
        assert result.evaluation is not None
        e = result.evaluation._replace(data=None)  # increments that are kept must not keep their matrices
        ended = c.ends_step
        grown = result.grown or growths(self.system.blocks, e.history, c.state.history)
        unsteady = 0.0
        if control.second_order and not ended:
            unsteady = unsteadiness(c.state, c.dt, c.rule, c.history, self.system.blocks, grown)
        dt = 0.0 if ended else control.next(c, e, grown, result.iterations - result.discarded, cutbacks, unsteady)
        result.grown = grown = ()  # a large increment has no room for that of the one before
        state = committed(self.system, c, result, e, dt, self.stabilisation)
        made_from = state.made_from if self.reduced is None or ended else self.reduced.factorisation.made_from
        state = replace(state, clock=state.clock._replace(unsteady=unsteady), made_from=made_from)
        done = Committed(c, state, e, max(result.residual, self.numerics.tolerance), result.recover is None)
        if refusal := self.messages.report(self.checks.committed, done):
            result.reason = refusal
            raise self.diagnosis(c, result, cutbacks)
        increment = increment_of(self.system, state, c.plan, e, result, spent, cutbacks, ended, c.state, c, parse=parse)
        if c.stopped:
            self.messages.note(c.state, c.plan, f"step {c.plan.name!r} ends at time {c.time:.6g}: {c.stopped}")
            self.messages.warn(self.stopping.early(c))
            increment = replace(increment, stopped=c.stopped)
        increment = self.passages.follow(increment, self.system, c, state, e)
        if ended:
            self.messages.warn(self.stopping.unmet(c))
            self.messages.report([self.passages, *self.checks.step_ends], done)
        viscous = self.stabilisation.warnings(state.energy, state.stability) if ended else ()
        self.messages.warn([*viscous, *stability_warnings(c, result)])
        self.messages.accepted(c.state, c.plan, result, increment)
        return state, increment

    def look_inside(self, given: Solved) -> None:
        """Raise `SolveError` if a check ends the run with an increment, `Nearing` if it has to go on with planes of symmetry."""
        c = given.context
        reason = self.messages.report(self.checks.solved, given)
        if reason is not None:
            self.messages.report(self.checks.up_to_here, Failed(c, reason))
            raise SolveError(
                f"step {c.plan.name!r}, time {c.time:.6g}: {sentence(reason)}. {last_good(self.last)} "
                f"What to try: {hint(reason, InUse.of(self.system, c))}.",
                self.last,
                reason,
            )

    def diagnosis(self, c: Context, result: NewtonResult, cutbacks: int) -> SolveError:
        """The error that says what failed, where, why, and what to try."""
        assert result.reason is not None
        result.reason = self.messages.report(self.checks.failed, Failed(c, result.reason)) or result.reason
        most = None if self.times is not None else self.most_cutbacks(c.state)
        return failed_increment(self.equilibrium(c), result, cutbacks, most, self.last)
