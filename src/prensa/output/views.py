"""What results show of themselves in Python and notebooks: pictures, tables, grids, cards.

Imported when a public name of `prensa` is first used; everything heavy is imported by the view that needs it.
"""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from prensa.errors import PrensaError
from prensa.model.names import suggest
from prensa.result.increment import STATUS, BodyState, ContactState, Increment
from prensa.result.views import VIEWS

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

_STYLE = "border-collapse:collapse;font-variant-numeric:tabular-nums"


def plot(increment: Increment, what: str = "mises", contact: str = "", **options: Any) -> Figure:
    """See `prensa.result.views.Drawn.plot`."""
    from prensa.output import plot as pictures

    problem = increment.problem
    if what == "pressure":
        known = increment.contacts
        if not contact and len(known) == 1:
            contact = next(iter(known))
        if contact not in known:
            message = f"unknown contact {contact!r}{suggest(contact, known)}" if contact else "say which contact"
            raise PrensaError(f"{message}; contacts: {', '.join(map(repr, known)) or 'none'}")
        return pictures.pressure(known[contact], problem, **{"title": pictures.title(increment, contact)} | options)
    if contact:
        raise PrensaError(f"'contact' belongs to 'pressure', and {what!r} is a field of bodies")
    return pictures.deformed(increment, problem, what, **options)


def grid(increment: Increment) -> Any:
    """See `prensa.result.views.Drawn.grid`."""
    pyvista = _needed("pyvista", "view")
    from prensa.output.vtk import as_mesh

    return pyvista.from_meshio(as_mesh(increment))


def frame(state: Any) -> DataFrame:
    """The arrays of a contact or a body, one row a node."""
    return table(_contact_columns(state) if isinstance(state, ContactState) else _body_columns(state), "node")


def table(columns: Mapping[str, Any], index: str = "") -> DataFrame:
    """Columns as a table of pandas, with one of them as its index."""
    made: DataFrame = _needed("pandas", "notebook").DataFrame(dict(columns))
    return made.set_index(index) if index else made


def card(title: str, rows: Iterable[tuple[str, str]]) -> str:
    """Rows (what, text) as a small table for a notebook."""
    cell = '<td style="text-align:left;padding:.1rem .8rem .1rem 0">{}</td>'
    body = "".join(f"<tr>{cell.format(f'<b>{html.escape(a)}</b>')}{cell.format(html.escape(b))}</tr>" for a, b in rows)
    return f'<table style="{_STYLE}"><caption style="text-align:left"><b>{html.escape(title)}</b></caption>{body}</table>'


# ------------------------------------------------------------------------------------------------------------- details
def _needed(module: str, extra: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError:
        raise PrensaError(f"this needs {module}: pip install prensa[{extra}]") from None


def _contact_columns(c: ContactState) -> dict[str, Any]:
    words = np.array(STATUS)[c.status]
    places = {f"{n}{a}": v for n, p in (("", c.x),) for a, v in zip("xyz", p.T)} | dict(zip(("X", "Y", "Z"), c.X.T))
    flat = {"shear": c.shear} if c.shear.ndim == 1 else dict(zip(("shear1", "shear2"), c.shear.T))
    return {"node": c.node, **places, "gap": c.gap, "pressure": c.pressure, **flat, "slip": c.slip, "status": words,
            "pressure_from_stress": c.pressure_from_stress, "error": c.error}  # fmt: skip


def _body_columns(b: BodyState) -> dict[str, Any]:
    axes = "xyz"[: b.x.shape[1]]
    out = {"node": np.arange(len(b.x))} | dict(zip(axes, b.x.T)) | {f"u{a}": v for a, v in zip(axes, b.displacement.T)}
    out |= {"mises": b.mises, "plastic_strain": b.plastic_strain}
    out |= {f"stress.{c}": v for c, v in zip(("xx", "yy", "zz", "xy"), b.stress.T)}
    return out if b.thickness is None else out | {"thickness": b.thickness}


VIEWS.update(plot=plot, grid=grid, frame=frame, card=card)
