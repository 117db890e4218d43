"""Tables of numbers in text files: what spreadsheets, testing machines and CAD programs export, read in one way.

Commas, semicolons or tabulators between cells, decimal commas, marks of the encoding at the beginning, units in brackets or in
a row of their own, comments, empty rows and columns at the end. Measured tables, friction over slip, flow curves and profiles
are read here.
"""

from __future__ import annotations

import codecs
import csv
import re
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

from prensa.errors import PrensaError, shown

_HEADER = re.compile(r"\s*(?P<name>[^\[\(]*?)\s*(?:[\[\(]\s*(?P<unit>[^\]\)]*?)\s*[\]\)])?\s*$")
_POINT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[-+]?(\d+,?\d*|,\d+)([eEdD][-+]?\d+)?", re.ASCII)
_SEPARATOR = re.compile(r"sep=(.)\s*", re.IGNORECASE)
MOST_BYTES = 64 << 20  # of a table: a million rows
LONGEST = 100_000  # characters of a row, more than which is not a row of numbers
MOST_COLUMNS = 1000  # of a table
EXAMPLE = "'travel [mm],force [kN]'"


class DataError(PrensaError, ValueError):
    """A table that cannot be used: says where and what to do."""


class Sheet(NamedTuple):
    """``rows`` of numbers (nan: an empty cell) at their ``lines``; ``names`` and ``units`` of columns, '' for none."""

    names: list[str]
    units: list[str]
    rows: list[list[float]]
    lines: list[int]


def read_sheet(path: Path, named: bool = True, ragged: bool = False) -> Sheet:
    """The table of a file; a first row names the columns, as in ``travel [mm],force [kN]``, and units may stand in a second row.

    ``named`` False: that row may be missing. ``ragged``: rows may be shorter than the longest; their last cells are empty.

    Raises
    ------
    DataError
        For a file that is missing, has no rows, or has something else than numbers.

    """
    lines = [
        (k, line)
        for k, line in enumerate(_text(path).splitlines(), 1)
        if line.strip(" \t;,\ufeff") and not line.lstrip().startswith("#")
    ]
    separator = ""
    if lines and (match := _SEPARATOR.fullmatch(lines[0][1])):
        separator, lines = match[1], lines[1:]
    if len(lines) < (2 if named else 1):
        raise DataError(f"{path}: there are no rows" + f"; the first names the columns, as in {EXAMPLE}" * named)
    if not separator and not any(s in line for _, line in lines for s in "\t;,") and (at := _spaced(lines)):
        raise DataError(
            f"{path}:{at}: its numbers are separated by spaces; separate columns by commas, semicolons or tabulators, "
            f"as in {EXAMPLE}"
        )
    longest = max(lines, key=lambda line: len(line[1]))
    if len(longest[1]) > LONGEST:
        raise DataError(f"{path}:{longest[0]}: a row of {len(longest[1])} characters cannot be part of a table")
    cells = [_Row(k, s, _cells(path, k, line, s)) for (k, line), s in zip(lines, _separators(separator, lines))]
    if named or _names_columns(cells[0]):
        names, units = _header(path, cells[0].cells)
        cells = cells[1:]
        if not any(units) and len(cells) > 1 and _are_units(cells[0].cells, len(names)):
            units, cells = [c.strip().strip("[]()") for c in cells[0].cells[: len(names)]], cells[1:]
    else:
        names, units = [], []
    # Columns without a name in a row of names are read where rows may differ: of arcs in tables of points.
    missing = max(max((_filled(row.cells) for row in cells), default=0) - len(names), 0) if ragged or not names else 0
    names, units = [*names, *[""] * missing], [*units, *[""] * missing]
    return Sheet(names, units, _numbers(path, names, cells, ragged), [row.line for row in cells])


class _Row(NamedTuple):
    """``cells`` of a ``line`` of the file, and the ``separator`` between them."""

    line: int
    separator: str
    cells: list[str]


def _separators(stated: str, lines: list[tuple[int, str]]) -> list[str]:
    """Separator of each line: the one of the first, or semicolons where names with commas stand over rows with semicolons."""
    first = stated or next((s for s in "\t;" if s in lines[0][1]), ",")
    return [first if stated or first != "," else next((s for s in "\t;" if s in line), ",") for _, line in lines]


def _names_columns(row: _Row) -> bool:
    """Whether a first row has names: its first cell is not a number."""
    first = row.cells[0].strip() if row.cells else ""
    return not (_POINT.fullmatch(first) or (row.separator != "," and _COMMA.fullmatch(first)))


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
    raise DataError(f"{path}: this is not text; save the table as CSV in UTF-8")


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    try:
        row = next(csv.reader([line], delimiter=separator))
    except (csv.Error, StopIteration, TypeError, ValueError) as error:
        raise DataError(f"{path}:{number}: this is not a row of cells ({error})") from None
    return row


def _filled(cells: list[str]) -> int:
    """Number of the last cell that is not empty: spreadsheets write empty columns at the end."""
    return max((k for k, cell in enumerate(cells, 1) if cell.strip()), default=0)


def _header(path: Path, cells: list[str]) -> tuple[list[str], list[str]]:
    cells = cells[: _filled(cells)]
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


def _numbers(path: Path, names: list[str], rows: list[_Row], ragged: bool) -> list[list[float]]:
    """Values, nan for empty cells; decimal commas where the separator allows them and no decimal point contradicts."""
    comma = any(row.separator != "," and "," in c for row in rows for c in row.cells)
    mixed = comma and any(_POINT.fullmatch(c.strip()) and "." in c for row in rows for c in row.cells)
    out = [[nan] * len(names) for _ in rows]
    for i, (number, separator, row) in enumerate(rows):
        if (len(row) < len(names) and not ragged) or any(cell.strip() for cell in row[len(names) :]):
            raise DataError(
                f"{path}:{number}: {len(row)} cells, but {len(names)} columns; leave a cell empty where nothing was measured"
                + ("" if separator != "," else "; if these are decimal commas, separate the columns by semicolons")
            )
        for j, cell in enumerate(row[: len(names)]):
            text, name = cell.strip(), names[j] or f"column {j + 1}"
            if not text:
                continue
            if mixed and "," in text:
                raise DataError(
                    f"{path}:{number}: {name} is {shown(text)}, but other numbers have decimal points; write all alike, "
                    "without separators of thousands"
                )
            if not (_COMMA if comma and separator != "," else _POINT).fullmatch(text) and not _POINT.fullmatch(text):
                raise DataError(
                    f"{path}:{number}: {name} is {shown(text)}; a number is expected, or nothing where none was measured"
                )
            out[i][j] = float(text.replace(",", ".").replace("d", "e").replace("D", "e"))
            if not isfinite(out[i][j]):
                raise DataError(f"{path}:{number}: {name} is {shown(text)}, too large a number")
    return out
