"""A whole run: the loop of `prensa.solve` without derivatives. What there is to say of a problem before, then its increments."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from prensa.checks.after.passages import Passages
from prensa.checks.before.preflight import preflight
from prensa.conduction import Conduction
from prensa.errors import ArgumentError, refuse, take
from prensa.linear.condensation import to_be_condensed
from prensa.linear.threads import threads_of
from prensa.model import problem as model
from prensa.model.plausibility import warnings_of
from prensa.model.remeshing import remeshing_of
from prensa.policy import Policy
from prensa.remeshing.driver import Remeshing
from prensa.result.increment import Increment, Monitor
from prensa.solver.finer_contact import missed_on_finer
from prensa.solver.first_matrix import Ahead
from prensa.solver.reporting import Messages
from prensa.solver.time_stepping import TimeStepping
from prensa.system.discretise import discretise
from prensa.system.state import State
from prensa.system.symmetry_planes import guard_of, system_of
from prensa.system.system import System
from prensa.timer import Timer

log = logging.getLogger("prensa")


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
) -> Iterator[Increment]:
    """Yield the converged increments of a problem, in order.

    ``start`` continues from a committed state; ``monitor`` is called at every iteration; ``timer`` collects seconds by
    section; ``policy``: the constants of the solver, for studies; ``passages``: what has passed through the contacts before
    ``start``, of which means over a passage are taken. ``times``: the ends of all increments, among them those of the steps
    (step number k, from 0, is the time from k to k + 1); none is cut then. ``stops``: times at which an increment ends, among
    those that are chosen.

    Raises
    ------
    PrensaError
        For a description that cannot be discretised; `SolveError` when an increment does not converge after all cut-backs.

    """
    check_arguments(problem, numerics, start, monitor, timer, policy)
    system = problem if isinstance(problem, System) else discretise(problem)
    base = system
    numerics, policy = numerics or model.Numerics(), policy or Policy()
    if words := model.why_not(numerics.solver, system.problem):
        raise ArgumentError(f"solve: {words}")
    threads = threads_of(numerics, system.ndof, policy)
    numerics = replace(numerics, threads=threads)
    ahead = Ahead(system, numerics, policy) if start is None and threads > 1 else None
    if start is None:
        report_preflight(system)
    elif not belongs(start, system):
        system = system_of(start, system)
    condense, finer = to_be_condensed(system, numerics, policy), partial(missed_on_finer, numerics=numerics, policy=policy)
    timer, followed = timer or Timer(), passages or Passages(system)
    if passages is None and start is not None:
        followed.met.update(tool.name for tool in system.tools)  # before it, for all that is known
    state = start or system.initial()

    def stepping(system: System) -> TimeStepping:
        made = TimeStepping(system, numerics, policy, Messages(system, monitor), timer, condense)
        made.passages, made.remeshes = followed, remeshing_of(system.problem) is not None
        made.checks.between_nodes.on_finer = finer
        made.ahead = ahead if ahead is not None and ahead.system is system else None
        made.prescribe(state, times, stops)
        made.guard = None if made.remeshes or system is not base else guard_of(system)
        made.planes = list(system.problem.tools)[len(base.problem.tools) :]
        return made

    if remeshing_of(system.problem) is not None:
        return Remeshing(system, stepping, policy).run(state)
    increments, heat = stepping(system).run(state), system.problem.heat
    if heat is not None and start is not None:
        raise ArgumentError("solve: temperatures are not part of a state; solve a problem with heat from its beginning")
    return increments if heat is None else Conduction(base, heat).along(increments)


def report_preflight(system: System) -> None:
    """Refuse what cannot be solved, and log what there is to say of the rest, before a run."""
    for name, mesh in system.meshes.items():
        for note in mesh.notes:
            log.info("bodies.%s.mesh: %s", name, note)
    for name, tool in system.problem.tools.items():
        for note in tool.notes():
            log.info("tools.%s: %s", name, note)
    notices = preflight(system)
    refuse(notices)
    for words in warnings_of(system.problem):
        log.warning("%s", words)
    for notice in notices:
        log.log(logging.INFO if notice.seen_in_run else logging.WARNING, "%s", notice)


def check_arguments(
    problem: object, numerics: object, start: object, monitor: object, timer: object, policy: object
) -> None:
    """Refuse arguments of `solve` that are of a wrong kind."""
    if not isinstance(problem, System):
        take(
            "solve",
            "problem",
            problem,
            model.Problem,
            "give a Problem or what discretise makes of it (case.problem of a case, load(file).problem of a file)",
        )
    for name, value, kind in (
        ("numerics", numerics, model.Numerics),
        ("start", start, State),
        ("timer", timer, Timer),
        ("policy", policy, Policy),
    ):
        take("solve", name, value, (kind, type(None)), f"give a {kind.__name__} or None")
    if isinstance(start, State) and isinstance(problem, System) and not belongs(start, system_of(start, problem)):
        raise ArgumentError(
            f"solve: start has {len(start.u)} unknowns and the problem {problem.ndof}; they do not belong together"
        )
    if monitor is not None and not callable(monitor):
        take("solve", "monitor", monitor, type(None), "give a function of a Progress or None")


def belongs(state: State, system: System) -> bool:
    """Whether a state has the degrees of freedom of a system, on the meshes that it was on."""
    if state.remeshed is not None:
        known = list(state.remeshed.meshes) == list(system.meshes) and len(state.remeshed.tools) <= len(system.tools)
        return known and remeshing_of(system.problem) is not None
    return state.u.shape == (system.ndof,)
