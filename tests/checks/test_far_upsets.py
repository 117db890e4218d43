"""Bodies that tools press together far: said before a run in space, whose elements wear out there; elastic metals too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import tetrahedra
from prensa.checks.before.extrusions import Opening, corner_angle, mouth
from prensa.checks.before.far_upsets import far_upsets
from prensa.checks.during.acceptance import least_corner
from prensa.errors import SolveError
from prensa.mesh.mesh import displaced
from prensa.mesh.quality import POOR, quality

STEEL = pr.J2(210e3, 0.3, pr.Swift(800.0, 0.005, 0.18))
BOX = pr.Box((5.0, 2.5, 5.0), (4, 3, 4))
ROUND = pr.Cylinder(radius=5.0, height=5.0, n=(4, 5, 4), angle=np.pi / 2)
RING = pr.Cylinder(radius=5.0, height=5.0, bore=2.5, n=(3, 5, 4), angle=np.pi / 2)
DOWN = pr.Plane(touching="b.top")


def upset(mesh: object, travel: float, mu: float = 0.3, material: object = STEEL, **given: object) -> pr.Problem:
    """An eighth of a billet under a plane that comes down by a share of its height."""
    round_ = isinstance(mesh, pr.Cylinder)
    height = mesh.height if round_ else mesh.size[1]
    sides = {"b.base": "z", "b.cap": "x"} if round_ else {"b.left": "x", "b.back": "z"}
    free = ("b.outer",) if round_ else ("b.right", "b.front")
    settings: dict[str, object] = {
        "bodies": {"b": pr.Body(mesh, material)}, "tools": {"t": DOWN}, "fixed": {"b.bottom": "y", **sides},
        "contacts": (pr.Contact(("b.top", *free), "t", pr.Coulomb(mu) if mu else None),),
        "steps": (pr.Step("press", move={"t": pr.Motion(y=-travel * height)}, increments=30),), **given,
    }  # fmt: skip
    return pr.Problem("upset", space="solid", **settings)


def said(p: pr.Problem) -> str:
    """What the check says."""
    return " ".join(map(str, far_upsets(pr.discretise(p))))


@pytest.mark.parametrize("mesh", [BOX, ROUND, RING], ids=lambda m: type(m).__name__)
@pytest.mark.parametrize(("travel", "mu", "reported"), [(0.85, 0.3, True), (0.3, 0.3, False), (0.85, 0.0, False)])
def test_upsets_by_most_of_the_height_are_reported(mesh, travel, mu, reported):
    """With what is pressed together; not those by a third, nor where nothing holds the metal at the tools."""
    words = said(upset(mesh, travel, mu))
    assert bool(words) == reported, words
    if reported:
        height = 2.5 if mesh is BOX else 5
        assert f"press 'b' together by {travel * height:.4g} of {height:g}" in words and "'remesh: auto'" in words


@pytest.mark.slow
@pytest.mark.parametrize(("travel", "worn"), [(0.6, True), (0.3, False)])
def test_elements_wear_out_where_it_is_reported(travel, worn):
    """A tenth of the elements of a flat box that sticks is out of shape by then, or the run has ended on one of them."""
    p = upset(BOX, travel)
    increments, ended = [], False
    try:
        increments += pr.solve(p)
    except SolveError as error:
        ended, last = True, error.last
    last = increments[-1] if increments else last
    shape = quality(displaced(pr.discretise(p).meshes["b"], last.bodies["b"].x)).jacobian
    assert bool(said(p)) == (ended or np.quantile(shape, 0.1) < POOR) == worn


def shear_said(words: str) -> float:
    """The shear that is reported, 0 where nothing is."""
    return float(words.split("by up to ")[-1].split(",")[0].split(" ")[0]) if words else 0.0


def test_friction_that_slips_shears_as_the_flow_rule_says():
    """√3 m/√(1 − m²) ln(1/λ) of a shear factor m: where metal that sticks would be sheared more all the way."""
    m, travel = 0.97, 0.85
    rate = np.sqrt(3.0) * m / np.sqrt(1.0 - m**2)
    expected = rate * np.log(1.0 / (1.0 - travel))
    flat = pr.Box((5.0, 0.5, 5.0), (4, 3, 4))
    sides = (pr.Contact(("b.top", "b.right", "b.front"), "t", pr.Shear(m=m)),)
    assert shear_said(said(upset(flat, travel, contacts=sides))) == pytest.approx(expected, rel=0.01)
    assert shear_said(said(upset(flat, travel, contacts=(replace(sides[0], friction=pr.Shear(m=1.0)),)))) > 10.0 * expected


def warned_from(mesh: object, mu: float) -> float:
    """Share of the height from which an upset is reported, 1 if it is not."""
    low, high = 0.0, 0.98
    for _ in range(7):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if said(upset(mesh, middle, mu)) else (middle, high)
    return high


@pytest.mark.parametrize("mesh", [BOX, ROUND], ids=["box", "round"])
def test_little_friction_bears_more(mesh):
    """Its pressure grows towards the middle, so that much friction sticks everywhere; of a ring it is taken to."""
    found = [warned_from(mesh, mu) for mu in (0.05, 0.1, 0.3, 0.57)]
    assert found[0] > found[1] + 0.03 > found[2] + 0.06 and found[2] == pytest.approx(found[3], abs=0.01)
    assert warned_from(RING, 0.05) == pytest.approx(warned_from(RING, 0.57), abs=0.01)


def head(travel: float) -> pr.Problem:
    """The end of a bolt that is pressed without friction against the face of the die that holds the rest."""
    section = pr.Profile(points=((25.0, 5.0), (5.0, 5.0), (5.0, -2.0)), fillet=(0.0, 1.1, 0.0))
    die = pr.Revolved(section=section, at=(0.0, 0.0, 0.0))
    tools = {"t": DOWN, "die": die, "e": pr.Plane(touching="b.bottom")}
    contacts = (pr.Contact(("b.top", "b.outer"), "t"), pr.Contact(("b.outer",), "die"), pr.Contact("b.bottom", "e"))
    bolt = pr.Cylinder(radius=5.0, height=11.8, n=(3, 9, 3), angle=np.pi / 2)
    fixed = {"b.base": "z", "b.cap": "x"}
    return upset(bolt, travel / 11.8, tools=tools, contacts=contacts, fixed=fixed)


def test_heads_fold_at_the_mouth_about_where_it_is_reported():
    """Without friction too: the head spreads, the shank does not; within a tenth of the travel."""
    p, folded = head(5.5), 5.5
    block = pr.discretise(p).blocks[0]
    try:
        for increment in pr.solve(p):
            if least_corner(increment.bodies["b"].x[block.corners].transpose(1, 0, 2)).min() < -0.1:
                folded = -increment.tools["t"].place.y
                break
    except SolveError as error:
        folded = -error.last.tools["t"].place.y
    assert "before the mouth of the die" in said(head(1.1 * folded)) and said(head(0.9 * folded)) == ""


def test_a_mouth_is_as_round_as_its_fillet():
    """Of a die that begins to open where the last node is that it holds."""
    rounded, element = mouth(pr.discretise(head(1.0)), "b", np.array([0.0, 1.0, 0.0]))
    assert rounded == pytest.approx(1.1, rel=0.05) and element == pytest.approx(11.8 / 9, rel=1e-6)


def test_tetrahedra_are_worn_by_flattening_alone():
    """Without friction, where bricks stay boxes: as the scaled Jacobian of the flattened mesh falls to a fifth."""
    p = upset(BOX, 0.9, 0.0)
    split = replace(p, bodies={"b": pr.Body(of_tetrahedra(BOX.n, BOX.size), STEEL)})
    assert said(p) == "" and "all of them flattened" in said(split)
    mild = upset(BOX, 0.5, 0.0)
    assert said(replace(mild, bodies=split.bodies)) == ""


def test_the_length_in_a_container_is_not_shortened():
    """Half of a bolt is in its die: 4 of 10 are 4 of the free 5, and the rest stays."""
    section = pr.Profile(points=((20.0, 5.0), (5.0, 5.0), (5.0, -9.0)), fillet=(0.0, 1.0, 0.0))
    die = pr.Revolved(section=section, at=(0.0, 0.0, 0.0))
    bolt = pr.Cylinder(radius=5.0, height=10.0, n=(4, 20, 4), angle=np.pi / 2)
    contacts = (pr.Contact(("b.top", "b.outer"), "t", pr.Coulomb(0.1)), pr.Contact(("b.outer",), "die"))
    words = said(upset(bolt, 0.45, tools={"t": DOWN, "die": die}, contacts=contacts))
    free = float(words.split("together by 4.5 of ")[1].split(":")[0])
    assert free == pytest.approx(6.0, abs=0.5)  # the fillet of 1 leaves a little more free


@pytest.mark.parametrize(("slope", "reported"), [(0.3, True), (2.5, False)])
def test_extrusions_past_steep_faces_are_reported(slope, reported):
    """Through an opening of 4 of 5: a shoulder of 73° and one of 22°, which the elements pass without harm."""
    points = ((5.0, 20.0), (5.0, 0.0), (4.0, -slope), (4.0, -20.0))
    die = pr.Revolved(section=pr.Profile(points=points, fillet=(0.0, 0.1, 0.1, 0.0)), at=(0.0, 0.0, 0.0))
    billet = pr.Cylinder(radius=5.0, height=10.0, n=(4, 10, 4), angle=np.pi / 2)
    contacts = (pr.Contact(("b.top",), "t"), pr.Contact(("b.outer", "b.bottom"), "die", pr.Coulomb(0.05)))
    fixed = {"b.base": "z", "b.cap": "x"}
    words = said(upset(billet, 0.8, tools={"t": DOWN, "die": die}, contacts=contacts, fixed=fixed))
    assert ("give the die a slope below 45°" in words) == bool(words) == reported, words


def extrusion(angle: float, reduction: float, travel: float = 5.0, n: tuple[int, int, int] = (4, 8, 4)) -> pr.Problem:
    """A quarter of a billet in a container, pushed through a die of an angle (degrees) to a smaller section."""
    opening = 5.0 * np.sqrt(1.0 - reduction)
    points = ((5.0, 20.0), (5.0, 0.0), (opening, (opening - 5.0) / np.tan(np.radians(angle))), (opening, -20.0))
    die = pr.Revolved(section=pr.Profile(points=points, fillet=(0.0, 0.3, 0.3, 0.0)), at=(0.0, -0.3, 0.0))
    billet = pr.Cylinder(radius=5.0, height=8.0, n=n, angle=np.pi / 2)
    contacts = (pr.Contact(("b.top",), "t"), pr.Contact(("b.outer", "b.bottom"), "die", pr.Coulomb(0.05)))
    fixed = {"b.base": "z", "b.cap": "x"}
    return upset(billet, travel / 8.0, tools={"t": DOWN, "die": die}, contacts=contacts, fixed=fixed)


@pytest.mark.parametrize(
    ("angle", "reduction", "reported"),
    [(40, 0.5, True), (40, 0.65, True), (50, 0.35, True), (40, 0.35, False), (30, 0.5, False), (20, 0.65, False)],
)
def test_extrusions_that_open_corners_beyond_180_degrees_are_reported(angle, reduction, reported):
    """Those whose elements fold at the edge of the opening; not what has not come there yet."""
    words = said(extrusion(angle, reduction))
    assert ("corners of elements that pass its edge" in words) == bool(words) == reported, words
    if reported:
        assert f"at up to {angle}°" in words
        assert said(extrusion(angle, reduction, travel=1.0)) == ""


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "folds"), [(45, True), (25, False)])
def test_corners_fold_where_it_is_reported(angle, folds):
    """Of an extrusion by 35 %, past a steep and a flat die."""
    p = extrusion(angle, 0.35, travel=4.0)
    try:
        *_, last = pr.solve(p)
    except SolveError as error:
        last = error.last
    shape = quality(displaced(pr.discretise(p).meshes["b"], last.bodies["b"].x)).jacobian
    assert bool(said(p)) == bool(shape.min() < 0.0) == folds


def test_the_flow_through_an_opening_lags_as_times_of_flight_do():
    """The slope s of what was straight across, by the times that metal takes along radii at its outside and beside it."""
    angle, c = np.radians(35.0), 0.7
    enters, leaves = 1.0 / np.sin(angle), c / np.sin(angle)  # radii of the spheres, for a billet of radius and speed 1

    def front(theta: float) -> tuple[float, float]:
        into = -enters * np.cos(theta)
        through = (enters**3 - leaves**3) / (3.0 * enters**2 * np.cos(theta))
        return leaves * np.sin(theta), -leaves * np.cos(theta) - (into + through) / c**2

    (r0, z0), (r1, z1) = front(angle), front(angle - 1e-6)
    o = Opening(c, np.tan(angle), 100.0, 1.0, 1e-3)
    assert np.tan(corner_angle(o, 2) - angle - np.pi / 2) == pytest.approx((z1 - z0) / (r0 - r1), rel=1e-4)


def of_tetrahedra(n: tuple[int, int, int], size: tuple[float, float, float]) -> pr.Tetrahedra:
    """A box of them, with the names of its sides."""
    points, cells, _ = tetrahedra(n, size)
    sides = {
        name: np.flatnonzero(np.abs(points[:, axis] - at) < 1e-9).tolist()
        for axis, names in enumerate((("left", "right"), ("bottom", "top"), ("back", "front")))
        for name, at in zip(names, (0.0, size[axis]))
    }
    return pr.Tetrahedra(points=points.tolist(), cells=cells.tolist(), boundaries=sides)


@pytest.mark.parametrize("travel", [0.3, 0.55, 0.85])
def test_tetrahedra_are_reported_as_bricks_are(travel):
    """In the same words, of the same box."""
    p = upset(BOX, travel)
    split = replace(p, bodies={"b": pr.Body(of_tetrahedra(BOX.n, BOX.size), STEEL)})
    assert said(split) == said(p) and bool(said(p)) == (travel > 0.5)


@pytest.mark.parametrize(("strain", "reported"), [(0.9, True), (0.5, False)])
@pytest.mark.parametrize("until", [True, False])
def test_forces_that_press_far_are_reported_by_what_metal_carries(strain, reported, until):
    """F = σ A (1 + μ r/(2 h)), r the mean distance in the square, pushed or moved until then; a shorter way is all."""
    share = 0.3 * 0.7652 * 5.0 * np.exp(1.5 * strain) / (2.0 * 2.5)
    force = 800.0 * (0.005 + strain) ** 0.18 * 25.0 * np.exp(strain) * (1.0 + share)
    push = pr.Step("press", push={"t": pr.Push(y=-force)}, increments=30)
    wait = pr.Step("press", move={"t": pr.Motion(y=-2.4)}, until=pr.Until(force={"t": pr.ToolForce(y=force)}), increments=30)
    words = said(upset(BOX, 0.0, steps=(wait if until else push,)))
    assert bool(words) == reported
    if reported:
        pressed = float(words.split("by up to ")[1].split(" of 2.5")[0])
        assert pressed == pytest.approx(2.5 * (1.0 - np.exp(-strain)), rel=0.02) and "as far as it yields to their force" in words
        short = replace(wait, move={"t": pr.Motion(y=-0.5)})
        assert said(upset(BOX, 0.0, steps=(short,))) == ""


LIGHT = pr.Until(force={"t": pr.ToolForce(y=2500.0)})  # 100 MPa: elastic
MET = pr.Step("meet", by={"t": pr.Motion(y=-0.5)}, until=LIGHT, increments=3)


def in_steps(*steps: pr.Step) -> str:
    """What is said of the flat box of a height of 2.5, pressed in these steps."""
    return said(upset(BOX, 0.0, steps=steps))


@pytest.mark.parametrize(
    ("then", "by"),
    [
        (pr.Step("press", move={"t": pr.Motion(y=-2.0)}, increments=20), "by 2 of 2.5"),
        (pr.Step("press", by={"t": pr.Motion(y=-1.8)}, increments=20), "by up to 1.8 of 2.5"),
        (pr.Step("press", velocity={"t": pr.Motion(y=-1.8)}, increments=20), "by up to 1.8 of 2.5"),
        (pr.Step("press", by={"t": pr.Motion(y=-0.5)}, increments=20), ""),
        (pr.Step("press", move={"t": pr.Motion(y=-0.5)}, increments=20), ""),
    ],
    ids=["to a place", "by a way", "at a speed", "by a short way", "to a near place"],
)
def test_upsets_after_a_step_that_ends_on_its_way_are_reported(then, by):
    """An absolute motion ends where it says, and a relative one adds to what the force has pressed before."""
    words = in_steps(MET, then)
    assert bool(words) == bool(by) and by in words, words


def test_a_way_after_an_end_that_no_force_bounds_is_the_least():
    """Of a step until a contact is made, which may end where it begins; more of it adds up."""
    touch = replace(MET, until=pr.Until(contact={"t": "touches"}))
    press = [pr.Step(f"press{k}", by={"t": pr.Motion(y=-0.9)}, increments=10) for k in range(2)]
    assert "by at least 1.8 of 2.5" in in_steps(touch, *press) and in_steps(touch, press[0]) == ""


def test_the_place_is_lost_again_by_the_next_end_on_the_way():
    """A motion to a place, then up again until a force is gone, then down by less than what is reported."""
    place, lift = (pr.Step(name, move={"t": pr.Motion(y=y)}, increments=5) for name, y in (("press", -0.6), ("lift", 0.0)))
    short = pr.Step("again", by={"t": pr.Motion(y=-0.6)}, increments=5)
    assert in_steps(MET, place, replace(lift, until=pr.Until(contact={"t": "leaves"})), short) == ""


@pytest.mark.parametrize(("travel", "reported"), [(-0.4, None), (-1.9, 1.9), (-2.45, 2.1), (0.5, 2.1)])
@pytest.mark.parametrize("pushed", [True, False])
def test_a_travel_that_ends_a_step_bounds_what_a_force_presses(travel, reported, pushed):
    """Where it lies on the way of the tool, and before the place to which the metal yields to the force."""
    share = 0.3 * 0.7652 * 5.0 * np.exp(1.5 * 1.833) / (2.0 * 2.5)
    force = 800.0 * (0.005 + 1.833) ** 0.18 * 25.0 * np.exp(1.833) * (1.0 + share)  # presses by 2.1 of 2.5
    step = pr.Step("press", push={"t": pr.Push(y=-force)}, until=pr.Until(travel={"t": pr.ToolTravel(y=travel)}), increments=9)
    if not pushed:
        both = replace(step.until, force={"t": pr.ToolForce(y=force)})
        step = replace(step, push={}, move={"t": pr.Motion(y=-2.48)}, until=both)
    words = in_steps(step)
    assert bool(words) == (reported is not None), words
    if reported is not None:
        assert float(words.split("by up to ")[1].split(" of 2.5")[0]) == pytest.approx(reported, rel=0.02)


def test_a_travel_alone_is_where_a_step_ends():
    """Of a motion that would go further."""
    step = replace(MET, by={"t": pr.Motion(y=-2.4)}, until=pr.Until(travel={"t": pr.ToolTravel(y=-1.9)}))
    assert "1.9 of 2.5" in in_steps(step)
    assert in_steps(replace(step, until=pr.Until(travel={"t": pr.ToolTravel(y=-0.5)}))) == ""


def test_a_tool_around_a_body_presses_it_together_from_neither_side():
    """Moved along its opening, which is as wide as the body, by ways of which a step may end the first: one side opens."""
    channel = pr.Extruded(section=pr.Profile(points=((0.0, -5.0), (0.0, 3.0), (5.0, 3.0), (5.0, -5.0))), at=(0.0, 0.0, 0.0))
    contacts = (pr.Contact(("b.left", "b.right"), "t", pr.Coulomb(0.3)),)
    first, on = (pr.Step(name, by={"t": pr.Motion(x=x)}, increments=9) for name, x in (("first", -0.7), ("on", -1.7)))
    first = replace(first, until=pr.Until(contact={"t": "leaves"}))
    sides = {"b.bottom": "y", "b.back": "z"}
    assert said(upset(BOX, 0.0, tools={"t": channel}, contacts=contacts, fixed=sides, steps=(first, on))) == ""


@pytest.mark.parametrize(
    ("material", "travel", "reported"),
    [(pr.Elastic(210e3, 0.3), 0.2, True), (pr.Elastic(210e3, 0.3), 0.01, False), (pr.NeoHooke(5.0, 0.45), 0.2, False)],
)
def test_elastic_metals_pressed_beyond_any_yield_stress_are_reported(material, travel, reported):
    """A fifth of the height in steel; not a hundredth, nor in rubber."""
    words = said(upset(BOX, travel, material=material))
    assert bool(words) == reported and ("metals yield long before" in words) == reported


def test_the_examples_in_space_run_to_their_end_and_are_not_warned_of():
    """All of the gallery."""
    for path in (Path(__file__).parents[2] / "examples").glob("*.yaml"):
        if "space: solid" in path.read_text(encoding="utf-8"):
            assert said(pr.load(path).problem) == "", path.name
