"""One folder, one run: who writes in it, whose results it holds, and that nothing outside it is written or removed."""

from __future__ import annotations

import ast
import datetime
import json
import os
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, NamedTuple

from prensa.errors import PrensaError
from prensa.output import checkpoint, history, pictures, report, runlog, vtk
from prensa.output.files import TEMPORARY, numbered

LOCK = "run.lock"
FILES = (
    history.HISTORY, history.CONVERGENCE, checkpoint.CHECKPOINT, vtk.COLLECTION, report.SUMMARY, report.REPORT, runlog.LOG,
)  # fmt: skip
_FIRST_LINE = re.compile(r"\S+ \S+ INFO +prensa \S+, case (.+), input ([0-9a-f]{64})$")
_LOCKED_BYTE = 1 << 30  # byte that Windows locks: what comes before it can still be read by others


class Owner(NamedTuple):
    """Whose results a folder holds: ``name`` of the case and ``input_hash`` of all of it."""

    name: str
    input_hash: str


# ---------------------------------------------------------------------------------------------------------------- lock
@contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Hold *directory* for this process: the operating system lets go of it however the process ends.

    ``run.lock`` names the holder for messages; one that a killed process left behind is taken over.

    Raises
    ------
    PrensaError
        If another run holds it, with its process and host.

    """
    file = _taken(directory)
    since = datetime.datetime.now().astimezone().isoformat(" ", "seconds")
    try:
        file.truncate(0)
        file.write(json.dumps({"pid": os.getpid(), "host": socket.gethostname(), "since": since}) + "\n")
        file.flush()
        yield
    finally:
        if os.name == "posix":  # removed while held: whoever opened it before finds that it is another file now
            (directory / LOCK).unlink(missing_ok=True)
        file.close()
        if os.name != "posix":
            with suppress(OSError):  # another process has opened it since
                (directory / LOCK).unlink(missing_ok=True)


def _taken(directory: Path) -> IO[str]:
    path = directory / LOCK
    while True:
        if path.is_symlink():
            raise PrensaError(f"{path}: this is a link; remove it")
        file = open(path, "a+", encoding="utf-8")  # noqa: SIM115  (open as long as the run)
        try:
            free = _lock(file)
            with suppress(FileNotFoundError):
                if free and os.path.samestat(os.fstat(file.fileno()), os.stat(path)):
                    return file
        except BaseException:
            file.close()
            raise
        holder = _holder(file)
        file.close()
        if not free:
            raise PrensaError(f"{directory}: {holder}; wait for it, end it, or give another folder for the results")


def _lock(file: IO[str]) -> bool:
    """Whether the lock of the operating system could be had."""
    try:
        if os.name == "posix":
            import fcntl

            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:
            import msvcrt

            os.lseek(file.fileno(), _LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    except (BlockingIOError, PermissionError):
        return False
    except OSError:  # a file system without locks: the holder's word is what there is
        return not _runs_here(_told(file))
    return True


def _told(file: IO[str]) -> dict[str, object]:
    file.seek(0)
    try:
        told = json.loads(file.read(1000))
    except (ValueError, OSError):
        return {}
    return told if isinstance(told, dict) else {}


def _runs_here(holder: dict[str, object]) -> bool:
    """Whether the holder may still run: on another host nobody can tell, on Windows neither."""
    pid = holder.get("pid")
    if not isinstance(pid, int) or pid <= 0:
        return False
    if holder.get("host") != socket.gethostname() or os.name != "posix":
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _holder(file: IO[str]) -> str:
    told = _told(file)
    if not told:
        return "another run writes in this folder"
    return f"process {told.get('pid')} on {told.get('host')} has been running in this folder since {told.get('since')}"


# --------------------------------------------------------------------------------------------------------- whose it is
def owner(directory: Path) -> Owner | None:
    """Whose results *directory* holds, from the summary or, of a run that was killed, from the log; None if of no run."""
    with suppress(PrensaError):
        summary = report.read_summary(directory)
        if {"name", "input_hash"} <= summary.keys():
            return Owner(str(summary["name"]), str(summary["input_hash"]))
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
    before = owner(directory)
    remedy = "give another folder for the results, or --force (in Python force=True) to replace"
    if there and before is None and not force:
        raise PrensaError(f"{directory}: {there[0].name} here was not left by a run of prensa; {remedy} it")
    if before is not None and before.name != name and not force:
        raise PrensaError(f"{directory}: here are the results of the case {before.name!r}; {remedy} them")
    _remove(directory)
    return before


def _remove(directory: Path) -> None:
    old = [directory / name for name in FILES]
    old = [path.with_name(path.name + TEMPORARY) for path in old] + old  # the former left by a run that was killed
    old += [path for _, path in numbered(directory / vtk.FIELDS_FOLDER, ".vtu")]
    old += [path for path in (directory / pictures.PICTURES).glob("*.png") if pictures.is_picture(path)]
    for path in old:
        path.unlink(missing_ok=True)
    history.forget_contacts_after(directory, -1)


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
