"""Plan of a sweep: every combination of the values given, and at each of them the same samples of what scatters."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from prensa.errors import PrensaError
from prensa.study.values import MOST_CASES, Factor, Scatter, Values

Sampling = Literal["sobol", "lhs", "random"]
SAMPLINGS: tuple[Sampling, ...] = ("sobol", "lhs", "random")
DEFAULT_SAMPLES = 64  # cases of a scattered plan that does not say how many


@dataclass(frozen=True)
class Point:
    """One case of a sweep: ``values`` (YAML text) of every factor, and the number of its sample where something scatters."""

    values: dict[str, str]
    sample: int | None = None

    @property
    def changes(self) -> list[str]:
        """The changes ``path=value`` that make the case."""
        return [f"{path}={text}" for path, text in self.values.items()]


@dataclass(frozen=True)
class Plan:
    """What a sweep is asked for: factors (unique paths), and how what scatters among them is sampled."""

    factors: tuple[Factor, ...]
    samples: int | None = None
    sampling: Sampling = "sobol"
    seed: int = 0

    def __post_init__(self) -> None:
        paths = [f.path for f in self.factors]
        twice = [p for k, p in enumerate(paths) if p in paths[:k]]
        if twice:
            raise PrensaError(f"{twice[0]!r} is given twice; write all its values at once, separated by commas")
        if self.sampling not in SAMPLINGS:
            raise PrensaError(f"unknown sampling {self.sampling!r}; known: {', '.join(map(repr, SAMPLINGS))}")
        if self.samples is not None:
            self._check_samples(self.samples)
        if self.count > MOST_CASES:
            raise PrensaError(f"{self.count} cases; at most {MOST_CASES} are taken: give fewer values")

    def _check_samples(self, n: int) -> None:
        if not self.scattered:
            raise PrensaError(
                f"{n} samples are asked for and nothing is scattered; give a distribution such as mu=normal(0.1, 0.01)"
            )
        if n < 2:
            raise PrensaError(f"{n} samples; give at least 2")
        if n > MOST_CASES:
            raise PrensaError(f"{n} samples; at most {MOST_CASES} are taken")
        if self.sampling == "sobol" and n & (n - 1):
            low = 1 << (n.bit_length() - 1)
            message = f"{n} samples; a Sobol sequence is balanced at powers of two: give {low} or {2 * low}, or another"
            raise PrensaError(f"{message} sampling (lhs, random)")

    @property
    def scattered(self) -> list[Scatter]:
        """The factors that scatter."""
        return [f for f in self.factors if isinstance(f, Scatter)]

    @property
    def varied(self) -> list[Values]:
        """The factors that take given values."""
        return [f for f in self.factors if isinstance(f, Values)]

    @property
    def number_of_samples(self) -> int:
        """Samples at each combination of values; 1 where nothing scatters."""
        return (self.samples or DEFAULT_SAMPLES) if self.scattered else 1

    @property
    def count(self) -> int:
        """Number of cases."""
        total = self.number_of_samples
        for f in self.varied:
            total *= len(f.texts)
        return total

    def points(self) -> Iterator[Point]:
        """The cases, the last factor first to change; samples change fastest of all."""
        # The same samples at every combination: differences between combinations are not blurred by chance.
        rows = self._sampled()
        for combination in itertools.product(*(f.texts for f in self.varied)):
            given = dict(zip((f.path for f in self.varied), combination))
            for number, row in enumerate(rows):
                found = given | row
                yield Point({f.path: found[f.path] for f in self.factors}, number if self.scattered else None)

    def _sampled(self) -> list[dict[str, str]]:
        laws = self.scattered
        if not laws:
            return [{}]
        shares = unit_samples(self.sampling, self.number_of_samples, len(laws), self.seed)
        columns = [law.at(shares[:, k]) for k, law in enumerate(laws)]
        return [dict(zip((law.path for law in laws), row)) for row in zip(*columns)]


def unit_samples(sampling: Sampling, count: int, dimensions: int, seed: int) -> np.ndarray:
    """Samples (count, dimensions) of the unit cube: the first ones of more Sobol or random samples are these."""
    from scipy.stats import qmc

    if sampling == "random":
        return np.random.default_rng(seed).random((count, dimensions))
    engine: Sequence[type] = (qmc.Sobol, qmc.LatinHypercube)
    return np.asarray(engine[sampling == "lhs"](dimensions, seed=seed).random(count))
