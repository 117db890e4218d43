"""Step control: the length of increments (time steps).

That is the first of a step, the next after one that converged or failed, and where they have to end.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from prensa.contact.surface import Surface
from prensa.policy import Policy
from prensa.system.failure import Failure, FreeToMove
from prensa.system.interaction import Context
from prensa.system.schedule import StepPlan
from prensa.system.system import Evaluation, System
from prensa.types import Array


class StepControl:
    """Increments of a step. ``speeds`` (contacts,): of prescribed tools, and of bodies past them, where they bound increments.

    ``times``: ends of the increments, all of them; None: as long as they can be. ``stops``: times at which one ends besides.
    ``second_order``: whether plastic flow is of second order in time, in all of them or only where it is ``steady``.
    ``tolerance``: share of the flow by which first and second order may differ.
    """

    def __init__(
        self, system: System, plan: StepPlan, policy: Policy, times: Array | None = None, stops: Array | None = None,
        second_order: bool = False, steady: bool = False, tolerance: float | None = None,
    ) -> None:  # fmt: skip
        self.second_order, self.steady, self.tolerance = second_order, steady, tolerance
        self.system, self.plan, self.policy, self.times = system, plan, policy, times
        self.stops = [] if stops is None else stops[(stops > plan.t0) & (stops < plan.t1)].tolist()
        self.speeds = self._speeds()

    @property
    def length(self) -> float:
        """Duration of the step."""
        return self.plan.t1 - self.plan.t0

    @property
    def path_independent(self) -> bool:
        """Whether the solution does not depend on the way to it: elastic bodies without friction."""
        return not self.system.has_memory and all(self.system.frictionless(f) for f in self.plan.friction)

    def first(self) -> float:
        """Duration of the first increment."""
        longest = self.longest()
        # Where the way matters a step begins as after a first touch (`_landed`): the work of a long increment would be wrong.
        return longest if self.plan.increments or self.path_independent else min(self.policy.first_share, longest)

    def longest(self, e: Evaluation | None = None, longer: float | None = None) -> float:
        """Duration of an increment at most: that was asked for, or that the tools' travel allows at the state of e.

        No prescribed tool moves more than a share of the contact element size beyond the gap that is left before it, nor a
        body that is pushed or drawn past it; ``longer``: that share over the one of first order in time.
        """
        if self.plan.increments:
            return self.length / self.plan.increments
        limit = self.policy.max_share
        if longer is None:
            longer = self.policy.second_order_factor if self.second_order else 1.0
        travel = longer * self.policy.travel_in_elements
        for number in np.flatnonzero(self.speeds).tolist():
            gap = 0.0 if e is None else max(float(np.nan_to_num(e.contacts[number].g, nan=0.0).min()), 0.0)
            depth = float(self.system.surfaces[number].points.depth.min())
            limit = min(limit, (travel * depth + gap) / float(self.speeds[number]))
        return limit

    def _speeds(self) -> Array:
        """Largest speed (contacts,) of the tool of each; zero where the path does not matter or increments are given."""
        plan, surfaces = self.plan, self.system.surfaces
        if plan.increments or self.path_independent:
            return np.zeros(len(surfaces))
        t = np.linspace(plan.t0, plan.t1, 65)
        path = np.array([plan.motion(ti) for ti in t])
        return np.array([self._speed_between(s, t, path) for s in surfaces])

    def _speed_between(self, s: Surface, t: Array, path: Array) -> float:
        """Largest prescribed speed of the two that meet in a contact; path: prescribed dofs at the times t."""
        if s.opposite is not None:
            return self._speed_of_bodies(s.bodies, t, path)
        return max(self._speed(s, t, path), self._speed_past(s, t, path))

    def _speed_of_bodies(self, bodies: tuple[str, ...], t: Array, path: Array) -> float:
        """Largest speed of what is prescribed of one body past what is prescribed of another, or past its supports."""
        moved, field, most = self.plan.moved, self.system.dofs.displacement, 0.0
        for axis in range(self.system.dofs.dimension):
            ways = []
            for body in bodies:
                nodes = self.system.nodes_of(body)
                own = np.isin(moved, field.first + field.width * nodes + axis)
                ways.append(np.diff(path[:, own], axis=0) if own.any() else np.zeros((len(t) - 1, 1)))
            a, b = ways
            most = max(most, float(np.maximum(a.max(axis=1) - b.min(axis=1), b.max(axis=1) - a.min(axis=1)).max()))
        return most / float(t[1] - t[0])

    def _speed(self, s: Surface, t: Array, path: Array) -> float:
        """Largest speed of the tool of a contact; path: prescribed dofs at the times t.

        A turn moves the tool by its angle times the distance of the farthest contact point from the reference point.
        """
        system, moved = self.system, self.plan.moved
        master = system.tool_masters[s.against]
        arm = system.X[s.points.nodes] - master.at
        first, d, width = int(master.dofs[0]), master.dimension, len(master.dofs)
        reach = np.where(np.arange(width) < d, 1.0, float(np.hypot.reduce(arm, axis=1).max()))
        own = (moved >= first) & (moved < first + width)
        way = reach[moved[own] - first] * np.abs(np.diff(path[:, own], axis=0))
        return float(way.max(initial=0.0)) / (t[1] - t[0])

    def _speed_past(self, s: Surface, t: Array, path: Array) -> float:
        """Largest speed of what is prescribed of the body of a contact past its tool, where the tool's is prescribed too.

        What counts is the motion of one past the other, whichever of them the description has moved.
        """
        system, moved, field = self.system, self.plan.moved, self.system.dofs.displacement
        speed = 0.0
        first = int(system.tool_masters[s.against].dofs[0])
        nodes = system.nodes_of(s.body)
        for axis in range(system.dofs.dimension):
            tool = np.flatnonzero(moved == first + axis)
            own = np.flatnonzero(np.isin(moved, field.first + field.width * nodes + axis))
            if len(tool) and len(own):
                way = np.abs(np.diff(path[:, own] - path[:, tool], axis=0))
                speed = max(speed, float(way.max()) / (t[1] - t[0]))
        return speed

    def end(self, now: float, dt: float, due: float = np.inf) -> float:
        """End of the next increment: now + dt, but never beyond a grid time, a corner of a table, or the step's end.

        ``due``: time at which a mesh is due before that.
        """
        plan = self.plan
        if self.times is not None:
            return float(self.times[self.times > now][0])
        stops = [plan.t1, *plan.corners(), *self.stops, due]
        if plan.increments:
            grid = plan.t0 + np.arange(1, plan.increments + 1) / plan.increments * (plan.t1 - plan.t0)
            stops += grid[grid > now + 1e-9].tolist()[:1]
        # what is left of the step may be a sliver: failures next to its end make increments that short
        stop = min((s for s in stops if s > now + self.policy.min_share_left * self.length), default=plan.t1)
        # no slivers: what is left just beyond the increment is taken along or halved
        left = stop - now
        if dt >= left * (1 - 1e-9):
            return float(stop)
        return now + (0.5 * left if dt > 0.5 * left else dt)

    def cut(self, dt: float) -> float:
        """Duration to try after a failure."""
        # A quarter and not a half: most halves failed too (75 iterations on average became 70 on 100 plastic problems).
        return self.policy.cut_factor * dt

    def comes_free(self, reason: Failure | None, dt: float) -> bool:
        """Whether an increment that failed for want of any hold is so short that the moment of coming free is known."""
        return isinstance(reason, FreeToMove) and dt < self.policy.min_share * self.length

    def exhausted(self, dt: float) -> bool:
        """Whether an increment is so short that time would soon stand still."""
        return dt < self.policy.jump_share_of_step * self.length

    def next(
        self, c: Context, e: Evaluation, grown: Sequence[Array | None], iterations: int, cutbacks: int, unsteady: float = 0.0
    ) -> float:  # fmt: skip
        """Duration of the next increment from what this one cost and did; ``grown``, ``unsteady``: see
        `prensa.system.time_integration`.
        """
        longer = self.policy.second_order_factor if self.second_order else 1.0
        dt = self._next(c, e, grown, iterations, cutbacks, longer)
        if self.steady and (unsteady * dt > self.policy.unsteady_share or _lands(c, e)):
            # Flow that is not steady is integrated to first order, and needs the lengths that this is accurate with (chapter 7).
            dt = self._next(c, e, grown, iterations, cutbacks, 1.0)
        if self.tolerance is not None and not self.plan.increments and unsteady * dt > self.tolerance:
            dt = max(self.tolerance / unsteady, self.policy.min_plastic_shortening * c.dt, min(dt, self.policy.min_share
                * self.length))
        return min(dt, self._landed(c)) if c.touches else dt

    def _landed(self, c: Context) -> float:
        """Duration at most of the increment after one that ends where a tool meets a body: metals begin there as in a new step.

        Where a side lies flat on a tool the force is that of yield after a small part of a usual increment, and the work that is
        done, by the trapezoid of the forces at both ends, has half of it.
        """
        if self.plan.increments or not any(b.law.plastic for b in self.system.blocks):
            return np.inf
        return self.policy.first_share * (self.plan.t1 - c.time)

    def _next(
        self, c: Context, e: Evaluation, grown: Sequence[Array | None], iterations: int, cutbacks: int, longer: float
    ) -> float:  # fmt: skip
        """As `next`, without a look at how steadily bodies flow; ``longer``: lengths over those of first order in time."""
        policy, longest = self.policy, self.longest(e, longer)
        full = longest
        tried = c.dt if cutbacks else max(c.dt, c.state.clock.dt)
        if self.plan.increments:
            growth = policy.recovery_factor if iterations <= policy.recover_iterations and not cutbacks else 1.0
        else:
            growth = self._growth(iterations, cutbacks)
            strain = self._strain(grown, longer * policy.plastic_strain_increment * tried / full)
            if strain > 0:
                full = min(full, tried * max(longer * policy.plastic_strain_increment / strain, policy.min_plastic_shortening))
        # shorter increments are easier or better up to a point; beyond, they would not end
        least = min(policy.min_share * self.length, longest)
        if 0 < tried < least:
            return min(least, (1.0 if cutbacks else policy.recovery_factor) * tried)
        return max(min(full, growth * (tried if tried > 0 else full)), least)

    def _growth(self, iterations: int, cutbacks: int) -> float:
        """Growth of automatic increments by the iterations that the last one took."""
        policy = self.policy
        if iterations <= policy.easy_iterations and not cutbacks:
            return policy.growth_factor
        return 1.0 if iterations <= policy.hard_iterations else policy.shrink_factor

    def _strain(self, grown: Sequence[Array | None], allowed: float) -> float:
        """Growth of equivalent plastic strain that most points of every body stay below, 0 if no more than is ``allowed``."""
        return max((self._most_stay_below(growth, allowed) for growth in grown if growth is not None), default=0.0)

    def _most_stay_below(self, growth: Array, allowed: float) -> float:
        """What most of some growths stay below, 0 if that is no more than is ``allowed``: most increments need no sorting."""
        # A quantile and not the largest: points at singular corners would rule the length of all increments.
        share, last = self.policy.plastic_quantile, growth.size - 1
        if np.count_nonzero(growth <= allowed) > np.ceil(share * last):
            return 0.0
        return float(np.quantile(growth, share))


def _lands(c: Context, e: Evaluation) -> bool:
    """Whether some contact point closed in an increment: the flow behind it turned at once, so its change says little."""
    return any(((f.p > 0) & ~was.closed).any() for f, was in zip(e.contacts, c.committed))
