"""Before any experiment: which parameters the planned readings can tell, how far to press, which reading matters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prensa.errors import ArgumentError, take
from prensa.inverse.experiment import Channel, Experiment, Observe, errors, share
from prensa.measures import parse
from prensa.model.problem import Case, Problem
from prensa.sensitivity.parameters import value_of

Array = NDArray[np.float64]

NORMAL = 1.96  # half a 95 % interval over a standard error
HOPELESS = 3.0  # expected half width over a value from which nothing is told of it
STOPPED_AT = (0.25, 0.5, 0.75)  # of the time at which one might stop


@dataclass(frozen=True)
class Identification:
    """What planned readings would tell: half widths of expected 95 % intervals over the parameters' values, by plan.

    ``plans``: 'all readings', 'without <reading>', 'only the last <reading>', 'stopped at 50 % of the time'. Infinite where
    the readings cannot tell a parameter at all.
    """

    parameters: Sequence[str]
    plans: Mapping[str, Array]
    correlation: Array

    def __str__(self) -> str:
        wide = max(len(p) for p in self.plans) + 2
        lines = [" " * wide + "".join(f"{p.rpartition('.')[2]:>12s}" for p in self.parameters)]
        for plan, halves in self.plans.items():
            cells = [f"±{100 * h:.2g} %" if h < HOPELESS else "untold" for h in halves]
            lines.append(f"{plan:{wide}s}" + "".join(f"{c:>12s}" for c in cells))
        return "\n".join(lines)


def identify(
    case: Case | Problem,
    observe: Mapping[str, Observe | str],
    parameters: Sequence[str],
    rows: int = 20,
) -> Identification:
    """What readings of a planned test would tell of parameters, by one run of the case with its own values.

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

    Raises
    ------
    PrensaError
        If the case, a measure or a path is wrong.

    """
    problem = case.problem if isinstance(case, Case) else case
    take("identify", "case", problem, Problem, "give a Problem or a Case")
    if isinstance(parameters, str) or not parameters or not observe:
        raise ArgumentError("identify: give observe={'force': 'die.force.y'} and parameters=['friction.mu', …]")
    if rows < 2:
        raise ArgumentError(f"identify: {rows} rows; give at least 2")
    values = {p: value_of(problem, p) for p in parameters}
    zero = next((p for p, v in values.items() if v == 0.0), None)
    if zero is not None:
        raise ArgumentError(f"identify: {zero} is 0, of which an error is no share; give the value that is expected")
    times = np.linspace(0.0, float(len(problem.steps)), rows + 1)[1:]
    known = [w if isinstance(w, Observe) else Observe(w) for w in observe.values()]
    index = np.arange(rows)
    channels = [
        Channel(name, parse(o.measure, problem), o.scale, index, np.zeros(rows), np.ones(rows), 0.0, o.shift)
        for name, o in zip(observe, known)
    ]
    predicted = Experiment(problem.name, problem, times, times, np.ones(rows), channels, 0.0).predict(values, parameters)
    blocks, gains = [], []
    for name, o, y, slopes in zip(observe, known, predicted.values, predicted.slopes):
        sigma = errors(o.sigma, y, f"the error of {name!r}")
        gain = 0.0 if o.gain is None else share(o.gain, 1.0, f"the gain of {name!r}")
        blocks.append(slopes * np.array(list(values.values())) / sigma[:, None])
        gains.append(gain * y / sigma)
    return _plans(list(observe), list(parameters), blocks, gains)


def _plans(names: list[str], parameters: list[str], blocks: list[Array], gains: list[Array]) -> Identification:
    rows = len(blocks[0])
    everything = [np.arange(rows) for _ in names]
    plans = {"all readings": everything}
    if len(names) > 1:
        for k, name in enumerate(names):
            plans[f"without {name}"] = [r[:0] if j == k else r for j, r in enumerate(everything)]
            plans[f"only the last {name}"] = [r[-1:] if j == k else r for j, r in enumerate(everything)]
    for s in STOPPED_AT:
        plans[f"stopped at {100 * s:.0f} % of the time"] = [r[: round(s * rows)] for r in everything]
    found = {plan: _halves(blocks, gains, chosen) for plan, chosen in plans.items()}
    covariance = _covariance(blocks, gains, everything)
    spread = np.sqrt(np.diag(covariance))
    return Identification(parameters, found, covariance / np.outer(spread, spread))


def _covariance(blocks: list[Array], gains: list[Array], chosen: list[NDArray[np.int64]]) -> Array:
    """Covariance (k, k) of the parameters, relative, with gains that are known to their errors."""
    k, rows = blocks[0].shape[1], []
    for j, (block, gain, at) in enumerate(zip(blocks, gains, chosen)):
        unknown = np.zeros((len(at), len(blocks)))
        unknown[:, j] = gain[at]
        rows.append(np.hstack([block[at], unknown]))
    prior = np.hstack([np.zeros((len(blocks), k)), np.eye(len(blocks))])
    J = np.vstack([*rows, prior])
    _, sizes, ways = np.linalg.svd(J, full_matrices=True)
    sizes = np.concatenate([sizes, np.zeros(J.shape[1] - len(sizes))])
    inverse = np.where(sizes > 1e-12 * sizes[0], 1.0 / np.maximum(sizes, 1e-300), 1e12)
    return np.asarray(((ways.T * inverse**2) @ ways)[:k, :k])


def _halves(blocks: list[Array], gains: list[Array], chosen: list[NDArray[np.int64]]) -> Array:
    half = NORMAL * np.sqrt(np.diag(_covariance(blocks, gains, chosen)))
    return np.where(half < 1e6, half, np.inf)
