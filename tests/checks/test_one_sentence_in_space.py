"""One mistake in a case in space, one sentence: what follows from it is not said besides."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from typer.testing import CliRunner

from coining import coining
from prensa.cli import app

CASE = coining("[4, 3, 4]", "ball", "type: sphere, radius: 20", "{mu: 0.1}", 0.3, 3)
SECOND = """\
bodies:
  base:
    mesh: {type: box, size: [10, 5, 10], n: [3, 2, 3], origin: [0, HEIGHT, 0]}
    material: {type: elastic, E: 210e3, nu: 0.3}
"""


def said(tmp_path: Path, text: str, *command: str) -> tuple[int, list[str], str]:
    """Exit code, sentences and what else a command says of a case."""
    path = tmp_path / "case.yaml"
    path.write_text(text)
    done = CliRunner().invoke(app, [*(command or ("check",)), str(path)])
    return done.exit_code, [line for line in done.stderr.splitlines() if line.strip()], done.stdout


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("size: [10, 5, 10]", "size: [0.01, 0.005, 0.01]", "the body measures 0.01 mm; is the unit right?"),
        ("K: 600", "K: 600e6", "check the units of both"),
        ("block.left: x, ", "", "if that is a plane of symmetry, 'fixed' lacks 'block.left: x'"),
        ("block.left: x, block.back: z", "block.left: z, block.back: x", "'fixed' lacks 'block.left: x, block.back: z'"),
        ("block.bottom: y, block.left: x, ", "block.bottom: xyz, ", "pushes it aside along x, and a tool stands in"),
        ("block.bottom: y, ", "block.bottom: xyz, ", ""),
        ("type: sphere, radius: 20,", "type: pyramid, of: vickers, radius: 0.5,", ""),  # its tip lies in the plane of the top
        ("type: sphere, radius: 20, touching: block.top, at: [0, 0, 0]", "type: plane, touching: block.top", ""),
        ("y: -0.3", "y: 0.3", "only goes away from it, by up to 0.3: it never presses"),
        (
            "type: box, size: [10, 5, 10], n: [4, 3, 4]", "type: rectangle, size: [10, 5], n: [4, 3]",
            "take it as the 'section' of an 'extruded' or a 'revolved' one",
        ),
        ("at: [0, 0, 0]", "at: z", "at of tool 'ball' (sphere) is 'z'; a list of 3 lengths is expected"),
        (
            "type: sphere, radius: 20", "type: extruded, section: {type: circle, radius: 20}, axis: [0, 1]",
            "axis of tool 'ball' (extruded) has 2 values; 'x', 'y', 'z' or a list of 3 numbers is expected",
        ),
        (
            "type: sphere, radius: 20", "type: revolved, section: {type: circle, radius: 20}, axis: [0, 0, 0]",
            "the axis [0, 0, 0] has no direction; write 'x', 'y', 'z' or a vector",
        ),
        ("{y: -0.3}", "{z: -0.3}", "only goes away from it"),
        ("{y: -0.3}", "{y: -0.3, rz: 30}", "for degrees write '30 deg'"),
        ("block.bottom: y", "block.top: y", "the two contradict each other; take the support off the contact surface"),
        ("bodies:\n", SECOND.replace("HEIGHT", "-4"), "it overlaps body 'base', by 1 mm"),
        ("bodies:\n", SECOND.replace("HEIGHT", "-5"), "join them with 'ties', or make one a tool"),
    ],
    ids=["metres", "flow stress", "plane of symmetry", "planes exchanged", "base held", "base held, planes too", "tip",
         "none", "sign", "plane mesh", "place", "two numbers",
         "no axis", "wrong axis", "degrees", "pressed side held", "overlap", "untied"],
)
def test_one_sentence_for_one_mistake(tmp_path: Path, old: str, new: str, words: str) -> None:
    """With its place and a remedy; nothing of a case that is in order."""
    text = CASE.replace(old, new)
    if "base" in new:
        text = text.replace("block.bottom: y", "base.bottom: y, base.left: x, base.back: z")
    _, lines, _ = said(tmp_path, text)
    assert len(lines) == (1 if words else 0), lines
    assert not words or words in lines[0]


def test_a_tool_that_slides_where_another_one_presses_is_no_mistake(tmp_path: Path) -> None:
    """Nor one that is lifted from what an earlier step has pressed."""
    plate = "  plate: {type: plane, touching: block.right}\ncontacts:\n  - {surface: block.right, against: plate}\n"
    two = CASE.replace("contacts:\n", plate)
    for motion in ("{ball: {y: -0.3}, plate: {y: -0.1}}", "{ball: {y: -0.3}}"):
        assert said(tmp_path, two.replace("{ball: {y: -0.3}}", motion))[:2] == (0, [])
    lifted = CASE + "  - {name: lift, by: {ball: {y: 1}}, increments: 1}\n"
    assert said(tmp_path, lifted)[:2] == (0, [])


def test_forces_are_said_for_the_whole_part(tmp_path: Path) -> None:
    """Of a quarter: what is pushed with 20 kN is a quarter of 80 kN; a ball that is pushed along x too has the halves beside."""
    text = CASE.replace("move: {ball: {y: -0.3}}", "push: {ball: {y: -20 kN}}, until: {force: {ball: {y: 10 kN}}}")
    _, _, out = said(tmp_path, text + "output: {mirror: [left, back]}\n")
    assert "step press: push y of ball is -20 kN on what is modelled, -80 kN on the whole part" in out
    assert "step press: until.force y of ball is 10 kN on what is modelled, 40 kN on the whole part" in out
    aside = text.replace("-20 kN}", "-20 kN, x: 1 kN}")
    _, _, out = said(tmp_path, aside + "output: {mirror: [back]}\n")
    for words in ("push y of ball is -20 kN on what is modelled, -40 kN", "push x of ball is 1 kN on what is modelled, 2 kN"):
        assert f"step press: {words} on the whole part" in out
    code, lines, _ = said(tmp_path, aside + "output: {mirror: [left, back]}\n")
    assert code and "tool 'ball' reaches across the plane of symmetry 'left', x = 0, and is free to move" in lines[-1]
    assert "whole part" not in said(tmp_path, text)[2]
    press = text.replace("push: {ball: {y: -20 kN}}", "move: {ball: {y: -0.3}}")
    press = press.replace("at: [0, 0, 0]}", "at: [0, 0, 0], press: {capacity: 400 kN, mirror: [left, back]}}")
    assert "until.force y of ball is 10 kN on what is modelled, 40 kN on the whole part" in said(tmp_path, press)[2]


def test_of_a_run_in_which_nothing_happens_no_energy_is_missed(tmp_path: Path) -> None:
    """Round-off has no balance."""
    text = CASE.replace("y: -0.3", "y: 0.3") + "output: {pictures: false, report: false}\n"
    code, lines, _ = said(tmp_path, text, "run", "-q", "--out", str(tmp_path / "out"))
    assert code == 0 and not [line for line in lines if "energy" in line] and [line for line in lines if "never touched" in line]
    with (tmp_path / "out" / "history.csv").open() as file:
        assert all(float(row["ball.fy"]) == 0.0 for row in csv.DictReader(file))


@pytest.mark.parametrize("side", ["inner", "nose"])
@pytest.mark.parametrize(
    "step", ["push: {punch: {y: -5 kN}}", "move: {punch: {y: -0.1}}, until: {force: {punch: {y: -5 kN}}}"], ids=["push", "until"]
)
def test_a_force_on_no_part_of_a_whole_is_said_with_its_place(tmp_path: Path, side: str, step: str) -> None:
    """Of a side that is round, or that there is not, as a plane of symmetry: the line of 'mirror', by check and run alike."""
    text = f"""\
name: sector
space: solid
bodies:
  ring:
    mesh: {{type: cylinder, radius: 10, bore: 4, height: 7, n: [2, 2, 4], angle: 60 deg}}
    material: {{type: j2, E: 210 GPa, nu: 0.3, flow: {{type: linear, s0: 300, H: 500}}}}
tools: {{punch: {{type: plane, touching: ring.top}}}}
contacts: [{{surface: ring.top, against: punch}}]
fixed: {{ring.bottom: y, ring.base: z, ring.cap: normal}}
steps: [{{name: press, {step}}}]
output: {{mirror: [ring.{side}]}}
"""
    for command in (("check", "-q"), ("run", "-q", "--out", str(tmp_path / "out"))):
        code, (line,), _ = said(tmp_path, text, *command)
        assert code == 2 and line.startswith(f"{tmp_path / 'case.yaml'}:11:10: output.mirror: ") and side in line
        assert ("not flat" in line and "leave it out" in line) if side == "inner" else "known: 'bottom', 'top'" in line


def test_contacts_left_out_of_a_case_that_cannot_be_read_have_a_place(tmp_path: Path) -> None:
    """That in space they name sides is said at the tools, beside what else is wrong, and not at the first line."""
    without = CASE[: CASE.index("contacts:")] + CASE[CASE.index("fixed:") :]
    _, lines, _ = said(tmp_path, without.replace("nu: 0.3", "nu: 0.7"))
    (words,) = [line for line in lines if "'contacts' is missing" in line]
    number = next(i for i, line in enumerate(without.splitlines(), 1) if line.strip().startswith("ball:"))
    assert words.startswith(f"{tmp_path / 'case.yaml'}:{number}:") and len(lines) == 2
