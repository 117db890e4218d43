"""Derivatives that laws written in Python need not state: by complex step, or by differences where numbers must be real.

The complex step Im f(x + ih)/h is exact to round-off for analytic functions: h is so small that nothing is neglected, and
nothing is subtracted. Central differences keep two thirds of the digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from prensa.precision import COMPLEX_STEP, FIRST_DIFFERENCE, NEGLIGIBLE
from prensa.types import Array


def derivative(f: Any, x: Array) -> Array:
    """df/dx (k,) of a function of points x ≥ 0; by complex step, or by central difference where it takes real numbers only."""
    size = np.where(x > 0.0, x, NEGLIGIBLE)
    h = COMPLEX_STEP * size
    y = complex_value(f, x + 1j * h)
    if y is not None:
        return np.asarray(y.imag / h) + np.zeros_like(x)
    h = FIRST_DIFFERENCE * size
    return np.asarray((f(x + h) - f(np.maximum(x - h, 0.0))) / (x + h - np.maximum(x - h, 0.0))) + np.zeros_like(x)


def complex_value(f: Any, x: Any) -> Any:
    """f(x) at complex x, or None where f does not take complex numbers or does not hand on the imaginary part."""
    try:
        y = np.asarray(f(x))
    except TypeError:
        return None
    return y if np.iscomplexobj(y) else None
