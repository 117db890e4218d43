"""Steps of Abaqus decks: supports, motions and forces of tools, pressures, as they follow one another."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import Any

from prensa.importers.abaqus import Keyword, Scope
from prensa.importers.deck import FileError, is_label

OF_STEPS = ("AMPLITUDE", "STEP", "STATIC", "BOUNDARY", "CLOAD", "DSLOAD")
HELD_BY = {"XSYMM": "x", "YSYMM": "y", "ENCASTRE": "xyr", "PINNED": "xy"}
KEY_OF = {"x": "x", "y": "y", "r": "rz"}
FORCE_OF = {"x": "x", "y": "y", "r": "m"}


class Steps:
    """What happens, step by step: ``tool_at`` the tool of a reference node, ``support`` the boundaries that a set is.

    A deck says in every step what changes; with ``OP=NEW`` all that holds from then on. What held before is known here, so
    that what is not said again can be released. ``large``: whether displacements are, in any step.
    """

    def __init__(
        self, tool_at: Callable[[int, str, Scope], str | None], support: Callable[[int, str, Scope], list[str]]
    ) -> None:
        self.tool_at, self.support = tool_at, support
        self.large = False
        self.fixed: dict[str, dict[str, Any]] = {}
        self.steps: list[dict[str, Any]] = []
        self.names: dict[str, int] = {}  # of steps → line
        self.amplitudes: dict[str, tuple[list[tuple[float, float]], bool]] = {}
        self.passed = 0.0  # time of the steps before
        self.duration = 1.0
        self.held: dict[tuple[str, str], float] = {}  # (boundary, component) → displacement
        self.places: dict[tuple[str, str], float] = {}  # (tool, component) → displacement
        self.pushed: dict[tuple[str, str], float] = {}
        self.pressed: dict[str, float] = {}
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
                "CLOAD": self._cload, "DSLOAD": self._dsload,
            }[k.name]  # fmt: skip
            method(k, scope)
        self._close()
        for step in self.steps:
            for part in ("fixed", "loads", "move", "velocity", "push"):
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
            if what in self.held:
                del self.held[what]
                entry = step["fixed"].setdefault(name, {})
                entry["free"] = True
                for other in "xy":
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
        for name in self.stale.pop("DSLOAD", ()):
            del self.pressed[name]
            step["loads"][name] = {"pressure": 0.0}
        self.passed += self.duration

    def _begin(self, k: Keyword, scope: Scope) -> None:
        self._close()
        name = k.parameters.get("NAME", f"step {len(self.steps) + 1}")
        if "PERTURBATION" in k.parameters:
            raise FileError.at(k.line, "a step of PERTURBATION is not read; write a general one")
        self.large = self.large or k.parameters.get("NLGEOM", "NO").upper() != "NO"
        if name in self.names:
            other = self.names[name]
            raise FileError.at(k.line, f"two steps are called {name!r}, the other in line {other}; give each its own name")
        self.names[name] = k.line
        self.duration = 1.0
        self.steps.append({"name": name, "move": {}, "velocity": {}, "push": {}, "fixed": {}, "loads": {}})

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
                raise FileError.at(k.line, f"STABILIZE={given} is no number") from None

    # ---------------------------------------------------------------------------------------- supports and motions
    def _boundary(self, k: Keyword, scope: Scope) -> None:
        if self._step is not None and k.parameters.get("OP", "MOD").upper() == "NEW":
            self.stale.setdefault("BOUNDARY", {*self.held, *self.places})
        for line, words in k.data:
            self._row(k, scope, line, words)

    def _row(self, k: Keyword, scope: Scope, line: int, words: list[str]) -> None:
        dofs, value = _components(k, line, words)
        kind = k.parameters.get("TYPE", "DISPLACEMENT").upper()
        if kind not in ("DISPLACEMENT", "VELOCITY"):
            raise FileError.at(line, f"a boundary condition of type {kind} is not read")
        if kind == "VELOCITY" and value and ("AMPLITUDE" in k.parameters or self._step is None):
            raise FileError.at(line, "a velocity with an amplitude, or before the first step, is not read; write displacements")
        tool = self.tool_at(line, words[0], scope)
        if tool is not None:
            for c in dofs:
                self._tool(k, tool, c, value, kind == "VELOCITY")
            return
        if kind == "VELOCITY" and value:
            raise FileError.at(line, "velocities are read of reference nodes of rigid bodies; write displacements of sides")
        if in_plane := dofs.replace("r", ""):
            for name in self.support(line, words[0], scope):
                for c in in_plane:
                    self._side(k, name, c, value)

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

    def _side(self, k: Keyword, name: str, c: str, value: float) -> None:
        self.stale.get("BOUNDARY", set()).discard((name, c))
        before = self.held.get((name, c))
        into = (self.fixed if self._step is None else self._step["fixed"]).setdefault(name, {})
        table = self._table(k, value)
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
        for line, words in k.data:
            tool = self.tool_at(line, words[0], scope)
            if tool is None:
                raise FileError.at(line, "forces are read on reference nodes of rigid bodies only; use *DSLOAD")
            c = {1: "x", 2: "y", 6: "r"}.get(_whole(line, words[1] if len(words) > 1 else ""))
            if c is not None:
                value = k.number(words, 2)
                self.stale.get("CLOAD", set()).discard((tool, c))
                self._step["push"].setdefault(tool, {})[FORCE_OF[c]] = self._table(k, value) or value
                self.pushed[tool, c] = value

    def _dsload(self, k: Keyword, scope: Scope) -> None:
        if k.parameters.get("OP", "MOD").upper() == "NEW":
            self.stale.setdefault("DSLOAD", set(self.pressed))
        for line, words in k.data:
            if words[1:2] not in (["P"], ["p"]) or self._step is None:
                raise FileError.at(line, "of loads on surfaces pressure (P) in a step is read")
            value = k.number(words, 2)
            for name in self.support(line, words[0], scope):
                self.stale.get("DSLOAD", set()).discard(name)
                self._step["loads"][name] = {"pressure": self._table(k, value) or value}
                self.pressed[name] = value

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


def _components(k: Keyword, line: int, words: list[str]) -> tuple[str, float]:
    """Components x, y and r (rotation in the plane) of a row of *BOUNDARY, and its value."""
    named = words[1].upper() if len(words) > 1 else ""
    if named in HELD_BY:
        return HELD_BY[named], 0.0
    first = _whole(line, named or "1")
    last = _whole(line, words[2]) if len(words) > 2 and words[2] else first
    return "".join(c for n, c in ((1, "x"), (2, "y"), (6, "r")) if first <= n <= last), k.number(words, 3, 0.0)


def _whole(line: int, word: str) -> int:
    if not is_label(word):
        raise FileError.at(line, f"{word[:60]!r} is no number of a degree of freedom, nor one of {', '.join(HELD_BY)}")
    return int(word)


def _short(fixed: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """'x', 'y' and 'xy' in the place of held components."""
    return {
        name: "".join(sorted(entry)) if set(entry) <= {"x", "y"} and all(value == "held" for value in entry.values()) else entry
        for name, entry in fixed.items()
        if entry
    }
