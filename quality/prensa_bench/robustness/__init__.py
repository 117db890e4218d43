"""Random problems on default settings, every answer checked, by families.

The families `elastic` and `plastic` (`prensa_bench.robustness.blocks`) put one body under one tool of any kind; their answers
are checked at every increment as the solver holds them. The others (`prensa_bench.robustness.families`) draw what forming
does: thin strips between binder, punch and die, sliding and release, cycles, chains of runs, tied bodies, rolls, thin
sheets, slender parts, the ends of the ranges of numbers, combinations posed in two ways, free bodies under forces, and ironing;
in space bodies under a tool (`space`), and under two tools, on springs and under loads (`setups`);
their answers are checked in the files that a run leaves, by code that shares nothing with the solver
(`prensa_bench.robustness.checks`).
"""

from __future__ import annotations

from prensa_bench.robustness.blocks import draw
from prensa_bench.robustness.families import FAMILIES, drawn
from prensa_bench.robustness.increments import (
    AS_DRAWN,
    BALANCE,
    ENFORCEMENTS,
    check,
    enforced,
    finer,
    judge,
    resolution,
    unbalanced,
)
from prensa_bench.robustness.outcome import VERDICTS, Outcome, Tally, bounds
from prensa_bench.robustness.page import collected, commit_seed, write
from prensa_bench.robustness.running import known, run

__all__ = [
    "AS_DRAWN", "BALANCE", "ENFORCEMENTS", "FAMILIES", "VERDICTS", "Outcome", "Tally", "bounds", "check", "collected",
    "commit_seed", "draw", "drawn", "enforced", "finer", "judge", "known", "resolution", "run", "unbalanced", "write",
]  # fmt: skip
