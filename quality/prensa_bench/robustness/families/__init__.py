"""Families of random problems: a module each, whose ``problem`` draws one from a generator of random numbers."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping

import numpy as np

from prensa_bench.robustness.drawn import Drawn
from prensa_bench.robustness.families import (
    chains,
    cycles,
    forgings,
    ironings,
    loaded,
    posed,
    rolls,
    setups,
    slender,
    slide_release,
    space,
    strips,
    thin,
    tied,
    wide,
)

FAMILIES: Mapping[str, Callable[[np.random.Generator], Drawn]] = {
    "strips": strips.problem,
    "slide_release": slide_release.problem,
    "cycles": cycles.problem,
    "chains": chains.problem,
    "tied": tied.problem,
    "rolls": rolls.problem,
    "thin": thin.problem,
    "slender": slender.problem,
    "wide": wide.problem,
    "forgings": forgings.problem,
    "posed": posed.problem,
    "loaded": loaded.problem,
    "ironings": ironings.problem,
    "space": space.problem,
    "setups": setups.problem,
}


def drawn(family: str, seed: int, number: int) -> Drawn:
    """Problem *number* of a family: the same for the same arguments, whatever other families there are."""
    return FAMILIES[family](np.random.default_rng([seed, number, zlib.crc32(family.encode())]))
