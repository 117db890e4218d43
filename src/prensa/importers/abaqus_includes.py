"""Decks of several files: those that ``*INCLUDE`` and ``INPUT=`` name are put in their places, and lines keep their origin."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from prensa.importers.abaqus_words import keyword, squeezed
from prensa.importers.deck import FileError, text_of
from prensa.model.tables import MESH_LIMIT


class Origin(int):
    """Number of a line in the deck as a whole, shown as that of its file: ``3 of mesh.inp``; ``file`` empty: the deck's own."""

    own: int
    file: str

    def __new__(cls, whole: int, own: int, file: str) -> Origin:
        """The line *own* (from 1) of a file that is the line *whole* of the deck."""
        made = super().__new__(cls, whole)
        made.own, made.file = own, file
        return made

    def __str__(self) -> str:
        return f"{self.own} of {self.file}" if self.file else str(self.own)


@dataclass(frozen=True)
class Whole:
    """A deck with its included files in place: text, and the origin of each line (None where nothing is included)."""

    text: str
    origins: tuple[Origin, ...] | None = None


def whole(text: str, deck: Path) -> Whole:
    """The deck with the text of *deck*, and with the files that it includes.

    Names are relative to the folder of the deck, whichever file they stand in, as both programs take them from the folder of the
    job (Abaqus keywords reference, ``*INCLUDE``; CalculiX manual, ``*INCLUDE``).

    Raises
    ------
    FileError
        If a file is missing, too large or includes itself; with the line that names it.

    """
    lines: list[tuple[int, str, str]] = []
    size = 0
    for row in _lines(text, "", deck.parent, (_place(deck),)):
        lines.append(row)
        if (size := size + len(row[2])) > MESH_LIMIT and row[1]:  # files that include one another several times each
            raise FileError.at(Origin(len(lines), row[0], row[1]), "the deck and its included files are larger than 256 MiB")
    if not any(file for _, file, _ in lines):
        return Whole(text)
    origins = tuple(Origin(n, own, file) for n, (own, file, _) in enumerate(lines, 1))
    return Whole("\n".join(line for *_, line in lines) + "\n", origins)


def _lines(text: str, file: str, folder: Path, open_: tuple[Path, ...]) -> Iterator[tuple[int, str, str]]:
    """Number in its file, file and text of the lines of a file, those of included files in their places."""
    rows = text.splitlines()
    n = 0
    while n < len(rows):
        first, line = n, rows[n].strip()
        n += 1
        if not line.startswith("*") or line.startswith("**"):
            yield first + 1, file, rows[first]
            continue
        while line.endswith(",") and n < len(rows) and not rows[n].lstrip().startswith("*"):
            line, n = line + rows[n].strip(), n + 1
        name, *words = line[1:].split(",")
        named = [w.partition("=")[2].strip() for w in words if squeezed(w.partition("=")[0]) == "INPUT"]
        number = Origin(n, n, file)
        if keyword(name) == "INCLUDE":
            if not named:
                raise FileError.at(number, "*INCLUDE names no file: write *INCLUDE, INPUT=…")
            yield n, file, f"** {line[1:]}"
        elif named:  # the data lines of a keyword in a file of their own
            yield n, file, ",".join(["*" + name, *(w for w in words if squeezed(w.partition("=")[0]) != "INPUT")])
        else:
            yield from ((k + 1, file, rows[k]) for k in range(first, n))
            continue
        yield from _included(named[0], number, folder, open_)


def _included(name: str, line: Origin, folder: Path, open_: tuple[Path, ...]) -> Iterator[tuple[int, str, str]]:
    """The lines of the file that a line names.

    Raises
    ------
    FileError
        With that line.

    """
    name = name.strip('"').replace("\\", "/")
    path = folder / name
    try:
        if not path.is_file():
            raise FileError.at(line, f"there is no file {name!r} in {folder}; paths are relative to the deck")
        if path.stat().st_size > MESH_LIMIT:
            raise FileError.at(line, f"{name!r} is larger than 256 MiB; is it the right file?")
        if _place(path) in open_:
            raise FileError.at(line, f"{name!r} includes itself; take this line out")
        text = text_of(path)
    except (OSError, ValueError) as error:  # not to be read, or no name of a file
        raise FileError.at(line, f"{name[:60]!r} cannot be read ({type(error).__name__})") from None
    yield from _lines(text, name, folder, (*open_, _place(path)))


def _place(path: Path) -> Path:
    """A file by its place, whatever links lead to it."""
    return path.resolve()
