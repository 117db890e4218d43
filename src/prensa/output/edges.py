"""Sharp edges of contact: where stresses are singular, so that what is largest there grows as the mesh is refined.

An edge is sharp where the outline of a body turns on a tool, as the rim of a billet between flat plates does, and where a sharp
corner of a tool, as a punch has, presses on a body.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from prensa.dies.spread import joined
from prensa.dies.surface import in_space, outline_of
from prensa.model.problem import Case
from prensa.output.stored import Placement, Stored
from prensa.precision import NEGLIGIBLE
from prensa.result.increment import ContactState, ToolState
from prensa.system.system import System
from prensa.tools.place import ONE_NORMAL, PlacedTool
from prensa.types import Array, Flags


class Edge(NamedTuple):
    """A sharp edge of the contact of a ``body`` with a ``tool``: its ``place`` (2,) now and the ``length`` of elements there."""

    body: str
    tool: str
    place: Array
    length: float


class Edges:
    """Sharp edges of the contacts of a run in *directory*, by increment."""

    def __init__(self, directory: Path, system: System, case: Case) -> None:
        placements = {t.name: Placement((float(t.at[0]), float(t.at[1])), tuple(t.direction.tolist())) for t in system.tools}
        self.stored, self.tools = Stored(directory, case, placements), {t.name: t for t in system.tools}

    def tool_at(self, body: str, number: int, place: tuple[float, ...]) -> str:
        """The tool whose sharp edge of contact a place of a body is at in an increment, within an element; '' of none.

        Edges are looked for in the plane.
        """
        if self.stored.problem.space == "solid":
            return ""
        for edge in self._edges(number):
            if edge.body == body and np.hypot(*(edge.place - place)) <= edge.length * (1.0 + NEGLIGIBLE):
                return edge.tool
        return ""

    def _edges(self, number: int) -> Iterator[Edge]:
        problem = self.stored.problem
        increment = self.stored.number(number)
        for contact in increment.contacts.values():
            tool = self.tools.get(contact.tool)
            closed = contact.status > 0
            if tool is None or not closed.any():
                continue
            where = contact.x if problem.kinematics == "finite" else contact.X
            depth = 2.0 * np.pi * where[:, 0] if problem.space == "axisymmetric" else np.full(len(where), problem.thickness)
            chained = np.isin(np.arange(len(where) - 1), joined(where, contact.weight, depth))
            step = np.hypot(*np.diff(contact.x, axis=0).T)
            for k in np.flatnonzero(_turns(contact, chained) & _pressed(closed, chained)):
                yield Edge(contact.body, contact.tool, contact.x[k], _length(step, chained, int(k)))
            yield from self._of_tool(contact, tool, increment.tools[contact.tool], step, chained)

    def _of_tool(self, contact: ContactState, tool: PlacedTool, state: ToolState, step: Array, chained: Flags) -> Iterator[Edge]:
        """Sharp corners and ends of a tool that press on a body: the nearest node is closed, and within an element."""
        size = 4.0 * float(np.ptp(contact.x, axis=0).max() + np.abs(contact.x).max())
        outline = outline_of(tool, size)
        ends = outline.s[[0, -1]] if np.isinf(tool.shape.period) else outline.s[:0]  # those of an endless one are far away
        for corner in in_space(outline.at(np.concatenate([outline.corners(), ends])), state):
            away = np.hypot(*(contact.x - corner).T)
            k = int(np.argmin(np.where(contact.status > 0, away, np.inf)))
            length = _length(step, chained, k)
            if away[k] <= length:
                yield Edge(contact.body, contact.tool, corner, length)


def _turns(contact: ContactState, chained: Flags) -> Flags:
    """Nodes (k,) at which the outline turns at first, and free ends of the surface: those that no support holds along it."""
    d = np.diff(contact.X, axis=0)
    d = d / np.maximum(np.hypot(*d.T), np.finfo(float).tiny)[:, None]
    out = np.zeros(len(contact.X), dtype=bool)
    both = chained[1:] & chained[:-1]
    out[1:-1] = both & ((d[1:] * d[:-1]).sum(axis=1) < ONE_NORMAL)
    moved, size = contact.x - contact.X, float(np.ptp(contact.X, axis=0).max())
    for k in range(len(out)):
        before, after = k > 0 and bool(chained[k - 1]), k < len(chained) and bool(chained[k])
        if before != after:
            out[k] = abs(float(moved[k] @ d[k - 1 if before else k])) > NEGLIGIBLE * size
    return out


def _pressed(closed: Flags, chained: Flags) -> Flags:
    """Nodes (k,) that carry contact, or whose neighbours do."""
    out = closed.copy()
    out[1:] |= closed[:-1] & chained
    out[:-1] |= closed[1:] & chained
    return out


def _length(step: Array, chained: Flags, k: int) -> float:
    """Longest edge that meets in a node of a surface."""
    return max((float(step[j]) for j in (k - 1, k) if 0 <= j < len(step) and chained[j]), default=0.0)
