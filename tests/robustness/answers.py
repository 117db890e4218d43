"""A drawn problem's answer as the files of its run have it, for tests of the checks of answers."""

from __future__ import annotations

import tempfile
from pathlib import Path
from types import ModuleType

import numpy as np

from prensa_bench.robustness.drawn import Drawn
from prensa_bench.robustness.files import Record, read, solve_into


def recorded(d: Drawn) -> Record:
    """The run of a problem, read back."""
    with tempfile.TemporaryDirectory() as folder:
        solve_into(Path(folder), d.problem, np.inf)
        return read(Path(folder), d.problem)


def passes(checks: ModuleType, d: Drawn, record: Record) -> None:
    """Assert that nothing is found in an answer that wrong ones are made of; there is pressure, friction and flow in it."""
    assert checks.wrong_with(d, [record]) == ""
    assert record.history["energy.plastic"][-1] > 0 < record.history["energy.friction"][-1]
