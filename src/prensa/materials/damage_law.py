"""Damage laws: how ductile damage D grows with plastic flow under the stress of the moment. Mechanics do not depend on it.

A law of one's own derives from `DamageLaw` and states dD/dε̄ in NumPy, of all points at once::

    class TensileWork(pr.DamageLaw):
        strength: float

        def rate(self, at):
            return np.maximum(at.first, 0) / self.strength

D is integrated over each increment from the two committed states at its ends, by the trapezoidal rule.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from prensa.model.doors import Member, add_common_fields, fault
from prensa.model.units import Number, Pressure
from prensa.types import Array, Index

NUMBER_LIMIT: Any = Annotated[Number, Field(gt=0)] | None
STRESS_LIMIT: Any = Annotated[Pressure, Field(gt=0)] | None


class StressState(NamedTuple):
    """Stresses and strains of n points in a committed state.

    ``principal`` (n, 3) Cauchy stresses, the greatest first; ``equivalent`` (n,) σ̄ of the yield function, von Mises' unless a
    material has another; ``strain`` (n,) equivalent plastic strain ε̄.
    """

    principal: Array
    equivalent: Array
    strain: Array

    @property
    def first(self) -> Array:
        """Greatest principal stress σ_1 (n,)."""
        return self.principal[:, 0]

    @property
    def second(self) -> Array:
        """Middle principal stress σ_2 (n,)."""
        return self.principal[:, 1]

    @property
    def third(self) -> Array:
        """Least principal stress σ_3 (n,)."""
        return self.principal[:, 2]

    @property
    def mean(self) -> Array:
        """Mean stress σ_m (n,), positive in tension."""
        return np.asarray(self.principal.mean(axis=1))

    @property
    def triaxiality(self) -> Array:
        """σ_m/σ̄ (n,)."""
        return self.mean / self.equivalent

    def of(self, rows: Index) -> StressState:
        """The same for some of the points."""
        return StressState._make(a[rows] for a in self)

    @classmethod
    def at(cls, stress: Array, equivalent: Array, strain: Array) -> StressState:
        """Of Cauchy stresses (n, 4) xx, yy, zz, xy, in any plane that zz is normal to, or (n, 6) xx, yy, zz, xy, xz, yz."""
        if stress.shape[1] == 6:
            tensor = stress[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
            return cls(np.linalg.eigvalsh(tensor)[:, ::-1].astype(np.float64), equivalent, strain)
        middle, half = 0.5 * (stress[:, 0] + stress[:, 1]), np.hypot(0.5 * (stress[:, 0] - stress[:, 1]), stress[:, 3])
        return cls(-np.sort(-np.stack([middle + half, middle - half, stress[:, 2]], axis=1), axis=1), equivalent, strain)


class DamageLaw(Member, abstract=True):
    """Base of all damage laws. A law is pure and frozen; its annotated fields are keys of the case file, ``limit`` besides.

    ``limit``: the damage at which metal cracks, which reports and ``until`` compare with; None: nothing is compared.
    """

    door: ClassVar[str] = "damage"
    of_stress: ClassVar[bool] = False
    """Whether D is a stress (an energy per volume) and not a number."""
    usual_limit: ClassVar[float | None] = None
    """Limit where none is given."""
    title: ClassVar[str] = ""
    """What tables and pictures call it; its `name` where nothing is said."""

    if TYPE_CHECKING:  # added to each class behind its own fields, so that these come first
        limit: float | None = field(default=None, kw_only=True)

    def __init_subclass__(cls, abstract: bool = False, **options: Any) -> None:
        if not abstract:
            add_common_fields(cls, {"limit": STRESS_LIMIT if cls.of_stress else NUMBER_LIMIT}, cls.usual_limit)
        super().__init_subclass__(abstract=abstract, **options)

    @property
    def name(self) -> str:
        """By which fields, columns and measures name it: its type, without the module of a user's."""
        return self.type.rpartition(":")[2]

    @property
    def heading(self) -> str:
        """What tables and pictures call it."""
        return self.title or self.name.replace("_", " ")

    @property
    def falls(self) -> bool:
        """Whether D may become less again, and negative."""
        return False

    def fault(self) -> str:
        """What is wrong with the form of its answer at points in uniaxial tension, tried before a run; empty if nothing."""
        strain = np.linspace(0.1, 0.5, 5)
        start, end = (StressState(np.eye(3)[np.zeros(5, dtype=int)], np.ones(5), e) for e in (strain, 2.0 * strain))
        before, points = np.zeros(5), f"for {len(strain)} points an array of shape {strain.shape}, a number each,"

        def fits(found: Any) -> bool:  # what grown adds up: one number for all of them too
            return np.broadcast_shapes(np.asarray(found, dtype=np.float64).shape, strain.shape) == strain.shape

        with np.errstate(all="ignore"):
            stated = type(self).rate is not DamageLaw.rate or type(self).grown is DamageLaw.grown
            wrong = fault("rate", lambda: self.rate(end), fits, points) if stated else ""
            return wrong or fault("damage", lambda: self.grown(before, start, end), lambda d: d.shape == strain.shape, points)

    def rate(self, at: StressState) -> Array:
        """The integrand dD/dε̄ (n,) of points that flow."""
        raise NotImplementedError(f"{type(self).__name__} states no growth of damage: define rate(self, at)")

    def grown(self, before: Array, start: StressState, end: StressState) -> Array:
        """D (n,) after an increment between two committed states that began with ``before`` (n,).

        By the trapezoidal rule over the plastic strain. Where flow begins in the increment, at points that had none before, the
        integrand is that of its end: the elastic state in which it began is none of flow.
        """
        out = before.copy()
        rows = np.flatnonzero(end.strain != start.strain)
        if not len(rows):
            return out
        a, b = start.of(rows), end.of(rows)
        began = (a.strain > 0.0) & (a.equivalent > 0.0)
        first = StressState(*(np.where(began if p.ndim == 1 else began[:, None], p, q) for p, q in zip(a, b)))
        out[rows] += 0.5 * (self.rate(first) + self.rate(b)) * (b.strain - a.strain)
        return out


class StrainDriven(DamageLaw, abstract=True):
    """Base of laws whose integrand may be negative; with the field ``heals`` it counts there too, and damage falls again."""

    @property
    def falls(self) -> bool:
        """As ``heals`` says."""
        return self._heals

    @property
    def _heals(self) -> bool:
        return bool(getattr(self, "heals", False))

    def signed(self, at: StressState) -> Array:
        """The integrand (n,) with its sign."""
        raise NotImplementedError

    def rate(self, at: StressState) -> Array:
        """The integrand, cut off at zero unless damage heals."""
        signed = self.signed(at)
        return signed if self._heals else np.maximum(signed, 0.0)
