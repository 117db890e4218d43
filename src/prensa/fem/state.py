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
    last increment's change and ``dt_last`` its duration (for the predictor; of condensed bodies it is that of their
    contact candidates alone); ``history`` one (elements, points, h) array per block, flattened together; ``contact`` one
    (points, 4) row per contact point: traction along the tangent, accumulated slip, surface coordinate, closed or not;
    ``lam`` (points, 2) multipliers; ``energy`` (6,) ledger; ``clock`` (step, number, time, dt, streak) of the marching;
    ``work`` (ndof,) forces of the last committed increment; ``anchor`` (ndof,) the unknowns at the start of the present step.
    """

    u: Array
    du: Array
    dt_last: float
    history: Sequence[Array]
    contact: Array
    lam: Array
    energy: Array
    work: Array
    clock: Array
    anchor: Array

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
