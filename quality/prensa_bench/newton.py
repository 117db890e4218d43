"""Newton's iteration in space: its order, what GMRES costs it, first contacts and starts of sliding.

    python -m prensa_bench.newton                      # examples in space and 24 random problems: the table
    python -m prensa_bench.newton --count 40 --seed 8117 --seed 4242 --only random
    python -m prensa_bench.newton --table              # run nothing, print what was measured

Each problem is solved by a direct solver, by GMRES with factors of the symmetric part and with multigrid, and once more by the
direct solver without old factors, in which every iteration is Newton's: its residuals show the order. Random ones are solved in
three long increments a step, too. Every run is a line of a file (``--to``, results/newton.jsonl); what is there is not run again.
"""

from __future__ import annotations

import argparse
import json
import logging
import math
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any, cast

import prensa as pr
from prensa.errors import PrensaError
from prensa.model.problem import SPATIAL_SOLVERS, Numerics
from prensa.result.increment import Increment
from prensa.solver.reporting import Messages
from prensa_bench.robustness.families import drawn

EXAMPLES: dict[str, tuple[int, ...]] = {
    "square_billet": (), "ball_indentation": (14, 5, 7), "vickers": (9, 9, 9), "square_head": (4, 13, 6), "bar_rolling": (),
    "snap_hook": (),
}  # fmt: skip
"""Examples in space, and the elements along the axes where fewer than those of the example do: all ways take minutes then."""
DIRECT, PURE, IN_FEW = "direct", "pure", "long"
WAYS: dict[str, dict[str, Any]] = {
    DIRECT: {"solver": "rslab"},
    PURE: {"solver": "rslab", "reuse_factors": False},
    **{way: {"solver": way} for way in SPATIAL_SOLVERS},
    IN_FEW: {"solver": "rslab"},
}
LONG_INCREMENTS = 3  # of a step, where random problems are solved in few
ITERATES = 5  # residuals of an increment from which its order is read: those of at least four iterations


@dataclass(frozen=True)
class Solved:
    """An increment: its step, iterations and cuts; residuals, round-off and changed points of the iterates that it ends with.

    ``closed``: contact points that are closed after it.
    """

    step: str
    iterations: int
    cuts: int
    closed: int
    residuals: list[float]
    round_off: list[float]
    changes: list[int]


@dataclass
class Row:
    """A problem solved in one of the `WAYS`; ``failed``: why it did not reach its end, '' if it did."""

    problem: str
    way: str
    failed: str = ""
    increments: list[Solved] = field(default_factory=list)

    @property
    def iterations(self) -> int:
        """Of the whole run, rejected attempts included."""
        return sum(i.iterations for i in self.increments)


# ------------------------------------------------------------------------------------------------------------------ figures


def order(i: Solved) -> float | None:
    """Order by the last three residuals above round-off between which no contact point changed; None where there are none."""
    r = i.residuals
    if len(r) < ITERATES or len(i.round_off) != len(r):
        return None
    end = max((k for k in range(len(r)) if r[k] > i.round_off[k]), default=0)
    if end < 2 or i.changes[end] or i.changes[end - 1] or not r[end] < r[end - 1] < r[end - 2]:
        return None
    return math.log(r[end] / r[end - 1]) / math.log(r[end - 1] / r[end - 2])


def first_contact(row: Row) -> int | None:
    """Iterations of the first increment that ends with closed points."""
    return next((i.iterations for i in row.increments if i.closed), None)


def starts(row: Row) -> list[int]:
    """Iterations of the first increments of all later steps in which contact stays: a tool slides, turns, rolls, goes back."""
    pairs = zip(row.increments, row.increments[1:])
    return [after.iterations for before, after in pairs if after.step != before.step and before.closed and after.closed]


# -------------------------------------------------------------------------------------------------------------------- runs


def posed(name: str) -> tuple[pr.Problem, Numerics]:
    """An example by its name, or ``SEED/NUMBER`` of the random family."""
    if "/" in name:
        seed, number = map(int, name.split("/"))
        d = drawn("space", seed, number)
        return d.problem, d.numerics
    case = pr.load(Path(__file__).parents[2] / "examples" / f"{name}.yaml")
    problem = case.problem
    if n := EXAMPLES[name]:
        bodies = {key: replace(b, mesh=replace(cast(Any, b.mesh), n=n)) for key, b in problem.bodies.items()}
        problem = replace(problem, bodies=bodies)
    return problem, case.numerics


@contextmanager
def round_off_noted(floors: list[float]) -> Iterator[None]:
    """A block in which round-off of every iterate, over what its residual is compared with, is added to ``floors``."""
    original = Messages.iteration

    def noted(self: Messages, state, plan, time, result, e) -> None:  # type: ignore[no-untyped-def]
        floors.append(e.floor / e.scale if e.scale > 0 else 0.0)
        original(self, state, plan, time, result, e)

    Messages.iteration = noted  # type: ignore[method-assign]
    try:
        yield
    finally:
        Messages.iteration = original  # type: ignore[method-assign]


def solved(name: str, way: str) -> Row:
    """A problem solved in one way."""
    problem, numerics = posed(name)
    if way == IN_FEW:
        problem = replace(problem, steps=tuple(replace(s, increments=LONG_INCREMENTS) for s in problem.steps))
    row, floors = Row(name, way), list[float]()
    with round_off_noted(floors):
        try:
            for inc in pr.solve(problem, replace(numerics, **WAYS[way])):
                row.increments.append(_kept(inc, floors))
                floors.clear()
        except PrensaError as error:
            row.failed = type(getattr(error, "reason", error)).__name__
    return row


def _kept(inc: Increment, floors: list[float]) -> Solved:
    s = inc.statistics
    closed = sum(int((c.pressure > 0).sum()) for c in inc.contacts.values())
    last = floors[-len(s.residuals) :] if s.residuals else []
    return Solved(inc.step, s.iterations, s.cutbacks, closed, list(s.residuals), last, list(s.changes))


def stored(to: Path) -> list[Row]:
    """Rows that have been measured."""
    lines = to.read_text(encoding="utf-8").splitlines() if to.exists() else []
    found = [json.loads(line) for line in lines]
    return [Row(**{**r, "increments": [Solved(**i) for i in r["increments"]]}) for r in found]


# ------------------------------------------------------------------------------------------------------------------- table


def lines(rows: Sequence[Row], group: str) -> list[str]:
    """Cells of the table for some problems."""
    by_way = {way: {r.problem: r for r in rows if r.way == way} for way in WAYS}
    direct = by_way[DIRECT]
    orders = [q for r in by_way[PURE].values() for i in r.increments if (q := order(i)) is not None]
    first = [n for r in direct.values() if (n := first_contact(r)) is not None]
    begun = [n for r in direct.values() for n in starts(r)]
    cells = [group, str(sum(len(r.increments) for r in direct.values())), _total(direct.values())]
    cells.append(f"{median(orders):.2f} ({len(orders)})" if orders else "")
    for way in SPATIAL_SOLVERS:
        both = [p for p in direct if p in by_way[way] and not (direct[p].failed or by_way[way][p].failed)]
        spent = [sum(of[p].iterations for p in both) for of in (by_way[way], direct)]
        cells.append(f"{spent[0] / spent[1]:.2f} ({len(both)})" if both and spent[1] else "")
    return [*cells, _most(first), _most(begun)]


def _total(rows: Collection[Row]) -> str:
    cuts = sum(i.cuts for r in rows for i in r.increments)
    failed = sum(bool(r.failed) for r in rows)
    return f"{sum(r.iterations for r in rows)}, {cuts}" + (f", {failed} not to the end" if failed else "")


def _most(counts: Sequence[int]) -> str:
    """The median and the largest of some counts, and how many there are."""
    return f"{median(counts):g}, {max(counts)} ({len(counts)})" if counts else ""


TABLE_HEAD = (
    "problems", "increments", "iterations, cuts", "order: median (increments)", "LDLᵀ over direct (problems)",
    "multigrid over direct", "first contact: median, most", "start of a later step: median, most",
)  # fmt: skip

GOALS = """Order: by the last three residuals above round-off, without old factors, of increments of four and more iterations in
which no contact point changed last. LDLᵀ, multigrid: Newton's iterations with GMRES over those with factors of the matrix, of
problems that end both ways. First contact: iterations of the first increment that ends with closed points; start of a later
step: of the first increment of a step with contact before and after it. In brackets how many there are. Goals: 1.8; 1.3; 8."""


def _titled(name: str) -> str:
    """An example, and its elements along the axes where they are not those of its file."""
    return " ".join([name, " × ".join(map(str, EXAMPLES[name]))]).strip()


def page(rows: Sequence[Row]) -> str:
    """The table of all rows: each example, all of them, the random problems, and these in long increments."""
    examples = [r for r in rows if "/" not in r.problem]
    drawn_ = [r for r in rows if "/" in r.problem]
    long_ = [replace(r, way=DIRECT) for r in drawn_ if r.way == IN_FEW]
    names = dict.fromkeys(r.problem for r in examples)
    groups = {_titled(name): [r for r in examples if r.problem == name] for name in names}
    groups |= {"all examples": examples, f"{len({r.problem for r in drawn_})} random": drawn_}
    groups |= {f"the same, {LONG_INCREMENTS} increments a step": long_}
    table = [TABLE_HEAD, ["---"] * len(TABLE_HEAD), *(lines(of, name) for name, of in groups.items() if of)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in table)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure what is missing and print the table."""
    parser = argparse.ArgumentParser(prog="python -m prensa_bench.newton", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=24, help="random problems of each seed")
    parser.add_argument("--seed", type=int, action="append", help="of random problems; repeatable (8117)")
    parser.add_argument("--only", choices=("examples", "random", *EXAMPLES))
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS))
    parser.add_argument("--table", action="store_true", help="run nothing, print what was measured")
    parser.add_argument("--to", type=Path, default=Path("results") / "newton.jsonl", help="where runs are kept")
    a = parser.parse_args(arguments)
    logging.getLogger("prensa").setLevel(logging.ERROR)
    names = [a.only] if a.only in EXAMPLES else [] if a.only == "random" else list(EXAMPLES)
    names += [] if a.only in ("examples", *EXAMPLES) else [f"{seed}/{k}" for seed in a.seed or [8117] for k in range(a.count)]
    a.to.parent.mkdir(parents=True, exist_ok=True)
    done = {(r.problem, r.way) for r in stored(a.to)}
    for name in names if not a.table else ():
        for way in a.ways:
            if (name, way) in done or (way == IN_FEW and "/" not in name):
                continue
            row = solved(name, way)
            with a.to.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(row)) + "\n")
            most = max((i.iterations for i in row.increments), default=0)
            print(f"{name}, {way}: {row.iterations} iterations, most {most} {row.failed}", flush=True)
    print(page(stored(a.to)))


if __name__ == "__main__":
    main()
