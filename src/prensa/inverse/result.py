"""What a calibration found: parameters with intervals, what trades with what, residuals, and how well the case fits at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.inverse.objective import Objective, Residuals
from prensa.materials.flow_curve import FlowCurve, stress_at
from prensa.model.problem import Case, Problem
from prensa.model.schema import dump
from prensa.sensitivity.parameters import with_values

Array = NDArray[np.float64]

CONFIDENCE = 0.95
UNUSUAL = 0.05  # probability below which residuals are not those of chance
IDLE = 1e-3  # change of a channel over its error when a parameter doubles, below which that does not move it
WEAK = 10.0  # ratio of the errors of the worst and the best told directions from which one is worth words
BAND = (0.01, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)  # plastic strains of the band of a flow curve


@dataclass(frozen=True)
class Interval:
    """A parameter: its value, half its 95 % interval by noise alone, and what a finer mesh changes (nan: unknown)."""

    value: float
    noise: float
    mesh: float
    start: float
    log: bool

    @property
    def low(self) -> float:
        """Lower end, mesh included."""
        return self._end(-1.0)

    @property
    def high(self) -> float:
        """Upper end, mesh included."""
        return self._end(1.0)

    def _end(self, sign: float) -> float:
        wide = self.noise + (abs(self.mesh) if np.isfinite(self.mesh) else 0.0)
        return float(self.value * np.exp(sign * wide / self.value)) if self.log else self.value + sign * wide


@dataclass(frozen=True)
class Channel:
    """A column beside what the fitted case says: ``runs`` is the probability of so few changes of sign by chance."""

    test: str
    name: str
    unit: str
    stroke: Array
    along: str
    readings: Array
    model: Array
    sigma: float
    runs: float

    @property
    def misfit(self) -> float:
        """Root mean square of the residuals over the standard error of a reading; about 1 if both are right."""
        return float(np.sqrt((((self.model - self.readings) / self.sigma) ** 2).mean()))


@dataclass(frozen=True)
class Fit:
    """The outcome of a calibration, see `calibrate`.

    ``correlation`` (k, k) of the parameters; ``reduced``: χ²/ν; ``instruments``: gains and offsets that were found, by name;
    ``starts``: χ² from every start; ``words``: what there is to say in sentences; ``bands``: by the path of a flow curve, plastic
    strains, stresses and half widths of their 95 % intervals.
    """

    problem: Problem
    parameters: Mapping[str, Interval]
    correlation: Array
    channels: Sequence[Channel]
    reduced: float
    freedom: int
    instruments: Mapping[str, float]
    starts: Sequence[float]
    runs: int
    words: Sequence[str]
    bands: Mapping[str, tuple[Array, Array, Array]]

    def __str__(self) -> str:
        lines = [f"{'parameter':44s} {'value':>10s}   95 % interval"]
        for path, p in self.parameters.items():
            mesh = f"   (mesh {p.mesh:+.2g})" if np.isfinite(p.mesh) else ""
            lines.append(f"{path:44s} {p.value:10.5g}   {p.low:.5g} … {p.high:.5g}{mesh}")
        lines.append(f"χ²/ν {self.reduced:.3g} with ν = {self.freedom}; {self.runs} runs")
        return "\n".join([*lines, *self.words])

    @property
    def values(self) -> dict[str, float]:
        """The parameters by path."""
        return {path: p.value for path, p in self.parameters.items()}

    @property
    def case(self) -> Problem:
        """The case with the values that were found."""
        return with_values(self.problem, self.values)

    def write_case(self, path: str | Path) -> Path:
        """Write the case with the found values as a case file."""
        from prensa.output.files import write_text

        return write_text(Path(path), dump(Case(self.case)))

    def report(self, path: str | Path) -> Path:
        """Write a page (HTML) that tells all of it with pictures and needs nothing but itself."""
        from prensa.inverse.page import write_page

        return write_page(self, Path(path))


def fit_of(objective: Objective, found: Sequence[tuple[Array, Residuals]], fine: tuple[Array, Residuals] | None) -> Fit:
    """The outcome from the fits of all starts, the best first, and the fit on a finer mesh."""
    from scipy.stats import t

    (x, at), k = fine or found[0], len(objective.parameters)
    coarse = found[0][0]
    freedom = max(len(at.r) - len(x), 1)
    reduced = at.square / freedom
    covariance = np.asarray(np.linalg.pinv(at.J.T @ at.J, rcond=1e-14) * max(reduced, 1.0), dtype=np.float64)
    wide = float(t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))
    spread = np.sqrt(np.diag(covariance))
    parameters = {}
    for i, p in enumerate(objective.parameters):
        value = p.value(x[i])
        mesh = value - p.value(coarse[i]) if fine is not None else np.nan
        parameters[p.path] = Interval(value, float(wide * spread[i] * abs(p.slope(value))), mesh, p.start, p.log)
    channels = list(_channels(objective, at))
    known = np.where(spread[:k] > 0.0, spread[:k], np.inf)  # a parameter that moves nothing goes with no other
    correlation = covariance[:k, :k] / np.outer(known, known)
    problem = objective.experiments[0].problem
    words = [*_idle(objective, at), *_weak(objective, covariance[:k, :k]), *_chance(channels, reduced)]
    words += [note for e in objective.experiments for note in e.notes]
    if fine is None:
        words.append("the error of the mesh is not known: the intervals have that of the readings alone")
    if len(found) > 1:
        same = sum(f[1].square <= found[0][1].square * 1.01 + 0.1 for f in found)
        words.append(f"{same} of {len(found)} starts led to this answer")
    instruments = dict(zip(_named(objective), (float(v) for v in _amounts(objective, x[k:]))))
    bands = dict(_bands(problem, objective, x, covariance[:k, :k], wide))
    return Fit(
        problem=problem, parameters=parameters, correlation=correlation, channels=channels, reduced=reduced, freedom=freedom,
        instruments=instruments, starts=[f[1].square for f in found], runs=objective.runs, words=words, bands=bands,
    )  # fmt: skip


def _channels(objective: Objective, at: Residuals) -> Any:
    models = iter(at.models)
    for e in objective.experiments:
        for c in e.channels:
            model = next(models)
            unit, stroke, chance = c.measure.unit, e.stroke[c.rows], runs_test(model - c.readings)
            yield Channel(e.name, c.name, unit, stroke, e.along, c.readings, model, c.sigma, chance)


def runs_test(residuals: Array) -> float:
    """Probability that residuals (m,) of independent errors have as few runs of one sign or fewer (Wald and Wolfowitz 1940)."""
    signs = residuals > 0
    n, a = len(signs), int(signs.sum())
    b = n - a
    if n < 2 or a == 0 or b == 0:
        return 1.0 if n < 6 else float(0.5 ** (n - 1))
    runs = 1 + int((signs[1:] != signs[:-1]).sum())
    total = 0.0
    for r in range(2, runs + 1):
        h = r // 2
        # ways to cut a and b readings into runs, over the ways to order them: products of hypergeometric probabilities
        if r % 2 == 0:
            total += 2.0 * _ways(a - 1, h - 1) * _ways(b - 1, h - 1)
        else:
            total += _ways(a - 1, h) * _ways(b - 1, h - 1) + _ways(a - 1, h - 1) * _ways(b - 1, h)
    return float(min(total / _ways(n, a), 1.0))


def _ways(n: int, k: int) -> float:
    from scipy.special import comb

    return float(comb(n, k))


def _idle(objective: Objective, at: Residuals) -> Any:
    """Channels that no parameter moves, and parameters that move no channel."""
    k, row = len(objective.parameters), 0
    for e in objective.experiments:
        for c in e.channels:
            if np.abs(at.J[row : row + len(c.rows), :k]).max() < IDLE:
                yield f"no parameter moves {c.name!r}: it tells nothing about them"
            row += len(c.rows)
    for i, p in enumerate(objective.parameters):
        if np.abs(at.J[:row, i]).max() < IDLE:
            yield f"{p.path} moves nothing that was measured: its value is that of the start"


def _weak(objective: Objective, covariance: Array) -> Any:
    """The direction of the parameters that is told worst, in words."""
    if len(covariance) < 2:
        return
    sizes, ways = np.linalg.eigh(covariance)
    if not sizes[-1] > WEAK**2 * max(sizes[0], 0.0):
        return
    way = ways[:, -1] / np.abs(ways[:, -1]).max()
    told = [(p.path, float(w)) for p, w in zip(objective.parameters, way) if abs(w) > 0.1]
    if len(told) < 2:
        return
    parts = [f"{path} by {10 * w:+.2g} %" for path, w in told]
    error = 100 * float(np.sqrt(sizes[-1]) * np.abs(ways[:, -1]).max())
    yield (
        f"told worst: {' and '.join(path for path, _ in told)} trade. A change of {', '.join(parts)} is hardly seen; along this "
        f"direction the standard error is {error:.2g} %. Measure one of them otherwise, or fix it"
    )


def _chance(channels: Sequence[Channel], reduced: float) -> Any:
    for c in channels:
        if c.runs < UNUSUAL:
            yield (
                f"{c.name}: the residuals keep their sign for long (probability by chance {c.runs:.2g}): the case misses "
                "something there, and the intervals do not know it"
            )
    if reduced > 2.0:
        yield (
            f"χ²/ν is {reduced:.3g}: readings are farther from the case than their errors; the intervals are widened by "
            f"{reduced**0.5:.2g}"
        )


def _named(objective: Objective) -> Any:
    for k, j in objective.nuisances:
        e = objective.experiments[k]
        yield f"{e.name}: offset" if j is None else f"{e.name}: gain of {e.channels[j].name}"


def _amounts(objective: Objective, more: Array) -> Any:
    for (k, j), v in zip(objective.nuisances, more):
        e = objective.experiments[k]
        yield v * e.offset if j is None else 1.0 + v * e.channels[j].gain


def _bands(problem: Problem, objective: Objective, x: Array, covariance: Array, wide: float) -> Any:
    """Band of every flow curve that has fitted parameters, by the linearised errors of all of them."""
    values = objective.values(x)
    for body in problem.bodies:
        path = f"bodies.{body}.material.flow"
        own = [i for i, p in enumerate(objective.parameters) if p.path.startswith(f"{path}.")]
        if not own:
            continue

        def stress(shifted: Mapping[str, float], body: str = body) -> Array:
            material: Any = with_values(problem, shifted).bodies[body].material
            curve: FlowCurve = material.flow
            return stress_at(curve, np.array(BAND), np.zeros(len(BAND)))

        slopes = np.zeros((len(BAND), len(objective.parameters)))
        for i in own:
            p = objective.parameters[i]
            step = 1e-5
            above, below = (stress({**values, p.path: p.value(x[i] + s * step)}) for s in (1.0, -1.0))
            slopes[:, i] = (above - below) / (2 * step)
        half = wide * np.sqrt(np.einsum("si,ij,sj->s", slopes, covariance, slopes))
        yield path, (np.array(BAND), stress(values), half)
