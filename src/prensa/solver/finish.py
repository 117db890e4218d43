"""Finishing substitutions: a nearly converged iterate is converged to the last digits with the factors at hand.

That costs next to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.solver.equilibrium import Equilibrium
from prensa.system.system import Evaluation
from prensa.types import Array


@dataclass
class Finish:
    """An iterate that is converged to the last digits with the factors at hand.

    ``rate``: ratio of its last two residuals; ``factorisations`` that it took.
    ``stalled``: a substitution no longer lowered the residual.
    """

    u: Array
    evaluation: Evaluation
    norm: float
    rate: float = 0.0
    factorisations: int = 0
    stalled: bool = False

    def fine(self, eq: Equilibrium) -> bool:
        """Whether nothing is left to improve: residual and, with exact enforcement, constraints."""
        e, policy = self.evaluation, eq.policy
        if e.violation > policy.exact_gap_ratio:
            return False
        return not self.norm > policy.fine_residual * e.scale or (self.norm <= self.enough(eq) and self._sums_up(eq))

    def is_nearly_there(self, eq: Equilibrium) -> bool:
        """Whether another substitution is likely to be the last."""
        return self.norm * max(self.rate or eq.policy.expected_rate_last_step, eq.policy.expected_rate) <= self.enough(eq)

    def enough(self, eq: Equilibrium) -> float:
        """Sum of the absolute residuals below which only sums with signs matter, if tools are only moved; else what is fine.

        Tools that forces or springs drive find their place by what is left, multipliers are solved for with it.
        """
        policy, e = eq.policy, self.evaluation
        if eq.reduced.equations or not (eq.tools_are_moved and eq.context.driven_by_ways):
            return policy.fine_residual * e.scale
        usual = policy.fine_ratio_moved_tools * min(policy.fine_residual, eq.numerics.tolerance) * e.scale
        return max(min(usual, policy.contact_share_moved_tools * _pressed(e)), policy.fine_residual * e.scale)

    def _sums_up(self, eq: Equilibrium) -> bool:
        """Whether sums over all nodes have their digits: what is left adds up to hardly anything beside what contacts press."""
        e, restriction = self.evaluation, eq.reduced.restriction
        left = restriction.whole(restriction.part(e.r), len(e.r))
        missed = np.abs(eq.system.displacement(left).sum(axis=0)).max()
        return bool(missed <= eq.policy.sum_share_moved_tools * _pressed(e))

    def within(self, eq: Equilibrium) -> bool:
        """Whether the residual is within the tolerance, or is that of round-off."""
        return self.norm <= eq.numerics.tolerance * self.evaluation.scale or self.norm <= self.evaluation.floor

    def rounded_off(self, eq: Equilibrium) -> bool:
        """Whether round-off is all that is left: by its estimate, or near that where substitutions change nothing."""
        share = eq.policy.round_off_ratio_at_rest if self.stalled else 1.0
        return self.norm <= share * self.evaluation.floor

    @property
    def residual(self) -> float:
        """Relative residual."""
        return self.norm / self.evaluation.scale


def _pressed(e: Evaluation) -> float:
    """Sum of the forces with which contacts press."""
    return sum(float(np.abs(f.area * f.p).sum()) for f in e.contacts)


def finish(eq: Equilibrium, done: Finish, lam: Array, followed: float | None = None) -> tuple[Finish, bool]:
    """Improve a nearly converged iterate; whether it has converged. If not, Newton goes on from where it was.

    What is converged is improved further: the residual is summed over all nodes, so a tool's balance needs digits that the
    stop leaves open. ``followed``: part of the residual that a step with the matrix there promises to leave, if corrections go
    by that matrix.
    """
    fine = _substitute(eq, done, lam, followed)
    if not done.within(eq):
        return done, False
    e, policy = done.evaluation, eq.policy
    # round-off is estimated from above: a start that nobody has tried to improve may be better than that
    untried = not eq.reduced.factorisation.factored and done.norm > eq.numerics.tolerance * e.scale
    # Tool forces are sums over all nodes: finishing to the tolerance alone left them 8e-9 off (chapter 6).
    if untried or not (fine or done.rounded_off(eq)) or e.violation > policy.exact_gap_ratio:
        _refactor(eq, done, lam)
    return done, not done.evaluation.violation > policy.exact_gap_ratio


def _substitute(eq: Equilibrium, done: Finish, lam: Array, followed: float | None) -> bool:
    """Substitutions with the factors at hand as long as they are cheaper than a factorisation would be; whether all is fine."""
    policy, share = eq.policy, None
    if followed is not None and done.norm > 0:
        # the first is a step of Newton's: as exact as it has to be to be the last, if it can be that
        enough = policy.linear_share_last_step * done.enough(eq) / done.norm
        share = max(enough, followed, policy.min_forcing)
    # On as long as substitutions, at their present rate, reach the goal for less than a factorisation costs.
    while (
        not (fine := done.fine(eq))
        and not done.stalled
        and eq.reduced.factorisation.factored
        and done.norm * done.rate**policy.substitutions_per_factorisation <= policy.fine_residual * done.evaluation.scale
    ):
        with eq.report.timed("factorisation and solve"):
            step, share = eq.reduced.correction(-done.evaluation.r, share), None
        better = eq.evaluate(done.u + step, lam, stiffness=eq.keeps_matrix and done.is_nearly_there(eq))
        size = eq.norm(better)
        done.stalled = not size < policy.max_substitution_rate * done.norm
        if size < done.norm:  # a little better may be within the tolerance
            done.u, done.evaluation, done.rate, done.norm = done.u + step, better, size / done.norm, size
    return fine


def _refactor(eq: Equilibrium, done: Finish, lam: Array) -> None:
    """One more step with new factors: old ones do not help everywhere (a limit load, say)."""
    reduced = eq.reduced
    here = eq.evaluate(done.u, lam)
    with eq.report.timed("factorisation and solve"):
        step = reduced.step(reduced.matrix(here, -here.r, spent=True), -here.r, done.residual)
    done.factorisations += 1
    better = eq.evaluate(done.u + step, lam, stiffness=False)
    if (size := eq.norm(better)) < done.norm:
        done.u, done.evaluation, done.norm = done.u + step, better, size
