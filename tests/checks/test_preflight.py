"""Reports before anything is solved, and good cases beside them that are left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.checks.during.self_intersection import least_on_sides
from prensa.errors import CaseError, PreflightError, SolveError
from prensa.model.schema import warnings_of
from prensa.model.unsaid import space_left_out
from prensa.system.failure import MetalInside
from problems import pressed_block, single_block, stroke

METAL = pr.J2(E=70e3, nu=0.3, flow=pr.Voce(s0=60, Q=120, b=8))
SOFT = pr.Elastic(E=1000.0, nu=0.3)


def block(material=SOFT, tools=None, *, steps=None, **more):
    """A block under a plane, with more tools."""
    tools = {"die": pr.Plane(touching="b.top")} | (tools or {})
    steps = steps or (stroke(-0.1, increments=2, tool="die"),)
    return single_block(
        *steps, tools=tools, material=material, **{"size": (8.0, 4.0), "n": (4, 2), "fixed": {"b.bottom": "xy"}} | more
    )


def reported(problem: pr.Problem) -> list[str]:
    return [str(n) for n in preflight(pr.discretise(problem))]


@pytest.mark.parametrize(("element", "space"), [("q8", "axisymmetric"), ("t3", "plane stress")])
def test_a_narrow_tool_does_not_slip_in_between_two_nodes(element, space):
    """A pin that goes into a side without contact ends the run, though no node of that side is inside it."""
    pin = pr.Polygon(points=((0, -0.3), (2, -0.3), (2, 0.3), (0, 0.3)), at=(8.2, 3.1), fillet=0.05)
    move = {"die": pr.Motion(y=-0.1)}
    if space == "axisymmetric":  # tools move along the axis alone: the side goes into the pin
        pin = pr.Polygon(points=((0, -0.15), (2, -0.15), (2, 0.15), (0, 0.15)), at=(8.05, 2.45), fillet=0.05)
        move = {"die": pr.Motion(y=-1.0)}
    else:
        move |= {"pin": pr.Motion(x=-1.5)}
    p = block(
        tools={"pin": pin}, contacts=(pr.Contact("b.top", "die"),), space=space, element=element,
        steps=(pr.Step("press", move=move, increments=8),), n=(3, 1) if element == "q8" else (4, 2),
    )  # fmt: skip
    with pytest.raises(SolveError, match="the edge between nodes") as caught:
        list(pr.solve(p))
    assert isinstance(caught.value.reason, MetalInside)
    assert "surface: b.right, against: pin" in str(caught.value)


def test_a_tool_that_lies_within_a_body_is_refused():
    """Of any shape and in any space; one that is meant to pass, or that lies in a hole of the body, is left alone."""
    for tool in (pr.Ellipse(semi=(0.7, 0.4), at=(2, 1)), pr.Polygon(points=((0, 0), (1, 0), (1, 1), (0, 1)), at=(4.6, 2.6))):
        p = block(tools={"pin": tool}, contacts=(pr.Contact("b.top", "die"),))
        assert any("it lies inside body 'b'" in words for words in reported(p))
        with pytest.raises(PreflightError, match="lies inside body"):
            next(iter(pr.solve(p)))
        meant = block(tools={"pin": tool}, contacts=(pr.Contact("b.top", "die"),), no_contact=(pr.NoContact("b", "pin"),))
        assert reported(meant) == []
    ring = pr.Body(pr.Annulus(2, 4, (24, 3)), SOFT)
    mandrel = pr.Circle(radius=1.9, at=(0, 0))
    p = pr.Problem("ring", {"b": ring}, [pr.Step("s", move={"m": {"x": 0.2}})], {"m": mandrel}, fixed={"b.outer": "xy"})
    assert not any("lies inside" in words for words in reported(p))


def test_a_container_is_no_sharp_end():
    """A body on the floor of an open container, whose walls end in a rim, hears nothing of the rim's width."""
    can = pr.Profile(points=((30, 30), (8.2, 12), (8.2, 0), (-1, 0)), at=(0, 0))
    for axis in ("axisymmetric", "plane strain"):
        fixed = {} if axis == "axisymmetric" else {"b.left": "x"}
        p = block(METAL, {"can": can}, n=(16, 8), space=axis, fixed=fixed, friction=pr.Coulomb(0.1))
        assert reported(p) == []


def test_sides_that_meet_at_a_corner_have_no_gap_before_they_deform():
    """The mean normal of a corner made a smooth plane push sideways; sides with contacts of their own are right."""
    linear = {"kinematics": "small", "contact_geometry": "reference", "fixed": {"b.bottom": "y", "b.left": "x"}}
    with pytest.raises(PreflightError, match="does not have at its corner at \\(8, 4\\)"):
        next(iter(pr.solve(block(contacts=(pr.Contact(("b.top", "b.right"), "die"),), **linear))))
    one = [pr.Contact("b.top", "die")]
    forces = [list(pr.solve(block(contacts=c, **linear)))[-1].force("die") for c in (one, [*one, pr.Contact("b.right", "die")])]
    # uniform compression under a smooth plane: E / (1 - nu²) × strain × width, but for the penalty
    assert forces[0].y == pytest.approx(1000 / (1 - 0.09) * 0.1 / 4 * 8, rel=0.01)
    assert forces[1].y == pytest.approx(forces[0].y, rel=1e-9)
    assert abs(forces[1].x) < 1e-9
    round_ = pr.Body(pr.Disc(radius=3, n=(8, 2), part="top"), SOFT)  # 11° from edge to edge
    p = pr.Problem(
        "disc", {"b": round_}, [pr.Step("s", move={"die": {"y": -0.05}})], {"die": pr.Plane(normal=(0, -1), at=(0, 3))},
        [pr.Contact("b.rim", "die")], fixed={"b.bottom": "xy"}, kinematics="small", contact_geometry="reference",
    )  # fmt: skip
    assert reported(p) == []


@pytest.mark.parametrize(
    ("size", "key"),
    [
        ({"far": 1e-300}, "far"),
        ({"far": 1e-6}, "far"),
        ({"near_tools": 1e-250}, "near_tools"),
        ({"far": 1, "near_tools": 1e-7}, "near_tools"),
    ],
)
def test_sizes_of_more_elements_than_there_can_be_are_refused(size, key):
    """With the number of elements that they ask for and a size that is none too small."""
    p = block(METAL, element="t6", remesh=pr.Remesh(size=pr.Sizes(**size)), contacts=(pr.Contact("b.top", "die"),))
    with pytest.raises(PreflightError, match=rf"remesh\.size\.{key}: it asks for \S+e\+\d+ elements of body 'b'.*write 0\.11"):
        next(iter(pr.solve(p)))
    allowed = block(METAL, element="t6", remesh=pr.Remesh(size=pr.Sizes(far=0.11, near_tools=0.05, least=1e-300)))
    assert reported(allowed) == []


def test_a_step_in_which_time_passes_may_repeat_what_is_there():
    """A push that is written again is reported to change nothing, unless the step has a duration."""
    for duration, count in ((None, 1), (2.0, 0)):
        steps = [pr.Step("a", push={"die": {"y": -300}}), pr.Step("b", push={"die": {"y": -300}}, duration=duration)]
        assert len([w for w in reported(block(METAL, steps=steps)) if "changes nothing" in w]) == count


def test_a_sensitivity_to_the_rate_in_per_cent_is_reported():
    """As an exponent is; usual ones are not."""
    press = (pr.Step("press", move={"die": pr.Motion(y=-0.1)}, duration=1.0),)
    for C, n, heard in ((2.0, 0.4, "material.flow.C"), (0.02, 40.0, "material.flow.n"), (0.02, 0.4, "")):
        said = warnings_of(block(pr.J2(E=70e3, nu=0.3, flow=pr.JohnsonCook(A=60, B=100, n=n, C=C)), steps=press))
        assert len(said) == bool(heard)
        assert all(heard in words and "did you mean" in words for words in said)


@pytest.mark.parametrize(
    ("material", "case", "again"),
    [
        (pr.NeoHooke(E=10, nu=0.45), {"n": (4, 6), "radius": 1.5, "space": "axisymmetric"}, False),
        (METAL, {"n": (6, 12), "radius": 2, "fixed": {"b.bottom": "xy", "b.left": "x"}}, True),
    ],
)
def test_a_tool_that_comes_through_the_surface_beside_a_line_of_symmetry_is_reported_as_that(material, case, again):
    """No contact of that line, or of the axis, is asked for: the elements beside it are too coarse for the tool."""
    case = dict(case)
    tools = {"die": pr.Circle(radius=case.pop("radius"), touching="b.top")}
    p = block(material, tools, size=(4, 8), steps=(pr.Step("press", move={"die": pr.Motion(y=-5)}),), **case)
    with pytest.raises(SolveError, match="has penetrated the adjacent surface") as caught:
        list(pr.solve(p))
    assert isinstance(caught.value.reason, MetalInside)
    assert "against: die" not in str(caught.value)
    assert ("'remesh: auto'" in str(caught.value)) == again


def test_a_velocity_of_rotation_is_answered_with_one():
    """An angle that is not per second is shown an angle that is; a length, a length."""
    for axis, wrong, like in (("rz", "720 deg", "'90 deg/s'"), ("y", "3 mm", "'100 mm/s'")):
        with pytest.raises(pr.CaseError, match=f"is not a velocity.*{like}"):
            pr.Step("s", velocity={"die": {axis: wrong}})


def test_small_strain_of_a_beam_that_is_bent_far_is_reported():
    """A tool that would be on the far side of a thin body at the end of its way bends it: reported by the way, over length."""
    body = {"b": pr.Body(pr.Rectangle(size=(20, 1), n=(20, 2)), SOFT)}

    def bent(way: float, **more: object) -> list[str]:
        steps = (pr.Step("s", move={"p": pr.Motion(y=-way)}),)
        tools = {"p": pr.Circle(radius=2, at=(19, 0), above="b.top")}
        return reported(pr.Problem("beam", body, steps, tools, fixed={"b.left": "xy"}, kinematics="small", **more))

    assert any("press 'b' in by 6 at 19" in words and "use 'finite'" in words for words in bent(6.0))
    assert bent(1.0) == []
    assert bent(6.0, allow_large_strain=True) == []


def test_what_reads_like_half_a_round_body_is_reported_and_others_are_not():
    """By the name of the part, a section that begins at the axis or beside it, and how it is held."""
    rectangle, held = pr.Rectangle(size=(8.0, 4.0), n=(4, 2)), {"NAME.left": "x", "NAME.bottom": "y"}
    beside = pr.Rectangle(size=(8.0, 4.0), n=(4, 2), origin=(5.0, 0.0))
    foot = {"NAME.bottom": "y"}

    def reads(name: str, mesh: object = rectangle, fixed: dict[str, str] = held, **more: object) -> bool:
        fixed = {k.replace("NAME", name): v for k, v in fixed.items()}
        p = pr.Problem(
            "p", {name: pr.Body(mesh, METAL)}, [pr.Step("s", move={"die": {"y": -0.1}})],
            {"die": pr.Plane(touching=f"{name}.top")}, fixed=fixed, **more,
        )  # fmt: skip
        return bool(space_left_out(p))

    assert all(reads(name) for name in ("billet", "Rod_2", "hot slug", "disc"))
    assert reads("ring", beside, foot)
    assert reads("tube", pr.Patch(((5, 0), (9, 0), (9, 4), (5, 4)), (4, 2)), foot)
    for name in ("sheet", "strip", "block", "ringer", "scanner"):
        assert not reads(name)
        assert not reads(name, beside, foot)
    assert not reads("billet", beside)  # a whole one, or one that begins anywhere
    assert not reads("billet", fixed=foot)  # x = 0 is no line of symmetry
    assert not reads("ring", pr.Rectangle((8.0, 4.0), (4, 2), (-4.0, 0.0)), foot)
    assert not reads("billet", space="axisymmetric", fixed=held)
    round_ = pr.Problem("p", {"rod": pr.Body(pr.Disc(3, (8, 2), part="right"), SOFT)}, [pr.Step("s")], fixed={"rod.left": "x"})
    assert space_left_out(round_) == []  # the section of a rod seen from its end


@pytest.mark.parametrize(("thickness", "length", "heard"), [
    (0.01, "mm", "is the unit right"), (1e-5, "m", "is the unit right"), (4.0, "mm", ""), (1.0, "mm", ""), (1e-3, "m", ""),
    (25.4, "mm", ""), (300.0, "mm", ""),
])  # fmt: skip
def test_a_thickness_that_no_long_body_has_is_reported(thickness, length, heard):
    """Slices of a millimetre or an inch, square bars and widths of sheets are left alone."""
    size = (8.0, 4.0) if length == "mm" else (0.08, 0.04)
    way = pr.Step("press", move={"die": pr.Motion(y=-0.01 * size[1])})
    said = reported(block(METAL, size=size, thickness=thickness, units=pr.Units(length, "N"), steps=(way,)))
    assert [heard in words for words in said] == ([True] if heard else [])


@pytest.mark.parametrize(("way", "heard"), [(0.2, False), (0.35, True)])
def test_an_element_that_folds_between_its_corners_is_reported(way, heard, caplog):
    """The middle of a side of an eight-node element moved along it: beyond a quarter the side turns back at its end.

    Its corners stay where they are and all four integration points have room: 0.5 - 0.91 way > 0.
    """
    points = ((0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5))
    mesh = pr.Points(points, ((0, 1, 2, 3, 4, 5, 6, 7),), {"low": (0, 4, 1), "top": (2, 6, 3), "a": (0,), "b": (1,), "m": (4,)})
    p = pr.Problem(
        "one", {"e": pr.Body(mesh, SOFT, "q8")}, [pr.Step("s", fixed={"e.m": pr.Fixed(x=way, y="held")}, increments=4)],
        fixed={"e.top": "xy", "e.a": "xy", "e.b": "xy"},
    )  # fmt: skip
    list(pr.solve(p))
    assert [m for m in caplog.messages if "folds over itself" in m] == caplog.messages
    assert len(caplog.messages) == heard


def test_the_least_jacobian_on_sides_is_that_of_the_mapping():
    """By differences of places that are written down here: sides as parabolas through three points, blended into the element."""
    rng = np.random.default_rng(3)
    x = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [0, -1], [1, 0], [0, 1], [-1, 0]], dtype=float)
    x += rng.uniform(-0.35, 0.35, x.shape)

    def place(s: float, t: float) -> np.ndarray:
        """Coons' patch of the four parabolas."""
        def side(a, m, b, r):
            return a * r * (r - 1) / 2 + m * (1 - r * r) + b * r * (r + 1) / 2

        low, high = side(x[0], x[4], x[1], s), side(x[3], x[6], x[2], s)
        left, right = side(x[0], x[7], x[3], t), side(x[1], x[5], x[2], t)
        corners = ((1 - s) * (1 - t) * x[0] + (1 + s) * (1 - t) * x[1] + (1 + s) * (1 + t) * x[2] + (1 - s) * (1 + t) * x[3]) / 4
        return ((1 - t) * low + (1 + t) * high + (1 - s) * left + (1 + s) * right) / 2 - corners

    h, r = 1e-5, (-1.0, -0.5, 0.0, 0.5)
    dets = []
    for s, t in [*((s, -1.0) for s in r), *((1.0, t) for t in r), *((-s, 1.0) for s in r), *((-1.0, -t) for t in r)]:
        a, b = (place(s + h, t) - place(s - h, t)) / (2 * h), (place(s, t + h) - place(s, t - h)) / (2 * h)
        dets.append(a[0] * b[1] - a[1] * b[0])
    assert least_on_sides(x[:, None])[0] == pytest.approx(min(dets) / np.mean(dets), rel=1e-6)


@pytest.mark.parametrize(("increments", "table", "half"), [
    (4, ((0.0, -0.1), (1.0, -0.3)), -0.2),  # as the table stands from the first increment on
    (None, ((0.0, -0.1), (1.0, -0.3)), -0.2),
    (4, ((0.0, 0.2), (1.0, -0.3)), -0.05),  # drawn away at first
])  # fmt: skip
def test_a_table_that_begins_elsewhere_is_reported_and_reached_over_the_first_increment(increments, table, half, caplog):
    """A jump is as long in any increment, however short, and was cut again and again; now each cut makes it shorter."""
    p = block(METAL, steps=(pr.Step("press", move={"die": pr.Motion(y=table)}, increments=increments),))
    warnings = [words for words in reported(p) if "would jump" in words]
    assert len(warnings) == 1 and "it is moved there over the first" in warnings[0]
    done = list(pr.solve(p))
    assert [words for words in caplog.messages if "begins" in words] == warnings
    places = {round(inc.time, 9): inc.tools["die"].place.y for inc in done}
    assert places[1.0] == pytest.approx(-0.3) and sum(inc.statistics.cutbacks for inc in done) <= 2
    at = np.array(sorted(places))
    assert np.interp(0.5, at, [places[t] for t in at]) == pytest.approx(half, abs=1e-9)


def test_a_table_that_begins_where_a_pushed_tool_is_not_is_reported_in_the_run(caplog):
    """Where a tool is that was pushed is not known before: reported once, when the step begins, with its place; `by` goes on."""
    steps = (pr.Step("push", push={"die": pr.Push(y=-800.0)}), pr.Step("back", move={"die": pr.Motion(y=((1, 0.0), (2, 0.2)))}))
    p = block(METAL, steps=steps)
    assert not any("would jump" in words for words in reported(p))
    *_, last = pr.solve(p)
    (said,) = [words for words in caplog.messages if "is moved there" in words]
    assert "step 'back', move.die.y: the table has 0 at time 1, where tool 'die' is at -0." in said and "'by'" in said
    assert last.force("die").y == 0.0 and last.tools["die"].place.y == pytest.approx(0.2)


def test_scripts_hear_of_what_a_case_file_is_reported(caplog):
    """What `prensa check` says of units, friction and a missing 'space' stands in the log of `prensa.solve` too, once each."""
    body = {"billet": pr.Body(pr.Rectangle(size=(4, 2), n=(4, 2)), pr.Elastic(E=210.0, nu=0.3))}
    tools, fixed = {"die": pr.Plane(touching="billet.top")}, {"billet.bottom": "y", "billet.left": "x"}
    steps = (pr.Step("press", move={"die": pr.Motion(y=-0.01)}, increments=1),)
    list(pr.solve(pr.Problem("p", body, steps, tools, fixed=fixed, friction=pr.Coulomb(mu=10.0))))
    for words in ("'210 GPa'", "did you mean 0.1?", "'space' is missing"):
        assert sum(words in m for m in caplog.messages) == 1
    caplog.clear()
    list(pr.solve(pr.Problem("p", body, steps, tools, fixed=fixed, space="plane strain")))
    assert not any("'space'" in m for m in caplog.messages)


def test_a_case_called_round_that_says_no_space_is_reported():
    """The name of the case counts with words that no plane one has; 'cylinder on a block' is plane."""
    body = {"b": pr.Body(pr.Rectangle(size=(4, 2), n=(4, 2)), METAL)}
    for name, heard in (("billet upsetting", 1), ("round_bar", 1), ("axisymmetric", 1), ("cylinder on a block", 0), ("ring", 0)):
        p = pr.Problem(name, body, (pr.Step("s"),), fixed={"b.bottom": "y", "b.left": "x"})
        assert len(space_left_out(p)) == heard


def test_a_node_on_a_bore_goes_down_with_a_fillet_that_comes_along_it():
    """Held across, free along: the fillet of a stamp takes it along, its normal mostly across where the body stood before.

    Refused before, though it runs; a node that is held both ways is refused still.
    """
    def pressed(fixed):
        return pressed_block(
            stroke(-0.3, increments=4), tools={"t": pr.Stamp(width=2.2, fillet=0.44, touching="b.top")},
            material=SOFT, size=(4.0, 4.0), n=(8, 8), origin=(1.0, 0.0), fixed={"b.bottom": "y", "b.left": fixed},
            space="axisymmetric",
        )  # fmt: skip

    assert not any("held along the normal" in words for words in reported(pressed(pr.Fixed(x=0.0))))
    *_, last = pr.solve(pressed(pr.Fixed(x=0.0)))
    assert last.time == 1.0 and last.force("t").y > 0
    assert any("held along the normal" in words for words in reported(pressed(pr.Fixed(x=0.0, y=0.0))))


def test_what_friction_alone_holds_is_reported():
    """A rod that touches the wall and the punch alone hangs on friction; one that rests on the edge of the die does not."""
    die = pr.Profile(points=((10, 40), (10, 0), (7, -3), (7, -30)), fillet=(0, 1.5, 1.5, 0), at=(0, -0.6213))

    def rod(at: float, **more):
        tools = {"punch": pr.Plane(normal=(0, -1), touching="b.top"), "die": replace(die, at=(0, at))}
        contacts = (pr.Contact("b.top", "punch"), pr.Contact("b.right", "die"), pr.Contact("b.bottom", "die"))
        return pr.Problem(
            "rod", {"b": pr.Body(pr.Rectangle(size=(10, 14), n=(7, 10)), METAL)}, (pr.Step("press", move={"punch": {"y": -1}}),),
            tools, contacts, friction=pr.Coulomb(0.05), fixed={"b.left": "x"}, space="axisymmetric", **more,
        )  # fmt: skip

    assert not any("only friction" in words for words in reported(rod(-0.6213)))
    (words,) = [words for words in reported(rod(-0.7)) if "only friction" in words]
    assert words.startswith("bodies.b: only friction holds it along y against the tools that press it")
    assert reported(block(fixed={"b.bottom": "y"}, friction=pr.Coulomb(0.1))) == []  # a whole billet between rough plates


def test_tools_off_the_line_that_they_cross_are_reported():
    """Those that slide along it, stand on one side, or whose line is said to be no symmetry are left alone."""
    line = {"b.bottom": "y", "b.left": "x"}

    def pressed(x: float, **more):
        disc = pr.Circle(radius=2, at=(x, 6), touching="b.top")
        move = {"die": pr.Motion(y=-0.1)} | more.pop("move", {})
        return block(
            tools={"die": disc}, fixed=line, contacts=(pr.Contact("b.top", "die"),), friction=pr.Coulomb(0.1),
            steps=(pr.Step("press", move=move),), **more,
        )  # fmt: skip

    def across(p: pr.Problem) -> bool:
        return any("reaches across" in words for words in reported(p))

    assert across(pressed(0.5)) and across(pressed(-1.0))
    assert not across(pressed(0.0)) and not across(pressed(2.0)) and not across(pressed(5.0))
    assert not across(pressed(0.5, move={"die": pr.Motion(x=1.0, y=-0.1)}))
    assert not across(pressed(0.5, no_contact=(pr.NoContact("b", "symmetry"),)))


def test_springs_are_asked_about_only_where_they_make_no_sense():
    """A machine's, a soft one that preloads beside what is moved, and one that gives way by half are left alone."""

    def sprung(stiffness: float, **more):
        return block(tools={"die": pr.Plane(touching="b.top", spring=pr.Springs(y=stiffness))}, **more)

    assert reported(sprung(1e6)) == []
    assert any("needs no spring" in words for words in reported(sprung(1e11)))
    with pytest.raises(PreflightError, match="needs no spring"):
        next(iter(pr.solve(sprung(1e13))))


def test_a_step_that_says_nothing_is_reported_but_not_where_time_passes():
    """What was moving stands still in it; one with a duration is a rest; a table ends where the next step leaves it out."""
    press = pr.Step("press", move={"die": pr.Motion(y=-0.1)})
    assert any("is empty, so nothing changes" in words for words in reported(block(steps=(press, pr.Step("more", increments=3)))))
    assert reported(block(steps=(press, pr.Step("rest", duration=2.0)))) == []
    table = pr.Step("press", move={"die": pr.Motion(y=((0, 0), (1, -0.1), (2, -0.2)))})
    assert any("needs the table too" in words for words in reported(block(steps=(table, pr.Step("more")))))
    assert reported(block(steps=(table, replace(table, name="more")))) == []


def test_turns_in_degrees_are_asked_about_where_they_carry_the_surface_past_the_body():
    """Half a turn of a roll in radians, and any turn that is no round number, are left alone."""

    def turned(rz: float, radius: float = 8.0):
        tools = {"die": pr.Circle(radius=radius, touching="b.top", at=(0, 9))}
        return reported(block(tools=tools, steps=(pr.Step("turn", move={"die": pr.Motion(y=-0.1, rz=rz)}),)))

    assert any("for degrees write '5 deg'" in words for words in turned(5.0))
    assert turned(np.pi) == turned(2.0, 4.0) == turned(6.28) == []


def test_tables_may_be_arrays():
    """Two columns, as a script has them."""
    table = np.array([[0.0, 0.0], [1.0, -0.1]])
    assert pr.Motion(y=table) == pr.Motion(y=((0.0, 0.0), (1.0, -0.1)))
    with pytest.raises(CaseError, match="array"):
        pr.Motion(y=np.zeros(3))


def test_a_thickness_of_one_is_a_force_per_thickness():
    """Also where the bodies are smaller than the unit of length; another one that none of them has is asked about."""
    sheet = block(size=(0.4, 0.2), space="plane stress", thickness=1.0)
    assert not any("thin sheets" in words for words in reported(sheet))
    assert any("thin sheets" in words for words in reported(replace(sheet, thickness=5.0)))


def test_small_bodies_of_a_case_in_micrometres_are_meant():
    """30 um in a case in um are no slip; 0.03 mm, and less than one of the small unit, are asked about in the case's unit."""
    for length, size, asked in (("um", 30.0, False), ("mm", 0.03, True), ("um", 0.3, True), ("m", 3e-5, True)):
        p = single_block(pr.Step("rest"), size=(size, size), n=(2, 2), units=pr.Units(length=length))
        found = [words for words in reported(p) if "is the unit right?" in words]
        assert bool(found) == asked, (length, size)
        assert all(f"measures {size:.4g} {length};" in words for words in found)


@pytest.mark.parametrize(
    ("fillet", "width", "asked"), [(0.01, 2.0, False), (0.001, 2.0, True), (0.002, 5.0, True), (0.005, 5.0, False)]
)
def test_fillets_are_in_another_unit_only_if_the_tool_could_have_those_of_that_unit(fillet, width, asked):
    """A punch that is sharp on purpose: of 0.01 in metres would be 10 mm, on a face of 2 mm."""
    w = 0.5 * width
    punches = (
        pr.Polygon(points=((-w, 0), (w, 0), (w, 9), (-w, 9)), fillet=fillet, at=(4, 4)),
        pr.Stamp(width=width, fillet=fillet, at=(4, 4), facing=(0, -1)),
    )
    for punch in punches:
        found = [words for words in reported(block(tools={"die": punch}, size=(8.0, 4.0))) if "in the same unit?" in words]
        assert found == [f"tools.die.fillet: {fillet} mm against bodies of 8 mm; are both in the same unit?"] * asked


@pytest.mark.parametrize(("E", "meant"), [(70.0, "70 GPa"), (210e3, "210000 MPa"), (70e9, "7e+10 Pa")])
def test_a_modulus_without_its_unit_in_a_case_in_micrometres(E, meant):
    """The unit that is proposed makes it that of a metal."""
    p = single_block(pr.Step("rest"), material=pr.Elastic(E, 0.3), units=pr.Units(length="um"))
    assert any(f"did you mean '{meant}'?" in words for words in warnings_of(p))


@pytest.mark.parametrize(
    ("x", "depth", "said"), [(6.0, 0.02, "presses on one node at most"), (6.0, 0.3, "on 3 nodes at most"), (6.15, 0.5, "")]
)
def test_a_fine_tip_is_warned_of_by_the_nodes_that_it_finds(x, depth, said):
    """A cylinder of 1.97 elements: one node where it hardly goes in; four where it goes in by its radius, which is no warning."""
    p = single_block(
        stroke(-depth, tool="tip"), size=(12.0, 4.0), n=(40, 8), fixed={"b.bottom": "xy"}, contacts=[pr.Contact("b.top", "tip")],
        tools={"tip": pr.Circle(radius=0.59, at=(x, 4.59))},
    )  # fmt: skip
    found = [words for words in reported(p) if "less than two elements" in words]
    assert bool(found) == bool(said) and all(said in words for words in found)
    pushed = replace(p, steps=[pr.Step("press", push={"tip": pr.Push(y=-1.0)})])
    assert any("begins on one node;" in words for words in reported(pushed))


@pytest.mark.parametrize(("walked", "above", "wrong"), [(1, 0.05, True), (-1, 0.05, False), (-1, -0.3, False)])
def test_a_container_drawn_the_wrong_way_round_is_named_as_that(walked, above, wrong):
    """All of the body is inside its tool then; one that starts too deep has nodes outside."""
    chain = ((-5.0, 9.0), (-5.0, 0.0), (5.0, 0.0), (5.0, 9.0))[::walked]
    p = single_block(
        pr.Step("rest"), size=(4.0, 3.0), n=(4, 3), fixed={"b.left": "x"},
        tools={"die": pr.Profile(points=chain, fillet=0.5, at=(0.0, -above))},
    )  # fmt: skip
    turned = [words for words in reported(p) if "all of 'b' lies inside it: its points are in the wrong order" in words]
    assert bool(turned) == wrong and all("reverse: true" in words for words in turned)
    assert any("starts 0.3 inside" in words for words in reported(p)) == (above < 0.0)
