"""Progress of a run: log lines and signs of life for the monitor."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from typing import TypeVar

import numpy as np

from prensa.checks.check import Check, Refusal
from prensa.result.increment import Force, Increment, Monitor, Place, Progress
from prensa.result.results import tool_forces, tool_places
from prensa.system.failure import Failure, sentence
from prensa.system.outcome import NewtonResult
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.system import Evaluation, System

Given = TypeVar("Given")
log = logging.getLogger("prensa")


class Messages:
    """Messages of a run to the log and, if there is one, to the monitor."""

    def __init__(self, system: System, monitor: Monitor | None) -> None:
        self.system, self.monitor = system, monitor

    def iteration(self, state: State, plan: StepPlan, time: float, result: NewtonResult, e: Evaluation) -> None:
        """An iteration of the increment to a time; forces are summed only for somebody who looks."""
        if self.monitor is not None:
            forces = tool_forces(self.system, e)
            places = tool_places(self.system, result.u)
            self._notify(state, plan, time, "iteration", "", result.iterations, _last(result), forces, places, result.krylov)

    def rejected(self, state: State, plan: StepPlan, time: float, result: NewtonResult) -> None:
        """An attempt that failed."""
        assert result.reason is not None
        message = sentence(result.reason)
        log.info("increment to time %.6g rejected: %s", time, message)
        self._notify(state, plan, time, "rejected", message, result.iterations, _last(result), krylov=result.krylov)

    def accepted(self, old: State, plan: StepPlan, result: NewtonResult, increment: Increment) -> None:
        """An increment that is committed; old: the state that it started from."""
        forces = {name: tool.force for name, tool in increment.tools.items()}
        places = {name: tool.place for name, tool in increment.tools.items()}
        cost = increment.statistics.iterations
        self._notify(old, plan, increment.time, "accepted", "", cost, result.residual, forces, places, result.krylov)

    def note(self, state: State, plan: StepPlan, message: str) -> None:
        """Something that happened at the state's time."""
        log.info(message)
        self._notify(state, plan, state.clock.time, "note", message)

    def report(self, checks: Iterable[Check[Given]], given: Given) -> Failure | None:
        """Ask checks, one after the other, and log their warnings, up to the first finding that refuses it; its reason."""
        for check in checks:
            for finding in check(given):
                if isinstance(finding, Refusal):
                    return finding.reason
                log.warning("%s", finding)
        return None

    def warn(self, sentences: Iterable[str]) -> None:
        """What the solver itself says, in the log."""
        for words in sentences:
            log.warning("%s", words)

    def _notify(
        self, state: State, plan: StepPlan, time: float, event: str, message: str, iterations: int = 0,
        residual: float = np.nan, forces: Mapping[str, Force] | None = None, places: Mapping[str, Place] | None = None,
        krylov: int = 0,
    ) -> None:  # fmt: skip
        if self.monitor is not None:
            self.monitor(
                Progress(
                    plan.name, plan.number + 1, state.clock.number + 1, time, float(len(self.system.problem.steps)),
                    iterations, residual, forces or {}, event, message, places or {}, krylov,
                )
            )  # fmt: skip


def _last(result: NewtonResult) -> float:
    """Relative residual of the last iterate."""
    return result.residuals[-1] if result.residuals else np.nan
