import numpy as np
import pytest

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError


def lengths(grade: pr.Grade) -> tuple[np.ndarray, np.ndarray]:
    x = np.unique(mesh_of(pr.Rectangle((10, 1), (20, 1), grade=grade)).points[:, 0])
    return x, np.diff(x)


def test_a_stretch_has_short_elements_all_along():
    """Between its ends, which are mesh lines, elements are equal and the shortest but for rounding; beyond they grow."""
    x, h = lengths(pr.Grade(x_between=(3.0, 5.0), ratio=4))
    inside = (x[:-1] > 3 - 1e-9) & (x[1:] < 5 + 1e-9)
    assert np.isin([3.0, 5.0], x).all() and inside.sum() >= 5
    assert np.ptp(h[inside]) < 1e-9 and h[inside].max() < 1.1 * h.min()
    assert h[0] > 2 * h[inside].max() and h[-1] > 2.5 * h[inside].max()


def test_a_stretch_must_rise_and_lie_in_the_body():
    """A stretch from right to left, or beyond the body, is refused."""
    with pytest.raises(ValueError, match="'x_between' must rise, got 5 … 3"):
        pr.Grade(x_between=(5.0, 3.0))
    with pytest.raises(MeshError, match="outside 0 … 10"):
        lengths(pr.Grade(x_between=(8.0, 12.0)))
