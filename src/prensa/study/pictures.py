"""The pictures of a study: curves of all cases in one axis, responses, tornado charts, scatter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.errors import PrensaError
from prensa.output import style
from prensa.study.effects import Effect, effects, numbers
from prensa.study.order import Convergence
from prensa.study.quantities import Quantity, series_of
from prensa.study.results import QUANTILES, Row, Study
from prensa.study.values import Factor, Scatter, Values
from prensa.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_CURVES = 150  # of a picture; of more some are drawn
MOST_POINTS = 300  # of a curve
MOST_PANELS = 6  # of a picture
IN_A_LEGEND = 8  # values that a legend can distinguish


def _shade(share: Any) -> Any:
    """Colours of shares 0 … 1; the brightest yellow is hard to see on white."""
    import matplotlib

    return matplotlib.colormaps[style.SEQUENTIAL](0.92 * np.asarray(share))


def label(path: str, factor: Factor | None = None) -> str:
    """A path of the case for an axis: its last two parts say what it is."""
    return ".".join(path.split(".")[-2:]) + (f" ({factor.unit})" if factor and factor.unit else "")


def _named(quantity: Quantity, name: str | None = None) -> str:
    return f"{name or quantity.text}" + (f" ({quantity.unit})" if quantity.unit else "")


def _axes(panels: int = 1, size: tuple[float, float] | None = None) -> tuple[Figure, list[Axes]]:
    """A figure of a size (inches; that of the style if there is one panel), and its panels."""
    from matplotlib.figure import Figure

    columns = min(panels, 3)
    rows = -(-panels // columns)
    figure = Figure(figsize=size if panels == 1 else (3 * columns, 3 * rows))
    return figure, list(np.ravel(figure.subplots(rows, columns, squeeze=False)))


# ---------------------------------------------------------------------------------------------------------------- curves
def curves(study: Study, quantity: Quantity) -> tuple[Figure, int] | None:
    """The measure of every case along the travel of its tool, or in time; with the number of curves drawn."""
    done = [row for row in study.rows if row.status == "completed"]
    chosen = done[:: -(-len(done) // MOST_CURVES)] if done else []
    drawn = [(row, xy) for row in chosen if (xy := _curve(study, row, quantity.name)) is not None]
    if not drawn or all(len(xy[0]) < 3 for _, xy in drawn):
        return None
    with style.styled():
        figure, (axes, *_) = _axes()
        colour = _Colours(study, [row for row, _ in drawn], quantity.text)
        for row, (x, y, _) in drawn:
            axes.plot(x, y, color=colour.of(row), linewidth=1.0)
        axes.set_xlabel(drawn[0][1][2])
        axes.set_ylabel(_named(quantity, quantity.name))
        colour.explain(figure, axes)
    return figure, len(drawn)


def _curve(study: Study, row: Row, name: str) -> tuple[Array, Array, str] | None:
    """Abscissa, values and the name of the abscissa."""
    try:
        table = series_of(study.directory / row.folder, row.measures)
    except PrensaError:
        return None
    if name not in table:
        return None
    tool = name.partition(".")[0]
    x, summary = table["time"], "time"
    if tool in study.problem.tools:
        ways = {c: table[f"{tool}.u{c}"] for c in "xy"}
        c = max(ways, key=lambda k: float(np.ptp(np.append(0.0, ways[k]))))
        if np.ptp(np.append(0.0, ways[c])) > 0:
            x, summary = np.abs(ways[c]), f"travel of {tool} in {c} ({study.problem.units.length})"
    if not len(x):
        return None
    keep = np.unique(np.linspace(0, len(x) - 1, MOST_POINTS).round().astype(int))
    return x[keep], table[name][keep], summary


class _Colours:
    """A colour for each case by the value of the quantity that changes the measure most."""

    def __init__(self, study: Study, rows: list[Row], measure: str) -> None:
        found = effects(study.plan, study.rows, measure)
        by = {f.path: f for f in study.plan.factors}
        self.factor = by[found[0].path] if found else None
        self.numbers: Array | None = None
        if self.factor is not None:
            given = [row.point.values[self.factor.path] for row in rows]
            self.texts = list(dict.fromkeys(given))
            self.numbers = numbers(rows, self.factor)
            self.place = dict(zip((id(row) for row in rows), self.numbers)) if self.numbers is not None else {}

    def of(self, row: Row) -> Any:
        """The colour of a case."""
        if self.factor is None:
            return style.BLUE
        if self.numbers is not None:
            low, high = self.numbers.min(), self.numbers.max()
            return _shade((self.place[id(row)] - low) / (high - low))
        return style.CYCLE[self.texts.index(row.point.values[self.factor.path]) % len(style.CYCLE)]

    def explain(self, figure: Figure, axes: Axes) -> None:
        """A legend of few values, a colour bar of many."""
        import matplotlib
        from matplotlib.colors import ListedColormap, Normalize
        from matplotlib.lines import Line2D

        if self.factor is None:
            return
        title = label(self.factor.path, self.factor)
        if self.numbers is not None and len(self.texts) > IN_A_LEGEND:
            lower = ListedColormap(_shade(np.linspace(0, 1, 256)))
            scale = matplotlib.cm.ScalarMappable(Normalize(self.numbers.min(), self.numbers.max()), lower)
            figure.colorbar(scale, ax=axes, label=title)
            return
        if self.numbers is not None:
            low, high = self.numbers.min(), self.numbers.max()
            shades = {v: _shade((v - low) / (high - low)) for v in np.unique(self.numbers)}
            handles = [Line2D([], [], color=c, label=f"{v:g}") for v, c in shades.items()]
        else:
            handles = [
                Line2D([], [], color=style.CYCLE[k % len(style.CYCLE)], label=t)
                for k, t in enumerate(self.texts[:IN_A_LEGEND])
            ]
        axes.legend(handles=handles, title=title, title_fontsize=8)


# -------------------------------------------------------------------------------------------------------------- response
def response(study: Study, quantity: Quantity) -> tuple[Figure, str] | None:
    """The measure over what is varied, and what the picture shows: a line, a surface, or one panel for each quantity."""
    done = [row for row in study.rows if not math.isnan(row.value(quantity.text))]
    ranked = [e.path for e in effects(study.plan, study.rows, quantity.text)]
    by = {f.path: f for f in study.plan.factors}
    axes_of = [(by[p], x) for p in ranked if (x := numbers(done, by[p])) is not None]
    if not axes_of:
        return None
    y = np.array([row.value(quantity.text) for row in done])
    gridded = [(f, x) for f, x in axes_of if isinstance(f, Values)]
    with style.styled():
        if len(gridded) >= 2 and all(len(np.unique(x)) >= 3 for _, x in gridded[:2]):
            rest = "" if len(axes_of) == 2 else ", mean over everything else"
            first, second = (label(f.path) for f, _ in gridded[:2])
            return _surface(gridded[0], gridded[1], y, quantity), f"over {first} and {second}{rest}"
        if len(gridded) >= 1 and not study.plan.scattered:
            return _lines(axes_of, y, quantity), f"over {label(axes_of[0][0].path)}"
        return _panels(axes_of[:MOST_PANELS], y, quantity), "of every case, over each quantity"


def _surface(a: tuple[Factor, Array], b: tuple[Factor, Array], y: Array, quantity: Quantity) -> Figure:
    us, vs = np.unique(a[1]), np.unique(b[1])
    z = np.full((len(vs), len(us)), np.nan)
    for i, v in enumerate(vs):
        for j, u in enumerate(us):
            here = y[(a[1] == u) & (b[1] == v)]
            z[i, j] = here.mean() if len(here) else np.nan
    figure, (axes, *_) = _axes()
    filled = axes.contourf(us, vs, np.ma.masked_invalid(z), levels=14, cmap=style.SEQUENTIAL)
    u, v = np.meshgrid(us, vs)
    there = np.isfinite(z)
    dots: dict[str, Any] = {"color": "white", "markeredgecolor": style.BLACK, "markeredgewidth": 0.5}
    axes.plot(u[there], v[there], "o", clip_on=False, **dots)
    axes.plot(u[~there], v[~there], "x", color=style.RED, markersize=5, clip_on=False)
    axes.set_xlabel(label(a[0].path, a[0]))
    axes.set_ylabel(label(b[0].path, b[0]))
    axes.grid(False)
    figure.colorbar(filled, ax=axes, label=_named(quantity))
    return figure


def _lines(axes_of: list[tuple[Factor, Array]], y: Array, quantity: Quantity) -> Figure:
    """The first quantity along x, a line for each value of the second."""
    axes_of = sorted(axes_of, key=lambda fx: -len(np.unique(fx[1])))
    (first, x), others = axes_of[0], axes_of[1:]
    figure, (axes, *_) = _axes()
    lines = np.unique(others[0][1]) if others else [None]
    for k, value in enumerate(lines):
        here = np.ones(len(y), dtype=bool) if value is None else others[0][1] == value
        us = np.unique(x[here])
        means = [y[here & (x == u)].mean() for u in us]
        colour = style.BLUE if value is None else _shade(k / max(len(lines) - 1, 1))
        axes.plot(us, means, "o-", color=colour, label=None if value is None else f"{value:g}")
    axes.set_xlabel(label(first.path, first))
    axes.set_ylabel(_named(quantity))
    if others and len(lines) <= 2 * IN_A_LEGEND:
        axes.legend(title=label(others[0][0].path, others[0][0]), title_fontsize=8)
    return figure


def _panels(axes_of: list[tuple[Factor, Array]], y: Array, quantity: Quantity) -> Figure:
    figure, panels = _axes(panels=len(axes_of))
    for axes, (factor, x) in zip(panels, axes_of):
        axes.plot(x, y, ".", color=style.BLUE)
        axes.set_xlabel(label(factor.path, factor))
        axes.set_ylabel(_named(quantity))
    for axes in panels[len(axes_of) :]:
        axes.set_visible(False)
    return figure


# ------------------------------------------------------------------------------------------------- tornado, scatter
def tornado(study: Study, quantity: Quantity) -> Figure | None:
    """Bars from the mean of the measure at one end of each quantity to that at the other, the longest on top."""
    found = effects(study.plan, study.rows, quantity.text)
    if len(found) < 2:
        return None
    y = [row.value(quantity.text) for row in study.rows if not math.isnan(row.value(quantity.text))]
    with style.styled():
        figure, (axes, *_) = _axes(size=(5, 1 + len(found) / 2))
        for k, e in enumerate(reversed(found)):
            rises = e.at_high >= e.at_low
            axes.barh(k, e.at_high - e.at_low, left=e.at_low, height=0.5, color=style.RED if rises else style.BLUE)
            _ends(axes, k, e)
        axes.axvline(float(np.mean(y)), color=style.BLACK, linewidth=1.0)
        axes.set_yticks(range(len(found)), [label(e.path) for e in reversed(found)])
        axes.set_xlabel(_named(quantity))
        axes.use_sticky_edges = False  # bars would end at the edge, where their values have no room
        axes.margins(x=0.25)  # for the values beside the bars
        axes.grid(axis="y", visible=False)
    return figure


def _ends(axes: Axes, k: int, e: Effect) -> None:
    """The two values, beside the ends of the bar."""
    left, right = ((e.low, e.at_low), (e.high, e.at_high))[:: 1 if e.at_low <= e.at_high else -1]
    for (text, x), side in ((left, "right"), (right, "left")):
        shift = (-4 if side == "right" else 4, 0)
        axes.annotate(_short(text), (x, k), shift, textcoords="offset points", va="center", ha=side, fontsize=8)


def _short(text: str) -> str:
    number, _, unit = text.partition(" ")
    try:
        return f"{float(number):.4g} {unit}".rstrip()
    except ValueError:
        return text if len(text) <= 20 else f"{text[:19]}…"


def spread(study: Study, quantity: Quantity) -> Figure | None:
    """Share of the cases that stay below a value, one curve for each combination of the given values; quantiles marked."""
    if not any(isinstance(f, Scatter) for f in study.plan.factors):
        return None
    paths = [f.path for f in study.plan.varied if len(f.texts) > 1]
    groups: dict[str, list[float]] = {}
    for row in study.rows:
        if not math.isnan(row.value(quantity.text)):
            name = ", ".join(f"{label(p)} = {row.point.values[p]}" for p in paths)
            groups.setdefault(name, []).append(row.value(quantity.text))
    if not groups:
        return None
    with style.styled():
        figure, (axes, *_) = _axes()
        for name, values in list(groups.items())[:IN_A_LEGEND]:
            v = np.sort(values)
            (line,) = axes.step(v, np.arange(1, len(v) + 1) / len(v), where="post", label=name or None)
            axes.plot(np.quantile(v, QUANTILES), QUANTILES, "o", color=line.get_color())
        axes.set_xlabel(_named(quantity))
        axes.set_ylabel("share of the cases below")
        if paths:
            axes.legend()
    return figure


# ----------------------------------------------------------------------------------------------------------- convergence
def convergence(sizes: Array, results: list[float], kind: str, quantity: Quantity, shows: Convergence) -> Figure | None:
    """Results over the size that is refined, what they are fitted by and their limit; None of fewer than two."""
    y = np.array(results)
    keep = np.isfinite(y)
    if keep.sum() < 2:
        return None
    words = {"mesh": "size of elements", "step": "size of increments", "penalty": "compliance of contact"}
    with style.styled():
        figure, (axes, *_) = _axes()
        axes.plot(sizes[keep], y[keep], "o", color=style.BLUE, markersize=5)
        if shows.has_order:
            h = np.linspace(0, sizes[keep].max(), 200)
            h0, y0 = sizes[keep].min(), y[keep][sizes[keep].argmin()]
            a = np.sum((y[keep] - shows.limit) * sizes[keep] ** shows.order) / np.sum(sizes[keep] ** (2 * shows.order))
            axes.plot(
                h, shows.limit + a * h**shows.order, color=style.BLUE, linewidth=1, label=f"order {shows.order:.2f}"
            )
            axes.errorbar([h0], [y0], shows.band, color=style.BLUE, capsize=3)
            axes.plot(0, shows.limit, "D", color=style.RED, label="extrapolated", clip_on=False, zorder=5)
            axes.legend()
        axes.set_xlim(left=0)
        axes.set_xlabel(f"{words[kind]}, relative to the case's")
        axes.set_ylabel(_named(quantity))
    return figure
