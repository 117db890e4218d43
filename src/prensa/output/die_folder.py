"""The folder that ``prensa die`` leaves beside the files of a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from prensa.dies.stress import Die
from prensa.dies.wear import wear, wear_summary
from prensa.errors import PrensaError
from prensa.friction.wear_law import WearLaw
from prensa.output import plot
from prensa.output.dies import (
    DIE_SUMMARY,
    FOLDER,
    MAP_SUMMARY,
    face_columns,
    figures,
    summary_of,
    write_columns,
    write_loads,
)
from prensa.output.files import file_name, replacing, write_text
from prensa.output.result import RunResult
from prensa.output.vtk import write_fields


def write_die(
    run: RunResult, tool: str, die: Die, at: int | str, law: WearLaw, out: Path | None = None
) -> tuple[Path, dict[str, Any]]:
    """Compute the stresses of a die and leave them, the tool's loads and wear in a folder; returns it and the summary.

    Raises
    ------
    PrensaError
        As of `RunResult.die`, or if the folder cannot be made.

    """
    problem = run.increments.problem
    found = run.die(tool, die, at)
    loads = run.loads(tool)
    folder = _folder(run, tool, out)
    worn = wear(loads, law=law)
    write_loads(folder / "loads.csv", worn)
    write_columns(folder / "face.csv", face_columns(found))
    write_fields(folder / "die.vtu", found.increment)
    for name, figure in figures(found, worn, problem):
        with replacing(folder / f"{name}.png") as temporary:
            plot.save(figure, temporary, format="png")
    made = {**summary_of(found), "wear": wear_summary(worn)}
    write_text(folder / DIE_SUMMARY, json.dumps(made, indent=1) + "\n")
    return folder, made


def write_map(run: RunResult, tool: str, law: WearLaw, out: Path | None = None) -> tuple[Path, dict[str, Any]]:
    """Leave the loads and the wear of a tool in space over its surface in a folder; returns it and the summary.

    Raises
    ------
    PrensaError
        As of `RunResult.tool_map`, or if the folder cannot be made.

    """
    found = run.tool_map(tool, law)
    folder = _folder(run, tool, out)
    for kind in ("csv", "vtu"):
        found.save(folder / f"map.{kind}")
    made = {"tool": tool, "relative": law.relative} | found.summary
    if law.depth is not None:
        deepest = float(found.wear.max())
        made |= {"permitted": law.depth, "parts": law.depth / deepest if deepest > 0.0 else None}
    write_text(folder / MAP_SUMMARY, json.dumps(made, indent=1) + "\n")
    return folder, made


def _folder(run: RunResult, tool: str, out: Path | None) -> Path:
    """The folder for what is known of a tool, made where there is none.

    Raises
    ------
    PrensaError
        If it is a file.

    """
    folder = out or run.directory / f"{FOLDER}{file_name(tool)}"
    if folder.exists() and not folder.is_dir():
        raise PrensaError(f"{folder}: this is a file; name a folder for the die")
    folder.mkdir(parents=True, exist_ok=True)
    return folder
