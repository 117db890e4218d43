"""Metal that bends, of elements that do not do so well: how far their forces are off in a step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prensa.checks.check import Committed, warning
from prensa.contact.passage import WORTH_SAYING
from prensa.errors import Finding
from prensa.materials.flow_curve import stress_at
from prensa.materials.solids.j2 import J2
from prensa.system.bending import FOR_BENDING, BentStrips, bendings, looked_at, percent
from prensa.system.bent_sections import BentMetal
from prensa.system.held import held
from prensa.system.system import System
from prensa.types import Array

FOR_METAL = {2: "'element: q4_enhanced', or 'q4_sheet' for springback", 3: f"'element: {FOR_BENDING[3]}'"}
"""The remedy by the dimension of space."""


class Driven(NamedTuple):
    """The increment at whose end most ``work`` has been done: its ``rise``, displacements (ndof,) ``before`` and ``after``."""

    work: float
    rise: float
    before: Array
    after: Array


class MetalBends:
    """Bodies of metal of the default element that bend: by how much their forces are off at the end of a step.

    What `check` says before a run is of elastic stiffness in pure bending, by the shape that a body takes. Here each strip
    through the thickness has the curvature that the nodes on the outline show, and its moment is that of its layers of elements
    and of the material (`BentMetal`). A force over a prescribed way is off by the work of the difference over all other work, of
    stretching too, in the increment after which most work had been done in the step: where a tool has drawn back, forces are
    not what is asked for. Sections that straighten do so elastically, and do not count. In space strips bend as plates, along two
    ways, and so do those of bodies of revolution, along the meridian and the hoop; no side of an element is straight along that.
    Quadratic elements bend well, and are not looked at.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        # Laws of users may yield otherwise in bending, or state no flow stress.
        self.open = {n for n in system.problem.bodies if looked_at(system, n)}
        self.strips: dict[str, BentStrips] = {}
        self.most: Driven | None = None

    def note(self, given: Committed) -> tuple[()]:
        """Keep the increment at whose end most work has been done in a step."""
        before, work = given.context.state, given.state.energy.external
        if self.open and (self.most is None or work >= self.most.work):
            self.most = Driven(work, work - before.energy.external, before.u, given.state.u)
        return ()

    def __call__(self, _: Committed) -> Iterator[Finding]:
        """What there is to say of each body, once."""
        most, self.most = self.most, None
        if most is None:
            return
        for body in sorted(self.open):
            excess = self._excess(body, most)
            share = excess / (most.rise - excess) if most.rise > max(excess, 0.0) else 0.0
            if abs(share) > WORTH_SAYING:
                self.open.discard(body)
                bending = bendings(self.system, [body], 0.0).get(body)
                if bending is not None and bending.bent and not bending.pressed:
                    yield warning(self._words(body, share))

    def _excess(self, body: str, most: Driven) -> float:
        """Work that layers of elements do in bending in an increment beyond that of the material."""
        s = self.system
        if body not in self.strips:
            self.strips[body] = BentStrips.of(s.meshes[body], held(s, body))
        strips, span = self.strips[body], s.span(body)
        if not len(strips.layers):
            return 0.0
        bent, lengths, width = self._bent(strips, span, most)
        size = [np.linalg.norm(one, axis=1) for one in bent]
        before, after = (one * strips.thickness for one in size)
        material = s.problem.bodies[body].material
        assert isinstance(material, J2)

        def flow(strain: Array) -> Array:
            return stress_at(material.flow, strain, np.zeros_like(strain))

        metal = BentMetal(material.E, material.nu, flow, s.problem.space)
        ways = np.tile(np.eye(1, bent[1].shape[1]), (len(after), 1))  # of what is straight
        ways[size[1] > 0.0] = bent[1][size[1] > 0.0] / size[1][size[1] > 0.0, None]

        def more(bend: Array) -> Array:
            """Of the moments of sections, over the square of their thickness."""
            return metal.moments_of_layers(bend, ways, strips.layers, relative) - metal.moments(bend, ways)

        relative, area = lengths / strips.thickness[:, None], strips.lengths.prod(axis=1) * width
        grown = np.maximum(after - before, 0.0) * strips.thickness * area
        return float((0.5 * (more(before) + more(after)) * grown).sum())

    def _bent(self, strips: BentStrips, span: slice, most: Driven) -> tuple[list[Array], Array, Array]:
        """Changes of curvature (s, w) at both ends of the increment, lengths (s, w) of straight sides, width (s,)."""
        s = self.system
        places = [s.X[span], *(s.positions(u)[span] for u in (most.before, most.after))]
        if s.axisymmetric:
            found = [strips.of_revolution(x) for x in places]
            (at_rest, radius), *bent = found
            lengths = np.column_stack([strips.lengths, np.zeros_like(radius)])
            return [one - at_rest for one, _ in bent], lengths, 2.0 * np.pi * radius
        rest, before, after = (strips.curvatures(x) for x in places)
        width = s.problem.thickness if s.dofs.dimension == 2 else 1.0
        return [before - rest, after - rest], strips.lengths, np.full(len(rest), width)

    def _words(self, body: str, share: float) -> str:
        default = self.system.problem.element_name(body)
        way = ("stiff", "large") if share > 0.0 else ("soft", "small")
        remedy = FOR_METAL[self.system.dofs.dimension]
        return (
            f"{body!r} bends, and its layers of {default!r} are too {way[0]} for that: forces of prescribed travels are too "
            f"{way[1]}, by an estimated {percent(share)} %; give it {remedy}; 'element: {default}' accepts that"
        )
