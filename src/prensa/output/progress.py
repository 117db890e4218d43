"""Progress display: a bar on a terminal, one live line in a notebook, one line per accepted increment elsewhere.

Nothing when asked to be quiet.
"""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from prensa.solver.increment import Force, Progress


class ProgressBar:
    """Monitor that shows `Progress`: use as a context manager and pass it to ``solve(..., monitor=bar)``.

    Parameters
    ----------
    quiet
        Show nothing.
    console
        Where to show; standard error when None, so that standard output stays free for results.
    start
        Time at which the run starts (not zero when it is resumed).

    """

    def __init__(self, quiet: bool = False, console: Console | None = None, start: float = 0.0) -> None:
        self._console = console or Console(stderr=True, quiet=quiet)
        self._quiet, self._start, self._began = quiet, start, clocks.perf_counter()
        self._bar: Bar | None = None
        self._line = None if quiet or console is not None else notebook_line()
        if not quiet and self._line is None and self._console.is_terminal:
            self._bar = Bar(
                TextColumn("{task.description}"), BarColumn(bar_width=24), TextColumn("{task.percentage:3.0f} %"),
                TextColumn("{task.fields[detail]}"), TimeElapsedColumn(), TextColumn("left {task.fields[left]}"),
                console=self._console, transient=True,
            )  # fmt: skip
            self._task = self._bar.add_task("starting", total=1.0, detail="", left="–")

    def __enter__(self) -> ProgressBar:
        if self._bar:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar:
            self._bar.stop()

    def __call__(self, progress: Progress) -> None:
        """Show one event."""
        if self._quiet:
            return
        if self._bar:
            detail = f"increment {progress.number}, iteration {progress.iteration}, residual {progress.residual:.1e}"
            if progress.event == "accepted":  # a rejected target time would make the bar jump back
                share = progress.time / progress.end if progress.end else 1.0
                self._bar.update(self._task, completed=share, left=self._time_left(progress))
            detail = ", ".join(filter(None, [detail, _forces(progress.forces)]))
            self._bar.update(self._task, description=progress.step, detail=detail)
        if progress.event == "accepted" and not self._bar:
            self._print(self._accepted(progress) + (f", left {self._time_left(progress)}" if self._line else ""))
        elif progress.event in ("rejected", "note") and progress.message:
            self._print(
                f"{progress.step}: {'increment cut: ' if progress.event == 'rejected' else ''}{progress.message}"
            )

    def say(self, line: str) -> None:
        """Show a line of text, unless asked to be quiet."""
        if not self._quiet:
            self._print(line)

    def _accepted(self, progress: Progress) -> str:
        parts = [f"{progress.step}: increment {progress.number}, time {progress.time:.4g} of {progress.end:.4g}"]
        parts += [f"{progress.iteration} iterations", f"residual {progress.residual:.1e}", _forces(progress.forces)]
        return ", ".join(filter(None, parts))

    def warn(self, text: str) -> None:
        """Show a warning, also when asked to be quiet."""
        Console(stderr=True, force_jupyter=False).print(f"warning: {text}", markup=False, highlight=False, soft_wrap=True)

    def _print(self, line: str) -> None:
        if self._line is not None:
            self._line(line)
            return
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)

    def _time_left(self, progress: Progress) -> str:
        """Time left if the rest goes as fast as the part done so far."""
        done = progress.time - self._start
        if done <= 0:
            return "–"
        seconds = round((clocks.perf_counter() - self._began) * (progress.end - progress.time) / done)
        return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"


def notebook_line() -> Callable[[str], None] | None:
    """What replaces the text of one line below the running cell; None outside notebooks. Nothing of IPython is imported there."""
    import sys

    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None else None
    if running is None or getattr(running, "kernel", None) is None:
        return None
    from IPython.display import display

    handle: Any = None

    def show(line: str) -> None:
        nonlocal handle
        text = {"text/plain": line}
        if handle is None:
            handle = display(text, raw=True, display_id=True)
        else:
            handle.update(text, raw=True)

    return show


def _forces(forces: Mapping[str, Force]) -> str:
    """The largest tool force: there is room for one."""
    if not forces:
        return ""
    name = max(forces, key=lambda t: max(abs(forces[t].x), abs(forces[t].y)))
    x, y, _ = forces[name]
    return f"{name} {'xy'[abs(y) >= abs(x)]} {y if abs(y) >= abs(x) else x:.4g}"
