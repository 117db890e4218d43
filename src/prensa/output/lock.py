"""One process at a time in a folder of results: a lock of the operating system, which goes with its process."""

from __future__ import annotations

import datetime
import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from prensa.errors import PrensaError

LOCK = "run.lock"
_LOCKED_BYTE = 1 << 30  # on Windows: what comes before it can still be read by others


class FolderInUse(PrensaError):
    """Another run holds the folder."""


@contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Hold *directory* for this process: the operating system releases it however the process ends.

    ``run.lock`` names the holder for messages; one that a killed process left behind is taken over.

    Raises
    ------
    FolderInUse
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


def is_held(directory: Path) -> bool | None:
    """Whether a run writes in *directory*; None where that is unknown, as of a process on another host or on Windows.

    The lock itself is tried only where its process seems to be there: a run that begins meanwhile is not to find it taken.
    """
    try:
        with open(directory / LOCK, encoding="utf-8", errors="replace") as file:
            entry = _entry(file)
            if os.name != "posix" or entry.get("host") != socket.gethostname():
                return None
            return _runs_here(entry) and not _lock(file, shared=True)
    except FileNotFoundError:
        return False
    except OSError:
        return None


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
            raise FolderInUse(f"{directory}: {holder}; wait for it, end it, or give another folder for the results")


def _lock(file: IO[str], shared: bool = False) -> bool:
    """Whether the lock of the operating system could be had."""
    try:
        if os.name == "posix":
            import fcntl

            fcntl.flock(file.fileno(), (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        else:
            import msvcrt

            os.lseek(file.fileno(), _LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    except (BlockingIOError, PermissionError):
        return False
    except OSError:  # a file system without locks: the holder's word is what there is
        return not _runs_here(_entry(file))
    return True


def _entry(file: IO[str]) -> dict[str, object]:
    file.seek(0)
    try:
        entry = json.loads(file.read(1000))
    except (ValueError, OSError):
        return {}
    return entry if isinstance(entry, dict) else {}


def _runs_here(holder: dict[str, object]) -> bool:
    """Whether the holder may still run: on another host that is unknown, and on Windows."""
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
    entry = _entry(file)
    if not entry:
        return "another run writes in this folder"
    return f"process {entry.get('pid')} on {entry.get('host')} has been running in this folder since {entry.get('since')}"
