"""A block on a rough base under a tool with its reference point at the middle of the top: what several families begin with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import prensa as pr
from prensa_bench.robustness.drawn import Metal, Placed, chain, circle, friction, metal, number, stamp

LOCKING_FREE = ("q4_fbar", "q4_enhanced", "q8", "t6")


@dataclass(frozen=True)
class Block:
    """A block about x = 0 on y = 0, with its tool; ``h``: length of an element."""

    width: float
    height: float
    h: float
    metal: Metal
    element: str
    tool: Placed
    shape: str
    mu: float
    mesh: Any

    def problem(self, name: str, steps: Sequence[pr.Step]) -> pr.Problem:
        """The block under its tool in plane strain, fixed at its base."""
        return pr.Problem(
            name, bodies={"block": pr.Body(self.mesh, self.metal.material, self.element)}, tools={"tool": self.tool.tool},
            contacts=(pr.Contact(("block.top",), "tool"),), friction=friction(self.mu), fixed={"block.bottom": "xy"},
            steps=tuple(steps),
        )  # fmt: skip

    @property
    def facts(self) -> dict[str, Any]:
        """What the judges of a `Drawn` need to know of the block."""
        m = self.metal
        mu = {"block.top-tool": self.mu}
        return {"tools": {"tool": self.tool}, "mu": mu, "E": m.E, "nu": m.nu, "strength": m.strength}


def block(rng: np.random.Generator, plastic: bool, nx: int, ny: int) -> Block:
    """A block of about nx × ny elements under a stamp, a circle or a profile that covers a third to a half of its top."""
    width, height = number(rng, 12.0, 24.0), number(rng, 4.0, 8.0)
    m = metal(rng, plastic, None if plastic else float(10 ** rng.uniform(1, 5)))
    element = str(rng.choice(LOCKING_FREE))
    if element in ("q8", "t6"):
        nx, ny = nx // 2, ny // 2
    h = width / nx
    shape = str(rng.choice(["stamp", "circle", "profile"]))
    w, at = number(rng, 0.25, 0.4) * width, (0.0, height)
    if shape == "stamp":
        tool = stamp(at, w, min(number(rng, 1.0, 2.0) * h, 0.4 * w))
    elif shape == "circle":
        tool = circle((0.0, height + (R := number(rng, 0.3, 1.5) * width)), R)
    else:  # a wedge with a flat nose
        slope = number(rng, 0.15, 0.6)
        a, b = 0.5 * w, 2 * width
        fits = 0.9 * a / np.tan(0.5 * np.arctan(slope))
        corners = [(-b, slope * (b - a)), (-a, 0.0), (a, 0.0), (b, slope * (b - a))]
        tool = chain(at, corners, min(number(rng, 2.0, 4.0) * h, float(fits)))
    mu = 0.0 if rng.random() < 0.2 else number(rng, 0.02, 0.6)
    grade = pr.Grade(y=(height,), ratio=number(rng, 1.5, 4.0)) if rng.random() < 0.5 else None
    mesh = pr.Rectangle(size=(width, height), n=(nx, ny), origin=(-0.5 * width, 0.0), grade=grade)
    return Block(width, height, h, m, element, tool, shape, mu, mesh)
