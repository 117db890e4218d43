"""Inputs that go wrong without a guard: each fails where `prensa_bench.panel` switches that off."""

from __future__ import annotations

from dataclasses import replace

import pytest

import prensa as pr
from prensa.errors import SolveError
from prensa.fem.time_rule import growths
from prensa.solver.failure import LostSupport
from prensa_bench.robustness.families import drawn


def test_a_strip_that_its_last_tool_has_left_is_refused():
    """A drawn strip that no support holds when the tools have gone: it would end anywhere, without an imbalance to tell."""
    p = drawn("strips", 7, 0).problem
    hold, draw, release = p.steps
    with pytest.raises(SolveError) as caught:
        list(pr.solve(replace(p, steps=(hold, draw, replace(release, fixed={})))))
    assert isinstance(caught.value.reason, LostSupport)


def test_no_point_flows_by_a_strain_of_one_within_an_increment():
    """A stamp pressed in by four elements at once: with the guard the increment is cut until none does."""
    p = pr.Problem(
        "crush", bodies={"b": pr.Body(pr.Rectangle((10, 5), (40, 20), (-5.0, 0.0)), pr.J2(2e5, 0.3, pr.Linear(200.0, 600.0)))},
        tools={"stamp": pr.Stamp(width=3.0, fillet=0.2, touching="b.top")}, contacts=(pr.Contact(("b.top",), "stamp"),),
        friction=pr.Coulomb(0.3), fixed={"b.bottom": "xy"},
        steps=(pr.Step("press", move={"stamp": pr.Motion(y=-1.0)}, increments=1),),
    )  # fmt: skip
    system = pr.discretise(p)
    before = system.initial().history
    for inc in pr.solve(system):
        (growth,) = growths(system.blocks, inc.state.history, before)
        assert growth is not None and growth.max() <= 1.0
        before = inc.state.history
