"""One look for all pictures: fonts, colours that colour-blind readers can distinguish, and labels with units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from prensa.measures.units import area_unit as area_unit
from prensa.measures.units import energy_unit as energy_unit
from prensa.measures.units import force_unit as force_unit
from prensa.measures.units import length_unit as length_unit
from prensa.measures.units import moment_unit as moment_unit
from prensa.measures.units import pressure_unit as pressure_unit
from prensa.model.problem import Problem

if TYPE_CHECKING:
    from matplotlib.axis import Axis

BLUE, ORANGE, GREEN, RED, PURPLE, SKY, YELLOW, BLACK = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442", "#1A1A1A",
)  # fmt: skip
"""Okabe & Ito (2008)."""
CYCLE = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY)
TOOL = {"facecolor": "#D9DCE1", "edgecolor": "#4A5058", "hatch": "////", "linewidth": 1.0}
SEQUENTIAL, DIVERGING = "viridis", "RdBu_r"

# widths of figures and sizes of letters go together: 4.5 inches as wide as a phone show 10.2 points as 10 pixels
RC: Any = {
    "figure.figsize": (5.4, 3.6),
    "figure.dpi": 100,
    "savefig.dpi": 180,
    "figure.constrained_layout.use": True,
    "font.family": "DejaVu Sans",
    "mathtext.fontset": "dejavusans",
    "font.size": 10.5,
    "axes.titlesize": 10.5,
    "axes.titleweight": "normal",
    "axes.titlelocation": "left",
    "axes.labelsize": 10.5,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.limits": (-4, 6),
    "axes.grid": True,
    "grid.color": "#E3E5E8",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "xtick.labelsize": 10.2,
    "ytick.labelsize": 10.2,
    "legend.fontsize": 10.2,
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "lines.markersize": 3.5,
    "hatch.color": "#9AA1AB",
    "hatch.linewidth": 0.5,
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the look of the package; matplotlib's own settings are back afterwards."""
    import cycler
    import matplotlib

    with matplotlib.rc_context(RC | {"axes.prop_cycle": cycler.cycler(color=CYCLE)}):
        yield


# ------------------------------------------------------------------------------------------------------------- numbers
# numbers are plain text: matplotlib parses formulas as slowly as it draws all the rest
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def power_of_ten(exponent: int) -> str:
    """10 to a power, as 10⁻⁵."""
    return f"10{str(exponent).translate(_RAISED)}"


def plain_numbers(axis: Axis) -> None:
    """A common power of ten stands at the end of an axis as ×10⁶, and those of a logarithmic one at its ticks as 10⁶."""
    from matplotlib.ticker import FuncFormatter, NullFormatter, ScalarFormatter

    class Scalar(ScalarFormatter):
        """Its offset is ``1e6`` or ``1e6+3``."""

        def get_offset(self) -> str:
            """See `Scalar`."""
            scale, e, rest = super().get_offset().replace("\N{MINUS SIGN}", "-").partition("e")
            digits = rest[: len(rest) - len(rest.lstrip("-0123456789"))]
            return f"×{power_of_ten(int(digits))}{rest[len(digits) :]}" if e and scale == "1" else f"{scale}{e}{rest}"

    if axis.get_scale() == "log":
        axis.set_major_formatter(FuncFormatter(lambda x, _: power_of_ten(round(math.log10(x))) if x > 0 else ""))
        axis.set_minor_formatter(NullFormatter())
    elif isinstance(axis.get_major_formatter(), ScalarFormatter):
        axis.set_major_formatter(Scalar())


def palette(name: str) -> list[str]:
    """A colour map of matplotlib as 256 colours for a page."""
    import matplotlib
    from matplotlib.colors import to_hex

    return [to_hex(c) for c in matplotlib.colormaps[name](range(256))]


# --------------------------------------------------------------------------------------------------------------- names
def axes_names(problem: Problem) -> tuple[str, ...]:
    """Names of the coordinates: x, y, in space z too; r, z in axisymmetry."""
    return {"axisymmetric": ("r", "z"), "solid": ("x", "y", "z")}.get(problem.space, ("x", "y"))
