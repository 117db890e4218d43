"""Prolongators of multigrid in space: along long edges of bricks nothing is interpolated, and forces of soft motions stay.

Sheared bricks are as long as they are, not as their edges.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyamg.aggregation.aggregation import fit_candidates

import prensa as pr
from prensa.linear.factorisations import krylov
from prensa.linear.iterative import NodalMatrix, geometry_of
from prensa.linear.multigrid import (
    Candidates,
    Multigrid,
    aggregates,
    chains_of,
    edges_of,
    graph_of,
    lengths_of,
    near_edges,
    prolongator,
    soft_motions,
)
from prensa.linear.reduction import Reduced
from prensa.policy import Policy
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step

N, LONG = (10, 6, 10), 5.0


def drawn_out(shift, shear=0.0, held="y"):
    """P and nodes of an elastic block of bricks five times as long in y, their inner nodes displaced by a share of an edge.

    shear: by which the layers of bricks rise along x; ``held``: axes along which the bottom is.
    """
    size = np.array(N) * (1.0, LONG, 1.0)
    problem = pr.Problem(
        "b", space="solid", bodies={"b": pr.Body(pr.Box(tuple(size), N), pr.Elastic(200e3, 0.3))},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": held},
        steps=(pr.Step("s", move={"t": pr.Motion(y=-0.01)}),),
    )  # fmt: skip
    box = discretise(problem).meshes["b"]
    x = box.points.copy()
    inner = ((x > 0) & (x < size)).all(axis=1)
    x[inner] += np.random.default_rng(0).uniform(-shift, shift, (inner.sum(), 3)) * (1.0, LONG, 1.0)
    x[:, 1] += shear * x[:, 0]
    sides = {name: tuple(np.unique(faces).tolist()) for name, faces in box.edges.items()}
    mesh = pr.Bricks(tuple(map(tuple, x.tolist())), tuple(map(tuple, box.cells.tolist())), sides)
    system = discretise(replace(problem, bodies={"b": pr.Body(mesh, pr.Elastic(200e3, 0.3))}))
    plan, state = plan_step(system, 0, np.zeros(system.ndof)), system.initial()
    e = system.evaluate(system.context(state, plan, 0.0), state.u, state.lam)
    reduced = Reduced.of(system, plan.fixed, pr.Numerics(solver="multigrid"))
    f, structure = reduced.factorisation, reduced.factorisation.direct.structure
    values = f._symmetric_values(f._tangent(reduced.matrix(e, -e.r)), np.zeros(f.part.size))
    where = geometry_of(system, reduced.free)
    return NodalMatrix(structure.indptr, structure.indices, where, Policy()).matrix(values), where.nodes


def smoothed(P, nodes, top=2.5):
    """Prolongator, its aggregates' candidates, inverse diagonal blocks and near blocks of the finest level."""
    edges, X = edges_of(nodes, 1.6), nodes.X
    assert edges.drawn
    near = near_edges(P, X, edges, 2.5)
    T, Bc = fit_candidates(aggregates(graph_of(P, near), edges, *chains_of(len(X), edges)), soft_motions(nodes))
    made = Candidates(T, soft_motions(nodes), Bc)
    dense = P.toarray()
    inverse = np.array([np.linalg.inv(dense[i : i + 3, i : i + 3]) for i in range(0, len(dense), 3)])
    return prolongator(P, near, inverse, top, made), made, inverse, near


def test_nothing_is_interpolated_along_long_edges():
    """In a regular block a node's displacements are those of aggregates in its own plane; with all neighbours of three planes."""
    P, nodes = drawn_out(0.0)
    Q, made, inverse, near = smoothed(P, nodes)
    plane, rows = nodes.X[:, 1], np.repeat(np.arange(len(nodes.X)), np.diff(Q.indptr))
    inside = np.diff(made.T.indptr) > 0
    middle = np.bincount(made.T.indices, plane[inside]) / np.bincount(made.T.indices)
    assert not near.all() and np.allclose(plane[rows], middle[Q.indices], atol=1e-9)
    every = prolongator(P, np.ones_like(near), inverse, 2.5, made)
    reach = plane[np.repeat(np.arange(len(plane)), np.diff(every.indptr))] - middle[every.indices]
    assert set(np.unique(np.rint(reach / LONG))) == {-1.0, 0.0, 1.0}


@pytest.mark.parametrize("shift", [0.0, 0.2])
def test_forces_of_soft_motions_are_those_of_the_matrix(shift):
    """Q Bc = B − 4/(3 λ) D⁻¹ A B whatever is left out, of all motions that are independent in a node's aggregate."""
    P, nodes = drawn_out(shift)
    Q, made, inverse, _ = smoothed(P, nodes)
    forces = (P @ made.B).reshape(len(inverse), 3, -1)
    right = made.B - 4 / 3 / 2.5 * np.einsum("nij,njk->nik", inverse, forces).reshape(made.B.shape)
    error = (np.abs(Q @ made.Bc - right) / np.abs(right).max(axis=0)).reshape(-1, 3, 12)
    # a plane of nodes has no motions of its own along y, nor has one that is held any in y
    own = np.einsum("cii->ci", made.Bc.reshape(-1, 12, 12)) != 0.0
    assert (np.diff(made.T.indptr) == 1).all()
    independent = own[made.T.indices]
    assert independent.mean() > (0.85 if shift else 0.7)
    assert error.max(axis=1)[independent].max() < 1e-9


def test_coarse_matrices_of_long_bricks_have_the_blocks_of_cubes():
    """A coarse node has 27 neighbours at most on average, itself among them: 63 where prolongators reach over long edges."""
    P, nodes = drawn_out(0.0)
    grid = Multigrid(P, nodes, Policy(multigrid_coarsest=300))
    coarse = grid.levels[1].A
    blocks = coarse.tobsr((12, 12))
    assert len(blocks.indices) <= 27 * (blocks.shape[0] // 12)
    assert grid.size > 4 * sum(level.Q.nnz + level.R.nnz for level in grid.levels)


UNIT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)


def test_lengths_of_sheared_bricks_are_those_of_their_parallelepipeds():
    """Edges of bricks with right angles; semi-axes of the affine image of a ball otherwise, the same in any orientation."""
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    lengths, along = lengths_of((UNIT * (3.0, 1.0, 2.0) @ turn.T)[None])
    assert lengths[0] == pytest.approx([1.0, 2.0, 3.0], rel=1e-12) and along[0] == 1
    # drawn out by ten, its layers rise by nine: edges of 9.06, 10 and 1, a width of 0.74
    F = np.array([[1.0, 0.0, 0.0], [9.0, 10.0, 0.0], [0.0, 0.0, 1.0]])
    lengths, _ = lengths_of((UNIT @ F.T @ turn.T)[None])
    assert lengths[0] == pytest.approx(np.linalg.svd(F, compute_uv=False)[::-1], rel=1e-10)
    assert lengths[0, 2] > 13.0 and lengths[0, 1] == pytest.approx(1.0)
    # flat by ten, its edges across leaning by five
    F = np.array([[1.0, 0.5, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 1.0]])
    lengths, along = lengths_of((UNIT @ F.T)[None])
    assert lengths[0] == pytest.approx(np.linalg.svd(F, compute_uv=False)[::-1], rel=1e-10) and along[0] == 1


@pytest.mark.parametrize(("shear", "most"), [(0.0, 15), (4.5, 30)])
def test_sheared_bricks_take_few_more_cycles(shear, most):
    """Drawn-out bricks whose layers rise steeply are drawn out as before; taken for flat ones, as their edges are, 69."""
    P, nodes = drawn_out(0.0, shear, "xyz")
    cycle, count = Multigrid(P, nodes, Policy(multigrid_coarsest=300)), [0]
    b = np.random.default_rng(1).standard_normal(P.shape[0])

    def counted(r):
        count[0] += 1
        return cycle(r)

    x = krylov(P.tocsr(), counted, b * nodes.free.ravel(), 100, 1e-8, least=100)
    assert x is not None and count[0] <= most
