"""The committed state: everything that the next increment depends on, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Recovered(Sequence[Array]):
    """Histories, one (elements, points, h) array per block, that are computed when first asked for.

    Only for bodies whose histories follow from their displacements alone; ``energy``: ∫ψ dV, known without them.
    """

    def __init__(self, compute: Callable[[], Sequence[Array]], energy: float) -> None:
        self.energy = energy
        self._compute = compute
        self._arrays: Sequence[Array] | None = None

    @property
    def arrays(self) -> Sequence[Array]:
        """The arrays."""
        if self._arrays is None:
            self._arrays = self._compute()
        return self._arrays

    def __getitem__(self, index: Any) -> Any:
        return self.arrays[index]

    def __len__(self) -> int:
        return len(self.arrays)


@dataclass(frozen=True)
class State:
    """A committed configuration. Arrays are never written again once they are here.

    ``u`` (ndof,) displacements of nodes (2 each) then tools (3 each) from the initial configuration; ``du`` (ndof,) the
    last increment's change, ``dt_last`` its duration and ``bend`` (ndof,) the second divided difference of the last two
    increments (for `foretold`; of condensed bodies they are those of their contact candidates alone); ``history`` one
    (elements, points, h) array per block, flattened together; ``contact`` one (points, 4) row per contact point: traction
    along the tangent, accumulated slip, surface coordinate, closed or not; ``lam`` (points, 2) multipliers; ``energy`` (6,)
    ledger; ``clock`` (step, number, time, dt, trust) of the marching, trust how well the bend of one increment foretold
    that of the next (0 … 1); ``work`` (ndof,) forces of the last committed increment; ``anchor`` (ndof,) the unknowns at the
    start of the present step.
    """

    u: Array
    du: Array
    dt_last: float
    bend: Array
    history: Sequence[Array]
    contact: Array
    lam: Array
    energy: Array
    work: Array
    clock: Array
    anchor: Array

    def foretold(self, dt: float) -> Array:
        """Change of the unknowns (ndof,) in the next ``dt``, extrapolated from the last increments."""
        last = self.dt_last
        return (dt / last) * self.du + (float(self.clock[4]) * dt * (dt + last)) * self.bend

    def bent(self, du: Array, dt: float, nodes: int) -> tuple[Array, float]:
        """Second divided difference (ndof,) when ``du`` in ``dt`` follows on this state, and how far to trust it (0 … 1).

        Where nodes land, or points change from stick to slip, motions have kinks: the bend before says nothing about that
        after. The new one is trusted as far as the two are alike (displacements of the nodes): their product over the
        larger one's square, so that a bend that is nothing but round-off vouches for none.
        """
        if not self.dt_last > 0:
            return np.zeros_like(du), 0.0
        bend = (du / dt - self.du / self.dt_last) / (dt + self.dt_last)
        new, old = bend[: 2 * nodes], self.bend[: 2 * nodes]
        size = max(float(old @ old), float(new @ new))
        return bend, max(float(new @ old) / size, 0.0) if size > 0 else 0.0

    def arrays(self) -> dict[str, Array]:
        """Flat mapping of names to arrays, for checkpoints."""
        out: dict[str, Array] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name == "history":
                out |= {f"history_{i}": a for i, a in enumerate(value)}
            else:
                out[f.name] = np.asarray(value, dtype=np.float64)
        return out

    @classmethod
    def from_arrays(cls, arrays: dict[str, Array]) -> State:
        """Inverse of `arrays`, bit for bit."""
        values: dict[str, object] = {}
        for f in fields(cls):
            if f.name == "history":
                n = sum(k.startswith("history_") for k in arrays)
                values["history"] = tuple(np.array(arrays[f"history_{i}"]) for i in range(n))
            elif f.name == "dt_last":
                values[f.name] = float(arrays[f.name])
            else:
                values[f.name] = np.array(arrays[f.name])
        return cls(**values)  # type: ignore[arg-type]
