"""The gallery of forming processes: what is compared exists, and its page has all of it."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.fem.preflight import preflight
from prensa.measures import parse_all

ROOT = Path(__file__).parents[2]


@pytest.fixture
def gallery(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    return importlib.import_module("gallery")


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


def test_no_example_is_refused_before_it_begins(gallery) -> None:
    """What is looked at before a run finds nothing impossible: not in a cup either that is deeper than its punch is wide."""
    for case in {e.case for e in gallery._EXAMPLES.values()}:
        changes = ("steps.1.move.punch.y=-45",) if case == "cup_drawing" else ()
        notices = preflight(pr.discretise(pr.load(ROOT / "examples" / f"{case}.yaml", changes).problem))
        assert [str(n) for n in notices if n.fatal] == []
