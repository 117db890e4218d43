"""Edges of tools that are finer than the elements, and dip into a surface between its nodes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.check import Committed, warning
from prensa.checks.during.penetration import ON_EDGE
from prensa.checks.thresholds import NOTABLE_DEPTH
from prensa.contact.forces import ContactForces
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.mesh.mesh import segments
from prensa.model.remeshing import remeshing_of
from prensa.system.system import System
from prensa.types import Array, Index


class Dip(NamedTuple):
    """An edge (2,) and its length, behind which a tool reaches, between its nodes, by a notable share of that length."""

    edge: Index
    length: float


class BetweenNodes:
    """The contacts of tools with edges, fillets or faces that are small against the elements: nodes know nothing of a dip.

    One of a tenth of an edge is reported, and dips that together miss a tenth of the force (`missed`), once a contact.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        # Meshes that are made anew follow their tools, and what one of them shows is soon gone.
        none = system.dofs.dimension != 2 or system.on_undeformed or remeshing_of(system.problem) is not None
        self.contacts = [] if none else [(i, s) for i, s in enumerate(system.tool_contacts) if not s.sharp]
        self.edges = {s.name: segments(s.points.edges) for _, s in self.contacts}
        # chords of quadratic edges are not where these lie, and other rules have points between nodes
        self.nodal = {s.name for _, s in self.contacts if s.points.are_nodes and (s.points.shares.factor == 0.5).all()}
        self.hollow = {s.name: _hollow(system.X[self.edges[s.name]]) for _, s in self.contacts}
        self.reported: set[str] = set()

    def __call__(self, given: Committed) -> Iterator[Finding]:
        """The deepest dip of each contact at the end of a step: on the way edges come and go between nodes."""
        if self.system.gone:
            return
        u, forces = given.state.u, given.evaluation.contacts
        x = self.system.positions(u)
        for i, s in self.contacts:
            # one edge of many in contact carries no notable share of the force
            if s.name in self.reported or NOTABLE_DEPTH * np.count_nonzero(forces[i].p > 0.0) > 1.0:
                continue
            words = self._dips(s, x, u) or self._falls_short(s, forces[i], x, u)
            if words:
                self.reported.add(s.name)
                yield warning(words)

    def _dips(self, s: Surface, x: Array, u: Array) -> str:
        """What there is to say of the deepest dip of a contact, for nodes at x (n, 2) of degrees of freedom u (ndof,)."""
        dip = self._deepest(s, x, u)
        if dip is None:
            return ""
        a, b = (dip.edge - self.system.offsets[s.body]).tolist()
        at, up = x[dip.edge].mean(axis=0).tolist()
        return (
            f"tool {s.against!r} lies more than {NOTABLE_DEPTH * dip.length:.3g} inside {'+'.join(s.description.surface)!r} "
            f"between nodes {a} and {b}, at ({at:.4g}, {up:.4g}), and touches neither as deep: its edge or fillet is finer than "
            "the elements, and forces are too small; shorten the elements there, or enlarge the fillet"
        )

    def _falls_short(self, s: Surface, f: ContactForces, x: Array, u: Array) -> str:
        """What there is to say of the force f of a contact, for nodes at x (n, 2) of degrees of freedom u (ndof,)."""
        share = self.missed(s, f, x, u) if s.name in self.nodal else 0.0
        if not share > NOTABLE_DEPTH:
            return ""
        count = int(np.count_nonzero(f.p > 0.0))
        nodes = "1 node carries" if count == 1 else f"{count} nodes carry"
        size = f", by an estimated {100.0 * share:.0f} %" if share < 1.0 else ""
        return (
            f"{nodes} all of tool {s.against!r} on {'+'.join(s.description.surface)!r}, and it lies deeper between nodes than at "
            f"them: its face, fillet or radius is small against the elements, and forces are too small{size}; shorten the "
            "elements there"
        )

    def missed(self, s: Surface, f: ContactForces, x: Array, u: Array) -> float:
        """Share of its force that a contact misses between its nodes, at x (n, 2) for degrees of freedom u (ndof,).

        A tool of depth u that is too little by the mean δ of the dips has a force too small by δ/u in a linear body, by less in
        metal that yields. Both are weighed by the forces of the nodes: the work of these on their way in the body, and of the
        largest of them on all dips, since the tool covers edges beside the last node that it presses, too. Nodes on a parabola of
        radius R miss L²/(12 R) at edges of length L. 0 where nodes have gone with the tool rather than before it.
        """
        master, edges = self.system.tool_masters[s.against], self.edges[s.name]
        push = s.points.to_nodes(f.weight * np.maximum(f.p, 0.0))
        first = self.system.offsets[s.body]
        moved = self.system.displacement(u)
        # a body that is pressed onto its tool has nodes there that do not move, and goes on itself
        way = moved[s.points.nodes] - moved[first : first + len(self.system.meshes[s.body].points)].mean(axis=0)
        work = float((push * (way * master.seen(x[s.points.nodes], u).n).sum(axis=1))[push > 0.0].sum())
        if not work > 0.0:
            return 0.0
        ends = x[edges]
        sunk = np.minimum(np.asarray(master.shape.closest(master.local(ends.reshape(-1, 2), u)).g).reshape(-1, 2), 0.0)
        places = ends[:, 0, None] + ON_EDGE[:, None] * (ends[:, 1] - ends[:, 0])[:, None]
        g = np.asarray(master.shape.closest(master.local(places.reshape(-1, 2), u)).g).reshape(len(edges), -1)
        between = sunk[:, :1] * (1.0 - ON_EDGE) + sunk[:, 1:] * ON_EDGE
        # a belt on its pulley: chords of a hollow side lie in a tool that the side itself goes along
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        between -= 0.5 * (length * self.hollow[s.name])[:, None] * ON_EDGE * (1.0 - ON_EDGE)
        # trapezoids: at the nodes themselves there is no dip
        dips = np.maximum(np.where(np.isfinite(g), between - g, 0.0), 0.0).sum(axis=1) / (len(ON_EDGE) + 1)
        return float(push.max() * dips.sum()) / work

    def _deepest(self, s: Surface, x: Array, u: Array) -> Dip | None:
        """The deepest dip over the length of its edge, for nodes at x (n, 2) of degrees of freedom u (ndof,)."""
        master, edges = self.system.tool_masters[s.against], self.edges[s.name]
        ends = x[edges]
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        # an arc of radius R over a chord L rises by L²/(8 R), which is no notable share of L where R is larger than this
        if float(length.max()) < 8.0 * NOTABLE_DEPTH * master.shape.radius:
            return None
        g = np.asarray(master.shape.closest(master.local(ends.reshape(-1, 2), u)).g).reshape(-1, 2)
        # gaps change by no more than the way
        near = np.flatnonzero(np.isfinite(g).all(axis=1) & (g.min(axis=1) < length))
        if not len(near):
            return None
        way = ends[near, 1] - ends[near, 0]
        places = ends[near, 0, None] + ON_EDGE[:, None] * way[:, None]
        inwards = np.column_stack([-way[:, 1], way[:, 0]])[:, None]
        sunk = np.maximum(-g[near].min(axis=1), 0.0) / length[near]
        # A narrow tool is nowhere deeper than half its width: it is looked for behind the edge, not for its depth in it.
        behind = places + (NOTABLE_DEPTH + sunk)[:, None, None] * inwards
        gaps = np.asarray(master.shape.closest(master.local(behind.reshape(-1, 2), u)).g).reshape(len(near), -1).min(axis=1)
        k = int(np.argmin(gaps))
        return Dip(edges[near[k]], float(length[near[k]])) if gaps[k] < 0.0 else None


def _hollow(ends: Array) -> Array:
    """Sines (m,) by which a side turns inwards along its edges, ends (m, 2, 2) with the body on the left; 0 where it bulges."""
    t = ends[:, 1] - ends[:, 0]
    t = t / np.hypot(*t.T)[:, None]
    turn = t[:-1, 1] * t[1:, 0] - t[:-1, 0] * t[1:, 1]
    turn = np.where((ends[:-1, 1] == ends[1:, 0]).all(axis=1), turn, 0.0)
    # at its ends the side goes on as beside them
    return np.maximum(np.maximum(np.append(turn, 0.0), np.append(0.0, turn)), 0.0)
