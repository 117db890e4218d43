"""Hencky's elasticity with J2 plasticity for one point, in textbook order: finite strain in the plane, small strain in space too.

The left Cauchy-Green tensor is pushed forward, its logarithm is the trial strain, and the return map of small strain follows
(Simo 1992; de Souza Neto, Perić and Owen 2008, Box 14.3). Strains are ½ ln b = mean + artanh(√s)/√s deviator, analytic in s: no
principal axes, so nothing to divide by where two strains are alike. Tensors travel less one, b − I and h = f − I, in the order of
histories: 11, 22, 33, 12, and gradients 11, 12, 21, 22, 33.

All numbers may be recorded ones or arrays (see `prensa.kernels.record`); nothing here knows of tangents and directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from prensa.kernels import algebra
from prensa.kernels.differentiate import slope_of
from prensa.kernels.functions import artanh_ratio, cosh_less_one, expm1, half_log1p, sinh_ratio
from prensa.kernels.record import Node, damped, differs, exp, local, one_like, root, sqrt, where
from prensa.materials.hardening import SHIFT_BEGUN, SHIFT_COMMITTED, Curve

Tensor = Sequence[Node]

ON_SURFACE = 1e-11  # of the trial stress: beyond the yield surface by less is on it
NO_STRAIN = 1e-60  # square of a strain that divides nothing by zero
STEEP_SLOPE = 10.0 / 3.0  # of a curve's slope over 3G, from which on its expansion says nothing of the root


def push_forward(h: Tensor, b: Tensor) -> tuple[Node, Node, Node, Node]:
    """F b fᵀ."""
    h11, h12, h21, h22, h33 = h
    b11, b22, b33, b12 = b
    m11, m12 = b11 + h11 * (1.0 + b11) + h12 * b12, b12 + h11 * b12 + h12 * (1.0 + b22)
    m21, m22 = b12 + h21 * (1.0 + b11) + h22 * b12, b22 + h21 * b12 + h22 * (1.0 + b22)
    return (
        m11 + (1.0 + m11) * h11 + m12 * h12, m22 + m21 * h21 + (1.0 + m22) * h22,
        b33 + (1.0 + b33) * (2.0 * h33 + h33 * h33), m12 + (1.0 + m11) * h21 + m12 * h22,
    )  # fmt: skip


def logarithm(b: Tensor) -> tuple[Node, Node, Node, Node]:
    """½ ln b."""
    b11, b22, b33, b12 = b
    mean, half = 0.5 * (b11 + b22), 0.5 * (b11 - b22)
    square = half * half + b12 * b12
    by = 1.0 / (1.0 + mean)
    scale = 0.5 * artanh_ratio(square * by * by) * by
    # A quarter of the logarithm of the determinant in the plane, the mean of both principal strains.
    middle = 0.5 * half_log1p(2.0 * mean + mean * mean - square)
    return middle + scale * half, middle - scale * half, half_log1p(b33), scale * b12


def exponential(e: Tensor) -> tuple[Node, Node, Node, Node]:
    """Exp 2e."""
    e11, e22, e33, e12 = e
    mean, half, shear = e11 + e22, e11 - e22, 2.0 * e12
    square = half * half + shear * shear
    m = expm1(mean)
    middle, by = m + (1.0 + m) * cosh_less_one(square), (1.0 + m) * sinh_ratio(square)
    return middle + by * half, middle - by * half, expm1(2.0 * e33), by * shear


def determinant(b: Tensor) -> Node:
    """Det b of a symmetric tensor."""
    b11, b22, b33, b12 = b
    return ((1.0 + b11) * (1.0 + b22) - b12 * b12) * (1.0 + b33)


def square(e: Tensor) -> Node:
    """E : e."""
    found = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
    for shear in e[3:]:
        found = found + 2.0 * shear * shear
    return found


class Metal(NamedTuple):
    """Bulk and shear modulus; of metals that flow the curve, whether it limits the Cauchy stress, the seconds of an increment.

    ``share`` of what the tangent knows of flow that turns with the strain, see `At.secant`.
    """

    K: Node
    G: Node
    curve: Curve | None = None
    cauchy: bool = True
    dt: Node = 0.0  # type: ignore[assignment]
    share: Node = 1.0  # type: ignore[assignment]


class Begun(NamedTuple):
    """What a point's increment begins with: b_e, plastic strain and work, and b_e as it goes on if nothing flows."""

    b: Tensor
    strain: Node
    work: Node
    kept: Tensor


class Flows(NamedTuple):
    """Which points flow, if it is not their trial stress that decides, and by how much, if that is known."""

    active: Node
    by: Node | None = None


class Answer(NamedTuple):
    """Kirchhoff stress τ and the history: b_e, and of metals that flow the strain, the work, the trial tensor."""

    stress: tuple[Node, Node, Node, Node]
    history: tuple[Node, ...]
    elastic: tuple[Node, Node, Node, Node]
    trial: Tensor


def return_map(q: Node, J: Node, strain: Node, metal: Metal, flows: Flows | None = None) -> Node:
    """Rise of the plastic strain: the root Δ of q − 3GΔ − J σ_y(ε̄ + Δ) of points beyond their yield surface, else 0."""
    curve, G = metal.curve, metal.G
    assert curve is not None
    over = q - J * curve.at_rest(strain)
    high = q / (3.0 * G)
    if flows is None or flows.by is None:
        # as the curve goes on with its slope and curvature, where those say something
        slope, curvature = slope_of(lambda d: J * curve.stress(strain + d, d, metal.dt), 0.0 * strain)
        whole, half = 3.0 * G + slope, over / (6.0 * G)
        begin = whole * whole + 0.5 * curvature * over
        halley = over * whole / begin
        good = (whole < (1.0 + STEEP_SLOPE) * 3.0 * G) & (halley > 0.0) & (halley < 2.0 * half)
        # Below the surface only a point flows that is made to (derivatives, remeshing): it flows back, and its root is
        # negative.
        start = where(over > 0.0, where(good, halley, half), -1e-3 * high)
    else:
        start = flows.by
    active = over > ON_SURFACE * q if flows is None else flows.active
    below = start < 0.0

    def beyond(d: Node, q: Node, J: Node, strain: Node, G: Node, dt: Node, *p: Node) -> Node:
        return q - 3.0 * G * d - J * curve._replace(p=p).stress(strain + d, d, dt)

    return root(
        beyond, active, start, where(below, -high, 0.0), where(below, 0.0, high), q, q, J, strain, G, metal.dt, *curve.p,
        smooth=curve.smooth,
    )  # fmt: skip


class _Returned(NamedTuple):
    """Of a trial strain: its trace, deviator and what of it stays, the elastic strain, the rise of the plastic strain, and the
    flow stress at the strain as it was and is, both at the rate of the increment.
    """

    trace: Node
    deviator: list[Node]
    less: Node
    elastic: list[Node]
    rise: Node
    was: Node
    now: Node


def _returned(e: Tensor, J: Node, strain: Node, metal: Metal, flows: Flows | None) -> _Returned:
    """The radial return on a trial strain e, of three normal and any shear components."""
    G, curve = metal.G, metal.curve
    assert curve is not None
    trace = e[0] + e[1] + e[2]
    third = trace / 3.0
    d = [x - third for x in e[:3]] + list(e[3:])
    q = 2.0 * G * sqrt(1.5 * square(d) + NO_STRAIN)
    rise = return_map(q, J, strain, metal, flows)
    less = 1.0 - 3.0 * G * rise / q
    elastic = [third + less * x for x in d[:3]] + [less * x for x in d[3:]]
    # at the rate of the increment: what a point that is strained faster bears from its beginning on is part of the work
    was = curve.stress(strain, rise, metal.dt, SHIFT_BEGUN)
    now = where(differs(rise, 0.0), (q - 3.0 * G * rise) / J, was)  # by the equation that the rise solves
    return _Returned(trace, d, less, elastic, rise, was, now)


def small_j2(h: Tensor, old: Begun, metal: Metal, flows: Flows | None = None) -> tuple[Tensor, Tensor]:
    """The law of small strain, in plane and space: stress and history, in both of which b is the elastic strain."""

    def moved_by(was: Tensor) -> tuple[Node, ...]:
        H, e = algebra.tensor(h), algebra.symmetric(was)
        axes = algebra.SPACE_AXES
        return algebra.kept([e[3 * i + j] + 0.5 * (H[3 * i + j] + H[3 * j + i]) for i in axes for j in axes], was)

    r = _returned(moved_by(old.b), one_like(old.strain), old.strain, metal, flows)
    flowed = differs(r.rise, 0.0)
    # Without flow trial and elastic strains are the same to the last bit, by which `begin` knows that nothing flowed.
    kept = [where(flowed, x, y) for x, y in zip(moved_by(old.kept), r.elastic)]
    two, p = 2.0 * metal.G * damped(r.less, metal.share), metal.K * r.trace
    stress = [two * x + p for x in r.deviator[:3]] + [two * x for x in r.deviator[3:]]
    work = old.work + 0.5 * (r.was + r.now) * r.rise
    return algebra.components(algebra.symmetric(stress), h), (*r.elastic, old.strain + r.rise, work, *kept)


def hencky_j2(h: Tensor, old: Begun, metal: Metal, flows: Flows | None = None) -> Answer:
    """The law of a point whose gradient of the increment is h."""
    K, G = metal.K, metal.G
    t = push_forward(h, old.b)
    e = logarithm(t)
    if metal.curve is None:
        trace = e[0] + e[1] + e[2]
        third = trace / 3.0
        d, elastic, two, history = [e[0] - third, e[1] - third, e[2] - third, e[3]], list(e), 2.0 * G, tuple(t)
    else:
        one = one_like(e[0])
        J, Jn = (sqrt(determinant(t)), sqrt(determinant(old.b))) if metal.cauchy else (one, one)
        r = _returned(e, J, old.strain, metal, flows)
        moved = differs(r.rise, 0.0)
        # Where nothing flowed the trial tensor itself, not the exponential of its logarithm: elastic states collect no
        # round-off, and equal bits say in `begin` that nothing flowed.
        new = [where(moved, x, y) for x, y in zip(exponential(r.elastic), t)]
        kept = [where(moved, x, y) for x, y in zip(push_forward(h, old.kept), new)]
        # Trapezoid: at the end's flow stress alone the plastic work would err by the first order of the increment.
        history = (*new, old.strain + r.rise, old.work + 0.5 * (Jn * r.was + J * r.now) * r.rise, *kept)
        trace, d, elastic, two = r.trace, r.deviator, r.elastic, 2.0 * G * damped(r.less, metal.share)
    p = K * trace
    stress = (two * d[0] + p, two * d[1] + p, two * d[2] + p, two * d[3])
    # Local in t: the 4 × 4 slopes of the return map come once, then the chain rule of the push-forward.
    return Answer(tuple(local(stress, t)), tuple(history), tuple(elastic), t)  # type: ignore[arg-type]


def stored_energy(a: Answer, metal: Metal) -> Node:
    """Elastic energy per initial volume."""
    trace = a.elastic[0] + a.elastic[1] + a.elastic[2]
    return (0.5 * metal.K - metal.G / 3.0) * trace * trace + metal.G * square(a.elastic)


def first_piola(h: Tensor, stress: Sequence[Node], by: Node) -> tuple[Node, ...]:
    """By τ f⁻ᵀ, as 11, 12, 21, 22, 33; by: one over the volume that the Kirchhoff stress is of."""
    f11, f12, f21, f22, f33 = 1.0 + h[0], h[1], h[2], 1.0 + h[3], 1.0 + h[4]
    s11, s22, s33, s12 = stress
    plane = by / (f11 * f22 - f12 * f21)
    return (
        (s11 * f22 - s12 * f12) * plane, (s12 * f11 - s11 * f21) * plane, (s12 * f22 - s22 * f12) * plane,
        (s22 * f11 - s12 * f21) * plane, s33 * by / f33,
    )  # fmt: skip


def begin(old: Sequence[Node], share: Node, metal: Metal) -> tuple[Node, ...]:
    """A history after a ``share`` of the last plastic strain more: what b_e and the trial tensor of the last increment differ by.

    Its trial tensor is the committed b_e; points that did not flow stay as they are.
    """
    b, strain, work, trial = old[:4], old[4], old[5], old[6:10]
    assert metal.curve is not None
    moved = differs(b[0], trial[0]) | differs(b[1], trial[1]) | differs(b[2], trial[2]) | differs(b[3], trial[3])
    e = logarithm(b)
    D = [y - x for x, y in zip(e, logarithm(trial))]
    third = (D[0] + D[1] + D[2]) / 3.0
    D = [D[0] - third, D[1] - third, D[2] - third, D[3]]
    more = where(moved, share * sqrt(square(D) / 1.5 + NO_STRAIN), 0.0)
    new = exponential([x - share * y for x, y in zip(e, D)])
    J = sqrt(determinant(b)) if metal.cauchy else 1.0
    # The flow stress of the last increment's rate is that of its end, which the curve at rest would leave out.
    mean = (e[0] + e[1] + e[2]) / 3.0
    flow = 2.0 * metal.G * sqrt(1.5 * square([e[0] - mean, e[1] - mean, e[2] - mean, e[3]]) + NO_STRAIN)
    growth = metal.curve.at_rest(strain + more, SHIFT_BEGUN) - metal.curve.at_rest(strain, SHIFT_COMMITTED)
    spent = where(moved, (flow + 0.5 * J * growth) * more, 0.0)
    return (*(where(moved, x, y) for x, y in zip(new, b)), strain + more, work + spent, *b)


def return_in_principal_axes(
    e: Sequence[Node], Jn: Node, strain: Node, work: Node, metal: Metal, flows: Flows | None = None
) -> tuple[list[Node], list[Node], Node, Node]:  # fmt: skip
    """The return map alone: principal trial strains → principal stresses, elastic strains, plastic strain and work."""
    K, G = metal.K, metal.G
    J = exp(e[0] + e[1] + e[2]) if metal.cauchy else one_like(e[0])
    r = _returned(e, J, strain, metal, flows)
    two = 2.0 * G * damped(r.less, metal.share)
    return (
        [two * x + K * r.trace for x in r.deviator], r.elastic, strain + r.rise,
        work + 0.5 * ((Jn if metal.cauchy else 1.0) * r.was + J * r.now) * r.rise,
    )  # fmt: skip
