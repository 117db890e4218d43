"""Content of a mesh file before it is the mesh of a body: nodes and elements by label, sets by name."""

from __future__ import annotations

import codecs
from dataclasses import dataclass, field
from pathlib import Path

from prensa.errors import PrensaError
from prensa.importers.solids import SolidKind

BYTE_ORDER_MARKS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
"""Encodings by the mark at the beginning of a file."""
LABELS = 10**9  # labels of different instances of an assembly are kept apart by this


def is_label(word: str) -> bool:
    """Whether a word is the label of a node or an element: digits, and fewer than those of the numbers of instances."""
    # isdigit alone is true for digits of other scripts, and for superscripts that int refuses.
    return word.isascii() and word.isdigit() and len(word) < 10


class FileError(PrensaError):
    """A mesh file that cannot be read; the message names the line and what to do."""

    @classmethod
    def at(cls, line: int, message: str) -> FileError:
        """The error with its line (from 1)."""
        return cls(f"line {line}: {message}")


def text_of(path: Path) -> str:
    """Text of a file in any encoding: letters beyond ASCII stand in names and comments, which need not be right.

    Raises
    ------
    OSError
        If it cannot be read.

    """
    raw = path.read_bytes()
    return raw.decode(next((e for mark, e in BYTE_ORDER_MARKS.items() if raw.startswith(mark)), "utf-8"), errors="replace")


@dataclass
class Deck:
    """Contents of a mesh file. Labels are the file's own numbers.

    ``nodes`` label → place (x, y, z); ``cells`` label → node labels (3, 4, 6 or 8 of them); ``parts`` name → cell labels;
    ``lines`` name → groups of nodes (2 or 3) of line elements or of sides of cells; ``points`` name → node labels.
    ``kinds`` label of a cell → its type as the file calls it. ``exclusive``: whether the parts are bodies of their own, of
    which one must be named where there are several. ``source``: what the file calls the things that name its sides.
    ``curves``, ``surfaces`` and ``vertices`` are lines, cells and points by their numbers in the drawing that was meshed; they
    stand in where the file names no lines and no parts.

    Of a mesh in space, ``solids``: label → kind and node labels of its elements, ``solid_lines`` label → line of the file where
    that is known, ``volumes`` name → labels of elements, and ``volume_numbers`` the same by the numbers in the drawing; ``cells``
    and what refers to them are then sides of bodies.
    """

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    cells: dict[int, tuple[int, ...]] = field(default_factory=dict)
    parts: dict[str, list[int]] = field(default_factory=dict)
    lines: dict[str, list[tuple[int, ...]]] = field(default_factory=dict)
    points: dict[str, list[int]] = field(default_factory=dict)
    kinds: dict[int, str] = field(default_factory=dict)
    exclusive: bool = False
    source: str = "sets and surfaces"
    curves: dict[str, list[tuple[int, ...]]] = field(default_factory=dict)
    surfaces: dict[str, list[int]] = field(default_factory=dict)
    vertices: dict[str, list[int]] = field(default_factory=dict)
    solids: dict[int, tuple[SolidKind, tuple[int, ...]]] = field(default_factory=dict)
    solid_lines: dict[int, int] = field(default_factory=dict)
    volumes: dict[str, list[int]] = field(default_factory=dict)
    volume_numbers: dict[str, list[int]] = field(default_factory=dict)

    def element(self, label: int) -> str:
        """An element in space in words, with its line where that is known."""
        line = self.solid_lines.get(label)
        return f"{'' if line is None else f'line {line}: '}element {label % LABELS}"
