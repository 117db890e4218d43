"""The whole table: ``make bench`` writes benchmarks/RESULTS.md. Peers that are not installed are left out, and it says so.

``python benchmarks/run.py [--quick] [--only WORD …] [--old CHECKOUT] [--felupe PYTHON] [--pardiso PYTHON]``: quick takes small
sizes (minutes instead of half an hour); --old names a checkout of an earlier commit to run against; --felupe an interpreter that
has felupe (default: this one), --pardiso one that has prensa[mkl]; --space sizes of `in_space.py` to measure, --billet runs of
`calculix_in_space.py`, beside those of before. Every row is a process of its own, one after the other, with one thread. Sections
that are not measured keep what was measured before, each with its date.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import calculix_in_space
import common
import further_parameters
import in_space
import numpy as np

import prensa as pr

HERE = Path(__file__).parent
ENVIRONMENT = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
Rows = list[list[str]]
HEAD = """# Benchmarks

Written by `make bench`; what was measured on the way, and how, is in [HISTORY](HISTORY.md). Processor time of one thread unless
said. The speed of a machine changes by a third from hour to hour: ratios within a row are what to compare.
"""


def measured(script: str, *words: object, python: str = sys.executable) -> dict[str, Any]:
    """The line of JSON that a script of this folder prints, or why there is none."""
    command = [python, "-W", "ignore", str(HERE / script), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, check=False)
    if done.returncode:
        return {"skipped": (done.stderr.strip().splitlines() or ["failed"])[-1]}
    return dict(json.loads(done.stdout.strip().splitlines()[-1]))


def table(title: str, head: list[str], rows: Rows, note: str = "") -> str:
    """A section with a table."""
    lines = [f"## {title}", "", f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    lines += [f"| {' | '.join(r)} |" for r in rows]
    return "\n".join([*lines, "", note]).rstrip() + "\n"


def against_the_limit(quick: bool) -> str:
    """Histories beside their factorisations and solves, in double precision throughout and as it is by default."""
    rows: Rows = []
    large: list[tuple[str, float, object, float]] = [
        ("hertz", 1e5, 4, 1.25), ("upsetting", 1e5, 4, 1.25), ("upsetting", 6144, "", 1.6)
    ]  # fmt: skip
    for name, unknowns, most, goal in [("hertz", 2e4, 4, 2.5)] if quick else large:
        m = measured("measure.py", "limit", name, int(unknowns), most)
        if "skipped" in m:
            rows.append([name, f"{unknowns:.0f}", m["skipped"], "", "", "", "", "", ""])
            continue
        rows.append([
            name, str(m["unknowns"]), f"{'first ' if most else ''}{m['increments']}", str(m["iterations"]),
            f"{m['double_total']:.2f}", f"{m['double']:.2f}", f"**{m['double_ratio']:.2f}**", str(goal),
            f"{m['total']:.2f} ({m['ratio']:.2f})",
        ])  # fmt: skip
    head = ["history", "unknowns", "increments", "iterations", "total, s", "limit, s", "ratio", "goal", "as by default, s"]
    return table(
        "Against the factorisations and solves alone", head, rows,
        "Total: from the description on (meshing, pattern, evaluations, everything). Limit: what the linear solver spends in "
        "the same run on one analysis, the factorisations, the substitutions and giving the memory of factors back; all of "
        "double precision. By default factors are of single precision where that pays, in brackets over their own limit.",
    )  # fmt: skip


def against_before(old: str) -> str:
    """Upsetting in turn with an earlier commit, and wall time with one and two threads."""
    def printed(script: str, *words: str) -> str:
        command = [sys.executable, str(HERE / script), old, str(HERE.parent), *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    commit = ["git", "-C", old, "rev-parse", "--short", "HEAD"]
    name = subprocess.run(commit, capture_output=True, text=True, check=True).stdout.strip()
    return f"""## Against commit {name}

Runs in turn, the least of three; found are the forces (N) at 10, 20, 30, 40, 50 %:

{printed("against.py", "upsetting")}

Goals: 1.6, with μ = 0.3 1.4; forces as before to 0.02 %, or nearer to the step-converged ones, which are 183705, 235328, 295157,
373127, 484177 and 193844, 249300, 312600, 407900, 561200 with 32 × 24 elements, 183700, 235310, 295060, 372910, 485480 and
193450, 248260, 314830, 407240, 560070 with 64 × 48.

Wall time, 1e5 unknowns, runs in turn:

{printed("two_threads.py")}

Goals: one thread 1.3; two threads over one of the earlier commit 1.8.
"""


def elastic(quick: bool) -> str:
    """A small-strain elastic history of 50 increments beside one factorisation."""
    rows: Rows = []
    for unknowns, whole in ((2e4, "whole"),) if quick else ((2e4, "whole"), (1e5, "whole"), (1e6, "")):
        m = measured("measure.py", "elastic", int(unknowns), 50, whole)
        if "skipped" in m:
            rows.append([f"{unknowns:.0f}", m["skipped"], "", "", "", "", "", "15"])
            continue
        rows.append([
            str(m["unknowns"]), str(m["iterations"]), str(m["columns"]), f"{m['total']:.1f}",
            f"{m['one_factorisation']:.2f}", f"**{m['ratio']:.1f}**",
            f"{m['whole']:.1f} ({m['whole_factorisations']})" if whole else "", "15",
        ])  # fmt: skip
    head = [
        "unknowns", "iterations", "columns", "total, s", "one factorisation, s", "ratio", "whole system, s (factorisations)",
        "goal at 1e6",
    ]  # fmt: skip
    return table(
        "Small-strain elastic history, 50 increments with friction", head, rows,
        "Forces and energies every increment, fields five times; total from the description on (meshing, pattern, analysis, "
        "everything), against one LDLᵀ factorisation of the bodies. The bodies are condensed onto the unknowns that contact "
        "reaches by the blocked route: columns of the inverse, by substitutions with many right-hand sides, because the "
        "solver gives no partial factorisation. Whole system: `condense: false`, a factorisation in every iteration.",
    )  # fmt: skip


def remeshing(quick: bool) -> str:
    """New meshes beside usual increments."""
    rows: Rows = []
    for sizes in ((0.6, 0.3, 12),) if quick else ((0.6, 0.3, 12), (0.28, 0.14, 24)):
        m = measured("measure.py", "remeshing", *sizes)
        if "skipped" in m:
            rows.append([m["skipped"], "", "", "", "", "", ""])
            continue
        rows.append([
            str(m["elements"]), f"{m['increments']}/{m['iterations']}", str(m["remeshings"]), f"{m['one']:.2f}",
            f"{m['usual']:.2f}", f"**{m['ratio']:.1f}**", f"{100 * m['share']:.0f} %",
        ])  # fmt: skip
    note = "A new mesh: mesher, transfer, equilibrium. Goal: 4 usual increments at 5000 elements, 15 % of a run."
    head = ["T6", "increments/iterations", "new meshes", "one, s", "an increment, s", "increments for one", "of the run"]
    return table("Remeshing: the first 0.6 mm of a can", head, rows, note) + "\n" + shares(quick)


def shares(quick: bool) -> str:
    """What new meshes take of whole runs."""
    rows: Rows = []
    known = {
        "upsetting, μ = 0.1, auto": ("upsetting", 0.1),
        "upsetting, μ = 0.3, auto": ("upsetting", 0.3),
        "can to 6 mm, auto": ("can",),
        "closed die, as in examples": (str(HERE.parent / "examples/closed_die.yaml"),),
    }
    for name, words in list(known.items())[: 1 if quick else None]:
        m = measured("measure.py", "share", *words)
        if "skipped" in m:
            rows.append([name, m["skipped"], "", "", "", ""])
            continue
        rows.append([
            name, str(m["elements"]), str(m["increments"]), str(m["remeshings"]), f"{m['total']:.1f}",
            f"**{100 * m['share']:.1f} %**",
        ])  # fmt: skip
    head = ["run", "T6, at most", "increments", "new meshes", "total, s", "new meshes of it"]
    return table("Remeshing: its share of whole runs", head, rows, "Goal: at most 15 %.")


def derivatives(quick: bool) -> str:
    """Runs with derivatives beside the run alone."""
    rows: Rows = []
    for mesh in ((24, 18),) if quick else ((24, 18), (32, 24), (64, 48)):
        m, two = measured("measure.py", "derivatives", *mesh), measured("measure.py", "followed", *mesh)
        if "skipped" in m or "skipped" in two:
            rows.append([m.get("skipped") or two["skipped"], *[""] * 8])
            continue
        rows.append([
            f"{mesh[0]} × {mesh[1]}", str(m["increments"]), f"{m['run']:.2f}", f"{m['by 1']:.2f}", f"**{m['by 5']:.2f}**",
            f"{m['by 6']:.2f}", f"{m['by 10']:.2f}", f"**{two['by 5']:.2f}**", f"{two['by 10']:.2f}",
        ])  # fmt: skip
    note = (
        "Over the run alone, the force with its derivatives asked for in every increment; of the ten parameters three change the "
        "mesh. One thread: processor time. Two: of the wall, over the run alone with one or two, whichever is faster; from 1500 "
        "unknowns on one of them solves and one differentiates. Goal: 1.6 with five, 0.04 for each further one."
    )
    head = [
        "upsetting to 30 %, μ = 0.1", "increments", "run, s", "by 1", "by 5", "by 6", "by 10", "by 5, two threads", "by 10",
    ]  # fmt: skip
    return table("Derivatives by parameters of a case", head, rows, note)


def further(quick: bool) -> str:
    """What each further parameter adds to a run with derivatives."""
    counts = range(2, further_parameters.MOST + 1)
    rows: Rows = []
    for kind in ("q8",) if quick else further_parameters.KINDS:
        m = measured("further_parameters.py", kind, *((2,) if quick else ()))
        if "skipped" in m:
            rows.append([kind, "", m["skipped"], *[""] * (2 + len(counts))])
            continue
        size = f"{m['n'][0]} × {m['n'][1]}"
        rows.append([
            kind, size, f"{m['run']:.2f}", f"{m['by 1']:.2f}", *(f"{m[str(k)]:.1f}" for k in counts), f"**{m['mean']:.1f}**",
        ])  # fmt: skip
    head = ["problem", "elements", "run, s", "by 1", *(f"{k}, %" for k in counts), "mean, %"]
    note = (
        "Upsetting to 30 % in 30 increments, the force with its derivatives in every increment. By 1: over the run alone; then "
        "what the second to the tenth add, in per cent of the run alone: numbers of the law, then friction, places at the "
        "beginning, motions of the punch. Curve and metal: a user's flow curve and J2 plasticity, written as point functions. "
        "Processor time, of each increment the least of the rounds. Goal: at most 10."
    )
    return table("A further parameter", head, rows, note)


def backwards(quick: bool) -> str:
    """`gradient` beside the run alone."""
    rows: Rows = []
    for mesh in ((24, 18),) if quick else ((24, 18), (32, 24), (64, 48)):
        m = measured("measure.py", "adjoint", *mesh)
        if "skipped" in m:
            rows.append([m["skipped"], "", "", ""])
            continue
        rows.append([f"{mesh[0]} × {mesh[1]}", f"{m['run']:.2f}", f"**{m['by 5']:.2f}**", f"**{m['by 20 points']:.2f}**"])
    head = ["upsetting to 30 %, μ = 0.1", "run, s", "by 5 numbers", "by 20 points of the punch"]
    note = "The force at the end, backwards, over the run alone, medians of fifteen pairs. Goal: 1.5."
    return table("Gradients backwards", head, rows, note)


def growth(quick: bool) -> str:
    """Cost against size, and the exponent of what is not the linear solver."""
    sizes = (1e3, 1e4, 3e4) if quick else (1e3, 1e4, 1e5, 1e6)
    rows: Rows = []
    points = []
    for size in sizes:
        m = measured("measure.py", "limit", "hertz", int(size), 1)
        if "skipped" in m:
            rows.append([f"{size:.0f}", m["skipped"], "", "", ""])
            continue
        each = m["outside"] / m["iterations"]
        points.append((m["unknowns"], each))
        rows.append([
            str(m["unknowns"]), str(m["iterations"]), f"{m['total']:.2f}", f"{m['outside']:.2f}", f"{1e3 * each:.1f}"
        ])  # fmt: skip
    note = ""
    if len(points) > 2:
        x, y = np.log(np.array(points[1:])).T
        note = (
            f"Work outside the linear solver per iteration grows with exponent **{np.polyfit(x, y, 1)[0]:.2f}** from "
            f"{points[1][0]} unknowns on (goal: ≤ 1.0; below that size it is mostly Python)."
        )
    head = ["unknowns", "iterations", "total, s", "outside the solver, s", "outside per iteration, ms"]
    return table("Cost against size: first increment of the Hertz block", head, rows, note)


def space(quick: bool, sizes: list[str]) -> str:
    """Linear solvers of bodies in space and first increments, of all sizes that have been measured."""
    to = Path(tempfile.gettempdir()) / "in_space.jsonl" if quick else in_space.TO
    words = ["8", "--shapes", "cubes"] if quick else [*sizes, "--increment", "auto"]
    subprocess.run([sys.executable, str(HERE / "in_space.py"), *words, "--to", str(to)], env=ENVIRONMENT, check=True)
    return f"""## Linear solvers of bodies in space

One matrix of a billet that is pressed and slides (`in_space.py`), GMRES to 1e-6.

{in_space.page(in_space.stored(to))}

Goals: at most 25 iterations with LDLᵀ, 100 with multigrid, else LDLᵀ takes over; at 1e5 unknowns a third of LU's time; time of
a solution about N^1.35 by what `solver: auto` takes (LDLᵀ up to 150 000 unknowns, multigrid beyond); an increment of 3e5 unknowns
in 6 GB. The last table is of whole runs of one increment, with all that they write.
"""


def billet(quick: bool, runs: list[str]) -> str:
    """A square billet in space beside CalculiX, of all runs that have been measured."""
    to = Path(tempfile.gettempdir()) / "calculix_in_space.jsonl" if quick else calculix_in_space.TO
    words = ["prensa:6", "C3D8R:6"] if quick else runs
    subprocess.run(
        [sys.executable, str(HERE / "calculix_in_space.py"), *words, "--to", str(to)], env=ENVIRONMENT, check=True
    )
    known = in_space.stored(to)
    rows, title = list(calculix_in_space.compared(known)), f"Square billet in space, μ = {calculix_in_space.MU}"
    speed = table(title, calculix_in_space.HEAD, rows, calculix_in_space.NOTE)
    rows = list(calculix_in_space.errors(known))
    # within the section: a title of its own would be another one
    return f"{speed}\n{table('', calculix_in_space.HEAD_OF_ERRORS, rows, calculix_in_space.NOTE_OF_ERRORS)[4:].lstrip()}"


# seconds that one iteration was to take, LU and symmetric, on a machine where CalculiX and felupe took these
GOALS, PEERS = (0.9, 0.6), {"CalculiX": 5.2, "felupe": 4.1}


def newton(quick: bool, felupe: str, pardiso: str) -> str:
    """One Newton iteration at 100 000 Q4: rslab, PARDISO where there is an interpreter that has it, and the peers."""
    n = 100 if quick else 316
    rows: Rows = []
    peers: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        mesh = hertz_mesh((n, n), folder)
        for name, m in (
            ("CalculiX", measured("calculix.py", "iteration", n, n, 900)),
            ("felupe", measured("felupe_hertz.py", mesh, 1, 0.5, python=felupe)),
        ):
            if "iteration" in m and m["ended"] == "completed":
                peers[name] = m["iteration"]
            rows.append([name, "LDLᵀ" if name == "CalculiX" else "LU", "", "", "", m.get("skipped", ""), "", ""])
            if name in peers:
                rows[-1][5] = f"**{peers[name]:.2f}**"
    ways = [("rslab", sys.executable, "LDLᵀ"), *([("PARDISO", pardiso, "LLᵀ")] if pardiso else [])]
    for solver, python, factors in ways:
        for kind, goal in zip(("", "symmetric"), GOALS):
            m = measured("measure.py", "iteration", n * n, kind, python=python)
            if "skipped" in m:
                rows.append([f"prensa, {solver}", factors if kind else "LU", "", "", "", m["skipped"], "", ""])
                continue
            ratios = [
                f"**{peers[name] / m['iteration']:.1f}** ({PEERS[name] / goal:.1f})" if name in peers else ""
                for name in PEERS
            ]
            rows.append(
                [f"prensa, {solver}", factors if kind else "LU"]
                + [f"{m[k]:.2f}" for k in ("evaluation", "factorisation", "solves")]
                + [f"**{m['iteration']:.2f}**", *ratios]
            )
    head = ["program", "factors", "evaluation, s", "factorisation, s", "solves, s", "iteration, s"]
    head += [f"{name} over it (goal)" for name in PEERS]
    return table(
        f"One Newton iteration, {n * n} Q4", head, rows,
        "The goals were set as 0.9 s (LU) and 0.6 s (symmetric) on a machine where an iteration of CalculiX takes 5.2 s and one "
        "of felupe 4.1 s; the ratios are what of that a slower or faster machine keeps. Each program from one iteration to the "
        "next; CalculiX an increment of several iterations over their number, with its reading of the deck.",
    )  # fmt: skip


def memory(quick: bool) -> str:
    """Peak memory beside the factorisation's own."""
    rows: Rows = []
    for size, goal in {1e4: ""}.items() if quick else {1e5: "1.7", 1e6: "2.0 GB (1907 MiB)"}.items():
        m = measured("measure.py", "memory", int(size))
        rows.append(
            [str(m["unknowns"]), f"{m['peak_MiB']:.0f}", f"{m['factorisation_MiB']:.0f}", f"**{m['ratio']:.2f}**", goal]
            if "skipped" not in m
            else [f"{size:.0f}", m["skipped"], "", "", goal]
        )
    head = ["unknowns", "peak of the run, MiB", "of a factorisation in double precision, MiB", "ratio", "goal"]
    return table("Memory: first increment of the Hertz block", head, rows)


def start(quick: bool) -> str:
    """Start-up times, of the wall."""
    m = measured("measure.py", "start")
    if "skipped" in m:
        return table("Start-up", ["what", "s"], [["", m["skipped"]]])
    rows = [
        ["`import prensa`", f"**{m['import']:.2f}**", "0.4"],
        ["command to first iteration, kernels on the disk", f"**{m['warm']:.2f}**", "1.5"],
        ["command to first iteration, kernels compiled", f"**{m['cold']:.1f}**", "12"],
    ]
    return table("Start-up (wall time)", ["what", "s", "goal"], rows)


def at(depths: list[float], forces: list[float], wanted: float) -> str:
    """A force at a depth, if it was reached."""
    found = [f for d, f in zip(depths, forces) if abs(d - wanted) < 1e-9]
    return f"{found[0]:.0f}" if found else "not reached"


def hertz_mesh(n: tuple[int, int], folder: str) -> Path:
    """File with the mesh of the Hertz block for a peer to read."""
    system = pr.discretise(common.hertz(n))
    edges = {e: system.boundary_nodes(f"block.{e}") for e in ("top", "bottom", "left")}
    path = Path(folder) / "mesh.npz"
    np.savez(path, X=system.X, cells=system.blocks[0].cells, **edges)
    return path


def hertz_of_peers(quick: bool, felupe: str) -> str:
    """Hertz block to 8 mm: prensa, CalculiX, felupe."""
    n = (28, 24) if quick else (112, 91)
    ours = measured("peers.py", "hertz", *n)
    rows: Rows = []

    def add(name: str, m: dict[str, Any]) -> None:
        if "skipped" in m:
            rows.append([name, m["skipped"], "", "", "", ""])
            return
        base = ours["seconds"]
        forces = [at(m["depth"], m["force"], d) for d in (1.0, 4.0, 8.0)]
        rows.append([name, f"{m['seconds']:.1f}", f"**{m['seconds'] / base:.1f}**", *forces])

    add("prensa, F-bar (default)", ours)
    add("prensa, plain Q4", measured("peers.py", "hertz", *n, "q4"))
    add("CalculiX", measured("calculix.py", "hertz", *n, 900))
    with tempfile.TemporaryDirectory() as folder:
        mesh = hertz_mesh(n, folder)
        for substeps in (8, 16, 32):
            m = measured("felupe_hertz.py", mesh, substeps, python=felupe)
            if m.get("ended", "completed") == "completed":
                break
    add(f"felupe, {substeps} substeps", m)
    head = ["program", "processor time, s", "over prensa", "P at 1 mm", "P at 4 mm", "P at 8 mm"]
    return table(
        f"Hertz block, {n[0] * n[1]} Q4, neo-Hooke to 8 mm", head, rows,
        "Goal: at least ten times. CalculiX has another volumetric energy (see `calculix.py`), whence its lower force at "
        "8 mm; felupe's energy is the same.",
    )  # fmt: skip


def upsetting_of_peers(quick: bool) -> str:
    """Frictional upsetting: prensa, CalculiX."""
    n = (16, 12) if quick else (32, 24)
    rows: Rows = []
    # before and after the other, because the speed of a machine may change in between
    ours = measured("peers.py", "upsetting", *n)
    theirs = measured("calculix.py", "upsetting", *n, 900)
    ours["seconds"] = 0.5 * (ours["seconds"] + measured("peers.py", "upsetting", *n)["seconds"])
    for name, m in (("prensa", ours), ("CalculiX", theirs)):
        if "skipped" in m:
            rows.append([name, m["skipped"], "", "", "", ""])
            continue
        forces = m["force"]
        rows.append(
            [name, f"{m['seconds']:.1f}", f"**{m['seconds'] / ours['seconds']:.1f}**"]
            + [at(m["depth"], forces, 7.5 * r) for r in (0.1, 0.3, 0.5)]
        )
    from prensa.reference import tables

    known = tables.UPSETTING_FORCE_MU_01["cauchy"]
    rows.append(
        ["independent solver", "", "", *(f"{1e3 * known[r]:.0f}" if r in known else "" for r in (0.1, 0.3, 0.5))]
    )
    ended = theirs.get("ended", "")
    head = ["program", "processor time, s", "over prensa", "F at 10 %", "F at 30 %", "F at 50 %"]
    fine = {} if quick else measured("peers.py", "upsetting", 64, 48)
    alone = f" prensa on 64 × 48: **{fine['seconds']:.1f} s** (goal: 15)." if "seconds" in fine else ""
    return table(
        f"Upsetting, {n[0]} × {n[1]}, μ = 0.1 to 50 %", head, rows,
        "Goal: at least five times." + (f" CalculiX: {ended}." if ended else "") + alone,
    )  # fmt: skip


def convergence(quick: bool) -> str:
    """Order of Newton's iteration in space, what GMRES costs it, first contacts and starts of sliding."""
    to = Path(tempfile.gettempdir() if quick else "results") / "newton.jsonl"
    words = ["--only", "random", "--count", "4"] if quick else []
    subprocess.run([sys.executable, "-m", "prensa_bench.newton", *words, "--to", str(to)], env=ENVIRONMENT, check=True)
    from prensa_bench import newton as of_newton

    return f"""## Newton's iteration in space

{of_newton.page(of_newton.stored(to))}

{of_newton.GOALS}
"""


def put(text: str, order: list[str], name: str, section: str) -> str:
    """The file with a section in its place, today's date and this machine below it; the others as they were."""
    known = dict(re.findall(r"<!-- (\w+) -->\n(.*?)(?=\n<!-- |\Z)", text, re.DOTALL))
    known[name] = f"{section.rstrip()}\n\n{datetime.date.today()}, {common.machine()}\n"
    return HEAD + "".join(f"\n<!-- {part} -->\n{known[part]}" for part in order if part in known)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--old", default="", metavar="CHECKOUT")
    parser.add_argument("--felupe", default=os.environ.get("FELUPE_PYTHON", sys.executable))
    parser.add_argument("--pardiso", default=os.environ.get("PARDISO_PYTHON", ""))
    parser.add_argument("--space", nargs="*", default=["15", "24", "34"], metavar="N", help="sizes of in_space.py")
    parser.add_argument(
        "--billet", nargs="*", default=[
            "prensa:12", "C3D8R:12", "C3D8I:12", "C3D20R:8", "prensa:24", "C3D8R:24", "prensa/6:12", "prensa-bdf2/6:12",
            "prensa/18:12", "prensa@0.1:12", "prensa-bdf2/400:12", "C3D8R@0.0025:12", "C3D8R/18:12", "C3D8R/100:12",
        ], metavar="PROGRAM:N", help="runs of calculix_in_space.py",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, default=HERE / "RESULTS.md")
    a = parser.parse_args()
    parts: dict[str, Callable[[], str]] = {
        "hertz": lambda: hertz_of_peers(a.quick, a.felupe),
        "upsetting": lambda: upsetting_of_peers(a.quick),
        "limit": lambda: against_the_limit(a.quick),
        "elastic": lambda: elastic(a.quick),
        "newton": lambda: newton(a.quick, a.felupe, a.pardiso),
        "start": lambda: start(a.quick),
        "memory": lambda: memory(a.quick),
        "growth": lambda: growth(a.quick),
        "before": lambda: against_before(a.old),
        "derivatives": lambda: derivatives(a.quick),
        "further": lambda: further(a.quick),
        "adjoint": lambda: backwards(a.quick),
        "remeshing": lambda: remeshing(a.quick),
        "space": lambda: space(a.quick, a.space),
        "billet": lambda: billet(a.quick, a.billet),
        "convergence": lambda: convergence(a.quick),
    }
    for name, part in parts.items():
        if (a.only and name not in a.only) or (name == "before" and not a.old):
            continue
        print(f"{name} …", flush=True)
        a.out.write_text(put(a.out.read_text() if a.out.exists() else "", list(parts), name, part()))
    print(f"{a.out} written")


if __name__ == "__main__":
    main()
