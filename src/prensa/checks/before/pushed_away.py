"""Bodies that tools push away, since nothing stands behind them: whether a direction leaves all tools, by statics alone."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.contact.pairing import Pairs
from prensa.contact.surface import Surface
from prensa.linear.rigid_modes import CLOSED, Frame, support_rows
from prensa.model import problem as model
from prensa.model.feed import ends_early
from prensa.model.problem import tools_removed
from prensa.system.moments import moments, stages
from prensa.system.once import once
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array, Flags


class Met(NamedTuple):
    """A contact with a tool: places x (k, d) of its nodes at first, what they see of it, and whether it rubs in a step."""

    surface: Surface
    x: Array
    pairs: Pairs
    rubs: bool


def met_by(system: System, body: str, plan: StepPlan) -> Iterator[Met]:
    """The contacts with tools of a body and of those tied to it."""
    u = system.initial().u
    x = system.positions(u)
    for s, law in zip(system.tool_contacts, plan.friction_at(plan.t1)):
        if s.body in system.tied_bodies(body):
            own = x[s.points.nodes]
            yield Met(s, own, system.tool_masters[s.against].seen(own, u), not system.frictionless(law))


def flight(system: System, body: str, frame: Frame, plan: StepPlan) -> Array | None:
    """The translation (d,) by which a body leaves all tools at once, and which its supports allow; 0 if there is none.

    None where nothing is asked of the contacts: loads may press it against the tools, or no tool is driven towards it.
    """
    if loaded(system, system.tied_bodies(body), plan.number):
        return None
    normals, ways, driven = [], [], False
    at, moved = plan.values(plan.t0), plan.values(plan.t1)
    for met in met_by(system, body, plan):
        n = met.pairs.n[~np.isnan(met.pairs.g)]
        normals.append(pressing(met, ~np.isnan(met.pairs.g)))
        own = system.tool_masters[met.surface.against].dofs
        way = np.array([float((moved - at)[plan.fixed == dof].sum()) for dof in own[: n.shape[1]]])
        driven |= bool(np.isin(own, list(plan.push)).any() or (n @ way > 0.0).any())
        ways += [way, *_either_way(np.isin(own[: n.shape[1]], list(plan.push)))]
    if not driven or not sum(map(len, normals)):
        return None
    cone, free = np.concatenate(normals), translations(system, frame, plan)
    return _leaving(cone, free, ways) if free.shape[1] else np.zeros(system.dofs.dimension)


def _either_way(axes: Flags) -> Array:
    """Unit vectors (2 k, d) along those of the axes (d,), and against them."""
    along = np.eye(len(axes))[axes]
    return np.concatenate([along, -along])


def _leaving(cone: Array, free: Array, ahead: Sequence[Array]) -> Array:
    """A direction (d,) among the ``free`` ones (d, k) along all of vectors (n, d), of tools ``ahead`` if it may be; 0 of none."""
    along = [free @ (free.T @ way) for way in ahead] + [free @ _along_all(cone @ free)]
    leaves = ((cone @ a > NO_DIFFERENCE * np.linalg.norm(a)).all() for a in along)
    return next((a for a, out in zip(along, leaves) if out and a.any()), np.zeros(len(free)))


def pressing(met: Met, there: Flags) -> Array:
    """Directions (k, d) that span the forces of a tool on the points that are ``there``.

    Friction up to the pressure itself may hold a body, as rolls grip a strip: no force of that cone may push it back.
    """
    n, tangents = met.pairs.n[there], np.moveaxis(met.pairs.e[there], 1, 0)
    return np.concatenate([n[:0], *(n + side * e for e in tangents for side in (1.0, -1.0))]) if met.rubs else n


def translations(system: System, frame: Frame, plan: StepPlan) -> Array:
    """Directions (d, k) in which supports let a body move as a whole."""
    from scipy.linalg import null_space

    d = system.dofs.dimension
    held = support_rows(system, frame, plan)[:, :d]
    if system.axisymmetric:
        held = np.concatenate([held, [[1.0, 0.0]]])
    return np.asarray(null_space(held, rcond=NO_DIFFERENCE)) if len(held) else np.eye(d)


class Flight(NamedTuple):
    """The ``way`` (d,) in which a body flies in a step, 0 if something resists; ``always``: wherever it comes to."""

    way: Array
    always: bool


@once
def flights(system: System) -> dict[str, list[Flight | None]]:
    """Whether what presses a body pushes it away, in each step; None where nothing is asked of its contacts."""
    found: dict[str, list[Flight | None]] = {}
    for body, frame in Frame.of_all(system).items():
        steps: list[Flight | None] = []
        thrown = system.problem.start is None  # from the beginning on, so that it is undeformed where it comes to
        for stage in stages(system):
            removed = tools_removed(system.problem, stage.plan.number)
            way = None if removed else flight(system, body, frame, stage.plan)
            always = way is not None and bool(way.any()) and _faces_alike(system, body, frame, stage.plan)
            if way is not None and not always and thrown:
                past = thrown_past(system, body, frame, stage.plan)
                way, always = (past, True) if past.any() else (way, False)
            thrown &= not removed and (way is None or bool(way.any()))
            thrown &= not loaded(system, system.tied_bodies(body), stage.plan.number)
            steps.append(None if way is None else Flight(way, always))
        found[body] = steps
    return found


class _Course(NamedTuple):
    """Ways (t, d) of a tool from the beginning on, and the axes (d,) along which a force takes it as far as it goes."""

    ways: Array
    pushed: Flags


def thrown_past(system: System, body: str, frame: Frame, plan: StepPlan) -> Array:
    """As `flight`, of tools that a body meets as it is thrown from the beginning to the end of a step; 0 if one may resist.

    The body goes along in one direction as far as tools push it; a point is met where its gap at first is no more than the way of
    its tool relative to the body. What stands farther off does not hold it, nor does the flank of a ball that never comes to it.
    """
    d, mets, free = system.dofs.dimension, list(met_by(system, body, plan)), translations(system, frame, plan)
    none, courses = np.zeros(d), _courses(system, frame, mets, plan)
    if not courses:
        return none
    endless, there = any(c.pushed.any() for c in courses), []
    for met, course in zip(mets, courses):
        near = np.nanmin(met.pairs.g) if course.ways.any() or course.pushed.any() else 0.0
        close = met.pairs.g <= near + CLOSED * float(met.surface.points.depth.min())
        # beside a tool that goes as far as something stops it, all others are met
        there.append(~np.isnan(met.pairs.g) if endless and not course.pushed.any() else close)
    ahead = [way for c in courses for way in (c.ways[-1], *_either_way(c.pushed))]
    while free.shape[1] and any(here.any() for here in there):
        cone = np.concatenate([pressing(met, here) for met, here in zip(mets, there)])
        away = _leaving(cone, free, ahead)
        if not away.any() or any(c.pushed.any() and np.abs(away[~c.pushed]).any() for c in courses):
            return none
        past = _past(mets, courses, there, away)
        more = [here | (met.pairs.g <= np.linalg.norm(of, axis=1).max()) for here, met, of in zip(there, mets, past)]
        if all(np.array_equal(now, before) for now, before in zip(more, there)):
            pushed = endless or any((c.ways != of).any() for c, of in zip(courses, past))  # else nothing comes to it
            resisted = (_turns_against(system, met, of, here, away) for met, of, here in zip(mets, past, there))
            return away if pushed and not any(resisted) else none
        there = more
    return none


def _courses(system: System, frame: Frame, mets: Sequence[Met], plan: StepPlan) -> list[_Course]:
    """The courses of the tools that a body meets, to the end of a step; empty where they are not known, or the body is moved."""
    d, u = system.dofs.dimension, system.initial().u
    until = [stage.plan for stage in stages(system) if stage.plan.number <= plan.number]
    own, tools = system.dofs.displacement.dofs(frame.nodes), system.dofs.tool.dofs(np.arange(len(system.tools)))
    ways = []
    for m in moments(system):
        if m.plan.number > plan.number:
            break
        if (m.u[own] != u[own]).any():
            return []
        ways.append(m.u[tools] - u[tools])
    if any(ends_early(system.problem.steps[p.number]) for p in until[:-1]):
        return []
    courses = []
    for met in mets:
        master = system.tool_masters[met.surface.against]
        dofs, moved = master.dofs, np.array(ways)[:, master.number]
        pushed = np.array([any(dof in p.push for p in until) for dof in dofs.tolist()])
        given = np.array([all(dof in p.fixed for p in until) for dof in dofs.tolist()])
        if moved[:, d:].any() or pushed[d:].any() or not (pushed | given).all() or (pushed.any() and moved.any()):
            return []
        courses.append(_Course(moved[:, :d], pushed[:d]))
    return courses


def _past(mets: Sequence[Met], courses: Sequence[_Course], there: Sequence[Flags], away: Array) -> list[Array]:
    """Ways (t, d) of tools past a body that goes along ``away`` (d,) as far as the points that are ``there`` push it."""
    share = np.zeros(len(courses[0].ways))
    for met, course, here in zip(mets, courses, there):
        n, g = met.pairs.n[here], np.maximum(met.pairs.g[here], 0.0)
        share = np.maximum(share, ((course.ways @ n.T - g) / (n @ away)).max(axis=1, initial=0.0))
    gone = np.outer(np.maximum.accumulate(share), away)
    return [np.zeros_like(gone) if c.pushed.any() else c.ways - gone for c in courses]


def _turns_against(system: System, met: Met, past: Array, here: Flags, away: Array) -> bool:
    """Whether points come to flanks of a tool that press against ``away`` (d,), on its ways ``past`` (t, d) them."""
    master, u = system.tool_masters[met.surface.against], system.initial().u
    if master.shape.half_space or not here.any():
        return False
    apart = np.unique(past[np.linalg.norm(past, axis=1) > 0.0], axis=0)
    seen = (met._replace(pairs=master.seen(met.x[here] - way, u)) for way in apart)
    return any((pressing(of, ~np.isnan(of.pairs.g)) @ away <= NO_DIFFERENCE * np.linalg.norm(away)).any() for of in seen)


def never_resisted(system: System) -> set[str]:
    """Bodies that whatever presses them pushes away, in all steps that press them, wherever they come to on the way.

    What an earlier run left may be held by it.
    """
    if system.problem.start is not None:
        return set()
    asked = {body: [flight.always for flight in steps if flight is not None] for body, steps in flights(system).items()}
    return {body for body, always in asked.items() if always and all(always)}


def _faces_alike(system: System, body: str, frame: Frame, plan: StepPlan) -> bool:
    """Whether a body that is pushed away sees the same normals all along: of planes, or of the one tool that it goes with."""
    at, moved, d = plan.values(plan.t0), plan.values(plan.t1), system.dofs.dimension
    tools = [system.tool_masters[t] for t in {met.surface.against for met in met_by(system, body, plan)}]
    ways = np.zeros((len(tools), len(tools[0].dofs)))
    for way, master in zip(ways, tools):
        own = np.isin(plan.fixed, master.dofs)
        way[np.searchsorted(master.dofs, plan.fixed[own])] = (moved - at)[own]
        if way[d:].any() or np.isin(master.dofs[d:], list(plan.push)).any():
            return False
    if all(master.shape.half_space for master in tools):
        return True
    pushed = np.isin(tools[0].dofs, list(plan.push)).any()
    goes_along = np.abs(support_rows(system, frame, plan)[:, :d] @ ways[0, :d]) <= NO_DIFFERENCE * np.abs(ways[0, :d]).max()
    return len(tools) == 1 and not pushed and bool(goes_along.all())


def _along_all(n: Array) -> Array:
    """The direction (d,) that has the largest angle to being across any of vectors n (k, d), if there is one."""
    if n.shape[1] == 1:
        return np.sign(n[0])
    if n.shape[1] == 3:
        return _along_all_in_space(n)
    angles = np.sort(np.arctan2(n[:, 1], n[:, 0]))
    gaps = np.diff(angles, append=angles[0] + 2.0 * np.pi)
    # opposite to the middle of the largest sector without a vector
    opposite = angles[np.argmax(gaps)] + 0.5 * float(gaps.max()) + np.pi
    return np.array([np.cos(opposite), np.sin(opposite)])


def _along_all_in_space(n: Array) -> Array:
    """The direction (3,) in the cube about the origin that goes farthest along all of vectors n (k, 3) at once."""
    from scipy.optimize import linprog

    behind = np.hstack([-n, np.ones((len(n), 1))])
    found = linprog([0.0, 0.0, 0.0, -1.0], behind, np.zeros(len(n)), bounds=[(-1.0, 1.0)] * 3 + [(0.0, None)])
    return np.asarray(found.x[:3]) if found.success else np.zeros(3)


def loaded(system: System, bodies: Collection[str], number: int) -> bool:
    """Whether loads of the problem, or of step *number* (from 0), act on some bodies."""
    p = system.problem
    owners: list[model.Problem | model.Step] = [p, p.steps[number]]
    return any(name.partition(".")[0] in bodies for owner in owners for name in (*owner.loads, *owner.body_force))
