"""The part of a report's scene that is its own in space: shells of the bodies with their fields, surfaces of the tools.

Of a body the page carries the faces of its outside and its sections through the middle of the initial bodies along x, y and z:
what is inside is not seen, and would be most of the page.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from prensa.measures.tool_outlines import motion
from prensa.model.problem import Problem
from prensa.output import plot, style
from prensa.output.mirrors import Image
from prensa.output.packing import PLACE_BITS, VALUE_BITS, Packer
from prensa.output.solid import Shell, shell
from prensa.output.spatial import contact_pressures
from prensa.output.tool_surfaces import Surface, drawn_once, frame_box, own_images, surface
from prensa.precision import DRAWN
from prensa.result.increment import Increment
from prensa.types import Array

PRESSED = "contact_pressure"
TOOLS_BEYOND = 0.08  # of the size of the bodies: how far surfaces of tools go on beyond them


def middle(increments: Sequence[Increment]) -> list[float]:
    """The middle (3,) of the initial bodies, through which the sections go."""
    X = np.vstack([b.X for b in increments[0].bodies.values()]) if increments else np.zeros((1, 3))
    return [float(v) for v in 0.5 * (X.min(axis=0) + X.max(axis=0))]


def shells(increment: Increment, at: Sequence[float]) -> dict[str, Shell]:
    """Outside and sections through a place of each body."""
    return {name: shell(b.X, b.cells, list(enumerate(at))) for name, b in increment.bodies.items()}


def values_of(increment: Increment, body: str, field: str, seen: Shell) -> Array:
    """Values (n,) of a field at the points of a shell; the contact pressure of sections, which no tool touches, is zero."""
    if field != PRESSED:
        return seen.of(plot.field_values(increment.bodies[body], field))
    on_nodes = seen.pairs[:, 0] == seen.pairs[:, 1]
    return np.where(on_nodes, seen.of(contact_pressures(increment, body)), 0.0)


def bodies(
    problem: Problem, groups: Sequence[tuple[int, int]], increments: Sequence[Increment], packer: Packer,
    images: Sequence[Image] = (),
) -> dict[str, Any]:  # fmt: skip
    """``groups``: runs of frames with one mesh; ``fields``: their labels, colours and ranges; ``middle`` of the sections.

    ``images``: of what was modelled, in which components may be larger than in itself.
    """
    fields = plot.fields_of(problem, increments)
    if any(c.status.any() for i in increments for c in i.contacts.values()):
        fields.append(PRESSED)
    at = middle(increments)
    seen = [shells(increments[first], at) for first, _ in groups]
    ends = _ranges(fields, groups, increments, seen)
    moves = [b.displacement for i in increments for b in i.bodies.values()]
    lows, highs = ([[float(v) for v in end(u, axis=0)] for u in moves] for end in (np.min, np.max))
    span = [(min(a), max(b)) for a, b in zip(zip(*lows), zip(*highs))]
    made = []
    for (first, last), shells_now in zip(groups, seen):
        part, described = increments[first:last], []
        for name, b in part[0].bodies.items():
            s = shells_now[name]
            u = [s.of(i.bodies[name].displacement) for i in part]
            described.append({
                "name": name, "X": packer.floats(s.of(b.X).T), "facets": packer.whole(s.faces.ravel()),
                "corners": s.faces.shape[1], "elements": len(b.cells), "sections": [packer.whole(t.ravel()) for t in s.sections],
                "nodes": packer.whole(np.where(s.pairs[:, 0] == s.pairs[:, 1], s.pairs[:, 0] + 1, 0)),
                "u": [packer.quantised([v[:, k] for v in u], PLACE_BITS, *span[k]) for k in range(3)],
                "fields": {f: packer.quantised([values_of(i, name, f, s) for i in part], VALUE_BITS, *ends[f])
                           for f in fields if not f.startswith("displacement")},
            })  # fmt: skip
        made.append({"first": first, "last": last, "bodies": described})
    return {"groups": made, "fields": [_described(problem, f, *_with_images(f, ends[f], increments, images)) for f in fields],
            "middle": at}  # fmt: skip


def _ranges(
    fields: Sequence[str], groups: Sequence[tuple[int, int]], increments: Sequence[Increment], seen: Sequence[dict[str, Shell]]
) -> dict[str, tuple[float, float]]:
    found = {}
    for field in fields:
        values = [values_of(i, name, field, s) for (a, b), all_of in zip(groups, seen) for i in increments[a:b]
                  for name, s in all_of.items()]  # fmt: skip
        found[field] = (float(min(v.min() for v in values)), float(max(v.max() for v in values)))
    return found


def _with_images(
    field: str, ends: tuple[float, float], increments: Sequence[Increment], images: Sequence[Image]
) -> tuple[float, float]:
    """Range of a field over the bodies and their inclined images: across an axis a component changes its sign alone."""
    inclined = [i for i in images if i.turn is not None and np.abs(i.turn - np.diag(np.diag(i.turn))).max() > DRAWN]
    if "." not in field or not inclined:
        return ends
    own = [(b, plot.field_values(b, field)) for i in increments for b in i.bodies.values()]
    values = [image.values(field, b, v) for b, v in own for image in inclined]
    return min(ends[0], *(float(v.min()) for v in values)), max(ends[1], *(float(v.max()) for v in values))


def _described(problem: Problem, field: str, low: float, high: float) -> dict[str, Any]:
    if field == PRESSED:
        label, unit, colours = "contact pressure", style.pressure_unit(problem), style.SEQUENTIAL
    else:
        label, unit, colours = plot.field_name(problem, field), plot.field_unit(problem, field), plot.field_map(field)
    return {"key": field, "label": label, "unit": unit, "map": colours, "low": low, "high": high}


def box(increments: Sequence[Increment]) -> list[float]:
    """What the bodies cover at all times: x from, to, y from, to, z from, to."""
    if not increments:
        return [0.0, 1.0] * 3
    boxes = _boxes(increments)
    ends = np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)], axis=1)
    return [float(f"{v:.6g}") for v in ends.ravel()]


def _boxes(increments: Sequence[Increment], images: Sequence[Image] = (Image(),)) -> Array:
    """(t, 2, 3) lowest and highest places of the bodies of each increment, and of their images."""
    places = [np.vstack([image.of(b.x) for image in images for b in i.bodies.values()]) for i in increments]
    return np.stack([np.stack([x.min(axis=0), x.max(axis=0)]) for x in places])


def tools(
    problem: Problem, placed: Sequence[str], increments: Sequence[Increment], packer: Packer, images: Sequence[Image] = (Image(),)
) -> list[dict[str, Any]]:  # fmt: skip
    """Surface of each tool that was placed, and its motion (rotation by rows, place) at each frame.

    ``whole``: that of one that is one with images of what was modelled, and the images that show it.
    """
    if not increments:
        return []
    boxes, found = _boxes(increments), []
    size = float((boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)).max())
    for name, tool in problem.tools.items():
        if name not in placed:
            continue
        states = [i.tools[name] for i in increments]
        made = surface(tool, states[0], *frame_box(boxes, states, TOOLS_BEYOND * size))
        moves = [[float(f"{v:.7g}") for v in (*turn.ravel(), *move)] for turn, move in map(motion, states)]
        found.append({"name": name, **_packed(made, packer), "moves": moves})
        one = own_images(tool, states, made, images)
        if len(one) > 1:  # of the whole it is shown once, over all images of the bodies before it
            over = frame_box(_boxes(increments, [images[k] for k in one]), states, TOOLS_BEYOND * size)
            found[-1]["whole"] = {**_packed(surface(tool, states[0], *over), packer), "copies": drawn_once(images, one, size)}
    return found


def _packed(made: Surface, packer: Packer) -> dict[str, Any]:
    """Points, normals in bytes and triangles of a tool."""
    normals = packer.whole(np.rint(127 * made.normals.T + 127).astype(int))
    return {"X": packer.floats(made.points.T), "N": normals, "facets": packer.whole(made.triangles.ravel())}
