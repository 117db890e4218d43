"""A few nodes that hold up Newton's iteration find their equilibrium alone: where, and what that changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from equilibria import of_first_increment
from prensa.analysis import solve
from prensa.model.schema import loads
from prensa.policy import Policy
from prensa.solver.equilibrium import Equilibrium
from prensa.solver.nonlinear_elimination import Coupled, _evaluating, eliminated

SOFT = pr.J2(1000.0, 0.3, pr.Linear(2.0, 5.0))


DRAWN = """
name: drawn
bodies:
  sheet:
    mesh:
      type: patch
      corners: [[-7, 0], [1, 0], [1, 0.652], [-7, 1]]
      n: [48, 4]
      sides:
        top:
          {type: spline, points: [[-6, 1], [-4, 1], [-2.5, 1], [-2.2, 1], [-2, 0.98], [-1.1, 0.67], [-0.9, 0.652], [-0.3, 0.652]]}
    material: {type: j2, E: 50 GPa, nu: 0.3, flow: {type: perfect, s0: 173.205 MPa}}
tools:
  die: {type: profile, points: [[-10, 3.338411], [0, 0.658919], [0.1, 0.658919], [5.1, 5.658919]], at: [0, 0.0015]}
contacts: [{surface: sheet.top, against: die}]
fixed: {sheet.bottom: y}
steps: [{name: draw, fixed: {sheet.right: {x: 0.6}}}]
"""


def block(material: pr.Material = SOFT, element: str = "q4_fbar") -> pr.Problem:
    """A block on a smooth table that is pressed by 1 % without a tool."""
    return pr.Problem(
        "block", bodies={"b": pr.Body(pr.Rectangle((24.0, 24.0), (24, 24)), material, element)},
        fixed={"b.bottom": "y", "b.left": "x"}, steps=(pr.Step("press", fixed={"b.top": pr.Fixed(y=-0.24)}, increments=1),),
    )  # fmt: skip


def uniform(eq: Equilibrium) -> np.ndarray:
    """Degrees of freedom of the pressed block in equilibrium: uniform strain, found by Newton's method from it without flow."""
    u, lam = eq.context.state.u.copy(), eq.system.initial_multipliers(eq.context.state)
    x = eq.system.displacement(u)
    x[:, 1], x[:, 0] = -0.01 * eq.system.X[:, 1], 0.009 * eq.system.X[:, 0]
    for _ in range(20):
        e = eq.evaluate(u, lam)
        u = u + eq.reduced.solve(eq.reduced.matrix(e, -e.r), -e.r)
    assert eq.norm(eq.evaluate(u, lam)) < 1e-9 * e.scale
    return u


@pytest.mark.parametrize("element", ["q4_fbar", "q4_bbar", "q4_enhanced", "q4_sheet"])
def test_residuals_and_matrix_of_a_few_nodes_are_those_of_the_whole(element):
    """The elements beside them are enough: with plastic flow, two bodies, one of them elastic, and contact of one.

    Of metal that has flowed before; in enhanced elements with the modes that they had then.
    """
    one, other = (pr.Rectangle((24.0, 24.0), (24, 24), origin) for origin in ((0.0, 0.0), (30.0, 0.0)))
    problem = replace(
        block(),
        bodies={"a": pr.Body(other, pr.NeoHooke(1000.0, 0.3)), "b": pr.Body(one, SOFT, element)},
        tools={"die": pr.Plane(at=(0.0, 24.0))}, contacts=(pr.Contact("b.top", "die", friction=pr.Coulomb(0.2)),),
        fixed={"b.bottom": "y", "b.left": "x", "a.bottom": "xy"},
        steps=(pr.Step("press", move={"die": pr.Motion(y=-0.24)}, fixed={"a.top": pr.Fixed(y=-0.24)}, increments=1),),
    )  # fmt: skip
    eq = of_first_increment(problem)
    lam = eq.system.initial_multipliers(eq.context.state)
    u, back = np.random.default_rng(3).uniform(-0.02, 0.02, (2, eq.system.ndof))
    before = eq.evaluate(0.1 * back, lam)
    assert not before.failed
    eq = replace(eq, context=replace(eq.context, history=before.history))
    mine = eq.system.boundary_nodes("b.top")[5:9]
    own = np.intersect1d(eq.reduced.free, eq.system.dofs.displacement.dofs(mine))
    whole, few = eq.evaluate(u, lam), _evaluating(eq, own)(u, lam, secant=0.0)
    assert not whole.failed
    assert len(few.history) == 1 and len(few.history[0]) < 12
    full, part = whole.r[own], few.r[own]
    np.testing.assert_allclose(part, full, rtol=0, atol=1e-13 * np.abs(full).max())
    pattern, n = eq.system.pattern, eq.system.ndof
    full = csc_matrix((whole.data, pattern.indices, pattern.indptr), (n, n))[:, own][own].toarray()
    part = Coupled.of(pattern, own).block(few.data)
    np.testing.assert_allclose(part, full, rtol=0, atol=1e-13 * np.abs(full).max())


@pytest.mark.parametrize("element", ["q4_fbar", "q4_bbar", "q4_enhanced", "q4_sheet"])
def test_a_node_that_was_moved_comes_back_and_no_far_one_moves(element):
    """One node in equilibrium is displaced: it and those beside it go back, the others keep their places bit for bit."""
    eq = of_first_increment(block(element=element))
    u = uniform(eq)
    lam = eq.system.initial_multipliers(eq.context.state)
    node = int(np.argmin(np.hypot(*(eq.system.X - [12.0, 12.0]).T)))
    moved = u.copy()
    eq.system.displacement(moved)[node] += [0.05, -0.03]
    e = eq.evaluate(moved, lam)
    found = eliminated(eq, moved, lam, e, 0.0)
    assert found is not None
    there, after = found
    far = np.hypot(*(eq.system.X - eq.system.X[node]).T) > 3.0
    assert np.array_equal(eq.system.displacement(there)[far], eq.system.displacement(moved)[far])
    assert np.hypot(*(eq.system.displacement(there) - eq.system.displacement(u))[node]) < 0.1 * np.hypot(0.05, 0.03)
    assert eq.norm(after) < 0.1 * eq.norm(e)
    assert eq.norm(eq.evaluate(there, lam)) == eq.norm(after)


def test_where_it_is_not_asked_for():
    """In equilibrium, where all nodes miss it, in bodies that cannot flow, without what helps an iteration: nothing is done."""
    eq = of_first_increment(block())
    lam, u = eq.system.initial_multipliers(eq.context.state), uniform(eq)
    assert eliminated(eq, u, lam, eq.evaluate(u, lam), 0.0) is None
    shaken = u + 1e-3 * np.random.default_rng(1).normal(size=len(u)) * np.isin(np.arange(len(u)), eq.reduced.free)
    assert eliminated(eq, shaken, lam, eq.evaluate(shaken, lam), 0.0) is None
    alone = replace(eq, numerics=replace(eq.numerics, line_search=False))
    assert not alone.globalised
    elastic = (block(pr.NeoHooke(1000.0, 0.3), element) for element in ("q4_fbar", "q4_enhanced"))
    for eq in (alone, *map(of_first_increment, elastic)):
        lam, bent = eq.system.initial_multipliers(eq.context.state), eq.context.state.u.copy()
        eq.system.displacement(bent)[80] += 0.05
        assert eliminated(eq, bent, lam, eq.evaluate(bent, lam), 0.0) is None


def test_a_drawn_strip_takes_fewer_iterations_for_the_same_answer():
    """Pull and places are those without it, in the same increments."""
    times = np.arange(1, 16) / 15
    runs = [list(solve(loads(DRAWN).problem, policy=replace(Policy(), local_max_steps=n), times=times)) for n in (0, 6)]
    for a, b in zip(*runs, strict=True):
        assert b.force("die").x == pytest.approx(a.force("die").x, rel=1e-6)
        np.testing.assert_allclose(b.bodies["sheet"].x, a.bodies["sheet"].x, rtol=0, atol=1e-7)
    before, after = (sum(i.statistics.iterations for i in run) for run in runs)
    assert after < 0.95 * before
