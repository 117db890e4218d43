"""Coulomb's law against a shear factor: distinguished where readings can, and not where they cannot."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.inverse.experiment import ready
from prensa.inverse.objective import Objective, Parameter, Residuals
from prensa.inverse.rivals import _judged, compared, other_law
from prensa.inverse.tables import Table
from prensa.model.problem import Problem
from rings import K, N, ring

COULOMB, SHEAR = "{type: coulomb, mu: 0.12}", "{type: shear, m: 0.25}"
SEEN = {"force": "die.force.y", "bore": "ring.left.x at y=0"}


def rubbed(law: str) -> Problem:
    """The ring with a law of friction."""
    return ring(f"{K}=450", f"{N}=0.25", "steps.0={name: press, move: {die: {y: -1.2}}, increments: 8}", f"friction={law}")


def objective(law: str, said: str, force: float, bore: float) -> Objective:
    """Exact readings of a ring with one law, with their errors, to be fitted with another."""
    problem = rubbed(law)
    found = list(pr.solve(problem, times=np.linspace(0, 1, 9)[1:].tolist()))
    columns = {name: np.array([i.measure(m) for i in found]) for name, m in SEEN.items()}
    table = Table("t", {"time": np.array([i.time for i in found]), **columns}, dict.fromkeys(["time", *columns], ""))
    observe: dict[str, pr.Observe | str] = {
        "force": pr.Observe(SEEN["force"], sigma=force),
        "bore": pr.Observe(SEEN["bore"], sigma=bore),
    }
    e = ready(pr.Test(rubbed(said), table, observe), 1)
    path = "friction.mu" if "coulomb" in said else "friction.m"
    start = 0.12 if "coulomb" in said else 0.25
    return Objective([e], [Parameter.of(path, start, None), Parameter.of(K, 450.0, None)], report=lambda _: None)


@pytest.mark.parametrize(("law", "said"), [(COULOMB, SHEAR), (SHEAR, COULOMB)])
def test_readings_speak_for_the_law_they_are_of(law: str, said: str) -> None:
    """Readings that are exact for one law, fitted with the other: the right one is found, with its value."""
    o = objective(law, said, 500.0, 0.004)
    x, at = o.minimise(np.array([p.inner(p.start) for p in o.parameters]))
    rival: Any = compared(o, x, at)
    assert rival.value == pytest.approx(0.12 if "coulomb" in law else 0.25, rel=1e-2)
    assert rival.square < 1.0 < at.square
    right, wrong = ("Coulomb's law", "a shear factor") if law == COULOMB else ("a shear factor", "Coulomb's law")
    assert f"favour {right} over {wrong}" in rival.words
    # errors fifty times as large hide it
    e = o.experiments[0]
    vague = replace(o, experiments=[replace(e, channels=[replace(c, sigma=50 * c.sigma) for c in e.channels])], _last=None)
    x, at = vague.minimise(x)
    dim: Any = compared(vague, x, at)
    assert "cannot distinguish" in dim.words


def test_the_verdict_is_that_of_aic() -> None:
    """Differences below 2 say nothing, above 10 settle it; between them the weight of Akaike; bad fits are of neither."""

    def fit(square: float) -> Residuals:
        return Residuals(np.full(20, np.sqrt(square / 20)), np.zeros((20, 3)), [])

    def judged(own: float, other: float) -> Any:
        return _judged(("a shear factor", "Coulomb's law"), "friction.m", 0.3, (fit(own), fit(other)), 3)

    assert "cannot distinguish" in judged(16.0, 17.5).words
    assert "clearly favour Coulomb's law" in judged(16.0, 27.0).words
    some = judged(21.0, 16.0)
    assert some.aic == pytest.approx(-5.0)
    assert "favour a shear factor over Coulomb's law with a probability of 92%" in some.words  # 1/(1 + e^(−5/2)) = 0.924
    assert "neither Coulomb's law nor a shear factor" in judged(60.0, 80.0).words
    # χ²/ν = 27/17 of the better one divides the difference
    assert judged(27.0, 37.0).aic == pytest.approx(10.0 * 17 / 27)


def test_only_plain_laws_have_a_rival() -> None:
    """Other parameters, laws without friction and other laws are not compared; a law of a contact is."""
    problem = rubbed(COULOMB)
    change = other_law(problem, "friction.mu")
    assert change is not None
    assert change[0].startswith("friction={type: shear, m: 0.25")
    assert change[1].path == "friction.m"
    assert other_law(problem, K) is None
    assert other_law(problem, "friction.nothing") is None
    capped = rubbed("{type: capped, mu: 0.1, m: 0.4}")
    assert other_law(capped, "friction.mu") is None
