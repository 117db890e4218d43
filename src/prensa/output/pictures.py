"""The pictures that every run leaves in ``pictures/``: which, under which names, with which captions."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from prensa.model.problem import Case
from prensa.output import plot, press
from prensa.output.answer import size_of_force
from prensa.output.files import file_name, file_names, replacing
from prensa.output.flow import flow_lines
from prensa.output.frames import evenly, travelled
from prensa.output.history import read_convergence
from prensa.output.maxima import largest_force
from prensa.output.measured import MEASURES, read_measures
from prensa.output.stored import Stored
from prensa.result.increment import Increment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURES = "pictures"
_PRESSURE = "pressure_"
_PRESS = "press_"
_DRAWN = {"deformed": "mises", "plastic_strain": "plastic_strain", "damage": "damage"}
_LARGEST = "largest_force"
_MOMENT = re.compile(rf"(deformed|plastic_strain|damage)(?:_({_LARGEST})|_step(\d+)_(.+))?")
_CAPTIONS = {
    "deformed": "Deformed shape and von Mises stress (dashed: initial outline)",
    "plastic_strain": "Equivalent plastic strain",
    "damage": "Ductile damage",
    "flow_lines": "How a square grid that was drawn on the undeformed bodies has deformed",
    "remeshing": "Meshes before and after remeshing: the first time, in the middle and the last time",
    "force_stroke": "Force on the tools",
    "measures": "Measures of the case",
    "energy": "Energy balance: where the external work went, and what is not accounted for",
    "convergence": "Newton iterations",
}


def write_pictures(directory: Path, case: Case, stored: Stored, start: Increment | None = None) -> Iterator[str]:
    """Write all the pictures; yields a sentence for each that could not be drawn (a picture never ends a run).

    *stored*: the increments of the run; *start*: the initial state, to draw where there is none.
    """
    for name, draw in _drawings(directory, case, stored, start):
        path = directory / PICTURES / f"{name}.png"
        try:
            with replacing(path) as temporary:
                plot.save(draw(), temporary, format="png")
        except Exception as error:
            yield f"{PICTURES}/{path.name} could not be drawn: {type(error).__name__}: {error}"


def caption(path: Path, solid: bool = False) -> str:
    """Caption of one of the pictures, of a run in space if ``solid``; empty for any other file."""
    name = path.stem
    if name.startswith(_PRESSURE):
        what = "Contact pressure" if solid else "Contact pressure and shear"
        return f"{what}, {name.removeprefix(_PRESSURE)}, at the largest force of its tool"
    if name.startswith(_PRESS):
        return f"Press of {name.removeprefix(_PRESS)}: its force and its capacity over the stroke, and the share that is used"
    if (found := _MOMENT.fullmatch(name)) is not None:
        when = f"end of step {found[4]}" if found[4] else "largest force" if found[2] else "last increment"
        words = _CAPTIONS[found[1]].partition(" (dashed")[0] if solid else _CAPTIONS[found[1]]
        return f"{words}: {when}"
    return _CAPTIONS.get(name, "")


def order(path: Path) -> tuple[float, float, str]:
    """Key that sorts pictures as they are read: shape, contacts, forces, energy, cost; moments as they come."""
    names = list(_CAPTIONS)
    if (found := _MOMENT.fullmatch(path.stem)) is not None:
        return names.index(found[1]), float(found[3] or (1000 if found[2] else 999)), path.stem
    if path.stem.startswith(_PRESS):
        return names.index("force_stroke") - 0.5, 0.0, path.stem
    return (1.5 if path.stem.startswith(_PRESSURE) else names.index(path.stem) if path.stem in names else 99), 0.0, path.stem


def by_importance(paths: Sequence[Path], stored: Stored) -> list[Path]:
    """Pictures as one would give them up last: all but earlier ends of steps, then these, evenly by travel of the tools."""
    steps: dict[int, list[Path]] = {}
    for path in paths:
        if (found := _MOMENT.fullmatch(path.stem)) is not None and found[3]:
            steps.setdefault(int(found[3]), []).append(path)
    later = {path for several in steps.values() for path in several}
    ends = {stored[k].step_number: k for k in np.flatnonzero(stored.ends).tolist()}
    known = sorted(n for n in steps if n in ends)
    travel = travelled(stored.history, stored.problem)[[ends[n] for n in known]].tolist()
    chosen = [p for k in evenly(travel, ()) for p in steps[known[k]]]
    return [*(p for p in paths if p not in later), *chosen, *(p for p in paths if p in later and p not in chosen)]


def is_picture(path: Path) -> bool:
    """Whether *path* has the name of a picture that runs write."""
    return path.suffix == ".png" and bool(caption(path))


def moments(stored: Stored) -> Iterator[tuple[str, Increment]]:
    """When to draw shapes, and the end of the name: ends of steps (of the last nothing), and the largest force.

    Of the increments whose fields were written. A picture takes a quarter of a second, so earlier steps have one each.
    """
    numbers = stored.with_fields
    if not numbers:
        return
    drawn = {numbers[-1]}
    for number in numbers[:-1]:
        increment = stored.number(number)
        if increment.end_of_step:
            drawn.add(number)
            yield f"_step{increment.step_number}_{file_name(increment.step)}", increment
    peak = largest_force(stored, numbers)
    if peak is not None and peak not in drawn:
        yield f"_{_LARGEST}", stored.number(peak)
    yield "", stored.number(numbers[-1])


def _drawings(
    directory: Path, case: Case, stored: Stored, start: Increment | None
) -> Iterator[tuple[str, Callable[[], Figure]]]:
    problem, history = case.problem, stored.history
    there = list(moments(stored)) or ([("", start)] if start is not None else [])
    for suffix, increment in there:
        for name, field in _DRAWN.items():
            if name == "deformed" or ("_step" not in suffix and _has(increment, field)):
                yield name + suffix, lambda i=increment, f=field: plot.deformed(i, problem, f, mirror=stored.mirror)  # type: ignore[misc]
    if problem.remesh != "off" and there:
        yield "flow_lines", lambda: flow_lines(there[-1][1], problem)
        if pairs := remeshings(stored):
            yield "remeshing", lambda: plot.new_meshes(pairs, problem)
    if not len(stored):
        return
    files = file_names(c.name for c in problem.all_contacts)
    for contact in problem.all_contacts:
        if (k := _most_pressed(stored, contact.name, contact.against)) is not None:
            yield _PRESSURE + files[contact.name], partial(_pressure, stored, k, contact.name)
    if any(size_of_force(history, t, problem).any() for t in problem.tools):
        yield "force_stroke", lambda: plot.force_stroke(history, problem)
    pressed = [t for t, tool in problem.tools.items() if tool.press is not None]
    for tool, name in file_names(pressed).items():
        yield _PRESS + name, lambda t=tool: press.picture(history, problem, t)  # type: ignore[misc]
    if problem.measures and (directory / MEASURES).is_file():
        yield "measures", lambda: plot.measures(read_measures(directory), problem)
    yield "energy", lambda: plot.energy(history, problem)
    yield (
        "convergence",
        lambda: plot.convergence(history, read_convergence(directory), problem, case.numerics.tolerance),
    )


def _pressure(stored: Stored, k: int, contact: str) -> Figure:
    return plot.contact_at(stored[k], contact, stored.problem, stored.mirror)


def _has(increment: Increment, field: str) -> bool:
    """Whether there is anything of a field to be seen."""
    return any(plot.field_values(b, field).any() for b in increment.bodies.values())


def remeshings(stored: Stored) -> list[tuple[Increment, Increment]]:
    """The increments before and after new meshes of which fields were written: the first, middle and last time."""
    known, count = set(stored.with_fields), stored.history.get("remeshings", np.zeros(0))
    numbers = stored.history["increment"]
    made = [k for k in np.flatnonzero(np.diff(count) > 0).tolist() if known.issuperset(numbers[k : k + 2].tolist())]
    return [(stored[k], stored[k + 1]) for k in dict.fromkeys([*made[:1], *made[len(made) // 2 :][:1], *made[-1:]])]


def _most_pressed(stored: Stored, contact: str, tool: str) -> int | None:
    """Place in the history of the largest force of a contact's tool while the contact is closed; None if it never is.

    Of a contact between bodies, whose force is no column, that of its largest area. In space, where the pressure is drawn on the
    bodies, of the increments whose fields were written.
    """
    history, size = stored.history, stored.history[f"{contact}.area"]
    if tool in stored.problem.tools:
        size = size_of_force(history, tool, stored.problem)
    force = np.where(history[f"{contact}.area"] > 0, size, -1.0)
    if stored.problem.space == "solid":
        force[~np.isin(history["increment"], stored.with_fields)] = -1.0
    return int(np.argmax(force)) if len(force) and force.max() >= 0 else None
