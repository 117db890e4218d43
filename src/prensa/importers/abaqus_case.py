"""A case out of an Abaqus (or CalculiX) deck: materials, sections, rigid surfaces, contacts, ties, steps.

A documented subset: what concerns the answer and is not read is refused with its line; what does not is reported.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

from prensa.importers.abaqus import Assembly, Keyword, Scope
from prensa.importers.abaqus_steps import OF_STEPS, Steps
from prensa.importers.abaqus_tools import RigidTool, chain, segments
from prensa.importers.abaqus_words import PASSED_OVER, REFUSED
from prensa.importers.deck import LABELS, FileError, is_label

# Generalised plane strain (CPEG) has no counterpart: its letters after CPE match no element below.
SPACE_OF = {
    "CPE": "plane strain", "CPS": "plane stress", "CAX": "axisymmetric",
}  # fmt: skip
# Reduced and hybrid quadrilaterals of Abaqus are there against locking, which F-bar is against here; incompatible modes are the
# enhanced element.
ELEMENT_OF = {
    "4": "q4_fbar", "4R": "q4_fbar", "4H": "q4_fbar", "4RH": "q4_fbar", "4I": "q4_enhanced", "4IH": "q4_enhanced",
    "3": "t3", "6": "t6", "6M": "t6", "6H": "t6", "6MH": "t6", "8": "q8_full", "8R": "q8", "8H": "q8_full", "8RH": "q8",
}  # fmt: skip
METRES = 1e9  # a modulus from which on a deck is taken to be in metres and newtons


@dataclass
class _Section:
    scope: Scope
    elset: str
    material: str
    line: int
    name: str = ""
    cells: frozenset[int] = frozenset()


class _Reader:
    """What has been read so far; one method for each keyword that matters."""

    def __init__(self, text: str, path: str) -> None:
        self.path, self.all = path, Assembly(text)
        self.deck = self.all.deck()
        self.paired: set[tuple[str, str]] = set()
        self.case: dict[str, Any] = {"name": Path(path).stem, "bodies": {}, "tools": {}, "contacts": [], "ties": [], "fixed": {}}
        self.remarks: list[str] = []
        self.materials: dict[str, dict[str, Any]] = {}
        self.material = ""
        self.sections: list[_Section] = []
        self.tools: dict[tuple[str, str], RigidTool] = {}
        self.frictions: dict[str, dict[str, Any] | None] = {}
        self.interaction = ""
        self.pairs: list[tuple[str, str, str, int, Scope]] = []
        self.ties: list[tuple[str, str, int, Scope]] = []
        self.everywhere: tuple[str, int] | None = None
        self.history: list[tuple[Keyword, Scope]] = []

    def read(self) -> None:
        """All keywords, in their order."""
        for k, scope in self.all.order:
            if method := METHOD_OF.get(k.name):
                getattr(self, method)(k, scope)
            elif k.name in OF_STEPS:
                self.history.append((k, scope))
            elif k.name in REFUSED:
                raise FileError.at(k.line, f"*{k.name} is not read, and would change the answer: {REFUSED[k.name]}")
            elif k.name not in PASSED_OVER:
                self.remarks.append(f"line {k.line}: *{k.name} is not read")

    # ------------------------------------------------------------------------------------------------------- model
    def heading(self, k: Keyword, scope: Scope) -> None:
        words = " ".join(text for _, text in k.lines).strip()
        if words:
            self.case["name"] = words[:80]

    def element(self, k: Keyword, scope: Scope) -> None:
        kind = k.parameters.get("TYPE", "").upper()
        space = SPACE_OF.get(kind[:3])
        if space is None:
            return  # of a rigid tool, or of a set that is no section, or refused there
        # One case has one space: elements of two would be forces per thickness beside those of a whole circumference.
        if self.case.setdefault("space", space) != space:
            raise FileError.at(k.line, f"elements {kind} are of {space}, those before of {self.case['space']}")
        if kind[3:] not in ELEMENT_OF:
            raise FileError.at(k.line, f"elements {kind} have no counterpart here; take {kind[:3]}4")

    def material_(self, k: Keyword, scope: Scope) -> None:
        self.material = k.parameters.get("NAME", "").upper()
        self.materials[self.material] = {"type": "elastic"}

    def elastic(self, k: Keyword, scope: Scope) -> None:
        if not k.parameters.get("TYPE", "ISOTROPIC").upper().startswith("ISO"):
            raise FileError.at(k.line, "only isotropic elasticity is read")
        row, *more = k.rows
        if more:
            raise FileError.at(k.line, "an elasticity that depends on temperature or fields is not read; leave one row")
        self._of_material(k, {"E": k.number(row, 0), "nu": k.number(row, 1)})

    def _of_material(self, k: Keyword, properties: dict[str, Any]) -> None:
        if self.material not in self.materials:
            raise FileError.at(k.line, f"*{k.name} belongs to no material: write *MATERIAL, NAME=… before it")
        self.materials[self.material] |= properties

    def plastic(self, k: Keyword, scope: Scope) -> None:
        if k.parameters.get("HARDENING", "ISOTROPIC").upper() != "ISOTROPIC" or "RATE" in k.parameters:
            raise FileError.at(k.line, "only isotropic hardening without rate or temperature is read")
        data = k.rows
        if len({tuple(row[2:]) for row in data}) > 1:
            raise FileError.at(k.line, "a flow curve for each of several temperatures is not read; leave that of one")
        rows = [(k.number(row, 1, 0.0), k.number(row, 0)) for row in data]
        # Said here, where the line of the deck is known, and not only when the case is checked.
        for (line, _), (before, _), (now, _) in zip(islice(k.data, 1, None), rows, rows[1:]):
            if now <= before:
                raise FileError.at(line, f"plastic strains of a flow curve must increase: {now:g} after {before:g}")
        flow = {"type": "perfect", "s0": rows[0][1]} if len(rows) == 1 else {"type": "table", "points": [list(r) for r in rows]}
        self._of_material(k, {"type": "j2", "flow": flow})

    def solid_section(self, k: Keyword, scope: Scope) -> None:
        wanted = k.parameters.get("ELSET", "")
        self.sections.append(_Section(scope, wanted, k.parameters.get("MATERIAL", "").upper(), k.line))
        thickness = next((k.number(row, 0, 1.0) for _, row in k.data), 1.0)
        if thickness != 1.0 and self.case.get("space") != "axisymmetric":
            self.case["thickness"] = thickness

    # ------------------------------------------------------------------------------------------------------- tools
    def surface(self, k: Keyword, scope: Scope) -> None:
        kind = k.parameters.get("TYPE", "ELEMENT").upper()
        if kind == "SEGMENTS":
            name = k.parameters.get("NAME", "")
            fillet = k.number([k.parameters.get("FILLET RADIUS", "")], 0, 0.0)
            if len(walk := [_moved(v, scope) for v in segments(k)]) < 2:
                raise FileError.at(k.line, f"the rigid surface {name!r} has no segment: write START, then LINE or CIRCL")
            self.tools[scope.name.upper(), name.upper()] = RigidTool(self._tool_name(name, scope), k.line, walk, fillet, True)
        elif kind not in ("ELEMENT", "NODE"):
            raise FileError.at(k.line, f"a surface of type {kind} is not read; in the plane write SEGMENTS")

    def rigid_body(self, k: Keyword, scope: Scope) -> None:
        if "ANALYTICAL SURFACE" in k.parameters:
            instance, dot, name = k.parameters["ANALYTICAL SURFACE"].upper().rpartition(".")
            key = (instance if dot else scope.name.upper(), name)
            if key not in self.tools:
                raise FileError.at(k.line, f"there is no rigid surface {name!r} of TYPE=SEGMENTS before this line")
        else:
            key = self._chain(k, scope)
        self.tools[key].reference = self._node(k.line, k.parameters.get("REF NODE", ""), scope)

    def _chain(self, k: Keyword, scope: Scope) -> tuple[str, str]:
        """The tool that rigid line elements make."""
        wanted = k.parameters.get("ELSET", "")
        labels = self.all.elements_of(k.line, wanted, scope) if wanted else []
        lines = [self.all.lines[e] for e in labels if e in self.all.lines]
        if not lines or len(lines) < len(labels):
            raise FileError.at(
                k.line, "rigid bodies that are read are analytical surfaces (SEGMENTS) and chains of elements R2D2 or RAX2"
            )
        where = next((s for s in self.all.instances.values() if s.offset == labels[0] // LABELS * LABELS), scope)
        name = self._tool_name(wanted.rpartition(".")[2], where)
        key = (where.name.upper(), f"*{wanted.upper()}")
        nodes = frozenset(n for e in lines for n in e)
        self.tools[key] = RigidTool(name, k.line, chain(k, lines, self.all.nodes), None, False, nodes=nodes)
        return key

    def _tool_name(self, surface: str, scope: Scope) -> str:
        """The part's name, the instance's where the part is placed twice, or the surface's in a deck without parts."""
        twice = sum(s.part == scope.part for s in self.all.instances.values()) > 1
        name = _plain((scope.name if twice else scope.part) or surface)
        # A part may have several rigid surfaces: the second one is distinguished by its surface's name.
        used = {t.name for t in self.tools.values()}
        return name if name not in used else f"{name}_{_plain(surface)}"

    # ---------------------------------------------------------------------------------------------------- contacts
    def surface_interaction(self, k: Keyword, scope: Scope) -> None:
        self.interaction = k.parameters.get("NAME", "").upper()
        self.frictions[self.interaction] = None

    def surface_behavior(self, k: Keyword, scope: Scope) -> None:
        if "NO SEPARATION" in k.parameters:
            raise FileError.at(k.line, "NO SEPARATION is not read: contact here opens where it is pulled; take the word out")
        law = k.parameters.get("PRESSURE-OVERCLOSURE", "HARD").upper()
        if law != "HARD":
            self.remarks.append(f"line {k.line}: contact is hard here, not {law}; 'enforcement' chooses how it is enforced")

    def friction(self, k: Keyword, scope: Scope) -> None:
        if "ROUGH" in k.parameters:
            raise FileError.at(k.line, "ROUGH is not read; write a friction coefficient that lets nothing slip, such as 10.")
        if k.parameters.get("DEPENDENCIES") or "EXPONENTIAL DECAY" in k.parameters or "USER" in k.parameters:
            raise FileError.at(k.line, "only one friction coefficient is read; other laws are in the guide to friction")
        data = [row for _, row in k.data]
        if len(data) > 1 or any(any(row[1:]) for row in data):
            raise FileError.at(k.line, "a friction that depends on slip, pressure or temperature is not read; leave one number")
        mu, most = k.number(data[0] if data else ["0"], 0, 0.0), k.number([k.parameters.get("TAUMAX", "")], 0, 0.0)
        if most:
            raise FileError.at(k.line, "TAUMAX is not read; write 'capped' friction with a shear factor into the case instead")
        self.frictions[self.interaction] = {"type": "coulomb", "mu": mu} if mu else None

    def contact_pair(self, k: Keyword, scope: Scope) -> None:
        if "TIED" in k.parameters:
            raise FileError.at(k.line, "a contact that is TIED is not read; write *TIE")
        for line, words in k.data:
            of = k.parameters.get("INTERACTION", k.parameters.get("CPSET", "")).upper()
            self.pairs.append((words[0], words[1] if len(words) > 1 else "", of, line, scope))

    def inclusions(self, k: Keyword, scope: Scope) -> None:
        if "ALL EXTERIOR" in k.parameters or "ALL ELEMENT BASED" in k.parameters:
            self.everywhere = self.everywhere or ("", k.line)
            return
        for line, words in k.data:
            if len(words) < 2 or not all(words):
                raise FileError.at(line, "of general contact ALL EXTERIOR and pairs of two surfaces are read")
            self.pairs.append((words[0], words[1], "*", line, scope))

    def property_assignment(self, k: Keyword, scope: Scope) -> None:
        for line, words in k.data:
            if any(words[:2]) or len(words) < 3:
                raise FileError.at(line, "one interaction for all general contact is read; write the others as *CONTACT PAIR")
            self.everywhere = (words[2].upper(), self.everywhere[1] if self.everywhere else line)

    def tie(self, k: Keyword, scope: Scope) -> None:
        for line, words in k.data:
            if len(words) < 2:
                raise FileError.at(line, "a tie has two surfaces")
            self.ties.append((words[0], words[1], line, scope))

    def initial_conditions(self, k: Keyword, scope: Scope) -> None:
        kind = k.parameters.get("TYPE", "").upper()
        if kind != "TEMPERATURE":
            raise FileError.at(
                k.line, f"initial conditions of type {kind or 'unknown'} are not read; bodies start at rest, without stress"
            )
        self.remarks.append(f"line {k.line}: temperatures are not read; there is no heat here")

    # ------------------------------------------------------------------------------------------------------- names
    def _node(self, line: int, who: str, scope: Scope) -> int:
        where, name = self.all.seen_from(line, who, scope)
        members = where.node_sets.get(name)
        if members and len(members) == 1 and members[0] in self.all.nodes:
            return members[0]
        if is_label(name) and int(name) + where.offset in self.all.nodes:
            return int(name) + where.offset
        raise FileError.at(line, f"{who!r} is no single node")

    def _tool_at(self, line: int, who: str, scope: Scope) -> str | None:
        """Name of the tool whose reference node this is."""
        try:
            node = self._node(line, who, scope)
        except FileError:
            return None
        return next((t.name for t in self.tools.values() if t.reference == node), None)

    def _boundary(self, line: int, who: str, scope: Scope) -> tuple[str, frozenset[int]]:
        """A set's or surface's name in the mesh, and its nodes."""
        where, name = self.all.seen_from(line, who, scope)
        known = where.boundary_of.get(name)
        if known is None:
            raise FileError.at(line, f"{who!r} is no set of nodes or surface of this deck")
        nodes = {n for side in where.surfaces.get(name, []) for n in side}
        return known, frozenset(nodes or where.node_sets.get(name, []))

    def _support(self, line: int, who: str, scope: Scope) -> list[str]:
        """'body.boundary' of every body that has nodes of a set.

        Raises
        ------
        FileError
            If the set lies inside of a body, where nothing can be held.

        """
        name, nodes = self._boundary(line, who, scope)
        found = []
        for section in self._bodies():
            mine = {n for e in section.cells for n in self.deck.cells[e]} & nodes
            if not mine:
                continue
            # A node set becomes a boundary by its sides: a corner of which no side lies in the set would lose its support
            # without a word.
            sides, corners = _outline(self.deck.cells[e] for e in section.cells)
            reached = {n for a, b, *_ in sides if a in mine and b in mine for n in (a, b)}
            if len(mine) > 1 and (lost := (mine & corners) - reached):
                raise FileError.at(
                    line, f"node {min(lost) % LABELS} of {who!r} is on no side of {section.name!r} that lies in the set: "
                    "supports and loads hold sides of the outline, or one node"
                )  # fmt: skip
            found.append(f"{section.name}.{name}")
        if not found:
            raise FileError.at(line, f"{who!r} belongs to none of the sections")
        return found

    def _bodies(self) -> list[_Section]:
        """The sections, each with its name as a body and its cells; one that is alone has all cells of its part."""
        if not self.sections:
            raise FileError("the deck has no *SOLID SECTION: nothing says of what the elements are made")
        if not self.sections[0].cells:
            for s in self.sections:
                own = s.scope if s.scope.cells else self.all.top
                alone = sum(other.scope is s.scope for other in self.sections) == 1
                labels = own.cells if alone and own.cells else self.all.elements_of(s.line, s.elset, s.scope)
                s.cells = frozenset(labels) & self.deck.cells.keys()
                of_part = self._tool_name("", s.scope) if alone and s.scope.part else ""
                s.name = _plain(of_part or s.elset.rpartition(".")[2] or "body")
            for s in self.sections:
                if sum(other.name == s.name for other in self.sections) > 1:
                    s.name = f"{_plain(s.scope.name)}_{s.name}"
        return self.sections

    # ------------------------------------------------------------------------------------------------------ finish
    def finished(self) -> dict[str, Any]:
        """The case: names of bodies put before those of boundaries, once all is known."""
        sections = self._bodies()
        for s in sections:
            self.case["bodies"][s.name] = self._body(s, len(sections) > 1)
        for slave, master, interaction, line, scope in self.pairs:
            self._contact(slave, master, interaction, line, scope)
        for slave, master, line, scope in self.ties:
            names = [self._support(line, who, scope) for who in (slave, master)]
            self.case["ties"].append({"slave": names[0][0], "master": names[1][0]})
        if self.everywhere:
            interaction, line = self.everywhere
            if self.pairs:
                raise FileError.at(line, "general contact beside contact pairs is not read; write all as pairs")
            if friction := self.frictions.get(interaction):
                self.case["friction"] = friction
        # A case without contacts has every tool against every body, which a deck without contact does not say.
        elif not self.pairs and self.tools:
            self.remarks.append("the deck has no contact; here every tool meets every body")
        for tool in self.tools.values():
            self.case["tools"][tool.name] = self._tool(tool, sections)
        steps = Steps(self._tool_at, self._support)
        self.case["fixed"], self.case["steps"] = steps.read(self.history)
        # Abaqus is geometrically linear unless NLGEOM says otherwise; here finite strain is the default.
        if not steps.large:
            self.case["kinematics"] = "small"
        self._units()
        return {key: self.case[key] for key in ORDER if self.case.get(key) not in (None, [], {})}

    def _units(self) -> None:
        # Decks have no units: no metal has 1e9 MPa, and every metal has more than 1e9 Pa.
        stiffest = max((m.get("E", 0.0) for m in self.materials.values()), default=0.0)
        if stiffest >= METRES:
            self.case["units"] = {"length": "m", "force": "N"}
            self.remarks.append(f"units are taken to be m and N, because a modulus is {stiffest:g}; say so if they are not")

    def _body(self, s: _Section, several: bool) -> dict[str, Any]:
        if s.material not in self.materials or "E" not in self.materials[s.material]:
            raise FileError.at(s.line, f"the section's material {s.material!r} has no *ELASTIC before")
        mesh: dict[str, Any] = {"type": "file", "path": self.path}
        if several or self.deck.exclusive:
            part = next((n for n, cells in self.deck.parts.items() if set(cells) == s.cells), None)
            mesh["part"] = part or s.scope.part_of.get(s.elset.upper(), s.elset)
        elements = {ELEMENT_OF[kind[3:]] for e in s.cells if SPACE_OF.get((kind := self.deck.kinds[e])[:3])}
        if not elements:
            raise FileError.at(s.line, f"the section {s.elset!r} has no elements CPE, CPS or CAX")
        element = min(elements)
        if len(elements) > 1:
            if len({len(self.deck.cells[e]) for e in s.cells}) == 1:
                raise FileError.at(s.line, f"a body has elements of one kind, {s.name!r} has {' and '.join(sorted(elements))}")
            element = "t6"
            self.remarks.append(f"{s.name} has triangles and quadrilaterals: these are split, and all are made quadratic (t6)")
        # Plane stress does not lock in volume: its thickness gives way, and F-bar has nothing to correct.
        if self.case.get("space") == "plane stress" and element == "q4_fbar":
            element = "q4"
        return {"mesh": mesh, "material": self.materials[s.material], "element": element}

    def _contact(self, slave: str, master: str, interaction: str, line: int, scope: Scope) -> None:
        if interaction == "*":
            interaction = self.everywhere[0] if self.everywhere else ""
        tool = self._tool_of(master, line, scope)
        if tool is None:
            tool, slave = self._tool_of(slave, line, scope), master
        if tool is None:
            raise FileError.at(line, f"{master!r} is no analytical rigid surface: contact is between bodies and rigid tools")
        for surface in self._support(line, slave, scope):
            tool.surfaces.append(surface)
            contact: dict[str, Any] = {"surface": surface, "against": tool.name}
            if (surface, tool.name) in self.paired:
                raise FileError.at(line, f"the contact of {slave!r} and {master!r} is written before; keep one")
            self.paired.add((surface, tool.name))
            if friction := self.frictions.get(interaction):
                contact["friction"] = friction
            self.case["contacts"].append(contact)

    def _tool_of(self, who: str, line: int, scope: Scope) -> RigidTool | None:
        """The tool to which a surface belongs."""
        instance, dot, name = who.upper().rpartition(".")
        for (where, surface), tool in self.tools.items():
            if surface == name.strip('"') and (not dot or where == instance.strip('"')):
                return tool
        where_, key = self.all.seen_from(line, who, scope)
        nodes = {n for side in where_.surfaces.get(key, ()) for n in side} | set(where_.node_sets.get(key, ()))
        return next((t for t in self.tools.values() if nodes and nodes <= t.nodes), None)

    def _tool(self, tool: RigidTool, sections: list[_Section]) -> dict[str, Any]:
        """A profile in the frame of its reference node, walked so that the surfaces it is to meet are outside."""
        if tool.reference is None:
            raise FileError.at(tool.line, f"the rigid surface {tool.name!r} has no *RIGID BODY with a reference node")
        # Profiles here are drawn in the frame of the tool's reference point, about which it turns.
        x0, y0, _ = self.deck.nodes[tool.reference]
        met = {n for s in tool.surfaces for n in self._nodes_of(s)}
        cells = (self.deck.cells[e] for s in sections for e in sorted(s.cells))
        # Chains of line elements do not say on which side the metal is: the bodies that a tool is to meet lie outside of it.
        near = [self._middle(cell) for cell in cells if not met or met.intersection(cell)]

        def moved(x: tuple[float, float]) -> list[float]:
            return [round(x[0] - x0, 12), round(x[1] - y0, 12)]

        walk = tool.walk(near)
        points = [{"through": moved(v["through"]), "to": moved(v["to"])} if isinstance(v, dict) else moved(v) for v in walk]
        out: dict[str, Any] = {"type": "profile", "points": points}
        if tool.fillet is not None:
            out["fillet"] = tool.fillet
        if tool.closed:
            out["closed"] = True
        return {**out, "at": [x0, y0]}

    def _nodes_of(self, boundary: str) -> set[int]:
        name = boundary.partition(".")[2]
        return {n for side in self.deck.lines.get(name, ()) for n in side} | set(self.deck.points.get(name, ()))

    def _middle(self, cell: tuple[int, ...]) -> tuple[float, float]:
        places = [self.deck.nodes[n] for n in cell if n in self.deck.nodes]
        if not places:
            return 0.0, 0.0  # of a cell without nodes, which the mesh reports
        return sum(p[0] for p in places) / len(places), sum(p[1] for p in places) / len(places)


def _outline(cells: Any) -> tuple[list[tuple[int, ...]], set[int]]:
    """Sides (ends) of cells that belong to one cell only, and the corners of all."""
    count: dict[frozenset[int], int] = {}
    ends: dict[frozenset[int], tuple[int, int]] = {}
    corners: set[int] = set()
    for cell in cells:
        corner = cell[: 3 if len(cell) in (3, 6) else 4]
        corners.update(corner)
        for a, b in pairwise((*corner, corner[0])):
            key = frozenset((a, b))
            count[key], ends[key] = count.get(key, 0) + 1, (a, b)
    return [ends[key] for key, n in count.items() if n == 1], corners


def _moved(vertex: Any, scope: Scope) -> Any:
    if isinstance(vertex, dict):
        return {"through": scope.moved(*vertex["through"]), "to": scope.moved(*vertex["to"])}
    return scope.moved(*vertex)


def _plain(name: str) -> str:
    """A name as bodies and tools may have it."""
    return re.sub(r"[^\w-]+", "_", name)


ORDER = (
    "name", "units", "space", "thickness", "kinematics", "friction", "bodies", "tools", "contacts", "ties", "fixed", "steps",
)  # fmt: skip
METHOD_OF = {
    "HEADING": "heading", "ELEMENT": "element", "MATERIAL": "material_", "ELASTIC": "elastic", "PLASTIC": "plastic",
    "SOLID SECTION": "solid_section", "SURFACE": "surface", "RIGID BODY": "rigid_body",
    "SURFACE INTERACTION": "surface_interaction", "SURFACE BEHAVIOR": "surface_behavior", "FRICTION": "friction",
    "CONTACT PAIR": "contact_pair", "CONTACT INCLUSIONS": "inclusions", "CONTACT PROPERTY ASSIGNMENT": "property_assignment",
    "TIE": "tie", "INITIAL CONDITIONS": "initial_conditions",
}  # fmt: skip

def case_of(text: str, path: str) -> tuple[dict[str, Any], list[str]]:
    """The case that a deck describes, as a case file has it, and remarks about what was passed over.

    path: of the deck, as the case is to name it for the mesh.

    Raises
    ------
    FileError
        For what concerns the answer and is not read, with its line.

    """
    reader = _Reader(text, path)
    reader.read()
    return reader.finished(), reader.remarks
