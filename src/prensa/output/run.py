"""Run a case and leave everything behind: tables, fields, checkpoint, pictures, report, log, summary.

Whatever ends a run (completion, failure, Ctrl-C, a lost machine), what was written up to then is complete and usable.
"""

from __future__ import annotations

import logging
import time as clocks
from contextlib import closing
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from prensa import __version__
from prensa.analysis import solve
from prensa.checks.after.passages import Passages
from prensa.checks.thresholds import IMBALANCE
from prensa.errors import PrensaError, per_cent, refuse, take, take_path
from prensa.measures import parse_all, refuse_targets
from prensa.model.problem import Case, Problem
from prensa.output import answer, checkpoint, history, measured, passages, pictures, press, report, runlog, summary, vtk
from prensa.output.files import file_name, file_names, flush
from prensa.output.folder import make_room, refuse_links
from prensa.output.interrupt import Interruptible, Terminated
from prensa.output.lock import locked
from prensa.output.progress import ProgressBar
from prensa.output.result import RunResult
from prensa.output.whole import findings
from prensa.precision import ROUND_OFF
from prensa.result.increment import Increment, Progress
from prensa.solver.stability import JUMPED
from prensa.solver.time_stepping import at_rest
from prensa.system.discretise import discretise
from prensa.system.state import State
from prensa.system.system import System
from prensa.timer import Timer

log = logging.getLogger("prensa")

CHECKPOINT_SHARE = 0.05  # of the wall time that checkpoints may take in the middle of a step


def run(
    case: Case | Problem,
    out: str | Path | None = None,
    quiet: bool = False,
    source: str | Path | None = None,
    force: bool = False,
    bar: ProgressBar | None = None,
) -> RunResult:
    """Run *case* and leave its results in the folder *out* (``results/<name>`` if None).

    The stable names of an earlier run of the case in that folder are removed first, everything else there is left alone.

    Parameters
    ----------
    case
        What `prensa.load` returns, or a problem, with default output and numerics.
    out
        Folder of the results, made if needed.
    quiet
        Show nothing but warnings.
    source
        Name of the case file, for the report.
    force
        Replace the results of a case of another name too, and files of these names that no run has left.
    bar
        Where progress and warnings are shown, in place of the terminal.

    Raises
    ------
    PrensaError
        If the case cannot be discretised, another run writes in the folder, or it is not this case's (nothing is touched
        then); if it does not converge (after writing).
    KeyboardInterrupt
        After Ctrl-C, when everything is written; `resume` continues.

    """
    take("run", "case", case, (Case, Problem), "give a Case: what load(file) returns, or Case(problem)")
    case = Case(case) if isinstance(case, Problem) else case
    take("run", "out", out, (str, PathLike, type(None)), "give the path of a folder or None")
    began = clocks.perf_counter()
    _refuse_unwritten(case.problem)
    system = discretise(case.problem)  # a case that cannot run leaves earlier results alone
    refuse(findings(system, case))
    parse_all(case.problem)
    refuse_targets(case.problem)
    directory = Path(out) if out is not None else Path("results") / file_name(case.problem.name)
    if case.problem.start is not None and Path(case.problem.start.run) == directory.resolve():
        raise PrensaError(f"{directory}: the case starts from the run in this folder; give another one for its results")
    if directory.exists() and not directory.is_dir():
        raise PrensaError(f"{directory}: this is a file; name a folder for the results")
    directory.mkdir(parents=True, exist_ok=True)
    with locked(directory):
        before = make_room(directory, case.problem.name, force)
        made = {"discretisation": clocks.perf_counter() - began}
        before_it = {"source": str(source or ""), "timings": made}
        this = _Run(directory, case, system, None, before_it, bar or ProgressBar(quiet))
        if before is not None and before.input_hash != checkpoint.text_hash(this.text):
            this.bar.say(f"{directory}: replaces the results of another input")
        return this.execute()


def resume(directory: str | Path, quiet: bool = False, bar: ProgressBar | None = None) -> RunResult:
    """Continue the run in *directory* from its checkpoint: the files end as if it had never stopped.

    Rows and files later than the checkpoint are removed first. A completed run only has its report made again. ``bar``: as
    of `run`.

    Raises
    ------
    PrensaError
        If there is no usable checkpoint, the tables do not hold what it stands for, or as `run`.

    """
    take("resume", "directory", directory, (str, PathLike), "give the folder of a run")
    directory = take_path("resume", directory)
    summary.refuse_file(directory)
    if not (directory / checkpoint.CHECKPOINT).is_file():
        raise PrensaError(f"{directory / checkpoint.CHECKPOINT}: there is no checkpoint; start with 'prensa run'")
    with locked(directory):
        refuse_links(directory, files=True)
        case, state = checkpoint.read_checkpoint(directory / checkpoint.CHECKPOINT)
        history.refuse_lost_rows(directory, state.clock.number, state.clock.time)
        try:
            before = summary.read_summary(directory)
        except PrensaError:
            before = {}  # it is damaged, and only remembers wall times and warnings
        bar = bar or ProgressBar(quiet, start=state.clock.time)
        return _Run(directory, case, discretise(case.problem), state, before, bar).execute()


# ------------------------------------------------------------------------------------------------------------- details
def _refuse_unwritten(problem: Problem) -> None:
    """Refuse what no file of results knows yet."""
    unnamed = not all(getattr(body.material, "offered", True) for body in problem.bodies.values())
    for there, what in (
        (problem.heat is not None, "temperatures"),
        (unnamed, "materials that case files cannot name"),
    ):
        if there:
            raise PrensaError(f"run: {what} are not written yet; iterate over solve(problem)")


class _Run:
    """A run from its start or resume to its end: opens the writers, solves, closes."""

    def __init__(
        self, directory: Path, case: Case, system: System, start: State | None, before: dict[str, Any], bar: ProgressBar
    ) -> None:
        self.directory, self.case, self.system, self.start, self.earlier = directory, case, system, start, before
        self.text = checkpoint.case_text(case)
        self.timer, self.started = Timer(), clocks.perf_counter()
        self.bar = bar
        self.bar.problem = case.problem
        about = self.earlier.get("warnings_about", {})
        self.warnings = runlog.Warnings(self._known_warnings(), self.bar.warn, about)
        self.stopped: dict[str, str] = dict(self.earlier.get("stopped_by", {}))
        self.guard = Interruptible()
        self.last: Increment | None = None
        self.saved: Increment | None = None
        self.checkpoint_seconds = 0.0
        self.names = file_names(c.name for c in case.problem.all_contacts)
        tables = (history.HISTORY, history.CONVERGENCE, passages.PASSAGES, measured.MEASURES, vtk.COLLECTION)
        self.growing = [directory / name for name in tables]
        self.written: list[Path] = []  # since the last checkpoint

    def _known_warnings(self) -> list[str]:
        """Warnings of the run before the resume and of the description, which the caller has shown already."""
        from prensa.model.schema import warnings_of

        return list(dict.fromkeys([*self.earlier.get("warnings", []), *warnings_of(self.case.problem)]))

    def execute(self) -> RunResult:
        """Solve to the end; log, summary and report are written however the run ends."""
        with runlog.logging_to(self.directory, self.warnings), self.guard:
            status, reason = "completed", ""
            try:
                self._solve_and_write()
            except KeyboardInterrupt as stop:
                by = "SIGTERM" if isinstance(stop, Terminated) else "the user"
                status, reason = "interrupted", f"stopped by {by}; 'prensa resume' continues from the checkpoint"
                raise
            except PrensaError as error:
                status, reason = "failed", str(error)
                raise
            except BaseException as error:
                status, reason = "failed", f"{type(error).__name__}: {error}"
                log.exception("unexpected error")
                raise
            finally:
                with self.guard.postponed():
                    made = self._finish(status, reason)
        return RunResult(self.directory, status, self.last, made)

    def _solve_and_write(self) -> None:
        """Open the writers, new or continued, and solve."""
        log.info("prensa %s, case %r, input %s", __version__, self.case.problem.name, checkpoint.text_hash(self.text))
        keep, self.passed = None, Passages(self.system)
        if self.start is not None:
            keep = self.start.clock.number
            self.passed = passages.restored(self.directory, self.system, self.start.clock)
            log.info("resumed after increment %d, time %.6g", keep, self.start.clock.time)
        with (
            closing(history.History(self.directory, self.case.problem, keep)) as self.tables,
            closing(passages.PassageTable(self.directory, self.passed, keep)) as self.means,
            closing(measured.MeasureTable(self.directory, self.case.problem, keep)) as self.measures,
        ):
            if keep is not None:
                history.forget_contacts_after(self.directory, keep)  # now that no row refers to them
            self.fields = vtk.Fields(self.directory, keep, self.case.problem, self.case.output.points)
            self._summarise(summary.RUNNING, "", durable=False)  # of a run that is killed there is no other
            self.written.append(self.directory / summary.SUMMARY)
            self._solve_increments()

    def _solve_increments(self) -> None:
        """Solve, and write every increment."""

        def monitor(progress: Progress) -> None:
            runlog.log_progress(progress)
            self.bar(progress)

        with self.bar:
            numerics = self.case.numerics
            for increment in solve(self.system, numerics, self.start, monitor, self.timer, passages=self.passed):
                with self.guard.postponed():
                    self._write(increment)

    def _write(self, increment: Increment) -> None:
        """Everything about one increment, the checkpoint last: what it stands for is then already on the disk."""
        runlog.log_increment(increment)
        with self.timer("recovery"):
            contacts = increment.contacts
        with self.timer("tables"):
            for name, contact in ((n, c) for n, c in contacts.items() if n in self.names):
                path = history.write_contact(self.directory, self.names[name], increment.number, contact)
                self.written += [path, history.of_points(path)]
            self.tables.append(increment)
            self.means.append(increment)
            self.measures.append(increment)
        every = self.case.output.fields
        if increment.end_of_step or (every and increment.number % every == 0):
            with self.timer("recovery"):
                increment.bodies  # noqa: B018  (computed when first asked for)
            with self.timer("fields"):
                self.written.append(self.fields.append(increment))
        if increment.stopped:
            self.stopped[increment.step] = increment.stopped
        self.last = increment
        if increment.end_of_step and increment.step == self.case.problem.steps[-1].name and not self.bar.quiet:
            self.warnings.held = []  # the last lines say them
        if increment.end_of_step or self.checkpoint_seconds <= CHECKPOINT_SHARE * (
            clocks.perf_counter() - self.started
        ):
            self._save(increment)

    def _save(self, increment: Increment) -> None:
        """Write the checkpoint, after everything that it stands for has reached the disk."""
        begun = clocks.perf_counter()
        with self.timer("checkpoint"):
            flush([*self.growing, *self.written], self.directory)
            self.written.clear()
            checkpoint.write_checkpoint(self.directory / checkpoint.CHECKPOINT, self.text, increment.state)
        self.checkpoint_seconds += clocks.perf_counter() - begun
        self.saved = increment

    def _finish(self, status: str, reason: str) -> dict[str, Any]:
        """Last checkpoint, summary, pictures and report; the log ends with the wall times."""
        log.log(logging.ERROR if status == "failed" else logging.INFO, "%s %s", status, reason)
        if not hasattr(self, "fields"):
            return {}  # the writers could not be opened: there is nothing to summarise
        if self.last is not None and self.saved is not self.last:
            self._save(self.last)
        if status != "interrupted":  # a warning of a part would stay when the run is continued
            self._check_energy()
        (self.directory / report.REPORT).unlink(missing_ok=True)  # one made on the way shows less than there is
        made = self._summarise(status, reason)  # before the pictures: they may take long
        if self.case.output.pictures:
            self.bar.say(f"{self.directory}: drawing pictures")
            with self.timer("pictures"):
                stored = report.stored_run(self.directory)
                for message in pictures.write_pictures(self.directory, self.case, stored, self._start_to_draw(status)):
                    log.warning("%s", message, extra={"about": "files"})
            made = self._summarise(status, reason)
        if self.case.output.report:
            with self.timer("report"):
                report.write_report(self.directory)
        log.info("%s", "\n".join(made["answer"]))
        log.info("wall time by section\n%s", runlog.wall_times(self._timings()))
        self._say_answer(made)
        return made

    def _say_answer(self, made: dict[str, Any]) -> None:
        """The last lines on the terminal; a failure itself is said where the error is caught."""
        status, reason = made["status"], made["reason"]
        said = f"{status}: {made['totals']['increments']} increments, {self.directory}"
        all_of_them = answer.weighed(made["warnings"], made["warnings_about"])
        known = [text for text in all_of_them if not (reason and text.endswith(reason))]
        known_in_short = answer.in_short(known, self.warnings.held or ())
        lines = [line for line in made["answer"] if line != status]
        self.bar.say("\n".join([said, *known_in_short, *lines]))  # at once: in a notebook each replaces the one before

    def _start_to_draw(self, status: str) -> Increment | None:
        """The initial state, to draw where the first increment failed."""
        return at_rest(self.system) if status == "failed" and self.last is None and self.start is None else None

    def _check_energy(self) -> None:
        table = history.read_history(self.directory)
        largest = max(float(np.abs(table[f"energy.{e}"]).max(initial=0.0)) for e in history.ENERGIES[:-1])
        missing = float(np.abs(table["energy.imbalance"]).max(initial=0.0))
        nothing = self.system.stiffness * self.system.length * ROUND_OFF**2  # of strains that are round-off
        if missing > max(IMBALANCE * largest, nothing):
            share = missing / largest if largest else 1.0
            jumped = any(JUMPED in text for text in self.warnings.texts)
            remedy = "what jumps set free is part of it" if jumped else "smaller increments reduce it"
            log.warning("energy balance off by %s of the largest energy; %s", per_cent(share), remedy)
        for blow in press.blows(table, self.case.problem):
            if abs(blow.missing) > IMBALANCE * blow.gave:
                share = abs(blow.missing) / blow.gave
                words = "energy balance of step %r off by %s of what its blow gave; smaller increments reduce it"
                log.warning(words, blow.step, per_cent(share))

    def _timings(self) -> dict[str, float]:
        """Wall seconds by section, added up over resumes; what no section claims is ``other``."""
        here = dict(self.timer.seconds)
        here["other"] = max(clocks.perf_counter() - self.started - sum(here.values()), 0.0)
        before = self.earlier.get("timings", {})
        return {
            k: float(before.get(k, 0.0)) + here.get(k, 0.0) for k in [*before, *(k for k in here if k not in before)]
        }

    def _summarise(self, status: str, reason: str, durable: bool = True) -> dict[str, Any]:
        """Write ``summary.json``; returns its content."""
        state = self.last.state if self.last is not None else self.start
        made = summary.summarise(
            self.directory, self.system, self.case, state, status=status, reason=reason, text=self.text,
            source=self.earlier.get("source", ""), timings=self._timings(), warnings=self.warnings.texts,
            about=self.warnings.about, stopped_by=self.stopped,
        )  # fmt: skip
        summary.write_summary(self.directory, made, durable)
        return made
