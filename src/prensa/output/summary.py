"""``summary.json``: what was run and what came out, written when a run begins and again when it ends.

A run that has begun and not ended is ``running`` in its file. Whoever reads that gets the state of the tables now, and from
the lock of the folder whether the run is still going or was killed.
"""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa import __version__
from prensa.checks.during.closing import FOLDS
from prensa.errors import PrensaError, take_path
from prensa.linear.iterative import solver_of
from prensa.measures.columns import force_columns, place_columns
from prensa.measures.filling import found_at_end
from prensa.measures.units import volume_unit
from prensa.model.feed import ends_early
from prensa.model.metals import metals_of
from prensa.model.problem import Case, Problem
from prensa.model.schema import plain
from prensa.output import answer, checkpoint, damage, history, lock, measured, passages, press, runlog, whole
from prensa.output.edges import Edges
from prensa.output.files import Contents, write_text
from prensa.output.stored import Placement, Stored
from prensa.types import Array

if TYPE_CHECKING:
    from prensa.system.state import State
    from prensa.system.system import System

SUMMARY = "summary.json"
RUNNING = "running"
COMPLETED = "completed"
ENDED = (COMPLETED, "failed", "interrupted")
_STATUS = {True: RUNNING, False: "killed", None: "killed or still running"}


# ------------------------------------------------------------------------------------------------------------- writing
def summarise(directory: Path, system: System, case: Case, state: State | None, **known: Any) -> dict[str, Any]:
    """Summary of the run in *directory* from its tables, so that a resumed run covers the whole.

    *state*: the last one, whose meshes may have been made during the run; *known*: ``status``, ``reason``, ``source``,
    ``timings`` (wall seconds by section), ``warnings``, what each is ``about``, ``stopped_by`` (step → words of what
    ended it) and ``text``, the case as YAML.
    """
    problem, text = case.problem, known["text"]
    meshes = system.meshes if state is None or state.remeshed is None else state.remeshed.meshes
    about, tables = known["about"], _read(directory)
    shares = {tool: share._asdict() for tool, share in whole.shares_of(system, case).items()}
    made = {
        "name": problem.name,
        "status": known["status"],
        "reason": known["reason"],
        "version": __version__,
        "input_hash": checkpoint.text_hash(text),
        "source": known["source"],
        "finished": _moment(datetime.datetime.now()),
        **_from_tables(directory, case, tables, known["status"] == COMPLETED, known["timings"], shares),
        "units": history.units_of(problem),
        "bodies": {
            b: {"nodes": len(m.points), "elements": len(m.cells), "element": system.problem.element_name(b)}
            for b, m in meshes.items()
        },
        "metals": {b: plain(metal) for b, metal in metals_of(problem)},
        "tools": {t.name: {"at": t.at.tolist(), "direction": list(map(float, t.direction))} for t in system.tools},
        "warnings": known["warnings"],
        "warnings_about": {w: about[w] for w in answer.weighed(known["warnings"], about) if w in about},
        "stopped_by": known["stopped_by"],
        **({"damage": _located(directory, system, case, tables)} if known["status"] in ENDED else {}),
        "fill": _fill(directory, system, case) if known["status"] in ENDED else {},
        "wear": _wear(directory, system, case) if known["status"] in ENDED else {},
        "part": whole.part_of_whole(system, case),
        "whole": shares,
        "folds": [w for w in known["warnings"] if FOLDS in w],
        "case": text,
    }
    if problem.space == "solid":
        krylov = tables.history["krylov"] if "krylov" in tables.history else np.zeros(0, dtype=int)
        made["linear_solver"] = {"solver": solver_of(system, case.numerics), "krylov_iterations": int(krylov.sum())}
    return made | {"answer": answer.lines(tables.history, case, made)}


def write_summary(directory: Path, summary: Mapping[str, Any], durable: bool = True) -> Path:
    """Write ``summary.json``, atomically; ``durable`` as of `prensa.output.files.replacing`."""
    return write_text(directory / SUMMARY, json.dumps(summary, indent=2, ensure_ascii=False) + "\n", durable)


# ------------------------------------------------------------------------------------------------------------- reading
def read_summary(directory: str | Path) -> dict[str, Any]:
    """Summary of the run in *directory* as it stands now, also of one that is still going or was killed.

    Raises
    ------
    PrensaError
        If there is no run, it has not begun to write, or its summary is damaged.

    """
    directory = take_path("read_summary", directory)
    summary = _begun(directory)
    if summary["status"] != RUNNING:
        return summary
    held = lock.is_held(directory)
    if not held and (again := _begun(directory))["status"] != RUNNING:
        return again  # it ended meanwhile
    return _as_it_stands(directory, summary, held)


def refuse_file(directory: Path) -> None:
    """Refuse a file, such as that of the case, where the folder of a run belongs (PrensaError)."""
    if directory.is_file():
        folder = Path("results") / directory.stem
        raise PrensaError(f"{directory}: this is a file; name the folder of a run, such as {folder}, which 'prensa run' makes")


def stored_summary(directory: Path) -> Contents:
    """Content of ``summary.json`` as it is; raises PrensaError when there is none or it is damaged."""
    path = directory / SUMMARY
    refuse_file(directory)
    try:
        read = json.loads(path.read_text(encoding="utf-8"), object_pairs_hook=lambda entries: Contents(path, entries))
        return Contents(path, read)
    except FileNotFoundError:
        raise PrensaError(f"{path}: there is no summary; was the folder written by 'prensa run'?") from None
    except (ValueError, TypeError, OSError) as error:
        raise PrensaError(f"{path}: the summary cannot be read ({error}); run the case again") from None


def has_ended(directory: Path) -> bool:
    """Whether the run in *directory* has written how it ended."""
    return bool(stored_summary(directory)["status"] in ENDED) if (directory / SUMMARY).is_file() else False


def progress_of(summary: Mapping[str, Any]) -> str:
    """How far a run has come, in words."""
    totals = summary["totals"]
    if not totals["increments"]:
        return "no increment was completed"
    return f"as far as increment {totals['increments']}, time {totals['time']:.6g} of {totals['end']:.6g}"


# ------------------------------------------------------------------------------------------------------------- details
def _begun(directory: Path) -> Contents:
    """The summary that the run wrote last; where there is none, what its checkpoint knows."""
    if (directory / SUMMARY).is_file() or not directory.is_dir():
        return stored_summary(directory)
    if (directory / checkpoint.CHECKPOINT).is_file() and (directory / history.HISTORY).is_file():
        return _from_checkpoint(directory)
    if (directory / lock.LOCK).is_file() or (directory / runlog.LOG).is_file():
        held = _STATUS[lock.is_held(directory)]
        raise PrensaError(f"{directory}: {held}: no increment was completed; there is nothing to show")
    return stored_summary(directory)


def _from_checkpoint(directory: Path) -> Contents:
    from prensa.system.discretise import discretise

    case, state = checkpoint.read_checkpoint(directory / checkpoint.CHECKPOINT)
    known = {"status": RUNNING, "reason": "", "source": "", "timings": {}, "warnings": [], "about": {}, "stopped_by": {},
             "text": checkpoint.case_text(case)}
    return Contents(directory / SUMMARY, summarise(directory, discretise(case.problem), case, state, **known))


def _as_it_stands(directory: Path, summary: Contents, held: bool | None) -> dict[str, Any]:
    """The summary of a run that has not ended, from the one of its begin, its tables and its log."""
    from prensa.model.schema import loads

    logged = runlog.read_log(directory)
    timings = dict(summary["timings"])
    timings["other"] = timings.get("other", 0.0) + logged.seconds  # what took how long is added up at the end
    case = loads(summary["case"], SUMMARY, bounded=False)
    tables = _read(directory)
    now = _from_tables(directory, case, tables, False, timings, summary.get("whole", {}))
    reason = progress_of(now)
    if held is not True and (directory / checkpoint.CHECKPOINT).is_file():
        reason += "; 'prensa resume' continues from the checkpoint"
    made = summary | now | {
        "status": _STATUS[held],
        "reason": reason,
        "finished": summary["finished"] if logged.last is None else _moment(logged.last),
        "warnings": list(dict.fromkeys([*summary["warnings"], *logged.warnings])),
    }  # fmt: skip
    return Contents(directory / SUMMARY, made | {"answer": answer.lines(tables.history, case, made)})


def _moment(local: datetime.datetime) -> str:
    return local.astimezone().isoformat(" ", "seconds")


class _Tables(NamedTuple):
    """Columns of ``convergence.csv`` and ``history.csv``."""

    convergence: Mapping[str, NDArray[Any]]
    history: Mapping[str, NDArray[Any]]


def _read(directory: Path) -> _Tables:
    # the convergence first: its rows are on the disk before those of the history
    return _Tables(history.read_convergence(directory), history.read_history(directory))


def _from_tables(
    directory: Path, case: Case, tables: _Tables, completed: bool, timings: Mapping[str, float],
    shares: Mapping[str, Mapping[str, Any]],
) -> dict[str, Any]:  # fmt: skip
    """The entries of a summary that grow with the run."""
    problem, (cost, table) = case.problem, tables
    final = [float(cost["residual"][cost["increment"] == n][-1]) for n in np.unique(cost["increment"])]
    iterations = table["iterations"]

    def last(column: str) -> float:
        return float(table[column][-1]) if len(table[column]) else 0.0

    return {
        "last_force": {t: {c: last(f"{t}.{k}") for c, k in _forces(problem)} for t in problem.tools},
        "last_place": {t: {c.removeprefix("u"): last(f"{t}.{c}") for c in place_columns(problem)} for t in problem.tools},
        "ended_early": _early_ends(table, problem, completed),
        "passage_means": passages.last_means(directory),
        "measures": measured.measured(directory, problem),
        "last_area": {c.name: last(f"{c.name}.area") for c in problem.all_contacts},
        "energy": {e: last(f"energy.{e}") for e in history.energies_of(problem)},
        "totals": {
            "increments": len(iterations),
            "iterations": int(iterations.sum()),
            "cutbacks": int(table["cutbacks"].sum()),
            "time": last("time"),
            "end": float(len(problem.steps)),
            "wall_seconds": sum(timings.values()),
        },
        "convergence": {
            "mean_iterations": float(iterations.mean()) if len(iterations) else 0.0,
            "max_iterations": int(iterations.max(initial=0)),
            "max_residual": max(final, default=0.0),
            "tolerance": case.numerics.tolerance,
        },
        "timings": dict(timings),
        "damage": [d.entry() for d in damage.damages(table, problem)],
        "press": [verdict._asdict() for verdict in press.verdicts(table, problem)],
        "blows": [blow._asdict() for blow in press.blows(table, problem)],
        "largest_force": [peak._asdict() for peak in answer.peaks(table, case, shares)],
    }


def _forces(problem: Problem) -> list[tuple[str, str]]:
    """Names of a tool's forces and moments in the summary, with their columns: x, y and m in the plane."""
    names = ("x", "y", "z", "mx", "my", "mz") if problem.space == "solid" else ("x", "y", "m")
    return list(zip(names, force_columns(problem)))


def _located(directory: Path, system: System, case: Case, tables: _Tables) -> list[dict[str, Any]]:
    """The damages, with the tools at whose sharp edges of contact they are largest."""
    found = damage.damages(tables.history, case.problem)
    return [d.entry() for d in damage.located(found, Edges(directory, system, case).tool_at)] if found else []


def _wear(directory: Path, system: System, case: Case) -> dict[str, Any]:
    """Deepest wear by tool, of those of which the case asks for it; '' where nothing has pressed on one."""
    if case.problem.space == "solid" or not case.output.wear:
        return {}
    from prensa.dies.loads import tool_loads
    from prensa.dies.wear import wear, wear_summary

    out: dict[str, Any] = {}
    stored = Stored(directory, case, {t.name: Placement(_pair(t.at), _pair(t.direction)) for t in system.tools})
    for tool, law in case.output.wear.items() if len(stored) else ():
        with suppress(PrensaError):  # nothing has pressed on it
            out[tool] = wear_summary(wear(tool_loads(stored, case.problem, tool), law=law))
    return out


def _fill(directory: Path, system: System, case: Case) -> dict[str, Any]:
    """How far dies are filled at the end of a run, by body: of closed ones the share, and the places that are not filled."""
    if case.problem.space == "solid":
        return {}
    placements = {t.name: Placement(_pair(t.at), _pair(t.direction)) for t in system.tools}
    stored = Stored(directory, case, placements)
    if not stored.with_fields or stored.with_fields[-1] != stored[-1].number:
        return {}
    return {
        body: {"fill": 1.0 - found.missing / found.die if found.closed else None, "die": found.die, "missing": found.missing,
               "unit": volume_unit(case.problem), "places": [place._asdict() for place in found.places or found.pockets]}
        for body, found in found_at_end(stored[-1]).items()
    }  # fmt: skip


def _pair(v: Array) -> tuple[float, float]:
    return float(v[0]), float(v[1])


def _early_ends(table: Mapping[str, NDArray[Any]], problem: Problem, completed: bool) -> dict[str, float]:
    """Steps that ended before their time, with when they did."""
    out = {}
    for number, step in enumerate(problem.steps):
        rows = np.flatnonzero(table["step"] == step.name)
        over = completed or (len(rows) and rows[-1] < len(table["step"]) - 1)
        if ends_early(step) and len(rows) and over and (end := float(table["time"][rows[-1]])) < number + 1:
            out[step.name] = end
    return out
