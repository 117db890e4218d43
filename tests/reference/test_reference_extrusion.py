"""The upper bound of a can: its power is that of its velocity field, integrated in another way."""

from __future__ import annotations

import numpy as np
import pytest

from prensa import reference as ref


def velocity(r: np.ndarray, z: np.ndarray, b: float, R: float, p: float) -> tuple[np.ndarray, np.ndarray]:
    """The field of the bound in a zone of height b, z from its lower face."""
    A = p**2 / (2 * b * (R**2 - p**2))
    inner = r < p
    return np.where(inner, r / (2 * b), A * (R**2 / r - r)), np.where(inner, -z / b, 2 * A * z)


def power(b: float, height: float, R: float, p: float, stress: float, m: float) -> float:
    """Power of the field by differences of the velocities on a grid, shear and friction by their jumps."""
    k = stress / np.sqrt(3)
    total, n, d = 0.0, 600, 1e-6
    for lo, hi in ((0.0, p), (p, R)):
        r = lo + (hi - lo) * (np.arange(n) + 0.5) / n
        z = np.full(n, 0.3 * b)
        err, ezz = (
            (velocity(r + dr, z + dz, b, R, p)[c] - velocity(r - dr, z - dz, b, R, p)[c]) / (2 * d)
            for c, dr, dz in ((0, d, 0.0), (1, 0.0, d))
        )
        ett = velocity(r, z, b, R, p)[0] / r
        assert np.abs(err + ett + ezz).max() < 1e-6  # no change of volume
        rate = np.sqrt(2 / 3 * (err**2 + ett**2 + ezz**2))
        total += float((stress * rate * 2 * np.pi * r * b).sum() * (hi - lo) / n)
        out = velocity(r, z, b, R, p)[0]
        face = float((k * np.abs(out) * 2 * np.pi * r).sum() * (hi - lo) / n)
        bottom = m if b == height else 1.0
        total += face * (bottom + (m if lo == 0.0 else 1.0))
    z = (np.arange(n) + 0.5) / n * b
    jump = np.abs(velocity(np.full(n, p + 1e-12), z, b, R, p)[1] - velocity(np.full(n, p - 1e-12), z, b, R, p)[1])
    wall = np.abs(velocity(np.full(n, R), z, b, R, p)[1])
    return total + float((k * 2 * np.pi * (p * jump + m * R * wall)).sum() * b / n)


@pytest.mark.parametrize(("height", "m"), [(9.0, 0.25), (5.0, 0.0), (3.0, 0.6)])
def test_the_bound_is_the_least_power_of_its_field(height: float, m: float) -> None:
    """Over all heights of the zone, within the steps of the search."""
    R, p, stress = 10.0, 6.0, 180.0
    least = min(power(b, height, R, p, stress, m) for b in np.linspace(0.2, 1.0, 41) * height)
    assert ref.can_upper_bound(R, p, height, stress, m) == pytest.approx(least, rel=2e-3)


def test_the_bound_is_above_the_work_without_friction_and_shear() -> None:
    """σ ln(A₀/A₁) on the punch is a lower figure than any that shear adds to; strains grow without end."""
    ideal = np.pi * 36 * 180.0 * np.log(100 / 64) * 100 / 36
    assert ref.can_upper_bound(10.0, 6.0, 5.0, 180.0, 0.1) > ideal
    assert ref.can_strain(10.0, 6.0, 10.0, 10.0) == 0.0
    assert ref.can_strain(10.0, 6.0, 10.0, 4.0) == pytest.approx(0.5 * np.log(2.5) * (2 + 12 / 32))


@pytest.mark.parametrize("wrong", [(10.0, 10.0, 5.0, 1.0, 0.1), (10.0, 6.0, 0.0, 1.0, 0.1), (10.0, 6.0, 5.0, 1.0, 1.1)])
def test_what_makes_no_can_is_refused(wrong: tuple[float, ...]) -> None:
    """Lengths and friction factors."""
    with pytest.raises(ValueError):
        ref.can_upper_bound(*wrong)
    with pytest.raises(ValueError):
        ref.can_strain(10.0, 6.0, 5.0, 6.0)
