"""Enforcement of contact: how gaps and slips become pressures and tractions, and what an outer loop does about the rest.

All of them share one form, p = ⟨λ_n − k_n g⟩ and the return map of t_tr = λ_T − k_T Δg_T (see `prensa.contact.forces`). They
differ in what λ is: nothing, the outcome of an outer loop, or degrees of freedom of the same iteration.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from prensa.model.doors import Member
from prensa.types import Array

if TYPE_CHECKING:
    from prensa.contact.forces import ContactForces, Scale


class Enforcement(Member, abstract=True):
    """Base of all enforcements; frozen, its fields are keys of the case file."""

    door: ClassVar[str] = "enforcement"
    has_multipliers: ClassVar[bool] = False
    """Whether the multipliers are degrees of freedom with equations of their own."""
    slack: ClassVar[float] = 0.0
    """Penetration over the element depth that a closed point may be away from the tool, on the open side."""
    sinks: ClassVar[bool] = False
    """Whether a closed point lies in its tool as deep as its pressure demands, g = −p/k_n; else it lies on it."""
    max_updates: int = 0

    def stiffness(self, unit: Array) -> tuple[Array, Array]:
        """Stiffnesses per area k_n, k_T (k,) of points whose elements have M/h = unit (k,)."""
        raise NotImplementedError(type(self).__name__)

    def initial_multipliers(self, lam: Array) -> Array:
        """Multipliers (k, 1 + t) with which an increment starts, from the committed tractions lam (k, 1 + t)."""
        return lam

    def update(
        self, f: ContactForces, lam: Array, scale: Scale, slip: Array, elastic_share: float
    ) -> tuple[Array, float]:
        """Multipliers (k, 1 + t) of the next outer iteration, and their largest change over its tolerance (≤ 1: settled).

        slip (k,): path that the points have slid in the increment; ``elastic_share`` of the largest is accepted as elastic.
        """
        return lam, 0.0

    def stored(self, f: ContactForces, scale: Scale) -> float:
        """Energy that the contact holds in its springs; what vanishes with the penalty is no energy of the problem."""
        return 0.0

    def without_effect(self) -> tuple[str, ...]:
        """Keys that were given and have no effect: old ones that are still read."""
        return ()

    def beta_of(self, unit: Array) -> float:
        """Penalty over M/h, at the median point."""
        # The median: single elements much flatter or deeper than the rest would hide what was meant.
        return float(np.median(self.stiffness(unit)[0] / unit))


def given_or(value: float | None, factor: float, unit: Array) -> Array:
    """An absolute stiffness where one is given, else factor M/h (k,)."""
    return factor * unit if value is None else np.full_like(unit, value)
