"""Ownership of a results folder: whose results it holds, and that nothing outside it is written or removed."""

from __future__ import annotations

import ast
import os
import re
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from prensa.errors import PrensaError
from prensa.output import checkpoint, history, measured, passages, pictures, report, runlog, summary, vtk
from prensa.output.files import TEMPORARY, numbered

FILES = (
    summary.SUMMARY, checkpoint.CHECKPOINT, history.HISTORY, history.CONVERGENCE, passages.PASSAGES, measured.MEASURES,
    vtk.COLLECTION, report.REPORT, runlog.LOG,
)  # fmt: skip
"""In the order in which they are removed: what refers to others before these, and last the log, which says whose they are."""
_FIRST_LINE = re.compile(r"\S+ \S+ INFO +prensa \S+, case (.+), input ([0-9a-f]{64})$")


class Owner(NamedTuple):
    """Whose results a folder holds: ``name`` of the case and ``input_hash`` of all of it."""

    name: str
    input_hash: str


# --------------------------------------------------------------------------------------------------------- whose it is
def owner(directory: Path) -> Owner | None:
    """Whose results *directory* holds, from the summary or, of a run that was killed, from the log; None if of no run."""
    with suppress(PrensaError):
        stored = summary.stored_summary(directory)
        if {"name", "input_hash"} <= stored.keys():
            return Owner(str(stored["name"]), str(stored["input_hash"]))
    try:
        with open(directory / runlog.LOG, encoding="utf-8", errors="replace") as file:
            found = _FIRST_LINE.match(file.readline(10_000).rstrip("\n"))
        return Owner(str(ast.literal_eval(found[1])), found[2]) if found else None
    except (OSError, ValueError, SyntaxError):
        return None


def make_room(directory: Path, name: str, force: bool) -> Owner | None:
    """Remove the results of an earlier run of the case *name* from *directory*; returns whose they were.

    Everything that has no name of a run's file is left alone.

    Raises
    ------
    PrensaError
        If they are another case's, or of no run at all, unless *force*.

    """
    refuse_links(directory)
    there = [path for path in map(directory.joinpath, FILES) if path.exists() or path.is_symlink()]
    log = directory / runlog.LOG
    if there == [log] and not log.is_symlink() and log.stat().st_size == 0:
        there = []  # of a run that was killed before its first line
    before = owner(directory)
    remedy = "give another folder for the results, or --force (in Python force=True) to replace"
    if there and before is None and not force:
        raise PrensaError(f"{directory}: {there[0].name} here was not left by a run of prensa; {remedy} it")
    if before is not None and before.name != name and not force:
        raise PrensaError(f"{directory}: here are the results of the case {before.name!r}; {remedy} them")
    _remove(directory)
    return before


def _remove(directory: Path) -> None:
    files = [directory / name for name in FILES]
    old = [path.with_name(path.name + TEMPORARY) for path in files]  # left by a run that was killed
    old += directory.glob(f"{report.REPORT}.*{TEMPORARY}")  # of a report that was made beside the run
    old += files[:-1]
    old += [path for _, path in numbered(directory / vtk.FIELDS_FOLDER, ".vtu")]
    old += [path for _, path in numbered(directory / vtk.FIELDS_FOLDER, f".vtu{TEMPORARY}")]
    old += (directory / vtk.FIELDS_FOLDER).glob(f"{vtk.TOOLS}[0-9]*.vtu*")
    old += [path for path in (directory / pictures.PICTURES).glob("*.png") if pictures.is_picture(path)]
    for path in old:
        path.unlink(missing_ok=True)
    history.forget_contacts_after(directory, -1)
    files[-1].unlink(missing_ok=True)


def refuse_links(directory: Path, files: bool = False) -> None:
    """Refuse links in place of the folders of a run (with ``files`` of its files too): they lead to what is not the run's.

    Raises
    ------
    PrensaError
        If there is one.

    """
    inside = [vtk.FIELDS_FOLDER, pictures.PICTURES, history.CONTACT_FOLDER]
    paths = [directory / name for name in (*inside, *(FILES if files else ()))]
    if not _is_link(directory / history.CONTACT_FOLDER):
        paths += (directory / history.CONTACT_FOLDER).glob("*")
    for path in paths:
        if _is_link(path):
            raise PrensaError(f"{path}: this is a link, and a run writes inside its own folder only; remove it")


def _is_link(path: Path) -> bool:
    junction = getattr(os.path, "isjunction", None)  # of Windows, from Python 3.12 on
    return path.is_symlink() or bool(junction and junction(path))
