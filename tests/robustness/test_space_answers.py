"""The checks of answers in space: their geometry against the tools, wrong answers found, reasons of stops seen in the files."""

from __future__ import annotations

import copy
import re
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from answers import passes, recorded

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa_bench.robustness import cells_in_space, stops, tools_in_space
from prensa_bench.robustness import checks_in_space as checks
from prensa_bench.robustness.claims import released, sprung_back
from prensa_bench.robustness.drawn import Drawn
from prensa_bench.robustness.families import drawn
from prensa_bench.robustness.files import Record, Shape, read, solve_into
from prensa_bench.robustness.increments import reason_of
from prensa_bench.robustness.split_in_space import split

RIB = ((-20.0, 3.0), (-6.0, 3.0), (-3.0, 0.0), (3.0, 0.0), (6.0, 3.0), (20.0, 3.0))
AT = (1.0, 2.0, -1.0)
TOOLS = {
    "ball": tools_in_space.ball(AT, 3.0),
    "roll": tools_in_space.roll(AT, 3.0, "x"),
    "rib": tools_in_space.ribbed(AT, RIB, 1.5, "x"),
    "round rib": tools_in_space.ribbed(AT, RIB, 1.5, "y"),
    "punch": tools_in_space.punch(AT, 4.0, 0.5, "z"),
    "cone": tools_in_space.cone(AT, 0.3, 20.0, 2.0),
    "ball of triangles": tools_in_space.ball_of_triangles(AT, 3.0, 3),
    "rib of triangles": tools_in_space.ribs_of_triangles(AT, RIB, 1.5, 20.0),
}


@pytest.mark.parametrize("name", TOOLS)
def test_two_geometries_agree_in_space(name):
    """Distances and normals by the formulas of the checks are those of the solver's tools, as nearly as triangles allow."""
    tool = TOOLS[name]
    x = np.random.default_rng(3).uniform(-4.0, 4.0, (600, 3))
    x[:, 1] -= 0.5
    gap, n = tool.outline(x)
    told = tool.tool.shape(np.array([0.0, -1.0, 0.0]), 0.0).closest(x)
    near = (np.abs(gap) < 0.3) & (np.abs(told.g) < 0.3)
    assert near.sum() > 20
    assert np.abs(gap - told.g)[near].max() <= 1e-9 + tool.off
    assert np.linalg.norm(n - told.n, axis=1)[near].max() <= 1e-7 + tool.tilt


def pressed() -> Drawn:
    """A small elastic-plastic box of wedges and bricks under a ball: pushed, turned about two axes and moved along, released."""
    tool = tools_in_space.ball((0.0, 33.0, 0.0), 30.0)
    section = pr.Rectangle(size=(3.0, 3.0), n=(2, 2))
    made = mesh_of(pr.Revolution(section=section, angle=2.0 * np.pi, n=6, core="wedges"))
    y = made.points[:, 1]
    names = {"bottom": tuple(np.flatnonzero(y < 1e-9).tolist()), "top": tuple(np.flatnonzero(y > 3.0 - 1e-9).tolist())}
    mesh = pr.Bricks(tuple(map(tuple, made.points.tolist())), tuple(map(tuple, made.cells.tolist())), names)
    p = pr.Problem(
        "pressed", space="solid", bodies={"body": pr.Body(mesh, pr.J2(1e4, 0.3, pr.Linear(20.0, 100.0)))},
        tools={"tool": tool.tool}, contacts=(pr.Contact(("body.top",), "tool"),), friction=pr.Coulomb(0.3),
        fixed={"body.bottom": "xyz"}, steps=(
            pr.Step("push", push={"tool": pr.Push(y=-500.0)}, increments=3),
            pr.Step("turn", push={"tool": pr.Push(y=-500.0)}, move={"tool": pr.Motion(rx=0.01)}, increments=2),
            pr.Step("slide", push={"tool": pr.Push(y=-500.0)}, move={"tool": pr.Motion(rx=0.01, rz=-0.01, x=0.05)}, increments=3),
            pr.Step("release", remove_tools=True, increments=2),
        ),
    )  # fmt: skip
    return Drawn((p,), {"tool": tool}, {"body.top-tool": 0.3}, 1e4, 0.3, 60.0, (released,))


def of_tetrahedra() -> Drawn:
    """The same of tetrahedra with curved sides, without the last two steps."""
    d = pressed()
    body = d.problem.bodies["body"]
    p = replace(d.problem, bodies={"body": replace(body, mesh=split(body.mesh))}, steps=d.problem.steps[:2])
    return replace(d, stages=(p,), claims=())


@cache
def solved(tetrahedra: bool = False) -> tuple[Drawn, Record]:
    d = of_tetrahedra() if tetrahedra else pressed()
    return d, recorded(d)


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_a_right_answer_in_space_passes(tetrahedra):
    """Nothing is found in the answer that the wrong ones are made of; there is pressure, friction and flow in it."""
    passes(checks, *solved(tetrahedra))


def scaled(r: Record, column: str, by: float, row: int | slice = -4) -> None:
    r.history[column][row] *= by


def table(r: Record, column: str, by: float) -> None:
    r.contacts["body.top-tool"][int(r.history["increment"][-4])][column] *= by


def body(r: Record, step: int = -2):
    """The body at the end of a step."""
    return r.bodies[sorted(r.bodies)[step]]["body"]


ALL = slice(None)
SPOILT = {
    "a tool elsewhere": (checks.outlines, lambda r: scaled(r, "tool.uy", 1.5), "gap is|inside the tool"),
    "suction": (checks.outlines, lambda r: table(r, "pressure", -1.0), "negative pressure"),
    "a node in the tool": (checks.outlines, lambda r: table(r, "y", 1.01), "gap is|inside the tool"),
    "turned another way": (checks.turned, lambda r: scaled(r, "tool.ox", 1.1), "off its rotations"),
    "more friction": (checks.cone, lambda r: table(r, "force_x", 3.0), "above its bound|off its"),
    "shear": (checks.cone, lambda r: table(r, "shear", 1.1), "off its shear"),
    "pressures": (checks.cone, lambda r: table(r, "pressure", 1.01), "off its pressure"),
    "a force of a tool": (checks.balance, lambda r: scaled(r, "tool.fz", 1.1), "forces at the nodes miss"),
    "a tool that never pressed": (checks.balance, lambda r: [scaled(r, f"tool.f{a}", 0.0, ALL) for a in "xyz"], "bears a force"),
    "a support": (checks.balance, lambda r: scaled(r, "fixed.body.bottom.fy", 1.001), "out of balance"),
    "a moment": (checks.moments, lambda r: r.history["tool.mz"].__iadd__(1.0), "moments at the nodes miss"),
    "reactions": (checks.moments, lambda r: body(r).reaction.__imul__(1.0 + 0.01 * body(r).x[:, :1]), "supports differ"),
    "a place not reached": (checks.driven, lambda r: scaled(r, "tool.ux", 0.99, r.steps.index("release") - 1), "was asked"),
    "a force not reached": (checks.driven, lambda r: scaled(r, "tool.fy", 0.99, 2), "was asked"),
    "plastic work that falls": (checks.energy, lambda r: scaled(r, "energy.plastic", 0.9), "plastic work falls"),
    "work from nowhere": (checks.energy, lambda r: scaled(r, "energy.external", 1.01), "off forces times paths"),
    "dissipated, and from where": (checks.energy, lambda r: scaled(r, "energy.friction", 1.5, -1), "off the work"),
    "a brick inside out": (checks.elements, lambda r: body(r).x.__setitem__(20, body(r).x[0] - 9.0), "has no volume"),
    "a stress above yield": (checks.yielding, lambda r: body(r).stress.__imul__(1.05), "above its flow stress"),
    "hardening lost": (checks.yielding, lambda r: body(r, -1).plastic.__imul__(0.5), "has fallen|flow stress"),
    "a body that has swollen": (checks.volume, lambda r: body(r).x.__imul__(1.005), "volume of body"),
    "a force that stays": (lambda d, r: released(r), lambda r: body(r, -1).reaction.__iadd__(1.0), "after the tools have gone"),
}  # fmt: skip


@pytest.mark.parametrize("what", SPOILT)
def test_a_wrong_answer_in_space_is_found(what):
    """An answer in which one number is wrong is refused by the check that is there for it."""
    d, record = solved()
    spoilt = copy.deepcopy(record)
    check, spoil, words = SPOILT[what]
    assert check(d, record) == ""
    spoil(spoilt)
    assert re.search(words, check(d, spoilt)), check(d, spoilt)


def mirror(s: Shape, cell: int) -> None:
    """Turn a cell inside out."""
    s.x[s.cells[cell]] *= -1.0


OF_TETRAHEDRA = {
    "pressures": (checks.cone, lambda r: table(r, "pressure", 1.01), "off its pressure"),
    "a middle": (checks.cone, lambda r: r.bodies[4]["body"].x.__imul__(1.001), "off its pressure"),
    "a tetrahedron inside out": (checks.elements, lambda r: mirror(body(r), 9), "has no volume"),
    "a body that has swollen": (checks.volume, lambda r: body(r).x.__imul__(1.005), "volume of body"),
    "hardening lost": (checks.yielding, lambda r: body(r, -1).plastic.__imul__(0.5), "has fallen|flow stress"),
}  # fmt: skip


@pytest.mark.parametrize("what", OF_TETRAHEDRA)
def test_a_wrong_answer_of_tetrahedra_is_found(what):
    """As of bricks: forces at the middles of sides over areas of their own formulas, corners inside a tool, volumes."""
    d, record = solved(tetrahedra=True)
    spoilt = copy.deepcopy(record)
    check, spoil, words = OF_TETRAHEDRA[what]
    assert check(d, record) == ""
    spoil(spoilt)
    assert re.search(words, check(d, spoilt)), check(d, spoilt)


def test_a_corner_that_a_run_warns_of_is_no_wrong_answer():
    """Corners bear no contact, and a run says of each contact which one lies deepest inside a tool."""
    d, record = solved(tetrahedra=True)
    deep = copy.deepcopy(record)
    body(deep).x[:, 1] += 0.4
    assert "and no word of it" in checks.corners_inside(d, deep)
    words = "contact body.top-tool: corner 12 of a tetrahedron, at (0, 3, 0), lies 0.36 inside 'tool'"
    assert checks.corners_inside(d, replace(deep, said=(words,))) == ""


def test_bricks_are_split_into_tetrahedra_with_round_sides():
    """Side to side, no volume lost; a solid sector of wedges and a ring have the area and the volume of the round ones."""
    box = split(pr.Box(size=(3.0, 2.0, 4.0), n=(3, 2, 2)))
    x, cells = np.array(box.points), np.array(box.cells)
    assert cells_in_space.volumes(cells, x).sum() == pytest.approx(24.0, rel=1e-12)
    assert cells_in_space.tributary(cells_in_space.outer_faces(cells), x).sum() == pytest.approx(52.0, rel=1e-12)
    for bore, core, volume, area in ((0.0, "wedges", 40.0, 76.0), (2.0, None, 30.0, 62.0)):
        made = split(pr.Cylinder(radius=4.0, height=5.0, n=(2, 3, 4), angle=1.0, bore=bore, core=core))
        x, cells = np.array(made.points), np.array(made.cells)
        assert cells_in_space.volumes(cells, x).min() > 0.0 < cells_in_space.corners(cells, x).min()
        assert cells_in_space.volumes(cells, x).sum() == pytest.approx(volume, rel=2e-5)
        assert cells_in_space.tributary(cells_in_space.outer_faces(cells), x).sum() == pytest.approx(area, rel=2e-5)


def test_what_forces_do_that_turn_round_is_left_open():
    """Work is known to half the difference of forces that turn round in an increment, times the way; else as before."""
    record = solved()[1]
    spoilt = copy.deepcopy(record)
    force = spoilt.history["tool.fx"]
    force[-4:-2] = (200.0, -300.0)
    spoilt.history["tool.ux"][-3] = spoilt.history["tool.ux"][-4] + 0.1
    now, before = checks._turned_round(spoilt), checks._turned_round(record)
    assert now[-3] == pytest.approx(25.0, rel=0.01)
    assert np.array_equal(now[:-4], before[:-4])


def test_a_run_that_stopped_in_a_release_is_not_at_its_end():
    """Supports bear more than tools there; at the end of the step it would be wrong."""
    d, record = solved()
    rows = slice(0, -1)
    history = {k: v[rows].copy() for k, v in record.history.items()}
    numbers = set(history["increment"].astype(int))
    bodies = {k: v for k, v in record.bodies.items() if k in numbers}
    cut = Record(record.problem, history, record.steps[rows], record.contacts, bodies)
    assert np.abs(history["fixed.body.bottom.fy"][-1]) > 0.1 * np.abs(history["tool.fy"]).max()
    assert checks.until_it_stopped(d, cut) == ""
    history["time"][-1] = len(record.problem.steps)
    assert "out of balance" in checks.balance(d, cut)


def stopped(times, ways, refused=1e-3) -> Record:
    """The answer as if the run had stopped in its first step, with three states whose nodes go down by ways of one mode."""
    record = solved()[1]
    p = replace(record.problem, steps=record.problem.steps[:1])
    s = body(record, 0)
    mode = np.where(s.X[:, 1:2] > 2.9, [[0.0, -1.0, 0.0]], 0.0)
    bodies = {k: {"body": replace(s, x=s.X + way * mode)} for k, way in enumerate(ways, 1)}
    history = {k: v[:3].copy() for k, v in record.history.items()} | {"time": np.array(times)}
    return Record(p, history, record.steps[:3], record.contacts, bodies, refused=refused)


def test_a_limit_of_the_way_is_where_its_parabola_ends():
    """Time = 1 − (1 − way)²: confirmed where less is left than what was refused; not on a straight path, a stiffer one, kinks."""
    d, _ = solved()
    for last, refused, found in ((0.9, 1.01e-2, True), (0.9, 0.99e-2, False), (0.99, 1e-3, True), (1.1, 0.99e-2, False)):
        ways = np.array([last - 0.2, last - 0.1, last])
        record = stopped(1.0 - (1.0 - ways) ** 2, ways, refused)
        assert ("vanishes" in stops.turning_back(d, record)) == found
        assert bool(stops.confirmed(d, record, "LimitPoint.Unstable")) == found
        assert not stops.confirmed(d, record, "Stagnated")
    for times in ((0.1, 0.2, 0.3), (0.1, 0.12, 0.15), (0.1, 0.2, 0.21)):  # a slope of a tenth of the one before is no limit
        assert stops.turning_back(d, stopped(times, (0.1, 0.2, 0.3))) == ""
    gap = stopped(1.0 - (1.0 - ways) ** 2, ways)
    del gap.bodies[2]
    assert stops.turning_back(d, gap) == ""


def test_a_folded_element_has_a_negative_volume_there_or_would_have():
    """A brick that is flat to 1 % is none; one that turns inside out within the refused attempt is."""
    d, _ = solved()
    for ways, refused, found in (
        ((0.0, 1.0, 1.48), 1e-3, ""), ((0.0, 1.0, 1.48), 0.1, "at the end"), ((0.0, 1.0, 1.6), 1e-3, "now"),
    ):  # fmt: skip
        record = stopped((0.1, 0.2, 0.3), ways, refused)
        assert (found in stops.folded(d, record)) if found else stops.folded(d, record) == ""
        assert bool(stops.confirmed(d, record, "Distorted")) == bool(found)
    assert stops.folded(*solved()) == "" == stops.folded(*solved(tetrahedra=True))
    spoilt = copy.deepcopy(solved(tetrahedra=True)[1])
    mirror(body(spoilt, -1), 9)
    assert "now" in stops.folded(d, spoilt)


def test_a_tool_tips_where_its_force_acts_beside_what_it_rests_on():
    """Of a tool that is free to turn: at the last state, or at the end of the refused attempt; of one that is held never."""
    d, record = solved()
    free = replace(record.problem.steps[0], push={"tool": pr.Push(y=-500.0, mx=0.0, mz=0.0)})
    rows = slice(0, 3)
    history = {k: v[rows].copy() for k, v in record.history.items()}
    t = next(t for row, _, t in checks.touchings(d, record) if row == 2)
    reach = t.x[np.linalg.norm(t.force, axis=1) > 0.0][:, 0].max()
    for step in (free, record.problem.steps[0]):
        p = replace(record.problem, steps=(step, *record.problem.steps[1:]))
        for beside, refused, found in (
            ((0.0, 0.0), 1e-3, False), ((0.0, 0.95), 1e-3, False), ((0.0, 0.95), 0.1, True), ((1.0, 1.1), 1e-3, True),
        ):  # fmt: skip
            h = copy.deepcopy(history)
            for k, share in zip((1, 2), beside):
                h["tool.mz"][k] += share * reach * h["tool.fy"][k]
            r = Record(p, h, record.steps[rows], record.contacts, {3: record.bodies[3]}, refused=refused)
            assert bool(stops.tipping(d, r)) == (found and step is free), (beside, refused, stops.tipping(d, r))


def test_a_body_that_nothing_holds_has_a_rigid_motion():
    """A frictionless ball leaves three turns about its centre, on a smooth ground one, a contact that opens more."""
    d, record = solved()
    smooth = replace(d, mu={"body.top-tool": 0.0})
    rows = slice(0, 3)
    history = {k: v[rows].copy() for k, v in record.history.items()}
    given = dict(record.problem.fixed)
    level = {name: replace(f, x=None, z=None) for name, f in given.items()}
    for fixed, refused, words in (
        (given, 0.1, ""), ({}, 0.1, "resists 3"), (level, 0.1, "resists 1 "), (level, -10.0, "resists 3"),
    ):  # fmt: skip
        p = replace(record.problem, fixed=fixed)
        r = Record(p, history, record.steps[rows], record.contacts, {3: record.bodies[3]}, refused=refused)
        assert words in stops.unheld(smooth, r) and bool(words) == bool(stops.unheld(smooth, r)), stops.unheld(smooth, r)
        assert bool(stops.confirmed(smooth, r, "LostSupport")) == bool(words)
        freed = replace(p.steps[0], fixed={"body.bottom": pr.Fixed(free=True)})
        assert stops.unheld(smooth, replace(r, problem=replace(p, steps=(freed, *p.steps[1:])))) == ""


def test_a_bar_that_is_pulled_to_its_limit_load_is_confirmed(tmp_path):
    """Considère: σ₀ + H ε over the first area is H exp(σ₀/H − 1) at most; three states and what was refused are in the files."""
    s0, H = 100.0, 300.0
    bar = pr.Body(pr.Box(size=(1.0, 1.0, 1.0), n=(1, 1, 1)), pr.J2(2e5, 0.3, pr.Linear(s0, H)))
    p = pr.Problem(
        "bar", space="solid", bodies={"body": bar},
        fixed={"body.bottom": "y", "body.left": "x", "body.back": "z"},
        steps=(pr.Step("pull", loads={"body.top": pr.Load(traction=(0.0, 200.0, 0.0))}),),
    )  # fmt: skip
    with pytest.raises(pr.PrensaError) as stop:
        solve_into(tmp_path, p, time.process_time() + 60.0)
    record = read(tmp_path, p)
    last = float(record.history["time"][-1])
    assert set(record.history["increment"].astype(int)[-3:]) <= set(record.bodies)
    assert 0.0 < record.refused < 1e-3
    assert 200.0 * last == pytest.approx(H * np.exp(s0 / H - 1.0), rel=2e-3)
    d = Drawn((p,), {}, {})
    assert "vanishes" in stops.confirmed(d, record, reason_of(stop.value)), (reason_of(stop.value), last, record.refused)
    assert solved()[1].refused == 0.0


def test_a_free_elastic_body_may_lie_turned_and_no_body_squeezed():
    """By any angle about any axis once its supports are free, with them by none; a stretch of 1e-4 more is found."""
    _, record = solved()
    last = replace(record.problem.steps[-1], fixed={"body.bottom": pr.Fixed(free=True)})
    held = replace(record.problem, steps=(replace(last, fixed={}),))
    Q = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    Q *= np.sign(np.linalg.det(Q))
    for stretch, found in ((0.0, False), (1e-4, True)):
        s = body(record, -1)
        turned = replace(s, x=s.X @ (np.eye(3) + np.diag([0.0, stretch, 0.0])) @ Q.T + 5.0)
        moved = replace(record, bodies={0: {"body": turned}}, problem=replace(held, steps=(last,)))
        assert ("left with displacements" in sprung_back(moved)) == found
        assert "left with displacements" in sprung_back(replace(moved, problem=held))
    mirrored = replace(moved, bodies={0: {"body": replace(s, x=s.X * [1.0, 1.0, -1.0])}})
    assert "left with displacements" in sprung_back(mirrored)


def test_the_family_draws_what_it_is_to_draw():
    """Wedges, sectors, tools of triangles, profiles, pushed and tilted ones, releases; one in ten on a second mesh."""
    kinds = [drawn("space", 7, k) for k in range(60)]
    words = " ".join(d.kind for d in kinds)
    for what in ("wedges", "sector", "of tetrahedra,", "of triangles", "rib", "push", "tilt", "rolling", "twist", "released"):
        assert what in words
    assert sum(type(t).__name__ == "Finer" for d in kinds for t in d.twins) == 6


def test_tools_that_lie_between_nodes_go_down_to_them():
    """A punch between the nodes of a warped box, a cone in the middle of a face: where they are sent to a node is inside."""
    for seed, k in ((27182, 6), (27182, 28), (4242, 6)):
        d = drawn("space", seed, k)
        mesh, tool = mesh_of(d.problem.bodies["body"].mesh), d.tools["tool"]
        x = mesh.points[mesh.edges["top"]].reshape(-1, 3) - np.asarray(tool.at)
        down = d.problem.steps[0].move["tool"].y
        assert tool.outline(x)[0].min() > 0.0 > tool.outline(x - [0.0, down, 0.0])[0].min()


def test_a_roll_on_a_line_of_nodes_is_not_left_to_tilt():
    """Its nodes lie on a line but for round-off: nothing would keep it from turning about that."""
    assert ", roll, tilt" not in drawn("space", 161803, 19).kind
