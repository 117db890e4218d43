"""A window: maps of measures over two parameters, with the limits that they have to keep, from a sweep that can be resumed."""

from __future__ import annotations

import csv
import re
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.errors import PrensaError
from prensa.model.problem import Case, Problem
from prensa.output import style
from prensa.output.files import replacing
from prensa.study.page import write_page
from prensa.study.pictures import label
from prensa.study.plan import Plan
from prensa.study.quantities import Quantity, quantities
from prensa.study.results import Study
from prensa.study.sweep import Source, sweep
from prensa.study.values import Values, factors_of, number_and_unit
from prensa.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RUNS, MAP = "window.csv", "window.png"
MAP_LINES = 121  # lines of the grid on which limits are drawn between the runs
_LOW_TO_HIGH = re.compile(r"([^:,()]+):([^:,()]+):(\d+)")
_KEEPS = re.compile(r"(.+?)\s*(<=|>=)\s*([^<>=]+)")


@dataclass(frozen=True)
class Limit:
    """What a measure has to keep: at most (``sign`` 1) or at least (−1) a ``value``."""

    text: str
    sign: float
    value: float

    def margin(self, values: Array) -> Array:
        """How far values are beyond the limit; negative inside the window."""
        return self.sign * (values - self.value)


def limits_of(texts: Iterable[str]) -> dict[str, Limit]:
    """Limits by measure, of texts such as ``max(punch.fy)<=400e3``.

    Raises
    ------
    PrensaError
        If one is written otherwise.

    """
    found = {}
    for text in texts:
        match = _KEEPS.fullmatch(" ".join(text.split()))
        number = number_and_unit(match[3]) if match else None
        if match is None or number is None or number[1]:
            raise PrensaError(f"--limit {text}: write MEASURE<=NUMBER or MEASURE>=NUMBER, in the units of the case")
        sign, word = (1.0, "≤") if match[2] == "<=" else (-1.0, "≥")
        found[match[1]] = Limit(f"{match[1]} {word} {number[0]:g}", sign, number[0])
    return found


def ranges_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a sweep, with ``low:high:n`` as n values from low to high."""
    return {
        path: f"lin({m[1]}, {m[2]}, {m[3]})" if isinstance(v, str) and (m := _LOW_TO_HIGH.fullmatch(v.strip())) else v
        for path, v in values.items()
    }


def window(
    case: str | Path | Case | Problem,
    values: Mapping[str, Any],
    measures: Iterable[str] = (),
    limits: Iterable[str] = (),
    *,
    out: str | Path | None = None,
    **options: Any,
) -> Study:
    """Map measures of a case over two parameters, and draw where all limits are kept.

    The runs are those of a sweep in the folder *out* (``results/<name>-window`` if None): what it holds is not computed again.
    Beside the tables of the sweep it writes ``window.csv``, with the command that reproduces each run, and ``window.png``.

    Parameters
    ----------
    case, values
        As of `prensa.sweep`; two of the values are several numbers, such as ``0.05:0.3:6``, the others single ones.
    measures
        What is mapped; those of the limits are too. Without any, the largest use of each press.
    limits
        Texts such as ``max(punch.fy)<=400e3``; the use of a press has the limit 1 by itself.
    out
        Folder of the window.
    **options
        As of `prensa.sweep`.

    Raises
    ------
    PrensaError
        If the values are not two ranges of numbers, a limit cannot be read, or as `prensa.sweep`.

    """
    values, kept = ranges_of(values), limits_of(limits)
    varied = _varied(values)
    source = Source(case)
    presses = [f"max({name}.press_utilisation)" for name, tool in source.base.problem.tools.items() if tool.press is not None]
    asked = list(dict.fromkeys([*measures, *kept])) or presses
    if not asked:
        raise PrensaError("nothing to map: give --measure or --limit, such as 'max(punch.fy)<=400e3', or a tool its 'press'")
    kept = {text: Limit(f"{text} ≤ 1", 1.0, 1.0) for text in asked if text in presses} | kept
    known = quantities(asked, source.base.problem)
    study = sweep(case, values, asked, out=Path(out or f"results/{source.stem}-window"), **options)
    _write_runs(study, source.summary or "CASE")
    a, b = varied
    drawn = {q.text: picture(study, q, a, b, kept.get(q.text)) for q in known}
    if kept:
        both = overview(study, a, b, kept)
        both.savefig(study.directory / MAP, dpi=150, metadata={"Software": None})
        write_page(study, lambda _, q: [*([("Where all limits are kept (green)", overview(study, a, b, kept))]
                                          if q == known[0] else []), (_caption(q, kept), drawn[q.text])])  # fmt: skip
    else:
        drawn[known[0].text].savefig(study.directory / MAP, dpi=150, metadata={"Software": None})
        write_page(study, lambda _, q: [(_caption(q, kept), drawn[q.text])])
    return study


def _varied(values: Mapping[str, Any]) -> tuple[Values, Values]:
    """The two factors of a window."""
    factors = Plan(tuple(factors_of(values))).factors
    several = [f for f in factors if not isinstance(f, Values) or len(f.texts) > 1]
    numbers = [f for f in several if isinstance(f, Values) and all(number_and_unit(t) is not None for t in f.texts)]
    if len(several) != 2 or len(numbers) != 2:
        raise PrensaError(
            f"a window is over two parameters, and {len(numbers)} have several numbers; give two, such as --set "
            "friction.mu=0.05:0.3:6"
        )
    return numbers[0], numbers[1]


def _caption(quantity: Quantity, kept: Mapping[str, Limit]) -> str:
    limit = kept.get(quantity.text)
    return f"Map of {quantity.text}" + (f"; line: {limit.text}, hatched: beyond" if limit else "")


def _write_runs(study: Study, source: str) -> None:
    """``window.csv``: a line for each run, with the command that computes it again."""
    head = [*study.columns, "command"]
    with replacing(study.directory / RUNS) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        for row, cells in zip(study.rows, study.cells()):
            changes = " ".join(f"--set {shlex.quote(change)}" for change in row.point.changes)
            shown = [repr(v) if isinstance(v, float) and v == v else "" if isinstance(v, float) else v for v in cells]
            writer.writerow([*shown, f"prensa run {shlex.quote(source)} {changes}"])


# -------------------------------------------------------------------------------------------------------------- pictures
def grid(study: Study, text: str, a: Values, b: Values) -> tuple[Array, Array, Array]:
    """Values u (m,) and v (n,) of the two parameters, increasing, and of a measure z (n, m); not a number where there is none."""
    u, v = (np.array(sorted(number_and_unit(t)[0] for t in f.texts)) for f in (a, b))  # type: ignore[index]
    z = np.full((len(v), len(u)), np.nan)
    for row in study.rows:
        i, j = (int(np.searchsorted(x, number_and_unit(row.point.values[f.path])[0])) for f, x in ((a, u), (b, v)))  # type: ignore[index]
        z[j, i] = row.value(text)
    return u, v, z


def picture(study: Study, quantity: Quantity, a: Values, b: Values, limit: Limit | None) -> Figure:
    """Map of a measure over two parameters; its limit is a line, beyond which it is hatched."""
    u, v, z = grid(study, quantity.text, a, b)
    with style.styled():
        figure, axes = _axes(u, v, z, a, b)
        if np.isfinite(z).any():
            x, y, fine = _between(u, v, z)
            filled = axes.contourf(x, y, np.ma.masked_invalid(fine), levels=14, cmap=style.SEQUENTIAL, zorder=0)
            figure.colorbar(filled, ax=axes, label=quantity.text + (f" ({quantity.unit})" if quantity.unit else ""))
        if limit is not None:
            _beyond(axes, u, v, limit.margin(z))
    return figure


def overview(study: Study, a: Values, b: Values, kept: Mapping[str, Limit]) -> Figure:
    """Where all limits are kept, and the line of each."""
    from matplotlib.lines import Line2D

    grids = {text: grid(study, text, a, b) for text in kept}
    u, v, _ = next(iter(grids.values()))
    margins = [limit.margin(grids[text][2]) / (abs(limit.value) or 1.0) for text, limit in kept.items()]
    # lines and area from the same values between the runs: the largest of what is interpolated, not interpolated largest ones
    fine = [_between(u, v, margin) for margin in margins]
    x, y = fine[0][:2]
    with style.styled():
        figure, axes = _axes(u, v, np.sum(margins, axis=0), a, b)
        worst = np.max([z for *_, z in fine], axis=0)  # not a number where one is
        if np.isfinite(worst).any():
            axes.contourf(x, y, np.ma.masked_invalid(worst), levels=[-1e9, 0.0, 1e9], colors=["#b7dfb9", "#f0f0f0"], zorder=0)
        lines = []
        for k, (limit, (*_, margin)) in enumerate(zip(kept.values(), fine)):
            colour = style.CYCLE[k % len(style.CYCLE)]
            lines.append(Line2D([], [], color=colour, label=limit.text))
            if np.nanmin(margin) < 0.0 < np.nanmax(margin):
                axes.contour(x, y, np.ma.masked_invalid(margin), levels=[0.0], colors=[colour], linewidths=2.0)
        axes.legend(handles=lines, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def _between(u: Array, v: Array, z: Array) -> tuple[Array, Array, Array]:
    """Values z (n, m) over v (n,) and u (m,) on a finer grid, bilinear between the runs."""
    x, y = np.linspace(u[0], u[-1], MAP_LINES), np.linspace(v[0], v[-1], MAP_LINES)
    across = np.array([np.interp(x, u, row) for row in z])
    return x, y, np.array([np.interp(y, v, column) for column in across.T]).T


def _axes(u: Array, v: Array, z: Array, a: Values, b: Values) -> tuple[Figure, Axes]:
    """Axes of two parameters with a point for each run, a cross where it has no value."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0, 4.0), layout="constrained")
    axes = figure.subplots()
    x, y = np.meshgrid(u, v)
    there = np.isfinite(z)
    axes.plot(x[there], y[there], "o", color="white", markeredgecolor=style.BLACK, markeredgewidth=0.5, clip_on=False)
    axes.plot(x[~there], y[~there], "x", color=style.RED, markersize=5, clip_on=False)
    axes.set(xlabel=label(a.path, a), ylabel=label(b.path, b))
    axes.grid(False)
    return figure, axes


def _beyond(axes: Axes, u: Array, v: Array, margin: Array) -> None:
    """The line where a limit is reached, and hatches beyond it."""
    if not np.isfinite(margin).any() or not np.nanmin(margin) < 0.0 < np.nanmax(margin):
        return
    x, y, fine = _between(u, v, margin)
    shown = np.ma.masked_invalid(fine)
    axes.contour(x, y, shown, levels=[0.0], colors=[style.RED], linewidths=2.0)
    axes.contourf(x, y, shown, levels=[0.0, float(np.nanmax(margin))], colors="none", hatches=["//"])
