"""Before any experiment: which parameters the planned readings can determine, how far to press, which reading matters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prensa.errors import ArgumentError, take
from prensa.inverse.experiment import Channel, Experiment, Observe, Test, errors, ready, share
from prensa.inverse.result import CONFIDENCE
from prensa.measures import parse
from prensa.model.problem import Case, Problem
from prensa.precision import NEGLIGIBLE, ROUND_OFF, SMALLEST
from prensa.sensitivity.parameters import value_of
from prensa.types import Array, Index

HOPELESS = 3.0  # expected half width over a value from which nothing is said of it
BOUNDLESS = 1e6  # the same from which it counts as infinite
STOPPED_AT = (0.25, 0.5, 0.75)  # of the time at which one might stop


@dataclass(frozen=True)
class Identification:
    """What planned readings would determine: half widths of expected 95 % intervals over the parameters' values, by plan.

    ``plans``: 'all readings', 'without <reading>', 'only the last <reading>', 'stopped at 50 % of the time'. Infinite where
    the readings cannot determine a parameter at all.
    """

    parameters: Sequence[str]
    plans: Mapping[str, Array]
    correlation: Array

    def __str__(self) -> str:
        wide = max(len(p) for p in self.plans) + 2
        lines = [" " * wide + "".join(f"{p.rpartition('.')[2]:>14s}" for p in self.parameters)]
        for plan, halves in self.plans.items():
            cells = [f"±{100 * h:.2g} %" if h < HOPELESS else "undetermined" for h in halves]
            lines.append(f"{plan:{wide}s}" + "".join(f"{c:>14s}" for c in cells))
        return "\n".join(lines)


class _Reading(NamedTuple):
    """A column of a test: its name, J (r, k) and ``unknown`` (r, q) of what its instruments do not know, over the errors.

    ``share`` (r,): of the time of the test that has gone by.
    """

    name: str
    J: Array
    unknown: Array
    share: Array


def identify(
    case: Case | Problem | None = None,
    observe: Mapping[str, Observe | str] | None = None,
    parameters: Sequence[str] = (),
    rows: int = 20,
    tests: Sequence[Test] = (),
) -> Identification:
    """What readings of planned tests would determine of parameters, by one run of each case with its own values.

    Parameters
    ----------
    case
        The planned test, with the values that are expected.
    observe
        What would be read, by name; errors in units of the case or shares of the largest value that is expected.
    parameters
        Paths, as in ``--set``.
    rows
        Number of readings of each, at equal times.
    tests
        In the place of one case: several tests, of whose tables places and errors of the readings are taken, not what was read.

    Raises
    ------
    PrensaError
        If the case, a table, a measure or a path is wrong.

    """
    if isinstance(parameters, str) or not parameters or not (observe or tests):
        raise ArgumentError("identify: give observe={'force': 'die.force.y'} and parameters=['friction.mu', …]")
    if rows < 2:
        raise ArgumentError(f"identify: {rows} rows; give at least 2")
    if tests:
        if case is not None or observe:
            raise ArgumentError("identify: give a case with what is observed, or tests; not both")
        experiments, errors_of = [ready(test, k) for k, test in enumerate(tests, 1)], None
    else:
        assert observe is not None
        problem = case.problem if isinstance(case, Case) else case
        take("identify", "case", problem, Problem, "give a Problem or a Case")
        assert isinstance(problem, Problem)
        errors_of = [o if isinstance(o, Observe) else Observe(o) for o in observe.values()]
        experiments = [_planned(problem, list(observe), errors_of, rows)]
    values = {p: value_of(experiments[0].problem, p) for p in parameters}
    zero = next((p for p, v in values.items() if v == 0.0), None)
    if zero is not None:
        raise ArgumentError(f"identify: {zero} is 0, so its error cannot be a share of it; give the value that is expected")
    return _plans(list(parameters), _readings(experiments, values, errors_of))


def _planned(problem: Problem, names: Sequence[str], observe: Sequence[Observe], rows: int) -> Experiment:
    """A test that nobody has made yet, with readings at equal times."""
    times, index = np.linspace(0.0, float(len(problem.steps)), rows + 1)[1:], np.arange(rows)
    channels = [
        Channel(
            # Errors may be shares of readings, which the run has yet to give: they come in `_readings`.
            name, parse(o.measure, problem), o.scale, index, np.zeros(rows), np.ones(rows),
            0.0 if o.gain is None else share(o.gain, 1.0, f"the gain of {name!r}"), o.shift,
        )
        for name, o in zip(names, observe)
    ]  # fmt: skip
    return Experiment(problem.name, problem, times, times, np.ones(rows), channels, 0.0)


def _readings(
    experiments: Sequence[Experiment], values: Mapping[str, float], planned: Sequence[Observe] | None
) -> list[_Reading]:
    """All columns of all tests; errors of ``planned`` ones are shares of what is expected."""
    sizes, out = np.array(list(values.values())), []
    count = sum(len(e.channels) + 1 for e in experiments)
    first = 0
    for e in experiments:
        predicted = e.predict(values, list(values))
        for j, (c, y, slopes, rate) in enumerate(zip(e.channels, predicted.values, predicted.slopes, predicted.rates)):
            sigma = c.sigma if planned is None else errors(planned[j].sigma, y, f"the error of {c.name!r}")
            unknown = np.zeros((len(y), count))
            unknown[:, first + j] = c.gain * y / sigma
            unknown[:, first + len(e.channels)] = e.offset * rate / sigma
            name = c.name if len(experiments) == 1 else f"{c.name} of {e.name}"
            times = e.times[c.rows]
            out.append(_Reading(name, slopes * sizes / sigma[:, None], unknown, times / e.times.max()))
        first += len(e.channels) + 1
    return out


def _plans(parameters: list[str], readings: list[_Reading]) -> Identification:
    everything = [np.arange(len(r.J)) for r in readings]
    plans = {"all readings": everything}
    if len(readings) > 1:
        for k, own in enumerate(readings):
            plans[f"without {own.name}"] = [r[:0] if j == k else r for j, r in enumerate(everything)]
            plans[f"only the last {own.name}"] = [r[-1:] if j == k else r for j, r in enumerate(everything)]
    for s in STOPPED_AT:
        plans[f"stopped at {100 * s:.0f} % of the time"] = [np.flatnonzero(r.share <= s * (1.0 + NEGLIGIBLE)) for r in readings]
    found = {plan: _halves(readings, chosen) for plan, chosen in plans.items()}
    covariance = _covariance(readings, everything)
    spread = np.sqrt(np.diag(covariance))
    return Identification(parameters, found, covariance / np.outer(spread, spread))


def _covariance(readings: list[_Reading], chosen: list[Index]) -> Array:
    """Covariance (k, k) of the parameters, relative, with gains and offsets that are known to their errors."""
    k, q = readings[0].J.shape[1], readings[0].unknown.shape[1]
    rows = [np.hstack([r.J[at], r.unknown[at]]) for r, at in zip(readings, chosen)]
    # As in a fit: gains and offsets are readings of zero with an error of one.
    prior = np.hstack([np.zeros((q, k)), np.eye(q)])
    J = np.vstack([*rows, prior])
    _, sizes, ways = np.linalg.svd(J, full_matrices=True)
    sizes = np.concatenate([sizes, np.zeros(J.shape[1] - len(sizes))])
    # A pseudo-inverse would give variance zero to a direction that no reading determines; it gets a huge one.
    inverse = np.where(sizes > ROUND_OFF * sizes[0], 1.0 / np.maximum(sizes, SMALLEST), 1.0 / ROUND_OFF)
    return np.asarray(((ways.T * inverse**2) @ ways)[:k, :k])


def _halves(readings: list[_Reading], chosen: list[Index]) -> Array:
    from scipy.stats import norm

    half = norm.ppf(0.5 + 0.5 * CONFIDENCE) * np.sqrt(np.diag(_covariance(readings, chosen)))
    return np.where(half < BOUNDLESS, half, np.inf)
