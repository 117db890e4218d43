"""The discretised problem and its residual: a pure function of its arguments."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol, Unpack

import numpy as np

from prensa.contact.cut import PIERCED, Cut, corners_of, cut, cuts_of
from prensa.contact.forces import ContactForces, Scale
from prensa.contact.masters import Committed, Master, RigidMaster, Seen, SideMaster
from prensa.contact.pairing import rotation, rotation_vector
from prensa.contact.record import ContactRecord
from prensa.contact.recovery import recover
from prensa.contact.redundant import Supports
from prensa.contact.stencil import Stencils
from prensa.contact.surface import Follows, Surface
from prensa.friction.law import At as FrictionAt
from prensa.friction.law import FrictionLaw
from prensa.layout import DofMap
from prensa.materials.laws import At
from prensa.mesh.mesh import Mesh, segments
from prensa.model import problem as model
from prensa.model.interference import interfering
from prensa.model.seconds import elapsed
from prensa.precision import EPS
from prensa.system.assembly import Block, Pattern, scatter_matrix, scatter_vector, slots, sweep
from prensa.system.bodies import Bodies
from prensa.system.contact_interaction import ContactInteraction
from prensa.system.damage import undamaged
from prensa.system.failure import ElementFailed, NotEvaluated
from prensa.system.interaction import ActiveSets, Context, Interaction, Overrides, Part, Request
from prensa.system.interference import at_time
from prensa.system.loads import loads_of
from prensa.system.schedule import StepPlan
from prensa.system.self_equilibrated import self_equilibrated_forces
from prensa.system.state import Clock, Energy, Recovered, State
from prensa.system.ties import Ties
from prensa.system.time_integration import BACKWARD_EULER, TimeRule
from prensa.tools.place import PlacedTool
from prensa.types import Array, Flags, Index, Ints, Single

log = logging.getLogger("prensa")


FORCE_ROUND_OFF = 0.25  # share of ε M size, per node, that the forces of a body at rest miss: all the strain there is then
NOTHING = 1e-8  # strains, and shares of forces, below which there is no force to compare with, and none to release
AT_ONCE = 1 << 14  # elements whose energies are found together: temporaries of all would be a tenth of what a run takes


class Evaluation(NamedTuple):
    """r (ndof,) residual; data (nnz,) its derivative or None; ``scale``: Σ |element forces| + |contact| + |external|.

    history, contacts: trial values to commit; f_ext (ndof,); ``failed``: why it could not be evaluated, or None;
    ``floor``: residual that round-off alone makes: positions carry ε × size, which moduli and penalties multiply;
    ``violation``: of the exact contacts, the largest penetration, elastic slip or multiplier of an open point (as the
    length it is divided to), over the element depth, beyond what round-off makes.
    """

    r: Array
    data: Array | None
    scale: float
    history: Sequence[Array]
    contacts: tuple[ContactForces, ...]
    f_ext: Array
    failed: NotEvaluated | None
    floor: float = 0.0
    violation: float = 0.0
    volumetric: Sequence[Single | None] = ()

    def contact_forces(self) -> Array:
        """Forces (ndof,) of the contacts on all degrees of freedom: a master's are those at its own."""
        out = np.zeros(len(self.r))
        for f in self.contacts:
            scatter_vector(f.F, f.stencils.dofs, out)
        return out

    @property
    def resting(self) -> Flags:
        """Contact points (all,) that are closed, or open by no more than round-off."""
        return np.concatenate([np.zeros(0, dtype=bool), *(f.rests for f in self.contacts)])

    @property
    def touching(self) -> Flags:
        """Contact points (all,) that resist: closed, or just in touch."""
        return np.concatenate([np.zeros(0, dtype=bool), *(f.dp[:, 0] > 0 for f in self.contacts)])


class Bulk(NamedTuple):
    """What the bodies' share of an evaluation is besides forces and stiffness; fields as in `Evaluation`."""

    scale: float
    floor: float
    history: Sequence[Array]
    failed: NotEvaluated | None = None
    volumetric: Sequence[Single | None] = ()


class BodyForces(Protocol):
    """What stands in for the elements of a system: their forces by other means."""

    def bulk(self, c: Context, u: Array, r: Array, data: Array | None) -> Bulk:
        """As `System.bulk`."""


@dataclass(eq=False)  # each is one of its own, and arrays have no single answer to whether they are equal
class System(Bodies):
    """The discretised problem.

    ``gone``: whether its tools are, and ``removed`` the contacts that they had; their rows in the state stay. ``first``: the
    system on the meshes of the description, where this one is on others. ``mirrors``: how many of its tools, the last ones, stand
    for planes of symmetry. ``chosen``: why bodies have the element that was chosen for them, where the description names none.
    """

    problem: model.Problem
    meshes: dict[str, Mesh]
    offsets: dict[str, int]
    X: Array
    blocks: list[Block]
    tools: list[PlacedTool]
    surfaces: list[Surface]
    pattern: Pattern
    dofs: DofMap
    ties: Ties | None = None
    beginning: State | None = None
    bodies: BodyForces | None = None
    more: Sequence[Interaction] = ()
    gone: bool = False
    removed: Sequence[Surface] = ()
    first: System | None = None
    mirrors: int = 0
    chosen: dict[str, str] = field(default_factory=dict)
    _places: dict[str, Ints] = field(default_factory=dict)
    _volumes: dict[str, Array] = field(default_factory=dict)

    # ------------------------------------------------------------------------------------------------------ indices
    @cached_property
    def ndof(self) -> int:
        """Degrees of freedom."""
        return self.pattern.n

    @property
    def nodes(self) -> int:
        """Nodes of all bodies."""
        return self.dofs.displacement.count

    def tool_dof(self, t: int) -> int:
        """First degree of freedom of tool number t."""
        return int(self.dofs.tool.dofs(t)[0])

    @cached_property
    def masters(self) -> dict[str, Master]:
        """What contacts lie against, by name."""
        sides: dict[str, Master] = {}
        for s in self.surfaces:
            if s.opposite is not None:
                moving = np.unique(s.dofs[:, s.of_master])
                sides[s.against] = SideMaster(s.against, moving, self.problem.thickness)
        return {**self.tool_masters, **sides}

    @cached_property
    def tool_masters(self) -> dict[str, RigidMaster]:
        """Those of them that are rigid tools."""
        dofs = self.dofs
        return {tool.name: RigidMaster(tool, t, dofs.tool.dofs(t), dofs.orientation(t)) for t, tool in enumerate(self.tools)}

    @cached_property
    def tool_contacts(self) -> list[Surface]:
        """The contacts with tools, which come first among all."""
        return [s for s in self.surfaces if s.opposite is None]

    def against(self, master: str) -> list[Surface]:
        """The contacts that have a master."""
        return [s for s in self.surfaces if s.against == master]

    def place_of(self, t: int, u: Array) -> Array:
        """Displacement and rotation of tool number t."""
        return u[self.dofs.tool.places[t]]

    def orientation_of(self, t: int, u: Array) -> Array:
        """Rotation vector (3,) of tool number t in space, of those a turn apart the one near its rotations; (0,) in the plane."""
        if self.dofs.dimension == 2:
            return np.zeros(0)
        own, turns = self.dofs.orientation(t), self.dofs.tool.dofs(t)[3:]
        return rotation_vector(rotation(u[np.append(turns, own)]), u[turns])

    def step_begun(self, u: Array) -> Array:
        """Degrees of freedom (ndof,) with the rotations of tools in space counted from where they are, as at a step's start."""
        if self.dofs.dimension == 2 or not self.tools:
            return u
        u = u.copy()
        for t in range(len(self.tools)):
            own, turns = self.dofs.orientation(t), self.dofs.tool.dofs(t)[3:]
            u[own] = np.append(u[turns], rotation_vector(rotation(u[np.append(turns, own)]), np.zeros(3)))
        return u

    def way(self, before: Array, after: Array) -> Array:
        """Change (ndof,) of degrees of freedom on which forces do work: the rotations of tools are those about axes in space."""
        out = after - before
        for t in range(len(self.tools) if self.dofs.dimension == 3 else 0):
            turns = self.dofs.tool.dofs(t)[3:]
            own = np.append(turns, self.dofs.orientation(t))
            if out[turns].any():
                out[turns] = rotation_vector(rotation(after[own]) @ rotation(before[own]).T, out[turns])
        return out

    def displacement(self, u: Array) -> Array:
        """Displacements (n, d) of the nodes, a view."""
        return u[self.dofs.displacement.slice].reshape(self.X.shape)

    @property
    def displaced(self) -> Array:
        """Displacements (n, d) of the nodes when the first step begins: none, or those in which an earlier run ended."""
        return super().displaced if self.beginning is None else self.displacement(self.beginning.u)

    @cached_property
    def outlines(self) -> dict[str, Index]:
        """Straight pieces (k, 2) of the outline of each body in the plane, by its own nodes."""
        return {body: segments(mesh.boundary) for body, mesh in self.meshes.items()}

    def of_elements(self, blocks: list[Block]) -> System:
        """The same system of some of its elements alone; its length and scale of forces stay, which take all nodes to find."""
        out = replace(self, blocks=blocks)
        vars(out).update(length=self.length, stiffness=self.stiffness)
        return out

    def without_tools(self) -> System:
        """The same bodies when all tools are gone."""
        return replace(self, surfaces=[], removed=self.surfaces, gone=True)

    @cached_property
    def exact(self) -> bool:
        """Whether the multipliers of some contact are degrees of freedom."""
        return any(s.exact for s in self.surfaces)

    @cached_property
    def _contacts(self) -> list[ContactInteraction]:
        return [ContactInteraction(self, s, i) for i, s in enumerate(self.surfaces)]

    def multipliers(self, u: Array, lam: Array) -> Array:
        """λ_n, λ_T (points, 2) of all contact points: of exact contacts from the dofs u (ndof,), else those of lam."""
        if not self.exact:
            return lam
        out = lam.copy()
        for s in self.surfaces:
            if s.multipliers is not None:
                out[s.rows] = s.multipliers.of(u) * s.unit[:, None]
        return out

    def initial_multipliers(self, state: State) -> Array:
        """λ_n, λ_T (points, 2) with which an increment from a committed state starts."""
        lam = state.lam.copy()
        for s in self.surfaces:
            lam[s.rows] = s.description.enforcement.initial_multipliers(lam[s.rows])
        return lam

    def contact_energy(self, contacts: Sequence[ContactForces], scales: Sequence[Scale]) -> float:
        """Energy stored in the springs of the contacts."""
        return float(sum(s.description.enforcement.stored(f, sc) for s, f, sc in zip(self.surfaces, contacts, scales)))

    def supported(self, nodes: Index, plan: StepPlan) -> Flags:
        """Whether nodes (k,) are held along x or y in a step."""
        held = np.zeros(self.ndof, dtype=bool)
        held[plan.fixed] = True
        return np.asarray(held[self.dofs.displacement.dofs(nodes)].any(axis=-1))

    def supports(self, surfaces: Sequence[Surface], fixed: Index) -> list[Supports | None]:
        """What supports leave of the points of exact contacts, with ``fixed`` dofs prescribed; see `Surface.supports`."""
        follows, prescribed = None, self.prescribed(fixed)
        if self.exact and self.ties is not None and self.dofs.dimension == 3:
            follows = Follows(self.ties.kept(self.ndof, fixed), self.ties.free(self.ndof, fixed))
        return [s.supports(prescribed, follows) for s in surfaces]

    def with_slaves(self, u: Array) -> Array:
        """Unknowns (ndof,) with tied nodes put where their masters take them."""
        return u if self.ties is None else self.ties.with_slaves(u)

    def prescribed(self, fixed: Index) -> Index:
        """The ``fixed`` unknowns, and those of tied nodes that follow nothing else."""
        return fixed if self.ties is None else self.ties.prescribed(fixed)

    def to_masters(self, r: Array) -> Array:
        """Forces (ndof,) with those on tied nodes handed over to their masters."""
        return r if self.ties is None else self.ties.to_masters(r)

    def positions(self, u: Array) -> Array:
        """Node positions (n, 2) for degrees of freedom u (ndof,)."""
        return self.X + self.displacement(u)

    @cached_property
    def depth(self) -> Array | None:
        """Initial thickness at the nodes (n,); None in axisymmetry."""
        return None if self.axisymmetric else np.full(self.nodes, self.problem.thickness)

    def depth_in(self, history: Sequence[Array]) -> Array | None:
        """Thickness (n,) at the nodes with a committed history, recovered from the points in plane stress; `depth` else."""
        if self.problem.space != "plane stress":
            return self.depth
        out = np.empty(self.nodes)
        for b, h in zip(self.blocks, history):
            first, last = int(b.cells.min()), int(b.cells.max()) + 1
            ratio = b.law.thickness(b.at_law(h))
            assert ratio is not None
            at = self.X[first:last], b.cells - first, b.positions(self.X)
            nodal = recover(*at, ratio[..., None], by_sides=True)[:, 0]
            # a patch may overshoot at a corner, no point's thickness is outside what the points have
            out[first:last] = self.problem.thickness * np.clip(nodal, ratio.min(), ratio.max())
        return out

    def weights(self, s: Surface, x: Array, depth: Array | None) -> Array:
        """Areas (k,) of the contact points on node positions x (n, 2) with the nodes' thickness (n,)."""
        return s.points.weights(x) * s.points.at(self.share(depth))

    def touching(self, s: Surface, x: Array, depth: Array | None, closed: Flags) -> Array:
        """Areas of the closed points, without what they have of edges that leave the tool at a corner of the body."""
        weight = self.weights(s, x, depth)
        if self.dofs.dimension == 2:
            weight = weight - s.points.beyond_corners(x, closed) * s.points.at(self.share(depth))
        return np.asarray(weight[closed])

    def tributary(self, s: Surface, x: Array, depth: Array | None) -> Array:
        """∫N_A dΓ (n,) of the surface's nodes on node positions x with the nodes' thickness."""
        return s.points.tributary(x) * self.share(depth)[s.points.nodes]

    def share(self, depth: Array | None) -> Array:
        """Thickness of the nodes over the initial one (n,); 1 but in plane stress."""
        if depth is None or self.problem.space != "plane stress":
            return np.ones(self.nodes)
        return depth / self.problem.thickness

    # -------------------------------------------------------------------------------------------------------- state
    def initial(self) -> State:
        """The state at time 0: undeformed, or where an earlier run ended."""
        return self.beginning or self.undeformed()

    def being_released(self, state: State, plan: StepPlan) -> Array:
        """Forces (ndof,) in a committed state that its step releases."""
        out = np.zeros(self.ndof) if state.release is None else state.release.copy()
        if state.self_equilibrated is not None:
            out += self_equilibrated_forces(self, state.u, state.self_equilibrated)
        return plan.left(state.clock.time) * out

    @property
    def release(self) -> Array | None:
        """Forces (ndof,) of an earlier run that the first step releases, or None."""
        return None if self.beginning is None else self.beginning.release

    def undeformed(self) -> State:
        """The undeformed state."""
        n_points = sum(len(s.points) for s in self.surfaces)
        u = np.zeros(self.ndof)
        t = self.dofs.dimension - 1
        contact = ContactRecord.initial(n_points, t)
        for s, coordinates in zip(self.surfaces, self._touched_at_first):
            contact.coordinate[s.rows] = coordinates
        return State(
            u=u, du=np.zeros(self.ndof), dt_last=0.0, second_difference=np.zeros(self.ndof),
            history=self.initial_history,
            contact=contact, lam=np.zeros((n_points, 1 + t)), energy=Energy(), work=np.zeros(self.ndof),
            clock=Clock(), step_start=u.copy(), tool_work=np.zeros(len(self.tools)),
            tool_wear=np.zeros(len(self.tools)), damage=undamaged(self.problem, self.blocks),
        )  # fmt: skip

    @cached_property
    def _touched_at_first(self) -> list[Array]:
        """Coordinates (k, t) on their masters of the points of each contact, undeformed: a search, which many ask for."""
        return [self.stencils(s, np.zeros(self.ndof)).s for s in self.surfaces]

    def context(self, state: State, plan: StepPlan, time: float, rule: TimeRule = BACKWARD_EULER) -> Context:
        """Everything an increment from *state* to *time* needs, with plastic flow by a ``rule``; evaluated once an increment."""
        finite = self.problem.kinematics == "finite"
        x_n = self.positions(state.u) if finite else self.X
        depth = self.depth_in(state.history) if finite else self.depth
        surfaces = self._cut(state, plan, time)
        weights = [self.weights(s, x_n, depth) for s in surfaces]
        committed = [self._committed(s, state) for s in surfaces]
        dt = time - state.clock.time
        seconds = dt * plan.seconds
        history = [rule.begun(b, h) for b, h in zip(self.blocks, state.history)] if self.has_memory else state.history
        now = elapsed(self.problem, time, state.ends)
        laws = [None if self.frictionless(d) else d for d in plan.friction]
        law_at, scales = [], []
        for s, law in zip(self.surfaces, laws):
            k = self.shear_strength(s, state) if law is not None and law.asks_for_k else None
            law_at.append(FrictionAt(k, seconds, now, state.contact.speed[s.rows]))
            least = np.zeros(len(s.X))
            if law is not None and law.hardens:
                # a softening law needs k_T > |∂τ_y/∂κ| for a unique root: take twice that at the committed pressures
                least = 2.0 * law.softening(state.lam[s.rows, 0], state.contact.slip[s.rows], law_at[-1])
            scales.append(s.scale(least))
        interactions = [*self._contacts, *self.more, *loads_of(self, plan, state)]
        return Context(
            state, plan, time, dt, seconds, now, weights, scales, laws, law_at, x_n, depth, surfaces, committed,
            self.supports(surfaces, plan.fixed), history, rule, interactions,
        )  # fmt: skip

    def through_air(self, c: Context, way: Array | None) -> Context:
        """An increment of whose motion nothing resists ``way`` (ndof,): what was open slips from where that brings it."""
        if way is None:
            return c
        u = c.state.u + way
        committed = [
            record if self.frictionless(law) else replace(
                record, coordinate=np.where(record.closed[:, None], record.coordinate, self.stencils(s, u, c.state).s)
            )
            for s, record, law in zip(c.surfaces, c.committed, c.plan.friction)
        ]  # fmt: skip
        return replace(c, through_air=way, committed=committed)

    def _cut(self, state: State, plan: StepPlan, time: float) -> list[Surface]:
        """The contacts, edges of committed bodies cut where sharp corners are: at *time* as far as that is prescribed."""
        surfaces = self.surfaces_at(time)
        if not any(s.sharp for s in surfaces):
            return surfaces
        ahead = state.u.copy()
        ahead[plan.fixed] = plan.values(time)
        held = self.problem.contact_geometry == "current" and model.stabilised(self.problem, plan.number) != "off"
        hold = [held and not self.frictionless(law) for law in plan.friction]
        return [self._cut_by(s, state.u, ahead, flanks) for s, flanks in zip(surfaces, hold)]

    def surfaces_at(self, time: float) -> list[Surface]:
        """The contacts with what overlaps that are meant add to their gaps at a time."""
        if not self.interferes:
            return self.surfaces
        return at_time(self.problem, self.surfaces, time, self.nodes, lambda s: self.nodes_seen(s, np.zeros(self.ndof)).g)

    def _cut_by(self, s: Surface, u: Array, ahead: Array, flanks: bool) -> Surface:
        """A contact with its edges, of bodies at degrees of freedom u (ndof,), cut by its tool where it is in ``ahead`` (ndof,).

        ``flanks``: whether corners hold edges that go up a flank: where friction acts on moved surfaces, without which no node
        hangs on a flank, and viscous forces carry bodies on when one comes free.

        Where a corner has sunk into its edge between the nodes, the point that a cut makes would lie deep in the tool, and
        its force be there at once: such edges stay whole.
        """
        cuts = self.cuts(s, u, self.tool_masters[s.against].place(ahead), flanks) if s.sharp else []
        while cuts:
            points = cut(s.points, self.positions(u) if self.problem.kinematics == "finite" else self.X, cuts)
            corners = corners_of(points, self.tool_masters[s.against].shape, cuts)
            out = replace(s, points=points, X=points.at(self.X), corners=corners)
            gap = self.stencils(out, ahead).g
            if corners is not None:  # what they hold they take along: only where they lie now may they be too deep
                gap[corners.rows] = self.stencils(out, u).g[corners.rows]
            sunk = gap < -PIERCED * points.depth
            whole = [c for c in cuts if not sunk[s.points.nodes == s.points.edges[c.edge, c.end]].any()]
            if len(whole) == len(cuts):
                return out
            cuts = whole
        return s

    def cuts(self, s: Surface, u: Array, place: Array, flanks: bool = False) -> list[Cut]:
        """Where sharp corners of a contact's tool at a place (3,) lie over its edges, of bodies at degrees of freedom u."""
        x = self.positions(u) if self.problem.contact_geometry == "current" else self.X
        master = self.tool_masters[s.against]
        return cuts_of(master.shape, master.at, place, x, s.points.edges, 100.0 * self.length, flanks)

    def _committed(self, s: Surface, state: State) -> ContactRecord:
        """What is committed of the points of a contact, at the places that these have in the next increment."""
        record = state.contact.of(s.rows)
        if not s.sharp or self.problem.contact_geometry == "reference":
            return record
        return replace(record, coordinate=self.stencils(s, state.u, state).s)

    # ----------------------------------------------------------------------------------------------------- residual
    def stencils(self, s: Surface, u: Array, since: State | None = None) -> Stencils:
        """Stencils of a contact at its integration points, for degrees of freedom u.

        since: the committed state from which slip goes on, where its master has a memory of that; the undeformed one if None.
        """
        before = None if since is None else Committed(since.contact.coordinate[s.rows], since.u)
        return self.masters[s.against].stencils(s, self, u, before)

    def nodes_seen(self, s: Surface, u: Array) -> Seen:
        """Gaps and normals at the nodes of a contact's surface, whatever the rule."""
        return self.masters[s.against].nodes_seen(s, self, u)

    @cached_property
    def interferes(self) -> bool:
        """Whether an overlap of contacts or ties is meant."""
        return interfering(self.problem)

    @cached_property
    def on_undeformed(self) -> bool:
        """Whether contact is that of the undeformed surface."""
        return self.problem.contact_geometry == "reference"

    @cached_property
    def reach(self) -> float:
        """How far masters are looked for along its normals."""
        return 100.0 * self.length

    def evaluate(
        self, c: Context, u: Array, lam: Array, stiffness: bool = True, **overrides: Unpack[Overrides]
    ) -> Evaluation:  # fmt: skip
        """Residual r = f_int − f_contact − f_ext of dofs u (ndof,) and multipliers lam (points, 2), and its derivative.

        Contacts whose multipliers are degrees of freedom have them in u and their equations in r; lam is not used there.
        ``overrides``: see `Request`. Pure: it answers the same for the same arguments.
        """
        r, f_ext = np.zeros((2, self.ndof))
        data = np.zeros(self.pattern.entries) if stiffness else None
        active_sets = overrides.get("active_sets")
        bulk = self.bulk(c, u, r, data, None if active_sets is None else active_sets.flows, overrides.get("secant", 0.0))
        if bulk.failed:
            return Evaluation(r, data, np.inf, (), (), r, bulk.failed)
        scale, floor, violation, loaded = NOTHING * self.stiffness + bulk.scale, bulk.floor, 0.0, False
        ask, trials = self._asked(u, lam, stiffness, overrides), []
        for interaction in c.interactions:
            out = interaction.respond(c, ask)
            if out.failed:
                return Evaluation(r, data, np.inf, (), (), r, out.failed)
            for part in out.parts:
                self._scatter(part, f_ext if out.external else r, data)
            scale, floor, violation = scale + out.scale, floor + out.floor, max(violation, out.violation)
            loaded = loaded or out.external
            if out.trial is not None:
                trials.append(out.trial)
        if loaded:
            scale += float(np.abs(f_ext[self.dofs.displacement.slice]).sum())
            r = r - f_ext
        return Evaluation(r, data, scale, bulk.history, tuple(trials), f_ext, None, floor, violation, bulk.volumetric)

    def apply(self, data: Array, delta: Array) -> Array:
        """K δ (ndof,) for the matrix values of an evaluation."""
        from scipy.sparse import csc_matrix

        if not delta.any():  # tools alone move
            return np.zeros(len(delta))
        matrix = csc_matrix((data, self.pattern.indices, self.pattern.indptr), (self.ndof, self.ndof))
        return np.asarray(matrix @ delta)

    def _asked(self, u: Array, lam: Array, stiffness: bool, overrides: Overrides) -> Request:
        """What interactions are asked for at degrees of freedom u (ndof,); loads and springs do not ask how far these reach."""
        if not (self.exact or self.more):
            return Request(u, lam, stiffness, **overrides)
        ways = self.dofs.tool.of(u)[:, : self.dofs.dimension]  # turns are no lengths
        reach = self.length + float(np.abs(ways).max(initial=0.0))
        return Request(u, self.multipliers(u, lam), stiffness, reach=reach, **overrides)

    def _scatter(self, part: Part, vector: Array, data: Array | None) -> None:
        """Add the part of an interaction to a vector (ndof,) and to the matrix values (nnz,)."""
        if part.r is not None:
            scatter_vector(part.r, part.dofs, vector)
        if part.K is not None and data is not None:
            scatter_matrix(part.K, self.places(part.key, part.dofs), data)

    def active_sets(self, c: Context, e: Evaluation) -> ActiveSets:
        """The sides of their kinks on which the points are in an evaluation."""
        flows = []
        for block, new, old in zip(self.blocks, e.history, c.history):
            strains = (block.field(h, "plastic_strain") for h in (new, old)) if block.law.plastic else None
            flows.append(None if strains is None else np.not_equal(*strains).ravel())
        return ActiveSets(tuple(f.active_sets for f in e.contacts), tuple(flows))

    def bulk(
        self, c: Context, u: Array, r: Array, data: Array | None, flows: Sequence[Flags | None] | None = None,
        secant: float = 0.0,
    ) -> Bulk:  # fmt: skip
        """Add the internal forces of the bodies to r (ndof,) and, unless it is None, their stiffness to data (nnz,).

        flows: which points (m q,) of each block flow plastically, whatever the trial stress; None: that decides.
        secant: see `Request`.
        """
        if self.bodies is not None:
            return self.bodies.bulk(c, u, r, data)
        # linear elastic bodies in small strain answer to the total displacement: nothing accumulates
        total = self.problem.kinematics == "small" and not self.has_memory
        du = self.displacement(u if total else u - c.state.u)
        base = self.initial_history if total else c.history
        history, volumetric, scale, floor = [], list[Single | None](), 0.0, self.round_off
        begun = c.rule.share > 0.0
        for block, old, held in zip(self.blocks, base, flows or [None] * len(self.blocks)):
            here = At(c.rule.seconds(block, c.seconds), c.now, data is not None, secant, held, begun)
            out = sweep(block, c.x_n, du, old, here, r, data, self.pattern, c.threads, c.preconditioned)
            if out.failed:
                x, y, *z = self.X[block.cells[out.failed.element]].mean(axis=0).tolist()
                return Bulk(scale, floor, (), ElementFailed(out.failed.element, block.body, x, y, out.failed.why, *z))
            history.append(out.history)
            volumetric.append(out.volumetric)
            scale += out.force_scale
        return Bulk(scale, floor, tuple(history), volumetric=tuple(volumetric))

    @cached_property
    def stiffness(self) -> float:
        """A force: modulus × size × thickness (or circumference), the scale of forces at strains of order one."""
        depth = 2 * np.pi * self.length if self.axisymmetric else self.problem.thickness
        if self.dofs.dimension == 3:
            depth = self.length
        return max(b.law.modulus() for b in self.blocks) * self.length * depth

    @cached_property
    def round_off(self) -> float:
        """Force that round-off alone makes of the bodies."""
        # Round-off of strains is one of volume too, which nearly incompressible bodies resist most.
        confined = max(b.law.confined_modulus() / b.law.modulus() for b in self.blocks)
        return FORCE_ROUND_OFF * EPS * self.stiffness * confined * self.nodes

    @cached_property
    def has_memory(self) -> bool:
        """Whether some material remembers more than its present strain."""
        return any(b.law.plastic for b in self.blocks)

    @cached_property
    def initial_history(self) -> tuple[Array, ...]:
        """Histories of the undeformed bodies."""
        return tuple(b.undeformed for b in self.blocks)

    def external(self, c: Context, u: Array) -> Array:
        """External forces (ndof,) at the end of an increment."""
        f = np.zeros(self.ndof)
        ask = Request(u, c.state.lam, stiffness=False)
        for interaction in c.interactions:
            if not isinstance(interaction, ContactInteraction):
                for part in interaction.respond(c, ask).parts:
                    self._scatter(part, f, None)
        return f

    def places(self, key: str, dofs: Index) -> Ints:
        """Places (k, m, m) in the matrix values of sets of degrees of freedom (k, m), looked up once a key."""
        if key not in self._places:
            out = np.empty((*dofs.shape, dofs.shape[1]), dtype=np.int32)
            slots(self.pattern.indptr, self.pattern.indices, np.ascontiguousarray(dofs), out)
            self._places[key] = out
        return self._places[key]

    def pair_slots(self, s: Surface) -> Ints:
        """Places (k, m, m) of the `Surface.coupled` degrees of freedom of the pairs in the matrix values."""
        return self.places(s.name, s.coupled)

    def node_volumes(self, body: str) -> Array:
        """∫N_A dV (n,) of the nodes of a body, in the initial configuration."""
        if body not in self._volumes:
            block = next(b for b in self.blocks if b.body == body)
            out = np.zeros(len(self.meshes[body].points))
            np.add.at(out, block.cells - self.offsets[body], block.volume @ block.element.N)
            self._volumes[body] = out
        return self._volumes[body]

    @staticmethod
    def frictionless(description: FrictionLaw | None) -> bool:
        """Whether a friction description says that there is none."""
        return description is None or bool(description.frictionless)

    def shear_strength(self, s: Surface, state: State) -> Array:
        """Shear yield stress (points,) in a committed state: the mean over the integration points of the elements behind."""
        number = next(i for i, b in enumerate(self.blocks) if b.body == s.body)
        history = state.history[number][s.behind]
        law: Any = self.blocks[number].law
        k = law.shear_strength(history.reshape(-1, history.shape[-1]))
        return self.at_points(s, k.reshape(len(s.behind), -1).mean(axis=1))

    @staticmethod
    def at_points(s: Surface, values: Array) -> Array:
        """Values (edges, …) of the elements behind → (points, …): the mean over the edges of which a point has a share."""
        points, edges = s.points.beside
        out = np.zeros((len(s.points), *values.shape[1:]))
        np.add.at(out, points, values[edges])
        return out / np.bincount(points).reshape(-1, *[1] * (values.ndim - 1))

    @staticmethod
    def to_edges(s: Surface, weights: Array) -> Array:
        """The transpose of `at_points`: weights (m, points) → (m, edges)."""
        points, edges = s.points.beside
        out = np.zeros((len(weights), len(s.behind)))
        for row, w in zip(out, weights / np.bincount(points)):
            np.add.at(row, edges, w[points])
        return out

    def elastic_energy(self, history: Sequence[Array]) -> float:
        """∫ψ dV of a committed history, from the laws' energy functions; of one not computed yet as it was found."""
        if isinstance(history, Recovered):
            return history.energy
        energy = 0.0
        for b, h in zip(self.blocks, history):
            for first in range(0, len(b), AT_ONCE):
                rows = slice(first, first + AT_ONCE)
                energy += float(np.vdot(b.volume[rows], b.law.energy(b.at_law(h[rows]))))
        return energy

    def plastic_work(self, history: Sequence[Array]) -> float:
        """Accumulated plastic dissipation of a committed history."""
        if not self.has_memory:
            return 0.0
        plastic = [(b, b.field(h, "plastic_work")) for b, h in zip(self.blocks, history) if b.law.plastic]
        return float(sum(np.vdot(b.volume, work) for b, work in plastic))
