"""Progress display: a bar on a terminal, one live line in a notebook, one line per accepted increment elsewhere.

Nothing when asked to be quiet.
"""

from __future__ import annotations

from collections.abc import Mapping

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from prensa.output.terminal import Display
from prensa.result.increment import Force, Progress


class ProgressBar(Display):
    """Monitor that shows `Progress`: use as a context manager and pass it to ``solve(..., monitor=bar)``.

    Parameters
    ----------
    quiet
        Show nothing but warnings.
    console
        Where to show; standard error when None, so that standard output stays free for results.
    start
        Time at which the run starts (not zero when it is resumed).

    """

    def __init__(self, quiet: bool = False, console: Console | None = None, start: float = 0.0) -> None:
        super().__init__(quiet, console)
        self._start = start
        if self.has_bar:
            self._bar = Bar(
                TextColumn("{task.description}"), BarColumn(bar_width=24), TextColumn("{task.percentage:3.0f} %"),
                TextColumn("{task.fields[detail]}"), TimeElapsedColumn(), TextColumn("left {task.fields[left]}"),
                console=self._console, transient=True,
            )  # fmt: skip
            self._task = self._bar.add_task("starting", total=1.0, detail="", left="–")

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

    def _accepted(self, progress: Progress) -> str:
        parts = [f"{progress.step}: increment {progress.number}, time {progress.time:.4g} of {progress.end:.4g}"]
        parts += [f"{progress.iteration} iterations", f"residual {progress.residual:.1e}", _forces(progress.forces)]
        return ", ".join(filter(None, parts))

    def _time_left(self, progress: Progress) -> str:
        """Time left if the rest goes as fast as the part done so far."""
        return self._left(progress.time - self._start, progress.end - progress.time)


def _forces(forces: Mapping[str, Force]) -> str:
    """The largest tool force: there is room for one."""
    if not forces:
        return ""
    name = max(forces, key=lambda t: max(abs(forces[t].x), abs(forces[t].y)))
    x, y, _ = forces[name]
    return f"{name} {'xy'[abs(y) >= abs(x)]} {y if abs(y) >= abs(x) else x:.4g}"
