"""Elements in space that are out of shape where a run ends: nothing gives them a new mesh, and a longer run may end on them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Committed, Failed, Finished, warning
from prensa.checks.during.distortion import IN_A_SECTION
from prensa.errors import Finding, coordinates
from prensa.mesh.mesh import displaced
from prensa.mesh.quality import POOR, quality
from prensa.system.system import System
from prensa.types import Array


class OutOfShape:
    """Elements whose scaled Jacobian has fallen below `POOR` in a run; those that begin so have been reported before it."""

    def __init__(self, system: System) -> None:
        self.system = system
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
            x = self.x[self.system.span(body)]
            shape = quality(displaced(mesh, x)).jacobian
            worn = (shape < POOR) & (quality(mesh).jacobian >= POOR)
            if not worn.any():
                continue
            worst, folded = int(np.argmin(np.where(worn, shape, np.inf))), int((worn & (shape < 0.0)).sum())
            where, much = coordinates(x[mesh.cells[worst]].mean(axis=0)), f", {folded} of them folded" * (folded > 0)
            yield warning(
                f"{int(worn.sum())} of {len(shape)} elements of body {body!r} are out of shape where the run ends (scaled "
                f"Jacobian below {POOR}{much}), the worst is element {worst}, now near ({where}), with {shape[worst]:.2g}: "
                "stresses are poor there, and a longer run may end on it; use a mesh that is finer there, a larger fillet of "
                f"the tool, or {IN_A_SECTION}"
            )
