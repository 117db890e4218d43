"""Loads on bodies in space against closed forms: tube and sphere under pressure, a column under its own weight.

The part of the sphere is bounded by four planes through its centre, two of which are on no axis (a cube blown up to a sphere).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.types import Array
from prensa.verify.rates import root_mean_square
from prensa.verify.table import Row, case, row
from prensa.verify.ties import shell_flexibility

BORE_RADIUS, RIM_RADIUS, BORE_PRESSURE, BORE_NU = 1.0, 2.0, 10.0, 0.3
_SQUARE_OF_CELLS = ((0, 0), (1, 0), (1, 1), (0, 1))


def sphere(r: Array, a: float, b: float, p: float, E: float, nu: float) -> Array:
    """Radial displacement at r of a sphere a … b under inner pressure p (Lamé; Timoshenko and Goodier, art. 136)."""
    return p * a**3 / (E * (b**3 - a**3)) * ((1.0 - 2.0 * nu) * r + (1.0 + nu) * b**3 / (2.0 * r**2))


def solved(E_scale: float, mesh: object, nu: float = BORE_NU, **more: object) -> pr.Increment:
    """The one increment of an elastic body."""
    problem = pr.Problem(
        "loaded", space="solid", kinematics="small", bodies={"b": pr.Body(mesh, pr.Elastic(1000.0 * E_scale, nu))},
        steps=(pr.Step("load", increments=1),), **more,
    )  # fmt: skip
    *_, last = pr.solve(problem)
    return last


def part_of_sphere(n: int) -> pr.Bricks:
    """Bricks (n x n x n) over a 24th of a sphere, between the planes y = 0, y = x, z = 0 and z = x."""
    k = np.arange(n + 1)
    i, j, m = (g.ravel() for g in np.meshgrid(k, k, k, indexing="ij"))
    d = np.stack([np.ones(len(i)), np.tan(0.25 * np.pi * j / n), np.tan(0.25 * np.pi * m / n)], axis=1)
    points = (BORE_RADIUS * (RIM_RADIUS / BORE_RADIUS) ** (i / n) / np.linalg.norm(d, axis=1))[:, None] * d
    number = np.arange(len(i)).reshape([n + 1] * 3)
    corners = [number[a : n + a, b : n + b, c : n + c] for c in (0, 1) for a, b in _SQUARE_OF_CELLS]
    cells = np.stack(corners, axis=-1).reshape(-1, 8)
    sides = {"inner": number[0], "y": number[:, 0], "yx": number[:, -1], "z": number[:, :, 0], "zx": number[:, :, -1]}
    return pr.Bricks(points.tolist(), cells.tolist(), {name: nodes.ravel().tolist() for name, nodes in sides.items()})


def pushed_outwards(n: int) -> Array:
    """Resultant (3,) of the pressure in `part_of_sphere`: that on any surface within the border of the inner side."""
    number, x = np.arange((n + 1) ** 2).reshape(n + 1, n + 1), np.array(part_of_sphere(n).points)
    border = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    area = 0.5 * np.cross(x[border], x[np.roll(border, -1)]).sum(axis=0)
    return np.asarray(BORE_PRESSURE * area * np.sign(area[0]))


@case("pressure and weight on bodies in space", suite="space")
def closed_forms(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Lamé's tube between axes and sphere between inclined planes, at order 2; a column that hangs under its weight, exactly."""
    E, load = 1000.0, pr.Load(pressure=BORE_PRESSURE)
    errors = []
    for n in (4, 8):
        section = pr.Rectangle((RIM_RADIUS - BORE_RADIUS, 0.25), (n, 1), (BORE_RADIUS, 0.0))
        fixed = {"b.bottom": "y", "b.top": "y", "b.base": "z", "b.cap": "x"}
        tube = solved(E_scale, pr.Revolution(section, 2 * n, angle=np.pi / 2), fixed=fixed, loads={"b.left": load})
        r = np.hypot(tube.bodies["b"].X[:, 0], tube.bodies["b"].X[:, 2])
        moved = (tube.bodies["b"].displacement * tube.bodies["b"].X * (1.0, 0.0, 1.0)).sum(axis=1) / r
        exact = np.array([shell_flexibility(E, BORE_NU, BORE_RADIUS, RIM_RADIUS, at, BORE_PRESSURE, 0.0) for at in r.tolist()])
        errors.append(root_mean_square(moved / exact - 1.0))
    yield row("tube: error of the displacement, 8 bricks", 0.0, errors[1], 2e-3, "absolute")
    yield row("tube: order", 1.9, float(np.log2(errors[0] / errors[1])), kind="at least")
    errors = []
    for n in (4, 8):
        fixed = {"b.y": "y", "b.z": "z", "b.yx": "normal", "b.zx": "normal"}
        ball = solved(E_scale, part_of_sphere(n), fixed=fixed, loads={"b.inner": load})
        r = np.linalg.norm(ball.bodies["b"].X, axis=1)
        moved = (ball.bodies["b"].displacement * ball.bodies["b"].X).sum(axis=1) / r
        errors.append(root_mean_square(moved / sphere(r, BORE_RADIUS, RIM_RADIUS, BORE_PRESSURE, E, BORE_NU) - 1.0))
    yield row("sphere: error of the displacement, 8 bricks", 0.0, errors[1], 5e-3, "absolute")
    yield row("sphere: order", 1.9, float(np.log2(errors[0] / errors[1])), kind="at least")
    pushed = pushed_outwards(8)
    rest = pushed + np.sum([list(f) for f in ball.supports.values()], axis=0)
    yield row("sphere: supports and pressure out of balance", 0.0, np.abs(rest).max() / np.abs(pushed).max(), 1e-8, "absolute")
    hung = solved(E_scale, pr.Box((1.0, 4.0, 1.0), (1, 5, 1)), 0.0, fixed={"b.top": "xyz"}, body_force={"b": (0.0, -3.0, 0.0)})
    end = 4.0 - hung.bodies["b"].X[:, 1]
    exact = -3.0 / E * (4.0 * end - 0.5 * end**2)
    yield row("column: displacement at its end", exact.min(), hung.bodies["b"].displacement[:, 1].min(), 1e-9)
    yield row("column: force of its support", 12.0, hung.supports["b.top"].y, 1e-9)
