"""Bodies that tools press together so far that their elements wear out, and elastic metals pressed beyond any yield stress."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.during.validity import STRAIN_WARNING, YIELDS_BEFORE, elastic_metal
from prensa.checks.thresholds import ALONG, NO_DIFFERENCE, TOUCHING_DEPTH, TOWARDS
from prensa.errors import Finding
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.quality import POOR
from prensa.mesh.thin import strips
from prensa.policy import Policy
from prensa.system.bending import Thickness, gaps_across
from prensa.system.contact_surfaces import always_held
from prensa.system.moments import moments
from prensa.system.system import System
from prensa.types import Array, Flags


class Upset(NamedTuple):
    """The strip through a body that is pressed together most: its ``height`` between what presses it, and what is ``left`` of it.

    ``across`` (d,): the line of travel. ``sticking``: ends of it along which friction or a support may hold the metal.
    ``surrounded``: whether tools surround the body all along the height, as a container does; ``past_face``: shear of a layer of
    elements between metal that stands before a face and what flows past it.
    """

    height: float
    left: float
    across: Array
    sticking: int
    past_face: float
    surrounded: bool = False


def far_upsets(system: System) -> Iterator[Finding]:
    """Bodies that are pressed together further than their elements bear, or than a metal without a yield stress."""
    p = system.problem
    if p.kinematics == "small":
        return
    for name in p.bodies:
        elastic = all(elastic_metal(p, b, Policy()) for b in system.blocks if b.body == name)
        u = upset(system, name) if elastic or system.dofs.dimension == 3 else None  # in the plane wear is for 'remesh'
        if u is None:
            continue
        by = f"by {u.height - u.left:.4g} of {u.height:.4g}"
        if elastic:
            if 1.0 - u.left / u.height > STRAIN_WARNING:
                yield Finding(
                    f"bodies.{name}.material",
                    f"tools press {name!r} together {by}, and it is elastic with the modulus of a metal: {YIELDS_BEFORE}",
                    seen_in_run=True,
                )
        elif (shear := u.past_face if u.surrounded else sheared(system, name, u)) > _WORN:
            yield Finding(
                f"bodies.{name}",
                f"tools press {name!r} together {by}: {_BY_A_FACE if u.surrounded else _BY_FRICTION}, by up to {shear:.2g}, and "
                "a run in space, which has no new meshes, may end before that, with what it has by then; press less far"
                f"{', give the die a slope below 45°' * u.surrounded}, or compute a section in the plane with 'remesh: auto'",
                seen_in_run=True,
            )


_BY_FRICTION = "where friction holds the metal its elements are sheared"
_BY_A_FACE = "where it flows past metal that stands before a face across its way its elements are sheared"
_WORN = float(np.sqrt(1.0 / POOR**2 - 1.0))
"""Shear at which the scaled Jacobian of a rectangle, 1/√(1 + γ²), is `POOR`."""


def upset(system: System, body: str) -> Upset | None:
    """The strip through a body that known motions of tools press together most in any step; None if they press none."""
    mesh = system.meshes[body]
    if mesh.cells.shape[1] != (8 if isinstance(mesh, BrickMesh) else 4):
        return None
    s, held, most = strips(mesh), always_held(system.problem, body, mesh), None
    for row in range(len(s.strip)):
        t = Thickness.of(mesh, s, np.full(len(mesh.cells), row), held)
        for moment in moments(system) if len(t.size) else ():
            gaps, contacts = gaps_across(system, body, t, moment, np.full(len(t.size), np.inf))
            left = t.size + gaps.sum(axis=1)
            left = np.where((contacts >= 0).any(axis=1) & (left > 0.0), left, np.inf)
            k = int(np.argmin(left / t.size))
            if left[k] < t.size[k] and (most is None or left[k] * most.height < most.left * t.size[k]):
                sticking = sum(_sticks(system, held[t.ends[k, end]], t.across[k], int(contacts[k, end])) for end in range(2))
                depth = max(float(system.tool_contacts[i].points.depth.max()) for i in contacts[k] if i >= 0)
                most = Upset(float(t.size[k]), float(left[k]), t.across[k], sticking, float(t.size[k] - left[k]) / depth)
    if most is None:
        return None
    confined = _confined(system, body, most.across)  # which becomes no shorter
    if confined >= most.left:
        return most._replace(surrounded=True)
    return most._replace(height=most.height - confined, left=most.left - confined)


def _sticks(system: System, held: Flags, across: Array, contact: int) -> bool:
    """Whether friction of a contact, or else a support of nodes with ``held`` (a, d), acts along the end of a strip."""
    if contact < 0:
        return bool((held.all(axis=0) & (np.abs(across) < TOWARDS)).any())
    law = system.tool_contacts[contact].description.friction or system.problem.friction
    return law is not None and not law.frictionless


def _confined(system: System, body: str, across: Array) -> float:
    """Length along ``across`` (d,) on which tools touch a body at the start from all sides, as the container of a shank does."""
    normals, along = [np.zeros((0, len(across)))], [np.zeros(0)]
    for s in system.tool_contacts:
        if s.body == body:
            X = system.X[s.points.nodes]
            seen = system.tool_masters[s.against].seen(X, system.initial().u)
            beside = (seen.g <= TOUCHING_DEPTH * s.points.depth.min()) & (np.abs(seen.n @ across) < TOWARDS)
            normals.append(seen.n[beside])
            along.append(X[beside] @ across)
    n, at = np.concatenate(normals), np.concatenate(along)
    surrounded = len(n) > 0 and np.linalg.matrix_rank(n - np.outer(n @ across, across), tol=TOWARDS) == len(across) - 1
    return float(np.ptp(at)) if surrounded else 0.0


def sheared(system: System, body: str, u: Upset) -> float:
    """Shear at the ends of an upset body that friction holds there: at most, since what slips is sheared less.

    Pressed from h to λh the body spreads by r (λ^(−1/m) − 1) at its outside, r from where it does not move, along m of the other
    axes: all but those along which supports hold it at both ends. The mean over λh, or half of it between two ends that stick,
    is half of the shear at the end: u is parabolic between rough plates.
    """
    mesh = system.meshes[body]
    X, held = mesh.points, always_held(system.problem, body, mesh)
    out = []
    for a in range(X.shape[1]):
        ends = [X[:, a].min(), X[:, a].max()]
        fixed = [bool(held[X[:, a] <= ends[0] + NO_DIFFERENCE * np.ptp(ends), a].all()),
                 bool(held[X[:, a] >= ends[1] - NO_DIFFERENCE * np.ptp(ends), a].all())]  # fmt: skip
        if abs(u.across[a]) < ALONG and not all(fixed):
            out.append(X[:, a] - (ends[fixed.index(True)] if any(fixed) else 0.5 * sum(ends)))
    if not out or not u.sticking:
        return 0.0
    spread = float(np.linalg.norm(out, axis=0).max()) * ((u.height / u.left) ** (1.0 / len(out)) - 1.0)
    return 2.0 * spread * u.sticking / u.left
