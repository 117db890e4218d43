"""Gradients backwards through a run: against derivatives that go forwards, against runs, and what is refused."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from test_closed import KNOWN
from test_derivatives import EXACT, TWO_STEPS, varied, with_rules

import prensa as pr
from prensa.errors import ArgumentError, PrensaError
from prensa.linear.factorisations import Factorisation
from prensa.model.problem import Problem
from prensa.model.schema import loads
from prensa.policy import Policy
from prensa.sensitivity.parameters import value_of, with_values
from rings import ring

SHAPED = """
name: upsetting with a shaped die
space: axisymmetric
bodies:
  billet:
    mesh: {type: rectangle, size: [10, 15], n: [6, 6]}
    material: {type: j2, E: 70 GPa, nu: 0.33, flow: {type: ludwik, s0: 60, K: 200, n: 0.3}}
tools:
  die: {type: profile, points: [[0, 0], [4, -0.1], [8, 0.1], [12, 0.3], [30, 0.2]], fillet: 4, touching: billet.top}
contacts: [{surface: billet, against: die}]
friction: {type: coulomb, mu: 0.1}
fixed: {billet.bottom: y, billet.left: x}
steps:
  - {name: press, move: {die: {y: -2}}, increments: 10}
  - {name: lift, by: {die: {y: 1}}, increments: 3}
"""
HELD = "steps=[{name: press, move: {die: {y: -0.6}}, increments: 4}, {name: hold, push: {die: {y: -40000}}, increments: 2}]"


def sized(problem: Problem, paths: Sequence[str], slopes: Sequence[float]) -> np.ndarray:
    """Derivatives (p,) by parameters, times the size of these."""
    return np.array([slope * abs(value_of(problem, path)) for path, slope in zip(paths, slopes, strict=True)])


def moves_places(path: str) -> bool:
    """Whether nodes or tools begin elsewhere: what goes forwards takes differences of measures of places then."""
    return ".mesh." in path or path.startswith("tools.")


@pytest.mark.parametrize(("option", "rule"), with_rules(KNOWN))
def test_backwards_is_forwards(option: str, rule: Any) -> None:
    """Forces and places by all parameters, to 1e-9 of the largest; 1e-6 where forwards takes differences of places."""
    problem = ring(*KNOWN[option])
    paths = [p for p in varied(problem, "die") if "points" not in p or p.endswith(("1.0", "2.1"))]
    of = ["die.force.y", "die.travel.y", "ring.left.x at y=1.2"]
    numerics = pr.Numerics(time_rule=rule)
    *_, last = pr.solve(problem, numerics, derivatives=paths)
    found = pr.gradient(problem, of, paths, numerics)
    assert found.values == pytest.approx([last.measure(m) for m in of], rel=1e-14)
    for name, slopes in zip(of, found.slopes, strict=True):
        forwards = sized(problem, paths, [last.derivative(name)[p] for p in paths])
        error = np.abs(forwards - sized(problem, paths, slopes.tolist())) / np.abs(forwards).max()
        places = np.array([moves_places(p) for p in paths]) & (name != "die.force.y")
        assert error[~places].max() <= 1e-9, name
        assert error[places].max(initial=0.0) <= 1e-6, name


@pytest.mark.parametrize(
    "changes",
    [
        ["steps.0.move.die.y=-1.6", "friction.mu=0.4", "steps.0.increments=12", "bodies.ring.mesh.n=[5, 2]"],
        [EXACT, "contacts.0.surface=ring.top", "bodies.ring.mesh.n=[3, 2]"],
    ],
    ids=["folded elements", "exact"],
)
def test_backwards_through_folded_elements_and_multipliers(changes: list[str]) -> None:
    """Forces by all numbers of materials, friction, sizes and travels, to 1e-9."""
    problem = ring(*changes)
    paths = varied(problem, "die")
    *_, last = pr.solve(problem, derivatives=paths)
    found = pr.gradient(problem, "die.force.y", paths)
    forwards = sized(problem, paths, [last.derivative("die.force.y")[p] for p in paths])
    assert np.abs(forwards - sized(problem, paths, [found[p] for p in paths])).max() <= 1e-9 * np.abs(forwards).max()


@pytest.mark.parametrize(
    ("step", "rule"), [("press", "bdf2"), ("slide", "bdf2"), ("lift", "bdf2"), ("lift", "backward_euler")]
)
def test_backwards_through_steps(step: str, rule: Any) -> None:
    """A roll that is pushed, dragged and lifted, its radius and place among the parameters, at the end of each step."""
    problem = loads(TWO_STEPS).problem
    paths = varied(problem, "roll")
    of = ["roll.force.x", "roll.moment", "roll.travel.y", "block.top.y at x=2"]
    numerics = pr.Numerics(time_rule=rule)
    found = pr.gradient(problem, of, paths, numerics, step=step)
    last = next(i for i in pr.solve(problem, numerics, derivatives=paths) if i.end_of_step and i.step == step)
    for name, slopes in zip(of, found.slopes, strict=True):
        forwards = sized(problem, paths, [last.derivative(name)[p] for p in paths])
        assert np.abs(forwards - sized(problem, paths, slopes.tolist())).max() <= 1e-9 * np.abs(forwards).max(), name


def test_points_of_a_profile_are_those_of_runs() -> None:
    """The outline of a billet, upset and released, by the points of its die: differences of runs at the same times."""
    problem = loads(SHAPED).problem
    paths = [*(f"tools.die.points.{k}.{axis}" for k in range(4) for axis in (0, 1)), "tools.die.fillet", "friction.mu"]
    of = ["billet.right.x at y=5", "billet.right.x at y=2", "billet.height"]
    found = pr.gradient(problem, of, paths)
    times = [i.time for i in pr.solve(problem)]
    for path in paths[3:6]:
        ends = []
        for sign in (1.0, -1.0):
            beside = with_values(problem, {path: value_of(problem, path) + sign * 1e-5})
            *_, last = pr.solve(beside, times=times)
            ends.append([last.measure(m) for m in of])
        error = found[path] - (np.array(ends[0]) - ends[1]) / 2e-5
        assert np.abs(error).max() <= 2e-7 * np.abs(found.slopes).max(), path


@pytest.mark.parametrize("room", [0.0, 2e5])
def test_what_is_not_kept_is_made_again(room: float) -> None:
    """Without room for matrices and factors, or with room for a few, gradients and increments are those with all kept."""
    problem = loads(SHAPED).problem
    by, of = ["tools.die.points.1.1", "friction.mu", "bodies.billet.material.flow.K"], ["die.force.y", "billet.top.x at x=5"]
    kept = pr.gradient(problem, of, by, step="press")
    made = pr.gradient(problem, of, by, step="press", policy=Policy(matrix_bytes=room, factor_bytes=room))
    assert made.values.tolist() == kept.values.tolist()
    assert made.slopes == pytest.approx(kept.slopes, rel=1e-10, abs=1e-12 * np.abs(kept.slopes).max())


def test_factors_serve_increments_beside(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where Newton's factors are too large to be kept, new ones of a few increments serve those beside: the same gradients."""
    problem = loads(SHAPED.replace("increments: 10", "increments: 40")).problem
    by = ["tools.die.points.1.1", "friction.mu", "bodies.billet.material.flow.K", "steps.0.move.die.y"]
    of = ["die.force.y", "billet.top.x at x=5"]
    kept = pr.gradient(problem, of, by, step="press")
    coarse, made = Factorisation.coarse, list[int]()

    def counted(self: Factorisation, values: np.ndarray) -> bool:
        made.append(len(values))
        return coarse(self, values)

    monkeypatch.setattr(Factorisation, "coarse", counted)
    counts = []
    for apart in (4, 10**6):  # those of every fourth increment are kept, or none but the first's
        made.clear()
        beside = pr.gradient(problem, of, by, step="press", policy=Policy(factor_bytes_per_increment=0.0, factor_interval=apart))
        counts.append(len(made))
        assert beside.values.tolist() == kept.values.tolist()
        assert beside.slopes == pytest.approx(kept.slopes, rel=1e-10, abs=1e-12 * np.abs(kept.slopes).max())
    assert counts[0] < counts[1] < 0.5 * 40


def test_one_measure_gives_numbers() -> None:
    """A measure by its name has one value and one slope a parameter; a list of them has arrays."""
    problem = ring()
    one, many = (pr.gradient(problem, of, ["friction.mu"]) for of in ("die.force.y", ["die.force.y"]))
    assert (one.value, one["friction.mu"]) == (many.value[0], many["friction.mu"][0])
    assert dict(one.items()) == {"friction.mu": one["friction.mu"]}
    assert (one.measures, one.units) == (("die.force.y",), ("N",))


TABLE_OF_FRICTION = "friction={type: coulomb, mu: {kappa: [0, 0.1, 1], mu: [0.05, 0.15, 0.2]}}"


@pytest.mark.parametrize(
    ("changes", "of", "by", "words"),
    [
        (["bodies.ring.element=q4_enhanced"], "die.force.y", "friction.mu", "no enhanced modes"),
        ([TABLE_OF_FRICTION], "die.force.y", "friction.mu.mu.1", "changes a table of friction"),
        ([HELD], "die.travel.y", "friction.mu", "the adjoint does not cover"),
        ([], "ring.max.mises", "friction.mu", "has no derivative with respect to positions and forces"),
        ([], "die.force.y", "friction.nu", "no number at"),
        ([], "die.forc.y", "friction.mu", "die"),
    ],
)
def test_what_cannot_go_backwards_is_reported(changes: list[str], of: str, by: str, words: str) -> None:
    """Elements, friction, loads and measures that have no way back are refused, with the way that there is."""
    with pytest.raises(PrensaError, match=words):
        pr.gradient(ring(*changes), of, [by])


def test_arguments_are_looked_at() -> None:
    """No parameter, or a step that does not exist, is reported before anything is computed."""
    with pytest.raises(ArgumentError, match="by is empty"):
        pr.gradient(ring(), "die.force.y", [])
    with pytest.raises(ArgumentError, match="there is no step 'pres'"):
        pr.gradient(ring(), "die.force.y", ["friction.mu"], step="pres")
