"""Tables of a run: ``history.csv``, ``convergence.csv`` and ``contact/<surface>-<tool>/NNNN.csv``.

Numbers are written with the fewest digits that read back to the same bits. Every row goes to the operating system when it
is complete, so that a run that stops at any moment leaves tables that open; `files.flush` brings them to the disk.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError, take_path
from prensa.measures.columns import ENERGIES as ENERGIES
from prensa.measures.columns import columns as columns_of
from prensa.measures.columns import energies_of as energies_of
from prensa.measures.units import length_unit, pressure_unit
from prensa.model.problem import Problem
from prensa.output.files import TEMPORARY, Contents, file_name, numbered, replacing
from prensa.result.increment import SLIDING_FIELDS, STATUS, ContactState, Increment, sliding

HISTORY = "history.csv"
CONVERGENCE = "convergence.csv"
CONTACT_FOLDER = "contact"
POINTS_SUFFIX = ".points.csv"
CONTACT_COLUMNS = (
    "node", "x", "y", "gap", "pressure", "shear", "slip", "status", "pressure_from_stress", "pressure_smoothed", "error",
    "X", "Y", "weight", "force_x", "force_y", "speed",
)  # fmt: skip
SPATIAL_CONTACT_COLUMNS = (*CONTACT_COLUMNS, "z", "Z", "force_z")
"""In space, where points are the nodes: shear is the size of the traction along the tool."""
POINT_COLUMNS = ("x", "y", "gap", "pressure", "shear", "slip", "status", "weight", "X", "Y")
CONVERGENCE_COLUMNS = ("increment", "iteration", "residual", "changes")

_TEXT_COLUMNS = {"step", "status"}
_INTEGERS = {"increment", "iterations", "cutbacks", "krylov", "remeshings", "iteration", "changes", "node"}


# ---------------------------------------------------------------------------------------------------- history of a run
def history_columns(problem: Problem) -> list[str]:
    """Names of the columns of ``history.csv``, in order: they follow from the description alone."""
    return list(columns_of(problem))


def history_row(problem: Problem, increment: Increment) -> list[Any]:
    """Values of one row of ``history.csv``, in the order of `history_columns`."""
    return [column.value(increment) for column in columns_of(problem).values()]


class History:
    """Writer of ``history.csv`` and ``convergence.csv`` in *directory*.

    Parameters
    ----------
    directory, problem
        Where to write, and what the columns follow from.
    keep
        None starts new tables; a number continues the tables found, without the rows of later increments.

    Raises
    ------
    PrensaError
        If the table to be continued has other columns.

    """

    def __init__(self, directory: Path, problem: Problem, keep: int | None = None) -> None:
        self._problem = problem
        self._history = Table(directory / HISTORY, history_columns(problem), keep)
        try:
            self._convergence = Table(directory / CONVERGENCE, CONVERGENCE_COLUMNS, keep)
        except BaseException:
            self._history.close()
            raise

    def append(self, increment: Increment) -> None:
        """Write the row of *increment* and push it to the operating system."""
        cost = increment.statistics
        # what the factors at hand improved after the last iteration has a row of its own
        finished = (cost.residual,) if cost.residuals and cost.residual < cost.residuals[-1] else ()
        for i, residual in enumerate(cost.residuals + finished):
            changes = cost.changes[i] if i < len(cost.changes) else 0
            self._convergence.append((increment.number, i + 1, residual, changes))
        self._history.append(history_row(self._problem, increment))

    def close(self) -> None:
        """Close the files; nothing is lost without it."""
        self._history.close()
        self._convergence.close()


class Table:
    """CSV file that grows by complete rows; *keep* as in `History` (the table must have a column ``increment``)."""

    def __init__(self, path: Path, columns: Sequence[str], keep: int | None = None) -> None:
        kept = [] if keep is None else _rows_until(path, list(columns), keep)
        with replacing(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([list(columns), *kept])
        self._file: TextIO = open(path, "a", encoding="utf-8", newline="")  # noqa: SIM115  (open as long as the run)

    def append(self, values: Iterable[Any]) -> None:
        """Write one row and flush it."""
        csv.writer(self._file, lineterminator="\n").writerow([_text(v) for v in values])
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def read_history(directory: str | Path) -> dict[str, NDArray[Any]]:
    """Columns of ``history.csv`` by name: ``step`` as text, counters as integers, everything else as floats.

    Raises
    ------
    PrensaError
        If there is no such file in *directory*.

    """
    return _read(take_path("read_history", directory) / HISTORY)


def read_convergence(directory: str | Path) -> dict[str, NDArray[Any]]:
    """Columns of ``convergence.csv``: relative residual and status changes of each iteration of each increment."""
    return _read(take_path("read_convergence", directory) / CONVERGENCE)


def refuse_lost_rows(directory: Path, number: int, time: float) -> None:
    """Refuse tables that do not hold every increment up to *number*, which ended at *time*: the checkpoint's.

    Raises
    ------
    PrensaError
        If rows are missing, as after a power cut or a copy that was not whole, or belong to another run.

    """
    table, cost = read_history(directory), read_convergence(directory)
    rows = table["increment"] <= number
    known = table["increment"][rows]
    last = int(known[-1]) if len(known) else 0
    where = f"the checkpoint stands after increment {number}, time {time:.6g}"
    if not np.array_equal(known, np.arange(1, number + 1)):
        gap = next((k for k in range(1, number + 1) if k not in set(known.tolist())), last)
        message = f"{where}, and increment {gap} is missing here: rows were lost or doubled; run the case again"
        raise PrensaError(f"{directory / HISTORY}: {message}")
    if number and table["time"][rows][-1] != time:
        message = f"{where}, and here that increment ends at {table['time'][rows][-1]:.6g}: they are of two runs"
        raise PrensaError(f"{directory / HISTORY}: {message}; run the case again")
    if number and number not in cost["increment"]:
        message = f"{where}, and its iterations are missing here: rows were lost; run the case again"
        raise PrensaError(f"{directory / CONVERGENCE}: {message}")


# ------------------------------------------------------------------------------------------------------------ contacts
def write_contact(directory: Path, name: str, number: int, contact: ContactState) -> Path:
    """Write ``contact/<name>/NNNN.csv``: one row per contact node, in order along the surface.

    Where the integration points are not the nodes, also ``NNNN.points.csv``, one row per point.
    """
    folder = directory / CONTACT_FOLDER / file_name(name)
    path = folder / f"{number:04d}.csv"
    c, q = contact, contact.points
    words = [[STATUS[s] for s in status] for status in (c.status, q.status)]
    third = () if c.x.shape[1] == 2 else (c.x[:, 2], c.X[:, 2], c.force[:, 2])
    _write(path, [*(SPATIAL_CONTACT_COLUMNS if third else CONTACT_COLUMNS), *sliding(c)], (
        c.node, c.x[:, 0], c.x[:, 1], c.gap, c.pressure, c.shear, c.slip, words[0], c.pressure_from_stress,
        c.pressure_smoothed, c.error, c.X[:, 0], c.X[:, 1], c.weight, c.force[:, 0], c.force[:, 1],
        np.full(len(c.x), np.nan) if c.speed is None else c.speed, *third, *sliding(c).values(),
    ))  # fmt: skip
    if not np.array_equal(q.X, c.X):
        _write(of_points(path), [*POINT_COLUMNS, *sliding(q)], (
            q.x[:, 0], q.x[:, 1], q.gap, q.pressure, q.shear, q.slip, words[1], q.weight, q.X[:, 0], q.X[:, 1],
            *sliding(q).values(),
        ))  # fmt: skip
    return path


def of_points(path: Path) -> Path:
    """The table of the integration points that may be beside a contact table."""
    return path.with_name(path.stem + POINTS_SUFFIX)


def _write(path: Path, names: Sequence[str], columns: Iterable[Iterable[Any]]) -> None:
    with replacing(path, durable=False) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([_text(v) for v in row] for row in zip(*columns))


def read_contact(path: str | Path) -> dict[str, NDArray[Any]]:
    """Columns of a contact table by name; ``status`` holds the words open, stick and slip."""
    return _read(take_path("read_contact", path))


def read_table(path: str | Path) -> dict[str, NDArray[Any]]:
    """Columns of any table of a run by name."""
    return _read(Path(path))


def forget_contacts_after(directory: Path, number: int) -> None:
    """Remove the contact tables of increments later than *number*; other files there are left alone."""
    for folder in sorted((directory / CONTACT_FOLDER).glob("*/")):
        for suffix, columns in ((".csv", CONTACT_COLUMNS), (POINTS_SUFFIX, POINT_COLUMNS)):
            for n, path in numbered(folder, suffix):
                if n > number and path.read_bytes().startswith(",".join(columns).encode()):
                    path.unlink()
            for n, path in numbered(folder, suffix + TEMPORARY):  # left by a run that was killed
                if n > number:
                    path.unlink()
        if not any(folder.iterdir()):
            folder.rmdir()


def units_of(problem: Problem) -> dict[str, dict[str, str]]:
    """Units of the columns of ``history.csv`` and of the tables of contacts; of plain numbers and words nothing."""
    length, pressure = length_unit(problem), pressure_unit(problem)
    lengths = dict.fromkeys(("x", "y", "z", "gap", "slip", "X", "Y", "Z"), length)
    pressures = dict.fromkeys(("pressure", "shear", "pressure_from_stress", "pressure_smoothed", "error"), pressure)
    known = {**lengths, **pressures, "sliding_distance": length, "sliding_velocity": f"{length}/s", "contact_time": "s"}
    names = SPATIAL_CONTACT_COLUMNS if problem.space == "solid" else CONTACT_COLUMNS
    return {
        "history": {name: column.unit for name, column in columns_of(problem).items() if column.unit},
        "contact": {name: known[name] for name in (*names, *SLIDING_FIELDS) if name in known},
    }


# ------------------------------------------------------------------------------------------------------------- details
def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return str(int(value)) if isinstance(value, int | np.integer) else repr(float(value))


def _complete_rows(path: Path) -> tuple[list[str], list[list[str]]]:
    """Header and rows, without a last row that was cut off in the middle."""
    if not path.is_file():
        raise PrensaError(f"{path}: there is no such table; was the folder written by 'prensa run'?")
    try:
        text = path.read_text(encoding="utf-8")
        rows = list(csv.reader(io.StringIO(text[: text.rfind("\n") + 1], newline="")))  # names may have other ends of lines
    except (UnicodeDecodeError, csv.Error) as error:
        raise PrensaError(f"{path}: the table is damaged ({str(error)[:200]}); run the case again") from None
    if not rows:
        raise PrensaError(f"{path}: the table is empty, even of column names; run the case again")
    return rows[0], [r for r in rows[1:] if len(r) == len(rows[0])]


def _read(path: Path) -> dict[str, NDArray[Any]]:
    header, rows = _complete_rows(path)
    columns = list(zip(*rows)) if rows else [()] * len(header)
    try:
        return Contents(path, {name: np.array(values, dtype=_kind(name)) for name, values in zip(header, columns)})
    except (ValueError, OverflowError) as error:
        raise PrensaError(f"{path}: the table is damaged ({str(error)[:200]}); run the case again") from None


def _kind(name: str) -> type:
    return str if name in _TEXT_COLUMNS else np.int64 if name in _INTEGERS else np.float64


def _rows_until(path: Path, columns: list[str], last: int) -> list[list[str]]:
    header, rows = _complete_rows(path)
    if header != columns:
        raise PrensaError(f"{path}: the columns are not those of this case; the folder was changed, run the case again")
    where = columns.index("increment")
    return [r for r in rows if int(r[where]) <= last]
