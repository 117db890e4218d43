import numpy as np
import pytest

from prensa import reference as ref


def test_drawing_through_a_wedge_is_hills():
    """At 15° the half sheet leaves with 0.6589 of its thickness and a pull of 56.7 (k = 100); a slender wedge takes 2k r H."""
    found = ref.wedge_drawing(alpha=np.radians(15), H=1.0, k=100.0)
    assert found.exit == pytest.approx(0.6589, abs=5e-5) and found.pull == pytest.approx(56.72, abs=5e-3)
    slender = ref.wedge_drawing(alpha=1e-4, H=2.0, k=100.0)
    assert slender.pull == pytest.approx(200.0 * (2.0 - slender.exit), rel=2e-4)
    with pytest.raises(ValueError, match="radians"):
        ref.wedge_drawing(alpha=15.0, H=1.0, k=100.0)


def test_rolling_is_the_slab_marched_from_both_ends():
    """Force, torque and neutral point are those of small steps of the horizontal balance of slices, rigid strip."""
    R, H, h, mu, k = 65.0, 1.0, 0.75, 0.1, 100.0
    phi = np.linspace(0.0, np.arccos(1 - (H - h) / R), 20_001)
    y, d = h + R * (1 - np.cos(phi)), np.diff(phi)
    q, p = np.zeros((2, len(phi))), np.zeros((2, len(phi)))
    for z, (sign, order) in enumerate(((1.0, range(len(d))), (-1.0, range(len(d) - 1, -1, -1)))):
        N = 0.0  # q y
        for i in order:
            a, b = (i, i + 1) if sign > 0 else (i + 1, i)
            p[z, a] = (2 * k + N / y[a]) / (1 + sign * mu * np.tan(phi[a]))
            N += sign * d[i] * R * p[z, a] * (np.sin(phi[a]) + sign * mu * np.cos(phi[a]))
            q[z, b] = N / y[b]
        p[z, b] = (2 * k + q[z, b]) / (1 + sign * mu * np.tan(phi[b]))
    late = q[0] < q[1]
    pressure, s = np.where(late, p[0], p[1]), np.where(late, 1.0, -1.0)
    found = ref.strip_rolling(R=R, H=H, h=h, mu=mu, k=k)
    assert found.neutral == pytest.approx(phi[late][-1], rel=2e-3)
    assert found.force == pytest.approx(
        np.trapezoid(pressure * R * (np.cos(phi) + s * mu * np.sin(phi)), phi), rel=1e-3
    )
    assert found.torque == pytest.approx(np.trapezoid(-s * mu * pressure * R**2, phi), rel=3e-3)


def test_a_strip_that_recovers_takes_more_force():
    """The recovery adds 2/3 of 2k over an arc of √(2 R h 2k (1 − ν²)/E), nothing in the limit of a stiff strip."""
    data = {"R": 65.0, "H": 1.0, "h": 0.75, "mu": 0.1, "k": 100.0}
    rigid, stiff, soft = (ref.strip_rolling(**data, E=E).force for E in (None, 1e12, 2e5))
    arc = np.sqrt(2 * 65 * 0.75 * 200 * 0.91 / 2e5)
    assert stiff == pytest.approx(rigid, rel=1e-4)
    assert soft - rigid == pytest.approx(2 / 3 * 200 * arc, rel=0.35)


def test_rolls_without_grip_are_refused():
    """Friction below the tangent of half the bite does not draw the strip in; a strip that grows is none."""
    with pytest.raises(ValueError, match="too little friction"):
        ref.strip_rolling(R=65.0, H=1.0, h=0.75, mu=0.02, k=100.0)
    with pytest.raises(ValueError, match="give H > h"):
        ref.strip_rolling(R=65.0, H=0.75, h=0.75, mu=0.1, k=100.0)
