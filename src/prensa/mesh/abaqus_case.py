"""A case out of an Abaqus (or CalculiX) deck: materials, sections, analytical rigid surfaces, contact pairs, steps.

A documented subset: what concerns the answer and is not read is refused with its line; what does not is told.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import atan2, cos, hypot, inf, isfinite, pi, sin
from pathlib import Path
from typing import Any

from prensa.mesh.abaqus import Keyword, keywords, read
from prensa.mesh.deck import Deck, FileError

SPACE_OF = {
    "CPE": "plane strain", "CPS": "plane stress", "CAX": "axisymmetric",
}  # fmt: skip
ELEMENT_OF = {
    "4": "q4_fbar", "4R": "q4_fbar", "4H": "q4_fbar", "4RH": "q4_fbar", "4I": "q4_enhanced", "4IH": "q4_enhanced",
    "3": "t3", "6": "t6", "6M": "t6", "6H": "t6", "6MH": "t6", "8": "q8_full", "8R": "q8", "8H": "q8_full", "8RH": "q8",
}  # fmt: skip
PASSED_OVER = {
    "HEADING", "PREPRINT", "PART", "END PART", "ASSEMBLY", "END ASSEMBLY", "INSTANCE", "END INSTANCE", "NODE", "ELEMENT",
    "NSET", "ELSET", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "NODE PRINT", "EL PRINT", "NODE FILE",
    "EL FILE", "CONTACT PRINT", "CONTACT FILE", "RESTART", "END STEP", "MONITOR", "FILE FORMAT", "SURFACE BEHAVIOR",
    "CONTACT CONTROLS", "CONTROLS", "DENSITY", "PRINT", "ENERGY PRINT", "ENERGY OUTPUT",
}  # fmt: skip
HELD_BY = {"XSYMM": "x", "YSYMM": "y", "ENCASTRE": "xy", "PINNED": "xy"}


@dataclass
class _Tool:
    name: str
    line: int
    vertices: list[Any]
    fillet: float
    reference: int | None = None
    surfaces: list[str] = field(default_factory=list)


class _Reader:
    """What has been read so far; one method for each keyword that matters."""

    def __init__(self, text: str, path: str) -> None:
        self.path, self.deck = path, read(text)
        self.case: dict[str, Any] = {"name": Path(path).stem, "bodies": {}, "tools": {}, "contacts": [], "fixed": {}, "steps": []}
        self.remarks: list[str] = []
        self.materials: dict[str, dict[str, Any]] = {}
        self.material = ""
        self.sections: list[tuple[str, str, int]] = []
        self.element_of: dict[str, str] = {}
        self.tools: dict[str, _Tool] = {}
        self.frictions: dict[str, dict[str, Any] | None] = {}
        self.interaction = ""
        self.pairs: list[tuple[str, str, str, int]] = []
        self.amplitudes: dict[str, list[tuple[float, float]]] = {}
        self.step: dict[str, Any] | None = None
        self.pressed: dict[tuple[str, str], float] = {}

    # ------------------------------------------------------------------------------------------------------- model
    def heading(self, k: Keyword) -> None:
        words = " ".join(text for _, text in k.lines).strip()
        if words:
            self.case["name"] = words[:80]

    def element(self, k: Keyword) -> None:
        kind = k.parameters.get("TYPE", "").upper()
        space = SPACE_OF.get(kind[:3])
        if space is None:
            return  # of a set that is no section, or refused there
        if self.case.setdefault("space", space) != space:
            raise FileError.at(k.line, f"elements {kind} are of {space}, those before of {self.case['space']}")
        element = ELEMENT_OF.get(kind[3:])
        if element is None:
            raise FileError.at(k.line, f"elements {kind} have no counterpart here; take {kind[:3]}4")
        if space == "plane stress" and element == "q4_fbar":
            element = "q4"
        self.element_of[k.parameters.get("ELSET", "").upper()] = element

    def material_(self, k: Keyword) -> None:
        self.material = k.parameters.get("NAME", "").upper()
        self.materials[self.material] = {"type": "elastic"}

    def elastic(self, k: Keyword) -> None:
        if not k.parameters.get("TYPE", "ISOTROPIC").upper().startswith("ISO"):
            raise FileError.at(k.line, "only isotropic elasticity is read")
        row, *more = _rows(k)
        if more:
            raise FileError.at(k.line, "an elasticity that depends on temperature is not read; leave one row")
        self._of_material(k, {"E": _number(k, row, 0), "nu": _number(k, row, 1)})

    def _of_material(self, k: Keyword, properties: dict[str, Any]) -> None:
        if self.material not in self.materials:
            raise FileError.at(k.line, f"*{k.name} belongs to no material: write *MATERIAL, NAME=… before it")
        self.materials[self.material] |= properties

    def plastic(self, k: Keyword) -> None:
        if k.parameters.get("HARDENING", "ISOTROPIC").upper() != "ISOTROPIC" or "RATE" in k.parameters:
            raise FileError.at(k.line, "only isotropic hardening without rate or temperature is read")
        rows = [(_number(k, row, 1, 0.0), _number(k, row, 0)) for row in _rows(k)]
        flow = {"type": "perfect", "s0": rows[0][1]} if len(rows) == 1 else {"type": "table", "points": [list(r) for r in rows]}
        self._of_material(k, {"type": "j2", "flow": flow})

    def solid_section(self, k: Keyword) -> None:
        self.sections.append((k.parameters.get("ELSET", ""), k.parameters.get("MATERIAL", "").upper(), k.line))
        thickness = next((_number(k, row, 0, 1.0) for _, row in k.data), 1.0)
        if thickness != 1.0 and self.case.get("space") != "axisymmetric":
            self.case["thickness"] = thickness

    def surface(self, k: Keyword) -> None:
        kind = k.parameters.get("TYPE", "ELEMENT").upper()
        if kind == "SEGMENTS":
            name = k.parameters.get("NAME", "")
            fillet = _number(k, [k.parameters.get("FILLET RADIUS", "")], 0, 0.0)
            if len(walk := list(_segments(k))) < 2:
                raise FileError.at(k.line, f"the rigid surface {name!r} has no segment: write START, then LINE or CIRCL")
            self.tools[name.upper()] = _Tool(name, k.line, walk, fillet)
        elif kind not in ("ELEMENT", "NODE"):
            raise FileError.at(k.line, f"a surface of type {kind} is not read; in the plane write SEGMENTS")

    def rigid_body(self, k: Keyword) -> None:
        surface = k.parameters.get("ANALYTICAL SURFACE", "").upper()
        if surface not in self.tools:
            raise FileError.at(k.line, "only rigid bodies with an analytical surface of TYPE=SEGMENTS, given before, are tools")
        self.tools[surface].reference = self._node(k, k.parameters.get("REF NODE", ""))

    def surface_interaction(self, k: Keyword) -> None:
        self.interaction = k.parameters.get("NAME", "").upper()
        self.frictions[self.interaction] = None

    def friction(self, k: Keyword) -> None:
        row = next((row for _, row in k.data), ["0"])
        mu, most = _number(k, row, 0, 0.0), _number(k, [k.parameters.get("TAUMAX", "")], 0, 0.0)
        if most:
            raise FileError.at(k.line, "TAUMAX is not read; write 'capped' friction with a shear factor into the case instead")
        self.frictions[self.interaction] = {"type": "coulomb", "mu": mu} if mu else None

    def contact_pair(self, k: Keyword) -> None:
        for line, words in k.data:
            self.pairs.append((words[0], words[1] if len(words) > 1 else "", k.parameters.get("INTERACTION", "").upper(), line))

    def amplitude(self, k: Keyword) -> None:
        numbers = [_number(k, row, n) for row in _rows(k) for n, w in enumerate(row) if w]
        if len(numbers) % 2:
            raise FileError.at(k.line, "an amplitude has pairs of a time and a factor; one is left over here")
        self.amplitudes[k.parameters.get("NAME", "").upper()] = list(zip(numbers[::2], numbers[1::2]))

    # ------------------------------------------------------------------------------------------------------- steps
    def step_(self, k: Keyword) -> None:
        number = len(self.case["steps"]) + 1
        self.step = {"name": k.parameters.get("NAME", f"step {number}"), "_duration": 1.0}
        self.case["steps"].append(self.step)
        if number == 1 and k.parameters.get("NLGEOM", "NO").upper() == "NO" and "NLGEOM" not in k.parameters:
            self.case["kinematics"] = "small"

    def static(self, k: Keyword) -> None:
        if self.step is None:
            raise FileError.at(k.line, "*STATIC stands outside of any *STEP")
        row = next((row for _, row in k.data), [])
        first, whole = _number(k, row, 0, 1.0), _number(k, row, 1, 1.0)
        if whole <= 0 or first < 0:
            raise FileError.at(k.line, f"a step of {whole:g} with increments of {first:g} lasts no time")
        self.step["_duration"] = whole
        if "DIRECT" in k.parameters and first > 0:
            self.step["increments"] = max(1, round(whole / first))
        if "STABILIZE" in k.parameters:
            self.step["stabilise"] = "auto"

    def boundary(self, k: Keyword) -> None:
        if "FIXED" in k.parameters:
            raise FileError.at(k.line, "FIXED is not read; a support that is not mentioned stays as it is")
        for line, words in k.data:
            self._held(k, line, words)

    def _held(self, k: Keyword, line: int, words: list[str]) -> None:
        who = words[0]
        tool = self._tool_at(k, who)
        named = words[1].upper() if len(words) > 1 else ""
        if named in HELD_BY:
            dofs, value = HELD_BY[named], 0.0
        else:
            first = _whole(line, named or "1")
            last = _whole(line, words[2]) if len(words) > 2 and words[2] else first
            dofs = "".join(c for n, c in ((1, "x"), (2, "y"), (6, "r")) if first <= n <= last)
            value = _number(k, words, 3, 0.0)
        rate = k.parameters.get("TYPE", "DISPLACEMENT").upper()
        if rate == "VELOCITY" and self.step is not None:
            value *= self.step["_duration"]
        elif rate != "DISPLACEMENT":
            raise FileError.at(line, f"a boundary condition of type {rate} is not read")
        table = self._table(k, value)
        if tool is not None:
            if self.step is not None and (value or table):
                keys = {"x": "x", "y": "y", "r": "rz"}
                motion = self.step.setdefault("move", {}).setdefault(tool.name, {})
                motion.update({keys[c]: table or value for c in dofs})
            return
        where = self._boundary_named(line, who)
        into = self.case["fixed"] if self.step is None else self.step.setdefault("fixed", {})
        if not value and not table:
            held = into.setdefault(where, "")
            if isinstance(held, str):
                into[where] = "".join(c for c in "xy" if c in held or c in dofs)
            else:
                held.update({c: 0.0 for c in dofs if c in "xy"})
        else:
            before = into.get(where, {})
            before = dict.fromkeys(before, 0.0) if isinstance(before, str) else before
            into[where] = before | {c: table or value for c in dofs if c in "xy"}

    def cload(self, k: Keyword) -> None:
        for line, words in k.data:
            tool = self._tool_at(k, words[0])
            if tool is None:
                raise FileError.at(line, "forces are read on reference nodes of rigid bodies only; use *DSLOAD")
            key = {1: "x", 2: "y", 6: "m"}.get(_whole(line, words[1] if len(words) > 1 else ""))
            if key is not None and self.step is not None:
                value = _number(k, words, 2)
                self.step.setdefault("push", {}).setdefault(tool.name, {})[key] = self._table(k, value) or value

    def dsload(self, k: Keyword) -> None:
        for line, words in k.data:
            if words[1:2] not in (["P"], ["p"]) or self.step is None:
                raise FileError.at(line, "of loads on surfaces pressure (P) in a step is read")
            where, value = self._boundary_named(line, words[0]), _number(k, words, 2)
            self.step.setdefault("loads", {})[where] = {"pressure": self._table(k, value) or value}

    # ------------------------------------------------------------------------------------------------------- names
    def _table(self, k: Keyword, value: float) -> list[list[float]] | None:
        name = k.parameters.get("AMPLITUDE", "").upper()
        if not name or self.step is None or not value:
            return None  # nothing stretched is nothing
        if name not in self.amplitudes:
            raise FileError.at(k.line, f"there is no amplitude {name!r} before this line")
        whole, start = self.step["_duration"], len(self.case["steps"]) - 1
        return [[start + t / whole, value * a] for t, a in self.amplitudes[name]]

    def _node(self, k: Keyword, who: str) -> int:
        members = next((v for n, v in self.deck.points.items() if n.upper() == who.upper()), None)
        if members and len(members) == 1:
            return members[0]
        if who.isascii() and who.isdigit() and len(who) < 10 and int(who) in self.deck.nodes:
            return int(who)
        raise FileError.at(k.line, f"{who!r} is no single node")

    def _tool_at(self, k: Keyword, who: str) -> _Tool | None:
        try:
            node = self._node(k, who.rpartition(".")[2])
        except FileError:
            return None
        return next((t for t in self.tools.values() if t.reference == node), None)

    def _boundary_named(self, line: int, who: str) -> str:
        name = who.rpartition(".")[2]
        for known in (*self.deck.lines, *self.deck.points):
            if known.upper() == name.upper():
                return known
        raise FileError.at(line, f"{who!r} is no set of nodes or surface of this deck")


METHOD_OF = {
    "HEADING": "heading", "ELEMENT": "element", "MATERIAL": "material_", "ELASTIC": "elastic", "PLASTIC": "plastic",
    "SOLID SECTION": "solid_section", "SURFACE": "surface", "RIGID BODY": "rigid_body",
    "SURFACE INTERACTION": "surface_interaction", "FRICTION": "friction", "CONTACT PAIR": "contact_pair",
    "AMPLITUDE": "amplitude", "STEP": "step_", "STATIC": "static", "BOUNDARY": "boundary", "CLOAD": "cload", "DSLOAD": "dsload",
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
    for k in keywords(text):
        if k.name in METHOD_OF:
            getattr(reader, METHOD_OF[k.name])(k)
        elif k.name not in PASSED_OVER:
            reader.remarks.append(f"line {k.line}: *{k.name} is not read")
    return _finished(reader), reader.remarks


def _finished(r: _Reader) -> dict[str, Any]:
    """Bodies, contacts and names of boundaries, once all is known."""
    if not r.sections:
        raise FileError("the deck has no *SOLID SECTION: nothing says of what the elements are made")
    for elset, material, line in r.sections:
        if material not in r.materials or "E" not in r.materials[material]:
            raise FileError.at(line, f"the section's material {material!r} has no *ELASTIC before")
        name = elset or "body"
        mesh: dict[str, Any] = {"type": "file", "path": r.path}
        if len(r.sections) > 1:
            mesh["part"] = elset
        body: dict[str, Any] = {"mesh": mesh, "material": r.materials[material]}
        element = r.element_of.get(elset.upper()) or next(iter(r.element_of.values()), None)
        if element is not None:
            body["element"] = element
        r.case["bodies"][name] = body
    for slave, master, interaction, line in r.pairs:
        tool = r.tools.get(master.rpartition(".")[2].upper())
        if tool is None:
            raise FileError.at(line, f"{master!r} is no analytical rigid surface: contact is between bodies and rigid tools")
        surface = r._boundary_named(line, slave)
        tool.surfaces.append(surface)
        contact: dict[str, Any] = {"surface": _of_body(r, surface, line), "against": tool.name}
        if friction := r.frictions.get(interaction):
            contact["friction"] = friction
        r.case["contacts"].append(contact)
    for tool in r.tools.values():
        r.case["tools"][tool.name] = _described(r.deck, tool)
    r.case["fixed"] = {_of_body(r, name, 0): value for name, value in r.case["fixed"].items()}
    for step in r.case["steps"]:
        step.pop("_duration")
        for key in ("fixed", "loads"):
            if key in step:
                step[key] = {_of_body(r, name, 0): value for name, value in step[key].items()}
    return {key: value for key, value in r.case.items() if value not in ([], {})}


def _of_body(r: _Reader, boundary: str, line: int) -> str:
    """'body.boundary': the body whose elements have most of its nodes."""
    nodes = {n for group in r.deck.lines.get(boundary, ()) for n in group} | set(r.deck.points.get(boundary, ()))
    if len(r.sections) == 1:
        return f"{next(iter(r.case['bodies']))}.{boundary}"
    best, most = "", 0
    for elset, _, _ in r.sections:
        own = next((cells for part, cells in r.deck.parts.items() if part.upper() == elset.upper()), [])
        shared = len(nodes & {n for cell in own for n in r.deck.cells[cell]})
        if shared > most:
            best, most = elset, shared
    if not best:
        raise FileError(f"{boundary!r} belongs to none of the sections" + (f" (line {line})" if line else ""))
    return f"{best}.{boundary}"


def _described(deck: Deck, tool: _Tool) -> dict[str, Any]:
    """A profile in the frame of its reference node, walked so that the surfaces it is to meet are outside."""
    if tool.reference is None:
        raise FileError.at(tool.line, f"the rigid surface {tool.name!r} has no *RIGID BODY with a reference node")
    x0, y0, _ = deck.nodes[tool.reference]
    met = {n for s in tool.surfaces for g in deck.lines.get(s, ()) for n in g}
    met |= {n for s in tool.surfaces for n in deck.points.get(s, ())}
    places = [deck.nodes[n][:2] for cell in deck.cells.values() if met.intersection(cell) for n in cell if n in deck.nodes]
    walk = tool.vertices
    if places and _on_the_left(walk, places):
        walk = _reversed(walk)

    def moved(x: tuple[float, float]) -> list[float]:
        return [round(x[0] - x0, 12), round(x[1] - y0, 12)]

    points = [{"through": moved(v["through"]), "to": moved(v["to"])} if isinstance(v, dict) else moved(v) for v in walk]
    return {"type": "profile", "points": points, "fillet": tool.fillet, "at": [x0, y0]}


def _on_the_left(walk: list[Any], places: list[tuple[float, float]]) -> bool:
    """Whether the middle of the elements that the tool is to meet lies on the left of the nearest of its segments."""
    mx, my = (sum(p[i] for p in places) / len(places) for i in (0, 1))
    ends = [v["to"] if isinstance(v, dict) else v for v in walk]
    mids = [
        (v["through"] if isinstance(v, dict) else (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])), a, b)
        for v, a, b in zip(walk[1:], ends, ends[1:])
    ]
    middle, a, b = min(mids, key=lambda m: hypot(m[0][0] - mx, m[0][1] - my))
    return (b[0] - a[0]) * (my - middle[1]) - (b[1] - a[1]) * (mx - middle[0]) > 0.0


def _reversed(walk: list[Any]) -> list[Any]:
    ends = [v["to"] if isinstance(v, dict) else v for v in walk]
    out: list[Any] = [ends[-1]]
    for v, to in zip(reversed(walk), reversed(ends[:-1])):
        out.append({"through": v["through"], "to": to} if isinstance(v, dict) else to)
    return out


def _segments(k: Keyword) -> Iterator[Any]:
    """Vertices of START, LINE and CIRCL rows; an arc is the shorter one about its centre."""
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
            sweep = (atan2(by - cy, bx - cx) - first + pi) % (2 * pi) - pi
            r, middle = hypot(bx - cx, by - cy), first + 0.5 * sweep
            at = (bx, by)
            yield {"through": (cx + r * cos(middle), cy + r * sin(middle)), "to": at}
        elif kind in ("START", "LINE") and len(x) == 2:
            at = (x[0], x[1])
            yield at
        else:
            raise FileError.at(line, f"{', '.join(words)[:60]!r} is not START x, y; LINE x, y or CIRCL x, y, centre x, centre y")


def _number(k: Keyword, row: list[str], place: int, default: float | None = None) -> float:
    if len(row) <= place or not row[place]:
        if default is None:
            raise FileError.at(k.line, f"*{k.name} has no value number {place + 1}")
        return default
    try:
        value = float(row[place].upper().replace("D", "E"))
    except ValueError:
        value = inf
    if not isfinite(value):
        raise FileError.at(k.line, f"{row[place][:60]!r} of *{k.name} is no number")
    return value


def _whole(line: int, word: str) -> int:
    if not (word.isascii() and word.isdigit()) or len(word) > 9:
        raise FileError.at(line, f"{word[:60]!r} is no number of a degree of freedom")
    return int(word)


def _rows(k: Keyword) -> list[list[str]]:
    rows = [row for _, row in k.data]
    if not rows:
        raise FileError.at(k.line, f"*{k.name} has no data line")
    return rows
