"""Cut sides of sectors that nothing holds: the part opens there like a book, where its images would keep it closed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.sectors import Sector, sector_of
from prensa.model.problem import Problem
from prensa.system.held import held_along
from prensa.system.moments import stages
from prensa.system.once import once
from prensa.system.system import System
from prensa.types import Array, Flags


@once
def sectors(system: System) -> dict[str, Sector | None]:
    """The sectors of bodies of revolution that bodies in space are, whatever their meshes come from."""
    return {name: sector_of(mesh) if isinstance(mesh, BrickMesh) else None for name, mesh in system.meshes.items()}


def free_cuts(system: System, body: str) -> dict[str, str]:
    """Cut sides of a sector that nothing holds along their normal, and how each is held: an axis, or ``normal``.

    A body whose rigid motions are all held may still lack a plane of symmetry. A sector of more than half a turn is part of no
    whole, and its sides are real ones.
    """
    found, problem, sector = {}, system.problem, sectors(system)[body]
    for side, normal in sector.cuts.items() if sector is not None else ():
        name = f"{body}.{side}"
        if not _used(problem, name) and not _held(system, body, side, normal).all():
            along = np.flatnonzero(np.abs(normal) > 1.0 - NO_DIFFERENCE)
            found[side] = "xyz"[along[0]] if len(along) else "normal"
    return found


def said_of(body: str, cuts: dict[str, str]) -> Iterator[Finding]:
    """What there is to say of them."""
    if cuts:
        names, several = " and ".join(f"'{body}.{side}'" for side in cuts), len(cuts) > 1
        held = ", ".join(f"{body}.{side}: {way}" for side, way in cuts.items())
        free = "are free along their normals" if several else "is free along its normal"
        yield Finding(
            f"bodies.{body}",
            f"the cut side{'s' * several} {names} of the sector {free}, so that it opens there: 'fixed' lacks '{held}', unless "
            f"{'these are real sides' if several else 'that is a real side'} of the part",
        )


def _used(problem: Problem, name: str) -> bool:
    """Whether something else than a support acts on a side: a tool, a tie, a load, a motion."""
    touched = {side for c in problem.all_contacts for side in c.surface}
    tied = {side for tie in problem.ties for side in (tie.slave, tie.master)}
    moved = {side for step in problem.steps for side in (*step.loads, *problem.driven(step))}
    return not {name, name.partition(".")[0]}.isdisjoint(touched | tied | moved | {*problem.loads})


def _held(system: System, body: str, side: str, normal: Array) -> Flags:
    """Nodes (k,) of a flat side that supports of the first step, or of all, hold along its normal (3,): where none is left free.

    What holds one of two components of an inclined normal leaves the side free to go along it.
    """
    nodes = np.unique(system.meshes[body].edges[side])
    dofs = system.dofs.displacement.dofs(nodes + system.offsets[body])[:, np.abs(normal) > NO_DIFFERENCE]
    first = np.isin(dofs, stages(system)[0].plan.fixed).all(axis=1)
    return np.asarray(first | held_along(system, body, normal)[nodes])
