"""Flat ring on a half-space and on a layer."""

import math

import numpy as np
import pytest

from prensa.reference import flat_punch_stiffness, ring_stamp, ring_stamp_pressure
from prensa.reference.tables import EXAMPLE2_STIFFNESS

RING = {"inner": 8.0, "outer": 12.0, "E": 1000.0, "nu": 0.3}


@pytest.mark.parametrize(("support", "H"), [("halfspace", None), ("layer_smooth_base", 10.0)])
def test_reproduces_the_independent_results(support, H):
    """Stiffness and interior pressure agree with independent results, to their printed digits and to 2e-5."""
    found = ring_stamp(H=H, **RING)
    assert found.stiffness == pytest.approx(EXAMPLE2_STIFFNESS[support], abs=0.06)
    table = ring_stamp_pressure(support)
    inside = (table["r"] > 8.002) & (table["r"] < 11.99)
    assert np.abs(found.pressure(table["r"]) / table["p"] - 1.0)[inside].max() < 2e-5
    assert np.abs(found.pressure(table["r"]) / found.mean_pressure / table["p_over_mean"] - 1.0)[inside].max() < 2e-5


def test_converges_with_the_number_of_points():
    """The stiffness is converged to round-off from 16 points on, on both supports."""
    for H in (None, 10.0):
        reference = ring_stamp(H=H, n=96, **RING).stiffness
        assert ring_stamp(H=H, n=16, **RING).stiffness == pytest.approx(reference, rel=1e-11)


def test_small_hole_is_a_disc():
    """A vanishing hole gives the flat circular punch 2 E* R, less 4/(3 pi^2) (inner/outer)^3 of it."""
    disc = flat_punch_stiffness(12.0, 1000.0, 0.3)
    for ratio in (0.1, 0.05, 0.02):
        found = ring_stamp(inner=12.0 * ratio, outer=12.0, E=1000.0, nu=0.3, n=96).stiffness
        assert 1.0 - found / disc == pytest.approx(4.0 / (3.0 * math.pi**2) * ratio**3, rel=10.0 * ratio**2)


def test_narrow_ring_is_a_charged_wire():
    """A narrow ring tends to the capacitance of a thin torus, P/delta = pi^2 E* R/ln(32 R/width), R the mean radius."""
    for ratio, error in ((0.9, 2e-3), (0.99, 3e-5), (0.999, 5e-7)):
        found = ring_stamp(inner=ratio, outer=1.0, E=1000.0, nu=0.3)
        R, width = 0.5 * (1.0 + ratio), 1.0 - ratio
        assert found.stiffness == pytest.approx(math.pi**2 * found.E_star * R / math.log(32.0 * R / width), rel=error)


def test_deep_layer_is_the_half_space_and_thin_layer_a_foundation():
    """The layer tends to the half-space as 1/H, and to E* area/H when it is thin."""
    half_space = ring_stamp(**RING).stiffness
    gap = [ring_stamp(H=H, **RING).stiffness / half_space - 1.0 for H in (1e3, 2e3)]
    assert gap[0] < 0.02
    assert gap[0] / gap[1] == pytest.approx(2.0, rel=0.02)
    for base in ("smooth", "bonded"):
        assert ring_stamp(H=1e7, base=base, **RING).stiffness == pytest.approx(half_space, rel=2e-6)
    thin = ring_stamp(H=0.1, n=96, **RING)
    assert thin.mean_pressure * 0.1 / thin.E_star == pytest.approx(1.0, abs=0.04)


def test_pressure_carries_the_force():
    """The pressure integrates to the stiffness and is zero off the ring."""
    found = ring_stamp(H=10.0, **RING)
    theta = (np.arange(400) + 0.5) * np.pi / 400
    r = 10.0 + 2.0 * np.cos(theta)
    carried = np.sum(found.pressure(r) * 2.0 * np.pi * r * 2.0 * np.sin(theta)) * np.pi / 400
    assert carried == pytest.approx(found.stiffness, rel=1e-10)
    assert np.all(found.pressure([0.0, 7.999, 12.001]) == 0.0)
    assert found.pressure(10.0, delta=0.5) == pytest.approx(0.5 * float(found.pressure(10.0)), rel=1e-14)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("inner", {"inner": 12.0}),
        ("inner", {"inner": 0.0}),
        ("H", {"H": -1.0}),
        ("base", {"base": "x"}),
        ("n", {"n": 2}),
    ],
)
def test_errors_name_the_argument(name, change):
    """A senseless argument is refused by name."""
    with pytest.raises(ValueError, match=f"^{name} = "):
        ring_stamp(**{**RING, **change})
