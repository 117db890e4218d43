"""Before anything deforms: where rigid tools and bodies are when contact first carries the load.

The deformable solve needs a configuration in which contact can carry the forces. A tool that only a force drives has no place,
and a body that nothing holds yet (a billet with room to the die under it, a sheet between binder and die) has no stiffness that
says where it is: both would fly off. So tools and bodies go there as rigid ones, without friction:

- *first touch*: an increment in which a moved tool first meets a surface ends there;
- *approach of tools*: one that a force drives and that touches nothing goes along it to where its contacts carry the force;
- *approach of bodies*: those that nothing holds go with the tools that touch them, until others stop them;
- *initial overlap*: tools that start inside a body are drawn back to where they touch, and go in again in stages, none of which
  is committed: history and friction see the increment as a whole. Cutting it would not change the overlap at its start.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prensa.contact.surface import Surface
from prensa.errors import SolveError
from prensa.linear.rigid_modes import Loose
from prensa.policy import DEFAULT, Policy
from prensa.solver.rigid_balance import RigidBalance, bisected
from prensa.system.contacts import were_closed
from prensa.system.failure import StartsInside
from prensa.system.interaction import Context
from prensa.system.schedule import Prescribed, StepPlan
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array


class Approach(NamedTuple):
    """Dofs ``u`` (ndof,) to start an increment from; None where bodies have nowhere to go.

    ``through_air`` (ndof,): the part of the motion before first touch, which does no work and is no slip; None if nothing was
    brought there by forces. ``bodies`` that went as rigid ones; ``floating``: no second tool clamps them yet. ``notes``: what
    there is to say.
    """

    u: Array | None
    through_air: Array | None = None
    bodies: Sequence[str] = ()
    floating: bool = False
    notes: Sequence[str] = ()


# ------------------------------------------------------------------------------------------------ first touch


def first_touch(
    system: System, state: State, plan: StepPlan, end: float, policy: Policy = DEFAULT
) -> tuple[float, list[str]]:  # fmt: skip
    """End of the increment, brought forward to the time at which a prescribed tool first meets an untouched surface.

    The bodies go on as in the last increments. Returns the time and a message for each tool that touches.
    """
    now = state.clock.time
    notes: list[str] = []
    for s in system.tool_contacts:
        dof = int(system.tool_masters[s.against].dofs[0])
        if were_closed(state, s) or not np.isin(dof + np.arange(system.dofs.dimension), plan.moved).all():
            continue

        def apart(t: float, s: Surface = s) -> bool:
            u = state.u + state.extrapolated(t - now) if state.dt_last > 0 else state.u.copy()
            u[plan.moved] = plan.motion(t)
            return float(system.stencils(s, u).g.min()) > 0

        if not apart(now):
            continue
        # a cylinder may be apart again at the end, on the far side
        times = np.linspace(now, end, _looks(system, s, state, plan, end, policy.max_touch_samples) + 1)
        met = next((i for i, t in enumerate(times[1:]) if not apart(float(t))), None)
        if met is None:
            continue
        touch, _ = bisected(apart, float(times[met]), float(times[met + 1]))
        # a touch at the very end, of the step say, needs no increment of its own after it
        if touch - now > policy.min_share_before_touch * (end - now) and end - touch > policy.min_share_left * (plan.t1
            - plan.t0):
            notes = [f"{s.against} first touches {'+'.join(s.description.surface)} at time {touch:.6g}"]
            end = touch
    return end, notes


def _looks(system: System, s: Surface, state: State, plan: StepPlan, end: float, most: int) -> int:
    """How often to look for a touch before *end*: a cylinder at every half radius of its way."""
    radius = system.tool_masters[s.against].shape.cylinder
    if radius == np.inf:
        return 1
    dof = int(system.tool_masters[s.against].dofs[0])
    place = dict(zip(plan.moved.tolist(), plan.motion(end).tolist()))
    way = float(np.hypot.reduce([place[k] - state.u[k] for k in range(dof, dof + system.dofs.dimension)]))
    return min(1 + int(2 * way / radius), most)


# ------------------------------------------------------------------------------------------------ tools driven by force


def approach_of_tools(system: System, c: Context, policy: Policy = DEFAULT) -> Approach:
    """Where to start from: tools driven by force that touch nothing are brought to rest on the springs of their contacts.

    The springs stand on the bodies as they are, so the start is in equilibrium with the tool's force, or with its moment
    if that is all that drives it. The motion up to where they carry 1e-6 of the force counts as motion through air
    (`Policy.just_touches_share`).

    Raises
    ------
    SolveError
        If such a tool meets nothing in the direction of its force.

    """
    u, touch = c.state.u, c.state.u
    notes = []
    for t, tool in enumerate(system.tools):
        dofs, d = system.dofs.tool.dofs(t), system.dofs.dimension
        led = None if c.plan.control is None else c.plan.control.control_dof
        force = np.array([c.plan.push[k](c.time) if k in c.plan.push and k != led else 0.0 for k in dofs.tolist()])
        if c.state.release is not None:
            force += c.plan.left(c.time) * c.state.release[dofs]
        force[d:] *= not force[:d].any()
        own = [i for i, s in enumerate(system.surfaces) if s.against == tool.name]
        if not force.any() or not own or any(were_closed(c.state, system.surfaces[i]) for i in own):
            continue
        rests = []
        # The way through air does no work: its end is where the springs just carry something, not where they carry all.
        for base, share in ((touch, policy.just_touches_share), (u, 1.0)):
            rigid = RigidBalance.of_tool(system, c, base, dofs, share * force, own)
            z = rigid.balanced(policy)
            if z is None:
                raise SolveError(_meets_nothing(tool.name, force, d))
            rests.append(rigid.dofs(z))
        notes.append(
            f"{tool.name} is driven by force and was not in contact: moved into contact over "
            f"{np.linalg.norm((rests[1] - u)[dofs]):.4g}"
        )
        touch, u = rests
    return Approach(u, touch - c.state.u if notes else None, notes=notes)


def _meets_nothing(tool: str, force: Array, dimension: int) -> str:
    turns = not force[:dimension].any()
    way = f"is pushed along {np.round(force[:dimension] / np.linalg.norm(force), 6).tolist()}"
    if turns and dimension == 2:
        way = f"is turned {'counter-' if force[2] > 0 else ''}clockwise by a moment"
    elif turns:
        way = f"is turned by a moment about {np.round(force[dimension:] / np.linalg.norm(force), 6).tolist()}"
    return (
        f"tool {tool!r} {way} but touches nothing there; check the sign of its {'moment' if turns else 'force'} and where it "
        "is placed"
    )


# ------------------------------------------------------------------------------------------------ bodies that nothing holds


def approach_of_bodies(system: System, c: Context, loose: list[Loose], policy: Policy = DEFAULT) -> Approach | None:
    """Where the bodies that nothing holds go in an increment; None if there are none, or what happens to them is not known.

    loose: bodies that supports leave free to move (see `loose_bodies`). Bodies already pressed by a tool count as held. A body
    that also touches a second tool is held there by friction, which rigid motion without friction cannot represent: None.
    """
    unheld = [] if c.plan.control is not None else [body for body in loose if not _pressed(system, c, body, policy)]
    if not unheld:
        return None
    names, clear = [name for b in unheld for name in b.bodies], policy.approach_gap_ratio * system.length
    tools = np.array(sorted(_brought(system, c)), dtype=np.int64)
    rigid = RigidBalance.of_bodies(system, c, unheld, tools, clear)
    before = [float(system.stencils(s, rigid.base).g.min()) if s.acts_on(names) else np.inf for s in c.surfaces]
    if not rigid.room:
        z = rigid.balanced(policy)
        u = None if z is None else rigid.dofs(z)
        if u is None or not _near(system, c, unheld, u, policy):
            return None
        brought = any(float(system.stencils(s, u).g.min()) < 0.0 and g > 0.1 * clear for s, g in zip(c.surfaces, before))
        return Approach(u, rigid.through_air(policy), names) if brought else None
    rigid.pushers = [i for i, g in enumerate(before) if g < -0.1 * clear]
    if not rigid.pushers:
        # contacts that were closed and press no more are a lost support, which the acceptance reports
        held = any(were_closed(c.state, s) for s in c.surfaces if s.acts_on(names))
        return None if held else Approach(None, None, names, floating=True)
    z = rigid.balanced(policy) if all(abs(g) > 0.1 * clear for g in before) else None
    u = None if z is None else rigid.dofs(z)
    if u is None or not _near(system, c, unheld, u, policy):
        return None
    stops = [s for i, s in enumerate(c.surfaces) if s.acts_on(names) and i not in rigid.pushers]
    return Approach(u, None, names, floating=all(float(system.stencils(s, u).g.min()) > -clear for s in stops))


class Met(NamedTuple):
    """When bodies that approach as rigid bodies first meet what stops them, and where they are then."""

    time: float
    there: Approach


def first_clamped(system: System, c: Context, loose: list[Loose], policy: Policy = DEFAULT) -> Met | None:
    """When the bodies that are clamped at the end of an increment are so first; None if that is no earlier, or at once.

    None in steps with tool forces: they clamp bodies at once.
    """
    if c.plan.push:
        return None
    now, end, length = c.state.clock.time, c.time, c.plan.t1 - c.plan.t0

    def at(t: float) -> Approach | None:
        then = replace(c, time=t, now=c.now + (t - c.time) * c.plan.seconds)
        return approach_of_bodies(system, then, loose, policy)

    _, time = bisected(lambda t: (to := at(t)) is None or to.floating, now, end)
    there = at(time)
    apart = time - now > policy.min_share_before_touch * (end - now) and end - time > policy.min_share_left * length
    return Met(time, there) if apart and there is not None and there.u is not None else None


def _near(system: System, c: Context, loose: list[Loose], u: Array, policy: Policy) -> bool:
    """Whether bodies moved not more than ten times the largest tool motion (rotation makes levers): none was squeezed out."""
    way = u - c.state.u
    tools = np.abs(system.dofs.tool.of(way)[:, : system.dofs.dimension]).max()
    return all(np.abs(system.displacement(way)[b.nodes]).max() <= policy.max_approach_ratio * tools for b in loose)


def _pressed(system: System, c: Context, body: Loose, policy: Policy) -> bool:
    """Whether tools or bodies press a body in the committed state, by more than what rounded positions make of the springs."""
    nothing = policy.approach_depth_ratio * system.length
    own = [(s, scale) for s, scale in zip(c.surfaces, c.scales) if s.acts_on(body.bodies)]
    return any((c.state.lam[s.rows, 0] > nothing * scale.k_n).any() for s, scale in own)


def _brought(system: System, c: Context) -> Iterator[int]:
    """Degrees of freedom along which tools are pushed that touched nothing."""
    for master in system.tool_masters.values():
        own = system.against(master.name)
        if own and not any(were_closed(c.state, s) for s in own):
            yield from (dof for dof in master.dofs[: master.dimension].tolist() if dof in c.plan.push)


# ------------------------------------------------------------------------------------------------ initial overlap


def starts_inside(system: System, state: State, policy: Policy) -> list[tuple[StartsInside, Array]]:
    """Tools that lie inside bodies when a run begins: what there is to say, and the way out (d,)."""
    found: dict[str, tuple[StartsInside, Array]] = {}
    if state.clock.number:
        return []
    for s in system.surfaces_at(state.clock.time):  # of overlaps that are meant there is nothing yet
        if s.opposite is not None:
            continue
        if were_closed(state, s):
            continue
        pairs = system.nodes_seen(s, state.u)
        k, depth = int(np.argmin(pairs.g)), float(s.points.depth.min())
        deep = -float(pairs.g[k])
        if deep > policy.overlap_ratio * depth and (s.against not in found or deep > found[s.against][0].depth):
            surface = "+".join(s.description.surface)
            found[s.against] = StartsInside(s.against, surface, deep, deep / depth), pairs.g[k] * pairs.n[k]
    return list(found.values())


def overlap_stages(system: System, c: Context, policy: Policy) -> list[Context]:
    """Contexts of an increment with the tools that start inside a body drawn back, less in each stage.

    An empty list if no tool starts inside.
    """
    inside = starts_inside(system, c.state, policy)
    if not inside:
        return []
    fixed, values = c.plan.fixed, c.plan.values(c.time)
    back = np.zeros(system.ndof)
    for reason, way in inside:
        back[system.tool_masters[reason.tool].dofs[: len(way)]] = way
    count = int(np.ceil(max(reason.elements for reason, _ in inside) / policy.overlap_stage_ratio))
    return [
        replace(c, plan=replace(c.plan, groups=[Prescribed(fixed, values + (1.0 - share) * back[fixed])]))
        for share in np.linspace(0.0, 1.0, count + 1)[1:-1]
    ]
