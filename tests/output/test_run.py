import json
import logging
import re
import signal
from dataclasses import replace

import pytest

import prensa as pr
from prensa.errors import PrensaError, SolveError
from prensa.model.schema import loads
from prensa.output import pictures
from prensa.output.history import read_history
from prensa.output.interrupt import Interruptible
from prensa.output.report import read_summary, write_report
from prensa.output.run import resume, run
from prensa.output.vtk import read_collection
from problems import stroke, upset_block
from stopped import stop_at

CONTACT = "block.top-punch"


def small(increments: int = 6, **output) -> pr.Case:
    """A plastic block under a plane with friction: every table has something to say, in a fraction of a second."""
    problem = upset_block(
        stroke(-0.2, increments=increments, tool="punch"), stroke(-0.19, increments=3, tool="punch", name="back"),
        material=pr.J2(70e3, 0.3, pr.Linear(100, 500)), size=(4, 3), n=(4, 3), body="block", plane="punch",
        friction=pr.Coulomb(0.1), name="small",
    )  # fmt: skip
    from prensa.model.problem import Output

    return pr.Case(problem, output=Output(**({"pictures": False, "report": False} | output)))


def files(directory) -> dict[str, bytes]:
    """Contents of everything that must not depend on how often a run was stopped."""
    kept = ("history.csv", "convergence.csv", "fields.pvd", "fields/*.vtu", "contact/*/*.csv")
    return {str(p.relative_to(directory)): p.read_bytes() for pattern in kept for p in sorted(directory.glob(pattern))}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    directory = tmp_path_factory.mktemp("results")
    return run(small(pictures=True, report=True), directory, quiet=True, source="small.yaml")


def test_a_report_says_whose_thickness_its_forces_are(done, tmp_path):
    """Per unit thickness where none is given; of a strip of 3 mm those of 3 mm, in N."""
    assert "per unit thickness" in (done.directory / "report.html").read_text()
    problem = replace(small().problem, thickness=3.0, name="strip")
    page = (run(pr.Case(problem, output=small(report=True).output), tmp_path, quiet=True).directory / "report.html").read_text()
    assert "of a thickness of 3 mm" in page and "per unit thickness" not in page and "N/mm<" not in page


def test_a_run_leaves_everything_that_is_promised(done):
    """Tables, fields, checkpoint, summary, log, pictures and report are there under their stable names."""
    there = {str(p.relative_to(done.directory)) for p in done.directory.rglob("*") if p.is_file()}
    n = done.increment.number
    assert {"history.csv", "fields.pvd", "checkpoint.h5", "summary.json", "run.log", "report.html"} <= there
    assert {f"fields/{k:04d}.vtu" for k in range(1, n + 1)} <= there
    assert {f"contact/{CONTACT}/{k:04d}.csv" for k in range(1, n + 1)} <= there
    assert {f"pictures/{name}.png" for name in ("deformed", "force_stroke", f"pressure_{CONTACT}")} <= there
    assert not [name for name in there if name.endswith(".part")]


def test_summary_and_history_tell_what_the_increment_holds(done):
    """The last force is the same number in the increment, the history, the summary and as a measure."""
    force = done.increment.force("punch").y
    assert force == done.history["punch.fy"][-1] == read_summary(done.directory)["last_force"]["punch"]["y"]
    assert force == done.increment.measure("punch.force.y")
    summary = done.summary
    assert (summary["status"], summary["reason"], summary["version"]) == ("completed", "", pr.__version__)
    assert re.fullmatch("[0-9a-f]{64}", summary["input_hash"])
    assert summary["totals"]["increments"] == len(done.history["time"]) and summary["totals"]["time"] == 2.0
    assert sum(summary["timings"].values()) == pytest.approx(summary["totals"]["wall_seconds"])


def test_the_log_has_every_iteration_and_ends_with_the_wall_times(done):
    """run.log holds one line per iteration of every accepted increment, and the table of sections at its end."""
    text = (done.directory / "run.log").read_text()
    assert text.count("residual") >= sum(done.history["iterations"])
    assert text.count("accepted") == len(done.history["time"])
    assert "wall time by section" in text and text.splitlines()[-1].startswith("total")


def test_the_report_stands_alone_and_describes_the_run(done):
    """report.html holds name, forces, pictures, energy balance, convergence, timings and input, and fetches nothing."""
    page = (done.directory / "report.html").read_text()
    for part in (
        "<h1>small</h1>",
        "completed",
        "punch",
        CONTACT,
        "Energy balance",
        "Convergence",
        "Wall time",
        "small.yaml",
    ):
        assert part in page
    assert page.count("data:image/png;base64,") == len(list((done.directory / "pictures").glob("*.png"))) >= 5
    assert not re.search(r"(src|href)=[\"'](?!data:)", page) and "url(" not in page and "://" not in page
    assert done.summary["case"].splitlines()[0] in page


def test_names_cannot_break_the_report(tmp_path):
    """A name with markup is shown as it is written."""
    result = run(small(increments=1), tmp_path, quiet=True)
    summary = result.summary | {"name": "<script>alert(1)</script>"}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    assert "<script>" not in write_report(tmp_path).read_text()


def test_a_run_interrupted_and_resumed_leaves_the_same_files(tmp_path, monkeypatch):
    """Ctrl-C in the middle, then resume: history, contacts and fields are those of the uninterrupted run, byte for byte."""
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    run(small(), whole, quiet=True)
    with monkeypatch.context() as patch:
        stop_at(patch, 4, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            run(small(), stopped, quiet=True)
    assert read_summary(stopped)["status"] == "interrupted"
    assert read_history(stopped)["increment"].tolist() == [1, 2, 3]
    assert len(read_collection(stopped / "fields.pvd")) == 3
    result = resume(stopped, quiet=True)
    assert result.status == "completed" and files(stopped) == files(whole)
    totals = [read_summary(d)["totals"] for d in (whole, stopped)]
    assert all(totals[0][k] == totals[1][k] for k in ("increments", "iterations", "cutbacks", "time"))


def test_what_came_after_the_checkpoint_is_done_again(tmp_path, monkeypatch):
    """A machine lost between two checkpoints costs increments, not correctness."""
    from prensa.output import run as module

    whole, lost = tmp_path / "whole", tmp_path / "lost"
    run(small(), whole, quiet=True)
    with monkeypatch.context() as patch:
        patch.setattr(module, "CHECKPOINT_SHARE", 1e-12)
        stop_at(patch, 5, RuntimeError("power cut"))
        patch.setattr(module._Run, "_finish", lambda self, status, reason: {})
        with pytest.raises(RuntimeError):
            run(small(), lost, quiet=True)
    assert read_history(lost)["increment"].tolist() == [1, 2, 3, 4]
    resume(lost, quiet=True)
    assert files(lost) == files(whole)


def test_resuming_a_completed_run_changes_nothing(tmp_path):
    """When nothing is left to do, the files stay and the status is completed."""
    run(small(increments=2), tmp_path, quiet=True)
    before = files(tmp_path)
    result = resume(tmp_path, quiet=True)
    assert result.increment is None and result.status == "completed" and files(tmp_path) == before


def test_a_tool_that_touched_before_the_run_was_continued_has_touched(tmp_path):
    """Pressed and lifted off, then continued: nothing is reported that was not reported before, 'never touched' least of all."""
    case, lift = small(increments=2), pr.Step("lift", by={"punch": pr.Motion(y=0.5)}, increments=2)
    case = replace(case, problem=replace(case.problem, steps=(case.problem.steps[0], lift), friction=None))
    first = run(case, tmp_path, quiet=True).summary["warnings"]
    assert not any("never touched" in w for w in first)
    assert resume(tmp_path, quiet=True).summary["warnings"] == first


def test_a_resumed_run_knows_that_its_space_was_stated(tmp_path):
    """A billet at x = 0 in a stated plane strain is no round one whose 'space' is missing, before a resume and after it."""
    text = """
        name: billet
        space: plane strain
        bodies: {billet: {mesh: {type: rectangle, size: [4, 3], n: [4, 3]}, material: {type: elastic, E: 100, nu: 0.3}}}
        tools: {punch: {type: plane, touching: billet.top}}
        fixed: {billet.bottom: y, billet.left: x}
        steps: [{name: press, move: {punch: {y: -0.02}}, increments: 1}]
        output: {pictures: false, report: false}
    """
    first = run(loads(text), tmp_path, quiet=True).summary["warnings"]
    assert first == resume(tmp_path, quiet=True).summary["warnings"] == []


def test_a_failure_is_recorded_and_raised(tmp_path, monkeypatch):
    """When the march gives up, the summary says why, the last good state stays, and the error goes on to the caller."""
    stop_at(monkeypatch, 3, SolveError("step 'press': did not converge. What to try: more increments."))
    with pytest.raises(PrensaError, match="more increments"):
        run(small(pictures=True, report=True), tmp_path, quiet=True)
    summary = read_summary(tmp_path)
    assert summary["status"] == "failed" and "more increments" in summary["reason"]
    assert summary["totals"]["increments"] == 2 and (tmp_path / "checkpoint.h5").is_file()
    assert "more increments" in (tmp_path / "report.html").read_text()


def test_a_failure_before_the_first_increment_leaves_a_summary_and_a_report(tmp_path, monkeypatch):
    """With nothing computed there is still an honest summary and a page that says so."""
    stop_at(monkeypatch, 1, SolveError("the first increment did not converge"))
    with pytest.raises(SolveError):
        run(small(pictures=True, report=True), tmp_path, quiet=True)
    assert read_summary(tmp_path)["totals"]["increments"] == 0
    assert "No increment was completed" in (tmp_path / "report.html").read_text()


def test_old_results_go_and_everything_else_stays(tmp_path, done):
    """A new run in a used folder removes the files of the old one by name, and nothing else."""
    run(small(), tmp_path, quiet=True)
    mine = [tmp_path / "notes.txt", tmp_path / "fields" / "mine.vtu", tmp_path / "contact" / CONTACT / "mine.csv",
            tmp_path / "pictures" / "holiday.png", tmp_path / "contact" / "other" / "0001.csv"]  # fmt: skip
    for path in mine:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    run(small(increments=1), tmp_path, quiet=True)
    assert all(path.read_text() == "mine" for path in mine)
    assert sorted(p.name for p in (tmp_path / "fields").glob("0*")) == ["0001.vtu", "0002.vtu", "0003.vtu", "0004.vtu"]


def test_a_case_that_cannot_be_made_leaves_old_results_alone(tmp_path, monkeypatch):
    """A description that cannot be discretised is refused before anything is removed."""
    run(small(increments=1), tmp_path, quiet=True)
    before = files(tmp_path)

    def discretise(problem):
        raise PrensaError("tools.punch: touches nothing")

    monkeypatch.setattr("prensa.output.run.discretise", discretise)
    with pytest.raises(PrensaError, match="touches nothing"):
        run(small(increments=2), tmp_path, quiet=True)
    assert files(tmp_path) == before


def test_fields_are_written_as_often_as_asked(tmp_path):
    """fields: 0 writes the last increment of each step only."""
    run(small(increments=2, fields=0), tmp_path, quiet=True)
    assert [name for _, name in read_collection(tmp_path / "fields.pvd")] == ["fields/0002.vtu", "fields/0005.vtu"]


def test_a_picture_that_cannot_be_drawn_is_a_warning(tmp_path, monkeypatch):
    """A broken picture costs a warning in summary and log, not the run."""
    monkeypatch.setattr(pictures.plot, "energy", lambda *a: 1 / 0)
    result = run(small(increments=1, pictures=True), tmp_path, quiet=True)
    assert result.status == "completed"
    assert any("energy.png could not be drawn: ZeroDivisionError" in w for w in result.summary["warnings"])


def test_logging_is_as_before_after_a_run(tmp_path):
    """A run leaves neither handlers nor a level on the logger of the package, nor a handler on SIGINT."""
    log = logging.getLogger("prensa")
    before = signal.getsignal(signal.SIGINT)  # a background process ignores it
    run(small(increments=1), tmp_path, quiet=True)
    assert log.handlers == [] and log.level == logging.NOTSET
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_waits_for_the_writer_and_not_for_the_solver():
    """Inside a held block SIGINT is postponed to its end; outside it acts at once."""
    reached = []
    with Interruptible() as guard:
        with pytest.raises(KeyboardInterrupt), guard.postponed():
            signal.raise_signal(signal.SIGINT)
            reached.append("end of the block")
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
            for _ in range(1000):
                pass
            reached.append("never")
    assert reached == ["end of the block"]


def test_a_problem_runs_with_defaults_as_its_case_does(tmp_path):
    """The output and numerics of `Case`."""
    problem = pr.Problem(
        "bar", bodies={"bar": pr.Body(pr.Rectangle((2.0, 1.0), n=(2, 1)), pr.Elastic(1000.0, 0.3))}, tools={},
        fixed={"bar.left": "x", "bar.bottom-left": "y"}, steps=[pr.Step("pull", fixed={"bar.right": {"x": 0.01}}, increments=1)],
    )  # fmt: skip
    pr.run(problem, tmp_path / "a", quiet=True)
    pr.run(pr.Case(problem), tmp_path / "b", quiet=True)
    assert (tmp_path / "a" / "history.csv").read_bytes() == (tmp_path / "b" / "history.csv").read_bytes()
