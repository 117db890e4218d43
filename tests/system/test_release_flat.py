"""Sheets that lie flat on a tool: points in tension are released, points that just touch hold a body that nothing loads."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from problems import squeezed_block, stroke

ENFORCEMENTS = [pr.Penalty(), pr.Augmented(), pr.Exact()]


@pytest.mark.parametrize("enforcement", ENFORCEMENTS, ids=lambda e: e.type)
def test_a_sheet_lying_flat_on_its_die_starts_to_bend(enforcement):
    """Most of the sheet rests without load on the flat of the die and lifts off as the punch comes."""
    more = {"enforcement": enforcement}
    problem = pr.Problem(
        "flat",
        space="plane strain",
        bodies={"sheet": pr.Body(pr.Rectangle(size=(60.0, 1.0), n=(60, 2)), pr.Elastic(E=70500.0, nu=0.342))},
        tools={
            "punch": pr.Circle(radius=23.5, above="sheet.top"),
            "die": pr.Profile(
                points=[(80.0, 0.0), (29.0, 0.0), (25.0, -4.0), (25.0, -60.0)], fillet=4.0, at=(0.0, 0.0)
            ),
        },
        contacts=(
            pr.Contact("sheet.top", "punch", pr.Coulomb(0.13), **more),
            pr.Contact("sheet.bottom", "die", pr.Coulomb(0.13), **more),
        ),
        fixed={"sheet.left": "x"},
        steps=(pr.Step("bend", move={"punch": pr.Motion(y=-0.5)}, increments=5),),
    )
    increments = list(pr.solve(pr.discretise(problem)))
    force = increments[-1].force("punch").y
    assert force > 0 and increments[-1].force("die").y == pytest.approx(-force, rel=1e-5)
    assert sum(i.statistics.iterations for i in increments) < 100


@pytest.mark.parametrize("enforcement", ENFORCEMENTS, ids=lambda e: e.type)
def test_a_free_block_at_rest_feels_what_it_stands_on(enforcement):
    """Nothing loads it and nothing but touching points holds it, where coordinates do not end at round numbers."""
    tools = {"punch": pr.Plane(normal=(0.0, -1.0), at=(0.3, 1.999)), "table": pr.Plane(normal=(0.0, 1.0), at=(0.3, 0.7))}
    problem = squeezed_block(
        stroke(-0.3, increments=5, tool="punch", name="come"), tools=tools, size=(3.0, 1.0), n=(9, 3), origin=(0.1, 0.7),
        enforcement=enforcement, fixed={"b.left": "x"},
    )  # fmt: skip
    *_, last = pr.solve(pr.discretise(problem))
    assert last.force("punch").y == pytest.approx(1000.0 / (1 - 0.3**2) * 0.001 * 3.0, rel=0.01)
    assert np.isclose(last.force("table").y, -last.force("punch").y)
