"""Free bodies with unstructured meshes on a table, pushed by tools over an edge, beside a chamfer, above a hole."""

from __future__ import annotations

from typing import Any

import numpy as np

import prensa as pr
from prensa_bench.robustness.drawn import Claim, Drawn, Placed, chain, circle, logarithmic, metal, number, plane
from prensa_bench.robustness.files import Record

SAME_AGAIN = 1e-6  # allowed difference of where tools are under the same forces, of the size of the body


def problem(rng: np.random.Generator) -> Drawn:
    """Push down, push from the side, ease, push down again; elastic or plastic, μ 0 to 0.5, round or in plane strain."""
    plastic = rng.random() < 0.6
    m = metal(rng, plastic)
    round_ = rng.random() < 0.35
    W, H = number(rng, 8.0, 16.0), number(rng, 5.0, 10.0)
    outline, shape, top = _outline(rng, W, H, number(rng, 0.07, 0.12) * (W + H))
    tools = {"table": plane((0.0, 0.0), (0.0, 1.0)), "press": _press(rng, W, H, top, round_)}
    covered = _covered(tools["press"], top)
    area = np.pi * (covered[1] ** 2 - covered[0] ** 2) if round_ else covered[1] - covered[0]
    stress = number(rng, 0.2, 0.9) * m.strength / 4 if plastic else number(rng, 5e-4, 4e-3) * m.E
    beside: dict[str, pr.Push] = {}
    steps = [("press", {"press": pr.Push(y=-stress * area)})]
    if not round_ and rng.random() < 0.6:
        tools["side"] = circle((W + (R := number(rng, 0.5, 2.0) * H), 0.4 * H), R)
        beside = {"side": pr.Push(x=-number(rng, 0.05, 0.3) * stress * H)}
        steps.append(("side", {"press": pr.Push(y=-stress * area), **beside}))
    steps.append(("ease", {"press": pr.Push(y=-number(rng, 0.1, 0.5) * stress * area), **beside}))
    steps.append(("again", {"press": pr.Push(y=-stress * area), **beside}))
    mu = 0.0 if rng.random() < 0.35 else logarithmic(rng, 0.02, 0.5)
    enforcement: Any = [pr.Penalty(), pr.Penalty(), pr.Augmented(), pr.Exact()][rng.integers(4)]
    time_rule: Any = str(rng.choice(["auto", "backward_euler", "bdf2"])) if plastic else "auto"
    contacts = tuple(
        pr.Contact(("part",), tool, friction=pr.Coulomb(mu) if mu else None, enforcement=enforcement) for tool in tools
    )
    space: Any = "axisymmetric" if round_ else "plane strain"
    p = pr.Problem(
        "loaded", space=space, bodies={"part": pr.Body(outline, m.material, "t6")},
        tools={k: v.tool for k, v in tools.items()}, contacts=contacts, fixed={"part.left": "x"},
        steps=tuple(pr.Step(name, push=push) for name, push in steps),
    )  # fmt: skip
    same: tuple[Claim, ...] = () if plastic or mu else (_as_before(steps[-3][0]),)
    kind = f"{shape}, {space}, {m.type}, {len(tools)} tools, mu {mu:.2g}, {enforcement.type}, {time_rule}"
    return Drawn(
        (p,), tools, {c.name: mu for c in contacts}, m.E, m.nu, m.strength, same, limit=60.0, kind=kind,
        numerics=pr.Numerics(time_rule=time_rule),
    )  # fmt: skip


def _outline(rng: np.random.Generator, W: float, H: float, size: float) -> tuple[pr.Outline, str, float]:
    """A block from x = 0 with a chamfer, an inclined flank or a hole; what it is, and where its top ends."""
    shape, top = str(rng.choice(["block", "chamfer", "flank", "hole"])), W
    points: list[tuple[float, float]] = [(0.0, 0.0), (W, 0.0), (W, H), (0.0, H)]
    names = ["bottom", "right", "top", "left"]
    holes: tuple[Any, ...] = ()
    if shape == "chamfer":
        cut = number(rng, 0.15, 0.3) * H
        top = W - cut
        points[2:3], names[2:3] = [(W, H - cut), (top, H)], ["chamfer", "top"]
    elif shape == "flank":
        top = W * number(rng, 0.75, 0.95)
        points[2] = (top, H)
    elif shape == "hole":
        r, n = number(rng, 0.12, 0.2) * H, 12
        turn = -2 * np.pi * np.arange(n) / n
        around = np.stack([0.5 * W + r * np.cos(turn), 0.45 * H + r * np.sin(turn)], axis=1)
        holes = (tuple(map(tuple, around.tolist())),)
    return pr.Outline(points=tuple(points), size=size, sides=tuple(names), holes=holes), shape, top


def _press(rng: np.random.Generator, W: float, H: float, top: float, round_: bool) -> Placed:
    """A flat face from somewhere on the top, beyond its edge or not as far; its fillet is not on an axis of revolution."""
    start = number(rng, 0.2 if round_ else 0.0, 0.5) * W if rng.random() < 0.7 else -0.5 * W
    end = number(rng, 1.05, 1.3) * W if rng.random() < 0.5 else number(rng, 0.7, 0.95) * top
    fillet = min(number(rng, 0.05, 0.12) * W, 0.3 * (end - start))
    return chain((0.0, H), [(start, 3 * H), (start, 0.0), (end, 0.0), (end, 3 * H)], fillet)


def _covered(press: Placed, top: float) -> tuple[float, float]:
    """From where to where the press covers the top, its fillets left out."""
    (start, _), (end, _) = press.tool.points[1:3]
    return max(0.0, start + press.tool.fillet), min(top, end - press.tool.fillet)


def _as_before(step: str) -> Claim:
    """An elastic body without friction is under the same forces where it was at the end of a step."""

    def claim(record: Record) -> str:
        h = record.history
        first, size = max(k for k, name in enumerate(record.steps) if name == step), 0.0
        for shape in next(iter(record.bodies.values())).values():
            size = max(size, float(np.ptp(shape.X, axis=0).max()))
        for tool in record.problem.tools:
            for c in ("ux", "uy"):
                if abs(off := h[f"{tool}.{c}"][-1] - h[f"{tool}.{c}"][first]) > SAME_AGAIN * size:
                    return f"under the same forces as at the end of {step!r} {tool}.{c} is off by {off:.2e}"
        return ""

    return claim
