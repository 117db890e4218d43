"""Strips and wires with a nose: their shape, and tools that are placed where they meet it."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.model.schema import CaseError, dump, loads

NOSE = pr.Nose(length=1.5, thickness=0.6)
STEEL = pr.Elastic(1000.0, 0.3)


def area(mesh) -> float:
    """Area of the corners of all cells."""
    x, y = mesh.points[mesh.cells[:, :4] if mesh.cells.shape[1] in (4, 8) else mesh.cells[:, :3]].transpose(2, 0, 1)
    return 0.5 * float((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum())


@pytest.mark.parametrize("element", ["q4", "t3", "t6", "q8"])
@pytest.mark.parametrize("toward", ["right", "left"])
@pytest.mark.parametrize("half", [False, True])
def test_a_strip_is_a_bar_and_a_trapezoid(element, toward, half):
    """Its area, its front face, and a mesh line where the nose begins."""
    mesh = mesh_of(pr.Strip(8.0, 1.0, (11, 2), NOSE, front=(3.0, 0.5), toward=toward, half=half), element)
    share = 0.5 if half else 1.0
    assert area(mesh) == pytest.approx(share * (6.5 * 1.0 + 1.5 * 0.8), rel=1e-12)
    front, back = mesh.points[mesh.nodes(toward, "")], mesh.points[mesh.nodes({"right": "left", "left": "right"}[toward], "")]
    assert front[:, 0] == pytest.approx(3.0)
    assert np.ptp(front[:, 1]) == pytest.approx(share * 0.6)
    assert front[:, 1].max() == pytest.approx(0.8)
    assert np.ptp(back[:, 1]) == pytest.approx(share * 1.0)
    sign = 1.0 if toward == "right" else -1.0
    assert back[:, 0] == pytest.approx(3.0 - sign * 8.0)
    top = mesh.points[mesh.nodes("top", "")]
    assert np.abs(top - [3.0 - sign * 1.5, 1.0]).sum(axis=1).min() <= 1e-12


@pytest.mark.parametrize("toward", ["top", "bottom"])
def test_a_wire_lies_along_its_axis(toward):
    """Half of its section: the axis on the left, a skin that tapers to the front."""
    mesh = mesh_of(pr.Wire(8.0, 1.0, (11, 2), NOSE, front=2.0, toward=toward))
    assert area(mesh) == pytest.approx(0.5 * (6.5 * 1.0 + 1.5 * 0.8), rel=1e-12)
    assert (mesh.points[mesh.nodes("left", "")][:, 0] == 0).all()
    assert mesh.points[mesh.nodes(toward, "")][:, 1] == pytest.approx(2.0)
    assert mesh.points[mesh.nodes(toward, "")][:, 0].max() == pytest.approx(0.3)


def test_a_roll_comes_to_where_it_touches_the_nose():
    """Of given height, it is moved along the strip until the first node touches, and no node is inside."""
    problem = pr.Problem(
        "strip", bodies={"s": pr.Body(pr.Strip(8.0, 1.0, (16, 2), NOSE, half=True), STEEL)},
        fixed={"s.bottom": "y", "s.left": "x"}, tools={"roll": pr.Circle(3.0, at=(20.0, 3.28), touching="s.right")},
        contacts=[pr.Contact(["s.top", "s.right"], "roll")], steps=(pr.Step("stay"),),
    )  # fmt: skip
    system = pr.discretise(problem)
    (s,) = system.surfaces
    gap = system.stencils(s, system.initial().u).g
    assert gap.min() == pytest.approx(0.0, abs=1e-12)
    assert system.tools[0].at[1] == 3.28
    assert 0 < system.tools[0].at[0] < 3.0


def test_a_die_comes_down_onto_the_shoulder_of_a_wire():
    """A cone whose exit is wider than the front and narrower than the wire, lowered until it touches."""
    cone = pr.Profile(points=((0.4, 6.0), (0.4, 3.0), (1.2, 0.0), (9.0, 0.0)), fillet=0.2, above="w.right")
    problem = pr.Problem(
        "wire", bodies={"w": pr.Body(pr.Wire(8.0, 1.0, (16, 2), NOSE), STEEL)}, fixed={"w.bottom": "y"}, space="axisymmetric",
        tools={"die": cone}, contacts=[pr.Contact("w.right", "die")], steps=(pr.Step("stay"),),
    )  # fmt: skip
    system = pr.discretise(problem)
    (s,) = system.surfaces
    gap = system.stencils(s, system.initial().u).g
    assert gap.min() == pytest.approx(0.0, abs=1e-9)
    nose = system.X[s.points.nodes][np.argmin(gap)]
    assert 0.4 < nose[0] <= 0.5
    assert -1.6 < nose[1] < 0.0


@pytest.mark.parametrize(
    "mesh, space, words",
    [
        ("{type: strip, length: 4, thickness: 1, n: [4, 2], nose: {length: 5, thickness: 0.5}}", "plane strain", "nose shorter"),
        ("{type: strip, length: 4, thickness: 1, n: [4, 2], nose: {length: 1, thickness: 1}}", "plane strain", "not thinner"),
        ("{type: strip, length: 4, thickness: 1, n: [1, 2], nose: {length: 1, thickness: 0.5}}", "plane strain", "two elements"),
        ("{type: wire, length: 4, diameter: 1, n: [1, 2], nose: {length: 1, thickness: 0.5}}", "axisymmetric", "two elements"),
        ("{type: wire, length: 4, diameter: 1, n: [4, 2]}", "plane stress", "a wire is round; use 'strip'"),
        ("{type: strip, length: 4, thickness: 1, n: [4, 2]}", "axisymmetric", "a strip is not round; use 'wire'"),
    ],
)  # fmt: skip
def test_what_gives_no_nose_is_refused(mesh, space, words):
    """Lengths, thicknesses, elements and spaces that do not go together."""
    body = f"{{mesh: {mesh}, material: {{type: elastic, E: 1, nu: 0}}}}"
    text = f"name: n\nspace: {space}\nbodies: {{b: {body}}}\nsteps: [{{name: s}}]\n"
    with pytest.raises(CaseError, match=words):
        loads(text)


def test_strips_and_wires_are_written_and_read_back():
    """With and without a nose."""
    strip, wire = pr.Strip(4, 1, (4, 2), NOSE, (1, 2), "left", True), pr.Wire(4, 1, (4, 2))
    for mesh, space in ((strip, "plane strain"), (wire, "axisymmetric")):
        problem = pr.Problem("p", bodies={"b": pr.Body(mesh, STEEL)}, steps=(pr.Step("s"),), space=space)
        assert loads(dump(problem)).problem == problem
