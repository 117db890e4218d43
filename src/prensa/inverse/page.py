"""The page of a calibration: one file that an engineer can hand in."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa import __version__
from prensa.output import style
from prensa.output.files import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_page(fit: Any, path: Path) -> Path:
    """Write the page of a calibration (a `Fit`); returns its path."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("prensa.inverse"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    with style.styled():
        curves = [_drawn(_readings(fit, k)) for k in range(len(fit.channels))]
        bands = [_drawn(_band(fit, p)) for p in fit.bands]
        bends = {p: _drawn(_profile(p, i)) for p, i in fit.parameters.items() if i.followed}
    page = environment.get_template("fit.html").render(
        name=fit.problem.name, version=__version__, fit=fit, curves=curves, bands=bands, bends=bends,
        correlated=[(a, [float(v) for v in row]) for a, row in zip(fit.parameters, fit.correlation)],
        reduced=f"{fit.reduced:.3g}", finite=lambda v: bool(np.isfinite(v)),
        short=_short,
    )  # fmt: skip
    return write_text(path, page)


def _short(value: float, digits: int = 4) -> str:
    """A number to so many digits, without an exponent where that is readable."""
    if not np.isfinite(value):
        return "∞"
    size = int(np.floor(np.log10(abs(value)))) if value else 0
    return f"{value:.{digits}g}" if not -4 <= size < 7 else f"{value:.{max(digits - 1 - size, 0)}f}"


def _drawn(figure: Figure) -> str:
    out = io.BytesIO()
    figure.savefig(out, format="svg", bbox_inches="tight")
    return base64.b64encode(out.getvalue()).decode()


def _readings(fit: Any, number: int) -> Figure:
    """Readings and the case, and their difference over the error of a reading, along the stroke."""
    from matplotlib.figure import Figure

    c = fit.channels[number]
    figure = Figure()
    top, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    top.plot(c.stroke, c.readings, "o", ms=4, mfc="none", label="measured")
    top.plot(c.stroke, c.model, "-", label="case")
    top.set_ylabel(f"{c.name}" + (f" ({c.unit})" if c.unit else ""))
    top.legend()
    below.axhspan(-2, 2, color="0.92", zorder=0)
    below.axhline(0, color="0.6", lw=1)
    below.plot(c.stroke, (c.model - c.readings) / c.sigma, "o", ms=4)
    below.set_ylabel("difference / error")
    below.set_xlabel(c.along)
    return figure


def _profile(path: str, interval: Any) -> Figure:
    """Root of Δχ² over that at the ends of a 95 % interval, along a parameter; straight where the ellipse is right."""
    from matplotlib.figure import Figure

    points = interval.profile.points
    figure = Figure()
    axes = figure.subplots()
    axes.plot(interval.at(points[:, 0]), points[:, 1], "o-", ms=4, label="profile")
    ways = np.array([points[:, 0].min(), points[:, 0].max()])
    axes.plot(interval.at(ways), ways, "--", color="0.5", label="linear")
    axes.axhspan(-1, 1, color="0.92", zorder=0)
    axes.set_ylim(-1.5, 1.5)
    axes.set_xlabel(path)
    axes.set_ylabel("root of Δχ² / its limit")
    axes.legend()
    return figure


def _band(fit: Any, path: str) -> Figure:
    """A flow curve and its band."""
    from matplotlib.figure import Figure

    strain, stress, half = fit.bands[path]
    figure = Figure()
    axes = figure.subplots()
    axes.fill_between(strain, stress - half, stress + half, alpha=0.25, label="95 %, readings alone")
    axes.plot(strain, stress, "-")
    axes.set_xlabel("plastic strain")
    axes.set_ylabel(f"flow stress ({fit.problem.units.force}/{fit.problem.units.length}²)")
    axes.legend()
    return figure
