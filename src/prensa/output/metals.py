"""Metals as lines of a list and as flow curves in a picture, to the end of their tests and beyond."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.materials.flow_curve import stress_at
from prensa.materials.metals import Metal, MetalFile
from prensa.model.schema import brief, plain
from prensa.output import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Metals = Mapping[str, tuple[Metal, MetalFile]]


def lines_of(metals: Metals, whole: bool) -> Iterator[str]:
    """Metals with their ranges and sources, one a line, or (``whole``) all that their files say."""
    widest = max(map(len, metals), default=0)
    for name, (metal, file) in metals.items():
        also = f" ({', '.join(file.also)})" if file.also else ""
        if not whole:
            source = file.source.partition(", ")[0]
            yield f"{name:<{widest}}  {file.what}{also}; strain to {file.strain[1]:g}; {source}"
            continue
        yield f"{name}{also}: {file.what}"
        yield f"  material: {{type: j2, of: {name}}}"
        yield f"  E {file.E / 1e3:g} GPa, nu {file.nu:g}" + (f": {file.elastic}" if file.elastic else "")
        yield f"  flow: {brief(file.flow)}, stresses in MPa"
        yield f"  {metal.words().removeprefix(f'{name} ')}"
        yield from (f"  {text}" for text in (file.see, file.note, file.licence) if text)


def summary_of(metals: Metals) -> dict[str, Any]:
    """The same as data."""
    return {name: plain(file) for name, (_, file) in metals.items()}


def flow_curves(metals: Metals, strain: float | None = None) -> Figure:
    """Flow stresses of metals over the plastic strain, dashed beyond their tests, up to ``strain``, or twice the longest test."""
    from matplotlib.figure import Figure

    most = strain or 2.0 * max(file.strain[1] for _, file in metals.values())
    with style.styled():
        many = len(metals) > len(style.CYCLE)
        figure = Figure(figsize=(7.2, 5.6) if many else None)
        axes = figure.add_subplot()
        ends = []
        for k, (name, (_, file)) in enumerate(metals.items()):
            colour = style.CYCLE[k % len(style.CYCLE)]
            rate = file.rate[0] if file.rate else 0.0
            for low, high, dashes in ((0.0, file.strain[1], "-"), (file.strain[1], most, (0, (3, 2)))):
                x = np.linspace(low, max(high, low), 200)
                y = stress_at(file.flow, x, np.full_like(x, rate))
                axes.plot(x, y, color=colour, linestyle=dashes, label=name if low == 0.0 else None)
            ends.append((float(y[-1]), name, colour))
        axes.set(xlim=(0, most), ylim=(0, None), xlabel="plastic strain", ylabel="flow stress (MPa)")
        axes.set_title("dashed: beyond the tests")
        if many:
            _names_at_the_end(axes, ends, most)
        else:
            axes.legend()
    return figure


def _names_at_the_end(axes: Axes, ends: list[tuple[float, str, str]], most: float) -> None:
    """Names in the order of the ends of their curves, one above the other, with a line to each end."""
    top = axes.get_ylim()[1]
    for k, (stress, name, colour) in enumerate(sorted(ends)):
        axes.annotate(
            name, (most, stress), (1.08 * most, top * (k + 1 / 2) / len(ends)), color=colour, va="center", fontsize="small",
            annotation_clip=False, arrowprops={"arrowstyle": "-", "color": colour, "lw": 1 / 2, "relpos": (0, 1 / 2)},
        )  # fmt: skip
