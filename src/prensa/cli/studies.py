"""Commands on many cases: sweep, window, converge."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from prensa.cli import completion
from prensa.cli.options import (
    KEPT,
    CaseFile,
    Changes,
    Cluster,
    Jobs,
    Json,
    Measured,
    Memory,
    Quiet,
    Retry,
    StudyFolder,
    StudyForce,
    Verbose,
)  # fmt: skip
from prensa.cli.voice import FAILED, Source, Voice, near

if TYPE_CHECKING:
    from prensa.study.results import Study


def sweep(
    case: CaseFile,
    values: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="PATH=VALUES", autocompletion=completion.changes,
            help="Values of one quantity, as in friction.mu=0,0.1 or lin(0,0.3,7), log(…), normal(0.1,0.01); repeatable.",
        ),
    ] = None,
    measures: Measured = None,
    samples: Annotated[int | None, typer.Option(min=1, help="Samples of scattered quantities; 64 if not given.")] = None,
    sampling: Annotated[str, typer.Option(help="Sampling method: sobol, lhs or random.")] = "sobol",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the samples.")] = 0,
    out: StudyFolder = None,
    jobs: Jobs = None,
    memory: Memory = None,
    cluster: Cluster = None,
    reports: Annotated[bool, typer.Option("--reports", help="Write fields, pictures and report of every case.")] = False,
    retry: Retry = False,
    force: StudyForce = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Compute a case for many values and collect what is measured: a table and a page that compares the cases."""
    source = Source(case)
    with Voice(quiet, verbose, json, interrupted=KEPT) as voice:
        from prensa.study.sweep import sweep as compute
        from prensa.study.values import split_changes

        study = compute(
            source.given, split_changes(values or ()), measures or (), samples=samples,
            sampling=sampling, seed=seed, out=out, jobs=jobs, memory=memory, cluster=cluster, reports=reports,  # type: ignore[arg-type]
            retry=retry, quiet=voice.no_bar, force=force,
        )  # fmt: skip
        _give_study(study, voice)
    _end_of(study)


def window(
    case: CaseFile,
    values: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="PATH=LOW:HIGH:N", autocompletion=completion.changes,
            help="Range of a parameter, as in friction.mu=0.05:0.3:6; give two, and single values of others.",
        ),
    ] = None,
    measures: Measured = None,
    limits: Annotated[
        list[str] | None,
        typer.Option("--limit", metavar="LIMIT", help="Limit to be kept, as in 'max(punch.fy)<=400e3'; repeatable."),
    ] = None,
    out: StudyFolder = None,
    jobs: Jobs = None,
    memory: Memory = None,
    cluster: Cluster = None,
    retry: Retry = False,
    force: StudyForce = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Map measures over two parameters, with their limits; every run has the command that repeats it."""
    source = Source(case)
    with Voice(quiet, verbose, json, interrupted=KEPT) as voice:
        from prensa.study.values import split_changes
        from prensa.study.window import window as compute

        study = compute(
            source.given, split_changes(values or ()), measures or (), limits or (), out=out,
            jobs=jobs, memory=memory, cluster=cluster, retry=retry, quiet=voice.no_bar, force=force,
        )  # fmt: skip
        for note in study.notes:
            voice.say(note)
        _give_study(study, voice)
    _end_of(study)


def converge(
    case: CaseFile,
    measures: Measured = None,
    mesh: Annotated[
        str | None,
        typer.Option(metavar="LEVELS", help="Factors of the numbers of elements, as in 0.25,0.5,1,2, or auto."),
    ] = None,
    step: Annotated[
        str | None, typer.Option(metavar="LEVELS", help="Factors of the numbers of increments, or auto.")
    ] = None,
    penalty: Annotated[
        str | None, typer.Option(metavar="LEVELS", help="Factors of the stiffness of contact, or auto.")
    ] = None,
    changes: Changes = None,
    out: StudyFolder = None,
    jobs: Jobs = None,
    memory: Memory = None,
    cluster: Cluster = None,
    retry: Retry = False,
    force: StudyForce = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Refine mesh, increments or penalty: observed order, extrapolated value and error band of what is measured."""
    source = Source(case)
    with Voice(quiet, verbose, json, interrupted=KEPT) as voice:
        from prensa.study.converge import converge as compute
        from prensa.study.values import levels_of, split_changes

        study = compute(
            source.given, measures or (), mesh=levels_of("mesh", mesh),
            step=levels_of("step", step), penalty=levels_of("penalty", penalty), changes=split_changes(changes or ()),
            out=out, jobs=jobs, memory=memory, cluster=cluster, retry=retry, quiet=voice.no_bar, force=force,
        )  # fmt: skip
        voice.say(str(study))
        voice.confirm(near(study.study.page))
        if voice.json:
            from dataclasses import asdict

            found = [{"kind": f.kind, "measure": f.quantity.text, **asdict(f.convergence)} for f in study.findings]
            voice.give({**_table(study.study), "findings": found})
    _end_of(study.study)


def _give_study(study: Study, voice: Voice) -> None:
    """Say how the cases of a study ended, and where it is."""
    voice.confirm(f"{study.summary()}; {near(study.page)}")
    voice.give(_table(study))


def _end_of(study: Study) -> None:
    """End with the exit code of a failure where no case has completed."""
    if not study.status["completed"]:
        raise typer.Exit(FAILED)


def _table(study: Study) -> dict[str, Any]:
    """A study as data: where it is, how its cases ended, and a row for each."""
    rows = [dict(zip(study.columns, cells)) for cells in study.cells()]
    return {"folder": study.directory, "page": study.page, "status": dict(study.status), "cases": rows}
