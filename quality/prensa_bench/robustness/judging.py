"""One problem of a family: solved into files within its time, its files checked, its twins compared."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from prensa.errors import PrensaError
from prensa_bench.robustness import checks, checks_in_space, stops
from prensa_bench.robustness.drawn import Drawn, Twin
from prensa_bench.robustness.files import OutOfTime, Record, read, solve_into, solve_stages, totals
from prensa_bench.robustness.increments import reason_of
from prensa_bench.robustness.outcome import Outcome

GIVEN_INCREMENTS = 20  # a step, of twins whose own increments differ


def judge_files(d: Drawn, number: int, folder: Path | None = None) -> Outcome:
    """Solve one drawn problem into a folder (None: a temporary one), and judge what its files say."""
    if folder is None:
        with tempfile.TemporaryDirectory() as own:
            return judge_files(d, number, Path(own))
    start = time.process_time()
    status, words, reason = _verdict(d, folder, start + d.limit)
    iterations, cutbacks = totals(folder / "run")
    seconds = time.process_time() - start
    return Outcome(number, f"{number}: {d.kind}", status, words, iterations, cutbacks, seconds, reason)


def _verdict(d: Drawn, folder: Path, until: float) -> tuple[str, str, str]:
    try:
        records = solve_stages(folder / "run", d.stages, until, d.numerics)
    except OutOfTime:
        return "time", f"not ended after {d.limit:g} s, {_how_far(folder / 'run')}", ""
    except PrensaError as error:
        return _stopped(d, folder / "run", error)
    except Exception as error:
        return "wrong", f"crashed: {type(error).__name__}: {error}", "Crashed"
    judge = checks_in_space if d.problem.space == "solid" else checks
    if wrong := judge.wrong_with(d, records):
        return "wrong", wrong, ""
    for k, twin in enumerate(d.twins):
        try:
            solve_into(folder / f"twin{k}", twin.problem, until + d.limit, d.numerics)
        except OutOfTime:
            return "right", "(the twin used for comparison did not end in time)", ""
        except PrensaError as error:
            return "right", f"(the twin used for comparison failed: {error})", ""
        other = read(folder / f"twin{k}", twin.problem)
        if unlike(records[-1], other, twin) and not _same_times(records[-1], other):
            # what increments decide is no difference between the two problems: both once more with given ones
            try:
                one, other = _in_step(folder / f"again{k}", d, twin, until + 3 * d.limit)
            except OutOfTime:
                return "right", "(the twin took other increments, and with given ones did not end in time)", ""
            except PrensaError as error:
                return (
                    "right",
                    f"(the twin took other increments, and with given ones one of the two failed: {error})",
                    "",
                )
            if not _same_times(one, other):
                return "right", "(the twin took other increments, and with given ones too)", ""
            if wrong := unlike(one, other, twin):
                return "wrong", wrong, ""
        elif wrong := unlike(records[-1], other, twin):
            return "wrong", wrong, ""
    return "right", "", ""


def _stopped(d: Drawn, folder: Path, error: PrensaError) -> tuple[str, str, str]:
    """Of one stage in space: what came before is checked, and whether its files show the reason."""
    reason, last = reason_of(error), folder / "0"
    if d.problem.space != "solid" or len(d.stages) > 1 or not (last / "history.csv").is_file():
        return "reported", str(error), reason
    record = read(last, d.problem)
    if len(record.steps) == 0:
        return "reported", str(error), reason
    if record.bodies and (wrong := checks_in_space.until_it_stopped(d, record)):
        return "wrong", f"{wrong} (before it stopped: {error})", reason
    found = stops.confirmed(d, record, reason)
    return ("confirmed", f"{found}: {error}", reason) if found else ("reported", str(error), reason)


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
