"""Forces at nodes of the loads that are drawn in space: pressures that follow their sides, tractions on undeformed flat ones.

Nothing is shared with the solver: sides are found from the names of their nodes, and integrated by rules of this module.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.types import Array, Index
from prensa_bench.robustness.cells_in_space import GAUSS_PLACE, TETRAHEDRON_SIDES, outer_faces
from prensa_bench.robustness.files import Record, Shape

OUTWARD = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
"""Sides of bricks, seen from outside counter-clockwise."""
DUNAVANT = (
    (0.223381589678011, 0.108103018168070, 0.445948490915965),
    (0.109951743655322, 0.816847572980459, 0.091576213509771),
)
"""Weights and places of the rule of degree 4 of triangles (Dunavant 1985), each for three places, the first at one corner."""


def at_time(problem: pr.Problem, name: str, time: float) -> tuple[float, Array]:
    """Pressure and traction (3,) of a load: those that the steps ask for at their ends, linear between, held where not named."""
    before = now = (0.0, np.zeros(3))
    for k, step in enumerate(problem.steps):
        given = step.loads.get(name)
        if given is not None:
            now = float(given.pressure or 0.0), np.array(given.traction or (0.0, 0.0, 0.0), dtype=float)
        if time <= k + 1:
            share = time - k
            return before[0] + share * (now[0] - before[0]), before[1] + share * (now[1] - before[1])
        before = now
    return now


def names_of(problem: pr.Problem) -> list[str]:
    """Sides that carry a load in some step."""
    return list(dict.fromkeys(name for step in problem.steps for name in step.loads))


def applied(record: Record, number: int) -> dict[str, Array]:
    """Forces (n, 3) of all loads at the nodes of the bodies at an increment whose fields are known."""
    row = int(np.flatnonzero(record.history["increment"] == number)[0])
    out = {body: np.zeros_like(s.x) for body, s in record.bodies[number].items()}
    for name in names_of(record.problem):
        pressure, traction = at_time(record.problem, name, float(record.history["time"][row]))
        body, _, side = name.partition(".")
        shape = record.bodies[number][body]
        faces = _side(shape, mesh_of(record.problem.bodies[body].mesh).nodes(side))
        for N, area in _points(faces, shape.x):
            np.add.at(out[body], faces, -pressure * N[:, None] * area[:, None, :])
        for N, area in _points(faces, shape.X):
            np.add.at(out[body], faces, np.linalg.norm(area, axis=1)[:, None, None] * N[:, None] * traction)
    return out


def done(record: Record) -> Array:
    """Work (k,) of the loads in each increment: means of the forces at both ends times ways; the fields of all are known."""
    out, before = np.zeros(len(record.history["time"])), None
    for row, number in enumerate(record.history["increment"].astype(int)):
        now = {body: (f, record.bodies[number][body].x) for body, f in applied(record, number).items()}
        for body, (force, x) in now.items():
            last, was = (np.zeros_like(force), record.bodies[number][body].X) if before is None else before[body]
            out[row] += 0.5 * float(((force + last) * (x - was)).sum())
        before = now
    return out


def _side(shape: Shape, nodes: Index) -> Index:
    """Faces (b, 4 | 6), outward, whose corners are all among some nodes."""
    cells, sides = shape.cells, TETRAHEDRON_SIDES if shape.cells.shape[1] == 10 else OUTWARD
    outer = {tuple(sorted(face)) for face in outer_faces(cells).tolist()}
    faces = np.concatenate([cells[:, side] for side in sides])
    here = np.isin(faces[:, : 3 if cells.shape[1] == 10 else 4], nodes).all(axis=1)
    return np.array([face for face in faces[here].tolist() if tuple(sorted(face)) in outer], dtype=np.int64)


def _points(faces: Index, x: Array) -> Iterator[tuple[Array, Array]]:
    """Shape functions (a,) and weighted area vectors (b, 3) at each point of a rule."""
    if faces.shape[1] == 4:
        for s in (0.5 - GAUSS_PLACE, 0.5 + GAUSS_PLACE):
            for t in (0.5 - GAUSS_PLACE, 0.5 + GAUSS_PLACE):
                N = np.array([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])
                by = np.array([[t - 1, 1 - t, t, -t], [s - 1, -s, s, 1 - s]])
                along = np.einsum("ka,bai->kbi", by, x[faces])
                yield N, 0.25 * np.cross(along[0], along[1])
        return
    for weight, one, two in DUNAVANT:
        for k in range(3):
            L = np.full(3, two)
            L[k] = one
            a, b, c = L
            N = np.array([a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a])
            by = np.array([  # slopes by b and by c, with a = 1 − b − c
                [1 - 4 * a, 4 * b - 1, 0.0, 4 * (a - b), 4 * c, -4 * c],
                [1 - 4 * a, 0.0, 4 * c - 1, -4 * b, 4 * b, 4 * (a - c)],
            ])  # fmt: skip
            along = np.einsum("ka,bai->kbi", by, x[faces])
            yield N, 0.5 * weight * np.cross(along[0], along[1])
