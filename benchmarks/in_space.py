"""Linear solvers of bodies in space: ``python benchmarks/in_space.py 15 24 34 46 69`` measures cubes of so many bricks.

LU of the tangent A in double precision, LDLᵀ of the symmetric P in single precision, and multigrid of P, the latter two under
flexible GMRES on A to 1e-6, about what Newton's steps ask for. One matrix each: an eighth of a billet that is pressed with
friction 0.3 and slides, elastic or plastic, its bricks from cubes to flat by ten and drawn out by five, and a wedge whose bricks
are from cubes to flat by ten. Seconds of the processor, one thread: set-up (factors or hierarchy; the analysis of the pattern,
done once a run, apart) and solution. Memory: by how much the peak of a process grows that does nothing else. With
``--increment`` also a first increment of a whole run, as ``prensa run`` makes it, with all that it writes.

From 1e4 to 1e6 unknowns: 15 24 34 46 69. LU takes a minute and 8 GB at 3e5: ``--lu 34`` asks for it up to 34³ bricks,
``--ldlt 46`` likewise; ``--shapes``, ``--materials`` choose rows. Each figure is a process of its own and a line of the file
``--to``; what is there is not measured again, so that a measurement that was stopped goes on. Each line holds the state of
the linear solvers that it was measured with; the tables mark those of another one than the present. ``run.py --only space``
writes the page.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import math
import multiprocessing
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

import prensa as pr
from prensa.errors import PrensaError
from prensa.linear.factorisations import Factorisation
from prensa.linear.iterative import LDLT, MULTIGRID, Iterative
from prensa.linear.reduction import Reduced
from prensa.policy import Policy
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step
from prensa.system.system import System
from prensa.types import Array

SHAPES = {"cubes": 1.0, "flat 2": 0.5, "flat 5": 0.2, "flat 10": 0.1, "drawn 5": 5.0, "wedge": 1.0}
MATERIALS = {
    "elastic": pr.Elastic(200e3, 0.3),
    "n 0.2": pr.J2(200e3, 0.3, pr.Swift(600.0, 0.01, 0.2)),
    "n 0.05": pr.J2(200e3, 0.3, pr.Swift(600.0 * 0.01**0.15, 0.01, 0.05)),
}
SHARE, PRESSURE, RATE, THIN = 1e-6, 400.0, 0.02, 0.1
FIRST = 0.005
"""Share of the height by which the first increment of a run presses."""
TO = Path("results/in_space.jsonl")
NAMES = {"lu": "LU", LDLT: "LDLᵀ", MULTIGRID: "multigrid"}
EARLIER = "\\*"
"""Marks what was measured with another state of the linear solvers than the present."""
Row = dict[str, Any]


@functools.cache
def state() -> str:
    """Digest of the sources of the linear solvers."""
    folder = Path(pr.__file__).parent
    files = [*sorted((folder / "linear").glob("*.py")), folder / "kernels" / "smoothers.py"]
    return hashlib.sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:12]


def mark(row: Row) -> str:
    """`EARLIER` where a row is not of the present state."""
    return "" if row.get("state") == state() else EARLIER


def billet(n: int, shape: str, material: str) -> pr.Problem:
    """An eighth of a billet of n³ bricks of a shape; a wedge's height falls to a tenth along x."""
    h = SHAPES[shape]
    mesh: pr.Box | pr.Bricks = pr.Box((1.0, h, 1.0), (n, n, n))
    normal = (0.0, -1.0, 0.0)
    if shape == "wedge":
        mesh, normal = wedge(mesh), ((1.0 - THIN) * h, -1.0, 0.0)
    return pr.Problem(
        "billet", space="solid", friction=pr.Coulomb(0.3), bodies={"b": pr.Body(mesh, MATERIALS[material])},
        tools={"t": pr.Plane(normal=normal, at=(1.0, h, 0.0))}, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.bottom": "y", "b.left": "x", "b.back": "z"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.1 * h)}, increments=2),),
    )  # fmt: skip


def wedge(box: pr.Box) -> pr.Bricks:
    """The bricks of a box with their heights falling along x, their inner nodes displaced at random by a tenth of an edge."""
    solid = pr.Problem("box", space="solid", bodies={"b": pr.Body(box, MATERIALS["elastic"])},
                       tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),),
                       steps=(pr.Step("s", move={"t": pr.Motion(y=0.0)}),))  # fmt: skip
    mesh = discretise(solid).meshes["b"]
    x, size = mesh.points.copy(), np.array(box.size)
    inner = ((x > 0) & (x < size)).all(axis=1)
    x[inner] += np.random.default_rng(0).uniform(-0.1, 0.1, (inner.sum(), 3)) * size / box.n
    x[:, 1] *= THIN + (1.0 - THIN) * x[:, 0]
    sides = {name: tuple(np.unique(faces).tolist()) for name, faces in mesh.edges.items()}
    return pr.Bricks(tuple(map(tuple, x.tolist())), tuple(map(tuple, mesh.cells.tolist())), sides)


def squeezed(x: Array, height: float, taper: bool) -> Array:
    """Displacements (n, 3) of isochoric flow at places x (n, 3), to first order: a barrel, or a wedge that keeps its slope."""
    if taper:
        return RATE * x * (-1.0, -1.0, 2.0)
    y = x[:, 1]
    more = 1.0 + 0.3 * np.cos(np.pi * y / height)
    down = y + 0.3 * height / np.pi * np.sin(np.pi * y / height)
    return RATE * np.column_stack([0.5 * more * x[:, 0], -down, 0.5 * more * x[:, 2]])


def flowing(n: int, shape: str, material: str) -> tuple[System, Reduced, Array, Array]:
    """A system, its equations, the matrix and right-hand side of a state in which it flows and slides, found without a solver."""
    system = discretise(billet(n, shape, material))
    plan, state, h = plan_step(system, 0, np.zeros(system.ndof)), system.initial(), SHAPES[shape]
    taper, s = shape == "wedge", system.surfaces[0]
    for time_ in (0.5, 1.0):
        c = system.context(state, plan, time_)
        u = state.u.copy()
        x = system.positions(u)
        d = squeezed(x, h, taper)
        system.displacement(u)[:] += d
        tool = system.tool_dof(0)
        u[tool + 1] -= RATE * ((THIN * h) if taper else h)
        # contact points are put where the penalty presses as much as such a body bears
        gap = system.nodes_seen(s, u)
        nodes = s.points.nodes
        depth = PRESSURE / c.scales[0].k_n
        system.displacement(u)[nodes] += (-depth - gap.g[: len(nodes)])[:, None] * gap.n[: len(nodes)]
        system.displacement(u)[:] *= ~np.isin(
            system.dofs.displacement.dofs(np.arange(system.nodes)), plan.fixed
        )  # held nodes stay
        e = system.evaluate(c, u, state.lam)
        if time_ < 1.0:
            state = replace(state, u=u, history=e.history, contact=e.contacts[0].record)
            state = replace(state, clock=state.clock._replace(time=time_))
    assert not e.failed, e.failed
    reduced = Reduced.of(system, plan.fixed, pr.Numerics(solver=LDLT, threads=1), policy=Policy())
    return system, reduced, reduced.matrix(e, -e.r), reduced.restriction.part(-e.r)


def memory(key: str) -> float:
    """A figure (MB) of this process: VmRSS, what it has; VmHWM, its peak."""
    line = next(s for s in Path("/proc/self/status").read_text().splitlines() if s.startswith(key))
    return float(line.split()[1]) / 1024


def by_lu(reduced: Reduced, matrix: Array, b: Array) -> Row:
    """Analysis, factors and solution by LU of A in double precision."""
    f = reduced.factorisation
    assert isinstance(f, Iterative)
    direct = Factorisation(*f.direct.structure[:3], policy=f.policy, spatial=True)
    t = [time.process_time()]
    direct.analyse()
    t.append(time.process_time())
    x = direct.solve(matrix[: f._entries], b)
    t.append(time.process_time())
    direct.solve_with_factors(b)
    t.append(time.process_time())
    return {"iterations": 0, **seconds(t), "residual": left(reduced, matrix, x, b)}


def by_gmres(way: str) -> Callable[[Reduced, Array, Array], Row]:
    """Analysis, set-up and solution by GMRES with a preconditioner."""

    def solve(reduced: Reduced, matrix: Array, b: Array) -> Row:
        f = reduced.factorisation
        assert isinstance(f, Iterative)
        f = Iterative(f.direct, (way,), f.part, f._system, f._free, f.policy)
        A = f._tangent(matrix)
        t = [time.process_time()]
        f.analyse()
        t.append(time.process_time())
        M = f._preconditioner(way, A, matrix[f._entries :])
        t.append(time.process_time())
        x = f._krylov(A, M, b, SHARE)
        t.append(time.process_time())
        residual = math.inf if x is None else left(reduced, matrix, x, b)
        return {"iterations": f.krylov_iterations, **seconds(t), "residual": residual}

    return solve


def seconds(t: list[float]) -> Row:
    """Of analysis, set-up and solution, from the times before, between and after."""
    return dict(zip(("analysis", "setup", "solution"), np.diff(t).tolist()))


def first_increment(n: int, shape: str, material: str, way: str) -> Row:
    """A run of one increment from its description on, with everything that it writes."""
    from prensa.output.run import run

    problem = billet(n, shape, material)
    step = replace(problem.steps[0], move={"t": pr.Motion(y=-FIRST * SHAPES[shape])}, increments=1)
    case = pr.Case(replace(problem, steps=(step,)), pr.Numerics(solver=way, threads=1))
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        run(case, out=folder, quiet=True)
        made = json.loads((Path(folder) / "summary.json").read_text())
    return {
        "seconds": time.process_time() - began, "wall": made["timings"], "solver": made["linear_solver"]["solver"],
        "krylov": made["linear_solver"]["krylov_iterations"], "iterations": made["totals"]["iterations"],
    }  # fmt: skip


def left(reduced: Reduced, matrix: Array, x: Array, b: Array) -> float:
    """Relative residual of a solution."""
    return float(np.linalg.norm(reduced.restriction.sparse(matrix) @ x - b) / np.linalg.norm(b))


def apart(measure: Callable[..., Row], *given: Any) -> Row:
    """What is measured in a process of its own, and the memory that it took (MB)."""

    def measured(to: Connection) -> None:
        Path("/proc/self/clear_refs").write_text("5")  # the peak is counted from here
        before = memory("VmRSS")
        try:
            row = measure(*given)
        except (ArithmeticError, PrensaError) as error:
            row = {"failed": str(error)}
        to.send(row | {"MB": memory("VmHWM") - before, "state": state()})

    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("fork").Process(target=measured, args=(there,))
    process.start()
    there.close()
    try:
        return dict(here.recv())
    except EOFError:
        return {"failed": "ran out of memory"}
    finally:
        process.join()


def stored(to: Path) -> list[Row]:
    """Rows that have been measured."""
    return [json.loads(line) for line in to.read_text().splitlines()] if to.exists() else []


def missing(a: argparse.Namespace, known: list[Row]) -> Iterator[Row]:
    """Rows that are asked for and not known, measured one after the other."""
    of = ("n", "shape", "material", "kind")
    done = {tuple(row[k] for k in of) for row in known}
    for n in a.n:
        kinds: dict[str, Callable[[Reduced, Array, Array], Row]] = {MULTIGRID: by_gmres(MULTIGRID)}
        kinds |= {LDLT: by_gmres(LDLT)} if n <= a.ldlt else {}
        kinds |= {"lu": by_lu} if n <= a.lu else {}
        for shape in a.shapes:
            for material in a.materials:
                case = (n, shape, material)
                todo = {name: solve for name, solve in kinds.items() if (*case, name) not in done}
                if todo:
                    _, *given = flowing(*case)
                    for name, solve in todo.items():
                        yield dict(zip(of, (*case, name))) | {"unknowns": len(given[2])} | apart(solve, *given)
                    del given
                for way in a.increment:
                    if (*case, f"increment {way}") not in done:
                        made = apart(first_increment, *case, way)
                        yield dict(zip(of, (*case, f"increment {way}"))) | made


def solutions(rows: list[Row]) -> Iterator[list[str]]:
    """Lines of the table of solutions: a size, shape and material each, with what every solver takes."""
    cases = {(r["unknowns"], r["shape"], r["material"]): None for r in rows if r["kind"] in NAMES}
    order = list(SHAPES)
    for case in sorted(cases, key=lambda c: (c[0], order.index(c[1]), c[2])):
        line = [str(case[0]), *case[1:]]
        for kind in NAMES:
            found = [r for r in rows if r["kind"] == kind and (r["unknowns"], r["shape"], r["material"]) == case]
            line.append(words(found[-1]) if found else "")
        yield line


def words(row: Row) -> str:
    """Set-up + solution (iterations), memory of a row."""
    if "failed" in row:
        return str(row["failed"]) + mark(row)
    its = "" if row["kind"] == "lu" else f" ({'over ' if math.isinf(row['residual']) else ''}{row['iterations']})"
    return f"{row['setup']:.2f} + {row['solution']:.2f}{its}, {row['MB']:.0f}{mark(row)}"


def exponents(rows: list[Row], least: int = 90_000) -> Iterator[str]:
    """Of the time of a solution over the unknowns, from the first size above ``least`` on, of shapes that have more of them."""
    for kind in NAMES:
        for shape in SHAPES:
            for material in MATERIALS:
                same = (kind, shape, material)
                found = [r for r in rows if (r["kind"], r["shape"], r["material"]) == same and r.get("residual", math.inf) < 1.0]
                size = {r["unknowns"]: r["setup"] + r["solution"] for r in found if r["unknowns"] > least}
                if len(size) > 1:
                    x, y = np.log(list(size)), np.log(list(size.values()))
                    yield f"{NAMES[kind]}, {shape}, {material}: {np.polyfit(x, y, 1)[0]:.2f}"


def increments(rows: list[Row]) -> Iterator[list[str]]:
    """Lines of the table of first increments."""
    for r in sorted((r for r in rows if r["kind"].startswith("increment")), key=lambda r: r["n"]):
        if "failed" in r:
            yield [f"{r['n']}³", r["shape"], r["material"], r["failed"], *[""] * 5]
            continue
        # seconds of the wall by section, which other processes stretch all alike
        of_solver = r["wall"]["factorisation and solve"] / sum(v for v in r["wall"].values() if isinstance(v, float))
        yield [
            f"{r['n']}³", r["shape"], r["material"], NAMES[r["solver"]], str(r["iterations"]), str(r["krylov"]),
            f"{r['seconds']:.1f}", f"{100 * of_solver:.0f} %", f"{r['MB']:.0f}{mark(r)}",
        ]  # fmt: skip


def table(head: str, lines: Iterator[list[str]]) -> str:
    """A table with columns as the ``head`` names them, by commas."""
    names = head.split(", ")
    return "\n".join(["| " + " | ".join(c) + " |" for c in (names, ["---"] * len(names), *lines)])


def page(rows: list[Row]) -> str:
    """The tables of all rows."""
    return "\n\n".join([
        table("unknowns, bricks, material, LU of A, LDLᵀ of P, multigrid of P", solutions(rows)),
        "Set-up + solution in seconds (iterations), memory in MB."
        + (f" {EARLIER} With an earlier state of the linear solvers." if any(map(mark, rows)) else ""),
        "Growth of set-up + solution, exponent of the unknowns from 1e5 on: " + "; ".join(exponents(rows)) + ".",
        table("bricks, shape, material, solver, iterations, Krylov, total s, in the solver, MB", increments(rows)),
    ])  # fmt: skip


def main() -> None:
    """Measure what is missing and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("n", nargs="*", type=int)
    parser.add_argument("--lu", type=int, default=34)
    parser.add_argument("--ldlt", type=int, default=60)
    parser.add_argument("--shapes", nargs="+", default=list(SHAPES), choices=SHAPES)
    parser.add_argument("--materials", nargs="+", default=list(MATERIALS), choices=MATERIALS)
    parser.add_argument("--increment", nargs="*", default=[], choices=("auto", *NAMES))
    parser.add_argument("--to", type=Path, default=TO)
    a = parser.parse_args()
    a.to.parent.mkdir(parents=True, exist_ok=True)
    if a.n:
        _, *given = flowing(9, "flat 2", "elastic")  # kernels are compiled before, those of levels too
        by_gmres(MULTIGRID)(*given)  # rslab's threads do not survive a fork: here it must not be used
    for row in missing(a, stored(a.to)):
        with a.to.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(row, flush=True)
    print(page(stored(a.to)))


if __name__ == "__main__":
    main()
