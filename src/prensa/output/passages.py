"""``passages.csv``: means over the last element that passed through a contact, one row an increment.

It is there where a tool of the case has an end that elements can pass (any but a plane).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prensa.checks.after.passages import Passages
from prensa.errors import PrensaError
from prensa.output.history import Table, read_history, read_table
from prensa.result.increment import Increment, Mean
from prensa.system.state import Clock
from prensa.system.system import System

PASSAGES = "passages.csv"
NONE = Mean(math.nan, math.nan)


class PassageTable:
    """Writer of ``passages.csv`` in *directory*; *passages* follows the run, *keep* as in `prensa.output.history.History`."""

    def __init__(self, directory: Path, passages: Passages, keep: int | None = None) -> None:
        self._contacts = list(passages.count)
        self._quantities = [c for c in passages.columns if not c.endswith(".elements")]
        contacts = [f"{name}.{c}" for name in self._contacts for c in ("passages", "elements", "pressure")]
        means = [f"{column}.{c}" for column in self._quantities for c in Mean._fields]
        path = directory / PASSAGES
        keep = keep if path.is_file() else None
        self._table = Table(path, ["step", "increment", "time", "jump", *contacts, *means], keep) if self._contacts else None

    def append(self, increment: Increment) -> None:
        """Write the row of *increment* and push it to the operating system."""
        if self._table is None:
            return
        head = [increment.step, increment.number, increment.time, increment.jump]
        contacts = [
            v for name in self._contacts
            for v in (increment.passages[name], increment.passing[name].elements, increment.passing[name].pressure)
        ]  # fmt: skip
        means = [v for column in self._quantities for v in increment.means.get(column, NONE)]
        self._table.append([*head, *contacts, *means])

    def close(self) -> None:
        """Close the file."""
        if self._table is not None:
            self._table.close()


def restored(directory: Path, system: System, clock: Clock) -> Passages:
    """What has passed in the run in *directory* up to where its checkpoint stands, from its tables."""
    passages, last = Passages(system), clock.number
    number = {step.name: k for k, step in enumerate(system.problem.steps)}
    table = read_history(directory)
    done = table["increment"] <= last
    for name in system.problem.tools:
        if any(np.any(table[f"{name}.{c}"][done]) for c in ("fx", "fy") if f"{name}.{c}" in table):
            passages.met.add(name)
    if passages.count and (directory / PASSAGES).is_file():
        more = read_passages(directory)
        needed = {*passages.columns, *(f"{name}.passages" for name in passages.count)}
        for name in sorted(needed - {*more, *table}):
            raise _changed(directory, f"no column {name!r}")
        for name in sorted({*table["step"].tolist()} - {*number}):
            raise _changed(directory, f"a step {name!r}, which the case has not")
        rows = {int(n): k for k, n in enumerate(more["increment"])}
        after = [*(number[str(step)] for step in table["step"][1:]), clock.step]  # step of what follows each row
        for k, n in enumerate(table["increment"]):
            if n <= last and int(n) in rows:
                row = {name: values[rows[int(n)]] for name, values in more.items()}
                ended = (clock.step if n == last else after[k]) > number[str(table["step"][k])]
                passages.restore(str(table["step"][k]), row | {name: v[k] for name, v in table.items()}, ended)
    return passages


def _changed(directory: Path, what: str) -> PrensaError:
    return PrensaError(f"{directory}: {PASSAGES} and history.csv have {what}; the folder was changed, run the case again")


def read_passages(directory: str | Path) -> dict[str, NDArray[Any]]:
    """Columns of ``passages.csv`` by name.

    Raises
    ------
    PrensaError
        If there is no such file in *directory*: the case has no tool with an end.

    """
    return read_table(Path(directory) / PASSAGES)


def last_means(directory: Path) -> dict[str, dict[str, dict[str, float]]]:
    """By step and quantity mean and ripple over the last passage in that step, where there was one."""
    if not (directory / PASSAGES).is_file():
        return {}
    table = read_passages(directory)
    quantities = [name.removesuffix(".mean") for name in table if name.endswith(".mean")]
    out: dict[str, dict[str, dict[str, float]]] = {}
    for step in dict.fromkeys(table["step"].tolist()):
        k = int(np.flatnonzero(table["step"] == step)[-1])
        values = {q: {c: float(table[f"{q}.{c}"][k]) for c in Mean._fields} for q in quantities}
        if found := {q: v for q, v in values.items() if math.isfinite(v["mean"])}:
            out[step] = found
    return out
