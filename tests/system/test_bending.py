"""The element of bodies that bend, where the description leaves it open: closed forms of beams, and what is pressed."""

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight

LENGTH = 20.0
STEEL = pr.J2(200e3, 0.3, pr.Linear(300.0, 500.0))


def beam(layers, length, nu=0.3, space="plane strain", element=None, material=None):
    """A cantilever of thickness 1, of elements of a ``length`` in ``layers``, with a small force at its end."""
    mesh = pr.Rectangle((LENGTH, 1.0), n=(round(LENGTH / length), layers))
    return pr.Problem(
        "beam", space=space, kinematics="small", bodies={"beam": pr.Body(mesh, material or pr.Elastic(1000.0, nu), element)},
        tools={}, fixed={"beam.left": "x", "beam.bottom-left": "y"},
        steps=[pr.Step("bend", loads={"beam.right": pr.Load(traction=(0.0, -1e-5))})],
    )  # fmt: skip


def tip(problem):
    """Deflection of the end."""
    *_, increment = pr.solve(problem)
    return -float(increment.state.u[1::2].min())


@pytest.mark.parametrize("layers", range(1, 9))
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_elastic_beams_of_few_layers_bend_as_beams_do(layers, nu):
    """The deflection is F L³/(3 E' I) + 6 F L/(5 G A) of a Timoshenko beam, within 5 % with long and with square elements."""
    E, G = 1000.0 / (1.0 - nu**2), 500.0 / (1.0 + nu)
    reference = 1e-5 * (LENGTH**3 / (3.0 * E / 12.0) + 1.2 * LENGTH / G)
    for length in (2.0, 1.0, 0.5):
        assert tip(beam(layers, length, nu)) == pytest.approx(reference, rel=0.05)


@pytest.mark.parametrize(("space", "element"), [("plane strain", "q4_fbar"), ("plane stress", "q4")])
@pytest.mark.parametrize("layers", [1, 2, 3, 4, 8])
@pytest.mark.parametrize("length", [0.4, 0.5, 1.0, 2.0, 5.0])
def test_the_error_that_is_reported_is_that_of_the_default_element(layers, length, space, element):
    """Against the deflection of a beam whose elements are named, in plane strain and in plane stress."""
    from prensa.contact.passage import WORTH_SAYING
    from prensa.system.bending import bendings

    problem = beam(layers, length, space=space, element=element)
    found = bendings(pr.discretise(problem), ["beam"])
    error = tip(beam(4, 0.5, space=space, element="q8")) / tip(problem) - 1.0
    if "beam" in found:
        assert found["beam"].softest == found["beam"].stiffest == pytest.approx(error, abs=0.02 * (1.0 + error))
    else:
        assert abs(error) < WORTH_SAYING + 0.02


def plate(height, layers, travel, material, element=None):
    """A plate of width 10 between two plates, pressed."""
    return pr.Problem(
        "plate", bodies={"plate": pr.Body(pr.Rectangle((10.0, height), n=(20, layers)), material, element)},
        tools={"above": pr.Plane(touching="plate.top")}, friction=pr.Coulomb(0.1),
        fixed={"plate.bottom": "y", "plate.left": "x"}, steps=[pr.Step("press", move={"above": {"y": -travel}})],
    )  # fmt: skip


@pytest.mark.parametrize("layers", [1, 2, 4])
def test_what_is_pressed_across_its_thickness_keeps_the_default_element(layers):
    """Rubber plates pressed to half their height, however few layers they have."""
    problem = plate(1.0, layers, 0.5, pr.NeoHooke(3.0, 0.45))
    system = pr.discretise(problem)
    assert system.problem.bodies["plate"].element is None
    assert not system.chosen
    named = pr.discretise(plate(1.0, layers, 0.5, pr.NeoHooke(3.0, 0.45), "q4_fbar"))
    assert type(system.blocks[0].element) is type(named.blocks[0].element)


def sheet(element=None, material=None, gap=5.0):
    """Three-point bending of half a sheet of two layers with long elements; the punch ends ``gap`` above the die's bottom."""
    return pr.Problem(
        "sheet", bodies={"sheet": pr.Body(pr.Rectangle((20.0, 1.0), n=(20, 2)), material or STEEL, element)},
        tools={
            "punch": pr.Circle(radius=4.0, at=(0.0, 5.0)), "support": pr.Circle(radius=3.0, at=(16.0, -3.0)),
            "bottom": pr.Plane(normal=(0.0, 1.0), at=(0.0, -2.0 - gap)),
        },
        fixed={"sheet.left": "x"}, steps=[pr.Step("bend", move={"punch": {"y": -3.0}})],
    )  # fmt: skip


def said(problem):
    """Findings about elements that bend."""
    return [f.message for f in preflight(pr.discretise(problem)) if "bends" in f.message]


def test_a_sheet_that_flows_keeps_its_element_and_is_reported_with_the_error():
    """Coined at the end it is pressed, and nothing is said; nor of a sheet whose element is named."""
    (words,) = said(sheet())
    assert "'q4_fbar'" in words and "too stiff by 19 %" in words
    assert pr.discretise(sheet()).problem.bodies["sheet"].element is None
    assert not said(sheet("q4_fbar"))
    assert not said(sheet(gap=0.5))


def test_a_bar_that_is_drawn_along_its_axis_is_not_said_to_bend():
    """One layer of J2, moved along itself."""
    problem = pr.Problem(
        "bar", bodies={"bar": pr.Body(pr.Rectangle((20.0, 1.0), n=(40, 1)), STEEL)}, tools={},
        fixed={"bar.left": "x", "bar.bottom-left": "y"}, steps=[pr.Step("pull", fixed={"bar.right": {"x": 1.0}})],
    )  # fmt: skip
    assert not said(problem)


def test_a_choice_is_that_of_the_run_in_summary_and_check(tmp_path):
    """summary.json has the element that was chosen; a run that goes on from it takes the same one."""
    import json

    first = beam(2, 1.0)
    pr.run(pr.Case(first, output=pr.Output(pictures=False, report=False)), tmp_path / "first", quiet=True)
    assert json.loads((tmp_path / "first" / "summary.json").read_text())["bodies"]["beam"]["element"] == "q4_enhanced"

    more = pr.Problem(
        "more", space="plane strain", kinematics="small", bodies=first.bodies, tools={}, fixed=first.fixed,
        start=pr.Start(str(tmp_path / "first")), steps=[pr.Step("rest", loads={"beam.right": pr.Load(traction=(0.0, 0.0))})],
    )  # fmt: skip
    *_, last = pr.solve(more)
    assert np.abs(last.state.u).max() < 1e-9 * tip(first)


def beam_in_space(layers, length, element=None, material=None, held=""):
    """A cantilever 20 × 1 × 1, a brick wide, whose end is lowered."""
    mesh = pr.Box((LENGTH, 1.0, 1.0), (round(LENGTH / length), layers, 1))
    fixed = {"beam.left": "xyz"} | ({"beam.back": held, "beam.front": held} if held else {})
    return pr.Problem(
        "beam", space="solid", kinematics="small", bodies={"beam": pr.Body(mesh, material or pr.Elastic(1000.0, 0.3), element)},
        tools={}, fixed=fixed, steps=[pr.Step("bend", fixed={"beam.right": pr.Fixed(y=-0.01)})],
    )  # fmt: skip


def force(problem):
    """That lowers the end."""
    *_, increment = pr.solve(problem)
    return abs(increment.supports["beam.right"].y)


@pytest.mark.parametrize("layers", [1, 2, 4, 8])
@pytest.mark.parametrize("length", [1.0, 2.0, 5.0])
def test_the_error_that_is_reported_in_space_is_that_of_bricks(layers, length):
    """Against a plate of enhanced bricks; all are held across their width."""
    from prensa.system.bending import bendings

    default = beam_in_space(layers, length, "h8_fbar", held="z")
    found = bendings(pr.discretise(default), ["beam"])["beam"]
    assert found.bent
    assert not found.pressed
    error = force(default) / force(beam_in_space(4, 0.5, "h8_enhanced", held="z")) - 1.0
    assert found.softest == found.stiffest == pytest.approx(error, abs=0.02 * (1.0 + error))


def sheet_in_space(material=None, gap=5.0, element=None):
    """Half a sheet on an extruded roll, a punch over its middle that ends ``gap`` above a plane under the sheet."""
    return pr.Problem(
        "sheet", space="solid",
        bodies={"sheet": pr.Body(pr.Box((20.0, 1.0, 6.0), (20, 2, 3)), material or pr.Elastic(1000.0, 0.3), element)},
        tools={
            "punch": pr.Extruded(pr.Circle(4.0), at=(0.0, 5.0, 0.0)),
            "support": pr.Extruded(pr.Circle(3.0), at=(16.0, -3.0, 0.0)),
            "bottom": pr.Plane(normal=(0.0, 1.0, 0.0), at=(0.0, -2.0 - gap, 0.0)),
        },
        contacts=[pr.Contact("sheet.top", "punch"), *(pr.Contact("sheet.bottom", t) for t in ("support", "bottom"))],
        fixed={"sheet.left": "x", "sheet.back": "z"}, steps=[pr.Step("bend", move={"punch": {"y": -3.0}})],
    )  # fmt: skip


def test_bodies_in_space_get_the_element_of_what_they_do():
    """Elastic ones that bend; not what is pressed between two tools, nor a slab in plane strain that is short of nothing."""
    assert pr.discretise(sheet_in_space()).problem.bodies["sheet"].element == "h8_enhanced"
    assert pr.discretise(sheet_in_space(gap=0.5)).problem.bodies["sheet"].element is None
    named = pr.discretise(sheet_in_space(element="h8_fbar"))
    assert not named.chosen
    assert named.problem.bodies["sheet"].element == "h8_fbar"
    assert pr.discretise(beam_in_space(8, 0.5, held="z")).problem.bodies["beam"].element == "h8_enhanced"
    assert pr.discretise(beam_in_space(8, 0.25, held="z")).problem.bodies["beam"].element is None


def test_metal_that_bends_in_space_is_reported_with_the_error():
    """Across the thickness that the punch acts along; named elements are left alone."""
    (words,) = said(sheet_in_space(STEEL))
    assert "'h8_fbar', are too stiff by 22 to 47 %, by the shape that it takes: give it 'element: h8_enhanced'" in words
    assert not said(sheet_in_space(STEEL, element="h8_fbar"))
    assert not said(sheet_in_space(STEEL, gap=0.5))


def test_a_choice_in_space_is_in_summary_and_check(tmp_path):
    """summary.json has the element, and the lines of check say why."""
    import json

    from prensa.cli.describe import lines_of

    problem = beam_in_space(2, 2.0)
    pr.run(pr.Case(problem, output=pr.Output(pictures=False, report=False)), tmp_path / "run", quiet=True)
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["bodies"]["beam"]["element"] == "h8_enhanced"
    assert any("20 elements h8_enhanced (it is elastic and may bend)" in line for line in lines_of(pr.discretise(problem)))


def test_auto_is_no_element_named():
    """In Python and in files."""
    problem = beam(2, 1.0, element="auto")
    assert problem == beam(2, 1.0)
    assert pr.discretise(problem).problem.bodies["beam"].element == "q4_enhanced"
    assert "element" not in pr.dump(problem)
