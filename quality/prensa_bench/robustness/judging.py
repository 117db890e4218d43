"""One problem of a family: solved into files within its time, its files checked, its twins compared."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa_bench.robustness import checks, checks_in_space, stops
from prensa_bench.robustness.drawn import Drawn, Twin
from prensa_bench.robustness.files import OutOfTime, Record, read, solve_into, solve_stages, totals
from prensa_bench.robustness.increments import reason_of
from prensa_bench.robustness.outcome import COMPARED, INSTEAD, NOT_COMPARED, Outcome

GIVEN_INCREMENTS = 20  # a step, of twins whose own increments differ


class Verdict(NamedTuple):
    """``status``, ``words`` and ``reason`` of an `Outcome`; ``twin``: whether its answer and that of its twin were compared."""

    status: str
    words: str = ""
    reason: str = ""
    twin: str = ""


def judge_files(d: Drawn, number: int, folder: Path | None = None, instead: Iterable[Drawn] = ()) -> Outcome:
    """Solve one drawn problem into a folder (None: a temporary one), and judge what its files say.

    ``instead``: problems that are solved and judged in its place, one after the other until one has been compared with its
    twin, where it was not: of its twin no answer came, or of itself.
    """
    if folder is None:
        with tempfile.TemporaryDirectory() as own:
            return judge_files(d, number, Path(own), instead)
    start = time.process_time()
    found = _verdict(d, folder, start + d.limit)
    iterations, cutbacks = totals(folder / "run")
    found = _until_compared(found, folder, instead)
    seconds = time.process_time() - start
    twin = f"{d.twins[0].problem.name}: {found.twin}" if d.twins else ""
    cost = (iterations, cutbacks, seconds)
    return Outcome(number, f"{number}: {d.kind}", found.status, found.words, *cost, found.reason, twin)


def _until_compared(first: Verdict, folder: Path, instead: Iterable[Drawn]) -> Verdict:
    """The verdict with those on the problems solved in its place: wrong or reported if one of them is."""
    found = first
    for k, other in enumerate(instead):
        if found.twin != NOT_COMPARED or found.status == "wrong":
            return found
        with_it = _verdict(other, folder / f"instead{k}", time.process_time() + other.limit)
        words = "; ".join(filter(None, (found.words, f"instead of it {other.kind}: {with_it.words or with_it.status}")))
        twin = INSTEAD if with_it.twin == COMPARED else NOT_COMPARED
        worse = with_it if with_it.status in ("wrong", "reported") else found
        found = Verdict(worse.status, words, worse.reason, twin)
    return found


def _verdict(d: Drawn, folder: Path, until: float) -> Verdict:
    twin = NOT_COMPARED if d.twins else ""
    try:
        records = solve_stages(folder / "run", d.stages, until, d.numerics)
    except OutOfTime:
        return Verdict("time", f"not ended after {d.limit:g} s, {_how_far(folder / 'run')}", twin=twin)
    except PrensaError as error:
        return _stopped(d, folder / "run", error)._replace(twin=twin)
    except Exception as error:
        return _crashed(error, twin)
    if wrong := _judge(d).wrong_with(d, records):
        return Verdict("wrong", wrong, twin=twin)
    found = []
    for k, other in enumerate(d.twins):
        try:
            found.append(_beside(d, records[-1], other, folder / f"twin{k}", until))
        except Exception as error:
            found.append(_crashed(error, NOT_COMPARED))
    bad = [v for v in found if v.status != "right"]
    missed = [v for v in found if v.twin == NOT_COMPARED]
    return next(iter((*bad, *missed, *found)), Verdict("right"))


def _crashed(error: Exception, twin: str) -> Verdict:
    return Verdict("wrong", f"crashed: {type(error).__name__}: {error}", "Crashed", twin)


def _judge(d: Drawn) -> Any:
    return checks_in_space if d.problem.space == "solid" else checks


def _beside(d: Drawn, record: Record, twin: Twin, folder: Path, until: float) -> Verdict:
    """The verdict on the last run of a problem beside its twin.

    Right too where no answer of the twin came for a reason that is no fault, in words that say so: it took too long, or stopped
    as its files show that it had to. A twin that stops or is wrong else is reported or wrong as any problem is.
    """
    itself = replace(d, stages=(twin.problem,), twins=())
    try:
        solve_into(folder / "0", twin.problem, until + d.limit, d.numerics)
    except OutOfTime:
        return Verdict("right", "not compared: its twin did not end in time", twin=NOT_COMPARED)
    except PrensaError as error:
        found = _stopped(itself, folder, error) if twin.same_tools else Verdict("reported", str(error), reason_of(error))
        if found.status == "confirmed":
            return Verdict("right", f"not compared: its twin stopped, {found.words}", twin=NOT_COMPARED)
        return found._replace(words=f"its twin: {found.words}", twin=NOT_COMPARED)
    other = read(folder / "0", twin.problem)
    if twin.same_tools and (wrong := _judge(d).wrong_with(itself, [other])):
        return Verdict("wrong", f"its twin: {wrong}", twin=NOT_COMPARED)
    if unlike(record, other, twin) and not _same_times(record, other):
        # what increments decide is no difference between the two problems: both once more with given ones
        try:
            record, other = _in_step(folder, d, twin, until + 3 * d.limit)
        except OutOfTime:
            return _with_others("did not end in time")
        except PrensaError as error:
            return _with_others(f"one of the two failed: {error}")
        if not _same_times(record, other):
            return _with_others("other times again")
    wrong = unlike(record, other, twin)
    return Verdict("wrong" if wrong else "right", wrong, twin=COMPARED)


def _with_others(words: str) -> Verdict:
    return Verdict("right", f"not compared: its twin took other increments, and with given ones {words}", twin=NOT_COMPARED)


def _stopped(d: Drawn, folder: Path, error: PrensaError) -> Verdict:
    """Of one stage in space: what came before is checked, and whether its files show the reason."""
    reason, last = reason_of(error), folder / "0"
    if d.problem.space != "solid" or len(d.stages) > 1 or not (last / "history.csv").is_file():
        return Verdict("reported", str(error), reason)
    record = read(last, d.problem)
    if len(record.steps) == 0:
        return Verdict("reported", str(error), reason)
    if record.bodies and (wrong := checks_in_space.until_it_stopped(d, record)):
        return Verdict("wrong", f"{wrong} (before it stopped: {error})", reason)
    found = stops.confirmed(d, record, reason)
    return Verdict("confirmed", f"{found}: {error}", reason) if found else Verdict("reported", str(error), reason)


def _same_times(one: Record, other: Record) -> bool:
    a, b = one.history["time"], other.history["time"]
    return len(a) == len(b) and bool(np.allclose(a, b, rtol=0.0, atol=1e-9))


def _in_step(folder: Path, d: Drawn, twin: Twin, until: float) -> tuple[Record, Record]:
    """A problem of one stage and its twin, solved with the same given increments."""
    given = [
        replace(p, steps=tuple(replace(s, increments=GIVEN_INCREMENTS) for s in p.steps))
        for p in (d.stages[-1], twin.problem)
    ]
    for name, p in zip("ab", given):
        solve_into(folder / name, p, until, d.numerics)
    return read(folder / "a", given[0]), read(folder / "b", given[1])


def _how_far(folder: Path) -> str:
    """Stage and time reached."""
    stages = sorted(folder.iterdir(), key=lambda p: int(p.name)) if folder.is_dir() else []
    if not stages:
        return "before its first increment"
    lines = (stages[-1] / "history.csv").read_text(encoding="utf-8").splitlines()
    at = lines[-1].split(",")[:3] if len(lines) > 1 else ["", "0", "0"]
    return f"stage {len(stages)}, step {at[0]!r}, increment {at[1]}, time {float(at[2]):.4g}"


def unlike(one: Record, other: Record, twin: Twin) -> str:
    """What differs in the last forces of the tools, or of every step, relative to the largest of all; '' if nothing."""
    whole = max(float(np.abs(other.history[f"{t}.{k}"]).max()) for t in one.problem.tools for k in ("fx", "fy"))
    whole *= abs(twin.scale)
    for tool in one.problem.tools:
        forces = twin.forces(other.history, tool)
        for c in twin.axes:
            a, b = one.history[f"{tool}.{c}"], forces[c]
            for i, j in zip(_ends(one, twin), _ends(other, twin), strict=True):
                if abs(a[i] - b[j]) > twin.tolerance * whole:
                    return f"last {tool}.{c} {a[i]:.6g}, of {twin.problem.name} {b[j]:.6g}; largest force {whole:.4g}"
    return ""


def _ends(record: Record, twin: Twin) -> list[int]:
    """Rows of a history at which forces are compared: the last one, or the last one of each step."""
    return list({step: k for k, step in enumerate(record.steps)}.values()) if twin.each_step else [-1]
