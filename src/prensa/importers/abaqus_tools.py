"""Rigid surfaces of Abaqus decks as profiles of tools: analytical ones, and chains of rigid line elements."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from math import atan2, cos, hypot, isfinite, pi, sin
from typing import Any

from prensa.importers.abaqus_keywords import Keyword
from prensa.importers.deck import FileError
from prensa.precision import DRAWN, NEGLIGIBLE

PIECES_OF_ARC = 12  # straight pieces of an arc, to find on which side of it a body lies


@dataclass
class RigidTool:
    """A rigid surface: ``vertices`` places, or arcs ``{through, to}``; ``reference`` the label of its reference node.

    ``sided``: whether the file says on which side the bodies are (on the left of the walk); ``nodes`` of its elements, if any;
    ``solid``: middles of the plane elements of which it is the outline; ``edges``: pairs of nodes of the elements, of which
    the vertices are made once it is known which of them lie on a line of symmetry.
    """

    name: str
    line: int
    vertices: list[Any]
    fillet: float | None
    sided: bool
    reference: int | None = None
    nodes: frozenset[int] = frozenset()
    surfaces: list[str] = field(default_factory=list)
    solid: list[tuple[float, float]] = field(default_factory=list)
    edges: list[tuple[int, ...]] = field(default_factory=list)

    @property
    def closed(self) -> bool:
        """Whether it returns to its first point."""
        ends = _ends(self.vertices)
        size = max(hypot(x - ends[0][0], y - ends[0][1]) for x, y in ends)
        return len(ends) > 2 and hypot(ends[-1][0] - ends[0][0], ends[-1][1] - ends[0][1]) <= DRAWN * size

    def draw(self, nodes: dict[int, tuple[float, float, float]], symmetry: list[tuple[int, float]]) -> None:
        """Make the vertices of edges, without those that lie on lines of symmetry (coordinate, its value).

        A tool goes on straight beyond its ends, as its other half does; a corner on the line would be rounded.

        Raises
        ------
        FileError
            If the edges make no single chain.

        """
        if not self.edges:
            return
        used = [nodes[n] for edge in self.edges for n in edge if n in nodes]
        size = max(max(x[i] for x in used) - min(x[i] for x in used) for i in (0, 1)) if used else 0.0

        def on(edge: tuple[int, ...]) -> bool:
            return any(all(n in nodes and abs(nodes[n][i] - c) <= DRAWN * size for n in edge) for i, c in symmetry)

        self.vertices = chain(self.line, [e for e in self.edges if not on(e)] or self.edges, nodes)

    def walk(self, bodies: list[tuple[float, float]]) -> list[Any]:
        """Vertices with the tool on the left: bodies, by the middles of their elements, on the right.

        They decide where the file does not, or where it puts most of those that are near to the inside.
        """
        # By the rule of Abaqus bodies are on the left of the walk; a surface drawn the wrong way round still makes the tool
        # that was meant, since the bodies decide where there are any.
        inside = _share_on_the_left(self.vertices, bodies) if bodies else 1.0 if self.sided else 0.0
        if self.solid:
            inside = 1.0 - _share_on_the_left(self.vertices, self.solid)
        vertices = _reversed(self.vertices) if inside > 0.5 or (inside == 0.5 and self.sided) else self.vertices
        if self.closed:  # to the digit
            last = vertices[-1]
            vertices = [*vertices[:-1], {**last, "to": vertices[0]} if isinstance(last, dict) else vertices[0]]
        return vertices


def segments(k: Keyword) -> Iterator[Any]:
    """Vertices of START, LINE and CIRCL rows; an arc is the shorter one about its centre.

    Raises
    ------
    FileError
        If a row is something else.

    """
    at: tuple[float, float] | None = None
    for line, words in k.data:
        try:
            kind, x = words[0].upper(), [float(w) for w in words[1:] if w]
            if not all(isfinite(v) for v in x):
                raise ValueError
        except ValueError:
            raise FileError.at(line, f"{', '.join(words)[:60]!r} is not START, LINE or CIRCL with coordinates") from None
        if kind == "CIRCL" and at is not None and len(x) == 4:
            (bx, by), (cx, cy) = x[:2], x[2:]
            first = atan2(at[1] - cy, at[0] - cx)
            # Into [−π, π): CIRCL rows name no direction, the shorter arc is meant.
            sweep = (atan2(by - cy, bx - cx) - first + pi) % (2 * pi) - pi
            r, middle = hypot(bx - cx, by - cy), first + 0.5 * sweep
            at = (bx, by)
            yield {"through": (cx + r * cos(middle), cy + r * sin(middle)), "to": at}
        elif kind in ("START", "LINE") and len(x) == 2:
            at = (x[0], x[1])
            yield at
        else:
            raise FileError.at(line, f"{', '.join(words)[:60]!r} is not START x, y; LINE x, y or CIRCL x, y, centre x, centre y")


def chain(line: int, elements: list[tuple[int, ...]], nodes: dict[int, tuple[float, float, float]]) -> list[Any]:
    """Vertices of the chain that line elements make, those on a straight line left out; line: of the file, for messages.

    Raises
    ------
    FileError
        If they branch, or make several chains.

    """
    beside: dict[int, list[int]] = {}
    for a, b in (e[:2] for e in elements):
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    # A closed chain has no end and is walked from any of its nodes.
    ends = [n for n, others in beside.items() if len(others) == 1]
    # The lowest of the leftmost nodes is a corner, and not one on a straight side.
    at = ends[0] if ends else min(beside, key=lambda n: nodes.get(n, (0.0, 0.0, 0.0)))
    walked, before = [at], None
    while following := [n for n in beside[at] if n != before]:
        before, at = at, following[0]
        walked.append(at)
        if at == walked[0] or len(walked) > len(beside):
            break
    if len(ends) not in (0, 2) or len(set(walked)) != len(beside) or any(n not in nodes for n in walked):
        raise FileError.at(line, "the elements of this rigid body make no single chain; write a rigid body for each")
    places = [nodes[n][:2] for n in walked]
    kept = [places[0]]
    for p, after in pairwise(places[1:]):
        ax, ay, bx, by = p[0] - kept[-1][0], p[1] - kept[-1][1], after[0] - p[0], after[1] - p[1]
        # Nodes on a straight stretch would become corners of the profile; one where the chain turns back stays.
        if abs(ax * by - ay * bx) > NEGLIGIBLE * hypot(ax, ay) * hypot(bx, by) or ax * bx + ay * by < 0:
            kept.append(p)
    return [*kept, places[-1]]


def _ends(walk: list[Any]) -> list[tuple[float, float]]:
    return [v["to"] if isinstance(v, dict) else v for v in walk]


def _reversed(walk: list[Any]) -> list[Any]:
    ends = _ends(walk)
    out: list[Any] = [ends[-1]]
    for v, to in zip(reversed(walk), reversed(ends[:-1])):
        out.append({"through": v["through"], "to": to} if isinstance(v, dict) else to)
    return out


def _straight(walk: list[Any]) -> list[tuple[float, float]]:
    """Corners of the walk, its arcs made straight pieces."""
    out = [_ends(walk)[0]]
    for v in walk[1:]:
        if isinstance(v, dict):
            out += _on_arc(out[-1], v["through"], v["to"])
        else:
            out.append(v)
    return out


def _on_arc(a: tuple[float, float], m: tuple[float, float], b: tuple[float, float]) -> list[tuple[float, float]]:
    """Places on the arc from a through its middle m to b, b included."""
    ux, uy, vx, vy = m[0] - a[0], m[1] - a[1], b[0] - a[0], b[1] - a[1]
    twice = 2.0 * (ux * vy - uy * vx)
    if twice == 0.0:
        return [b]
    cx = a[0] + (vy * (ux * ux + uy * uy) - uy * (vx * vx + vy * vy)) / twice
    cy = a[1] + (ux * (vx * vx + vy * vy) - vx * (ux * ux + uy * uy)) / twice
    first = atan2(a[1] - cy, a[0] - cx)
    half = (atan2(m[1] - cy, m[0] - cx) - first + pi) % (2 * pi) - pi
    r = hypot(a[0] - cx, a[1] - cy)
    angles = (first + 2 * half * i / PIECES_OF_ARC for i in range(1, PIECES_OF_ARC))
    return [*((cx + r * cos(t), cy + r * sin(t)) for t in angles), b]


def _share_on_the_left(walk: list[Any], places: list[tuple[float, float]]) -> float:
    """Share of the places, nearer ones counting more, that lie on the left of the nearest piece of the walk."""
    corners = _straight(walk)
    left = total = 0.0
    for x, y in places:
        best, side = float("inf"), 0.0
        for (ax, ay), (bx, by) in pairwise(corners):
            dx, dy = bx - ax, by - ay
            length = dx * dx + dy * dy
            t = min(1.0, max(0.0, ((x - ax) * dx + (y - ay) * dy) / length)) if length else 0.0
            away = hypot(x - ax - t * dx, y - ay - t * dy)
            if away < best:
                best, side = away, dx * (y - ay) - dy * (x - ax)
        # The nearest elements know best: far ones of a body that is wrapped around may lie on the other side.
        weight = best**-2 if 1e-100 < best < 1e100 else 0.0
        total += weight
        left += weight if side > 0.0 else 0.0
    return left / total if total else 0.5
