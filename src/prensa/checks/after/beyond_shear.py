"""Metal pressed thin between rough tools on one or two layers of elements: friction beyond the shear yield stress.

No metal carries a traction along its surface that exceeds its shear yield stress k: it shears below. Of n layers of elements
across a strip the outer ones shear by the mean between their sides, (1 − 1/n) of the friction on both surfaces, so that n layers
carry k/(1 − 1/n): two layers 2 k, and one layer, whose mean is zero, whatever there is.
"""

from __future__ import annotations

from collections.abc import Iterator, Set
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, vstack

from prensa.checks.check import Committed, warning
from prensa.contact.faces import FacePoints
from prensa.contact.forces import ContactForces
from prensa.contact.passage import WORTH_SAYING
from prensa.contact.record import magnitude
from prensa.contact.recovery import mises_of
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.materials.protocol import Material
from prensa.materials.solids.j2 import J2
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.mesh import Mesh
from prensa.mesh.thin import side_numbers, strips
from prensa.system.bending import Thickness
from prensa.system.held import held
from prensa.system.once import once
from prensa.system.system import System
from prensa.types import Array, Flags, Index


class Second(NamedTuple):
    """The ``elements`` (m,) behind those behind the edges or faces of a contact, and the ``share`` (m,) of a line through the
    middles of both by which it goes on to the surface; 0 where there are none.
    """

    elements: Index
    share: Array

    @staticmethod
    @once
    def of(system: System, contact: int) -> Second:
        """Of a tool's contact, by its number, on quadrilaterals or bricks."""
        s = system.tool_contacts[contact]
        mesh = system.meshes[s.body]
        all_, sides = strips(mesh), _sides(system, s)
        number = side_numbers(np.concatenate([all_.sides.reshape(-1, sides.shape[1]), sides]), len(mesh.points))
        own, edge = number[: -len(sides)].reshape(all_.sides.shape[:3]), number[-len(sides) :]
        elements = np.broadcast_to(np.arange(len(mesh.cells))[:, None], own.shape)
        count, total = np.bincount(own.ravel()), np.bincount(own.ravel(), elements.ravel()).astype(np.int64)
        row, e, side = np.nonzero(own[:, s.behind] == edge[:, None])
        first = s.behind[e]
        across = own[row, first, 1 - side]
        second, depth = total[across] - first, np.linalg.norm(all_.across, axis=2)
        inner = count[across] == 2
        row, e, first, second = row[inner], e[inner], first[inner], second[inner]
        out = Second(s.behind.copy(), np.zeros(len(s.behind)))
        out.elements[e], out.share[e] = second, depth[row, first] / (depth[row, first] + depth[row, second])
        return out


def shear_yield(system: System, contact: int, given: Committed) -> Array:
    """Shear yield stress (points,) of the metal at a tool's contact, by number, at its rate: σ_eq/√3 of elements where more.

    That at the surface, where it is hardest, by a line through the middles of the two outer layers of elements.
    """
    s, second = system.tool_contacts[contact], Second.of(system, contact)
    b = next(b for b in system.blocks if b.body == s.body)
    law, history = b.law, b.at_law(given.state.history[system.blocks.index(b)])
    outer, inner = (_of_elements(law, history[elements]) for elements in (s.behind, second.elements))
    return system.at_points(s, outer + second.share * (outer - inner))


def _of_elements(law: Material, history: Array) -> Array:
    """Means (m,) over the integration points of a history (m, q, h)."""
    flat = np.ascontiguousarray(history.reshape(-1, history.shape[-1]))
    strong: Any = law
    k = np.maximum(strong.shear_strength(flat), mises_of(law.cauchy(flat)) / np.sqrt(3.0))
    return np.asarray(k.reshape(history.shape[:2]).mean(axis=1))


def _sides(system: System, s: Surface) -> Index:
    """Nodes (m, a) of the edges or faces of a contact in the mesh of its body."""
    return np.asarray((s.points.faces if isinstance(s.points, FacePoints) else s.points.edges) - system.span(s.body).start)


def at_nodes(s: Surface) -> bool:
    """Whether the points of a contact are nodes with straight edges or faces of four: others share what a corner covers."""
    if isinstance(s.points, FacePoints):
        return s.points.faces.shape[1] == 4
    return not s.sharp and s.points.are_nodes and bool((s.points.shares.factor == 0.5).all())


class Through(NamedTuple):
    """The strips (t,) of a body from one outline to the other that end on a contact.

    ``elements`` (t, e) and the share of its thickness that each has, a sparse matrix; ``layers`` (t,): how many; ``ends``
    (t, 2, a): nodes of the end on the contact, and of the other one, ``held`` (t,): whether a support holds it there.
    """

    elements: csr_matrix
    layers: Array
    ends: Index
    held: Flags


class Below(NamedTuple):
    """The strips that are now below points (k,) of a contact: their mean ``way`` (k, d) in an increment, how much they become
    thinner, ``layers`` of elements between the surfaces, twice those to a plane of symmetry, and whether they are ``pressed``.
    """

    way: Array
    thinner: Array
    layers: Array
    pressed: Flags


class BeyondShear:
    """Bodies of metal that tools press through their thickness: what friction beyond the shear yield stress adds to forces.

    The work of this friction on the way of the metal below, which is the mean of the strip through the thickness relative to
    the tool, is work that no metal does. In a slab that is ∫ (τ − k) x/h dA, by which the friction hill is too high.
    Where the metal does not flow there is none. Of contacts whose points are nodes, on quadrilaterals and bricks. ``reported``:
    bodies of which the friction hill has been found too high already.
    """

    def __init__(self, system: System, reported: Set[str] = frozenset()) -> None:
        self.system, self.reported = system, reported
        metals = {n for n, b in system.problem.bodies.items() if isinstance(b.material, J2)}
        self.own = [(i, s) for i, s in enumerate(system.tool_contacts) if s.body in metals and at_nodes(s)]
        self.open = {s.body for _, s in self.own if _of_sides(system.meshes[s.body])}
        self.known: dict[str, Through] = {}  # by contact, found when it is asked for

    def __call__(self, given: Committed) -> Iterator[Finding]:
        """What there is to say of each body, once."""
        work = given.state.energy.external - given.context.state.energy.external
        for body in sorted(self.open - self.reported):
            excess, part = self._excess(body, given)
            share = excess / (work - excess) if excess < work else np.inf if excess > 0.0 else 0.0
            if share > WORTH_SAYING:
                self.open.discard(body)
                yield warning(self._words(body, share, part))

    def _excess(self, body: str, given: Committed) -> tuple[float, float]:
        """Work of the last increment that the metal would not need, and the part of the area on which friction is beyond k."""
        excess, beyond, closed = 0.0, 0.0, 0.0
        for i, s in self.own:
            f = given.evaluation.contacts[i]
            t = magnitude(f.t)
            if s.body == body and t.any():
                closed += float(f.area[f.p > 0.0].sum())
                k = shear_yield(self.system, i, given)
                if (t > k).any():
                    beyond += float(f.area[t > k].sum())
                    excess += float((f.area * self._per_area(s, f, k, given))[t > k].sum())
        return excess, beyond / closed if closed else 0.0

    def _per_area(self, s: Surface, f: ContactForces, k: Array, given: Committed) -> Array:
        """Work per area (k,) of friction beyond k on the metal below, less what this then needs more to become thinner.

        Of stresses that shear by τ, √(k² − τ²) is left (`left`). 0 where nothing presses from the other side.
        """
        u, before = given.state.u, given.context.state.u
        moved = self.system.displacement(u) - self.system.displacement(before)
        slip = (f.stencils.ds @ (u - before)[f.stencils.dofs][:, :, None])[..., 0]
        below, t = self._below(s, moved, given), magnitude(f.t)
        along = ((below.way - moved[s.points.support[:, 0]])[:, None] * f.stencils.e).sum(axis=2)
        resisted = np.maximum(-(f.t * (slip + along)).sum(axis=1), 0.0) * (1.0 - k / np.where(t > 0.0, t, 1.0))
        # σ_eq dε_eq of the thickness, of half a strip: 2 of what is held across, √3 at least
        times = 1.0 if self.system.problem.space == "plane strain" else 0.5 * np.sqrt(3.0)
        thinner = times * k * np.maximum(below.thinner, 0.0) * (0.25 * np.pi - left(t / k, below.layers))
        return below.pressed * (resisted - thinner)

    def _below(self, s: Surface, moved: Array, given: Committed) -> Below:
        """The strips below the points of a contact, where nodes ``moved`` (n, d).

        A surface that sticks stays behind the metal below it, so that this is not the strip of the point's own elements.
        """
        from scipy.spatial import cKDTree  # not at the start of runs that have no such body

        if s.name not in self.known:
            self.known[s.name] = _through(self.system, s)
        t, x = self.known[s.name], self.system.positions(given.state.u)
        if not len(t.ends):
            none = np.zeros(len(s.points))
            return Below(np.zeros((len(none), x.shape[1])), none, none, none > 0.0)
        cells = self.system.meshes[s.body].cells + self.system.span(s.body).start
        middle, way = (t.elements @ v[cells].mean(axis=1) for v in (x, moved))
        now = np.linalg.norm(np.diff(x[t.ends].mean(axis=2), axis=1)[:, 0], axis=1)
        thinner = np.linalg.norm(np.diff((x - moved)[t.ends].mean(axis=2), axis=1)[:, 0], axis=1) - now
        pressed = t.held | self._pressed(s.body, given)[t.ends[:, 1]].all(axis=1)
        nearest = cKDTree(middle).query(s.points.at(x))[1]
        whole = np.where(t.held, 2.0, 1.0)
        return Below(way[nearest], (whole * thinner)[nearest], (whole * t.layers)[nearest], pressed[nearest])

    def _pressed(self, body: str, given: Committed) -> Flags:
        """Nodes (n,) of the system on which tools press that are in contact with a body."""
        out = np.zeros(len(self.system.X), dtype=bool)
        for s, f in zip(self.system.tool_contacts, given.evaluation.contacts):
            if s.body == body:
                out[s.points.support[f.p > 0.0].ravel()] = True
        return out

    def _words(self, body: str, share: float, part: float) -> str:
        known = [self.known[s.name] for _, s in self.own if s.body == body and s.name in self.known]
        # What one layer carries has no bound, and metal that is locked in it hardly flows. Of more layers the excess is that over
        # metal as it is here: on finer elements it hardens at the surface and carries a part of it.
        up_to = "more than" if share > 1.0 or any((t.layers[~t.held] == 1.0).any() for t in known) else "up to"
        return (
            f"{body!r} is pressed thin under friction beyond its shear yield stress, on {100.0 * part:.0f} % of the contact: "
            f"its few layers of elements carry it, metal does not, and forces are off, by {up_to} an estimated "
            f"{100.0 * min(share, 1.0):.0f} %; limit friction by the shear strength ('type: capped')"
        )


def _of_sides(mesh: Mesh) -> bool:
    """Whether a mesh is of quadrilaterals or bricks with straight sides."""
    return bool(mesh.cells.shape[1] == (8 if isinstance(mesh, BrickMesh) else 4))


def left(t: Array, layers: Array) -> Array:
    """Means (k,) of √(1 − τ²) over layers that shear by what is between friction t (k,) of both surfaces, over k, up to 1.

    Of ever thinner layers below a friction of k it is π/4.
    """
    out = np.zeros_like(t)
    for n in np.unique(layers[layers > 0.0]):
        own = layers == n
        places = 1.0 - (2.0 * np.arange(n) + 1.0) / n
        shear = np.minimum(np.abs(t[own, None] * places), 1.0)
        out[own] = np.sqrt(1.0 - shear**2).mean(axis=1)
    return out


def _through(system: System, s: Surface) -> Through:
    """The strips that end on a contact."""
    mesh, first = system.meshes[s.body], system.span(s.body).start
    all_, holds, n = strips(mesh), held(system, s.body), len(mesh.cells)
    sides = _sides(system, s)
    rows, layers, ends, still = [], [], [], []
    for row in range(len(all_.strip)):
        t = Thickness.of(mesh, all_, np.full(n, row), holds)
        number = side_numbers(np.concatenate([t.ends.reshape(-1, sides.shape[1]), sides]), len(mesh.points))
        own, end = np.nonzero(np.isin(number[: t.held.size].reshape(-1, 2), number[t.held.size :]))
        depth = np.linalg.norm(all_.across[row], axis=1) / all_.lengths[row]
        share = csr_matrix((depth, (all_.strip[row], np.arange(n))), (int(all_.strip.max()) + 1, n))
        rows.append(share[t.strip[own]])
        count = np.bincount(all_.strip[row], minlength=share.shape[0])
        layers.append(count[t.strip[own]].astype(np.float64))
        ends.append(np.stack([t.ends[own, end], t.ends[own, 1 - end]], axis=1) + first)
        still.append(t.held[own, 1 - end])
    return Through(vstack(rows).tocsr(), *(np.concatenate(v) for v in (layers, ends, still)))
