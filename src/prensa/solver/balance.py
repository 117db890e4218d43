"""Increments as short as their work is accurate: the energy balance controls their length."""

from __future__ import annotations

from collections.abc import Callable

from prensa.model.press import works
from prensa.model.problem import Problem
from prensa.result.presses import use_of
from prensa.solver.until import Outcome

Missing = Callable[[Outcome], float]


def blow_energy(problem: Problem, number: int) -> float:
    """Least energy of the blows that end step *number* (from 0), of the modelled part; 0 where none does."""
    until = problem.steps[number].until if number < len(problem.steps) else None
    if until is None:
        return 0.0
    given = []
    for tool in works(problem):
        use = use_of(problem, tool)
        if use is not None and tool in (*until.energy, *until.press):
            given.append(use.energy(number) / use.energies)
        elif tool in until.energy:
            given.append(until.energy[tool])
    return min(given, default=0.0)


def balanced(
    outcome: Outcome, solve: Callable[[float], Outcome], missing: Missing, allowed: float, shortest: float | None = None
) -> Outcome:  # fmt: skip
    """An increment, or a shorter one from the same state, whose balance misses no more than is *allowed* (energy).

    The work of a tool is the trapezoid of its forces at both ends. Where metal begins to flow within the increment, or what
    carries a tool passes from some nodes to others, the force is far from a straight line; plastic and elastic energy, which the
    material points know for themselves, show by how much.

    ``shortest``: what no increment need be shorter than. Down to it, halves are taken even if they miss no less, for the force
    may rise and fall again near the beginning. Without it a half has to miss less than half as much, or the length stays: what
    is missing in proportion to the length is no error of it (the virtual work of `q4_fbar` is not that of its stresses).
    """
    off = abs(missing(outcome))
    while off > allowed:
        c = outcome[0]
        if shortest is not None and 0.5 * c.dt < shortest:
            break
        half = solve(c.state.clock.time + 0.5 * c.dt)
        if not half[1].converged:
            break
        left = abs(missing(half))
        if shortest is None and left > 0.5 * off:  # of the trapezoid an eighth would be left, a quarter at a kink
            break
        outcome, off = half, left
    return outcome
