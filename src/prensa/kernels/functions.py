"""Functions of small and of any numbers, as point functions: polynomials that are right to the last digit near zero, else the
logarithms and exponentials themselves, which machine code computes where some point needs them alone.
"""

from __future__ import annotations

from prensa.kernels.record import Function, Node, either, exp, log, sqrt

SMALL_LOG, SMALL_EXP, SMALL_SQUARE, SMALL_HYPERBOLIC = 0.15, 0.12, 0.006, 0.01
"""Up to which the polynomials below are right."""


def _series(x: Node, denominators: tuple[float, ...]) -> Node:
    """Σ xᵏ/denominator k, lowest power last."""
    t: Node = 1.0 / denominators[0]  # type: ignore[assignment]
    for d in denominators[1:]:
        t = t * x + 1.0 / d
    return t


def _near_zero(limit: float, series: Function, any_size: Function) -> Function:
    """A function by its series where |x| is up to a limit."""

    def f(x: Node) -> Node:
        return either(x * x > limit * limit, series, any_size, x)

    f.__doc__ = series.__doc__
    return f


def _artanh_series(s: Node) -> Node:
    """artanh(√s)/√s."""
    return 1.0 + s * _series(s, (13, 11, 9, 7, 5, 3))


def _artanh(s: Node) -> Node:
    r = sqrt(s)
    return 0.5 * log((1.0 + r) / (1.0 - r)) / r


artanh_ratio = _near_zero(SMALL_SQUARE, _artanh_series, _artanh)


def _half_log_series(x: Node) -> Node:
    """½ ln(1 + x)."""
    z = x / (2.0 + x)
    return z * _artanh_series(z * z)


half_log1p = _near_zero(SMALL_LOG, _half_log_series, lambda x: 0.5 * log(1.0 + x))


def _expm1_series(x: Node) -> Node:
    """e^x − 1."""
    return x + x * x * _series(x, (3628800, 362880, 40320, 5040, 720, 120, 24, 6, 2))


expm1 = _near_zero(SMALL_EXP, _expm1_series, lambda x: exp(x) - 1.0)


def _cosh_series(x: Node) -> Node:
    """cosh(√x) − 1."""
    return x * _series(x, (40320, 720, 24, 2))


def _cosh(x: Node) -> Node:
    return 0.5 * (exp(sqrt(x)) + exp(-sqrt(x))) - 1.0


cosh_less_one = _near_zero(SMALL_HYPERBOLIC, _cosh_series, _cosh)


def _sinh_series(x: Node) -> Node:
    """sinh(√x)/√x."""
    return 1.0 + x * _series(x, (362880, 5040, 120, 6))


def _sinh(x: Node) -> Node:
    return 0.5 * (exp(sqrt(x)) - exp(-sqrt(x))) / sqrt(x)


sinh_ratio = _near_zero(SMALL_HYPERBOLIC, _sinh_series, _sinh)


def _sinh_excess_series(x: Node) -> Node:
    """(sinh(√x)/√x − 1)/x."""
    return _series(x, (362880, 5040, 120, 6))


sinh_excess = _near_zero(SMALL_HYPERBOLIC, _sinh_excess_series, lambda x: (_sinh(x) - 1.0) / x)
