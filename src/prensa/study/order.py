"""Observed order, extrapolated value and error band of a sequence of results on finer and finer discretisations.

Results y(h) = y0 + a hᵖ are fitted by least squares with weights 1/h, as Eça & Hoekstra (2014, J. Comput. Phys. 262, 104-130) do;
three results determine the three numbers (Richardson 1911). The error of the finest result is estimated by Roache's grid
convergence index (1994, J. Fluids Eng. 116, 405-413), two standard errors of the limit and the scatter. Where results do not
follow such a law, and those of contact often do not because nodes come into contact one by one, that is said, and the
spread of the results is the band.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from prensa.precision import NEGLIGIBLE, SMALLEST
from prensa.types import Array

LOWEST, HIGHEST = 0.3, 6.0  # orders that are looked for
SURE = 1.25  # Roache's factor of an order that the results show
UNSURE = 3.0  # and of results of which it is not sure that they are near their limit
NOISE = (
    0.25  # scatter about the fit, of the change from the coarsest result to the finest, above which there is no order
)
DOUBT = 0.3  # standard error of the order, of the order itself, above which there is none


@dataclass(frozen=True)
class Convergence:
    """What a sequence of results shows.

    ``order`` and its ``order_error`` (standard error; not a number from three results), ``limit`` the extrapolated value and
    ``band`` the error of the finest result, as an absolute value: it lies within ± band of the limit. Without an order ``why``
    says why not, and ``limit`` is the finest result.
    """

    order: float
    order_error: float
    limit: float
    band: float
    why: str = ""

    @property
    def has_order(self) -> bool:
        """Whether an order could be read off."""
        return not self.why


def observed(sizes: Array, results: Array) -> Convergence:
    """What results (k,) at sizes (k,) > 0, in any order, show of their limit at size zero."""
    keep = np.isfinite(results)
    h, y = sizes[keep], results[keep]
    by_size = np.argsort(-h, kind="stable")
    # Sizes over the largest: powers of them stay numbers, and the coefficient is the change at the coarsest.
    h, y = h[by_size] / h.max(initial=SMALLEST), y[by_size]
    if len(np.unique(h)) < 3:
        last = float(y[-1]) if len(y) else math.nan
        return _without(
            last, float(np.ptp(y)) if len(y) > 1 else math.nan, "an order takes three results of different sizes"
        )
    spread, scale = float(np.ptp(y)), float(np.abs(y).max())
    if spread <= NEGLIGIBLE * scale:
        return _without(float(y[-1]), spread, "the results are the same to round-off")
    return _of_fit(h, y, spread)


def _of_fit(h: Array, y: Array, spread: float) -> Convergence:
    changes = np.diff(y)
    # Three results determine the law exactly whatever they are; only their signs can contradict it.
    if len(y) == 3 and changes[0] * changes[1] <= 0:
        return _without(float(y[-1]), spread, "the results go up and down")
    p = _best_order(h, y)
    if p is None:
        return _without(
            float(y[-1]), spread, f"no power of the size between {LOWEST:g} and {HIGHEST:g} fits the results"
        )
    y0, a, scatter = _fit(h, y, p)
    free = len(y) - 3
    error, limit_error = _standard_errors(h, a, p, scatter, free)
    if free and scatter > NOISE * abs(y[0] - y[-1]):
        return _without(float(y[-1]), spread, "the results scatter as much as they converge")
    if free and error > DOUBT * p:
        return _without(float(y[-1]), spread, f"the results fit orders from {p - 2 * error:.1f} to {p + 2 * error:.1f}")
    # An order far from those of the methods in use is hardly that of the limit.
    factor = SURE if 0.5 <= p <= 2.5 else UNSURE
    return Convergence(p, error if free else math.nan, y0, factor * abs(float(y[-1]) - y0) + 2 * limit_error + scatter)


def _without(finest: float, spread: float, why: str) -> Convergence:
    return Convergence(math.nan, math.nan, finest, spread, why)


def _fit(h: Array, y: Array, p: float) -> tuple[float, float, float]:
    """Limit, coefficient and scatter (standard deviation) of y = y0 + a hᵖ with weights 1/h."""
    w = np.sqrt((1 / h) / (1 / h).sum() * len(h))
    matrix = np.column_stack([np.ones_like(h), h**p])
    (y0, a), *_ = np.linalg.lstsq(matrix * w[:, None], y * w, rcond=None)
    rest = float(np.sum((w * (y - matrix @ [y0, a])) ** 2))
    return float(y0), float(a), math.sqrt(rest / max(len(h) - 3, 1))


def _best_order(h: Array, y: Array) -> float | None:
    """The order that fits best, from a coarse search refined; None where that is the least or the largest."""
    orders = np.geomspace(LOWEST, HIGHEST, 60)
    scatters = [_fit(h, y, p)[2] for p in orders]
    k = int(np.argmin(scatters))
    # At an end of the range the best order lies beyond it: the results follow no power of the size.
    if k in (0, len(orders) - 1):
        return None
    return float(minimize_scalar(lambda p: _fit(h, y, p)[2], bounds=(orders[k - 1], orders[k + 1]), method="bounded").x)


def _standard_errors(h: Array, a: float, p: float, scatter: float, free: int) -> tuple[float, float]:
    """Of the order and of the limit, by the linearised fit; zero where three results leave no freedom."""
    if not free or a == 0:
        return 0.0, 0.0
    w = np.sqrt((1 / h) / (1 / h).sum() * len(h))
    slopes = np.column_stack([np.ones_like(h), h**p, a * h**p * np.log(h)]) * w[:, None]
    covariance = scatter**2 * np.linalg.pinv(slopes.T @ slopes)
    return math.sqrt(covariance[2, 2]), math.sqrt(covariance[0, 0])
