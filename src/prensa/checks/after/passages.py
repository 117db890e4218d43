"""Means over a passage: what slides through a contact steps as its nodes pass, its mean over one element does not.

Forces are known at the ends of increments. In most of them they change little; where a node lands or leaves they jump, and
what an increment has of the force before and of that after depends on when. That is read off its work (`jump_of`), which
the bodies store and dissipate whenever the force jumps (docs/developer/book/12).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prensa.checks.before.passages_ahead import plastic
from prensa.checks.check import Committed, warning
from prensa.checks.thresholds import SLIGHT
from prensa.contact.passage import STAIR, WORTH_SAYING, Passing, passable, passing, sentence
from prensa.errors import Finding
from prensa.model.problem import support_names
from prensa.result.increment import Increment, Mean
from prensa.system.interaction import Context
from prensa.system.state import State
from prensa.system.system import Evaluation, System
from prensa.types import Array

RIPPLE_PREDICTION_RATIO = 0.5
"""Step of a force over the predicted one, below which it has another cause."""
SETTLED_SHARE = 0.25
"""Change of the mean over the step while two elements pass, above which the force is not settled."""
JUMP_TIME_MARGIN = 0.5
"""Increments beyond its own within which that time may lie to count."""


def passing_of(system: System, e: Evaluation, before: Array, after: Array) -> dict[str, Passing]:
    """By name, what passed through the contacts in an increment between degrees of freedom before and after (ndof,)."""
    forces = {s.name: f for s, f in zip(system.surfaces, e.contacts)}
    return {s.name: passing(system, s, forces[s.name], before, after) for s in passable(system)}


def jump_of(c: Context, state: State) -> float:
    """Share of an increment after which its forces jumped, as its work says, when it led to a state; nan if they did not.

    The energy balance's external work has forces in the middle of those at both ends; what is stored and dissipated is
    that of the ways,
    which the bodies have gone whenever the forces jumped. Their difference, the imbalance, says when: with f before and after,
    on prescribed ways d, Δimbalance = (τ − ½) (f₁ − f₀)·d. A time beyond the increment is that of no single jump: the farther it
    is, the nearer to the middle is what is taken.
    """
    old, own = c.state, c.plan.fixed
    way = (state.u - old.u)[own]
    change, work = float((state.work - old.work)[own] @ way), 0.5 * float((state.work + old.work)[own] @ way)
    # "Not greater" so that an increment without any work, 0 > 0, has no jump either.
    if not abs(change) > SLIGHT * abs(work):
        return float("nan")
    found = 0.5 + (state.energy.imbalance - old.energy.imbalance) / change
    within = float(np.clip(found, 0.0, 1.0))
    # A force that peaks just before a node leaves makes times beyond the increment. Taking the nearest end for all of them
    # spread the means of a drawing by 0.64 %, more than a straight line.
    trust = 1.0 - abs(found - within) / JUMP_TIME_MARGIN
    return 0.5 + trust * (within - 0.5) if trust > 0.0 else float("nan")


class Row(NamedTuple):
    """Elements that have ``passed`` by contact at the end of an increment, ``values`` then, ``jump`` in it (see `jump_of`)."""

    passed: dict[str, float]
    values: Array
    jump: float = float("nan")


def integral(ends: Array, jump: float, a: float, b: float) -> Array:
    """∫ of quantities (k,) of which ``ends`` (2, k) are known, over the shares a to b of an increment."""
    if np.isnan(jump):
        return np.asarray((b - a) * (ends[0] + 0.5 * (a + b) * (ends[1] - ends[0])))
    before, after = max(min(b, jump) - a, 0.0), max(b - max(a, jump), 0.0)
    return np.asarray(before * ends[0] + after * ends[1])


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
        self._contacts = {s.name: (s.against, plastic(system, s.body)) for s in surfaces}
        self._owners: dict[str, list[str]] = {}
        for s in surfaces:
            held = [name for name in support_names(system.problem) if name.partition(".")[0] == s.body]
            columns = [f"{s.against}.{c}" for c in ("fx", "fy", "mz")]
            columns += [f"fixed.{name}.{c}" for name in held for c in ("fx", "fy")]
            for column in (*columns, f"{s.name}.pressure", f"{s.name}.elements"):
                self._owners.setdefault(column, []).append(s.name)
        self._step, self._reported = "", set[str]()
        self._rows: list[Row] = []

    @property
    def columns(self) -> list[str]:
        """Names of the quantities that have means: columns of ``history.csv``, then pressure and elements of each contact."""
        return list(self._owners)

    def follow(self, increment: Increment, system: System, context: Context, reached: State, e: Evaluation) -> Increment:
        """The increment with its means; context, e: how it led to the state ``reached``, on the present ``system`` of the run."""
        if not self.count:
            return increment
        found, jump = passing_of(system, e, context.state.u, reached.u), jump_of(context, reached)
        passed = {name: found.get(name, Passing(0.0, 0.0, 0.0)) for name in self.count}  # tools that are gone have none
        values = {
            f"{name}.{c}": v for name, tool in increment.tools.items() for c, v in zip(("fx", "fy", "mz"), tool.force)
        }
        values |= {f"fixed.{k}.{c}": v for k, f in increment.supports.items() for c, v in zip(("fx", "fy"), f)}
        values |= {f"{name}.{c}": getattr(p, c) for name, p in passed.items() for c in ("pressure", "elements")}
        count = {name: n + passed[name].advance for name, n in self.count.items()}
        self._add(increment.step, count, values, jump)
        return replace(increment, passing=passed, passages=count, means=self.means(), jump=jump)

    def restore(self, step: str, row: Mapping[str, float], ended: bool) -> None:
        """Take over what was written of an earlier increment: values by column, ``<contact>.passages`` and ``jump`` among them.

        ``ended``: it was the last one of the step, whose warnings have been reported.
        """
        count = {name: float(row[f"{name}.passages"]) for name in self.count}
        self._add(step, count, row, float(row.get("jump", np.nan)))
        if ended:
            # Run for its effect: contacts that were warned of are noted, and a resumed run does not warn again.
            list(self.warnings())

    def _add(self, step: str, count: dict[str, float], values: Mapping[str, float], jump: float = np.nan) -> None:
        if not self._rows:
            self._rows.append(Row(self.count, np.zeros(len(self._owners))))
        if step != self._step:
            # The row that ended the step before is where the first window of this one may begin.
            self._step, self._rows = step, self._rows[-1:]
        self._rows.append(Row(count, np.array([values[column] for column in self._owners]), jump))
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
        # Passages by the motion of the surface: landings read from jumps of the contact's area spread means by 3.9 to 8.8 %,
        # the centroid of pressure jumps, and longer or triangular windows are no steadier.
        end = self.count[contact] - back
        start, i = end - 1.0, len(self._rows) - 1
        if start < self._rows[0].passed[contact] or not end > start:
            return None
        while self._rows[i].passed[contact] > start:
            i -= 1
        n = np.array([row.passed[contact] for row in self._rows[i:]])
        # where nothing passed the last row counts
        last = np.flatnonzero(np.append(n[1:] > n[:-1], True))
        n, rows = n[last], [self._rows[i + k] for k in last]
        stop = int(np.searchsorted(n, end))  # the first row at the end or beyond
        mean, y = np.zeros(len(self._owners)), []
        for k in range(stop):
            ends, length = np.stack([rows[k].values, rows[k + 1].values]), n[k + 1] - n[k]
            a, b = max(start - n[k], 0.0) / length, min((end - n[k]) / length, 1.0)
            mean += length * integral(ends, rows[k + 1].jump, a, b)
            y += [(1.0 - a) * ends[0] + a * ends[1], (1.0 - b) * ends[0] + b * ends[1]]
        return len(self._rows) - i, mean, 0.5 * np.ptp(y, axis=0)

    def __call__(self, _: Committed) -> Iterator[Finding]:
        """See `warnings`, at the end of a step."""
        yield from map(warning, self.warnings())

    def warnings(self) -> Iterator[str]:
        """What there is to say at the end of a step, once, of contacts through which few elements pass."""
        for name, (tool, steps) in self._contacts.items():
            # Two passages back: a mean over one passage that still moves by then is a drift.
            if not steps or name in self._reported or (before := self._window(name, 2.0)) is None:
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
                and seen - drift >= RIPPLE_PREDICTION_RATIO * STAIR / lying * size
                and drift <= SETTLED_SHARE * seen
            ):
                self._reported.add(name)
                yield f"contact {name}: {sentence(lying, (seen - drift) / size)}"
