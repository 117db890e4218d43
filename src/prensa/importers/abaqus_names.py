"""What names and numbers of an Abaqus deck are in the case: bodies, tools, boundaries of bodies, what follows a node."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field, replace
from math import hypot

from prensa.importers.abaqus import Assembly
from prensa.importers.abaqus_keywords import Keyword, Scope
from prensa.importers.abaqus_places import Side, ends, equations, outline, point
from prensa.importers.abaqus_steps import Follower, still
from prensa.importers.abaqus_tools import RigidTool
from prensa.importers.deck import LABELS, Deck, FileError, is_label
from prensa.model.names import nearest
from prensa.precision import DRAWN


@dataclass
class Section:
    """Elements of one material: ``name`` as a body, ``cells`` its elements, once all rigid bodies are known.

    ``joined``: sections of the same material that have nodes in common with it, and make one body with it. ``nodes``: of its
    elements; ``free``: sides on the outline.
    """

    scope: Scope
    elset: str
    material: str
    line: int
    name: str = ""
    cells: frozenset[int] = frozenset()
    joined: list[Section] = field(default_factory=list)
    nodes: frozenset[int] = frozenset()
    free: list[Side] = field(default_factory=list)


@dataclass
class DeckNames:
    """Sections, rigid bodies and what follows prescribed nodes; see `prensa.importers.abaqus_steps.Names`.

    ``rigid``: elements of rigid bodies; ``turning``: nodes whose displacements are the rotation of a tool (``ROT NODE``).
    """

    all: Assembly
    deck: Deck
    sections: list[Section] = field(default_factory=list)
    tools: dict[tuple[str, str], RigidTool] = field(default_factory=dict)
    rigid: set[int] = field(default_factory=set)
    turning: dict[int, str] = field(default_factory=dict)
    following: dict[int, list[Follower]] = field(default_factory=dict)
    sorted: bool = False
    under: dict[frozenset[int], str] = field(default_factory=dict)  # side under pressure → its boundary

    # -------------------------------------------------------------------------------------------------------- nodes
    def node(self, line: int, who: str, scope: Scope) -> int:
        """The single node of a set or number.

        Raises
        ------
        FileError
            If there is none, or several.

        """
        where, name = self.all.seen_from(line, who, scope)
        members = where.node_sets.get(name)
        if members and len(members) == 1 and members[0] in self.all.nodes:
            return members[0]
        if is_label(name) and int(name) + where.offset in self.all.nodes:
            return int(name) + where.offset
        raise FileError.at(line, f"{who!r} is no single node" if who else "a reference node is missing; name it: REF NODE=…")

    def tools_at(self, line: int, who: str, scope: Scope) -> tuple[list[tuple[str, bool]], bool]:
        """Tools of the reference nodes of a set, each with whether it is their ``ROT NODE``; whether there are other nodes."""
        nodes = self.all.places.nodes(who, scope, line)
        of = {t.reference: (t.name, False) for t in self.tools.values()} | {n: (t, True) for n, t in self.turning.items()}
        return [of[n] for n in nodes if n in of], not nodes or any(n not in of for n in nodes)

    def in_body(self, line: int, who: str, scope: Scope) -> bool:
        """Whether a set has nodes of elements."""
        return not self.all.places.of_cells.isdisjoint(self.all.places.nodes(who, scope, line))

    def along(self, line: int, who: str, scope: Scope, way: tuple[float, ...]) -> bool:
        """Whether all sides of a surface are parallel to a direction."""
        where, name = self.all.seen_from(line, who, scope)
        at = self.all.nodes
        if self.all.solid:
            return self._faces_along([[at[n] for n in side] for side in where.surfaces.get(name, ())], way)
        pairs = [(at[a], at[b]) for a, b, *_ in where.surfaces.get(name, ())]
        crossed = [abs((q[0] - p[0]) * way[1] - (q[1] - p[1]) * way[0]) / hypot(q[0] - p[0], q[1] - p[1]) for p, q in pairs]
        return bool(crossed) and max(crossed) <= DRAWN * hypot(*way)

    @staticmethod
    def _faces_along(faces: list[list[tuple[float, float, float]]], way: tuple[float, ...]) -> bool:
        """Whether plane faces, by the places of their corners, are parallel to a direction."""
        for a, b, *_, d in faces:
            u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, d)]
            n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
            if abs(sum(p * q for p, q in zip(n, way))) > DRAWN * hypot(*n) * hypot(*way):
                return False
        return bool(faces)

    def boundary(self, line: int, who: str, scope: Scope) -> tuple[str, frozenset[int]]:
        """A set's or surface's name in the mesh, and its nodes.

        Raises
        ------
        FileError
            If it is neither.

        """
        where, name = self.all.seen_from(line, who, scope)
        known = where.boundary_of.get(name)
        if known is None:
            near = nearest(name, [where.spelling[k] for k in where.boundary_of])
            hint = f"did you mean {near!r}?" if near else "define it by *NSET or *SURFACE"
            raise FileError.at(line, f"{who!r} is not a set of nodes or surface of this deck; {hint}")
        nodes = {n for side in where.surfaces.get(name, []) for n in side}
        return known, frozenset(nodes or where.node_sets.get(name, []))

    def support(self, line: int, who: str, scope: Scope, rows: list[str]) -> list[str]:
        """'body.boundary' of every body that has nodes of a set, or of the nodes whose numbers are ``rows``.

        Raises
        ------
        FileError
            If the set lies inside of a body, where nothing can be held.

        """
        where, name = self.all.seen_from(line, who, scope)
        if name in where.boundary_of or not is_label(name):
            known, nodes = self.boundary(line, who, scope)
        else:
            nodes = frozenset(n for w in rows for n in self.all.places.nodes(w, scope, line))
            known = self.group(line, nodes)
        by_sides = bool(where.surfaces.get(name))
        found = [b for s in self.bodies() for b in self._of_body(line, who, s, known, nodes, by_sides)]
        if not found:
            if nodes & {n for e in self.rigid for n in self.all.cells.get(e) or self.all.own.get(e, ())}:
                raise FileError.at(line, f"{who!r} belongs to a rigid body: support or push its reference node")
            raise FileError.at(line, f"{who!r} belongs to none of the sections")
        return found

    def group(self, line: int, nodes: frozenset[int]) -> str:
        """Name in the mesh of a group of nodes.

        Raises
        ------
        FileError
            If there is no such node.

        """
        if not nodes & self.all.places.of_cells:
            raise FileError.at(line, "this number is not a node of the elements of this deck")
        if nodes & self.all.places.of_cells not in self.all.places.groups:
            raise FileError.at(line, "nodes of rigid bodies and other nodes are listed together; write a keyword for each")
        return self.all.places.name(nodes)

    def _of_body(self, line: int, who: str, s: Section, name: str, nodes: frozenset[int], by_sides: bool) -> list[str]:
        """Names by which one body has the nodes: that of the set where it has sides, and those of single nodes."""
        mine = s.nodes & nodes
        if not mine:
            return []
        if len(mine) == 1:
            return [f"{s.name}.{name}"]
        # A node set becomes a boundary by its sides: a node of which no side lies in the set would lose its support without a
        # word, unless it is a point by itself. A surface has its sides by their ends.
        sides = [side for side in s.free if mine.issuperset(ends(side, self.all.solid))]
        if not by_sides and (open_ := [n for side in sides for n in side if n not in mine]):
            raise FileError.at(
                line, f"node {open_[0] % LABELS} between two nodes of {who!r} is not in it: sides are held whole here"
            )  # fmt: skip
        alone = mine - {n for side in sides for n in side}
        if lost := sorted(n for n in alone if point(n) not in self.deck.points):
            raise FileError.at(
                line, f"node {lost[0] % LABELS} of {who!r} is on no side of {s.name!r} that lies in the set: "
                "supports and loads hold sides of the outline, or one node"
            )  # fmt: skip
        return [*([f"{s.name}.{name}"] if sides else []), *(f"{s.name}.{point(n)}" for n in sorted(alone))]

    # ------------------------------------------------------------------------------------------------------- bodies
    def bodies(self) -> list[Section]:
        """The sections that are not rigid, each with its name as a body and its cells; one that is alone has all of its part.

        Raises
        ------
        FileError
            If there is none, or one is rigid in part.

        """
        if not self.sections:
            raise FileError("the deck has no *SOLID SECTION, so the material of the elements is unknown")
        if not self.sorted:
            self.sorted = True
            for s in self.sections:
                self._sort(s)
            self.sections = self._together([s for s in self.sections if not s.cells or not s.cells <= self.rigid])
            names = Counter(s.name for s in self.sections)
            for s in self.sections:
                s.nodes = frozenset(n for e in s.cells for n in self.all.own[e])
                s.free = outline((side for e in s.cells for side in self.all.sides_of(e)), self.all.solid)
                if names[s.name] > 1:
                    s.name = f"{plain(s.scope.name)}_{s.name}"
            if not self.sections:
                raise FileError("all elements of the deck are rigid: there is no body")
        return self.sections

    def _together(self, sections: list[Section]) -> list[Section]:
        """Sections with those of the same material that share nodes with them made one."""
        out: list[Section] = []
        for s in sections:
            nodes = {n for e in s.cells for n in self.all.own[e]}
            alike = [
                o for o in out if o.material == s.material and any(nodes.intersection(self.all.own[e]) for e in o.cells)
            ]
            for o in alike[1:]:
                out.remove(o)
            if alike:
                first, more = alike[0], [*alike[1:], s]
                first.joined += [j for o in more for j in (replace(o, joined=[]), *o.joined)]
                first.cells = first.cells.union(*(o.cells for o in more))
            else:
                out.append(s)
        return out

    def _sort(self, s: Section) -> None:
        own = self.all.own_of(s.scope) or self.all.own_of(self.all.top)
        alone = sum(other.scope is s.scope for other in self.sections) == 1
        labels = own if alone and own and not self.rigid else self.all.elements_of(s.line, s.elset, s.scope)
        s.cells = frozenset(labels) & self.all.own.keys()
        if (both := s.cells & self.rigid) and not s.cells <= self.rigid:
            raise FileError.at(s.line, f"element {min(both) % LABELS} of the section {s.elset!r} is rigid, others are not")
        of_part = self.tool_name("", s.scope) if alone and s.scope.part else ""
        s.name = plain(of_part or s.elset.rpartition(".")[2] or "body")

    def tool_name(self, surface: str, scope: Scope) -> str:
        """The part's name, the instance's where the part is placed twice, or the surface's in a deck without parts."""
        twice = sum(s.part == scope.part for s in self.all.instances.values()) > 1
        name = plain((scope.name if twice else scope.part) or surface)
        # A part may have several rigid surfaces: the second one is distinguished by its surface's name.
        used = {t.name for t in self.tools.values()}
        return name if name not in used else f"{name}_{plain(surface)}"

    def sides_pressed(self, scope: Scope, rows: list[tuple[int, list[str]]]) -> list[str]:
        """'body.boundary' of the sides of elements that rows of *DLOAD press on.

        Raises
        ------
        FileError
            If one lies inside of a body, or was loaded together with others before.

        """
        sides = self.all.places.sides(scope, rows)
        left = {frozenset(ends(s, self.all.solid)) for s in sides}
        line, name = rows[0][0], self.all.places.faces[frozenset(left)]
        for side in left:
            if self.under.setdefault(side, name) != name:
                raise FileError.at(line, "these sides were grouped differently before; write them in the same groups")
        found = []
        for s in self.bodies():
            free = {key for side in s.free if (key := frozenset(ends(side, self.all.solid))) in left}
            left = left - free
            found += [f"{s.name}.{name}"] if free else []
        if left:
            raise FileError.at(line, f"the side of nodes {' and '.join(str(n % LABELS) for n in sorted(min(left, key=sorted)))} "
                               "lies inside of a body, or on none")  # fmt: skip
        return found

    def volumes(self, line: int, who: str, scope: Scope) -> list[str]:
        """The bodies that an element set is; all of them without a name.

        Raises
        ------
        FileError
            If it is a part of a body, or none.

        """
        bodies = self.bodies()
        if not who:
            return [s.name for s in bodies]
        cells = set(self.all.elements_of(line, who, scope)) & self.all.own.keys()
        found = [s for s in bodies if s.cells & cells]
        if part := next((s for s in found if not s.cells <= cells), None):
            raise FileError.at(line, f"{who!r} is a part of {part.name!r}: forces per volume act on whole bodies here")
        if not found and not cells <= self.rigid:
            raise FileError.at(line, f"{who!r} is none of the sections")
        return [s.name for s in found]

    def lines_of_symmetry(self, history: list[tuple[Keyword, Scope]]) -> list[tuple[int, float]]:
        """Coordinate (0, 1) and its value of straight sides held along their normal, beyond which no body is."""
        held: tuple[set[int], set[int]] = (set(), set())
        for k, scope in history:
            for line, row in k.data if k.name == "BOUNDARY" else ():
                nodes = self.all.places.nodes(row[0], scope, line)
                for c in still(k, row):
                    held[c].update(nodes)
        found: set[tuple[int, float]] = set()
        places = self.all.nodes
        used = {n for s in self.bodies() for n in s.nodes if n in places}
        for i in (0, 1) if used else ():  # cells without nodes are reported with the mesh
            low, high = min(places[n][i] for n in used), max(places[n][i] for n in used)
            for side in (side for s in self.bodies() for side in s.free):
                at = [places[n][i] for n in side if n in used]
                for end in (low, high):
                    if held[i].issuperset(side) and all(abs(x - end) <= DRAWN * (high - low) for x in at):
                        found.add((i, end))
        return sorted(found)

    # ---------------------------------------------------------------------------------------------------- followers
    def followers(self, line: int, who: list[str], scope: Scope) -> list[Follower]:
        """What follows the nodes of sets and numbers; what follows several nodes only where all of them are there."""
        nodes = dict.fromkeys(n for w in who for n in self.all.places.nodes(w, scope, line))
        return [f for n in nodes for f in self.following.get(n, ()) if f.members <= nodes.keys()]

    def follow(self, node: int, follower: Follower, components: str) -> None:
        """Let boundaries follow a node along components."""
        self.following.setdefault(node, []).extend(replace(follower, c=c) for c in components)

    def equation(self, k: Keyword, scope: Scope) -> None:
        """Terms along one component: the set of the first follows the others, each a node or nodes that move alike.

        Raises
        ------
        FileError
            For equations of another kind.

        """
        for line, terms in equations(k):
            if len(terms) < 2 or len({dof for _, dof, _ in terms}) > 1 or not terms[0][2]:
                raise FileError.at(
                    line, "only equations along one component are read, by which the first nodes follow others that are "
                    "prescribed; hold or move the nodes by *BOUNDARY instead"
                )  # fmt: skip
            (who, dof, a), *others = terms
            if not (c := ({"1": "x", "2": "y", "3": "z"} if self.all.solid else {"1": "x", "2": "y"}).get(dof)):
                continue
            together: list[Follower] = []
            for master, _, b in others:
                nodes = frozenset(self.all.places.nodes(master, scope, line)) or frozenset((self.node(line, master, scope),))
                together.append(Follower(line, who, scope, c, -b / a, members=nodes, terms=together))
                self.following.setdefault(min(nodes), []).append(together[-1])

    def refuse_undriven(self) -> None:
        """Refuse followers of nodes that nothing prescribes: they would be left free.

        Raises
        ------
        FileError
            With the line at which they are made to follow.

        """
        for node, followers in self.following.items():
            if free := next((f for f in followers if not f.driven), None):
                how = "does not turn: hold its rotation (6, 6)" if free.c == "r" else "does not turn: hold its rotations (4, 6)" \
                    if free.c in "abc" else f"has a prescribed motion along {free.c}"
                raise FileError.at(free.line, f"{free.who!r} follows node {node % LABELS}: read where that {how} by *BOUNDARY")


def plain(name: str) -> str:
    """A name as bodies and tools may have it."""
    return re.sub(r"[^\w-]+", "_", name)
