"""Outlines that fold: sides that have passed through other sides of their body, edges that hang on tools, sides of elements.

Nothing keeps a body from passing through itself: there is no contact of a body with itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np

from prensa.checks.before.solids_overlap import Solid, twice_inside
from prensa.checks.check import Solved, ended_by, warning
from prensa.checks.thresholds import NO_DIFFERENCE, TOUCHING_DEPTH
from prensa.contact.surface import Surface
from prensa.elements.shapes import table
from prensa.errors import Finding, coordinates
from prensa.mesh.mesh import segments
from prensa.mesh.overlap import Overlap
from prensa.model.problem import Contact
from prensa.precision import SMALLEST
from prensa.result.folding import Outlined
from prensa.system.contact_surfaces import contact_edges
from prensa.system.failure import Fold, Folded, Hang, Past
from prensa.system.system import System
from prensa.types import Array, Index

DRAWN_OUT = 2.0
"""Length of an edge over that at first …"""
CHORD = 0.25
"""… and depth of its middle in a tool, over that length, beyond which it is caught on a corner of the tool."""


class SelfIntersection:
    """Bodies that pass through themselves."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.reported: set[str] = set()
        """Bodies in space of which it is said."""

    def __call__(self, given: Solved) -> Iterator[Finding]:
        """Of condensed bodies the displacements are known at the end of a step."""
        if given.complete or given.context.ends_step:
            if self.system.dofs.dimension == 3:
                yield from self._in_space(given.displacements())
            elif through := fold(given.outlines):
                yield ended_by(Folded(through, hanging(self.system, given.displacements())))

    def _in_space(self, u: Array) -> Iterator[Finding]:
        """Bodies in space that have come to lie in themselves, each once: nothing but the answer is lost there."""
        x = self.system.positions(u)
        for body, mesh in self.system.meshes.items():
            if body in self.reported:
                continue
            inside = twice_inside(Solid(body, x[:0], x[self.system.span(body)], mesh.boundary))
            if len(inside):
                self.reported.add(body)
                yield warning(
                    f"body {body!r} passes through itself near ({coordinates(inside[0])}): nothing keeps its sides apart, and "
                    "forces are wrong from here on; end the step before, or put a tool between them"
                )


def fold(at: Outlined) -> Fold | None:
    """The deepest fold of any body in the plane; None if there is none."""
    found = [f for body, met in at.overlaps.items() if (f := _of_body(at.system, body, met)) is not None]
    return max(found, key=lambda f: f.depth, default=None)


def hanging(system: System, u: Array) -> Hang | None:
    """The edge in contact whose middle lies deepest in a tool, of those that a corner of the tool has drawn out; None without.

    Contact acts at nodes. One that friction holds behind a corner is dragged along, and its edge becomes a chord of the tool.
    """
    x, out = system.positions(u), []
    for s in system.tool_contacts if system.dofs.dimension == 2 else ():
        ends = segments(_edges(system, s))
        first, last = x[ends[:, 0]], x[ends[:, 1]]
        length = np.hypot(*(system.X[ends[:, 1]] - system.X[ends[:, 0]]).T)
        stretch = np.hypot(*(last - first).T) / length
        master = system.tool_masters[s.against]
        g = [master.seen(p, u).g for p in (first, last, 0.5 * (first + last))]
        # Depth of the middle beyond that of the ends: a chord of the tool. Stretch alone would blame extrusion, whose new
        # surface draws edges out sevenfold.
        depth = np.nan_to_num(np.minimum(g[0], g[1]) - g[2], nan=0.0)
        depth[(stretch < DRAWN_OUT) | (depth < CHORD * length)] = 0.0
        k = int(np.argmax(depth))
        if depth[k] > 0:
            side, at = "+".join(s.description.surface), first[k].tolist()
            out.append(Hang(side, master.name, at[0], at[1], float(depth[k]), float(stretch[k])))
    return max(out, key=lambda h: h.depth, default=None)


def _of_body(system: System, body: str, met: Sequence[Overlap]) -> Fold | None:
    """The deepest of the places where the outline of a body lies in itself, if deeper than outlines that just touch are.

    Wrinkles of a surface, one or two sides of elements long, cross too, and nothing is wrong but their elements. Their
    mean depth distinguishes them from flanks that have met: it is less, however far one node is on the wrong side. A wall that
    has come out on the far side of another is through, however thin.
    """
    deep = [k for k in met if k.stretches > 2 or k.depth > TOUCHING_DEPTH * k.size]
    if not deep:
        return None
    worst = max(deep, key=lambda found: found.depth)
    ends = system.outlines[body] + system.offsets[body]
    names = sorted(" and ".join(sides_of(system, body, ends[k])) for k in worst.pair)
    return Fold(names[0], names[1], worst.x, worst.y, worst.depth)


def sides_of(system: System, body: str, nodes: Index) -> list[str]:
    """Boundaries 'body.name' of a body of which nodes, as the whole system counts, are part; most of them first.

    Those that only meet an end are left out where another has more; the body's name alone where none has any.
    """
    local = nodes - system.offsets[body]
    shared = {name: int(np.isin(local, edges).sum()) for name, edges in system.meshes[body].edges.items()}
    most = max(shared.values(), default=0)
    least = 2 if most > 1 else 1
    names = sorted((n for n, k in shared.items() if k >= least), key=lambda n: -shared[n])
    return [f"{body}.{n}" for n in names] or [body]


def past_support(system: System, held: Index, body: str, nodes: Index, u: Array) -> Past | None:
    """A side of an element's ``nodes`` that has slid past a straight support of the body, and that support; None if none has.

    held: prescribed degrees of freedom. Beyond the end of a support nothing holds a free side off.
    """
    x, sides = system.positions(u), system.meshes[body].edges
    for support in sides:
        own = np.unique(sides[support]) + system.offsets[body]
        for axis, component in enumerate("xy"):
            flat = np.ptp(system.X[own, axis]) <= NO_DIFFERENCE * system.length
            if not (
                flat and np.isin(own, nodes).any() and np.isin(system.dofs.displacement.dof(own, component), held).all()
            ):
                continue
            inner = np.sign(system.X[:, axis][system.span(body)].mean() - system.X[own[0], axis])
            others = np.setdiff1d(nodes, own)
            depth = inner * (x[own, axis].mean() - x[others, axis])
            if len(others) and depth.max() > NO_DIFFERENCE * system.length:
                deep = others[depth > NO_DIFFERENCE * system.length]
                side = [n for n in sides_of(system, body, deep) if n not in (body, f"{body}.{support}")]
                if side:
                    return Past(
                        side[0], f"{body}.{support}", float(depth.max()), float(depth.max()) / _shortest(system, nodes)
                    )
    return None


def _shortest(system: System, nodes: Index) -> float:
    """Length of the shortest side of an element at first, from corner to corner."""
    x = system.X[nodes[:3] if len(nodes) in (3, 6) else nodes[:4]]
    return float(np.hypot(*(np.roll(x, -1, axis=0) - x).T).min())


def _edges(system: System, s: Surface) -> Index:
    """Edges (k, 2|3) of a contact with a tool, by the numbers of all nodes."""
    assert isinstance(s.description, Contact)
    return contact_edges(system, s.description) + system.offsets[s.body]


def free_sides(system: System, held: Index, body: str, nodes: Index) -> list[str]:
    """Sides of an element's ``nodes`` that are in no contact and that no support holds; held: prescribed degrees of freedom."""
    out = []
    for name in sides_of(system, body, nodes):
        if name == body:
            continue
        own = side_nodes(system, name)
        touched = any(s.body == body and np.isin(own, s.points.nodes).all() for s in system.surfaces)
        supported = any(np.isin(system.dofs.displacement.dof(own, k), held).all() for k in "xy")
        if not touched and not supported:
            out.append(name)
    return out


def side_nodes(system: System, side: str) -> Index:
    """Nodes (k,) of a side 'body.boundary', as the whole system counts."""
    body, _, name = side.partition(".")
    return np.unique(system.meshes[body].edges[name]) + system.offsets[body]


def least_on_sides(x: Array) -> Array:
    """Least Jacobian on the sides of quadratic elements x (6|8, e, 2), quarter by quarter, over their mean there → (e,).

    Between the corners it can be negative with every corner below 180°: where a side is bent far into its element, or its
    middle lies nearer to an end than a quarter of its length.
    """
    J = np.einsum("pad,aec->pedc", _slopes_on_sides(len(x)), x)
    det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    return np.asarray(det.min(axis=0) / np.maximum(np.abs(det.mean(axis=0)), SMALLEST))


@cache
def _slopes_on_sides(nodes: int) -> Array:
    """Slopes dN (p, nodes, 2) at the corners and the quarters of the sides of an element."""
    corners = np.array([[0, 0], [1, 0], [0, 1]] if nodes == 6 else [[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    after = np.roll(corners, -1, axis=0)
    at = np.concatenate([(1 - s) * corners + s * after for s in np.arange(4) / 4])
    return table(nodes, (at, np.ones(len(at)))).dN
