"""Rolls: towed along a block and free to turn, turned and free to travel, and drawing a strip through."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

import prensa as pr
from prensa.types import Array
from prensa_bench.robustness.drawn import Drawn, circle, friction, metal, number
from prensa_bench.robustness.families.under import LOCKING_FREE

if TYPE_CHECKING:
    from prensa_bench.robustness.files import Record


UNEXPLAINED = 1e-4  # of what friction could bear, that a roll may feel in travelling freely beyond what its energies say,
SLIPPING = 1e-3  # and that friction may take where points stick, and slip a little as they land and leave,
FEW = 0.1  # and of the largest drag within a passage: that goes with the ripple;
HELD = 1e-6  # that a load prescribed as zero may differ from it by
LOOKS = 16  # increments in which it passes the element over which that is averaged: forces ripple as nodes land and leave


def problem(rng: np.random.Generator) -> Drawn:
    """One of the three."""
    kind = str(rng.choice(["towed", "turned", "rolling"], p=[0.35, 0.35, 0.3]))
    return _rolling(rng) if kind == "rolling" else _on_block(rng, kind)


def _on_block(rng: np.random.Generator, kind: str) -> Drawn:
    m = metal(rng, plastic=rng.random() < 0.4, E=None if rng.random() < 0.5 else 1e4)
    width, height = number(rng, 16.0, 24.0), number(rng, 3.0, 6.0)
    element = str(rng.choice(LOCKING_FREE[:3]))
    nx, ny = int(rng.integers(36, 61)), int(rng.integers(4, 7))
    if element == "q8":
        nx, ny = nx // 2, ny // 2
    R = number(rng, 0.6, 2.0) * width
    start = -number(rng, 0.1, 0.2) * width
    roll = circle((start, height + R), R)
    mu = number(rng, 0.05, 0.6)
    depth = number(rng, 0.002, 0.02) * height
    way = number(rng, 0.1, 0.3) * width
    steps = [pr.Step("press", move={"roll": pr.Motion(y=-depth)})]
    # the last element is passed in increments that resolve the ripple: automatic ones may be as long as half an element
    towed = kind == "towed"
    for name, x, increments in (("tow" if towed else "turn", way, None), ("pass", way + width / nx, LOOKS)):
        motion, free = (pr.Motion(x=x), pr.Push(m=0.0)) if towed else (pr.Motion(rz=-x / R), pr.Push(x=0.0))
        steps.append(pr.Step(name, move={"roll": motion}, push={"roll": free}, increments=increments))
    steps.append(pr.Step("lift", move={"roll": pr.Motion(y=depth)}))
    p = pr.Problem(
        f"roll {kind}",
        bodies={"block": pr.Body(pr.Rectangle((width, height), (nx, ny), (-width / 2, 0.0)), m.material, element)},
        tools={"roll": roll.tool}, contacts=(pr.Contact(("block.top",), "roll"),), friction=friction(mu),
        fixed={"block.bottom": "xy"}, steps=tuple(steps),
    )  # fmt: skip

    def freely(record: Record) -> str:
        """On an elastic block a free roll feels no drag and no torque, and rolls: its turn is its way over its radius."""
        rows = [k for k, step in enumerate(record.steps) if step == "pass"]
        h = {k: v[[rows[0] - 1, *rows]] for k, v in record.history.items()}
        bear = mu * float(h["roll.fy"][-1])
        if m.strength == 0.0 and (wrong := dragged(h, R, bear)):
            return wrong
        h = {k: v[-1] for k, v in h.items()}
        let_go = abs(h["roll.mz"]) / R if towed else abs(h["roll.fx"])
        if let_go > HELD * bear:
            return f"{let_go:.3g} is left of a load that was taken off, friction could bear {bear:.3g}"
        slip = abs(h["roll.ux"] + R * h["roll.rz"])
        return "" if slip <= 0.05 * way + 0.1 * depth else f"a free roll slips by {slip:.3g} on its way of {way:.3g}"

    text = f"{kind}, mu {mu:.2g}, {m.type}, {element}"
    facts = ({"roll": roll}, {"block.top-roll": mu}, m.E, m.nu, m.strength)
    return Drawn((p,), *facts, claims=(freely,), limit=40.0, kind=text)


def dragged(h: Mapping[str, Array], R: float, bear: float) -> str:
    """What drags at a free roll of radius R over a passage, of which ``h`` are rows, in words; friction could bear ``bear``.

    Force and torque have either sign within the passage, in which nodes land and leave one by one. Over all of it they do no work
    but what friction takes and springs store. How far the mean may be off is known by that of every other increment.
    """
    x, resisting = h["roll.ux"], h["roll.fx"] - h["roll.mz"] / R
    drag, doubt = mean_of(x, resisting)
    taken = {e: float((v[-1] - v[0]) / (x[-1] - x[0])) for e, v in h.items() if e.startswith("energy.")}
    friction = taken["energy.friction"]
    if (off := abs(drag + friction + taken["energy.elastic"] + taken["energy.contact"])) > UNEXPLAINED * bear + doubt:
        return f"a free roll feels {off:.3g} (±{doubt:.1g}) that no energy accounts for, friction could bear {bear:.3g}"
    if abs(friction) > SLIPPING * bear + FEW * float(np.abs(resisting).max()):
        return f"friction takes {abs(friction):.3g} from a free roll, it could bear {bear:.3g}"
    return ""


def mean_of(x: Array, y: Array) -> tuple[float, float]:
    """Mean of y (n,) over x (n,), straight between values, and its doubt: what leaving out every other value changes."""
    some = np.unique(np.append(np.arange(0, len(x), 2), len(x) - 1))
    fine, coarse = (float(0.5 * (y[k][1:] + y[k][:-1]) @ np.diff(x[k]) / (x[-1] - x[0])) for k in (np.arange(len(x)), some))
    return fine, abs(fine - coarse)


def _rolling(rng: np.random.Generator) -> Drawn:
    """Upper half of a strip pushed into the gap, then drawn through by friction."""
    m = metal(rng, plastic=True)
    half, R = 1.0, number(rng, 20.0, 60.0)
    reduction = number(rng, 0.05, 0.25)
    arc = float(np.sqrt(R * 2 * half * reduction))
    mu = number(rng, 0.8, 1.6) * arc / R
    h = number(rng, 0.12, 0.25)
    length = arc * number(rng, 2.5, 3.5) + 8 * h
    nx, ny = round(length / h), int(rng.integers(2, 5))
    # its front end just before the roll's surface, which has height 1 there
    front = -arc - number(rng, 0.01, 0.1) * h
    roll = circle((0.0, half * (1 - reduction) + R), R)
    enter = arc * number(rng, 0.8, 1.1)
    turn = enter / R
    p = pr.Problem(
        "rolling", bodies={"strip": pr.Body(
            pr.Rectangle((length, half), (nx, ny), (front - length, 0.0)), m.material, "q4_fbar")},
        tools={"roll": roll.tool}, contacts=(pr.Contact(("strip.right", "strip.top"), "roll"),), friction=friction(mu),
        fixed={"strip.bottom": "y"},
        steps=(
            pr.Step("bite", fixed={"strip.left": {"x": enter}}, move={"roll": pr.Motion(rz=turn)}),
            pr.Step("roll", fixed={"strip.left": "free"}, move={"roll": pr.Motion(rz=turn + arc / R)}),
        ),
    )  # fmt: skip
    kind = f"rolling by {reduction:.0%}, arc/R {arc / R:.2g}, mu {mu:.2g}, {nx} x {ny}"
    return Drawn((p,), {"roll": roll}, {"strip.right+strip.top-roll": mu}, m.E, m.nu, m.strength, limit=60.0, kind=kind)
