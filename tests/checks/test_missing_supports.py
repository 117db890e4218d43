"""Missing supports in space that leave no rigid motion of a body to name: bodies thrown through, sectors that open."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.errors import PreflightError
from prensa.system.discretise import discretise

METAL = pr.J2(210e3, 0.3, pr.Linear(300.0, 500.0))
BALL = pr.Sphere(radius=8.0, touching="b.top", at=(0.0, 0.0, 0.0))
PLANES = {"b.left": "x", "b.back": "z"}


def pressed(tool, *steps, table=None, fixed=PLANES, mu=0.1):
    """A quarter of a block under a tool with friction, which may have a table below it."""
    tools = {"t": tool} | ({"table": table} if table else {})
    contacts = (pr.Contact("b.top", "t"), *((pr.Contact("b.bottom", "table"),) if table else ()))
    return pr.Problem(
        "p", space="solid", bodies={"b": pr.Body(pr.Box((20.0, 10.0, 20.0), (4, 2, 4)), METAL)}, tools=tools, contacts=contacts,
        fixed=fixed, friction=pr.Coulomb(mu) if mu else None, steps=steps,
    )  # fmt: skip


def table(gap):
    """A plane below the block."""
    return pr.Plane(normal=(0.0, 1.0, 0.0), at=(0.0, -gap, 0.0))


def press(y, **more):
    return pr.Step("press", move={"t": pr.Motion(y=y)}, increments=2, **more)


def away(problem):
    """What is said of bodies that are pushed away, and whether it is refused."""
    return [(f.message, f.fatal) for f in preflight(discretise(problem)) if "away from the tools" in f.message]


@pytest.mark.parametrize("mu", [0.0, 0.1])
@pytest.mark.parametrize(
    "problem",
    [
        lambda mu: pressed(BALL, press(-2.0), mu=mu),
        lambda mu: pressed(BALL, press(-2.0), fixed={}, mu=mu),
        lambda mu: pressed(BALL, pr.Step("press", push={"t": pr.Push(y=-1000.0)}), mu=mu),
        lambda mu: pressed(BALL, press(-2.0, until=pr.Until(force={"t": pr.ToolForce(y=-1000.0)})), mu=mu),
        lambda mu: pressed(BALL, press(-1.0), pr.Step("more", move={"t": pr.Motion(y=-2.0)}), mu=mu),
        lambda mu: pressed(pr.Plane(touching="b.top"), press(-2.0), table=table(3.0), mu=mu),
        lambda mu: pressed(pr.Plane(normal=(0.0, -1.0, 0.0), at=(0.0, 15.0, 0.0)), press(-7.0), table=table(3.0), mu=mu),
        lambda mu: pressed(pr.Pyramid(of="vickers", touching="b.top", at=(0.0, 0.0, 0.0)), press(-2.0), mu=mu),
    ],
    ids=["ball", "ball alone", "push", "until", "twice", "table too far", "from afar", "pyramid"],
)
def test_a_block_without_a_bottom_is_thrown_through(problem, mu):
    """A ball, a pyramid, a force, a table that it never comes to: it would go to its end with a force of 0, and is refused."""
    ((words, fatal),) = away(problem(mu))
    assert fatal and "free to move along -y" in words and "hold its other side with 'fixed'" in words


@pytest.mark.parametrize(
    "problem",
    [
        pressed(BALL, press(-2.0), fixed=PLANES | {"b.bottom": "y"}),
        pressed(BALL, press(-2.0), fixed=PLANES | {"b.bottom": "xyz"}),
        pressed(pr.Plane(touching="b.top"), press(-2.0), table=table(0.0)),
        pressed(pr.Plane(touching="b.top"), press(-2.0), table=table(1.5)),
        pressed(BALL, press(-1.0), pr.Step("more", move={"t": pr.Motion(y=-2.0)}), table=table(1.5)),
        pressed(BALL, pr.Step("press", push={"t": pr.Push(y=-1000.0)}), table=table(3.0)),
        pressed(pr.Plane(touching="b.top"), press(-2.0), pr.Step("up", move={"table": pr.Motion(y=4.0)}), table=table(3.0)),
        pressed(BALL, pr.Step("lift", move={"t": pr.Motion(y=2.0)})),
    ],
    ids=["bottom", "clamped", "table", "table met", "table met later", "pushed onto it", "table that comes", "lifted"],
)
def test_a_block_that_comes_to_something_is_not_refused(problem):
    """Supports, a table below it, one that it comes to on the way, at once or in a later step, or that comes to it."""
    assert not [words for words, fatal in away(problem) if fatal]


def test_a_block_that_is_thrown_is_not_solved():
    """The run does not begin; with a bottom it does, and its force is not 0."""
    with pytest.raises(PreflightError, match="away from the tools of step 'press'"):
        list(pr.solve(pressed(BALL, press(-0.1))))
    *_, last = pr.solve(pressed(BALL, press(-0.1), fixed=PLANES | {"b.bottom": "y"}))
    assert last.force("t").y > 1.0


# ---------------------------------------------------------------------------------------------------------- sectors
def cut(mesh, fixed, **more):
    """What is said of a sector under a plane."""
    problem = pr.Problem(
        "p", space="solid", bodies={"b": pr.Body(mesh, METAL)}, tools={"t": pr.Plane(touching="b.top")},
        contacts=(pr.Contact("b.top", "t"), *more.pop("contacts", ())), fixed=fixed, friction=pr.Coulomb(0.1),
        steps=(press(-0.5, **more),),
    )  # fmt: skip
    return [str(f) for f in preflight(discretise(problem))]


SOLID, RING = {"radius": 10.0, "height": 15.0, "n": (4, 4, 4)}, {"radius": 10.0, "bore": 5.0, "height": 7.0, "n": (2, 2, 4)}
REVOLVED = pr.Rectangle((5.0, 7.0), (2, 2), (5.0, 0.0))


@pytest.mark.parametrize("bottom", ["xyz", "y"])
@pytest.mark.parametrize(
    ("mesh", "way"),
    [
        (pr.Cylinder(**SOLID, angle=np.pi / 2), "x"),
        (pr.Cylinder(**SOLID | {"n": (4, 4, 8)}, angle=np.pi), "z"),
        (pr.Cylinder(**RING, angle=np.pi / 3), "normal"),
        (pr.Revolution(REVOLVED, 4, angle=np.pi / 3), "normal"),
    ],
    ids=["quarter", "half", "ring", "revolved"],
)
def test_a_cut_side_that_nothing_holds_is_named(mesh, way, bottom):
    """One that is left out, and both; with the support that is missing, in one sentence; of all of them held nothing is said."""
    held = {"b.bottom": bottom, "b.base": "z", "b.cap": way}
    assert cut(mesh, held) == []
    for left in (["b.cap"], ["b.base"], ["b.base", "b.cap"]):
        (words,) = cut(mesh, {side: given for side, given in held.items() if side not in left})
        assert f"'fixed' lacks '{', '.join(f'{side}: {held[side]}' for side in left)}'" in words
        assert "of symmetry" in words or "unless" in words


@pytest.mark.parametrize(("angle", "way"), [(np.pi / 2, "x"), (np.pi / 3, "normal")])
def test_a_cut_side_of_a_mesh_from_a_file_is_named(angle, way):
    """By its nodes, elements and names alone."""
    made = discretise(pr.Problem("p", space="solid", bodies={"b": pr.Body(pr.Cylinder(**RING, angle=angle), METAL)},
                                 steps=(pr.Step("on"),))).meshes["b"]  # fmt: skip
    names = {"base": "one", "cap": "two", "bottom": "bottom", "top": "top"}
    sides = {new: made.nodes(old, old).tolist() for old, new in names.items()}
    mesh = pr.Bricks(made.points.tolist(), made.cells.tolist(), sides)
    held = {"b.bottom": "xyz", "b.one": "z"}
    (words,) = cut(mesh, held)
    assert f"'fixed' lacks 'b.two: {way}'" in words
    assert cut(mesh, held | {"b.two": way}) == []


@pytest.mark.parametrize("way", ["x", "z"])
def test_an_inclined_cut_side_that_is_held_along_one_axis_is_free_along_its_normal(way):
    """Its nodes go along the part of the normal that is left; held along both axes, or moved along them, they do not."""
    mesh, held = pr.Cylinder(**RING, angle=np.pi / 6), {"b.bottom": "y", "b.base": "z"}
    (words,) = cut(mesh, held | {"b.cap": way})
    assert "'b.cap' of the sector is free along its normal" in words and "'fixed' lacks 'b.cap: normal'" in words
    assert cut(mesh, held | {"b.cap": "xz"}) == []
    assert cut(mesh, held | {"b.cap": pr.Fixed(x=0.1, z=0.0)}) == []
    assert cut(pr.Cylinder(**RING, angle=np.pi / 2), held | {"b.cap": "x"}) == []


def test_sides_of_sectors_that_are_real_are_not_held():
    """A slotted ring of more than half a turn, a whole one, a cut side that a tool stands against, or that is pulled."""
    slotted = pr.Cylinder(**RING | {"n": (2, 2, 12)}, angle=1.5 * np.pi)
    assert cut(slotted, {"b.bottom": "xyz"}) == []
    assert cut(pr.Cylinder(**RING | {"n": (2, 2, 16)}), {"b.bottom": "xyz"}) == []
    quarter, held = pr.Cylinder(**RING, angle=np.pi / 2), {"b.bottom": "xyz", "b.base": "z"}
    assert cut(quarter, held, loads={"b.cap": pr.Load(pressure=1.0)}) == []
    assert cut(quarter, held, contacts=(pr.Contact("b.cap", "t"),)) == []


@pytest.mark.parametrize(("drop", "refused"), [(-2.0, False), (-4.0, True), (-7.0, False)])
def test_a_body_that_slides_into_a_vee_is_held_by_its_other_flank(drop, refused):
    """A vee that stays above it, pushes it aside, and takes it between both flanks."""
    mesh = pr.Rectangle((2.0, 2.0), n=(2, 2), origin=(-4.0, 0.0))
    points = ((0.0, 8.0), (8.0, 0.0), (8.0, 12.0), (-8.0, 12.0), (-8.0, 0.0))
    guided = pr.Problem(
        "vee", bodies={"b": pr.Body(mesh, pr.Elastic(1000.0, 0.3))}, fixed={"b.bottom": "y"},
        tools={"vee": pr.Polygon(points=points, fillet=0.1, at=(0.0, 1.0))},
        steps=[pr.Step("close", move={"vee": pr.Motion(y=drop)})],
    )  # fmt: skip
    assert any(fatal for _, fatal in away(guided)) is refused
