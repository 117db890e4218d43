"""Rolls: towed along a block and free to turn, turned and free to travel, and drawing a strip through."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import prensa as pr
from prensa.bench.robustness.drawn import Drawn, circle, friction, metal, number
from prensa.bench.robustness.families.under import LOCKING_FREE

if TYPE_CHECKING:
    from prensa.bench.robustness.files import Record

DRAG = 1e-3  # of what friction could bear, that a roll may feel in travelling freely on an elastic block,
HELD = 1e-6  # and that a load prescribed as zero may differ from it by,
FEW = 0.1  # share of the largest drag within a passage that few increments leave in its mean
OFF_CENTRE = 0.05  # and that of its load off its axis by so much of an element: nodes land and leave one by one


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
    if kind == "towed":
        steps.append(pr.Step("tow", move={"roll": pr.Motion(x=way)}, push={"roll": pr.Push(m=0.0)}))
    else:
        steps.append(pr.Step("turn", move={"roll": pr.Motion(rz=-way / R)}, push={"roll": pr.Push(x=0.0)}))
    steps.append(pr.Step("lift", move={"roll": pr.Motion(y=depth)}))
    p = pr.Problem(
        f"roll {kind}",
        bodies={"block": pr.Body(pr.Rectangle((width, height), (nx, ny), (-width / 2, 0.0)), m.material, element)},
        tools={"roll": roll.tool}, contacts=(pr.Contact(("block.top",), "roll"),), friction=friction(mu),
        fixed={"block.bottom": "xy"}, steps=tuple(steps),
    )  # fmt: skip

    def freely(record: Record) -> str:
        """On an elastic block a free roll feels no drag and no torque, and rolls: its turn is its way over its radius."""
        rows = [k for k, s in enumerate(record.steps) if s == steps[1].name]
        last = rows[-1]
        h = {k: float(v[last]) for k, v in record.history.items() if k.startswith("roll.")}
        bear = mu * h["roll.fy"]
        drag = max(abs(h["roll.fx"]), abs(h["roll.mz"]) / R)
        free = DRAG * bear + OFF_CENTRE * width / nx / R * h["roll.fy"]
        if way > width / nx:
            # nothing is dissipated, so over the passage of an element force and torque do no work; within one it has either sign
            x, fx, mz = (record.history[f"roll.{name}"][rows] for name in ("ux", "fx", "mz"))
            within = np.linspace(x[-1] - np.sign(x[-1] - x[0]) * width / nx, x[-1], 257)
            order = np.argsort(x)
            resisting = np.interp(within, x[order], (fx - mz / R)[order])
            drag, free = abs(float(resisting.mean())), DRAG * bear + FEW * float(np.abs(resisting).max())
        if m.strength == 0.0 and drag > free:
            return f"a free roll feels {h['roll.fx']:.3g} and {h['roll.mz'] / R:.3g} at its rim, friction could bear {bear:.3g}"
        let_go = abs(h["roll.mz"]) / R if kind == "towed" else abs(h["roll.fx"])
        if let_go > HELD * bear:
            return f"{let_go:.3g} is left of a load that was taken off, friction could bear {bear:.3g}"
        slip = abs(h["roll.ux"] + R * h["roll.rz"])
        return "" if slip <= 0.05 * way + 0.1 * depth else f"a free roll slips by {slip:.3g} on its way of {way:.3g}"

    text = f"{kind}, mu {mu:.2g}, {m.type}, {element}"
    facts = ({"roll": roll}, {"block.top-roll": mu}, m.E, m.nu, m.strength)
    return Drawn((p,), *facts, claims=(freely,), limit=40.0, kind=text)


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
