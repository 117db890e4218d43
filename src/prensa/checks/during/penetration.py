"""Metal inside a tool: nodes of the outlines that a tool has passed over because no contact of theirs is against it.

Contacts see their own points alone. Here all other nodes of all outlines are held against all tools, and edges between two of
them that a narrow tool reaches between its nodes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.before.overlap import within, within_faces
from prensa.checks.check import Solved, ended_by
from prensa.checks.during.distortion import IN_A_SECTION
from prensa.checks.during.folding import Folding
from prensa.checks.thresholds import SLIGHT, TOUCHING_DEPTH
from prensa.contact.integration import depth_of
from prensa.errors import Finding
from prensa.mesh.bricks import BrickMesh, around_faces, every_face
from prensa.mesh.faces import area_vectors
from prensa.mesh.mesh import Mesh, segments
from prensa.precision import SMALLEST
from prensa.system.contact_surfaces import named_edges
from prensa.system.failure import Inside, MetalInside
from prensa.system.held import symmetric
from prensa.system.system import System
from prensa.types import Array, Flags, Index

NARROW = 0.02
"""Depth over element size between nodes that counts as none: a narrow tool is no deeper there than half its width."""
ON_EDGE = np.arange(1, 8) / 8
"""Places on an edge at which a tool between its nodes is looked for."""


class Watch(NamedTuple):
    """Nodes (n,) of outlines that are in no contact with a tool, and the size (n,) of the elements at them.

    ``edges`` (k, 2): straight pieces of outlines between two of these nodes, in places of ``nodes``.
    """

    tool: int
    nodes: Index
    size: Array
    edges: Index


class Penetration:
    """Metal inside a tool with which it has no contact; ``folding`` knows the elements that fold over themselves, if any may."""

    def __init__(self, system: System, folding: Folding | None) -> None:
        self.system, self.folding, self.watched = system, folding, watches(system)

    def __call__(self, given: Solved) -> Iterator[Finding]:
        """Inside condensed bodies displacements are known at the end of a step; before, outlines are looked at."""
        c, result, system = given.context, given.result, self.system
        assert result.evaluation is not None
        sunk = np.zeros(len(system.tools))
        for s, f in zip(system.tool_contacts, result.evaluation.contacts):
            t = system.tool_masters[s.against].number
            # Nodes beside a contact may lie as deep as its points sink in: a penalty is no missing contact.
            sunk[t] = max(sunk[t], -float(f.g.min()))
        creased = None
        if given.complete and self.folding is not None:
            creased = self.folding.creased(c, self.folding.folded(result.u))
        node = inside(system, self.watched, given.outlines.u, sunk, creased)
        # Interiors of condensed bodies are computed only where an outline shows something, or a step ends.
        if not given.complete and (node is not None or c.ends_step):
            node = inside(system, self.watched, given.displacements(), sunk)
        if node is not None:
            yield ended_by(MetalInside(node))


def watches(system: System) -> list[Watch]:
    """What to look at in a system: for each tool the nodes of outlines that neither a contact nor ``no_contact`` names."""
    if system.gone:
        return []
    nodes, size, pieces = _outlines(system)
    out = []
    for t, tool in enumerate(system.tools):
        known = [s.touching for s in system.against(tool.name)]
        for entry in system.problem.no_contact:
            for name in entry.surface if entry.against == tool.name else ():
                body = name.partition(".")[0]
                known.append(np.unique(named_edges(system.meshes[body], (name,))) + system.offsets[body])
        left = ~np.isin(nodes, np.concatenate([np.zeros(0, dtype=np.int64), *known]))
        if left.any():
            edges = pieces[np.isin(pieces, nodes[left]).all(axis=1)]
            out.append(Watch(t, nodes[left], size[left], np.searchsorted(nodes[left], edges)))
    return out


def _outlines(system: System) -> tuple[Index, Array, Index]:
    """Nodes (n,) of all outlines in order, the least length or depth (n,) of the elements at them, straight pieces (k, 2).

    Of bodies in space the nodes and edges of their faces.
    """
    nodes, sizes, pieces = [], [], []
    for body, mesh in system.meshes.items():
        if isinstance(mesh, BrickMesh):
            own, size, edges = _skin(mesh)
            nodes.append(own + system.offsets[body])
            sizes.append(size)
            pieces.append(edges + system.offsets[body])
            continue
        edges = mesh.boundary
        length = np.hypot(*(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]).T)
        h = np.minimum(length, depth_of(edges, mesh.cells, mesh.points))
        size = np.full(len(mesh.points), np.inf)
        np.minimum.at(size, edges, h[:, None])
        own = np.unique(edges)
        nodes.append(own + system.offsets[body])
        sizes.append(size[own])
        pieces.append(segments(edges) + system.offsets[body])
    return np.concatenate(nodes), np.concatenate(sizes), np.concatenate(pieces)


def _skin(mesh: BrickMesh) -> tuple[Index, Array, Index]:
    """Nodes (n,) on the faces of a body, the shortest edge (n,) of the elements there, and the edges (k, 2) of its faces."""
    edges, inner = (
        np.stack([ring, np.roll(ring, -1, axis=1)], axis=-1).reshape(-1, 2)
        for ring in map(around_faces, (mesh.boundary, every_face(mesh.cells)))
    )
    # wedges name a node twice
    edges, inner = (ends[ends[:, 0] != ends[:, 1]] for ends in (edges, inner))
    size = np.full(len(mesh.points), np.inf)
    np.minimum.at(size, inner, np.linalg.norm(mesh.points[inner[:, 1]] - mesh.points[inner[:, 0]], axis=1)[:, None])
    own = np.unique(mesh.boundary)
    return own, size[own], np.unique(np.sort(edges, axis=1), axis=0)


def _before(system: System, w: Watch, u: Array) -> Array:
    """The nodes (n, d) of a watch in the frame of its tool, for degrees of freedom u (ndof,)."""
    return system.tool_masters[system.tools[w.tool].name].local(system.positions(u)[w.nodes], u)


def sunk_in(system: System, u: Array) -> Array:
    """Largest penetration (tools,) of the contacts of each tool, for degrees of freedom u (ndof,)."""
    out = np.zeros(len(system.tools))
    for s in system.tool_contacts:
        t = system.tool_masters[s.against].number
        out[t] = max(out[t], -float(system.nodes_seen(s, u).g.min()))
    return out


def inside(
    system: System, watched: list[Watch], u: Array, sunk: Array | None = None, creased: Index | None = None
) -> Inside | None:  # fmt: skip
    """The node that lies deepest inside a tool with which it is in no contact, over its element; None if none does.

    sunk (tools,): what the contacts of each tool sink in, which nodes beside them may too; computed where it matters if None.
    creased (k,): nodes of elements that fold over themselves.
    """
    worst, found = 0.0, None
    for w in watched:
        x = _before(system, w, u)
        g = np.asarray(system.tools[w.tool].shape.closest(x).g)
        g, k, edge = _between(system, w, x, g)
        allowed = np.where(edge < 0, TOUCHING_DEPTH, NARROW)
        if creased is not None:
            allowed[(edge < 0) & np.isin(w.nodes[k], creased)] = SLIGHT  # what makes an element fold is found then
        if not (g < -allowed * w.size[k]).any():
            continue
        sunk = sunk_in(system, u) if sunk is None else sunk
        # The node came there little by little: no shorter increment helps, so the run ends instead of being cut.
        beyond = (-g - sunk[w.tool]) / w.size[k] - allowed
        at = int(np.argmax(beyond))
        if beyond[at] > worst:
            worst = float(beyond[at])
            found = _described(system, w, int(k[at]), w.nodes[k[beyond > 0]], u, float(-g[at]))
            if edge[at] >= 0:
                found = _on_edge(system, w, found, int(edge[at]), u)
    return found


def _between(system: System, w: Watch, x: Array, g: Array) -> tuple[Array, Index, Index]:
    """Gaps (m,) of the nodes at x (n, d), whose gaps are g (n,), and of places on edges that a tool may reach between its nodes.

    With the node (m,) of each, and its edge (m,), -1 of the nodes themselves. A place has a gap that is no less than that of a
    node, less the way to it: edges with longer ones are out of reach.
    """
    nodes, none = np.arange(len(g)), np.full(len(g), -1)
    a, b = w.edges.T
    near = (g[a] > 0) & (g[b] > 0) & (g[a] + g[b] < np.linalg.norm(x[b] - x[a], axis=1))
    if not near.any():
        return g, nodes, none
    edge = np.repeat(np.flatnonzero(near), len(ON_EDGE))
    share = np.tile(ON_EDGE, int(near.sum()))[:, None]
    places = (1.0 - share) * x[a[edge]] + share * x[b[edge]]
    more = np.asarray(system.tools[w.tool].shape.closest(places).g)
    least = np.where(w.size[a] < w.size[b], a, b)[edge]
    return np.concatenate([g, more]), np.concatenate([nodes, least]), np.concatenate([none, edge])


def _on_edge(system: System, w: Watch, found: Inside, edge: int, u: Array) -> Inside:
    """What was found at a node of an edge of a watch, reported for the edge and its middle."""
    ends = w.nodes[w.edges[edge]]
    x, y, *z = (system.X[ends] + system.displacement(u)[ends]).mean(axis=0).tolist()
    first, edges = system.offsets[found.body], system.meshes[found.body].edges
    sides = [name for name, e in edges.items() if any(set(ends - first) <= set(piece) for piece in e.tolist())]
    side = f"{found.body}.{sides[0]}" if sides else found.side
    return found._replace(node=int(ends[0] - first), other=int(ends[1] - first), x=x, y=y, side=side, z=z[0] if z else math.nan)


def engulfed(system: System) -> list[tuple[str, str]]:
    """Tools and the bodies in whose metal their middle lies at the beginning, and that are not meant to go there."""
    u = system.initial().u
    x = system.positions(u)
    out = []
    for t, tool in enumerate(system.tools):
        middle = np.asarray(tool.shape.centre)[None]
        if tool.shape.half_space or not float(tool.shape.closest(middle).g[0]) < 0.0:  # cavities, and what is endless
            continue
        place = middle + tool.at + system.place_of(t, u)[: system.dofs.dimension]
        meant = {name for entry in system.problem.no_contact if entry.against == tool.name for name in entry.surface}
        for body, mesh in system.meshes.items():
            if body not in meant and _within_body(place, mesh, x[system.span(body)]).all():
                out.append((tool.name, body))
    return out


def _within_body(x: Array, mesh: Mesh, points: Array) -> Flags:
    """Whether places x (n, d) lie in a body whose nodes are at ``points``."""
    if isinstance(mesh, BrickMesh):
        return within_faces(x, points, mesh.boundary)
    edges = segments(mesh.boundary)
    return within(x, points[edges[:, 0]], points[edges[:, 1]])


def _faces(system: System, w: Watch, node: int, side: Index, u: Array) -> float:
    """Cosine between the faces (k, 4 | 6) of a side at one of their nodes and what is before it of the tool; 0 in the plane."""
    body = system.body_of(node)
    x, own = system.positions(u)[system.span(body)], node - system.offsets[body]
    if x.shape[1] == 2:
        return 0.0
    n = area_vectors(x[side[(side == own).any(axis=1)]])[1].sum(axis=(0, 1))
    tool = system.tool_masters[system.tools[w.tool].name].seen(x[own][None], u).n[0]
    return -float(n @ tool) / max(float(np.linalg.norm(n)), SMALLEST)


def _described(system: System, w: Watch, k: int, deep: Index, u: Array, depth: float) -> Inside:
    """Node number k of a watch in words; the side named is that of most of the nodes that lie ``deep`` inside.

    Of several, as at a corner, the one that faces the tool.
    """
    node = int(w.nodes[k])
    body = system.body_of(node)
    first, edges = system.offsets[body], system.meshes[body].edges
    sides = [name for name, e in edges.items() if node - first in e]
    shares = {name: (int(np.isin(deep - first, edges[name]).sum()), _faces(system, w, node, edges[name], u)) for name in sides}
    side = max(sides, key=lambda name: shares[name], default="")
    x, y, *z = (system.X[node] + system.displacement(u)[node]).tolist()
    name = f"{body}.{side}" if side else body
    met = any(s.body == body for s in system.against(system.tools[w.tool].name))
    through = ""
    if met and side and symmetric(system, body, edges[side]).all():
        remesh = IN_A_SECTION if z else "'remesh: auto'"
        again = f", or {remesh}" if system.problem.bodies[body].material.plastic else ""
        through = f"a finer mesh where the tool presses, a larger radius or 'fillet' of it{again}"
    return Inside(system.tools[w.tool].name, node - first, body, name, x, y, depth, -1, through, *z)
