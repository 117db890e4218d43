"""Friction that a step lowers or takes away: what the old law bore is released linearly over the step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from prensa.friction.law import At, FrictionLaw, bounded
from prensa.kernels.record import where
from prensa.types import Array


@dataclass(frozen=True)
class Fading(FrictionLaw, abstract=True):
    """The law ``now``, and of the bound of ``before`` beyond it the share that is left between t0 and t1.

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

    @property
    def is_of_point(self) -> bool:
        """Whether both laws are."""
        return self.before.is_of_point and (self.now is None or self.now.is_of_point)

    def bound(self, p: Array, kappa: Array, at: At) -> tuple[Array, Array, Array]:
        """τ_y, ∂τ_y/∂p, ∂τ_y/∂κ, each (k,)."""
        if self.is_of_point:
            out: tuple[Array, Array, Array] = super().bound(p, kappa, at)
            return out
        zero = np.zeros_like(p)
        now = (zero, zero, zero) if self.now is None else bounded(self.now, p, kappa, at)
        before = bounded(self.before, p, kappa, at)
        # Dead forces that are taken away instead would not go with the pressure, and tools would feel forces that no table
        # shows.
        left = np.where(before[0] > now[0], self._left(at.time), 0.0)
        tau, by_p, by_kappa = (n + left * (b - n) for b, n in zip(before, now))
        return tau, by_p, by_kappa

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """See `Fading`."""
        before = self.before.bound_of_point(p, kappa, at)
        now = 0.0 * before if self.now is None else self.now.bound_of_point(p, kappa, at)
        return now + where(before > now, self._left(at.time), 0.0) * (before - now)

    def _left(self, time: Any) -> Any:
        """Share of the law before that is left."""
        now = where(time < self.held, time, self.held)
        left = (self.t1 - now) / (self.t1 - self.t0)
        return where(left > 0.0, where(left < 1.0, left, 1.0), 0.0)

    def known_to(self) -> Mapping[str, float]:
        """That of the law now."""
        return {} if self.now is None else self.now.known_to()

    def softening(self, p: Array, kappa: Array, at: At) -> Array:
        """Largest −∂τ_y/∂κ (k,) of either law: that of a mean of the two is not larger."""
        before = self.before.softening(p, kappa, at)
        return before if self.now is None else np.maximum(before, self.now.softening(p, kappa, at))


def fading(before: FrictionLaw | None, now: FrictionLaw | None, t0: float, t1: float) -> FrictionLaw | None:
    """The law of a step from t0 to t1 that changes ``before`` to ``now``."""
    # Friction that appears or rises is reached by sliding on, without a jump: it needs no fading.
    same = before is None or before.frictionless or before == now
    return now if same or before is None else Fading(before, now, t0, t1)
