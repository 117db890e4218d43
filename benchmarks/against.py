"""Two checkouts against each other, run by run in turn: ``python benchmarks/against.py OLD NEW [WHAT …]``.

``NEW@bdf2``: the second with that time rule (`numerics: time_rule`), which the first need not know.
What was found: increments, iterations, and forces (N) at the end of steps, of upsetting at 10, 20, 30, 40, 50 %.

Processor time of one thread, the least of the rounds: other processes on the machine slow both alike. The start compiles every
kernel anew in a folder of its own.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROUNDS = 3
HISTORY = """
import sys, time
import prensa as pr
from prensa.verify import example1
from prensa.verify.forming import upsetting

def problem(name, n, mu):
    if name == "upsetting":
        return upsetting(n, mu)
    steps = tuple(example1.press(d, k) for d, k in ((0.5, 1), (1, 1), (4, 1), (8, 1)))
    if name == "hertz":
        return example1.problem(n, "finite", "current", pr.NeoHooke(E=example1.E, nu=example1.NU), steps)
    material = pr.Elastic(E=example1.E, nu=example1.NU)
    return example1.problem(n, "small", "current", material, (example1.press(1.0, 3),))

name, n, mu = sys.argv[1], (int(sys.argv[2]), int(sys.argv[3])), float(sys.argv[4])
numerics = pr.Numerics(time_rule=sys.argv[5]) if sys.argv[5] else pr.Numerics()
for inc in pr.solve(problem(name, (7, 6), mu), numerics):
    inc.bodies
start, marks, number, iterations = time.process_time(), [], 0, 0
for inc in pr.solve(problem(name, n, mu), numerics):
    number, iterations = number + 1, iterations + inc.statistics.iterations
    if name != "upsetting" or abs(5 * inc.time - round(5 * inc.time)) < 1e-9:
        marks.append(f"{inc.force(list(inc.tools)[0]).y:.6g}")
spent = time.process_time() - start
print(spent, f"{number} increments, {iterations} iterations:", *(marks[-5:] if name == "upsetting" else marks[-1:]))
"""
START = """
import atexit, runpy, sys, time
atexit.register(lambda: print(time.process_time()))
sys.path.insert(0, 'examples')
sys.argv = ['demo', '--quick', '--out', sys.argv[1]]
runpy.run_path('examples/demo.py', run_name='__main__')
"""
CASES = {
    "upsetting 32 × 24, μ = 0.1": ("upsetting", "32", "24", "0.1"),
    "upsetting 32 × 24, μ = 0.3": ("upsetting", "32", "24", "0.3"),
    "upsetting 64 × 48, μ = 0.1": ("upsetting", "64", "48", "0.1"),
    "upsetting 64 × 48, μ = 0.3": ("upsetting", "64", "48", "0.3"),
    "Hertz, 1e5 unknowns": ("hertz", "241", "207", "0"),
    "elastic, 2e5 unknowns, 3 increments": ("elastic", "316", "316", "0"),
    "demo --quick, nothing compiled": ("start",),
    "demo --quick, all compiled": ("warm",),
}


def seconds(checkout: Path, rule: str, case: tuple[str, ...], kept: Path) -> tuple[float, str]:
    """Processor seconds of a case in a checkout with a time rule ('': its own), and what it found; ``kept``: for kernels."""
    env = os.environ | {"PYTHONPATH": str(checkout / "src"), "OMP_NUM_THREADS": "1", "NUMBA_CACHE_DIR": str(kept)}
    if case[0] not in ("start", "warm"):
        made = subprocess.run(
            [sys.executable, "-c", HISTORY, *case, rule], env=env, check=True, capture_output=True, text=True
        )
        first, _, found = made.stdout.splitlines()[-1].partition(" ")
        return float(first), found.strip()
    with tempfile.TemporaryDirectory() as folder:
        if case[0] == "start":
            env["NUMBA_CACHE_DIR"] = folder
        made = subprocess.run(
            [sys.executable, "-c", START, str(Path(folder) / "out")],
            env=env, cwd=checkout, check=True, capture_output=True, text=True,
        )  # fmt: skip
    return float(made.stdout.splitlines()[-1]), ""


def main(old: str, new: str, *wanted: str) -> None:
    """Print a table of the cases whose names contain one of the words."""
    parts = [given.partition("@") for given in (old, new)]
    checkouts = [(Path(path).resolve(), rule) for path, _, rule in parts]
    print("| what | old, s | new, s | old over new | found |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as kept:
        for name, case in CASES.items():
            if wanted and not any(word in name for word in wanted):
                continue
            runs: list[list[tuple[float, str]]] = [[], []]
            for _ in range(1 if case[0] == "start" else ROUNDS):
                for many, (checkout, rule) in zip(runs, checkouts):
                    many.append(seconds(checkout, rule, case, Path(kept) / checkout.name))
            before, after = (min(s for s, _ in many) for many in runs)
            found = " → ".join(dict.fromkeys(many[0][1] for many in runs))
            print(f"| {name} | {before:.2f} | {after:.2f} | **{before / after:.2f}** | {found} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
