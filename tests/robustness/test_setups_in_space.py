"""Checks of set-ups in space: loads by rules of their own, springs, two tools, other elements and enforcements."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from answers import passes, recorded

import prensa as pr
from prensa_bench.robustness import cells_in_space, loads_in_space, tools_in_space
from prensa_bench.robustness import checks_in_space as checks
from prensa_bench.robustness.drawn import Drawn
from prensa_bench.robustness.families import drawn
from prensa_bench.robustness.files import Record, Shape
from prensa_bench.robustness.split_in_space import split

ALL_SIDES = ("left", "right", "bottom", "top", "back", "front")
BOX = pr.Box(size=(3.0, 2.0, 2.0), n=(3, 2, 2), origin=(-1.5, 0.0, -1.0))


def moved(tetrahedra: bool, loads: dict[str, pr.Load]) -> Record:
    """A box whose nodes have been moved at random, half-way through a step with loads."""
    mesh = split(BOX) if tetrahedra else BOX
    step = pr.Step("load", loads=loads)
    p = pr.Problem("moved", space="solid", bodies={"body": pr.Body(mesh, pr.Elastic(1e4, 0.3))}, fixed={}, steps=(step,))
    made = pr.discretise(p).meshes["body"]
    X = made.points
    x = X + np.random.default_rng(5).uniform(-0.1, 0.1, X.shape)
    shape = Shape(X, x, made.cells, np.zeros_like(X))
    return Record(p, {"increment": np.array([3]), "time": np.array([0.5])}, ["load"], {}, {3: {"body": shape}})


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_a_pressure_on_all_sides_is_balanced_and_its_virial_is_the_volume(tetrahedra):
    """Σf = 0, Σx × f = 0, Σf·x = −3 p V on any shape: Gauss's theorem; half of the pressure is there half-way."""
    record = moved(tetrahedra, {f"body.{side}": pr.Load(pressure=6.0) for side in ALL_SIDES})
    (f,), s = loads_in_space.applied(record, 3).values(), record.bodies[3]["body"]
    assert np.abs(f).max() > 1.0
    assert np.abs(f.sum(axis=0)).max() < 1e-12 > np.abs(np.cross(s.x, f).sum(axis=0)).max()
    assert (f * s.x).sum() == pytest.approx(-3.0 * 3.0 * cells_in_space.volumes(s.cells, s.x).sum(), rel=1e-12)


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_a_traction_acts_on_the_undeformed_side(tetrahedra):
    """Its sum is the stress times the area that the side had."""
    record = moved(tetrahedra, {"body.right": pr.Load(traction=(1.0, -2.0, 4.0))})
    (f,) = loads_in_space.applied(record, 3).values()
    assert f.sum(axis=0) == pytest.approx([2.0, -4.0, 8.0], rel=1e-12)


def pressed() -> Drawn:
    """A plastic box under a ball on springs that is pushed sideways too, a roll from the right, a pressure and a traction."""
    top, right = tools_in_space.ball((0.0, 12.0, 0.0), 10.0), tools_in_space.roll((4.5, 1.0, 0.0), 3.0, "z")
    top = replace(top, tool=replace(top.tool, spring=pr.Springs(x=2e4, y=3e4, rz=1e5)))
    tools, mu = {"tool": top, "roll": right}, {"body.top-tool": 0.3, "body.right-roll": 0.2}
    loads = {"body.left": pr.Load(pressure=8.0), "body.front": pr.Load(traction=(2.0, 1.0, -3.0))}
    contacts = (
        pr.Contact(("body.top",), "tool", friction=pr.Coulomb(0.3), enforcement=pr.Exact()),
        pr.Contact(("body.right",), "roll", friction=pr.Coulomb(0.2), enforcement=pr.Augmented()),
    )
    p = pr.Problem(
        "set-up", space="solid", bodies={"body": pr.Body(BOX, pr.J2(1e4, 0.3, pr.Linear(20.0, 100.0)), "h8_bbar")},
        tools={k: v.tool for k, v in tools.items()}, contacts=contacts, fixed={"body.bottom": "xyz"}, steps=(
            pr.Step("press", move={"tool": pr.Motion(y=-0.05), "roll": pr.Motion(x=-0.02)}, loads=loads, increments=4),
            pr.Step("on", move={"tool": pr.Motion(x=0.05), "roll": pr.Motion(rz=0.02)}, increments=4),
        ),
    )  # fmt: skip
    return Drawn((p,), tools, mu, 1e4, 0.3, 60.0)


@cache
def solved() -> tuple[Drawn, Record]:
    d = pressed()
    return d, recorded(d)


def test_a_right_answer_passes():
    """Nothing is found in the answer that the wrong ones are made of; there is pressure, friction and flow in it."""
    passes(checks, *solved())


def other(**changed: object) -> Record:
    """The answer, said to be that of a problem with other loads or springs."""
    d, record = solved()
    p = d.problem
    if "springs" in changed:
        tool = replace(p.tools["tool"], spring=changed["springs"])
        return replace(record, problem=replace(p, tools={**p.tools, "tool": tool}))
    steps = (replace(p.steps[0], loads={**p.steps[0].loads, **changed["loads"]}), p.steps[1])
    return replace(record, problem=replace(p, steps=steps))


OTHER = {
    "another pressure": (checks.balance, {"loads": {"body.left": pr.Load(pressure=8.01)}}, "out of balance"),
    "another traction": (checks.balance, {"loads": {"body.front": pr.Load(traction=(2.0, 1.0, -3.01))}}, "out of balance"),
    "their work": (checks.energy, {"loads": {"body.left": pr.Load(pressure=9.0)}}, "off forces times paths"),
    "their moments": (checks.moments, {"loads": {"body.left": pr.Load(pressure=9.0)}}, "moments of tools and supports"),
    "a softer spring": (checks.driven, {"springs": pr.Springs(x=2e4, y=2.9e4, rz=1e5)}, "was asked"),
    "its work": (checks.energy, {"springs": pr.Springs(x=2e4, y=2.9e4, rz=1e5)}, "off forces times paths"),
}


@pytest.mark.parametrize("what", OTHER)
def test_the_answer_of_another_problem_is_found(what):
    """An answer to other loads or springs is refused by the check that is there for it."""
    check, changed, words = OTHER[what]
    d, record = solved()
    assert check(d, record) == ""
    assert re.search(words, check(d, other(**changed)))


def test_the_family_draws_what_it_is_to_draw():
    """All acts, materials, elements and enforcements."""
    words = " ".join(drawn("setups", 7, k).kind for k in range(60))
    for what in (
        "springs", "load (", "side tool", "anvil", "neo_hooke", "h8_enhanced", "h8_bbar", "exact", "augmented", "penalty",
        "of tetrahedra", "release",
    ):  # fmt: skip
        assert what in words


def test_a_bar_narrower_than_bricks_goes_over_a_node():
    """A punch that would go down between the nodes of a box through all of it stands over one of them."""
    d = drawn("setups", 173205, 10)
    mesh, tool = pr.discretise(d.problem).meshes["body"], d.tools["tool"]
    x = mesh.points[mesh.nodes("top")] - np.asarray(tool.at)
    assert tool.tool.at == tool.at and tool.outline(x + np.array([0.0, 1e-9, 0.0]))[0].min() < 0.0
