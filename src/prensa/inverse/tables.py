"""Measured tables: CSV files with a name and a unit over every column; an empty cell is a value that was not taken."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError
from prensa.model.names import suggest

Array = NDArray[np.float64]

LONGEST = 100_000  # characters of a row
_HEADER = re.compile(r"\s*(?P<name>[^\[\(]*?)\s*(?:[\[\(]\s*(?P<unit>[^\]\)]*?)\s*[\]\)])?\s*$")


class DataError(PrensaError):
    """A measured table that cannot be used: says where and what to do."""


@dataclass(frozen=True)
class Table:
    """Columns (rows,) by name, with their ``units`` ('' where none is given); cells that are empty are not numbers."""

    path: str
    columns: dict[str, Array]
    units: dict[str, str]

    def column(self, name: str) -> Array:
        """A column by name; raises `DataError`."""
        if name not in self.columns:
            raise DataError(
                f"{self.path}: there is no column {name!r}{suggest(name, self.columns)}; it has {', '.join(self.columns)}"
            )
        return self.columns[name]


def read_table(path: str | Path) -> Table:
    """Read a table whose first row names the columns, as in ``travel [mm],force [kN],bore [mm]``.

    Fields are separated by commas, semicolons or tabulators; rows that begin with # are comments.

    Raises
    ------
    DataError
        For a file that is missing, has no rows, or has something else than numbers.

    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read ({error})") from None
    lines = [
        (k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(lines) < 2:
        raise DataError(f"{path}: there are no rows; the first names the columns, as in 'travel [mm],force [kN]'")
    longest = max(lines, key=lambda line: len(line[1]))
    if len(longest[1]) > LONGEST:
        raise DataError(f"{path}:{longest[0]}: a row of {len(longest[1])} characters is none of a table")
    separator = max(",;\t", key=lines[0][1].count)
    names, units = _header(path, next(csv.reader([lines[0][1]], delimiter=separator)))
    rows = []
    for number, line in lines[1:]:
        cells = next(csv.reader([line], delimiter=separator))
        if len(cells) != len(names):
            raise DataError(
                f"{path}:{number}: {len(cells)} cells, but {len(names)} columns; leave a cell empty where nothing was taken"
            )
        rows.append([_number(path, number, name, cell) for name, cell in zip(names, cells)])
    values = np.array(rows, dtype=np.float64)
    return Table(str(path), {n: values[:, k] for k, n in enumerate(names)}, dict(zip(names, units)))


def _header(path: Path, cells: list[str]) -> tuple[list[str], list[str]]:
    found = [_HEADER.match(cell) for cell in cells]
    names = [m["name"] if m else cell for m, cell in zip(found, cells)]
    for name in names:
        if not name or names.count(name) > 1 or _is_number(name):
            raise DataError(
                f"{path}: the first row has to name every column once, as in 'travel [mm],force [kN]'; {name!r} does not"
            )
    return names, [(m["unit"] or "") if m else "" for m in found]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _number(path: Path, row: int, name: str, cell: str) -> float:
    if not cell.strip():
        return float("nan")
    try:
        value = float(cell)
    except ValueError:
        raise DataError(f"{path}:{row}: {name} is {cell.strip()!r}; a number is expected, or nothing") from None
    if not np.isfinite(value):
        raise DataError(f"{path}:{row}: {name} is {cell.strip()!r}; a number is expected, or nothing")
    return value
