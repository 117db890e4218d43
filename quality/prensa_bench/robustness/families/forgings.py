"""Billets under punches and dies with fillets, so far that their meshes have to be made anew."""

from __future__ import annotations

import numpy as np

import prensa as pr
from prensa_bench.robustness.drawn import Drawn, Placed, chain, friction, metal, number, plane, stamp

FIRST_MESH = 7  # across the first mesh


def problem(rng: np.random.Generator) -> Drawn:
    """Upsetting, indentation, extrusion or heading; round or in plane strain, μ 0 to 0.3."""
    m = metal(rng, plastic=True)
    space = "axisymmetric" if rng.random() < 0.6 else "plane strain"
    R = number(rng, 5.0, 15.0)
    H = R * number(rng, 0.6, 1.6)
    name, tools, stroke = (_upset, _indented, _extruded, _headed)[rng.integers(4)](rng, R, H)
    mu = 0.0 if rng.random() < 0.2 else number(rng, 0.01, 0.3)
    billet = pr.Body(pr.Rectangle(size=(R, H), n=(FIRST_MESH, max(4, round(FIRST_MESH * H / R)))), m.material, "t6")
    contacts = tuple(pr.Contact(("billet",), tool) for tool in tools)
    p = pr.Problem(
        name, bodies={"billet": billet}, tools={k: v.tool for k, v in tools.items()}, contacts=contacts,
        friction=friction(mu), fixed={"billet.left": "x", **({} if "bottom" in tools else {"billet.bottom": "y"})}, space=space,
        remesh=pr.Remesh(size=pr.Sizes(far=np.sqrt(R * H) / 7, per_radius=4.0, least=np.sqrt(R * H) / 40)),
        steps=(pr.Step("press", move={"punch": pr.Motion(y=-stroke)}),),
    )  # fmt: skip
    kind = f"{name}, {space}, H/R {H / R:.2g}, stroke {stroke / H:.2g} H, mu {mu:.2g}, {m.material.flow.type}"
    return Drawn((p,), tools, {c.name: mu for c in contacts}, m.E, m.nu, m.strength, limit=90.0, kind=kind)


def _upset(rng: np.random.Generator, R: float, H: float) -> tuple[str, dict[str, Placed], float]:
    """Between flat dies, by 30 to 60 %; the upper one a plane."""
    return "upsetting", {"punch": plane((0.0, H), (0.0, -1.0))}, number(rng, 0.3, 0.6) * H


def _indented(rng: np.random.Generator, R: float, H: float) -> tuple[str, dict[str, Placed], float]:
    """By a punch of 25 to 60 % of the radius, into 20 to 50 % of the height."""
    half = number(rng, 0.25, 0.6) * R
    fillet = half * number(rng, 0.15, 0.4)
    tools = {"punch": stamp((0.0, H), 2 * half, fillet), "bottom": plane((0.0, 0.0), (0.0, 1.0))}
    return "indentation", tools, number(rng, 0.2, 0.5) * H


def _extruded(rng: np.random.Generator, R: float, H: float) -> tuple[str, dict[str, Placed], float]:
    """Backwards around a punch, in a container."""
    half = number(rng, 0.4, 0.65) * R
    fillet = half * number(rng, 0.15, 0.35)
    tools = {
        "punch": stamp((0.0, H), 2 * half, fillet), "wall": plane((R, 0.0), (-1.0, 0.0)), "bottom": plane((0.0, 0.0), (0.0, 1.0)),
    }  # fmt: skip
    return "extrusion", tools, number(rng, 0.2, 0.5) * H


def _headed(rng: np.random.Generator, R: float, H: float) -> tuple[str, dict[str, Placed], float]:
    """Upset by a plane while the lower part stays in a die with a rounded mouth."""
    seat, far = number(rng, 0.3, 0.5) * H, 20.0 * R
    fillet = number(rng, 0.1, 0.3) * min(R, seat)
    die = chain((0.0, 0.0), [(far, seat), (R, seat), (R, -far)], fillet)
    tools = {"punch": plane((0.0, H), (0.0, -1.0)), "die": die, "bottom": plane((0.0, 0.0), (0.0, 1.0))}
    return "heading", tools, number(rng, 0.3, 0.6) * (H - seat)
