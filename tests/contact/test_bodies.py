"""Contact of two bodies described in a problem: uniform stress through meshes that do not match, and no pull."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.model.schema import loads


def blocks(meshes, way, kinematics="small", sides="free", thickness=1.0, **given):
    """Two blocks of one material on each other, the upper one's top moved by ``way``; smooth planes or nothing at the right."""
    held = {f"{b}.{side}": "x" for b in ("lower", "upper") for side in (("left",) if sides == "free" else ("left", "right"))}
    lower, upper = meshes
    return pr.Problem(
        "two blocks", kinematics=kinematics, thickness=thickness,
        bodies={
            "lower": pr.Body(pr.Rectangle(size=(1.0, 1.0), n=(lower, 3)), pr.Elastic(1000.0, 0.3)),
            "upper": pr.Body(pr.Rectangle(size=(1.0, 0.7), n=(upper, 2), origin=(0.0, 1.0)), pr.Elastic(1000.0, 0.3)),
        },
        body_contacts=(pr.BodyContact(slave="lower.top", master="upper.bottom"),),
        fixed={"lower.bottom": "y", **held},
        steps=(
            pr.Step("press", fixed={"upper.top": pr.Fixed(y=-way)}, increments=2),
            pr.Step("pull", fixed={"upper.top": pr.Fixed(y=way)}, increments=3),
        ), **given,
    )  # fmt: skip


def stresses(increment):
    return np.concatenate([increment.bodies[b].stress.reshape(-1, 4) for b in ("lower", "upper")])


@pytest.mark.parametrize("meshes", [(4, 3), (7, 5), (3, 8)])
@pytest.mark.parametrize(("kinematics", "sides"), [("small", "free"), ("small", "held"), ("finite", "held")])
def test_a_uniform_stress_goes_through_and_the_interface_opens(meshes, kinematics, sides):
    """Pressed: stresses of either block uniform to 1e-10, plane strain's. Pulled: no stress, and the gap is what was pulled."""
    increments = list(pr.solve(blocks(meshes, 0.01, kinematics, sides), pr.Numerics(tolerance=1e-12)))
    pressed, pulled = increments[1], increments[-1]
    stress = stresses(pressed)
    across = stress[:, 1]
    assert np.ptp(across) <= 1e-10 * np.abs(across).max()
    assert np.ptp(stress, axis=0).max() <= 1e-10 * np.abs(across).max()
    if kinematics == "small":
        modulus = 1000.0 / (1 - 0.3**2) if sides == "free" else 1000.0 * 0.7 / (1.3 * 0.4)
        # the penalty gives way by p/k_n
        assert across.mean() == pytest.approx(-modulus * 0.01 / 1.7, rel=0.01)
    assert np.abs(stresses(pulled)).max() <= 1e-8
    y = {b: pulled.bodies[b].x[:, 1] for b in ("lower", "upper")}
    assert y["upper"].min() - y["lower"].max() == pytest.approx(0.01, rel=1e-8)


def test_forces_are_those_of_the_whole_thickness():
    """Supports of a block three times as thick carry three times the force, at the same stress."""
    one, three = (list(pr.solve(blocks((4, 3), 0.01, thickness=t)))[1] for t in (1.0, 3.0))
    assert three.supports["lower.bottom"].y == pytest.approx(3 * one.supports["lower.bottom"].y, rel=1e-9)
    assert np.allclose(stresses(three), stresses(one), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"contact_geometry": "reference"}, "on moved sides"),
        ({"space": "axisymmetric"}, "only in plane strain"),
        ({"body_contacts": (pr.BodyContact("lower.top", "lower.bottom"),)}, "itself is not available yet"),
        ({"body_contacts": (pr.BodyContact("lower.top", "upper.botom"),)}, "did you mean 'bottom'"),
        ({"body_contacts": (pr.BodyContact("lower.top", "upper.bottom", pr.Augmented()),)}, "enforced by 'penalty'"),
        ({"steps": (pr.Step("free", remove_tools=True),)}, "cannot be freed of all supports"),
    ],
)
def test_what_it_cannot_do_yet_is_refused(change, words):
    """In words, when the problem is described."""
    from dataclasses import replace

    with pytest.raises(pr.CaseError, match=words):
        replace(blocks((4, 3), 0.01), **change)


def test_derivatives_and_case_files_are_refused():
    """Derivatives know nothing of it yet, and a file cannot ask for it."""
    with pytest.raises(pr.PrensaError, match="contact between bodies are not available yet"):
        list(pr.solve(blocks((4, 3), 0.01), derivatives=["bodies.lower.material.E"]))
    text = """
name: two
bodies:
  lower: {mesh: {type: rectangle, size: [1, 1], n: [2, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}
  upper: {mesh: {type: rectangle, size: [1, 1], n: [3, 2], origin: [0, 1]}, material: {type: elastic, E: 1000, nu: 0.3}}
body_contacts: [{slave: lower.top, master: upper.bottom}]
steps: [{name: press}]
"""
    with pytest.raises(pr.CaseError, match="6:1: body_contacts is described in Python alone so far"):
        loads(text)


def test_bodies_in_contact_are_not_condensed():
    """A condensed body would lose the contact with the other one: the force on the support is what the upper one presses."""
    two = pr.Problem(
        "two", {
            "lower": pr.Body(pr.Rectangle((1.0, 1.0), (4, 4)), pr.Elastic(1000.0, 0.3)),
            "upper": pr.Body(pr.Rectangle((1.0, 0.7), (3, 3), origin=(0.0, 1.0)), pr.Elastic(1000.0, 0.3)),
        },
        (pr.Step("press", fixed={"upper.top": pr.Fixed(y=-0.01)}, increments=2),), kinematics="small", space="plane strain",
        body_contacts=(pr.BodyContact(slave="lower.top", master="upper.bottom"),),
        fixed={"lower.bottom": "y", "lower.left": "x", "upper.left": "x"},
    )  # fmt: skip
    *_, inc = pr.solve(two)
    assert inc.supports["lower.bottom"].y == pytest.approx(-inc.supports["upper.top"].y, rel=1e-8)
    assert inc.supports["lower.bottom"].y > 5.0
    with pytest.raises(pr.PrensaError, match="contact between bodies"):
        list(pr.solve(two, pr.Numerics(condense=True)))
