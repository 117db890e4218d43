"""Suites that every law inherits, prensa's own and users': each says in words what is wrong with a law.

They need nothing but the law; they are run in a test (``prensa.testing.check_friction(MyLaw(mu=0.2))``) or by hand.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prensa.friction.law import At, FrictionLaw, bounded
from prensa.friction.return_map import Tangential, return_map
from prensa.materials.flow_curve import FlowCurve, partial, stress_at
from prensa.materials.material import IsotropicMaterial, Material, principal_stress
from prensa.tools.analytic import Closest, Tool, turned
from prensa.tools.tool import ToolShape

if TYPE_CHECKING:
    from prensa.materials.laws import Material as Law
    from prensa.materials.laws import Out

Array = NDArray[np.float64]

TRIALS = 400
FD_STEP = 1e-6  # of finite differences, over the size of the argument
FD_ERROR = 1e-6  # accepted difference of a derivative from finite differences, over the size of its terms


class LawError(AssertionError):
    """A law that cannot be right; the text says what was found wrong, one sentence a line."""


def _tell(what: str, found: list[str]) -> None:
    if found:
        raise LawError("\n".join([f"{what}:", *(f"- {line}" for line in found)]))


# ------------------------------------------------------------------------------------------------------------- friction
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
    p, kappa = pressure * rng.uniform(0.005, 1.0, n), slip * rng.uniform(0.0, 1.0, n)
    at = At(np.full(n, k) * rng.uniform(0.5, 1.5, n), dt=1.0, time=1.0)
    found = [*_bound_wrong(law, p, kappa, at)]
    if not found:
        found += [*_claims_wrong(law, p, kappa, at)]
        found += [*_map_wrong(law, p, kappa, at, components, rng)]
    _tell(f"friction law {law!r}", found)


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
    k = None if at.k is None else at.k[half:]
    alone = bounded(law, p[half:].copy(), kappa[half:].copy(), at._replace(k=k))
    if not all(np.allclose(a[half:], b, rtol=1e-13, atol=0.0) for a, b in zip(first, alone)):
        yield "the bound of a point depends on the other points"
    for number, name in ((0, "∂τ_y/∂p"), (1, "∂τ_y/∂κ")):
        worst = _slope_error(law, (p, kappa), at, number)
        if worst > 1e3 * FD_ERROR:
            yield f"{name} differs from finite differences by {worst:.1e} of the bound: mend it, or return the bound alone"


def _slope_error(law: FrictionLaw, points: tuple[Array, Array], at: At, number: int) -> float:
    """Largest error of the law's derivative by pressure (0) or slip (1), kinks left out, over the bound over the argument."""
    x = points[number]
    h = FD_STEP * float(x.max())
    mid = np.maximum(x, 2 * h)

    def there(values: Array) -> tuple[Array, Array, Array]:
        return bounded(law, values, points[1], at) if number == 0 else bounded(law, points[0], values, at)

    centre = there(mid)
    left, right = (centre[0] - there(mid - h)[0]) / h, (there(mid + h)[0] - centre[0]) / h
    unit = (float(centre[0].max()) + 1e-300) / float(mid.max())
    smooth = np.abs(right - left) <= 1e-3 * (np.abs(left) + np.abs(right)) + 1e-8 * unit
    return float(np.abs(0.5 * (left + right) - centre[1 + number])[smooth].max(initial=0.0)) / unit


def _claims_wrong(law: FrictionLaw, p: Array, kappa: Array, at: At) -> Iterator[str]:
    tau, _, slope = bounded(law, p, kappa, at)
    if law.frictionless and tau.any():
        yield "it says that it is frictionless, and its bound is not zero"
    if not law.hardens and not np.array_equal(bounded(law, p, 2.0 * kappa + 1.0, at)[0], tau):
        yield "it says that it does not harden, and its bound changes with the slip"
    if law.proportional and not np.allclose(bounded(law, 2.0 * p, kappa, at)[0], 2.0 * tau, rtol=1e-12, atol=0.0):
        yield "it says that it is proportional to the pressure, and twice the pressure does not give twice the bound"
    ahead = law.softening(p, kappa, at)
    if (ahead < 0).any() or (ahead < -slope - 1e-9 * np.abs(slope).max(initial=0.0)).any():
        yield "its 'softening' is less than the rate at which its bound falls with the slip"


def _map_wrong(law: FrictionLaw, p: Array, kappa: Array, at: At, d: int, rng: np.random.Generator) -> Iterator[str]:
    n, tau = len(p), bounded(law, p, kappa, at)[0]
    if not tau.any():
        return
    softest = float(law.softening(p, kappa, at).max())
    reach = float(tau.max())
    k_t = np.full(n, max(3.0 * softest, 2.0 * reach / max(float(kappa.max()), 1e-300)))
    lam = rng.normal(size=(n, d)) * 0.4 * reach
    dg = rng.normal(size=(n, d)) * (np.where(np.arange(n) % 2, 1.0, 0.05) * reach / k_t)[:, None]
    touching = np.ones(n, dtype=bool)

    def mapped(dg: Array = dg, p: Array = p, lam: Array = lam, kappa: Array = kappa) -> Tangential:
        return return_map(law, at, lam, dg, p, touching, kappa, k_t)

    out = mapped()
    bound = bounded(law, p, out.kappa, at)[0]
    size = np.sqrt((out.t**2).sum(axis=1))
    if not out.slip.any() or out.slip.all():
        yield "at the given sizes all points stick or all slip: give 'pressure', 'slip' and 'k' at which it is used"
        return
    if np.abs(size - bound)[out.slip].max() > 1e-11 * reach:
        yield f"a slipping point is not on the bound: off by {np.abs(size - bound)[out.slip].max() / reach:.1e} of it"
    if (size > bound + 1e-11 * reach)[~out.slip].any():
        yield "a sticking point is beyond the bound"
    slipped = -dg - (out.t - lam) / k_t[:, None]  # what the elastic part of the tangential motion leaves
    work = (out.t * slipped).sum(axis=1)
    if (work < -1e-11 * reach * np.abs(slipped).max())[out.slip].any():
        yield "slip does negative work: friction would drive"
    yield from _tangent_wrong(law, out, mapped, dg, p, k_t, reach)
    # radial slip in two halves is the whole: the map is exact along a straight path
    straight = np.zeros((n, d))
    straight[:, 0] = -(reach / k_t) * rng.uniform(2.0, 4.0, n)
    whole = mapped(straight, p, np.zeros((n, d)))
    first = mapped(0.5 * straight, p, np.zeros((n, d)))
    second = mapped(0.5 * straight, p, first.t, first.kappa)
    if np.abs(second.t - whole.t).max() > 1e-9 * reach:
        yield f"two half steps of a straight slip differ from the whole one by {np.abs(second.t - whole.t).max() / reach:.1e}"


def _tangent_wrong(
    law: FrictionLaw, out: Tangential, mapped: object, dg: Array, p: Array, k_t: Array, reach: float
) -> Iterator[str]:
    assert callable(mapped)
    e = FD_STEP * reach / float(k_t.max())
    for j in range(dg.shape[1]):
        step = e * np.eye(dg.shape[1])[j]
        plus, minus = mapped(dg + step), mapped(dg - step)
        smooth = _smooth(out, plus, minus)
        error = np.abs((plus.t - minus.t) / (2 * e) - out.dt_dg[:, :, j])[smooth].max(initial=0.0) / k_t.max()
        if error > 10 * FD_ERROR:
            yield f"the traction's derivative by the slip differs from finite differences by {error:.1e} of k_T"
    h = FD_STEP * p
    plus, minus = mapped(dg, p + h), mapped(dg, p - h)
    smooth = _smooth(out, plus, minus)
    error = (np.abs((plus.t - minus.t) / (2 * h)[:, None] - out.dt_dp) * p[:, None])[smooth].max(initial=0.0) / reach
    if error > 10 * FD_ERROR:
        yield f"the traction's derivative by the pressure differs from finite differences by {error:.1e} of the bound"


def _smooth(out: Tangential, plus: Tangential, minus: Tangential) -> NDArray[np.bool_]:
    """Points whose status and branch of the bound do not change within the step."""
    same = (plus.slip == out.slip) & (minus.slip == out.slip)
    for a, b in ((plus.dt_dp, minus.dt_dp), (plus.dt_dg, minus.dt_dg)):
        scale = np.abs(out.dt_dg).max() if a.ndim == 3 else np.abs(out.dt_dp).max() + 1e-300
        same &= np.abs(a - b).reshape(len(a), -1).max(axis=1) <= 1e-3 * scale
    return same


# ---------------------------------------------------------------------------------------------------------- flow curves
def check_flow(curve: FlowCurve, *, strain: float = 1.0, rate: float = 1.0, seed: int = 0) -> None:
    """Check a flow curve by itself and in the return map of J2 plasticity, at random plastic strains and rates.

    Parameters
    ----------
    curve
        The curve, a `FlowCurve`.
    strain, rate
        Sizes of the plastic strains and of their rates (per unit of time) at which it is tried.
    seed
        Of the random numbers.

    Raises
    ------
    LawError
        Saying what is wrong: a stress that is not positive, not a number or of the wrong shape; an answer that changes from
        call to call or with the company of other points; derivatives that differ from finite differences; a compiled curve
        that is another one; stresses of the return map that do not lie on the curve.

    """
    rng = np.random.default_rng(seed)
    a, r = strain * rng.uniform(0.0, 1.0, TRIALS) ** 2, rate * rng.uniform(0.0, 1.0, TRIALS)
    r[::7] = 0.0  # bodies at rest have a flow stress too
    with np.errstate(all="ignore"):
        found = [*_curve_wrong(curve, a, r)]
        if not found:
            found += [*_compiled_wrong(curve, a, r), *_return_wrong(curve, a, rate, rng)]
    _tell(f"flow curve {curve!r}", found)


def _curve_wrong(curve: FlowCurve, a: Array, r: Array) -> Iterator[str]:
    given = curve.stress(a.copy(), r.copy())
    for name, values in zip(("σ_y", "∂σ_y/∂ε̄", "∂σ_y/∂ε̄̇"), given if isinstance(given, tuple) else (given,)):
        if np.shape(values) not in ((), a.shape):
            yield f"{name} has the shape {np.shape(values)} for {len(a)} points; it must have one number a point"
            return
        if not np.isfinite(values).all():
            i = int(np.argmin(np.isfinite(np.broadcast_to(values, a.shape))))
            yield f"{name} is not a finite number at a plastic strain of {a[i]:.4g}"
            return
    first = partial(curve, a.copy(), r.copy())
    if (first[0] <= 0).any():
        i = int(np.argmin(first[0]))
        yield f"the flow stress is {first[0][i]:.4g} at a plastic strain of {a[i]:.4g}; it must stay positive"
    if not all(np.array_equal(x, y) for x, y in zip(first, partial(curve, a.copy(), r.copy()))):
        yield "the flow stress is another one when asked again: a curve must not remember anything"
    half = len(a) // 2
    alone = partial(curve, a[half:].copy(), r[half:].copy())
    if not all(np.allclose(x[half:], y, rtol=1e-12, atol=0.0) for x, y in zip(first, alone)):
        yield "the flow stress of a point depends on the other points"
    for number, x, name in ((0, a, "∂σ_y/∂ε̄"), (1, r, "∂σ_y/∂ε̄̇")):
        h = FD_STEP * float(x.max())
        mid = np.maximum(x, 1e-3 * float(x.max()))
        there = [partial(curve, m, r) if number == 0 else partial(curve, a, m) for m in (mid - h, mid, mid + h)]
        left, right = (there[1][0] - there[0][0]) / h, (there[2][0] - there[1][0]) / h
        unit = float(there[1][0].max()) / mid
        smooth = np.abs(right - left) <= 1e-2 * (np.abs(left) + np.abs(right)) + 1e-8 * unit
        worst = float((np.abs(0.5 * (left + right) - there[1][1 + number]) / unit)[smooth].max(initial=0.0))
        if worst > 1e3 * FD_ERROR:
            mend = "mend it, or return the stress alone"
            if number == 1 and isinstance(given, tuple) and len(given) == 2:
                mend = "a curve that depends on the rate returns three values, or the stress alone"
            yield f"{name} differs from finite differences by {worst:.1e} of the stress: {mend}"


def _compiled_wrong(curve: FlowCurve, a: Array, r: Array) -> Iterator[str]:
    f = curve.kernel()
    if f is None:
        return
    from prensa.materials.hardening import flow_stress

    compiled = np.array([flow_stress(f.kind, tuple(f.p), f.knots, f.coefficients, x, v, 1.0)[:2] for x, v in zip(a, r)])
    stress, by_strain, by_rate = partial(curve, a, r)
    if not np.allclose(compiled[:, 0], stress, rtol=1e-11, atol=0.0):
        yield "the compiled curve has other stresses than 'stress'"
    elif not np.allclose(compiled[:, 1], by_strain + by_rate, rtol=1e-8, atol=1e-8 * float(stress.max())):
        yield "the compiled curve has other slopes than 'stress'"


def _return_wrong(curve: FlowCurve, a: Array, rate: float, rng: np.random.Generator) -> Iterator[str]:
    from prensa.materials.return_map import return_map as flow

    n, G = len(a), 400.0 * float(stress_at(curve, a, np.full_like(a, rate)).max())
    K = 2.0 * G
    eps = rng.normal(size=(n, 3)) * 10 ** rng.uniform(-4, -1, size=(n, 1))
    old, new, failed = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros(n, dtype=np.bool_)
    old[:, 0] = a
    dt = 0.05 / rate
    for cauchy in (True, False):
        tau, dtau, eps_e = np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, 3))
        flow(eps, np.ones(n), old, 0, K, G, cauchy, curve, dt, tau, dtau, eps_e, new, failed, True)
        if failed.any():
            yield f"the return map finds no stress on the curve from a plastic strain of {a[failed][0]:.4g}"
            return
        jac = np.exp(eps.sum(axis=1)) if cauchy else 1.0
        flowed = new[:, 0] > a
        stress, _, by_rate = partial(curve, new[:, 0], (new[:, 0] - a) / dt)
        trial = 2.0 * G * np.sqrt(1.5 * ((eps - eps.mean(axis=1, keepdims=True)) ** 2).sum(axis=1))
        found = np.sqrt(1.5 * ((tau - tau.mean(axis=1, keepdims=True)) ** 2).sum(axis=1))
        blur = (
            1e-11 * trial + 1e-15 * np.abs(by_rate) * new[:, 0] / dt
        )  # what round-off of the difference makes of the rate
        excess = np.where(flowed, np.abs(found - jac * stress), found - jac * stress)
        if (excess > blur).any():
            yield f"a stress that the return map finds is off the curve by {float((excess / trial).max()):.1e}"
        if (new[:, 1] < 0.0).any():
            yield "plastic flow does negative work"


# ------------------------------------------------------------------------------------------------------------ materials
LAW_SPACES = ("plane strain", "plane stress", "3d")  # axisymmetry has the law of plane strain


def check_material(material: Material, *, strain: float = 0.03, dt: float = 0.1, seed: int = 0) -> None:
    """Check the laws that a material makes in every kinematics that it knows, in the plane, in plane stress and in space.

    Parameters
    ----------
    material
        The description, a `Material`.
    strain, dt
        Size of the strains at which it is tried, and duration of the increments.
    seed
        Of the random numbers.

    Raises
    ------
    LawError
        Saying what is wrong: an answer that is not a number, changes from call to call or with the company of other points;
        stress at rest; a stiffness at rest far from that of its moduli; a tangent that is not the derivative of the stress,
        or not symmetric though the law says so; a stress that does not turn with the body, is not the derivative of the
        energy or depends on the path of an elastic body; a principal stress that depends on the order of the strains;
        plastic flow that gives work back.

    """
    found = []
    if isinstance(material, IsotropicMaterial):
        found += [*_principal_wrong(material, strain, np.random.default_rng(seed))]
    for kinematics in material.kinematics if not found else ():
        for space in LAW_SPACES:
            rng = np.random.default_rng(seed)
            with np.errstate(all="ignore"):
                said = [*_law_wrong(material.law(kinematics, space), kinematics == "finite", space, strain, dt, rng)]
            found += [f"{kinematics} strain, {space}: {line}" for line in said]
    _tell(f"material {material!r}", found)


def _principal_wrong(material: IsotropicMaterial, strain: float, rng: np.random.Generator) -> Iterator[str]:
    eps = rng.normal(size=(TRIALS, 3)) * strain
    tau = principal_stress(material, eps)
    energy = np.asarray(material.energy(eps))
    for name, values, shape in (("energy", energy, (TRIALS,)), ("stress", tau, (TRIALS, 3))):
        if values.shape != shape:
            yield f"its {name} has the shape {values.shape} for strains of shape {eps.shape}; it must be {shape}"
            return
        if not np.isfinite(values).all():
            yield f"its {name} is not a finite number at strains {eps[~np.isfinite(values).reshape(TRIALS, -1).all(1)][0]}"
            return
    order = [2, 0, 1]
    turned = principal_stress(material, np.ascontiguousarray(eps[:, order]))
    if not np.allclose(turned, tau[:, order], rtol=1e-8, atol=1e-8 * float(np.abs(tau).max())):
        yield "its stresses depend on the order of the principal strains: it is not isotropic"


def _answer(law: Law, h: Array, old: Array, dt: float) -> Out:
    from prensa.materials.laws import At, Out

    n, c = len(h), law.layout.components
    out = Out(np.empty((n, c)), np.empty((n, c, c)), np.zeros((n, law.size)), np.zeros(n, dtype=np.bool_))
    law.update(np.ascontiguousarray(h), np.ascontiguousarray(old), At(dt, dt), out)
    return out


def _at_rest(law: Law, n: int) -> Array:
    virgin = np.zeros((n, law.size))
    for part in law.fields.values():
        virgin[:, part.columns] = part.initial
    return virgin


def _law_wrong(law: Law, finite: bool, space: str, strain: float, dt: float, rng: np.random.Generator) -> Iterator[str]:
    n, c = 60, law.layout.components
    virgin, E = _at_rest(law, n), law.E
    old = _answer(law, rng.normal(size=(n, c)) * 0.7 * strain, virgin, dt).new
    h = rng.normal(size=(n, c)) * np.where(np.arange(n) % 2, strain, strain / 300)[:, None]
    kept = old.copy()
    base = _answer(law, h, old, dt)
    if base.failed.any() or not all(np.isfinite(values).all() for values in base[:3]):
        yield f"it finds no answer at increments of size {strain:g}; give the 'strain' at which it is used"
        return
    again = _answer(law, h, old, dt)
    if not all(np.array_equal(x, y) for x, y in zip(base, again)) or not np.array_equal(old, kept):
        yield "the answer is another one when asked again: a law must not remember anything"
        return
    alone = _answer(law, h[n // 2 :], old[n // 2 :], dt)
    if not np.allclose(alone.P, base.P[n // 2 :], rtol=1e-10, atol=1e-12 * E):
        yield "the answer of a point depends on the other points"
    rest = _answer(law, np.zeros((n, c)), virgin, dt)
    if np.abs(rest.P).max() > 1e-10 * E:
        yield f"the undeformed body has a stress, {np.abs(rest.P).max():.3g}"
    told = E * (1 - law.nu) / ((1 + law.nu) * (1 - 2 * law.nu)) if space != "plane stress" else E / (1 - law.nu**2)
    if not 0.5 <= rest.A[0, 0, 0] / told <= 2.0:
        yield f"its stiffness at rest is {rest.A[0, 0, 0]:.3g}, its moduli say {told:.3g}: contact is scaled by these"
    yield from _stiffness_wrong(law, h, old, dt, base)
    if finite:
        yield from _turned_wrong(law, h, old, dt, base, space, rng)
    if law.plastic:
        yield from _flow_wrong(law, old, base)
    else:
        yield from _elastic_wrong(law, finite, strain, dt, virgin, rng)


def _stiffness_wrong(law: Law, h: Array, old: Array, dt: float, base: Out) -> Iterator[str]:
    d, size, worst = (1e-7 if law.plastic else 1e-6), np.abs(base.A).max(), 0.0
    for k in range(h.shape[1]):
        step = d * np.eye(h.shape[1])[k]
        plus, minus = _answer(law, h + step, old, dt), _answer(law, h - step, old, dt)
        smooth = np.abs(plus.A - minus.A).max(axis=(1, 2)) <= 1e-3 * size  # no kink within the step
        error = np.abs((plus.P - minus.P) / (2 * d) - base.A[:, :, k]).max(axis=1)
        worst = max(worst, float(error[smooth].max(initial=0.0)) / size)
    if worst > 2 * FD_ERROR:
        yield f"the tangent differs from finite differences of the stress by {worst:.1e} of its size"
    skew = np.abs(base.A - base.A.transpose(0, 2, 1)).max() / size
    if law.symmetric and skew > 1e-8:
        yield f"it says that its tangent is symmetric, and {skew:.1e} of it is not"


def _gradient(law: Law, h: Array) -> Array:
    """Gradients f (n, 3, 3) of h (n, c)."""
    f = np.broadcast_to(np.eye(3), (len(h), 3, 3)).copy()
    for place, (i, j) in enumerate(law.layout.full):
        f[:, i, j] += h[:, place]
    return f


def _components(law: Law, f: Array) -> Array:
    """Components (n, c) of tensors (n, 3, 3)."""
    return np.stack([f[:, i, j] for i, j in law.layout.full], axis=1)


def _turned_wrong(
    law: Law, h: Array, old: Array, dt: float, base: Out, space: str, rng: np.random.Generator
) -> Iterator[str]:
    Q = np.eye(3)
    if space == "3d":
        Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        Q *= np.linalg.det(Q)
    else:
        Q[:2, :2] = [[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]
    out = _answer(law, _components(law, Q @ _gradient(law, h) - np.eye(3)), old, dt)
    full = np.zeros((len(h), 3, 3))
    for place, (i, j) in enumerate(law.layout.full):
        full[:, i, j] = base.P[:, place]
    error = np.abs(out.P - _components(law, Q @ full)).max() / np.abs(base.P).max()
    if error > 1e-9:
        yield f"a rotation of the body does not turn its stress with it: off by {error:.1e} (it is not objective)"
    first = law.fields["elastic"].columns.stop if "elastic" in law.fields else law.size
    if np.abs(out.new[:, first:] - base.new[:, first:]).max(initial=0.0) > 1e-9 * np.abs(base.new).max():
        yield "a rotation of the body changes its history"


def _flow_wrong(law: Law, old: Array, base: Out) -> Iterator[str]:
    strain, work = (law.fields[name].columns for name in ("plastic_strain", "plastic_work"))
    if not (base.new[:, strain] > old[:, strain]).any():
        yield "nothing flows at the given 'strain': give one at which it does"
    if (base.new[:, strain] < old[:, strain]).any():
        yield "its plastic strain falls: it is a length of path"
    if (base.new[:, work] < old[:, work]).any():
        yield "plastic flow gives work back: dissipation must not be negative"


def _elastic_wrong(
    law: Law, finite: bool, strain: float, dt: float, virgin: Array, rng: np.random.Generator
) -> Iterator[str]:
    n, c = len(virgin), law.layout.components
    h, more = rng.normal(size=(2, n, c)) * 0.7 * strain
    P = _answer(law, h, virgin, dt).P
    d, worst = 1e-5, 0.0
    for k in range(c):
        step = d * np.eye(c)[k]
        up, down = (law.energy(_answer(law, h + sign * step, virgin, dt).new) for sign in (1.0, -1.0))
        worst = max(worst, float(np.abs((up - down) / (2 * d) - P[:, k]).max()))
    if law.symmetric and worst > 1e-5 * np.abs(P).max() + 1e-9 * law.E:
        yield f"its stress is not the derivative of its energy: off by {worst / np.abs(P).max():.1e}"
    f = _gradient(law, more) @ _gradient(law, h) - np.eye(3)
    whole = _answer(law, _components(law, f) if finite else h + more, virgin, dt)
    halves = _answer(law, more, _answer(law, h, virgin, dt).new, dt)
    a, b = law.cauchy(whole.new), law.cauchy(halves.new)
    if np.abs(a - b).max() > 1e-8 * np.abs(a).max():
        yield f"two steps of an elastic body give another stress than the whole: off by {np.abs(a - b).max():.2g}"


# ---------------------------------------------------------------------------------------------------------------- tools
DISTANCE = 1e-6  # accepted error of the normal from differences of g; of ∂s/∂x; and of curvatures over 1/size


def check_tool(tool: ToolShape, *, size: float | None = None, rounding: float = 0.0, seed: int = 0) -> None:
    """Check a tool's geometry in its own frame, at random points about its surface.

    Parameters
    ----------
    tool
        The tool, a `ToolShape`; a face looks down.
    size
        Length that tells how far from the surface, and how far along it, the tool is tried (default: from its outline).
    rounding
        Radius (length) of corners that the description leaves to the program.
    seed
        Of the random numbers.

    Raises
    ------
    LawError
        Saying what is wrong: arrays of the wrong shape or not finite; an answer that changes from call to call or with the
        company of other points; g that is no distance (|∇g| ≠ 1) or positive inside the outline; n ≠ ∇g; ∂n/∂x ≠ c e⊗e;
        ∂s/∂x ≠ (1 − g c) e; a foot that is not on the surface; a ray that does not end on it or passes it; a period that does
        not lead back to the start; sharp edges that are not in ``edges``, or edges that are not sharp.

    """
    rng = np.random.default_rng(seed)
    shape = tool.shape(np.array([0.0, -1.0]), rounding)
    if size is None:
        size = max((float(np.abs(p).max()) for p in tool.outline(1e-9)), default=0.0)
        size = size if size > 1e-6 else 1.0
    x = _about(shape, size, rng)
    found = [*_closest_wrong(shape, x)]
    if not found:
        close = shape.closest(x)
        found += [*_derivatives_wrong(shape, x, close, size), *_sides_wrong(tool, shape, x, close, size)]
    if not found:
        found += [
            *_rays_wrong(shape, x, close, size, rng),
            *_walk_wrong(shape, x, size),
            *_edges_wrong(tool, shape, size),
        ]
    _tell(f"tool {tool!r}", found)


def _about(shape: Tool, size: float, rng: np.random.Generator) -> Array:
    """Points (k, 2) around the tool, most of them near its surface."""
    x = rng.uniform(-1.5 * size, 1.5 * size, (2 * TRIALS, 2))
    try:
        close = shape.closest(x)
        near = x - (close.g * rng.uniform(0.9, 1.1, len(x)) + 0.01 * size * rng.normal(size=len(x)))[:, None] * close.n
    except (ValueError, IndexError, TypeError):
        return x
    return np.vstack([x, near]) if near.shape == x.shape and np.isfinite(near).all() else x


def _closest_wrong(shape: Tool, x: Array) -> Iterator[str]:
    first = [np.array(v) for v in shape.closest(x.copy())]
    for name, values, wanted in zip(("g", "n", "c", "s"), first, (x[:, 0], x, x[:, 0], x[:, 0])):
        if values.shape != wanted.shape:
            yield f"{name} has the shape {values.shape} for {len(x)} points; it must be {wanted.shape}"
            return
        if values.dtype != np.float64 or not np.isfinite(values).all():
            yield f"{name} is not a finite real number everywhere"
            return
    if not all(np.array_equal(a, b) for a, b in zip(first, shape.closest(x.copy()))):
        yield "the answer is another one when asked again: a tool must not remember anything"
    half = len(x) // 2
    if not all(np.allclose(a[half:], b, rtol=1e-12, atol=1e-14) for a, b in zip(first, shape.closest(x[half:].copy()))):
        yield "the answer for a point depends on the other points"
    if np.abs(np.hypot(first[1][:, 0], first[1][:, 1]) - 1.0).max() > 1e-9:
        yield "the normal n has not the length 1"


def _derivatives_wrong(shape: Tool, x: Array, close: Closest, size: float) -> Iterator[str]:
    """Differences of g, n and s, where they are smooth on both sides of a point and the curvature is not extreme."""
    h = 1e-5 * size
    clear = (np.abs(close.g) < 0.3 * size) & (np.abs(close.c) * size < 100.0)
    e = turned(close.n)
    slopes, bends, lengths, kink = [], [], [], np.zeros(len(x), dtype=bool)
    for j in range(2):
        step = h * np.eye(2)[j]
        plus, minus = shape.closest(x + step), shape.closest(x - step)
        ds = np.array([_wrapped(plus.s - close.s, shape.period), _wrapped(close.s - minus.s, shape.period)]) / h
        dg = np.array([plus.g - close.g, close.g - minus.g]) / h
        dn = np.array([plus.n - close.n, close.n - minus.n]) / h
        kink |= np.abs(dg[0] - dg[1]) > 2e3 * h / size
        kink |= np.abs(dn[0] - dn[1]).max(axis=1) > 2e5 * h / size**2
        kink |= np.abs(plus.c - minus.c) > 1e-2 * (np.abs(close.c) + 1.0 / size)
        slopes.append(dg.mean(axis=0))
        bends.append(dn.mean(axis=0))
        lengths.append(ds.mean(axis=0))
    smooth = clear & ~kink
    if smooth.sum() < 0.2 * max(int(clear.sum()), 1):
        yield "the distance has kinks almost everywhere near the surface"
        return
    slope, bend, length = np.stack(slopes, 1)[smooth], np.stack(bends, 2)[smooth], np.stack(lengths, 1)[smooth]
    n, e, c, g = close.n[smooth], e[smooth], close.c[smooth], close.g[smooth]
    off = np.abs(np.hypot(slope[:, 0], slope[:, 1]) - 1.0)
    if off.max() > 1e2 * DISTANCE:
        yield f"g is no distance: |∇g| differs from 1 by {off.max():.1e}"
        return
    if (error := np.abs(slope - n).max()) > 1e2 * DISTANCE:
        yield f"n differs from ∇g by {error:.1e}"
    wanted = c[:, None, None] * e[:, :, None] * e[:, None, :]
    error = float((np.abs(bend - wanted).max(axis=(1, 2)) / (np.abs(c) + 1.0 / size)).max())
    if error > 1e3 * DISTANCE:
        yield f"∂n/∂x differs from c e⊗e by {error:.1e} of it"
    error = float(np.abs(length - (1.0 - g * c)[:, None] * e).max())
    if error > 1e2 * DISTANCE:
        yield f"∂s/∂x differs from (1 − g c) e by {error:.1e}"


def _wrapped(ds: Array, period: float) -> Array:
    """Difference of surface coordinates on a closed surface."""
    return ds - period * np.round(ds / period) if np.isfinite(period) else ds


def _sides_wrong(tool: ToolShape, shape: Tool, x: Array, close: Closest, size: float) -> Iterator[str]:
    near = np.abs(close.g) < 0.3 * size
    foot = x - close.g[:, None] * close.n
    # seen from just before it: a sharp edge may belong to one of its sides
    before, ahead = near & (close.g > 0), 1e-5 * size
    off = np.abs(shape.closest((foot + ahead * close.n)[before]).g - ahead).max(initial=0.0)
    if off > 1e-6 * size:
        yield f"the foot x − g n of a point is not on the surface, but {off / size:.1e} of the size from it"
    polygons = tool.outline(6.0 * size)
    inside = np.logical_or.reduce([_within(p, x) for p in polygons])
    clear = near & (np.abs(close.g) > 0.02 * size)
    wrong = clear & (inside != (close.g < 0))
    if wrong.any():
        k = int(np.flatnonzero(wrong)[0])
        side = "inside" if inside[k] else "outside"
        yield f"g = {close.g[k]:.4g} at ({x[k, 0]:.4g}, {x[k, 1]:.4g}), which is {side} the outline: g is negative in the tool"


def _within(polygon: Array, x: Array) -> NDArray[np.bool_]:
    """Whether points (k, 2) are inside a polygon (m, 2), by crossings of a ray."""
    out = np.zeros(len(x), dtype=bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0)):
        between = (ay > x[:, 1]) != (by > x[:, 1])
        if between.any():
            out ^= between & (x[:, 0] < ax + (bx - ax) * (x[:, 1] - ay) / (by - ay if by != ay else 1.0))
    return out


def _rays_wrong(shape: Tool, x: Array, close: Closest, size: float, rng: np.random.Generator) -> Iterator[str]:
    limit = 20.0 * size
    before = close.g > 0.0
    for angle in rng.uniform(0.0, 2 * np.pi, 4):
        way = np.array([np.cos(angle), np.sin(angle)])
        h = np.asarray(shape.along(x[before], way, limit))
        if h.shape != (int(before.sum()),) or np.isnan(h).any():
            yield "'along' does not give a number for each point"
            return
        hits = np.isfinite(h)
        ends = x[before][hits] + h[hits, None] * way
        off = np.abs(shape.closest(ends).g).max(initial=0.0) if hits.any() else 0.0
        if off > 1e-8 * size:
            yield f"'along' ends {off / size:.1e} of the size from the surface"
            return
        if (h[hits] < -1e-9 * size).any():
            yield "'along' is negative for a point outside the tool"
            return
        for share in (0.2, 0.5, 0.8, 0.95):
            passed = shape.closest(x[before][hits] + share * h[hits, None] * way).g if hits.any() else np.zeros(0)
            if (passed < -1e-8 * size).any():
                yield "'along' passes through the tool"
                return
        foot = x - close.g[:, None] * close.n
        seen = np.flatnonzero(before & (close.g < size) & (np.abs(shape.closest(foot).g) < 1e-9 * size))
        if len(seen):
            k = seen[int(np.argmax(-close.n[seen] @ way))]
            straight = float(np.asarray(shape.along(x[[k]], -close.n[k], limit))[0])
            if not abs(straight - close.g[k]) <= 1e-6 * size:
                yield f"'along' towards the foot of a point gives {straight:.6g}, its distance is {close.g[k]:.6g}"
                return


def _walk_wrong(shape: Tool, x: Array, size: float) -> Iterator[str]:
    """Once around a closed surface by its own coordinate leads back to the start."""
    period = shape.period
    if not np.isfinite(period):
        return
    off = 0.01 * size  # beside the surface, where edges have a normal
    close = shape.closest(x[:1])
    at = x[:1] + (off - close.g)[:, None] * close.n
    jumps = False
    start, h, walked, steps, close = at.copy(), period / 2000, 0.0, 0, shape.closest(at)
    while walked < period and steps < 8000:
        to = at + h * turned(close.n)
        after = shape.closest(to)
        to = to + (off - after.g)[:, None] * after.n
        after = shape.closest(to)
        ds = float(_wrapped(after.s - close.s, period)[0])
        jumps |= abs(ds) > 20 * h and float((after.n * close.n).sum()) > 0.95
        walked += ds
        at, close, steps = to, after, steps + 1
    if jumps or walked < period or np.hypot(*(at - start)[0]) > 5 * h + 3 * off:
        yield f"walking along the surface by its 'period' {period:.6g} does not lead back to the start"


def _edges_wrong(tool: ToolShape, shape: Tool, size: float) -> Iterator[str]:
    edges = np.asarray(shape.edges)
    if edges.ndim != 2 or edges.shape[1] != 4:
        yield f"'edges' has the shape {edges.shape}; it must be (k, 4)"
        return
    tiny = 1e-4 * size
    for px, py, ex, ey in edges:
        ends = np.array([[px - tiny * ex, py - tiny * ey], [px + tiny * ex, py + tiny * ey]])
        n = shape.closest(ends + 2 * tiny * np.array([ey, -ex])).n
        off = abs(float(shape.closest(np.array([[px, py]])).g[0]))
        if off > 1e-6 * size or np.abs(n[1] - n[0]).max() < 0.05:
            yield f"the edge at ({px:.4g}, {py:.4g}) is not a sharp one of the surface"
    for polygon in tool.outline(2.0 * size):
        for place in _corners(shape, polygon, size):
            if not (np.hypot(*(edges[:, :2] - place).T) < 1e-4 * size).any():
                yield f"the surface has a sharp convex edge near ({place[0]:.4g}, {place[1]:.4g}) that is not in 'edges'"
                return


def _corners(shape: Tool, polygon: Array, size: float) -> Iterator[Array]:
    """Places where the normals of the surface jump to the outside, found by halving between vertices of the outline."""
    on = np.abs(shape.closest(polygon).g) < 1e-3 * size
    x = polygon - (close := shape.closest(polygon)).g[:, None] * close.n
    for i, j in pairwise([*range(len(x)), 0]):
        if not (on[i] and on[j]) or np.hypot(*(x[j] - x[i])) > 3.0 * size:
            continue
        a, b = x[i] + 0.01 * (x[j] - x[i]), x[j]
        while np.hypot(*(b - a)) > 2e-5 * size:
            to = np.array([0.5 * (a + b)])
            middle = (to - (m := shape.closest(to)).g[:, None] * m.n)[0]
            n = shape.closest(np.array([a, middle, b])).n
            if min(np.hypot(*(a - middle)), np.hypot(*(b - middle))) < 1e-3 * np.hypot(*(b - a)) or n[0] @ n[2] > 0.999:
                break  # the surface leads away from the chord, or does not turn
            a, b = (a, middle) if n[0] @ n[1] < n[1] @ n[2] else (middle, b)
        way = b - a
        if not 0.0 < np.hypot(*way) <= 2e-5 * size:
            continue
        middle, way = 0.5 * (a + b), 1e-4 * size * way / np.hypot(*way)
        n = shape.closest(np.array([middle - way, middle + way])).n
        if n[0] @ n[1] < 0.98 and shape.closest(np.array([middle + 1e-5 * size * (n[0] + n[1])])).c[0] > 1e3 / size:
            yield middle  # the normals fan out: convex
