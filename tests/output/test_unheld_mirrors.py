"""Sides of ``output.mirror`` that are no planes of symmetry are warned of, before a run and in it."""

from __future__ import annotations

import pytest

import prensa as pr
from prensa.model.schema import loads
from prensa.output.mirrors import unheld_mirrors

SPACE = """
name: quarter
space: solid
bodies: {b: {mesh: {type: box, size: [2, 1, 2], n: [2, 1, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {die: {type: plane, touching: b.top}}
contacts: [{surface: b.top, against: die}]
fixed: {b.bottom: y, b.left: x, b.back: z}
steps: [{name: press, move: {die: {y: -0.01}}}]
output: {mirror: [left]}
"""
PLANE = """
name: half
space: plane strain
bodies: {b: {mesh: {type: rectangle, size: [2, 1], n: [2, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {die: {type: plane, touching: b.top}}
fixed: {b.bottom: y, b.left: x}
steps: [{name: press, move: {die: {y: -0.01}}}]
output: {mirror: [left]}
"""


@pytest.mark.parametrize("text", [SPACE, PLANE])
@pytest.mark.parametrize(
    ("mirror", "warned"), [("[left]", False), ("[left, bottom]", False), ("[right]", True), ("[top]", False)]
)
def test_a_side_that_nothing_holds_is_no_plane_of_symmetry(text, mirror, warned):
    """Neither a support nor a tool stands at the right side; the die stands at the top."""
    case = loads(text.replace("mirror: [left]", f"mirror: {mirror}"))
    found = [str(f) for f in unheld_mirrors(pr.discretise(case.problem), case.output.mirror)]
    assert [("nothing holds the bodies in x at their right side" in f) for f in found] == [True] * warned


@pytest.mark.parametrize(("fixed", "warned"), [("b.bottom: xyz, b.back: z", True), ("b.bottom: xyz, b.left: x", False)])
def test_a_support_beneath_a_side_does_not_make_it_a_plane_of_symmetry(fixed, warned):
    """Its lower edge is held, and the face is not."""
    case = loads(SPACE.replace("b.bottom: y, b.left: x, b.back: z", fixed))
    found = [str(f) for f in unheld_mirrors(pr.discretise(case.problem), case.output.mirror)]
    assert ["nothing holds the bodies in x at their left side" in f for f in found] == [True] * warned


def test_a_run_says_so(tmp_path):
    """In its summary, once, and it goes on."""
    case = loads(PLANE.replace("mirror: [left]", "mirror: [right]"))
    done = pr.run(case, out=tmp_path / "r", quiet=True)
    assert done.status == "completed" and sum("nothing holds the bodies" in w for w in done.summary["warnings"]) == 1
