"""Frictional contact and metal forming: rigid tools press, slide and roll on deformable workpieces."""

from __future__ import annotations

from typing import Any

__version__ = "0.1.0"

_MODEL = (
    "Annulus", "ArcSide", "Body", "Box", "Bricks", "Case", "Contact", "Crank", "Cylinder", "Disc", "Extrusion", "Feed",
    "File", "Fixed", "Grade", "Interference", "Load", "Motion", "NoContact", "Nose", "Numerics", "Outline", "Output", "Patch",
    "Points", "Press", "Problem", "Push", "Rectangle", "Remesh", "Revolution", "Sizes", "SplineSide", "Springs", "Start", "Step",
    "Strip", "Tetrahedra", "Tie", "ToolForce", "ToolTravel", "Units", "Until", "When", "Wire",
)  # fmt: skip
_WHERE = dict.fromkeys(_MODEL, "prensa.model.problem") | {
    "BodyContact": "prensa.model.problem",
    "Conductor": "prensa.model.heat",
    "Heat": "prensa.model.heat",
    "load": "prensa.model.schema",
    "dump": "prensa.model.schema",
    "CaseError": "prensa.model.schema",
    "PrensaError": "prensa.errors",
    "SolveError": "prensa.errors",
    "solve": "prensa.sensitivity.solve",
    "gradient": "prensa.sensitivity.adjoint",
    "discretise": "prensa.system.discretise",
    "run": "prensa.output.run",
    "resume": "prensa.output.run",
    "particles": "prensa.output.flow",
    "converge": "prensa.study.converge",
    "sweep": "prensa.study.sweep",
    "calibrate": "prensa.inverse.calibrate",
    "Observe": "prensa.inverse.experiment",
    "Test": "prensa.inverse.experiment",
    "identify": "prensa.inverse.identify",
    "results": "prensa.output.result",
    "Die": "prensa.dies.stress",
    "ShrinkRing": "prensa.dies.ring",
    "die_stress": "prensa.dies.stress",
    "tool_loads": "prensa.dies.loads",
    "wear": "prensa.dies.wear",
    "WearLaw": "prensa.friction.wear_law",
    "evaluate": "prensa.result.results",
    "ProgressBar": "prensa.output.progress",
    "DamageLaw": "prensa.materials.damage_law",
    "FlowCurve": "prensa.materials.flow_curve",
    "FrictionLaw": "prensa.friction.law",
    "Enforcement": "prensa.contact.method",
    "ToolShape": "prensa.tools.tool",
    "IsotropicMaterial": "prensa.materials.material",
    "Material": "prensa.materials.material",
    "PointCurve": "prensa.materials.flow_curve",
    "PointMaterial": "prensa.materials.point_material",
}


def __dir__() -> list[str]:
    """Public names, those of the laws behind the doors included."""
    from prensa.registry import public

    return sorted({"__version__", *_WHERE, *(name for name, _ in public())})


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: ``import prensa`` stays instant."""
    if name in _WHERE:
        import importlib

        value = getattr(importlib.import_module(_WHERE[name]), name)
        if name in ("solve", "gradient", "run", "resume", "results"):
            import prensa.output.views
    elif name == "__all__":
        value = __dir__()
    else:
        value = None
        if not name.startswith("_"):
            from prensa.registry import public

            value = dict(public()).get(name)
        if value is None:
            import sys

            message = f"module 'prensa' has no attribute {name!r}"
            raise AttributeError(message, name=name, obj=sys.modules[__name__])  # Python adds the nearest name
    if isinstance(value, type):
        import prensa.model.constructors  # noqa: F401  (says what is wrong with the arguments of descriptions)
    globals()[name] = value
    return value
