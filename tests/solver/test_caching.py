"""Caching within a run: values are made once, or looked for only where it matters; answers are those of a full look."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_matrix, random_array

import prensa as pr
from prensa.checks.during.acceptance import Corners, _through, least_corner
from prensa.linear.factorisations import _backward_error
from prensa.linear.reduction import Reduced
from prensa.policy import DEFAULT
from prensa.solver.softest_modes import _begun
from prensa.solver.step_control import StepControl
from prensa.system.planning import plan_step
from prensa.system.time_integration import growths
from problems import pressed_block, stroke


def under(tool: pr.ToolShape) -> pr.Problem:
    """A block that flows below a tool."""
    material = pr.J2(1000.0, 0.3, pr.Linear(2.0, 5.0))
    return pressed_block(stroke(-0.1, increments=2), tools={"t": tool}, material=material, size=(4.0, 1.0), n=(40, 4))


def test_an_error_that_is_small_is_bounded_and_one_that_is_not_is_exact():
    """Against the norms of a dense matrix; the bound is never below the error."""
    rng = np.random.default_rng(5)
    for left in np.geomspace(1e-16, 1.0, 33):
        A = csc_matrix(random_array((50, 50), density=0.1, rng=rng))
        x, b, r = rng.normal(size=50), rng.normal(size=50), left * rng.normal(size=50)
        found = _backward_error(A, x, b, r, float(np.abs(A.data).max()), 1e-13)
        norm = np.abs(A.toarray()).sum(axis=1).max()
        exact = np.abs(r).max() / (norm * np.abs(x).max() + np.abs(b).max())
        assert found >= exact * (1 - 1e-12)
        assert (found <= 1e-13) == (exact <= 1e-13) or exact <= 1e-13 < found
        if found > 1e-13:
            assert found == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("tool", [pr.Circle(radius=1.0, at=(2.0, 4.0)), pr.Ellipse(semi=(1.5, 0.3), at=(2.0, 4.0))])
def test_nodes_that_went_through_a_tool_are_those_of_all_ways(tool):
    """Straight ways of all nodes, at random, sampled one and all, lead through the same tools."""
    system = pr.discretise(under(tool))
    s, rng, shape, found = system.surfaces[0], np.random.default_rng(7), system.tools[0].shape, 0
    for far in (0.3, 1.0, 3.0, 10.0) * 5:
        start = rng.uniform(-2.5, 2.5, (len(s.points.nodes), 2))
        end = start + far * rng.normal(size=start.shape)
        length = np.hypot(*(end - start).T)
        h = min(float(s.points.depth.min()), system.tools[0].thickness)
        samples = min(int(DEFAULT.tunnel_samples * length.max() / h) + DEFAULT.tunnel_samples, DEFAULT.max_tunnel_samples)
        way = start + np.linspace(0.0, 1.0, samples)[:, None, None] * (end - start)
        close = shape.closest(way.reshape(-1, 2))
        g, n = close.g.reshape(samples, -1), close.n.reshape(way.shape)
        expected = np.zeros(len(start), dtype=bool)
        for k in range(len(start)):
            inside = np.flatnonzero(g[:, k] < 0)
            if len(inside) and min(g[0, k], g[-1, k]) > DEFAULT.tunnel_gap_ratio * length[k]:
                expected[k] = n[inside[0], k] @ n[inside[-1], k] < DEFAULT.tunnel_cosine
        assert np.array_equal(_through(system, s, start, end, DEFAULT), expected)
        found += int(expected.sum())
    assert found > 5


def test_strain_that_most_points_stay_below_is_a_quantile_where_it_is_more_than_is_allowed():
    """Else it is 0, and never so where the quantile is above."""
    system = pr.discretise(under(pr.Plane(touching="b.top")))
    control, rng = StepControl(system, plan_step(system, 0, system.initial().u), DEFAULT), np.random.default_rng(2)
    growth = rng.uniform(size=(160, 4)) ** 3
    quantile = float(np.quantile(growth, DEFAULT.plastic_quantile))
    for allowed in [*rng.uniform(size=50), quantile * (1 - 1e-9), quantile * (1 + 1e-9)]:
        assert control._strain([None, growth], float(allowed)) in ((0.0, quantile) if quantile <= allowed else (quantile,))
    assert control._strain([None, growth], 1.0) == 0.0


def test_growth_corners_and_forces_to_begin_with_are_what_they_are_without_being_kept():
    """Plastic strain of a pressed block, its elements' corners, and forces of the modes: asked for twice, and from scratch."""
    increments = list(pr.solve(under(pr.Plane(touching="b.top"))))
    system, (old, new) = pr.discretise(increments[0].problem), (i.state for i in increments)
    (grown,) = growths(system.blocks, new.history, old.history)
    block, corners = system.blocks[0], Corners(system)
    column = block.law.fields["plastic_strain"].columns.start
    assert grown is not None and grown.max() > 0
    assert np.array_equal(grown, new.history[0][..., column] - old.history[0][..., column])
    for u in (old.u, new.u, new.u, old.u):
        fresh = least_corner(system.positions(u)[block.cells.T])
        assert np.array_equal(corners.least(block, u), fresh)
    assert corners.least(block, new.u) is corners.least(block, new.u)
    assert not corners._known
    reduced = Reduced.of(system, plan_step(system, 0, old.u).fixed, pr.Numerics())
    bodily = np.arange(len(reduced.free)) < len(reduced.free) - 3
    first = _begun(reduced, bodily, 4)
    np.testing.assert_allclose(first.T @ first, np.eye(4), atol=1e-14)
    assert not first[~bodily].any()
    assert _begun(reduced, bodily, 4) is first
