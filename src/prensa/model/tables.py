"""Tables of a description: those over time, and those that it names by file."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from math import isnan
from pathlib import Path
from typing import Any

from prensa.model.sheets import DataError, read_sheet
from prensa.model.units import LENGTH, RATIO, Dimension, factor

TABLE_LIMIT = 1 << 20
MESH_LIMIT = 256 << 20
DRIVEN = ("move", "by", "velocity", "crank", "feed", "push", "control")


def tables_of(owner: Any) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """Path in *owner*, a problem or a step, and rows (time, value) of each table of what drives, holds and loads."""
    for kind in (*DRIVEN, "fixed", "loads", "body_force"):
        for name, entry in getattr(owner, kind, {}).items():
            for key, value in enumerate(entry) if isinstance(entry, tuple) else vars(entry).items() if entry else ():
                # each component of a traction may be a table
                parts = [((key, k), v) for k, v in enumerate(value)] if key == "traction" and value else [((key,), value)]
                yield from (((kind, name, *place), v) for place, v in parts if isinstance(v, tuple) and isinstance(v[0], tuple))


def read_mu_table(path: str, context: Any) -> Any:
    """Read a friction curve from a CSV of two columns, slip κ (length) and μ, as the fields of a `MuTable`.

    Raises
    ------
    ValueError
        As `read_columns`.

    """
    # '0.1 mm' in the place of a coefficient is a text, and would be reported as a missing file.
    if path[:1] in "+-.0123456789" and path and _is_number(path.split()[0]) and not _beside(path, context).is_file():
        raise ValueError(f"{path!r} is not a friction coefficient: it is a plain number, such as 0.1")
    kappa, mu = zip(*read_columns(path, context, "friction table", (("slip", LENGTH), ("mu", RATIO))))
    return {"kappa": list(kappa), "mu": list(mu)}


def read_columns(path: str, context: Any, what: str, columns: Sequence[tuple[str, Dimension]]) -> list[tuple[float, ...]]:
    """Rows of a CSV file that a description names, in the units of the case, one number for each of *columns*.

    Relative paths are the case file's; how cells, decimal commas and comments are written is free (see `read_sheet`). A first
    row of names may state units, ``slip (um), mu``, or a second row may; without any, numbers are in the units of the case.

    Parameters
    ----------
    path, context
        The file as written, and the context of the validation, with the case's folder and units.
    what
        Kind of table, for messages.
    columns
        Name and dimension of each column.

    Raises
    ------
    ValueError
        If the file is missing, is not such columns of numbers in two rows at least, or states other units.

    """
    file = _beside(path, context)
    many = {2: "two"}.get(len(columns), len(columns))
    expected = f"{what} {path!r}: expected {many} columns of finite numbers, {' and '.join(name for name, _ in columns)}"
    try:
        if not file.is_file():
            raise ValueError(f"{what} {path!r}: there is no such file{_instead(file)}")
        if file.stat().st_size > TABLE_LIMIT:
            raise ValueError(f"{what} {path!r} is larger than 1 MiB; is it the right file?")
        sheet = read_sheet(file, named=False)
    except OSError as error:
        raise ValueError(f"{what} {path!r} cannot be read: {error}") from None
    except DataError as error:
        raise ValueError(f"{expected}; {error}") from None
    if len(sheet.names) != len(columns) or len(sheet.rows) < 2:
        raise ValueError(f"{expected}, in at least two rows; it has {len(sheet.names)} in {len(sheet.rows)}")
    for row, line in zip(sheet.rows, sheet.lines):
        if any(isnan(x) for x in row):
            raise ValueError(f"{expected}; {file}:{line}: a cell is empty")
    by = [unit_of_column(unit, what, dimension, context) for unit, (_, dimension) in zip(sheet.units, columns)]
    return [tuple(x * f for x, f in zip(row, by)) for row in sheet.rows]


def unit_of_column(unit: str, what: str, dimension: Dimension, context: Any) -> float:
    """The unit that stands over a column, in the case's; 1 where there is none.

    Raises
    ------
    ValueError
        If it is not a unit of that dimension, or there is no case.

    """
    # '-' over a column of pure numbers is what testing machines write.
    if unit.strip() in ("", "-", "–", "1"):
        return 1.0
    units = context.get("units") if context else None
    if units is None:
        raise ValueError(f"the table states the unit {unit!r}; that belongs in case files, in Python give numbers of the case")
    try:
        return factor(f"1 {unit}", units["length"], units["force"], dimension.exponents)
    except ValueError as error:
        raise ValueError(f"{what}: {unit!r} states no unit of {dimension.name.split(' ', 1)[1]} ({error})") from None


def _beside(path: str, context: Any) -> Path:
    """A file that a description names; relative paths are the case file's."""
    base = Path(context["folder"]) if context and context.get("folder") is not None else Path()
    return base / path


def found_file(path: str, context: Any, what: str) -> str:
    """Absolute path of a file that a description names; relative paths are the case file's.

    Raises
    ------
    ValueError
        If there is no such file, or it is larger than any mesh.

    """
    file = _beside(path, context)
    try:
        if not file.is_file():
            raise ValueError(f"{what} {path!r}: there is no such file{_instead(file, file.suffix)}")
        if file.stat().st_size > MESH_LIMIT:
            raise ValueError(f"{what} {path!r} is larger than 256 MiB; is it the right file?")
    except OSError as error:
        raise ValueError(f"{what} {path!r} cannot be read: {error}") from None
    return str(file.resolve())


def found_run(run: str, context: Any) -> str:
    """Absolute path of a folder of results that a description names; relative paths are the case file's.

    Raises
    ------
    ValueError
        If it is no folder or holds no checkpoint.

    """
    folder = _beside(run, context)
    try:
        if not folder.is_dir():
            raise ValueError(
                f"there is no folder {run!r}; run the earlier case first (paths are relative to the case file)"
            )
        if not (folder / "checkpoint.h5").is_file():
            raise ValueError(f"the folder {run!r} holds no checkpoint.h5; is it the folder of a run?")
    except OSError as error:
        raise ValueError(f"{run!r} cannot be read: {error}") from None
    return str(folder.resolve())


def digest_of(path: str) -> str:
    """SHA-256 of a file (hexadecimal)."""
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ValueError(f"{path!r} cannot be read: {error}") from None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _instead(file: Path, suffix: str = ".csv") -> str:
    """What the folder holds instead; a relative path is looked for beside the case file."""
    if not file.parent.is_dir():
        return f" ({file.parent} is no folder)"
    names = sorted(f.name for f in file.parent.glob(f"*{suffix}"))[:5]
    return f"; the folder has {', '.join(names)}" if names else "; paths are relative to the case file"
