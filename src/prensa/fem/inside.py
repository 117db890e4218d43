"""Metal inside a tool: nodes of the outlines that a tool has passed over because no contact of theirs is against it.

Contacts see their own points alone. Here all other nodes of all outlines are held against all tools.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.contact.integration import depth_of
from prensa.fem.outlines import named_edges
from prensa.fem.system import System
from prensa.mesh.mesh import boundary_edges

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ALLOWED = 0.05  # depth over element size, beyond what the contacts of the tool sink in, that counts as a touch


class Watch(NamedTuple):
    """Nodes (n,) of outlines that are in no contact with a tool, and the size (n,) of the elements at them."""

    tool: int
    nodes: Index
    size: Array


class Inside(NamedTuple):
    """A node (its number in the body, and its place) that lies by ``depth`` inside a tool; ``side``: 'body.boundary'."""

    tool: str
    node: int
    body: str
    side: str
    x: float
    y: float
    depth: float

    def __str__(self) -> str:
        return (
            f"node {self.node} of {self.side!r} at ({self.x:.4g}, {self.y:.4g}) lies {self.depth:.3g} inside tool "
            f"{self.tool!r}, which no contact of that side is against"
        )

    @property
    def remedy(self) -> str:
        """What to write."""
        return (
            f"add '{{surface: {self.side}, against: {self.tool}}}' to 'contacts' (or 'surface: {self.body}', the whole "
            "outline), or to 'no_contact' if it is meant"
        )


def watches(system: System) -> list[Watch]:
    """What to look at in a system: for each tool the nodes of outlines that neither a contact nor ``no_contact`` names."""
    if system.dofs.dimension != 2 or system.gone:
        return []
    nodes, size = _outlines(system)
    out = []
    for t, tool in enumerate(system.tools):
        known = [s.points.nodes for s in system.surfaces if s.tool == t]
        for entry in system.problem.no_contact:
            for name in entry.surface if entry.against == tool.name else ():
                body = name.partition(".")[0]
                known.append(np.unique(named_edges(system.meshes[body], (name,))) + system.offsets[body])
        left = ~np.isin(nodes, np.concatenate([np.zeros(0, dtype=np.int64), *known]))
        if left.any():
            out.append(Watch(t, nodes[left], size[left]))
    return out


def _outlines(system: System) -> tuple[Index, Array]:
    """Nodes (n,) of all outlines, and the least length or depth (n,) of the elements at them."""
    nodes, sizes = [], []
    for body, mesh in system.meshes.items():
        edges = boundary_edges(mesh.cells)
        length = np.hypot(*(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]).T)
        h = np.minimum(length, depth_of(edges, mesh.cells, mesh.points))
        size = np.full(len(mesh.points), np.inf)
        np.minimum.at(size, edges, h[:, None])
        own = np.unique(edges)
        nodes.append(own + system.offsets[body])
        sizes.append(size[own])
    return np.concatenate(nodes), np.concatenate(sizes)


def gaps(system: System, w: Watch, u: Array) -> Array:
    """Signed distances (n,) of the nodes of a watch from its tool, for degrees of freedom u (ndof,)."""
    x, y, turn = system.place_of(w.tool, u)
    c, s = np.cos(turn), np.sin(turn)
    tool = system.tools[w.tool]
    arm = system.X[w.nodes] + system.displacement(u)[w.nodes] - tool.at - [x, y]
    return np.asarray(tool.shape.closest(arm @ np.array([[c, -s], [s, c]])).g)


def sunk_in(system: System, u: Array) -> Array:
    """Largest penetration (tools,) of the contacts of each tool, for degrees of freedom u (ndof,)."""
    out = np.zeros(len(system.tools))
    for s in system.surfaces:
        out[s.tool] = max(out[s.tool], -float(system.node_pairs(s, u).g.min()))
    return out


def inside(system: System, watched: list[Watch], u: Array, sunk: Array | None = None) -> Inside | None:
    """The node that lies deepest inside a tool with which it is in no contact, over its element; None if none does.

    sunk (tools,): what the contacts of each tool sink in, which nodes beside them may too; computed where it matters if None.
    """
    worst, found = 0.0, None
    for w in watched:
        g = gaps(system, w, u)
        if not (g < -ALLOWED * w.size).any():
            continue
        sunk = sunk_in(system, u) if sunk is None else sunk
        beyond = (-g - sunk[w.tool]) / w.size - ALLOWED
        k = int(np.argmax(beyond))
        if beyond[k] > worst:
            worst, found = float(beyond[k]), _described(system, w, k, w.nodes[beyond > 0], u, float(-g[k]))
    return found


def _described(system: System, w: Watch, k: int, deep: Index, u: Array, depth: float) -> Inside:
    """Node number k of a watch in words; the side named is that of most of the nodes that lie ``deep`` inside."""
    node = int(w.nodes[k])
    body = next(b for b in reversed(list(system.offsets)) if system.offsets[b] <= node)
    first, edges = system.offsets[body], system.meshes[body].edges
    sides = [name for name, e in edges.items() if node - first in e]
    side = max(sides, key=lambda name: int(np.isin(deep - first, edges[name]).sum()), default="")
    x, y = system.X[node] + system.displacement(u)[node]
    name = f"{body}.{side}" if side else body
    return Inside(system.tools[w.tool].name, node - first, body, name, float(x), float(y), depth)
