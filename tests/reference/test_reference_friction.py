"""Partial slip, slip hardening and the elementary friction problems."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from prensa.reference import (
    MuConstant,
    MuExponential,
    MuLinear,
    capstan,
    cattaneo_mindlin,
    circular_path_lag,
    flat_punch_stick,
    levanov,
    lubkin_torsion,
    sliding_wedge,
    slip_hardening,
    smooth_cap,
    stribeck,
    wang_osakada,
    wanheim_bay,
)

LAWS = [
    MuConstant(0.2),
    MuLinear(0.1, 0.5),
    MuLinear(0.3, -0.2),
    MuExponential(0.1, 0.3, 0.02),
    MuExponential(0.3, 0.1, 0.2),
]


def integral(found):
    theta = (np.arange(40_000) + 0.5) * np.pi / 40_000
    return np.sum(found.traction(found.a * np.cos(theta)) * found.a * np.sin(theta)) * np.pi / 40_000


def test_partial_slip_on_loading():
    """On loading the traction integrates to Q, equals mu p in the slip zones and stays below it in the stick zone."""
    found = cattaneo_mindlin(P=1000.0, a=5.0, mu=0.3, Q=180.0)
    assert found.c == pytest.approx(5.0 * math.sqrt(0.4))
    assert integral(found) == pytest.approx(180.0, rel=1e-6)
    x = np.linspace(-5.0, 5.0, 401)
    bound = found.mu * found.p0 * np.sqrt(1.0 - (x / 5.0) ** 2)
    slip = np.abs(x) > found.c
    assert found.traction(x)[slip] == pytest.approx(bound[slip], abs=1e-12)
    assert np.all(found.traction(x)[~slip] <= bound[~slip] + 1e-12)
    inside = bound - found.mu * found.p0 * found.c / 5.0 * np.sqrt(np.clip(1.0 - (x / found.c) ** 2, 0.0, None))
    assert found.traction(x) == pytest.approx(inside, abs=1e-12)


def test_stick_zone_does_not_stretch():
    """The traction produces no tangential strain in the stick zone: its finite Hilbert transform vanishes there."""
    found = cattaneo_mindlin(P=1000.0, a=5.0, mu=0.3, Q=180.0)
    edges = np.linspace(-5.0, 5.0, 200_001)
    s = 0.5 * (edges[1:] + edges[:-1])
    for x in edges[[70_000, 100_000, 128_000]]:  # midpoint rule symmetric about x: the principal value
        assert abs(np.sum(found.traction(s) / (x - s)) * (s[1] - s[0])) < 1e-3 * found.mu * found.p0


def test_partial_slip_on_unloading():
    """Unloading integrates to Q, slips backwards outside c', and full reversal mirrors the loaded state."""
    loaded = cattaneo_mindlin(P=1000.0, a=5.0, mu=0.3, Q=180.0)
    for Q in (120.0, 0.0, -90.0):
        found = cattaneo_mindlin(P=1000.0, a=5.0, mu=0.3, Q=Q, Q_max=180.0)
        assert integral(found) == pytest.approx(Q, abs=1e-3)
        assert found.c_reversed == pytest.approx(5.0 * math.sqrt(1.0 - (180.0 - Q) / 600.0))
        x = np.linspace(found.c_reversed, 5.0, 50)
        assert found.traction(x) == pytest.approx(-found.mu * found.p0 * np.sqrt(1.0 - (x / 5.0) ** 2), abs=1e-9)
    x = np.linspace(-5.0, 5.0, 101)
    mirrored = cattaneo_mindlin(P=1000.0, a=5.0, mu=0.3, Q=-180.0, Q_max=180.0)
    assert mirrored.traction(x) == pytest.approx(-loaded.traction(x), abs=1e-12)
    same = cattaneo_mindlin(P=1000.0, a=5.0, mu=0.3, Q=180.0, Q_max=180.0)
    assert same.traction(x) == pytest.approx(loaded.traction(x), abs=1e-12)


def test_a_twisted_sphere_sticks_inside_and_slips_outside():
    """Moments of full stick and full slip, Deresiewicz's expansion for small twists, values of an independent program."""
    given = {"P": 20.0, "a": 0.51488576, "mu": 0.3, "G": 1000.0 / 2.6}
    a, whole = given["a"], 0.3 * 20.0 * 0.51488576
    stuck, slipped = lubkin_torsion(**given, c=a * (1.0 - 1e-6)), lubkin_torsion(**given, c=1e-6 * a)
    assert stuck.moment == pytest.approx(16.0 / 3.0 * given["G"] * a**3 * stuck.twist, rel=1e-5)
    assert slipped.moment == pytest.approx(3.0 * np.pi / 16.0 * whole, rel=1e-9)
    for c, twist, moment in ((0.95, 0.0011176568, 0.29014849), (0.5, 0.013281808, 1.6329374), (0.2, 0.027612875, 1.8089252)):
        found = lubkin_torsion(**given, c=c * a)
        assert (found.twist, found.moment) == pytest.approx((twist, moment), rel=1e-6)
    for c, within in ((0.99, 2e-4), (0.95, 4e-3)):
        found = lubkin_torsion(**given, c=c * a)
        root = math.sqrt(1.0 - 1.5 * found.moment / whole)
        assert given["G"] * a**2 * found.twist / (0.3 * 20.0) == pytest.approx((1.0 - root) * (3.0 - root) / 8.0, rel=within)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_monotone_slip_satisfies_its_equations(law):
    """On monotone sliding t + k_T kappa = k_T u and t = mu(kappa) p hold to round-off; before, the point sticks."""
    p, k_T = 50.0, 1000.0
    u = np.linspace(0.0, 0.5, 101)[1:]
    t, kappa = slip_hardening(u, p=p, k_T=k_T, law=law)
    assert t + k_T * kappa == pytest.approx(k_T * u, rel=1e-12)
    sliding = kappa > 0.0
    assert sliding.any() and not sliding.all()
    assert t[sliding] == pytest.approx([law(k) * p for k in kappa[sliding]], rel=1e-12)
    assert t[~sliding] == pytest.approx(k_T * u[~sliding])


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_stroke_can_be_split(law):
    """Splitting each stroke of a path with reversals into small pieces leaves the states at the turns unchanged."""
    turns = np.array([0.2, -0.1, 0.15, 0.15, -0.3])
    t, kappa = slip_hardening(turns, p=50.0, k_T=1000.0, law=law)
    fine = np.concatenate([np.linspace(a, b, 38)[1:] for a, b in zip(np.r_[0.0, turns], turns)])
    t_fine, kappa_fine = slip_hardening(fine, p=50.0, k_T=1000.0, law=law)
    assert t_fine[36::37] == pytest.approx(t, rel=1e-11)
    assert kappa_fine[36::37] == pytest.approx(kappa, rel=1e-11)


def test_hardening_follows_the_path_and_not_the_net_slip():
    """After a full cycle back to zero net slip the friction coefficient has grown, and kappa never decreases."""
    law = MuExponential(0.1, 0.3, 0.2)
    t, kappa = slip_hardening([0.1, -0.1, 0.1, -0.1], p=50.0, k_T=1e4, law=law)
    assert np.all(np.diff(kappa) > 0.0)
    assert np.all(np.diff(np.abs(t)) > 0.0)
    assert np.sign(t) == pytest.approx([1, -1, 1, -1])
    # Each reversal gives back the elastic slip of both directions before it slides.
    assert kappa[1] - kappa[0] == pytest.approx(0.2 - (abs(t[0]) + abs(t[1])) / 1e4, rel=1e-12)


def test_exponential_tends_to_linear_and_does_not_overflow():
    """A long decay length gives the linear law; a very short one at high pressure gives mu_inf without overflow."""
    u = np.linspace(0.01, 0.3, 20)
    slow = slip_hardening(u, p=50.0, k_T=1000.0, law=MuExponential(0.1, 0.1 + 1e6 * 0.5, 1e6))[0]
    assert slow == pytest.approx(slip_hardening(u, p=50.0, k_T=1000.0, law=MuLinear(0.1, 0.5))[0], rel=1e-6)
    fast = slip_hardening(100.0, p=1e4, k_T=1000.0, law=MuExponential(0.1, 0.3, 1e-6))[0]
    assert fast == pytest.approx([3000.0], rel=1e-9)


def test_sliding_wedge():
    """The wedge gives the published 0.412371 and the same number as the sum of angles."""
    assert sliding_wedge(math.atan(0.1), 0.3) == pytest.approx(0.412371, abs=5e-7)
    assert sliding_wedge(0.2, 0.4) == pytest.approx(math.tan(0.2 + math.atan(0.4)), rel=1e-13)


def test_circular_path_lag():
    """A slider dragged round a circle in small steps settles at the lag of the closed form."""
    mu, p, k_T, rho = 0.3, 50.0, 1000.0, 0.05
    phi = circular_path_lag(mu=mu, p=p, k_T=k_T, rho=rho)
    assert math.sin(phi) == pytest.approx(0.3)
    slider = np.array([rho, 0.0])
    for angle in np.linspace(0.0, 6.0 * np.pi, 30_001):
        at = rho * np.array([math.cos(angle), math.sin(angle)])
        stretch = at - slider
        length = math.hypot(*stretch)
        slider = at - stretch * min(1.0, mu * p / k_T / length) if length > 0.0 else slider
    pull, forward = at - slider, np.array([-at[1], at[0]])
    lag = math.acos(pull @ forward / np.linalg.norm(pull) / np.linalg.norm(forward))
    assert lag == pytest.approx(phi, rel=2e-3)


def test_capstan_and_wang_osakada():
    """The rope law holds for half a turn; the friction law of Wang & Osakada gives its quoted numbers."""
    assert capstan(10.0, 0.3, math.pi) == pytest.approx(10.0 * math.exp(0.3 * math.pi))
    m, p_cr = wang_osakada(0.1)
    assert m == pytest.approx(0.4534, abs=1e-4)
    assert p_cr == pytest.approx(2.634, abs=5e-4)


def test_laws_of_forming_have_the_limits_of_their_sources():
    """Coulomb at low, a shear factor at high pressure; frictionless asperities touch on half the area at p = (1 + π/2) k."""
    k = 50.0
    low, high = 1e-6 * k, 1e3 * k
    # f → 0: half of the surface touches where the fields of neighbours meet, at the mean pressure of Prandtl's punch, (2 + π) k
    f = 1e-9
    assert wanheim_bay((1.0 + 0.5 * math.pi) * k, k, f) == pytest.approx(0.5 * f * k, rel=1e-6)
    # f = 1: asperities yield at (1 + π/2) k in all of the area, beyond which the surface sticks
    assert wanheim_bay(0.999 * (1.0 + 0.5 * math.pi) * k, k, 1.0) == pytest.approx(0.999 * k)
    assert wanheim_bay(high, k, 1.0) == pytest.approx(k)
    for f in (0.1, 0.5, 0.9):
        assert wanheim_bay(high, k, f) == pytest.approx(f * k)
        p = np.linspace(0.0, 20.0 * k, 4001)
        slope = np.diff([wanheim_bay(float(x), k, f) for x in p]) / np.diff(p)
        assert (np.diff(slope) < 1e-12).all()  # concave: the branches meet without a corner
    assert levanov(low, 100.0, 0.4) / low == pytest.approx(0.4 * 1.25 / math.sqrt(3.0), rel=1e-5)
    assert levanov(high, 100.0, 0.4) == pytest.approx(0.4 * 100.0 / math.sqrt(3.0))
    assert smooth_cap(low, k, 0.3, 0.5, 1.0) / low == pytest.approx(0.3, rel=1e-5)
    assert smooth_cap(high, k, 0.3, 0.5, 1.0) == pytest.approx(0.5 * k)
    assert smooth_cap(0.5 * k / 0.3, k, 0.3, 0.5, 50.0) == pytest.approx(0.5 * k, rel=0.02)  # sharp in the limit
    assert stribeck(0.0, static=0.3, kinetic=0.1, speed=2.0) == 0.3
    assert stribeck(100.0, static=0.3, kinetic=0.1, speed=2.0) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("Q", lambda: cattaneo_mindlin(P=1.0, a=1.0, mu=0.3, Q=0.31)),
        ("Q", lambda: cattaneo_mindlin(P=1.0, a=1.0, mu=0.3, Q=0.2, Q_max=0.1)),
        ("c", lambda: lubkin_torsion(P=1.0, a=1.0, mu=0.3, G=1.0, c=1.1)),
        ("Q_max", lambda: cattaneo_mindlin(P=1.0, a=1.0, mu=0.3, Q=0.2, Q_max=0.4)),
        ("k_T", lambda: slip_hardening(1.0, p=50.0, k_T=5.0, law=MuLinear(0.3, -0.2))),
        ("k_T", lambda: slip_hardening(1.0, p=50.0, k_T=5.0, law=MuExponential(0.3, 0.1, 0.02))),
        ("law", lambda: slip_hardening(9.0, p=50.0, k_T=50.0, law=MuLinear(0.3, -0.2))),
        ("u0", lambda: slip_hardening(1.0, p=50.0, k_T=5.0, law=MuExponential(0.1, 0.3, 0.0))),
        ("mu", lambda: sliding_wedge(1.0, 0.9)),
        ("alpha", lambda: sliding_wedge(10.0, 0.1)),
        ("rho", lambda: circular_path_lag(mu=0.3, p=50.0, k_T=1000.0, rho=0.015)),
        ("T1", lambda: capstan(-1.0, 0.1, 1.0)),
        ("mu", lambda: wang_osakada(0.5)),
        ("f", lambda: wanheim_bay(1.0, 1.0, 1.5)),
        ("sigma", lambda: levanov(1.0, 0.0, 0.5)),
        ("n", lambda: smooth_cap(1.0, 1.0, 0.1, 0.5, 0.0)),
        ("speed", lambda: stribeck(1.0, static=0.2, kinetic=0.1, speed=0.0)),
    ],
)
def test_errors_name_the_argument(name, call):
    """A senseless argument is refused by name."""
    with pytest.raises(ValueError, match=f"^{name} = "):
        call()


# --- flat punch ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.4, 0.7, 1.2])
def test_the_stick_zone_of_a_flat_punch_without_coupling_has_a_closed_form(ratio):
    """K'(c)/K(c) = beta/mu where friction does not change the pressure, that is, for mu/beta fixed and nu close to 1/2.

    With p = p0/sqrt(1 - x^2) the traction of |x| < c is bounded at its ends if int f/sqrt(c^2 - x^2) dx = 0 over it, with
    f/p0 = beta/sqrt(1 - x^2) + mu/pi int sgn(s)/((x - s) sqrt(1 - s^2)) ds, c < |s| < 1; the terms give 2 beta K(c) and
    -2 mu K'(c).
    """
    nu = 0.4999
    beta = (1 - 2 * nu) / (2 * (1 - nu))
    exact = brentq(lambda c: ellipk(1 - c * c) / ellipk(c * c) - 1 / ratio, 1e-9, 1 - 1e-12)
    assert flat_punch_stick(ratio * beta, nu) == pytest.approx(exact, abs=1e-3)


def test_the_stick_zone_of_a_flat_punch_does_not_hang_on_its_cells():
    """Twice the cells change it by less than 1e-3; more friction makes it larger, more compressibility smaller."""
    c = flat_punch_stick(0.2, 0.3)
    assert flat_punch_stick(0.2, 0.3, 600) == pytest.approx(c, abs=1e-3)
    assert flat_punch_stick(0.3, 0.3) > c > flat_punch_stick(0.2, 0.2)


@pytest.mark.parametrize(
    ("mu", "nu", "words"), [(0.0, 0.3, "mu"), (0.2, 0.5, "nothing slides"), (0.01, 0.0, "stick zone is smaller")]
)
def test_a_flat_punch_without_an_edge_of_stick_is_refused(mu, nu, words):
    """No friction, no slip, or a zone below the cells: each is said."""
    with pytest.raises(ValueError, match=words):
        flat_punch_stick(mu, nu)
