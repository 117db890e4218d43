"""The suites of flow curves and materials."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from prensa.materials.flow_curve import FlowCurve, partial, stress_at
from prensa.materials.material import IsotropicMaterial, Material, principal_stress
from prensa.precision import EPS, FIRST_DIFFERENCE, NEGLIGIBLE, ROUND_OFF
from prensa.testing.common import FD_ERROR, KINK, TRIALS, raise_if_wrong
from prensa.types import Array

if TYPE_CHECKING:
    from prensa.materials.laws import Material as Law
    from prensa.materials.laws import Out


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
    raise_if_wrong(f"flow curve {curve!r}", found)


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
    if not all(np.allclose(x[half:], y, rtol=ROUND_OFF, atol=0.0) for x, y in zip(first, alone)):
        yield "the flow stress of a point depends on the other points"
    for number, x, name in ((0, a, "∂σ_y/∂ε̄"), (1, r, "∂σ_y/∂ε̄̇")):
        h = FIRST_DIFFERENCE * float(x.max())
        mid = np.maximum(x, 2 * h)
        there = [partial(curve, m, r) if number == 0 else partial(curve, a, m) for m in (mid - h, mid, mid + h)]
        left, right = (there[1][0] - there[0][0]) / h, (there[2][0] - there[1][0]) / h
        unit = float(there[1][0].max()) / mid
        smooth = np.abs(right - left) <= KINK * (np.abs(left) + np.abs(right)) + NEGLIGIBLE * unit
        worst = float((np.abs(0.5 * (left + right) - there[1][1 + number]) / unit)[smooth].max(initial=0.0))
        if worst > KINK:
            mend = "mend it, or return the stress alone"
            if number == 1 and isinstance(given, tuple) and len(given) == 2:
                mend = "a curve that depends on the rate returns three values, or the stress alone"
            yield f"{name} differs from finite differences by {worst:.1e} of the stress: {mend}"


def _compiled_wrong(curve: FlowCurve, a: Array, r: Array) -> Iterator[str]:
    f = curve.kernel()
    if f is None:
        return
    from prensa.materials.hardening import stresses

    compiled = stresses(f, a, r, 1.0)[:, :2]
    stress, by_strain, by_rate = partial(curve, a, r)
    if not np.allclose(compiled[:, 0], stress, rtol=ROUND_OFF, atol=0.0):
        yield "the compiled curve has other stresses than 'stress'"
    elif not np.allclose(compiled[:, 1], by_strain + by_rate, rtol=NEGLIGIBLE, atol=NEGLIGIBLE * float(stress.max())):
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
            ROUND_OFF * trial + 4 * EPS * np.abs(by_rate) * new[:, 0] / dt
        )  # what round-off of the difference makes of the rate
        excess = np.where(flowed, np.abs(found - jac * stress), found - jac * stress)
        if (excess > blur).any():
            yield f"a stress that the return map finds is off the curve by {float((excess / trial).max()):.1e}"
        if (new[:, 1] < 0.0).any():
            yield "plastic flow does negative work"


# ------------------------------------------------------------------------------------------------------------ materials
LAW_SPACES = ("plane strain", "plane stress", "solid")  # axisymmetry has the law of plane strain


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
        for space in LAW_SPACES if material.in_space else LAW_SPACES[:-1]:
            rng = np.random.default_rng(seed)
            with np.errstate(all="ignore"):
                said = [*_law_wrong(material.law(kinematics, space), kinematics == "finite", space, strain, dt, rng)]
            found += [f"{kinematics} strain, {space}: {line}" for line in said]
    raise_if_wrong(f"material {material!r}", found)


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
    if not np.allclose(turned, tau[:, order], rtol=NEGLIGIBLE, atol=NEGLIGIBLE * float(np.abs(tau).max())):
        yield "its stresses depend on the order of the principal strains: it is not isotropic"


def _answer(law: Law, h: Array, old: Array, dt: float) -> Out:
    from prensa.materials.laws import At, Out

    n, c = len(h), law.layout.components
    out = Out(np.empty((n, c)), np.empty((n, c, c)), np.zeros((n, law.size)), np.zeros(n, dtype=np.bool_))
    law.update(np.ascontiguousarray(h), np.ascontiguousarray(old), At(dt, dt), out)
    return out


def _at_rest(law: Law, n: int) -> Array:
    undeformed = np.zeros((n, law.size))
    for part in law.fields.values():
        undeformed[:, part.columns] = part.start(np.zeros((n, 2)))
    return undeformed


def _law_wrong(law: Law, finite: bool, space: str, strain: float, dt: float, rng: np.random.Generator) -> Iterator[str]:
    n, c = 60, law.layout.components
    undeformed, E = _at_rest(law, n), law.E
    old = _answer(law, rng.normal(size=(n, c)) * strain, undeformed, dt).new
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
    if not np.allclose(alone.P, base.P[n // 2 :], rtol=ROUND_OFF, atol=ROUND_OFF * E):
        yield "the answer of a point depends on the other points"
    rest = _answer(law, np.zeros((n, c)), undeformed, dt)
    if np.abs(rest.P).max() > ROUND_OFF * E:
        yield f"the undeformed body has a stress, {np.abs(rest.P).max():.3g}"
    expected = E * (1 - law.nu) / ((1 + law.nu) * (1 - 2 * law.nu)) if space != "plane stress" else E / (1 - law.nu**2)
    if not 0.5 <= rest.A[0, 0, 0] / expected <= 2.0:
        yield f"its stiffness at rest is {rest.A[0, 0, 0]:.3g}, its moduli say {expected:.3g}: contact is scaled by these"
    yield from _stiffness_wrong(law, h, old, dt, base)
    if finite:
        yield from _turned_wrong(law, h, old, dt, base, space, rng)
    if law.plastic:
        yield from _flow_wrong(law, old, base)
    else:
        yield from _elastic_wrong(law, finite, strain, dt, undeformed, rng)


def _stiffness_wrong(law: Law, h: Array, old: Array, dt: float, base: Out) -> Iterator[str]:
    d, size, worst = (EPS**0.5 if law.plastic else FIRST_DIFFERENCE), np.abs(base.A).max(), 0.0
    for k in range(h.shape[1]):
        step = d * np.eye(h.shape[1])[k]
        plus, minus = _answer(law, h + step, old, dt), _answer(law, h - step, old, dt)
        smooth = np.abs(plus.A - minus.A).max(axis=(1, 2)) <= KINK * size  # no kink within the step
        error = np.abs((plus.P - minus.P) / (2 * d) - base.A[:, :, k]).max(axis=1)
        worst = max(worst, float(error[smooth].max(initial=0.0)) / size)
    if worst > FD_ERROR:
        yield f"the tangent differs from finite differences of the stress by {worst:.1e} of its size"
    skew = np.abs(base.A - base.A.transpose(0, 2, 1)).max() / size
    if law.symmetric and skew > NEGLIGIBLE:
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
    if space == "solid":
        Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        Q *= np.linalg.det(Q)
    else:
        Q[:2, :2] = [[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]]
    out = _answer(law, _components(law, Q @ _gradient(law, h) - np.eye(3)), old, dt)
    full = np.zeros((len(h), 3, 3))
    for place, (i, j) in enumerate(law.layout.full):
        full[:, i, j] = base.P[:, place]
    error = np.abs(out.P - _components(law, Q @ full)).max() / np.abs(base.P).max()
    if error > NEGLIGIBLE:
        yield f"a rotation of the body does not turn its stress with it: off by {error:.1e} (it is not objective)"
    turns = np.zeros(law.size, dtype=bool)
    for field in law.fields.values():
        turns[field.columns] = field.travel in ("strain", "flow", "axes")
    if np.abs(out.new[:, ~turns] - base.new[:, ~turns]).max(initial=0.0) > NEGLIGIBLE * np.abs(base.new).max():
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
    law: Law, finite: bool, strain: float, dt: float, undeformed: Array, rng: np.random.Generator
) -> Iterator[str]:
    n, c = len(undeformed), law.layout.components
    h, more = rng.normal(size=(2, n, c)) * strain
    P = _answer(law, h, undeformed, dt).P
    d, worst = FIRST_DIFFERENCE, 0.0
    for k in range(c):
        step = d * np.eye(c)[k]
        up, down = (law.energy(_answer(law, h + sign * step, undeformed, dt).new) for sign in (1.0, -1.0))
        worst = max(worst, float(np.abs((up - down) / (2 * d) - P[:, k]).max()))
    if law.symmetric and worst > FD_ERROR * np.abs(P).max() + NEGLIGIBLE * law.E:
        yield f"its stress is not the derivative of its energy: off by {worst / np.abs(P).max():.1e}"
    f = _gradient(law, more) @ _gradient(law, h) - np.eye(3)
    whole = _answer(law, _components(law, f) if finite else h + more, undeformed, dt)
    halves = _answer(law, more, _answer(law, h, undeformed, dt).new, dt)
    a, b = law.cauchy(whole.new), law.cauchy(halves.new)
    if np.abs(a - b).max() > NEGLIGIBLE * np.abs(a).max():
        yield f"two steps of an elastic body give another stress than the whole: off by {np.abs(a - b).max():.2g}"
