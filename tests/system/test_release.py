"""A body that is released has no force to compare a residual with: what round-off leaves counts as balanced."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from problems import stroke, upset_block


@pytest.mark.parametrize("n", [(8, 4), (16, 8)])
def test_a_flattened_strip_is_released(n):
    """The die leaves a plastically flattened strip and no force is left; the stress in the plane is gone, strain stays."""
    p = upset_block(
        stroke(-0.4, increments=10, tool="die", name="flatten"),
        stroke(-0.39, increments=2, tool="die", name="release"), material=pr.J2(1e5, 0.3, pr.Perfect(100.0)), n=n,
        body="strip", plane="die",
    )  # fmt: skip
    increments = list(pr.solve(p))
    last = increments[-1]
    assert abs(last.force("die").y) == 0.0
    assert np.abs(last.bodies["strip"].stress[:, [0, 1, 3]]).max() < 1e-6 * 100.0
    assert last.bodies["strip"].plastic_strain.min() > 0.2
