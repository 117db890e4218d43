"""What an energy that an answer leaves out, or has too much, means for its forces: its rate over that of the work."""

from __future__ import annotations

import numpy as np

from prensa.checks.check import Committed
from prensa.types import Array


class ForceShare:
    """Share of the forces of prescribed travels that an energy E takes, from E and the work W at the ends of increments.

    F = dW/dd over a travel d, and what varies the stored energy by E varies the work by as much (Castigliano; of what flows, to
    first order): a share dE/dW of F. The rate is that over the second half of the work: within a single increment forces of
    sliding step as nodes pass.
    """

    def __init__(self) -> None:
        self.rows: list[tuple[float, float]] = []

    def note(self, given: Committed, energy: float) -> None:
        """Note the ``energy`` at the end of an increment."""
        if not self.rows and given.context.state.energy.external == 0.0:
            self.rows.append((0.0, 0.0))  # of a run that is continued the beginning is not known
        self.rows.append((given.state.energy.external, energy))

    def go_on_from(self, before: ForceShare) -> None:
        """Take over what was noted of the run on an earlier system."""
        self.rows = list(before.rows)

    @property
    def most(self) -> int:
        """The row at which most work had been done, the first one of several."""
        return int(np.argmax([work for work, _ in self.rows]))

    def at_most_work(self) -> float:
        """The share where most work had been done: where a tool has drawn back, forces are not what is asked for."""
        rows = np.array(self.rows[: self.most + 1] if self.rows else [(0.0, 0.0)])
        return _last_rate(rows) if rows[-1, 0] > 0.0 else 0.0


def _last_rate(rows: Array) -> float:
    """The change of the second column of rows (k, 2) over that of the first, which ends above 0, from half of its end on."""
    work, stored = rows.T
    below = np.flatnonzero(work <= 0.5 * work[-1])
    if not len(below):  # of a run that is continued no more is known
        return float(stored[-1] / work[-1])
    i = int(below[-1])
    part = (0.5 * work[-1] - work[i]) / (work[i + 1] - work[i])
    base = rows[i] + part * (rows[i + 1] - rows[i])
    return float((stored[-1] - base[1]) / (work[-1] - base[0]))
