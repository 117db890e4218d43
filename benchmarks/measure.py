"""One measurement a process, printed as a line of JSON: ``python benchmarks/measure.py limit hertz 20000``.

Processor time of one thread (set OMP_NUM_THREADS=1). ``run.py`` calls this for the whole table.

* ``limit hertz|upsetting UNKNOWNS [INCREMENTS]``: a history beside its factorisations and solves alone, by default and
  with factors of double precision throughout;
* ``iteration ELEMENTS [symmetric]``: one Newton iteration (evaluation, factorisation, solve) on a square block;
* ``memory UNKNOWNS``: peak of a run above what the packages take, beside that of the factorisation alone;
* ``elastic UNKNOWNS INCREMENTS [whole]``: a linear elastic history with friction beside one factorisation (LDLᵀ of the
  bodies), fields five times; ``whole``: the same with the whole system solved in every iteration;
* ``derivatives X Y [MU]``: upsetting on X × Y elements with derivatives by 1, 5, 6 and 10 parameters and a force in every
  increment, beside the run without; the least of nine rounds;
* ``followed X Y``: as ``derivatives``, by 5 and by 10 with two threads, of the wall, over the run alone with whichever of one and
  two threads is faster;
* ``adjoint X Y [ROUNDS]``: upsetting on X × Y elements, the force at the end by 5 parameters and by 20 points of a profile,
  backwards: processor time over that of the run alone, medians of pairs in turn.
* ``remeshing FAR NEAR PER_RADIUS``: new meshes at the beginning of a can, sizes in mm, beside the increments of the same run;
* ``share upsetting MU|can|FILE``: of a whole run that its new meshes take, with default sizes or as in a case file;
* ``start``: seconds of ``import prensa``, and from the command to the first iteration with kernels compiled before or not.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import common
import numpy as np

import prensa as pr
from prensa.policy import Policy


def of_limit(name: str, unknowns: str, most: str = "") -> dict[str, Any]:
    common.warm(common.sized(name, 200 if name == "upsetting" else 400, 0.5))
    problem, number = common.sized(name, int(unknowns)), int(most) if most else None
    c = common.cost(problem, most=number)
    double = common.cost(problem, most=number, policy=Policy(single_precision_from=10**9))
    return {
        "unknowns": c.unknowns, "increments": c.increments, "iterations": c.iterations, "total": c.total,
        "limit": c.limit.seconds, "outside": c.outside, "ratio": c.ratio, "factorisations": c.limit.factorisations,
        "double": double.limit.seconds, "double_total": double.total, "double_ratio": double.ratio,
    }  # fmt: skip


def of_iteration(elements: str, kind: str = "") -> dict[str, Any]:
    from prensa.linear.reduction import Reduced
    from prensa.system.matrix_symmetry import is_symmetric
    from prensa.system.planning import plan_step

    n = round(float(elements) ** 0.5)
    problem = common.hertz((n, n), 0.5)
    common.warm(common.hertz((7, 6), 0.5))
    system = pr.discretise(problem)
    state = system.initial()
    plan = plan_step(system, 0, state.step_start)
    c = system.context(state, plan, 1.0)
    reduced = Reduced.of(system, plan.fixed, pr.Numerics(), bool(kind) and is_symmetric(system, plan))
    # a state in the middle of the press, from which an iteration is like any other
    u = state.u.copy()
    u[plan.fixed] = 0.1 * plan.values(1.0)
    u[1 : 2 * system.nodes : 2] = -0.05 * (system.X[:, 1] / 40.0)
    best: dict[str, float] = {}
    with common.limit() as spent:
        for _ in range(4):
            before, start = replace(spent), time.process_time()
            e = system.evaluate(c, u, state.lam)
            evaluated = time.process_time()
            reduced.solve(reduced.matrix(e, -e.r), -e.r)
            total = time.process_time() - start - (spent.analysis - before.analysis)
            if not best or total < best["iteration"]:
                best = {
                    "iteration": total, "evaluation": evaluated - start,
                    "factorisation": spent.factorisation - before.factorisation,
                    "solves": spent.substitution - before.substitution,
                }  # fmt: skip
    return {"elements": n * n, "unknowns": system.ndof, "kind": kind or "unsymmetric"} | best


def of_memory(unknowns: str) -> dict[str, Any]:
    import resource

    import rslab
    from scipy.sparse import csc_matrix

    from prensa.linear import factorisations

    def peak() -> float:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

    common.warm(common.hertz((7, 6), 0.5))
    kept: list[Path] = []
    plain = factorisations.BACKENDS["rslab"]

    def noted(a: factorisations.Structure) -> factorisations.Factor:
        # on disk: a run that nobody measures has none of it in memory
        kept.append(Path(folder) / f"{len(kept)}.npz")
        np.savez(kept[-1], **a._asdict())
        return plain(a)

    def planned(file: Path) -> int:
        with np.load(file) as stored:
            a = factorisations.Structure(*(stored[k] if stored[k].ndim else stored[k].item() for k in
                factorisations.Structure._fields))
        pattern = csc_matrix((np.ones(len(a.indices)), a.indices, a.indptr), (a.n, a.n))
        path, options = ("ldlt", {}) if a.kind == factorisations.SYMMETRIC else ("lu", {"matching": False})
        return int(rslab.analyze(pattern, path=path, threads=1, **options, **factorisations.RACE).memory_plan()["peak_bytes"])

    factorisations.BACKENDS["rslab"] = noted
    with tempfile.TemporaryDirectory() as folder:
        before = peak()
        c = common.cost(common.sized("hertz", int(unknowns), 0.5), pr.Numerics(solver="rslab"), 1)
        rise = peak() - before  # read before the plans are made: an analysis takes memory too
        own = max(planned(file) for file in kept) / 2**20
    return {"unknowns": c.unknowns, "peak_MiB": rise, "factorisation_MiB": own, "ratio": rise / own}


def of_elastic(unknowns: str, increments: str, whole: str = "") -> dict[str, Any]:
    n = round((float(unknowns) / 2) ** 0.5)
    problem = common.elastic_history((n, n), int(increments))
    every = max(int(increments) // 5, 1)

    def history(condense: bool) -> tuple[float, int, common.Limit, list[np.ndarray]]:
        numerics = pr.Numerics(condense=condense)
        common.warm(common.elastic_history((8, 8), 5), numerics)
        with common.limit() as spent:
            start, iterations, forces, energies = time.process_time(), 0, [], []
            for k, inc in enumerate(pr.solve(problem, numerics)):
                iterations += inc.statistics.iterations
                forces.append(inc.force("cylinder"))
                energies.append(list(inc.energy.values()))
                if (k + 1) % every == 0:
                    inc.bodies  # noqa: B018  (fields, recovered when asked for)
            total = time.process_time() - start
        return total, iterations, spent, [np.array(forces), np.array(energies)]

    total, iterations, spent, values = history(True)
    one = spent.factorisation / spent.factorisations
    out = {
        "unknowns": 2 * (n + 1) ** 2 + 3, "increments": int(increments), "iterations": iterations, "total": total,
        "one_factorisation": one, "ratio": total / one, "analysis": spent.analysis, "substitution": spent.substitution,
        "factorisations": spent.factorisations, "columns": spent.columns,
    }  # fmt: skip
    if whole:
        seconds, _, other, expected = history(False)
        difference = max(np.abs(a - b).max() / np.abs(b).max() for a, b in zip(values, expected))
        out |= {
            "whole": seconds, "whole_factorisations": other.factorisations,
            "whole_one_factorisation": other.factorisation / other.factorisations, "difference": float(difference),
        }  # fmt: skip
    return out


def on_new_meshes(problem: pr.Problem) -> tuple[float, float, list[pr.Increment], int]:
    """Seconds of a run and of its remeshings, its increments and the most elements that it had."""
    from prensa.timer import Timer

    timer, begun, most = Timer(time.process_time), time.process_time(), 0
    increments = []
    for increment in pr.solve(problem, timer=timer):
        increments.append(increment)
        most = max(most, len(increment.state.history[0]))
    return time.process_time() - begun, timer.seconds["remeshing"], increments, most


def of_remeshing(far: str, near: str, per_radius: str) -> dict[str, Any]:
    from prensa.verify.remeshing import can

    on_new_meshes(can(1.0, 1.0, pr.Remesh(pr.Sizes(far=3.0, near_tools=1.0, per_radius=4.0)), 0.3))
    size = pr.Sizes(float(far), float(near), float(per_radius))
    total, remeshing, increments, elements = on_new_meshes(can(1.0, 1.0, pr.Remesh(size), 0.6))
    one, usual = remeshing / increments[-1].remeshings, (total - remeshing) / len(increments)
    iterations = sum(i.statistics.iterations for i in increments)
    return {
        "elements": elements, "increments": len(increments), "iterations": iterations, "remeshings": increments[-1].remeshings,
        "total": total, "one": one, "usual": usual, "ratio": one / usual, "share": remeshing / total,
    }  # fmt: skip


def of_share(name: str, mu: str = "0.1") -> dict[str, Any]:
    from prensa.verify.remeshing import billet, can

    on_new_meshes(can(1.0, 1.0, pr.Remesh(pr.Sizes(far=3.0, near_tools=1.0, per_radius=4.0)), 0.3))
    if name == "upsetting":
        problem = replace(billet(float(mu), 1.0, pr.Remesh()), remesh="auto")
    elif name == "can":
        problem = replace(can(1.0, float(mu) / 0.1, pr.Remesh()), remesh="auto")
    else:
        problem = pr.load(name).problem
    total, remeshing, increments, elements = on_new_meshes(problem)
    return {
        "elements": elements, "increments": len(increments), "remeshings": increments[-1].remeshings, "total": total,
        "remeshing": remeshing, "share": remeshing / total,
    }  # fmt: skip


PARAMETERS = (
    "contacts.0.friction.mu", "bodies.billet.material.flow.K", "bodies.billet.material.flow.n", "bodies.billet.material.flow.s0",
    "bodies.billet.material.E", "bodies.billet.material.nu", "bodies.billet.mesh.size.0", "bodies.billet.mesh.size.1",
    "bodies.billet.mesh.origin.1", "steps.0.move.punch.y.3.1",
)  # fmt: skip


def with_derivatives(problem: pr.Problem, count: int, clock: Callable[[], float], threads: Any = "auto") -> tuple[float, int]:
    """Seconds and increments of a run with derivatives of a force by so many parameters, asked for in every increment."""
    begun, increments = clock(), 0
    for inc in pr.solve(problem, pr.Numerics(threads=threads), derivatives=PARAMETERS[:count]):
        increments += 1
        inc.derivative("punch.force.y") if count else inc.force("punch")
    return clock() - begun, increments


def of_derivatives(nx: str, ny: str, mu: str = "0.1") -> dict[str, Any]:
    from prensa.verify.forming import upsetting

    counts = (0, 1, 5, 6, 10)

    reductions = (0.1, 0.2, 0.3)
    for count in (0, 10):
        with_derivatives(upsetting((4, 3), float(mu), reductions=reductions), count, time.process_time)
    problem = upsetting((int(nx), int(ny)), float(mu), reductions=reductions)
    rounds = [[with_derivatives(problem, count, time.process_time) for count in counts] for _ in range(9)]
    least = [min(r[k][0] for r in rounds) for k in range(len(counts))]
    return {"increments": rounds[0][0][1], "run": least[0]} | {
        f"by {count}": spent / least[0] for count, spent in zip(counts[1:], least[1:])
    }


def of_followed(nx: str, ny: str) -> dict[str, Any]:
    from prensa.verify.forming import upsetting

    reductions, runs = (0.1, 0.2, 0.3), ((0, 1), (0, 2), (5, 2), (10, 2))
    for count, threads in runs:
        with_derivatives(upsetting((4, 3), 0.1, reductions=reductions), count, time.perf_counter, threads)
    problem = upsetting((int(nx), int(ny)), 0.1, reductions=reductions)
    rounds = [[with_derivatives(problem, count, time.perf_counter, n)[0] for count, n in runs] for _ in range(9)]
    one, two, five, ten = (min(r[k] for r in rounds) for k in range(len(runs)))
    alone = min(one, two)
    return {"run": alone, "by 5": five / alone, "by 10": ten / alone}


def of_adjoint(nx: str, ny: str, rounds: str = "15") -> dict[str, Any]:
    """Medians of pairs in turn: `gradient` over the run alone, by five numbers, and by twenty points of a tool's outline."""
    import resource
    import statistics

    from prensa.verify.forming import upsetting

    def seconds(work: Callable[[], object]) -> float:
        begun = time.process_time()
        work()
        return time.process_time() - begun

    def alone(problem: pr.Problem) -> float:
        return seconds(lambda: [inc.force("punch") for inc in pr.solve(problem)])

    def ratio(n: tuple[int, int], shaped: bool, rounds: int) -> tuple[float, float]:
        problem = upsetting(n, 0.1, reductions=(0.1, 0.2, 0.3))
        by = list(PARAMETERS[:5])
        if shaped:
            points = tuple((1.6 * k, 0.02 * (k % 2)) for k in range(20))
            punch = pr.Profile(points=((-2.0, 0.0), *points, (40.0, 0.0)), fillet=4.0, touching="billet.top")
            problem, by = replace(problem, tools={"punch": punch}), [f"tools.punch.points.{k + 1}.1" for k in range(20)]
        pairs = [(alone(problem), seconds(lambda: pr.gradient(problem, "punch.force.y", by))) for _ in range(rounds)]
        return statistics.median(b / a for a, b in pairs), min(a for a, _ in pairs)

    for shaped in (False, True):
        ratio((4, 3), shaped, 1)
    n = (int(nx), int(ny))
    (five, run), (twenty, run_shaped) = (ratio(n, shaped, int(rounds)) for shaped in (False, True))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"run": run, "by 5": five, "run, profile": run_shaped, "by 20 points": twenty, "peak, MiB": peak}


def of_start() -> dict[str, Any]:
    def seconds(command: list[str], **more: str) -> float:
        start = time.perf_counter()
        subprocess.run(command, check=True, env=env | more, stdout=subprocess.DEVNULL)
        return time.perf_counter() - start

    # as for a user: Python may keep the bytecode of prensa beside the sources
    env = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    case = Path(__file__).parent / "first_iteration.yaml"
    out: dict[str, Any] = {}
    out["import"] = min(seconds([sys.executable, "-c", "import prensa"]) for _ in range(3))
    with tempfile.TemporaryDirectory() as folder:
        first = [sys.executable, str(Path(__file__).parent / "first_iteration.py"), str(case), folder]
        out["cold"] = seconds(first, NUMBA_CACHE_DIR=folder)
        out["warm"] = min(seconds(first, NUMBA_CACHE_DIR=folder) for _ in range(3))
    return out


MEASURES = {
    "limit": of_limit,
    "iteration": of_iteration,
    "memory": of_memory,
    "elastic": of_elastic,
    "derivatives": of_derivatives,
    "followed": of_followed,
    "adjoint": of_adjoint,
    "remeshing": of_remeshing,
    "share": of_share,
    "start": of_start,
}

if __name__ == "__main__":
    print(json.dumps(MEASURES[sys.argv[1]](*sys.argv[2:])))
