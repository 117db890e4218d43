"""Tools that their forces push away from all that they could touch."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding
from prensa.linear.rigid_modes import CLOSED
from prensa.model.problem import Push, Step
from prensa.system.moments import moments
from prensa.system.system import System
from prensa.types import Array


def pushed_tools(system: System) -> Iterator[Finding]:
    """Tools whose forces never point towards a body, and that were not moved into one before.

    Moved ones are looked at by `tool_paths`; of these the way is not known, but which way they are pushed is.
    """
    p = system.problem
    if p.start is not None:  # tools of an earlier run may be lifted off
        return
    pushed = {name: [i for i, step in enumerate(p.steps) if name in step.push] for step in p.steps for name in step.push}
    left = set(pushed)
    begun: set[int] = set()
    for m in moments(system):
        for s in system.tool_contacts:
            tool = system.tool_masters[s.against]
            if tool.name not in left:
                continue
            pairs = system.nodes_seen(s, m.u)
            pressed = m.known[tool.number] and float(pairs.g.min()) < -CLOSED * s.points.depth.min()
            if pressed or (m.plan.number not in begun and _towards(p.steps[m.plan.number], tool.name, pairs.g, pairs.n)):
                left.remove(tool.name)
        begun.add(m.plan.number)
    for name in pushed:
        surfaces = list(dict.fromkeys("+".join(s.description.surface) for s in system.tool_contacts if s.against == name))
        if name in left and surfaces and any(forces_of(p.steps[i].push[name], system.dofs.dimension).any() for i in pushed[name]):
            yield Finding(
                f"steps.{pushed[name][0]}.push.{name}",
                f"it pushes the tool away from {' and '.join(map(repr, surfaces))}, which it never presses; check the sign and "
                "the axis of the force",
            )


def _towards(step: Step, name: str, g: Array, n: Array) -> bool:
    """Whether a step may push a tool towards points that see it at gaps g (k,) with its normals n (k, d), or across to them.

    Where none sees it, nothing is known.
    """
    push = step.push.get(name)
    forces = np.zeros((1, n.shape[1])) if push is None else forces_of(push, n.shape[1])
    if not forces.any():
        return False
    shares = forces[:, None] * n[np.isfinite(g)]
    low, high = shares.min(axis=0).sum(axis=1), shares.max(axis=0).sum(axis=1)
    none = NO_DIFFERENCE * np.abs(forces).max()
    return not len(high) or bool(((high > none) | (low > -none)).any())


def forces_of(push: Push, dimension: int) -> Array:
    """Forces (k, d) along each of the axes, the smallest and the largest of each."""
    given = [getattr(push, axis) for axis in "xyz"[:dimension]]
    values = [[v for _, v in f] if isinstance(f, tuple) else [f or 0.0] for f in given]
    return np.array([[min(v) for v in values], [max(v) for v in values]])
