"""Meshes of elements half as long fill the same place, and keep marks, fields and arcs."""

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.mesh.halved import halved
from prensa.mesh.mesh import areas, boundary_edges


def quartered(mesh, marked):
    """Places with a linear field (n, 3), cells and marks after two halvings."""
    values = np.hstack([mesh.points, mesh.points @ [[2.0], [-1.0]] + 3.0])
    out = halved(values, mesh.cells, marked)
    return halved(*out)


@pytest.mark.parametrize("element", ["t3", "q4"])
def test_a_straight_body_stays_what_it_is(element):
    """Areas are a sixteenth each, linear fields stay linear, and only nodes between marked ones of the outline are marked."""
    mesh = mesh_of(pr.Patch(corners=((0, 0), (6, 0), (6, 3), (0, 3)), n=(4, 3)), element)
    marked = np.zeros((len(mesh.points), 2), dtype=bool)
    marked[mesh.nodes("top"), 0] = marked[mesh.nodes("bottom"), 1] = True
    values, cells, marks = quartered(mesh, marked)
    assert areas(values, cells) == pytest.approx(np.repeat(areas(mesh.points, mesh.cells) / 16, 16))
    assert values[:, 2] == pytest.approx(values[:, :2] @ [2.0, -1.0] + 3.0)
    assert sorted(values[marks[:, 0], 0]) == pytest.approx(np.linspace(0, 6, 17))
    assert (values[marks[:, 0], 1] == 3.0).all()
    assert (values[marks[:, 1], 1] == 0.0).all() and marks[:, 1].sum() == 17


@pytest.mark.parametrize("element", ["t3", "q4"])
def test_arcs_stay_arcs_and_corners_corners(element):
    """All nodes of both arcs of a sector of a ring are on them, those of its straight ends on these."""
    mesh = mesh_of(pr.Annulus(10.0, 14.0, (6, 3), angles=(0.0, np.pi / 2)), element)
    marked = np.stack([np.isin(np.arange(len(mesh.points)), mesh.nodes(name)) for name in ("inner", "outer", "start")], axis=1)
    values, cells, marks = quartered(mesh, marked)
    radius = np.hypot(*values[:, :2].T)
    assert radius[marks[:, 0]] == pytest.approx(np.full(25, 10.0), abs=1e-12)
    assert radius[marks[:, 1]] == pytest.approx(np.full(25, 14.0), abs=1e-12)
    assert values[marks[:, 2], 1] == pytest.approx(np.zeros(13), abs=1e-12)
    assert areas(values, cells).min() > 0
    assert len(np.unique(boundary_edges(cells))) == 2 * (24 + 12)
