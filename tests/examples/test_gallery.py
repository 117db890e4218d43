"""The gallery of forming processes: what is compared exists, and its page has all of it."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight, staircase
from prensa.measures import parse_all
from prensa.model.plausibility import warnings_of
from prensa.output.starters import STARTERS, starter
from prensa.verify.table import heard

ROOT = Path(__file__).parents[2]
CASES = sorted((ROOT / "examples").glob("*.yaml"))
# what `check` says of an example: true of each, and its description says that means over a passage are meant
EXPECTED_WARNINGS = {
    "drawbead": ["contacts.2: about 6 elements lie in the contact, forces step by 12 %"],
    "flat_rolling": ["contacts.0: about 15 elements lie in the contact, forces step by 5 %"],
    "wire_drawing": ["contacts.0: about 8 elements lie in the contact, forces step by 9 %"],
}


@pytest.fixture
def gallery(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    return importlib.import_module("gallery")


@pytest.mark.slow
def test_every_comparison_finds_its_measures(gallery) -> None:
    """Each example has the measures and steps that its comparison asks for, and each of its numbers a reference and a name."""
    for name, example in gallery._EXAMPLES.items():
        problem = pr.load(ROOT / "examples" / f"{example.case}.yaml", example.changes).problem
        rising = np.linspace(1.0, 2.0, len(problem.steps) + 1)
        table = {m: rising * (k + 1) for k, m in enumerate(parse_all(problem))}
        run = gallery.Run(problem, table, {s.name: k + 1 for k, s in enumerate(problem.steps)})
        rows = list(example.compare(run))
        assert rows and all(r.quantity for r in rows), name
        assert any(np.isfinite(r.reference) for r in rows), name


def test_the_page_shows_every_example(gallery) -> None:
    """It is made of what runs left beside its pictures, all of it: a section with title and picture for each example."""
    folder = ROOT / "docs" / "gallery" / "forming"
    page = folder.with_suffix(".md").read_text(encoding="utf-8")
    assert list(gallery.kept(folder)) == list(gallery._EXAMPLES)
    assert page == gallery.page("forming", gallery.kept(folder))
    for example in gallery._EXAMPLES.values():
        assert f"## {example.title}" in page and f"(forming/{example.case}.png)" in page
        assert (ROOT / "docs" / "gallery" / "forming" / f"{example.case}.png").stat().st_size > 5000


def test_what_was_measured_is_kept(gallery, tmp_path: Path, capsys) -> None:
    """Rows of one run stand beside those of another, to the last bit; no page is written while an example is missing."""
    names = list(gallery._EXAMPLES)
    rows = [gallery.row("a", 1.0, 0.1 + 0.2, 0.5), gallery.beside("b", float("nan"), 2.0)]
    gallery.keep(tmp_path / "page", {names[1]: rows[:1]})
    gallery.keep(tmp_path / "page", {names[0]: rows})
    there = gallery.kept(tmp_path / "page")
    assert list(there) == names[:2] and there[names[1]] == rows[:1]
    assert there[names[0]][0] == rows[0] and np.isnan(there[names[0]][1].reference)
    with pytest.raises(SystemExit):
        gallery.main(["thick_tube", "--page", str(tmp_path / "page")])
    assert "has nothing of" in capsys.readouterr().err
    assert list(gallery.kept(tmp_path / "page")) == [*names[:2], "thick_tube"]


def test_a_case_that_ends_early_is_a_failure(gallery, tmp_path: Path, monkeypatch, capsys) -> None:
    """What cannot be solved is a row that fails, not a comparison that is left out."""
    changes = ("steps.0.increments=1", "numerics.max_cutbacks=0", "numerics.max_iterations=2")
    monkeypatch.setitem(gallery._EXAMPLES, "bad", gallery.Example("bad", "thick_tube", lambda run: [], changes))
    _, rows, _ = gallery.solve("bad")
    assert [r.passed for r in rows] == [False] and "bad: " in capsys.readouterr().err


def test_a_deep_cup_is_not_refused_before_it_begins() -> None:
    """What is looked at before a run finds nothing impossible in a cup that is deeper than its punch is wide."""
    problem = pr.load(ROOT / "examples" / "cup_drawing.yaml", ("steps.1.move.punch.y=-45",)).problem
    assert [str(n) for n in preflight(pr.discretise(problem)) if n.fatal] == []


@pytest.mark.parametrize("path", CASES, ids=lambda p: p.stem)
def test_check_says_of_an_example_what_is_true_and_nothing_else(path: Path) -> None:
    """An example, and the case that ``prensa new`` makes of it, is doubted in nothing but what is known of it."""
    problem = pr.load(path).problem
    system = pr.discretise(problem)
    said = [*warnings_of(problem), *map(str, preflight(system)), *map(str, staircase(system))]
    assert [words.partition(" as ")[0] for words in said] == EXPECTED_WARNINGS.get(path.stem, [])


def test_every_starter_is_an_example() -> None:
    """What ``prensa new`` writes is one of the cases whose warnings are known."""
    texts = {p.read_text(encoding="utf-8") for p in CASES}
    assert all(starter(kind) in texts for kind in STARTERS)


def test_every_starter_goes_into_the_wheel() -> None:
    """``prensa new`` finds its examples where prensa is installed, and there is no example that it does not know."""
    text = (CASES[0].parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    packed = {p.stem for p in CASES if f'"examples/{p.name}" = "prensa/examples/{p.name}"' in text}
    assert {name for name, _ in STARTERS.values()} == packed == {p.stem for p in CASES}


EXTRAPOLATED = "was measured up to a plastic strain of 0.14"
SAID = {"forging_window": (EXTRAPOLATED,)}  # what an example's own heading announces


@pytest.mark.slow
@pytest.mark.parametrize("path", CASES, ids=lambda p: p.stem)
def test_an_example_that_is_not_compared_runs_to_its_end_and_nothing_is_reported(gallery, path: Path) -> None:
    """What no comparison of the gallery runs is run here: all of it, without a warning."""
    if path.stem in {e.case for e in gallery._EXAMPLES.values()}:
        return
    case = pr.load(path)
    with heard() as warnings:
        *_, last = pr.solve(case.problem, case.numerics)
    assert last.time == len(case.problem.steps)
    assert [w for w in warnings if not any(words in w for words in SAID.get(path.stem, ()))] == []


def test_a_warning_that_is_not_meant_is_a_failing_row(gallery, monkeypatch) -> None:
    """A run of the gallery that warns of something that its example does not declare fails; what is declared does not."""
    changes = ("bodies.tube.material.E=70", "steps.0.increments=1")
    for declared, passed in (((), False), (("E = 70 in N/mm²", "energy balance off by"), True)):
        doubted = gallery.Example("doubted", "thick_tube", lambda run: [], changes, expected_warnings=declared)
        monkeypatch.setitem(gallery._EXAMPLES, "doubted", doubted)
        _, rows, _ = gallery.solve("doubted")
        assert all(r.passed for r in rows) is passed and (passed or any("did you mean" in r.quantity for r in rows))
