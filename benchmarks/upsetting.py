"""Cost of the frictional upsetting, 64 × 48, μ = 0.1 to 50 %, beside that of its factorisations and solves alone.

Run with OMP_NUM_THREADS=1; the first line of work compiles or loads the kernels and is not counted.
"""

from __future__ import annotations

import time

import prensa as pr
from prensa.solver.march import Timer
from prensa.verify.forming import upsetting


def main() -> None:
    list(pr.solve(upsetting((4, 3), 0.1, increments=5)))
    for n in ((32, 24), (64, 48)):
        timer, start = Timer(), time.process_time()
        history = list(pr.solve(upsetting(n, 0.1), timer=timer))
        total = time.process_time() - start
        limit = timer.seconds["factorisation and solve"]
        iterations = sum(i.statistics.iterations for i in history)
        print(
            f"{n[0]} x {n[1]}: {len(history)} increments, {iterations} iterations, {total:.1f} s of processor time, "
            f"{total / limit:.1f} times the factorisations and solves ({limit:.1f} s)"
        )


if __name__ == "__main__":
    main()
