"""Runs, sweeps and calibrations that are stopped or killed at random moments, then looked at, and continued.

``prensa bench killed --count 40``: a process forks itself for each run, so that nothing is imported twice. A moment is a share of
the wall time, or just before one of the operations on files that the run does (open to write, rename, remove, …), so that files
are caught while they are replaced. Runs on POSIX systems alone.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

import prensa as pr
import prensa.inverse.calibrate
import prensa.output.run
import prensa.output.views
import prensa.study.sweep
from prensa.errors import PrensaError

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
HANGS_AFTER = 600  # s, after which a process that hangs is ended: runs take some seconds, on a busy machine a minute
CHANGES = ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate")
"""Audit events of operations that change files; ``open`` does when it is for writing."""
SAME_BYTES = ("history.csv", "convergence.csv", "passages.csv", "measures.csv", "fields.pvd")


class Subject(NamedTuple):
    """What is killed: ``go`` computes in a folder, or continues what is there; ``doubts`` of what a killed one left; ``same``."""

    go: Callable[[Path], None]
    doubts: Callable[[Path], list[str]]
    kept: Callable[[Path], dict[str, int]]
    """Files of what was computed to its end, with their times: they must not be written again."""
    made: Callable[[Path], dict[str, bytes]]
    """What must be the same bytes as without interruption."""


# ----------------------------------------------------------------------------------------------------------- single runs
def _plain() -> pr.Case:
    """A block pressed with friction, integrated at Gauss points (two contact tables an increment), with a measure."""
    block = pr.Body(pr.Rectangle((2.0, 1.0), (4, 2)), pr.J2(200e3, 0.3, pr.Linear(250, 500)))
    problem = pr.Problem(
        "pressed", {"block": block},
        (
            pr.Step("down", move={"punch": pr.Motion(y=-0.1)}, increments=4),
            pr.Step("up", by={"punch": pr.Motion(y=0.01)}, increments=2),
        ),
        {"punch": pr.Plane(touching="block.top")}, (pr.Contact("block.top", "punch", integration="gauss2"),),
        fixed={"block.bottom": "y", "block.left": "x"}, friction=pr.Coulomb(0.1), measures={"height": "block.height"},
    )  # fmt: skip
    return pr.Case(problem, output=pr.Output(pictures=False, fields=1))


def _remeshing() -> pr.Case:
    """A billet of T6 elements that gets new meshes while it is upset."""
    metal = pr.J2(70e3, 0.33, pr.Swift(K=200.0, e0=0.01, n=0.2))
    problem = pr.Problem(
        "billet", {"b": pr.Body(pr.Rectangle((6.0, 6.0), (6, 6)), metal, "t6")},
        (pr.Step("press", move={"t": pr.Motion(y=-3.0)}, increments=12),), {"t": pr.Plane(touching="b.top")},
        (pr.Contact(("b.top", "b.right"), "t"),), fixed={"b.bottom": "y", "b.left": "x"}, space="axisymmetric",
        remesh=pr.Remesh(pr.Sizes(far=1.0)),
    )  # fmt: skip
    return pr.Case(problem, output=pr.Output(pictures=False, fields=2))


def _run(case: pr.Case) -> Callable[[Path], None]:
    from prensa.output.run import resume, run

    def go(folder: Path) -> None:
        if (folder / "checkpoint.h5").is_file():
            resume(folder, quiet=True)
        else:
            run(case, folder, quiet=True)

    return go


def _seen(folder: Path) -> list[str]:
    """What is wrong with how a run is shown: everything from its first increment on, or a sentence that there is nothing."""
    import matplotlib.pyplot as plt

    from prensa.output.report import write_report

    try:
        result = pr.results(folder)
        n = len(result.increments)
        if not n:
            return [] if "no increment was completed" in str(result) else ["an empty run does not say so"]
        for increment in result.increments:
            if not increment.contacts or not np.isfinite(increment.energy["elastic"]):
                return [f"increment {increment.number} is not whole"]
        for number in result.increments.with_fields:
            result.at(number).bodies  # noqa: B018
        plt.close(result.plot("force_stroke"))
        page = write_report(folder).read_text(encoding="utf-8")
        shown = f"as far as increment {n}" if result.status == "killed" else result.status
        if shown not in page or result.status not in ("killed", "interrupted", "completed"):
            return [f"the report of a run that was {result.status} does not say {shown!r}"]
        return [] if n == 1 or (folder / "checkpoint.h5").is_file() else [f"{n} increments without a checkpoint"]
    except PrensaError as error:
        rows = (folder / "history.csv").read_text().count("\n") if (folder / "history.csv").is_file() else 0
        empty = ("no increment was completed", "there is no summary")
        return [] if rows <= 1 and any(words in str(error) for words in empty) else [f"{rows - 1} increments, and: {error}"]


def _single(case: pr.Case) -> Subject:
    def made(folder: Path) -> dict[str, bytes]:
        found = [folder / name for name in SAME_BYTES if (folder / name).is_file()]
        found += sorted(p for sub in ("contact", "fields") for p in (folder / sub).rglob("*") if p.is_file())
        return {str(p.relative_to(folder)): p.read_bytes() for p in found}

    return Subject(_run(case), _seen, lambda folder: {}, made)


# --------------------------------------------------------------------------------------------------------------- studies
def _times(paths: list[Path], folder: Path) -> dict[str, int]:
    return {str(path.relative_to(folder)): path.stat().st_mtime_ns for path in paths}


def _sweeping() -> Subject:
    case = _plain()

    def go(folder: Path) -> None:
        pr.sweep(case, {"friction.mu": [0.0, 0.1, 0.2]}, ["punch.fy"], out=folder, jobs=1, quiet=True)

    def doubts(folder: Path) -> list[str]:
        with tempfile.TemporaryDirectory() as copies:  # the page of the sweep links reports that are there: none is added to it
            cases = [shutil.copytree(case, Path(copies) / case.name) for case in sorted((folder / "cases").glob("*"))]
            return [text for case in cases for text in _seen(case)]

    def kept(folder: Path) -> dict[str, int]:
        done = [r.parent for r in (folder / "cases").glob("*/case.json")]
        return _times([f / name for f in done for name in ("case.json", "history.csv", "checkpoint.h5")], folder)

    def made(folder: Path) -> dict[str, bytes]:
        return {name: (folder / name).read_bytes() for name in ("table.csv", "index.html")}

    return Subject(go, doubts, kept, made)


def _calibrating() -> Subject:
    problem = _plain().problem

    def go(folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        data = folder.parent / "readings.csv"
        if not data.is_file():
            rows = [(i.time, i.measure("punch.force.y")) for i in pr.solve(problem)]
            data.write_text("time,force\n" + "\n".join(f"{t!r},{1.01 * f!r}" for t, f in rows) + "\n", encoding="utf-8")
        fit = pr.calibrate(
            problem, data, {"force": "punch.force.y"}, {"bodies.block.material.flow.s0": (100.0, 400.0)}, refine=False,
            compare=False, keep=folder / "runs", report=lambda text: None,
        )  # fmt: skip
        (folder / "answer.txt").write_text(repr(fit.parameters), encoding="utf-8")

    def kept(folder: Path) -> dict[str, int]:
        return _times(list((folder / "runs").glob("*.json")), folder)

    def made(folder: Path) -> dict[str, bytes]:
        return {p.name: p.read_bytes() for p in [folder / "answer.txt", *sorted((folder / "runs").glob("*.json"))]}

    return Subject(go, lambda folder: [], kept, made)


SUBJECTS: dict[str, Callable[[], Subject]] = {
    "plain": lambda: _single(_plain()), "remeshing": lambda: _single(_remeshing()), "sweeping": _sweeping,
    "calibrating": _calibrating,
}  # fmt: skip


# --------------------------------------------------------------------------------------------------------------- killing
def _forked(go: Callable[[Path], None], folder: Path, at: int = 0, send: int = 0, after: float = 0.0) -> tuple[int, int]:
    """Run in a process of its own; number of its operations on files in *folder*, and its exit status as of `os.waitpid`.

    A signal is sent before operation *at*, or after seconds *after*; 0: never.
    """
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        os.close(reader)
        count, root = 0, str(folder)

        def audited(event: str, arguments: tuple[object, ...]) -> None:
            nonlocal count
            writes = event == "open" and isinstance(arguments[2], int) and arguments[2] & (os.O_WRONLY | os.O_RDWR)
            if (writes or event in CHANGES) and str(arguments[0]).startswith(root):
                count += 1
                if count == at:
                    os.kill(os.getpid(), send)

        code = 0
        sys.addaudithook(audited)
        signal.alarm(HANGS_AFTER)
        try:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            go(folder)
        except KeyboardInterrupt:
            code = 130
        except BaseException as error:
            os.write(writer, f"{type(error).__name__}: {error}"[:500].encode())
            code = 3
        os.write(writer, f"\n{count}".encode())
        os._exit(code)
    os.close(writer)
    if after:
        time.sleep(after)
        os.kill(child, send)
    with os.fdopen(reader) as file:
        said = file.read()
    _, status = os.waitpid(child, 0)
    if os.WIFEXITED(status) and os.WEXITSTATUS(status) == 3:
        raise RuntimeError(said)
    return int(said.rpartition("\n")[2] or 0), status


class Tally(NamedTuple):
    """Signals of a kind of run: how many by their name, how many before the first increment, and what was wrong."""

    kind: str
    signals: Counter[str]
    empty: int
    wrong: list[str]

    def __str__(self) -> str:
        """One line."""
        sent = ", ".join(f"{n} {name}" for name, n in sorted(self.signals.items()))
        shown = f"{self.empty} of them before the first increment" if self.empty else "all after the first increment"
        return f"{self.kind}: {self.signals.total()} signals ({sent}), {shown}; {len(self.wrong)} wrong"


def judged(kind: str, count: int, seed: int, folder: Path) -> Tally:
    """*count* signals at random moments, and what was wrong, in words with how to have it again."""
    subject, rng, tally = SUBJECTS[kind](), np.random.default_rng(seed), Tally(kind, Counter(), 0, [])
    begun = time.perf_counter()
    operations, _ = _forked(subject.go, folder / "whole")  # nothing is solved here: threads of libraries do not survive a fork
    seconds, whole = time.perf_counter() - begun, subject.made(folder / "whole")
    for k in range(count):
        here, send = folder / f"{k:04d}", int(rng.choice(SIGNALS))
        at, after = int(rng.integers(1, operations + 1)), float(rng.uniform(0.02, 1.0)) * seconds
        at, after = (at, 0.0) if rng.random() < 0.7 else (0, after)
        when = f"before operation {at} of {operations}" if at else f"after {after:.3f} s"
        _, status = _forked(subject.go, here, at, send, after)
        found = ["it hangs after the signal"] if _hung(status) else subject.doubts(here)
        tally = tally._replace(empty=tally.empty + _empty(subject, here))
        found += _continued(subject, here, whole)
        name = signal.Signals(send).name
        tally.signals[name] += 1
        tally.wrong.extend(f"{kind} {k}: {name} {when}: {text}" for text in found)
    return tally


def _continued(subject: Subject, here: Path, whole: dict[str, bytes]) -> list[str]:
    """What is wrong with how what was stopped goes on: nothing twice, and in the end the same bytes as without a stop."""
    kept = subject.kept(here)
    try:
        _, status = _forked(subject.go, here)
    except RuntimeError as error:
        return [f"does not go on: {error}"]
    if status:
        return ["hangs where it goes on" if _hung(status) else f"where it goes on it ends with status {status}"]
    again, made = subject.kept(here), subject.made(here)
    found = [f"{name} was computed again" for name, then in kept.items() if again.get(name) != then]
    return found + [f"{name} differs" for name in sorted(whole.keys() | made.keys()) if whole.get(name) != made.get(name)]


def _empty(subject: Subject, here: Path) -> bool:
    """Whether no increment of a run was completed, and no run of a study."""
    return not subject.kept(here) and all(p.read_text().count("\n") <= 1 for p in here.rglob("history.csv"))


def _hung(status: int) -> bool:
    return os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGALRM


def killed(kinds: Sequence[str], count: int, seed: int, said: Callable[[str], None]) -> list[Tally]:
    """Stop runs of some kinds, all of them if none is named, each *count* times; *said* hears of each kind and each fault."""
    tallies = []
    with tempfile.TemporaryDirectory(prefix="prensa-killed-") as here:
        for kind in kinds or SUBJECTS:
            tallies.append(judged(kind, count, seed, Path(here).resolve() / kind))
            for line in (str(tallies[-1]), *tallies[-1].wrong):
                said(line)
    return tallies
