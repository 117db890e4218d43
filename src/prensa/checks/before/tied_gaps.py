"""Gaps and overlaps of tied sides, which ties take away without stress."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.errors import Finding
from prensa.mesh.mesh import MeshError
from prensa.precision import DRAWN
from prensa.system.mortar import APART, Side
from prensa.system.system import System
from prensa.system.tie_gaps import overlaps


def tied_gaps(system: System) -> Iterator[Finding]:
    """Ties whose sides lie off each other by more than what the straight edges of a curved side are off it."""
    drawn = np.concatenate([mesh.points for mesh in system.meshes.values()])
    unit = system.problem.units.length
    for i, tie in enumerate(system.problem.ties):
        if tie.interference is not None:
            continue
        slave, master = (Side(name, system.boundary_edges(name)) for name in (tie.slave, tie.master))
        try:
            found = overlaps(drawn, slave, master, APART)
        except MeshError:  # nodes beyond the end of the other side are tied with their edges, but lie on nothing
            continue
        beyond = np.abs(found.depth) - found.unsure
        k = int(np.argmax(beyond))
        if beyond[k] > DRAWN * system.length:
            x, y = drawn[found.nodes[k]].tolist()
            kind = "overlap" if found.depth[k] > 0 else "lie apart"
            yield Finding(
                f"ties.{i}",
                f"the sides {kind} by {abs(float(found.depth[k])):.3g} {unit}, most at ({x:.4g}, {y:.4g}): the tie takes that "
                "away without stress; move one of the two there, or say that it is meant, as in a press fit: "
                "'interference: geometry'",
            )
