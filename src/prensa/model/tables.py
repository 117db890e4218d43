"""Tables of a description: those over time, and those that it names by file."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from prensa.model.units import factor

TABLE_LIMIT = 1 << 20
MESH_LIMIT = 256 << 20
DRIVEN = ("move", "by", "velocity", "crank", "feed", "push", "control")


def tables_of(owner: Any) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """Path in *owner*, a problem or a step, and rows (time, value) of each table of what drives, holds and loads."""
    for kind in (*DRIVEN, "fixed", "loads", "body_force"):
        for name, entry in getattr(owner, kind, {}).items():
            for key, value in enumerate(entry) if isinstance(entry, tuple) else vars(entry).items() if entry else ():
                # each component of a traction may be a table
                parts = [((key, k), v) for k, v in enumerate(value)] if key == "traction" and value else [((key,), value)]
                yield from (((kind, name, *place), v) for place, v in parts if isinstance(v, tuple) and isinstance(v[0], tuple))


def read_mu_table(path: str, context: Any) -> Any:
    """Read a friction curve from a CSV of two columns, slip κ (length) and μ, as the fields of a `MuTable`.

    Relative paths are the case file's; lines that start with ``#`` are skipped. A first line of names may say the unit of the
    slip, ``slip (um), mu``; without one it is in that of the case.

    Raises
    ------
    ValueError
        If the file is missing or is not two columns of numbers.

    """
    base = Path(context["folder"]) if context and context.get("folder") is not None else Path()
    file = base / path
    try:
        if not file.is_file():
            # '0.1 mm' in the place of a coefficient is a text, and would be reported as a missing file.
            if path[:1] in "+-.0123456789" and path and _is_number(path.split()[0]):
                raise ValueError(f"{path!r} is no friction coefficient: it is a plain number, such as 0.1")
            raise ValueError(f"friction table {path!r}: there is no such file{_instead(file)}")
        if file.stat().st_size > TABLE_LIMIT:
            raise ValueError(f"friction table {path!r} is larger than 1 MiB; is it the right file?")
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"friction table {path!r} cannot be read: {error}") from None
    # Spreadsheets of many countries divide columns by semicolons.
    rows = [line.replace(";", ",").split(",") for line in lines if line.strip() and not line.lstrip().startswith("#")]
    unit = 1.0
    if rows and not _is_number(rows[0][0]):
        unit, rows = _length_of(rows[0][0], context), rows[1:]
    try:
        points = [(float(kappa) * unit, float(mu)) for kappa, mu in rows]
    except ValueError:
        raise ValueError(f"friction table {path!r}: expected two columns of numbers, slip and mu") from None
    if len(points) < 2:
        raise ValueError(f"friction table {path!r}: expected two columns of numbers, slip and mu, in at least two rows")
    return {"kappa": [p[0] for p in points], "mu": [p[1] for p in points]}


def _length_of(head: str, context: Any) -> float:
    """The unit of length that stands in brackets in the head of a column, in the case's; 1 where there is none."""
    _, bracket, rest = head.partition("(")
    if not bracket:
        return 1.0
    unit = rest.partition(")")[0].strip()
    units = context.get("units") if context else None
    if units is None:
        raise ValueError(f"the table states the unit {unit!r}; that belongs in case files, in Python give numbers of the case")
    try:
        return factor(f"1 {unit}", units["length"], units["force"], (0, 1))
    except ValueError as error:
        raise ValueError(f"friction table: {head.strip()!r} states no unit of length ({error})") from None


def found_file(path: str, context: Any, what: str) -> str:
    """Absolute path of a file that a description names; relative paths are the case file's.

    Raises
    ------
    ValueError
        If there is no such file, or it is larger than any mesh.

    """
    base = Path(context["folder"]) if context and context.get("folder") is not None else Path()
    file = base / path
    try:
        if not file.is_file():
            raise ValueError(f"{what} {path!r}: there is no such file{_instead(file, file.suffix)}")
        if file.stat().st_size > MESH_LIMIT:
            raise ValueError(f"{what} {path!r} is larger than 256 MiB; is it the right file?")
    except OSError as error:
        raise ValueError(f"{what} {path!r} cannot be read: {error}") from None
    return str(file.resolve())


def found_run(run: str, context: Any) -> str:
    """Absolute path of a folder of results that a description names; relative paths are the case file's.

    Raises
    ------
    ValueError
        If it is no folder or holds no checkpoint.

    """
    base = Path(context["folder"]) if context and context.get("folder") is not None else Path()
    folder = base / run
    try:
        if not folder.is_dir():
            raise ValueError(
                f"there is no folder {run!r}; run the earlier case first (paths are relative to the case file)"
            )
        if not (folder / "checkpoint.h5").is_file():
            raise ValueError(f"the folder {run!r} holds no checkpoint.h5; is it the folder of a run?")
    except OSError as error:
        raise ValueError(f"{run!r} cannot be read: {error}") from None
    return str(folder.resolve())


def digest_of(path: str) -> str:
    """SHA-256 of a file (hexadecimal)."""
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ValueError(f"{path!r} cannot be read: {error}") from None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _instead(file: Path, suffix: str = ".csv") -> str:
    """What the folder holds instead; a relative path is looked for beside the case file."""
    if not file.parent.is_dir():
        return f" ({file.parent} is no folder)"
    names = sorted(f.name for f in file.parent.glob(f"*{suffix}"))[:5]
    return f"; the folder has {', '.join(names)}" if names else "; paths are relative to the case file"
