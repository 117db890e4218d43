"""Increments of a blow: as short as its work is accurate, which says when the blow is over."""

from __future__ import annotations

from collections.abc import Callable

from prensa.model.press import use_of, works
from prensa.model.problem import Problem
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


def balanced(outcome: Outcome, solve: Callable[[float], Outcome], missing: Missing, allowed: float) -> Outcome:
    """An increment of a blow, or a shorter one from the same state, whose balance misses no more than is *allowed* (energy).

    The work of a tool is the trapezoid of its forces at both ends. Where metal begins to flow within the increment the force
    rises steeply at first, then hardly any more, and the trapezoid has less than was done; plastic and elastic energy, which the
    material points know for themselves, show by how much. What is missing in proportion to the length is no error of it (the
    virtual work of `q4_fbar` is not that of its stresses): then the length stays.
    """
    off = abs(missing(outcome))
    while off > allowed:
        c = outcome[0]
        half = solve(c.state.clock.time + 0.5 * c.dt)
        if not half[1].converged:
            break
        left = abs(missing(half))
        if left > 0.5 * off:  # in proportion to the length; of the trapezoid an eighth would be left, a quarter at a kink
            break
        outcome, off = half, left
    return outcome
