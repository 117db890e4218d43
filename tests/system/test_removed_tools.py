"""Tools that are removed: bodies spring back onto supports that they find by themselves, which carry nothing."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.errors import PrensaError
from prensa.model.schema import CaseError, dump, loads
from prensa.output.checkpoint import read_checkpoint
from prensa.output.history import read_contact
from prensa.output.run import resume, run
from prensa.system.planning import plan_step
from prensa.verify.balance import imbalance
from problems import pressed_block, single_block, stroke, tied_blocks, upset_block
from stopped import stopped_after

ELASTIC = pr.Elastic(1000.0, 0.3)
PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(10.0, 50.0))
HOLD = {"s.left": "xy"}
BEND = pr.Step("bend", fixed=HOLD, move={"punch": pr.Motion(y=-1.0)}, increments=4)
GO = pr.Step("release", remove_tools=True, increments=3)
FREE = replace(GO, fixed={"s.left": "free"})


def strip(*steps: pr.Step, material=PLASTIC, spring=None, **more) -> pr.Problem:
    """A strip that is held at its left end and bent down by a round punch near its right one."""
    return pressed_block(
        *steps, tools={"punch": pr.Circle(2.0, at=(7.0, 3.0), spring=spring)}, material=material, size=(8, 1), n=(12, 2),
        element="q4_enhanced", body="s", **{"friction": pr.Coulomb(0.2), "fixed": {}} | more,
    )  # fmt: skip


def ends(problem: pr.Problem, **options) -> list:
    return [i for i in pr.solve(problem, **options) if i.end_of_step]


def relative(body, other) -> float:
    """Largest difference of two shapes when they lie on each other (a rigid motion apart)."""
    a, b = (v.x - v.x.mean(axis=0) for v in (body, other))
    u, _, v = np.linalg.svd(a.T @ b)
    return float(np.abs(a @ (u @ v) - b).max())


def invariants(system, inc) -> np.ndarray:
    """Trace, Mises stress and plastic strain (points, 3) where they are computed: they do not turn with the body."""
    (b,), (h,) = system.blocks, inc.state.history
    xx, yy, zz, xy = b.law.cauchy(b.at_law(h).reshape(-1, b.law.size)).T
    mises = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2)
    return np.column_stack([xx + yy + zz, mises, b.field(h, "plastic_strain").ravel()])


# ------------------------------------------------------------------------------------------------------- what is the same
@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=lambda e: e.type)
def test_springback_does_not_depend_on_the_supports(enforcement):
    """Found supports, and two choices of a user's: shapes, stresses and strains agree to 1e-8, and no support bears anything."""
    choices = [{}, {"s.bottom-left": "xy", "s.bottom-right": "y"}, {"s.top-right": "xy", "s.bottom-right": "x"}]
    found = []
    for fixed in choices:
        system = pr.discretise(strip(BEND, replace(GO, fixed={"s.left": "free"} | fixed), enforcement=enforcement))
        bent, free = ends(system)
        force = bent.force("punch").y
        assert force > 0.2
        assert np.abs(free.bodies["s"].reaction).max() <= 1e-8 * force
        assert free.force("punch") == (0, 0, 0)
        assert bent.measure("punch.friction_power") > 0.0 == free.measure("punch.max.friction_power")
        assert relative(bent.bodies["s"], free.bodies["s"]) > 0.05  # it springs
        found.append((free.bodies["s"], invariants(system, free)))
    shape, values = found[0]
    for other, theirs in found[1:]:
        assert relative(shape, other) <= 1e-8
        assert (np.abs(theirs - values).max(axis=0) <= 1e-8 * np.abs(values).max(axis=0)).all()


def test_the_resultants_of_the_self_stress_vanish():
    """Force and moment across a symmetry line are nothing beside those under load, and stresses remain there."""
    held = {"s.left": "x", "s.bottom-left": "y"}
    bent, free = ends(strip(replace(BEND, fixed=held), replace(GO, fixed={"s.bottom-left": {"free": True, "x": "held"}})))

    def resultants(inc) -> tuple[float, float]:
        b = inc.bodies["s"]
        line = b.X[:, 0] == 0.0
        return b.reaction[line, 0].sum(), (b.reaction[line, 0] * (b.x[line, 1] - b.x[line, 1].mean())).sum()

    (_, moment), (N, M) = resultants(bent), resultants(free)
    assert abs(moment) > 0.5
    assert abs(N) <= 1e-8 * abs(moment)
    assert abs(M) <= 1e-8 * abs(moment)
    b = free.bodies["s"]
    assert np.abs(b.stress[b.X[:, 0] == 0.0, 0]).max() > 1.0


@pytest.mark.parametrize("kinematics", ["small", "finite"])
@pytest.mark.parametrize("condense", [False, True])
def test_an_elastic_body_is_what_it_was(kinematics, condense):
    """Shape, stresses and energies of a pressed block go back to nothing, in small strain linearly over the step."""
    if condense and kinematics == "finite":
        return
    block = upset_block(
        stroke(-0.1, increments=2), replace(GO, increments=4), tools={"t": pr.Circle(6.0, touching="b.top")},
        material=ELASTIC, n=(6, 3), kinematics=kinematics,
        contact_geometry="reference" if kinematics == "small" else "current",
    )  # fmt: skip
    path = list(pr.solve(block, numerics=pr.Numerics(condense=condense)))
    pressed, free = path[1], path[2:]
    h = pressed.bodies["b"].displacement
    assert np.abs(free[-1].bodies["b"].displacement).max() <= 1e-9
    assert np.abs(free[-1].bodies["b"].stress).max() <= 1e-5
    if kinematics == "small":
        for i, s in zip(free, (0.25, 0.5, 0.75), strict=False):
            assert np.abs(i.bodies["b"].displacement - (1 - s) * h).max() <= 1e-10
        assert free[-1].energy["external"] == pytest.approx(pressed.energy["imbalance"], rel=1e-6)
    assert free[-1].energy["imbalance"] == pytest.approx(pressed.energy["imbalance"], abs=1e-3 * pressed.energy["elastic"])


def test_removed_tools_released_as_tools_that_leave():
    """A tool that is drawn away leaves the same shape, where nothing yields on the way."""
    leave = pr.Step("leave", by={"punch": pr.Motion(y=2.0)}, increments=8)
    (bent, gone), (_, left) = (ends(strip(BEND, last)) for last in (GO, leave))
    assert relative(gone.bodies["s"], bent.bodies["s"]) > 0.05
    assert relative(gone.bodies["s"], left.bodies["s"]) <= 1e-6


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_few_supports_are_found(space, caplog):
    """Three in the plane, one along an axis, none where supports hold all; they are reported with their places, far apart."""
    billet = single_block(
        stroke(-0.1, increments=2), replace(GO, increments=1),
        tools={"t": pr.Plane(touching="b.top"), "u": pr.Plane(touching="b.bottom")}, material=PLASTIC, size=(3, 2),
        n=(3, 2), fixed={}, space=space, friction=pr.Coulomb(0.3),
    )  # fmt: skip
    with caplog.at_level(logging.INFO, "prensa"):
        _, free = ends(billet)
    (told,) = [m for m in caplog.messages if "the reactions there are zero" in m]
    number = {"plane strain": 3, "axisymmetric": 1}[space]
    assert told.count("at node") == number
    system = pr.discretise(billet)
    found = [g for g in plan_step(system, 1, np.zeros(system.ndof)).groups if g.found]
    assert len(found) == number
    assert not preflight(system)
    assert np.abs(free.bodies["b"].reaction[free.bodies["b"].X[:, 0] > 0]).max() <= 1e-8
    held = pr.discretise(replace(billet, fixed={"b.left": "x", "b.bottom-left": "y", "b.bottom-right": "y"}))
    assert not [g for g in plan_step(held, 1, np.zeros(held.ndof)).groups if g.found]


def test_tied_bodies_are_held_as_one():
    """Two halves of a block, joined along meshes that do not match: three supports for both."""
    pair = tied_blocks(
        stroke(-0.1, increments=2), replace(GO, increments=1), sizes=((4, 1), (4, 1)), n=((4, 2), (6, 2)), names=("a", "b"),
        materials=(PLASTIC, PLASTIC), tools={"t": pr.Circle(5.0, touching="b.top"), "u": pr.Plane(touching="a.bottom")},
        contacts=[pr.Contact("b.top", "t"), pr.Contact("a.bottom", "u")], friction=pr.Coulomb(0.3), fixed={},
    )  # fmt: skip
    pressed, free = ends(pair)
    system = pr.discretise(pair)
    assert len([g for g in plan_step(system, 1, free.state.step_start).groups if g.found]) == 3
    assert max(np.abs(b.reaction).max() for b in free.bodies.values()) <= 1e-8 * pressed.force("t").y


def test_forces_of_pushed_and_spring_mounted_tools_go_too():
    """Whatever held the tools: what is left at the end is a body without forces; its energies are its own."""
    push = pr.Step("bend", push={"punch": pr.Push(y=-0.5)}, fixed=HOLD, increments=3)
    for problem in (strip(push, FREE), strip(replace(BEND, increments=8), FREE, spring=pr.Springs(y=3.0))):
        bent, free = ends(problem)
        system = pr.discretise(problem)
        assert bent.force("punch").y > 0.3
        assert np.abs(free.bodies["s"].reaction).max() <= 1e-8
        assert free.energy["elastic"] == pytest.approx(system.elastic_energy(free.state.history), rel=1e-12)
        assert free.energy["contact"] == 0.0
        assert abs(free.energy["imbalance"] - bent.energy["imbalance"]) <= 0.02 * free.energy["external"]


def test_found_supports_bear_nothing_on_the_way_either():
    """What is released is in equilibrium with itself on every shape, though the body turns by degrees."""
    system = pr.discretise(strip(BEND, replace(FREE, increments=4)))
    path = list(pr.solve(system))
    force = max(i.force("punch").y for i in path)
    for i in path[-4:]:
        found = np.concatenate([g.dofs for g in plan_step(system, 1, i.state.step_start).groups if g.found])
        reaction = i.bodies["s"].reaction.ravel()[found]
        assert np.abs(reaction).max() <= 1e-8 * force
        if i.time < 2.0:
            assert max(imbalance(system, i)) <= 1e-7


# --------------------------------------------------------------------------------------------------------- in every run
def test_a_run_goes_on_bit_for_bit(tmp_path):
    """Resumed before, at and after the removal; tables say that the tools are gone."""
    more = pr.Step("pull", fixed={"s.left": "xy"}, by={"s.right": pr.Motion(x=0.01)}, increments=2)
    bend = replace(BEND, increments=2, until=pr.Until(force={"punch": pr.ToolForce(y=0.2)}))
    case = pr.Case(strip(bend, FREE, more, enforcement=pr.Exact()), output=pr.Output(1, False, False))
    whole = run(case, tmp_path / "whole", quiet=True)
    table = whole.history
    gone = table["step"] != "bend"
    assert (table["punch.fy"][gone] == 0).all()
    assert (table["s.top-punch.area"][gone] == 0).all()
    contact = read_contact(tmp_path / "whole" / "contact" / "s.top-punch" / f"{len(gone):04d}.csv")
    assert np.isinf(contact["gap"]).all()
    assert (contact["pressure"] == 0).all()
    _, end = read_checkpoint(tmp_path / "whole" / "checkpoint.h5")
    start = int(np.flatnonzero(gone)[0])
    for stop in (start, start + 2, len(gone) - 1):  # before, in and after the step
        part = tmp_path / f"part{stop}"
        stopped_after(case, part, stop)
        resume(part, quiet=True)
        for name in ("history.csv", "passages.csv"):
            assert (part / name).read_text() == (tmp_path / "whole" / name).read_text()
        _, state = read_checkpoint(part / "checkpoint.h5")
        for name, array in end.arrays().items():
            np.testing.assert_array_equal(array, state.arrays()[name])


def test_a_case_that_starts_from_a_run_may_begin_with_the_removal(tmp_path):
    """Bending in one case and springback in the next give what both steps of one case do."""
    run(pr.Case(strip(BEND), output=pr.Output(0, False, False)), tmp_path / "bend", quiet=True)
    (apart,) = ends(replace(strip(replace(GO, fixed={"s.left": "xy"})), start=pr.Start(str(tmp_path / "bend"))))
    _, together = ends(strip(BEND, GO))
    assert relative(apart.bodies["s"], together.bodies["s"]) <= 1e-8
    assert apart.energy["plastic"] == pytest.approx(together.energy["plastic"], rel=1e-10)


# ----------------------------------------------------------------------------------------------------------- refused
CASE = """\
name: pressed
bodies: {b: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {t: {type: plane, touching: b.top}}
contacts: [{surface: b.top, against: t}]
fixed: {b.bottom: y, b.left: x}
steps:
  - {name: one, move: {t: {y: -0.02}}}
  - {name: two, remove_tools: true}
  - {name: three}
"""


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("{name: three}", "{name: three, move: {t: {y: 1}}}", "9:26: step 'two' removes all tools"),
        ("{name: two, remove", "{name: two, push: {t: {y: 0}}, remove", "tool 't' does nothing then"),
        ("{name: three}", "{name: three, friction: {b.top-t: {type: coulomb, mu: 0.1}}}", "does nothing then"),
        ("{name: three}", "{name: three, until: {contact: {t: leaves}}}", "'t' cannot end a step"),
        ("tools: {t: {type: plane, touching: b.top}}\ncontacts: [{surface: b.top, against: t}]\n", "", "unknown tool 't'"),
    ],
)  # fmt: skip
def test_tools_that_are_gone_do_nothing(old, new, words):
    """What is asked of them is refused at its place."""
    with pytest.raises(CaseError, match=words):
        loads(CASE.replace(old, new, 1))


def test_there_must_be_tools():
    """Nothing to remove."""
    text = CASE.replace("tools: {t: {type: plane, touching: b.top}}\ncontacts: [{surface: b.top, against: t}]\n", "")
    with pytest.raises(CaseError, match="there are no tools"):
        loads(text.replace(", move: {t: {y: -0.02}}", ""))
    problem = loads(CASE).problem
    assert problem.steps[1].remove_tools
    assert loads(dump(problem)).problem == problem


def test_derivatives_are_refused_and_given_times_are_kept():
    """Of a run that removes tools nothing is known of derivatives; times of increments may be given all the same."""
    problem = strip(replace(BEND, increments=2), FREE, material=ELASTIC)
    with pytest.raises(PrensaError, match=r"step 'release' removes the tools"):
        next(pr.solve(problem, derivatives=["bodies.s.material.E"]))
    times = [0.5, 1.0, 1.4, 2.0]
    assert [i.time for i in pr.solve(problem, times=times)] == times


def test_a_thin_sheet_between_two_tools_needs_no_list_of_contacts():
    """Both sides of a sheet against both tools, nothing said: punch and die stay on their sides, and it springs back."""
    die = pr.Profile(((20.0, -0.5), (6.0, -0.5), (6.0, -20.0)), fillet=1.5, below="s.bottom")
    tools = {"punch": pr.Circle(4.0, at=(0.0, 4.5)), "die": die}
    sheet = single_block(
        stroke(-2.0, increments=12, tool="punch", name="bend"), GO, tools=tools, material=PLASTIC, size=(12, 0.5),
        n=(24, 2), element="q4_enhanced", body="s", fixed={"s.left": "x"}, friction=pr.Coulomb(0.1),
    )  # fmt: skip
    bent, free = ends(sheet)
    assert bent.force("punch").y == pytest.approx(-bent.force("die").y, rel=1e-8)
    for name, side in (("s-punch", 0.5), ("s-die", 0.0)):
        c = bent.contacts[name]
        assert (c.status > 0).any()
        assert c.X[c.status > 0, 1] == pytest.approx(side)
    assert np.abs(free.bodies["s"].reaction[:, 1]).max() <= 1e-8 * bent.force("punch").y
