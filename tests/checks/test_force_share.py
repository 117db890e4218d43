"""Shares of forces by energies and works: over the second half of the work, where most had been done, across systems."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from prensa.checks.force_share import ForceShare


def noted(share: ForceShare, rows: list[tuple[float, float]]) -> ForceShare:
    """With rows of work and energy, the first from a run's start."""
    before = share.rows[-1][0] if share.rows else 0.0
    for work, energy in rows:
        given: Any = SimpleNamespace(
            context=SimpleNamespace(state=SimpleNamespace(energy=SimpleNamespace(external=before))),
            state=SimpleNamespace(energy=SimpleNamespace(external=work)),
        )
        share.note(given, energy)
        before = work
    return share


def test_the_share_is_the_rate_over_the_second_half_of_the_most_work():
    """0.1 from 5 to 10; what is given back when the tool draws back does not count."""
    share = noted(ForceShare(), [(5.0, 0.0), (10.0, 0.5), (8.0, 0.4), (7.0, 0.0)])
    assert share.at_most_work() == pytest.approx(0.1) and share.most == 2
    assert ForceShare().at_most_work() == 0.0


def test_a_run_that_goes_on_on_another_system_keeps_what_was_noted():
    """And the earlier one keeps its own."""
    first = noted(ForceShare(), [(5.0, 0.0), (10.0, 0.5)])
    rest = ForceShare()
    rest.go_on_from(first)
    noted(rest, [(20.0, 2.5)])
    assert rest.at_most_work() == pytest.approx(0.2) and first.at_most_work() == pytest.approx(0.1)
