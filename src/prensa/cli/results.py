"""Commands on what a run has left: report, plot, curve, view, die."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from prensa.cli import completion
from prensa.cli.options import Folder, Json, Quiet, Verbose
from prensa.cli.voice import Voice

if TYPE_CHECKING:
    from prensa.output.result import RunResult


def report(folder: Folder, quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Write report.html of a run again from what its folder holds."""
    with Voice(quiet, verbose, json, folder=folder) as voice:
        from prensa.output.report import write_report

        _results_of(folder, voice)
        page = write_report(folder)
        voice.confirm(str(page))
        voice.give({"report": page})


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
