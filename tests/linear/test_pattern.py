"""Patterns of matrices: places of elements among their values, rows that are kept once."""

import numpy as np
import pytest
from scipy.sparse import coo_matrix, csc_matrix

import prensa as pr
from prensa.layout import DofMap
from prensa.linear.reduction import Controlled, Reduced, Selected
from prensa.policy import Policy
from prensa.system.assembly import Part, make_pattern, scatter_stiffness, slots_of
from prensa.system.planning import plan_step
from prensa.system.schedule import Control
from prensa.verify import example1


def pressed():
    """The block of the founding paper under its cylinder, in one increment."""
    return example1.problem(
        (14, 12), "finite", "current", pr.NeoHooke(E=example1.E, nu=example1.NU), (example1.press(0.5, 1),)
    )


@pytest.mark.parametrize(("many", "kind"), [(20, np.uint8), (126, np.uint8), (128, np.int32), (300, np.int32)])
def test_stiffness_of_elements_is_added_where_it_belongs_however_many_meet_at_a_node(many, kind):
    """A fan of triangles round a node, whose column has 2 (many + 1) rows: as SciPy adds up triplets, to the last digit."""
    rim = 1 + np.arange(many)
    cells = np.stack([np.zeros(many, dtype=np.int64), rim, 1 + rim % many], axis=1)
    pattern = make_pattern([cells], DofMap(2, many + 1), [])
    slot = slots_of(cells, pattern, 2)
    assert slot.dtype == kind
    K = np.random.default_rng(3).integers(-9, 9, size=(many, 6, 6)).astype(float)
    data = np.zeros(pattern.entries)
    scatter_stiffness(K, cells, slot, pattern.indptr, data)
    dofs = (2 * cells[:, :, None] + np.arange(2)).reshape(many, 6)
    rows, columns = np.repeat(dofs, 6, axis=1).ravel(), np.tile(dofs, 6).ravel()
    expected = coo_matrix((K.ravel(), (rows, columns)), (pattern.n, pattern.n)).toarray()
    assert np.array_equal(csc_matrix((data, pattern.indices, pattern.indptr), (pattern.n,) * 2).toarray(), expected)


def test_rows_kept_by_those_of_the_free_dofs_are_the_rows():
    """Whatever is prescribed, also where a second choice follows on the first, or nothing or everything is free."""
    pattern = pr.discretise(pressed()).pattern
    rows, n = pattern.indices.copy(), pattern.n
    for fixed in (np.arange(0, n, 7), np.arange(n - 40, n), np.arange(n), np.zeros(0, dtype=np.int64)):
        plain = Selected(make_alike(pattern, rows), fixed)
        shared = Selected(pattern, fixed, shared=True)
        assert isinstance(pattern._rows, Part)
        assert np.array_equal(pattern.indices, rows)
        assert np.array_equal(shared.indices, plain.indices)
        assert np.array_equal(shared.indptr, plain.indptr)


def test_several_solutions_reach_the_dofs_that_one_does():
    """All dofs from the free ones, zero where prescribed, column by column; with a lead in place of a factor too."""
    pattern, rng = pr.discretise(pressed()).pattern, np.random.default_rng(7)
    n = pattern.n
    choices = [Selected(pattern, fixed) for fixed in (np.arange(0, n, 7), np.arange(n), np.zeros(0, dtype=np.int64))]
    for restriction in (*choices, Controlled(pattern, np.arange(4), Control(3, n - 1, 0.0))):
        x = rng.standard_normal((len(restriction.free), 3))
        expected = np.zeros((n, 3))
        expected[restriction.free] = x
        assert np.array_equal(restriction.whole(x, n), expected)
        assert np.array_equal(restriction.whole(x[:, 1], n), expected[:, 1])


def make_alike(pattern, rows):
    """A pattern of its own with the rows of another."""
    return type(pattern)(pattern.n, pattern.indptr, rows)


def test_runs_with_rows_kept_once_have_the_same_bits():
    """Elastic bodies of a large system keep one of two patterns: not a bit of displacements, histories and forces changes."""
    plain, shared = (
        [inc.state for inc in pr.solve(pressed(), policy=Policy(shared_pattern_from=size))] for size in (10**9, 0)
    )
    assert len(plain) == len(shared) > 0
    for a, b in zip(plain, shared):
        a, b = a.arrays(), b.arrays()
        assert a.keys() == b.keys()
        assert all(np.array_equal(a[k], b[k], equal_nan=True) for k in a)


def test_rows_are_kept_once_in_large_systems_of_elastic_bodies_alone():
    """Where bodies flow, the rows are asked for at every turn."""
    block = pressed()
    (name,) = block.bodies
    metal = pr.discretise(
        example1.problem(
            (14, 12), "finite", "current", pr.J2(E=200e3, nu=0.3, flow=pr.Perfect(250.0)), (example1.press(0.5, 1),)
        )
    )
    assert name in metal.meshes
    for system, part in ((pr.discretise(block), True), (metal, False)):
        plan = plan_step(system, 0, system.initial().step_start)
        Reduced.of(system, plan.fixed, pr.Numerics(), policy=Policy(shared_pattern_from=0))
        assert isinstance(system.pattern._rows, Part) is part
