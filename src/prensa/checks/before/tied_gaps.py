"""Gaps and overlaps of tied sides, which ties take away without stress."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.errors import Finding, coordinates
from prensa.mesh.mesh import MeshError
from prensa.precision import DRAWN
from prensa.system.mortar import APART, Side
from prensa.system.system import System
from prensa.system.tie_gaps import face_overlaps, overlaps


def tied_gaps(system: System) -> Iterator[Finding]:
    """Ties whose sides lie off each other by more than what the straight edges of a curved side are off it."""
    drawn = np.concatenate([mesh.points for mesh in system.meshes.values()])
    unit, solid = system.problem.units.length, system.dofs.dimension == 3
    for i, tie in enumerate(system.problem.ties):
        if tie.interference is not None:
            continue
        slave, master = (Side(name, system.boundary_edges(name)) for name in (tie.slave, tie.master))
        try:
            found = face_overlaps(drawn, slave, master) if solid else overlaps(drawn, slave, master, APART)
        except MeshError:  # nodes beyond the end of the other side are tied with their edges, but lie on nothing
            continue
        beyond = np.abs(found.depth) - found.unsure
        k = int(np.argmax(beyond))
        if beyond[k] > DRAWN * system.length:
            at = coordinates(drawn[found.nodes[k]].tolist())
            meant = "" if solid else ", or say that it is meant, as in a press fit: 'interference: geometry'"
            kind = "overlap" if found.depth[k] > 0 else "lie apart"
            yield Finding(
                f"ties.{i}",
                f"the sides {kind} by {abs(float(found.depth[k])):.3g} {unit}, most at ({at}): the tie takes that "
                f"away without stress; move one of the two there{meant}",
            )
