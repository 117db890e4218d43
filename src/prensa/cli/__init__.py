"""The command line, one command per task, in files by subject. Everything heavy is imported inside the command that needs it.

Results go to standard output (``--json``: as one document), everything else to standard error.
"""

from __future__ import annotations

import gc
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.main
from typer.core import TyperGroup

from prensa.cli.metals import fit, materials
from prensa.cli.one_case import check, resume, run
from prensa.cli.options import Json, Quiet, Verbose
from prensa.cli.parameters import calibrate, gradient, identify
from prensa.cli.results import curve, die, plot, report, view
from prensa.cli.studies import converge, sweep, window
from prensa.cli.voice import BAD_INPUT, FAILED, INTERRUPTED, Voice
from prensa.cli.writing import import_deck, new, schema

__all__ = ["BAD_INPUT", "FAILED", "INTERRUPTED", "Json", "Quiet", "Verbose", "app", "main"]

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


for _command in (
    check, run, resume, sweep, window, converge, calibrate, gradient, identify, materials, fit, report, plot, curve, view, die,
    new, schema,
):  # fmt: skip
    app.command()(_command)
app.command("import")(import_deck)


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
