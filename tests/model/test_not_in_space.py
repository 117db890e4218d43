"""What there is not in space is refused with the sentences of one table, which are those of the guide."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest

import prensa as pr
from coining import coining
from prensa.cli.dies import refuse_section
from prensa.dies.loads import tool_loads
from prensa.errors import PrensaError
from prensa.measures import parse
from prensa.model.heat import Conductor, Heat
from prensa.model.not_in_space import NOT_IN_SPACE, words_of
from prensa.model.schema import loads
from users_metals import Metal


class Flat(Metal):
    """A metal for the plane alone."""

    in_space = False


ROLL = "type: extruded, section: {type: circle, radius: 20}, axis: [0, 0, 1]"
CASE = coining("[5, 3, 5]", "roll", ROLL, "{mu: 0.1}", 0.5, 5)
SECOND = """bodies:
  lid: {mesh: {type: box, size: [1, 1, 1], n: [1, 1, 1], origin: [0, 9, 0]}, material: {type: elastic, E: 1e3, nu: 0.3}}"""
OF_CASES: dict[str, tuple[tuple[str, str], dict[str, object]]] = {
    "remesh": (("steps:", "remesh: auto\nsteps:"), {}),
    "thickness": (("steps:", "thickness: 10\nsteps:"), {}),
    "mesh": (("type: box, size: [10, 5, 10], n: [5, 3, 5]", "type: rectangle, size: [10, 5], n: [5, 3]"),
             {"kinds": "'box', 'cylinder', 'extruded', 'revolved', 'bricks', 'tetrahedra', 'file'", "type": "rectangle"}),
    "element": (("    material:", "    element: q4\n    material:"), {"element": "q4"}),
    "tool": ((ROLL, "type: circle, radius: 20"), {"type": "circle"}),
    "whole body": (("{surface: block.top,", "{surface: block,"), {"body": "block", "side": "block.top", "tool": "roll"}),
    "no contacts": (("contacts:\n  - {surface: block.top, against: roll, friction: {mu: 0.1}}\n", ""),
                    {"entries": "{surface: block.top, against: roll}"}),
    "integration": (("against: roll,", "against: roll, integration: gauss2,"), {}),
    "interference": (("against: roll,", "against: roll, interference: 0.1,"), {}),
    "interference of ties": (("bodies:", f"ties: [{{slave: lid.bottom, master: block.top, interference: 0.1}}]\n{SECOND}"), {}),
    "shear": (("steps:", "loads: {block.right: {shear: 10}}\nsteps:"), {}),
    "moment": (("move: {roll: {y: -0.5}}", "push: {roll: {y: -9, m: 1}}"), {}),
    "wear": (("steps:", "output: {wear: {roll: {type: archard, k: 1e-4, hardness: 7000}}}\nsteps:"), {}),
}  # fmt: skip
"""Feature → change of the case that asks for it, and the names in braces of its sentence."""


@pytest.mark.parametrize("feature", OF_CASES)
def test_a_case_is_refused_with_the_sentence_of_the_table(feature):
    """And with its line."""
    (old, new), given = OF_CASES[feature]
    assert old in CASE
    with pytest.raises(PrensaError) as caught:
        loads(CASE.replace(old, new, 1), "a.yaml")
    line = next(line for line in str(caught.value).splitlines() if words_of(feature, **given) in line)
    assert line.startswith("a.yaml:")


def _condensed(problem: pr.Problem) -> object:
    return list(pr.solve(problem, pr.Numerics(condense=True)))


OTHERS = {
    "material": lambda p: replace(p, bodies={"block": replace(p.bodies["block"], material=Flat(70e3, 0.3, 300.0, 500.0))}),
    "body_contacts": lambda p: replace(p, body_contacts=(pr.BodyContact("block.top", "block.bottom"),)),
    "heat": lambda p: replace(p, heat=Heat({"block": Conductor(50.0, 4.0)}, 20.0)),
    "outlines": lambda p: parse("block.folds", p),
    "lines of contact": lambda p: parse("block.top-roll.length", p),
    "condense": _condensed,
    "die": lambda _: refuse_section({"--thickness": 20.0}),
    "loads along outlines": lambda p: tool_loads([], p, "roll"),
    "adjoint": lambda p: pr.gradient(p, "roll.force.y", ["contacts.0.friction.mu"]),
}
"""Features of Python, measures and commands."""


@pytest.mark.parametrize("feature", OTHERS)
def test_scripts_and_commands_are_refused_with_the_sentence_of_the_table(feature):
    """Up to the names that it gives."""
    with pytest.raises(PrensaError) as caught:
        OTHERS[feature](loads(CASE).problem)
    for part in words_of(feature, **dict.fromkeys(NOT_IN_SPACE[feature].example, "|")).split("|"):
        assert part.strip("'") in str(caught.value)


def test_every_row_of_the_table_is_tried():
    """A new one needs a case of its own."""
    assert {*OF_CASES, *OTHERS} == set(NOT_IN_SPACE)


def test_the_page_of_the_guide_has_the_table():
    """It is written by docs/make_not_in_space.py."""
    path = Path(__file__).parents[2] / "docs" / "make_not_in_space.py"
    spec = importlib.util.spec_from_file_location("make_not_in_space", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    text = module.PAGE.read_text(encoding="utf-8")
    assert module.page(text) == text, "run docs/make_not_in_space.py"
