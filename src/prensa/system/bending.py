"""Bodies that bend, and by how much their elements err in it.

Linear elements lock in bending: as long as they are over the thickness, since their sides stay straight (MacNeal 1994); those of
F-bar lose, with the volume, a part of the bending of each single layer. Enhanced strains do neither, but fail under large
compression. So elastic bodies that name no element get them where they matter, unless tools and supports press the body across
its thickness (see `element_choice`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prensa.contact.passage import WORTH_SAYING
from prensa.materials.solids.j2 import J2
from prensa.mesh.bricks import BrickMesh
from prensa.mesh.faces import first_met
from prensa.mesh.mesh import Mesh
from prensa.mesh.thin import Strips, side_numbers, strips
from prensa.model import problem as model
from prensa.precision import NEGLIGIBLE
from prensa.system.held import Held, held
from prensa.system.moments import Moment, moments
from prensa.system.system import System
from prensa.types import Array, Flags, Index

MOST_RAYS = 1000
"""Ways through a body of tetrahedra that are looked at: a tool that presses meets many of them."""
FOR_BENDING = {2: "q4_enhanced", 3: "h8_enhanced"}
"""By the dimension of space."""


def has_strips(mesh: Mesh) -> bool:
    """Whether a mesh is of linear quadrilaterals or bricks."""
    return bool(mesh.cells.shape[1] == (8 if isinstance(mesh, BrickMesh) else 4))


def looked_at(system: System, body: str) -> bool:
    """Whether a run looks at how a body bends: metal of linear elements that its description does not name."""
    own = system.problem.bodies[body]
    open_ = own.element is None or body in system.chosen
    return open_ and isinstance(own.material, J2) and has_strips(system.meshes[body])


class Bending(NamedTuple):
    """What bending makes of a body: relative errors of its stiffness with the default element, by the shape that it takes.

    ``softest``, ``stiffest``: the least and the largest error; ``pressed``: whether something presses the body across its
    thickness; ``bent``: whether something acts across it elsewhere.
    """

    softest: float
    stiffest: float
    pressed: bool
    bent: bool


def percent(error: float) -> str:
    """The size of a relative error in per cent, in two digits."""
    return f"{float(f'{100.0 * abs(error):.2g}'):g}"


PLATE_SHAPES = {"axisymmetric": ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0)), "solid": ((1.0, 0.0), (1.0, 1.0))}
"""Curvatures along two ways: a plate bends to a cylinder or a dome, one of revolution also along the hoop alone."""


def stiffness_errors(s: Strips, row: Index, along: Index, nu: float, space: str, held: Flags | None = None) -> Array:
    """Relative errors (k, m) of the stiffness in bending of layers of the default element, strips in a row (m,) of m elements.

    k: one in the plane, else one for each of `PLATE_SHAPES`; ``held`` (m,): elements that supports keep from bending along the
    second way.
    An element of length a, that in the row ``along`` (m,), bends in shear: G/E' (a/t)² of the bending of the thickness t, where
    G/E' is (1 − ν)/2 of what is held across, and G/E = 1/(2 (1 + ν)) in plane stress; no side is straight along a hoop. Of the
    bending of each of n layers by itself, 1/n² of the whole, F-bar with its one volume keeps the deviatoric part, `q4` in plane
    stress all. A plate of curvatures κ has κ₁² + κ₂² + 2 ν κ₁ κ₂ of E' t³/12; (1 − ν) (κ₁² + κ₂² − (κ₁ + κ₂)²/3) of that is kept.
    """
    m = np.arange(len(row))
    thickness, layers = s.lengths[row, m], s.numbers[row, m]

    def bent(way: Index) -> Array:
        return (np.linalg.norm(s.across[way, m], axis=1) / thickness) ** 2

    if space in PLATE_SHAPES:
        across = bent(3 - row - along) if space == "solid" else np.zeros(len(row))
        out = [_of_plate(one, (bent(along), across), layers, nu) for one in PLATE_SHAPES[space]]
        return np.stack(out) if held is None else np.where(held, out[0], out)
    shear, kept = ((1.0 - nu) / 2.0,) * 2 if space == "plane strain" else (1.0 / (2.0 * (1.0 + nu)), 1.0 / (1.0 - nu**2))
    return np.asarray(shear * bent(along) - (1.0 - kept) / layers**2)[None]


def _of_plate(curved: tuple[float, float], bent: tuple[Array, Array], layers: Array, nu: float) -> Array:
    """Relative error (m,) of plates of curvatures along two ways, whose elements are ``bent`` (a/t)² (m,) along each."""
    (k, l), (first, second) = curved, bent
    whole, kept = k * k + l * l + 2.0 * nu * k * l, (1.0 - nu) * (k * k + l * l - (k + l) ** 2 / 3.0)
    shear = 0.5 * (1.0 - nu) * (k * k * first + l * l * second)
    return np.asarray((shear - (whole - kept) / layers**2) / whole)


@dataclass(frozen=True)
class Thickness:
    """The strips (s,) through the thickness of a body that end on its outline at both sides.

    ``strip`` (s,): their numbers; ``ends`` (s, 2, a): nodes of the two sides; ``middle`` (s, 2, d): the places of their middles;
    ``across`` (s, d): unit vectors from the first to the second; ``size`` (s,): the thickness; ``held`` (s, 2): whether supports
    hold the ends along it in all steps.
    """

    strip: Index
    ends: Index
    middle: Array
    across: Array
    size: Array
    held: Flags

    @staticmethod
    def of(mesh: Mesh, s: Strips, row: Index, held: Held | None) -> Thickness:
        """Of the strips in a row (m,) of each element of a mesh; ``held``: what supports hold of its nodes in all steps."""
        corners, at = s.sides.shape[3], (row, np.arange(len(row)))
        own, nodes = np.repeat(s.strip[at], 2), s.sides[at].reshape(-1, corners)
        side = side_numbers(np.concatenate([nodes, mesh.boundary[:, :corners]]), len(mesh.points))
        outer = np.isin(side[: len(nodes)], side[len(nodes) :])
        own, nodes = own[outer], nodes[outer]
        order = np.argsort(own, kind="stable")
        strip, first, count = np.unique(own[order], return_index=True, return_counts=True)
        strip, first = strip[count == 2], first[count == 2]
        ends = np.stack([nodes[order[first]], nodes[order[first + 1]]], axis=1)
        middle = mesh.points[ends].mean(axis=2)
        way = middle[:, 1] - middle[:, 0]
        size = np.linalg.norm(way, axis=1)
        across = way / size[:, None]
        return Thickness(strip, ends, middle, across, size, _holds(held, ends, across))

    @staticmethod
    def between_faces(mesh: BrickMesh, held: Held | None) -> Thickness:
        """Of tetrahedra, which have no strips: straight inwards from the middles of faces to those opposite, which face away."""
        x, rays = mesh.points[mesh.boundary[:, :3]], np.arange(0, len(mesh.boundary), -(-len(mesh.boundary) // MOST_RAYS))
        n = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        n /= np.linalg.norm(n, axis=1)[:, None]
        met, size = first_met(x[rays].mean(axis=1), -n[rays], x)
        through = (met >= 0) & ((n[rays] * n[met]).sum(axis=1) < -np.sqrt(0.5))
        rays, met, size = rays[through], met[through], size[through]
        ends, first = mesh.boundary[np.stack([rays, met], axis=1)], x[rays].mean(axis=1)
        middle = np.stack([first, first - size[:, None] * n[rays]], axis=1)
        return Thickness(np.arange(len(rays)), ends, middle, -n[rays], size, _holds(held, ends, -n[rays]))

    @staticmethod
    def all_of(mesh: Mesh, held: Held) -> Iterator[Thickness]:
        """Along each of the ways in which a body has strips, or once between its faces."""
        if isinstance(mesh, BrickMesh) and mesh.cells.shape[1] == 10:
            yield Thickness.between_faces(mesh, held)
        elif has_strips(mesh):
            s = strips(mesh)
            for row in range(len(s.strip)):
                yield Thickness.of(mesh, s, np.full(len(mesh.cells), row), held)


def _holds(held: Held | None, ends: Index, across: Array) -> Flags:
    """Whether supports hold the ``ends`` (s, 2, a) of strips along their ways ``across`` (s, d)."""
    return np.zeros(ends.shape[:2], dtype=bool) if held is None else held.towards(ends, across, float(np.sqrt(0.5)))


class EndMotions(NamedTuple):
    """Motions that supports prescribe of the ends of strips along them: flags (s, 2) of which, and ``ways`` (s, 2, d) of all.

    ``least`` (s, 2): whether an end may have gone further, since an earlier step may have ended anywhere on its way.
    """

    given: Flags
    ways: Array
    least: Flags


class BentStrips(NamedTuple):
    """Strips (s,) through the thickness of a body, which bend as the sections of a beam, in space of a plate along two ways.

    ``sides`` (s, w, 2, 2, a): along each of w = d − 1 ways the nodes of the two sections that bound a strip, of either of the two
    ends, a = d − 1 at each; ``layers`` (s,): elements across; ``lengths`` (s, w): the distance of the sections; ``thickness``
    (s,): theirs from end to end.
    """

    sides: Index
    layers: Array
    lengths: Array
    thickness: Array

    @staticmethod
    def of(mesh: Mesh, held: Held | None = None) -> BentStrips:
        """Of a mesh of quadrilaterals, through their thickness, or of bricks, through all but the longest way of their strips.

        ``held``: what supports hold of its nodes; ways of bricks that they hold at both ends are left out.
        """
        s, x = strips(mesh), mesh.points
        parts = []
        for row in np.argsort(s.lengths, axis=0, kind="stable")[:-1] if x.shape[1] == 3 else s.thin[:1]:
            t = Thickness.of(mesh, s, row, held)
            own = ~t.held.all(axis=1)
            ends = _fibres(x, t.ends[own])
            layers = np.zeros(int(s.strip.max()) + 1)
            layers[s.strip[row, np.arange(len(row))]] = s.numbers[row, np.arange(len(row))]
            sides = ends[:, :, _SECTIONS[x.shape[1]]].transpose(0, 2, 3, 1, 4)
            middle = x[sides].mean(axis=(3, 4))
            lengths = np.linalg.norm(middle[:, :, 1] - middle[:, :, 0], axis=2)
            parts.append(BentStrips(sides, layers[t.strip[own]], lengths, t.size[own]))
        return BentStrips(*(np.concatenate(one) for one in zip(*parts)))

    def curvatures(self, x: Array) -> Array:
        """Angles (s, w) between the sections of each strip over their distance, on nodes at x (n, d): > 0 where the ends part."""
        at = x[self.sides].mean(axis=4)
        d, middle = at[:, :, :, 1] - at[:, :, :, 0], at.mean(axis=3)
        across, along = d.sum(axis=2), middle[:, :, 1] - middle[:, :, 0]
        across /= np.linalg.norm(across, axis=2)[..., None]
        along -= (along * across).sum(axis=2)[..., None] * across
        along /= np.linalg.norm(along, axis=2)[..., None]
        angles = np.arctan2((d * along[:, :, None]).sum(axis=3), (d * across[:, :, None]).sum(axis=3))
        return np.asarray((angles[:, :, 1] - angles[:, :, 0]) / self.lengths)

    def of_revolution(self, x: Array) -> tuple[Array, Array]:
        """Curvatures (s, 2) in the meridian and along the hoop, and radii (s,), on nodes at x (n, 2) in axisymmetry.

        Along the thickness a radius changes by the component of the unit vector across, over the radius a share of the hoop.
        """
        at = x[self.sides[:, 0]].mean(axis=3)
        across, radius = (at[:, :, 1] - at[:, :, 0]).sum(axis=1), at[..., 0].mean(axis=(1, 2))
        hoop = across[:, 0] / np.hypot(*across.T) / radius
        return np.column_stack([self.curvatures(x)[:, 0], hoop]), radius


_SECTIONS = {2: np.array([[[0], [1]]]), 3: np.array([[[0, 3], [1, 2]], [[0, 1], [3, 2]]])}
"""Corners (w, 2, a) of an end of a strip at its two sections along each way, by the dimension of space."""


def _fibres(x: Array, ends: Index) -> Index:
    """The ``ends`` (s, 2, a) of strips with the nodes of the second in the order in which they stand across from the first's."""
    first, last = ends[:, 0], ends[:, 1]
    a = last.shape[1]
    ways = np.arange(a)[None] + np.arange(a)[:, None]
    orders = np.concatenate([ways % a, -ways % a])
    apart = np.linalg.norm(x[first][:, None] - x[last[:, orders]], axis=3).sum(axis=2)
    return np.stack([first, last[np.arange(len(last))[:, None], orders[apart.argmin(axis=1)]]], axis=1)


class _Way(NamedTuple):
    """A way through a body across which it may bend, with the relative errors of its elements by the shape that it takes."""

    body: str
    errors: Array
    through: Thickness

    @property
    def error(self) -> float:
        """The largest one, of either sign."""
        return float(np.abs(self.errors).max())


def bendings(system: System, unnamed: Iterable[str], least: float = WORTH_SAYING) -> dict[str, Bending]:
    """What bending makes of the ``unnamed`` bodies of quadrilaterals and bricks whose elements err by more than ``least``."""
    ways = [way for body in unnamed for way in _ways(system, body)]
    wrong = {w.body for w in ways if w.error > least}
    ways = [w for w in ways if w.body in wrong]
    if not ways:
        return {}
    # Of two bodies in contact nobody knows where they press on each other.
    pressed = {b: any(s.opposite is not None and s.acts_on((b,)) for s in system.surfaces) for b in wrong}
    bent = [_driven_across(system, w.body, w.through) for w in ways]
    for moment in moments(system):
        for k, (body, _, t) in enumerate(ways):
            gaps = gaps_across(system, body, t, moment, -t.size)[0]
            pressed[body] |= bool((gaps.sum(axis=1) < -NEGLIGIBLE * t.size).any())
            bent[k] |= bool((gaps < -NEGLIGIBLE * t.size[:, None]).any())
    out: dict[str, Bending] = {}
    # of the ways that something acts across, else of all, the one with the largest error comes last
    for way, acts in sorted(zip(ways, bent), key=lambda one: (one[1], one[0].error)):
        out[way.body] = Bending(float(way.errors.min()), float(way.errors.max()), pressed[way.body], acts)
    return out


def _ways(system: System, body: str) -> Iterator[_Way]:
    """The ways across which a body may bend: its thickness, in space all but the longest, unless supports hold both ends."""
    mesh, law, space = system.meshes[body], system.problem.bodies[body].material, system.problem.space
    if not has_strips(mesh):
        return
    s, holds = strips(mesh), held(system, body)
    solid, m = len(s.across) == 3, np.arange(len(mesh.cells))
    *rows, along = np.argsort(s.lengths, axis=0, kind="stable") if solid else (s.thin[0], 1 - s.thin[0])

    def kept(row: Index, t: Thickness) -> Flags:
        """Elements (m,) in strips of a row that supports hold at both ends."""
        return np.isin(s.strip[row, m], t.strip[t.held.all(axis=1)])

    through = [Thickness.of(mesh, s, row, holds) for row in rows]
    for i, (row, t) in enumerate(zip(rows, through)):
        own = stiffness_errors(s, row, along, law.poisson, space, kept(rows[1 - i], through[1 - i]) if solid else None)
        if solid:
            own[:, kept(row, t)] = 0.0
        yield _Way(body, own[np.arange(len(own)), np.argmax(np.abs(own), axis=1)], t)


def gaps_across(
    system: System, body: str, t: Thickness, moment: Moment, unknown: Array, moved: EndMotions | None = None
) -> tuple[Array, Index]:
    """Gaps (s, 2) at the ends of strips to what is there at a moment, tools in contact with the body and supports along them.

    With the numbers (s, 2) of the contacts of these tools among all of tools; -1: a support, or nothing. ``unknown`` (s,), or
    (c, s, 2) by contacts of tools, for each end: the gap to a tool whose place nobody knows. ``moved``: what supports move of
    the ends: a strip goes along with the one end that they move or hold, and is as long as they leave it between two.
    """
    unknown = np.broadcast_to(unknown if unknown.ndim == 3 else unknown[:, None], (len(system.tool_contacts), len(t.size), 2))
    out, d, middle = np.where(t.held, 0.0, np.inf), t.across.shape[1], t.middle
    nearest = np.full(out.shape, -1)
    if moved is not None and moved.given.any():
        outward = np.stack([-t.across, t.across], axis=1)
        ends = t.held | moved.given
        both, ways = ends.all(axis=1, keepdims=True), np.where(moved.given[..., None], moved.ways, 0.0)
        out = np.where(ends, np.where(both, (ways * outward).sum(axis=2), 0.0), np.inf)
        middle = middle + np.where(both, 0.0, ways.sum(axis=1))[:, None]
    for i, s in enumerate(system.tool_contacts):
        if s.body == body:
            master = system.tool_masters[s.against]
            seen = master.seen(middle.reshape(-1, d), moment.u)
            gap = seen.g.reshape(-1, 2) if moment.known[master.number] else unknown[i]
            nearer = facing(seen.n, t) & (gap < out)
            out, nearest = np.where(nearer, gap, out), np.where(nearer, i, nearest)
    return out, nearest


def facing(normals: Array, t: Thickness) -> Flags:
    """Ends (s, 2) of strips that tools face, by their normals (2 s, d) at these.

    A tool that has come through from the other side faces away from this one, and in space one that is met along the thickness
    of the other way faces neither.
    """
    outward, d = np.stack([-t.across, t.across], axis=1), t.across.shape[1]
    return np.asarray((normals.reshape(-1, 2, d) * outward).sum(axis=2) < (-np.sqrt(0.5) if d == 3 else 0.0))


def _driven_across(system: System, body: str, t: Thickness) -> bool:
    """Whether a support is moved, or a load acts, across the thickness of a body."""
    p, mesh, axes = system.problem, system.meshes[body], model.SPATIAL_AXES[: t.across.shape[1]]
    ways: list[tuple[str, Array]] = []
    for step in p.steps:
        for name, motion in p.driven(step).items():
            ways.append((name, np.array([getattr(motion, a) is not None for a in axes], dtype=float)))
    owners: tuple[model.Problem | model.Step, ...] = (p, *p.steps)
    for owner in owners:
        for name, f in owner.fixed.items():
            ways.append((name, np.array([getattr(f, a) not in (None, "held") for a in axes], dtype=float)))
        for name, load in owner.loads.items():
            pulled = load.traction if load.traction is not None else [0.0] * len(axes)
            ways.append((name, np.array([v != 0 for v in pulled], dtype=float)))
            if load.pressure is not None and name.partition(".")[0] == body:
                nodes = mesh.nodes(name.partition(".")[2], name)
                if np.isin(t.ends, nodes).all(axis=2).any():
                    return True
    for name, way in ways:
        owner_body, _, side = name.partition(".")
        if owner_body == body and way.any():
            near = np.isin(t.ends, mesh.nodes(side, name)).any(axis=(1, 2))
            if (np.abs(t.across[near]) @ way > np.sqrt(0.5)).any():
                return True
    return False
