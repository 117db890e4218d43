"""Newton's steps decide on the points that they open and close at the edges of contacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.policy import Policy
from prensa.verify import example1

WITHOUT = Policy(edge_max_points=0)


def solved(problem: pr.Problem, policy: Policy | None = None, numerics: pr.Numerics | None = None) -> list[pr.Increment]:
    return list(pr.solve(problem, numerics, policy=policy))


def iterations(increments: list[pr.Increment]) -> int:
    return sum(i.statistics.iterations for i in increments)


def block(kinematics: str, geometry: str, friction: pr.Coulomb | None = None, increments: int = 2) -> pr.Problem:
    """The cylinder of the founding paper on a block, pressed in so far that tens of points touch it."""
    law, depth = pr.Elastic(E=example1.E, nu=example1.NU), 4.0 if kinematics == "finite" else 2.0
    p = example1.problem((70, 20), kinematics, geometry, law, (example1.press(depth, increments),))
    return p if friction is None else replace(p, friction=friction)


def test_a_linear_problem_takes_one_step():
    """Small strain, reference geometry, no friction: all that is not linear is which points are closed. One step finds them."""
    found, without = solved(block("small", "reference")), solved(block("small", "reference"), WITHOUT)
    for a, b in zip(found, without, strict=True):
        assert a.force("cylinder").y == pytest.approx(b.force("cylinder").y, rel=1e-9)
        assert a.statistics.residuals[-1] < 1e-9
        # the start, and one iterate beyond it
        assert len(a.statistics.residuals) <= 2
        assert len(b.statistics.residuals) > len(a.statistics.residuals)
        contact = a.contacts["block.top-cylinder"]
        assert (contact.pressure[contact.gap > 1e-9] == 0.0).all()
        assert (contact.pressure >= 0.0).all()


@pytest.mark.parametrize("friction", [None, pr.Coulomb(0.2)], ids=["frictionless", "Coulomb"])
@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented()], ids=["penalty", "augmented"])
def test_the_answer_is_the_same_and_takes_fewer_iterations(friction, enforcement):
    """Finite strain on a curved tool: the same forces; what sticks and opens is left to iterations."""
    p = block("finite", "current", friction)
    p = replace(p, contacts=tuple(replace(c, enforcement=enforcement) for c in p.contacts))
    found, without = solved(p), solved(p, WITHOUT)
    assert found[-1].force("cylinder").y == pytest.approx(without[-1].force("cylinder").y, rel=1e-8)
    assert iterations(found) < iterations(without) + (friction is not None)


def test_condensed_bodies_have_the_same_answer():
    """Their responses are those of the contact unknowns alone, several at once."""
    p = block("small", "current", increments=6)
    whole, condensed = (solved(p, None, pr.Numerics(condense=c)) for c in (False, True))
    np.testing.assert_allclose(condensed[-1].force("cylinder"), whole[-1].force("cylinder"), rtol=1e-9, atol=1e-6)


def test_the_iteration_of_the_paper_is_left_as_it_is():
    """It is there for comparison: its iterations are those of the paper."""
    p = block("small", "current")
    paper = pr.Numerics(iteration="paper", max_iterations=200)
    assert iterations(solved(p, None, paper)) == iterations(solved(p, WITHOUT, paper))
