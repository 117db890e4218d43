"""Plane stress: an adaptor around any law that finds the thickness stretch at which σ₃₃ vanishes.

The unknown of each point is ε = ln f₃₃ (finite strain) or h₃₃ (small strain), found by Newton with bisection as the
safeguard, to round-off, so that the condensed tangent A − A_{·3} ⊗ A_{3·}/A₃₃ is the exact derivative (de Souza Neto, Perić
& Owen 2008, ch. 9). The element integrates over the initial thickness; P and A are therefore multiplied by the committed
thickness over the initial one, which the element cannot know.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from prensa.layout import PLANE, TensorLayout
from prensa.materials.protocol import At, Field, Flowing, Material, Out
from prensa.types import Array

MAX_ITERATIONS = 60  # for the stretch of the thickness; points that need more fail
STRESS = 1e-14  # σ₃₃ over the largest in-plane stress that counts as zero …
FLOOR = 1e-11  # … or that counts as zero when Newton no longer lowers it …
STEP = 1e-15  # … or a correction that round-off of the strains makes


@dataclass(frozen=True)
class PlaneStress:
    """``law`` under σ₃₃ = 0. The last column of the history is the thickness over the initial one, minus 1."""

    law: Material
    finite: bool

    @property
    def layout(self) -> TensorLayout:
        """Of plane problems."""
        return PLANE

    @property
    def size(self) -> int:
        """Length of the history: that of the law and the thickness."""
        return self.law.size + 1

    @property
    def fields(self) -> Mapping[str, Field]:
        """Of the history: those of the law, and the thickness over the initial one, minus 1."""
        return {**self.law.fields, "thickness": Field(slice(self.size - 1, self.size))}

    @property
    def linear(self) -> bool:
        """As the law: eliminating a stress keeps linearity."""
        return self.law.linear

    @property
    def fbar_has_energy(self) -> bool:
        """False: F-bar has no meaning in plane stress."""
        return False

    @property
    def plastic(self) -> bool:
        """Whether the law flows."""
        return self.law.plastic

    @property
    def symmetric(self) -> bool:
        """As the law: eliminating a stress keeps symmetry."""
        return self.law.symmetric

    @property
    def E(self) -> float:
        """Young's modulus."""
        return self.law.E

    @property
    def nu(self) -> float:
        """Poisson's ratio."""
        return self.law.nu

    def modulus(self) -> float:
        """Stiffness scale, E* = E in plane stress."""
        return self.law.E

    def confined_modulus(self) -> float:
        """Stress over strain of a layer that cannot spread in the plane and is free across it."""
        return self.law.E / (1.0 - self.law.nu**2)

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        return self.law.energy(history)

    def cauchy(self, history: Array) -> Array:
        """Cauchy stress (n, 4) xx, yy, zz, xy of a committed history (n, h); zz is zero to round-off."""
        return self.law.cauchy(np.ascontiguousarray(history[:, :-1]))

    def flow_stress(self, strain: Array) -> Array:
        """Flow stress (n,) at plastic strains (n,), at rest, where the law has one."""
        law: Any = self.law
        return np.asarray(law.flow_stress(strain))

    def shear_strength(self, history: Array) -> Array:
        """Shear yield stress (n,) of a committed history (n, h), where the law has one."""
        law: Any = self.law
        return np.asarray(law.shear_strength(history[:, :-1]))

    def begin(self, history: Array, share: float) -> Array:
        """As the law; the thickness is that of the motion."""
        if not isinstance(self.law, Flowing):
            return history
        return np.append(self.law.begin(np.ascontiguousarray(history[:, :-1]), share), history[:, -1:], axis=1)

    def thickness(self, history: Array) -> Array:
        """Thickness over the initial one, (..., h) → (...)."""
        return 1.0 + history[..., -1]

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """In-plane components of h (n, 5) (h₃₃ is found here), old (n, h) → out; see `Material`."""
        inner = np.ascontiguousarray(old[:, :-1])
        h33 = self._thin(h, inner, at._replace(tangent=True, secant=0.0), out)  # the condensation needs it in any case
        P, A = out.P, out.A
        pivot = A[:, 4, 4]
        # Not 'pivot == 0': one that is NaN has to count as well.
        singular = ~(np.abs(pivot) > 0.0)
        out.failed[singular] = True
        A -= A[:, :, 4:] * (A[:, 4:, :] / np.where(singular, 1.0, pivot)[:, None, None])
        A[:, 4, :] = 0.0
        A[:, :, 4] = 0.0
        P[:, 4] = 0.0
        if self.finite:
            ratio = 1.0 + old[:, -1]
            P *= ratio[:, None]
            A *= ratio[:, None, None]
            out.new[:, -1] = old[:, -1] + ratio * h33
        else:
            out.new[:, -1] = old[:, -1] + h33

    def _thin(self, h: Array, old: Array, at: At, out: Out) -> Array:
        """H₃₃ (n,) of zero P₃₃; the law's answer there is left in out."""
        n, c, stretch = len(h), self.layout.components, h.copy()
        poisson = -self.nu / (1.0 - self.nu)
        trace = h[:, 0] + h[:, 3]
        with np.errstate(invalid="ignore", divide="ignore"):
            # exact for Hencky's law, whose committed state is one of plane stress
            x = poisson * (np.log1p(trace + h[:, 0] * h[:, 3] - h[:, 1] * h[:, 2]) if self.finite else trace)
        out.failed[~np.isfinite(x)] = True
        x = np.where(np.isfinite(x), x, 0.0)
        lo, hi = np.full(n, -np.inf), np.full(n, np.inf)
        rows, best = np.arange(n), np.full(n, np.inf)
        for _ in range(MAX_ITERATIONS):
            k = len(rows)
            trial = Out(
                np.empty((k, c)), np.empty((k, c, c)), np.empty((k, self.law.size)), np.zeros(k, dtype=np.bool_)
            )
            y = x[rows]
            stretch[rows, 4] = np.expm1(y) if self.finite else y
            self.law.update(stretch[rows], old[rows], at.of(rows), trial)
            out.P[rows], out.A[rows], out.new[rows, :-1] = trial.P, trial.A, trial.new
            f33 = 1.0 + stretch[rows, 4] if self.finite else 1.0
            # In finite strain the unknown is ln f₃₃: P₃₃ f₃₃ is nearly linear in it, for Hencky's law exactly, and f₃₃ stays
            # positive.
            force = trial.P[:, 4] * f33
            slope = f33 * (trial.A[:, 4, 4] * f33 + trial.P[:, 4]) if self.finite else trial.A[:, 4, 4]
            hi[rows] = np.where(force > 0.0, y, hi[rows])
            lo[rows] = np.where(force < 0.0, y, lo[rows])
            with np.errstate(invalid="ignore", divide="ignore"):
                step = -force / slope
            done = np.abs(force) <= STRESS * np.abs(trial.P[:, :4]).max(axis=1)
            # a return map that stops at its own round-off leaves no better zero than the last
            done |= (np.abs(force) >= best[rows]) & (np.abs(force) <= FLOOR * np.abs(trial.P[:, :4]).max(axis=1))
            best[rows] = np.abs(force)
            done |= np.abs(step) <= STEP * np.abs(stretch[rows]).max(axis=1)
            out.failed[rows[trial.failed]] = True
            go = ~(done | trial.failed)
            if not go.any():
                return np.asarray(stretch[:, 4])
            rows, z = rows[go], (y + step)[go]
            a, b = lo[rows], hi[rows]
            inside = np.isfinite(z) & (z > a) & (z < b)
            # without a bracket Newton goes on, at most by one at a time
            with np.errstate(invalid="ignore"):
                middle = np.where(np.isfinite(a) & np.isfinite(b), 0.5 * (a + b), x[rows])
            x[rows] = np.clip(np.where(inside, z, middle), x[rows] - 1.0, x[rows] + 1.0)
        out.failed[rows] = True
        return np.asarray(stretch[:, 4])
