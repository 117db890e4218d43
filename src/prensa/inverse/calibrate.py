"""Calibration: the parameters with which a case says what was measured, and how far the measurements bear them out.

Gauss-Newton in scipy's trust region (`scipy.optimize.least_squares`, Branch, Coleman and Li 1999) on exact derivatives, in
logarithms of positive parameters. Intervals are those of the linearised problem, widened by what a finer mesh changes.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.errors import ArgumentError, PrensaError, SolveError, take
from prensa.inverse.experiment import Experiment, Observe, Test, ready
from prensa.inverse.meshes import finer
from prensa.inverse.result import Fit, Residuals, fit_of
from prensa.inverse.tables import DataError
from prensa.measures import MeasureError
from prensa.model.problem import Case, Problem
from prensa.model.schema import dump
from prensa.sensitivity.parameters import value_of

log = logging.getLogger("prensa")
Array = NDArray[np.float64]
Bounds = tuple[float, float] | None

SMALL_GAIN, SMALL_STEP = 1e-3, 1e-4  # share of χ², and of the way so far, below which a step ends a fit
MOST_RUNS = 60  # of a fit
FAILED = 10.0  # residual, over its standard error, of all readings where the case has no answer


@dataclass(frozen=True)
class Parameter:
    """A parameter of the fit: its path, start, bounds, and whether its logarithm is what is varied."""

    path: str
    start: float
    bounds: tuple[float, float]
    log: bool

    @classmethod
    def of(cls, path: str, start: float, bounds: Bounds) -> Parameter:
        """A parameter between bounds, None: what has one sign keeps it."""
        low, high = bounds if bounds is not None else ((0.0, np.inf) if start > 0 else (-np.inf, np.inf))
        if not low < high:
            raise ArgumentError(
                f"calibrate: the bounds of {path} are {low:g} and {high:g}; the first has to be the smaller"
            )
        if not low <= start <= high:
            raise ArgumentError(f"calibrate: {path} starts from {start:g}, outside its bounds {low:g} … {high:g}")
        return cls(path, start, (low, high), bool(low >= 0.0 and start > 0.0))

    def inner(self, value: float) -> float:
        """What the fit varies."""
        return float(np.log(value)) if self.log else value / self.size

    def value(self, inner: float) -> float:
        """The parameter."""
        return float(np.exp(inner)) if self.log else inner * self.size

    def slope(self, value: float) -> float:
        """Derivative of the parameter by what is varied."""
        return value if self.log else self.size

    @property
    def size(self) -> float:
        """What a parameter that is not positive is divided by."""
        finite = [abs(b) for b in self.bounds if np.isfinite(b) and b != 0.0]
        return abs(self.start) or (max(finite) if finite else 1.0)

    @property
    def limits(self) -> tuple[float, float]:
        """Bounds of what is varied."""
        if not self.log:
            return self.bounds[0] / self.size, self.bounds[1] / self.size
        low, high = self.bounds
        return (np.log(low) if low > 0.0 else -np.inf), float(np.log(high))


@dataclass
class Objective:
    """Residuals over their standard errors and their derivatives, of all tests, with what is unknown about the instruments.

    Unknowns are the parameters, then gains (less 1) and offsets in units of their standard errors, which are readings of 0 ± 1.
    ``cache``: folder in which runs are kept, so that an interrupted fit goes on; None: in memory.
    """

    experiments: Sequence[Experiment]
    parameters: Sequence[Parameter]
    cache: Path | None = None
    told: Callable[[str], None] = log.info
    runs: int = 0
    _known: dict[str, Any] = field(default_factory=dict)
    _last: tuple[bytes, Residuals | None] | None = None

    @property
    def nuisances(self) -> list[tuple[int, int | None]]:
        """Experiment and channel of each gain; experiment and None of each offset."""
        out: list[tuple[int, int | None]] = []
        for k, e in enumerate(self.experiments):
            out += [(k, j) for j, c in enumerate(e.channels) if c.gain > 0.0]
            out += [(k, None)] if e.offset > 0.0 else []
        return out

    def values(self, x: Array) -> dict[str, float]:
        """Parameters by path."""
        return {p.path: p.value(v) for p, v in zip(self.parameters, x)}

    def at(self, x: Array) -> Residuals | None:
        """Residuals and derivatives at unknowns; None where a run fails."""
        if self._last is None or self._last[0] != x.tobytes():
            self._last = x.tobytes(), self._evaluated(x)
        return self._last[1]

    def _evaluated(self, x: Array) -> Residuals | None:
        values = self.values(x)
        slopes = np.array([p.slope(values[p.path]) for p in self.parameters])
        more = x[len(self.parameters) :]
        models, parts, J = [], [], []
        try:
            for k, e in enumerate(self.experiments):
                predicted = self._predicted(k, values)
                for j, c in enumerate(e.channels):
                    y, dy = np.array(predicted[0][j]), np.array(predicted[1][j]).reshape(len(c.rows), -1) * slopes
                    z = np.zeros((len(y), len(self.nuisances)))
                    for m, (ke, jc) in enumerate(self.nuisances):
                        if ke == k and jc == j:
                            y, dy = (1.0 + c.gain * more[m]) * y, (1.0 + c.gain * more[m]) * dy
                            z[:, m] = c.gain * np.array(predicted[0][j])
                        elif ke == k and jc is None and len(c.rows) > 1:
                            along = np.gradient(np.array(predicted[0][j]), e.stroke[c.rows]) * e.offset
                            y, z[:, m] = y + along * more[m], along
                            dy = dy + np.gradient(dy, e.stroke[c.rows], axis=0) * e.offset * more[m]
                    models.append(y)
                    parts.append((y - c.readings) / c.sigma)
                    J.append(np.hstack([dy, z]) / c.sigma)
        except (SolveError, MeasureError) as error:
            self.told(f"no answer at {self._words(values)}: {str(error).splitlines()[0]}")
            return None
        prior = np.hstack([np.zeros((len(more), len(self.parameters))), np.eye(len(more))])
        out = Residuals(np.concatenate([*parts, more]), np.vstack([*J, prior]), models)
        self.told(f"χ² {out.square:.4g} at {self._words(values)}")
        return out

    def _words(self, values: Mapping[str, float]) -> str:
        return ", ".join(f"{path} {value:.5g}" for path, value in values.items())

    def _predicted(self, k: int, values: Mapping[str, float]) -> Any:
        e = self.experiments[k]
        text = dump(e.problem) + repr((sorted(values.items()), e.times.tolist(), [str(c.measure) for c in e.channels]))
        key = hashlib.sha256(text.encode()).hexdigest()
        if key not in self._known:
            kept = self.cache / f"{key[:24]}.json" if self.cache is not None else None
            if kept is not None and kept.is_file():
                self._known[key] = json.loads(kept.read_text(encoding="utf-8"))
            else:
                self.runs += 1
                p = e.predict(values, [q.path for q in self.parameters])
                self._known[key] = [v.tolist() for v in p.values], [s.tolist() for s in p.slopes]
                if kept is not None:
                    kept.parent.mkdir(parents=True, exist_ok=True)
                    kept.write_text(json.dumps(self._known[key]), encoding="utf-8")
        return self._known[key]

    def minimise(self, start: Array) -> tuple[Array, Residuals]:
        """Unknowns of least squares from a start, and the residuals there; raises `PrensaError` if there is no answer there.

        What is varied is the way from the start, so that the first step changes no parameter by more than a factor of e.
        """
        from scipy.optimize import least_squares

        n, limits = (
            len(start),
            [p.limits for p in self.parameters] + [(-np.inf, np.inf)] * (len(start) - len(self.parameters)),
        )
        low, high = (np.array(v) for v in zip(*limits))
        first = self.at(start)
        if first is None:
            raise PrensaError(f"calibrate: the case has no answer at the start {self._words(self.values(start))}")
        count = len(first.r)

        def residuals(way: Array) -> Array:
            got = self.at(start + way)
            return np.full(count, FAILED + float(np.abs(first.r).max())) if got is None else got.r

        def slopes(way: Array) -> Array:
            got = self.at(start + way)
            return np.zeros((count, n)) if got is None else got.J

        found = least_squares(
            residuals, np.zeros(n), jac=slopes, bounds=(low - start, high - start), ftol=SMALL_GAIN, xtol=SMALL_STEP, gtol=1e-8,
            max_nfev=MOST_RUNS,
        )  # fmt: skip
        x = start + found.x
        best = self.at(x)
        assert best is not None
        return np.asarray(x), best


def _started(parameters: Sequence[Parameter], number: int, seed: int) -> Iterable[list[float]]:
    """Starts: that of the case, then others between the bounds, or within a factor of three where there are none."""
    from scipy.stats import qmc

    yield [p.inner(p.start) for p in parameters]
    if number < 2:
        return
    samples = qmc.Sobol(len(parameters), seed=seed).random_base2(max(1, int(np.ceil(np.log2(number)))))
    for row in samples[: number - 1]:
        out = []
        for share, p in zip(row, parameters):
            middle, reach = p.inner(p.start), np.log(3.0) if p.log else 1.0
            low, high = max(p.limits[0], middle - reach), min(p.limits[1], middle + reach)
            out.append(low + float(share) * (high - low))
        yield out


def calibrate(
    case: Case | Problem | None = None,
    data: str | Path | None = None,
    observe: Mapping[str, Observe | str] | None = None,
    parameters: Mapping[str, tuple[float, float] | None] | None = None,
    along: str = "time",
    tests: Sequence[Test] = (),
    starts: int = 1,
    seed: int = 0,
    refine: bool = True,
    keep: str | Path | None = None,
    told: Callable[[str], None] = log.info,
) -> Fit:
    """Find the parameters with which a case says what was measured.

    Parameters
    ----------
    case, data, observe, along
        One test: see `Test`, as in
        ``pr.calibrate(case, "ring.csv", {"force": "die.force.y"}, {"friction.mu": (0.02, 0.5)}, "-die.uy")``.
    parameters
        Bounds by path (as in ``--set``); None: what is positive stays so. They start from the values of the case.
    tests
        Several tests, whose parameters of the same path are the same ones.
    starts
        Number of starts; one is the case, others are spread between the bounds.
    seed
        Of the other starts.
    refine
        Fit again on a finer mesh and widen the intervals by what that changes.
    keep
        Folder in which runs are kept, so that a fit that was interrupted goes on.
    told
        Receives a line for every run.

    Raises
    ------
    PrensaError
        For data that cannot be used, more parameters than readings, and a case that has no answer where the fit starts.

    """
    take(
        "calibrate", "parameters", parameters, Mapping, "give bounds by path, for example {'friction.mu': (0.02, 0.5)}"
    )
    assert parameters is not None
    if case is not None or data is not None or observe is not None:
        if case is None or data is None or observe is None:
            raise ArgumentError("calibrate: a test needs its case, data and observe; or give tests=[Test(…), …]")
        tests = [Test(case, data, observe, along), *tests]
    if not tests or not parameters:
        raise ArgumentError("calibrate: there is nothing to fit; give a test and parameters")
    experiments = [ready(t, k) for k, t in enumerate(tests, 1)]
    known = [Parameter.of(p, value_of(experiments[0].problem, p), b) for p, b in parameters.items()]
    for e in experiments[1:]:
        for p in known:
            value_of(e.problem, p.path)
    readings = sum(e.count for e in experiments)
    if readings <= len(known):
        raise DataError(f"calibrate: {readings} readings cannot tell {len(known)} parameters; take more, or fit fewer")
    objective = Objective(experiments, known, Path(keep) if keep is not None else None, told)
    found = _best(objective, starts, seed)
    fine, finer_mesh = None, [finer(e.problem) for e in experiments] if refine else []
    if finer_mesh and all(p is not None for p in finer_mesh):
        told("the same on a finer mesh")
        again = replace(
            objective, experiments=[e.on(p) for e, p in zip(experiments, finer_mesh) if p is not None], _last=None
        )
        fine = again.minimise(found[0][0])
        objective.runs = again.runs
    return fit_of(objective, found, fine)


def _best(objective: Objective, starts: int, seed: int) -> list[tuple[Array, Residuals]]:
    """Fits from all starts that have an answer, the best first."""
    found, failed = [], None
    more = [0.0] * len(objective.nuisances)
    for start in _started(objective.parameters, starts, seed):
        try:
            found.append(objective.minimise(np.array([*start, *more])))
        except PrensaError as error:
            failed = error
    if not found:
        assert failed is not None
        raise failed
    return sorted(found, key=lambda f: f[1].square)
