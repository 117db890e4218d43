"""What increments, contacts and bodies show of themselves: methods whose bodies stand above the solver, in `prensa.output`.

`prensa.output.views` fills the table in when a public name of `prensa` is first used; nothing here imports it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from prensa.errors import PrensaError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

VIEWS: dict[str, Callable[..., Any]] = {}


def view(name: str, *arguments: Any, **named: Any) -> Any:
    """What the view *name* makes of its arguments."""
    if name not in VIEWS:
        raise PrensaError("nothing draws yet: import prensa.output.views, or take solve, run and results from prensa")
    return VIEWS[name](*arguments, **named)


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
        return str(view("card", type(self).__name__, self._card()))


class Drawn(Shown):
    """An increment that can be drawn."""

    def plot(self, what: str = "mises", **options: Any) -> Figure:
        """A picture (a matplotlib figure) of this increment.

        Parameters
        ----------
        what
            A field of the bodies (``mises``, ``plastic_strain``, ``displacement``, ``displacement.x``, ``stress.xx``, …), or
            ``pressure`` for pressure and shear along a contact.
        **options
            Of fields those of `prensa.output.plot.deformed` (``mesh``, ``mirror``, ``range``); of ``pressure`` those of
            `prensa.output.plot.pressure` (``reference``, ``title``) and ``contact``, its name where there are several.

        Raises
        ------
        PrensaError
            If there is no such field or contact; the message suggests the nearest.

        """
        figure: Figure = view("plot", self, what, **options)
        return figure

    def grid(self) -> Any:
        """The deformed bodies as a `pyvista.UnstructuredGrid` with their nodal fields; needs ``pip install prensa[view]``."""
        return view("grid", self)


class Tabular(Shown):
    """A result whose arrays make a table."""

    def to_frame(self) -> DataFrame:
        """The values at the nodes as a table of pandas; needs ``pip install prensa[notebook]``."""
        frame: DataFrame = view("frame", self)
        return frame
