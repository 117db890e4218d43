"""Metal that bends past its yield, of elements that do not do so well: how far their forces are off where a step ends."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Committed, warning
from prensa.contact.passage import WORTH_SAYING
from prensa.errors import Finding
from prensa.materials.flow_curve import stress_at
from prensa.materials.solids.j2 import J2
from prensa.mesh.bricks import BrickMesh
from prensa.system.bending import FOR_BENDING, BentStrips, bendings
from prensa.system.bent_sections import BentMetal
from prensa.system.held import held
from prensa.system.system import System
from prensa.types import Array

FOR_METAL = {2: "'element: q4_enhanced', or 'q4_sheet' for springback", 3: f"'element: {FOR_BENDING[3]}'"}
"""The remedy by the dimension of space."""


class MetalBends:
    """Bodies of metal of the default element that bend: by how much their forces are off at the end of a step.

    What `check` says before a run is of elastic stiffness. Here each strip through the thickness has the curvature that the nodes
    on the outline show, and its moment is that of its layers of elements and of the material (`BentMetal`). A force over a
    prescribed way is off by the work of the difference over all other work, in the last increment. Sections that straighten do so
    elastically, and do not count. In space strips bend as plates, along two ways, and so do those of bodies of revolution, along
    the meridian and the hoop; no side of an element is straight along that. Of tetrahedra, which have no strips, nothing is said.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        p = system.problem
        # Laws of users may yield otherwise in bending, or state no flow stress.
        metals = {n: b.element for n, b in p.bodies.items() if isinstance(b.material, J2)}
        self.open = {n for n, element in metals.items() if element is None or n in system.chosen}
        self.strips: dict[str, BentStrips] = {}

    def __call__(self, given: Committed) -> Iterator[Finding]:
        """What there is to say of each body, once."""
        work = given.state.energy.external - given.context.state.energy.external
        for body in sorted(self.open):
            mesh = self.system.meshes[body]
            if mesh.cells.shape[1] != (8 if isinstance(mesh, BrickMesh) else 4):
                self.open.discard(body)
                continue
            excess = self._excess(body, given)
            share = excess / (work - excess) if work > max(excess, 0.0) else 0.0
            if abs(share) > WORTH_SAYING:
                self.open.discard(body)
                bending = bendings(self.system, [body], 0.0).get(body)
                # what the elastic stiffness is off has been reported before the run
                if bending is not None and bending.bent and not bending.pressed and abs(bending.error) <= WORTH_SAYING:
                    yield warning(self._words(body, share))

    def _excess(self, body: str, given: Committed) -> float:
        """Work that layers of elements do in bending in the last increment beyond that of the material."""
        s = self.system
        if body not in self.strips:
            self.strips[body] = BentStrips.of(s.meshes[body], held(s, body))
        strips, span = self.strips[body], s.span(body)
        if not len(strips.layers):
            return 0.0
        bent, lengths, width = self._bent(strips, span, given)
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

    def _bent(self, strips: BentStrips, span: slice, given: Committed) -> tuple[list[Array], Array, Array]:
        """Changes of curvature (s, w) at both ends of the increment, lengths (s, w) of straight sides, width (s,)."""
        s = self.system
        places = [s.X[span], *(s.positions(state.u)[span] for state in (given.context.state, given.state))]
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
            f"{body!r} bends past yield, where its layers of {default!r} are too {way[0]}: forces of prescribed travels are too "
            f"{way[1]}, by an estimated {100.0 * abs(share):.2g} %; give it {remedy}; 'element: {default}' accepts that"
        )
