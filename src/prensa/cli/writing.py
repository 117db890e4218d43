"""Commands that write cases, or what editors read of them: new, schema, import."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from prensa.cli import completion
from prensa.cli.options import Json, Quiet, Verbose
from prensa.cli.voice import Voice, refuse_unknown


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


def schema(quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Print the JSON schema of case files, with which editors complete and check them."""
    with Voice(quiet, verbose, json=True) as voice:
        from prensa.model.schema import json_schema

        voice.give(json_schema())


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
