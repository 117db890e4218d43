"""Tools with a closed surface that turn far: slip is the way of the tool, whatever the increments."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import prensa as pr
from prensa.contact.pairing import Since, continued
from prensa.errors import SolveError
from prensa.system.failure import TurnedThrough
from prensa.tools.shapes.circle import Disc
from problems import pressed_block, stroke


def roller(increments: int, turns: float = 1.0, kinematics: str = "finite", geometry: str = "current") -> pr.Problem:
    """A roller pressed onto a block, then turned where it stands."""
    return pressed_block(
        stroke(-0.1, increments=2),
        pr.Step("turn", move={"t": pr.Motion(rz=math.tau * turns)}, increments=increments),
        tools={"t": pr.Circle(radius=3, at=(5, 7))}, size=(10, 4), n=(10, 4), friction=pr.Coulomb(0.3),
        kinematics=kinematics, contact_geometry=geometry,
    )  # fmt: skip


@pytest.mark.parametrize("turns", [1.0, -2.75])
@pytest.mark.parametrize(("kinematics", "geometry"), [("finite", "current"), ("small", "reference")])
def test_a_turn_in_one_increment_slips_by_all_of_its_way(kinematics, geometry, turns):
    """The force that a turning roller drags with is that of many increments, and the slip is the way of its surface."""
    few, many = ([*pr.solve(roller(n, turns, kinematics, geometry))][-1] for n in (1, 12))
    assert abs(many.force("t").x) > 0.2 * many.force("t").y
    assert few.force("t").x == pytest.approx(many.force("t").x, rel=1e-6)
    slip = few.contacts["b.top-t"].slip.max()
    assert slip == pytest.approx(abs(turns) * math.tau * 3, rel=0.05)  # the flat lies nearer than the radius


@pytest.mark.parametrize("angle", [0.1, 3.0, 3.3, 6.0, 7.0, -20.0])
def test_a_coordinate_is_counted_on_over_the_cut_of_a_closed_surface(angle):
    """On a disc that turns about its centre a point at rest goes −R θ along the surface, however large θ."""
    shape, at, x = Disc(2.0), np.zeros(2), np.array([[0.3, -1.99], [1.4, 1.4]])
    before, zero = shape.closest(x).s[:, None], np.zeros_like(x)
    c, d = np.cos(angle), np.sin(angle)
    now = shape.closest(x @ np.array([[c, -d], [d, c]])).s[:, None]
    place = np.array([0.0, 0.0, angle])
    went = continued(shape, now, x, zero, at, place, Since(before, zero, np.zeros(3))) - before
    np.testing.assert_allclose(went, -2.0 * angle, rtol=1e-12)


def test_a_tool_that_is_not_round_does_not_turn_through_the_body():
    """A square turned by 360° in one increment would be where it was: refused and cut, and reported where that is not allowed."""
    square = pr.Polygon(points=((-3, -3), (3, -3), (3, 3), (-3, 3)), fillet=0.5, at=(5, 7))
    p = dataclasses.replace(roller(1), tools={"t": square}, friction=None)
    with pytest.raises(SolveError, match="turned by 360° in one increment, right through 'b'") as failed:
        list(pr.solve(p, pr.Numerics(max_cutbacks=0)))
    assert isinstance(failed.value.reason, TurnedThrough)


TURNS = {
    "by a speed, twice round": (pr.Step("a", velocity={"t": pr.Motion(rz=math.tau)}, duration=2.0),),
    "in two steps": (pr.Step("a", by={"t": pr.Motion(rz=math.tau)}), pr.Step("b", by={"t": pr.Motion(rz=math.tau)})),
    "there and back": (pr.Step("a", move={"t": pr.Motion(rz=math.tau)}), pr.Step("b", move={"t": pr.Motion(rz=0.0)})),
    "there and back by a table": (pr.Step("a", move={"t": pr.Motion(rz=((1, 0), (1.5, math.tau), (2, 0)))}),),
    "pressed by a force": (pr.Step("a", by={"t": pr.Motion(rz=math.tau)}, push={"t": pr.Push(y=-25.0)}),),
}


@pytest.mark.parametrize("how", TURNS)
def test_a_full_turn_is_one_however_it_is_driven(how):
    """Forces of one increment and of eight are the same, and friction opposes the last way that was gone."""
    found = []
    for n in (1, 8):
        p = roller(1)
        turned = tuple(dataclasses.replace(s, increments=n) for s in TURNS[how])
        *_, last = pr.solve(dataclasses.replace(p, steps=(p.steps[0], *turned)))
        found.append((last.force("t").x, last.force("t").y))
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert found[0][0] * (1 if "back" in how else -1) > 0.2 * found[0][1]
