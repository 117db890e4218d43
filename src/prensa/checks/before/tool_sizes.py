"""Tools that are small against the elements that they press, sharp corners between nodes, soft contacts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.before.nodes_found import few_nodes_met
from prensa.checks.thresholds import NOTABLE_DEPTH
from prensa.contact.faces import FacePoints
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity
from prensa.materials.flow_curve import stress_at
from prensa.mesh.bricks import around_faces
from prensa.model.remeshing import remeshing_of
from prensa.system.element_sizes import least_size
from prensa.system.finer_part import may_part
from prensa.system.system import System

STIFFEST_BETA = 1e4
"""Stiffness of a contact over that of its elements, beyond which iterations suffer: the default is a hundred."""


def tool_sizes(system: System) -> Iterator[Finding]:
    """Tools that find no node to press on, or one, and contacts of a stiffness that is no use."""
    solid = system.dofs.dimension == 3  # there a run looks between nodes, and says how much is missed
    for i, s in enumerate(system.tool_contacts):
        tool = system.tool_masters[s.against].tool
        h = smallest_element(system, s)
        size, key = tool.description.face()
        if tool.description.tip():
            yield from _tip(system, s, h)
        # what a sharp face covers is cut out of edges, unless one lies under both of its corners
        elif size < (1 if s.sharp or solid else 2) * h and (finds := few_nodes_met(system, s)):
            what, least = "radius" if key.endswith("radius") else "face", "one element" if s.sharp or solid else "two elements"
            yield Finding(
                f"tools.{tool.name}.{key}",
                f"the {what} {size:.4g} is less than {least} of {'+'.join(s.description.surface)!r}, the smallest of "
                f"which is {h:.4g} long: {finds}; refine the surface there to {0.25 * size:.2g}",
                Severity.REFUSE if size < 0.5 * h and not solid else Severity.WARN,
                seen_in_run=_computed(system, s),
            )
        if not solid:  # what lies between nodes in space is looked for in the run
            yield from _corners(system, s)
        k_n = getattr(s.description.enforcement, "k_n", None)
        beta = s.description.enforcement.beta_of(s.unit)
        if beta > STIFFEST_BETA or (beta < 1 and _gives_way(system, s, beta)):
            which = f"k_n = {k_n:.3g}, beta = {beta:.2g}" if k_n is not None else f"beta = {beta:.2g}"
            result = "iterations suffer and pressures oscillate" if beta > 1 else "the tool penetrates by whole elements"
            yield Finding(f"contacts.{i}.enforcement", f"{which}: {result}; leave it out (beta = 100)")


def smallest_element(system: System, s: Surface) -> float:
    """The shortest edge (length) of a surface, of its faces in space, or of elements that its body may be given."""
    return min(shortest(system, s), least_size(system, s.body))


def shortest(system: System, s: Surface) -> float:
    """The shortest edge of a surface, of its faces in space."""
    if not isinstance(s.points, FacePoints):
        ends = system.X[s.points.edges]
        return float(np.hypot(*(ends[:, 1] - ends[:, 0]).T).min())
    corners = system.X[around_faces(s.points.faces)]
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    return float(length[length > 0.0].min())  # wedges name a node twice


def _computed(system: System, s: Surface) -> bool:
    """Whether a run computes a contact of few nodes on finer elements, and says what its force is off, or looks at its dips."""
    return not s.sharp and may_part(system, s) and remeshing_of(system.problem) is None


def _gives_way(system: System, s: Surface, beta: float) -> bool:
    """Whether a soft contact lets a tool sink in by a share of an element that is worth a word.

    Nothing bounds the pressure on an elastic body; a metal flows under three times its yield stress (Tabor).
    """
    flow = getattr(system.problem.bodies[s.body].material, "flow", None)
    if flow is None:
        return True
    stress = float(stress_at(flow, np.zeros(1), np.zeros(1))[0])
    return 3.0 * stress / (beta * s.modulus) > NOTABLE_DEPTH


def _corners(system: System, s: Surface) -> Iterator[Finding]:
    """Sharp corners between the points of a surface whose edges are not cut at them."""
    tool, start = system.tool_masters[s.against].tool, system.initial()
    # Surfaces that can be cut at corners take the covered part of an edge, and need no word.
    cuts = [] if s.sharp or not len(tool.shape.edges) else system.cuts(s, start.u, system.tool_masters[s.against].place(start.u))
    if not cuts:
        return
    ends = system.X[s.points.edges[cuts[0].edge]]
    share = cuts[0].covered if cuts[0].end == 0 else 1.0 - cuts[0].covered
    x, y = ends[0] + share * (ends[1] - ends[0])
    rule = s.points.rule
    why = "on the edges of quadratic elements" if rule.cuts else f"with 'integration: {rule.type}'"
    use = "elements with straight edges" if rule.cuts else "'integration: nodal', which takes what is covered,"
    yield Finding(
        f"tools.{tool.name}",
        f"its sharp edge lies between the nodes of {'+'.join(s.description.surface)!r} at ({x:.4g}, {y:.4g}), which {why} "
        f"count fully or not at all: its width is only accurate to {np.hypot(*(ends[1] - ends[0])):.2g}; put a node there, "
        f"use {use} or give a 'fillet'",
    )


def _tip(system: System, s: Surface, h: float) -> Iterator[Finding]:
    """The end of a tool that is nearest to the surface: how wide it is a tenth of an element from its end."""
    master, start = system.tool_masters[s.against], system.initial()
    tool, shape = master.tool, master.shape
    if shape.cavity or not NOTABLE_DEPTH * h > 0:  # sizes of new meshes may be as small as numbers are
        return
    x = system.positions(start.u)[s.points.nodes]
    pairs = master.seen(x, start.u)
    k = int(np.argmin(pairs.g))
    width, whole = shape.across(pairs.n[k], NOTABLE_DEPTH * h)
    size = width**2 / (8 * NOTABLE_DEPTH * h)  # the radius of a cylinder that is as wide there
    nearest, aside = x[k] - (pairs.g[k] + NOTABLE_DEPTH * h) * pairs.n[k], 2 * np.sqrt(NOTABLE_DEPTH) * h * pairs.e[k, 0]
    beside = master.seen(np.stack([nearest - aside, nearest + aside]), start.u)
    small = size < 2 * h and (beside.g > 0).any()
    if small and (finds := few_nodes_met(system, s)):  # else it goes on to both sides: the floor of a container, under its rim
        surface = "+".join(s.description.surface)
        rounded = f", or give a 'fillet' of {2 * h:.2g}" if hasattr(tool.description, "fillet") else ""
        yield Finding(
            f"tools.{tool.name}.{tool.description.tip()}",
            f"the end towards {surface!r} is as sharp as a radius of {size:.2g}, less than two elements, the smallest of which "
            f"is {h:.4g} long: {finds}; refine the surface there{rounded}",
            Severity.REFUSE if whole < h else Severity.WARN,
            seen_in_run=_computed(system, s),
        )
