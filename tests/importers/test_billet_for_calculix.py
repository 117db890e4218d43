"""The deck of the billet that benchmarks/calculix_in_space.py gives to CalculiX, read back and run by prensa."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import prensa as pr

with pytest.MonkeyPatch.context() as patch:
    patch.syspath_prepend(str(Path(__file__).parents[2] / "benchmarks"))
    patch.delitem(sys.modules, "common", raising=False)  # examples have a module of this name too
    import calculix
    import calculix_in_space as benchmark

    del sys.modules["common"]


def written(folder: Path, kind: str = "C3D8R") -> str:
    """The deck of 4 x 3 x 4 bricks."""
    (folder / "billet.inp").write_text(benchmark.deck(4, 0.1, kind))
    return str(folder / "billet.inp")


def test_the_bricks_of_the_deck_are_those_of_the_box(tmp_path: Path) -> None:
    """Nodes, elements, planes of symmetry and sides in contact: the force on the mesh of the deck is the box's own."""
    own = benchmark.billet(4, 0.02)
    own = replace(own, steps=(replace(own.steps[0], increments=3),))
    (contact,) = own.contacts
    read = replace(
        own, bodies={"billet": replace(own.bodies["billet"], mesh=pr.File(written(tmp_path), part=("EBODY",)))},
        contacts=(replace(contact, surface=("billet.SLAVE",)),), tools={"die": pr.Plane(touching="billet.SLAVE")},
        fixed={"billet.LEFT": "x", "billet.BOTTOM": "y", "billet.BACK": "z"},
    )  # fmt: skip
    forces = [[inc.force("die").y for inc in pr.solve(problem)] for problem in (own, read)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)


def test_the_die_lies_on_the_top_and_faces_it(tmp_path: Path) -> None:
    """The surface that CalculiX lets the billet press on is the lower face of a brick that stands over all of it."""
    die = replace(
        benchmark.billet(4, 0.02), bodies={"b": pr.Body(pr.File(written(tmp_path), part=("ETOOL",)), pr.Elastic(1e6, 0.3))},
        tools={"t": pr.Plane(touching="b.MASTER")}, contacts=(pr.Contact(("b.MASTER",), "t"),),
        fixed={"b.TOOL": "xz"}, steps=(pr.Step("s", move={"t": pr.Motion(y=-0.1)}),),
    )  # fmt: skip
    mesh = pr.discretise(die).meshes["b"]
    face = mesh.points[np.unique(mesh.edges["MASTER"])]
    assert face[:, 1] == pytest.approx(benchmark.HEIGHT)
    assert mesh.points[:, 1].max() > benchmark.HEIGHT
    assert (face.min(axis=0) < 0.0)[[0, 2]].all() and (face.max(axis=0) > benchmark.WIDTH)[[0, 2]].all()


def test_nodes_between_corners_follow_the_order_of_c3d20() -> None:
    """Nodes 9 to 20 of the parent brick from (−1, −1, −1) to (1, 1, 1), as the manuals number them."""
    corners = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
    between = [(0, -1, -1), (1, 0, -1), (0, 1, -1), (-1, 0, -1), (0, -1, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1),
               (-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]  # fmt: skip
    x, cells = benchmark.quadratic(corners.astype(float), np.arange(8)[None])
    assert x[cells[0, 8:]].tolist() == [list(map(float, p)) for p in between]


def test_figures_are_read_from_what_calculix_says() -> None:
    """Iterations of all attempts, increments that were taken, equations of the last system, forces in order."""
    said = (
        " number of equations\n 123\n increment 1 attempt 1 \n\n iteration 1\n\n iteration 2\n increment 1 attempt 2 \n"
        " iteration 1\n increment 2 attempt 1 \n iteration 1\n number of equations\n 124\n"
    )
    total = " total force (fx,fy,fz) for set BOTTOM and time  0.{}E+00\n\n        1.0E+00  {}E+02  3.0E+00\n"
    found = calculix.figures(said, total.format(5, "2.5") + total.format(9, "4.0"))
    assert found == {"iterations": 4, "increments": 2, "unknowns": 124, "force": [250.0, 400.0], "times": [0.5, 0.9]}
    printed = "".join(
        f" displacements (vx,vy,vz) for set BODY and time  0.{t}E+00\n\n         1  0.0E+00 {t}.0E-01  3.0E-01\n" for t in (5, 9)
    )
    assert calculix.figures(said, printed)["u"] == [0.0, 0.9, 0.3]


def test_a_word_says_the_program_its_increments_and_the_first_of_them() -> None:
    """As the command line is given them; the deck has equal increments, or the first one and CalculiX's own."""
    assert benchmark.Program.of("C3D8R/18") == ("C3D8R", 18, None)
    assert benchmark.Program.of("prensa-bdf2/6").in_words() == "prensa, second order, 6 increments"
    first = benchmark.Program.of("C3D8R@0.0025")
    assert (first.first, first.in_words()) == (0.0025, "CalculiX, C3D8R, first increment 0.0025")
    assert "*STATIC\n0.0025, 1., 1e-6\n" in benchmark.deck(4, 0.1, "C3D8R", None, 0.0025)
    assert "*STATIC, DIRECT\n0.0625, 1.\n" in benchmark.deck(4, 0.1, "C3D8R", 16)


def test_errors_are_those_beside_the_most_increments_of_the_same_program() -> None:
    """A force that is 1 % off at the end, half the work missed, and a node off by a tenth of the way; no row of the reference."""
    many = np.linspace(0.0, 1.0, 101)[1:]
    same = {"n": 4, "reduction": 0.1, "ended": "completed", "iterations": 3}
    reference = {"program": "C3D8R/100", "increments": 100, "times": many.tolist(), "u": [0.0] * 6, **same}
    reference["force"] = [100.0] * 100
    u = [0.0, 0.1 * 0.1 * benchmark.HEIGHT, 0.0, 0.0, 0.0, 0.0]
    coarse = {"program": "C3D8R", "increments": 1, "times": [1.0], "force": [101.0], "u": u, **same}
    other = {**coarse, "program": "prensa"}  # has no reference
    (row,) = benchmark.errors([coarse, reference, other])
    work = 100.0 * (50.5 / 99.5 - 1.0)
    assert row[0] == "CalculiX, C3D8R" and row[2:5] == ["1", "3", "100"]
    assert [float(v) for v in row[5:]] == pytest.approx([1.0, 1.0, work, 10.0, 10.0 / np.sqrt(2.0)], abs=6e-3)
