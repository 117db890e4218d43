"""Sharp edges of contact: where stresses are singular, so that what is largest there grows as the mesh is refined.

An edge is sharp where the outline of a body turns on a tool, as the rim of a billet between flat plates does, where a sharp
corner of a tool, as a punch has, presses on a body. Where a side has folded onto the tool, past a corner of the body, the end of
the contact is one too: one node after another comes down there, and the elements beside it turn about it by all of the angle.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from prensa.dies.spread import joined
from prensa.dies.surface import in_space, outline_of
from prensa.geometry.plane import ONE_NORMAL
from prensa.model.problem import Case
from prensa.output.stored import Placement, Stored
from prensa.precision import NEGLIGIBLE
from prensa.result.increment import BodyState, ContactState, ToolState
from prensa.system.system import System
from prensa.tools.place import PlacedTool
from prensa.types import Array, Flags


class Edge(NamedTuple):
    """A sharp edge of the contact of a ``body`` with a ``tool``: its ``place`` (2,) now, how far the elements there ``reach``."""

    body: str
    tool: str
    place: Array
    reach: float


class Edges:
    """Sharp edges of the contacts of a run in *directory*, by increment."""

    def __init__(self, directory: Path, system: System, case: Case) -> None:
        placements = {t.name: Placement((float(t.at[0]), float(t.at[1])), tuple(t.direction.tolist())) for t in system.tools}
        self.stored, self.tools = Stored(directory, case, placements), {t.name: t for t in system.tools}

    def tool_at(self, body: str, number: int, place: tuple[float, ...]) -> str:
        """The tool whose sharp edge of contact a place of a body is at in an increment, within its elements; '' of none.

        Edges are looked for in the plane.
        """
        if self.stored.problem.space == "solid":
            return ""
        for edge in self._edges(number):
            if edge.body == body and np.hypot(*(edge.place - place)) <= edge.reach * (1.0 + NEGLIGIBLE):
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
            reach = partial(_reach, increment.bodies[contact.body])
            corners = _turns(contact, chained)
            ends = _past(corners, closed, chained) & _turned(contact.x, chained)
            for k in np.flatnonzero((corners & _pressed(closed, chained)) | ends):
                yield Edge(contact.body, contact.tool, contact.x[k], reach(int(contact.node[k])))
            step = np.hypot(*np.diff(contact.x, axis=0).T)
            for nearest, corner in self._of_tool(contact, tool, increment.tools[contact.tool], step, chained):
                yield Edge(contact.body, contact.tool, corner, reach(int(contact.node[nearest])))

    def _of_tool(
        self, contact: ContactState, tool: PlacedTool, state: ToolState, step: Array, chained: Flags
    ) -> Iterator[tuple[int, Array]]:
        """Sharp corners and ends (2,) of a tool that press on a body: the nearest node is closed, and within a side."""
        size = 4.0 * float(np.ptp(contact.x, axis=0).max() + np.abs(contact.x).max())
        outline = outline_of(tool, size)
        ends = outline.s[[0, -1]] if np.isinf(tool.shape.period) else outline.s[:0]  # those of an endless one are far away
        for corner in in_space(outline.at(np.concatenate([outline.corners(), ends])), state):
            away = np.hypot(*(contact.x - corner).T)
            k = int(np.argmin(np.where(contact.status > 0, away, np.inf)))
            if away[k] <= _length(step, chained, k):
                yield k, corner


def _turns(contact: ContactState, chained: Flags) -> Flags:
    """Nodes (k,) at which the outline turns at first, and free ends of the surface: those that no support holds along it."""
    d = np.diff(contact.X, axis=0)
    d = d / np.maximum(np.hypot(*d.T), np.finfo(float).tiny)[:, None]
    out = _turned(contact.X, chained)
    moved, size = contact.x - contact.X, float(np.ptp(contact.X, axis=0).max())
    for k in range(len(out)):
        before, after = k > 0 and bool(chained[k - 1]), k < len(chained) and bool(chained[k])
        if before != after:
            out[k] = abs(float(moved[k] @ d[k - 1 if before else k])) > NEGLIGIBLE * size
    return out


def _turned(x: Array, chained: Flags) -> Flags:
    """Nodes (k,) at x (k, 2) between whose two sides the outline turns."""
    d = np.diff(x, axis=0)
    d = d / np.maximum(np.hypot(*d.T), np.finfo(float).tiny)[:, None]
    out = np.zeros(len(x), dtype=bool)
    out[1:-1] = chained[1:] & chained[:-1] & ((d[1:] * d[:-1]).sum(axis=1) < ONE_NORMAL)
    return out


def _past(corners: Flags, closed: Flags, chained: Flags) -> Flags:
    """Nodes (k,) at which a contact ends that goes on from one of the ``corners`` (k,) of the outline to another node."""
    out = np.zeros(len(closed), dtype=bool)
    zone = np.concatenate([[0], np.cumsum(~(closed[1:] & closed[:-1] & chained))])
    for number in np.unique(zone[closed & corners]):
        nodes = np.flatnonzero(zone == number)
        out[nodes[[0, -1]]] = True
    return out & ~corners


def _reach(body: BodyState, node: int) -> float:
    """Distance from a node to the farthest of the elements that meet in it."""
    around = body.cells[(body.cells == node).any(axis=1)]
    return float(np.hypot(*(body.x[around] - body.x[node]).reshape(-1, 2).T).max(initial=0.0))


def _pressed(closed: Flags, chained: Flags) -> Flags:
    """Nodes (k,) that carry contact, or whose neighbours do."""
    out = closed.copy()
    out[1:] |= closed[:-1] & chained
    out[:-1] |= closed[1:] & chained
    return out


def _length(step: Array, chained: Flags, k: int) -> float:
    """Longest edge that meets in a node of a surface."""
    return max((float(step[j]) for j in (k - 1, k) if 0 <= j < len(step) and chained[j]), default=0.0)
