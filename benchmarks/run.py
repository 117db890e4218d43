"""The whole table: ``make bench`` writes benchmarks/RESULTS.md. Peers that are not installed are left out, and it says so.

``python benchmarks/run.py [--quick] [--only WORD …] [--felupe PYTHON]``: quick takes small sizes (minutes instead of a quarter
of an hour); --felupe names an interpreter that has felupe (default: this one). Every row is a process of its own, one
after the other, with one thread.
"""

from __future__ import annotations

import datetime
import os
import sys
from pathlib import Path
from typing import Any

import common

HERE = Path(__file__).parent
ENVIRONMENT = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
Rows = list[list[str]]


def measured(script: str, *words: object, python: str = sys.executable) -> dict[str, Any]:
    """The line of JSON that a script of this folder prints, or why there is none."""
    words = ["--quick"] * a.quick + (["--only", *a.only] if a.only else [])
    command = f"python benchmarks/run.py {' '.join(words)}" if words else "make bench"
    text = (
        f"# Benchmarks\n\nWritten by `{command}` on {datetime.date.today()}. Processor time of one thread unless said. "
        f"Machine: {common.machine()}.\n"
    )
    for name, part in parts.items():
        if a.only and name not in a.only:
            continue
        print(f"{name} …", flush=True)
        text += "\n" + part()
        a.out.write_text(text)
    print(f"{a.out} written")


if __name__ == "__main__":
    main()
