"""A thin sheet squeezed between two flat tools and released: friction hills."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import prensa as pr
from prensa_bench.robustness.claims import let_go, sprung_back
from prensa_bench.robustness.drawn import AT_UNIT_STRAIN, Drawn, friction, logarithmic, metal, number, plane
from prensa_bench.robustness.families.under import LOCKING_FREE

if TYPE_CHECKING:
    from prensa_bench.robustness.files import Record


def problem(rng: np.random.Generator) -> Drawn:
    """Thickness 2 to 10 % of the width; half of it to the right of a plane of symmetry, both faces on tools."""
    m = metal(rng, plastic=rng.random() < 0.7)
    half = number(rng, 5.0, 15.0)
    t = 2 * half * number(rng, 0.02, 0.1)
    element = str(rng.choice(LOCKING_FREE[:3]))
    nx, ny = int(rng.integers(20, 41)), 2 * int(rng.integers(1, 3))
    if element == "q8":
        nx, ny = nx // 2, ny // 2
    tools = {"upper": plane((0.0, t), (0.0, -1.0)), "lower": plane((0.0, 0.0), (0.0, 1.0))}
    mu = 0.0 if rng.random() < 0.2 else number(rng, 0.01, 0.3)
    # the hill's exponent 2μL/h stays below 4, beyond which pressures are no longer those of metals
    most = min(max(1.0 - np.sqrt(mu * half / t / 2.0), 0.03), 0.45)
    reduction = logarithmic(rng, 0.01, most) if m.strength else number(rng, 0.001, 0.01)
    apart = {"upper": pr.Motion(y=0.2 * t), "lower": pr.Motion(y=-0.2 * t)}
    contacts = (
        pr.Contact(("sheet.right", "sheet.top"), "upper"), pr.Contact(("sheet.bottom", "sheet.right"), "lower"),
    )  # fmt: skip
    p = pr.Problem(
        "thin sheet", bodies={"sheet": pr.Body(pr.Rectangle((half, t), (nx, ny)), m.material, element)},
        tools={k: v.tool for k, v in tools.items()}, contacts=contacts, friction=friction(mu), fixed={"sheet.left": "x"},
        steps=(
            pr.Step("squeeze", move={"upper": pr.Motion(y=-reduction * t)}),
            pr.Step("open", move=apart, fixed={"sheet.bottom-left": "y"}),
        ),
    )  # fmt: skip

    def hill(record: Record) -> str:
        """Mean pressure at the end of squeezing: no less than in uniform compression, no more than under a friction hill."""
        last = max(k for k, s in enumerate(record.steps) if s == "squeeze")
        now, long = (1 - reduction) * t, half / (1 - reduction)
        mean = record.history["upper.fy"][last] / half
        if m.strength:
            low, high = 2 / np.sqrt(3) * m.strength / AT_UNIT_STRAIN, 2 / np.sqrt(3) * m.strength
            strain = 2 / np.sqrt(3) * -np.log(1 - reduction)
            low = 0.9 * min(low, m.E * strain)
        else:
            low = 0.95 * m.E / (1 - m.nu**2) * reduction
            # neither the hill nor full constraint (the sheet sticks) is exceeded
            high = 1.1 * m.E * (1 - m.nu) / ((1 + m.nu) * (1 - 2 * m.nu)) * reduction
        a = 2 * mu * long / now
        high = high * (np.expm1(a) / a if m.strength and a > 0 else 1.0) * 1.1 * (long / half if m.strength else 1.0)
        return "" if low <= mean <= high else f"mean pressure {mean:.4g} is outside of {low:.4g} … {high:.4g}"

    kind = f"t/w {t / (2 * half):.1%}, by {reduction:.1%}, mu {mu:.2g}, {m.type}, {element}"
    back = () if m.strength else (sprung_back,)
    mus = {c.name: mu for c in contacts}
    return Drawn((p,), tools, mus, m.E, m.nu, m.strength, claims=(hill, let_go, *back), limit=30.0, kind=kind)
