"""Bodies that are pressed together so far that their elements wear out, and elastic metals pressed beyond any yield stress."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prensa.checks.before.extrusions import confined, extruded, mouth, spread
from prensa.checks.before.pressed_by_force import gaps_of_forces
from prensa.checks.before.pressing import pressings
from prensa.checks.before.punch_edges import past_edges
from prensa.checks.during.distortion import IN_A_SECTION
from prensa.checks.during.validity import STRAIN_WARNING, YIELDS_BEFORE, elastic_metal
from prensa.checks.thresholds import NO_DIFFERENCE, TOWARDS
from prensa.errors import Finding
from prensa.friction.law import At, FrictionLaw, bounded
from prensa.materials.flow_curve import stress_at
from prensa.mesh.mesh import displaced
from prensa.mesh.quality import POOR, quality
from prensa.policy import Policy
from prensa.precision import NEGLIGIBLE
from prensa.system.bending import Thickness
from prensa.system.held import Held, held
from prensa.system.system import System
from prensa.types import Array, Index


class Upset(NamedTuple):
    """The strip through a body that is pressed together most: its ``height`` between what presses it, and what is ``left`` of it.

    ``across`` (d,): the line of travel. ``held_by``: friction laws of the ends of it along which friction may hold the metal,
    True for a support that does.
    ``surrounded``: whether tools surround the body all along the height, as a container does; ``past_face``: shear of a layer of
    elements between metal that stands before a face and what flows past it; ``at_mouth``: shear of those between metal that a
    container holds and what spreads before its mouth; ``by_force``: whether it ends where the largest force of a tool that
    presses it does; ``at_least``: whether it begins where an earlier step may have ended anywhere on its way; ``driven``: whether
    a side of the body is moved, rather than a tool.
    """

    height: float
    left: float
    across: Array
    held_by: tuple[FrictionLaw | bool, ...]
    past_face: float
    surrounded: bool = False
    by_force: bool = False
    at_mouth: float = 0.0
    at_least: bool = False
    driven: bool = False


def far_upsets(system: System) -> Iterator[Finding]:
    """Bodies that are pressed together further than their elements bear, or than a metal without a yield stress."""
    p = system.problem
    if p.kinematics == "small":
        return
    for name in p.bodies:
        elastic = all(elastic_metal(p, b, Policy()) for b in system.blocks if b.body == name)
        u = upset(system, name) if elastic or system.dofs.dimension == 3 else None  # in the plane wear is for 'remesh'
        if u is not None and elastic:
            yield from _beyond_yield(system, name, u)
            continue
        worn = list(_wears(system, name, u)) if u is not None and system.dofs.dimension == 3 else []
        if worn:
            yield from worn
        elif not elastic and system.dofs.dimension == 3:
            yield from extruded(system, name)


def _wears(system: System, body: str, u: Upset) -> Iterator[Finding]:
    """What there is to say of a body that is pressed together further than its elements bear."""
    if edges := list(past_edges(system, body, u.across)):
        yield from edges
        return
    shear = u.past_face if u.surrounded else max(u.at_mouth, sheared(system, body, u))
    flat = 1.0 if u.surrounded else flattened(system, body, u)
    sound = 1.0 / math.hypot(1.0, shear)  # the scaled Jacobian of a rectangle that is sheared
    if flat * sound < POOR:
        place = _BY_A_FACE if u.surrounded else _BY_THE_MOUTH if shear == u.at_mouth > 0.0 else _BY_FRICTION
        yield Finding(
            f"bodies.{body}",
            f"{_together(body, u)}: {place}{f', by up to {shear:.2g}' * math.isfinite(shear)}{_FLATTENED * (sound >= POOR)}, and "
            "a run in space, which has no new meshes, may end before that, with what it has by then; press less far"
            f"{', give the die a slope below 45°' * u.surrounded}, or compute {IN_A_SECTION}",
            seen_in_run=True,
        )


def _beyond_yield(system: System, body: str, u: Upset) -> Iterator[Finding]:
    """What there is to say of an elastic metal that is pressed together, unless it is so slender that it buckles instead.

    Between two clamped ends, where it bears most, at a strain of (π t/h)²/3 of the thickness t (Euler).
    """
    out = spread(system, body, u.across)
    width = 2.0 * float(np.abs(out.places).max(axis=0).min(initial=np.inf))
    if min(1.0 - u.left / u.height, (math.pi * width / u.height) ** 2 / 3.0) > STRAIN_WARNING:
        yield Finding(
            f"bodies.{body}.material",
            f"{_together(body, u)}, and it is elastic with the modulus of a metal: {YIELDS_BEFORE}",
            seen_in_run=True,
        )


def _together(body: str, u: Upset) -> str:
    """By how much, in words."""
    bound = "up to " * u.by_force + "at least " * u.at_least
    what = f"the motion of a side of {body!r} presses it" if u.driven else f"tools press {body!r}"
    much = f"{what} together by {bound}{u.height - u.left:.4g} of {u.height:.4g}"
    return much + ", as far as it yields to their force" * u.by_force


INTERVALS = 100
"""Intervals of the travel, and of the width, over which shear and pressure are summed: travels are 0.2 % off at most."""
_BY_FRICTION = "where friction holds the metal its elements are sheared"
_BY_THE_MOUTH = "where it spreads before the mouth of the die that holds the rest its elements are sheared"
_FLATTENED = ", and all of them flattened"
_BY_A_FACE = "where it flows past metal that stands before a face across its way its elements are sheared"


def upset(system: System, body: str) -> Upset | None:
    """The strip through a body that is pressed together most, by known motions or by force of tools; None if none is."""
    holds, most = held(system, body), None
    for t in Thickness.all_of(system.meshes[body], holds):
        of_forces = gaps_of_forces(system, body, t)
        for moment, gaps, contacts, moved in pressings(system, body, t, of_forces) if len(t.size) else ():
            left = t.size + gaps.sum(axis=1)
            left = np.where(((contacts >= 0) | moved.given).any(axis=1) & (left > 0.0), left, np.inf)
            k = int(np.argmin(left / t.size))
            if left[k] < t.size[k] and (most is None or left[k] * most.height < most.left * t.size[k]):
                most = _pressed(system, body, t, k, float(left[k]), contacts[k], holds)
                lost = [i for i in contacts[k] if i >= 0 and not moment.known[system.tool_masters[_tool(system, i)].number]]
                forces = bool(lost) and bool(np.isfinite(of_forces[moment.plan.number, lost, k]).all())
                least = (bool(lost) and not forces) or bool(moved.least[k].any())
                most = most._replace(by_force=forces, at_least=least, driven=bool(moved.ways[k][moved.given[k]].any()))
    if most is None:
        return None
    length = confined(system, body, most.across)  # which becomes no shorter
    if length >= most.left:
        return most._replace(surrounded=True)
    mouth = sheared_at_mouth(system, body, most, length)
    return most._replace(height=most.height - length, left=most.left - length, at_mouth=mouth)


def _tool(system: System, contact: int) -> str:
    """The tool of a contact by its number."""
    return system.tool_contacts[contact].against


def _pressed(system: System, body: str, t: Thickness, k: int, left: float, contacts: Index, holds: Held) -> Upset:
    """Strip k of a body, of which what presses its ends, ``contacts`` (2,) of tools or supports, leaves a length."""
    ends = [_held_by(system, holds, t.ends[k, end], t.across[k], int(contacts[end])) for end in range(2)]
    own = [s for i, s in enumerate(system.tool_contacts) if s.body == body and (i in contacts or contacts.max() < 0)]
    element = max((float(s.points.depth.max()) for s in own), default=np.inf)
    return Upset(float(t.size[k]), left, t.across[k], tuple(filter(None, ends)), float(t.size[k] - left) / element)


def _held_by(system: System, holds: Held, end: Index, across: Array, contact: int) -> FrictionLaw | bool:
    """What acts along the end of a strip: friction by its law, or whether a support of all of its nodes ``end`` (a,) does."""
    if contact < 0:
        return bool((holds.flags[end].all(axis=0) & (np.abs(holds.ways @ across) < TOWARDS)).any())
    law = system.tool_contacts[contact].description.friction or system.problem.friction
    return law if law is not None and not law.frictionless else False


def sheared(system: System, body: str, u: Upset) -> float:
    """Shear at the ends of an upset body that friction or supports hold there, at most.

    Pressed from h to λh the body spreads by r (λ^(−1/m) − 1) at its outside, r from where it does not move, along m of the other
    axes: all but those along which supports hold it at both ends. The mean over λh, or half of it between two ends that stick,
    is half of the shear at the end: u is parabolic between rough plates. What slips is sheared less, as its flow rule says: by
    friction τ of the shear strength k, and q = τ/k, at a rate of √3 q/√(1 − q²) times that of the equivalent strain. The largest
    pressure is taken for all of it, that of a slab from the outside, dp/dr = τ/(λh) for each such end. Of a ring, whose bore
    closes where the slab has its largest pressure, the shear is that of metal that sticks.
    """
    out = spread(system, body, u.across)
    if not len(out.ways) or not u.held_by:
        return 0.0
    reach, m = out.distances, len(out.ways)
    share = np.exp(np.linspace(0.0, np.log(u.left / u.height), INTERVALS + 1))
    sticks = 2.0 * reach.max() * (share ** (-1.0 / m) - 1.0) * len(u.held_by) / (share * u.height)
    flow = getattr(system.problem.bodies[body].material, "flow", None)
    laws = [law for law in u.held_by if isinstance(law, FrictionLaw)]
    if flow is None or len(laws) < len(u.held_by) or reach.min() > NO_DIFFERENCE * reach.max():
        return float(sticks[-1])
    plane = 2.0 / np.sqrt(3.0) if m == 1 else 1.0  # equivalent strain and pressure at the outside of what spreads along one axis
    strain = -plane * np.log(share)
    flows = stress_at(flow, strain, np.zeros_like(strain))
    by_width = reach.max() * share ** (-1.0 / m) / (share * u.height)
    q = _rubs(laws, plane * flows, flows / np.sqrt(3.0), by_width)
    slips = np.sqrt(3.0) * q / np.sqrt(np.maximum(1.0 - q**2, NEGLIGIBLE**2))
    rate = 0.5 * (slips[1:] + slips[:-1]) * np.diff(strain)
    return float(np.minimum(rate, np.diff(sticks)).sum())


def flattened(system: System, body: str, u: Upset) -> float:
    """Scaled Jacobian of the elements of an upset body over that at first, by flattening alone: 1 of boxes, less of tetrahedra.

    That of half of them, where all are as short and as wide as the mean.
    """
    mesh, out, share = system.meshes[body], spread(system, body, u.across), u.left / u.height
    wider = share ** (-1.0 / max(len(out.ways), 1))
    scale = np.eye(len(u.across)) + (share - 1.0) * np.outer(u.across, u.across) + (wider - 1.0) * out.ways.T @ out.ways
    before = quality(mesh).jacobian
    return float(np.median(quality(displaced(mesh, mesh.points @ scale)).jacobian / np.maximum(before, NEGLIGIBLE)))


def _rubs(laws: Sequence[FrictionLaw], outside: Array, k: Array, by_width: Array) -> Array:
    """Largest friction under slabs over their shear strengths k (n,), for pressures (n,) ``outside`` and widths over heights."""
    p, tau = outside, np.zeros_like(outside)
    for _ in range(INTERVALS):
        taus = [np.minimum(bounded(law, p, np.zeros_like(p), At(k=k))[0], k) for law in laws]
        tau, p = np.max(taus, axis=0), p + np.sum(taus, axis=0) * by_width / INTERVALS
    return np.asarray(tau / k)


def sheared_at_mouth(system: System, body: str, u: Upset, length: float) -> float:
    """Shear of elements between metal that a container holds on a ``length`` and what spreads before its mouth; 0 without one.

    What is pressed from h to λh spreads there by r (λ^(−1/m) − 1), as in `sheared`, with friction or without, and what the
    container holds does not: one layer of elements goes from the one to the other, and as much more metal as lies along a mouth
    that is rounded, λ times as high as at first.
    """
    out = spread(system, body, u.across)
    if not len(out.ways) or length == 0.0:
        return 0.0
    rounded, element = mouth(system, body, u.across)
    if not np.isfinite(rounded):
        return 0.0
    height, left = u.height - length - rounded, u.left - length - rounded
    if left <= 0.0:
        return float("inf")
    wide = float(out.distances.max()) * ((height / left) ** (1.0 / len(out.ways)) - 1.0)
    return wide * height / (left * (element + rounded))
