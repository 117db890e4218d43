"""Derivatives by parameters: against differences of whole runs at the same times, closed forms and identities."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.errors import ArgumentError, PrensaError
from prensa.measures import parse
from prensa.model.problem import Problem
from prensa.model.schema import loads
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from prensa.policy import Policy
from prensa.result.increment import Increment
from prensa.sensitivity import direct
from prensa.sensitivity.parameters import numbers, value_of, with_values
from prensa.system.discretise import discretise
from prensa_bench.robustness.families import drawn
from problems import pointed_disc
from rings import FLOW, ring

EXACT = "contacts=[{surface: ring, against: die, enforcement: {type: exact}}]"

OPTIONS = {
    "penalty": [],
    "exact": [EXACT],
    "shear factor": ["friction={type: shear, m: 0.3}"],
    "exact, shear factor": ["friction={type: shear, m: 0.3}", EXACT],
    "capped": ["friction={type: capped, mu: 0.2, m: 0.4}"],
    "levanov": ["friction={type: levanov, m: 0.3}"],
    "wang_osakada": ["friction={type: wang_osakada, mu: 0.2}"],
    "stribeck": ["friction={type: stribeck, mu_static: 0.2, mu_kinetic: 0.1, speed: 0.5, viscous: 0.01}"],
    "wanheim_bay": ["friction={type: wanheim_bay, f: 0.6}"],
    "exact, levanov": ["friction={type: levanov, m: 0.3}", EXACT],
    "exact, wang_osakada": ["friction={type: wang_osakada, mu: 0.2}", EXACT],
    "exact, wanheim_bay": ["friction={type: wanheim_bay, f: 0.6}", EXACT],
    "wanheim_bay, above its limit": ["friction={type: wanheim_bay, f: 0.6, k: 40}"],
    "table of friction": ["friction={type: coulomb, mu: {kappa: [0, 0.1, 1], mu: [0.05, 0.15, 0.2]}}"],
    "friction of the slip": ["friction={type: coulomb, mu: {mu0: 0.05, mu_inf: 0.2, u0: 0.1}}"],
    "plane strain": ["space=plane strain"],
    "plane stress": ["space=plane stress", "bodies.ring.element=q4"],
    "q8": ["bodies.ring.element=q8"],
    "gauss2": ["contacts=[{surface: ring, against: die, integration: gauss2}]"],
    "t6": ["bodies.ring.element=t6"],
    "enhanced": ["bodies.ring.element=q4_enhanced"],
    "sheet": ["bodies.ring.element=q4_sheet"],
    "voce": [f"{FLOW}={{type: voce, s0: 250, Q: 300, b: 5}}"],
    "johnson_cook": [f"{FLOW}={{type: johnson_cook, A: 250, B: 400, n: 0.3, C: 0.02, rate0: 0.1}}"],
    "table of flow": [f"{FLOW}={{type: table, points: [[0, 250], [0.1, 450], [0.3, 600], [1, 700]]}}"],
    "crank": ["steps.0={name: press, crank: {die: {stroke: 4, ratio: 0.2, height: 0.6, end: 10 deg}}, increments: 6}"],
    "crank in seconds": [
        "steps.0={name: press, crank: {die: {stroke: 4, height: 0.6, end: 10 deg, strokes_per_minute: 90}}, increments: 6}",
        f"{FLOW}={{type: johnson_cook, A: 250, B: 400, n: 0.3, C: 0.02, rate0: 0.1}}",
    ],
    "duration": [
        "steps.0.duration=0.02",
        "friction={type: stribeck, mu_static: 0.2, mu_kinetic: 0.1, speed: 15, viscous: 0.001}",
        f"{FLOW}={{type: johnson_cook, A: 250, B: 400, n: 0.3, C: 0.02, rate0: 0.1}}",
    ],
    "driven boundary": ["steps.0={name: press, by: {ring.left: {x: 0.1}}, move: {die: {y: -0.3}}, increments: 6}"],
    "spring": ["tools.die={type: plane, touching: ring.top, spring: {y: 200000}}"],
    "neo_hooke": ["bodies.ring.material={type: neo_hooke, E: 1000, nu: 0.3}"],
    "small strain": ["kinematics=small", "steps.0.move.die.y=-0.05"],
    "reference geometry": [
        "contact_geometry=reference",
        "contacts.0.surface=ring.top",
        "kinematics=small",
        "steps.0.move.die.y=-0.05",
    ],
    "force": ["steps.0={name: press, push: {die: {y: -45000}}, increments: 6}"],
}

RULES = ("backward_euler", "bdf2", "auto")
REACHED = {
    "penalty", "exact", "johnson_cook", "stribeck", "friction of the slip", "enhanced", "sheet", "duration", "crank in seconds",
    "driven boundary", "spring", "force",
}  # fmt: skip
"""Options that a time rule reaches in ways of their own: rates, speeds, slips and modes that are kept, tools that are driven."""


SLOW = {"swift", "hockett_sherby", "swift_voce"}
"""Flow curves that differ from others in the curve alone, each with kernels of its own that take seconds to be compiled."""


def with_rules(options: Iterable[str]) -> list[Any]:
    """Those options with both time rules, and the others, which share all that a rule does, with one of them in turn, or with
    ``auto``, which takes one of both in each increment.
    """
    return [
        pytest.param(option, rule, marks=[pytest.mark.slow] if option in SLOW else [])
        for k, option in enumerate(options)
        for rule in (RULES[:2] if option in REACHED else (RULES[k % len(RULES)],))
    ]


TWO_STEPS = """
name: roll over a block
bodies:
  block:
    mesh: {type: rectangle, size: [4, 2], n: [6, 3]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: ludwik, s0: 10, K: 20, n: 0.3}}
tools: {roll: {type: circle, radius: 3, at: [2.1, 5]}}
friction: {type: coulomb, mu: 0.2}
fixed: {block.bottom: xy}
steps:
  - {name: press, push: {roll: {y: -12}}, increments: 3}
  - {name: slide, push: {roll: {y: -12}}, move: {roll: {x: 0.2}}, increments: 3}
  - {name: lift, move: {roll: {y: 0.5}}, increments: 3}
"""


RELEASED_BETWEEN = """
name: a roll is pressed in, rolls on as it likes, and is lifted
bodies:
  block:
    mesh: {type: rectangle, size: [4, 2], n: [8, 4]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: ludwik, s0: 10, K: 20, n: 0.3}}
tools: {roll: {type: circle, radius: 3, at: [1.9, 5]}}
friction: {type: coulomb, mu: 0.2}
fixed: {block.bottom: xy}
steps:
  - {name: press, push: {roll: {y: -12}}, increments: 3}
  - {name: turn, move: {roll: {rz: -0.03}}, push: {roll: {x: 0}}, increments: 3}
  - {name: pass, move: {roll: {rz: -0.04}}, push: {roll: {x: 0}}, increments: 3}
  - {name: lift, move: {roll: {y: 0.02}}, increments: 3}
"""


def force(increment: Increment) -> float:
    """Force of the ring on its die."""
    return increment.force("die").y


def varied(problem: Problem, tool: str) -> list[str]:
    """What there is to vary: material, friction, heights, widths, radii, travels and forces."""
    words = ("material", "friction", "steps", "mesh.size", "radius", "at.0", f"tools.{tool}")
    found = [k for k, v in numbers(problem).items() if any(w in k for w in words) and v != 0.0]
    return [k for k in found if not k.endswith((".theta", ".at.1", "points.0.0"))]


LEAST_BOUND = 1e-6
"""The least error that a test here asks for: with a smaller one, no other step is tried."""


def agreement(
    problem: Problem, paths: list[str], observables: list[Callable[[Increment], float]], rule: Any = "bdf2"
) -> list[float]:
    """Largest error over a run of derivatives along a mixture of all parameters, over the largest sum of their sizes.

    Of two steps the better one counts: one may be short of digits, the other too long.
    """
    numerics = pr.Numerics(time_rule=rule)
    times = [i.time for i in pr.solve(problem, numerics)]
    run = list(pr.solve(problem, numerics, times=times, derivatives=paths))
    signs = np.random.default_rng(1).uniform(0.5, 1.5, len(paths)) * np.resize([1.0, -1.0], len(paths))
    along = {p: s * value_of(problem, p) for p, s in zip(paths, signs)}
    given = [[i.derivative(observable) for i in run] for observable in observables]
    exact = [np.array([sum(d[p] * along[p] for p in paths) for d in of]) for of in given]
    sizes = [max(sum(abs(d[p] * along[p]) for p in paths) for d in of) for of in given]
    errors = [math.inf] * len(observables)
    for step in (1e-4, 3e-5):
        if max(errors) < LEAST_BOUND:
            break
        above, below = (
            list(
                pr.solve(
                    with_values(problem, {p: value_of(problem, p) + k * step * d for p, d in along.items()}),
                    numerics,
                    times=times,
                )
            )
            for k in (1.0, -1.0)
        )
        for k, observable in enumerate(observables):
            secant = np.array([(observable(a) - observable(b)) / (2 * step) for a, b in zip(above, below)])
            errors[k] = float(np.minimum(errors[k], np.abs(secant - exact[k]).max() / sizes[k]))
    return errors


@pytest.mark.parametrize(("option", "rule"), with_rules(OPTIONS))
def test_derivatives_are_those_of_whole_runs(option: str, rule: Any, caplog: pytest.LogCaptureFixture) -> None:
    """Force and displacements have the derivatives of runs at the same times, whatever law, element or enforcement there is, and
    none of them is doubted.
    """
    problem = ring(*OPTIONS[option])
    paths = varied(problem, "die")
    assert len(paths) >= 5
    place = [lambda i, k=k: float(i.state.u[k]) for k in (0, 8, 22)]
    drives = "push" in OPTIONS[option][-1] if OPTIONS[option] else False
    travel = (lambda i: i.tools["die"].place.y) if drives else force
    assert max(agreement(problem, paths, [travel, *place], rule)) < 1e-5
    assert "is not exact" not in caplog.text


@pytest.mark.parametrize("rule", RULES)
def test_derivatives_go_through_steps_and_what_they_released(rule: Any) -> None:
    """A roll pressed in by force, dragged along and lifted: radius, place, forces, travels and friction, of every observable."""
    problem = loads(TWO_STEPS).problem
    paths = varied(problem, "roll")
    assert {"tools.roll.radius", "tools.roll.at.0", "steps.1.push.roll.y", "friction.mu"} <= set(paths)
    measures = [parse(text, problem).value for text in ("roll.force.y", "block.top.y at x=2.3", "energy.plastic")]
    observables: list[Callable[[Increment], float]] = [
        *measures,
        lambda i: i.force("roll").x,
        lambda i: i.force("roll").m,
        lambda i: i.tools["roll"].place.y,
        lambda i: i.energy["plastic"],
        lambda i: i.energy["friction"],
        lambda i: i.contacts["block-roll"].area,
        lambda i: float(i.bodies["block"].x[24, 0]),
    ]
    assert max(agreement(problem, paths, observables, rule)) < 1e-5


@pytest.mark.parametrize(
    "paths", [["bodies.block.material.nu"], ["friction.mu", "bodies.block.material.flow.K", "tools.roll.radius"]]
)
def test_derivatives_go_on_after_a_step_that_lets_forces_go(paths: list[str]) -> None:
    """Where the roll may move along all at once, forces are released, and differences are taken for that step alone."""
    problem = loads(RELEASED_BETWEEN).problem
    observables: list[Callable[[Increment], float]] = [
        lambda i: i.force("roll").y,
        lambda i: i.force("roll").x,
        lambda i: i.tools["roll"].place.x,
        lambda i: float(i.bodies["block"].x[40, 0]),
    ]
    assert max(agreement(problem, paths, observables)) < 1e-5


def test_derivatives_by_numbers_that_change_the_speed_of_a_step() -> None:
    """Beside others: by its duration differences are taken in a step that it lasts, and closed forms in the ones after it."""
    curve = "bodies.block.material.flow={type: johnson_cook, A: 10, B: 20, n: 0.3, C: 0.02, rate0: 0.1}"
    problem = loads(RELEASED_BETWEEN, overrides=[curve, "steps.0.duration=0.5"]).problem
    paths = ["steps.0.duration", "friction.mu", "bodies.block.material.flow.B"]
    assert max(agreement(problem, paths, [lambda i: i.force("roll").y, lambda i: i.tools["roll"].place.x])) < 1e-5


def test_derivatives_across_ties() -> None:
    """Two bodies with other nodes where they are tied, upset together."""
    text = """
name: tied
bodies:
  low:
    mesh: {type: rectangle, size: [4, 2], n: [4, 2]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: ludwik, s0: 10, K: 20, n: 0.3}}
  high:
    mesh: {type: rectangle, size: [4, 1], n: [3, 1], origin: [0, 2]}
    material: {type: j2, E: 2000, nu: 0.3, flow: {type: ludwik, s0: 15, K: 20, n: 0.3}}
ties: [{slave: high.bottom, master: low.top}]
tools: {die: {type: plane, touching: high.top}}
contacts: [{surface: high.top, against: die}]
friction: {type: coulomb, mu: 0.1}
fixed: {low.bottom: y, low.left: x, high.left: x}
steps: [{name: press, move: {die: {y: -0.2}}, increments: 4}]
"""
    problem = loads(text).problem
    paths = [p for p in varied(problem, "die") if "mesh" not in p]
    assert max(agreement(problem, paths, [force, lambda i: float(i.state.u[17]), lambda i: float(i.state.u[22])])) < 1e-5
    with pytest.raises(ArgumentError, match="nothing lies opposite"):
        pr.solve(problem, derivatives=["bodies.low.mesh.size.0"])


def test_work_of_friction_where_a_point_just_touches() -> None:
    """A roll that is one hundred-thousandth deep: a step of its place turns the traction round, and its size has a kink there."""
    text = """
name: grazed
bodies:
  block:
    mesh: {type: rectangle, size: [4, 2], n: [5, 3]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: ludwik, s0: 10, K: 20, n: 0.3}}
    element: q4_enhanced
tools: {roll: {type: circle, radius: 3, at: [2.1, 5]}}
friction: {type: coulomb, mu: 0.2}
fixed: {block.bottom: xy}
steps: [{name: press, move: {roll: {y: -1e-5, x: 0.3}}, increments: 1}]
"""
    problem, path = loads(text).problem, "tools.roll.at.1"
    (found,) = pr.solve(problem, times=[1.0], derivatives=[path])
    beside = [next(iter(pr.solve(with_values(problem, {path: 5.0 + h}), times=[1.0]))) for h in (1e-8, -1e-8)]
    for name in ("friction", "imbalance"):
        secant = (beside[0].energy[name] - beside[1].energy[name]) / 2e-8
        assert found.derivative(lambda i, name=name: i.energy[name])[path] == pytest.approx(secant, rel=1e-5)


def test_energies_of_automatic_increments_under_a_load() -> None:
    """Those of neighbours are their own, not what the length of the increment was judged by; a load has no closed derivative."""
    text = """
name: loaded
bodies:
  block:
    mesh: {type: rectangle, size: [4, 2], n: [4, 2]}
    material: {type: j2, E: 10000, nu: 0.3, flow: {type: linear, s0: 20, H: 100}}
tools: {punch: {type: plane, touching: block.top}}
friction: {type: coulomb, mu: 0.2}
fixed: {block.bottom: y, block.left: x}
steps: [{name: press, move: {punch: {y: -0.2}}, loads: {block.right: {pressure: 1}}}]
"""
    problem, path, h = loads(text).problem, "bodies.block.material.flow.s0", 1e-4
    found = list(pr.solve(problem, derivatives=[path]))
    times = [inc.time for inc in found]
    beside = [list(pr.solve(with_values(problem, {path: 20.0 + d}), times=times))[-1] for d in (h, -h)]
    for name in ("external", "elastic", "plastic", "friction"):
        secant = (beside[0].energy[name] - beside[1].energy[name]) / (2 * h)
        assert found[-1].derivative(lambda i, name=name: i.energy[name])[path] == pytest.approx(secant, rel=1e-5)


def punch(width: float, fillet: float, travel: float) -> Problem:
    """A block under a stamp."""
    return loads(f"""
name: punch
bodies:
  block:
    mesh: {{type: rectangle, size: [4, 2], n: [8, 4]}}
    material: {{type: j2, E: 1000, nu: 0.3, flow: {{s0: 10, K: 20, n: 0.3, type: ludwik}}}}
tools: {{die: {{type: stamp, width: {width}, fillet: {fillet}, touching: block.top, at: [2, 0]}}}}
friction: {{type: coulomb, mu: 0.2}}
fixed: {{block.bottom: xy}}
steps: [{{name: press, move: {{die: {{y: {travel}}}}}, increments: 4}}]
""").problem


def test_derivatives_with_cut_edges() -> None:
    """A punch with sharp corners, which cut the edges under them: width and all else."""
    problem = punch(width=2.3, fillet=0, travel=-0.1)
    paths = [*varied(problem, "die"), "tools.die.width"]
    assert max(agreement(problem, list(dict.fromkeys(paths)), [force, lambda i: float(i.state.u[40])])) < 1e-5


def test_a_fillet_moves_what_it_should() -> None:
    """Width and fillet of a punch: the derivative of the force by the shape of a tool."""
    problem = punch(width=2.2, fillet=0.3, travel=-0.2)
    paths = ["tools.die.width", "tools.die.fillet", "bodies.block.mesh.size.1"]
    assert max(agreement(problem, paths, [force, lambda i: float(i.state.u[40])])) < 1e-5


# ------------------------------------------------------------------------------------------------ closed forms, identities
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("changes", [[], [EXACT]], ids=["penalty", "exact"])
def test_forces_are_homogeneous_in_all_stresses(changes: list[str], rule: Any) -> None:
    """Penalties follow E, so F is homogeneous in (K, σ₀, E): Σ dF/dln = F, exactly."""
    problem = ring(*changes)
    paths = [f"{FLOW}.K", f"{FLOW}.s0", "bodies.ring.material.E"]
    for i in pr.solve(problem, pr.Numerics(time_rule=rule), derivatives=paths):
        by = i.derivative("die.force.y")
        beside = i.derivative(force)  # a function is read off increments beside, a measure has its gradient
        assert by == pytest.approx(beside, rel=1e-8)
        for found in (by, beside):
            assert sum(found[p] * value_of(problem, p) for p in paths) == pytest.approx(force(i), rel=1e-9)


def test_frictionless_upsetting_has_a_closed_form() -> None:
    """A cylinder under smooth dies deforms homogeneously: one scalar equation gives F, dF/dK and dF/dn."""
    E, nu, s0, K, n, H, R = 200e3, 0.3, 250.0, 500.0, 0.3, 3.0, 4.0

    def upset(K: complex, n: complex, height: float) -> complex:
        p: complex = 0.9 * math.log(H / height)
        for _ in range(60):  # E (e − p) = J σ_y(p), J = exp(−(1 − 2ν)(e − p)) with e = ln(H/h)
            e = math.log(H / height) - p
            J, y = np.exp(-(1 - 2 * nu) * e), s0 + K * p**n
            p += (E * e - J * y) / (E + J * (K * n * p ** (n - 1) + (1 - 2 * nu) * y))
        e = math.log(H / height) - p
        return E * e / np.exp(-(1 - 2 * nu) * e) * math.pi * R**2 * np.exp(2 * nu * e + p)

    smooth = "contacts=[{surface: ring.top, against: die, enforcement: {type: exact}}]"
    # NumPy and numbers in full: sizes as above
    problem = ring(smooth, f"bodies.ring.mesh.size=[{R}, {H}]", "bodies.ring.mesh.origin=[0, 0]", "friction.mu=0")
    for i in pr.solve(problem, derivatives=[f"{FLOW}.K", f"{FLOW}.n"]):
        height = H + i.tools["die"].place.y
        by = i.derivative(force)
        assert force(i) == pytest.approx(upset(K, n, height).real, rel=1e-8)
        assert by[f"{FLOW}.K"] == pytest.approx(upset(K + 1e-20j, n, height).imag / 1e-20, rel=1e-5)
        assert by[f"{FLOW}.n"] == pytest.approx(upset(K, n + 1e-20j, height).imag / 1e-20, rel=1e-5)


WEDGE = """
name: wedge
bodies: {block: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {wedge: {type: plane, at: [2, 2], normal: [0.08715574274765817, -0.9961946980917455]}}
contacts: [{surface: block.top, against: wedge}]
friction: {type: coulomb, mu: 0.2}
fixed: {block.bottom: xy}
steps:
  - {name: press, push: {wedge: {y: -2}}, increments: 2}
  - {name: slide, push: {wedge: {y: -2}}, move: {wedge: {x: -1}}, increments: 6}
"""


def test_a_wedge_that_slides() -> None:
    """Under a weight N a wedge of slope α that slides pushes with N tan(α ± φ), tan φ = μ: its derivative by μ to 1e-9."""
    last = list(pr.solve(loads(WEDGE).problem, derivatives=["friction.mu"]))[-1]
    pushed, weight, mu = last.force("wedge").x, last.force("wedge").y, 0.2
    slopes = [(math.tan(a + s * math.atan(mu)), s / (math.cos(a + s * math.atan(mu)) ** 2 * (1 + mu**2)))
              for a in (math.radians(5), -math.radians(5)) for s in (1.0, -1.0)]  # fmt: skip
    ratio, by_mu = min(slopes, key=lambda v: abs(v[0] - pushed / weight))
    status = last.contacts["block.top-wedge"].status
    assert (status == 2).any() and not (status == 1).any()
    assert pushed == pytest.approx(weight * ratio, rel=1e-9)
    assert last.derivative(lambda i: i.force("wedge").x)["friction.mu"] == pytest.approx(weight * by_mu, rel=1e-9)


def test_friction_does_not_matter_where_everything_sticks() -> None:
    """dF/dμ = 0 to the last bit where no point has slid."""
    problem = loads(
        WEDGE, overrides=["tools.wedge.normal=[0, -1]", "friction.mu=3", "steps.1.move.wedge.x=-0.001"]
    ).problem
    for i in pr.solve(problem, derivatives=["friction.mu"]):
        assert (i.contacts["block.top-wedge"].status == 1).all()
        for observable in (lambda i: i.force("wedge").x, lambda i: i.force("wedge").y, lambda i: float(i.state.u[20])):
            assert i.derivative(observable)["friction.mu"] == 0.0


# ---------------------------------------------------------------------------------------------------- what does not change
PATHS = ["friction.mu", f"{FLOW}.K"]


def test_a_run_with_derivatives_is_the_run_without() -> None:
    """Increments with derivatives are those without, bit for bit; so is a run at the times of another."""
    problem = ring("steps.0={name: press, move: {die: {y: -0.6}}}")
    plain = list(pr.solve(problem))
    for run in (list(pr.solve(problem, derivatives=PATHS)), list(pr.solve(problem, times=[i.time for i in plain]))):
        assert [i.time for i in run] == [i.time for i in plain]
        assert all(np.array_equal(a.state.u, b.state.u) for a, b in zip(plain, run))
    with pytest.raises(PrensaError, match="ask for them"):
        plain[0].derivative(force)


@pytest.mark.parametrize("rule", RULES)
def test_a_resumed_run_has_the_same_derivatives(rule: Any, tmp_path: Path) -> None:
    """From a checkpoint in the middle everything goes on bit for bit, derivatives included."""
    problem = loads(TWO_STEPS, overrides=["tools.roll.at=[1.9, 5]"]).problem
    paths, numerics = ["friction.mu", "tools.roll.radius", "bodies.block.material.flow.K"], pr.Numerics(time_rule=rule)
    whole = list(pr.solve(problem, numerics, derivatives=paths))
    for at in (1, 2, 4):  # in a step, at the end of one that releases, in the next
        path = write_checkpoint(tmp_path / "c.h5", pr.Case(problem), whole[at].state)
        _, state = read_checkpoint(path)
        for a, b in zip(whole[at + 1 :], pr.solve(problem, numerics, state, derivatives=paths), strict=True):
            for x, y in zip(a.state.arrays().values(), b.state.arrays().values(), strict=True):
                assert np.array_equal(x, y)
            assert a.derivative(lambda i: i.force("roll").x) == b.derivative(lambda i: i.force("roll").x)


def test_an_increment_proves_its_derivatives(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """The residual is flat along a derivative, and a wrong one is reported, once a parameter."""
    for i in pr.solve(ring(), derivatives=PATHS):
        assert i.derivatives is not None
        assert max(i.derivatives.flat.values()) < 1e-6
    assert i.derivatives.switched == {"ring-die": 0}
    assert not caplog.records
    right = direct.Columns.solve
    monkeypatch.setattr(direct.Columns, "solve", lambda self, b: 1.001 * right(self, b))
    list(pr.solve(ring("steps.0.increments=2"), derivatives=PATHS))
    messages = [r.getMessage() for r in caplog.records]
    assert len(messages) == 2
    assert "the derivative by friction.mu is not exact" in messages[0]


def test_round_off_of_bodies_that_are_released_is_no_doubt(caplog: pytest.LogCaptureFixture) -> None:
    """A sheet between plates that open has no forces left: what is left along a derivative is small against those it had."""
    problem = drawn("thin", 4242, 2).problem
    paths = ["bodies.sheet.material.flow.e0", "steps.0.move.upper.y"]
    *_, last = pr.solve(problem, derivatives=paths)
    assert last.derivatives is not None
    assert last.force("upper").y == 0.0 and max(last.derivatives.flat.values()) > 1e-5
    assert "is not exact" not in caplog.text


INSIDE = """
name: roll that starts inside a strip
bodies:
  b:
    mesh: {type: rectangle, size: [4, 1], n: [8, 2], origin: [-3.2, 0]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: johnson_cook, A: 10, B: 16, n: 0.3, C: 0.02, rate0: 0.1}}
    element: q4_sheet
tools: {roll: {type: circle, radius: 3, at: [0.6, 3.94]}}
friction: {type: coulomb, mu: 0.15}
contacts: [{surface: b, against: roll, integration: simpson}]
fixed: {b.bottom: y}
steps: [{name: press, by: {b.left: {x: 0.02}, roll: {rz: 0.01, y: -0.05}}, increments: 4}]
"""


def test_steps_that_reach_over_a_corner_are_made_finer(caplog: pytest.LogCaptureFixture) -> None:
    """A height above a far origin has a long step: plastic strains of an increment are shorter, and rates have corners."""
    problem, path = loads(INSIDE).problem, "tools.roll.at.1"
    numerics = pr.Numerics(time_rule="bdf2")
    times = [i.time for i in pr.solve(problem, numerics)]
    run = list(pr.solve(problem, numerics, times=times, derivatives=[path]))
    exact = np.array([i.derivative(lambda i: i.force("roll").y)[path] for i in run])
    ends = [
        np.array([i.force("roll").y for i in pr.solve(with_values(problem, {path: 3.94 + s}), numerics, times=times)])
        for s in (4e-7, -4e-7)
    ]
    assert (ends[0] - ends[1]) / 8e-7 == pytest.approx(exact, rel=1e-5)
    assert "is not exact" not in caplog.text
    with_long_steps = list(pr.solve(problem, numerics, times=times, derivatives=[path], policy=Policy(finer_step_ratios=())))
    assert "is not exact" in caplog.text
    assert with_long_steps[-1].derivative(lambda i: i.force("roll").y)[path] != pytest.approx(exact[-1], rel=1e-5)


def test_points_at_kinks_are_counted() -> None:
    """The first increment ends where the roll touches first: the force begins to rise there, whatever moves the roll down."""
    pressed, path = "steps=[{name: press, move: {roll: {y: -0.15}}, increments: 4}]", "tools.roll.at.1"
    problem = loads(TWO_STEPS, overrides=[pressed]).problem
    run = list(pr.solve(problem, derivatives=[path]))
    first, *rest = (i.derivatives.at_kinks["block-roll"] for i in run if i.derivatives is not None)
    assert first == 1
    assert not any(rest)
    times, beside = [i.time for i in run], {}
    for sign in (1.0, -1.0):
        moved = with_values(problem, {path: 5.0 + 1e-6 * sign})
        beside[sign] = next(iter(pr.solve(moved, times=times))).force("roll").y / (1e-6 * sign)
    assert run[0].derivative(lambda i: i.force("roll").y)[path] == beside[1.0] == 0.0
    assert beside[-1.0] < -1.0


def test_what_has_no_derivative_is_refused() -> None:
    """What cannot be differentiated is refused with what to do instead."""
    start = next(iter(pr.solve(ring()))).state
    cases: list[tuple[list[str], str, dict[str, object]]] = [
        (["friction.mew"], "no number at 'friction.mew' in this case; did you mean 'friction.mu'", {}),
        (["steps.0.increments"], "whole numbers", {}),
        (["friction"], "'friction' is not a number but has some: friction.mu", {}),
        (["contacts.0.friction.mu"], "it has that of the case: 'friction.mu'", {}),
        (["friction.mu", "friction.mu"], "listed twice", {}),
        (["friction.mu"], "run from the beginning", {"start": start}),
    ]
    for paths, message, more in cases:
        with pytest.raises(ArgumentError, match=message):
            pr.solve(ring(), derivatives=paths, **more)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="remesh: off"):
        pr.solve(ring("remesh=auto", "bodies.ring.element=t6"), derivatives=["friction.mu"])
    with pytest.raises(ArgumentError, match="solve a Problem"):
        pr.solve(replace(discretise(ring()), more=[object()]), derivatives=["friction.mu"])
    with pytest.raises(ArgumentError, match="is stabilised"):
        pr.solve(ring("stabilise=auto"), derivatives=["friction.mu"])
    with pytest.raises(ArgumentError, match="removes the tools"):
        away = "steps=[{name: press, move: {die: {y: -0.1}}}, {name: release, remove_tools: true}]"
        pr.solve(ring(away), derivatives=["friction.mu"])
    ends = "steps.0.until={force: {die: {y: 1000}}}"
    with pytest.raises(ArgumentError, match="'until'"):
        pr.solve(ring(ends), derivatives=["friction.mu"])
    with pytest.raises(ArgumentError, match="'until'"):
        pr.solve(ring(ends), times=[0.5, 1.0])
    augmented = "contacts=[{surface: ring, against: die, enforcement: {type: augmented}}]"
    with pytest.raises(ArgumentError, match="type: exact"):
        pr.solve(ring(augmented), derivatives=["friction.mu"])
    with pytest.raises(ArgumentError, match="cannot be varied both ways"):
        pr.solve(ring("friction.mu=0"), derivatives=["friction.mu"])


def lip(s0: float = 10.0, plane: bool = False) -> Problem:
    """A disc whose pointed lip is pressed to the axis, where a plane may stand."""
    step = pr.Step("close", by={"d.right": pr.Motion(x=-0.3)}, increments=16)
    return pointed_disc(step, material=pr.J2(1000.0, 0.3, pr.Linear(s0, 20)), plane=plane)


def test_derivatives_go_on_at_a_line_of_symmetry(caplog: pytest.LogCaptureFixture) -> None:
    """A lip meets a plane at the axis: derivatives are those with a plane written by hand, and differences of whole runs; the
    run goes on from a state with planes with the same ones.
    """
    path, name = "bodies.d.material.flow.s0", "d.top.y at x=1"
    found = list(pr.solve(lip(), derivatives=[path]))
    assert "symmetry_x" in found[-1].tools
    by_hand = list(pr.solve(lip(plane=True), derivatives=[path]))
    measure, same = parse(name, lip()), parse(name, lip(plane=True))
    assert [i.derivative(measure)[path] for i in found] == pytest.approx(
        [i.derivative(same)[path] for i in by_hand], rel=1e-8
    )
    above, below = (list(pr.solve(lip(10.0 + h), times=[i.time for i in found])) for h in (1e-3, -1e-3))
    by_differences = (measure.value(above[-1]) - measure.value(below[-1])) / 2e-3
    assert found[-1].derivative(measure)[path] == pytest.approx(by_differences, rel=1e-6)
    *_, resumed = pr.solve(lip(), start=found[12].state, derivatives=[path])
    assert resumed.derivative(measure) == found[-1].derivative(measure)
    assert "is not exact" not in caplog.text


def test_planes_at_lines_of_symmetry_have_limits() -> None:
    """A parameter that moves the line is refused, and so is the way back over its plane."""
    with pytest.raises(ArgumentError, match=r"line of symmetry, which 'bodies.d.mesh.corners.1.1' moves"):
        list(pr.solve(lip(), derivatives=["bodies.d.mesh.corners.1.1"]))
    with pytest.raises(ArgumentError, match="a free side reaches the line of symmetry"):
        pr.gradient(lip(), "d.top.y at x=1", ["bodies.d.material.flow.s0"])


def test_boundaries_have_dots_in_their_names() -> None:
    """A number of a boundary's motion is replaced at its path, and nothing else."""
    problem = ring("steps.0={name: press, by: {ring.left: {x: 0.1}}, move: {die: {y: -0.3}}, increments: 6}")
    path = "steps.0.by.ring.left.x"
    other = with_values(problem, {path: 0.2, "friction.mu": 0.3})
    assert (value_of(other, path), value_of(other, "friction.mu")) == (0.2, 0.3)
    assert with_values(other, {path: 0.1, "friction.mu": 0.1}) == problem


@pytest.mark.parametrize("times", [[0.5, 0.4, 1.0], [0.5], [0.5, 1.0, 1.5], "soon"])
def test_times_are_those_of_the_run(times: object) -> None:
    """Times have to increase and to contain the ends of the steps, and nothing after the last."""
    with pytest.raises(ArgumentError, match="times"):
        pr.solve(ring(), times=times)  # type: ignore[arg-type]


def test_increments_end_where_they_are_asked_to() -> None:
    """Prescribed times are all there are; stops are met among those that are chosen."""
    problem = ring("steps.0={name: press, move: {die: {y: -0.6}}}")
    assert [i.time for i in pr.solve(problem, times=[0.2, 0.45, 0.7, 1.0])] == [0.2, 0.45, 0.7, 1.0]
    stopped = [i.time for i in pr.solve(problem, stops=[0.3, 0.7])]
    assert {0.3, 0.7, 1.0} < set(stopped)
    with pytest.raises(PrensaError, match="one of the times that were asked for"):
        list(pr.solve(ring("steps.0.move.die.y=-2.9"), times=[0.3, 1.0]))
