"""Views of increments, contacts and bodies: methods whose bodies stand above the solver, in `prensa.output`.

`prensa.output.views` says how when a public name of `prensa` is first used; nothing here imports it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, TypedDict, Unpack

from prensa.errors import PrensaError
from prensa.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame
    from pyvista import UnstructuredGrid

Curve = tuple[Array, Array] | Callable[[Array], Array]
"""A further curve of a picture: abscissa and values, or a function of the abscissa."""


class PlotOptions(TypedDict, total=False):
    """Options of `Drawn.plot`."""

    contact: str
    mesh: bool | None
    mirror: Sequence[str]
    range: tuple[float, float] | None
    box: tuple[float, ...] | None
    view: str | tuple[float, float]
    section: str
    size: tuple[float, float] | None
    dpi: float | None
    reference: Mapping[str, Curve] | None
    title: str


class Views(Protocol):
    """What draws results, tabulates them and shows them in notebooks."""

    def plot(self, increment: Drawn, what: str, **options: Unpack[PlotOptions]) -> Figure:
        """See `Drawn.plot`."""

    def grid(self, increment: Drawn) -> UnstructuredGrid:
        """See `Drawn.grid`."""

    def frame(self, state: Tabular) -> DataFrame:
        """See `Tabular.to_frame`."""

    def card(self, title: str, rows: Iterable[tuple[str, str]]) -> str:
        """Rows (what, text) as a small table for a notebook."""


_VIEWS: list[Views] = []


def show_by(views: Views) -> None:
    """Let results show themselves by ``views`` from now on."""
    _VIEWS[:] = [views]


def _views() -> Views:
    if not _VIEWS:
        raise PrensaError("nothing draws yet: import prensa.output.views, or take solve, run and results from prensa")
    return _VIEWS[0]


class Shown:
    """A result with a line for the prompt and a card for notebooks; ``_card`` gives the rows of the card."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self._line()}>"

    def _line(self) -> str:
        """Everything that fits on a line."""
        return ""

    def _card(self) -> list[tuple[str, str]]:
        """Pairs (what, text)."""
        return [(type(self).__name__, self._line())]

    def _repr_html_(self) -> str:
        return _views().card(type(self).__name__, self._card())


class Drawn(Shown):
    """An increment that can be drawn."""

    def plot(self, what: str = "mises", **options: Unpack[PlotOptions]) -> Figure:
        """A picture (a matplotlib figure) of this increment.

        Parameters
        ----------
        what
            A field of the bodies (``mises``, ``plastic_strain``, ``displacement``, ``displacement.x``, ``stress.xx``, …), or
            ``pressure`` for pressure and shear along a contact, in space on the bodies, seen from the side of the tools.
        **options
            Of fields those of `prensa.output.plot.deformed` (``mesh``, ``mirror``, ``range``, ``box``, in space ``view`` and
            ``section``); of ``pressure`` ``title`` and ``contact``, its name where there are several (in space all if it is left
            out), in the plane ``reference`` (see `prensa.output.plot.pressure`), in space those of fields. Of all ``size``
            (width and height in inches) and ``dpi`` (pixels an inch).

        Raises
        ------
        PrensaError
            If there is no such field, contact or option; the message suggests the nearest.

        """
        return _views().plot(self, what, **options)

    def grid(self) -> UnstructuredGrid:
        """The deformed bodies as a `pyvista.UnstructuredGrid` with their nodal fields; needs ``pip install prensa[view]``."""
        return _views().grid(self)


class Tabular(Shown):
    """A result whose arrays make a table."""

    def to_frame(self) -> DataFrame:
        """The values at the nodes as a table of pandas; needs ``pip install prensa[notebook]``."""
        return _views().frame(self)
