"""Elements in space that are out of shape where a run ends, and stops on them: with the place and what there is to do."""

from __future__ import annotations

import json
import logging
import re
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.checks.during.acceptance import least_corner
from prensa.cli import app
from prensa.errors import SolveError
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import displaced
from prensa.mesh.quality import quality
from prensa.system.failure import MetalInside
from prensa_bench.robustness.cells_in_space import jacobians

STEEL = pr.J2(210e3, 0.3, pr.Swift(800.0, 0.005, 0.18))
WEDGES = pr.Cylinder(radius=5.0, height=4.0, n=(3, 4, 4), angle=np.pi / 2, core="wedges")


def said(p: pr.Problem, caplog: pytest.LogCaptureFixture) -> tuple[pr.Increment, str, SolveError | None]:
    """The last increment of a run, what it says of its elements, and the error that ended it."""
    last, ended = None, None
    with caplog.at_level(logging.WARNING, "prensa"):
        try:
            *_, last = pr.solve(p)
        except SolveError as error:
            last, ended = error.last, error
    assert last is not None
    return last, " ".join(w for w in caplog.messages if "out of shape where the run ends" in w), ended


def billet(travel: float, mu: float = 0.3, n: tuple[int, int, int] = (4, 5, 4)) -> pr.Problem:
    """An eighth of a flat billet whose free sides roll onto the die."""
    return pr.Problem(
        "billet", space="solid", bodies={"b": pr.Body(pr.Box((5.0, 2.5, 5.0), n), STEEL)},
        tools={"t": pr.Plane(touching="b.top")},
        contacts=(pr.Contact(("b.top", "b.right", "b.front"), "t", pr.Coulomb(mu)),),
        fixed={"b.left": "x", "b.bottom": "y", "b.back": "z"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-travel * 2.5)}, increments=30),),
    )  # fmt: skip


def can(travel: float = 2.4) -> pr.Problem:
    """A slug whose middle a flat punch presses into, in a container: elements under the punch turn over."""
    punch = pr.Revolved(section=pr.Profile(points=((0.0, 0.0), (3.3, 0.0), (3.3, 20.0)), fillet=(0.0, 1.0, 0.0)), at=(0, 5.3, 0))
    wall = pr.Revolved(section=pr.Profile(points=((5.0, 30.0), (5.0, -5.0))), at=(0, 0, 0))
    slug = pr.Cylinder(radius=5.0, height=5.3, n=(4, 4, 4), angle=np.pi / 2)
    contacts = (pr.Contact("b.top", "p"), pr.Contact("b.outer", "can"), pr.Contact("b.bottom", "e"))
    return pr.Problem(
        "can", space="solid", bodies={"b": pr.Body(slug, pr.J2(70e3, 0.33, pr.Voce(100.0, 150.0, 6.0)))}, contacts=contacts,
        tools={"p": punch, "can": wall, "e": pr.Plane(touching="b.bottom")}, fixed={"b.base": "z", "b.cap": "x"},
        friction=pr.Coulomb(0.05), steps=(pr.Step("press", move={"p": pr.Motion(y=-travel)}, increments=40),),
    )  # fmt: skip


def test_elements_that_turn_over_are_counted_with_the_place_of_the_worst(caplog):
    """Before the run would end on them: as many as have a corner turned over by what another program computes."""
    last, words, ended = said(can(1.5), caplog)
    cells, x = mesh_of(can().bodies["b"].mesh).cells, last.bodies["b"].x
    turned = jacobians(cells, x)[:, :8].min(axis=1) < 0.0
    found = re.search(r"elements of body 'b' .*, (\d+) of them folded", words)
    assert ended is None and found is not None, words
    worst = int(words.split("worst is element ")[1].split(",")[0])
    place = [float(v) for v in words.split("now near (")[1].split(")")[0].split(",")]
    assert 0 < int(found[1]) <= turned.sum() and turned[worst]
    assert place == pytest.approx(x[cells[worst]].mean(axis=0), rel=1e-3)
    assert "a section in the plane with 'remesh: auto'" in words


def test_sides_that_roll_onto_a_tool_are_in_shape(caplog):
    """Their corners open to 180° where the free side comes to lie on the die, and their points answer well."""
    last, words, ended = said(rolled := billet(0.4), caplog)
    mesh, x = mesh_of(rolled.bodies["b"].mesh), last.bodies["b"].x
    assert ended is None and words == ""
    assert abs(quality(displaced(mesh, x)).jacobian.min()) < 1e-3
    assert (jacobians(mesh.cells, x)[:, 8:] > 0.0).all()


@pytest.mark.slow
def test_a_stop_has_what_the_run_has_seen_its_place_and_a_picture(tmp_path: Path, capsys):
    """On an axis that a tool has come through: no contact is missing there, and the folder has summary and picture."""
    case = tmp_path / "can.yaml"
    case.write_text(pr.dump(can()), encoding="utf-8")
    with pytest.raises(SystemExit):
        app(["run", str(case), "--out", str(tmp_path / "out"), "-q"])
    capsys.readouterr()
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["status"] == "failed" and "increment" in summary["reason"] and "What to try" in summary["reason"]
    assert "add '{surface" not in summary["reason"] and "'remesh: auto', where the body has one" in summary["reason"]
    assert any("out of shape where the run ends" in words and "now near" in words for words in summary["warnings"])
    assert list((tmp_path / "out").rglob("*.png"))


def test_a_node_on_a_plane_of_symmetry_inside_a_tool_is_no_missing_contact():
    """The sentence says what has happened, the remedy what to do."""
    with pytest.raises(SolveError, match="which has penetrated the adjacent surface") as caught:
        list(pr.solve(can()))
    assert isinstance(caught.value.reason, MetalInside) and caught.value.reason.node.side in ("b.base", "b.cap")


def test_wedges_whose_edge_on_the_axis_turns_over_are_seen():
    """By the quality of the mesh and by the least corner, which is that of a box or more of one that is in shape."""
    mesh = mesh_of(WEDGES)
    axis = np.flatnonzero(np.hypot(*mesh.points[:, [0, 2]].T) < 1e-9)
    low, high = axis[np.argsort(mesh.points[axis, 1])][1:3]
    x = mesh.points.copy()
    assert quality(mesh).jacobian.min() > 0.9 and least_corner(x[mesh.cells].transpose(1, 0, 2)).min() > 0.5
    x[low, 1] = x[high, 1] + 0.2
    turned = (mesh.cells == low).any(axis=1) & (mesh.cells == high).any(axis=1)
    assert ((quality(displaced(mesh, x)).jacobian < 0.0) == turned).all()
    assert ((least_corner(x[mesh.cells].transpose(1, 0, 2)) < 0.0) == turned).all()
