"""Pictures of bodies in space: their outsides in perspective, coloured by a field or by the contact pressure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.mesh.bricks import outside
from prensa.model.problem import Problem
from prensa.output import style
from prensa.output.cells import MOST_EDGES, rings, to_corners
from prensa.result.increment import BodyState, Increment
from prensa.types import Array, Index

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Copy = tuple[Callable[[Array], Array], float]
"""Places of a mirror image, and the sign of its values."""
VIEW: Mapping[str, float] = {"elev": 25.0, "azim": -50.0}
"""Angles in degrees above the horizontal plane and about the vertical axis, y."""
_LIGHT = np.array([0.35, 0.85, 0.4])


def picture(
    increment: Increment, problem: Problem, values: Callable[[str, BodyState], Array], label: str, colours: str,
    ends: tuple[float, float], title: str, mesh: bool | None = None, copies: Sequence[Copy] = ((np.asarray, 1.0),),
    box: Sequence[float] | None = None,
) -> Figure:  # fmt: skip
    """Deformed bodies seen from outside; ``values`` (n,) at the nodes of a body, ``label`` and colour map of them.

    ``mesh``: draw the sides of the faces; None draws them where they can be distinguished. ``copies``: of the bodies, mirrored.
    ``box``: limits (x from, to, y from, to, z from, to); those of the bodies if None.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    with style.styled():
        figure = Figure(figsize=(5.4, 4.4), layout="constrained")
        axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
        scale, shades = Normalize(*ends), colormaps[colours]
        corners, colours_of = [], []
        for name, body in increment.bodies.items():
            faces, value = rings(outside(body.cells)), values(name, body)
            for of, sign in copies:
                x = of(body.x)
                colour = shades(scale(sign * value[faces].mean(axis=1)))
                colour[:, :3] *= _lit(x, faces)[:, None]
                corners += list(_upright(x)[faces])
                colours_of.append(colour)
        # One collection: within it the nearer faces cover those behind, of all bodies and copies.
        shown, colour = corners, np.concatenate(colours_of)
        edge = style.BLACK if (len(shown) <= MOST_EDGES if mesh is None else mesh) else colour
        axes.add_collection3d(Poly3DCollection(shown, facecolors=colour, edgecolors=edge, linewidths=0.25))
        _frame(axes, np.concatenate(shown) if box is None else _upright(np.reshape(box, (3, 2)).T), problem)
        axes.view_init(**VIEW)
        figure.colorbar(ScalarMappable(scale, shades), ax=axes, label=label, shrink=0.75, pad=0.14)
        axes.set_title(title)
    return figure


def contact_pressures(increment: Increment, body: str) -> Array:
    """Contact pressures (n,) at the nodes of a body, the larger where two tools press."""
    out = np.zeros(len(increment.bodies[body].X))
    for contact in increment.contacts.values():
        if contact.body == body:
            np.maximum.at(out, contact.node, contact.pressure)
    nodes = [c.node for c in increment.contacts.values() if c.body == body]
    to_corners(out, increment.bodies[body].cells, np.concatenate([np.zeros(0, dtype=np.int64), *nodes]))
    return out


def _upright(x: Array) -> Array:
    """Positions (…, 3) for axes whose third one stands upright: that is y here."""
    return x[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])


def _lit(x: Array, faces: Index) -> Array:
    """Brightness (k,) of faces, between two thirds and one."""
    a = x[faces]
    # of six nodes those at the corners
    a = a if a.shape[1] == 4 else a[:, [0, 2, 4, 4]]
    n = np.cross(a[:, 2] - a[:, 0], a[:, 3] - a[:, 1])
    if float((n * a.mean(axis=1)).sum()) < 0.0:  # ∫ n·x dA is three times the volume: mirrored faces turn inwards
        n = -n
    n /= np.maximum(np.linalg.norm(n, axis=1), np.finfo(float).tiny)[:, None]
    return np.asarray(2 / 3 + np.clip(n @ _LIGHT, 0.0, 1.0) / 3)


def _frame(axes: Any, shown: Array, problem: Problem) -> None:
    """Limits with equal scales, and names of the axes, for points (k, 3) that are shown."""
    low, high = shown.min(axis=0), shown.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    unit = style.length_unit(problem)
    axes.set(xlabel=f"x ({unit})", ylabel=f"z ({unit})", zlabel=f"y ({unit})")
    axes.yaxis.set_major_formatter(lambda value, _: f"{-value + 0.0:g}")
    axes.locator_params(nbins=4)
