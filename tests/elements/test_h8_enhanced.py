"""The brick with enhanced strains: plane strain, turned models, beams, compression."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import block_of, bricks, respond
from prensa.elements.element import element_of
from prensa.elements.enhanced import At, integrate, numbers
from prensa.elements.form import Form

E, NU = 1000.0, 0.3


def test_a_turned_element_has_turned_forces():
    """Places and displacements turned about an oblique axis turn the forces along, to 1e-9, in two plastic increments."""
    X, cells, _ = bricks((2, 1, 2), (2.0, 1.0, 2.0), 0.2)
    n = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
    W = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    Q = np.eye(3) + np.sin(1.2) * W + (1 - np.cos(1.2)) * W @ W
    bent = np.stack([0.06 * X[:, 0] * X[:, 1], -0.03 * X[:, 0] ** 2, 0.02 * X[:, 2] * X[:, 0]], axis=1)
    found = []
    for R in (np.eye(3), Q):
        block, pattern = block_of(X @ R.T, cells, "h8_enhanced", pr.J2(E, NU, pr.Swift(40.0, 0.01, 0.2)), "finite")
        history, x = block.undeformed, X @ R.T
        for _ in range(2):
            r, _, result = respond(block, pattern, x, 0.5 * bent @ R.T, history)
            history, x = result.history, x + 0.5 * bent @ R.T
        found.append(r @ R)
    assert np.abs(found[1] - found[0]).max() <= 1e-9 * np.abs(found[0]).max()


def test_elements_beside_one_another_do_not_change_each_other():
    """Forces and stiffnesses of an element have the same bits alone and among others."""
    rng, n, element = np.random.default_rng(0), 19, element_of("h8_enhanced")
    form = Form(8, 8, 3, False, True, modes=9)
    corners = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    X = corners + 0.1 * rng.standard_normal((n, 8, 3))
    u, alpha = 0.03 * rng.standard_normal(X.shape), 0.01 * rng.standard_normal((n, 9))
    Hn, P, A = (rng.standard_normal((n, 8, *c)) for c in ((9,), (9,), (9, 9)))
    shape = numbers(element.table, 9, False)

    def answer(some: slice) -> list[np.ndarray]:
        k = len(X[some])
        out = [np.empty((k, 33)), np.empty((k, 33, 33)), np.empty(k)]
        at = At(X[some].copy(), u[some].copy(), alpha[some].copy(), 0.01 * Hn[some], shape, 1.0)
        integrate(form, at, P[some].copy(), A[some].copy(), True, *out)
        return out

    whole = answer(slice(None))
    for k in (0, 7, 18):
        for one, all_ in zip(answer(slice(k, k + 1)), whole):
            assert one.tobytes() == all_[k : k + 1].tobytes()


@pytest.mark.parametrize("material", [pr.Elastic(E, NU), pr.NeoHooke(E, 0.495)])
def test_there_is_no_hourglass_in_large_compression(material):
    """A block of 2 × 2 × 2 bricks pressed homogeneously to 60 % keeps a positive definite tangent and a uniform stress."""
    X, cells, _ = bricks((2, 2, 2), (1.0, 1.0, 1.0))
    block, pattern = block_of(X, cells, "h8_enhanced", material, "finite")
    held = (X == 0.0) | ((X == 1.0) & np.array([False, True, False]))
    free, history, x = ~held.ravel(), block.undeformed, X.copy()
    for k in range(12):
        height = 1.0 - 0.05 * k
        du = np.stack([0.0 * x[:, 0], -0.05 / height * x[:, 1], 0.0 * x[:, 2]], axis=1)
        for _ in range(8):
            r, K, result = respond(block, pattern, x, du, history, stiffness=True)
            assert result.failed is None
            du.ravel()[free] -= np.linalg.solve(K[free][:, free], r.ravel()[free])
            if np.abs(r.ravel()[free]).max() <= 1e-9 * material.E:
                break
        assert np.linalg.eigvalsh(0.5 * (K + K.T)[free][:, free])[0] > 0.003 * material.E
        history, x = result.history, x + du
    stress = block.law.cauchy(block.at_law(history).reshape(-1, block.law.size))
    assert np.abs(stress - stress[0]).max() <= 1e-7 * np.abs(stress).max()


def tip(n, nu=NU, moved=0.0, element="h8_enhanced"):
    """Deflection over Timoshenko's of a beam 10 × 1 × 1 under end shear; inner nodes are ``moved``, over the shortest edge."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import spsolve

    from prensa.materials.laws import At as Time
    from prensa.mesh.bricks import outside
    from prensa.system.assembly import sweep

    L = 10.0
    X, cells, _ = bricks(n, (L, 1.0, 1.0))
    inside = (X > 0.0) & (X.max(axis=0) > X)
    X = X + moved / max(n[1:]) * inside * np.random.default_rng(1).uniform(-1, 1, size=X.shape)
    block, pattern = block_of(X, cells, element, pr.Elastic(E, nu), "small")
    data, r, load = np.zeros(len(pattern.indices)), np.zeros(X.size), np.zeros_like(X)
    sweep(block, X, np.zeros_like(X), block.undeformed, Time(1.0, 1.0), r, data, pattern)
    K = csc_matrix((data, pattern.indices, pattern.indptr), (pattern.n,) * 2)
    faces, root = outside(cells), X[:, 0] == 0.0
    for end, sign in ((L, 1.0), (0.0, -1.0)):  # shear stresses 6 z (1 − z) at both ends, by one point a face
        for face in faces[(X[faces][..., 0] == end).all(axis=1)]:
            z = X[face, 2]
            mean = 3.0 * (z.max() + z.min()) - 2.0 * (z.max() ** 2 + z.max() * z.min() + z.min() ** 2)
            load[face, 2] += sign * 0.25 * mean * np.ptp(z) * np.ptp(X[face, 1])
    load[~root, 2] /= load[~root, 2].sum()
    load[root, 2] /= -load[root, 2].sum()
    held = np.zeros(X.shape, dtype=bool)
    held[root, 0] = True
    corner = np.flatnonzero(root & (X[:, 2] == 0.0))
    held[corner[[0, -1]], 2] = held[corner[0], 1] = True
    free, u = ~held.ravel(), np.zeros(X.size)
    u[free] = spsolve(K[free][:, free], load.ravel()[free])
    end = u.reshape(-1, 3)[:, 2]
    shear = (12.0 + 11.0 * nu) / (10.0 * (1.0 + nu)) * L / (0.5 * E / (1.0 + nu))
    return (end[X[:, 0] == L].mean() - end[root].mean()) / (L**3 / (3.0 * E / 12.0) + shear)


@pytest.mark.parametrize(("n", "error"), [((10, 1, 1), 0.01), ((10, 2, 2), 0.01), ((10, 2, 4), 0.01), ((20, 2, 8), 0.005)])
def test_beams_of_one_to_eight_layers_bend_as_timoshenkos(n, error):
    """Deflection of a cantilever (shear by Cowper 1966), also of bricks whose sides are slanted by a tenth of their height."""
    assert abs(tip(n) - 1.0) <= error
    assert abs(tip(n, moved=0.1) - 1.0) <= 0.03
    assert abs(tip(n, element="h8_fbar") - 1.0) > 0.08


def test_slanted_bricks_come_to_the_beam_too():
    """Bricks moved by a fifth of their height: the error of the deflection falls with the mesh, below 2 %."""
    errors = [1.0 - tip(n, moved=0.2) for n in ((10, 1, 2), (20, 2, 4), (40, 2, 4))]
    assert errors[0] > errors[1] > errors[2] > 0.0
    assert errors[2] < 0.02
