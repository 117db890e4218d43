from __future__ import annotations

import math

import numpy as np
import pytest

from prensa.reference import bend_strip, capstan, draw_bending
from prensa.reference.draw_bending import _Strip

STEEL = {"thickness": 0.8, "E": 206e3, "nu": 0.3}


def swift(strain):
    return 565.0 * (0.007 + strain) ** 0.26


def perfect(strain):
    return 200.0 + 0.0 * strain


def test_bending_alone_is_that_of_a_strip_by_pure_moment() -> None:
    """Without a pull the first bend has the moment of `bend_strip`, which is integrated another way, and no stretch."""
    strip = _Strip(STEEL["thickness"], swift, STEEL["E"], STEEL["nu"], 100)
    work = strip.go(1.0 / 5.4, 0.0, 15)
    bends = np.linspace(0.0, 1.0, 16)[1:] ** 2 / 5.4
    moments = bend_strip(bends, **STEEL, flow=swift).moment
    assert strip.moment == pytest.approx(float(moments[-1]), rel=5e-4)
    assert work == pytest.approx(float(np.trapezoid(np.append(0.0, moments), np.append(0.0, bends))), rel=2e-3)
    assert strip.stretch == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_a_stiff_perfectly_plastic_strip_takes_its_plastic_moment_twice() -> None:
    """Each change of curvature costs M_p/R with M_p = Y' t²/4, Y' = 2Y/√3; under a pull N only 1 − (N/Y't)² of it."""
    data = {**STEEL, "E": 206e6, "nu": 0.4999, "flow": perfect, "layers": 50}
    limit = 2.0 / math.sqrt(3.0) * 200.0 * STEEL["thickness"]
    plastic = 0.25 * limit * STEEL["thickness"]
    for pull in (0.0, 0.5 * limit):
        first = pull + plastic / 5.4 * (1.0 - (pull / limit) ** 2)
        second = first + plastic / 5.4 * (1.0 - (first / limit) ** 2)
        ours = draw_bending([5.0], [1.0], tension=pull, **data).tension
        assert ours - pull == pytest.approx(second - pull, rel=0.01)


def test_an_elastic_strip_gets_back_what_bending_took() -> None:
    """T + D κ²/2 is the same on both sides of a change of curvature (elastica); friction multiplies the pull on the arc."""
    data = {**STEEL, "flow": lambda strain: 1e9 + 0.0 * strain, "layers": 40, "steps": 10}
    found = draw_bending([50.0], [0.5 * math.pi], tension=10.0, mu=0.2, **data)
    bending = 0.5 * STEEL["E"] / (1.0 - 0.09) * STEEL["thickness"] ** 3 / 12.0 / 50.4**2
    assert found.tension == pytest.approx(capstan(10.0 + bending, 0.2, 0.5 * math.pi) - bending, rel=1e-3)
    assert found.curvature == pytest.approx(0.0, abs=1e-9) and found.moment == pytest.approx(0.0, abs=1e-6)


def test_a_bead_is_the_sum_of_its_radii_and_sides_do_not_matter() -> None:
    """The pull grows at each radius; the mirror image of a bead takes as much and curls the other way of the same sense."""
    data = {**STEEL, "tension": 5.0, "flow": swift, "mu": 0.1, "layers": 40, "steps": 20}
    bead = draw_bending([5.0, -5.0, 5.0], [0.7, 1.4, 0.7], **data)
    mirror = draw_bending([-5.0, 5.0, -5.0], [0.7, 1.4, 0.7], **data)
    assert bead.tension == bead.tensions[-1] == pytest.approx(mirror.tension, rel=1e-9)
    assert bead.curvature == pytest.approx(mirror.curvature, rel=1e-6)
    assert 5.0 < bead.tensions[0] < bead.tensions[1] < bead.tensions[2]


def test_what_cannot_be_is_refused() -> None:
    """A pull beyond the strength of the strip, and radii without angles."""
    with pytest.raises(ValueError, match="more than the strip can bear"):
        draw_bending([5.0], [1.0], tension=200.0, flow=perfect, **STEEL)
    with pytest.raises(ValueError, match="give one angle for each radius"):
        draw_bending([5.0, 5.0], [1.0], tension=1.0, flow=swift, **STEEL)
