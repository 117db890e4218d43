"""``run.log``: every iteration of a run, its warnings, and at the end where the time went."""

from __future__ import annotations

import datetime
import logging
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from prensa.errors import Finding
from prensa.result.increment import Increment, Progress

LOG = "run.log"
_RECORD = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d),(\d{3}) ([A-Z]+) +(.*)")

log = logging.getLogger("prensa")


class Warnings(logging.Handler):
    """Keeps the texts of warnings, each once, with what each is about (see `answer.ABOUT`), and passes them on.

    ``held``: those of the end of a run, which its last lines show, in place of passing them on; None before.
    """

    def __init__(self, known: list[str], report: Callable[[str], None], about: Mapping[str, str] | None = None) -> None:
        super().__init__(logging.WARNING)
        self.texts, self._report = list(known), report
        self.about = {text: "case" for text in known} | dict(about or {})
        self.held: list[str] | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Keep one record."""
        text = record.getMessage()
        if text not in self.texts:
            self.texts.append(text)
            self.about[text] = _about(record)
            if self.held is None:
                self._report(text)
            else:
                self.held.append(text)


def _about(record: logging.LogRecord) -> str:
    """What a record is about, where it does not say so itself (``extra={"about": "files"}``)."""
    found = next((a for a in record.args if isinstance(a, Finding)), None) if isinstance(record.args, tuple) else None
    if record.levelno >= logging.ERROR or (found is not None and found.fatal):
        return "failure"
    return str(getattr(record, "about", "case" if found is not None and found.path else "result"))


@contextmanager
def logging_to(directory: Path, warnings: Warnings) -> Iterator[None]:
    """Append what the logger ``prensa`` says to ``run.log``; its level and handlers are as before afterwards."""
    # made with its first line, which says whose it is: a run may be killed at any moment
    file = logging.FileHandler(directory / LOG, mode="a", encoding="utf-8", delay=True)
    file.setFormatter(logging.Formatter("%(asctime)s %(levelname)-7s %(message)s"))
    level = log.level
    log.setLevel(min(level or logging.INFO, logging.INFO))
    log.addHandler(file)
    log.addHandler(warnings)
    try:
        yield
    finally:
        log.removeHandler(file)
        log.removeHandler(warnings)
        log.setLevel(level)
        file.close()


@contextmanager
def silenced(on: bool = True) -> Iterator[None]:
    """Without what runs warn of, if ``on``: where their warnings are known, or parameters are values that nobody means."""
    before = log.level
    if on:
        log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(before)


class Logged(NamedTuple):
    """What a log says of a run: wall ``seconds`` since it was last begun, time of the ``last`` entry, ``warnings``."""

    seconds: float
    last: datetime.datetime | None
    warnings: list[str]


def read_log(directory: Path) -> Logged:
    """What ``run.log`` says of a run that has not ended; nothing where there is none."""
    begun = last = None
    warnings: list[str] = []
    try:
        with open(directory / LOG, encoding="utf-8", errors="replace") as file:
            within = False
            for line in file:
                if (found := _RECORD.match(line)) is None:
                    if within:  # a warning of several lines
                        warnings[-1] += "\n" + line.rstrip("\n")
                    continue
                last = datetime.datetime.fromisoformat(f"{found[1]}.{found[2]}")
                if begun is None or found[4].startswith("prensa "):
                    begun = last
                if within := found[3] == "WARNING":
                    warnings.append(found[4])
    except (OSError, ValueError):
        pass
    seconds = (last - begun).total_seconds() if last and begun else 0.0
    return Logged(max(seconds, 0.0), last, warnings)


def log_progress(progress: Progress) -> None:
    """Monitor that logs iterations (the solver itself logs cuts and notes)."""
    if progress.event == "iteration":
        what = f" {progress.message}" if progress.message else ""
        what += f", {progress.krylov} Krylov iterations" if progress.krylov else ""
        log.info("step %s, increment %d, time %.6g, iteration %d: residual %.3e%s", progress.step, progress.number, progress.time,
                 progress.iteration, progress.residual, what)  # fmt: skip


def log_increment(increment: Increment) -> None:
    """Log an accepted increment: its cost, the status changes of each iteration and the tool forces."""
    cost = increment.statistics
    forces = "; ".join(f"{name} {', '.join(f'{v:.6g}' for v in t.force[: len(t.at)])}" for name, t in increment.tools.items())
    krylov = f"{cost.krylov} Krylov iterations, " if cost.krylov else ""
    log.info("increment %d accepted: %d iterations, %s%d cut-backs, %d augmentations, status changes %s, forces: %s",
             increment.number, cost.iterations, krylov, cost.cutbacks, cost.augmentations,
             " ".join(map(str, cost.changes)) or "–", forces or "–")  # fmt: skip


def wall_times(seconds: Mapping[str, float]) -> str:
    """Table of wall seconds by section with shares of the total, largest first."""
    total = sum(seconds.values())
    width = max(map(len, seconds), default=5)
    rows = [*sorted(seconds.items(), key=lambda item: -item[1]), ("total", total)]
    return "\n".join(
        [f"{'section':<{max(width, 7)}}  {'seconds':>9}  share"]
        + [f"{name:<{max(width, 7)}}  {s:9.3f}  {100 * s / total if total else 0:4.0f} %" for name, s in rows]
    )
