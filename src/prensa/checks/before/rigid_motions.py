"""Rigid-body motions of bodies that neither supports nor contacts resist."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.before.free_cuts import free_cuts, said_of, sectors
from prensa.checks.before.overlap import unjoined
from prensa.checks.before.pushed_away import loaded, never_resisted
from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.contact.masters import Seen
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity
from prensa.geometry.plane import turned
from prensa.linear.rigid_modes import CLOSED, Frame, along_all, free_in_words, free_motions, rows_of, support_rows
from prensa.model.problem import tools_removed
from prensa.system.held import symmetric
from prensa.system.moments import stages
from prensa.system.schedule import StepPlan
from prensa.system.system import System
from prensa.types import Array


def rigid_motions(system: System) -> Iterator[Finding]:
    """Rigid-body motions of each body that nothing resists: named, fatal when not even a contact can."""
    reported: set[str] = set()
    frames = Frame.of_all(system)
    for number, (plan, *_) in enumerate(stages(system)):
        for name, frame in frames.items():
            held = support_rows(system, frame, plan)
            gone = tools_removed(system.problem, number)
            resting = [
                held[:0] if gone else contact_rows(system, name, frame, plan, touching)
                for touching in (True, False)
            ]
            # Fatal first: what not even all contacts could resist would be named twice else.
            for rows, fatal in ((resting[1], True), (resting[0], False)):
                words = free_in_words(system, frame, np.concatenate([held, rows]))
                # Which tools touch when a later step begins is only known in the run.
                if not words or name in reported or (not fatal and number):
                    continue
                reported.add(name)
                if not fatal and len(frames) > 1 and name in unjoined(system):
                    continue
                if not fatal and not system.problem.body_contacts and name in never_resisted(system):
                    continue  # a tool that touched it would not help: `joint_motions` refuses it
                if not fatal and (lacking := list(_symmetry(system, name, frame, held))):
                    yield from lacking  # what is free then goes with the planes that are named
                    continue
                step = f"in step {plan.name!r} " if number else ""
                remedy = (
                    f"hold it there with 'fixed'{_example(system, name, frame, plan, rows)}, or by friction"
                    if fatal
                    else ("start with the tool touching it ('touching:'), or hold it until then")
                )
                nothing = "no support and no contact resists" if fatal else "nothing resists until a tool touches it"
                severity = Severity.REFUSE if fatal else Severity.WARN
                yield Finding(f"bodies.{name}", f"{step}it is free to {words}: {nothing}; {remedy}", severity)
            along_axis = (np.abs(held[:, 1]) > NO_DIFFERENCE).any()
            if (
                system.axisymmetric
                and not number
                and name not in reported
                and not along_axis
                and _pressed_alone(system, name, plan)
            ):
                yield Finding(
                    f"bodies.{name}",
                    "only friction holds it along y against the tools that press it: until they touch it, its position is "
                    "undefined; hold a point of it ('fixed'), or let a tool touch it there",
                )
            if not number and name not in reported and system.dofs.dimension == 3 and name not in never_resisted(system):
                yield from _planes_missing(system, name, frame, held)


def _planes_missing(system: System, body: str, frame: Frame, held: Array) -> Iterator[Finding]:
    """Planes of symmetry that supports seem to lack: cut sides of sectors that nothing holds, and what `_symmetry` finds."""
    cuts = {name: free_cuts(system, name) for name in system.tied_bodies(body)}
    lacking = list(_symmetry(system, body, frame, held))
    # one sentence for what is free: of planes across the axes `_symmetry` knows what holds the body instead
    named = [side for side in cuts[body] if any(f"'{body}.{side}'" in f.message for f in lacking)]
    if cuts[body] and len(named) < len(cuts[body]):
        lacking = []
    elif named:
        cuts[body] = {}
    yield from lacking
    for name, own in cuts.items():
        yield from said_of(name, own)


def _pressed_alone(system: System, body: str, plan: StepPlan) -> bool:
    """Whether a tool that a step drives presses a body along the axis, and nothing but the friction of others resists it.

    Of those that touch it in the beginning. Loads may resist it too. In the plane a body between tools that press it is held by
    their friction from the first increment on, and a good case.
    """
    u, mine = system.initial().u, system.tied_bodies(body)
    at, moved = plan.values(plan.t0), plan.values(plan.t1)
    if loaded(system, mine, plan.number):
        return False
    driven: set[float] = set()
    bearing: set[float] = set()
    x, rubs = system.positions(u), False
    for s, law in zip(system.tool_contacts, plan.friction_at(plan.t1)):
        if s.body not in mine:
            continue
        pairs = system.tool_masters[s.against].seen(x[s.points.nodes], u)
        touching = pairs.n[pairs.g <= CLOSED * float(s.points.depth.min())]
        # Friction alone holds all motions in the rank of the rows, without force behind it none. Along the axis there is one
        # direction: signs of normals say whether what is pressed has something to be pressed against.
        signs = set(np.sign(touching[np.abs(touching[:, 1]) > NO_DIFFERENCE, 1]).tolist())
        dof = int(system.tool_masters[s.against].dofs[1])
        bearing |= signs
        if dof in plan.push or (at != moved)[plan.fixed == dof].any():
            driven |= signs
        rubs |= bool((np.abs(touching[:, 0]) > NO_DIFFERENCE).any()) and not system.frictionless(law)
    return rubs and any(-sign not in bearing for sign in driven)


def _symmetry(system: System, body: str, frame: Frame, held: Array) -> Iterator[Finding]:
    """Flat sides that contact alone holds along their normal and in whose plane a tool stands, or a sector of a body of
    revolution ends: planes of symmetry, it seems.

    What half of a ball, or of any tool, presses on is pushed aside: contact holds a body along a direction where its normals
    point both ways, and friction as far as it goes. The reference points of planes say nothing of where they stand. A body that
    other supports hold, such as a base held all ways, lacks a plane where half of a tool pushes it aside.
    """
    if system.dofs.dimension == 2:
        return
    left = free_motions(system, held)
    u = system.initial().u
    x, mine = system.positions(u), [s for s in system.tool_contacts if s.body == body]
    masters = [system.tool_masters[s.against] for s in mine]
    normals = np.concatenate([left[:0, :3], *(m.seen(x[s.points.nodes], u).n for s, m in zip(mine, masters))])
    at = [m.tool.at for m in masters if not m.tool.shape.half_space]
    touched = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(s.points.nodes for s in mine)]))
    sector = sectors(system)[body]
    ends = sector.cuts if sector is not None else ()
    mesh, lacking = system.meshes[body], dict[tuple[int, float], str]()
    for side, faces in mesh.edges.items():
        x = mesh.points[np.unique(faces)]
        axis = int(np.argmin(np.ptp(x, axis=0)))
        level, along = float(x[0, axis]), normals[:, axis]
        here = side in ends or any(abs(float(p[axis]) - level) < NO_DIFFERENCE * frame.size for p in at)
        flat = np.ptp(x[:, axis]) < NO_DIFFERENCE * frame.size
        both_ways = (along > NO_DIFFERENCE).any() and (along < -NO_DIFFERENCE).any()
        free = (np.abs(left[:, axis]) > NO_DIFFERENCE).any()
        pressed = np.isin(np.unique(faces) + system.offsets[body], touched).all()  # where a flat tool's place says nothing
        aside = (np.abs(along) > NO_DIFFERENCE).any() and not pressed and not symmetric(system, body, faces).any()
        if here and flat and not both_ways and (free or aside):
            lacking.setdefault((axis, level), side)
    if lacking:
        names = " and ".join("xyz"[axis] for axis, _ in lacking)
        planes = ", ".join(
            f"{'xyz'[axis]} = {level:.4g} of its side '{body}.{side}'" for (axis, level), side in lacking.items()
        )
        missing = ", ".join(f"{body}.{side}: {'xyz'[axis]}" for (axis, _), side in lacking.items())
        several = len(lacking) > 1
        ends_there = all(side in ends for side in lacking.values())
        pushed = any((np.abs(normals[:, axis]) > NO_DIFFERENCE).any() for axis, _ in lacking)
        loose = any((np.abs(left[:, axis]) > NO_DIFFERENCE).any() for axis, _ in lacking)
        alone = f"only {'contact' if pushed else 'friction'} holds it along {names}"
        beside = f"half of a tool pushes it aside along {names}"
        yield Finding(
            f"bodies.{body}",
            f"{alone if loose else beside}, and {'a sector ends' if ends_there else 'a tool stands'} in the "
            f"plane{'s' * several} {planes}: if {'those are planes' if several else 'that is a plane'} of symmetry, "
            f"'fixed' lacks '{missing}'",
            support=missing,
        )


def _example(system: System, body: str, frame: Frame, plan: StepPlan, rows: Array) -> str:
    """A support of a body in space that takes away most of what is free, as it is written; '' in the plane."""
    if system.dofs.dimension == 2:
        return ""
    held = np.concatenate([support_rows(system, frame, plan), rows])
    left = free_motions(system, held)
    best, most = "", 0
    for name in system.tied_bodies(body):
        mesh = system.meshes[name]
        for side, faces in mesh.edges.items():
            x = mesh.points[np.unique(faces)]
            n = np.linalg.svd(x - x.mean(axis=0))[2][2]
            if np.abs((x - x[0]) @ n).max() > NO_DIFFERENCE * frame.size:
                continue  # a plane of symmetry holds a flat side along its normal
            sight = rows_of(frame, x, np.broadcast_to(n, x.shape)) @ left.T
            taken = int((np.linalg.svd(sight, compute_uv=False) > NO_DIFFERENCE).sum())
            if taken > most:
                axis = np.flatnonzero(np.abs(n) > 1.0 - NO_DIFFERENCE)
                best, most = f", like '{name}.{side}: {'xyz'[axis[0]] if len(axis) else 'normal'}'", taken
    return best


def contact_rows(
    system: System, body: str, frame: Frame, plan: StepPlan, touching: bool, rubs: bool = True
) -> Array:  # fmt: skip
    """Rows (k, 3|6) of the contacts of a body, normals and with friction tangents: of all, or of those that touch at first.

    ``rubs``: whether friction counts.

    Tools that are pushed are brought to touch before the solve.
    """
    rows = [along_all(frame, system.X[:0])]
    for s, law in zip(system.surfaces, plan.friction_at(plan.t1)):
        if not s.acts_on(system.tied_bodies(body)):
            continue
        u = system.initial().u
        x = system.positions(u)[s.points.nodes]
        pairs, pushed = _seen(system, s, x, u), False
        if s.opposite is None:
            dofs = system.tool_masters[s.against].dofs[: system.dofs.dimension]
            pushed = any(dof in plan.push for dof in dofs.tolist())
        seen = ~np.isnan(pairs.g)
        # A pushed tool is brought to the body before the first increment, so that all of its points count as touching.
        if touching and not pushed:
            seen = pairs.g <= CLOSED * float(s.points.depth.min())
        rows.append(rows_of(frame, x[seen], pairs.n[seen]))
        if rubs and not system.frictionless(law):
            solid = system.dofs.dimension == 3
            rows.append(along_all(frame, x[seen]) if solid else rows_of(frame, x[seen], turned(pairs.n[seen])))
    return np.concatenate(rows)


def _seen(system: System, s: Surface, x: Array, u: Array) -> Seen:
    """Gaps and normals at the nodes of a surface, where these are at places x (k, 2), whatever the contact geometry."""
    return system.nodes_seen(s, u) if s.opposite is not None else system.tool_masters[s.against].seen(x, u)
