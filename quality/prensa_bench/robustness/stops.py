"""Whether a run in space that stopped had a reason which its files show: nothing here is shared with the solver."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from prensa.types import Array
from prensa_bench.robustness.cells_in_space import corners
from prensa_bench.robustness.checks_in_space import XYZ, touchings
from prensa_bench.robustness.drawn import Drawn
from prensa_bench.robustness.files import Record

NEARLY = 0.1  # of a first stiffness, a corner's Jacobian or the way to an edge: what is as good as none
LAST = 10  # increments before a stop in which its reason is looked for


def confirmed(d: Drawn, record: Record, reason: str) -> str:
    """What the files show of the reason for which a run stopped, in words; '' if nothing."""
    looks: dict[str, Callable[[Drawn, Record], str]] = {
        "LimitPoint": limit, "Unstable": limit, "Jumped": limit, "Runaway": limit, "Singular": limit,
        "TipsOver": tipping, "Distorted": folded, "CornerInverted": folded, "Collapsed": folded, "Folded": folded,
    }  # fmt: skip
    kinds = [look for key, look in looks.items() if key in reason.replace(".", " ").split() or reason.startswith(key)]
    if not record.bodies or len(record.steps) < 2:
        return ""
    return next((found for look in dict.fromkeys(kinds) if (found := look(d, record))), "")


def limit(d: Drawn, record: Record) -> str:
    """Of the load, of the way, or of where a tool can rest; or an element that gave way."""
    return next((found for look in (limit_load, snapping, tipping, folded) if (found := look(d, record))), "")


def limit_load(d: Drawn, record: Record) -> str:
    """A pushed tool that went ever farther for the same force: its stiffness has all but gone, or changed its sign."""
    h = record.history
    for step in record.problem.steps:
        for name in step.push:
            rows = [k for k, s in enumerate(record.steps) if s == step.name]
            if record.steps[-1] != step.name or len(rows) < 3:
                continue
            force = np.append(0.0, h[f"{name}.fy"][rows])
            way = -np.append(h[f"{name}.uy"][rows[0] - 1] if rows[0] else 0.0, h[f"{name}.uy"][rows])
            slope = np.diff(force) / np.where(np.diff(way) == 0.0, np.inf, np.diff(way))
            # it would vanish within as much as the last increment, which in metal that hardens it does not
            if slope[-1] < min(NEARLY * slope.max(), 0.5 * slope[-2]):
                return f"the stiffness of {name} has fallen to {slope[-1] / slope.max():.1%} of the largest"
    return ""


def snapping(d: Drawn, record: Record) -> str:
    """Nodes in contact that went ever farther for the same way of the tools: the way ends where it turns back."""
    moved, before = [], None
    for row, c, t in touchings(d, record):
        if before is not None and before[0] == c.name:
            way = sum(
                abs(float(v)) for a in XYZ for v in np.diff(record.history[f"{c.against}.u{a}"][row - 1 : row + 1])
            )
            moved.append(float(np.linalg.norm(t.x - before[1], axis=1).max()) / max(way, np.finfo(float).tiny))
        before = c.name, t.x
    if len(moved) > LAST and max(moved[-LAST:]) > np.median(moved) / NEARLY**2:
        return f"nodes moved {max(moved[-LAST:]):.2g} times as far as the tool, where {np.median(moved):.2g} times was usual"
    return ""


def tipping(d: Drawn, record: Record) -> str:
    """The force of a tool that is free to turn acts at the edge of, or beside, what it rests on."""
    *_, (row, c, t) = touchings(d, record)
    h, name = record.history, c.against
    f = np.array([h[f"{name}.f{a}"][row] for a in XYZ])
    m = np.array([h[f"{name}.m{a}"][row] for a in XYZ])
    at = np.asarray(d.tools[name].at) + [h[f"{name}.u{a}"][row] for a in XYZ]
    through = (at + np.cross(f, m) / max(float(f @ f), 1e-300))[[0, 2]]
    pressed = np.linalg.norm(t.force, axis=1) > 0
    rest = t.x[pressed][:, [0, 2]]
    if len(rest) < 3:
        return f"{name} rests on {len(rest)} nodes"
    inside = within(rest, through) / max(float(np.ptp(rest, axis=0).min()), 1e-300)
    return f"the force of {name} acts {inside:.1%} of what it rests on within its edge" if inside < NEARLY else ""


def within(points: Array, x: Array) -> float:
    """Distance of a point (2,) from the nearest side of the convex hull of points (k, 2); negative outside."""
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return float((((points - x) @ way.T).max(axis=0)).min())


def folded(d: Drawn, record: Record) -> str:
    """An element whose corner is all but flat, or beyond."""
    for name, s in record.bodies[max(record.bodies)].items():
        now, first = corners(s.cells, s.x), corners(s.cells, s.X)
        spanned = first > NEARLY**2 * first.max()  # but where bricks are wedges
        at = (now[spanned] / first[spanned]).min()
        if at < NEARLY:
            return f"a corner of an element of {name} has {at:.1%} of its volume"
    return ""
