"""Quadratic edges that end on the axis of revolution: their corner is held out of tools, and nothing is paid for it elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.contact.axis import CARRIED
from prensa.verify.balance import Balance
from problems import stroke, upset_billet

ENFORCEMENTS = {"penalty": pr.Penalty(), "augmented": pr.Augmented(), "exact": pr.Exact()}


def pressed(element, enforcement=None, tool=None, depth=0.1, **more):
    """A cylinder on a smooth plane under a tool."""
    return upset_billet(
        stroke(-depth, increments=2, tool="tool"), tools={"tool": tool or pr.Plane(touching="body.top")}, element=element,
        enforcement=enforcement, body="body", **{"n": (4, 2)} | more,
    )  # fmt: skip


def test_the_rule_is_exact_for_cubics_times_the_radius():
    """∫₀¹ f(s) s ds of 1, s, s², s³ by the points at 0, 3/5, 1 and their weights, which are all positive."""
    w = 1 / 3 / CARRIED[0]  # ∫ 4 s (1 - s) s ds = 1/3
    weights = np.array([-CARRIED[1] * w, w, 1 / 6 - CARRIED[2] * w])
    assert weights == pytest.approx([1 / 36, 25 / 72, 1 / 8], rel=1e-14)
    for k in range(4):
        assert weights @ np.array([0.0, 0.6, 1.0]) ** k == pytest.approx(1 / (k + 2), rel=1e-14)


@pytest.mark.parametrize("enforcement", ENFORCEMENTS)
@pytest.mark.parametrize("element", ["t6", "q8"])
def test_a_uniform_pressure_is_met_exactly(element, enforcement):
    """Patch test: pressures, at the corner on the axis too, and stresses are uniform, forces balance, within 1e-10."""
    p = pressed(element, ENFORCEMENTS[enforcement])
    balance = Balance()
    inc = balance.last(p, pr.Numerics(tolerance=1e-13))
    c = inc.contacts["body.top-tool"]
    stress = inc.force("tool").y / (np.pi * c.x[:, 0].max() ** 2)
    assert c.pressure == pytest.approx(stress, rel=1e-10)
    assert c.pressure_from_stress == pytest.approx(stress, rel=1e-9)
    assert np.ptp(c.gap) < 1e-11
    assert c.weight.min() > 0
    assert c.weight.sum() == pytest.approx(np.pi * c.x[:, 0].max() ** 2, rel=1e-12)
    on_axis = c.X[:, 0] == 0.0
    assert np.abs(c.force[on_axis]).max() < 1e-10 * inc.force("tool").y
    assert balance.force < 1e-10


@pytest.mark.parametrize("element", ["t6", "q8"])
def test_the_corner_stays_out_of_the_tool(element):
    """Metal that flows around a punch: the corner lies no deeper than its pressure demands (it did by 2 % of an element)."""
    stamp = pr.Stamp(width=4.0, fillet=0.6, touching="body.top")
    metal = pr.J2(200e3, 0.3, pr.Voce(200.0, 400.0, 10.0))
    p = pressed(element, tool=stamp, size=(4.0, 4.0), n=(8, 8), depth=0.8, material=metal)
    element_size = 0.5
    for inc in pr.solve(p):
        c = inc.contacts["body.top-tool"]
        k = int(np.argmin(c.X[:, 0]))
        assert c.gap[k] > -1e-3 * element_size
        assert c.pressure[k] > 0
    middle = np.argsort(c.X[:, 0])[:4]
    assert c.pressure[k] == pytest.approx(c.pressure[middle].mean(), rel=0.15)


def test_hertz_at_the_axis():
    """A ball on a half-space, six elements over the contact: Hertz's pressure within 5 %, that on the axis within 4 %."""
    R, E, nu, depth = 20.0, 1000.0, 0.3, 0.05
    p = pressed("t6", pr.Exact(), pr.Circle(radius=R, touching="body.top"), size=(8.0, 8.0), n=(48, 16), depth=depth)
    *_, inc = pr.solve(p)
    c = inc.contacts["body.top-tool"]
    F = inc.force("tool").y
    a = (3 * F * R * (1 - nu**2) / (4 * E)) ** (1 / 3)
    peak = 1.5 * F / (np.pi * a**2)
    r = c.X[:, 0]
    near = r < 0.6 * a
    off = c.pressure[near] / (peak * np.sqrt(1 - (r[near] / a) ** 2)) - 1
    assert np.abs(off).max() < 0.055
    assert abs(off[np.argmin(r[near])]) < 0.04
