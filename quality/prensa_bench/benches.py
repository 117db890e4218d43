"""The benchmarks of ``prensa bench``: random problems whose answers are checked, broken inputs, and runs that are killed."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from prensa.cli.voice import Voice, refuse_unknown
from prensa.errors import PrensaError
from prensa_bench import fuzz as inputs
from prensa_bench import fuzz_calls, fuzz_commands, fuzz_runs, fuzz_whole
from prensa_bench import robustness as problems
from prensa_bench.robustness import Outcome, Tally


def robustness(
    voice: Voice, count: int, seed: str, family: Sequence[str], first: int, jobs: int, report_file: Path | None,
    tables: Sequence[Path], enforcement: str, slopes: bool,
) -> bool:  # fmt: skip
    """Solve random problems, or read what was solved; whether an answer, or a derivative, was wrong."""
    refuse_unknown(voice, "enforcement", [enforcement], (problems.AS_DRAWN, *problems.ENFORCEMENTS))
    refuse_unknown(voice, "family", family, problems.known())
    number, commit = _seed_of(seed)
    names = list(dict.fromkeys(family or problems.known()))
    if tables:
        done = [t for t in problems.collected(tables) if t.suite in names]
        _summed_up(voice, done)
    else:
        done = []
        for name in names:
            follow = _followed(voice, done, report_file, commit)
            done.append(problems.run(name, count, number, follow, first, enforcement, jobs, slopes))
            _summed_up(voice, done[-1:])
    _written(report_file, done, commit)
    voice.give({"families": [_figures(t) for t in done]})
    return any(t.count("wrong") for t in done)


def fuzz(voice: Voice, app: Callable[..., Any], count: int, seed: str) -> bool:
    """Give the readers, and *app* that takes command lines, broken inputs; whether one was a defect."""
    number, _ = _seed_of(seed)
    defects, found = 0, []
    for name, source, share, limits in (
        ("files", inputs.files, 2, ()),
        ("changes", fuzz_calls.overrides, 4, ()),
        ("calls", fuzz_calls.calls, 4, ()),
        ("files and words of commands", partial(fuzz_commands.commands, app), 4, ()),
        ("runs", fuzz_runs.runs, 20, fuzz_runs.LIMITS),
        ("cases with parts of others", fuzz_whole.crossed, 4, ()),
        ("their runs", partial(fuzz_whole.crossed, solved=True), 40, fuzz_runs.LIMITS),
        ("odd names", fuzz_whole.named, 40, fuzz_whole.LIMITS),
        ("command lines that run", partial(fuzz_whole.lines, app), 40, fuzz_whole.LIMITS),
    ):
        tried = max(count // share, 1)
        report = inputs.run(tried, number, voice.remark, source, *limits)
        counts = ", ".join(f"{report.counts[k]} {k}" for k in ("read", "refused", "failed"))
        voice.say(f"{tried} {name}, seed {number}: {counts}; the slowest took {report.slowest:.2f} s")
        found.append({"inputs": name, "tried": tried, **report.counts, "defects": len(report.defects), "slowest": report.slowest})
        defects += len(report.defects)
    voice.give({"seed": number, "inputs": found})
    return bool(defects)


def killed(voice: Voice, count: int, seed: str, kinds: Sequence[str]) -> bool:
    """Stop and kill runs and studies at random moments, look at them and continue them; whether anything was wrong."""
    if os.name != "posix":
        raise PrensaError("prensa bench killed needs the signals and forks of a POSIX system")
    from prensa_bench import killed as campaign

    refuse_unknown(voice, "kind of run", kinds, campaign.SUBJECTS)
    tallies = campaign.killed(list(dict.fromkeys(kinds)), count, _seed_of(seed)[0], voice.say)
    voice.give({"kinds": [t._asdict() for t in tallies]})
    return any(t.wrong for t in tallies)


def _seed_of(seed: str) -> tuple[int, str]:
    """The seed as a number, and the commit that it comes from."""
    if seed == "commit":
        return problems.commit_seed()
    if not (seed.isascii() and seed.isdigit() and len(seed) < 20):
        raise PrensaError(f"--seed is {seed!r}; it must be a whole number or 'commit'")
    return int(seed), ""


def _summed_up(voice: Voice, tallies: list[Tally]) -> None:
    """A line for each family."""
    for tally in tallies:
        shares = ", ".join(f"{s} {tally.share(s):.1%}" for s in problems.VERDICTS)
        low, high = problems.bounds(tally.count("right"), len(tally.outcomes))
        head = f"{tally.suite}: {len(tally.outcomes)} problems, seed {tally.seed}"
        twins = f"; {tally.twins()}" if tally.twins() else ""
        voice.say(f"{head}: {shares}; 95 % bounds of right {low:.1%} to {high:.1%}{twins}")


def _figures(tally: Tally) -> dict[str, Any]:
    low, high = problems.bounds(tally.count("right"), len(tally.outcomes))
    counts = {s: tally.count(s) for s in problems.VERDICTS}
    return {"family": tally.suite, "seed": tally.seed, "problems": len(tally.outcomes), **counts, "bounds": [low, high]}


def _followed(voice: Voice, done: list[Tally], report_file: Path | None, commit: str) -> Callable[[Tally, Outcome], None]:
    """What is said and kept of every problem as it is judged: whoever interrupts has all that was solved."""

    def follow(tally: Tally, outcome: Outcome) -> None:
        if outcome.status != "right":
            reason = f" ({outcome.reason})" if outcome.reason else ""
            voice.say(f"{outcome.status}{reason}: {tally.suite} {outcome.kind}: {outcome.words}")
        _written(report_file, [*done, tally], commit)

    return follow


def _written(report_file: Path | None, tallies: list[Tally], commit: str) -> None:
    if report_file is not None:
        problems.write(report_file, tallies, commit)
