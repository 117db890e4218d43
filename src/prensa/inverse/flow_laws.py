"""Flow laws through measured flow stresses by least squares: constants, errors, and how far the laws part beyond the data.

Each law is linear in some of its constants and is fitted by variable projection (Golub & Pereyra 1973, SIAM J. Numer. Anal. 10,
413-432): for the others, found by `scipy.optimize.least_squares` from the best of a grid, these follow from non-negative
least squares.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TypeAlias

import numpy as np

from prensa.materials.flow.hockett_sherby import HockettSherby
from prensa.materials.flow.ludwik import Ludwik
from prensa.materials.flow.swift import Swift
from prensa.materials.flow.swift_voce import SwiftVoce
from prensa.materials.flow.voce import Voce
from prensa.materials.flow_curve import FlowCurve, stress_at
from prensa.precision import FIRST_DIFFERENCE, NEGLIGIBLE, SMALLEST
from prensa.types import Array

_Grid: TypeAlias = tuple[Array, int]
EXPONENT: _Grid = (np.linspace(1 / 20, 19 / 20, 10), 0)
PRESTRAIN: _Grid = (np.ldexp(1.0, np.arange(-16, 1, 2)), 1)
SATURATION: _Grid = (np.ldexp(1.0, np.arange(-3, 7)), -1)
"""Of the grids from which laws are fitted: values, and the power of the last strain by which they are multiplied."""


@dataclass(frozen=True)
class _Law:
    """A law that is linear in some constants: ``columns`` (k, m) at strains (k,) for the ``others``, from a ``grid`` of these.

    Entries of the grid: values, and the power of the last strain by which they are multiplied. ``curve`` makes the law of the
    linear constants and the others; ``constants``: how many it has.
    """

    columns: Callable[[Array, Sequence[float]], Array]
    grid: tuple[_Grid, ...]
    curve: Callable[[Array, Sequence[float]], FlowCurve]
    constants: int


def _mixed(a: Array, o: Sequence[float]) -> SwiftVoce:
    """Weighted so that Swift's and Voce's law begin at one yield stress, that of both: which weight is else arbitrary."""
    (swift, s0, Q), (e0, n, b) = map(float, a), map(float, o)
    first = swift * e0**n
    # One of the two may have no part in it: its constants are then anything that a law may have.
    w = min(max(first / (first + s0), NEGLIGIBLE), 1.0 - NEGLIGIBLE)
    return SwiftVoce(K=max(swift, SMALLEST) / w, e0=e0, n=n, s0=max(s0, SMALLEST) / (1.0 - w), Q=Q / (1.0 - w), b=b, w=w)


def _rise(x: Array, b: float, n: float) -> Array:
    return 1.0 - np.exp(-b * np.maximum(x, 0.0) ** n)


FLOW_LAWS: Mapping[str, _Law] = {
    "swift": _Law(
        lambda x, o: ((o[0] + x) ** o[1])[:, None], (PRESTRAIN, EXPONENT),
        lambda a, o: Swift(K=float(a[0]), e0=float(o[0]), n=float(o[1])), 3,
    ),
    "voce": _Law(
        lambda x, o: np.stack([np.ones_like(x), _rise(x, o[0], 1.0)], 1), (SATURATION,),
        lambda a, o: Voce(s0=float(a[0]), Q=float(a[1]), b=float(o[0])), 3,
    ),
    "ludwik": _Law(
        lambda x, o: np.stack([np.ones_like(x), x ** o[0]], 1), (EXPONENT,),
        lambda a, o: Ludwik(s0=float(a[0]), K=float(a[1]), n=float(o[0])), 3,
    ),
    "hockett_sherby": _Law(
        lambda x, o: np.stack([np.ones_like(x), _rise(x, o[0], o[1])], 1), (SATURATION, EXPONENT),
        lambda a, o: HockettSherby(s0=float(a[0]), s_inf=float(a[0] + a[1]), b=float(o[0]), n=float(o[1])), 4,
    ),
    "swift_voce": _Law(
        lambda x, o: np.stack([(o[0] + x) ** o[1], np.ones_like(x), _rise(x, o[2], 1.0)], 1), (PRESTRAIN, EXPONENT, SATURATION),
        _mixed, 6,
    ),
}  # fmt: skip
"""By type: the laws that are fitted."""


CONFIDENCE = 0.95
"""Of tests, bands and intervals."""


@dataclass(frozen=True)
class FittedCurve:
    """A law through measured stresses: ``residuals`` (k,), measured less fitted, and the standard ``error`` of one reading.

    The error is √(Σr²/(k − m)) of a law with m constants. ``band``: half the width (n,) of the 95 % confidence band of the curve
    at strains (n,), by the covariance of the constants, as if the law were true. ``determined``: whether the 95 % intervals
    of all constants exclude zero. ``worse``: whether its residuals are larger
    than those of the law of the least error, and by more than scatter where that has more constants.
    """

    law: str
    curve: FlowCurve
    residuals: Array
    error: float
    band: Callable[[Array], Array]
    determined: bool
    worse: bool = False

    @property
    def constants(self) -> int:
        """How many constants the law has."""
        return FLOW_LAWS[self.law].constants


def fit_flow(strain: Array, stress: Array, laws: Sequence[str] = ()) -> list[FittedCurve]:
    """Fit flow laws (all, or those that are named) to flow stresses (k,) at plastic strains (k,), the best first.

    The best is the one with the fewest constants whose residuals are not significantly larger than those of the law with the
    least error of a reading, by an F-test at 5 % (Draper & Smith, Applied Regression Analysis, 3rd edition 1998, section 6.1); of
    several the one with the smallest. The others follow, by their error. Laws with as many constants as there are readings, or
    more, are left out. `prensa.inverse.flow_data` reads and checks tables.
    """
    found = [_fitted(name, strain, stress) for name in laws or FLOW_LAWS if FLOW_LAWS[name].constants < len(strain)]
    # Of laws that are as good as exact, as Swift's and the mixed one for data of Swift's, none is worse than another.
    exact = NEGLIGIBLE * float(np.abs(stress).max())
    found.sort(key=lambda f: (max(f.error, exact), f.constants))
    found = [replace(f, worse=_worse(f, found[0], exact)) for f in found]
    best = min((f for f in found if not f.worse), key=lambda f: (f.constants, max(f.error, exact)))
    return [best, *(f for f in found if f is not best)]


def _worse(fit: FittedCurve, least: FittedCurve, exact: float) -> bool:
    """Whether residuals are larger than those of the fit of ``least`` error: by more than scatter, if that has more constants."""
    from scipy.stats import f as f_distribution

    more, free = least.constants - fit.constants, len(fit.residuals) - least.constants
    sums = [(len(f.residuals) - f.constants) * max(f.error, exact) ** 2 for f in (fit, least)]
    if more <= 0:
        return sums[0] > sums[1]
    return bool(f_distribution.sf((sums[0] - sums[1]) / more / (sums[1] / free), more, free) < 1.0 - CONFIDENCE)


def _fitted(name: str, strain: Array, stress: Array) -> FittedCurve:
    from scipy.optimize import least_squares

    law, scale = FLOW_LAWS[name], float(np.abs(stress).max())
    y = stress / scale

    def linear(logs: Array) -> tuple[Array, Array]:
        return _linear(law.columns(strain, [float(v) for v in np.exp(logs)]), y)

    grid = [np.log(values * strain.max() ** power) for values, power in law.grid]
    starts = sorted(product(*grid), key=lambda o: float((linear(np.array(o))[1] ** 2).sum()))
    bounds = [(np.log(SMALLEST), g.max() + np.log(4.0)) for g in grid]
    tight = {"xtol": np.finfo(float).eps, "ftol": np.finfo(float).eps, "gtol": np.finfo(float).eps}
    # Several valleys: the laws of four and six constants have more than one.
    found = [
        least_squares(lambda o: linear(o)[1], np.array(o), bounds=tuple(zip(*bounds)), x_scale="jac", **tight)
        for o in starts[: 2 * len(law.grid)]
    ]
    best = min(found, key=lambda f: float(f.cost))
    a = linear(best.x)[0]
    # a law without yield stress, or without hardening, is none: what comes out as zero is negligible
    curve = law.curve(scale * np.maximum(a, NEGLIGIBLE), [float(v) for v in np.exp(best.x)])
    residuals = stress - stress_at(curve, strain, np.zeros_like(strain))
    error = float(np.sqrt((residuals**2).sum() / (len(strain) - law.constants)))
    return FittedCurve(name, curve, residuals, error, *_confidence(law, scale * a, best.x, strain, error))


def _slopes(law: _Law, a: Array, logs: Array, x: Array) -> Array:
    """Derivatives (k, m) of a law at strains (k,) by its linear constants a and the logarithms of the others."""

    def columns(logs: Array) -> Array:
        return law.columns(x, [float(v) for v in np.exp(logs)])

    steps = FIRST_DIFFERENCE * np.eye(len(logs))
    others = [(columns(logs + h) - columns(logs - h)) @ a / (2.0 * FIRST_DIFFERENCE) for h in steps]
    return np.concatenate([columns(logs), np.stack(others, axis=1)], axis=1)


def _confidence(law: _Law, a: Array, logs: Array, strain: Array, error: float) -> tuple[Callable[[Array], Array], bool]:
    """Half the width of the confidence band of a law fitted at strains (k,), and whether all constants differ from zero."""
    from scipy.stats import t as t_distribution

    slopes = _slopes(law, a, logs, strain)
    # what has no effect at all has no part in the fit, and none in the band; alone its interval would be at least as wide
    spread = np.linalg.pinv(slopes)
    wide = float(t_distribution.ppf(0.5 * (1.0 + CONFIDENCE), len(strain) - law.constants)) * error
    width = wide * np.maximum(np.linalg.norm(spread, axis=1), 1.0 / np.maximum(np.linalg.norm(slopes, axis=0), SMALLEST))
    # the interval of a constant whose logarithm has a half width of one ends at zero
    determined = bool((width < np.concatenate([a, np.ones_like(logs)])).all())
    return lambda x: wide * np.asarray(np.linalg.norm(_slopes(law, a, logs, x) @ spread, axis=1)), determined


def _linear(columns: Array, y: Array) -> tuple[Array, Array]:
    """Non-negative constants (m,) of the columns (k, m), and what is left of y (k,)."""
    from scipy.optimize import nnls

    free: Array = np.asarray(np.linalg.lstsq(columns, y, rcond=None)[0], dtype=np.float64)
    if (free >= 0.0).all():  # as a rule, and to more digits
        return free, y - columns @ free
    a = nnls(columns, y)[0]
    return a, y - columns @ a


def extrapolated(fits: Sequence[FittedCurve], strains: Sequence[float]) -> Iterator[tuple[float, Array, float]]:
    """At each strain the stresses (f,) of the fits, and how far they lie apart, as a share of their mean."""
    for strain in strains:
        stresses = np.array([stress_at(f.curve, np.full(1, strain), np.zeros(1))[0] for f in fits])
        yield strain, stresses, float((stresses.max() - stresses.min()) / stresses.mean())
