"""Elements that fold over themselves: reported once each way, and the end of a run where a contact is missing for good.

An element whose free side goes past the support beside it meets nothing there. What keeps it from passing through itself
is no metal, and forces from then on are those of a body that has room where it has none: the run has its answer. Others fold
where the mesh is too coarse; these are reported at the end, where forces show them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Committed, Failed, Finished, Solved, ended_by, warning
from prensa.checks.during.acceptance import Corners
from prensa.checks.during.self_intersection import free_sides, least_on_sides, past_support, side_nodes
from prensa.checks.force_share import ForceShare
from prensa.checks.thresholds import SLIGHT, TOUCHING_DEPTH
from prensa.errors import Finding, per_cent
from prensa.policy import Policy
from prensa.system.assembly import Block
from prensa.system.failure import CornerInverted, Past, PastSupport, place_of
from prensa.system.interaction import Context
from prensa.system.system import System
from prensa.types import Array, Index


class Folding:
    """Looks at the elements of converged increments that fold over themselves; each cause is reported once."""

    def __init__(self, system: System, policy: Policy, corners: Corners) -> None:
        self.system, self.policy, self.corners = system, policy, corners
        self.reported: set[str] = set()
        """Supports that sides were reported to be past, '' of what folds elsewhere."""
        self.since: dict[tuple[str, int], int] = {}
        """Number of the increment in which a side of an element (its body, its number) was first found past a support."""
        self.coarse = ""
        """The first element that folded where no contact is missing."""
        self.carry = ForceShare()
        """What elements gain in energy while they are folded."""
        self.gained = 0.0
        self._at: Array | None = None
        self._folded: list[tuple[Block, int]] = []

    def __call__(self, given: Solved) -> Iterator[Finding]:
        """Inside condensed bodies, which are linear, nothing folds."""
        if given.complete and self.system.dofs.dimension == 3:
            self._coarse(self.folded(given.result.u))
        elif given.complete:
            yield from self.look(given.context, given.result.u, self.folded(given.result.u))
        elif given.context.ends_step:
            self.since.clear()

    def go_on_from(self, before: Folding) -> None:
        """Take over what was seen of the run on an earlier system."""
        self.coarse, self.gained = before.coarse, before.gained
        self.carry.go_on_from(before.carry)

    def note(self, given: Committed) -> tuple[()]:
        """Note what the elements that are folded at the end of an increment have gained in it."""
        if not given.complete:
            return ()
        # histories of condensed bodies are recovered where somebody looks
        histories = zip(given.context.state.history, given.state.history) if self.coarse else ()
        for block, (before, after) in zip(self.system.blocks, histories):
            own = np.array([e for b, e in self._folded if b is block], dtype=np.int64)
            if len(own):
                self.gained += float((block.work(after, own) - block.work(before, own)).sum())
        self.carry.note(given, self.gained)
        return ()

    def warnings(self, _: Finished | Failed) -> Iterator[Finding]:
        """Of elements that fold where no contact is missing, where forces show it."""
        share = self.carry.at_most_work() if self.coarse else 0.0
        if share > SLIGHT:
            yield warning(
                f"{self.coarse} folds over itself, and an estimated {per_cent(share)} of the forces are those of elements "
                "that do: use a finer mesh, or a larger fillet of the tool"
            )

    def folded(self, u: Array) -> list[tuple[Block, int]]:
        """Elements that fold over themselves, the worst of each body first, for degrees of freedom u (ndof,)."""
        if self.system.problem.kinematics == "small":
            return []
        if self._at is u:  # another check has asked
            return self._folded
        x, out = self.system.positions(u), list[tuple[Block, int]]()
        for block in self.system.blocks:
            shape, least = self.corners.least(block, u), self.policy.inverted_corner_ratio
            quadratic = block.cells.shape[1] > block.corners.shape[1] and self.system.dofs.dimension == 2
            if quadratic and not shape.min() < least:
                # Sides of quadratic elements can fold between healthy corners; they are only looked at where the corners say
                # nothing.
                shape = least_on_sides(x.take(block.cells.T, axis=0))
            beyond = np.flatnonzero(shape < least)
            out += [(block, int(e)) for e in beyond[np.argsort(shape[beyond])]]
        self._at, self._folded = u, out
        return out

    def creased(self, c: Context, folded: list[tuple[Block, int]]) -> Index | None:
        """Nodes of ``folded`` elements on sides that are in no contact and that nothing supports; None without such elements."""
        if self.system.dofs.dimension == 3:
            return None
        nodes = [
            np.intersect1d(block.cells[element], side_nodes(self.system, side))
            for block, element in folded
            for side in free_sides(self.system, c.plan.fixed, block.body, block.cells[element])
        ]
        return np.unique(np.concatenate(nodes)) if nodes else None

    def look(self, c: Context, u: Array, folded: list[tuple[Block, int]]) -> Iterator[Finding]:
        """What there is to say of the worst of the ``folded`` elements of a converged increment, or why the run ends with it."""
        if not folded:
            self.since.clear()
            return
        now, since, reason = c.state.clock.number, dict[tuple[str, int], int](), None
        for block, element in folded:
            nodes = block.cells[element]
            past = past_support(self.system, c.plan.fixed, block.body, nodes, u)
            if past is not None and past.support not in self.reported:
                yield self._reported(block, element, past.support, _beyond(past))
            if past is not None and past.share > TOUCHING_DEPTH:
                first = since[block.body, element] = self.since.get((block.body, element), now)
                # A short overhang may be meant: a step that ends soon after has its answer.
                if reason is None and now - first >= self.policy.max_folded_increments:
                    x, y = self.system.positions(u)[nodes].mean(axis=0).tolist()
                    reason = PastSupport(element, block.body, x, y, past, now - first)
        # Only elements that are folded now are kept: one that unfolded in between begins to count anew.
        self.since = since
        if not self.reported:
            block, element = folded[0]
            if free := free_sides(self.system, c.plan.fixed, block.body, block.cells[element]):
                yield self._reported(block, element, "", _missing(free))
            else:
                self._coarse(folded)
        if reason is not None:
            yield ended_by(reason)

    def _coarse(self, folded: list[tuple[Block, int]]) -> None:
        """Note the first of the elements that fold where no contact is missing."""
        if folded and not self.coarse:
            self.coarse = self._placed(*folded[0])

    def _reported(self, block: Block, element: int, support: str, words: str) -> Finding:
        """A warning of an element; notes the support that its side is past, '' for none."""
        self.reported.add(support)
        return warning(f"{self._placed(block, element)} folds over itself: {words}")

    def _placed(self, block: Block, element: int) -> str:
        place = self.system.X[block.cells[element]].mean(axis=0).tolist()
        return place_of(CornerInverted(element, block.body, *place))


def _missing(free: list[str]) -> str:
    which = " and ".join(map(repr, free))
    return f"{which}, in no contact, slides past its support or tool; make it part of a contact surface"


def _beyond(past: Past) -> str:
    return (
        f"side {past.side!r} slides past the support {past.support!r}; put a tool there, with that side in its contact"
    )
