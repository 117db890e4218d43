"""Upper bounds by linear programming: slip-line solutions from above, homogeneous flow exactly."""

from __future__ import annotations

import numpy as np
import pytest

from prensa import reference as ref

K = 100.0


def bounded(x: np.ndarray, y: np.ndarray, walls: dict[str, ref.Wall | None]) -> float:
    """The bound of a block with lines at x and y, whose sides are walls of the given kind, or free."""
    points, triangles = ref.crossed(x, y)
    edges = ref.outline(triangles)
    middle = points[edges].mean(axis=1)
    at = {"left": (0, x[0]), "right": (0, x[-1]), "bottom": (1, y[0]), "top": (1, y[-1])}
    faces = []
    for side, wall in walls.items():
        axis, value = at[side]
        on = np.abs(middle[:, axis] - value) < 1e-9
        if wall is not None:
            faces.append(ref.Wall(edges[on], wall.velocity, wall.m))
    return ref.plane_strain_bound(points, triangles, K, faces)


DOWN = ref.Wall((), (0.0, -1.0))
SMOOTH = ref.Wall(())


def test_homogeneous_flow_is_found() -> None:
    """A block between smooth plates yields at 2 k wherever its lines are; a plane of symmetry is no wall that matters."""
    sides = {"top": DOWN, "bottom": SMOOTH, "left": SMOOTH}
    assert bounded(np.array([0.0, 1.0, 2.5, 4.0]), np.array([0.0, 0.7, 2.0]), sides) == pytest.approx(2 * K * 4, rel=1e-3)


def test_rough_plates_from_above() -> None:
    """Hill's (1950) p/2k = 3/4 + b/4h of a strip between rough plates, b/h = 8: from above, within 3 %."""
    sides = {"top": ref.Wall((), (0.0, -1.0), 1.0), "bottom": SMOOTH, "left": SMOOTH}
    force = bounded(np.linspace(0, 8, 17), np.linspace(0, 1, 3), sides)
    exact = 2 * K * 8 * (0.75 + 8 / 4)
    assert exact <= force < 1.03 * exact


def test_a_flat_punch_from_above() -> None:
    """Prandtl's 2 k (1 + π/2) on a smooth punch, half of it: from above, within 6 % on two elements of its width."""
    x, y = np.array([0, 0.5, 1, 1.5, 2, 2.6, 3.2]), np.array([-1.6, -1.2, -0.8, -0.4, 0])
    points, triangles = ref.crossed(x, y)
    edges = ref.outline(triangles)
    middle = points[edges].mean(axis=1)
    punch = edges[(middle[:, 1] > -1e-9) & (middle[:, 0] < 1)]
    rest = edges[(middle[:, 1] < y[0] + 1e-9) | (middle[:, 0] > x[-1] - 1e-9)]
    left = edges[middle[:, 0] < 1e-9]
    walls = [ref.Wall(punch, (0.0, -1.0)), ref.Wall(rest, m=1.0), ref.Wall(left)]
    force, exact = ref.plane_strain_bound(points, triangles, K, walls), 2 * K * (1 + np.pi / 2)
    assert exact <= force < 1.06 * exact


def test_friction_dissipates() -> None:
    """A rigid block between two rough faces that move past each other: m k on each of its lengths that slide."""
    faces = {"bottom": ref.Wall((), (1.0, 0.0), 0.3), "top": ref.Wall((), (0.0, 0.0), 0.8)}
    assert bounded(np.linspace(0, 3, 4), np.linspace(0, 1, 2), faces) == pytest.approx(0.3 * K * 3, rel=1e-8)


def test_what_has_no_bound_is_refused() -> None:
    """Yield stress, factor and triangles that are none, walls between which nothing can flow."""
    points, triangles = ref.crossed([0.0, 1.0], [0.0, 1.0])
    edges = ref.outline(triangles)
    with pytest.raises(ValueError, match="k = 0"):
        ref.plane_strain_bound(points, triangles, 0.0, [])
    with pytest.raises(ValueError, match="m = 2"):
        ref.plane_strain_bound(points, triangles, 1.0, [ref.Wall(edges, m=2.0)])
    with pytest.raises(ValueError, match="walked clockwise"):
        ref.plane_strain_bound(points, triangles[:, ::-1], 1.0, [])
    shut = [ref.Wall(edges[:1], (0.0, 1.0)), ref.Wall(edges[1:])]
    with pytest.raises(ValueError, match="no velocities"):
        ref.plane_strain_bound(points, triangles, 1.0, shut)


def test_a_wedge_displaces_what_its_lip_holds() -> None:
    """Hill, Lee and Tupper: area below the first surface and above it, angles from blunt to sharp; a right angle by hand."""
    for angle in np.radians([10.0, 30.0, 45.0, 70.0, 89.0]):
        _, width, lip = ref.wedge_indentation(angle, K)
        # corners of the lip: where the flank leaves the old surface, its tip, and the foot of its face
        fan = ref.wedge_indentation(angle, 0.5)[0] - 1.0
        inner, tip = np.tan(angle), np.array([width, lip])
        # the face is as long as the contact, and sinks by the angle of the flank less that of the fan
        face = width / np.sin(angle)
        foot = tip + face * np.array([np.cos(angle - fan), -np.sin(angle - fan)])
        assert foot[1] == pytest.approx(0.0, abs=1e-9)
        lifted = 0.5 * abs((tip[0] - inner) * (foot[1]) - (foot[0] - inner) * tip[1])
        assert lifted == pytest.approx(0.5 * inner, rel=1e-9)
    assert ref.wedge_indentation(np.radians(45.0), K)[0] == pytest.approx(2 * K * 1.575, rel=1e-3)
    assert ref.wedge_indentation(np.radians(89.9), K)[0] == pytest.approx(2 * K * (1 + np.pi / 2), rel=5e-3)
    with pytest.raises(ValueError, match="prandtl_punch"):
        ref.wedge_indentation(1.6, K)
