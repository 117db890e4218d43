"""Conduction after each increment: closed forms of a bar and of a rubbed half-space, shares of friction heat, energy balance."""

from __future__ import annotations

from dataclasses import replace
from math import erfc, exp, pi, sin, sqrt

import numpy as np
import pytest

import prensa as pr
from prensa.model.schema import loads

K, CAPACITY, COLD, HOT = 30.0, 3.6, 20.0, 200.0
STEEL, METAL = pr.Elastic(200e3, 0.0), pr.Conductor(K, CAPACITY)


def balanced(T, relative=1e-8):
    """Heat in is heat stored and heat out."""
    taken = sum(T.into_tools.values())
    size = abs(T.friction) + abs(T.through_sides) + abs(T.stored)
    return abs(T.friction + T.through_sides - T.stored - taken) <= relative * size


def bar(element, **given):
    """A bar of length 20 at 20 degrees whose left end is held at 200."""
    return pr.Problem(
        "bar", bodies={"bar": pr.Body(pr.Rectangle(size=(20.0, 1.0), n=(40, 1)), STEEL, element)},
        fixed={"bar.left": "xy"}, steps=(pr.Step("wait", duration=8.0, increments=80),),
        heat=pr.Heat({"bar": METAL}, initial=COLD, held={"bar.left": HOT}), **given,
    )  # fmt: skip


def series(x, t, length=20.0):
    """Carslaw & Jaeger (1959), 3.4: one end held, the other insulated."""
    rates = [(2 * n + 1) * pi / (2 * length) for n in range(200)]
    return HOT + (COLD - HOT) * sum(2 / (b * length) * exp(-K / CAPACITY * b**2 * t) * sin(b * x) for b in rates)


@pytest.mark.parametrize(("element", "thickness"), [("q4_fbar", 1.0), ("t3", 2.5)])
def test_a_bar_that_is_held_at_one_end(element, thickness):
    """Temperatures after 2 and 8 s to 1 % of the jump, no undershoot, heat balanced to 1e-8 in every increment."""
    increments = list(pr.solve(bar(element, thickness=thickness)))
    for inc in increments:
        assert balanced(inc.temperatures)
        T = inc.temperatures.bodies["bar"]
        assert T.min() >= COLD - 1e-9
        assert T.max() <= HOT + 1e-9
        if inc.seconds > 1.99 and (abs(inc.seconds - 2.0) < 1e-9 or inc.end_of_step):
            exact = np.array([series(x, inc.seconds) for x in inc.bodies["bar"].X[:, 0]])
            assert np.abs(T - exact).max() <= 0.01 * (HOT - COLD)
    assert inc.temperatures.stored == pytest.approx(thickness * CAPACITY * 20.0 * (np.mean(T[:41]) - COLD), rel=0.02)
    assert inc.temperatures.friction == 0.0


def rubbed(die):
    """A block under a plane that is pressed on it with 50 MPa and slides along it with 100 mm/s, μ = 0.2."""
    height, p = 20.0, 50.0
    return pr.Problem(
        "rubbed", bodies={"block": pr.Body(pr.Rectangle(size=(1.0, height), n=(1, 60), grade="top"), STEEL, "q4")},
        tools={"die": pr.Plane(touching="block.top")}, kinematics="small", friction=pr.Coulomb(0.2),
        contacts=(pr.Contact("block.top", "die"),), fixed={"block.bottom": "xy", "block.top": "x"},
        steps=(
            pr.Step("press", push={"die": pr.Push(y=-p)}, increments=1, duration=1e-6),
            pr.Step("rub", velocity={"die": {"x": 100.0}}, increments=100, duration=1.0),
        ),
        heat=pr.Heat({"block": METAL} | ({} if die is None else {"die": die}), initial=COLD),
    )  # fmt: skip


@pytest.mark.parametrize("die", [None, METAL, pr.Conductor(150.0, 2.4)], ids=["insulator", "same", "copper"])
def test_friction_heats_body_and_tool_as_half_spaces(die):
    """μ p V shared by effusivity: the surface is 2 q √(t/π)/e warmer, below it ierfc's profile; all heat is that of friction."""
    *_, last = pr.solve(rubbed(die))
    T = last.temperatures
    own, other = sqrt(K * CAPACITY), 0.0 if die is None else sqrt(die.conductivity * die.capacity)
    work = 0.2 * 50.0 * 100.0
    assert last.energy["friction"] == pytest.approx(work, rel=0.01)
    assert T.friction == pytest.approx(last.energy["friction"], rel=1e-12)
    assert balanced(T)
    assert T.into_tools["die"] == pytest.approx(work * other / (own + other), rel=0.01)
    flux, spread = work * own / (own + other), sqrt(4 * K / CAPACITY * last.seconds)
    for x, t in zip(last.bodies["block"].X, T.bodies["block"]):
        z = (20.0 - x[1]) / spread
        rise = flux / K * spread * (exp(-(z**2)) / sqrt(pi) - z * erfc(z))
        assert t - COLD == pytest.approx(rise, abs=0.01 * 2 * flux / own / sqrt(pi))


def test_heat_is_that_of_the_circumference_in_axisymmetry():
    """A disc that is held at its rim stores what all of it can; balanced in finite strain while it is pressed."""
    metal = pr.J2(200e3, 0.3, pr.Perfect(250.0))
    problem = pr.Problem(
        "disc", space="axisymmetric", bodies={"disc": pr.Body(pr.Rectangle(size=(10.0, 4.0), n=(10, 4)), metal)},
        tools={"die": pr.Plane(touching="disc.top")}, friction=pr.Coulomb(0.1), contacts=(pr.Contact("disc.top", "die"),),
        fixed={"disc.bottom": "y"}, steps=(pr.Step("press", move={"die": pr.Motion(y=-0.4)}, duration=50.0, increments=10),),
        heat=pr.Heat({"disc": METAL}, initial=COLD, held={"disc.right": HOT}),
    )  # fmt: skip
    *_, last = pr.solve(problem)
    T = last.temperatures
    assert balanced(T)
    assert T.friction == pytest.approx(last.energy["friction"], rel=1e-12)
    assert T.friction > 0.0
    mean = np.average(T.bodies["disc"], weights=np.maximum(last.bodies["disc"].X[:, 0], 0.25))
    assert T.stored == pytest.approx(CAPACITY * np.pi * 10.0**2 * 4.0 * (mean - COLD), rel=0.05)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"heat": pr.Heat({}, initial=COLD)}, "'bar' has no conductor"),
        ({"heat": pr.Heat({"bar": METAL, "dye": METAL}, initial=COLD)}, "unknown body or tool"),
        ({"heat": pr.Heat({"bar": METAL}, COLD, {"bar.lift": HOT})}, "did you mean 'left'"),
        ({"bodies": {"bar": pr.Body(pr.Rectangle((20.0, 1.0), (4, 1)), STEEL, "q8")}}, "linear elements"),
        ({"space": "plane stress"}, "not available in plane stress"),
    ],
)
def test_what_it_cannot_do_yet_is_refused(change, words):
    """In words, when the problem is described."""
    from dataclasses import replace

    with pytest.raises(pr.CaseError, match=words):
        replace(bar("q4"), **change)


def test_runs_derivatives_restarts_and_case_files_are_refused(tmp_path):
    """What would lose the temperatures says so."""
    problem = bar("q4")
    first = next(pr.solve(problem))
    with pytest.raises(pr.PrensaError, match="not part of a state"):
        next(pr.solve(problem, start=first.state))
    with pytest.raises(pr.PrensaError, match="not written yet"):
        pr.run(pr.Case(problem), tmp_path / "out", quiet=True)
    with pytest.raises(pr.PrensaError, match="temperatures are not available yet"):
        pr.solve(problem, derivatives=["bodies.bar.material.E"])
    text = """
name: bar
bodies:
  bar: {mesh: {type: rectangle, size: [1, 1], n: [2, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}
heat: {initial: 20, conductors: {bar: {conductivity: 30, capacity: 3.6}}}
steps: [{name: wait}]
"""
    with pytest.raises(pr.CaseError, match="5:1: heat is described in Python alone so far"):
        loads(text)


@pytest.mark.parametrize("held", [HOT, COLD])
def test_a_metal_beyond_the_temperatures_of_its_tests_is_reported(held, caplog):
    """Once, at the end, with both ranges; nothing of one that stays at theirs."""
    body = pr.Body(pr.Rectangle(size=(20.0, 1.0), n=(10, 1)), pr.J2(of="AISI1006"))
    heat = pr.Heat({"bar": METAL}, initial=COLD, held={"bar.left": held})
    steps = (pr.Step("wait", duration=8.0, increments=4),)
    list(pr.solve(replace(bar("q4_fbar"), bodies={"bar": body}, heat=heat, steps=steps)))
    found = [r.getMessage() for r in caplog.records if "was measured at" in r.getMessage()]
    assert len(found) == (held == HOT)
    assert held == COLD or "AISI1006, was measured at 20 °C and the run has 22.81 to 200 °C" in found[0]
