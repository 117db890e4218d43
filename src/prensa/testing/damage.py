"""The suite of damage laws."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.materials.damage_law import DamageLaw, StressState
from prensa.testing.common import TRIALS, raise_if_wrong
from prensa.types import Array


def check_damage(law: DamageLaw, *, stress: float = 300.0, strain: float = 0.5, seed: int = 0) -> None:
    """Check a damage law at random stresses.

    Parameters
    ----------
    law
        The law, a `DamageLaw`.
    stress, strain
        Sizes of the equivalent stresses (stress) and plastic strains at which it is tried.
    seed
        Of the random numbers.

    Raises
    ------
    LawError
        Saying what is wrong: damage that is not a number or of the wrong shape, that falls though ``falls`` is not said, that
        changes from call to call, with the company of other points or without flow; states or damage that are written to.

    """
    rng = np.random.default_rng(seed)
    start, end = (_random(rng, stress, strain) for _ in range(2))
    end = end._replace(strain=start.strain + 0.1 * end.strain)
    before = rng.uniform(0.0, 1.0, TRIALS)
    raise_if_wrong(f"damage law {law!r}", list(_wrong(law, before, start, end)))


def _random(rng: np.random.Generator, stress: float, strain: float) -> StressState:
    """Plastic states of all stress ratios and both signs of the mean stress."""
    principal = -np.sort(-rng.normal(size=(TRIALS, 3)), axis=1)
    d = principal - principal.mean(axis=1, keepdims=True)
    size = stress * rng.uniform(0.5, 1.5, TRIALS) / np.sqrt(1.5 * (d**2).sum(axis=1))
    principal = size[:, None] * (d + rng.uniform(-1.0, 1.0, (TRIALS, 1)))
    return StressState(principal, size * np.sqrt(1.5 * (d**2).sum(axis=1)), strain * rng.uniform(0.1, 1.0, TRIALS))


def _wrong(law: DamageLaw, before: Array, start: StressState, end: StressState) -> Iterator[str]:
    copies = [a.copy() for a in (before, *start, *end)]
    grown = np.array(law.grown(before, start, end), dtype=np.float64)
    if grown.shape != before.shape:
        yield f"its damage has the shape {grown.shape} for {len(before)} points; it must have one number a point"
        return
    if not np.isfinite(grown).all():
        k = int(np.argmin(np.isfinite(grown)))
        yield f"its damage is not a finite number at the principal stresses {end.principal[k].tolist()}"
        return
    if any(not np.array_equal(a, b) for a, b in zip(copies, (before, *start, *end))):
        yield "it writes to the states or the damage that it is given; make new arrays"
    if not np.array_equal(grown, law.grown(before, start, end)):
        yield "its answer changes from call to call; a law must be pure"
    some = np.arange(0, len(before), 3)
    if not np.array_equal(grown[some], law.grown(before[some], start.of(some), end.of(some))):
        yield "its answer at a point depends on which other points are asked for with it"
    if not law.falls and (grown < before).any():
        yield "its damage falls; cut the integrand off at zero, or let 'falls' be true"
