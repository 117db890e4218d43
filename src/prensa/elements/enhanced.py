"""Q4 and H8 with enhanced strains: internal modes of the deformation gradient that are solved for and condensed (EAS).

F = I + ∇u + F₀ B, B = Σ αᵢ Mᵢ (Simo & Armero 1992), with F₀ the gradient at the centroid and
M = (j₀ r₀/(j r)) j₀ J₀⁻ᵀ E J₀⁻¹, E in {ξ e₁e₁, ξ e₁e₂, η e₂e₁, η e₂e₂}: the transposed modes of Glaser & Armero (1997), which in
small strain are Wilson's (QM6) and which have no hourglass modes in elastic compression. In axisymmetry a fifth mode ξη of the
hoop stretch (Simo & Rifai 1990); elements for sheets have further modes P₂(η), P₃(η) … e₂e₂ (Legendre); in space E are the
nine ξ_I e_I e_J. ∫ M dV = 0, so constant stress is in equilibrium on any mesh (patch test). Modes are without a dimension, j₀
times those of the source (in space j₀^⅔ times), so that the stiffnesses of all can be held against each other.

The modes refer to the initial configuration, so that the answer does not depend on how many increments led to it: the
material is given f = F F_n⁻¹. Small strain: h = ∇u + B − (∇u + B)_n.

The kernels are generated from the point functions here and those of `prensa.elements.gradients`: forces are P : ∂F/∂(u, α) by the
reverse mode, stiffnesses their derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prensa.elements import shapes
from prensa.elements.form import Form
from prensa.elements.gradients import Gradients, dilatation, gradient, gradients
from prensa.kernels.algebra import by_transposed, cofactors, product
from prensa.kernels.algebra import total as sum_of
from prensa.kernels.differentiate import forward, reverse, units
from prensa.kernels.emit import Kind, Marks, Program, Rows, Shared, puts, total
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, absolute, answered, given, lift, local, many, power, where
from prensa.types import Array, Flags

MODES = {False: 4, True: 5}
"""Internal degrees of freedom of every enhanced element of the plane, by whether the problem is axisymmetric."""
SPACE_MODES = 9
"""The same of bricks: a coordinate times each of the three directions (Glaser and Armero 1997)."""
STRAIN_NOISE = 1e-2
"""Share of the moduli times the strains in what a zero of the modes' forces is made of: the round-off that strains come with."""


def numbers(table: shapes.Table, modes: int, axisymmetric: bool) -> Array:
    """Shape functions and weights at the points (`Table.rows`), then the shares of the modes there: (q, r + m)."""
    if table.at.shape[1] == 3:
        return np.concatenate([table.rows, np.repeat(table.at, 3, axis=1)], axis=1)
    xi, eta = table.at.T
    shares = [xi, xi, eta, eta, *([xi * eta] if axisymmetric else [])]
    legendre = [np.polynomial.Legendre.basis(2 + k)(eta) for k in range(modes - len(shares))]
    return np.concatenate([table.rows, np.stack([*shares, *legendre], axis=1)], axis=1)


class _Point(NamedTuple):
    """At a point: H = F − I, the increment h = f − I and the volume of its initial shape; J_n F_n⁻ᵀ by components."""

    H: list[Node]
    h: list[Node]
    volume: Node
    good: Node
    back: list[Node]


class _Element(NamedTuple):
    """What an element depends on, and a point of it."""

    u: list[Node]
    alpha: list[Node]
    point: _Point


def _modes(X: list[Node], g: Gradients, shares: list[Node], f: Form) -> tuple[list[list[Node]], Gradients]:
    """Modes (m, c) at a point, and the gradients at the centroid."""
    d, n, axes = f.dimension, f.nodes, range(f.dimension)
    centre = [lift(s) for s in shapes.centre(n, d)]
    g0 = gradients(X, centre, f.axisymmetric, d)
    J0 = [sum_of(X[d * a + i] * centre[n * (1 + k) + a] for a in range(n)) for k in axes for i in axes]
    c = cofactors(J0)
    det0 = sum_of(J0[k] * c[d * k] for k in axes)
    by_place = [[c[d * i + I] / det0 for i in axes] for I in axes]  # ∂ξ_I/∂X_i
    zero, scale = lift(0.0), g0.volume / g.volume
    size = det0 if d == 2 else power(det0, 2.0 / 3.0)
    out: list[list[Node]] = []
    for k in range(f.modes):
        I, J = (k // d, k % d) if k < d * d else (1, 1)
        if f.axisymmetric and k == 4:
            tensor = [zero, zero, zero, zero, lift(1.0)]
        else:
            tensor = [size * by_place[I][i] * by_place[J][j] for i in axes for j in axes] + [zero] * (d == 2)
        out.append([shares[k] * scale * c for c in tensor])
    return out, g0


def _record(f: Form) -> _Element:
    """An element with initial places X, displacements u and modes α at a point whose committed F − I is Hn."""
    X, u, alpha, Hn = many("X", f.dofs), many("u", f.dofs), many("alpha", f.modes), many("Hn", f.components)
    row = many("numbers", f.row + f.modes)
    g = gradients(X, row[: f.row - 1], f.axisymmetric, f.dimension)
    M, g0 = _modes(X, g, row[f.row :], f)
    B = [sum_of(a * m[c] for a, m in zip(alpha, M)) for c in range(f.components)]
    grad, still = gradient(u, g), [lift(0.0)] * f.components
    H = _enhanced(grad, gradient(u, g0) if f.finite else still, B)
    # (F − F_n) F_n⁻¹ and not F F_n⁻¹ − I: small increments keep all their digits.
    d = [x - y for x, y in zip(H, Hn)]
    volume = g.volume * row[f.row - 1] * given("scale", 0)
    if not f.finite:
        return _Element(u, alpha, _Point(H, d, volume, g.good, still))
    h, back = _since(d, Hn)
    good = g.good & (dilatation(H) > -1.0)
    if f.dimension == 2:
        good = good & (H[4] > -1.0)
    return _Element(u, alpha, _Point(H, h, volume, good, back))


def _enhanced(grad: Sequence[Node], H0: Sequence[Node], B: Sequence[Node]) -> list[Node]:
    """∇u + F₀ B of the gradient at the centroid F₀ = I + H₀."""
    if len(B) == 9:
        F0 = [1.0 + x if k in (0, 4, 8) else x for k, x in enumerate(H0)]
        return [x + y for x, y in zip(grad, product(F0, B))]
    F0 = [1.0 + H0[0], H0[1], H0[2], 1.0 + H0[3]]
    return [
        grad[0] + F0[0] * B[0] + F0[1] * B[2], grad[1] + F0[0] * B[1] + F0[1] * B[3],
        grad[2] + F0[2] * B[0] + F0[3] * B[2], grad[3] + F0[2] * B[1] + F0[3] * B[3], grad[4] + (1.0 + H0[4]) * B[4],
    ]  # fmt: skip


def _since(d: Sequence[Node], Hn: Sequence[Node]) -> tuple[list[Node], list[Node]]:
    """The increment (F − F_n) F_n⁻¹ of d = F − F_n, and J_n F_n⁻¹ (the plane: components and the determinant)."""
    if len(d) == 9:
        Fn = [1.0 + x if k in (0, 4, 8) else x for k, x in enumerate(Hn)]
        n = cofactors(Fn)
        det = sum_of(Fn[k] * n[3 * k] for k in range(3))
        return [x / det for x in product(d, n)], list(n)
    n = cofactors([1.0 + Hn[0], Hn[1], Hn[2], 1.0 + Hn[3]])  # det F_n⁻¹ in the plane, 11, 12, 21, 22
    det, n33 = n[0] * n[3] - n[1] * n[2], 1.0 + Hn[4]
    h = [
        (d[0] * n[0] + d[1] * n[2]) / det, (d[0] * n[1] + d[1] * n[3]) / det,
        (d[2] * n[0] + d[3] * n[2]) / det, (d[2] * n[1] + d[3] * n[3]) / det, d[4] / n33,
    ]  # fmt: skip
    return h, [x * n33 for x in n] + [det]


def _stress(f: Form, p: _Point) -> list[Node]:
    """Stress per initial volume, J_n P F_n⁻ᵀ, as it depends on H."""
    m = f.components
    P, A = many("P", m), many("A", m**2)
    s = [answered(P[k], p.h, A[m * k : m * (k + 1)]) for k in range(m)]
    if f.finite and f.dimension == 3:
        s = list(by_transposed(s, p.back))
    elif f.finite:
        n = p.back
        s = [
            s[0] * n[0] + s[1] * n[1], s[0] * n[2] + s[1] * n[3], s[2] * n[0] + s[3] * n[1], s[2] * n[2] + s[3] * n[3],
            s[4] * n[4],
        ]  # fmt: skip
    return local(s, p.H)


def _arrays(f: Form) -> dict[str, Kind]:
    tensor = Rows(f.components, points=True)
    return {
        "X": Rows(f.dofs), "u": Rows(f.dofs), "alpha": Rows(f.modes), "Hn": tensor, "numbers": Shared(f.row + f.modes),
        "scale": Shared(),
    }  # fmt: skip


def _answers(f: Form) -> dict[str, Kind]:
    return {"P": Rows(f.components, points=True), "A": Rows(f.components**2, points=True)}


class At(NamedTuple):
    """Elements: initial positions X, displacements u (k, a, d), modes alpha (k, m), committed F − I Hn (k, q, c).

    ``numbers`` (q, r + m): see `numbers`; ``scale``: thickness, or 2π in axisymmetry.
    """

    X: Array
    u: Array
    alpha: Array
    Hn: Array
    numbers: Array
    scale: float

    def arrays(self) -> tuple[Array, ...]:
        """As kernels take them."""
        return (*self[:-1], np.array([self.scale]))


@generated
def _kinematics(f: Form) -> Program:
    p = _record(f).point
    written = [*puts("H", p.H), *puts("h", p.h), *puts("w", [p.volume]), *puts("failed", [total(0) > 0.0])]
    tensor = Rows(f.components, points=True)
    arrays = _arrays(f) | {"H": tensor, "h": tensor, "w": Rows(1, points=True), "failed": Marks()}
    return Program(arrays, written, [where(p.good, 0.0, 1.0)], f.points)


def kinematics(f: Form, at: At, H: Array, h: Array, w: Array, failed: Flags) -> None:
    """→ H = F − I, h = f − I (k, q, c) with f = F F_n⁻¹, initial volumes w (k, q), failed (k,): det F ≤ 0 at a point."""
    _kinematics(f)(len(h), *at.arrays(), H, h, w, failed)


@generated
def _modes_left(f: Form) -> Program:
    e = _record(f)
    p, s = e.point, _stress(f, e.point)
    weighted = [x * p.volume for x in s]
    r = reverse(p.H, weighted, e.alpha)
    moduli, now = forward(s, units(p.H), f.components), many("Hn", f.components)
    size = sum_of(absolute(x) for x in s) + STRAIN_NOISE * sum_of(
        absolute(a) * (absolute(x) + absolute(y)) for row in moduli for a, x, y in zip(row, p.H, now)
    )
    by_modes = forward(p.H, units(e.alpha), f.modes)
    noise = [p.volume * size * sum_of(absolute(row[k]) for row in by_modes) for k in range(f.modes)]
    K = [k for row in forward(r, units(e.alpha), f.modes) for k in row]
    written = [
        *puts("r", map(total, range(f.modes))), *puts("noise", map(total, range(f.modes, 2 * f.modes))),
        *puts("K", map(total, range(2 * f.modes, (2 + f.modes) * f.modes))),
    ]  # fmt: skip
    arrays = _arrays(f) | _answers(f) | {"r": Rows(f.modes), "K": Rows(f.modes**2), "noise": Rows(f.modes)}
    return Program(arrays, written, [*r, *noise, *K], f.points)


def modes_left(f: Form, at: At, P: Array, A: Array, r: Array, K: Array, noise: Array) -> None:
    """P (k, q, c), A (k, q, c, c) of f → forces r (k, m) on the modes, for which they are sought, and K = ∂r/∂α (k, m, m).

    noise (k, m): stresses, and the round-off of moduli times strains now and as committed, that a zero of r is made of: a
    released body has no strains left, but the round-off of those it had.
    """
    _modes_left(f)(len(r), *at.arrays(), P, A, r, K, noise)


@generated
def _integrate(f: Form, stiffness: bool) -> Program:
    e, n = _record(f), f.dofs + f.modes
    r = reverse(e.point.H, [x * e.point.volume for x in _stress(f, e.point)], (*e.u, *e.alpha))
    sums = [*r, sum_of(absolute(x) for x in r[: f.dofs])]
    written = [*puts("r", map(total, range(n))), *puts("forces", [total(n)])]
    if stiffness:
        sums += [k for row in forward(r, units((*e.u, *e.alpha)), n) for k in row]
        written += puts("K", map(total, range(n + 1, len(sums))))
    arrays = _arrays(f) | _answers(f) | {"r": Rows(n), "K": Rows(n * n), "forces": Rows(1)}
    return Program(arrays, written, sums, f.points)


def integrate(f: Form, at: At, P: Array, A: Array, stiffness: bool, r: Array, K: Array, forces: Array) -> None:
    """P (k, q, c), A (k, q, c, c) of f → forces r (k, d a + m) on displacements and modes, forces (k,) = Σ |r| on displacements.

    For ``stiffness`` K = ∂r/∂(u, α) (k, d a + m, d a + m). forces is the sum before points cancel.
    """
    _integrate(f, stiffness)(len(r), *at.arrays(), P, A, r, K, forces)
