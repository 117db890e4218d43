"""Objective of a calibration: residuals of all tests over their standard errors, and their derivatives."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from prensa.errors import ArgumentError, PrensaError
from prensa.inverse.bends import Curve, LinearisedResiduals, curves_of
from prensa.inverse.experiment import Experiment, over_stroke
from prensa.model.fields import LARGEST
from prensa.model.problem import Case
from prensa.model.schema import dump
from prensa.output.files import write_text
from prensa.output.runlog import silenced
from prensa.precision import ROUND_OFF
from prensa.types import Array

log = logging.getLogger("prensa")
Bounds = tuple[float, float] | None

SMALL_GAIN, SMALL_STEP = 1e-4, 1e-5  # share of χ², and of the way so far, below which a step ends a fit
IDLE_STEP = 1e-3  # χ² that the next step would gain below which it is not worth a run: 3 % of a standard error
MOST_RUNS = 60  # of a fit
ROUGH = 50.0  # times that gain: what a step that did not come true may have promised without being tried again
TRUSTED = 1.0  # of what is varied, mostly logarithms: way along which a linearised problem predicts at most, a factor of e
IDLE = 1e-3  # change of a channel over its error when a parameter doubles, below which that does not move it
NO_ANSWER = 10.0  # residual, over its standard error, of all readings where the case has no answer


class Residuals(NamedTuple):
    """r (n,) over their standard errors, J (n, k) their derivatives, ``models`` (m,) of the channels in their units."""

    r: Array
    J: Array
    models: list[Array]

    @property
    def square(self) -> float:
        """χ²."""
        return float(self.r @ self.r)


def grown(value: float, way: float) -> float:
    """A value times e^way, which may be more than a float holds."""
    return value * float(np.exp(np.clip(way, -np.log(LARGEST), np.log(LARGEST))))


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
        return grown(1.0, inner) if self.log else inner * self.size

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
    report: Callable[[str], None] = log.info
    runs: int = 0
    failure: str = ""
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
        """Residuals and derivatives at unknowns; None where the case has no answer, for the reason `failure`."""
        # SciPy asks for residuals and slopes of one place in two calls; one run gives both.
        if self._last is None or self._last[0] != x.tobytes():
            self._last = x.tobytes(), self._evaluated(x, True)
        return self._last[1]

    def residuals(self, x: Array) -> Array | None:
        """Residuals (n,) alone, from a run without derivatives; None where the case has no answer."""
        found = self._evaluated(x, False)
        return None if found is None else found.r

    def _evaluated(self, x: Array, sloped: bool) -> Residuals | None:
        values = self.values(x)
        slopes = np.array([p.slope(values[p.path]) for p in self.parameters])
        more = x[len(self.parameters) :]
        models, parts, J = [], [], []
        try:
            for k, e in enumerate(self.experiments):
                for j, (c, read) in enumerate(zip(e.channels, self._predicted(k, values, sloped))):
                    dy = np.array(read[1]).reshape(len(c.rows), -1) * slopes if sloped else np.zeros((len(c.rows), len(slopes)))
                    y, dy, z = self._instruments(k, j, np.array(read[0]), dy, np.array(read[2]), more)
                    models.append(y)
                    parts.append((y - c.readings) / c.sigma)
                    J.append(np.hstack([dy, z]) / c.sigma[:, None])
        except PrensaError as error:  # no equilibrium, no such place any more, a value that is not allowed
            self.failure = str(error).splitlines()[0]
            self.report(f"no answer at {self._words(values)}: {self.failure}")
            return None
        # Gains and offsets count in their standard errors: each is a reading of zero with an error of one.
        prior = np.hstack([np.zeros((len(more), len(self.parameters))), np.eye(len(more))])
        out = Residuals(np.concatenate([*parts, more]), np.vstack([*J, prior]), models)
        self.report(f"χ² {out.square:.4g} at {self._words(values)}")
        return out

    def _instruments(self, k: int, j: int, y: Array, dy: Array, rate: Array, more: Array) -> tuple[Array, Array, Array]:
        """What instruments with gain and offset ``more`` show: values (m,), derivatives (m, p) by parameters, (m, q) by these.

        ``rate`` (m,): change of the values over the stroke.
        """
        c, e = self.experiments[k].channels[j], self.experiments[k]
        numbers = {own: m for m, own in enumerate(self.nuisances) if own in ((k, j), (k, None))}
        gain, offset = numbers.get((k, j)), numbers.get((k, None))
        z = np.zeros((len(y), len(more)))
        if offset is not None:
            y, dy = y + rate * e.offset * more[offset], dy + over_stroke(dy, e.stroke[c.rows]) * e.offset * more[offset]
            z[:, offset] = rate * e.offset
        if gain is not None:
            by = 1.0 + c.gain * more[gain]
            y, dy, z = by * y, by * dy, by * z
            z[:, gain] = c.gain * y / by
        return y, dy, z

    def _words(self, values: Mapping[str, float]) -> str:
        return ", ".join(f"{path} {value:.5g}" for path, value in values.items())

    def _predicted(self, k: int, values: Mapping[str, float], sloped: bool) -> Any:
        e, paths = self.experiments[k], [q.path for q in self.parameters]
        seen = [(str(c.measure), c.scale, c.shift, c.rows.tolist()) for c in e.channels]
        text = dump(Case(e.problem, e.numerics)) + repr((sorted(values.items()), paths, e.times.tolist(), e.pace.tolist(), seen))
        key = hashlib.sha256(text.encode()).hexdigest()
        # A run without derivatives has a key of its own, so that nobody takes it for one with them.
        if not sloped and key not in self._known:
            paths, key = [], f"{key}-values"
        if key not in self._known:
            kept = self.cache / f"{key[:24]}{key[64:]}.json" if self.cache is not None else None
            if kept is not None and (found := _kept_run(kept)) is not None:
                self._known[key] = found
            else:
                self.runs += 1
                with silenced(self.runs > len(self.experiments)):
                    p = e.predict(values, paths)
                self._known[key] = [[v.tolist() for v in parts] for parts in zip(p.values, p.slopes, p.rates)]
                if kept is not None:
                    write_text(kept, json.dumps(self._known[key]), shared=True)
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
            raise PrensaError(
                f"calibrate: the case has no answer at the start {self._words(self.values(start))}: {self.failure}"
            )
        if self.curves:
            return self._along_curves(start, first, low, high)
        count = len(first.r)

        def residuals(way: Array) -> Array:
            got = self.at(start + way)
            # Where the case has no answer residuals are worse than at the start: the trust region shrinks back, and the fit
            # goes on.
            return np.full(count, NO_ANSWER + float(np.abs(first.r).max())) if got is None else got.r

        def slopes(way: Array) -> Array:
            got = self.at(start + way)
            if got is None:
                return np.zeros((count, n))
            # SciPy's criteria on χ² or the step alone take one to three runs more that change nothing.
            if self._settled(got, start + way, low, high):
                raise _Settled(start + way)
            return got.J

        try:
            # Searches without derivatives take 120 runs where this takes 8.
            found = least_squares(
                residuals, np.zeros(n), jac=slopes, bounds=(low - start, high - start), ftol=SMALL_GAIN, xtol=SMALL_STEP,
                max_nfev=MOST_RUNS,
            )  # fmt: skip
            x = start + found.x
        except _Settled as end:
            x = end.x
        best = self.at(x)
        assert best is not None
        return np.asarray(x), best

    @property
    def curves(self) -> list[Curve]:
        """Flow curves of which several numbers are fitted."""
        return curves_of(self.experiments[0].problem, [p.path for p in self.parameters], [p.value for p in self.parameters])

    def _along_curves(self, x: Array, at: Residuals, low: Array, high: Array) -> tuple[Array, Residuals]:
        """As `minimise`: each step goes to where residuals are least as the stresses of the curves predict them
        (`LinearisedResiduals`).
        """
        curves, reach = self.curves, TRUSTED
        for _ in range(MOST_RUNS):
            near = LinearisedResiduals(curves, x, at.r, at.J)
            y = near.least(x, np.maximum(low, x - reach), np.minimum(high, x + reach))
            gain, idle = at.square - near.square(y), IDLE_STEP * max(1.0, at.square / max(len(at.r) - len(x), 1))
            within = bool((np.abs(y - x) < 0.99 * reach).all())
            if within and gain < idle:
                break
            found = self.at(y)
            if found is not None and abs(found.square - at.square) < idle:
                return (y, found) if found.square < at.square else (x, at)
            if found is None or found.square >= at.square:
                if found is not None and within and gain < ROUGH * idle:
                    break  # increments are others in each run, and χ² is rough by that
                reach = 0.25 * min(reach, float(np.abs(y - x).max()))
                if reach < SMALL_STEP:
                    break
                continue
            share = (at.square - found.square) / gain
            reach = 0.5 * reach if share < 0.25 else 2.0 * reach if share > 0.75 else reach
            x, at = y, found
        return x, at

    @staticmethod
    def _settled(at: Residuals, x: Array, low: Array, high: Array) -> bool:
        """Whether the next step of Gauss and Newton would change the answer by a small part of its errors only."""
        free = (x > low + SMALL_STEP) & (x < high - SMALL_STEP)
        if not free.all():
            return False
        step, *_ = np.linalg.lstsq(at.J, -at.r, rcond=ROUND_OFF)
        gain = float(np.linalg.norm(at.J @ step) ** 2)
        return gain < IDLE_STEP * max(1.0, at.square / max(len(at.r) - len(x), 1))


def _kept_run(path: Path) -> Any:
    """What a run has kept in a file; None where there is none, or one that a power cut left in pieces."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None


class _Settled(Exception):
    """The fit has ended at ``x``."""

    def __init__(self, x: Array) -> None:
        super().__init__()
        self.x = x
