"""Bricks through the sweep, the laws and the pattern that quadrilaterals use: nothing in between knows the dimension."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import block_of, bricks, respond
from prensa.elements.element import Mode, Why, element_of
from prensa.elements.shapes import cube, h8, table
from prensa.layout import SPATIAL, DofMap
from prensa.materials.laws import At
from prensa.materials.material import material_of
from prensa.system.assembly import Block, block_slots, make_pattern, sweep

STEEL = pr.Elastic(200e3, 0.3)
SWIFT = pr.J2(200e3, 0.3, pr.Swift(565.0, 0.007, 0.26))
ELEMENTS = ["h8", "h8_fbar", "h8_bbar", "h8_enhanced"]
KINEMATICS = ["small", "finite"]
BOTH = [(e, k) for e in ELEMENTS for k in KINEMATICS]


def test_shapes_are_one_at_their_node_and_have_exact_slopes():
    """N_a is 1 at node a and 0 at the others; slopes agree with differences; the rule integrates ξ²η²ζ² exactly."""
    corners = np.array([(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))], dtype=float)
    assert np.array_equal([h8(*c)[0] for c in corners], np.eye(8))
    at = np.array([0.3, -0.2, 0.6])
    for k in range(3):
        d = 1e-3 * np.eye(3)[k]
        assert np.allclose((h8(*(at + d))[0] - h8(*(at - d))[0]) / 2e-3, h8(*at)[1][:, k], atol=1e-13)
    t = table(8, cube(2))
    assert np.isclose((t.weight * np.prod(t.at**2, axis=1)).sum(), (2.0 / 3.0) ** 3, rtol=1e-14)
    assert np.isclose(t.weight.sum(), 8.0, rtol=1e-15)


def test_volumes_are_those_of_the_bricks():
    """The points' volumes of a skew mesh add up to the box's to 1e-14; a brick numbered inside out is reported."""
    X, cells, _ = bricks((3, 2, 2), (3.0, 1.0, 2.0), 0.2)
    block, _ = block_of(X, cells, "h8", STEEL, "small")
    assert np.isclose(block.volume.sum(), 6.0, rtol=1e-14)
    _, folded = element_of("h8").volumes(X[cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]], block.mode)
    assert folded.all()


@pytest.mark.parametrize("material", [STEEL, SWIFT], ids=["elastic", "j2"])
@pytest.mark.parametrize(("element", "kinematics"), BOTH)
def test_patch(element, kinematics, material):
    """A constant gradient on a skew mesh gives the law's stress at every point and no force on inner nodes, to 1e-12."""
    X, cells, inner = bricks((3, 3, 3), (1.0, 1.2, 0.8), 0.25)
    block, pattern = block_of(X, cells, element, material, kinematics)
    H = np.array([[0.02, 0.01, -0.005], [-0.01, -0.008, 0.004], [0.006, 0.012, -0.01]])
    r, _, result = respond(block, pattern, X, X @ H.T, block.undeformed)
    assert result.failed is None
    law = block.law
    sigma = law.cauchy(block.at_law(result.history).reshape(-1, law.size))
    assert np.abs(sigma - sigma[0]).max() <= 1e-12 * np.abs(sigma).max()
    size = np.abs(r).max()
    assert size > 0
    assert np.abs(r[inner]).max() <= 1e-12 * size
    assert np.abs(r.sum(axis=0)).max() <= 1e-12 * size
    # virtual work of the stress: Σ r ⊗ X = V P
    i, j = np.array(SPATIAL.symmetric).T
    S = np.empty((3, 3))
    S[i, j] = S[j, i] = sigma[0]
    F = np.eye(3) + H
    P = np.linalg.det(F) * S @ np.linalg.inv(F).T if kinematics == "finite" else S
    assert np.abs(r.T @ X - P * block.volume.sum()).max() <= 1e-12 * np.abs(P).max()


PLAIN = ["h8", "h8_fbar", "h8_bbar"]


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_rigid_rotation_gives_no_stress(element):
    """A skew mesh turned by 70° about an oblique axis is free of stress and forces, to 1e-10 of the modulus."""
    X, cells, _ = bricks((2, 2, 2), (1.0, 1.0, 1.0), 0.2)
    block, pattern = block_of(X, cells, element, STEEL, "finite")
    n = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
    W = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    Q = np.eye(3) + np.sin(1.2) * W + (1 - np.cos(1.2)) * W @ W
    r, _, result = respond(block, pattern, X, X @ Q.T - X, block.undeformed)
    assert np.abs(r).max() <= 1e-10 * STEEL.E
    assert np.abs(block.law.cauchy(block.at_law(result.history).reshape(-1, block.law.size))).max() <= 1e-10 * STEEL.E


@pytest.mark.parametrize("material", [STEEL, SWIFT], ids=["elastic", "j2"])
def test_a_layer_of_bricks_in_plane_strain_is_a_layer_of_quadrilaterals(material):
    """Small strain, no cure for locking: a brick of unit depth kept from moving across has the forces of the quadrilateral."""
    X, cells, _ = bricks((2, 2, 1), (2.0, 2.0, 1.0))
    X[:, :2] += 0.1 * np.sin(3.0 * X[:, [1, 0]])
    block, pattern = block_of(X, cells, "h8", material, "small")
    u = np.zeros_like(X)
    u[:, 0], u[:, 1] = 0.01 * np.sin(X[:, 1]) + 0.005 * X[:, 0], -0.008 * X[:, 1] * X[:, 0]
    r, _, _ = respond(block, pattern, X, u, block.undeformed)

    front = np.flatnonzero(X[:, 2] == 0.0)
    number = np.full(len(X), -1)
    number[front] = np.arange(len(front))
    flat = np.ascontiguousarray(X[front, :2])
    quads = number[cells[:, :4]]
    plane = make_pattern([quads], DofMap(2, len(flat)), [])
    slot = np.empty((*quads.shape, 4), dtype=np.int32)
    block_slots(plane.indptr, plane.indices, quads, slot)
    formulation, mode = element_of("q4"), Mode(False, False, 1.0)
    volume, _ = formulation.volumes(flat[quads], mode)
    law = material_of(material, "small", "plane strain")
    two = Block("b", quads, flat[quads], law, formulation, mode, slot, volume)
    expected, _, _ = respond(two, plane, flat, np.ascontiguousarray(u[front, :2]), two.undeformed)
    both = np.zeros_like(expected)
    back = np.flatnonzero(X[:, 2] == 1.0)
    both += r[front, :2]
    for k, node in enumerate(front):
        (twin,) = back[(X[back, :2] == X[node, :2]).all(axis=1)]
        both[k] += r[twin, :2]
    assert np.abs(both - expected).max() <= 1e-12 * np.abs(expected).max()


def test_f_bar_lets_a_nearly_incompressible_body_bend():
    """A cantilever of ν = 0.4999 by F-bar sags to within 10 % of the beam; the plain brick, which locks, to less than half."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import spsolve

    L, n = 10.0, (20, 4, 4)
    X, cells, _ = bricks(n, (L, 1.0, 1.0))
    free = np.repeat(X[:, 0] > 0.0, 3)
    load = np.zeros_like(X)
    tip = X[:, 0] == L
    load[tip, 2] = 1.0
    load /= load.sum()
    sag = {}
    for element in ELEMENTS:
        block, pattern = block_of(X, cells, element, pr.Elastic(1000.0, 0.4999), "small")
        data, r = np.zeros(len(pattern.indices)), np.zeros(X.size)
        sweep(block, X, np.zeros_like(X), block.undeformed, At(1.0, 1.0), r, data, pattern)
        K = csc_matrix((data, pattern.indices, pattern.indptr), (pattern.n,) * 2)
        u = np.zeros(X.size)
        u[free] = spsolve(K[free][:, free], load.ravel()[free])
        sag[element] = u.reshape(-1, 3)[tip, 2].mean()
    inertia = 1.0 / 12.0
    beam = L**3 / (3.0 * 1000.0 * inertia)
    assert abs(sag["h8_fbar"] / beam - 1.0) <= 0.1
    assert sag["h8"] / beam < 0.5


@pytest.mark.parametrize(("element", "kinematics"), BOTH)
def test_a_response_is_pure_and_chunks_do_not_matter(element, kinematics, monkeypatch):
    """The same arguments give the same numbers bit for bit, in chunks of 3 elements too; the committed history stays."""
    from prensa.system import assembly

    X, cells, _ = bricks((2, 2, 2), (1.0, 1.0, 1.0), 0.2)
    block, pattern = block_of(X, cells, element, SWIFT, kinematics)
    # of larger increments bricks with enhanced modes may have no answer
    u, v = 0.003 * np.random.default_rng(3).normal(size=(2, *X.shape))
    old = respond(block, pattern, X, v, block.undeformed)[2].history
    kept = old.copy()
    r, K, first = respond(block, pattern, X, u, old, stiffness=True)
    assert first.failed is None
    respond(block, pattern, X, v, old)
    monkeypatch.setattr(assembly, "CHUNK", 3)
    r2, K2, again = respond(block, pattern, X, u, old, stiffness=True)
    assert np.array_equal(r, r2)
    assert np.array_equal(K, K2)
    assert np.array_equal(first.history, again.history)
    assert np.array_equal(old, kept)
    assert np.abs(respond(block, pattern, X, u, old)[0] - r).max() <= 1e-14 * first.force_scale


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_brick_turned_inside_out_is_named(element):
    """An increment that folds one brick fails with its number."""
    X, cells, _ = bricks((3, 1, 1), (3.0, 1.0, 1.0))
    block, pattern = block_of(X, cells, element, STEEL, "finite")
    du = np.where((X[:, :1] == 3.0), [[-1.5, 0.0, 0.0]], 0.0)
    answer = respond(block, pattern, X, du, block.undeformed)[2]
    assert np.array_equal(answer.history, block.undeformed)
    failed = answer.failed
    assert failed is not None
    assert (failed.element, failed.why) == (2, Why.INVERTED)


def test_a_law_of_the_plane_is_refused_in_space():
    """A block of bricks does not take a law with the tensors of plane problems."""
    X, cells, _ = bricks((1, 1, 1), (1.0, 1.0, 1.0))
    block, _ = block_of(X, cells, "h8", STEEL, "finite")
    with pytest.raises(ValueError, match=r"layout '3d', the law those of 'plane'"):
        replace(block, law=material_of(STEEL, "finite", "plane strain"))


def newton(block, pattern, x, old, prescribed, du):
    """Increments (nodes, 3) in equilibrium with prescribed ones (flags, values), history, norms on the way, forces."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import spsolve

    free, norms, u = ~prescribed.ravel(), [], np.zeros(x.size)
    target, step = np.where(prescribed, du, 0.0).ravel(), 1.0
    for _ in range(20):
        data, r = np.zeros(len(pattern.indices)), np.zeros(x.size)
        result = sweep(block, x, u.reshape(x.shape), old, At(0.1, 0.1), r, data, pattern)
        assert result.failed is None
        norms.append(np.abs(r[free]).max() / result.force_scale if step == 0.0 else 1.0)
        if norms[-1] <= 1e-15:
            return u.reshape(x.shape), result.history, norms, r.reshape(x.shape)
        K = csc_matrix((data, pattern.indices, pattern.indptr), (pattern.n,) * 2)
        jump = step * target  # the boundary moves in the first iteration
        correction = jump.copy()
        correction[free] = spsolve(K[free][:, free], -(r + K @ jump)[free])
        u, step = u + correction, 0.0
    raise AssertionError(f"no convergence: {norms}")


@pytest.mark.parametrize("element", PLAIN)
def test_a_bar_of_skew_bricks_follows_the_flow_curve(element):
    """Pulled by a quarter, short of necking, its axial Kirchhoff stress is σ_y(ln l/l₀ − τ/E) to 1e-9."""
    E, nu, curve = 1000.0, 0.3, pr.Swift(10.0, 0.01, 0.3)
    X, cells, _ = bricks((3, 2, 2), (1.0, 0.5, 0.5), 0.2)
    block, pattern = block_of(X, cells, element, pr.J2(E, nu, curve, "kirchhoff"), "finite")
    prescribed = X == 0.0
    prescribed[:, 0] |= X[:, 0] == 1.0
    x, history, tau = X.copy(), block.undeformed, 0.0
    for _ in range(10):
        step = np.zeros_like(X)
        step[:, 0] = (1.25**0.1 - 1.0) * x[X[:, 0] == 1.0, 0].mean()
        step[X[:, 0] == 0.0] = 0.0
        du, history, _, r = newton(block, pattern, x, history, prescribed, step)
        x = x + du
    for _ in range(200):  # a contraction: σ_y′ < E
        tau = curve.K * (curve.e0 + np.log(1.25) - tau / E) ** curve.n
    law = block.law
    stress = law.cauchy(block.at_law(history).reshape(-1, law.size))
    jacobian = np.exp(tau / E * (1.0 - 2.0 * nu))
    assert np.allclose(stress[:, 0] * jacobian, tau, rtol=1e-9)
    assert np.abs(stress[:, 1:]).max() <= 1e-9 * tau
    area = 0.25 * jacobian / 1.25
    assert np.isclose(r[X[:, 0] == 1.0, 0].sum(), tau / jacobian * area, rtol=1e-9)


@pytest.mark.parametrize("element", ELEMENTS)
def test_newton_ends_quadratically_on_a_barrelling_block(element):
    """A block pressed between rough plates converges in every increment with order near 2, and stays symmetric."""
    X, cells, _ = bricks((4, 4, 4), (1.0, 1.0, 1.0))
    X = X - [0.5, 0.5, 0.0]
    block, pattern = block_of(X, cells, element, SWIFT, "finite")
    ends = (X[:, 2] == 0.0) | (X[:, 2] == 1.0)
    prescribed = np.repeat(ends[:, None], 3, axis=1)
    x, history = X.copy(), block.undeformed
    for _ in range(5):
        step = np.zeros_like(X)
        step[X[:, 2] == 1.0, 2] = -0.04
        du, history, norms, _ = newton(block, pattern, x, history, prescribed, step)
        x = x + du
        assert len(norms) <= 9
        last = [n for n in norms if n > 1e-13]
        assert np.log(norms[len(last)] / last[-1]) / np.log(last[-1] / last[-2]) > 1.5 or norms[len(last)] < 1e-15
    turned = x @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert np.abs(np.sort(turned[:, 0]) - np.sort(x[:, 0])).max() <= 1e-12
    assert x[:, 0].max() > 0.52


def test_a_pattern_of_three_unknowns_a_node_has_tools_of_six():
    """Each unknown of a node meets the three of its neighbours and all six of the tool whose candidate it is."""
    _, cells, _ = bricks((2, 1, 1), (2.0, 1.0, 1.0))
    pattern = make_pattern([cells], DofMap(3, 12, 1), [np.array([0, 3])])
    assert pattern.n == 36 + 6 + 6  # six motions, and the orientation from which turns are counted
    neighbours = [len(np.unique(cells[(cells == node).any(axis=1)])) for node in range(12)]
    for node in range(12):
        for i in range(3):
            rows = pattern.indices[pattern.indptr[3 * node + i] : pattern.indptr[3 * node + i + 1]]
            assert len(rows) == 3 * neighbours[node] + (6 if node in (0, 3) else 0)
            assert (np.diff(rows) > 0).all()
