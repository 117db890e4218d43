"""Edges of tools that are finer than the elements, and dip into a surface between its nodes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.check import Committed, warning
from prensa.checks.during.penetration import ON_EDGE
from prensa.checks.thresholds import NOTABLE_DEPTH
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
    """The contacts of tools with edges or fillets that are small against the elements: the nodal forces know nothing of a dip.

    One of a tenth of an edge is reported, once a contact.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        # Meshes that are made anew follow their tools, and what one of them shows is soon gone.
        none = system.dofs.dimension != 2 or system.on_undeformed or remeshing_of(system.problem) is not None
        self.contacts = [] if none else [(i, s) for i, s in enumerate(system.tool_contacts) if not s.sharp]
        self.edges = {s.name: segments(s.points.edges) for _, s in self.contacts}
        self.reported: set[str] = set()

    def __call__(self, given: Committed) -> Iterator[Finding]:
        """The deepest dip of each contact at the end of a step: on the way edges come and go between nodes."""
        if self.system.gone:
            return
        u, forces = given.state.u, given.evaluation.contacts
        x = self.system.positions(u)
        for i, s in self.contacts:
            # one edge of many in contact bears no notable share of the force
            if s.name in self.reported or NOTABLE_DEPTH * np.count_nonzero(forces[i].p > 0.0) > 1.0:
                continue
            dip = self._deepest(s, x, u)
            if dip is not None:
                self.reported.add(s.name)
                a, b = (dip.edge - self.system.offsets[s.body]).tolist()
                at, up = x[dip.edge].mean(axis=0).tolist()
                yield warning(
                    f"tool {s.against!r} lies more than {NOTABLE_DEPTH * dip.length:.3g} inside "
                    f"{'+'.join(s.description.surface)!r} between nodes {a} and {b}, at ({at:.4g}, {up:.4g}), and touches "
                    "neither as deep: its edge or fillet is finer than the elements, and forces are too small; shorten the "
                    "elements there, or enlarge the fillet"
                )

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
