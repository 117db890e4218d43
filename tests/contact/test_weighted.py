"""Weighted gaps of two sides: exact tangent, balance, no slip of what turns together, uniform pressure through any two meshes."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.contact.forces import Scale, forces
from prensa.contact.pairing import rotation
from prensa.contact.record import ContactRecord
from prensa.contact.weighted import FacingSides
from prensa.friction.law import At
from prensa.friction.laws.coulomb import Coulomb
from prensa.friction.return_map import DECIDE


def sides(rng, shift=0.05):
    """A side of six nodes, walked to the left on top of its body, under one of five that lies in it; positions (11, 2)."""
    below = np.column_stack([np.linspace(1.3, 0.0, 6), np.zeros(6)])
    above = np.column_stack([np.linspace(0.1, 1.2, 5), np.full(5, -shift)])
    return np.vstack([below, above]) + 0.01 * rng.normal(size=(11, 2)), FacingSides.of(np.arange(6), np.arange(6, 11))


def respond(facing, x, committed, traction, mu):
    k = len(facing.nodes)
    dofs = (2 * facing.nodes[:, :, None] + np.arange(2)).reshape(k, -1)
    record = ContactRecord.initial(k, 1)
    one, lam = np.ones(k), np.column_stack([np.zeros(k), traction])
    scale = Scale(50.0 * one, 30.0 * one, one, one)
    want = np.full(k, DECIDE, dtype=np.int8)
    return forces(
        facing.stencils(x, committed, dofs), one, scale, lam, record, None if mu is None else Coulomb(mu), At(), 0.0 * one, want
    )


def total(f, n, matrix=False):
    """Forces (n,) of all stencils, or their matrix."""
    out = np.zeros((n, n) if matrix else n)
    for F, K, dofs in zip(f.F, f.K, f.stencils.dofs):
        if matrix:
            np.add.at(out, np.ix_(dofs, dofs), K)
        else:
            np.add.at(out, dofs, F)
    return out


@pytest.mark.parametrize("mu", [None, 0.02, 50.0], ids=["smooth", "slip", "stick"])
def test_the_tangent_is_the_derivative(mu):
    """By all nodes of both sides, ends that are covered in part included, to 1e-7 of the largest entry."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        x, facing = sides(rng)
        committed, traction = facing.coefficients(x + 0.01 * rng.normal(size=x.shape)), 0.1 * rng.normal(size=6)
        f = respond(facing, x, committed, traction, mu)
        assert (f.p > 0).sum() >= 4
        K, h = total(f, 22, True), 1e-6
        for i in range(22):
            e = h * np.eye(22)[i].reshape(11, 2)
            ends = [total(respond(facing, x + s * e, committed, traction, mu), 22) for s in (2, 1, -1, -2)]
            column = -(8.0 * (ends[1] - ends[2]) - (ends[0] - ends[3])) / (12.0 * h)
            assert np.abs(K[:, i] - column).max() <= 1e-7 * np.abs(K).max()


def test_forces_balance_and_turn_with_the_bodies():
    """The sum of all forces is zero to round-off; both sides turned together have the same forces, turned, and no slip more."""
    rng = np.random.default_rng(1)
    x, facing = sides(rng)
    committed, traction = facing.coefficients(x + 0.01 * rng.normal(size=x.shape)), 0.1 * rng.normal(size=6)
    f = respond(facing, x, committed, traction, 0.3)
    F = total(f, 22).reshape(11, 2)
    assert np.abs(F.sum(axis=0)).max() <= 1e-14 * np.abs(F).max()
    R = rotation(np.array([0.7]))
    turned = respond(facing, x @ R.T, committed, traction, 0.3)
    assert np.allclose(total(turned, 22).reshape(11, 2), F @ R.T, rtol=0.0, atol=1e-12 * np.abs(F).max())
    assert np.allclose(turned.s, f.s, atol=1e-14)


def blocks(meshes, top):
    """Stresses across two blocks on each other whose meshes do not match, joined by contact alone; ``top``: way of the top."""
    lower, upper = meshes
    problem = pr.Problem(
        "two", space="plane strain", kinematics="small",
        bodies={
            "lower": pr.Body(pr.Rectangle(size=(1.0, 1.0), n=(lower, 3)), pr.Elastic(1000.0, 0.3), "q4"),
            "upper": pr.Body(pr.Rectangle(size=(1.0, 0.7), n=(upper, 2), origin=(0.0, 1.0)), pr.Elastic(3000.0, 0.3), "q4"),
        },
        body_contacts=(pr.BodyContact("lower.top", "upper.bottom", pr.Penalty(k_n=1e5)),),
        fixed={"lower.bottom": "y", "lower.left": "x", "lower.right": "x", "upper.left": "x", "upper.right": "x"},
        steps=(pr.Step("press", fixed={"upper.top": pr.Fixed(y=top)}, increments=1),), tools={}, contacts=(),
    )  # fmt: skip
    (last,) = pr.solve(problem)
    return np.concatenate([last.bodies[b].stress.reshape(-1, 4)[:, 1] for b in ("lower", "upper")])


@pytest.mark.parametrize("meshes", [(4, 3), (7, 5), (3, 8)])
def test_a_uniform_pressure_goes_through_any_two_meshes(meshes):
    """Stresses across a flat contact are uniform to 1e-10 in either block, whichever mesh is finer."""
    stress = blocks(meshes, -0.01)
    assert stress.mean() < -1.0
    assert np.ptp(stress) <= 1e-10 * abs(stress.mean())


def test_bodies_that_are_pulled_apart_are_free_of_forces():
    """The top goes up: there is no pull through the contact."""
    assert np.abs(blocks((4, 3), 0.01)).max() <= 1e-8
