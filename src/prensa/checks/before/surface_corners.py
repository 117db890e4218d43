"""Surfaces with a corner whose gaps are measured along the undeformed normal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.errors import Finding, Severity
from prensa.system.system import System

KINKED = 0.766
"""Cosine of the angle, 40°, by which an undeformed surface may bend at a node and still have a normal there."""


def surface_corners(system: System) -> Iterator[Finding]:
    """Surfaces with a corner whose gaps are measured along the normal before they deform, which a corner does not have."""
    for i, s in enumerate(system.surfaces if system.problem.contact_geometry == "reference" else ()):
        if s.points.rule.type != "nodal":  # points between nodes have the normal of their edge
            continue
        ends = s.points.edges[:, :2]
        along = system.X[ends[:, 1]] - system.X[ends[:, 0]]
        along /= np.hypot(*along.T)[:, None]
        into = {int(node): k for k, node in enumerate(ends[:, 1])}
        for k, node in enumerate(ends[:, 0].tolist()):
            if node in into and float(along[into[node]] @ along[k]) < KINKED:
                x, y = system.X[node]
                names = s.description.surface
                one = "make two boundaries of it, each with a contact"
                apart = one if len(names) == 1 else "give each side a contact of its own"
                yield Finding(
                    f"contacts.{i}.surface",
                    f"'contact_geometry: reference' measures gaps along the normal of the undeformed surface, which "
                    f"{'+'.join(names)!r} does not have at its corner at ({x:.4g}, {y:.4g}); {apart}",
                    Severity.REFUSE,
                )
                break
