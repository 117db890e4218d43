"""Friction laws of forming: against their closed forms, written by a user, beyond their range, and by speed."""

from __future__ import annotations

import logging
import math
from itertools import pairwise

import numpy as np
import pytest

import prensa as pr
from prensa.errors import CaseError
from prensa.friction.law import At, bounded
from prensa.model.schema import loads
from prensa.reference import levanov, smooth_cap, wanheim_bay
from prensa.system.state import State
from problems import pressed_block, stroke, upset_billet

K = 50.0
P = np.geomspace(1e-3, 1e4, 57)
NONE = np.zeros_like(P)


class UsersLevanov(pr.FrictionLaw):
    m: float

    @property
    def asks_for_k(self):
        return True

    def bound(self, p, kappa, at):
        return self.m * at.k * (1 - np.exp(-1.25 * p / (np.sqrt(3) * at.k)))


class UsersStribeck(pr.FrictionLaw):
    static: float
    kinetic: float
    v: float
    hardens = False
    proportional = True

    def bound(self, p, kappa, at):
        return p * (self.kinetic + (self.static - self.kinetic) * np.exp(-((at.speed / self.v) ** 2)))


def upset(law: pr.FrictionLaw, enforcement: object = pr.Penalty(), increments: int = 4) -> list[float]:
    """Forces of a billet of a hardening metal that is upset."""
    billet = upset_billet(
        stroke(-0.5, increments=increments, tool="punch"), material=pr.J2(70e3, 0.33, pr.Voce(60, 120, 8)),
        size=(10, 5), n=(4, 2), body="billet", friction=law, enforcement=enforcement, plane="punch",
    )  # fmt: skip
    return [inc.force("punch").y for inc in pr.solve(billet, pr.Numerics(tolerance=1e-12))]


@pytest.mark.parametrize(
    ("ours", "users"),
    [
        (pr.Levanov(0.6), UsersLevanov(0.6)),
        (pr.Stribeck(0.3, 0.1, 1.0), UsersStribeck(0.3, 0.1, 1.0)),
    ],
    ids=["levanov", "stribeck"],
)  # fmt: skip
def test_a_users_law_of_ten_lines_gives_what_the_built_in_one_gives(ours, users):
    """Forces with the bound alone, derivatives by the complex step, agree to 1e-12 with the law that comes with prensa.

    With multipliers: gaps times a penalty have round-off of 4e-12 of the forces, which the last digit of a bound changes.
    """
    assert upset(users, pr.Exact()) == pytest.approx(upset(ours, pr.Exact()), rel=1e-12)


@pytest.mark.parametrize(
    ("law", "exact"),
    [
        (pr.WanheimBay(0.6, K), lambda p: wanheim_bay(p, K, 0.6)),
        (pr.WanheimBay(0.01, K), lambda p: wanheim_bay(p, K, 0.01)),
        (pr.WanheimBay(1.0, K), lambda p: wanheim_bay(p, K, 1.0)),
        (pr.Levanov(0.4, K), lambda p: levanov(p, math.sqrt(3) * K, 0.4)),
        (pr.Capped(0.3, 0.5, K, 1), lambda p: smooth_cap(p, K, 0.3, 0.5, 1)),
        (pr.Capped(0.3, 0.5, K, 4.5), lambda p: smooth_cap(p, K, 0.3, 0.5, 4.5)),
    ],
)  # fmt: skip
def test_bounds_are_the_closed_forms_over_seven_decades_of_pressure(law, exact):
    """From nearly no pressure to hundreds of yield stresses the bound is that of the reference."""
    assert law.bound(P, NONE, At())[0] == pytest.approx([exact(float(p)) for p in P], rel=1e-7)


def test_a_sharper_corner_goes_to_the_sharp_one():
    """The smooth cap lies below the sharp one, nearer to it with a larger exponent; of m = 0 nothing is left."""
    p = np.linspace(0.0, 1000.0, 12_001)  # the corner is at 83.3
    sharp, *smooth = (pr.Capped(0.3, 0.5, K, n).bound(p, 0 * p, At())[0] for n in (None, 1, 3, 20))
    gap = [float((sharp - s).max()) for s in smooth]
    assert gap[0] == pytest.approx(0.5 * K * math.exp(-1), rel=1e-3)
    assert gap[0] > 2 * gap[1] > 4 * gap[2] > 0
    assert not pr.Capped(0.3, 0.0, K, 2).bound(P, NONE, At())[0].any()


@pytest.mark.parametrize("speed", [1e-4, 0.1, 5.0])
@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Exact()], ids=["penalty", "exact"])
def test_friction_that_falls_with_the_speed_needs_no_cuts(speed, enforcement):
    """However slow the speed at which friction falls, upsetting goes through without a cut, at a force between the limits."""
    forces = upset(pr.Stribeck(0.3, 0.1, speed), enforcement, 6)
    assert len(forces) == 6
    kinetic, static = (upset(pr.Coulomb(mu), enforcement, 6)[-1] for mu in (0.1, 0.3))
    assert kinetic * 0.999 < forces[-1] < static * 1.001


def test_tables_pass_through_their_points_stay_between_them_and_hold_their_ends():
    """Between two points no value is beyond theirs; outside, the first and the last value."""
    points = ((10.0, 0.3), (20.0, 0.1), (30.0, 0.1), (40.0, 0.25))
    law = pr.FrictionTable(pressure=points)
    p = np.linspace(1.0, 60.0, 2001)
    mu = law.bound(p, 0 * p, At())[0] / p
    assert law.bound(np.array([x for x, _ in points]), np.zeros(4), At())[1].shape == (4,)
    assert np.interp([x for x, _ in points], p, mu) == pytest.approx([y for _, y in points], abs=1e-4)
    for (a, ya), (b, yb) in pairwise(points):
        inside = mu[(p >= a) & (p <= b)]
        assert min(ya, yb) - 1e-12 <= inside.min()
        assert inside.max() <= max(ya, yb) + 1e-12
    assert mu[p < 10] == pytest.approx(0.3)
    assert mu[p > 40] == pytest.approx(0.25)


def test_tables_multiply():
    """μ is the product of the number and of every table that is given."""
    law = pr.FrictionTable(
        mu=0.2, pressure=((0, 1.0), (100, 0.5)), slip=((0, 1.0), (2, 2.0)), speed=((0, 1.0), (10, 0.8))
    )
    tau = bounded(law, np.array([100.0]), np.array([2.0]), At(speed=np.array([10.0])))[0]
    assert tau == pytest.approx(100.0 * 0.2 * 0.5 * 2.0 * 0.8)


def block_that_slides(law: pr.FrictionLaw) -> pr.Problem:
    """A block under a pressure of 30 that slides by 0.3 in one unit of time."""
    return pressed_block(
        pr.Step("press", loads={"block.top": pr.Load(pressure=30.0)}, increments=1),
        pr.Step("slide", fixed={"block.bottom": pr.Fixed(x=0.3)}, increments=3),
        tools={"plane": pr.Plane(normal=(0, 1), at=(0, 0))}, material=pr.Elastic(1e5, 0.0), size=(4, 1), n=(2, 1),
        body="block", sides=("bottom",), friction=law, fixed={"block.bottom": pr.Fixed(x="held")}, kinematics="small",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (pr.FrictionTable(pressure=((0, 0.2), (20, 0.1))), "ends at a pressure of 20 and was used up to 30"),
        (pr.FrictionTable(slip=((0, 0.2), (0.2, 0.1))), "ends at a slip of 0.2 and was used up to 0.3"),
        (pr.FrictionTable(speed=((0, 0.2), (0.25, 0.1))), "ends at a speed of 0.25 and was used up to 0.3"),
        (pr.FrictionTable(pressure=((20, 0.2), (40, 0.1)), slip=((0, 1), (1, 1)), speed=((0, 1), (1, 1))), ""),
    ],
)  # fmt: skip
def test_a_table_that_is_left_is_reported_and_one_that_is_not_is_not(law, said, caplog):
    """Beyond the last value a run goes on with it and says how far; within the table it says nothing."""
    with caplog.at_level(logging.WARNING, "prensa"):
        list(pr.solve(block_that_slides(law)))
    assert [said in m and "block.bottom-plane" in m for m in caplog.messages] == ([True] if said else [])


def test_friction_differs_by_side_and_by_step():
    """Two sides of a strip between dies feel the laws of their contacts, and a step's law replaces the one of its contact."""
    low, high = pr.Coulomb(0.05), pr.WanheimBay(0.8, K)
    strip = pr.Problem(
        "strip", kinematics="small", bodies={"strip": pr.Body(pr.Rectangle(size=(4, 1), n=(4, 1)), pr.Elastic(1e5, 0.0))},
        tools={"lower": pr.Plane(touching="strip.bottom"), "upper": pr.Plane(touching="strip.top")},
        contacts=(pr.Contact("strip.bottom", "lower", low), pr.Contact("strip.top", "upper", high)),
        fixed={"strip.bottom": pr.Fixed(x="held"), "strip.top": pr.Fixed(x="held")},
        steps=(
            pr.Step("press", move={"upper": {"y": -6e-4}}, increments=1),
            pr.Step("slide", fixed={"strip.bottom": pr.Fixed(x=0.2), "strip.top": pr.Fixed(x=0.2)}, increments=2),
            pr.Step(
                "on", fixed={"strip.bottom": pr.Fixed(x=0.4), "strip.top": pr.Fixed(x=0.4)}, increments=2,
                friction={"strip.bottom-lower": pr.Levanov(0.5, K), "strip.top-upper": None},
            ),
        ),
    )  # fmt: skip
    ends = [inc for inc in pr.solve(strip) if inc.end_of_step]
    p = float(ends[1].force("upper").y) / 4.0
    assert ends[1].force("lower").x == pytest.approx(4.0 * 0.05 * p, rel=1e-9)
    assert ends[1].force("upper").x == pytest.approx(4.0 * wanheim_bay(p, K, 0.8), rel=1e-9)
    assert ends[2].force("lower").x == pytest.approx(4.0 * levanov(p, math.sqrt(3) * K, 0.5), rel=1e-9)
    assert abs(ends[2].force("upper").x) <= 1e-9 * p


CASE = """\
name: strip
bodies: {{strip: {{mesh: {{type: rectangle, size: [4, 1], n: [2, 1]}}, material: {{type: elastic, E: 1e5, nu: 0.3}}}}}}
tools: {{die: {{type: plane, touching: strip.top}}}}
friction: {friction}
fixed: {{strip.bottom: xy}}
steps: [{{name: press, move: {{die: {{y: -0.001}}}}}}]
"""


@pytest.mark.parametrize(
    ("friction", "said"),
    [
        ("{type: wanheim_bay, f: 0.5}", "has no shear yield stress"),
        ("{type: levanov, m: 1.5, k: 50}", "must be at most 1"),
        ("{type: wang_osakada, mu: 0.5, k: 50}", "beyond the fit of m"),
        ("{type: stribeck, mu_static: 0.3, mu_kinetic: 0.1, speed: 100 mm}", "is not a speed .*or like '100 mm/s'"),
        ("{type: table}", "give a table over 'pressure', 'slip' or 'speed'"),
        ("{type: table, pressure: [[0, 0.1], [0, 0.2]]}", "the pressure must increase strictly"),
        ("{type: table, pressure: [[0, 1.0e+308], [1, 0.2], [2, 0.1]]}", "no number .* over pressure may be above 1e\\+100"),
        ("{type: table, slip: [[0, 0.1]]}", "at least two pairs"),
        ("{type: capped, mu: 0.1, k: 50, sharpness: 0.5}", "sharpness"),
    ],
)  # fmt: skip
def test_mistakes_are_reported_with_their_place(friction, said):
    """A law that the body cannot feed, or values beyond its range, are refused before anything is solved."""
    with pytest.raises(CaseError, match=f"case.yaml:4:.*{said}"):
        loads(CASE.format(friction=friction), "case.yaml")


def test_speeds_are_read_with_their_unit():
    """A speed in a file may be a text per second, also in a table."""
    law = loads(
        CASE.format(friction="{type: stribeck, mu_static: 0.3, mu_kinetic: 0.1, speed: 10 cm/s}")
    ).problem.friction
    assert law.speed == 100.0
    law = loads(CASE.format(friction="{type: table, speed: [[0, 0.3], [1 m/s, 0.1]]}")).problem.friction
    assert law.speed == ((0.0, 0.3), (1000.0, 0.1))


def test_a_run_with_friction_by_speed_goes_on_from_a_state_bit_for_bit():
    """The speed of slip is part of the committed state: what follows an increment is the same after a resume."""
    law = pr.Stribeck(0.3, 0.1, 0.2, 1.0)
    problem = block_that_slides(law)
    whole = list(pr.solve(problem))
    again = list(pr.solve(problem, start=State.from_arrays(whole[2].state.arrays())))
    assert [i.force("plane") for i in again] == [i.force("plane") for i in whole[3:]]
    assert whole[1].force("plane").x == pytest.approx(
        0.3 * 120.0
    )  # static in the first increment, by the speed after it
    assert all(i.force("plane").x < 0.15 * 120.0 for i in again)
