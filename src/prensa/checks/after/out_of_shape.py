"""Elements in space that are out of shape where a run ends: nothing gives them a new mesh, and a longer run may end on them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Committed, Failed, Finished, warning
from prensa.checks.during.acceptance import least_corner
from prensa.checks.during.distortion import IN_A_SECTION
from prensa.errors import Finding, coordinates
from prensa.mesh.brick_checks import scaled_jacobians
from prensa.mesh.bricks import SOLID_CORNERS
from prensa.mesh.mesh import Mesh, displaced
from prensa.mesh.quality import POOR, quality
from prensa.policy import Policy
from prensa.system.system import System
from prensa.types import Array


class OutOfShape:
    """Elements that become so in a run: folded, or with a scaled Jacobian below `POOR` where stresses are computed.

    A corner that opens to 180° is neither: free sides that come to lie on a tool have such elements, which answer well.
    """

    def __init__(self, system: System, policy: Policy) -> None:
        self.system, self.folded_from = system, policy.inverted_corner_ratio
        self.x: Array | None = None
        """Places (n, 3) of the nodes at the end of the last increment."""

    def go_on_from(self, before: OutOfShape) -> None:
        """Take over the end of the run on an earlier system, whose nodes are the same."""
        self.x = before.x

    def note(self, given: Committed) -> tuple[()]:
        """Keep where an increment ends: what its elements look like is asked for once."""
        self.x = self.system.positions(given.state.u) if given.complete else self.x
        return ()

    def warnings(self, _: Finished | Failed) -> Iterator[Finding]:
        """How many there are in each body, and the worst one with its place."""
        if self.x is None or self.system.problem.kinematics == "small":
            return
        for body, mesh in self.system.meshes.items():
            now = displaced(mesh, self.x[self.system.span(body)])
            corners = now.cells[:, : SOLID_CORNERS[now.cells.shape[1]]]
            corner, shape = least_corner(now.points[corners].transpose(1, 0, 2)), _at_points(now)
            folded = corner < self.folded_from
            worn = folded | ((shape < POOR) & (_at_points(mesh) >= POOR))
            if not worn.any():
                continue
            worst = int(np.argmin(np.where(worn, np.where(folded, corner, shape), np.inf)))
            where, much = coordinates(now.points[now.cells[worst]].mean(axis=0)), int(folded.sum())
            yield warning(
                f"{int(worn.sum())} of {len(worn)} elements of body {body!r} are out of shape where the run ends"
                f"{f', {much} of them folded over' * (much > 0)}, the worst is element {worst}, now near ({where}), with a "
                f"scaled Jacobian of {quality(now).jacobian[worst]:.2g} (1 is a box, 0 flat): stresses are poor there, and runs "
                f"end on such elements; use a mesh that is finer there, a larger fillet of the tool, or {IN_A_SECTION}"
            )


def _at_points(mesh: Mesh) -> Array:
    """Least scaled Jacobians (m,) of elements at integration points of bricks, at corners of tetrahedra."""
    return scaled_jacobians(mesh.points[mesh.cells]).min(axis=1) if mesh.cells.shape[1] == 8 else quality(mesh).jacobian
