"""Names for what a deck calls by number: single nodes, groups of nodes in supports and forces, sides of elements under pressure.

A case knows boundaries and points of a mesh by name. The mesh reader and the reader of cases both go through this file, so that
they give the same names.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from typing import Protocol

from prensa.importers.abaqus_keywords import Keyword, Scope
from prensa.importers.deck import LABELS, Deck, FileError, is_label

Side = tuple[int, ...]
"""Both ends, and the node between them if there is one; in space the corners, and the nodes between them if there are some."""


class Content(Protocol):
    """What is known of a deck: see `prensa.importers.abaqus.Assembly`."""

    top: Scope
    instances: dict[str, Scope]
    order: list[tuple[Keyword, Scope]]
    nodes: dict[int, tuple[float, float, float]]
    cells: dict[int, tuple[int, ...]]
    solid: bool

    @property
    def own(self) -> dict[int, tuple[int, ...]]:
        """Nodes of the elements of bodies, by label."""
        ...

    def sides_of(self, label: int) -> list[Side]:
        """Sides of an element in the order of its numbers."""
        ...

    def seen_from(self, line: int, who: str, scope: Scope) -> tuple[Scope, str]:
        """Where a name leads: the scope that defines it, and the name in capitals."""
        ...

    def elements_of(self, line: int, who: str, scope: Scope) -> list[int]:
        """Labels of an element set, or of one element, as named from a scope."""
        ...


def sides_of(cell: tuple[int, ...]) -> list[Side]:
    """Sides of an element in the order of the file's numbers: ends, and the node between them of a quadratic element."""
    count = 3 if len(cell) in (3, 6) else 4
    ends = list(pairwise((*cell[:count], cell[0])))
    return [(*e, cell[count + i]) for i, e in enumerate(ends)] if len(cell) > count else list(ends)


def ends(side: Side, solid: bool) -> Side:
    """Ends of a side, in space its corners."""
    return side[:2] if not solid else side[:3] if len(side) == 6 else side


def outline(sides: Iterable[Side], solid: bool = False) -> list[Side]:
    """Sides that belong to one element only, of those of all elements."""
    count: dict[frozenset[int], int] = {}
    found: dict[frozenset[int], Side] = {}
    for side in sides:
        key = frozenset(ends(side, solid))
        count[key], found[key] = count.get(key, 0) + 1, side
    return [found[key] for key, n in count.items() if n == 1]


@dataclass
class Places:
    """Names that are given to nodes and sides of a deck, by what they hold: the same nodes have the same name in all steps."""

    all: Content
    deck: Deck
    groups: dict[frozenset[int], str] = field(default_factory=dict)
    faces: dict[frozenset[frozenset[int]], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        cells = self.all.own if self.all.solid else self.all.cells
        self.of_cells = {n for cell in cells.values() for n in cell}
        self.sides_at: dict[int, list[Side]] = {}
        for label in cells:
            for side in self.all.sides_of(label):
                self.sides_at.setdefault(side[0], []).append(side)
        for scope in (self.all.top, *self.all.instances.values()):
            for key, nodes in scope.node_sets.items():
                if group := frozenset(nodes) & self.of_cells:
                    self.groups.setdefault(group, scope.boundary_of[key])
        for k, scope in self.all.order:
            for who in self._groups_of(k, scope):
                self._group(k, scope, who)
            if k.name == "DLOAD":
                for rows in faces_alike(k):
                    self._faces(scope, rows)
        self._shared()

    def _shared(self) -> None:
        """Name the nodes that sections of several materials in one mesh have in common."""
        of = [
            {n for e in self.all.elements_of(k.line, k.parameters.get("ELSET", ""), scope) for n in self.all.own.get(e, ())}
            for k, scope in self.all.order
            if k.name == "SOLID SECTION"
        ]
        for mine, others in combinations(of, 2):
            if common := frozenset(mine & others):
                self.groups.setdefault(common, f"shared-{len(self.groups)}")
                self.deck.points.setdefault(self.groups[common], sorted(common))

    def _groups_of(self, k: Keyword, scope: Scope) -> Iterator[list[str]]:
        """Names and numbers of the nodes that a keyword takes together."""
        if k.name == "BOUNDARY":
            yield from ([row[0] for _, row in rows] for rows in rows_alike(k, scope, self.all))
        elif k.name == "CLOAD":
            for dof in "123" if self.all.solid else "12":
                yield [row[0] for _, row in k.data if row[1:2] == [dof]]
        elif k.name == "EQUATION":
            yield from ([who] for _, terms in equations(k) for who, _, _ in terms)
        elif k.name == "KINEMATIC COUPLING":
            yield from ([row[0]] for _, row in k.data)
        elif k.name == "RIGID BODY":
            yield from ([k.parameters[p]] for p in ("TIE NSET", "PIN NSET", "NSET") if p in k.parameters)

    def name(self, nodes: frozenset[int]) -> str:
        """Name of a group of nodes of elements, or of one node."""
        return self.groups[nodes & self.of_cells]

    def nodes(self, who: str, scope: Scope, line: int) -> list[int]:
        """Labels of the nodes of a set or surface, or of one number; empty if it is none of them."""
        where, name = self.all.seen_from(line, who, scope)
        if name in where.node_sets or name in where.surfaces:
            return [*where.node_sets.get(name, ()), *(n for side in where.surfaces.get(name, ()) for n in side)]
        label = int(name) + where.offset if is_label(name) else 0
        return [label] if label in self.all.nodes else []

    def _group(self, k: Keyword, scope: Scope, who: list[str]) -> None:
        group = frozenset(n for w in who for n in self.nodes(w, scope, k.line)) & self.of_cells
        if not group:
            return
        if group not in self.groups:
            self.groups[group] = point(*group) if len(group) == 1 else f"nodes-of-line-{k.line:d}-{len(self.groups)}"
            self.deck.points[self.groups[group]] = sorted(group)
        # A node of the group that is on no side of it is a point: one that is alone, or the node in the middle of a side.
        on_sides = {n for a in group for side in self.sides_at.get(a, ()) if group.issuperset(side) for n in side}
        for n in group - on_sides:
            self.deck.points.setdefault(point(n), [n])

    def _faces(self, scope: Scope, rows: list[tuple[int, list[str]]]) -> None:
        sides = self.sides(scope, rows)
        key = frozenset(frozenset(ends(s, self.all.solid)) for s in sides)
        if key not in self.faces:
            self.faces[key] = f"sides-of-line-{rows[0][0]:d}"
            self.deck.lines[self.faces[key]] = sides

    def sides(self, scope: Scope, rows: list[tuple[int, list[str]]]) -> list[Side]:
        """Sides of the elements of rows of *DLOAD: element or set, P1 … P4, in space P1 … P6.

        Raises
        ------
        FileError
            If an element has no such side.

        """
        out: list[Side] = []
        for line, row in rows:
            number = int(row[1][1:])
            for label in self.all.elements_of(line, row[0], scope):
                own = self.all.sides_of(label) if label in self.all.own else []
                if number > len(own):
                    raise FileError.at(line, f"{row[1]!r} is not a side of element {label % LABELS}")
                out.append(own[number - 1])
        return out


def point(node: int) -> str:
    """Name of a single node; of an instance, whose nodes count from 1 again, with the number of that."""
    return f"node-{node}" if node < LABELS else f"node-{node // LABELS}-{node % LABELS}"


def equations(k: Keyword) -> Iterator[tuple[int, list[tuple[str, str, float]]]]:
    """Line and terms (set or node, degree of freedom, coefficient) of each equation of *EQUATION.

    Raises
    ------
    FileError
        If the number of terms is missing, or there are fewer.

    """
    words = [(line, w) for line, row in k.data for w in row if w]
    while words:
        line, count = words[0]
        if not is_label(count) or len(words) < 1 + 3 * int(count):
            raise FileError.at(line, "an equation is: number of terms, then for each node, degree of freedom, coefficient")
        terms, words = [w for _, w in words[1 : 1 + 3 * int(count)]], words[1 + 3 * int(count) :]
        yield line, [(who, dof, k.number([a], 0)) for who, dof, a in zip(terms[::3], terms[1::3], terms[2::3], strict=True)]


def rows_alike(k: Keyword, scope: Scope, all_: Content) -> list[list[tuple[int, list[str]]]]:
    """Rows of *BOUNDARY: those of single nodes by number with the same components and value together, others each alone."""
    out: dict[tuple[str, ...] | int, list[tuple[int, list[str]]]] = {}
    for line, row in k.data:
        where, name = all_.seen_from(line, row[0], scope)
        numbered = name not in where.node_sets and is_label(name)
        out.setdefault(tuple(row[1:]) if numbered else line, []).append((line, row))
    return list(out.values())


def faces_alike(k: Keyword) -> list[list[tuple[int, list[str]]]]:
    """Rows of *DLOAD that are pressures on sides of elements, those of one value together."""
    out: dict[tuple[str, ...], list[tuple[int, list[str]]]] = {}
    for line, row in k.data:
        if len(row) > 1 and is_face(row[1]):
            out.setdefault(tuple(row[2:]), []).append((line, row))
    return list(out.values())


def is_face(load: str) -> bool:
    """Whether a kind of *DLOAD is the pressure on a side, P1 … P6."""
    return load.upper() in ("P1", "P2", "P3", "P4", "P5", "P6")
