"""Sections of bent metal against closed forms, and what a run reports of strips that bend past yield against finer meshes."""

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.thin import strips
from prensa.system.bending import BentStrips, stiffness_errors
from prensa.system.bent_sections import BentMetal

E, NU, YIELD = 200e3, 0.3, 300.0


def perfect(stress_free):
    """A metal that does not harden."""
    return BentMetal(E, NU, lambda strain: np.full(len(strain), YIELD), stress_free)


@pytest.mark.parametrize("times", [0.5, 1.0, 1.3, 2.0, 5.0])
def test_the_moment_of_a_section_in_plane_stress_is_the_closed_form(times):
    """M/M_y = κ/κ_y before yield, and 3/2 − ½ (κ_y/κ)² after it."""
    bend, first = np.array([times * 2.0 * YIELD / E]), YIELD / 6.0
    expected = first * (times if times <= 1.0 else 1.5 - 0.5 / times**2)
    assert perfect(True).moments(bend)[0] == pytest.approx(expected, rel=5e-4)


def test_the_moments_in_plane_strain_are_those_of_the_plate_and_of_full_flow():
    """E/(1 − ν²) κ/12 before yield, and 2/√3 σ_y/4 far beyond."""
    metal = perfect(False)
    assert metal.moments(np.array([1e-4]))[0] == pytest.approx(E / (1.0 - NU**2) * 1e-4 / 12.0, rel=5e-4)
    assert metal.moments(np.array([0.5]))[0] == pytest.approx(2.0 / np.sqrt(3.0) * YIELD / 4.0, rel=2e-3)


@pytest.mark.parametrize("space", ["plane strain", "plane stress"])
@pytest.mark.parametrize("n", [(20, 1), (27, 3), (10, 2), (60, 8)])
def test_elastic_layers_err_by_what_check_reports(space, n):
    """The same formula as `stiffness_errors`, from the points of the elements."""
    mesh = pr.discretise(strip(n, space, 1e-3)).meshes["strip"]
    found = BentStrips.of(mesh)
    s = strips(mesh)
    row, _ = s.thin
    expected = stiffness_errors(s, row, 1 - row, NU, space)
    assert (found.layers == n[1]).all() and len(found.layers) == n[0]
    metal, bend = perfect(space == "plane stress"), np.full(n[0], 1e-6)
    error = metal.moments_of_layers(bend, found.layers, found.length / found.thickness) / metal.moments(bend) - 1.0
    assert error == pytest.approx(expected[0], abs=2e-3)


def test_curvatures_are_those_of_an_arc():
    """A strip bent to a radius of 50, and turned besides."""
    mesh = pr.discretise(strip((12, 2), "plane strain", 1e-3)).meshes["strip"]
    angle, radius = mesh.points[:, 0] / 50.0 + 0.4, 50.0 + mesh.points[:, 1]
    bent = np.stack([radius * np.sin(angle), radius * np.cos(angle)], axis=1)
    assert np.abs(BentStrips.of(mesh).curvatures(bent)) == pytest.approx(0.02, rel=1e-9)


def strip(n, space, way, element=None):
    """A clamped strip 15 long whose end is lowered."""
    steps = [pr.Step("bend", fixed={"strip.bottom-right": pr.Fixed(y=-way)}, increments=8)]
    body = pr.Body(pr.Rectangle((15.0, 1.0), n=n), pr.J2(E, NU, pr.Linear(YIELD, 1000.0)), element)
    return pr.Problem("strip", bodies={"strip": body}, fixed={"strip.left": "xy"}, steps=steps, space=space)


def lowered(problem, caplog):
    """The force at the end, and what is said of bending past yield."""
    caplog.clear()
    *_, last = pr.solve(problem)
    return last.supports["strip.bottom-right"].y, [words for words in caplog.messages if "past yield" in words]


@pytest.mark.parametrize(("way", "element", "reported"), [
    (0.55, None, True), (0.4, None, True), (0.1, None, False), (0.55, "q4_fbar", False),
])  # fmt: skip
def test_a_strip_that_bends_past_yield_is_reported_with_its_error(way, element, reported, caplog):
    """Of three layers, 4 % too stiff in elasticity: against elements a quarter as long. A named element is not asked about."""
    force, said = lowered(strip((27, 3), "plane strain", way, element), caplog)
    assert bool(said) == reported
    if said:
        error = force / lowered(strip((108, 12), "plane strain", way), caplog)[0] - 1.0
        assert float(said[0].partition("estimated ")[2].partition(" %")[0]) / 100.0 == pytest.approx(error, abs=0.02)
        assert "too stiff" in said[0]
