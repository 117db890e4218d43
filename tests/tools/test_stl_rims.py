"""Rims of STL tools: round caps, holes and slanted ends as CAD writes them, where triangles are slivers along the rim."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from prensa.importers import stl
from prensa.tools.curved import Curved
from prensa.types import Array, Index
from prensa.verify.stl import write

R, N, HALF = 5.0, 40, 4.0
"""Radius of a round side, its facets (9°), half of its height."""
SAG = R * (1.0 - np.cos(np.pi / N))
"""Height of an arc over its facet."""
Z = np.array([0.0, 0.0, 1.0])


def around() -> Array:
    """Angles (N,) of the points of a rim, not quite evenly."""
    even = np.arange(N) % (N // 8) == 0  # those towards the corners of a square are kept
    return 2.0 * np.pi * (np.arange(N) + np.where(even, 0.0, np.random.default_rng(5).uniform(-0.2, 0.2, N))) / N


def side(slope: float) -> tuple[Array, Index]:
    """Points (2 N, 3), the lower rim first, and triangles of a round side whose upper rim rises with x."""
    a = around()
    x, y = R * np.cos(a), R * np.sin(a)
    rims = [np.stack([x, y, np.full(N, -HALF)], axis=1), np.stack([x, y, HALF + slope * x], axis=1)]
    i, j = np.arange(N), (np.arange(N) + 1) % N
    return np.concatenate(rims), np.concatenate([np.stack([i, j, N + j], 1), np.stack([i, N + j, N + i], 1)])


def post(slope: float) -> tuple[Array, Index]:
    """A closed cylinder; every second point of a rim is cut off by a sliver, as often as there are more than three."""
    points, triangles = side(slope)
    cap, rim = [], list(range(N))
    while len(rim) > 2:
        cap += [(rim[k], rim[k + 1], rim[(k + 2) % len(rim)]) for k in range(0, len(rim) - 1, 2) if len(rim) > 2]
        rim = rim[::2]
    cap = np.array([t for t in cap if len(set(t)) == 3])
    return points, np.concatenate([triangles, cap[:, ::-1], cap + N])


def plate(slope: float) -> tuple[Array, Index]:
    """A square plate with a hole, of strips from the rims to the outline."""
    points, hole = side(slope)
    a = around()
    out = 2.0 * R * np.stack([np.cos(a), np.sin(a)], 1) / np.maximum(abs(np.cos(a)), abs(np.sin(a)))[:, None]
    outer = [np.column_stack([out, sign * HALF + 0.5 * (1 + sign) * slope * out[:, 0]]) for sign in (-1, 1)]
    i, j = np.arange(N), (np.arange(N) + 1) % N
    low, high, walls = [
        np.concatenate([np.stack([p + i, p + j, q + j], 1), np.stack([p + i, q + j, q + i], 1)])
        for p, q in ((0, 2 * N), (N, 3 * N), (2 * N, 3 * N))
    ]
    return np.concatenate([points, *outer]), np.concatenate([hole[:, ::-1], low[:, ::-1], high, walls])


def read(folder: Path, made: tuple[Array, Index]) -> Curved:
    """The patches of a file."""
    return Curved(stl.read(write(folder / "made.stl", *made), ""), np.pi / 6)


def round_off(shape: Curved, slope: float, sign: float, seed: int = 0) -> tuple[Array, Array]:
    """Angles (k,) in degrees and errors (k,) of gaps beside a round side, its rims included."""
    rng = np.random.default_rng(seed)
    a, s, d = rng.uniform(0.0, 2.0 * np.pi, 4000), rng.uniform(0.001, 0.999, 4000), rng.uniform(-1e-3, 1e-3, 4000)
    n = sign * np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    z = -HALF + s * (2.0 * HALF + slope * R * np.cos(a))
    seen = shape.closest(sign * R * n + z[:, None] * Z + d[:, None] * n)
    return np.degrees(np.linalg.norm(np.cross(seen.n, n), axis=1)), np.abs(seen.g - d)


@pytest.mark.parametrize("slope", [0.0, 0.5])
@pytest.mark.parametrize(("made", "sign"), [(post, 1.0), (plate, -1.0)], ids=["post", "hole"])
def test_round_sides_are_round_up_to_their_rims(tmp_path: Path, made, sign: float, slope: float) -> None:
    """Whatever the flats at the rims are made of: normals to 1° over facets of 9°, gaps to a seventh of their arcs."""
    shape = read(tmp_path, made(slope))
    assert shape.surface.closed and shape.surface.volume > 0.0
    angle, gap = round_off(shape, slope, sign)
    assert angle.max() < 1.0 and angle.mean() < 0.2 and gap.max() < 0.15 * SAG
    assert 0.5 * SAG < shape.chords.max() < 2.5 * SAG


@pytest.mark.parametrize(("made", "sign"), [(post, -1.0), (plate, 1.0)], ids=["post", "hole"])
def test_flats_go_as_far_as_their_round_rims(tmp_path: Path, made, sign: float) -> None:
    """To a sixth of the arc over a facet: between arc and facet too, flat to 1e-12."""
    shape, rng = read(tmp_path, made(0.0)), np.random.default_rng(1)
    a, off = rng.uniform(0.0, 2.0 * np.pi, 4000), rng.uniform(0.16, 3.0, 4000) * SAG
    r = R + sign * off
    for up in (-1.0, 1.0):
        d = rng.uniform(-0.01, 0.01, 4000) * SAG
        seen = shape.closest(np.stack([r * np.cos(a), r * np.sin(a), up * HALF + up * d], axis=1))
        assert np.abs(seen.n - up * Z).max() < 1e-12 and np.abs(seen.g - d).max() < 1e-12


def test_beyond_a_rim_the_distance_is_that_to_its_circle(tmp_path: Path) -> None:
    """And the normal leads there."""
    shape, rng = read(tmp_path, post(0.0)), np.random.default_rng(2)
    a, out, up = rng.uniform(0.0, 2.0 * np.pi, 500), *rng.uniform(0.2, 2.0, (2, 500))
    e = np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    seen = shape.closest((R + out)[:, None] * e + (HALF + up)[:, None] * Z)
    assert np.abs(seen.g - np.hypot(out, up)).max() < 0.15 * SAG
    assert np.abs(np.linalg.norm(np.cross(seen.n, (out[:, None] * e + up[:, None] * Z)), axis=1) / seen.g).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_patches_turn_no_farther_than_their_normals(tmp_path: Path, seed: int) -> None:
    """Slivers on a cylinder, up to a hundred times as long as high: off by less than the angle between facets (26° otherwise)."""
    rng, k = np.random.default_rng(seed), 12
    a = np.radians(9.0) * np.arange(k)

    def row(angles: Array, low: float, high: float) -> Array:
        return np.stack([R * np.cos(angles), R * np.sin(angles), rng.uniform(low, high, k)], axis=1)

    points = np.concatenate([row(a, -20.0, -10.0), row(a, 10.0, 20.0), row(a + np.radians(1.0), -9.0, 9.0)])
    i, j = np.arange(k - 1), np.arange(1, k)
    rows = [(i, j, 2 * k + i), (j, k + j, 2 * k + i), (k + j, k + i, 2 * k + i), (k + i, i, 2 * k + i)]
    shape = read(tmp_path, (points, np.concatenate([np.stack(t, axis=1) for t in rows])))
    a, z = rng.uniform(np.radians(18.0), np.radians(78.0), 4000), rng.uniform(-8.0, 8.0, 4000)
    n = np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    seen = shape.closest(R * n + z[:, None] * Z)
    assert np.degrees(np.arcsin(np.linalg.norm(np.cross(seen.n, n), axis=1).clip(0.0, 1.0))).max() < 9.0
