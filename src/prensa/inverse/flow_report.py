"""Fitted flow laws in words, as lines to paste into a case, and in a picture with residuals and what lies beyond the data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.errors import per_cent
from prensa.inverse.flow_data import FlowData
from prensa.inverse.flow_laws import FittedCurve, extrapolated
from prensa.materials.flow_curve import stress_at
from prensa.model.places import bare, hints
from prensa.model.schema import plain
from prensa.model.units import PRESSURE
from prensa.output import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def snippet(fit: FittedCurve, unit: str) -> str:
    """The ``flow`` of a case, as text to paste; ``unit`` of the stresses, '' for plain numbers."""
    curve: Any = fit.curve
    cls: Any = type(curve)
    known, parts = hints(cls), [f"type: {fit.law}"]
    for f in fields(curve):
        if f.name != "type":
            stress = any(m == PRESSURE for m in bare(known[f.name])[1])
            parts.append(f"{f.name}: {getattr(curve, f.name):.6g}{f' {unit}' if stress and unit else ''}")
    return f"flow: {{{', '.join(parts)}}}"


def beyond(data: FlowData, to: float | None = None) -> list[float]:
    """Strains at which the laws are compared: the last of the data, and ``to``, twice as far if it is not given."""
    last = float(data.strain[-1])
    return [last, max(to or 2.0 * last, last)]


def lines_of(name: str, data: FlowData, fits: Sequence[FittedCurve], to: float | None = None) -> Iterator[str]:
    """What was found: each law with its error and its stresses at the end of the data and beyond, and the best to paste."""
    unit = data.unit or "the unit of the case"
    last, far = beyond(data, to)
    yield (
        f"{name}: {len(data.strain)} readings, plastic strain {data.strain[0]:g} to {last:g}, stress {data.stress.min():.4g} to "
        f"{data.stress.max():.4g} in {unit}"
    )
    rows = [("law, the best first", "error of a reading", f"at {last:g}", f"at {far:g}")]
    (_, ends, _), (_, fars, spread) = extrapolated(fits, (last, far))
    mean = float(data.stress.mean())
    for fit, end, there in zip(fits, ends, fars):
        band = float(fit.band(np.array([far]))[0])
        rows.append((fit.law, f"{fit.error:.2g} ({100 * fit.error / mean:.1g} %)", f"{end:.5g}", f"{there:.5g} ± {band:.2g}"))
    wide = [max(len(row[k]) for row in rows) for k in range(4)]
    yield from ("  " + "  ".join(cell.ljust(w) for cell, w in zip(row, wide)).rstrip() for row in rows)
    if alike := [fit.law for fit in fits[1:] if not fit.worse]:
        yield f"as good within scatter, with more constants or a larger error: {', '.join(alike)}"
    if loose := [fit.law for fit in fits if not (fit.worse or fit.determined)]:
        yield f"constants that the readings do not determine (95 % intervals reach zero) are in: {', '.join(loose)}"
    if len(fits) > 1 and far > last:
        yield f"beyond the data nothing is known: at {far:g} the laws lie {per_cent(spread)} of their mean apart"
    yield snippet(fits[0], data.unit)


def summary_of(data: FlowData, fits: Sequence[FittedCurve], to: float | None = None) -> dict[str, Any]:
    """The same as data."""
    laws = [
        {
            "type": f.law, "error": f.error, "residuals": f.residuals, "flow": snippet(f, data.unit),
            "worse": f.worse, "determined": f.determined,
            "constants": {key: value for key, value in plain(f.curve).items() if key != "type"},
        }
        for f in fits
    ]  # fmt: skip
    apart = [
        {"strain": e, "stresses": s, "apart": a, "bands": [float(f.band(np.full(1, e))[0]) for f in fits]}
        for e, s, a in extrapolated(fits, beyond(data, to))
    ]
    return {"unit": data.unit, "readings": len(data.strain), "laws": laws, "beyond": apart}


def figure_of(data: FlowData, fits: Sequence[FittedCurve], to: float | None = None) -> Figure:
    """Readings and laws, dashed and shaded from the lowest to the highest beyond the readings; below them the residuals."""
    from matplotlib.figure import Figure

    last, far = beyond(data, to)
    unit = f" ({data.unit})" if data.unit else ""
    inside, outside = np.linspace(0.0, last, 200), np.linspace(last, far, 100)
    with style.styled():
        figure = Figure(figsize=(5.8, 5.2))
        top, low = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.3))
        curves = np.array([stress_at(f.curve, outside, np.zeros_like(outside)) for f in fits])
        if far > last:
            top.fill_between(outside, curves.min(axis=0), curves.max(axis=0), color="#E3E5E8", label="not measured")
            low.axvspan(last, far, color="#F3F4F6")
        middle, half = curves[0], fits[0].band(outside)
        top.fill_between(outside, middle - half, middle + half, color=style.CYCLE[0], alpha=0.3, linewidth=0.0)
        for fit, there, colour in zip(fits, curves, style.CYCLE):
            here = stress_at(fit.curve, inside, np.zeros_like(inside))
            top.plot(inside, here, color=colour, label=f"{fit.law} ± {fit.error:.2g}")
            top.plot(outside, there, color=colour, linestyle=(0, (3, 2)))
            low.plot(data.strain, fit.residuals, color=colour, marker=".", linewidth=0.8)
        top.plot(data.strain, data.stress, "o", color=style.BLACK, markerfacecolor="none", label="measured", zorder=5)
        top.set(ylabel=f"flow stress{unit}", xlim=(0.0, far))
        top.legend(loc="lower right")
        low.axhline(0.0, color=style.BLACK, linewidth=0.6)
        low.set(xlabel="plastic strain", ylabel=f"residual{unit}")
        figure.align_ylabels()
    return figure
