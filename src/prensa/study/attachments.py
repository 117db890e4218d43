"""The files that a case names (meshes, runs to start from, users' modules): known by content, brought to where they are needed.

The text of a case holds absolute paths. Here they are replaced by ``attached:<digest>/<name>``, which is the same wherever the
files lie, and on the computing side by the paths at hand.
"""

from __future__ import annotations

import re
import sys
import sysconfig
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from prensa.model import text as yaml
from prensa.model.tables import digest_of

MARK = "attached:"
_NAMES_A_FILE = re.compile(r"type: file\b|^start:|\S:[A-Za-z_]", re.MULTILINE)
_CHECKPOINT = "checkpoint.h5"


@dataclass(frozen=True)
class Attachment:
    """A file that a case needs: SHA-256 of its content, its name, and its path where the study is asked for."""

    digest: str
    name: str
    origin: str

    @property
    def short(self) -> str:
        """How a detached text calls it."""
        return f"{MARK}{self.digest}/{self.name}"

    def is_at(self, path: str | Path) -> bool:
        """Whether the file at *path* is this one."""
        try:
            stat = Path(path).stat()
            return _digest(str(path), stat.st_mtime_ns, stat.st_size) == self.digest
        except (OSError, ValueError):  # not there, or not to be read
            return False


@cache
def _digest(path: str, changed: int, size: int) -> str:
    """Digest of a file, computed once as long as it does not change."""
    return digest_of(path)


def detached(text: str) -> tuple[str, tuple[Attachment, ...]]:
    """A text that `prensa.dump` wrote, its paths replaced by contents, and the files that it needs."""
    if not _NAMES_A_FILE.search(text):
        return text, ()
    found: dict[str, Attachment] = {}

    def replaced(path: str) -> str:
        file = Path(path)
        # Time and size are part of the cached key: a file that is written again during a session is read again.
        stat = file.stat()
        one = Attachment(_digest(str(file), stat.st_mtime_ns, stat.st_size), file.name, str(file))
        found[one.short] = one
        return one.short

    tree = _read(text)
    _walk(tree, replaced)
    return (yaml.write(tree), tuple(found.values())) if found else (text, ())


def attached(text: str, places: Mapping[str, str]) -> str:
    """The text of a case again; *places*: a path for the short name of each attachment."""
    if MARK not in text:
        return text
    tree = _read(text)
    _walk(tree, lambda short: places.get(short, short))
    return yaml.write(tree)


def places(attachments: tuple[Attachment, ...], folder: Path | None) -> dict[str, str]:
    """Where the files are on this machine: at their origin, or below *folder*, to which they were sent.

    Raises
    ------
    FileNotFoundError
        If one is at neither.

    """
    found = {}
    for one in attachments:
        options = [Path(one.origin), *([folder / one.digest / one.name] if folder is not None else [])]
        there = next((path for path in options if one.is_at(path)), None)
        if there is None:
            raise FileNotFoundError(f"{one.name} ({one.origin}) has not reached this worker")
        found[one.short] = str(there)
    return found


# --------------------------------------------------------------------------------------------------------------- details
def _read(text: str) -> dict[str, Any]:
    tree, _ = yaml.read(text, "case", bounded=False)
    return dict(tree.plain())


def _walk(tree: dict[str, Any], replaced: Callable[[str], str]) -> None:
    """Replace the files that *tree* names, in place."""
    start = tree.get("start")
    if isinstance(start, dict) and isinstance(start.get("run"), str):
        if start["run"].startswith(MARK):
            start["run"] = str(Path(replaced(start["run"])).parent)
        else:
            start["run"] = replaced(f"{start['run']}/{_CHECKPOINT}")
    for holder, key in _entries(tree):
        value = holder[key]
        if key == "path" and holder.get("type") == "file":
            holder[key] = replaced(value)
        elif isinstance(value, str) and (found := _module(value)):
            holder[key] = f"{replaced(found[0])}:{found[1]}"


def _entries(tree: Any) -> Iterator[tuple[dict[str, Any], str]]:
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield tree, key
            yield from _entries(value)
    elif isinstance(tree, list):
        for value in tree:
            yield from _entries(value)


def _module(value: str) -> tuple[str, str] | None:
    """File and class of a user's law, ``module:Class``; None of other texts and of what comes with an installed package."""
    path, colon, name = value.rpartition(":")
    if not colon or not name.isidentifier():
        return None
    if path.endswith(".py"):
        return path, name
    module = sys.modules.get(path)
    file = getattr(module, "__file__", None)
    if file is None:
        main = getattr(sys.modules.get("__main__"), "__file__", None)  # a law of the script that asks for the study
        file = main if main and Path(main).stem == path else None
    if file is None or not file.endswith(".py") or file.startswith(sysconfig.get_path("purelib")):
        return None
    return str(Path(file).resolve()), name
