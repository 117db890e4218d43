"""Scene of the interactive report, as one value for the page's script: shapes, fields, contacts, curves.

Frames are the increments whose fields were written, fewer where they would make the page too large. Consecutive frames of
the same mesh share its cells, so that the mesh may change during a run.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from typing import Any

import numpy as np

from prensa.measures.columns import force_columns, place_columns
from prensa.model.problem import Problem
from prensa.output import plot, press, scene_in_space, style
from prensa.output.cells import around, drawn, outline
from prensa.output.frames import frame_order, row_order
from prensa.output.maxima import largest_force, leading_tool
from prensa.output.outline import outlines
from prensa.output.packing import PLACE_BITS, VALUE_BITS, Packer
from prensa.output.spatial import TOOL_SIDE, view_angles
from prensa.output.stored import Stored
from prensa.result.increment import STATUS, BodyState, ContactState, Increment
from prensa.types import Array, Index

MOST_NUMBERS = 8_000_000  # in the frames of a page at the first try: some six megabytes of it
CURVES_SIZE = 1_000_000  # characters of the curves of a page: some thousand increments with three tools
CHARACTERS = 8  # of a number of a curve, on average
PROFILES = ("x", "y", "pressure", "pressure_from_stress", "shear", "slip")


def scene(stored: Stored, room: float = math.inf) -> tuple[dict[str, Any], str]:
    """Everything that the page draws, and the packed block of text that its references point into.

    ``room``: characters that both may have. Frames are left out until they fit: fields that are rough compress badly. One
    frame at least is left.
    """
    order = frame_order(stored)
    count = _first_guess(stored, order)
    while True:
        made, data = _scene(stored, sorted(order[:count]))
        size = len(data) + len(as_json(made))
        if size <= room or count <= 1:
            return made, data
        count = max(1, min(count - 1, int(0.95 * count * room / size)))


def as_json(made: Mapping[str, Any]) -> str:
    """A scene as it stands in the page."""
    return json.dumps(made, separators=(",", ":")).replace("<", "\\u003c")


def _scene(stored: Stored, frames: list[int]) -> tuple[dict[str, Any], str]:
    problem, packer = stored.problem, Packer()
    increments = [stored.number(n) for n in frames]
    history, rows = _history(stored, frames)
    made: dict[str, Any] = {
        "name": problem.name,
        "axes": style.axes_names(problem),
        "axisymmetric": problem.space == "axisymmetric",
        "solid": problem.space == "solid",
        "units": {"length": style.length_unit(problem), "force": style.force_unit(problem),
                  "moment": style.moment_unit(problem), "energy": style.energy_unit(problem),
                  "pressure": style.pressure_unit(problem)},
        "palettes": {name: style.palette(name) for name in (style.SEQUENTIAL, style.DIVERGING)},
        "colours": style.CYCLE,
        "status": STATUS,
        "frames": np.searchsorted(stored.history["increment"][rows], frames).tolist(),
        "shown": [len(frames), len(stored.with_fields)],
        "drawn": [len(rows), len(stored)],
        "largest": largest_force(stored, frames),
        "history": history,
        "leading": leading_tool(stored.history, problem),
        "capacities": _capacities(stored, rows),
        **(_mirrored(stored, increments[0]) if increments else {"mirror": [], "images": []}),
        "offered": _offered(stored, increments) if increments else [],
    }  # fmt: skip
    made |= (_in_space if problem.space == "solid" else _in_plane)(stored, increments, packer)
    return made, packer.text()


def _in_plane(stored: Stored, increments: list[Increment], packer: Packer) -> dict[str, Any]:
    """Tools, bodies and contacts of a section, and the part of it to show."""
    problem = stored.problem
    return {
        "tools": _tools(stored, increments),
        **_bodies(problem, increments, packer),
        "contacts": [_contact(name, problem, increments, packer) for name in _touched(stored)],
        "box": _box(problem, increments),
    }


def _in_space(stored: Stored, increments: list[Increment], packer: Packer) -> dict[str, Any]:
    """The same in space, where the pressure of a contact is a field of the bodies' outsides."""
    problem, groups = stored.problem, list(_same_mesh(increments))
    images = plot.images(plot.mirror_lines(increments[0], problem, stored.mirror)) if increments else []
    return {
        "tools": scene_in_space.tools(problem, list(stored.placements), increments, packer, images),
        **scene_in_space.bodies(problem, groups, increments, packer, images),
        "contacts": [],
        "box": scene_in_space.box(increments),
        "view": list(view_angles(TOOL_SIDE, increments[-1])) if increments else [0.0, 0.0],
    }


# ------------------------------------------------------------------------------------------------------------- details
def _first_guess(stored: Stored, order: Sequence[int]) -> int:
    """How many frames have `MOST_NUMBERS` numbers, about: of the largest mesh, which is the last one."""
    if not order:
        return 0
    return min(len(order), max(int(MOST_NUMBERS / max(_numbers(stored, stored.with_fields[-1]), 1)), 1))


def _numbers(stored: Stored, number: int) -> int:
    """How many numbers a frame has, about: eight a node of a section, in space three and its fields a point that is seen."""
    increment = stored.number(number)
    if stored.problem.space != "solid":
        return 8 * sum(len(b.X) for b in increment.bodies.values())
    seen = scene_in_space.shells(increment, scene_in_space.middle([increment]))
    return (3 + len(plot.fields_of(stored.problem, [increment]))) * sum(len(s.pairs) for s in seen.values())


def _history(stored: Stored, frames: Sequence[int]) -> tuple[dict[str, Any], Index]:
    """Columns of the curves, and the rows of the history that they have: all, or as many as `CURVES_SIZE` has room for.

    The rows of the frames are among them.
    """
    table, problem = stored.history, stored.problem
    columns = [f"{t}.{c}" for t in problem.tools for c in (*place_columns(problem), *force_columns(problem))]
    columns += [c for c in table if c.startswith("energy.")]
    most = int(CURVES_SIZE / (CHARACTERS * (len(columns) + 5)))
    rows = np.arange(len(stored))
    if len(rows) > most:
        of_frames = np.searchsorted(table["increment"], frames).tolist()
        rows = np.sort(list(islice(row_order(stored, of_frames), max(most, len(of_frames)))))
    out: dict[str, Any] = {c: _rounded(table[c][rows]) for c in ("time", *columns)}
    out |= {c: table[c][rows].astype(int).tolist() for c in ("increment", "iterations", "cutbacks")}
    out["step"] = [str(v) for v in table["step"][rows]]
    return out, rows


def _capacities(stored: Stored, rows: Index) -> dict[str, list[float | None]]:
    """Capacities of the presses by tool, at its first place and at some increments; None where none is drawn."""
    found = {t: press.capacity_beside(stored.history, stored.problem, t) for t in stored.problem.tools}
    return {t: [v if math.isfinite(v) else None for v in _rounded(c[np.append(0, rows + 1)])]
            for t, c in found.items() if c is not None}  # fmt: skip


def _rounded(values: Iterable[float]) -> list[float]:
    return [float(f"{v:.6g}") for v in values]


def _tools(stored: Stored, increments: list[Increment]) -> list[dict[str, Any]]:
    """Reference point and outline (at no displacement) of each tool that was placed."""
    bodies = [b.x for i in increments for b in i.bodies.values()]
    depth = 4.0 * float(max((np.ptp(x, axis=0).max() for x in bodies), default=1.0))
    found = []
    for name, tool in stored.problem.tools.items():
        if name in stored.placements and len(stored):
            state = stored[0].tools[name]
            still = outlines(tool, _unmoved(state), depth)
            shapes = [[_rounded(p[:, 0]), _rounded(p[:, 1])] for p in still]
            found.append({"name": name, "at": _rounded(state.at), "outlines": shapes})
    return found


def _unmoved(state: Any) -> Any:
    return replace(state, place=type(state.place)(0.0, 0.0, 0.0))


def _mirrored(stored: Stored, first: Increment) -> dict[str, Any]:
    """Planes of symmetry: in the plane axis that changes sign and coordinate; in space the normal and its product with a place.

    There also the images of what was modelled: rows of each turn, and its shift.
    """
    planes = plot.mirror_lines(first, stored.problem, stored.mirror)
    if stored.problem.space != "solid":
        return {"mirror": [plane.line for plane in planes], "images": []}
    pairs = ((image.turn, image.shift) for image in plot.images(planes))
    copies = [np.concatenate([turn.ravel(), shift]).tolist() for turn, shift in pairs if turn is not None and shift is not None]
    return {"mirror": [[*plane.normal, plane.place] for plane in planes], "images": copies}


def _offered(stored: Stored, increments: list[Increment]) -> list[tuple[int, float, str]]:
    """Further lines at which the section may be mirrored: axis that changes sign, coordinate, side.

    Those are straight ends of the bodies that never move along their normal; whether they are lines of symmetry or rest on
    something, the reader knows.
    """
    planes = plot.mirror_lines(increments[0], stored.problem, stored.mirror)
    taken = {axis for plane in planes for axis, n in enumerate(plane.normal) if n}  # the images of others are at right angles
    X = np.vstack([b.X for b in increments[0].bodies.values()])
    same = [i for i in increments if sum(len(b.X) for b in i.bodies.values()) == len(X)]
    low, high = X.min(axis=0), X.max(axis=0)
    found = []
    names = (("left", "right"), ("bottom", "top"), ("back", "front"))[: X.shape[1]]
    for side, axis, at in ((n, k, end[k]) for k, pair in enumerate(names) for n, end in zip(pair, (low, high))):
        on = np.abs(X[:, axis] - at) <= 1e-9 * float(np.ptp(X, axis=0).max())
        moved = (np.vstack([b.displacement for b in i.bodies.values()])[on, axis] for i in same)
        if axis not in taken and on.sum() > 1 and not any(u.any() for u in moved):
            taken.add(axis)
            found.append((axis, float(at), side))
    return found


def _bodies(problem: Problem, increments: list[Increment], packer: Packer) -> dict[str, Any]:
    """``groups``: runs of frames with one mesh; ``fields``: their labels, colours and ranges."""
    fields = plot.fields_of(problem, increments)
    values = {f: (min(lows), max(highs)) for f in fields
              for lows, highs in [zip(*(_ends(b, f) for i in increments for b in i.bodies.values()))]}  # fmt: skip
    moves = [b.displacement for i in increments for b in i.bodies.values()]
    span = [(float(min(u[:, k].min() for u in moves)), float(max(u[:, k].max() for u in moves))) for k in (0, 1)] if moves else []
    groups = []
    for first, last in _same_mesh(increments):
        part = increments[first:last]
        bodies = []
        for name, b in part[0].bodies.items():
            states = [i.bodies[name] for i in part]
            bodies.append({
                "name": name, "X": packer.floats(b.X.T), "facets": packer.whole(drawn(b.cells)),
                "edges": packer.whole(_edges(b)), "outline": packer.whole(outline(b.cells)), "elements": len(b.cells),
                "u": [packer.quantised([s.displacement[:, k] for s in states], PLACE_BITS, *span[k]) for k in (0, 1)],
                "fields": {f: packer.quantised([plot.field_values(s, f) for s in states], VALUE_BITS, *values[f])
                           for f in fields if not f.startswith("displacement")},
            })  # fmt: skip
        groups.append({"first": first, "last": last, "bodies": bodies})
    described = [{"key": f, "label": plot.field_name(problem, f), "unit": plot.field_unit(problem, f), "map": plot.field_map(f),
                  "low": values[f][0], "high": values[f][1]} for f in fields]  # fmt: skip
    return {"groups": groups, "fields": described}


def _ends(body: BodyState, field: str) -> tuple[float, float]:
    values = plot.field_values(body, field)
    return float(values.min()), float(values.max())


def _edges(body: BodyState) -> Index:
    """Pieces (k, 2) of all element sides, each once."""
    ring = around(body.cells)
    return np.unique(np.sort(np.stack([ring, np.roll(ring, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1), axis=0)


def _same_mesh(increments: list[Increment]) -> Iterator[tuple[int, int]]:
    """First and last (exclusive) of consecutive increments whose bodies have the same cells and initial places."""
    starts = [0] + [k for k, (a, b) in enumerate(pairwise(increments), 1) if not _alike(a, b)]
    yield from zip(starts, [*starts[1:], len(increments)]) if increments else ()


def _alike(a: Increment, b: Increment) -> bool:
    return all(
        np.array_equal(p.cells, q.cells) and np.allclose(p.X, q.X, rtol=0, atol=1e-9 * np.ptp(p.X))
        for p, q in zip(a.bodies.values(), b.bodies.values())
    )


def _touched(stored: Stored) -> list[str]:
    """Contacts that were closed at some time: the others have nothing to show."""
    return [c.name for c in stored.problem.all_contacts if stored.history[f"{c.name}.area"].any()]


def _contact(name: str, problem: Problem, increments: list[Increment], packer: Packer) -> dict[str, Any]:
    states = [i.contacts[name] for i in increments]
    quadratic = bool(states) and plot.on_quadratic_edges(states[0], problem)
    if quadratic:  # what scatters about it at corners and middles is no line
        states = [replace(s, pressure_from_stress=s.pressure_smoothed) for s in states]
    groups = []
    starts = [0] + [k for k, (a, b) in enumerate(pairwise(states), 1) if not np.array_equal(a.node, b.node)]
    ranges = {p: _range_of([_profile(s, p) for s in states]) for p in PROFILES}
    for first, last in zip(starts, [*starts[1:], len(states)]) if states else ():
        part = states[first:last]
        packed = {p: packer.quantised([_profile(s, p) for s in part], PLACE_BITS if p in "xy" else VALUE_BITS + 2, *ranges[p])
                  for p in PROFILES}  # fmt: skip
        groups.append({"first": first, "last": last, **packed, "status": packer.whole([s.status for s in part])})
    touching = [s for s in states if s.status.any()]
    along = plot.abscissa(touching[-1] if touching else states[-1], problem)[1] if states else ""
    axis = {f"{a} ({style.length_unit(problem)})": k for a, k in zip(style.axes_names(problem), "xy")}.get(along, "s")
    return {"name": name, "surface": states[0].surface if states else "", "along": axis, "groups": groups,
            "quadratic": quadratic}  # fmt: skip


def _profile(state: ContactState, name: str) -> Array:
    values = state.x[:, "xy".index(name)] if name in "xy" else getattr(state, name)
    if name == "pressure_from_stress":  # where nothing touches the body's own stress says nothing of the contact
        values = np.where(state.status > 0, values, 0.0)
    return np.nan_to_num(np.asarray(values, dtype=float))


def _range_of(frames: list[Array]) -> tuple[float, float]:
    return (min(float(v.min()) for v in frames), max(float(v.max()) for v in frames)) if frames else (0.0, 0.0)


def _box(problem: Problem, increments: list[Increment]) -> list[float]:
    """Part of the plane to show at first: the bodies at all times, with the nearest pieces of the tools at the end."""
    boxes = np.array([plot.limits(i, problem, mirror=()) for i in increments])
    if not len(boxes):
        return [0.0, 1.0, 0.0, 1.0]
    return _rounded([boxes[:, 0].min(), boxes[:, 1].max(), boxes[:, 2].min(), boxes[:, 3].max()])
