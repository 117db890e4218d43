"""Parameters whose best value lies at an end of their range: one-sided intervals, the others fitted there."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares
from scipy.stats import t

import prensa as pr
from prensa.errors import PrensaError
from prensa.inverse.ends import bounded, ends_of
from prensa.inverse.objective import Objective, Parameter, Residuals
from prensa.sensitivity.parameters import with_values
from rings import MU, K, N, ring

STRAIN = np.linspace(0.02, 0.6, 30)
PATHS = ("s", "K", "n")


class Known(Objective):
    """Readings of s + K εⁿ, computed in place of a run; parameters that are not fitted have the values of ``held``."""

    def __init__(self, parameters: list[Parameter], readings: Any, held: dict[str, float] | None = None) -> None:
        super().__init__([], parameters)
        self.readings, self.held = readings, held or {}

    def _evaluated(self, x: Any, sloped: bool) -> Residuals | None:
        values = self.held | self.values(x)
        s, strength, n = (values[path] for path in PATHS)
        power = strength * STRAIN**n
        J = dict(zip(PATHS, (np.ones_like(power), power / strength, power * np.log(STRAIN)), strict=True))
        slopes = [J[p.path] * p.slope(values[p.path]) for p in self.parameters]
        return Residuals((s + power - self.readings) / 5.0, np.column_stack(slopes) / 5.0, [])

    @property
    def curves(self) -> list[Any]:
        """No flow curve of a case."""
        return []


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parameters at ends are held in what is computed."""

    def without(objective: Known, ends: Any) -> Known:
        held = objective.held | {e.parameter.path: e.value for e in ends}
        return Known([p for p in objective.parameters if p.path not in held], objective.readings, held)

    monkeypatch.setattr("prensa.inverse.ends.without", without)


def by_scipy(readings: Any, s: float) -> float:
    """Least χ² over K and n with s held, by SciPy in plain numbers."""
    found = least_squares(lambda y: (s + y[0] * STRAIN ** y[1] - readings) / 5.0, (600.0, 0.2), x_scale=(100.0, 0.1), xtol=1e-12)
    return 2.0 * float(found.cost)


@pytest.mark.parametrize("bound", [None, (0.0, 500.0), (40.0, 500.0)])
def test_a_strength_that_nobody_sees_has_one_end(computed: None, bound: tuple[float, float] | None) -> None:
    """Without bounds its logarithm runs away, to zero; with one it lies there. The interval ends where χ² has grown enough."""
    noise = 5.0 * np.random.default_rng(4).standard_normal(len(STRAIN))
    readings = 640.0 * STRAIN**0.16 - 3.0 + noise  # a first yield below zero would be best
    known = [Parameter.of("s", 200.0, bound), Parameter.of("K", 500.0, None), Parameter.of("n", 0.3, None)]
    objective = Known(known, readings)
    first = objective.at(np.array([p.inner(p.start) for p in known]))
    x, at = objective.minimise(np.array([p.inner(p.start) for p in known]))
    ends = ends_of(objective, x, at, first)
    assert [(e.parameter.path, e.end, e.lower) for e in ends] == [("s", 40.0 if bound and bound[0] else 0.0, True)]
    least, freedom = by_scipy(readings, ends[0].end), len(STRAIN) - 2
    (found,) = bounded(objective, ends, x, least, freedom)
    target = t.ppf(0.95, freedom) ** 2 * max(least / freedom, 1.0)
    exact = brentq(lambda s: by_scipy(readings, s) - least - target, ends[0].end, 300.0)
    assert found.limit - found.end == pytest.approx(exact - found.end, rel=0.05)
    assert f"below {found.limit:.4g} at 95 %" in found.words


def test_what_is_determined_stays_inside(computed: None) -> None:
    """No end where the best value lies within its range, weakly determined or not."""
    readings = 150.0 + 500.0 * STRAIN**0.3 + 5.0 * np.random.default_rng(1).standard_normal(len(STRAIN))
    known = [Parameter.of("s", 100.0, None), Parameter.of("K", 500.0, (100.0, 1000.0)), Parameter.of("n", 0.2, None)]
    objective = Known(known, readings)
    start = np.array([p.inner(p.start) for p in known])
    assert not ends_of(objective, *objective.minimise(start), objective.at(start))


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Readings of a ring without first yield worth a word, 1 % and 4 µm of noise."""
    rng, lines = np.random.default_rng(5), ["travel,force,bore"]
    increments = list(pr.solve(with_values(guess(), {MU: 0.1, K: 640.0, N: 0.16, S0: 2.0})))
    for i in increments:
        force = i.measure("die.force.y") * (1 + 0.01 * rng.standard_normal())
        bore = i.measure("ring.left.x at y=0") + 0.004 * rng.standard_normal()
        lines.append(f"{-i.measure('die.uy'):.8g},{force:.8g},{bore:.8g}")
    path = tmp_path_factory.mktemp("data") / "ring.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


S0 = "bodies.ring.material.flow.s0"
SEEN = {"force": pr.Observe("die.force.y", sigma="1 % of reading"), "bore": pr.Observe("ring.left.x at y=0", sigma=0.004)}


def guess() -> pr.Problem:
    """The ring test with poor values of what is sought."""
    return ring(f"{MU}=0.2", f"{K}=700", f"{N}=0.4", f"{S0}=200", "steps.0.move.die.y=-0.9", "steps.0.increments=12")


def test_a_ring_without_first_yield(table: Path, caplog: pytest.LogCaptureFixture, tmp_path: Path) -> None:
    """s0 is below some stress, one sentence says so, the others have plain intervals about the truth, and no run complains."""
    with caplog.at_level(logging.WARNING, "prensa"):
        fit = pr.calibrate(
            guess(), table, SEEN, {MU: (0.02, 0.5), S0: None, K: None, N: None}, along="-die.uy", refine=False, compare=False,
            report=lambda line: None,
        )  # fmt: skip
    assert not [r.message for r in caplog.records if "flow stress" in r.message]
    own = fit.parameters[S0]
    assert own.low == 0.0 and 5.0 < own.high < 150.0 and list(fit.parameters) == [MU, S0, K, N]
    for path, value in {MU: 0.1, K: 640.0, N: 0.16}.items():
        p = fit.parameters[path]
        assert 0.7 * p.low < value < 1.3 * p.high and p.high < 1.5 * p.low
    said = [words for words in fit.words if S0 in words]
    assert len(said) == 1 and f"the end of its range, 0; below {own.high:.4g} at 95 %" in said[0]
    assert fit.correlation.shape == (4, 4) and np.isfinite(fit.correlation).all()
    page = fit.report(tmp_path / "fit.html").read_text(encoding="utf-8")
    assert "one side" in page and "nan" not in page


def test_a_bound_above_the_truth(table: Path) -> None:
    """Friction that may not be as low as it is lies at its bound; with nothing else fitted its profile ends there."""
    fit = pr.calibrate(
        guess(), table, SEEN, {MU: (0.15, 0.5), K: None}, along="-die.uy", refine=False, compare=False, profiles=False,
        report=lambda line: None,
    )  # fmt: skip
    assert fit.parameters[MU].low == 0.15 and 0.15 < fit.parameters[MU].high < 0.3
    assert any("the end of its range, 0.15; below" in words for words in fit.words)
    (alone,) = pr.calibrate(
        with_values(guess(), {S0: 2.0, K: 640.0, N: 0.16}), table, SEEN, {MU: (0.15, 0.5)}, along="-die.uy", refine=False,
        compare=False, report=lambda line: None,
    ).parameters.values()  # fmt: skip
    assert alone.value == pytest.approx(0.15, rel=1e-3) and alone.low >= 0.15 and 0.15 < alone.high < 0.3
    with pytest.raises(PrensaError, match="outside its bounds"):
        pr.calibrate(guess(), table, SEEN, {MU: (0.3, 0.5)}, along="-die.uy")
