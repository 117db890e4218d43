"""Bounds of bodies of revolution: closed forms from above, other bounds from below, and what has none."""

from __future__ import annotations

import numpy as np
import pytest

from prensa import reference as ref

Y = 200.0
R, H = 10.0, 8.0


def faces(n: int, height: float = H) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Points and triangles of a cylinder, edges of its faces."""
    points, triangles = ref.crossed(np.linspace(0, R, n + 1), np.linspace(0, height, n + 1))
    edges = ref.outline(triangles)
    at = {"bottom": (1, 0.0), "top": (1, height), "side": (0, R)}
    return points, triangles, {k: edges[(np.abs(points[edges][:, :, i] - v) < 1e-9).all(axis=1)] for k, (i, v) in at.items()}


def upset(n: int, m: float, height: float = H) -> float:
    """Bound of the force between plates of friction factor m over flow stress and area."""
    points, triangles, on = faces(n, height)
    walls = [ref.Wall(on["bottom"], m=m), ref.Wall(on["top"], (0.0, -1.0), m)]
    return ref.axisymmetric_bound(points, triangles, Y, walls) / (Y * np.pi * R**2)


def test_smooth_upsetting_from_above() -> None:
    """Uniform compression, which no quadratic stream function has: above 1, the difference falls with the size squared."""
    coarse, fine = upset(4, 0.0) - 1, upset(8, 0.0) - 1
    assert 0 < fine < 0.3 * coarse + 1e-3
    assert fine < 5e-3


def test_friction_is_what_slabs_say_of_low_cylinders() -> None:
    """What friction adds is the slab method's 2 m R/(3 √3 h) where a cylinder is low and m small."""
    assert upset(8, 0.1, 1.0) - upset(8, 0.0, 1.0) == pytest.approx(2 * 0.1 * R / (3 * np.sqrt(3)), rel=3e-2)


def test_a_rigid_cylinder_in_a_rough_tube() -> None:
    """Walls alone dissipate: m k on the side that slides, whatever the triangles; what the end moves by moves all."""
    points, triangles, on = faces(3)
    walls = [ref.Wall(on["top"], (0.0, -1.0)), ref.Wall(on["side"], m=0.4)]
    force = ref.axisymmetric_bound(points, triangles, Y, walls)
    assert force == pytest.approx(0.4 * Y / np.sqrt(3) * 2 * np.pi * R * H, rel=1e-3)


def test_a_can_is_easier_than_parallel_velocities_say() -> None:
    """Below the bound of parallel fields, falling as triangles are halved, above what uniform compression alone takes."""
    forces = []
    for n in (4, 8):
        points, triangles, on = faces(n)
        punch = on["top"][points[on["top"]][:, :, 0].max(axis=1) <= 5 + 1e-9]
        walls = [ref.Wall(on["bottom"]), ref.Wall(on["side"]), ref.Wall(punch, (0.0, -1.0))]
        forces.append(ref.axisymmetric_bound(points, triangles, Y, walls))
    assert Y * np.pi * 25 < forces[1] < forces[0] < ref.can_upper_bound(R, 5.0, H, Y, 0.0)


def test_what_has_no_bound_is_refused() -> None:
    """Stress, factor, triangles and walls that are none."""
    points, triangles, on = faces(2)
    with pytest.raises(ValueError, match="stress = 0"):
        ref.axisymmetric_bound(points, triangles, 0.0, [])
    with pytest.raises(ValueError, match="m = 2"):
        ref.axisymmetric_bound(points, triangles, 1.0, [ref.Wall(on["top"], m=2.0)])
    with pytest.raises(ValueError, match="walked clockwise"):
        ref.axisymmetric_bound(points, triangles[:, ::-1], 1.0, [])
    with pytest.raises(ValueError, match="beyond the axis"):
        ref.axisymmetric_bound(points - [1.0, 0.0], triangles, 1.0, [])
    shut = [ref.Wall(on["top"], (0.0, -1.0)), ref.Wall(on["side"]), ref.Wall(on["bottom"])]
    with pytest.raises(ValueError, match="no way to flow"):
        ref.axisymmetric_bound(points, triangles, 1.0, shut)
