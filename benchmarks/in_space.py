"""Linear solvers of bodies in space: ``python benchmarks/in_space.py 15 24 34`` prints a table for cubes of so many bricks.

LU of the tangent A in double precision, LDLᵀ of the symmetric P in single precision, and multigrid of P, the latter two under
flexible GMRES on A to 1e-6, about what Newton's steps ask for. One matrix each: an eighth of a billet that is pressed with
friction 0.3 and slides, elastic or plastic, its bricks from cubes to flat by ten and drawn out by five, and a wedge whose bricks
are from cubes to flat by ten. Seconds of the processor, one thread: set-up (factors or hierarchy; the analysis of the pattern,
done once a run, apart) and solution. Memory: by how much the peak of a process grows that does nothing else.

From 1e4 to 1e6 unknowns: ``python benchmarks/in_space.py 15 24 34 46 69``. LU takes a minute and 8 GB at 3e5: ``--lu 34`` asks
for it up to 34³ bricks, ``--ldlt 46`` likewise; ``--shapes``, ``--materials`` choose rows.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

import prensa as pr
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


def by_lu(reduced: Reduced, matrix: Array, b: Array) -> str:
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
    return f"LU | | {t[1] - t[0]:.2f} | {t[2] - t[1]:.2f} | {t[3] - t[2]:.2f} | {left(reduced, matrix, x, b):.0e}"


def by_gmres(way: str) -> Callable[[Reduced, Array, Array], str]:
    """Analysis, set-up and solution by GMRES with a preconditioner."""

    def solve(reduced: Reduced, matrix: Array, b: Array) -> str:
        f = reduced.factorisation
        assert isinstance(f, Iterative)
        f = Iterative(f.direct, (way,), f.places, f._system, f._free, f.policy)
        A = f._tangent(matrix)
        t = [time.process_time()]
        if way == LDLT:
            f.analyse_ldlt()
        t.append(time.process_time())
        M = f._preconditioner(way, A, matrix[f._entries :])
        t.append(time.process_time())
        x = f._krylov(A, M, b, SHARE)
        t.append(time.process_time())
        name = "LDLᵀ" if way == LDLT else "multigrid"
        its = f"{f.krylov_iterations}" if x is not None else f"over {f.krylov_iterations}"
        rest = "" if x is None else f"{left(reduced, matrix, x, b):.0e}"
        return f"{name} | {its} | {t[1] - t[0]:.2f} | {t[2] - t[1]:.2f} | {t[3] - t[2]:.2f} | {rest}"

    return solve


def left(reduced: Reduced, matrix: Array, x: Array, b: Array) -> float:
    """Relative residual of a solution."""
    return float(np.linalg.norm(reduced.restriction.sparse(matrix) @ x - b) / np.linalg.norm(b))


def apart(solve: Callable[[Reduced, Array, Array], str], given: tuple[Reduced, Array, Array]) -> str:
    """What a solver says in a process of its own, and the memory that it took (MB)."""

    def measured(to: Connection) -> None:
        Path("/proc/self/clear_refs").write_text("5")  # the peak is counted from here
        before = memory("VmRSS")
        words = solve(*given)
        to.send(f"{words} | {memory('VmHWM') - before:.0f}")

    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("fork").Process(target=measured, args=(there,))
    process.start()
    there.close()
    try:
        return str(here.recv())
    except EOFError:
        return "it ran out of memory | | | | | | "
    finally:
        process.join()


def rows(a: argparse.Namespace) -> Iterator[str]:
    """Rows of the table."""
    for n in a.n:
        for shape in a.shapes:
            for material in a.materials:
                _, *given = flowing(n, shape, material)
                solvers = [by_gmres(MULTIGRID)]
                solvers += [by_gmres(LDLT)] if n <= a.ldlt else []
                solvers += [by_lu] if n <= a.lu else []
                for solve in solvers:
                    yield f"| {len(given[2])} | {shape} | {material} | {apart(solve, tuple(given))} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("n", nargs="+", type=int)
    parser.add_argument("--lu", type=int, default=34)
    parser.add_argument("--ldlt", type=int, default=60)
    parser.add_argument("--shapes", nargs="+", default=list(SHAPES), choices=SHAPES)
    parser.add_argument("--materials", nargs="+", default=list(MATERIALS), choices=MATERIALS)
    flowing(4, "flat 2", "elastic")  # kernels are compiled before
    print("| unknowns | bricks | material | solver | iterations | analysis | set-up | solution | residual | MB |")
    print("|" + "---|" * 10, flush=True)
    for row in rows(parser.parse_args()):
        print(row, flush=True)


if __name__ == "__main__":
    main()
