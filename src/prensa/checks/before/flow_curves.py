"""Flow curves that fall, or rise faster than the elastic modulus."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding, Severity
from prensa.materials.flow_curve import stress_at
from prensa.system.system import System

STRAINS = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 200)])
"""Plastic strains at which flow curves are looked at."""
FIRST_STRAIN = 0.01
"""Plastic strain by which the first rise of a flow curve is measured: power laws begin with any slope."""


def flow_curves(system: System) -> Iterator[Finding]:
    """Flow stresses that are not positive, that fall, or that rise faster than the elastic modulus at first."""
    for name, body in system.problem.bodies.items():
        flow = getattr(body.material, "flow", None)
        if flow is None:
            continue
        path = f"bodies.{name}.material.flow"
        stress = stress_at(flow, STRAINS, np.zeros_like(STRAINS))
        k = int(np.argmin(stress))
        fall = np.diff(stress) < -NO_DIFFERENCE * stress[0]
        if not stress[k] > 0:
            yield Finding(
                path,
                f"the flow stress is {stress[k]:.4g} at a plastic strain of {STRAINS[k]:.3g}; it must stay positive",
                Severity.REFUSE,
            )
        elif fall.any():
            a = int(np.argmax(fall))
            yield Finding(
                path,
                f"the flow stress falls from {stress[a]:.5g} at a plastic strain of {STRAINS[a]:.3g}: strain will localise in "
                "one row of elements and results depend on the mesh; use a curve that does not fall",
            )
        rise = (np.interp(FIRST_STRAIN, STRAINS, stress) - stress[0]) / FIRST_STRAIN
        other_unit = stress[0] > body.material.modulus / 20  # which is said already
        if rise > body.material.modulus and not other_unit:
            yield Finding(
                path,
                f"the flow stress rises by {rise:.3g} per unit of plastic strain at first, faster than E = "
                f"{body.material.modulus:.3g}; check the units of both",
            )
