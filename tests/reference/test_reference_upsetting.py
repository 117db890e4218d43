"""Homogeneous upsetting with elasticity, ring and necking."""

import math

import numpy as np
import pytest

from prensa.reference import (
    considere,
    ring_bore_change,
    ring_compression_calibration,
    uniaxial_compression,
    upset_cylinder,
    upset_plane_strain,
    upset_plane_stress,
)
from prensa.reference.tables import RING_BORE_CHANGE, UPSETTING_FORCE, UPSETTING_REDUCTION

STEEL = {"E": 2e5, "nu": 0.3}


def flow(strain):
    return 250.0 + 500.0 * strain**0.3


def perfect(strain):
    return 250.0


@pytest.mark.parametrize("yield_on", ["cauchy", "kirchhoff"])
def test_cylinder_reproduces_the_independent_forces(yield_on):
    """Force and radius of frictionless upsetting agree with the independent numbers to their last digit."""
    found = upset_cylinder(UPSETTING_REDUCTION, R=10.0, flow=flow, yield_on=yield_on, **STEEL)
    assert found.force / 1e3 == pytest.approx(np.array(UPSETTING_FORCE[yield_on]), abs=6e-4)
    if yield_on == "cauchy":
        assert found.size[-1] == pytest.approx(14.1323, abs=6e-5)


def test_cylinder_is_consistent():
    """Volume is J times the initial one, the stress is the flow stress, and an elastic start obeys Hooke."""
    reduction = np.array([0.0, 1e-4, 0.1, 0.5])
    found = upset_cylinder(reduction, R=10.0, flow=flow, **STEEL)
    assert found.lateral_stretch**2 * (1.0 - reduction) == pytest.approx(found.J, rel=1e-13)
    assert found.stress[2:] == pytest.approx(flow(found.plastic_strain[2:]), rel=1e-11)
    assert found.force[0] == 0.0
    assert found.stress[1] == pytest.approx(2e5 * 1e-4, rel=3e-4)
    assert found.lateral_stretch[1] - 1.0 == pytest.approx(0.3e-4, rel=1e-3)


def test_stiff_cylinder_is_rigid_plastic():
    """As E grows the force tends to sigma_y(ln h0/h) A0 h0/h, with an error like 1/E."""
    rigid = flow(math.log(2.0)) * math.pi * 100.0 * 2.0
    errors = [abs(float(upset_cylinder(0.5, R=10.0, flow=flow, E=E, nu=0.3).force) / rigid - 1.0) for E in (2e6, 2e7)]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.02)
    assert errors[1] < 4e-5


def test_plane_stress_is_uniaxial():
    """A plate with free faces carries the stress of the cylinder and thins by the same stretch as it widens."""
    plate = upset_plane_stress([0.1, 0.5], width=10.0, flow=flow, **STEEL)
    stress, stretch, _, _ = uniaxial_compression([0.1, 0.5], flow=flow, **STEEL)
    assert plate.force == pytest.approx(stress * 10.0 * stretch**2, rel=1e-14)


def plane_strain_by_steps(reduction, steps, yield_on):
    """Backward Euler on principal logarithmic strains with tau_x = 0: an independent, first-order integrator."""
    E, nu = STEEL["E"], STEEL["nu"]
    bulk, shear = E / (3.0 * (1.0 - 2.0 * nu)), E / (2.0 * (1.0 + nu))
    e, kappa, lateral = np.zeros(3), 0.0, 0.0
    d = math.log(1.0 - reduction) / steps
    for _ in range(steps):
        dx = -d * 0.5
        for _ in range(30):  # secant on the lateral strain for tau_x = 0
            values = []
            for guess in (dx, dx + 1e-8):
                trial = e + np.array([guess, d, 0.0])
                volume = trial.sum()
                dev = trial - volume / 3.0
                q = 2.0 * shear * math.sqrt(1.5) * np.linalg.norm(dev)
                J = math.exp(volume) if yield_on == "cauchy" else 1.0
                low, high = 0.0, q / (3.0 * shear)
                if q > J * flow(kappa):
                    for _ in range(60):
                        mid = 0.5 * (low + high)
                        low, high = (mid, high) if q - 3.0 * shear * mid > J * flow(kappa + mid) else (low, mid)
                    gain = low
                else:
                    gain = 0.0
                elastic = dev * (1.0 - 3.0 * shear * gain / q) + volume / 3.0
                values.append((bulk * volume + 2.0 * shear * (elastic[0] - volume / 3.0), elastic, gain, J))
            move = -values[0][0] * 1e-8 / (values[1][0] - values[0][0])
            if abs(move) < 1e-13:
                break
            dx += move
        _, e, gain, _ = values[0]
        kappa += gain
        lateral += dx
    volume = e.sum()
    tau_y = bulk * volume + 2.0 * shear * (e[1] - volume / 3.0)
    return -tau_y / math.exp(volume) * math.exp(lateral), kappa


@pytest.mark.parametrize("yield_on", ["cauchy", "kirchhoff"])
def test_plane_strain_agrees_with_a_return_map(yield_on):
    """A backward Euler return map, written here, tends at first order to the integrated plane-strain force."""
    exact = upset_plane_strain(0.02, width=1.0, flow=flow, yield_on=yield_on, **STEEL)
    errors = []
    for steps in (50, 100):
        force, kappa = plane_strain_by_steps(0.02, steps, yield_on)
        errors.append(force / float(exact.force) - 1.0)
        assert kappa == pytest.approx(float(exact.plastic_strain), rel=5e-3)
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert abs(2.0 * errors[1] - errors[0]) < 2e-6  # extrapolated


def test_plane_strain_incompressible_is_closed_form():
    """With nu = 1/2 the stress ratio is 1/2 throughout: stress (2/sqrt 3) flow(kappa), kappa = (2/sqrt 3) strain."""
    reduction = np.array([0.05, 0.3, 0.5])
    found = upset_plane_strain(reduction, width=10.0, flow=flow, E=2e5, nu=0.5)
    root = 2.0 / math.sqrt(3.0)
    assert found.stress == pytest.approx(root * flow(found.plastic_strain), rel=1e-11)
    elastic = found.stress / (2e5 / 0.75)
    assert found.plastic_strain == pytest.approx(root * (-np.log1p(-reduction) - elastic), rel=1e-9)
    assert found.force == pytest.approx(found.stress * 10.0 / (1.0 - reduction), rel=1e-11)


def test_plane_strain_elastic_start_and_plastic_limit():
    """The force starts with E/(1 - nu^2), and without hardening the stress tends to 2/sqrt 3 of the yield stress."""
    found = upset_plane_strain([0.0, 1e-4, 0.3], width=10.0, flow=perfect, **STEEL)
    assert found.force[0] == 0.0
    assert found.force[1] == pytest.approx(2e5 / 0.91 * 1e-4 * 10.0, rel=3e-4)
    assert found.stress[2] / 250.0 == pytest.approx(2.0 / math.sqrt(3.0), rel=1e-7)
    assert found.lateral_stretch * (1.0 - found.reduction) == pytest.approx(found.J, rel=1e-9)


def test_ring_without_friction():
    """The bore of a frictionless ring grows as tabulated, with elasticity and (calibration table) without."""
    found = 100.0 * ring_bore_change(UPSETTING_REDUCTION, flow=flow, **STEEL)
    assert found == pytest.approx(np.array(RING_BORE_CHANGE[0.0]), abs=0.006)
    table = ring_compression_calibration()
    assert ring_bore_change(table.reduction) == pytest.approx(table.curve("mu=0"), abs=2e-4)


def test_considere_of_the_published_bar():
    """The bar necks at 79.73 kN and half-elongation 3.46 as a rigid-plastic one; elasticity lowers that by 0.2 %."""

    def curve(k):
        return 450.0 + 129.24 * k + 265.0 * (1.0 - math.exp(-16.93 * k))

    area = math.pi * 6.413**2
    rigid = considere(curve, area=area, length=53.334)
    assert rigid.force / 1e3 == pytest.approx(79.73, abs=0.005)
    assert rigid.elongation / 2.0 == pytest.approx(3.46, abs=0.005)
    elastic = considere(curve, area=area, length=53.334, E=206_900.0, nu=0.29)
    assert elastic.force / 1e3 == pytest.approx(79.576, abs=0.001)
    assert elastic.elongation / 2.0 == pytest.approx(3.560, abs=0.001)


def test_considere_of_a_power_law():
    """For K (e0 + kappa)^n the force is largest at kappa = n - e0; a perfectly plastic bar necks at once."""
    found = considere(lambda k: 500.0 * (0.01 + k) ** 0.2, area=2.0, length=10.0)
    assert found.plastic_strain == pytest.approx(0.19, abs=1e-6)
    assert found.force == pytest.approx(1000.0 * 0.2**0.2 * math.exp(-0.19), rel=1e-12)
    assert found.elongation == pytest.approx(10.0 * math.expm1(0.19), rel=1e-5)
    assert considere(perfect, area=2.0, length=10.0).plastic_strain == 0.0


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("reduction", lambda: upset_cylinder(1.0, R=10.0, flow=flow, **STEEL)),
        ("R", lambda: upset_cylinder(0.1, R=-1.0, flow=flow, **STEEL)),
        ("width", lambda: upset_plane_strain(0.1, width=0.0, flow=flow, **STEEL)),
        ("yield_on", lambda: upset_plane_strain(0.1, width=1.0, flow=flow, yield_on="tau", **STEEL)),
        (r"flow\(0\)", lambda: upset_cylinder(0.1, R=1.0, flow=lambda k: 500.0 * k**0.2, **STEEL)),
        ("flow, E, nu", lambda: ring_bore_change(0.1, flow=flow)),
        ("E, nu", lambda: considere(flow, area=1.0, length=1.0, E=2e5)),
        (r"flow\(5.0\)", lambda: considere(lambda k: math.exp(2.0 * k), area=1.0, length=1.0)),
    ],
)
def test_errors_name_the_argument(name, call):
    """A senseless argument is refused by name."""
    with pytest.raises(ValueError, match=f"^{name} = "):
        call()
