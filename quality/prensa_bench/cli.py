"""The command ``prensa bench``, which `prensa` finds where this distribution is installed. It imports nothing heavy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from prensa.cli import BAD_INPUT, FAILED, Json, Quiet, Verbose
from prensa.cli import app as commands
from prensa.cli.voice import Voice, refuse_unknown

app = typer.Typer(
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    add_completion=False,
)
BENCHMARKS = ("robustness", "fuzz", "killed")


def _completed(incomplete: str) -> list[str]:
    """What can be measured, for the shell that completes a word."""
    return [name for name in BENCHMARKS if name.startswith(incomplete)]


@app.command()
def bench(
    what: Annotated[
        str, typer.Argument(help="What to measure: robustness, fuzz or killed.", autocompletion=_completed)
    ] = "robustness",
    count: Annotated[
        int, typer.Option(min=1, help="Number of random problems of each family, of inputs, or of signals to a kind of run.")
    ] = 60,
    seed: Annotated[str, typer.Option(help="Seed, a number; 'commit' takes it from the hash of the commit.")] = "0",
    family: Annotated[
        list[str] | None, typer.Option(help="Only this family, of killed this kind of run; repeatable. All if not given.")
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
    enforcement: Annotated[str, typer.Option(help="Of all contacts: penalty, augmented, exact or as drawn.")] = "drawn",
    derivatives: Annotated[
        bool, typer.Option("--derivatives", help="Judge derivatives by random numbers of the problems, not the answers.")
    ] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Solve random problems on default settings and check every answer, break the reader with broken inputs, or kill runs."""
    with Voice(quiet, verbose, json) as voice:
        refuse_unknown(voice, "benchmark", [what], BENCHMARKS)
        from prensa_bench.benches import fuzz, killed, robustness

        of_problems = tables or report_file or first or jobs > 1 or derivatives
        if what == "robustness":
            bad = robustness(voice, count, seed, family or (), first, jobs, report_file, tables or (), enforcement, derivatives)
        elif of_problems or (family and what == "fuzz"):
            only = "--family, --first" if what == "fuzz" else "--first"
            voice.complain(f"{only}, --jobs, --from, --report and --derivatives are for 'robustness'; leave them out")
            raise typer.Exit(BAD_INPUT)
        elif what == "fuzz":
            bad = fuzz(voice, commands, count, seed)
        else:
            bad = killed(voice, count, seed, family or ())
    raise typer.Exit(FAILED if bad else 0)
