"""Loads along tools, wear, stresses of dies: conservation, closed forms, refusals, files."""

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.cli import dies as options
from prensa.dies.spread import touch
from prensa.output.die_folder import write_die
from prensa.system.discretise import discretise
from prensa.verify.dies import container, sliding
from prensa.verify.ties import shell_flexibility


def upsetting(**changes):
    """A billet of 8 × 6 elements under a plane with friction, two increments."""
    given = {
        "space": "axisymmetric", "fixed": {"billet.bottom": "y"}, "tools": {"die": pr.Plane(touching="billet.top")},
        "bodies": {"billet": pr.Body(pr.Rectangle(size=(10, 7.5), n=(8, 6)), pr.J2(200e3, 0.3, pr.Ludwik(250.0, 500.0, 0.3)))},
        "friction": pr.Coulomb(0.1), "contacts": (pr.Contact(("billet.top", "billet.right"), "die"),),
        "steps": (pr.Step("press", move={"die": pr.Motion(y=-0.4)}, increments=2),),
    }  # fmt: skip
    return pr.Problem("upsetting", **{**given, **changes})


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of the upsetting, with wear of its die."""
    case = pr.Case(upsetting(), output=pr.Output(pictures=False, wear={"die": pr.Archard(1e-5, 6000.0, 0.05)}))
    return pr.run(case, tmp_path_factory.mktemp("dies") / "run", quiet=True)


@pytest.fixture(scope="module")
def last():
    """The last increment of the upsetting, and its problem."""
    problem = upsetting()
    return list(pr.solve(problem))[-1], problem


@pytest.mark.parametrize("element", ["q4_fbar", "q8", "t6"])
@pytest.mark.parametrize("borders", [np.linspace(-1.0, 12.0, 7), np.linspace(-3.0, 13.0, 200)])
def test_no_force_is_lost(element, borders):
    """The forces on intervals of the tool's coordinate sum to the tool's, whatever the intervals and elements."""
    problem = upsetting()
    problem = replace(problem, bodies={"billet": replace(problem.bodies["billet"], element=element)}, steps=(
        pr.Step("press", move={"die": pr.Motion(y=-0.2)}, increments=1),))  # fmt: skip
    inc = list(pr.solve(problem))[-1]
    placed = discretise(problem).tools[0]
    found = touch(problem, placed, inc.tools["die"], inc.contacts["billet.top+billet.right-die"], 1.0)
    shares = found.shares(borders, placed.shape.period)
    assert shares.min() >= -1e-12
    assert (shares.T @ found.force).sum(axis=0)[1] == pytest.approx(inc.force("die").y, rel=1e-12)
    assert found.normal @ shares.sum(axis=1) == pytest.approx(inc.force("die").y, rel=1e-12)


def test_uniform_pressure_stays_uniform_on_quadratic_edges():
    """Nodal forces of quadratic edges, 1 : 4 : 1, give the pressure that they stand for and no saw."""
    problem = replace(
        sliding(1.0, 0.0, "nodal", 8.0, 0.0), friction=None,
        bodies={"block": pr.Body(pr.Rectangle(size=(4, 2), n=(4, 2)), pr.Elastic(1000.0, 0.0), "q8")},
        steps=(pr.Step("press", push={"plane": pr.Push(y=8.0)}, increments=1),),
    )  # fmt: skip
    loads = pr.tool_loads(pr.solve(problem), problem, "plane", 32)
    assert loads.envelope.pressure[2:-2] == pytest.approx(2.0, rel=1e-6)


def test_a_circle_is_loaded_across_its_seam():
    """A wheel pressed from the side where its coordinate jumps loses no force."""
    problem = pr.Problem(
        "wheel", bodies={"block": pr.Body(pr.Rectangle(size=(4, 2), n=(12, 6), origin=(-2, -2)), pr.Elastic(1000.0, 0.3))},
        tools={"wheel": pr.Circle(radius=3.0, at=(0.0, -5.0))}, fixed={"block.top": "xy"},
        contacts=(pr.Contact(("block.bottom",), "wheel"),),
        steps=(pr.Step("press", move={"wheel": pr.Motion(y=0.05)}, increments=1),),
    )  # fmt: skip
    (inc,) = pr.solve(problem)
    loads = pr.tool_loads([inc], problem, "wheel")
    assert loads.normal[0].max() > 0.0
    contact = inc.contacts["block.bottom-wheel"]
    n = contact.x - np.array(inc.tools["wheel"].at) - np.array(inc.tools["wheel"].place[:2])
    n /= np.hypot(*n.T)[:, None]
    assert loads.normal.sum() == pytest.approx((contact.force * n).sum(), rel=1e-12)
    die = pr.die_stress(inc, problem, "wheel", pr.Die(thickness=2.0, size=0.2))
    assert die.imbalance < 1e-10


def test_loads_read_back_are_those_of_the_increments(run):
    """Loads from the files of a run are those from the increments themselves."""
    fresh = pr.tool_loads(pr.solve(upsetting()), upsetting(), "die")
    stored = run.loads("die")
    for name in ("borders", "normal", "shear", "sliding", "work", "area"):
        assert getattr(stored, name) == pytest.approx(getattr(fresh, name), rel=1e-12, abs=1e-12), name
    assert stored.normal.sum(axis=1) == pytest.approx(run.history["die.fy"], rel=1e-12)
    assert (stored.envelope.pressure >= stored.mean.pressure - 1e-9).all()
    assert stored.largest_force == 1


def hoop(body, at, a, b, inner, outer, fit):
    """Mean hoop stress of a body in axisymmetry at a radius, and Lamé's of a tube a … b under two pressures.

    The bore of a ring lies where it is before the fit, inside its seat.
    """
    on = np.abs(body.X[:, 0] - at) < 1.01 * fit
    known = (inner * a**2 - outer * b**2 + (inner - outer) * (a * b / at) ** 2) / (b**2 - a**2)
    return body.stress[on, 2].mean(), known


def test_shrink_ring_is_lame():
    """A ring of steel shrunk on a tube: displacement of the bore by the pressure that closes the interference, hoop stresses."""
    inc = list(pr.solve(container()))[-1]
    ring, ends = pr.ShrinkRing(10.0, 0.01, E=210e3), {"start": "y", "end": "y"}
    die = pr.Die(10.0, 200e3, 0.3, span=(0.0, 5.0), size=0.25, ring=ring, fixed=ends)
    found = pr.die_stress(inc, container(), "wall", die)
    a, b, c = 10.0, 20.0, 30.0
    give = shell_flexibility(210e3, 0.3, b, c, b, 1.0, 0.0) - shell_flexibility(200e3, 0.3, a, b, b, 0.0, 1.0)
    u, p = shell_flexibility(200e3, 0.3, a, b, a, 0.0, 0.01 / give), 0.01 / give
    assert found.u[:, 0].mean() == pytest.approx(u, rel=3e-3)
    bodies = found.increment.bodies
    tube, around = (a, b, 0.0, p), (b, c, p, 0.0)
    for at, body, of in ((a, "die", tube), (b, "die", tube), (b, "ring", around), (c, "ring", around)):
        ours, known = hoop(bodies[body], at, *of, 0.01)
        assert ours == pytest.approx(known, rel=3e-3), (at, body)
    assert found.largest_mises_of_ring[0] == bodies["ring"].mises.max()
    assert found.largest_mises_of_ring[1][0] == pytest.approx(b, abs=0.02)


@pytest.mark.parametrize("mesh", ["offset", "grid", "triangles"])
def test_a_ring_about_a_flat_die_is_lame(mesh):
    """A disc in a ring, both without Poisson's effect, free along the axis: one pressure in the disc, Lamé's stress in the ring.

    The interference is a tenth of an element and more, and nothing says that the two overlap.
    """
    inc = list(pr.solve(upsetting(fixed={"billet.bottom": "y"}, steps=(
        pr.Step("touch", move={"die": pr.Motion(y=-1e-9)}, increments=1),))))[-1]  # fmt: skip
    E, I, b, c = 210e3, 0.1, 20.0, 30.0
    ring, held = pr.ShrinkRing(c - b, I, E=E, nu=0.0), {"back": "y"}
    die = pr.Die(10.0, E, 0.0, span=(0.0, b), size=2.0, ring=ring, fixed=held)
    if mesh == "grid":
        die = pr.Die(E=E, nu=0.0, ring=ring, fixed={"top": "y"}, mesh=pr.Rectangle((b, 10.0), (10, 6), origin=(0.0, 7.5)))
    elif mesh == "triangles":
        corners = ((0.0, 7.5), (b, 7.5), (b, 17.5), (0.0, 17.5))
        drawing = pr.Outline(points=corners, sides=["face", "outside", "top", "axis"], size=2.0)
        die = pr.Die(E=E, nu=0.0, ring=ring, fixed={"top": "y"}, mesh=drawing)
    found = pr.die_stress(inc, upsetting(), "die", die)
    bore = b - I  # where the ring's own strains are, and the same force as on the seat
    p = I * E / b / ((c**2 + bore**2) / (c**2 - bore**2) + 1.0)  # Lamé 1852, a solid shaft
    disc, about = (found.increment.bodies[name] for name in ("die", "ring"))
    inside = disc.X[:, 0] < 0.5 * b
    assert disc.stress[inside][:, [0, 2]] == pytest.approx(-p, rel=1e-4)
    for at in (bore, c):
        ours, known = hoop(about, at, bore, c, p * b / bore, 0.0, I)
        assert ours == pytest.approx(known, rel=5e-3), at


@pytest.mark.parametrize("space", ["plane strain", "plane stress"])
def test_a_ring_in_the_plane_is_lame(space):
    """About a quarter of a round cavity between lines of symmetry, which hold die and ring alone."""
    problem, a, b, c, E, nu, I = ring_in_a_cavity(space), 10.0, 20.0, 30.0, 2e5, 0.3, 0.05
    die = pr.Die(b - a, E, nu, size=0.5, ring=pr.ShrinkRing(c - b, I, E=E, nu=nu))
    problem = replace(problem, steps=(pr.Step("press", loads={"b.inner": pr.Load(pressure=1e-6)}, increments=1),))
    found = pr.die_stress(list(pr.solve(problem))[-1], problem, "die", die)
    stiff = E if space == "plane stress" else E / (1 - nu**2)
    bore = b - I
    p = I * stiff / (b * ((c**2 + bore**2) / (c**2 - bore**2) + (b**2 + a**2) / (b**2 - a**2)))
    assert np.hypot(*found.u.T).mean() == pytest.approx(2 * p * a * b**2 / (b**2 - a**2) / stiff, rel=3e-3)
    assert found.imbalance < 1.0  # nothing but the ring loads it: its forces are round-off beside its own


def test_rings_that_surround_nothing_are_refused(last):
    """On a flat die in the plane, where a die is cut, conical, or touched outside; of no size, or of one that no steel bears."""
    inc, problem = last
    ring, wide = pr.ShrinkRing(10.0, 0.05), (0.0, 20.0)
    cone = pr.Patch(((0.0, 7.5), (18.0, 7.5), (20.0, 27.5), (0.0, 27.5)), (8, 8))
    for die, words in (
        (pr.Die(20.0, ring=ring), "is cut at the radius .*--span"),
        (pr.Die(20.0, span=wide, ring=pr.ShrinkRing(10.0, -0.05)), "interference .* must be positive, got -0.05"),
        (pr.Die(20.0, span=wide, ring=pr.ShrinkRing(0.0, 0.05)), "thickness .* must be positive, got 0"),
        (pr.Die(20.0, span=wide, ring=pr.ShrinkRing(10.0, 0.5)), "2.5 % of the radius 20 of its seat.*give at most 0.2 mm"),
        (drawn(ring=pr.ShrinkRing(10.0, 0.5)), "give at most 0.2 mm"),
        (replace(drawn(ring=ring), mesh=cone), "has no cylinder"),
    ):  # fmt: skip
        with pytest.raises(pr.PrensaError, match=words):
            pr.die_stress(inc, problem, "die", die)
    mandrel = replace(container(), tools={"wall": pr.Profile(points=((10.0, 0.0), (10.0, 5.0)), at=(0.0, 0.0))}, bodies={
        "billet": pr.Body(pr.Rectangle(size=(10, 5), n=(8, 4), origin=(10, 0)), pr.Elastic(E=2e5, nu=0.3))},
        contacts=(pr.Contact("billet.left", "wall"),), steps=(
            pr.Step("press", loads={"billet.right": pr.Load(pressure=1.0)}, increments=1),))  # fmt: skip
    with pytest.raises(pr.PrensaError, match="is the face that the workpiece touches"):
        pr.die_stress(list(pr.solve(mandrel))[-1], mandrel, "wall", pr.Die(5.0, ring=ring))
    flat = upsetting(space="plane stress", fixed={"billet.bottom": "y", "billet.left": "x"}, thickness=3.0)
    for tool, die in ((flat, pr.Die(20.0, ring=ring)), (flat, drawn(ring=ring))):
        with pytest.raises(pr.PrensaError, match=r"surround nothing|possible only in axisymmetry"):
            pr.die_stress(list(pr.solve(flat))[-1], tool, "die", die)


def test_back_pressure_is_lame():
    """A pre-pressure on the back closes the bore by Lamé."""
    inc = list(pr.solve(container()))[-1]
    die = pr.Die(10.0, 200e3, 0.3, span=(0.0, 5.0), size=0.25, back_pressure=50.0, fixed={"start": "y", "end": "y"})
    found = pr.die_stress(inc, container(), "wall", die)
    assert found.u[:, 0].mean() == pytest.approx(shell_flexibility(200e3, 0.3, 10.0, 20.0, 10.0, 0.0, 50.0), rel=1e-3)


def test_a_cup_is_held_by_its_back_and_not_by_its_end_on_the_axis():
    """Its back is higher than wide; the end on the axis is a point, at which stresses would have no bound."""
    disc = pr.Body(pr.Rectangle((5.0, 3.0), (5, 3)), pr.Elastic(1000.0, 0.3))
    cup = pr.Profile(points=((6.0, 20.0), (6.0, 0.0), (0.0, 0.0)), fillet=1.0, at=(0.0, 0.0))
    problem = pr.Problem(
        "cup", space="axisymmetric", bodies={"b": disc}, tools={"die": cup, "punch": pr.Plane(touching="b.top")},
        contacts=(pr.Contact("b.bottom", "die"), pr.Contact("b.top", "punch")),
        steps=(pr.Step("press", move={"punch": pr.Motion(y=-0.05)}, increments=1),),
    )  # fmt: skip
    found = pr.die_stress(list(pr.solve(problem))[-1], problem, "die", pr.Die(12.0, 210e3, size=1.0))
    assert found.problem.fixed["die.back"].y == "held"
    assert found.largest_mises[0] < 5.0 * found.pressure.max()
    assert found.imbalance < 1e-10


def test_symmetry_line_cuts_and_holds_the_die():
    """In a half model the section ends at the line of symmetry, which holds it."""
    problem = upsetting(space="plane stress", fixed={"billet.bottom": "y", "billet.left": "x"}, thickness=3.0)
    inc = list(pr.solve(problem))[-1]
    found = pr.die_stress(inc, problem, "die", pr.Die(20.0))
    assert found.X[:, 0].min() == pytest.approx(0.0, abs=1e-12)
    assert found.u[np.argmin(found.X[:, 0]), 0] == 0.0
    assert found.imbalance < 1e-10


def test_wear_is_a_measure_of_a_run_read_back(run):
    """Of every increment, from its tables."""
    stored = pr.results(run.directory).increments
    assert stored[-1].measure("die.wear") == pytest.approx(run.increment.measure("die.wear"), rel=1e-9)
    assert 0.0 < stored[0].measure("die.wear") < stored[1].measure("die.wear")


@pytest.mark.parametrize("where", ["measures", "until"])
def test_the_stress_of_a_die_is_no_measure_of_a_run(where):
    """It is refused before anything is solved, with the verb that has it."""
    until = pr.Until(measure={"die.die_stress": 500.0})
    step = pr.Step("press", move={"die": pr.Motion(y=-0.4)}, increments=2, until=until if where == "until" else None)
    with pytest.raises(pr.PrensaError, match="prensa die DIR --tool die"):
        problem = upsetting(steps=(step,), measures={"stress": "die.die_stress"} if where == "measures" else {})
        next(iter(pr.solve(problem)))
        pr.run(pr.Case(problem), quiet=True)


def test_wear_needs_both_numbers(last):
    """Wear is relative without numbers, in proportion to k/H with them, and says when it cannot say."""
    loads = pr.tool_loads([last[0]], last[1], "die")
    relative, real = pr.wear(loads), pr.wear(loads, 1e-5, 6000.0)
    assert real.depth == pytest.approx(1e-5 / 6000.0 * relative.depth)
    assert real.parts_until(0.05) == pytest.approx(0.05 / real.depth.max())
    for bad in (lambda: pr.wear(loads, 1e-5), lambda: pr.wear(loads, -1.0, 1.0), lambda: relative.parts_until(1.0)):
        with pytest.raises(pr.PrensaError, match=r"give|positive"):
            bad()


def test_bad_dies_are_refused(last, run):
    """Unknown tools, dies of no thickness, too short or too thick, wrong sides and increments: a line with the remedy."""
    inc, problem = last
    for tool, die, words in (
        ("dei", pr.Die(20.0), "did you mean 'die'"), ("die", pr.Die(0.0), "--thickness"),
        ("die", pr.Die(-3.0), r"thickness of its section must be greater than 0, got -3; give it, as in --thickness"),
        ("die", pr.Die(20.0, span=(0, 5)), "--span"),
        ("die", pr.Die(20.0, fixed={"top": "x"}), "--fix"), ("die", pr.Die(20.0, span=(3, 3)), "no length"),
    ):  # fmt: skip
        with pytest.raises(pr.PrensaError, match=words):
            pr.die_stress(inc, problem, tool, die)
    with pytest.raises(pr.PrensaError, match="no increment 99"):
        run.die("die", pr.Die(20.0), at=99)
    with pytest.raises(pr.PrensaError, match="FROM:TO"):
        options.asked(20.0, None, 0.3, "0-5", None, (), 0.0, None)
    with pytest.raises(pr.PrensaError, match=r"tools: 'die'"):
        pr.Case(upsetting(), output=pr.Output(wear={"dye": pr.Archard()}))


def test_records_without_forces_are_refused(last):
    """Tables of older runs have no nodal forces: the run is to be computed again."""
    inc, problem = last
    contact = inc.contacts["billet.top+billet.right-die"]
    old = replace(contact, force=np.full_like(contact.force, np.nan))
    with pytest.raises(pr.PrensaError, match="run the case again"):
        touch(problem, discretise(problem).tools[0], inc.tools["die"], old, 1.0)


def test_files_and_report(run):
    """The verb leaves tables, fields, pictures and a summary; the report shows wear and die."""
    folder, made = write_die(run, "die", pr.Die(20.0, span=(0.0, 20.0)), "largest force", pr.Archard(1e-5, 6000.0, 0.05))
    names = {p.name for p in folder.iterdir()}
    pictures = {"deflection.png", "displacement.png", "loads.png", "mises.png"}
    assert names == pictures | {"die.json", "die.vtu", "face.csv", "loads.csv"}
    assert made["imbalance"] < 1e-10
    assert made["wear"]["parts"] > 0.0
    worn = run.summary["wear"]["die"]
    assert worn["parts"] == pytest.approx(made["wear"]["parts"])
    (line,) = (text for text in run.summary["answer"] if text.startswith("wear of die"))
    assert f"{round(worn['parts'], -3):.0f} parts until 0.05 mm" in line
    from prensa.output.report import write_report

    page = write_report(run.directory).read_text(encoding="utf-8")
    assert "<h2>Dies</h2>" in page
    assert page.index(line) < page.index("<h2>")  # on the first screen
    assert "Loads and wear along the outline of die" in page
    assert "its give is not fed back" in page


def drawn(**more):
    """The die of the upsetting as a mesh: the cylinder of 20 × 20 above the billet."""
    return pr.Die(E=210e3, fixed={"top": "y"}, mesh=pr.Rectangle((20.0, 20.0), (80, 30), origin=(0.0, 7.5)), **more)


def test_a_mesh_of_ones_own_is_the_section_of_the_outline(last, tmp_path):
    """The same cylinder by offset, as a grid, and as triangles of a gmsh file: loads in balance, lift of the face to 0.5 %."""
    inc, problem = last
    offset = pr.die_stress(inc, problem, "die", pr.Die(thickness=20.0, E=210e3, span=(0.0, 20.0)))
    grid = pr.die_stress(inc, problem, "die", drawn())
    points = np.array([[x, 7.5 + y] for y in (0, 20) for x in (0, 20)])
    outline = pr.Outline(points=points[[0, 1, 3, 2]].tolist(), sides=["face", "outside", "top", "axis"], size=0.6)
    triangles = pr.die_stress(inc, problem, "die", pr.Die(E=210e3, fixed={"top": "y"}, mesh=outline))
    for found in (grid, triangles):
        assert found.imbalance < 1e-10
        assert found.load == pytest.approx(offset.load, rel=1e-12)
        for r in (0.0, 5.0, 9.0, 20.0):
            lift = [np.interp(r, f.X[:, 0], f.u[:, 1]) for f in (offset, found)]
            assert lift[1] == pytest.approx(lift[0], rel=5e-3), r


def test_meshes_that_do_not_fit_are_refused(last):
    """Elsewhere than the tool, too short, held by no side or a wrong one, with what is of a section: a line with the remedy."""
    inc, problem = last
    rectangle, above = pr.Rectangle, {"n": (8, 8), "origin": (0.0, 7.5)}
    for die, words in (
        (pr.Die(fixed={"top": "y"}, mesh=rectangle((20.0, 20.0), (8, 8))), "no side of the mesh of the die lies on its outline"),
        (pr.Die(fixed={"top": "y"}, mesh=rectangle((5.0, 20.0), **above)), "draw the side of the mesh longer"),
        (pr.Die(mesh=rectangle((20.0, 20.0), **above)), "nothing holds the mesh"),
        (pr.Die(fixed={"tip": "y"}, mesh=rectangle((20.0, 20.0), **above)), "no side 'tip'; did you mean 'top'"),
        (drawn(thickness=3.0), "leave 'thickness' out"), (drawn(back_pressure=3.0), "leave 'back_pressure' out"),
    ):  # fmt: skip
        with pytest.raises(pr.PrensaError, match=words):
            pr.die_stress(inc, problem, "die", die)


def ring_in_a_cavity(space):
    """A quarter of a ring under a pressure inside, in a round cavity: the same pressure all round."""
    return pr.Problem(
        "ring", space=space, kinematics="small", contact_geometry="reference", fixed={"b.end": "x", "b.start": "y"},
        bodies={"b": pr.Body(pr.Annulus(6.0, 10.0, (16, 6), angles=(0.0, np.pi / 2)), pr.Elastic(2e5, 0.3))},
        tools={"die": pr.Circle(10.0, at=(0.0, 0.0), concave=True)}, contacts=(pr.Contact("b.outer", "die"),),
        steps=(pr.Step("press", loads={"b.inner": pr.Load(pressure=1.0)}, increments=1),),
    )  # fmt: skip


@pytest.mark.parametrize("space", ["plane strain", "plane stress"])
def test_a_die_in_the_plane_is_lame(space):
    """A quarter of a die about a cavity, its back held: Lamé in both plane states; lines of symmetry cut it square."""
    problem, a, b, E, nu = ring_in_a_cavity(space), 10.0, 30.0, 2e5, 0.3
    found = pr.die_stress(list(pr.solve(problem))[-1], problem, "die", pr.Die(20.0, E, nu, size=0.3, fixed={"back": "xy"}))
    back = found.increment.bodies["die"].X[[np.argmax(found.increment.bodies["die"].X[:, k]) for k in (0, 1)]]
    assert np.abs(np.sort(back, axis=0)[0]).max() < 1e-9 and np.sort(back, axis=0)[1] == pytest.approx([b, b], rel=2e-4)
    # σ_r = A − B/r², u = ((1 − 2ν) A r + B/r)(1 + ν)/E, with other numbers in plane stress; σ_r(a) = −p, u(b) = 0
    f, g = ((1 + nu) * (1 - 2 * nu), 1 + nu) if space == "plane strain" else (1 - nu, 1 + nu)
    A, B = np.linalg.solve([[1.0, -1 / a**2], [f * b, g / b]], [-found.pressure.mean(), 0.0])
    assert np.hypot(*found.u.T).mean() == pytest.approx((f * A * a + g * B / a) / E, rel=1e-3)
    body = found.increment.bodies["die"]
    r, angle = np.hypot(*body.X.T), np.degrees(np.arctan2(body.X[:, 1], body.X[:, 0]))
    at = (r < a + 2e-4) & (angle > 10) & (angle < 80)
    c, s = body.X[at].T / r[at]
    xx, yy, _, xy = body.stress[at].T
    assert at.sum() > 30
    assert xx * s**2 + yy * c**2 - 2 * xy * s * c == pytest.approx(np.full(at.sum(), A + B / a**2), rel=1e-2)


@pytest.mark.parametrize(("space", "modulus"), [("plane strain", 210e3 / (1 - 0.3**2)), ("plane stress", 210e3)])
def test_a_flat_die_in_the_plane_gives_by_its_height(space, modulus):
    """Under even pressure over all of its width, free to spread: p T/E, with E/(1 − ν²) in plane strain."""
    problem = pr.Problem(
        "block", space=space, kinematics="small", contact_geometry="reference", thickness=2.0,
        bodies={"b": pr.Body(pr.Rectangle((4.0, 2.0), (4, 2)), pr.Elastic(1e3, 0.0))}, tools={"die": pr.Plane(touching="b.top")},
        contacts=(pr.Contact("b.top", "die"),), fixed={"b.bottom": "y", "b.left": "x"},
        steps=(pr.Step("press", move={"die": pr.Motion(y=-0.002)}, increments=1),),
    )  # fmt: skip
    inc = list(pr.solve(problem))[-1]
    found = pr.die_stress(inc, problem, "die", pr.Die(3.0, 210e3, 0.3, span=(0.0, 4.0), fixed={"back": "y", "start": "x"}))
    assert found.u[:, 1] == pytest.approx(np.full(len(found.u), inc.force("die").y / 8.0 * 3.0 / modulus), rel=1e-6)
    assert found.imbalance < 1e-10
