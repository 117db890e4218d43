"""Friction laws: a bound on the tangential traction. The return map does the rest, one for all laws.

A law of one's own derives from `FrictionLaw` and states its bound in one of two forms. In NumPy, of all points at once;
derivatives that it does not give are found by the complex step::

    class Capped(pr.FrictionLaw):
        mu: float
        m: float

        def bound(self, p, kappa, at):
            return np.minimum(self.mu * p, self.m * at.k)

Or of one point, with the functions of `prensa.kernels.record`; machine code and all derivatives, those by its fields too, are
generated from it::

        def bound_of_point(self, p, kappa, at):
            free, cap = self.mu * p, self.m * at.k
            return where(free < cap, free, cap)
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, ClassVar

import numpy as np

from prensa.derivatives import derivative
from prensa.friction.at import At as At
from prensa.model.doors import Member
from prensa.types import Array

# In the case's unit of length, four a decade: no law of a user's says at which slip it falls steepest.
SLIPS = np.concatenate(
    [[0.0], np.geomspace(1e-9, 1e9, 73)]
)  # ahead of the present one, at which softening is looked for


class FrictionLaw(Member, abstract=True):
    """Base of all friction laws. A law is pure and frozen; its annotated fields are keys of the case file."""

    door: ClassVar[str] = "friction"
    derived: ClassVar[tuple[str, ...]] = ()
    """Cached properties, numbers or `prensa.kernels.table.Table`s, that `bound_of_point` takes as it does fields."""
    proportional: ClassVar[bool] = False
    """Whether the bound is proportional to the pressure, so that the area of the point cancels."""

    @property
    def hardens(self) -> bool:
        """Whether the bound depends on the accumulated slip."""
        return True

    @property
    def frictionless(self) -> bool:
        """Whether the bound is zero everywhere."""
        return False

    @property
    def asks_for_k(self) -> bool:
        """Whether the bound depends on the shear yield stress ``at.k`` of the body."""
        return False

    def bound(self, p: Array, kappa: Array, at: At) -> Any:
        """Bound τ_y ≥ 0 (k,) on the tangential traction at pressures p (k,) and accumulated slips kappa (k,).

        Pressures and tractions are per current area. Returns τ_y alone, or (τ_y, ∂τ_y/∂p, ∂τ_y/∂κ), as here for a law that states
        `bound_of_point`.
        """
        if not self.is_of_point:
            raise NotImplementedError(f"{type(self).__name__} states no bound: define bound(self, p, kappa, at)")
        from prensa.friction.point import bounds

        return bounds(self, p, kappa, at)

    def bound_of_point(self, p: Any, kappa: Any, at: At) -> Any:
        """The same of one point, all of whose numbers, the fields too, are recorded ones; see `prensa.kernels.record`.

        What Python decides here may depend on which fields are None, not on values. Laws of the temperature are stated in NumPy.
        """
        raise NotImplementedError(
            f"{type(self).__name__} states no bound of a point: define bound_of_point(self, p, kappa, at)"
        )

    @property
    def is_of_point(self) -> bool:
        """Whether the bound is stated for one point; a `bound` in NumPy that a class beneath states takes its place."""
        cls: Any = type(self)
        return _states_a_point(cls)

    def softening(self, p: Array, kappa: Array, at: At) -> Array:
        """Largest −∂τ_y/∂κ (k,) ≥ 0 at or ahead of the slips: what the tangential stiffness has to exceed.

        Sampled unless a law knows better.
        """
        if not self.hardens:
            return np.zeros_like(p)
        n = len(SLIPS)
        slips = (kappa + SLIPS[:, None]).ravel()
        slope = bounded(self, np.tile(p, n), slips, at.repeated(n))[2]
        return np.maximum(-slope.reshape(n, -1).min(axis=0), 0.0)

    def known_to(self) -> Mapping[str, float]:
        """Largest 'pressure', 'slip' and 'speed' for which a measured law has values; a run that goes beyond says so."""
        return {}


@cache
def _states_a_point(cls: Any) -> bool:
    """Whether of the classes above one another the lowest that states a bound states that of a point."""
    first = next(c for c in cls.__mro__ if {"bound", "bound_of_point"} & vars(c).keys())
    return first is not FrictionLaw and "bound_of_point" in vars(first)


class StrengthLaw(FrictionLaw, abstract=True):
    """Base of the laws whose bound depends on the shear strength, the field ``k``, and on the pressure, but not on the slip."""

    @property
    def own_k(self) -> float | None:
        """The field ``k``; None where the body has to give it."""
        return getattr(self, "k", None)

    @property
    def hardens(self) -> bool:
        """False: the bound does not depend on the slip."""
        return False

    @property
    def asks_for_k(self) -> bool:
        """Whether the body has to give the shear yield stress."""
        return self.own_k is None

    def strength(self, at: At) -> Any:
        """Shear yield stress of a point: the law's own, or the body's."""
        return at.k if self.own_k is None else self.own_k


def bounded(law: FrictionLaw, p: Array, kappa: Array, at: At) -> tuple[Array, Array, Array]:
    """τ_y, ∂τ_y/∂p, ∂τ_y/∂κ, each (k,): the law's own derivatives, or else those by complex step or central difference."""
    out = law.bound(p, kappa, at)
    if isinstance(out, tuple):
        return out
    tau = np.asarray(out, dtype=np.float64) + np.zeros_like(p)
    slope = np.zeros_like(p) if not law.hardens else derivative(lambda x: law.bound(p, x, at), kappa)
    return tau, derivative(lambda x: law.bound(x, kappa, at), p), slope
