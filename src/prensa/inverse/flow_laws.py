"""Flow laws through measured flow stresses by least squares: constants, errors, and how far the laws part beyond the data.

Each law is linear in some of its constants and is fitted by variable projection (Golub & Pereyra 1973, SIAM J. Numer. Anal. 10,
413-432): for the others, found by `scipy.optimize.least_squares` from the best of a grid, these follow from non-negative
least squares.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeAlias

import numpy as np

from prensa.materials.flow.hockett_sherby import HockettSherby
from prensa.materials.flow.ludwik import Ludwik
from prensa.materials.flow.swift import Swift
from prensa.materials.flow.swift_voce import SwiftVoce
from prensa.materials.flow.voce import Voce
from prensa.materials.flow_curve import FlowCurve, stress_at
from prensa.precision import NEGLIGIBLE, SMALLEST
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


@dataclass(frozen=True)
class FittedCurve:
    """A law through measured stresses: ``residuals`` (k,), measured less fitted, and the standard ``error`` of one reading.

    The error is √(Σr²/(k − m)) of a law with m constants, so that one with more of them has to be better to be called so.
    """

    law: str
    curve: FlowCurve
    residuals: Array
    error: float


def fit_flow(strain: Array, stress: Array, laws: Sequence[str] = ()) -> list[FittedCurve]:
    """Fit flow laws (all, or those that are named) to flow stresses (k,) at plastic strains (k,), the best first.

    Laws with as many constants as there are readings, or more, are left out. `prensa.inverse.flow_data` reads and checks tables.
    """
    found = [_fitted(name, strain, stress) for name in laws or FLOW_LAWS if FLOW_LAWS[name].constants < len(strain)]
    # Of laws that are as good as exact, as Swift's and the mixed one for data of Swift's, the one with fewer constants is better.
    exact = NEGLIGIBLE * float(np.abs(stress).max())
    return sorted(found, key=lambda f: (max(f.error, exact), FLOW_LAWS[f.law].constants))


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
    curve = law.curve(scale * linear(best.x)[0], [float(v) for v in np.exp(best.x)])
    residuals = stress - stress_at(curve, strain, np.zeros_like(strain))
    error = float(np.sqrt((residuals**2).sum() / (len(strain) - law.constants)))
    return FittedCurve(name, curve, residuals, error)


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
