"""Argument checks shared by the reference solutions: each error names the argument, its value and the remedy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from prensa.types import Array

ACCURACY = 1e-10  # relative, of what is integrated and of minima that are looked for


def positive(**values: float) -> None:
    """Raise ValueError unless every named value is a finite number above zero."""
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} = {value!r}: must be finite and above 0; give {name} > 0")


def not_negative(**values: float) -> None:
    """Raise ValueError unless every named value is a finite number, zero or above."""
    for name, value in values.items():
        if not (math.isfinite(value) and value >= 0.0):
            raise ValueError(f"{name} = {value!r}: must be finite and not negative; give {name} >= 0")


def poisson(nu: float) -> None:
    """Raise ValueError unless -1 < nu <= 0.5."""
    if not -1.0 < nu <= 0.5:
        raise ValueError(f"nu = {nu!r}: Poisson's ratio lies in (-1, 0.5]; give a value in that range")


def shear_factor(m: float) -> None:
    """Raise ValueError unless 0 <= m <= 1."""
    if not 0.0 <= m <= 1.0:
        raise ValueError(f"m = {m!r}: the shear factor lies in [0, 1]; give a value there")


def one_of(name: str, value: Any, choices: tuple[str, ...]) -> None:
    """Raise ValueError unless the value is one of the choices."""
    if value not in choices:
        raise ValueError(f"{name} = {value!r}: unknown; choose one of {', '.join(map(repr, choices))}")


def reductions(reduction: Any) -> Array:
    """Return the height reductions as an array; raise ValueError unless all lie in [0, 1)."""
    values = np.asarray(reduction, dtype=float)
    if not bool(np.all((values >= 0.0) & (values < 1.0))):
        raise ValueError(f"reduction = {reduction!r}: a fraction of the initial height in [0, 1); give 0.5 for 50 %")
    return values


def plane_strain_modulus(E: float, nu: float) -> float:
    """E* = E/(1 - nu^2) (stress) of a body under a rigid tool; raises ValueError for E <= 0 or nu outside (-1, 0.5]."""
    positive(E=E)
    poisson(nu)
    return E / (1.0 - nu * nu)
