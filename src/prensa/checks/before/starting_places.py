"""Tools that start inside a surface, or behind it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE, NOTABLE_DEPTH, SLIGHT, TOWARDS
from prensa.contact.pairing import Pairs
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity, coordinates
from prensa.linear.rigid_modes import CLOSED
from prensa.mesh.faces import facing
from prensa.model.interference import interference_of
from prensa.system.system import System
from prensa.types import Array

SUNK = 0.45
"""Depth over element depth from which no increment, however short, pushes a tool out of a plastic body."""
AWAY = np.arange(1, 257) / 64
"""Ways along the axis, over the size of a surface, at which a tool is tried to come out of it."""


def starting_places(system: System) -> Iterator[Finding]:
    """Overclosure and tools that look the wrong way, before anything moves."""
    start = system.initial()
    for s in system.tool_contacts:
        tool = system.tool_masters[s.against].tool
        nodes = s.points.nodes
        pairs = system.tool_masters[s.against].seen(system.positions(start.u)[nodes], start.u)
        ways = (pairs.n * s.node_normal).sum(axis=1)
        name, surface = tool.name, "+".join(s.description.surface)
        if (ways > TOWARDS).all():
            key = tool.description.direction_key
            how = f"reverse '{key}'" if key else "put it on the other side"
            if getattr(tool.description, "type", "") == "profile":
                how = (
                    "reverse the order of its 'points' (those of a file with 'points: {file: …, reverse: true}'): the tool "
                    "has to lie on their left"
                )
            elif getattr(tool.description, "type", "") == "stl":
                round_again = getattr(tool.description, "reverse", None)
                how = "leave 'reverse: true' out" if round_again else "turn its normals round with 'reverse: true'"
            yield Finding(
                f"tools.{name}" + (f".{key}" if key and getattr(tool.description, key) is not None else ""),
                f"its normal points the same way as that of {surface!r}: it stands behind the surface and would pull it "
                f"through the body; {how}, or name the boundary that it is to press",
                Severity.REFUSE,
            )
            continue
        given = interference_of(s.description)
        if given is not None and given.by == "geometry":
            continue
        depth = -pairs.g / float(s.points.depth.min())
        profile = getattr(tool.description, "type", "") == "profile"
        if profile and depth.max() > CLOSED and _holds_all(system, s):
            turned = tool.description.hint().removeprefix("; or ")
            yield Finding(f"tools.{name}", f"all of {s.body!r} lies inside it: {turned}", Severity.REFUSE)
            continue
        # A node whose nearest face of the tool looks its own way is past the tool's middle: contact would pull it out at the
        # far side.
        behind = np.where(ways > TOWARDS, depth, 0.0)
        k = int(np.argmax(behind))
        if behind[k] > NOTABLE_DEPTH and not start.contact.closed[s.rows].any():
            to_touch, at = _to_touch(system, s, k, -s.node_normal[k]), coordinates(system.X[nodes[k]])
            yield Finding(
                f"tools.{name}",
                f"it starts so deep inside {surface!r} that node {nodes[k] - system.offsets[s.body]} ({at}) is "
                "nearer to its far side, through which it would be pulled: move the tool "
                f"out{to_touch}{tool.description.hint()}",
                Severity.REFUSE,
            )
            continue
        if depth.max() > CLOSED and not start.contact.closed[s.rows].any():
            yield _inside(system, s, pairs, depth)


def _gaps_of_body(system: System, s: Surface) -> Array:
    """Gaps (k,) of the nodes of a contact's body from its tool, of those that the tool sees."""
    start = system.initial()
    g = system.tool_masters[s.against].seen(system.positions(start.u)[system.span(s.body)], start.u).g
    return np.asarray(g[~np.isnan(g)])


def _holds_all(system: System, s: Surface) -> bool:
    """Whether no node of a contact's body lies outside of its tool: where one side of a chain is the body, it is the other."""
    return bool((_gaps_of_body(system, s) <= CLOSED * float(s.points.depth.min())).all())


def _turned_round(system: System, s: Surface, depth: float, normal: Array) -> str:
    """What else may be wrong with a tool in which a node with outward normal (d,) lies ``depth`` deep, an element being 1.

    A plane or a chain that was turned round would have in it what lies outside of it now: that is no remedy if it is more.
    """
    description = system.tool_masters[s.against].tool.description
    g = _gaps_of_body(system, s)
    if depth <= SUNK or (getattr(description, "type", "") != "stl" and g.max() > -g.min()):
        return ""
    return description.hint(-normal)


def _inside(system: System, s: Surface, pairs: Pairs, depth: Array) -> Finding:
    """What to say of a tool that starts inside a surface; its nodes are as deep as ``depth`` (n,) over an element."""
    nodes, tool, surface = s.points.nodes, system.tool_masters[s.against].tool, "+".join(s.description.surface)
    k = int(np.argmax(depth))
    way, unit = pairs.g[k] * pairs.n[k], system.problem.units.length
    plastic = system.problem.bodies[s.body].material.plastic
    return Finding(
        f"tools.{tool.name}",
        f"it starts {-pairs.g[k]:.4g} inside {surface!r}, deepest at node {nodes[k] - system.offsets[s.body]} "
        f"({coordinates(system.X[nodes[k]])}): the first increment has to push it out; "
        + (
            _along_axis(system, s)
            if system.axisymmetric
            else f"move the tool by ({_at(way)}) {unit}" + _to_touch(system, s, k, pairs.n[k])
        )
        + _turned_round(system, s, float(depth[k]), s.node_normal[k])
        + (
            ""
            if system.dofs.dimension == 3
            else f"; if the overlap is meant, say so in contact {s.name!r}: 'interference: geometry'"
        ),
        Severity.REFUSE if plastic and depth[k] > SUNK else Severity.WARN,
    )


def _at(x: Array) -> str:
    """Components (d,) of a way, without those that turn it by less than answers show."""
    return coordinates(np.where(np.abs(x) > SLIGHT * np.abs(x).max(), x, 0.0))


def _to_touch(system: System, s: Surface, slot: int, normal: Array) -> str:
    """How to place a tool with the normal (d,) at node ``slot`` of a surface, in words; '' where no side there has a name.

    Of the sides that meet at the node, those that the contact lists if any, it is the one that faces the tool.
    """
    mesh, node = system.meshes[s.body], int(s.points.nodes[slot]) - system.offsets[s.body]
    there = {f"{s.body}.{side}": edges for side, edges in mesh.edges.items() if node in edges}
    listed = {side: edges for side, edges in there.items() if side in s.description.surface} or there
    cosines = {side: facing(mesh.points, edges, normal) for side, edges in listed.items()}
    best = min(cosines, key=cosines.__getitem__, default="")
    return f", or place it with 'touching: {best}'" if best and cosines[best] < 0.0 else ""


def _along_axis(system: System, s: Surface) -> str:
    """How far along the axis, the only way there is in axisymmetry, a tool comes out of a surface, in words."""
    start, master = system.initial(), system.tool_masters[s.against]
    x, place = system.positions(start.u)[s.points.nodes], master.place(start.u)

    def least(way: float) -> float:
        return float(master.seen_at(x, place + np.array([0.0, way, 0.0])).g.min())

    # In axisymmetry a die does not move along its radial normal: only a way along the axis can free it, if any does.
    ways = [sign * w for w in AWAY * float(np.ptp(x, axis=0).max()) for sign in (-1.0, 1.0)]
    out = next((w for w in ways if least(w) >= 0.0), None)
    if out is None:
        return f"leave {-least(0.0):.4g} more room between the two: no move along the axis brings it out"
    inside = 0.0
    while abs(out - inside) > NO_DIFFERENCE * abs(out):
        middle = 0.5 * (inside + out)
        inside, out = (inside, middle) if least(middle) >= 0.0 else (middle, out)
    return f"move the tool along the axis by {out:.4g}, or leave {-least(0.0):.4g} more room between the two"
