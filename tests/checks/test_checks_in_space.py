"""Checks before and during runs in space: places have three coordinates, and what the plane is warned of is warned of here."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.overlap import overlapping_bodies
from prensa.checks.before.preflight import preflight
from prensa.checks.before.solids_overlap import solid, twice_inside, windings
from prensa.checks.before.standstills import standstills
from prensa.checks.before.table_starts import table_starts
from prensa.checks.before.tied_gaps import tied_gaps
from prensa.checks.before.travels import travels
from prensa.checks.during.acceptance import least_corner, tunnelled
from prensa.checks.during.self_intersection import SelfIntersection
from prensa.checks.during.validity import Validity
from prensa.errors import SolveError
from prensa.mesh.faces import nearest_on_faces
from prensa.mesh.generate import mesh_of
from prensa.model.until import ToolTravel
from prensa.policy import Policy
from prensa.system.failure import MetalInside
from prensa_bench.robustness.split_in_space import split

STEEL = pr.J2(210e3, 0.3, pr.Linear(300.0, 500.0))


def block(tool: pr.ToolShape, *moves: pr.Motion, n: tuple[int, int, int] = (4, 2, 4), **given: object) -> pr.Problem:
    """A box of 8 × 4 × 8 on its bottom, a tool and its motions, a step each."""
    settings: dict[str, object] = {
        "bodies": {"b": pr.Body(pr.Box((8.0, 4.0, 8.0), n, (-4.0, 0.0, -4.0)), STEEL)},
        "tools": {"t": tool}, "contacts": (pr.Contact(("b.top",), "t"),), "fixed": {"b.bottom": "xyz"},
        "steps": tuple(pr.Step(f"step {k}", move={"t": m}, increments=4) for k, m in enumerate(moves)), **given,
    }  # fmt: skip
    return pr.Problem("block", space="solid", **settings)  # type: ignore[arg-type]


def ball(x: float, y: float, z: float, radius: float = 2.0) -> pr.ToolShape:
    """A ball in its place."""
    return pr.Sphere(radius=radius, at=(x, y, z))


def test_metal_inside_a_tool_is_named_with_its_side_and_place():
    """A ball that comes from the right meets a side that has no contact: the run ends there."""
    p = block(ball(7.0, 2.0, 2.0), pr.Motion(x=-2.0))
    with pytest.raises(SolveError, match=re.escape("of 'b.right' at (4, 2, 2) lies")) as caught:
        list(pr.solve(p))
    assert isinstance(caught.value.reason, MetalInside)
    assert "surface: b.right, against: t" in str(caught.value)


def test_a_narrow_tool_between_nodes_is_seen_on_the_edges_of_faces():
    """A ball thinner than an element touches an edge of a face in its middle, and no node."""
    p = block(ball(4.5, 1.5, 2.0, radius=0.4), pr.Motion(x=-0.2), n=(4, 4, 4))
    with pytest.raises(SolveError, match=r"the edge between nodes \d+ and \d+ of 'b.right' at \(4, 1.5, 2\)"):
        list(pr.solve(p))


def test_a_node_that_gets_through_a_tool_is_seen():
    """Both ends of the way are free of contact, and the way leads through the ball."""
    system = pr.discretise(block(ball(0.0, 7.0, 0.0), pr.Motion(y=-1.0)))
    state = system.initial()
    there = state.u.copy()
    for y, through in ((-1.5, False), (-12.0, True)):
        there[system.tool_dof(0) + 1] = y
        found = tunnelled(system, state, there)
        assert bool(found) == through
    assert found is not None
    assert (found.x, found.y, found.z) == (0.0, 4.0, 0.0)


@pytest.mark.parametrize(
    ("tool", "words"),
    [
        (ball(0.0, 5.5, 0.0), r"starts 0\.5 inside 'b\.top', deepest at node \d+ \(0, 4, 0\).*move the tool by \(0, 0\.5, 0\)"),
        (pr.Plane(normal=(0.0, 1.0, 0.0), at=(0.0, 4.0, 0.0)), "its normal points the same way"),
        (pr.Plane(normal=(0.0, -1.0, 0.0), at=(0.0, 6.0, 0.0)), "never touches 'b.top'.*never comes nearer than 1"),
        (ball(0.0, 8.0, 0.0), "never touches 'b.top' in any step: it never comes nearer than 1"),
        (ball(0.0, 2.0, 0.0, radius=0.5), "lies inside body 'b'"),
    ],
)
def test_where_tools_stand_is_looked_at_before_anything_is_solved(tool, words):
    """Overlap at the start, a plane that looks the wrong way, a tool that meets nothing, one inside the body."""
    found = preflight(pr.discretise(block(tool, pr.Motion(y=-1.0))))
    assert any(re.search(words, f.message) for f in found), [f.message for f in found]


def test_a_block_that_is_right_gets_no_findings():
    """A ball on it that presses and slides."""
    found = preflight(pr.discretise(block(ball(0.0, 6.0, 0.0), pr.Motion(y=-0.1), pr.Motion(x=0.5, z=0.5))))
    assert [f.message for f in found] == []


@pytest.mark.parametrize(("tool", "reported"), [(ball(0.45, 4.8, 0.45, radius=0.8), True), (ball(0.0, 16.0, 0.0, 12.0), False)])
def test_a_tool_finer_than_the_faces_is_reported_after_the_step(tool, reported, caplog):
    """A ball of an element beside a node lies deeper in the middle of a face than at its nodes; a large one does not."""
    list(pr.solve(block(tool, pr.Motion(y=-0.5), n=(8, 4, 8))))
    assert any("between nodes" in words for words in caplog.messages) == reported


def test_the_least_corner_of_a_brick_is_that_of_its_edges():
    """1 of a cube; 0 where three edges of a corner lie in a plane; negative where it is turned inside out."""
    cube = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    assert least_corner(cube[:, None]) == pytest.approx(1.0)
    for lift, sign in ((0.5, 0), (0.75, -1)):
        pushed = cube.copy()
        pushed[6] = cube[6] - lift * np.array([2 / 3, 2 / 3, 2 / 3])
        assert np.sign(np.round(least_corner(pushed[:, None])[0], 12)) == sign


def test_small_strain_ends_where_a_body_in_space_turns_or_is_strained_too_far():
    """A cube that is sheared in space is strained by half the shear, and turned by its arc tangent."""
    system = pr.discretise(block(ball(0.0, 9.0, 0.0), pr.Motion(y=-1.0), kinematics="small"))
    look = Validity(system, Policy())
    u = np.zeros(system.ndof)
    shear = 0.4 * system.X[:, 1]
    moved = np.stack([shear, 0.0 * shear, 0.0 * shear], axis=1)
    u[: moved.size] = moved.ravel()
    found = look.look(u, ())
    assert found is not None
    assert (found.strain, found.rotation) == pytest.approx((0.2, np.arctan(0.2)))


def test_metal_that_loses_volume_in_space_is_noticed():
    """A body squeezed to 0.8 of its volume."""
    system = pr.discretise(block(ball(0.0, 9.0, 0.0), pr.Motion(y=-1.0)))
    look = Validity(system, Policy())
    u = np.zeros(system.ndof)
    u[: system.X.size] = (-0.2 * system.X * [0.0, 1.0, 0.0]).ravel()
    look.look(u, [b.undeformed for b in system.blocks])
    assert look.squeezed == {"b": pytest.approx(0.2)}


def test_a_surface_with_an_edge_has_no_normal_of_its_own():
    """On the undeformed surface; of the sides of an element apart there is nothing to say, nor where the faces turn gently."""
    both = block(pr.Sphere(radius=9.0, at=(0.0, 13.0, 0.0)), pr.Motion(y=-0.1), contact_geometry="reference", kinematics="small",
                 contacts=(pr.Contact(("b.top", "b.right"), "t"),))  # fmt: skip
    (found,) = [f for f in preflight(pr.discretise(both)) if f.path == "contacts.0.surface"]
    assert found.fatal and "'b.top+b.right' does not have at its edge at (4, 4," in found.message
    round_ = pr.Body(pr.Cylinder(radius=4.0, height=4.0, n=(2, 2, 12)), STEEL)
    side = pr.Plane(normal=(-1.0, 0.0, 0.0), at=(4.0, 0.0, 0.0))
    top = block(side, pr.Motion(x=-0.1), contact_geometry="reference", kinematics="small",
                bodies={"b": round_}, contacts=(pr.Contact(("b.outer",), "t"),))  # fmt: skip
    assert [f for f in preflight(pr.discretise(top)) if f.path.endswith("surface")] == []


def test_stock_that_is_fed_to_no_roll_or_against_it_is_named():
    """A bar fed beneath a roll that turns with it, one that turns against it, and one that it never reaches."""
    roll = pr.Extruded(section=pr.Circle(radius=10.0), axis=(0.0, 0.0, 1.0), at=(8.0, 13.7, 0.0))
    for turn, way, words in ((0.3, 3.0, ""), (-0.3, 3.0, "reverse the sign of 'rz', which is positive right-handed about z"),
                             (0.3, 0.5, "does not bring 'b' into contact")):  # fmt: skip
        step = pr.Step("feed", feed={"b.left": pr.Feed(x=way)}, by={"t": pr.Motion(rz=turn)})
        p = block(roll, contacts=(pr.Contact(("b.top", "b.right"), "t"),), fixed={"b.bottom": "yz"}, steps=(step,))
        found = " ".join(f.message for f in preflight(pr.discretise(p)) if ".feed." in f.path or ".by." in f.path)
        assert words in found and bool(words) == bool(found), found
        apart = tuple(pr.Contact((side,), "t") for side in ("b.top", "b.right"))
        again = preflight(pr.discretise(block(roll, contacts=apart, fixed={"b.bottom": "yz"}, steps=(step,))))
        assert " ".join(f.message for f in again if ".feed." in f.path or ".by." in f.path) == found  # once


def test_one_node_that_carries_a_ball_on_metal_says_nothing_of_the_share(caplog):
    """A third of the force on elements as large as the contact, where the dip between nodes alone is a tenth of the depth."""
    tool = pr.Sphere(radius=2.5, at=(-4.0, 6.5, -4.0))
    body = pr.Body(pr.Box((4.0, 4.0, 4.0), (3, 3, 3), (-4.0, 0.0, -4.0)), STEEL)
    steps = (pr.Step("press", move={"t": pr.Motion(y=-0.3)}, increments=10),)
    *_, last = pr.solve(block(tool, bodies={"b": body}, fixed={"b.bottom": "y", "b.left": "x", "b.back": "z"}, steps=steps))
    assert last.force("t").y > 0.0
    assert "1 node carries all of tool 't'" in caplog.text and "forces are too small; shorten" in caplog.text


@pytest.mark.parametrize(("radius", "depth", "aside"), [(2.2, 0.3, 0.4), (6.0, 0.1, 0.25)])
def test_the_force_that_is_missed_between_the_nodes_of_faces_is_estimated(radius, depth, aside, caplog):
    """Balls on a few nodes: what the limit of that mesh and one twice as fine has more, within a third of it."""
    forces, said = [], []
    for finer in (1, 2):
        n = (5 * finer, 3 * finer, 5 * finer)
        body = pr.Body(pr.Box((5.0, 3.0, 5.0), n, (-2.5, 0.0, -2.5)), pr.Elastic(1000.0, 0.3))
        tool = pr.Sphere(radius=radius, at=(aside, 3.0 + radius, 0.5 * aside))
        steps = (pr.Step("press", move={"t": pr.Motion(y=-depth)}, increments=1),)
        *_, last = pr.solve(block(tool, bodies={"b": body}, steps=steps))
        forces.append(last.force("t").y)
        said = said if finer > 1 else re.findall(r"by an estimated (\d+) %", caplog.text)
    missed = 1.0 - forces[0] / (forces[1] + (forces[1] - forces[0]) / 3.0)  # an error that goes with the square of the edges
    assert missed > 0.1
    assert 0.67 * missed < float(said[0]) / 100.0 < 1.33 * missed


def beside(mesh: object, *ties: pr.Tie, first: object = None) -> pr.Problem:
    """The box of `block`, or another body, and a second one."""
    bodies = {"b": pr.Body(first or pr.Box((8.0, 4.0, 8.0), (4, 2, 4), (-4.0, 0.0, -4.0)), STEEL), "c": pr.Body(mesh, STEEL)}
    return pr.Problem("two", space="solid", bodies=bodies, fixed={"b.bottom": "xyz"}, steps=(pr.Step("s"),), ties=ties)


def small(*origin: float) -> pr.Box:
    """A box of 2 × 2 × 2."""
    return pr.Box((2.0, 2.0, 2.0), (2, 2, 2), origin)


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (small(0.0, 3.0, 0.0), r"it overlaps body 'b', by 1 mm at \(0, 3, 0\)"),
        (pr.Box((2.0, 2.0, 20.0), (1, 1, 9), (-1.0, 1.0, -10.0)), "it overlaps body 'b', by"),  # no corner of either in the other
        (small(0.0, 4.0, 0.0), r"it lies on body 'b' at \(1, 4, 1\)"),
        (small(4.0, 4.0, 4.0), ""),
        (small(0.0, 4.3, 0.0), ""),
        (pr.Cylinder(radius=9.0, height=4.0, n=(2, 1, 24), bore=7.0), ""),  # all of the box within its bounding box
        (pr.Cylinder(radius=9.0, height=4.0, n=(2, 1, 24), bore=5.0), "it overlaps body 'b', by"),
    ],
    ids=str,
)  # fmt: skip
def test_bodies_in_space_that_overlap_or_lie_on_each_other_are_reported(mesh, words):
    """With the depth and the place in space; those that meet at an edge, lie beside or around each other are not."""
    found = [f.message for f in overlapping_bodies(pr.discretise(beside(mesh)))]
    assert len(found) == bool(words) and re.search(words, "".join(found)), found


@pytest.mark.parametrize("gap", [0.03, -0.02, 0.0])
def test_gaps_of_ties_in_space_are_reported_with_size_and_place(gap):
    """A tie takes them away without stress; of a ring on a cylinder, meshed otherwise, only what chords do not miss."""
    flat = beside(small(0.0, 4.0 + gap, 0.0), pr.Tie("c.bottom", "b.top"))
    inner = pr.Cylinder(radius=4.0, height=4.0, n=(2, 2, 32))
    outer = pr.Cylinder(radius=6.0, height=4.0, n=(1, 1, 40), bore=4.0 + gap)
    round_ = beside(outer, pr.Tie("c.inner", "b.outer"), first=inner)
    for p, least in ((flat, 0.0), (round_, 0.01)):
        found = [str(f) for f in tied_gaps(pr.discretise(p))]
        assert len(found) == (abs(gap) > least), found
        if found:
            kind, size = re.search(r"sides (overlap|lie apart) by (\S+) mm, most at \(\S+, \S+, \S+\): ", found[0]).groups()
            assert kind == ("overlap" if gap < 0 else "lie apart")
            assert float(size) == pytest.approx(abs(gap), rel=1e-3 if p is flat else 0.8)


PRESSED = pr.Motion(y=-0.5)
LEDGE = r"node \d+ of 'b' at \(-4, 4, .*\) is held along the normal of tool 't', which presses it in by 0.5 until time 1"


@pytest.mark.parametrize(
    ("held", "words"),
    [
        ({"b.left": "xyz"}, LEDGE + r".*support 'b.left', which meets the contact surface there, only along that surface"),
        ({"b.left": "y"}, LEDGE + r".*remove the support 'b.left'"),
        ({"b.left": "xz"}, ""),
        ({"b.left": "x", "b.back": "z"}, ""),
        ({"b.top": "y"}, "take the support off the contact surface"),
    ],
    ids=str,
)
@pytest.mark.parametrize("tetrahedra", [False, True])
def test_what_a_support_holds_against_a_tool_in_space_is_refused(held, words, tetrahedra):
    """Nodes of bricks, and of tetrahedra with their corners; what is held along the surface alone is right."""
    p = block(pr.Plane(normal=(0.0, -1.0, 0.0), at=(0.0, 4.0, 0.0)), PRESSED, fixed={"b.bottom": "xyz"} | held, n=(2, 1, 2))
    if tetrahedra:
        p = replace(p, bodies={"b": pr.Body(split(p.bodies["b"].mesh), STEEL)})
    found = [str(f) for f in preflight(pr.discretise(p)) if "held along the normal" in f.message]
    assert bool(found) == bool(words) and re.search(words, "".join(found)), found


def moved(until: float | None = None, **motion: object) -> pr.Step:
    """A step of the tool ``t``, ended by its travel along z."""
    ends = None if until is None else pr.Until(travel={"t": ToolTravel(z=until)})
    return pr.Step("s", move={"t": pr.Motion(**motion)}, until=ends)


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ([moved(z=[[0, 0.5], [1, 1]])], r"move\.t\.z: tool 't' would jump: the table has 0\.5 at time 0"),
        ([moved(rx=[[0, 0.2], [1, 1]])], r"move\.t\.rx: tool 't' would jump: the table has 0\.2"),
        ([moved(z=0.5), moved(rz=[[1, 0], [2, 1]], z=0.5)], ""),
        ([moved(z=0.5), moved(z=0.5)], r"move\.t\.z: step 's2' moves nothing: tool 't' is at z = 0\.5 already"),
        ([moved(until=0.7, z=0.5)], "never reaches z = 0.7"),
        ([moved(until=0.4, z=0.5)], ""),
    ],
)  # fmt: skip
def test_motions_along_z_and_turns_are_looked_at_as_those_of_the_plane(steps, words):
    """Tables that begin elsewhere, totals written twice, travels that are never reached."""
    named = tuple(replace(s, name=f"s{k + 1}") for k, s in enumerate(steps))
    system = pr.discretise(replace(block(ball(0.0, 6.0, 0.0), pr.Motion()), steps=named))
    found = [str(f) for check in (table_starts, standstills, travels) for f in check(system)]
    assert bool(found) == bool(words) and re.search(words, "".join(found)), found


def test_distances_from_faces_of_tetrahedra_are_found_at_their_corners_too():
    """From the corner that stands for two, from a side, from beyond; against the box that they are the outside of."""
    made = mesh_of(split(pr.Box((2.0, 2.0, 2.0), (1, 1, 1))))
    x = np.array([(3.0, 3.0, 3.0), (-1.0, -1.0, -1.0), (3.0, -2.0, 1.0), (1.0, 1.5, 1.0), (0.0, 3.0, 3.0)])
    expected = [np.sqrt(3.0), np.sqrt(3.0), np.sqrt(5.0), 0.5, np.sqrt(2.0)]
    assert nearest_on_faces(x, made.points, made.boundary) == pytest.approx(expected, rel=1e-9)


def test_a_body_in_space_that_passes_through_itself_is_reported():
    """The ends of a slit ring that is bent on: once when they meet, not while a gap is left; where, and for each body once."""
    ring = pr.Cylinder(radius=6.0, height=3.0, n=(2, 2, 24), bore=4.0, angle=6.0)
    slit = pr.Problem(
        "slit", space="solid", bodies={"c": pr.Body(ring, STEEL)},
        fixed={"c.base": "xyz"}, steps=(pr.Step("s"),),
    )  # fmt: skip
    system = pr.discretise(slit)
    looks, X = SelfIntersection(system), system.X
    angle = np.arctan2(X[:, 2], X[:, 0]) % (2.0 * np.pi)
    for closes, reported in ((0.0, False), (0.04, False), (0.1, True), (0.1, False)):
        r, now = np.hypot(X[:, 0], X[:, 2]), angle * (1.0 + closes)
        u = np.zeros(system.ndof)
        system.displacement(u)[:] = np.stack([r * np.cos(now), X[:, 1], r * np.sin(now)], axis=1) - X
        found = [str(f) for f in looks._in_space(u)]
        assert len(found) == reported
        assert not found or "body 'c' passes through itself near (" in found[0]


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_bodies_in_space_lie_in_themselves_once(tetrahedra):
    """Boxes, wedges at an axis, tubes: places behind nodes belong to them once, those before them not at all."""
    for mesh in (pr.Box((2.0, 2.0, 2.0), (3, 2, 2)), pr.Cylinder(radius=4.0, height=5.0, n=(2, 3, 4), angle=1.0, core="wedges"),
                 pr.Cylinder(radius=4.0, height=5.0, n=(2, 3, 16), bore=3.0)):  # fmt: skip
        made = mesh_of(split(mesh) if tetrahedra else mesh)
        own = solid("b", made.points, made.cells, made.boundary)
        assert not len(twice_inside(own))
        assert (windings(made.points[made.cells].mean(axis=1), own) == 1).all()
        for aside in ((0.0, 5.5, 0.0), (0.0, -5.5, 0.0), (9.0, 0.0, 0.0)):
            assert not windings(made.points + aside, own).any()
