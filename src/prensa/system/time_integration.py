"""Plastic flow by backward Euler or by the backward difference of second order.

Backward Euler takes the direction of flow at the end of an increment for that of the whole: the error is of first order, and
bodies whose flow turns pay for it. The backward difference of second order (Curtiss & Hirschfelder 1952), with increments h after
h_n and ρ = h/h_n,

    eᵖ − eᵖ_n = share (eᵖ_n − eᵖ_(n−1)) + part h ėᵖ,  share = ρ²/(1 + 2ρ),  part = (1 + ρ)/(1 + 2ρ),

is backward Euler over part of the increment from a committed state in which flow has gone on over a share of the last increment.
Laws answer as they do, from there. It damps as backward Euler does (it is L-stable), and where flow begins, ends or turns at once
it errs by half an increment at most either way, where backward Euler always errs the same way.

How far the answers of the two rules differ, as a share of the flow of the increment, is known after each increment without
another solution (`unsteadiness`): where metal streams through a tool and its points begin and end to flow, it is large.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from prensa.system.assembly import Block
from prensa.system.state import State
from prensa.types import Array

STABLE_RATIO = 1.0 + math.sqrt(2.0)  # of increments, up to which errors do not grow (Grigorieff 1983)


class TimeRule(NamedTuple):
    """``share`` of the last plastic strain that an increment begins with, ``part`` of the increment in which the rest flows."""

    share: float = 0.0
    part: float = 1.0

    @classmethod
    def of(cls, dt: float, last: float) -> TimeRule:
        """For an increment dt after one of length ``last`` in its step; backward Euler if that is 0 (none) or far shorter."""
        # Without an increment before there is no flow to go on with; after a much shorter one errors would grow.
        if not last > 0.0 or dt > STABLE_RATIO * last:
            return cls()
        ratio = dt / last
        return cls(ratio * ratio / (1.0 + 2.0 * ratio), (1.0 + ratio) / (1.0 + 2.0 * ratio))

    def seconds(self, block: Block, dt: float) -> float:
        """In which a block's law answers with plastic strain, of dt."""
        # Rates of strain are those of the flow that is left to the law, in the part of the increment that it has.
        return self.part * dt if self.part != 1.0 and block.flows else dt

    def begun(self, block: Block, history: Array) -> Array:
        """The history (m, q, h) that a block's law begins with: the committed one, if no flow is shifted."""
        if not block.flows or not self.share:
            return history
        law: Any = block.law
        begun = law.begin(block.at_law(history).reshape(-1, law.size), self.share).reshape(*history.shape[:2], -1)
        if law.size == history.shape[-1]:
            return np.asarray(begun)
        out = history.copy()
        out[..., : law.size] = begun
        return out


def all_follow(blocks: Sequence[Block]) -> bool:
    """Whether there is plastic flow, and all of it follows a `TimeRule`."""
    plastic = [b for b in blocks if b.law.plastic]
    return bool(plastic) and all(b.flows for b in plastic)


def growths(blocks: Sequence[Block], new: Sequence[Array], old: Sequence[Array]) -> list[Array | None]:
    """Growth (m, q) of the equivalent plastic strain of each block between two histories; None of one that does not flow."""
    out: list[Array | None] = []
    for k, block in enumerate(blocks):  # those of condensed bodies are computed when somebody looks at them
        strains = [block.field(h[k], "plastic_strain")[..., 0] for h in (new, old)] if block.law.plastic else None
        out.append(None if strains is None else strains[0] - strains[1])
    return out


def unsteadiness(
    state: State, dt: float, rule: TimeRule, begun: Sequence[Array], blocks: Sequence[Block], grown: Sequence[Array | None]
) -> float:
    """How much plastic flow changed in an increment dt from a committed state, per time of the step.

    ``begun``: histories with which the blocks' laws began by the ``rule``; ``grown``: plastic strain since, see `growths`.

    Answers of first and second order with the same rate of flow at the end, h ė and share Δε̄_n + part h ė, differ by
    ρ/(1 + ρ) |Δε̄ − ρ Δε̄_n|. Its integral over the bodies, over that of Δε̄ (equivalent plastic strains), is what first order
    errs by in an increment, in proportion to its length. 0 in the first increment of a step and where nothing flows.
    """
    last, apart, all_flow = state.dt_last, 0.0, 0.0
    if not last > 0.0:
        return 0.0
    ratio = dt / last
    for block, was, start, flow in zip(blocks, state.history, begun, grown):
        if flow is None or not block.flows:
            continue
        # what an increment of first order begins with knows nothing of the last flow
        after, share = (start, rule.share) if rule.share else (TimeRule(1.0).begun(block, was), 1.0)
        before = (block.field(after, "plastic_strain") - block.field(was, "plastic_strain"))[..., 0] / share
        apart += float(np.sum(block.volume * np.abs(flow - ratio * before)))
        all_flow += float(np.sum(block.volume * flow))
    return ratio / (1.0 + ratio) * apart / (all_flow * dt) if all_flow > 0.0 else 0.0


BACKWARD_EULER = TimeRule()
