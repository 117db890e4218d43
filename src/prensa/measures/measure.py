"""Measures: numbers of an increment with their name, unit and, where it is known, their derivative."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.errors import PrensaError
from prensa.types import Array, Index

if TYPE_CHECKING:
    from prensa.result.increment import Increment


class MeasureError(PrensaError):
    """A measure that does not exist, or has no value in an increment: says which, why and what to try."""


@dataclass(frozen=True)
class Gradient:
    """The derivative of a measure with respect to what the solver finds, as a linear map on named things.

    ``nodes``: body → node numbers (k,) of the body and ∂m/∂x (k, d) of their positions (or displacements: it is the same);
    ``places``: tool → ∂m/∂(ux, uy, rz) (3,) of its motion, in space (6,); ``forces``: tool → ∂m/∂(fx, fy, mz) (3,) of the force
    of the bodies on it, in space (6,). A node may occur twice; its entries add up.
    """

    nodes: Mapping[str, tuple[Index, Array]] = field(default_factory=dict)
    places: Mapping[str, Array] = field(default_factory=dict)
    forces: Mapping[str, Array] = field(default_factory=dict)

    def displacements(self, system: Any) -> tuple[Index, Array]:
        """Degrees of freedom (k,) of a discretised problem and ∂m/∂u (k,): displacements of nodes and motions of tools."""
        parts = [
            (system.dofs.displacement.dofs(nodes + system.offsets[body]).ravel(), slopes.ravel())
            for body, (nodes, slopes) in self.nodes.items()
        ]
        return _joined([*parts, *self._of_tools(system, self.places)])

    def reactions(self, system: Any) -> tuple[Index, Array]:
        """Degrees of freedom (k,) of tools and ∂m/∂F (k,), F: force of the bodies there (of a moved tool minus its residual)."""
        return _joined(self._of_tools(system, self.forces))

    @staticmethod
    def _of_tools(system: Any, of: Mapping[str, Array]) -> list[tuple[Index, Array]]:
        names = [tool.name for tool in system.tools]
        return [(system.dofs.tool.dofs(names.index(tool)), slopes) for tool, slopes in of.items()]


def _joined(parts: list[tuple[Index, Array]]) -> tuple[Index, Array]:
    if not parts:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    dofs, slopes = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return dofs, slopes


Value = Callable[["Increment"], float]
Count = Callable[["Increment", int], float]
Slope = Callable[["Increment"], Gradient]


@dataclass(frozen=True)
class Measure:
    """A number of an increment: ``name`` as it is written, ``unit`` in the units of the case ('' for plain numbers).

    ``over_run``: 'max' or 'min' of all increments so far, which tables of a run have and no increment knows; '' of others. Made
    by `prensa.measures.parse`. ``located``: of a count and a number n, what grows continuously from n − 1 to n, where the n-th is
    counted, and beyond, so that this moment can be located; None of numbers that are continuous themselves.
    """

    name: str
    unit: str
    _value: Value = field(repr=False, compare=False)
    _slope: Slope | None = field(default=None, repr=False, compare=False)
    over_run: str = ""
    located: Count | None = field(default=None, repr=False, compare=False)

    def value(self, increment: Increment) -> float:
        """The number.

        Raises
        ------
        MeasureError
            If there is none in this increment: an outline that does not reach the place, a contact that is open.

        """
        try:
            return float(self._value(increment))
        except MeasureError as error:
            raise MeasureError(f"{self.name}: {error}") from None

    def value_or_nan(self, increment: Increment) -> float:
        """The number, not a number where there is none."""
        try:
            return self.value(increment)
        except MeasureError:
            return float("nan")

    def gradient(self, increment: Increment) -> Gradient | None:
        """Its derivative in this increment; None for measures whose derivative is not known in closed form.

        Raises
        ------
        MeasureError
            As `value`.

        """
        if self._slope is None:
            return None
        try:
            return self._slope(increment)
        except MeasureError as error:
            raise MeasureError(f"{self.name}: {error}") from None
