"""Results of a calibration: parameters with intervals, their correlations, residuals, and the quality of the fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from prensa.inverse.ends import End
from prensa.inverse.flow_laws import CONFIDENCE
from prensa.inverse.objective import IDLE, SMALL_STEP, Objective, Residuals, grown
from prensa.inverse.profile import Profile
from prensa.inverse.rivals import Rival
from prensa.materials.flow_curve import FlowCurve, stress_at
from prensa.model.problem import Case, Problem
from prensa.model.schema import dump
from prensa.precision import DRAWN, FIRST_DIFFERENCE
from prensa.sensitivity.parameters import with_values
from prensa.types import Array

UNUSUAL = 0.05  # probability below which residuals are not those of chance
SLIP = 5  # residual over the error, and over those of the others, from which a reading is suspected
BETTER = 0.1  # χ² by which another place has to be better to be reported
UNDETERMINED, FAR_OFF = 0.5, 1.0  # standard error, and way, in what is varied beyond which nothing is reported without a column
WEAK = 10.0  # ratio of the errors of the worst and the best determined directions from which one is reported
BAND = (0.01, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)  # plastic strains of the band of a flow curve


@dataclass(frozen=True)
class Interval:
    """A parameter: its value, half its 95 % interval by noise alone, and what a finer mesh changes (nan: unknown).

    ``profile``: how good that half is, and better ends where it is not (None: not looked at). ``scatter``: what it would be
    changed by if the readings changed as the finer mesh changes them, but each by itself one way or the other. ``one_sided``:
    its ends where the value lies at an end of its range, by the readings alone.
    """

    value: float
    noise: float
    mesh: float
    start: float
    log: bool
    profile: Profile | None = None
    scatter: float = 0.0
    one_sided: tuple[float, float] | None = None

    @property
    def of_mesh(self) -> float:
        """What the interval has at each side for the error of the mesh: the larger of `mesh` and `scatter`; nan if unknown."""
        return max(abs(self.mesh), self.scatter) if np.isfinite(self.mesh) else np.nan

    @property
    def low(self) -> float:
        """Lower end, mesh included."""
        return self._end(-1.0)

    @property
    def high(self) -> float:
        """Upper end, mesh included."""
        return self._end(1.0)

    def _end(self, sign: float) -> float:
        if self.one_sided is not None:
            return self.one_sided[0 if sign < 0 else 1]
        halves = 1.0 if self.profile is None else self.profile.low if sign < 0 else self.profile.high
        # A sum: with the quantile of |N(b, 1)| a strength was held in 82 of 100 synthetic cases, with the mesh's error as a
        # direction of the readings a friction in 64 of 100.
        wide = halves * self.noise + (self.of_mesh if np.isfinite(self.mesh) else 0.0)
        if not np.isfinite(wide):
            return float(sign * np.inf) if sign > 0 or not self.log else 0.0
        return grown(self.value, sign * wide / self.value) if self.log else self.value + sign * wide

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the interval by the readings alone."""
        if self.one_sided is not None:
            return self.one_sided
        low, high = self.at(np.array([-1.0, 1.0] if self.profile is None else [-self.profile.low, self.profile.high]))
        return float(low), float(high)

    @property
    def by_mesh(self) -> tuple[float, float]:
        """What the error of the mesh adds to `ends` below and above: the parts add up to `low` and `high`; 0 at open ends."""
        (low, high), (first, last) = self.ends, (self.low, self.high)
        return (low - first if np.isfinite(low) else 0.0, last - high if np.isfinite(high) else 0.0)

    @property
    def followed(self) -> bool:
        """Whether the interval is that of a profile likelihood."""
        return self.profile is not None and self.profile.followed

    def at(self, halves: Array) -> Array:
        """The parameter at ways (m,) from its value in half widths of the linear interval."""
        way = np.asarray(halves) * self.noise
        return np.array([grown(self.value, w / self.value) for w in way]) if self.log else np.asarray(self.value + way)


@dataclass(frozen=True)
class Channel:
    """A column beside what the fitted case says, ``sigma`` (m,); ``runs``: probability of so few changes of sign by chance."""

    test: str
    name: str
    unit: str
    stroke: Array
    along: str
    readings: Array
    model: Array
    sigma: Array
    runs: float

    @property
    def misfit(self) -> float:
        """Root mean square of the residuals over the standard error of a reading; about 1 if both are right."""
        return float(np.sqrt((((self.model - self.readings) / self.sigma) ** 2).mean()))


@dataclass(frozen=True)
class Fit:
    """The outcome of a calibration, see `calibrate`.

    ``asked``: cases as they were given, by test; ``correlation`` (k, k) of the parameters; ``reduced``: χ²/ν;
    ``instruments``: gains and offsets that were found, by name; ``starts``: χ² from every start; ``words``: what there is to
    say in sentences; ``bands``: by the path of a flow curve, plastic strains, stresses and half widths of their 95 % intervals;
    ``rival``: the fit with the other law of friction; ``without``: by the name of a column, the parameters (k,) that the
    others lead to, nan where they determine none (linearised).
    """

    asked: Mapping[str, Case]
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
    rival: Rival | None = None
    without: Mapping[str, Array] = field(default_factory=dict)

    def __str__(self) -> str:
        lines = [f"{'parameter':44s} {'value':>10s}   95 % interval"]
        for path, p in self.parameters.items():
            mesh = f"   (mesh {p.mesh:+.2g})" if np.isfinite(p.mesh) else ""
            how = "   (profile)" if p.followed else "   (one side)" if p.one_sided is not None else ""
            lines.append(f"{path:44s} {p.value:10.5g}   {p.low:.5g} … {p.high:.5g}{mesh}{how}")
        lines.append(f"χ²/ν {self.reduced:.3g} with ν = {self.freedom}; {self.runs} runs")
        return "\n".join([*lines, *self.words])

    @property
    def problem(self) -> Problem:
        """The case, of the first test, as it was given."""
        return next(iter(self.asked.values())).problem

    @property
    def values(self) -> dict[str, float]:
        """The parameters by path."""
        return {path: p.value for path, p in self.parameters.items()}

    @property
    def case(self) -> Problem:
        """The case, of the first test, with the values that were found."""
        return self.cases[0].problem

    @property
    def cases(self) -> list[Case]:
        """The cases of all tests with the values that were found."""
        return [Case(with_values(c.problem, self.values), c.numerics) for c in self.asked.values()]

    def write_case(self, path: str | Path) -> Path:
        """Write the case, of the first test, with the found values as a case file."""
        from prensa.output.files import write_text

        return write_text(Path(path), dump(self.cases[0]))

    def write_cases(self, folder: str | Path) -> list[Path]:
        """Write the cases of all tests into a folder: ``case.yaml``, or ``case-<test>.yaml`` where there are several."""
        from prensa.output.files import file_name, write_text

        names = ["case"] if len(self.asked) == 1 else [f"case-{file_name(name)}" for name in self.asked]
        return [write_text(Path(folder) / f"{name}.yaml", dump(case)) for name, case in zip(names, self.cases)]

    def report(self, path: str | Path) -> Path:
        """Write a page (HTML) with all results and pictures that needs no other file."""
        from prensa.inverse.page import write_page

        return write_page(self, Path(path))


class Finer(NamedTuple):
    """The fit on finer meshes: unknowns x (n,), residuals there, and their ``change`` (r,) with the mesh at fixed unknowns."""

    x: Array
    at: Residuals
    change: Array


def scattered(J: Array, change: Array) -> Array:
    """Ways (n,) that residuals which change by so much (r,), each by itself one way or the other, move unknowns.

    Nodes that land one after the other make the error of a mesh go up and down along a test; what a refit shows of it in the
    direction that readings determine worst is then a matter of chance.
    """
    return np.asarray(np.sqrt(((np.linalg.pinv(J) * change) ** 2).sum(axis=1)))


def half_widths(at: Residuals, unknowns: int) -> tuple[Array, Array, float]:
    """Covariance (n, n), ways (n,) to the ends of 95 % intervals by the linear problem, and how many standard errors they are."""
    from scipy.stats import t

    freedom = max(len(at.r) - unknowns, 1)
    # Readings that scatter more than was said widen the intervals; those that scatter less narrow nothing.
    covariance = np.asarray(np.linalg.pinv(at.J.T @ at.J) * max(at.square / freedom, 1.0), dtype=np.float64)
    wide = float(t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))
    return covariance, wide * np.sqrt(np.diag(covariance)), wide


def fit_of(
    objective: Objective, found: Sequence[tuple[Array, Residuals]], fine: Finer | None,
    profiles: Sequence[Profile | None] = (), rival: Rival | str | None = None,
) -> Fit:  # fmt: skip
    """The outcome from the fits of all starts, the best first, the fit on a finer mesh, profiles and the other law."""
    # The finer mesh is nearer to the truth: its fit is the answer, the coarse one shows the effect of the mesh.
    (x, at), k = (fine.x, fine.at) if fine is not None else found[0], len(objective.parameters)
    coarse = found[0][0]
    freedom = max(len(at.r) - len(x), 1)
    reduced = at.square / freedom
    covariance, halves, wide = half_widths(at, len(x))
    spread = halves / wide
    parameters, scatter = {}, np.zeros(len(x)) if fine is None else scattered(at.J, fine.change)
    for i, p in enumerate(objective.parameters):
        value = p.value(x[i])
        mesh = value - p.value(coarse[i]) if fine is not None else np.nan
        parameters[p.path] = Interval(
            value, float(halves[i] * abs(p.slope(value))), mesh, p.start, p.log, profiles[i] if profiles else None,
            float(scatter[i] * abs(p.slope(value))),
        )
    channels = list(_channels(objective, at))
    known = np.where(spread[:k] > 0.0, spread[:k], np.inf)  # a parameter that moves nothing goes with no other
    correlation = covariance[:k, :k] / np.outer(known, known)
    problem = objective.experiments[0].problem
    words = [*_idle(objective, x, at), *_weak(objective, covariance[:k, :k]), *_chance(channels, reduced), *_slips(channels)]
    words += [*_followed(parameters, found[0][1].square)]
    words += [rival] if isinstance(rival, str) else [rival.words] if rival is not None else []
    words += [note for e in objective.experiments for note in e.notes]
    if fine is None:
        words.append("the error of the mesh is not known: the intervals include only the errors of the readings")
    if len(found) > 1:
        same = sum(f[1].square <= found[0][1].square + BETTER for f in found)
        words.append(f"{same} of {len(found)} starts led to this answer")
    instruments = dict(zip(_named(objective), (float(v) for v in _amounts(objective, x[k:]))))
    bands = dict(_bands(problem, objective, x, covariance[:k, :k], wide))
    return Fit(
        asked={e.name: Case(e.problem, e.numerics) for e in objective.experiments}, parameters=parameters, channels=channels,
        correlation=correlation, reduced=reduced, freedom=freedom, instruments=instruments, starts=[f[1].square for f in found],
        runs=objective.runs, words=words, bands=bands, rival=rival if isinstance(rival, Rival) else None,
        without=dict(_without(objective, x, at)),
    )  # fmt: skip


def with_ends(fit: Fit, order: Sequence[str], ends: Sequence[End]) -> Fit:
    """The fit of the other parameters with those that lie at ends of their ranges, paths in ``order``."""
    if not ends:
        return fit
    known = dict(fit.parameters)
    for e in ends:
        p = e.parameter
        # Of an infinite end the limit is the lower end of the interval, of a bound the one on the other side.
        pair = (e.end, e.limit) if e.lower else (e.limit, e.end)
        known[p.path] = Interval(e.value, 0.0, np.nan, p.start, p.log, one_sided=pair)
    at = [list(order).index(path) for path in fit.parameters]
    correlation = np.eye(len(order))
    correlation[np.ix_(at, at)] = fit.correlation
    without = {}
    for name, values in fit.without.items():
        without[name] = np.full(len(order), np.nan)
        without[name][at] = values
    return replace(
        fit, parameters={path: known[path] for path in order}, correlation=correlation, without=without,
        words=[*(e.words for e in ends), *fit.words],
    )  # fmt: skip


def _channels(objective: Objective, at: Residuals) -> Any:
    models = iter(at.models)
    for e in objective.experiments:
        for c in e.channels:
            model = next(models)
            sign = -1.0 if e.along.startswith("-") else 1.0
            unit, stroke, chance = c.measure.unit, sign * e.stroke[c.rows], runs_test(model - c.readings)
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


def idle_channels(objective: Objective, at: Residuals) -> Iterator[str]:
    """Names of the channels that no parameter moves."""
    k, row = len(objective.parameters), 0
    for e in objective.experiments:
        for c in e.channels:
            if np.abs(at.J[row : row + len(c.rows), :k]).max() < IDLE:
                yield c.name
            row += len(c.rows)


def _idle(objective: Objective, x: Array, at: Residuals) -> Any:
    """Channels that no parameter moves, and parameters that move no channel."""
    yield from (f"no parameter affects {name!r}: it says nothing about them" for name in idle_channels(objective, at))
    rows = sum(len(c.rows) for e in objective.experiments for c in e.channels)
    for i, p in enumerate(objective.parameters):
        if np.abs(at.J[:rows, i]).max() < IDLE:
            stayed = abs(x[i] - p.inner(p.start)) <= SMALL_STEP
            went = f"at {p.value(x[i]):.3g}, where the fit went, it may have any value"
            where = "its value is that of the start" if stayed else went
            yield f"{p.path} affects nothing that was measured: {where}"


def _weak(objective: Objective, covariance: Array) -> Any:
    """The direction of the parameters that is determined worst, in words."""
    if len(covariance) < 2:
        return
    sizes, ways = np.linalg.eigh(covariance)
    if not sizes[-1] > WEAK**2 * max(sizes[0], 0.0):
        return
    way = ways[:, -1] / np.abs(ways[:, -1]).max()
    mixed = [(p.path, float(w)) for p, w in zip(objective.parameters, way) if abs(w) > 1.0 / WEAK]
    if len(mixed) < 2:
        return
    parts = [f"{path} by {10 * w:+.2g} %" for path, w in mixed]
    error = 100 * float(np.sqrt(sizes[-1]) * np.abs(ways[:, -1]).max())
    yield (
        f"least certain: {' and '.join(path for path, _ in mixed)} trade off against each other. A change of {', '.join(parts)} "
        f"is hardly seen; along this direction the standard error is {error:.2g} %. Measure one of them independently, or fix it"
    )


def _chance(channels: Sequence[Channel], reduced: float) -> Any:
    for c in channels:
        if c.runs < UNUSUAL:
            yield (
                f"{c.name}: the residuals have long runs of one sign (probability by chance {c.runs:.2g}): the model misses "
                "something there that the intervals do not include"
            )
    if reduced > 2.0:
        yield (
            f"χ²/ν is {reduced:.3g}: the readings deviate from the case by more than their errors; the intervals are widened by "
            f"{reduced**0.5:.2g}"
        )


def _slips(channels: Sequence[Channel]) -> Any:
    """Readings that are so far off that somebody may have written them down wrongly."""
    for c in channels:
        apart = np.abs(c.model - c.readings) / c.sigma
        k = int(apart.argmax())
        others = float(np.sqrt(np.mean(np.delete(apart, k) ** 2))) if len(apart) > SLIP else np.inf
        if apart[k] > SLIP * max(others, 1.0):
            yield (
                f"{c.name}: the reading {c.readings[k]:.5g} at {c.along} = {c.stroke[k]:.4g} is {apart[k]:.3g} errors off, the "
                f"others {others:.2g}: check whether it was recorded wrongly"
            )


def _followed(parameters: Mapping[str, Interval], square: float) -> Any:
    """Where the linear intervals are bad, and where a profile led to a better fit."""
    for path, p in parameters.items():
        if p.followed:
            assert p.profile is not None
            ends = [side for side, end in (("lower", p.profile.low), ("upper", p.profile.high)) if not np.isfinite(end)]
            yield (
                f"{path}: strongly nonlinear ({p.profile.bent:.0%} at the ends of the linear interval), so its interval is that "
                "of the profile likelihood" + (f"; no {' and no '.join(ends)} bound" if ends else "")
            )
    least = min((p.profile.least for p in parameters.values() if p.profile is not None), default=square)
    if least < square - BETTER:
        yield f"elsewhere χ² {least:.4g} was found, less than the {square:.4g} here: this is not the best fit; give more starts"


def _without(objective: Objective, x: Array, at: Residuals) -> Any:
    """Parameters without each column, by one step of Gauss and Newton from the answer of all."""
    k, row = len(objective.parameters), 0
    several = len(objective.experiments) > 1
    if sum(len(e.channels) for e in objective.experiments) < 2:
        return
    for e in objective.experiments:
        for c in e.channels:
            J, r = (np.delete(v, np.s_[row : row + len(c.rows)], axis=0) for v in (at.J, at.r))
            row += len(c.rows)
            covariance = np.linalg.pinv(J.T @ J)
            moved = x - covariance @ (J.T @ r)
            undetermined = np.sqrt(np.maximum(np.diag(covariance), 0.0))[:k] > UNDETERMINED
            rank_short = np.linalg.matrix_rank(J, tol=DRAWN * float(np.linalg.norm(J))) < len(x)
            values = np.array([p.value(v) if abs(v - w) < FAR_OFF else np.nan for p, v, w in zip(objective.parameters, moved, x)])
            values[undetermined | rank_short] = np.nan
            yield (f"{e.name}: {c.name}" if several else c.name), values


def _named(objective: Objective) -> Any:
    for k, j in objective.nuisances:
        e = objective.experiments[k]
        yield f"{e.name}: offset" if j is None else f"{e.name}: gain of {e.channels[j].name}"


def _amounts(objective: Objective, more: Array) -> Any:
    for (k, j), v in zip(objective.nuisances, more):
        e = objective.experiments[k]
        sign = -1.0 if e.along.startswith("-") else 1.0
        yield sign * v * e.offset if j is None else 1.0 + v * e.channels[j].gain


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
            step = FIRST_DIFFERENCE
            above, below = (stress({**values, p.path: p.value(x[i] + s * step)}) for s in (1.0, -1.0))
            slopes[:, i] = (above - below) / (2 * step)
        half = wide * np.sqrt(np.einsum("si,ij,sj->s", slopes, covariance, slopes))
        yield path, (np.array(BAND), stress(values), half)
