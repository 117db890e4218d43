"""March through the steps: choose the increment, attempt it, commit it or cut it. The only commit of the package is here."""

from __future__ import annotations

import logging
import time as clocks
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.errors import SolveError, refuse
from prensa.fem.preflight import preflight
from prensa.fem.schedule import StepPlan, plan_step
from prensa.fem.state import State
from prensa.fem.symmetry import is_symmetric
from prensa.fem.system import Circumstances, Evaluation, System, discretise
from prensa.model import problem as model
from prensa.solver.approach import approach, first_touch
from prensa.solver.condensed import Condensation, condensed, to_be_condensed
from prensa.solver.increment import BodyState, Increment, Monitor, Progress, Statistics
from prensa.solver.newton import Reduced, Reporter, Trial, attempt
from prensa.solver.results import body_states, contact_states, support_forces, tool_forces, tool_states
from prensa.solver.watch import doubts, hint, leaning, let_go, passed_through, unmet, where

log = logging.getLogger("prensa")
Array = NDArray[np.float64]

AUTO_FIRST = 0.0025  # first increment of a step without 'increments', as a share of the step
LONGEST = 0.1  # automatic increment at most, as a share of the step
TRAVEL = 0.3  # tool travel per automatic increment, in contact element sizes
PLASTIC = 0.01  # equivalent plastic strain per automatic increment …
SPREAD = 0.95  # … that this share of the points stays below (a singular corner would rule the step otherwise)
FOLDED = -0.1  # area of a corner's triangle over the mean of the four below which an element is folded over
JUMP = 0.5  # fall of that measure in one increment that is no gradual folding
ABSURD = 1.0  # equivalent plastic strain at any point in one increment beyond which it is refused
CUT = 0.25  # share of a rejected increment that is tried next: halves of what fails mostly fail too
LEAST = 1e-5  # share of the step below which increments become shorter by failure alone
SHORTEST = 1e-12  # share of the step below which time would soon stand still: what needs that is a jump
SHORTEN = 2  # cut-backs before an increment is tried with contacts that stiffen: most failures need the cut
EASY, TARGET = 5, 7  # Newton iterations below which the step grows, above which it shrinks


class Timer:
    """Seconds by section, of the wall unless ``clock`` is another (``time.process_time``: of the processor)."""

    def __init__(self, clock: Callable[[], float] = clocks.perf_counter) -> None:
        self.seconds: dict[str, float] = {}
        self.clock = clock

    @contextmanager
    def __call__(self, section: str) -> Iterator[None]:
        """Add the seconds of the block to a section."""
        start = self.clock()
        try:
            yield
        finally:
            self.seconds[section] = self.seconds.get(section, 0.0) + self.clock() - start


def solve(
    problem: model.Problem | System,
    numerics: model.Numerics | None = None,
    start: State | None = None,
    monitor: Monitor | None = None,
    timer: Timer | None = None,
) -> Iterator[Increment]:
    """Yield the converged increments of a problem, in order.

    ``start`` continues from a committed state; ``monitor`` is called at every iteration; ``timer`` collects seconds by
    section.

    Raises
    ------
    PrensaError
        For a description that cannot be discretised; `SolveError` when an increment does not converge after all
        cut-backs.

    """
    system = problem if isinstance(problem, System) else discretise(problem)
    if start is None:
        notices = preflight(system)
        refuse(notices)
        for notice in notices:
            log.warning("%s", notice)
    march = _March(system, numerics or model.Numerics(), monitor, timer or Timer())
    march.condense = to_be_condensed(system, march.numerics)
    return march.run(start or system.initial())


def at_rest(system: System) -> Increment | None:
    """The initial state as an increment, number 0: what there is to look at when the first increment fails; None if nothing."""
    march, state = _March(system, model.Numerics(), None, Timer()), system.initial()
    plan = plan_step(system, 0, state.anchor)
    e = system.evaluate(system.circumstances(state, plan, 0.0), state.u, state.lam, stiffness=False)
    trial = Trial(True, "", state.u, e, state.lam, 0)
    return None if e.failed else march.increment(state, plan, e, trial, 0, 0, False)


def _least_corner(x: Array) -> Array:
    """Least corner triangle of polygons x (3|4, e, 2) over the mean of all: 0 at 180°, negative beyond → (e,)."""
    after = np.roll(x, -1, axis=0) - x
    before = np.roll(after, 1, axis=0)
    area = before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
    return np.asarray(area.min(axis=0) / np.maximum(np.abs(area.mean(axis=0)), 1e-300))


class _March:
    def __init__(self, system: System, numerics: model.Numerics, monitor: Monitor | None, timer: Timer):
        self.system, self.numerics, self.timer = system, numerics, timer
        self.monitor, self.watched = monitor or (lambda _: None), monitor is not None
        self.reduced: Reduced | None = None
        self.condense = False
        self.condensed: Condensation | None = None
        self.last: Increment | None = None
        self.told_of_folding = False
        self.longest = LONGEST  # increment of the present step

    # ---------------------------------------------------------------------------------------------------- marching
    def run(self, state: State) -> Iterator[Increment]:
        self.ever = (state.contact[:, 3] > 0) | (state.contact[:, 1] > 0)
        steps = self.system.problem.steps
        for number in range(int(state.clock[0]), len(steps)):
            plan = plan_step(self.system, number, state.anchor)
            symmetric = is_symmetric(self.system, plan)
            if self.condense:
                with self.timer("condensation"):
                    self.condensed = condensed(self.system, plan, self.numerics, self.condensed)
            if self.condensed is None and (
                self.reduced is None
                or self.reduced.symmetric != symmetric
                or not np.array_equal(self.reduced.fixed, plan.fixed)
            ):
                self.reduced = Reduced(self.system, plan.fixed, self.numerics, symmetric)
            self.longest = self.longest_in(plan)
            while state.clock[2] < plan.t1:
                state, increment = self.advance(state, plan)
                self.last = increment
                self.ever |= state.contact[:, 3] > 0
                yield increment
        if len(steps):
            self.warn(unmet(self.system, self.ever))

    def advance(self, state: State, plan: StepPlan) -> tuple[State, Increment]:
        """One committed increment, cut as often as needed."""
        now, dt = float(state.clock[2]), float(state.clock[3])
        dt = dt if dt > 0 else self.first_dt(plan)
        spent, cutbacks = 0, 0
        while True:
            end, notes = first_touch(self.system, state, plan, self.target(plan, now, dt))
            c = replace(self.system.circumstances(state, plan, end), lagged=self.numerics.iteration == "paper")
            origin, more = approach(self.system, c)
            for message in notes + more:
                self.note(state, plan, message)
            soften = cutbacks >= min(SHORTEN, self.numerics.max_cutbacks)
            trial = self.attempt(c, origin, self.reporter(state, plan, end), soften)
            spent += trial.iterations
            self.refuse_the_absurd(c, trial)
            if trial.converged:
                return self.commit(state, plan, c, trial, spent, cutbacks)
            self.say(state, plan, end, trial, "rejected", trial.reason)
            dt = CUT * (end - now)
            if cutbacks == self.numerics.max_cutbacks or dt < SHORTEST * (plan.t1 - plan.t0):
                raise SolveError(self.post_mortem(plan, c, trial, cutbacks), self.last)
            cutbacks += 1

    def attempt(self, c: Circumstances, origin: Array, report: Reporter, soften: bool) -> Trial:
        """Outcome of one attempt, on the condensed system where there is one."""
        if self.condensed is not None:
            return self.condensed.attempt(attempt, c, origin, self.numerics, report, soften)
        assert self.reduced is not None
        return attempt(self.system, c, self.reduced, origin, self.numerics, report, soften)

    def refuse_the_absurd(self, c: Circumstances, trial: Trial) -> None:
        """Equilibrium is not enough: no element may be folded over, no point may flow by more than `ABSURD` at once.

        A corner of 180° is no fold: a free side that rolls onto a die makes such elements, and they answer well. A corner
        that passes 180° little by little slides past a support that has no contact: that is told, not refused. One that
        jumps there in a single increment belongs to another, impossible solution.
        """
        if not trial.converged or trial.evaluation is None:
            return
        if through := passed_through(self.system, c.state, trial.u):
            trial.converged, trial.reason = False, through
            return
        if loose := let_go(self.system, c, trial.evaluation):
            trial.converged, trial.reason = False, loose
            return
        if self.system.problem.kinematics == "small":
            return
        x, x_n = self.system.positions(trial.u), c.x_n
        for block, new, was in zip(self.system.blocks, trial.evaluation.history, c.state.history):
            corners = block.corners.T
            corner = _least_corner(x.take(corners, axis=0))
            worst = int(np.argmin(corner))
            if corner[worst] < FOLDED:
                at = self.system.X[block.cells[worst]].mean(axis=0)
                where = f"element {worst} of {block.body} (initially near {at[0]:.4g}, {at[1]:.4g})"
                if corner[worst] < _least_corner(x_n[corners[:, [worst]]])[0] - JUMP:
                    trial.converged, trial.reason = False, f"{where} folded over"
                    return
                if not self.told_of_folding:
                    self.told_of_folding = True
                    log.warning(
                        "%s folds over itself: a free side slides past its support; make it part of a contact surface",
                        where,
                    )
            if not block.law.plastic:
                continue
            growth = new[..., 4] - was[..., 4]
            if growth.max() > ABSURD:
                worst = int(np.argmax(growth)) // growth.shape[1]
                at = self.system.X[block.cells[worst]].mean(axis=0)
                trial.converged = False
                trial.reason = (
                    f"element {worst} of {block.body} (initially near {at[0]:.4g}, {at[1]:.4g}) flowed by "
                    f"{growth.max():.2g} in one increment: it collapses"
                )
                return

    def first_dt(self, plan: StepPlan) -> float:
        return self.longest if plan.increments or self.forgets(plan) else min(AUTO_FIRST, self.longest)

    def longest_in(self, plan: StepPlan) -> float:
        """Longest increment of a step: the one that was asked for, or what the tools' travel allows."""
        return (plan.t1 - plan.t0) / plan.increments if plan.increments else self.travel_limit(plan)

    def forgets(self, plan: StepPlan) -> bool:
        """Whether the answer does not depend on the way to it: elastic bodies without friction."""
        return not self.system.has_memory and all(self.system.frictionless(f) for f in plan.friction)

    def travel_limit(self, plan: StepPlan) -> float:
        """Duration in which no prescribed tool moves more than a share of the contact element size.

        A turn moves the tool by its angle times the distance of the farthest contact point from the reference point. Where the
        way does not matter, only the share of the step is bounded.
        """
        limit = LONGEST
        if self.forgets(plan):
            return limit
        t = np.linspace(plan.t0, plan.t1, 65)
        path = np.array([plan.motion(ti) for ti in t])
        for s in self.system.surfaces:
            first = self.system.tool_dof(s.tool)
            arm = self.system.X[s.points.nodes] - self.system.tools[s.tool].at
            reach = np.array([1.0, 1.0, float(np.hypot(*arm.T).max())])
            own = (plan.moved >= first) & (plan.moved < first + 3)
            way = reach[plan.moved[own] - first] * np.abs(np.diff(path[:, own], axis=0))
            speed = float(way.max(initial=0.0)) / (t[1] - t[0])
            if speed > 0:
                limit = min(limit, TRAVEL * float(s.points.depth.min()) / speed)
        return limit

    def target(self, plan: StepPlan, now: float, dt: float) -> float:
        """End of the next increment: now + dt, but never beyond a grid time, a corner of a table, or the step's end."""
        stops = [plan.t1, *plan.corners()]
        if plan.increments:
            grid = plan.t0 + np.arange(1, plan.increments + 1) / plan.increments * (plan.t1 - plan.t0)
            stops += grid[grid > now + 1e-9].tolist()[:1]
        stop = min(s for s in stops if s > now + 1e-9 * (plan.t1 - plan.t0))
        # no slivers: what is left just beyond the increment is taken along or halved
        left = stop - now
        if dt >= left * (1 - 1e-9):
            return float(stop)
        return now + (0.5 * left if dt > 0.5 * left else dt)

    # ------------------------------------------------------------------------------------------------------- commit
    def commit(
        self, old: State, plan: StepPlan, c: Circumstances, trial: Trial, spent: int, cutbacks: int
    ) -> tuple[State, Increment]:
        assert trial.evaluation is not None
        e = trial.evaluation._replace(data=None)  # increments that are kept must not keep their matrices
        system = self.system
        contact, lam = old.contact.copy(), trial.lam.copy()
        for s, f in zip(system.surfaces, e.contacts):
            contact[s.rows] = np.stack([f.t, f.kappa, f.s, (f.p > 0).astype(float)], axis=1)
            lam[s.rows, 0], lam[s.rows, 1] = f.p, f.t
        work = e.f_ext.copy()
        work[plan.fixed] += system.collected(e.r)[plan.fixed]
        energy = self.ledger(old, c, trial, e, work)
        ended, du = c.time >= plan.t1, trial.u - old.u
        if ended and trial.recover is not None:  # the next step may need unknowns that this one does not
            trial.u, trial.recover = trial.recover(), None
        step, anchor = (plan.number + 1, trial.u) if ended else (plan.number, old.anchor)
        dt = 0.0 if ended else self.next_dt(old, plan, c, e, trial, cutbacks)
        bend, trust = old.bent(du, c.dt, system.nodes)
        number = old.clock[1] + 1
        state = State(
            u=trial.u, du=du, dt_last=0.0 if ended else c.dt, bend=bend, history=e.history, contact=contact, lam=lam,
            energy=energy, work=work, clock=np.array([step, number, c.time, dt, trust]), anchor=anchor,
        )  # fmt: skip
        increment = self.increment(state, plan, e, trial, spent, cutbacks, ended)
        if ended:
            self.warn(doubts(system, c, e, trial.residual, self.numerics.tolerance))
        self.say(state, plan, c.time, trial, "accepted", "", forces={k: t.force for k, t in increment.tools.items()})
        return state, increment

    def next_dt(
        self, old: State, plan: StepPlan, c: Circumstances, e: Evaluation, trial: Trial, cutbacks: int
    ) -> float:
        """Duration of the next increment from what this one cost."""
        full = self.longest
        tried = c.dt if cutbacks else max(c.dt, float(old.clock[3]))
        growth = 1.0 if cutbacks else 2.0 if trial.iterations <= TARGET else 1.0
        if not plan.increments:
            growth = (
                1.5
                if trial.iterations <= EASY and not cutbacks
                else min(growth, 1.0)
                if trial.iterations <= TARGET + 3
                else 0.7
            )
            grown = zip(self.system.blocks, e.history, old.history) if self.system.has_memory else ()
            strain = max(
                (
                    float(np.quantile(new[..., 4] - was[..., 4], SPREAD))
                    for block, new, was in grown
                    if block.law.plastic
                ),
                default=0.0,
            )
            if strain > 0:
                full = min(full, tried * max(PLASTIC / strain, 0.1))
        # shorter increments are easier or better up to a point; beyond, they would not end
        least = min(LEAST * (plan.t1 - plan.t0), self.longest)
        if 0 < tried < least:
            return min(least, (1.0 if cutbacks else 2.0) * tried)
        return max(min(full, growth * (tried if tried > 0 else full)), least)

    def ledger(self, old: State, c: Circumstances, trial: Trial, e: Evaluation, work: Array) -> Array:
        """External, elastic, plastic, friction, contact energies and their imbalance after the increment."""
        energy = old.energy.copy()
        energy[0] += 0.5 * float((old.work + work) @ (trial.u - old.u))
        energy[1] = self.system.elastic_energy(e.history)
        energy[2] = self.system.plastic_work(e.history)
        for s, f in zip(self.system.surfaces, e.contacts):
            was = old.contact[s.rows]
            energy[3] += float((f.area * 0.5 * (np.abs(was[:, 0]) + np.abs(f.t)) * (f.kappa - was[:, 1])).sum())
        energy[4] = self.system.contact_energy(e.contacts, c.scales)
        for dof, (stiffness, _) in c.plan.springs.items():
            # work[dof] is the force of a spring: what it stores, and with that the work done at its mount
            was, now = 0.5 * old.work[dof] ** 2 / stiffness, 0.5 * work[dof] ** 2 / stiffness
            energy[0] += now - was
            energy[1] += now
        energy[5] = energy[0] - energy[1:5].sum()
        return energy

    # ------------------------------------------------------------------------------------------------------- saying
    def increment(
        self, state: State, plan: StepPlan, e: Evaluation, trial: Trial, spent: int, cutbacks: int, ended: bool
    ) -> Increment:
        names = ("external", "elastic", "plastic", "friction", "contact", "imbalance")
        statistics = Statistics(
            spent, cutbacks, trial.residual, trial.augmentations, tuple(trial.residuals), tuple(trial.changes)
        )
        system, recover = self.system, trial.recover

        @cache
        def whole() -> State:
            return state if recover is None else replace(state, u=recover())

        def bodies() -> dict[str, BodyState]:
            return body_states(system, whole(), e, plan)

        return Increment(
            plan.name, plan.number + 1, int(state.clock[1]), float(state.clock[2]), tool_states(system, state, e),
            dict(zip(names, state.energy.tolist())), support_forces(system, e, plan), statistics, ended,
            whole, lambda: contact_states(system, whole(), e), bodies,
        )  # fmt: skip

    def reporter(self, state: State, plan: StepPlan, end: float) -> Reporter:
        def iteration(trial: Trial, e: Evaluation) -> None:
            if self.watched:
                self.say(state, plan, end, trial, "iteration", "", forces=tool_forces(self.system, e))

        return Reporter(iteration, self.timer)

    def say(
        self, state: State, plan: StepPlan, t: float, trial: Trial, event: str, message: str, forces: Any = None
    ) -> None:
        if event == "rejected":
            log.info("increment to time %.6g rejected: %s", t, message)
        residual = trial.residual if event == "accepted" else trial.residuals[-1] if trial.residuals else np.nan
        self.monitor(
            Progress(
                plan.name, plan.number + 1, int(state.clock[1]) + (event != "accepted"), t, float(len(self.system.problem.steps)),
                trial.iterations, residual, forces or {}, event, message,
            )
        )  # fmt: skip

    def warn(self, sentences: Iterator[str]) -> None:
        for sentence in sentences:
            log.warning("%s", sentence)

    def note(self, state: State, plan: StepPlan, message: str) -> None:
        log.info(message)
        self.monitor(
            Progress(
                plan.name,
                plan.number + 1,
                int(state.clock[1]) + 1,
                float(state.clock[2]),
                float(len(self.system.problem.steps)),
                0,
                np.nan,
                {},
                "note",
                message,
            )
        )

    def post_mortem(self, plan: StepPlan, c: Circumstances, trial: Trial, cutbacks: int) -> str:
        """What failed, where, why, and what to try."""
        small = self.condensed.last if self.condensed is not None else None
        reduced = self.reduced if small is None else small
        assert reduced is not None
        if "free to move" not in trial.reason and (loose := leaning(self.system, c)):
            trial.reason = loose  # whatever came of it
        place = where(self.system if small is None else small.system, c, reduced, trial)
        last = (
            f"The last good state is that of time {self.last.time:.6g} (increment {self.last.number})." if self.last else
            "No increment of this run had converged before."
        )  # fmt: skip
        cut = f"The increment was cut {cutbacks} times without success."
        if cutbacks < self.numerics.max_cutbacks:
            cut += " It is too short by now for another cut: the body jumps here, or nothing can go on."
        return (
            f"step {plan.name!r}, time {c.time:.6g}: {trial.reason}{'; ' + place if place else ''}. {cut} {last} "
            f"What to try: {hint(trial.reason)}."
        )
