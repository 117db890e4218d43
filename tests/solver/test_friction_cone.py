"""Pressures and tractions of points on bodies that answer linearly: the conditions of contact and friction, point by point."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from prensa.policy import DEFAULT
from prensa.solver.friction_cone import Bounds, Unknowns, moved_by

SHARE = 1e-4  # of the contact stiffness in the matrix, as on the foundation of contact steps


def response(rng, n):
    """Answers A (n, n) of trial values to what acts on a body, and the trial values (n,) without it."""
    B, k = rng.standard_normal((n, n + 3)), rng.uniform(1.0, 30.0, n)
    return -k[:, None] * (B @ B.T / n), 3.0 * rng.standard_normal(n)


def answer(A, after, mu, tangents):
    """Trial values and forces (n,) of the answer, from an iterate where points press and nothing rubs."""
    m = len(after) // (1 + tangents)
    return answer_from(A, after, np.ones(m), Bounds(np.full(m, mu), np.full(m, mu), np.ones(m)), tangents)


def answer_from(A, after, pressure, bounds, tangents, law=None):
    """The same from an iterate of pressures (m,) with the given bounds; ``law``: those at pressures (m,)."""
    n, m = len(after), len(pressure)
    none, trial = csr_matrix((n, 1)), np.append(pressure, np.zeros(n - m))
    given = Unknowns(
        none, none, trial, trial, np.full(n, SHARE), np.arange(m), bounds.value, bounds.slope, tangents, law
    )
    v = moved_by(DEFAULT, given, after, A)
    assert v is not None
    tau = after + A @ v
    return tau, v + trial + SHARE * (tau - trial)  # v = Δf − a Δτ


@pytest.mark.parametrize("mu", [0.1, 0.3, 0.6])
def test_tractions_lie_in_their_circles_and_slip_along_themselves(mu):
    """Each point is open, sticks, or slips against a traction of the size μ p; some of every kind among the problems."""
    kinds = np.zeros(3, dtype=np.int64)
    for seed in range(5):
        m = 24
        tau, f = answer(*response(np.random.default_rng(seed), 3 * m), mu, 2)
        p, t, trial = f[:m], f[m:].reshape(2, m), tau[m:].reshape(2, m)
        size, most = np.hypot(*t), np.abs(f).max()
        np.testing.assert_allclose(p, np.maximum(tau[:m], 0.0), atol=1e-11 * most)
        assert (size <= mu * p + 1e-11 * most).all()
        slips = np.hypot(*(trial - t)) > 1e-9 * most
        np.testing.assert_allclose(size[slips], mu * p[slips], atol=1e-10 * most)
        np.testing.assert_allclose(t[0] * trial[1], t[1] * trial[0], atol=1e-9 * most**2)  # along the trial traction …
        assert ((t * trial).sum(axis=0) >= -1e-11 * most**2).all()  # … and not against it
        kinds += [(p <= 0.0).sum(), ((p > 0.0) & ~slips).sum(), ((p > 0.0) & slips).sum()]
    assert (kinds > 0).all()


def test_turned_tangents_give_turned_tractions():
    """Tangents of every point turned by an angle of its own: the same pressures, and tractions turned with them."""
    rng = np.random.default_rng(7)
    m, mu = 12, 0.3
    A, after = response(rng, 3 * m)
    angle = rng.uniform(0.0, 2.0 * np.pi, m)
    c, s = np.diag(np.cos(angle)), np.diag(np.sin(angle))
    nothing = np.zeros((m, m))
    Q = np.block([[np.eye(m), nothing, nothing], [nothing, c, s], [nothing, -s, c]])
    _, f = answer(A, after, mu, 2)
    _, turned = answer(Q @ A @ Q.T, Q @ after, mu, 2)
    np.testing.assert_allclose(turned, Q @ f, atol=1e-10 * np.abs(f).max())


def test_of_two_tangents_one_that_nothing_moves_along_leaves_the_plane():
    """Where nothing happens along the second tangents, pressures and tractions are those of the problem with one."""
    rng = np.random.default_rng(3)
    m, mu = 20, 0.25
    A, after = response(rng, 2 * m)
    more = np.zeros((3 * m, 3 * m))
    more[: 2 * m, : 2 * m], more[2 * m :, 2 * m :] = A, -np.eye(m)
    _, plane = answer(A, after, mu, 1)
    _, space = answer(more, np.append(after, np.zeros(m)), mu, 2)
    np.testing.assert_allclose(space, np.append(plane, np.zeros(m)), atol=1e-11 * np.abs(plane).max())


def shear(p, m=0.5, k=1.0):
    """Bounds by a shear factor: m k from a tenth of k on, and ten times m p below."""
    ramp = p < 0.1 * k
    return Bounds(np.where(ramp, 10.0 * m * p, m * k), np.where(ramp, 10.0 * m, 0.0), p)


@pytest.mark.parametrize("pressed", [0.0, 1.0], ids=["open", "pressed"])
def test_bounds_that_are_not_linear_are_those_at_the_pressures_of_the_answer(pressed):
    """From open points, where the bound rises steeply, and from pressed ones, where it is constant: by passes, its size."""
    kinds = np.zeros(3, dtype=np.int64)
    for seed in range(5):
        m = 24
        first = np.full(m, pressed)
        A, after = response(np.random.default_rng(seed), 3 * m)
        A -= 10.0 * np.eye(3 * m)  # points of bodies give way most under their own forces
        tau, f = answer_from(A, 5.0 * after, first, shear(first), 2, shear)
        p, t, trial = f[:m], f[m:].reshape(2, m), tau[m:].reshape(2, m)
        bound, size, most = shear(np.maximum(p, 0.0)).value, np.hypot(*t), np.abs(f).max()
        np.testing.assert_allclose(p, np.maximum(tau[:m], 0.0), atol=1e-11 * most)
        assert (size <= bound + 1e-10 * most).all()
        slips = np.hypot(*(trial - t)) > 1e-9 * most
        np.testing.assert_allclose(size[slips], bound[slips], atol=1e-9 * most)
        kinds += [(p <= 0.0).sum(), ((p > 0.0) & ~slips).sum(), ((p > 0.0) & slips).sum()]
    assert (kinds > 0).all()
