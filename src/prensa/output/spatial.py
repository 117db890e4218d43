"""Pictures of bodies in space: their outsides, tools as glass before them, sections, coloured by a field or the contact pressure.

Places and numbers stand at axes of matplotlib; what lies in them is drawn pixel by pixel (`prensa.output.raster`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.geometry.reflections import Plane
from prensa.mesh.bricks import outside
from prensa.mesh.level_set import level_set
from prensa.model.names import suggest
from prensa.model.problem import Problem, tools_removed
from prensa.output import raster, style
from prensa.output.cells import MOST_EDGES, covered, to_corners
from prensa.output.mirrors import Image, Whole
from prensa.output.tool_surfaces import drawn_once, frame_box, own_images, surface
from prensa.precision import DRAWN
from prensa.result.increment import BodyState, Increment
from prensa.types import Array, Flags, Index

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VIEWS: Mapping[str, tuple[float, float]] = {
    "iso": (40.0, 25.0), "front": (0.0, 0.0), "back": (180.0, 0.0), "left": (-90.0, 0.0), "right": (90.0, 0.0),
    "top": (0.0, 90.0), "bottom": (0.0, -90.0),
}  # fmt: skip
"""Degrees about the upright axis, from the front to the right, and above the horizontal plane, from where bodies are seen."""
TOOL_SIDE = "tool"  # the view from the side of the tools that press
PIXELS_FOR_EACH, FINE_ENOUGH = 2.0, 200.0  # pixels drawn for each of the picture, and an inch from which on they need be no finer
_LIGHT = np.array([0.25, 0.55, 0.8])  # to the right, upwards, towards the eye
_GLASS = (0.62, 0.66, 0.72, 0.4)
END_ON = 0.99  # cosine of the angle to the eye from which on an axis is seen end on, and its numbers on one another
_TOUCHING = 2e-3  # of the size of the bodies: tools no farther before a body are not drawn before it
_TOOLS_BEYOND = 0.05  # of the size of the bodies


@dataclass(frozen=True)
class Look:
    """How a picture in space is taken; see `prensa.output.plot.deformed` for its fields."""

    view: str | tuple[float, float] = "iso"
    section: str = ""
    mesh: bool | None = None
    box: Sequence[float] | None = None
    size: tuple[float, float] | None = None
    dpi: float | None = None
    tools: bool = True


class Faces(NamedTuple):
    """Triangles of all images: ``x`` (t, 3, 3) corners, ``values`` (t, 3), ``sides`` (t, 3) drawn, ``off`` (t, 3) cut away."""

    x: Array
    values: Array
    sides: Flags
    off: Array


def picture(
    increment: Increment, problem: Problem, values: Callable[[str, BodyState, Image], Array], label: str, colours: str,
    ends: tuple[float, float], title: str, whole: Whole, look: Look,
) -> Figure:  # fmt: skip
    """Deformed bodies and their images seen from outside; ``values`` (n,) at the nodes of one, ``label`` and colour map of them.

    Raises
    ------
    PrensaError
        If there is no such view or section.

    """
    from matplotlib import colormaps
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    from prensa.output.picture import Picture

    angles, cut = view_angles(look.view, increment), _cut(look.section, increment, whole)
    eye = directions(*angles)[2]
    faces = _faces(increment, values, whole, cut, eye)
    with style.styled():
        figure = Picture(figsize=look.size or (5.4, 4.4), layout="constrained", dpi=look.dpi)
        FigureCanvasAgg(figure)
        axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
        scale, shades = Normalize(*ends), colormaps[colours]
        left = faces.x[(faces.off <= 0.0).any(axis=1)].reshape(-1, 3)
        box = np.reshape(look.box, (3, 2)).T if look.box is not None else ends_of(left)
        glass = glass_of(increment, problem, whole, cut, eye) if look.tools else None
        if glass is not None and look.box is not None:
            middle = glass.x.mean(axis=1)
            glass = Faces(*(v[((middle >= box[0]) & (middle <= box[1])).all(axis=1)] for v in glass))
        elif glass is not None:
            box = ends_of(np.concatenate([box, glass.x[(glass.off <= 0.0).any(axis=1)].reshape(-1, 3)]))
        frame(axes, box, problem, angles)
        count = len(faces.sides) // 2
        mesh = count <= MOST_EDGES if look.mesh is None else look.mesh
        paint(axes, faces, glass, lambda v: shades(scale(v)), angles, mesh)
        figure.colorbar(ScalarMappable(scale, shades), ax=axes, label=label, shrink=0.75, pad=0.14)
        axes.set_title(title)
    return figure


def with_tools(increment: Increment, problem: Problem, whole: Whole, box: Array) -> Array:
    """Lowest and highest (2, 3) of what a picture shows: a box (2, 3) about all images of the bodies, and tools before them."""
    glass = glass_of(increment, problem, whole, None, np.zeros(3))
    return box if glass is None else ends_of(np.concatenate([box, glass.x.reshape(-1, 3)]))


def contact_pressures(increment: Increment, body: str, of: str = "") -> Array:
    """Pressures (n,) of a contact, by name, at the nodes of a body; of all if the name is empty, the larger where two press."""
    out = np.zeros(len(increment.bodies[body].X))
    for name, contact in increment.contacts.items():
        if contact.body == body and of in ("", name):
            np.maximum.at(out, contact.node, contact.pressure)
    nodes = [c.node for c in increment.contacts.values() if c.body == body]
    to_corners(out, increment.bodies[body].cells, np.concatenate([np.zeros(0, dtype=np.int64), *nodes]))
    return out


def view_angles(view: str | tuple[float, float], increment: Increment) -> tuple[float, float]:
    """Degrees about the upright axis and above the horizontal plane of a view: a name of `VIEWS`, ``tool``, or the two.

    ``tool`` is ``iso`` where tools press from above, from below if they press there, and turned to where they press from a side.

    Raises
    ------
    PrensaError
        If there is no such view.

    """
    if not isinstance(view, str):
        return float(view[0]), float(view[1])
    if view == TOOL_SIDE:
        return _facing(increment)
    if view in VIEWS:
        return VIEWS[view]
    try:
        turn, lift = map(float, view.split(","))
    except ValueError:
        known = (*VIEWS, TOOL_SIDE)
        message = f"there is no view {view!r}{suggest(view, known)}; views: {', '.join(known)}, or two angles as '40,25'"
        raise PrensaError(message) from None
    return turn, lift


# ------------------------------------------------------------------------------------------------------------- details
def _facing(increment: Increment) -> tuple[float, float]:
    pressed = np.zeros(3)
    for contact in increment.contacts.values():
        if np.isfinite(contact.force).all():
            pressed -= contact.force.sum(axis=0)  # forces on the body point away from the tool
    turn, lift = VIEWS["iso"]
    if pressed[1] < 0.0:
        lift = -lift
    if abs(pressed[1]) < math.hypot(pressed[0], pressed[2]):  # pressed from a side: turned to see that
        turn = max((turn + 90.0 * k for k in (0, 1, -1, 2)), key=lambda a: float(directions(a, lift)[2] @ pressed))
    return turn, lift


def directions(turn: float, lift: float) -> Array:
    """Unit vectors (3, 3) to the right, upwards and towards the eye."""
    a, b = math.radians(turn), math.radians(lift)
    eye = np.array([math.cos(b) * math.sin(a), math.sin(b), math.cos(b) * math.cos(a)])
    right = np.array([math.cos(a), 0.0, -math.sin(a)])
    return np.stack([right, np.cross(eye, right), eye])


def _cut(section: str, increment: Increment, whole: Whole) -> tuple[int, float] | None:
    """Axis and coordinate of a plane across the initial bodies; through the middle of all images if no coordinate is given."""
    if not section:
        return None
    name, _, at = section.partition("=")
    X = np.vstack([image.of(b.X) for image in whole.images for b in increment.bodies.values()])
    try:
        axis = "xyz".index(name.strip())
        coordinate = float(at) if at else 0.5 * float(X[:, axis].min() + X[:, axis].max())
    except ValueError:
        raise PrensaError(f"there is no section {section!r}; write 'x', 'y' or 'z', or with its place as 'x=2.5'") from None
    low, high = float(X[:, axis].min()), float(X[:, axis].max())
    if not low < coordinate < high:
        raise PrensaError(f"the section {section!r} misses the bodies, which reach from {low:.4g} to {high:.4g} there")
    return axis, coordinate


def _faces(
    increment: Increment, values: Callable[[str, BodyState, Image], Array], whole: Whole, cut: tuple[int, float] | None,
    eye: Array,
) -> Faces:  # fmt: skip
    """Outsides and sections of all images, without sides that lie on planes of symmetry, inside of the whole."""
    parts = []
    for name, body in increment.bodies.items():
        faces, size = outside(body.cells), float(np.ptp(body.X, axis=0).max())
        for plane in whole.planes:
            if cut is None or not _along_cut(plane, whole.images, cut[0]):
                faces = faces[(np.abs(plane.distance(body.X[faces])) > 1e-9 * size).any(axis=1)]
        triangles, sides = covered(faces), outer_sides(faces)
        for image in whole.images:
            x, X, value = image.of(body.x), image.of(body.X), values(name, body, image)
            off = np.full(len(X), -1.0)
            if cut is not None:
                beyond = (X[:, cut[0]] - cut[1]) * (-1.0 if eye[cut[0]] < 0.0 else 1.0)
                beyond[np.abs(beyond) < 1e-9 * size] = 0.0
                found = level_set(body.cells, -beyond)
                cap = found.triangles
                none = np.zeros(cap.shape, bool)
                parts.append(Faces(found.of(x)[cap], found.of(value)[cap], none, none - 1.0))
                off = beyond
            parts.append(Faces(x[triangles], value[triangles], sides, off[triangles]))
    return Faces(*(np.concatenate(arrays) for arrays in zip(*parts)))


def _along_cut(plane: Plane, images: Sequence[Image], axis: int) -> bool:
    """Whether an image of a plane of symmetry lies across an axis, where a section may show the sides on it."""
    turns = (np.eye(3) if image.turn is None else image.turn for image in images)
    return any(abs(turn[axis] @ np.asarray(plane.normal)) > 1.0 - DRAWN for turn in turns)


def outer_sides(faces: Index) -> Flags:
    """(t, 3) whether the side of a triangle of `covered` that is across from a corner is a side of its face."""
    if faces.shape[1] == 3:
        return np.ones((len(faces), 3), dtype=bool)
    if faces.shape[1] == 4:  # 0 1 2 and 0 2 3: the diagonal 0 2 is inside
        return np.repeat(np.array([[True, False, True], [True, True, False]]), len(faces), axis=0)
    return np.repeat(np.array([[False, True, True], [True, False, True], [True, True, False], [False] * 3]), len(faces), axis=0)


def glass_of(
    increment: Increment, problem: Problem, whole: Whole, cut: tuple[int, float] | None, eye: Array
) -> Faces | None:
    """Surfaces of the tools near the bodies, cut like these, if they are not removed; ``values``: how high their chords are."""
    if any(step.name == increment.step and tools_removed(problem, k) for k, step in enumerate(problem.steps)):
        return None
    own = ends_of(np.vstack([b.x for b in increment.bodies.values()]))
    parts, margin = [], _TOOLS_BEYOND * float((own[1] - own[0]).max())
    for name, tool in problem.tools.items():
        state = increment.tools[name]
        if not np.isfinite(state.at).all():
            continue  # it was not placed
        made = surface(tool, state, *frame_box(own[None], [state], margin), beyond=0.2)
        one = own_images(tool, [state], made, whole.images)
        if len(one) > 1:  # drawn once, over all images of the bodies before it
            all_of_it = ends_of(np.vstack([whole.images[k].of(b.x) for k in one for b in increment.bodies.values()]))
            made = surface(tool, state, *frame_box(all_of_it[None], [state], margin), beyond=0.2)
        t = made.triangles
        way = np.roll(made.points[t], -1, axis=1) - made.points[t]
        chords = 0.25 * np.abs(np.einsum("tci,tci->tc", way, made.normals[t]))  # R θ²/2 from an end, R θ²/8 in the middle
        for k in drawn_once(whole.images, one, margin):
            x = whole.images[k].of(made.at(state))
            off = np.full(len(x), -1.0) if cut is None else (x[:, cut[0]] - cut[1]) * (-1.0 if eye[cut[0]] < 0.0 else 1.0)
            parts.append(Faces(x[t], chords, np.zeros(t.shape, bool), off[t]))
    return Faces(*(np.concatenate(arrays) for arrays in zip(*parts))) if parts else None


def paint(
    axes: Any, faces: Faces, glass: Faces | None, colours: Callable[[Array], Array], angles: tuple[float, float], mesh: bool
) -> None:
    """Draw bodies, and tools before them, into axes whose limits and view are set."""
    from matplotlib.image import AxesImage

    window = axes.viewLim
    figure = axes.get_figure(root=True)
    finer = max(1.0, min(PIXELS_FOR_EACH, FINE_ENOUGH / figure.dpi))
    pixels = int(finer * figure.dpi * min(figure.get_size_inches()))
    to_pixels = _projected(axes, pixels, window)
    eye = directions(*angles)[2]
    xy = to_pixels(faces.x)
    found = raster.seen(xy, faces.x @ eye, pixels, pixels, faces.off)
    shown = np.tile([1.0, 1.0, 1.0, 0.0], (pixels * pixels, 1))
    shown[found.pixel] = colours(found.of(faces.values))
    shown[found.pixel, :3] *= _lit(faces.x, angles)[found.triangle, None]
    if mesh:
        shown[found.pixel, :3] *= 1.0 - 0.45 * raster.on_sides(found, xy, faces.sides, 0.6 * finer)[:, None]
    if glass is not None:
        front = raster.seen(to_pixels(glass.x), glass.x @ eye, pixels, pixels, glass.off)
        depth = np.full(pixels * pixels, -np.inf)
        depth[found.pixel] = found.depth
        touching = _TOUCHING * float(np.ptp(faces.x.reshape(-1, 3), axis=0).max())
        near = front.depth > depth[front.pixel] + touching + glass.values[front.triangle].sum(axis=1)
        at, share = front.pixel[near], _GLASS[3]
        tone = np.array(_GLASS[:3]) * _lit(glass.x, angles)[front.triangle[near], None]
        shown[at] = np.concatenate([share * tone + (1.0 - share) * shown[at, :3], np.ones((len(at), 1))], axis=1)
    image = AxesImage(axes, extent=(window.x0, window.x1, window.y0, window.y1), origin="lower", interpolation="antialiased")
    image.set_data(shown.reshape(pixels, pixels, 4))
    image.set_zorder(3)
    axes.add_image(image)


def _projected(axes: Any, pixels: int, window: Any) -> Callable[[Array], Array]:
    """Pixels (…, 2) of places (…, 3) in the square that axes in space fill."""
    matrix = axes.get_proj()

    def of(x: Array) -> Array:
        flat = np.concatenate([upright(x).reshape(-1, 3), np.ones((x.size // 3, 1))], axis=1) @ matrix.T
        place = flat[:, :2] / flat[:, 3:]
        share = (place - [window.x0, window.y0]) / [window.width, window.height]
        return np.asarray(pixels * share.reshape(*x.shape[:-1], 2))

    return of


def _lit(x: Array, angles: tuple[float, float]) -> Array:
    """Brightness (t,) of triangles (t, 3, 3) that are seen from a side."""
    right, up, eye = directions(*angles)
    light = _LIGHT @ np.stack([right, up, eye])
    n = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    n *= np.where(n @ eye < 0.0, -1.0, 1.0)[:, None] / np.maximum(np.linalg.norm(n, axis=1), np.finfo(float).tiny)[:, None]
    return np.asarray(0.6 + 0.4 * np.clip(n @ light / np.linalg.norm(light), 0.0, 1.0))


def ends_of(x: Array) -> Array:
    """Lowest and highest (2, 3) of places (n, 3)."""
    return np.stack([x.min(axis=0), x.max(axis=0)])


def upright(x: Array) -> Array:
    """Positions (…, 3) for axes whose third one stands upright: that is y here."""
    return x[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])


def frame(axes: Any, box: Array, problem: Problem, angles: tuple[float, float]) -> None:
    """Limits (2, 3) with equal scales, names of the axes, numbers as far apart as each axis is seen long, and the view."""
    from matplotlib.ticker import MaxNLocator

    ends = np.sort(upright(box), axis=0)
    axes.set(xlim=ends[:, 0], ylim=ends[:, 1], zlim=ends[:, 2])
    axes.set_box_aspect(ends[1] - ends[0])
    unit = style.length_unit(problem)
    axes.set(xlabel=f"x ({unit})", ylabel=f"z ({unit})", zlabel=f"y ({unit})")
    axes.yaxis.set_major_formatter(lambda value, _: f"{-value + 0.0:g}")
    axes.grid(False)
    _, _, eye = upright(directions(*angles))
    seen = (ends[1] - ends[0]) * np.sqrt(1.0 - np.minimum(eye**2, 1.0))
    for axis, along, length in zip((axes.xaxis, axes.yaxis, axes.zaxis), eye, seen / seen.max()):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.set_major_locator(MaxNLocator(max(round(4.0 * float(length)), 1)))
        if axis is not axes.zaxis:
            axis.labelpad = 13.0  # names beside the numbers of a tilted axis
        if abs(along) > END_ON:
            axis.set_ticks([])
            axis.set_label_text("")
            for other in (axes.xaxis, axes.yaxis, axes.zaxis):
                other.labelpad = 10.0  # without it, names and numbers stand on one another in this view
    axes.set_proj_type("ortho")
    axes.view_init(elev=angles[1], azim=angles[0] - 90.0)
