"""Integration rules: areas, consistency, what is refused; the patch test and the table of rules are in the verification."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.verify import rules
from prensa.verify.balance import Balance


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
@pytest.mark.parametrize("rule", rules.RULES)
def test_areas_are_those_of_the_surface(space, rule):
    """Weights add up to the area; spread with the shape values they are ∫N_A dΓ, but for one Gauss point under 2πr."""
    system = pr.discretise(rules.patch(space, "small", rule, pr.Penalty()))
    points, X = system.surfaces[0].points, system.X
    w, whole = points.weights(X), np.pi * 4.0**2 if space == "axisymmetric" else 0.7 * 4.0
    assert np.isclose(w.sum(), whole, rtol=1e-14)
    assert np.isclose(points.tributary(X).sum(), whole, rtol=1e-14)
    same = np.allclose(points.to_nodes(w), points.tributary(X), rtol=1e-13)
    assert same == rules.consistent(space, rule)


@pytest.mark.parametrize("rule", rules.RULES)
def test_slopes_of_the_areas_are_their_derivatives(rule):
    """∂w/∂x by differences, on a surface of revolution."""
    system = pr.discretise(rules.patch("axisymmetric", "small", rule, pr.Penalty()))
    points, rng, h = system.surfaces[0].points, np.random.default_rng(0), 1e-6
    x = system.X + 0.05 * rng.normal(size=system.X.shape)
    d = rng.normal(size=x.shape)
    s = points.shares
    slope = np.einsum("sea,sea->s", points.slopes(x), d[points.edges[s.edge]])
    difference = (points.weights(x + h * d) - points.weights(x - h * d)) / (2 * h)
    assert np.allclose(np.bincount(s.point, slope, len(points)), difference, rtol=1e-6, atol=1e-8)


def test_nodal_pressures_of_kikuchi_are_those_of_two_gauss_points():
    """The displacements and nodal pressures are the same, the pressures at the points are the projected ones."""
    gauss, kikuchi = (
        Balance().last(rules.pressed(r, pr.Penalty(beta=1e5), h=2.0)).contacts["block.top-cylinder"]
        for r in ("gauss2", "kikuchi")
    )
    assert np.array_equal(gauss.pressure, kikuchi.pressure)
    order = np.argsort(kikuchi.X[:, 0])
    projected = np.interp(kikuchi.points.X[:, 0], kikuchi.X[order, 0], kikuchi.pressure[order])
    assert np.allclose(kikuchi.points.pressure, projected, rtol=1e-12)
    assert gauss.points.pressure.max() > 1.3 * kikuchi.points.pressure.max()


@pytest.mark.parametrize("rule", ["gauss2", "gauss3", "simpson", "kikuchi"])
def test_exact_multipliers_need_no_more_points_than_nodes(rule):
    """Rules whose multipliers would not be unique are refused with a remedy."""
    with pytest.raises(ValueError, match=r"more points than the surface has nodes.*use 'nodal'"):
        rules.patch("plane strain", "small", rule, pr.Exact())
