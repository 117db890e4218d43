"""The pictures that every run leaves in ``pictures/``: which, under which names, with which captions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from prensa.model.problem import Case
from prensa.output import plot
from prensa.output.files import file_names, replacing
from prensa.output.history import read_convergence, read_history
from prensa.output.measured import MEASURES, read_measures
from prensa.solver.increment import Increment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURES = "pictures"
_PRESSURE = "pressure_"
_CAPTIONS = {
    "deformed": "Deformed shape, von Mises stress, tools in their last place (dashed: initial outline)",
    "plastic_strain": "Equivalent plastic strain",
    "force_stroke": "Force on the tools",
    "measures": "Measures of the case",
    "energy": "Energy ledger: where the external work went, and what is not accounted for",
    "convergence": "Newton iterations",
}


def write_pictures(directory: Path, case: Case, increment: Increment | None) -> Iterator[str]:
    """Write all the pictures; yields a sentence for each that could not be drawn (a picture never ends a run).

    *increment* is the last one; without it the pictures that need fields are left as they are.
    """
    for name, draw in _drawings(directory, case, increment):
        path = directory / PICTURES / f"{name}.png"
        try:
            with replacing(path) as temporary:
                plot.save(draw(), temporary, format="png")
        except Exception as error:
            yield f"{PICTURES}/{path.name} could not be drawn: {type(error).__name__}: {error}"


def caption(path: Path) -> str:
    """Caption of one of the pictures, empty for any other file."""
    name = path.stem
    if name.startswith(_PRESSURE):
        return f"Contact pressure and shear, {name.removeprefix(_PRESSURE)}"
    return _CAPTIONS.get(name, "")


def order(path: Path) -> tuple[float, str]:
    """Key that sorts pictures as they are read: shape, contacts, forces, energy, cost."""
    names = list(_CAPTIONS)
    return (1.5 if path.stem.startswith(_PRESSURE) else names.index(path.stem) if path.stem in names else 99), path.stem


def is_picture(path: Path) -> bool:
    """Whether *path* has the name of a picture that runs write."""
    return path.suffix == ".png" and bool(caption(path))


def _drawings(directory: Path, case: Case, increment: Increment | None) -> Iterator[tuple[str, Callable[[], Figure]]]:
    problem = case.problem
    if increment is not None:
        yield "deformed", lambda: plot.deformed(increment, problem)
        if any(b.plastic_strain.any() for b in increment.bodies.values()):
            yield "plastic_strain", lambda: plot.deformed(increment, problem, "plastic_strain")
        files = file_names(c.name for c in problem.contacts)
        for name, contact in increment.contacts.items():
            yield _PRESSURE + files[name], lambda c=contact: plot.pressure(c, problem)  # type: ignore[misc]
    history = read_history(directory)
    if len(history["time"]):
        if problem.tools:
            yield "force_stroke", lambda: plot.force_stroke(history, problem)
        if problem.measures and (directory / MEASURES).is_file():
            yield "measures", lambda: plot.measures(read_measures(directory), problem)
        yield "energy", lambda: plot.energy(history, problem)
        yield (
            "convergence",
            lambda: plot.convergence(history, read_convergence(directory), problem, case.numerics.tolerance),
        )
