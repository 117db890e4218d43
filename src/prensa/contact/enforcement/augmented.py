"""Augmented Lagrangian (Uzawa's updates): the penalty form, repeated with updated multipliers until gaps and slips are small."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.contact.method import Enforcement, given_or
from prensa.contact.record import magnitude
from prensa.model.units import Number, Stiffness, Whole
from prensa.types import Array

if TYPE_CHECKING:
    from prensa.contact.forces import ContactForces, Scale


class Augmented(Enforcement):
    """Augmented Lagrangian (Uzawa): the penalty form repeated with updated multipliers.

    Until penetration ≤ ``tolerance`` h and elastic slip ≤ the larger of ``tolerance`` h and 1e-3 of the slip of the
    increment, ``max_updates`` times at most. ``beta``, ``beta_T``, ``k_n``, ``k_T`` as in `Penalty`.
    """

    beta: Annotated[Number, Field(gt=0)] = 100.0
    beta_T: Annotated[Number, Field(gt=0)] = 10.0
    k_n: Annotated[Stiffness, Field(gt=0)] | None = None
    k_T: Annotated[Stiffness, Field(gt=0)] | None = None
    # Updates converge linearly: twelve digits would take some forty solutions of the increment.
    tolerance: Annotated[Number, Field(gt=0, le=0.1)] = 1e-5
    max_updates: Annotated[Whole, Field(ge=1)] = 40
    type: Literal["augmented"] = "augmented"

    # Ten times the default tolerance: updates stop with gaps of this size on either side.
    slack: ClassVar[float] = 1e-4

    def stiffness(self, unit: Array) -> tuple[Array, Array]:
        """k_n, k_T (k,)."""
        return given_or(self.k_n, self.beta, unit), given_or(self.k_T, self.beta_T, unit)

    def update(
        self, f: ContactForces, lam: Array, scale: Scale, slip: Array, elastic_share: float
    ) -> tuple[Array, float]:
        """λ ← (p, t)."""
        # What an update changes, over the stiffness, is the penetration or elastic slip that was left.
        tol = self.tolerance * scale.h
        normal = np.abs(f.p - lam[:, 0]) / scale.k_n / tol
        tangential = (
            magnitude(f.t - lam[:, 1:]) / scale.k_t / np.maximum(tol, elastic_share * np.abs(slip).max(initial=0.0))
        )
        change = max(float(normal.max(initial=0.0)), float(tangential.max(initial=0.0)))
        return np.hstack([f.p[:, None], f.t]), change
