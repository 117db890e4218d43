"""The text of a case file out of a deck of another program."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from prensa.errors import PrensaError
from prensa.importers.abaqus_case import case_of
from prensa.importers.abaqus_includes import whole
from prensa.importers.deck import FileError, text_of

CASE_OPENING = """\
# From {name}; the mesh stays in that file. Numbers are those of the deck: say in which units they are.
# Times of tables count steps; a step lasts one second, or its duration.
"""


def case_text(
    deck: Path, folder: Path, without: Sequence[str] = (), files: dict[str, str] | None = None
) -> tuple[str, list[str]]:  # fmt: skip
    """YAML of the case that a deck describes, to stand in a folder, and remarks about what was passed over.

    without: what is to be left out although the answer depends on it, names of `prensa.importers.abaqus_words.LEFT_OUT`.
    files: receives names and texts of the files that have to stand beside the case; a deck that needs some is refused without.

    Raises
    ------
    PrensaError
        If the deck cannot be read, or says what has no counterpart; with its line.

    """
    from ruamel.yaml import YAML

    try:
        text = text_of(deck)
    except OSError as error:
        raise PrensaError(f"{deck} cannot be read: {error.strerror}") from None
    path = Path(os.path.relpath(deck, folder)).as_posix()
    try:
        together = whole(text, deck)
        if together.origins:
            if files is None:
                raise FileError("its included files are put together with it into one deck beside the case: give --out")
            path = f"{deck.stem}-whole.inp"
            files[path] = together.text
        case, remarks = case_of(together, path, frozenset(without), files)
        if case["name"] == Path(path).stem:
            case["name"] = deck.stem
    except FileError as error:
        raise PrensaError(f"{deck}: {error}") from None
    writer: Any = YAML(typ="safe", pure=True)
    writer.default_flow_style, writer.width, writer.sort_base_mapping_type_on_output = None, 120, False
    buffer = io.StringIO()
    # Units are written out though they are the defaults: whoever opens the file is to see what was assumed.
    ordered: dict[str, Any] = {"name": case.pop("name"), "units": case.pop("units", {"length": "mm", "force": "N"}), **case}
    writer.dump(ordered, buffer)
    return CASE_OPENING.format(name=Path(path).name) + buffer.getvalue(), remarks
