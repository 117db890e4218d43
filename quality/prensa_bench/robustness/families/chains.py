"""Chains of runs, each started from the one before, beside the same in one run."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

import prensa as pr
from prensa_bench.robustness.drawn import Drawn, Twin, number
from prensa_bench.robustness.families.under import block

SAME_CHAIN = 1e-4  # allowed difference of the last forces, of the largest


def problem(rng: np.random.Generator) -> Drawn:
    """Press, slide, press deeper, lift a little: in two to four runs."""
    b = block(rng, plastic=rng.random() < 0.6, nx=int(rng.integers(14, 23)), ny=int(rng.integers(4, 7)))
    depth, way = number(rng, 0.01, 0.04) * b.height, number(rng, -2.0, 2.0)
    n = int(rng.integers(10, 21))
    steps = [
        pr.Step("press", move={"tool": pr.Motion(y=-depth)}, increments=n),
        pr.Step("slide", move={"tool": pr.Motion(x=way * depth)}, increments=n),
        pr.Step("deeper", move={"tool": pr.Motion(y=-1.3 * depth)}, increments=n),
        pr.Step("lift", move={"tool": pr.Motion(y=-1.28 * depth)}, increments=n),
    ]
    cuts = sorted(rng.choice([1, 2, 3], size=int(rng.integers(1, 4)), replace=False).tolist())
    ends = [0, *cuts, len(steps)]
    stages = tuple(b.problem(f"chain {k}", steps[i:j]) for k, (i, j) in enumerate(pairwise(ends)))
    twin = Twin(b.problem("the same in one run", steps), tolerance=SAME_CHAIN)
    kind = f"{len(stages)} runs, {b.shape}, mu {b.mu:.2g}, {b.metal.type}, {b.element}"
    return Drawn(stages, **b.facts, twins=(twin,), limit=30.0, kind=kind)
