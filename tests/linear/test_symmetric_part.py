"""P of elements with F-bar, and pressures apart: what they are by definition, and what they save where bricks are no boxes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.linear.iterative import MULTIGRID
from prensa.linear.pressure_apart import PressureApart
from prensa.linear.reduction import Reduced
from prensa.linear.symmetric_part import SymmetricPart
from prensa.policy import Policy
from prensa.system import assembly
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step

SOFT = pr.J2(200e3, 0.3, pr.Swift(K=400.0, e0=0.01, n=0.05))
THIN, RATE = 0.2, 0.02
CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])


def wedge(n, material=SOFT):
    """A wedge of n³ bricks under a plane, from 1 to a fifth thick, its inner nodes displaced at random."""
    box = discretise(problem_of(pr.Box((1.0, 1.0, 1.0), (n, n, n)), material)).meshes["b"]
    x = box.points.copy()
    inner = ((x > 0) & (x < 1)).all(axis=1)
    x[inner] += np.random.default_rng(0).uniform(-0.1, 0.1, (inner.sum(), 3)) / n
    x[:, 1] *= THIN + (1.0 - THIN) * x[:, 0]
    sides = {name: tuple(np.unique(faces).tolist()) for name, faces in box.edges.items()}
    return problem_of(pr.Bricks(tuple(map(tuple, x.tolist())), tuple(map(tuple, box.cells.tolist())), sides), material)


def problem_of(mesh, material):
    """A body under a plane that follows its upper side down."""
    return pr.Problem(
        "wedge", space="solid", friction=pr.Coulomb(0.3), bodies={"b": pr.Body(mesh, material)},
        tools={"t": pr.Plane(normal=(1.0 - THIN, -1.0, 0.0), at=(1.0, 1.0, 0.0))}, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.bottom": "y", "b.left": "x", "b.back": "z"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.1)}, increments=2),),
    )  # fmt: skip


def flowing(problem):
    """Evaluation, equations, matrix and right-hand side of a state of a problem in which it flows and slides."""
    system = discretise(problem)
    plan, state = plan_step(system, 0, np.zeros(system.ndof)), system.initial()
    c, u = system.context(state, plan, 1.0), state.u.copy()
    u[system.tool_dof(0) + 1] -= RATE * THIN  # isochoric flow, to first order, that keeps the slope of the upper side
    system.displacement(u)[:] = RATE * system.positions(u) * (-1.0, -1.0, 2.0)
    nodes, gap = system.surfaces[0].points.nodes, system.nodes_seen(system.surfaces[0], u)
    depth = -200.0 / c.scales[0].k_n
    system.displacement(u)[nodes] += (depth - gap.g[: len(nodes)])[:, None] * gap.n[: len(nodes)]
    u[plan.fixed] *= np.isin(plan.fixed, system.tool_dof(0) + np.arange(6))
    e = system.evaluate(c, u, state.lam)
    assert not e.failed and sum(f.slip.sum() for f in e.contacts) > 1
    reduced = Reduced.of(system, plan.fixed, pr.Numerics(solver="ldlt"), policy=Policy(multigrid_coarsest=200))
    return system, u, e, reduced, reduced.matrix(e, -e.r), reduced.restriction.part(-e.r)


@pytest.fixture(scope="module")
def soft():
    """A wedge of metal that hardens little."""
    return flowing(wedge(8))


class Whole:
    """A restriction that leaves all unknowns."""

    def values(self, data, spent=False):
        """All."""
        return data

    def of_columns(self, columns):
        """All."""
        return columns


def test_p_of_an_element_has_the_row_of_its_dilatation_that_the_tangent_has():
    """γᵀP = γᵀA for the gradient of the dilatation at the centre, by formulas of its own; P is next to A's symmetric part."""
    system, u, e, *_ = flowing(wedge(1))
    part, n = SymmetricPart(system, Whole()), system.dofs.displacement.size
    alone = e._replace(contacts=())
    bulk = np.zeros(system.pattern.entries)
    c = system.context(system.initial(), plan_step(system, 0, np.zeros(system.ndof)), 1.0)
    system.bulk(c, u, np.zeros(system.ndof), bulk)
    A = as_matrix(system, bulk)[:n, :n]
    more = as_matrix(system, part.of_elements(part.of(alone), apart=False))[:n, :n]
    x = system.positions(u)[system.blocks[0].cells[0]]
    gradient = np.zeros((system.nodes, 3))
    gradient[system.blocks[0].cells[0]] = CORNERS / 8 @ np.linalg.inv(x.T @ CORNERS / 8)
    gamma = gradient.ravel() / np.linalg.norm(gradient)
    P = 0.5 * (A + A.T) + more
    assert np.allclose(P, P.T, rtol=1e-12, atol=1e-9 * abs(P).max())
    assert np.linalg.norm(gamma @ A - gamma @ A.T) > 1e-3 * np.linalg.norm(gamma @ A)
    assert np.linalg.norm(gamma @ (P - A)) <= 1e-5 * np.linalg.norm(gamma @ A)
    # nothing else of P differs from the symmetric part
    off = np.eye(n) - np.outer(gamma, gamma)
    assert np.linalg.norm(off @ more @ off) <= 1e-5 * np.linalg.norm(more)


def as_matrix(system, data):
    """A dense matrix in all unknowns."""
    from scipy.sparse import csc_matrix

    return csc_matrix((data, system.pattern.indices, system.pattern.indptr), (system.ndof,) * 2).toarray()


def iterations(f, A, solve, b):
    """Of GMRES to 1e-6."""
    before = f.krylov_iterations
    x = f._krylov(A, solve, b, 1e-6)
    assert x is not None and np.linalg.norm(A @ x - b) <= 2e-6 * np.linalg.norm(b)
    return f.krylov_iterations - before


def test_p_saves_iterations_where_bricks_are_no_parallelepipeds(soft):
    """LDLᵀ of P takes fewer iterations than that of the symmetric part with the stiffness of contact alone."""
    *_, reduced, matrix, b = soft
    f = reduced.factorisation
    A, numbers = f._tangent(matrix), matrix[f._entries :]
    contact = numbers.copy()
    contact[len(f.part.places) :] = 0.0
    with_elements, without = (iterations(f, A, f._preconditioner("ldlt", A, v), b) for v in (numbers, contact))
    assert with_elements <= without - 2


def test_the_matrix_with_pressures_is_the_tangent(soft):
    """With p = Gᵀ u its rows give A u and nothing."""
    *_, reduced, matrix, b = soft
    f = reduced.factorisation
    A = f._tangent(matrix)
    apart = f._preconditioner(MULTIGRID, A, matrix[f._entries :])
    assert isinstance(apart, PressureApart)
    u = np.random.default_rng(0).standard_normal(len(b))
    made = apart.of(A) @ np.concatenate([u, apart.G @ u])
    scale = np.linalg.norm(A @ u)
    assert np.linalg.norm(made[: len(b)] - A @ u) <= 1e-12 * scale and not made[len(b) :].any()


def test_pressures_apart_save_iterations_of_multigrid(soft):
    """Where metal flows they save a quarter at least."""
    *_, reduced, matrix, b = soft
    taken = []
    for most in (reduced.policy.multigrid_incompressible, 0.0):
        policy = replace(reduced.policy, multigrid_incompressible=most)
        f = Reduced.of(reduced.assembly, reduced.fixed, pr.Numerics(solver=MULTIGRID), policy=policy).factorisation
        A = f._tangent(matrix)
        solve = f._preconditioner(MULTIGRID, A, matrix[f._entries :])
        assert isinstance(solve, PressureApart) == (most > 0.0)
        taken.append(iterations(f, A, solve, b))
    assert taken[0] <= 0.75 * taken[1]


@pytest.mark.parametrize(("material", "some"), [(pr.Elastic(200e3, 0.3), False), (pr.NeoHooke(E=10.0, nu=0.495), True)])
def test_bodies_that_change_their_volume_have_no_pressures(material, some):
    """Elastic metal has none, nearly incompressible rubber has them: GMRES with and without solves for A."""
    *_, reduced, matrix, b = flowing(wedge(4, material))
    f = Reduced.of(reduced.assembly, reduced.fixed, pr.Numerics(solver=MULTIGRID), policy=reduced.policy).factorisation
    A = f._tangent(matrix)
    assert isinstance(f._preconditioner(MULTIGRID, A, matrix[f._entries :]), PressureApart) is some
    x = f.step(matrix, b, 1e-6)
    assert f.name == MULTIGRID and np.linalg.norm(A @ x - b) <= 2e-6 * np.linalg.norm(b)


def test_unknowns_that_follow_others_have_their_shares_of_pressures():
    """A sector of a ring held along the normal of an inclined side has the forces of the direct solver."""
    mesh = pr.Revolution(pr.Rectangle((3.0, 2.0), (3, 3), (3.0, 0.0)), 3, angle=np.radians(45.0))
    problem = pr.Problem(
        "ring", space="solid", bodies={"b": pr.Body(mesh, SOFT)}, tools={"t": pr.Plane(touching="b.top")},
        contacts=(pr.Contact("b.top", "t"),), friction=pr.Coulomb(0.1), fixed={"b.bottom": "y", "b.base": "z", "b.cap": "normal"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.2)}, increments=2),),
    )  # fmt: skip
    assert discretise(problem).ties is not None
    policy = Policy(multigrid_coarsest=60)
    (*_, direct), (*_, found) = (pr.solve(problem, pr.Numerics(solver=s), policy=policy) for s in ("superlu", MULTIGRID))
    assert found.statistics.krylov > 0 and found.force("t").y == pytest.approx(direct.force("t").y, rel=1e-8)


@pytest.mark.parametrize(("solver", "asked"), [("superlu", False), ("ldlt", True)])
def test_elements_are_looked_at_for_preconditioners_alone(monkeypatch, solver, asked):
    """A system that is solved by factors of its own matrix needs no parts of stiffnesses."""
    seen = []
    plain = assembly.volumetric_part
    monkeypatch.setattr(assembly, "volumetric_part", lambda *given: seen.append(1) or plain(*given))
    next(iter(pr.solve(wedge(2), pr.Numerics(solver=solver))))
    assert bool(seen) == asked
