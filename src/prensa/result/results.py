"""Results of a committed increment: tool forces, contact states, recovered fields. Computed when asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from prensa.contact.forces import ContactForces
from prensa.contact.recovery import at_free_edges, borne, mises_of, recover, smoothed, with_tractions_of_centres
from prensa.contact.surface import Surface
from prensa.errors import PrensaError, take
from prensa.model.problem import support_names
from prensa.model.seconds import elapsed
from prensa.result.assembled import Assembled, assembled
from prensa.result.increment import (
    FORCE_IN,
    PLACE,
    REACTION,
    BodyState,
    ContactState,
    Force,
    Increment,
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
        spent, cutbacks, result.residual, result.augmentations, tuple(result.residuals), tuple(result.changes)
    )
    # Of condensed bodies the displacements away from contact are found when somebody asks for them.
    recover, lam = result.recover, result.lam

    @cache
    def whole() -> State:
        return state if recover is None else replace(state, u=recover())

    return Increment(
        plan.name, plan.number + 1, state.clock.number, state.clock.time, tool_states(system, state, e),
        state.energy._asdict(), support_forces(system, e, plan, state), statistics, ended,
        whole, lambda: contact_states(system, whole(), e, plan), lambda: body_states(system, whole(), e, plan),
        remeshings=0 if state.remeshed is None else state.remeshed.count,
        seconds=elapsed(system.problem, state.clock.time, state.ends),
        _more=More(system.problem, parse, lambda: shapes(system, whole(), start),
                   lambda: plastic_power(system, old, state.history, seconds),
                   None if context is None else lambda: assembled(system, context, whole().u, lam)),
    )  # fmt: skip


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
    return {name: REACTION[system.dofs.dimension](*v) for name, v in total.items()}


def tool_states(system: System, state: State, e: Evaluation) -> dict[str, ToolState]:
    """Places and forces of the tools."""
    force = tool_forces(system, e)
    out = {}
    for t, tool in enumerate(system.tools):
        mounted = getattr(tool.description, "spring", None)
        spring = None
        if mounted is not None:
            given = [getattr(mounted, key) is not None for key in ("x", "y", "rz")]
            spring = Force(*(float(v) if g else 0.0 for v, g in zip(system.place_of(t, e.f_ext), given)))
        out[tool.name] = ToolState(
            tool.at,
            PLACE[system.dofs.dimension](*map(float, system.place_of(t, state.u))),
            force[tool.name],
            tuple(map(float, tool.direction)),
            spring,
            float(state.tool_work[t]) if t < len(state.tool_work) else 0.0,
        )
    return out


def contact_states(system: System, state: State, e: Evaluation, plan: StepPlan) -> dict[str, ContactState]:
    """Contact results along each surface; pressures are those of points that are the nodes, else nodal forces over areas.

    Closed points slip in a step without friction; with friction those whose traction is on its bound.
    """
    x = system.positions(state.u)
    finite = system.problem.kinematics == "finite"
    where, depth = (x, system.depth_in(e.history)) if finite else (system.X, system.depth)
    flat = system.dofs.dimension == 2  # stresses are not recovered in space yet
    patches, smooth = (nodal_stress(system, state, e, how) if flat else None for how in (None, smoothed))
    out = {s.name: _apart(system, s, state, where, depth) for s in system.removed}
    for s, f, law in zip(system.surfaces_at(state.clock.time), e.contacts, plan.friction_at(state.clock.time)):
        # Where a sharp corner cuts edges the points are others in each increment.
        s = s if f.points is None else replace(s, points=f.points, X=f.points.at(system.X))
        nodes, pairs = s.points.nodes, system.nodes_seen(s, state.u)
        area, (weight, p, t) = system.tributary(s, where, depth), _now(system, s, f, where, depth)
        from_stress = _pressure_of(patches, nodes, pairs.n)
        slides = f.slip | system.frictionless(law)
        status = np.where(f.p > 0, np.where(slides, 2, 1), 0).astype(np.int8)
        nodal = _together(s, _Nodal(weight, p, t, f.kappa, status)) if s.points.one_a_node else _at_nodes(s, f, area, status)
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
            points=PointValues(s.X, s.points.at(x), f.g, p, t, f.kappa, status, weight, state.contact.speed[s.rows]),
        )  # fmt: skip
    return out


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


def _apart(system: System, s: Surface, state: State, where: Array, depth: Array | None) -> ContactState:
    """A contact whose tool is gone: open everywhere, infinitely far; nothing is recovered without the tool's normal."""
    x, nodes = system.positions(state.u), s.points.nodes
    nothing, unknown, n = np.zeros(len(nodes)), np.full(len(nodes), np.nan), len(s.points)
    slip = state.contact.slip[s.rows]
    weight = area = system.weights(s, where, depth)
    slipped = slip
    if not s.points.one_a_node:
        area = system.tributary(s, where, depth)
        of = _with_area(area)
        slipped = s.points.to_nodes(weight * slip)[of] / s.points.to_nodes(weight)[of]
    return ContactState(
        surface="+".join(s.description.surface), tool=s.against, body=s.body,
        node=nodes - system.offsets[s.body], X=system.X[nodes], x=x[nodes], gap=np.full(len(nodes), np.inf), pressure=nothing,
        shear=nothing, slip=slipped,
        status=np.zeros(len(nodes), dtype=np.int8), weight=area, force=np.zeros((len(nodes), 2)),
        pressure_from_stress=unknown, pressure_smoothed=unknown, error=nothing, area=0.0,
        points=PointValues(s.X, s.points.at(x), np.full(n, np.inf), np.zeros(n), np.zeros(n), slip, np.zeros(n, dtype=np.int8),
                           weight),
    )  # fmt: skip


def _with_area(area: Array) -> Index:
    """Number (n,) of each surface node, or of the next one along the surface where it has no area."""
    of = np.arange(len(area))
    bare = np.flatnonzero(area <= 1e-12 * area.max())
    of[bare] = np.where(bare + 1 < len(area), bare + 1, bare - 1)
    return of


def _tangential(t: Array) -> Array:
    """Tractions (k,) along the tangent in the plane, (k, 2) along both in space."""
    return t[:, 0] if t.shape[1] == 1 else t


def _pressure_of(stress: Array | None, nodes: Index, n: Array) -> Array:
    """−n·σ n (k,) at nodes of stresses (n, 4) xx, yy, zz, xy, and unit normals n (k, 2); not a number without stresses."""
    if stress is None:
        return np.full(len(nodes), np.nan)
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
            out[own] = _borne(system, state, b, h, out[own])
    return out


def _borne(system: System, state: State, b: Block, history: Array, nodal: Array) -> Array:
    """Stresses (n, 4) of the nodes of a plastic body of which none is more than metal there bears.

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
    # Points may bear more than the curve at rest: rate-dependent metals, and those that yield on the Kirchhoff stress.
    np.maximum.at(limit, cells, points.max(axis=1)[:, None])
    return borne(x[own], cells, nodal, limit, system.problem.space == "plane stress")


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


def body_states(system: System, state: State, e: Evaluation, plan: StepPlan) -> dict[str, BodyState]:
    """Shapes, support reactions and recovered fields of the bodies; in space the fields are not recovered (not a number)."""
    x = system.positions(state.u)
    where = x if system.problem.kinematics == "finite" else system.X
    flat = system.dofs.dimension == 2
    stress = skin_stress(system, state, e, plan) if flat else np.full((system.nodes, 4), np.nan)
    reaction = system.displacement(reactions(system, e, plan, state))
    thickness = system.depth_in(e.history) if system.problem.space == "plane stress" else None
    out = {}
    for b, h in zip(system.blocks, e.history):
        own = _own(b)
        sig = stress[own]
        plastic = np.zeros(len(sig))
        if b.law.plastic and flat:
            plastic = np.maximum(_recovered(where, b, b.field(h, "plastic_strain"), h)[:, 0], 0.0)
        out[b.body] = BodyState(
            system.X[own], x[own], b.cells - own.start, reaction[own], sig, mises_of(sig), plastic,
            None if thickness is None else thickness[own],
        )  # fmt: skip
    return out


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
