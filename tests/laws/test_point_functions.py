"""Laws as point functions: the tangents that are generated, against the complex step of the same functions of arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.kernels.algebra import symmetric
from prensa.kernels.principal_axes import FRAME, trial
from prensa.layout import PLANE, SPATIAL
from prensa.materials import elastic, j2
from prensa.materials.hardening import Curve, Knots
from prensa.materials.hencky_j2 import Begun, Metal, small_j2

N, STEP, LAM, MU = 43, 1e-30, 3.0, 2.0


def slopes(f: Callable[[list[Any]], Any], h: np.ndarray) -> np.ndarray:
    """∂f/∂h (n, c, c) by the complex step."""
    out = []
    for k in range(h.shape[1]):
        z = h + 0j
        z[:, k] += STEP * 1j
        out.append(np.stack([np.imag(p) / STEP + np.zeros(len(h)) for p in f(list(z.T))], axis=-1))
    return np.stack(out, axis=-1)


def increments(full: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Gradients and committed tensors of points: small, large and none at all."""
    rng = np.random.default_rng(full)
    scale = size * 10.0 ** rng.uniform(-8, 0, (N, 1))
    scale[:3] = 0.0
    kept = (SPATIAL if full == 9 else PLANE).kept
    return scale * rng.uniform(-1, 1, (N, full)), scale * rng.uniform(-1, 1, (N, kept))


@pytest.mark.parametrize("full", [5, 9])
@pytest.mark.parametrize("law", [elastic.hooke, elastic.neo_hooke, elastic.st_venant_kirchhoff])
def test_elastic_tangents_are_the_complex_step(law: elastic.PointLaw, full: int) -> None:
    """Stresses and tangents to round-off; a point has the same bits alone as among others, with and without its tangent."""
    h, old = increments(full, 0.3)
    P, A, new, failed = np.empty_like(h), np.empty((N, full, full)), np.empty_like(old), np.zeros(N, dtype=np.bool_)
    elastic.update(law, h, old, LAM, MU, P, A, new, failed, True)
    assert not failed.any()
    found = law(list(h.T), list(old.T), LAM, MU)  # type: ignore[arg-type]
    plain = np.stack([p + np.zeros(N) for p in found.P], axis=-1)
    assert np.all(np.abs(P - plain) <= 1e-14 * np.abs(plain).max(axis=1, keepdims=True))
    exact = slopes(lambda z: law(z, list(old.T), LAM, MU).P, h)  # type: ignore[arg-type]
    assert np.abs(A - exact).max() <= 1e-14 * np.abs(exact).max()
    for i in (0, 5, N - 1):
        alone = np.empty((1, full))
        elastic.update(law, h[i : i + 1], old[i : i + 1], LAM, MU, alone, A[:1], new[:1], failed[:1], False)
        assert alone.tobytes() == P[i].tobytes()


@pytest.mark.parametrize("full", [5, 9])
@pytest.mark.parametrize("curve", [pr.Ludwik(0.01, 0.02, 0.3), pr.JohnsonCook(0.01, 0.02, 0.3, 0.02, 0.1)])
def test_tangents_of_small_strain_plasticity_are_the_complex_step(curve: pr.FlowCurve, full: int) -> None:
    """Elastic and plastic points in plane and space; the history too is that of the function of arrays."""
    h, strain = increments(full, 0.3)
    k, f, K, G, dt = strain.shape[1], curve.kernel(), 3.0, 1.0, 0.1
    assert f is not None
    old = np.concatenate([0.01 * strain, np.full((N, 1), 0.01), np.full((N, 1), 1e-4), 0.01 * strain], axis=1)
    P, A, new, failed = np.empty_like(h), np.empty((N, full, full)), np.empty_like(old), np.zeros(N, dtype=np.bool_)
    j2.small(h, old, 0, K, G, f, dt, P, A, new, failed, True, None, 0.0)
    flowed = new[:, k] > old[:, k]
    assert not failed.any()
    assert 0.1 < flowed.mean() < 0.9

    def law(z: list[Any]) -> tuple[Any, Any]:
        b = list(old.T)
        metal: Any = Metal(K, G, Curve(f.kind, f.p, Knots(f.knots, f.coefficients)), False, dt + 0.0 * b[0], 1.0)  # type: ignore[arg-type]
        return small_j2(z, Begun(b[:k], b[k], b[k + 1], b[:k]), metal)

    history = np.stack([x + np.zeros(N) for x in np.real(law(list(h.T))[1])], axis=-1)
    assert np.abs(new - history).max() <= 1e-13 * np.abs(history).max()
    exact = slopes(lambda z: law(z)[0], h)
    assert np.abs(A - exact).max() <= 1e-12 * np.abs(exact).max()


@pytest.mark.parametrize("finite", [False, True])
def test_principal_axes_in_the_plane_are_one_rotation(finite: bool) -> None:
    """Directions and values of plane tensors give the tensor back, the third axis stands alone."""
    h, old = increments(5, 0.3)
    eps, frame, failed = np.empty((N, 3)), np.empty((N, FRAME)), np.zeros(N, dtype=np.bool_)
    trial(h, old, finite, eps, frame, failed)
    assert not failed.any()
    Q, values = frame[:, :9].reshape(N, 3, 3), frame[:, 9:12]
    H, b = (np.stack([x + np.zeros(N) for x in t], axis=-1).reshape(N, 3, 3) for t in (_full(h), symmetric(list(old.T))))
    f = np.eye(3) + H
    expected = f @ (np.eye(3) + b) @ f.transpose(0, 2, 1) - np.eye(3) if finite else b + 0.5 * (H + H.transpose(0, 2, 1))
    assert np.abs(np.einsum("nia,na,nja->nij", Q, values, Q) - expected).max() <= 1e-15
    assert np.array_equal(Q[:, 2], np.tile([0.0, 0.0, 1.0], (N, 1)))
    assert np.abs(eps - (0.5 * np.log1p(values) if finite else values)).max() <= 1e-16


def _full(h: np.ndarray) -> list[Any]:
    h11, h12, h21, h22, h33 = h.T
    return [h11, h12, 0.0, h21, h22, 0.0, 0.0, 0.0, h33]
