"""The suite of wear laws."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.friction.wear_law import Sliding, WearLaw
from prensa.testing.common import TRIALS, raise_if_wrong


def check_wear(law: WearLaw, *, pressure: float = 500.0, speed: float = 50.0, seed: int = 0) -> None:
    """Check a wear law at random pressures and speeds.

    Parameters
    ----------
    law
        The law, a `WearLaw`.
    pressure, speed
        Sizes of the pressures (stress) and speeds of slip (length per second) at which it is tried.
    seed
        Of the random numbers.

    Raises
    ------
    LawError
        Saying what is wrong: wear that is not a number, negative or of the wrong shape, that is there without pressure or slip,
        that changes from call to call or with the company of other places; states that are written to.

    """
    rng = np.random.default_rng(seed)
    at = Sliding(pressure * rng.uniform(0.0, 2.0, TRIALS), speed * rng.uniform(0.0, 2.0, TRIALS))
    raise_if_wrong(f"wear law {law!r}", list(_wrong(law, at)))


def _wrong(law: WearLaw, at: Sliding) -> Iterator[str]:
    copies = [a.copy() for a in at]
    found = np.array(law.rate(at), dtype=np.float64)
    if found.shape != at.pressure.shape:
        yield f"its rate has the shape {found.shape} for {len(at.pressure)} places; it must have one number a place"
        return
    if not np.isfinite(found).all():
        k = int(np.argmin(np.isfinite(found)))
        yield f"its rate is not a finite number at the pressure {at.pressure[k]:g} and the speed {at.speed[k]:g}"
        return
    if (found < 0.0).any():
        yield "its rate is negative: tools do not grow"
    if any(not np.array_equal(a, b) for a, b in zip(copies, at)):
        yield "it writes to the pressures or speeds that it is given; make new arrays"
    if not np.array_equal(found, law.rate(at)):
        yield "its answer changes from call to call; a law must be pure"
    some = np.arange(0, len(found), 3)
    if not np.array_equal(found[some], law.rate(Sliding(at.pressure[some], at.speed[some]))):
        yield "its answer at a place depends on which other places are asked for with it"
    none = np.zeros_like(at.pressure)
    for name, still in (("pressure", Sliding(none, at.speed)), ("slip", Sliding(at.pressure, none))):
        if np.any(np.array(law.rate(still)) != 0.0):
            yield f"it wears without {name}"
