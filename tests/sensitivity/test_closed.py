"""Closed derivatives of the default elements, materials and contacts: against differences with fixed active sets."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from test_derivatives import EXACT, OPTIONS, RELEASED_BETWEEN, RULES, TWO_STEPS, varied, with_rules

import prensa as pr
from prensa.materials.flow_curve import FlowCurve
from prensa.materials.hardening import stresses
from prensa.model.problem import Problem
from prensa.model.schema import loads
from prensa.sensitivity import bodies, increments
from prensa.sensitivity.parameters import value_of
from rings import FLOW, ring

TABLED = f"{FLOW}={{type: table, points: [[0, 250], [0.1, 450], [0.3, 600], [1, 700]]}}"
KNOWN = {
    **{k: OPTIONS[k] for k in ("penalty", "exact", "plane strain", "voce", "johnson_cook", "gauss2", "force")},
    "table": [TABLED],
    "swift": [f"{FLOW}={{type: swift, K: 700, e0: 0.02, n: 0.2}}"],
    "hockett_sherby": [f"{FLOW}={{type: hockett_sherby, s0: 250, s_inf: 800, b: 3, n: 0.6}}"],
    "swift_voce": [f"{FLOW}={{type: swift_voce, K: 600, e0: 0.01, n: 0.2, s0: 250, Q: 150, b: 10, w: 0.4}}"],
    "kirchhoff": ["bodies.ring.material.yield_on=kirchhoff", EXACT],
    "elastic": ["bodies.ring.material={type: elastic, E: 1000, nu: 0.3}"],
    "t6": ["bodies.ring.element=t6", EXACT], "q8": ["bodies.ring.element=q8"], "q4": ["bodies.ring.element=q4"],
    "q4_bbar": ["bodies.ring.element=q4_bbar"],
    "q4_bbar, plane strain": [*OPTIONS["plane strain"], "bodies.ring.element=q4_bbar", EXACT],
    "capped": ["friction={type: capped, mu: 0.3, m: 0.4}"],
    "capped, table": ["friction={type: capped, mu: 0.3, m: 0.4}", TABLED, EXACT],
    "smooth": ["friction={type: capped, mu: 0.3, m: 0.4, sharpness: 2}", "bodies.ring.material.yield_on=kirchhoff"],
    "stribeck": OPTIONS["stribeck"], "friction of the slip": [*OPTIONS["friction of the slip"], EXACT],
    "frictionless": ["contacts.0.surface=ring.top", "friction.mu=0"],
}

# differences have the round-off of places, over the step: as slip, as its speed in a sixth of the time, and times the penalty
# as pressure, a tenth of which is traction where points slip; the forces of all of those work along their slips
ROUND_OFF = 2.2e-16 * 9.0 / 1e-5
PENALTY, MU, FORCE = 100 * 220e3 / 1.0, 0.1, 45e3
NOISE = {
    "contact.slip": 1.0, "contact.path": 1.0, "contact.coordinate": 1.0, "contact.speed": 6.0, "lam": PENALTY,
    "contact.traction": MU * PENALTY,
    "energy.friction": MU * FORCE, "tool_wear": FORCE,
}  # fmt: skip
COMPILED = [
    pr.Perfect(250.0), pr.Linear(250.0, 900.0), pr.Ludwik(250.0, 500.0, 0.3), pr.Swift(700.0, 0.02, 0.2),
    pr.Voce(250.0, 300.0, 5.0, 40.0), pr.HockettSherby(250.0, 800.0, 3.0, 0.6), pr.JohnsonCook(250.0, 400.0, 0.3, 0.02, 0.1),
    pr.SwiftVoce(600.0, 0.01, 0.2, 250.0, 150.0, 10.0, 0.4),
    ring(TABLED).bodies["ring"].material.flow,  # type: ignore[attr-defined]
]  # fmt: skip


def both(
    problem: Problem, paths: list[str], monkeypatch: pytest.MonkeyPatch, numerics: pr.Numerics | None = None
) -> tuple[list[pr.Increment], list[pr.Increment]]:  # fmt: skip
    """Runs with closed derivatives and with those by differences."""
    closed = list(pr.solve(problem, numerics, derivatives=paths))
    with monkeypatch.context() as patched:
        patched.setattr(increments, "covers", lambda c: False)
        return closed, list(pr.solve(problem, numerics, derivatives=paths))


MANY = [
    f"{FLOW}.K", "bodies.ring.material.E", f"{FLOW}.n", "bodies.ring.material.nu", "friction.mu", f"{FLOW}.s0",
    "bodies.ring.mesh.size.0", "bodies.ring.mesh.size.1", "bodies.ring.mesh.origin.0", "steps.0.move.die.y",
]  # fmt: skip


@cache
def by_itself(path: str) -> dict[str, np.ndarray]:
    """What the direction of a parameter carries at the end of a run with no other, in chunks of five elements."""
    return list(pr.solve(ring(), derivatives=[path]))[-1].state.derivatives[path]


@pytest.mark.parametrize("count", [1, 3, 7, 8, 9, 10])
def test_directions_do_not_depend_on_those_beside_them(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of any number of directions, in groups full or not, each carries what it does alone."""
    monkeypatch.setattr(bodies, "ELEMENTS_AT_ONCE", 5)  # elements: more than one chunk, the last one smaller
    together = list(pr.solve(ring(), derivatives=MANY[:count]))[-1].state.derivatives
    for path in MANY[:count]:
        for name, alone in by_itself(path).items():
            size = max(float(np.abs(alone).max(initial=0.0)), 1e-300)
            assert np.abs(together[path][name] - alone).max(initial=0.0) <= 1e-7 * size, (path, name)


def test_derivatives_of_increments_that_are_kept_stay() -> None:
    """Arrays are given out again only when nobody has them: what a kept increment carries is what it carried at first."""
    kept, copies = [], []
    for inc in pr.solve(ring(), derivatives=MANY[:3]):
        kept.append(inc.state.derivatives)
        copies.append({path: {k: a.copy() for k, a in own.items()} for path, own in kept[-1].items()})
    for own, copy in zip(kept, copies, strict=True):
        assert all(np.array_equal(own[path][k], a) for path in copy for k, a in copy[path].items())
    *_, last = pr.solve(ring(), derivatives=MANY[:3])  # nothing of it is kept
    assert all(np.array_equal(last.state.derivatives[p][k], a) for p in copies[-1] for k, a in copies[-1][p].items())


def test_histories_are_given_out_again() -> None:
    """Neither the array nor a part of it may be in use."""
    room, like = bodies.Histories(), np.empty((3, 4, 10, 5))
    owners = [id(room.like(like).base)]
    first, second = room.like(like), room.like(like)
    assert id(first.base) == owners[0] and second.base is not first.base
    part = first[..., 1]
    del first
    assert id(room.like(like).base) not in (owners[0], id(second.base))
    del part
    assert id(room.like(like).base) == owners[0]
    assert room.like(np.empty((3, 4, 10, 2))).shape == (3, 4, 10, 2)


@pytest.mark.parametrize(("option", "rule"), with_rules(KNOWN))
def test_closed_derivatives_are_those_by_differences(option: str, rule: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Displacements, histories, contact points, energies and reactions, along all parameters, to 1e-7 of their size."""
    problem = ring(*KNOWN[option])
    paths = [p for p in varied(problem, "die") if "points" not in p or p.endswith(("1.0", "2.1"))]
    assert len(paths) >= 5
    closed, by_differences = both(problem, paths, monkeypatch, pr.Numerics(time_rule=rule))
    size = {p: abs(value_of(problem, p)) for p in paths}
    for name in by_differences[-1].state.derivatives[paths[0]]:
        if name == "energy.imbalance":
            continue  # the small difference of the others
        largest, error = 0.0, 0.0
        for a, b in zip(closed, by_differences, strict=True):
            for p in paths:
                x, y = (size[p] * i.state.derivatives[p][name] for i in (a, b))
                largest, error = max(largest, np.abs(y).max(initial=0.0)), max(error, np.abs(x - y).max(initial=0.0))
        assert error <= 1e-7 * largest + ROUND_OFF * NOISE.get(name, 0.0), name


@pytest.mark.parametrize("rule", RULES)
def test_closed_derivatives_go_through_steps_and_folded_elements(rule: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a roll that is pushed, dragged and lifted, and of elements so distorted that forces of their own unfold them."""
    rolled = loads(TWO_STEPS).problem
    folded = ring("steps.0.move.die.y=-1.6", "friction.mu=0.4", "steps.0.increments=12", "bodies.ring.mesh.n=[5, 2]")
    for problem, tool in ((rolled, "roll"), (folded, "die")):
        paths = [p for p in varied(problem, tool) if "radius" not in p]
        size = {p: abs(value_of(problem, p)) for p in paths}
        for a, b in zip(*both(problem, paths, monkeypatch, pr.Numerics(time_rule=rule)), strict=True):
            x, y = (np.array([size[p] * i.state.derivatives[p]["work"] for p in paths]) for i in (a, b))
            assert np.abs(x - y).max() <= 2e-7 * np.abs(y).max()


@pytest.mark.parametrize("rule", RULES)
def test_closed_derivatives_go_on_from_those_by_differences(rule: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """After a step that lets forces go, for which differences are taken, whatever directions carried before it is out of date."""
    problem = loads(RELEASED_BETWEEN).problem
    paths = [p for p in varied(problem, "roll") if "radius" not in p]
    size = {p: abs(value_of(problem, p)) for p in paths}
    closed, by_differences = both(problem, paths, monkeypatch, pr.Numerics(time_rule=rule))
    for name in ("u", "work", "history_0", "contact.slip", "energy.plastic"):
        x, y = ([[size[p] * i.state.derivatives[p][name] for p in paths] for i in run] for run in (closed, by_differences))
        assert np.abs(np.array(x) - np.array(y)).max() <= 2e-7 * np.abs(np.array(y)).max(), name


@pytest.mark.parametrize("curve", COMPILED, ids=lambda c: str(c.type))
def test_slopes_of_flow_curves(curve: FlowCurve) -> None:
    """What scalars, knots and the strain before do to a compiled flow stress is what differences say."""
    f = curve.kernel()
    assert f is not None
    p, dt = f.p, 0.01

    def found(scalars: Any, a: float, da: float) -> Any:
        return stresses(f._replace(p=np.array(scalars)), np.array([a]), da, dt)[0]

    for a, da in ((0.3, 0.02), (1e-13, 0.0)):
        by = found(p, a, da)[4:] if f.kind is not None and not f.kind.tables else ()
        for k in range(len(by)):
            step = 1e-6 * (abs(p[k]) or 1.0)
            up, down = (found([v + s * step * (i == k) for i, v in enumerate(p)], a, da)[0] for s in (1, -1))
            assert by[k] == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-9 * up / (abs(p[k]) or 1.0))
    up, down = (found(p, 0.4 + s * 1e-6, 0.02)[0] for s in (1, -1))
    assert found(p, 0.4, 0.02)[3] == pytest.approx((up - down) / 2e-6, rel=1e-6, abs=1e-6)
