"""Stencils: tangents of all kinds of tools against differences, balance, slip along arcs, planes of symmetry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from prensa.contact.forces import Scale, forces
from prensa.contact.pairing import Since, current_pairs, reference_pairs, rotation, spatial_pairs
from prensa.contact.record import ContactRecord
from prensa.friction.law import At
from prensa.friction.laws.coulomb import Coulomb
from prensa.friction.return_map import DECIDE
from prensa.tools.analytic import Analytic, Closest
from prensa.tools.shapes.circle import Disc
from prensa.tools.shapes.plane import HalfSpace


@dataclass(frozen=True)
class Ball(Analytic):
    """A sphere about the reference point; with an axis, a cylinder about that."""

    radius: float
    axis: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def closest(self, xi: np.ndarray) -> Closest:
        a = np.array(self.axis)
        q = xi - (xi @ a)[:, None] * a
        size = np.linalg.norm(q, axis=1)
        n = q / size[:, None]
        across = np.eye(3) - np.outer(a, a) - n[:, :, None] * n[:, None]
        return Closest(size - self.radius, n, across / size[:, None, None])


SHAPES = {
    "circle": (Disc(1.3), 2), "line": (HalfSpace((0.6, 0.8)), 2), "plane": (HalfSpace((0.48, 0.6, 0.64)), 3),
    "sphere": (Ball(1.3), 3), "cylinder": (Ball(1.3, (0.0, 0.6, 0.8)), 3),
}  # fmt: skip
K_N, K_T = np.array([50.0]), np.array([30.0])


class Point:
    """A point inside a tool that has turned, carried by some nodes, with all that happened to it."""

    def __init__(self, name, mu, geometry, seed, nodes=2):
        rng = np.random.default_rng(seed)
        self.shape, self.d = SHAPES[name]
        self.mu, self.geometry, d = mu, geometry, self.d
        w = 1 if d == 2 else 3
        self.N = rng.uniform(0.2, 1.0, (1, nodes))
        self.N /= self.N.sum()
        self.at = rng.normal(size=d)
        old = np.concatenate([0.1 * rng.normal(size=d), 0.4 * rng.normal(size=w)])
        place = old + np.concatenate([0.05 * rng.normal(size=d), 0.2 * rng.normal(size=w)])
        y = rng.normal(size=d)
        close = self.shape.closest(y[None])
        y = y - (close.g[0] + 0.03) * close.n[0]
        x = self.at + place[:d] + rotation(place[d:]) @ y
        y0 = y + 0.03 * rng.normal(size=d)
        x0 = self.at + old[:d] + rotation(old[d:]) @ y0
        self.X = x + 0.1 * rng.normal(size=(1, d))
        self.normal = -(rotation(place[d:]) @ close.n[0])[None]
        if geometry == "reference":
            self.X = x[None] - 0.02 * self.normal
        self.since = Since(0.3 * np.ones((1, d - 1)), x0 - self.X, old)
        self.traction = 0.2 * rng.normal(size=(1, d - 1))
        shifts = 0.2 * rng.normal(size=(nodes, d))
        shifts -= self.N @ shifts
        self.q = np.concatenate([(x - self.X + shifts).ravel(), place])
        self.coef, self.begun = np.hstack([self.N, [[-1.0]]]), None

    def forces(self, q):
        d, a = self.d, self.N.shape[1]
        u, place = self.N @ q[: d * a].reshape(a, d), q[d * a :]
        if self.geometry == "reference":
            pairs = reference_pairs(self.shape, self.X, self.normal, u, self.at, place, 100.0, self.since)
        elif d == 3:
            pairs = spatial_pairs(self.shape, self.X, u, self.at, place, self.since)
        else:
            pairs = current_pairs(self.shape, self.X + u, self.at, place)
        x = pairs.stencils(self.N, self.coef, np.arange(len(q))[None])
        if self.begun is None:
            self.begun = self.since.s if d == 3 or self.geometry == "reference" else x.s - 0.02
        record = ContactRecord.initial(1, d - 1)
        record.coordinate[:] = self.begun
        lam = np.hstack([np.zeros((1, 1)), self.traction])
        one = np.ones(1)
        law = None if self.mu is None else Coulomb(self.mu)
        want = np.full(1, DECIDE, dtype=np.int8)
        return forces(x, 0.7 * one, Scale(K_N, K_T, one, K_N), lam, record, law, At(), 1e-15 * one, want)


@pytest.mark.parametrize("geometry", ["current", "reference"])
@pytest.mark.parametrize("mu", [None, 0.05, 50.0], ids=["smooth", "slip", "stick"])
@pytest.mark.parametrize("name", SHAPES)
def test_the_tangent_is_the_derivative_by_all_unknowns(name, mu, geometry):
    """Of one to three nodes and the tool's displacements and rotations, to 1e-7 of the largest entry."""
    closed = 0
    for seed in range(12):
        point = Point(name, mu, geometry, seed, nodes=1 + seed % 3)
        f, h = point.forces(point.q), 1e-6
        closed += bool(f.p[0] > 0)
        K = np.empty_like(f.K[0])
        for i in range(len(point.q)):
            e = h * np.eye(len(point.q))[i]
            K[:, i] = -(
                8.0 * (point.forces(point.q + e).F - point.forces(point.q - e).F)[0]
                - (point.forces(point.q + 2 * e).F - point.forces(point.q - 2 * e).F)[0]
            ) / (12.0 * h)
        assert np.abs(f.K[0] - K).max() <= 1e-7 * max(np.abs(K).max(), 1.0)
    assert closed >= 10


@pytest.mark.parametrize("name", SHAPES)
def test_forces_and_moments_balance(name):
    """What the nodes get the tool gives, and its moment is that of the force at the point, to round-off."""
    for seed in range(5):
        point = Point(name, 0.3, "current", seed)
        f, d = point.forces(point.q), point.d
        nodal, tool = f.F[0, : 2 * d].reshape(2, d), f.F[0, 2 * d :]
        assert np.allclose(nodal.sum(axis=0), f.vectors[0], rtol=1e-13)
        assert np.allclose(tool[:d], -f.vectors[0], rtol=1e-13)
        arm, force = (np.append(v[0], np.zeros(3 - d)) for v in (f.stencils.arm, f.vectors))
        assert np.allclose(tool[d:], -np.cross(arm, force)[-len(tool[d:]) :], rtol=1e-12)


@pytest.mark.parametrize("name", ["plane", "sphere", "cylinder"])
def test_a_way_round_is_the_arc_whatever_turns(name):
    """In space: a point that is taken round with its tool does not slip; along the tool it slips by the arc, not by the chord."""
    shape, _ = SHAPES[name]
    rng, at = np.random.default_rng(2), np.array([0.3, -0.2, 0.1])
    y = rng.normal(size=(4, 3))
    close = shape.closest(y)
    y = y - close.g[:, None] * close.n
    old, new = (np.concatenate([rng.normal(size=3), rng.normal(size=3)]) for _ in range(2))
    X = at + old[:3] + y @ rotation(old[3:]).T
    x = at + new[:3] + y @ rotation(new[3:]).T
    still = spatial_pairs(shape, X, x - X, at, new, Since(np.zeros((4, 2)), 0.0, old))
    assert np.abs(still.s).max() < 1e-14
    assert np.allclose(still.e, still.kept, atol=1e-14)
    if name != "sphere":
        return
    angle, about = 0.7, np.array([0.0, 0.0, 1.0])
    x = at + old[:3] + y @ rotation(angle * about).T @ rotation(old[3:]).T
    gone = spatial_pairs(shape, X, x - X, at, old, Since(0.0, 0.0, old))
    radius = np.hypot(y[:, 0], y[:, 1])
    chord = 2.0 * radius * np.sin(0.5 * angle)
    arc = 2.0 * shape.radius * np.arcsin(0.5 * chord / shape.radius)
    assert np.allclose(np.linalg.norm(gone.s, axis=1), arc, rtol=1e-12)


def test_without_a_master_only_the_nodes_are_left():
    """A plane of symmetry: the stencil of a tool that stays without its columns gives the same rows and columns of the nodes."""
    point = Point("sphere", 0.3, "current", 1)
    whole = point.forces(point.q)
    x, m = whole.stencils, 6
    alone = x._replace(
        dofs=x.dofs[:, :m], coef=x.coef[:, :2].copy(), dg=x.dg[:, :m].copy(), ds=x.ds[:, :, :m].copy(),
        turn=x.turn[:, :, :m].copy(), arm=np.zeros((0, 3)),
    )  # fmt: skip
    record = ContactRecord.initial(1, 2)
    record.coordinate[:] = point.begun
    one = np.ones(1)
    f = forces(
        alone, 0.7 * one, Scale(K_N, K_T, one, K_N), np.hstack([np.zeros((1, 1)), point.traction]), record, Coulomb(0.3), At(),
        1e-15 * one, np.full(1, DECIDE, dtype=np.int8),
    )  # fmt: skip
    assert np.array_equal(f.F[0], whole.F[0, :m])
    assert np.array_equal(f.K[0], whole.K[0, :m, :m])
