"""Wear of a tool by Archard's law: dV = (k/H) N ds, a depth of (k/H) ∫ p ds at each place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from prensa.dies.loads import ToolLoads
from prensa.errors import PrensaError
from prensa.types import Array


@dataclass(frozen=True)
class Wear:
    """Wear of a tool in one part.

    ``rate``: k/H (area over force), 1 of relative wear; ``depth`` (m,) over the intervals of the tool's coordinate, ``volume``
    worn (of the whole thickness, or circumference), both per part and for ``rate`` 1 as ∫ p ds and ∫ N ds.
    """

    loads: ToolLoads
    rate: float
    depth: Array
    volume: float

    @property
    def deepest(self) -> tuple[float, float]:
        """Largest depth, and its coordinate on the tool."""
        k = int(np.argmax(self.depth))
        return float(self.depth[k]), float(self.loads.s[k])

    def parts_until(self, depth: float) -> float:
        """Parts after which the deepest place has worn by a permitted ``depth``; infinite where nothing wears.

        Raises
        ------
        PrensaError
            If the wear is relative, or the depth not positive.

        """
        if self.rate == 1.0:
            raise PrensaError("parts until a depth need the rate of wear k/H of the tool; give it, as in 2e-9 (mm²/N)")
        if not depth > 0.0:
            raise PrensaError(f"the permitted depth must be positive, got {depth:g}")
        return depth / self.deepest[0] if self.deepest[0] > 0.0 else np.inf


def wear(loads: ToolLoads, k: float | None = None, hardness: float | None = None) -> Wear:
    """Wear by Archard (1953), J. Appl. Phys. 24, 981, eq. 1, of what a tool bore in a run.

    ``k``: his coefficient, without dimension; ``hardness`` H (pressure) of the tool. Without both, relative wear. The way is that
    of slip: what the tangential penalty gives elastically does not count.

    Raises
    ------
    PrensaError
        If one of the two is missing or not positive.

    """
    if (k is None) != (hardness is None):
        raise PrensaError("wear takes Archard's coefficient k and the hardness H together; give both or neither")
    rate = 1.0
    if k is not None and hardness is not None:
        if not (k > 0.0 and hardness > 0.0):
            raise PrensaError(f"Archard's coefficient and the hardness must be positive, got {k:g} and {hardness:g}")
        rate = k / hardness
    worn = loads.work.sum(axis=0)
    depth = rate * worn / np.where(loads.area > 0.0, loads.area, 1.0)
    return Wear(loads, rate, depth, float(rate * worn.sum()))


def wear_summary(worn: Wear, permitted: float | None) -> dict[str, Any]:
    """Deepest wear, worn volume, and parts until a ``permitted`` depth where one is given."""
    depth, s = worn.deepest
    sliding = float(worn.loads.slid.max())
    out = {"relative": worn.rate == 1.0, "depth": depth, "s": s, "volume": worn.volume, "sliding": sliding}
    return out if permitted is None else {**out, "permitted": permitted, "parts": worn.parts_until(permitted)}
