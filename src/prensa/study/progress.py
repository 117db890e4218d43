"""Progress of a study: a bar with the time left on a terminal, lines elsewhere; why cases failed at once, each reason once."""

from __future__ import annotations

import logging
import time as clocks

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from prensa.output.terminal import Display
from prensa.study.plan import Point
from prensa.study.work import Outcome

log = logging.getLogger("prensa")

BETWEEN = 5.0  # s, between lines where there is no terminal


class StudyProgress(Display):
    """Shows cases as they are finished: *total* of them, *had* before, *todo* to compute."""

    def __init__(self, total: int, had: int, todo: int, quiet: bool) -> None:
        super().__init__(quiet)
        self._had, self._todo, self._done, self._failed = had, todo, 0, 0
        self._reported = self._began
        self._reasons: set[str] = set()
        self._alike = 0
        if self.has_bar and todo:
            self._bar = Progress(
                TextColumn("{task.description}"), BarColumn(bar_width=24), TextColumn("{task.completed:.0f}/{task.total:.0f}"),
                TimeElapsedColumn(), TextColumn("left {task.fields[left]}"), console=self._console, transient=True,
            )  # fmt: skip
            self._task = self._bar.add_task("computing", total=todo, left="–")

    def finished(self, point: Point, outcome: Outcome) -> None:
        """Count one case; one that failed is reported, also when asked to be quiet: each reason once, with its first case."""
        self._done += 1
        log.info("%s: %s", outcome.status, ", ".join(point.changes))
        if outcome.status != "completed":
            self._failed += 1
            if outcome.reason not in self._reasons:
                self.show_always(f"{outcome.status}: {', '.join(point.changes)}: {outcome.reason}")
            else:
                self._alike += 1
            self._reasons.add(outcome.reason)
        if self._alike and self._done == self._todo:
            self.show_always(f"{self._alike} more cases failed for the same {'reason' if len(self._reasons) == 1 else 'reasons'}")
        if self._bar:
            failed = f", {self._failed} failed" if self._failed else ""
            self._bar.update(self._task, completed=self._done, left=self.left(), description=f"computing{failed}")
        elif clocks.perf_counter() - self._reported > BETWEEN or self._done == self._todo:
            self._reported = clocks.perf_counter()
            self.say(f"{self._done} of {self._todo} cases computed, {self._failed} failed, left {self.left()}")

    def left(self) -> str:
        """Time left if the rest goes as fast as what is done."""
        return self._left(self._done, self._todo - self._done)
