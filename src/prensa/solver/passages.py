"""Means over a passage: what slides through a contact steps as its nodes pass, its mean over one element does not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from prensa.fem.passing import STAIR, WORTH_SAYING, Passing, passable, passing, plastic, sentence
from prensa.fem.system import Evaluation, System
from prensa.model.problem import support_names
from prensa.solver.increment import Increment, Mean
from prensa.solver.policy import DEFAULT, Policy

Array = NDArray[np.float64]


def passing_of(system: System, e: Evaluation, before: Array, after: Array) -> dict[str, Passing]:
    """By name, what passed through the contacts in an increment between degrees of freedom before and after (ndof,)."""
    forces = {s.name: f for s, f in zip(system.surfaces, e.contacts)}
    return {s.name: passing(system, s, forces[s.name], before, after) for s in passable(system)}


class Passages:
    """Follows the increments of a run and gives means over the last element that passed, in the present step.

    Means weigh increments by what passed in them, so that neither their length nor a dwell enters; no window reaches over the
    beginning of a step, where what is prescribed changes. Where a quantity belongs to several contacts (supports, tools),
    that with the longest window counts. ``count``: elements that have passed in the whole run, by contact; ``met``: tools that
    have touched something in it.

    Nothing here enters a solution: a run that is continued goes on from the rows that it has written (`restore`).
    """

    def __init__(self, system: System) -> None:
        surfaces = passable(system)
        self.count = {s.name: 0.0 for s in surfaces}
        self.met: set[str] = set()
        self._contacts = {s.name: (system.tools[s.tool].name, plastic(system, s.body)) for s in surfaces}
        self._owners: dict[str, list[str]] = {}
        for s in surfaces:
            held = [name for name in support_names(system.problem) if name.partition(".")[0] == s.body]
            columns = [f"{system.tools[s.tool].name}.{c}" for c in ("fx", "fy", "mz")]
            columns += [f"fixed.{name}.{c}" for name in held for c in ("fx", "fy")]
            for column in (*columns, f"{s.name}.pressure", f"{s.name}.elements"):
                self._owners.setdefault(column, []).append(s.name)
        self._step, self._told = "", set[str]()
        self._rows: list[tuple[dict[str, float], Array]] = []

    @property
    def columns(self) -> list[str]:
        """Names of the quantities that have means: columns of ``history.csv``, then pressure and elements of each contact."""
        return list(self._owners)

    def follow(self, increment: Increment, passed: Mapping[str, Passing]) -> Increment:
        """The increment with its means."""
        if not self.count:
            return increment
        passed = {name: passed.get(name, Passing(0.0, 0.0, 0.0)) for name in self.count}  # tools that are gone have none
        values = {
            f"{name}.{c}": v for name, tool in increment.tools.items() for c, v in zip(("fx", "fy", "mz"), tool.force)
        }
        values |= {f"fixed.{k}.{c}": v for k, f in increment.supports.items() for c, v in zip(("fx", "fy"), f)}
        values |= {f"{name}.{c}": getattr(p, c) for name, p in passed.items() for c in ("pressure", "elements")}
        count = {name: n + passed[name].advance for name, n in self.count.items()}
        self._add(increment.step, count, values)
        return replace(increment, passing=passed, passages=count, means=self.means())

    def restore(self, step: str, row: Mapping[str, float], ended: bool) -> None:
        """Take over what was written of an earlier increment: values by column, ``<contact>.passages`` among them.

        ``ended``: it was the last one of the step, whose warnings have been told.
        """
        self._add(step, {name: float(row[f"{name}.passages"]) for name in self.count}, row)
        if ended:
            list(self.warnings())

    def _add(self, step: str, count: dict[str, float], values: Mapping[str, float]) -> None:
        if not self._rows:
            self._rows.append((self.count, np.zeros(len(self._owners))))
        if step != self._step:
            self._step, self._rows = step, self._rows[-1:]
        self._rows.append((count, np.array([values[column] for column in self._owners])))
        self.count = count

    def means(self) -> dict[str, Mean]:
        """Means over the last passage, of the quantities of which there is one."""
        windows = {name: w for name in self.count if (w := self._window(name)) is not None}
        out = {}
        for k, (column, owners) in enumerate(self._owners.items()):
            own = [windows[name] for name in owners if name in windows]
            if own:
                _, mean, ripple = max(own, key=lambda w: w[0])
                out[column] = Mean(float(mean[k]), float(ripple[k]))
        return out

    def _window(self, contact: str, back: float = 0.0) -> tuple[int, Array, Array] | None:
        """Rows, means and ripples of all quantities over one passage that ended ``back`` passages ago; None if there is none."""
        end = self.count[contact] - back
        start, i = end - 1.0, len(self._rows) - 1
        if start < self._rows[0][0][contact] or not end > start:
            return None
        while self._rows[i][0][contact] > start:
            i -= 1
        n = np.array([count[contact] for count, _ in self._rows[i:]])
        # where nothing passed the last row counts
        last = np.flatnonzero(np.append(n[1:] > n[:-1], True))
        n, y = n[last], np.array([self._rows[i + k][1] for k in last])
        stop = int(np.searchsorted(n, end))  # the first row at the end or beyond
        n, y = n[: stop + 1], y[: stop + 1]
        for row, beside, at in ((0, 1, start), (-1, -2, end)):
            share = (at - n[row]) / (n[beside] - n[row])
            y[row] = (1.0 - share) * y[row] + share * y[beside]
            n[row] = at
        mean = (0.5 * (y[1:] + y[:-1]) * np.diff(n)[:, None]).sum(axis=0)
        return len(self._rows) - i, mean, 0.5 * np.ptp(y, axis=0)

    def warnings(self, policy: Policy = DEFAULT) -> Iterator[str]:
        """What there is to say at the end of a step, once, of contacts through which few elements pass."""
        for name, (tool, steps) in self._contacts.items():
            if not steps or name in self._told or (before := self._window(name, 2.0)) is None:
                continue
            now = self._window(name)
            assert now is not None
            columns = self.columns
            lying = now[1][columns.index(f"{name}.elements")]
            k = max((columns.index(f"{tool}.{c}") for c in ("fx", "fy")), key=lambda k: abs(now[1][k]))
            size = abs(float(now[1][k]))
            seen, drift = 2.0 * float(now[2][k]), abs(float(now[1][k] - before[1][k]))
            # what grows from one passage to the next is no staircase
            if (
                lying * WORTH_SAYING <= STAIR
                and seen - drift >= max(policy.staircase, policy.as_foretold * STAIR / lying) * size
                and drift <= policy.settled * seen
            ):
                self._told.add(name)
                yield f"contact {name}: {sentence(lying, (seen - drift) / size)}"
