"""Stresses of a die: the section of a tool as an elastic body under the contact forces of an increment.

It goes one way: the tool was rigid in the run, and its give is not fed back to the workpiece.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from prensa.analysis import solve
from prensa.dies.own_mesh import own_mesh
from prensa.dies.ring import ShrinkRing, with_ring_on_back, with_ring_outside
from prensa.dies.section import depths_of, face_nodes, mesh_of, offset
from prensa.dies.spread import Touch, touch
from prensa.dies.surface import Outline, in_space, outline_of
from prensa.errors import PrensaError
from prensa.materials.solids.elastic import Elastic
from prensa.model.names import suggest
from prensa.model.problem import Body, Fixed, Load, Points, Problem, Step
from prensa.model.units import factor
from prensa.precision import DRAWN
from prensa.result.increment import Increment, ToolState
from prensa.system.discretise import discretise
from prensa.system.held import symmetry_planes
from prensa.system.system import System
from prensa.tools.place import PlacedTool
from prensa.types import Array

STEEL = "210 GPa"
"""Young's modulus of a die of which nothing else is given."""


@dataclass(frozen=True)
class Die:
    """What a die is made of, and how it is held.

    ``thickness`` (length) by which the tool's outline is offset; or ``mesh``, a description (`File`, `Outline`, …) of the die in
    the coordinates of the case, where the tool is at first: what of its sides lies on the tool's outline is the face.
    ``span``: coordinates of the outline between which there is a
    section, None for what is touched and a thickness more; ``size``: length of elements at the face, None for a fortieth of
    what is touched, ``growth`` of them from one to the next away from there (more than 1).
    ``back_pressure``: pre-pressure on the back; ``ring``: a shrink ring, in axisymmetry about the cylinder of the largest
    radius, in the plane about a back that goes around an opening. ``fixed``: sides (``back``, ``start``, ``end``, ``face``) and
    what holds them (``x``, ``y``, ``xy``), empty for the back: along its normal in axisymmetry and next to a line of symmetry,
    else altogether. Where a pressure or, in the plane, a ring acts on it, or it looks outwards in axisymmetry, an end holds
    along y, or lines of symmetry hold alone. A mesh is held by its own sides, which ``fixed`` names.
    """

    thickness: float = 0.0
    E: float | None = None
    nu: float = 0.3
    span: tuple[float, float] | None = None
    size: float | None = None
    growth: float = 1.2
    back_pressure: float = 0.0
    ring: ShrinkRing | None = None
    fixed: Mapping[str, str] = field(default_factory=dict)
    mesh: Any = None


@dataclass(frozen=True)
class DieStress:
    """A die under load: its ``problem`` and the ``increment`` that solves it.

    ``s``, ``X``, ``u`` (n, …): coordinates, places and displacements of the nodes of the face; ``pressure``, ``shear`` (n − 1,)
    on its edges, between the nodes; ``force`` (2,) of the run on the tool, ``load`` (2,) on the die, ``reaction`` (2,) of its
    supports (in axisymmetry along the axis alone: radial forces have no sum); ``number`` and ``time`` of the run's increment.
    """

    tool: str
    problem: Problem
    increment: Increment
    s: Array
    X: Array
    u: Array
    pressure: Array
    shear: Array
    force: Array
    load: Array
    reaction: Array
    number: int
    time: float

    @property
    def imbalance(self) -> float:
        """Largest difference of the forces of run, load and supports, over the force."""
        keep = slice(1, 2) if self.problem.space == "axisymmetric" else slice(0, 2)
        size = max(float(np.abs(self.force).max()), np.finfo(float).tiny)
        apart = (self.load - self.force)[keep], (self.load + self.reaction)[keep]
        return max(float(np.abs(v).max()) for v in apart) / size

    @property
    def largest_mises(self) -> tuple[float, Array]:
        """Largest von Mises stress of the die, and where (2,)."""
        return self._largest_of("die")

    @property
    def largest_mises_of_ring(self) -> tuple[float, Array] | None:
        """Largest von Mises stress of the shrink ring, and where (2,); None without one."""
        return self._largest_of("ring") if "ring" in self.increment.bodies else None

    def _largest_of(self, name: str) -> tuple[float, Array]:
        body = self.increment.bodies[name]
        k = int(np.argmax(body.mises))
        return float(body.mises[k]), body.X[k]

    @property
    def largest_deflection(self) -> tuple[float, Array]:
        """Largest displacement of the face, and where (2,)."""
        size = np.hypot(*self.u.T)
        k = int(np.argmax(size))
        return float(size[k]), self.X[k]


def die_stress(increment: Increment, problem: Problem, tool: str, die: Die, seconds: float = 1.0) -> DieStress:
    """Load the section of a tool with the contact forces of an increment of a problem, and solve it.

    Raises
    ------
    PrensaError
        For a tool that is unknown or carries nothing, a die without thickness or shorter than the contact.

    """
    refuse_die(problem, tool, die)
    system = discretise(problem)
    placed = next(t for t in system.tools if t.name == tool)
    state = increment.tools[tool]
    found = {n: touch(problem, placed, state, c, seconds) for n, c in increment.contacts.items() if c.tool == tool}
    touches = [t for t in found.values() if t is not None]
    if not touches:
        raise PrensaError(
            f"tool {tool!r} carries no force in increment {increment.number}; give another one, such as --at 'largest force'"
        )
    touched = _touched(touches)
    if die.mesh is not None:
        return _of_own_mesh(increment, problem, placed, die, touches)
    outline = outline_of(placed, 4.0 * (die.thickness + touched[1] - touched[0] + float(np.abs(touched).max())))
    bodies = [c.body for c in increment.contacts.values() if c.tool == tool]
    span, lines = _span(system, outline, state.at + np.array(state.place[:2]), touched, die, bodies)
    size = die.size or (touched[1] - touched[0]) / 40.0
    corners, period = outline.corners(), placed.shape.period
    if np.isfinite(period):
        corners = np.concatenate([corners + turn * period for turn in (-1.0, 0.0, 1.0)])
    s = face_nodes(span, touched, size, die.growth, corners)
    strip = offset(tool, outline.at(s), depths_of(die.thickness, size, die.growth), lines)
    force = np.zeros((len(s) - 1, 2))
    for t in touches:
        shares = t.shares(s, period)
        _refuse_beyond(tool, t, shares, span)
        force += shares.T @ t.force
    axis = problem.space == "axisymmetric"
    mesh = mesh_of(_placed(strip, state), ("face", "back"), axis)
    made = _problem(problem, tool, die, mesh, force, lines)
    if die.ring is not None:
        steel = _elastic(problem, die.ring.E, die.ring.nu)
        if axis:
            made = with_ring_outside(made, mesh, tool, die.ring, steel, _cut(die, span, outline))
        else:
            made = with_ring_on_back(made, mesh, tool, die.ring, steel, strip[-1], state, lines)
    last = list(solve(made))[-1]
    return _result(tool, made, last, increment, s, mesh, force)


def _of_own_mesh(increment: Increment, problem: Problem, tool: PlacedTool, die: Die, touches: Sequence[Touch]) -> DieStress:
    """The same of a mesh of one's own."""
    own = own_mesh(die.mesh, problem.units.length, tool, increment.tools[tool.name], _touched(touches))
    if wrong := [side for side in die.fixed if side not in own.mesh.boundaries]:
        raise PrensaError(f"the mesh of the die has no side {wrong[0]!r}{suggest(wrong[0], own.mesh.boundaries)}")
    force = np.zeros((len(own.s) - 1, 2))
    for t in touches:
        shares = t.shares(own.s, tool.shape.period)
        _refuse_beyond(tool.name, t, shares, (float(own.s[0]), float(own.s[-1])), "draw the side of the mesh longer")
        force += shares.T @ t.force
    made = _problem(problem, tool.name, die, own.mesh, force, {}, "t6" if own.triangles else "q8")
    if die.ring is not None:
        made = with_ring_outside(made, own.mesh, tool.name, die.ring, _elastic(problem, die.ring.E, die.ring.nu))
    return _result(tool.name, made, list(solve(made))[-1], increment, own.s, own.mesh, force)


def refuse_die(problem: Problem, tool: str, die: Die) -> None:
    """Refuse a die that cannot be made: of a tool that is unknown, of no thickness, held by what it has not.

    Raises
    ------
    PrensaError
        With what to give instead.

    """
    if tool not in problem.tools:
        tools = ", ".join(map(repr, problem.tools)) or "none"
        raise PrensaError(f"unknown tool {tool!r}{suggest(tool, problem.tools)}; tools: {tools}")
    if not die.growth > 1.0:
        raise PrensaError(f"'growth' of the elements of a die must be more than 1, got {die.growth:g}")
    if die.ring is not None:
        die.ring.refuse(tool)
    if die.mesh is not None:
        _refuse_with_mesh(tool, die, problem.space)
        return
    if not die.thickness > 0:
        raise PrensaError(
            f"tool {tool!r} is an outline: the thickness of its section must be greater than 0, got {die.thickness:g}; give it, "
            "as in --thickness 20 or Die(thickness=20), or a mesh of the die"
        )
    known = ("face", "back", "start", "end")
    for side, how in die.fixed.items():
        if side not in known or how not in ("x", "y", "xy"):
            sides = ", ".join(known)
            raise PrensaError(f"a die is not held by {side}={how}; give a side ({sides}) and x, y or xy, as in --fix back=y")
    if die.span is not None and not die.span[0] < die.span[1]:
        ends = f"{die.span[0]:g}:{die.span[1]:g}"
        raise PrensaError(f"the span {ends} of tool {tool!r} has no length; give FROM:TO, as in --span 0:20")


def _refuse_with_mesh(tool: str, die: Die, space: str) -> None:
    """Refuse what an offset section has and a mesh has not."""
    given = {
        "thickness": die.thickness, "span": die.span, "size": die.size, "back_pressure": die.back_pressure,
    }  # fmt: skip
    if space != "axisymmetric" and die.ring is not None:
        raise PrensaError(
            f"the die of {tool!r} has its own mesh, and a shrink ring around a mesh is possible only in axisymmetry: leave "
            "the ring out, or give the section by its 'thickness'"
        )
    if beside := [name for name, value in given.items() if value]:
        raise PrensaError(f"the die of {tool!r} has a mesh of its own: leave {beside[0]!r} out, which is of a section by offset")
    if not die.fixed:
        raise PrensaError(f"nothing holds the mesh of the die of {tool!r}: name sides of it, as in --fix bottom=y")
    for side, how in die.fixed.items():
        if how not in ("x", "y", "xy"):
            raise PrensaError(f"a die is not held by {side}={how}; give a side of its mesh and x, y or xy, as in --fix bottom=y")


def _elastic(problem: Problem, E: float | None, nu: float) -> Elastic:
    units = problem.units
    return Elastic(E=factor(STEEL, units.length, units.force, (1, -2)) if E is None else E, nu=nu)


def _touched(touches: Sequence[Touch]) -> tuple[float, float]:
    lo = min(float((t.s - t.left).min()) for t in touches)
    return lo, max(float((t.s + t.right).max()) for t in touches)


def _placed(lines: Array, state: ToolState) -> Array:
    return in_space(lines.reshape(-1, 2), state).reshape(lines.shape)


def _span(
    system: System, outline: Outline, at: Array, touched: tuple[float, float], die: Die, bodies: Sequence[str]
) -> tuple[tuple[float, float], dict[str, str]]:
    """Coordinates between which there is a section, and by side the component that a line of symmetry holds there.

    A section ends at the axis and at lines of symmetry of the bodies that the tool touches.
    """
    lo, hi = die.span or (touched[0] - die.thickness, touched[1] + die.thickness)
    period, middle = outline.tool.shape.period, 0.5 * (touched[0] + touched[1])
    if np.isfinite(period):
        whole = hi - lo >= period or die.span is None
        lo, hi = (middle - 0.5 * period, middle + 0.5 * period) if whole else (lo, hi)
    else:
        lo, hi = max(lo, float(outline.s[0])), min(hi, float(outline.s[-1]))
    turns = (-period, 0.0, period) if np.isfinite(period) else (0.0,)
    s = np.unique(np.concatenate([outline.s + turn for turn in turns]))
    x = outline.at(s)
    cuts = {(0, 0.0, 1.0)} if system.problem.space == "axisymmetric" else set()
    for body in bodies if system.problem.space != "axisymmetric" else ():
        mesh = system.meshes[body]
        for plane in symmetry_planes(system, body):
            if plane.axis is not None:
                cuts.add((plane.axis, plane.place, float(np.sign(mesh.points[:, plane.axis].mean() - plane.place))))
    held: dict[str, str] = {}
    for axis, place, side in cuts:
        d = side * (x[:, axis] + at[axis] - place)
        for name, cross in (("start", _crossing(s, d, middle, -1)), ("end", _crossing(s, d, middle, 1))):
            if name == "start" and cross is not None and cross >= lo - DRAWN * (hi - lo):
                lo, held[name] = cross, "xy"[axis]
            if name == "end" and cross is not None and cross <= hi + DRAWN * (hi - lo):
                hi, held[name] = cross, "xy"[axis]
    return (lo, hi), held


def _cut(die: Die, span: tuple[float, float], outline: Outline) -> list[str]:
    """Ends of a section at which nothing says that the die ends there too: neither its user nor its outline."""
    if die.span is not None:
        return []
    ends = (float(outline.s[0]), float(outline.s[-1]))
    near = DRAWN * (ends[1] - ends[0])
    return [name for name, at, end in zip(("start", "end"), span, ends) if abs(at - end) > near]


def _crossing(s: Array, d: Array, middle: float, way: int) -> float | None:
    """Coordinate nearest to ``middle`` in the direction ``way`` at which distances d (n,) from a line end; None without."""
    beyond = np.flatnonzero((d <= DRAWN * np.abs(d).max()) & ((s - middle) * way > 0))
    if not len(beyond):
        return None
    k = int(beyond[0] if way > 0 else beyond[-1])
    j = k - way
    if not 0 <= j < len(s) or d[j] == d[k]:
        return float(s[k])
    return float(s[k] + (s[j] - s[k]) * d[k] / (d[k] - d[j]))


def _refuse_beyond(tool: str, t: Touch, shares: Array, span: tuple[float, float], remedy: str = "") -> None:
    lost = float(np.abs((1.0 - shares.sum(axis=1)) * np.hypot(t.normal, t.shear)).max() / np.hypot(t.normal, t.shear).max())
    if lost > DRAWN:
        lo, hi = _touched([t])
        raise PrensaError(
            f"tool {tool!r}: the contact lies between {lo:.5g} and {hi:.5g} of its outline, the section between {span[0]:.5g} "
            f"and {span[1]:.5g}; {remedy or f'give a longer one, as in --span {lo:.4g}:{hi:.4g}'}"
        )


def _problem(
    problem: Problem, tool: str, die: Die, mesh: Points, force: Array, lines: Mapping[str, str], element: str = "q8"
) -> Problem:  # fmt: skip
    """The elastic die with its loads and supports."""
    x = np.array(mesh.points)[list(mesh.boundaries["face"])]
    length = np.hypot(*np.diff(x, axis=0).T)
    axis = problem.space == "axisymmetric"
    area = length * (np.pi * (x[1:, 0] + x[:-1, 0]) if axis else problem.thickness)
    on = np.flatnonzero(force.any(axis=1))
    loads = {f"die.e{k + 1}": Load(traction=(float(force[k, 0] / area[k]), float(force[k, 1] / area[k]))) for k in on}
    if die.back_pressure:
        loads["die.back"] = Load(pressure=die.back_pressure)
    fixed = _supports(problem, die, np.array(mesh.points)[list(mesh.boundaries.get("back", ()))], force.sum(axis=0), lines)
    return Problem(
        f"{problem.name}: {tool}", space=problem.space, kinematics="small", units=problem.units, fixed=fixed,
        bodies={"die": Body(mesh, _elastic(problem, die.E, die.nu), element)},
        steps=(Step("load", loads=loads, increments=1),), thickness=problem.thickness,
    )  # fmt: skip


def _supports(problem: Problem, die: Die, back: Array, force: Array, lines: Mapping[str, str]) -> dict[str, Fixed]:
    """What holds a die: what is asked for, else its back, and lines of symmetry."""
    if die.mesh is not None:
        return {
            f"die.{side}": Fixed(x="held" if "x" in how else None, y="held" if "y" in how else None)
            for side, how in die.fixed.items()
        }
    d, axis = back[-1] - back[0], problem.space == "axisymmetric"
    on_axis = [end for end, how in lines.items() if axis and how == "x"]
    # the component nearest to the back's normal: of a back that crosses the axis y, as all that the force can have
    along = "x" if abs(d[1]) > abs(d[0]) and not on_axis else "y"
    given = dict(die.fixed)
    loaded = bool(die.back_pressure) or (die.ring is not None and not axis)
    if not given and loaded and set(lines.values()) == {"x", "y"}:
        given = {}  # lines of symmetry hold it both ways
    elif not given and (loaded or (axis and along == "x")):
        ends = ("start", "end") if (force[1] < 0) == (back[0, 1] < back[-1, 1]) else ("end", "start")
        # an end on the axis is a point, which no force can stand on
        given = {next((end for end in ends if end not in on_axis), ends[1]): "y"}
    elif not given:
        given = {"back": along if axis or lines else "xy"}
    out = {}
    for side, how in given.items():
        out[side] = set(how)
    for side, how in lines.items():
        if not (axis and how == "x"):
            out.setdefault(side, set()).update(how)
    return {f"die.{s}": Fixed(x="held" if "x" in h else None, y="held" if "y" in h else None) for s, h in out.items()}


def _result(
    tool: str, made: Problem, last: Increment, increment: Increment, s: Array, mesh: Points, force: Array
) -> DieStress:
    body, face = last.bodies["die"], list(mesh.boundaries["face"])
    x = np.array(mesh.points)[face]
    d = np.diff(x, axis=0)
    length = np.hypot(*d.T)
    area = length * (np.pi * (x[1:, 0] + x[:-1, 0]) if made.space == "axisymmetric" else made.thickness)
    e = d / length[:, None]
    n = np.stack([e[:, 1], -e[:, 0]], axis=1)  # out of the tool
    reaction = np.sum([[r.x, r.y] for r in last.supports.values()], axis=0) if last.supports else np.zeros(2)
    pulled = np.array(increment.tools[tool].force[:2])
    nodes = [int(np.argmin(np.hypot(*(body.X - p).T))) for p in x]
    return DieStress(
        tool, made, last, s, x, body.displacement[nodes], -(force * n).sum(axis=1) / area, (force * e).sum(axis=1) / area, pulled,
        force.sum(axis=0), reaction, increment.number, increment.time,
    )  # fmt: skip
