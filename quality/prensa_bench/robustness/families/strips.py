"""Half of a thin strip under a force-driven binder, a punch and a die: held, drawn, released."""

from __future__ import annotations

from typing import Any

import numpy as np

import prensa as pr
from prensa_bench.robustness.claims import let_go, sprung_back
from prensa_bench.robustness.drawn import Drawn, Metal, chain, friction, metal, number


def problem(rng: np.random.Generator) -> Drawn:
    """Thickness 0.5 to 5 % of the width, both sides in contact, μ 0 to 0.3, elastic or elastic-plastic."""
    m = metal(rng, plastic=rng.random() < 0.7)
    half = number(rng, 20.0, 50.0)
    t = 2 * half * number(rng, 0.005, 0.05)
    element: Any = str(rng.choice(["q4", "q4_enhanced", "q4_enhanced", "q8", "q8"]))
    nx, ny = int(rng.integers(36, 61)), int(rng.integers(2, 4))
    if element == "q8":
        nx, ny = nx // 2, ny - 1
    # corners' fillets of at least a few elements and thicknesses, and a wall between punch and die
    h = half / nx
    radius = number(rng, 2.0, 5.0) * max(t, h)
    clearance = min(number(rng, 1.2, 3.0) * t, 0.2 * half)
    flat = number(rng, 0.25, 0.4) * half
    # binder and die hold the strip on a flat of their own: where their fillets reach its end, nothing carries the binder
    radius = min(radius, 0.45 * (0.9 * half - flat - clearance))
    punch = flat + radius
    edge = punch + clearance
    depth = number(rng, 0.3, 2.5) * radius if m.strength else number(rng, 0.05, 0.3) * radius
    depth = min(depth, 0.4 * (half - edge))
    far = 4 * half
    tools = {
        "punch": chain((0.0, t), [(-punch, far), (-punch, 0.0), (punch, 0.0), (punch, far)], radius),
        "die": chain((0.0, 0.0), [(far, 0.0), (edge, 0.0), (edge, -far)], radius),
        "binder": chain((0.0, t), [(edge, far), (edge, 0.0), (far, 0.0)], radius),
    }
    mu = 0.0 if rng.random() < 0.2 else number(rng, 0.01, 0.3)
    force = number(rng, 1e-5, 3e-4) * m.E * 0.3 * (half - edge)
    push = {"binder": pr.Push(y=-force)}
    away = {"punch": pr.Motion(y=2 * t), "die": pr.Motion(y=-depth - 4 * t - sprung(m, half, t))}
    contacts = (
        pr.Contact(("strip.top",), "punch"), pr.Contact(("strip.top",), "binder"), pr.Contact(("strip.bottom",), "die"),
    )  # fmt: skip
    p = pr.Problem(
        "strip", bodies={"strip": pr.Body(pr.Rectangle(size=(half, t), n=(nx, ny)), m.material, element)},
        tools={k: v.tool for k, v in tools.items()}, contacts=contacts, friction=friction(mu),
        fixed={"strip.left": "x"},
        steps=(
            pr.Step("hold", push=push),
            pr.Step("draw", push=push, move={"punch": pr.Motion(y=-depth)}),
            # the binder goes up from where the end of the strip may have lifted it to
            pr.Step("release", move=away, by={"binder": pr.Motion(y=4 * t)}, fixed={"strip.bottom-left": "y"}),
        ),
    )  # fmt: skip
    kind = f"t/w {t / (2 * half):.2%}, mu {mu:.2g}, {m.type}, {element}"
    claims = (let_go,) if m.strength else (let_go, sprung_back)
    mus = {c.name: mu for c in contacts}
    return Drawn((p,), tools, mus, m.E, m.nu, m.strength, claims=claims, limit=40.0, kind=kind)


def sprung(m: Metal, length: float, t: float) -> float:
    """How far the end of a strip may spring at most: by the elastic curvature of its plastic moment over all its length.

    That is 3σ/(E t), and σ half of what the metal bears at a strain of 1: bent about twice its thickness it has a quarter.
    """
    return 0.5 * 3.0 * (0.5 * m.strength) / (m.E * t) * length**2
