"""Hertz line and point contact."""

import numpy as np
import pytest

from prensa.reference import (
    cylinder_on_layer_table,
    hertz_line,
    hertz_line_from_a,
    hertz_sphere,
    hertz_sphere_from_a,
    hertz_sphere_from_delta,
)


def test_line_reproduces_the_tabulated_columns():
    """The line contact at the tabulated forces gives the tabulated Hertz half-width and peak pressure."""
    table = cylinder_on_layer_table()
    for P, a, p0 in zip(table["P"], table["a_hertz"], table["p0_hertz"]):
        found = hertz_line(P, 80.0, 1e4, 0.3)
        assert found.a == pytest.approx(a, rel=1e-7)
        assert found.p0 == pytest.approx(p0, rel=1e-7)


def test_line_pressure_carries_the_force():
    """The pressure of the line contact integrates to P, vanishes at the edge and outside."""
    found = hertz_line(3000.0, 80.0, 1e4, 0.3)
    theta = np.linspace(0.0, np.pi, 2001)
    x = -found.a * np.cos(theta)
    assert np.trapezoid(found.pressure(x) * found.a * np.sin(theta), theta) == pytest.approx(3000.0, rel=1e-6)
    assert np.all(found.pressure([found.a, -1.01 * found.a]) == 0.0)


def test_line_inverse():
    """From the half-width back to the force is the identity."""
    forward = hertz_line(3000.0, 80.0, 1e4, 0.3)
    back = hertz_line_from_a(forward.a, 80.0, 1e4, 0.3)
    assert (back.P, back.p0) == pytest.approx((forward.P, forward.p0), rel=1e-13)


def test_sphere_is_consistent():
    """The three entries of the point contact agree, dP/d(delta) = 2 E* a, and the pressure integrates to P."""
    forward = hertz_sphere(1e3, 50.0, 2e5, 0.3)
    for other in (
        hertz_sphere_from_a(forward.a, 50.0, 2e5, 0.3),
        hertz_sphere_from_delta(forward.delta, 50.0, 2e5, 0.3),
    ):
        assert (other.P, other.p0, other.delta) == pytest.approx((1e3, forward.p0, forward.delta), rel=1e-12)
    step = 1e-5 * forward.delta
    ends = [hertz_sphere_from_delta(forward.delta + s, 50.0, 2e5, 0.3).P for s in (step, -step)]
    assert (ends[0] - ends[1]) / (2.0 * step) == pytest.approx(2.0 * forward.E_star * forward.a, rel=1e-8)
    theta = np.linspace(0.0, np.pi / 2.0, 4001)
    r = forward.a * np.sin(theta)
    carried = np.trapezoid(forward.pressure(r) * 2.0 * np.pi * r * forward.a * np.cos(theta), theta)
    assert carried == pytest.approx(1e3, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("P", (-1.0, 80.0, 1e4, 0.3)),
        ("R", (1.0, 0.0, 1e4, 0.3)),
        ("E", (1.0, 80.0, 0.0, 0.3)),
        ("nu", (1.0, 8.0, 1.0, 0.6)),
    ],
)
def test_errors_name_the_argument(name, arguments):
    """A senseless argument is refused by name."""
    for solution in (hertz_line, hertz_sphere):
        with pytest.raises(ValueError, match=f"^{name} = "):
            solution(*arguments)
