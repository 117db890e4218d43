"""Derivatives of the increments of a run, one after the other: by closed forms where they are known, by differences elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from prensa.contact.point import TOUCH
from prensa.contact.record import magnitude
from prensa.errors import PrensaError
from prensa.linear.reduction import Reduced, weights_of
from prensa.measures import parse
from prensa.measures.measure import Measure
from prensa.model import problem as model
from prensa.policy import Policy
from prensa.result.increment import Derivatives, Increment, Observable
from prensa.sensitivity.closed import Beside, Bundle, Closed, covers, differentiate
from prensa.sensitivity.direct import Columns, Direction, Neighbour, Solution
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.state import State
from prensa.system.system import System
from prensa.types import Array

ON_BOUND = 1e-9  # share of the bound of friction within which a traction lies on it


@dataclass(frozen=True)
class _Derivatives(Derivatives):
    """See `Derivatives`: central differences of any observable between neighbours that are linear in the parameter."""

    neighbours: Mapping[str, tuple[Beside | Neighbour, Beside | Neighbour]]
    before: State
    extrapolated_from: Mapping[str, Mapping[str, Array]]
    """By path: the derivatives that belong to the state ``before``."""
    state: State
    ended: bool
    measures: dict[str, Measure]
    """Those that have been asked for in the run, by their texts."""

    _made: dict[str, tuple[Increment, Increment]] = field(default_factory=dict)

    def measure(self, name: str, problem: model.Problem) -> Measure:
        """See `Derivatives`."""
        if name not in self.measures:
            self.measures[name] = parse(name, problem)
        return self.measures[name]

    def _increments(self, path: str) -> tuple[Increment, Increment]:
        """Neighbouring increments by a parameter, made when first asked for."""
        if path not in self._made:
            both = []
            for side, sign in zip(self.neighbours[path], (1.0, -1.0)):
                step = sign * side.step
                before = self.before.moved(self.extrapolated_from[path], step)
                state = self.state.moved(self.state.derivatives[path], step)
                both.append(side.increment(before, state, self.ended))
            self._made[path] = both[0], both[1]
        return self._made[path]

    def of(self, observable: Observable | Callable[[Increment], float], increment: Increment) -> dict[str, float]:
        """See `Derivatives`."""
        slope = observable.gradient(increment) if isinstance(observable, Measure) else None
        value = observable.value if isinstance(observable, Observable) else observable
        out = {}
        for path, beside in self.neighbours.items():
            known = None if slope is None else beside[0].slope(slope)
            if known is None:
                a, b = self._increments(path)
                known = (float(value(a)) - float(value(b))) / (2.0 * beside[0].step)
            out[path] = known
        return out


class Derived(NamedTuple):
    """What is found of an increment: its derivatives, and ``doubts`` of them in words."""

    derivatives: _Derivatives
    doubts: list[str]

    @property
    def state(self) -> State:
        """The committed state with its derivatives."""
        return self.derivatives.state

    def of(self, increment: Increment) -> Increment:
        """The increment with its derivatives."""
        return replace(increment, derivatives=self.derivatives, _state=lambda: self.state)


class Differentiation:
    """Derivatives of a run's increments by parameters, and what is carried of them from one increment to the next."""

    def __init__(self, system: System, policy: Policy, directions: Sequence[Direction]) -> None:
        self.system, self.policy, self.directions = system, policy, directions
        self.reduced: Reduced | None = None  # the equations that the last increment solved
        self.bundle: Bundle | None = None
        self.mixtures: dict[tuple[str, ...], Direction | None] = {}
        self.finer: dict[tuple[str, float], Direction] = {}
        self.reported: set[str] = set()
        self.doubts: list[str] = []
        self.largest = 0.0  # of the forces of all increments: where a body has been released, those of its own are round-off
        self.weight = weights_of(system)
        self.measures: dict[str, Measure] = {}

    def of(self, c: Context, result: NewtonResult, state: State, reduced: Reduced) -> Derived:
        """The derivatives of an increment that led to a ``state``, with the equations that it solved and their last factors.

        Raises
        ------
        PrensaError
            If the residual beside the solution cannot be evaluated.

        """
        self.reduced, self.doubts, extrapolated_from = reduced, [], self._carried()
        assert result.evaluation is not None
        self.largest = max(self.largest, result.evaluation.scale)
        neighbours, flat = self.differentiate(c, result, state)
        state = replace(state, derivatives=self._carried())
        counts = self._switched(c, result), self._at_kinks(c, result)
        found = _Derivatives(flat, *counts, neighbours, c.state, extrapolated_from, state, c.ends_step, self.measures)
        return Derived(found, self.doubts)

    def _carried(self) -> dict[str, Mapping[str, Array]]:
        return {d.parameter.path: d.carried for d in self.directions}

    def differentiate(
        self, c: Context, result: NewtonResult, state: State
    ) -> tuple[dict[str, tuple[Beside | Neighbour, Beside | Neighbour]], dict[str, float]]:
        """Both neighbours of an increment by each parameter, and what is left of its residual along them.

        Raises
        ------
        PrensaError
            If the residual beside the solution cannot be evaluated.

        """
        assert self.reduced is not None
        assert result.evaluation is not None
        picard_friction, c, system = c.picard_friction, replace(c, picard_friction=False) if c.picard_friction else c, self.system
        at = Solution(system, c, result.u, result.evaluation)
        # Newton's last matrix has its own branches; where it is for corrections, its values may be those of the free dofs alone
        if at.e.data is None or picard_friction or self.reduced.factorisation.follows:
            at.e = system.evaluate(c, result.u, system.initial_multipliers(c.state), active_sets=at.active_sets)
        columns = Columns(self.reduced, at.e, system.pattern)
        known = [d for d in self.directions if d.is_known(c)] if covers(c) else []
        known.sort(key=lambda d: d.change is not None and d.change.X is not None)  # those that move bodies go last
        found = self._by_closed_forms(at, columns, known, state)
        for d in self.directions:
            if d.parameter.path not in found:
                found[d.parameter.path] = self._by_differences(at, columns, d, result, state)
        paths = [d.parameter.path for d in self.directions]
        return {p: found[p][0] for p in paths}, {p: found[p][1] for p in paths}

    def _by_closed_forms(self, at: Solution, columns: Columns, known: Sequence[Direction], state: State) -> dict[str, Any]:
        """Neighbours and what is left along the parameters whose derivatives are known in closed form."""
        if not known:
            return {}
        bundle = self.bundle
        if bundle is None or not bundle.is_of(known):
            bundle = Bundle.of(known)
        self.bundle, found = differentiate(at, columns, bundle, state)
        assert self.reduced is not None
        # The residual itself is asked where it pays: once when the closed forms are first used, and where users read results.
        checks, beside = at.c.ends_step or at.c.state.clock.number == 0, {}
        checked = self._checked_by_residuals(at, bundle, found) if checks else np.zeros(len(known))
        unmet = np.sum([p.unmet() for p in found.points], axis=0) if found.points else np.zeros(len(known))
        left = np.maximum(self.reduced.weight @ np.abs(self.reduced.restriction.part(found.reaction)), checked) + unmet
        for k, (d, rest) in enumerate(zip(known, left)):
            both = tuple(Beside(system, d, sign, k, at, found) for sign, system, _ in d.sides)
            beside[d.parameter.path] = both, self._verified(at, d, rest, found.reaction[:, k])
        self.bundle.hand_on()
        return beside

    def _checked_by_residuals(self, at: Solution, before: Bundle, found: Closed) -> Array:
        """Norms (d,) of what the residual itself does along closed derivatives: of their forms it knows nothing.

        Along a mixture of all of them: two residuals show that none is wrong. Where one is, each is looked at.
        """
        assert self.reduced is not None
        known, sizes = before.directions, before.sizes
        shares: Array = 0.5 + 0.5 * np.fmod(0.618034 * np.arange(len(known)), 1.0)  # no two alike, so that errors do not cancel
        mixed = self._mixed(known, shares) if len(known) > 1 else None
        if mixed is not None:
            mixed.carried = before.mixed(shares * sizes)
            rest = self.reduced.norm(mixed.rest(at, found.x @ (shares * sizes)))
            # Two residuals clear all parameters at once; only where they do not is each looked at alone.
            if rest <= 0.5 * self._allowed_residual(at, mixed):
                return rest / sizes
        return np.array([self._residual_along(at, d, x) for d, x in zip(known, found.x.T)])

    def _residual_along(self, at: Solution, d: Direction, x: Array) -> float:
        """Norm of what the residual does along a derivative x (ndof,), with finer steps where there is too much."""
        assert self.reduced is not None
        rest = self.reduced.norm(d.rest(at, x))
        for share in self.policy.finer_step_ratios:
            if rest <= self._allowed_residual(at, d):
                break
            rest = min(rest, self.reduced.norm(self._with_steps(d, share, d.carried).rest(at, x)))
        return rest

    def _with_steps(self, d: Direction, share: float, carried: Mapping[str, Array]) -> Direction:
        """The parameter with steps of another share of its size, carrying the same."""
        path = d.parameter.path
        if (path, share) not in self.finer:
            self.finer[path, share] = Direction.of(self.system, path, share, self.policy, self.system.initial())
        out = self.finer[path, share]
        out.carried = carried
        return out

    def _mixed(self, known: Sequence[Direction], shares: Array) -> Direction | None:
        """The direction in which all parameters change by shares (d,) of their sizes; None if they cannot together."""
        paths = tuple(d.parameter.path for d in known)
        if paths not in self.mixtures:
            try:
                made = Direction.together(self.system, [d.parameter for d in known], shares, self.policy)
            except PrensaError:
                made = None
            self.mixtures[paths] = made
        return self.mixtures[paths]

    def _by_differences(self, at: Solution, columns: Columns, d: Direction, result: NewtonResult, state: State) -> Any:
        """The same along a parameter for which differences are taken, with finer steps where too much of the residual is left."""
        carried, taken = d.carried, d
        # Not with finer steps for all: their round-off leaves 10 to 50 times more along tools' shapes with exact contacts.
        neighbours, rest, reaction = self._differences(at, columns, d, result, state)
        for share in self.policy.finer_step_ratios:
            if rest <= self._allowed_residual(at, taken):
                break
            finer = self._with_steps(d, share, carried)
            found = self._differences(at, columns, finer, result, state)
            if found[1] < rest:
                (neighbours, rest, reaction), taken = found, finer
        if neighbours is None:
            raise PrensaError(f"derivatives: the perturbed increment, with another {d.parameter.path}, cannot be evaluated")
        d.carried = taken.carried
        return neighbours, self._verified(at, taken, rest, reaction)

    def _differences(
        self, at: Solution, columns: Columns, d: Direction, result: NewtonResult, state: State
    ) -> tuple[tuple[Neighbour, Neighbour] | None, float, Array]:
        """The neighbours along a parameter, which carries their difference on, the norm of what is left between them, ∂r + K x.

        None and infinity where the increment beside cannot be evaluated.
        """
        assert self.reduced is not None
        sides = d.at_fixed_dofs(at)
        if any(side.e.failed for side in sides):
            return None, np.inf, np.zeros(self.system.ndof)
        dr, given = d.equation(at, sides)
        size, r = d.parameter.size, dr[:, None] + columns.times(given[:, None])
        left = -size * r
        x = columns.initial_guess(left, d.ways(at))
        x = (x + columns.solve(left)) / size
        reaction = left[:, 0] / -size  # r + K x
        neighbours, rest, unmet = d.neighbours(at, sides, given + x[:, 0], reaction, result, state.clock.dt)
        return neighbours, self.reduced.norm(rest) + unmet, reaction

    def _verified(self, at: Solution, d: Direction, rest: float, reaction: Array) -> float:
        """What is left of the residual along a derivative, over the forces, for a change of the parameter by its size."""
        left, may = rest * d.parameter.size / at.e.scale, self._allowed_residual(at, d)
        if not rest <= may and not rest <= self._significant_residual(at, d, reaction) and d.parameter.path not in self.reported:
            self.reported.add(d.parameter.path)
            self.doubts.append(
                f"step {at.c.plan.name!r}, time {at.c.time:.6g}: the derivative by {d.parameter.path} is not exact: along it "
                f"{left:.1e} of the forces are out of balance; the cause is a kink of a law or of a tool's outline, or a node "
                "that supports hold on a tool, and later derivatives are not exact either"
            )
        return left

    def _allowed_residual(self, at: Solution, d: Direction) -> float:
        """Norm of the residual along a derivative that is as it should be."""
        return self.policy.derivative_residual_share * at.e.scale / d.parameter.size + at.e.floor / d.step

    def _significant_residual(self, at: Solution, d: Direction, reaction: Array) -> float:
        """Norm of the residual along a derivative above which it says something wrong of forces.

        That is a share of the largest of them up to now, or of what the derivative itself does to them where dofs are prescribed,
        ``reaction`` (ndof,): the radius of a large roll that presses a little changes them by far more than their size.
        """
        fixed = at.c.plan.fixed
        changes = float((self.weight[fixed] * np.abs(reaction[fixed])).sum())
        return self.policy.derivative_residual_share * max(self.largest / d.parameter.size, changes)

    def _switched(self, c: Context, result: NewtonResult) -> dict[str, int]:
        """Points of each contact that have closed or opened in an increment: forces have kinks there."""
        assert result.evaluation is not None
        pairs = zip(self.system.surfaces, result.evaluation.contacts)
        return {s.name: int((f.active_sets.closed != c.state.contact.closed[s.rows]).sum()) for s, f in pairs}

    def _at_kinks(self, c: Context, result: NewtonResult) -> dict[str, int]:
        """Points of each contact that just touch, or stick on the bound of friction; what supports keep there is no kink."""
        assert result.evaluation is not None
        out = {}
        for s, f, scale in zip(self.system.surfaces, result.evaluation.contacts, c.scales):
            least = TOUCH * scale.h
            at = (np.abs(f.g) <= least) & (f.p <= scale.k_n * least)
            if f.bound is not None:
                bound = f.bound[:, 0]
                full = ~f.slip & (f.p > scale.k_n * least) & (magnitude(f.t) >= (1.0 - ON_BOUND) * bound) & (bound > 0.0)
                at = at | full if f.redundant is None else at | (full & ~f.redundant.points.bounded)
            out[s.name] = int(at.sum())
        return out
