"""Return map (return mapping, radial return) of J2 plasticity for any flow curve, in NumPy; `prensa.materials.j2` is compiled."""

from __future__ import annotations

import numpy as np

from prensa.kernels.record import BRACKET, LEFT_OVER, NO_ROOT, SEARCH_STEPS
from prensa.materials.flow_curve import FlowCurve, along, stress_at
from prensa.materials.hencky_j2 import ON_SURFACE
from prensa.types import Array, Flags

LAST_STEP = 1e-12  # Newton's last step, over the plastic increment


def return_map(
    eps: Array, jn: Array, old: Array, column: int, K: float, G: float, cauchy: bool, curve: FlowCurve, dt: float,
    tau: Array, dtau: Array, eps_e: Array, new: Array, failed: Flags, tangent: bool,
    held: Flags | None = None,
    secant: float = 0.0,
) -> None:  # fmt: skip
    """Trial elastic strains eps (n, 3) → tau, dtau = ∂τ/∂ε if ``tangent``, eps_e, plastic strain and work; as `j2.principal`.

    Columns ``column`` and ``column`` + 1 of old and new are plastic strain and work.
    """
    start = np.ascontiguousarray(old[:, column])
    tr = eps.sum(axis=1)
    s = 2.0 * G * (eps - tr[:, None] / 3.0)
    q = np.sqrt(1.5 * (s * s).sum(axis=1))
    jac = np.exp(tr) if cauchy else np.ones_like(tr)
    with np.errstate(all="ignore"):
        y0 = stress_at(curve, start, np.zeros_like(start))
        # "Not below", so that a flow stress that is NaN counts as flowing: its point finds no root and is flagged.
        flows = np.flatnonzero(~(q - jac * y0 <= ON_SURFACE * q) if held is None else held)
        delta, y1, slope = np.zeros_like(q), y0.copy(), np.zeros_like(q)
        delta[flows], y1[flows], slope[flows] = _roots(curve, start[flows], q[flows], jac[flows], G, dt)
    lost = ~np.isfinite(delta)
    failed[lost] = True
    delta[lost] = 0.0
    on = delta != 0.0
    # at the rate of the increment, as `hencky_j2` has it
    y0[on] = stress_at(curve, start[on], delta[on] / dt if dt > 0.0 else np.zeros_like(delta[on]))
    safe = np.where(on, q, 1.0)
    theta = np.where(on, 1.0 - 3.0 * G * delta / safe, 1.0)
    n = np.where(on, 1.5 / safe, 0.0)[:, None] * s
    new[:, column] = start + delta
    new[:, column + 1] = old[:, column + 1] + 0.5 * ((jn if cauchy else 1.0) * y0 + jac * y1) * delta
    tau[:] = K * tr[:, None] + theta[:, None] * s
    eps_e[:] = eps - delta[:, None] * n
    if not tangent:
        return
    dtau[:] = (K - 2.0 * G * theta / 3.0)[:, None, None]
    for k in range(3):
        dtau[:, k, k] += 2.0 * G * theta
    # as in the compiled map: dΔ = (dq − J σ_y tr dε)/(3G + J σ_y′), dq = 2G n·dε
    soft, volume = 1.0 / (3.0 * G + jac * slope), jac * y1 if cauchy else np.zeros_like(q)
    dq = 2.0 * G * n
    change = (1.0 - secant) * 2.0 * G * ((dq - volume[:, None]) * soft[:, None] - (delta / safe)[:, None] * dq)
    dtau -= np.where(on[:, None, None], n[:, :, None] * change[:, None, :], 0.0)


def _roots(curve: FlowCurve, start: Array, q: Array, jac: Array, G: float, dt: float) -> tuple[Array, Array, Array]:
    """Roots Δ (k,) of f = q − 3GΔ − J σ_y(start + Δ) in (0, q/3G), with σ_y and its slope there; NaN where none is found.

    Newton's method; a bracket takes over where a step leaves it. Points made to flow below the surface flow back: Δ < 0.
    """
    top = q / (3.0 * G)
    root, y, slope = np.full_like(q, np.nan), np.full_like(q, np.nan), np.full_like(q, np.nan)
    below = q < jac * stress_at(curve, start, np.zeros_like(start))
    lo, hi, rows = np.where(below, -top, 0.0), np.where(below, 0.0, top), np.arange(len(q))
    x = np.where(below, 0.0, 0.5 * top)
    for _ in range(SEARCH_STEPS):
        if not len(rows):
            break
        s, ds = along(curve, start[rows], x, dt)
        j, trial = jac[rows], q[rows]
        f = trial - 3.0 * G * x - j * s
        step = f / (3.0 * G + j * ds)
        close = np.abs(step) <= LAST_STEP * np.abs(x)
        narrow, rest = hi - lo <= BRACKET * np.abs(x), np.abs(f)
        # A bracket may close on a jump of the curve, which is no root.
        done = close | (rest <= LEFT_OVER * trial) | (narrow & (rest <= NO_ROOT * np.maximum(trial, np.abs(j * s))))
        last = np.where(close, step, 0.0)
        root[rows], y[rows], slope[rows] = np.where(done, x + last, np.nan), s + ds * last, ds
        lo, hi = np.where(f > 0.0, x, lo), np.where(f > 0.0, hi, x)
        go = ~done & ~narrow & np.isfinite(f)
        inside = (lo < x + step) & (x + step < hi)
        x = np.where(inside, x + step, 0.5 * (lo + hi))[go]
        rows, lo, hi = rows[go], lo[go], hi[go]
    return root, y, slope
