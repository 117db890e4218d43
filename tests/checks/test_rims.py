"""What contacts in space miss where an edge of the tool lies between their nodes, held against finer meshes."""

import re

import numpy as np
import pytest

import prensa as pr
from prensa.mesh.hollows import inside

ELASTIC = pr.Elastic(10e3, 0.3)
METAL = pr.J2(200e3, 0.3, pr.Ludwik(250.0, 500.0, 0.3))


def block(n, tool, material, depth=0.2, half=True):
    """A block of 8 × 4 × 8 under a tool, n elements to 4 mm: the whole, or a quarter of it."""
    low, size = (0.0, 4.0) if half else (-4.0, 8.0)
    mesh = pr.Box((size, 4.0, size), (round(n * size / 4.0), n, round(n * size / 4.0)), (low, 0.0, low))
    return pr.Problem(
        "punch", space="solid", friction=pr.Coulomb(0.15), bodies={"b": pr.Body(mesh, material)}, tools={"t": tool},
        contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"} | ({"b.left": "x", "b.back": "z"} if half else {}),
        steps=(pr.Step("press", move={"t": pr.Motion(y=-depth)}, increments=2),),
    )  # fmt: skip


def square(half):
    """A square punch with sharp edges, so wide from its middle."""
    corners = tuple((x, y, z) for x in (-half, half) for y in (0.0, 3.0) for z in (-half, half))
    return pr.Polyhedron(points=corners, touching="b.top")


def answer(problem, caplog):
    """The force of a run, and the share that it says to miss: 0 if nothing is said."""
    caplog.clear()
    *_, last = pr.solve(problem)
    found = [re.search(r"too small, by (?:up to )?an estimated (\d+) %", words) for words in caplog.messages]
    shares = [float(m[1]) / 100.0 for m in found if m]
    return last.force("t").y, shares[0] if shares else 0.0


@pytest.mark.parametrize(
    ("material", "n", "right"),
    [
        (ELASTIC, 5, 17290.0 / 4.0), (METAL, 5, 18863.0 / 4.0),
        pytest.param(ELASTIC, 7, 17290.0 / 4.0, marks=pytest.mark.slow),
        pytest.param(METAL, 7, 18863.0 / 4.0, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_edges_in_the_middle_between_rows_of_nodes_are_estimated(material, n, right, caplog):
    """Forces of 13, 17 and 19 elements to 4 mm go to ``right`` with the first power of their length: to a factor of two."""
    force, share = answer(block(n, square(2.0), material), caplog)
    missed = 1.0 - force / right
    assert missed > 0.07
    assert 0.5 * missed <= share <= 2.0 * missed


@pytest.mark.slow
@pytest.mark.parametrize("material", [ELASTIC, METAL])
def test_what_the_estimates_are_held_against_is_where_finer_meshes_go(material, caplog):
    """Errors of two meshes with edges in the middle between rows are as their elements are long."""
    forces = [4.0 * answer(block(n, square(2.0), material), caplog)[0] for n in (9, 13)]
    limit = forces[1] + (forces[1] - forces[0]) * 9 / 4
    assert limit == pytest.approx(17290.0 if material is ELASTIC else 18863.0, rel=0.015)


def test_an_edge_just_outside_a_row_is_no_error_and_silent(caplog):
    """A punch of 3.8 mm whose edges lie at 0.37 of elements of 0.8: 17024 N by the area of the one of 4 mm; nothing is said."""
    force, share = answer(block(5, square(1.9), METAL), caplog)
    assert 4.0 * force == pytest.approx(17024.0, rel=0.02)
    assert share == 0.0


def test_round_tools_have_no_edge_at_the_rim(caplog):
    """A ball on 9 nodes of a quarter: the next ones lie as far off its face as it is round."""
    _, share = answer(block(8, pr.Sphere(radius=5.0, touching="b.top", at=(0, 0, 0)), ELASTIC, 0.3), caplog)
    assert share == 0.0
    assert not [words for words in caplog.messages if "edge" in words]


@pytest.mark.parametrize("material", [ELASTIC, METAL])
def test_a_quarter_and_the_whole_have_one_figure(material, caplog):
    """Nodes on planes of symmetry have a half and a quarter of the forces that they have in the whole."""
    tool = pr.Pyramid(of="vickers", radius=0.6, touching="b.top", at=(0, 0, 0))
    (force, share), (whole, all_of_it) = (answer(block(5, tool, material, 0.3, half), caplog) for half in (True, False))
    assert 4.0 * force == pytest.approx(whole, rel=1e-4)
    assert share == pytest.approx(all_of_it, abs=0.011)
    assert share > 0.1


def test_faces_are_bilinear_between_nodes():
    """Shape values are 1 in sum and linear along sides; the parabola is that of a chord."""
    s = np.array([0.25, 0.5])
    N, parabola = inside(3, s)
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    assert np.allclose(N.sum(axis=1), 1.0)
    assert np.allclose(N @ corners, [(a, b) for a in s for b in s])
    assert np.allclose(parabola, (N @ corners) * (1.0 - N @ corners))
