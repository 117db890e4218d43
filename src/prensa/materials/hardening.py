"""Compiled flow curves σ_y(ε̄, ε̄̇) with slopes and curvatures: one function a curve and one line in `flow_stress`.

They make the return map of the curves of `prensa.materials.flow` fast; a curve without one works too.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from prensa.kernels.compiled import njit
from prensa.materials.flow_curve import TINY, FlowCurve, FlowParameters, stress_at

PERFECT, LINEAR, LUDWIK, SWIFT, VOCE, HOCKETT_SHERBY, JOHNSON_COOK, TABLE = range(8)


@njit(cache=True, error_model="numpy", forceinline=True)
def _power(a, n):
    """a^n of a > 0 to a few units of the last digit, a fifth faster than a power that is right to the last one."""
    return math.exp(n * math.log(a))


@njit(cache=True, error_model="numpy", forceinline=True)
def _ludwik(a: float, s0: float, K: float, n: float) -> tuple[float, float, float]:
    if a < TINY:
        slope = K * TINY ** (n - 1.0)
        return s0 + slope * a, slope, 0.0
    power, inverse = K * _power(a, n), 1.0 / a
    slope = n * power * inverse
    return s0 + power, slope, (n - 1.0) * slope * inverse


@njit(cache=True, error_model="numpy", forceinline=True)
def _swift(a: float, K: float, e0: float, n: float) -> tuple[float, float, float]:
    power, inverse = K * _power(e0 + a, n), 1.0 / (e0 + a)
    slope = n * power * inverse
    return power, slope, (n - 1.0) * slope * inverse


@njit(cache=True, error_model="numpy", forceinline=True)
def _voce(a: float, s0: float, Q: float, b: float, H: float) -> tuple[float, float, float]:
    decay = math.exp(-b * a)
    slope = Q * b * decay
    return s0 + Q * (1.0 - decay) + H * a, slope + H, -b * slope


@njit(cache=True, error_model="numpy", forceinline=True)
def _hockett_sherby(a: float, s0: float, s_inf: float, b: float, n: float) -> tuple[float, float, float]:
    if a < TINY:
        slope = (s_inf - s0) * (1.0 - math.exp(-b * TINY**n)) / TINY
        return s0 + slope * a, slope, 0.0
    x = b * _power(a, n)
    decay = (s_inf - s0) * math.exp(-x)
    slope = decay * n * x / a
    return s_inf - decay, slope, slope * (n - 1.0 - n * x) / a


@njit(cache=True, error_model="numpy", forceinline=True)
def _table(a, knots, coefficients):
    last = knots.shape[0] - 1
    lo, hi = 0, last  # searched by hand: views and library calls here would slow down every law, not only this one
    while hi - lo > 1:
        mid = (lo + hi) // 2
        if knots[mid] <= a:
            lo = mid
        else:
            hi = mid
    d = min(a, knots[last]) - knots[lo]
    c0, c1, c2, c3 = coefficients[lo, 0], coefficients[lo, 1], coefficients[lo, 2], coefficients[lo, 3]
    value = ((c0 * d + c1) * d + c2) * d + c3
    return (
        (value, (3.0 * c0 * d + 2.0 * c1) * d + c2, 6.0 * c0 * d + 2.0 * c1) if a < knots[last] else (value, 0.0, 0.0)
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def flow_stress(kind, p, knots, coefficients, a, da, dt):
    """Flow stress and its first and second total derivatives by a at plastic strain a reached by da in the time dt.

    p: a tuple of five numbers, which a compiler keeps in registers (an array costs a loop over points twice the time).
    """
    if kind == PERFECT:
        return p[0], 0.0, 0.0
    if kind == LINEAR:
        return p[0] + p[1] * a, p[1], 0.0
    if kind == LUDWIK:
        return _ludwik(a, p[0], p[1], p[2])
    if kind == SWIFT:
        return _swift(a, p[0], p[1], p[2])
    if kind == VOCE:
        return _voce(a, p[0], p[1], p[2], p[3])
    if kind == HOCKETT_SHERBY:
        return _hockett_sherby(a, p[0], p[1], p[2], p[3])
    if kind == JOHNSON_COOK:
        s, ds, dds = _ludwik(a, p[0], p[1], p[2])
        rate = da / dt / p[4] if dt > 0.0 else 0.0
        if rate <= 1.0:
            return s, ds, dds
        f, df = 1.0 + p[3] * math.log(rate), p[3] / da
        return s * f, ds * f + s * df, dds * f + (2.0 * ds - s / da) * df
    return _table(a, knots, coefficients)


@njit(cache=True, error_model="numpy", forceinline=True)
def slope_before(kind, p, a, da, dt, slope):
    """Derivative of the flow stress by the strain from which da starts; ``slope``: the total one, as `flow_stress` has it."""
    if kind != JOHNSON_COOK or not (da > 0.0 and dt > 0.0 and da / dt / p[4] > 1.0):
        return slope
    return _ludwik(a, p[0], p[1], p[2])[1] * (1.0 + p[3] * math.log(da / dt / p[4]))


@njit(cache=True, error_model="numpy", forceinline=True)
def _power_gradient(a, K, n):
    """Derivatives of K aⁿ by K and n, with the chord of `_ludwik` below `TINY`."""
    x, share = (TINY, a / TINY) if a < TINY else (a, 1.0)
    log = math.log(x)
    power = share * math.exp(n * log)
    return power, K * power * log


@njit(cache=True, error_model="numpy", forceinline=True)
def flow_gradient(kind, p, a, da, dt):
    """Derivatives of the flow stress by the five scalars p of a curve that is no table; arguments as of `flow_stress`."""
    if kind == PERFECT:
        return 1.0, 0.0, 0.0, 0.0, 0.0
    if kind == LINEAR:
        return 1.0, a, 0.0, 0.0, 0.0
    if kind == LUDWIK:
        by_K, by_n = _power_gradient(a, p[1], p[2])
        return 1.0, by_K, by_n, 0.0, 0.0
    if kind == SWIFT:
        log = math.log(p[1] + a)
        power = math.exp(p[2] * log)
        return power, p[2] * p[0] * power / (p[1] + a), p[0] * power * log, 0.0, 0.0
    if kind == VOCE:
        decay = math.exp(-p[2] * a)
        return 1.0, 1.0 - decay, p[1] * a * decay, a, 0.0
    if kind == HOCKETT_SHERBY:
        x, share = (TINY, a / TINY) if a < TINY else (a, 1.0)
        log = math.log(x)
        power = math.exp(p[3] * log)
        decay = math.exp(-p[2] * power)
        rise = (p[1] - p[0]) * decay * power * share
        risen = share * (1.0 - decay)
        return 1.0 - risen, risen, rise, p[2] * rise * log, 0.0
    by_B, by_n = _power_gradient(a, p[1], p[2])
    rate = da / dt / p[4] if dt > 0.0 else 0.0
    if rate <= 1.0:
        return 1.0, by_B, by_n, 0.0, 0.0
    s, log = p[0] + p[1] * by_B, math.log(rate)
    f = 1.0 + p[3] * log
    return f, f * by_B, f * by_n, s * log, -s * p[3] / p[4]


@njit(cache=True, error_model="numpy")
def table_gradient(knots, coefs, a, dknots, dcoefs):
    """What changes dknots (k,), dcoefs (k − 1, 4) of a table make of its flow stress."""
    last = knots.shape[0] - 1
    k = min(max(np.searchsorted(knots, a, side="right") - 1, 0), last - 1)
    d = min(a, knots[last]) - knots[k]
    slope = (3.0 * coefs[k, 0] * d + 2.0 * coefs[k, 1]) * d + coefs[k, 2]
    moved = (dknots[last] if a >= knots[last] else 0.0) - dknots[k]
    return ((dcoefs[k, 0] * d + dcoefs[k, 1]) * d + dcoefs[k, 2]) * d + dcoefs[k, 3] + slope * moved


@njit(cache=True, error_model="numpy")
def flow_stresses(kind, p, knots, coefficients, a, out):
    """Quasi-static flow stresses (n,) at plastic strains a (n,)."""
    curve = (p[0], p[1], p[2], p[3], p[4])
    for i in range(a.shape[0]):
        out[i] = flow_stress(kind, curve, knots, coefficients, a[i], 0.0, 0.0)[0]


def parameters(kind: int, *p: float) -> FlowParameters:
    """Of a curve with the scalars p, at most five."""
    return FlowParameters(kind, np.array([*p, *[0.0] * (5 - len(p))], dtype=np.float64), np.zeros(2), np.zeros((1, 4)))


def flow_curve(flow: FlowCurve, plastic_strain: NDArray[np.float64], rate: float = 0.0) -> NDArray[np.float64]:
    """Flow stress at each plastic strain (n,) → (n,), for plots and closed forms; ``rate`` in 1/time."""
    a, f = np.atleast_1d(np.asarray(plastic_strain, dtype=np.float64)), flow.kernel()
    if f is None:
        return stress_at(flow, a, np.full_like(a, rate))
    return np.array([flow_stress(f.kind, tuple(f.p), f.knots, f.coefficients, x, rate, 1.0)[0] for x in a])
