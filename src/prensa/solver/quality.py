"""Quality warnings: what a converged run deserves less trust for than its residual says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set

import numpy as np
from numpy.typing import NDArray

from prensa.fem.context import Context
from prensa.fem.system import Evaluation, System
from prensa.solver.policy import Policy

Array = NDArray[np.float64]


def quality_warnings(system: System, c: Context, e: Evaluation, residual: float, policy: Policy) -> Iterator[str]:
    """Sentences about penetration and hidden forces of a converged increment; residual: what convergence leaves open."""
    d = system.dofs.dimension
    forces = np.zeros((len(system.tools), d))
    for s, f, scale in zip(system.surfaces, e.contacts, c.scales):
        forces[s.tool] += f.F[:, d : 2 * d].sum(axis=0)
        depth = np.where(f.p > 0, -f.g / scale.h, 0.0)
        k = int(np.argmax(depth))
        if depth[k] > policy.deep:
            x, node = s.X[k], s.points.support[k, np.argmax(s.points.N[k])]
            yield (
                f"contact {s.name}: node {node - system.offsets[s.body]} (initially at {x[0]:.4g}, {x[1]:.4g}) lies "
                f"{-f.g[k]:.3g} inside the tool, {depth[k]:.2g} of an element: raise its stiffness 'beta', or use 'augmented'"
            )
    for t, tool in enumerate(system.tools):
        size = float(np.hypot.reduce(forces[t]))
        noise = policy.hidden * residual * e.scale
        if 0 < size < noise:
            yield (
                f"the force on tool {tool.name!r}, {size:.3g}, is not above what convergence leaves open ({noise:.3g}): much "
                f"larger forces are at work elsewhere (supports or tools that press against each other, Σ|f| = {e.scale:.3g}); "
                "remove them or lower 'tolerance'"
            )


def untouched_tools(system: System, met: Set[str], planes: Sequence[str] = ()) -> Iterator[str]:
    """Tools of contacts that met nothing in a whole run; met: those that did.

    planes: tools that stand for lines of symmetry, of which nothing is to be said.
    """
    for t, tool in enumerate(system.tools):
        own = [s for s in system.surfaces if s.tool == t and tool.name not in planes]
        if own and tool.name not in met:
            surfaces = ", ".join(repr("+".join(s.description.surface)) for s in own)
            yield f"tool {tool.name!r} never touched {surfaces}: its forces are zero because it met nothing"
