"""The command line, one verb per thought. Everything heavy is imported inside the verb that needs it.

Results go to standard output (``--json``: as one document), everything else to standard error.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
import typer.main
from typer.core import TyperGroup

from prensa.cli import completion
from prensa.cli.voice import BAD_INPUT, FAILED, INTERRUPTED, Source, Voice, near, refuse_unknown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from prensa.model.problem import Problem
    from prensa.output.result import RunResult
    from prensa.study.results import Study
    from prensa.system.system import System

__all__ = ["BAD_INPUT", "FAILED", "INTERRUPTED", "app", "main"]

BENCH = "prensa_bench"  # a distribution that stands on this one, and is found by its name


class _Commands(TyperGroup):
    """The commands of this module, of which `bench` is that of the distribution prensa-bench where it is installed."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name == "bench" and find_spec(BENCH) is not None:
            return typer.main.get_command(import_module(f"{BENCH}.cli").app)
        found = super().get_command(ctx, cmd_name)
        if found is None and cmd_name.endswith((".yaml", ".yml")):
            ctx.fail(f"{cmd_name!r} is no command; did you mean 'prensa run {cmd_name}'?")
        return found

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command of the arguments, of which a change of a value with blanks in it would be taken for two."""
        for option, path, value in zip(args, args[1:], args[2:]):
            blank = "=" not in path or path.endswith("=") or value.startswith("=")
            if option == "--set" and blank and not value.startswith("-") and not value.endswith((".yaml", ".yml")):
                remedy = f"--set {path.strip('=')}={value.strip('=')}"
                typer.echo(f"--set {path} {value}: no blank belongs there; write {remedy}", err=True)
                raise typer.Exit(BAD_INPUT)
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=_Commands,
    help="Frictional contact and metal forming: rigid tools press, slide and roll on deformable workpieces.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

CaseFile = Annotated[
    Path, typer.Argument(metavar="CASE", help="The case, a YAML file; - reads standard input.", show_default=False)
]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.", show_default=False)]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="PATH=VALUE", autocompletion=completion.changes,
        help="Change one value, as in tools.punch.radius=20 or steps.press.increments=40; repeatable.",
    ),
]  # fmt: skip
Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet", "-q", help="Print only warnings, errors and tables; the answer of a run is in its files."
    ),
]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Print the log and the traceback of errors on standard error.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON document, and nothing else.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Processes; one per core if not given.")]
Memory = Annotated[str | None, typer.Option(help="Memory of each process, as in 2GB.")]
Cluster = Annotated[
    str | None, typer.Option(help="Address of the scheduler of a Dask cluster, or its scheduler file.")
]
Retry = Annotated[bool, typer.Option("--retry", help="Compute cases that failed again.")]
Measured = Annotated[
    list[str] | None,
    typer.Option("--measure", help="What to take from every case, as in punch.fy or max(punch.fy); repeatable."),
]
StudyFolder = Annotated[Path | None, typer.Option(help="Folder of the study; results/<case>-<verb> if not given.")]
StudyForce = Annotated[bool, typer.Option("--force", help="Take a folder that holds a study of another case.")]
Observed = Annotated[
    list[str] | None,
    typer.Option("--observe", metavar="COLUMN=MEASURE", help="What a column is, as in force=die.force.y; repeatable."),
]
Errors = Annotated[
    list[str] | None,
    typer.Option(
        "--sigma", metavar="COLUMN=ERROR", help="Error of a column, as in force=2% or bore=0.02; 1 % if not given."
    ),
]
Fitted = Annotated[
    list[str] | None,
    typer.Option("--fit", metavar="PATH[=LOW..HIGH]", help="Parameter, as in friction.mu=0.02..0.5; repeatable."),
]
KEPT = "what is computed is kept; the same command continues"


def main() -> None:
    """The command ``prensa``."""
    try:
        app()
    finally:
        gc.freeze()  # the process ends: a last collection would be wasted


@app.callback(invoke_without_command=True)
def _main(
    version: Annotated[bool, typer.Option("--version", "-V", help="Print the version and exit.")] = False,
) -> None:
    if version:
        from prensa import __version__

        typer.echo(f"prensa {__version__}")
        raise typer.Exit


# ------------------------------------------------------------------------------------------------------------ one case
@app.command()
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
        from prensa.checks.before.preflight import preflight, staircase
        from prensa.cli.describe import lines_of, lines_of_whole, summary_of
        from prensa.model.plausibility import warnings_of
        from prensa.output.whole import mirror_findings

        system = _drawn(problem, picture, voice)
        planes = list(mirror_findings(system, described))
        for line in (*lines_of(system), *lines_of_whole(system, described, planes)):
            voice.confirm(line)
        notices = [*preflight(system), *staircase(system), *planes]
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
        _save_picture(sketch(problem, meshes_of(problem, {})), picture)
        voice.complain(f"{picture} shows the bodies and the names of their sides")
        raise
    _save_picture(sketch(problem, system.meshes, system), picture)
    voice.confirm(f"picture: {picture}")
    return system


def _save_picture(figure: Figure, target: Path) -> None:
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


@app.command()
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


@app.command()
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


# ---------------------------------------------------------------------------------------------------------- many cases
@app.command()
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
            case if source.is_file else source.read(), split_changes(values or ()), measures or (), samples=samples,
            sampling=sampling, seed=seed, out=out, jobs=jobs, memory=memory, cluster=cluster, reports=reports,  # type: ignore[arg-type]
            retry=retry, quiet=voice.no_bar, force=force,
        )  # fmt: skip
        _give_study(study, voice)
    _end_of(study)


@app.command()
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
            case if source.is_file else source.read(), split_changes(values or ()), measures or (), limits or (), out=out,
            jobs=jobs, memory=memory, cluster=cluster, retry=retry, quiet=voice.no_bar, force=force,
        )  # fmt: skip
        for note in study.notes:
            voice.say(note)
        _give_study(study, voice)
    _end_of(study)


@app.command()
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
            case if source.is_file else source.read(), measures or (), mesh=levels_of("mesh", mesh),
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


@app.command()
def calibrate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A calibration file, or a case with options.", show_default=False)],
    data: Annotated[Path | None, typer.Option(help="Table of readings (CSV), names and units in its first row.")] = None,
    observe: Observed = None,
    fit: Fitted = None,
    along: Annotated[
        str | None, typer.Option(help="What the first column is: time, or a motion as in --along=-die.uy; time if not given.")
    ] = None,
    sigma: Errors = None,
    starts: Annotated[int | None, typer.Option(min=1, help="Starting points: the case, and others between the bounds.")] = None,
    refine: Annotated[bool | None, typer.Option("--refine/--no-refine", help="Fit again on a finer mesh, or not.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the result; results/<name>-fit if not given.")] = None,
    changes: Changes = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Fit parameters of a case to measured tables, with confidence intervals and a report page."""
    source = Source(file, changes)
    with Voice(quiet, verbose, json, source=source, interrupted=KEPT) as voice:
        from prensa.inverse.calibrate import calibrate as fit_case
        from prensa.inverse.commands import asked
        from prensa.output.files import file_name

        what = asked(
            file if source.is_file else source.read(), changes or (), data, observe or (), sigma or (), fit or (), along,
            starts, refine,
        )  # fmt: skip
        folder = out or Path("results") / f"{file_name(what.name)}-fit"
        found = fit_case(
            parameters=what.parameters, tests=what.tests, starts=what.starts, seed=what.seed, refine=what.refine,
            compare=what.compare, profiles=what.profiles, keep=folder / "runs", report=voice.remark,
        )  # fmt: skip
        page, written = found.report(folder / "fit.html"), found.write_cases(folder)
        voice.say(str(found))
        for path in (page, *written):
            voice.confirm(str(path))
        parameters = {
            path: {"value": p.value, "low": p.low, "high": p.high, "mesh": p.mesh} for path, p in found.parameters.items()
        }
        voice.give({
            "page": page, "case": written[0], "cases": written, "parameters": parameters, "correlation": found.correlation,
            "reduced_chi_square": found.reduced, "freedom": found.freedom, "runs": found.runs, "words": list(found.words),
        })  # fmt: skip


@app.command()
def gradient(
    case: CaseFile,
    of: Annotated[
        list[str],
        typer.Option("--of", metavar="MEASURE", help="What to differentiate, as in die.force.y; repeatable.", show_default=False),
    ],
    by: Annotated[
        list[str], typer.Option("--by", metavar="PATH", help="Parameter, as in friction.mu; repeatable.", show_default=False)
    ],
    step: Annotated[
        str | None, typer.Option(help="Step at whose end measures are taken, where the run ends; the last one if not given.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a table (CSV) of all increments; parameters are followed through the run then."),
    ] = None,
    changes: Changes = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Differentiate measures by numbers of a case: in one run, whatever their number, or in all increments."""
    source = Source(case, changes)
    with Voice(quiet, verbose, json, source=source) as voice:
        from prensa.errors import PrensaError

        loaded = source.read()
        if out is not None and out.is_dir():
            raise PrensaError(f"--out {out} is a folder; name a file, such as {out / 'gradient.csv'}")
        from prensa.model.plausibility import warnings_of

        for warning in warnings_of(loaded.problem):
            voice.warn(warning)
        from prensa.sensitivity.commands import asked

        with voice.announcing_compilation():
            found = asked(loaded, of, by, step, out is not None, voice.remark)
        voice.say(str(found))
        if out is not None:
            found.write(out)
            voice.confirm(str(out))
        voice.give({**found.summary, "table": out})


@app.command()
def identify(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A calibration file, or a case with options.", show_default=False)],
    observe: Observed = None,
    fit: Annotated[
        list[str] | None, typer.Option("--fit", metavar="PATH", help="Parameter, as in friction.mu; repeatable.")
    ] = None,
    sigma: Errors = None,
    rows: Annotated[
        int | None, typer.Option(min=2, help="Readings of each column, at equal times; 20 if not given.", show_default=False)
    ] = None,
    changes: Changes = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Estimate, before an experiment, how well its readings would determine parameters: one run of each case."""
    source = Source(file, changes)
    with Voice(quiet, verbose, json, source=source) as voice:
        from prensa.inverse.commands import identified

        found = identified(
            file if source.is_file else source.read(), changes or (), observe or (), sigma or (), fit or (), rows
        )
        voice.say(str(found))
        voice.give({
            "parameters": list(found.parameters), "correlation": found.correlation,
            "half_widths": {plan: dict(zip(found.parameters, halves)) for plan, halves in found.plans.items()},
        })  # fmt: skip


# ----------------------------------------------------------------------------------------------------------- materials
@app.command()
def materials(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="METAL", help="Metals to describe in full; without any, the list of all.", autocompletion=completion.metals
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw their flow curves into a file (.png, .svg, .pdf), dashed beyond their tests.")
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """List the metals of 'material: {type: j2, of: METAL}', with source and range, or describe and draw some, or one's own."""
    with Voice(quiet, verbose, json) as voice:
        from prensa.materials.metals import asked
        from prensa.output.metals import flow_curves, lines_of, summary_of

        found = asked(names or ())
        for line in lines_of(found, whole=bool(names)):
            voice.say(line)
        if picture is not None:
            _save_picture(flow_curves(found), picture)
            voice.confirm(f"picture: {picture}")
        voice.give({"metals": summary_of(found), "picture": picture})


@app.command()
def fit(
    table: Annotated[
        Path, typer.Argument(metavar="CSV", help="Plastic strains and true flow stresses, in two columns.", show_default=False)
    ],
    law: Annotated[
        list[str] | None, typer.Option(help="Only this law, as in --law swift; repeatable. All if not given.")
    ] = None,
    to: Annotated[
        float | None, typer.Option(min=0, help="Plastic strain to which the laws are drawn; twice the last one if not given.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="File of the picture (.png, .svg, .pdf); CSV-fit.png next to the table if not given.")
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Fit flow laws to a measured flow curve: constants to paste into a case, residuals, the spread beyond the data."""
    with Voice(quiet, verbose, json) as voice:
        from prensa.inverse.flow_data import read_flow
        from prensa.inverse.flow_laws import FLOW_LAWS, fit_flow
        from prensa.inverse.flow_report import figure_of, lines_of, summary_of

        refuse_unknown(voice, "flow law", law or (), FLOW_LAWS)
        data = read_flow(table)
        fits = fit_flow(data.strain, data.stress, law or ())
        for line in lines_of(str(table), data, fits, to):
            voice.say(line)
        target = picture or table.with_name(f"{table.stem}-fit.png")
        _save_picture(figure_of(data, fits, to), target)
        voice.confirm(f"picture: {target}")
        voice.give({**summary_of(data, fits, to), "picture": target})


# -------------------------------------------------------------------------------------------------- what a run has left
@app.command()
def report(folder: Folder, quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Write report.html of a run again from what its folder holds."""
    with Voice(quiet, verbose, json, folder=folder) as voice:
        from prensa.output.report import write_report

        _results_of(folder, voice)
        page = write_report(folder)
        voice.confirm(str(page))
        voice.give({"report": page})


@app.command()
def plot(
    folder: Folder,
    field: Annotated[
        str,
        typer.Option(
            help="mises, plastic_strain, damage, stress.xx, …, pressure, mesh; force_stroke, energy or convergence.",
            autocompletion=completion.fields,
        ),
    ] = "mises",
    step: Annotated[
        str | None,
        typer.Option(
            help="'last' (if not given), 'largest force', the name of a step, or the number of an increment.",
            autocompletion=completion.moments,
        ),
    ] = None,
    contact: Annotated[
        str | None, typer.Option(help="Contact of a pressure, as block.top-punch, where there are several.")
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(help="In space, from where: iso, front, back, left, right, top, bottom, tool, or two angles as 40,25."),
    ] = None,
    section: Annotated[
        str | None, typer.Option(help="In space: a cut through the middle, x, y or z, or elsewhere, x=2.5.")
    ] = None,
    box: Annotated[str | None, typer.Option(help="Part to show: x from,to,y from,to, in space z from,to.")] = None,
    colours: Annotated[str | None, typer.Option("--range", help="Values of the first and the last colour, as 0,400.")] = None,
    mesh: Annotated[
        bool | None, typer.Option("--mesh/--no-mesh", help="Draw the sides of the elements; if not given, where there is room.")
    ] = None,
    size: Annotated[str | None, typer.Option(help="Width and height in inches, as 6x4.")] = None,
    dpi: Annotated[float | None, typer.Option(help="Pixels per inch.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File of the picture (.png, .svg, .pdf) or film (.gif, .mp4); in DIR if not given."),
    ] = None,
    film: Annotated[
        bool, typer.Option("--film", help="Make a film of the run; .gif unless OUT names another type.")
    ] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Draw a field, a contact or a curve of a run, or make a film of a field."""
    with Voice(quiet, verbose, json, folder=folder) as voice:
        from prensa.cli import drawing

        given = drawing.options(size, dpi, box, colours, mesh, contact, view, section)
        target = drawing.draw(_results_of(folder, voice), field, step, out, film, given)
        voice.confirm(str(target))
        voice.give({"picture": target})


@app.command()
def curve(
    folder: Folder,
    tool: Annotated[str, typer.Option(help="The tool; the one that does the most work if not given.", show_default=False)] = "",
    semicolons: Annotated[
        bool, typer.Option("--semicolons", help="Semicolons between the columns, and decimal commas.")
    ] = False,
    along: Annotated[
        str, typer.Option(metavar="LINE", help="A line of a body instead: 'billet.right', in space 'blank.top at Z=0'.",
                          show_default=False),
    ] = "",
    at: Annotated[
        str, typer.Option(help="Time of the line: 'last', the name of a step, or the number of an increment.",
                          autocompletion=completion.moments),
    ] = "last",
    out: Annotated[Path | None, typer.Option(help="File of the table; curve.csv or profile.csv in DIR if not given.")] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Write the force of a tool against its travel, or coordinates and fields along a line of a body, as a table."""
    with Voice(quiet, verbose, json, folder=folder) as voice:
        from prensa.output.along import LINE_TABLE
        from prensa.output.curve import CURVE

        run = _results_of(folder, voice)
        if along:
            found = run.profile(along, int(at) if at.isdecimal() else at)
            target = found.save(out or folder / LINE_TABLE, semicolons)
            voice.confirm(str(target))
            voice.give({"profile": target, "line": found.line})
            return
        made = run.curve(tool)
        target = made.save(out or folder / CURVE, semicolons)
        voice.confirm(str(target))
        voice.give({"curve": target, "tool": made.tool, "axis": made.axis})


@app.command()
def view(folder: Folder, quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Open the report of a run in the browser."""
    with Voice(quiet, verbose, json, folder=folder) as voice:
        import webbrowser

        page = _results_of(folder, voice).report().resolve()
        voice.confirm(str(page))
        opened = webbrowser.open(page.as_uri())
        if not opened:
            voice.complain("no browser could be started; open that file")
        voice.give({"report": page, "opened": opened})


@app.command()
def die(
    folder: Folder,
    tool: Annotated[str, typer.Option(help="The tool of the run.", show_default=False)],
    thickness: Annotated[float, typer.Option(help="Thickness by which the outline is offset to a section.")] = 0.0,
    mesh: Annotated[
        Path | None, typer.Option(help="A mesh of the die (.msh, .inp), in the coordinates of the case, instead.")
    ] = None,
    span: Annotated[
        str | None, typer.Option(metavar="FROM:TO", help="Part of its outline; the contact and one thickness more if not given.")
    ] = None,
    at: Annotated[
        str | None, typer.Option(
            help="'largest force' (if not given), 'last', the name of a step, or the number of an increment.",
            autocompletion=completion.moments,
        ),
    ] = None,
    modulus: Annotated[float | None, typer.Option("--E", help="Young's modulus of the die; steel if not given.")] = None,
    nu: Annotated[float | None, typer.Option(help="Poisson's ratio of the die; 0.3 if not given.")] = None,
    size: Annotated[float | None, typer.Option(help="Element size at the face; 1/40 of the contact length if not given.")] = None,
    fix: Annotated[
        list[str] | None, typer.Option(metavar="SIDE=xy", help="Supports, as in back=y; repeatable; its back if not given.")
    ] = None,
    back_pressure: Annotated[float, typer.Option(help="Pre-pressure on the back of the die.")] = 0.0,
    ring: Annotated[
        str | None, typer.Option(metavar="THICKNESS:INTERFERENCE", help="A shrink ring around the die, as in 20:0.05.")
    ] = None,
    k: Annotated[float | None, typer.Option("--k", help="Archard's coefficient of wear.")] = None,
    hardness: Annotated[float | None, typer.Option(help="Of the tool, a pressure.")] = None,
    depth: Annotated[float | None, typer.Option(help="Permitted depth of wear.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; die-<tool> in DIR if not given.")] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Load the section of a tool, elastic, with the contact forces of a run; in space map loads and wear over its surface."""
    with Voice(quiet, verbose, json, folder=folder) as voice:
        from prensa.cli import dies

        run = _results_of(folder, voice)
        if run.increments.problem.space == "solid":
            dies.refuse_section({
                "--thickness": thickness, "--mesh": mesh, "--span": span, "--at": at, "--E": modulus,
                "--nu": nu, "--size": size, "--fix": fix, "--back-pressure": back_pressure, "--ring": ring,
            })  # fmt: skip
            from prensa.output.die_folder import write_map

            made, summary = write_map(run, tool, dies.law_of(k, hardness, depth, run, tool), out)
            voice.confirm(str(made))
            voice.give({"folder": made, **summary})
            return
        asked = dies.asked(thickness, modulus, nu, span, size, fix or (), back_pressure, ring, mesh)
        moment: int | str = "largest force" if at is None else int(at) if at.isdecimal() else at
        from prensa.output.die_folder import write_die

        made, summary = write_die(run, tool, asked, moment, dies.law_of(k, hardness, depth, run, tool), out)
        for line in dies.lines_of(summary, run.increments.problem):
            voice.say(line)
        voice.confirm(str(made))
        voice.give({"folder": made, **summary})


def _results_of(folder: Path, voice: Voice) -> RunResult:
    """The results in a folder, which know how to draw themselves; what has not completed is announced."""
    import prensa.output.views  # noqa: F401  (fills in how results are drawn)
    from prensa.output.result import results
    from prensa.output.summary import COMPLETED, progress_of

    run = results(folder)
    if run.status != COMPLETED:
        voice.complain(f"{folder}: {run.status}: {progress_of(run.summary)}")
    return run


# ----------------------------------------------------------------------------------------------------- writing of cases
@app.command()
def new(
    kind: Annotated[
        str,
        typer.Argument(
            help="Kind of case; without it, the list of all kinds.", autocompletion=completion.kinds
        ),
    ] = "",
    out: Annotated[Path | None, typer.Option(help="The file to write; KIND.yaml if not given, - prints it.")] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Write a commented case to start from; without a name, list those that there are."""
    with Voice(quiet, verbose, json) as voice:
        from prensa.errors import PrensaError
        from prensa.output.starters import STARTERS, starter

        if not kind:
            for name, (_, what) in STARTERS.items():
                voice.say(f"{name:<15} {what}")
            voice.give({name: what for name, (_, what) in STARTERS.items()})
            return
        refuse_unknown(voice, "kind of case", [kind], STARTERS)
        text = starter(kind)
        if str(out) == "-":
            typer.echo(text, nl=False)
            return
        target = out or Path(f"{kind}.yaml")
        if target.exists():
            raise PrensaError(f"{target} exists; name another file with --out")
        target.write_text(text, encoding="utf-8")
        voice.confirm(f"{target} written; change it, then: prensa check {target}, prensa run {target}")
        voice.give({"case": target})


@app.command()
def schema(quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Print the JSON schema of case files, with which editors complete and check them."""
    with Voice(quiet, verbose, json=True) as voice:
        from prensa.model.schema import json_schema

        voice.give(json_schema())


@app.command("import")
def import_deck(
    deck: Annotated[
        Path,
        typer.Argument(metavar="DECK", help="An Abaqus or CalculiX deck (.inp), or a STEP file of a body.", show_default=False),
    ],
    out: Annotated[Path | None, typer.Option(help="Write the case, or the mesh, to this file.")] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT",
            help="Leave something out that changes the answer and is not read, such as temperature; may be repeated.",
            show_default=False,
        ),
    ] = None,
    size: Annotated[float | None, typer.Option(help="Largest size of the elements of a STEP file's body, in mm.")] = None,
    around: Annotated[
        float | None,
        typer.Option(
            min=0, help="Elements around a full turn of its curved faces; 12, of hexahedra 24, of an STL tool 36 if not given.",
            show_default=False,
        ),
    ] = None,
    hexahedra: Annotated[bool, typer.Option("--hexahedra", help="Fill it with hexahedra, not with tetrahedra.")] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Write the case that a deck of another program describes, or mesh a STEP file: a body, with a case, or a tool."""
    with Voice(quiet, verbose, json) as voice:
        from prensa.errors import PrensaError
        from prensa.importers.imported import case_text
        from prensa.importers.step import STEP_ENDINGS

        if deck.suffix.lower() in STEP_ENDINGS:
            from prensa.cli.step import mesh_step

            mesh_step(deck, out, size, around, hexahedra, voice)
            return
        if size is not None or around is not None or hexahedra:
            raise PrensaError(f"--size, --around and --hexahedra are of STEP files; {deck} has its elements")
        files: dict[str, str] = {}
        text, remarks = case_text(deck, out.parent if out else Path(), without or (), files if out is not None else None)
        for written in (out, *(out.parent / name for name in files)) if out is not None else ():
            if written.exists():
                raise PrensaError(f"{written} exists; name another file")
        for remark in remarks:
            voice.complain(f"{deck}: {remark}")  # what was passed over changes the answer
        if out is None and not voice.json:
            typer.echo(text, nl=False)
        elif out is not None:
            for name, content in files.items():
                (out.parent / name).write_text(content, encoding="utf-8")
                what = "the deck with its included files" if name.endswith(".inp") else "a tool of rigid elements"
                voice.confirm(f"{out.parent / name} written, {what}")
            out.write_text(text, encoding="utf-8")
            voice.confirm(f"{out} written; read it, add units if they are not mm and N, then: prensa check {out}")
        voice.give({"case": out, "text": text, "remarks": remarks})


# ------------------------------------------------------------------------------------------------- is it right, and fast
@app.command()
def verify(
    only: Annotated[str | None, typer.Option(help="Only the cases whose name contains or matches this.")] = None,
    out: Annotated[Path | None, typer.Option(help="Also write the table to this file, .md or .csv.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Cases computed at the same time, each in a process.")] = 1,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Compute the verification table: every case against its reference."""
    with Voice(quiet, verbose, json) as voice:
        from prensa.verify import table

        code = table.main(only=only, out=str(out) if out else None, jobs=jobs, quiet=voice.quiet, json=voice.json)
    raise typer.Exit(code)


@app.command()
def cite(quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Print how to cite this version of prensa, in BibTeX: year, version and commit, and the paper that it starts from."""
    with Voice(quiet, verbose, json) as voice:
        from prensa.output.cite import works

        made = works()
        voice.say("\n".join(work.bibtex for work in made).rstrip())
        voice.give({work.key: {"type": work.kind, **work.fields} for work in made})


@app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def bench(quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Solve random problems and check every answer, or try to break the reader (needs the distribution prensa-bench)."""
    with Voice(quiet, verbose, json):
        from prensa.errors import PrensaError

        raise PrensaError("prensa bench is in a distribution of its own: in a checkout of prensa, pip install ./quality")


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
