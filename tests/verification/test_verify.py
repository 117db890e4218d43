"""The verification table, one test a case, and the table's own manners."""

from __future__ import annotations

import csv
import logging
import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from prensa.verify import table
from prensa.verify.table import Case, Row, cases, row

QUICK = (
    "patch test of exact enforcement", "sliding wedge", "patch test, constant stress", "patch test of the integration rules",
    "wear under a sliding block", "upsetting, mu = 0.1, 16 × 12", "bar of two layers, tied", "tube in a round cavity",
    "pressure and weight on bodies in space",
)  # fmt: skip
"""A case of each suite. All of them are computed by ``make verify``, which continuous integration runs beside the tests."""


def test_each_suite_has_a_case_here() -> None:
    """A new suite gets one."""
    assert {cases()[name].suite for name in QUICK} == {c.suite for c in cases().values()}


@pytest.mark.parametrize("name", QUICK)
def test_cases_hold(name: str) -> None:
    """Every quantity is within its tolerance, the balance of tools and supports is stated, and nothing false is reported."""
    failed = [" ".join(table.cells(r)) for r in cases()[name].run() if not r.passed]
    assert not failed, "\n".join(failed)


def test_a_case_that_states_no_balance_is_a_failing_row() -> None:
    """Of models, that is: a law alone declares that it has none. What raises has a row that says so already."""

    def unbalanced(**_: float) -> Iterator[Row]:
        yield row("force", 1.0, 1.0)

    def balanced(**_: float) -> Iterator[Row]:
        yield row("plate and supports out of balance", 0.0, 0.0, 1e-8, "absolute")

    def broken(**_: float) -> Iterator[Row]:
        yield row("force", 1.0, 1.0)
        raise RuntimeError("no way")

    ends = [Case("c", "none", False, f, (), True).run()[-1] for f in (unbalanced, balanced, broken)]
    said = ["no row says what is out of balance", "plate and supports out of balance", "did not converge: no way"]
    assert [(r.quantity, r.passed) for r in ends] == list(zip(said, (False, True, False)))
    assert [r.passed for r in Case("law", "none", False, unbalanced).run()] == [True]
    assert [name for name, c in cases().items() if not c.slow and not c.balance] == ["slip hardening, return map"]


def test_a_case_that_raises_is_a_failing_row_after_the_rows_it_gave() -> None:
    """What goes wrong in a case is a row of the table, never an exception."""

    def broken(**_: float) -> Iterator[Row]:
        yield row("good", 1.0, 1.0)
        raise RuntimeError("no way")

    rows = Case("broken", "none", False, broken).run()
    assert [r.passed for r in rows] == [True, False]
    assert rows[1].quantity == "did not converge: no way" and rows[1].case == "broken"


def test_a_warning_that_a_case_does_not_declare_is_a_failing_row() -> None:
    """Warnings fail a case, each once, but for those that it declares; what is heard no more after it is another's."""
    log = logging.getLogger("prensa")

    def warned(**_: float) -> Iterator[Row]:
        for text in ("meant: a needle", "an element folds", "an element folds"):
            log.warning(text)
        yield row("good", 1.0, 1.0)

    case = Case("warned", "none", False, warned, ("needle",))
    for _ in range(2):
        rows = case.run()
        assert [(r.quantity, r.passed) for r in rows] == [("good", True), ("warning: an element folds", False)]


@pytest.mark.parametrize(
    ("ours", "kind", "verdict"),
    [
        (101.0, "relative", True), (101.1, "relative", False), (-100.0, "relative", False),
        (100.01, "absolute", True), (100.02, "absolute", False),
        (100.0, "at most", True), (100.1, "at most", False), (100.0, "at least", True), (99.9, "at least", False),
        (math.nan, "relative", False), (math.nan, "absolute", False), (math.nan, "at most", False),
        (math.nan, "at least", False), (math.nan, "report", False), (0.0, "report", True),
    ],
)  # fmt: skip
def test_the_verdict_is_the_tolerance(ours: float, kind: table.Kind, verdict: bool) -> None:
    """A row passes within its tolerance, fails beyond it, and fails on what is not a number."""
    assert row("x", 100.0, ours, 0.010000001, kind).passed is verdict


def test_selection_by_suite_by_name_and_by_part_of_a_name() -> None:
    """A suite, a case or a part of its name chooses; an unknown one is answered with what there is."""
    assert {c.suite for c in table.select("friction")} == {"friction"}
    assert [c.name for c in table.select("sliding wedge")] == ["sliding wedge"]
    found = {c.name for c in table.select("Example 1")}
    assert found >= {"example 1, reference geometry", "example 1, neo-Hooke"}
    assert all("example 1" in name for name in found)
    with pytest.raises(ValueError, match=r"suites: .*friction"):
        table.select("fricton")


def test_the_table_is_written_and_the_exit_code_says_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The exit code is 1 when a row fails; Markdown and CSV hold every row."""

    def half_right(**_: float) -> Iterator[Row]:
        yield row("right", 2.0, 2.0, 0.01)
        yield row("wrong", 2.0, 3.0, 0.01)

    monkeypatch.setattr(table, "select", lambda only=None: [Case("half right", "none", False, half_right)])
    assert table.main(out=str(tmp_path / "table.md")) == 1
    assert "FAIL" in capsys.readouterr().out
    assert (tmp_path / "table.md").read_text(encoding="utf-8").count("\n| half right") == 2
    table.main(out=str(tmp_path / "table.csv"))
    with (tmp_path / "table.csv").open(encoding="utf-8") as file:
        assert [r["verdict"] for r in csv.DictReader(file)] == ["pass", "FAIL"]


def test_an_unknown_case_is_an_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    """A name that no case answers to is explained, and the exit code is 1."""
    assert table.main("no such case") == 1
    assert "'sliding wedge'" in " ".join(capsys.readouterr().out.split())


def test_tolerances_of_any_kind_of_number_are_written_as_json():
    """A tolerance that comes out of an array makes a verdict that the document can hold."""
    import json

    import numpy as np

    from prensa.verify.table import as_json, row

    document = json.loads(as_json([row("force", np.float64(1.0), np.float64(1.01), np.float64(0.02))]))
    assert document["passed"] is True
    assert document["rows"][0]["tolerance"] == 0.02
