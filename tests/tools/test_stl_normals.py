"""Normals of tools of triangles that follow no pattern, and of grids and slivers: cylinders, cones, tori, fillets and flats."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import Delaunay

from prensa.importers import stl
from prensa.tools.curved import Curved
from prensa.types import Array, Index
from prensa.verify.stl import write

R, STEP = 10.0, np.radians(10.0)
"""Radius, and angle of arc that a facet stands for."""


def scattered(width: float, height: float, size: float, lines: tuple[float, ...] = (), seed: int = 0) -> tuple[Array, Index]:
    """Points (n, 2) of a rectangle about ``size`` apart, evenly on its border and vertical ``lines``; triangles (m, 3)."""
    rng = np.random.default_rng(seed)
    across, up = (np.linspace(0.0, v, int(np.ceil(v / size)) + 1) for v in (width, height))
    columns = np.unique(np.concatenate([[0.0, width], lines]))
    fixed = [np.stack([np.full(len(up), c), up], axis=1) for c in columns]
    across = across[np.abs(across[:, None] - columns).min(axis=1) > 0.4 * size]
    fixed += [np.stack([across, np.full(len(across), y)], axis=1) for y in (0.0, height)]
    kept = list(np.concatenate(fixed))
    for x in rng.uniform(0.0, 1.0, (int(20 * width * height / size**2), 2)) * (width, height):
        if np.linalg.norm(np.array(kept) - x, axis=1).min() > 0.7 * size:
            kept.append(x)
    x = np.array(kept)
    return x, Delaunay(x).simplices


def cylinder(u: Array) -> tuple[Array, Array]:
    """Places and normals (k, 3) at arc lengths and heights (k, 2) of a cylinder."""
    a = u[:, 0] / R
    n = np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    return R * n + u[:, 1:] * [0.0, 0.0, 1.0], n


def cone(u: Array) -> tuple[Array, Array]:
    """The same of a cone whose sides lean by 30°."""
    r, a = R - 0.5 * u[:, 1], u[:, 0] / R
    e = np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    return r[:, None] * e + np.sqrt(0.75) * u[:, 1:] * up, np.sqrt(0.75) * e + 0.5 * up


def torus(u: Array) -> tuple[Array, Array]:
    """The same of the outer half of a ring of radii 2 R and R."""
    a, b = u[:, 0] / (2.5 * R), u[:, 1] / R - 0.5 * np.pi
    e = np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    n = np.cos(b)[:, None] * e + np.sin(b)[:, None] * [0.0, 0.0, 1.0]
    return 2.0 * R * e + R * n, n


def fillet(u: Array) -> tuple[Array, Array]:
    """The same of a quarter of a cylinder between two flats of width R."""
    s = np.clip(u[:, 0] - R, 0.0, 0.5 * np.pi * R) / R
    n = np.stack([np.sin(s), 0.0 * s, np.cos(s)], axis=1)
    x = np.stack([R * np.sin(s), u[:, 1], R * np.cos(s)], axis=1)
    x += np.minimum(u[:, :1] - R, 0.0) * [1.0, 0.0, 0.0]
    return x + np.maximum(u[:, :1] - (1.0 + 0.5 * np.pi) * R, 0.0) * [0.0, 0.0, -1.0], n


QUARTER = 0.5 * np.pi * R
SURFACES = {
    "cylinder": (cylinder, 2.0 * QUARTER, 2.0 * R, ()),
    "cone": (cone, 2.0 * QUARTER, R, ()),
    "torus": (torus, 2.0 * QUARTER, 2.0 * QUARTER, ()),
    "fillet between flats": (fillet, 2.0 * R + QUARTER, 2.0 * R, (R, R + QUARTER)),
}


def read(folder: Path, points: Array, triangles: Index) -> Curved:
    """The patches of triangles, written to a file of seven digits and read again."""
    path = write(folder / "made.stl", points, triangles)
    return Curved(stl.read(path, ""), np.pi / 6)


def off(shape: Curved, x: Array, n: Array, seed: int = 1) -> tuple[Array, Array]:
    """Angles (k,) in degrees between normals near places x and n (k, 3), both ways of n; errors (k,) of gaps."""
    d = np.random.default_rng(seed).uniform(-0.1, 0.1, len(x))
    seen = shape.closest(x + d[:, None] * n)
    sine, cosine = np.linalg.norm(np.cross(seen.n, n), axis=1), np.einsum("ki,ki->k", seen.n, n)
    sign = np.sign(cosine.mean())
    return np.degrees(np.arctan2(sine, sign * cosine)), np.abs(seen.g - sign * d)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("seed", range(3))
def test_normals_of_triangles_without_a_pattern(tmp_path: Path, name: str, seed: int) -> None:
    """Facets of 10°: within 1° of the surface that they stand for, two of them from the border; gaps a tenth of their chords."""
    surface, width, height, lines = SURFACES[name]
    size = R * STEP
    u, triangles = scattered(width, height, size, lines, seed)
    shape = read(tmp_path, surface(u)[0], triangles)
    look = 2.0 * size + np.random.default_rng(seed).uniform(0.0, 1.0, (4000, 2)) * (np.array([width, height]) - 4.0 * size)
    angle, gap = off(shape, *surface(look))
    assert angle.max() < 1.0 and angle.mean() < 0.15
    assert gap.max() < 0.1 * shape.chords.max()


@pytest.mark.parametrize("seed", range(3))
def test_flats_beside_fillets_of_any_triangles(tmp_path: Path, seed: int) -> None:
    """Flat to 1e-12 where the file has them so; nothing of the fillet is taken for one."""
    surface, width, height, lines = SURFACES["fillet between flats"]
    u, triangles = scattered(width, height, R * STEP, lines, seed)
    shape = read(tmp_path, surface(u)[0], triangles)
    level = np.ptp(shape.facets.x[:, :, 2], axis=1) == 0.0
    assert level.sum() > 50 and shape.facets.flats[level].all()
    curved = (shape.facets.normals[:, [0, 2]].min(axis=1) > 0.01) | (shape.facets.normals[:, [0, 2]].max(axis=1) < -0.01)
    assert curved.sum() > 50 and not shape.facets.flats[curved].any()
    x = np.stack([*np.random.default_rng(seed).uniform([[-0.8 * R], [0.2 * R]], [[-0.01], [1.8 * R]], (2, 500)), np.full(500, R)])
    angle, gap = off(shape, x.T, np.tile([0.0, 0.0, 1.0], (500, 1)))
    assert angle.max() < 1e-10 and gap.max() < 1e-12


def test_a_ring_of_regular_strips_does_not_waver(tmp_path: Path) -> None:
    """A torus in 36 × 36 rectangles, each halved: arcs alone leave normals free that lean to and fro from ring to ring."""
    n = 36
    a, b = (v.ravel() for v in np.meshgrid(*[2.0 * np.pi * np.arange(n) / n] * 2, indexing="ij"))
    u = np.stack([2.5 * R * a, R * (b + 0.5 * np.pi)], axis=1)
    i, j = np.divmod(np.arange(n * n), n)
    at = [((i + p) % n) * n + (j + q) % n for p, q in ((0, 0), (1, 0), (1, 1), (0, 1))]
    triangles = np.concatenate([np.stack([at[0], at[1], at[2]], axis=1), np.stack([at[0], at[2], at[3]], axis=1)])
    shape = read(tmp_path, torus(u)[0], triangles)
    look = np.random.default_rng(2).uniform(0.0, 2.0 * np.pi, (4000, 2)) * [2.5 * R, R]
    assert shape.surface.closed and not shape.facets.flats.any()
    assert off(shape, *torus(look))[0].max() < 1.0


def test_long_strips_of_a_cylinder(tmp_path: Path) -> None:
    """Thirty times as long as wide, as CAD writes them: normals within a quarter of the angle between them, lines straight."""
    columns = np.arange(0.0, 2.0 * QUARTER + 1e-9, R * STEP)
    u = np.concatenate([np.stack([columns, np.full(len(columns), z)], axis=1) for z in (0.0, 50.0)])
    i, n = np.arange(len(columns) - 1), len(columns)
    triangles = np.concatenate([np.stack([i, i + 1, n + i], axis=1), np.stack([i + 1, n + i + 1, n + i], axis=1)])
    shape = read(tmp_path, cylinder(u)[0], triangles)
    look = np.random.default_rng(3).uniform([2 * R * STEP, 2.0], [2 * QUARTER - 2 * R * STEP, 48.0], (4000, 2))
    assert off(shape, *cylinder(look))[0].max() < np.degrees(0.25 * STEP)
    seam = np.stack([np.full(200, columns[9]), np.linspace(1.0, 49.0, 200)], axis=1)
    assert np.abs(shape.closest(cylinder(seam)[0]).g).max() < 0.01 * shape.chords.max()
