"""Sliding and time in contact, stress ratios, surface expansion against motions and states that are known."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.result.increment import BodyState
from problems import stroke, upset_block


def body(stress: list[float]) -> BodyState:
    xx, yy, zz, xy = stress
    mises = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2)
    at = np.zeros((1, 2))
    return BodyState(at, at, np.zeros((0, 4), dtype=int), at, np.array([stress]), np.array([mises]), np.zeros(1))


@pytest.mark.parametrize(("stress", "triaxiality", "lode"), [
    ([0, 5, 0, 0], 1 / 3, -1), ([0, -5, 0, 0], -1 / 3, 1), ([0, 0, 0, 3], 0, 0), ([4, 0, 2, 0], 1 / np.sqrt(3), 0),
    ([2, 2, 0, 0], 2 / 3, 1), ([-7, -4, -7, 0], -2, -1), ([1, 1, 1, 0], 0, 0),
])  # fmt: skip
def test_stress_ratios_are_those_of_closed_forms(stress, triaxiality: float, lode: float) -> None:
    """Triaxiality and Lode parameter of uniaxial, shear, plane strain and equibiaxial stresses; 0 where they are not defined."""
    b = body(stress)
    assert b.triaxiality[0] == pytest.approx(triaxiality, abs=1e-15)
    assert b.lode[0] == pytest.approx(lode, abs=1e-14)
    assert b.mean_stress[0] == pytest.approx(sum(stress[:3]) / 3)


def upset(mu: float, *steps, **more) -> pr.Problem:
    return upset_block(
        *steps, material=pr.J2(100e3, 0.3, pr.Linear(10, 50)), n=(4, 3), element="q8", body="block", sides=("top", "right"),
        friction=pr.Coulomb(mu), plane="punch", **more,
    )  # fmt: skip


def test_sliding_without_friction_is_the_way_of_the_nodes() -> None:
    """On a smooth punch a corner slides by its displacement, as fast as it moves; time in contact is that of the steps."""
    p = upset(0.0, stroke(-0.4, increments=4, tool="punch", duration=2.0))
    last = 0.0
    for k, i in enumerate(pr.solve(p), 1):
        moved = i.measure("block.top-right.ux")
        assert i.measure("punch.max.sliding_distance") == pytest.approx(moved, rel=1e-12)
        assert i.measure("punch.max.sliding_velocity") == pytest.approx((moved - last) / 0.5, rel=1e-12)
        assert i.measure("punch.max.contact_time") == pytest.approx(0.5 * k, rel=1e-12)
        last = moved
    rate = i.measure("block.plastic_strain near (0, 0)") - before_last(p).measure("block.plastic_strain near (0, 0)")
    assert i.measure("block.strain_rate near (0, 0)") == pytest.approx(rate / 0.5, rel=1e-9)


def before_last(p: pr.Problem):
    return list(pr.solve(p))[-2]


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_a_face_upset_without_friction_grows_as_the_height_falls(space: str) -> None:
    """Surface of the face over its initial one is h₀/h to 3e-3 (elastic volume), at the axis too; the side's is less."""
    p = upset(0.0, stroke(-0.8, increments=8, tool="punch"), space=space)
    *_, i = pr.solve(p)
    grown = 2.0 / (2.0 - 0.8)
    for text in ("block.top.surface_expansion", "block.top.max.surface_expansion", "block.top.min.surface_expansion",
                 "block.top.surface_expansion at x=0", "block.top-punch.surface_expansion"):  # fmt: skip
        name = text.replace("block.top-punch", next(iter(i.contacts)))
        assert i.measure(name) == pytest.approx(grown, rel=3e-3), text
    side = (1 / grown) * (np.sqrt(grown) if space == "axisymmetric" else 1.0)
    assert i.measure("block.right.surface_expansion") == pytest.approx(side, rel=3e-3)
    assert np.isnan(i.bodies["block"].surface_expansion).any()


def slid(**more) -> pr.Problem:
    """A block pressed on a plane that then goes 0.3 to the side."""
    block = pr.Body(pr.Rectangle((2.0, 1.0), (4, 2)), pr.Elastic(1e5, 0.3))
    return pr.Problem(
        "slid", space="plane strain", bodies={"b": block}, tools={"t": pr.Plane(touching="b.bottom")},
        contacts=(pr.Contact("b.bottom", "t"),), friction=pr.Coulomb(0.1), fixed={"b.top": pr.Fixed(x="held")},
        loads={"b.top": pr.Load(pressure=5.0)},
        steps=(pr.Step("press", increments=1), pr.Step("slide", move={"t": pr.Motion(x=0.3)}, increments=6)), **more,
    )  # fmt: skip


def test_a_block_slides_by_what_its_tool_goes() -> None:
    """With friction every point has slid by the way of the plane less what block and penalty give, as `slip` has."""
    *_, i = pr.solve(slid())
    c = i.contacts["b.bottom-t"]
    give = 0.3 * 1e-3
    assert np.allclose(c.sliding_distance, 0.3, atol=give) and np.allclose(c.sliding_velocity, 0.3, atol=0.3 * give)
    assert np.array_equal(c.points.sliding_distance, c.points.slip)
    assert np.allclose(c.contact_time, 2.0, rtol=1e-12)


def test_sliding_goes_on_after_a_restart_bit_for_bit() -> None:
    """From a state in the middle, as a checkpoint stores it, times, distances and velocities are those of one run."""
    p = slid()
    whole = list(pr.solve(p))
    from prensa.system.state import State

    middle = State.from_arrays(whole[3].state.arrays())
    *_, again = pr.solve(p, start=middle)
    a, b = (i.contacts["b.bottom-t"] for i in (whole[-1], again))
    for name in ("contact_time", "sliding_distance", "sliding_velocity"):
        assert np.array_equal(getattr(a, name), getattr(b, name)) and getattr(a, name).any()


def test_new_meshes_carry_what_has_slid_and_grown() -> None:
    """Smooth upsetting: sliding grows from the axis, everything else is homogeneous, before a new mesh and after it."""
    p = upset_block(
        stroke(-0.5, increments=10, tool="punch"), material=pr.J2(100e3, 0.3, pr.Linear(10, 50)), n=(4, 3), element="t6",
        body="block", sides=("top", "right"), plane="punch", remesh=pr.Remesh(when=pr.When(travel=0.2)),
    )  # fmt: skip
    *_, i = pr.solve(p)
    assert i.remeshings >= 1
    c = next(iter(i.contacts.values()))
    on = c.status > 0
    assert np.allclose(c.sliding_distance[on], (c.x - c.X)[on, 0], rtol=2e-2, atol=2e-3 * i.measure("block.top.max.ux"))
    assert np.allclose(c.contact_time[on], 1.0, rtol=1e-9)
    assert i.measure("block.top.surface_expansion") == pytest.approx(2.0 / 1.5, rel=3e-3)
    b = i.bodies["block"]
    # plane strain: Lode parameter 0 and triaxiality −1/√3
    assert np.abs(b.lode).max() < 0.02 and np.abs(b.triaxiality + 1 / np.sqrt(3)).max() < 5e-3
    assert np.ptp(b.strain_rate) < 1e-3 * b.strain_rate.max()


@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_sliding_has_exact_derivatives(mu: float) -> None:
    """By Poisson's ratio, with friction and without, as central differences of whole runs have them."""

    def problem(nu: float) -> pr.Problem:
        return upset_block(
            stroke(-0.4, increments=4, tool="punch"), material=pr.J2(1e4, nu, pr.Linear(10, 50)), n=(4, 3), element="q8",
            body="block", sides=("top",), friction=pr.Coulomb(mu), plane="punch",
        )  # fmt: skip

    def last(nu: float, **more):
        *_, i = pr.solve(problem(nu), **more)
        return i

    path, name = "bodies.block.material.nu", "punch.max.sliding_distance"
    above, below = (last(0.3 + step).measure(name) for step in (1e-4, -1e-4))
    assert last(0.3, derivatives=[path]).derivative(name)[path] == pytest.approx((above - below) / 2e-4, rel=1e-6)
