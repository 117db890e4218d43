"""Arguments and options that several commands take, with their help."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from prensa.cli import completion

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
