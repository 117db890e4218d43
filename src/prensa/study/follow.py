"""What a study sees of a running case: a table of measures beside the history, and nothing on the terminal."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from prensa.errors import PrensaError
from prensa.fem.saved import read_checkpoint
from prensa.model.problem import Problem
from prensa.output.history import Table, read_table
from prensa.output.measure import measure
from prensa.output.progress import ProgressBar
from prensa.solver.increment import Increment

MEASURES = "measures.csv"


class Silent(ProgressBar):
    """Shows nothing: warnings are in the summary of the run, and on the page of the study."""

    def __init__(self) -> None:
        super().__init__(quiet=True)

    def warn(self, text: str) -> None:
        """Leave the terminal to the study."""


class Follower:
    """Writes ``measures.csv`` in *directory*: one row an increment, a column for each of *names*; nothing without names."""

    def __init__(self, directory: Path, problem: Problem, names: tuple[str, ...]) -> None:
        self._path, self._names = directory / MEASURES, names
        self._table: Table | None = None

    def __call__(self, increment: Increment) -> None:
        """Write the row of an increment; the first one tells where the table goes on."""
        if not self._names:
            return
        if self._table is None:
            keep = None if increment.number == 1 else increment.number - 1
            self._table = Table(self._path, ["increment", "time", *self._names], keep)
        values = [measure(increment, name) for name in self._names]
        self._table.append([increment.number, increment.time, *values])

    def can_continue(self) -> bool:
        """Whether the table holds every increment up to the checkpoint and these measures."""
        if not self._names:
            return True
        try:
            _, state = read_checkpoint(self._path.parent / "checkpoint.h5")
            table = read_table(self._path)
        except PrensaError:
            return False
        upto = table["increment"][table["increment"] <= state.clock.number]
        return list(table) == ["increment", "time", *self._names] and np.array_equal(
            upto, np.arange(1, state.clock.number + 1)
        )

    def restart(self) -> None:
        """Forget the rows of a run that begins anew."""
        self.close()
        self._table = None

    def close(self) -> None:
        """Close the table."""
        if self._table is not None:
            self._table.close()
