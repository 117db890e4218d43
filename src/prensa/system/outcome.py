"""Outcome of an attempt at an increment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from prensa.contact.forces import ContactSets
from prensa.system.failure import Failure
from prensa.system.state import Energy
from prensa.system.system import Evaluation
from prensa.types import Array


@dataclass
class NewtonResult:
    """Outcome of an increment attempt: converged or ``reason``; dofs u, evaluation there, multipliers, cost.

    ``recover``: gives all dofs where u has only those that the next increment needs. ``negative``: modes in which the
    equilibrium is unstable; ``beside``: it was found beside one that is; ``jumped``: the way to it is unstable.
    ``discarded``: how many of the iterations belong to attempts that were given up.
    ``softest`` (modes,): stiffnesses of the softest modes at its end, None where they are not known; ``rested``: no look.
    ``linear`` (ndof,): change of the dofs by the linearised system, where the iteration began with that.
    ``affordable``: so few points were near a tool that the iteration could take contact steps wherever it wanted.
    ``active_sets``: those of contact that the iteration has tried, by their signature, the last one last.
    ``krylov``: iterations of GMRES that its linear systems have taken, where these are solved so (in space).
    ``grown``: growth of plastic strain to its evaluation, see `growths`; empty where nobody has asked for it.
    ``energy``: the energies after it, None before somebody has asked for them, and again where evaluation or dofs are replaced.
    """

    converged: bool
    reason: Failure | None
    u: Array
    evaluation: Evaluation | None
    lam: Array
    iterations: int
    residual: float = np.nan
    residuals: list[float] = field(default_factory=list)
    changes: list[int] = field(default_factory=list)
    active_sets: dict[bytes, tuple[ContactSets, ...]] = field(default_factory=dict)
    augmentations: int = 0
    recover: Callable[[], Array] | None = None
    negative: int = 0
    beside: bool = False
    jumped: bool = False
    discarded: int = 0
    affordable: bool = False
    linear: Array | None = None
    softest: Array | None = None
    rested: bool = False
    grown: Sequence[Array | None] = ()
    krylov: int = 0
    energy: Energy | None = None

    def contact_changed(self) -> bool:
        """Whether contact points still opened, closed or slipped another way in the last half of the iterations."""
        return any(self.changes[len(self.changes) // 2 :])
