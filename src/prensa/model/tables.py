"""Tables that a description names by file."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def read_mu_table(path: str, context: Any) -> Any:
    """Read a friction curve from a CSV of two columns, slip κ (length) and μ; relative paths are the case file's.

    Raises
    ------
    ValueError
        If the file is missing or is not two columns of numbers.
    """
    import numpy as np

    from prensa.model.problem import MuTable

    base = Path(context["folder"]) if context and "folder" in context else Path()
    file = base / path
    try:
        lines = file.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"friction table {path!r} cannot be read: {error}") from None
    rows = [line.replace(";", ",").split(",") for line in lines if line.strip() and not line.lstrip().startswith("#")]
    try:
        float(rows[0][0])
    except (ValueError, IndexError):
        rows = rows[1:]
    try:
        data = np.array([[float(a), float(b)] for a, b in rows])
    except ValueError:
        raise ValueError(f"friction table {path!r}: expected two columns of numbers, slip and mu") from None
    if len(data) < 2 or not np.isfinite(data).all():
        raise ValueError(f"friction table {path!r}: at least two finite rows are needed")
    return MuTable(kappa=tuple(data[:, 0].tolist()), mu=tuple(data[:, 1].tolist()))
