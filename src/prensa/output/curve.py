"""The force of a tool against its travel, as two columns for a spreadsheet or another program."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError
from prensa.measures.columns import directions, place_columns
from prensa.measures.units import force_unit, length_unit, moment_unit
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.output.files import write_spreadsheet
from prensa.output.maxima import leading_tool
from prensa.types import Array

CURVE = "curve.csv"


class ForceCurve(NamedTuple):
    """``travel`` (n,) of a tool along ``axis`` and the ``force`` (n,) along it; of one that only turns (``axis`` rx, ry, rz)
    rotation and moment.

    From the initial state on, one value an increment. Both are positive where the tool goes its way and is resisted.
    """

    tool: str
    axis: str
    travel: Array
    travel_unit: str
    force: Array
    force_unit: str

    def save(self, path: str | Path, semicolons: bool = False) -> Path:
        """Write the two columns, with names and units in the first row; returns the path.

        ``semicolons``: between the columns, and decimal commas, as spreadsheets of many languages read them.
        """
        first, second = ("rotation", "moment") if self.axis.startswith("r") else ("travel", "force")
        names = [f"{first} [{self.travel_unit}]", f"{second} [{self.force_unit}]"]
        rows = ([repr(v + 0.0) for v in row] for row in zip(self.travel.tolist(), self.force.tolist()))
        return write_spreadsheet(path, names, rows, semicolons)


def force_curve(history: Mapping[str, NDArray[Any]], problem: Problem, tool: str = "") -> ForceCurve:
    """Force against travel of a tool, along the axis on which it moves most (in axisymmetry along the axis of revolution).

    *history* is what `read_history` returns; ``tool``: the one that does the most work if empty.

    Raises
    ------
    PrensaError
        If there is no such tool, or it never moves.

    """
    tool = tool or leading_tool(history, problem) or next(iter(problem.tools), "")
    if tool not in problem.tools:
        raise PrensaError(f"unknown tool {tool!r}{suggest(tool, problem.tools)}" if tool else "the case has no tools")
    ways = ["uy"] if problem.space == "axisymmetric" else list(place_columns(problem)[: directions(problem)])
    turns = [] if problem.space == "axisymmetric" else list(place_columns(problem)[directions(problem) :])
    sizes = {c: float(np.abs(history[f"{tool}.{c}"]).max(initial=0.0)) for c in (*ways, *turns)}
    column = max(ways, key=lambda c: (sizes[c], c == "uy"))
    if not sizes[column]:
        column = max(turns, key=lambda c: (sizes[c], c == "rz"), default=column)
    if not sizes[column]:
        moving = [t for t in problem.tools if any(np.any(history[f"{t}.{c}"]) for c in (*ways, *turns))]
        named = ", ".join(map(repr, moving)) or "none does"
        raise PrensaError(f"the tool {tool!r} never moves, so there is no travel; tools that move: {named}")
    turning = column in turns
    force = history[f"{tool}.{'m' if turning else 'f'}{column[1]}"]
    units = ("rad", moment_unit(problem)) if turning else (length_unit(problem), force_unit(problem))
    travel, force = (_positive(np.concatenate([[0.0], v])) for v in (history[f"{tool}.{column}"], force))
    return ForceCurve(tool, column if turning else column[1], travel, units[0], force, units[1])


def _positive(values: Array) -> Array:
    """Values (n,) whose largest is made positive."""
    return np.asarray(-values if values[np.argmax(np.abs(values))] < 0.0 else values)
