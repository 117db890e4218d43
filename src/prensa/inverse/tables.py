"""Measured tables: CSV files with a name and a unit over every column; an empty cell is a value that was not taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from prensa.errors import shown
from prensa.model.names import suggest
from prensa.model.sheets import DataError, read_sheet
from prensa.types import Array

__all__ = ["DataError", "Table", "read_table"]


@dataclass(frozen=True)
class Table:
    """Columns (rows,) by name, with their ``units`` ('' where none is given); cells that are empty are not numbers.

    ``lines`` (rows,): line of each row in the file, for messages; ``notes``: what was made of the file beyond its cells.
    """

    path: str
    columns: dict[str, Array]
    units: dict[str, str]
    lines: Sequence[int] = ()
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Refuse columns of different lengths and tables of nothing."""
        lengths = {name: np.shape(values) for name, values in self.columns.items()}
        if not lengths or len(set(lengths.values())) > 1 or any(len(s) != 1 or not s[0] for s in lengths.values()):
            raise DataError(f"{self.path}: a table needs columns of one length, at least one row; it has {lengths}")
        for name, values in self.columns.items():
            if np.isinf(np.asarray(values, dtype=np.float64)).any():
                raise DataError(f"{self.path}: column {name!r} has infinite values; leave out what was not measured (nan)")

    def column(self, name: str) -> Array:
        """A column by name; raises `DataError`."""
        if name not in self.columns:
            raise DataError(
                f"{self.path}: there is no column {shown(name)}{suggest(str(name), self.columns)}; it has "
                f"{', '.join(self.columns)}"
            )
        return np.asarray(self.columns[name], dtype=np.float64)

    def place(self, row: int) -> str:
        """Where a row stands, as in ``ring.csv:7``."""
        return f"{self.path}:{self.lines[row]}" if row < len(self.lines) else f"{self.path}: row {row + 1}"


def read_table(path: str | Path) -> Table:
    """Read a table whose first row names the columns, as in ``travel [mm],force [kN],bore [mm]``.

    Fields are separated by commas, semicolons or tabulators; with the latter two decimal commas are read. Units may stand in a
    second row instead. Rows that begin with # are comments, empty rows and columns are left out.

    Raises
    ------
    DataError
        For a file that is missing, has no rows, or has something else than numbers.

    """
    path = Path(path)
    sheet = read_sheet(path)
    numbers = np.array(sheet.rows, dtype=np.float64).reshape(len(sheet.rows), len(sheet.names))
    return Table(
        str(path), {n: numbers[:, k] for k, n in enumerate(sheet.names)}, dict(zip(sheet.names, sheet.units)), sheet.lines
    )
