"""Limit points of contact and friction: tangents of active sets that meet there have determinants of opposite signs."""

import numpy as np
import pytest

import prensa as pr
from prensa.errors import SolveError
from prensa.solver import stability
from prensa.system.failure import LimitPoint
from prensa.system.interaction import ActiveSets
from prensa_bench.robustness.families import drawn


def determinant_and_negatives(eq, result, contacts):
    """Sign of the determinant and the number of negative real eigenvalues of the whole tangent, column by column."""
    e = eq.evaluate(result.u, result.lam, active_sets=ActiveSets(contacts, (None,) * len(eq.system.blocks)))
    free, unit = eq.reduced.free, np.eye(len(e.r))
    K = np.column_stack([eq.reduced.assembly.apply(e.data, unit[:, dof])[free] for dof in free])
    values = np.linalg.eigvals(K)
    return np.linalg.slogdet(K)[0], np.count_nonzero((values.real < 0) & (values.imag == 0))


@pytest.mark.parametrize("number", [0, pytest.param(9, marks=pytest.mark.slow)])
def test_an_ironing_that_friction_ends_is_a_limit_point_with_its_eigenvalue(number, monkeypatch):
    """Newton goes to and fro between sets of sticking and slipping points; one tangent alone has a negative eigenvalue."""
    asked, found = [], stability.eigenvalue_across_sets

    def noted(eq, result):
        asked.append((eq, result))
        return found(eq, result)

    monkeypatch.setattr(stability, "eigenvalue_across_sets", noted)
    ironing = drawn("ironings", 7, number)
    with pytest.raises(SolveError, match=r"the tangent has a negative eigenvalue, -[0-9.]+ where a contact point") as raised:
        list(pr.solve(ironing.problem, ironing.numerics))
    reason = raised.value.reason
    assert isinstance(reason, LimitPoint)
    assert reason.across
    assert reason.eigenvalue < 0
    eq, result = asked[-1]
    signs, negatives = zip(*(determinant_and_negatives(eq, result, sets) for sets in result.active_sets.values()))
    assert set(signs) == {1.0, -1.0}
    assert 0 in negatives
    assert max(negatives) > 0
