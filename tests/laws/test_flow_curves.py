"""Flow curves, each stated once: the formulas of the literature, and generated derivatives against the complex step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

import prensa as pr
from prensa.kernels.table import Table
from prensa.materials.flow_curve import FlowParameters, stress_at
from prensa.materials.hardening import Curve, Knots, scalars, stresses, table_at
from prensa.registry import DOORS
from prensa.testing import check_flow

POINTS = ((0.0, 200.0), (0.1, 300.0), (0.3, 320.0), (1.0, 400.0))


class RatedTable(pr.PointCurve):
    """A user's: a table over the strain, more with the rate."""

    points: tuple[tuple[float, float], ...]
    c: float
    derived = ("cubic",)

    @cached_property
    def cubic(self) -> Table:
        """Between the points."""
        x, y = np.array(self.points).T
        return Table(x.copy(), np.ascontiguousarray(PchipInterpolator(x, y).c.T), None, float(x[-1]))

    def stress(self, strain: Any, rate: Any) -> Any:
        """σ_y."""
        return self.cubic(strain) * (1.0 + self.c * rate)


def tabled(a: np.ndarray) -> np.ndarray:
    """Flow stress of `POINTS`."""
    x, y = np.array(POINTS).T
    return np.asarray(PchipInterpolator(x, y)(np.minimum(a, 1.0)))


Formula = Callable[[np.ndarray, np.ndarray], np.ndarray]
CURVES: dict[str, tuple[Any, Formula]] = {
    "perfect": (pr.Perfect(250.0), lambda a, r: 250.0 + 0.0 * a),
    "linear": (pr.Linear(250.0, 500.0), lambda a, r: 250.0 + 500.0 * a),
    "ludwik": (pr.Ludwik(250.0, 500.0, 0.3), lambda a, r: 250.0 + 500.0 * a**0.3),
    "swift": (pr.Swift(565.0, 0.007, 0.26), lambda a, r: 565.0 * (0.007 + a) ** 0.26),
    "voce": (pr.Voce(60.0, 120.0, 8.0, 30.0), lambda a, r: 60.0 + 120.0 * (1.0 - np.exp(-8.0 * a)) + 30.0 * a),
    "hockett_sherby": (pr.HockettSherby(100.0, 300.0, 2.0, 0.7), lambda a, r: 300.0 - 200.0 * np.exp(-2.0 * a**0.7)),
    "johnson_cook": (
        pr.JohnsonCook(250.0, 500.0, 0.3, 0.02, 0.1),
        lambda a, r: (250.0 + 500.0 * a**0.3) * (1.0 + 0.02 * np.log(np.maximum(r / 0.1, 1.0))),
    ),
    "swift_voce": (
        pr.SwiftVoce(565.0, 0.007, 0.26, 150.0, 200.0, 12.0, 0.6),
        lambda a, r: 0.6 * 565.0 * (0.007 + a) ** 0.26 + 0.4 * (150.0 + 200.0 * (1.0 - np.exp(-12.0 * a))),
    ),
    "hensel_spittel": (
        pr.HenselSpittel(900.0, 300.0, 0.05, 0.1, -1e-3, 0.2, 0.01, -1e-3, -1e-4, 0.02, -0.1, 1e-5, 0.03),
        lambda a, r: 900.0 * np.exp(-0.3) * 300.0**0.03 * (a + 0.05) ** 0.2 * np.exp(-1e-3 / (a + 0.05))
        * (1.05 + a) ** (-0.03 + 0.02) * np.exp(-0.1 * (a + 0.05)) * (r + 0.1) ** (0.01 + 0.003),
    ),
    "table": (pr.FlowTable(POINTS), lambda a, r: tabled(a)),
    "a user's table": (RatedTable(POINTS, 0.02), lambda a, r: tabled(a) * (1.0 + 0.02 * r)),
}
STRAINS = np.concatenate([[0.0, 1e-13], np.geomspace(1e-11, 0.9, 40), [1.5, 3.0]])
DT = 0.1


def kernel(name: str) -> FlowParameters:
    """Parameters of the compiled curve."""
    found: FlowParameters = CURVES[name][0].kernel()
    return found


def test_all_curves_are_here() -> None:
    """Each type of the door of flow curves."""
    assert {type(c) for c, _ in CURVES.values()} >= set(DOORS["flow"].own().values())


@pytest.mark.parametrize("name", CURVES)
def test_curves_are_the_formulas_of_the_literature(name: str) -> None:
    """Arrays and the kernel, at strains from zero on and two rates, below and above that of Johnson and Cook."""
    curve, formula = CURVES[name]
    check_flow(curve)
    for rate in (0.01, 30.0):
        rates = np.full_like(STRAINS, rate)
        exact = formula(STRAINS, rates)
        chords = 1e-12 ** 0.3 * 600.0  # below a strain of 1e-12 powers are chords
        assert np.abs(stress_at(curve, STRAINS, rates) - exact).max() <= chords
        assert np.abs(stress_at(curve, STRAINS, rates) / exact - 1.0)[2:].max() <= 1e-14
        assert np.abs(stresses(kernel(name), STRAINS, rates * DT, DT)[2:, 0] / exact[2:] - 1.0).max() <= 1e-14


@pytest.mark.parametrize("name", CURVES)
def test_generated_derivatives_are_the_complex_step(name: str) -> None:
    """By the strain, alone and with its part of the increment, and by every number, of a table its shift: to round-off."""
    f, at = kernel(name), table_at(kernel(name).kind)
    a, da = STRAINS, 0.3 * STRAINS
    found = stresses(f, a, da, DT)
    assert found.shape[1] == 4 + scalars(f.kind)

    def slope(da_by: float, a_by: float, p_by: np.ndarray) -> np.ndarray:
        h = 1e-30
        assert f.kind is not None
        curve: Any = Curve(f.kind, f.p + 1j * h * p_by, Knots(f.knots, f.coefficients))
        return np.asarray(np.imag(curve.stress(a + 1j * h * a_by, da + 1j * h * da_by, np.full(len(a), DT))) / h)

    none = np.zeros(len(f.p))
    sizes = np.abs(found).max(axis=0)
    for column, exact in ((1, slope(1.0, 1.0, none)), (3, slope(0.0, 1.0, none))):
        assert np.all(np.abs(found[:, column] - exact) <= 1e-12 * np.abs(exact) + 1e-15 * sizes[column])
    for k in range(len(f.p)):
        if at is None or k not in (at, at + 2, at + 3):  # the last knot is known by differences, other shifts are for other times
            exact = slope(0.0, 0.0, np.eye(len(f.p))[k])
            assert np.abs(found[:, 4 + k] - exact).max() <= 1e-13 * max(1.0, np.abs(exact).max())


@pytest.mark.parametrize("name", CURVES)
def test_a_point_has_the_same_bits_alone(name: str) -> None:
    """Whatever its place among others."""
    f = kernel(name)
    whole = stresses(f, STRAINS, 0.3 * STRAINS, DT)
    for i in (0, 7, 20, len(STRAINS) - 1):
        assert stresses(f, STRAINS[i : i + 1], 0.3 * STRAINS[i : i + 1], DT).tobytes() == whole[i].tobytes()


def test_curves_of_a_class_share_a_kernel() -> None:
    """Other numbers, and a longer table, are nothing new to compile."""
    for name in ("voce", "table"):
        curve = CURVES[name][0]
        number = next(f.name for f in fields(curve))
        value = getattr(curve, number)
        other = replace(curve, **{number: ((0.0, 1.0), *((x + 2.0, y) for x, y in value)) if name == "table" else 2.0 * value})
        assert other.kernel().kind == curve.kernel().kind
        assert len(other.kernel().p) == len(curve.kernel().p)


def block(flow: pr.FlowCurve) -> pr.Problem:
    """A block squeezed by a tenth with friction that its shear strength limits."""
    return pr.Problem(
        "block",
        bodies={"block": pr.Body(pr.Rectangle(size=(4, 3), n=(3, 2)), pr.J2(1000.0, 0.3, flow))},
        tools={"die": pr.Plane(touching="block.top")},
        contacts=[pr.Contact("block.top", "die", friction=pr.Capped(0.3, 0.4))],
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=[pr.Step("press", move={"die": {"y": -0.6}}, increments=4, duration=1.0)],
    )


@pytest.mark.parametrize("name", ["swift_voce", "a user's table", "table"])
def test_derivatives_of_runs_are_those_of_runs_beside(name: str) -> None:
    """Forwards and backwards, by what the curve is made of, of second order in time: against differences of runs."""
    curve = CURVES[name][0]
    weak = replace(curve, points=tuple((x, 0.1 * y) for x, y in curve.points)) if hasattr(curve, "points") else curve
    if name == "swift_voce":
        weak = replace(curve, K=56.0, s0=15.0, Q=20.0)
    names = {"swift_voce": ["K", "n", "b", "w"], "table": ["points.1.1", "points.2.0"]}.get(name, ["points.1.1", "c"])
    paths = [f"bodies.block.material.flow.{n}" for n in names]
    found = list(pr.solve(block(weak), derivatives=paths))[-1].derivative("die.force.y")
    back = pr.gradient(block(weak), "die.force.y", paths)
    for n, path in zip(names, paths):
        beside = [list(pr.solve(block(changed(weak, n, s))))[-1].force("die").y for s in (3e-4, -3e-4)]
        size = (beside[0] - beside[1]) / 6e-4  # smaller steps show what iterations leave
        assert found[path] * value(weak, n) == pytest.approx(size, rel=2e-6)
        assert back[path] == pytest.approx(found[path], rel=1e-8)


def value(curve: Any, name: str) -> float:
    """A field, or a number of the points."""
    first, *places = name.split(".")
    found = getattr(curve, first)
    for k in places:
        found = found[int(k)]
    return float(found)


def changed(curve: Any, name: str, share: float) -> Any:
    """The curve with a number that is larger by a share of itself."""
    places = name.split(".")[1:]
    if not places:
        return replace(curve, **{name: (1.0 + share) * getattr(curve, name)})
    points = [list(p) for p in curve.points]
    points[int(places[0])][int(places[1])] *= 1.0 + share
    return replace(curve, points=tuple(tuple(p) for p in points))
