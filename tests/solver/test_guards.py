"""Inputs that go wrong without a guard: each fails where `prensa_bench.panel` switches that off."""

from __future__ import annotations

from dataclasses import replace

import pytest

import prensa as pr
from prensa.checks.during.acceptance import least_corner
from prensa.errors import SolveError
from prensa.system.failure import LostSupport
from prensa_bench.robustness.families import drawn
from problems import pressed_block, stroke


def test_a_strip_that_its_last_tool_has_left_is_refused():
    """A drawn strip that no support holds when the tools have gone: it would end anywhere, without an imbalance to tell."""
    p = drawn("strips", 7, 1).problem
    hold, draw, release = p.steps
    with pytest.raises(SolveError) as caught:
        list(pr.solve(replace(p, steps=(hold, draw, replace(release, fixed={})))))
    assert isinstance(caught.value.reason, LostSupport)


def test_no_corner_jumps_beyond_half_a_turn_within_an_increment():
    """A stamp pressed in by four elements at once: the increment is cut until no element turns over in one."""
    p = pressed_block(
        stroke(-1.0, increments=1), tools={"t": pr.Stamp(width=3.0, fillet=0.2, touching="b.top")},
        material=pr.J2(2e5, 0.3, pr.Linear(200.0, 600.0)), size=(10, 5), n=(40, 20), origin=(-5.0, 0.0),
        friction=pr.Coulomb(0.3),
    )  # fmt: skip
    system = pr.discretise(p)
    nodes = system.blocks[0].corners.T
    corners = least_corner(system.X[nodes])
    for inc in pr.solve(system):
        before, corners = corners, least_corner(inc.bodies["b"].x[nodes])
        assert not ((corners < -0.1) & (corners < before - 0.5)).any()
