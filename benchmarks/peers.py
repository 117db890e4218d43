"""prensa's side of the comparison with its peers: ``python benchmarks/peers.py hertz|upsetting NX NY [ELEMENT]``."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace

import common

import prensa as pr
from prensa.verify.forming import upsetting


def main(what: str, nx: int, ny: int, element: str = "") -> None:
    """Print a line of JSON: processor seconds, forces at the ends of the increments."""
    make = common.hertz if what == "hertz" else lambda n: upsetting(n, 0.1)
    tool, factor = ("cylinder", 2.0) if what == "hertz" else ("punch", 1.0)

    def chosen(n: tuple[int, int]) -> pr.Problem:
        p = make(n)
        bodies = {k: replace(b, element=element) for k, b in p.bodies.items()} if element else p.bodies
        return replace(p, bodies=bodies)

    common.warm(chosen((7, 6)) if what == "hertz" else upsetting((4, 3), 0.1, increments=5))
    problem = chosen((nx, ny))
    start = time.process_time()
    rows = [(-i.tools[tool].place.y, factor * i.force(tool).y, i.statistics.iterations) for i in pr.solve(problem)]
    print(
        json.dumps({
            "seconds": time.process_time() - start, "ended": "completed", "depth": [r[0] for r in rows],
            "force": [r[1] for r in rows], "iterations": sum(r[2] for r in rows), "increments": len(rows),
        })
    )  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), *sys.argv[4:5])
