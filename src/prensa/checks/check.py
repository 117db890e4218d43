"""The protocol of checks: what a check is given, and what it yields, before a run, at an increment and after a run.

A check is called with what there is to look at and yields findings (`prensa.errors.Finding`); it changes nothing in a run. One
that keeps something from increment to increment is an object with a method for each moment at which it looks. The checks of a
description are listed in `prensa.checks.before.preflight`, those of a run in `prensa.checks.run`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeVar

from prensa.errors import Finding, Severity
from prensa.result.folding import Outlined
from prensa.system.failure import Failure, sentence
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.symmetry_planes import Guard
from prensa.system.system import Evaluation
from prensa.types import Array

Given = TypeVar("Given", contravariant=True)


class Check(Protocol[Given]):
    """A check of what is ``given``: a `System` before a run, one of the classes below in a run."""

    def __call__(self, given: Given, /) -> Iterable[Finding]:
        """What there is to say of it; those who ask stop at the first finding that refuses it."""


@dataclass(frozen=True, kw_only=True)
class Refusal(Finding):
    """A finding that refuses an increment or ends the run, with its ``reason``."""

    reason: Failure


def warning(message: str) -> Finding:
    """A finding of a run that is reported."""
    return Finding("", message)


def cut_by(reason: Failure) -> Refusal:
    """A finding for which an increment is not accepted; shorter ones may be."""
    return Refusal("", sentence(reason), Severity.CUT, reason=reason)


def ended_by(reason: Failure) -> Refusal:
    """A finding that ends the run: no shorter increment would help."""
    return Refusal("", sentence(reason), Severity.REFUSE, reason=reason)


@dataclass(frozen=True)
class StepBegun:
    """The beginning of a step by its ``plan``, from a state at the end of the one before."""

    state: State
    plan: StepPlan


@dataclass(frozen=True)
class Attempted:
    """A converged attempt at an increment, which may be cut."""

    context: Context
    result: NewtonResult


@dataclass(frozen=True)
class Rejected:
    """An attempt at an increment that failed for a ``reason``; ``longest``: increment of the step."""

    context: Context
    reason: Failure
    longest: float


@dataclass(frozen=True)
class Solved:
    """An increment that is not cut any more, before it is committed.

    ``outlines``: those of the bodies, at degrees of freedom that are right there, where others are not yet computed;
    ``complete``: whether no degrees of freedom are missing, as those inside condensed bodies are before somebody asks for them;
    ``guard``: of planes of symmetry that free sides may come to.
    """

    context: Context
    result: NewtonResult
    outlines: Outlined
    complete: bool = True
    guard: Guard | None = None

    @cached_property
    def began(self) -> Outlined:
        """The outlines at its start."""
        system = self.outlines.system
        return Outlined(system, self.context.state.u, system.initial().u)

    def displacements(self) -> Array:
        """All degrees of freedom (ndof,)."""
        return self.result.u if self.result.recover is None else self.result.recover()


@dataclass(frozen=True)
class Committed:
    """A committed increment: the ``state`` that it led to, the evaluation there and the relative ``residual`` allowed."""

    context: Context
    state: State
    evaluation: Evaluation
    residual: float
    complete: bool = True


@dataclass(frozen=True)
class Finished:
    """A run at its end, or where tools are removed: tools that have ``touched`` something.

    ``planes``: tools that stand for planes of symmetry.
    """

    touched: Set[str]
    planes: Sequence[str] = ()


@dataclass(frozen=True)
class Failed:
    """An increment that failed for good, for a ``reason``."""

    context: Context
    reason: Failure
