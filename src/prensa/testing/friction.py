"""The suite of friction laws."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.friction.law import At, FrictionLaw, bounded
from prensa.friction.return_map import Tangential, return_map
from prensa.precision import FIRST_DIFFERENCE, NEGLIGIBLE, ROUND_OFF, SMALLEST
from prensa.testing.common import FD_ERROR, KINK, TRIALS, raise_if_wrong
from prensa.types import Array, Flags


def check_friction(
    law: FrictionLaw, *, pressure: float = 100.0, slip: float = 1.0, k: float = 60.0, components: int = 2, seed: int = 0
) -> None:
    """Check a friction law by itself and in the return map, at random pressures, slips and tractions.

    Parameters
    ----------
    law
        The law, a `FrictionLaw`.
    pressure, slip, k
        Sizes of the pressures (stress), of the accumulated slips (length) and of the shear yield stress at which it is tried.
    components
        Tangential components of the tractions: 1 in the plane, 2 in space.
    seed
        Of the random numbers.

    Raises
    ------
    LawError
        Saying what is wrong: a bound that is negative, not a number or of the wrong shape; an answer that changes from call
        to call or with the company of other points; derivatives of the bound or of the traction that differ from finite
        differences; a ``hardens``, ``proportional``, ``frictionless`` or ``softening`` that is not so; a traction beyond the
        bound; negative dissipation; two half steps of slip in one direction that are not the whole one.

    """
    rng = np.random.default_rng(seed)
    n = TRIALS
    p, kappa = pressure * rng.uniform(0.0, 1.0, n), slip * rng.uniform(0.0, 1.0, n)
    at = At(np.full(n, k) * rng.uniform(0.5, 1.5, n), dt=1.0, time=1.0, speed=slip * np.linspace(0.0, 2.0, n))
    found = [*_bound_wrong(law, p, kappa, at)]
    if not found:
        found += [*_claims_wrong(law, p, kappa, at)]
        found += [*_map_wrong(law, p, kappa, at, components, rng)]
    raise_if_wrong(f"friction law {law!r}", found)


def _bound_wrong(law: FrictionLaw, p: Array, kappa: Array, at: At) -> Iterator[str]:
    first = [np.array(v, dtype=np.float64) for v in bounded(law, p.copy(), kappa.copy(), at)]
    for name, values in zip(("τ_y", "∂τ_y/∂p", "∂τ_y/∂κ"), first):
        if values.shape != p.shape:
            yield f"{name} has the shape {values.shape} for {len(p)} points; it must have one number a point"
            return
        if not np.isfinite(values).all():
            yield f"{name} is not a finite number at p = {p[~np.isfinite(values)][0]:.4g}"
            return
    if (first[0] < 0).any():
        i = int(np.argmin(first[0]))
        yield f"the bound is negative, {first[0][i]:.4g} at p = {p[i]:.4g}, κ = {kappa[i]:.4g}"
    again = bounded(law, p.copy(), kappa.copy(), at)
    if not all(np.array_equal(a, b) for a, b in zip(first, again)):
        yield "the bound is another one when asked again: a law must not remember anything"
    half = len(p) // 2
    k, speed = (None if v is None else v[half:] for v in (at.k, at.speed))
    alone = bounded(law, p[half:].copy(), kappa[half:].copy(), at._replace(k=k, speed=speed))
    if not all(np.allclose(a[half:], b, rtol=ROUND_OFF, atol=0.0) for a, b in zip(first, alone)):
        yield "the bound of a point depends on the other points"
    for number, name in ((0, "∂τ_y/∂p"), (1, "∂τ_y/∂κ")):
        worst = _slope_error(law, (p, kappa), at, number)
        if worst > KINK:
            yield f"{name} differs from finite differences by {worst:.1e} of the bound: mend it, or return the bound alone"


def _slope_error(law: FrictionLaw, points: tuple[Array, Array], at: At, number: int) -> float:
    """Largest error of the law's derivative by pressure (0) or slip (1), kinks left out, over the bound over the argument."""
    x = points[number]
    h = FIRST_DIFFERENCE * float(x.max())
    mid = np.maximum(x, 2 * h)

    def there(values: Array) -> tuple[Array, Array, Array]:
        return bounded(law, values, points[1], at) if number == 0 else bounded(law, points[0], values, at)

    centre = there(mid)
    left, right = (centre[0] - there(mid - h)[0]) / h, (there(mid + h)[0] - centre[0]) / h
    unit = (float(centre[0].max()) + SMALLEST) / float(mid.max())
    smooth = np.abs(right - left) <= KINK * (np.abs(left) + np.abs(right)) + NEGLIGIBLE * unit
    return float(np.abs(0.5 * (left + right) - centre[1 + number])[smooth].max(initial=0.0)) / unit


def _claims_wrong(law: FrictionLaw, p: Array, kappa: Array, at: At) -> Iterator[str]:
    tau, _, slope = bounded(law, p, kappa, at)
    if law.frictionless and tau.any():
        yield "it says that it is frictionless, and its bound is not zero"
    if not law.hardens and not np.array_equal(bounded(law, p, 2.0 * kappa + 1.0, at)[0], tau):
        yield "it says that it does not harden, and its bound changes with the slip"
    if law.proportional and not np.allclose(bounded(law, 2.0 * p, kappa, at)[0], 2.0 * tau, rtol=ROUND_OFF, atol=0.0):
        yield "it says that it is proportional to the pressure, and twice the pressure does not give twice the bound"
    ahead = law.softening(p, kappa, at)
    if (ahead < 0).any() or (ahead < -slope - NEGLIGIBLE * np.abs(slope).max(initial=0.0)).any():
        yield "its 'softening' is less than the rate at which its bound falls with the slip"


def _map_wrong(law: FrictionLaw, p: Array, kappa: Array, at: At, d: int, rng: np.random.Generator) -> Iterator[str]:
    n, tau = len(p), bounded(law, p, kappa, at)[0]
    if not tau.any():
        return
    softest = float(law.softening(p, kappa, at).max())
    reach = float(tau.max())
    k_t = np.full(n, max(3.0 * softest, 2.0 * reach / max(float(kappa.max()), SMALLEST)))
    lam = rng.normal(size=(n, d)) * 0.4 * reach
    dg = rng.normal(size=(n, d)) * (rng.uniform(0.0, 1.0, n) * reach / k_t)[:, None]
    touching = np.ones(n, dtype=bool)

    def mapped(dg: Array = dg, p: Array = p, lam: Array = lam, kappa: Array = kappa) -> Tangential:
        return return_map(law, at, lam, dg, p, touching, kappa, k_t)

    out = mapped()
    bound = bounded(law, p, out.kappa, at)[0]
    size = np.sqrt((out.t**2).sum(axis=1))
    if not out.slip.any() or out.slip.all():
        yield "at the given sizes all points stick or all slip: give 'pressure', 'slip' and 'k' at which it is used"
        return
    if np.abs(size - bound)[out.slip].max() > ROUND_OFF * reach:
        yield f"a slipping point is not on the bound: off by {np.abs(size - bound)[out.slip].max() / reach:.1e} of it"
    if (size > bound + ROUND_OFF * reach)[~out.slip].any():
        yield "a sticking point is beyond the bound"
    slipped = -dg - (out.t - lam) / k_t[:, None]  # what the elastic part of the tangential motion leaves
    work = (out.t * slipped).sum(axis=1)
    if (work < -ROUND_OFF * reach * np.abs(slipped).max())[out.slip].any():
        yield "slip does negative work: friction would drive"
    yield from _tangent_wrong(law, out, mapped, dg, p, k_t, reach)
    # radial slip in two halves is the whole: the map is exact along a straight path
    straight = np.zeros((n, d))
    straight[:, 0] = -(reach / k_t) * rng.uniform(2.0, 4.0, n)
    whole = mapped(straight, p, np.zeros((n, d)))
    first = mapped(0.5 * straight, p, np.zeros((n, d)))
    second = mapped(0.5 * straight, p, first.t, first.kappa)
    if np.abs(second.t - whole.t).max() > NEGLIGIBLE * reach:
        yield f"two half steps of a straight slip differ from the whole one by {np.abs(second.t - whole.t).max() / reach:.1e}"


def _tangent_wrong(
    law: FrictionLaw, out: Tangential, mapped: object, dg: Array, p: Array, k_t: Array, reach: float
) -> Iterator[str]:
    assert callable(mapped)
    e = FIRST_DIFFERENCE * reach / float(k_t.max())
    for j in range(dg.shape[1]):
        step = e * np.eye(dg.shape[1])[j]
        plus, minus = mapped(dg + step), mapped(dg - step)
        smooth = _smooth(out, plus, minus)
        error = np.abs((plus.t - minus.t) / (2 * e) - out.dt_dg[:, :, j])[smooth].max(initial=0.0) / k_t.max()
        if error > FD_ERROR:
            yield f"the traction's derivative by the slip differs from finite differences by {error:.1e} of k_T"
    h = FIRST_DIFFERENCE * p
    plus, minus = mapped(dg, p + h), mapped(dg, p - h)
    smooth = _smooth(out, plus, minus)
    error = (np.abs((plus.t - minus.t) / (2 * h)[:, None] - out.dt_dp) * p[:, None])[smooth].max(initial=0.0) / reach
    if error > FD_ERROR:
        yield f"the traction's derivative by the pressure differs from finite differences by {error:.1e} of the bound"


def _smooth(out: Tangential, plus: Tangential, minus: Tangential) -> Flags:
    """Points whose status and branch of the bound do not change within the step."""
    same = (plus.slip == out.slip) & (minus.slip == out.slip)
    for a, b in ((plus.dt_dp, minus.dt_dp), (plus.dt_dg, minus.dt_dg)):
        scale = np.abs(out.dt_dg).max() if a.ndim == 3 else np.abs(out.dt_dp).max() + SMALLEST
        same &= np.abs(a - b).reshape(len(a), -1).max(axis=1) <= KINK * scale
    return same
