"""Whether a run in space that stopped had a reason which its files show: nothing here is shared with the solver.

No share is chosen: a reason is confirmed where it holds at the last state, or at the one that the shortest refused attempt would
have reached if all had gone on as in the last increment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from prensa.mesh.generate import mesh_of
from prensa.types import Array, Index
from prensa_bench.robustness.cells_in_space import jacobians
from prensa_bench.robustness.checks_in_space import BEYOND_CONE, XYZ, touchings
from prensa_bench.robustness.drawn import Drawn
from prensa_bench.robustness.files import Record

AS_GOOD_AS_NONE = 1e-9  # of the largest: what corners of undeformed wedges span, and rigid motions that nothing resists


class Ends(NamedTuple):
    """The last three states of a run that follow each other: times (3,), places (3, n, 3) of nodes; the first may be the start.

    ``share``: length of the shortest refused attempt over that of the last increment.
    """

    time: Array
    x: Array
    share: float


def confirmed(d: Drawn, record: Record, reason: str) -> str:
    """What the files show of the reason for which a run stopped, in words; '' if nothing."""
    looks: dict[str, Callable[[Drawn, Record], str]] = {
        "LimitPoint": limit, "Unstable": limit, "Jumped": limit, "Runaway": limit, "Singular": limit,
        "LostSupport": unheld, "UnilaterallySupported": unheld, "TipsOver": tipping,
        "Distorted": folded, "CornerInverted": folded, "Collapsed": folded, "Folded": folded,
    }  # fmt: skip
    kinds = [look for key, look in looks.items() if key in reason.replace(".", " ").split() or reason.startswith(key)]
    if not record.bodies or len(record.steps) < 2:
        return ""
    return next((found for look in dict.fromkeys(kinds) if (found := look(d, record))), "")


def limit(d: Drawn, record: Record) -> str:
    """Of the load or of the way, or of where a tool can rest; a support that is gone, or an element that gave way."""
    return next((found for look in (turning_back, tipping, unheld, folded) if (found := look(d, record))), "")


def ends(record: Record) -> Ends | None:
    """The last states of a run; None where they do not follow each other within its last step."""
    numbers = record.history["increment"].astype(int)[-3:]
    if len(numbers) < 2 or record.steps[-1] != record.steps[-2] or not set(numbers) <= set(record.bodies):
        return None
    x = [np.concatenate([s.x for s in record.bodies[n].values()]) for n in numbers]
    time = record.history["time"][-3:]
    if len(numbers) == 2:
        x, time = [np.concatenate([s.X for s in record.bodies[numbers[0]].values()]), *x], np.append(0.0, time)
    return Ends(time, np.array(x), float(record.refused / (time[2] - time[1])))


def turning_back(d: Drawn, record: Record) -> str:
    """The current stiffness parameter (Bergan 1980) vanishes no farther from the last state than the shortest refused attempt.

    It is the slope of what drives the bodies, the time of the step, over how far their nodes go: of forces that grow with time it
    is the stiffness against travel. A parabola through the last three states has it and its change: at its top the slope changes
    its sign. Where that lies farther off, on either side, three states do not tell it from a kink, as of metal that yields.
    """
    if (e := ends(record)) is None:
        return ""
    before, last = np.diff(e.x, axis=0)
    size = float(np.linalg.norm(last))
    way = np.array([float((before * last).sum()) / max(size, np.finfo(float).tiny), size])
    if not (way > 0.0).all():
        return ""
    slope = np.diff(e.time) / way
    falls = (slope[0] - slope[1]) / way.sum()  # half the curvature, downwards
    now = float(slope[1] - falls * way[1])
    if falls <= 0.0 or (top := now**2 / (4.0 * falls)) > record.refused:
        return ""
    return (
        f"the stiffness against travel is {now / slope[0]:.1%} of that before, and vanishes at {top:.1e} of time from the last "
        f"state, after which {record.refused:.1e} was refused"
    )


def tipping(d: Drawn, record: Record) -> str:
    """The force of a tool that is free to turn acts beside what it rests on, or would at the end of the refused attempt."""
    states = [(row, c, t) for row, c, t in touchings(d, record) if row >= len(record.steps) - 2]
    for name in record.problem.tools:
        own = [(row, t) for row, c, t in states if c.against == name]
        if not _free_to_tilt(record, name) or len(own) < 2:
            continue
        rest = [t.x[np.linalg.norm(t.force, axis=1) > 0.0] for _, t in own]
        if len(rest[-1]) < 3:
            return f"{name} rests on {len(rest[-1])} nodes"
        then, now = (within(r[:, [0, 2]], _acts_at(d, record, name, row, r[:, 1].mean())) for (row, _), r in zip(own, rest))
        dt = float(np.diff(record.history["time"][-2:])[0])
        beyond = now + (now - then) * record.refused / dt
        if min(now, beyond) <= 0.0:
            return f"the force of {name} acts {now:.2g} within the edge of its rest, and {beyond:.2g} after the refused time"
    return ""


def _free_to_tilt(record: Record, name: str) -> bool:
    """Whether a tool is pushed with no moments about the axes along its ground in the last step."""
    step = next(s for s in record.problem.steps if s.name == record.steps[-1])
    push = step.push.get(name)
    return push is not None and push.mx is not None and push.mz is not None


def _acts_at(d: Drawn, record: Record, name: str, row: int, height: float) -> Array:
    """Where (x, z) the line of action of the force on a tool passes a height."""
    h = record.history
    f, m, u = (np.array([h[f"{name}.{key}{a}"][row] for a in XYZ]) for key in "fmu")
    at = np.asarray(d.tools[name].at) + u + np.cross(f, m) / float(f @ f)
    return np.asarray((at + f * (height - at[1]) / f[1])[[0, 2]])


def within(points: Array, x: Array) -> float:
    """Distance of a point (2,) from the nearest side of the convex hull of points (k, 2); negative outside."""
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return float((((points - x) @ way.T).max(axis=0)).min())


def unheld(d: Drawn, record: Record) -> str:
    """A rigid motion of a body that no support, pressed or sticking node resists, now or at the end of the refused attempt.

    Of bodies that are not tied, before anything is released: the solver holds what has been.
    """
    done = record.problem.steps[: [s.name for s in record.problem.steps].index(record.steps[-1]) + 1]
    if record.problem.ties or any(s.remove_tools or any(f.free for f in s.fixed.values()) for s in done):
        return ""
    number, states = max(record.bodies), [(row, c, t) for row, c, t in touchings(d, record) if row >= len(record.steps) - 2]
    dt = float(np.diff(record.history["time"][-2:])[0])
    for name, s in record.bodies[number].items():
        rows = [_resists(s.x[nodes], ways) for nodes, ways in _supports(record, name, s.X)]
        for c in record.problem.contacts:
            own = [t for _, other, t in states if other.name == c.name]
            if c.surface[0].partition(".")[0] != name or not own:
                continue
            t, before = own[-1], own[0].force if len(own) > 1 else own[-1].force
            if before.shape == t.force.shape:
                t = t._replace(force=t.force + (t.force - before) * record.refused / dt)
            pressed = (across := (t.force * t.normal).sum(axis=1)) > 0.0
            along = np.linalg.norm(t.force - across[:, None] * t.normal, axis=1)
            sticks = pressed & (along < d.mu[c.name] * across * (1.0 - BEYOND_CONE))
            rows += [_resists(t.x[pressed], t.normal[pressed, None]), _resists(t.x[sticks], np.eye(3))]
        all_rows = np.concatenate([np.zeros((1, 6)), *rows])
        scale = np.append(np.ones(3), np.full(3, 1.0 / float(np.ptp(s.x, axis=0).max())))
        if (held := int(np.linalg.matrix_rank(all_rows * scale, tol=AS_GOOD_AS_NONE))) < 6:
            return f"nothing resists {6 - held} of the rigid motions of {name}"
    return ""


def _resists(x: Array, ways: Array) -> Array:
    """Rows (k, 6) of rigid motions, shift and turn, that nodes x (n, 3) held along ways (n | 1, w, 3) or (w, 3) resist."""
    ways = np.broadcast_to(ways, (len(x), *np.shape(ways)[-2:]))
    return np.concatenate([ways, np.cross(x[:, None], ways)], axis=2).reshape(-1, 6)


def _supports(record: Record, body: str, X: Array) -> Iterator[tuple[Index, Array]]:
    """Nodes of a body that are held in the last step, and the directions (w, 3) along which they are."""
    p, mesh = record.problem, mesh_of(record.problem.bodies[body].mesh)
    done = p.steps[: [s.name for s in p.steps].index(record.steps[-1]) + 1]
    for name, given in (pair for supports in (p.fixed, *(s.fixed for s in done)) for pair in supports.items()):
        if name.partition(".")[0] != body:
            continue
        nodes = mesh.nodes(name.partition(".")[2])
        ways = [way for axis, way in zip(XYZ, np.eye(3)) if getattr(given, axis) is not None]
        if given.normal is not None:  # of a flat side
            ways.append(np.linalg.svd(X[nodes] - X[nodes].mean(axis=0))[2][2])
        yield nodes, np.array(ways).reshape(-1, 3)


def folded(d: Drawn, record: Record) -> str:
    """An element with a negative volume at a corner or an integration point, now or at the end of the refused attempt."""
    e = ends(record)
    for name, s in record.bodies[max(record.bodies)].items():
        places = {"now": s.x}
        if e is not None:
            before = record.bodies[int(record.history["increment"][-2])][name].x
            places["at the end of the refused attempt"] = s.x + e.share * (s.x - before)
        first = jacobians(s.cells, s.X)
        spanned = first > AS_GOOD_AS_NONE * first.max()  # corners of wedges are none
        for when, x in places.items():
            at = np.where(spanned, jacobians(s.cells, x) / np.where(spanned, first, 1.0), np.inf).min(axis=1)
            if at.min() <= 0.0:
                return f"element {int(np.argmin(at))} of {name} has {at.min():.1%} of its volume at a corner or point, {when}"
    return ""
