"""Keywords of Abaqus and CalculiX decks with their data lines, and the scopes (part instances, assembly) in which they stand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count
from math import cos, hypot, inf, isfinite, radians, sin

import numpy as np

from prensa.importers.abaqus_words import keyword, parameter
from prensa.importers.deck import FileError
from prensa.precision import DRAWN


@dataclass(slots=True)
class Keyword:
    """``*NAME, KEY=value, …`` and its data lines."""

    name: str
    parameters: dict[str, str]
    line: int
    lines: Sequence[tuple[int, str]] = ()

    @property
    def data(self) -> Iterator[tuple[int, list[str]]]:
        """Numbers of the data lines and their words, split when asked for: a wrong line ends the reading."""
        for number, line in self.lines:
            yield number, [w.strip().strip('"') for w in line.rstrip(",").split(",")]

    def numbered(self, count: int) -> Iterator[tuple[int, list[int]]]:
        """Rows of whole numbers, which may go on over lines until they are ``count``, with the line that ends each."""
        row: list[int] = []
        line = self.line
        for line, words in self.data:
            try:
                row += [int(w) for w in words]
            except ValueError:
                raise FileError.at(line, f"{', '.join(words)[:60]!r} is not a list of whole numbers") from None
            if len(row) >= count:
                yield line, row
                row = []
        if row:
            yield line, row

    @property
    def rows(self) -> list[list[str]]:
        """The words of the data lines of a keyword that needs some.

        Raises
        ------
        FileError
            If there is none.

        """
        rows = [row for _, row in self.data]
        if not rows:
            raise FileError.at(self.line, f"*{self.name} has no data line")
        return rows

    def number(self, row: list[str], place: int, default: float | None = None) -> float:
        """The number at a place of a data line, or the default where there is none.

        Raises
        ------
        FileError
            If it is no finite number, or none and there is no default.

        """
        if len(row) <= place or not row[place]:
            if default is None:
                raise FileError.at(self.line, f"*{self.name} has no value number {place + 1}")
            return default
        try:
            value = float(row[place].upper().replace("D", "E"))
        except ValueError:
            value = inf
        if not isfinite(value):
            raise FileError.at(self.line, f"{row[place][:60]!r} of *{self.name} is not a number")
        return value


@dataclass
class Scope:
    """What an instance of a part defines, or the assembly (``name`` empty; also a deck without parts).

    Names are in capitals, labels those of the whole deck: ``offset`` + the file's own. ``spelling``: names as written;
    ``boundary_of``, ``part_of``: names of its sets and surfaces in the `Deck`.
    """

    name: str = ""
    part: str = ""
    offset: int = 0
    line: int = 0
    placed: list[tuple[int, list[str]]] = field(default_factory=list)
    nodes: list[int] = field(default_factory=list)
    cells: list[int] = field(default_factory=list)
    solids: list[int] = field(default_factory=list)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[int, ...]]] = field(default_factory=dict)
    spelling: dict[str, str] = field(default_factory=dict)
    boundary_of: dict[str, str] = field(default_factory=dict)
    part_of: dict[str, str] = field(default_factory=dict)

    def moved(self, x: float, y: float) -> tuple[float, float]:
        """A place of the part, where the instance has it: translated, then turned about an axis along z.

        Raises
        ------
        FileError
            If it is turned out of its plane.

        """
        for number, (line, words) in enumerate(self.placed):
            v = _placing(line, words)
            if number == 0 and len(v) <= 3:
                x, y = x + v[0], y + (v[1] if len(v) > 1 else 0.0)
            elif len(v) == 7 and number < 2:
                if v[6] and hypot(v[3] - v[0], v[4] - v[1]) > DRAWN * abs(v[5] - v[2]):
                    raise FileError.at(line, "the instance is turned out of the plane of x and y; draw its part in that plane")
                # Abaqus turns by the right-hand rule about the axis from the first point to the second: one along −z turns
                # clockwise.
                angle = radians(v[6]) * (1.0 if v[5] >= v[2] else -1.0)
                c, s, dx, dy = cos(angle), sin(angle), x - v[0], y - v[1]
                x, y = v[0] + c * dx - s * dy, v[1] + s * dx + c * dy
            else:
                raise FileError.at(line, f"{', '.join(words)[:60]!r} is not a translation (3) or two points and an angle (7)")
        return x, y

    def moved_in_space(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """The same in space: translated, then turned about any axis (Rodrigues).

        Raises
        ------
        FileError
            If a line is no translation and no turn, or the axis has no length.

        """
        place = np.array([x, y, z])
        for number, (line, words) in enumerate(self.placed):
            v = np.array(_placing(line, words))
            if number == 0 and len(v) <= 3:
                place = place + np.pad(v, (0, 3 - len(v)))
                continue
            axis = v[3:6] - v[:3] if len(v) == 7 and number < 2 else np.zeros(3)
            if not (length := float(np.linalg.norm(axis))):
                raise FileError.at(line, f"{', '.join(words)[:60]!r} is not a translation (3) or two points and an angle (7)")
            way, k, angle = place - v[:3], axis / length, radians(v[6])
            turned = cos(angle) * way + sin(angle) * np.cross(k, way) + (1.0 - cos(angle)) * (k @ way) * k
            place = v[:3] + turned
        return float(place[0]), float(place[1]), float(place[2])


def _placing(line: int, words: list[str]) -> list[float]:
    """The numbers of a line that places an instance."""
    try:
        return [float(w.upper().replace("D", "E")) if w else 0.0 for w in words]
    except ValueError:
        raise FileError.at(line, f"{', '.join(words)[:60]!r} does not place an instance") from None


def _parameters(text: str) -> dict[str, str]:
    """The values of a keyword line, by their names in capitals."""
    pairs = (word.partition("=") for word in text.split(","))
    # Abaqus takes no notice of case in names: they are compared in capitals and shown as they were written.
    return {parameter(name): value.strip().strip('"') for name, _, value in pairs if name.strip()}


def _keyword(text: str, line: int) -> Keyword:
    """A keyword line without its data."""
    name, comma, rest = text[1:].partition(",")
    return Keyword(keyword(name), _parameters(rest) if comma else {}, line)


def keywords(text: str, origins: Sequence[int] | None = None) -> Iterator[Keyword]:
    """Keyword lines of a deck with their data lines; comments are left out, lines that go on are joined.

    origins: numbers of the lines, `prensa.importers.abaqus_includes.Origin` in a deck of several files; default: from 1.
    """
    current: Keyword | None = None
    lines: list[tuple[int, str]] = []
    joined = ""
    last: int = 1
    for number, raw in zip(origins or count(1), text.splitlines()):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if joined or line.startswith("*"):
            if joined and line.startswith("*"):  # a comma too many at the end of a line: the next keyword is one of its own
                if current is not None:
                    yield current
                current, joined = _keyword(joined, last), ""
            joined, last = joined + line, number
            if joined.endswith(","):
                continue  # a keyword line goes on after a comma
            if current is not None:
                yield current
            current, joined = _keyword(joined, number), ""
        elif current is not None:
            if not current.lines:
                current.lines = lines = []
            lines.append((number, line))
        else:
            words = "stands before any keyword, such as *NODE; take it out, or make it a comment (**)"
            raise FileError.at(number, f"{line[:60]!r} {words}")
    if current is not None:
        yield current
    if joined:  # a comma too many at the end of the last line
        yield _keyword(joined, last)
