"""Small-strain kinematics where tools or supports go too far for it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.during.validity import STRAIN_LIMIT
from prensa.checks.thresholds import ALONG
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.system.moments import Stage, stages
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array


def small_strain(system: System) -> Iterator[Finding]:
    """Tools that press bodies in, or supports that move apart, by a share of the distance that 'small' does not hold for."""
    if system.problem.kinematics != "small" or system.problem.allow_large_strain:
        return
    reached: dict[str, tuple[float, float]] = {}
    driven_by: dict[str, tuple[float, float]] = {}
    for stage in stages(system):
        for found, into in ((pressed_far(system, stage), reached), (driven_apart(system, stage), driven_by)):
            for body, way, far in found:
                into[body] = max(into.get(body, (0.0, 1.0)), (way, far), key=lambda r: r[0] / r[1])
    yield from _small(reached, "tools press {} in by {:.4g} at {:.4g} from its support")
    yield from _small(driven_by, "supports of {} move by {:.4g} against each other, {:.4g} apart")


def pressed_far(system: System, stage: Stage) -> Iterator[tuple[str, float, float]]:
    """Body, share and distance of the deepest reach of tools at the end of a step, all of known places.

    The mean displacement gradient between a pressed node and a held one is at least the way over the distance. Both ends of
    the step are looked at: a tool may be on the far side of a thin body in the end, if that does not bend.
    """
    plan, begun, u, known = stage.plan, stage.start, stage.end, stage.known_after
    for s in system.tool_contacts:
        if not known[system.tool_masters[s.against].dofs].all():
            continue
        way = (system.tool_masters[s.against].place(u) - system.tool_masters[s.against].place(begun))[: system.dofs.dimension]
        found = [_reach(system, s, plan, u, 0.0 * way), _reach(system, s, plan, begun, way)]
        deepest = max((f for f in found if f is not None), default=None, key=lambda f: f[0] / f[1])
        if deepest is not None:
            yield s.body, *deepest


def _reach(system: System, s: Surface, plan: StepPlan, u: Array, way: Array) -> tuple[float, float] | None:
    """How deep a tool presses a node in by a way (d,) from dofs u, and how far that is from what holds it against that."""
    pairs = system.nodes_seen(s, u)
    # Supports hold along axes: only what is pressed along one of them is held against it.
    k = int(np.argmin(np.where(np.abs(pairs.n).max(axis=1) > ALONG, pairs.g, np.inf)))
    depth, axis = float(way @ pairs.n[k] - pairs.g[k]), int(np.argmax(np.abs(pairs.n[k])))
    if not depth > 0 or abs(pairs.n[k, axis]) < ALONG:
        return None
    nodes, along = system.dofs.displacement.split(plan.fixed[system.dofs.displacement.owns(plan.fixed)])
    mine = (along == axis) & system.has(s.body, nodes)
    x = system.positions(u)
    far = float(np.linalg.norm(x[nodes[mine]] - x[s.points.nodes[k]], axis=1).min()) if mine.any() else 0.0
    return (depth, far) if far > float(s.points.depth.min()) else None


def driven_apart(system: System, stage: Stage) -> Iterator[tuple[str, float, float]]:
    """Body, way and distance of any two of its supports that a step moves against each other along one axis.

    Taken between their middles: the mean displacement gradient on the way from one to the other.
    """
    field, u = system.dofs.displacement, stage.end
    held: list[tuple[str, str, Array, float]] = []
    for g in stage.plan.groups:
        if g.support is None or not len(g.dofs):
            continue
        name, axis = g.support
        nodes, _ = field.split(g.dofs)
        here = (name.partition(".")[0], axis, system.X[nodes].mean(axis=0), float(u[g.dofs].mean()))
        for body, along, middle, value in held:
            far = float(np.linalg.norm(here[2] - middle))
            if (body, along) == here[:2] and far > 0 and here[3] != value:
                yield body, abs(here[3] - value), far
        held.append(here)


def _small(reached: dict[str, tuple[float, float]], words: str) -> Iterator[Finding]:
    """Small-strain kinematics where tools or supports go too far for it; ``words`` of the body, the way and the distance."""
    for body, (depth, far) in reached.items():
        if depth > STRAIN_LIMIT * far:
            yield Finding(
                "kinematics",
                words.format(repr(body), depth, far)
                + f", strains or rotations of {depth / far:.2g}: 'small' neglects terms of that size, and the run ends where "
                    "they exceed 0.1 in a twentieth of the body; use 'finite'",
            )
