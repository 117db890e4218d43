"""Bodies in space that are drawn: boxes, warped ones, cylinders, cones of wedges, tubes and sectors of any angle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import prensa as pr
from prensa.mesh.generate import mesh_of
from prensa.types import Array
from prensa_bench.robustness.drawn import number
from prensa_bench.robustness.split_in_space import split

FREE = ("body.left", "body.right", "body.back", "body.front")
BRICKS_ALONG = (3, 6)  # bricks along an axis, at least and less than


@dataclass(frozen=True)
class Body:
    """A mesh, its supports, half-widths and height of what it fills, and the part of that which is modelled.

    ``box``: it is one, whose ``n`` may be another; ``bored``: a tool that is narrower than it would go into its bore; ``round``:
    it is a sector, whose planes of symmetry let no tool but one of revolution, or a level one, be drawn; ``sides``: the free
    ones, which bulge onto a plate that goes deep; ``tetrahedra``: its bricks are split into them.
    """

    mesh: Any
    fixed: dict[str, Any]
    wide: float
    deep: float
    high: float
    part: float = 1.0
    box: bool = False
    bored: bool = False
    round: bool = False
    sides: tuple[str, ...] = ()
    tetrahedra: bool = False

    @cached_property
    def filled(self) -> Any:
        """The mesh that is computed on."""
        return split(self.mesh) if self.tetrahedra else self.mesh

    @property
    def clamped(self) -> bool:
        """Whether it is whole and stands on a rough ground: tools may go anywhere, turn and tilt."""
        return self.part == 1.0 and self.fixed["body.bottom"] == "xyz"

    @property
    def area(self) -> float:
        """About that of its top."""
        return self.part * (np.pi if self.round or not self.box else 4.0) * self.wide * self.deep


def body_drawn(rng: np.random.Generator) -> tuple[str, Body]:
    """One of all, with what it is in words."""
    shapes = (box, box, _warped, _cylinder, _cone, _tube, _sector)
    return shapes[rng.integers(len(shapes))](rng)


def _held(rng: np.random.Generator, quarter: bool) -> dict[str, Any]:
    """On two planes of symmetry, on a smooth or a rough ground, or clamped."""
    if quarter:
        return {"body.bottom": "y" if rng.random() < 0.7 else "xyz", "body.left": "x", "body.back": "z"}
    return {"body.bottom": "xyz"}


def _sizes(rng: np.random.Generator) -> tuple[Array, tuple[int, int, int]]:
    size = rng.uniform(6.0, 14.0, 3)
    n = tuple(int(k) for k in rng.integers(*BRICKS_ALONG, 3))
    return size, (n[0], n[1], n[2])


def box(rng: np.random.Generator) -> tuple[str, Body]:
    """A whole one, or a quarter on planes of symmetry."""
    (sx, sy, sz), n = _sizes(rng)
    quarter = rng.random() < 0.5
    origin = (0.0, 0.0, 0.0) if quarter else (-sx / 2, 0.0, -sz / 2)
    mesh = pr.Box(size=(sx, sy, sz), n=n, origin=origin)
    half = (sx, sz) if quarter else (sx / 2, sz / 2)
    sides = ("body.right", "body.front") if quarter else FREE
    body = Body(mesh, _held(rng, quarter), *half, sy, 0.25 if quarter else 1.0, box=True, sides=sides)
    return "quarter of a box" if quarter else "box", body


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
    return "warped box", Body(bricks, _held(rng, False), sx / 2, sz / 2, sy, sides=FREE)


def _cylinder(rng: np.random.Generator) -> tuple[str, Body]:
    """Upright, its top the cap."""
    R, H = number(rng, 4.0, 8.0), number(rng, 5.0, 12.0)
    quarter = rng.random() < 0.5
    part = "top-right" if quarter else "full"
    section = pr.Disc(radius=R, n=(2 * int(rng.integers(1, 3)), int(rng.integers(2, 4))), part=part)
    mesh = pr.Extrusion(section=section, axis="y", length=H, n=int(rng.integers(*BRICKS_ALONG)))
    return ("quarter of a cylinder" if quarter else "cylinder"), _named(mesh, rng, R, H, quarter)


def _cone(rng: np.random.Generator) -> tuple[str, Body]:
    """A cylinder or a frustum whose bricks collapse into wedges at its axis; a quarter, or the whole."""
    R, H = number(rng, 4.0, 8.0), number(rng, 5.0, 12.0)
    quarter, lean = rng.random() < 0.4, number(rng, -0.2, 0.2)
    section = pr.Rectangle(size=(R, H), n=(int(rng.integers(2, 4)), int(rng.integers(*BRICKS_ALONG))))
    angle, n = (0.5 * np.pi, int(rng.integers(2, 5))) if quarter else (2.0 * np.pi, 2 * int(rng.integers(3, 6)))
    mesh = pr.Revolution(section=section, angle=angle, n=n, core="wedges")
    name = "quarter of a cone of wedges" if quarter else "cone of wedges"
    return name, _named(mesh, rng, R, H, quarter, lean)


def _sector(rng: np.random.Generator) -> tuple[str, Body]:
    """A solid one or one of a ring, between two planes of symmetry at any angle."""
    R, H, angle = number(rng, 4.0, 8.0), number(rng, 4.0, 10.0), number(rng, 0.5, 2.2)
    bore = number(rng, 0.3, 0.6) * R if rng.random() < 0.5 else 0.0
    n = (int(rng.integers(2, 4)), int(rng.integers(*BRICKS_ALONG)), int(np.ceil(angle / 0.4)))
    mesh = pr.Cylinder(radius=R, height=H, n=n, bore=bore, angle=angle, core=None if bore else "wedges")
    fixed = {"body.bottom": "y" if rng.random() < 0.7 else "xyz", "body.base": "z", "body.cap": "normal"}
    part = angle / (2.0 * np.pi)
    sides = ("body.outer", "body.inner") if bore else ("body.outer",)
    return "sector of a ring" if bore else "sector", Body(mesh, fixed, R, R, H, part, bored=bore > 0, round=True, sides=sides)


def _tube(rng: np.random.Generator) -> tuple[str, Body]:
    """A quarter of it, or the whole."""
    R, H = number(rng, 5.0, 9.0), number(rng, 5.0, 10.0)
    wall = number(rng, 0.3, 0.6) * R
    quarter = rng.random() < 0.6
    section = pr.Rectangle(size=(wall, H), origin=(R - wall, 0.0), n=(int(rng.integers(2, 4)), int(rng.integers(*BRICKS_ALONG))))
    mesh = pr.Revolution(section=section, angle=np.pi / 2 if quarter else 2 * np.pi, n=5 if quarter else 16)
    return ("quarter of a tube" if quarter else "tube"), _named(mesh, rng, R, H, quarter, bored=True)


def _named(
    mesh: Any, rng: np.random.Generator, R: float, H: float, quarter: bool, lean: float = 0.0, bored: bool = False
) -> Body:  # fmt: skip
    """Nodes, bricks and sides by place: the names of extruded and revolved sides are tried by other tests."""
    made = mesh_of(mesh)
    x, near = made.points.copy(), 1e-9 * max(R, H)
    r = np.hypot(x[:, 0], x[:, 2])
    at = {"bottom": x[:, 1] < near, "top": x[:, 1] > H - near, "outer": r > R - near}
    if bored:
        at["inner"] = r < r.min() + near
    if quarter:
        at |= {"left": x[:, 0] < near, "back": (x[:, 2] if x[:, 2].max() > near else -x[:, 2]) < near}
    names = {name: tuple(np.flatnonzero(here).tolist()) for name, here in at.items()}
    x[:, [0, 2]] *= 1.0 + lean * x[:, 1:2] / H
    bricks = pr.Bricks(tuple(map(tuple, x.tolist())), tuple(map(tuple, made.cells.tolist())), names)
    sides = tuple(f"body.{name}" for name in ("outer", "inner") if name in at)
    return Body(bricks, _held(rng, quarter), R, R, H, 0.25 if quarter else 1.0, bored=bored, sides=sides)
