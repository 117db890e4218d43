"""Materials and flow curves that users write as point functions: the same answers as the package's own, exact derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.friction.law import At as FrictionAt
from prensa.kernels.record import exp
from prensa.materials.corotational import Tensor
from prensa.materials.point_material import PointAt
from prensa.materials.protocol import At, Out
from prensa.model.problem import Problem
from prensa.sensitivity.change import known
from prensa.testing import check_flow, check_material
from rings import ring
from users_metals import Metal, Power

RULE = pr.Numerics(time_rule="backward_euler")


class Exponentiated(pr.PointMaterial):
    """Exponentiated Hencky energy (Neff, Ghiba and Lankeit 2015)."""

    E: float
    nu: float
    k: float

    def energy(self, strain: Tensor) -> Any:
        G, K = self.E / (2 + 2 * self.nu), self.E / (3 - 6 * self.nu)
        d = strain.deviator
        return G / self.k * (exp(self.k * d.dot(d)) - 1) + 0.5 * K * strain.trace**2


class Fibres(Exponentiated):
    """With fibres along its first axis."""

    fibre: float
    angle: float = 0.0
    directed = True

    def axes(self, X: Any) -> Any:
        return np.full(len(X), self.angle)

    def energy(self, strain: Tensor) -> Any:
        return super().energy(strain) + 0.5 * self.fibre * strain.xx**2


class Rated(pr.PointCurve):
    """Linear hardening, more with the rate, and more numbers than the curves of the package have."""

    s0: float
    H: float
    c: float
    r0: float
    Q: float
    b: float

    def stress(self, strain: Any, rate: Any) -> Any:
        return (self.s0 + self.H * strain + self.Q * (1 - exp(-self.b * strain))) * (1 + self.c * rate / (self.r0 + rate))


METAL = Metal(E=200e3, nu=0.3, s0=250.0, H=900.0)
POWER = Power(250.0, 500.0, 0.3)
SAME = pr.J2(200e3, 0.3, pr.Linear(250.0, 900.0))


@pytest.mark.parametrize(
    "material", [Exponentiated(200.0, 0.3, 4.0), Fibres(200.0, 0.3, 4.0, 150.0, 0.4), METAL], ids=lambda m: type(m).__name__
)
def test_materials_are_as_all_materials(material: pr.Material) -> None:
    """Tangents, energies, objectivity, in small and finite strain and in plane stress; fibres turn with the body."""
    check_material(material)


@pytest.mark.parametrize("curve", [POWER, Rated(250.0, 900.0, 0.3, 0.1, 80.0, 20.0)], ids=lambda c: type(c).__name__)
def test_curves_are_as_all_curves(curve: pr.FlowCurve) -> None:
    """The compiled curve is the one that arrays compute, and its return map is on it."""
    check_flow(curve)


def with_material(problem: Problem, material: pr.Material, element: str) -> Problem:
    from dataclasses import replace

    body = replace(problem.bodies["ring"], material=material, element=element)
    return replace(problem, bodies={"ring": body})


@pytest.mark.parametrize("element", ["q4_fbar", "q4_enhanced", "t3", "t6", "q8"])
def test_a_ring_of_ones_own_metal_is_that_of_j2(element: str) -> None:
    """Forces and places after a compression with friction are those of the same law of the package."""
    ours, theirs = (list(pr.solve(with_material(ring(), m, element), RULE))[-1] for m in (METAL, SAME))
    assert ours.force("die").y == pytest.approx(theirs.force("die").y, rel=1e-9)
    assert np.abs(ours.bodies["ring"].x - theirs.bodies["ring"].x).max() <= 1e-9
    assert ours.energy["plastic"] == pytest.approx(theirs.energy["plastic"], rel=1e-9)
    assert ours.energy["elastic"] == pytest.approx(theirs.energy["elastic"], rel=1e-8)


def test_increments_are_of_second_order() -> None:
    """The answer is J2's but for how the last plastic strain is measured, which is little beside the error of backward Euler."""
    first, ours, theirs = (
        list(pr.solve(with_material(ring(), m, "q4_fbar"), pr.Numerics(time_rule=rule)))[-1].force("die").y
        for m, rule in ((METAL, "backward_euler"), (METAL, "bdf2"), (SAME, "bdf2"))
    )  # fmt: skip
    assert abs(ours - theirs) <= 0.02 * abs(ours - first)


@pytest.mark.parametrize("element", ["q4_fbar", "t6"])
def test_derivatives_by_ones_own_numbers_are_those_of_j2(element: str) -> None:
    """Forwards and backwards; the same numbers of the package's law, whose derivatives are compared with differences."""
    ours, theirs = with_material(ring(), METAL, element), with_material(ring(), SAME, element)
    own = [f"bodies.ring.material.{k}" for k in ("s0", "H", "nu", "E")]
    package = [f"bodies.ring.material.{k}" for k in ("flow.s0", "flow.H", "nu", "E")]
    assert known(pr.discretise(ours))
    a, b = (list(pr.solve(p, RULE, derivatives=by))[-1] for p, by in ((ours, own), (theirs, package)))
    da, db = (np.array([i.derivative("die.force.y")[k] for k in by]) for i, by in ((a, own), (b, package)))
    assert np.abs(da / db - 1.0).max() <= 1e-7
    back = pr.gradient(ours, "die.force.y", own, RULE)
    assert np.abs(np.array([back[k] for k in own]) / da - 1.0).max() <= 1e-7


def test_ones_own_curve_is_the_packages() -> None:
    """A run with the curve and its derivatives, of second order in time."""
    one, other = (with_material(ring(), pr.J2(200e3, 0.3, c), "q4_fbar") for c in (POWER, pr.Ludwik(250.0, 500.0, 0.3)))
    by = [f"bodies.ring.material.flow.{k}" for k in ("s0", "K", "n")]
    a, b = (list(pr.solve(p, derivatives=by))[-1] for p in (one, other))
    assert a.force("die").y == pytest.approx(b.force("die").y, rel=1e-10)
    da, db = (np.array([i.derivative("die.force.y")[k] for k in by]) for i in (a, b))
    assert np.abs(da / db - 1.0).max() <= 1e-8


def squeezed(material: pr.Material) -> Problem:
    """A block squeezed between a support and a plane that it slides along."""
    return pr.Problem(
        "block",
        bodies={"block": pr.Body(pr.Rectangle(size=(4, 3), n=(3, 2)), material)},
        tools={"die": pr.Plane(touching="block.top")},
        contacts=[pr.Contact("block.top", "die")],
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=[pr.Step("press", move={"die": {"y": -0.4}}, increments=3)],
    )


def test_derivatives_of_fibres_are_those_of_runs() -> None:
    """Of a law with axes, by its moduli and the direction of the fibres: against runs beside."""
    from dataclasses import replace

    material = Fibres(200.0, 0.3, 4.0, 150.0, 0.4)
    names = "E", "k", "fibre", "angle"
    found = list(pr.solve(squeezed(material), derivatives=[f"bodies.block.material.{k}" for k in names]))[-1]
    for name in names:
        value, step = getattr(material, name), 1e-5 * getattr(material, name)
        beside = [list(pr.solve(squeezed(replace(material, **{name: value + s}))))[-1].force("die").y for s in (step, -step)]
        slope = found.derivative("die.force.y")[f"bodies.block.material.{name}"]
        assert slope == pytest.approx((beside[0] - beside[1]) / (2 * step), rel=1e-6)


def update(law: Any, h: np.ndarray, temperature: np.ndarray | None) -> Out:
    n = len(h)
    out = Out(np.empty((n, 5)), np.empty((n, 5, 5)), np.zeros((n, law.size)), np.zeros(n, dtype=bool))
    law.update(h, np.zeros((n, law.size)), At(1.0, 1.0, temperature=temperature), out)
    return out


def test_laws_know_the_temperature() -> None:
    """A law that asks for it flows earlier where it is hot; others and those without a temperature stay as they are."""
    h = np.tile([0.02, 0.0, 0.0, -0.01, -0.01], (10, 1))
    warm = np.linspace(0.0, 500.0, 10)
    soft = Metal(E=200e3, nu=0.3, s0=250.0, H=0.0, softening=1e-3).law("finite")
    cold, hot = update(soft, h, None), update(soft, h, warm)
    assert np.array_equal(cold.P[0], hot.P[0])
    s = soft.cauchy(hot.new)[:, :3]
    stress = np.sqrt(1.5 * ((s - s.mean(axis=1, keepdims=True)) ** 2).sum(axis=1))
    assert stress == pytest.approx(250.0 * (1.0 - 1e-3 * warm), rel=1e-9)
    j2 = SAME.law("finite")
    assert np.array_equal(update(j2, h, None).P, update(j2, h, warm).P)


def test_what_is_not_a_point_function_is_refused_in_words() -> None:
    """Choices in Python, curves of arrays, plastic laws without their variables."""

    class Choice(Exponentiated):
        def energy(self, strain: Tensor) -> Any:
            return strain.trace if self.k > 1 else 0.0 * strain.trace

    with pytest.raises(TypeError, match="where"):
        update(Choice(1.0, 0.3, 2.0).law("finite"), np.zeros((1, 5)), None)

    class Leaking(Exponentiated):
        def respond(self, trial: Tensor, old: Sequence[Any], at: PointAt) -> tuple[Tensor, Sequence[Any]]:
            return 0.5 * trial, old

    with pytest.raises(pr.PrensaError, match="say that it is plastic"):
        update(Leaking(1.0, 0.3, 2.0).law("finite"), np.zeros((1, 5)), None)

    class Flowing(Metal):
        flow: Any = None

    class Slow(pr.FlowCurve):
        def stress(self, strain: Any, rate: Any) -> Any:
            return 100.0 + strain

    with pytest.raises(pr.PrensaError, match="PointCurve"):
        Flowing(1.0, 0.3, 2.0, 1.0, flow=Slow()).law("finite")

    class Forgetful(Metal):
        variables = ("plastic_strain",)

    with pytest.raises(pr.PrensaError, match="plastic_work"):
        Forgetful(1.0, 0.3, 2.0, 1.0).law("finite")


class Radial(Fibres):
    """Fibres that turn from the bottom to the top."""

    def axes(self, X: Any) -> Any:
        return self.angle * X[:, 1]


def test_axes_start_where_they_are_said_to_and_go_to_new_meshes() -> None:
    """One direction for each point, of unit length on a new mesh too."""
    from prensa.remeshing.transfer import carried

    body = pr.Body(pr.Rectangle(size=(4, 3), n=(6, 5)), Radial(200.0, 0.3, 4.0, 150.0, 0.3), element="t6")
    system = pr.discretise(pr.Problem("block", bodies={"block": body}, fixed={"block.bottom": "xy"}, steps=[pr.Step("rest")]))
    block = system.blocks[0]
    angle = 0.3 * block.positions(system.X)[..., 1]
    assert np.allclose(block.undeformed[..., 4:6], np.stack([np.cos(angle), np.sin(angle)], axis=-1), rtol=0, atol=1e-15)
    points = np.random.default_rng(0).uniform([0, 0], [4.0, 3.0], (50, 3, 2))
    there = carried(block, system.X, block.undeformed, points)[..., 4:6]
    assert np.abs(np.linalg.norm(there, axis=-1) - 1.0).max() <= 1e-14
    assert np.abs(np.arctan2(there[..., 1], there[..., 0]) - 0.3 * points[..., 1]).max() <= 1e-3


def test_friction_knows_the_temperature() -> None:
    """It goes with the points that are asked about."""
    at = FrictionAt(temperature=np.array([20.0, 300.0])).repeated(2)
    assert at.temperature is not None
    assert at.temperature.tolist() == [20.0, 300.0, 20.0, 300.0]
    assert FrictionAt().repeated(2).temperature is None
