"""Motion of tools: turned, driven by a moment, on springs, free; several on one body, one on several bodies."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.errors import CaseError, SolveError
from prensa.model.schema import loads
from prensa.system.discretise import discretise
from prensa.verify.balance import Balance, imbalance
from problems import pressed_block

ELASTIC = pr.Elastic(1000.0, 0.3)


def block(origin=(0.0, 0.0), size=(6.0, 2.0), n=(12, 4)):
    return pr.Body(pr.Rectangle(size=size, n=n, origin=origin), ELASTIC)


def pressed(tool, steps, *, kinematics="finite", friction=None, **more):
    return pressed_block(
        *steps, tools={"tool": tool}, size=(6.0, 2.0), n=(12, 4), body="block", friction=friction, kinematics=kinematics,
        allow_large_strain=kinematics == "small", **more,
    )  # fmt: skip


def last(p):
    *_, inc = pr.solve(p)
    return inc


FACE = ((-1.5, 2.0), (-1.5, 0.0), (1.5, 0.0), (1.5, 2.0))


# ------------------------------------------------------------------------------------------------------------- springs
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_a_punch_on_a_spring_is_one_on_a_stiff_mount_and_a_spring_in_series(kinematics):
    """Mount displacement = punch displacement + F/k to 1e-9, the punch feels as if moved there, and the energy balance closes."""
    k = 700.0
    tool = pr.Circle(radius=5.0, at=(3.0, 0.0), touching="block.top")
    steps = [pr.Step("down", move={"tool": {"y": -0.3}}, increments=8)]
    sprung = pr.Circle(radius=5.0, at=(3.0, 0.0), touching="block.top", spring=pr.Springs(y=k))
    history = list(pr.solve(pressed(sprung, steps, kinematics=kinematics)))
    for inc in history:
        F, y = inc.force("tool").y, inc.tools["tool"].place.y
        assert -0.3 * inc.time == pytest.approx(y - F / k, rel=1e-9)
        assert inc.tools["tool"].spring.y == pytest.approx(-F, rel=1e-9)
        assert inc.tools["tool"].spring.x == 0.0
    direct = last(pressed(tool, [pr.Step("down", move={"tool": {"y": y}}, increments=8)], kinematics=kinematics))
    assert direct.force("tool").y == pytest.approx(F, rel=1e-3)  # other increments, other tributary areas
    # the spring holds F²/2k of what the mount has put in
    assert inc.energy["elastic"] - direct.energy["elastic"] == pytest.approx(F**2 / (2 * k), rel=5e-3)
    coarse = last(pressed(sprung, [pr.Step("down", move={"tool": {"y": -0.3}}, increments=4)], kinematics=kinematics))
    part = [abs(i.energy["imbalance"]) / i.energy["external"] for i in (coarse, inc)]
    assert part[1] < 0.01
    assert part[1] < 0.7 * part[0]


def test_the_energy_balance_of_springs_alone_is_exact():
    """A tool on three springs that meets nothing follows its mount; one that has pressed and is drawn back stores nothing."""
    far = pr.Circle(radius=1.0, at=(3.0, 30.0), spring=pr.Springs(x=10.0, y=20.0, rz=5.0))
    inc = last(pressed(far, [pr.Step("go", move={"tool": {"x": 1.0, "y": 2.0, "rz": 0.5}}, increments=2)]))
    assert tuple(inc.tools["tool"].place) == pytest.approx((1.0, 2.0, 0.5), rel=1e-12)
    assert abs(inc.energy["imbalance"]) <= 1e-12
    back = [
        pr.Step("down", move={"tool": {"y": -0.2}}, increments=3),
        pr.Step("wait", increments=1),
        pr.Step("up", velocity={"tool": {"y": 0.4}}, increments=4),
    ]
    tool = pr.Circle(radius=5.0, at=(3.0, 0.0), touching="block.top", spring=pr.Springs(y=500.0))
    history = list(pr.solve(pressed(tool, back)))
    waiting = [i for i in history if i.step == "wait"][-1]
    # the same but for tributary areas, which are those of the configuration before
    assert waiting.force("tool").y == pytest.approx(history[2].force("tool").y, rel=1e-4)
    assert history[-1].tools["tool"].place.y == pytest.approx(0.2, rel=1e-9)
    assert abs(history[-1].energy["elastic"]) <= 1e-9 * history[2].energy["elastic"]


def test_springs_are_in_the_history_and_in_the_balance(tmp_path):
    """A column per spring in ``history.csv``, the force of the tool with the other sign; forces and moments balance."""
    tool = pr.Profile(
        points=FACE, fillet=0.4, at=(3.2, 0.0), touching="block.top", spring=pr.Springs(y=900.0, rz=400.0)
    )
    steps = [pr.Step("down", move={"tool": {"y": -0.2, "rz": 0.02}}, increments=2)]
    problem = pressed(tool, steps, friction=pr.Coulomb(0.2))
    balance = Balance()
    for _ in balance.watch(problem):
        pass
    assert balance.force <= 1e-8
    assert balance.moment <= 1e-8
    from prensa.output.history import history_columns, history_row

    inc = last(problem)
    row = dict(zip(history_columns(problem), history_row(problem, inc), strict=True))
    assert "tool.spring.fx" not in row
    assert row["tool.spring.fy"] == pytest.approx(-row["tool.fy"], rel=1e-8)
    assert row["tool.spring.mz"] == pytest.approx(-row["tool.mz"], rel=1e-6)
    assert row["tool.spring.mz"] == pytest.approx(400.0 * (0.02 - row["tool.rz"]), rel=1e-8)


# -------------------------------------------------------------------------------------------------- turns and moments
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_turning_and_a_moment_are_inverse(kinematics):
    """A tool turned by θ feels M; driven by −M it turns by θ: to 1e-7 in small strain, 1e-3 in finite (other areas)."""
    tool = pr.Profile(points=FACE, fillet=0.4, at=(3.0, 0.0), touching="block.top")
    down = pr.Step("down", move={"tool": {"y": -0.2}}, increments=2)
    turned = last(
        pressed(tool, [down, pr.Step("turn", move={"tool": {"rz": 0.05}}, increments=4)], kinematics=kinematics)
    )
    M = turned.force("tool").m
    assert abs(M) > 1.0
    free = [down, pr.Step("torque", push={"tool": {"m": -M}}, increments=4)]
    driven = last(pressed(tool, free, kinematics=kinematics))
    assert driven.tools["tool"].place.rz == pytest.approx(0.05, rel=1e-7 if kinematics == "small" else 1e-3)
    assert driven.force("tool").m == pytest.approx(M, rel=1e-9)


def test_a_driven_roll_is_braked_by_friction():
    """Below μ R F a moment turns a roll elastically; beyond it the roll spins and the solution stops with its name."""
    roll = pr.Circle(radius=4.0, at=(3.0, 0.0), touching="block.top")
    down = pr.Step("down", move={"tool": {"y": -0.1}}, increments=2)

    def torque(m):
        return pressed(roll, [down, pr.Step("torque", push={"tool": {"m": m}}, increments=4)], friction=pr.Coulomb(0.2))

    inc = last(torque(1.0))
    limit = 0.2 * 4.0 * inc.force("tool").y
    assert limit > 2.0
    assert abs(inc.tools["tool"].place.rz) < 1e-2
    assert inc.force("tool").m == pytest.approx(-1.0, rel=1e-8)
    with pytest.raises(SolveError, match=r"tool 'tool' is free to move without resistance \(to turn\)"):
        last(torque(1.5 * limit))


def test_a_lever_driven_by_a_moment_alone_comes_to_rest_on_the_body():
    """A hinged lever that touches nothing is turned until it does; its moment is then that of the nodal forces."""
    lever = pr.Profile(points=((-0.3, 6.0), (-0.3, 0.0), (6.0, 0.0), (6.0, 6.0)), fillet=0.2, at=(-1.0, 2.3))
    notes = []
    p = pressed(lever, [pr.Step("torque", push={"tool": {"m": -20.0}}, increments=3)])
    *_, inc = pr.solve(p, monitor=lambda e: notes.append(e.message) if e.event == "note" else None)
    assert any("moved into contact" in n for n in notes)
    assert inc.force("tool").m == pytest.approx(20.0, rel=1e-9)
    assert inc.tools["tool"].place.rz < -0.01
    with pytest.raises(SolveError, match="turned counter-clockwise by a moment but touches nothing"):
        last(pressed(pr.Circle(radius=1.0, at=(3.0, 9.0)), [pr.Step("t", push={"tool": {"m": 1.0}}, increments=1)]))


def test_a_free_turn_lets_a_plate_lie_flat():
    """A plate that is free to turn (m: 0) lies flat on a tilted load path: no moment, and parallel to the face."""
    plate = pr.Plane(normal=(0.02, -1.0), at=(3.0, 2.0))
    p = pressed(plate, [pr.Step("push", push={"tool": {"y": -60.0, "m": 0.0}}, increments=3)])
    inc = last(p)
    assert inc.force("tool").m == pytest.approx(0.0, abs=1e-8 * 60.0 * 6.0)
    # symmetric block, load through the middle: the face turns back to horizontal
    assert inc.tools["tool"].place.rz == pytest.approx(-np.arctan(0.02), abs=2e-4)


def test_a_tool_with_nothing_to_hold_it_is_named():
    """Free to move and touching nothing: singular, and the message says that a tool may be the one."""
    p = pressed(pr.Circle(radius=1.0, at=(3.0, 9.0)), [pr.Step("free", push={"tool": {"x": 0.0}}, increments=1)])
    with pytest.raises(SolveError, match=r"free to move without resistance|'tool'"):
        last(p)


def test_automatic_increments_know_that_a_turn_is_a_motion():
    """Without a number of increments a tool does not turn by more than a third of an element at its far end at once."""
    plate = pr.Plane(normal=(0.0, -1.0), at=(-1.0, 2.001))
    p = pressed(plate, [pr.Step("turn", move={"tool": {"rz": -0.1}})])
    angles = [0.0, *(inc.tools["tool"].place.rz for inc in pr.solve(p))]
    assert np.abs(np.diff(angles)).max() * 7.5 <= 0.3 * 0.5 + 1e-12


# ------------------------------------------------------------------------------------------- several tools, several bodies
def two_blocks(friction=None):
    """Two blocks under one bar on a spring, and a second tool on the first block, which has two contacts."""
    bar = pr.Profile(points=((-1.0, 3.0), (-1.0, 0.0), (15.0, 0.0), (15.0, 3.0)), fillet=0.3, at=(0.0, 2.0),
                     spring=pr.Springs(y=3000.0, rz=2e5))  # fmt: skip
    return pr.Problem(
        "two", bodies={"left": block(), "right": block(origin=(8.0, -0.1), size=(6.0, 2.1))},
        tools={"bar": bar, "pin": pr.Circle(radius=1.5, at=(-1.6, 1.0))},
        contacts=[pr.Contact("left.top", "bar"), pr.Contact(["right.top", "right.right"], "bar"), pr.Contact("left.left", "pin")],
        friction=friction, fixed={"left.bottom": "xy", "right.bottom": "xy"},
        steps=[pr.Step("down", move={"bar": {"y": -0.3}, "pin": {"x": 0.3}}, increments=3)],
    )  # fmt: skip


def test_one_tool_on_two_bodies_and_two_tools_on_one():
    """The bar's force is the sum over both blocks, its pattern holds both, all balances and the energy balance closes."""
    system = discretise(two_blocks(pr.Coulomb(0.1)))
    for inc in pr.solve(system):
        force, moment = imbalance(system, inc)
        assert force <= 1e-8
        assert moment <= 1e-8
    left, right = inc.contacts["left.top-bar"], inc.contacts["right.top+right.right-bar"]
    assert left.force[:, 1].sum() < 0
    assert right.force[:, 1].sum() < 0
    assert inc.force("bar").y == pytest.approx(-left.force[:, 1].sum() - right.force[:, 1].sum(), rel=1e-12)
    assert inc.force("pin").x < 0
    assert abs(inc.energy["imbalance"]) < 0.05 * inc.energy["external"]
    # the rows of a tool hold all its candidate nodes, and no others
    for t, name in enumerate(("bar", "pin")):
        dof = system.tool_dof(t)
        rows = system.pattern.indices[system.pattern.indptr[dof] : system.pattern.indptr[dof + 1]]
        nodes = np.unique(rows[rows < 2 * system.nodes] // 2)
        mine = np.concatenate([s.points.nodes for s in system.surfaces if s.against == name])
        assert np.array_equal(nodes, np.unique(mine))


def test_two_tools_on_one_surface_share_it():
    """Two punches side by side on one boundary: each as alone when far apart, to 5 %, and mirror images to 1e-8."""

    def punches(*names):
        at = {"a": 4.0, "b": 16.0}
        return pressed_block(
            pr.Step("down", move={n: {"y": -0.1} for n in names}, increments=2), size=(20.0, 2.0), n=(40, 4), body="block",
            tools={n: pr.Circle(radius=3.0, at=(at[n], 0.0), touching="block.top") for n in names},
        )  # fmt: skip

    both, alone = last(punches("a", "b")), last(punches("a"))
    assert both.force("a").y == pytest.approx(both.force("b").y, rel=1e-8)
    assert both.force("a").x == pytest.approx(-both.force("b").x, abs=1e-8 * both.force("a").y)
    assert both.force("a").y == pytest.approx(alone.force("a").y, rel=0.05)


# --------------------------------------------------------------------------------------------------------------- units
CASE = """
name: push
thickness: 4
space: plane strain
bodies: {block: {mesh: {type: rectangle, size: [6, 2], n: [6, 2]}, material: {type: elastic, E: 1e3, nu: 0.3}}}
tools: {punch: {type: plane, touching: block.top}}
contacts: [{surface: block.top, against: punch}]
fixed: {block.bottom: xy}
steps: [{name: push, push: {punch: {y: -35 N/mm}}}]
"""


def test_a_push_is_of_the_whole_thickness_or_per_length_of_it():
    """Plain numbers and '140 N' are forces on the whole thickness; '35 N/mm' is times the thickness; also for moments."""
    for text, value in (("-35 N/mm", -140.0), ("-140 N", -140.0), ("-140", -140.0), ("-0.035 kN/mm", -140.0)):
        push = loads(CASE.replace("-35 N/mm", text)).problem.steps[0].push["punch"]
        assert push.y == pytest.approx(value, rel=1e-12)
    push = loads(CASE.replace("{y: -35 N/mm}", "{m: 2 N*mm/mm, y: 0}")).problem.steps[0].push["punch"]
    assert push.m == pytest.approx(8.0)
    with pytest.raises(CaseError, match=r"is not a force"):
        loads(CASE.replace("plane strain", "axisymmetric").replace("thickness: 4\n", ""))
    with pytest.raises(CaseError, match=r"is not a force"):
        loads(CASE.replace("-35 N/mm", "-35 MPa"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "touching: block.top}",
            "touching: block.top, spring: {y: 5 kN/mm}}",
            r":9:37: y of tool 'punch' is mounted on a spring",
        ),
        ("touching: block.top}", "touching: block.top, spring: {}}", "a spring needs a stiffness"),
        ("touching: block.top}", "touching: block.top, spring: {y: -5}}", "must be greater than 0"),
        ("type: plane", "type: profile, points: [[-5, 0]]", "1 points; give at least 2"),
        ("type: plane", "type: profile, points: [[-5, 0], [0, 0], [-1, 0]]", "doubles back"),
        ("type: plane", "type: profile, fillet: -1, points: [[-5, 0], [5, 0]]", "must be at least 0"),
        ("type: plane", "type: profile, fillet: 9, points: [[-5, 0], [0, 0], [1, 1], [0, 2]]", "does not fit"),
        ("type: plane", "type: polygon, points: [[0, 0], [1, 1], [1, 0], [0, 1]]", "crosses itself"),
        ("type: plane", "type: profile, points: [[-5, 0], {through: [0, 1]}]", "'to'"),
        ("type: plane", "type: profile, points: [[-5, 0], 3]", "a list of 2 lengths"),
        ("type: plane", "type: circle, radius: 5, concave: maybe", "true or false"),
    ],
)
def test_mistakes_are_reported_with_their_place(old, new, message):
    """Line and column of the value, what is wrong with it and what would be right."""
    with pytest.raises(CaseError, match=message) as caught:
        loads(CASE.replace(old, new), "case.yaml")
    assert "case.yaml:" in str(caught.value)


def test_check_counts_one_increment_as_one(tmp_path):
    """'1 increment', not '1 increments', and what a chain is besides its place."""
    from typer.testing import CliRunner

    from prensa.cli import app

    path = tmp_path / "push.yaml"
    chain = "type: polygon, fillet: 0.25, points: [[0, 0], [4, 0], [2, 3]], at: [1, 0], touching: block.top"
    text = CASE.replace("type: plane, touching: block.top", chain).replace("-35 N/mm}}}", "-35 N/mm}}, increments: 1}")
    path.write_text(text, encoding="utf-8")
    said = CliRunner().invoke(app, ["check", str(path)]).output
    assert "1 increment\n" in said
    assert "convex radii from 0.25 up" in said


@pytest.mark.parametrize("drive", [
    {"move": {"plate": pr.Motion(y=-0.2)}}, {"move": {"plate": pr.Motion(y=((0.0, 0.0), (0.5, 0.0), (1.0, -0.2)))}},
    {"by": {"plate": pr.Motion(y=-0.2)}},
])  # fmt: skip
def test_a_plate_that_touches_an_arc_stands_against_its_way(drive):
    """A quarter of a cord under a plate: as one that is put above it, not at 45 degrees; a straight side gives its own normal."""
    cord = pr.Body(pr.Disc(radius=2.0, n=(6, 4), part="top-right"), pr.NeoHooke(E=6.0, nu=0.4))
    heights = []
    for plate in (pr.Plane(touching="cord.rim"), pr.Plane(above="cord.rim")):
        p = pr.Problem(
            "o-ring", {"cord": cord}, (pr.Step("squeeze", increments=2, **drive),), {"plate": plate},
            (pr.Contact("cord.rim", "plate"),), fixed={"cord.bottom": "y", "cord.left": "x"}, space="plane strain",
        )  # fmt: skip
        (tool,) = pr.discretise(p).tools
        heights.append((*tool.at, *tool.direction))
    assert heights[0] == pytest.approx(heights[1], abs=1e-12)


def test_a_plate_that_touches_a_straight_slope_keeps_its_normal():
    """Whatever way it goes."""
    wedge = pr.Body(pr.Patch(corners=((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 2.0)), n=(4, 4)), pr.Elastic(1000.0, 0.3))
    p = pr.Problem(
        "slope", {"b": wedge}, (pr.Step("press", move={"t": pr.Motion(y=-0.1)}),), {"t": pr.Plane(touching="b.top")},
        (pr.Contact("b.top", "t"),), fixed={"b.bottom": "xy"}, space="plane strain",
    )  # fmt: skip
    (tool,) = pr.discretise(p).tools
    assert tool.direction == pytest.approx(np.array([1.0, -2.0]) / 5**0.5, abs=1e-12)
