"""Ductile damage of committed states: what the damage laws of the bodies make of an increment. Nothing depends on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from prensa.contact.recovery import mises_of
from prensa.materials.damage_law import DamageLaw, StressState
from prensa.materials.plane_stress import PlaneStress
from prensa.materials.protocol import Material, Yielding
from prensa.model.problem import Problem
from prensa.system.assembly import Block
from prensa.system.mean_stress import with_continuous_mean
from prensa.types import Array


def any_damage(problem: Problem) -> bool:
    """Whether some body has damage laws."""
    return any(b.damage for b in problem.bodies.values())


def undamaged(problem: Problem, blocks: Sequence[Block]) -> tuple[Array, ...]:
    """D (m, q, laws) of blocks to which nothing has happened; () where no body has damage laws."""
    if not any_damage(problem):
        return ()
    return tuple(np.zeros((*b.volume.shape, len(problem.bodies[b.body].damage))) for b in blocks)


def stress_state(block: Block, x: Array, history: Array) -> StressState:
    """Of the points (m q,) of a block that flows, by a committed history (m, q, h), with the nodes of the system at x (n, d).

    Its mean stress is that of `prensa.system.mean_stress`.
    """
    law = block.law
    own = block.at_law(history).reshape(-1, law.size)
    stress = with_continuous_mean(block, x, law.cauchy(own))
    return StressState.at(stress, _equivalent(law, own, stress), block.field(history, "plastic_strain").ravel())


def damaged(
    problem: Problem, blocks: Sequence[Block], before: Sequence[Array], old: Sequence[Array], new: Sequence[Array],
    x: tuple[Array, Array],
) -> tuple[Array, ...]:  # fmt: skip
    """D (m, q, laws) by block after an increment between two committed states of histories ``old`` and ``new``.

    x: where the nodes (n, d) are in both.
    """
    out = []
    for number, (block, damage) in enumerate(zip(blocks, before)):
        laws: tuple[DamageLaw, ...] = problem.bodies[block.body].damage
        if not laws:
            out.append(damage)
            continue
        start, end = stress_state(block, x[0], old[number]), stress_state(block, x[1], new[number])
        grown = [law.grown(damage[..., k].ravel(), start, end).reshape(damage.shape[:2]) for k, law in enumerate(laws)]
        out.append(np.stack(grown, axis=-1))
    return tuple(out)


def _equivalent(law: Material, history: Array, stress: Array) -> Array:
    """σ̄ (n,) of the yield function of a law, von Mises' where it states none, at Cauchy stresses (n, 4|6)."""
    if isinstance(law, PlaneStress):
        law, history = law.law, np.ascontiguousarray(history[:, :-1])
    return law.equivalent_stress(history) if isinstance(law, Yielding) else mises_of(stress)
