"""Outlines of tools for pictures: the drawn polygon is where the tool is."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.path import Path as Polyline

import prensa as pr
from prensa.output.outline import outlines
from prensa.result.increment import Force, Place, ToolState
from prensa.tools.place import place

TOOLS = {
    "punch": pr.Profile(points=((-2.0, 3.0), (-2.0, 0.0), (2.0, 0.0), (2.0, 3.0)), fillet=0.5, at=(0.3, 0.2)),
    "die": pr.Profile(points=((5.0, 0.0), (1.0, 0.0), (1.0, -5.0)), fillet=0.5, at=(0.3, 0.2)),
    "valley": pr.Profile(points=((5.0, 0.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (-5.0, 0.0)), fillet=0.1, at=(0.0, 0.2)),
    "polygon": pr.Polygon(points=((0.0, 0.0), (0.0, 2.0), (2.0, 1.0)), fillet=0.2, at=(-0.5, 0.1)),
    "hole": pr.Profile(points=((-2.0, -1.0), (-2.0, 1.0), (2.0, 1.0), (2.0, -1.0)), closed=True, fillet=0.3, at=(0.1, 0.2)),
    "cavity": pr.Circle(radius=2.0, concave=True, at=(0.1, 0.2)),
}  # fmt: skip


@pytest.mark.parametrize("name", TOOLS)
def test_what_is_drawn_is_where_the_tool_is(name):
    """Points inside the drawn polygon are those with a negative distance, after a motion and a turn."""
    d = TOOLS[name]
    tool = place(name, d, {})
    motion = Place(0.2, -0.1, 0.3)
    (polygon,) = outlines(d, ToolState(tool.at, motion, Force(0.0, 0.0, 0.0)), 6.0)
    x = np.random.default_rng(0).uniform(-2.5, 2.5, (400, 2))
    c, s = np.cos(motion.rz), np.sin(motion.rz)
    g = tool.shape.closest((x - tool.at - motion[:2]) @ np.array([[c, -s], [s, c]])).g
    clear = np.abs(g) > 0.01
    assert np.array_equal(Polyline(polygon).contains_points(x)[clear], (g < 0)[clear])
