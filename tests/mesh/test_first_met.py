"""The first triangles that rays meet: against linear equations of every pair of ray and triangle, and in a box."""

from __future__ import annotations

import numpy as np

from prensa.mesh.faces import first_met
from prensa.verify.stl import icosphere


def by_equations(start, way, x):
    """Of every triangle x0 + u a + v b = o + t d solved for u, v, t: the first that a ray meets, -1 for none, and how far off."""
    a, b = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    met, far = np.full(len(start), -1), np.full(len(start), np.inf)
    for k, (o, d) in enumerate(zip(start, way)):
        A = np.stack([a, b, np.broadcast_to(-d, a.shape)], axis=2)
        regular = np.abs(np.linalg.det(A)) > 1e-12
        u, v, t = np.full((3, len(x)), np.inf)
        u[regular], v[regular], t[regular] = np.linalg.solve(A[regular], (o - x[regular, 0])[..., None])[..., 0].T
        t = np.where((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 1e-6), t, np.inf)
        if np.isfinite(t).any():
            met[k], far[k] = np.argmin(t), t.min()
    return met, far


def test_rays_meet_what_equations_say():
    """A sphere of 1280 triangles and 60 loose ones; rays along axes and at random, from inside, outside and on faces."""
    rng = np.random.default_rng(4)
    points, triangles = icosphere(10.0, 3)
    x = np.concatenate([points[triangles], rng.uniform(-14.0, 14.0, (60, 3, 3))])
    start, way = rng.uniform(-15.0, 15.0, (600, 3)), rng.normal(size=(600, 3))
    way[:200] = np.eye(3)[rng.integers(0, 3, 200)] * rng.choice([-1.0, 1.0], (200, 1))
    start[500:] = x[rng.choice(1280, 100)].mean(axis=1)
    met, far = first_met(start, way, x)
    expected, at = by_equations(start, way, x)
    assert 0.3 < (met >= 0).mean() < 0.95
    assert (met == expected).all()
    assert np.abs(far[met >= 0] - at[met >= 0]).max() < 1e-9 and np.isinf(far[met < 0]).all()


def test_a_ray_along_a_common_side_takes_the_first_triangle_and_none_without_triangles():
    """Ties go to the lower number, whatever the order of the search; what a ray begins in does not count."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]])
    square = corners[[(0, 1, 2), (0, 2, 3)]]
    x = np.concatenate([np.add(square, (0.0, h, 0.0)) for h in (0.0, 1.0, 2.0)])
    start, up = np.array([[0.5, -1.0, 0.5], [0.25, 0.0, 0.25], [0.5, 2.0, 0.5]]), np.tile([0.0, 1.0, 0.0], (3, 1))
    met, far = first_met(start, up, x)
    assert met.tolist() == [0, 2, -1] and far.tolist() == [1.0, 1.0, np.inf]
    assert first_met(start, up, x[::-1])[0].tolist() == [4, 2, -1]
    assert first_met(start, up, x[:0])[0].tolist() == [-1, -1, -1]
