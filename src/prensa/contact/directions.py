"""Kernels of the closed derivatives of contact points in the plane along many directions at once.

All arrays of directions have these as their last axis. Of the friction of the points the laws are known: Coulomb's, with
constant coefficients. See `prensa.sensitivity.contacts` for what is derived from what.
"""

from __future__ import annotations

import math

import numpy as np

from prensa.kernels.compiled import njit


@njit(cache=True, error_model="numpy")
def grown(x, edges, point, edge, factor, at, axisymmetric, thickness, dxn, out):
    """Rates of the points' areas, out (k, d), from motions dxn (n, 2, d) of nodes at x (n, 2), as `Points.slopes` has them.

    edges (m, 2); of the shares that make the areas (s,): their ``point`` and ``edge``, ``factor`` of its length, place ``at``.
    """
    out[:] = 0.0
    for s in range(len(point)):
        i, j, share = edges[edge[s], 0], edges[edge[s], 1], at[s]
        t0, t1 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
        length = math.hypot(t0, t1)
        around = 2.0 * math.pi * ((1.0 - share) * x[i, 0] + share * x[j, 0]) if axisymmetric else thickness
        along0, along1, radial = factor[s] * around * t0 / length, factor[s] * around * t1 / length, 0.0
        if axisymmetric:
            radial = 2.0 * math.pi * factor[s] * length
        start, end = (1.0 - share) * radial - along0, share * radial + along0
        for d in range(out.shape[1]):
            out[point[s], d] += start * dxn[i, 0, d] + end * dxn[j, 0, d] + along1 * (dxn[j, 1, d] - dxn[i, 1, d])


@njit(cache=True, error_model="numpy", forceinline=True)
def _moved(i, q, dp, dt, ds, K, p, t, s, F):
    """Add what motions q (m, d) of stencil i make of its pressure, traction, coordinate (k, d) and forces (k, m, d)."""
    for m in range(len(q)):
        by_p, by_t, by_s = dp[i, 2 + m], dt[i, 0, 2 + m], ds[i, 0, m]
        for d in range(q.shape[1]):
            p[i, d] += by_p * q[m, d]
            t[i, d] += by_t * q[m, d]
            s[i, d] += by_s * q[m, d]
    for n in range(len(q)):
        for m in range(len(q)):
            stiff = K[i, n, m]
            for d in range(q.shape[1]):
                F[i, n, d] -= stiff * q[m, d]


@njit(cache=True, error_model="numpy")
def jvp_explicit(
    force, traction, gap, slips, way, dp, dt, ds, Fn, Ft, K, weight, k_n, k_t, unit, multipliers, support, dofs, first,
    area, lam, coordinate, scale, mu, X, place, p, t, s, F, r,
):  # fmt: skip
    """Rates of k points at fixed degrees of freedom → p, t, s (k, d), F (k, m, d); the forces are taken off residuals r.

    Of the points: pressures ``force`` (k,), ``traction`` (k, 1), ``gap``, ``slips``, ``way`` (k,) along the tool in the
    increment, dp (k, 2 + m), dt (k, 1, 2 + m), ds (k, 1, m), forces Fn, Ft (k, m) of a unit of pressure and of traction, K
    (k, m, m) of `ContactForces`; stiffnesses k_n, k_t and ``unit`` (k,); ``multipliers`` (k, 2) where they are degrees of
    freedom, from ``first`` on, else (0, 2) and −1; nodes ``support`` (k, a) and dofs (k, m) of the stencils, theirs first.
    Of directions: area (k, d), lam (k, 2, d) of multipliers, of which the normal ones are overwritten, ``coordinate`` (k, 1, d)
    as committed, scale (3, k, d) of k_n, k_t and unit, mu (d,), X (n, 2, d) of initial places, (0, 2, d) where all stay, and
    place (2, d) of the tool.
    """
    count, a, unknowns = area.shape[1], support.shape[1], dofs.shape[1]
    q = np.zeros((unknowns, count))
    moves = len(X) > 0 or np.any(place)
    for i in range(len(force)):
        exact, sign = first >= 0, math.copysign(1.0, traction[i, 0]) if traction[i, 0] != 0.0 else 0.0
        slides = sign * force[i] if slips[i] else 0.0
        by_n, by_p, by_t = dp[i, 0], dt[i, 0, 0], dt[i, 0, 1]
        for d in range(count):
            lam[i, 0, d] = scale[2, i, d] * multipliers[i, 0] if exact else 0.0
            if exact:
                lam[i, 1, d] = scale[2, i, d] * multipliers[i, 1]
            p[i, d] = by_n * (lam[i, 0, d] - scale[0, i, d] * gap[i])
            trial = lam[i, 1, d] - scale[1, i, d] * way[i] + k_t[i] * coordinate[i, 0, d]
            t[i, d] = by_p * p[i, d] + by_t * trial + mu[d] * slides
            s[i, d] = 0.0
            P, T = area[i, d] * force[i] + weight[i] * p[i, d], area[i, d] * traction[i, 0] + weight[i] * t[i, d]
            for m in range(unknowns):
                F[i, m, d] = P * Fn[i, m] + T * Ft[i, m]
        if moves:
            for d in range(count):
                q[2 * a, d], q[2 * a + 1, d] = place[0, d], place[1, d]
            if len(X) > 0:
                for b in range(a):
                    for d in range(count):
                        q[2 * b, d], q[2 * b + 1, d] = X[support[i, b], 0, d], X[support[i, b], 1, d]
            _moved(i, q, dp, dt, ds, K, p, t, s, F)
        for d in range(count):
            for m in range(unknowns):
                r[dofs[i, m], d] -= F[i, m, d]
            if exact:  # what the rows' factors change multiplies zero
                r[first + 2 * i, d] += weight[i] * unit[i] * (p[i, d] - lam[i, 0, d]) / k_n[i]
                r[first + 2 * i + 1, d] += weight[i] * unit[i] * (t[i, d] - lam[i, 1, d]) / k_t[i]


@njit(cache=True, error_model="numpy")
def along(
    force, traction, slips, way, slid, dp, dt, ds, Fn, Ft, K, weight, k_t, unit, dofs, first, x,
    lam, slip, coordinate, scale, p, t, s, F, kappa,
):  # fmt: skip
    """Add what motions x (ndof, d) of the degrees of freedom make of p, t, s (k, d), F (k, m, d), lam (k, 2, d); → kappa (k, d).

    slid (k,): what points slipped in the increment; ``slip`` (k, d), ``coordinate`` (k, 1, d): of the committed points; the
    others as of `jvp_explicit`.
    """
    count, unknowns = x.shape[1], dofs.shape[1]
    q = np.zeros((unknowns, count))
    for i in range(len(force)):
        for d in range(count):
            for m in range(unknowns):
                q[m, d] = x[dofs[i, m], d]
        _moved(i, q, dp, dt, ds, K, p, t, s, F)
        if first >= 0:
            for d in range(count):
                n, tangential = unit[i] * x[first + 2 * i, d], unit[i] * x[first + 2 * i + 1, d]
                more_p, more_t = dp[i, 0] * n + dp[i, 1] * tangential, dt[i, 0, 0] * n + dt[i, 0, 1] * tangential
                p[i, d] += more_p
                t[i, d] += more_t
                lam[i, 0, d] += n
                lam[i, 1, d] += tangential
                for m in range(unknowns):
                    F[i, m, d] += weight[i] * (more_p * Fn[i, m] + more_t * Ft[i, m])
        # κ_n + (|t_tr| − |t|)/k_T where a point slips
        sign = math.copysign(1.0, traction[i, 0]) if traction[i, 0] != 0.0 else 0.0
        for d in range(count):
            kappa[i, d] = slip[i, d]
            if slips[i]:
                trial = lam[i, 1, d] - scale[1, i, d] * way[i] - k_t[i] * (s[i, d] - coordinate[i, 0, d])
                kappa[i, d] += (sign * (trial - t[i, d]) - slid[i] * scale[1, i, d]) / k_t[i]


@njit(cache=True, error_model="numpy")
def energies(
    force, traction, was, slid, weight, k_n, k_t, exact, area, scale, p, t, traction_was, slip_was, weight_was, area_was, kappa,
    friction, stored,
):  # fmt: skip
    """Add derivatives of the work of friction and of the energy in springs, (d,) each, of k points.

    ``was`` (k, 1), weight_was (k,): committed tractions and their areas, with the derivatives ``traction_was`` (k, 1, d) and
    area_was (k, d); slip_was (k, d); others as of `along`.
    """
    for i in range(len(force)):
        t0, t1, w = was[i, 0], traction[i, 0], weight[i]
        before = math.copysign(1.0, t0) if t0 != 0.0 else 0.0
        now = math.copysign(1.0, t1) if t1 != 0.0 else 0.0
        total = weight_was[i] * abs(t0) + w * abs(t1)
        for d in range(len(friction)):
            change = weight_was[i] * before * traction_was[i, 0, d] + w * now * t[i, d]
            change += area_was[i, d] * abs(t0) + area[i, d] * abs(t1)
            friction[d] += 0.5 * (change * slid[i] + total * (kappa[i, d] - slip_was[i, d]))
            if not exact:
                normal = 0.5 * (area[i, d] - w * scale[0, i, d] / k_n[i]) * force[i] + w * p[i, d]
                tangential = 0.5 * (area[i, d] - w * scale[1, i, d] / k_t[i]) * t1 + w * t[i, d]
                stored[d] += force[i] * normal / k_n[i] + t1 * tangential / k_t[i]
