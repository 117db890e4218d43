"""Contact of two bodies by the interaction of all contacts: friction, records, statics, energies, reports, loose bodies."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.system.planning import plan_step
from prensa.system.state import State

NAME = "upper.bottom-lower.top"
ELASTIC = pr.Elastic(1000.0, 0.3)


def sliding(friction, kinematics="finite", n=(9, 5), way=0.2, increments=5, width=0.5, material=ELASTIC, **given):
    """A small block, whose lower side is the slave, pressed on a large one and then moved along it by its top."""
    lower, upper = n
    return pr.Problem(
        "slide", kinematics=kinematics,
        bodies={
            "lower": pr.Body(pr.Rectangle((2.0, 1.0), (2 * lower, 4)), material),
            "upper": pr.Body(pr.Rectangle((width, 0.5), (upper, 4), (0.3, 1.0)), material),
        },
        body_contacts=(pr.BodyContact("upper.bottom", "lower.top", friction=friction),),
        fixed={"lower.bottom": "xy", "upper.top": "x"},
        steps=(
            pr.Step("press", fixed={"upper.top": pr.Fixed(y=-0.01)}, increments=2),
            pr.Step("slide", fixed={"upper.top": pr.Fixed(x=way)}, increments=increments),
        ), **given,
    )  # fmt: skip


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_a_block_slides_over_a_block_against_coulomb_friction(kinematics):
    """In slip the traction of all points is mu times the pressure; supports of either block bear what the contact hands over."""
    for inc in pr.solve(sliding(pr.Coulomb(0.3), kinematics), pr.Numerics(tolerance=1e-12)):
        c, above, below = inc.contacts[NAME], inc.supports["upper.top"], inc.supports["lower.bottom"]
        # the force on the slave's nodes is what its other support bears, and the opposite on the master's
        assert np.allclose(c.force.sum(axis=0), [-above.x, -above.y], rtol=0.0, atol=1e-9 * abs(above.y))
        assert np.allclose([above.x, above.y], [-below.x, -below.y], rtol=0.0, atol=1e-9 * abs(above.y))
        normal, tangential = float(c.pressure @ c.weight), float(c.shear @ c.weight)
        if inc.step == "slide":
            assert (c.status == 2).all()
            assert tangential == pytest.approx(0.3 * normal, rel=1e-10)
            assert np.allclose(c.shear, 0.3 * c.pressure, rtol=1e-10, atol=1e-12)
        else:
            assert (c.status == 1).sum() >= 4
    # the block has slid by its support's way less what it gave way in shear
    assert np.all((c.slip > 0.15) & (c.slip < 0.2))


def test_the_resultant_leans_by_the_angle_of_friction():
    """Of a block of one element across, whose side has one normal, the force on its support makes atan mu with it, to 1e-9."""
    *_, last = pr.solve(sliding(pr.Coulomb(0.3), n=(9, 1)), pr.Numerics(tolerance=1e-13))
    c, force = last.contacts[NAME], last.supports["upper.top"]
    assert (c.status == 2).all()
    along = c.x[-1] - c.x[0]
    along *= np.sign(along[0]) / np.hypot(*along)
    normal, tangential = abs(along[0] * force.y - along[1] * force.x), abs(along @ np.array([force.x, force.y]))
    assert tangential / normal == pytest.approx(0.3, rel=1e-9)


LAWS = {
    "coulomb": pr.Coulomb(0.3),
    "hardening": pr.Coulomb(pr.MuExponential(0.1, 0.5, 0.05)),
    "shear": pr.Shear(0.5, k=400.0),
    "capped": pr.Capped(0.5, m=0.5, k=400.0),
}


@pytest.mark.parametrize("kinematics", ["small", "finite"])
@pytest.mark.parametrize("law", LAWS)
def test_the_matrix_is_the_derivative_of_the_residual(law, kinematics):
    """Of two bodies with histories, in stick and slip, also where the bound goes with the area: to 1e-7 of differences."""
    p = sliding(LAWS[law], kinematics)
    p = replace(p, body_contacts=(replace(p.body_contacts[0], enforcement=pr.Penalty(beta_T=60.0)),))
    system = pr.discretise(p)
    plan, state = plan_step(system, 0, np.zeros(system.ndof)), system.initial()
    down = np.zeros(system.ndof)
    own = system.dofs.displacement.dofs(system.offsets["upper"] + np.arange(len(system.meshes["upper"].points)))
    down[own[:, 1]] = -0.02
    sides = set()
    for seed in range(4):
        rng = np.random.default_rng(seed)
        c = system.context(state, plan, 0.3)
        first = system.evaluate(c, down + 0.004 * rng.normal(size=system.ndof), state.lam)
        before = replace(
            state, u=down + 0.004 * rng.normal(size=system.ndof), history=first.history, contact=first.contacts[0].record,
            lam=np.hstack([first.contacts[0].p[:, None], first.contacts[0].t]),
        )  # fmt: skip
        c = system.context(before, plan, 0.6)
        u, lam = before.u + 0.002 * rng.normal(size=system.ndof), system.initial_multipliers(before)
        base = system.evaluate(c, u, lam)
        (f,) = base.contacts
        sides |= set(zip((f.p > 0).tolist(), f.slip.tolist()))
        K = csc_matrix((base.data, system.pattern.indices, system.pattern.indptr), (system.ndof, system.ndof))
        h = 1e-5
        for _ in range(3):
            v = rng.normal(size=system.ndof)
            ends = [system.evaluate(c, u + s * h * v, lam, False) for s in (2, 1, -1, -2)]
            if any(
                not (np.array_equal(e.contacts[0].p > 0, f.p > 0) and np.array_equal(e.contacts[0].slip, f.slip)) for e in ends
            ):
                continue
            difference = (8.0 * (ends[1].r - ends[2].r) - (ends[0].r - ends[3].r)) / (12.0 * h)
            assert np.abs(difference - K @ v).max() <= 1e-7 * np.abs(K @ v).max()
            sides.add("checked")
    assert {(True, False), (True, True), "checked"} <= sides


def test_sums_of_forces_stay_zero_over_many_elements_of_the_master():
    """Force to round-off; the couple of a penetrating pair is that of its force on the way from one side to the other."""
    path = list(pr.solve(sliding(pr.Coulomb(0.3), way=1.0, increments=20)))
    system = pr.discretise(sliding(pr.Coulomb(0.3), way=1.0, increments=20))
    for before, after in pairwise(path[2:]):
        plan = plan_step(system, 1, before.state.step_start)
        c = system.context(before.state, plan, after.time)
        e = system.evaluate(c, after.state.u, system.initial_multipliers(before.state), stiffness=False)
        F, x = system.displacement(e.contact_forces()), system.positions(after.state.u)
        size = np.abs(F).sum()
        assert np.abs(F.sum(axis=0)).max() <= 1e-14 * size
        (f,) = e.contacts
        apart = np.einsum("kj,kji->ki", f.stencils.coef, x[system.surfaces[0].opposite.sides.nodes])
        couple = float((apart[:, 0] * f.vectors[:, 1] - apart[:, 1] * f.vectors[:, 0]).sum())
        moment = float((x[:, 0] * F[:, 1] - x[:, 1] * F[:, 0]).sum())
        assert moment == pytest.approx(couple, abs=1e-13 * size)
        # no more than friction times the depth by which a penalty lets the sides sink into each other
        depth = np.abs(f.g[f.p > 0]).max()
        assert abs(moment) <= 0.5 * size * depth
    assert path[-1].contacts[NAME].slip.min() > 0.9  # nine elements of the master


def flat_blocks(kinematics="small", way=0.01, overlap=0.0, **given):
    """Two blocks of one width on each other, free to spread, the upper one's top moved down."""
    return pr.Problem(
        "flat", kinematics=kinematics,
        bodies={
            "lower": pr.Body(pr.Rectangle((1.0, 1.0), (6, 6)), ELASTIC),
            "upper": pr.Body(pr.Rectangle((1.0, 0.5), (4, 3), (0.0, 1.0 - overlap)), ELASTIC),
        },
        body_contacts=(pr.BodyContact("upper.bottom", "lower.top"),),
        fixed={"lower.bottom": "y", "lower.left": "x", "upper.left": "x"},
        steps=(pr.Step("press", fixed={"upper.top": "y" if way is None else pr.Fixed(y=-way)}, increments=3),), **given,
    )  # fmt: skip


def roller(increments):
    """Half a disc pressed on a block and slid along it."""
    return pr.Problem(
        "roller",
        bodies={
            "lower": pr.Body(pr.Rectangle((2.0, 0.5), (80, 6)), ELASTIC),
            "upper": pr.Body(pr.Disc(radius=1.0, n=(32, 8), centre=(0.85, 1.5), part="bottom", ratio=2), ELASTIC),
        },
        body_contacts=(pr.BodyContact("upper.rim", "lower.top", friction=pr.Coulomb(0.3)),),
        fixed={"lower.bottom": "xy", "upper.top": "x"},
        steps=(
            pr.Step("press", fixed={"upper.top": pr.Fixed(y=-0.02)}, increments=2),
            pr.Step("slide", fixed={"upper.top": pr.Fixed(x=0.15)}, increments=increments),
        ),
    )  # fmt: skip


@pytest.mark.slow
def test_the_energy_balance_closes():
    """A block pressed flat: to 1e-5 of the work. Sides that slide: with the increments, in 15 of them to 2e-3 of the friction."""
    *_, pressed = pr.solve(flat_blocks())
    assert abs(pressed.energy["imbalance"]) <= 1e-5 * pressed.energy["external"]
    missing = []
    for increments in (8, 15):
        path = list(pr.solve(roller(increments)))
        assert path[-1].energy["friction"] > 0.5 * path[-1].energy["external"]
        slid = path[-1].energy["imbalance"] - path[1].energy["imbalance"]  # trapezoids of two increments miss some of pressing
        missing.append(abs(slid) / path[-1].energy["friction"])
    assert missing[1] < 2e-3
    assert missing[1] < 0.3 * missing[0]


def test_a_run_goes_on_from_a_state_with_the_same_bits():
    """Friction's memory is in the record and the displacements: a restart half way slides on bit for bit."""
    p = sliding(pr.Coulomb(0.3))
    whole = list(pr.solve(p))
    start = State.from_arrays({k: v.copy() for k, v in whole[3].state.arrays().items()})
    again = list(pr.solve(p, start=start))
    assert len(again) == len(whole) - 4
    for a, b in zip(again, whole[4:]):
        assert all(np.array_equal(x, y) for x, y in zip(a.state.arrays().values(), b.state.arrays().values()))


def test_tables_and_measures_have_its_points(tmp_path):
    """A folder of results has them with the master's name, as Python and measures do; pressure is that of the blocks."""
    p = flat_blocks(kinematics="finite", measures={"most": f"{NAME}.max.pressure"})
    *_, last = pr.solve(p)
    c = last.contacts[NAME]
    assert (c.surface, c.tool, c.body) == ("upper.bottom", "lower.top", "upper")
    assert np.allclose(c.pressure, c.pressure_from_stress, rtol=1e-8)
    assert c.pressure == pytest.approx(1000.0 / (1 - 0.3**2) * 0.01 / 1.5, rel=0.01)
    assert last.measure(f"{NAME}.max.pressure") == pytest.approx(c.pressure.max())
    assert c.area == pytest.approx(float(c.weight.sum()))
    pr.run(pr.Case(p), tmp_path / "out", quiet=True)
    stored = pr.results(tmp_path / "out").increments[-1].contacts[NAME]
    assert stored.tool == "lower.top"
    assert np.array_equal(stored.pressure, c.pressure)


@pytest.mark.parametrize("overlap", [0.005, 0.02])
def test_bodies_that_overlap_at_first_press_each_other_apart(overlap):
    """A fit: uniform, as if the overlap were pressed in; and it is said before the run."""
    p = flat_blocks(way=None, overlap=overlap)
    *_, last = pr.solve(p)
    pressure = last.contacts[NAME].pressure
    assert np.ptp(pressure) <= 1e-9 * pressure.max()
    assert pressure == pytest.approx(1000.0 / (1 - 0.3**2) * overlap / 1.5, rel=0.01)
    said = [str(n) for n in preflight(pr.discretise(p)) if "overlaps" in str(n)]
    assert all("their contact presses them apart" in words for words in said)
    assert len(said) == (1 if overlap > 0.01 else 0)


def test_an_elastic_punch_in_a_plastic_block_is_nearly_a_rigid_one():
    """To 3 % of a stamp's force; the block is the slave, whose nodes come and go at the punch's edges."""
    metal = pr.J2(E=70e3, nu=0.33, flow=pr.Swift(K=200.0, e0=0.01, n=0.2))
    block = pr.Body(pr.Rectangle((4.0, 2.0), (16, 8)), metal)
    punch = pr.Body(pr.Rectangle((2.0, 1.0), (11, 5), (1.0, 2.0)), pr.Elastic(210e3, 0.3))
    two = pr.Problem(
        "punch", {"lower": block, "upper": punch}, (pr.Step("press", fixed={"upper.top": pr.Fixed(y=-0.3)}),),
        body_contacts=(pr.BodyContact("lower.top", "upper.bottom"),), fixed={"lower.bottom": "xy", "upper.top": "x"},
    )  # fmt: skip
    stamp = pr.Problem(
        "stamp", {"lower": block}, (pr.Step("press", move={"stamp": pr.Motion(y=-0.3)}),),
        tools={"stamp": pr.Stamp(width=2.0, at=(2.0, 2.0), fillet=0.02)}, fixed={"lower.bottom": "xy"},
    )  # fmt: skip
    path, (*_, rigid) = list(pr.solve(two)), pr.solve(stamp)
    assert sum(i.statistics.cutbacks for i in path) == 0
    assert path[-1].supports["lower.bottom"].y == pytest.approx(-path[-1].supports["upper.top"].y, rel=1e-8)
    assert path[-1].supports["lower.bottom"].y == pytest.approx(rigid.tools["stamp"].force.y, rel=0.03)


def stack(step, gap=0.0, mu=0.2):
    """A block that nothing holds but friction, between a block below and a plane above."""
    return pr.Problem(
        "stack",
        bodies={
            "lower": pr.Body(pr.Rectangle((2.0, 1.0), (10, 4)), ELASTIC),
            "upper": pr.Body(pr.Rectangle((1.0, 0.5), (7, 4), (0.5, 1.0 + gap)), ELASTIC),
        },
        tools={"punch": pr.Plane(at=(0.0, 1.5 + 2 * gap), normal=(0.0, -1.0))}, friction=mu and pr.Coulomb(mu),
        contacts=[pr.Contact("upper.top", "punch")], body_contacts=[pr.BodyContact("upper.bottom", "lower.top")],
        fixed={"lower.bottom": "xy"}, steps=[step],
    )  # fmt: skip


@pytest.mark.parametrize("gap", [0.0, 0.05])
@pytest.mark.parametrize("drive", ["push", "move"])
def test_a_body_that_another_one_bears_goes_there_by_itself(drive, gap):
    """Pushed or moved down by a plane, through room above and below: what the plane presses the lower block's support bears."""
    how = {"push": {"punch": pr.Push(y=-10.0)}} if drive == "push" else {"move": {"punch": pr.Motion(y=-0.02 - 2 * gap)}}
    *_, last = pr.solve(stack(pr.Step("press", increments=4, **how), gap))
    force = last.supports["lower.bottom"].y
    assert force == pytest.approx(last.tools["punch"].force.y, rel=1e-8)
    assert force == pytest.approx(10.0 if drive == "push" else 19.528, rel=1e-3)
    assert (last.contacts[NAME].status > 0).all()


def test_rigid_motions_are_known_before_the_run():
    """Without friction the stacked block is free along x; far from all, it is free until something touches it."""
    with pytest.raises(pr.PrensaError, match=r"bodies.upper: it is free to move along x: no support and no contact"):
        list(pr.solve(stack(pr.Step("press", move={"punch": pr.Motion(y=-0.02)}), mu=None)))
    notices = preflight(pr.discretise(stack(pr.Step("press", move={"punch": pr.Motion(y=-0.12)}), gap=0.05)))
    assert any("nothing resists until a tool touches it" in str(n) for n in notices)


def test_steps_change_its_friction():
    """By its name, like that of any other contact: smooth at first, and from the second step on with friction."""
    p = sliding(None)
    press, slide = p.steps
    p = replace(p, steps=(press, replace(slide, friction={NAME: pr.Coulomb(0.1)})))
    *_, last = pr.solve(p)
    c = last.contacts[NAME]
    assert np.allclose(c.shear, 0.1 * c.pressure, rtol=1e-9)
    with pytest.raises(pr.CaseError, match="unknown contact"):
        replace(p, steps=(press, replace(slide, friction={"upper.bottom-lower.topp": pr.Coulomb(0.1)})))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"body_contacts": 2 * (pr.BodyContact("upper.bottom", "lower.top"),)}, "appears twice"),
        ({"body_contacts": (pr.BodyContact("upper.bottom", "lower.top", friction=pr.Shear(0.5)),)}, "no shear yield stress"),
        ({"body_contacts": (pr.BodyContact("upper.bottom", "lower.top", pr.Exact()),)}, "enforced by 'penalty'"),
    ],
)
def test_what_it_cannot_do_is_refused(change, words):
    """In words, when the problem is described."""
    with pytest.raises(pr.CaseError, match=words):
        replace(sliding(None), **change)


def test_a_closed_side_is_in_contact_all_round():
    """The rim of a whole disc, wherever its first node is: it touches below, and nowhere else."""
    whole = pr.Body(pr.Disc(radius=1.0, n=(8, 3), centre=(0.85, 1.5)), ELASTIC)
    block = pr.Body(pr.Rectangle((2.0, 0.5), (20, 6)), ELASTIC)
    step = pr.Step("press", fixed={"upper.rim-top": pr.Fixed(x="held", y=-0.02), "upper.centre": "x"})
    p = replace(roller(1), bodies={"lower": block, "upper": whole}, fixed={"lower.bottom": "xy"}, steps=(step,))
    *_, last = pr.solve(p)
    c = last.contacts["upper.rim-lower.top"]
    assert len(c.node) == 32
    closed = c.x[c.status > 0]
    assert len(closed) and np.abs(closed[:, 0].mean() - 0.85) < 0.1
    assert last.supports["lower.bottom"].y == pytest.approx(-last.supports["upper.rim-top"].y, rel=1e-8)
