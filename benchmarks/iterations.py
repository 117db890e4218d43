"""The tables of iterations in docs/guide/convergence.md: ``python benchmarks/iterations.py`` prints them.

Newton on default settings beside the founding paper's iteration, with and without what helps it here; and Newton with large
penalties in one increment. Counts, not times.
"""

from __future__ import annotations

from collections.abc import Iterator

import prensa as pr
from prensa.errors import SolveError
from prensa.verify.enforcement import enforced
from prensa.verify.forming import upsetting
from prensa.verify.friction import incline, partial_slip, plate

PAPERS = pr.Penalty(9e4, 9e5)  # k_n = 1e10 and k_T = 1e11 of the founding paper on its mesh
ENOUGH = 1000
WAYS = {
    "Newton": pr.Numerics(),
    "paper's": pr.Numerics(iteration="paper"),
    "paper's alone": pr.Numerics(iteration="paper", line_search=False, predictor=False, reuse_factors=False),
}


def problems() -> Iterator[tuple[str, pr.Problem]]:
    """Name and problem of each row."""
    for mu in (1.0, 0.3):
        yield f"plate, μ = {mu:g}", plate(32, 1.0, mu)
    yield "block on an incline, μ = 0.3", incline(0.3, 1.0)
    for mu in (0.1, 0.3):
        yield f"upsetting to 20 %, μ = {mu:g}", upsetting((16, 12), mu, reductions=(0.1, 0.2))
    yield "partial slip", partial_slip((64, 20), 0.05, 1.0)


def spent(problem: pr.Problem, numerics: pr.Numerics) -> str:
    """Iterations (and cut-backs) of a problem, or that it failed."""
    iterations = cuts = 0
    try:
        for inc in pr.solve(problem, numerics):
            iterations += inc.statistics.iterations
            cuts += inc.statistics.cutbacks
            if iterations > ENOUGH:
                return f"over {ENOUGH}"
    except SolveError:
        return "fails"
    return f"{iterations} ({cuts})" if cuts else f"{iterations}"


def main() -> None:
    """Print both tables."""
    print(f"| problem | enforcement | {' | '.join(WAYS)} |\n|---|---|{'---|' * len(WAYS)}")
    for name, problem in problems():
        for words, law in (("penalty", pr.Penalty()), ("β = 9e4", PAPERS), ("exact", pr.Exact())):
            row = [spent(enforced(problem, law), numerics) for numerics in WAYS.values()]
            print(f"| {name} | {words} | {' | '.join(row)} |", flush=True)
    print("\n| β, β_T | iterations |\n|---|---|")
    uncut = pr.Numerics(max_cutbacks=0)
    for words, law in (
        ("100, 3", pr.Penalty(100.0)), ("1000, 3", pr.Penalty(1e3)), ("1e5, 3", pr.Penalty(1e5)),
        ("1e5, 1e4", pr.Penalty(1e5, 1e4)), ("exact", pr.Exact()),
    ):  # fmt: skip
        print(f"| {words} | {spent(enforced(plate(48, 1.0, 1.0), law), uncut)} |", flush=True)


if __name__ == "__main__":
    main()
