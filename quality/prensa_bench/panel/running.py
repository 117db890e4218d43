"""One problem with some mechanisms off: what came of it as a record, and many of them in a process of their own.

    python -m prensa_bench.panel.running '{"off": ["edge_step"], "problems": ["upsetting 0.1"], "repeat": 2, "seconds": 300}'

prints a line of JSON a problem. Before the first one a few increments are solved, so that no time is spent on loading kernels.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict, dataclass, field
from itertools import islice

import numpy as np

import prensa as pr
from prensa.errors import PrensaError
from prensa.result.increment import Monitor, Progress
from prensa_bench.panel.composition import settings, without
from prensa_bench.panel.mechanisms import MECHANISMS
from prensa_bench.panel.problems import Entry, Posed, problems
from prensa_bench.robustness.increments import reason_of

QUARTERS = (0.25, 0.5, 0.75)  # of every step: times at which forces are compared, beside its end
RUN_ENDED, RUN_FAILED, RUN_LATE, RUN_CRASHED = "ended", "failed", "late", "crashed"


@dataclass
class Record:
    """What came of a problem. ``forces``: by time, those of all tools, (fx, fy, m) each; ``seconds`` of processor time a repeat.

    ``reached``: time of the last increment. ``status``: 'ended'; 'failed', for a ``reason``; 'late', beyond the processor time
    that it was given; 'crashed'.
    """

    problem: str
    off: list[str]
    status: str = RUN_ENDED
    reason: str = ""
    reached: float = 0.0
    increments: int = 0
    iterations: int = 0
    cuts: int = 0
    seconds: list[float] = field(default_factory=list)
    forces: dict[str, list[float]] = field(default_factory=dict)


class _LateError(Exception):
    """The limit of processor time is spent."""


def run(name: str, entry: Entry, off: list[str], repeat: int = 1, seconds: float = np.inf) -> Record:
    """Solve a problem of the panel with some mechanisms off."""
    out = Record(name, sorted(off))
    posed = entry.pose()
    for _ in range(repeat):
        begun = time.process_time()
        once = Record(name, out.off)
        try:
            _solve(posed, entry, once, begun + seconds)
        except _LateError:
            once.status = RUN_LATE
        except PrensaError as error:
            once.status, once.reason = RUN_FAILED, reason_of(error)
        except Exception as error:
            once.status, once.reason = RUN_CRASHED, f"{type(error).__name__}: {error}"
        once.seconds = [*out.seconds, round(time.process_time() - begun, 3)]
        out = once
        if out.status == RUN_LATE:
            break
    return out


def _solve(posed: Posed, entry: Entry, out: Record, until: float) -> None:
    mechanisms = [MECHANISMS[name] for name in out.off]
    numerics, policy = settings(mechanisms, posed.numerics)
    steps = len(posed.problem.steps)
    stops = [k + share for k in range(steps) for share in QUARTERS]
    fixed = {*stops, *range(1, steps + 1)}

    def watch(_: Progress) -> None:
        if time.process_time() > until:
            raise _LateError

    monitor: Monitor = watch
    with without(mechanisms):
        for inc in islice(pr.solve(posed.problem, numerics, monitor=monitor, policy=policy, stops=stops), entry.most):
            out.reached, out.increments = inc.time, out.increments + 1
            out.iterations += inc.statistics.iterations
            out.cuts += inc.statistics.cutbacks
            if inc.time in fixed or inc.end_of_step:
                out.forces[f"{inc.time:.10g}"] = [float(f) for tool in inc.tools.values() for f in tool.force]


def warm(entry: Entry) -> None:
    """Load the kernels of a problem: its first increments, as they are by default."""
    posed = (entry.small or entry.pose)()
    try:
        for _ in islice(pr.solve(posed.problem, posed.numerics), 2):
            pass
    except PrensaError:
        pass


def main(asked: str) -> None:
    """Run what is asked for as JSON."""
    what, known = json.loads(asked), problems()
    for name in what["problems"]:
        warm(known[name])
        record = run(name, known[name], what["off"], what["repeat"], what["seconds"])
        print(json.dumps(asdict(record)), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
