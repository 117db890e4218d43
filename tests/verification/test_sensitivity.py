"""The test of the tests: a case that would pass whatever the material is not a verification."""

from __future__ import annotations

import pytest

from prensa.verify.table import Case, cases

pytestmark = pytest.mark.slow  # every case of two suites once more

FRICTION = {
    "sliding wedge",
    "shear factor",
    "friction laws of forming",
    "Cattaneo-Mindlin",
    "slip hardening, return map",
    "slip hardening, dragged body",
}
"""Closed forms in which only the friction enters."""

INDIFFERENT = {"balance, every kind of load"}
"""Equilibrium holds for every material: nothing to be sensitive to."""


def _fails(case: Case, **scale: float) -> bool:
    rows = case.run(**scale)
    assert not any("did not converge" in r.quantity for r in rows)
    return any(not r.passed for r in rows if "out of balance" not in r.quantity)


def _parameters(names: set[str]) -> list[object]:
    return [pytest.param(c, id=n) for n, c in cases().items() if n in names]


ELASTIC = {n for n, c in cases().items() if c.suite in ("contact", "friction")} - FRICTION - INDIFFERENT
ELASTIC |= {"integration rules and penalties"}


@pytest.mark.parametrize("case", _parameters(ELASTIC))
def test_a_modulus_two_per_cent_off_is_noticed(case: Case) -> None:
    """Every case whose reference depends on E fails when E is 2 % too large."""
    assert _fails(case, E_scale=1.02)


@pytest.mark.parametrize("case", _parameters(FRICTION))
def test_a_friction_coefficient_two_per_cent_off_is_noticed(case: Case) -> None:
    """Every case whose reference depends on μ fails when μ is 2 % too large."""
    assert _fails(case, mu_scale=1.02)


@pytest.mark.parametrize("case", _parameters({"plate with friction"}))
def test_the_plate_notices_its_friction(case: Case) -> None:
    """The plate's displacements depend on μ as well: they fail when μ is 2 % too small."""
    assert _fails(case, mu_scale=0.98)
