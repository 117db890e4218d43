"""How far a study is: a bar with the time left on a terminal, lines elsewhere; what fails is told at once."""

from __future__ import annotations

import time as clocks
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from prensa.study.plan import Point
from prensa.study.work import Outcome

BETWEEN = 5.0  # s, between lines where there is no terminal


class StudyProgress:
    """Shows cases as they are finished: *total* of them, *had* before, *todo* to compute."""

    def __init__(self, total: int, had: int, todo: int, quiet: bool) -> None:
        self._console, self._quiet = Console(stderr=True), quiet
        self._had, self._todo, self._done, self._failed = had, todo, 0, 0
        self._began = self._told = clocks.perf_counter()
        self._bar: Progress | None = None
        if not quiet and self._console.is_terminal and todo:
            self._bar = Progress(
                TextColumn("{task.description}"), BarColumn(bar_width=24), TextColumn("{task.completed:.0f}/{task.total:.0f}"),
                TimeElapsedColumn(), TextColumn("left {task.fields[left]}"), console=self._console, transient=True,
            )  # fmt: skip
            self._task = self._bar.add_task("computing", total=todo, left="–")

    def __enter__(self) -> StudyProgress:
        if self._bar:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar:
            self._bar.stop()

    def say(self, line: str) -> None:
        """Show a line of text, unless asked to be quiet."""
        if not self._quiet:
            self._print(line)

    def finished(self, point: Point, outcome: Outcome) -> None:
        """Count one case; one that failed is told, also when asked to be quiet."""
        self._done += 1
        if outcome.status != "completed":
            self._failed += 1
            self._print(f"{outcome.status}: {', '.join(point.changes)}: {outcome.reason}")
        if self._bar:
            failed = f", {self._failed} failed" if self._failed else ""
            self._bar.update(self._task, completed=self._done, left=self.left(), description=f"computing{failed}")
        elif clocks.perf_counter() - self._told > BETWEEN or self._done == self._todo:
            self._told = clocks.perf_counter()
            self.say(f"{self._done} of {self._todo} cases computed, {self._failed} failed, left {self.left()}")

    def left(self) -> str:
        """Time left if the rest goes as fast as what is done."""
        if not self._done:
            return "–"
        seconds = round((clocks.perf_counter() - self._began) * (self._todo - self._done) / self._done)
        return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"

    def _print(self, line: str) -> None:
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)
