"""Limit loads, tubes, rough plates and the slab method."""

import math

import numpy as np
import pytest

from prensa.reference import (
    prandtl_punch,
    rough_plates_cycloid,
    rough_plates_slab,
    slab_cylinder,
    slab_strip,
    tube_expansion,
    tube_pressure,
)


def test_prandtl_punch():
    """The flat punch carries (2 + pi) k."""
    assert prandtl_punch(100.0) == pytest.approx(514.159265)


def test_tube():
    """The tube yields first at k (1 - a^2/b^2), fully at 2 k ln(b/a), and its expansion starts there."""
    k = 250.0 / math.sqrt(3.0)
    assert tube_pressure(k, 10.0, 20.0, 10.0) == pytest.approx(0.75 * k)
    assert tube_pressure(k, 10.0, 20.0) == pytest.approx(2.0 * k * math.log(2.0))
    grown = [tube_pressure(k, 10.0, 20.0, c) for c in np.linspace(10.0, 20.0, 11)]
    assert np.all(np.diff(grown) > 0.0)
    pressure = tube_expansion(250.0, 10.0, 20.0, [10.0, 15.0, 30.0])
    assert pressure[0] == pytest.approx(tube_pressure(k, 10.0, 20.0))
    assert pressure[1] == pytest.approx(250.0 / math.sqrt(3.0) * math.log(525.0 / 225.0))
    assert np.all(np.diff(pressure) < 0.0)


def test_rough_plates():
    """The cycloids lie a quarter below the slab with full friction, whatever the width."""
    for b, h in ((20.0, 5.0), (50.0, 4.0)):
        assert rough_plates_slab(b, h) - rough_plates_cycloid(b, h) == pytest.approx(0.25)
    assert rough_plates_cycloid(20.0, 5.0) == pytest.approx(2.75)
    assert rough_plates_slab(20.0, 5.0, m=0.0) == 1.0


def test_slab_means_are_the_closed_forms():
    """The integrated pressure of strip and cylinder equals the textbook mean."""
    for mu in (0.01, 0.1, 0.4):
        z = 2.0 * mu * 10.0 / 5.0
        strip = slab_strip(b=10.0, h=5.0, mu=mu, k=100.0)
        assert strip.mean == pytest.approx(200.0 * math.expm1(z) / z, rel=1e-12)
        cylinder = slab_cylinder(R=10.0, h=5.0, mu=mu, Y=100.0)
        assert cylinder.mean == pytest.approx(100.0 * 2.0 * (math.expm1(z) - z) / z**2, rel=1e-9)


@pytest.mark.parametrize(
    "solve",
    [lambda **a: slab_strip(b=10.0, h=2.0, k=100.0, **a), lambda **a: slab_cylinder(R=10.0, h=2.0, Y=200.0, **a)],
)
def test_slab_equilibrium_with_a_shear_limit(solve):
    """Everywhere dp/dx = -2 tau/h with tau the smaller of mu p and the limit; p is continuous, sigma at the edge."""
    found = solve(mu=0.2, m=0.9)
    assert 0.0 < found.sticking < 10.0
    x = np.linspace(0.0, 10.0, 20_001)
    p = found.pressure(x)
    tau = np.minimum(0.2 * p, found.shear_limit)
    assert np.diff(p) / np.diff(x) == pytest.approx(-(tau[1:] + tau[:-1]) / found.h, rel=2e-3)
    assert p[-1] == pytest.approx(found.sigma)


def test_slab_limits():
    """Without friction the pressure is uniform; with the shear everywhere at its limit the strip is the rough plate."""
    assert slab_cylinder(R=10.0, h=2.0, mu=0.0, Y=200.0).mean == pytest.approx(200.0)
    rough = slab_strip(b=10.0, h=2.0, mu=0.6, k=100.0, m=0.8)
    assert rough.sticking == 10.0
    assert rough.mean / 200.0 == pytest.approx(rough_plates_slab(10.0, 2.0, m=0.8))
    disc = slab_cylinder(R=10.0, h=2.0, mu=0.6, Y=200.0, m=0.8)
    assert disc.mean == pytest.approx(200.0 + 2.0 * disc.shear_limit * 10.0 / (3.0 * 2.0))
    assert rough.pressure(10.5) == 0.0


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("k", lambda: prandtl_punch(0.0)),
        ("b", lambda: tube_pressure(1.0, 2.0, 1.0)),
        ("c", lambda: tube_pressure(1.0, 1.0, 2.0, 3.0)),
        ("a", lambda: tube_expansion(1.0, 1.0, 2.0, [0.5])),
        ("h", lambda: rough_plates_cycloid(1.0, 0.0)),
        ("m", lambda: rough_plates_slab(1.0, 1.0, m=1.1)),
        ("mu", lambda: slab_strip(b=1.0, h=1.0, mu=-0.1, k=1.0)),
        ("m", lambda: slab_cylinder(R=1.0, h=1.0, mu=0.1, Y=1.0, m=-1.0)),
    ],
)
def test_errors_name_the_argument(name, call):
    """A senseless argument is refused by name."""
    with pytest.raises(ValueError, match=f"^{name} = "):
        call()
