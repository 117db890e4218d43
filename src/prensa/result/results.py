"""Results of a committed increment: tool forces, contact states, recovered fields. Computed when asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from prensa.contact import recovery_in_space
from prensa.contact.forces import ContactForces
from prensa.contact.recovery import (
    at_free_edges,
    capped_at_flow_stress,
    mises_of,
    recover,
    smoothed,
    with_tractions_of_centres,
    within_elements,
)
from prensa.contact.surface import Surface
from prensa.errors import PrensaError, take
from prensa.materials.damage_law import DamageLaw
from prensa.mesh.faces import face_expansion
from prensa.mesh.mesh import boundary_edges
from prensa.mesh.surfaces import surface_expansion
from prensa.model.problem import support_names
from prensa.model.seconds import elapsed
from prensa.result.assembled import Assembled, assembled
from prensa.result.folding import folding
from prensa.result.increment import (
    FORCE_IN,
    PLACE,
    REACTION,
    SLIDING_FIELDS,
    BodyState,
    ContactState,
    Force,
    Increment,
    MaterialPoints,
    Moment,
    More,
    Parse,
    Place,
    PlasticPower,
    PointValues,
    Reaction,
    Shape,
    Statistics,
    ToolState,
)
from prensa.system.assembly import Block, scatter_vector
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.system import Evaluation, System
from prensa.types import Array, Bytes, Flags, Index

Recovery = Callable[[Array, Index, Array, Array], Array]


def increment_of(
    system: System, state: State, plan: StepPlan, e: Evaluation, result: NewtonResult, spent: int, cutbacks: int, ended: bool,
    before: State | None = None, context: Context | None = None, *, parse: Parse,
) -> Increment:  # fmt: skip
    """The increment that led to a state from the one *before* (None: from itself); spent: iterations of all its attempts.

    *context*: of its equations, which can then be assembled again; *parse*: see `Parse`.
    """
    before = before or state
    start, old = before.step_start, before.history
    seconds = (state.clock.time - before.clock.time) * plan.seconds
    statistics = Statistics(
        spent, cutbacks, result.residual, result.augmentations, tuple(result.residuals), tuple(result.changes),
        result.krylov,
    )
    # Of condensed bodies the displacements away from contact are found when somebody asks for them.
    recover, lam = result.recover, result.lam

    @cache
    def whole() -> State:
        return state if recover is None else replace(state, u=recover())

    return Increment(
        plan.name, plan.number + 1, state.clock.number, state.clock.time, tool_states(system, state, e),
        state.energy._asdict(), support_forces(system, e, plan, state), statistics, ended,
        whole, lambda: contact_states(system, whole(), e, plan, rate(before.contact.path, state.contact.path, seconds)),
        lambda: body_states(system, whole(), e, plan, old, seconds),
        remeshings=0 if state.remeshed is None else state.remeshed.count,
        seconds=elapsed(system.problem, state.clock.time, state.ends),
        support_moments=support_moments(system, e, plan, state),
        _more=More(system.problem, parse, lambda: shapes(system, whole(), start),
                   lambda: plastic_power(system, old, state.history, seconds),
                   None if context is None else lambda: assembled(system, context, whole().u, lam),
                   lambda: folding(system, whole().u, start), lambda: material_points(system, state)),
    )  # fmt: skip


def rate(before: Array, after: Array, seconds: float) -> Array:
    """Change (n,) per second; none in an increment without duration, or after which there are other points."""
    if not seconds > 0.0 or len(before) != len(after):
        return np.zeros(len(after))
    return np.asarray((after - before) / seconds)


def shapes(system: System, state: State, start: Array) -> dict[str, Shape]:
    """Where the bodies are, and were at the start of the step with degrees of freedom ``start`` (ndof,)."""
    x, begun = system.positions(state.u), system.positions(start)
    out = {}
    for b in system.blocks:
        own, mesh = _own(b), system.meshes[b.body]
        out[b.body] = Shape(system.X[own], x[own], begun[own], b.cells - own.start, mesh.edges, mesh.corners)
    return out


def plastic_power(system: System, old: Sequence[Array], new: Sequence[Array], seconds: float) -> dict[str, PlasticPower]:
    """Plastic work of the increment between two histories per second, at the integration points."""
    out = {}
    for b, before, after in zip(system.blocks, old, new, strict=True):
        work = np.zeros_like(b.volume)
        if b.law.plastic and seconds > 0.0:
            work = (b.field(after, "plastic_work") - b.field(before, "plastic_work"))[..., 0] / seconds
        out[b.body] = PlasticPower(work, b.volume)
    return out


def material_points(system: System, state: State) -> dict[str, MaterialPoints]:
    """Stresses, plastic strains and damage of a committed state, at the integration points."""
    out = {}
    for k, b in enumerate(system.blocks):
        history = np.asarray(state.history[k])
        stress = b.law.cauchy(b.at_law(history).reshape(-1, b.law.size)).reshape(*b.volume.shape, -1)
        strain = b.field(history, "plastic_strain")[..., 0] if b.law.plastic else np.zeros(b.volume.shape)
        laws = system.problem.bodies[b.body].damage
        damage = {law.name: state.damage[k][..., j] for j, law in enumerate(laws)}
        out[b.body] = MaterialPoints(stress, strain, damage)
    return out


def tool_forces(system: System, e: Evaluation) -> dict[str, Force]:
    """Force and moment of the bodies on each tool."""
    force = FORCE_IN[system.dofs.dimension]
    on_tools = system.dofs.tool.of(e.contact_forces())
    return {tool.name: force(*map(float, v)) for tool, v in zip(system.tools, on_tools)}


def tool_places(system: System, u: Array) -> dict[str, Place]:
    """Displacement and rotation of each tool at the degrees of freedom u (ndof,)."""
    place = PLACE[system.dofs.dimension]
    return {tool.name: place(*map(float, system.place_of(t, u))) for t, tool in enumerate(system.tools)}


def reactions(system: System, e: Evaluation, plan: StepPlan, state: State) -> Array:
    """Forces (ndof,) where degrees of freedom are prescribed, and what is left of those that the step releases there."""
    out = np.zeros(system.ndof)
    out[plan.fixed] = system.to_masters(e.r)[plan.fixed]
    if state.release is not None:
        release = system.being_released(state, plan)
        for group in plan.released:
            out[group.dofs] = release[group.dofs]
    return out


def support_forces(system: System, e: Evaluation, plan: StepPlan, state: State) -> dict[str, Reaction]:
    """Force of each support on the body, also of one being released; those of other steps are zero: the names never change."""
    problem = system.problem
    total = {name: [0.0] * system.dofs.dimension for name in support_names(problem)}
    r = reactions(system, e, plan, state)
    for group in [*plan.groups, *plan.released]:
        if group.support is not None:
            name, axis = group.support
            total[name]["xyz".index(axis)] += float(r[group.dofs].sum())
    for name, _, force in _along_normals(system, e):
        total[name] = [a + b for a, b in zip(total[name], force.sum(axis=0).tolist())]
    return {name: REACTION[system.dofs.dimension](*v) for name, v in total.items()}


def _along_normals(system: System, e: Evaluation) -> Iterator[tuple[str, Index, Array]]:
    """Sides that are held along their normals: name, nodes (k,) and the forces (k, 3) on them."""
    if system.ties is None or system.ties.inclined is None:
        return
    own, force = system.ties.inclined, system.ties.support_forces(e.r)
    for k, name in enumerate(own.names):
        yield name, own.nodes[own.sides == k], force[own.sides == k]


def support_moments(system: System, e: Evaluation, plan: StepPlan, state: State) -> dict[str, Moment]:
    """Moments of the supports on the bodies about the origin, of the forces of `support_forces`; none in the plane."""
    if system.dofs.dimension == 2:
        return {}
    x = system.positions(state.u) if system.problem.kinematics == "finite" else system.X
    r, field = reactions(system, e, plan, state), system.dofs.displacement
    total = {name: np.zeros(3) for name in support_names(system.problem)}
    for group in [*plan.groups, *plan.released]:
        if group.support is not None:
            nodes, axes = field.split(group.dofs)
            total[group.support[0]] += np.cross(x[nodes], np.eye(3)[axes] * r[group.dofs, None]).sum(axis=0)
    for name, nodes, force in _along_normals(system, e):
        total[name] += np.cross(x[nodes], force).sum(axis=0)
    return {name: Moment(*map(float, v)) for name, v in total.items()}


def tool_states(system: System, state: State, e: Evaluation) -> dict[str, ToolState]:
    """Places and forces of the tools."""
    force = tool_forces(system, e)
    out = {}
    for t, tool in enumerate(system.tools):
        mounted = getattr(tool.description, "spring", None)
        spring = None
        if mounted is not None:
            given = [getattr(mounted, key) is not None for key in system.dofs.tool.components]
            on_it = (float(v) if g else 0.0 for v, g in zip(system.place_of(t, e.f_ext), given))
            spring = FORCE_IN[system.dofs.dimension](*on_it)
        out[tool.name] = ToolState(
            tool.at,
            PLACE[system.dofs.dimension](*map(float, system.place_of(t, state.u))),
            force[tool.name],
            tuple(map(float, tool.direction)),
            spring,
            float(state.tool_work[t]) if t < len(state.tool_work) else 0.0,
            float(state.tool_wear[t]) if t < len(state.tool_wear) else np.nan,
            tuple(map(float, system.orientation_of(t, state.u))),
        )
    return out


def contact_states(
    system: System, state: State, e: Evaluation, plan: StepPlan, velocity: Array | None = None
) -> dict[str, ContactState]:  # fmt: skip
    """Contact results along each surface; pressures are those of points that are the nodes, else nodal forces over areas.

    ``velocity`` (points,): of sliding in the increment, None: at rest.

    Closed points slip in a step without friction; with friction those whose traction is on its bound.
    """
    x = system.positions(state.u)
    finite = system.problem.kinematics == "finite"
    where, depth = (x, system.depth_in(e.history)) if finite else (system.X, system.depth)
    patches, smooth = _stresses(system, state, e)
    out = {s.name: _apart(system, s, state, where, depth) for s in system.removed}
    velocity = np.zeros(len(state.contact)) if velocity is None else velocity
    for s, f, law in zip(system.surfaces_at(state.clock.time), e.contacts, plan.friction_at(state.clock.time)):
        # Where a sharp corner cuts edges the points are others in each increment.
        s = s if f.points is None else replace(s, points=f.points, X=f.points.at(system.X))
        nodes, pairs = s.points.nodes, system.nodes_seen(s, state.u)
        area, (weight, p, t) = system.tributary(s, where, depth), _now(system, s, f, where, depth)
        from_stress = _pressure_of(patches, nodes, pairs.n)
        slides = f.slip | system.frictionless(law)
        status = np.where(f.p > 0, np.where(slides, 2, 1), 0).astype(np.int8)
        nodal = _together(s, _Nodal(weight, p, t, f.kappa, status)) if s.points.one_a_node else _at_nodes(s, f, area, status)
        slid = state.contact.time[s.rows], state.contact.path[s.rows], velocity[s.rows]
        if s.points.rule.projected:
            p, t = ((s.points.N * v[s.points.slots]).sum(axis=1) for v in (nodal.pressure, nodal.shear))
        out[s.name] = ContactState(
            surface="+".join(s.description.surface), tool=s.against, body=s.body,
            node=nodes - system.offsets[s.body], X=system.X[nodes], x=x[nodes], gap=pairs.g, pressure=nodal.pressure,
            shear=nodal.shear, slip=nodal.slip, status=nodal.status, weight=nodal.weight,
            force=_on_nodes(system, s, f), pressure_from_stress=from_stress,
            pressure_smoothed=_pressure_of(smooth, nodes, pairs.n),
            error=np.where(nodal.status > 0, np.abs(nodal.pressure - from_stress), 0.0),
            area=float((system.touching(s, where, depth, f.p > 0) if f.stencils.area is None else weight[f.p > 0]).sum()),
            points=PointValues(s.X, s.points.at(x), f.g, p, t, f.kappa, status, weight, state.contact.speed[s.rows], *slid),
            **dict(zip(SLIDING_FIELDS, (_means_at_nodes(s, weight, area, v) for v in slid))),
            speed=_nodal_speed(s, f, state.contact.speed[s.rows]),
        )  # fmt: skip
    return out


def _nodal_speed(s: Surface, f: ContactForces, speed: Array) -> Array:
    """Speed of slip (n,) of the nodes: with the normal forces of the nodes it has the power that the points have."""
    if s.points.one_a_node:
        return speed
    pressing = s.points.to_nodes(f.weight * f.p)
    return np.where(pressing > 0.0, s.points.to_nodes(f.weight * f.p * speed) / np.where(pressing > 0.0, pressing, 1.0), 0.0)


def _now(system: System, s: Surface, f: ContactForces, where: Array, depth: Array | None) -> tuple[Array, Array, Array]:
    """Areas, pressures (k,) and tractions (k,) or (k, 2) of the points of a contact, per area now."""
    if f.stencils.area is not None:
        return f.weight, f.p, _tangential(f.t)
    # The law has pressures per area at the last commit, what is reported is per area now: the force is the same.
    weight = system.weights(s, where, depth)
    return weight, f.p * f.weight / weight, _tangential(f.area[:, None] * f.t / weight[:, None])


def _on_nodes(system: System, s: Surface, f: ContactForces) -> Array:
    """Forces (n, d) of a contact on the nodes of its surface."""
    if f.stencils.area is None:
        return s.points.to_nodes(f.vectors)
    out, own = np.zeros(system.ndof), slice(s.of_master.start)
    scatter_vector(np.ascontiguousarray(f.F[:, own]), np.ascontiguousarray(s.dofs[:, own]), out)
    return np.asarray(system.displacement(out)[s.points.nodes])


class _Nodal(NamedTuple):
    """Results of a contact at its n nodes: areas, pressures, tractions, slips, status."""

    weight: Array
    pressure: Array
    shear: Array
    slip: Array
    status: Bytes


def _together(s: Surface, nodal: _Nodal) -> _Nodal:
    """The values of points as those of their nodes; the two points of a quadratic edge at the axis are reported as one.

    That on the axis has a twelfth of the other's area: what nodal forces of quadratic elements are off by would be ten times the
    share of its pressure that it is of others.
    """
    if not len(pairs := s.points.pairs_at_axis):
        return nodal
    share = nodal.weight[pairs] / nodal.weight[pairs].sum(axis=1, keepdims=True)
    pressure, shear, slip = (v.copy() for v in (nodal.pressure, nodal.shear, nodal.slip))
    for v in (pressure, shear, slip):
        v[pairs] = (share * v[pairs]).sum(axis=1, keepdims=True)
    own = nodal.status[pairs]
    status = nodal.status.copy()
    status[pairs] = np.where((own == 1).any(axis=1), 1, own.max(axis=1))[:, None]
    return _Nodal(nodal.weight, pressure, shear, slip, status)


def _at_nodes(s: Surface, f: ContactForces, area: Array, status: Bytes) -> _Nodal:
    """Nodal forces over tributary areas (n,); a node without area takes the values of its neighbour.

    A node slips when all the closed points that it carries do.
    """
    of = _with_area(area)
    pressure = s.points.to_nodes(f.weight * f.p)[of] / area[of]
    shear = _tangential(s.points.to_nodes(f.area[:, None] * f.t)[of] / area[of, None])
    slip = s.points.to_nodes(f.weight * f.kappa)[of] / s.points.to_nodes(f.weight)[of]
    sticks, closed = s.points.any_at_nodes(status == 1)[of], s.points.any_at_nodes(status > 0)[of]
    return _Nodal(area, pressure, shear, slip, np.where(closed, np.where(sticks, 1, 2), 0).astype(np.int8))


def _means_at_nodes(s: Surface, weight: Array, area: Array, values: Array) -> Array:
    """Values (k,) of points with areas ``weight`` (k,) at the nodes (n,): means, where points are not the nodes."""
    if s.points.one_a_node:
        return values
    of = _with_area(area)
    return np.asarray(s.points.to_nodes(weight * values)[of] / s.points.to_nodes(weight)[of])


def _apart(system: System, s: Surface, state: State, where: Array, depth: Array | None) -> ContactState:
    """A contact whose tool is gone: open everywhere, infinitely far; nothing is recovered without the tool's normal."""
    x, nodes = system.positions(state.u), s.points.nodes
    nothing, unknown, n = np.zeros(len(nodes)), np.full(len(nodes), np.nan), len(s.points)
    slip = state.contact.slip[s.rows]
    weight = area = system.weights(s, where, depth)
    if not s.points.one_a_node:
        area = system.tributary(s, where, depth)
    slid = state.contact.time[s.rows], state.contact.path[s.rows], np.zeros(n)
    slipped, *rest = (_means_at_nodes(s, weight, area, v) for v in (slip, *slid))
    return ContactState(
        surface="+".join(s.description.surface), tool=s.against, body=s.body,
        node=nodes - system.offsets[s.body], X=system.X[nodes], x=x[nodes], gap=np.full(len(nodes), np.inf), pressure=nothing,
        shear=nothing, slip=slipped,
        status=np.zeros(len(nodes), dtype=np.int8), weight=area, force=np.zeros_like(x[nodes]),
        pressure_from_stress=unknown, pressure_smoothed=unknown, error=nothing, area=0.0,
        points=PointValues(s.X, s.points.at(x), np.full(n, np.inf), np.zeros(n), np.zeros(n), slip, np.zeros(n, dtype=np.int8),
                           weight, None, *slid),
        **dict(zip(SLIDING_FIELDS, rest)),
    )  # fmt: skip


def _with_area(area: Array) -> Index:
    """Number (n,) of each surface node, or of the next one along the surface where it has no area."""
    of = np.arange(len(area))
    bare = np.flatnonzero(area <= 1e-12 * area.max())
    of[bare] = np.where(bare + 1 < len(area), bare + 1, bare - 1)
    return of


def _tangential(t: Array) -> Array:
    """Tractions (k,) along the tangent in the plane, their size in space."""
    return t[:, 0] if t.shape[1] == 1 else np.hypot(*t.T)


def _stresses(system: System, state: State, e: Evaluation) -> tuple[Array, Array]:
    """Stresses of the nodes by superconvergent patches, and by extrapolation and means; in space both are the latter."""
    if system.dofs.dimension == 3:
        return (stress_in_space(system, e),) * 2
    return nodal_stress(system, state, e), nodal_stress(system, state, e, smoothed)


def stress_in_space(system: System, e: Evaluation) -> Array:
    """Recovered Cauchy stress (n, 6) xx, yy, zz, xy, yz, xz at the nodes of bricks."""
    out = np.zeros((system.nodes, 6))
    for b, h in zip(system.blocks, e.history):
        stress = b.law.cauchy(b.at_law(h).reshape(-1, b.law.size)).reshape(len(b), -1, 6)
        out[_own(b)] = _in_space(b, stress, h)[:, recovery_in_space.VTK_ORDER]
    return out


def _in_space(b: Block, values: Array, history: Array) -> Array:
    own, yielded = _own(b), np.asarray(_yielded(b, history).any(axis=1)) if b.law.plastic else None
    return recovery_in_space.recover(b.cells - own.start, b.volume, b.element.N, values, yielded)


def _pressure_of(stress: Array, nodes: Index, n: Array) -> Array:
    """−n·σ n (k,) at nodes of stresses (n, 4) xx, yy, zz, xy, in space (n, 6), and unit normals n (k, d)."""
    if n.shape[1] == 3:
        return recovery_in_space.pressure_of(stress[nodes], n)
    xx, yy, _, xy = stress[nodes].T
    return np.asarray(-(xx * n[:, 0] ** 2 + 2 * xy * n[:, 0] * n[:, 1] + yy * n[:, 1] ** 2))


def nodal_stress(system: System, state: State, e: Evaluation, recovery: Recovery | None = None) -> Array:
    """Recovered Cauchy stress (n, 4) xx, yy, zz, xy at the nodes, by superconvergent patches unless said.

    Tractions are left out of it: what comes out where a tool presses is an independent reading of the pressure.
    """
    x = system.positions(state.u) if system.problem.kinematics == "finite" else system.X
    out = np.zeros((system.nodes, 4))
    for b, h in zip(system.blocks, e.history):
        values = b.law.cauchy(b.at_law(h).reshape(-1, b.law.size)).reshape(len(b), -1, 4)
        own = _own(b)
        out[own] = _recovered(x, b, values, h, recovery)
        if recovery is None and b.element.even_along_itself:
            where = x[own], b.cells - own.start, b.positions(x), values
            yielded = np.asarray(_yielded(b, h).any(axis=1)) if b.law.plastic else np.zeros(len(b), dtype=bool)
            poisson = None if system.problem.space == "plane stress" else b.law.nu
            out[own] = with_tractions_of_centres(*where, out[own], yielded, poisson, b.element.weight)
    return out


def skin_stress(system: System, state: State, e: Evaluation, plan: StepPlan) -> Array:
    """As `nodal_stress`, but free of traction at free edges of yielded bodies whose elements do not follow gradients.

    No node of a plastic body has more than the yield stress at its plastic strain, or than points of its elements have.
    """
    out = nodal_stress(system, state, e)
    if system.problem.space != "plane stress":  # there the law knows the pressure
        out = _without_traction(system, state, e, plan, out)
    for b, h in zip(system.blocks, e.history):
        if b.law.plastic:
            own = _own(b)
            out[own] = _capped_at_flow_stress(system, state, b, h, out[own])
    return out


def _capped_at_flow_stress(system: System, state: State, b: Block, history: Array, nodal: Array) -> Array:
    """Stresses (n, 4) of the nodes of a plastic body of which none is more than the flow stress of the metal there.

    Plastic strains begin with a kink, on whose far side patches have too little of them: those carried from the elements
    that a node belongs to count too, if they are larger.
    """
    own, x = _own(b), system.positions(state.u) if system.problem.kinematics == "finite" else system.X
    points = mises_of(b.law.cauchy(b.at_law(history).reshape(-1, b.law.size))).reshape(len(b), -1)
    plastic, cells = b.field(history, "plastic_strain"), b.cells - own.start
    kinked = np.asarray(_yielded(b, history).any(axis=1))
    strain = np.maximum(_recovered(x, b, plastic, history), recover(x[own], cells, b.positions(x), plastic, kinked=kinked))
    law: Any = b.law  # plastic laws have one
    limit = law.flow_stress(np.maximum(strain[:, 0], 0.0))
    # Points may carry more than the curve at rest: rate-dependent metals, and those that yield on the Kirchhoff stress.
    np.maximum.at(limit, cells, points.max(axis=1)[:, None])
    return capped_at_flow_stress(x[own], cells, nodal, limit, system.problem.space == "plane stress")


def _without_traction(system: System, state: State, e: Evaluation, plan: StepPlan, nodal: Array) -> Array:
    """Nodal stresses (n, 4) that are free of traction at free edges of yielded bodies whose elements do not follow gradients."""
    out = nodal.copy()
    x = system.positions(state.u) if system.problem.kinematics == "finite" else system.X
    prescribed = np.zeros(system.ndof, dtype=bool)
    prescribed[np.concatenate([plan.fixed, *(group.dofs for group in plan.released)])] = True
    held, loaded = np.asarray(system.displacement(prescribed).any(axis=-1)), _loaded(system, e)
    for b, h in zip(system.blocks, e.history):
        if b.law.plastic and b.cells.shape[1] == 4 and not b.element.follows_gradients:
            own = _own(b)
            values = b.law.cauchy(b.at_law(h).reshape(-1, b.law.size)).reshape(len(b), -1, 4)
            where = x[own], b.cells - own.start, b.positions(x), values
            revolved = system.problem.space == "axisymmetric"
            out[own] = at_free_edges(*where, out[own], loaded[own], held[own], _yielded(b, h), b.law.nu, revolved)
    return out


def _loaded(system: System, e: Evaluation) -> Flags:
    """Nodes (n,) on which tools, loads or ties act, or the bodies themselves across the axis of symmetry."""
    tied = np.zeros(system.ndof, dtype=bool)
    if system.ties is not None:
        rows, columns = system.ties.matrix.nonzero()
        tied[rows[rows != columns]] = tied[columns[rows != columns]] = True
    out = np.asarray((system.displacement(tied) | (system.displacement(e.f_ext) != 0.0)).any(axis=-1))
    for s, f in zip(system.surfaces, e.contacts):
        points = s.points if f.points is None else f.points
        out[points.nodes] |= points.any_at_nodes(f.p > 0)
        if s.opposite is not None:
            pressed = (f.stencils.coef != 0.0) & (f.p > 0)[:, None]
            out[s.opposite.sides.nodes[pressed]] = True
    if system.problem.space == "axisymmetric":
        out |= system.X[:, 0] <= 1e-9 * system.X[:, 0].max()
    return out


def _yielded(b: Block, history: Array) -> Flags:
    return np.asarray((b.field(history, "plastic_strain") > 0.0).any(axis=2))


def _own(b: Block) -> slice:
    return slice(int(b.cells.min()), int(b.cells.max()) + 1)


def _recovered(x: Array, b: Block, values: Array, history: Array, recovery: Recovery | None = None) -> Array:
    own = _own(b)
    where = x[own], b.cells - own.start, b.positions(x), values
    if recovery is not None:
        return recovery(*where)
    yielded = None
    if b.law.plastic and b.element.follows_gradients:
        yielded = np.asarray(_yielded(b, history).any(axis=1))
    centred = b.cells.shape[1] == 4 and not b.element.follows_gradients
    return recover(*where, kinked=yielded, centred=centred, N=b.element.N)


def body_states(
    system: System, state: State, e: Evaluation, plan: StepPlan, old: Sequence[Array], seconds: float
) -> dict[str, BodyState]:  # fmt: skip
    """Shapes, support reactions and recovered fields of the bodies.

    ``old``: histories before the increment, which lasted so many ``seconds``.
    """
    x = system.positions(state.u)
    where = x if system.problem.kinematics == "finite" else system.X
    flat = system.dofs.dimension == 2
    stress = skin_stress(system, state, e, plan) if flat else stress_in_space(system, e)
    reaction = system.displacement(reactions(system, e, plan, state))
    for _, nodes, force in _along_normals(system, e):
        np.add.at(reaction, nodes, force)
    thickness = system.depth_in(e.history) if system.problem.space == "plane stress" else None
    out = {}
    for number, (b, h) in enumerate(zip(system.blocks, e.history)):
        own = _own(b)
        sig = stress[own]
        plastic, faster = np.zeros(len(sig)), np.zeros(len(sig))
        if b.law.plastic:
            # Of condensed bodies, which are elastic, the histories before would have to be recovered.
            strain, was = (b.field(of, "plastic_strain") for of in (h, old[number]))
            plastic = np.maximum(_at_nodes_of(b, where, strain, h)[:, 0], 0.0)
            if seconds > 0.0:
                faster = np.maximum(_at_nodes_of(b, where, (strain - was) / seconds, h)[:, 0], 0.0)
        out[b.body] = BodyState(
            system.X[own], x[own], b.cells - own.start, reaction[own], sig, mises_of(sig), plastic,
            None if thickness is None else thickness[own],
            nodal_damage(system.problem.bodies[b.body].damage, where, b, state.damage[number], h) if state.damage else {},
            faster, _expansion(system, b, x),
        )  # fmt: skip
    return out


def _at_nodes_of(b: Block, where: Array, values: Array, history: Array) -> Array:
    """Recovered scalars (n, c) of values (m, q, c), in the plane or in space."""
    if where.shape[1] == 3:
        return _in_space(b, values, history)
    nodal = _recovered(where, b, values, history)
    # fitted by the elements of a node alone: others lack at their points what does not vary within them
    return within_elements(b.cells - _own(b).start, b.element.N, values, nodal) if b.element.follows_gradients else nodal


def nodal_damage(
    laws: Sequence[DamageLaw], where: Array, b: Block, damage: Array, history: Array
) -> dict[str, Array]:  # fmt: skip
    """Recovered damage (n,) of the nodes of a body by the name of each law, of D (m, q, laws) at its points."""
    out = {}
    for k, law in enumerate(laws):
        values = _at_nodes_of(b, where, damage[..., k : k + 1], history)[:, 0]
        out[law.name] = values if law.falls else np.maximum(values, 0.0)
    return out


def _expansion(system: System, b: Block, x: Array) -> Array:
    """Surface now over that at the beginning at the nodes of a body, for all nodes at x (n, 2); nan inside."""
    own = _own(b)
    if x.shape[1] == 3:
        return face_expansion(system.X[own], x[own], system.meshes[b.body].boundary)
    edges = boundary_edges(b.cells - own.start)
    return surface_expansion(system.X[own], x[own], edges, system.problem.space == "axisymmetric")


def evaluate(increment: Increment) -> Assembled:
    """Residual, tangent, contact blocks and index maps of an increment that `solve` yielded.

    Raises
    ------
    PrensaError
        If the increment is the initial state or was read back from a folder: its committed state is not at hand.

    """
    take("evaluate", "increment", increment, Increment, "give what solve yields")
    known = increment._known
    if known.assembled is None:
        raise PrensaError(
            "evaluate: this increment was not solved here (it was read back, or is the initial state); solve the case"
        )
    return known.assembled()
