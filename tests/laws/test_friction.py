"""Properties of every friction law: exact tangent with 1, 2 and 3 tangential components, purity, bound, dissipation."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.friction.law import At
from prensa.friction.return_map import SLIDING, return_map
from prensa.registry import DOORS, examples
from prensa.testing import LawError, check_friction


class Users(pr.FrictionLaw):
    """As a user writes it: the bound alone."""

    mu: float
    m: float

    def bound(self, p, kappa, at):
        return np.minimum(self.mu * p, self.m * at.k)


class Hardening(pr.FrictionLaw):
    mu: float

    def bound(self, p, kappa, at):
        return (self.mu + 0.2 * np.tanh(kappa)) * p


class Real(pr.FrictionLaw):
    """The absolute value takes the imaginary part of a complex number away: differences stand in."""

    mu: float

    def bound(self, p, kappa, at):
        return self.mu * np.abs(p) ** 0.8


LAWS = {
    "constant": pr.Coulomb(0.3),
    "linear": pr.Coulomb(pr.MuLinear(0.1, 0.05)),
    "linear with limit": pr.Coulomb(pr.MuLinear(0.1, 0.05, 0.2)),
    "linear softening": pr.Coulomb(pr.MuLinear(0.4, -0.05, 0.1)),
    "exponential": pr.Coulomb(pr.MuExponential(0.1, 0.4, 2.0)),
    "exponential softening": pr.Coulomb(pr.MuExponential(0.4, 0.1, 2.0)),
    "table": pr.Coulomb(pr.MuTable((0.0, 1.0, 4.0), (0.1, 0.25, 0.3))),
    "shear": pr.Shear(0.3),
    "shear, k given": pr.Shear(0.3, k=40.0),
    "a user's": Users(0.5, 0.6),
    "a user's that hardens": Hardening(0.1),
    "a user's of real numbers only": Real(0.3),
} | examples("friction")


def random_state(d, rng, k=200):
    lam = rng.normal(size=(k, d)) * 20
    dg = rng.normal(size=(k, d)) * np.where(np.arange(k) % 2, 2.0, 0.05)[:, None]
    p = rng.uniform(1.0, 100.0, k)
    kappa = rng.uniform(0.0, 5.0, k)
    return lam, dg, p, np.ones(k, dtype=bool), kappa, np.full(k, 80.0)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("law", [pytest.param(law, id=name) for name, law in LAWS.items()])
def test_every_law_passes_the_suite_that_laws_inherit(law, d):
    """Bound, claims, tangent, purity, dissipation and step halving hold for every law with 1, 2 and 3 components."""
    check_friction(law, components=d, slip=5.0, seed=d)


def test_every_law_behind_the_door_is_in_the_list():
    """A law that is added is tested: each type of the registry has an example here or can be made without arguments given."""
    assert {law.type for law in LAWS.values()} >= set(DOORS["friction"].own())


class Wrong(pr.FrictionLaw):
    """A law that goes wrong in a given way."""

    way: str
    calls = [0]  # noqa: RUF012 (the memory that a law must not have)

    @property
    def hardens(self):
        return self.way == "derivative"

    def bound(self, p, kappa, at):
        self.calls[0] += 1
        mu, zero = 0.3, np.zeros_like(p)
        match self.way:
            case "negative":
                return mu * p - 20.0, mu + zero, zero
            case "memory":
                return (mu + 1e-6 * self.calls[0]) * p, mu + zero, zero
            case "others":
                return mu * p * p / p.max(), 2 * mu * p / p.max(), zero
            case "derivative":
                return (mu + 0.1 * kappa) * p, mu + 0.1 * kappa, 0.05 * p
            case "claims":
                return (mu + 0.1 * kappa) * p, mu + 0.1 * kappa, 0.1 * p
            case "pressure":
                return mu * p + 0.01 * p**2 / 10, mu + zero, zero
        return np.full_like(p, np.nan)


@pytest.mark.parametrize(
    ("way", "said"),
    [
        ("negative", "negative"), ("memory", "remember"), ("others", "other points"), ("derivative", "∂κ differs"),
        ("claims", "does not harden"), ("pressure", "∂p differs"), ("nan", "not a finite number"),
    ],
)  # fmt: skip
def test_the_suite_says_what_is_wrong_with_a_law(way, said):
    """Each kind of wrong law is found, in words."""
    with pytest.raises(LawError, match=said):
        check_friction(Wrong(way))


def test_no_traction_where_nothing_touches():
    """An open point has neither traction nor tangent, and keeps its accumulated slip."""
    lam, dg, p, touching, kappa, k_t = random_state(2, np.random.default_rng(10))
    out = return_map(LAWS["linear"], At(), lam, dg, 0 * p, ~touching, kappa, k_t)
    assert not out.t.any()
    assert not out.dt_dg.any()
    assert np.array_equal(out.kappa, kappa)


def test_softening_too_fast_is_refused():
    """A law that softens faster than the tangential stiffness has no unique root: the tangent is NaN, not a wrong number."""
    law = pr.Coulomb(pr.MuLinear(0.5, -0.05, 0.0))
    p = np.array([100.0])
    out = return_map(
        law, At(), np.array([[60.0]]), np.array([[0.0]]), p, np.array([True]), np.zeros(1), np.array([1.0])
    )
    assert np.isnan(out.dt_dg).any()


class Leaping(pr.FrictionLaw):
    """A bound that jumps from 1 to 2 at a slip of a half, stated in NumPy."""

    hardens = True

    def bound(self, p, kappa, at):
        return np.where(kappa < 0.5, 1.0, 2.0) * p, np.where(kappa < 0.5, 1.0, 2.0), 0.0 * p


@pytest.mark.parametrize(("trial", "traction"), [(1.2, 1.0), (2.0, np.nan), (2.8, 2.0)])
def test_a_bound_that_jumps_past_the_traction_has_no_slip(trial, traction):
    """Before and behind the jump a traction lies on the bound; between there is none: NaN, not the middle of the jump."""
    one, touching = np.ones(1), np.array([True])
    out = return_map(Leaping(), At(), np.array([[trial]]), np.zeros((1, 1)), one, touching, np.zeros(1), one)
    assert out.t[0, 0] == pytest.approx(traction, rel=1e-14, nan_ok=True)
    assert np.isnan(out.dt_dg).any() == np.isnan(traction)


@pytest.mark.parametrize("name", ["constant", "linear", "exponential", "table"])
def test_slip_that_is_held_is_smooth_where_the_pressure_goes_through_zero(name):
    """Derivatives take differences there: traction and slip at −p and p lie on a line, whether the law hardens or not."""
    k, p = 50, 1e-5
    rng = np.random.default_rng(4)
    dg, kappa, held = rng.uniform(0.01, 1.0, (k, 1)), rng.uniform(0.1, 0.9, k), np.ones(k, dtype=bool)
    slips = np.full(k, SLIDING, dtype=np.int8)
    ends = [
        return_map(LAWS[name], At(), np.zeros((k, 1)), dg, np.full(k, q), held, kappa, np.full(k, 80.0), slips)
        for q in (-p, 0.0, p)
    ]
    for values in ([out.t[:, 0] for out in ends], [out.kappa for out in ends]):
        assert np.abs(values[0] - 2.0 * values[1] + values[2]).max() < 1e-11
    np.testing.assert_allclose((ends[2].kappa - ends[0].kappa) / (2 * p), -ends[1].bound[:, 1] / 80.0, rtol=1e-3)
    np.testing.assert_allclose((ends[2].t - ends[0].t)[:, 0] / (2 * p), -ends[1].bound[:, 1], rtol=1e-3)


@pytest.mark.parametrize("theta", [np.deg2rad(1.0), np.deg2rad(10.0)])
def test_circular_slip_path_lags_by_the_steady_angle(theta):
    """On a circular path of radius ρ the traction lags the velocity by φ, sin φ = μp/(k_T ρ), once steady."""
    law, p, k_t, rho = pr.Coulomb(0.3), np.array([100.0]), np.array([50.0]), 2.0
    t, kappa = np.zeros((1, 2)), np.zeros(1)
    n = round(6 * np.pi / theta)
    x = rho * np.array([1.0, 0.0])
    for i in range(1, n + 1):
        new = rho * np.array([np.cos(i * theta), np.sin(i * theta)])
        out = return_map(law, At(), t, (new - x)[None], p, np.array([True]), kappa, k_t)
        t, kappa, x = out.t, out.kappa, new
    tangent = np.array([-np.sin(n * theta), np.cos(n * theta)])
    radial = np.array([np.cos(n * theta), np.sin(n * theta)])
    # friction opposes the velocity, turned by the lag towards the centre of the path
    lag = np.arctan2(abs(t[0] @ radial), -(t[0] @ tangent))
    exact = np.arcsin(0.3 * 100.0 / (50.0 * rho))
    assert abs(lag - exact) <= 0.75 * theta


def test_path_length_not_net_slip_hardens():
    """Slipping forth and back by the same amount keeps hardening (the paper's net slip would recover)."""
    law = LAWS["linear"]
    t, kappa, p, k_t = np.zeros((1, 1)), np.zeros(1), np.array([10.0]), np.array([1e4])
    for dg in (1.0, -1.0):
        out = return_map(law, At(), t, np.array([[dg]]), p, np.array([True]), kappa, k_t)
        t, kappa = out.t, out.kappa
    mu = law.coefficient(kappa)[0][0]
    assert kappa[0] > 1.99
    assert np.isclose(abs(t[0, 0]), mu * 10.0, rtol=1e-12)
    assert mu > 0.199


@pytest.mark.parametrize("sharpness", [2.0, 8.0, 20.0])
def test_a_smooth_cap_has_the_slope_of_coulomb_at_small_pressures(sharpness):
    """μ at pressures far below the cap, down to those whose powers are no numbers; the bound itself is μ p there."""
    law = pr.Capped(mu=0.5, m=0.6, sharpness=sharpness)
    p = np.array([1e-28, 1e-18, 1e-13, 1e-6])
    bound, slope, _ = law.bound(p, np.zeros(4), At(np.full(4, 50.0), dt=1.0, time=1.0))
    np.testing.assert_allclose(bound, 0.5 * p, rtol=1e-9)
    np.testing.assert_allclose(slope, 0.5, rtol=1e-6)


def test_a_slope_of_nothing_never_reaches_its_limit():
    """μ = mu0 at every slip, whatever the limit is."""
    law = pr.MuLinear(mu0=0.1, slope=0.0, limit=0.3)
    assert (law.at(np.array([0.0, 1.0, 1e6])) == 0.1).all()
