"""Ten times pressed and unloaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import prensa as pr
from prensa_bench.robustness.claims import let_go, sprung_back
from prensa_bench.robustness.drawn import Drawn, number
from prensa_bench.robustness.families.under import block

if TYPE_CHECKING:
    from prensa_bench.robustness.files import Record

TIMES = 10
SAME_ELASTIC, SAME_PLASTIC = 1e-4, 0.05  # allowed change of the peak from the second cycle on, without friction
SETTLED = 5e-3  # allowed change of the peak in the last cycle, whatever the friction
SETTLING = 0.25  # and its share of the largest change, where it has not fallen faster than a sum without end would


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

    allowed = SAME_PLASTIC if b.metal.strength else SAME_ELASTIC

    def repeats(record: Record) -> str:
        """Without friction the second and all later peaks are alike: the body has shaken down. With friction they settle.

        Friction lets the surface creep outwards from cycle to cycle: it keeps what it gives at every press. Melan's theorem
        does not exclude it, since normal and tangential forces are coupled (Klarbring, Ciavarella and Barber 2007).
        """
        end = {name: k for k, name in enumerate(record.steps)}
        peaks = np.array([record.history["tool.fy"][end[f"press {k + 1}"]] for k in range(TIMES)])
        off = float(np.abs(peaks[1:] / peaks[1] - 1).max())
        if b.mu == 0 and off > allowed:
            return f"peaks of the cycles differ by {off:.2%}: {', '.join(f'{f:.5g}' for f in peaks)}"
        return unsettled(peaks)

    back = () if b.metal.strength else (sprung_back,)
    kind = f"{b.shape}, mu {b.mu:.2g}, {b.metal.type}, {b.element}"
    return Drawn((b.problem("cycles", steps),), **b.facts, claims=(let_go, repeats, *back), limit=30.0, kind=kind)


def unsettled(peaks: np.ndarray) -> str:
    """Why the peaks (n,) of equal cycles do not settle; '' if they do.

    Peaks that settle have changes with a finite sum. Those of 1/k have none, so that from the middle on changes have to fall
    faster than these, unless the last is a small part of the largest; and it is small in any case.
    """
    changes = np.abs(np.diff(peaks) / peaks[-1])
    last, middle = len(changes), (len(changes) + 1) // 2
    falls = changes[-1] * last < changes[middle - 1] * middle
    if changes[-1] <= SETTLED and (falls or changes[-1] <= max(SETTLING * changes.max(), 1e-6)):
        return ""
    listed = ", ".join(f"{f:.5g}" for f in peaks)
    return f"peaks of the cycles do not settle, the last changed by {changes[-1]:.2%}: {listed}"
