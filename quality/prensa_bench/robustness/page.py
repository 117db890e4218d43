"""Published results of the suite: a table of every problem, and the page with shares and failures by family."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from prensa.errors import PrensaError
from prensa_bench.robustness.increments import RERUN_EVERY
from prensa_bench.robustness.outcome import VERDICTS, Outcome, Tally, bounds

REPORTED = ("family", "seed", "number", "kind", "verdict", "reason", "iterations", "cutbacks", "seconds", "twin", "words")


def commit_seed(folder: Path | None = None) -> tuple[int, str]:
    """The commit that is measured and the seed taken from its hash: nobody chose the problems.

    Raises
    ------
    PrensaError
        Where the package does not run from a git checkout.

    """
    import subprocess

    where = folder or Path(__file__).parent
    try:
        out = subprocess.run(["git", "-C", str(where), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise PrensaError("--seed commit needs prensa to run from a git checkout; give a number instead") from None
    return int(out.stdout[:8], 16), out.stdout.strip()[:12]


def write(path: Path, tallies: list[Tally], commit: str = "") -> None:
    """Write the outcomes of several families: every one to a ``.csv`` file, shares and failures to a Markdown page."""
    if path.suffix == ".md":
        path.write_text(page(tallies, commit), encoding="utf-8")
        return
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(REPORTED)
        for t in tallies:
            for o in t.outcomes:
                cost = (o.iterations, o.cutbacks, f"{o.seconds:.2f}", o.twin)
                out.writerow((t.suite, t.seed, o.number, o.kind, o.status, o.reason, *cost, o.words))


def collected(tables: Iterable[Path]) -> list[Tally]:
    """Outcomes of earlier runs from their tables, a problem that is in several of them once, as it is in the last.

    Raises
    ------
    PrensaError
        For a file that is not such a table.

    """
    found: dict[tuple[str, int], dict[int, Outcome]] = {}
    for path in tables:
        with path.open(encoding="utf-8", newline="") as file:
            rows = csv.DictReader(file)
            if tuple(rows.fieldnames or ()) != REPORTED:
                raise PrensaError(f"{path}: this is not a table of outcomes; --from takes what --report wrote as .csv")
            for r in rows:
                cost = (int(r["iterations"]), int(r["cutbacks"]), float(r["seconds"]))
                outcome = Outcome(int(r["number"]), r["kind"], r["verdict"], r["words"], *cost, r["reason"], r["twin"])
                found.setdefault((r["family"], int(r["seed"])), {})[outcome.number] = outcome
    return [Tally(suite, seed, [of[k] for k in sorted(of)]) for (suite, seed), of in found.items()]


def page(tallies: list[Tally], commit: str = "") -> str:
    """The published table: shares with their bounds, cost, and every problem that was not answered rightly, in its words."""
    seed = "commit" if commit else tallies[0].seed
    lines = [
        "# Random problems on default settings", "",
        f"Made by `prensa bench robustness --seed {seed} --report`"
        + (f" at commit {commit}; the seed is the beginning of its hash." if commit else "."),
        f"One problem again: `prensa bench robustness --seed {tallies[0].seed} --family FAMILY --first NUMBER --count 1`.",
        "Confirmed: stopped for a reason that the checks find in the files too. Reported: the solver said that it cannot.",
        "Wrong: an answer that a check refutes. Time: not ended within the limit of the family. Bounds: of the share of right",
        "answers, with 95 % confidence (Clopper and Pearson). Iterations, cut-backs and seconds are means of a problem.", "",
        "| family | seed | problems | right | bounds | confirmed | reported | wrong | time | iterations | cut-backs | seconds |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    lines += [_row(t) for t in tallies]
    lines += [
        "",
        f"Every {RERUN_EVERY}th elastic and plastic problem is run again at half the step and ten times the penalty. The answers",
        "of the other families are judged by their files alone, by code that shares nothing with the solver.",
        *(f"Solved in a second way of {t.suite}, seed {t.seed}: {t.twins()}." for t in tallies if t.twins()), "",
    ]  # fmt: skip
    kinds = Counter(
        (t.suite, o.status, o.reason, kind_of(o.words)) for t in tallies for o in t.outcomes if o.status != "right"
    )
    if kinds:
        lines += ["| family | verdict | reason | kind of failure | problems |", "|---|---|---|---|---|"]
        lines += [f"| {' | '.join(key)} | {count} |" for key, count in kinds.most_common()]
        lines.append("")
    titles = (
        ("Wrong", "wrong"), ("Reported", "reported"), ("Stopped, and confirmed", "confirmed"), ("Not ended in time", "time"),
        ("Right, with a remark", "right"),
    )  # fmt: skip
    for title, status in titles:
        found = [(t, o) for t in tallies for o in t.outcomes if o.status == status and o.words]
        if found:
            lines += [f"## {title}", "", *(f"- {t.suite} {o.kind}: {o.words}" for t, o in found), ""]
    return "\n".join(lines)


def _row(t: Tally) -> str:
    n = max(len(t.outcomes), 1)
    mean = [sum(getattr(o, k) for o in t.outcomes) / n for k in ("iterations", "cutbacks", "seconds")]
    low, high = bounds(t.count("right"), len(t.outcomes))
    right, *others = (f"{t.share(s):.1%}" for s in VERDICTS)
    shares = " | ".join([right, f"{low:.1%} to {high:.1%}", *others])
    return f"| {t.suite} | {t.seed} | {len(t.outcomes)} | {shares} | {mean[0]:.0f} | {mean[1]:.1f} | {mean[2]:.1f} |"


def kind_of(words: str) -> str:
    """What a failure has in common with others: its words without numbers and names."""
    reason = re.sub(r"^step '.*?', time [^:]*: |^(time|increment) [^:]*: ", "", words).partition(";")[0]
    reason = reason.partition("\n")[0].replace("|", "/")
    return re.sub(r" of body|'[^']*' ?", "", re.sub(r" (at|by) \d\S*| ?\([^)]*\)| -?\d[\d.e+-]*\b", "", reason))
