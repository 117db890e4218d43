"""What a run says of ductile damage: the largest of each law with its place, and where and when a limit was first reached."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.errors import coordinates
from prensa.measures.columns import directions
from prensa.measures.damage import DamageLaw, laws, unit_of
from prensa.measures.units import length_unit
from prensa.model.problem import Problem

Table = Mapping[str, NDArray[Any]]


class Moment(NamedTuple):
    """When and where: ``step`` and ``increment`` (of the place, the end of what the time lies in), ``time``, ``place`` (d,).

    ``tool`` that has travelled farthest by then, and its ``travel``; '' and None where none moves. ``edge_of``: the tool at a
    sharp edge of whose contact the place is; '' where it is at none.
    """

    step: str
    increment: int
    time: float
    place: tuple[float, ...]
    tool: str
    travel: float | None
    edge_of: str = ""


class Damage(NamedTuple):
    """Of a ``law`` in a ``body``: the ``largest`` damage in ``unit`` and when and where it was first that large (``at``).

    ``limit``: that of the law, None without; ``reached``: when it first was, None where it was not. That is between two
    increments by linear interpolation, at the place where damage was largest at the end of the second.
    """

    body: str
    law: str
    heading: str
    unit: str
    largest: float
    at: Moment
    limit: float | None
    reached: Moment | None

    def entry(self) -> dict[str, Any]:
        """What ``summary.json`` has of it."""
        own = self._asdict() | {"at": self.at._asdict()}
        return own | {"reached": None if self.reached is None else self.reached._asdict()}


def damages(table: Table, problem: Problem) -> list[Damage]:
    """Of all laws of all bodies, from the columns of ``history.csv``."""
    found = [_damage(table, problem, body, law) for body, law in laws(problem) if f"{body}.damage.{law.name}" in table]
    return [damage for damage in found if damage is not None]


def located(found: Iterable[Damage], edge: Callable[[str, int, tuple[float, ...]], str]) -> Iterator[Damage]:
    """Damages with the tools at whose sharp edges of contact they are; ``edge``: that tool by body, increment and place."""
    for d in found:
        at, reached = d.at._replace(edge_of=edge(d.body, d.at.increment, d.at.place)), d.reached
        if reached is not None:
            reached = reached._replace(edge_of=edge(d.body, reached.increment, reached.place))
        yield d._replace(at=at, reached=reached)


def stated(entries: Iterable[Mapping[str, Any]]) -> Iterator[Damage]:
    """Damages from what ``summary.json`` has of them."""
    for entry in entries:
        moments = {k: entry[k] and Moment(**entry[k]) for k in ("at", "reached")}
        yield Damage(**{**entry, **moments})


def sentences(found: Iterable[Damage], problem: Problem, shown: Callable[[float, str], str]) -> Iterator[str]:
    """Each of them in words: 'damage of billet (Oyane) reaches its limit 0.3 after 5.2 mm of punch, at (12.3, 0) mm'.

    ``shown``: a number with its unit in words. A place at a sharp edge of contact is called that.
    """
    unit = length_unit(problem)

    def where(m: Moment, body: str) -> str:
        place = f"at ({coordinates(m.place)}) {unit}"
        other = f"'{body}.SIDE.damage at y=…' is the damage at another place"
        edge = f" (a sharp edge of the contact with {m.edge_of}, where it grows with the mesh; {other})"
        return place + edge * bool(m.edge_of)

    def when(m: Moment) -> str:
        return f"at time {m.time:.4g}" if m.travel is None else f"after {m.travel:.4g} {unit} of {m.tool}"

    for d in found:
        largest = shown(d.largest, d.unit)
        of = f"of {d.body} ({d.heading})"
        if d.limit is None:
            yield f"largest damage {of}: {largest} {where(d.at, d.body)}"
        elif d.reached is None:
            limit = shown(d.limit, d.unit)
            yield f"largest damage {of}: {100 * d.largest / d.limit:.3g} % of the limit {limit}, {where(d.at, d.body)}"
        else:
            limit = shown(d.limit, d.unit)
            more = f"; in the end {largest}" if d.largest > 1.001 * d.limit else ""
            yield f"damage {of} reaches its limit {limit} {when(d.reached)}, {where(d.reached, d.body)}{more}"


# ------------------------------------------------------------------------------------------------------------- details
def _damage(table: Table, problem: Problem, body: str, law: DamageLaw) -> Damage | None:
    values = table[f"{body}.damage.{law.name}"]
    if not np.isfinite(values).any():
        return None
    k = int(np.nanargmax(values))
    column = f"{body}.damage.{law.name}"
    reached = None
    beyond = np.flatnonzero(values >= law.limit) if law.limit is not None else np.zeros(0, dtype=np.int64)
    if law.limit is not None and len(beyond):
        j = int(beyond[0])
        before = float(values[j - 1]) if j else 0.0
        share = (law.limit - before) / (float(values[j]) - before) if before < law.limit < values[j] else 1.0
        reached = _moment(table, problem, column, j, share)
    unit, largest = unit_of(problem, law), float(values[k])
    return Damage(body, law.name, law.heading, unit, largest, _moment(table, problem, column, k, 1.0), law.limit, reached)


def _moment(table: Table, problem: Problem, column: str, k: int, share: float) -> Moment:
    """A ``share`` of the way from the row before to row k of the table."""

    def at(name: str) -> float:
        before = float(table[name][k - 1]) if k else 0.0
        return before + share * (float(table[name][k]) - before)

    axes = "xyz"[: directions(problem)]
    ways = {tool: math.hypot(*(at(f"{tool}.u{axis}") for axis in axes)) for tool in problem.tools}
    tool = max(ways, key=ways.__getitem__, default="")
    place = tuple(float(table[f"{column}.{axis}"][k]) for axis in axes)
    moved = bool(tool) and ways[tool] > 0.0
    return Moment(
        str(table["step"][k]), int(table["increment"][k]), at("time"), place, tool if moved else "", ways[tool] if moved else None
    )
