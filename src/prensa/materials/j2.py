"""Kernels of J2 plasticity, generated from the point functions of `prensa.materials.hencky_j2` for the flow curves in use.

The consistent tangent is the derivative of the recorded return map by the implicit function theorem; nobody writes it by hand.

Numbers p of a metal: bulk and shear modulus, seconds, share of `At.secant`, then the scalars of its curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prensa.kernels import record
from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Marks, Program, Rows, Shared, puts
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, differs, given, many
from prensa.kernels.template import Template
from prensa.materials.flow_curve import NO_TABLE, FlowParameters
from prensa.materials.hardening import TABLE_ARRAYS, Curve, scalars, table_at
from prensa.materials.hencky_j2 import (
    Begun,
    Flows,
    Metal,
    begin,
    determinant,
    first_piola,
    hencky_j2,
    return_in_principal_axes,
    small_j2,
    stored_energy,
)
from prensa.materials.point_form import Found, Given
from prensa.types import Array, Flags

CURVE_AT = 4
"""Place of the scalars of the curve among the numbers of a metal."""
NO_CURVE = FlowParameters(None, np.zeros(0), *NO_TABLE)
"""Of metals that do not flow."""


def metal(kind: Template | None, cauchy: bool, p: Sequence[Node]) -> Metal:
    """The metal of recorded numbers p; kind: that of its curve, None if it does not flow."""
    curve = None if kind is None else Curve(kind, p[CURVE_AT:], TABLE_ARRAYS)
    return Metal(p[0], p[1], curve, cauchy, p[2], p[3])


def numbers(K: float, G: float, flow: FlowParameters, dt: float, secant: float = 0.0) -> Array:
    """Numbers p (k,) of a metal."""
    return np.array([K, G, dt, 1.0 - secant, *flow.p])


class MetalForm(NamedTuple):
    """The `PointForm` of Hencky's law and of J2 plasticity: kind of the flow curve and what it limits."""

    kind: Template | None
    cauchy: bool

    @property
    def size(self) -> int:
        """Columns of the history."""
        return 4 if self.kind is None else 10

    @property
    def numbers(self) -> int:
        """Of a metal and of its curve."""
        return CURVE_AT + scalars(self.kind)

    @property
    def table_at(self) -> int | None:
        """Place of a table's numbers."""
        at = table_at(self.kind)
        return None if at is None else CURVE_AT + at

    def answer(self, h: Sequence[Node], at: Given) -> Found:
        """The law, with flow where the increment has found it."""
        m, none = metal(self.kind, self.cauchy, at.p), record.ZERO
        begun, flows, strains = Begun(at.committed, none, none, at.committed), None, (none, none)
        if m.curve is not None:
            first = (*at.committed[:6], *at.committed[:4]) if at.share is None else begin(at.committed, at.share, m)
            begun = Begun(first[:4], first[4], first[5], first[6:])
            # Which points flowed, and by how much, is known of the increment: derivatives need not search for the root again.
            flows = Flows(differs(at.new[4], at.old[4]), at.new[4] - at.old[4])
            strains = at.committed[4], first[4]
        found = hencky_j2(h, begun, m, flows)
        strain, work = found.history[4:6] if m.curve is not None else (none, none)
        volume = record.sqrt(determinant(begun.b))
        return Found(found.stress, found.history, stored_energy(found, m), work, volume, (*strains, strain))


TABLES: dict[str, Kind] = {"knots": Shared(), "coefficients": Shared()}


@generated
def _finite(kind: Template | None, cauchy: bool, tangent: bool, held: bool) -> Program:
    h, old, flag = many("h", 5), many("old", 4 if kind is None else 10), given("failed", 0)
    m = metal(kind, cauchy, many("p", CURVE_AT + scalars(kind)))
    begun = Begun(old, record.ZERO, record.ZERO, old)
    if kind is not None:
        begun = Begun(old[:4], old[4], old[5], many("kept", 4))
    found = hencky_j2(h, begun, m, Flows(given("held", 0)) if held else None)
    P = first_piola(h, found.stress, 1.0 / record.sqrt(determinant(old[:4])))
    # det b and f₃₃ say whether f is a motion, the trial tensor whether its logarithm is a number
    t11, t22, t33, t12 = found.trial
    plane = h[0] + h[3] + h[0] * h[3] - h[1] * h[2]
    good = (plane + h[4] + plane * h[4] > -1.0) & (h[4] > -1.0) & (t33 > -1.0)
    good &= (t11 + t22 > -2.0) & ((1.0 + t11) * (1.0 + t22) - t12 * t12 > 0.0)
    rise = record.ZERO if kind is None else found.history[4]
    written = [
        *puts("P", P), *puts("new", found.history), *puts("failed", [flag | ~good | differs(rise, rise)]),
    ]  # fmt: skip
    if tangent:
        written += puts("A", [x for row in forward(P, units(h), 5) for x in row])
    arrays: dict[str, Kind] = {
        "h": Rows(5), "old": Rows(len(old)), "kept": Rows(4), "p": Shared(), **TABLES, "held": Marks(), "P": Rows(5),
        "A": Rows(25), "new": Rows(len(old)), "failed": Marks(),
    }  # fmt: skip
    return Program(arrays, written)


def finite(
    h: Array, old: Array, kept: int, K: float, G: float, cauchy: bool, flow: FlowParameters, dt: float, P: Array, A: Array,
    new: Array, failed: Flags, tangent: bool, held: Flags | None = None, secant: float = 0.0,
) -> None:  # fmt: skip
    """Gradients h (n, 5) = f − I, old (n, ≥10) → P (n, 5), A (n, 5, 5) if ``tangent``, new (n, ≥10), failed (n,).

    Histories as in `prensa.materials.laws.J2` (of metals that do not flow, `NO_CURVE`, b_e − I alone); ``kept``: first column of
    the tensor in old that goes on as if nothing flowed. held (n,): whether points flow; None: the trial stress decides.
    """
    kernel = _finite(flow.kind, cauchy, tangent, held is not None)
    p = numbers(K, G, flow, dt, secant)
    # The kernel wants some array there; without fixed active sets it does not read it.
    flags = failed if held is None else held
    kernel(len(h), h, old, old[:, kept:], p, flow.knots, flow.coefficients, flags, P, A, new, failed)


@generated
def _small(kind: Template, full: int, tangent: bool, held: bool) -> Program:
    k = 6 if full == 9 else 4
    size = 2 * k + 2
    h, old, flag = many("h", full), many("old", k + 2), given("failed", 0)
    m = metal(kind, False, many("p", CURVE_AT + scalars(kind)))
    begun = Begun(old[:k], old[k], old[k + 1], many("kept", k))
    P, history = small_j2(h, begun, m, Flows(given("held", 0)) if held else None)
    written = [*puts("P", P), *puts("new", history), *puts("failed", [flag | differs(history[k], history[k])])]
    if tangent:
        written += puts("A", [x for row in forward(P, units(h), full) for x in row])
    arrays: dict[str, Kind] = {
        "h": Rows(full), "old": Rows(k + 2), "kept": Rows(k), "p": Shared(), **TABLES, "held": Marks(), "P": Rows(full),
        "A": Rows(full**2), "new": Rows(size), "failed": Marks(),
    }  # fmt: skip
    return Program(arrays, written)


def small(
    h: Array, old: Array, kept: int, K: float, G: float, flow: FlowParameters, dt: float, P: Array, A: Array, new: Array,
    failed: Flags, tangent: bool, held: Flags | None, secant: float,
) -> None:  # fmt: skip
    """As `finite`, of small strain in plane (c = 5, k = 4) and space (9, 6): h (n, c), old, new (n, 2k + 2), P, A (n, c, c)."""
    kernel = _small(flow.kind, h.shape[1], tangent, held is not None)
    p = numbers(K, G, flow, dt, secant)
    flags = failed if held is None else held
    kernel(len(h), h, old, old[:, kept:], p, flow.knots, flow.coefficients, flags, P, A, new, failed)


@generated
def _begin(kind: Template, cauchy: bool) -> Program:
    m = metal(kind, cauchy, many("p", CURVE_AT + scalars(kind)))
    arrays: dict[str, Kind] = {"old": Rows(10), "p": Shared(), "share": Shared(), **TABLES, "new": Rows(10)}
    return Program(arrays, puts("new", begin(many("old", 10), given("share", 0), m)))


def begin_finite(history: Array, share: float, mu: float, cauchy: bool, flow: FlowParameters, out: Array) -> None:
    """Histories (n, 10) → out (n, 10), those after a ``share`` of the last plastic strain more, see `begin`."""
    p = numbers(0.0, mu, flow, 0.0)
    _begin(flow.kind, cauchy)(len(history), history, p, np.array([share]), flow.knots, flow.coefficients, out)


@generated
def _principal(kind: Template, cauchy: bool, tangent: bool, held: bool) -> Program:
    eps, was = many("eps", 3), many("old", 2)
    m = metal(kind, cauchy, many("p", CURVE_AT + scalars(kind)))
    tau, elastic, strain, work = return_in_principal_axes(
        eps, given("J", 0), was[0], was[1], m, Flows(given("held", 0)) if held else None
    )
    written = [*puts("tau", tau), *puts("elastic", elastic), *puts("new", (strain, work))]
    written += puts("failed", [given("failed", 0) | differs(strain, strain)])
    if tangent:
        written += puts("slopes", [x for row in forward(tau, units(eps), 3) for x in row])
    arrays: dict[str, Kind] = {
        "eps": Rows(3), "J": Rows(1), "old": Rows(2), "p": Shared(), **TABLES, "held": Marks(), "tau": Rows(3),
        "slopes": Rows(9), "elastic": Rows(3), "new": Rows(2), "failed": Marks(),
    }  # fmt: skip
    return Program(arrays, written)


def principal(
    eps: Array, jn: Array, old: Array, column: int, K: float, G: float, cauchy: bool, flow: FlowParameters, dt: float,
    tau: Array, dtau: Array, eps_e: Array, new: Array, failed: Flags, tangent: bool, held: Flags | None = None,
    secant: float = 0.0,
) -> None:  # fmt: skip
    """Trial elastic strains eps (n, 3) → tau (n, 3), dtau (n, 3, 3) = ∂τ/∂ε if ``tangent``, eps_e (n, 3); new, old (n, h).

    ``secant``: share of the way from the tangent to the secant moduli, with which the direction of flow stays (Kačanov 1959).
    History ``column`` and the next: equivalent plastic strain, plastic work per initial volume (trapezoid in time).
    ``cauchy``: the flow curve limits the Cauchy stress, q(τ) = J σ_y with J = exp(tr ε) (plastic flow is isochoric); else
    q(τ) = σ_y. jn (n,) is J at the last commit. failed (n,) is set where the return map finds no root. held (n,): whether
    points flow, whatever the trial stress says; None: that decides.
    """
    kernel = _principal(flow.kind, cauchy, tangent, held is not None)
    p = numbers(K, G, flow, dt, secant)
    flags = failed if held is None else held
    kernel(
        len(eps), eps, jn[:, None], old[:, column:], p, flow.knots, flow.coefficients, flags, tau, dtau, eps_e,
        new[:, column:], failed,
    )  # fmt: skip
