"""Before the solve: when does a moving tool first touch, and where does a pushed tool come to rest against the bodies?"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from prensa.contact.surface import Surface
from prensa.errors import SolveError
from prensa.policy import DEFAULT, Policy
from prensa.system.contacts import were_closed
from prensa.system.interaction import Context
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array


def bisected(below: Callable[[float], bool], lo: float, hi: float) -> tuple[float, float]:
    """Bracket of the argument at which the predicate *below* turns false."""
    for _ in range(60):
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if below(mid) else (lo, mid)
    return lo, hi


def first_touch(
    system: System, state: State, plan: StepPlan, end: float, policy: Policy = DEFAULT
) -> tuple[float, list[str]]:  # fmt: skip
    """End of the increment, brought forward to the time at which a prescribed tool first meets an untouched surface.

    The bodies go on as in the last increments. Returns the time and a message for each tool that touches.
    """
    now = state.clock.time
    notes: list[str] = []
    for s in system.surfaces:
        dof = int(system.master(s).dofs[0])
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
    radius = system.master(s).shape.cylinder
    if radius == np.inf:
        return 1
    dof = int(system.master(s).dofs[0])
    place = dict(zip(plan.moved.tolist(), plan.motion(end).tolist()))
    way = float(np.hypot(place[dof] - state.u[dof], place[dof + 1] - state.u[dof + 1]))
    return min(1 + int(2 * way / radius), most)


class Approach(NamedTuple):
    """Dofs ``u`` (ndof,) to start an increment from, what of the way there went ``through_air`` (ndof,) and what there is to say.

    ``through_air`` is None where no tool was brought anywhere.
    """

    u: Array
    through_air: Array | None
    notes: list[str]


def approach(system: System, c: Context, policy: Policy = DEFAULT) -> Approach:
    """Where to start from: tools driven by force that touch nothing are brought to rest on the penalty springs.

    The springs stand on the bodies as they are, so the start is in equilibrium with the tool's force, or with its moment
    if that is all that drives it. Through air it went to where they bear a millionth of that (`Policy.just_touches_share`).

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
        own = [(i, s) for i, s in enumerate(system.surfaces) if s.against == tool.name]
        if not force.any() or not own or any(were_closed(c.state, s) for _, s in own):
            continue
        touch, _ = _brought_to_rest(system, c, touch, t, policy.just_touches_share * force, own)
        u, way = _brought_to_rest(system, c, u, t, force, own)
        notes.append(f"{tool.name} is driven by force and was not in contact: moved into contact over {way:.4g}")
    return Approach(u, touch - c.state.u if notes else None, notes)


def _brought_to_rest(
    system: System, c: Context, u: Array, t: int, force: Array, own: list[tuple[int, Surface]]
) -> tuple[Array, float]:  # fmt: skip
    """Dofs with tool t moved along its force (as many as motions) until its contacts ``own`` carry that, and how far it moved."""
    dofs, dim = system.dofs.tool.dofs(t), system.dofs.dimension
    size, turns = float(np.linalg.norm(force)), not force[:dim].any()
    direction, origin, v = force / size, u[dofs], u.copy()

    def yields(d: float) -> bool:
        v[dofs] = origin + d * direction
        total = 0.0
        for i, s in own:
            x = system.stencils(s, v)
            p = c.scales[i].k_n * np.maximum(-x.g, 0.0)
            total -= float((c.weights[i] * p * (x.act(x.n)[:, s.of_master] @ direction)).sum())
        return total < size

    far, limit = (1e-6, 2 * np.pi) if turns else (1e-6 * system.length, 100 * system.length)
    while yields(far):
        far *= 2
        if far > limit:
            raise SolveError(_meets_nothing(own[0][1].against, turns, force, direction))
    _, rest = bisected(yields, 0.0, far)
    v[dofs] = origin + rest * direction
    return v, rest


def _meets_nothing(tool: str, turns: bool, force: Array, direction: Array) -> str:
    way = (
        f"is turned {'counter-' if force[2] > 0 else ''}clockwise by a moment"
        if turns
        else f"is pushed along {np.round(direction[:2], 6).tolist()}"
    )
    return (
        f"tool {tool!r} {way} but touches nothing there; check the sign of its {'moment' if turns else 'force'} and where it "
        "is placed"
    )
