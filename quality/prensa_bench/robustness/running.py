"""Families drawn and judged, one problem after the other or in several processes."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace

import prensa as pr
from prensa_bench.robustness.blocks import draw
from prensa_bench.robustness.drawn import Drawn
from prensa_bench.robustness.families import FAMILIES, drawn, instead
from prensa_bench.robustness.increments import AS_DRAWN, RERUN_EVERY, enforced, judge
from prensa_bench.robustness.judging import judge_files
from prensa_bench.robustness.outcome import Outcome, Tally
from prensa_bench.robustness.slopes import judge_slopes

BLOCKS = ("elastic", "plastic")


def known() -> tuple[str, ...]:
    """Names of all families."""
    return (*BLOCKS, *FAMILIES)


def judged(family: str, seed: int, number: int, enforcement: str = AS_DRAWN, slopes: bool = False) -> Outcome:
    """Draw and judge one problem, or derivatives of its first stage."""
    if family in BLOCKS:
        p = enforced(draw(family, seed, number), enforcement)
        return judge_slopes(p, pr.Numerics(), p.name, seed, number) if slopes else judge(p, number, number % RERUN_EVERY == 0)
    d = _enforced(drawn(family, seed, number), enforcement)
    if slopes:
        return judge_slopes(d.problem, d.numerics, d.kind, seed, number)
    return judge_files(d, number, instead=(_enforced(other, enforcement) for other in instead(family, seed, number)))


def _enforced(d: Drawn, enforcement: str) -> Drawn:
    twins = tuple(replace(t, problem=enforced(t.problem, enforcement)) for t in d.twins)
    return replace(d, stages=tuple(enforced(p, enforcement) for p in d.stages), twins=twins)


def run(
    suite: str, count: int, seed: int, report: Callable[[Tally, Outcome], None] = lambda *_: None, first: int = 0,
    enforcement: str = AS_DRAWN, jobs: int = 1, slopes: bool = False,
) -> Tally:  # fmt: skip
    """Draw and judge *count* problems of a family, beginning with number *first*.

    ``enforcement``: of all contacts, one of `ENFORCEMENTS`, or as drawn. ``slopes``: derivatives by parameters are judged.
    ``jobs`` > 1: in as many processes. Outcomes are in the order of their numbers, ``report`` sees them as they
    come, beside those before.
    """
    tally = Tally(suite, seed)
    for outcome in _outcomes(suite, range(first, first + count), seed, enforcement, jobs, slopes):
        tally.outcomes.append(outcome)
        report(tally, outcome)
    tally.outcomes.sort(key=lambda o: o.number)
    return tally


def _outcomes(
    suite: str, numbers: range, seed: int, enforcement: str, jobs: int, slopes: bool
) -> Iterator[Outcome]:  # fmt: skip
    if jobs <= 1 or len(numbers) <= 1:
        for number in numbers:
            yield judged(suite, seed, number, enforcement, slopes)
        return
    # a fresh interpreter each: the threads of a solver do not survive a fork
    with ProcessPoolExecutor(min(jobs, len(numbers)), multiprocessing.get_context("spawn")) as pool:
        ahead = [pool.submit(judged, suite, seed, number, enforcement, slopes) for number in numbers]
        for future in as_completed(ahead):
            yield future.result()
