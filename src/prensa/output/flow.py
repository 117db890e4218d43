"""Material flow: points that are followed, and a grid drawn on the undeformed bodies, through all their meshes.

Both follow from the initial places that nodes carry from mesh to mesh.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from prensa.errors import PrensaError, shown, take
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.output import plot, style
from prensa.output.cells import triangles
from prensa.remeshing.transfer import at_places, located
from prensa.result.increment import BodyState, Increment
from prensa.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


GRID_LINES = 16  # of the grid along the longer side of a body


def particles(increment: Increment, body: str, points: ArrayLike) -> Array:
    """Where the material is now that was at points (n, 2) of a body of T6 at the beginning.

    Raises
    ------
    PrensaError
        For an unknown body, for one of other elements, and for what are no points.

    """
    take("particles", "increment", increment, Increment, "give what solve yields")
    take("particles", "body", body, str, "give the name of a body")
    if body not in increment.bodies:
        raise PrensaError(f"particles: unknown body {body!r}{suggest(body, increment.bodies)}")
    shape = increment.bodies[body]
    if shape.cells.shape[1] != 6:
        raise PrensaError(f"particles: body {body!r} is not made of T6; give it 'element: t6'")
    try:
        x = np.atleast_2d(np.asarray(points, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        x = np.full((1, 1), np.nan)
    if x.ndim != 2 or x.shape[1] != 2 or not np.isfinite(x).all():
        raise PrensaError(f"particles: points is {shown(points)}; give places, for example [[0, 1], [2, 1]]")
    return at_places(shape.x, shape.cells, located(shape.X, shape.cells, x))


def flow_lines(increment: Increment, problem: Problem) -> Figure:
    """The bodies with the lines of a square grid that was drawn on them at the beginning, and the tools."""
    from matplotlib.tri import Triangulation

    def draw(axes: Axes, body: BodyState, image: plot.Image) -> None:
        x = image.of(body.x)
        there = Triangulation(x[:, 0], x[:, 1], triangles(body.cells))
        low, high = body.X.min(axis=0), body.X.max(axis=0)
        step = float((high - low).max()) / GRID_LINES
        for axis in (0, 1):
            levels = np.arange(low[axis] + 0.5 * step, high[axis], step)
            if len(levels):
                axes.tricontour(there, body.X[:, axis], levels, colors=style.CYCLE[axis], linewidths=0.6)

    return plot.section(increment, problem, draw)
