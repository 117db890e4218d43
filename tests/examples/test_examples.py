"""The gallery runs: every case file describes a problem, every example finds what it states it finds."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from prensa.verify.table import heard, row

EXAMPLES = Path(__file__).parents[2] / "examples"
CASES = sorted(EXAMPLES.glob("*.yaml"))
# by script, what is said of it and is true: the paper's penalty is tried
EXPECTED_WARNINGS = {
    "contact_integration": ("iterations suffer and pressures oscillate; leave it out (beta = 100)",),
}
SCRIPTS = sorted(p for p in EXAMPLES.glob("*.py") if p.stem != "common")
LONG = {"contact_integration", "gallery", "ring_chart"}  # seconds of computation


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch) -> object:
    """Import an example by name, as Python does when it is run from the command line."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module


@pytest.mark.parametrize("path", CASES, ids=lambda p: p.stem)
def test_case_file(path: Path) -> None:
    """It opens with what it shows, its source and what to expect; that it is valid is tested beside the gallery."""
    opening = path.read_text(encoding="utf-8").split("name:")[0]
    assert opening.startswith("# ")
    assert all(f"# {word}" in opening for word in ("Shows", "Source", "Expect"))


@pytest.mark.parametrize(
    "path", [pytest.param(p, id=p.stem, marks=[pytest.mark.slow] if p.stem in LONG else []) for p in SCRIPTS]
)
def test_script(
    path: Path, example: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """An example run with --quick ends well, each error that it prints is within what it allows, and its pictures exist."""
    module: ModuleType = example(path.stem)  # type: ignore[operator]
    out = tmp_path / "out"
    monkeypatch.chdir(tmp_path)
    with heard() as warnings:
        assert module.main(["--quick", "--out", str(out)]) == 0
    parts = EXPECTED_WARNINGS.get(path.stem, ())
    assert [w for w in warnings if not any(p in w for p in parts)] == [], "a good example is warned of nothing"
    printed = capsys.readouterr().out
    errors = list(_errors(printed))
    assert errors, "no comparison with a reference was printed"
    assert all(abs(error) <= allowed for error, allowed in errors)
    pictures = [Path(p) for p in re.findall(r"picture: (.+\.png)", printed)]
    assert pictures and all(p.stat().st_size > 5000 for p in pictures)
    assert all(out in p.parents for p in pictures)
    assert list(tmp_path.iterdir()) == [out], "something was written elsewhere"


def _errors(printed: str) -> list[tuple[float, float]]:
    """Error and what is allowed, as printed, of the rows that have both."""
    found = []
    for line in printed.splitlines():
        columns = [c.strip().removesuffix(" %") for c in line.split("│")[1:-1]]
        if len(columns) == 5 and re.match(r"[+-][\d.]", columns[3]) and re.match(r"[\d.]", columns[4]):
            found.append((float(columns[3]), float(columns[4])))
    return found


def test_the_report_counts_failures(example: object, capsys: pytest.CaptureFixture[str]) -> None:
    """The table of findings counts the rows beyond their tolerance, and only those."""
    common: ModuleType = example("common")  # type: ignore[operator]
    rows = [row("right", 1.0, 1.001, 0.01), row("wrong", 1.0, 1.1, 0.01), row("lost", 1.0, np.nan, 0.01),
            common.beside("another problem", 1.0, 2.0)]  # fmt: skip
    assert common.judged("title", rows) == 2
    assert _errors(capsys.readouterr().out) == [(0.1, 1.0), (10.0, 1.0)]


def test_half_width_is_exact_for_hertz(example: object) -> None:
    """The half-width of a semi-ellipse comes out exactly, whatever the two points at its edge say."""
    common: ModuleType = example("common")  # type: ignore[operator]
    x = np.linspace(0.0, 5.0, 41)
    p = 7.0 * np.sqrt(np.clip(1 - (x / 3.3) ** 2, 0.0, None))
    closed = np.flatnonzero(p > 0)
    p[closed[-2:]] *= (0.9, 1.3)
    assert common.half_width(x[::-1], p[::-1]) == pytest.approx(3.3, rel=1e-9)


@pytest.mark.parametrize("path", [*CASES, *SCRIPTS], ids=lambda p: p.name)
def test_gallery_lists_it(path: Path) -> None:
    """The gallery page names every case and every example."""
    assert f"`{path.name}`" in (EXAMPLES / "README.md").read_text(encoding="utf-8")
