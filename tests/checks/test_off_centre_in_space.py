"""Tools in space that overlap their own mirror images: off a plane of symmetry that they reach across, or moved across it."""

from __future__ import annotations

import math

import pytest

import prensa as pr
from prensa.checks.before.off_centre import off_centre

PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(10.0, 20.0))
DOWN = {"y": -0.1}
CIRCLE = pr.Circle(radius=2.0)
FLAT = pr.Stamp(width=4.0, fillet=0.5)
PLATE = tuple((x, y, z) for x in (-1.0, 9.0) for y in (0.0, 2.0) for z in (-1.0, 9.0))


def said(
    tool: pr.ToolShape, *motions: dict[str, float], turned: bool = False, motion: dict[str, float] = DOWN, **more
) -> list[str]:
    """Of a quarter of a block, at x, z ≥ 0; or of a sector of 60° of a disc, one side of which is held along its normal."""
    if turned:
        body = pr.Body(pr.Cylinder(radius=6.0, height=2.0, n=(4, 2, 4), angle=math.radians(60.0)), PLASTIC)
        fixed = {"b.bottom": "y", "b.base": "normal", "b.cap": "normal"}
    else:
        body = pr.Body(pr.Box((6.0, 2.0, 6.0), (3, 1, 3)), PLASTIC)
        fixed = {"b.bottom": "y", "b.left": "x", "b.back": "z"}
    problem = pr.Problem(
        "block", space="solid", bodies={"b": body}, tools={"die": tool}, contacts=(pr.Contact("b.top", "die"),), fixed=fixed,
        friction=pr.Coulomb(0.1),
        steps=tuple(pr.Step(f"s{k}", by={"die": pr.Motion(**m)}) for k, m in enumerate(motions or (motion,))),
        **more,
    )  # fmt: skip
    return [str(finding) for finding in off_centre(pr.discretise(problem))]


def ball(x: float, z: float = 0.0) -> pr.ToolShape:
    return pr.Sphere(radius=2.0, at=(x, 0.0, z), touching="b.top")


def roll(x: float) -> pr.ToolShape:
    return pr.Extruded(CIRCLE, axis=(0.0, 0.0, 1.0), at=(x, 0.0, 0.0), touching="b.top")


@pytest.mark.parametrize("tool", [
    ball(0.5), ball(-0.5), roll(0.5), pr.Extruded(FLAT, axis=(0, 0, 1), at=(0.5, 2, 0), touching="b.top"),
    pr.Revolved(FLAT, at=(0.5, 2.0, 0.0), touching="b.top"), pr.Pyramid(at=(0.5, 2.0, 0.0), of="vickers"),
    pr.Polyhedron(PLATE, at=(-6.0, 2.0, 0.0)),
], ids=["ball", "beyond", "roll", "flat roll", "punch", "pyramid", "plate centred beyond"])  # fmt: skip
def test_tools_off_the_plane_that_they_cross_are_reported(tool):
    """With the plane, the distance and a remedy."""
    (words,) = said(tool)
    assert words.startswith("tools.die.at: it reaches across the plane of symmetry of 'b', x = 0, by ")
    assert "there would be two tools that overlap; centre it there, or keep it on one side; if this is not a plane" in words


@pytest.mark.parametrize("tool", [
    ball(0.0), ball(2.0, 3.0), ball(5.0), roll(0.0), pr.Plane(touching="b.top"), pr.Polyhedron(PLATE, at=(0.0, 2.0, 0.0)),
    pr.Revolved(FLAT, at=(0.0, 2.0, 0.0), touching="b.top"), pr.Pyramid(at=(0.0, 2.0, 0.0), of="vickers"),
], ids=["centred", "tangent", "beside", "roll", "plane", "plate", "punch", "pyramid"])  # fmt: skip
def test_others_are_left_alone(tool):
    """Centred ones, those on one side, endless ones along the plane's normal, plates that are drawn beyond the plane."""
    assert said(tool) == []


def test_how_far_off_it_is_is_reported():
    """Ball of radius 2 at x = 0.5: it reaches 1.5 across; with 'no_contact' against symmetry nothing is said."""
    assert "x = 0, by 1.5 and is centred at x = 0.5" in said(ball(0.5))[0]
    assert said(ball(0.5), no_contact=(pr.NoContact("b", "symmetry"),)) == []


def test_inclined_planes():
    """A ball on the axis lies on both sides' planes; off it, along the middle of the sector, it crosses them unless it is far."""
    half = math.radians(30.0)
    on_middle = {r: pr.Sphere(radius=1.0, at=(r * math.cos(half), 0.0, z), touching="b.top")
                 for r in (0.0, 1.0, 3.5) for z in (r * math.sin(half),)}  # fmt: skip
    assert said(on_middle[0.0], turned=True) == []
    (words,) = said(on_middle[1.0], turned=True)
    assert "by 0.5 and is centred" in words
    assert said(on_middle[3.5], turned=True) == []


def test_tools_that_move_across_the_plane_are_reported():
    """Where they cross it: the image moves the other way; along the plane and about its normal they may move."""
    (words,) = said(ball(0.0), motion={"x": 1.0, "y": -0.1})
    assert words.startswith("steps.0: tool 'die' reaches across the plane of symmetry of 'b', x = 0, and moves or turns across")
    assert len(said(roll(0.0), motion={"rz": 0.5, "y": -0.1})) == 1
    assert said(roll(3.0), motion={"rz": 0.5, "x": 1.0}) == []
    assert said(ball(3.0), motion={"x": 1.0, "y": -0.1}) == []
    assert said(ball(0.0, 3.0), motion={"z": 1.0, "y": -0.1}) == []
    assert said(ball(0.0), DOWN, {"y": 1.0}, {"x": 1.0}) == []  # lifted off before
    assert len(said(ball(0.0), DOWN, {"x": 1.0})) == 1
