"""Commands on one case: check, run, resume."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from prensa.cli.options import CaseFile, Changes, Json, Quiet, Verbose
from prensa.cli.voice import Source, Voice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from prensa.model.problem import Problem
    from prensa.system.system import System


def check(
    case: CaseFile,
    changes: Changes = None,
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw bodies with the names of their sides, and the tools, into a file (.png, .svg, .pdf)."),
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Validate a case, mesh it and place its tools, or a calibration with its tables; say what would run. Nothing is solved."""
    source = Source(case, changes)
    with Voice(quiet, verbose, json, source=source) as voice:
        from prensa.errors import PrensaError, refuse
        from prensa.model.schema import has_tests

        if source.is_file and has_tests(case):
            from prensa.inverse.commands import lines_of as lines_of_calibration
            from prensa.inverse.commands import summary_of as summary_of_calibration
            from prensa.inverse.files import read_calibration

            if picture is not None:
                raise PrensaError("a calibration has no picture; give '--picture' with the case that it fits")
            calibration = read_calibration(case, changes or ())
            for line in lines_of_calibration(calibration):
                voice.confirm(line)
            voice.give(summary_of_calibration(calibration))
            return

        described = source.read()
        problem = described.problem
        from prensa.checks.before.preflight import staircase
        from prensa.cli.describe import lines_of, lines_of_whole, summary_of
        from prensa.model.plausibility import warnings_of
        from prensa.output.whole import findings

        system = _drawn(problem, picture, voice)
        notices = [*findings(system, described), *staircase(system)]
        for line in (*lines_of(system), *(() if any(n.fatal for n in notices) else lines_of_whole(system, described))):
            voice.confirm(line)
        warnings = [*warnings_of(problem), *(str(n) for n in notices if not n.fatal)]
        for warning in warnings:
            voice.warn(warning)
        refuse(notices)
        from prensa.measures import parse_all, refuse_targets

        parse_all(problem)
        refuse_targets(problem)
        takes = {}
        if problem.space == "solid":
            from prensa.output.estimate import estimate

            found = estimate(system, described.numerics, described.output)
            takes = {"estimate": found.summary()}
            for line in found.lines():
                voice.confirm(line)
        voice.give({**summary_of(system), **takes, "warnings": warnings, "picture": picture})


def _drawn(problem: Problem, picture: Path | None, voice: Voice) -> System:
    """The discretised problem; a picture of it, or of its bodies alone where a side that is named does not exist."""
    from prensa.errors import PrensaError
    from prensa.system.discretise import discretise, meshes_of

    if picture is None:
        return discretise(problem)
    from prensa.output.sketch import sketch

    try:
        system = discretise(problem)
    except PrensaError:
        save_picture(sketch(problem, meshes_of(problem, {})), picture)
        voice.complain(f"{picture} shows the bodies and the names of their sides")
        raise
    save_picture(sketch(problem, system.meshes, system), picture)
    voice.confirm(f"picture: {picture}")
    return system


def save_picture(figure: Figure, target: Path) -> None:
    """Write a figure to a file whose ending says its kind; without one it is a .png."""
    from prensa.errors import PrensaError
    from prensa.output.plot import save

    kinds = figure.canvas.get_supported_filetypes()
    if target.suffix and target.suffix[1:].lower() not in kinds:
        endings = ", ".join(f".{kind}" for kind in kinds)
        raise PrensaError(f"{target}: no picture ends in {target.suffix!r}; give one of {endings}")
    try:
        save(figure, target)
    except OSError as error:
        raise PrensaError(f"{target} cannot be written: {error.strerror}") from None


def run(
    case: CaseFile,
    changes: Changes = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/<name of the case file> if not given.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the results of another case in that folder.")] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Run a case and leave its results in a folder."""
    source = Source(case, changes)
    with Voice(quiet, verbose, json, source=source, folder=out) as voice:
        with _without_garbage_collection():
            loaded = source.read()
            voice.folder = folder = out or source.folder()
            from prensa.model.plausibility import warnings_of

            for warning in warnings_of(loaded.problem):
                voice.warn(warning)
            from prensa.output.progress import ProgressBar
            from prensa.output.run import run as run_case

        bar = ProgressBar(voice.no_bar)
        bar.warned = voice.warned
        with voice.announcing_compilation():
            run_case(loaded, out=folder, source=_shown_as(source), force=force, bar=bar)
        _give_summary(voice, folder)


def resume(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of an unfinished run.", show_default=False)],
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Continue a run from its last checkpoint, bit for bit."""
    with Voice(quiet, verbose, json, folder=folder) as voice:
        with _without_garbage_collection():
            from prensa.output.run import resume as resume_run

        with voice.announcing_compilation():
            resume_run(folder, quiet=voice.no_bar)
        _give_summary(voice, folder)


def _shown_as(source: Source) -> Path | str:
    """How the report names where a case came from."""
    return source.path if source.is_file else "standard input"


def _give_summary(voice: Voice, folder: Path) -> None:
    if voice.json:
        from prensa.output.report import read_summary

        voice.give({"folder": folder, **read_summary(folder)})


@contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """Keep what is imported or built inside out of garbage collection: it lives to the end of the command.

    Collections while modules load would take a tenth of the time to the first iteration.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
