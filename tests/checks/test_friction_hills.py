"""What long elements make of the friction hill: the estimate against closed forms, and reports of runs against finer meshes."""

import numpy as np
import pytest

from prensa.checks.after.friction_hills import Slab
from prensa_bench.marks import answer, draw, verdict

EDGE, MU, THICK = 3.0, 0.2, 0.5
"""Pressure at the edge, coefficient of friction (of both sides together), thickness."""


def hill(n, length):
    """The pressures at the n + 1 sections of n elements from an edge on, each in balance with the friction of its nodes."""
    a = MU * length / (2.0 * THICK)
    elements = EDGE / (1.0 - a) * ((1.0 + a) / (1.0 - a)) ** np.arange(n + 1)
    return np.append(elements[0], 0.5 * (elements[1:] + elements[:-1])), length * elements[:n].sum()


def slab(pressure, friction, length):
    """Strips between the sections of these."""
    of = np.arange(len(pressure) - 1)[:, None] + np.arange(2)
    one = np.ones(len(of))
    return Slab(of, length * one, THICK * one, one, pressure[of], friction[of])


@pytest.mark.parametrize(("n", "length"), [(1, 1.0), (4, 1.5), (6, 0.5), (40, 0.1)])
def test_the_excess_of_a_sliding_slab_is_that_over_the_integral(n, length):
    """∫ p₀ exp(μ x/h) dx is what the elements should carry."""
    pressure, force = hill(n, length)
    exact = EDGE * THICK / MU * np.expm1(MU * n * length / THICK)
    found = slab(pressure, MU * pressure, length)
    assert [found.excess(a) for a in found.exponents()] == pytest.approx([force - exact] * 2, rel=1e-9)
    assert found.share()[1] == pytest.approx(0.0, abs=1e-9)


def test_friction_that_does_not_grow_is_no_hill():
    """At its shear strength friction is constant, and linear elements carry the linear pressure exactly."""
    pressure = np.linspace(1.0, 5.0, 6)
    assert slab(pressure, np.full(6, 0.4), 2.0).share() == (0.0, 0.0)


def test_pressure_that_grows_for_another_reason_is_no_hill():
    """At the edge of a punch on a block that is thick: friction follows the pressure, and is much too weak to make it grow."""
    pressure, _ = hill(4, 1.5)
    thick = slab(pressure, MU * pressure, 1.5)
    thick = Slab(thick.sections, thick.length, 40.0 * thick.thickness, thick.width, thick.pressure, thick.friction)
    assert thick.share()[0] < 1e-3 < 1e-2 < slab(pressure, MU * pressure, 1.5).share()[0]


def test_a_plate_of_five_long_elements_is_reported():
    """8.4 % above elements half as long, in plates pressed to half their height; one of 2.4 % is not."""
    found, error, said = verdict(draw("bending", 9302, 35))
    assert found == "reported" and error > 0.05
    assert len(said) == 1 and "friction hill" in said[0] and "7 times as long" in said[0]
    mark = draw("bending", 9302, 55)
    assert answer(mark.problem, mark.measure)[1] == []


def test_two_estimates_that_differ_report_nothing():
    """Friction that would make the pressure grow by twice as much as it does: this is no slab, and no share of it is known."""
    pressure, _ = hill(4, 1.5)
    share, apart = slab(pressure, 2.0 * MU * pressure, 1.5).share()
    assert share < apart
