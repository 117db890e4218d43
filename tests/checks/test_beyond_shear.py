"""Friction beyond the shear yield stress on few layers of elements: the estimate against forces of friction that is limited."""

import re

import numpy as np
import pytest

import prensa as pr
from prensa.checks.after.beyond_shear import left
from prensa.verify.table import heard

WORDS = "friction beyond its shear yield stress"


def pressed(n, friction, space="plane strain", flow=None, size=(20.0, 2.0), by=0.2):
    """Force of a half of a strip or disc, and what is said of friction beyond the shear yield stress."""
    surfaces = {"top": ("b.right", "b.top"), "bot": ("b.bottom", "b.right")}
    problem = pr.Problem(
        "thin", space=space,
        bodies={"b": pr.Body(pr.Rectangle(size, n=n), pr.J2(2.1e5, 0.3, flow or pr.Voce(250.0, 0.0, 1.0)))},
        tools={"top": pr.Plane(touching="b.top"), "bot": pr.Plane(touching="b.bottom")},
        contacts=[pr.Contact(side, tool, friction=friction) for tool, side in surfaces.items()],
        fixed={"b.left": "x"}, steps=[pr.Step("press", move={"top": pr.Motion(y=-by)}, increments=5)],
    )  # fmt: skip
    with heard() as said:
        last = list(pr.solve(problem))[-1]
    return last.force("top").y, [words for words in said if WORDS in words]


def share_in(words):
    """The share of the force that is said to be too much."""
    return float(re.search(r"estimated ([\d.]+) %", words)[1]) / 100.0


def test_what_shear_leaves_is_that_of_layers_and_a_quarter_of_pi_of_many():
    friction = np.array([1.0, 2.0, 7.0, 0.0])
    assert left(friction, np.array([2000.0, 2.0, 1.0, 4.0])) == pytest.approx([np.pi / 4.0, 0.0, 1.0, 1.0], abs=1e-3)


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
@pytest.mark.parametrize(("n", "least", "most"), [((20, 2), 0.75, 1.25), ((20, 4), 1.0, 2.0)])
def test_the_excess_is_that_over_friction_limited_by_the_shear_strength(space, n, least, most):
    """The other run has the law that metal has, and nothing is said of it. Of four layers it is rougher."""
    force, said = pressed(n, pr.Coulomb(0.3), space)
    limited, silent = pressed(n, pr.Capped(mu=0.3), space)
    assert len(said) == 1 and not silent
    assert least < share_in(said[0]) / (force / limited - 1.0) < most


@pytest.mark.parametrize(("n", "size"), [((10, 1), (20.0, 2.0)), ((10, 1), (20.0, 1.0)), ((6, 1), (20.0, 1.0))])
def test_one_layer_carries_more_than_can_be_estimated(n, size):
    """Long elements or not, locked or not: 2 to 5 times what friction that is limited needs."""
    force, said = pressed(n, pr.Coulomb(0.3), size=size, by=0.1 * size[1])
    limited, silent = pressed(n, pr.Capped(mu=0.3), size=size, by=0.1 * size[1])
    assert len(said) == 1 and not silent and "more than" in said[0] and force / limited - 1.0 > share_in(said[0])


def test_metal_that_is_hard_at_its_surface_carries_its_friction():
    """Strain gathers below a surface that sticks: six layers are within 1.1 % of twenty-four."""
    _, said = pressed((15, 6), pr.Coulomb(0.214), flow=pr.Swift(K=800.0, e0=0.005, n=0.2), size=(9.3, 1.0), by=0.092)
    assert said == []


def test_blocks_and_weak_friction_are_not_reported():
    assert pressed((8, 8), pr.Coulomb(0.3), size=(4.0, 4.0))[1] == []
    assert pressed((20, 2), pr.Coulomb(0.05))[1] == []


@pytest.mark.parametrize("layers", [1, 2])
def test_plates_in_space_are_reported(layers):
    mesh = pr.Box((10.0, 1.0, 10.0), n=(5, layers, 5))
    problem = pr.Problem(
        "plate", space="solid", bodies={"b": pr.Body(mesh, pr.J2(2.1e5, 0.3, pr.Voce(250.0, 0.0, 1.0)))},
        tools={"top": pr.Plane(touching="b.top"), "bot": pr.Plane(touching="b.bottom")},
        contacts=[pr.Contact("b.top", "top", pr.Coulomb(0.3)), pr.Contact("b.bottom", "bot", pr.Coulomb(0.3))],
        fixed={"b.left": "x", "b.back": "z"}, steps=[pr.Step("press", move={"top": pr.Motion(y=-0.1)}, increments=5)],
    )  # fmt: skip
    with heard() as said:
        list(pr.solve(problem))
    assert any(WORDS in words for words in said)
