"""Steps of Abaqus decks: supports, motions and forces of tools, pressures, as they follow one another."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, field
from math import hypot, nan
from typing import Any, Protocol

from prensa.importers.abaqus import Assembly
from prensa.importers.abaqus_keywords import Keyword, Scope
from prensa.importers.abaqus_loads import Loads
from prensa.importers.abaqus_places import rows_alike
from prensa.importers.deck import FileError, is_label

OF_STEPS = ("AMPLITUDE", "STEP", "STATIC", "BOUNDARY", "CLOAD", "DLOAD", "DSLOAD")
# Of the words for supports those that say nothing in the plane are empty; the antisymmetric ones hold what lies in it.
HELD_IN_SPACE = {
    "XSYMM": "xbc", "YSYMM": "yac", "ZSYMM": "zab", "XASYMM": "yza", "YASYMM": "xzb", "ZASYMM": "xyc", "ENCASTRE": "xyzabc",
    "PINNED": "xyz",
}  # fmt: skip
"""Components x, y, z and rotations a, b, c about them."""
HELD_BY = {
    "XSYMM": "x", "YSYMM": "y", "ZSYMM": "", "XASYMM": "y", "YASYMM": "x", "ZASYMM": "xyr", "ENCASTRE": "xyr", "PINNED": "xy",
}  # fmt: skip
KEY_OF = {"x": "x", "y": "y", "z": "z", "r": "rz", "a": "rx", "b": "ry", "c": "rz"}
FORCE_OF = {"x": "x", "y": "y", "z": "z", "r": "m", "a": "mx", "b": "my", "c": "mz"}
TURNS = "rabc"


@dataclass
class Follower:
    """Boundaries (with their ``scope`` and ``who`` in the deck) that follow a node along ``c``, ``factor`` times its motion.

    ``members``: the nodes that move alike where they follow a set. ``terms``: of an equation, of which it is one; the motion is
    their sum. ``way``: its own share in the last step that changes it, times of the case and values; ``ramp``: without amplitude.
    """

    line: int
    who: str
    scope: Scope
    c: str
    factor: float = 1.0
    driven: bool = False
    members: frozenset[int] = frozenset()
    terms: list[Follower] = field(default_factory=list)
    way: list[tuple[float, float]] = field(default_factory=list)
    ramp: bool = True


class Names(Protocol):
    """What a reader of cases knows about the names of a deck."""

    all: Assembly

    def tools_at(self, line: int, who: str, scope: Scope) -> tuple[list[tuple[str, bool]], bool]:
        """Tools of the reference nodes of a set, each with whether it is their ``ROT NODE``; whether there are other nodes."""
        ...

    def support(self, line: int, who: str, scope: Scope, rows: list[str]) -> list[str]:
        """The boundaries that a set is, of all bodies that have nodes of it; ``rows``: all numbers of a group of nodes."""
        ...

    def followers(self, line: int, who: list[str], scope: Scope) -> list[Follower]:
        """What follows the nodes of sets and numbers."""
        ...

    def in_body(self, line: int, who: str, scope: Scope) -> bool:
        """Whether a set has nodes of bodies."""
        ...

    def along(self, line: int, who: str, scope: Scope, way: tuple[float, ...]) -> bool:
        """Whether all sides of a surface are parallel to a direction."""
        ...


class Steps:
    """What happens, step by step.

    A deck says in every step what changes; with ``OP=NEW`` all that holds from then on. What held before is known here, so
    that what is not said again can be released. ``large``: whether displacements are, in any step. ``components``: what tools
    can do; those that a deck neither prescribes nor pushes are free, and are named in ``remarks``.
    """

    def __init__(self, names: Names, loads: Loads, tools: list[str], components: str, without: Container[str]) -> None:
        self.names_of, self.loads, self.tools, self.components, self.without = names, loads, tools, components, without
        self.solid = "z" in components
        self.axes, self.held_by = ("xyz", HELD_IN_SPACE) if self.solid else ("xy", HELD_BY)
        self.remarks: list[str] = []
        self.large = False
        self.fixed: dict[str, dict[str, Any]] = {}
        self.steps: list[dict[str, Any]] = []
        self.names: dict[str, int] = {}  # of steps → line
        self.amplitudes: dict[str, tuple[list[tuple[float, float]], bool]] = {}
        self.passed = 0.0  # time of the steps before
        self.duration = 1.0
        self.held: dict[tuple[str, str], float] = {}  # (boundary, component) → displacement
        self.led: dict[tuple[str, str], int] = {}  # (boundary, component) that follows a node → line of its constraint
        self.places: dict[tuple[str, str], float] = {}  # (tool, component) → displacement
        self.pushed: dict[tuple[str, str], float] = {}
        self.stale: dict[str, set[Any]] = {}  # keyword with OP=NEW → what it has not said again

    def read(self, history: list[tuple[Keyword, Scope]]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Supports before the first step, and the steps, as a case has them.

        Raises
        ------
        FileError
            For what concerns the answer and is not read, with its line.

        """
        for k, scope in history:
            method = {
                "AMPLITUDE": self._amplitude, "STEP": self._begin, "STATIC": self._static, "BOUNDARY": self._boundary,
                "CLOAD": self._cload, "DLOAD": self._dload, "DSLOAD": self._dsload,
            }[k.name]  # fmt: skip
            method(k, scope)
        self._close()
        for step in self.steps:
            for part in ("fixed", "loads", "body_force", "move", "velocity", "push"):
                if part in step and not step[part]:
                    del step[part]
            if "fixed" in step:
                step["fixed"] = _short(step["fixed"])
        return _short(self.fixed), self.steps

    @property
    def _step(self) -> dict[str, Any] | None:
        return self.steps[-1] if self.steps else None

    def _amplitude(self, k: Keyword, scope: Scope) -> None:
        kind, value = k.parameters.get("DEFINITION", "TABULAR").upper(), k.parameters.get("VALUE", "RELATIVE").upper()
        if kind == "SMOOTH STEP" and "inertia" in self.without:
            self.remarks.append(f"line {k.line}: SMOOTH STEP is there against inertia: straight between its points here")
            kind = "TABULAR"
        if kind != "TABULAR" or value != "RELATIVE":
            raise FileError.at(k.line, f"an amplitude {kind}, {value} is not read; write a table of times and factors (TABULAR)")
        numbers = [k.number(row, n) for row in k.rows for n, w in enumerate(row) if w]
        if len(numbers) % 2:
            raise FileError.at(k.line, "an amplitude has pairs of a time and a factor; one is left over here")
        total = k.parameters.get("TIME", "STEP TIME").upper().startswith("TOTAL")
        self.amplitudes[k.parameters.get("NAME", "").upper()] = (list(zip(numbers[::2], numbers[1::2])), total)

    def _close(self) -> None:
        """End a step: what OP=NEW has not said again is released."""
        step = self._step
        if step is None:
            return
        for what in self.stale.pop("BOUNDARY", ()):
            # A support that is released leaves the others of the same boundary held: 'free' would release all.
            name, c = what
            if what in self.led:
                raise FileError.at(self.led[what], "what these nodes follow is released in a later step by OP=NEW, which is not "
                                   "read; write its motion again in that step")  # fmt: skip
            if what in self.held:
                del self.held[what]
                entry = step["fixed"].setdefault(name, {})
                entry["free"] = True
                for other in self.axes:
                    if (name, other) in self.held:
                        entry.setdefault(other, "held")
            else:
                # A tool whose motion is released is free to move: a force of zero, not a place.
                del self.places[what]
                step["push"].setdefault(name, {}).setdefault(FORCE_OF[c], 0.0)
                self.pushed[name, c] = 0.0
        for name, c in self.stale.pop("CLOAD", ()):
            # A tool that got a motion in this step is no longer pushed, and needs no force of zero.
            if self.pushed.pop((name, c), None) and (name, c) not in self.places:
                step["push"].setdefault(name, {})[FORCE_OF[c]] = 0.0
        self.loads.close(step)
        if len(self.steps) == 1:
            self._free(step)
        self.passed += self.duration

    def _free(self, step: dict[str, Any]) -> None:
        """What the deck neither prescribes nor pushes of a tool is free; here it would be held."""
        for name in self.tools:
            for c in self.components:
                if (name, c) not in self.places and (name, c) not in self.pushed:
                    step["push"].setdefault(name, {})[FORCE_OF[c]] = 0.0
                    self.pushed[name, c] = 0.0
                    how = "turn" if c == "r" else f"turn about {KEY_OF[c][1]}" if c in TURNS else f"move along {c}"
                    self.remarks.append(f"{name} is free to {how}, since the deck prescribes nothing there")

    def _begin(self, k: Keyword, scope: Scope) -> None:
        self._close()
        name = k.parameters.get("NAME", f"step {len(self.steps) + 1}")
        if "PERTURBATION" in k.parameters:
            raise FileError.at(k.line, "a step of PERTURBATION is not read; write a general one")
        if k.parameters.get("AMPLITUDE", "RAMP").upper() != "RAMP":
            raise FileError.at(k.line, "AMPLITUDE=STEP of a step is not read: here loads grow along it; write RAMP")
        large = self.large or k.parameters.get("NLGEOM", "NO").upper() != "NO"
        if large and not self.large and self.steps:
            raise FileError.at(k.line, "NLGEOM begins in a later step: a case has one kinematics; write it into the first step")
        self.large = large
        if name in self.names:
            other = self.names[name]
            raise FileError.at(k.line, f"two steps are called {name!r}, the other in line {other}; give each its own name")
        self.names[name] = k.line
        self.duration = 1.0
        self.steps.append({"name": name, "move": {}, "velocity": {}, "push": {}, "fixed": {}, "loads": {}, "body_force": {}})

    def _static(self, k: Keyword, scope: Scope) -> None:
        if self._step is None:
            raise FileError.at(k.line, "*STATIC stands outside of any *STEP")
        if "RIKS" in k.parameters:
            raise FileError.at(k.line, "RIKS is not read; write a *STATIC step, and 'control' into the case")
        row = next((row for _, row in k.data), [])
        first, whole = k.number(row, 0, 1.0), k.number(row, 1, 1.0)
        if whole <= 0 or first < 0:
            raise FileError.at(k.line, f"a step of {whole:g} with increments of {first:g} lasts no time")
        self.duration = whole
        if whole != 1.0:
            self._step["duration"] = whole
        if "DIRECT" in k.parameters and first > 0:
            self._step["increments"] = max(1, round(whole / first))
        if "STABILIZE" in k.parameters:
            # both are the part of the work that viscous forces may dissipate; without a number, both programs take 2e-4
            given = k.parameters["STABILIZE"]
            try:
                self._step["stabilise"] = float(given) if given else "auto"
            except ValueError:
                raise FileError.at(k.line, f"STABILIZE={given} is not a number") from None

    # ---------------------------------------------------------------------------------------- supports and motions
    def _boundary(self, k: Keyword, scope: Scope) -> None:
        if self._step is not None and k.parameters.get("OP", "MOD").upper() == "NEW":
            self.stale.setdefault("BOUNDARY", {*self.held, *self.places})
        for rows in rows_alike(k, scope, self.names_of.all):
            mine = [(line, row) for line, row in rows if not self._of_tool(k, scope, line, row)]
            if mine:
                self._row(k, scope, *mine[0], [row[0] for _, row in mine])

    def _of_tool(self, k: Keyword, scope: Scope, line: int, words: list[str]) -> bool:
        """Take a row of *BOUNDARY for the tools in it; whether that is all."""
        found, others = self.names_of.tools_at(line, words[0], scope)
        for tool, turning in found:
            dofs, value = self._components(k, line, words, turning)
            if value and self._step is None:
                raise FileError.at(line, "a motion of a rigid body before the first step: write it into the step")
            for c in dofs:
                self._tool(k, tool, c, value, self._velocity(k, line, value))
        return not others

    def _velocity(self, k: Keyword, line: int, value: float) -> bool:
        """Whether a row is a velocity.

        Raises
        ------
        FileError
            If it is something else than that or a displacement, or one that has no counterpart.

        """
        kind = k.parameters.get("TYPE", "DISPLACEMENT").upper()
        if kind not in ("DISPLACEMENT", "VELOCITY"):
            raise FileError.at(line, f"a boundary condition of type {kind} is not read")
        if kind == "VELOCITY" and value and ("AMPLITUDE" in k.parameters or self._step is None):
            raise FileError.at(line, "a velocity with an amplitude, or before the first step, is not read; write displacements")
        return kind == "VELOCITY"

    def _row(self, k: Keyword, scope: Scope, line: int, words: list[str], group: list[str]) -> None:
        dofs, value = self._components(k, line, words, False)
        if self._velocity(k, line, value) and value:
            raise FileError.at(line, "velocities are read of reference nodes of rigid bodies; write displacements of sides")
        following = self.names_of.followers(line, group, scope)
        for f in following:
            if f.c in dofs:
                f.driven = True
                if f.c in TURNS and value:
                    raise FileError.at(line, "sides that turn with a node are not read; press them with a rigid body")
                whole, table = self._sum(k, line, f, value)
                for name in self.names_of.support(f.line, f.who, f.scope, [f.who]) if f.c not in TURNS else ():
                    self.led[name, f.c] = f.line
                    self._side(k, name, f.c, whole, table)
        moved = [c for c in dofs if c not in TURNS]
        if moved and (not following or any(self.names_of.in_body(line, who, scope) for who in group)):
            for name in self.names_of.support(line, words[0], scope, group):
                for c in moved:
                    self._side(k, name, c, value, self._table(k, value))

    def _sum(self, k: Keyword, line: int, f: Follower, value: float) -> tuple[float, list[list[float]] | None]:
        """What follows a node moves by: value at the end of the step, and its table; of several terms their sum.

        Raises
        ------
        FileError
            If one of several terms is held or moved in a way that has no sum here.

        """
        mine = f.factor * value
        if len(f.terms) < 2:
            return mine, self._table(k, mine)
        if "FIXED" in k.parameters or k.parameters.get("OP", "MOD").upper() == "NEW" or (self._step is None and value):
            raise FileError.at(line, "a node of an equation of several terms is moved in steps, without FIXED and OP=NEW; "
                               "write its displacement")  # fmt: skip
        start = len(self.steps) - 1.0
        before = f.way[0 if f.way[0][0] == start else -1][1] if f.way else 0.0
        table = self._table(k, mine)
        f.way, f.ramp = [(t, v) for t, v in table] if table else [(start, before), (start + 1.0, mine)], table is None
        moving = [g for g in f.terms if g.way and g.way[0][0] == start]
        times = sorted({t for g in moving for t, _ in g.way})
        # Between two times all shares are straight; a sum of ramps over the whole step is one.
        rows = [[t, sum(_at(g.way, t)[1] for g in f.terms if g.way)] for t in times]
        return rows[-1][1], None if all(g.ramp for g in moving) else rows

    def _components(self, k: Keyword, line: int, words: list[str], turning: bool) -> tuple[str, float]:
        """Components x, y and r (rotation in the plane), or those of space, of a row of *BOUNDARY, and its value."""
        named = words[1].upper() if len(words) > 1 else ""
        if named in self.held_by:
            held = self.held_by[named]
            return "".join(c for c in held if c in TURNS) if turning else held, 0.0
        first = _whole(line, named or "1")
        last = _whole(line, words[2]) if len(words) > 2 and words[2] else first
        if {0, 8, 9, 11}.intersection(range(first, last + 1)) and not (last > first > 0):
            if "temperature" not in self.without or first not in (0, 11):
                raise FileError.at(line, f"degree of freedom {first} is not a displacement, and would change the answer; "
                                   "a temperature may be left out: --without temperature")  # fmt: skip
            return "", 0.0
        known = self._degrees(turning)
        return "".join(c for n, c in known.items() if first <= n <= last), k.number(words, 3, 0.0)

    def _degrees(self, turning: bool) -> dict[int, str]:
        """Components by their numbers, of the ``ROT NODE`` of a tool those of its rotation."""
        if self.solid:
            return dict(enumerate("abc" if turning else "xyzabc", 1))
        return {3: "r"} if turning else {1: "x", 2: "y", 6: "r"}

    def _tool(self, k: Keyword, tool: str, c: str, value: float, velocity: bool) -> None:
        self.stale.get("BOUNDARY", set()).discard((tool, c))
        before = self.places.setdefault((tool, c), 0.0)
        pushed = self.pushed.pop((tool, c), None) is not None
        if self._step is None or "FIXED" in k.parameters:
            return
        if velocity:
            if value or before:
                self._step["velocity"].setdefault(tool, {})[KEY_OF[c]] = value
                # Where a velocity ends is not followed: nan differs from every value, so that the next motion is always
                # written.
                self.places[tool, c] = nan if value else before
            return
        table = self._table(k, value)
        if table or pushed or value != before:
            self._step["move"].setdefault(tool, {})[KEY_OF[c]] = table or value
        self.places[tool, c] = table[-1][1] if table else value

    def _side(self, k: Keyword, name: str, c: str, value: float, table: list[list[float]] | None) -> None:
        self.stale.get("BOUNDARY", set()).discard((name, c))
        before = self.held.get((name, c))
        into = (self.fixed if self._step is None else self._step["fixed"]).setdefault(name, {})
        # FIXED holds at what it is at the start of the step, as 'held' does; zero after another value is a motion back.
        if "FIXED" in k.parameters or (not value and not before and not table):
            if before is None or "FIXED" in k.parameters:
                into[c] = "held"
            self.held[name, c] = before or 0.0
        else:
            if table or value != before:
                into[c] = table or value
            self.held[name, c] = table[-1][1] if table else value
        if not into:
            (self.fixed if self._step is None else self._step["fixed"]).pop(name)

    # ------------------------------------------------------------------------------------------------------ forces
    def _cload(self, k: Keyword, scope: Scope) -> None:
        if self._step is None:
            raise FileError.at(k.line, "*CLOAD stands outside of any *STEP")
        if k.parameters.get("OP", "MOD").upper() == "NEW":
            self.stale.setdefault("CLOAD", set(self.pushed))
        self.loads.renewed(k)
        others: list[tuple[int, list[str]]] = []
        for line, words in k.data:
            found, remain = self.names_of.tools_at(line, words[0], scope)
            number, value = _whole(line, words[1] if len(words) > 1 else ""), k.number(words, 2)
            if remain:
                if not 1 <= number <= len(self.axes) or found:
                    which = "1, 2 and 3" if self.solid else "1 and 2"
                    raise FileError.at(line, f"forces on nodes of bodies are read along {which}, but not together with tools")
                others.append((line, words))
            for tool, turning in found:
                c = self._degrees(turning).get(number)
                if c is None and value:
                    raise FileError.at(line, f"a force along degree of freedom {number} of a rigid body is not in the plane")
                if c is not None:
                    self.stale.get("CLOAD", set()).discard((tool, c))
                    self._step["push"].setdefault(tool, {})[FORCE_OF[c]] = self._table(k, value) or value
                    self.pushed[tool, c] = value
        if others:
            self.loads.cload(k, scope, self._step, others, self._table)

    def _dload(self, k: Keyword, scope: Scope) -> None:
        if self._step is None:
            raise FileError.at(k.line, "*DLOAD stands outside of any *STEP")
        self.loads.renewed(k)
        self.loads.dload(k, scope, self._step, self._table)

    def _dsload(self, k: Keyword, scope: Scope) -> None:
        if self._step is None:
            raise FileError.at(k.line, "*DSLOAD stands outside of any *STEP")
        self.loads.renewed(k)
        for line, words in k.data:
            kind, value = words[1].upper() if len(words) > 1 else "", k.number(words, 2)
            names = self.names_of.support(line, words[0], scope, [words[0]])
            if kind == "P":
                for name in names:
                    self.loads.press(k, self._step, name, value, self._table(k, value))
            elif kind in ("TRVEC", "TRSHR"):
                way = tuple(k.number(words, 3 + i, 0.0) for i in range(len(self.axes)))
                turning = k.parameters.get("FOLLOWER", "YES").upper() != "NO" and self.large
                along = kind == "TRVEC" or self.names_of.along(line, words[0], scope, way)
                if turning or not along or (k.number(words, 5, 0.0) and not self.solid) or not any(way):
                    plane = "" if self.solid else " in the plane"
                    raise FileError.at(
                        line, f"a traction {kind} is read along a direction{plane}, with NLGEOM=NO or FOLLOWER=NO; "
                        "a shear (TRSHR) on straight sides, along them"
                    )  # fmt: skip
                for name in names:
                    self.loads.pull(k, self._step, name, enumerate(value * w / hypot(*way) for w in way), self._table)
            else:
                raise FileError.at(line, f"of loads on surfaces pressure (P) and tractions (TRVEC, TRSHR) are read, not {kind!r}")

    def _table(self, k: Keyword, value: float) -> list[list[float]] | None:
        """The amplitude of a value in the time of the case, which counts steps; none if it has none."""
        name = k.parameters.get("AMPLITUDE", "").upper()
        if not name or self._step is None or not value:
            return None  # nothing stretched is nothing
        if name not in self.amplitudes:
            raise FileError.at(k.line, f"there is no amplitude {name!r} before this line")
        rows, total = self.amplitudes[name]
        # The case's time counts steps, the deck's is in its own unit: a step of any duration has the length 1.
        rows = [((t - (self.passed if total else 0.0)) / self.duration, a) for t, a in rows]
        at = [_at(rows, 0.0), *((t, a) for t, a in rows if 0.0 < t < 1.0), _at(rows, 1.0)]
        start = len(self.steps) - 1
        return [[start + t, value * a + 0.0] for t, a in at]  # no -0.0


def _at(rows: list[tuple[float, float]], t: float) -> tuple[float, float]:
    """Row of an amplitude at a time, which is constant before its first and after its last row."""
    before = [r for r in rows if r[0] <= t] or [rows[0]]
    after = [r for r in rows if r[0] >= t] or [rows[-1]]
    (t0, a0), (t1, a1) = before[-1], after[0]
    return t, a0 if t1 <= t0 else a0 + (a1 - a0) * (t - t0) / (t1 - t0)


def still(k: Keyword, row: list[str]) -> list[int]:
    """Coordinates (0, 1) along which a row of *BOUNDARY holds at zero; none if it is no such row."""
    named = row[1].upper() if len(row) > 1 else "1"
    if named in HELD_BY:
        return [i for i, c in enumerate("xy") if c in HELD_BY[named]]
    last = row[2] if len(row) > 2 and row[2] else named
    if not (is_label(named) and is_label(last)) or k.number(row, 3, 0.0):
        return []
    return [i for i in (0, 1) if int(named) <= i + 1 <= int(last)]


def _whole(line: int, word: str) -> int:
    if not is_label(word):
        raise FileError.at(line, f"{word[:60]!r} is not a number of a degree of freedom, nor one of {', '.join(HELD_BY)}")
    return int(word)


def _short(fixed: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """'x', 'y', 'xy' … in the place of held components."""
    return {
        name: "".join(sorted(entry)) if set(entry) <= set("xyz") and all(v == "held" for v in entry.values()) else entry
        for name, entry in fixed.items()
        if entry
    }
