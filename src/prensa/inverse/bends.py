"""Residuals away from where they are known: linear in the stresses of a flow curve, where several numbers of one are fitted.

Strength, exponent and first yield of a flow curve trade: what is measured hardly changes along a valley of them, and the valley
bends, since stresses are no linear functions of them. But what is measured is nearly linear in the stresses themselves. So
with φ(x) the stresses at some strains, residuals are predicted as r + J_f Φ⁺ (φ(x) − φ) for what belongs to the curve, Φ = ∂φ/∂x
where r and J were found, and as r + J (x − x₀) for all else. That takes no run, so what is sought with it is sought far.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from prensa.materials.flow_curve import FlowCurve, stress_at
from prensa.model.fields import LARGEST
from prensa.model.problem import Problem
from prensa.precision import FIRST_DIFFERENCE, NEGLIGIBLE
from prensa.sensitivity.parameters import part_of
from prensa.types import Array

# Stresses are not fitted themselves: not all of them belong to a curve of the law.
SAMPLED = np.linspace(0.02, 1.0, 25)  # of the stresses of a curve


@dataclass(frozen=True)
class Curve:
    """A flow curve of which unknowns number ``own`` are the fields ``names``; ``value``: from what is varied to each number."""

    curve: FlowCurve
    own: tuple[int, ...]
    names: tuple[str, ...]
    value: tuple[Callable[[float], float], ...]

    def stresses(self, x: Array) -> Array:
        """At `SAMPLED`; nan for numbers that are not allowed."""
        try:
            given: Any = {name: value(float(x[i])) for i, name, value in zip(self.own, self.names, self.value)}
            with np.errstate(all="ignore"):
                return stress_at(replace(self.curve, **given), SAMPLED, np.zeros_like(SAMPLED))
        except (ValueError, ArithmeticError):
            return np.full_like(SAMPLED, np.nan)

    def slopes(self, x: Array) -> Array:
        """Derivatives (strains, own) by what is varied."""
        out = []
        for i in self.own:
            step = np.zeros_like(x)
            step[i] = FIRST_DIFFERENCE
            out.append((self.stresses(x + step) - self.stresses(x - step)) / (2.0 * FIRST_DIFFERENCE))
        return np.column_stack(out)


def curves_of(problem: Problem, paths: Sequence[str], values: Sequence[Callable[[float], float]]) -> list[Curve]:
    """The flow curves of which several numbers are fitted; ``values``: from what is varied to each number."""
    out = []
    for body in problem.bodies:
        start = f"bodies.{body}.material.flow."
        curve = part_of(problem, start[:-1])
        if not isinstance(curve, FlowCurve):
            continue
        known = {f.name for f in fields(curve)}
        own = [i for i, path in enumerate(paths) if path.startswith(start) and path.removeprefix(start) in known]
        if len(own) > 1:
            names = tuple(paths[i].removeprefix(start) for i in own)
            out.append(Curve(curve, tuple(own), names, tuple(values[i] for i in own)))
    return out


class LinearisedResiduals:
    """Residuals (r,) near unknowns x (n,), where they are r with derivatives J (r, n)."""

    def __init__(self, curves: Sequence[Curve], x: Array, r: Array, J: Array) -> None:
        self.x, self.r, self.J = x, r, J
        self.curves = []
        for c in curves:
            stresses, slopes = c.stresses(x), c.slopes(x)
            if np.isfinite(slopes).all():
                # Φ⁺ leaves out directions of the numbers that change no stress: nothing was measured along them.
                self.curves.append((c, stresses, J[:, list(c.own)] @ np.linalg.pinv(slopes, rcond=NEGLIGIBLE)))

    def residuals(self, x: Array) -> Array:
        """There."""
        way = x - self.x
        for c, _, _ in self.curves:
            way[list(c.own)] = 0.0
        out = self.r + self.J @ way
        for c, stresses, by in self.curves:
            out = out + by @ (c.stresses(x) - stresses)
        # Numbers that no curve may have predict residuals beyond all others, from which least squares turn back.
        return np.asarray(np.nan_to_num(out, nan=LARGEST, posinf=LARGEST, neginf=-LARGEST))

    def square(self, x: Array) -> float:
        """χ² there."""
        r = self.residuals(x)
        return float(r @ r)

    def slopes(self, x: Array) -> Array:
        """Their derivatives (r, n) there."""
        J = self.J.copy()
        for c, _, by in self.curves:
            J[:, list(c.own)] = by @ np.nan_to_num(c.slopes(x))
        return J

    def least(self, start: Array, low: Array, high: Array, held: int | None = None) -> Array:
        """Unknowns of least squares between bounds (n,), one of them ``held``."""
        from scipy.optimize import least_squares

        free = np.delete(np.arange(len(start)), [] if held is None else held)

        def whole(some: Array) -> Array:
            x = start.copy()
            x[free] = some
            return x

        found = least_squares(
            lambda some: self.residuals(whole(some)), np.clip(start[free], low[free], high[free]),
            jac=lambda some: self.slopes(whole(some))[:, free], bounds=(low[free], high[free]), x_scale="jac",
            max_nfev=200,
        )  # fmt: skip
        return whole(found.x)
