"""Materials as the solver sees them: batch laws of h = f − I and their own history, pure, with exact tangents.

An isotropic law is written in principal strains only; `prensa.kernels.principal_axes` wraps it for small and finite strain, in
plane and space. Those that need no principal axes are point functions of their own. Tensors have the c components, and histories
begin with the k symmetric ones, of the law's `TensorLayout`: 5 and 4 in the plane, 9 and 6 in space. The descriptions that make
the laws are in `prensa.materials.solids`, one a file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from prensa.kernels import principal_axes
from prensa.layout import PLANE, TensorLayout
from prensa.materials import elastic
from prensa.materials.flow_curve import FlowCurve, FlowParameters, stress_at
from prensa.materials.hardening import stresses
from prensa.materials.j2 import NO_CURVE, MetalForm, begin_finite, finite, numbers, principal, small
from prensa.materials.point_form import PointLaw
from prensa.materials.protocol import At, Field, Material, Out, PrincipalElasticity
from prensa.materials.return_map import return_map
from prensa.types import Array

__all__ = ["At", "Field", "Material", "Out"]


STRESSES_AT_ONCE = 4096
"""Points whose stresses are found together: moduli of all points of a large body would take a gigabyte."""

@dataclass(frozen=True)
class _Isotropic:
    """Spectral wrapping of a law in principal strains."""

    E: float
    nu: float
    finite: bool
    plastic: bool = field(default=False, init=False)
    layout: TensorLayout = field(default=PLANE, kw_only=True)

    @property
    def size(self) -> int:
        """Columns of the history: b_e − I or the elastic strain."""
        return self.layout.kept

    @property
    def fields(self) -> Mapping[str, Field]:
        """Of the history: b_e − I (finite) or the elastic strain (small)."""
        return {"elastic": Field(slice(0, self.size), travel="strain")}

    @property
    def symmetric(self) -> bool:
        """True: stresses derive from an energy."""
        return True

    @property
    def linear(self) -> bool:
        """False, unless a law says otherwise."""
        return False

    @property
    def fbar_has_energy(self) -> bool:
        """False, unless a law says otherwise."""
        return False

    def thickness(self, history: Array) -> Array | None:
        """None: the law does not change the thickness that the element integrates over."""
        return None

    @property
    def lam(self) -> float:
        return self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))

    @property
    def mu(self) -> float:
        return self.E / (2 * (1 + self.nu))

    def modulus(self) -> float:
        """Plane-strain modulus E/(1 − ν²)."""
        return self.E / (1 - self.nu**2)

    def confined_modulus(self) -> float:
        """Stress over strain of a layer that cannot spread, λ + 2μ."""
        return self.lam + 2.0 * self.mu

    def principal(
        self, eps: Array, frame: Array, old: Array, at: At, tau: Array, dtau: Array, eps_e: Array, out: Out
    ) -> None:
        """The law itself: trial principal strains (n, 3) → stresses, slopes, elastic strains; Hencky's, unless one says other."""
        tau[:] = self.lam * eps.sum(axis=1, keepdims=True) + 2.0 * self.mu * eps
        dtau[:] = self.lam + 2.0 * self.mu * np.eye(3)
        eps_e[:] = eps

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, h) → out; see `Material`."""
        n = len(h)
        eps, tau, eps_e = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
        frame, dtau = np.empty((n, principal_axes.FRAME)), np.empty((n, 3, 3))
        principal_axes.trial(h, old, self.finite, eps, frame, out.failed)
        self.principal(eps, frame, old, at, tau, dtau, eps_e, out)
        principal_axes.stress(h, frame, tau, dtau, eps_e, self.finite, out.P, out.A, out.new, at.tangent)

    def elastic_strains(self, history: Array) -> Array:
        """Principal elastic strains (..., 3) of a committed history."""
        out = np.empty((*history.shape[:-1], 3))
        rows = np.ascontiguousarray(history).reshape(-1, history.shape[-1])
        principal_axes.elastic_strains(rows, self.layout.kept, self.finite, out.reshape(-1, 3))
        return out

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        return elastic.quadratic_energy(self.elastic_strains(history), self.lam, self.mu)

    def cauchy(self, history: Array) -> Array:
        """Cauchy stress (n, k) xx, yy, zz, xy[, xz, yz]: the law at rest (h = 0) on the committed history."""
        n, c = len(history), self.layout.components
        found, k = np.empty((n, len(self.layout.cauchy))), min(n, STRESSES_AT_ONCE)
        h = np.zeros((k, c))
        room = Out(np.empty((k, c)), np.empty((k, c, c)), np.empty((k, history.shape[1])), np.zeros(k, dtype=np.bool_))
        for first in range(0, n, STRESSES_AT_ONCE):
            part = history[first : first + STRESSES_AT_ONCE]
            m = len(part)
            out = Out(room.P[:m], room.A[:m], room.new[:m], room.failed[:m])
            self.update(h[:m], part, At(1.0, 0.0, tangent=False), out)
            found[first : first + STRESSES_AT_ONCE] = out.P[:, self.layout.cauchy]
        return found


@dataclass(frozen=True)
class Hencky(_Isotropic):
    """Linear elasticity: Hooke's law in small strain, Hencky's in finite strain."""

    @property
    def linear(self) -> bool:
        """In small strain."""
        return not self.finite

    def point_law(self, seconds: float) -> PointLaw | None:
        """Of finite strain in the plane."""
        if not self.finite or self.layout is not PLANE:
            return None
        p = numbers(self.E / (3 * (1 - 2 * self.nu)), self.mu, NO_CURVE, seconds)
        return PointLaw(MetalForm(None, False), p, NO_CURVE.knots, NO_CURVE.coefficients)

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, k) → out; see `Material`."""
        if self.finite and self.layout is PLANE:
            bulk = self.E / (3 * (1 - 2 * self.nu))
            finite(h, old, 0, bulk, self.mu, True, NO_CURVE, 0.0, out.P, out.A, out.new, out.failed, at.tangent)
        elif self.finite:
            super().update(h, old, at, out)
        else:
            elastic.update(elastic.hooke, h, old, self.lam, self.mu, *out, at.tangent)


@dataclass(frozen=True)
class NeoHooke(_Isotropic):
    """Compressible neo-Hooke."""

    @property
    def fbar_has_energy(self) -> bool:
        """True, see `prensa.system.matrix_symmetry`."""
        return True

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, k) → out; see `Material`."""
        elastic.update(elastic.neo_hooke, h, old, self.lam, self.mu, *out, at.tangent)

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        return elastic.neo_hooke_energy(self.elastic_strains(history), self.lam, self.mu)


@dataclass(frozen=True)
class StVenantKirchhoff(_Isotropic):
    """St. Venant-Kirchhoff."""

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, k) → out; see `Material`."""
        elastic.update(elastic.st_venant_kirchhoff, h, old, self.lam, self.mu, *out, at.tangent)

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        return elastic.quadratic_energy(0.5 * np.expm1(2.0 * self.elastic_strains(history)), self.lam, self.mu)


@dataclass(frozen=True)
class J2(_Isotropic):
    """Von Mises plasticity; fields of the history: equivalent plastic strain, plastic work per initial volume, trial strains.

    ``trial`` is what the elastic strains would be if nothing had flowed in the last increment: b_e − I or the elastic strain
    of the increment before, carried along by the motion. What the two differ by is the last increment's plastic strain, in
    the place where the body is now (see `begin`).

    ``flow``: parameters of the compiled flow curve; None where ``curve``, the description, is all there is.
    """

    flow: FlowParameters | None = field(default=None, repr=False)
    yield_on_cauchy: bool = True
    curve: FlowCurve | None = None
    plastic: bool = field(default=True, init=False)

    @property
    def size(self) -> int:
        """Columns of the history: b_e − I or the elastic strain, plastic strain, plastic work, trial strain."""
        return 2 * self.layout.kept + 2

    @property
    def fields(self) -> Mapping[str, Field]:
        """Of the history: elastic strains, plastic strain, plastic work, trial strains."""
        k = self.layout.kept
        return {
            "elastic": Field(slice(0, k), travel="strain"),
            "plastic_strain": Field(slice(k, k + 1), travel="growing"),
            "plastic_work": Field(slice(k + 1, k + 2), travel="growing"),
            "trial": Field(slice(k + 2, 2 * k + 2), travel="flow"),
        }

    def point_law(self, seconds: float) -> PointLaw | None:
        """Of finite strain in the plane, with a compiled flow curve."""
        f = self.flow
        if f is None or not self.finite or self.layout is not PLANE:
            return None
        p = numbers(self.E / (3 * (1 - 2 * self.nu)), self.mu, f, seconds)
        return PointLaw(MetalForm(f.kind, self.yield_on_cauchy), p, f.knots, f.coefficients)

    @property
    def symmetric(self) -> bool:
        """Unless the limit is one of the Cauchy stress in finite strain, which makes flow depend on the volume."""
        return not (self.finite and self.yield_on_cauchy)

    def principal(
        self, eps: Array, frame: Array, old: Array, at: At, tau: Array, dtau: Array, eps_e: Array, out: Out
    ) -> None:
        """Trial principal strains (n, 3) → stresses, slopes, elastic strains, plastic strain and work."""
        f = self.flow
        bulk = self.E / (3 * (1 - 2 * self.nu))
        if f is None:
            assert self.curve is not None
            return_map(
                eps, frame[:, -1], old, self.layout.kept, bulk, self.mu,
                self.finite and self.yield_on_cauchy, self.curve, at.dt, tau, dtau, eps_e, out.new, out.failed, at.tangent,
                at.flows, at.secant,
            )  # fmt: skip
            return
        principal(
            eps, frame[:, -1], old, self.layout.kept, bulk, self.mu, self.finite and self.yield_on_cauchy, f, at.dt,
            tau, dtau, eps_e, out.new, out.failed, at.tangent, at.flows, at.secant,
        )  # fmt: skip

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, h) → out; see `Material`."""
        # where no flow was shifted, what would have been carried along is the committed elastic tensor itself
        kept, f = self.layout.kept + 2 if at.begun else 0, self.flow
        if f is not None and self.finite and self.layout is PLANE:
            finite(
                h, old, kept, self.E / (3 * (1 - 2 * self.nu)), self.mu, self.yield_on_cauchy, f, at.dt, out.P, out.A,
                out.new, out.failed, at.tangent, at.flows, at.secant,
            )  # fmt: skip
            return
        if f is not None and not self.finite:
            small(
                h, old, kept, self.E / (3 * (1 - 2 * self.nu)), self.mu, f, at.dt, out.P, out.A, out.new, out.failed,
                at.tangent, at.flows, at.secant,
            )  # fmt: skip
            return
        super().update(h, old, at, out)
        principal_axes.keep_trial(h, old, kept, out.new, self.finite)

    def begin(self, history: Array, share: float) -> Array:
        """What an increment begins with: a committed history (n, h) after a ``share`` of the last plastic strain more.

        With the backward difference of second order, eᵖ − eᵖ_n = share (eᵖ_n − eᵖ_(n−1)) + Δ n, an increment is one of backward
        Euler that starts there (Eckert, Baaser, Gross & Scherf 2004).
        """
        k, f = self.layout.kept, self.flow
        if share and f is not None and self.finite and self.layout is PLANE:
            out = np.empty_like(history)
            begin_finite(history, share, self.mu, self.yield_on_cauchy, f, out)
            return out
        out = history.copy()
        if not share:  # as `begin` has it, which need not be compiled for that
            out[:, k + 2 : 2 * k + 2] = history[:, :k]
            return out
        principal_axes.begin(history, k, self.finite, share, out)
        strain, more = np.ascontiguousarray(out[:, k]), out[:, k] - history[:, k]
        # The shift is plastic flow as well: its work belongs to the balance, by the trapezoid of the flow stress, which is at
        # the last increment's rate what the stress of its end is.
        growth = self.flow_stress(strain) - self.flow_stress(np.ascontiguousarray(history[:, k]))
        e = self.elastic_strains(history)
        flow = 2.0 * self.mu * np.sqrt(1.5) * np.linalg.norm(e - e.mean(axis=1)[:, None], axis=1)
        out[:, k + 1] += (flow + 0.5 * self.of_cauchy(history) * growth) * more
        return out

    def of_cauchy(self, history: Array) -> Array:
        """Kirchhoff stress over the one that the flow curve limits (n,), of a committed history (n, h)."""
        if not (self.finite and self.yield_on_cauchy):
            return np.ones(len(history))
        if self.layout is PLANE:  # J without its logarithm
            b11, b22, b33, b12 = history[:, :4].T
            return np.asarray(np.sqrt(((1.0 + b11) * (1.0 + b22) - b12 * b12) * (1.0 + b33)))
        return np.exp(self.elastic_strains(history).sum(axis=-1))  # plastic flow is isochoric

    def flow_stress(self, strain: Array) -> Array:
        """Flow stress (n,) at plastic strains (n,), at rest."""
        if self.flow is None:
            assert self.curve is not None
            return stress_at(self.curve, strain, np.zeros_like(strain))
        return stresses(self.flow, strain)[:, 0]

    def shear_strength(self, history: Array) -> Array:
        """Shear yield stress k = σ_y/√3 (n,), a Cauchy stress, of a committed history (n, h) at rest."""
        out = self.flow_stress(np.ascontiguousarray(history[:, self.layout.kept]))
        if self.finite and not self.yield_on_cauchy:
            out /= np.exp(self.elastic_strains(history).sum(axis=-1))  # plastic flow is isochoric
        return out / np.sqrt(3.0)

    def cauchy(self, history: Array) -> Array:
        """Cauchy stress (n, k) from the elastic strains alone (a rate-dependent law at rest would flow)."""
        if self.finite and self.layout is PLANE:  # without the kernels of an update, which would be compiled for it
            return elastic.hencky_at_rest(history[:, : self.layout.kept], self.lam, self.mu)
        elastic_part = np.ascontiguousarray(history[:, : self.layout.kept])
        return Hencky(self.E, self.nu, self.finite, layout=self.layout).cauchy(elastic_part)


@dataclass(frozen=True)
class Principal(_Isotropic):
    """Elasticity that a description states in NumPy: an energy or stresses as functions of the principal strains."""

    description: PrincipalElasticity = field(default=None)  # type: ignore[assignment]

    @property
    def symmetric(self) -> bool:
        """As the description says."""
        return self.description.symmetric

    def principal(
        self, eps: Array, frame: Array, old: Array, at: At, tau: Array, dtau: Array, eps_e: Array, out: Out
    ) -> None:
        """Trial principal strains (n, 3) → stresses, slopes, elastic strains."""
        with np.errstate(all="ignore"):
            tau[:], slopes = self.description.answer(eps, at.tangent)
            if slopes is not None:
                dtau[:] = slopes
        out.failed[~np.isfinite(tau).all(axis=1)] = True
        eps_e[:] = eps

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        eps = self.elastic_strains(history)
        return np.asarray(self.description.energy(eps.reshape(-1, 3)), dtype=np.float64).reshape(eps.shape[:-1])
