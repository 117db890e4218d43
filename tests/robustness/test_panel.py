"""The panel of mechanisms: it runs, what is off is off, its rows are those of the kept table, guards name tests that exist."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from prensa.policy import Policy
from prensa_bench.panel import table
from prensa_bench.panel.__main__ import Store, guard_holds, main
from prensa_bench.panel.composition import settings, without
from prensa_bench.panel.mechanisms import GUARDS, MECHANISMS, SETS, TIMELY
from prensa_bench.panel.problems import DRAWN_EXACT, DRAWN_OF, FORMING_CASES, GROUPS, problems
from prensa_bench.panel.running import RUN_ENDED, Record, run

ROOT = Path(__file__).parents[2]


def test_the_panel_has_its_problems():
    """18 cases of the gallery, 40 random problems, the strips with exact contact, two large ones, eleven in space."""
    groups = [e.group for e in problems().values()]
    assert [groups.count(g) for g in GROUPS] == [18, 10, 9, 30, 2, 11]
    assert len(FORMING_CASES) == 14 and sum(DRAWN_OF.values()) == 40


def test_exact_strips_are_the_strips_with_multipliers_and_friction():
    """Nothing but the enforcement of contact differs, and points rub in all of them."""
    known = problems()
    for k in DRAWN_EXACT:
        (a, _), (b, _) = known[f"strips {k}"].pose(), known[f"exact {k}"].pose()
        assert all(c.enforcement.has_multipliers for c in b.contacts) and b.friction is not None
        assert replace(b, contacts=a.contacts) == a


def test_every_mechanism_has_a_row_and_every_row_a_mechanism():
    """The kept table has a row for each mechanism and each set that is off together, with the same sentence and command."""
    rows = {row.name: row for row in table.rows(table.KEPT_TABLE.read_text(encoding="utf-8"))}
    assert list(rows) == [*(m.name for m in TIMELY), *SETS, *(m.name for m in GUARDS)]
    for name, mechanism in MECHANISMS.items():
        assert (rows[name].what, rows[name].command) == (mechanism.what, table.command([name]))
        assert rows[name].worth
    for name, off in SETS.items():
        assert rows[name].command == table.command(off) and set(off) <= MECHANISMS.keys()


def test_every_mechanism_is_switched_off_and_back_on():
    """Functions are the neutral ones inside the block and themselves after it; settings differ from the defaults."""
    from prensa import Numerics

    for m in MECHANISMS.values():
        before = [owner.__dict__[name] for owner, name, _ in m.replaces]
        with without([m]):
            assert all(owner.__dict__[name] is neutral for owner, name, neutral in m.replaces)
        assert [owner.__dict__[name] for owner, name, _ in m.replaces] == before
        numerics, policy = settings([m], Numerics())
        assert m.replaces or (numerics, policy) != (Numerics(), Policy())


def test_guards_name_a_test():
    """Every guard, and no other mechanism, names a test that fails without it."""
    assert not any(m.guard for m in TIMELY)
    for m in GUARDS:
        file, *tests = m.guard.split("::")
        text = (ROOT / file).read_text(encoding="utf-8")
        assert tests and all(f"def {name.partition('[')[0]}(" in text for name in tests), m.name


SLOW = {
    "limit_points_of_friction": "an ironing up to the end of its path takes 3 to 10 s",
    "runaway": "a roll that goes round millions of times is followed round, which takes a minute",
}  # guards whose tests are not run without them here, and why not


@pytest.mark.slow
@pytest.mark.parametrize("name", [m.name for m in GUARDS if m.name not in SLOW])
def test_the_test_of_a_guard_fails_without_it(name):
    """A guard of which no input is known that goes wrong without it is none."""
    assert guard_holds(name)


SHORT = {"snap_through": "predictor", "strips 4": "contact_step", "slide_release 3": "finish"}  # problem: what is off


def test_the_panel_runs_and_what_is_off_is_off():
    """Three short problems: each ends as it does by default, in another number of iterations with a mechanism off."""
    known = problems()
    for name, off in SHORT.items():
        on = run(name, known[name], [])
        assert on.status == RUN_ENDED and on.iterations > 0
        other = run(name, known[name], [off])
        assert other.iterations != on.iterations, off
        assert other.status == RUN_ENDED and table.difference(on, other) <= table.SAME_FORCES


@pytest.mark.slow
def test_runs_are_kept_and_not_made_again(tmp_path, capsys):
    """A second call runs nothing, and its table is that of the first; records of another source do not count."""
    file = tmp_path / "panel.jsonl"
    asked = ["--off", "predictor", "--problems", "snap_through", "--file", str(file)]
    assert main(asked) == 0
    first, lines = capsys.readouterr().out, file.read_text(encoding="utf-8")
    assert first.startswith("predictor off: gallery: of 1, cuts 0 → ") and len(lines.splitlines()) == 2
    assert main(asked) == 0
    assert capsys.readouterr().out == first and file.read_text(encoding="utf-8") == lines
    assert not Store(file, "another").records


def test_worth_is_reported_of_what_was_run():
    """Failures, wrong answers, cuts and ratios of two made-up problems, of which one fails without the mechanism."""
    a = Record("a", [], iterations=100, cuts=2, seconds=[2.0, 1.0], forces={"1": [3.0, 4.0, 9.0]})
    b = Record("b", [], iterations=50, seconds=[1.0], forces={"1": [10.0, 0.0, 0.0]})
    a_off = Record("a", ["x"], iterations=130, cuts=3, seconds=[1.5], forces={"1": [3.0, 4.2, 0.0]})
    b_off = Record("b", ["x"], status="failed", reason="Stagnated", forces={})
    records = {(r.problem, tuple(r.off)): r for r in (a, b, a_off, b_off)}
    found = table.worth(records, ["x"], ["a", "b", "c"])
    assert (found.problems, found.failed, found.wrong, found.cuts) == (2, (0, 1), ["a"], (2, 3))
    assert (found.apart, found.iterations, found.seconds) == pytest.approx((0.04, 1.3, 1.5))
    words = "of 2, failures 0 → 1 (b: Stagnated), wrong 1 (a), by up to 4.0%, cuts 2 → 3, iterations +30.0%, time +50%"
    assert str(found) == words
    page = "| `x` | does it | not measured | `cmd` |\n| `y` | too | not measured | `cmd` |\n"
    assert table.rows(table.renewed(page, {"x": "much"}))[0].worth.endswith(": much")
    assert table.rows(table.renewed(page, {"x": "much"}))[1].worth == "not measured"
    assert json.dumps(a.forces)
