"""Metal never lies inside a tool unnoticed: outlines are the default, what they miss is reported, what is meant can be said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.overlap import overlaps
from prensa.checks.before.preflight import preflight
from prensa.checks.during.penetration import inside, watches
from prensa.errors import PreflightError, SolveError
from prensa.mesh.mesh import MeshError
from prensa.system.failure import MetalInside
from problems import single_block

METAL = pr.J2(E=70e3, nu=0.3, flow=pr.Voce(s0=60, Q=120, b=8))
SOFT = pr.Elastic(E=1000.0, nu=0.3)
WALL = pr.Plane(normal=(-1, 0), at=(4.0, 0.0))


def pressed(contacts=(), material=METAL, *, tools=None, y=-0.2, increments=4, **more):
    """A strip of 4 × 2 under a die, a wall at its side."""
    tools = {"die": pr.Plane(touching="b.top"), "wall": WALL} if tools is None else tools
    step = pr.Step("press", move={"die": pr.Motion(y=y)} if "die" in tools else {}, increments=increments)
    return single_block(step, material=material, tools=tools, contacts=contacts, **more)


def last(problem):
    return list(pr.solve(problem))[-1]


RIGHT = (pr.Contact(("b.top", "b.right"), "die"), pr.Contact("b.right", "wall"))


@pytest.mark.parametrize("element", ["q4_fbar", "q8", "t6", "t3", "q4_enhanced", "q4_sheet"])
def test_contacts_left_out_are_all_that_there_can_be(element):
    """A case without contacts gives the forces of the case that lists every side that touches, in every element."""
    kind = {"element": element, "n": (4, 2), "increments": 2, "material": SOFT}
    sides = ("b.top", "b.right")
    listed = last(pressed((pr.Contact(sides, "die"), pr.Contact(sides, "wall")), **kind))
    all_of_them = last(pressed(**kind))
    for tool, axis in (("die", "y"), ("wall", "x")):
        ours, theirs = (getattr(i.force(tool), axis) for i in (all_of_them, listed))
        assert abs(theirs) > 10
        assert ours == pytest.approx(theirs, rel=1e-9)


def test_an_outline_leaves_out_what_is_held_named_tied_or_on_the_axis():
    """Lines of symmetry, the axis, tied sides, and sides that another entry names are no part of it; what is released is."""
    sides = pressed(tools={"die": pr.Plane(touching="b.top")})

    def where(p, number=0):
        s = pr.discretise(p).surfaces[number]
        return {(x, y) for x, y in s.X.tolist() if (x, y) not in ((0.0, 2.0), (4.0, 0.0), (4.0, 2.0), (0.0, 0.0))}

    assert {x for x, y in where(sides) if y < 2} == {4.0}
    loose = replace(sides.steps[0], fixed={"b.left": "free"})
    assert {x for x, y in where(replace(sides, steps=(loose,))) if 0 < y < 2} == {0.0, 4.0}
    axis = replace(sides, space="axisymmetric", fixed={"b.bottom": "y"})
    assert {x for x, y in where(axis) if y < 2} == {4.0}
    named = replace(sides, contacts=(pr.Contact("b", "die"), pr.Contact("b.top", "die", friction=pr.Coulomb(0.3))))
    assert {y for x, y in where(named)} == {0.5, 1.0, 1.5}
    assert {y for x, y in where(named, 1)} == {2.0}
    passing = replace(sides, contacts=(pr.Contact("b", "die"),), no_contact=(pr.NoContact("b.right", "die"),))
    assert {y for x, y in where(passing)} == {2.0}
    upper = pr.Body(pr.Rectangle(size=(4, 2), n=(8, 4), origin=(0, 2)), METAL)
    tied = replace(
        sides, bodies={**sides.bodies, "c": upper}, ties=(pr.Tie("c.bottom", "b.top"),), contacts=(),
        tools={"die": pr.Plane(touching="c.top")}, fixed={"b.bottom": "y"},
    )  # fmt: skip
    assert {x for x, y in where(tied)} == {0.0, 4.0}


def test_two_frictions_on_one_outline_add_up_to_the_whole():
    """The outline with one side named apart gives the force of both named apart, and of one contact where friction is equal."""
    law = pr.Coulomb(0.1)
    die = {"tools": {"die": pr.Plane(touching="b.top")}}
    whole = last(pressed((pr.Contact("b", "die", friction=law),), **die))
    parted = last(pressed((pr.Contact("b", "die", friction=law), pr.Contact("b.right", "die", friction=law)), **die))
    assert parted.force("die").y == pytest.approx(whole.force("die").y, rel=1e-9)


def test_no_contact_as_a_whole_leaves_a_tool_out():
    """A body that a tool goes through by intent has no contact with it, and says so in the file that is written."""
    p = pressed(no_contact=(pr.NoContact("b", "wall"),))
    assert [c.name for c in p.contacts] == ["b-die"]
    from prensa.model.schema import dump, loads

    assert loads(dump(p)).problem == p
    assert last(p).force("wall").x == 0


def test_metal_inside_a_tool_stops_the_run():
    """A wall that names the wrong side: the run ends with the node, the side, the depth and what to add, after one attempt."""
    wrong = (pr.Contact(("b.top", "b.right"), "die"), pr.Contact("b.bottom", "wall"))
    with pytest.raises(
        SolveError, match=r"of 'b.right' at .* inside tool 'wall', which no contact .* add .*b.right"
    ) as caught:
        last(pressed(wrong, increments=10))
    assert isinstance(caught.value.reason, MetalInside)
    assert 0 < caught.value.reason.node.depth < 0.1
    meant = pressed(wrong, no_contact=(pr.NoContact("b.right", "wall"),))
    assert last(meant).bodies["b"].x[:, 0].max() > 4.1
    assert last(pressed(RIGHT)).force("die").y > 10 * last(meant).force("die").y


def test_metal_inside_a_tool_at_the_start_is_refused():
    """A tool that stands in a body at a side without contact is refused before anything is solved; a mere touch is not."""
    only_top = (pr.Contact(("b.top", "b.right"), "die"),)
    touching = pr.discretise(pressed(only_top))
    assert inside(touching, watches(touching), touching.initial().u) is None
    tools = {"die": pr.Plane(touching="b.top"), "wall": replace(WALL, at=(3.9, 0.0))}
    with pytest.raises(PreflightError, match=r"tools.wall: node \d+ of 'b.right' at \(4, .*lies 0.1 inside"):
        last(pressed(only_top, tools=tools))


def test_a_tool_on_its_way_into_a_side_without_contact_is_reported():
    """A tool that reaches a body at rest through a side that is not listed is reported with the time, before the run."""
    tools = {"die": pr.Plane(normal=(0, -1), at=(0.0, 2.5)), "wall": replace(WALL, at=(4.2, 0.0))}
    steps = (pr.Step("push", move={"wall": pr.Motion(x=-0.6)}), pr.Step("press", move={"die": pr.Motion(y=-0.6)}))
    p = replace(pressed((pr.Contact(("b.top", "b.right"), "die"),), tools=tools), steps=steps)
    said = [str(n) for n in preflight(pr.discretise(p))]
    assert any("tools.wall: at time" in words and "'b.right'" in words for words in said)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_condensed_bodies_are_looked_at_where_they_are(kinematics):
    """Whether nodes off the contact are computed on the way or at the end of a step, the same is reported."""
    tools = {"die": pr.Plane(touching="b.top"), "wall": replace(WALL, at=(4.0, 0.0))}
    fine = pressed((pr.Contact("b.top", "die"),), SOFT, tools={"die": tools["die"]}, kinematics=kinematics)
    wrong = pressed((pr.Contact("b.top", "die"),), SOFT, tools=tools, kinematics=kinematics)
    for condense in (True, False) if kinematics == "small" else (False,):
        numerics = pr.Numerics(condense=condense)
        assert list(pr.solve(fine, numerics))[-1].force("die").y > 0
        with pytest.raises(SolveError, match=r"'b.right'"):
            list(pr.solve(wrong, numerics))


def test_one_side_in_two_contacts_with_a_tool_is_refused():
    """By name, and by edges that two names share: which friction holds is not said."""
    twice = (pr.Contact(("b.top", "b.right"), "die", friction=pr.Coulomb(0.1)), pr.Contact("b.top", "die"))
    with pytest.raises(ValueError, match=r"'b.top' is against 'die' in contacts.0 already"):
        pressed(twice)
    X = [(float(x), float(y)) for y in range(2) for x in range(3)]
    mesh = pr.Points(X, [(0, 1, 4, 3), (1, 2, 5, 4)], {"top": (3, 4, 5), "half": (3, 4), "bottom": (0, 1, 2)})
    p = pr.Problem(
        "sets", bodies={"b": pr.Body(mesh, SOFT)}, tools={"die": pr.Plane(touching="b.top")}, fixed={"b.bottom": "xy"},
        contacts=(pr.Contact("b.top", "die"), pr.Contact("b.half", "die")), steps=(pr.Step("press"),),
    )  # fmt: skip
    with pytest.raises(MeshError, match=r"contacts.1: the edge at \(0.5, 1\) is in contact 'b.top-die' already"):
        pr.discretise(p)


def test_an_outline_has_no_normal_at_its_corners():
    """Gaps on the undeformed surface need sides with a normal: the outline is refused there, with what to write."""
    with pytest.raises(ValueError, match=r"contacts.0.surface: .*name the boundaries that tool 'die' touches"):
        pressed(material=SOFT, kinematics="small", contact_geometry="reference")


def test_bodies_that_overlap_are_reported_and_neighbours_are_not():
    """Nodes, or the centres of elements, of one in the other; bodies that share a side only meet."""
    for origin, depth in (((0, 1), 1.0), ((1.0, 0.25), 0.75), ((0, 2), 0), ((4, 1), 0), ((9, 9), 0)):
        other = pr.Body(pr.Rectangle(size=(2, 2), n=(4, 4), origin=origin), METAL)
        p = pressed(tools={})
        found = list(overlaps(pr.discretise(replace(p, bodies={**p.bodies, "c": other}))))
        assert [(o.first, o.second) for o in found] in ([], [("b", "c")])
        assert bool(found) == bool(depth)
        if depth:
            assert found[0].depth == pytest.approx(depth, abs=0.3)


def test_a_tool_deep_in_a_plastic_body_is_refused():
    """No increment is short enough to push it out: that is said at once, with where to put it."""
    with pytest.raises(PreflightError, match=r"tools.die: it starts 0.4 inside 'b.top\+b.right'.*move the tool by"):
        last(pressed(RIGHT[:1], tools={"die": pr.Plane(normal=(0, -1), at=(0.0, 1.6))}))


@pytest.mark.parametrize(
    ("tool", "way"),
    [
        (pr.Profile([(4, 9), (4, 0), (0, 0)], fillet=(0, 0.6, 0), at=(0, 0)), -0.6),  # a container round at its corner
        (pr.Profile([(3.9, 9), (3.9, 0), (9.9, -6)], fillet=0, at=(0, 0)), 2.1),  # a die with a narrow bore over a cone
    ],
)
def test_a_ring_comes_out_of_a_body_along_the_axis(tool, way):
    """In axisymmetry the way out that is reported is one along the axis, and it does bring it out; a narrow tube has none."""
    contact = pr.Contact(("b.bottom", "b.right"), "die")
    p = pressed((contact,), tools={"die": tool}, space="axisymmetric", fixed={"b.top": "y"}, n=(16, 8))
    assert any(f"move the tool along the axis by {way:g}, or leave" in str(n) for n in preflight(pr.discretise(p)))
    tools = {"die": replace(tool, at=(0, way))}
    assert not any("inside" in str(n) for n in preflight(pr.discretise(replace(p, tools=tools))))
    tube = {"die": pr.Profile([(3.5, 9), (3.5, -9)], at=(0, 0))}
    with pytest.raises(PreflightError, match=r"leave 0\.5 more room between the two: no move along the axis"):
        last(replace(p, tools=tube, contacts=(pr.Contact("b.right", "die"),)))


def test_a_thin_tool_presses_as_a_thick_one():
    """A plate of a tenth of an element does not slip through the nodes in small steps: its force is that of a thick one."""

    def force(thickness):
        points = [(-6, 0), (6, 0), (6, thickness), (-6, thickness)]
        plate = pr.Polygon(points=points, fillet=0.2 * thickness, at=(2.0, 2.0))
        steps = (
            pr.Step("touch", move={"die": pr.Motion(y=-0.02)}, increments=2),
            pr.Step("press", move={"die": pr.Motion(y=-0.3)}, increments=5),
        )
        p = pressed((pr.Contact("b.top", "die"),), SOFT, tools={"die": plate}, n=(4, 2))
        return last(replace(p, steps=steps)).force("die").y

    assert force(0.05) == pytest.approx(force(1.0), rel=1e-6)


def test_concave_corners_get_no_automatic_fillet():
    """Metal fills the corner of a container to its walls; convex corners are rounded as before."""
    from prensa.geometry.chain import chain

    corner = chain([(10, 9), (10, 0), (0, 0)], None, False, 0.5)
    assert not any(p.radius for p in corner)
    edge = chain([(0, 0), (10, 0), (10, 9)], None, False, 0.5)
    assert [p.radius for p in edge if p.radius] == [0.5]
    assert np.isfinite(
        pr.Profile(points=[(10, 9), (10, 0), (0, 0)], at=(0, 0))
        .shape(np.array([0, -1]), 0.5)
        .closest(np.ones((1, 2)))
        .g[0]
    )
