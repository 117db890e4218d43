"""The verification table: cases compared with references that owe nothing to this package's solver.

A case is a function that yields `Row`s; ``@case`` puts it on the list, and its module is imported only when the list is
asked for. A case that raises becomes a failing row, so that the table is always complete. So does a warning that a case gives
and does not declare with ``expected_warnings``: these are good problems, of which nothing else may be reported.
"""

from __future__ import annotations

import csv
import importlib
import inspect
import logging
import math
import multiprocessing
import pkgutil
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeVar

if TYPE_CHECKING:
    from rich.console import Console

Kind = Literal["relative", "absolute", "at most", "at least", "report"]
Function = TypeVar("Function", bound=Callable[..., Iterable["Row"]])

_CASES: dict[str, Case] = {}


@dataclass(frozen=True)
class Row:
    """One comparison.

    ``kind``: ``relative`` |ours − reference| ≤ tolerance |reference|; ``absolute`` |ours − reference| ≤ tolerance;
    ``at most`` ours ≤ reference and ``at least`` ours ≥ reference, both without a tolerance; ``report`` a number that is
    worth stating and has no verdict (it passes).
    """

    case: str
    quantity: str
    reference: float
    ours: float
    tolerance: float = 0.0
    kind: Kind = "relative"
    note: str = ""

    @property
    def error(self) -> float:
        """Signed error, relative to |reference| for relative rows; NaN when there is no answer."""
        difference = self.ours - self.reference
        if self.kind != "relative":
            return difference
        return difference / abs(self.reference) if self.reference else math.copysign(math.inf, difference)

    @property
    def passed(self) -> bool:
        """The verdict; what is not a number fails."""
        if self.kind == "report":
            return not math.isnan(self.ours)
        if self.kind == "at most":
            return self.ours <= self.reference
        if self.kind == "at least":
            return self.ours >= self.reference
        return abs(self.error) <= self.tolerance


def row(quantity: str, reference: float, ours: float, tolerance: float = 0.0, kind: Kind = "relative") -> Row:
    """A `Row` whose case the table fills in."""
    return Row("", quantity, float(reference), float(ours), float(tolerance), kind)


@dataclass(frozen=True)
class Case:
    """A case of the table: ``function(E_scale=1, mu_scale=1)`` yields its rows; ``slow`` ones take over ten seconds.

    ``expected_warnings``: parts of the warnings that its runs are meant to give. ``balance``: whether one of its rows has to
    state by how much tools, supports and loads are out of balance.
    """

    name: str
    suite: str
    slow: bool
    function: Callable[..., Iterable[Row]]
    expected_warnings: tuple[str, ...] = ()
    balance: bool = False

    @property
    def title(self) -> str:
        """First line of the function's docstring."""
        return (inspect.getdoc(self.function) or self.name).splitlines()[0]

    def run(self, **scales: float) -> list[Row]:
        """Rows of the case; an exception ends it with a failing row that gives the reason, warnings not meant add one each."""
        rows: list[Row] = []
        with heard() as warnings:
            try:
                rows += (replace(r, case=self.name) for r in self.function(**scales))
                if rows and self.balance and not any("out of balance" in r.quantity for r in rows):
                    rows.append(Row(self.name, "no row says what is out of balance", math.nan, math.nan, note="balance"))
            except Exception as error:  # whatever goes wrong in one case must not hide the others
                reason = f"did not converge: {str(error) or type(error).__name__}"
                rows.append(Row(self.name, reason, math.nan, math.nan, note=type(error).__name__))
        rows += (replace(r, case=self.name) for r in not_meant(warnings, self.expected_warnings))
        if not rows:
            rows.append(Row(self.name, "did not converge: the case gave no row", math.nan, math.nan))
        return rows


@contextmanager
def heard() -> Iterator[list[str]]:
    """A list of the warnings that the package gives inside a block, filled as they come."""
    handler, log = _Hearing(logging.WARNING), logging.getLogger("prensa")
    log.addHandler(handler)
    try:
        yield handler.given
    finally:
        log.removeHandler(handler)


class _Hearing(logging.Handler):
    def __init__(self, level: int) -> None:
        super().__init__(level)
        self.given: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.given.append(record.getMessage())


def not_meant(warnings: Iterable[str], expected: Iterable[str]) -> Iterator[Row]:
    """A failing row for each of the warnings that has none of the expected parts."""
    for warning in dict.fromkeys(warnings):
        if not any(part in warning for part in expected):
            yield Row("", f"warning: {warning}", math.nan, math.nan, note="warning")


def case(
    name: str, *, suite: str, slow: bool = False, expected_warnings: tuple[str, ...] = (), balance: bool = True
) -> Callable[[Function], Function]:  # fmt: skip
    """Put a function that yields rows on the list; ``expected_warnings``: parts of the warnings that its runs are meant to give.

    A case fails whose rows do not state by how much tools, supports and loads are out of balance, unless ``balance`` is false:
    a law alone has none.

    Raises
    ------
    ValueError
        If another function already has that name.

    """

    def register(function: Function) -> Function:
        known = _CASES.get(name)
        if known is not None and known.function.__module__ != function.__module__:
            raise ValueError(f"two verification cases are called {name!r}")
        _CASES[name] = Case(name, suite, slow, function, expected_warnings, balance)
        return function

    return register


def cases() -> dict[str, Case]:
    """All cases by name, in the order of their modules and of their definition; imports every module beside this one."""
    import prensa.verify as package

    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    return dict(_CASES)


def select(only: str | None = None) -> list[Case]:
    """Cases whose suite or name is *only*, else those whose name contains it; all for None.

    Raises
    ------
    ValueError
        If no case answers to it.

    """
    known = list(cases().values())
    if only is None:
        return known
    chosen = [c for c in known if only in (c.suite, c.name)] or [c for c in known if only.lower() in c.name.lower()]
    if not chosen:
        names = ", ".join(repr(c.name) for c in known)
        suites = ", ".join(sorted({c.suite for c in known}))
        raise ValueError(f"no verification case {only!r}; suites: {suites}; cases: {names}")
    return chosen


def _timed(c: Case) -> tuple[list[Row], float]:
    start = time.perf_counter()
    return c.run(), time.perf_counter() - start


def _by_name(name: str) -> tuple[list[Row], float]:
    return _timed(cases()[name])


def timed(only: str | None = None, jobs: int = 1) -> Iterator[tuple[Case, list[Row], float]]:
    """Case by case: the case, its rows, its wall time (s); with ``jobs`` > 1 in as many processes, as they finish."""
    chosen = select(only)
    if jobs <= 1 or len(chosen) == 1:
        for c in chosen:
            yield c, *_timed(c)
        return
    # a fresh interpreter each: the threads of a solver do not survive a fork
    with ProcessPoolExecutor(min(jobs, len(chosen)), multiprocessing.get_context("spawn")) as pool:
        # the long ones first, or one of them is left running alone at the end
        ahead = {pool.submit(_by_name, c.name): c for c in sorted(chosen, key=lambda c: not c.slow)}
        for future in as_completed(ahead):
            yield ahead[future], *future.result()


def run(only: str | None = None) -> list[Row]:
    """Rows of the chosen cases (all for None; else a suite, a case or part of a case's name)."""
    return [r for _, rows, _ in timed(only) for r in rows]


HEADER = ("case", "quantity", "reference", "prensa", "error", "tolerance", "verdict")


def cells(r: Row) -> tuple[str, ...]:
    """The row as text, in the order of `HEADER`."""
    verdict = "FAIL" if not r.passed else "—" if r.kind == "report" else "pass"
    if math.isnan(r.ours):
        return r.case, r.quantity, "", "", "", "", verdict
    if r.kind == "relative":
        error, tolerance = f"{100 * r.error:+.3g} %", f"{100 * r.tolerance:.3g} %"
    elif r.kind in ("absolute", "report"):
        error, tolerance = f"{r.error:+.2e}", f"{r.tolerance:.2g}" if r.tolerance else ""
    else:
        error, tolerance = "", "≤" if r.kind == "at most" else "≥"
    return r.case, r.quantity, f"{r.reference:.6g}", f"{r.ours:.6g}", error, tolerance, verdict


def write(rows: list[Row], path: str | Path) -> None:
    """Write the table to a ``.csv`` (numbers in full) or else a Markdown file, `manual`."""
    path = Path(path)
    if path.suffix.lower() == ".csv":
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(("case", "quantity", "reference", "prensa", "error", "tolerance", "kind", "verdict"))
            for r in rows:
                verdict = "pass" if r.passed else "FAIL"
                writer.writerow((r.case, r.quantity, r.reference, r.ours, r.error, r.tolerance, r.kind, verdict))
        return
    path.write_text(manual(rows), encoding="utf-8")


def manual(rows: list[Row]) -> str:
    """A page in Markdown: the rows by suite and case, each case with what it says of itself."""
    known = cases()
    passed = sum(r.passed for r in rows)
    summary = f"Written by `prensa verify --out`: {passed} of {len(rows)} rows within their tolerances."
    lines = ["# Verification table", "", summary]
    suite = ""
    by_case: dict[str, list[Row]] = {}
    for r in rows:
        by_case.setdefault(r.case, []).append(r)
    order = {name: k for k, name in enumerate(dict.fromkeys(c.suite for c in known.values()))}
    for name in sorted(by_case, key=lambda n: order[known[n].suite] if n in known else len(order)):
        of = known[name].suite if name in known else ""
        if of != suite:
            suite = of
            lines += ["", f"## {suite}"]
        lines += ["", f"### {name}", ""]
        if name in known:
            lines += [inspect.getdoc(known[name].function) or "", ""]
        lines += ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
        lines += ["| " + " | ".join(c.replace("|", "\\|") for c in cells(r)) + " |" for r in by_case[name]]
    return "\n".join(lines) + "\n"


def main(
    only: str | None = None, out: str | None = None, jobs: int = 1, quiet: bool = False, json: bool = False
) -> int:
    """Run (in ``jobs`` processes), print and (``out``: a .md or .csv file) write the table; 0 if every row passes, else 1.

    The table, or its rows as ``json``, is on standard output; cases as they end, unless ``quiet``, on standard error.
    """
    from rich.console import Console

    console, progress = Console(), Console(stderr=True, quiet=quiet)
    if not console.is_terminal:
        console = Console(width=180)  # a log has room for the table
    try:
        chosen = select(only)
    except ValueError as error:
        console.print(str(error), markup=False)
        return 1
    if out:
        Path(out).parent.mkdir(parents=True, exist_ok=True)  # before minutes of computing
    found: dict[str, list[Row]] = {}
    begin = time.perf_counter()
    for k, (c, new, seconds) in enumerate(timed(only, jobs), 1):
        found[c.name] = new
        bad = sum(not r.passed for r in new)
        verdict = f"[red]{bad} of {len(new)} rows fail[/red]" if bad else f"[green]{len(new)} rows pass[/green]"
        progress.print(f"{k:3d}/{len(chosen)} {c.name:<42} {verdict}  {seconds:.1f} s", highlight=False, soft_wrap=True)
    rows = [r for c in chosen for r in found[c.name]]
    failed = sum(not r.passed for r in rows)
    summary = f"{len(chosen)} cases, {len(rows)} rows, {failed} failed, {time.perf_counter() - begin:.0f} s"
    if json:
        print(as_json(rows))
    else:
        _print_table(rows, console)
        console.print(summary, highlight=False)
    if out:
        write(rows, out)
        progress.print(f"written to {out}", highlight=False)
    return 1 if failed else 0


def as_json(rows: list[Row]) -> str:
    """The rows as a JSON document; numbers that a row has not are null."""
    from json import dumps

    def known(number: float) -> float | None:
        return number if math.isfinite(number) else None

    return dumps({
        "passed": all(r.passed for r in rows),
        "rows": [
            {
                "case": r.case, "quantity": r.quantity, "reference": known(r.reference), "prensa": known(r.ours),
                "error": known(r.error), "tolerance": r.tolerance, "kind": r.kind, "passed": r.passed,
            }
            for r in rows
        ],
    }, indent=2, ensure_ascii=False)  # fmt: skip


def _print_table(rows: list[Row], console: Console) -> None:
    from rich.table import Table

    table = Table(*HEADER)
    last = ""
    for r in rows:
        text = cells(r)
        if r.case != last and last:
            table.add_section()
        style = "green" if r.passed else "bold red"
        table.add_row("" if r.case == last else text[0], *text[1:-1], f"[{style}]{text[-1]}[/{style}]")
        last = r.case
    console.print(table)
