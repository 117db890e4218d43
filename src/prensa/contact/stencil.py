"""Contact stencils: what a contact point and its master are to the forces, and the one loop that assembles them.

A stencil has nodes j with coefficients c_j: the slave's nodes with N_a, then the master's with −M_b; of a rigid tool the master
is its reference point, a node with −1, and its rotation acts through the arm from there to the point. With the frame (n, e_a),
the pressure p and the tractions t_a of the point

    force f = w p n + a t_a e_a,    on node j: c_j f,    moment on a turning master: −arm × f,
    df = w dp n + a dt_a e_a + Ω × f,    p = p(g), t_a = t_a(s_a, p).

So all that a kind of master has to give is the gap g, the ways s_a along the tangents, their derivatives by the unknowns q, and
the spin Ω of the frame. Rigid tools, faces of bodies and planes of symmetry, in two and three dimensions, differ in nothing else.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.kernels.compiled import njit
from prensa.types import Array, Index

DIMENSION = {2: (0.0, 0.0), 3: (0.0, 0.0, 0.0)}
"""Arguments ``dim`` of kernels: the length of a tuple belongs to its type, so that bounds of loops are constants to Numba."""


class Stencils(NamedTuple):
    """k stencils of one kind in d dimensions: t = d − 1 tangents, j nodes, m unknowns q, w = 1 or 3 rotations.

    The unknowns are the d displacements of each node, then the w rotations of a master that turns.

    dofs (k, m): their places among all; coef (k, j): of the slave's nodes, and −M_b of the master's. The reference point of a
    master that turns is the last node.
    g (k,) gap, s (k, t) surface coordinates, n (k, d) normal outward from the master, e (k, t, d) tangents.
    dg (k, m), ds (k, t, m): derivatives by q; turn (k, w, m): spin of the frame n, e in space by q.
    arm (k, d): from the reference point of a master that turns, where it is now; ``moving``: whether the arm moves with the
    slave's nodes, as it does where forces act at their place and not at that in the undeformed body.
    dcoef (k, j, m): derivatives of the coefficients, None where these stay.
    kept (k, t, d): tangents that committed tractions are kept along, None: e.
    area (k,): that pressures and tractions belong to, if it moves with the nodes as the coefficients do; None: it is the points'.
    """

    dofs: Index
    coef: Array
    g: Array
    s: Array
    n: Array
    e: Array
    dg: Array
    ds: Array
    turn: Array
    arm: Array
    moving: bool
    dcoef: Array | None = None
    kept: Array | None = None
    area: Array | None = None

    def act(self, f: Array) -> Array:
        """Generalised forces (k, m) on the unknowns of forces f (k, d) on the slave, and of their opposites on the master."""
        out = np.empty(self.dg.shape)
        _act(DIMENSION[f.shape[1]], self.coef, self.arm, f, out)
        return out

    def to_keep(self, t: Array) -> Array:
        """Components (k, t) along the tangents e as they are committed."""
        return t if self.kept is None else np.asarray(np.einsum("ka,kai,kbi->kb", t, self.e, self.kept))

    def linear_gap(self, step: Array) -> Array:
        """Gaps (k,) after a step (ndof,) by the linear model."""
        return np.asarray(self.g + (self.dg * step[self.dofs]).sum(axis=1))


class Response(NamedTuple):
    """What the points' law says: pressures p (k,), tractions t (k, t) along the tangents and their derivatives.

    by_gap (k,): slope of the pressure, −∂p/∂g over k_n; by_p (k, t), by_way (k, t, t): derivatives of t by the pressure and by
    the ways s; k_n, k_t (k,) stiffnesses per area; weight, area (k,) that p and t belong to.
    """

    p: Array
    t: Array
    by_gap: Array
    by_p: Array
    by_way: Array
    k_n: Array
    k_t: Array
    weight: Array
    area: Array


class Assembled(NamedTuple):
    """Forces F (k, m) on the unknowns, K (k, m, m) = −∂F/∂q, dp (k, 1 + t + m) and dt (k, t, 1 + t + m) by λ_n, λ_T and q.

    acting (2, k, d): forces on the bodies at the points, and those of a unit of pressure with the friction that follows it.
    """

    F: Array
    K: Array
    dp: Array
    dt: Array
    acting: Array


def assemble(x: Stencils, law: Response, turning: tuple[Array, Array]) -> Assembled:
    """Forces of stencils under a law, and their stiffness.

    ``turning``: pressures (k,) and tractions (k, t) that turn with the frame. Those of the law make the stiffness exact.
    """
    k, m = x.dg.shape
    d = law.t.shape[1] + 1
    F, K = np.empty((k, m)), np.empty((k, m, m))
    dp, dt = np.empty((k, d + m)), np.empty((k, d - 1, d + m))
    A, B = np.zeros((2, d, 2 * d - 3))
    acting = np.empty((2, k, d))
    _general(
        DIMENSION[d], x.coef, x.arm, x.moving, x.n, x.e, x.dg, x.ds, x.turn, *law, *turning, dp, dt, F, K, acting,
        np.empty(d), np.empty(d), A, B,
    )  # fmt: skip
    if x.dcoef is not None:
        P, T = turning
        f = (law.weight * P)[:, None] * x.n + ((law.area[:, None] * T)[:, :, None] * x.e).sum(axis=1)
        s = d * x.coef.shape[1]
        # Weighted gaps: the coefficients move with both sides, and −∂F/∂q has the term of forces that change nodes.
        acts = np.flatnonzero(f.any(axis=1))
        K[acts, :s] -= np.einsum("kjq,ki->kjiq", x.dcoef[acts], f[acts]).reshape(len(acts), s, m)
    return Assembled(F, K, dp, dt, acting)


@njit(cache=True, error_model="numpy", forceinline=True)
def _crossed(dim, v, out):
    """Out (d, w): rotation ω → −ω × v."""
    if len(dim) == 2:
        out[0, 0], out[1, 0] = v[1], -v[0]
    else:
        out[0, 0], out[0, 1], out[0, 2] = 0.0, -v[2], v[1]
        out[1, 0], out[1, 1], out[1, 2] = v[2], 0.0, -v[0]
        out[2, 0], out[2, 1], out[2, 2] = -v[1], v[0], 0.0


@njit(cache=True, error_model="numpy")
def _act(dim, coef, arm, f, out):
    """`Stencils.act`."""
    d, nodes = len(dim), coef.shape[1]
    w = out.shape[1] - d * nodes
    A = np.zeros((d, 1 if d == 2 else 3))
    for k in range(len(f)):
        for b in range(nodes):
            for i in range(d):
                out[k, d * b + i] = coef[k, b] * f[k, i]
        if w > 0:
            _crossed(dim, arm[k], A)
            for j in range(w):
                moment = 0.0
                for i in range(d):
                    moment += A[i, j] * f[k, i]
                out[k, d * nodes + j] = moment


@njit(cache=True, error_model="numpy")
def _general(
    dim, coef, arm, moving, n, e, dg, ds, turn, p, t, by_gap, by_p, by_way, k_n, k_t, weight, area, P, T, dp, dt, F, K,
    acting, f, df, A, B,
):  # fmt: skip
    """`assemble`: arguments as of `Stencils` and `Response`, P (k,), T (k, t) what turns; the last ones are room to work in."""
    d, nodes = len(dim), coef.shape[1]
    h, w, s, m = d - 1, A.shape[1], d * nodes, F.shape[1]
    for k in range(len(p)):
        for i in range(d):
            f[i] = weight[k] * p[k] * n[k, i]
            for a in range(h):
                f[i] += area[k] * t[k, a] * e[k, a, i]
        for b in range(nodes):
            for i in range(d):
                F[k, d * b + i] = coef[k, b] * f[i]
        if m > s:
            _crossed(dim, arm[k], A)
        for j in range(m - s):
            F[k, s + j] = 0.0
            for i in range(d):
                F[k, s + j] += A[i, j] * f[i]
        # by the multipliers; the trial traction is λ_T − k_T Δs
        dp[k, 0] = by_gap[k]
        for a in range(h):
            dp[k, 1 + a], dt[k, a, 0] = 0.0, by_p[k, a] * by_gap[k]
            for b in range(h):
                dt[k, a, 1 + b] = -by_way[k, a, b] / k_t[k]
        slope = by_gap[k] if by_gap[k] > 0.0 else 1.0
        for i in range(d):
            pull, follows = 0.0, 0.0
            for a in range(h):
                pull += area[k] * t[k, a] * e[k, a, i]
                follows += area[k] * (dt[k, a, 0] / slope) * e[k, a, i]
            acting[0, k, i] = weight[k] * p[k] * n[k, i] + pull
            acting[1, k, i] = weight[k] * n[k, i] + follows
        for i in range(d):
            # From here on f holds the forces that turn with the frame; they are not p and t where friction is iterated as in
            # the paper.
            f[i] = weight[k] * P[k] * n[k, i]
            for a in range(h):
                f[i] += area[k] * T[k, a] * e[k, a, i]
        _crossed(dim, f, B)
        for q in range(m):
            by_q = (-by_gap[k] * k_n[k]) * dg[k, q]
            dp[k, d + q] = by_q
            for i in range(d):
                df[i] = -weight[k] * by_q * n[k, i]
                for j in range(w):
                    df[i] += B[i, j] * turn[k, j, q]
            for a in range(h):
                change = by_p[k, a] * by_q
                for b in range(h):
                    change += by_way[k, a, b] * ds[k, b, q]
                dt[k, a, d + q] = change
                for i in range(d):
                    df[i] -= area[k] * change * e[k, a, i]
            for b in range(nodes):
                for i in range(d):
                    K[k, d * b + i, q] = coef[k, b] * df[i]
            for j in range(m - s):
                # The arm always moves with the reference point, the last node; with the slave's nodes only where forces act at
                # the moved place.
                moment = coef[k, q // d] * B[q % d, j] if q < s and (moving or q >= s - d) else 0.0  # the arm moves
                for i in range(d):
                    moment += A[i, j] * df[i]
                K[k, s + j, q] = moment
