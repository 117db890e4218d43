"""Bending round a punch into a die."""

import math

import numpy as np
import pytest

from prensa.reference import free_bending

TOOLS = {"punch": 23.5, "shoulder": 4.0, "apart": 29.0, "thickness": 1.0}


def swift(strain):
    """NUMISHEET 2002 B: an aluminium alloy."""
    return 550.4 * (0.009314569797004933 + np.asarray(strain)) ** 0.223


def perfect(strain):
    """Yields at 100 and never hardens."""
    return np.full_like(np.asarray(strain, dtype=float), 100.0)


def test_a_strip_that_bends_in_a_hinge_has_straight_legs():
    """Rigid, perfectly plastic: curvature ends where the punch does, the legs are the common tangents."""
    found = free_bending(**TOOLS, flow=perfect, E=1e6, nu=0.3)
    assert found.tangents == pytest.approx(2 * math.acos(28.5 / 29.0), rel=1e-12)
    assert found.angle == pytest.approx(found.tangents, rel=0.01)


def test_hardening_bends_the_leg_beyond_the_punch():
    """The legs of a strip that hardens stand steeper than the tangents, by a share that friction hardly changes."""
    smooth, rough = (free_bending(**TOOLS, flow=swift, E=70500.0, nu=0.342, mu=mu) for mu in (0.0, 0.1342))
    assert 0.9 * smooth.tangents < smooth.angle < 0.97 * smooth.tangents
    assert rough.angle == pytest.approx(smooth.angle, rel=1e-3)


def test_the_angle_is_the_root_of_the_clearance():
    """Tenths of a millimetre between the tools say more of the angle than the material does: half a one is five per cent."""
    wider = TOOLS | {"apart": 29.05}
    given, changed = (free_bending(**tools, flow=swift, E=70500.0, nu=0.342).angle for tools in (TOOLS, wider))
    clearance = (29.0 - 28.5 + 0.05) / (29.0 - 28.5)
    assert changed / given == pytest.approx(math.sqrt(clearance), rel=2e-3)


def test_an_elastic_leg_is_that_of_a_beam():
    """Elastic and nearly along the tangents: from the shoulder's force P and span a the leg turns by P a²/(2 E' I)."""
    tools = {"punch": 500.0, "shoulder": 1.0, "apart": 502.05, "thickness": 1.0}
    found = free_bending(**tools, flow=lambda e: 1e9 + 0.0 * np.asarray(e), E=1e5, nu=0.0)
    stiff = 1e5 / 12.0
    span = stiff / 500.5 / found.force  # where the moment is that of the punch
    # the beam leaves the circle at P and is P a³/(3 E' I) + a²/(2 ρ)... from its tangent: it must reach the shoulder
    half = 0.5 * found.angle
    turn = found.force * span**2 / (2.0 * stiff)
    centre = np.array([502.05, 0.0]) + 1.5 * np.array([-math.cos(half), math.sin(half)])
    direction = half + turn  # of the tangent at P, from the vertical
    foot = 500.5 * np.array([math.cos(direction), -math.sin(direction)])
    beyond = centre - foot
    tangent = np.array([math.sin(direction), math.cos(direction)])
    normal = np.array([-math.cos(direction), math.sin(direction)])
    assert beyond @ tangent == pytest.approx(span, rel=1e-2)
    assert beyond @ normal == pytest.approx(found.force * span**3 / (3.0 * stiff), rel=2e-2)


def test_an_elastic_strip_is_straight_when_the_tools_have_gone():
    """What bends without yielding opens to 180 degrees, wherever the moment came from; one that yields stays bent."""
    tools = {"punch": 500.0, "shoulder": 1.0, "apart": 502.05, "thickness": 1.0}
    found = free_bending(**tools, flow=lambda e: 1e9 + 0.0 * np.asarray(e), E=1e5, nu=0.3)
    assert found.released == pytest.approx(math.pi, rel=1e-5)
    kept = free_bending(**TOOLS, flow=swift, E=70500.0, nu=0.342)
    assert kept.angle + 0.5 < kept.released < kept.angle + 0.9


@pytest.mark.slow
def test_a_strip_that_touches_the_nose_alone_is_a_beam_on_three_supports():
    """Elastic, far apart shoulders, a small deflection: slope 3 d/(2 a), force 3 E' I d/a³, and nothing lies on the punch."""
    tools = {"punch": 1.0, "shoulder": 1.0, "apart": 100.0, "thickness": 1.0}
    found = free_bending(**tools, flow=lambda e: 1e9 + 0.0 * np.asarray(e), E=1e5, nu=0.3)
    assert found.wrap == 0.0
    stiff, deflection = 1e5 / 0.91 / 12.0, 3.0
    slope = 0.5 * math.pi - 0.5 * found.angle
    span = 100.0 - 1.5 * math.sin(slope)
    deflection -= 1.5 * (1.0 - math.cos(slope))
    assert slope == pytest.approx(1.5 * deflection / span, rel=3e-3)
    assert found.force == pytest.approx(3.0 * stiff * deflection / span**3, rel=3e-3)
    assert found.released == pytest.approx(math.pi, rel=1e-5)


@pytest.mark.slow
def test_a_strip_begins_to_lie_on_the_punch_where_the_nose_has_its_curvature():
    """From one way of touching to the other neither the force nor the leg beside its tangents has a jump."""
    tools = {"shoulder": 3.0, "apart": 17.25, "thickness": 2.0, "flow": swift, "E": 70500.0, "nu": 0.342}
    nose, laid = (free_bending(punch=radius, **tools) for radius in (4.168, 4.180))
    assert nose.wrap == 0.0 < laid.wrap < 0.006
    assert laid.force == pytest.approx(nose.force, rel=1e-5)
    assert laid.angle / laid.tangents == pytest.approx(nose.angle / nose.tangents, rel=2e-4)


def test_tools_that_leave_no_room_are_refused():
    """Punch, strip and shoulder must fit beside one another."""
    with pytest.raises(ValueError, match="leaves no room"):
        free_bending(**{**TOOLS, "apart": 28.4}, flow=swift, E=70500.0, nu=0.342)
