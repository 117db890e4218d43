"""Properties that every material law inherits: exact tangent, purity, objectivity, no stress at rest; and the claims of each."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.materials.laws import At, Out
from prensa.materials.material import material_of

FLOWS = [
    pr.Perfect(250.0),
    pr.Linear(250.0, 500.0),
    pr.Ludwik(250.0, 500.0, 0.3),
    pr.Swift(565.0, 0.007, 0.26),
    pr.Voce(60.0, 120.0, 8.0),
    pr.HockettSherby(100.0, 300.0, 2.0, 0.7),
    pr.JohnsonCook(250.0, 500.0, 0.3, 0.02, 1e-3),
    pr.FlowTable(((0.0, 200.0), (0.1, 300.0), (1.0, 400.0))),
]
ELASTIC = [
    *((pr.Elastic(200e3, 0.3), k) for k in ("small", "finite")),
    (pr.NeoHooke(200e3, 0.3), "finite"),
    (pr.StVenantKirchhoff(200e3, 0.3), "finite"),
]
PLASTIC = [
    (pr.J2(200e3, 0.3, flow, y), k)
    for flow in FLOWS
    for y, k in (("cauchy", "finite"), ("kirchhoff", "finite"), ("cauchy", "small"))
]
PLANE = [(*case, "plane stress") for case in ELASTIC + PLASTIC]
LAWS = ELASTIC + PLASTIC + PLANE


def name(case) -> str:
    material, kinematics, *space = case
    flow = getattr(material, "flow", None)
    return "-".join([material.type, *([flow.type, material.yield_on] if flow else []), kinematics, *space])


def update(law, h, old, dt=0.1):
    n = len(h)
    out = Out(np.empty((n, 5)), np.empty((n, 5, 5)), np.zeros((n, law.size)), np.zeros(n, dtype=bool))
    law.update(np.ascontiguousarray(h), old, At(dt, dt), out)
    return out


def states(law, rng, n=60):
    """Random committed histories (after a first increment) and second increments from tiny to large."""
    old = update(law, rng.normal(size=(n, 5)) * 0.02, np.zeros((n, law.size))).new
    return rng.normal(size=(n, 5)) * np.where(np.arange(n) % 2, 0.03, 1e-4)[:, None], old


@pytest.mark.parametrize("case", LAWS, ids=name)
def test_tangent_is_the_derivative_of_the_stress(case):
    """∂P/∂f agrees with central differences within 1e-6 at random states, elastic and plastic."""
    law = material_of(*case)
    h, old = states(law, np.random.default_rng(1))
    base = update(law, h, old)
    assert not base.failed.any()
    d = 1e-7
    for k in range(5):
        step = d * np.eye(5)[k]
        fd = (update(law, h + step, old).P - update(law, h - step, old).P) / (2 * d)
        assert np.abs(fd - base.A[:, :, k]).max() <= 1e-6 * np.abs(base.A).max()


@pytest.mark.parametrize("case", LAWS, ids=name)
def test_coincident_principal_strains_have_a_tangent_too(case):
    """At equal eigenvalues (isotropic stretch in the plane) the tangent is finite and exact."""
    law = material_of(*case)
    h = np.array([[0.01, 0.0, 0.0, 0.01, -0.03], [1e-3, 0.0, 0.0, 1e-3, 1e-3]])
    old = np.zeros((2, law.size))
    base = update(law, h, old)
    d = 1e-6
    for k in range(5):
        step = d * np.eye(5)[k]
        fd = (update(law, h + step, old).P - update(law, h - step, old).P) / (2 * d)
        assert np.abs(fd - base.A[:, :, k]).max() <= 1e-5 * np.abs(base.A).max()


@pytest.mark.parametrize("case", LAWS, ids=name)
def test_a_law_is_pure(case):
    """The same arguments give the same answer, bit for bit, whatever was evaluated before; the old history is untouched."""
    law = material_of(*case)
    rng = np.random.default_rng(2)
    h, old = states(law, rng)
    kept = old.copy()
    first = update(law, h, old)
    update(law, rng.normal(size=h.shape) * 0.1, old)
    again = update(law, h, old)
    assert np.array_equal(first.P, again.P)
    assert np.array_equal(first.A, again.A)
    assert np.array_equal(first.new, again.new)
    assert np.array_equal(old, kept)


def rotation(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


@pytest.mark.parametrize("case", [c for c in LAWS if c[1] == "finite"], ids=name)
def test_a_rotation_turns_the_stress_and_changes_nothing_else(case):
    """F → Q f turns P into Q P and leaves the plastic strain alone, to 1e-10 (objectivity)."""
    law = material_of(*case)
    h, old = states(law, np.random.default_rng(3))
    base = update(law, h, old)
    Q = rotation(0.7)
    f = np.eye(2) + h[:, :4].reshape(-1, 2, 2)
    turned = h.copy()
    turned[:, :4] = (Q @ f - np.eye(2)).reshape(-1, 4)
    out = update(law, turned, old)
    expected = base.P.copy()
    expected[:, :4] = (Q @ base.P[:, :4].reshape(-1, 2, 2)).reshape(-1, 4)
    assert np.abs(out.P - expected).max() <= 1e-10 * np.abs(base.P).max()
    tensors = [f.columns for f in law.fields.values() if f.travel in ("strain", "flow")]
    scalars = np.delete(np.arange(law.size), np.r_[*tensors])
    kept = np.abs(base.new[:, scalars]).max(initial=1.0)
    assert np.abs(out.new[:, scalars] - base.new[:, scalars]).max(initial=0.0) <= 1e-10 * kept
    for columns in tensors:  # b_e − I turns with the body
        full = [np.stack([b[:, [0, 3]], b[:, [3, 1]]], axis=1) for b in (o.new[:, columns] for o in (out, base))]
        assert np.abs(full[0] - Q @ full[1] @ Q.T).max() <= 1e-10


@pytest.mark.parametrize("case", [c for c in LAWS if c[1] == "finite"], ids=name)
def test_a_rigid_rotation_of_virgin_material_gives_no_stress(case):
    """A rotation of a quarter turn leaves zero stress to 1e-10 of the modulus."""
    law = material_of(*case)
    h = np.zeros((1, 5))
    h[0, :4] = (rotation(np.pi / 2) - np.eye(2)).ravel()
    assert np.abs(update(law, h, np.zeros((1, law.size))).P).max() <= 1e-10 * 200e3


@pytest.mark.parametrize("case", PLASTIC, ids=name)
def test_plastic_flow_is_isochoric_dissipative_and_on_the_yield_surface(case):
    """Plastic flow keeps the volume to 1e-10, dissipates, and the new stress lies on the flow curve where it flowed."""
    material, kinematics = case
    law = material_of(material, kinematics)
    h, old = states(law, np.random.default_rng(4))
    out = update(law, h, old)
    trial = 0.5 * np.log(_det_b(old, h)) if kinematics == "finite" else old[:, :3].sum(1) + h[:, [0, 3, 4]].sum(1)
    final = law.elastic_strains(out.new).sum(-1)
    assert np.abs(final - trial).max() <= 1e-10
    flowed = out.new[:, 4] > old[:, 4]
    assert flowed.any()
    assert (out.new[:, 4] >= old[:, 4]).all()
    assert (out.new[flowed, 5] > old[flowed, 5]).all()
    eps = law.elastic_strains(out.new)
    deviator = 2 * law.mu * (eps - eps.mean(-1, keepdims=True))
    q = np.sqrt(1.5 * (deviator**2).sum(-1))
    from prensa.materials.hardening import stresses

    y = stresses(law.flow, out.new[:, 4], out.new[:, 4] - old[:, 4], 0.1)[:, 0]
    jac = np.exp(final) if kinematics == "finite" and material.yield_on == "cauchy" else 1.0
    assert np.abs(q - jac * y)[flowed].max() <= 1e-9 * y.max()


def _det_b(old, h):
    b = np.zeros((len(h), 3, 3))
    b[:, 0, 0], b[:, 1, 1], b[:, 2, 2] = 1 + old[:, 0], 1 + old[:, 1], 1 + old[:, 2]
    b[:, 0, 1] = b[:, 1, 0] = old[:, 3]
    f = np.zeros((len(h), 3, 3))
    f[:, :2, :2] = np.eye(2) + h[:, :4].reshape(-1, 2, 2)
    f[:, 2, 2] = 1 + h[:, 4]
    return np.linalg.det(f @ b @ f.transpose(0, 2, 1))


@pytest.mark.parametrize("case", ELASTIC + PLANE[: len(ELASTIC)], ids=name)
def test_elastic_stress_is_the_derivative_of_the_energy(case):
    """P = ∂ψ/∂f by differences of the energy function of the history, within 1e-6."""
    law = material_of(*case)
    h = np.random.default_rng(5).normal(size=(20, 5)) * 0.05
    old = np.zeros((20, law.size))
    d = 1e-6
    for k in range(5):
        step = d * np.eye(5)[k]
        fd = (law.energy(update(law, h + step, old).new) - law.energy(update(law, h - step, old).new)) / (2 * d)
        assert np.abs(fd - update(law, h, old).P[:, k]).max() <= 1e-6 * 200e3 * 0.05


def test_neo_hooke_against_its_closed_form():
    """P of the spectral form equals μ(F − F⁻ᵀ) + λ ln J F⁻ᵀ, the textbook expression, to 1e-12."""
    law = material_of(pr.NeoHooke(1000.0, 0.3), "finite")
    rng = np.random.default_rng(6)
    h = rng.normal(size=(20, 5)) * 0.2
    out = update(law, h, np.zeros((20, 4)))
    for i in range(20):
        F = np.zeros((3, 3))
        F[:2, :2] = np.eye(2) + h[i, :4].reshape(2, 2)
        F[2, 2] = 1 + h[i, 4]
        Fit = np.linalg.inv(F).T
        P = law.mu * (F - Fit) + law.lam * np.log(np.linalg.det(F)) * Fit
        expected = [P[0, 0], P[0, 1], P[1, 0], P[1, 1], P[2, 2]]
        assert np.allclose(out.P[i], expected, rtol=1e-11, atol=1e-9)


@pytest.mark.parametrize("case", PLASTIC[::3], ids=name)
def test_a_second_half_step_is_close_to_a_whole_one(case):
    """Radial loading is integrated exactly: two half steps equal one (rate-independent laws), to 1e-9."""
    material, _ = case
    dt = 1e9 if material.flow.type == "johnson_cook" else 0.1  # slower than the reference rate: rate-independent
    law = material_of(material, "small")
    h = np.array([[0.01, 0.004, 0.004, -0.005, -0.005]])
    zero = np.zeros((1, law.size))
    whole = update(law, h, zero, dt)
    half = update(law, 0.5 * h, zero, dt)
    two = update(law, 0.5 * h, half.new, dt)
    assert np.allclose(whole.P, two.P, rtol=1e-9)
    assert np.isclose(whole.new[0, 4], two.new[0, 4], rtol=1e-9)


@pytest.mark.parametrize("case", PLANE, ids=name)
def test_plane_stress_has_none_across_and_the_thickness_of_the_law(case):
    """σ₃₃ of the history vanishes to 1e-10 of the modulus; the law at the stretch found gives P times the old thickness."""
    law = material_of(*case)
    h, old = states(law, np.random.default_rng(7))
    out = update(law, h, old)
    assert not out.failed.any()
    assert np.abs(law.cauchy(out.new)[:, 2]).max() <= 1e-10 * 200e3
    thick = out.new[:, -1] - old[:, -1]
    finite = case[1] == "finite"
    before = 1.0 + old[:, -1] if finite else np.ones(len(h))
    full = h.copy()
    full[:, 4] = thick / before
    bulk = material_of(*case[:2])
    again = update(bulk, full, np.ascontiguousarray(old[:, :-1]))
    assert np.abs(out.P[:, :4] - before[:, None] * again.P[:, :4]).max() <= 1e-9 * np.abs(out.P).max()
    assert np.allclose(law.thickness(out.new), 1.0 + old[:, -1] + thick, rtol=1e-15)


def test_a_strained_sheet_of_hencky_material_thins_by_poisson():
    """Uniaxial Hencky: ln t/t₀ = ln b/b₀ = −ν ln(l/l₀) and τ = E ln(l/l₀), to 1e-12, in two increments of a quarter."""
    law = material_of(pr.Elastic(200e3, 0.3), "finite", "plane stress")
    stretch, zero = np.log([1.25, 1.25]), np.zeros((1, law.size))
    history = zero
    for e in stretch:
        h = np.array([[np.expm1(e), 0.0, 0.0, np.expm1(-0.3 * e), 0.0]])
        history = update(law, h, history).new
    assert np.isclose(law.thickness(history)[0], np.exp(-0.3 * stretch.sum()), rtol=1e-12)
    jacobian = np.exp(0.4 * stretch.sum())
    assert np.allclose(law.cauchy(history)[0], [200e3 * stretch.sum() / jacobian, 0, 0, 0], atol=1e-6)
    assert law.modulus() == 200e3


@pytest.mark.parametrize("points", [((0.0, 100.0), (0.1, 200.0), (1e308, 300.0)), ((0.0, 1e308), (0.1, 2e307), (0.2, 1e307))])
def test_tables_that_no_curve_leads_through_are_refused(points):
    """Slopes of a table whose numbers come near the largest there are overflow."""
    with pytest.raises(PrensaError, match="above 1e\\+100"):
        pr.FlowTable(points)
