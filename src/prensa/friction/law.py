"""What a friction law is: a bound on the tangential traction. The return map does the rest, one for all laws.

A law of one's own derives from `FrictionLaw` and states its bound in NumPy; derivatives that it does not give are found by
the complex step::

    class Capped(pr.FrictionLaw):
        mu: float
        m: float

        def bound(self, p, kappa, at):
            return np.minimum(self.mu * p, self.m * at.k)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from prensa.derivatives import derivative
from prensa.model.doors import Member
from prensa.types import Array

SLIPS = np.concatenate(
    [[0.0], np.geomspace(1e-9, 1e9, 73)]
)  # ahead of the present one, at which softening is looked for


class At(NamedTuple):
    """What a bound may depend on besides pressure and slip, fixed during an increment.

    ``k`` (points,): shear yield stress of the body behind the surface at the start of the increment, None where the law does
    not ask for it; ``dt``, ``time``: duration and end of the increment in seconds; ``speed`` (points,): of slip at its
    start, that of the increment before, per second; None: at rest. ``temperature`` (points,) of the surface; None: the one for
    which the law has its numbers.
    """

    k: Array | None = None
    dt: float = 0.0
    time: float = 0.0
    speed: Array | None = None
    temperature: Array | None = None

    def repeated(self, times: int) -> At:
        """The same for points that are listed several times over."""
        k, speed, temperature = (None if v is None else np.tile(v, times) for v in (self.k, self.speed, self.temperature))
        return self._replace(k=k, speed=speed, temperature=temperature)


class FrictionLaw(Member, abstract=True):
    """Base of all friction laws. A law is pure and frozen; its annotated fields are keys of the case file."""

    door: ClassVar[str] = "friction"
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

        Pressures and tractions are per current area. Returns τ_y alone, or (τ_y, ∂τ_y/∂p, ∂τ_y/∂κ).
        """
        raise NotImplementedError(f"{type(self).__name__} states no bound: define bound(self, p, kappa, at)")

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

    def strength(self, p: Array, at: At) -> Array:
        """Shear yield stress (k,) at points of pressures p (k,): the law's own, or the body's."""
        k = at.k if self.own_k is None else np.full_like(p, self.own_k)
        assert k is not None
        return k


def bounded(law: FrictionLaw, p: Array, kappa: Array, at: At) -> tuple[Array, Array, Array]:
    """τ_y, ∂τ_y/∂p, ∂τ_y/∂κ, each (k,): the law's own derivatives, or else those by complex step or central difference."""
    out = law.bound(p, kappa, at)
    if isinstance(out, tuple):
        return out
    tau = np.asarray(out, dtype=np.float64) + np.zeros_like(p)
    slope = np.zeros_like(p) if not law.hardens else derivative(lambda x: law.bound(p, x, at), kappa)
    return tau, derivative(lambda x: law.bound(x, kappa, at), p), slope
