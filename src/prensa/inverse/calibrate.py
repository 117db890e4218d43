"""Calibration: the parameters with which a case says what was measured, and how far the measurements support them.

Gauss-Newton in scipy's trust region (`scipy.optimize.least_squares`, Branch, Coleman and Li 1999) on exact derivatives, in
logarithms of positive parameters. Intervals are those of the linearised problem, widened by what a finer mesh changes.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from prensa.errors import ArgumentError, PrensaError, shown, take
from prensa.inverse.ends import End, bounded, ends_of, without
from prensa.inverse.experiment import Experiment, Observe, Test, ready, refuse_strange, refuse_twice, refuse_vague
from prensa.inverse.meshes import finer
from prensa.inverse.objective import IDLE, Objective, Parameter, Residuals
from prensa.inverse.profile import Profile, profile
from prensa.inverse.result import Finer, Fit, fit_of, half_widths, idle_channels, with_ends
from prensa.inverse.rivals import compared
from prensa.inverse.tables import DataError
from prensa.model.problem import Case, Problem
from prensa.output.interrupt import Interruptible
from prensa.sensitivity.parameters import value_of
from prensa.types import Array

log = logging.getLogger("prensa")
Bounds = tuple[float, float] | None


def _started(parameters: Sequence[Parameter], number: int, seed: int) -> Iterable[list[float]]:
    """Starts: that of the case, then others between the bounds, or within a factor of three where there are none."""
    from scipy.stats import qmc

    if isinstance(number, bool) or not isinstance(number, int) or number < 1:
        raise ArgumentError(f"calibrate: starts is {shown(number)}; give the number of starts, 1 or more")
    yield [p.inner(p.start) for p in parameters]
    if number < 2:
        return
    # A Sobol sequence is balanced at powers of two; starts beyond the number asked for are dropped.
    samples = qmc.Sobol(len(parameters), seed=seed).random_base2(max(1, int(np.ceil(np.log2(number)))))
    for row in samples[: number - 1]:
        out = []
        for share, p in zip(row, parameters):
            middle, reach = p.inner(p.start), np.log(3.0) if p.log else 1.0
            low, high = max(p.limits[0], middle - reach), min(p.limits[1], middle + reach)
            out.append(low + float(share) * (high - low))
        yield out


def _checked(
    tests: Sequence[Test], parameters: Mapping[str, tuple[float, float] | None] | None
) -> tuple[list[Experiment], list[Parameter]]:
    """Tests and parameters made ready; raises `PrensaError` if there are too few readings, or a path leads nowhere."""
    take(
        "calibrate", "parameters", parameters, Mapping, "give bounds by path, for example {'friction.mu': (0.02, 0.5)}"
    )
    if not tests or not parameters:
        raise ArgumentError("calibrate: there is nothing to fit; give a test and parameters")
    for t in tests:
        take("calibrate", "a test", t, Test, "give Test(case, data, observe, along)")
    experiments = _named_apart([ready(t, k) for k, t in enumerate(tests, 1)])
    for e in experiments:
        refuse_vague(e)
    refuse_twice(experiments)
    if len({(e.problem.units.length, e.problem.units.force) for e in experiments}) > 1:
        raise ArgumentError("calibrate: cases have different units, so a parameter cannot be one number; use the same units")
    known = [Parameter.of(p, value_of(experiments[0].problem, p), b) for p, b in parameters.items()]
    for e in experiments[1:]:
        for p in known:
            value_of(e.problem, p.path)
    readings = sum(e.count for e in experiments)
    if readings <= len(known):
        raise DataError(f"calibrate: {readings} readings cannot determine {len(known)} parameters; take more, or fit fewer")
    return experiments, known


def _named_apart(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Experiments of which no two have one name."""
    names = [e.name for e in experiments]
    return [replace(e, name=e.name if names.count(e.name) == 1 else f"{e.name} ({k})") for k, e in enumerate(experiments, 1)]


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
    compare: bool = True,
    profiles: bool = True,
    keep: str | Path | None = None,
    report: Callable[[str], None] | None = None,
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
    compare
        Where a coefficient of friction or a shear factor is fitted, fit the other law as well and say which of both follows the
        readings.
    profiles
        See how nonlinear the problem is at the ends of its linear intervals, and follow the profile likelihood where it is.
    keep
        Folder in which runs are kept, so that a fit that was interrupted goes on.
    report
        Receives a line for every run, and what looks wrong before the fit; if not given, they go to the log, the latter as
        warnings, which Python shows.

    Raises
    ------
    PrensaError
        For data that cannot be used, more parameters than readings, and a case that has no answer where the fit starts.

    """
    if case is not None or data is not None or observe is not None:
        if case is None or data is None or observe is None:
            raise ArgumentError("calibrate: a test needs its case, data and observe; or give tests=[Test(…), …]")
        tests = [Test(case, data, observe, along), *tests]
    experiments, known = _checked(tests, parameters)
    objective = Objective(experiments, known, Path(keep) if keep is not None else None, report or log.info)
    with Interruptible():
        found, first = _best(objective, starts, seed, report or log.warning)
        return _around(objective, found, first, refine, profiles, compare)


def _around(
    objective: Objective, found: list[tuple[Array, Residuals]], first: Residuals | None, refine: bool, profiles: bool,
    compare: bool,
) -> Fit:  # fmt: skip
    """The outcome around the best of fits; ``first``: residuals at the start. Else see `calibrate`."""
    paths = [p.path for p in objective.parameters]
    ends = ends_of(objective, *found[0], first)[: len(paths) - 1]  # one is left to be fitted: its profile ends at its bound
    rest, of_rest = _held(objective, ends, found)
    if ends:
        least, freedom = of_rest[0][1].square, max(len(of_rest[0][1].r) - len(of_rest[0][0]), 1)
        ends = bounded(objective, ends, found[0][0], least, freedom)
        rest.runs = objective.runs
    fine = _refined(rest, *of_rest[0]) if refine else None
    bends = _bends(rest, *of_rest[0]) if profiles else []
    objective.runs = rest.runs
    # The other law may well have its best values elsewhere.
    rival = compared(objective, *found[0]) if compare else None
    rest.runs = objective.runs
    return with_ends(fit_of(rest, of_rest, fine, bends, rival), paths, ends)


def _listed(ends: Sequence[End]) -> str:
    return "; ".join(f"{e.parameter.path} at {e.end:g}" for e in ends)


def _held(
    objective: Objective, ends: Sequence[End], found: list[tuple[Array, Residuals]]
) -> tuple[Objective, list[tuple[Array, Residuals]]]:  # fmt: skip
    """The objective without the parameters that lie at ends of their ranges, and fits of which the best is one of the others."""
    if not ends:
        return objective, found
    rest = without(objective, ends)
    objective.report(f"with {_listed(ends)}")
    best = rest.minimise(np.delete(found[0][0], [e.number for e in ends]))
    objective.runs = rest.runs
    return rest, [best, *found[1:]]


def _refined(objective: Objective, x: Array, at: Residuals) -> Finer | None:
    """The fit on finer meshes, from an answer x (n,); None where a mesh cannot be refined."""
    meshes = [finer(e.problem) for e in objective.experiments]
    experiments = [e.on(p) for e, p in zip(objective.experiments, meshes) if p is not None]
    # One test left on its mesh would keep its error in both fits, and their difference would hide it.
    if len(experiments) < len(meshes):
        return None
    objective.report("the same on a finer mesh")
    # Runs that are known stay known: their keys hold the mesh.
    again = replace(objective, experiments=experiments, _last=None)
    begun = again.at(x)
    found = again.minimise(x)
    objective.runs = again.runs
    assert begun is not None  # it is where that fit began
    return Finer(*found, begun.r - at.r)


def _bends(objective: Objective, x: Array, at: Residuals) -> list[Profile | None]:
    """Profiles of all parameters around an answer; None of those that move nothing."""
    objective.report("how nonlinear the problem is")
    _, halves, _ = half_widths(at, len(x))
    moving, curves = np.abs(at.J[:, : len(objective.parameters)]).max(axis=0) > IDLE, objective.curves
    return [
        profile(objective, x, at, i, halves, p.limits, curves) if moving[i] else None
        for i, p in enumerate(objective.parameters)
    ]


def _best(
    objective: Objective, starts: int, seed: int, doubted: Callable[[str], None]
) -> tuple[list[tuple[Array, Residuals]], Residuals | None]:  # fmt: skip
    """Fits from all starts that have an answer, the best first, and residuals at the start of the case.

    ``doubted`` receives what looks wrong before the first step.
    """
    found, failed = [], None
    more = [0.0] * len(objective.nuisances)
    first = objective.at(np.array([*(p.inner(p.start) for p in objective.parameters), *more]))
    if first is not None:
        models = iter(first.models)
        for e in objective.experiments:
            refuse_strange(e, [next(models) for _ in e.channels])
        for name in idle_channels(objective, first):
            doubted(f"at the start no parameter affects {name!r}; is it the right column?")
    for start in _started(objective.parameters, starts, seed):
        try:
            found.append(objective.minimise(np.array([*start, *more])))
        except PrensaError as error:
            failed = error
    if not found:
        assert failed is not None
        raise failed
    return sorted(found, key=lambda f: f[1].square), first
