"""Flow curves: the flow stress at a plastic strain and its rate. The return map does the rest, one for all curves.

A curve derives from `PointCurve` and states its stress of one point, with the functions of `prensa.kernels.record`; machine code
and all derivatives, those by its fields too, are generated from it, and called with arrays it computes::

    class Voce(pr.PointCurve):
        s0: float
        Q: float
        b: float

        def stress(self, strain, rate):
            return self.s0 + self.Q * (1 - exp(-self.b * strain))

One that derives from `FlowCurve` alone states it in NumPy, of all points at once; derivatives that it does not give are found by
the complex step.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np

from prensa.derivatives import derivative
from prensa.errors import ArgumentError
from prensa.kernels.template import Template
from prensa.model.doors import Member
from prensa.types import Array


class FlowParameters(NamedTuple):
    """What a kernel needs: ``kind``, numbers ``p``, and of a table ``knots`` (k,) with cubic ``coefficients`` (k−1, 4).

    kind: what a `PointCurve` is without its numbers; None where nothing flows.
    """

    kind: Template | None
    p: Array
    knots: Array
    coefficients: Array


NO_TABLE = np.zeros(2), np.zeros((1, 4))
"""Knots and coefficients of curves without a table."""
SHIFTS = 3
"""Zeros that follow the numbers of a curve with a table, by which it is differentiated; see `prensa.materials.hardening`."""

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

    def proof(self) -> float:
        """Proof stress, the flow stress at a plastic strain of 0.2 % at rest."""
        return float(stress_at(self, np.full(1, 0.002), np.zeros(1))[0])


class PointCurve(FlowCurve, abstract=True):
    """Base of flow curves whose `stress` is a point function: it is compiled, and its derivatives are generated.

    It is written as that of any curve is, with the functions of `prensa.kernels.record` in place of NumPy's, ``exp``, ``log``,
    ``sqrt``, ``where``, and returns σ_y alone. Powers may be written as such; choices between numbers need ``where``.
    """

    derived: ClassVar[tuple[str, ...]] = ()
    """Cached properties, numbers or one `prensa.kernels.table.Table`, that `stress` takes as it does fields."""
    smooth: ClassVar[bool] = False
    """Whether the slope by the strain has no kinks beyond a strain of zero: the return map then takes a step less."""

    def kernel(self) -> FlowParameters:
        """What it is without its numbers, these, and its table.

        Raises
        ------
        ArgumentError
            Of a curve with more than one table.

        """
        kind, p, tables = Template.of(self)
        if not tables:
            return FlowParameters(kind, p, *NO_TABLE)
        if len(tables) > 1:
            raise ArgumentError(f"{type(self).__name__}: a flow curve has one table at most, this one has {len(tables)}")
        return FlowParameters(kind, np.append(p, np.zeros(SHIFTS)), *tables[0])


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
