"""Elements on which a run ends: the same one fails again and again, however short the increment.

Metal that flows around a corner, or out from under a tool, wears its mesh out: an element gets flatter until no increment
leads on. Increments shrink to nothing then, over hundreds of them, and nothing is learnt that is not known after a few.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Rejected, ended_by
from prensa.checks.during.self_intersection import past_support, sides_of
from prensa.checks.thresholds import TOUCHING_DEPTH
from prensa.errors import Finding
from prensa.mesh.mesh import displaced
from prensa.mesh.quality import quality
from prensa.policy import Policy
from prensa.system.failure import Collapsed, CornerInverted, Distorted, ElementFailed, Failure, Unevaluable
from prensa.system.interaction import Context
from prensa.system.system import System
from prensa.types import Array

WORN_OUT_SHARE = 1e-3
"""Share of the longest increment down to which they are counted."""

IN_A_SECTION = "a section in the plane with 'remesh: auto', where the body has one"
"""What to compute instead of a body in space, which has no new meshes when its elements wear out."""


class Distortion:
    """Counts the attempts of a step that failed on an element."""

    def __init__(self, system: System, policy: Policy) -> None:
        self.system, self.policy = system, policy
        self.step = -1
        self.failed: dict[tuple[str, int], int] = {}

    def __call__(self, given: Rejected) -> Iterator[Finding]:
        """Attempts of each step are counted by themselves."""
        if given.context.plan.number != self.step:
            self.step, self.failed = given.context.plan.number, {}
        if worn := self.rejected(given.context, given.reason, given.longest):
            yield ended_by(worn)

    def rejected(self, c: Context, reason: Failure, longest: float) -> Distorted | None:
        """Note an attempt at an increment that failed; why the run ends with it, or None. longest: increment of the step."""
        where = element_of(reason)
        if where is None:
            return None
        self.failed[where] = self.failed.get(where, 0) + 1
        usual = min(longest, self.policy.max_share * (c.plan.t1 - c.plan.t0))
        if self.failed[where] < self.policy.worn_out_attempts:
            return None
        body, element = where
        shape = float(shapes(self.system, body, c.state.u)[element])
        # An element of good shape that fails has another cause, which a new mesh would not cure.
        if shape > self.policy.worn_shape:
            return None
        worn = self._described(c, body, element, shape)
        # a side past a support is cause enough: increments of any length meet it
        past = worn.past is not None and worn.past.share > TOUCHING_DEPTH
        return worn if past or c.dt <= WORN_OUT_SHARE * usual else None

    def _described(self, c: Context, body: str, element: int, shape: float) -> Distorted:
        system = self.system
        nodes = system.meshes[body].cells[element] + system.offsets[body]
        x, y, *z = system.positions(c.state.u)[nodes].mean(axis=0).tolist()
        past = None if z else past_support(system, c.plan.fixed, body, nodes, c.state.u)  # supports are looked at in the plane
        sides = [name for name in sides_of(system, body, nodes) if name != body]
        contacts = [
            s.name for s in system.surfaces if s.body == body and np.isin(nodes, s.points.nodes).any()
        ]  # fmt: skip
        return Distorted(
            element, body, x, y, shape, self.failed[body, element], tuple(sides), tuple(contacts), past, *z
        )  # fmt: skip


def element_of(reason: Failure) -> tuple[str, int] | None:
    """Body and number of the element that a failure names; None if it names none."""
    match reason:
        case Unevaluable(ElementFailed() as cause):
            return cause.body, cause.element
        case CornerInverted() | Collapsed():
            return reason.body, reason.element
    return None


def shapes(system: System, body: str, u: Array) -> Array:
    """Scaled Jacobians (m,) of the elements of a body, for degrees of freedom u (ndof,)."""
    return quality(displaced(system.meshes[body], system.positions(u)[system.span(body)])).jacobian
