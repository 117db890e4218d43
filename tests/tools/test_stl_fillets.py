"""Fillets of STL tools as CAD writes them: straight and around a plan, of triangles up to thirty times as long as wide."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from prensa.importers import stl
from prensa.tools.curved import Curved
from prensa.types import Array, Flags, Index
from prensa.verify.stl import write

PATTERNS = ("one way", "to and fro", "at random", "staggered")
"""How the cells between lines along a fillet are halved; staggered: every second line is half a cell further."""


@dataclass(frozen=True)
class Fillet:
    """A level flat, an arc of ``count`` facets of an angle ``step`` and radius ``r``, and what goes straight on from it.

    ``plan``: radius of the arc's beginning around an axis; 0: straight. ``side``: 1 if the arc goes outwards from there, else −1;
    ``sign``: 1 convex, −1 concave. ``along``: length of a cell along the fillet, as an angle if that goes around.
    """

    r: float
    step: float
    count: int
    plan: float
    side: int
    sign: int
    along: float

    @property
    def arc(self) -> float:
        """Its length."""
        return self.r * self.step * self.count

    def at(self, u: Array) -> tuple[Array, Array]:
        """Places and normals (k, 3) at distances from the flat's end (negative in the flat), and along (k, 2)."""
        s, end = np.clip(u[:, 0], 0.0, self.arc) / self.r, self.step * self.count
        after = np.maximum(u[:, 0] - self.arc, 0.0)
        out = self.r * np.sin(s) + np.minimum(u[:, 0], 0.0) + after * np.cos(end)
        up = self.sign * (self.r * (np.cos(s) - 1.0) - after * np.sin(end))
        lean = self.sign * np.sin(s)
        if not self.plan:
            return np.stack([out, u[:, 1], up], axis=1), np.stack([lean, 0.0 * s, np.cos(s)], axis=1)
        c, d = np.cos(u[:, 1]), np.sin(u[:, 1])
        r, lean = self.plan + self.side * out, self.side * lean
        return np.stack([r * c, r * d, up], axis=1), np.stack([lean * c, lean * d, np.cos(s)], axis=1)

    def triangles(self, pattern: str, rng: np.random.Generator) -> tuple[Array, Index]:
        """Places (n, 2) of points as `at` takes them, in any order, and triangles (m, 3) that begin with any corner."""
        lines = np.concatenate([[-self.r], self.r * self.step * np.arange(self.count + 1), [self.arc + self.r]])
        cells = round(2.0 * np.pi / self.along) if self.plan else 12
        n = cells if self.plan else cells + 1
        u = np.array([
            (x, self.along * (i + (0.5 * (k % 2) if pattern == "staggered" else 0.0)))
            for k, x in enumerate(lines) for i in range(n)
        ])  # fmt: skip
        found = []
        for k in range(len(lines) - 1):
            for i in range(cells):
                a, b, c, d = k * n + i, k * n + (i + 1) % n, (k + 1) * n + i, (k + 1) * n + (i + 1) % n
                other = {
                    "one way": False, "to and fro": (i + k) % 2 == 0, "at random": rng.random() < 0.5, "staggered": k % 2 == 1,
                }[pattern]  # fmt: skip
                found += [(a, c, d), (a, d, b)] if other else [(a, c, b), (b, c, d)]
        order = rng.permutation(len(u))
        x = np.empty_like(u)
        x[order] = u
        t = order[np.array(found)][rng.permutation(len(found))]
        return x, np.array([np.roll(corners, rng.integers(3)) for corners in t])

    def looks(self, rng: np.random.Generator, k: int = 3000) -> Array:
        """Places (2 k, 2) in flat, arc and beyond, away from open ends; half of them in the arc."""
        across = np.concatenate([rng.uniform(-0.9 * self.r, self.arc + 0.9 * self.r, k), rng.uniform(0.0, self.arc, k)])
        ends = (0.0, 2.0 * np.pi) if self.plan else (2.0 * self.along, 10.0 * self.along)
        return np.stack([across, rng.uniform(*ends, 2 * k)], axis=1)


def drawn(rng: np.random.Generator, around: bool, pattern: str) -> Fillet:
    """Radii .2 to 5, facets 5 to 12°, triangles up to 30 times as long as wide.

    Around a plan the chord of a cell's rim is off it by less than a quarter of the width of a facet (staggered: a tenth, beyond
    which facets beside each other lean to and fro).
    """
    while True:
        r, aspect = np.exp(rng.uniform(np.log([0.2, 1.0]), np.log([5.0, 30.0])))
        step, along = np.radians(rng.uniform(5.0, 12.0, 2))
        count = max(2, int(np.radians(rng.uniform(30.0, 90.0)) / step))
        width, side, sign = r * step, *rng.choice([-1, 1], 2)
        if not around:
            return Fillet(r, step, count, 0.0, 1, sign, aspect * width)
        plan = max(aspect * width / along, 2.5 * r)
        if plan * along**2 / 8.0 < (0.1 if pattern == "staggered" else 0.25) * width:
            return Fillet(r, step, count, plan, side, sign, 2.0 * np.pi / round(2.0 * np.pi / along))


def compared(fillet: Fillet, folder: Path, pattern: str, rng: np.random.Generator) -> tuple[Array, Array, Flags]:
    """Angles (k,) in degrees of normals, errors (k,) of gaps over the height of an arc, and which are of the level flat."""
    u, triangles = fillet.triangles(pattern, rng)
    shape = Curved(stl.read(write(folder / "fillet.stl", fillet.at(u)[0], triangles), ""), np.pi / 6)
    look = fillet.looks(rng)
    x, n = fillet.at(look)
    sag = fillet.r * (1.0 - np.cos(0.5 * fillet.step))
    d = rng.uniform(-0.3, 0.3, len(x)) * sag
    seen = shape.closest(x + d[:, None] * n)
    cosine = np.einsum("ki,ki->k", seen.n, n)
    sign = np.sign(np.median(cosine))
    angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(seen.n, n), axis=1), sign * cosine))
    return angle, np.abs(sign * seen.g - d) / sag, look[:, 0] < -0.25 * fillet.r


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("around", [False, True], ids=["straight", "around"])
@pytest.mark.parametrize("seed", range(6))
def test_fillets_of_long_triangles(tmp_path: Path, around: bool, pattern: str, seed: int) -> None:
    """Normals within 3° (12° without sides that bend within the surface), flats flat to 1e-12."""
    rng = np.random.default_rng([seed, around, PATTERNS.index(pattern)])
    angle, gap, flat = compared(drawn(rng, around, pattern), tmp_path, pattern, rng)
    assert angle.max() < 3.0 and angle.mean() < 0.5
    assert flat.sum() > 100 and angle[flat].max() < 1e-10 and gap[flat].max() < 1e-11


@pytest.mark.parametrize("sign", [1, -1], ids=["convex", "concave"])
@pytest.mark.parametrize("side", [1, -1], ids=["outwards", "inwards"])
@pytest.mark.parametrize("pattern", ["one way", "to and fro"])
def test_the_rim_of_a_small_fillet_is_a_circle(tmp_path: Path, pattern: str, side: int, sign: int) -> None:
    """Radius .6, facets of 10°, triangles 12 times as long: normals 2° (5° and more with straight rims), on it the flat's."""
    fillet, rng = Fillet(0.6, np.radians(10.0), 9, 0.6 * 12.0, side, sign, np.radians(10.0)), np.random.default_rng(0)
    assert compared(fillet, tmp_path, pattern, rng)[0].max() < 2.0
    look = fillet.looks(rng)
    look[:, 0] = 0.0
    x, n = fillet.at(look)
    seen = Curved(stl.read(str(tmp_path / "fillet.stl"), ""), np.pi / 6).closest(x)
    chord = fillet.plan * (1.0 - np.cos(0.5 * fillet.along))
    assert np.abs(seen.g).max() < 2e-3 * chord and np.linalg.norm(np.cross(seen.n, n), axis=1).max() < np.radians(1.0)
