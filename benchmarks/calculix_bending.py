"""The sheet of NUMISHEET 2002 B, bent by CalculiX: ``python benchmarks/calculix_bending.py 120 4``.

Prints the angle between its legs. Geometry, flow curve and friction are written out here from the statement, so that nothing
is shared with prensa but the numbers: half of a sheet of 120 x 1 mm in plane strain, a layer of C3D8I; punch (radius 23.5) and
die (shoulders of radius 4, 25 mm from the middle) are polylines of 900 and 300 sides, all of whose nodes are prescribed;
surface-to-surface penalty contact with Coulomb friction.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from calculix import lines, numbers
from numpy.typing import NDArray

Array = NDArray[np.float64]

LENGTH, THICKNESS, DEPTH = 60.0, 1.0, 0.5
PUNCH, SHOULDER, HALF_WIDTH, STROKE = 23.5, 4.0, 25.0, 28.5
K, N, YIELD = 550.4, 0.223, 194.0


def label(i: int, j: int, layer: int, ny: int) -> int:
    """Number of the node in column i and row j of the sheet, on either face of the layer."""
    return 1 + 2 * (i * (ny + 1) + j) + layer


def sheet(nx: int, ny: int) -> str:
    """Nodes, elements and the two surfaces of the sheet."""
    nodes = [
        (label(i, j, k, ny), LENGTH * i / nx, THICKNESS * j / ny, DEPTH * k)
        for i in range(nx + 1) for j in range(ny + 1) for k in (0, 1)
    ]  # fmt: skip
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    cells = [
        (1 + i * ny + j, *(label(i + a, j + b, k, ny) for k in (0, 1) for a, b in corners))
        for i in range(nx) for j in range(ny)
    ]  # fmt: skip
    middle = numbers(label(0, j, k, ny) for j in range(ny + 1) for k in (0, 1))
    return (
        f"*NODE, NSET=SHEET\n{lines(nodes)}\n*ELEMENT, TYPE=C3D8I, ELSET=SHEET\n{lines(cells)}\n*NSET, NSET=MIDDLE\n{middle}\n"
        f"*SURFACE, NAME=TOP, TYPE=ELEMENT\n{lines((i * ny + ny, 'S5') for i in range(nx))}\n"
        f"*SURFACE, NAME=BOTTOM, TYPE=ELEMENT\n{lines((1 + i * ny, 'S3') for i in range(nx))}\n"
    )


def tool(name: str, face: Array, back: Array, node: int, element: int) -> str:
    """Band of elements between the polylines face and back, both (k, 2), whose surface is the face."""
    k = len(face)
    x = np.stack([face, face, back, back], axis=1)
    z = np.array([-0.1, DEPTH + 0.1, -0.1, DEPTH + 0.1])
    nodes = [(node + 4 * i + a, *map(float, x[i, a]), float(z[a])) for i in range(k) for a in range(4)]
    along, inwards = face[-1] - face[0], back[0] - face[0]
    turned = along[0] * inwards[1] - along[1] * inwards[0] < 0.0
    cells = []
    for i in range(k - 1):
        a, b = node + 4 * i, node + 4 * (i + 1)
        around = (a, a + 2, b + 2, b) if turned else (a, b, b + 2, a + 2)
        cells.append((element + i, *around, *(n + 1 for n in around)))
    side = "S6" if turned else "S3"
    return (
        f"*NODE, NSET={name}\n{lines(nodes)}\n*ELEMENT, TYPE=C3D8, ELSET={name}\n{lines(cells)}\n"
        f"*SURFACE, NAME=FACE{name}, TYPE=ELEMENT\n{lines((element + i, side) for i in range(k - 1))}\n"
    )


def tools(node: int, element: int) -> str:
    """Punch above, die below: an arc, and a flat, a shoulder and a wall."""
    angle = np.linspace(-0.02, 0.5 * np.pi + 0.1, 900)
    ray = np.column_stack([np.sin(angle), -np.cos(angle)])
    centre = np.array([0.0, THICKNESS + PUNCH])
    punch = tool("PUNCH", centre + PUNCH * ray, centre + 0.85 * PUNCH * ray, node, element)
    turn = np.linspace(0.5 * np.pi, np.pi, 300)
    ray = np.column_stack([np.cos(turn), np.sin(turn)])
    centre = np.array([HALF_WIDTH + SHOULDER, -SHOULDER])
    ends = np.array([[80.0, 0.0], [HALF_WIDTH, -60.0]])
    behind = np.array([[80.0, -0.5 * SHOULDER], [HALF_WIDTH + 0.5 * SHOULDER, -60.0]])
    face, back = (
        np.vstack([e[:1], centre + r * ray, e[1:]]) for e, r in ((ends, SHOULDER), (behind, 0.5 * SHOULDER))
    )  # fmt: skip
    return punch + tool("DIE", face, back, node + 4 * 900, element + 899)


def deck(nx: int, ny: int, mu: float, stiffness: float) -> str:
    """The whole deck."""
    first = (YIELD / K) ** (1.0 / N)
    strain = np.concatenate([[0.0], np.geomspace(1e-4, 1.5, 120)])
    curve = lines((float(K * (first + e) ** N), float(e)) for e in strain)
    friction = f"*FRICTION\n{mu}, {0.1 * stiffness}\n" if mu > 0.0 else ""
    pairs = "".join(
        f"*CONTACT PAIR, INTERACTION=PAIR, TYPE=SURFACE TO SURFACE\n{side}, FACE{name}\n"
        for side, name in (("TOP", "PUNCH"), ("BOTTOM", "DIE"))
    )
    return (
        sheet(nx, ny) + tools(2 * (nx + 1) * (ny + 1) + 1, nx * ny + 1)
        + f"*MATERIAL, NAME=ALLOY\n*ELASTIC\n70500., 0.342\n*PLASTIC\n{curve}\n*MATERIAL, NAME=RIGID\n*ELASTIC\n1e6, 0.3\n"
        "*SOLID SECTION, ELSET=SHEET, MATERIAL=ALLOY\n*SOLID SECTION, ELSET=PUNCH, MATERIAL=RIGID\n"
        "*SOLID SECTION, ELSET=DIE, MATERIAL=RIGID\n"
        f"*SURFACE INTERACTION, NAME=PAIR\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{stiffness}, 1e-3\n{friction}{pairs}"
        "*BOUNDARY\nSHEET, 3, 3\nMIDDLE, 1, 1\nPUNCH, 1, 1\nPUNCH, 3, 3\nDIE, 1, 3\n"
        + f"*STEP, NLGEOM, INC=20000\n*STATIC\n0.002, 1., 1e-7, 0.005\n*BOUNDARY\nPUNCH, 2, 2, {-STROKE}\n"
        "*NODE PRINT, NSET=SHEET, FREQUENCY=20000\nU\n*END STEP\n"
    )  # fmt: skip


def between_legs(printed: str, nx: int, ny: int) -> float:
    """Angle between the legs (degrees) from printed displacements, by the lower side between 47 and 59 mm."""
    rows = re.findall(r"^ +(\d+) +(\S+) +(\S+) +\S+$", printed.rpartition("set SHEET")[2], re.MULTILINE)
    moved = {int(n): np.array([float(u), float(v)]) for n, u, v in rows}
    columns = [round(x / LENGTH * nx) for x in (47.0, 59.0)]
    a, b = (np.array([LENGTH * i / nx, 0.0]) + moved[label(i, 0, 0, ny)] for i in columns)
    return float(180.0 - 2.0 * np.degrees(np.arctan2(*(b - a)[::-1])))


def main() -> None:
    """Run CalculiX and print the angle at the end of the stroke."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("nx", type=int)
    parser.add_argument("ny", type=int)
    parser.add_argument("--mu", type=float, default=0.1342)
    parser.add_argument("--stiffness", type=float, default=2e4, help="penalty stiffness, N/mm³")
    given = parser.parse_args()
    if shutil.which("ccx") is None:
        sys.exit("ccx is not installed (Debian: apt-get install calculix-ccx)")
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.inp").write_text(deck(given.nx, given.ny, given.mu, given.stiffness))
        done = subprocess.run(["ccx", "case"], cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode or "*ERROR" in done.stdout:
            sys.exit(f"CalculiX did not reach the end of the stroke:\n{done.stdout[-2000:]}")
        printed = (Path(folder) / "case.dat").read_text()
    print(f"angle between the legs: {between_legs(printed, given.nx, given.ny):.2f} degrees")


if __name__ == "__main__":
    main()
