"""A window: maps of measures over two parameters, with the limits that they have to keep, from a sweep that can be resumed."""

from __future__ import annotations

import csv
import re
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.errors import PrensaError, per_cent
from prensa.model.problem import Case, Problem
from prensa.model.schema import dump
from prensa.output import style
from prensa.output.files import replacing, write_text
from prensa.output.summary import read_summary
from prensa.sensitivity.parameters import value_of
from prensa.study.maps import Map
from prensa.study.page import write_page
from prensa.study.pictures import label
from prensa.study.plan import Plan
from prensa.study.quantities import Quantity, quantities
from prensa.study.results import Row, Study
from prensa.study.slopes import varied_numbers
from prensa.study.sweep import Source, sweep
from prensa.study.values import Values, factors_of, number_and_unit
from prensa.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RUNS, MAP, DESCRIBED = "window.csv", "window.png", "case.yaml"
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
    Beside the tables of the sweep it writes ``window.csv``, with the warnings of each run and the command that reproduces it, and
    ``window.png``. By parameters that have derivatives these are computed too, and maps go by values and gradients.

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
    by, why = varied_numbers(source.base.problem, [f.path for f in varied])
    study = sweep(case, values, asked, out=Path(out or f"results/{source.stem}-window"), derivatives=by, **options)
    _write_runs(study, source)
    maps = {q.text: _map(study, source, q, varied, by, why) for q in known}
    study.notes.extend(f"{text}: {said}" for text, (_, said) in maps.items())
    drawn = {q.text: picture(study, q, *varied, maps[q.text][0], kept.get(q.text)) for q in known}
    captions = {q.text: f"{_caption(q, kept)}. Between the runs {maps[q.text][1]}" for q in known}
    first = drawn[known[0].text]
    if kept:
        both = overview(study, *varied, {text: found for text, (found, _) in maps.items()}, kept)
        first, title = both, "Where all limits are kept (green)"
        write_page(study, lambda _, q: [*([(title, both)] if q == known[0] else []), (captions[q.text], drawn[q.text])])
    else:
        write_page(study, lambda _, q: [(captions[q.text], drawn[q.text])])
    first.savefig(study.directory / MAP, dpi=150, metadata={"Software": None})
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


def _write_runs(study: Study, source: Source) -> None:
    """``window.csv``: a line for each run, with its warnings and the command that computes it again."""
    if not source.summary:  # described in Python: the command needs a file
        write_text(study.directory / DESCRIBED, dump(source.base))
    case = source.summary or str(study.directory / DESCRIBED)
    with replacing(study.directory / RUNS) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*study.columns, "warnings", "command"])
        for row, cells in zip(study.rows, study.cells()):
            changes = " ".join(f"--set {shlex.quote(change)}" for change in row.point.changes)
            shown = [repr(v) if isinstance(v, float) and v == v else "" if isinstance(v, float) else v for v in cells]
            writer.writerow([*shown, _warned(study.directory / row.folder), f"prensa run {shlex.quote(case)} {changes}"])


def _warned(folder: Path) -> str:
    """What a run warned of, the most severe first, without remedies; nothing where no summary is left."""
    try:
        known = read_summary(folder)["warnings"]
    except PrensaError:
        return ""
    return "; ".join(text.splitlines()[0].split("; ")[0] for text in known)


# ------------------------------------------------------------------------------------------------------------------ maps
def _map(
    study: Study, source: Source, quantity: Quantity, varied: tuple[Values, Values], by: list[str], why: str
) -> tuple[Map, str]:
    """The map of a measure, and in words how it goes between the runs."""
    u, v, z = grid(study, quantity.text, *varied)
    slopes, some, lacking = {}, int(np.isfinite(z).sum()), 0
    for axis, (path, t) in enumerate(zip((f.path for f in varied), (u, v))):
        factor = varied[axis]
        own = _grid_of(study, varied, lambda row, p=path: row.slopes.get(quantity.text, {}).get(p, np.nan))  # type: ignore[misc]
        missing = np.isnan(own) & np.isfinite(z)
        if path in by and missing.sum() < 0.5 * some:  # the few that lack them, at the end of what is allowed, take differences
            differences = np.gradient(z, t, axis=1 - axis)
            slopes[path] = np.where(missing, differences, own * _per_unit(source, study, factor))
            lacking = max(lacking, int(missing.sum()))
    made = Map(u, v, z, *(slopes.get(f.path) for f in varied))
    reasons = [*(row.unsloped.get(quantity.text, "") for row in study.rows), why]
    if not some:
        return made, "nothing is known: no run has a value"
    reason = next((r for r in reasons if r), "its runs were computed without gradients")
    if not slopes:
        return made, f"bilinear: {reason}"
    ours, without = made.left_out(), made.bilinear.left_out()
    missed = f"runs that are left out are missed by {per_cent(ours)} of the range, {per_cent(without)} without gradients"
    if ours > without:
        return made.bilinear, f"bilinear: gradients meet left-out runs no better, as where nodes land one by one ({missed})"
    how = "bicubic, by values and gradients" if len(slopes) == 2 else f"cubic along {next(iter(slopes))}, linear else: {reason}"
    how += f" of {some - lacking} of {some} runs ({reason})" if lacking and len(slopes) == 2 else ""
    return made, how + (f"; {missed}" if ours <= without else "")


def _per_unit(source: Source, study: Study, factor: Values) -> float:
    """How much a number of the case is, in its units, over how much of it is written."""
    low, high = (min(study.rows, key=lambda r, s=s: s * _written(r, factor)) for s in (1.0, -1.0))  # type: ignore[misc]
    there = [value_of(source.changed(row.point.changes).problem, factor.path) for row in (low, high)]
    return (there[1] - there[0]) / (_written(high, factor) - _written(low, factor))


def _written(row: Row, factor: Values) -> float:
    found = number_and_unit(row.point.values[factor.path])
    assert found is not None
    return float(found[0])


# -------------------------------------------------------------------------------------------------------------- pictures
def grid(study: Study, text: str, a: Values, b: Values) -> tuple[Array, Array, Array]:
    """Values u (m,) and v (n,) of the two parameters, increasing, and of a measure z (n, m); not a number where there is none."""
    u, v = (np.array(sorted(number_and_unit(t)[0] for t in f.texts)) for f in (a, b))  # type: ignore[index]
    return u, v, _grid_of(study, (a, b), lambda row: row.value(text))


def _grid_of(study: Study, varied: tuple[Values, Values], of: Callable[[Row], float]) -> Array:
    """Numbers of the runs (n, m) where they belong."""
    u, v = (sorted(number_and_unit(t)[0] for t in f.texts) for f in varied)  # type: ignore[index]
    z = np.full((len(v), len(u)), np.nan)
    for row in study.rows:
        i, j = (int(np.searchsorted(x, _written(row, f))) for f, x in zip(varied, (u, v)))
        z[j, i] = of(row)
    return z


def picture(study: Study, quantity: Quantity, a: Values, b: Values, known: Map, limit: Limit | None) -> Figure:
    """Map of a measure over two parameters; its limit is a line, beyond which it is hatched."""
    with style.styled():
        figure, axes = _axes(known, a, b)
        x, y, fine = _between(known)
        if np.isfinite(known.z).any():
            filled = axes.contourf(x, y, np.ma.masked_invalid(fine), levels=14, cmap=style.SEQUENTIAL, zorder=0)
            figure.colorbar(filled, ax=axes, label=quantity.text + (f" ({quantity.unit})" if quantity.unit else ""))
        if limit is not None:
            _beyond(axes, x, y, limit.margin(fine))
    return figure


def overview(study: Study, a: Values, b: Values, maps: Mapping[str, Map], kept: Mapping[str, Limit]) -> Figure:
    """Where all limits are kept, and the line of each."""
    from matplotlib.lines import Line2D

    # lines and area from the same values between the runs: the largest of what is interpolated, not interpolated largest ones
    fine = [(x, y, limit.margin(values) / (abs(limit.value) or 1.0))
            for text, limit in kept.items() for x, y, values in [_between(maps[text])]]  # fmt: skip
    x, y = fine[0][:2]
    some = next(iter(kept))
    every = replace(maps[some], z=np.sum([maps[text].z for text in kept], axis=0))
    with style.styled():
        figure, axes = _axes(every, a, b)
        worst = np.max([z for *_, z in fine], axis=0)  # not a number where one is
        if np.isfinite(worst).any():
            axes.contourf(x, y, np.ma.masked_invalid(worst), levels=[-1e9, 0.0, 1e9], colors=["#b7dfb9", "#f0f0f0"], zorder=0)
        lines = []
        for k, (limit, (*_, margin)) in enumerate(zip(kept.values(), fine)):
            colour = style.CYCLE[k % len(style.CYCLE)]
            lines.append(Line2D([], [], color=colour, label=limit.text))
            if np.isfinite(margin).any() and np.nanmin(margin) < 0.0 < np.nanmax(margin):
                axes.contour(x, y, np.ma.masked_invalid(margin), levels=[0.0], colors=[colour], linewidths=2.0)
        axes.legend(handles=lines, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def _between(known: Map) -> tuple[Array, Array, Array]:
    """Values of a map on a finer grid."""
    x, y = (np.linspace(t[0], t[-1], MAP_LINES) for t in (known.u, known.v))
    return x, y, known.between(x, y)


def _axes(known: Map, a: Values, b: Values) -> tuple[Figure, Axes]:
    """Axes of two parameters with a point for each run, a cross where it has no value."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0, 4.0), layout="constrained")
    axes = figure.subplots()
    x, y = np.meshgrid(known.u, known.v)
    there = np.isfinite(known.z)
    axes.plot(x[there], y[there], "o", color="white", markeredgecolor=style.BLACK, markeredgewidth=0.5, clip_on=False)
    axes.plot(x[~there], y[~there], "x", color=style.RED, markersize=5, clip_on=False)
    axes.set(xlabel=label(a.path, a), ylabel=label(b.path, b))
    axes.grid(False)
    return figure, axes


def _beyond(axes: Axes, x: Array, y: Array, margin: Array) -> None:
    """The line where a limit is reached, and hatches beyond it."""
    if not np.isfinite(margin).any() or not np.nanmin(margin) < 0.0 < np.nanmax(margin):
        return
    shown = np.ma.masked_invalid(margin)
    axes.contour(x, y, shown, levels=[0.0], colors=[style.RED], linewidths=2.0)
    axes.contourf(x, y, shown, levels=[0.0, float(np.nanmax(margin))], colors="none", hatches=["//"])
