"""Sides of bodies as masters: weighted gaps in the plane, one stencil a node of the slave side (mortar method).

The gap of node A is weighted with its shape function: g_A = n·Σ_j c_j x_j over its area, with coefficients c = (∫ N_A N_B dΓ,
−∫ N_A M_C dΓ) of the nodes B of the slave side and C of the master side. They are integrated over the pieces of slave edges
between projections of nodes of either side along the slave's averaged, interpolated normals, so that a uniform pressure goes
through any two meshes (Puso and Laursen 2004; Popp, Gitterle, Gee and Wall 2010). Slip is what the changes of the coefficients
since the last commit make, n⊥·(Σ c⁰_j x_j − Σ c_j x_j) (Yang, Laursen and Meng 2005; Gitterle et al. 2010): turning both sides
together is none.

Sides are walked with the body on the left. Derivatives are by the complex step: the same function with one perturbed coordinate
after another, so that nothing is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from prensa.contact.stencil import Stencils
from prensa.kernels.compiled import njit
from prensa.precision import COMPLEX_STEP, ROUND_OFF
from prensa.types import Array, Flags, Index

NEIGHBOURS_BEFORE = 2  # slave nodes on either side of its own that a stencil has: normals turn with them
_GAUSS_PLACES = np.array([0.5 - 0.15**0.5, 0.5, 0.5 + 0.15**0.5])  # Gauss points of a piece
_GAUSS_SHARES = np.array([5.0, 8.0, 5.0]) / 18.0
_PROJECTIONS = 8  # Newton steps of a projection, which is linear where normals do not turn


class SidesSeen(NamedTuple):
    """Gaps g (k,), infinite where nothing is faced, normals n (k, 2) and coefficients (k, 5 + c) over the areas of the points."""

    g: Array
    n: Array
    coef: Array


class FacingSides(NamedTuple):
    """A slave side and a master side: nodes (k, 5 + c) of the stencils, and which of the first five there are (k, 5)."""

    nodes: Index
    there: Flags

    @classmethod
    def of(cls, slave: Index, master: Index, closed: tuple[bool, bool] = (False, False)) -> FacingSides:
        """From the nodes (k,) and (c,) of the two sides, each in walking order; ``closed``: whether they end where they begin."""
        k = len(slave)
        at = np.arange(k)[:, None] + np.arange(-NEIGHBOURS_BEFORE, NEIGHBOURS_BEFORE + 1)
        at = at % k if closed[0] else at
        master = np.append(master, master[:1]) if closed[1] else master
        # Stencils have one width: beyond the ends of the side the end node stands in, and `there` leaves it out.
        nodes = np.hstack([slave[np.clip(at, 0, k - 1)], np.tile(master, (k, 1))])
        return cls(nodes, (at >= 0) & (at < k))

    def coefficients(self, x: Array) -> Array:
        """Coefficients (k, 5 + c) over the areas on positions x (n, 2), 0 of nodes that face nothing."""
        out, area = np.zeros(self.nodes.shape), np.zeros(len(self.nodes))
        _coefficients(x[self.nodes], self.there, out, area)
        return out

    def seen(self, x: Array) -> SidesSeen:
        """Gaps, normals and coefficients on positions x (n, 2)."""
        k, j = self.nodes.shape
        coef, v = np.zeros((k, j)), np.empty((k, 4))
        _seen(x[self.nodes], self.there, coef, v)
        area = coef[:, : self.there.shape[1]].sum(axis=1)
        return SidesSeen(v[:, 0].copy(), v[:, 1:3].copy(), coef / np.where(area > 0.0, area, 1.0)[:, None])

    def moved(self, x: Array, change: Callable[[SidesSeen], Array]) -> Array:
        """Ways (k, 2) of the slave's nodes along the normals by which their gaps change as asked, on positions x (n, 2).

        A gap is a mean over its neighbours' ways too: these are found by sweeps, as many as a stencil is wide. No mean need be
        invertible for them, as that of an end which is hardly covered is not, and what they leave is Newton's.
        """
        seen, width = self.seen(x), self.there.shape[1]
        wanted = change(seen)
        near, share = self.nodes[:, :width], np.where(self.there, seen.coef[:, :width], 0.0)
        own, all_ways = self.nodes[:, NEIGHBOURS_BEFORE], np.zeros(len(x))
        for _ in range(width):
            left = wanted - (share * all_ways[near]).sum(axis=1)
            all_ways[own] += np.where(wanted != 0.0, left, 0.0)
        return all_ways[own][:, None] * seen.n

    def stencils(self, x: Array, committed: Array, dofs: Index) -> Stencils:
        """Stencils on positions x (n, 2), of which the coefficients have the areas in them; infinite gaps of what faces nothing.

        committed (k, 5 + c): `coefficients` at the last commit, from which slip is counted. dofs (k, 2 (5 + c)) of the nodes.
        """
        k, j = self.nodes.shape
        coef, v, dcoef, dv = np.zeros((k, j)), np.empty((k, 4)), np.zeros((k, j, 2 * j)), np.zeros((k, 4, 2 * j))
        _weighted(x[self.nodes], self.there, committed, coef, v, dcoef, dv)
        n, e = v[:, 1:3].copy(), np.stack([-v[:, 2], v[:, 1]], axis=1)[:, None]
        turn = np.einsum("ki,kiq->kq", e[:, 0], dv[:, 1:3])[:, None]
        dg, ds = dv[:, 0].copy(), dv[:, 3:].copy()
        return Stencils(dofs, coef, v[:, 0].copy(), v[:, 3:].copy(), n, e, dg, ds, turn, np.zeros((0, 2)), False, dcoef)


@njit(cache=True)
def _averaged(x, there):
    """Unit normals (5, 2) of the slave at the nodes (5, 2) of a stencil, those at its ends left out: means over their edges."""
    nu = np.zeros((5, 2), x.dtype)
    for i in range(1, 4):
        if not there[i]:
            continue
        for j in range(i - 1, i + 1):
            if there[j] and there[j + 1]:
                nu[i, 0] += x[j + 1, 1] - x[j, 1]
                nu[i, 1] -= x[j + 1, 0] - x[j, 0]
        size = np.sqrt(nu[i, 0] * nu[i, 0] + nu[i, 1] * nu[i, 1])
        nu[i, 0], nu[i, 1] = nu[i, 0] / size, nu[i, 1] / size
    return nu


@njit(cache=True)
def _integrals(x, there, first, last, coef, n):
    """Places x (5 + c, 2), real or complex → coefficients (5 + c,) with the area in them, normal n (2,) of the master; area.

    The master's edges from number ``first`` to before ``last`` are looked at.
    """
    nu = _averaged(x, there)
    # The slave's averaged normal at the own node, turned round: on flat sides it does not depend on the master's mesh.
    n[0], n[1] = -nu[2, 0], -nu[2, 1]
    coef[:] = 0.0
    ends = np.empty(2, x.dtype)
    for i in range(1, 3):
        if not (there[i] and there[i + 1]):
            continue
        ax, ay = x[i, 0], x[i, 1]
        tx, ty = x[i + 1, 0] - ax, x[i + 1, 1] - ay
        length = np.sqrt(tx * tx + ty * ty)
        wx, wy = nu[i + 1, 0] - nu[i, 0], nu[i + 1, 1] - nu[i, 1]
        for c in range(first, last):
            ex, ey = x[c + 1, 0] - x[c, 0], x[c + 1, 1] - x[c, 1]
            if tx.real * ex.real + ty.real * ey.real >= 0.0:
                continue  # a side that looks the same way is the far side of its body
            for e in range(2):
                px, py = x[c + e, 0], x[c + e, 1]
                s = ((px - ax) * tx + (py - ay) * ty) / (length * length)
                # No criterion ends the iteration: the imaginary part, which is the derivative, converges behind the real one.
                for _ in range(_PROJECTIONS):
                    vx, vy = nu[i, 0] + s * wx, nu[i, 1] + s * wy
                    dx, dy = ax + s * tx - px, ay + s * ty - py
                    s -= (dx * vy - dy * vx) / (tx * vy - ty * vx + dx * wy - dy * wx)
                ends[e] = s
            # The master side runs against the slave side; complex numbers have no order, their real parts do.
            lo, hi = (ends[0], ends[1]) if ends[0].real < ends[1].real else (ends[1], ends[0])
            if lo.real < 0.0:
                # An end that is clipped to the edge does not move with the nodes: value and imaginary part, which is its
                # derivative, are constants.
                lo = lo * 0.0
            if hi.real > 1.0:
                hi = hi * 0.0 + 1.0
            if not hi.real - lo.real >= ROUND_OFF:  # nor where a projection runs along the master
                continue
            for q in range(3):
                s = lo + (hi - lo) * _GAUSS_PLACES[q]
                vx, vy = nu[i, 0] + s * wx, nu[i, 1] + s * wy
                m = ((ax + s * tx - x[c, 0]) * vy - (ay + s * ty - x[c, 1]) * vx) / (ex * vy - ey * vx)
                if not 0.0 <= m.real <= 1.0:
                    continue  # projections found no way to the master: normals that fan out cross farther on
                part = (1.0 - s if i == 2 else s) * length * (hi - lo) * _GAUSS_SHARES[q]
                # `part` has N_A of the own node, the third of five: its row of (∫ N_A N_B, −∫ N_A M_C).
                coef[i] += part * (1.0 - s)
                coef[i + 1] += part * s
                coef[c] -= part * (1.0 - m)
                coef[c + 1] -= part * m
    return coef[0] + coef[1] + coef[2] + coef[3] + coef[4]


@njit(cache=True)
def _state(x, there, committed, first, last, coef, v):
    """Coefficients (j,) and v (4,) = gap, normal, slip; edges as in `_integrals`."""
    area = _integrals(x, there, first, last, coef, v[1:3])
    length = abs(x[1, 0].real - x[3, 0].real) + abs(x[1, 1].real - x[3, 1].real)
    if area.real <= ROUND_OFF * length:
        coef[:] = 0.0
        # An infinite gap is open whatever the penalty, and its slopes are never asked for.
        v[0], v[3] = np.inf, 0.0
        return
    v[0], v[3] = 0.0, 0.0
    for j in range(len(coef)):
        mean = coef[j] / area
        v[0] += mean * (v[1] * x[j, 0] + v[2] * x[j, 1])
        v[3] += (committed[j] - mean) * (v[1] * x[j, 1] - v[2] * x[j, 0])


@njit(cache=True)
def _coefficients(x, there, out, area):
    n = np.empty(2)
    for k in range(len(x)):
        area[k] = _integrals(x[k], there[k], 5, x.shape[1] - 1, out[k], n)
        for j in range(out.shape[1]):
            out[k, j] = out[k, j] / area[k] if area[k] > 0.0 else 0.0


@njit(cache=True)
def _seen(x, there, coef, v):
    """States v (k, 4) of the stencils x (k, j, 2), and coefficients (k, j)."""
    nothing = np.zeros(x.shape[1])
    for k in range(len(x)):
        _state(x[k], there[k], nothing, 5, x.shape[1] - 1, coef[k], v[k])


@njit(cache=True)
def _weighted(x, there, committed, coef, v, dcoef, dv):
    """States of the stencils x (k, j, 2) and their derivatives dcoef (k, j, 2j), dv (k, 4, 2j)."""
    j = x.shape[1]
    z, zc, zv = np.empty((j, 2), np.complex128), np.empty(j, np.complex128), np.empty(4, np.complex128)
    for k in range(len(x)):
        _state(x[k], there[k], committed[k], 5, j - 1, coef[k], v[k])
        if not np.isfinite(v[k, 0]):
            continue
        first, last = j - 1, 5
        for a in range(5, j):
            if coef[k, a] != 0.0:
                first, last = min(first, a), max(last, a)
        for q in range(2 * j):
            if q >= 10 and coef[k, q // 2] == 0.0 and committed[k, q // 2] == 0.0:
                continue  # a node of the master that the point does not face, and did not
            for a in range(j):
                z[a, 0], z[a, 1] = x[k, a, 0], x[k, a, 1]
            z[q // 2, q % 2] += COMPLEX_STEP * 1j
            _state(z, there[k], committed[k], first, last, zc, zv)
            for i in range(4):
                dv[k, i, q] = zv[i].imag / COMPLEX_STEP
            for a in range(j):
                dcoef[k, a, q] = zc[a].imag / COMPLEX_STEP
