"""Newton's method with the exact tangent: where the contact set has settled, errors are squared."""

from __future__ import annotations

import math

import numpy as np
import pytest

import prensa as pr
from prensa.result.increment import Statistics
from problems import pressed_block

ROUND_OFF = 1e-11
"""Relative residual below which an iterate may be round-off, and says nothing about the rate."""
NEAR = 0.05
"""Relative residual from which on an iterate may be near enough to the solution for the rate to show."""


def pressed(
    material: object, *, kinematics: str = "finite", mu: float = 0.3, tool: object = None, space: str = "plane strain",
    increments: int = 8, depth: float = 1.2, sideways: float = 0.0, element: str = "q4_fbar",
) -> pr.Problem:  # fmt: skip
    """A block on a bonded base, pressed by a cylinder (or *tool*) and dragged with friction."""
    move = pr.Motion(y=-depth) if space == "axisymmetric" else pr.Motion(y=-depth, x=sideways)
    return pressed_block(
        pr.Step("press", move={"tool": move}, increments=increments),
        tools={"tool": tool or pr.Circle(radius=10, touching="block.top")}, material=material, size=(12, 6),
        n=(24, 12), element=element, body="block", sides=("top", "right"), friction=pr.Coulomb(mu) if mu else None,
        space=space, kinematics=kinematics, allow_large_strain=kinematics == "small",
    )  # fmt: skip


STEEL = pr.J2(E=200e3, nu=0.3, flow=pr.Ludwik(s0=250, K=500, n=0.3))
LINEAR = pr.J2(E=200e3, nu=0.3, flow=pr.Linear(s0=250, H=5000))
SOFT = pr.J2(E=1000, nu=0.3, flow=pr.Voce(s0=20, Q=30, b=8), yield_on="kirchhoff")
SUITE = {
    "neo-Hooke, no friction": pressed(pr.NeoHooke(E=1000, nu=0.3), mu=0),
    "neo-Hooke, friction": pressed(pr.NeoHooke(E=1000, nu=0.3), sideways=0.5),
    "neo-Hooke, plain Q4": pressed(pr.NeoHooke(E=1000, nu=0.3), element="q4"),
    "neo-Hooke, sphere": pressed(pr.NeoHooke(E=1000, nu=0.3), space="axisymmetric", mu=0.1, increments=12),
    "Hencky, friction": pressed(pr.Elastic(E=1000, nu=0.3), sideways=0.5),
    "Hooke, current geometry, friction": pressed(pr.Elastic(E=1000, nu=0.3), kinematics="small", depth=0.8, sideways=0.3),
    "slip hardening": pressed(pr.NeoHooke(E=1000, nu=0.3), mu=pr.MuExponential(mu0=0.1, mu_inf=0.3, u0=0.2), sideways=0.5),
    "J2, upsetting": pressed(STEEL, tool=pr.Plane(touching="block.top"), space="axisymmetric", increments=12),
    "J2, plane strain": pressed(STEEL, tool=pr.Plane(touching="block.top"), increments=12),
    "J2 on Kirchhoff stress, cylinder": pressed(SOFT, increments=12),
    "J2, small strain": pressed(LINEAR, kinematics="small", tool=pr.Circle(radius=30, touching="block.top"), depth=0.1),
}  # fmt: skip


def orders(s: Statistics) -> list[float]:
    """Order of convergence ln(r₃/r₂)/ln(r₂/r₁) from the last three residuals above round-off: one number, or none.

    None when a contact point changed its status between them, when there are fewer, or when the first is still far.
    """
    r = s.residuals
    k = sum(v > ROUND_OFF for v in r) - 1
    if k < 2 or any(v > ROUND_OFF for v in r[k + 1 :]) or s.changes[k - 1] or s.changes[k]:
        return []
    a, b, c = r[k - 2 : k + 1]
    return [math.log(c / b) / math.log(b / a)] if NEAR > a > b > c else []


def measured(problem: pr.Problem) -> list[float]:
    """All the orders that a solution shows."""
    out: list[float] = []
    # finishing with old factors is cheaper but linear: here Newton goes all the way. An extrapolated start is near and its
    # error smooth, that of an iterate sits where points slip and yield: between the two there is no order to be seen
    for inc in pr.solve(problem, pr.Numerics(reuse_factors=False, predictor=False)):
        out += orders(inc.statistics)
    return out


@pytest.fixture(scope="module")
def suite() -> dict[str, list[float]]:
    return {name: measured(p) for name, p in SUITE.items()}


def test_the_order_is_two_over_the_suite(suite: dict[str, list[float]]) -> None:
    """With unchanged contact sets Newton's order is at least 1.9 (median over all nonlinear cases)."""
    pooled = [o for found in suite.values() for o in found]
    assert len(pooled) >= 40
    assert float(np.median(pooled)) >= 1.9


def test_every_kind_of_nonlinearity_shows_its_order(suite: dict[str, list[float]]) -> None:
    """No law, element or contact term hides a missing part of its tangent (order one) behind the others."""
    for name, found in suite.items():
        assert found, name
        assert float(np.median(found)) >= 1.4, (name, sorted(found))


def test_the_measure_knows_linear_convergence() -> None:
    """A residual that falls by the same factor each time has order one; a change of status interrupts the measurement."""
    falling = Statistics(4, 0, 1e-6, residuals=(1e-3, 1e-4, 1e-5, 1e-6), changes=(9, 0, 0, 0))
    assert np.allclose(orders(falling), 1.0)
    assert orders(Statistics(2, 0, 1e-8, residuals=(1e-2, 1e-4, 1e-8), changes=(9, 0, 1))) == []
