"""Loads of a tool along its own coordinate, over a whole run: pressure, shear and sliding, their envelopes and means."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prensa.dies.spread import Touch, touch
from prensa.dies.surface import in_space, outline_of
from prensa.errors import PrensaError
from prensa.friction.wear_law import Sliding
from prensa.model.names import suggest
from prensa.model.not_in_space import words_of
from prensa.model.problem import Problem
from prensa.result.increment import Increment, ToolState
from prensa.system.discretise import discretise
from prensa.tools.place import PlacedTool
from prensa.types import Array, Index


class Profile(NamedTuple):
    """Pressure, shear (along the outline, on the tool) of a tool over its m intervals."""

    pressure: Array
    shear: Array


class Rubbed(NamedTuple):
    """The k nodes of a contact in an increment of some ``seconds``: what rubs at each, its ``area`` (k,), of the whole thickness
    or circumference, and its ``shares`` (k, m) in the intervals, on the way that it slid.
    """

    sliding: Sliding
    area: Array
    shares: Array
    seconds: float


@dataclass(frozen=True)
class ToolLoads:
    """Loads of a tool along its outline: m intervals of its coordinate, n increments.

    ``borders`` (m + 1,) coordinates (length), ``x`` (m, 2) middles in the tool's frame, ``area`` (m,) of the intervals (of the
    whole thickness, or circumference); ``number``, ``time`` (n,) of the increments, ``seconds`` (n,) that they took; ``normal``,
    ``shear`` (n, m) forces on the intervals; ``sliding`` (n, m) way (length) that the workpiece slid over them in each increment,
    ``work`` (n, m) normal force times way, of which Archard's law makes wear. Sums over m are those of the nodes of the contacts,
    which ``rubbed`` has contact by contact, for any law of wear.
    """

    tool: str
    borders: Array
    x: Array
    area: Array
    number: Index
    time: Array
    seconds: Array
    normal: Array
    shear: Array
    sliding: Array
    work: Array
    rubbed: tuple[Rubbed, ...] = ()

    @property
    def s(self) -> Array:
        """Middles (m,) of the intervals."""
        return 0.5 * (self.borders[1:] + self.borders[:-1])

    @property
    def largest_force(self) -> int:
        """Row of the increment in which the tool is pressed most."""
        return int(np.argmax(np.hypot(self.normal.sum(axis=1), self.shear.sum(axis=1))))

    def at(self, row: int) -> Profile:
        """Pressure and shear of an increment."""
        return Profile(self.normal[row] / self.area, self.shear[row] / self.area)

    @property
    def envelope(self) -> Profile:
        """Largest pressure, and largest size of the shear, of all increments."""
        return Profile(self.normal.max(axis=0) / self.area, np.abs(self.shear).max(axis=0) / self.area)

    @property
    def mean(self) -> Profile:
        """Mean over the duration of the run."""
        share = self.seconds[:, None] / self.seconds.sum()
        return Profile((share * self.normal).sum(axis=0) / self.area, (share * self.shear).sum(axis=0) / self.area)

    @property
    def slid(self) -> Array:
        """(m,) way that the workpiece has slid over each interval."""
        return np.asarray(self.sliding.sum(axis=0))


def tool_loads(increments: Iterable[Increment], problem: Problem, tool: str, intervals: int = 100) -> ToolLoads:
    """Collect the loads of a tool from the increments of a run, from `solve` or read back from its folder.

    Raises
    ------
    PrensaError
        For a tool that is unknown, or that nothing has touched.

    """
    if tool not in problem.tools:
        known = ", ".join(map(repr, problem.tools)) or "none"
        raise PrensaError(f"unknown tool {tool!r}{suggest(tool, problem.tools)}; tools: {known}")
    if problem.space == "solid":
        raise PrensaError(words_of("loads along outlines"))
    placed = next(t for t in discretise(problem).tools if t.name == tool)
    rows, state = [], None
    for increment, seconds in lasting(increments):
        touches = [
            t
            for c in increment.contacts.values()
            if c.tool == tool and (t := touch(problem, placed, increment.tools[tool], c, seconds)) is not None
        ]
        state = increment.tools[tool]
        rows.append((increment.number, increment.time, seconds, touches))
    found = [t for *_, touches in rows for t in touches]
    if not found or state is None:
        raise PrensaError(f"nothing has pressed on the tool {tool!r} in this run; name one that something presses on")
    return _collected(problem, tool, placed, state, rows, _borders(placed, found, intervals))


def lasting(increments: Iterable[Increment]) -> Iterator[tuple[Increment, float]]:
    """Increments, each with the seconds that it took."""
    before = 0.0
    for increment in increments:
        yield increment, increment.seconds - before
        before = increment.seconds


def _borders(placed: PlacedTool, found: list[Touch], intervals: int) -> Array:
    ends = [(t.s - t.left - np.abs(t.slid), t.s + t.right + np.abs(t.slid)) for t in found]
    lo, hi = min(float(a.min()) for a, _ in ends), max(float(b.max()) for _, b in ends)
    period = placed.shape.period
    if np.isfinite(period) and (hi - lo > 0.5 * period):
        lo, hi = -0.5 * period, 0.5 * period
    return np.linspace(lo, hi, intervals + 1)


def _collected(
    problem: Problem, tool: str, placed: PlacedTool, state: ToolState,
    rows: list[tuple[int, float, float, list[Touch]]], borders: Array,
) -> ToolLoads:  # fmt: skip
    m, period = len(borders) - 1, placed.shape.period
    made = np.zeros((4, len(rows), m))
    width, rubbed = np.diff(borders), []
    around = 2.0 * np.pi if problem.space == "axisymmetric" else problem.thickness
    for k, (*_, lasted, touches) in enumerate(rows):
        for t in touches:
            made[:2, k] += np.stack([t.normal, t.shear]) @ t.shares(borders, period)
            passed = _passed(t, borders, period)
            made[2, k] += t.slid * 0.5 * (t.left + t.right) @ passed / width
            made[3, k] += t.normal * t.slid @ passed
            area = around * t.width
            rubbed.append(Rubbed(Sliding(np.maximum(t.normal, 0.0) / area, t.slid / lasted), area, passed, lasted))
    size = 4.0 * float(np.abs(borders).max())
    ends = in_space(outline_of(placed, size).at(borders), state)
    middles = outline_of(placed, size).at(0.5 * (borders[1:] + borders[:-1]))
    axis = problem.space == "axisymmetric"
    depth = np.pi * np.abs(ends[1:, 0] + ends[:-1, 0]) if axis else problem.thickness
    number, time, seconds = (np.array([r[i] for r in rows]) for i in range(3))
    normal, shear, sliding, work = made
    return ToolLoads(
        tool, borders, middles, width * depth, number, time, seconds, normal, shear, sliding, work, tuple(rubbed)
    )  # fmt: skip


def _passed(t: Touch, borders: Array, period: float) -> Array:
    """Share (k, m) of the nodes' parts in the intervals, on the way that they slid in the increment to where they are."""
    way = t.slid * np.sign(t.shear)  # friction drags the tool the way that the workpiece slides
    count = int(np.clip(np.ceil(np.abs(way).max() / np.diff(borders).max()), 1, len(borders)))
    places = (np.arange(count) + 0.5) / count
    return np.asarray(sum(t.shares(borders, period, -f * way) for f in places) / count)
