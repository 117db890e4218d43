"""Arguments of the bound of a friction law besides pressure and slip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.types import Array, Index


class At(NamedTuple):
    """What a bound may depend on besides pressure and slip, fixed during an increment.

    ``k`` (points,): shear yield stress of the body behind the surface at the start of the increment, None where the law does
    not ask for it; ``dt``, ``time``: duration and end of the increment in seconds; ``speed`` (points,): of slip at its
    start, that of the increment before, per second; None: at rest. ``temperature`` (points,) of the surface; None: the one for
    which the law has its numbers.
    """

    k: Array | None = None
    dt: float = 0.0
    time: float = 0.0
    speed: Array | None = None
    temperature: Array | None = None

    def rows(self, of: Index) -> At:
        """Of some of the points."""
        k, speed, temperature = (None if v is None else v[of] for v in (self.k, self.speed, self.temperature))
        return self._replace(k=k, speed=speed, temperature=temperature)

    def repeated(self, times: int) -> At:
        """The same for points that are listed several times over."""
        k, speed, temperature = (None if v is None else np.tile(v, times) for v in (self.k, self.speed, self.temperature))
        return self._replace(k=k, speed=speed, temperature=temperature)
