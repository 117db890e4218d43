"""Fields of users' laws that are stated for one point: their types count, and what can be no field is refused in words."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.friction.law import At as FrictionAt
from prensa.kernels.record import exp
from prensa.kernels.table import Table
from prensa.kernels.template import Template
from prensa.materials.corotational import Tensor
from prensa.materials.hardening import stresses
from prensa.materials.protocol import At, Out
from prensa.testing import check_flow

A = np.array([0.0, 0.1, 0.5])


def chosen(way: Any) -> float:
    """A factor by the type of a field: 1 and True are equal, and not the same."""
    return {int: 1.0, bool: 2.0, str: 3.0}.get(type(way), 4.0)


class Curve(pr.PointCurve):
    """Stress by the type of a field."""

    s0: float
    way: Any

    def stress(self, strain: Any, rate: Any) -> Any:
        return self.s0 * chosen(self.way) + 10.0 * strain


class Friction(pr.FrictionLaw):
    """Bound by the type of a field."""

    mu: float
    way: Any

    def bound_of_point(self, p: Any, kappa: Any, at: Any) -> Any:
        return self.mu * chosen(self.way) * p


class Elastic(pr.PointMaterial):
    """Stiffness by the type of a field."""

    E: float
    nu: float
    way: Any

    def energy(self, strain: Tensor) -> Any:
        d = strain.deviator
        return chosen(self.way) * self.E * (0.4 * d.dot(d) + 0.4 * strain.trace**2)


def of_curve(curve: Any) -> np.ndarray:
    """Compiled flow stresses."""
    return stresses(curve.kernel(), A)[:, 0]


def of_friction(law: pr.FrictionLaw) -> np.ndarray:
    """Bounds at pressures."""
    return np.asarray(law.bound(1.0 + A, A, FrictionAt())[0])


def of_material(material: pr.Material) -> np.ndarray:
    """Stress at a stretch."""
    law = material.law("finite")
    out = Out(np.empty((1, 5)), np.empty((1, 5, 5)), np.zeros((1, law.size)), np.zeros(1, dtype=bool))
    law.update(np.array([[0.02, 0.0, 0.0, 0.0, 0.0]]), np.zeros((1, law.size)), At(1.0, 1.0), out)
    return out.P[0, :1]


LAWS: dict[str, Any] = {
    "Curve": lambda way: of_curve(Curve(100.0, way)),
    "Friction": lambda way: of_friction(Friction(0.1, way)),
    "Elastic": lambda way: of_material(Elastic(9.0, 0.3, way)),
}
"""Answers of laws by their field."""


@pytest.mark.parametrize("ways", [(1, True, 1.0), (True, 1, 1.0), (0, False, 0.0), (1.0, 1, True)])
@pytest.mark.parametrize("name", LAWS)
def test_equal_fields_of_other_types_are_other_laws(name: str, ways: tuple[Any, ...]) -> None:
    """1, 1.0 and True are equal, and so are laws with them: none answers with another's machine code, in whatever order."""
    found = [LAWS[name](w) for w in ways]
    whole = LAWS[name]("a text") / 3.0
    for w, x in zip(ways, found):
        assert x[0] == pytest.approx(chosen(w) * whole[0], rel=1e-12)


def test_types_within_count_too() -> None:
    """In tuples, dicts, sets that cannot change and descriptions within descriptions."""
    for one, other in ((1, True), (0, 0.0), (frozenset({1}), frozenset({True})), (2, 2.0)):
        for wrap in (lambda x: x, lambda x: (x, "a"), lambda x: {"a": x}, lambda x: Curve(1.0, x)):
            pair = [Template.of(Curve(100.0, wrap(x))).template for x in (one, other)]
            assert pair[0] != pair[1]
            assert pair[0] == Template.of(Curve(7.0, wrap(one))).template


class Sum(pr.PointCurve):
    """Voce's terms, as many as there are."""

    s0: float
    terms: Any

    def stress(self, strain: Any, rate: Any) -> Any:
        return self.s0 + sum(Q * (1 - exp(-b * strain)) for Q, b in (getattr(self.terms, "values", lambda: self.terms)()))


class Mean(pr.FrictionLaw):
    """The mean of some coefficients."""

    mus: Any

    def bound_of_point(self, p: Any, kappa: Any, at: Any) -> Any:
        return sum(self.mus.values() if isinstance(self.mus, dict) else self.mus) / len(self.mus) * p


@pytest.mark.parametrize("make", [tuple, list, lambda x: dict(zip("abc", x))], ids=["tuple", "list", "dict"])
def test_numbers_in_tuples_lists_and_dicts_are_fields_as_others(make: Any) -> None:
    """They are compiled, with a derivative by each."""
    curve = Sum(100.0, make([(60.0, 40.0), (120.0, 4.0)]))
    plain = 100.0 + 60.0 * (1 - np.exp(-40.0 * A)) + 120.0 * (1 - np.exp(-4.0 * A))
    found = stresses(curve.kernel(), A)
    assert found[:, 0] == pytest.approx(plain, rel=1e-14)
    assert found[:, 5] == pytest.approx(1 - np.exp(-40.0 * A), rel=1e-13)
    check_flow(curve)
    assert of_friction(Mean(make([0.1, 0.2, 0.6]))) == pytest.approx(0.3 * (1.0 + A), rel=1e-14)


@pytest.mark.parametrize("field", [{1.0, 2.0}, np.ones(3), [{1.0}], {"a": {2.0}}], ids=["set", "array", "in a list", "in a dict"])
@pytest.mark.parametrize("name", LAWS)
def test_what_can_be_no_field_is_named_with_its_law(name: str, field: Any) -> None:
    """Law, field and remedy."""
    with pytest.raises(pr.PrensaError, match=rf"^{name}: no machine code.*'way'.*tuples, lists and dicts"):
        LAWS[name](field)


class Tabled(pr.FrictionLaw):
    """A table over the pressure, and a bound that asks for the pairs that it is made of."""

    pairs: tuple[tuple[float, float], ...]
    derived = ("line",)

    @cached_property
    def line(self) -> Table:
        """Straight lines between the pairs."""
        x, y = np.array(self.pairs).T
        none = np.zeros(len(x) - 1)
        return Table(x.copy(), np.stack([none, none, np.diff(y) / np.diff(x), y[:-1]], axis=1), float(x[0]), float(x[-1]))

    def bound_of_point(self, p: Any, kappa: Any, at: Any) -> Any:
        return self.line(p) * p * len(self.pairs)


def test_a_field_of_which_something_is_derived_is_not_used_itself() -> None:
    """It says so, and what to do."""
    with pytest.raises(pr.PrensaError, match=r"Tabled: the field 'pairs'.*derived.*cached property"):
        of_friction(Tabled(((0.0, 0.1), (2.0, 0.3))))
