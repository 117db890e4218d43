"""A mistake among the names of a description, and the known name that was likely meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

SYMMETRY = "symmetry"  # in ``no_contact``: the lines of symmetry and the axis


def suggest(name: str, known: Iterable[str]) -> str:
    """'; did you mean …?' for the nearest known name, or the list of the known ones."""
    known = list(known)
    close = difflib.get_close_matches(name, known, n=1)
    if not close:
        close = [k for k in known if k.casefold() == name.casefold()]
    if close:
        return f"; did you mean {close[0]!r}?"
    return f"; known: {', '.join(map(repr, known))}" if known else "; none is defined"


@dataclass(frozen=True)
class Finding:
    """A mistake among the cross-references: ``path`` into the description (keys and indices), and the message.

    ``at_key``: the key at the end of the path is wrong, not what stands behind it.
    """

    path: tuple[str | int, ...]
    message: str
    at_key: bool = False

    def __str__(self) -> str:
        return f"{'.'.join(map(str, self.path))}: {self.message}"
