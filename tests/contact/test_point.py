"""The law of a contact point: generated derivatives against the complex step of the same functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.contact.point import Point, answers, normal, slopes
from prensa.friction.law import At, FrictionLaw
from prensa.friction.point import values_of
from prensa.friction.return_map import DECIDE, OPEN, SLIDING, STUCK
from prensa.kernels.record import where
from prensa.registry import examples

K = 60


class Users(pr.FrictionLaw):
    """A user's law of a point, with a number of its own in a cached property's place."""

    mu: float
    m: float

    @property
    def asks_for_k(self):
        return True

    @property
    def hardens(self):
        return False

    def bound_of_point(self, p, kappa, at):
        free, cap = self.mu * p, self.m * at.k
        return where(free < cap, free, cap)


LAWS = {
    "constant": pr.Coulomb(0.3),
    "linear": pr.Coulomb(pr.MuLinear(0.1, 0.05)),
    "exponential": pr.Coulomb(pr.MuExponential(0.1, 0.4, 2.0)),
    "table": pr.Coulomb(pr.MuTable((0.0, 1.0, 4.0), (0.1, 0.25, 0.3))),
    "shear": pr.Shear(0.3),
    "a user's": Users(0.5, 0.6),
} | examples("friction")


@dataclass
class Plain:
    """A law called with arrays, for the complex step."""

    law: FrictionLaw
    args: list[Any]

    @property
    def hardens(self) -> bool:
        return self.law.hardens

    def bound(self, p: Any, kappa: Any) -> Any:
        k, speed, dt, time = self.args
        return self.law.bound_of_point(p, kappa, At(k, dt, time, speed))

    def of(self, args: Any) -> Plain:
        return Plain(self.law, list(args))


def state(t: int, rng: np.random.Generator) -> tuple[Point, At]:
    """Points that stick, slip and are open, in turn."""
    k = np.arange(K)
    one, two = (lambda a, b: rng.uniform(a, b, K)), (lambda a: a * rng.normal(size=(K, t)))
    x = Point(
        g=one(-0.5, -0.1), way=two(1.0) * np.where(k % 2, 1.0, 0.01)[:, None], lam_n=one(0.0, 20.0), lam=two(2.0),
        k_n=one(80.0, 120.0), k_t=one(70.0, 90.0), weight=one(0.5, 1.0), area=one(0.6, 1.2), slip=one(0.0, 3.0),
        traction=two(5.0), area_was=one(0.5, 1.0), closed=k % 5 > 0, slips=(k % 2 > 0) & (k % 5 > 0),
    )  # fmt: skip
    return x, At(one(30.0, 90.0), dt=0.3, time=0.6, speed=one(0.1, 3.0))


@pytest.mark.parametrize("t", [1, 2])
@pytest.mark.parametrize("law", [pytest.param(law, id=name) for name, law in LAWS.items()])
def test_derivatives_of_points_are_those_of_the_complex_step(law: FrictionLaw, t: int) -> None:
    """Pressure, traction, slip, forces, bound and energies by all that a point depends on, to 1e-11 of the largest."""
    x, at = state(t, np.random.default_rng(t))
    found = slopes(x, law, at, by_area=True)
    given = dict(zip(x._fields, x, strict=True)) | {"k": at.k, "speed": at.speed}
    for name, place in found.places.inputs.items():
        if name == "numbers":
            continue
        for i in range(place.stop - place.start):
            z = {n: [v] if v.ndim == 1 else list(v.T) for n, v in given.items() if n not in ("closed", "slips")}
            z[name] = [v + 1e-30j * (j == i) for j, v in enumerate(z[name])]
            plain = Plain(law, [z["k"][0], z["speed"][0], at.dt, at.time])
            with np.errstate(all="ignore"):
                out = answers(z, x.closed, x.slips, plain, True)
            exact = np.stack([np.imag(v) / 1e-30 + np.zeros(K) for n in found.places.outputs for v in out[n]], axis=1)
            error = np.abs(found.J[:, :, place.start + i] - exact)
            assert error.max() <= 1e-11 * max(np.abs(exact).max(), 1e-300), (
                name,
                np.unravel_index(error.argmax(), error.shape),
            )


@pytest.mark.parametrize("law", [pytest.param(law, id=name) for name, law in LAWS.items() if name != "a user's"])
def test_derivatives_by_the_numbers_of_a_law_are_differences_of_laws(law: FrictionLaw) -> None:
    """The bound at a point, by each field of the law that is a number and by what is derived of them, to 1e-6."""
    x, at = state(1, np.random.default_rng(5))
    found = slopes(x, law, at, by_area=True)
    p = np.where(x.closed, x.lam_n - x.k_n * x.g, 0.0) * x.weight / x.area
    for name, value in vars(law).items():
        if not isinstance(value, float) or name in getattr(law, "derived", ()):
            continue
        h = 1e-6 * abs(value) or 1e-6
        try:
            above, below = (
                type(law)(**{f: v for f, v in vars(law).items() if f in fields_of(law)} | {name: value + s * h})
                for s in (1, -1)
            )
        except pr.CaseError:
            continue  # at the end of what is allowed
        change = (values_of(above).numbers - values_of(below).numbers) / (2 * h)
        ours = found.along({"numbers": np.broadcast_to(change[None, :, None], (K, len(change), 1))})["bound"][:, 0, 0]
        tau = [other.bound(p, x.slip, at)[0] for other in (above, below)]
        np.testing.assert_allclose(ours, (tau[0] - tau[1]) / (2 * h), rtol=1e-6, atol=1e-6 * np.abs(ours).max())


def fields_of(law: FrictionLaw) -> set[str]:
    return set(type(law).__dataclass_fields__) - {"type"}


def test_weights_go_back_by_the_transpose() -> None:
    """⟨w, J z⟩ = ⟨Jᵀ w, z⟩, names in the same places."""
    rng = np.random.default_rng(3)
    x, at = state(1, rng)
    by = slopes(x, LAWS["linear"], at, by_area=False)
    z = {n: rng.normal(size=(K, p.stop - p.start, 1)) for n, p in by.places.inputs.items()}
    w = {n: rng.normal(size=(1, K, p.stop - p.start)) for n, p in by.places.outputs.items()}
    there, back = by.along(z), by.back(w)
    along = sum(float((w[n][0] * there[n][:, :, 0]).sum()) for n in w)
    assert along == pytest.approx(sum(float((back[n][0] * z[n][:, :, 0]).sum()) for n in z), rel=1e-12)


def test_sides_of_the_normal_kink() -> None:
    """What a gap, the committed flag and the branch that is wanted make of a point: pressure and whether it resists."""
    g = np.array([-0.1, 0.1, -0.1, 0.1, 1e-17, 1e-17, 5e-11, 5e-11, np.inf, np.inf])
    want = np.array([DECIDE, DECIDE, OPEN, STUCK, DECIDE, DECIDE, DECIDE, DECIDE | 8, DECIDE, SLIDING], dtype=np.int8)
    closed = np.array([0, 0, 1, 0, 1, 0, 0, 0, 1, 0], dtype=bool)
    n = len(g)
    p, touching, rests = normal(g, np.zeros(n), np.full(n, 10.0), np.ones(n), np.full(n, 1e-16), closed, want)
    assert touching.tolist() == [True, False, False, True, True, False, False, True, False, False]
    assert p == pytest.approx([1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert rests.tolist() == [True, False, True, False, True, True, False, False, False, False]
