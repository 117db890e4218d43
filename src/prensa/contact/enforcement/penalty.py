"""Penalty enforcement: p = k_n ⟨−g⟩ with the total gap (paper eqs. 4-8, corrected), t_T by the return map."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from prensa.contact.method import Enforcement, given_or
from prensa.contact.record import magnitude
from prensa.model.units import Number, Stiffness

if TYPE_CHECKING:
    from prensa.contact.forces import ContactForces, Scale

Array = NDArray[np.float64]


class Penalty(Enforcement):
    """Penalty enforcement; k_n = beta E*/h and k_T = beta_T E*/h with E* = E/(1 − ν²).

    h is the depth of the elements behind, or two of their edges where these are shorter.

    ``k_n`` and ``k_T`` set absolute stiffnesses (pressure per length) instead, to reproduce published work.
    ``continuation``: after two cut-backs, an attempt that fails is repeated from beta = 10 and beta_T = 1 upwards by this
    factor; 1: never.
    """

    beta: Annotated[Number, Field(gt=0)] = 100.0
    beta_T: Annotated[Number, Field(gt=0)] = 3.0
    k_n: Annotated[Stiffness, Field(gt=0)] | None = None
    k_T: Annotated[Stiffness, Field(gt=0)] | None = None
    continuation: Annotated[Number, Field(ge=1, le=1000)] = 10.0
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

    def softened(self, scale: Scale, stage: int, keep_tangential: bool, beta: float, beta_T: float) -> Scale:
        """Stiffnesses capped at (beta, beta_T) E*/h times ``continuation`` to the power of the stage."""
        if self.continuation <= 1:
            return scale
        growth = self.continuation**stage
        k_n = np.minimum(scale.k_n, beta * growth * scale.unit)
        k_t = scale.k_t if keep_tangential else np.minimum(scale.k_t, beta_T * growth * scale.unit)
        if np.array_equal(k_n, scale.k_n) and np.array_equal(k_t, scale.k_t):
            return scale
        return replace(scale, k_n=k_n, k_t=k_t)
