"""Progress display: a bar on a terminal, one live line in a notebook, one line per accepted increment elsewhere.

Nothing when asked to be quiet.
"""

from __future__ import annotations

import math

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from prensa.measures.units import force_unit, length_unit
from prensa.model.problem import Problem
from prensa.output.answer import shown
from prensa.output.terminal import Display
from prensa.result.increment import Progress

BAR = 24  # columns of the bar, where the terminal has room


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
        self.problem: Problem | None = None
        """What is run, for units and for what counts as a force; a run sets it."""
        if self.has_bar:
            self._bar = Bar(
                TextColumn("{task.description}"), BarColumn(bar_width=BAR), TextColumn("{task.percentage:3.0f} %"),
                TextColumn("{task.fields[detail]}"), TimeElapsedColumn(), TextColumn("left {task.fields[left]}"),
                console=self._console, transient=True,
            )  # fmt: skip
            self._task = self._bar.add_task("starting", total=1.0, detail="", left="–")

    def __call__(self, progress: Progress) -> None:
        """Show one event."""
        if self._quiet:
            return
        if self._bar:
            if progress.event == "accepted":  # a rejected target time would make the bar jump back
                share = progress.time / progress.end if progress.end else 1.0
                self._bar.update(self._task, completed=share, left=self._time_left(progress))
            self._bar.update(self._task, description=progress.step, detail=self._detail(progress))
        if progress.event == "accepted" and not self._bar:
            self._print(self._accepted(progress) + (f", left {self._time_left(progress)}" if self._line else ""))
        elif progress.event in ("rejected", "note") and progress.message:
            self._print(
                f"{progress.step}: {'increment cut: ' if progress.event == 'rejected' else ''}{progress.message}"
            )

    def _accepted(self, progress: Progress) -> str:
        parts = [f"{progress.step}: increment {progress.number}, time {progress.time:.4g} of {progress.end:.4g}"]
        parts += [f"{progress.iteration} iterations", _krylov(progress), f"residual {progress.residual:.1e}"]
        parts += [self._forces(progress)]
        return ", ".join(filter(None, parts))

    def _detail(self, progress: Progress) -> str:
        """What stands beside the bar: the force first, then as much of the cost as the terminal has room for."""
        cost = [f"increment {progress.number}", f"iteration {progress.iteration}", f"residual {progress.residual:.1e}"]
        cost.append(_krylov(progress))
        parts = [part for part in (self._forces(progress), *cost) if part]
        room = self._console.width - len(f"{progress.step}  100 %  0:00:00 left 0:00:00 ") - BAR
        while len(parts) > 1 and len(", ".join(parts)) > room:
            parts.pop()
        return ", ".join(parts)

    def _time_left(self, progress: Progress) -> str:
        """Time left if the rest goes as fast as the part done so far."""
        return self._left(progress.time - self._start, progress.end - progress.time)

    def _forces(self, progress: Progress) -> str:
        """The largest force of tools that have moved, else of all, with the way of that tool: there is room for one."""
        forces, p = progress.forces, self.problem
        if not forces:
            return ""
        axes = {"axisymmetric": "y", "solid": "yxz"}.get(p.space if p is not None else "", "yx")  # a ring's radial forces balance
        moved = [t for t in forces if any(progress.places.get(t, ())) and any(getattr(forces[t], a) for a in axes)]
        name, axis = max(((t, a) for t in moved or forces for a in axes), key=lambda c: abs(getattr(forces[c[0]], c[1])))
        force = getattr(forces[name], axis)
        if p is None:
            return f"{name} {axis} {force:.4g}"
        text = f"{name} {axis} {shown(force, force_unit(p), both=False)}"
        place = progress.places.get(name)
        if place is None:
            return text
        d = len(place) // 2 + len(place) % 2
        gone, turned = math.hypot(*place[:d]), math.hypot(*place[d:])
        if not (gone or turned):
            return text
        return f"{text} at {shown(gone, length_unit(p))}" if gone else f"{text} at {shown(turned, 'rad')}"


def _krylov(progress: Progress) -> str:
    """What the linear systems of the increment have taken so far, where they are solved by GMRES."""
    return f"{progress.krylov} Krylov iterations" if progress.krylov else ""
