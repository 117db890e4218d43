"""Measured tables: CSV files with a name and a unit over every column; an empty cell is a value that was not taken.

What spreadsheets and testing machines export is read as it is: commas, semicolons or tabulators, decimal commas, marks of the
encoding at the beginning, units in a row of their own, empty rows and columns at the end.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from prensa.errors import PrensaError, shown
from prensa.model.names import suggest
from prensa.types import Array

_HEADER = re.compile(r"\s*(?P<name>[^\[\(]*?)\s*(?:[\[\(]\s*(?P<unit>[^\]\)]*?)\s*[\]\)])?\s*$")
_POINT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[-+]?(\d+,?\d*|,\d+)([eEdD][-+]?\d+)?", re.ASCII)
_SEPARATOR = re.compile(r"sep=(.)\s*", re.IGNORECASE)
MOST_BYTES = 64 << 20
LONGEST = 100_000  # characters of a row
MOST_COLUMNS = 1000
EXAMPLE = "'travel [mm],force [kN]'"


class DataError(PrensaError):
    """A measured table that cannot be used: says where and what to do."""


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
                raise DataError(f"{self.path}: column {name!r} has infinite values; leave out what was not taken (nan)")

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
    lines = [
        (k, line)
        for k, line in enumerate(_text(path).splitlines(), 1)
        if line.strip(" \t;,\ufeff") and not line.lstrip().startswith("#")
    ]
    separator = ""
    if lines and (match := _SEPARATOR.fullmatch(lines[0][1])):
        separator, lines = match[1], lines[1:]
    if len(lines) < 2:
        raise DataError(f"{path}: there are no rows; the first names the columns, as in {EXAMPLE}")
    if not separator and not any(s in line for _, line in lines for s in "\t;,") and (at := _spaced(lines)):
        raise DataError(
            f"{path}:{at}: its numbers are separated by spaces; separate columns by commas, semicolons or tabulators, "
            f"as in {EXAMPLE}"
        )
    longest = max(lines, key=lambda line: len(line[1]))
    if len(longest[1]) > LONGEST:
        raise DataError(f"{path}:{longest[0]}: a row of {len(longest[1])} characters is none of a table")
    separator = separator or next((s for s in "\t;" if s in lines[0][1]), ",")
    cells = [(k, _cells(path, k, line, separator)) for k, line in lines]
    names, units = _header(path, cells[0][1])
    cells = cells[1:]
    if not any(units) and len(cells) > 1 and _are_units(cells[0][1], len(names)):
        units, cells = [c.strip().strip("[]()") for c in cells[0][1][: len(names)]], cells[1:]
    numbers = _numbers(path, separator, names, cells)
    return Table(
        str(path), {n: numbers[:, k] for k, n in enumerate(names)}, dict(zip(names, units)), [k for k, _ in cells]
    )


def _spaced(lines: list[tuple[int, str]]) -> int:
    """Number of the first line with several numbers and nothing but spaces between them; 0 if there is none."""
    rows = ((k, line.split()) for k, line in lines)
    return next((k for k, cells in rows if len(cells) > 1 and all(_POINT.fullmatch(c) for c in cells)), 0)


def _text(path: Path) -> str:
    """Text of a file in UTF-8, UTF-16 with its mark, or what Windows writes in Western Europe."""
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise DataError(f"{path}: {size >> 20} MiB are too much for a table; take some hundred rows")
        raw = path.read_bytes()
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if raw.startswith(b"PK"):
        raise DataError(f"{path}: this is a workbook; save its sheet as CSV")
    wide = raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    # UTF-8 first: cp1252 decodes nearly any bytes, and would make other letters of them.
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise DataError(f"{path}: this is no text; save the table as CSV in UTF-8")


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    try:
        row = next(csv.reader([line], delimiter=separator))
    except (csv.Error, StopIteration, TypeError, ValueError) as error:
        raise DataError(f"{path}:{number}: this is no row of cells ({error})") from None
    return row


def _header(path: Path, cells: list[str]) -> tuple[list[str], list[str]]:
    while cells and not cells[-1].strip():
        cells.pop()  # spreadsheets write empty columns
    if len(cells) > MOST_COLUMNS:
        raise DataError(f"{path}: the first row has {len(cells)} columns; is this a table of readings?")
    found = [_HEADER.match(cell) for cell in cells]
    names = [m["name"] if m else cell.strip() for m, cell in zip(found, cells)]
    for name in names:
        if not name or names.count(name) > 1 or _POINT.fullmatch(name) or _COMMA.fullmatch(name):
            raise DataError(
                f"{path}: the first row has to name every column once, as in {EXAMPLE}; {shown(name)} does not"
            )
    return names, [(m["unit"] or "") if m else "" for m in found]


def _are_units(cells: list[str], count: int) -> bool:
    """Whether a row beneath the names has units: words, no numbers."""
    return len(cells) >= count and not any(_POINT.fullmatch(c.strip()) or _COMMA.fullmatch(c.strip()) for c in cells)


def _numbers(path: Path, separator: str, names: list[str], rows: list[tuple[int, list[str]]]) -> Array:
    """Values (rows, columns); decimal commas where the separator allows them and no decimal point contradicts."""
    comma = separator != "," and any("," in c for _, row in rows for c in row)
    mixed = comma and any(_POINT.fullmatch(c.strip()) and "." in c for _, row in rows for c in row)
    out = np.full((len(rows), len(names)), np.nan)
    for i, (number, row) in enumerate(rows):
        if len(row) < len(names) or any(cell.strip() for cell in row[len(names) :]):
            raise DataError(
                f"{path}:{number}: {len(row)} cells, but {len(names)} columns; leave a cell empty where nothing was taken"
                + ("" if separator != "," else "; if these are decimal commas, separate the columns by semicolons")
            )
        for j, cell in enumerate(row[: len(names)]):
            text = cell.strip()
            if not text:
                continue
            if mixed and "," in text:
                raise DataError(
                    f"{path}:{number}: {names[j]} is {shown(text)}, but other numbers have decimal points; write all alike, "
                    "without separators of thousands"
                )
            if not (_COMMA if comma else _POINT).fullmatch(text) and not _POINT.fullmatch(text):
                raise DataError(
                    f"{path}:{number}: {names[j]} is {shown(text)}; a number is expected, or nothing where none was taken"
                )
            out[i, j] = float(text.replace(",", ".").replace("d", "e").replace("D", "e"))
            if not np.isfinite(out[i, j]):
                raise DataError(f"{path}:{number}: {names[j]} is {shown(text)}, too large a number")
    return out
