"""The command line, one verb per thought. Everything heavy is imported inside the verb that needs it."""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from prensa.bench.robustness import Outcome, Tally
    from prensa.fem.system import System
    from prensa.model.problem import Step
    from prensa.output.result import RunResult

BAD_INPUT, FAILED, INTERRUPTED = 2, 1, 130

app = typer.Typer(
    help="Frictional contact and metal forming: rigid tools press, slide and roll on deformable workpieces.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

CaseFile = Annotated[Path, typer.Argument(metavar="CASE", help="The case, a YAML file.", show_default=False)]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Change one value, as in tools.punch.radius=20; repeatable."),
]


def main() -> None:
    """The command ``prensa``."""
    try:
        app()
    finally:
        gc.freeze()  # the process ends: a last collection would be wasted


@app.callback(invoke_without_command=True)
def _main(
    version: Annotated[bool, typer.Option("--version", "-V", help="Print the version and leave.")] = False,
) -> None:
    if version:
        from prensa import __version__

        typer.echo(f"prensa {__version__}")
        raise typer.Exit


@app.command()
def check(case: CaseFile, changes: Changes = None) -> None:
    """Validate a case, mesh it and place its tools, or a calibration with its tables; say what would run. Nothing is solved."""
    with _errors_reported(case=case, changes=changes):
        if _calibration_checked(case, changes or ()):
            return
        from prensa.model.schema import load, warnings_of

        problem = load(case, changes or ()).problem
        from prensa.errors import refuse
        from prensa.fem.discretise import discretise
        from prensa.fem.preflight import preflight, staircase

        system = discretise(problem)
        for line in _description_lines(system):
            typer.echo(line)
        notices = [*preflight(system), *staircase(system)]
        for warning in [*warnings_of(problem), *(str(n) for n in notices if not n.fatal)]:
            typer.echo(_with_location(warning, case, changes, "warning: "), err=True)
        refuse(notices)
        from prensa.measures import parse_all, refuse_targets

        parse_all(problem)
        refuse_targets(problem)


def _calibration_checked(path: Path, changes: Iterable[str]) -> bool:
    """Whether a file is a calibration, which is checked then."""
    from prensa.model.schema import has_tests

    if not has_tests(path):
        return False
    from prensa.inverse.commands import lines_of
    from prensa.inverse.files import read_calibration

    for line in lines_of(read_calibration(path, changes)):
        typer.echo(line)
    return True


@app.command()
def run(
    case: CaseFile,
    changes: Changes = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; results/<name of the case file> if not given.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but warnings and errors.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the results of another case in that folder.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print summary.json at the end, and nothing else.")] = False,
) -> None:
    """Run a case and leave its results in a folder."""
    quiet = quiet or json
    folder = out or Path("results") / case.stem
    with _errors_reported(folder, case, changes):
        with _without_garbage_collection():
            from prensa.model.schema import load, warnings_of

            loaded = load(case, changes or ())
            for warning in warnings_of(loaded.problem):
                typer.echo(_with_location(warning, case, changes, "warning: "), err=True)
            from prensa.output.run import run as run_case

        with _announcing_compilation(quiet):
            run_case(loaded, out=folder, quiet=quiet, source=case, force=force)
        if json:
            typer.echo((folder / "summary.json").read_text(encoding="utf-8"), nl=False)


@app.command()
def resume(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of an unfinished run.", show_default=False)],
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but warnings and errors.")] = False,
) -> None:
    """Continue a run from its last checkpoint, bit for bit."""
    with _errors_reported(folder):
        with _without_garbage_collection():
            from prensa.output.run import resume as resume_run

        with _announcing_compilation(quiet):
            resume_run(folder, quiet=quiet)


@app.command()
def sweep(
    case: CaseFile,
    values: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="PATH=VALUES",
            help="Values of one quantity, as in friction.mu=0,0.1 or lin(0,0.3,7), log(…), normal(0.1,0.01); repeatable.",
        ),
    ] = None,
    measures: Annotated[
        list[str] | None,
        typer.Option("--measure", help="What to take from every case, as in punch.fy or max(punch.fy); repeatable."),
    ] = None,
    samples: Annotated[int | None, typer.Option(min=1, help="Samples of what scatters; 64 if not given.")] = None,
    sampling: Annotated[str, typer.Option(help="How they are drawn: sobol, lhs or random.")] = "sobol",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the samples.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder of the sweep; results/<case>-sweep if not given.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; one a core if not given.")] = None,
    memory: Annotated[str | None, typer.Option(help="Memory of each process, as in 2GB.")] = None,
    cluster: Annotated[
        str | None, typer.Option(help="Address of the scheduler of a Dask cluster, or its scheduler file.")
    ] = None,
    reports: Annotated[bool, typer.Option("--reports", help="Write fields, pictures and report of every case.")] = False,
    retry: Annotated[bool, typer.Option("--retry", help="Compute cases that failed again.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but what fails.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Take a folder that holds a sweep of another case.")] = False,
) -> None:  # fmt: skip
    """Compute a case for many values and collect what is measured: a table and a page that compares the cases."""
    with _errors_reported(instead="what is finished is kept; the same command goes on"):
        from prensa.study.sweep import sweep as compute
        from prensa.study.values import split_changes

        study = compute(
            case, split_changes(values or ()), measures or (), samples=samples, sampling=sampling, seed=seed,  # type: ignore[arg-type]
            out=out, jobs=jobs, memory=memory, cluster=cluster, reports=reports, retry=retry, quiet=quiet, force=force,
        )  # fmt: skip
    if not quiet:
        typer.echo(f"{study.summary()}; {_near(study.page)}")
    if not study.status["completed"]:
        raise typer.Exit(FAILED)


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
    starts: Annotated[int | None, typer.Option(min=1, help="Starts: the case, and others that are spread.")] = None,
    refine: Annotated[bool | None, typer.Option("--refine/--no-refine", help="Fit again on a finer mesh, or not.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the result; results/<name>-fit if not given.")] = None,
    changes: Changes = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but the result.")] = False,
) -> None:  # fmt: skip
    """Find the parameters with which a case says what was measured, with intervals and a page to hand in."""
    with _errors_reported(case=file, changes=changes, instead="what is computed is kept; the same command goes on"):
        from prensa.inverse.calibrate import calibrate as fit_case
        from prensa.inverse.commands import asked
        from prensa.output.files import file_name

        what = asked(file, changes or (), data, observe or (), sigma or (), fit or (), along, starts, refine)
        folder = out or Path("results") / f"{file_name(what.name)}-fit"
        found = fit_case(
            parameters=what.parameters, tests=what.tests, starts=what.starts, seed=what.seed, refine=what.refine,
            compare=what.compare, profiles=what.profiles, keep=folder / "runs", told=(lambda line: None) if quiet else typer.echo,
        )  # fmt: skip
        found.report(folder / "fit.html")
        cases = found.write_cases(folder)
    typer.echo("\n".join([str(found), *map(str, [folder / "fit.html", *cases])]))


@app.command()
def identify(
    case: CaseFile,
    observe: Observed = None,
    fit: Annotated[
        list[str] | None, typer.Option("--fit", metavar="PATH", help="Parameter, as in friction.mu; repeatable.")
    ] = None,
    sigma: Errors = None,
    rows: Annotated[int, typer.Option(min=2, help="Readings of each column, at equal times.")] = 20,
    changes: Changes = None,
) -> None:
    """Tell before any experiment what its readings would say about parameters: one run of the case."""
    with _errors_reported(case=case, changes=changes):
        from prensa.inverse.commands import observed
        from prensa.inverse.identify import identify as look
        from prensa.model.schema import load

        found = look(load(case, changes or ()), observed(observe or (), sigma or ()), fit or (), rows)
    typer.echo(str(found))


@app.command()
def converge(
    case: CaseFile,
    measures: Annotated[
        list[str] | None,
        typer.Option("--measure", help="What to take from every case, as in punch.force.y; repeatable."),
    ] = None,
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
    out: Annotated[Path | None, typer.Option(help="Folder of the study; results/<case>-converge if not given.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; one a core if not given.")] = None,
    memory: Annotated[str | None, typer.Option(help="Memory of each process, as in 2GB.")] = None,
    cluster: Annotated[
        str | None, typer.Option(help="Address of the scheduler of a Dask cluster, or its scheduler file.")
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Compute cases that failed again.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but the result and what fails.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Take a folder that holds a study of another case.")] = False,
) -> None:
    """Refine mesh, increments or penalty: observed order, extrapolated value and error band of what is measured."""
    with _errors_reported(instead="what is finished is kept; the same command goes on"):
        from prensa.study.converge import converge as compute
        from prensa.study.values import levels_of, split_changes

        study = compute(
            case, measures or (), mesh=levels_of("mesh", mesh), step=levels_of("step", step),
            penalty=levels_of("penalty", penalty), changes=split_changes(changes or ()), out=out, jobs=jobs,
            memory=memory, cluster=cluster, retry=retry, quiet=quiet, force=force,
        )  # fmt: skip
    typer.echo(str(study))
    if not quiet:
        typer.echo(_near(study.study.page))
    if not study.study.status["completed"]:
        raise typer.Exit(FAILED)


def _near(path: Path) -> str:
    """A path as short as it can be said."""
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.", show_default=False)],
) -> None:
    """Write report.html of a run again from what its folder holds."""
    with _errors_reported(folder):
        from prensa.output.report import write_report

        typer.echo(str(write_report(folder)))


@app.command()
def plot(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.", show_default=False)],
    field: Annotated[
        str,
        typer.Option(help="mises, plastic_strain, stress.xx, …, pressure, mesh; force_stroke, energy or convergence."),
    ] = "mises",
    step: Annotated[
        str, typer.Option(help="'last', 'largest force', the name of a step, or the number of an increment.")
    ] = "last",
    out: Annotated[
        Path | None,
        typer.Option(help="File of the picture (.png, .svg, .pdf) or film (.gif, .mp4); in DIR if not given."),
    ] = None,
    film: Annotated[
        bool, typer.Option("--film", help="A film over the run instead, .gif if OUT says nothing else.")
    ] = False,
) -> None:
    """Draw a field, a contact or a curve of a run, or make a film of a field."""
    with _errors_reported():
        run = _results_of(folder)
        if film or (out is not None and out.suffix in (".gif", ".mp4")):
            target = out or folder / f"{field.replace('.', '_')}.gif"
            run.animate(field, target)
        else:
            target = out or folder / f"{field.replace('.', '_')}.png"
            run.plot(field, at=int(step) if step.isdecimal() else step).savefig(target, bbox_inches="tight")
        typer.echo(str(target))


@app.command()
def view(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.", show_default=False)],
) -> None:
    """Open the report of a run in the browser."""
    with _errors_reported():
        import webbrowser

        page = _results_of(folder).report().resolve()
        typer.echo(str(page))
        if not webbrowser.open(page.as_uri()):
            typer.echo("no browser could be started; open that file", err=True)


@app.command()
def new(
    kind: Annotated[str, typer.Argument(help="What is to be computed; left out, the list of what there is.")] = "",
    out: Annotated[Path | None, typer.Option(help="The file to write; KIND.yaml if not given.")] = None,
) -> None:
    """Write a commented case to start from: a ring test, an upsetting, rolling, drawing, a dome, a bend, a can, Hertz."""
    with _errors_reported():
        from prensa.errors import PrensaError
        from prensa.output.starters import STARTERS, starter

        if not kind:
            for name, (_, what) in STARTERS.items():
                typer.echo(f"{name:<10} {what}")
            return
        _refuse_unknown("kind of case", [kind], STARTERS)
        target = out or Path(f"{kind}.yaml")
        if target.exists():
            raise PrensaError(f"{target} exists; name another file with --out")
        target.write_text(starter(kind), encoding="utf-8")
        typer.echo(f"{target} written; change it, then: prensa check {target}, prensa run {target}")


@app.command()
def schema() -> None:
    """Print the JSON schema of case files, with which editors complete and check them."""
    with _errors_reported():
        import json

        from prensa.model.schema import json_schema

        typer.echo(json.dumps(json_schema(), indent=2))


@app.command("import")
def import_deck(
    deck: Annotated[
        Path, typer.Argument(metavar="DECK", help="An Abaqus or CalculiX deck (.inp).", show_default=False)
    ],
    out: Annotated[Path | None, typer.Option(help="Write the case to this file; printed if not given.")] = None,
) -> None:
    """Write the case that a deck of another program describes: materials, rigid surfaces, contacts, steps."""
    with _errors_reported():
        from prensa.errors import PrensaError
        from prensa.mesh.imported import case_text

        text, remarks = case_text(deck, out.parent if out else Path())
        if out is not None and out.exists():
            raise PrensaError(f"{out} exists; name another file")
        for remark in remarks:
            typer.echo(f"{deck}: {remark}", err=True)
        if out is None:
            typer.echo(text, nl=False)
        else:
            out.write_text(text, encoding="utf-8")
            typer.echo(f"{out} written; read it, add units if they are not mm and N, then: prensa check {out}")


@app.command()
def verify(
    only: Annotated[str | None, typer.Option(help="Only the cases whose name contains or matches this.")] = None,
    out: Annotated[Path | None, typer.Option(help="Also write the table to this file, .md or .csv.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Cases computed at the same time, each in a process.")] = 1,
) -> None:
    """Compute the verification table: every case against its reference."""
    with _errors_reported():
        from prensa.verify import table

        code = table.main(only=only, out=str(out) if out else None, jobs=jobs)
    raise typer.Exit(code)


@app.command()
def bench(
    what: Annotated[str, typer.Argument(help="What to measure: robustness or fuzz.")] = "robustness",
    count: Annotated[int, typer.Option(min=1, help="Number of random problems of each family, or of inputs.")] = 60,
    seed: Annotated[str, typer.Option(help="Seed, a number; 'commit' takes it from the hash of the commit.")] = "0",
    family: Annotated[
        list[str] | None, typer.Option(help="Of robustness, only this family; repeatable. All of them if not given.")
    ] = None,
    first: Annotated[int, typer.Option(min=0, help="Number of the first problem of each family.")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Problems solved at the same time, each in a process.")] = 1,
    report_file: Annotated[
        Path | None, typer.Option("--report", help="Write the outcomes to this file, .csv or .md.")
    ] = None,
    tables: Annotated[
        list[Path] | None,
        typer.Option("--from", help="Solve nothing, take the outcomes from this .csv of an earlier run; repeatable."),
    ] = None,
    enforcement: Annotated[str, typer.Option(help="Of all contacts: penalty, augmented or exact.")] = "penalty",
) -> None:
    """Solve random problems on default settings and check every answer, or try to break the reader with broken inputs."""
    if what not in ("robustness", "fuzz"):
        typer.echo(f"unknown benchmark {what!r}; known: 'robustness', 'fuzz'", err=True)
        raise typer.Exit(BAD_INPUT)
    with _errors_reported():
        from prensa.bench import robustness

        _refuse_unknown("enforcement", [enforcement], robustness.ENFORCEMENTS)
        _refuse_unknown("family", family or (), robustness.known())
        number, commit = robustness.commit_seed() if seed == "commit" else (_seed_number(seed), "")
        names = list(dict.fromkeys(family or robustness.known()))
        if what == "fuzz":
            if family or tables or report_file or first or jobs > 1:
                typer.echo(
                    "--family, --first, --jobs, --from and --report are for 'robustness'; leave them out", err=True
                )
                raise typer.Exit(BAD_INPUT)
            bad = _fuzz(count, number)
        elif tables:
            done = [t for t in robustness.collected(tables) if t.suite in names]
            _written(report_file, done, commit)
            bad = _summed_up(done)
        else:
            done = []
            for name in names:
                follow = _followed(done, report_file, commit)
                done.append(robustness.run(name, count, number, follow, first, enforcement, jobs))
                _summed_up(done[-1:])
            _written(report_file, done, commit)
            bad = any(t.count("wrong") for t in done)
    raise typer.Exit(FAILED if bad else 0)


def _results_of(folder: Path) -> RunResult:
    """The results in a folder, which know how to draw themselves."""
    import prensa.output.views  # noqa: F401  (fills in how results are drawn)
    from prensa.output.result import results

    return results(folder)


def _refuse_unknown(kind: str, names: Iterable[str], known: Iterable[str]) -> None:
    """Leave with a word where a name is not a known one."""
    for name in names:
        if name not in known:
            typer.echo(f"unknown {kind} {name!r}; known: {', '.join(known)}", err=True)
            raise typer.Exit(BAD_INPUT)


def _summed_up(tallies: list[Tally]) -> bool:
    """A line for each family; whether an answer was wrong."""
    from prensa.bench import robustness

    for tally in tallies:
        shares = ", ".join(f"{s} {tally.share(s):.1%}" for s in robustness.VERDICTS)
        low, high = robustness.bounds(tally.count("right"), len(tally.outcomes))
        head = f"{tally.suite}: {len(tally.outcomes)} problems, seed {tally.seed}"
        typer.echo(f"{head}: {shares}; 95 % bounds of right {low:.1%} to {high:.1%}")
    return any(t.count("wrong") for t in tallies)


def _followed(done: list[Tally], report_file: Path | None, commit: str) -> Callable[[Tally, Outcome], None]:
    """What is said and kept of every problem as it is judged: whoever interrupts has all that was solved."""

    def follow(tally: Tally, outcome: Outcome) -> None:
        if outcome.status != "right":
            reason = f" ({outcome.reason})" if outcome.reason else ""
            typer.echo(f"{outcome.status}{reason}: {tally.suite} {outcome.kind}: {outcome.words}")
        _written(report_file, [*done, tally], commit)

    return follow


def _written(report_file: Path | None, tallies: list[Tally], commit: str) -> None:
    from prensa.bench import robustness

    if report_file is not None:
        robustness.write(report_file, tallies, commit)


def _seed_number(seed: str) -> int:
    from prensa.errors import PrensaError

    if not (seed.isascii() and seed.isdigit() and len(seed) < 20):
        raise PrensaError(f"--seed is {seed!r}; it must be a whole number or 'commit'")
    return int(seed)


def _fuzz(count: int, seed: int) -> bool:
    """Whether an input was a defect."""
    from functools import partial

    from prensa.bench import fuzz, fuzz_calls, fuzz_commands

    defects = 0
    for name, source, share in (
        ("files", fuzz.files, 2),
        ("changes", fuzz_calls.overrides, 4),
        ("calls", fuzz_calls.calls, 4),
        ("files and words of commands", partial(fuzz_commands.commands, app), 4),
    ):
        number = max(count // share, 1)
        report = fuzz.run(number, seed, typer.echo, source)
        counts = ", ".join(f"{report.counts[k]} {k}" for k in ("read", "refused", "failed"))
        typer.echo(f"{number} {name}, seed {seed}: {counts}; the slowest took {report.slowest:.2f} s")
        defects += len(report.defects)
    return bool(defects)


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


# ------------------------------------------------------------------------------------------------------------- errors
@contextmanager
def _errors_reported(
    folder: Path | None = None, case: Path | None = None, changes: list[str] | None = None, instead: str = ""
) -> Iterator[None]:
    """Report errors in plain text, with their exit codes.

    *folder*: where an interrupted run left what it has; *case*, *changes*: the file in which to look for places; *instead*:
    what to say of an interruption.
    """
    from prensa.errors import PrensaError

    try:
        yield
    except PrensaError as error:
        typer.echo(_with_location(str(error), case, changes), err=True)
        raise typer.Exit(_code(error)) from None
    except OSError as error:
        typer.echo(f"prensa: {error}", err=True)
        raise typer.Exit(FAILED) from None
    except MemoryError as error:
        typer.echo(f"prensa: out of memory ({error}); use fewer elements", err=True)
        raise typer.Exit(FAILED) from None
    except KeyboardInterrupt:
        typer.echo(f"\ninterrupted; {instead or _left_on_disk(folder)}", err=True)
        raise typer.Exit(INTERRUPTED) from None


def _with_location(message: str, case: Path | None, changes: list[str] | None, kind: str = "") -> str:
    """A message with file, line and column before each of its lines that names a part of the case."""
    if case is None:
        return kind + message
    from prensa.model.schema import located

    text = located(message, case, changes or ())
    return kind + text if text == message else text.replace(message, kind + message)


def _announcing_compilation(quiet: bool) -> AbstractContextManager[None]:
    """A line on the terminal when kernels have to be compiled, unless quiet."""
    from contextlib import nullcontext

    from prensa.kernels.compiling import announced

    return nullcontext() if quiet else announced(lambda line: typer.echo(line, err=True))


def _code(error: Exception) -> int:
    """Exit code: bad input, unless the solver failed."""
    from prensa.errors import SolveError

    return FAILED if isinstance(error, SolveError) else BAD_INPUT


def _left_on_disk(folder: Path | None) -> str:
    """What an interrupted run has left on disk, in words."""
    if folder is None:
        return "nothing was written"
    history = folder / "history.csv"
    if not history.is_file():
        return f"no increment was finished, {folder} holds no results"
    rows = max(history.read_text(errors="replace").count("\n") - 1, 0)
    text = f"{folder} holds {rows} increments" if rows != 1 else f"{folder} holds 1 increment"
    return f"{text}; continue with 'prensa resume {folder}'" if (folder / "checkpoint.h5").is_file() else text


# ------------------------------------------------------------------------------------------------------- what would run
def _description_lines(system: System) -> Iterator[str]:
    """Lines about a discretised problem: bodies, tools in their places, contacts, steps, size."""
    from prensa.mesh.quality import quality
    from prensa.model.schema import brief

    p = system.problem
    geometry = "moved" if p.contact_geometry == "current" else "undeformed"
    yield f"{p.name}: {p.space}, {p.kinematics} deformation, contact on the {geometry} surface"
    yield f"units: {p.units.length}, {p.units.force}"
    for name, body in p.bodies.items():
        mesh = system.meshes[name]
        (x0, y0), (x1, y1) = mesh.points.min(axis=0), mesh.points.max(axis=0)
        yield f"body {name}: {len(mesh.cells)} elements {body.element_in(p.space)}, {len(mesh.points)} nodes"
        yield f"  x {x0:g} … {x1:g}, y {y0:g} … {y1:g}; {brief(body.material)}"
        yield f"  {quality(mesh).line()}"
    if p.start is not None:
        yield f"starts from the run in {p.start.run}"
    for tie in p.ties:
        yield f"tie: {tie.slave} follows {tie.master}"
    for tool in system.tools:
        place = f"reference point at ({tool.at[0]:.6g}, {tool.at[1]:.6g})"
        told = tool.description.told(tool.shape, tool.direction)
        if system.axisymmetric and math.isfinite(tool.shape.period) and abs(tool.at[0]) > 1e-9 * system.length:
            told += ", off the axis: a ring about it (a circle is a torus)"
        yield f"tool {tool.name}: {tool.description.type}, {place}{told}"
    for surface in system.surfaces:
        contact = surface.description
        law = contact.friction or p.friction
        friction = brief(law) if law is not None else "none"
        rule = "" if contact.integration == "nodal" else f" ({contact.integration})"
        points = f"{len(surface.points)} candidate points{rule}"
        yield f"contact {surface.name}: {points}; friction {friction}; {contact.enforcement.type}"
    for number, step in enumerate(p.steps):
        yield f"step {step.name}: time {number} … {number + 1}{_lasting(step)}; {_actions(step)}"
    yield f"{system.ndof} unknowns; nothing was solved"


def _lasting(step: Step) -> str:
    """How long a step lasts, if it says so."""
    from prensa.model.seconds import stated

    seconds = stated(step)
    return "" if seconds is None else f", {seconds:g} s"


def _actions(step: Step) -> str:
    """What a step does, as it is written, and its increments."""
    from prensa.model.schema import brief

    kinds = ("move", "by", "velocity", "crank", "feed", "push", "control", "fixed", "loads", "body_force", "friction", "until")
    acts = [f"{kind} {brief(getattr(step, kind))}" for kind in kinds if getattr(step, kind)]
    many = "" if step.increments == 1 else "s"
    acts.append(f"{step.increments} increment{many}" if step.increments else "increments chosen on the way")
    return ", ".join(acts)
