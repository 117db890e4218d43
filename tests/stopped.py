"""A run that is interrupted, to be resumed."""

from __future__ import annotations

from pathlib import Path

import pytest

import prensa as pr
from prensa.output import run as module
from prensa.output.progress import ProgressBar


def stopped_after(case: pr.Case, folder: Path, number: int) -> None:
    """Run a case in a folder and interrupt it when it has written an increment of that number."""

    class Stopped(module._Run):
        def _write(self, increment):
            super()._write(increment)
            if increment.number == number:
                raise KeyboardInterrupt

    original = module._Run
    module._Run = Stopped
    try:
        with pytest.raises(KeyboardInterrupt):
            module.run(case, folder, quiet=True)
    finally:
        module._Run = original


def goes_on_bit_for_bit(case: pr.Case, folder: Path, first: int) -> None:
    """Interrupt a run in its increment ``first`` and in the last but one, and go on: its tables are those without a stop.

    A plane of symmetry, which comes on the way, has no column in them.
    """
    whole = module.run(case, folder / "whole", quiet=True)
    assert "symmetry_y.fy" not in whole.history
    for stop in (first, len(whole.history["time"]) - 1):
        stopped_after(case, folder / f"{stop}", stop)
        module.resume(folder / f"{stop}", quiet=True)
        assert (folder / f"{stop}" / "history.csv").read_bytes() == (folder / "whole" / "history.csv").read_bytes()


def stop_at(monkeypatch, number: int, error: BaseException) -> None:
    """Raise *error* at the first iteration of increment *number*."""
    call = ProgressBar.__call__

    def interrupted(self, sign):
        if sign.number == number and sign.event == "iteration":
            raise error
        call(self, sign)

    monkeypatch.setattr(ProgressBar, "__call__", interrupted)
