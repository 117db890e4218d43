"""What a study costs beside its runs: 60 upsettings on one and two processes, and many small cases.

``python benchmarks/many_runs.py upsettings`` and ``python benchmarks/many_runs.py small --cases 1000``. On a shared machine wall
times say little; the share of the workers' time that is spent in runs does: twice that share is what two processes gain.
"""

from __future__ import annotations

import argparse
import csv
import resource
import tempfile
import time
from pathlib import Path

import prensa as pr

EXAMPLES = Path(__file__).parents[1] / "examples"
SMALL = """\
name: small
bodies:
  block: {mesh: {type: rectangle, size: [2, 1], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools: {punch: {type: plane, touching: block.top}}
contacts: [{surface: block.top, against: punch}]
kinematics: small
fixed: {block.bottom: y, block.left: x}
steps: [{name: down, move: {punch: {y: -0.01}}, increments: 1}]
"""


def busy(folder: Path) -> float:
    """Seconds that the workers spent in cases."""
    with open(folder / "timings.csv", encoding="utf-8", newline="") as file:
        return sum(float(row["seconds"]) for row in csv.DictReader(file))


def upsettings(folder: Path, cases: int) -> None:
    """60 upsettings, μ × n, on one process and on two."""
    mu, n = 6, max(cases // 6, 1)
    values = {
        "bodies.billet.mesh.n": [[8, 6]],
        "friction.mu": f"lin(0, 0.3, {mu})",
        "bodies.billet.material.flow.n": f"lin(0.1, 0.4, {n})",
    }
    for jobs in (1, 2):
        began, used = time.perf_counter(), time.process_time()
        memory = "1GB" if jobs == 1 else None  # a process of its own too, watched in the same way
        study = pr.sweep(
            EXAMPLES / "upsetting.yaml", values, ["punch.force.y"], out=folder / str(jobs), jobs=jobs, memory=memory, quiet=True
        )  # fmt: skip
        wall, here = time.perf_counter() - began, time.process_time() - used
        share = busy(folder / str(jobs)) / (jobs * wall)
        print(f"{study.summary()}: {jobs} processes, {wall:.1f} s, {here:.1f} s of them work of the asking process")
        print(f"  {100 * share:.1f} % of the workers' time in runs: {jobs * share:.2f} × the runs one after the other")


def small(folder: Path, cases: int) -> None:
    """Cases of some hundredths of a second: alone, in a sweep on one process, and on two."""
    path = folder / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    few = min(cases, 200)
    bare = ["output.pictures=false", "output.report=false", "output.fields=0"]
    pr.run(pr.load(path, bare), out=folder / "run", quiet=True)
    used = time.process_time()
    for k in range(few):
        case = pr.load(path, [*bare, f"bodies.block.material.nu={0.2 + 0.1 * k / few}"])
        pr.run(case, out=folder / f"run{k}", quiet=True)
    alone = (time.process_time() - used) / few
    pr.sweep(path, {"bodies.block.material.nu": [0.1]}, ["punch.force.y"], out=folder / "warm", jobs=1, quiet=True)
    for jobs, count in ((1, few), (2, cases)):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        began, used = time.perf_counter(), time.process_time()
        values = {"bodies.block.material.nu": f"lin(0.2, 0.3, {count})"}
        study = pr.sweep(path, values, ["punch.force.y"], out=folder / f"sweep{jobs}", jobs=jobs, quiet=True)
        wall, here = time.perf_counter() - began, time.process_time() - used
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
        words = f"{1e3 * (here / count - (alone if jobs == 1 else 0)):.1f} ms a case of this process beside the run"
        share = busy(folder / f"sweep{jobs}") / (jobs * wall)
        print(f"{study.summary()}, {jobs} processes: {wall:.1f} s, {words} ({1e3 * alone:.1f} ms); {grown:.0f} MiB more here")
        print(f"  {100 * share:.1f} % of the workers' time in cases; the page has {study.page.stat().st_size / 1e6:.2f} MB")
    began = time.perf_counter()
    pr.sweep(path, values, ["punch.force.y"], out=folder / "sweep2", jobs=1, quiet=True)
    print(f"again, with nothing to compute: {time.perf_counter() - began:.1f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=("upsettings", "small"))
    parser.add_argument("--cases", type=int, default=60)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        {"upsettings": upsettings, "small": small}[asked.what](Path(place), asked.cases)
