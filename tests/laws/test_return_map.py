"""The return map against the flow curve itself: what its last step neglects is round-off, for any strain and history."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.materials.hardening import stresses
from prensa.materials.j2 import principal

K, G, DT, N = 166_667.0, 76_923.0, 0.01, 4000
CURVES = {
    "perfect": pr.Perfect(100.0),
    "linear": pr.Linear(100.0, 200.0),
    "ludwik": pr.Ludwik(100.0, 200.0, 0.3),
    "ludwik, steep": pr.Ludwik(100.0, 500.0, 0.05),
    "ludwik, convex": pr.Ludwik(10.0, 500.0, 1.7),
    "swift": pr.Swift(200.0, 0.001, 0.3),
    "voce": pr.Voce(100.0, 100.0, 8.0),
    "voce, sharp": pr.Voce(10.0, 1000.0, 300.0),
    "hockett-sherby": pr.HockettSherby(100.0, 200.0, 5.0, 0.8),
    "hockett-sherby, inflected": pr.HockettSherby(100.0, 400.0, 50.0, 2.5),
    "johnson-cook": pr.JohnsonCook(100.0, 200.0, 0.3, 0.05, 1.0),
    "table": pr.FlowTable(((0.0, 100.0), (0.05, 150.0), (0.1, 170.0), (0.2, 190.0), (1.0, 220.0))),
}


@pytest.mark.parametrize("name", CURVES)
def test_stresses_lie_on_the_flow_curve(name):
    """|q(τ) − J σ_y| is below 1e-13 of the trial stress for trial strains from 1e-5 to 0.5 and plastic strains from 0 to 3."""
    f = CURVES[name].kernel()
    rng = np.random.default_rng(1)
    eps = rng.normal(size=(N, 3)) * 10 ** rng.uniform(-5, -0.3, size=(N, 1))
    old = np.zeros((N, 6))
    old[:, 4] = np.where(rng.random(N) < 0.2, 0.0, 10 ** rng.uniform(-13, 0.5, size=N))
    tau, dtau, eps_e, new = np.empty((N, 3)), np.empty((N, 3, 3)), np.empty((N, 3)), np.zeros((N, 6))
    failed = np.zeros(N, dtype=bool)
    principal(eps, np.ones(N), old, 4, K, G, True, f, DT, tau, dtau, eps_e, new, failed, True)
    assert not failed.any()

    def mises(s):
        return np.sqrt(1.5 * ((s - s.mean(1, keepdims=True)) ** 2).sum(1))

    grown, jac, trial = new[:, 4] - old[:, 4], np.exp(eps.sum(1)), mises(2.0 * G * eps)
    excess = (mises(tau) - jac * stresses(f, new[:, 4], grown, DT)[:, 0]) / trial
    flowed = grown > 0
    assert 0.3 < flowed.mean() < 1.0
    assert np.abs(excess[flowed]).max() <= 1e-13
    assert (excess[~flowed] <= 1e-15).all()
    assert np.allclose(tau, elastic(eps_e), rtol=1e-12, atol=1e-12 * trial.max())


def elastic(eps_e):
    """Stresses of elastic strains."""
    trace = eps_e.sum(1, keepdims=True)
    return K * trace + 2.0 * G * (eps_e - trace / 3.0)


@pytest.mark.parametrize("name", CURVES)
def test_slopes_and_curvatures_are_derivatives(name):
    """First and second derivatives of a flow curve against central differences, away from kinks."""
    f = CURVES[name].kernel()
    start = 0.017

    def curve(a):
        return stresses(f, np.array([a]), a - start, DT)[0, :3]

    for a in (0.03, 0.08, 0.15, 0.5):
        h = 1e-5 * a
        up, here, down = curve(a + h), curve(a), curve(a - h)
        scale = here[0] / a
        assert (up[0] - down[0]) / (2 * h) == pytest.approx(here[1], rel=1e-6, abs=1e-6 * scale)
        assert (up[1] - down[1]) / (2 * h) == pytest.approx(here[2], rel=1e-6, abs=1e-6 * scale / a)
