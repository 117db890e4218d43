"""Commands on parameters of cases: calibrate, gradient, identify."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from prensa.cli.options import KEPT, CaseFile, Changes, Errors, Fitted, Json, Observed, Quiet, Verbose
from prensa.cli.voice import Source, Voice


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
            source.given, changes or (), data, observe or (), sigma or (), fit or (), along,
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
            source.given, changes or (), observe or (), sigma or (), fit or (), rows
        )
        voice.say(str(found))
        voice.give({
            "parameters": list(found.parameters), "correlation": found.correlation,
            "half_widths": {plan: dict(zip(found.parameters, halves)) for plan, halves in found.plans.items()},
        })  # fmt: skip
