"""Families of random problems: a module each, whose ``problem`` draws one from a generator of random numbers."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Mapping

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


SECOND_MESH: Mapping[str, Callable[[np.random.Generator], Drawn]] = {"space": space.on_two_meshes}
"""Families of which one problem in `ONE_IN` is solved on a second mesh too, and how that one is drawn."""
ONE_IN = 10
MOST_INSTEAD = 10  # problems drawn at most in the place of one that could not be compared


def drawn(family: str, seed: int, number: int) -> Drawn:
    """Problem *number* of a family: the same for the same arguments, whatever other families there are."""
    draw = SECOND_MESH[family] if on_second_mesh(family, seed, number) else FAMILIES[family]
    return draw(np.random.default_rng([seed, number, zlib.crc32(family.encode())]))


def on_second_mesh(family: str, seed: int, number: int) -> bool:
    """Whether a problem is the one of its `ONE_IN` that is solved on a second mesh too: the seed chooses it."""
    chooses = np.random.default_rng([seed, number // ONE_IN, zlib.crc32(f"second mesh of {family}".encode())])
    return family in SECOND_MESH and number % ONE_IN == chooses.integers(ONE_IN)


def instead(family: str, seed: int, number: int) -> Iterator[Drawn]:
    """Problems to compare where that of this number, solved on a second mesh, could not be; of other problems none."""
    if on_second_mesh(family, seed, number):
        for k in range(1, MOST_INSTEAD + 1):
            yield SECOND_MESH[family](np.random.default_rng([seed, number, zlib.crc32(family.encode()), k]))
