"""One problem posed in two ways: turned, moved and numbered anew, or as one half of a whole; combinations that nobody chose."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.types import Array, Index
from prensa_bench.robustness.drawn import Drawn, Metal, Placed, Twin, chain, circle, logarithmic, metal, number, stamp

ELASTIC = ("q4", "q4_enhanced", "q8", "q8_full", "t3", "t6")
PLASTIC = ("q4_enhanced", "q8", "t6")
STRAIN_ONLY = ("q4_fbar", "q4_fbar")  # out of plane stress, which has no F-bar
DRAWN_RULES = ("nodal", "nodal", "gauss1", "gauss2", "simpson", "kikuchi")
SHAPES = ("stamp", "circle", "wedge")
ANGLES = (0.5 * np.pi, np.pi, 1.5 * np.pi)  # of tools that are pushed: along an axis still
DISTORTED = 0.15  # of an element, by which inner nodes are moved
# sides of cells the other way round: those of the mirror image with its own on the left
MIRRORED = {3: (1, 0, 2), 4: (1, 0, 3, 2), 6: (1, 0, 2, 3, 5, 4), 8: (1, 0, 3, 2, 4, 7, 6, 5)}


@dataclass(frozen=True)
class Mesh:
    """Nodes x (n, 2), cells (m, a), and the nodes of named sides."""

    x: Array
    cells: Index
    sides: dict[str, Index]

    def described(self) -> pr.Points:
        """The mesh by arrays."""
        sides = {name: tuple(nodes.tolist()) for name, nodes in self.sides.items()}
        return pr.Points(tuple(map(tuple, self.x.tolist())), tuple(map(tuple, self.cells.tolist())), sides)

    def numbered_anew(self, rng: np.random.Generator) -> Mesh:
        """The same with nodes and cells in another order."""
        new = rng.permutation(len(self.x))
        cells = new[self.cells][rng.permutation(len(self.cells))]
        return Mesh(self.x[np.argsort(new)], cells, {k: new[v] for k, v in self.sides.items()})

    def turned(self, R: Array, about: Array) -> Mesh:
        """Turned by R (2, 2), and moved by ``about`` (2,)."""
        return replace(self, x=self.x @ R.T + about)

    def whole(self) -> Mesh:
        """With its mirror image at x = 0."""
        n, on = len(self.x), np.flatnonzero(self.x[:, 0] == 0.0)
        image = np.full(n, -1)
        image[on] = on
        others = np.setdiff1d(np.arange(n), on)
        image[others] = n + np.arange(len(others))
        cells = np.vstack([self.cells, image[self.cells][:, MIRRORED[self.cells.shape[1]]]])
        sides = {k: np.union1d(v, image[v]) for k, v in self.sides.items() if k != "left"}
        return Mesh(np.vstack([self.x, self.x[others] * [-1.0, 1.0]]), cells, sides)


def problem(rng: np.random.Generator) -> Drawn:
    """A block under a tool in plane strain or plane stress, by any element, law, rule, enforcement and time rule."""
    return _half(rng) if rng.random() < 0.4 else _turned(rng)


@dataclass(frozen=True)
class Posed:
    """What both ways have in common: ``kind`` says it in words."""

    metal: Metal
    element: str
    mesh: Mesh
    size: tuple[float, float]
    h: float
    mu: float
    kind: str
    numerics: pr.Numerics
    more: dict[str, Any]
    contact: dict[str, Any]

    def problem(self, name: str, mesh: Mesh, tool: Any, fixed: dict[str, str], steps: tuple[pr.Step, ...]) -> pr.Problem:
        """The block under a tool."""
        contact = pr.Contact(("block.top",), "tool", friction=pr.Coulomb(self.mu) if self.mu else None, **self.contact)
        return pr.Problem(
            name, bodies={"block": pr.Body(mesh.described(), self.metal.material, self.element)}, tools={"tool": tool},
            contacts=(contact,), fixed=fixed, steps=steps, **self.more,
        )  # fmt: skip

    def drawn(self, p: pr.Problem, tool: Placed, twin: Twin) -> Drawn:
        """Judged by the files of the first way, and beside the other."""
        m = self.metal
        E = m.E if m.type in ("elastic", "j2") else 0.0
        return Drawn(
            (p,), {"tool": tool}, {p.contacts[0].name: self.mu}, E, m.nu, m.strength, twins=(twin,), limit=30.0, kind=self.kind,
            numerics=self.numerics,
        )  # fmt: skip

    def force(self, rng: np.random.Generator, wide: float, thickness: float) -> float:
        """What a tool of a width is pushed with: some of what its metal bears, or a small strain of an elastic one."""
        stress = number(rng, 0.2, 1.4) * self.metal.strength / 4 or number(rng, 1e-3, 8e-3) * self.metal.E
        return stress * wide * thickness


def _posed(rng: np.random.Generator, left: float) -> Posed:
    """The block, from x = ``left`` times its width."""
    plastic = rng.random() < 0.5
    m = _material(rng, plastic)
    space = str(rng.choice(["plane strain", "plane stress"], p=[0.65, 0.35]))
    element = str(rng.choice((PLASTIC if plastic else ELASTIC) + (STRAIN_ONLY if space == "plane strain" else ())))
    nx, ny = int(rng.integers(8, 15)), int(rng.integers(4, 8))
    if element[:2] in ("q8", "t6"):
        nx, ny = nx // 2 + 1, ny // 2 + 1
    width, height = number(rng, 8.0, 20.0), number(rng, 4.0, 9.0)
    mesh = _mesh(rng, element, (width, height), (nx, ny), left * width)
    rule = str(rng.choice(DRAWN_RULES if element in ("q4", "q4_enhanced", "q4_fbar", "t3") else ("nodal",)))
    stiff = {"beta": logarithmic(rng, 30.0, 1e3)} if rng.random() < 0.3 else {}
    some = [pr.Penalty(**stiff), pr.Augmented(), *([pr.Exact()] if rule in ("nodal", "gauss1") else [])]
    enforcement: Any = some[rng.integers(len(some))]
    mu = 0.0 if rng.random() < 0.25 else logarithmic(rng, 0.02, 1.0)
    time_rule: Any = str(rng.choice(["auto", "backward_euler", "bdf2"])) if plastic else "auto"
    kind = f"{space}, {m.material.type}, {element}, {rule}, {enforcement.type}, mu {mu:.2g}, {time_rule}"
    return Posed(
        m, element, mesh, (width, height), width / nx, mu, kind, pr.Numerics(time_rule=time_rule),
        {"space": space, "thickness": number(rng, 0.5, 2.0)}, {"integration": rule, "enforcement": enforcement},
    )  # fmt: skip


def _material(rng: np.random.Generator, plastic: bool) -> Metal:
    m = metal(rng, plastic)
    if plastic or rng.random() < 0.4:
        return m
    return replace(m, material=pr.NeoHooke(m.E, m.nu) if rng.random() < 0.6 else pr.StVenantKirchhoff(m.E, m.nu))


def _mesh(rng: np.random.Generator, element: str, size: tuple[float, float], n: tuple[int, int], x0: float) -> Mesh:
    """Of a rectangle whose inner nodes are moved by a share of an element."""
    nodes = {"t3": 3, "t6": 6, "q8": 8, "q8_full": 8}.get(element, 4)
    made = mesh_of(pr.Rectangle(size=size, n=n, origin=(x0, 0.0)), nodes)
    x, (width, height) = made.points.copy(), size
    inner = (x[:, 0] > x0 + 1e-9 * width) & (x[:, 0] < x0 + width - 1e-9 * width)
    inner &= (x[:, 1] > 0) & (x[:, 1] < height - 1e-9 * height)
    if nodes <= 4 and rng.random() < 0.6:  # quadratic sides stay straight
        x[inner] += rng.uniform(-DISTORTED, DISTORTED, (int(inner.sum()), 2)) * np.array(size) / n
    return Mesh(x, made.cells.astype(np.int64), {name: made.nodes(name) for name in made.edges})


def _tool(rng: np.random.Generator, p: Posed, wide: float) -> tuple[str, Placed, Any]:
    """Over the middle x = 0 of the top: its name, itself, and what makes it turned by an angle and moved."""
    height, at = p.size[1], (0.0, p.size[1])
    shape = str(rng.choice(SHAPES))
    if shape == "stamp":
        fillet = min(number(rng, 1.0, 2.0) * p.h, 0.3 * wide)
        return shape, stamp(at, wide, fillet), lambda f, c: pr.Stamp(width=wide, fillet=fillet, facing=f((0.0, -1.0)), at=c)
    if shape == "circle":
        R = number(rng, 0.8, 3.0) * wide
        return shape, circle((0.0, height + R), R), lambda f, c: pr.Circle(radius=R, at=c)
    slope, a, b = number(rng, 0.1, 0.5), 0.5 * wide, 4.0 * p.size[0]
    fillet = min(number(rng, 2.0, 4.0) * p.h, 0.9 * a / float(np.tan(0.5 * np.arctan(slope))))
    corners = [(-b, slope * (b - a)), (-a, 0.0), (a, 0.0), (b, slope * (b - a))]
    return shape, chain(at, corners, fillet), lambda f, c: pr.Profile(points=tuple(map(f, corners)), fillet=fillet, at=c)


def _turned(rng: np.random.Generator) -> Drawn:
    """Pressed obliquely, or pushed down, slid and lifted; beside the same turned by any angle, far away, numbered anew."""
    p = _posed(rng, -0.5)
    shape, tool, again = _tool(rng, p, number(rng, 0.25, 0.45) * p.size[0])
    pushed = rng.random() < 0.3
    angle = float(rng.choice(ANGLES)) if pushed else number(rng, -np.pi, np.pi)
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    if pushed:
        R = np.round(R)
    depth = number(rng, 0.005, 0.04 if p.metal.strength else 0.025) * p.size[1]
    aside, force = number(rng, -0.5, 0.5) * depth, p.force(rng, number(rng, 0.25, 0.45) * p.size[0], p.more["thickness"])
    slid = number(rng, -2.0, 2.0) * depth

    def along(v: tuple[float, float]) -> tuple[float, float]:
        return tuple((R @ np.asarray(v)).tolist())

    def steps(turn: Any) -> tuple[pr.Step, ...]:
        if pushed:
            shares = {"press": 1.0, "ease": 0.3, "again": 0.9}
            return tuple(
                pr.Step(name, push={"tool": pr.Push(**_axes(turn((0.0, -share * force))))}) for name, share in shares.items()
            )
        ways = {"press": (aside, -depth), "slide": (aside + slid, -depth), "lift": (aside + slid, -0.02 * depth)}
        return tuple(pr.Step(name, move={"tool": pr.Motion(**dict(zip("xy", turn(way))))}) for name, way in ways.items())

    far = rng.uniform(-50.0, 50.0, 2)
    first = p.problem("posed", p.mesh, tool.tool, {"block.bottom": "xy"}, steps(lambda v: v))
    centre = tuple((R @ np.asarray(tool.at) + far).tolist())
    mesh = p.mesh.numbered_anew(rng).turned(R, far)
    other = p.problem(
        f"the same turned by {np.degrees(angle):.3g}°", mesh, again(along, centre), {"block.bottom": "xy"}, steps(along)
    )
    p = replace(p, kind=f"turned, {shape}, {'pushed' if pushed else 'moved'}, {p.kind}")
    return p.drawn(first, tool, Twin(other, angle=angle, each_step=True))


def _axes(force: tuple[float, float]) -> dict[str, float]:
    """The one component of a force along an axis."""
    k = int(np.argmax(np.abs(force)))
    return {"xy"[k]: force[k]}


def _half(rng: np.random.Generator) -> Drawn:
    """Pressed or pushed straight down and released in part; beside the whole, of which it is the right half."""
    p = _posed(rng, 0.0)
    wide = number(rng, 0.5, 1.2) * p.size[0]
    shape, tool, _ = _tool(rng, p, wide)
    if rng.random() < 0.4:
        force = p.force(rng, 0.5 * wide, p.more["thickness"])
        plans = [
            tuple(pr.Step(name, push={"tool": pr.Push(y=-f)}) for name, f in (("press", whole), ("ease", 0.3 * whole)))
            for whole in (force, 2.0 * force)
        ]
        how = "pushed"
    else:
        depth, how = number(rng, 0.005, 0.04 if p.metal.strength else 0.025) * p.size[1], "moved"
        ways = {"press": depth, "lift": 0.7 * depth}
        plans = 2 * [tuple(pr.Step(name, move={"tool": pr.Motion(y=-y)}) for name, y in ways.items())]
    foot = "xy" if rng.random() < 0.5 else "y"
    first = p.problem("posed", p.mesh, tool.tool, {"block.bottom": foot, "block.left": "x"}, plans[0])
    # where the foot slides, the middle of it does not: by symmetry
    middle = {} if foot == "xy" else {"block.middle": "x"}
    whole = p.mesh.whole()
    on = np.flatnonzero((whole.x[:, 0] == 0.0) & (whole.x[:, 1] == 0.0))
    whole = replace(whole, sides={**whole.sides, "middle": on}).numbered_anew(rng)
    other = p.problem("the whole of which it is a half", whole, tool.tool, {"block.bottom": foot, **middle}, plans[1])
    p = replace(p, kind=f"half, {shape}, {how}, {p.kind}")
    return p.drawn(first, tool, Twin(other, scale=0.5, axes=("fy",), each_step=True))
