"""A committed state on new meshes: outline, triangles, contacts, histories; what refers to the initial shape goes along.

Nodes of new meshes lie on the curves of the old outlines. Closed ones are then put where their tools leave them, at g = −p/k_n
(at g = 0 where multipliers carry the pressure), open ones outside of all tools, and free ones moved along their normals, all by
one distance, so that the volume is the old one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from prensa.contact.integration import node_normals
from prensa.contact.record import ContactRecord
from prensa.contact.surface import Surface
from prensa.friction.law import FrictionLaw
from prensa.mesh.mesh import Mesh, boundary_edges, displaced, ordered_nodes, segments
from prensa.mesh.outline import SizeOf, chains, resampled
from prensa.mesh.triangulate import TriangulationError, mesher, triangulated
from prensa.remeshing.transfer import at_places, carried, carried_beside, elastic_volume, located, shape_values
from prensa.system.assembly import Block
from prensa.system.discretise import on_meshes, with_origins
from prensa.system.mesh_state import Remeshed, stored
from prensa.system.planning import plan_step
from prensa.system.schedule import Prescribed, StepPlan
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array, Flags, Index

IN_TURN = 4  # of the contacts, in which nodes are put in place: a node may touch two tools
FEWEST = 3  # free nodes that can keep a volume
AT_END = 0.02  # of an old side: so near to its end a node is what the end is
LEAST_SHARE = 0.01  # of the squared normal in directions in which a node may move
EQUILATERAL = np.array([[1.0, -1.0 / np.sqrt(3.0)], [0.0, 2.0 / np.sqrt(3.0)]])
CLEAR = 0.02  # gap over element depth from which a node is free to be moved


def present_plan(system: System, state: State) -> StepPlan:
    """The step that a state belongs to (at the end of one, that one), with everything that it prescribes held where it is."""
    ended = state.clock.step > 0 and state.clock.time <= state.clock.step
    number = state.clock.step - 1 if ended else state.clock.step
    plan = plan_step(system, number, state.u if ended else state.step_start, state.ends)
    return replace(plan, groups=[Prescribed(plan.fixed, state.u[plan.fixed])])


def renewed(system: System, state: State, bodies: list[str], size_of: Callable[[str], SizeOf]) -> tuple[System, State]:
    """System and state on new meshes of some bodies, of sizes ``size_of`` (body); not yet in equilibrium.

    Raises
    ------
    TriangulationError
        If there is no mesh between the outlines.

    """
    touching = np.zeros(system.nodes, dtype=bool)
    for s in system.surfaces:
        touching[s.points.support[state.contact.closed[s.rows], 0]] = True
    meshes = {}
    for body, mesh in system.meshes.items():
        own = system.span(body)
        x = system.positions(state.u)[own]
        meshes[body] = _new_mesh(mesh, x, size_of(body), touching[own]) if body in bodies else displaced(mesh, x)
    return carried_over(system, state, meshes, bodies)


def _new_mesh(mesh: Mesh, x: Array, size: SizeOf, touching: Flags) -> Mesh:
    new = triangulated([resampled(outline, size, touching) for outline in chains(mesh, x)], size)
    corners = {name: int(np.argmin(np.hypot(*(new.points - x[node]).T))) for name, node in mesh.corners.items()}
    edges = {name: new.edges[name] for name in mesh.edges}
    return stored(new.points, new.cells, edges, corners)


def carried_over(system: System, state: State, meshes: dict[str, Mesh], bodies: list[str]) -> tuple[System, State]:
    """System and state on given meshes of the deformed bodies; those of ``bodies`` are other ones than before."""
    count = 1 if state.remeshed is None else state.remeshed.count + 1
    motions = system.dofs.tool.of(state.u).copy()
    draft = Remeshed(meshes, {b: m.points for b, m in meshes.items()}, {}, count, state.clock.number, motions, 0.0)
    new = on_meshes(system, draft)  # its X are the places now, until those of the beginning are known
    nodal = _Nodal(system, state, new, bodies)
    places = _Places(system, state, new, nodal.carried(state.u), bodies)
    points = {b: places.x[new.span(b)] for b in meshes}
    shape = min(float(shape_measure(points[b], meshes[b].cells).min()) for b in bodies)
    if not shape > 0:
        raise TriangulationError(
            "an element of the new mesh is folded at a curved side; ask for smaller elements there"
        )
    draft = draft.moved(points, origin=points, shape=shape)
    new = on_meshes(system, draft)
    # Displacements go over as a field, places do not: the initial place of the material at a node is what is left, X = x − u.
    u = nodal.carried(state.u)
    # Displacements that count from here on would have to be known to every prescribed value, load and plot.
    origin = new.X - new.displacement(u)
    histories, volumes = _histories(system, state, new, bodies)
    remeshed = replace(draft, origin={b: origin[new.span(b)] for b in meshes}, volume=volumes)
    record, lam = places.records(new)
    for s in new.surfaces:
        if s.multipliers is not None:
            s.multipliers.of(u)[:] = lam[s.rows] / s.unit[:, None]
    release = None if state.release is None else nodal.handed_over(state.release, new.positions(u))
    return with_origins(new, remeshed), replace(
        state, u=u, du=nodal.carried(state.du), second_difference=np.zeros(new.ndof), history=histories, contact=record,
        lam=lam, work=np.zeros(new.ndof), step_start=nodal.carried(state.step_start), release=release,
        clock=state.clock._replace(damping=0.0), remeshed=remeshed, damage=_damage(system, state, new, bodies, volumes),
    )  # fmt: skip


def _histories(
    system: System, state: State, new: System, bodies: list[str]
) -> tuple[tuple[Array, ...], dict[str, Array]]:
    """Histories of the blocks, and initial volumes of their points: those of now over the elastic part of their change."""
    histories, volumes = [], {}
    for before, block, history in zip(system.blocks, new.blocks, state.history):
        if block.body not in bodies:
            histories.append(history)
            volumes[block.body] = before.volume
            continue
        histories.append(carried(before, system.positions(state.u), history, block.positions(new.X), block.volume))
        volumes[block.body] = block.volume / elastic_volume(histories[-1])
    return tuple(histories), volumes


def _damage(
    system: System, state: State, new: System, bodies: list[str], volumes: Mapping[str, Array]
) -> tuple[Array, ...]:  # fmt: skip
    """Damage of the blocks, at points of the initial ``volumes``."""
    out = []
    for before, block, values in zip(system.blocks, new.blocks, state.damage):
        laws = system.problem.bodies[block.body].damage
        if laws and block.body in bodies:
            growing = np.array([not law.falls for law in laws])
            x, there = system.positions(state.u), block.positions(new.X)
            values = carried_beside(before, x, values, growing, there, volumes[block.body])
        out.append(values)
    return tuple(out)


class _Nodal:
    """Nodal values from one system to another: of the nodes by interpolation, of the tools as they are."""

    def __init__(self, old: System, state: State, new: System, bodies: list[str]) -> None:
        self.old, self.new, self.bodies = old, new, bodies
        self.x = old.positions(state.u)
        self.places = {b: located(self.x[old.span(b)], old.meshes[b].cells, new.X[new.span(b)]) for b in bodies}

    def carried(self, values: Array) -> Array:
        """Values (ndof,) of the old degrees of freedom at the new ones."""
        out = np.zeros(self.new.ndof)
        before, after = self.old.displacement(values), self.new.displacement(out)
        for body, mesh in self.old.meshes.items():
            nodal = before[self.old.span(body)]
            after[self.new.span(body)] = (
                at_places(nodal, mesh.cells, self.places[body]) if body in self.bodies else nodal
            )
        self.new.dofs.tool.of(out)[:] = self.old.dofs.tool.of(values)
        return out

    def handed_over(self, forces: Array, x: Array) -> Array:
        """Forces (ndof,) on the old nodes, given to the nodes at x (n, 2) around them: resultant and moment stay."""
        out = np.zeros(self.new.ndof)
        before, after = self.old.displacement(forces), self.new.displacement(out)
        for body, mesh in self.new.meshes.items():
            own, nodal = after[self.new.span(body)], before[self.old.span(body)]
            if body not in self.bodies:
                own[:] = nodal
                continue
            loaded = np.flatnonzero(nodal.any(axis=1))
            there = located(x[self.new.span(body)], mesh.cells, self.x[self.old.span(body)][loaded])
            np.add.at(own, mesh.cells[there.element], there.N[:, :, None] * nodal[loaded, None, :])
        self.new.dofs.tool.of(out)[:] = self.old.dofs.tool.of(forces)
        return out


class _Places:
    """Where the nodes of new meshes lie (``x`` (n, 2)), and what their contact points have of the old ones.

    u (ndof,): degrees of freedom of the new system, of which the tools' count.
    """

    def __init__(self, old: System, state: State, new: System, u: Array, bodies: list[str]) -> None:
        self.old, self.state, self.new = old, state, new
        self.tools_at = np.zeros(new.ndof)
        new.dofs.tool.of(self.tools_at)[:] = new.dofs.tool.of(u)
        self.x = new.X.copy()
        held = np.zeros(new.ndof, dtype=bool)
        held[present_plan(new, replace(state, u=u, step_start=u)).fixed] = True
        self.held = new.displacement(held)
        friction = present_plan(old, state).friction
        self.values = [self._interpolated(*pair) for pair in zip(old.surfaces, new.surfaces, friction)]
        # A node at two tools, in a corner of a die, is put on one after the other: a few turns come to rest in the corner.
        for _ in range(IN_TURN):
            for s, (_, closed, lam) in zip(new.surfaces, self.values):
                if s.body in bodies:
                    self._put_in_place(s, closed, lam)
        for body in bodies:
            self._keep_volume(body)

    def _interpolated(self, old: Surface, new: Surface, law: FrictionLaw | None) -> tuple[ContactRecord, Flags, Array]:
        """Record of the points (k,) of a contact, whether they are closed, and their multipliers, from the nearest old places."""
        x, record = self.old.positions(self.state.u), self.state.contact.of(old.rows)
        number = np.full(self.old.nodes, -1)
        number[old.points.support[:, 0]] = np.arange(len(old.points))
        between_points = number[old.points.edges]
        a, b = between_points[(between_points >= 0).all(axis=1)].T
        at = old.points.at(x)
        start, way = at[a], at[b] - at[a]
        p = new.points.at(self.new.X)
        share = np.clip(((p[:, None] - start) * way).sum(axis=2) / (way**2).sum(axis=1), 0.0, 1.0)
        off = p[:, None] - start - share[..., None] * way
        piece = np.hypot(off[..., 0], off[..., 1]).argmin(axis=1)
        t = share[np.arange(len(p)), piece]
        i, j = a[piece], b[piece]
        shut = record.closed
        closed = (shut[i] & shut[j]) | (shut[i] & (t < AT_END)) | (shut[j] & (t > 1 - AT_END))

        def between(values: Array) -> Array:
            w = t.reshape(-1, *[1] * (values.ndim - 1))
            return np.asarray((1 - w) * values[i] + w * values[j])

        by_area = self._areas(old, law)
        lam = between(self.state.lam[old.rows] * by_area) * closed[:, None]
        traction = between(record.traction * by_area[:, 1:]) * closed[:, None]
        coordinate = np.zeros_like(traction)
        slip, *rest = (between(of) for of in (record.slip, record.speed, record.area, record.time, record.path))
        return ContactRecord(traction, slip, coordinate, closed, *rest), closed, lam

    def _areas(self, s: Surface, law: FrictionLaw | None) -> Array:
        """Factors (k, 1 + t) from pressures and tractions per area at the start of the last increment to those per area now.

        Tractions that are not proportional to the pressure are per area now already.
        """
        old, u = self.old, self.state.u
        then, now = (old.weights(s, old.positions(at), None) for at in (u - self.state.du, u))
        out = np.ones((len(s.points), self.state.lam.shape[1]))
        columns = slice(None if law is None or law.proportional else 1)
        out[:, columns] = np.where((then > 0) & (now > 0), then / np.where(now > 0, now, 1.0), 1.0)[:, None]
        return out

    def _put_in_place(self, s: Surface, closed: Flags, lam: Array) -> None:
        """Move the nodes of a contact along the normals of its tool: closed ones to where they lie, others out of it."""
        target = np.zeros(len(closed))
        if s.description.enforcement.sinks:
            target = np.where(closed, -np.maximum(lam[:, 0], 0.0) / s.scale(target).k_n, 0.0)
        for share in np.unique(s.points.N[:, 0])[::-1]:  # points at nodes first, then those that neighbours carry with theirs
            of = np.flatnonzero(s.points.N[:, 0] == share)
            nodes = s.points.support[of, 0]
            pairs = self.new.tool_masters[s.against].seen(s.points.at(self.x)[of], self.tools_at)
            free = np.where(self.held[nodes], 0.0, pairs.n)
            # Along the directions that supports leave free; where these hardly point along the normal a small gap would ask for
            # a long way.
            size = share * (free**2).sum(axis=1)
            go = (closed[of] | (pairs.g < 0)) & (size > LEAST_SHARE)
            way = np.where(go, (target[of] - pairs.g) / np.where(go, size, 1.0), 0.0)
            self.x[nodes] += way[:, None] * free

    def _keep_volume(self, body: str) -> None:
        """Move the free nodes of an outline along their normals, all by one distance, so that its volume is the old one."""
        block = next(b for b in self.new.blocks if b.body == body)
        before = next(b for b in self.old.blocks if b.body == body)
        wanted = _volume(before, self.old.positions(self.state.u))
        edges = segments(boundary_edges(block.cells))
        nodes = ordered_nodes(edges)
        free = np.zeros(self.new.nodes, dtype=bool)
        free[nodes] = ~self.held[nodes].any(axis=1)
        for s, (_, closed, _) in zip(self.new.surfaces, self.values):
            own = s.points.support[:, 0]
            pairs = self.new.tool_masters[s.against].seen(self.x[own], self.tools_at)
            free[own] &= ~closed & (pairs.g > CLEAR * s.points.depth)
        if free.sum() < FEWEST:
            return
        way = np.zeros_like(self.x)
        way[nodes] = node_normals(self.x, nodes, edges) * free[nodes, None]
        tiny = 1e-6 * self.new.length
        # Newton's method by a secant: the volume is at most a cubic of the common distance.
        for _ in range(3):
            now, more = (_volume(block, self.x + a * way) for a in (0.0, tiny))
            self.x += (wanted - now) / (more - now) * tiny * way

    def records(self, new: System) -> tuple[ContactRecord, Array]:
        """Record and multipliers of all contact points of a system with its nodes where they are now."""
        t = self.state.lam.shape[1] - 1
        total = sum(len(s.points) for s in new.surfaces)
        record, lam = ContactRecord.initial(total, t), np.zeros((total, 1 + t))
        for s, (own, _, multipliers) in zip(new.surfaces, self.values):
            coordinate, area = new.stencils(s, self.tools_at).s, new.weights(s, new.X, None)
            record = record.replaced(s.rows, replace(own, coordinate=coordinate, area=area))
            lam[s.rows] = multipliers
        return record, lam


def _volume(block: Block, x: Array) -> float:
    """Volume of a body with nodes at x (n, 2)."""
    return float(block.element.volumes(np.ascontiguousarray(x[block.cells]), block.mode)[0].sum())


def check_mesher() -> None:
    """Raise `PrensaError` if there is no mesher."""
    mesher()


def least_shape(system: System, u: Array, bodies: list[str]) -> float:
    """Least shape measure of all elements of some bodies, for degrees of freedom u (ndof,)."""
    x = system.positions(u)
    return min(float(shape_measure(x, b.cells).min()) for b in system.blocks if b.body in bodies)


def shape_measure(x: Array, cells: Index) -> Array:
    """Least 2 det J/|J|² over corners and middles of each T6 (m,), maps from an equilateral triangle: 1 best, 0 folded."""
    least = np.full(len(cells), np.inf)
    for xi in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)):
        dN = shape_values(np.array([xi]))[1][0]
        J = np.einsum("mad,ak->mdk", x[cells], dN) @ EQUILATERAL
        det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
        least = np.minimum(least, 2.0 * det / (J**2).sum(axis=(1, 2)))
    return least
