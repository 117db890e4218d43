"""Increments of a run read back from its folder: what `solve` yields, as far as the files hold it.

Tables hold every increment, fields those that ``output: fields`` asked for. What a file does not hold says so when it is
asked for, or is not a number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from prensa.errors import PrensaError
from prensa.measures import parse
from prensa.measures.columns import directions, force_columns, orientation_columns, place_columns
from prensa.model.problem import Case
from prensa.output import history, vtk
from prensa.output.files import Contents, file_names, numbered
from prensa.result.increment import (
    FORCE_IN,
    PLACE,
    REACTION,
    SLIDING_FIELDS,
    STATUS,
    BodyState,
    ContactState,
    Increment,
    Moment,
    More,
    PointValues,
    Statistics,
    ToolState,
)
from prensa.system.checkpoint import CHECKPOINT, read_checkpoint
from prensa.types import Bytes

_NOT_KEPT = "{}: an increment read back has no {}; only increments from solve have them"


@dataclass(frozen=True)
class Placement:
    """Where a tool was placed: ``at`` (d,) its reference point, ``direction`` (d,) the normal of its face."""

    at: tuple[float, ...]
    direction: tuple[float, ...]


class Stored(Sequence[Increment]):
    """The increments of the run in *directory*, in order; ``stored[-1]`` is the last.

    Parameters
    ----------
    directory, case
        Folder of a run, and what was run.
    placements
        Where the tools were placed, by name (``tools`` in ``summary.json``).
    completed
        Whether the last increment ended a step before its time: one at the time of the end did.
    most
        How many increments count: a run that is still going adds more.

    Raises
    ------
    PrensaError
        If there is no history in the folder.

    """

    def __init__(
        self, directory: Path, case: Case, placements: Mapping[str, Placement], completed: bool = True,
        most: int | None = None,
    ) -> None:  # fmt: skip
        self.directory, self.problem, self.placements, self.mirror = directory, case.problem, placements, case.output.mirror
        problem = case.problem
        self._d = directions(problem)
        table = history.read_history(directory)
        self.history = Contents(directory / history.HISTORY, ((name, values[:most]) for name, values in table.items()))
        self._files = file_names(c.name for c in problem.all_contacts)
        step = self.history["step"]
        self._steps = Contents(directory / history.HISTORY, ((s.name, k) for k, s in enumerate(problem.steps, 1)))
        whole = completed or bool(len(step) and self.history["time"][-1] >= self._steps[str(step[-1])])
        self.ends = np.append(step[1:] != step[:-1], whole)[: len(step)]
        """(n,) whether a step ends with the increment."""
        self._areas = {c.name: f"{c.name}.area" for c in problem.all_contacts}

    @cached_property
    def with_fields(self) -> tuple[int, ...]:
        """Numbers of the increments whose fields were written, in order."""
        known = set(self.history["increment"].tolist())
        return tuple(n for n, _ in numbered(self.directory / vtk.FIELDS_FOLDER, ".vtu") if n in known)

    def __len__(self) -> int:
        return len(self.history["time"])

    @overload
    def __getitem__(self, k: int) -> Increment: ...
    @overload
    def __getitem__(self, k: slice) -> list[Increment]: ...
    def __getitem__(self, k: int | slice) -> Increment | list[Increment]:
        if isinstance(k, slice):
            return [self._increment(i) for i in range(*k.indices(len(self)))]
        if not -len(self) <= k < len(self):
            raise IndexError(f"increment {k} of {len(self)}")
        return self._increment(k % len(self))

    def number(self, number: int) -> Increment:
        """The increment of a number, which counts from 1."""
        return self[int(np.searchsorted(self.history["increment"], number))]

    def fields(self) -> Iterator[Increment]:
        """The increments whose fields were written."""
        return map(self.number, self.with_fields)

    def __repr__(self) -> str:
        return f"<{len(self)} increments in {self.directory}, {len(self.with_fields)} with fields>"

    # --------------------------------------------------------------------------------------------------- details
    def _increment(self, k: int) -> Increment:
        row = Contents(self.directory / history.HISTORY, ((name, values[k]) for name, values in self.history.items()))
        number, time = int(row["increment"]), float(row["time"])
        tools = {name: self._tool(name, row) for name in self.problem.tools}
        supports = [c.removeprefix("fixed.").removesuffix(".fx") for c in row if c.startswith("fixed.") and c.endswith(".fx")]
        # the iterations of all attempts are known here, the residuals are in convergence.csv
        cost = Statistics(int(row["iterations"]), int(row["cutbacks"]), np.nan, krylov=int(row.get("krylov", 0)))
        return Increment(
            str(row["step"]), self._steps[str(row["step"])], number, time, tools,
            {"viscous": 0.0} | {c.removeprefix("energy."): float(v) for c, v in row.items() if c.startswith("energy.")},
            {s: REACTION[self._d](*(float(row[f"fixed.{s}.f{c}"]) for c in "xyz"[: self._d])) for s in supports},
            cost, bool(self.ends[k]), _absent(_NOT_KEPT.format(self.directory, "committed state")),
            lambda: self._contacts(number, row), lambda: self._bodies(number), int(row.get("remeshings", 0)),
            seconds=float(row.get("seconds", time)),
            support_moments={s: Moment(*(float(row[f"fixed.{s}.m{c}"]) for c in "xyz")) for s in supports if self._d == 3},
            _more=More(self.problem, parse, _absent(_NOT_KEPT.format(self.directory, "shapes of boundaries")),
                       _absent(_NOT_KEPT.format(self.directory, "plastic power")),
                       points=lambda: vtk.read_points(self._fields_of(number), list(self.problem.bodies)),
                       wear=lambda tool: self._wear(tool, k)),
        )  # fmt: skip

    def _tool(self, name: str, row: dict[str, Any]) -> ToolState:
        unknown = Placement((np.nan,) * self._d, (0.0, -1.0, 0.0)[: self._d])
        placed = self.placements.get(name, unknown)
        place = PLACE[self._d](*(float(row[f"{name}.{c}"]) for c in place_columns(self.problem)))
        force = FORCE_IN[self._d](*(float(row[f"{name}.{c}"]) for c in force_columns(self.problem)))
        columns = [f"{name}.{c}" for c in orientation_columns(self.problem)]
        turned = tuple(float(row[c]) for c in columns) if all(c in row for c in columns) else ()  # runs of earlier versions
        work = float(row.get(f"{name}.work", 0.0))
        return ToolState(np.array(placed.at), place, force, placed.direction, work=work, orientation=turned)

    def _wear(self, tool: str, k: int) -> float:
        """Normal force times way of slip on a tool up to increment k (from 0), from the tables of its contacts."""
        from prensa.dies.loads import tool_loads

        if self.problem.space == "solid":  # no outline, along which tables would be added up
            return float("nan")
        touched = any(self.history[self._areas[c.name]][: k + 1].any() for c in self.problem.all_contacts if c.against == tool)
        own = float(tool_loads(self[: k + 1], self.problem, tool).work.sum()) if touched else 0.0
        return own + self._worn_before(tool)

    def _worn_before(self, tool: str) -> float:
        """What a tool of the run that the case starts from had worn by then; not a number where that folder is gone."""
        if self.problem.start is None:
            return 0.0
        try:
            case, state = read_checkpoint(Path(self.problem.start.run) / CHECKPOINT)
        except PrensaError:
            return float("nan")
        tools = case.problem.tools
        goes_on = tools.get(tool) == self.problem.tools[tool]
        return float(state.tool_wear[list(tools).index(tool)]) if goes_on else 0.0

    def _bodies(self, number: int) -> dict[str, BodyState]:
        return vtk.read_fields(self._fields_of(number), list(self.problem.bodies))

    def _fields_of(self, number: int) -> Path:
        path = self.directory / vtk.FIELDS_FOLDER / f"{number:04d}.vtu"
        if not path.is_file():
            which = f"{len(self.with_fields)} increments have theirs: {_some(self.with_fields)}"
            remedy = "'output: {fields: 1}' writes all"
            raise PrensaError(f"{path}: the fields of increment {number} were not written; {which}; {remedy}")
        return path

    def _contacts(self, number: int, row: dict[str, Any]) -> dict[str, ContactState]:
        out = {}
        for contact in self.problem.all_contacts:
            path = self.directory / history.CONTACT_FOLDER / self._files[contact.name] / f"{number:04d}.csv"
            out[contact.name] = _contact(path, contact, float(row[self._areas[contact.name]]))
        return out


def _absent(message: str) -> Callable[[], Any]:
    def ask() -> Any:
        raise PrensaError(message)

    return ask


def _some(numbers: Sequence[int]) -> str:
    shown = [str(n) for n in numbers]
    return ", ".join(shown if len(shown) <= 8 else [*shown[:4], "…", *shown[-3:]]) or "none"


def _contact(path: Path, contact: Any, area: float) -> ContactState:
    """A contact from its table; what tables of older runs lack (areas, nodal forces, speeds) is not a number."""
    t = history.read_contact(path)
    if not len(t["x"]):
        raise PrensaError(f"{path}: the table has no rows; it is cut off, run the case again")
    axes = "xyz" if "z" in t else "xy"
    X, x = np.column_stack([t[c.upper()] for c in axes]), np.column_stack([t[c] for c in axes])
    unknown, status = np.full(len(X), np.nan), _numbered(t["status"])
    slid = [t.get(name) for name in SLIDING_FIELDS]  # which older runs did not write
    points = PointValues(X, x, t["gap"], t["pressure"], t["shear"], t["slip"], status, unknown, None, *slid)
    if (beside := history.of_points(path)).is_file():
        p = history.read_table(beside)
        points = PointValues(
            np.column_stack([p["X"], p["Y"]]), np.column_stack([p["x"], p["y"]]), p["gap"], p["pressure"], p["shear"],
            p["slip"], _numbered(p["status"]), p["weight"], None, *(p.get(name) for name in SLIDING_FIELDS),
        )  # fmt: skip
    return ContactState(
        "+".join(contact.surface), contact.against, contact.surface[0].partition(".")[0], t["node"], X, x, t["gap"],
        t["pressure"], t["shear"], t["slip"], status, t.get("weight", unknown),
        np.column_stack([t.get(f"force_{c}", unknown) for c in axes]), t["pressure_from_stress"],
        t["pressure_smoothed"], t["error"], area, points, slid[0], slid[1], slid[2], t.get("speed", unknown),
    )  # fmt: skip


def _numbered(words: NDArray[Any]) -> Bytes:
    out = np.zeros(len(words), dtype=np.int8)
    for k, word in enumerate(STATUS):
        out[words == word] = k
    return out
