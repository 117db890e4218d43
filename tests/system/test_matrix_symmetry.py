"""Symmetry of the assembled matrix: random states in every combination that is known to be symmetric."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.linear.reduction import Reduced
from prensa.system.matrix_symmetry import is_symmetric
from prensa.system.planning import plan_step
from problems import pressed_block

FLOW = pr.Swift(50.0, 0.01, 0.2)
MATERIALS = {
    "elastic": pr.Elastic(1000.0, 0.3),
    "neo_hooke": pr.NeoHooke(1000.0, 0.3),
    "svk": pr.StVenantKirchhoff(1000.0, 0.3),
    "j2": pr.J2(1000.0, 0.3, FLOW),
    "j2 kirchhoff": pr.J2(1000.0, 0.3, FLOW, yield_on="kirchhoff"),
}
MODES = [("small", "reference"), ("small", "current"), ("finite", "current")]
SPACES = ["plane strain", "axisymmetric", "plane stress"]


def problem(space, mode, element, material, enforcement, led, friction=None, follower=False, rule="nodal"):
    kinematics, geometry = mode
    step = (
        pr.Step("led", move={"tool": pr.Motion(y=-0.05)})
        if led
        else pr.Step("pushed", push={"tool": pr.Push(x=None if space == "axisymmetric" else 0.1, y=-1.0)})
    )
    return pressed_block(
        step, tools={"tool": pr.Circle(radius=6.0, at=(0.0 if space == "axisymmetric" else 2.0, 9.9))},
        material=material, size=(4.0, 4.0), n=(6, 4), origin=(0.5, 0.0), element=element, body="block",
        friction=friction, enforcement=enforcement, integration=rule, space=space, kinematics=kinematics,
        contact_geometry=geometry, loads={"block.right": pr.Load(pressure=5.0, follower=follower)},
    )  # fmt: skip


def skewness(p):
    """Largest entry of K − Kᵀ over the largest of K, free unknowns, at a random state with a history, contact closed."""
    system = pr.discretise(p)
    rng = np.random.default_rng(1)
    plan, state = plan_step(system, 0, np.zeros(system.ndof)), system.initial()
    for t, size in ((0.3, 0.03), (0.6, 0.02)):
        c = system.context(state, plan, t)
        u = state.u + size * rng.normal(size=system.ndof)
        tool = system.tool_dof(0) + np.arange(3)
        u[tool] = [0.0, -0.1, 0.0] if system.axisymmetric else [0.01, -0.1, 0.02]
        e = system.evaluate(c, u, state.lam)
        assert not e.failed
        state = replace(state, u=u, history=e.history)
    assert any((f.p > 0).any() for f in e.contacts)
    reduced = Reduced.of(system, plan.fixed, pr.Numerics())
    K = csc_matrix((e.data, system.pattern.indices, system.pattern.indptr), (system.ndof,) * 2)
    K = K[reduced.free][:, reduced.free]
    return is_symmetric(system, plan), abs(K - K.T).max() / abs(K).max()


@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("space", SPACES)
def test_what_is_said_to_be_symmetric_is(space, mode):
    """K = Kᵀ to round-off for every material, element and enforcement that promises it; each kind of case promises it."""
    promised = 0
    enhanced = "q4", "q4_enhanced", "q4_sheet"
    elements = (*enhanced, "t3") if space == "plane stress" else (*enhanced, "q4_fbar", "q8", "t6")
    for i, (name, material) in enumerate(MATERIALS.items()):
        if mode[0] == "small" and name in ("neo_hooke", "svk"):
            continue
        for j, element in enumerate(elements):
            enforcement = (pr.Penalty(), pr.Augmented(), pr.Exact())[(i + j) % 3]
            rule = "gauss2" if j == 1 and (i + j) % 3 == 0 else "nodal"
            said, skew = skewness(problem(space, mode, element, material, enforcement, (i + j) % 2 == 0, rule=rule))
            if said:
                assert skew <= 1e-12, (name, element)
                promised += 1
    assert promised >= 4


def test_what_is_not_symmetric_is_not_said_to_be():
    """Friction, F-bar in finite strain, flow on the Cauchy stress, live pressure, a free tool on the undeformed geometry."""
    finite, reference = MODES[2], MODES[0]
    elastic, j2, penalty = MATERIALS["neo_hooke"], MATERIALS["j2"], pr.Penalty()
    cases = [
        problem("plane strain", finite, "q4_fbar", MATERIALS["svk"], penalty, True),
        problem("axisymmetric", finite, "q4_fbar", elastic, penalty, True),
        problem("plane strain", finite, "q4", j2, penalty, True),
        problem("plane strain", finite, "q4", elastic, penalty, True, friction=pr.Coulomb(0.3)),
        problem("plane strain", finite, "q4", elastic, penalty, True, friction=pr.Shear(0.3, k=20.0)),
        problem("plane strain", finite, "q4", elastic, penalty, True, follower=True),
        problem("plane strain", reference, "q4", MATERIALS["elastic"], penalty, False),
    ]
    for p in cases:
        said, skew = skewness(p)
        assert not said and skew > 1e-6


def test_f_bar_of_neo_hooke_in_plane_strain_derives_from_an_energy():
    """The area of a quadrilateral is its centroid's Jacobian times a constant: the one symmetric F-bar element."""
    said, skew = skewness(problem("plane strain", MODES[2], "q4_fbar", MATERIALS["neo_hooke"], pr.Penalty(), False))
    assert said and skew <= 1e-12


def test_symmetric_factors_give_the_same_answers(monkeypatch):
    """A neo-Hookean block under a pushed cylinder: forces and displacements as with LU to 1e-9."""
    from prensa.solver import increment_solver

    p = problem("plane strain", MODES[2], "q4", MATERIALS["neo_hooke"], pr.Penalty(), True)
    *_, a = pr.solve(p)
    monkeypatch.setattr(increment_solver, "is_symmetric", lambda system, plan: False)
    *_, b = pr.solve(p)
    np.testing.assert_allclose(a.state.u, b.state.u, rtol=0, atol=1e-9 * np.abs(b.state.u).max())
    assert a.statistics.iterations == b.statistics.iterations
