"""Files that are either the old ones or the new ones, never halves."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

TEMPORARY = ".part"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside *path*; it takes the place of *path* when the block ends well.

    Whatever happens inside the block, *path* holds its previous content until the new one is on the disk.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + TEMPORARY)
    try:
        yield temporary
        with open(temporary, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> Path:
    """Replace *path* by *text* (UTF-8) atomically; returns *path*."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def file_name(name: str) -> str:
    """*name* as a single path component: what file systems refuse becomes ``_``."""
    return re.sub(r'[\\/:*?"<>|\s]', "_", name)


def numbered(directory: Path, suffix: str) -> Iterator[tuple[int, Path]]:
    """Pairs (number, path) of the files ``NNNN<suffix>`` in *directory*, in order of number."""
    found = ((int(p.name[: -len(suffix)]), p) for p in directory.glob(f"[0-9]*{suffix}") if _is_number(p, suffix))
    yield from sorted(found)


def _is_number(path: Path, suffix: str) -> bool:
    return path.is_file() and path.name[: -len(suffix)].isdigit()
