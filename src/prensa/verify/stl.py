"""Tools of triangles against the exact surfaces that they stand for: a sphere that presses and slides, a die as CAD writes it.

The files are made here: an icosahedron whose triangles are divided three times, and a profile with its flats in two long
triangles and its fillets in facets of ten degrees.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

import prensa as pr
from prensa.types import Array, Index
from prensa.verify.space import imbalance
from prensa.verify.table import Row, case, row

DIE_PROFILE = ((-20.0, 3.0), (-6.0, 3.0), (-3.0, 0.0), (3.0, 0.0), (6.0, 3.0), (20.0, 3.0))
"""Corners (mm) of a profile with flats, slopes, concave and convex fillets."""
FILLED_PROFILE = ((-20.0, 1.2), (-4.2, 1.2), (-3.0, 0.0), (3.0, 0.0), (4.2, 1.2), (20.0, 1.2))
"""Corners (mm) of a lower one, whose concave fillets a block comes to."""


def icosphere(radius: float, level: int) -> tuple[Array, Index]:
    """Points (n, 3) and triangles (m, 3), counter-clockwise outside, of a sphere: an icosahedron divided ``level`` times."""
    g = 0.5 * (1.0 + np.sqrt(5.0))
    x = np.array([[0.0, a, b * g] for a in (-1, 1) for b in (-1, 1)])
    x = np.concatenate([np.roll(x, k, axis=1) for k in range(3)])
    near = np.linalg.norm(x[:, None] - x, axis=2) < 2.1
    t = np.array([
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ])  # fmt: skip
    inward = np.linalg.det(x[t]) < 0.0
    t[inward] = t[inward][:, ::-1]
    for _ in range(level):
        ends = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        edges, inverse = np.unique(ends, axis=0, return_inverse=True)
        ab, bc, ca = len(x) + inverse.reshape(3, -1)
        x = np.concatenate([x, x[edges].mean(axis=1)])
        x /= np.linalg.norm(x, axis=1)[:, None]
        a, b, c = t.T
        t = np.concatenate([np.stack(s, axis=1) for s in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    turn = np.linalg.qr(np.array([[0.3, 1.0, 0.2], [0.9, -0.1, 0.4], [0.1, 0.2, 1.0]]))[0]
    return radius * x @ (turn * np.linalg.det(turn)).T, t


def faceted(
    points: Sequence[tuple[float, float]], fillet: float | Sequence[float], step: float = np.radians(10.0)
) -> Array:  # fmt: skip
    """Points (n, 2) of a profile with arcs of radius ``fillet``, one for all corners or each, in facets of ``step`` or less."""
    out, radii = [np.array(points[0])], np.broadcast_to(fillet, len(points))
    for a, b, c, radius in zip(points, points[1:], points[2:], radii[1:]):
        u, v = (np.subtract(q, p) / np.linalg.norm(np.subtract(q, p)) for p, q in ((a, b), (b, c)))
        turn = float(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v))
        to_middle = np.sign(turn) * np.array([-u[1], u[0]])
        start = np.array(b) - radius * np.tan(0.5 * abs(turn)) * u
        n = int(np.ceil(abs(turn) / step - 1e-9))
        for w in turn * np.arange(n + 1) / n:
            rotation = np.array([[np.cos(w), -np.sin(w)], [np.sin(w), np.cos(w)]])
            out.append(start + radius * (to_middle - rotation @ to_middle))
    return np.array([*out, points[-1]])


def extruded(line: Array, width: float) -> tuple[Array, Index]:
    """Points and triangles of a line (n, 2) extruded along z to either side: two long triangles for each piece."""
    points = np.array([(x, y, z) for x, y in line for z in (-width, width)])
    pieces = [(2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3) for i in range(len(line) - 1)]
    return points, np.array([t for a, b, c, d in pieces for t in ((a, c, b), (b, c, d))])


def write(path: Path, points: Array, triangles: Index, binary: bool = True) -> str:
    """Write an STL file; its path."""
    import meshio

    meshio.Mesh(points, [("triangle", triangles)]).write(path, file_format="stl", binary=binary)
    return str(path)


def slid(tool: pr.ToolShape, E_scale: float = 1.0, mu_scale: float = 1.0) -> tuple[Array, float]:
    """Forces (k, 3) of a tool on half an elastic block: after pressing, and at each of 10 increments of sliding; imbalance."""
    problem = pr.Problem(
        "slide", space="solid", friction=pr.Coulomb(0.1 * mu_scale),
        bodies={"block": pr.Body(pr.Box((7.2, 1.6, 2.0), (18, 4, 5), (-3.6, 0.0, 0.0)), pr.Elastic(200e3 * E_scale, 0.3))},
        tools={"ball": tool}, contacts=(pr.Contact("block.top", "ball"),), fixed={"block.bottom": "xyz", "block.back": "z"},
        steps=(
            pr.Step("press", move={"ball": pr.Motion(y=-0.101)}, increments=2),
            pr.Step("slide", by={"ball": pr.Motion(x=1.6)}, increments=10),
        ),
    )  # fmt: skip
    made = [i for i in pr.solve(problem) if i.end_of_step or i.time > 1.0]
    return np.array([list(i.force("ball"))[:3] for i in made]), max(map(imbalance, made))


@case(
    "triangulated sphere that slides", suite="space",
    expected_warnings=("of the depth of contact", "with the modulus of a metal"),
)  # fmt: skip
def triangulated_sphere(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Edges 8.6° long from the centre, on an elastic block with friction: means and ripple of the forces over a sphere's."""
    at = (-0.8, 11.601, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        file = write(Path(folder) / "ball.stl", *icosphere(10.0, 3))
        ours, off = slid(pr.Stl(file, at=at), E_scale, mu_scale)
    exact, _ = slid(pr.Sphere(10.0, at=at))
    for k, name in ((1, "normal force"), (0, "drag")):
        a, b = np.abs(ours[1:, k]), np.abs(exact[1:, k])
        yield row(f"mean {name} (N)", float(b.mean()), float(a.mean()), 0.005)
        yield row(f"ripple of the {name}, over its mean", 0.0, float(np.std(a - b) / b.mean()), 0.005, "absolute")
    yield row("ball and supports out of balance", 0.0, off, 1e-8, "absolute")


@case("die of an STL file", suite="space", slow=True, balance=False)
def stl_die(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Flats, slopes, convex and concave fillets in facets of 10°, pressed into steel with friction, over the profile extruded.

    The block fills the die: from 1.2 mm on it is in contact with the concave fillets and the flats beside them.
    """
    forces = []
    with tempfile.TemporaryDirectory() as folder:
        file = write(Path(folder) / "die.stl", *extruded(faceted(FILLED_PROFILE, 2.0), 20.0))
        exact = pr.Extruded(pr.Profile(points=FILLED_PROFILE, fillet=2.0), at=(0.0, 4.0, 0.0))
        for tool, scale in ((exact, 1.0), (pr.Stl(file, at=(0.0, 4.0, 0.0)), E_scale)):
            problem = pr.Problem(
                "die", space="solid", friction=pr.Coulomb(0.1 * (mu_scale if scale != 1.0 else 1.0)),
                bodies={"block": pr.Body(
                    pr.Box((8.0, 4.0, 1.0), (24, 8, 2)), pr.J2(200e3 * scale, 0.3, pr.Swift(K=500.0, e0=0.01, n=0.2)))},
                tools={"die": tool}, contacts=(pr.Contact("block.top", "die"),),
                fixed={"block.bottom": "y", "block.left": "x", "block.back": "z", "block.front": "z"},
                steps=(pr.Step("press", move={"die": pr.Motion(y=-1.5)}, increments=15),),
            )  # fmt: skip
            made = {round(15.0 * i.time, 6): i.force("die").y for i in pr.solve(problem)}
            forces.append([made[float(k)] for k in range(1, 16)])
    exact_forces, ours = np.array(forces)
    for k in (3, 7, 11, 14):
        yield row(f"force (N) at {0.1 * (k + 1):.1f} mm", float(exact_forces[k]), float(ours[k]), 0.01)
    worst = 100.0 * float(np.abs(ours / exact_forces - 1.0).max())
    yield row("force, largest difference in an increment (%)", 0.0, worst, 1.0, "absolute")
    yield row("work (N mm)", float(exact_forces.sum()) * 0.1, float(ours.sum()) * 0.1, 0.01)
