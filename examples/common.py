"""What the examples share: their arguments, a table of findings against references, figures in the package's look."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from prensa.output import plot, style
from prensa.output.cells import around, outline, triangles
from prensa.verify.table import Row, cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
HERE = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Options:
    """``quick``: coarse and short, to see that it works; ``out``: folder of the pictures, made if needed."""

    quick: bool
    out: Path


def options(description: str | None, name: str, argv: Sequence[str] | None) -> Options:
    """Arguments of the example *name*, from the command line if *argv* is None."""
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0], prog=f"{name}.py")
    parser.add_argument("--quick", action="store_true", help="coarse and short: a few seconds")
    parser.add_argument("--out", type=Path, default=Path("results") / name, help="folder of the results")
    given = parser.parse_args(argv)
    given.out.mkdir(parents=True, exist_ok=True)
    return Options(given.quick, given.out)


def judged(title: str, rows: Sequence[Row]) -> int:
    """Print *rows* (`prensa.verify.table.row`) as a table; returns the number of those beyond their tolerance."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    if not console.is_terminal:
        console = Console(width=110)  # a log has room for the table
    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column("quantity")
    for name in ("reference", "prensa", "error", "allowed"):
        table.add_column(name, justify="right")
    for r in rows:
        _, quantity, reference, ours, error, allowed, verdict = cells(r)
        if r.kind == "report":
            reference, error = (
                ("", "") if np.isnan(r.reference) else (reference, f"{100 * (r.ours / r.reference - 1):+.3g} %")
            )
        table.add_row(quantity, reference, ours, error, allowed, style="bold red" if verdict == "FAIL" else "")
    console.print(table)
    return sum(not r.passed for r in rows)


def beside(quantity: str, reference: float, ours: float) -> Row:
    """A row without a verdict: a reference that is worth seeing beside ours, but that solves another problem."""
    return Row("", quantity, reference, ours, 0.0, "report")


def figure(width: float, height: float, rows: int = 1, columns: int = 1, **subplots: Any) -> tuple[Figure, Any]:
    """Figure that belongs to the caller (no window) and its axes; use it inside ``with style.styled():``."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    made = Figure(figsize=(width, height))
    FigureCanvasAgg(made)
    return made, made.subplots(rows, columns, **subplots)


def saved(made: Figure, path: Path) -> None:
    """Write a figure and say where."""
    print(f"picture: {plot.save(made, path)}")


def section(axes: Axes, x: Array, cells: NDArray[np.int64], values: Array, limits: tuple[float, float]) -> Any:
    """Draw a body: (n, 2) places, (m, a) cells, (n,) *values* in colours between *limits*; returns the mappable."""
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.tri import Triangulation

    drawn = axes.tripcolor(Triangulation(x[:, 0], x[:, 1], triangles(cells)), values, shading="gouraud", vmin=limits[0],
                           vmax=limits[1], cmap=style.SEQUENTIAL, rasterized=True)  # fmt: skip
    if len(cells) <= 1500:
        axes.add_collection(
            PolyCollection(list(x[around(cells)]), facecolors="none", edgecolors="k", linewidths=0.25, alpha=0.35)
        )
    axes.add_collection(LineCollection(list(x[outline(cells)]), colors="0.1", linewidths=0.8))
    axes.set_aspect("equal")
    axes.grid(False)
    return drawn


def half_width(x: Array, pressure: Array) -> float:
    """Half-width of a contact that begins at x = 0, finer than its elements.

    Under a round tool p is √(a² − x²) times something smooth, so p² against x² is nearly a parabola that ends at a². It is
    fitted to the closed points but the last two, where a point's pressure is the mean over a part of an element.
    """
    order = np.argsort(x)
    x, p = x[order], pressure[order]
    closed = int(np.count_nonzero(p > 0))
    scale = x[closed - 1] ** 2
    roots = np.roots(np.polyfit(x[: closed - 2] ** 2 / scale, p[: closed - 2] ** 2, 2)).real
    return float(np.sqrt(scale * roots[np.argmin(np.abs(roots - 1.0))]))
