"""Reader of Abaqus (and CalculiX) ``.inp`` decks: nodes, elements, node and element sets, surfaces, parts and instances.

Keywords: Abaqus keywords reference. What does not concern the mesh is passed over; what would generate nodes or elements
is refused, because the mesh would be incomplete without it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from prensa.mesh.deck import Deck, FileError

_CELL = re.compile(r"(?:CPEG|CPE|CPS|CGAX|CAX|AC2D|ACAX|DC2D|DCAX|M3D|SFM3D|STRI|S)([3468])")
_LINE = re.compile(r"(?:T2D|T3D|R2D|RAX|SAX|B2|B3|DC1D)([123])")


@dataclass
class Keyword:
    """``*NAME, KEY=value, …`` and its data lines; sets of one part share a ``scope``."""

    name: str
    parameters: dict[str, str]
    line: int
    lines: list[tuple[int, str]] = field(default_factory=list)

    @property
    def data(self) -> Iterator[tuple[int, list[str]]]:
        """Numbers of the data lines and their words, split when asked for: a wrong line ends the reading."""
        for number, line in self.lines:
            yield number, [w.strip() for w in line.rstrip(",").split(",")]

    def numbers(self) -> list[int]:
        """All data as whole numbers."""
        out: list[int] = []
        for line, words in self.data:
            try:
                out += [int(w) for w in words]
            except ValueError:
                raise FileError.at(line, f"{', '.join(words)[:60]!r} is not a list of whole numbers") from None
        return out


@dataclass
class _Part:
    """Nodes, elements and sets of one part (or of a deck without parts): sets by name in capitals."""

    offset: int
    moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
    instances: int = 0
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    cells: dict[int, tuple[int, ...]] = field(default_factory=dict)
    lines: dict[int, tuple[int, ...]] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[int, ...]]] = field(default_factory=dict)
    spelling: dict[str, str] = field(default_factory=dict)


LABELS = 10**9  # labels of different parts are kept apart by this


def keywords(text: str) -> Iterator[Keyword]:
    """Keyword lines of a deck with their data lines; comments are left out, lines that go on are joined."""
    current: Keyword | None = None
    joined = ""
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if joined or line.startswith("*"):
            joined += line
            if joined.endswith(","):
                continue  # a keyword line goes on after a comma
            words = [w.strip() for w in joined[1:].split(",")]
            pairs = (w.partition("=") for w in words[1:])
            if current is not None:
                yield current
            current = Keyword(words[0].upper(), {k.strip().upper(): v.strip().strip('"') for k, _, v in pairs}, number)
            joined = ""
        elif current is not None:
            current.lines.append((number, line))
    if current is not None:
        yield current


def read(text: str) -> Deck:
    """Contents of a deck.

    Raises
    ------
    FileError
        If it generates nodes or elements, has three-dimensional elements, or contradicts itself.

    """
    parts: dict[str, _Part] = {"": _Part(0)}
    instances: dict[str, str] = {}
    here = ""
    for k in keywords(text):
        match k.name:
            case "PART":
                here = k.parameters.get("NAME", "").upper()
                parts[here] = _Part(LABELS * len(parts))
                parts[here].spelling[here] = k.parameters.get("NAME", "")
            case "END PART" | "END INSTANCE":
                here = ""
            case "INSTANCE":
                _instance(k, parts, instances)
            case "NODE" | "ELEMENT" | "NSET" | "ELSET" | "SURFACE":
                owner = k.parameters.get("INSTANCE", "").upper()
                _into(k, parts[instances.get(owner, here)])
            case "NGEN" | "NFILL" | "NCOPY" | "NMAP" | "ELGEN" | "ELCOPY" | "INCLUDE" | "SYSTEM":
                raise FileError.at(
                    k.line, f"*{k.name} is not read; write the nodes and elements themselves into the file"
                )
    deck = Deck()
    for name, part in parts.items():
        _join(deck, name, part, several=len(parts) > 2)
    if not deck.cells:
        raise FileError("the deck has no plane elements (CPE4, CPS4, CAX4, …)")
    return deck


def _instance(k: Keyword, parts: dict[str, _Part], instances: dict[str, str]) -> None:
    name = k.parameters.get("PART", "").upper()
    if name not in parts:
        raise FileError.at(k.line, f"there is no part {k.parameters.get('PART', '')!r}")
    part = parts[name]
    part.instances += 1
    if part.instances > 1:
        raise FileError.at(k.line, f"part {k.parameters['PART']!r} is placed twice; export the assembly as one part")
    instances[k.parameters.get("NAME", "").upper()] = name
    if len(k.lines) > 1:
        raise FileError.at(k.line, "the instance is rotated; export the assembly as one part")
    for line, words in k.data:
        part.moved = _place(line, words)


def _place(line: int, words: list[str]) -> tuple[float, float, float]:
    try:
        x = [float(w.upper().replace("D", "E")) if w else 0.0 for w in words[:3]]
    except ValueError:
        raise FileError.at(line, f"{', '.join(words)[:60]!r} is not coordinates") from None
    x += [0.0] * (3 - len(x))
    return x[0], x[1], x[2]


def _into(k: Keyword, part: _Part) -> None:
    name = next((k.parameters[p] for p in ("NSET", "ELSET", "NAME") if k.parameters.get(p)), "")
    key = name.upper()
    part.spelling.setdefault(key, name)
    if k.name == "NODE":
        if k.parameters.get("SYSTEM", "R").upper() != "R":
            raise FileError.at(k.line, "coordinates of another system than the rectangular one are not read")
        for line, words in k.data:
            try:
                label = int(words[0])
            except ValueError:
                raise FileError.at(line, f"{', '.join(words)[:60]!r} is not: label, x, y") from None
            part.nodes[label] = _place(line, words[1:])
            if name:
                part.node_sets.setdefault(key, []).append(label)
    elif k.name == "ELEMENT":
        _elements(k, part, key)
    elif k.name in ("NSET", "ELSET"):
        sets = part.node_sets if k.name == "NSET" else part.element_sets
        if not name:
            raise FileError.at(k.line, f"*{k.name} without a name")
        sets.setdefault(key, []).extend(_members(k, sets, part))
    elif k.parameters.get("TYPE", "ELEMENT").upper() == "NODE":
        nodes = replace(k, lines=[(line, text.partition(",")[0]) for line, text in k.lines])
        part.node_sets.setdefault(key, []).extend(_members(nodes, part.node_sets, part))
    elif k.parameters.get("TYPE", "ELEMENT").upper() == "ELEMENT":  # the others are rigid, without elements
        part.surfaces.setdefault(key, []).extend(_sides(k, part))


def _elements(k: Keyword, part: _Part, set_name: str) -> None:
    kind = k.parameters.get("TYPE", "").upper()
    cell, line = _CELL.match(kind), _LINE.match(kind)
    if kind.startswith(("C3D", "SC", "CSS", "COH3")) or not (cell or line):
        if kind.startswith(("MASS", "SPRING", "DASHPOT", "CONN", "ROTARY", "DCOUP")):
            return
        raise FileError.at(
            k.line,
            f"element type {kind or 'missing'!r} is no plane element of 3, 4, 6 or 8 nodes (a section is meshed in x, y)",
        )
    if cell:
        count = int(cell[1])
    else:
        assert line is not None
        count = int(line[1]) + (1 if kind.startswith(("SAX", "B2", "B3")) else 0)
    numbers = k.numbers()
    if len(numbers) % (count + 1):
        raise FileError.at(
            k.line, f"elements {kind} have {count} nodes; {len(numbers)} numbers are no rows of {count + 1}"
        )
    into = part.cells if cell else part.lines
    for first in range(0, len(numbers), count + 1):
        label = numbers[first]
        into[label] = tuple(numbers[first + 1 : first + 1 + count])
        if set_name:
            part.element_sets.setdefault(set_name, []).append(label)


def _members(k: Keyword, sets: dict[str, list[int]], part: _Part) -> list[int]:
    """Labels of a set: listed, generated (first, last, step), or those of sets named in it."""
    out: list[int] = []
    limit = 10 * (len(part.nodes) + len(part.cells) + len(part.lines)) + 10
    for line, words in k.data:
        if "GENERATE" in k.parameters:
            try:
                first, last, step = (*(int(w) for w in words), 1)[:3]
            except ValueError:
                raise FileError.at(line, f"{', '.join(words)[:60]!r} is not: first, last, step") from None
            if step < 1 or last < first or (last - first) // step > limit:
                raise FileError.at(line, f"{first}, {last}, {step} generates no set of this mesh")
            out += range(first, last + 1, step)
            continue
        for word in words:
            if word.lstrip("+-").isdigit():
                out.append(int(word))
            elif word.upper() in sets:
                out += sets[word.upper()]
            elif word:
                raise FileError.at(line, f"unknown set {word!r}; sets are defined before they are used")
    return out


def _sides(k: Keyword, part: _Part) -> list[tuple[int, ...]]:
    """Ends of the sides of a surface: element (or set), then side S1 … S4 or nothing for all (the free ones count)."""
    out: list[tuple[int, ...]] = []
    for line, words in k.data:
        who, side = words[0], (words[1].upper() if len(words) > 1 else "")
        labels = [int(who)] if who.isdigit() else part.element_sets.get(who.upper())
        if labels is None:
            raise FileError.at(line, f"unknown element set {who!r} in the surface")
        for label in labels:
            cell = part.cells.get(label)
            if cell is None:
                continue
            corners = 3 if len(cell) in (3, 6) else 4
            if side and not (side[0] in "SE" and side[1:].isdigit() and 1 <= int(side[1:]) <= corners):
                raise FileError.at(line, f"{side!r} is no side of element {label}; write S1 … S{corners}")
            which = [int(side[1:]) - 1] if side else range(corners)
            out += [(cell[i], cell[(i + 1) % corners]) for i in which]
    return out


def _join(deck: Deck, name: str, part: _Part, several: bool) -> None:
    """Put a part into the deck, its labels made different from those of other parts."""
    shift = part.offset

    def moved(labels: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(n + shift for n in labels)

    dx, dy, dz = part.moved
    deck.nodes |= {n + shift: (x + dx, y + dy, z + dz) for n, (x, y, z) in part.nodes.items()}
    deck.cells |= {e + shift: moved(c) for e, c in part.cells.items()}
    if name and part.cells:
        deck.parts[part.spelling[name]] = [e + shift for e in part.cells]
        deck.exclusive = several
    for key, labels in part.element_sets.items():
        cells = [e + shift for e in labels if e in part.cells]
        if cells:
            deck.parts.setdefault(part.spelling[key], []).extend(cells)
        lines = [moved(part.lines[e]) for e in labels if e in part.lines]
        if lines:
            deck.lines.setdefault(part.spelling[key], []).extend(lines)
    for key, labels in part.node_sets.items():
        deck.points.setdefault(part.spelling[key], []).extend(n + shift for n in labels)
    for key, sides in part.surfaces.items():
        deck.lines.setdefault(part.spelling[key], []).extend(moved(s) for s in sides)
