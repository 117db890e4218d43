"""Results of a study: rows in memory, ``table.csv`` and ``table.parquet``, the page, and apart from them the times."""

from __future__ import annotations

import csv
import datetime
import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.output.files import replacing
from prensa.study.plan import Plan, Point
from prensa.study.quantities import Quantity
from prensa.study.slopes import Slopes
from prensa.study.values import value_of
from prensa.study.work import Outcome

if TYPE_CHECKING:
    from pandas import DataFrame

CASES_TABLE, PARQUET, TIMINGS, PAGE = "table.csv", "table.parquet", "timings.csv", "index.html"
CASES = "cases"
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass
class Row:
    """A case of a study: its values, its key, its folder in that of the study, how it ended, and what was measured (by text).

    ``measures``: columns of its table of measures, and what they are; ``slopes``: derivatives by text and path, where the study
    was asked for them, and ``unsloped``: why there are none, by text.
    """

    point: Point
    key: str
    folder: str
    status: str = "missing"
    reason: str = ""
    values: dict[str, float | None] = field(default_factory=dict)
    measures: dict[str, str] = field(default_factory=dict)
    lost: str = ""
    slopes: Slopes = field(default_factory=dict)
    unsloped: dict[str, str] = field(default_factory=dict)

    def value(self, text: str) -> float:
        """What was measured, not a number where the case has none."""
        found = self.values.get(text)
        return math.nan if found is None else found


@dataclass(frozen=True)
class Study:
    """The results of a sweep in *directory*: one row a case, in the order of the plan."""

    directory: Path
    problem: Problem = field(repr=False)
    plan: Plan = field(repr=False)
    quantities: tuple[Quantity, ...]
    rows: list[Row] = field(repr=False)
    notes: list[str] = field(default_factory=list, repr=False)
    """What is to be said of it beside how the cases ended."""

    def __repr__(self) -> str:
        return f"Study({str(self.directory)!r}: {self.summary()})"

    @property
    def status(self) -> Counter[str]:
        """How many cases are ``completed``, ``failed``, ``lost`` (their worker was) or ``missing`` (not computed yet)."""
        return Counter(row.status for row in self.rows)

    def summary(self) -> str:
        """How the cases ended, in words."""
        counts = self.status
        return f"{len(self.rows)} cases, " + ", ".join(f"{counts[s]} {s}" for s in sorted(counts))

    @property
    def columns(self) -> list[str]:
        """Names of the columns of the table, in order; a quantity that is given with a unit has it in its name."""
        sample = ["sample"] if self.plan.scattered else []
        given = [f"{f.path} ({f.unit})" if f.unit else f.path for f in self.plan.factors]
        return ["case", *sample, *given, *(q.text for q in self.quantities), "status", "reason", "folder"]

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A column by its name or path: floats where all are numbers (not a number where a case has none), else texts."""
        name = next((f"{f.path} ({f.unit})" for f in self.plan.factors if f.path == name and f.unit), name)
        if name not in self.columns:
            raise PrensaError(f"the study has no column {name!r}{suggest(name, self.columns)}")
        column = [cells[self.columns.index(name)] for cells in self.cells()]
        if all(isinstance(v, int | float) and not isinstance(v, bool) for v in column):
            return np.array(column, dtype=np.int64 if name in ("case", "sample") else np.float64)
        return np.array([str(v) for v in column])

    def cells(self) -> list[list[Any]]:
        """The table, in the order of `columns`."""
        found = []
        for number, row in enumerate(self.rows, 1):
            sample = [row.point.sample] if self.plan.scattered else []
            given = [value_of(f, row.point.values[f.path]) for f in self.plan.factors]
            measured = [row.value(q.text) for q in self.quantities]
            found.append([number, *sample, *given, *measured, row.status, row.reason, row.folder])
        return found

    def to_frame(self) -> DataFrame:
        """The table as a `pandas.DataFrame` (needs the extra ``prensa[tables]``)."""
        try:
            import pandas
        except ImportError:
            raise PrensaError("pandas is not installed: pip install prensa[tables]") from None
        return pandas.DataFrame({name: self[name] for name in self.columns})

    def quantiles(self, measure: str) -> list[tuple[dict[str, str], int, float, float, list[float]]]:
        """Scatter of a measure at each combination of the values: values, cases, mean, standard deviation, `QUANTILES`."""
        if measure not in [q.text for q in self.quantities]:
            raise PrensaError(
                f"the study has no measure {measure!r}{suggest(measure, [q.text for q in self.quantities])}"
            )
        groups: dict[tuple[str, ...], list[float]] = {}
        paths = [f.path for f in self.plan.varied]
        for row in self.rows:
            one = row.value(measure)
            groups.setdefault(tuple(row.point.values[p] for p in paths), []).extend([] if math.isnan(one) else [one])
        found = []
        for given, v in groups.items():
            spread = float(np.std(v, ddof=1)) if len(v) > 1 else math.nan
            at = [float(q) for q in np.quantile(v, QUANTILES)] if v else [math.nan] * len(QUANTILES)
            found.append((dict(zip(paths, given)), len(v), float(np.mean(v)) if v else math.nan, spread, at))
        return found

    @property
    def page(self) -> Path:
        """The page that shows the study."""
        return self.directory / PAGE

    def write(self) -> None:
        """Write the tables."""
        cells = self.cells()
        with (
            replacing(self.directory / CASES_TABLE) as temporary,
            open(temporary, "w", encoding="utf-8", newline="") as file,
        ):
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.columns)
            writer.writerows([_cell(v) for v in row] for row in cells)
        self._write_parquet()

    def _write_parquet(self) -> None:
        """The table for programs that read much of it; without pyarrow there is none."""
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError:
            # One that was left by an earlier run would be out of date.
            (self.directory / PARQUET).unlink(missing_ok=True)
            return
        table = pyarrow.table({name: self[name] for name in self.columns})
        with replacing(self.directory / PARQUET) as temporary:
            parquet.write_table(table, temporary)


class Timings:
    """``timings.csv``: wall time and worker of every case computed, apart from the table, which is the same every time."""

    def __init__(self, directory: Path) -> None:
        self._path = directory / TIMINGS

    def __enter__(self) -> Timings:
        new = not self._path.exists()
        self._file = open(self._path, "a", encoding="utf-8", newline="")
        if new:
            self._file.write("folder,status,seconds,worker,finished\n")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def append(self, row: Row, outcome: Outcome) -> None:
        """Write one line."""
        now = datetime.datetime.now().astimezone().isoformat(" ", "seconds")
        line = [row.folder, outcome.status, f"{outcome.seconds:.3f}", outcome.worker, now]
        csv.writer(self._file, lineterminator="\n").writerow(line)
        self._file.flush()


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(value)
    return str(value)
