"""What a flow curve is: the flow stress at a plastic strain and its rate. The return map does the rest, one for all curves.

A curve of one's own derives from `FlowCurve` and states its stress in NumPy; derivatives that it does not give are found by
the complex step::

    class Power(pr.FlowCurve):
        s0: float
        K: float
        n: float

        def stress(self, strain, rate):
            return self.s0 + self.K * strain**self.n
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np

from prensa.derivatives import derivative
from prensa.materials.template import NO_TABLE, Template
from prensa.model.doors import Member
from prensa.types import Array


class FlowParameters(NamedTuple):
    """What a kernel needs: ``kind``, scalars ``p``, and for tables ``knots`` (k,) with cubic ``coefficients`` (k−1, 4).

    kind: a number of `prensa.materials.hardening`, or what a `PointCurve` is without its numbers.
    """

    kind: int | Template
    p: Array
    knots: Array
    coefficients: Array

MOST_EXPONENT = 1.0  # of hardening, above which metals do not lie …
PERCENT = 2.0  # … and above which it is likely in per cent


class FlowCurve(Member, abstract=True):
    """Base of all flow curves. A curve is pure and frozen; its annotated fields are keys of the case file."""

    door: ClassVar[str] = "flow"

    def stress(self, strain: Array, rate: Array) -> Any:
        """Flow stress σ_y > 0 (k,) at equivalent plastic strains (k,) ≥ 0 and their rates (k,) ≥ 0, per second.

        Returns σ_y alone; (σ_y, ∂σ_y/∂ε̄) of a curve that does not depend on the rate; or (σ_y, ∂σ_y/∂ε̄, ∂σ_y/∂ε̄̇).
        """
        raise NotImplementedError(f"{type(self).__name__} states no flow stress: define stress(self, strain, rate)")

    def kernel(self) -> FlowParameters | None:
        """Parameters of a compiled kernel of the same curve; None where there is none, and `stress` is all there is."""
        return None

    def known_to(self) -> float:
        """Plastic strain up to which the curve has data; infinite where it is a formula."""
        return np.inf

    def doubts(self) -> Iterator[tuple[str, str]]:
        """Field and words of each value that is allowed but likely a slip; they are reported before the solve."""
        n = getattr(self, "n", None)  # of the laws that have one
        if isinstance(n, float) and n > MOST_EXPONENT:
            meant = f"; did you mean {n / 100:g}?" if n > PERCENT else ""
            yield "n", f"an exponent of {n:g}: metals harden with exponents below 1{meant}"

    def rated(self) -> bool:
        """Whether the flow stress at a plastic strain of a tenth depends on the rate."""
        slow, fast = (stress_at(self, np.full(1, 0.1), np.full(1, rate)) for rate in (1e-3, 1e3))
        return bool(slow != fast)

    def first(self) -> float:
        """Flow stress of the virgin material at rest."""
        return float(stress_at(self, np.zeros(1), np.zeros(1))[0])


class PointCurve(FlowCurve, abstract=True):
    """Base of flow curves whose `stress` is a point function: it is compiled, and its derivatives are generated.

    It is written as that of any curve is, with the functions of `prensa.kernels.record` in place of NumPy's, ``exp``, ``log``,
    ``sqrt``, ``where``, and returns σ_y alone. Powers may be written as such; choices between numbers need ``where``.
    """

    def kernel(self) -> FlowParameters:
        """Its numbers, and what it is without them."""
        return FlowParameters(*Template.of(self), *NO_TABLE)


MOST_PRESTRAIN = 0.5  # of Swift's law, from which on it is likely in per cent


def prestrain_doubts(e0: float) -> Iterator[tuple[str, str]]:
    """What there is to say of a prestrain e0 of Swift's law."""
    if e0 > MOST_PRESTRAIN:
        yield "e0", f"a prestrain of {e0:g}, {100 * e0:g} %: strains are plain numbers; did you mean '{e0:g} %'?"


def stress_at(curve: FlowCurve, strain: Array, rate: Array) -> Array:
    """Flow stress (k,) at plastic strains and rates (k,), without derivatives."""
    out = curve.stress(strain, rate)
    return np.asarray(out[0] if isinstance(out, tuple) else out, dtype=np.float64) + np.zeros_like(strain)


def along(curve: FlowCurve, start: Array, delta: Array, dt: float) -> tuple[Array, Array]:
    """σ_y (k,) at start + Δ reached in the time dt, and its total derivative by Δ (k,): the curve's own, or that found."""

    def stress(d: Any) -> Any:
        return curve.stress(start + d, d / dt if dt > 0.0 else np.zeros_like(start))

    out = stress(delta)
    if not isinstance(out, tuple):
        return np.asarray(out, dtype=np.float64) + np.zeros_like(start), derivative(stress, delta)
    slope = out[1] + (out[2] / dt if len(out) > 2 and dt > 0.0 else 0.0)
    return np.asarray(out[0], dtype=np.float64) + np.zeros_like(start), slope + np.zeros_like(start)


def partial(curve: FlowCurve, strain: Array, rate: Array) -> tuple[Array, Array, Array]:
    """σ_y, ∂σ_y/∂ε̄, ∂σ_y/∂ε̄̇, each (k,): the curve's own derivatives, or else those found."""
    out, zero = curve.stress(strain, rate), np.zeros_like(strain)
    if isinstance(out, tuple):
        return (
            np.asarray(out[0]) + zero,
            np.asarray(out[1]) + zero,
            (np.asarray(out[2]) if len(out) > 2 else 0.0) + zero,
        )
    by_strain = derivative(lambda x: curve.stress(x, rate), strain)
    return np.asarray(out, dtype=np.float64) + zero, by_strain, derivative(lambda x: curve.stress(strain, x), rate)
