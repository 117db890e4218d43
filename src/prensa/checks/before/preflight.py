"""The checks of a description, before anything is solved: what cannot work, and what was likely not meant.

Tools are moved through all steps past the undeformed bodies; supports and contacts are counted against rigid-body modes.
Every finding names the place in the description, the amount and what to write instead. A new check is a file and an entry here.
"""

from __future__ import annotations

from dataclasses import replace

from prensa.checks.before.bending import stiff_in_bending
from prensa.checks.before.bores import bores
from prensa.checks.before.closed_dies import closed_dies
from prensa.checks.before.edges_between_nodes import edges_between_nodes
from prensa.checks.before.far_upsets import far_upsets
from prensa.checks.before.feeding import feeding
from prensa.checks.before.file_units import file_units
from prensa.checks.before.flow_curves import flow_curves
from prensa.checks.before.forces import mounts, pushes, weak
from prensa.checks.before.joint_motions import joint_motions
from prensa.checks.before.measured_places import measured_places
from prensa.checks.before.mesh_shapes import mesh_shapes
from prensa.checks.before.new_meshes import new_meshes, new_sizes
from prensa.checks.before.obsolete_keys import obsolete_keys
from prensa.checks.before.off_centre import Overlap, off_centre
from prensa.checks.before.overlap import overlapping_bodies
from prensa.checks.before.passages_ahead import few_passages
from prensa.checks.before.pushed_tools import pushed_tools
from prensa.checks.before.rigid_motions import rigid_motions
from prensa.checks.before.small_strain import small_strain
from prensa.checks.before.standstills import standstills
from prensa.checks.before.starting_places import starting_places
from prensa.checks.before.surface_corners import surface_corners
from prensa.checks.before.table_starts import table_starts
from prensa.checks.before.tables import tables
from prensa.checks.before.tied_gaps import tied_gaps
from prensa.checks.before.tool_faces import tool_faces
from prensa.checks.before.tool_paths import tool_paths
from prensa.checks.before.tool_sizes import tool_sizes
from prensa.checks.before.tools_inside import tools_inside
from prensa.checks.before.travels import travels
from prensa.checks.before.units import lengths, thick_sheets, turns
from prensa.checks.before.walls import walls
from prensa.checks.check import Check
from prensa.errors import Finding
from prensa.model.remeshing import remeshing_of
from prensa.system.moments import moments
from prensa.system.system import System

AT_REST: tuple[Check[System], ...] = (tool_sizes, surface_corners, starting_places, overlapping_bodies)
"""Those of where things are before anything moves."""
CHECKS: tuple[Check[System], ...] = (
    obsolete_keys, new_meshes, flow_curves, tables, lengths, pushes, weak, mesh_shapes, stiff_in_bending, bores, table_starts,
    standstills, travels, feeding, new_sizes, mounts, turns, thick_sheets, file_units,
    *AT_REST, tools_inside, tool_faces, off_centre, small_strain, far_upsets,
    tool_paths, pushed_tools, edges_between_nodes, rigid_motions, joint_motions, walls, tied_gaps, measured_places, closed_dies,
)  # fmt: skip
"""In the order in which they are reported."""
AFTER: dict[Check[System], tuple[Check[System], ...]] = {
    tools_inside: AT_REST,
    off_centre: AT_REST,
    small_strain: AT_REST,
    far_upsets: AT_REST,
    tool_paths: (*AT_REST, tools_inside),
    pushed_tools: (*AT_REST, tools_inside),
    edges_between_nodes: (*AT_REST, tools_inside),
}
"""Check → those after which it has nothing to say if one of them refuses the problem."""
RELIES_ON: dict[Check[System], tuple[Check[System], ...]] = {rigid_motions: AT_REST}
"""Check → those after which it has no warnings if one of them refuses: what touches a body follows from where tools are."""
CAUSES: dict[Check[System], tuple[Check[System], ...]] = {
    tool_sizes: (lengths, file_units),
    starting_places: (tool_faces,),
    off_centre: (lengths, tool_faces, turns, tool_paths),
    tool_paths: (lengths, file_units, tool_faces),
    edges_between_nodes: (lengths, file_units, tool_faces),
}
"""Check → those that find the cause of what it finds of the same tool: a size, turn or travel in another unit, a file's
other axes, a motion along the wrong one."""


def preflight(system: System) -> list[Finding]:
    """All findings on a discretised problem, the fatal ones first."""
    found: list[tuple[Check[System], Finding]] = []
    refused: set[Check[System]] = set()
    for check in CHECKS:
        if refused.isdisjoint(AFTER.get(check, ())):
            unsure = not refused.isdisjoint(RELIES_ON.get(check, ()))
            own = [f for f in check(system) if f.fatal or not unsure]
            found += [(check, f) for f in own]
            refused |= {check} if any(f.fatal for f in own) else set()
    return sorted(_causes(system, found), key=lambda f: not f.fatal)


def _causes(system: System, found: list[tuple[Check[System], Finding]]) -> list[Finding]:
    """Findings without those that follow from others, which are as severe as what follows; of two on one support the severer."""
    tools = [f.tool if isinstance(f, Overlap) else _tool(system, f.path) for _, f in found]
    out = [f for _, f in found]
    followed: set[int] = set()
    for k, (check, f) in enumerate(found):
        for j, (other, cause) in enumerate(found):
            if tools[k] and tools[j] == tools[k] and other in CAUSES.get(check, ()):
                followed.add(k)
                out[j] = replace(cause, severity=max(out[j].severity, f.severity))
                break
            if f.support and f.support == cause.support and cause.severity > f.severity:
                followed.add(k)
    return [f for k, f in enumerate(out) if k not in followed]


def _tool(system: System, path: str) -> str:
    """The tool that a path of a description is about; '' of others."""
    first, *rest = path.split(".")
    if first == "contacts" and rest:
        return system.surfaces[int(rest[0])].against
    if first == "steps" and len(rest) > 2 and rest[1] in ("move", "by", "velocity", "control", "push"):
        return rest[2]
    return rest[0] if first == "tools" and rest else ""


def staircase(system: System) -> list[Finding]:
    """Findings on contacts whose forces will step as elements pass; a run says it of those in which it is seen.

    Of a first mesh that others will take the place of nothing follows.
    """
    if remeshing_of(system.problem) is not None:
        return []
    return list(few_passages(system, ((m.plan, m.u) for m in moments(system))))
