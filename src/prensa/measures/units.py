"""Units of results, from those of the case."""

from __future__ import annotations

from prensa.model.problem import Problem


def length_unit(problem: Problem) -> str:
    """Unit of lengths."""
    return problem.units.length


def pressure_unit(problem: Problem) -> str:
    """Unit of stresses: MPa for N and mm, Pa for N and m, else force/length²."""
    known = {("N", "mm"): "MPa", ("N", "m"): "Pa", ("kN", "mm"): "GPa", ("kN", "m"): "kPa", ("MN", "m"): "MPa"}
    units = problem.units
    return known.get((units.force, units.length), f"{units.force}/{units.length}²")


def force_unit(problem: Problem) -> str:
    """Unit of tool forces: per thickness in plane problems, whole in axisymmetric ones."""
    units = problem.units
    return units.force if problem.space == "axisymmetric" else f"{units.force}/{units.length}"


def moment_unit(problem: Problem) -> str:
    """Unit of tool moments: per thickness in plane problems."""
    units = problem.units
    return f"{units.force} {units.length}" + ("" if problem.space == "axisymmetric" else f"/{units.length}")


def energy_unit(problem: Problem) -> str:
    """Unit of energies: the same as that of moments."""
    return moment_unit(problem)


def area_unit(problem: Problem) -> str:
    """Unit of contact areas: a width in plane problems (area per thickness)."""
    return f"{problem.units.length}²" if problem.space == "axisymmetric" else problem.units.length
