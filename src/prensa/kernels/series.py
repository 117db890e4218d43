"""Logarithms of small strains by polynomials, right to the last digit: a loop of them has no call to a library,
so that a compiler answers for as many numbers at once as the processor has lanes. Large ones are left to the library.
"""

from __future__ import annotations

from prensa.kernels.compiled import njit

GROUP = 64
"""Points that a kernel of these loops takes at a time: their scratch is half of the nearest cache."""
SMALL_LOG = 0.15  # up to which it is right


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
