"""Frictional contact and metal forming: rigid tools press, slide and roll on deformable workpieces."""

from __future__ import annotations

from typing import Any

__version__ = "0.1.0"

_MODEL = (
    "J2", "Annulus", "Arc", "ArcSide", "Augmented", "Body", "Case", "Circle", "Contact", "Coulomb", "Disc", "Elastic",
    "Exact", "File", "Fixed", "FlowTable", "Grade", "HockettSherby", "JohnsonCook", "Linear", "Load", "Ludwik",
    "Motion", "MuExponential", "MuLinear", "MuTable", "NeoHooke", "Numerics", "Output", "Patch", "Penalty", "Perfect",
    "Plane", "Points", "Polygon", "Problem", "Profile", "Push", "Rectangle", "Ring", "Shear", "SplineSide", "Springs",
    "StVenantKirchhoff", "Stamp", "Start", "Step", "Swift", "Tie", "Units", "Voce",
)  # fmt: skip
_WHERE = dict.fromkeys(_MODEL, "prensa.model.problem") | {
    "load": "prensa.model.schema",
    "dump": "prensa.model.schema",
    "CaseError": "prensa.model.schema",
    "solve": "prensa.solver.time_stepping",
    "discretise": "prensa.fem.system",
    "run": "prensa.output.run",
}

__all__ = ["__version__", *sorted(_WHERE)]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: ``import prensa`` stays instant."""
    if name not in _WHERE:
        raise AttributeError(f"module 'prensa' has no attribute {name!r}")
    import importlib

    value = getattr(importlib.import_module(_WHERE[name]), name)
    globals()[name] = value
    return value
