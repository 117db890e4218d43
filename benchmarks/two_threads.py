"""Wall time with one and two threads, of two checkouts in turn: ``python benchmarks/two_threads.py OLD NEW [UNKNOWNS]``.

Hertz to 8 mm and the first increments of upsetting, 1e5 unknowns unless said otherwise. Wall time: nothing else may run. Kernels
are loaded and the threads started by small problems before; what is not compiled yet is compiled first, and kept with each
checkout.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

INCREMENTS = 8  # of upsetting, of which the first three take most of the iterations
RUN = """
import sys, time
import prensa as pr
from prensa.verify import example1
from prensa.verify.forming import upsetting

def hertz(k):
    steps = tuple(example1.press(d, n) for d, n in ((0.5, 1), (1, 1), (4, 1), (8, 1)))
    n = (round(7 * k), round(6 * k))
    return example1.problem(n, "finite", "current", pr.NeoHooke(E=example1.E, nu=example1.NU), steps)

def run(problem, numerics, most):
    begun, iterations, number = time.perf_counter(), 0, 0
    for inc in pr.solve(problem, numerics):
        number, iterations = number + 1, iterations + inc.statistics.iterations
        if number == most:
            break
    return time.perf_counter() - begun, number, iterations, inc.force(list(inc.tools)[0]).y

name, unknowns, threads, most = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
numerics = pr.Numerics(threads=threads)
if name == "hertz":
    small, problem = hertz(8), hertz((unknowns / 84) ** 0.5)
else:
    k = (unknowns / 24) ** 0.5
    small, problem = upsetting((40, 30), 0.1), upsetting((round(4 * k), round(3 * k)), 0.1)
run(small, numerics, 1)
print(*run(problem, numerics, most))
"""


def seconds(checkout: Path, name: str, unknowns: str, threads: int) -> tuple[float, str]:
    """Wall seconds of a run, and its increments, iterations and last force."""
    env = os.environ | {"PYTHONPATH": str(checkout / "src"), "OMP_NUM_THREADS": "1"}
    most = str(INCREMENTS if name == "upsetting" else 0)
    made = subprocess.run(
        [sys.executable, "-c", RUN, name, unknowns, str(threads), most], env=env, check=True, capture_output=True, text=True
    )
    spent, _, found = made.stdout.splitlines()[-1].partition(" ")
    return float(spent), found


def main(old: str, new: str, unknowns: str = "100000") -> None:
    """Print a table; what was found is that of the second checkout."""
    checkouts = [Path(path).resolve() for path in (old, new)]
    print("| what | threads | old, s | new, s | old over new | increments, iterations, force |\n|---|---|---|---|---|---|")
    for checkout in checkouts:
        for name in ("hertz", "upsetting"):
            seconds(checkout, name, "2000", 2)  # compile
    for name in ("hertz", "upsetting"):
        for threads in (1, 2):
            (before, was), (after, now) = (seconds(checkout, name, unknowns, threads) for checkout in checkouts)
            found = " → ".join(dict.fromkeys((was, now)))
            print(f"| {name} | {threads} | {before:.2f} | {after:.2f} | **{before / after:.2f}** | {found} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
