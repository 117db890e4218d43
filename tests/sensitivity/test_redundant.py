"""Derivatives with exact contact at nodes whose motion along the tool supports prescribe: they keep their multipliers."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from test_derivatives import agreement, force

import prensa as pr
from prensa.errors import ArgumentError
from prensa.measures import parse
from prensa.model.problem import Problem
from prensa.model.schema import loads
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from prensa.result.increment import Increment
from prensa.sensitivity.parameters import numbers, value_of

# the upper corner of the left side slides with the support while the tool presses, and sticks when it is lifted and comes back
HELD = """
name: block with a driven side
space: plane strain
bodies:
  b:
    mesh: {type: rectangle, size: [2, 1.5], n: [3, 2], origin: [2, 0]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: ludwik, s0: 10, K: 20, n: 0.3}}
tools: {die: {type: plane, touching: b.top}}
friction: {type: coulomb, mu: 0.2}
contacts: [{surface: b, against: die, enforcement: {type: exact}}]
fixed: {b.bottom: xy}
steps:
  - {name: press, move: {die: {y: -0.25}}, by: {b.left: {x: 0.05}}, increments: 3}
  - {name: lift, by: {die: {y: 0.02}}, increments: 2}
  - {name: press again, by: {die: {y: -0.06}}, increments: 2}
"""
PRESS = "{name: press, move: {die: {y: -0.25}}, by: {b.left: {x: 0.05}}, increments: 3}"
PUSHED = "{name: press, push: {die: {y: -25}}, by: {b.left: {x: 0.05}}, increments: 3}"
ALONG = "{name: along, by: {die: {y: -0.04, x: 0.02}, b.left: {y: -0.04, x: 0.02}}, increments: 2}"  # the node with the tool
OPTIONS = {
    "coulomb": [],
    "axisymmetry": ["space=axisymmetric"],
    "elastic, by differences": ["bodies.b.material={type: neo_hooke, E: 60, nu: 0.4}", "bodies.b.element=t3"],
    "q8": ["bodies.b.element=q8"],
    "gauss1": ["contacts=[{surface: b, against: die, integration: gauss1, enforcement: {type: exact}}]"],
    "friction of the slip": ["friction={type: coulomb, mu: {mu0: 0.05, mu_inf: 0.2, u0: 0.1}}"],
    "shear factor": ["friction={type: shear, m: 0.3}"],
    "levanov": ["friction={type: levanov, m: 0.3}"],
    "stribeck": ["friction={type: stribeck, mu_static: 0.2, mu_kinetic: 0.1, speed: 0.5, viscous: 0.01}"],
    "small strain": [
        "kinematics=small",
        "allow_large_strain=true",
        "contact_geometry=reference",
        "contacts=[{surface: b.top, against: die, enforcement: {type: exact}}]",
    ],
    "spring": ["tools.die={type: plane, touching: b.top, spring: {y: 300}}"],
    "roll": ["tools.die={type: circle, radius: 6, touching: b.top}"],
    "tool along": [
        f"steps=[{PRESS}, {{name: along, by: {{die: {{x: -0.05}}}}, increments: 2}}, {{name: lift, by: {{die: {{y: 0.02}}}}}}]"
    ],
    "held both ways": [f"steps=[{PUSHED}, {ALONG}]"],
}

# the upper left corner of b is tied to a side that supports move: nothing else leads it along the tool
TIED = """
name: block tied to a driven side
space: plane strain
bodies:
  a: {mesh: {type: rectangle, size: [2, 2], n: [2, 2], origin: [1, 0]}, material: MATERIAL, element: q4}
  b: {mesh: {type: rectangle, size: [2, 2], n: [3, 2], origin: [3, 0]}, material: MATERIAL, element: q4_fbar}
ties: [{slave: b.left, master: a.right}]
tools: {die: {type: plane, touching: b.top}}
friction: {type: coulomb, mu: 0.15}
contacts: [{surface: b.top, against: die, enforcement: {type: exact}}]
no_contact: [{surface: a.top, against: die}]
fixed: {a.bottom: y, b.bottom: y, a.left: x}
steps:
  - {name: press, move: {die: {y: -0.08}}, by: {a.right: {x: 0.05}}, increments: 4}
  - {name: hold, by: {a.right: {x: -0.01}, die: {y: -0.01}}, increments: 3}
  - {name: lift, by: {die: {y: 0.015}}, increments: 4}
""".replace("MATERIAL", "{type: j2, E: 1000, nu: 0.3, flow: {type: ludwik, s0: 10, K: 20, n: 0.3}}")


def held(*overrides: str) -> Problem:
    return loads(HELD, overrides=list(overrides)).problem


def along(i: Increment) -> float:
    """Force of the block along its die."""
    return i.force("die").x


def paths_of(problem: Problem) -> list[str]:
    """What moves nothing against a tool on which supports hold it still, whose friction has a kink then."""
    words = ("friction", "material", "mesh.size", "radius", "steps.0.", "spring")
    found = [p for p, v in numbers(problem).items() if any(w in p for w in words) and v != 0.0]
    return [p for p in found if not p.endswith(".theta")]


# a rule acts in the same way whatever holds the node: one with each option, in turn, and both with the first
PAIRS = [("coulomb", "bdf2"), *zip(OPTIONS, itertools.cycle(["backward_euler", "bdf2"]))]


@pytest.mark.parametrize(("option", "rule"), PAIRS)
def test_derivatives_are_those_of_whole_runs(option: str, rule: str, caplog: pytest.LogCaptureFixture) -> None:
    """A node that slides in one step sticks in the next: forces and places have the derivatives of runs, to 1e-6."""
    problem = held(*OPTIONS[option])
    places = [parse(name, problem).value for name in ("b.right.x at y=1", "b.top.y at x=3.3")]
    observables = [force, *places] if problem.space == "axisymmetric" else [force, along, *places]
    assert max(agreement(problem, paths_of(problem), observables, rule)) < 1e-6
    assert "is not exact" not in caplog.text


@pytest.mark.parametrize("parts", [2, 3], ids=["nodes made one", "other nodes"])
@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_tied_nodes_are_held_where_their_masters_are(space: str, parts: int, caplog: pytest.LogCaptureFixture) -> None:
    """Forces have the derivatives of runs, to 1e-6, whether tied nodes coincide or follow several ones."""
    problem = loads(TIED, overrides=[f"space={space}", f"bodies.a.mesh.n=[2, {parts}]"]).problem
    paths = ["friction.mu", "bodies.b.material.flow.s0", "bodies.b.material.flow.K", "steps.0.by.a.right.x", "steps.1.by.die.y"]
    observables = [force] if space == "axisymmetric" else [force, along]
    assert max(agreement(problem, paths, observables, "backward_euler")) < 1e-6
    assert "is not exact" not in caplog.text


def test_a_tool_that_drives_a_tied_node_into_what_leads_it_is_reported() -> None:
    """The side that leads the node goes down less than the tool does: no pressure can change that."""
    problem = loads(TIED, overrides=["steps.0.by.a.right={x: 0.05, y: -0.02}"]).problem
    with pytest.raises(pr.SolveError, match="is driven into the point at"):
        list(pr.solve(problem))


@pytest.mark.parametrize("option", ["coulomb", "axisymmetry", "roll", "tool along", "held both ways"])
def test_backwards_is_forwards(option: str) -> None:
    """Of all forces and places, to 1e-6 of the largest derivative."""
    problem = held(*OPTIONS[option])
    paths, of = paths_of(problem), ["die.force.y", "b.right.x at y=1"]
    of += [] if problem.space == "axisymmetric" else ["die.force.x"]
    *_, last = pr.solve(problem, derivatives=paths)
    found = pr.gradient(problem, of, paths)
    sizes = np.array([abs(value_of(problem, p)) for p in paths])
    for name, row in zip(of, found.slopes, strict=True):
        forwards = np.array([last.derivative(name)[p] for p in paths])
        assert row * sizes == pytest.approx(forwards * sizes, abs=1e-6 * np.abs(forwards * sizes).max())


@pytest.mark.parametrize("path", ["steps.1.by.die.x", "steps.1.by.b.left.y"])
def test_a_slide_that_may_go_either_way_is_reported(path: str, caplog: pytest.LogCaptureFixture) -> None:
    """A parameter that moves a node against the tool on which it stands still: friction or the gap has a kink there."""
    problem = held(*OPTIONS["held both ways"])
    list(pr.solve(problem, derivatives=[path]))
    assert f"the derivative by {path} is not exact" in caplog.text
    with pytest.raises(ArgumentError, match=f"gradient: {path} moves a node that supports hold at rest"):
        pr.gradient(problem, "die.force.y", [path])


def test_a_resumed_run_has_the_same_derivatives(tmp_path: Path) -> None:
    """What a node keeps is in the committed state."""
    problem, paths = held(), ["friction.mu", "steps.0.by.b.left.x"]
    whole = list(pr.solve(problem, derivatives=paths))
    for at in (2, 3, 4):
        path = write_checkpoint(tmp_path / "c.h5", pr.Case(problem), whole[at].state)
        _, state = read_checkpoint(path)
        for a, b in zip(whole[at + 1 :], pr.solve(problem, None, state, derivatives=paths), strict=True):
            assert a.derivative(along) == b.derivative(along)
