"""Reader of gmsh's ``.msh`` files, text, versions 2.2 and 4.1, with physical groups and numbers of the geometry.

Format: C. Geuzaine & J.-F. Remacle, Gmsh reference manual, chapter "Gmsh file formats".
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from prensa.importers.deck import Deck, FileError
from prensa.importers.solids import OF_GMSH

LINES, CELLS = {1: 2, 8: 3}, {2: 3, 3: 4, 9: 6, 16: 8, 10: 8}  # nodes kept, by element type (the middle of a Q9 is not)
POINT, Q9 = 15, 10
# gmsh quotes names, other writers of the format do not.
_NAME = re.compile(r"""(\d{1,9}) (\d{1,18}) (?:"([^"]*)"|'([^']*)'|([^"'\s]+))""")
NODES = {1: 2, 8: 3, 2: 3, 3: 4, 9: 6, 16: 8, 10: 9, 15: 1}


class _Element(NamedTuple):
    """``label``, ``kind`` of gmsh, ``nodes``, physical ``groups``, and the ``entity`` of the geometry (0: not stated)."""

    label: int
    kind: int
    nodes: list[int]
    groups: list[int]
    entity: int


class _Lines:
    """The lines of a section, with their numbers, as they are consumed."""

    def __init__(self, lines: list[str], first: int, name: str) -> None:
        self.lines, self.at, self.first, self.name = lines, 0, first, name

    def __len__(self) -> int:
        return len(self.lines) - self.at

    @property
    def number(self) -> int:
        """Number in the file of the line consumed last."""
        return self.first + self.at - 1

    def next(self) -> list[str]:
        """Words of the next line."""
        if not len(self):
            raise FileError.at(self.first + self.at, f"the section ${self.name} ends too early; the file is cut off")
        self.at += 1
        return self.lines[self.at - 1].split()

    def integers(self, least: int) -> list[int]:
        """The next line as whole numbers, at least so many."""
        words = self.next()
        try:
            numbers = [int(w) for w in words]
        except ValueError:
            numbers = []
        if len(numbers) < least:
            raise FileError.at(self.number, f"{' '.join(words)[:60]!r} is not {least} whole numbers (in ${self.name})")
        return numbers

    def count(self, n: int) -> range:
        """Range of a count that the file announces: never more than it has lines."""
        if not 0 <= n <= len(self):
            raise FileError.at(self.number, f"{n} entries are announced in ${self.name}, {len(self)} lines are left")
        return range(n)

    def place(self, words: list[str]) -> tuple[float, float, float]:
        """Three coordinates."""
        try:
            x, y, z = (float(w) for w in words[:3])
        except ValueError:
            raise FileError.at(self.number, f"{' '.join(words)[:60]!r} is not three coordinates") from None
        return x, y, z


def read(text: str, solid: bool = False) -> Deck:
    """Contents of a ``.msh`` file; ``solid``: of bodies in space.

    Raises
    ------
    FileError
        If it is binary, of another version, cut off, contradicts itself, or has three-dimensional elements and is to be plane.

    """
    sections = dict(_sections(text))
    if "MeshFormat" not in sections:
        raise FileError.at(1, "there is no $MeshFormat; this is not a gmsh mesh (save it with the extension .msh)")
    version, binary = (*sections["MeshFormat"].next(), "", "")[:2]
    if binary != "0":
        raise FileError.at(2, "the file is binary; save it as text ('Mesh.Binary = 0;' in gmsh)")
    if version not in ("2.2", "4.1"):
        raise FileError.at(2, f"format {version}; save it as version 4.1 or 2.2 ('Mesh.MshFileVersion = 4.1;' in gmsh)")
    for name in ("Nodes", "Elements"):
        if name not in sections:
            raise FileError(f"there is no section ${name}; the file is cut off or holds no mesh")
    names = _physical_names(sections["PhysicalNames"]) if "PhysicalNames" in sections else {}
    deck = Deck(exclusive=True, source=f"physical {'surfaces' if solid else 'curves'} and points")
    if version == "2.2":
        _nodes_2(sections["Nodes"], deck)
        _elements_2(sections["Elements"], deck, names)
    else:
        groups = _entities(sections["Entities"]) if "Entities" in sections else {}
        _nodes_4(sections["Nodes"], deck)
        _elements_4(sections["Elements"], deck, names, groups)
    if deck.solids and not solid:
        label, (kind, _) = next(iter(deck.solids.items()))
        raise FileError(
            f"{deck.element(label)} is of gmsh's type {kind.gmsh}; a three-dimensional mesh is not a section: save the surfaces "
            "only, or compute it in 'space: solid'"
        )
    return deck


def _sections(text: str) -> Iterator[tuple[str, _Lines]]:
    lines = text.splitlines()
    name, first = "", 0
    for k, line in enumerate(lines):
        word = line.strip()
        if not word.startswith("$"):
            continue
        if not name:
            name, first = word[1:], k + 1
        elif word == f"$End{name}":
            yield name, _Lines(lines[first:k], first + 1, name)
            name = ""
    if name in ("MeshFormat", "PhysicalNames", "Entities", "Nodes", "Elements"):
        raise FileError.at(first, f"${name} is not closed by $End{name}; the file is cut off")


def _physical_names(lines: _Lines) -> dict[tuple[int, int], str]:
    out = {}
    for _ in lines.count(lines.integers(1)[0]):
        words = " ".join(lines.next())
        match = _NAME.fullmatch(words)
        if match is None:
            raise FileError.at(lines.number, f'{words[:60]!r} is not: dimension tag "name"')
        out[int(match[1]), int(match[2])] = match[3] or match[4] or match[5] or ""
    return out


def _entities(lines: _Lines) -> dict[tuple[int, int], list[int]]:
    """Physical tags by dimension and entity."""
    out = {}
    for dimension, count in enumerate(lines.integers(4)[:4]):
        # Points have a tag and three coordinates before their groups, the others a tag and a bounding box of six numbers.
        skip = 4 if dimension == 0 else 7
        for _ in lines.count(count):
            words = lines.next()
            try:
                tags = [int(w) for w in words[skip + 1 : skip + 1 + int(words[skip])]]
                out[dimension, int(words[0])] = tags
            except (ValueError, IndexError):
                raise FileError.at(lines.number, f"{' '.join(words)[:60]!r} is no entity") from None
    return out


def _nodes_2(lines: _Lines, deck: Deck) -> None:
    for _ in lines.count(lines.integers(1)[0]):
        words = lines.next()
        try:
            label = int(words[0])
        except (ValueError, IndexError):
            raise FileError.at(lines.number, f"{' '.join(words)[:60]!r} is not: label x y z") from None
        deck.nodes[label] = lines.place(words[1:])


def _nodes_4(lines: _Lines, deck: Deck) -> None:
    for _ in lines.count(lines.integers(4)[0]):
        # A block of format 4.1 has all labels first, then all places: two lines a node.
        count = lines.count(2 * lines.integers(4)[3]).stop // 2
        labels = [lines.integers(1)[0] for _ in range(count)]
        for label in labels:
            deck.nodes[label] = lines.place(lines.next())


def _elements_2(lines: _Lines, deck: Deck, names: dict[tuple[int, int], str]) -> None:
    for _ in lines.count(lines.integers(1)[0]):
        label, kind, tags, *rest = lines.integers(4)
        if not 0 <= tags <= len(rest):
            raise FileError.at(lines.number, f"an element of {tags} tags has {len(rest)} numbers")
        # The first tag of format 2.2 is the physical group, 0 for none; the second is the geometric entity.
        groups = [rest[0]] if tags and rest[0] else []
        entity = rest[1] if tags > 1 else 0
        _add(lines, deck, names, _Element(label, kind, rest[tags:], groups, entity))


def _elements_4(
    lines: _Lines, deck: Deck, names: dict[tuple[int, int], str], groups: dict[tuple[int, int], list[int]]
) -> None:
    for _ in lines.count(lines.integers(4)[0]):
        dimension, entity, kind, count = lines.integers(4)[:4]
        for _ in lines.count(count):
            label, *nodes = lines.integers(2)
            _add(lines, deck, names, _Element(label, kind, nodes, groups.get((dimension, entity), []), entity))


def _add(lines: _Lines, deck: Deck, names: dict[tuple[int, int], str], element: _Element) -> None:
    """One element into the cells, or into the lines or points of its groups; a group without a name is its number."""
    label, kind, nodes, groups, entity = element
    known = OF_GMSH.get(kind)
    if known is not None and len(nodes) == known.nodes:
        ordered = tuple(nodes[i] for i in known.of_gmsh) or tuple(nodes)
        deck.solids[label], deck.solid_lines[label] = (known, ordered), lines.number
        if entity > 0:
            deck.volume_numbers.setdefault(f"volume-{entity}", []).append(label)
        for tag in groups:
            deck.volumes.setdefault(names.get((3, tag), str(tag)), []).append(label)
        return
    if kind not in NODES:
        raise FileError.at(
            lines.number,
            f"element {label} is of gmsh's type {kind} with {len(nodes)} nodes; known are points, lines, triangles and "
            "quadrilaterals up to the second order, hexahedra and wedges of the first, and tetrahedra of the second",
        )
    if len(nodes) != NODES[kind]:
        raise FileError.at(lines.number, f"element {label} has {len(nodes)} nodes; type {kind} has {NODES[kind]}")
    dimension = 0 if kind == POINT else 1 if kind in LINES else 2
    if dimension == 2:
        deck.cells[label] = tuple(nodes[: CELLS[kind]])
    if entity > 0 and dimension == 2:
        deck.surfaces.setdefault(f"surface-{entity}", []).append(label)
    elif entity > 0 and dimension == 1:
        deck.curves.setdefault(f"curve-{entity}", []).append(tuple(nodes))
    elif entity > 0:
        deck.vertices.setdefault(f"point-{entity}", []).append(nodes[0])
    for tag in groups:
        # Tags are counted for each dimension: a line group 1 and a surface group 1 are two groups.
        name = names.get((dimension, tag), str(tag))
        if dimension == 2:
            deck.parts.setdefault(name, []).append(label)
        elif dimension == 1:
            deck.lines.setdefault(name, []).append(tuple(nodes))
        else:
            deck.points.setdefault(name, []).append(nodes[0])
