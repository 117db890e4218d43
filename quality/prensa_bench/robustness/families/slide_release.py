"""A tool pressed into a block, moved along its surface, back, and lifted."""

from __future__ import annotations

import numpy as np

import prensa as pr
from prensa_bench.robustness.claims import let_go, sprung_back
from prensa_bench.robustness.drawn import Drawn, logarithmic, number
from prensa_bench.robustness.families.under import block


def problem(rng: np.random.Generator) -> Drawn:
    """Stamps, circles and profiles, elastic or elastic-plastic, any friction to 0.6."""
    b = block(rng, plastic=rng.random() < 0.5, nx=int(rng.integers(18, 29)), ny=int(rng.integers(5, 9)))
    depth = number(rng, 0.01, 0.08) * b.height
    way = float(rng.choice([-1, 1])) * logarithmic(rng, 0.5 * depth, 0.2 * b.width)
    back = way * number(rng, -0.7, 0.7)
    p = b.problem("slide and release", (
        pr.Step("press", move={"tool": pr.Motion(y=-depth)}),
        pr.Step("slide", move={"tool": pr.Motion(x=way)}),
        pr.Step("reverse", move={"tool": pr.Motion(x=back)}),
        pr.Step("release", move={"tool": pr.Motion(y=0.5 * depth)}),
    ))  # fmt: skip
    kind = f"{b.shape}, mu {b.mu:.2g}, {b.metal.type}, {b.element}"
    claims = (let_go,) if b.metal.strength else (let_go, sprung_back)
    return Drawn((p,), **b.facts, claims=claims, limit=30.0, kind=kind)
