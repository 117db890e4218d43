"""Plastic flow in time: the order of the rule on paths that turn, and what a body that unloads makes of it."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.materials.laws import At, Out
from prensa.materials.material import material_of
from prensa.system.time_integration import TimeRule

METAL = pr.J2(200e3, 0.3, pr.Voce(200.0, 150.0, 6.0))
PLACES = {"plane strain": [(0, 0), (0, 1), (1, 0), (1, 1), (2, 2)], "solid": [(i, j) for i in range(3) for j in range(3)]}


def motion(t: float, kinematics: str) -> np.ndarray:
    """F (3, 3): a stretch, and a shear that comes later; in finite strain the body turns meanwhile."""
    F = np.diag(np.exp([0.06 * t, -0.06 * t, 0.0]))
    F[0, 1] = 0.12 * t**3
    if kinematics == "finite":
        c, s = np.cos(0.8 * t), np.sin(0.8 * t)
        F = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ F
    return F


def end(law, kinematics: str, space: str, ends: np.ndarray, second: bool) -> np.ndarray:
    """Stress and plastic strain at the end of the path by increments that end at given times."""
    history, now, last = np.zeros((1, law.size)), 0.0, 0.0
    c = law.layout.components
    for t in ends:
        rule = TimeRule.of(t - now, last) if second else TimeRule()
        a, b = motion(now, kinematics), motion(t, kinematics)
        H = b @ np.linalg.inv(a) - np.eye(3) if kinematics == "finite" else b - a
        h = np.array([[H[i, j] for i, j in PLACES[space]]])
        out = Out(np.empty((1, c)), np.empty((1, c, c)), np.empty_like(history), np.zeros(1, dtype=np.bool_))
        law.update(h, law.begin(history, rule.share), At(rule.part * (t - now), t), out)
        history, now, last = out.new, t, t - now
    return np.append(law.cauchy(history)[0], history[0, law.layout.kept] * 1e3)


@pytest.mark.parametrize("space", PLACES)
@pytest.mark.parametrize("kinematics", ["finite", "small"])
def test_flow_that_turns_is_of_second_order(kinematics: str, space: str) -> None:
    """Halved increments quarter the error, lengths that change as they do in runs too; backward Euler's is halved."""
    law = material_of(METAL, kinematics, space)
    exact = end(law, kinematics, space, np.linspace(0.0, 1.0, 3201)[1:], second=True)

    def errors(second: bool, n: int) -> float:
        lengths = np.where(np.arange(n) % 8 < 4, 1.0, 1.5)
        return float(np.abs(end(law, kinematics, space, np.cumsum(lengths) / lengths.sum(), second) - exact)[:4].max())

    second, first = ([errors(rule, n) for n in (40, 80, 160)] for rule in (True, False))
    assert second[0] > 3.4 * second[1] and second[1] > 3.4 * second[2]
    assert 1.7 < first[0] / first[1] < 2.3 and 1.7 < first[1] / first[2] < 2.3
    assert second[0] < 0.15 * first[0]


def test_the_backward_difference_is_exact_for_quadratics() -> None:
    """Share and part: x_n+1 − x_n = share (x_n − x_n−1) + part h x′_n+1 for x = t² and t, whatever the two lengths are."""
    for last, h in ((1.0, 1.0), (0.3, 0.7), (2.0, 0.1)):
        rule, t0, t1 = TimeRule.of(h, last), -last, h
        assert h == pytest.approx(rule.share * last + rule.part * h, rel=1e-14)
        assert t1**2 == pytest.approx(rule.share * -(t0**2) + rule.part * h * 2.0 * t1, rel=1e-13)
    assert TimeRule.of(1.0, 0.0) == TimeRule.of(1.0, 0.2) == TimeRule(0.0, 1.0)  # nothing before, or next to nothing


def test_what_does_not_flow_stays_as_it_is() -> None:
    """An elastic increment begins with the committed state to the last bit, and so does the one after it."""
    law = material_of(METAL, "finite", "plane strain")
    rng = np.random.default_rng(0)
    history = np.zeros((50, law.size))
    for size in (1e-5, 1e-4):
        h = rng.normal(size=(50, 5)) * size
        out = Out(np.empty((50, 5)), np.empty((50, 5, 5)), np.empty_like(history), np.zeros(50, dtype=np.bool_))
        law.update(h, law.begin(history, 1 / 3), At(1.0, 1.0), out)
        history = out.new
        assert np.array_equal(law.begin(history, 1 / 3), history)
        assert not history[:, 4:6].any()


def test_work_of_flow_goes_on_along_the_flow_curve() -> None:
    """Plastic work of a proportional path is the area under the curve, whatever the share: to 1e-4 in 40 increments."""
    law = material_of(METAL, "small", "plane strain")
    history, last = np.zeros((1, law.size)), 0.0
    for _ in range(40):
        rule = TimeRule.of(0.0025, last)
        out = Out(np.empty((1, 5)), np.empty((1, 5, 5)), np.empty_like(history), np.zeros(1, dtype=np.bool_))
        law.update(np.array([[0.0025, 0.0, 0.0, -0.0025, 0.0]]), law.begin(history, rule.share), At(rule.part, 1.0), out)
        history, last = out.new, 0.0025
    a = history[0, 4]
    area = 350.0 * a - 150.0 / 6.0 * (1.0 - np.exp(-6.0 * a))
    assert a > 0.1 and history[0, 5] == pytest.approx(area, rel=1e-4)
