"""A case out of an Abaqus (or CalculiX) deck: materials, sections, rigid surfaces, contacts, ties, steps.

A documented subset: what concerns the answer and is not read is refused with its line; what does not is reported.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, islice
from pathlib import Path
from typing import Any

import numpy as np

from prensa.importers.abaqus import Assembly
from prensa.importers.abaqus_includes import Whole
from prensa.importers.abaqus_keywords import Keyword, Scope, keywords
from prensa.importers.abaqus_loads import Loads, even_traction
from prensa.importers.abaqus_names import DeckNames, Section
from prensa.importers.abaqus_places import ends, outline
from prensa.importers.abaqus_steps import OF_STEPS, Follower, Steps
from prensa.importers.abaqus_tools import RigidTool, segments
from prensa.importers.abaqus_tools_in_space import SWEPT, SpatialTool, analytical
from prensa.importers.abaqus_words import (
    AS_STATIC,
    KNOWN,
    LEFT_OUT,
    PARAMETERS_OF,
    PASSED_OVER,
    REFUSED,
    WITHOUT_EFFECT,
    group_of,
    may_be_left_out,
    nearest,
    refuse_unknown_parameters,
    squeezed,
)
from prensa.importers.deck import LABELS, FileError
from prensa.importers.solids import OF_ABAQUS

# Generalised plane strain (CPEG) has no counterpart: its letters after CPE match no element below.
SPACE_OF = {
    "CPE": "plane strain", "CPS": "plane stress", "CAX": "axisymmetric", "C3D": "solid",
}  # fmt: skip
# Reduced and hybrid quadrilaterals of Abaqus are there against locking, which F-bar is against here; incompatible modes are the
# enhanced element.
ELEMENT_OF = {
    "4": "q4_fbar", "4R": "q4_fbar", "4H": "q4_fbar", "4RH": "q4_fbar", "4I": "q4_enhanced", "4IH": "q4_enhanced",
    "3": "t3", "3H": "t3", "6": "t6", "6M": "t6", "6H": "t6", "6MH": "t6",
    "8": "q8_full", "8R": "q8", "8H": "q8_full", "8RH": "q8",
}  # fmt: skip
SOLID_ELEMENT_OF = {
    "8": "h8_fbar", "8R": "h8_fbar", "8H": "h8_fbar", "8RH": "h8_fbar", "8I": "h8_enhanced", "8IH": "h8_enhanced",
    "6": "h8_fbar", "6H": "h8_fbar",
    **dict.fromkeys(("10", "10M", "10H", "10MH", "10HS", "10I", "10R"), "t10"),
}  # fmt: skip
"""In space, by what follows C3D; wedges are collapsed bricks."""
METRES = 1e9  # a modulus from which on a deck is taken to be in metres and newtons


# Keywords between which *FRICTION and *SURFACE BEHAVIOR still belong to the interaction before.
OF_INTERACTION = (
    "SURFACE INTERACTION", "SURFACE BEHAVIOR", "FRICTION", "GAP CONDUCTANCE", "GAP HEAT GENERATION", "CONTACT DAMPING",
)  # fmt: skip


class _Reader:
    """What has been read so far; one method for each keyword that matters.

    ``without``: what the user leaves out, names of `LEFT_OUT` and keywords that are unknown here.
    """

    def __init__(self, deck: Whole, path: str, without: frozenset[str], files: dict[str, str] | None = None) -> None:
        found = keywords(deck.text, deck.origins)
        self.solid = any(k.name == "ELEMENT" and k.parameters.get("TYPE", "").upper().startswith("C3D") for k in found)
        self.path, self.all, self.without, self.files = path, Assembly(deck.text, self.solid, deck.origins), without, files
        self.deck = self.all.deck()
        self.names = DeckNames(self.all, self.deck)
        self.paired: set[tuple[str, str]] = set()
        self.case: dict[str, Any] = {"name": Path(path).stem, "bodies": {}, "tools": {}, "contacts": [], "ties": [], "fixed": {}}
        self.remarks: list[str] = []
        self.materials: dict[str, dict[str, Any]] = {}
        self.densities: dict[str, float] = {}
        self.material = ""
        self.frictions: dict[str, dict[str, Any] | None] = {}
        self.stiffness: dict[str, dict[str, float]] = {}
        self.interaction: str | None = None
        self.coupled: Keyword | None = None
        self.structures: list[tuple[int, str, list[int]]] = []
        self.pairs: list[tuple[str, str, str, int, Scope]] = []
        self.ties: list[tuple[str, str, int, Scope]] = []
        self.everywhere: tuple[str, int] | None = None
        self.history: list[tuple[Keyword, Scope]] = []

    def read(self) -> None:
        """All keywords, in their order."""
        for k, scope in self.all.order:
            if k.name not in OF_INTERACTION:
                self.interaction = None
            if self._left_out(k, scope):
                continue
            refuse_unknown_parameters(k.name, k.parameters, k.line)
            if method := METHOD_OF.get(k.name):
                getattr(self, method)(k, scope)
            elif k.name in OF_STEPS:
                self.history.append((k, scope))
            elif k.name in WITHOUT_EFFECT:
                self.remarks.append(f"line {k.line}: *{k.name} is not read: it has no effect in static steps")
            elif k.name not in PASSED_OVER:
                raise self._unread(k)

    def _left_out(self, k: Keyword, scope: Scope) -> bool:
        """Pass over what the user leaves out; procedures without what makes them different are static steps."""
        group = group_of(k.name) or k.name
        if not ({group, squeezed(group)} & self.without):
            return False
        if k.name in AS_STATIC:
            kept = {p: value for p, value in k.parameters.items() if p in PARAMETERS_OF["STATIC"]}
            self.history.append((replace(k, name="STATIC", parameters=kept), scope))
            self.remarks.append(f"line {k.line}: *{k.name} is read as a static step (--without {group})")
        else:
            self.remarks.append(f"line {k.line}: *{k.name} is left out (--without {group})")
        return True

    def _unread(self, k: Keyword) -> FileError:
        if k.name not in REFUSED:
            near = nearest(k.name, KNOWN)
            hint = f"did you mean *{near}?" if near else "nothing here is like it."
            return FileError.at(
                k.line, f"*{k.name} is not known; {hint} If the answer does not depend on it: --without '{k.name.lower()}'"
            )
        group = group_of(k.name)
        leave = f"--without {group} leaves it out" if group else f"--without leaves out: {may_be_left_out()}"
        return FileError.at(k.line, f"*{k.name} is not read, and would change the answer: {REFUSED[k.name]} ({leave})")

    def _only_without(self, group: str, line: int, what: str) -> None:
        """Pass over something that the user leaves out, and refuse it otherwise."""
        if group not in self.without:
            raise FileError.at(line, f"{what} (--without {group} leaves it out)")
        self.remarks.append(f"line {line}: {LEFT_OUT[group][0]} (--without {group})")

    # ------------------------------------------------------------------------------------------------------- model
    def heading(self, k: Keyword, scope: Scope) -> None:
        words = " ".join(text for _, text in k.lines).strip()
        if words:
            self.case["name"] = words[:80]

    def element(self, k: Keyword, scope: Scope) -> None:
        kind = k.parameters.get("TYPE", "").upper()
        space = SPACE_OF.get(kind[:3])
        if space is None or (self.solid and space != "solid"):
            return  # of a rigid tool, or of a set that is no section, or refused there
        # One case has one space: elements of two would be forces per thickness beside those of a whole circumference.
        if self.case.setdefault("space", space) != space:
            raise FileError.at(k.line, f"elements {kind} are of {space}, those before of {self.case['space']}")
        if kind.endswith("T") and "temperature" not in self.without:
            raise FileError.at(k.line, f"elements {kind} have a temperature, which is not read (--without temperature)")
        if kind[3:].removesuffix("T") not in (SOLID_ELEMENT_OF if self.solid else ELEMENT_OF):
            known = OF_ABAQUS.get(kind[3:].rstrip("RHIMST")) if self.solid else None
            take = "C3D8 or C3D10" if self.solid else f"{kind[:3]}4"
            raise FileError.at(k.line, f"elements {kind} have no counterpart here; {(known and known.remedy) or f'take {take}'}")

    def material_(self, k: Keyword, scope: Scope) -> None:
        self.material = k.parameters.get("NAME", "").upper()
        self.materials[self.material] = {"type": "elastic"}

    def elastic(self, k: Keyword, scope: Scope) -> None:
        if not k.parameters.get("TYPE", "ISOTROPIC").upper().startswith("ISO"):
            raise FileError.at(k.line, "only isotropic elasticity is read; write *ELASTIC with E and nu")
        values = [(k.number(row, 0), k.number(row, 1)) for row in k.rows]
        if len(set(values)) > 1:
            raise FileError.at(k.line, "an elasticity that depends on temperature or fields is not read; keep one row")
        self._of_material(k, dict(zip(("E", "nu"), values[0])))

    def _of_material(self, k: Keyword, properties: dict[str, Any]) -> None:
        if self.material not in self.materials:
            raise FileError.at(k.line, f"*{k.name} belongs to no material: write *MATERIAL, NAME=… before it")
        self.materials[self.material] |= properties

    def plastic(self, k: Keyword, scope: Scope) -> None:
        if k.parameters.get("HARDENING", "ISOTROPIC").upper() != "ISOTROPIC" or "RATE" in k.parameters:
            raise FileError.at(k.line, "only isotropic hardening without rate or temperature is read; write HARDENING=ISOTROPIC")
        data = k.rows
        if len({tuple(row[2:]) for row in data}) > 1:
            raise FileError.at(k.line, "flow curves at several temperatures are not read; keep one")
        rows = [(k.number(row, 1, 0.0), k.number(row, 0)) for row in data]
        # Said here, where the line of the deck is known, and not only when the case is checked.
        for (line, _), (before, _), (now, _) in zip(islice(k.data, 1, None), rows, rows[1:]):
            if now <= before:
                raise FileError.at(line, f"plastic strains of a flow curve must increase: {now:g} after {before:g}")
        flow = {"type": "perfect", "s0": rows[0][1]} if len(rows) == 1 else {"type": "table", "points": [list(r) for r in rows]}
        self._of_material(k, {"type": "j2", "flow": flow})

    def density(self, k: Keyword, scope: Scope) -> None:
        self.densities[self.material] = k.number(k.rows[0], 0)

    def hyperelastic(self, k: Keyword, scope: Scope) -> None:
        if "NEO HOOKE" not in k.parameters:
            raise FileError.at(k.line, "of hyperelastic materials NEO HOOKE is read; choose 'neo_hooke' or 'elastic' in the case")
        row, *more = k.rows
        c10, d1 = k.number(row, 0), k.number(row, 1, 0.0)
        if more or d1 <= 0 or c10 <= 0:
            raise FileError.at(k.line, "NEO HOOKE is read with one row of C10 and D1, both above 0: bodies are compressible here")
        self._only_without("volume-law", k.line, "the volumetric energy (J − 1)²/D1 of NEO HOOKE is another one in 'neo_hooke'")
        mu, bulk = 2.0 * c10, 2.0 / d1
        nu = (3.0 * bulk - 2.0 * mu) / (6.0 * bulk + 2.0 * mu)
        self._of_material(k, {"type": "neo_hooke", "E": 2.0 * mu * (1.0 + nu), "nu": nu})

    def structure(self, k: Keyword, scope: Scope) -> None:
        wanted = k.parameters.get("ELSET", "")
        self.structures.append((k.line, k.name, self.all.elements_of(k.line, wanted, scope)))

    def solid_section(self, k: Keyword, scope: Scope) -> None:
        wanted = k.parameters.get("ELSET", "")
        self.names.sections.append(Section(scope, wanted, k.parameters.get("MATERIAL", "").upper(), k.line))
        thickness = next((k.number(row, 0, 1.0) for _, row in k.data), 1.0)
        if self.solid:
            return
        if self.case.get("space") != "axisymmetric" and self.case.setdefault("thickness", thickness) != thickness:
            raise FileError.at(
                k.line, f"a section of thickness {thickness:g} beside one of {self.case['thickness']:g}: a case has one thickness"
            )

    # ------------------------------------------------------------------------------------------------------- tools
    def surface(self, k: Keyword, scope: Scope) -> None:
        kind = k.parameters.get("TYPE", "ELEMENT").upper()
        if kind in SWEPT and self.solid:
            name = k.parameters.get("NAME", "")
            made = analytical(k, name, scope)
            made.name = self.names.tool_name(name, scope)
            self.names.tools[scope.name.upper(), name.upper()] = made
        elif kind == "SEGMENTS" and not self.solid:
            name = k.parameters.get("NAME", "")
            fillet = k.number([k.parameters.get("FILLET RADIUS", "")], 0, 0.0)
            if len(walk := [_moved(v, scope) for v in segments(k)]) < 2:
                raise FileError.at(k.line, f"the rigid surface {name!r} has no segment: write START, then LINE or CIRCL")
            tool = RigidTool(self.names.tool_name(name, scope), k.line, walk, fillet, True)
            self.names.tools[scope.name.upper(), name.upper()] = tool
        elif kind not in ("ELEMENT", "NODE"):
            write = "in space write CYLINDER or REVOLUTION" if self.solid else "in the plane write SEGMENTS"
            raise FileError.at(k.line, f"a surface of type {kind} is not read; {write}")

    def rigid_body(self, k: Keyword, scope: Scope) -> None:
        if k.parameters.get("POSITION", "INPUT").upper() != "INPUT":
            raise FileError.at(k.line, "POSITION=CENTER OF MASS is not read; write the reference node where it is to be")
        reference = self.names.node(k.line, k.parameters.get("REF NODE", ""), scope)
        wanted, labels = k.parameters.get("ELSET", ""), []
        for name in ("TIE NSET", "PIN NSET", "NSET"):
            if name in k.parameters and not (labels := self._rigid_by_nodes(k, scope, k.parameters[name])):
                # Nodes of deformable elements follow the reference node; pinned ones differ in rotations alone.
                follower = Follower(k.line, k.parameters[name], scope, "")
                self.names.follow(reference, follower, "xyzabc" if self.solid else "xyr")
            wanted = wanted or k.parameters.get(name, "") if labels else wanted
        if "ANALYTICAL SURFACE" in k.parameters:
            instance, dot, name = k.parameters["ANALYTICAL SURFACE"].upper().rpartition(".")
            key = (instance if dot else scope.name.upper(), name)
            if key not in self.names.tools:
                kinds = "CYLINDER or REVOLUTION" if self.solid else "SEGMENTS"
                raise FileError.at(k.line, f"there is no rigid surface {name!r} of TYPE={kinds} before this line")
        elif "ELSET" in k.parameters or labels:
            key = self._chain(k, scope, wanted, labels or self.all.elements_of(k.line, wanted, scope))
        else:
            return
        self.names.tools[key].reference = reference
        if "ROT NODE" in k.parameters:
            turning = self.names.node(k.line, k.parameters["ROT NODE"], scope)
            self.names.turning[turning] = self.names.tools[key].name

    def _rigid_by_nodes(self, k: Keyword, scope: Scope, wanted: str) -> list[int]:
        """Elements that a rigid set of nodes makes rigid: those with all their nodes in it, if no others have nodes of it."""
        nodes = set(self.all.places.nodes(wanted, scope, k.line))
        every = self.all.own | self.all.cells
        touched = [e for e, cell in every.items() if not nodes.isdisjoint(cell)]
        inside = [e for e in touched if nodes.issuperset(every[e])]
        if inside and len(inside) < len(touched):
            raise FileError.at(k.line, f"{wanted!r} has all nodes of some elements and some of others; write ELSET=…")
        return inside

    def _chain(self, k: Keyword, scope: Scope, wanted: str, labels: list[int]) -> tuple[str, str]:
        """The tool that rigid elements make: a chain of lines, or the outline of plane ones; in space their outer sides."""
        if self.solid:
            return self._facets(k, scope, wanted, labels)
        lines = [pair for e in labels if e in self.all.lines for pair in zip(self.all.lines[e], self.all.lines[e][1:])]
        cells = {e: self.all.cells[e] for e in labels if e in self.all.cells}
        if bool(lines) == bool(cells):
            raise FileError.at(k.line, "rigid bodies that are read are analytical surfaces (SEGMENTS), chains of line elements "
                               "(R2D2, RAX2, …), or plane elements")  # fmt: skip
        free = outline(side for e in cells for side in self.all.sides_of(e))
        sides = [pair for s in free for pair in ([(s[0], s[2]), (s[2], s[1])] if len(s) == 3 else [s])]
        middles = [self._middle(cell) for cell in cells.values()]
        where = next((s for s in self.all.instances.values() if s.offset == labels[0] // LABELS * LABELS), scope)
        name = self.names.tool_name(wanted.rpartition(".")[2], where)
        key = (where.name.upper(), f"*{wanted.upper()}")
        nodes = frozenset(n for e in (*lines, *cells.values()) for n in e)
        tool = RigidTool(name, k.line, [], None, False, nodes=nodes, solid=middles, edges=[*lines, *sides])
        tool.draw(self.all.nodes, [])  # to say at once that they make no chain
        self.names.tools[key] = tool
        self.names.rigid.update(labels)
        return key

    def _facets(self, k: Keyword, scope: Scope, wanted: str, labels: list[int]) -> tuple[str, str]:
        """The tool that rigid shells, or the outer sides of rigid bricks and tetrahedra, make in space."""
        shells, solids = ([e for e in labels if e in of] for of in (self.all.cells, self.all.own))
        if bool(shells) == bool(solids):
            raise FileError.at(k.line, "rigid bodies that are read are analytical surfaces (CYLINDER, REVOLUTION), shells (R3D3, "
                               "R3D4, S4, …), or bricks and tetrahedra")  # fmt: skip
        faces = [self.all.cells[e] for e in shells] or outline((s for e in solids for s in self.all.sides_of(e)), True)
        where = next((s for s in self.all.instances.values() if s.offset == labels[0] // LABELS * LABELS), scope)
        key = (where.name.upper(), f"*{wanted.upper()}")
        nodes = frozenset(n for e in (*shells, *solids) for n in (self.all.cells.get(e) or self.all.own[e]))
        name = self.names.tool_name(wanted.rpartition(".")[2], where)
        self.names.tools[key] = SpatialTool(name, k.line, [], None, False, nodes=nodes, faces=faces)
        self.names.rigid.update(labels)
        return key

    def equation(self, k: Keyword, scope: Scope) -> None:
        self.names.equation(k, scope)

    def coupling(self, k: Keyword, scope: Scope) -> None:
        if k.name == "COUPLING":
            self.coupled = k
            return
        if k.name == "KINEMATIC COUPLING":
            rows = [(row[0], row[1:]) for _, row in k.data]
            reference = k.parameters.get("REF NODE", "")
        elif self.coupled is not None:
            rows = [(self.coupled.parameters.get("SURFACE", ""), row) for _, row in k.data] or [
                (self.coupled.parameters.get("SURFACE", ""), ["1", "6"])
            ]
            reference = self.coupled.parameters.get("REF NODE", "")
        else:
            raise FileError.at(k.line, "*KINEMATIC belongs to no *COUPLING")
        node = self.names.node(k.line, reference, scope)
        for who, row in rows:
            first = int(k.number(row, 0, 1))
            last = int(k.number(row, 1, 6 if not row or not row[0] else first))
            # Nodes away from the reference node move when it turns: its rotation has to be held.
            known, turns = ("xyz", "abc") if self.solid else ("xy", "r")
            components = "".join(c for n, c in enumerate(known, 1) if first <= n <= last)
            self.names.follow(node, Follower(k.line, who, scope, ""), components + (turns if components else ""))

    # ---------------------------------------------------------------------------------------------------- contacts
    def surface_interaction(self, k: Keyword, scope: Scope) -> None:
        self.interaction = k.parameters.get("NAME", "").upper()
        self.frictions[self.interaction] = None
        self.stiffness[self.interaction] = {}

    def _interaction(self, k: Keyword) -> str:
        if self.interaction is None:
            raise FileError.at(k.line, f"*{k.name} belongs to no *SURFACE INTERACTION: write it right behind one")
        return self.interaction

    def surface_behavior(self, k: Keyword, scope: Scope) -> None:
        of = self._interaction(k)
        if "NO SEPARATION" in k.parameters:
            raise FileError.at(k.line, "NO SEPARATION is not read: contact here opens where it is pulled; take the word out")
        law = k.parameters.get("PRESSURE-OVERCLOSURE", "HARD").upper()
        if law == "TIED":
            raise FileError.at(k.line, "a contact that is TIED is not read; write *TIE")
        if law == "LINEAR":
            self.stiffness[of]["k_n"] = k.number(k.rows[0], 0)
        elif law != "HARD":
            self._only_without("softened-contact", k.line, f"PRESSURE-OVERCLOSURE={law} is not read; LINEAR and HARD are")

    def friction(self, k: Keyword, scope: Scope) -> None:
        of = self._interaction(k)
        if "ROUGH" in k.parameters:
            raise FileError.at(k.line, "ROUGH is not read; write a friction coefficient that lets nothing slip, such as 10.")
        if k.parameters.get("DEPENDENCIES") or "EXPONENTIAL DECAY" in k.parameters or "USER" in k.parameters:
            raise FileError.at(k.line, "only one friction coefficient is read; other laws are in the guide to friction")
        data = [row for _, row in k.data]
        if len(data) > 1:
            raise FileError.at(k.line, "a friction that depends on slip, pressure or temperature is not read; keep one number")
        row = data[0] if data else ["0"]
        mu, most = k.number(row, 0, 0.0), k.number([k.parameters.get("TAUMAX", "")], 0, 0.0)
        # CalculiX has the stick slope behind the coefficient; a rate of slip of Abaqus says nothing in a table of one row.
        if mu and len(row) == 2 and (slope := k.number(row, 1, 0.0)):
            self.stiffness[of]["k_T"] = slope
        law = {"type": "capped", "mu": mu, "m": 1.0, "k": most} if most else {"type": "coulomb", "mu": mu}
        self.frictions[of] = law if mu else None

    def contact_pair(self, k: Keyword, scope: Scope) -> None:
        if "TIED" in k.parameters:
            raise FileError.at(k.line, "a contact that is TIED is not read; write *TIE")
        if sum(before.name == "STEP" for before, _ in self.history) > 1:
            raise FileError.at(k.line, "a contact that begins in a later step is not read; contacts here are there at once")
        if "SMALL SLIDING" in k.parameters:
            self._only_without("small-sliding", k.line, "SMALL SLIDING is not read: contact here follows the sliding")
        adjust = k.parameters.get("ADJUST")
        # By zero only nodes inside of the master move, and an overlap at the start is reported in any case.
        if adjust is not None and not _is_zero(adjust):
            self._only_without("adjust", k.line, f"ADJUST={adjust} is not read: nodes here start where the mesh has them")
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
                k.line,
                f"initial conditions of type {kind or 'unknown'} are not read; bodies start at rest, without stress: take it out",
            )
        self.remarks.append(f"line {k.line}: temperatures are not read; there is no heat here")

    # ------------------------------------------------------------------------------------------------------ finish
    def finished(self) -> dict[str, Any]:
        """The case: names of bodies put before those of boundaries, once all is known."""
        for line, name, labels in self.structures:
            if not self.names.rigid.issuperset(labels):
                what = "shells" if self.solid and "BEAM" not in name else "lines"
                raise FileError.at(line, f"*{name}: {what} have no stiffness here; make them a rigid body, or take them out")
        if not any(k.name == "STEP" for k, _ in self.history):
            if first := next((k for k, _ in self.history if k.name in ("STATIC", "CLOAD", "DLOAD", "DSLOAD")), None):
                raise FileError.at(first.line, f"*{first.name} stands outside of any *STEP")
            raise FileError("the deck has no *STEP, so no process is described; 'mesh: {type: file}' reads its mesh")
        sections = self.names.bodies()
        for s in sections:
            self.case["bodies"][s.name] = self._body(s)
        self._contacts()
        for slave, master, line, scope in self.ties:
            sides = [self.names.support(line, who, scope, [who]) for who in (slave, master)]
            if any(len(side) > 1 for side in sides):
                raise FileError.at(line, "a side of a tie belongs to several bodies; write a tie for each pair of them")
            self.case["ties"].append({"slave": sides[0][0], "master": sides[1][0]})
        self._joined(sections)
        axis = [(0, 0.0)] if self.case.get("space") == "axisymmetric" else []
        symmetry = [] if self.solid else axis + self.names.lines_of_symmetry(self.history)
        for tool in self.names.tools.values():
            tool.draw(self.all.nodes, symmetry)
            self.case["tools"][tool.name] = self._tool(tool, sections)
        components = {"axisymmetric": "y", "solid": "xyzabc"}.get(self.case.get("space", ""), "xyr")
        tools = [t.name for t in self.names.tools.values()]
        loads = Loads(
            lambda scope, rows: self.names.sides_pressed(scope, rows), self._volumes, self._forced,
            lambda line, who, scope: self.all.places.nodes(who, scope, line), 3 if self.solid else 2,
        )  # fmt: skip
        steps = Steps(self.names, loads, tools, components, self.without)
        self.case["fixed"], self.case["steps"] = steps.read(self.history)
        self.names.refuse_undriven()
        self.remarks += steps.remarks
        # Abaqus is geometrically linear unless NLGEOM says otherwise; here finite strain is the default.
        if not steps.large:
            self.case["kinematics"] = "small"
        self._units()
        if self.case.get("thickness") == 1.0:
            del self.case["thickness"]  # the default
        return {key: self.case[key] for key in ORDER if self.case.get(key) not in (None, [], {})}

    def _contacts(self) -> None:
        for slave, master, interaction, line, scope in self.pairs:
            self._contact(slave, master, interaction, line, scope)
        if self.everywhere:
            interaction, line = self.everywhere
            if self.pairs:
                raise FileError.at(line, "general contact together with contact pairs is not read; write all as pairs")
            law = self._law(interaction, line)
            if friction := law.pop("friction", None):
                self.case["friction"] = friction
            if law:
                bodies, tools = self.names.bodies(), self.names.tools.values()
                self.case["contacts"] = [{"surface": s.name, "against": t.name, **law} for s in bodies for t in tools]
        elif not self.pairs:
            # A case without contacts has every tool against every body, which a deck without contact does not say.
            self.case["no_contact"] = [
                {"surface": s.name, "against": t.name} for s in self.names.bodies() for t in self.names.tools.values()
            ]

    def _law(self, interaction: str, line: int) -> dict[str, Any]:
        """Friction and enforcement of an interaction, as a contact has them."""
        if interaction and interaction not in self.frictions:
            raise FileError.at(line, f"there is no *SURFACE INTERACTION {interaction!r}")
        out: dict[str, Any] = {}
        if friction := self.frictions.get(interaction):
            out["friction"] = friction
        if stiffness := self.stiffness.get(interaction):
            out["enforcement"] = {"type": "penalty", **stiffness}
        return out

    def _volumes(self, line: int, who: str, scope: Scope) -> list[tuple[str, float | None]]:
        """Bodies of an element set, with the density of their material."""
        if not who and (mass := next((k for k, _ in self.all.order if k.name == "MASS"), None)):
            raise FileError.at(line, f"a load on all elements, *MASS of line {mass.line} among them: name the set of the body")
        material = {s.name: s.material for s in self.names.bodies()}
        return [(name, self.densities.get(material[name])) for name in self.names.volumes(line, who, scope)]

    def _forced(self, line: int, forces: dict[int, float]) -> list[tuple[str, float]]:
        """Boundary and traction that forces on nodes are."""
        nodes = frozenset(forces)
        name = self.names.group(line, nodes)
        owners = [s for s in self.names.bodies() if s.nodes & nodes]
        if len(owners) != 1:
            raise FileError.at(line, "these nodes belong to several bodies, or to none that deforms; write *DSLOAD")
        depth = None if self.case.get("space") == "axisymmetric" else self.case.get("thickness", 1.0)
        sides = [side for side in owners[0].free if nodes.issuperset(ends(side, self.solid))]
        if not self.solid and (whole := next((side for side in sides if not nodes.issuperset(side)), None)):
            forces = forces | {whole[2]: 0.0}
        forces = dict.fromkeys((n for side in sides for n in side), 0.0) | forces if self.solid else forces
        return [(f"{owners[0].name}.{name}", even_traction(line, forces, sides, self.all.nodes, depth, self.solid))]

    def _units(self) -> None:
        # Decks have no units: no metal has 1e9 MPa, and every metal has more than 1e9 Pa.
        stiffest = max((m.get("E", 0.0) for m in self.materials.values()), default=0.0)
        if stiffest >= METRES:
            self.case["units"] = {"length": "m", "force": "N"}
            self.remarks.append(f"units are taken to be m and N, because a modulus is {stiffest:g}; say so if they are not")

    def _body(self, s: Section) -> dict[str, Any]:
        if s.material not in self.materials or "E" not in self.materials[s.material]:
            raise FileError.at(s.line, f"the section's material {s.material!r} has no *ELASTIC before")
        mesh: dict[str, Any] = {"type": "file", "path": self.path}
        if s.cells != self.all.own.keys() or self.deck.exclusive:
            parts_of = self.deck.volumes if self.solid else self.deck.parts
            whole = next((n for n, cells in parts_of.items() if set(cells) == s.cells), None)
            parts = [o.scope.part_of.get(o.elset.upper(), o.elset) for o in (s, *s.joined)]
            mesh["part"] = whole or (parts if s.joined else parts[0])
        known = SOLID_ELEMENT_OF if self.solid else ELEMENT_OF
        elements = {known[kind[3:].removesuffix("T")] for e in s.cells if SPACE_OF.get((kind := self.deck.kinds[e])[:3])}
        if not elements:
            raise FileError.at(s.line, f"the section {s.elset!r} has no elements {'C3D' if self.solid else 'CPE, CPS or CAX'}")
        if self.solid and len(elements) > 1:
            raise FileError.at(s.line, f"a body has elements of one kind, {s.name!r} would have {' and '.join(sorted(elements))}")
        element = min(elements)
        if len(elements) > 1:
            if (counts := {len(self.deck.cells[e]) for e in s.cells}) not in ({3, 4}, {6, 8}):
                if len(counts) > 1:
                    raise FileError.at(s.line, f"{s.name!r} has linear and quadratic elements; mesh it with one order")
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
        if not master or master == slave:
            raise FileError.at(line, f"contact of {slave!r} with itself is not read; name a rigid surface that it meets")
        tool = self._tool_of(master, line, scope)
        if tool is None:
            tool, slave = self._tool_of(slave, line, scope), master
        if tool is None:
            raise FileError.at(
                line, f"{master!r} is not an analytical rigid surface, nor one of a rigid body: contact is between bodies and "
                "rigid tools; make the stiffer one rigid (*RIGID BODY, ELSET=…), or join them by *TIE"
            )  # fmt: skip
        law = self._law(interaction, line)
        for surface in self.names.support(line, slave, scope, [slave]):
            tool.surfaces.append(surface)
            if (surface, tool.name) in self.paired:
                raise FileError.at(line, f"the contact of {slave!r} and {master!r} is written before; keep one")
            self.paired.add((surface, tool.name))
            self.case["contacts"].append({"surface": surface, "against": tool.name, **law})

    def _joined(self, sections: list[Section]) -> None:
        """Tie bodies that have nodes in common, as sections of several materials in one mesh have."""
        single: list[tuple[Section, Section, int]] = []
        at: dict[int, list[set[str]]] = {}  # node → groups of bodies that ties join there
        for a, b in combinations(sections, 2):
            common = a.nodes & b.nodes
            sides = [side for side in a.free if common.issuperset(ends(side, self.solid))]
            on_sides = {n for side in sides for n in side}
            single += [(a, b, n) for n in sorted(common - on_sides)]
            if sides:
                name = self.all.places.name(common)
                self.case["ties"].append({"slave": f"{b.name}.{name}", "master": f"{a.name}.{name}"})
            for n in on_sides:
                groups = at.setdefault(n, [])
                touching = [g for g in groups if g & {a.name, b.name}]
                at[n] = [g for g in groups if g not in touching] + [{a.name, b.name}.union(*touching)]
        for a, b, n in single:
            if not any({a.name, b.name} <= group for group in at.get(n, ())):
                raise FileError.at(
                    b.line, f"{a.name!r} and {b.name!r} have node {n % LABELS} in common, and no side there: that is not a tie"
                )  # fmt: skip

    def _tool_of(self, who: str, line: int, scope: Scope) -> RigidTool | None:
        """The tool to which a surface belongs."""
        instance, dot, name = who.upper().rpartition(".")
        for (where, surface), tool in self.names.tools.items():
            if surface == name.strip('"') and (not dot or where == instance.strip('"')):
                return tool
        where_, key = self.all.seen_from(line, who, scope)
        nodes = {n for side in where_.surfaces.get(key, ()) for n in side} | set(where_.node_sets.get(key, ()))
        return next((t for t in self.names.tools.values() if nodes and nodes <= t.nodes), None)

    def _tool(self, tool: RigidTool, sections: list[Section]) -> dict[str, Any]:
        """A profile in the frame of its reference node, walked so that the surfaces it is to meet are outside."""
        if tool.reference is None:
            raise FileError.at(tool.line, f"the rigid surface {tool.name!r} has no *RIGID BODY with a reference node")
        # Profiles here are drawn in the frame of the tool's reference point, about which it turns.
        if isinstance(tool, SpatialTool):
            return self._spatial_tool(tool, sections, self.deck.nodes[tool.reference])
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

    def _spatial_tool(self, tool: SpatialTool, sections: list[Section], at: tuple[float, float, float]) -> dict[str, Any]:
        """A swept profile, or the STL file of rigid elements, in the frame of its reference node."""
        met = {n for s in tool.surfaces for n in self._nodes_of(s)}
        cells = [self.all.own[e] for s in sections for e in sorted(s.cells)]
        near = [[self.deck.nodes[n] for n in cell] for cell in cells if not met or met.intersection(cell)]
        bodies = np.array([np.mean(places, axis=0) for places in near]).reshape(-1, 3)
        reference = np.array(at)
        if tool.kind:
            return {**tool.swept(reference, bodies), "at": list(at)}
        if self.files is None:
            raise FileError.at(tool.line, f"the rigid elements of {tool.name!r} become an STL file: give --out")
        file = f"{Path(self.path).stem}-{tool.name}.stl"
        self.files[file] = tool.triangles(self.deck.nodes, reference, bodies)
        what = "are the triangles of {file}, which are read as curved patches"
        self.remarks.append(f"line {tool.line}: the rigid elements of {tool.name!r} {what.format(file=file)}")
        return {"type": "stl", "file": file, "at": list(at)}

    def _nodes_of(self, boundary: str) -> set[int]:
        name = boundary.partition(".")[2]
        return {n for side in self.deck.lines.get(name, ()) for n in side} | set(self.deck.points.get(name, ()))

    def _middle(self, cell: tuple[int, ...]) -> tuple[float, float]:
        places = [self.deck.nodes[n] for n in cell if n in self.deck.nodes]
        if not places:
            return 0.0, 0.0  # of a cell without nodes, which the mesh reports
        return sum(p[0] for p in places) / len(places), sum(p[1] for p in places) / len(places)


def _moved(vertex: Any, scope: Scope) -> Any:
    if isinstance(vertex, dict):
        return {"through": scope.moved(*vertex["through"]), "to": scope.moved(*vertex["to"])}
    return scope.moved(*vertex)


def _is_zero(word: str) -> bool:
    try:
        return float(word) == 0.0
    except ValueError:
        return False


ORDER = (
    "name", "units", "space", "thickness", "kinematics", "friction", "bodies", "tools", "contacts", "no_contact", "ties", "fixed",
    "steps",
)  # fmt: skip
METHOD_OF = {
    "HEADING": "heading", "ELEMENT": "element", "MATERIAL": "material_", "ELASTIC": "elastic", "PLASTIC": "plastic",
    "DENSITY": "density", "HYPERELASTIC": "hyperelastic", "EQUATION": "equation", "COUPLING": "coupling",
    "KINEMATIC": "coupling", "KINEMATIC COUPLING": "coupling", "BEAM SECTION": "structure", "BEAM GENERAL SECTION": "structure",
    "SHELL SECTION": "structure", "SHELL GENERAL SECTION": "structure", "MEMBRANE SECTION": "structure",
    "SOLID SECTION": "solid_section", "SURFACE": "surface", "RIGID BODY": "rigid_body",
    "SURFACE INTERACTION": "surface_interaction", "SURFACE BEHAVIOR": "surface_behavior", "FRICTION": "friction",
    "CONTACT PAIR": "contact_pair", "CONTACT INCLUSIONS": "inclusions", "CONTACT PROPERTY ASSIGNMENT": "property_assignment",
    "TIE": "tie", "INITIAL CONDITIONS": "initial_conditions",
}  # fmt: skip

def case_of(
    text: str | Whole, path: str, without: frozenset[str] = frozenset(), files: dict[str, str] | None = None
) -> tuple[dict[str, Any], list[str]]:  # fmt: skip
    """The case that a deck describes, as a case file has it, and remarks about what was passed over.

    path: of the deck, as the case is to name it for the mesh. without: what to leave out, names of `LEFT_OUT` or keywords that
    are unknown here. files: receives names and texts of the files that stand beside the case.

    Raises
    ------
    FileError
        For what concerns the answer and is not read, with its line; for something that cannot be left out.

    """
    without = frozenset(squeezed(w) if w.lower() not in LEFT_OUT else w.lower() for w in without)
    reader = _Reader(text if isinstance(text, Whole) else Whole(text), path, without, files)
    unknown = {squeezed(k.name) for k, _ in reader.all.order if k.name not in KNOWN}
    if wrong := sorted(without - LEFT_OUT.keys() - unknown):
        raise FileError(f"--without {wrong[0].lower()!r}: this cannot be left out; what can is: {may_be_left_out()}")
    reader.read()
    return reader.finished(), reader.remarks
