"""Exact enforcement: multipliers are degrees of freedom, p = λ_n and t_T = λ_T further equations of the same iteration.

Alart and Curnier (1991); Hüeber and Wohlmuth (2005). The equations are `prensa.contact.forces.multiplier_rows`.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from prensa.contact.method import Enforcement
from prensa.model.units import Number
from prensa.types import Array


class Exact(Enforcement):
    """Exact enforcement: Lagrange multipliers as degrees of freedom, by semi-smooth Newton; no penetration, no elastic slip.

    ``beta`` and ``beta_T``, in units of E/(1 − ν²)/h, weigh gap against pressure where open or closed, stick or slip is
    decided during the iteration; the answer does not depend on them.
    """

    beta: Annotated[Number, Field(gt=0)] = 10.0
    beta_T: Annotated[Number, Field(gt=0)] = 10.0
    type: Literal["exact"] = "exact"

    # Not condensed with their nodes: that is exact only where each constraint has nodes of its own.
    has_multipliers: ClassVar[bool] = True
    # Gaps are closed to about 1e-12 of an element depth, by the convergence of Newton's iteration.
    slack: ClassVar[float] = 1e-11

    def stiffness(self, unit: Array) -> tuple[Array, Array]:
        """k_n, k_T (k,)."""
        return self.beta * unit, self.beta_T * unit
