"""Figures of Newton's iteration that `prensa_bench.newton` reads off increments."""

from __future__ import annotations

from dataclasses import asdict, replace

import pytest

from prensa_bench.newton import DIRECT, PURE, Row, Solved, first_contact, order, page, solved, starts

QUADRATIC = Solved("press", 4, 0, 9, [1e-1, 1e-2, 1e-4, 1e-8, 3e-13], [1e-12] * 5, [9, 2, 0, 0, 0])


def test_the_order_is_that_above_round_off():
    """Residuals that are squared have order 2, those that fall alike order 1; the last one here is round-off."""
    assert order(QUADRATIC) == pytest.approx(2.0)
    assert order(replace(QUADRATIC, residuals=[1e-1, 1e-2, 1e-3, 1e-4, 1e-5])) == pytest.approx(1.0)


def test_there_is_no_order_of_few_iterates_or_changing_contact():
    """Two residuals above round-off, a point that changed last, or a residual that rose say nothing."""
    assert order(replace(QUADRATIC, residuals=[1e-1, 1e-2, 1e-4, 1e-8], round_off=[0.0] * 4)) is None
    assert order(replace(QUADRATIC, changes=[9, 2, 0, 1, 0])) is None
    assert order(replace(QUADRATIC, residuals=[1e-1, 1e-2, 1e-9, 1e-8, 1e-13])) is None
    assert order(replace(QUADRATIC, residuals=[1e-1, 1e-13, 1e-13, 1e-13, 1e-13])) is None


def test_first_contacts_and_starts_of_later_steps():
    """Increments without contact are neither."""
    row = Row("p", DIRECT, increments=[
        replace(QUADRATIC, iterations=1, closed=0), replace(QUADRATIC, iterations=5), replace(QUADRATIC, iterations=2),
        replace(QUADRATIC, step="slide", iterations=7), replace(QUADRATIC, step="away", iterations=3, closed=0),
        replace(QUADRATIC, step="again", iterations=6),
    ])  # fmt: skip
    assert first_contact(row) == 5
    assert starts(row) == [7]


def test_a_problem_is_measured_and_printed():
    """Round-off of every iterate is there, and the table has a line for the random problems."""
    rows = [solved("4242/6", way) for way in (DIRECT, PURE)]
    assert not any(r.failed for r in rows) and rows[0].iterations > 0
    assert all(len(i.round_off) == len(i.residuals) == len(i.changes) for r in rows for i in r.increments)
    assert Row(**{**asdict(rows[0]), "increments": rows[0].increments}) == rows[0]
    assert page(rows).splitlines()[2].startswith(f"| 1 random | {len(rows[0].increments)} | {rows[0].iterations}, 0 |")
