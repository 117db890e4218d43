"""Ironing: a die is pressed into a block and slides along it, so far that metal or rubber piles up before it."""

from __future__ import annotations

import numpy as np

import prensa as pr
from prensa_bench.robustness.drawn import Drawn, Metal, Placed, chain, friction, metal, number

NOSES = ("round", "flat", "sharp")
IRONED_MESHES = ((24, 6), (40, 10), (60, 16))  # elements along and across the block
SHARP_CORNER = 0.2  # radius of a corner over the length of an element, which the formulas of the checks still know


def problem(rng: np.random.Generator) -> Drawn:
    """Nose round, flat or sharp, flanks upright; rubber or metal, μ 0 to 0.5, three meshes."""
    width, height = 12.0, number(rng, 3.0, 5.0)
    plastic = rng.random() < 0.5
    m = metal(rng, plastic=True) if plastic else _rubber(rng)
    n = IRONED_MESHES[rng.integers(len(IRONED_MESHES))]
    nose = NOSES[rng.integers(len(NOSES))]
    half = number(rng, 2.2, 4.0) * width / n[0]  # a nose narrower than a few elements is remarked upon
    at = (-0.5 * width + number(rng, 1.3, 1.8) * half, height)
    die = _die(
        nose,
        half,
        at,
        number(rng, 0.1, 0.6) if nose != "sharp" else SHARP_CORNER * width / n[0] / half,
        number(rng, 0.2, 0.5),
    )
    mu = 0.0 if rng.random() < 0.15 else number(rng, 0.02, 0.5)
    depth = number(rng, 0.03, 0.2 if plastic else 0.3) * height
    way = number(rng, 0.3, 0.9) * (width - 3.6 * half)
    grade = pr.Grade(y=(height,), ratio=4.0)
    p = pr.Problem(
        "ironing",
        bodies={"block": pr.Body(pr.Rectangle((width, height), n, (-0.5 * width, 0.0), grade=grade), m.material, "q4_fbar")},
        tools={"die": die.tool}, contacts=(pr.Contact(("block.top",), "die"),), friction=friction(mu),
        fixed={"block.bottom": "xy"},
        steps=(
            pr.Step("press", move={"die": pr.Motion(y=-depth)}),
            pr.Step("slide", move={"die": pr.Motion(x=way, y=-depth)}),
        ),
    )  # fmt: skip
    kind = f"{nose}, {m.type}, mu {mu:.2g}, {n[0]} x {n[1]}, depth {depth / height:.0%}"
    return Drawn((p,), {"die": die}, {"block.top-die": mu}, m.E, m.nu, m.strength, limit=90.0, kind=kind)


def _rubber(rng: np.random.Generator) -> Metal:
    E, nu = number(rng, 1.0, 1000.0), number(rng, 0.3, 0.45)
    return Metal(pr.NeoHooke(E, nu), 0.0, nu, 0.0)


def _die(nose: str, half: float, at: tuple[float, float], fillet: float, rise: float) -> Placed:
    """A die of half a width with upright flanks; its nose is half a circle, flat with fillets, or a blunt wedge with corners."""
    far = 20.0 * half
    if nose == "sharp":
        points = [
            (-half, far),
            (-half, rise * half),
            (-0.3 * half, 0.0),
            (0.3 * half, 0.0),
            (half, rise * half),
            (half, far),
        ]
        return chain(at, points, fillet * half)
    flat = [(-half, far), (-half, 0.0), (half, 0.0), (half, far)]
    return chain(at, flat, 0.98 * half if nose == "round" else fillet * half)
