"""The end of a step where a force, a travel or a contact is reached: which one, and exactly when."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from prensa.errors import SolveError, per_cent
from prensa.measures import Measure, parse, targets
from prensa.measures.damage import largest
from prensa.measures.filling import closed_around
from prensa.measures.targets import damage_targets
from prensa.model.units import powers
from prensa.model.until import TOOL_COMPONENTS, reached
from prensa.policy import Policy
from prensa.precision import NEGLIGIBLE
from prensa.result.increment import Increment
from prensa.result.presses import use_of
from prensa.result.results import increment_of, tool_forces
from prensa.system.failure import NotReached, sentence
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.schedule import StepPlan
from prensa.system.state import State
from prensa.system.system import Evaluation, System
from prensa.types import Array

Outcome = tuple[Context, NewtonResult]
View = Callable[[Context, NewtonResult], Increment]


class Look(NamedTuple):
    """What a criterion looks at: degrees of freedom u (ndof,), their evaluation, and the increment when it is asked for."""

    u: Array
    e: Evaluation
    increment: Callable[[], Increment]


@dataclass(frozen=True)
class Criterion:
    """A quantity and its target; ``size``: what its tolerance is a share of; ``words``: what is reported when it is met.

    A contact is the smallest gap of its points: it touches, and leaves, where that passes the tolerance.
    """

    path: str
    words: str
    value: Callable[[Look], float]
    target: float
    size: float
    side: float = 0.0
    """+1 or −1: met from below or from above alone; 0: from where it is when the step begins."""
    fed: bool = False
    """Whether it is the force at which what is fed is held back."""
    limit: bool = False
    """Whether it is the capacity of a press, which nobody waits for."""
    rate: bool = False
    """Whether it is a mean over the increment, as a power is: it says nothing in an instant."""

    upwards: bool = False
    """Whether it is met by all that is beyond its target, though it began there."""
    count: bool = False
    """Whether it is a count, located by `prensa.measures.Measure.located`."""
    absent: str = "it has no value there"
    """What is so where it has no value."""

    def at(self, value: float) -> str:
        """A value in words."""
        if np.isnan(value):
            return f"{self.absent}, and it was to reach {self.target:.6g}"
        if self.fed:
            return f"it was pushed with {-value:.6g}"
        if self.side:
            return "it touches" if value <= self.target else "nothing touches"
        return f"{value:.6g} of {self.target:.6g}"


class Found(NamedTuple):
    """The ``outcome`` in which a criterion is met, and what there is to say where it is not met within its tolerance."""

    outcome: Outcome
    words: str


class _Failed(Exception):
    """An attempt in the search did not converge; ``outcome``: what came of it."""

    def __init__(self, outcome: Outcome) -> None:
        super().__init__()
        self.outcome = outcome


class Stopping:
    """What may end a step before its time is over; ``view`` makes an increment of an outcome that is not committed."""

    def __init__(self, system: System, plan: StepPlan, policy: Policy, view: View) -> None:
        self.system, self.plan, self.policy, self.view = system, plan, policy, view
        until = system.problem.steps[plan.number].until if plan.number < len(system.problem.steps) else None
        self.required = until is not None and until.required
        self.criteria = [] if until is None else list(_criteria(system, plan.number, policy))
        self.criteria += [] if until is None else _damaged(system, plan.number, policy)
        self.criteria += _gripped(system, plan.number, policy)

    def begin(self, state: State) -> State:
        """The state in which the step begins, with what is watched.

        Raises
        ------
        SolveError
            If a criterion is met already.

        """
        if not self.criteria:
            return replace(state, watched=np.zeros(0))
        c = replace(self.system.context(state, self.plan, state.clock.time), dt=1.0)
        e = self.system.evaluate(c, state.u, self.system.initial_multipliers(state), stiffness=False)
        still = NewtonResult(True, None, state.u, e, state.lam, 0)
        rest = replace(state, tool_work=np.zeros(len(self.system.tools)))  # of the step before
        look = Look(state.u, e, cache(lambda: increment_of(self.system, rest, self.plan, e, still, 0, 0, False, parse=parse)))
        values = np.array([criterion.value(look) for criterion in self.criteria])
        for criterion, value in zip(self.criteria, values.tolist()):
            if self._beyond(criterion, value, value) >= -0.5 * self.policy.until_share:
                failure = NotReached(f"{criterion.path} is met when the step begins ({criterion.at(value)})")
                raise SolveError(
                    f"step {self.plan.name!r}: {sentence(failure)}. What to try: leave the step out, or say what is to be "
                    "reached in it.",
                    None,
                    failure,
                )
        return replace(state, watched=values)

    def search(self, outcome: Outcome, solve: Callable[[float], Outcome]) -> Outcome:
        """The outcome of an increment, or of an earlier end of it at which a criterion is met.

        ``solve``: the outcome of the increment from the same committed state to another time. One that fails comes back as it
        is.
        """
        stopped, words, least = None, "", -self._near
        while self.criteria:
            c, result = outcome
            values, was = self._values(outcome), c.state.watched
            met = [k for k, v in enumerate(values) if k != stopped and self._at(k, v, was) >= least]
            if not met:
                return replace(c, watched=np.array(values), stopped=words), result
            # of several the earliest counts: the others may be beyond their targets there
            stopped, least = met[0], 0.5 * self.policy.until_share
            try:
                outcome, beyond = self._root(stopped, outcome, solve)
                words = self.criteria[stopped].words + beyond
            except _Failed as failed:
                return failed.outcome
        return outcome

    def unmet(self, c: Context) -> Iterator[str]:
        """What there is to say at the end of a step that nothing has ended."""
        asked = [(k, v) for k, v in zip(self.criteria, c.watched.tolist()) if not k.limit]
        if asked and not c.stopped:
            each = [f"{k.path} ({k.at(v)})" for k, v in asked]
            was = "was" if len(each) == 1 else "were"
            unmet = f"{' and '.join(each)} {was} not met"
            other = any(k.target * v < 0 and not k.side for k, v in asked)
            remedy = "check the sign, which is as in history.csv" if other else "let it go further, or ask for less"
            if any(np.isnan(v) for _, v in asked):
                remedy = "ask for what has a value there"
            if all(k.side > 0.0 for k, _ in asked):
                remedy = "let the tool go back further"
            if all(k.fed for k, _ in asked):
                remedy = "let it go further, or feed less than the tools take along"
            yield f"step {self.plan.name!r} goes to its end: {unmet}; {remedy}"

    def early(self, c: Context) -> Iterator[str]:
        """What there is to say of an end that comes so soon that a number is likely of another unit."""
        share = (c.time - self.plan.t0) / (self.plan.t1 - self.plan.t0)
        if share < self.policy.until_early_share and any(c.stopped.startswith(k.words) and not k.side for k in self.criteria):
            yield (
                f"step {self.plan.name!r} ends after {per_cent(share)} of its way: {c.stopped}; is that number in the units of "
                "the case?"
            )

    def refuse(self, c: Context) -> None:
        """Raise `SolveError` at the end of a step that nothing has ended, if that is required."""
        if self.required and c.ends_step:
            for words in self.unmet(c):
                raise SolveError(words, None, NotReached(words))

    # --------------------------------------------------------------------------------------------------------- details
    def _values(self, outcome: Outcome) -> list[float]:
        c, result = outcome
        assert result.evaluation is not None
        look = Look(result.u, result.evaluation, cache(lambda: self.view(c, result)))
        return [criterion.value(look) for criterion in self.criteria]

    def _at(self, k: int, value: float, was: Array) -> float:
        return self._beyond(self.criteria[k], value, float(was[k]))

    @property
    def _near(self) -> float:
        """Half the width of the band in which a criterion is met.

        It ends well before the target, where what stays there, as a count or a force of zero, is not taken for the moment at
        which it came there.
        """
        return 0.25 * self.policy.until_share

    def _beyond(self, c: Criterion, value: float, was: float) -> float:
        """By how much a value that *was* on this side of its target is beyond the aim, over its size.

        The aim is half of the tolerance before the target: what falls to zero and stays there, as a force does, is met where
        it gets there.
        """
        if not np.isfinite(value) or not np.isfinite(was):  # of an open contact, say
            return -1e6
        side = c.side or (1.0 if c.upwards or was < c.target else -1.0)
        away = side * (value - c.target) / c.size
        return float(np.clip(away, -1e6, 1e6)) + 0.5 * self.policy.until_share

    def _root(self, k: int, end: Outcome, solve: Callable[[float], Outcome]) -> Found:
        """The outcome in which criterion k is met, between a committed state and the outcome of an increment."""
        from scipy.optimize import brentq  # a slow import that most runs do without

        c = end[0]
        was, least = c.state.watched, self._near
        tried: dict[float, tuple[float, Outcome]] = {c.time: (self._at(k, self._values(end)[k], was), end)}
        now = c.state.clock.time

        def beyond(time: float) -> float:
            if time <= now:
                return min(self._at(k, float(was[k]), was), -self.policy.until_share)
            if time not in tried:
                outcome = solve(time)
                if not outcome[1].converged:
                    raise _Failed(outcome)
                tried[time] = self._at(k, self._values(outcome)[k], was), outcome
            value = tried[time][0]
            return 0.0 if abs(value) <= least else value

        if beyond(c.time) != 0.0:
            instant = self.policy.until_time_share * (self.plan.t1 - self.plan.t0)
            brentq(beyond, now, c.time, xtol=instant, maxiter=200, disp=False)
        within = [t for t, (value, _) in tried.items() if abs(value) <= least]
        if not within and self.criteria[k].rate:
            return Found(end, "; it is a mean over the increment, and was less in the one before")
        # what jumps over its target is met just behind the jump
        at = min(within or (t for t, (value, _) in tried.items() if value > 0.0))
        before = max((t for t in tried if t < at), default=None)
        first = float(was[k]) if before is None else self._values(tried[before][1])[k]
        return Found(tried[at][1], self._jump(k, first, self._values(tried[at][1])[k]))

    def _jump(self, k: int, before: float, value: float) -> str:
        """What there is to say of a criterion with a value, that was something else just before; '' if it is met there."""
        c = self.criteria[k]
        away = abs(value - c.target) > self.policy.until_share * c.size * (1.0 + NEGLIGIBLE)
        if away and np.isnan(before):
            return f"; just before it has no value, and then {value:.6g}"
        from_to = "" if c.count else f" from {before:.6g} to {value:.6g}"
        return f"; it jumps there{from_to}" if away else ""


def _criteria(system: System, number: int, policy: Policy) -> Iterator[Criterion]:
    """What the description of a step waits for."""
    until = system.problem.steps[number].until
    assert until is not None
    for kind, name, key, target in until.criteria():
        path = f"until.{kind}.{name}" + (f".{key}" if key else "")
        if kind == "contact":
            yield _contact(system, path, name, target, policy.until_share)
            continue
        if kind in ("energy", "press"):
            yield _of_press(system, path, kind, name, target, policy)
            continue
        t = list(system.problem.tools).index(name)
        component = TOOL_COMPONENTS[kind][system.dofs.dimension].index(key)

        def value(look: Look, kind: str = kind, t: int = t, component: int = component) -> float:
            if kind == "travel":
                return float(system.place_of(t, look.u)[component])
            return float(tool_forces(system, look.e)[system.tools[t].name][component])

        words = f"{reached(kind, name, key)} {target:.6g}"
        # of nothing the tolerance is that of a small elastic strain, or of the size of the bodies
        unit = {"travel": system.length, "force": policy.until_force_strain * system.stiffness}[kind]
        if component >= system.dofs.dimension:  # a turn, or a moment
            unit = 1.0 if kind == "travel" else unit * system.length
        yield Criterion(path, words, value, float(target), abs(float(target)) or unit)
    for name, (measure, target) in targets(system.problem, number).items():
        yield _measured(system, name, measure, target, policy)


def _measured(system: System, name: str, measure: Measure, target: float, policy: Policy) -> Criterion:
    """A measure and its target."""
    force, length = powers(measure.unit)
    size = abs(target) or (policy.until_force_strain * system.stiffness) ** force * system.length**length
    path, words = f"until.measure.{name}", f"measure {name!r} has reached {target:.6g}"
    if measure.located is None:
        rate = measure.unit.endswith("/s")
        absent = "".join(f"no closed die surrounds {body!r}" for body in list(closed_around(system.problem, name))[:1])
        absent = absent or Criterion.absent
        return Criterion(path, words, lambda look: measure.value_or_nan(look.increment()), target, size, rate=rate, absent=absent)
    located, tolerance = measure.located, policy.until_share * size
    n = max(math.ceil(target), 1)
    # what is met is met a tolerance before its target: that is to be where the count changes, or just beyond
    return Criterion(path, words, lambda look: located(look.increment(), n), n + tolerance, size, upwards=True, count=True)


def _damaged(system: System, number: int, policy: Policy) -> Iterator[Criterion]:
    """The largest damages that end the step."""
    found = damage_targets(system.problem, number)
    for body, law, target in found:

        def value(look: Look, body: str = body, law: str = law.name) -> float:
            return largest(look.increment(), body, law).value

        words = f"damage {law.name} of {body!r} has reached {target:.6g}"
        # what is met is met a tolerance before its target: that is to be the limit itself, or just beyond
        which = f" by {law.name}" if sum(other == body for other, *_ in found) > 1 else ""
        yield Criterion(f"until.damage.{body}{which}", words, value, (1.0 + policy.until_share) * target, target, upwards=True)


def _of_press(system: System, path: str, kind: str, name: str, target: float, policy: Policy) -> Criterion:
    """The work that a tool does in a step, or the capacity of its press."""
    energy, use = kind == "energy", use_of(system.problem, name)
    times = 1 if use is None else use.energies
    measure = parse(f"{name}.work" if energy else f"{name}.press_utilisation", system.problem)

    def value(look: Look) -> float:
        return measure.value(look.increment()) * (times if energy else 1)

    words = f"{reached(kind, name, '')} {target:.6g}"
    return Criterion(path, words, value, target, target, limit=not energy)


def _gripped(system: System, number: int, policy: Policy) -> Iterator[Criterion]:
    """The moment from which what a step feeds would have to be held back, where there is something that may grip it."""
    steps = system.problem.steps
    for name, feed in steps[number].feed.items() if number < len(steps) else ():
        joined = system.tied_bodies(name.partition(".")[0])
        if not any(s.body in joined or (s.opposite is not None and s.opposite.body in joined) for s in system.surfaces):
            continue
        sign = 1.0 if feed.way > 0 else -1.0

        def pull(look: Look, name: str = name, axis: str = feed.axis, sign: float = sign) -> float:
            return -sign * float(getattr(look.increment().supports[name], axis))

        least, unit = policy.gripped_strain * system.stiffness, policy.until_force_strain * system.stiffness
        yield Criterion(f"feed.{name}", f"{name!r} is gripped", pull, least, unit, 1.0, True)


def _contact(system: System, path: str, name: str, word: str, tolerance: float) -> Criterion:
    own = [i for i, s in enumerate(system.surfaces) if name in (s.name, s.against)]
    depth = min(float(system.surfaces[i].points.depth.min()) for i in own)

    def gap(look: Look) -> float:
        g = min(float(np.nan_to_num(look.e.contacts[i].g, nan=np.inf).min()) for i in own)
        return min(g, 1e6 * depth)  # where the tool stands over none of the points

    touches = word == "touches"
    aim = (1.0 if touches else 10.0) * tolerance * depth  # apart: what has left may come to touch again
    return Criterion(path, f"{name!r} {word}", gap, aim, depth, -1.0 if touches else 1.0)
