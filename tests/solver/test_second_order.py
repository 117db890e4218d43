"""Plastic flow of second order in time, in whole problems: errors, restarts, meshes that change, derivatives."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.policy import Policy
from prensa.system.state import State
from prensa.verify.forming import upsetting
from problems import single_block

EULER, BDF2 = pr.Numerics(time_rule="backward_euler"), pr.Numerics(time_rule="bdf2")
AUTO = pr.Numerics(time_rule="auto")
WITHIN = pr.Numerics(time_rule="auto", time_tolerance=0.01)


def forces(problem: pr.Problem, numerics: pr.Numerics, **policy: Any) -> dict[float, float]:
    """Force at each reduction in tenths."""
    history = list(pr.solve(problem, numerics, policy=Policy(**policy)))
    return {round(-i.tools["punch"].place.y / 7.5, 6): i.force("punch").y for i in history}


@pytest.mark.parametrize(("space", "mu"), [("axisymmetric", 0.3), ("plane strain", 0.1)])
def test_errors_in_time_of_upsetting(space: str, mu: float) -> None:
    """Increments nearly twice as long, and errors at 10, 20 and 30 % less than a quarter of those of backward Euler."""
    problem = upsetting((8, 6), mu, space=space, reductions=(0.1, 0.2, 0.3))
    exact = forces(problem, BDF2, plastic_strain_increment=0.001)
    first = forces(problem, EULER)
    for rule in (BDF2, AUTO):
        second = forces(problem, rule)
        assert len(second) < 0.7 * len(first)
        for r in (0.1, 0.2, 0.3):
            assert abs(second[r] - exact[r]) < 0.25 * abs(first[r] - exact[r])
            assert exact[r] == pytest.approx(first[r], rel=3e-3)


@pytest.mark.parametrize(
    ("element", "kinematics", "space"),
    [
        ("q4_fbar", "finite", "plane strain"), ("q4_enhanced", "finite", "plane strain"), ("t6", "finite", "plane strain"),
        ("q8", "small", "plane strain"), ("q4_enhanced", "small", "plane stress"), ("t6", "finite", "plane stress"),
    ],
)  # fmt: skip
def test_every_element_and_space(element: str, kinematics: str, space: str) -> None:
    """A sheared block, given increments: their number halved, its error is quartered (to a third), or round-off of the steps."""
    def moment(increments: int) -> float:
        most = 0.03 if kinematics == "small" else 0.2
        path = ((0.0, 0.0), (0.5, 0.3 * most), (1.0, most))
        step = pr.Step("shear", fixed={"b.top": pr.Fixed(x=path, y=((0.0, 0.0), (1.0, 0.4 * most)))}, increments=increments)
        problem = single_block(
            step, material=pr.J2(1000.0, 0.3, pr.Voce(4.0, 4.0, 20.0)), n=(4, 2), element=element,
            fixed={"b.bottom": "xy"}, space=space, kinematics=kinematics,
        )  # fmt: skip
        *_, last = pr.solve(problem, BDF2)
        return float(last.supports["b.bottom"].x)

    a, b, c = (moment(n) for n in (16, 32, 64))
    assert abs(c - b) < abs(b - a) / 2.6 or abs(b - a) < 1e-5 * abs(c)


@pytest.mark.parametrize("rule", [BDF2, AUTO, WITHIN], ids=["bdf2", "auto", "tolerance"])
def test_a_run_resumes_bit_for_bit(rule: pr.Numerics) -> None:
    """From a checkpoint in the middle of a step: the flow of the increment before is in it, and how steady it was."""
    problem = upsetting((6, 4), 0.1, reductions=(0.1, 0.2))
    *states, last = (i.state for i in pr.solve(problem, rule))
    start = State.from_arrays(states[5].arrays())
    assert 0.0 < start.clock.time < 1.0
    *_, again = pr.solve(problem, rule, start=start)
    expected, got = last.arrays(), again.state.arrays()
    assert all(np.array_equal(a, got[k]) for k, a in expected.items())


def pulled(*path: tuple[float, float]) -> pr.Problem:
    """A block whose top is moved by a table of one step."""
    step = pr.Step("pull", fixed={"b.top": pr.Fixed(y=path)})
    return single_block(step, material=pr.J2(1000.0, 0.3, pr.Voce(4.0, 4.0, 20.0)), size=(2.0, 2.0), n=(1, 1))


@pytest.mark.parametrize("last", [0.097, 0.1], ids=["back", "held"])
def test_nothing_flows_on_where_a_table_turns_back_or_stops(last: float) -> None:
    """A third of the last increment's plastic strain would be some 0.3 % here; two thirds of the elastic strain are released."""
    strains = {
        round(i.time, 9): i.state.history[0][..., 4].max() for i in pr.solve(pulled((0.0, 0.0), (0.5, 0.1), (1.0, last)), BDF2)
    }
    assert strains[0.5] > 0.04
    assert strains[1.0] == strains[0.5]
    assert sum(t > 0.5 for t in strains) > 1


def test_how_much_flow_changes_is_measured() -> None:
    """A block that is pulled evenly, ever faster: against the plastic strains of three states, which are the same everywhere.

    These are lengths of a path that turns a little; what is measured goes from one end of an increment to the other.
    """
    path = ((0.0, 0.0), (0.4, 0.03), (0.7, 0.07), (1.0, 0.15))
    states = [i.state for i in pr.solve(pulled(*path), AUTO)]
    looked = 0
    for a, b, c in zip(states, states[1:], states[2:]):
        if c.clock.step > 0 or not (c.history[0][..., 4] > b.history[0][..., 4]).all():
            continue
        before, flow = (float(y.history[0][..., 4].mean() - x.history[0][..., 4].mean()) for x, y in ((a, b), (b, c)))
        ratio = (c.clock.time - b.clock.time) / (b.clock.time - a.clock.time)
        apart = ratio / (1.0 + ratio) * abs(flow - ratio * before) / flow
        assert c.clock.unsteady * (c.clock.time - b.clock.time) == pytest.approx(apart, rel=0.02, abs=1e-4)
        looked += apart > 0.01
    assert looked > 2


def test_increments_after_a_node_has_landed_are_short() -> None:
    """No more than a hundredth of plastic strain at most points where a node of the side met the punch just before, else two."""
    def grown(after: State, before: State) -> float:
        now, was = (s.history[0][..., 4] for s in (after, before))
        return float(np.quantile(now - was, 0.9))

    states = [i.state for i in pr.solve(upsetting((40, 30), 0.3, reductions=(0.4,)), AUTO)]
    landed = [int(b.contact.closed.sum() > a.contact.closed.sum()) for a, b in pairwise(states)]
    spent = [grown(b, a) for a, b in pairwise(states)]
    after = [g for g, was in zip(spent[1:], landed) if was]
    assert len(after) > 2 and max(after) < 0.6 * max(spent)
    assert sum(g > 1.5 * max(after) for g in spent) > 5


def test_increments_follow_the_tolerance() -> None:
    """Differences of the two orders stay near what is asked for, and a force is nearer the converged one for it."""
    problem = upsetting((6, 4), 0.1, reductions=(0.1, 0.2))
    exact = forces(problem, BDF2, plastic_strain_increment=0.001)
    states = [i.state for i in pr.solve(problem, WITHIN)]
    spent = [s.clock.unsteady * s.dt_last for s in states if s.clock.dt > 0.0]
    assert float(np.median(spent)) < 1.1 * 0.01 < float(np.max(spent))
    coarse, close = forces(problem, AUTO), forces(problem, WITHIN)
    assert len(close) > 1.5 * len(coarse)
    assert abs(close[0.2] - exact[0.2]) < 0.3 * abs(coarse[0.2] - exact[0.2])


def test_given_increments_are_of_first_order_unless_second_is_asked_for() -> None:
    """To the last bit: they may be many times as long as automatic ones."""
    step = pr.Step("pull", fixed={"b.top": pr.Fixed(y=0.1)}, increments=6)
    problem = single_block(step, material=pr.J2(1000.0, 0.3, pr.Voce(4.0, 4.0, 20.0)), size=(2.0, 2.0), n=(1, 1))
    first, auto, second = (list(pr.solve(problem, n))[-1].state.u for n in (EULER, AUTO, BDF2))
    assert np.array_equal(first, auto)
    assert not np.array_equal(first, second)


def test_a_tolerance_of_backward_euler_is_refused() -> None:
    with pytest.raises(pr.PrensaError, match="'time_tolerance' needs 'time_rule: auto' or bdf2"):
        pr.Numerics(time_rule="backward_euler", time_tolerance=0.01)
