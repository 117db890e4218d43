"""Stock that is fed, looked at before the solve: ways that bring it to no tool, and rolls that turn against it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import TOWARDS
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.geometry.plane import turned
from prensa.linear.rigid_modes import CLOSED
from prensa.model.feed import Feed, ends_early
from prensa.model.fields import motions_in
from prensa.system.moments import stages
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array

PLACES = 129
"""Places along a way at which what is fed is looked for in the tools: a way is seldom longer than a hundred elements."""


def feeding(system: System) -> Iterator[Finding]:
    """Findings on the first feed of each body, as long as it and the tools are where the description puts them.

    The body goes as a rigid one. A roll that brakes on purpose does not draw stock in, which is what ends a feed.
    """
    seen: set[str] = set()
    for step, (plan, _, u, *_) in zip(system.problem.steps, stages(system)):
        for boundary, feed in step.feed.items():
            body = boundary.partition(".")[0]
            if feed is not None and body not in seen:
                yield from _fed(system, plan, boundary, feed, u)
            seen.add(body)
        # A body that was driven is no longer where the description puts it, and its way is not known before the run.
        seen |= {name.partition(".")[0] for name in system.problem.driven(step)}
        if ends_early(step):
            return  # anywhere on its way, after which no place is known


def _fed(system: System, plan: StepPlan, boundary: str, feed: Feed, u: Array) -> Iterator[Finding]:
    """What there is to say of a way along which a body is fed."""
    body = boundary.partition(".")[0]
    against = [s for s in system.tool_contacts if s.body == body]
    nearest, reported = dict[str, float](), set[str]()
    for s in against:
        gap, velocity = _meeting(system, s, plan, feed, u)
        nearest[s.against] = min(gap, nearest.get(s.against, np.inf))
        along, size = velocity["xyz".index(feed.axis)] * np.sign(feed.way), float(np.linalg.norm(velocity))
        if along < -TOWARDS * size and s.against not in reported:
            tool = s.against
            reported.add(tool)
            key = "by" if tool in system.problem.steps[plan.number].by else "move"
            motion = getattr(system.problem.steps[plan.number], key)[tool]
            turn = next((r for r in motions_in(system.problem.space) if r[0] == "r" and getattr(motion, r) is not None), "rz")
            positive = "counter-clockwise" if system.dofs.dimension == 2 else f"right-handed about {turn[1]}"
            yield Finding(
                f"steps.{plan.number}.{key}.{tool}.{turn}",
                f"where {body!r} meets tool {tool!r}, the surface of the tool moves against the feed of {boundary!r}: it "
                f"pushes the stock out; reverse the sign of {turn!r}, which is positive {positive}, or that of the feed",
            )
    least = min((s.points.depth.min() for s in against), default=0.0)
    if nearest and min(nearest.values()) > CLOSED * least and not _come(system, against):
        names = " or ".join(map(repr, nearest))
        yield Finding(
            f"steps.{plan.number}.feed.{boundary}.{feed.axis}",
            f"a feed of {feed.way:g} does not bring {body!r} into contact: it never comes nearer than "
            f"{min(nearest.values()):.4g} to {names}; check its sign and size, and the gap between the tools",
        )


def _meeting(system: System, s: Surface, plan: StepPlan, feed: Feed, u: Array) -> tuple[float, Array]:
    """Least gap on the way, and the way (d,) on which the tool's turn takes its surface where the body meets it first."""
    d = system.dofs.dimension
    shift, nearest, at, master = np.zeros(d), np.inf, u.copy(), system.tool_masters[s.against]
    x, least = system.X[s.points.nodes], CLOSED * float(s.points.depth.min())
    start, now = master.place(u), u.copy()
    now[plan.fixed] = plan.values(plan.t1)
    turn = (master.place(now) - start)[d : 2 * d if d == 3 else d + 1]
    for share in np.linspace(0.0, 1.0, PLACES):
        at[plan.fixed] = plan.values(plan.t0 + share * (plan.t1 - plan.t0))
        shift["xyz".index(feed.axis)] = share * feed.way
        pairs = master.seen(x + shift, at)
        nearest = min(nearest, float(pairs.g.min()))
        if nearest <= least:
            k = int(np.argmin(pairs.g))
            return nearest, np.asarray(turn * (turned(pairs.arm[k])) if d == 2 else np.cross(turn, pairs.arm[k]))
    return nearest, np.zeros(d)


def _come(system: System, against: list[Surface]) -> bool:
    """Whether one of the tools is moved or pushed along some axis, which may be what brings it to the stock."""
    names = {s.against for s in against}
    for step in system.problem.steps:
        moved = [m for given in (step.move, step.by) for name, m in given.items() if name in names]
        if names & set(step.push) or any(getattr(m, a) is not None for m in moved for a in "xyz"):
            return True
    return False
