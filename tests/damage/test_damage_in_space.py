"""Damage of bodies in space: closed forms in tension along z, and plane strain."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.materials.damage_law import StressState

STEEL = pr.J2(200000.0, 0.3, pr.Swift(K=500.0, e0=0.01, n=0.2))


def test_principal_stresses_of_six_components():
    """In the order of the laws, xx, yy, zz, xy, xz, yz: those of the matrix, and of a turned uniaxial stress its own."""
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    s = turn @ np.diag([7.0, -1.0, 2.0]) @ turn.T
    at = StressState.at(np.array([[s[0, 0], s[1, 1], s[2, 2], s[0, 1], s[0, 2], s[1, 2]]]), np.ones(1), np.ones(1))
    assert at.principal[0] == pytest.approx([7.0, 2.0, -1.0])


def pulled(way, **more):
    """A cube that is pulled or pressed along z, with two laws."""
    laws = (pr.CockcroftLatham(limit=0.05), pr.Freudenthal())
    return pr.Problem(
        "bar", space="solid", bodies={"b": pr.Body(pr.Box((1.0, 1.0, 1.0), (1, 1, 1)), STEEL, damage=laws)},
        fixed={"b.left": "x", "b.bottom": "y", "b.back": "z"},
        steps=(pr.Step("pull", by={"b.front": pr.Motion(z=way)}, increments=8, **more),),
    )  # fmt: skip


def test_damage_in_tension_is_the_strain():
    """Cockcroft and Latham's D is ε̄ in tension, 0 in compression; Freudenthal's is the plastic work per volume."""
    *_, last = pr.solve(pulled(0.1))
    body = last.bodies["b"]
    assert body.damage["cockcroft_latham"] == pytest.approx(body.plastic_strain, rel=1e-6)
    assert body.damage["freudenthal"].mean() == pytest.approx(last.energy["plastic"], rel=1e-2)
    assert last.measure("b.max.damage") == body.damage["cockcroft_latham"].max()
    assert last.measure("b.damage.cockcroft_latham.z") in body.x[:, 2]
    *_, pressed = pr.solve(pulled(-0.1))
    assert np.abs(pressed.bodies["b"].damage["cockcroft_latham"]).max() < 1e-12


def test_a_step_ends_at_the_limit_of_damage():
    """At the first point that has it."""
    *_, last = pr.solve(pulled(0.1, until=pr.Until(damage={"b": "limit"})))
    assert last.time < 1.0
    assert last.bodies["b"].damage["cockcroft_latham"].max() == pytest.approx(0.05, rel=1e-3)


def test_damage_of_a_layer_is_that_of_plane_strain():
    """At the points of a notched block that is pulled: those of the lower plane of points are the plane's, to 1e-7."""
    found = []
    for solid in (False, True):
        section = pr.Rectangle((4.0, 2.0), (4, 2))
        mesh, element = (pr.Extrusion(section, 1.0, 1), "h8") if solid else (section, "q4")
        sides = {"b.base": "z", "b.cap": "z"} if solid else {}
        *_, last = pr.solve(pr.Problem(
            "layer", space="solid" if solid else "plane strain", fixed={"b.left": "xyz"[: 3 if solid else 2], **sides},
            bodies={"b": pr.Body(mesh, STEEL, element, damage=pr.Oyane(A=0.3))},
            steps=(pr.Step("pull", by={"b.right": pr.Motion(x=0.2)}, increments=4),),
        ), pr.Numerics(tolerance=1e-11))  # fmt: skip
        found.append(last.state.damage[0][..., 0])
    assert found[1][:, :4] == pytest.approx(found[0], rel=1e-7)
    assert np.ptp(found[0]) > 0.01
