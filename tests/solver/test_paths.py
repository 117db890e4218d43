"""Other ways to the same answer: contacts that stiffen stage by stage, and the founding paper's iteration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.errors import SolveError
from prensa.fem.planning import plan_step
from prensa.solver.continuation import stages
from prensa.solver.policy import Policy
from prensa.solver.projection import project_stage
from prensa.verify.forming import upsetting

ELASTIC = pr.Elastic(130_000.0, 0.2)


def plate(enforcement, mu=1.0, n=32):
    """Square plate pressed on a plane and pushed along it (Feijóo, Barbosa and Zouain's, code_aster SSNV128)."""
    return pr.Problem(
        "plate", kinematics="small", contact_geometry="reference",
        bodies={"plate": pr.Body(pr.Rectangle(size=(40, 40), n=(n, n)), ELASTIC)},
        tools={"plane": pr.Plane(normal=(0, 1), at=(0, 0))},
        contacts=[pr.Contact("plate.bottom", "plane", friction=pr.Coulomb(mu), enforcement=enforcement)],
        fixed={"plate.right": "x"},
        steps=[pr.Step("push", loads={"plate.top": pr.Load(pressure=50.0), "plate.left": pr.Load(pressure=150.0)}, increments=1)],
    )  # fmt: skip


def sliding(rule="nodal", mu=0.3, tool=None, enforcement=None, law=None):
    """A block pressed by a tool and dragged: every point that stays closed slides."""
    return pr.Problem(
        "drag", bodies={"block": pr.Body(pr.Rectangle(size=(4.0, 2.0), n=(8, 4)), pr.Elastic(1000.0, 0.3), "q4")},
        tools={"tool": tool or pr.Plane(touching="block.top")},
        contacts=[
            pr.Contact("block.top", "tool", law or pr.Coulomb(mu), enforcement or pr.Penalty(), integration=rule)
        ],
        fixed={"block.bottom": "xy"},
        steps=[
            pr.Step("press", move={"tool": {"y": -0.05}}, increments=1),
            pr.Step("drag", move={"tool": {"x": 0.1}}, increments=2),
        ],
    )  # fmt: skip


def last(p, numerics=None, policy=None):
    *_, inc = pr.solve(p, numerics, policy=policy)
    return inc


# ---------------------------------------------------------------------------------------------------- continuation
@pytest.mark.parametrize("beta", [1e3, 1e5])
def test_stages_solve_what_newton_alone_does_not(beta):
    """A plate that Newton fails on at a large beta, uncut, is solved by stages, and the stiff limit is what comes out.

    Without contact steps, which no candidate is allowed for, and with no point decided on within a step: they solve it too.
    """
    uncut, alone = pr.Numerics(max_cutbacks=0), Policy(most_candidates=0, few=0, edge=0)
    with pytest.raises(SolveError, match=r"stagnates|no convergence"):
        last(plate(pr.Penalty(beta, continuation=1.0)), uncut, alone)
    inc = last(plate(pr.Penalty(beta)), uncut, alone)
    soft = last(plate(pr.Penalty(100.0)), uncut)
    assert inc.force("plane").y == pytest.approx(-2000.0, rel=1e-9)
    assert inc.force("plane").x == pytest.approx(soft.force("plane").x, rel=1e-5)
    c = inc.contacts["plate.bottom-plane"]
    k_n = beta * 130_000.0 / (1 - 0.2**2) / (40 / 32)
    assert np.allclose(np.maximum(-c.gap, 0.0) * k_n, c.pressure, rtol=1e-6, atol=1e-6 * c.pressure.max())
    assert (np.abs(c.shear) <= c.pressure * (1 + 1e-12)).all()


@pytest.mark.parametrize("rule", ["nodal", "gauss2"])
def test_stages_lead_to_the_answer_of_newton_alone(rule, monkeypatch):
    """Where both ways converge they meet: to 1e-8 of the displacements, friction and points inside edges included."""
    from prensa.solver import attempt as module

    p = sliding(rule, 0.1, enforcement=pr.Penalty(300.0, 10.0, continuation=4.0))
    direct = last(sliding(rule, 0.1, enforcement=pr.Penalty(300.0, 10.0, continuation=1.0)))
    attempt_by = module.attempt_by

    def only_by_stages(eq, path, start):
        return attempt_by(eq, path or stages(eq.system, eq.context), start)

    monkeypatch.setattr(module, "attempt_by", only_by_stages)
    staged = last(p)
    assert staged.statistics.iterations > direct.statistics.iterations
    assert np.allclose(staged.state.u, direct.state.u, atol=1e-8 * np.abs(direct.state.u).max())


def test_the_stages_rise_to_what_was_asked_for():
    """From beta 10 and beta_T 1 by the factor; softening friction keeps the k_T that it needs; 1 means none."""
    for law, enforcement, k_n, k_t in (
        (pr.Coulomb(0.3), pr.Penalty(1e3, 3.0), [10.0, 100.0], [1.0, 3.0]),
        (pr.Coulomb(0.3), pr.Penalty(1e3, 3.0, continuation=5.0), [10.0, 50.0, 250.0], [1.0, 3.0, 3.0]),
        (pr.Coulomb(pr.MuLinear(0.3, -0.1, 0.1)), pr.Penalty(1e3, 3.0), [10.0, 100.0], [3.0, 3.0]),
        (pr.Coulomb(0.3), pr.Penalty(1e3, 3.0, continuation=1.0), [], []),
        (pr.Coulomb(0.3), pr.Exact(), [], []),
    ):
        system = pr.discretise(sliding(enforcement=enforcement, law=law))
        c = system.context(system.initial(), plan_step(system, 0, np.zeros(system.ndof)), 0.5)
        path = [stage.scales[0] for stage in stages(system, c)]
        assert [float(s.k_n[0] / s.unit[0]) for s in path] == pytest.approx(k_n)
        assert [float(s.k_t[0] / s.unit[0]) for s in path] == pytest.approx(k_t)


@pytest.mark.parametrize("element", ["q4_fbar", "t6", "q8"])
def test_stiffer_contacts_start_from_the_pressures_of_softer_ones(element):
    """Penetrations are divided by the factor of k_n; a held node stays, that on the axis."""
    body = pr.Body(pr.Rectangle(size=(4.0, 2.0), n=(4, 2)), pr.Elastic(1000.0, 0.3), element)
    press = sliding().steps[:1]
    system = pr.discretise(
        replace(sliding(), space="axisymmetric", bodies={"block": body}, fixed={"block.bottom": "y"}, steps=press)
    )
    c = system.context(system.initial(), plan_step(system, 0, np.zeros(system.ndof)), 1.0)
    soft, s = stages(system, c)[0], system.surfaces[0]
    u = system.initial().u.copy()
    u[system.tool_dof(0) + 1] = -0.05
    gap = system.node_stencils(s, project_stage(system, soft, c, u)).g
    on_axis = system.X[s.points.nodes, 0] == 0.0
    assert gap == pytest.approx(np.where(on_axis, -0.05, -0.005))


# ------------------------------------------------------------------------------------------- the paper's iteration
def matrix(p, lagged):
    """The matrix at a sliding state, prescribed unknowns included, and the number of body unknowns."""
    state = last(p).state
    system = pr.discretise(p)
    c = replace(system.context(state, plan_step(system, 1, state.step_start), 2.0), lagged=lagged)
    u = state.u.copy()
    u[system.tool_dof(0)] += 0.3
    e = system.evaluate(c, u, state.lam)
    assert e.contacts[0].slip.any()
    K = csc_matrix((e.data, system.pattern.indices, system.pattern.indptr), (system.ndof, system.ndof))
    return K.toarray(), e.r, 2 * system.nodes


@pytest.mark.parametrize("tool", [None, pr.Circle(radius=3.0, at=(2.0, 5.0))], ids=["plane", "circle"])
def test_the_papers_matrix_is_symmetric_and_its_residual_the_same(tool):
    """K_c of (24)-(26) has no normal-tangential coupling, so the body's matrix is symmetric; the residual is Newton's."""
    p = sliding(tool=tool)
    lagged, r, n = matrix(p, True)
    exact, same, _ = matrix(p, False)
    assert np.array_equal(r, same)
    scale = np.abs(exact).max()
    assert np.abs(lagged - lagged.T)[:n, :n].max() <= 1e-13 * scale
    assert np.abs(exact - exact.T)[:n, :n].max() >= 1e-3 * scale


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=lambda e: e.type)
def test_the_papers_iteration_ends_where_newton_does_but_later(enforcement):
    """Same increments, same answer to 1e-7 of the force; at least half as many iterations again."""
    p = sliding(mu=0.15, enforcement=enforcement)
    paper, newton = (list(pr.solve(p, pr.Numerics(iteration=i, reuse_factors=False))) for i in ("paper", "newton"))
    assert [i.time for i in paper] == [i.time for i in newton]
    for a, b in zip(paper, newton, strict=True):
        assert np.allclose(a.force("tool")[:2], b.force("tool")[:2], atol=1e-7 * b.force("tool").y)
    assert sum(i.statistics.iterations for i in paper) >= 1.5 * sum(i.statistics.iterations for i in newton)


@pytest.mark.parametrize("beta", [9e4, 1e6])
def test_stiff_penalties_end_where_multipliers_do(beta):
    """Gaps and slips have the round-off of positions: stiffness times that is what a residual can reach, and no failure."""
    forces = {}
    for law in (pr.Exact(), pr.Penalty(beta, 10.0 * beta)):
        forces[law.type] = last(upsetting((8, 6), 0.3, enforcement=law, reductions=(0.02,))).force("punch").y
    assert forces["penalty"] == pytest.approx(forces["exact"], rel=1e-6)
