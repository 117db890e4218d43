"""Damage laws on paths of constant stress ratios, against tables and closed forms, and what registers them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import prensa as pr
from prensa.materials.damage_law import StressState
from prensa.reference.tables import damage_paths
from prensa.registry import DOORS, examples
from prensa.testing import LawError, check_damage

THIRD = 1.0 / math.sqrt(3.0)
RATIOS = {
    "uniaxial tension": (1.0, 0.0, 0.0),
    "uniaxial compression": (0.0, 0.0, -1.0),
    "plane strain tension (plane stress sheet)": (2 * THIRD, THIRD, 0.0),
    "equibiaxial tension (plane stress)": (1.0, 1.0, 0.0),
    "pure shear": (THIRD, 0.0, -THIRD),
    "plane strain compression (free to flow sideways)": (0.0, -THIRD, -2 * THIRD),
    "plane strain tension + hydrostatic pressure 0.5 sigma_bar": (2 * THIRD - 0.5, THIRD - 0.5, -0.5),
}
"""Principal stresses over σ̄."""


def flow(strain):
    """σ̄ of the table, MPa."""
    return 250.0 + 500.0 * strain**0.3


def along(law, path, strain):
    """D at a plastic strain on a path, by a quadrature that is exact for powers of ε̄^0.3."""
    t, w = np.polynomial.legendre.leggauss(20)
    t, w = 0.5 * (t + 1), 0.5 * w
    eps = strain * t**10
    sigma = flow(eps)
    at = StressState(np.array(RATIOS[path]) * sigma[:, None], sigma, eps)
    return float(law.rate(at) @ (w * strain * 10 * t**9))


TABLED = {
    "cockcroft_latham": pr.CockcroftLatham(),
    "cockcroft_latham_plain": pr.CockcroftLathamPlain(),
    "oyane_third": pr.Oyane(A=1 / 3, heals=True),
    "oyane_tenth": pr.Oyane(A=0.1, heals=True),
    "oyane_third_cut_off": pr.Oyane(A=1 / 3),
    "rice_tracey": pr.RiceTracey(),
    "plastic_work": pr.Freudenthal(),
}


@pytest.mark.parametrize("column", TABLED)
def test_laws_give_the_integrals_of_the_table(column):
    """Rigid-plastic paths of constant stress ratios: 1e-9 of the table's twelve digits."""
    for row in damage_paths():
        assert row.path in RATIOS
        expected = getattr(row, column)
        found = along(TABLED[column], row.path, row.strain)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9), row.path


@pytest.mark.parametrize("path", RATIOS)
def test_other_laws_give_their_closed_forms(path):
    """Ayada, Brozzo, McClintock, whose integrands are constant, and the ratio to a strength, the largest so far: 1e-12."""
    a, b, c = RATIOS[path]
    mean, eps = (a + b + c) / 3, 0.7
    assert along(pr.Ayada(), path, eps) == pytest.approx(max(mean, 0.0) * eps, rel=1e-12, abs=1e-12)
    assert along(pr.Ayada(heals=True), path, eps) == pytest.approx(mean * eps, rel=1e-12, abs=1e-12)
    assert along(pr.Brozzo(), path, eps) == pytest.approx(2 * max(a, 0.0) / (3 * (a - mean)) * eps, rel=1e-12, abs=1e-12)
    n, root = 0.2, math.sqrt(3.0)
    growth = root / (2 * (1 - n)) * math.sinh(root * (1 - n) / 2 * (a + b)) + 0.75 * (a - b)
    assert along(pr.McClintock(n=n, heals=True), path, eps) == pytest.approx(growth * eps, rel=1e-12, abs=1e-12)
    assert along(pr.McClintock(n=n), path, eps) == pytest.approx(max(growth, 0.0) * eps, rel=1e-12, abs=1e-12)
    assert along(pr.RiceTracey(c=0.283, cut_off=-9), path, eps) == pytest.approx(0.283 * math.exp(1.5 * mean) * eps, rel=1e-12)


def states(stresses, strains):
    """States of one point, by principal stresses."""
    principal = -np.sort(-np.array(stresses, dtype=float), axis=1)
    d = principal - principal.mean(axis=1, keepdims=True)
    equivalent = np.sqrt(1.5 * (d**2).sum(axis=1))
    return [StressState(principal[k : k + 1], equivalent[k : k + 1], np.array([e])) for k, e in enumerate(strains)]


def test_increments_are_trapezoidal_and_flow_begins_with_its_own_stress():
    """Between plastic states the mean of both ends; from an elastic one the end's; nothing without plastic strain."""
    law, none = pr.CockcroftLathamPlain(), np.zeros(1)
    elastic, first, second, unloaded = states(
        [(100, 0, 0), (300, 0, 0), (400, 10, 0), (-50, 0, 0)], [0.0, 0.01, 0.03, 0.03]
    )
    assert law.grown(none, elastic, first)[0] == 300 * 0.01
    assert law.grown(np.array([3.0]), first, second)[0] == pytest.approx(3.0 + 350 * 0.02, rel=1e-15)
    assert law.grown(np.array([3.0]), second, unloaded)[0] == 3.0


def test_the_ratio_to_a_strength_is_the_largest_so_far():
    """Elastic states count, and damage stays when the stress falls."""
    law, d = pr.StressRatio(strength=200.0), np.zeros(1)
    rest, tension, compression = states([(0, 0, 0), (150, 20, -10), (-300, -20, -10)], [0.0, 0.0, 0.1])
    d = law.grown(d, rest, tension)
    assert d[0] == 0.75 and law.grown(d, tension, compression)[0] == 0.75
    assert law.limit == 1.0 and pr.StressRatio(strength=200.0, limit=0.8).limit == 0.8


def test_principal_stresses_of_components():
    """Of any stress in the plane the eigenvalues of its matrix, the greatest first: 1e-12."""
    rng = np.random.default_rng(3)
    stress = rng.normal(size=(50, 4))
    found = StressState.at(stress, np.ones(50), np.zeros(50))
    matrices = np.zeros((50, 3, 3))
    matrices[:, 0, 0], matrices[:, 1, 1], matrices[:, 2, 2] = stress[:, :3].T
    matrices[:, 0, 1] = matrices[:, 1, 0] = stress[:, 3]
    assert np.abs(found.principal - np.linalg.eigvalsh(matrices)[:, ::-1]).max() < 1e-12
    assert np.allclose(found.mean, stress[:, :3].mean(axis=1), atol=1e-14)


@pytest.mark.parametrize("name", examples("damage"))
def test_every_law_passes_the_suite_that_laws_inherit(name):
    """Finite, pure, of each point alone, and never falling unless it says so; each law has examples."""
    check_damage(examples("damage")[name])
    assert {key.split()[0] for key in examples("damage")} == set(DOORS["damage"].own())


class Falling(pr.DamageLaw):
    """A law whose integrand is negative under pressure."""

    def rate(self, at):
        return at.triaxiality


class Infinite(pr.DamageLaw):
    """A law that divides by a stress that may be zero."""

    def rate(self, at):
        return at.first / (at.first - at.first)


@pytest.mark.parametrize(("law", "said"), [(Falling(), "'falls'"), (Infinite(), "not a finite number")])
def test_the_suite_says_what_is_wrong(law, said):
    """A law that falls unsaid, and one that is not a number."""
    with np.errstate(all="ignore"), pytest.raises(LawError, match=said):
        check_damage(law)


class OfThree(pr.DamageLaw):
    """A law that answers for three points, whatever it is asked."""

    def rate(self, at):
        return np.full(3, 0.1)


class OfStress(pr.DamageLaw):
    """A law that takes something else."""

    def rate(self, stress, strain):
        return stress


class Unstated(pr.DamageLaw):
    """A law without an answer."""


class Constant(pr.DamageLaw):
    """A law that answers with one number for all points."""

    def rate(self, at):
        return 1.0


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (OfThree(), r"'OfThree': its rate returns an array of shape \(3,\) .*array of shape \(5,\)"),
        (OfStress(), r"'OfStress': its rate raises TypeError \(.*'strain'"),
        (Unstated(), r"'Unstated': its rate raises NotImplementedError \(Unstated states no growth"),
    ],
)
def test_a_law_of_the_wrong_form_is_refused_before_the_run(law, said):
    """A problem with it says its name, what it returns and what is expected; one number for all points is as good as many."""
    material = pr.J2(E=200e3, nu=0.3, flow=pr.Voce(s0=200, Q=100, b=5))

    def problem(damage):
        body = pr.Body(pr.Rectangle((1.0, 1.0), (1, 1)), material, damage=damage)
        return pr.Problem("one", bodies={"b": body}, fixed={"b.bottom": "xy"}, steps=[pr.Step("s")])

    with pytest.raises(pr.PrensaError, match=said):
        problem(law)
    assert problem(Constant()).bodies["b"].damage == (Constant(),)
