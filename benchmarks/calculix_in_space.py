"""The eighth of a square billet beside CalculiX: ``python benchmarks/calculix_in_space.py prensa:12 C3D8I:12 C3D20R:8``.

A word names a program (CalculiX by its element; ``prensa-bdf2`` has flow of second order in given increments too) and bricks
along the half width of 10 mm; three quarters as many go along the half height of 7.5 mm. ``prensa/6`` and ``C3D8R/6`` have six
equal increments, ``prensa@0.1`` and ``C3D8R@0.0025`` begin with such a share of the step. Both have the same elastic constants,
flow curve (250 + 500 ε̄^0.3, a table for CalculiX), planes of symmetry, and top and sides against a flat die with Coulomb
friction 0.3; each chooses its increments. CalculiX has the die as one brick all of whose nodes are prescribed, and surface-to-
surface penalty contact of ``STIFFNESS``. Of its bricks of eight nodes C3D8R (one point, hourglass control) has as many unknowns
as the bricks of prensa; C3D8I has the amplitudes of its incompatible modes as nine further unknowns each; C3D8 locks: 4.6 %
more force on 8 × 6 × 8.

A second table has what increments cost in accuracy: each run beside the one of its program and element in the most equal
increments, if these are a hundred or more, on meshes up to ``SHAPES_TO``.

Each run is a process of its own, one thread; seconds are processor time (user and system) of the whole process, reading and
imports included, kernels of prensa compiled before; memory is its peak. Runs are lines of the file ``--to``; what is there is not
measured again. ``run.py --only billet`` writes the page.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import calculix
import numpy as np
from calculix import lines, numbers
from in_space import stored
from numpy.typing import NDArray

import prensa as pr
from prensa.policy import Policy
from prensa.system.planning import plan_step
from prensa.timer import Timer

Array = NDArray[np.float64]
Row = dict[str, Any]

WIDTH, HEIGHT, E, NU, MU = 10.0, 7.5, 200e3, 0.3, 0.3
FLOW = pr.Ludwik(250.0, 500.0, 0.3)
STIFFNESS = 1e6
"""Of CalculiX's contact, N/mm³: five times E over a millimetre. 600 MPa penetrate by 0.6 µm, 0.1 % of a reduction of 10 %."""
FIRST = 0.1
"""CalculiX's first increment as a share of the step; all further ones are its own."""
SHAPES_TO = 12
"""Bricks along the half width up to which final displacements are kept, for the table of errors."""
REFERENCE = 100
"""Equal increments from which a run is a reference and not a row of the table of speed."""
FROM = 0.1
"""Share of the step from which on errors of the force curve count: before, the force rises from nothing."""
TO = Path("results/calculix_in_space.jsonl")
SIDES = {
    "S1": (0, 1, 2, 3), "S2": (4, 5, 6, 7), "S3": (0, 1, 4, 5), "S4": (1, 2, 5, 6), "S5": (2, 3, 6, 7), "S6": (0, 3, 4, 7),
}  # fmt: skip
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
"""Corners of a brick's faces, and of its edges in the order of the nodes 9 to 20, as CalculiX has them."""
CONTACT, SYMMETRY = ("top", "right", "front"), {"left": 1, "bottom": 2, "back": 3}


class Program(NamedTuple):
    """What runs: ``name``, its equal ``increments`` (None: its own), its ``first`` one as a share of the step (None: usual)."""

    name: str
    increments: int | None = None
    first: float | None = None

    @classmethod
    def of(cls, word: str) -> Program:
        """That of a word of the command line, without the mesh."""
        rest, _, first = word.partition("@")
        name, _, increments = rest.partition("/")
        return cls(name, int(increments) if increments else None, float(first) if first else None)

    @property
    def is_prensa(self) -> bool:
        """Whether it is this one."""
        return self.name.startswith("prensa")

    @property
    def family(self) -> str:
        """What has the same answer in many increments."""
        return "prensa" if self.is_prensa else self.name

    def in_words(self) -> str:
        """For a row of a table."""
        rule = ", second order" if self.name.endswith("-bdf2") else ""
        words = f"prensa{rule}" if self.is_prensa else f"CalculiX, {self.name}"
        words += "" if self.increments is None else f", {self.increments} increments"
        return words if self.first is None else f"{words}, first increment {self.first:g}"


PRENSA = Program("prensa")


def billet(n: int, reduction: float, increments: int | None = None) -> pr.Problem:
    """An eighth of the billet of n × 3n/4 × n bricks, pressed by a share of its height."""
    box = pr.Box((WIDTH, HEIGHT, WIDTH), (n, round(0.75 * n), n))
    return pr.Problem(
        "billet", space="solid", bodies={"billet": pr.Body(box, pr.J2(E, NU, FLOW))},
        tools={"die": pr.Plane(touching="billet.top")},
        contacts=(pr.Contact(tuple(f"billet.{s}" for s in CONTACT), "die", friction=pr.Coulomb(MU)),),
        fixed={"billet.left": "x", "billet.bottom": "y", "billet.back": "z"},
        steps=(pr.Step("press", move={"die": pr.Motion(y=-reduction * HEIGHT)}, increments=increments),),
    )  # fmt: skip


def quadratic(x: Array, cells: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp]]:
    """Points (n, 3) and bricks (m, 20) with nodes in the middles of the edges of bricks (m, 8)."""
    pairs = np.sort(cells[:, np.array(EDGES)], axis=2)
    edges, where = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    return np.vstack([x, x[edges].mean(axis=1)]), np.hstack([cells, len(x) + where.reshape(len(cells), 12)])


def faces(cells: NDArray[np.intp], nodes: NDArray[np.intp]) -> list[tuple[int, str]]:
    """Elements and their sides, all of whose corners are among the nodes."""
    on = np.isin(cells[:, :8], nodes)
    found = [(e, side) for side, at in SIDES.items() for e in np.flatnonzero(on[:, at].all(axis=1))]
    return [(int(e) + 1, side) for e, side in sorted(found)]


def deck(n: int, reduction: float, kind: str, increments: int | None = None, first: float | None = None) -> str:
    """The whole deck, of bricks C3D8, C3D8I, C3D8R, C3D20 or C3D20R; equal ``increments`` or its own after the ``first``."""
    mesh = pr.discretise(billet(n, reduction)).meshes["billet"]
    x, cells = mesh.points, mesh.cells
    at = {side: np.unique(mesh.edges[side]) for side in (*CONTACT, *SYMMETRY)}
    slave = [face for side in CONTACT for face in faces(cells, at[side])]
    if kind.startswith("C3D20"):
        x, cells = quadratic(x, cells)
    plane = {side: np.flatnonzero(x[:, axis - 1] == 0.0) + 1 for side, axis in SYMMETRY.items()}
    node, element = len(x) + 1, len(cells) + 1
    wide, above = 2.0 * WIDTH, HEIGHT + 5.0
    corners = [(a, y, b) for y in (HEIGHT, above) for a, b in ((-5.0, -5.0), (wide, -5.0), (wide, wide), (-5.0, wide))]
    strain = np.concatenate([[0.0], np.geomspace(1e-5, 2.0, 120)])
    curve = [(float(FLOW.stress(e, 0.0)), float(e)) for e in strain]
    text = (
        f"*NODE, NSET=BODY\n{lines((i + 1, *map(float, p)) for i, p in enumerate(x))}\n"
        f"*ELEMENT, TYPE={kind}, ELSET=EBODY\n{broken((e + 1, *(int(a) + 1 for a in c)) for e, c in enumerate(cells))}\n"
        f"*NODE, NSET=TOOL\n{lines((node + i, *p) for i, p in enumerate(corners))}\n"
        f"*ELEMENT, TYPE=C3D8, ELSET=ETOOL\n{lines([(element, *(node + i for i in (0, 3, 2, 1, 4, 7, 6, 5)))])}\n"
    )
    text += "".join(f"*NSET, NSET={side.upper()}\n{numbers(nodes)}\n" for side, nodes in plane.items())
    text += f"*SURFACE, NAME=SLAVE, TYPE=ELEMENT\n{lines(slave)}\n*SURFACE, NAME=MASTER, TYPE=ELEMENT\n{element}, S1\n"
    text += f"*MATERIAL, NAME=METAL\n*ELASTIC\n{E}, {NU}\n*PLASTIC\n{lines(curve)}\n*MATERIAL, NAME=RIGID\n*ELASTIC\n1e6, 0.3\n"
    text += "*SOLID SECTION, ELSET=EBODY, MATERIAL=METAL\n*SOLID SECTION, ELSET=ETOOL, MATERIAL=RIGID\n"
    text += (
        f"*SURFACE INTERACTION, NAME=PAIR\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{STIFFNESS}\n"
        f"*FRICTION\n{MU}, {0.1 * STIFFNESS}\n*CONTACT PAIR, INTERACTION=PAIR, TYPE=SURFACE TO SURFACE\nSLAVE, MASTER\n"
    )
    text += "*BOUNDARY\n" + "".join(f"{side.upper()}, {axis}, {axis}\n" for side, axis in SYMMETRY.items())
    text += "TOOL, 1, 1\nTOOL, 3, 3\n"
    static = f"*STATIC\n{first or FIRST}, 1., 1e-6" if increments is None else f"*STATIC, DIRECT\n{1.0 / increments!r}, 1."
    shape = "*NODE PRINT, NSET=BODY\nU\n" if n <= SHAPES_TO else ""
    return text + (
        f"*STEP, NLGEOM, INC=10000\n{static}\n*BOUNDARY\nTOOL, 2, 2, {-reduction * HEIGHT}\n"
        f"*NODE PRINT, NSET=BOTTOM, TOTALS=ONLY\nRF\n{shape}*END STEP\n"
    )


def broken(of: Iterable[tuple[int, ...]]) -> str:
    """Comma-separated rows of whole numbers, at most 16 to a line."""
    return "\n".join(",\n".join(", ".join(map(str, r[k : k + 16])) for k in range(0, len(r), 16)) for r in of)


def by_prensa(n: int, reduction: float, program: Program = PRENSA) -> Row:
    """A run of prensa in this process: what it found, and its processor seconds, those in the linear solver, and memory."""
    system, timer = pr.discretise(billet(n, reduction, program.increments)), Timer(time.process_time)
    numerics = pr.Numerics(threads=1, time_rule="bdf2" if program.name.endswith("-bdf2") else "auto")
    policy = Policy() if program.first is None else Policy(first_share=program.first)
    iterations, u = 0, np.zeros(system.ndof)
    times, forces = list[float](), list[float]()
    for inc in pr.solve(system, numerics, timer=timer, policy=policy):
        iterations += inc.statistics.iterations
        times.append(inc.time)
        forces.append(inc.force("die").y)
        u = inc.state.u
    used = resource.getrusage(resource.RUSAGE_SELF)
    unknowns = system.ndof - len(system.prescribed(plan_step(system, 0, system.initial().step_start).fixed))
    shape = {"u": system.displacement(u).round(7).ravel().tolist()} if n <= SHAPES_TO else {}
    return {
        "seconds": used.ru_utime + used.ru_stime, "MB": used.ru_maxrss / 1024, "ended": "completed",
        "iterations": iterations, "increments": len(times), "unknowns": unknowns, "force": forces, "times": times,
        "solver": timer.seconds["factorisation and solve"], **shape,
    }  # fmt: skip


def by_calculix(n: int, reduction: float, program: Program, limit: float) -> Row:
    """The same of CalculiX."""
    if shutil.which("ccx") is None:
        return {"skipped": "ccx is not installed (Debian: apt-get install calculix-ccx)"}
    return calculix.solve(deck(n, reduction, program.name, program.increments, program.first), limit)


def missing(a: argparse.Namespace, known: list[Row]) -> Iterator[Row]:
    """Runs that are asked for and not known, one after the other, each in a process of its own."""
    done = {(r["program"], r["n"], r["reduction"]) for r in known}
    for word in a.runs:
        program, _, n = word.partition(":")
        case = {"program": program, "n": int(n), "reduction": a.reduction}
        if tuple(case.values()) in done:
            continue
        command = [sys.executable, "-W", "ignore", __file__, word, "--alone", "--reduction", str(a.reduction)]
        made = subprocess.run([*command, "--limit", str(a.limit)], capture_output=True, text=True, check=False)
        if made.returncode:
            yield case | {"skipped": (made.stderr.strip().splitlines() or ["failed"])[-1]}
        else:
            yield case | json.loads(made.stdout.splitlines()[-1])


def compared(rows: list[Row]) -> Iterator[list[str]]:
    """Lines of the table: by unknowns of prensa's run, which is the first of a size; CalculiX's over the nearest of them."""
    rows = [r for r in rows if (Program.of(r["program"]).increments or 0) < REFERENCE]
    ours = sorted((r for r in rows if r["program"] == "prensa"), key=lambda r: r["unknowns"])
    for own in ours:
        same = [r for r in rows if r["reduction"] == own["reduction"] and nearest(r, ours) is own]
        for r in sorted(same, key=lambda r: (r is not own, r["program"])):
            if "skipped" in r:
                yield [Program.of(r["program"]).in_words(), size(r["n"]), r["skipped"], *[""] * 9]
                continue
            yield [
                Program.of(r["program"]).in_words(), size(r["n"]), str(r["unknowns"]),
                f"{100 * r['reduction']:g} %", str(r["increments"]), str(r["iterations"]),
                f"{4e-3 * r['force'][-1]:.1f}" if r["ended"] == "completed" else r["ended"], f"{r['seconds']:.1f}",
                f"**{r['seconds'] / own['seconds']:.1f}**", f"{r['seconds'] / max(r['iterations'], 1):.2f}",
                f"{100 * r['solver'] / r['seconds']:.0f} %" if "solver" in r else "", f"{r['MB']:.0f}",
            ]  # fmt: skip


def nearest(row: Row, ours: list[Row]) -> Row:
    """The run of prensa on the same mesh, else of about as many unknowns."""
    same = [r for r in ours if r["reduction"] == row["reduction"]]
    return min(same, key=lambda r: (r["n"] != row["n"], abs(r["unknowns"] - row.get("unknowns", r["unknowns"]))))


def errors(rows: list[Row]) -> Iterator[list[str]]:
    """Lines of the table of errors, of runs whose program has a reference on their mesh."""
    kept = [r | {"of": Program.of(r["program"])} for r in rows if "u" in r and r["ended"] == "completed"]
    for r in sorted(kept, key=lambda r: (r["n"], r["of"].family != "prensa", r["of"].family, r["increments"])):
        same = [o for o in kept if (o["of"].family, o["n"], o["reduction"]) == (r["of"].family, r["n"], r["reduction"])]
        best = max(same, key=lambda o: (o["of"].increments or 0, o["program"]))
        if r is best or (best["of"].increments or 0) < REFERENCE:
            continue
        (t, f), (t0, f0) = ((np.array([0.0, *o["times"]]), np.array([0.0, *o["force"]])) for o in (r, best))
        off, work = (f - np.interp(t, t0, f0)) / f0[-1], np.trapezoid(f, t) / np.trapezoid(f0, t0) - 1.0
        apart = np.linalg.norm(np.reshape(r["u"], (-1, 3)) - np.reshape(best["u"], (-1, 3)), axis=1)
        apart /= r["reduction"] * HEIGHT
        shares = (off[-1], off[t >= FROM][np.abs(off[t >= FROM]).argmax()], work, apart.max(), np.sqrt(np.mean(apart**2)))
        yield [
            r["of"].in_words(), size(r["n"]), str(r["increments"]), str(r["iterations"]), str(best["of"].increments),
            *(f"{100.0 * share:+.3f}" for share in shares[:3]), *(f"{100.0 * share:.2f}" for share in shares[3:]),
        ]  # fmt: skip


def size(n: int) -> str:
    """Bricks along the three edges."""
    return f"{n} × {round(0.75 * n)} × {n}"


HEAD = [
    "program", "bricks", "unknowns", "pressed by", "increments", "iterations", "F, kN", "processor time, s", "over prensa",
    "an iteration, s", "in the solver", "MB",
]  # fmt: skip
HEAD_OF_ERRORS = [
    "program", "bricks", "increments", "iterations", "reference, increments", "F, %", "F(t) at worst, %", "work, %",
    "shape at worst, % of the way", "r.m.s., %",
]  # fmt: skip
NOTE_OF_ERRORS = """\
What increments cost in accuracy: each run beside many equal increments of the same program on the same mesh, in per
cent; of F at the end, of F at the ends of increments from a tenth of the step on, of the work as the trapezoid of
forces, and of displacements, over the way of the die. In six increments each the final shapes are about as accurate,
or better with flow of second order, and forces of prensa ten times as accurate; the 18 that prensa chooses have a
twentieth of the error of CalculiX's six, or less."""
NOTE = """F is the force of the whole billet. Goal: about ten times at 1e5 unknowns, forces within 1 %. Each program chooses its
increments, but for rows that say otherwise; CalculiX begins with a tenth of a step of 10 %.

What limits the ratio: both factorise in every iteration. Friction makes the matrix of CalculiX unsymmetric, and LU in double
precision by SPOOLES takes 95 % of its time at 34 050 unknowns and 97 % at 96 110 (perf). LDLᵀ of the symmetric part in single
precision under GMRES is cheaper by more the larger the system is. What prensa gains there it spends in part on increments, three
times as many: with six it takes fewer iterations than CalculiX. CalculiX has no first increment of its own, the deck gives
one. Where both begin with the same, each goes on as it chooses and takes at 96 110 unknowns: with a tenth of the step 886 and
74 s, a ratio of 12.0; with prensa's 1/400 of the step 2048 and 140 s, 14.6. In six increments each the ratio is 17.8; a tenth
for CalculiX beside 1/400 for prensa gives 6.3. At 4641 unknowns prensa's start counts (imports, kernels from the disk), and
CalculiX, which has none, is as fast."""


def main() -> None:
    """Measure what is missing and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", metavar="PROGRAM:N")
    parser.add_argument("--reduction", type=float, default=0.1, help="share of the height")
    parser.add_argument("--limit", type=float, default=7200.0, help="seconds of the wall for CalculiX")
    parser.add_argument("--to", type=Path, default=TO)
    parser.add_argument("--alone", action="store_true", help="one run in this process, printed as a line of JSON")
    a = parser.parse_args()
    if a.alone:
        word, _, n = a.runs[0].partition(":")
        if (program := Program.of(word)).is_prensa:
            print(json.dumps(by_prensa(int(n), a.reduction, program)))
        else:
            print(json.dumps(by_calculix(int(n), a.reduction, program, a.limit)))
        return
    a.to.parent.mkdir(parents=True, exist_ok=True)
    if any(word.startswith("prensa") for word in a.runs):
        by_prensa(4, 0.01)  # kernels are compiled before
    for row in missing(a, stored(a.to)):
        with a.to.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print({k: v for k, v in row.items() if not isinstance(v, list)}, flush=True)
    for head, made in ((HEAD, compared), (HEAD_OF_ERRORS, errors)):
        for line in (head, ["---"] * len(head), *made(stored(a.to))):
            print("|", " | ".join(line), "|")


if __name__ == "__main__":
    main()
