"""Reader of Abaqus (and CalculiX) ``.inp`` decks: nodes, elements, node and element sets, surfaces, parts and instances.

Keywords: Abaqus keywords reference. What does not concern the mesh is passed over; what would generate nodes or elements
is refused, because the mesh would be incomplete without it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

from prensa.importers.abaqus_keywords import Keyword, Scope, keywords
from prensa.importers.abaqus_places import Places, Side, sides_of
from prensa.importers.abaqus_words import GENERATING, KNOWN, nearest, refuse_unknown_parameters
from prensa.importers.deck import LABELS, Deck, FileError, is_label
from prensa.importers.solids import MIDDLES, OF_ABAQUS, SolidKind
from prensa.model.names import nearest as nearest_of

# Membranes, shells and rigid surfaces are cells of a plane mesh too: converters write flat triangles as S3, M3D3 or R3D3.
_CELL = re.compile(r"(?:CPEG|CPE|CPS|CGAX|CAX|AC2D|ACAX|DC2D|DCAX|M3D|SFM3D|R3D|STRI|S)([3468])")
_SOLID = re.compile(r"C3D(\d+)(?!\d)")
_LINE = re.compile(r"(?:T2D|T3D|R2D|RAX|SAX|B2|B3|DC1D)([123])")
_MESH = ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE")


class Assembly:
    """A deck with its parts placed: each instance is a `Scope`, the assembly (or a deck without parts) is ``top``.

    ``order``: the keywords, those of parts once for each instance, with the scope in which they stand. Nodes, cells, kinds
    of cells and line elements by label of the whole deck. ``solid``: of bodies in space, whose elements are ``solids``.

    Raises
    ------
    FileError
        If the deck generates nodes or elements, has three-dimensional elements and is to be plane, or contradicts itself.

    """

    def __init__(self, text: str, solid: bool = False, origins: Sequence[int] | None = None) -> None:
        self.solid = solid
        self.solids: dict[int, tuple[SolidKind, tuple[int, ...]]] = {}
        self.solid_lines: dict[int, int] = {}
        self.top = Scope()
        self.instances: dict[str, Scope] = {}
        self.order: list[tuple[Keyword, Scope]] = []
        self.nodes: dict[int, tuple[float, float, float]] = {}
        self.cells: dict[int, tuple[int, ...]] = {}
        self.kinds: dict[int, str] = {}
        self.lines: dict[int, tuple[int, ...]] = {}
        parts: dict[str, tuple[str, list[Keyword]]] = {}
        part: list[Keyword] | None = None
        here = self.top
        for k in keywords(text, origins):
            if k.name in ("PART", "INSTANCE"):
                refuse_unknown_parameters(k.name, k.parameters, k.line)
            if k.name == "PART":
                part = []
                parts[k.parameters.get("NAME", "").upper()] = (k.parameters.get("NAME", ""), part)
            elif k.name in ("END PART", "ASSEMBLY"):
                part = None
            elif k.name == "INSTANCE":
                part, here = None, self._instance(k, parts)
            elif k.name == "END INSTANCE":
                here = self.top
            elif part is not None:
                part.append(k)
            else:
                self._take(k, here)
        # Parts without an assembly are placed once each where they were drawn.
        if parts and not self.instances:
            for name, (spelled, _) in parts.items():
                self._instance(Keyword("INSTANCE", {"NAME": spelled, "PART": name}, 0), parts)
        # Last, since an instance may have nodes of its own behind those of its part.
        for scope in self.instances.values():
            for n in scope.nodes:
                x, y, z = self.nodes[n]
                self.nodes[n] = scope.moved_in_space(x, y, z) if solid else (*scope.moved(x, y), z)

    def _instance(self, k: Keyword, parts: dict[str, tuple[str, list[Keyword]]]) -> Scope:
        wanted, name = k.parameters.get("PART", ""), k.parameters.get("NAME", "")
        if wanted.upper() not in parts:
            raise FileError.at(k.line, f"there is no part {wanted!r}")
        if name.upper() in self.instances:
            raise FileError.at(k.line, f"there are two instances {name!r}")
        spelled, content = parts[wanted.upper()]
        # Every instance counts its nodes from 1: an offset of its own keeps labels of instances apart.
        scope = Scope(name, spelled, LABELS * (len(self.instances) + 1), k.line, list(k.data))
        self.instances[name.upper()] = scope
        for inside in content:
            self._take(inside, scope)
        return scope

    def _take(self, k: Keyword, scope: Scope) -> None:
        if k.name in GENERATING or "INPUT" in k.parameters:
            if k.name not in GENERATING or k.name == "INCLUDE":
                what = "*INCLUDE" if k.name == "INCLUDE" else "INPUT of another file"
                raise FileError.at(k.line, f"{what} is not read in meshes; name the file with the mesh instead, or convert the "
                                   "whole deck: prensa import … --out …")  # fmt: skip
            raise FileError.at(k.line, f"*{k.name} is not read; write the nodes and elements themselves into the file")
        if k.name not in KNOWN and (near := nearest(k.name, GENERATING.union(_MESH))):
            raise FileError.at(k.line, f"*{k.name} is not a keyword; did you mean *{near}?")
        self.order.append((k, scope))
        if k.name in _MESH:
            self._into(k, scope)

    # -------------------------------------------------------------------------------------------------------- content
    def _into(self, k: Keyword, scope: Scope) -> None:
        first = {"NSET": "NSET", "SURFACE": "NAME", "NODE": "NSET"}.get(k.name, "ELSET")
        name = k.parameters.get(first, "")
        key = name.upper()
        scope.spelling.setdefault(key, name)
        if k.name == "NODE":
            self._nodes(k, scope, key)
        elif k.name == "ELEMENT":
            self._elements(k, scope, key)
        elif k.name in ("NSET", "ELSET"):
            sets = scope.node_sets if k.name == "NSET" else scope.element_sets
            if not name:
                raise FileError.at(k.line, f"*{k.name} without a name")
            found = self._members(k, k.name == "NSET", scope)
            if k.name == "NSET" and "ELSET" in k.parameters:
                of = self.elements_of(k.line, k.parameters["ELSET"], scope)
                found += sorted({n for e in of for n in self._nodes_of(e)})
            sets.setdefault(key, []).extend(found)
        elif k.parameters.get("TYPE", "ELEMENT").upper() == "NODE":
            nodes = replace(k, lines=[(line, text.partition(",")[0]) for line, text in k.lines])
            scope.node_sets.setdefault(key, []).extend(self._members(nodes, True, scope))
        elif k.parameters.get("TYPE", "ELEMENT").upper() == "ELEMENT":  # the others are rigid, without elements
            if "COMBINE" in k.parameters or "CROP" in k.parameters:
                raise FileError.at(k.line, "surfaces made of others (COMBINE, CROP) are not read; list the sides of elements")
            scope.surfaces.setdefault(key, []).extend(self._sides(k, scope))

    @cached_property
    def own(self) -> dict[int, tuple[int, ...]]:
        """Nodes of the elements that bodies are made of, by label: plane ones, in space bricks and tetrahedra."""
        return {label: nodes for label, (_, nodes) in self.solids.items()} if self.solid else self.cells

    def own_of(self, scope: Scope) -> list[int]:
        """Labels of these elements in a scope."""
        return scope.solids if self.solid else scope.cells

    def sides_of(self, label: int) -> list[Side]:
        """Sides of an element in the order of its numbers: see `Side`; of a shell in space itself."""
        if label not in self.solids:
            return [self.cells[label]] if self.solid else sides_of(self.cells[label])
        kind, nodes = self.solids[label]
        sides = []
        for corners in kind.sides:
            pairs = zip(corners, (*corners[1:], corners[0])) if kind.nodes == 10 else ()
            sides.append(tuple(nodes[i] for i in (*corners, *(MIDDLES[frozenset(p)] for p in pairs))))
        return sides

    def _nodes_of(self, label: int) -> tuple[int, ...]:
        """Nodes of an element of any kind."""
        return self.solids[label][1] if label in self.solids else self.cells.get(label) or self.lines.get(label, ())

    def _nodes(self, k: Keyword, scope: Scope, key: str) -> None:
        if k.parameters.get("SYSTEM", "R").upper() != "R":
            raise FileError.at(k.line, "coordinates of another system than the rectangular one are not read; write x, y, z")
        for line, words in k.data:
            try:
                label = int(words[0]) + scope.offset
            except ValueError:
                raise FileError.at(line, f"{', '.join(words)[:60]!r} is not: label, x, y") from None
            place = _place(line, words[1:])
            if label not in self.nodes:
                scope.nodes.append(label)
            elif self.nodes[label] != place:
                raise FileError.at(line, f"node {words[0]} stands before at another place; keep one, or number it anew")
            self.nodes[label] = place
            if key:
                scope.node_sets.setdefault(key, []).append(label)

    def _elements(self, k: Keyword, scope: Scope, set_name: str) -> None:
        kind = k.parameters.get("TYPE", "").upper()
        if self.solid and (body := _SOLID.match(kind)) and (known := OF_ABAQUS.get(body[1])):
            rows = list(self._rows(k, kind, known.nodes, scope, set_name))
            self.solids |= {label: (known, nodes) for label, nodes in rows}
            self.kinds |= dict.fromkeys((label for label, _ in rows), kind)
            scope.solids += (label for label, _ in rows)
            if len(rows) == len(k.lines):  # an element a line
                self.solid_lines |= {label: line for (label, _), (line, _) in zip(rows, k.lines)}
            return
        cell, line = _CELL.match(kind), _LINE.match(kind)
        if kind.startswith(("C3D", "SC", "CSS", "COH3")) or not (cell or line):
            # They are no part of the mesh; where they would change the answer, their own keyword (*SPRING, …) is refused.
            if kind.startswith(("MASS", "SPRING", "DASHPOT", "CONN", "ROTARY", "DCOUP")):
                return
            raise FileError.at(
                k.line,
                f"element type {kind or 'missing'!r} is "
                + ("no brick, wedge or tetrahedron (C3D8, C3D6, C3D10), and no rigid shell" if self.solid else
                   "no plane element of 3, 4, 6 or 8 nodes (a section is meshed in x, y)"),
            )
        if cell:
            count = int(cell[1])
        else:
            assert line is not None
            # The digit of shells of revolution and beams is the order of their interpolation, that of trusses the number of
            # nodes. Cubic beams (B23, B33) have no node in the middle.
            count = int(line[1])
            if kind.startswith(("SAX", "B2", "B3")):
                count = 3 if count == 2 else 2
        for label, nodes in self._rows(k, kind, count, scope, set_name):
            if cell:
                self.cells[label], self.kinds[label] = nodes, kind
                scope.cells.append(label)
            else:
                self.lines[label] = nodes

    def _rows(
        self, k: Keyword, kind: str, count: int, scope: Scope, set_name: str
    ) -> Iterator[tuple[int, tuple[int, ...]]]:
        """Labels and nodes of the elements of a keyword, which are put into their set."""
        for line, numbers in k.numbered(count + 1):
            if len(numbers) != count + 1:
                row = ", ".join(map(str, numbers))[:60]
                raise FileError.at(
                    line, f"elements {kind} have {count} nodes; {len(numbers)} numbers are not rows of {count + 1}: {row!r}"
                )
            label, *nodes = (n + scope.offset for n in numbers)
            if self._nodes_of(label) not in ((), tuple(nodes)):
                raise FileError.at(line, f"element {numbers[0]} stands before with other nodes; keep one, or number it anew")
            yield label, tuple(nodes)
            if set_name:
                scope.element_sets.setdefault(set_name, []).append(label)

    def _members(self, k: Keyword, of_nodes: bool, scope: Scope) -> list[int]:
        """Labels of a set: listed, generated (first, last, step), or those of sets named in it."""
        owner = self._named_instance(k.line, k.parameters.get("INSTANCE", ""), scope)
        out: list[int] = []
        # A slip in first, last or step would otherwise make a list of billions of labels.
        limit = 10 * (len(self.nodes) + len(self.cells) + len(self.lines) + len(self.solids)) + 10
        for line, words in k.data:
            if "GENERATE" in k.parameters:
                try:
                    first, last, step = (*(int(w) for w in words), 1)[:3]
                except ValueError:
                    raise FileError.at(line, f"{', '.join(words)[:60]!r} is not: first, last, step") from None
                if step < 1 or last < first or (last - first) // step > limit:
                    raise FileError.at(line, f"{first}, {last}, {step} generates no set of this mesh")
                out += range(first + owner.offset, last + 1 + owner.offset, step)
                continue
            for word in words:
                if is_label(word.removeprefix("+")):
                    out.append(int(word) + owner.offset)
                elif word:
                    where, name = self._seen_from(line, word, scope)
                    sets = where.node_sets if of_nodes else where.element_sets
                    if name in sets:
                        out += sets[name]
                    elif is_label(name):
                        out.append(int(name) + where.offset)
                    else:
                        raise FileError.at(line, f"unknown set {word[:60]!r}; sets are defined before they are used")
        return out

    def _sides(self, k: Keyword, scope: Scope) -> list[tuple[int, ...]]:
        """Ends of the sides of a surface: element (or set), then side S1 … S4 or nothing for all (the free ones count)."""
        out: list[tuple[int, ...]] = []
        for line, words in k.data:
            who, side = words[0], (words[1].upper() if len(words) > 1 else "")
            for label in self.elements_of(line, who, scope):
                if label in self.lines:
                    out.append(self.lines[label][:2])  # of a rigid tool, both sides of which are its surface
                if label in self.solids:
                    out += self._sides_in_space(line, label, side)
                cell = self.cells.get(label)
                if cell is None:
                    continue
                if self.solid:  # of a shell, either side of which is its face
                    out.append(cell)
                    continue
                corners = 3 if len(cell) in (3, 6) else 4
                if side and not (side[0] in "SE" and is_label(side[1:]) and 1 <= int(side[1:]) <= corners):
                    raise FileError.at(line, f"{side[:60]!r} is not a side of element {label % LABELS}; write S1 … S{corners}")
                which = [int(side[1:]) - 1] if side else range(corners)
                out += [(cell[i], cell[(i + 1) % corners]) for i in which]
        return out

    def _sides_in_space(self, line: int, label: int, side: str) -> list[tuple[int, ...]]:
        """Corners of side S1 … S6 of an element, or of all its sides."""
        kind, nodes = self.solids[label]
        last = len(kind.sides)
        if side and not (side[0] == "S" and is_label(side[1:]) and 1 <= int(side[1:]) <= last) and last:
            raise FileError.at(line, f"{side[:60]!r} is not a side of element {label % LABELS}; write S1 … S{last}")
        which = kind.sides[int(side[1:]) - 1 : int(side[1:])] if side and last else kind.sides
        return [tuple(nodes[i] for i in corners) for corners in which]

    # ---------------------------------------------------------------------------------------------------------- names
    def _named_instance(self, line: int, name: str, scope: Scope) -> Scope:
        if name and name.upper() not in self.instances:
            raise FileError.at(line, f"there is no instance {name!r} before this line")
        return self.instances[name.upper()] if name else scope

    def _seen_from(self, line: int, who: str, scope: Scope) -> tuple[Scope, str]:
        """Scope and name in capitals of ``instance.name`` or ``name``; a name may have a point in it."""
        whole = who.strip('"').upper()
        if whole in scope.node_sets or whole in scope.element_sets or whole in scope.surfaces:
            return scope, whole
        instance, dot, name = who.rpartition(".")
        return (self._named_instance(line, instance.strip('"'), scope) if dot else scope), name.strip('"').upper()

    def elements_of(self, line: int, who: str, scope: Scope) -> list[int]:
        """Labels of an element set, or of one element, as named from a scope.

        Raises
        ------
        FileError
            If there is no such set.

        """
        where, name = self._seen_from(line, who, scope)
        if name in where.element_sets:
            return where.element_sets[name]
        if is_label(name):
            return [int(name) + where.offset]
        near = nearest_of(name, [where.spelling[k] for k in where.element_sets])
        hint = f"did you mean {near!r}?" if near else "sets are defined before they are used"
        raise FileError.at(line, f"unknown element set {who[:60]!r}; {hint}")

    def seen_from(self, line: int, who: str, scope: Scope) -> tuple[Scope, str]:
        """Where a name leads: the scope that defines it, and the name in capitals; the assembly's sets count everywhere.

        Raises
        ------
        FileError
            If it names an instance that does not exist.

        """
        where, name = self._seen_from(line, who, scope)
        known = name in where.node_sets or name in where.surfaces or name in where.element_sets
        return (where, name) if known or "." in who else (self.top, name)

    def deck(self) -> Deck:
        """Everything in the names by which a case calls it.

        A set or surface has the name that the file gives; of two of one name the assembly's has it, and that of an instance is
        called ``instance.name``. Instances of one name each are joined: a body takes what lies on it.

        Raises
        ------
        FileError
            If there is no plane element.

        """
        deck = Deck(nodes=self.nodes, cells=self.cells, kinds=self.kinds, solids=self.solids, solid_lines=self.solid_lines)
        if not (deck.solids if self.solid else deck.cells):
            raise FileError(f"the deck has no {'bricks (C3D8, …)' if self.solid else 'plane elements (CPE4, CPS4, CAX4, …)'}")
        parts = deck.volumes if self.solid else deck.parts
        bodies = [(s, own) for s in self.instances.values() if (own := s.solids if self.solid else s.cells)]
        deck.exclusive = len(bodies) > 1
        for s, own in bodies:
            parts.setdefault(s.part, []).extend(own)
        for s, own in bodies:
            if sum(other.part == s.part for other, _ in bodies) > 1:
                parts.setdefault(s.name, list(own))
        taken = dict(parts)
        for scope in (self.top, *self.instances.values()):
            self._name(deck, scope, taken)
        self.places = Places(self, deck)
        return deck

    def _name(self, deck: Deck, scope: Scope, taken: dict[str, list[int]]) -> None:
        """Put the sets and surfaces of a scope into the deck."""
        top = self.top if scope is not self.top else Scope()
        for key, labels in scope.element_sets.items():
            own = self.solids if self.solid else self.cells
            cells = [e for e in labels if e in own]
            if self.solid and (shells := [self.cells[e] for e in labels if e in self.cells]):
                deck.lines.setdefault(scope.spelling[key], []).extend(shells)
            lines = [self.lines[e] for e in labels if e in self.lines]
            spelled = scope.spelling[key]
            if cells:
                # Sets of the same name in two instances are two sets; the plain name goes to the first or to the assembly.
                clash = key in top.element_sets or (spelled in taken and set(taken[spelled]) != set(cells))
                name = scope.part_of[key] = f"{scope.name or 'assembly'}.{spelled}" if clash else spelled
                if clash or spelled not in taken:
                    (deck.volumes if self.solid else deck.parts).setdefault(name, []).extend(cells)
            if lines:
                deck.lines.setdefault(spelled, []).extend(lines)
        above = {*top.node_sets, *top.surfaces}
        for key in dict.fromkeys((*scope.node_sets, *scope.surfaces)):
            spelled = scope.spelling[key]
            name = scope.boundary_of[key] = f"{scope.name}.{spelled}" if key in above else spelled
            if key in scope.surfaces:
                deck.lines.setdefault(name, []).extend(scope.surfaces[key])
            if key in scope.node_sets:
                deck.points.setdefault(name, []).extend(scope.node_sets[key])


def read(text: str, solid: bool = False) -> Deck:
    """Contents of a deck; ``solid``: of bodies in space.

    Raises
    ------
    FileError
        If it generates nodes or elements, has three-dimensional elements and is to be plane, or contradicts itself.

    """
    return Assembly(text, solid).deck()


def _place(line: int, words: list[str]) -> tuple[float, float, float]:
    try:
        x = [float(w.upper().replace("D", "E")) if w else 0.0 for w in words[:3]]
    except ValueError:
        raise FileError.at(line, f"{', '.join(words)[:60]!r} is not coordinates") from None
    x += [0.0] * (3 - len(x))
    return x[0], x[1], x[2]
