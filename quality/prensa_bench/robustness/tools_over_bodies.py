"""Tools that are drawn over bodies in space: narrow ones over the middle, or over the corner of planes of symmetry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from prensa.mesh.generate import mesh_of
from prensa_bench.robustness.bodies_in_space import Body
from prensa_bench.robustness.drawn import Placed, number
from prensa_bench.robustness.split_in_space import contact_nodes
from prensa_bench.robustness.tools_in_space import (
    ball,
    ball_of_triangles,
    cone,
    plate,
    punch,
    ribbed,
    ribs_of_triangles,
    roll,
)

BROUGHT_TOGETHER = 1e-6  # of the height of a body


def tool_drawn(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """A name, the tool, how deep it goes at most, and how far it begins above the body."""
    narrow = () if body.bored else (_ball, _punch, _cone, _ball_of_triangles)  # they would go into its bore
    swept = () if body.round else (_roll, _ribs, _ribs_of_triangles)  # those are no bodies of revolution
    turned = () if body.bored else (_ribs,)
    tools = (plate_drawn, plate_drawn, *swept, *narrow, *turned)
    return tools[rng.integers(len(tools))](rng, body)


def over_nodes(body: Body, tool: Placed) -> Placed:
    """The tool, or, if it would go down through the body between nodes, as a bar narrower than bricks, the same over one."""
    top, at = mesh_of(body.filled).points[contact_nodes(body.filled, "top")], np.asarray(tool.at)
    if tool.outline(top - at + np.array([0.0, body.high, 0.0]))[0].min() < 0.0:
        return tool
    way = (top - at) * [1.0, 0.0, 1.0]
    x, y, z = (at + way[np.argmin(np.linalg.norm(way, axis=1))]).tolist()
    return replace(tool, tool=replace(tool.tool, at=(x, y, z)), at=(x, y, z))


def hovering(body: Body, tool: Placed, depth: float) -> float:
    """Way down to the first contact node, if a tool that goes down by ``depth`` meets none; else 0.

    A punch or the nose of a cone may lie between nodes. It is lowered by the distance of the nearest one, again and again.
    """
    x, way = mesh_of(body.filled).points[contact_nodes(body.filled, "top")] - np.asarray(tool.at), 0.0

    def nearest(down: float) -> float:
        return float(tool.outline(x + np.array([0.0, down, 0.0]))[0].min())

    if nearest(depth) < 0.0:
        return 0.0
    while (near := nearest(way)) > BROUGHT_TOGETHER * body.high and way < body.high:
        way += near
    return way


def plate_drawn(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """Level, or over clamped bodies tilted by up to 3° and above what is highest then."""
    if not body.clamped or rng.random() < 0.5:
        return "plate", plate((0.0, body.high, 0.0), (0.0, -1.0, 0.0)), 0.3 * body.high, 0.0
    a, b = rng.uniform(-0.05, 0.05, 2)
    up = 1.2 * (abs(a) * body.wide + abs(b) * body.deep)  # the right side of a warped box leans out by 20 % at most
    return "tilted plate", plate((0.0, body.high + up, 0.0), (a, -1.0, b)), 0.2 * body.high, up


def _ball(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    R = number(rng, 0.8, 3.0) * min(body.wide, body.deep)
    return "ball", ball((0.0, body.high + R, 0.0), R), min(0.12 * body.high, 0.1 * R), 0.0


def _ball_of_triangles(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """With triangles that see the centre under 8.6° or 17°."""
    R, level = number(rng, 0.8, 3.0) * min(body.wide, body.deep), int(rng.integers(2, 4))
    tool = ball_of_triangles((0.0, body.high + R, 0.0), R, level)
    return "ball of triangles", tool, min(0.12 * body.high, 0.1 * R), 0.0


def _roll(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    R = number(rng, 0.8, 3.0) * min(body.wide, body.deep)
    return "roll", roll((0.0, body.high + R, 0.0), R, str(rng.choice(["x", "z"]))), min(0.12 * body.high, 0.1 * R), 0.0


def _punch(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """Round or a bar, with a fillet of an element about."""
    least = min(body.wide, body.deep)
    width = number(rng, 0.8, 1.4) * least
    fillet, axis = number(rng, 0.2, 0.4) * width, "y" if body.round else str(rng.choice(["x", "y", "z"]))
    return "punch", punch((0.0, body.high, 0.0), width, fillet, axis), 0.08 * body.high, 0.0


def _cone(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """Blunt, with a round nose."""
    slope, least = number(rng, 0.15, 0.5), min(body.wide, body.deep)
    nose = number(rng, 0.5, 1.5) * least
    up = nose * (np.sqrt(1.0 + slope**2) - 1.0)  # of the nose above the tip
    return "cone", cone((0.0, body.high - up, 0.0), slope, 5.0 * least, nose), min(0.1 * body.high, 0.1 * nose), 0.0


def _profile(rng: np.random.Generator, body: Body) -> tuple[str, tuple[tuple[float, float], ...], float]:
    """A rib or a groove of flats and slopes, and a fillet for its convex and concave corners."""
    least = min(body.wide, body.deep)
    inner = number(rng, 0.3, 0.6) * least
    outer, rise = inner + number(rng, 0.3, 0.6) * least, number(rng, 0.1, 0.3) * least
    far = 5.0 * max(body.wide, body.deep) + outer
    groove = rng.random() < 0.4
    high, low = (0.0, rise) if groove else (rise, 0.0)
    points = ((-far, high), (-outer, high), (-inner, low), (inner, low), (outer, high), (far, high))
    return "groove" if groove else "rib", points, number(rng, 0.5, 1.0) * 0.3 * least


def _ribs(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """Along x or z, or round."""
    name, points, fillet = _profile(rng, body)
    ways = ["y"] if body.round else ["x", "z"] if body.bored else ["x", "y", "z"]
    return name, ribbed((0.0, body.high, 0.0), points, fillet, str(rng.choice(ways))), 0.08 * body.high, 0.0


def _ribs_of_triangles(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """Along z, wider than the body."""
    name, points, fillet = _profile(rng, body)
    tool = ribs_of_triangles((0.0, body.high, 0.0), points, fillet, 3.0 * max(body.wide, body.deep))
    return f"{name} of triangles", tool, 0.08 * body.high, 0.0
