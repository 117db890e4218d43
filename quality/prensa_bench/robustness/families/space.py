"""Bodies in space under tools in space: pressed, slid over, rolled, turned, pushed, tilted by them, and released at the end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa_bench.robustness.bodies_in_space import Body, body_drawn, box
from prensa_bench.robustness.claims import released, sprung_back
from prensa_bench.robustness.drawn import AT_UNIT_STRAIN, Claim, Drawn, Metal, Placed, Twin, friction, metal, number
from prensa_bench.robustness.split_in_space import contact_nodes, well_shaped
from prensa_bench.robustness.stops import within
from prensa_bench.robustness.tools_in_space import Place
from prensa_bench.robustness.tools_over_bodies import BROUGHT_TOGETHER, hovering, over_nodes, plate_drawn, tool_drawn

FINER_BY = 1.5  # bricks of the second mesh for each of the first along an axis
SAME_ON_FINER = 0.06  # of the two, under a plate
SAME_TURNED = 1e-5  # of a problem that is turned about the upright axis
OF_TETRAHEDRA = 0.25  # of the bodies, the rest are of bricks
FROM_EDGE = 0.1  # of the width of what a tool rests on: how far from its edge the tool is pushed at least
FORCES_XYZ = ("fx", "fy", "fz")


@dataclass(frozen=True)
class QuarterTurn(Twin):
    """The same problem turned by 90° about y: what lay along x lies along −z, and what lay along z along x."""

    axes: tuple[str, ...] = FORCES_XYZ

    def forces(self, history: Mapping[str, Any], tool: str) -> dict[str, Any]:
        """Forces of a tool by axis, turned back."""
        fx, fy, fz = (np.asarray(history[f"{tool}.{a}"]) for a in FORCES_XYZ)
        return {"fx": -fz, "fy": fy, "fz": fx}


@dataclass(frozen=True)
class Finer(Twin):
    """The same problem on a finer mesh."""

    axes: tuple[str, ...] = ("fy",)
    each_step: bool = True
    same_tools: bool = True

    def forces(self, history: Mapping[str, Any], tool: str) -> dict[str, Any]:
        """Forces of a tool by axis."""
        return {a: np.asarray(history[f"{tool}.{a}"]) for a in FORCES_XYZ}


def problem(rng: np.random.Generator) -> Drawn:
    """A body on its bottom, on planes of symmetry or clamped, and a tool above it."""
    return _problem(rng, second=False)


def on_two_meshes(rng: np.random.Generator) -> Drawn:
    """A box under a plate, solved on a finer mesh too."""
    return _problem(rng, second=True)


def _problem(rng: np.random.Generator, second: bool) -> Drawn:
    rng.random()  # what chose the second mesh before the seed did: the other numbers are what they were
    plastic = rng.random() < 0.6
    m = metal(rng, plastic)
    material = m.material
    if not plastic and rng.random() < 0.4:
        material = pr.NeoHooke(m.E, m.nu)
    shape, body = box(rng) if second else body_drawn(rng)
    if rng.spawn(1)[0].random() < OF_TETRAHEDRA:  # of numbers of its own: the others are what they would be without
        split = replace(body, tetrahedra=True)
        shape, body = (f"{shape} of tetrahedra", split) if well_shaped(split.filled) else (shape, body)
    name, tool, most, gap = plate_drawn(rng, body) if second else tool_drawn(rng, body)
    tool = over_nodes(body, tool)
    depth = gap + most * number(rng, 0.2, 1.0)
    depth += hovering(body, tool, depth)
    mu = 0.0 if rng.random() < 0.2 else number(rng, 0.02, 0.5)
    motion = _motion_drawn(rng, name, tool, body, mu, gap, second)
    steps = _steps(rng, motion, depth, _force(rng, m, body, name), body, tool)
    gone = motion != "lift" and rng.random() < 0.3
    if gone:
        steps = (*steps, _release(rng, body))
    contact = pr.Contact(("body.top", *(body.sides if name.endswith("plate") else ())), "tool")
    p = pr.Problem(
        "space", space="solid", bodies={"body": pr.Body(body.filled, material)}, tools={"tool": tool.tool}, contacts=(contact,),
        friction=friction(mu), fixed=body.fixed, steps=steps,
    )  # fmt: skip
    away = ", released" if gone else ""
    kind = f"{shape}, {name}, {motion}{away}, depth {depth / body.high:.2g} of the height, mu {mu:.2g}, {material.type}"
    E = 0.0 if material.type == "neo_hooke" else m.E  # its bulk modulus is that of small strains alone
    claims: tuple[Claim, ...] = (released,) if gone else ()
    claims += (sprung_back,) if (gone or motion == "lift") and not plastic and mu == 0.0 else ()
    twins = _twins(rng, p, body, second)
    return Drawn((p,), {"tool": tool}, {contact.name: mu}, E, m.nu, m.strength, claims, twins, limit=60.0, kind=kind)


# -------------------------------------------------------------------------------------------------------------------- twins


def _twins(rng: np.random.Generator, p: pr.Problem, body: Body, second: bool) -> tuple[Twin, ...]:
    """The finer one, of bricks, of those that are solved on a second mesh; of every third other box the one that is turned."""
    if second:
        n = tuple(round(FINER_BY * k) for k in body.mesh.n)
        finer = replace(p, name="on a finer mesh", bodies={"body": replace(p.bodies["body"], mesh=replace(body.mesh, n=n))})
        return (Finer(finer, tolerance=SAME_ON_FINER),)
    turned = _turned(p, body) if body.box and rng.random() < 0.3 else None
    return (QuarterTurn(turned, tolerance=SAME_TURNED),) if turned is not None else ()


def _turned(p: pr.Problem, body: Body) -> pr.Problem | None:
    """The problem turned by 90° about y; None where a tool is no ball, plate or roll, or a step does more than move it."""
    tool = p.tools["tool"]
    if any(s.push or s.fixed or s.remove_tools for s in p.steps):
        return None
    given: dict[str, Any] = {"at": _quarter(tool.at)}
    if tool.type == "plane":
        given["normal"] = _quarter(tool.normal)
    elif tool.type == "extruded":
        given["axis"] = _quarter(tool.axis)
    elif tool.type not in ("sphere", "revolved"):
        return None
    mesh, sides = _quarter_turned(body)
    ways = {"x": "z", "y": "y", "z": "x", "xyz": "xyz"}
    return replace(
        p, name="turned by 90°", bodies={"body": replace(p.bodies["body"], mesh=mesh)}, tools={"tool": replace(tool, **given)},
        fixed={sides.get(name, name): ways[way] for name, way in body.fixed.items()},
        steps=tuple(replace(s, move={"tool": _motion(s.move["tool"])}) for s in p.steps),
    )  # fmt: skip


def _quarter_turned(body: Body) -> tuple[Any, dict[str, str]]:
    """The mesh of a box turned by 90° about y, and the names that its sides have then, where they are others."""
    if body.tetrahedra:
        return replace(body.filled, points=tuple(map(_quarter, body.filled.points))), {}
    (sx, sy, sz), (ox, oy, oz) = body.mesh.size, body.mesh.origin
    nx, ny, nz = body.mesh.n
    mesh = replace(body.mesh, size=(sz, sy, sx), n=(nz, ny, nx), origin=(oz, oy, -(ox + sx)))
    return mesh, {"body.left": "body.front", "body.back": "body.left"}


def _quarter(v: Any) -> Place:
    x, y, z = map(float, v)
    return z, y, -x


def _motion(m: Any) -> Any:
    turned = {"x": m.z, "y": m.y, "z": None if m.x is None else -m.x}
    turned |= {"rx": m.rz, "ry": m.ry, "rz": None if m.rx is None else -m.rx}
    return pr.Motion(**{axis: way for axis, way in turned.items() if way is not None})


# ------------------------------------------------------------------------------------------------------------------ motions

_ROUND = ("roll", "ball", "ball of triangles")


def _motion_drawn(
    rng: np.random.Generator, name: str, tool: Placed, body: Body, mu: float, gap: float, second: bool
) -> str:  # fmt: skip
    """What the tool does: narrow and round ones do more than the others, and so do those over bodies that are clamped."""
    motions = ["press", "slide", "lift", "again", *([] if second else ["push", "push and slide"])]
    if body.clamped and not second:
        motions += ["roll"] * (name in _ROUND) + ["twist"] * (name != "roll")
        motions += ["tilt"] * 5 * (not gap and _stands(body, tool))
        motions += ["rolling"] * 3 * (name in _ROUND and mu > 0.05)
    return str(rng.choice(motions))


def _stands(body: Body, tool: Placed) -> bool:
    """Whether a tool stands on nodes on all sides of its reference point, so that it may be left to tilt."""
    top = mesh_of(body.filled).points[contact_nodes(body.filled, "top")]
    rest = top[np.abs(tool.outline(top - np.asarray(tool.at))[0]) < 1e-9 * body.high][:, [0, 2]]
    if len(rest) < 3 or (narrow := float(np.ptp(rest, axis=0).min())) < BROUGHT_TOGETHER * body.high:
        return False  # on a line, but for round-off: there it may turn
    return within(rest, np.zeros(2)) > FROM_EDGE * narrow


def _force(rng: np.random.Generator, m: Metal, body: Body, name: str) -> float:
    """What a tool is pushed with: some of what the metal under it bears, or a small strain of an elastic one."""
    stress = number(rng, 0.2, 1.2) * m.strength / AT_UNIT_STRAIN or number(rng, 5e-4, 4e-3) * m.E
    return stress * body.area * (1.0 if "plate" in name else 0.15)


def _steps(
    rng: np.random.Generator, motion: str, depth: float, force: float, body: Body, tool: Placed
) -> tuple[pr.Step, ...]:  # fmt: skip
    """Pressing, by a way or by a force, and what follows; ways along x and z where the body is clamped."""
    down = {"tool": pr.Push(y=-force)}
    if motion in ("push", "push and slide"):
        slide = pr.Step("slide", push=down, move={"tool": _sideways(rng, depth)})
        return (pr.Step("push", push=down), *([slide] if body.clamped and motion != "push" else []))
    if motion == "tilt":
        tilting = {"tool": pr.Push(y=-force, mx=0.0, mz=0.0)}
        return pr.Step("push", push=tilting), pr.Step("less", push={"tool": pr.Push(y=-0.5 * force, mx=0.0, mz=0.0)})
    if motion == "rolling":
        along, R = _rolls(rng, tool)
        spin = "mz" if along == "x" else "mx"
        way = pr.Motion(**{along: number(rng, 0.5, 3.0) * depth})
        return pr.Step("push", push=down), pr.Step("roll", push={"tool": pr.Push(y=-force, **{spin: 0.0})}, move={"tool": way})
    steps = [pr.Step("press", move={"tool": pr.Motion(y=-depth)})]
    if motion == "twist":
        steps.append(pr.Step("twist", move={"tool": pr.Motion(ry=number(rng, -0.3, 0.3))}))
    if motion == "roll":
        along, R = _rolls(rng, tool)
        far = number(rng, 0.5, 3.0) * depth
        way = {"x": far, "rz": -far / R} if along == "x" else {"z": far, "rx": far / R}
        steps.append(pr.Step("roll", move={"tool": pr.Motion(**way)}))
    if motion in ("slide", "again") and body.clamped:
        steps.append(pr.Step("slide", move={"tool": _sideways(rng, depth)}))
    if motion in ("lift", "again"):
        steps.append(pr.Step("lift", move={"tool": pr.Motion(y=0.2 * depth)}))
    if motion == "again":
        steps.append(pr.Step("again", move={"tool": pr.Motion(y=-number(rng, 0.8, 1.1) * depth)}))
    return tuple(steps)


def _sideways(rng: np.random.Generator, depth: float) -> Any:
    far, angle = number(rng, 0.3, 2.0) * depth, number(rng, 0.0, 2.0 * np.pi)
    return pr.Motion(x=far * np.cos(angle), z=far * np.sin(angle))


def _rolls(rng: np.random.Generator, tool: Placed) -> tuple[str, float]:
    """Axis along which a roll or a ball rolls, and its radius."""
    shape: Any = tool.tool
    if shape.type == "extruded":
        return "z" if shape.axis[0] else "x", shape.section.radius
    outline: Any = tool.outline
    return str(rng.choice(["x", "z"])), outline.radius


def _release(rng: np.random.Generator, body: Body) -> pr.Step:
    """All tools are taken away; the body springs back on its supports, or on as few points as it takes without its ground."""
    fixed = {"body.bottom": pr.Fixed(free=True)} if rng.random() < 0.5 else {}
    return pr.Step("release", remove_tools=True, fixed=fixed)
