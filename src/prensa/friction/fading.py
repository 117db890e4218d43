"""Friction that a step lowers or takes away: what the old law bore is released linearly over the step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from prensa.friction.law import At, FrictionLaw, bounded
from prensa.types import Array


@dataclass(frozen=True)
class Fading(FrictionLaw, abstract=True):
    """The law ``now``, and of what ``before`` bears beyond it the share that is left between t0 and t1.

    τ_y = τ_now + (t1 − t)/(t1 − t0) max(τ_before − τ_now, 0): friction that rises only resists more and does so at once.
    ``now`` may be None, for no friction. ``held``: time from which on the share stays as it is, of a step that ended early.
    """

    before: FrictionLaw
    now: FrictionLaw | None
    t0: float
    t1: float
    held: float = math.inf
    type: str = "fading"

    @property
    def hardens(self) -> bool:
        """Whether either law depends on the accumulated slip."""
        return self.before.hardens or (self.now is not None and self.now.hardens)

    @property
    def asks_for_k(self) -> bool:
        """Whether either law depends on the shear yield stress."""
        return self.before.asks_for_k or (self.now is not None and self.now.asks_for_k)

    def bound(self, p: Array, kappa: Array, at: At) -> tuple[Array, Array, Array]:
        """τ_y, ∂τ_y/∂p, ∂τ_y/∂κ, each (k,)."""
        zero = np.zeros_like(p)
        now = (zero, zero, zero) if self.now is None else bounded(self.now, p, kappa, at)
        before = bounded(self.before, p, kappa, at)
        left = min(max((self.t1 - min(at.time, self.held)) / (self.t1 - self.t0), 0.0), 1.0)
        left_here = np.where(before[0] > now[0], left, 0.0)
        tau, by_p, by_kappa = (n + left_here * (b - n) for b, n in zip(before, now))
        return tau, by_p, by_kappa

    def known_to(self) -> Mapping[str, float]:
        """That of the law now."""
        return {} if self.now is None else self.now.known_to()

    def softening(self, p: Array, kappa: Array, at: At) -> Array:
        """Largest −∂τ_y/∂κ (k,) of either law: that of a mean of the two is not larger."""
        before = self.before.softening(p, kappa, at)
        return before if self.now is None else np.maximum(before, self.now.softening(p, kappa, at))


def fading(before: FrictionLaw | None, now: FrictionLaw | None, t0: float, t1: float) -> FrictionLaw | None:
    """The law of a step from t0 to t1 that changes ``before`` to ``now``."""
    same = before is None or before.frictionless or before == now
    return now if same or before is None else Fading(before, now, t0, t1)
