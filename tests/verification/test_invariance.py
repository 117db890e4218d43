"""The answer does not depend on units, on the direction of the axes, on handedness or on numbering.

The problem: a block bonded to its base is pressed and dragged by a tool with friction, until some points slip, some
stick and some leave. The tool moves obliquely, so that a wrong sign or a wrong arm cannot cancel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import prensa as pr
from prensa.result.increment import Increment
from prensa_bench.robustness import blocks
from problems import stroke, upset_billet

Array = NDArray[np.float64]
NX, NY = 16, 8
SIZE = (16.0, 8.0)
E, NU, MU = 1000.0, 0.3, 0.3
TOOLS = ("plane", "circle", "stamp")
JUDGES_WARNINGS = False
KINEMATICS = (("small", "reference"), ("small", "current"), ("finite", "current"))


@dataclass
class Frame:
    """How the model is seen: lengths and forces in other units, turned by ``angle``, mirrored in x, renumbered."""

    length: float = 1.0
    force: float = 1.0
    angle: float = 0.0
    mirror: bool = False
    seed: int | None = None
    axes: Array = field(init=False)

    def __post_init__(self) -> None:
        c, s = math.cos(self.angle), math.sin(self.angle)
        self.axes = np.array([[c, -s], [s, c]]) @ np.diag([-1.0 if self.mirror else 1.0, 1.0])

    def vector(self, x: float, y: float, scale: float = 1.0) -> tuple[float, float]:
        """A direction (scale 1) or a length vector (scale ``length``)."""
        v = scale * (self.axes @ np.array([x, y]))
        return float(v[0]), float(v[1])

    def point(self, x: float, y: float) -> tuple[float, float]:
        """A position."""
        return self.vector(x, y, self.length)

    def stress(self, s: float) -> float:
        """A stress."""
        return s * self.force / self.length**2


def block(frame: Frame) -> pr.Points:
    """The block's mesh as arrays, in the frame."""
    x = np.array([(SIZE[0] * i / NX, SIZE[1] * j / NY) for j in range(NY + 1) for i in range(NX + 1)])
    cells = np.array(
        [[k, k + 1, k + NX + 2, k + NX + 1] for j in range(NY) for k in range(j * (NX + 1), j * (NX + 1) + NX)]
    )
    sets = {"bottom": np.arange(NX + 1), "top": np.arange(NY * (NX + 1), len(x))}
    if frame.mirror:
        cells = cells[:, ::-1]
    if frame.seed is not None:
        rng = np.random.default_rng(frame.seed)
        new = rng.permutation(len(x))  # old number → new number
        x, cells = x[np.argsort(new)], new[cells]
        sets = {name: rng.permutation(new[nodes]) for name, nodes in sets.items()}
        cells = np.array([np.roll(c, rng.integers(4)) for c in cells[rng.permutation(len(cells))]])
    return pr.Points(
        points=tuple(frame.point(*p) for p in x.tolist()),
        cells=tuple(tuple(c) for c in cells.tolist()),
        boundaries={name: tuple(nodes.tolist()) for name, nodes in sets.items()},
    )


def tool_of(kind: str, frame: Frame) -> Any:
    """The tool, just touching a node of the block's top; the plane is inclined, so that it leaves part of the top."""
    if kind == "plane":
        return pr.Plane(normal=frame.vector(-0.05, -1.0), at=frame.point(16.0, 8.0))
    if kind == "circle":
        return pr.Circle(radius=12.0 * frame.length, at=frame.point(7.0, 20.0))
    return pr.Stamp(
        width=5.3 * frame.length, fillet=2.5 * frame.length, facing=frame.vector(0.0, -1.0), at=frame.point(7.3, 8.0)
    )


def problem(kind: str, kinematics: str, geometry: str, frame: Frame, mu: float = MU) -> pr.Problem:
    """Press obliquely, then drag a little back."""
    down = pr.Motion(**dict(zip("xy", frame.vector(0.20, -0.20, frame.length))))
    back = pr.Motion(**dict(zip("xy", frame.vector(-0.05, -0.20, frame.length))))
    return pr.Problem(
        "dragged block", kinematics=kinematics, contact_geometry=geometry,
        bodies={"block": pr.Body(block(frame), pr.Elastic(E=frame.stress(E), nu=NU))},
        tools={"tool": tool_of(kind, frame)},
        contacts=(pr.Contact("block.top", "tool", friction=pr.Coulomb(mu)),),
        fixed={"block.bottom": "xy"},
        steps=(
            pr.Step("press", move={"tool": down}, increments=6),
            pr.Step("back", move={"tool": back}, increments=6),
        ),
    )  # fmt: skip


def history(kind: str, kinematics: str, geometry: str, frame: Frame) -> tuple[list[Increment], Array, Array]:
    """Increments; forces (k, 2) and moments (k,) on the tool about its reference point, in the first frame's axes."""
    # forces to 1e-8 need a residual well below that of the default
    incs = list(pr.solve(problem(kind, kinematics, geometry, frame), pr.Numerics(tolerance=1e-11)))
    hand = -1.0 if frame.mirror else 1.0
    # the forces of a plane problem are per unit thickness: a force over a length, a moment over a length
    force = np.array([i.force("tool")[:2] for i in incs]) @ frame.axes / (frame.force / frame.length)
    moment = hand * np.array([i.force("tool").m for i in incs]) / frame.force
    return incs, force, moment


@cache
def original(kind: str, kinematics: str, geometry: str) -> tuple[list[Increment], Array, Array]:
    """`history` in the first frame, which all are compared with."""
    return history(kind, kinematics, geometry, Frame())


def agree(kind: str, kinematics: str, geometry: str, frame: Frame) -> list[Increment]:
    """Forces to 1e-8 of the largest, moments to 1e-8 of it times the block's width; the increments in the other frame."""
    _, force, moment = original(kind, kinematics, geometry)
    increments, other, turned = history(kind, kinematics, geometry, frame)
    largest = np.abs(force).max()
    assert np.abs(other - force).max() <= 1e-8 * largest
    assert np.abs(turned - moment).max() <= 1e-8 * largest * SIZE[0]
    return increments


@pytest.mark.parametrize(("kinematics", "geometry"), KINEMATICS)
@pytest.mark.parametrize("kind", TOOLS)
def test_the_problem_is_worth_asking(kind: str, kinematics: str, geometry: str) -> None:
    """Points open, stick and slip in the problem that the other tests repeat."""
    incs, _, _ = original(kind, kinematics, geometry)
    seen = set(np.concatenate([i.contacts["block.top-tool"].status for i in incs]).tolist())
    assert seen == {0, 1, 2}


@pytest.mark.parametrize(("kinematics", "geometry"), KINEMATICS)
@pytest.mark.parametrize("kind", TOOLS)
@pytest.mark.parametrize("length, force", [(1e-3, 1.0), (1 / 25.4, 1 / 4.4482216152605), (1e6, 1e-9)])
def test_units_do_not_matter(length: float, force: float, kind: str, kinematics: str, geometry: str) -> None:
    """In m-N, inch-lbf and absurd units the forces agree and Newton takes the same iterations, give or take one."""
    frame = Frame(length=length, force=force)
    there = [i.statistics for i in agree(kind, kinematics, geometry, frame)]
    here = [i.statistics for i in original(kind, kinematics, geometry)[0]]
    assert len(here) == len(there)
    assert all(abs(a.iterations - b.iterations) <= 1 and a.cutbacks == b.cutbacks for a, b in zip(here, there))


@pytest.mark.parametrize(("kinematics", "geometry"), KINEMATICS)
@pytest.mark.parametrize("kind", TOOLS)
@pytest.mark.parametrize("angle", [90.0, 37.0, -123.0])
def test_turned_models_give_turned_forces(angle: float, kind: str, kinematics: str, geometry: str) -> None:
    """A model turned as a whole gives the same forces in its own axes, and the same moment."""
    agree(kind, kinematics, geometry, Frame(angle=math.radians(angle)))


@pytest.mark.parametrize(("kinematics", "geometry"), KINEMATICS)
@pytest.mark.parametrize("kind", TOOLS)
def test_mirrored_models_give_mirrored_forces(kind: str, kinematics: str, geometry: str) -> None:
    """The mirror image gives the mirrored force and the opposite moment."""
    agree(kind, kinematics, geometry, Frame(mirror=True))


@pytest.mark.parametrize(("kinematics", "geometry"), KINEMATICS)
@pytest.mark.parametrize("kind", TOOLS)
@pytest.mark.parametrize("seed", [1, 2])
def test_numbering_does_not_matter(seed: int, kind: str, kinematics: str, geometry: str) -> None:
    """Nodes and elements in random order, elements starting at any corner, give the same forces."""
    agree(kind, kinematics, geometry, Frame(seed=seed))


def test_units_do_not_matter_to_enhanced_modes() -> None:
    """The modes of an axisymmetric enhanced element are of one dimension: a block a million times as wide is as stiff."""
    forces = []
    for length in (1.0, 1e6):
        p = upset_billet(
            stroke(-0.2 * length, increments=2, tool="tool"),
            tools={"tool": pr.Circle(radius=9 * length, touching="b.top")}, material=pr.Elastic(E / length**2, NU),
            size=(4 * length, 2 * length), n=(4, 3), element="q4_enhanced",
        )  # fmt: skip
        forces.append([i.force("tool").y for i in pr.solve(p)])
    assert forces[1] == pytest.approx(forces[0], rel=1e-8)


def test_units_do_not_change_the_increments_of_metals(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pressed and released, metal takes the same increments in metres: round-off does not say what is on the yield surface."""
    times = []
    for length in (1.0, 1e-3):
        monkeypatch.setattr(blocks, "SYSTEMS", dict.fromkeys(blocks.SYSTEMS, (length, 1.0)))
        times.append([i.time for i in pr.solve(blocks.draw("plastic", 1, 14))])
    assert times[1] == pytest.approx(times[0], abs=1e-9)
