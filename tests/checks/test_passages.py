from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.after.passages import Passages, jump_of
from prensa.checks.before.preflight import staircase
from prensa.contact.passage import passing
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step
from prensa.system.state import Energy
from prensa.verify.sliding import FLOW, drawing, rolling
from problems import upset_block

ROLL = pr.Circle(radius=4.0, at=(2.0, 5.0))
WEDGE = pr.Profile(points=((-1.0, 3.0), (2.0, 0.8), (5.0, 3.0)), fillet=1.0, at=(0.0, 0.0))


def block(tool=ROLL, **more) -> pr.Problem:
    return upset_block(
        pr.Step("one"), pr.Step("two"), tools={"roll": tool}, material=pr.J2(200e3, 0.3, FLOW), size=(8, 1), n=(16, 2),
        body="block", space="plane strain", **more,
    )  # fmt: skip


def passed(problem, shift=(0.0, 0.0), place=(0.0, 0.0, 0.0)):
    """Passing when the body shifts and the tool moves to a place, from where both press each other."""
    system = discretise(problem)
    (s,), state = system.surfaces, system.initial()
    before = state.u.copy()
    before[system.dofs.displacement.dof(np.arange(system.nodes), "y")] = 0.05
    after = before.copy()
    for axis, way in zip("xy", shift):
        after[system.dofs.displacement.dof(np.arange(system.nodes), axis)] += way
    after[system.dofs.tool.dofs(0)] += place
    c = system.context(state, plan_step(system, 0, state.step_start), 1.0)
    return passing(system, s, system.evaluate(c, after, state.lam, stiffness=False).contacts[0], before, after)


@pytest.mark.parametrize("more", [{}, {"element": "q8"}, {"element": "t6"}, {"integration": "gauss2"}, {"tool": WEDGE}])
def test_elements_pass_by_the_way_over_their_length(more):
    """A body that shifts by 0.02 past a tool lets 0.04 of its elements of length 0.5 pass, of whatever kind they are."""
    p = passed(block(**more), shift=(0.02, 0.0))
    assert np.isclose(p.advance, 0.04, rtol=0.02)
    assert 0.5 <= p.elements <= 4.0
    assert p.pressure > 0


def test_what_goes_along_with_the_tool_does_not_pass():
    """Nothing passes when body and tool move together, or when the roll turns in its place."""
    assert passed(block(), shift=(0.02, 0.0), place=(0.02, 0.0, 0.0)).advance < 1e-12
    assert passed(block(), place=(0.0, 0.0, 0.1)).advance < 1e-12
    assert passed(block(), place=(-0.02, 0.0, 0.0)).advance == pytest.approx(0.04, rel=0.02)


def test_a_tool_that_turns_about_another_point_carries_its_surface_along():
    """A wedge that turns about the origin slides over the block by the way of its lowest point, about 1 × 0.001."""
    assert passed(block(WEDGE), place=(0.0, 0.0, 0.001)).advance == pytest.approx(0.001 / 0.5, rel=0.1)


def between_two_rolls() -> pr.Problem:
    """A whole strip that both rolls draw in, and then one alone, with the other one free to turn."""
    strip = pr.Body(pr.Strip(12.0, 2.0, (36, 4)), pr.J2(70e3, 0.33, pr.Voce(60, 120, 8)))
    rolls = {name: pr.Circle(8.0, at=(0.0, y), touching="strip.right") for name, y in (("top", 8.9), ("bottom", -8.9))}
    turn = {"top": pr.Motion(rz=0.3), "bottom": pr.Motion(rz=-0.3)}
    return pr.Problem(
        "rolls", bodies={"strip": strip}, tools=rolls, friction=pr.Coulomb(0.3),
        steps=[
            pr.Step("bite", feed={"strip.left": pr.Feed(x=3.0)}, by=turn),
            pr.Step("one drives", by={"bottom": pr.Motion(rz=-0.2)}, push={"top": pr.Push(m=0.0)}),
        ],
    )  # fmt: skip


def rows(passages: Passages, n, force, step="one") -> None:
    for count, value in zip(n, force):
        row = dict.fromkeys(passages.columns, 0.0)
        row |= {"roll.fy": value, "block.top-roll.passages": count, "block.top-roll.elements": 5.0}
        passages.restore(step, row, False)


def test_the_mean_of_a_square_wave_is_its_mean():
    """Whatever the increments, a force of two levels has a mean over a passage within what an increment cannot see."""
    passages = Passages(discretise(block()))
    n = np.sort(np.random.default_rng(3).uniform(0, 6, 600))
    means = []
    for count in n:
        rows(passages, [count], [100.0 + 10.0 * (count % 1.0 < 0.3)])
        if count > 1.5:
            means.append(passages.means()["roll.fy"])
    # each of the two jumps may lie anywhere in its increment
    assert np.abs([m.mean - 103.0 for m in means]).max() < 10.0 * np.diff(n).max()
    assert np.allclose([m.ripple for m in means], 5.0)


def test_the_work_of_an_increment_says_when_its_force_jumped():
    """What is drawn at forces f₀, then f₁, and has taken the work of a jump at τ: τ comes out, nan of a force that stays."""
    system = discretise(drawing(1 / 6, 3, 1e6))
    state = system.initial()
    c = system.context(state, plan_step(system, 0, state.step_start), 1.0)
    own, u, before, after = c.plan.fixed, state.u.copy(), np.zeros(system.ndof), np.zeros(system.ndof)
    right = own[system.dofs.displacement.owns(own)][:1]
    u[right], before[right] = 0.2, 50.0
    c = replace(c, state=replace(state, work=before))
    for force, share in ((60.0, 0.0), (60.0, 0.3), (45.0, 0.8), (50.2, None), (50.0, None)):
        after[right] = force
        external = 0.2 * 0.5 * (50.0 + force)
        done = external if share is None else 0.2 * (share * 50.0 + (1.0 - share) * force)
        reached = replace(state, u=u, work=after, energy=Energy(external=external, plastic=done, imbalance=external - done))
        found = jump_of(c, reached)
        assert np.isnan(found) if share is None else found == pytest.approx(share, abs=1e-12)
        # a time beyond the increment is that of no single jump
        if share is not None:
            far = replace(reached, energy=Energy(imbalance=0.2 * (force - 50.0) * 1.2))
            near = replace(reached, energy=Energy(imbalance=0.2 * (force - 50.0) * 0.6))
            assert np.isnan(jump_of(c, far)) and jump_of(c, near) == pytest.approx(0.9)


def test_a_square_wave_whose_jumps_are_known_has_its_mean_exactly():
    """Of a force of two levels and the times of its jumps the mean is the same to round-off, wherever a passage begins."""
    passages = Passages(discretise(block()))
    n = np.sort(np.random.default_rng(3).uniform(0, 6, 90))
    before = 0.0
    for count in n:
        jumps = [at for at in np.concatenate([np.arange(7), np.arange(7) + 0.3]) if before < at <= count]
        if len(jumps) > 1:
            continue  # a landing and a leaving in one increment are not told apart
        row = dict.fromkeys(passages.columns, 0.0) | {"block.top-roll.passages": count, "block.top-roll.elements": 5.0}
        row["roll.fy"] = 100.0 + 10.0 * (count % 1.0 < 0.3)
        row["jump"] = (jumps[0] - before) / (count - before) if jumps else np.nan
        passages.restore("one", row, False)
        before = count
        if count > 1.5:
            assert passages.means()["roll.fy"].mean == pytest.approx(103.0, rel=1e-12)


@pytest.mark.slow
def test_means_of_drawing_are_nearer_to_those_of_many_increments_than_the_trapezoid():
    """Of a sheet drawn in 60 and 70 increments, what work says takes a third of the error of passage means of the pull away."""
    problem = drawing(1 / 6, 3, 290 * FLOW.s0, travel=1.2)
    pull, contact = "fixed.sheet.right.fx", "sheet.top-die"

    def means(increments: int) -> np.ndarray:
        """Rows of elements that have passed, mean of the pull, and that without a look at the work."""
        step, out = replace(problem.steps[0], increments=increments), []
        plain = Passages(discretise(problem))
        for i in pr.solve(replace(problem, steps=(step,))):
            row = dict.fromkeys(plain.columns, 0.0) | {f"{contact}.passages": i.passages[contact]}
            plain.restore(i.step, row | {pull: i.supports["sheet.right"].x}, False)
            if i.passages[contact] > 2.0:
                out.append([i.passages[contact], i.means[pull].mean, plain.means()[pull].mean])
        return np.array(out)

    right = means(480)
    for increments in (60, 70):
        n, located, trapezoid = means(increments).T
        exact = np.interp(n, right[:, 0], right[:, 1])
        assert np.linalg.norm(located - exact) < 2 / 3 * np.linalg.norm(trapezoid - exact)


def test_windows_do_not_reach_over_the_beginning_of_a_step_nor_into_a_dwell():
    """There is no mean before an element has passed in the step; increments in which nothing passes weigh nothing."""
    passages = Passages(discretise(block()))
    rows(passages, [0.5, 1.0, 1.5], [100.0, 100.0, 100.0])
    assert passages.means()["roll.fy"].mean == 100.0
    rows(passages, [2.0, 2.25], [50.0, 50.0], "two")
    assert not passages.means()
    rows(passages, [2.5, 3.5, 3.5], [50.0, 50.0, 50.0], "two")
    assert passages.means()["roll.fy"] == (50.0, 0.0)


def test_a_staircase_is_reported_once_and_a_rise_is_not():
    """Four passages of a wave of 10 % in a contact of five elements are reported once; a force that grows is not."""
    n = np.arange(0, 4, 0.05)
    for force, told in ((100.0 + 10.0 * (n % 1.0 < 0.5), 1), (10.0 * n, 0), (100.0 + 0 * n, 0)):
        passages, said = Passages(discretise(block())), []
        for count, value in zip(n, force):
            row = dict.fromkeys(passages.columns, 0.0) | {"roll.fy": value, "block.top-roll.elements": 5.0}
            passages._add("one", {"block.top-roll": count}, row)
            said += passages.warnings()
        assert len(said) == told
        assert not told or "about 5 elements lie in the contact, forces step by 15 % (here 10 %)" in said[0]


def test_check_predicts_the_staircase():
    """Of drawing and rolling through few elements, within a third of their number; of finer meshes and of pressing nothing."""
    (notice,) = staircase(discretise(drawing(1 / 6, 3, 1e6)))
    assert notice.path == "contacts.0" and not notice.fatal
    assert 6 <= int(notice.message.split()[1]) <= 9, notice.message
    (notice,) = staircase(discretise(rolling(0.5, 2, 2e5, 0.1)))
    assert 8 <= int(notice.message.split()[1]) <= 13, notice.message
    both = [notice.message.split()[1] for notice in staircase(discretise(between_two_rolls()))]
    assert len(both) == 2 and abs(int(both[0]) - int(both[1])) <= 1, both
    assert not staircase(discretise(drawing(1 / 20, 2, 1e6)))
    press = block()
    for motion in ({"y": -0.3}, {"y": -0.3, "x": 0.3}):
        step = pr.Step("press", move={"roll": pr.Motion(**motion)})
        assert not staircase(discretise(replace(press, steps=(step,))))
