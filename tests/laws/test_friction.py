"""What every friction law inherits: exact tangent with 1, 2 and 3 tangential components, purity, bound, dissipation."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.friction.coulomb import Coulomb
from prensa.friction.return_map import return_map
from prensa.friction.shear import Shear

LAWS = {
    "constant": Coulomb(0.3),
    "linear": Coulomb(pr.MuLinear(0.1, 0.05)),
    "linear with limit": Coulomb(pr.MuLinear(0.1, 0.05, 0.2)),
    "linear softening": Coulomb(pr.MuLinear(0.4, -0.05, 0.1)),
    "exponential": Coulomb(pr.MuExponential(0.1, 0.4, 2.0)),
    "exponential softening": Coulomb(pr.MuExponential(0.4, 0.1, 2.0)),
    "table": Coulomb(pr.MuTable((0.0, 1.0, 4.0), (0.1, 0.25, 0.3))),
    "shear": Shear(0.3, np.full(200, 60.0)),
}


def random_state(d, rng, k=200):
    lam = rng.normal(size=(k, d)) * 20
    dg = rng.normal(size=(k, d)) * np.where(np.arange(k) % 2, 2.0, 0.05)[:, None]
    p = rng.uniform(1.0, 100.0, k)
    kappa = rng.uniform(0.0, 5.0, k)
    return lam, dg, p, np.ones(k, dtype=bool), kappa, np.full(k, 80.0)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_tangent_in_slip_and_stick(law, d):
    """∂t/∂g_T and ∂t/∂p agree with central differences within 1e-6 for stick and slip, hardening and softening."""
    lam, dg, p, touching, kappa, k_t = random_state(d, np.random.default_rng(d))
    out = return_map(law, lam, dg, p, touching, kappa, k_t)
    assert out.slip.any()
    assert not out.slip.all()
    e = 1e-6
    smooth = _away_from_kinks(law, lam, dg, p, touching, kappa, k_t, out, 1e-3)
    assert smooth.mean() > 0.8
    for j in range(d):
        step = e * np.eye(d)[j]
        plus = return_map(law, lam, dg + step, p, touching, kappa, k_t).t
        minus = return_map(law, lam, dg - step, p, touching, kappa, k_t).t
        fd = (plus - minus) / (2 * e)
        assert np.abs(fd - out.dt_dg[:, :, j])[smooth].max() <= 1e-6 * 80.0
    fd = (
        return_map(law, lam, dg, p + e, touching, kappa, k_t).t
        - return_map(law, lam, dg, p - e, touching, kappa, k_t).t
    ) / (2 * e)
    assert np.abs(fd - out.dt_dp)[smooth].max() <= 1e-6


def _away_from_kinks(law, lam, dg, p, touching, kappa, k_t, out, margin):
    """Points whose status and branch of μ(κ) do not change within the margin."""
    smooth = np.ones(len(p), dtype=bool)
    for sign in (1.0, -1.0):
        near = return_map(law, lam, dg * (1 + sign * margin), p * (1 - sign * margin), touching, kappa, k_t)
        smooth &= near.slip == out.slip
        for a, b in zip(law.bound(p * (1 - sign * margin), near.kappa)[1:], law.bound(p, out.kappa)[1:]):
            smooth &= np.isclose(a, b, rtol=0.2)
    return smooth


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_bound_and_dissipation(law):
    """|t| never exceeds μ(κ) p, equals it in slip to 1e-12, and slip never does negative work."""
    lam, dg, p, touching, kappa, k_t = random_state(2, np.random.default_rng(7))
    out = return_map(law, lam, dg, p, touching, kappa, k_t)
    bound = law.bound(p, out.kappa)[0]
    size = np.hypot(*out.t.T)
    assert (size <= law.bound(p, kappa)[0] + 1e-12 * p)[~out.slip].all()
    assert np.abs(size - bound)[out.slip].max() <= 1e-12 * np.abs(bound).max()
    assert (out.kappa >= kappa).all()


def test_the_law_is_pure():
    """The same arguments give the same answer bit for bit."""
    args = random_state(2, np.random.default_rng(8))
    law = LAWS["exponential"]
    first = return_map(law, *args)
    return_map(law, *random_state(2, np.random.default_rng(9)))
    again = return_map(law, *args)
    assert all(np.array_equal(a, b) for a, b in zip(first, again))


def test_no_traction_where_nothing_touches():
    """An open point has neither traction nor tangent, and keeps its accumulated slip."""
    lam, dg, p, touching, kappa, k_t = random_state(2, np.random.default_rng(10))
    out = return_map(LAWS["linear"], lam, dg, 0 * p, ~touching, kappa, k_t)
    assert not out.t.any()
    assert not out.dt_dg.any()
    assert np.array_equal(out.kappa, kappa)


def test_softening_too_fast_is_refused():
    """A law that softens faster than the tangential stiffness has no unique root: the tangent is NaN, not a wrong number."""
    law = Coulomb(pr.MuLinear(0.5, -0.05, 0.0))
    p = np.array([100.0])
    out = return_map(law, np.array([[60.0]]), np.array([[0.0]]), p, np.array([True]), np.zeros(1), np.array([1.0]))
    assert np.isnan(out.dt_dg).any()


@pytest.mark.parametrize("theta", [np.deg2rad(1.0), np.deg2rad(10.0)])
def test_circular_slip_path_lags_by_the_steady_angle(theta):
    """On a circular path of radius ρ the traction lags the velocity by φ, sin φ = μp/(k_T ρ), once steady."""
    law, p, k_t, rho = Coulomb(0.3), np.array([100.0]), np.array([50.0]), 2.0
    t, kappa = np.zeros((1, 2)), np.zeros(1)
    n = round(6 * np.pi / theta)
    x = rho * np.array([1.0, 0.0])
    for i in range(1, n + 1):
        new = rho * np.array([np.cos(i * theta), np.sin(i * theta)])
        out = return_map(law, t, (new - x)[None], p, np.array([True]), kappa, k_t)
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
        out = return_map(law, t, np.array([[dg]]), p, np.array([True]), kappa, k_t)
        t, kappa = out.t, out.kappa
    mu = law.coefficient(kappa)[0][0]
    assert kappa[0] > 1.99
    assert np.isclose(abs(t[0, 0]), mu * 10.0, rtol=1e-12)
    assert mu > 0.199
