"""Value of mechanisms from the records of runs with them and without: failures, wrong answers, cuts, iterations, time."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from prensa.types import Array
from prensa_bench.panel.mechanisms import MECHANISMS
from prensa_bench.panel.problems import GROUPS
from prensa_bench.panel.running import RUN_ENDED, Record

SAME_FORCES = 0.02  # allowed difference of a tool's force from that with everything on, of the largest of the run
KEPT_TABLE = Path(__file__).parents[2] / "MECHANISMS.md"
Records = Mapping[tuple[str, tuple[str, ...]], Record]


@dataclass
class Worth:
    """What came of a group of problems with something off, beside what came of the same with everything on.

    ``failed`` and ``cuts``: (on, off); ``lost``: problems that fail with it off alone, with the reason; ``wrong``: names of those
    whose forces differ by more than `SAME_FORCES`; ``apart``: the largest such difference. ``iterations``, ``seconds``: off over
    on, of the problems that ended both ways (nan: none did).
    """

    problems: int
    failed: tuple[int, int]
    lost: list[str]
    wrong: list[str]
    apart: float
    cuts: tuple[int, int]
    iterations: float
    seconds: float

    def __str__(self) -> str:
        parts = [f"of {self.problems}"]
        parts += [f"failures {self.failed[0]} → {self.failed[1]}{_listed(self.lost)}"] if any(self.failed) else []
        parts += [f"wrong {len(self.wrong)}{_listed(self.wrong)}, by up to {self.apart:.1%}"] if self.wrong else []
        parts += [f"cuts {self.cuts[0]} → {self.cuts[1]}"]
        parts += [f"iterations {self.iterations - 1:+.1%}, time {self.seconds - 1:+.0%}"] if self.iterations > 0 else []
        return ", ".join(parts)


def _listed(names: Sequence[str]) -> str:
    return f" ({', '.join(names)})" if names else ""


def worth(records: Records, off: Sequence[str], names: Iterable[str]) -> Worth | None:
    """What it is worth to have some mechanisms on, for those of the named problems that were run both ways; None if none was."""
    keys = [((n, ()), (n, tuple(sorted(off)))) for n in names]
    pairs = [(records[on], records[other]) for on, other in keys if on in records and other in records]
    if not pairs:
        return None
    ended = [(on, other) for on, other in pairs if on.status == other.status == RUN_ENDED]
    differences = {on.problem: difference(on, other) for on, other in pairs}

    def ratio(values: list[tuple[float, float]]) -> float:
        return sum(b for _, b in values) / sum(a for a, _ in values) if values else math.nan

    return Worth(
        len(pairs),
        (sum(on.status != RUN_ENDED for on, _ in pairs), sum(other.status != RUN_ENDED for _, other in pairs)),
        [
            f"{on.problem}: {other.reason or other.status}"
            for on, other in pairs
            if on.status == RUN_ENDED != other.status
        ],
        [name for name, d in differences.items() if d > SAME_FORCES],
        max(differences.values()),
        (sum(on.cuts for on, _ in ended), sum(other.cuts for _, other in ended)),
        ratio([(on.iterations, other.iterations) for on, other in ended]),
        ratio([(min(on.seconds), min(other.seconds)) for on, other in ended]),
    )


def difference(on: Record, other: Record) -> float:
    """Largest difference of the forces at the times that both runs reached, over the largest force with everything on."""
    common = sorted(on.forces.keys() & other.forces.keys(), key=float)
    if not common:
        return 0.0
    largest = max(_sizes(f).max() for f in on.forces.values())
    apart = max(_sizes(np.subtract(on.forces[t], other.forces[t])).max() for t in common)
    return float(apart / largest) if largest > 0 else 0.0


def _sizes(forces: ArrayLike) -> Array:
    """Sizes (tools,) of forces given as (fx, fy, m) of each."""
    f = np.asarray(forces, dtype=np.float64).reshape(-1, 3)
    return np.asarray(np.hypot(f[:, 0], f[:, 1]))


def in_words(records: Records, off: Sequence[str], groups: Mapping[str, Sequence[str]]) -> str:
    """What some mechanisms are worth in each group; 'not measured' where nothing was run."""
    found = {g: worth(records, off, groups[g]) for g in GROUPS}
    return "; ".join(f"{g}: {w}" for g, w in found.items() if w is not None) or "not measured"


# ------------------------------------------------------------------------------------------------- the table that is kept
@dataclass
class Row:
    """A row of the kept table."""

    name: str
    what: str
    worth: str
    command: str


HEAD = ("mechanism", "what it does", "what it is worth", "to measure it again")


def rows(text: str) -> list[Row]:
    """Rows of the tables of a page."""
    lines = [line for line in text.splitlines() if line.startswith("| `")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [Row(name.strip("`"), *rest) for name, *rest in cells]


def command(off: Sequence[str]) -> str:
    """How to measure some mechanisms again."""
    if len(off) == 1 and MECHANISMS[off[0]].guard:
        return f"`python -m prensa_bench.panel --guard {off[0]}`"
    return f"`python -m prensa_bench.panel --off {','.join(off)}`"


def renewed(text: str, measured: Mapping[str, str]) -> str:
    """The page with what has been ``measured`` by name, dated; rows that were not stay as they are."""
    today = datetime.date.today().isoformat()
    known = {row.name: row for row in rows(text)}
    out = []
    for line in text.splitlines():
        if not line.startswith("| `"):
            out.append(line)
            continue
        name = line.split("`")[1]
        row = known[name]
        if name in measured:
            row.worth = f"{today}: {measured[name]}"
        out.append(as_line(row))
    return "\n".join(out) + "\n"


def as_line(row: Row) -> str:
    """A row as Markdown."""
    return f"| `{row.name}` | {row.what} | {row.worth} | {row.command} |"
