"""Corners of the triangles in STL files, text or binary.

A binary file has 84 bytes, the last four of them the number of its triangles, and 50 for each; its size says that it is one,
whatever its header says ("solid" too). In a text, keywords are of either case.
"""

from __future__ import annotations

import codecs
import re
import warnings
from pathlib import Path

import numpy as np

from prensa.types import Array

TEXT = frozenset((*range(9, 14), *range(32, 127)))
"""Bytes of which a text is made."""
BINARY_HEADER, BINARY_TRIANGLE = 84, 50
"""Bytes of a binary file before its triangles, and of each triangle."""
_VERTEX = re.compile(rb"\bvertex\s+(\S+\s+\S+\s+\S+)")


def corners(path: Path) -> Array:
    """Corners (m, 3, 3) of the triangles of a file.

    Raises
    ------
    ValueError
        If it is no STL file, is cut off, or has coordinates that are no numbers.

    """
    data, name = _plain(path.read_bytes()), path.name
    said = int.from_bytes(data[BINARY_HEADER - 4 : BINARY_HEADER], "little") if len(data) >= BINARY_HEADER else -1
    there = (len(data) - BINARY_HEADER) // BINARY_TRIANGLE
    if said == there or (said >= 0 and not _is_text(data)):
        if there != said:
            why = f"{name!r} is cut off: its" if there < said else f"{name!r} is damaged: its"
            raise ValueError(f"{why} header says {said} triangles, and {there} are in it; export or copy it again")
        found = np.frombuffer(data, dtype=_BINARY, count=said, offset=BINARY_HEADER)["x"].astype(np.float64)
    else:
        found = _of_text(name, data)
    if not np.isfinite(found).all():
        raise ValueError(f"{name!r} has coordinates that are not finite numbers; export it again")
    return found


_BINARY = np.dtype([("n", "<f4", 3), ("x", "<f4", (3, 3)), ("attribute", "<u2")])


def _plain(data: bytes) -> bytes:
    """Bytes of a text as editors of some systems write it, without their mark at its start and of one byte a letter."""
    for mark, code in ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be")):
        text = data[len(mark) :].decode(code, errors="replace") if data.startswith(mark) else ""
        if text.lstrip()[:5].lower() == "solid":
            return text.encode()
    return data


def _is_text(data: bytes) -> bool:
    head = data[:2048]
    return not set(head) - TEXT or (head.lstrip()[:5].lower() == b"solid" and b"facet" in head.lower())


def _of_text(name: str, data: bytes) -> Array:
    data = data.lower()
    if data.strip() and b"facet" not in data and b"endsolid" not in data:
        raise ValueError(f"{name!r} is not an STL file that can be read, neither as text nor as binary; export it again")
    places = _VERTEX.findall(data)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # of what is no number
        try:
            x = np.fromstring(b" ".join(places).decode("latin-1"), sep=" ")
        except (DeprecationWarning, ValueError):
            raise ValueError(_no_number(name, data)) from None
    if data.strip() and (data.rfind(b"endsolid") < data.rfind(b"facet") or len(places) != data.count(b"vertex")):
        raise ValueError(f"{name!r} is cut off: its text ends without 'endsolid'; export or copy it again")
    if len(places) != 3 * data.count(b"endfacet"):
        raise ValueError(
            f"{name!r} has {data.count(b'endfacet')} facets and {len(places)} corners, and a facet of an STL file has three; "
            "export it again"
        )
    return x.reshape(-1, 3, 3)


def _no_number(name: str, data: bytes) -> str:
    """Where in a text the first coordinates are that are no numbers."""
    for found in _VERTEX.finditer(data):
        try:
            [float(v) for v in found[1].split()]
        except ValueError:
            line, words = data.count(b"\n", 0, found.start()) + 1, found[0].decode("latin-1")
            words = " ".join(words.split())
            return f"{name!r}, line {line}: {words!r} does not have three numbers (with decimal points); export it again"
    return f"{name!r} has coordinates that are no numbers; export it again"
