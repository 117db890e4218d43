"""The Hertz block and the upsetting as CalculiX decks, run by ``ccx`` and read back: ``python benchmarks/calculix.py hertz``.

Same meshes, loads and boundary conditions. What differs, because CalculiX has nothing nearer: plane and axisymmetric
elements are expanded to one layer of C3D8; the rigid tool is a band of elements whose nodes are all prescribed, so the
cylinder is a fine polygon; node-to-surface penalty with the stiffness that prensa takes at the smallest element; the
hyperelastic law is that of Ciarlet, whose volumetric term λ/4 (J² − 1 − 2 ln J) agrees with λ/2 ln² J to second order.
"""

from __future__ import annotations

import json
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import common
import numpy as np
from numpy.typing import NDArray

import prensa as pr
from prensa.verify import example1
from prensa.verify.forming import BILLET_FLOW, NU, E, upsetting

Array = NDArray[np.float64]


def lines(rows: Any) -> str:
    """Comma-separated rows."""
    return "\n".join(", ".join(f"{v:.12g}" if isinstance(v, float) else str(v) for v in row) for row in rows)


def numbers(items: Any) -> str:
    """Numbers, ten to a line."""
    items = [str(int(i)) for i in items]
    return "\n".join(", ".join(items[k : k + 10]) for k in range(0, len(items), 10))


def tool(x: Array, y: Array, node: int, element: int, kind: str) -> tuple[str, int]:
    """Band of elements above the polyline x, y (k,): deck text and the number of elements; nodes are numbered from node."""
    k = len(x)
    low = [(node + i, float(x[i]), float(y[i])) for i in range(k)]
    high = [(node + k + i, float(x[i]), float(y.max()) + 5.0) for i in range(k)]
    cells = [(element + i, node + i, node + i + 1, node + k + i + 1, node + k + i) for i in range(k - 1)]
    text = f"*NODE, NSET=TOOL\n{lines([*low, *high])}\n*ELEMENT, TYPE={kind}, ELSET=ETOOL\n{lines(cells)}\n"
    return text + "*SURFACE, NAME=MASTER, TYPE=ELEMENT\nETOOL, S1\n", k - 1


def deck(
    problem: pr.Problem, kind: str, material: str, polyline: tuple[Array, Array], slave: list[str], contact: str,
    depths: tuple[float, ...], first: float,
) -> str:  # fmt: skip
    """Deck of a problem with one body and one tool that moves along −y to each of the depths."""
    system = pr.discretise(problem)
    (name,) = problem.bodies
    cells = system.blocks[0].cells
    n, m = system.nodes, len(cells)
    text = f"*NODE, NSET=BODY\n{lines((i + 1, float(x), float(y)) for i, (x, y) in enumerate(system.X))}\n"
    text += (
        f"*ELEMENT, TYPE={kind}, ELSET=EBODY\n{lines((e + 1, *(int(a) + 1 for a in c)) for e, c in enumerate(cells))}\n"
    )
    band, _ = tool(*polyline, n + 1, m + 1, kind)
    text += band
    for edge in ("bottom", "left"):
        text += f"*NSET, NSET={edge.upper()}\n{numbers(system.boundary_nodes(f'{name}.{edge}') + 1)}\n"
    nodes = np.unique(np.concatenate([system.boundary_nodes(f"{name}.{edge}") for edge in slave]))
    text += f"*SURFACE, NAME=SLAVE, TYPE=NODE\n{lines((int(i) + 1,) for i in nodes)}\n"
    text += material + contact
    text += "*SOLID SECTION, ELSET=EBODY, MATERIAL=BODYLAW\n1.\n*SOLID SECTION, ELSET=ETOOL, MATERIAL=RIGID\n1.\n"
    text += "*MATERIAL, NAME=RIGID\n*ELASTIC\n1e6, 0.3\n*BOUNDARY\nBOTTOM, 2, 2\nLEFT, 1, 1\nTOOL, 1, 1\n"
    for depth in depths:
        text += f"*STEP, NLGEOM, INC=100000\n*STATIC\n{first}, 1., 1e-7\n*BOUNDARY\nTOOL, 2, 2, {-depth}\n"
        text += "*NODE PRINT, NSET=BOTTOM, TOTALS=ONLY, FREQUENCY=100000\nRF\n*END STEP\n"
    return text


def hertz(
    n: tuple[int, int], depths: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0, 8.0), first: float = 0.25
) -> tuple[str, tuple[float, ...], float]:
    """Deck, depths, and factor to the force of the whole block; ``first``: first increment as a share of a step."""
    problem = common.hertz(n)
    system = pr.discretise(problem)
    angle = np.linspace(0.0, 0.35, 701)  # 28 mm of arc, more than the contact has at 8 mm
    x, y = 80.0 * np.sin(angle), 40.0 + 80.0 * (1.0 - np.cos(angle))
    k_n = float(system.surfaces[0].scale(np.zeros(len(system.surfaces[0].points))).k_n.max())
    material = f"*MATERIAL, NAME=CIARLET_EL_BODY\n*USER MATERIAL, CONSTANTS=2\n{example1.E}, {example1.NU}\n"
    contact = (
        "*SURFACE INTERACTION, NAME=PAIR\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n"
        f"{k_n}, 1e-4\n*CONTACT PAIR, INTERACTION=PAIR, TYPE=NODE TO SURFACE\nSLAVE, MASTER\n"
    )
    text = deck(problem, "CPE4", material, (x, y), ["top"], contact, depths, first)
    return text.replace("MATERIAL=BODYLAW", "MATERIAL=CIARLET_EL_BODY"), depths, 2.0


def press(n: tuple[int, int]) -> tuple[str, tuple[float, ...], float]:
    """The same of the upsetting with μ = 0.1 to 50 %, J2 with Ludwik's curve in a table."""
    problem = upsetting(n, 0.1)
    system = pr.discretise(problem)
    k_n = float(system.surfaces[0].scale(np.zeros(len(system.surfaces[0].points))).k_n.max())
    strain = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 60)])
    curve = [(float(BILLET_FLOW.s0 + BILLET_FLOW.K * e**BILLET_FLOW.n), float(e)) for e in strain]
    material = f"*MATERIAL, NAME=BODYLAW\n*ELASTIC\n{E}, {NU}\n*PLASTIC\n{lines(curve)}\n"
    contact = (
        "*SURFACE INTERACTION, NAME=PAIR\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n"
        f"{k_n}, 1e-2\n*FRICTION\n0.1, {0.1 * k_n}\n*CONTACT PAIR, INTERACTION=PAIR, TYPE=NODE TO SURFACE\nSLAVE, MASTER\n"
    )
    depths = tuple(7.5 * r for r in (0.1, 0.2, 0.3, 0.4, 0.5))
    x = np.linspace(0.0, 25.0, 51)
    return (
        deck(problem, "CAX4", material, (x, np.full(51, 7.5)), ["top", "right"], contact, depths, 0.1), depths, 180.0
    )  # fmt: skip


def solve(text: str, limit: float) -> dict[str, Any]:
    """What CalculiX finds (`figures`) and needs: processor ``seconds``, ``MB`` of memory at most, how it ``ended``."""
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        (at / "case.inp").write_text(text)
        before, end, most = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() + limit, 0.0
        with (at / "said").open("w") as out, subprocess.Popen(["ccx", "case"], cwd=folder, stdout=out) as process:
            while process.poll() is None and time.monotonic() < end:
                most = max(most, _peak(process.pid))
                time.sleep(0.05)
            stopped = process.poll() is None
            process.kill()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        said = (at / "said").read_text()
        printed = (at / "case.dat").read_text() if (at / "case.dat").exists() else ""
    how = "completed" if process.returncode == 0 and "*ERROR" not in said else _error(said)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    ended = f"stopped after {limit:g} s" if stopped else how
    return {"seconds": seconds, "MB": most, "ended": ended, **figures(said, printed)}


def _peak(process: int) -> float:
    """Most memory (MB) that a process has had since it was started; 0 where the system does not say."""
    try:
        known = re.search(r"VmHWM:\s+(\d+)", Path(f"/proc/{process}/status").read_text())
    except OSError:
        return 0.0
    return float(known.group(1)) / 1024 if known else 0.0


def figures(said: str, printed: str) -> dict[str, Any]:
    """``iterations``, ``increments`` and ``unknowns`` that CalculiX says; ``force`` along y on the base, as often as printed,
    at ``times``; final displacements ``u`` where these are printed.
    """
    rows = re.findall(r"total force[^\n]*time\s+(\S+)\s*\n\s*\n\s*(\S+)\s+(\S+)\s+(\S+)", printed)
    equations = re.findall(r"number of equations\s+(\d+)", said)
    return {
        "iterations": len(re.findall(r"^ *iteration +\d", said, re.MULTILINE)),
        "increments": len(re.findall(r"^ *increment +\d+ +attempt +1\b", said, re.MULTILINE)),
        "unknowns": int(equations[-1]) if equations else 0, "force": [float(r[2]) for r in rows],
        "times": [float(r[0]) for r in rows], **last_shape(printed),
    }  # fmt: skip


def last_shape(printed: str) -> dict[str, list[float]]:
    """Displacements ``u`` (3 n) of the last printed set of nodes; nothing where none were asked for."""
    _, found, after = printed.rpartition("displacements (vx,vy,vz)")
    rows = [line.split() for line in after.splitlines()[1:]]
    return {"u": [float(v) for row in rows if len(row) == 4 for v in row[1:]]} if found else {}


def _error(printed: str) -> str:
    found = re.search(r"\*ERROR[^\n]*\n?[^\n]*", printed)
    return " ".join(found.group().split()) if found else "failed"


def main(what: str, nx: int, ny: int, limit: float = 600.0) -> None:
    """Print a line of JSON: seconds of CalculiX and the forces at the ends of its steps.

    what: ``hertz``, ``upsetting``, or ``iteration``, the Hertz block to 0.5 mm in a single increment.
    """
    if shutil.which("ccx") is None:
        print(json.dumps({"skipped": "ccx is not installed (Debian: apt-get install calculix-ccx)"}))
        return
    if what == "iteration":
        text, depths, factor = hertz((nx, ny), (0.5,), 1.0)
    else:
        text, depths, factor = (hertz if what == "hertz" else press)((nx, ny))
    m = solve(text, limit)
    forces = [factor * f for f in m["force"]]
    each = m["seconds"] / max(m["iterations"], 1)
    print(json.dumps(m | {"depth": depths[: len(forces)], "force": forces, "iteration": each}))


if __name__ == "__main__":
    main(sys.argv[1], *(int(a) for a in sys.argv[2:4]), *(float(a) for a in sys.argv[4:5]))
