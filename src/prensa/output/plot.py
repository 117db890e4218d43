"""Pictures of a run, as matplotlib figures that belong to the caller: no window, no global state.

Every function returns a `matplotlib.figure.Figure`; `save` writes it. matplotlib is imported when the first picture is made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError
from prensa.geometry.outline import nearest_to_box
from prensa.measures import damage, parse_all
from prensa.measures.columns import directions, place_columns
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.output import style
from prensa.output.answer import turning_about
from prensa.output.cells import MOST_EDGES, around, outline, triangles
from prensa.output.maxima import leading_tool
from prensa.output.mirrors import Image as Image
from prensa.output.mirrors import images as images
from prensa.output.mirrors import mirror_lines as mirror_lines
from prensa.output.mirrors import whole_of
from prensa.output.outline import outlines
from prensa.output.spatial import TOOL_SIDE, Look, contact_pressures, picture
from prensa.result.increment import STATUS, BodyState, ContactState, Increment
from prensa.result.views import Curve
from prensa.types import Array, Index

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAMING = 0.9  # height in inches of a panel's title and the names of its axis
LEAST_EDGE = 1.5  # points of the page that sides of elements are apart where they can be distinguished
OUTLINE = 0.8  # width in points of a body's outline …
OUTLINE_SHARE = 0.15  # … and that over the width of the body at most, so that its colour is seen between two of them
Size = tuple[float, float]
"""Width and height of a picture in inches."""
STRESSES = ("xx", "yy", "zz", "xy")
SPATIAL_FIELDS = ("displacement.z", "stress.yz", "stress.xz")
FIELDS = (
    "mises",
    "plastic_strain",
    "displacement",
    "displacement.x",
    "displacement.y",
    *(f"stress.{c}" for c in STRESSES),
    "mean_stress",
    "triaxiality",
    "lode",
)
"""Of any problem; in plane stress also ``thickness``, of bodies that flow ``strain_rate``, with damage laws ``damage`` (by the
first one) and ``damage.<law>``."""
IF_THERE = ("thickness", "strain_rate")
FIELD_NAMES = {
    "mises": "von Mises stress", "plastic_strain": "equivalent plastic strain", "thickness": "thickness",
    "mean_stress": "mean stress", "triaxiality": "stress triaxiality", "lode": "Lode parameter",
    "strain_rate": "plastic strain rate",
}  # fmt: skip


def save(figure: Figure, path: str | Path, format: str | None = None) -> Path:
    """Write *figure* without the white margin around it (*format*: that of the suffix if None); returns the path."""
    with style.styled():
        for axes in figure.axes:
            style.plain_numbers(axes.xaxis)
            style.plain_numbers(axes.yaxis)
        figure.savefig(path, format=format, bbox_inches="tight", pad_inches=0.06)
    return Path(path)


# ------------------------------------------------------------------------------------------------------ deformed shape
def deformed(
    increment: Increment,
    problem: Problem,
    field: str = "mises",
    mesh: bool | None = None,
    mirror: Sequence[str] = (),
    range: tuple[float, float] | None = None,
    box: tuple[float, ...] | None = None,
    view: str | tuple[float, float] = "",
    section: str = "",
    size: tuple[float, float] | None = None,
    dpi: float | None = None,
) -> Figure:
    """Deformed bodies coloured by *field*, with the tools at their current place; axisymmetric sections are mirrored.

    Parameters
    ----------
    increment, problem
        What to draw, and the description that it belongs to.
    field
        One of `FIELDS`, ``thickness`` in plane stress, or ``damage`` and ``damage.<law>`` of bodies with damage laws.
    mesh
        Draw the element edges; None draws them where they can be distinguished.
    mirror
        Ends of the undeformed bodies (``left``, ``right``, ``bottom``, ``top``, ``back``, ``front``), or flat sides by name
        (``ring.cap``), across which to draw their mirror images.
    range
        Values of the first and the last colour; those of the increment if None.
    box
        Part to show (x from, to, y from, to, in space z from, to); the bodies with the nearest pieces of the tools if None.
    view
        In space, from where: ``iso`` (as if empty), ``front``, ``back``, ``left``, ``right``, ``top``, ``bottom``, ``tool`` (the
        side of the tools that press), or degrees about the upright axis, from the front to the right, and above the horizontal.
    section
        In space, ``x``, ``y`` or ``z``: cut in the middle across that axis, or where ``x=2.5`` says, in the initial bodies.
    size, dpi
        Width and height in inches, and pixels an inch.

    Raises
    ------
    PrensaError
        If *field* or a side is unknown, or bodies of an axisymmetric problem are to be mirrored about more than their axis
        and an end.

    """
    check_damage(problem, field)
    ends = range or colour_range(seen_values(increment, problem, field, mirror), field)
    if problem.space == "solid":
        look = Look(view or "iso", section, mesh, box, size, dpi)
        return _deformed_in_space(increment, problem, field, mirror, ends, look)
    return _deformed_in_plane(increment, problem, field, mesh, mirror, ends, box, size, dpi)


def _deformed_in_plane(
    increment: Increment, problem: Problem, field: str, mesh: bool | None, mirror: Sequence[str], ends: tuple[float, float],
    box: tuple[float, ...] | None, size: Size | None, dpi: float | None,
) -> Figure:  # fmt: skip
    values = [field_values(b, field) for b in increment.bodies.values()]
    planes = mirror_lines(increment, problem, mirror)
    lines = [plane.line for plane in planes]
    box = box or limits(increment, problem, mirror)
    with style.styled():
        wide = (box[1] - box[0]) / (box[3] - box[2])
        figure, axes = _figure(*(size or _size(wide)), dpi=dpi)
        mappable: Any = None
        for image in images(planes):
            sign = image.sign(field, problem)
            for body, value in zip(increment.bodies.values(), values):
                mappable = _coloured(axes, image.of(body.x), body.cells, sign * value, ends, field_map(field))
                _edges(axes, body, image, mesh, lines, box)
            _draw_tools(axes, increment, problem, box, image, lines)
        for axis, at in lines:
            (axes.axhline if axis else axes.axvline)(at, color=style.BLACK, linewidth=0.6, dashes=(10, 3, 2, 3))
        finish_section(axes, problem, box)
        below = wide > 1.1
        place = {"location": "bottom", "ax": axes, "shrink": 0.9, "aspect": 30, "pad": 0.03} if below else \
                {"cax": axes.inset_axes((1.04, 0.0, 0.05, 1.0))}  # fmt: skip
        bar = figure.colorbar(mappable, label=f"{field_name(problem, field)} ({field_unit(problem, field)})", **place)
        bar.outline.set_linewidth(0.6)
        axes.set_title(_moment(increment))
    return figure


def _deformed_in_space(
    increment: Increment, problem: Problem, field: str, mirror: Sequence[str], ends: tuple[float, float], look: Look
) -> Figure:
    whole = whole_of(increment, problem, mirror)
    label, at = f"{field_name(problem, field)} ({field_unit(problem, field)})", _moment(increment)
    own = {name: field_values(b, field) for name, b in increment.bodies.items()}

    def values(name: str, body: BodyState, image: Image) -> Array:
        return image.values(field, body, own[name])

    return picture(increment, problem, values, label, field_map(field), ends, at, whole, look)


def section(increment: Increment, problem: Problem, draw: Callable[[Axes, BodyState, Image], None]) -> Figure:
    """Deformed outlines and tools, with what ``draw`` (axes, body, copy of the section) puts into the bodies."""
    box, planes = limits(increment, problem), mirror_lines(increment, problem, ())
    lines = [plane.line for plane in planes]
    with style.styled():
        figure, axes = _figure(*_size((box[1] - box[0]) / (box[3] - box[2])))
        for image in images(planes):
            for body in increment.bodies.values():
                draw(axes, body, image)
                _edges(axes, body, image, mesh=False, lines=lines, box=box)
            _draw_tools(axes, increment, problem, box, image, lines)
        finish_section(axes, problem, box)
        axes.set_title(_moment(increment))
    return figure


def new_meshes(pairs: Sequence[tuple[Increment, Increment]], problem: Problem) -> Figure:
    """Meshes before and after remeshing: the last increment on the one, the first on the other, a row each."""
    boxes = [limits(before, problem) for before, _ in pairs]
    tall = max((b[3] - b[2]) / (b[1] - b[0]) for b in boxes)
    with style.styled():
        figure, rows = _figure(8.0, (min(3.4 * tall, 4.0) + NAMING) * len(pairs), rows=len(pairs), columns=2, squeeze=False)
        for panels, pair, box in zip(rows, pairs, boxes):
            for axes, increment in zip(panels, pair):
                planes = mirror_lines(increment, problem, ())
                lines = [plane.line for plane in planes]
                for image in images(planes):
                    for body in increment.bodies.values():
                        _edges(axes, body, image, mesh=True, lines=lines, box=box)
                    _draw_tools(axes, increment, problem, box, image, lines)
                finish_section(axes, problem, box)
                axes.set_title(_moment(increment))
    return figure


def field_values(body: BodyState, field: str) -> Array:
    """(n,) nodal values of *field*, one of `FIELDS`; raises PrensaError for another."""
    kind, _, component = field.partition(".")
    if kind == "damage":  # none where a body has no such law
        return body.damage.get(component or next(iter(body.damage), ""), np.zeros(len(body.x)))
    known = (*FIELDS, *(SPATIAL_FIELDS if body.X.shape[1] == 3 else ()), *IF_THERE)
    if field not in known:
        raise PrensaError(f"unknown field {field!r}{suggest(field, known)}")
    if kind == "stress":
        return body.stress[:, (*STRESSES, "yz", "xz").index(component)]
    if kind == "displacement":
        u = body.displacement
        return u[:, "xyz".index(component)] if component else np.linalg.norm(u, axis=1)
    if kind == "thickness" and body.thickness is None:
        raise PrensaError("the field 'thickness' is there in plane stress only; draw 'plastic_strain' instead")
    if kind == "strain_rate" and body.strain_rate is None:
        raise PrensaError("the field 'strain_rate' was not kept by the version that wrote this run; run the case again")
    return np.asarray(getattr(body, kind))


def seen_values(increment: Increment, problem: Problem, field: str, mirror: Sequence[str]) -> list[Array]:
    """Values of a field on bodies and, of components in space, on their images, which are turned."""
    values = [field_values(b, field) for b in increment.bodies.values()]
    if problem.space != "solid" or not mirror:
        return values
    pairs = list(zip(increment.bodies.values(), values))
    return [image.values(field, b, v) for image in whole_of(increment, problem, mirror).images for b, v in pairs]


def check_damage(problem: Problem, field: str) -> None:
    """Raise PrensaError where *field* is a damage that no body has."""
    known = damage.fields(problem)
    if field.partition(".")[0] == "damage" and field not in known:
        remedy = "give a body one, as in 'damage: {type: cockcroft_latham}'"
        raise PrensaError(f"unknown field {field!r}{suggest(field, known)}" if known else f"no body has a damage law; {remedy}")


def fields_of(problem: Problem, increments: Sequence[Increment]) -> list[str]:
    """The fields that have something to show in some increments, in the order of `FIELDS`."""
    bodies = [b for i in increments for b in i.bodies.values()]
    thin = problem.space == "plane stress"
    absent = {"stress.zz"} if thin else set()  # it is zero
    if not any(b.plastic_strain.any() for b in bodies):
        absent.add("plastic_strain")
    flows = all(b.strain_rate is not None and b.strain_rate.any() for b in bodies)
    damaged = [f"damage.{name}" for name in dict.fromkeys(name for b in bodies for name in b.damage)]
    more = [*(["strain_rate"] if flows else []), *(["thickness"] if thin else [])]
    more += [*(SPATIAL_FIELDS if problem.space == "solid" else ()), *damaged]
    return [f for f in (*FIELDS, *more) if f not in absent] if bodies else []


def field_name(problem: Problem, field: str) -> str:
    """Name of a field as printed beside its colours."""
    kind, _, component = field.partition(".")
    names = style.axes_names(problem)
    first, second = names[:2]
    if kind == "stress":
        letters = {"x": first, "y": second, "z": "θ" if problem.space == "axisymmetric" else "z"}
        return f"stress {letters[component[0]]}{letters[component[1]]}"
    if kind == "displacement":
        return f"displacement {names['xyz'.index(component)]}" if component else "displacement"
    if kind == "damage":
        return f"damage, {_law(problem, component).heading}"
    return FIELD_NAMES[kind]


def _law(problem: Problem, name: str) -> damage.DamageLaw:
    """The damage law of a name, or the first one."""
    return next(law for _, law in damage.laws(problem) if name in ("", law.name))


def field_unit(problem: Problem, field: str) -> str:
    """Unit of a field."""
    if field.startswith("damage"):
        return damage.unit_of(problem, _law(problem, field.partition(".")[2])) or "–"
    if field in ("plastic_strain", "triaxiality", "lode"):
        return "–"
    if field == "strain_rate":
        return "1/s"
    return style.length_unit(problem) if field.startswith(("disp", "thick")) else style.pressure_unit(problem)


def field_map(field: str) -> str:
    """Name of its colour map: two-sided about zero for quantities that have a sign."""
    return style.DIVERGING if field.startswith(("stress", "displacement.", "mean_stress", "triax", "lode")) else style.SEQUENTIAL


# ------------------------------------------------------------------------------------------------------------ contacts
def pressure(
    contact: ContactState, problem: Problem, reference: Mapping[str, Curve] | None = None, title: str = "",
    size: tuple[float, float] | None = None, dpi: float | None = None,
) -> Figure:  # fmt: skip
    """Profile along the surface: pressure from nodal forces, from stresses, at the integration points, and the shear.

    Stresses are shown where the surfaces touch; the band between the first two pressures is their disagreement, the error
    bar. The integration points are shown where they are not the nodes. On quadratic edges the stresses are the smoothed ones
    alone, and the line is theirs: nodal forces and recovered stresses at corners and middles scatter about it.

    Parameters
    ----------
    contact, problem
        What to draw. The abscissa is x or y along straight surfaces, else the arc length along the current surface.
    reference
        Further curves by name: (abscissa, pressure) or a function of the abscissa.
    title
        Above the picture; the names of surface and tool if empty.
    size, dpi
        Width and height in inches, and pixels an inch.

    """
    s, label = abscissa(contact, problem)
    order = np.argsort(s)
    s, p = s[order], contact.pressure[order]
    closed = contact.status[order] != STATUS.index("open")
    quadratic = on_quadratic_edges(contact, problem)
    of_stress = contact.pressure_smoothed if quadratic else contact.pressure_from_stress
    stress, shear = np.where(closed, of_stress[order], np.nan), np.abs(contact.shear[order])
    low, high = _closed_range(s, contact.status[order])
    shown = (s >= low) & (s <= high)
    with style.styled():
        figure, axes = _figure(*(size or (4.5, 3.7)), dpi=dpi)
        axes.fill_between(s, p, stress, color=style.BLUE, alpha=0.15, linewidth=0, where=closed.tolist())
        axes.plot(s, p, "o" if quadratic else "o-", color=style.BLUE, label="p, nodal forces")
        _stresses_into(axes, s, stress, None if quadratic else np.where(closed, contact.pressure_smoothed[order], np.nan))
        if not np.array_equal(contact.points.X, contact.X):
            at = np.interp(_arc(contact.points.x, contact.x), _arc(contact.x, contact.x), abscissa(contact, problem)[0])
            axes.plot(at, contact.points.pressure, "x", color="0.45", markersize=4, label="p, integration points")
        if shear.max(initial=0.0) > 1e-9 * max(p.max(initial=0.0), 1e-300):
            axes.plot(s, shear, "s-", color=style.GREEN, markersize=2.5, linewidth=1.2, label="|shear|, nodal forces")
        top = max(p[shown].max(initial=0.0), np.nanmax(stress[closed], initial=0.0))
        for (name, curve), line in zip((reference or {}).items(), cycle(("-", "--", ":", "-."))):
            x, y = (np.linspace(low, high, 401),) * 2 if callable(curve) else curve
            y = curve(x) if callable(curve) else y
            axes.plot(x, y, line, color=style.BLACK, linewidth=1.1, label=name, zorder=1.5)
            top = max(top, float(np.nanmax(y)))
        axes.set(xlim=(low, high), xlabel=label, ylabel=f"traction ({style.pressure_unit(problem)})")
        axes.set_ylim(min(0.0, 1.05 * float(np.nanmin(stress[closed], initial=0.0))), 1.06 * top if top > 0 else 1.0)
        if not closed.any():
            axes.annotate("no contact", (0.5, 0.5), xycoords="axes fraction", ha="center", color="0.4")
        axes.set_title(title or f"{contact.surface} on {contact.tool}")
        _legend(figure, axes)
    return figure


def _stresses_into(axes: Axes, s: Array, stress: Array, smooth: Array | None) -> None:
    """Pressures of stresses (k,) along a contact; ``smooth`` None: the former are the smoothed ones."""
    if smooth is None:
        axes.plot(s, stress, "-", color=style.PURPLE, label="p, smoothed stress")
        return
    axes.plot(s, stress, "--", color=style.ORANGE, linewidth=1.2, label="p, recovered stress")
    axes.plot(s, smooth, ":", color=style.PURPLE, linewidth=1.2, label="p, smoothed stress")


def on_quadratic_edges(contact: ContactState, problem: Problem) -> bool:
    """Whether the edges of a contact's body have nodes in their middles."""
    return contact.body in problem.bodies and problem.has_quadratic_edges(contact.body)


def contact_at(increment: Increment, contact: str, problem: Problem, mirror: Sequence[str] = ()) -> Figure:
    """`pressure` of a contact, by name, with the moment in the title; in space its pressure on the bodies."""
    if problem.space == "solid":
        return pressures_in_space(increment, problem, contact, mirror=mirror)
    return pressure(increment.contacts[contact], problem, title=title(increment, contact))


def pressures_in_space(
    increment: Increment, problem: Problem, contact: str = "", mirror: Sequence[str] = (),
    range: tuple[float, float] | None = None, title: str = "", **look: Any,
) -> Figure:  # fmt: skip
    """Pressure of a contact, or of all if it is empty, on the bodies, seen from the side of the tools, which are left out.

    ``mirror``, ``range``, and ``look``: ``mesh``, ``box``, ``view``, ``section``, ``size``, ``dpi``, as of `deformed`; ``title``:
    above the picture, that of the contact and the moment if empty.
    """
    values = {name: contact_pressures(increment, name, contact) for name in increment.bodies}
    ends = range or (0.0, max((float(v.max(initial=0.0)) for v in values.values()), default=0.0) or 1.0)
    label = f"contact pressure ({style.pressure_unit(problem)})"
    whole = whole_of(increment, problem, mirror)
    given = {key: value for key, value in look.items() if value not in (None, "")}
    taken = replace(Look(view=TOOL_SIDE, tools=False), **given)
    text = title or (_title(increment, contact) if contact else _moment(increment))
    return picture(increment, problem, lambda name, *_: values[name], label, style.SEQUENTIAL, ends, text, whole, taken)


def title(increment: Increment, contact: str) -> str:
    """Name of a contact above the moment."""
    return f"{contact}\n{_moment(increment)}"


_title = title


def _arc(x: Array, along: Array) -> Array:
    """Arc length (k,) of points x (k, 2) on the polygon along (n, 2), by their nearest edge."""
    a, d = along[:-1], np.diff(along, axis=0)
    size = np.hypot(*d.T)
    share = np.clip(((x[:, None] - a) * d).sum(axis=2) / size**2, 0.0, 1.0)
    edge = np.argmin(np.hypot(*np.moveaxis(x[:, None] - a - share[..., None] * d, -1, 0)), axis=1)
    start = np.concatenate([[0.0], np.cumsum(size)])
    return np.asarray(start[edge] + share[np.arange(len(x)), edge] * size[edge])


def abscissa(contact: ContactState, problem: Problem) -> tuple[Array, str]:
    """(k,) coordinate along a contact surface and its label with the unit."""
    span = np.ptp(contact.x, axis=0)
    i = int(np.argmax(span))
    steps = np.diff(contact.x[:, i])
    if span[i] > 3 * span[1 - i] and (np.all(steps > 0) or np.all(steps < 0)):
        return contact.x[:, i], f"{style.axes_names(problem)[i]} ({style.length_unit(problem)})"
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(contact.x, axis=0).T))])
    return s, f"length along {contact.surface} ({style.length_unit(problem)})"


# --------------------------------------------------------------------------------------------------------- time series
def force_stroke(
    history: Mapping[str, NDArray[Any]], problem: Problem, size: Size | None = None, dpi: float | None = None
) -> Figure:
    """Tool forces, and moments of tools that turn, against the travel of the tool that does the work.

    Against its rotation where it only turns, against time where nothing moves. What happens while that tool stands still is
    no travel and is left out. Ticks at the bottom: new meshes. *history* is what `read_history` returns; ``size``, ``dpi`` as of
    `deformed`.
    """
    leading = leading_tool(history, problem)
    history = _from_zero(history)
    along, label = _stroke(history, problem, leading)
    about = {t: turning_about(history, t, problem) for t in problem.tools if problem.space != "axisymmetric"}
    turning = {t: f"{t}.m{turn[1]}" for t, turn in about.items() if turn and np.any(history[f"{t}.m{turn[1]}"])}
    with style.styled():
        wide, high = size or (4.5, 5.4 if turning else 3.7)
        figure, panels = _figure(wide, high, rows=2 if turning else 1, dpi=dpi, sharex=True)
        axes, below = panels if turning else (panels, None)
        _forces_into(axes, history, problem, along)
        if "remeshings" in history:
            for at in along[np.flatnonzero(np.diff(history["remeshings"]) > 0) + 1]:
                axes.axvline(at, ymax=0.03, color=style.BLACK, linewidth=0.6)
        axes.set_ylabel(f"force on the tool ({style.force_unit(problem)})")
        if below is not None:
            for tool, column in turning.items():
                i = list(problem.tools).index(tool)
                below.plot(*broken(along, history[column]), color=style.CYCLE[i % len(style.CYCLE)])
            below.set_ylabel(f"moment ({style.moment_unit(problem)})")
            below.axhline(0.0, color=style.BLACK, linewidth=0.6)
        (below or axes).set_xlabel(label)
        axes.axhline(0.0, color=style.BLACK, linewidth=0.6)
        _legend(figure, axes)
    return figure


def _forces_into(axes: Axes, history: Mapping[str, Array], problem: Problem, along: Array) -> None:
    names = style.axes_names(problem)
    every = (("y", "-"), ("x", "--"), ("z", ":"))[: directions(problem)]
    shown = every[:1] if problem.space == "axisymmetric" else every  # radial forces balance
    largest = max((np.abs(history[f"{t}.f{c}"]).max(initial=0.0) for t in problem.tools for c, _ in every), default=0.0)
    for i, tool in enumerate(problem.tools):
        for c, line in shown:
            force = history[f"{tool}.f{c}"]
            if np.abs(force).max(initial=0.0) > 1e-6 * largest:
                axes.plot(*broken(along, force), line, marker="o" if len(force) <= 60 else "", markersize=2.5,
                          color=style.CYCLE[i % len(style.CYCLE)], label=f"{tool}, {names['xyz'.index(c)]}")  # fmt: skip


def energy(
    history: Mapping[str, NDArray[Any]], problem: Problem, size: Size | None = None, dpi: float | None = None
) -> Figure:
    """Energy balance against time: where the external work went (above) and what is not accounted for (below)."""
    history = _from_zero(history)
    time, external = history["time"], history["energy.external"]
    parts = {"elastic": style.SKY, "plastic": style.RED, "friction": style.GREEN, "contact": style.PURPLE}
    scale = max(float(np.abs(history[f"energy.{k}"]).max(initial=0.0)) for k in ("external", *parts))
    with style.styled():
        figure, (axes, below) = _figure(
            *(size or (4.5, 4.4)), rows=2, dpi=dpi, gridspec_kw={"height_ratios": [2.6, 1]}, sharex=True
        )
        base = np.zeros_like(time)
        for name, colour in parts.items():
            values = history[f"energy.{name}"]
            if np.abs(values).max(initial=0.0) > 1e-4 * scale:
                axes.fill_between(time, base, base + values, color=colour, alpha=0.75, linewidth=0, label=name)
                base = base + values
        axes.plot(time, external, color=style.BLACK, label="external work")
        axes.set_ylabel(f"energy ({style.energy_unit(problem)})")
        _legend(figure, axes)
        relative = np.maximum(np.abs(history["energy.imbalance"][1:]) / scale if scale > 0 else 0 * time[1:], 1e-17)
        below.semilogy(time[1:], relative, "o-" if len(time) <= 60 else "-", color=style.BLACK, markersize=2.5)
        below.set(xlabel="time", ylabel="|imbalance|\n/ largest energy")
        below.set_ylim(*_decades(relative))
    return figure


def measures(table: Mapping[str, NDArray[Any]], problem: Problem) -> Figure:
    """Curves of the measures of a case over time, one below the other; *table* is what `read_measures` returns."""
    known = parse_all(problem)
    with style.styled():
        figure, rows = _figure(4.5, 1.0 + 1.35 * len(known), rows=len(known), sharex=True, squeeze=False)
        for axes, (name, measure) in zip(rows[:, 0], known.items()):
            axes.plot(table["time"], table[name], "o-", color=style.BLUE, markersize=2.5)
            axes.set(ylabel=measure.unit or "–")
            axes.set_title(f"{name}: {problem.measures[name]}")
        rows[-1, 0].set(xlabel="time")
    return figure


def convergence(
    history: Mapping[str, NDArray[Any]], iterations: Mapping[str, NDArray[Any]], problem: Problem, tolerance: float,
    size: Size | None = None, dpi: float | None = None,
) -> Figure:  # fmt: skip
    """Residual at each iteration of each increment (left) and iterations per increment (right).

    *iterations* is what `read_convergence` returns; *tolerance* is drawn.
    """
    numbers = np.unique(iterations["increment"])
    with style.styled():
        import matplotlib

        figure, (axes, right) = _figure(*(size or (4.5, 5.2)), rows=2, dpi=dpi)
        colours = matplotlib.colormaps[style.SEQUENTIAL](np.linspace(0.0, 0.9, max(len(numbers), 2)))
        for number, colour in zip(numbers, colours):
            chosen = iterations["increment"] == number
            axes.semilogy(iterations["iteration"][chosen], np.maximum(iterations["residual"][chosen], 1e-17), "o-",
                          color=colour, linewidth=0.8, markersize=2, alpha=0.8)  # fmt: skip
        axes.axhline(tolerance, color=style.RED, linewidth=0.9, dashes=(4, 2))
        residuals = np.append(iterations["residual"], tolerance)
        axes.set_ylim(*_decades(residuals))
        axes.set(
            xlabel="iteration",
            ylabel="relative residual (dashed: tolerance)",
            title="each line an increment, the last bright",
        )
        cut = history["cutbacks"] > 0
        right.bar(history["increment"], history["iterations"], width=0.8, color=np.where(cut, style.RED, style.BLUE))
        right.set(
            xlabel="increment", ylabel="iterations", title="iterations" + (" (red: after a cut)" if cut.any() else "")
        )
        for a in (axes.xaxis, right.xaxis, right.yaxis):
            a.get_major_locator().set_params(integer=True)
    return figure


# -------------------------------------------------------------------------------------------------------------- details
def panels(width: float, height: float, rows: int) -> tuple[Figure, Any]:
    """A figure (inches) of rows over one abscissa, and its axes."""
    return _figure(width, height, rows=rows, sharex=True)


def legend(figure: Figure, axes: Axes) -> None:
    """Names of the curves of some axes, below the picture."""
    _legend(figure, axes)


def _figure(
    width: float, height: float, rows: int = 1, columns: int = 1, dpi: float | None = None, **options: Any
) -> tuple[Figure, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from prensa.output.picture import Picture

    figure = Picture(figsize=(width, height), dpi=dpi)
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, **options)


def _legend(figure: Figure, axes: Axes) -> None:
    """Names of the curves below the picture, in two columns: beside it they would take the width of a phone."""
    if axes.get_legend_handles_labels()[0]:
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2)


def _decades(values: Array) -> tuple[float, float]:
    """Limits of a logarithmic axis: whole decades around the positive *values*, at least two."""
    positive = values[values > 0]
    low, high = (np.log10(positive.min()), np.log10(positive.max())) if positive.size else (-16.0, 0.0)
    return 10.0 ** np.floor(low - 0.1), 10.0 ** max(np.ceil(high + 0.1), np.floor(low - 0.1) + 2)


def _from_zero(history: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The numbers of a history with the initial state, where all of them are zero, in front."""
    return {k: np.concatenate([[0.0], v]) for k, v in history.items() if np.issubdtype(v.dtype, np.number)}


def _stroke(history: Mapping[str, Array], problem: Problem, tool: str | None) -> tuple[Array, str]:
    """Abscissa of forces and its label: travel of a tool along the axis on which it moves most, made positive."""
    if tool is not None:
        ways, about = place_columns(problem)[: directions(problem)], turning_about(history, tool, problem)
        k = max(range(len(ways)), key=lambda k: (np.abs(history[f"{tool}.{ways[k]}"]).max(initial=0.0), k == 1))
        u = history[f"{tool}.{ways[k]}"]
        if np.any(u):
            name = style.axes_names(problem)[k]
            return _positive(u), f"travel of {tool} along {name} ({style.length_unit(problem)})"
        if about:
            return _positive(history[f"{tool}.{about}"]), f"rotation of {tool} (rad)"
    return history["time"], "time"


def _positive(u: Array) -> Array:
    return -u if u.size and u[np.argmax(np.abs(u))] < 0 else u


def broken(along: Array, values: Array) -> tuple[Array, Array]:
    """A curve (k,), (k,) that breaks off (not a number) where the abscissa stands still, unless it always does."""
    still = np.abs(np.diff(along)) <= 1e-9 * max(float(np.ptp(along)), 1e-300)
    if still.all():
        return along, values
    alone = np.append(True, still) & np.append(still, True)  # neither arrived at nor left by moving
    gap = np.flatnonzero(still) + 1
    return np.insert(along, gap, np.nan), np.insert(np.where(alone, np.nan, values), gap, np.nan)


def _closed_range(s: Array, status: NDArray[Any]) -> tuple[float, float]:
    """Part of the abscissa to show: the closed points and a margin, or everything when none or most are closed."""
    closed = s[status != STATUS.index("open")]
    if not closed.size or not s.size:
        return (float(s.min()), float(s.max())) if s.size else (0.0, 1.0)
    margin = max(0.25 * float(np.ptp(closed)), 3 * float(np.ptp(s)) / len(s))
    return max(float(closed.min()) - margin, float(s.min())), min(float(closed.max()) + margin, float(s.max()))


def _coloured(axes: Axes, x: Array, cells: Index, value: Array, ends: tuple[float, float], name: str) -> Any:
    from matplotlib.tri import Triangulation

    covered = Triangulation(x[:, 0], x[:, 1], triangles(cells))
    return axes.tripcolor(covered, value, shading="gouraud", vmin=ends[0], vmax=ends[1], cmap=name, rasterized=True)


def _edges(
    axes: Axes, body: BodyState, image: Image, mesh: bool | None, lines: Sequence[tuple[int, float]], box: tuple[float, ...]
) -> None:
    """Element edges (thin) and outline (thicker) of a body, its initial outline dashed; of no side on a line of symmetry.

    Where much of the plane is in the *box* both are thinner, and *mesh* None leaves edges out that would lie on one another.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    x, X = image.of(body.x), image.of(body.X)
    point = _point(axes, box)
    element, width = _widths(body)
    if mesh is None:
        mesh = len(body.cells) <= MOST_EDGES and element >= LEAST_EDGE * point
    if mesh:
        axes.add_collection(PolyCollection(list(x[around(body.cells)]), facecolors="none", edgecolors="k",
                                           linewidths=0.25, alpha=0.35))  # fmt: skip
    edges = outline(body.cells)
    for axis, at in lines:
        on = np.abs(body.X[:, axis] - at) < 1e-9 * np.ptp(body.X)
        edges = edges[~on[edges].all(axis=1)]
    axes.add_collection(
        LineCollection(list(X[edges]), colors="0.45", linewidths=0.6, linestyles=[(0, (5, 4))], zorder=0.5)
    )
    thick = min(OUTLINE, OUTLINE_SHARE * width / point)
    axes.add_collection(LineCollection(list(x[edges]), colors="0.1", linewidths=thick, zorder=3))


def _point(axes: Axes, box: tuple[float, ...]) -> float:
    """Length in a section that is a point (1/72 inch) wide on the page, about."""
    page, place = axes.get_figure(root=True).get_size_inches(), axes.get_position()  # type: ignore[union-attr]
    wide, high = 72.0 * page[0] * place.width, 72.0 * page[1] * place.height
    return float(max((box[1] - box[0]) / wide, (box[3] - box[2]) / high))


def _widths(body: BodyState) -> tuple[float, float]:
    """Width of the middle element, area over longest side, and of a body, area over half of what is around it."""
    ring = body.x[body.cells[:, : 4 if body.cells.shape[1] in (4, 8) else 3]]
    after = np.roll(ring, -1, axis=1)
    area = 0.5 * np.abs((ring[..., 0] * after[..., 1] - after[..., 0] * ring[..., 1]).sum(axis=1))
    element = float(np.median(area / np.hypot(*(after - ring).T).max(axis=0)))
    a, b = body.x[outline(body.cells)].transpose(1, 0, 2)
    return element, float(2.0 * area.sum() / np.hypot(*(b - a).T).sum())


def colour_range(values: list[Array], field: str) -> tuple[float, float]:
    """Values of the first and the last colour of a field with nodal values (n,) of some bodies."""
    low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    if field_map(field) == style.DIVERGING:
        high = max(abs(low), abs(high), 1e-300)
        return -high, high
    return (low, high) if high > low else (low, low + 1.0)


def limits(increment: Increment, problem: Problem, mirror: Sequence[str] = ()) -> tuple[float, ...]:
    """Part to show (x from, to, y from, to): the bodies, a margin, and the nearest piece of each tool.

    In space (…, z from, to), bodies alone.
    """
    copies = images(mirror_lines(increment, problem, mirror))
    shapes = [b.x for b in increment.bodies.values()] + [b.X for b in increment.bodies.values()]
    x = np.vstack([image.of(shape) for image in copies for shape in shapes])
    low, high = x.min(axis=0), x.max(axis=0)
    if problem.space == "solid":
        return tuple(np.stack([low, high], axis=1).ravel().tolist())
    size = float((high - low).max())
    margin = 0.1 * size
    box = np.vstack([low - 0.4 * margin, high + 0.4 * margin])
    for name, tool in problem.tools.items():
        for polygon in outlines(tool, increment.tools[name], 3.0 * size, problem.space == "axisymmetric"):
            nearest = nearest_to_box(polygon, low, high)
            behind = nearest + np.clip(polygon.mean(axis=0) - nearest, -margin, margin)
            box = np.vstack([box, *(image.of(np.vstack([nearest, behind])) for image in copies)])
    low, high = box.min(axis=0), box.max(axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def figure_of_section(box: tuple[float, ...]) -> tuple[Figure, Axes]:
    """A figure with axes for a part of the plane (x from, to, y from, to)."""
    return _figure(*_size((box[1] - box[0]) / (box[3] - box[2])))


def _size(wide: float) -> tuple[float, float]:
    """Width and height in inches of a picture whose section is *wide* times wider than high."""
    width = 4.5 if wide > 0.8 else max(3.6 * wide, 1.6) + 1.3
    return width, min(max(3.8 / wide + 1.2, 2.2), 5.6)


def _moment(increment: Increment) -> str:
    """When a picture was taken, in a line."""
    if not increment.number:
        return "initial state"
    return f"{increment.step}, time {increment.time:.4g} (increment {increment.number})"


def _draw_tools(
    axes: Axes, increment: Increment, problem: Problem, box: tuple[float, ...], image: Image, lines: Sequence[tuple[int, float]]
) -> None:  # fmt: skip
    """Tools of a copy of the section: of each the part that lies on the copy's side of the lines of symmetry."""
    from matplotlib.patches import Polygon, Rectangle

    depth = 3 * max(box[1] - box[0], box[3] - box[2])
    left, right, bottom, top = image.part(box, lines, np.vstack([b.x for b in increment.bodies.values()]).mean(axis=0))
    own = Rectangle((left, bottom), right - left, top - bottom, transform=axes.transData)
    for name, tool in problem.tools.items():
        for polygon in outlines(tool, increment.tools[name], depth):
            patch = axes.add_patch(Polygon(image.of(polygon), closed=True, zorder=2.5, **style.TOOL))
            if lines:
                patch.set_clip_path(own)


def finish_section(axes: Axes, problem: Problem, box: tuple[float, ...]) -> None:
    """Limits, equal scales and names of the axes of a section."""
    first, second = style.axes_names(problem)[:2]
    unit = style.length_unit(problem)
    axes.set(xlim=box[:2], ylim=box[2:], aspect="equal", xlabel=f"{first} ({unit})", ylabel=f"{second} ({unit})")
    axes.grid(False)
