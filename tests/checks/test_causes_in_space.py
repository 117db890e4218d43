"""Mistakes in space whose consequences are found too: the cause alone is reported, as severe as what follows from it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from coining import coining
from prensa.checks.before.preflight import preflight
from prensa.cli import app
from prensa.model.schema import loads
from prensa.types import Array
from prensa.verify.stl import write

BALL = "type: revolved, section: {type: circle, radius: 5}"
CASE = coining("[6, 4, 6]", "punch", BALL, "{mu: 0.15}", 0.4, 4, "[6, 4, 6]")
STEEL = pr.J2(210e3, 0.3, pr.Linear(300.0, 500.0))


def said(tmp_path: Path, *changes: tuple[str, str]) -> tuple[int, list[str]]:
    """Exit code and sentences of `prensa check` on the case with some changes, in the order of its places."""
    text = CASE
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = tmp_path / "case.yaml"
    path.write_text(text)
    done = CliRunner().invoke(app, ["check", str(path)])
    return done.exit_code, [line.removeprefix(f"{path}:") for line in done.stderr.splitlines() if line.strip()]


PLACE = "touching: block.top, at: [0, 0, 0]"


@pytest.mark.parametrize(
    ("changes", "code", "place", "words"),
    [
        ((("radius: 5}", "radius: 0.005}"),), 0, "8:51", "0.005 mm against bodies of 6 mm; are both in the same unit?"),
        ((("y: -0.4", "y: -0.4 m"),), 0, "13:34", "a travel of 400 mm past bodies of 6 mm; is the unit right?"),
        ((("y: -0.4", "y: -400"),), 0, "13:34", "a travel of 400 mm past bodies of 6 mm; is the unit right?"),
        ((("block.top, against", "block.right, against"),), 0, "8:3", "{surface: block.top, against: punch}' to 'contacts', or"),
        ((("type: revolved", "type: extruded"), ("radius: 5}", "radius: 5}, axis: y")), 2, "8:3", "lay 'axis' along"),
        ((("radius: 5}", "radius: 5, concave: true}"),), 2, "8:3", "moved along -y until it touches 'block.top', the revolved"),
        ((("radius: 5}", "radius: 5, concave: true}"),), 2, "8:3", "change its shape or 'at', or leave 'concave' out"),
        ((("space: solid\n", ""),), 2, "4:5", "a case is in plane strain; write 'space: solid'"),
        ((("block.left: x", "block.left: y"),), 2, "10:5", "write 'block.left: x' if that is a plane of symmetry, or else"),
        ((("at: [0, 0, 0]", "at: [0, 0]"),), 2, "8:84", "at has 2 components, and 'space: solid' has 3: write [x, y, z]"),
        (((PLACE, "at: [3, 2, 3]"), ("radius: 5", "radius: 20")), 2, "8:3", "it starts so deep inside 'block.top'"),
    ],
    ids=["radius", "metres", "micrometres", "side", "roll", "cavity", "cavity, remedy", "space", "symmetry", "place", "inside"],
)  # fmt: skip
def test_the_cause_alone_is_reported(tmp_path: Path, changes, code: int, place: str, words: str) -> None:
    """Once, at its place, with its remedy."""
    found, lines = said(tmp_path, *changes)
    assert len(lines) == 1 and words in lines[0] and lines[0].startswith(f"{place}: "), lines
    assert found == code


def test_a_cause_is_as_severe_as_what_follows_from_it() -> None:
    """In the plane a radius in metres fits between two nodes, which refuses the run: the unit, which explains it, does then."""
    case = """\
name: flattening
bodies:
  strip: {mesh: {type: rectangle, size: [4, 2], n: [8, 4]}, material: {type: elastic, E: 1e3, nu: 0.3}}
tools: {die: {type: circle, radius: 0.002, touching: strip.top}}
contacts: [{surface: strip.top, against: die}]
fixed: {strip.bottom: y, strip.left: x}
steps: [{name: press, move: {die: {y: -0.2}}}]
"""
    (finding,) = preflight(pr.discretise(loads(case).problem))
    assert finding.fatal and "are both in the same unit?" in finding.message


def test_a_tool_that_leaves_on_the_far_side_between_two_moments_passes_through() -> None:
    """By a ball of 1 on a way of 60, which is not too long for bodies of 8; one that is lifted, or goes along, does not."""

    def words(way: pr.Motion) -> list[str]:
        block = pr.Body(pr.Box((8.0, 4.0, 8.0), (8, 4, 8), (-4.0, 0.0, -4.0)), STEEL)
        problem = pr.Problem(
            "block", space="solid", bodies={"b": block}, tools={"t": pr.Sphere(1.0, touching="b.top", at=(0.0, 0.0, 0.0))},
            contacts=(pr.Contact(("b.top",), "t"),), fixed={"b.bottom": "xyz"}, steps=(pr.Step("s", move={"t": way}),),
        )  # fmt: skip
        return [f.message for f in preflight(pr.discretise(problem))]

    assert [w for w in words(pr.Motion(y=-60.0)) if "passes right through 'b.top'" in w]
    (up,), (along,) = words(pr.Motion(y=60.0)), words(pr.Motion(x=2.0))
    assert "only goes away from it" in up and "it never presses" in along


def ball(file: Path, turn: range) -> str:
    """Write the part of a ball of radius 5 that a turn (degrees) about y makes of half a circle, open at its ends; its path."""

    def at(t: float, p: float) -> Array:
        return 5.0 * np.array([np.cos(t) * np.cos(p), np.sin(t), np.cos(t) * np.sin(p)])

    down = np.radians(np.arange(-90, 91, 6))
    grid = np.round([[at(t, p) for p in np.radians(turn)] for t in down], 12)
    points = grid.reshape(-1, 3)
    n, k = len(turn), np.arange(len(points) - len(turn)).reshape(-1, len(turn))[:, :-1].ravel()
    triangles = np.concatenate([np.stack([k, k + n + 1, k + 1], axis=1), np.stack([k, k + n, k + n + 1], axis=1)])
    area = np.linalg.norm(np.cross(*(points[triangles[:, i]] - points[triangles[:, 0]] for i in (1, 2))), axis=1)
    return write(file, points, triangles[area > 1e-9])


@pytest.mark.slow
@pytest.mark.parametrize("shared", [True, False], ids=["cut where the body ends", "cut beside it"])
def test_half_of_a_ball_that_ends_in_the_plane_of_symmetry_faces_what_it_presses(tmp_path: Path, shared: bool) -> None:
    """It looks along z and is pressed along -y; one that is cut beside the end of the body is a surface that lies on its side."""
    file = ball(tmp_path / "half.stl", range(0, 181, 6))
    code, lines = said(tmp_path, (BALL, f"type: stl, file: {file}"), ("at: [0, 0, 0]", f"at: [3, 0, {0 if shared else -0.5}]"),
                       (", block.left: x", ", block.left: x, block.right: x"))  # fmt: skip
    aside = [line for line in lines if "its side meets what it presses" in line]
    assert code == 0 and len(aside) == (not shared), lines


def cap(file: Path) -> str:
    """Write a cap of 60° of a ball of radius 5 that stands on the origin and looks along -z; its path."""
    down, around = np.radians(np.arange(0, 61, 6)), np.radians(np.arange(0, 361, 12))
    grid = np.array([[(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), 1.0 - np.cos(t)) for p in around] for t in down])
    n, k = len(around), np.arange((len(down) - 1) * len(around)).reshape(-1, len(around))[:, :-1].ravel()
    triangles = np.concatenate([np.stack([k, k + n + 1, k + n], axis=1), np.stack([k, k + 1, k + n + 1], axis=1)])
    points = 5.0 * np.round(grid.reshape(-1, 3), 12)
    area = np.linalg.norm(np.cross(*(points[triangles[:, i]] - points[triangles[:, 0]] for i in (1, 2))), axis=1)
    return write(file, points, triangles[area > 1e-9])


DRAG = "increments: 4}\n  - {name: drag, by: {punch: {%s: 1.5}}}"


@pytest.mark.slow
@pytest.mark.parametrize("turn", ["0, 0, 0", "0, -90 deg, 0"], ids=["as drawn", "turned towards the drag"])
@pytest.mark.parametrize("along", "xz")
def test_a_surface_is_turned_towards_what_it_presses_and_not_along_a_drag(tmp_path: Path, turn: str, along: str) -> None:
    """The way that goes into the side counts, and the turn is that of the file as it is drawn."""
    tool = f"type: stl, file: {cap(tmp_path / 'cap.stl')}, turn: [{turn}]"
    _, lines = said(tmp_path, (BALL, tool), ("increments: 4}", DRAG % along))
    (line,) = [line for line in lines if "so that its side meets" in line]
    assert "the tool moves along -y" in line and line.endswith("'turn: [-90 deg, 0, 0]'")


def test_a_surface_that_faces_the_body_and_starts_in_it_is_moved_and_not_turned(tmp_path: Path) -> None:
    """By the components that matter; how far it presses is said once it stands outside."""
    file = cap(tmp_path / "cap.stl")
    tool = f"type: stl, file: {file}, turn: [-90 deg, 0, 0], at: [0, %s, 0]"
    for height, way in (("3", "(0, 1, 0)"), ("0", "(0, 4, 0)")):
        code, (line,) = said(tmp_path, (f"{BALL}, {PLACE}", tool % height))
        assert code == 2 and f"move the tool by {way} mm" in line
        assert "to be turned" not in line and "normals look the wrong way" not in line
