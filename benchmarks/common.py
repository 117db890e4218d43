"""What the benchmarks share: the limit, the model problems, the machine in words."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import prensa as pr
from prensa.linear import factorisations
from prensa.policy import Policy
from prensa.system.system import System
from prensa.verify import example1
from prensa.verify.forming import upsetting


@dataclass
class Limit:
    """Processor seconds inside the linear solver alone: analyses, factorisations, substitutions; how many there were.

    ``columns``: right-hand sides of the substitutions with more than one. ``release``: what the solver takes to give the memory
    of factors back when they are dropped; whoever factors again and again pays it too, so that it is a part of the limit.
    """

    analysis: float = 0.0
    factorisation: float = 0.0
    substitution: float = 0.0
    release: float = 0.0
    analyses: int = 0
    factorisations: int = 0
    substitutions: int = 0
    columns: int = 0

    @property
    def seconds(self) -> float:
        """All of them."""
        return self.analysis + self.factorisation + self.substitution + self.release


class _Factors:
    """A backend's factors (``solve``): their substitutions are ``timed``, and what their release alone takes is ``told``."""

    def __init__(self, solve: Any, timed: Callable[..., Any], told: Callable[[float], None]) -> None:
        self.solve, self.timed, self.told = solve, timed, told

    def __call__(self, b: Any) -> Any:
        return self.timed(b, self.solve)

    def __getattr__(self, name: str) -> Any:
        """What else factors tell: whether they are ``positive``."""
        return getattr(self.solve, name)

    def __del__(self) -> None:
        start = time.process_time()
        del self.solve  # somebody who keeps factors keeps them longer: then nothing is released here
        self.told(time.process_time() - start)


@contextmanager
def limit() -> Iterator[Limit]:
    """Count what every backend of the linear solver spends; all else is prensa's own."""
    out, before = Limit(), dict(factorisations.BACKENDS)

    def timed(part: str, many: str, call: Callable[..., Any], *args: Any) -> Any:
        start = time.process_time()
        try:
            return call(*args)
        finally:
            setattr(out, part, getattr(out, part) + time.process_time() - start)
            setattr(out, many, getattr(out, many) + 1)

    def substituted(b: Any, solve: Any) -> Any:
        out.columns += b.shape[1] if b.ndim > 1 else 0
        return timed("substitution", "substitutions", solve, b)

    counting = True

    def released(seconds: float) -> None:
        out.release += seconds if counting else 0.0

    def wrapped(analyze: Any) -> Any:
        def begin(structure: Any) -> Any:
            factor = timed("analysis", "analyses", analyze, structure)

            def factored(values: Any) -> Any:
                return _Factors(timed("factorisation", "factorisations", factor, values), substituted, released)

            return factored

        return begin

    for name, analyze in before.items():
        factorisations.BACKENDS[name] = wrapped(analyze)
    try:
        yield out
    finally:
        counting = False  # factors that are dropped after the end are not of the time until then
        factorisations.BACKENDS.update(before)


def hertz(n: tuple[int, int], depth: float = 8.0) -> pr.Problem:
    """Cylinder on the block of the founding paper, neo-Hooke, to 8 mm (depth 0.5: the first increment alone)."""
    steps = tuple(example1.press(d, k) for d, k in ((0.5, 1), (1, 1), (4, 1), (8, 1)) if d <= depth)
    return example1.problem(n, "finite", "current", pr.NeoHooke(E=example1.E, nu=example1.NU), steps)


def sized(name: str, unknowns: int, depth: float = 8.0) -> pr.Problem:
    """``hertz`` or ``upsetting`` with about so many unknowns."""
    if name == "hertz":
        k = (unknowns / 2 / 42) ** 0.5
        return hertz((round(7 * k), round(6 * k)), depth)
    k = (unknowns / 2 / 12) ** 0.5
    return upsetting((round(4 * k), round(3 * k)), 0.1)


def elastic_history(n: tuple[int, int], increments: int) -> pr.Problem:
    """The block in small strain, linear elastic, with friction: everything but the contact is linear."""
    p = example1.problem(
        n, "small", "current", pr.Elastic(E=example1.E, nu=example1.NU), (example1.press(1.0, increments),)
    )
    return replace(p, friction=pr.Coulomb(0.2))


def warm(problem: pr.Problem, numerics: pr.Numerics | None = None) -> None:
    """Solve a small problem, so that loading the kernels is not counted."""
    for inc in pr.solve(problem, numerics):
        inc.bodies  # noqa: B018


@dataclass
class Cost:
    """Processor seconds of a history from its description on, and what was done for them."""

    unknowns: int
    increments: int
    iterations: int
    total: float
    limit: Limit

    @property
    def ratio(self) -> float:
        """Total over the factorisations and solves alone."""
        return self.total / self.limit.seconds

    @property
    def outside(self) -> float:
        """Seconds outside the linear solver."""
        return self.total - self.limit.seconds


def cost(
    problem: pr.Problem, numerics: pr.Numerics | None = None, most: int | None = None, policy: Policy | None = None
) -> Cost:
    """Solve a problem (its first ``most`` increments) and count."""
    with limit() as spent:
        start = time.process_time()
        system: System = pr.discretise(problem)
        increments = iterations = 0
        for inc in pr.solve(system, numerics, policy=policy):
            increments += 1
            iterations += inc.statistics.iterations
            if increments == most:
                break
        total = time.process_time() - start
    return Cost(system.ndof, increments, iterations, total, spent)


def machine() -> str:
    """Processor, cores, system, Python and packages in one line."""
    import os
    from importlib.metadata import PackageNotFoundError, version
    from pathlib import Path

    model = platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line.partition(":")[2].strip() for line in info.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    packages = []
    for name in ("numpy", "scipy", "numba", "rslab", "pypardiso"):
        try:
            packages.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return (
        f"{model}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}, "
        f"prensa {pr.__version__}, {', '.join(packages)}; OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'unset')}"
    )
