"""Random punches whose edges, fillets, faces or radii are about as large as elements, held against finer meshes.

Flat punches, rounded or sharp, blunt wedges, rolls and tilted blocks, at random places between nodes. Right is a force within 5 %
of a mesh four times as fine, or eight times where that mesh is warned of itself; else the run has to name the cause.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import prensa as pr
from prensa.result.increment import Increment
from prensa_bench import marks

RIGHT_FORCE = 0.05  # allowed difference of the last force, of that of the finer mesh
FINENESS = (4, 8)  # elements of that mesh along an element; the second where the first mesh is warned of, too


class Punch(NamedTuple):
    """A ``tool``, how deep it goes into a body of elements of length 1, n (2,) along its sides, and of what that is."""

    tool: Any
    depth: float
    n: tuple[int, int]
    material: Any
    mu: float

    def problem(self, finer: int = 1) -> pr.Problem:
        """It pressed into the body, each element of which is divided into ``finer`` along its sides."""
        wide, high = self.n
        mesh = pr.Rectangle((float(wide), float(high)), n=(wide * finer, high * finer))
        return pr.Problem(
            "punch", bodies={"block": pr.Body(mesh, self.material)}, tools={"punch": self.tool},
            contacts=(pr.Contact("block.top", "punch"),), friction=pr.Coulomb(self.mu), fixed={"block.bottom": "xy"},
            steps=[pr.Step("press", move={"punch": {"y": -self.depth}}, increments=6)],
        )  # fmt: skip


def draw(seed: int, number: int) -> Punch:
    """Punch *number*: the same for the same arguments."""
    rng = np.random.default_rng([seed, number])
    n = (int(rng.integers(10, 21)), int(rng.integers(5, 11)))
    at = (n[0] / 2 + float(rng.uniform(-1.0, 1.0)), float(n[1]))
    plastic = bool(rng.random() < 0.3)
    material: Any = pr.J2(1000.0, 0.3, pr.Linear(5.0, 20.0)) if plastic else pr.Elastic(1000.0, 0.3)
    kind = ("sharp", "rounded", "wedge", "roll", "tilted")[number % 5]
    tool, depth = _tool(kind, rng, at)
    return Punch(tool, depth, n, material, 0.2 if rng.random() < 0.3 else 0.0)


def _tool(kind: str, rng: np.random.Generator, at: tuple[float, float]) -> tuple[Any, float]:
    """A tool that touches at a place, and how deep it goes."""
    if kind in ("sharp", "rounded"):
        width = float(rng.uniform(0.8, 5.0))
        fillet = 0.0 if kind == "sharp" else float(rng.uniform(0.02, 0.5)) * width
        return pr.Stamp(width=width, fillet=fillet, at=at, facing=(0, -1)), float(rng.uniform(0.05, 0.4))
    if kind == "roll":
        radius = float(np.exp(rng.uniform(0.0, 3.0)))
        depth = min(float(rng.uniform(0.5, 3.0)) ** 2 / (2 * radius), 0.4 * radius, 0.8)
        return pr.Circle(radius=radius, at=(at[0], at[1] + radius)), depth
    if kind == "wedge":
        slope, face = float(rng.uniform(0.1, 1.0)), float(rng.uniform(0.2, 2.0))
        half = 0.5 * face + 9.0
        points = ((0.5 * face, 0.0), (half, 9.0 * slope), (half, 20.0), (-half, 20.0), (-half, 9.0 * slope), (-0.5 * face, 0.0))
        return pr.Polygon(points=points, fillet=float(rng.uniform(0.05, 0.5)) * face, at=at), float(rng.uniform(0.1, 0.8))
    rise, width = float(rng.uniform(-0.2, 0.2)), float(rng.uniform(1.0, 5.0))
    corners = ((-0.5 * width, 0.0), (0.5 * width, rise * width), (0.5 * width, 9.0), (-0.5 * width, 9.0))
    place = (at[0], at[1] - min(0.0, rise * width))
    return pr.Polygon(points=corners, fillet=float(rng.uniform(0.03, 0.3)), at=place), float(rng.uniform(0.1, 0.6))


def _force(last: Increment) -> float:
    return float(last.force("punch").y)


def answer(problem: pr.Problem) -> tuple[float, list[str]]:
    """The last force of a punch, none where the run failed, and what was said of it, in ``check`` too."""
    return marks.answer(problem, _force)


def verdict(punch: Punch) -> tuple[str, float, list[str]]:
    """See `prensa_bench.marks.verdict`: of the force, against the finer mesh."""
    return marks.verdict(marks.Mark(punch.problem(), tuple(punch.problem(n) for n in FINENESS), _force, RIGHT_FORCE))
