"""Tools whose edges, fillets or faces are small against the elements: what contacts of few nodes miss of the force."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np

from prensa.checks.after.rims import Rim, rim
from prensa.checks.check import Committed, warning
from prensa.checks.during.penetration import ON_EDGE
from prensa.checks.thresholds import NOTABLE_DEPTH, SLIGHT
from prensa.contact.faces import FacePoints, face_measures
from prensa.contact.forces import ContactForces
from prensa.contact.passage import WORTH_SAYING
from prensa.contact.surface import Surface
from prensa.errors import Finding, coordinates
from prensa.mesh.hollows import hollow, inside, outward, sides
from prensa.mesh.mesh import segments
from prensa.model.remeshing import remeshing_of
from prensa.precision import SMALLEST
from prensa.system.system import System
from prensa.types import Array, Index

NO_FORCE = "no force acts"
"""What is off where a tool presses no node."""


class Dip(NamedTuple):
    """Nodes (2,) of an edge, (4,) of a face, and its length, behind which a tool reaches by a notable share of that."""

    nodes: Index
    length: float


class Missed(NamedTuple):
    """Shares of its force that a contact misses ``between`` its nodes, and at edges ``beyond`` them, most at a ``place``."""

    between: float = 0.0
    beyond: float = 0.0
    place: Array = np.zeros(3)

    @property
    def most(self) -> float:
        """The larger of the two, of which each is known to a factor of two."""
        return max(self.between, self.beyond)


class Right(NamedTuple):
    """A force that finer elements found right, but for the share ``found``, where dips seemed to miss the share ``missed``."""

    missed: float
    found: float

    def covers(self, missed: float, dip: Dip | None) -> bool:
        """Whether it says that the force is right too where dips seem to miss another share: then finer elements are spared.

        What is missed grows as dips do, so that neither share is worth saying before the larger of the two is. A ``dip`` that
        itself is worth a word was there, or it is another contact.
        """
        larger = max(self.missed, self.found)
        return missed <= self.missed or (dip is None and missed * larger <= self.missed * WORTH_SAYING)


NEVER_ASKED = Right(-1.0, 0.0)


class OnFiner(Protocol):
    """Who computes the surroundings of a contact on finer elements."""

    def __call__(self, system: System, s: Surface, given: Committed, nodes: Index, layers: int) -> float | None:
        """Share by which the force of a contact is too small there: around ``nodes``, so many layers of elements.

        Negative of a force that is too large; None where it cannot be known.
        """


class BetweenNodes:
    """The contacts of tools with edges, fillets or faces that are small against the elements: nodes know nothing of a dip.

    Where few nodes carry a tool that lies deeper between them, or turns away there, what the force misses is computed on finer
    elements (``on_finer``), and reported where it is notable. Elsewhere dips of a tenth of an edge are reported, and those that
    together miss a tenth of the force (`missed`). All once a contact.
    """

    def __init__(self, system: System, on_finer: OnFiner | None = None) -> None:
        self.system, self.on_finer = system, on_finer
        # Meshes that are made anew follow their tools, and what one of them shows is soon gone.
        none = system.on_undeformed or remeshing_of(system.problem) is not None
        # A plane is nowhere deeper between the ends of a straight piece than at them.
        flat = {name for name, master in system.tool_masters.items() if master.shape.half_space}
        own = [(i, s) for i, s in enumerate(system.tool_contacts) if not (_curved(s) or s.against in flat)]
        self.contacts = [] if none else own
        self.pieces = {s.name: _pieces(s) for _, s in self.contacts}
        self.N, self.parabola = inside(system.dofs.dimension, ON_EDGE)
        self.nodal = {s.name for _, s in self.contacts if s.sharp or _by_nodes(s)}
        self.hollow = {s.name: hollow(system.X[self.pieces[s.name]]) for _, s in self.contacts}
        self.reported: set[str] = set()
        self.right: dict[str, Right] = {}

    def __call__(self, given: Committed) -> Iterator[Finding]:
        """What there is to say of each contact at the end of a step: on the way edges come and go between nodes."""
        if self.system.gone:
            return
        for i, s in self.contacts:
            f = given.evaluation.contacts[i]
            # one edge of many in contact, a row of faces of many rows in space, carries no notable share of the force
            space = self.system.dofs.dimension == 3
            few = bool(NOTABLE_DEPTH * np.count_nonzero(f.p > 0.0) ** (0.5 if space else 1.0) <= 1.0)
            if s.name in self.reported or not (few or space):
                continue
            if words := self._in_space(s, f, given, few) if space else self._of(s, f, given):
                self.reported.add(s.name)
                yield warning(words)

    def _of(self, s: Surface, f: ContactForces, given: Committed) -> str:
        """What there is to say of the force f of a contact, at the end of the increment ``given``."""
        u = given.state.u
        x = self.system.positions(u)
        # what a sharp corner covers is cut out of an edge, and no dip
        dip = None if s.sharp else self.deepest(s, x, u)
        missed = self.missed(s, f, x, u).between if s.name in self.nodal and not s.sharp else 0.0
        pressed = s.points.support[f.p > 0.0, 0]
        share = None
        if s.name in self.nodal and (missed > SLIGHT or self._turns(s, pressed, x, u) or (dip is not None and len(pressed))):
            if self.right.get(s.name, NEVER_ASKED).covers(missed, dip):
                return ""
            nodes = pressed if dip is None else np.union1d(pressed, dip.nodes)
            # what is as many elements away as an edge is small feels nothing of it
            share = None if self.on_finer is None else self.on_finer(self.system, s, given, nodes, round(1.0 / NOTABLE_DEPTH))
            if share is not None and abs(share) <= WORTH_SAYING:
                self.right[s.name] = Right(missed, abs(share))
                return ""
        pushed = self._pushed(s, given)
        if dip is not None:
            return self.words(s, dip, x, _off(share, pushed) if len(pressed) else NO_FORCE)
        off: float | None = missed if share is None else share
        if share is None and len(pressed) == 1 and self._plastic(s):
            off = None  # metal carries its hardness times an area, of which one node knows nothing
        return self._few(s, len(pressed), off, pushed) if share is not None or missed > NOTABLE_DEPTH else ""

    def _in_space(self, s: Surface, f: ContactForces, given: Committed, few: bool) -> str:
        """The same in space, where nothing is computed on finer elements; ``few``: a row of nodes carries a notable share."""
        u, count = given.state.u, int(np.count_nonzero(f.p > 0.0))
        x, pushed = self.system.positions(u), self._pushed(s, given)
        dip = self.deepest(s, x, u) if few else None
        if not count:
            return "" if dip is None else self.words(s, dip, x, NO_FORCE)
        missed = self.missed(s, f, x, u)
        # of what the tool would bear whose depth is that of the nodes and δ more; as in the plane of one node
        share = missed.most / (1.0 + missed.most)
        off = None if count == 1 and self._plastic(s) else share
        if dip is not None:
            return self.words(s, dip, x, _off(off if share > SLIGHT else None, pushed))
        if missed.beyond > missed.between and share > WORTH_SAYING:
            # the pressed nodes already bear a part of the strip beside them
            return self._edge(s, count, missed.place, _off(off, pushed, "up to "))
        return self._few(s, count, off, pushed) if missed.between > NOTABLE_DEPTH else ""

    def _plastic(self, s: Surface) -> bool:
        return self.system.problem.bodies[s.body].material.plastic

    def _pushed(self, s: Surface, given: Committed) -> bool:
        """Whether a force on the tool of a contact is given in the step."""
        return any(dof in given.context.plan.push for dof in self.system.tool_masters[s.against].dofs.tolist())

    def _turns(self, s: Surface, pressed: Index, x: Array, u: Array) -> bool:
        """Whether a tool turns notably from a pressed node to the next one: its edge or fillet is between them or near."""
        pieces = self.pieces[s.name]
        beside = pieces[np.isin(pieces, pressed).any(axis=1)]
        n = self.system.tool_masters[s.against].seen(x[beside].reshape(-1, x.shape[1]), u).n.reshape(*beside.shape, x.shape[1])
        # a chord of a unit circle is the sine of what it turns by, where that is small
        return bool((np.linalg.norm(n[:, 1:] - n[:, :1], axis=2) > NOTABLE_DEPTH).any())

    def words(self, s: Surface, dip: Dip, x: Array, off: str) -> str:
        """What there is to say of the deepest dip of a contact, for nodes at x (n, 2), and of what is ``off``."""
        *nodes, last = (dip.nodes - self.system.offsets[s.body]).tolist()
        at = coordinates(x[dip.nodes].mean(axis=0))
        return (
            f"tool {s.against!r} lies more than {NOTABLE_DEPTH * dip.length:.3g} inside {'+'.join(s.description.surface)!r} "
            f"between nodes {', '.join(map(str, nodes))} and {last}, at ({at}), and touches none as deep: its edge or fillet is "
            f"finer than the elements, and {off}; shorten the elements there, or enlarge the fillet"
        )

    def _few(self, s: Surface, count: int, share: float | None, pushed: bool) -> str:
        """What there is to say of a contact of so many nodes that misses a share of its force; ``pushed``: it is given."""
        nodes = "1 node carries" if count == 1 else f"{count} nodes carry"
        deeper = "" if share is not None and share < 0.0 else ", and it lies deeper between nodes than at them"
        return (
            f"{nodes} all of tool {s.against!r} on {'+'.join(s.description.surface)!r}{deeper}: its face, fillet or radius is "
            f"small against the elements, and {_off(share, pushed)}; shorten the elements there"
        )

    def _edge(self, s: Surface, count: int, place: Array, off: str) -> str:
        """What there is to say of a contact of so many nodes, beyond which an edge of the tool lies, as at a ``place`` (3,)."""
        nodes = "the node that carries" if count == 1 else f"the {count} nodes that carry"
        return (
            f"an edge of tool {s.against!r} lies beyond {nodes} it on {'+'.join(s.description.surface)!r} and before the next, "
            f"as near ({coordinates(place)}): what it covers there presses nothing, and {off}; shorten the elements there, or "
            "let a row of nodes lie just inside the edge"
        )

    def missed(self, s: Surface, f: ContactForces, x: Array, u: Array) -> Missed:
        """Shares of its force that a contact misses, for nodes at x (n, 2|3) of degrees of freedom u (ndof,).

        A tool of depth u that is too little by the mean δ of the dips has a force too small by δ/u in a linear body, by less in
        metal that yields. Both are weighed by the forces of the nodes: the work of these on their way in the body, and of the
        largest pressure on all dips, since the tool covers edges beside the last node that it presses, too. Forces would not do:
        in a half or a quarter nodes on planes of symmetry have a part of theirs. Nodes on a parabola of
        radius R miss L²/(12 R) at edges of length L. 0 where nodes have gone with the tool rather than before it.

        Over that of the nodes: in space, where δ is often no small part of u, u + δ is taken for the depth. Of balls, rolls and
        round punches on 2 to 9 nodes it is 0.7 to 1.2 times what a mesh three times as fine has more in elastic bodies, and up to
        1.9 times in metal.
        """
        master, pieces = self.system.tool_masters[s.against], self.pieces[s.name]
        push = s.points.to_nodes(f.weight * np.maximum(f.p, 0.0))
        moved = self.system.displacement(u)
        # a body that is pressed onto its tool has nodes there that do not move, and goes on itself
        way = moved[s.points.nodes] - moved[self.system.span(s.body)].mean(axis=0)
        work = float((push * (way * master.seen(x[s.points.nodes], u).n).sum(axis=1))[push > 0.0].sum())
        if not work > 0.0:
            return Missed()
        ends = x[pieces]
        sunk = np.minimum(self._gaps(s, ends, u), 0.0)
        g = self._gaps(s, self.N @ ends, u)
        # a belt on its pulley: chords of a hollow side lie in a tool that the side itself goes along
        between = sunk @ self.N.T - 0.5 * (sides(ends) * self.hollow[s.name]) @ self.parabola.T
        # trapezoids: at the nodes themselves there is no dip
        dips = np.maximum(np.where(np.isfinite(g), between - g, 0.0), 0.0)
        volume = float((dips.sum(axis=1) * self._areas(s, f, x)).sum()) / (len(ON_EDGE) + 1) ** self.parabola.shape[1]
        own = Missed(float(f.p.max()) * volume / work)
        if self.system.dofs.dimension == 2:
            return own
        beyond: Rim = rim(self.system, s, f, x, u, dips, self.N)
        return own._replace(beyond=beyond.work / work, place=beyond.place)

    def _areas(self, s: Surface, f: ContactForces, x: Array) -> Array:
        """Areas (m,) of the pieces of a contact at nodes x (n, 2|3), as the weights of its points have them."""
        ends = x[self.pieces[s.name]]
        area = face_measures(ends).sum(axis=1) if ends.shape[1] == 4 else sides(ends)[:, 0]
        if self.system.axisymmetric:
            area = area * ends[:, :, 0].mean(axis=1)
        return np.asarray(area * (float(f.weight.sum()) / max(float(area.sum()), SMALLEST)))

    def _gaps(self, s: Surface, x: Array, u: Array) -> Array:
        """Gaps (m, k) of places x (m, k, d) to the tool of a contact."""
        master = self.system.tool_masters[s.against]
        return np.asarray(master.shape.closest(master.local(x.reshape(-1, x.shape[-1]), u)).g).reshape(x.shape[:2])

    def deepest(self, s: Surface, x: Array, u: Array) -> Dip | None:
        """The deepest dip over the length of its piece, for nodes at x (n, d) of degrees of freedom u (ndof,)."""
        pieces = self.pieces[s.name]
        ends = x[pieces]
        length = sides(ends).max(axis=1)
        # an arc of radius R over a chord L rises by L²/(8 R), which is no notable share of L where R is larger than this
        if float(length.max()) < 8.0 * NOTABLE_DEPTH * self.system.tool_masters[s.against].shape.radius:
            return None
        g = self._gaps(s, ends, u)
        # gaps change by no more than the way
        near = np.flatnonzero(np.isfinite(g).all(axis=1) & (g.min(axis=1) < length))
        if not len(near):
            return None
        sunk = np.maximum(-g[near].min(axis=1), 0.0) / length[near]
        # A narrow tool is nowhere deeper than half its width: it is looked for behind the piece, not for its depth in it.
        into = -(NOTABLE_DEPTH + sunk)[:, None] * outward(ends[near])
        gaps = self._gaps(s, self.N @ ends[near] + into[:, None], u).min(axis=1)
        k = int(np.argmin(gaps))
        return Dip(pieces[near[k]], float(length[near[k]])) if gaps[k] < 0.0 else None


def _off(share: float | None, pushed: bool, most: str = "") -> str:
    """By how much, or by how much at ``most``, forces are off, of which a share is missing, negative of too large ones; of a tool
    that is pushed, its way.
    """
    large = share is not None and share < 0.0
    way, force = ("not deep enough", "too large") if large else ("too deep", "too small")
    what = f"it goes {way}" if pushed else f"forces are {force}"
    return what if share is None or share >= 1.0 else f"{what}, by {most}an estimated {100.0 * abs(share):.0f} %"


def _curved(s: Surface) -> bool:
    """Whether a surface has faces of six nodes, whose points are in the middle of their sides."""
    return isinstance(s.points, FacePoints) and s.points.faces.shape[1] == 6


def _pieces(s: Surface) -> Index:
    """Straight edges (m, 2) or faces (m, 4) of a contact surface."""
    return s.points.faces if isinstance(s.points, FacePoints) else segments(s.points.edges)


def _by_nodes(s: Surface) -> bool:
    """Whether points are nodes of straight pieces: chords of quadratic edges are not where these lie."""
    p = s.points
    return isinstance(p, FacePoints) or (p.are_nodes and bool((p.shares.factor == 0.5).all()))
