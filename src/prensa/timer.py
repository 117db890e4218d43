"""Seconds of a run by section."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext


class Timer:
    """Seconds by section, of the wall unless ``clock`` is another (``time.process_time``: of the processor).

    Those of a section within another one are the outer one's: what a remeshing assembles and solves is remeshing.
    """

    def __init__(self, clock: Callable[[], float] = clocks.perf_counter) -> None:
        self.seconds: dict[str, float] = {}
        self.clock = clock
        self.inside = False

    def __call__(self, section: str) -> AbstractContextManager[None]:
        """Add the seconds of the block to a section."""
        return UNTIMED if self.inside else _Section(self, section)


UNTIMED = nullcontext()


class _Section(AbstractContextManager[None]):
    """A block whose seconds a timer adds to a section: an iteration has several, and a generator takes twice as long."""

    def __init__(self, timer: Timer, section: str) -> None:
        self.timer, self.section = timer, section

    def __enter__(self) -> None:
        self.timer.inside, self.start = True, self.timer.clock()

    def __exit__(self, *_: object) -> None:
        timer, section = self.timer, self.section
        timer.inside = False
        timer.seconds[section] = timer.seconds.get(section, 0.0) + timer.clock() - self.start
