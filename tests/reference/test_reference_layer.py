"""Cylinder on an elastic layer."""

import math

import numpy as np
import pytest

from prensa.reference import (
    cylinder_on_layer_pressure,
    cylinder_on_layer_table,
    hertz_line,
    layer_kernel,
    layer_kernel_defect,
    layer_line,
)

BLOCK = {"R": 80.0, "H": 40.0, "E": 1e4, "nu": 0.3}


def kernel_from_airy(w: float, base: str, nu: float) -> float:
    """Solve the plane-strain layer 0 > z > -1 under p = cos wx for the constants of its Airy function.

    phi = [(A + Bz) e^(wz) + (C + Dz) e^(-wz)] cos wx; 2G u_z = -phi_z + (1 - nu) psi_x, psi_xz = laplacian(phi).
    """
    up, down = math.exp(-w), math.exp(w)  # e^(wz), e^(-wz) at z = -1
    slope = [w * up, up - w * up, -w * down, down + w * down]  # f'(-1)
    value = [up, -up, down, -down]  # f(-1)
    twist = 2.0 * (1.0 - nu)
    u_z = [-slope[0], -slope[1] + twist * up, -slope[2], -slope[3] + twist * down]
    u_x = [w * value[0], w * value[1] + twist * up, w * value[2], w * value[3] - twist * down]
    rows = [[w * w, 0.0, w * w, 0.0], [w, 1.0, -w, 1.0], u_z, slope if base == "smooth" else u_x]
    A, B, C, D = np.linalg.solve(np.array(rows), [1.0, 0.0, 0.0, 0.0])
    surface = -(w * A + B - w * C + D) + twist * (B + D)  # 2G u_z(0)
    return -surface * w / (2.0 * (1.0 - nu))  # u = 2 L/(E* w), E*/2G = 1/(1 - nu)


@pytest.mark.parametrize("base", ["smooth", "bonded"])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_kernel_solves_the_equations_of_elasticity(base, nu):
    """The closed form of the kernel equals the compliance found by solving the layer's boundary value problem."""
    for w in (0.05, 0.3, 1.0, 2.5, 6.0):
        assert float(layer_kernel(w, base, nu)) == pytest.approx(kernel_from_airy(w, base, nu), rel=1e-8)
        assert float(layer_kernel_defect(w, base, nu)) == pytest.approx(1.0 - kernel_from_airy(w, base, nu), abs=1e-9)


def test_kernel_limits():
    """Long waves see a uniaxial foundation (smooth: E*, bonded: constrained modulus), short waves a half-space."""
    w, nu = 1e-4, 0.3
    constrained = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) * (1.0 - nu * nu)  # over E*
    assert float(layer_kernel(w, "smooth")) == pytest.approx(w / 2.0, rel=1e-6)
    assert float(layer_kernel(w, "bonded", nu)) == pytest.approx(w / 2.0 / constrained, rel=1e-6)
    for base in ("smooth", "bonded"):
        assert float(layer_kernel(800.0, base, nu)) == 1.0
        assert float(layer_kernel(0.0, base, nu)) == 0.0


def test_reproduces_the_independent_table():
    """Half-width, force and peak pressure agree with an independent solution of the same equation to 1e-7."""
    table = cylinder_on_layer_table()
    for delta, a, P, p0 in zip(table["delta"], table["a"], table["P"], table["p0"]):
        found = layer_line(delta=delta, **BLOCK)
        assert (found.a, found.P, found.p0) == pytest.approx((a, P, p0), rel=1e-7)


@pytest.mark.parametrize("delta", [0.1, 0.5, 1.0, 2.0])
def test_reproduces_the_independent_pressure(delta):
    """The pressure profile agrees with the independent one to 1e-6 of the peak within 0.999 of the half-width."""
    table = cylinder_on_layer_pressure(delta)
    found = layer_line(delta=delta, **BLOCK)
    inside = np.abs(table["x"]) < 0.999 * found.a  # at the edge the rounded x decides
    assert np.abs(found.pressure(table["x"]) - table["p"])[inside].max() < 1e-6 * found.p0
    assert found.pressure(1.0001 * found.a) == 0.0


@pytest.mark.parametrize("base", ["smooth", "bonded"])
def test_deep_layer_is_hertz(base):
    """On ever deeper layers the half-width and the peak pressure at given P tend to Hertz, with error ~ (a/H)^2."""
    P = hertz_line(3000.0, 80.0, 1e4, 0.3)
    errors = []
    for H in (80.0, 160.0, 320.0, 2560.0):
        found = layer_line(R=80.0, H=H, E=1e4, nu=0.3, P=3000.0, base=base, profile="parabola")
        errors.append(max(abs(found.a / P.a - 1.0), abs(found.p0 / P.p0 - 1.0)))
    assert errors[-1] < 1e-5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.1)


def test_thin_layer_is_a_foundation():
    """On ever thinner smooth layers the force tends to a Winkler foundation's, P = (4/3) E*/H delta sqrt(2 R delta)."""
    errors = []
    for H in (1.0, 0.5, 0.25):
        delta = 0.05
        found = layer_line(R=1000.0, H=H, E=1e4, nu=0.3, delta=delta, profile="parabola", n=60)
        foundation = 4.0 / 3.0 * found.E_star / H * delta * math.sqrt(2.0 * 1000.0 * delta)
        errors.append(abs(found.P / foundation - 1.0))
    assert errors[2] < errors[1] < errors[0] < 0.1
    assert errors[2] < 0.02


def test_bonded_base_is_stiffer():
    """Holding the base against sliding raises the force at the same indentation."""
    assert layer_line(delta=1.0, base="bonded", **BLOCK).P > 1.02 * layer_line(delta=1.0, **BLOCK).P


def test_force_is_the_integral_and_entries_agree():
    """The pressure integrates to P; asking by delta, by a and by P gives the same state."""
    found = layer_line(delta=1.0, **BLOCK)
    theta = np.linspace(0.0, np.pi, 4001)
    carried = np.trapezoid(found.pressure(found.a * np.cos(theta)) * found.a * np.sin(theta), theta)
    assert carried == pytest.approx(found.P, rel=1e-6)
    for other in (layer_line(a=found.a, **BLOCK), layer_line(P=found.P, **BLOCK)):
        assert (other.a, other.P, other.delta) == pytest.approx((found.a, found.P, 1.0), rel=1e-10)


def test_converges_with_the_number_of_terms():
    """The error falls geometrically with the number of terms, to round-off."""
    exact = layer_line(a=20.0, n=48, **BLOCK).P
    errors = [abs(layer_line(a=20.0, n=n, **BLOCK).P / exact - 1.0) for n in (3, 6, 12, 24)]
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]
    assert errors[3] < 1e-11


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("H", {"H": 0.0, "delta": 1.0}),
        ("base", {"base": "glued", "delta": 1.0}),
        ("delta, a, P", {}),
        ("delta, a, P", {"delta": 1.0, "P": 2.0}),
        ("a", {"a": 80.0}),
        ("P", {"P": -1.0}),
        ("delta", {"delta": 500.0}),
        ("n", {"n": 1, "delta": 1.0}),
        ("profile", {"profile": "square", "delta": 1.0}),
    ],
)
def test_errors_name_the_argument(name, change):
    """A senseless argument is refused by name."""
    with pytest.raises(ValueError, match=f"^{name} = "):
        layer_line(**{**BLOCK, **change})
