"""J2 plasticity of finite strain in the plane, many points at once: as the kernels answer that take points one by one."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.kernels import principal_axes
from prensa.layout import PLANE
from prensa.materials.laws import J2, At, Out, _Isotropic
from prensa.materials.material import Material

CURVES = [
    pr.Perfect(250.0), pr.Ludwik(250.0, 500.0, 0.3), pr.Swift(500.0, 0.002, 0.25), pr.Voce(250.0, 300.0, 5.0, 40.0),
    pr.JohnsonCook(250.0, 400.0, 0.3, 0.02, 0.1),
]  # fmt: skip


def out_of(n: int, size: int) -> Out:
    """Room for the answers of n points."""
    return Out(np.zeros((n, 5)), np.zeros((n, 5, 5)), np.zeros((n, size)), np.zeros(n, dtype=np.bool_))


def one_by_one(law: J2, h: np.ndarray, old: np.ndarray, at: At) -> Out:
    """The answer of the kernels of all isotropic laws."""
    out = out_of(len(h), law.size)
    _Isotropic.update(law, h, old, at, out)
    principal_axes.keep_trial(h, old, law.layout.kept + 2 if at.begun else 0, out.new, True)
    return out


@pytest.mark.parametrize("yield_on", ["cauchy", "kirchhoff"])
@pytest.mark.parametrize("curve", CURVES, ids=lambda c: c.type)
def test_many_points_at_once_answer_as_one_by_one(curve: pr.Ludwik, yield_on: str) -> None:
    """Elastic and plastic, at rest, loaded and unloaded, strains from 1e-12 to 40 %, tangents and secants, held or not."""
    described: Material = pr.J2(E=200e3, nu=0.3, flow=curve, yield_on=yield_on)
    law = described.law("finite", "plane strain")
    assert isinstance(law, J2) and law.layout is PLANE
    rng = np.random.default_rng(3)
    n = 331  # more than one group of points, and not a whole number of them
    old = np.zeros((n, law.size))
    size = 10.0 ** rng.uniform(-12, -0.7, (n, 1))
    size[:40] = 0.0
    last = None
    for k in range(3):
        h = size * rng.uniform(-1, 1, (n, 5))
        flows = None if k < 2 or last is None else last
        at = At(0.1, 1.0, True, 0.5 * (k == 1), flows, begun=k != 1)
        expected, out = one_by_one(law, h, old, at), out_of(n, law.size)
        law.update(h, old, at, out)
        good = ~expected.failed
        np.testing.assert_array_equal(out.failed, expected.failed)
        assert good.mean() > 0.8
        for name in ("P", "A", "new"):
            a, b = getattr(out, name)[good], getattr(expected, name)[good]
            np.testing.assert_allclose(a, b, rtol=1e-11, atol=3e-14 * np.abs(b).max(), err_msg=name)
        last = expected.new[:, 4] != old[:, 4]
        old = np.where(good[:, None], expected.new, old)
    assert 0.1 < last.mean() < 0.95


def test_a_point_turned_inside_out_fails_alone() -> None:
    """The others answer as if it were not there."""
    law = pr.J2(E=200e3, nu=0.3, flow=pr.Ludwik(250.0, 500.0, 0.3)).law("finite", "plane strain")
    h = np.full((70, 5), 1e-3)
    alone, beside = out_of(70, law.size), out_of(70, law.size)
    law.update(h, np.zeros((70, law.size)), At(1.0, 1.0), alone)
    h[66, 0] = -2.0
    law.update(h, np.zeros((70, law.size)), At(1.0, 1.0), beside)
    assert not alone.failed.any() and list(np.flatnonzero(beside.failed)) == [66]
    rest = np.arange(70) != 66
    for a, b in zip(alone[:3], beside[:3]):
        np.testing.assert_array_equal(a[rest], b[rest])


POWERS = [pr.Ludwik(250.0, 500.0, 0.02), pr.Ludwik(100.0, 3e4, 1.3), pr.Swift(700.0, 1e-5, 0.6)]


@pytest.mark.parametrize("curve", POWERS, ids=str)
def test_powers_of_any_strain_are_those_of_the_library(curve: pr.Ludwik) -> None:
    """Flow stresses on the yield surface after strains of 0 to 30, by the library's power, to a few units of the last digit."""
    law = pr.J2(E=200e3, nu=0.3, flow=curve, yield_on="kirchhoff").law("finite", "plane strain")
    assert isinstance(law, J2)
    rng = np.random.default_rng(5)
    old = np.zeros((500, law.size))
    old[:, 4] = 10.0 ** rng.uniform(-16, 1.5, 500)
    old[:50, 4] = 0.0
    h = rng.uniform(-0.3, 0.3, (500, 5))
    out = out_of(500, law.size)
    law.update(h, old, At(1.0, 1.0), out)
    strain = out.new[:, 4]
    flowed = (strain > old[:, 4]) & ~out.failed
    assert flowed.mean() > 0.9
    shift, s0, factor = (curve.e0, 0.0, curve.K) if isinstance(curve, pr.Swift) else (0.0, curve.s0, curve.K)
    expected = s0 + factor * np.power(strain + shift, curve.n)
    e = law.elastic_strains(out.new)
    deviator = 2.0 * law.mu * (e - e.mean(axis=1, keepdims=True))
    found = np.sqrt(1.5 * (deviator**2).sum(axis=1))
    np.testing.assert_allclose(found[flowed], expected[flowed], rtol=1e-12)


@pytest.mark.parametrize("yield_on", ["cauchy", "kirchhoff"])
@pytest.mark.parametrize("curve", CURVES, ids=lambda c: c.type)
def test_increments_begin_at_once_as_one_by_one(curve: pr.Ludwik, yield_on: str) -> None:
    """Tensors and strains as points alone have them, work by the stress and its growth; what did not flow keeps its bits."""
    law = pr.J2(E=200e3, nu=0.3, flow=curve, yield_on=yield_on).law("finite", "plane strain")
    assert isinstance(law, J2)
    rng = np.random.default_rng(7)
    history = np.zeros((331, law.size))
    size = 10.0 ** rng.uniform(-6, -0.4, (331, 1))
    size[60:100] = size[192:256] = 0.0  # some of a group, and all of one
    for _ in range(3):
        out = out_of(331, law.size)
        law.update(size * rng.uniform(-1, 1, (331, 5)), history, At(1.0, 1.0), out)
        history = np.where(out.failed[:, None], history, out.new)
    expected = history.copy()
    principal_axes.begin(history, 4, True, 0.3, expected)
    more = expected[:, 4] - history[:, 4]
    s = law.cauchy(history)  # xx, yy, zz, xy
    s[:, :3] -= s[:, :3].mean(axis=1)[:, None]
    mises = np.sqrt(1.5 * ((s[:, :3] ** 2).sum(axis=1) + 2.0 * s[:, 3] ** 2))
    b = history[:, :4] + [1.0, 1.0, 1.0, 0.0]
    volume = np.sqrt((b[:, 0] * b[:, 1] - b[:, 3] ** 2) * b[:, 2])
    growth = law.flow_stress(expected[:, 4].copy()) - law.flow_stress(history[:, 4].copy())
    found = law.begin(history, 0.3)
    rest = np.arange(10) != 5
    np.testing.assert_allclose(found[:, rest], expected[:, rest], rtol=0, atol=3e-15)
    work = (volume * mises + 0.5 * law.of_cauchy(history) * growth) * more
    np.testing.assert_allclose(found[:, 5] - history[:, 5], work, rtol=1e-9, atol=1e-13 * work.max())
    still = more == 0.0
    assert 0.1 < still.mean() < 0.9
    np.testing.assert_array_equal(found[still], expected[still])


@pytest.mark.parametrize("scale", [1e-14, 1e-6, 0.1, 0.4])
def test_elastic_strains_are_halves_of_logarithms_of_eigenvalues(scale: float) -> None:
    """They have all the digits of those of NumPy, of small and of large strains and of a group that has both."""
    old = np.zeros((150, 10))
    old[:, :4] = scale * np.random.default_rng(3).uniform(-1.0, 1.0, (150, 4))
    old[7:90, :4] *= 1e-3
    old[3, :4] = 0.0
    eps, plain = np.empty((2, 150, 3))
    principal_axes.elastic_strains(old, 4, True, eps)
    principal_axes.elastic_strains(old, 4, False, plain)
    b = np.stack([old[:, [0, 3]], old[:, [3, 1]]], axis=1)
    expected = np.column_stack([np.linalg.eigvalsh(b)[:, ::-1], old[:, 2]])
    size = np.abs(expected).max(axis=1, keepdims=True)
    assert np.all(np.abs(plain - expected) <= 4e-16 * size)
    assert np.all(np.abs(eps - 0.5 * np.log1p(expected)) <= 1e-15 * size / (1.0 - min(size.max(), 0.9)))
