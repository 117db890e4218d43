"""Mirror images of what was modelled, for pictures of the whole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import NO_DIFFERENCE
from prensa.errors import Finding, PrensaError
from prensa.model.names import suggest
from prensa.model.problem import Problem
from prensa.result.increment import Increment
from prensa.system.contact_surfaces import always_held
from prensa.system.system import System
from prensa.types import Array


class Image(NamedTuple):
    """A copy of a section, mirrored about lines (axis that changes sign, coordinate of the line)."""

    lines: tuple[tuple[int, float], ...] = ()

    def of(self, points: Array) -> Array:
        """Points (n, d) of the copy."""
        out = np.array(points, dtype=float)
        for axis, at in self.lines:
            out[:, axis] = 2.0 * at - out[:, axis]
        return out

    def part(self, box: tuple[float, ...], lines: Sequence[tuple[int, float]], middle: Array) -> tuple[float, ...]:
        """The part of a box (x from, to, y from, to) that lies on the copy's side of all ``lines`` of symmetry.

        ``middle`` (d,): a place on the side of the section itself. Outlines of tools that have no end go on beyond a line, where
        the mirror image stands.
        """
        out = list(box)
        for axis, at in lines:
            above = bool(middle[axis] > at) != ((axis, at) in self.lines)
            out[2 * axis + (0 if above else 1)] = at
        return tuple(out)

    def sign(self, field: str, problem: Problem) -> float:
        """What a field's values are multiplied by; a radial component has no sign to lose."""
        axes = [axis for axis, _ in self.lines if not (axis == 0 and problem.space == "axisymmetric")]
        kind, _, component = field.partition(".")
        if kind == "stress" and component[0] != component[1]:
            axes = [axis for axis, _ in self.lines]
        elif kind != "displacement" or not component:
            return 1.0
        return -1.0 if sum("xyz"[axis] in component for axis in axes) % 2 else 1.0


def images(lines: Sequence[tuple[int, float]]) -> list[Image]:
    """The section itself and its copies about lines of symmetry; about two lines there are three."""
    found: list[tuple[tuple[int, float], ...]] = [()]
    for line in lines:
        found += [(*done, line) for done in found]
    return [Image(done) for done in found]


def mirror_lines(increment: Increment, problem: Problem, sides: Sequence[str]) -> list[tuple[int, float]]:
    """Lines, in space planes, of symmetry: axis that changes sign, coordinate. In axisymmetry the axis is one by itself.

    Raises
    ------
    PrensaError
        If a side is none, or two sides have the same direction.

    """
    ends = _ends(np.vstack([b.X for b in increment.bodies.values()]))
    lines = [(0, 0.0)] if problem.space == "axisymmetric" else []
    for side in sides:
        if side not in ends:
            raise PrensaError(f"'mirror' has no side {side!r}{suggest(str(side), ends)}")
        axis, at = ends[side]
        if axis in [a for a, _ in lines]:
            already = "the axis does that" if problem.space == "axisymmetric" and axis == 0 else "another side does that"
            raise PrensaError(f"'mirror' cannot mirror about the {side} side too: {already}; name one side of a direction")
        lines.append((axis, at))
    return lines


def _ends(X: Array) -> dict[str, tuple[int, float]]:
    """Axis and coordinate of each side of the box around points (n, d)."""
    pairs = (("left", "right"), ("bottom", "top"), ("back", "front"))[: X.shape[1]]
    return {name: (k, float(at)) for k, p in enumerate(pairs) for name, at in zip(p, (X[:, k].min(), X[:, k].max()))}


def unheld_mirrors(system: System, mirror: Sequence[str]) -> Iterator[Finding]:
    """Sides of ``mirror`` that are no planes of symmetry: neither supports nor tools hold the bodies there.

    What is modelled may then be the whole, and its forces would be given as those of a half.
    """
    ends, near = _ends(system.X), NO_DIFFERENCE * system.length
    for side in mirror:
        axis, at = ends.get(side, (0, np.nan))
        if at == at and not (_held(system, axis, at, near) or _stopped(system, axis, at, near)):
            yield Finding(
                "output.mirror",
                f"nothing holds the bodies in {'xyz'[axis]} at their {side} side, so that it is no plane of symmetry, but forces "
                f"of the whole part count what is modelled twice for it; hold it in 'fixed', or leave {side!r} out",
            )


def _held(system: System, axis: int, at: float, near: float) -> bool:
    """Whether supports hold all of a face that lies at a place along an axis, or a node where no face does.

    The nodes of a side that a support beneath holds are not enough.
    """
    for name, mesh in system.meshes.items():
        there = np.abs(mesh.points[:, axis] - at) <= near
        inclined = [s for b, s in system.problem.fixed.items() if b.partition(".")[0] == name and s.normal == "held"]
        held = there & always_held(system.problem, name, mesh)[:, axis]
        faces = mesh.boundary[there[mesh.boundary].all(axis=1)]
        if there.any() and (inclined or (held[faces].all(axis=1) if len(faces) else held).any()):
            return True
    return False


def _stopped(system: System, axis: int, at: float, near: float) -> bool:
    """Whether a tool stands at a place along an axis, its normal along it."""
    for s in system.tool_contacts:
        X = system.X[s.points.nodes]
        there = X[np.abs(X[:, axis] - at) <= near]
        if len(there):
            seen = system.tool_masters[s.against].seen(there, system.initial().u)
            if ((np.abs(seen.g) <= near) & (np.abs(seen.n[:, axis]) >= 1.0 - NO_DIFFERENCE)).any():
                return True
    return False
