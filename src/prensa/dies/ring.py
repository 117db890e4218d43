"""Shrink rings: where a ring can go about a die, its mesh there, and how it is held and joined.

A ring presses on a die by its interference only where it surrounds it. In axisymmetry that is the cylinder of the section's
largest radius; in the plane a back that goes once around, by itself or with its images at lines of symmetry.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from prensa.dies.section import mesh_of, offset
from prensa.dies.surface import in_space
from prensa.errors import PrensaError, per_cent
from prensa.materials.solids.elastic import Elastic
from prensa.mesh.mesh import boundary_edges
from prensa.model.problem import Body, Fixed, Points, Problem, Tie
from prensa.precision import DRAWN
from prensa.result.increment import ToolState
from prensa.types import Array, Index


@dataclass(frozen=True)
class ShrinkRing:
    """A shrink ring about a die: ``thickness`` and radial ``interference`` (lengths), ``E`` (None: steel) and ``nu``.

    ``largest_strain``: interference over the radius of its seat beyond which it is refused; the hardest steels yield there.
    """

    thickness: float
    interference: float
    E: float | None = None
    nu: float = 0.3
    largest_strain: float = 0.01

    def refuse(self, tool: str) -> None:
        """Refuse a ring of no thickness, or without interference; raises PrensaError."""
        for name, value in (("thickness", self.thickness), ("interference", self.interference)):
            if not value > 0.0:
                raise PrensaError(
                    f"the {name} of the shrink ring of tool {tool!r} must be positive, got {value:g}; give both, as in --ring "
                    "20:0.05 (the interference is how much smaller than its seat the radius of the ring is)"
                )

    def refuse_on(self, tool: str, radius: float, unit: str) -> None:
        """Refuse an interference that strains beyond what is elastic on a seat of a radius; raises PrensaError."""
        if self.interference > self.largest_strain * radius:
            raise PrensaError(
                f"the interference {self.interference:g} {unit} of the shrink ring of tool {tool!r} is "
                f"{per_cent(self.interference / radius)} of the radius {radius:.4g} of its seat, more than is elastic; give "
                f"at most {self.largest_strain * radius:.2g} {unit}, or another 'largest_strain' in ShrinkRing"
            )


def with_ring_outside(
    made: Problem, mesh: Points, tool: str, ring: ShrinkRing, steel: Elastic, cut: Sequence[str] = ()
) -> Problem:  # fmt: skip
    """An axisymmetric die of a ``mesh`` with a ring about the cylinder of its largest radius.

    ``cut``: sides of the section beyond which the tool goes on. An end of the ring is held along the axis where a side of the
    die that is held so ends in the same plane.

    Raises
    ------
    PrensaError
        If there is no such cylinder, it is the face or a cut, or the interference is too large for it.

    """
    x = np.array(mesh.points)
    seat = _cylinder(tool, x, boundary_edges(np.array(mesh.cells)), mesh.boundaries, cut)
    unit, radius = made.units.length, float(x[seat, 0].max())
    ring.refuse_on(tool, radius, unit)
    length = float(np.abs(np.diff(x[seat, 1])).mean())
    depths = np.linspace(0.0, ring.thickness, max(round(ring.thickness / length), 2) + 1)
    bore = np.column_stack([np.full(len(seat), radius), x[seat, 1]])
    lines = bore[None] + depths[:, None, None] * np.array([1.0, 0.0])
    size = float(np.ptp(x, axis=0).max())
    held = {}
    for end, y in (("start", bore[0, 1]), ("end", bore[-1, 1])):
        for name, support in made.fixed.items():
            nodes = list(mesh.boundaries[name.partition(".")[2]])
            if support.y is not None and np.abs(x[nodes, 1] - y).max() <= DRAWN * size:
                held[f"ring.{end}"] = Fixed(y="held")
    name = "outside"
    while name in mesh.boundaries:
        name += "'"
    die = replace(mesh, boundaries=dict(mesh.boundaries) | {name: tuple(seat.tolist())})
    return _joined(replace(made, bodies={"die": replace(made.bodies["die"], mesh=die)}), name, lines, True, ring, steel, held)


def with_ring_on_back(
    made: Problem, mesh: Points, tool: str, ring: ShrinkRing, steel: Elastic, back: Array, state: ToolState,
    mirrors: Mapping[str, str],
) -> Problem:  # fmt: skip
    """A die in the plane of a ``mesh`` with a ring on its ``back``, a line (n, 2) in the tool's frame that goes around it.

    ``mirrors``: ends (``start``, ``end``) at lines of symmetry across x or y.

    Raises
    ------
    PrensaError
        If the back does not surround the die, or the interference is too large for it.

    """
    d = np.diff(back, axis=0)
    angle = np.unwrap(np.arctan2(d[:, 1], d[:, 0]))
    closed = "start" not in mesh.boundaries
    # With the tool on the left who walks around an opening turns to the right, in quarters between lines of symmetry.
    quarters = np.rint((angle[-1] - angle[0]) / (0.5 * np.pi))
    if not (closed or set(mirrors) == {"start", "end"}) or quarters >= 0.0:
        raise PrensaError(
            f"a shrink ring on the back of tool {tool!r} would surround nothing and shrink onto nothing; leave it out, or "
            "give the section of an opening whose back goes around it, all of it or between lines of symmetry"
        )
    span = np.ptp(back, axis=0) * [2.0 if axis in mirrors.values() else 1.0 for axis in "xy"]
    ring.refuse_on(tool, 0.5 * float(span.max()), made.units.length)
    across = len(mesh.boundaries["back"])
    depths = np.linspace(0.0, ring.thickness, max(round(ring.thickness * across / float(np.hypot(*d.T).sum())), 2) + 1)
    rings = offset(tool, back, depths, mirrors)
    lines = in_space(rings.reshape(-1, 2), state).reshape(rings.shape)
    held = {f"ring.{k.partition('.')[2]}": v for k, v in made.fixed.items() if k in ("die.start", "die.end")}
    return _joined(made, "back", lines, False, ring, steel, held)


def _joined(
    made: Problem, seat: str, lines: Array, axis: bool, ring: ShrinkRing, steel: Elastic, held: Mapping[str, Fixed]
) -> Problem:  # fmt: skip
    return replace(
        made, bodies=dict(made.bodies) | {"ring": Body(mesh_of(lines, ("bore", "back"), axis), steel, "q8")},
        ties=(Tie("ring.bore", f"die.{seat}", ring.interference),), fixed=dict(made.fixed) | dict(held),
    )  # fmt: skip


def _cylinder(tool: str, x: Array, edges: Index, sides: Mapping[str, Sequence[int]], cut: Sequence[str]) -> Index:
    """Nodes (k,) of the outside of a section of nodes x (n, 2), downwards, on which a ring can sit; raises PrensaError."""
    size, radius = float(np.ptp(x, axis=0).max()), float(x[:, 0].max())
    on = x[:, 0] >= radius - DRAWN * size
    outside = edges[on[edges[:, :2]].all(axis=1), :2]
    seat = np.unique(outside)
    seat = seat[np.argsort(-x[seat, 1])]

    def lies_on(name: str) -> bool:
        return bool(np.isin(outside, sides.get(name, ())).all(axis=1).any())

    about = f"a shrink ring cannot surround the section of tool {tool!r}"
    if not len(outside):
        raise PrensaError(
            f"{about}: at its largest radius {radius:.4g} it has no cylinder; give one that ends in a cylinder, as a flat die "
            "with --span does, or a mesh of the die (--mesh)"
        )
    if lies_on("face"):
        raise PrensaError(
            f"{about}: its outside, at the radius {radius:.4g}, is the face that the workpiece touches; leave the ring out"
        )
    if any(lies_on(side) for side in cut):
        raise PrensaError(
            f"{about}, which is cut at the radius {radius:.4g} where the tool goes on; give where the die ends, as in --span "
            "0:20 (coordinates of its outline)"
        )
    if len(outside) != len(seat) - 1:
        raise PrensaError(f"{about}: its outside, at the radius {radius:.4g}, is in several pieces; leave the ring out")
    return np.asarray(seat)
