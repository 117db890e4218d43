"""Elements that are chosen for bodies whose description names none: see also test_bending."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import prensa as pr
from prensa.cli.describe import lines_of
from prensa.output.run import run

STEEL = pr.J2(200e3, 0.3, pr.Ludwik(250.0, 500.0, 0.3))
BLOW = pr.Until(energy={"punch": 0.2e6})


def billet(
    until: pr.Until | None, space: str = "axisymmetric", element: str | None = None, material: pr.Material = STEEL
) -> pr.Problem:  # fmt: skip
    solid = space == "solid"
    mesh = pr.Box(size=(10.0, 15.0, 10.0), n=(2, 3, 2)) if solid else pr.Rectangle((10.0, 15.0), n=(4, 6))
    fixed = {"billet.bottom": "y", "billet.left": "x"} | ({"billet.back": "z"} if solid else {})
    return pr.Problem(
        "blow", bodies={"billet": pr.Body(mesh, material, element)}, tools={"punch": pr.Plane(touching="billet.top")},
        space=space, friction=pr.Coulomb(0.3), contacts=[pr.Contact(("billet.top", "billet.right"), "punch")],
        fixed=fixed, steps=[pr.Step("blow", by={"punch": pr.Motion(y=-4.0)}, until=until)],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("problem", "element"),
    [
        (billet(BLOW), "q4_bbar"),
        (billet(BLOW, "plane strain"), "q4_bbar"),
        (billet(BLOW, "plane stress"), "q4"),
        (billet(BLOW, "solid"), "h8_bbar"),
        (billet(None), "q4_fbar"),
        (billet(BLOW, element="q4_fbar"), "q4_fbar"),
        (billet(BLOW, material=pr.NeoHooke(10.0, 0.3)), "q4_fbar"),
    ],
)
def test_metal_under_a_given_energy_has_an_element_that_keeps_it(problem: pr.Problem, element: str) -> None:
    """Where bodies that flow name none, and `check` says why; the blocks have it."""
    system = pr.discretise(problem)
    assert system.problem.element_name("billet") == element == system.blocks[0].element.type
    assert (system.chosen == {"billet": "energies are balanced"}) == (element in ("q4_bbar", "h8_bbar"))
    assert any(f"elements {element}" in line for line in lines_of(system))


def test_a_case_that_starts_from_a_run_has_its_element(tmp_path: Path) -> None:
    """A blow after a press: the state at the start is in balance with the element of the run that led there."""
    pressed = replace(billet(None), steps=[pr.Step("press", by={"punch": pr.Motion(y=-1.0)})])
    run(pr.Case(pressed, output=pr.Output(pictures=False, report=False, fields=0)), tmp_path / "first", quiet=True)
    blow = pr.discretise(replace(billet(BLOW), start=pr.Start(str(tmp_path / "first"))))
    assert blow.problem.element_name("billet") == "q4_fbar"


def test_bodies_that_are_remeshed_are_of_triangles(tmp_path: Path) -> None:
    """Where they name no element; a case that goes on from one without remeshing names it."""
    remeshed = replace(billet(None), remesh="auto")
    system = pr.discretise(remeshed)
    assert system.blocks[0].element.type == "t6" and system.chosen == {"billet": "new meshes are of triangles"}
    assert pr.discretise(billet(None)).blocks[0].element.type == "q4_fbar"
    short = replace(remeshed, steps=[pr.Step("press", by={"punch": pr.Motion(y=-0.01)}, increments=1)])
    run(pr.Case(short, output=pr.Output(pictures=False, report=False, fields=0)), tmp_path / "first", quiet=True)
    with pytest.raises(pr.PrensaError, match="'billet' has element 't6' in the earlier run; write 'element: t6' here"):
        pr.discretise(replace(billet(None), start=pr.Start(str(tmp_path / "first"))))


def test_an_outline_is_of_triangles() -> None:
    """As its mesher makes them."""
    mesh = pr.Outline(points=[(0, 0), (4, 0), (0, 3)], sides=["bottom", "slope", "left"], size=1.0)
    problem = pr.Problem("outline", space="plane stress", bodies={"wedge": pr.Body(mesh, pr.Elastic(E=1e3, nu=0.3))},
                         fixed={"wedge.bottom": "xy"}, steps=[pr.Step("rest")])
    assert pr.discretise(problem).blocks[0].element.type == "t6"


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.4])
def test_blows_balance_by_default_whatever_the_friction(mu: float) -> None:
    """Given = plastic + friction + elastic to 1e-3, and no blow gives more than it was given."""
    two = [
        pr.Step("first", by={"punch": pr.Motion(y=-8.0)}, until=pr.Until(energy={"punch": 0.5e6})),
        pr.Step("up", by={"punch": pr.Motion(y=1.0)}),
        pr.Step("second", by={"punch": pr.Motion(y=-8.0)}, until=pr.Until(energy={"punch": 0.8e6})),
    ]
    problem = replace(billet(None), steps=two, friction=pr.Coulomb(mu))
    energies = {}
    for inc in pr.solve(problem):
        energies[inc.step] = inc.energy
    before = 0.0
    for step, given in (("first", 0.5e6), ("second", 0.8e6)):
        e = energies[step]
        spent = e["plastic"] + e["friction"] + e["elastic"]
        start = 0.0 if step == "first" else before
        assert spent - start == pytest.approx(given, rel=1e-3)
        up = energies["up"]
        before = up["plastic"] + up["friction"] + up["elastic"]
