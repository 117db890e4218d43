"""Penalty enforcement: p = k_n ⟨−g⟩ with the total gap (paper eqs. 4-8, corrected), t_T by the return map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prensa.contact.method import Enforcement, given_or
from prensa.contact.record import magnitude
from prensa.model.units import Number, Stiffness
from prensa.types import Array

if TYPE_CHECKING:
    from prensa.contact.forces import ContactForces, Scale


class Penalty(Enforcement):
    """Penalty enforcement; k_n = beta M/h and k_T = beta_T M/h with M = E (1 − ν)/((1 + ν)(1 − 2ν)), in plane stress E/(1 − ν²).

    M is the stiffness of material that cannot spread, h the depth of the elements behind, or two of their edges where these are
    shorter.

    ``k_n`` and ``k_T`` set absolute stiffnesses (pressure per length) instead, to reproduce published work. ``continuation`` has
    no effect any more; it is accepted, for older case files, and reported.
    """

    # Penetration is 1 % of what a layer of elements gives under a uniform pressure. Forces change by 0.03 % at most for β from
    # 20 to 1000; point pressures of over-constrained rules (2 or 3 Gauss points, Simpson) get worse with every power of ten.
    beta: Annotated[Number, Field(gt=0)] = 100.0
    beta_T: Annotated[Number, Field(gt=0)] = 3.0
    k_n: Annotated[Stiffness, Field(gt=0)] | None = None
    k_T: Annotated[Stiffness, Field(gt=0)] | None = None
    continuation: Annotated[Number, Field(ge=1, le=1000)] | None = None
    type: Literal["penalty"] = "penalty"

    sinks: ClassVar[bool] = True

    def stiffness(self, unit: Array) -> tuple[Array, Array]:
        """k_n, k_T (k,)."""
        return given_or(self.k_n, self.beta, unit), given_or(self.k_T, self.beta_T, unit)

    def initial_multipliers(self, lam: Array) -> Array:
        """λ_n = 0; λ_T is the committed traction, from which the return map starts."""
        return np.hstack([np.zeros((len(lam), 1)), lam[:, 1:]])

    def stored(self, f: ContactForces, scale: Scale) -> float:
        """½ ∫ (p²/k_n + |t|²/k_T) dΓ."""
        return float(0.5 * (f.weight * f.p**2 / scale.k_n + f.area * magnitude(f.t) ** 2 / scale.k_t).sum())

    def without_effect(self) -> tuple[str, ...]:
        """``continuation``, where it is given."""
        return () if self.continuation is None else ("continuation",)
