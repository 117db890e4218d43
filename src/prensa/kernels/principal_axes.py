"""Isotropic laws in principal strains: what wraps them, in plane and space, small and finite strain, generated.

Deformation gradients travel as h = f − I and left Cauchy-Green tensors as b − I, so strains of 1e-12 keep all their digits and
residuals converge to round-off at any load. Components are those of `prensa.kernels.algebra`. A frame (n, 13) is what is kept of
a trial state between strains and stresses: principal directions as columns of Q, row by row, principal values (3), J_n.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from prensa.kernels.algebra import (
    SPACE_AXES,
    UNIT,
    Tensor,
    by_transposed,
    cofactors,
    components,
    det_less_one,
    kept,
    product,
    push_forward,
    symmetric,
    tensor,
    times,
    total,
)
from prensa.kernels.emit import Kind, Marks, Program, Rows, Shared, puts
from prensa.kernels.functions import expm1, half_log1p
from prensa.kernels.machine_code import generated
from prensa.kernels.record import ZERO, Node, absolute, differs, given, lift, many, sqrt, where
from prensa.types import Array, Flags

FRAME = 13
SWEEPS = 6
"""Of Jacobi's method: what five leave is smaller than any rounding."""
NO_TENSOR = 1e-305
"""Size of a tensor, or of what a rotation would change of it over its size, that is none."""
COINCIDE = 1e-6
"""Difference of principal values, over the sum of all (its square: over one), below which the slope between them is its limit."""


def _is_zero(x: Node | float) -> bool:
    return x is ZERO or (isinstance(x, float) and x == 0.0)


def principal(b: Tensor) -> tuple[list[Node], Tensor]:
    """Eigenvalues of a symmetric tensor (9), in no order, and unit eigenvectors as columns of Q (9).

    Cyclic Jacobi (1846): eigenvalues within round-off of ‖b‖ and orthogonal directions however close they lie, which the
    trigonometric formula does not give. Rotations after Golub & Van Loan (2013, section 8.5). In the plane one is enough.
    """
    b, Q = list(b), [lift(x) for x in UNIT]
    size = total(absolute(x) for x in b if not _is_zero(x))
    by = 1.0 / where(size > NO_TENSOR, size, 1.0)
    for _ in range(SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            shear = b[3 * p + q]
            # Zeros of the graph, not of numbers: in the plane two shears are never there, and the third is one after its first
            # rotation.
            if _is_zero(shear):
                continue
            # the tangent of the angle; of b over its size, so that squares are numbers
            apart, twice = by * (b[4 * q] - b[4 * p]), 2.0 * by * shear
            both = absolute(apart) + sqrt(apart * apart + twice * twice)
            there = both > NO_TENSOR
            t = twice / where(there, both, 1.0)
            t = where(there, where(apart < 0.0, -t, t), 0.0)
            c = 1.0 / sqrt(t * t + 1.0)
            s = t * c
            # With c = 1 − s τ what a small rotation changes is added to a value: c x − s y would round off all of it.
            tau = s / (1.0 + c)
            b[4 * p], b[4 * q] = b[4 * p] - t * shear, b[4 * q] + t * shear
            b[3 * p + q] = b[3 * q + p] = ZERO
            r = 3 - p - q
            x, y = b[3 * r + p], b[3 * r + q]
            if not (_is_zero(x) and _is_zero(y)):
                b[3 * r + p] = b[3 * p + r] = x - s * (y + tau * x)
                b[3 * r + q] = b[3 * q + r] = y + s * (x - tau * y)
            for r in SPACE_AXES:
                x, y = Q[3 * r + p], Q[3 * r + q]
                Q[3 * r + p], Q[3 * r + q] = x - s * (y + tau * x), y + s * (x - tau * y)
    return [b[0], b[4], b[8]], Q


def composed(values: Sequence[Node], Q: Tensor) -> Tensor:
    """Σ_a values_a n_a ⊗ n_a."""
    return tuple(
        total(values[a] * Q[3 * i + a] * Q[3 * j + a] for a in SPACE_AXES) for i in SPACE_AXES for j in SPACE_AXES
    )


def moved(h: Tensor, old: Tensor, finite: bool) -> Tensor:
    """What a kept tensor (k) becomes by an increment if nothing flows: b − I of f b_n fᵀ, or ε_n + sym h; (9)."""
    H, was = tensor(h), symmetric(old)
    if finite:
        return push_forward(H, was)
    axes = SPACE_AXES
    return tuple(was[3 * i + j] + 0.5 * (H[3 * i + j] + H[3 * j + i]) for i in axes for j in axes)


def _sizes(full: int) -> int:
    """Components of symmetric tensors where others have so many."""
    return 6 if full == 9 else 4


@generated
def _trial(full: int, finite: bool) -> Program:
    k = _sizes(full)
    h, old, flag, one = many("h", full), many("old", k), given("failed", 0), lift(1.0)
    values, Q = principal(moved(h, old, finite))
    eps, jn, bad = values, one, flag
    if finite:
        good = (det_less_one(tensor(h)) > -1.0) & (values[0] > -1.0) & (values[1] > -1.0) & (values[2] > -1.0)
        good = good if full == 9 else good & (h[4] > -1.0)
        # Of a point that fails: the logarithm of what is no motion would be NaN in all that follows.
        values = [where(good, v, 0.0) for v in values]
        eps, jn, bad = [half_log1p(v) for v in values], sqrt(1.0 + det_less_one(symmetric(old))), flag | ~good
    written = [*puts("eps", eps), *puts("frame", [*Q, *values, jn]), *puts("failed", [bad])]
    arrays: dict[str, Kind] = {
        "h": Rows(full), "old": Rows(k), "eps": Rows(3), "frame": Rows(FRAME), "failed": Marks(),
    }  # fmt: skip
    return Program(arrays, written)


def trial(h: Array, old: Array, finite: bool, eps: Array, frame: Array, failed: Flags) -> None:
    """H (n, c) = f − I, old (n, ≥k): b_n − I or ε_n → principal trial strains eps (n, 3), frame (n, 13).

    In finite strain eps = ½ ln b of b = f b_n fᵀ (Simo 1992, Box 1). failed (n,) is set where f or b has no positive
    determinant; a small strain of any size is admissible.
    """
    _trial(h.shape[1], finite)(len(h), h, old, eps, frame, failed)


def _shear_slope(tau: Sequence[Node], D: Tensor, values: Sequence[Node], a: int, b: int, finite: bool) -> Node:
    """(τ_a − τ_b)/(b_a − b_b), by its limit where the eigenvalues coincide.

    The limit ½ (D_aa − D_ab − D_ba + D_bb)/(∂(b_a − b_b)/∂(ε_a − ε_b)) is symmetric in a and b, so that it errs by the square of
    b_a − b_b; the quotient errs by the round-off of the eigenvalues, which is that of the largest, over the difference.
    """
    apart = values[a] - values[b]
    size = absolute(values[0]) + absolute(values[1]) + absolute(values[2])
    alike = absolute(apart) <= COINCIDE * (size + COINCIDE)
    limit = 0.5 * (D[4 * a] - D[3 * a + b] - D[3 * b + a] + D[4 * b])
    rate = 2.0 + values[a] + values[b] if finite else 1.0
    return where(alike, limit / rate, (tau[a] - tau[b]) / where(alike, 1.0, apart))


@generated
def _stress(full: int, finite: bool, tangent: bool) -> Program:
    h, frame, tau, D, eps = many("h", full), many("frame", FRAME), many("tau", 3), many("dtau", 9), many("eps", 3)
    Q, values, jn = frame[:9], frame[9:12], frame[12]
    turned: Tensor = Q
    if full == 5:
        zero = lift(0.0)
        Q = turned = [Q[0], Q[1], zero, Q[3], Q[4], zero, zero, zero, lift(1.0)]
    by = 1.0 / jn if finite else lift(1.0)
    if finite:  # f⁻¹ Q
        f = tuple(x + one for x, one in zip(tensor(h), UNIT))
        c = cofactors(f)
        turned = product(times(1.0 / (f[0] * c[0] + f[1] * c[3] + f[2] * c[6]), c), Q)
    P = by_transposed([by * tau[a] * Q[3 * i + a] for i in SPACE_AXES for a in SPACE_AXES], turned)
    new = composed([expm1(2.0 * e) for e in eps] if finite else eps, Q)
    written = [*puts("P", components(P, h)), *puts("new", kept(new, range(_sizes(full))))]  # type: ignore[arg-type]
    if tangent:
        rows = [components(d, h) for d in _slopes(tau, D, values, Q, turned, by, finite)]
        columns = components(rows, h)  # type: ignore[arg-type]
        written += puts("A", [columns[m][k] for k in range(full) for m in range(full)])  # type: ignore[index]
    arrays: dict[str, Kind] = {
        "h": Rows(full), "frame": Rows(FRAME), "tau": Rows(3), "dtau": Rows(9), "eps": Rows(3), "P": Rows(full),
        "A": Rows(full**2), "new": Rows(_sizes(full)),
    }  # fmt: skip
    return Program(arrays, written)


def _slopes(
    tau: Sequence[Node], D: Tensor, values: Sequence[Node], Q: Tensor, T: Tensor, by: Node, finite: bool
) -> list[Tensor]:  # fmt: skip
    """∂P/∂f_kL (9) by each of the nine components.

    In principal axes dτ_aa = Σ_b D_ab l_bb, dτ_ab = s_ab (b_b l_ab + b_a l_ba) with l = df f⁻¹ and
    s_ab = (τ_a − τ_b)/(b_a − b_b), and dP = (dτ − τ lᵀ) f⁻ᵀ/J_n (Simo 1992; Miehe 1998; de Souza Neto, Perić & Owen 2008, ch. 14
    and appendix A); in small strain dσ_ab = ½ s_ab (l_ab + l_ba).
    """
    pairs = [(a, b) for a in SPACE_AXES for b in SPACE_AXES]
    slope = {(a, b): _shear_slope(tau, D, values, max(a, b), min(a, b), finite) for a, b in pairs if a != b}
    out = []
    for k, L in pairs:
        l = [Q[3 * k + a] * T[3 * L + b] for a, b in pairs]
        V = []
        for a, b in pairs:
            if a == b:
                change = total(D[3 * a + c] * l[4 * c] for c in SPACE_AXES)
            elif finite:
                change = slope[a, b] * ((1.0 + values[b]) * l[3 * a + b] + (1.0 + values[a]) * l[3 * b + a])
            else:
                change = 0.5 * slope[a, b] * (l[3 * a + b] + l[3 * b + a])
            V.append(by * (change - tau[a] * l[3 * b + a]) if finite else change)
        out.append(by_transposed(product(Q, V), T))
    return out


def stress(
    h: Array, frame: Array, tau: Array, dtau: Array, eps_e: Array, finite: bool, P: Array, A: Array, new: Array, tangent: bool
) -> None:  # fmt: skip
    """First Piola-Kirchhoff stress per committed volume and, if ``tangent``, its exact derivative, from principal stresses.

    h (n, c); frame (n, 13) of `trial`; tau (n, 3), dtau (n, 3, 3) = ∂τ/∂ε_trial, eps_e (n, 3) the elastic strains after the
    return → P (n, c) = τ f⁻ᵀ/J_n, A (n, c, c) = ∂P/∂f, new (n, ≥k): b_e − I or the elastic strain.
    """
    _stress(h.shape[1], finite, tangent)(len(h), h, frame, tau, dtau, eps_e, P, A, new)


@generated
def _elastic_strains(k: int, finite: bool) -> Program:
    values, _ = principal(symmetric(many("history", k)))
    if k == 4:
        larger = values[0] >= values[1]
        values = [where(larger, values[0], values[1]), where(larger, values[1], values[0]), values[2]]
    arrays: dict[str, Kind] = {"history": Rows(k), "eps": Rows(3)}
    return Program(arrays, puts("eps", [half_log1p(v) for v in values] if finite else values))


def elastic_strains(history: Array, components: int, finite: bool, eps: Array) -> None:
    """Principal strains eps (n, 3) of histories (n, ≥k), b_e − I (``finite``, logarithmic) or ε_e, of k components."""
    _elastic_strains(components, finite)(len(history), history, eps)


@generated
def _keep_trial(full: int, finite: bool) -> Program:
    k = _sizes(full)
    old, new = many("old", k + 1), many("new", k + 1)
    there = kept(moved(many("h", full), many("kept", k), finite), old[:k])
    flowed = differs(new[k], old[k])
    arrays: dict[str, Kind] = {
        "h": Rows(full), "old": Rows(k + 1), "kept": Rows(k), "new": Rows(k + 1), "trial": Rows(k),
    }  # fmt: skip
    return Program(arrays, puts("trial", [where(flowed, x, y) for x, y in zip(there, new)]))


def keep_trial(h: Array, old: Array, first: int, new: Array, finite: bool) -> None:
    """Elastic tensor that old tensors (columns ``first`` …) would have become if nothing had flowed → columns k + 2 … of new.

    h (n, c); old, new (n, ≥2k + 2) as in `prensa.materials.laws.J2`. Points whose plastic strain (column k) stayed keep what they
    are: in them nothing has flowed, and round-off is not to say otherwise.
    """
    k = _sizes(h.shape[1])
    _keep_trial(h.shape[1], finite)(len(h), h, old, old[:, first:], new, new[:, k + 2 :])


def _function(f: Callable[[Node], Node]) -> Callable[[Tensor], Tensor]:
    """The tensor function of a function of a number."""

    def of(b: Tensor) -> Tensor:
        values, Q = principal(symmetric(b))
        return kept(composed([f(v) for v in values], Q), b)

    return of


@generated
def _begin(k: int, finite: bool) -> Program:
    history, share = many("history", 2 * k + 2), given("share", 0)
    b, trial_ = history[:k], history[k + 2 :]
    still = [differs(x, y) for x, y in zip(b, trial_)]
    flowed = still[0]
    for one in still[1:]:
        flowed = flowed | one
    strain = _function(half_log1p) if finite else tuple
    e, d = strain(b), strain(trial_)
    D = [y - x for x, y in zip(e, d)]
    # Plastic flow keeps the volume: the trace of what flowed is round-off.
    third = (D[0] + D[1] + D[2]) / 3.0
    D = [D[0] - third, D[1] - third, D[2] - third, *D[3:]]
    size = total(x * x for x in D[:3]) + total(2.0 * x * x for x in D[3:])
    less = [x - share * y for x, y in zip(e, D)]
    new = _function(lambda x: expm1(2.0 * x))(less) if finite else less
    # √(2/3 D:D) is the equivalent plastic strain of that increment.
    out = [*(where(flowed, x, y) for x, y in zip(new, b)), history[k] + where(flowed, share * sqrt(size / 1.5), 0.0)]
    arrays: dict[str, Kind] = {
        "history": Rows(2 * k + 2), "share": Shared(), "out": Rows(k + 1), "trial": Rows(k),
    }  # fmt: skip
    return Program(arrays, [*puts("out", out), *puts("trial", b)])


def begin(history: Array, components: int, finite: bool, share: float, out: Array) -> None:
    """Elastic strains and plastic strain (columns 0 … k) after a ``share`` of the last increment's plastic strain more → out.

    history, out (n, ≥2k + 2) as in `prensa.materials.laws.J2`: that strain is what elastic and trial tensor differ by. The trial
    tensor of out is the elastic one of history. Of out no other column is written; points that did not flow stay as they are.
    """
    _begin(components, finite)(len(history), history, np.array([share]), out, out[:, components + 2 :])
