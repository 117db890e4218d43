"""What an increment depends on besides the degrees of freedom; made once an increment, never changed during it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import Scale
from prensa.contact.kept import Supports
from prensa.contact.record import ContactRecord
from prensa.fem.interaction import Interaction
from prensa.fem.schedule import StepPlan
from prensa.fem.state import State
from prensa.fem.time_rule import TimeRule
from prensa.friction.law import At, FrictionLaw

if TYPE_CHECKING:
    from prensa.fem.surface import Surface

Array = NDArray[np.float64]


@dataclass
class Context:
    """Committed state, plan of the step, end of the increment, its ``dt`` in steps and in ``seconds``, and arrays made of them.

    ``weights`` and ``scales`` of the contacts on the committed configuration, friction ``laws`` and what their bounds depend
    on (``law_at``); ``x_n`` (n, d) node positions that increments refer to; ``depth`` (n,) thickness at the nodes at the last
    commit, None in axisymmetry; ``surfaces``: the contacts, their edges cut at sharp corners, and what is ``committed``
    of their points; ``lagged``: the contact stiffness is the paper's symmetric one (see `forces`);
    ``interactions``: contacts, in the order of the description, then loads. ``threads`` that may answer for elements at once.
    ``stopped``: what ends the step here before its
    time, in words; '' if nothing does. ``watched`` (criteria,): values of what may end it. ``touches``: whether a prescribed
    tool first meets a body at the end of the increment. ``brought``: whether it begins elsewhere
    than where the last one ended, since tools or bodies are brought into contact first, and ``through_air`` (ndof,) the way on
    which nothing resisted what forces brought there (None: there is none); ``afloat``: bodies that nothing holds at its end.

    ``supports``: see `Surface.supports`, by contact.

    ``history``: what the bodies' laws begin with by the time ``rule``, one (elements, points, h) array per block.
    """

    state: State
    plan: StepPlan
    time: float
    dt: float
    seconds: float
    weights: list[Array]
    scales: list[Scale]
    laws: list[FrictionLaw | None]
    law_at: list[At]
    x_n: Array
    depth: Array | None
    surfaces: list[Surface]
    committed: list[ContactRecord]
    supports: list[Supports | None]
    history: Sequence[Array]
    rule: TimeRule
    interactions: Sequence[Interaction] = ()
    lagged: bool = False
    threads: int = 1
    stopped: str = ""
    watched: Array = field(default_factory=lambda: np.zeros(0))
    touches: bool = False
    brought: bool = False
    through_air: Array | None = None
    afloat: Sequence[str] = ()

    @property
    def ends_step(self) -> bool:
        """Whether the increment is the last one of its step."""
        return bool(self.stopped) or self.time >= self.plan.t1

    @property
    def driven_by_ways(self) -> bool:
        """Whether nothing acts on the bodies but contacts: no pushes, springs or loads, nothing of extensions."""
        return len(self.interactions) == len(self.surfaces)
