"""Tools that turn in space, prescribed, pushed and on springs: identities, what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.contact.pairing import rotation, rotation_vector
from prensa.model.schema import loads
from prensa.output.answer import peaks
from prensa.output.whole import shares_of
from prensa.system.state import State

RUBBER = pr.NeoHooke(1000.0, 0.3)
TIGHT = pr.Numerics(tolerance=1e-12)
ROUND = ("rx", "ry", "rz")


def about(axis, angle):
    """The motion that turns about an axis (3,) by an angle."""
    return pr.Motion(**dict(zip(ROUND, (angle * np.array(axis)).tolist())))


# ------------------------------------------------------------------------------------------------------- turned together
SLANTED = (0.5, np.sqrt(0.75), 0.0)  # at 30 degrees to y
SIXTH = np.pi / 3


@pytest.fixture(scope="module")
def between_plates():
    """A free cube that friction holds between two plates, which are turned about an axis at 30° to their normals."""

    def plate(y):
        ends = ((-10.0 * np.sign(y), 0.9 * y), (10.0 * np.sign(y), 0.9 * y))
        # moved by 0.1 the reference points of both plates are at the origin
        return pr.Extruded(pr.Profile(points=ends), at=(0.0, 0.1 * y, 0.0))

    problem = pr.Problem(
        "plates", space="solid", friction=pr.Coulomb(0.5),
        bodies={"b": pr.Body(pr.Box((2.0, 2.0, 2.0), (1, 1, 2), origin=(-1.0, -1.0, -1.0)), RUBBER)},
        tools={"top": plate(1.0), "bottom": plate(-1.0)},
        contacts=(pr.Contact("b.top", "top"), pr.Contact("b.bottom", "bottom")),
        fixed={"b.left": "x", "b.back": "z"},
        steps=(
            pr.Step("press", move={"top": pr.Motion(y=-0.1), "bottom": pr.Motion(y=0.1)}, increments=1),
            pr.Step("free", fixed={"b.left": "free", "b.back": "free"}, increments=1),
            pr.Step("settle", increments=5),  # areas of contact points follow the shape, an increment later each
            *(pr.Step(f"turn {k}", by={t: about(SLANTED, SIXTH) for t in ("top", "bottom")}, increments=1) for k in range(6)),
        ),
    )  # fmt: skip
    return list(pr.solve(problem, TIGHT))


def test_body_and_tools_turned_together_keep_their_forces(between_plates):
    """Through 360°: forces, moments and stresses turn along, without slip, to 1e-9."""
    before, *turned = between_plates[6:]
    force, moment = np.split(np.array(before.force("top")), 2)
    assert force[1] > 100.0
    strength = before.bodies["b"].mises.max()
    for k, inc in enumerate(turned, 1):
        Q = rotation(k * SIXTH * np.array(SLANTED))
        f = np.array(inc.force("top"))
        assert np.abs(f[:3] - Q @ force).max() < 1e-9 * force[1]
        assert np.abs(f[3:] - Q @ moment).max() < 1e-9 * force[1]
        assert np.abs(np.array(inc.force("bottom"))[:3] + f[:3]).max() < 1e-9 * force[1]
        assert np.allclose(inc.tools["top"].place[3:], k * SIXTH * np.array(SLANTED), rtol=1e-12)
        assert np.allclose(inc.bodies["b"].x, before.bodies["b"].x @ Q.T, atol=1e-9)
        assert inc.bodies["b"].mises.max() == pytest.approx(strength, rel=1e-9)
        for name, contact in inc.contacts.items():
            assert np.array_equal(contact.slip, before.contacts[name].slip)
        assert inc.energy["friction"] == before.energy["friction"]
        assert inc.tools["top"].work + inc.tools["bottom"].work == pytest.approx(0.0, abs=1e-9)
    assert len(turned) == 6


# -------------------------------------------------------------------------------------------------- turns after one another
def in_the_air(*steps, spring=None):
    """A tool that touches nothing, beside a brick."""
    return pr.Problem(
        "air", space="solid", bodies={"b": pr.Body(pr.Box((1.0, 1.0, 1.0), (1, 1, 1)), RUBBER)}, fixed={"b.bottom": "xyz"},
        tools={"t": pr.Sphere(radius=1.0, at=(0.0, 9.0, 0.0), spring=spring)}, contacts=(pr.Contact("b.top", "t"),), steps=steps,
    )  # fmt: skip


@pytest.mark.parametrize("increments", [1, 3])
def test_turns_of_steps_come_one_after_the_other(increments):
    """Each step turns about one axis in space from where it begins, whatever its increments; angles of any size add up."""
    quarter = 0.5 * np.pi
    problem = in_the_air(
        pr.Step("tilt", move={"t": pr.Motion(rx=quarter)}, increments=increments),
        pr.Step("both", by={"t": pr.Motion(ry=0.3, rz=-0.4)}, increments=increments),
        pr.Step("far", velocity={"t": pr.Motion(ry=5 * np.pi)}, duration=2.0, increments=increments),
        pr.Step("back", move={"t": pr.Motion(ry=((3.0, 10 * np.pi + 0.3), (4.0, 10 * np.pi)))}, increments=increments),
    )
    ends = [inc for inc in pr.solve(problem) if inc.end_of_step]
    system = pr.discretise(problem)
    Q = np.eye(3)
    turns = [(quarter, 0.0, 0.0), (0.0, 0.3, -0.4), (0.0, 10 * np.pi, 0.0), (0.0, -0.3, 0.0)]
    for inc, turn in zip(ends, turns, strict=True):
        Q = rotation(np.array(turn)) @ Q
        place = system.tool_masters["t"].place(inc.state.u)
        assert np.allclose(rotation(place[3:]), Q, atol=1e-12)
    assert np.allclose(inc.tools["t"].place[3:], (quarter, 10 * np.pi, -0.4), rtol=1e-14)


def test_rotation_vectors_are_those_of_rotations():
    """Of any angle up to many turns, next to what is asked for."""
    rng = np.random.default_rng(0)
    for size in (0.0, 1e-9, 1.0, 3.1, 9.0, 40.0):
        turn = rng.normal(size=3)
        turn *= size / np.linalg.norm(turn)
        assert np.allclose(rotation_vector(rotation(turn), turn), turn, atol=1e-7 if 3.0 < size < 3.2 else 1e-12)


# ------------------------------------------------------------------------------------------------- forces, moments, springs
ALL_SIX = {"x": 0.02, "y": -0.06, "z": 0.01, "rx": 0.01, "ry": -0.03, "rz": 0.02}


def under_a_plane(step, spring=None):
    """A block under a plane that it sticks to, in one increment."""
    return pr.Problem(
        "six", space="solid", friction=pr.Coulomb(2.0), bodies={"b": pr.Body(pr.Box((2.0, 1.0, 2.0), (2, 1, 2)), RUBBER)},
        tools={"t": pr.Plane(touching="b.top", at=(1.2, 0.0, 0.9), spring=spring)}, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.bottom": "xyz"}, steps=(pr.Step("s", increments=1, **step),),
    )  # fmt: skip


@pytest.fixture(scope="module")
def moved():
    """The plane moved along all six ways."""
    (inc,) = pr.solve(under_a_plane({"move": {"t": pr.Motion(**ALL_SIX)}}), TIGHT)
    return inc


@pytest.mark.parametrize("free", [("y",), ("x", "y", "z"), ("y", "rx", "rz"), tuple(ALL_SIX)], ids="-".join)
def test_what_moves_a_tool_pushes_it_there(moved, free):
    """Forces and moments of a moved tool, given as a push of these motions, bring it to the same place."""
    force = dict(zip(ALL_SIX, moved.force("t")))
    push = {(k if len(k) == 1 else "m" + k[1]): -force[k] for k in free}
    rest = {k: v for k, v in ALL_SIX.items() if k not in free}
    (inc,) = pr.solve(under_a_plane({"push": {"t": pr.Push(**push)}, "move": {"t": pr.Motion(**rest)}}), TIGHT)
    assert np.allclose(inc.tools["t"].place, list(ALL_SIX.values()), atol=1e-9)
    assert np.allclose(inc.force("t"), moved.force("t"), rtol=1e-8, atol=1e-8 * abs(force["y"]))


def test_springs_carry_what_they_are_stretched_by(moved):
    """Mounts moved so far that the tool goes the same way: spring forces are stiffness times stretch, and the tool's force."""
    force, k = dict(zip(ALL_SIX, moved.force("t"))), {"x": 2e3, "y": 5e3, "z": 3e3, "rx": 4e3, "ry": 6e3, "rz": 7e3}
    mount = {m: ALL_SIX[m] - force[m] / k[m] for m in ALL_SIX}
    (inc,) = pr.solve(under_a_plane({"move": {"t": pr.Motion(**mount)}}, pr.Springs(**k)), TIGHT)
    state = inc.tools["t"]
    assert np.allclose(state.place, list(ALL_SIX.values()), atol=1e-9)
    assert np.allclose(state.spring, [k[m] * (mount[m] - ALL_SIX[m]) for m in ALL_SIX], rtol=1e-7, atol=1e-6)
    assert np.allclose(np.array(state.spring) + state.force, 0.0, atol=1e-8 * abs(force["y"]))


BALL = """
name: ball
space: solid
bodies:
  block:
    mesh: {type: box, size: [4, 2, 4], n: [4, 2, 4]}
    material: {type: neo_hooke, E: 1000, nu: 0.3}
tools:
  ball: {type: sphere, radius: 5, touching: block.top, at: [2, 0, 2]}
contacts: [{surface: block.top, against: ball, friction: {mu: 0.3}}]
fixed: {block.bottom: xyz}
steps:
- {name: press, push: {ball: {y: -200, mz: 0}}, increments: 2}
- {name: roll, by: {ball: {x: 0.5}}, push: {ball: {y: -200, mx: 0, mz: 0}}, increments: 3}
- {name: twist, by: {ball: {ry: 10 deg}}, push: {ball: {y: -200, mx: 0, mz: 0}}, increments: 2}
output: {mirror: [bottom]}
"""


def test_a_free_ball_rolls():
    """It turns by way over radius, hardly resists, bears its push and no moment; continued from arrays the bits are the same."""
    problem = loads(BALL).problem
    increments = list(pr.solve(problem))
    for inc in increments[1:]:
        assert inc.force("ball").y == pytest.approx(200.0, rel=1e-6)
        assert abs(inc.force("ball").mz) < 1e-4
    rolled = increments[4]
    assert rolled.tools["ball"].place.rz == pytest.approx(-0.1, abs=0.003)
    assert abs(rolled.force("ball").x) < 0.03 * 200.0
    assert increments[-1].force("ball").my < -1.0
    again = State.from_arrays(increments[3].state.arrays())
    rest = [inc.state for inc in pr.solve(problem, start=again)]
    assert len(rest) == 3
    for a, b in zip(rest, (inc.state for inc in increments[4:]), strict=True):
        x, y = a.arrays(), b.arrays()
        assert all(x[k].tobytes() == y[k].tobytes() for k in x)


@pytest.mark.parametrize(("mirror", "whole"), [([], 1), (["back"], 2), (["back", "bottom"], 2), (["left"], 1)])
def test_the_moment_of_the_whole_part(mirror, whole):
    """Mirrors across the axis of a turn double the moment about it; those along it show another tool."""
    text = BALL.replace("at: [2, 0, 2]", "at: [2, 0, 0]")  # centred on the back plane
    case = loads(text[: text.index("- {name: press")] + "- {name: turn, by: {ball: {rz: 0.2}}}\n")
    columns = [f"ball.{c}" for c in ("ux", "uy", "uz", *ROUND, "fx", "fy", "fz", "mx", "my", "mz")]
    table = {c: np.zeros(2) for c in columns} | {"time": np.array([0.5, 1.0]), "step": np.array(["a", "a"])}
    table |= {"ball.rz": np.array([0.1, 0.2]), "ball.mz": np.array([3.0, 5.0]), "increment": np.array([1, 2])}
    case = replace(case, output=replace(case.output, mirror=tuple(mirror)))
    shares = shares_of(pr.discretise(case.problem), case)
    (peak,) = peaks(table, case, {tool: share._asdict() for tool, share in shares.items()})
    assert (peak.what, peak.axis, peak.value, peak.whole) == ("moment", "rz", 5.0, whole)


# ----------------------------------------------------------------------------------------------------------- what is refused
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mz: 0}}, increments: 2}", "m: 0}}, increments: 2}", "write 'mx', 'my' or 'mz'"),
        ("{ball: {x: 0.5}}", "{ball: {x: 0.5, rz: 1}}", "rz of tool 'ball' is given by 'by' and by 'push'; keep one"),
        ("by: {ball: {x: 0.5}}", "by: {block.bottom: {rx: 0.5}}", "is a boundary, which has no rotation"),
        ("at: [2, 0, 2]}", "at: [2, 0, 2], spring: {rz: 5}}", "rz of tool 'ball' is mounted on a spring"),
        ("solid", "plane strain", "'mz' turns a tool about an axis of 'space: solid'; write 'x', 'y' or 'm'"),
        ("solid", "plane strain", "'ry' turns a tool about an axis of 'space: solid'; write 'x', 'y' or 'rz'"),
    ],
)
def test_motions_of_another_space_are_refused(old, new, words):
    """With the line and what to write instead."""
    text = BALL.replace(old, new, 1)
    if new == "plane strain":  # of bricks there the mesh alone is reported, which is the cause
        text = text.replace("box, size: [4, 2, 4], n: [4, 2, 4]", "rectangle, size: [4, 2], n: [4, 2]")
    with pytest.raises(pr.CaseError, match=words):
        loads(text)


def test_a_turn_in_degrees_is_warned_of():
    """In space as in the plane."""
    from prensa.checks.before.preflight import preflight

    found = preflight(pr.discretise(in_the_air(pr.Step("s", move={"t": pr.Motion(rx=90.0)}))))
    assert any("for degrees write '90 deg'" in f.message for f in found)


def test_a_tool_does_not_turn_through_a_body_in_one_increment():
    """A wall that half a turn takes through a block is cut to shorter increments, and pushes it."""
    from prensa.checks.during.acceptance import turned_through

    corners = ((-4.0, 0.0), (4.0, 0.0), (4.0, 1.2), (-4.0, 1.2))
    problem = pr.Problem(
        "wall", space="solid", bodies={"b": pr.Body(pr.Box((1.0, 1.0, 1.0), (1, 2, 1), origin=(2.0, 0.0, 0.0)), RUBBER)},
        tools={"t": pr.Extruded(pr.Polygon(points=corners, fillet=0.1), axis=(0.0, 0.0, 1.0), at=(0.0, 3.0, 0.0))},
        contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"}, steps=(pr.Step("s"),),
    )  # fmt: skip
    system = pr.discretise(problem)
    state = system.initial()
    u = state.u.copy()
    u[system.dofs.tool.dofs(0)[5]] = -np.pi
    found = turned_through(system, state, u)
    assert found is not None
    assert found.angle == pytest.approx(np.pi)
    u[system.dofs.tool.dofs(0)[5]] = -0.2
    assert turned_through(system, state, u) is None
