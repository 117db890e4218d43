"""Runs with remeshing: when one is due, from which state, and equilibrium on it.

All that decides is in the committed state, so that a resumed run remeshes at the same places: a mesh is due or not before an
increment, and an increment that fails is one that fails again.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol, Unpack

import numpy as np

from prensa.errors import PrensaError, SolveError
from prensa.linear.reduction import Assembly
from prensa.mesh.sizes import SizeField, coarseness, least_at_tools, mismatch
from prensa.model.problem import tools_removed
from prensa.model.remeshing import remeshing_of
from prensa.policy import Policy
from prensa.remeshing.renewal import check_mesher, least_shape, present_plan, renewed
from prensa.remeshing.transfer import with_flow
from prensa.result.energy_balance import nodal_work
from prensa.result.increment import Increment
from prensa.solver.attempt import attempt, attempt_from
from prensa.solver.commit import fresh_mesh
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.reporting import Messages
from prensa.solver.rigid_balance import bisected
from prensa.solver.time_stepping import Due
from prensa.system.discretise import on_meshes
from prensa.system.element_sizes import section_area, size_field
from prensa.system.failure import BeyondSmall, FreeToMove, MetalInside, sentence
from prensa.system.interaction import ActiveSets, Context, Overrides, Part, Request, Response
from prensa.system.outcome import NewtonResult
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.symmetry_planes import Guard, Nearing, extended, guard_of, on_mesh_of, with_planes
from prensa.system.system import Evaluation, System
from prensa.types import Array, Flags, Index

log = logging.getLogger("prensa")


class RemeshingError(PrensaError):
    """A state that could not be brought onto a new mesh."""


class Stepping(Protocol):
    """The time stepping of a system, as `prensa.solver.time_stepping.TimeStepping`."""

    system: System
    policy: Policy
    messages: Messages
    last: Increment | None
    due: Due | None
    guard: Guard | None

    def run(self, state: State) -> Iterator[Increment]:
        """Increments from a state to the end of the last step."""

    def prepare(self, plan: StepPlan) -> None:
        """Make the matrix of a step."""

    def context(self, state: State, plan: StepPlan, end: float) -> Context:
        """The context of an increment."""

    def reported_folds(self, state: State) -> dict[str, tuple[Array, Flags]]:
        """By body: places (k, 2) of its outline in a state, and which of them (k,) lie in folds that were reported."""

    def know_folds(self, reported: dict[str, tuple[Array, Flags]], state: State) -> None:
        """Report no fold again that was reported on other meshes, from a state on."""

    def equilibrium(self, c: Context) -> Equilibrium:
        """The equations of an increment."""

    def timer(self, section: str) -> Any:
        """Context manager that counts the seconds of a section."""


class AtRest:
    """The assembly of a system whose metal answers elastically and whose contacts stick: in no time nothing flows or slides."""

    def __init__(self, assembly: Assembly, system: System) -> None:
        self.assembly = assembly
        # Contacts may open and close: held closed, some points would be in tension.
        flows = tuple(np.zeros(b.volume.size, dtype=bool) if b.law.plastic else None for b in system.blocks)
        self.active_sets, self.stick = ActiveSets((), flows), np.ones(sum(len(s.points) for s in system.surfaces), dtype=bool)

    def evaluate(
        self, c: Context, u: Array, lam: Array, stiffness: bool = True, **overrides: Unpack[Overrides]
    ) -> Evaluation:  # fmt: skip
        """See `Assembly`."""
        overrides |= {"active_sets": self.active_sets, "stick": self.stick}
        return self.assembly.evaluate(c, u, lam, stiffness, **overrides)

    def apply(self, data: Array, delta: Array) -> Array:
        """See `Assembly`."""
        return self.assembly.apply(data, delta)


@dataclass(frozen=True)
class Remainder:
    """A share of the forces (ndof,) that a state on a new mesh is out of balance by."""

    forces: Array
    share: float

    def couplings(self) -> list[Index]:
        """None: it has no stiffness."""
        return []

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        dofs = np.flatnonzero(self.forces)
        return Response([Part("remainder", dofs[:, None], self.share * self.forces[dofs, None])], external=True)


class Remeshing:
    """A run of a problem whose bodies are remeshed; ``base``: its system on the meshes of the description."""

    def __init__(self, base: System, make: Callable[[System], Stepping], policy: Policy) -> None:
        asked = remeshing_of(base.problem)
        assert asked is not None
        check_mesher()  # before anything is solved
        self.base, self.make, self.asked, self.policy = base, make, asked, policy
        self.bodies = [b.body for b in base.blocks if b.law.plastic]
        self.area = {body: section_area(base, body) for body in self.bodies}
        self.reported_full = False
        self.guard = guard_of(base)  # until planes stand at its lines

    def run(self, state: State) -> Iterator[Increment]:
        """Increments from a committed state to the end of the last step."""
        stepping = self._stepping(self.base if state.remeshed is None else on_meshes(self.base, state.remeshed))
        failures = 0
        self._watch(stepping, state)
        while True:
            if failures or (why := self.due(stepping.system, state)):
                why = "an increment failed" if failures else why
                stepping, state = self._on_new_meshes(stepping, state, why, failures)
            try:
                for increment in stepping.run(state):
                    state, failures = increment.state, 0
                    yield increment
                    if self.due(stepping.system, state):
                        break
                else:
                    return
            except Nearing as nearing:
                stepping.messages.note(state, present_plan(stepping.system, state), str(nearing))
                stepping, state = self._with_planes(stepping, state)
            except SolveError as error:
                failures += 1
                self._refuse_hopeless(state, error, failures)

    def _stepping(self, system: System) -> Stepping:
        """Time stepping on the meshes of a system, whose increments end where a tool has gone the way that is asked for."""
        stepping = self.make(system)
        if self.asked.when.travel != "auto":
            stepping.due = partial(self.due_at, system)
        return stepping

    # ------------------------------------------------------------------------------------------------------------ when
    def due_at(self, system: System, state: State, plan: StepPlan, until: float, reached: Array | None = None) -> float:
        """See `Due`."""
        now, tools, limit = state.clock.time, system.dofs.tool.slice, self._travel_limit(state)
        over = 1.0 + self.policy.due_tolerance
        if self._count(state) >= self.asked.at_most:
            return np.inf
        if reached is not None and self._travel(system, state, reached) <= over * limit:
            return np.inf

        def short(t: float) -> bool:
            u = state.u.copy()
            if reached is not None:
                u[tools] += (t - now) / (until - now) * (reached - u)[tools]
            elif state.dt_last > 0.0:
                u[tools] += state.extrapolated(t - now)[tools]
            u[plan.fixed] = plan.values(t)
            return self._travel(system, state, u) < limit

        times = np.linspace(now, until, self.policy.due_samples + 1)
        if not short(now) or (gone := next((k for k, t in enumerate(times[1:]) if not short(t)), None)) is None:
            return np.inf
        return bisected(short, float(times[gone]), float(times[gone + 1]))[1]

    def due(self, system: System, state: State) -> str:
        """Why a new mesh is due in a state, in words; '' if none is."""
        problem, step = system.problem, state.clock.step
        if step == len(problem.steps) or tools_removed(problem, step) or fresh_mesh(state):
            return ""  # the last shape needs no mesh, and nothing wears it out when the tools are gone
        why = self._why(system, state)
        if why and self._count(state) >= self.asked.at_most:
            if not self.reported_full:
                self.reported_full = True
                log.warning(
                    "the bodies have been remeshed %d times, no more are allowed ('at_most')", self._count(state)
                )
            return ""
        return why

    def _why(self, system: System, state: State) -> str:
        if state.clock.number == 0:
            return "the first mesh is too coarse" if self._too_coarse(system, state) else ""
        when, began = self.asked.when, 1.0 if state.remeshed is None else state.remeshed.shape
        # A mesh that had to begin with poor elements is worn by a share of what it had: else it would be due at once, again and
        # again.
        least = min(when.quality, self.policy.worn_shape_ratio * began)
        shape = least_shape(system, state.u, self.bodies)
        if shape < least:
            return f"shape measure {shape:.2f}"
        way, limit = self._travel(system, state, state.u), self._travel_limit(state)
        if when.travel == "auto":
            before = self._travel(system, state, state.u - state.du)
            # Looked at when the last increment passed a mark of travel. That follows from the committed state, so that a
            # resumed run looks, and remeshes, at the same increments.
            if way // limit == before // limit or not (reason := self._could_be_better(system, state, shape)):
                return ""
            return f"travel {way:.3g}, {reason}"
        return f"travel {way:.3g}" if way > (1.0 - self.policy.due_tolerance) * limit else ""

    def _could_be_better(self, system: System, state: State, shape: float) -> str:
        """What a new mesh would do better than one of a least ``shape``, in words; '' if it would be much like this one."""
        # A drop of the shape measure is no sign, for new meshes begin with 0.37 to 0.82; nor is the largest element over its
        # size, which is up to two at a bend on new meshes too.
        if shape < self.policy.good_shape:
            return f"shape measure {shape:.2f}"
        for missing, ratio in (mismatch(self._sizes(system, state, body)) for body in self.bodies):
            if missing > self.policy.missing_elements_share:
                return f"{missing:.0%} of the elements are missing"
            if ratio > self.policy.max_elements_ratio:
                return f"{ratio:.1f} times the elements that are needed"
        return ""

    @staticmethod
    def _count(state: State) -> int:
        return 0 if state.remeshed is None else state.remeshed.count

    def _too_coarse(self, system: System, state: State) -> bool:
        """Whether an element is much larger than what is asked for there."""
        return any(coarseness(self._sizes(system, state, b)).max() > self.policy.max_size_ratio for b in self.bodies)

    def _travel(self, system: System, state: State, u: Array) -> float:
        """Largest way of a tool from the last mesh to u (ndof,), of its reference point or by its turn at the farthest point."""
        then = 0.0 if state.remeshed is None else state.remeshed.tools
        way = np.abs(system.dofs.tool.of(u) - then)
        most = 0.0
        for s in system.tool_contacts:
            if s.body in self.bodies:
                master = system.tool_masters[s.against]
                reach = float(np.hypot(*(system.positions(u)[s.points.nodes] - master.at).T).max())
                x, y, turn = way[master.number]
                most = max(most, float(np.hypot(x, y) + reach * turn))
        return most

    def _travel_limit(self, state: State) -> float:
        """Way of a tool after which a mesh is due, or looked at."""
        travel = self.asked.when.travel
        if travel != "auto":
            return travel
        if state.remeshed is not None:
            return self.policy.travel_in_smallest_elements * state.remeshed.least
        return self.policy.travel_in_smallest_elements * self._least(self.base, self.base.initial())

    def _least(self, system: System, state: State) -> float:
        """Smallest size on the outlines that tools ask for."""
        return min(least_at_tools(self._sizes(system, state, body)) for body in self.bodies)

    def _refuse_hopeless(self, state: State, error: SolveError, failures: int) -> None:
        """Raise what ended a run if a new mesh does not help, or has not helped twice at the same place."""
        # No new mesh removes these: metal that is inside a tool, strains beyond small ones, a body that nothing holds.
        hopeless = isinstance(error.reason, MetalInside | BeyondSmall | FreeToMove)
        hopeless = hopeless or tools_removed(self.base.problem, state.clock.step)
        if hopeless or not self.asked.when.failure or self._count(state) >= self.asked.at_most:
            raise error
        if failures > len(self.policy.size_factors):
            raise SolveError(f"{error} New meshes have not helped here.", error.last, error.reason) from error

    # ------------------------------------------------------------------------------------------------ lines of symmetry
    def _watch(self, stepping: Stepping, state: State) -> None:
        """Let a time stepping look for free sides that come to a line of symmetry from a state on."""
        stepping.guard = None if self.guard is None else self.guard.on(stepping.system, state.u)

    def _with_planes(self, stepping: Stepping, state: State) -> tuple[Stepping, State]:
        """Time stepping and state with planes at the lines of symmetry, on this mesh and on those that follow."""
        assert self.guard is not None
        self.base, self.guard = with_planes(self.guard), None
        following = self._stepping(on_mesh_of(self.base, state))
        following.last, there = stepping.last, extended(state, stepping.system, following.system)
        following.know_folds(stepping.reported_folds(state), there)
        return following, there

    # ------------------------------------------------------------------------------------------------------------- how
    def _sizes(self, system: System, state: State, body: str, share: float = 1.0) -> SizeField:
        return size_field(system, state, body, self.asked.size, self.area[body], share)

    def _on_new_meshes(self, stepping: Stepping, state: State, why: str, failures: int) -> tuple[Stepping, State]:
        """Time stepping and state on new meshes; what they were where no new mesh can take the state."""
        problem = ""
        # Where the last mesh did not help, a finer one is tried: elements that fold are mostly too large for what bends there.
        for share in self.policy.size_factors[max(failures - 1, 0) :]:
            try:
                with stepping.timer("remeshing"):
                    following, there, balance = self._tried(stepping, state, share)
            except PrensaError as error:
                problem = str(error)
                log.info("no new mesh at time %.6g: %s", state.clock.time, problem)
                continue
            assert there.remeshed is not None
            self._watch(following, there)
            following.know_folds(stepping.reported_folds(state), there)
            elements = sum(len(m.cells) for m in there.remeshed.meshes.values())
            following.messages.note(
                there, present_plan(following.system, there), f"remeshing {there.remeshed.count} ({why}): {elements} elements, "
                f"shape measure {there.remeshed.shape:.2f}; {balance}",
            )  # fmt: skip
            return following, there
        log.warning("time %.6g: a new mesh was due (%s) and none could be had: %s", state.clock.time, why, problem)
        return stepping, state

    def _tried(self, stepping: Stepping, state: State, share: float) -> tuple[Stepping, State, str]:
        """Time stepping and state on meshes of ``share`` of the sizes asked for, and what there is to say of it."""
        system = stepping.system
        new, there = renewed(system, state, self.bodies, lambda body: self._sizes(system, state, body, share))
        assert there.remeshed is not None
        remeshed = replace(there.remeshed, least=self._least(new, there))
        following = self._stepping(new)
        following.last = stepping.last
        if state.clock.number == 0 and self.base.beginning is None:
            return following, replace(new.undeformed(), remeshed=remeshed), "undeformed"
        return following, *balanced(following, replace(there, remeshed=remeshed))


def balanced(stepping: Stepping, state: State) -> tuple[State, str]:
    """The state in equilibrium on its new mesh, by an increment in which nothing prescribed moves, and a remark on it.

    Nothing flows or slides. Where no such equilibrium is found, metal flows on the way to it; where Newton's iterations
    stagnate, what is out of balance is released in parts, and at last contact steps are allowed.

    Raises
    ------
    RemeshingError
        If there is no equilibrium nearby.

    """
    system, plan = stepping.system, present_plan(stepping.system, state)
    stepping.prepare(plan)
    now = state.clock.time
    dt = state.dt_last if state.dt_last > 0 else stepping.policy.first_share * (plan.t1 - plan.t0)
    at_rest = replace(state, clock=state.clock._replace(time=now - dt), du=0.0 * state.du, dt_last=0.0)
    eq = stepping.equilibrium(stepping.context(at_rest, plan, now))
    # In no time nothing flows or slides. With flow and friction Newton took 5 to 7 iterations here, and upsetting carried
    # 0.36 % less after a new mesh; at rest it takes one, for 0.008 %.
    in_no_time = replace(eq, reduced=replace(eq.reduced, assembly=AtRest(eq.reduced.assembly, system)))
    first = attempt_from(in_no_time, state.u)
    if not first.residuals:  # it could not be evaluated
        assert first.reason is not None
        raise RemeshingError(sentence(first.reason))
    result, how = first, ""
    if not result.converged:
        result, how = attempt_from(eq, state.u), ", with flow"
    if not result.converged:
        result, how = _released_in_parts(eq, state), ", released in parts"
    if not result.converged:
        result, how = attempt(eq, state.u, True), ", with contact steps"
    if not result.converged:
        assert result.reason is not None
        raise RemeshingError(f"the state finds no equilibrium on its new mesh: {sentence(result.reason)}")
    balance = f"out of balance by {first.residuals[0]:.1g}, {result.iterations} iterations{how}"
    return _committed(system, state, eq.context, result), balance


def _released_in_parts(eq: Equilibrium, state: State) -> NewtonResult:
    """Equilibrium from that with the forces added that are missing at first, which go in parts."""
    forces = eq.evaluate(state.u, eq.system.initial_multipliers(state), stiffness=False).r
    forces[eq.reduced.fixed] = 0.0
    for s in eq.system.surfaces:
        if s.multipliers is not None:  # equations of multipliers are no forces
            forces[s.unknowns] = 0.0
    u, result = state.u, None
    for share in eq.policy.release_stages:
        c = replace(eq.context, interactions=[*eq.context.interactions, Remainder(forces, share)])
        result = attempt_from(replace(eq, context=c), u)
        if not result.converged:
            return result
        u = result.u
    assert result is not None
    return result


def _committed(system: System, state: State, c: Context, result: NewtonResult) -> State:
    """The state in equilibrium: its clock, its last motion and flow, and what the loads have done are those before."""
    assert result.evaluation is not None
    e, contact, lam = result.evaluation, state.contact, result.lam.copy()
    for s, f in zip(system.surfaces, e.contacts):
        # An increment without duration has no speed of slip: laws that ask for it go on with that of the last one.
        was = state.contact.of(s.rows)
        contact = contact.replaced(s.rows, replace(f.record, speed=was.speed, time=was.time, path=was.path))
        lam[s.rows, 0], lam[s.rows, 1:] = f.p, f.t
    work, old = nodal_work(system, c, e), state.energy
    elastic, plastic = system.elastic_energy(e.history), system.plastic_work(e.history)
    elastic += sum(0.5 * float(work[dof]) ** 2 / stiffness for dof, (stiffness, _) in c.plan.springs.items())
    contacts = system.contact_energy(e.contacts, c.scales)
    spent = elastic + plastic + old.friction + contacts + old.viscous
    energy = old._replace(elastic=elastic, plastic=plastic, contact=contacts, imbalance=old.external - spent)
    ended = state.clock.step > 0 and state.clock.time <= state.clock.step
    # what flows on the way to equilibrium says nothing of the rate at which the metal flows
    history = tuple(with_flow(b, new, old) for b, new, old in zip(system.blocks, e.history, state.history))
    return replace(
        state, u=result.u, history=history, contact=contact, lam=lam, energy=energy, work=work,
        step_start=result.u if ended else state.step_start,
    )  # fmt: skip
