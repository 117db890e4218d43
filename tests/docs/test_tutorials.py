"""The tutorials work as printed: every cell runs, and prints what the notebook shows."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")
TUTORIALS = sorted((DOCS / "tutorials").glob("*.ipynb"))


def printed(notebook) -> list[str]:
    """What the cells print, a text for each cell."""
    return ["".join(o["text"] for o in cell.get("outputs", []) if "text" in o) for cell in notebook.cells]


def pictures(notebook) -> list[int]:
    return [sum("image/png" in o.get("data", {}) for o in cell.get("outputs", [])) for cell in notebook.cells]


SLOW = {"springback": pytest.mark.slow}


@pytest.mark.slow
@pytest.mark.parametrize("path", [pytest.param(p, id=p.stem, marks=SLOW.get(p.stem, ())) for p in TUTORIALS])
def test_a_tutorial_runs_and_shows_what_it_says(path, tmp_path, monkeypatch):
    """Run in an empty folder, a tutorial prints its words again and its numbers nearly, and draws its pictures."""
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    monkeypatch.syspath_prepend(str(DOCS))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    sys.modules.pop("run_tutorials", None)
    from run_tutorials import executed

    stored, run = nbformat.read(path, as_version=4), executed(path, tmp_path)
    assert pictures(run) == pictures(stored) and sum(pictures(stored)) >= 2
    for ours, said in zip(printed(run), printed(stored), strict=True):
        assert NUMBER.sub("#", ours).split() == NUMBER.sub("#", said).split()
        for a, b in zip(NUMBER.findall(ours), NUMBER.findall(said), strict=True):
            assert float(a) == pytest.approx(float(b), rel=2e-3, abs=1e-9)


def test_there_are_tutorials():
    """Three of them, each linked from the page on Python."""
    page = (DOCS / "guide" / "python.md").read_text(encoding="utf-8")
    assert len(TUTORIALS) >= 3 and all(f"../tutorials/{p.name}" in page for p in TUTORIALS)
