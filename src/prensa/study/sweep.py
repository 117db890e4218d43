"""A sweep: every case of a plan computed once, whatever happens in between, and put into one table and one page."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from prensa import __version__
from prensa.errors import CaseError, PrensaError, shown, take
from prensa.measures.columns import columns
from prensa.model.plausibility import friction_of_none
from prensa.model.problem import Case, Output, Problem
from prensa.output.files import file_name, write_text
from prensa.output.history import HISTORY
from prensa.output.lock import LOCK, locked
from prensa.output.report import REPORT
from prensa.study.attachments import Attachment, detached
from prensa.study.engine import Engine, engine
from prensa.study.page import write_page
from prensa.study.plan import Plan, Point, Sampling
from prensa.study.progress import StudyProgress
from prensa.study.quantities import Quantity, quantities, series_of, values_of, with_measures
from prensa.study.results import CASES, Row, Study, Timings
from prensa.study.values import Values, factors_of
from prensa.study.work import RECORD, Job, key_of, read_record, unpacked
from prensa.system.checkpoint import CHECKPOINT

REQUEST = "sweep.json"


def sweep(
    case: str | Path | Case | Problem,
    values: Mapping[str, Any],
    measures: str | Iterable[str],
    *,
    samples: int | None = None,
    sampling: Sampling = "sobol",
    seed: int = 0,
    out: str | Path | None = None,
    jobs: int | None = None,
    memory: str | None = None,
    cluster: str | Path | None = None,
    reports: bool = False,
    retry: bool = False,
    quiet: bool = False,
    force: bool = False,
    derivatives: Iterable[str] = (),
) -> Study:
    """Compute a case for many values, each combination once, and collect what is measured.

    Cases that the folder *out* holds already are not computed again: a sweep that was interrupted goes on where it was, in the
    middle of a case too, and one with more values computes what is new. Cases of another version of prensa are computed anew.

    Parameters
    ----------
    case
        A case file, or a case or a problem in Python.
    values
        For each path into the case, such as ``friction.mu``, the values that it takes: a list, a text such as
        ``lin(0, 0.3, 7)`` or ``normal(0.1, 0.01)`` (`prensa.study.values`), or a frozen distribution of scipy.stats. All
        combinations are computed; what scatters has the same samples at each of them.
    measures
        What to take from each case: columns of its history, or ``max(punch.fy)`` and the like (`prensa.study.quantities`).
    samples, sampling, seed
        Number of samples where something scatters (64), ``sobol``, ``lhs`` or ``random``, and the seed.
    out
        Folder of the study (``results/<name>-sweep`` if None).
    jobs, memory
        Processes of one thread on this machine (one a core if None), and the memory of each, such as ``2 GB``.
    cluster
        Address of the scheduler of a Dask cluster, or its scheduler file, in place of local processes.
    reports, retry
        Write fields, pictures and the report of every case, as a run does; compute cases that failed again.
    quiet, force
        Show nothing but what fails; take a folder that holds a study of another case.
    derivatives
        Paths of numbers by which the derivatives of measures are wanted too (`Row.slopes`): each new case is solved once more.

    Raises
    ------
    PrensaError
        If something is asked for that does not exist, before anything is computed.

    """
    _refuse_arguments(values, samples=samples, jobs=jobs)
    plan = Plan(tuple(factors_of(values)), samples, sampling, seed)
    source = Source(case)
    out = Path(out or f"results/{source.stem}-sweep")
    execution = Execution(source, plan, measures, out, reports, quiet, tuple(derivatives))
    return execution.execute(jobs, memory, cluster, retry, force, write_page)


def _refuse_arguments(values: Mapping[str, Any], **counts: int | None) -> None:
    take("sweep", "values", values, Mapping, "give a mapping from paths to values, {'friction.mu': [0, 0.1]}")
    if not values:
        raise PrensaError("nothing to vary; give values with --set, such as --set friction.mu=0,0.05,0.1")
    for name, given in counts.items():
        if given is not None and (not isinstance(given, int) or isinstance(given, bool) or given < 1):
            raise PrensaError(f"sweep: {name} is {shown(given)}; give a whole number of at least 1")


class Source:
    """Where cases come from: a file, or a description in Python. Changes are made before it is validated."""

    def __init__(self, case: str | Path | Case | Problem, changes: Mapping[str, Any] | None = None) -> None:
        from prensa.model.schema import dump

        self._always = Plan(tuple(factors_of(changes or {})))
        if self._always.count != 1:
            raise PrensaError("changes of all cases have one value each; several are for a sweep")

        take("sweep", "case", case, (str, Path, Case, Problem), "give a case file, a Case or a Problem")
        self._path = Path(case) if isinstance(case, str | Path) else None
        self._text = "" if isinstance(case, str | Path) else dump(case)
        self.summary = str(self._path or "")
        self.base = self.changed(())
        self.stem = self._path.stem if self._path else file_name(self.base.problem.name)

    def changed(self, changes: Iterable[str]) -> Case:
        """The case with changes ``path=value``; raises CaseError with what is wrong with it."""
        from prensa.model.schema import load, loads

        changes = [*next(self._always.points()).changes, *changes]
        case = load(self._path, changes) if self._path else loads(self._text, overrides=changes, bounded=False)
        idle = next((change for change in changes if change.partition("=")[0].partition(".")[0] == "friction"), "")
        if idle and (words := friction_of_none(case.problem)):
            raise PrensaError(f"--set {idle}: {words}")  # all cases would be the same
        return case


class Execution:
    """A study from its request to its tables."""

    def __init__(
        self, source: Source, plan: Plan, measures: str | Iterable[str], out: Path, reports: bool, quiet: bool,
        derivatives: tuple[str, ...] = (),
    ) -> None:  # fmt: skip
        self.source, self.plan, self.reports, self.quiet, self.out = source, plan, reports, quiet, out.absolute()
        self.derivatives = derivatives
        first = source.changed(next(plan.points()).changes)
        self.quantities: tuple[Quantity, ...] = quantities(measures, first.problem)
        self.attachments: dict[str, Attachment] = {}
        self.rows = [
            self._row(point) for point in plan.points()
        ]  # the mistakes of every case come before any is computed

    def _row(self, point: Point) -> Row:
        try:
            case = self.source.changed(point.changes)
        except CaseError as error:
            if point.sample is None:
                raise
            remedy = "cut the tails off, normal(mean, sd, low, high), or give another distribution"
            raise PrensaError(f"sample {point.sample}: {error}; {remedy}") from None
        # What is measured or drawn does not change what is computed, but for planes of symmetry, which stop free sides: asking
        # for one more measure finds the finished cases again.
        output = Output(mirror=case.output.mirror)
        key = key_of(self._text(replace(case, problem=replace(case.problem, measures={}), output=output)))
        return Row(point, key, f"{CASES}/{key[:16]}")

    def _text(self, case: Case) -> str:
        """The text of a case without the places of its files, which are noted."""
        from prensa.model.schema import dump

        text, files = detached(dump(case))
        self.attachments |= {one.short: one for one in files}
        return text

    def execute(
        self,
        jobs: int | None,
        memory: str | None,
        cluster: str | Path | None,
        retry: bool,
        force: bool,
        show: Callable[[Study], object],
    ) -> Study:
        """Compute what is missing and write the results; *show* writes the page, also of a study that is interrupted."""
        _refuse_foreign(self.out, self.source.base.problem.name, force)
        with engine(jobs, memory, cluster, tuple(self.attachments.values())) as workers:
            self.out.mkdir(parents=True, exist_ok=True)
            with locked(self.out):
                write_text(self.out / REQUEST, json.dumps(self._request(), indent=1, ensure_ascii=False) + "\n")
                todo = self._missing(retry)
                study = Study(self.out, self.source.base.problem, self.plan, self.quantities, self.rows)
                try:
                    self._compute(todo, workers)
                finally:
                    self._collect()
                    study.write()
                    show(study)
        return study

    def _request(self) -> dict[str, Any]:
        from prensa.model.schema import dump

        return {
            "prensa": __version__,
            "name": self.source.base.problem.name,
            "source": self.source.summary,
            "factors": {f.path: list(f.texts) if isinstance(f, Values) else f.text for f in self.plan.factors},
            "samples": self.plan.number_of_samples if self.plan.scattered else None,
            "sampling": self.plan.sampling,
            "seed": self.plan.seed,
            "measures": [q.text for q in self.quantities],
            "case": dump(self.source.base),
        }

    # ------------------------------------------------------------------------------------------------------- what is new
    def _missing(self, retry: bool) -> list[Row]:
        """One row for each case that is still to be computed; results that do not hold what is asked for are disowned."""
        todo: dict[str, Row] = {}
        for row in self.rows:
            if row.key in todo or self._holds(row, retry):
                continue
            # The record is written last and removed first: a folder without it is unfinished, whatever else it holds.
            (self.out / row.folder / RECORD).unlink(missing_ok=True)
            todo[row.key] = row
        return list(todo.values())

    def _holds(self, row: Row, retry: bool) -> bool:
        folder = self.out / row.folder
        record = read_record(folder, row.key)
        if record is None:
            return False
        # It would fail the same way again, unless somebody changed what is outside of the case.
        if record["status"] == "failed":
            return not retry
        held = {*record["values"], *record["measures"].values(), *columns(self.source.base.problem)}
        measured = all(q.text in held or q.name in held for q in self.quantities)
        return measured and (folder / HISTORY).is_file() and (not self.reports or (folder / REPORT).is_file())

    def _compute(self, todo: list[Row], workers: Engine) -> None:
        by_key = {row.key: row for row in todo}
        claim = (self.out / LOCK).read_text(encoding="utf-8")
        progress = StudyProgress(len(self.rows), len({r.key for r in self.rows}) - len(todo), len(todo), self.quiet)
        with progress, Timings(self.out) as timings:
            progress.say(f"{len(self.rows)} cases, {len(todo)} to compute; {workers.summary}")
            for job, outcome in workers.outcomes(self._jobs(todo, claim)):
                row = by_key[job.key]
                if outcome.files is not None:
                    unpacked(outcome.files, self.out / row.folder)
                if outcome.status == "lost":
                    row.lost = outcome.reason
                timings.append(row, outcome)
                progress.finished(row.point, outcome)

    def _jobs(self, todo: Iterable[Row], claim: str) -> Iterator[Job]:
        """The jobs, each made when it is handed out."""
        for row in todo:
            case = self.source.changed(row.point.changes)
            output = case.output if self.reports else Output(0, False, False, case.output.mirror)
            if self.reports:
                output = replace(output, pictures=True, report=True)
            problem = with_measures(case.problem, self.quantities)
            text = self._text(replace(case, problem=problem, output=output))
            needed = tuple(one for short, one in self.attachments.items() if short in text)
            yield Job(row.key, text, str(self.out / row.folder), self.quantities, needed, claim, self.derivatives)

    def _collect(self) -> None:
        """What the folders of the cases hold, into the rows."""
        lost = {row.key: row.lost for row in self.rows if row.lost}
        for row in self.rows:
            record = read_record(self.out / row.folder, row.key)
            if record is None:
                row.status = "lost" if row.key in lost else "missing"
                row.reason = lost.get(row.key, "not computed yet")
                continue
            row.status, row.reason, row.values = record["status"], record["reason"], record["values"]
            row.measures = record["measures"]
            row.slopes, row.unsloped = record.get("slopes", {}), record.get("unsloped", {})
            missing = [q for q in self.quantities if q.text not in row.values]
            if row.status == "completed" and missing:  # what was not asked for when it was computed
                row.values = row.values | values_of(missing, series_of(self.out / row.folder, row.measures))


def _refuse_foreign(out: Path, name: str, force: bool) -> None:
    """Refuse a folder that is no study's, or that of another case."""
    if out.exists() and not out.is_dir():
        raise PrensaError(f"{out}: this is a file; name a folder for the study")
    if (out / CHECKPOINT).exists() or (out / HISTORY).exists():
        raise PrensaError(f"{out}: this folder holds the results of a run; give another one for the study with --out")
    before: Any = {}
    with suppress(OSError, ValueError):
        before = json.loads((out / REQUEST).read_text(encoding="utf-8"))
    other = before.get("name", name) if isinstance(before, dict) else name
    if other != name and not force:
        message = (
            f"{out}: here is a study of the case {other!r}; give another folder with --out, or --force to take this one"
        )
        raise PrensaError(message)
