from __future__ import annotations

import math

import pytest

from prensa.reference import strip_rolling, wedge_drawing
from prensa.reference.drawing import cup_force, slab_drawing, strip_upper_bound, wire_upper_bound
from prensa.reference.rolling import orowan_rolling


@pytest.mark.parametrize("alpha", [8.0, 15.0, 25.0])
def test_slab_slip_line_field_and_upper_bound_are_in_order(alpha: float) -> None:
    """Of Hill's reduction the exact stress is above the slab method and below the triangle, and near the latter."""
    angle = math.radians(alpha)
    exact = wedge_drawing(alpha=angle, H=1.0, k=1.0)
    sizes = {"before": 1.0, "after": exact.exit, "alpha": angle}
    stress = exact.pull / exact.exit
    assert slab_drawing(**sizes, Y=math.sqrt(3.0), axisymmetric=False) < stress < strip_upper_bound(**sizes, k=1.0)
    assert strip_upper_bound(**sizes, k=1.0) == pytest.approx(stress, rel=0.02)


def test_bounds_of_a_wire_in_the_limit_of_a_long_die() -> None:
    """Without friction a slender die takes homogeneous work alone; friction adds the same to the slab and to the bound."""
    long = {"before": 1.0, "after": 0.9, "alpha": 1e-3, "Y": 1.0}
    turning = 4.0 / (3.0 * math.sqrt(3.0)) * 1e-3
    assert wire_upper_bound(**long) == pytest.approx(slab_drawing(**long) + turning, rel=1e-5)
    sizes = {"before": 1.0, "after": 0.9, "alpha": 0.1, "Y": 1.0}
    for bound in (wire_upper_bound, slab_drawing):
        assert bound(**sizes, m=0.2) - bound(**sizes) == pytest.approx(
            2.0 / math.sqrt(3.0) * 0.2 / math.tan(0.1) * math.log(1 / 0.9)
        )


def test_orowan_is_karman_where_friction_is_small() -> None:
    """With little friction and a thin arc the shear across the strip does not matter; with much it lowers the force."""
    data = {"R": 65.0, "H": 1.0, "h": 0.75, "k": 100.0}
    for E in (None, 50e3):
        ours, slab = (f(**data, mu=0.1, E=E) for f in (orowan_rolling, strip_rolling))
        assert ours.force == pytest.approx(slab.force, rel=0.02) and ours.force < slab.force
        assert ours.torque == pytest.approx(slab.torque, rel=0.02)
        assert ours.neutral == pytest.approx(slab.neutral, rel=0.01)
    rough = orowan_rolling(**data, mu=2.0)  # sticks all along
    assert rough.force < 0.9 * strip_rolling(**data, mu=0.4).force
    assert rough.pressure.max() == rough.pressure[10:90].max()  # a hill


def test_orowan_with_a_strength_that_rises() -> None:
    """A constant function is the constant, and a metal that hardens needs more force."""
    data = {"R": 65.0, "H": 1.0, "h": 0.75, "mu": 0.1}
    assert orowan_rolling(**data, k=lambda _: 100.0).force == pytest.approx(orowan_rolling(**data, k=100.0).force)
    assert orowan_rolling(**data, k=lambda y: 100.0 * (2.0 - y)).force > orowan_rolling(**data, k=100.0).force


def test_a_cup_in_its_limit() -> None:
    """A blank as large as the punch needs the friction of the binder alone."""
    binder = cup_force(punch=40, blank=40, thickness=1, flow=400, binder=100, mu=0.1)
    assert binder == pytest.approx(20 * math.exp(0.05 * math.pi))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: slab_drawing(before=1, after=1, alpha=0.1, Y=1), "not thinner"),
        (lambda: wire_upper_bound(before=1, after=0.9, alpha=2.0, Y=1), "below pi/2"),
        (lambda: strip_upper_bound(before=1, after=0.9, alpha=0.1, k=1, m=2), "shear factor lies in"),
        (lambda: cup_force(punch=40, blank=80, thickness=1, flow=0), "flow"),
        (lambda: orowan_rolling(R=65, H=1, h=0.75, mu=0.01, k=1), "too little friction"),
        (lambda: orowan_rolling(R=65, H=0.7, h=0.75, mu=0.1, k=1), "give H > h"),
    ],
)
def test_what_makes_no_sense_is_refused(call, words: str) -> None:
    """Arguments outside the range of a formula are reported."""
    with pytest.raises(ValueError, match=words):
        call()
