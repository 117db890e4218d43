"""Sections of bent metal against closed forms, and what a run reports of strips that bend past yield against finer meshes."""

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.mesh.thin import strips
from prensa.system.bending import PLATE_SHAPES, BentStrips, stiffness_errors
from prensa.system.bent_sections import BentMetal
from prensa.system.held import held

E, NU, YIELD = 200e3, 0.3, 300.0
ONE_WAY = np.ones((1, 1))
METAL = pr.J2(E, NU, pr.Linear(YIELD, 1000.0))


def perfect(space):
    """A metal that does not harden."""
    return BentMetal(E, NU, lambda strain: np.full(len(strain), YIELD), space)


@pytest.mark.parametrize("times", [0.5, 1.0, 1.3, 2.0, 5.0])
def test_the_moment_of_a_section_in_plane_stress_is_the_closed_form(times):
    """M/M_y = κ/κ_y before yield, and 3/2 − ½ (κ_y/κ)² after it."""
    bend, first = np.array([times * 2.0 * YIELD / E]), YIELD / 6.0
    expected = first * (times if times <= 1.0 else 1.5 - 0.5 / times**2)
    assert perfect("plane stress").moments(bend, ONE_WAY)[0] == pytest.approx(expected, rel=5e-4)


def test_the_moments_in_plane_strain_are_those_of_the_plate_and_of_full_flow():
    """E/(1 − ν²) κ/12 before yield, and 2/√3 σ_y/4 far beyond."""
    metal = perfect("plane strain")
    assert metal.moments(np.array([1e-4]), ONE_WAY)[0] == pytest.approx(E / (1.0 - NU**2) * 1e-4 / 12.0, rel=5e-4)
    assert metal.moments(np.array([0.5]), ONE_WAY)[0] == pytest.approx(2.0 / np.sqrt(3.0) * YIELD / 4.0, rel=2e-3)


@pytest.mark.parametrize(("ways", "stiffness"), [
    ((1.0, 0.0), E / (1.0 - NU**2)), ((1.0, -NU), E), ((1.0, 1.0), E / (1.0 - NU)),
])  # fmt: skip
def test_the_moments_of_plates_are_those_of_a_wide_one_a_narrow_one_and_a_dome(ways, stiffness):
    """The work of both moments on the curvatures, D (κ₁² + κ₂² + 2 ν κ₁ κ₂): what is free along its width has E alone."""
    one = np.array([ways]) / np.linalg.norm(ways)
    work = perfect("solid").moments(np.array([1e-6]), one)[0] * np.linalg.norm(ways) ** 2
    assert work == pytest.approx(stiffness * (1.0 if ways[1] <= 0.0 else 2.0) * 1e-6 / 12.0, rel=5e-4)


def test_the_moment_of_a_narrow_beam_in_full_flow_is_the_uniaxial_one():
    """Plastic: κ₂ = −κ₁/2, and σ_y/4 on the larger curvature; a plate held along its width carries 2/√3 of that."""
    for ways, moment in (((1.0, -0.5), YIELD / 4.0), ((1.0, 0.0), 2.0 / np.sqrt(3.0) * YIELD / 4.0)):
        norm = np.linalg.norm(ways)
        found = perfect("solid").moments(np.array([0.5 * norm]), np.array([ways]) / norm)[0]
        assert found * norm == pytest.approx(moment, rel=2e-3)


@pytest.mark.parametrize("n", [(20, 1), (27, 3), (10, 2)])
def test_elastic_layers_of_bricks_err_by_what_check_reports(n):
    """The formula of `stiffness_errors` in space, bent along the length alone; the way held at both ends is no way to bend."""
    system = pr.discretise(in_space(n, 1e-3))
    mesh = system.meshes["strip"]
    found = BentStrips.of(mesh, held(system, "strip"))
    assert (found.layers == n[1]).all() and len(found.layers) == n[0]
    s = strips(mesh)
    thickness, _, along = np.argsort(s.lengths, axis=0, kind="stable")
    expected = stiffness_errors(s, thickness, along, NU, "solid")[0]
    ways = np.isclose(found.lengths, 15.0 / n[0]).astype(float)  # the width, 2, is another
    metal, bend = perfect("solid"), np.full(n[0], 1e-6)
    moments = metal.moments_of_layers(bend, ways, found.layers, found.lengths / found.thickness[:, None])
    assert moments / metal.moments(bend, ways) - 1.0 == pytest.approx(expected[0], abs=2e-3)


@pytest.mark.parametrize("space", ["plane strain", "plane stress"])
@pytest.mark.parametrize("n", [(20, 1), (27, 3), (10, 2), (60, 8)])
def test_elastic_layers_err_by_what_check_reports(space, n):
    """The same formula as `stiffness_errors`, from the points of the elements."""
    mesh = pr.discretise(strip(n, space, 1e-3)).meshes["strip"]
    found = BentStrips.of(mesh)
    s = strips(mesh)
    row, _ = s.thin
    (expected,) = stiffness_errors(s, row, 1 - row, NU, space)
    assert (found.layers == n[1]).all() and len(found.layers) == n[0]
    metal, bend, ways = perfect(space), np.full(n[0], 1e-6), np.ones((n[0], 1))
    moments = metal.moments_of_layers(bend, ways, found.layers, found.lengths / found.thickness[:, None])
    error = moments / metal.moments(bend, ways) - 1.0
    assert error == pytest.approx(expected[0], abs=2e-3)


def test_curvatures_are_those_of_an_arc():
    """A strip bent to a radius of 50, and turned besides."""
    mesh = pr.discretise(strip((12, 2), "plane strain", 1e-3)).meshes["strip"]
    angle, radius = mesh.points[:, 0] / 50.0 + 0.4, 50.0 + mesh.points[:, 1]
    bent = np.stack([radius * np.sin(angle), radius * np.cos(angle)], axis=1)
    assert np.abs(BentStrips.of(mesh).curvatures(bent)) == pytest.approx(0.02, rel=1e-9)


def test_curvatures_of_bricks_are_those_of_an_anticlastic_plate():
    """Bent along x to a radius of 50, along z to one of −120, and turned besides; strips of one element through the thickness."""
    bodies = {"strip": pr.Body(pr.Box((6.0, 1.0, 4.0), n=(6, 2, 4)), METAL)}
    plate = pr.Problem("plate", bodies=bodies, steps=[pr.Step("rest")], space="solid")
    mesh = pr.discretise(plate).meshes["strip"]
    found = BentStrips.of(mesh)
    thick = np.isclose(found.thickness, 1.0)
    X = mesh.points - mesh.points.mean(axis=0)
    u = np.array([0.02, -1.0 / 120.0])
    bent = X.copy()
    bent[:, 1] -= 0.5 * X[:, ::2] ** 2 @ u
    bent[:, ::2] += X[:, 1:2] * X[:, ::2] * u
    turn = np.linalg.qr(np.array([[1.0, 0.2, 0.1], [-0.3, 1.0, 0.4], [0.2, -0.1, 1.0]]))[0]
    turn *= np.sign(np.linalg.det(turn))
    k = np.sort(found.curvatures(bent @ turn.T), axis=1)[thick]
    assert k == pytest.approx(np.broadcast_to(np.sort(u), k.shape), rel=1e-2)


def in_space(n, way, element=None, width=2.0):
    """The strip extruded, and held along its width: plane strain in bricks."""
    flat = strip(n, "plane strain", way)
    body, = flat.bodies.values()
    bricks = pr.Extrusion(body.mesh, length=width, n=1)
    steps = [pr.Step("bend", fixed={"strip.right": pr.Fixed(y=-way)}, increments=8)]
    fixed = {"strip.left": "xyz", "strip.base": "z", "strip.cap": "z"}
    return pr.Problem("strip", bodies={"strip": pr.Body(bricks, body.material, element)}, fixed=fixed, steps=steps, space="solid")


@pytest.mark.parametrize(("way", "element", "reported"), [(0.55, None, True), (0.1, None, False), (0.55, "h8_fbar", False)])
def test_bricks_that_bend_past_yield_are_reported_with_their_error(way, element, reported, caplog):
    """Of three layers, against the plane section in elements a quarter as long."""
    *_, last = pr.solve(in_space((27, 3), way, element))
    said = [words for words in caplog.messages if "bends, and" in words]
    assert bool(said) == reported
    if said:
        fine = strip((108, 12), "plane strain", way)
        *_, right = pr.solve(replace(fine, steps=[pr.Step("bend", fixed={"strip.right": pr.Fixed(y=-way)}, increments=8)]))
        error = last.supports["strip.right"].y / 2.0 / right.supports["strip.right"].y - 1.0
        assert float(said[0].partition("estimated ")[2].partition(" %")[0]) / 100.0 == pytest.approx(error, abs=0.02)
        assert "too stiff" in said[0] and "'h8_fbar'" in said[0] and "'element: h8_enhanced'" in said[0]


@pytest.mark.parametrize("n", [(20, 2), (27, 3)])
def test_a_narrow_bar_between_rollers_is_reported_with_its_error(n, caplog):
    """Free along its width, across which it curves the other way: against enhanced strains on the same mesh."""

    def force(element):
        caplog.clear()
        mesh = pr.Extrusion(pr.Rectangle((40.0, 3.0), n=n), length=5.0, n=2)
        sides = {"punch": ("bar.top", 0.0, -8.0), "support": ("bar.bottom", 30.0, 0.0)}
        p = pr.Problem(
            "bar", space="solid", bodies={"bar": pr.Body(mesh, pr.J2(210e3, 0.3, pr.Swift(700.0, 0.01, 0.2)), element)},
            tools={k: pr.Extruded(pr.Circle(5.0), axis="z", touching=s, at=(x, 0.0, 0.0)) for k, (s, x, _) in sides.items()},
            contacts=[pr.Contact((side,), name, pr.Coulomb(0.1)) for name, (side, *_) in sides.items()],
            fixed={"bar.left": "x", "bar.base": "z"}, steps=[pr.Step("bend", move={"punch": pr.Motion(y=-8.0)}, increments=10)],
        )  # fmt: skip
        *_, last = pr.solve(p)
        return last.tools["punch"].force.y, [words for words in caplog.messages if "bends, and" in words]

    (stiff, said), (right, silent) = force(None), force("h8_enhanced")
    assert len(said) == 1 and silent == []
    assert float(said[0].partition("estimated ")[2].partition(" %")[0]) / 100.0 == pytest.approx(stiff / right - 1.0, abs=0.01)


def strip(n, space, way, element=None):
    """A clamped strip 15 long whose end is lowered."""
    steps = [pr.Step("bend", fixed={"strip.bottom-right": pr.Fixed(y=-way)}, increments=8)]
    body = pr.Body(pr.Rectangle((15.0, 1.0), n=n), METAL, element)
    return pr.Problem("strip", bodies={"strip": body}, fixed={"strip.left": "xy"}, steps=steps, space=space)


def lowered(problem, caplog):
    """The force at the end, and what is said of bending past yield."""
    caplog.clear()
    *_, last = pr.solve(problem)
    return last.supports["strip.bottom-right"].y, [words for words in caplog.messages if "bends, and" in words]


@pytest.mark.parametrize(("way", "element", "reported"), [
    (0.55, None, True), (0.4, None, True), (0.1, None, False), (0.55, "q4_fbar", False),
])  # fmt: skip
def test_a_strip_that_bends_past_yield_is_reported_with_its_error(way, element, reported, caplog):
    """Of three layers, 4 % too stiff in elasticity: against elements a quarter as long. A named element is not asked about."""
    force, said = lowered(strip((27, 3), "plane strain", way, element), caplog)
    assert bool(said) == reported
    if said:
        error = force / lowered(strip((108, 12), "plane strain", way), caplog)[0] - 1.0
        assert float(said[0].partition("estimated ")[2].partition(" %")[0]) / 100.0 == pytest.approx(error, abs=0.02)
        assert "too stiff" in said[0]


def ring(n, way, element=None, held="xy"):
    """A plate of revolution from 5 to 20 whose inner edge is lowered: clamped outside, or free to turn on its lower edge."""
    steps = [pr.Step("bend", fixed={"plate.bottom-left": pr.Fixed(y=-way)}, increments=8)]
    body = pr.Body(pr.Rectangle((15.0, 1.0), n=n, origin=(5.0, 0.0)), METAL, element)
    fixed = {"plate.right": "xy"} if held == "xy" else {"plate.bottom-right": "y"}
    return pr.Problem("plate", bodies={"plate": body}, fixed=fixed, steps=steps, space="axisymmetric")


@pytest.mark.parametrize(("way", "held", "reported"), [(0.5, "xy", "too stiff"), (0.1, "y", "too soft"), (0.5, "y", "")])
def test_plates_of_revolution_that_bend_past_yield_are_reported_with_their_error(way, held, reported, caplog):
    """Bent along the meridian most, or into a dish, along the hoop: three layers, against enhanced strains in finer elements."""

    def force(n, element=None):
        caplog.clear()
        *_, last = pr.solve(ring(n, way, element, held))
        return last.supports["plate.bottom-left"].y, [words for words in caplog.messages if "bends, and" in words]

    off, said = force((27, 3))
    assert len(said) == bool(reported) and all(reported in words for words in said)
    error = off / force((60, 8), "q4_enhanced")[0] - 1.0
    if not reported:
        assert abs(error) < 0.05
    else:
        share = float(said[0].partition("estimated ")[2].partition(" %")[0]) / 100.0
        assert share == pytest.approx(abs(error), abs=0.01) and (error > 0.0) == (reported == "too stiff")


@pytest.mark.parametrize("shape", ["sphere", "cone"])
def test_curvatures_of_revolution_are_those_of_a_sphere_and_of_a_cone(shape):
    """A flat plate bent to a sphere of radius 50, both 1/50; to a cone whose sides fall by 0.2, sin 0.2 over the radius."""
    system = pr.discretise(ring((15, 2), 1e-3))
    x = system.meshes["plate"].points
    r, y = x.T
    found = BentStrips.of(system.meshes["plate"])
    if shape == "sphere":
        bent = np.stack([(49.5 + y) * np.sin(r / 50.0), (49.5 + y) * np.cos(r / 50.0)], axis=1)
        expected = np.broadcast_to([0.02, 0.02], (15, 2))
    else:
        bent = np.stack([r * np.cos(0.2) + y * np.sin(0.2), -r * np.sin(0.2) + y * np.cos(0.2)], axis=1)
        expected = np.column_stack([np.zeros(15), np.sin(0.2) / found.of_revolution(bent)[1]])
    curvatures, _ = found.of_revolution(bent)
    sign = np.sign(curvatures[0, 1])
    assert sign * curvatures == pytest.approx(expected, rel=5e-3, abs=1e-12)


@pytest.mark.parametrize("space", ["axisymmetric", "solid"])
@pytest.mark.parametrize("n", [1, 2, 3, 8])
def test_plates_err_by_the_shape_that_they_take(space, n):
    """Cylinders, domes and, of revolution, what bends along the hoop alone: the sums over the points of elements say it."""
    if space == "solid":
        body, rest = pr.Body(pr.Box((8.0, 1.0, 6.0), n=(8, n, 4)), METAL), {}
    else:
        body, rest = pr.Body(pr.Rectangle((8.0, 1.0), n=(8, n), origin=(5.0, 0.0)), METAL), {"fixed": {"plate.right": "xy"}}
    problem = pr.Problem("plate", bodies={"plate": body}, steps=[pr.Step("rest")], space=space, **rest)
    s = strips(pr.discretise(problem).meshes["plate"])
    *_, along = np.argsort(s.lengths, axis=0, kind="stable")
    errors = stiffness_errors(s, s.thin[0], along, NU, space)
    assert len(errors) == len(PLATE_SHAPES[space])
    metal, bend, lengths = perfect(space), np.array([1e-6]), np.array([[1.0, 1.5 if space == "solid" else 0.0]])
    for shape, found in zip(PLATE_SHAPES[space], errors):
        ways = np.array([shape]) / np.linalg.norm(shape)
        expected = metal.moments_of_layers(bend, ways, np.array([n]), lengths) / metal.moments(bend, ways) - 1.0
        assert found == pytest.approx(np.full(len(found), expected[0]), abs=2e-3)


def blank(travel, element=None, back=False, n=(20, 2)):
    """A round blank on a ring die under a ball, which may draw back in the same step."""
    way = [(0.0, 0.0), (0.8, -travel), (1.0, -0.9 * travel)] if back else -travel
    return pr.Problem(
        "blank", space="axisymmetric", bodies={"sheet": pr.Body(pr.Rectangle((20.0, 1.0), n=n), METAL, element)},
        tools={"punch": pr.Circle(radius=8.0, at=(0.0, 9.0)), "die": pr.Circle(radius=3.0, at=(16.0, -3.0))},
        friction=pr.Coulomb(0.1), fixed={"sheet.left": "x"},
        steps=[pr.Step("bend", move={"punch": pr.Motion(y=way)}, increments=10)],
    )  # fmt: skip


def of_the_punch(problem, caplog):
    """Its largest force, and what is said of bending."""
    caplog.clear()
    force = max(abs(float(inc.force("punch").y)) for inc in pr.solve(problem))
    return force, [r.getMessage() for r in caplog.records if "bends" in r.getMessage() and r.levelname == "WARNING"]


@pytest.mark.parametrize("travel", [2.0, 4.0])
def test_a_sheet_that_is_stretched_over_a_ring_is_not_reported(travel, caplog):
    """Its layers are 22 % too stiff along the meridian and 13 % too soft along the hoop, its force is right: what it stretches by
    is most of the work.
    """
    (finding,) = (f for f in preflight(pr.discretise(blank(travel))) if "bends" in f.message)
    assert finding.seen_in_run and "between 13 % too soft and 22 % too stiff, by the shape that it takes" in finding.message
    force, said = of_the_punch(blank(travel), caplog)
    assert said == []
    assert force == pytest.approx(of_the_punch(blank(travel, "q4_enhanced"), caplog)[0], rel=0.02)


@pytest.mark.parametrize("back", [False, True])
def test_a_dish_is_reported_with_its_error_where_its_punch_draws_back_too(back, caplog):
    """Just bent, the blank is a dome, and too soft."""
    force, (words,) = of_the_punch(blank(0.02, back=back), caplog)
    error = force / of_the_punch(blank(0.02, "q4_enhanced", back), caplog)[0] - 1.0
    assert "too soft" in words
    assert -float(words.partition("estimated ")[2].partition(" %")[0]) / 100.0 == pytest.approx(error, abs=0.03)


def test_an_elastic_plate_of_revolution_gets_enhanced_strains_for_what_its_layers_miss_along_the_hoop():
    """Along the meridian two errors of 13 % cancel out; under a pressure the plate becomes a dish."""

    def sinks(element):
        mesh = pr.Rectangle((17.28, 1.0), n=(28, 2))
        p = pr.Problem(
            "plate", space="axisymmetric", bodies={"plate": pr.Body(mesh, pr.Elastic(E, NU), element)},
            fixed={"plate.left": "x", "plate.bottom-right": "y"},
            steps=[pr.Step("press", loads={"plate.top": pr.Load(pressure=0.01)}, increments=1)],
        )  # fmt: skip
        *_, last = pr.solve(p)
        return pr.discretise(p).problem.bodies["plate"].element, float(last.state.u[1::2].min())

    chosen, right = sinks(None)
    assert chosen == "q4_enhanced"
    assert sinks("q4_fbar")[1] / right > 1.05
