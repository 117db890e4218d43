"""Wear of a tool by a law: its depth at each place, and the worn volume, of what rubbed there in a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from prensa.dies.loads import ToolLoads
from prensa.errors import PrensaError
from prensa.friction.wear.archard import Archard
from prensa.friction.wear_law import Sliding, WearLaw
from prensa.types import Array


@dataclass(frozen=True)
class Wear:
    """Wear of a tool in one part.

    ``law``; ``depth`` (m,) over the intervals of the tool's coordinate, ``volume`` worn (of the whole thickness, or
    circumference), the sum of depths times areas: both per part, and of relative wear ∫ p ds and ∫ N ds.
    """

    loads: ToolLoads
    law: WearLaw
    depth: Array
    volume: float

    @property
    def relative(self) -> bool:
        """Whether depths are no lengths."""
        return self.law.relative

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
        if self.relative:
            raise PrensaError("parts until a depth need the rate of wear k/H of the tool; give it, as in k=1e-5, hardness=6000")
        if not depth > 0.0:
            raise PrensaError(f"the permitted depth must be positive, got {depth:g}")
        return depth / self.deepest[0] if self.deepest[0] > 0.0 else np.inf


def wear(
    loads: ToolLoads, k: float | None = None, hardness: float | None = None, *, law: WearLaw | None = None
) -> Wear:  # fmt: skip
    """Wear by a ``law`` of what a tool bore in a run, without one by Archard (1953), J. Appl. Phys. 24, 981, eq. 1.

    ``k``: his coefficient, without dimension; ``hardness`` H (pressure) of the tool. Without both, relative wear. The way is that
    of slip: what the tangential penalty gives elastically does not count.

    Raises
    ------
    PrensaError
        If one of the two is missing or not positive, or both they and a law are given; if depths by a law are not one number a
        place, or less than nothing.

    """
    if law is not None and not (k is None and hardness is None):
        raise PrensaError("wear takes a law, or k and hardness of Archard's; give one of the two")
    if (k is None) != (hardness is None):
        raise PrensaError("wear takes Archard's coefficient k and the hardness H together; give both or neither")
    if k is not None and hardness is not None and not (k > 0.0 and hardness > 0.0):
        raise PrensaError(f"Archard's coefficient and the hardness must be positive, got {k:g} and {hardness:g}")
    by = Archard(k=k, hardness=hardness) if law is None else law
    worn = np.zeros(len(loads.area))
    for rubbed in loads.rubbed:
        worn += (rated(by, rubbed.sliding.pressure, rubbed.sliding.speed) * rubbed.area * rubbed.seconds) @ rubbed.shares
    depth = worn / np.where(loads.area > 0.0, loads.area, 1.0)
    return Wear(loads, by, depth, float(worn.sum()))


def rated(law: WearLaw, pressure: Array, speed: Array) -> Array:
    """Depths per second (n,) of a law; raises PrensaError where it gives something else."""
    found = np.asarray(law.rate(Sliding(pressure, speed)), dtype=np.float64)
    if found.shape != pressure.shape or not np.isfinite(found).all() or (found < 0.0).any():
        raise PrensaError(
            f"wear law {law.type!r}: its rate must be a number for each of the {len(pressure)} places, finite and not negative; "
            "try it with prensa.testing.check_wear"
        )
    return found


def wear_summary(worn: Wear) -> dict[str, Any]:
    """Deepest wear, worn volume, and parts until a permitted depth where the law has one."""
    depth, s = worn.deepest
    sliding, permitted = float(worn.loads.slid.max()), worn.law.depth
    out = {"relative": worn.relative, "depth": depth, "s": s, "volume": worn.volume, "sliding": sliding}
    return out if permitted is None else {**out, "permitted": permitted, "parts": worn.parts_until(permitted)}
