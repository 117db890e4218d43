"""Derivatives by random parameters of random problems, against differences of whole runs at the same times.

Runs beside, with a parameter a little larger or smaller, know nothing of derivatives. Where a point lands or opens just then
a force has a corner over the parameter, and the derivative is that of one side: each side is a difference of its own. How good a
difference is tells the one with another step.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

import prensa as pr
from prensa.errors import PrensaError
from prensa.result.increment import Increment
from prensa.sensitivity.parameters import numbers, value_of, with_values
from prensa.system.discretise import discretise
from prensa.types import Array
from prensa.verify.table import heard
from prensa_bench.robustness.files import OutOfTime, ending
from prensa_bench.robustness.increments import ENFORCEMENTS, reason_of
from prensa_bench.robustness.outcome import Outcome

PARAMETERS = 3
"""That are drawn for a problem …"""
TRIED = 8
"""… from so many at most: some have no derivative in it."""
STEPS = (1e-4, 1e-5, 1e-6, 1e-7)
"""Over the size of a parameter, of differences."""
ALIKE = 1e-4
"""Share of the largest slope, or of `ROUNDED_OFF` of what it is of, over the parameter, by which derivatives may be off …"""
ROUNDED_OFF = 1e-2
UNSURE = 3.0
"""… beside so many times what differences with two steps differ by."""
AT_CORNERS = 0.02
"""Share of the numbers of a run that may miss them: where several points switch at once no difference is one of a branch."""
SLOPES_LIMIT = 120.0
"""Of processor time, for all runs of a problem."""


class _Runs:
    """Runs of one problem, whose processor time ends together."""

    def __init__(self, problem: pr.Problem, numerics: pr.Numerics) -> None:
        self.problem, self.numerics = problem, replace(numerics, threads=1)
        self.dofs = 2 * discretise(problem).nodes
        self.watch = ending(time.process_time() + SLOPES_LIMIT)

    def increments(self, times: list[float] | None = None, paths: list[str] | None = None) -> list[Increment]:
        """Of the problem itself, with derivatives."""
        return list(pr.solve(self.problem, self.numerics, monitor=self.watch, times=times, derivatives=paths or []))

    def read(self, increment: Increment) -> list[float]:
        """Forces of all tools, and a sum of all displacements in which each counts differently."""
        forces = [f for tool in increment.tools for f in (increment.force(tool).x, increment.force(tool).y)]
        u = increment.state.u[: self.dofs]
        return [*forces, float(np.cos(1.0 + np.arange(len(u))) @ u)]

    def sizes(self, run: list[Increment]) -> Array:
        """The largest of the forces of a run, and of its displacements, for each number that is read."""
        forces = max(float(np.abs(self.read(i)[:-1]).max(initial=0.0)) for i in run)
        displacements = max(float(np.abs(i.state.u[: self.dofs]).max()) for i in run)
        return np.append(np.full(len(self.read(run[-1])) - 1, forces), displacements)

    def beside(self, path: str, value: float, times: list[float]) -> Array | None:
        """What is read of a run (increments, numbers) with another value of a parameter; None where it fails."""
        finely = replace(self.numerics, tolerance=min(self.numerics.tolerance, 1e-12))
        try:
            other = with_values(self.problem, {path: value})
            return np.array([self.read(i) for i in pr.solve(other, finely, monitor=self.watch, times=times)])
        except PrensaError:
            return None


def with_slopes(problem: pr.Problem) -> pr.Problem:
    """The problem on one mesh, with other contacts for augmented ones: those and new meshes have no derivative."""

    def with_one(contact: pr.Contact) -> pr.Contact:
        if not contact.enforcement.max_updates:
            return contact
        # exact ones want no more points than there are nodes
        return replace(contact, enforcement=ENFORCEMENTS["exact" if contact.integration == "nodal" else "penalty"])

    return replace(problem, contacts=[with_one(c) for c in problem.contacts], remesh="off")


def judge_slopes(problem: pr.Problem, numerics: pr.Numerics, kind: str, seed: int, number: int) -> Outcome:
    """Draw parameters of a problem, and compare derivatives by them with differences."""
    begun = time.process_time()
    try:
        status, words, reason = _verdict(_Runs(with_slopes(problem), numerics), np.random.default_rng([seed, number, 7]))
    except OutOfTime:
        status, words, reason = "time", f"not ended after {SLOPES_LIMIT:g} s", ""
    except PrensaError as error:
        status, words, reason = "reported", str(error), reason_of(error)
    except Exception as error:
        status, words, reason = "wrong", f"crashed: {type(error).__name__}: {error}", "Crashed"
    return Outcome(number, f"{number}: {kind}", status, words, seconds=time.process_time() - begun, reason=reason)


def _verdict(runs: _Runs, rng: np.random.Generator) -> tuple[str, str, str]:
    times = [i.time for i in runs.increments()]
    known = [path for path, value in numbers(runs.problem).items() if value != 0.0]
    paths, refused = [], "no number of it can be varied"
    for path in map(str, rng.permutation(known)[:TRIED]):
        try:
            next(pr.solve(runs.problem, runs.numerics, monitor=runs.watch, times=times, derivatives=[path]))
            paths.append(path)
        except PrensaError as error:
            refused = str(error)
        if len(paths) == PARAMETERS:
            break
    if not paths:
        return "reported", refused, "Refused"
    with heard() as doubts:
        run = runs.increments(times, paths)
    slopes = _slopes(runs, run, paths)
    # where several points land at once there are more sides than two, and derivatives say that points are at kinks
    at_once = any(i.derivatives is not None and sum(i.derivatives.at_kinks.values()) > 1 for i in run)
    wrong, doubted, alone = list[str](), list[str](), list[str]()
    for k, path in enumerate(paths):
        share = _missed(runs, run, path, slopes[:, :, k], times)
        if share is None:
            alone.append(path)
        elif share > AT_CORNERS:
            reported = at_once or any(f"the derivative by {path} is not exact" in words for words in doubts)
            (doubted if reported else wrong).append(f"by {path} {share:.0%} of the numbers miss all differences")
    if wrong:
        return "wrong", "; ".join(wrong), ""
    if doubted:
        return "reported", "; ".join(doubted), "NotExact"
    uncompared = f"(runs beside by {', '.join(alone)} failed)" if alone else ""
    return ("reported", uncompared, "NotCompared") if alone == paths else ("right", uncompared, "")


def _slopes(runs: _Runs, run: list[Increment], paths: list[str]) -> Array:
    """Derivatives (increments, numbers, paths) of what is read."""
    count = len(runs.read(run[-1]))
    each = [[i.derivative(lambda i, k=k: runs.read(i)[k]) for k in range(count)] for i in run]  # type: ignore[misc]
    return np.array([[[by[p] for p in paths] for by in numbers] for numbers in each])


def _missed(runs: _Runs, run: list[Increment], path: str, slopes: Array, times: list[float]) -> float | None:
    """Share of the derivatives (increments, numbers) by a parameter that are none of the differences; None if there are none."""
    value = value_of(runs.problem, path)
    here = runs.beside(path, value, times)
    if here is None:
        return None
    sizes = runs.sizes(run)
    right = np.zeros(slopes.shape, dtype=bool)
    before: list[Array | None] = [None, None, None]
    for step in STEPS:
        ends = [runs.beside(path, value * (1.0 + sign * step), times) for sign in (1.0, -1.0)]
        sides = [None if end is None else (end - here) / (sign * step * value) for end, sign in zip(ends, (1.0, -1.0))]
        both = None if sides[0] is None or sides[1] is None else 0.5 * (sides[0] + sides[1])
        for k, found in enumerate((*sides, both)):
            coarser = before[k]
            before[k] = found
            if found is None or coarser is None:
                continue
            scale = np.maximum(np.abs(found).max(axis=0), ROUNDED_OFF * sizes / abs(value))
            right |= np.abs(found - slopes) <= ALIKE * scale + UNSURE * np.abs(found - coarser)
        if right.all():
            return 0.0
    return None if all(found is None for found in before) else float(1.0 - right.mean())
