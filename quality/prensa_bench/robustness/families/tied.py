"""Two bodies tied along a side, matching or not, under a tool; matching ones of one material beside the whole body."""

from __future__ import annotations

import numpy as np

import prensa as pr
from prensa_bench.robustness.drawn import Drawn, Twin, circle, friction, metal, number, stamp
from prensa_bench.robustness.families.under import LOCKING_FREE

SAME_TIED = 1e-3  # allowed difference of the last forces to the body in one piece, of the largest


def problem(rng: np.random.Generator) -> Drawn:
    """A soft or hard layer, or the same material, on a block: press, slide, lift."""
    plastic = rng.random() < 0.5
    core = metal(rng, plastic)
    matching, same = rng.random() < 0.5, rng.random() < 0.5
    skin = core if same else metal(rng, rng.random() < 0.5)
    width, rows = number(rng, 10.0, 20.0), int(rng.integers(2, 5))
    nx, layers = int(rng.integers(10, 17)), int(rng.integers(1, 4))
    size = number(rng, 0.6, 1.2)
    low, high = rows * size, layers * size
    element = str(rng.choice(LOCKING_FREE[:3]))
    finer = 1 if matching else float(rng.uniform(1.2, 2.2))
    bodies = {
        "core": pr.Body(pr.Rectangle((width, low), (nx, rows), (-width / 2, 0.0)), core.material, element),
        "skin": pr.Body(
            pr.Rectangle((width, high), (round(finer * nx), layers), (-width / 2, low)), skin.material, element
        ),
    }
    top = low + high
    if rng.random() < 0.5:
        shape, tool = "stamp", stamp((0.0, top), 0.4 * width, 1.5 * width / nx)
    else:
        R = number(rng, 0.5, 2.0) * width
        shape, tool = "circle", circle((0.0, top + R), R)
    mu = 0.0 if rng.random() < 0.2 else number(rng, 0.02, 0.4)
    depth = number(rng, 0.005, 0.05) * top
    steps = (
        pr.Step("press", move={"tool": pr.Motion(y=-depth)}),
        pr.Step("slide", move={"tool": pr.Motion(x=number(rng, -3.0, 3.0) * depth)}),
        pr.Step("lift", move={"tool": pr.Motion(y=-0.98 * depth)}),
    )
    contact = pr.Contact(("skin.top",), "tool")
    p = pr.Problem(
        "tied", bodies=bodies, ties=(pr.Tie("skin.bottom", "core.top"),), tools={"tool": tool.tool}, contacts=(contact,),
        friction=friction(mu), fixed={"core.bottom": "xy"}, steps=steps,
    )  # fmt: skip
    twins = []
    if matching and same:
        whole = pr.Body(pr.Rectangle((width, top), (nx, rows + layers), (-width / 2, 0.0)), core.material, element)
        twins.append(Twin(pr.Problem(
            "the body in one piece", bodies={"skin": whole}, tools={"tool": tool.tool}, contacts=(contact,),
            friction=friction(mu), fixed={"skin.bottom": "xy"}, steps=steps,
        ), tolerance=SAME_TIED))  # fmt: skip
    kind = f"{'matching' if matching else 'mortar'}, {shape}, mu {mu:.2g}, {core.type} under {skin.type}, {element}"
    return Drawn((p,), {"tool": tool}, {contact.name: mu}, twins=tuple(twins), limit=30.0, kind=kind)
