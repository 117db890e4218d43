"""Set-ups in space that a press has: two tools at once, tools on springs, loads, rubber, elements and enforcement asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import prensa as pr
from prensa_bench.robustness.bodies_in_space import Body, body_drawn
from prensa_bench.robustness.claims import released
from prensa_bench.robustness.drawn import (
    AT_UNIT_STRAIN,
    Claim,
    Drawn,
    Metal,
    Placed,
    friction,
    logarithmic,
    metal,
    number,
)
from prensa_bench.robustness.split_in_space import well_shaped
from prensa_bench.robustness.tools_in_space import ball, plate, roll
from prensa_bench.robustness.tools_over_bodies import hovering, over_nodes, plate_drawn, tool_drawn

SHARE_OF_TETRAHEDRA = 0.2  # of the bodies, the rest are of bricks
SIDEWAYS = 0.06  # of the half-width of a body, to which a tool is pressed in from the side at most
ASKED_FOR = (None, "h8_enhanced", "h8_bbar")
TURNED = 0.3  # rad, by which a tool turns about its axis at most


@dataclass(frozen=True)
class Beside:
    """A second tool: its name and contact, what it does in a step, and supports that it stands for."""

    name: str
    tool: Placed
    surface: tuple[str, ...]
    motion: Any = None
    instead: tuple[str, ...] = ()


def problem(rng: np.random.Generator) -> Drawn:
    """A body under a tool, with a second tool, springs, or a load, and its material, element and enforcement drawn."""
    m, material = _material(rng)
    shape, body = body_drawn(rng)
    if rng.random() < SHARE_OF_TETRAHEDRA:
        split = replace(body, tetrahedra=True)
        shape, body = (f"{shape} of tetrahedra", split) if well_shaped(split.filled) else (shape, body)
    element = None if body.tetrahedra else ASKED_FOR[rng.integers(len(ASKED_FOR))]
    act = _act(rng, body)
    name, tool, most, gap = plate_drawn(rng, body) if act == "anvil" else tool_drawn(rng, body)
    tool = over_nodes(body, tool)
    depth = gap + most * number(rng, 0.2, 0.8)
    depth += hovering(body, tool, depth)
    beside = _anvil(body, depth) if act == "anvil" else _side_tool(rng, body) if act == "side tool" else None
    if act == "springs":
        tool = replace(tool, tool=replace(tool.tool, spring=_springs(rng, m, body)))
    load = _load(rng, m, body) if act == "load" else {}
    steps = _steps(rng, act, depth, body, beside, load)
    tools = {"tool": tool} | ({beside.name: beside.tool} if beside else {})
    enforcement: Any = (pr.Penalty(), pr.Augmented(), pr.Exact())[rng.integers(3)]
    mus = {t: 0.0 if rng.random() < 0.2 else number(rng, 0.02, 0.5) for t in tools}
    surfaces = {"tool": ("body.top", *(body.sides if name.endswith("plate") else ()))}
    surfaces |= {beside.name: beside.surface} if beside else {}
    contacts = tuple(
        pr.Contact(surfaces[t], t, friction=friction(mus[t]), enforcement=enforcement) for t in tools
    )  # fmt: skip
    p = pr.Problem(
        "setups", space="solid", bodies={"body": pr.Body(body.filled, material, element)},
        tools={t: placed.tool for t, placed in tools.items()}, contacts=contacts,
        fixed={k: v for k, v in body.fixed.items() if beside is None or k not in beside.instead}, steps=steps,
    )  # fmt: skip
    words = f"{act} ({', '.join(surfaces[beside.name])})" if beside else f"{act} ({', '.join(load)})" if load else act
    kind = f"{shape}, {name}, {words}, {'+'.join(s.name for s in steps)}, depth {depth / body.high:.2g} of the height, "
    kind += f"mu {', '.join(f'{mu:.2g}' for mu in mus.values())}, {material.type}, {element}, {enforcement.type}"
    E = 0.0 if material.type == "neo_hooke" else m.E  # its bulk modulus is that of small strains alone
    claims: tuple[Claim, ...] = (released,) if steps[-1].remove_tools else ()
    return Drawn((p,), tools, {c.name: mus[c.against] for c in contacts}, E, m.nu, m.strength, claims, limit=60.0, kind=kind)


def _material(rng: np.random.Generator) -> tuple[Metal, Any]:
    """A metal, elastic or plastic, or rubber."""
    kind = rng.choice(["metal", "elastic", "rubber"], p=[0.5, 0.25, 0.25])
    if kind != "rubber":
        m = metal(rng, kind == "metal")
        return m, m.material
    E, nu = logarithmic(rng, 1.0, 10.0), number(rng, 0.45, 0.495)
    rubber = pr.NeoHooke(E, nu)
    return Metal(rubber, E, nu, 0.0), rubber


def _act(rng: np.random.Generator, body: Body) -> str:
    """What there is besides a tool that goes down; bodies that are clamped may be pressed from the side."""
    acts = ["springs", "load", "none"]
    acts += ["side tool"] * 2 if body.clamped and _right(body) else []
    acts += ["anvil"] * 2 if body.fixed["body.bottom"] == "y" else []
    return str(rng.choice(acts))


def _right(body: Body) -> str:
    """The side that a tool from the right meets first; '' where its place is not known."""
    if body.box:
        return "body.right"
    return "body.outer" if "body.outer" in body.sides and body.fixed["body.bottom"] == "xyz" and not body.bored else ""


def _side_tool(rng: np.random.Generator, body: Body) -> Beside:
    """A ball or a roll that comes from the right at half the height, and does not reach the clamped ground."""
    far = SIDEWAYS * number(rng, 0.3, 1.0) * min(body.wide, 0.5 * body.high)
    R = number(rng, 0.8, 2.0) * min(0.5 * body.high, body.deep)
    kind, at = str(rng.choice(["ball", "roll"])), (_edge(body) + R, 0.5 * body.high, 0.0)
    tool = ball(at, R) if kind == "ball" else roll(at, R, "z")
    return Beside(f"{kind}_beside", tool, (_right(body),), pr.Motion(x=-far))


def _edge(body: Body) -> float:
    """How far the free sides of a body reach to the right."""
    from prensa.mesh.generate import mesh_of

    return float(mesh_of(body.filled).points[:, 0].max())


def _anvil(body: Body, depth: float) -> Beside:
    """A plate instead of the smooth ground, that comes up as the tool goes down."""
    tool = plate((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    return Beside("anvil", tool, ("body.bottom", *body.sides), pr.Motion(y=0.3 * depth), ("body.bottom",))


def _springs(rng: np.random.Generator, m: Metal, body: Body) -> Any:
    """As stiff as the body, about, across and, where it is clamped, along; a tool over its middle may tilt too."""
    stiffness = m.E * body.area / body.high
    given = {"y": stiffness * logarithmic(rng, 0.1, 10.0)}
    if body.clamped:
        given |= {a: stiffness * logarithmic(rng, 0.1, 10.0) for a in "xz"}
        if rng.random() < 0.5:
            given |= {f"r{a}": stiffness * body.wide * body.deep * logarithmic(rng, 0.1, 10.0) for a in "xz"}
    return pr.Springs(**given)


def _load(rng: np.random.Generator, m: Metal, body: Body) -> dict[str, Any]:
    """A pressure on a free side, from outside or from within, or a traction on a flat one."""
    size = number(rng, 0.05, 0.4) * m.strength / AT_UNIT_STRAIN or number(rng, 2e-3, 2e-2) * m.E
    side = str(rng.choice(body.sides))
    if body.box and rng.random() < 0.5:
        way = rng.normal(size=3)
        return {side: pr.Load(traction=tuple((0.5 * size * way / np.linalg.norm(way)).tolist()))}
    return {side: pr.Load(pressure=size)}


def _steps(
    rng: np.random.Generator, act: str, depth: float, body: Body, beside: Beside | None, load: dict[str, Any]
) -> tuple[pr.Step, ...]:  # fmt: skip
    """Pressing, with what else acts before, meanwhile or after; then a lift, a release, or nothing."""
    down, both = pr.Motion(y=-depth), {beside.name: beside.motion} if beside else {}
    together = act == "anvil" or rng.random() < 0.4
    steps = []
    if load and not together:
        steps.append(pr.Step("load", loads=load))
    steps.append(pr.Step("press", move={"tool": down, **(both if together else {})}, loads=load if together else {}))
    if body.clamped:
        turn = pr.Motion(ry=number(rng, -TURNED, TURNED))
        far, angle = number(rng, 0.3, 1.0) * depth, number(rng, 0.0, 2.0 * np.pi)
        slide = pr.Motion(x=far * np.cos(angle), z=far * np.sin(angle))
        steps.append(pr.Step("on", move={"tool": turn if rng.random() < 0.5 else slide, **({} if together else both)}))
    end = rng.random()
    if end < 0.3 and act != "anvil":  # nothing else holds what lies on that
        steps.append(pr.Step("lift", move={"tool": pr.Motion(y=-0.8 * depth)}))
    elif end < 0.5 and not load and not (beside and beside.instead):
        steps.append(pr.Step("release", remove_tools=True))
    return tuple(steps)
