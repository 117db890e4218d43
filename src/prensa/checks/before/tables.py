"""Tables in global time that do not cover the step in which they stand, or go on after the run."""

from __future__ import annotations

from collections.abc import Iterator

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding
from prensa.model import problem as model
from prensa.model.problem import tools_removed
from prensa.model.tables import DRIVEN, tables_of
from prensa.system.schedule import tabulated
from prensa.system.system import System

IN_SECONDS = 2.0
"""End of a table over that of the run, from which on its times are likely seconds."""


def tables(system: System) -> Iterator[Finding]:
    """Tables in global time that do not cover the step in which they stand: they are held, not extrapolated."""
    p = system.problem
    sources: list[tuple[str, model.Problem | model.Step, float, float, str]] = [
        ("", p, 0.0, float(len(p.steps)), "the steps")
    ]
    sources += [(f"steps.{i}.", s, float(i), float(i + 1), f"step {s.name!r}") for i, s in enumerate(p.steps)]
    for prefix, owner, t0, t1, what in sources:
        for place, table in tables_of(owner):
            path = prefix + ".".join(map(str, place))
            first, last = table[0][0], table[-1][0]
            ends, end = float(len(p.steps)), table[-1][1]
            reached = tabulated(table)(ends)
            if first <= t0 + NO_DIFFERENCE and last >= IN_SECONDS * ends and abs(reached - end) > NO_DIFFERENCE * abs(end):
                yield Finding(
                    path,
                    f"the table continues to time {last:g}, and the run ends at {ends:g}, at {reached:.4g} of {end:g}: times "
                    "count steps, each 1 long whatever its 'duration', not seconds",
                )
            there = tabulated(table)(t1)
            cut = owner is not p and last > t1 + NO_DIFFERENCE and abs(there - end) > NO_DIFFERENCE * abs(end)
            if cut and _left_off(p, int(t0), str(place[0]), str(place[1])):
                yield Finding(
                    path,
                    f"the table continues to time {last:g}, and {what} ends at {t1:g}, at {there:.4g} of {end:g}: what a step "
                    f"does not mention is held, so step {p.steps[int(t1)].name!r} needs the table too",
                )
            if first <= t0 + NO_DIFFERENCE and last >= t1 - NO_DIFFERENCE:
                continue
            held = (
                f"held at {table[-1][1]:g} after that"
                if first <= t0 + NO_DIFFERENCE
                else f"held at {table[0][1]:g} until it begins"
            )
            if last <= t0:
                held = f"so it stays at {table[-1][1]:g}"
            yield Finding(
                path,
                f"the table covers the times {first:g} … {last:g}, {what} {t0:g} … {t1:g}: {held}; times are counted over all "
                "steps",
            )


def _left_off(p: model.Problem, number: int, kind: str, name: str) -> bool:
    """Whether the step after a step has nothing to say of the tool or side that a table in it drives."""
    if kind not in ("move", "by", "velocity", "push") or number + 1 >= len(p.steps) or tools_removed(p, number + 1):
        return False
    return not any(name in getattr(p.steps[number + 1], other) for other in (*DRIVEN, "fixed"))
