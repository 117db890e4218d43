"""Tools of a run, in files: loads along their outlines, wear, stresses of dies."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.dies.loads import ToolLoads, tool_loads
from prensa.dies.stress import DieStress
from prensa.dies.wear import Wear, wear, wear_summary
from prensa.errors import PrensaError
from prensa.model.problem import Case, Problem
from prensa.output import plot, style
from prensa.output.history import Table
from prensa.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from prensa.output.stored import Stored

FOLDER = "die-"
DIE_SUMMARY, MAP_SUMMARY = "die.json", "map.json"


def write_loads(path: Path, worn: Wear) -> Path:
    """Write pressure, shear, sliding and wear over a tool's coordinate as a table (CSV); returns its path."""
    loads = worn.loads
    at, most, mean = loads.at(loads.largest_force), loads.envelope, loads.mean
    return write_columns(path, {
        "s": loads.s, "x": loads.x[:, 0], "y": loads.x[:, 1], "area": loads.area, "pressure": at.pressure, "shear": at.shear,
        "pressure_most": most.pressure, "shear_most": most.shear, "pressure_mean": mean.pressure, "shear_mean": mean.shear,
        "sliding": loads.slid, "wear": worn.depth,
    })  # fmt: skip


def summary_of(found: DieStress) -> dict[str, Any]:
    """The largest von Mises stress and deflection of a die, and its forces."""
    (mises, where), (moved, there) = found.largest_mises, found.largest_deflection
    ring = found.largest_mises_of_ring
    return {
        "tool": found.tool, "increment": found.number, "time": found.time,
        "mises": {"value": mises, "at": where.tolist()},
        **({} if ring is None else {"ring": {"value": ring[0], "at": ring[1].tolist()}}),
        "deflection": {"value": moved, "at": there.tolist()},
        "force": found.force.tolist(), "load": found.load.tolist(), "reaction": found.reaction.tolist(),
        "imbalance": found.imbalance,
        "pressure": float(found.pressure.max()), "shear": float(np.abs(found.shear).max()),
        "elements": sum(len(b.cells) for b in found.increment.bodies.values()),
    }  # fmt: skip


def stored_dies(directory: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Folders of dies that were computed of the run in *directory*, and their summaries."""
    for path in sorted(directory.glob(f"{FOLDER}*/{DIE_SUMMARY}")):
        try:
            yield path.parent, json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise PrensaError(f"{path}: the summary of the die is damaged ({error}); run 'prensa die' again") from None


# -------------------------------------------------------------------------------------------------------------- report
def in_report(stored: Stored, case: Case) -> dict[str, Any]:
    """Wear of the tools of which the case asks for it, dies that were computed of the run, and pictures (caption, data URI)."""
    worn, pictures, without = [], [], []
    for tool, law in case.output.wear.items() if len(stored) else ():
        try:
            found = wear(tool_loads(stored, case.problem, tool), law=law)
        except PrensaError as error:
            without.append(str(error))
            continue
        most = found.loads.envelope
        k = int(np.argmax(most.pressure))
        row = {"tool": tool, "pressure": float(most.pressure[k]), "pressed": float(found.loads.s[k])}
        worn.append({**row, **wear_summary(found)})
        buffer = io.BytesIO()
        figure = draw_loads(found, case.problem)
        for axes in figure.axes:
            style.plain_numbers(axes.yaxis)
        figure.savefig(buffer, format="png", bbox_inches="tight")
        pictures.append((f"Loads and wear along the outline of {tool}", _uri(buffer.getvalue())))
    dies = []
    for folder, summary in stored_dies(stored.directory):
        dies.append(summary)
        for name, what in (("mises", "von Mises stress"), ("displacement", "displacement"), ("deflection", "give of the face")):
            if (path := folder / f"{name}.png").is_file():
                pictures.append((f"Elastic {summary['tool']}, increment {summary['increment']}: {what}", _uri(path.read_bytes())))
    return {"wear": worn, "dies": dies, "pictures": pictures, "without": without}


def _uri(data: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(data).decode()


# ------------------------------------------------------------------------------------------------------------ pictures
def draw_loads(worn: Wear, problem: Problem) -> Figure:
    """Pressure, shear, sliding and wear over a tool's coordinate."""
    loads, length, stress = worn.loads, style.length_unit(problem), style.pressure_unit(problem)
    at, most, mean = loads.at(loads.largest_force), loads.envelope, loads.mean
    with style.styled():
        figure, (first, second, third, fourth) = plot.panels(4.5, 7.2, 4)
        for name, axes, curves in (("pressure", first, (most.pressure, at.pressure, mean.pressure)),
                                   ("shear", second, (most.shear, at.shear, mean.shear))):  # fmt: skip
            for label, values, colour in zip(("largest", "at the largest force", "mean over the run"), curves, style.CYCLE):
                wide = 2.4 if values is curves[0] else 1.2  # seen behind that of the largest force, which often is the largest
                _steps(axes, loads, values, colour, label if axes is first else "", wide)
            axes.set_ylabel(f"{name} ({stress})")
        _steps(third, loads, loads.slid, style.CYCLE[0])
        third.set_ylabel(f"sliding ({length})")
        _steps(fourth, loads, worn.depth, style.CYCLE[0])
        fourth.set_ylabel("wear, relative" if worn.relative else f"wear a part ({length})")
        fourth.set_xlabel(f"along the outline of {loads.tool} ({length})")
        plot.legend(figure, first)
    return figure


def draw_deflection(found: DieStress, problem: Problem) -> Figure:
    """Displacement of the face of a die along its coordinate."""
    length = style.length_unit(problem)
    with style.styled():
        figure, axes = plot.panels(4.5, 2.9, 1)
        for k, name in enumerate(style.axes_names(problem)):
            axes.plot(found.s, found.u[:, k], color=style.CYCLE[k], label=f"along {name}")
        axes.axhline(0.0, color=style.BLACK, linewidth=0.6)
        axes.set(xlabel=f"along the outline of {found.tool} ({length})", ylabel=f"displacement ({length})")
        plot.legend(figure, axes)
    return figure


def figures(found: DieStress, worn: Wear, problem: Problem) -> Iterable[tuple[str, Figure]]:
    """The pictures of a die by name: stress, displacement, give of its face, loads of the tool."""
    yield "mises", plot.deformed(found.increment, found.problem, "mises")
    yield "displacement", plot.deformed(found.increment, found.problem, "displacement")
    yield "deflection", draw_deflection(found, problem)
    yield "loads", draw_loads(worn, problem)


def _steps(axes: Any, loads: ToolLoads, values: Array, colour: str, label: str = "", wide: float = 1.2) -> None:
    axes.stairs(values, loads.borders, color=colour, label=label or None, baseline=None, linewidth=wide)


def face_columns(found: DieStress) -> Mapping[str, Array]:
    """Columns of ``face.csv``, a row for each edge of the face of a die."""
    s, X, u = (0.5 * (v[1:] + v[:-1]) for v in (found.s, found.X, found.u))
    return {
        "s": s, "x": X[:, 0], "y": X[:, 1], "ux": u[:, 0], "uy": u[:, 1], "pressure": found.pressure, "shear": found.shear,
    }  # fmt: skip


def write_columns(path: Path, columns: Mapping[str, Array]) -> Path:
    """Write columns as a table (CSV); returns its path."""
    table = Table(path, list(columns))
    for row in zip(*columns.values()):
        table.append(row)
    table.close()
    return path
