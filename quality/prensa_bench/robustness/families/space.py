"""Bodies in space under tools in space: boxes, warped ones, cylinders and tubes; pressed, slid over, lifted, loaded again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.types import Array
from prensa_bench.robustness.claims import sprung_back
from prensa_bench.robustness.drawn import Drawn, Placed, Twin, friction, metal, number
from prensa_bench.robustness.solids import Place, ball, cone, plate, punch, roll

BRICKS_ALONG = (3, 6)  # bricks along an axis, at least and less than
FINER_BY = 1.5  # bricks of the second mesh for each of the first along an axis
SAME_ON_FINER = 0.06  # of the two, under a plate
SAME_TURNED = 1e-5  # of a problem that is turned about the upright axis
ONE_IN = 10  # problems of which one is solved on a second mesh
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

    def forces(self, history: Mapping[str, Any], tool: str) -> dict[str, Any]:
        """Forces of a tool by axis."""
        return {a: np.asarray(history[f"{tool}.{a}"]) for a in FORCES_XYZ}


@dataclass(frozen=True)
class Body:
    """A mesh, its supports, and half-widths and height of what it fills; ``box``: it is one, whose ``n`` may be another."""

    mesh: Any
    fixed: dict[str, Any]
    wide: float
    deep: float
    high: float
    box: bool = False


def problem(rng: np.random.Generator) -> Drawn:
    """A body on its bottom, on planes of symmetry or clamped, and a tool above it."""
    plastic = rng.random() < 0.6
    m = metal(rng, plastic)
    material = m.material
    if not plastic and rng.random() < 0.4:
        material = pr.NeoHooke(m.E, m.nu)
    shape, body = [_box, _box, _warped, _cylinder, _tube][rng.integers(5)](rng)
    narrow = () if shape.endswith("tube") else (_ball, _punch, _cone)  # they would go into its bore
    tools = (_plate, _plate, _roll, *narrow)
    name, tool, most, gap = tools[rng.integers(len(tools))](rng, body)
    depth = gap + most * number(rng, 0.2, 1.0)
    mu = 0.0 if rng.random() < 0.2 else number(rng, 0.02, 0.5)
    motion = str(rng.choice(["press", "slide", "lift", "again", *_ALSO.get(name, ())]))
    contact = pr.Contact(("body.top",), "tool")
    p = pr.Problem(
        "space", space="solid", bodies={"body": pr.Body(body.mesh, material)}, tools={"tool": tool.tool}, contacts=(contact,),
        friction=friction(mu), fixed=body.fixed, steps=_steps(rng, motion, depth, body, tool),
    )  # fmt: skip
    kind = f"{shape}, {name}, {motion}, depth {depth / body.high:.2g} of the height, mu {mu:.2g}, {material.type}"
    claims = (sprung_back,) if motion == "lift" and not plastic and mu == 0.0 else ()
    E = 0.0 if material.type == "neo_hooke" else m.E  # its bulk modulus is that of small strains alone
    return Drawn(
        (p,), {"tool": tool}, {contact.name: mu}, E, m.nu, m.strength, claims, _twins(rng, p, body, name), limit=60.0, kind=kind
    )  # fmt: skip


def _twins(rng: np.random.Generator, p: pr.Problem, body: Body, tool: str) -> tuple[Twin, ...]:
    """Of one in `ONE_IN` boxes under plates the finer one; of every other box under what looks the same, the turned one."""
    if not body.box:
        return ()
    if tool == "plate" and rng.random() < 1.0 / ONE_IN * 5:  # one in five bodies under a plate is a box that is drawn here
        n = tuple(round(FINER_BY * k) for k in body.mesh.n)
        finer = replace(p, bodies={"body": replace(p.bodies["body"], mesh=replace(body.mesh, n=n))})
        return (Finer(finer, tolerance=SAME_ON_FINER),)
    turned = _turned(p, body)
    return (QuarterTurn(turned, tolerance=SAME_TURNED),) if turned is not None and rng.random() < 0.3 else ()


def _turned(p: pr.Problem, body: Body) -> pr.Problem | None:
    """The problem turned by 90° about y; None where a tool is no ball, plate or roll."""
    tool = p.tools["tool"]
    given: dict[str, Any] = {"at": _quarter(tool.at)}
    if tool.type == "plane":
        given["normal"] = _quarter(tool.normal)
    elif tool.type == "extruded":
        given["axis"] = _quarter(tool.axis)
    elif tool.type not in ("sphere", "revolved"):
        return None
    (sx, sy, sz), (ox, oy, oz) = body.mesh.size, body.mesh.origin
    nx, ny, nz = body.mesh.n
    mesh = replace(body.mesh, size=(sz, sy, sx), n=(nz, ny, nx), origin=(oz, oy, -(ox + sx)))
    sides = {"body.left": "body.front", "body.back": "body.left", "body.bottom": "body.bottom"}
    ways = {"x": "z", "y": "y", "z": "x", "xyz": "xyz"}
    return replace(
        p, bodies={"body": replace(p.bodies["body"], mesh=mesh)}, tools={"tool": replace(tool, **given)},
        fixed={sides[name]: ways[way] for name, way in body.fixed.items()},
        steps=tuple(replace(s, move={"tool": _motion(s.move["tool"])}) for s in p.steps),
    )  # fmt: skip


def _quarter(v: Any) -> Place:
    x, y, z = map(float, v)
    return z, y, -x


def _motion(m: Any) -> Any:
    turned = {"x": m.z, "y": m.y, "z": None if m.x is None else -m.x}
    turned |= {"rx": m.rz, "ry": m.ry, "rz": None if m.rx is None else -m.rx}
    return pr.Motion(**{axis: way for axis, way in turned.items() if way is not None})


_ALSO = {"roll": ("roll",), "ball": ("roll", "twist"), "cone": ("twist",), "plate": ("twist",)}
"""What tools do besides: they roll without slip, or turn about the upright axis."""


def _steps(rng: np.random.Generator, motion: str, depth: float, body: Body, tool: Placed) -> tuple[pr.Step, ...]:
    """Pressing, and what follows; ways along x and z where the body is clamped, along planes of symmetry none."""
    steps = [pr.Step("press", move={"tool": pr.Motion(y=-depth)})]
    if body.fixed["body.bottom"] == "xyz" and motion == "twist":
        steps.append(pr.Step("twist", move={"tool": pr.Motion(ry=number(rng, -0.3, 0.3))}))
    if body.fixed["body.bottom"] == "xyz" and motion == "roll":
        far = number(rng, 0.5, 3.0) * depth
        shape: Any = tool.tool
        along = str(rng.choice(["x", "z"])) if shape.type == "sphere" else "z" if shape.axis[0] else "x"
        R = shape.radius if shape.type == "sphere" else shape.section.radius
        way = {"x": far, "rz": -far / R} if along == "x" else {"z": far, "rx": far / R}
        steps.append(pr.Step("roll", move={"tool": pr.Motion(**way)}))
    ways: dict[str, float] = {}
    if motion in ("slide", "again"):
        far = number(rng, 0.3, 2.0) * depth
        angle = number(rng, 0.0, 2.0 * np.pi)
        ways = {"x": far * np.cos(angle), "z": far * np.sin(angle)}
        if body.fixed["body.bottom"] != "xyz":
            ways = {}
        if ways:
            steps.append(pr.Step("slide", move={"tool": pr.Motion(**ways)}))
    if motion in ("lift", "again"):
        steps.append(pr.Step("lift", move={"tool": pr.Motion(y=0.2 * depth)}))
    if motion == "again":
        steps.append(pr.Step("again", move={"tool": pr.Motion(y=-number(rng, 0.8, 1.1) * depth)}))
    return tuple(steps)


# ------------------------------------------------------------------------------------------------------------------- bodies


def _held(rng: np.random.Generator, quarter: bool) -> dict[str, Any]:
    """On two planes of symmetry, on a smooth or a rough ground, or clamped."""
    if quarter:
        return {"body.bottom": "y" if rng.random() < 0.7 else "xyz", "body.left": "x", "body.back": "z"}
    return {"body.bottom": "xyz"}


def _sizes(rng: np.random.Generator) -> tuple[Array, tuple[int, int, int]]:
    size = rng.uniform(6.0, 14.0, 3)
    n = tuple(int(k) for k in rng.integers(*BRICKS_ALONG, 3))
    return size, (n[0], n[1], n[2])


def _box(rng: np.random.Generator) -> tuple[str, Body]:
    (sx, sy, sz), n = _sizes(rng)
    quarter = rng.random() < 0.5
    origin = (0.0, 0.0, 0.0) if quarter else (-sx / 2, 0.0, -sz / 2)
    mesh = pr.Box(size=(sx, sy, sz), n=n, origin=origin)
    return "quarter of a box" if quarter else "box", Body(mesh, _held(rng, quarter), sx / 2, sz / 2, sy, box=True)


def _warped(rng: np.random.Generator) -> tuple[str, Body]:
    """A box whose inner nodes are moved by up to 15 % of its bricks, and whose right side leans."""
    (sx, sy, sz), n = _sizes(rng)
    lean = number(rng, -0.2, 0.2)
    mesh = mesh_of(pr.Box(size=(sx, sy, sz), n=n, origin=(-sx / 2, 0.0, -sz / 2)))
    x = mesh.points.copy()
    inner = ~np.isin(np.arange(len(x)), np.concatenate([f.ravel() for f in mesh.edges.values()]))
    x[inner] += rng.uniform(-0.15, 0.15, (int(inner.sum()), 3)) * np.array([sx, sy, sz]) / n
    x[:, 0] *= 1.0 + lean * x[:, 1] / sy
    names = {name: tuple(mesh.nodes(name).tolist()) for name in mesh.edges}
    bricks = pr.Bricks(tuple(map(tuple, x.tolist())), tuple(map(tuple, mesh.cells.tolist())), names)
    return "warped box", Body(bricks, _held(rng, False), sx / 2, sz / 2, sy)


def _cylinder(rng: np.random.Generator) -> tuple[str, Body]:
    """Upright, its top the cap."""
    R, H = number(rng, 4.0, 8.0), number(rng, 5.0, 12.0)
    quarter = rng.random() < 0.5
    part = "top-right" if quarter else "full"
    section = pr.Disc(radius=R, n=(2 * int(rng.integers(1, 3)), int(rng.integers(2, 4))), part=part)
    mesh = pr.Extrusion(section=section, axis="y", length=H, n=int(rng.integers(*BRICKS_ALONG)))
    return ("quarter of a cylinder" if quarter else "cylinder"), _named(mesh, rng, R, H, quarter)


def _tube(rng: np.random.Generator) -> tuple[str, Body]:
    """A quarter of it, or the whole."""
    R, H = number(rng, 5.0, 9.0), number(rng, 5.0, 10.0)
    wall = number(rng, 0.3, 0.6) * R
    quarter = rng.random() < 0.6
    section = pr.Rectangle(size=(wall, H), origin=(R - wall, 0.0), n=(int(rng.integers(2, 4)), int(rng.integers(*BRICKS_ALONG))))
    mesh = pr.Revolution(section=section, angle=np.pi / 2 if quarter else 2 * np.pi, n=5 if quarter else 16)
    return ("quarter of a tube" if quarter else "tube"), _named(mesh, rng, R, H, quarter)


def _named(mesh: Any, rng: np.random.Generator, R: float, H: float, quarter: bool) -> Body:
    """Nodes, bricks and sides by place: the names of extruded and revolved sides are tried by other tests."""
    made = mesh_of(mesh)
    x, near = made.points, 1e-9 * max(R, H)
    at = {"bottom": x[:, 1] < near, "top": x[:, 1] > H - near}
    if quarter:
        at |= {"left": x[:, 0] < near, "back": (x[:, 2] if x[:, 2].max() > near else -x[:, 2]) < near}
    names = {name: tuple(np.flatnonzero(here).tolist()) for name, here in at.items()}
    bricks = pr.Bricks(tuple(map(tuple, x.tolist())), tuple(map(tuple, made.cells.tolist())), names)
    return Body(bricks, _held(rng, quarter), R, R, H)


# -------------------------------------------------------------------------------------------------------------------- tools
# those that are narrower than the body stand over its middle, or over the corner of its planes of symmetry


def _plate(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """Level, or over clamped bodies tilted by up to 3° and above what is highest then."""
    if body.fixed["body.bottom"] != "xyz" or "body.left" in body.fixed or rng.random() < 0.5:
        return "plate", plate((0.0, body.high, 0.0), (0.0, -1.0, 0.0)), 0.3 * body.high, 0.0
    a, b = rng.uniform(-0.05, 0.05, 2)
    up = 1.2 * (abs(a) * body.wide + abs(b) * body.deep)  # the right side of a warped box leans out by 20 % at most
    return "tilted plate", plate((0.0, body.high + up, 0.0), (a, -1.0, b)), 0.2 * body.high, up


def _ball(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    R = number(rng, 0.8, 3.0) * min(body.wide, body.deep)
    return "ball", ball((0.0, body.high + R, 0.0), R), min(0.12 * body.high, 0.1 * R), 0.0


def _roll(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    R = number(rng, 0.8, 3.0) * min(body.wide, body.deep)
    return "roll", roll((0.0, body.high + R, 0.0), R, str(rng.choice(["x", "z"]))), min(0.12 * body.high, 0.1 * R), 0.0


def _punch(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """Round or a bar, with a fillet of an element about."""
    least = min(body.wide, body.deep)
    width = number(rng, 0.8, 1.4) * least
    fillet, axis = number(rng, 0.2, 0.4) * width, str(rng.choice(["x", "y", "z"]))
    return "punch", punch((0.0, body.high, 0.0), width, fillet, axis), 0.08 * body.high, 0.0


def _cone(rng: np.random.Generator, body: Body) -> tuple[str, Placed, float, float]:
    """Blunt, with a round nose."""
    slope, least = number(rng, 0.15, 0.5), min(body.wide, body.deep)
    nose = number(rng, 0.5, 1.5) * least
    up = nose * (np.sqrt(1.0 + slope**2) - 1.0)  # of the nose above the tip
    return "cone", cone((0.0, body.high - up, 0.0), slope, 5.0 * least, nose), min(0.1 * body.high, 0.1 * nose), 0.0
