"""A run, from `prensa.run` or read back from its folder, ended or not: increments, tables, pictures, animations."""

from __future__ import annotations

import base64
import html
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError, take, take_path
from prensa.output import history
from prensa.output.curve import ForceCurve, force_curve
from prensa.output.maxima import Maximum, largest_force, maxima
from prensa.output.report import REPORT, stored_run, write_report
from prensa.output.stored import Stored
from prensa.output.summary import COMPLETED, ENDED, progress_of, read_summary
from prensa.result.increment import Increment
from prensa.result.views import Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from prensa.dies.loads import ToolLoads
    from prensa.dies.stress import Die, DieStress
    from prensa.friction.wear_law import WearLaw
    from prensa.output.along import Profile
    from prensa.output.tool_maps import ToolMap

FILM_DPI = 110  # pixels an inch of a film unless others are asked for
MOST_PICTURES = 60  # of an animation unless more are asked for: each takes a quarter of a second
PLOTS = ("force_stroke", "energy", "convergence")


@dataclass(frozen=True, repr=False)
class RunResult(Shown):
    """What a run gave: its folder, how it ended, its last increment, and its summary.

    ``status`` is ``completed`` (always so where `prensa.run` returns it), ``failed`` or ``interrupted``; of a run that has not
    ended ``running``, ``killed`` or, where it is unknown which, ``killed or still running``: ``summary["reason"]`` says how
    far it has come. ``increment`` is None when there is none yet or a resumed run had nothing left to do; ``summary`` is the
    content of ``summary.json``, of a run that has not ended as its tables stand.
    """

    directory: Path
    status: str
    increment: Increment | None
    summary: dict[str, Any]

    @property
    def history(self) -> dict[str, NDArray[Any]]:
        """Columns of ``history.csv``, one row an increment."""
        return history.read_history(self.directory)

    @property
    def iterations(self) -> dict[str, NDArray[Any]]:
        """Columns of ``convergence.csv``: residual and status changes of every iteration of every increment."""
        return history.read_convergence(self.directory)

    @cached_property
    def increments(self) -> Stored:
        """All increments, read back from the folder when they are asked for: a sequence, ``increments[-1]`` is the last."""
        return stored_run(self.directory, self.summary)

    def maxima(self) -> list[Maximum]:
        """Largest forces, moments, pressures, stresses, strains and thinning, with when and where."""
        return maxima(self.increments)

    def at(self, when: int | str) -> Increment:
        """The increment of a number (from 1), at the end of a step (its name), the ``last``, or the one of ``largest force``.

        The last and the largest force are those of the increments whose fields were written.

        Raises
        ------
        PrensaError
            If there is no such increment.

        """
        stored, table = self.increments, self.increments.history
        if not len(stored):
            raise PrensaError(f"{self.directory}: {self.status}: {progress_of(self.summary)}; there is nothing to show")
        if isinstance(when, int | np.integer):
            if when not in table["increment"]:
                raise PrensaError(f"there is no increment {when}; the run has {len(stored)}, counted from 1")
            return stored.number(int(when))
        number: int | None
        if when == "largest force":
            number = largest_force(stored, stored.with_fields)
        elif when == "last":
            number = stored.with_fields[-1] if stored.with_fields else None
        else:
            ends = table["increment"][stored.ends & (table["step"] == when)]
            number = int(ends[-1]) if len(ends) else None
        if number is None:
            steps = ", ".join(repr(str(s)) for s in dict.fromkeys(table["step"][stored.ends]))
            raise PrensaError(f"no increment is {when!r}; give a number, 'last', 'largest force' or a step that ended: {steps}")
        return stored.number(number)

    def loads(self, tool: str, intervals: int = 100) -> ToolLoads:
        """Pressure, shear and sliding of a tool along its outline, over the whole run: see `prensa.tool_loads`."""
        from prensa.dies.loads import tool_loads

        return tool_loads(self.increments, self.increments.problem, tool, intervals)

    def tool_map(self, tool: str, law: WearLaw | None = None) -> ToolMap:
        """Largest pressure and shear, sliding and wear over the surface of a tool in space, in the tool's own axes.

        Wear is by a ``law``, without one ∫ p ds.
        ``save`` writes a surface for ParaView (``.vtu``) or a table (``.csv``).
        """
        from prensa.output.tool_maps import tool_map

        return tool_map(self.increments, self.increments.problem, tool, law)

    def die(self, tool: str, die: Die, at: int | str = "largest force") -> DieStress:
        """The section of a tool as an elastic body under the forces of an increment, as in `at`: see `prensa.die_stress`."""
        from prensa.dies.stress import die_stress, refuse_die

        refuse_die(self.increments.problem, tool, die)
        return die_stress(self._pressed(tool) if at == "largest force" else self.at(at), self.increments.problem, tool, die)

    def _pressed(self, tool: str) -> Increment:
        """The increment in which a tool is pressed most."""
        table = self.increments.history
        if not len(self.increments):
            self.at("last")  # which says why there is none
        return self.increments[int(np.argmax(np.hypot(table[f"{tool}.fx"], table[f"{tool}.fy"])))]

    def plot(self, what: str = "mises", at: int | str = "last", **options: Any) -> Figure:
        """A picture of the run.

        Parameters
        ----------
        what
            ``force_stroke``, ``energy`` or ``convergence`` of the whole run, or what `Increment.plot` draws.
        at
            The increment to draw, as in `at`.
        **options
            As of `Increment.plot`; of curves of the whole run ``size`` and ``dpi``.

        Raises
        ------
        PrensaError
            If there is no such picture, field, contact or increment.

        """
        from prensa.output import plot

        others = [name for name in options if name not in ("size", "dpi")]
        if what in PLOTS and others:
            raise PrensaError(f"{what!r} takes no options but 'size' and 'dpi', not even {others[0]!r}")
        problem, table = self.increments.problem, self.increments.history
        if what in PLOTS and not len(self.increments):
            self.at("last")  # which says why there is none
        if what == "force_stroke":
            return plot.force_stroke(table, problem, **options)
        if what == "energy":
            return plot.energy(table, problem, **options)
        if what == "convergence":
            tolerance = self.summary["convergence"]["tolerance"]
            return plot.convergence(table, self.iterations, problem, tolerance, **options)
        mirrored = what != "pressure" or problem.space == "solid"
        return self.at(at).plot(what, **({"mirror": self.increments.mirror} if mirrored else {}) | options)

    def animate(
        self, what: str = "mises", path: str | Path | None = None, fps: int = 10, frames: int = MOST_PICTURES, **options: Any
    ) -> Animation:
        """A film of a field over the run, colours, axes and view the same throughout; in space also of ``pressure``.

        Parameters
        ----------
        what, **options
            As of `Increment.plot`, a field, in space or ``pressure``.
        path
            File to write: ``.gif``, or ``.mp4`` where the program ffmpeg is installed; ``<folder>/<what>.gif`` if None.
        fps
            Pictures a second.
        frames
            Pictures at most: of more increments with fields, evenly spaced ones and the last.

        Raises
        ------
        PrensaError
            If there are no fields, no such field, or the file's ending is another.

        """
        numbers = self.increments.with_fields
        if not numbers:
            raise PrensaError(f"{self.directory}: no fields were written, so there is nothing to animate")
        if fps <= 0 or frames < 1:
            raise PrensaError(f"'fps' and 'frames' must be positive, got {fps} and {frames}")
        chosen = np.unique(np.linspace(0, len(numbers) - 1, min(frames, len(numbers))).round().astype(int))
        shown = [self.increments.number(numbers[k]) for k in chosen]
        target = Path(path) if path is not None else self.directory / f"{what.replace('.', '_')}.gif"
        return _film(target, shown, what, fps, {"mirror": self.increments.mirror} | options)

    def profile(self, line: str, at: int | str = "last") -> Profile:
        """What lies along a line of a body, ``billet.right`` or in space ``blank.top at Z=0``, in an increment as of `at`.

        Coordinates and fields, as columns; ``save`` writes a table.
        """
        from prensa.output.along import profile

        return profile(self.at(at), self.increments.problem, line)

    def curve(self, tool: str = "") -> ForceCurve:
        """Force against travel of a tool, of the one that does the most work if none is named; ``save`` writes two columns.

        Raises
        ------
        PrensaError
            If there is no such tool, or it never moves.

        """
        if not len(self.increments):
            self.at("last")  # which says why there is none
        return force_curve(self.increments.history, self.increments.problem, tool)

    def to_frame(self) -> DataFrame:
        """The history as a table of pandas, one row an increment; needs ``pip install prensa[notebook]``.

        ``attrs["units"]`` has the units of its columns.
        """
        from prensa.output.views import table

        made = table(self.history, "increment")
        made.attrs["units"] = self.summary.get("units", {}).get("history", {})
        return made

    def report(self) -> Path:
        """Path of the report, written anew if it is not there or the run has not ended."""
        path = self.directory / REPORT
        return path if path.is_file() and self.status in ENDED else write_report(self.directory)

    def _line(self) -> str:
        totals = self.summary.get("totals", {})
        if totals and self.status != COMPLETED:
            return f"{self.summary.get('name', '')!r} {self.status}: {progress_of(self.summary)}, in {self.directory}"
        return f"{self.summary.get('name', '')!r} {self.status}: {totals.get('increments', 0)} increments in {self.directory}"

    def _card(self) -> list[tuple[str, str]]:
        far = "" if self.status == COMPLETED else f": {progress_of(self.summary)}"
        rows = [("run", f"{self.summary['name']}, {self.status}{far}"), ("folder", str(self.directory))]
        totals = self.summary["totals"]
        cost = f"{totals['increments']} increments, {totals['iterations']} iterations, {totals['wall_seconds']:.1f} s"
        rows.append(("cost", cost))
        rows += [("warning", text) for text in self.summary["warnings"]]
        for m in self.maxima() if len(self.increments) else []:
            rows.append((f"largest {m.what}", f"{m.value:.5g} {m.unit}, {m.of}, increment {m.increment} (step {m.step})"))
        return rows


@dataclass(frozen=True)
class Animation:
    """A film in a file, which notebooks show."""

    path: Path

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.path.read_bytes()).decode("ascii")
        if self.path.suffix == ".gif":
            return f'<img alt="{html.escape(self.path.stem)}" src="data:image/gif;base64,{data}">'
        return f'<video controls loop autoplay muted src="data:video/mp4;base64,{data}"></video>'


def results(directory: str | Path) -> RunResult:
    """The run that `prensa run` or `prensa.run` left in *directory*, completed or not, or is still writing.

    Raises
    ------
    PrensaError
        If there is no run in the folder.

    """
    take("results", "directory", directory, (str, PathLike), "give the folder of a run")
    folder = take_path("results", directory)
    summary = read_summary(folder)
    made = RunResult(folder, str(summary["status"]), None, summary)
    last = made.increments[-1] if len(made.increments) else None
    return RunResult(folder, made.status, last, summary)


# ------------------------------------------------------------------------------------------------------------- details
def _film(path: Path, shown: Sequence[Increment], what: str, fps: int, options: dict[str, Any]) -> Animation:
    """Pictures of all increments in one file, all with the same colours and cut-out."""
    from matplotlib.animation import FFMpegWriter, PillowWriter

    from prensa.output import style

    kind = path.suffix.lower()
    if kind not in (".gif", ".mp4"):
        raise PrensaError(f"{path}: animations are .gif or .mp4 files; give one of these endings")
    if kind == ".mp4" and shutil.which("ffmpeg") is None:
        raise PrensaError(f"{path}: an .mp4 needs the program ffmpeg, which is not on the path; install it or write a .gif")
    fixed = _fixed(shown, what, options)
    same = fixed | options | {key: fixed[key] for key in ("view",) if key in fixed}
    dpi = same.pop("dpi", None) or FILM_DPI
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = PillowWriter(fps=fps) if kind == ".gif" else FFMpegWriter(fps=fps)
    figure = shown[0].plot(what, dpi=dpi, **same)
    with style.styled(), writer.saving(figure, str(path), dpi=dpi):
        for increment in shown:
            writer.fig = increment.plot(what, dpi=dpi, **same)
            writer.grab_frame()
    return Animation(path)


def _fixed(shown: Sequence[Increment], what: str, options: dict[str, Any]) -> dict[str, Any]:
    """Part of the bodies' surroundings, colours and view that hold for all pictures of a film."""
    from prensa.output import plot, spatial
    from prensa.output.mirrors import whole_of

    problem, mirror = shown[0].problem, options.get("mirror", ())
    solid = problem.space == "solid"
    if what == "pressure" and not solid:
        raise PrensaError("in the plane a film shows a field of the bodies, and 'pressure' is a curve along a contact")
    ends = np.array([plot.limits(i, problem, mirror) for i in shown]).reshape(len(shown), -1, 2)
    box = tuple(np.stack([ends[..., 0].min(axis=0), ends[..., 1].max(axis=0)], axis=1).ravel().tolist())
    if what != "pressure":
        if solid:
            whole = whole_of(shown[0], problem, mirror)
            around = np.reshape(box, (3, 2)).T
            ends = np.array([spatial.with_tools(i, problem, whole, around) for i in shown])
            box = tuple(np.stack([ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)], axis=1).ravel().tolist())
        values = [v for i in shown for v in plot.seen_values(i, problem, what, mirror)]
        seen = {"view": spatial.view_angles(options["view"], shown[-1])} if options.get("view") and solid else {}
        return {"box": box, "range": plot.colour_range(values, what)} | seen
    pressures = [spatial.contact_pressures(i, b, options.get("contact", "")) for i in shown for b in i.bodies]
    largest = max((float(p.max(initial=0.0)) for p in pressures), default=0.0)
    pressed = max(shown, key=lambda i: sum(float(c.pressure.sum()) for c in i.contacts.values()))
    view = spatial.view_angles(options.get("view") or spatial.TOOL_SIDE, pressed)
    return {"box": box, "range": (0.0, largest or 1.0), "view": view}
