"""New nodes along outlines."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.mesh import Mesh
from prensa.mesh.outline import chains, resampled
from prensa.mesh.triangulate import triangulated
from prensa.remeshing.renewal import shape_measure
from prensa.system.discretise import discretise
from problems import single_block

SIZE = 0.45


def block() -> Mesh:
    """A square of 4 x 4 in T6 with sides of half a unit."""
    return discretise(single_block(
        pr.Step("rest"), material=pr.J2(200e3, 0.3, pr.Perfect(200.0)), size=(4.0, 4.0), n=(8, 8), element="t6",
        body="block", fixed={"block.bottom": "xy"},
    )).meshes["block"]  # fmt: skip


def size(x: np.ndarray) -> np.ndarray:
    return np.full(len(x), SIZE)


@pytest.mark.parametrize("step", [0.0, 0.08, 0.2, 0.4])
def test_a_crease_smaller_than_an_element_folds_none_of_a_new_mesh(step: float) -> None:
    """Metal that steps up and over within one side: new sides bulge by a tenth of their chords at most, shapes are good."""
    mesh = block()
    x = mesh.points.copy()
    on_top = x[:, 1] > 4.0 - 1e-9
    x[on_top & (x[:, 0] > 2.1), 1] += step
    middle = on_top & (np.abs(x[:, 0] - 2.25) < 1e-9)
    x[middle] += (-0.6 * step, 0.1 * step)
    outlines = [resampled(outline, size) for outline in chains(mesh, x)]
    for outline in outlines:
        after = np.roll(outline.ends, -1, axis=0)
        off = np.hypot(*(outline.middles - 0.5 * (outline.ends + after)).T)
        assert (off <= (0.1 + 1e-12) * np.hypot(*(after - outline.ends).T)).all()
    new = triangulated(outlines, size)
    assert shape_measure(new.points, new.cells).min() > 0.5


def test_gentle_bends_are_followed() -> None:
    """Middles of sides that turn less than 45 degrees stay on the outline: on an ellipse, to the old sides' own error."""
    mesh = block()
    x = mesh.points.copy()
    x[:, 1] += np.sqrt(16.0 - x[:, 0] ** 2 * 0.5) - 4.0
    (outline,) = chains(mesh, x)
    new = resampled([c for c in outline if "top" in c.names], size)
    assert new.middles[:, 1] == pytest.approx(np.sqrt(16.0 - new.middles[:, 0] ** 2 * 0.5), abs=2e-3)
