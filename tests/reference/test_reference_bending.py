"""Strip bending and springback."""

import math

import numpy as np
import pytest

from prensa.reference import bend_strip, bend_strip_perfect, bend_strip_power

STRIP = {"thickness": 1.0, "E": 7e4, "nu": 0.3}
CURVATURE = np.array([1e-3, 1.0 / 80.0, 1.0 / 40.0, 1.0 / 25.0])


def test_perfect_plasticity_has_the_textbook_springback():
    """The release follows R0/Rf = 4 z^3 - 3 z + 1, z = Y' R0/(E' t), and an elastic strip springs back flat."""
    found = bend_strip_perfect(CURVATURE, sigma_y=200.0, **STRIP)
    z = 2.0 / math.sqrt(3.0) * 200.0 / CURVATURE / (7e4 / 0.91)
    assert 1.0 / found.radius_ratio[1:] == pytest.approx((4.0 * z**3 - 3.0 * z + 1.0)[1:], rel=1e-12)
    assert found.released_curvature[0] == 0.0
    assert found.moment[0] == pytest.approx(7e4 / 0.91 / 12.0 * 1e-3)
    assert bend_strip_perfect(1e3, sigma_y=200.0, **STRIP).moment == pytest.approx(200.0 / math.sqrt(3.0) / 2.0)


@pytest.mark.parametrize(("space", "nu"), [("plane stress", 0.3), ("plane strain", 0.5)])
def test_exact_strip_equals_the_textbook_where_that_is_exact(space, nu):
    """Uniaxial fibres, and incompressible ones in plane strain, give the textbook moment without hardening."""
    strip = {**STRIP, "nu": nu, "space": space}
    exact = bend_strip(CURVATURE, flow=lambda k: 200.0, **strip)
    assert exact.moment == pytest.approx(bend_strip_perfect(CURVATURE, sigma_y=200.0, **strip).moment, rel=1e-9)


def test_exact_plane_strain_lies_below_the_textbook():
    """With nu = 0.3 the first yield is earlier: the exact moment is lower, by under 1 %, and tends to the limit."""
    exact = bend_strip(CURVATURE, flow=lambda k: 200.0, **STRIP).moment
    textbook = bend_strip_perfect(CURVATURE, sigma_y=200.0, **STRIP).moment
    assert np.all((exact <= textbook * (1.0 + 1e-12)) & (exact > 0.99 * textbook))
    assert 1.0 - exact[-1] / textbook[-1] < 1e-3


def test_power_law_is_the_exact_strip_of_that_curve():
    """A flow curve built from sigma = K eps^n of the total strain gives the closed-form moment."""
    from scipy.optimize import brentq

    K, n, E = 550.0, 0.22, 7e4
    first = (K / E) ** (1.0 / (1.0 - n))

    def flow(k):
        return brentq(lambda s: s - K * (s / E + k) ** n, 0.5 * E * first, K, xtol=1e-12) if k > 0.0 else E * first

    closed = bend_strip_power(CURVATURE, K=K, n=n, space="plane stress", **STRIP)
    exact = bend_strip(CURVATURE, flow=flow, space="plane stress", **STRIP)
    assert exact.moment == pytest.approx(closed.moment, rel=1e-8)
    assert exact.released_curvature == pytest.approx(closed.released_curvature, rel=1e-7, abs=1e-15)


def test_power_law_limits():
    """Sharp bends forget the elastic core; gentle ones are elastic; plane strain multiplies K by (2/sqrt 3)^(n + 1)."""
    K, n = 550.0, 0.22
    sharp = bend_strip_power(1.0, K=K, n=n, **STRIP)
    pure = 2.0 * K * (2.0 / math.sqrt(3.0)) ** (n + 1.0) * 0.5 ** (n + 2.0) / (n + 2.0)
    assert sharp.moment == pytest.approx(pure, rel=1e-4)
    gentle = bend_strip_power(1e-4, K=K, n=n, **STRIP)
    assert gentle.moment == pytest.approx(7e4 / 0.91 / 12.0 * 1e-4)
    assert gentle.released_curvature == 0.0


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("curvature", lambda: bend_strip_perfect(0.0, sigma_y=200.0, **STRIP)),
        ("sigma_y", lambda: bend_strip_perfect(0.1, sigma_y=0.0, **STRIP)),
        ("space", lambda: bend_strip_perfect(0.1, sigma_y=1.0, space="axisymmetric", **STRIP)),
        ("n", lambda: bend_strip_power(0.1, K=500.0, n=1.0, **STRIP)),
        ("K", lambda: bend_strip_power(0.1, K=1e5, n=0.2, **STRIP)),
        ("nu", lambda: bend_strip(0.1, flow=lambda k: 1.0, thickness=1.0, E=1.0, nu=0.7)),
    ],
)
def test_errors_name_the_argument(name, call):
    """A senseless argument is refused by name."""
    with pytest.raises(ValueError, match=f"^{name} = "):
        call()
