"""Corners of quadratic tetrahedra inside tools: they are no contact points, so that nothing keeps them out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

import numpy as np

from prensa.checks.check import Committed, warning
from prensa.checks.thresholds import NOTABLE_DEPTH
from prensa.contact.faces import FacePoints
from prensa.errors import Finding, coordinates
from prensa.system.system import System


def corners_of_faces(system: System, given: Committed) -> Iterator[Finding]:
    """The deepest corner of each contact at the end of a step: contact is at the middle of the sides, and knows nothing of it."""
    if system.dofs.dimension != 3:
        return
    x, u = system.positions(given.state.u), given.state.u
    for s, f in zip(system.surfaces, given.evaluation.contacts):
        faces = cast(FacePoints, s.points).faces
        if faces.shape[1] != 6 or s.opposite is not None:
            continue
        corners = np.unique(faces[:, :3])
        depth = -np.asarray(system.tool_masters[s.against].seen(x[corners], u).g)
        k, size = int(np.argmax(depth)), float(s.points.depth.min())
        # what penalties give way is the points' own, and has a word of its own
        more = float(depth[k]) - max(float(-f.g.min()), 0.0)
        if more > NOTABLE_DEPTH * size:
            at = coordinates(x[corners[k]])
            yield warning(
                f"contact {s.name}: corner {corners[k] - system.offsets[s.body]} of a tetrahedron, at ({at}), lies "
                f"{depth[k]:.3g} inside {s.against!r}: contact is at the middle of the sides alone, and forces are too "
                "small; shorten the elements there"
            )
