"""Commands on metals and their flow curves: materials, fit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from prensa.cli import completion
from prensa.cli.one_case import save_picture
from prensa.cli.options import Json, Quiet, Verbose
from prensa.cli.voice import Voice, refuse_unknown


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
            save_picture(flow_curves(found), picture)
            voice.confirm(f"picture: {picture}")
        voice.give({"metals": summary_of(found), "picture": picture})


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
        save_picture(figure_of(data, fits, to), target)
        voice.confirm(f"picture: {target}")
        voice.give({**summary_of(data, fits, to), "picture": target})
