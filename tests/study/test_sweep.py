"""Sweeps: every case once, whatever happens in between, and a table that is always the same."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from press import CASE, LAW, written
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.errors import PrensaError
from prensa.output.history import read_history
from prensa.study import engine
from prensa.study.attachments import attached, detached
from prensa.study.results import CASES_TABLE, Study

MU = "friction.mu"
PLACE = "block.right.x at y=0.5"
HEIGHT = "steps.0.move.punch.y"
MEASURES = ["end(punch.fy, down)", "max(energy.plastic)"]
VOLATILE = {"run.log", "summary.json"}  # dates and wall times


def swept(folder: Path, values: dict[str, object], out: str = "out", **options: object) -> Study:
    """A sweep of the small case, one case after the other."""
    path = folder / "press.yaml"
    options = {"jobs": 1, "quiet": True, "measures": MEASURES} | options
    return pr.sweep(path if path.exists() else written(folder), values, out=folder / out, **options)  # type: ignore[arg-type]


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder that must not depend on when and how it came about."""
    files = [f for f in folder.rglob("*") if f.is_file() and f.name not in VOLATILE and f.name != "timings.csv"]
    return {f.relative_to(folder).as_posix(): f.read_bytes() for f in files}


def starts(folder: Path) -> int:
    """How many runs began in the folder of a case."""
    return (folder / "run.log").read_text().count("case 'pressed block'")


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """A sweep of 2 × 2 cases, half of which must fail: the punch goes through the support."""
    return swept(tmp_path_factory.mktemp("grid"), {MU: [0, 0.2], HEIGHT: [-0.1, -1.5]})


def test_a_sweep_says_of_each_case_what_its_run_says(grid: Study) -> None:
    """Values in the table are those of a run of the case with the same changes."""
    result = pr.run(
        pr.load(grid.directory.parent / "press.yaml", [f"{MU}=0.2"]), out=grid.directory.parent / "alone", quiet=True
    )
    row = grid.rows[2]
    assert row.point.values == {MU: "0.2", HEIGHT: "-0.1"}
    history = result.history
    assert row.values[MEASURES[0]] == history["punch.fy"][2] > 0
    assert row.values[MEASURES[1]] == history["energy.plastic"].max()
    alone, ours = read_history(result.directory), read_history(grid.directory / row.folder)
    assert all(np.array_equal(alone[c], ours[c]) for c in alone)


def test_a_failed_case_is_reported_with_its_reason_and_others_go_on(grid: Study) -> None:
    """Cases that cannot be computed have their reason in the table, on the page and no values; the rest is complete."""
    assert [row.status for row in grid.rows] == ["completed", "failed"] * 2
    assert all(row.reason and not row.values for row in grid.rows[1::2])
    table = (grid.directory / CASES_TABLE).read_text().splitlines()
    assert table[0] == f'case,{MU},{HEIGHT},"{MEASURES[0]}",{MEASURES[1]},status,reason,folder'
    assert table[2].startswith("2,0,-1.5,,,failed,")
    assert np.isnan(grid[MEASURES[0]][[1, 3]]).all() and np.isfinite(grid[MEASURES[0]][[0, 2]]).all()
    page = grid.page.read_text(encoding="utf-8")
    assert "2 without a result" in page and "data:image/png" in page


def test_tables_agree(grid: Study) -> None:
    """CSV, Parquet and data frame hold the same."""
    pandas = pytest.importorskip("pandas")
    frame = grid.to_frame()
    assert list(frame.columns) == grid.columns
    pandas.testing.assert_frame_equal(frame, pandas.read_parquet(grid.directory / "table.parquet"), check_dtype=False)
    csv = pandas.read_csv(grid.directory / CASES_TABLE, keep_default_na=False, na_values={m: [""] for m in MEASURES})
    pandas.testing.assert_frame_equal(frame, csv, check_dtype=False, check_exact=True)


def test_only_what_is_new_is_computed(tmp_path: Path) -> None:
    """More values, other measures and another order compute what is missing and nothing else; the table is that of one go."""
    first = swept(tmp_path, {MU: [0, 0.2]}, measures=["punch.force.y", PLACE])
    before = {row.folder: (first.directory / row.folder / "case.json").stat().st_mtime_ns for row in first.rows}
    more = swept(tmp_path, {MU: [0.2, 0.1, 0.0]}, measures=["energy.friction", f"max({PLACE})"])
    assert [more.rows[0].folder, more.rows[2].folder] == [first.rows[1].folder, first.rows[0].folder]
    for folder, stamp in before.items():
        assert (more.directory / folder / "case.json").stat().st_mtime_ns == stamp
    at_once = swept(tmp_path, {MU: [0.2, 0.1, 0.0]}, "once", measures=["energy.friction", f"max({PLACE})"])
    assert (at_once.directory / CASES_TABLE).read_bytes() == (more.directory / CASES_TABLE).read_bytes()
    assert all(2 < v < 2.4 for v in more[f"max({PLACE})"])
    other = swept(tmp_path, {MU: [0.2], "numerics.tolerance": [1e-8]})
    assert other.rows[0].folder not in before  # another case, however small the difference


def test_equal_cases_are_one(tmp_path: Path) -> None:
    """Values that make the same case are computed once; a new version of prensa computes anew."""
    study = swept(tmp_path, {MU: "0, 0.0, 0e0"})
    assert len(study.rows) == 3 and len({row.folder for row in study.rows}) == 1
    assert len(list((study.directory / "cases").iterdir())) == 1
    from prensa.study import work

    assert work.key_of("text") != work.text_hash("text")


@pytest.mark.slow
def test_interrupted_anywhere_and_resumed_it_is_as_if_it_had_not_been(tmp_path: Path) -> None:
    """A sweep, some of its cases failing, is killed at random moments, twice, and continued: every file is the same."""
    written(tmp_path)
    values = ["--set", f"{MU}=0,0.1,0.2", "--set", f"{HEIGHT}=-0.1,-1.5"]
    asked = [*values, *(x for m in MEASURES for x in ("--measure", m))]
    command = [
        sys.executable,
        "-W",
        "error",
        "-m",
        "prensa",
        "sweep",
        "press.yaml",
        *asked,
        "--out",
        "killed",
        "--jobs",
    ]
    pause = random.Random(1)
    for jobs in ("2", "1"):
        process = subprocess.Popen([*command, jobs], cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE)
        folder, deadline = tmp_path / "killed" / "cases", time.monotonic() + 60
        had = len(list(folder.glob("*/case.json")))
        while len(list(folder.glob("*/case.json"))) <= had and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(pause.uniform(0, 0.3))
        process.send_signal(signal.SIGKILL)
        process.communicate()
    done = {f: f.stat().st_mtime_ns for f in (tmp_path / "killed").glob("cases/*/case.json")}
    assert done
    subprocess.run([*command, "1"], cwd=tmp_path, check=True, capture_output=True)
    assert all(f.stat().st_mtime_ns == stamp for f, stamp in done.items())
    whole = swept(tmp_path, {MU: "0,0.1,0.2", HEIGHT: "-0.1,-1.5"}, "whole")
    assert whole.status == {"completed": 3, "failed": 3}
    ours, theirs = contents(tmp_path / "killed"), contents(tmp_path / "whole")
    ours.pop("sweep.json"), theirs.pop("sweep.json")  # the name of the file, relative or not
    assert sorted(ours) == sorted(theirs)
    assert [name for name in ours if ours[name] != theirs[name]] == []


@pytest.mark.slow
def test_a_killed_worker_is_survived(tmp_path: Path) -> None:
    """A case whose worker is killed goes to another; one that kills every worker is reported and does not end the sweep."""
    (tmp_path / "deadly.py").write_text(LAW, encoding="utf-8")
    written(tmp_path, text=CASE.replace("type: ludwik", "type: 'deadly:Deadly'"))
    study = swept(tmp_path, {"bodies.block.material.flow.K": [500, 501, 502]}, jobs=1, memory="1GB")
    assert [row.status for row in study.rows] == ["completed", "completed", "lost"]
    assert "killed" in study.rows[2].reason
    assert (tmp_path / "killed-501").exists()


def test_bad_requests_are_reported_before_anything_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, exit code 2, and no folder: for whatever does not exist or makes no sense."""
    monkeypatch.setattr(engine, "CONNECT", 0.5)
    path = written(tmp_path)
    good = ["--set", f"{MU}=0,0.1", "--measure", "punch.fy", "--jobs", "1"]
    for asked, words in (
        (["--measure", "punch.fy"], "nothing to vary"),
        (["--set", f"{MU}=", "--measure", "punch.fy"], "there is no value"),
        (["--set", f"{MU}=0,0.1"], "no measure; say what to take"),
        (["--set", f"{MU}=0,0.1", "--measure", "punch.fz"], "did you mean 'punch."),
        (["--set", f"{MU}=0,0.1", "--measure", "most(punch.fy)"], "unknown function 'most'"),
        (["--set", f"{MU}=0,0.1", "--measure", "at(punch.fy, 3)"], "not a time between 0 and 2"),
        (["--set", f"{MU}=0,0.1", "--measure", "end(punch.fy, dwon)"], "did you mean 'down'?"),
        (["--set", "friction.mx=0,0.1", "--measure", "punch.fy"], "unknown key 'mx'"),
        (["--set", "tools.die.x=0,0.1", "--measure", "punch.fy"], "unknown tool 'die'"),
        (["--set", f"{MU}=0.1,-0.1", "--measure", "punch.fy"], "must be at least 0"),
        (["--set", f"{MU}=normal(0, 1)", "--measure", "punch.fy"], "cut the tails off"),
        ([*good, "--cluster", "nowhere.json"], "leave --jobs and --memory out"),
        ([*good[:-2], "--cluster", "nowhere.json"], "no scheduler file"),
        ([*good[:-2], "--cluster", "here"], "give an address"),
        ([*good[:-2], "--cluster", "tcp://127.0.0.1:1"], "no Dask cluster at"),
        ([*good, "--memory", "much"], "not an amount of memory"),
        ([*good, "--samples", "8"], "nothing is scattered"),
    ):
        result = CliRunner().invoke(app, ["sweep", str(path), *asked, "--out", str(tmp_path / "out")])
        assert result.exit_code == 2, result.output
        assert words in result.output and len(result.output.strip().splitlines()) == 1, result.output
    assert not (tmp_path / "out").exists()


def test_a_folder_of_something_else_is_refused(grid: Study, tmp_path: Path) -> None:
    """The folder of a run and that of a sweep of another case are not taken."""
    other = written(tmp_path, text=CASE.replace("pressed block", "another"))
    with pytest.raises(PrensaError, match="here is a study of the case 'pressed block'"):
        pr.sweep(other, {MU: [0]}, ["punch.fy"], out=grid.directory, jobs=1)
    with pytest.raises(PrensaError, match="holds the results of a run"):
        pr.sweep(other, {MU: [0]}, ["punch.fy"], out=grid.directory / grid.rows[0].folder, jobs=1)


def test_what_scatters_has_quantiles(tmp_path: Path) -> None:
    """Quantiles and moments of a measure are those of its samples; a case in Python is as good as a file."""
    case = pr.load(written(tmp_path))
    study = pr.sweep(case, {MU: "uniform(0, 0.2)"}, [MEASURES[0]], samples=4, out=tmp_path / "out", jobs=1, quiet=True)
    ((given, count, mean, sd, at),) = study.quantiles(MEASURES[0])
    values = study[MEASURES[0]]
    assert (given, count) == ({}, 4) and len(set(values)) == 4
    assert (mean, sd) == pytest.approx((values.mean(), values.std(ddof=1)))
    assert at == pytest.approx(np.quantile(values, [0.05, 0.25, 0.5, 0.75, 0.95]))
    assert [int(v) for v in study["sample"]] == [0, 1, 2, 3]


def test_reports_are_written_when_asked_for(tmp_path: Path) -> None:
    """Without reports a case leaves tables and the last fields; with them, everything that a run leaves."""
    bare = swept(tmp_path, {MU: [0.1]})
    folder = bare.directory / bare.rows[0].folder
    assert len(list(folder.glob("fields/*.vtu"))) == 2 and not (folder / "report.html").exists()
    swept(tmp_path, {MU: [0.1]}, reports=True)
    assert len(list(folder.glob("fields/*.vtu"))) == 5 and (folder / "report.html").exists()
    request = json.loads((bare.directory / "sweep.json").read_text())
    assert request["factors"] == {MU: ["0.1"]} and request["name"] == "pressed block"


def test_files_of_a_case_are_known_by_their_content(tmp_path: Path) -> None:
    """A detached text does not say where files lie; attached again it is the case, and other contents make another text."""
    (tmp_path / "deadly.py").write_text(LAW, encoding="utf-8")
    path = written(tmp_path, text=CASE.replace("type: ludwik", "type: 'deadly:Deadly'"))
    text = pr.dump(pr.load(path))
    bare, files = detached(text)
    assert str(tmp_path) not in bare and [one.name for one in files] == ["deadly.py"]
    assert attached(bare, {one.short: one.origin for one in files}) == text
    (tmp_path / "deadly.py").write_text(LAW + "\n# changed\n", encoding="utf-8")
    assert detached(text)[0] != bare
    assert detached(CASE) == (CASE, ())


def test_without_dask_one_case_is_computed_after_the_other(monkeypatch):
    """Unless several processes are asked for, which is refused with what to install."""
    monkeypatch.setattr("prensa.study.engine.find_spec", lambda name: None)
    monkeypatch.setattr("prensa.study.engine.available_cores", lambda: 4)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with engine.engine(None, None, None, ()) as found:
        assert isinstance(found, engine.Here) and "pip install prensa[dask]" in found.summary
    with pytest.raises(PrensaError, match=r"pip install prensa\[dask\]"), engine.engine(2, None, None, ()):
        pass


def test_friction_that_no_contact_has_is_not_varied(tmp_path: Path) -> None:
    """All cases would be the same: refused with the path that is meant, and warned of where a case has it."""
    path = tmp_path / "own.yaml"
    own = CASE.replace("against: punch}", "against: punch, friction: {mu: 0.1}}")
    path.write_text(own.replace("friction: {type: coulomb, mu: 0.1}\n", ""))
    words = r"--set friction\.mu=0: every contact has a friction of its own.*'contacts\.0\.friction'"
    with pytest.raises(PrensaError, match=words):
        pr.sweep(path, {MU: [0, 0.2]}, out=tmp_path / "out", jobs=1, quiet=True, measures=MEASURES)
    path.write_text(own)
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 0 and "friction: every contact has a friction of its own" in done.output.replace("\n", " ")
