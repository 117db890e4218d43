"""Bores of rings that are held radially as if they were the symmetry line of a plane problem."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding
from prensa.model import problem as model
from prensa.system.system import System


def bores(system: System) -> Iterator[Finding]:
    """The symmetry line of a plane problem, copied to a ring: a straight bore that is held radially and nothing else."""
    p = system.problem
    if not system.axisymmetric:
        return
    owners: list[tuple[str, model.Problem | model.Step]] = [
        ("", p),
        *((f"steps.{i}.", s) for i, s in enumerate(p.steps)),
    ]
    for prefix, owner in owners:
        for name, support in owner.fixed.items():
            if support.x != "held" or support.y is not None:
                continue
            body = name.partition(".")[0]
            r, least = system.X[system.boundary_nodes(name), 0], float(system.meshes[body].points[:, 0].min())
            # The innermost side alone may be the line of symmetry of the plane case; an outer one that is held radially has a
            # container.
            if len(r) > 1 and least > 0 and np.ptp(r) <= NO_DIFFERENCE * system.length and r[0] <= least * (1.0 + NO_DIFFERENCE):
                yield Finding(
                    f"{prefix}fixed.{name}",
                    f"it holds a bore of radius {r[0]:.4g} radially, but the line of symmetry is the axis here, and a bore is "
                    "free to widen; leave it out, or write {x: 0} for a rigid mandrel",
                )
