"""Coulomb friction with slip hardening: τ_y = μ(κ) p, κ the accumulated slip (paper eqs. 11-21, corrected)."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from prensa.friction.law import At, FrictionLaw
from prensa.kernels.record import exp, where
from prensa.kernels.table import Table
from prensa.model.fields import described
from prensa.model.tables import read_mu_table
from prensa.model.units import Length, Number, PerLength
from prensa.types import Array

__all__ = ["Coulomb", "MuExponential", "MuLinear", "MuTable"]


@described
class MuLinear:
    """Linear slip hardening, μ(κ) = mu0 + slope κ, held at ``limit`` when given."""

    mu0: Annotated[Number, Field(ge=0)]
    slope: PerLength
    limit: Annotated[Number, Field(ge=0)] | None = None

    @model_validator(mode="after")
    def _check(self) -> MuLinear:
        if self.slope < 0 and self.limit is None:
            raise ValueError("a softening law (slope < 0) needs a 'limit', the residual friction coefficient")
        if self.limit is not None and (self.limit - self.mu0) * self.slope < 0:
            raise ValueError("'limit' lies on the wrong side of mu0 for this slope")
        return self

    def at(self, kappa: Any) -> Any:
        """μ of a point with the accumulated slip κ."""
        mu = self.mu0 + self.slope * kappa
        # One condition for both signs: hardening stops at the limit from below, softening from above.
        return mu if self.limit is None else where((mu - self.limit) * self.slope <= 0.0, mu, self.limit)


@described
class MuExponential:
    """Exponential slip hardening or softening, μ(κ) = mu_inf − (mu_inf − mu0) e^(−κ/u0)."""

    mu0: Annotated[Number, Field(ge=0)]
    mu_inf: Annotated[Number, Field(ge=0)]
    u0: Annotated[Length, Field(gt=0)]

    def at(self, kappa: Any) -> Any:
        """μ of a point with the accumulated slip κ."""
        return self.mu_inf - (self.mu_inf - self.mu0) * exp(-(kappa / self.u0))


@described
class MuTable:
    """Measured ``mu`` at increasing slip ``kappa``; linear between, constant beyond the last (paper, ref. 11)."""

    kappa: tuple[Length, ...]
    mu: tuple[Annotated[Number, Field(ge=0)], ...]
    derived: ClassVar[tuple[str, ...]] = ("line",)

    @model_validator(mode="after")
    def _check(self) -> MuTable:
        if len(self.kappa) != len(self.mu) or len(self.mu) < 2:
            raise ValueError("kappa and mu must have the same number of values, at least two")
        if self.kappa[0] != 0.0 or any(b <= a for a, b in pairwise(self.kappa)):
            raise ValueError("kappa must start at 0 and increase strictly")
        return self

    @cached_property
    def line(self) -> Table:
        """The straight lines between the values."""
        x, y = np.asarray(self.kappa), np.asarray(self.mu)
        none = np.zeros(len(x) - 1)
        return Table(x, np.stack([none, none, np.diff(y) / np.diff(x), y[:-1]], axis=1), self.kappa[0], self.kappa[-1])

    def at(self, kappa: Any) -> Any:
        """μ of a point with the accumulated slip κ."""
        return self.line(kappa)


def _mu_kind(value: Any) -> str:
    if isinstance(value, dict):
        if "slope" in value:
            return "linear"
        return "table" if "kappa" in value else "exponential"
    if isinstance(value, MuLinear):
        return "linear"
    if isinstance(value, MuExponential):
        return "exponential"
    return "table" if isinstance(value, MuTable) else "number"


def _read_mu(value: Any, info: Any) -> Any:
    """The table of a file, where one is named; ``12 %`` is a number."""
    return read_mu_table(value, info.context) if isinstance(value, str) and not value.rstrip().endswith("%") else value


MuLaw = Annotated[
    Annotated[Annotated[Number, Field(ge=0)], Tag("number")]
    | Annotated[MuLinear, Tag("linear")]
    | Annotated[MuExponential, Tag("exponential")]
    | Annotated[MuTable, Tag("table")],
    Discriminator(_mu_kind),
    BeforeValidator(_read_mu),
]


class Coulomb(FrictionLaw):
    """Coulomb friction, |t_T| ≤ μ(κ) p with κ the accumulated slip.

    ``mu``: a number, a hardening law, or a CSV file of κ and μ, whose first line may say a unit as in ``slip (um), mu``.
    """

    mu: MuLaw
    type: Literal["coulomb"] = "coulomb"

    proportional: ClassVar[bool] = True

    @property
    def hardens(self) -> bool:
        """Whether μ depends on the slip."""
        return not isinstance(self.mu, float | int)

    @property
    def frictionless(self) -> bool:
        """Whether μ is the number 0."""
        return bool(self.mu == 0)

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The bound μ(κ) p."""
        mu: Any = self.mu
        return (mu.at(kappa) if isinstance(mu, MuLinear | MuExponential | MuTable) else mu) * p

    def softening(self, p: Array, kappa: Array, at: At) -> Array:
        """Largest −μ′ p (k,) at or ahead of each slip."""
        return self._steepest(kappa) * p

    def coefficient(self, kappa: Array) -> tuple[Array, Array]:
        """μ and dμ/dκ at accumulated slips (k,)."""
        mu, _, slope = self.bound(np.ones_like(kappa), kappa, At())
        return mu, slope

    def _steepest(self, kappa: Array) -> Array:
        """Largest rate of softening −dμ/dκ (k,) (≥ 0, per length) that lies at or ahead of each slip (k,)."""
        m = self.mu
        match m:
            case MuLinear():
                ahead = np.ones_like(kappa) if m.limit is None else (m.mu0 + m.slope * kappa > m.limit).astype(float)
                return ahead * max(0.0, -m.slope)
            case MuExponential():
                return np.maximum(0.0, (m.mu0 - m.mu_inf) / m.u0 * np.exp(-kappa / m.u0))
            case MuTable():
                x = np.asarray(m.kappa)
                fall = np.append(np.maximum(0.0, -np.diff(m.mu) / np.diff(x)), 0.0)
                # k_T is fixed when an increment begins and slip may reach any later piece in it: the steepest fall ahead
                # counts.
                worst = np.maximum.accumulate(fall[::-1])[::-1]
                return worst[np.clip(np.searchsorted(x, kappa, side="right") - 1, 0, len(x) - 1)]
        return np.zeros_like(kappa)
