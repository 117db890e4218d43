"""One mistake in a plane case, one sentence with a right remedy: sides that face a tool, tools that are turned round or not."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.errors import CaseError, per_cent
from prensa.measures import MeasureError, parse
from prensa.model.schema import in_short, loads, warnings_of

BLOCK = """\
name: block
space: SPACE
bodies:
  b:
    mesh: {type: rectangle, size: [4, 2], n: [8, 4]}
    material: {type: j2, E: 70e3, nu: 0.3, flow: {type: voce, s0: 60, Q: 120, b: 8}}
tools:
  die: {TOOL}
contacts:
  - {surface: SIDES, against: die, friction: {type: coulomb, mu: 0.1}}
fixed: {b.bottom: y, b.left: x}
steps:
  - {name: press, move: {die: {y: -0.2}}, increments: 4}
"""


def said(tool: str, sides: str, *changes: tuple[str, str], space: str = "plane strain") -> list[str]:
    """Sentences before a run about a block 4 × 2 (0 … 4, 0 … 2) and a tool against sides of it."""
    text = BLOCK.replace("TOOL", tool).replace("SIDES", sides).replace("SPACE", space)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return [str(f) for f in preflight(pr.discretise(loads(text).problem))]


@pytest.mark.parametrize(
    ("normal", "at", "sides", "remedy"),
    [
        ("[0, -1]", "[0, 1.99]", "b", "b.top"),
        ("[-1, 0]", "[3.99, 0]", "b", "b.right"),
        ("[0, -1]", "[0, 1.99]", "[b.right, b.top]", "b.top"),
        ("[-1, 0]", "[3.99, 0]", "[b.top, b.right]", "b.right"),
    ],
)
def test_a_tool_that_starts_in_a_corner_is_to_touch_the_side_that_faces_it(normal: str, at: str, sides: str, remedy: str) -> None:
    """The node at the corner belongs to two sides; with the remedy the case is in order."""
    (line,) = said(f"type: plane, normal: {normal}, at: {at}", sides)
    assert f"place it with 'touching: {remedy}'" in line
    motion = ("{y: -0.2}", "{x: -0.2}") if "right" in remedy else ("{y: -0.2}", "{y: -0.2}")
    assert said(f"type: plane, touching: {remedy}", sides, motion) == []


@pytest.mark.parametrize(
    ("tool", "helps"),
    [
        ("type: plane, normal: [0, -1], at: [0, 1.5]", False),  # turned round it would have three quarters of the block in it
        ("type: plane, normal: [0, -1], at: [0, 0.5]", True),
        ("type: profile, points: [[-9, 1.5], [9, 1.5]], at: [0, 0]", False),
        ("type: profile, points: [[-9, 0.5], [9, 0.5]], at: [0, 0]", True),
    ],
)
def test_a_tool_is_to_be_turned_round_only_where_less_of_the_body_is_in_it_then(tool: str, helps: bool) -> None:
    """Where most of the body lies outside of it the other way round is no remedy."""
    lines = said(tool, "b.top")
    assert len(lines) == 1
    assert ("reverse" in lines[0]) == helps


def test_what_holds_a_body_is_not_asked_where_a_tool_stands_behind_its_surface() -> None:
    """A container that is drawn the wrong way round: its friction holds the billet once it is drawn the right way round."""
    billet = (
        ("fixed: {b.bottom: y, b.left: x}\n", ""),
        ("contacts:\n", "contacts:\n  - {surface: b.top, against: punch}\n"),
        ("tools:\n", "tools:\n  punch: {type: plane, touching: b.top}\n"),
        ("{die: {y", "{punch: {y"),
    )
    wrong = "type: profile, points: [[0, 0], [4, 0], [4, 40]], fillet: 0, at: [0, 0]"
    (line,) = said(wrong, "[b.bottom, b.right]", *billet, space="axisymmetric")
    assert "reverse the order of its 'points'" in line
    right = "type: profile, points: [[4, 40], [4, 0], [0, 0]], fillet: 0, at: [0, 0]"
    assert said(right, "[b.bottom, b.right]", *billet, space="axisymmetric") == []


@pytest.mark.parametrize(("side", "tool", "motion"), [("top", "b.top", "{y: -0.2}"), ("right", "b.right", "{x: -0.2}")])
def test_a_side_that_is_held_and_pressed_is_named(side: str, tool: str, motion: str) -> None:
    """Where contacts are left out a tool has none with sides that are held: no travel is too long, a support too many."""
    listed = ("contacts:\n  - {surface: b, against: die, friction: {type: coulomb, mu: 0.1}}\n", "")
    held = {"top": "b.top: y, b.left: x", "right": "b.bottom: y, b.right: x"}[side]
    (line,) = said(f"type: plane, touching: {tool}", "b", listed, ("{y: -0.2}", motion), ("b.bottom: y, b.left: x", held))
    assert f"the two contradict each other; remove 'b.{side}' from the supports" in line
    (line,) = said("type: plane, touching: b.top", "b", listed, ("{y: -0.2}", "{y: -2.5}"))
    assert "is its travel larger than the body?" in line


def test_of_an_exponent_in_per_cent_nothing_follows_for_units() -> None:
    """The flow stress of such a curve is next to nothing."""
    swift = "{type: swift, K: 600, e0: 0.01, n: 22}"
    text = BLOCK.replace("TOOL", "type: plane, touching: b.top").replace("SIDES", "b.top").replace("SPACE", "plane strain")
    (line,) = warnings_of(loads(text.replace("{type: voce, s0: 60, Q: 120, b: 8}", swift)).problem)
    assert "did you mean 0.22?" in line


@pytest.mark.parametrize(
    ("measure", "meant"), [("die.Fy", "die.fy"), ("DIE.FORCE.Y", "die.force.y"), ("max die.force.y", "max(die.force.y)")]
)
def test_measures_differ_by_capitals_and_brackets(measure: str, meant: str) -> None:
    """The nearest name is that in other letters, not one that differs in less of them."""
    p = loads(BLOCK.replace("TOOL", "type: plane, touching: b.top").replace("SIDES", "b.top").replace("SPACE", "plane strain"))
    with pytest.raises(MeasureError, match=re.escape(f"did you mean '{meant}'?")):
        parse(measure, p.problem)


def test_a_speed_where_a_length_belongs_is_called_one() -> None:
    """With the key that takes it."""
    with pytest.raises(CaseError, match="'-8 mm/s' is a speed, and a length is meant; speeds of tools are given by 'velocity'"):
        said("type: plane, touching: b.top", "b.top", ("{y: -0.2}", "{y: -8 mm/s}"))


@pytest.mark.parametrize("origin", [[0.0, 1.5], [1.0, 1.0], [2.0, 1.25]])
def test_bodies_that_overlap_do_not_lie_on_one_another_besides(origin: Sequence[float]) -> None:
    """Parts of their outlines coincide in some of these places."""
    second = f"  upper:\n    mesh: {{type: rectangle, size: [2, 2], n: [4, 4], origin: {list(origin)}}}\n"
    second += "    material: {type: elastic, E: 1 GPa, nu: 0.3}\n"
    changes = (("tools:\n", second + "tools:\n"), ("{y: -0.2}", "{x: 0.2}"), (", b.left: x", ", b.right: x, upper.right: xy"))
    lines = said("type: plane, touching: b.left", "b.left", *changes)
    about = [line for line in lines if "bodies.upper" in line or "overlap" in line]
    assert len(about) == 1 and "it overlaps body 'b'" in about[0]


def test_numbers_of_sentences_are_short() -> None:
    """Shares without powers of ten, tables of many rows by their ends."""
    assert [per_cent(x) for x in (1.0, 0.996, 12.3, 0.0634, 0.00123)] == ["100 %", "100 %", "1200 %", "6.3 %", "0.12 %"]
    long = pr.Motion(y=tuple((0.1 * k, 0.01 * k) for k in range(11)))
    assert in_short(long) == "{y: [[0, 0], [0.1, 0.01], …, [1, 0.1]]}"
    assert in_short(pr.Motion(y=((0.0, 0.0), (1.0, 0.5)))) == "{y: [[0, 0], [1, 0.5]]}"
