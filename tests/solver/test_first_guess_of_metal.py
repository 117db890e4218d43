"""The first guess of an increment in which metal flows from the beginning: its volume stays, and Newton's method gets there."""

from __future__ import annotations

import pytest

import prensa as pr
from equilibria import of_first_increment
from prensa.solver import predictor
from prensa.solver.predictor import initial_guess

METAL = pr.J2(128e3, 0.34, pr.Linear(190.0, 570.0))
UPSET = 0.06


def bricks(mu: float) -> pr.Problem:
    """A quarter of a block that a plate upsets in one increment."""
    return pr.Problem(
        "block", space="solid", bodies={"b": pr.Body(pr.Box((12.0, 9.0, 6.5), (5, 3, 3)), METAL)},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),),
        friction=pr.Coulomb(mu) if mu else None, fixed={"b.bottom": "y", "b.left": "x", "b.back": "z"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-9.0 * UPSET)}, increments=1),),
    )  # fmt: skip


def widened(problem: pr.Problem) -> float:
    """Stretch along x of a block without friction in the first guess of its increment."""
    eq = of_first_increment(problem, may_go_far=True)
    state = eq.context.state
    guess = initial_guess(eq, state.u, eq.system.initial_multipliers(state))
    return float(eq.system.positions(guess.u)[:, 0].max()) / 12.0


def test_volume_stays_in_the_first_guess(monkeypatch):
    """A block without friction keeps its volume where it flows; an elastic one spreads by ν of its shortening, less than half."""
    kept = (1.0 - UPSET) ** -0.5
    found = widened(bricks(0.0))
    monkeypatch.setattr(predictor, "_flows", lambda *_: False)
    elastic = widened(bricks(0.0))
    assert abs(elastic - kept) > 0.3 * (kept - 1.0)
    assert abs(found - kept) < 0.1 * (kept - 1.0)


def test_a_long_first_increment_of_metal_is_not_cut(monkeypatch):
    """From an elastic guess the tangent of metal under elastic pressure leads where elements turn inside out."""
    (inc,) = pr.solve(bricks(0.34))
    monkeypatch.setattr(predictor, "_flows", lambda *_: False)
    *_, before = pr.solve(bricks(0.34))
    assert inc.statistics.cutbacks == 0 and inc.statistics.iterations <= 8
    assert inc.force("t").y == pytest.approx(before.force("t").y, rel=0.03)  # of one increment and of several
