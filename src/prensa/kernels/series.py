"""Logarithms and exponentials of small strains by polynomials, right to the last digit: a loop of them has no call to a library,
so that a compiler answers for as many numbers at once as the processor has lanes. Large ones are left to the library.
"""

from __future__ import annotations

from prensa.kernels.compiled import njit

GROUP = 64
"""Points that a kernel of these loops takes at a time: their scratch is half of the nearest cache."""
SMALL_LOG, SMALL_EXP = 0.15, 0.12  # up to which they are right


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def half_log(x):
    """½ ln(1 + x) of |x| up to `SMALL_LOG`: artanh of x/(2 + x)."""
    return artanh(x / (2.0 + x))


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def artanh(z):
    """½ ln((1 + z)/(1 − z)) of what |x| up to `SMALL_LOG` make x/(2 + x)."""
    s = z * z
    tail = 1.0 / 3.0 + s * (1.0 / 5.0 + s * (1.0 / 7.0 + s * (1.0 / 9.0 + s * (1.0 / 11.0 + s * (1.0 / 13.0)))))
    return z + z * s * tail


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def log_slope(x):
    """ln(1 + x)/x of |x| up to `SMALL_LOG`, 1 of 0."""
    by = 1.0 / (2.0 + x)
    z = x * by
    s = z * z
    tail = 1.0 / 3.0 + s * (1.0 / 5.0 + s * (1.0 / 7.0 + s * (1.0 / 9.0 + s * (1.0 / 11.0 + s * (1.0 / 13.0)))))
    return 2.0 * by * (1.0 + s * tail)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def exp_minus_one(x):
    """exp(x) − 1 of |x| up to `SMALL_EXP`."""
    tail = 1.0 / 40320.0 + x * (1.0 / 362880.0 + x * (1.0 / 3628800.0))
    tail = 1.0 / 24.0 + x * (1.0 / 120.0 + x * (1.0 / 720.0 + x * (1.0 / 5040.0 + x * tail)))
    return x + x * x * (0.5 + x * (1.0 / 6.0 + x * tail))
