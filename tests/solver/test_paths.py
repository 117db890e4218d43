"""Stiff contacts in large increments, and the founding paper's iteration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.system.planning import plan_step
from prensa.verify.forming import upsetting
from problems import pressed_block, stroke

ELASTIC = pr.Elastic(130_000.0, 0.2)


def plate(enforcement, mu=1.0, n=32):
    """Square plate pressed on a plane and pushed along it (Feijóo, Barbosa and Zouain's, code_aster SSNV128)."""
    return pressed_block(
        pr.Step("push", loads={"plate.top": pr.Load(pressure=50.0), "plate.left": pr.Load(pressure=150.0)}, increments=1),
        tools={"plane": pr.Plane(normal=(0, 1), at=(0, 0))}, material=ELASTIC, size=(40, 40), n=(n, n), body="plate",
        sides=("bottom",), friction=pr.Coulomb(mu), enforcement=enforcement, fixed={"plate.right": "x"},
        kinematics="small", contact_geometry="reference",
    )  # fmt: skip


def sliding(rule="nodal", mu=0.3, tool=None, enforcement=None, law=None):
    """A block pressed by a tool and dragged: every point that stays closed slides."""
    return pressed_block(
        stroke(-0.05, increments=1, tool="tool"), pr.Step("drag", move={"tool": {"x": 0.1}}, increments=2),
        tools={"tool": tool or pr.Plane(touching="block.top")}, element="q4", body="block",
        friction=law or pr.Coulomb(mu), enforcement=enforcement, integration=rule,
    )  # fmt: skip


def last(p, numerics=None, policy=None):
    *_, inc = pr.solve(p, numerics, policy=policy)
    return inc


# --------------------------------------------------------------------------------------- stiff contacts, large increments
@pytest.mark.parametrize("beta", [1e3, 1e5])
def test_contact_steps_solve_a_plate_in_one_uncut_increment(beta):
    """A plate with mu = 1 is solved at a large beta without a cut, and the stiff limit is what comes out."""
    uncut = pr.Numerics(max_cutbacks=0)
    inc = last(plate(pr.Penalty(beta)), uncut)
    soft = last(plate(pr.Penalty(100.0)), uncut)
    assert inc.force("plane").y == pytest.approx(-2000.0, rel=1e-9)
    assert inc.force("plane").x == pytest.approx(soft.force("plane").x, rel=1e-5)
    c = inc.contacts["plate.bottom-plane"]
    k_n = beta * 130_000.0 * 0.8 / (1.2 * 0.6) / (40 / 32)  # M/h with M = λ + 2μ
    assert np.allclose(np.maximum(-c.gap, 0.0) * k_n, c.pressure, rtol=1e-6, atol=1e-6 * c.pressure.max())
    assert (np.abs(c.shear) <= c.pressure * (1 + 1e-12)).all()


def test_the_key_continuation_is_read_and_reported():
    """An older case file goes on; the answer is that without the key, and a notice says that it has no effect."""
    old, new = sliding(enforcement=pr.Penalty(continuation=4.0)), sliding()
    (notice,) = [n for n in preflight(pr.discretise(old)) if "continuation" in str(n)]
    assert "no effect" in str(notice)
    assert not [n for n in preflight(pr.discretise(new)) if "continuation" in str(n)]
    assert np.array_equal(last(old).state.u, last(new).state.u)


# ------------------------------------------------------------------------------------------- the paper's iteration
def matrix(p, picard_friction):
    """The matrix at a sliding state, prescribed unknowns included, and the number of body unknowns."""
    state = last(p).state
    system = pr.discretise(p)
    c = replace(system.context(state, plan_step(system, 1, state.step_start), 2.0), picard_friction=picard_friction)
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
    picard_friction, r, n = matrix(p, True)
    exact, same, _ = matrix(p, False)
    assert np.array_equal(r, same)
    scale = np.abs(exact).max()
    assert np.abs(picard_friction - picard_friction.T)[:n, :n].max() <= 1e-13 * scale
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
