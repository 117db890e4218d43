"""Views of results in Python and notebooks: pictures, tables, grids, cards.

Imported when a public name of `prensa` is first used; everything heavy is imported by the view that needs it.
"""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from prensa.errors import PrensaError
from prensa.model.names import suggest
from prensa.result.increment import STATUS, BodyState, ContactState, Increment, sliding
from prensa.result.views import Drawn, PlotOptions, Tabular, show_by

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame
    from pyvista import UnstructuredGrid

_STYLE = "border-collapse:collapse;font-variant-numeric:tabular-nums"


class Pictures:
    """The views of results (see `prensa.result.views.Views`)."""

    def plot(self, increment: Drawn, what: str, **options: Unpack[PlotOptions]) -> Figure:
        """See `prensa.result.views.Drawn.plot`."""
        from prensa.output import plot as pictures

        assert isinstance(increment, Increment)
        problem, others = increment.problem, dict(options)
        solid = problem.space == "solid"
        _refuse_others(what, others, solid)
        contact = str(others.pop("contact", ""))
        if what == "pressure":
            known = increment.contacts
            if solid and not contact:
                return pictures.pressures_in_space(increment, problem, **others)  # type: ignore[arg-type]
            if not contact and len(known) == 1:
                contact = next(iter(known))
            if contact not in known:
                message = f"unknown contact {contact!r}{suggest(contact, known)}" if contact else "say which contact"
                raise PrensaError(f"{message}; contacts: {', '.join(map(repr, known)) or 'none'}")
            if solid:
                return pictures.pressures_in_space(increment, problem, contact, **others)  # type: ignore[arg-type]
            named: dict[str, Any] = {"title": pictures.title(increment, contact)} | others
            return pictures.pressure(known[contact], problem, **named)
        fields: dict[str, Any] = others
        return pictures.deformed(increment, problem, what, **fields)

    def grid(self, increment: Drawn) -> UnstructuredGrid:
        """See `prensa.result.views.Drawn.grid`."""
        pyvista = _needed("pyvista", "view")
        from prensa.output.vtk import as_mesh

        assert isinstance(increment, Increment)
        made: UnstructuredGrid = pyvista.from_meshio(as_mesh(increment))
        return made

    def frame(self, state: Tabular) -> DataFrame:
        """The arrays of a contact or a body, one row a node."""
        assert isinstance(state, ContactState | BodyState)
        return table(_contact_columns(state) if isinstance(state, ContactState) else _body_columns(state), "node")

    def card(self, title: str, rows: Iterable[tuple[str, str]]) -> str:
        """Rows (what, text) as a small table for a notebook."""
        cell = '<td style="text-align:left;padding:.1rem .8rem .1rem 0">{}</td>'
        body = "".join(f"<tr>{cell.format(f'<b>{html.escape(a)}</b>')}{cell.format(html.escape(b))}</tr>" for a, b in rows)
        return f'<table style="{_STYLE}"><caption style="text-align:left"><b>{html.escape(title)}</b></caption>{body}</table>'


def table(columns: Mapping[str, Any], index: str = "") -> DataFrame:
    """Columns as a table of pandas, with one of them as its index."""
    made: DataFrame = _needed("pandas", "notebook").DataFrame(dict(columns))
    return made.set_index(index) if index else made


# ------------------------------------------------------------------------------------------------------------- details
_OF_ALL, _OF_FIELDS, _OF_SPACE = ("size", "dpi"), ("mesh", "mirror", "range", "box"), ("view", "section")


def _refuse_others(what: str, options: Iterable[str], solid: bool) -> None:
    """Raise PrensaError for options that a picture does not have."""
    of_pressure = ("contact", "title") if solid else ("contact", "title", "reference")
    known = _OF_ALL + (_OF_SPACE if solid else ())
    known += (of_pressure if what == "pressure" else ()) + (_OF_FIELDS if what != "pressure" or solid else ())
    for name in options:
        if name in known:
            continue
        if name in of_pressure:
            raise PrensaError(f"{name!r} belongs to 'pressure', and {what!r} is a field of bodies")
        if name in _OF_SPACE:
            raise PrensaError(f"{name!r} belongs to pictures of 'space: solid', and this is a problem of the plane; leave it out")
        raise PrensaError(f"a picture of {what!r} has no option {name!r}{suggest(name, known)}; its options: {', '.join(known)}")


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
            "pressure_from_stress": c.pressure_from_stress, "error": c.error, **sliding(c)}  # fmt: skip


def _body_columns(b: BodyState) -> dict[str, Any]:
    axes = "xyz"[: b.x.shape[1]]
    out = {"node": np.arange(len(b.x))} | dict(zip(axes, b.x.T)) | {f"u{a}": v for a, v in zip(axes, b.displacement.T)}
    out |= {"mises": b.mises, "plastic_strain": b.plastic_strain}
    out |= {f"damage.{name}": v for name, v in b.damage.items()}
    out |= {"mean_stress": b.mean_stress, "triaxiality": b.triaxiality, "lode": b.lode}
    out |= {} if b.strain_rate is None else {"strain_rate": b.strain_rate}
    out |= {f"stress.{c}": v for c, v in zip(("xx", "yy", "zz", "xy"), b.stress.T)}
    return out if b.thickness is None else out | {"thickness": b.thickness}


show_by(Pictures())
