"""One increment: its equations, from where it is attempted, and what is made of the outcome.

A context says what the increment is; tools and bodies that nothing resists are brought to where they touch; an attempt is
Newton's and what follows if that fails (`prensa.solver.attempt`); an outcome may be refused by checks or for its stability. The
increment is then committed, or cut, by `prensa.solver.time_stepping`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from prensa.checks.run import RunChecks
from prensa.linear.condensation import Condensation, condensed
from prensa.linear.reduction import Reduced
from prensa.linear.rigid_modes import Loose, leaves_free, loose_bodies
from prensa.linear.threads import threads_of
from prensa.model import problem as model
from prensa.policy import Policy
from prensa.solver.approach import Approach, approach_of_bodies, approach_of_tools, first_clamped
from prensa.solver.attempt import attempt, attempt_from
from prensa.solver.commit import fresh_mesh
from prensa.solver.equilibrium import Equilibrium, Reporter
from prensa.solver.first_matrix import Ahead
from prensa.solver.reporting import Messages
from prensa.solver.stabilisation import Stabilisation
from prensa.solver.stability import judged
from prensa.solver.step_control import StepControl
from prensa.solver.until import Outcome
from prensa.system.interaction import Context
from prensa.system.matrix_symmetry import is_symmetric
from prensa.system.outcome import NewtonResult
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.system import System
from prensa.system.time_integration import BACKWARD_EULER, TimeRule, all_follow
from prensa.timer import Timer
from prensa.types import Array


class IncrementSolver:
    """Solves increments of a system, one at a time; ``condense``: whether linear bodies are condensed.

    ``times``: ends of all increments, where they are given; ``remeshes``: whether meshes are made anew in the run.
    """

    def __init__(
        self, system: System, numerics: model.Numerics, policy: Policy, messages: Messages, timer: Timer, condense: bool
    ) -> None:
        self.system, self.numerics, self.policy = system, numerics, policy
        self.messages, self.timer, self.condense = messages, timer, condense
        self.threads = threads_of(numerics, system.ndof, policy)
        self.checks, self.stabilisation = RunChecks(system, policy), Stabilisation(system, policy)
        self.reduced: Reduced | None = None
        self.ahead: Ahead | None = None  # who makes the matrix of the first step meanwhile
        self.condensed: Condensation | None = None
        self.loose: list[Loose] = []  # bodies that the supports of the step leave free to move, in the plane
        self.unheld = False  # whether there are any, in space too
        self.remeshes = False
        self.times: Array | None = None

    def prepare(self, plan: StepPlan) -> None:
        """The bodies that a step leaves free, and its matrix: that of the step before where the same dofs are prescribed."""
        self.loose, self.unheld = loose_bodies(self.system, plan), leaves_free(self.system, plan)
        if self.condense:
            with self.timer("condensation"):
                self.condensed = condensed(self.system, plan, self.numerics, self.condensed, self.policy)
        if self.condensed is not None:
            return
        if self.ahead is not None:
            self.reduced, self.ahead = self.ahead.matrix(), None
        # By structure: a measured symmetry could change from iteration to iteration, and the analysis with it (chapter 9).
        symmetric, reduced = is_symmetric(self.system, plan), self.reduced
        same = reduced is not None and reduced.symmetric == symmetric and reduced.control == plan.control
        if reduced is None or not same or not np.array_equal(reduced.fixed, plan.fixed):
            self.reduced = Reduced.of(self.system, plan.fixed, self.numerics, symmetric, self.policy, plan.control)

    def context(self, state: State, plan: StepPlan, end: float, rule: TimeRule = BACKWARD_EULER) -> Context:
        """Everything that an increment from a state to the time ``end`` needs, with plastic flow by a ``rule``."""
        c = self.system.context(state, plan, end, rule)
        viscous = self.stabilisation.forces(c)
        by_parts = self.reduced is not None and self.reduced.part is not None
        picard_friction, interactions = self.numerics.iteration == "paper", [*c.interactions, *viscous]
        return replace(
            c, picard_friction=picard_friction, interactions=interactions, threads=self.threads, preconditioned=by_parts
        )

    def rule(self, state: State, plan: StepPlan, end: float) -> TimeRule:
        """How plastic flow goes on from a state to the time ``end``, unless the increment is cut.

        By backward Euler where what is prescribed turns back or stops: all flow of the last increment may end there at once;
        and, unless second order is asked for, where points go on to begin and end to flow.
        """
        now, last = state.clock.time, state.dt_last
        if not last > 0.0 or not self.second_order(plan) or plan.reverses(now - last, now, end):
            return BACKWARD_EULER
        if self.numerics.time_rule == "auto" and state.clock.unsteady * (end - now) > self.policy.unsteady_share:
            return BACKWARD_EULER
        # BDF2 only where flow is steady: a wire came out of its die 0.23 % too thin with it throughout (chapter 7).
        return TimeRule.of(end - now, last)

    def second_order(self, plan: StepPlan) -> bool:
        """Whether plastic flow is of second order in time in a step, where it is steady: by itself not in a number of increments.

        They may be many times as long as automatic ones: flow turns far in them. Given times are often those of another run.
        Nor by itself on meshes that are made anew: their metal goes round corners of tools, for which such lengths are too long.
        """
        # 77 of 80 verification cases passed with second order everywhere; the other three are of remeshed metal (chapter 7).
        asked = self.numerics.time_rule == "bdf2" or (self.remeshes and self.numerics.time_tolerance is not None)
        if not asked and (plan.increments or self.remeshes):
            return False
        return self.numerics.time_rule != "backward_euler" and all_follow(self.system.blocks)

    def most_cutbacks(self, state: State) -> int:
        """How often an increment may be cut: more often where viscous forces give any an answer that is short enough."""
        if self.times is not None:
            return 0
        if self.remeshes and not fresh_mesh(state):
            return min(self.policy.remesh_after_cuts, self.numerics.max_cutbacks)
        jumps = self.policy.extra_jump_cuts if self.numerics.max_cutbacks and state.stability.viscosity > 0 else 0
        return self.numerics.max_cutbacks + jumps

    def solved(
        self, state: State, plan: StepPlan, control: StepControl, cutbacks: int, spent: list[int], end: float
    ) -> Outcome:  # fmt: skip
        """Context and outcome of one attempt at the increment to a time, its stability judged; spent: gets its iterations."""
        # where an increment was cut, flow begins or turns, of which the last one knows nothing
        c = self.context(state, plan, end, BACKWARD_EULER if cutbacks else self.rule(state, plan, end))
        to = approach_of_bodies(self.system, c, self.loose, self.policy) if self.loose and self.condensed is None else None
        if to is not None:
            found = self.carry(c, to, cutbacks) if to.u is not None else None
            if found is not None:
                spent.append(found[1].iterations)
                return found
            c = replace(c, floating=to.bodies if to.floating else ())
        brought = approach_of_tools(self.system, c, self.policy)
        start, air = brought.u, brought.through_air
        assert start is not None
        if air is not None:
            c = replace(self.system.through_air(c, air), brought_into_contact=True)
        for message in brought.notes:
            self.messages.note(state, plan, message)
        most = self.most_cutbacks(state)
        retry = cutbacks >= min(self.policy.retry_after_cuts, self.numerics.max_cutbacks, most)
        result = self.attempt(c, start, retry, uncut=not cutbacks)
        if not result.converged and c.rule.share and (plan.increments or self.times is not None):
            # before an increment that was asked for is cut: backward Euler damps more
            spent.append(result.iterations)
            again = self.system.through_air(self.context(state, plan, end), air)
            c = replace(again, brought_into_contact=c.brought_into_contact, floating=c.floating)
            result = self.attempt(c, start, retry)
        if refusal := self.checks.refusal(c, result):
            result.converged, result.reason = False, refusal
        if self.condensed is None and not c.floating:  # linear bodies are stable, and those that nothing holds are neither
            last = cutbacks == most or control.exhausted(control.cut(c.dt))
            result = judged(self.equilibrium(c), result, self.checks, self.stabilisation, cutbacks, not last)
        spent.append(result.iterations)
        return c, result

    def carry(self, c: Context, to: Approach, cutbacks: int) -> Outcome | None:
        """Outcome of an increment from where bodies that nothing holds have been carried; None if no equilibrium is near.

        It ends where they first meet what stops them.
        """
        state, plan = c.state, c.plan
        if not to.floating and self.times is None:
            met = first_clamped(self.system, c, self.loose, self.policy)
            if met is not None:
                who = " and ".join(to.bodies)
                self.messages.note(state, plan, f"{who}, moving as a rigid body, was stopped at time {met.time:.6g}")
                c, to = replace(self.context(state, plan, met.time), touches=True), met.there
        c = self.system.through_air(c, to.through_air)
        c = replace(c, brought_into_contact=True, floating=to.bodies if to.floating else ())
        assert to.u is not None
        eq = self.equilibrium(c, uncut=not cutbacks)
        result = attempt_from(eq, to.u)
        if refusal := self.checks.refusal(c, result):
            result.converged, result.reason = False, refusal
        if result.converged and not to.floating:
            result = judged(eq, result, self.checks, self.stabilisation, cutbacks, False)
        return (c, result) if result.converged else None

    def equilibrium(self, c: Context, uncut: bool = False) -> Equilibrium:
        """The equations of an increment, condensed where the bodies are; ``uncut``: at the first attempt at it."""
        iteration = partial(self.messages.iteration, c.state, c.plan, c.time)
        report = Reporter(iteration, self.timer)
        reduced = self.reduced if self.condensed is None else self.condensed.reduced
        assert reduced is not None
        # a far step may release a body that only contact holds: once one has failed, steps are those of the tangent
        far = self.system.has_memory and (uncut or not self.unheld)
        return Equilibrium(self.system, c, reduced, self.numerics, self.policy, report, far)

    def attempt(self, c: Context, start: Array, was_cut: bool, uncut: bool = False) -> NewtonResult:
        """Outcome of one attempt, on the condensed system where there is one."""
        eq = self.equilibrium(c, uncut)
        if self.condensed is None:
            return attempt(eq, start, was_cut)
        return self.condensed.attempt(
            lambda reduced: attempt(replace(eq, reduced=reduced), start, was_cut), c, start, self.timer
        )
