"""r(u) = 0 at the end of one increment: what an attempt works on, with what, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Unpack

import numpy as np

from prensa.linear.reduction import Reduced
from prensa.model import problem as model
from prensa.policy import Policy
from prensa.system.failure import Failure, Runaway, ToolRunaway
from prensa.system.interaction import Context, Overrides
from prensa.system.outcome import NewtonResult
from prensa.system.system import Evaluation, System
from prensa.types import Array, Bytes, Flags

Signature = Bytes


class Reporter(NamedTuple):
    """Callbacks of an attempt: ``iteration(result, evaluation)``; ``timed(section)`` context manager."""

    iteration: Callable[[NewtonResult, Evaluation], None]
    timed: Callable[[str], Any]


@dataclass(frozen=True)
class Equilibrium:
    """The equations of an increment and the means to solve them. Nothing of it changes during an attempt."""

    system: System
    context: Context
    reduced: Reduced
    numerics: model.Numerics
    policy: Policy
    report: Reporter
    may_go_far: bool = False
    """Whether bodies may flow, and steps may go far: supports hold each of them, or no attempt at the increment has failed."""
    keeps_matrix: bool = False
    """Whether the matrix at the solution is wanted: evaluations that are likely to be the last make it."""

    def evaluate(
        self, u: Array, lam: Array, stiffness: bool = True, section: str = "assembly", **overrides: Unpack[Overrides]
    ) -> Evaluation:  # fmt: skip
        """Residual and, with ``stiffness``, its derivative; ``overrides``: see `prensa.system.interaction.Request`."""
        with self.report.timed(section):
            return self.reduced.assembly.evaluate(self.context, u, lam, stiffness, **overrides)

    @property
    def globalised(self) -> bool:
        """Whether line search and the other globalisation measures are allowed: they are Newton's."""
        return self.numerics.line_search and self.numerics.iteration != "paper"

    @cached_property
    def tools_are_moved(self) -> bool:
        """Whether all motions of all tools are prescribed: none is pushed, free or hung on a spring."""
        tools, fixed = self.system.dofs.tool.slice, self.reduced.fixed
        given = np.count_nonzero((fixed >= tools.start) & (fixed < tools.stop))
        return bool(given == tools.stop - tools.start) and self.reduced.control is None

    def norm(self, e: Evaluation) -> float:
        """Sum of the absolute free residuals; infinite where the residual could not be evaluated."""
        return np.inf if e.failed else self.reduced.norm(e.r)

    def flow_direction_unreliable(self, relative: float, first: bool) -> bool:
        """Whether an iterate with such a ``relative`` residual is so far off that directions of flow are likely to be wrong.

        Where a node lands, the velocities behind it turn at once. The tangent at what was extrapolated resists a change of
        stress across the flow alone and leads far beyond; a part of the way to the secant moduli, whose steps never raise the
        plastic work (Kačanov), is taken there. The last steps are Newton's. Bodies that nothing but contact holds are left to the
        tangent once an increment was cut: far steps may release them. ``first``: of the iterates, which was extrapolated.
        """
        policy = self.policy
        limit = policy.unreliable_flow_first if first else policy.unreliable_flow_later
        if self.context.rule.share:
            limit = policy.unreliable_flow_second_order if first else limit
            # in long increments flow turns in few elements too, whose share of all forces falls with their size
            few = policy.unreliable_flow_elements
            limit *= max(few / max(sum(len(b) for b in self.system.blocks), few), policy.min_unreliable_flow_ratio)
        return self.may_go_far and relative > limit

    @property
    def secant(self) -> float:
        """How far the matrix goes from the tangent to the secant moduli where flow turns."""
        return self.policy.secant_share_second_order if self.context.rule.share else self.policy.secant_share

    def runaway(self, change: Array) -> Failure | None:
        """Why a change of the dofs (ndof,) is too large to be meant: what is free to move; None if it is not."""
        system, policy = self.system, self.policy
        if max(change.max(initial=0.0), -change.min(initial=0.0)) <= min(policy.max_displacement_ratio * system.length,
            policy.max_rotation):
            return None
        change = change.copy()
        change[self.reduced.fixed] = 0.0
        far = policy.max_displacement_ratio * system.length
        motions, d = np.abs(system.dofs.tool.of(change)), system.dofs.dimension
        limits = np.where(np.arange(motions.shape[1]) < d, far, policy.max_rotation)
        beyond = (motions > limits).any(axis=1)
        if beyond.any():
            t = int(np.argmax(beyond))
            motion = motions[t]
            turns = (motion[d:] > policy.max_rotation).any()
            worst = d + int(np.argmax(motion[d:])) if turns else d - 1 - int(np.argmax(motion[:d][::-1]))
            return ToolRunaway(system.tools[t].name, system.dofs.tool.components[worst])
        return Runaway() if np.abs(change[system.dofs.displacement.slice]).max(initial=0.0) > far else None


def signature(e: Evaluation) -> Signature:
    """Status of all contact points: 0 open, 1 stick, 2 … 9 slip along an eighth of a turn; 2 along +, 6 along − in the plane."""
    if not e.contacts:
        return np.zeros(0, dtype=np.int8)
    return np.concatenate([np.where(f.p > 0, np.where(f.slip, 2 + f.way, 1), 0) for f in e.contacts]).astype(np.int8)


def reversed_slip(before: Signature | None, now: Signature) -> Flags:
    """Points that slip one way in one signature and the opposite way, by more than a right angle, in the other."""
    if before is None:
        return np.zeros(len(now), dtype=bool)
    return (before >= 2) & (now >= 2) & (np.abs((now - before + 4) % 8 - 4) >= 3)
