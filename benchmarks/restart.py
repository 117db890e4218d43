"""Exact restart at size: ``python benchmarks/restart.py [UNKNOWNS]``, 1e5 unless said otherwise.

Hertz to 8 mm and the first increments of upsetting, with one thread, with two, and resumed half-way from a checkpoint by
either: displacements, forces and histories have to be the same bits. It ends with an error where they are not.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import common
import numpy as np

import prensa as pr
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from prensa.result.increment import Increment
from prensa.system.state import State

INCREMENTS = {"hertz": 4, "upsetting": 8}


def run(problem: pr.Problem, threads: int, most: int, start: State | None = None) -> list[Increment]:
    """So many increments by so many threads, from a state on."""
    out = []
    for inc in pr.solve(problem, pr.Numerics(threads=threads), start):
        out.append(inc)
        if len(out) == most:
            break
    return out


def same(a: Increment, b: Increment) -> bool:
    """Whether two increments are the same bits."""
    bits = [np.array_equal(x, y) for x, y in zip(a.state.history, b.state.history, strict=True)]
    return all(bits) and np.array_equal(a.state.u, b.state.u) and all(a.force(t).y == b.force(t).y for t in a.tools)


def main(unknowns: str = "100000") -> None:
    """Print a line for each comparison."""
    wrong = 0
    for name, most in INCREMENTS.items():
        problem = common.sized(name, int(unknowns))
        one, half = run(problem, 1, most), most // 2
        found = {"two threads": (one, run(problem, 2, most))}
        with tempfile.TemporaryDirectory() as folder:
            path = write_checkpoint(Path(folder) / "half.h5", pr.Case(problem), one[half - 1].state)
            state = read_checkpoint(path)[1]
        for threads in (1, 2):
            found[f"resumed with {threads}"] = one[half:], run(problem, threads, most - half, state)
        for what, (known, other) in found.items():
            alike = sum(map(same, known, other))
            wrong += len(known) - alike
            print(f"{name}, {what}: {alike} of {len(known)} increments are the same bits", flush=True)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main(*sys.argv[1:])
