"""Files that are either the old ones or the new ones, never halves."""

from __future__ import annotations

import csv
import hashlib
import io
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from prensa.errors import PrensaError, take_path

TEMPORARY = ".part"
_AT_ONCE = 16  # files brought to the disk together


class Contents(dict[str, Any]):
    """What a file at *path* holds by name; a name that every such file has and this one has not raises PrensaError."""

    def __init__(self, path: Path, entries: Mapping[str, Any] | Iterable[tuple[str, Any]]) -> None:
        super().__init__(entries)
        self.path = path

    def __missing__(self, name: str) -> Any:
        raise PrensaError(f"{self.path}: there is no {name!r}; the file is damaged, run the case again")


@contextmanager
def replacing(path: Path, durable: bool = True, shared: bool = False) -> Iterator[Path]:
    """Give a temporary path beside *path*; it takes the place of *path* when the block ends well.

    Whatever happens inside the block, *path* holds its previous content until the new one is complete: on the disk or, where
    ``durable`` is False, with the operating system, for the caller to `flush`. Then a killed process leaves the old file or
    the new one, a power cut perhaps neither. ``shared``: other processes may replace the same file at the same time.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.{os.getpid()}{TEMPORARY}" if shared else path.name + TEMPORARY)
    for taken in (path, temporary):
        if taken.is_dir() and not taken.is_symlink():
            raise PrensaError(f"{taken} is a folder, where a file is to be written: move it away")
    temporary.unlink(missing_ok=True)  # a link would be followed
    try:
        yield temporary
        if durable:
            _to_disk(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def flush(paths: Iterable[Path], directory: Path) -> None:
    """Bring files inside *directory*, and the folders that name them, to the disk; those that are gone are passed over.

    Many are asked for at once: a disk takes them together, in some thirtieth of the time that they take one by one.
    """
    from concurrent.futures import ThreadPoolExecutor

    files = [path for path in paths if path.is_file()]
    folders = {directory, *(f for path in files for f in path.parents if f.is_relative_to(directory))}
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        list(pool.map(_to_disk, files))
        if os.name == "posix":  # other systems cannot open a folder, and keep names with the files
            list(pool.map(_folder_to_disk, folders))


def _to_disk(path: Path) -> None:
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def _folder_to_disk(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        with suppress(OSError):  # file systems that keep no names of their own refuse
            os.fsync(handle)
    finally:
        os.close(handle)


def write_text(path: Path, text: str, durable: bool = True, shared: bool = False) -> Path:
    """Replace *path* by *text* (UTF-8) atomically; returns *path*; ``durable`` and ``shared`` as of `replacing`."""
    with replacing(path, durable, shared) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return path


def write_spreadsheet(path: str | Path, head: Sequence[str], rows: Iterable[Sequence[str]], semicolons: bool) -> Path:
    """Write rows of numbers below their names; returns the path, whose folder is made.

    ``semicolons``: between the columns, and decimal commas, as spreadsheets of many languages read them.
    """
    path, text = take_path("save", path), io.StringIO()
    writer = csv.writer(text, delimiter=";" if semicolons else ",", lineterminator="\n")
    writer.writerow(head)
    for cells in rows:
        writer.writerow([c.replace(".", ",") for c in cells] if semicolons else cells)
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_text(path, text.getvalue())


LONGEST_NAME = 120  # characters: file systems take 255 bytes
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


def file_name(name: str) -> str:
    """*name* as a single path component: what a file system refuses becomes ``_``, the middle of a long one its hash."""
    safe = re.sub(r'[\\/:*?"<>|\s\x00-\x1f\x7f]', "_", name)
    if not safe.strip(".") or _DEVICES.fullmatch(safe) or safe.endswith("."):
        safe = f"{safe}_"
    if len(safe.encode(errors="replace")) <= LONGEST_NAME:
        return safe
    short = safe.encode(errors="replace")[: LONGEST_NAME // 2].decode(errors="ignore")
    return f"{short}~{hashlib.sha256(name.encode(errors='replace')).hexdigest()[:12]}"


def file_names(names: Iterable[str]) -> dict[str, str]:
    """A path component for each name, no two the same; small and capital letters count as equal.

    The second of two that would share one ends with ``~2``.
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        first = candidate = file_name(name)
        number = 1
        while candidate.casefold() in taken:
            number += 1
            candidate = f"{first}~{number}"
        taken.add(candidate.casefold())
        found[name] = candidate
    return found


def numbered(directory: Path, suffix: str) -> Iterator[tuple[int, Path]]:
    """Pairs (number, path) of the files ``NNNN<suffix>`` in *directory*, in order of number."""
    found = ((int(p.name[: -len(suffix)]), p) for p in directory.glob(f"[0-9]*{suffix}") if _is_number(p, suffix))
    yield from sorted(found)


def _is_number(path: Path, suffix: str) -> bool:
    return path.is_file() and path.name[: -len(suffix)].isdigit()
