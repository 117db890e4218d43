from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.measured_places import measured_places
from prensa.measures import MeasureError, grammar, names, parse, parse_all, refuse_targets
from prensa.mesh.generate import mesh_of
from prensa.model.schema import loads
from prensa.output.history import history_columns, read_history
from prensa.output.measured import MeasureTable, read_measures
from prensa.output.report import read_summary
from prensa.result.increment import Shape
from prensa.study.quantities import quantities
from prensa.system.discretise import discretise
from problems import pressed_block, single_block, stroke, upset_block

GUIDE = Path(__file__).parents[2] / "docs" / "guide" / "measures.md"


def problem(element: str = "q8", n: tuple[int, int] = (4, 3), **more) -> pr.Problem:
    return upset_block(
        stroke(-0.4, increments=2, tool="punch"), stroke(0.1, increments=1, tool="punch", name="off"),
        material=pr.J2(1000, 0.3, pr.Linear(10, 50)), n=n, element=element, body="block", sides=("top", "right"),
        friction=pr.Coulomb(0.1), plane="punch", **more,
    )  # fmt: skip


def shaped(p: pr.Problem, shape=lambda X: X, start=lambda X: X):
    """An increment of which only the shape is known, the block's nodes at shape(X)."""
    mesh = mesh_of(p.bodies["block"].mesh, p.bodies["block"].element, "mm")
    X = mesh.points
    made = Shape(X, shape(X), start(X), mesh.cells, mesh.edges, mesh.corners)
    return SimpleNamespace(shapes={"block": made})


def value(text: str, p: pr.Problem, increment) -> float:
    return parse(text, p).value(increment)


def bulged(X: np.ndarray) -> np.ndarray:
    """The right side a parabola, x = 4 + (1 − (y − 1)²) / 2, which quadratic edges follow exactly."""
    return np.column_stack([X[:, 0] * (1 + (1 - (X[:, 1] - 1) ** 2) / 8), X[:, 1]])


def on_arc(X: np.ndarray) -> np.ndarray:
    """The block bent into the quarter of a ring about the origin: its bottom with radius 5, its top with radius 7."""
    angle = math.pi / 2 * (1 - X[:, 0] / 4)
    return (5 + X[:, 1])[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def test_places_on_quadratic_edges_are_exact():
    """A parabola is met where it is, between the nodes, and its rise, largest radius and slope are those of the formula."""
    p = problem(n=(4, 1))
    inc = shaped(p, bulged)
    for y in (0.0, 0.3, 1.0, 1.7):
        x = 4 + 0.5 * (1 - (y - 1) ** 2)
        assert value(f"block.right.x at y={y}", p, inc) == pytest.approx(x, abs=1e-12)
        assert value(f"block.right.ux at Y={y}", p, inc) == pytest.approx(x - 4, abs=1e-12)
        slope = math.degrees(math.atan2(1, -(y - 1)))
        assert value(f"block.right.angle at y={y}", p, inc) == pytest.approx((slope + 90) % 180 - 90, abs=1e-9)
    assert value("block.right.max.x", p, inc) == pytest.approx(4.5, abs=1e-12)
    assert value("block.right.barrel", p, inc) == pytest.approx(0.5, abs=1e-12)
    assert value("block.left.barrel", p, inc) == pytest.approx(0.0, abs=1e-12)
    assert value("block.width", p, inc) == pytest.approx(4.5, abs=1e-12)
    assert value("block.height", p, inc) == 2.0


def test_places_on_straight_edges_are_interpolated_not_rounded_to_nodes():
    """A sheared block is cut by a level between its nodes where the straight line is."""
    p = problem("q4", n=(3, 3))
    inc = shaped(p, lambda X: X + np.column_stack([0.25 * X[:, 1], 0 * X[:, 0]]))
    assert value("block.right.x at y=0.55", p, inc) == pytest.approx(4 + 0.25 * 0.55, abs=1e-14)
    assert value("block.max.x at y=0.55", p, inc) == pytest.approx(4 + 0.25 * 0.55, abs=1e-14)
    assert value("block.min.x at y=0.55", p, inc) == pytest.approx(0.25 * 0.55, abs=1e-14)
    assert value("block.top-right.x", p, inc) == 4.5 and value("block.top-right.ux", p, inc) == 0.5
    assert value("block.y near (1.4, 0.6)", p, inc) == pytest.approx(2 / 3)
    assert value("distance(block.left at y=0.55, block.right at y=0.55)", p, inc) == pytest.approx(4, abs=1e-14)
    assert value("angle(block.bottom-left, block.top-left)", p, inc) == pytest.approx(math.degrees(math.atan2(2, 0.5)))


def test_curvatures_of_rings_and_lines():
    """The nodes of a ring lie on its circle: curvature with its sign and radius to round-off; a straight side has none."""
    for element in ("q4", "q8"):
        p = problem(element, n=(8, 2))
        inc = shaped(p, on_arc)
        there = "at X=0, block.{0} at X=4"
        assert value(f"curvature(block.top {there.format('top')})", p, inc) == pytest.approx(1 / 7, rel=1e-9)
        assert value(f"curvature(block.bottom {there.format('bottom')})", p, inc) == pytest.approx(-1 / 5, rel=1e-9)
        assert value(f"radius(block.top {there.format('top')})", p, inc) == pytest.approx(7, rel=1e-9)
        straight = shaped(p)
        assert value(f"curvature(block.top {there.format('top')})", p, straight) == pytest.approx(0, abs=1e-9)


def test_thickness_and_thinning_of_a_sheet():
    """A stretched wedge: least thickness, thickness at a place, and largest thinning are those of its formula."""
    p = problem("q4", n=(4, 1))
    inc = shaped(p, lambda X: np.column_stack([X[:, 0], X[:, 1] * (1 - 0.05 * X[:, 0])]))
    assert value("thickness(block.bottom, block.top)", p, inc) == pytest.approx(1.6, rel=1e-12)  # at its end
    across = math.cos(math.atan(0.1))  # from the bottom straight to the inclined top
    assert value("thickness(block.bottom at X=2, block.top)", p, inc) == pytest.approx(1.8 * across, rel=1e-12)
    assert value("thinning(block.bottom at X=2, block.top)", p, inc) == pytest.approx(1 - 0.9 * across, rel=1e-12)
    assert value("thinning(block.bottom, block.top)", p, inc) == pytest.approx(0.2, rel=1e-12)
    assert value("thickest(block.bottom, block.top)", p, inc) == pytest.approx(2.0 * across, rel=1e-12)
    assert value("thickest(block.bottom at X=2, block.top)", p, inc) == pytest.approx(1.8 * across, rel=1e-12)
    assert value("thickening(block.bottom, block.top)", p, inc) == pytest.approx(across - 1.0, rel=1e-12)
    assert value("thickening(block.bottom at X=2, block.top)", p, inc) == pytest.approx(0.9 * across - 1.0, rel=1e-12)
    quadratic = problem("q8", n=(4, 1))
    inc = shaped(quadratic, lambda X: np.column_stack([X[:, 0], X[:, 1] * (1 - 0.05 * X[:, 0] * (4 - X[:, 0]) / 4)]))
    assert value("thickness(block.bottom, block.top)", quadratic, inc) == pytest.approx(2 * 0.95, rel=1e-12)


def test_change_is_since_the_start_of_the_step():
    """The springback of an angle: what it is now minus what it was when the step began."""
    p = problem("q4", n=(4, 2))
    inc = shaped(p, lambda X: X * (1, 2), lambda X: X + np.column_stack([X[:, 1], 0 * X[:, 0]]))
    # from 45 degrees to the vertical, whose direction is -90 as well as 90: both sides turn alike
    assert value("change(block.left.angle at Y=0.5)", p, inc) == pytest.approx(45, abs=1e-12)
    assert value("change(angle(block.bottom-right, block.top-right))", p, inc) == pytest.approx(45, abs=1e-12)
    assert value("change(block.height)", p, inc) == 2.0


@pytest.mark.parametrize("text", ["block.right.angle at Y=1", "angle(block.top-right, block.bottom-right)"])
@pytest.mark.parametrize("about", [90.0, 180.0])
def test_a_wall_that_springs_through_the_vertical_turns_by_what_it_turns(text: str, about: float):
    """A degree each way from where directions begin again is a change of two degrees, to either side."""

    def turned(angle: float):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        return lambda X: X @ np.array([[c, s], [-s, c]])

    p = problem("q4", n=(4, 2))
    for by in (1.0, -1.0):
        inc = shaped(p, turned(about + by), turned(about - by))
        assert value(f"change({text})", p, inc) == pytest.approx(2.0 * by, abs=1e-11)


GEOMETRIC = [
    "block.right.x at y=0.7", "block.right.x at Y=0.7", "block.right.uy at y=0.7", "block.right.max.x", "block.top.min.uy",
    "block.right.barrel", "block.height", "block.top-right.uy", "block.x near (2, 1)", "block.right.angle at y=0.7",
    "block.right.angle at Y=0.7", "distance(block.left at y=0.7, block.right at Y=0.4)",
    "angle(block.top-left, block.right at y=0.7)",
]  # fmt: skip


@pytest.mark.parametrize("element", ["q4", "q8"])
@pytest.mark.parametrize("text", GEOMETRIC)
def test_gradients_are_the_derivatives(text: str, element: str):
    """Each gradient is what central differences over all the nodes say."""
    p = problem(element, n=(3, 2))
    rng = np.random.default_rng(3)
    base = shaped(p, bulged).shapes["block"].x
    base = base + 0.02 * rng.standard_normal(base.shape)
    measure = parse(text, p)
    at = lambda x: shaped(p, lambda X: x)  # noqa: E731
    gradient = measure.gradient(at(base))
    assert gradient is not None
    nodes, slopes = gradient.nodes["block"]
    found = np.zeros_like(base)
    np.add.at(found, nodes, slopes)
    h = 1e-6
    expected = np.zeros_like(base)
    for i in np.ndindex(base.shape):
        d = np.zeros_like(base)
        d[i] = h
        expected[i] = (measure.value(at(base + d)) - measure.value(at(base - d))) / (2 * h)
    np.testing.assert_allclose(found, expected, atol=2e-7 * max(1.0, np.abs(expected).max()))


def test_gradients_in_the_numbers_of_a_system():
    """Motions and forces of tools, and displacements of nodes, find their degrees of freedom."""
    p = problem("q4", n=(2, 2))
    system = discretise(p)
    inc = next(iter(pr.solve(system)))
    u = inc.state.u
    travel = parse("punch.travel.y", p).gradient(inc)
    dofs, slopes = travel.displacements(system)
    assert u[dofs] @ slopes == pytest.approx(inc.tools["punch"].place.y, rel=1e-14)
    dofs, slopes = parse("block.top-right.ux", p).gradient(inc).displacements(system)
    assert u[dofs] @ slopes == pytest.approx(parse("block.top-right.ux", p).value(inc), rel=1e-14)
    dofs, slopes = parse("punch.force.y", p).gradient(inc).reactions(system)
    assert slopes[dofs == system.tool_dof(0) + 1] == [1.0] and np.count_nonzero(slopes) == 1


@pytest.fixture(scope="module")
def pressed() -> tuple[pr.Problem, list]:
    p = problem("q4_fbar", n=(6, 4), measures={"force": "punch.force.y", "bulge": "block.right.barrel"})
    return p, list(pr.solve(p))


def test_every_column_of_the_history_is_a_measure(pressed):
    """What `history_columns` lists is a number of the increment under the same name, with a unit."""
    p, increments = pressed
    for name in history_columns(p):
        if name not in grammar.NOT_NUMBERS:
            assert isinstance(increments[-1].measure(name), float)
    inc = increments[0]
    assert inc.measure("punch.fy") == inc.measure("punch.force.y") == inc.measure("force") == inc.force("punch").y
    assert parse("punch.fy", p).unit == "N/mm" and parse("energy.plastic", p).unit == "N mm/mm"


def test_figures_of_a_thickness_are_reported_in_units_of_the_whole(pressed):
    """Forces, moments, energies and areas are those of the thickness, and say so: twice those per mm, in N, where it is 2 mm."""
    p, increments = pressed
    thick = problem("q4_fbar", n=(6, 4), thickness=2.0)
    last = next(iter(pr.solve(thick)))
    units = {"punch.fy": "N", "punch.moment": "N mm", "energy.plastic": "N mm", "block.top+block.right-punch.area": "mm²"}
    for name, unit in units.items():
        assert parse(name, thick).unit == unit
        per_length = parse(name, p)
        assert per_length.unit == {"N": "N/mm", "N mm": "N mm/mm", "mm²": "mm"}[unit]
        assert parse(name, thick).value(last) == pytest.approx(2.0 * per_length.value(increments[0]), rel=1e-6)


def test_every_listed_measure_has_a_value_or_says_why_not(pressed):
    """What `names` lists is parsed, and is a finite number unless it says what is missing."""
    p, increments = pressed
    some = list(names(p))
    assert len(some) > 200 and len(set(some)) == len(some)
    for text in some:
        measure = parse(text, p)
        try:
            assert math.isfinite(measure.value(increments[0])), text
        except MeasureError as error:
            assert str(error).startswith(f"{text}: ")


def test_contacts_and_powers_add_up(pressed):
    """Length is area in plane strain, mean pressure times area the force, powers times duration the dissipated work."""
    p, increments = pressed
    first, last = increments[0], increments[-1]
    contact = p.contacts[0].name
    assert first.measure(f"{contact}.length") == pytest.approx(first.measure(f"{contact}.area"), rel=0.02)
    force = first.measure("punch.mean.pressure") * first.measure(f"{contact}.area")
    assert force == pytest.approx(first.force("punch").y, rel=1e-6)
    times = np.diff([0.0, *(i.time for i in increments)])
    work = sum(i.measure("block.plastic_power") * dt for i, dt in zip(increments, times))
    assert work == pytest.approx(last.energy["plastic"], rel=1e-9)
    friction = sum(i.measure("punch.friction_power") * dt for i, dt in zip(increments, times))
    # the energy balance takes the stress in the middle of an increment, which is between half of that at its end and all of it
    assert 0.5 * friction < last.energy["friction"] < friction
    with pytest.raises(MeasureError, match="nothing is in contact"):
        last.measure("punch.mean.pressure")


@pytest.mark.parametrize("element", ["q4_fbar", "q8", "t6"])
@pytest.mark.parametrize("rule", ["nodal", "gauss2"])
@pytest.mark.parametrize("surface", ["block", ("block.right", "block.top")])
def test_contact_ends_at_the_corners_of_a_body(element, rule, surface):
    """A block under a plane: area and length of its outline in contact are its width, mean pressure is the force over it."""
    if rule != "nodal" and element != "q4_fbar":
        return  # quadratic edges take the nodal rule
    p = pressed_block(
        stroke(-0.02, increments=1, tool="punch"), n=(4, 3), element=element, body="block", plane="punch",
        contacts=(pr.Contact(surface, "punch", integration=rule),), fixed={"block.bottom": "y", "block.bottom-left": "x"},
    )  # fmt: skip
    (last,) = pr.solve(p)
    width = last.measure("block.top.max.x") - last.measure("block.top.min.x")
    name = p.contacts[0].name
    assert last.measure(f"{name}.area") == pytest.approx(width, rel=1e-6)
    assert last.measure(f"{name}.length") == pytest.approx(width, rel=1e-6)
    assert last.measure("punch.mean.pressure") == pytest.approx(last.force("punch").y / width, rel=1e-6)


def test_neutral_point_divides_friction():
    """Where a linear shear changes sign; a second change that divides less is passed over."""
    x = np.linspace(0, 8, 9)
    shear = np.array([3.0, 3, 2, 1, -2, -3, -3, 0.5, -3])
    contact = SimpleNamespace(
        status=np.full(9, 2), shear=shear, weight=np.ones(9), x=np.column_stack([x, 0 * x]), gap=np.zeros(9)
    )
    p = problem()
    inc = SimpleNamespace(contacts={p.contacts[0].name: contact})
    assert value(f"{p.contacts[0].name}.neutral.x", p, inc) == pytest.approx(3 + 1 / 3)
    contact.shear = np.abs(shear)
    with pytest.raises(MeasureError, match="does not change sign"):
        value(f"{p.contacts[0].name}.neutral.x", p, inc)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("force.punch.y", "did you mean 'punch.force.y'"),
        ("punch.forc.y", "did you mean 'punch.force.y'"),
        ("block.rihgt.x at y=1", "did you mean 'block.right.x at y=1'"),
        ("block.right.x", "write 'block.right.x at y=…' or 'block.right.max.x'"),
        ("block.right.x at y=5 N", "is not a length"),
        ("block.right.x at y=1e400", "it is not finite"),
        ("angel(block.top-left, block.top-right)", "did you mean 'angle'"),
        ("angle(block.top, block.top-right)", "of two places of a body"),
        ("curvature(block.top at X=1, block.right at Y=1)", "of a boundary between two places"),
        ("thickness(block.top, block.top)", "to the boundary opposite"),
        ("change(punch.force.y)", "'punch.force.y' is none"),
        ("mean(punch.fz)", "did you mean 'punch."),
        ("angle(block.top-left)", "takes 2 arguments"),
        ("distance(blok.top-left, block.top-right)", "begin with a body"),
        ("", "unknown measure"),
        ("change(" * 999 + "time" + ")" * 999, "a measure with 999 brackets"),
    ],
)
def test_what_does_not_exist_is_refused_with_a_remedy(text: str, words: str):
    """Every mistake is reported with what to write instead."""
    with pytest.raises(MeasureError, match=re.escape(words)):
        parse(text, problem("q4", n=(2, 2)))


def test_places_that_are_not_there_and_places_that_are_several():
    """An outline that does not reach a level says how far it goes, one that crosses it twice where."""
    p = problem("q4", n=(2, 2))
    inc = shaped(p)
    with pytest.raises(MeasureError, match=r"does not reach y = 9: it lies at y = 0 … 2"):
        value("block.right.x at y=9", p, inc)
    assert math.isnan(parse("block.right.x at y=9", p).value_or_nan(inc))
    with pytest.raises(MeasureError, match=r"in 2 places, x = .*'max\.x' or 'min\.x'"):
        value("block.x at y=1", p, inc)


def test_about_an_axis_there_is_no_moment():
    """In axisymmetry the size of a force is that along the axis, and sums of radial forces are refused."""
    p = single_block(
        stroke(-0.01, increments=1, tool="die", name="s"), tools={"die": pr.Plane(touching="b.top")}, n=(2, 1),
        fixed={"b.bottom": "y"}, space="axisymmetric",
    )  # fmt: skip
    with pytest.raises(MeasureError, match=r"no meaning about an axis; take 'die\.force\.y'"):
        parse("die.moment", p)
    inc = next(iter(pr.solve(p)))
    assert inc.measure("die.force") == abs(inc.force("die").y) and parse("die.force", p).unit == "N"


def test_measures_of_a_case_are_written_and_reported(tmp_path: Path):
    """Own names: a table of their own, values at the ends of the steps in the summary, a picture, a line in the report."""
    p = problem("q4_fbar", n=(4, 2), measures={"force": "punch.force.y", "far": "block.right.x at y=9"})
    result = pr.run(pr.Case(p), tmp_path / "r", quiet=True)
    table, history = read_measures(tmp_path / "r"), read_history(tmp_path / "r")
    np.testing.assert_array_equal(table["force"], history["punch.fy"])
    assert np.isnan(table["far"]).all() and "far" not in history
    written = read_summary(tmp_path / "r")["measures"]["force"]
    assert written == {"measure": "punch.force.y", "unit": "N/mm", "last": table["force"][-1],
                    "steps": {"press": table["force"][1], "off": table["force"][2]}}  # fmt: skip
    assert result.summary["measures"]["far"]["last"] is None
    assert any("measures.far had no value" in w for w in json.loads((tmp_path / "r/summary.json").read_text())["warnings"])
    assert (tmp_path / "r/pictures/measures.png").stat().st_size > 1000
    assert "punch.force.y" in (tmp_path / "r/report.html").read_text(encoding="utf-8")


def test_wrong_measures_of_a_case_end_a_run_before_it_begins(tmp_path: Path):
    """All the measures that do not exist are reported at once, and no folder is made."""
    p = problem("q4", n=(2, 2), measures={"a": "punch.fx", "b": "punch.f", "c": "block.x"})
    with pytest.raises(MeasureError, match=r"(?s)measures\.b: .*\nmeasures\.c: "):
        pr.run(pr.Case(p), tmp_path / "r", quiet=True)
    assert not (tmp_path / "r").exists()
    with pytest.raises(pr.CaseError, match="is not a name for a measure"):
        problem(measures={"time": "punch.fx"})
    with pytest.raises(pr.CaseError, match="is not a name for a measure"):
        problem(measures={"a.b": "punch.fx"})
    assert list(parse_all(problem("q4", measures={"a": "punch.fx"}))) == ["a"]


def test_the_guide_has_every_measure_and_all_of_them_exist():
    """What the tables of the page name is parsed in its case, and no quantity of the code is missing there."""
    page = GUIDE.read_text(encoding="utf-8")
    case = loads(re.search(r"```yaml\n(.*?)```", page, re.S)[1])
    spans = [s for line in page.splitlines() if line.startswith("| `") for s in re.findall(r"`([^`]+)`", line.split("|")[1])]
    assert len(spans) > 40
    for text in spans:
        parse(text, case.problem)
    text = " ".join(spans)
    quantities = (*grammar.TOOL_QUANTITIES, *grammar.POSITIONS, *grammar.NODAL_FIELDS, *grammar.CONTACT_EXTREMES)
    quantities += ("neutral.x", "length", "area", "barrel", "height", "width", "plastic_power", "friction_power")
    missing = [q for q in quantities if not re.search(rf"\.{re.escape(q)}\b", text)]
    missing += [f for f in grammar.FUNCTIONS if f"{f}(" not in text] + [s for s in grammar.COUNTS if f"count.{s}" not in text]
    assert missing == []


def test_the_table_of_measures_is_continued(tmp_path: Path, pressed):
    """A run that is resumed goes on after the rows that its checkpoint stands for."""
    p, increments = pressed
    for keep, some in ((None, increments[:3]), (1, increments[1:3])):
        table = MeasureTable(tmp_path, p, keep)
        for increment in some:
            table.append(increment)
        table.close()
        assert read_measures(tmp_path)["increment"].tolist() == [1, 2, 3]


@pytest.mark.parametrize("text", [
    "block.right.y at X=4", "block.right.ux at X=4 mm", "block.right.mises at X=4", "block.right.angle at X=4",
    "block.right.max.y at X=4", "block.top.x at Y=2", "distance(block.right at X=4, block.left at Y=1)",
    "thickness(block.right at X=4, block.left)", "change(block.right.y at X=4)",
])  # fmt: skip
def test_a_place_along_the_constant_coordinate_of_a_side_is_refused_when_it_is_read(text):
    """All of the right side is at X = 4: the message says which coordinate names a place, and what it may be."""
    axis, low, high = ("X", "0", "4") if "at Y=2" in text else ("Y", "0", "2")
    with pytest.raises(MeasureError, match=rf"all of block\.\w+ is at .*give {axis}.*\({axis} is {low} … {high} mm there\)"):
        parse(text, problem())


def test_places_of_the_undeformed_body_are_looked_for_when_they_are_read():
    """One that runs along part of the outline, one that is not there and one that is there twice are refused before a run."""
    p = problem()
    for text, why in (
        ("block.max.ux at X=4", r"runs along X = 4.*'block\.<boundary> at Y=1' \(Y is 0 … 2 mm"),
        ("block.top.y at X=4.5", r"does not reach X = 4\.5: it lies at X = 0 … 4 mm"),
        ("block.y at X=2", "in 2 places"),
    ):
        with pytest.raises(MeasureError, match=why):
            parse(text, p)
    assert value("block.max.y at X=2", p, shaped(p)) == 2.0  # of several one is chosen
    assert value("block.top.y at X=4", p, shaped(p)) == 2.0  # an end of a side that crosses the level


def test_a_side_that_lies_along_a_level_at_the_start_only_is_a_warning():
    """The side may bend across the level, so it is no error; where one of several places is chosen nothing is said."""
    p = problem(measures={"end": "block.right.y at x=4", "far": "block.right.max.y at x=4", "good": "block.right.x at y=1"})
    found = list(measured_places(discretise(p)))
    assert [f.path for f in found] == ["measures.end"] and not found[0].fatal
    assert "give y, as in 'block.right at y=1' (y is 0 … 2 mm there)" in found[0].message
    with pytest.raises(MeasureError, match=r"all of block\.right is at x = 4"):
        value("block.right.y at x=4", p, shaped(p))
    tilted = shaped(p, lambda X: X + np.column_stack([0.25 * (X[:, 1] - 0.5), 0 * X[:, 0]]))
    assert value("block.right.y at x=4", p, tilted) == pytest.approx(0.5, abs=1e-12)


def test_extremes_over_a_run_are_those_of_all_increments_so_far(tmp_path):
    """In the table and after a restart; an increment by itself refuses them, and so does what ends a step."""
    own = {"f": "punch.force.y", "peak": "max(punch.force.y)", "least": "min( block.top.y at X=1 )"}
    p = problem("q4", measures=own)
    increments = list(pr.solve(p))
    table = MeasureTable(tmp_path, p)
    for inc in increments[:2]:
        table.append(inc)
    table.close()
    table = MeasureTable(tmp_path, p, keep=2)
    table.append(increments[2])
    table.close()
    found = read_measures(tmp_path)
    assert found["peak"].tolist() == np.maximum.accumulate(found["f"]).tolist() and found["peak"][2] > found["f"][2]
    heights = [inc.measure("block.top.y at X=1") for inc in increments[:3]]
    assert found["least"].tolist() == np.minimum.accumulate(heights).tolist()
    assert parse_all(p)["peak"].unit == parse("punch.force.y", p).unit
    for text in ("peak", "max(punch.force.y)"):
        with pytest.raises(MeasureError, match=r"over a run.*under 'measures'"):
            increments[0].measure(text)
    with pytest.raises(MeasureError, match="did you mean"):
        parse_all(problem(measures={"peak": "max(punhc.force.y)"}))


def test_a_study_takes_an_extreme_by_its_name_and_a_step_does_not_wait_for_it():
    """The name stands for what the study calls max(…); `until` refuses it before the run."""
    p = problem("q4", measures={"peak": "max(punch.force.y)"})
    (found,) = quantities("peak", p)
    (plain,) = quantities("max(punch.force.y)", p)
    assert (found.text, found.name, found.how, found.unit) == ("peak", plain.name, "max", plain.unit)
    waiting = replace(p, steps=[replace(p.steps[0], until=pr.Until(measure={"peak": 10.0})), *p.steps[1:]])
    with pytest.raises(MeasureError, match="over a run"):
        refuse_targets(waiting)
