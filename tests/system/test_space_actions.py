"""What acts on bodies in space: pressure, tractions, body forces, ends of steps, feeds, tools that are removed."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.system.discretise import discretise
from prensa.system.face_loads import face_force, pressure_stiffness
from prensa.system.planning import plan_step

ELASTIC = pr.Elastic(1000.0, 0.3)
RUBBER = pr.NeoHooke(100.0, 0.3)
STEEL = pr.J2(200000.0, 0.3, pr.Swift(K=500.0, e0=0.01, n=0.2))
TIGHT = pr.Numerics(tolerance=1e-11)
LAYER = 2.5
"""Thickness of the one layer of bricks that is compared with plane strain."""


def loaded_box(**more):
    """A small box that is held at the left."""
    given = {"bodies": {"b": pr.Body(pr.Box((3.0, 1.0, 1.0), (3, 1, 1)), ELASTIC)}, "fixed": {"b.left": "xyz"},
             "steps": (pr.Step("load", increments=1),)}  # fmt: skip
    return pr.Problem("box", space="solid", **given | more)


def warped(n=3):
    """A box of n × n × n bricks whose nodes have been shaken: its faces are warped."""
    mesh = mesh_of(pr.Box((2.0, 2.0, 2.0), (n, n, n)))
    return mesh.points + np.random.default_rng(4).uniform(-0.15, 0.15, mesh.points.shape), mesh.boundary


def test_the_tangent_of_a_pressure_is_its_derivative():
    """Against central differences, on warped faces, to 1e-9 of the largest entry."""
    x, faces = warped(1)
    K, h = pressure_stiffness(x, faces, 3.0), 1e-6
    for node in range(len(x)):
        for axis in range(3):
            step = np.zeros_like(x)
            step[node, axis] = h
            slope = (face_force(x + step, faces, 3.0) - face_force(x - step, faces, 3.0)) / (2 * h)
            ours = np.zeros_like(slope)
            where = np.argwhere(faces == node)
            for face, corner in where:
                ours[face] = -K[face, :, 3 * corner + axis]
            assert np.abs(slope - ours).max() < 1e-9 * np.abs(K).max()


def test_a_pressure_all_around_is_in_balance():
    """On a closed warped surface it has neither a resultant nor a moment; a traction has its area times itself."""
    x, faces = warped()
    f = face_force(x, faces, 2.0).reshape(-1, 3)
    at = x[faces].reshape(-1, 3)
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * np.abs(f).sum()
    assert np.abs(np.cross(at, f).sum(axis=0)).max() < 1e-12 * np.abs(f).sum()
    flat = mesh_of(pr.Box((3.0, 1.0, 2.0), (3, 1, 2)))
    pulled = face_force(flat.points, flat.edges["top"], 0.0, (1.0, 2.0, 3.0)).reshape(-1, 3).sum(axis=0)
    assert pulled == pytest.approx([6.0, 12.0, 18.0])


def test_a_uniform_pressure_gives_a_uniform_stress():
    """On three sides of a box whose others are planes of symmetry: −p, and the strain −p (1 − 2ν)/E."""
    box = pr.Box((3.0, 1.0, 2.0), (3, 2, 2))
    sides = {f"b.{side}": pr.Load(pressure=6.0) for side in ("right", "top", "front")}
    *_, last = pr.solve(loaded_box(
        bodies={"b": pr.Body(box, ELASTIC)}, fixed={"b.left": "x", "b.bottom": "y", "b.back": "z"}, loads=sides,
        kinematics="small",
    ))  # fmt: skip
    body = last.bodies["b"]
    assert np.allclose(body.stress, [-6.0] * 3 + [0.0] * 3, atol=1e-9)
    assert np.allclose(body.displacement, -6.0 * 0.4 / 1000.0 * body.X, atol=1e-12)


def layer(solid, fixed, steps, **more):
    """A block of rubber in plane strain, or as a layer of bricks."""
    section = pr.Rectangle((6.0, 2.0), (6, 2))
    material = more.pop("material", RUBBER)
    mesh, element = (pr.Extrusion(section, LAYER, 1), "h8") if solid else (section, "q4")
    sides = {"b.base": "z", "b.cap": "z"} if solid else {}
    return pr.Problem(
        "layer", space="solid" if solid else "plane strain", bodies={"b": pr.Body(mesh, material, element)},
        fixed={name: pr.Fixed(**dict.fromkeys(axes, "held")) for name, axes in (fixed | sides).items()}, steps=steps, **more,
    )  # fmt: skip


def test_loads_of_a_layer_are_those_of_plane_strain():
    """A cantilever bent far by a pressure that follows it, a traction and gravity, then released: to 1e-8 per thickness."""
    ends = []
    for solid in (False, True):
        way = (0.4, -0.2, 0.0)[: 3 if solid else 2]
        steps = (
            pr.Step("load", loads={"b.top": pr.Load(pressure=0.4), "b.right": pr.Load(traction=way)}, increments=4),
            pr.Step("dead", loads={"b.top": pr.Load(pressure=0.2, follower=False)}, increments=2),
        )
        weight = {"b": (0.0, -0.05, 0.0)[: 3 if solid else 2]}
        *_, last = pr.solve(layer(solid, {"b.left": "xy"}, steps, body_force=weight), TIGHT)
        thick = LAYER if solid else 1.0
        f = last.supports["b.left"]
        ends.append([f.x / thick, f.y / thick, last.energy["elastic"] / thick, last.bodies["b"].x[:, 1].min()])
    assert np.allclose(ends[1], ends[0], rtol=1e-8)
    assert ends[0][3] < -0.8  # it has turned


def test_supports_carry_what_acts():
    """Resultants at the end: pressure, traction on a side, and weight, by statics."""
    *_, last = pr.solve(loaded_box(
        loads={"b.top": pr.Load(pressure=0.01, follower=False), "b.front": pr.Load(traction=(0.02, 0.0, 0.03))},
        body_force={"b": (0.0, -0.01, 0.005)},
    ))  # fmt: skip
    assert last.supports["b.left"] == pytest.approx((-0.06, 0.03 + 0.03, -0.09 - 0.015), rel=1e-8)
    assert last.energy["external"] == pytest.approx(last.energy["elastic"], rel=1e-2)


PRESSED = {
    "tools": {"t": pr.Plane(touching="b.top")}, "contacts": (pr.Contact("b.top", "t"),),
    "fixed": {"b.bottom": "xyz"}, "bodies": {"b": pr.Body(pr.Box((2.0, 1.0, 2.0), (2, 1, 2)), ELASTIC)},
}  # fmt: skip


@pytest.mark.parametrize(
    ("until", "reached"),
    [
        (pr.Until(force={"t": pr.ToolForce(y=100.0)}), lambda i: i.force("t").y / 100.0),
        (pr.Until(travel={"t": pr.ToolTravel(z=0.01)}), lambda i: i.tools["t"].place.z / 0.01),
        (pr.Until(energy={"t": 1.0}), lambda i: i.energy["external"]),
        (pr.Until(measure={"b.top-t.max.pressure": 40.0}), lambda i: i.measure("b.top-t.max.pressure") / 40.0),
    ],
    ids=["force", "travel", "energy", "measure"],
)
def test_a_step_ends_where_a_number_is_reached(until, reached):
    """To 1e-3, as in the plane."""
    step = pr.Step("press", move={"t": pr.Motion(y=-0.1, z=0.03)}, increments=2, until=until)
    *_, last = pr.solve(loaded_box(**PRESSED | {"steps": (step,)}))
    assert last.stopped
    assert last.time < 1.0
    assert reached(last) == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        ({"until": pr.Until(force={"t": pr.ToolForce(m=1.0)})}, "in space the force of a tool has x, y, z, mx, my, mz, not 'm'"),
        ({"loads": {"b.top": pr.Load(shear=1.0)}}, "no direction along which a shear could act"),
        ({"loads": {"b.top": pr.Load(traction=(1.0, 2.0))}}, "the traction has 3 components in solid, not 2"),
        ({"body_force": {"b": (1.0, 2.0)}}, "the body force has 3 components in solid, not 2"),
    ],
)
def test_what_the_plane_alone_has_is_refused(step, words):
    """With what to write instead."""
    with pytest.raises(pr.PrensaError, match=words):
        loaded_box(**PRESSED | {"steps": (pr.Step("s", **step),)})


def test_components_of_space_are_refused_in_the_plane():
    """Forces and feeds along z."""
    until = pr.Until(force={"t": pr.ToolForce(z=1.0)})
    feed = {"b.left": pr.Feed(z=1.0)}
    for step, words in ((pr.Step("s", until=until), "in the plane"), (pr.Step("s", feed=feed), "'z' is an")):
        with pytest.raises(pr.PrensaError, match=words):
            layer(False, {}, (step,), tools={"t": pr.Plane(touching="b.top")})


def test_a_layer_springs_back_as_in_plane_strain():
    """Tools removed after a roll has pressed: what stays elastic per thickness to 1e-7, though other points are held."""
    left = []
    for solid in (False, True):
        at = (2.0, 0.0, 0.0)[: 3 if solid else 2]
        tool = pr.Extruded(pr.Circle(3.0), touching="b.top", at=at) if solid else pr.Circle(3.0, touching="b.top", at=at)
        table = pr.Plane(touching="b.bottom", normal=(0.0, 1.0, 0.0)[: 3 if solid else 2])
        press = pr.Step("press", move={"t": pr.Motion(y=-0.2)}, increments=4)
        steps = (press, pr.Step("off", remove_tools=True, increments=1))
        problem = layer(
            solid, {}, steps, material=STEEL, tools={"t": tool, "table": table}, friction=pr.Coulomb(0.2),
            contacts=(pr.Contact("b.top", "t"), pr.Contact("b.bottom", "table")),
        )  # fmt: skip
        *_, last = pr.solve(problem, TIGHT)
        left.append(last.energy["elastic"] / (LAYER if solid else 1.0))
        assert np.abs(last.bodies["b"].reaction[:, :2]).max() < 1e-3
    assert left[1] == pytest.approx(left[0], rel=1e-7)


def test_a_free_body_is_held_at_six_components():
    """Of a body that nothing holds any more: six, and their motions of the body are independent."""
    problem = loaded_box(**PRESSED | {"fixed": {}, "steps": (pr.Step("off", remove_tools=True),)})
    system = discretise(problem)
    plan = plan_step(system, 0, np.zeros(system.ndof))
    held = np.concatenate([g.dofs for g in plan.groups if g.found])
    assert len(held) == 6
    nodes, axes = held // 3, held % 3
    rows = np.hstack([np.eye(3)[axes], np.cross(system.X[nodes], np.eye(3)[axes])])
    assert np.linalg.matrix_rank(rows) == 6


def test_a_slab_is_fed_to_a_roll():
    """It is pushed under the roll, which is felt, and then free: nothing holds the end that was pushed."""
    roll = pr.Extruded(pr.Circle(20.0), at=(6.0, 21.85, 0.0))
    step = pr.Step("rest", move={"roll": pr.Motion(y=0.01)}, increments=1)
    *_, fed, last = pr.solve(loaded_box(
        bodies={"b": pr.Body(pr.Box((6.0, 2.0, 1.0), (6, 1, 1)), ELASTIC)}, fixed={"b.bottom": "y", "b.back": "z"},
        tools={"roll": roll}, contacts=(pr.Contact("b.top", "roll"),), friction=pr.Coulomb(0.3),
        steps=(pr.Step("bite", feed={"b.left": pr.Feed(x=2.0)}, increments=4), step),
    ))  # fmt: skip
    assert fed.supports["b.left"].x > 1.0
    assert fed.force("roll").x == pytest.approx(fed.supports["b.left"].x, rel=1e-6)
    assert fed.bodies["b"].displacement[:, 0].max() == pytest.approx(2.0, abs=0.1)
    assert abs(last.supports["b.left"].x) < 1e-6 * fed.supports["b.left"].x


def test_an_arch_snaps_as_in_plane_strain():
    """Carried over its limit point by viscous forces: their work, and where it ends, to 1e-6 per thickness."""
    ends = []
    section = pr.Annulus(inner=20.0, outer=20.5, n=(8, 1), angles=(np.radians(70.0), np.pi / 2))
    for solid in (False, True):
        mesh, element = (pr.Extrusion(section, LAYER, 1), "h8") if solid else (section, "q4")
        sides = {"b.base": "z", "b.cap": "z"} if solid else {}
        *_, last = pr.solve(pr.Problem(
            "arch", space="solid" if solid else "plane strain", bodies={"b": pr.Body(mesh, pr.NeoHooke(1000.0, 0.3), element)},
            fixed={"b.start": "xy", "b.end": "x", **sides}, loads={"b.outer": pr.Load(pressure=2.0, follower=False)},
            stabilise="auto", steps=(pr.Step("s"),),
        ))  # fmt: skip
        thick = LAYER if solid else 1.0
        down = last.bodies["b"].displacement[:, 1].min()
        ends.append([last.supports["b.start"].x / thick, last.energy["viscous"] / thick, down])
    assert np.allclose(ends[1], ends[0], rtol=1e-6)
    assert ends[0][2] < -2.5


def rolled(*steps, **more):
    """A ball pressed into a corner of a block of steel."""
    tools = {"t": pr.Revolved(pr.Circle(3.0), touching="b.top", at=(2.0, 0.0, 1.0), press=more.pop("press", None))}
    bodies = {"b": pr.Body(pr.Box((4.0, 2.0, 3.0), (4, 2, 3)), STEEL)}
    given = {"tools": tools, "bodies": bodies, "fixed": {"b.bottom": "xyz"}, "friction": pr.Coulomb(0.2), "steps": steps}
    return loaded_box(**PRESSED | given | more)


PRESS = pr.Step("press", move={"t": pr.Motion(y=-0.3)}, increments=2)


def test_a_case_starts_where_a_run_ended(tmp_path):
    """A second case goes on from the first as a second step does, bit for bit."""
    on = pr.Step("on", by={"t": pr.Motion(x=0.1, y=-0.05)}, increments=1)
    *_, whole = pr.solve(rolled(PRESS, on))
    pr.run(pr.Case(rolled(PRESS), output=pr.Output(pictures=False, report=False, fields=0)), tmp_path / "a", quiet=True)
    *_, again = pr.solve(rolled(on, start=pr.Start(str(tmp_path / "a"))))
    assert again.force("t") == whole.force("t")
    assert again.energy == whole.energy
    assert np.array_equal(again.bodies["b"].x, whole.bodies["b"].x)


def test_a_press_bears_the_whole_part():
    """Of a quarter four times the force; a step ends at its capacity; a crank drives along any axis of space."""
    press = pr.Press(8000.0, mirror=("left", "back"))
    step = pr.Step("press", move={"t": pr.Motion(y=-0.3)}, increments=3, until=pr.Until(press="t"))
    *_, last = pr.solve(rolled(step, press=press))
    assert last.force("t").y == pytest.approx(2000.0, rel=1e-3)
    assert last.measure("t.press_utilisation") == pytest.approx(1.0, rel=1e-3)
    crank = pr.Crank(stroke=10.0, height=0.2, toward="front")
    table = {"t": pr.Plane(normal=(0.0, 0.0, 1.0), at=(0.0, 0.0, -0.1))}
    contacts, turn = (pr.Contact("b.back", "t"),), pr.Step("turn", crank={"t": crank}, increments=3)
    *_, last = pr.solve(rolled(turn, tools=table, contacts=contacts, fixed={"b.bottom": "y", "b.front": "z", "b.left": "x"}))
    assert last.tools["t"].place.z == pytest.approx(0.2)
    assert last.force("t").z < -100.0


def test_sides_of_presses_in_space_are_refused_in_the_plane():
    """Mirrors and cranks along z."""
    for more, words in (
        ({"tools": {"t": pr.Plane(touching="b.top", press=pr.Press(10.0, mirror="back"))}}, "are sides of 'space: solid'"),
        ({"steps": (pr.Step("s", crank={"t": pr.Crank(stroke=1.0, height=0.5, toward="back")}),)}, "direction of 'space: solid'"),
    ):
        given = {"tools": {"t": pr.Plane(touching="b.top")}} | more
        steps = given.pop("steps", (pr.Step("s", move={"t": pr.Motion(y=-0.1)}),))
        with pytest.raises(pr.PrensaError, match=words):
            layer(False, {}, steps, **given)
