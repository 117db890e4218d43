"""How far tools, and sides that are moved, press strips of a body in the steps.

By their motions, as far as metal yields to the forces of tools, or until steps end.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.model.feed import ends_early
from prensa.model.problem import Step
from prensa.system.bending import EndMotions, Thickness, gaps_across
from prensa.system.moments import Moment, moments, stages
from prensa.system.system import System
from prensa.types import Array, Flags, Index


def pressings(system: System, body: str, t: Thickness, of_forces: Array) -> Iterator[tuple[Moment, Array, Index, EndMotions]]:
    """All moments, with gaps (s, 2) at the ends of the strips (s,) of a body, the numbers (s, 2) of contacts and motions there.

    As of `gaps_across`. ``of_forces`` (n, c, s): gaps down to which the largest forces up to each of n steps press, by contacts c
    of tools; inf: none. What a step lets a tool press at most, with forces, or at least, the next motions of the tool add to.
    """
    forced = np.repeat(of_forces[..., None], 2, axis=3)
    number = np.array([system.tool_masters[s.against].number for s in system.tool_contacts], dtype=np.int64)
    dofs = system.dofs.tool.dofs(np.arange(len(system.tools)))[:, : system.dofs.dimension]
    plan, sure = None, np.ones((len(number), 1, 1), dtype=bool)
    gaps = np.full(forced.shape[1:], np.inf)
    for m, moved in end_motions(system, body, t):
        if m.known.all():
            sure = np.ones((len(number), 1, 1), dtype=bool)
            yield (m, *gaps_across(system, body, t, m, gaps, moved), moved)
            continue
        asked = _asked(system, body, t, m, moved)
        if m.plan is not plan:
            plan, first, begun = m.plan, asked, np.where(sure, asked, gaps)
            placed = np.isin(dofs[number], plan.fixed)[:, None, :].all(axis=2, keepdims=True)
            forces, step = forced[plan.number], system.problem.steps[plan.number]
            ends = _travels_awaited(system, body, t, m, moved, begun)
        both = np.isfinite(asked) & np.isfinite(first)  # what faces no strip does not press it
        way = np.where(both, asked, np.inf) - np.where(both, first, 0.0)
        gaps = np.where(sure, asked, begun + way)
        if ends_early(step):
            sets = np.isfinite(forces) | _waits_for_travel_alone(system, step)[:, None, None]
            least = np.where(np.isfinite(forces), forces, -np.inf)
            gaps = np.where(sets, np.maximum(gaps, np.maximum(least, ends)), np.maximum(gaps, begun))
        gaps = np.where(placed, gaps, np.maximum(forces, ends))
        yield (m, *gaps_across(system, body, t, m, gaps, moved), moved)
        if m.t == plan.t1:
            sure = m.known[number][:, None, None]


def end_motions(system: System, body: str, t: Thickness) -> Iterator[tuple[Moment, EndMotions]]:
    """All moments, with what supports prescribe of the ends of the strips of a body.

    Of a step that may end on its way, what is sure is taken: no way that presses, all of one that opens; later ways add to it,
    and a motion to a given place finds the end again. A side that is fed goes all the way where metal resists it.
    """
    ends, part = t.ends + system.offsets[body], np.abs(t.across)[:, None, None, :]
    outward = np.stack([-t.across, t.across], axis=1)
    plan, now = None, np.zeros(outward.shape)
    for m in moments(system):
        there = system.displacement(m.u)[ends].mean(axis=2)
        if m.plan is not plan:
            plan, first, begun, waits = m.plan, there, now, system.problem.steps[m.plan.number].until is not None
            fixed = _prescribed(system, plan.fixed)[ends]
            given = ((fixed & (part > np.sqrt(0.5))).any(axis=3) | (fixed | (part <= NO_DIFFERENCE)).all(axis=3)).all(axis=2)
            after = plan.fixed[stages(system)[plan.number].known_after[plan.fixed]]
            found = np.asarray((_prescribed(system, after)[ends] | ~fixed).all(axis=(2, 3)))
        way = there - first
        opens = np.asarray((way * outward).sum(axis=2) > 0.0)
        now = begun + (np.where(opens[:, :, None], way, 0.0) if waits else way)
        if m.t == plan.t1:
            now = np.where(found[:, :, None], there, now)
        yield m, EndMotions(given, now, given & (now != there).any(axis=2))


def _prescribed(system: System, fixed: Index) -> Flags:
    """Components (n, d) of all nodes that ``fixed`` unknowns prescribe, those of nodes that ties make follow such too."""
    field = system.dofs.displacement
    return np.isin(field.dofs(np.arange(field.count)), system.prescribed(fixed))


def _asked(system: System, body: str, t: Thickness, m: Moment, moved: EndMotions) -> Array:
    """Gaps (c, s, 2) by contacts of tools to where each tool is without forces and early ends; inf where it faces no strip."""
    out = np.full((len(system.tool_contacts), len(t.size), 2), np.inf)
    for i, s in enumerate(system.tool_contacts):
        if s.body != body:
            continue
        alone = np.arange(len(system.tools)) == system.tool_masters[s.against].number
        gaps, contacts = gaps_across(system, body, t, m._replace(known=alone), np.full(1, np.inf), moved)
        out[i] = np.where(contacts == i, gaps, np.inf)
    return out


def _travels_awaited(system: System, body: str, t: Thickness, m: Moment, moved: EndMotions, begun: Array) -> Array:
    """Gaps (c, s, 2) to tools that have gone as far as their step waits for; -inf: it does not, or they go no further for it.

    ``begun`` (c, s, 2): gaps at its start, the moment m.
    """
    until, u = system.problem.steps[m.plan.number].until, m.u.copy()
    for name, travel in (until.travel if until is not None else {}).items():
        dofs = system.dofs.tool.dofs(system.tool_masters[name].number)[: system.dofs.dimension]
        for dof, key in zip(dofs, "xyz"):
            u[dof] = m.u[dof] if getattr(travel, key) is None else getattr(travel, key)
    there = _asked(system, body, t, m._replace(u=u), moved)
    return np.where(there < begun, there, -np.inf)


def _waits_for_travel_alone(system: System, step: Step) -> Flags:
    """Contacts (c,) of tools whose travel is all that a step waits for."""
    until = step.until
    if until is None or step.feed or until.measure or until.damage:
        return np.zeros(len(system.tool_contacts), dtype=bool)
    awaited = {(kind, name) for kind, name, *_ in until.criteria()}
    return np.array([awaited == {("travel", s.against)} for s in system.tool_contacts], dtype=bool)
