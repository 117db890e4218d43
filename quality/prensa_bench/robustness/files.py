"""A run into files, and the files read back: all that the checks know of an answer.

Reading is done here once more, from the documented tables and fields alone, and shares nothing with the writers.
"""

from __future__ import annotations

import csv
import logging
import time
from collections import deque
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import prensa as pr
from prensa.output import checkpoint
from prensa.output.history import History, write_contact
from prensa.output.vtk import Fields
from prensa.result.increment import Increment, Monitor, Progress
from prensa.system.discretise import discretise
from prensa.types import Array, Index

LAST_STATES = 3  # increments before a stop whose fields are written
FIELDS_EVERY = 10  # increments between two files of fields, beside those at the ends of steps; all on meshes made anew

SAID = "said.txt"
SHORTEST = "shortest.txt"
STRESS_AND_STRAIN = ("stress_at_points", "plastic_strain_at_points")


class OutOfTime(Exception):
    """The limit of processor time is spent."""


@dataclass(frozen=True)
class Shape:
    """A body at one increment: ``X``, ``x`` (n, d), ``cells`` (m, a), ``reaction`` (n, d); in space d = 3.

    ``stress`` (m, q, 6), ``plastic`` strain (m, q) at the integration points, in space.
    """

    X: Array
    x: Array
    cells: Index
    reaction: Array
    stress: Array | None = None
    plastic: Array | None = None


@dataclass(frozen=True)
class Record:
    """Files of one run: ``problem``; columns of ``history``; contact tables by name and number; bodies by number.

    ``said``: its warnings. ``refused``: time after the last increment of the shortest attempt that failed there; 0 if none did.
    """

    problem: pr.Problem
    history: dict[str, Array]
    steps: list[str]
    contacts: dict[str, dict[int, dict[str, Array]]]
    bodies: dict[int, dict[str, Shape]]
    said: tuple[str, ...] = ()
    refused: float = 0.0


class _Words(logging.Handler):
    """Keeps the warnings of a run, a line each."""

    def __init__(self, path: Path) -> None:
        super().__init__(logging.WARNING)
        self._path = path
        path.write_text("", encoding="utf-8")

    def emit(self, record: logging.LogRecord) -> None:
        with self._path.open("a", encoding="utf-8") as file:
            file.write(record.getMessage().replace("\n", " ") + "\n")


@contextmanager
def _heard(path: Path) -> Iterator[None]:
    """Warnings of what runs meanwhile go to a file, beside where they go anyway."""
    words, log = _Words(path), logging.getLogger("prensa")
    log.addHandler(words)
    try:
        yield
    finally:
        log.removeHandler(words)


def ending(until: float) -> Monitor:
    """A monitor that raises `OutOfTime` when a processor time is reached."""

    def watch(_: Progress) -> None:
        if time.process_time() > until:
            raise OutOfTime

    return watch


class _Refused:
    """A monitor that keeps the time of the shortest attempt that was rejected since the last increment, inf if none was."""

    def __init__(self, until: float) -> None:
        self._watch, self.time = ending(until), np.inf

    def __call__(self, progress: Progress) -> None:
        self._watch(progress)
        if progress.event == "accepted":
            self.time = np.inf
        elif progress.event == "rejected":
            self.time = min(self.time, progress.time)


def solve_into(folder: Path, problem: pr.Problem, until: float, numerics: pr.Numerics | None = None) -> None:
    """Solve a problem and leave its tables, fields and checkpoint in a folder; ``until``: processor time to stop at.

    Raises
    ------
    OutOfTime
        When the processor time is spent.
    PrensaError
        As `prensa.solve`.

    """
    folder.mkdir(parents=True, exist_ok=True)
    system = discretise(problem)
    ends: deque[Increment] = deque(maxlen=LAST_STATES)
    refused = _Refused(until)
    with closing(History(folder, problem)) as tables, _heard(folder / SAID):
        fields = Fields(folder, points=problem.space == "solid")
        # forces at the middles of sides need the corners beside them, which the tables of contacts have not; work of loads all
        whole = any(body.mesh.type == "tetrahedra" for body in problem.bodies.values()) or any(s.loads for s in problem.steps)
        every = 1 if whole else FIELDS_EVERY
        try:
            for last in pr.solve(system, numerics, monitor=refused):
                ends.append(last)
                for name, contact in last.contacts.items():
                    write_contact(folder, name, last.number, contact)
                tables.append(last)
                if last.end_of_step or last.number % every == 0 or problem.remesh != "off":
                    fields.append(last)
        except pr.PrensaError:
            for last in ends:  # how it came to where it ended
                fields.append(last)
            if ends and np.isfinite(refused.time):
                (folder / SHORTEST).write_text(repr(float(refused.time - ends[-1].time)), encoding="utf-8")
            raise
    if ends:
        text = checkpoint.case_text(pr.Case(problem))
        checkpoint.write_checkpoint(folder / checkpoint.CHECKPOINT, text, ends[-1].state)


def solve_stages(
    folder: Path, stages: tuple[pr.Problem, ...], until: float, numerics: pr.Numerics | None = None
) -> list[Record]:
    """Solve stages one after the other, each from the run of the one before, and read their files."""
    records = []
    for k, stage in enumerate(stages):
        here = folder / f"{k}"
        problem = stage if k == 0 else replace(stage, start=pr.Start(run=str((folder / f"{k - 1}").resolve())))
        solve_into(here, problem, until, numerics)
        records.append(read(here, problem))
    return records


def read(folder: Path, problem: pr.Problem) -> Record:
    """The files of a run."""
    rows = _rows(folder / "history.csv")
    history = {k: np.array([float(r[k]) for r in rows]) for k in (rows[0] if rows else ()) if k != "step"}
    contacts = {}
    for c in problem.contacts:
        tables = sorted((folder / "contact" / c.name).glob("[0-9]*.csv"))
        contacts[c.name] = {int(t.stem): _table(t) for t in tables if t.stem.isdigit()}
    names = list(problem.bodies)
    d = 3 if problem.space == "solid" else 2
    bodies = {int(f.stem): _shapes(f, names, d) for f in sorted((folder / "fields").glob("*.vtu"))}
    said = tuple((folder / SAID).read_text(encoding="utf-8").splitlines())
    refused = float(path.read_text(encoding="utf-8")) if (path := folder / SHORTEST).is_file() else 0.0
    return Record(problem, history, [r["step"] for r in rows], contacts, bodies, said, refused)


def totals(folder: Path) -> tuple[int, int]:
    """Iterations and cut-backs of all runs below a folder, of those too that did not end."""
    rows = [r for path in folder.rglob("history.csv") for r in _rows(path)]
    return sum(int(r["iterations"]) for r in rows), sum(int(r["cutbacks"]) for r in rows)


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _table(path: Path) -> dict[str, Array]:
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    columns = dict(zip(head, zip(*rows)))
    plane = ("node", "x", "y", "gap", "pressure", "shear", "X", "Y")
    space = ("z", "force_x", "force_y", "force_z") if "z" in columns else ()
    return {k: np.array(columns[k], dtype=float) for k in (*plane, *space)}


def _shapes(path: Path, names: list[str], d: int) -> dict[str, Shape]:
    import meshio

    mesh: Any = meshio.read(path)
    x, u, r = (v[:, :d] for v in (mesh.points, mesh.point_data["displacement"], mesh.point_data["reaction"]))
    out = {}
    for block, number in zip(mesh.cells, mesh.cell_data["body"]):
        for k in np.unique(number):
            cells = block.data[number == k].astype(np.int64)
            own = np.arange(cells.min(), cells.max() + 1)
            values = [mesh.cell_data_dict[n][block.type][number == k] for n in STRESS_AND_STRAIN if n in mesh.cell_data]
            plastic = values[1].reshape(len(cells), -1) if values else None
            stress = values[0].reshape(*plastic.shape, -1) if plastic is not None else None
            out[names[int(k)]] = Shape(x[own] - u[own], x[own], cells - own[0], r[own], stress, plastic)
    return out
