"""From the description to arrays, and the residual: a pure function of its arguments."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import ContactForces, Scale, forces, multiplier_rows, stretching
from prensa.contact.integration import Points, behind, depth_of, node_normals, point_normals, points_of
from prensa.contact.pairing import Pairs, current_pairs, reference_pairs
from prensa.contact.recovery import recover
from prensa.errors import PrensaError
from prensa.fem import loads as fem_loads
from prensa.fem.assembly import Block, Pattern, block_slots, make_pattern, scatter_matrix, scatter_vector, slots, sweep
from prensa.fem.formulation import Mode, element_of
from prensa.fem.schedule import StepPlan
from prensa.fem.state import Recovered, State
from prensa.fem.ties import Ties, held_components, make_ties
from prensa.friction.law import At as FrictionAt
from prensa.friction.law import FrictionLaw
from prensa.materials.laws import At, material_of
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import Mesh, MeshError, ordered_nodes
from prensa.model import problem as model
from prensa.tools.analytic import Circle
from prensa.tools.place import PlacedTool, ToolError, place

log = logging.getLogger("prensa")
Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Surface:
    """One contact: candidate points against a tool. ``first`` is the row of its first point in the state's arrays.

    ``X`` (k, 2) initial positions of the points, ``dofs`` (k, 2a + 3) unknowns of their pairs: x, y of each supporting
    node, tool x, y, rz; ``normal`` (k, 2) of the undeformed surface at the points, ``node_normal`` (n, 2) at its nodes;
    ``behind`` (m,): elements of the body behind the edges.
    ``multipliers``: number of its first multiplier unknown, two a point (normal, tangential); −1 if it has none.
    """

    name: str
    description: model.Contact
    body: str
    tool: int
    points: Points
    first: int
    X: Array
    dofs: Index
    normal: Array
    node_normal: Array
    modulus: float
    behind: Index
    multipliers: int = -1

    @property
    def exact(self) -> bool:
        """Whether its multipliers are unknowns."""
        return self.multipliers >= 0

    @property
    def unknowns(self) -> slice:
        """Places of its multipliers in the vector of unknowns."""
        return slice(self.multipliers, self.multipliers + 2 * len(self.points))

    @property
    def rows(self) -> slice:
        """Rows of this contact in `State.contact` and `State.lam`."""
        return slice(self.first, self.first + len(self.points))

    @property
    def coupled(self) -> Index:
        """Unknowns of the pairs (k, 2a + 3), followed by the two multipliers where these are unknowns (k, 2a + 5)."""
        if not self.exact:
            return self.dofs
        return np.hstack([self.dofs, np.arange(self.unknowns.start, self.unknowns.stop).reshape(-1, 2)])

    def scale(self, k_t_least: Array) -> Scale:
        """Penalty stiffnesses of the points: k_n = β E*/h, k_T = β_T E*/h, not below ``k_t_least`` (k,)."""
        h = self.points.depth
        unit = self.modulus / h
        k_n, k_t = self.description.enforcement.stiffness(unit)
        return Scale(k_n, np.maximum(k_t, k_t_least), h, unit)


ROUNDING = 0.25  # fillet over element depth of corners that are not given one: a sharp one has no normal to slide on
EPS = float(np.finfo(np.float64).eps)
ROUND_OFF = 0.25  # share of ε E* size, per node, that the forces of a body at rest miss: all the strain there is then
ROUND = 1.0  # round-off of a gap or slip over ε × size
NOTHING = 1e-8  # forces of strains below this need no relative accuracy: an unloaded body has no force to compare with


class Evaluation(NamedTuple):
    """r (ndof,) residual; data (nnz,) its derivative or None; ``scale``: Σ |element forces| + |contact| + |external|.

    history, contacts: trial values to commit; f_ext (ndof,); ``failed``: why it could not be evaluated, or '';
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
    failed: str
    floor: float = 0.0
    violation: float = 0.0

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Contact points (all,) that resist: closed, or just in touch."""
        return np.concatenate([np.zeros(0, dtype=bool), *(f.dp[:, 0] > 0 for f in self.contacts)])


class Bulk(NamedTuple):
    """What the bodies' share of an evaluation is besides forces and stiffness; fields as in `Evaluation`."""

    scale: float
    floor: float
    history: Sequence[Array]
    failed: str = ""


@dataclass
class Circumstances:
    """What an evaluation depends on besides the unknowns: committed state, plan of the step, time, and derived arrays.

    Fixed during an increment: ``weights`` and ``scales`` of the contacts on the committed configuration, laws; ``depth``
    (n,) thickness at the nodes at the last commit, None in axisymmetry; ``lagged``: the contact stiffness is the paper's
    symmetric one (see `forces`).
    """

    state: State
    plan: StepPlan
    time: float
    dt: float
    weights: list[Array]
    scales: list[Scale]
    laws: list[FrictionLaw | None]
    law_at: list[FrictionAt]
    x_n: Array
    depth: Array | None
    lagged: bool = False


@dataclass
class System:
    """The discretised problem."""

    problem: model.Problem
    meshes: dict[str, Mesh]
    offsets: dict[str, int]
    X: Array
    blocks: list[Block]
    tools: list[PlacedTool]
    surfaces: list[Surface]
    pattern: Pattern
    nodes: int
    ties: Ties | None = None
    beginning: State | None = None
    release: Array | None = None
    _edge_slots: dict[str, Any] = field(default_factory=dict)

    # ------------------------------------------------------------------------------------------------------ indices
    @property
    def ndof(self) -> int:
        """Unknowns: two per node, three per tool, two per point of contacts with exact enforcement."""
        return self.pattern.n

    def tool_dof(self, t: int) -> int:
        """First unknown of tool number t."""
        return 2 * self.nodes + 3 * t

    @property
    def axisymmetric(self) -> bool:
        """Whether x is a radius."""
        return self.problem.space == "axisymmetric"

    @cached_property
    def length(self) -> float:
        """Size of the bodies, the length by which moments are divided."""
        return float(np.ptp(self.X, axis=0).max())

    def boundary_nodes(self, name: str) -> Index:
        """Global nodes of 'body.boundary' (or 'body.point')."""
        body, _, edge = name.partition(".")
        return self.meshes[body].nodes(edge, name) + self.offsets[body]

    def boundary_edges(self, name: str) -> Index:
        """Global edges (k, 2) of 'body.boundary'."""
        body, _, edge = name.partition(".")
        mesh = self.meshes[body]
        mesh.nodes(edge, name)
        if edge not in mesh.edges:
            raise MeshError(f"{name!r} is a point; a load or a contact needs a boundary")
        return mesh.edges[edge] + self.offsets[body]

    @cached_property
    def axis_nodes(self) -> Index:
        """Nodes on the axis of revolution, whose radial displacement is zero."""
        if not self.axisymmetric:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(self.X[:, 0] <= 1e-12 * self.length)

    def multipliers(self, u: Array, lam: Array) -> Array:
        """λ_n, λ_T (points, 2) of all contact points: of exact contacts from the unknowns u (ndof,), else those of lam."""
        if not any(s.exact for s in self.surfaces):
            return lam
        out = lam.copy()
        for s in self.surfaces:
            if s.exact:
                out[s.rows] = u[s.unknowns].reshape(-1, 2) * (s.modulus / s.points.depth)[:, None]
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

    def supported(self, nodes: Index, plan: StepPlan) -> NDArray[np.bool_]:
        """Whether nodes (k,) are held along x or y in a step."""
        held = np.zeros(self.ndof, dtype=bool)
        held[plan.fixed] = True
        return held[2 * nodes] | held[2 * nodes + 1]

    def followed(self, u: Array) -> Array:
        """Unknowns (ndof,) with tied nodes put where their masters take them."""
        return u if self.ties is None else self.ties.followed(u)

    def collected(self, r: Array) -> Array:
        """Forces (ndof,) with those on tied nodes handed over to their masters."""
        return r if self.ties is None else self.ties.collected(r)

    def owners(self, dofs: Index) -> Index:
        """Unknowns with those of nodes that a tie has made one replaced by the one that stands for them."""
        return dofs if self.ties is None else np.unique(self.ties.owner[dofs])

    def tied_bodies(self, body: str) -> list[str]:
        """A body and those that ties join to it, in the order of the description."""
        group = {body}
        pairs = [{t.slave.partition(".")[0], t.master.partition(".")[0]} for t in self.problem.ties]
        for _ in pairs:
            group |= {b for pair in pairs if pair & group for b in pair}
        return [b for b in self.problem.bodies if b in group]

    def positions(self, u: Array) -> Array:
        """Node positions (n, 2) for unknowns u (ndof,)."""
        return self.X + u[: 2 * self.nodes].reshape(-1, 2)

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
            nodal = recover(self.X[first:last], b.cells - first, b.positions(self.X), ratio[..., None])[:, 0]
            # a patch may overshoot at a corner, no point's thickness is outside what the points have
            out[first:last] = self.problem.thickness * np.clip(nodal, ratio.min(), ratio.max())
        return out

    def weights(self, s: Surface, x: Array, depth: Array | None) -> Array:
        """Areas (k,) of the contact points on node positions x (n, 2) with the nodes' thickness (n,)."""
        return s.points.weights(x) * s.points.at(self.share(depth))

    def tributary(self, s: Surface, x: Array, depth: Array | None) -> Array:
        """∫N_A dΓ (n,) of the surface's nodes on node positions x with the nodes' thickness."""
        return s.points.tributary(x) * self.share(depth)[s.points.nodes]

    def share(self, depth: Array | None) -> Array:
        """Thickness of the nodes over the initial one (n,); 1 but in plane stress."""
        if depth is None or self.problem.space != "plane stress":
            return np.ones(self.nodes)
        return depth / self.problem.thickness

    def cylinder(self, tool: int) -> float:
        """Radius of a tool that is a cylinder or sphere, infinite for other shapes."""
        shape = self.tools[tool].shape
        return shape.radius if isinstance(shape, Circle) else np.inf

    # -------------------------------------------------------------------------------------------------------- state
    def initial(self) -> State:
        """The state at time 0: undeformed, or where an earlier run ended."""
        return self.beginning or self.virgin()

    def virgin(self) -> State:
        """The undeformed state."""
        n_points = sum(len(s.points) for s in self.surfaces)
        u = np.zeros(self.ndof)
        contact = np.zeros((n_points, 4))
        for s in self.surfaces:
            pairs = self.pairs(s, u)
            contact[s.rows, 2] = pairs.s
        return State(
            u=u, du=np.zeros(self.ndof), dt_last=0.0, bend=np.zeros(self.ndof),
            history=self.initial_history,
            contact=contact, lam=np.zeros((n_points, 2)), energy=np.zeros(6), work=np.zeros(self.ndof),
            clock=np.zeros(5), anchor=u.copy(),
        )  # fmt: skip

    def circumstances(self, state: State, plan: StepPlan, time: float) -> Circumstances:
        """Everything an increment from *state* to *time* needs; evaluated once an increment."""
        finite = self.problem.kinematics == "finite"
        x_n = self.positions(state.u) if finite else self.X
        depth = self.depth_in(state.history) if finite else self.depth
        weights = [self.weights(s, x_n, depth) for s in self.surfaces]
        dt = time - float(state.clock[2])
        laws = [None if self.frictionless(d) else d for d in plan.friction]
        law_at, scales = [], []
        for s, law in zip(self.surfaces, laws):
            k = self.shear_strength(s, state) if law is not None and law.asks_for_k else None
            law_at.append(FrictionAt(k, dt, time))
            least = np.zeros(len(s.points))
            if law is not None and law.hardens:
                # a softening law needs k_T > |∂τ_y/∂κ| for a unique root: take twice that at the committed pressures
                least = 2.0 * law.softening(state.lam[s.rows, 0], state.contact[s.rows, 1], law_at[-1])
            scales.append(s.scale(least))
        return Circumstances(state, plan, time, dt, weights, scales, laws, law_at, x_n, depth)

    # ----------------------------------------------------------------------------------------------------- residual
    def pairs(self, s: Surface, u: Array) -> Pairs:
        """Gap and slip data of a contact at its integration points, for unknowns u."""
        displacement = s.points.at(u[: 2 * self.nodes].reshape(-1, 2))
        return self._pairs(s, u, s.X, displacement, s.normal)

    def node_pairs(self, s: Surface, u: Array) -> Pairs:
        """Gap and slip data of a contact at the nodes of its surface, whatever the rule."""
        nodes = s.points.nodes
        displacement = u[: 2 * self.nodes].reshape(-1, 2)[nodes]
        return self._pairs(s, u, self.X[nodes], displacement, s.node_normal)

    def _pairs(self, s: Surface, u: Array, X: Array, displacement: Array, normal: Array) -> Pairs:
        tool = self.tools[s.tool]
        place_ = u[self.tool_dof(s.tool) :][:3]
        if self.problem.contact_geometry == "current":
            return current_pairs(tool.shape, X + displacement, tool.at, place_)
        return reference_pairs(tool.shape, X, normal, displacement, tool.at, place_, 100.0 * self.length)

    def evaluate(
        self, c: Circumstances, u: Array, lam: Array, stiffness: bool = True, hold: NDArray[np.bool_] | None = None,
        begin: bool = False,
    ) -> Evaluation:  # fmt: skip
        """Residual r = f_int − f_contact − f_ext of unknowns u (ndof,) and multipliers lam (points, 2), and its derivative.

        Contacts with exact enforcement have their multipliers in u and their equations in r; lam is not used there.
        hold (points,): contact points made to stick, with which the solver breaks cycles; begin: points that were closed are
        kept closed and stuck, with which it looks for a first guess (see `forces`). Pure: it answers the same for the same
        arguments whatever came before.
        """
        r = np.zeros(self.ndof)
        data = np.zeros(len(self.pattern.indices)) if stiffness else None
        bulk = self.bulk(c, u, r, data)
        if bulk.failed:
            return Evaluation(r, data, np.inf, (), (), r, bulk.failed)
        scale, floor, violation = NOTHING * self.stiffness + bulk.scale, bulk.floor, 0.0
        tools = slice(2 * self.nodes, 2 * self.nodes + 3 * len(self.tools))
        reach = self.length + float(np.abs(u[tools]).max(initial=0.0))
        lam = self.multipliers(u, lam)
        results = []
        for s, w, sc, law, at in zip(self.surfaces, c.weights, c.scales, c.laws, c.law_at):
            period = self.tools[s.tool].shape.period
            held = None if hold is None else hold[s.rows]
            before = c.state.lam[s.rows, 0] if begin else None
            if begin:
                held = c.state.contact[s.rows, 3] > 0
            follows = law is not None and not law.proportional and self.problem.kinematics == "finite"
            area = self.weights(s, self.positions(u), c.depth) if follows else None
            pairs = self.pairs(s, u)
            f = forces(
                pairs, w, sc, lam[s.rows], c.state.contact[s.rows], law, at, period, held, area, c.lagged, before
            )
            # points that just touch are closed or open by the round-off of their gaps; those that stick have that of their slips
            floor += EPS * float((w * sc.k_n * f.dp[:, 0] + f.area * sc.k_t * np.abs(f.dt[:, 1])).sum()) * reach
            if not np.isfinite(f.K).all():
                return Evaluation(
                    r, data, np.inf, (), (), r, f"friction of {s.name} softens too fast for its stiffness k_T"
                )
            K = f.K
            if s.exact:
                R, K = multiplier_rows(f, pairs, lam[s.rows], sc)
                r[s.unknowns] = R.ravel()
                lengths = np.abs(R).max(axis=1, initial=0.0) / (w * sc.unit)
                size = max(reach, float(np.abs(self.X).max()), float(np.abs(self.tools[s.tool].at).max()))
                violation = max(violation, float(((lengths - ROUND * EPS * size) / sc.h).max(initial=0.0)))
            F, K = s.points.spread(f.F, K)
            scatter_vector(-F, s.dofs, r)
            if data is not None:
                scatter_matrix(K, self.pair_slots(s), data)
                if f.stretched is not None and not c.lagged:
                    t = f.stretched * s.points.at(self.share(c.depth))
                    slopes = s.points.slopes(self.positions(u))
                    scatter_matrix(stretching(t, pairs, s.points.shares, slopes), self._stretch_slots(s), data)
            scale += float(np.abs(f.F[:, :2]).sum())
            results.append(f)
        f_ext = self.external(c, u, data)
        scale += float(np.abs(f_ext[: 2 * self.nodes]).sum())
        return Evaluation(r - f_ext, data, scale, bulk.history, tuple(results), f_ext, "", floor, violation)

    def bulk(self, c: Circumstances, u: Array, r: Array, data: Array | None) -> Bulk:
        """Add the internal forces of the bodies to r (ndof,) and, unless it is None, their stiffness to data (nnz,)."""
        # linear elastic bodies in small strain answer to the total displacement: nothing accumulates
        total = self.problem.kinematics == "small" and not self.has_memory
        du = (u if total else u - c.state.u)[: 2 * self.nodes].reshape(-1, 2)
        base = self.initial_history if total else c.state.history
        history, scale, floor = [], 0.0, ROUND_OFF * EPS * self.stiffness * self.nodes
        at = At(c.dt, c.time, data is not None)
        for block, old in zip(self.blocks, base):
            out = sweep(block, c.x_n, du, old, at, r, data, self.pattern)
            if out.failed:
                x = self.X[block.cells[out.failed.element]].mean(axis=0)
                where = f"element {out.failed.element} of {block.body} (initially near {x[0]:.4g}, {x[1]:.4g})"
                return Bulk(scale, floor, (), f"{where} {out.failed.why}")
            history.append(out.history)
            scale += out.force_scale
        return Bulk(scale, floor, tuple(history))

    @cached_property
    def stiffness(self) -> float:
        """A force: modulus × size × thickness (or circumference), the scale of forces at strains of order one."""
        depth = 2 * np.pi * self.length if self.axisymmetric else self.problem.thickness
        return max(b.law.modulus() for b in self.blocks) * self.length * depth

    @cached_property
    def has_memory(self) -> bool:
        """Whether some material remembers more than its present strain."""
        return any(b.law.plastic for b in self.blocks)

    @cached_property
    def initial_history(self) -> tuple[Array, ...]:
        """Histories of the virgin material."""
        return tuple(b.virgin for b in self.blocks)

    def external(self, c: Circumstances, u: Array, data: Array | None) -> Array:
        """External forces (ndof,) at the end of an increment; their stiffness is added to data (nnz,) unless it is None."""
        f = np.zeros(self.ndof)
        nodal = f[: 2 * self.nodes].reshape(-1, 2)
        for name, load in c.plan.loads.items():
            x = self.positions(u) if self.problem.kinematics == "finite" else self.X
            p, q = load.pressure(c.time), load.shear(c.time)
            t = (load.tx(c.time), load.ty(c.time))
            live = load.follower and (p != 0.0 or q != 0.0)
            dofs = (2 * load.edges[:, :, None] + np.arange(2)).reshape(len(load.edges), -1)
            if live:
                np.add.at(f, dofs, fem_loads.boundary_force(x, load.edges, c.depth, p, q))
                if data is not None:
                    K = fem_loads.follower_stiffness(x, load.edges, c.depth, p, q)
                    scatter_matrix(K, self._load_slots(name, dofs), data)
                p = q = 0.0
            if p or q or any(t):
                np.add.at(f, dofs, fem_loads.boundary_force(self.X, load.edges, self.depth, p, q, t))
        for body, (bx, by) in c.plan.body_force.items():
            b = np.array([bx(c.time), by(c.time)])
            first = self.offsets[body]
            nodal[first : first + len(self.meshes[body].points)] += self._node_volumes(body)[:, None] * b
        for dof, course in c.plan.push.items():
            f[dof] += course(c.time)
        for dof, (stiffness, mount) in c.plan.springs.items():
            f[dof] += stiffness * (mount(c.time) - u[dof])
            if data is not None:
                data[self._load_slots(f"spring {dof}", np.array([[dof]]))] += stiffness
        if self.release is not None and c.time < 1.0:
            f += (1.0 - c.time) * self.release  # what held the bodies in an earlier run is let go during the first step
        return f

    def _load_slots(self, name: str, dofs: Index) -> NDArray[np.int32]:
        if name not in self._edge_slots:
            out = np.empty((*dofs.shape, dofs.shape[1]), dtype=np.int32)
            slots(self.pattern.indptr, self.pattern.indices, dofs, out)
            self._edge_slots[name] = out
        return self._edge_slots[name]

    def _node_volumes(self, body: str) -> Array:
        key = f"volume {body}"
        if key not in self._edge_slots:
            block = next(b for b in self.blocks if b.body == body)
            out = np.zeros(len(self.meshes[body].points))
            np.add.at(out, block.cells - self.offsets[body], block.volume @ block.element.N)
            self._edge_slots[key] = out
        return self._edge_slots[key]

    def pair_slots(self, s: Surface) -> NDArray[np.int32]:
        """Places (k, m, m) of the `Surface.coupled` unknowns of the pairs in the matrix values."""
        if s.name not in self._edge_slots:
            dofs = s.coupled
            out = np.empty((len(dofs), dofs.shape[1], dofs.shape[1]), dtype=np.int32)
            slots(self.pattern.indptr, self.pattern.indices, np.ascontiguousarray(dofs), out)
            self._edge_slots[s.name] = out
        return self._edge_slots[s.name]

    def _stretch_slots(self, s: Surface) -> NDArray[np.int32]:
        """Places in the pattern of the blocks (shares, 7, 7) on both nodes of the edge and the tool."""
        key = f"stretch {s.name}"
        if key not in self._edge_slots:
            edges = s.points.edges[s.points.shares.edge]
            nodes = (2 * edges[:, :, None] + np.arange(2)).reshape(-1, 4)
            tool = np.broadcast_to(self.tool_dof(s.tool) + np.arange(3), (len(nodes), 3))
            out = np.empty((len(nodes), 7, 7), dtype=np.int32)
            slots(self.pattern.indptr, self.pattern.indices, np.ascontiguousarray(np.hstack([nodes, tool])), out)
            self._edge_slots[key] = out
        return self._edge_slots[key]

    @staticmethod
    def frictionless(description: Any) -> bool:
        """Whether a friction description says that there is none."""
        return description is None or bool(description.frictionless)

    def shear_strength(self, s: Surface, state: State) -> Array:
        """Shear yield stress (points,) in a committed state: the mean over the integration points of the elements behind."""
        number = next(i for i, b in enumerate(self.blocks) if b.body == s.body)
        history = state.history[number][s.behind]
        law: Any = self.blocks[number].law
        k = law.shear_strength(history.reshape(-1, history.shape[-1])).reshape(len(s.behind), -1).mean(axis=1)
        part = s.points.shares
        return np.bincount(part.point, k[part.edge]) / np.bincount(part.point)

    def elastic_energy(self, history: Sequence[Array]) -> float:
        """∫ψ dV of a committed history, from the laws' energy functions; of one not computed yet as it was found."""
        if isinstance(history, Recovered):
            return history.energy
        return float(sum(np.vdot(b.volume, b.law.energy(b.at_law(h))) for b, h in zip(self.blocks, history)))

    def plastic_work(self, history: Sequence[Array]) -> float:
        """Accumulated plastic dissipation of a committed history."""
        if not self.has_memory:
            return 0.0
        plastic = [
            (b, h[..., b.law.fields["plastic_work"].columns]) for b, h in zip(self.blocks, history) if b.law.plastic
        ]
        return float(sum(np.vdot(b.volume, work) for b, work in plastic))


def _refuse_edges_on_points(tool: PlacedTool, points: Points, X: Array, normal: Array) -> None:
    """A sharp edge over a contact point has no equilibrium on the moved surface: the point drops off, and comes back.

    Raises
    ------
    ToolError
        Naming the tool, the node and the fillet to give.

    """
    for *edge, ex, ey in tool.shape.edges:
        along = (X - tool.at - edge) @ np.array([ex, ey])
        inside = along.min() + 1e-9 < 0.0 < along.max() - 1e-9
        facing = ey * normal[:, 0] - ex * normal[:, 1] < 0.0
        over = np.flatnonzero(facing & (np.abs(along) < 0.02 * points.depth))
        if inside and len(over):
            k = over[np.argmin(np.hypot(*(X[over] - tool.at - edge).T))]
            what = "node" if points.rule == "nodal" else "contact point"
            raise ToolError(
                f"tools.{tool.name}: its sharp edge lies over the {what} at ({X[k, 0]:g}, {X[k, 1]:g}), which would drop "
                f"off and come back for ever; give 'fillet: {0.5 * points.depth[k]:.3g}', or use 'contact_geometry: reference'"
            )


def _pair_dofs(support: Index, tool: int) -> Index:
    """Unknowns (k, 2a + 3) of pairs: x, y of the nodes ``support`` (k, a), the three of a tool from number ``tool`` on."""
    nodal = (2 * support[:, :, None] + np.arange(2)).reshape(len(support), -1)
    return np.hstack([nodal, np.broadcast_to(tool + np.arange(3), (len(support), 3))])


def _rounding(problem: model.Problem, t: int, surfaces: list[Surface]) -> float:
    """Radius of the corners of a tool without fillets of its own: none where the surface stays where it is."""
    if problem.contact_geometry == "reference":
        return 0.0
    return ROUNDING * min((float(s.points.depth.min()) for s in surfaces if s.tool == t), default=0.0)


def discretise(problem: model.Problem) -> System:
    """Arrays of a problem: meshes, placed tools, contact candidates, sparsity pattern.

    Raises
    ------
    PrensaError
        For a boundary that does not exist, a mesh that cannot be computed on, a tool that cannot be placed.

    """
    axisymmetric = problem.space == "axisymmetric"
    meshes: dict[str, Mesh] = {}
    offsets, total = {}, 0
    for name, body in problem.bodies.items():
        try:
            meshes[name] = mesh_of(body.mesh, body.element_in(problem.space), problem.units.length)
        except PrensaError as error:
            raise MeshError(f"bodies.{name}.mesh: {error}") from None
        if axisymmetric and meshes[name].points[:, 0].min() < -1e-12 * np.ptp(meshes[name].points[:, 0]):
            raise MeshError(
                f"bodies.{name}.mesh: an axisymmetric mesh lies at x ≥ 0; this one reaches "
                f"x = {meshes[name].points[:, 0].min():g}"
            )
        offsets[name], total = total, total + len(meshes[name].points)
    X = np.concatenate([m.points for m in meshes.values()])
    ties, X = make_ties(problem, meshes, offsets, X, held_components(problem, meshes, offsets, X))
    surfaces: list[Surface] = []
    first, own = 0, 2 * total + 3 * len(problem.tools)
    for contact in problem.contacts:
        owner = contact.surface[0].partition(".")[0]
        mesh = meshes[owner]
        parts = []
        for s in contact.surface:
            edge = s.partition(".")[2]
            mesh.nodes(edge, s)
            if edge not in mesh.edges:
                raise MeshError(f"contact surface {s!r} is a point; it must be a boundary")
            parts.append(mesh.edges[edge])
        edges = np.unique(np.concatenate(parts), axis=0)
        nodes = ordered_nodes(edges)
        first_node = offsets[owner]
        depth = depth_of(edges, mesh.cells, mesh.points)
        points = points_of(
            contact.integration, X, nodes + first_node, edges + first_node, depth, axisymmetric, problem.thickness
        )
        law = material_of(problem.bodies[owner].material, problem.kinematics, problem.space)
        tool = list(problem.tools).index(contact.against)
        exact = contact.enforcement.has_multipliers
        surfaces.append(
            Surface(
                contact.name, contact, owner, tool, points, first, points.at(X),
                _pair_dofs(points.support, 2 * total + 3 * tool), point_normals(points, X),
                node_normals(X, points.nodes, points.edges), law.modulus(), behind(points.edges - first_node, mesh.cells),
                own if exact else -1,
            )
        )  # fmt: skip
        first += len(points)
        own += 2 * len(points) if exact else 0
    earlier = None
    if problem.start is not None:
        from prensa.fem.start import earlier_run

        earlier = earlier_run(problem, problem.start, meshes)
    shapes = meshes if earlier is None else earlier.shapes(meshes)
    tools = [
        (earlier.tool(name, d) if earlier is not None else None)
        or place(name, d, shapes, _rounding(problem, t, surfaces))
        for t, (name, d) in enumerate(problem.tools.items())
    ]
    if problem.contact_geometry == "current":
        for surface in surfaces:
            _refuse_edges_on_points(tools[surface.tool], surface.points, surface.X, surface.normal)
    cells = [m.cells + offsets[name] for name, m in meshes.items()]
    near = [
        np.unique(np.concatenate([s.points.nodes for s in surfaces if s.tool == t] or [np.zeros(0, dtype=np.int64)]))
        for t in range(len(tools))
    ]
    pattern = make_pattern(cells, total, len(tools), near, [s.coupled for s in surfaces if s.exact])
    blocks = []
    for (name, body), c in zip(problem.bodies.items(), cells):
        element = element_of(body.element_in(problem.space))
        slot = np.empty((*c.shape, c.shape[1]), dtype=np.int32)
        block_slots(pattern.indptr, pattern.indices, c, slot)
        mode = Mode(axisymmetric, problem.kinematics == "finite", 2 * np.pi if axisymmetric else problem.thickness)
        volume, folded = element.volumes(X[c], mode)
        if folded.any():
            e = int(np.argmax(folded))
            raise MeshError(
                f"bodies.{name}.mesh: element {e} near ({X[c[e], 0].mean():g}, {X[c[e], 1].mean():g}) is folded "
                "(negative Jacobian at an integration point)"
            )
        law = material_of(body.material, problem.kinematics, problem.space)
        blocks.append(Block(name, c, X[c], law, element, mode, slot, volume))
    system = System(problem, meshes, offsets, X, blocks, tools, surfaces, pattern, total, ties)
    for name in [*problem.fixed, *(k for s in problem.steps for k in s.fixed)]:
        system.boundary_nodes(name)
    for name in [*problem.loads, *(k for s in problem.steps for k in s.loads)]:
        system.boundary_edges(name)
    if earlier is not None:
        system.beginning, system.release = earlier.begin(system)
    return system
