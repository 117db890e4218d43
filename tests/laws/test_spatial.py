"""Laws in three dimensions: exact tangents also where eigenvalues coincide, the plane as a special case, objectivity."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.kernels import principal_axes
from prensa.layout import PLANE, SPATIAL
from prensa.materials.laws import At, Out
from prensa.materials.material import material_of

SWIFT = pr.Swift(565.0, 0.007, 0.26)
ELASTIC = [
    *((pr.Elastic(200e3, 0.3), k) for k in ("small", "finite")),
    (pr.NeoHooke(200e3, 0.3), "finite"),
    (pr.StVenantKirchhoff(200e3, 0.3), "finite"),
]
PLASTIC = [
    (pr.J2(200e3, 0.3, flow, y), k)
    for flow in (SWIFT, pr.Perfect(250.0), pr.JohnsonCook(250.0, 500.0, 0.3, 0.02, 1e-3))
    for y, k in (("cauchy", "finite"), ("kirchhoff", "finite"), ("cauchy", "small"))
]
LAWS = ELASTIC + PLASTIC
FINITE = [case for case in LAWS if case[1] == "finite"]
IN_PLANE = [SPATIAL.full.index(pair) for pair in PLANE.full]


def name(case) -> str:
    material, kinematics = case
    flow = getattr(material, "flow", None)
    return "-".join([material.type, *([flow.type, material.yield_on] if flow else []), kinematics])


def update(law, h, old, dt=0.1):
    n, c = len(h), law.layout.components
    out = Out(np.empty((n, c)), np.empty((n, c, c)), np.zeros((n, law.size)), np.zeros(n, dtype=bool))
    law.update(np.ascontiguousarray(h), np.ascontiguousarray(old), At(dt, dt), out)
    return out


def states(law, rng, n=60):
    """Random committed histories (after a first increment) and second increments from tiny to large."""
    c = law.layout.components
    old = update(law, rng.normal(size=(n, c)) * 0.02, np.zeros((n, law.size))).new
    return rng.normal(size=(n, c)) * np.where(np.arange(n) % 2, 0.03, 1e-4)[:, None], old


def assert_exact(law, h, old, d, tolerance):
    base = update(law, h, old)
    assert not base.failed.any()
    for k in range(9):
        step = d * np.eye(9)[k]
        fd = (update(law, h + step, old).P - update(law, h - step, old).P) / (2 * d)
        assert np.abs(fd - base.A[:, :, k]).max() <= tolerance * np.abs(base.A).max()


@pytest.mark.parametrize("case", LAWS, ids=name)
def test_tangent_is_the_derivative_of_the_stress(case):
    """∂P/∂f agrees with central differences within 1e-6 at random states, elastic and plastic."""
    law = material_of(*case, "solid")
    assert_exact(law, *states(law, np.random.default_rng(1)), 1e-7, 1e-6)


@pytest.mark.parametrize("case", LAWS, ids=name)
def test_tangent_is_symmetric_where_the_law_says_so(case):
    """A = Aᵀ to 1e-12 of the largest entry at random states for the laws that say that they are symmetric."""
    law = material_of(*case, "solid")
    A = update(law, *states(law, np.random.default_rng(1))).A
    error = np.abs(A - A.transpose(0, 2, 1)).max() / np.abs(A).max()
    assert (error <= 1e-12) == law.symmetric


# uniaxial along an axis and along a diagonal, hydrostatic, none at all, two that nearly coincide, pure shear
_DIAGONAL = np.full((3, 3), 1.0 / 3.0)
_SHEAR = np.zeros((3, 3))
_SHEAR[0, 1] = _SHEAR[1, 0] = 0.01
COINCIDENT = np.array(
    [
        np.diag([0.02, -0.006, -0.006]),
        0.026 * _DIAGONAL - 0.006 * np.eye(3),
        1e-3 * np.eye(3),
        -2e-2 * np.eye(3),
        np.zeros((3, 3)),
        np.diag([0.02, -0.006, -0.006 * (1.0 + 1e-7)]),
        np.diag([0.02, -0.006, -0.006 * (1.0 + 1e-4)]),
        _SHEAR,
    ]
).reshape(-1, 9)


@pytest.mark.parametrize("case", LAWS, ids=name)
def test_coincident_principal_strains_have_a_tangent_too(case):
    """At two or three equal eigenvalues, or nearly equal ones, the tangent agrees with central differences within 1e-6."""
    law = material_of(*case, "solid")
    h = COINCIDENT
    if law.plastic:  # at rest a flow curve may have a kink
        h = np.delete(h, 4, axis=0)
    assert_exact(law, h, np.zeros((len(h), law.size)), 1e-6, 1e-6)


@pytest.mark.parametrize("case", LAWS, ids=name)
def test_plane_strain_is_a_special_case(case):
    """Strains without components out of the plane, shear apart, give the plane law's P, A and history, to 1e-12 of each."""
    plane, space = material_of(*case), material_of(*case, "solid")
    h2, old2 = states(plane, np.random.default_rng(2))
    h2[:, 4] = 0.0
    flat = update(plane, h2, old2)
    h, old = np.zeros((len(h2), 9)), np.zeros((len(h2), space.size))
    h[:, IN_PLANE] = h2
    kept = [SPATIAL.symmetric.index(pair) for pair in PLANE.symmetric]
    columns = kept + list(range(SPATIAL.kept, space.size))
    if plane.plastic:  # the trial strains too
        first = space.fields["trial"].columns.start
        columns = [*kept, SPATIAL.kept, SPATIAL.kept + 1, *(first + k for k in kept)]
    old[:, columns] = old2
    full = update(space, h, old)
    rest = np.delete(np.arange(9), IN_PLANE)
    scale = np.abs(flat.P).max()
    assert np.abs(full.P[:, IN_PLANE] - flat.P).max() <= 1e-12 * scale
    assert np.abs(full.P[:, rest]).max() <= 1e-12 * scale
    assert np.abs(full.A[:, IN_PLANE][:, :, IN_PLANE] - flat.A).max() <= 1e-9 * np.abs(flat.A).max()
    assert np.abs(full.new[:, columns] - flat.new).max() <= 1e-12 * np.abs(flat.new).max()
    expected = plane.cauchy(flat.new)
    cauchy = space.cauchy(full.new)
    assert np.abs(cauchy[:, kept] - expected).max() <= 1e-12 * np.abs(expected).max()
    assert np.allclose(space.energy(full.new), plane.energy(flat.new), rtol=1e-11)


def rotation(axis, angle):
    """Rodrigues' formula."""
    n = np.asarray(axis) / np.linalg.norm(axis)
    W = np.array([[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]])
    return np.eye(3) + np.sin(angle) * W + (1.0 - np.cos(angle)) * W @ W


@pytest.mark.parametrize("case", FINITE, ids=name)
def test_a_rotation_turns_the_stress_and_changes_nothing_else(case):
    """F = Q f turns P into Q P and leaves the plastic strain alone, to 1e-10 (objectivity)."""
    law = material_of(*case, "solid")
    h, old = states(law, np.random.default_rng(3))
    base = update(law, h, old)
    Q = rotation([1.0, -2.0, 0.5], 1.1)
    out = update(law, (Q @ (np.eye(3) + h.reshape(-1, 3, 3)) - np.eye(3)).reshape(-1, 9), old)
    expected = (Q @ base.P.reshape(-1, 3, 3)).reshape(-1, 9)
    assert np.abs(out.P - expected).max() <= 1e-10 * np.abs(base.P).max()
    assert np.abs(out.new[:, 6:8] - base.new[:, 6:8]).max(initial=0.0) <= 1e-10
    for columns in (f.columns for f in law.fields.values() if f.travel in ("strain", "flow")):
        turned, plain = np.empty((2, len(h), 3, 3))
        i, j = np.array(SPATIAL.symmetric).T
        for full, o in ((turned, out), (plain, base)):
            full[:, i, j] = full[:, j, i] = o.new[:, columns]
        assert np.abs(turned - Q @ plain @ Q.T).max() <= 1e-10


@pytest.mark.parametrize("case", LAWS, ids=name)
def test_turned_axes_turn_the_answer(case):
    """A gradient R f Rᵀ with the history turned alike gives R P Rᵀ, to 1e-10 (isotropy: no axis is special)."""
    law = material_of(*case, "solid")
    h, old = states(law, np.random.default_rng(4))
    base = update(law, h, old)
    R = rotation([0.3, 1.0, 2.0], 0.8)

    def turned(v):
        return R @ v @ R.T

    old_turned = old.copy()
    i, j = np.array(SPATIAL.symmetric).T
    b = np.empty((len(old), 3, 3))
    b[:, i, j] = b[:, j, i] = old[:, :6]
    old_turned[:, :6] = turned(b)[:, i, j]
    out = update(law, turned(h.reshape(-1, 3, 3)).reshape(-1, 9), old_turned)
    expected = turned(base.P.reshape(-1, 3, 3)).reshape(-1, 9)
    assert np.abs(out.P - expected).max() <= 1e-10 * np.abs(base.P).max()


@pytest.mark.parametrize("case", ELASTIC, ids=name)
def test_elastic_stress_is_the_derivative_of_the_energy(case):
    """P = ∂ψ/∂f by differences of the energy function of the history, within 1e-6."""
    law = material_of(*case, "solid")
    h = np.random.default_rng(5).normal(size=(20, 9)) * 0.05
    old = np.zeros((20, law.size))
    d = 1e-6
    for k in range(9):
        step = d * np.eye(9)[k]
        fd = (law.energy(update(law, h + step, old).new) - law.energy(update(law, h - step, old).new)) / (2 * d)
        assert np.abs(fd - update(law, h, old).P[:, k]).max() <= 1e-6 * 200e3 * 0.05


def test_neo_hooke_against_its_closed_form():
    """P equals μ(F − F⁻ᵀ) + λ ln J F⁻ᵀ, the textbook expression, to 1e-11, also in two increments."""
    law = material_of(pr.NeoHooke(1000.0, 0.3), "finite", "solid")
    rng = np.random.default_rng(6)
    first, second = rng.normal(size=(2, 20, 3, 3)) * 0.15
    old = update(law, first.reshape(-1, 9), np.zeros((20, 6))).new
    P = update(law, second.reshape(-1, 9), old).P.reshape(-1, 3, 3)
    for i in range(20):
        before = np.eye(3) + first[i]
        F = (np.eye(3) + second[i]) @ before
        Fit = np.linalg.inv(F).T
        closed = law.mu * (F - Fit) + law.lam * np.log(np.linalg.det(F)) * Fit
        # per committed volume: P_n = P F_nᵀ/J_n
        assert np.allclose(P[i], closed @ before.T / np.linalg.det(before), rtol=1e-11, atol=1e-9)


@pytest.mark.parametrize("case", ELASTIC, ids=name)
def test_strains_of_a_billionth_of_a_thousandth_keep_their_digits(case):
    """At strains of 1e-12 P is that of Hooke's law to 1e-11: nothing cancels against the unit tensor."""
    law = material_of(*case, "solid")
    h = np.random.default_rng(7).normal(size=(20, 9)) * 1e-12
    P = update(law, h, np.zeros((20, law.size))).P.reshape(-1, 3, 3)
    e = 0.5 * (h.reshape(-1, 3, 3) + h.reshape(-1, 3, 3).transpose(0, 2, 1))
    hooke = 2.0 * law.mu * e + law.lam * np.trace(e, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    assert np.abs(P - hooke).max() <= 1e-11 * np.abs(hooke).max()


@pytest.mark.parametrize("scale", [1e-300, 1e-150, 1e-12, 1.0, 1e12])
def test_principal_axes_are_exact_to_round_off(scale):
    """Q diag(λ) Qᵀ = b and QᵀQ = I to 1e-14 at any size of b, whether eigenvalues differ, nearly coincide or vanish."""
    rng = np.random.default_rng(8)
    eps, frame, failed = np.empty((1, 3)), np.empty((1, 13)), np.zeros(1, dtype=np.bool_)
    spectra = [
        (1, 2, 3),
        (1, 1, 2),
        (1, 1, 1),
        (0, 0, 1),
        (1, 1 + 1e-15, -1),
        (1, 1 + 1e-8, 1e-8),
        (0, 0, 0),
        (1e-14, 0, 1),
    ]
    for spectrum in spectra:
        for _ in range(20):
            R = rotation(rng.normal(size=3), rng.uniform(0, 6)) if rng.random() < 0.9 else np.eye(3)
            b = scale * R @ np.diag(spectrum) @ R.T
            b = 0.5 * (b + b.T)
            principal_axes.trial(b.reshape(1, 9), np.zeros((1, 6)), False, eps, frame, failed)
            values, Q = eps[0], frame[0, :9].reshape(3, 3)
            assert np.abs(Q.T @ Q - np.eye(3)).max() <= 1e-14
            assert np.abs(Q @ np.diag(values) @ Q.T - b).max() <= 1e-14 * scale
            assert np.abs(np.sort(values) - np.linalg.eigvalsh(b / scale) * scale).max() <= 1e-14 * scale


@pytest.mark.parametrize("case", FINITE, ids=name)
def test_a_point_turned_inside_out_is_reported(case):
    """A deformation gradient with a negative determinant sets ``failed`` of its point and of no other."""
    law = material_of(*case, "solid")
    h = np.zeros((2, 9))
    h[1, 8] = -1.5
    assert update(law, h, np.zeros((2, law.size))).failed.tolist() == [False, True]


@pytest.mark.parametrize("case", PLASTIC, ids=name)
def test_plastic_flow_keeps_the_volume_and_dissipates(case):
    """The logarithm of det b_e (small strain: the trace of ε_e) is the trial one to 1e-10; plastic strain and work grow."""
    law = material_of(*case, "solid")
    h, old = states(law, np.random.default_rng(9))
    out = update(law, h, old)
    before = law.elastic_strains(old).sum(-1)
    f = np.eye(3) + h.reshape(-1, 3, 3)
    grown = np.log(np.linalg.det(f)) if law.finite else h[:, [0, 4, 8]].sum(1)
    assert np.abs(law.elastic_strains(out.new).sum(-1) - before - grown).max() <= 1e-10
    flowed = out.new[:, 6] > old[:, 6]
    assert flowed.any()
    assert (out.new[flowed, 7] > old[flowed, 7]).all()
    assert (out.new[~flowed, 6:8] == old[~flowed, 6:8]).all()
    assert (out.new[~flowed, 8:] == out.new[~flowed, :6]).all()
