"""Bodies in space that tools press along walls, with nothing beyond: friction of the walls alone holds them, or nothing does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from prensa.checks.before.joint_motions import axis_in_words
from prensa.checks.before.pushed_away import Met, flights, met_by, translations
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding, Severity
from prensa.linear.rigid_modes import Frame
from prensa.model.problem import tools_removed
from prensa.system.moments import SAMPLES, stages
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array


def walls(system: System) -> Iterator[Finding]:
    """Bodies that only walls along their way hold against what presses them, by their friction."""
    if system.dofs.dimension == 2 or system.problem.body_contacts or system.problem.start is not None:
        return
    reported: set[str] = set()
    for stage in stages(system):
        if tools_removed(system.problem, stage.plan.number):
            return
        for body, frame in Frame.of_all(system).items():
            flight = flights(system)[body][stage.plan.number]  # None of loaded ones too
            if body in reported or flight is None or flight.way.any():
                continue
            for finding in _along_walls(system, body, frame, stage.plan):
                reported.add(body)
                yield finding


def _along_walls(system: System, body: str, frame: Frame, plan: StepPlan) -> Iterator[Finding]:
    """What there is to say of a body in a step: its tools press it along one way, or stand along that way.

    Points of these count that are no farther off than the body goes, where it is on its way; a force may drive it by its length.
    """
    free, mets = translations(system, frame, plan), list(met_by(system, body, plan))
    at, moved = plan.values(plan.t0), plan.values(plan.t1)
    pressing, beside = list[Met](), list[Met]()
    for met in mets:
        dofs = system.tool_masters[met.surface.against].dofs
        changes = bool((at != moved)[np.isin(plan.fixed, dofs)].any() or np.isin(dofs, list(plan.push)).any())
        (pressing if changes else beside).append(met)
    if not pressing or not beside:
        return
    normals = np.concatenate([met.pairs.n[~np.isnan(met.pairs.g)] for met in pressing])
    along = free @ (free.T @ normals.sum(axis=0))
    size = float(np.linalg.norm(along))
    if size <= NO_DIFFERENCE * len(normals):
        return
    along /= size
    dofs = np.concatenate([system.tool_masters[met.surface.against].dofs for met in pressing])
    pushed = bool(np.isin(dofs, list(plan.push)).any())
    goes = system.length if pushed else float(np.linalg.norm((moved - at)[np.isin(plan.fixed, dofs)]))
    facing = np.concatenate([_seen(system, met, along, goes) for met in beside]) @ along
    if (normals @ along <= NO_DIFFERENCE).any() or not len(facing) or (np.abs(facing) > NO_DIFFERENCE).any():
        return
    if pushed and not any(met.rubs for met in beside):
        return  # `joint_motions` says that they go together
    rubs = _tools(met for met in beside if met.rubs)
    what = f"only friction of {rubs} holds it" if rubs else f"nothing holds it, with {_tools(beside)} beside its way and smooth,"
    yield Finding(
        f"bodies.{body}",
        f"{what} along {axis_in_words(along)} against {_tools(pressing)} in step {plan.name!r}: hold its other side with "
        f"'fixed', or let a tool stand against it{', unless it is to slide there' * bool(rubs)}",
        Severity.WARN if rubs else Severity.REFUSE,
    )


def _tools(mets: Iterable[Met]) -> str:
    """Tools, each once, in words."""
    return " and ".join(dict.fromkeys(repr(met.surface.against) for met in mets))


def _seen(system: System, met: Met, along: Array, goes: float) -> Array:
    """Normals (k, 3) of a tool at the points of a contact that come to it as they go by ``goes`` along a unit vector (3,)."""
    out, master, u = list[Array](), system.tool_masters[met.surface.against], system.initial().u
    for way in np.linspace(0.0, goes, SAMPLES):
        seen = master.seen(met.x + way * along, u)
        out.append(seen.n[seen.g <= goes - way])
    return np.concatenate(out)
