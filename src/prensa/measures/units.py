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


def _of_unit_thickness(problem: Problem) -> bool:
    """Whether forces are as much per length of thickness: plane problems of thickness 1, which they have unless it is given."""
    return problem.space not in ("axisymmetric", "solid") and problem.thickness == 1.0


def volume_unit(problem: Problem) -> str:
    """Unit of volumes: areas of the section in plane problems of thickness 1."""
    return problem.units.length + ("²" if _of_unit_thickness(problem) else "³")


def force_unit(problem: Problem) -> str:
    """Unit of tool forces: whole ones, and per length in plane problems of thickness 1."""
    units = problem.units
    return units.force + (f"/{units.length}" if _of_unit_thickness(problem) else "")


def moment_unit(problem: Problem) -> str:
    """Unit of tool moments: per length in plane problems of thickness 1."""
    return f"{problem.units.force} {problem.units.length}" + (f"/{problem.units.length}" if _of_unit_thickness(problem) else "")


def energy_unit(problem: Problem) -> str:
    """Unit of energies: the same as that of moments."""
    return moment_unit(problem)


def area_unit(problem: Problem) -> str:
    """Unit of contact areas: a width in plane problems of thickness 1."""
    return problem.units.length + ("" if _of_unit_thickness(problem) else "²")
