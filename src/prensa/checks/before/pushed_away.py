"""Bodies that tools push away, since nothing stands behind them: whether a direction leaves all tools, by statics alone."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.contact.pairing import Pairs
from prensa.contact.surface import Surface
from prensa.linear.rigid_modes import Frame, support_rows
from prensa.model import problem as model
from prensa.model.problem import tools_removed
from prensa.system.moments import stages
from prensa.system.once import once
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array


class Met(NamedTuple):
    """A contact with a tool: places x (k, 2) of its nodes at first, what they see of it, and whether it rubs in a step."""

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
    from scipy.linalg import null_space

    if loaded(system, system.tied_bodies(body), plan.number):
        return None
    normals, driven = [], False
    at, moved = plan.values(plan.t0), plan.values(plan.t1)
    for met in met_by(system, body, plan):
        seen = ~np.isnan(met.pairs.g)
        n, tangents = met.pairs.n[seen], np.moveaxis(met.pairs.e[seen], 1, 0)
        # Friction up to the pressure itself may hold it, as rolls grip a strip: no force of that cone may push it back.
        normals += [n + side * e for e in tangents for side in (1.0, -1.0)] if met.rubs else [n]
        own = system.tool_masters[met.surface.against].dofs
        way = np.array([float((moved - at)[plan.fixed == dof].sum()) for dof in own[: n.shape[1]]])
        driven |= bool(np.isin(own, list(plan.push)).any() or (n @ way > 0.0).any())
    if not driven or not sum(map(len, normals)):
        return None
    cone = np.concatenate(normals)
    d = system.dofs.dimension
    held = support_rows(system, frame, plan)[:, :d]
    if system.axisymmetric:
        held = np.concatenate([held, [[1.0, 0.0]]])
    free = null_space(held, rcond=NO_DIFFERENCE) if len(held) else np.eye(d)
    if not free.shape[1]:
        return np.zeros(d)
    away = free @ _along_all(cone @ free)
    return away if (cone @ away > NO_DIFFERENCE).all() else np.zeros(d)


@once
def never_resisted(system: System) -> set[str]:
    """Bodies that whatever presses them pushes away, in all steps that press them, wherever they come to on the way.

    What an earlier run left may be held by it.
    """
    frames = Frame.of_all(system)
    ways: dict[str, list[bool]] = {body: [] for body in frames}
    for stage in stages(system) if system.problem.start is None else ():
        for body, frame in frames.items():
            if not tools_removed(system.problem, stage.plan.number):
                way = flight(system, body, frame, stage.plan)
                ways[body] += [] if way is None else [bool(way.any()) and _faces_alike(system, body, frame, stage.plan)]
    return {body for body, found in ways.items() if found and all(found)}


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
