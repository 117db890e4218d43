"""Ten times pressed and let go."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import prensa as pr
from prensa.bench.robustness.claims import let_go, sprung_back
from prensa.bench.robustness.drawn import Drawn, number
from prensa.bench.robustness.families.under import block

if TYPE_CHECKING:
    from prensa.bench.robustness.files import Record

TIMES = 10
SAME_ELASTIC, SAME_PLASTIC = 1e-4, 0.1  # allowed change of the peak from the second cycle on


def problem(rng: np.random.Generator) -> Drawn:
    """A block under a stamp, a circle or a profile that goes to the same depth each time."""
    b = block(rng, plastic=rng.random() < 0.6, nx=int(rng.integers(10, 17)), ny=int(rng.integers(4, 7)))
    depth = number(rng, 0.01, 0.05) * b.height
    up = number(rng, -0.2, 0.5) * depth
    down = int(rng.integers(2, 6)) if rng.random() < 0.5 else None
    steps = []
    for k in range(TIMES):
        steps.append(pr.Step(f"press {k + 1}", move={"tool": pr.Motion(y=-depth)}, increments=down))
        height = up if k < TIMES - 1 else 0.5 * depth
        steps.append(pr.Step(f"lift {k + 1}", move={"tool": pr.Motion(y=height)}, increments=down))

    allowed = SAME_PLASTIC if b.metal.strength else SAME_ELASTIC if b.mu == 0 else np.inf

    def repeats(record: Record) -> str:
        """The second and all later peaks are alike: isotropic hardening has shaken down, an elastic body always has."""
        end = {name: k for k, name in enumerate(record.steps)}
        peaks = [record.history["tool.fy"][end[f"press {k + 1}"]] for k in range(TIMES)]
        off = max(abs(f / peaks[1] - 1) for f in peaks[1:])
        return (
            "" if off <= allowed else f"peaks of the cycles differ by {off:.2%}: {', '.join(f'{f:.5g}' for f in peaks)}"
        )

    back = () if b.metal.strength else (sprung_back,)
    kind = f"{b.shape}, mu {b.mu:.2g}, {b.metal.type}, {b.element}"
    return Drawn((b.problem("cycles", steps),), **b.facts, claims=(let_go, repeats, *back), limit=30.0, kind=kind)
