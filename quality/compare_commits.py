"""Processor time, iterations and forces of two checkouts on the problems of the panel, in turn, in processes that stay.

    python quality/compare_commits.py ../older . --repeat 5 --file pairs.jsonl

Each problem is run alternately by a process of either checkout (their own Python environment may be shared: only ``src`` and
``quality`` of the checkout are put in front), after one run that loads kernels; the least processor time of the repeats counts.
``--halved`` runs the first checkout alone, with increments half as long as those that it took, for the scatter of its answers.
A line of JSON a problem goes to the file; the table is printed at the end, and alone with ``--table``.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

SEED = 7
QUARTERS = (0.25, 0.5, 0.75)
FORMING_CASES = (
    "flat_punch", "snap_through", "strip_drawing", "wire_drawing", "forward_extrusion", "flat_rolling",
    "hemispherical_stretching", "u_bending", "v_bending", "free_bending", "drawbead", "indentation", "cup_drawing",
    "channel_forming",
)  # fmt: skip
DRAWN_OF = {"strips": 10, "slide_release": 6, "rolls": 6, "forgings": 6, "cycles": 6}
"""Those of the panel that checkouts from before it have, too."""
NAMES = (
    *("upsetting 0.1", "upsetting 0.3", "ring 0.1", "ring 0.3"),
    *FORMING_CASES,
    *(f"{family} {k}" for family, count in DRAWN_OF.items() for k in range(count)),
    *("hertz 1e5", "upsetting 1e5"),
)
LONGEST = 240.0
"""s of processor time after which a problem is not repeated."""


def posed(name: str, small: bool) -> tuple[Any, Any, int | None]:
    """Problem, numerics and the most increments of a problem of the panel."""
    import prensa as pr
    from prensa.verify import example1
    from prensa.verify.forming import upsetting

    kind, _, rest = name.partition(" ")
    if name == "hertz 1e5":
        steps = tuple(example1.press(d, k) for d, k in ((0.5, 1), (1, 1), (4, 1), (8, 1)))
        material = pr.NeoHooke(E=example1.E, nu=example1.NU)
        n = (7, 6) if small else (242, 207)
        return example1.problem(n, "finite", "current", material, steps), pr.Numerics(), 4
    if name == "upsetting 1e5":
        return upsetting((4, 3) if small else (260, 195), 0.1), pr.Numerics(), 6
    if kind == "upsetting":
        return upsetting((32, 24), float(rest)), pr.Numerics(), None
    if kind in ("ring", *FORMING_CASES):
        file, changes = ("ring_compression", (f"friction.mu={rest}",)) if kind == "ring" else (kind, ())
        case = pr.load(Path(os.environ["PAIRED_CHECKOUT"]) / "examples" / f"{file}.yaml", changes)
        return case.problem, case.numerics, None
    try:
        from prensa_bench.robustness.families import drawn
    except ImportError:
        from prensa.bench.robustness.families import drawn  # type: ignore[no-redef]
    found = drawn(kind, SEED, int(rest))
    return found.problem, found.numerics, None


def once(name: str, small: bool, halved: dict[str, list[float]] | None) -> dict[str, Any]:
    """Run one problem: what came of it.

    ``halved``: stops at the middles of the increments of a former run of it.
    """
    import prensa as pr
    from prensa.errors import PrensaError

    problem, numerics, most = posed(name, small)
    stops = [k + share for k in range(len(problem.steps)) for share in QUARTERS]
    fixed = {*stops, *range(1, len(problem.steps) + 1)}
    if halved is not None:
        times = [0.0, *halved["times"]]
        stops = sorted({*stops, *halved["times"], *((a + b) / 2 for a, b in pairwise(times))})
    out: dict[str, Any] = {"status": "ended", "iterations": 0, "cuts": 0, "times": [], "forces": {}}
    begun = time.process_time()
    try:
        for inc in islice(pr.solve(problem, numerics, stops=stops), 2 if small else most):
            out["times"].append(inc.time)
            out["iterations"] += inc.statistics.iterations
            out["cuts"] += inc.statistics.cutbacks
            if inc.time in fixed:
                out["forces"][f"{inc.time:.10g}"] = [float(f) for tool in inc.tools.values() for f in tool.force]
    except PrensaError as error:
        out["status"], out["reason"] = "failed", str(error)[:200]
    out["seconds"] = time.process_time() - begun
    return out


def serve() -> None:
    """Run what comes on the standard input, a line of JSON each."""
    for line in sys.stdin:
        asked = json.loads(line)
        print(json.dumps(once(asked["name"], asked["small"], asked.get("halved"))), flush=True)


class Checkout:
    """A process that runs problems with the code of a checkout."""

    def __init__(self, where: Path) -> None:
        paths = os.pathsep.join(str(where / part) for part in ("src", "quality"))
        self.process = subprocess.Popen(
            [sys.executable, __file__, "--serve"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=where,
            env=os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1", "PAIRED_CHECKOUT": str(where)},
        )

    def run(self, name: str, small: bool = False, halved: dict[str, Any] | None = None) -> dict[str, Any]:
        """One run of a problem."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps({"name": name, "small": small, "halved": halved}) + "\n")
        self.process.stdin.flush()
        return dict(json.loads(self.process.stdout.readline()))


def difference(a: dict[str, Any], b: dict[str, Any]) -> float:
    """Largest difference of a force at times that both reached, over the largest of the run."""
    common = a["forces"].keys() & b["forces"].keys()
    largest = max((abs(f) for t in common for f in a["forces"][t]), default=0.0)
    return max(
        (abs(f - g) / largest for t in common for f, g in zip(a["forces"][t], b["forces"][t], strict=True)),
        default=math.nan,
    )


def show(rows: list[dict[str, Any]]) -> None:
    """Print the table and the geometric means."""
    print(f"{'problem':26}{'s':>9}{'s':>9}{'ratio':>8}{'iterations':>13}{'cuts':>9}{'forces':>9}  status")
    ratios: dict[str, list[float]] = {}
    for row in rows:
        a, b = row["first"], row["second"]
        ratio = min(row["seconds"][1]) / min(row["seconds"][0])
        status = a["status"] if a["status"] == b["status"] else f"{a['status']} -> {b['status']}"
        if a["status"] == b["status"] == "ended":
            group = "gallery" if row["name"].split()[0] in ("upsetting", "ring", *FORMING_CASES) else row["name"].split()[0]
            ratios.setdefault("large" if "1e5" in row["name"] else group, []).append(ratio)
        iterations, cuts = (f"{a[key]} {b[key]}" for key in ("iterations", "cuts"))
        first, second = (min(s) for s in row["seconds"])
        scatter = f" (halved {100 * row['scatter']:.2f} %)" if "scatter" in row else ""
        print(
            f"{row['name']:26}{first:9.2f}{second:9.2f}{ratio:8.2f}{iterations:>13}{cuts:>9}"
            f"{100 * difference(a, b):8.2f}%  {status}{scatter}"
        )
    every = [r for group in ratios.values() for r in group]
    for group, found in {**ratios, "all that end twice": every}.items():
        print(f"{group}: {math.exp(sum(map(math.log, found)) / len(found)):.3f} (geometric mean of {len(found)})")


def main() -> None:
    """Compare two checkouts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("checkouts", nargs="*", type=Path)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--names", default=",".join(NAMES), help="problems, with commas between them")
    parser.add_argument("--file", type=Path, default=Path("pairs.jsonl"))
    parser.add_argument("--halved", action="store_true", help="scatter of the first checkout with half as long increments")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        serve()
        return
    rows = [json.loads(line) for line in asked.file.read_text().splitlines()] if asked.file.exists() else []
    if not asked.table:
        pair = [Checkout(where.resolve()) for where in asked.checkouts]
        for name in asked.names.split(","):
            found = {row["name"]: row for row in rows}
            row = found.get(name) or {"name": name, "seconds": [[], []]}
            if asked.halved:
                first = row["first"]
                row["scatter"] = difference(first, pair[0].run(name, halved=first))
            else:
                for checkout in pair:
                    checkout.run(name, small=True)
                for k in range(asked.repeat):
                    for key, checkout, seconds in zip(("first", "second"), pair, row["seconds"], strict=True):
                        row[key] = checkout.run(name)
                        seconds.append(round(row[key]["seconds"], 3))
                    if k == 0 and max(map(sum, row["seconds"])) > LONGEST:
                        break
            rows = [*(r for r in rows if r["name"] != name), row]
            asked.file.write_text("".join(json.dumps(r) + "\n" for r in rows))
    show(rows)


if __name__ == "__main__":
    main()
