"""The element for sheets finds which way a body is thin, and keeps its stiffness in large plastic compression."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.mesh.thin import thin_way_up
from prensa.verify.drive import Drive
from prensa.verify.elements import bent_and_released, quadrilaterals

STEEL = pr.J2(200e3, 0.3, pr.Ludwik(250.0, 500.0, 0.3))


def across(mesh) -> np.ndarray:
    """Unit vectors (m, 2) along η of each cell, from the middle of its first side to that of its third."""
    x = mesh.points[mesh.cells]
    way = x[:, [2, 3]].mean(axis=1) - x[:, [0, 1]].mean(axis=1)
    return way / np.linalg.norm(way, axis=1)[:, None]


@pytest.mark.parametrize("n", [(20, 2), (200, 2), (3, 1)])
def test_the_thin_way_is_that_of_the_body_not_of_its_elements(n):
    """Lying or standing, with elements longer or shorter along the sheet than a layer is thick, η crosses the sheet."""
    lying = thin_way_up(mesh_of(pr.Rectangle(size=(20, 1), n=n), 4, 1.0))
    standing = thin_way_up(mesh_of(pr.Rectangle(size=(1, 20), n=n[::-1]), 4, 1.0))
    assert np.allclose(np.abs(across(lying)), [0, 1]) and np.allclose(np.abs(across(standing)), [1, 0])
    for mesh in (lying, standing):
        x = mesh.points[mesh.cells]
        (a, b), (c, d) = (x[:, 2] - x[:, 0]).T, (x[:, 3] - x[:, 1]).T
        assert (a * d - b * c > 0).all()  # still counter-clockwise


def test_a_bent_sheet_is_thin_along_its_radius():
    """A ring, its cells counted from any corner: η is radial in each."""
    mesh = mesh_of(pr.Annulus(inner=10, outer=12, n=(40, 2)), 4, 1.0)
    turned = np.stack([np.roll(c, k) for k, c in enumerate(mesh.cells)])
    object.__setattr__(mesh, "cells", turned)
    mesh = thin_way_up(mesh)
    centre = mesh.points[mesh.cells].mean(axis=1)
    radial = centre / np.linalg.norm(centre, axis=1)[:, None]
    assert np.abs((across(mesh) * radial).sum(axis=1)) == pytest.approx(1.0, abs=1e-2)


def test_a_block_keeps_its_cells():
    """Where both ways are equally long nothing is turned."""
    mesh = mesh_of(pr.Rectangle(size=(2, 2), n=(3, 5)), 4, 1.0)
    assert thin_way_up(mesh) is mesh


def test_answers_do_not_depend_on_the_corner_that_cells_begin_with():
    """A strip bent beyond yield and released: cells counted from other corners give the same moment, to 1e-10."""
    mesh = quadrilaterals((1, 2), (2.5, 1.0))
    turned = pr.Points(mesh.points, tuple(c[1:] + c[:1] for c in mesh.cells), mesh.boundaries)
    one, other = (bent_and_released(pr.Body(m, STEEL, "q4_sheet"), 0.01) for m in (mesh, turned))
    assert one[:2] == pytest.approx(other[:2], rel=1e-10)


def test_a_sheet_in_large_plastic_compression_across_keeps_its_stiffness():
    """Two layers pressed to 60 % of their thickness: uniform stress, no mode gives way."""
    drive = Drive(pr.Body(pr.Rectangle(size=(2, 1), n=(4, 2)), STEEL, "q4_sheet"), "plane strain", "finite")
    bottom, top = (np.flatnonzero(drive.X[:, 1] == y) for y in (0.0, 1.0))
    left = np.flatnonzero(drive.X[:, 0] == 0.0)
    dofs = np.concatenate([2 * left, 2 * bottom + 1, 2 * top + 1])
    for k in range(1, 9):
        drive.to(0.01 * k, dofs, np.concatenate([np.zeros(len(left) + len(bottom)), np.full(len(top), -0.05 * k)]))
    stress = drive.cauchy()
    assert np.abs(stress - stress.mean(axis=0)).max() <= 1e-8 * np.abs(stress).max()
