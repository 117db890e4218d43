"""Runs that are still going or were killed: viewed, plotted and reported as far as they came; resumed to the same bits."""

import importlib
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import matplotlib.pyplot as plt
import pytest

import prensa as pr
from prensa.cli.voice import TERMINATED
from prensa.errors import PrensaError
from prensa.model.schema import dump
from prensa.output import run as module
from prensa.output import vtk
from prensa.output.interrupt import Interruptible, Terminated
from prensa.output.report import write_report
from prensa.output.run import resume, run
from prensa.study.work import RECORD
from problems import stroke, upset_block
from stopped import stopped_after as stopped_at

save = module._Run._save
pytestmark = pytest.mark.skipif(os.name != "posix", reason="processes are stopped and killed by their signals")


def small(increments: int = 200) -> pr.Case:
    """An elastic-plastic block under a plane with friction, in many increments."""
    problem = upset_block(
        stroke(-0.2, increments=increments, tool="punch"), material=pr.J2(70e3, 0.3, pr.Linear(100, 500)), size=(4, 3), n=(4, 3),
        body="block", plane="punch", friction=pr.Coulomb(0.1), name="small",
    )  # fmt: skip
    return pr.Case(problem, output=pr.Output(pictures=False, report=False))


def stopped_after(rows: int, folder, case) -> subprocess.Popen:
    """A process that runs *case*, stopped when its history has so many rows (0: when its summary is there)."""
    case.write_text(dump(small()))
    command = [sys.executable, "-m", "prensa", "run", str(case), "--out", str(folder), "--quiet"]
    process = subprocess.Popen(command)
    table, summary, deadline = folder / "history.csv", folder / "summary.json", time.monotonic() + 60
    while not summary.is_file() or table.read_text().count("\n") <= rows:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.001)
    process.send_signal(signal.SIGSTOP)
    return process


def shown(folder, status: str) -> int:
    """Everything is read and drawn, and says how far the run came; number of increments."""
    result = pr.results(folder)
    n = len(result.increments)
    words = f"{status}: as far as increment {n}, time {result.increment.time:.6g} of 1"
    assert result.status == status and words in str(result) and words in result._repr_html_()
    assert all(i.contacts["block.top-punch"].pressure.max() > 0 for i in result.increments)
    assert f"as far as increment {n}" in write_report(folder).read_text()
    for what in ("force_stroke", "energy", "convergence", "mises", "pressure"):
        plt.close(result.plot(what))
    return n


def test_a_run_that_goes_on_and_then_is_killed_is_seen_as_far_as_it_came(tmp_path):
    """Stopped while it holds the folder it is running, then killed; a cut row is left out; a resume gives the same tables."""
    folder = tmp_path / "killed"
    process = stopped_after(3, folder, tmp_path / "small.yaml")
    try:
        n = shown(folder, "running")
    finally:
        process.kill()
    assert process.wait() == -signal.SIGKILL
    assert n >= 3 and shown(folder, "killed") == n
    with open(folder / "history.csv", "a") as file:
        file.write("press,9")
    assert shown(folder, "killed") == n
    (folder / "summary.json").unlink()  # as earlier versions left a killed run
    assert shown(folder, "killed") == n
    resume(folder, quiet=True)
    whole = run(small(), tmp_path / "whole", quiet=True).directory
    for name in ("history.csv", "convergence.csv", "fields.pvd"):
        assert (folder / name).read_bytes() == (whole / name).read_bytes()
    assert pr.results(folder).status == "completed"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["plain", "calibrating"])
def test_whatever_stops_a_computation_it_goes_on(kind, tmp_path):
    """Signals at random moments, files being replaced among them: seen as far as it came, same bytes, nothing computed twice."""
    command = [sys.executable, "-m", "prensa_bench.killed", "--kind", kind, "--count", "2", "--seed", "5"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_sigterm_ends_a_run_as_ctrl_c_does(tmp_path):
    """Checkpoint and summary are written; the exit code is that of the signal."""
    folder = tmp_path / "ended"
    process = stopped_after(1, folder, tmp_path / "small.yaml")
    process.send_signal(signal.SIGTERM)
    process.send_signal(signal.SIGCONT)
    assert process.wait(60) == TERMINATED
    result = pr.results(folder)
    assert result.status == "interrupted" and "SIGTERM" in result.summary["reason"]
    assert (folder / "checkpoint.h5").is_file() and len(result.increments) >= 1


def test_a_run_killed_while_it_makes_room_is_empty(tmp_path, monkeypatch):
    """Of earlier results the summary goes first and the log last: no half of them is shown, and the folder stays its case's."""
    folder = run(small(increments=15), tmp_path / "twice", quiet=True).directory
    unlink = pathlib.Path.unlink

    def dies(path, missing_ok=False):
        if path.name == "history.csv":
            raise SystemExit
        unlink(path, missing_ok=missing_ok)

    with monkeypatch.context() as patch:
        patch.setattr(pathlib.Path, "unlink", dies)
        with pytest.raises(SystemExit):
            run(small(increments=15), folder, quiet=True)
    with pytest.raises(PrensaError, match="no increment was completed"):
        pr.results(folder)
    assert run(small(increments=15), folder, quiet=True).status == "completed"


def test_contacts_of_later_increments_go_after_their_rows(tmp_path, monkeypatch):
    """A resume that is killed at once leaves no increment whose contact tables are gone."""
    folder = tmp_path / "resumed"
    shutil.copytree(begun(tmp_path / "run", monkeypatch, 12), folder)
    monkeypatch.setattr(vtk.Fields, "__init__", lambda *_: (_ for _ in ()).throw(SystemExit))
    with pytest.raises(SystemExit):
        resume(folder, quiet=True)
    assert all(i.contacts for i in pr.results(folder).increments)


def begun(folder, monkeypatch, number):
    """The folder of a run whose checkpoint stands before its last increment."""
    with monkeypatch.context() as patch:
        patch.setattr(module._Run, "_save", lambda self, i: save(self, i) if i.number <= number - 4 else None)
        stopped_at(small(increments=15), folder, number)
    return folder


def test_a_folder_that_holds_only_the_beginning_of_a_run_says_so(tmp_path):
    """A log and no table: one sentence."""
    (tmp_path / "run.log").write_text("")
    for ask in (pr.results, write_report):
        with pytest.raises(PrensaError, match="killed: no increment was completed; there is nothing to show"):
            ask(tmp_path)


@pytest.mark.slow
def test_sigterm_ends_a_sweep_with_what_is_computed_kept(tmp_path):
    """As Ctrl-C does: exit code of the signal, a sentence, and the same command computes the rest alone."""
    case, folder = tmp_path / "small.yaml", tmp_path / "swept"
    case.write_text(dump(small(40)))
    command = [sys.executable, "-m", "prensa", "sweep", str(case), "--set", "friction.mu=lin(0,0.3,8)", "--measure", "punch.fy"]
    command += ["--jobs", "1", "--out", str(folder)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        while not list(folder.glob(f"cases/*/{RECORD}")):
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(signal.SIGTERM)
        assert "interrupted; what is computed is kept; the same command continues" in process.stderr.read()
    assert process.returncode == TERMINATED
    again = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert again.returncode == 0 and "8 cases, 8 completed" in again.stdout
    assert int(again.stderr.partition(" to compute")[0].rpartition(" ")[2]) < 8


def test_guards_around_one_another_put_the_handlers_back():
    """The inner one holds SIGTERM back while a file is written; then the outer one has it again, and at last the system."""
    seen = []
    with Interruptible():
        outer = signal.getsignal(signal.SIGTERM)
        with pytest.raises(Terminated), Interruptible() as guard, guard.postponed():
            os.kill(os.getpid(), signal.SIGTERM)
            seen.append("written")
        assert signal.getsignal(signal.SIGTERM) == outer
    assert seen == ["written"] and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_a_signal_waits_for_the_end_of_an_import(tmp_path, monkeypatch):
    """Ctrl-C while a module is imported comes when it is whole: a kernel goes on with it."""
    (tmp_path / "imported_slowly.py").write_text(
        "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(0.2)\nwhole = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt), Interruptible():
        import imported_slowly

        time.sleep(5.0)
    assert imported_slowly.whole


def test_a_module_that_runs_as_it_is_imported_is_stopped_at_once(tmp_path, monkeypatch):
    """The guard that it enters looks at imports within alone: that of the module ends with the run."""
    (tmp_path / "runs_imported.py").write_text(
        "import os, signal, time\nfrom prensa.output.interrupt import Interruptible\n"
        "with Interruptible():\n    os.kill(os.getpid(), signal.SIGINT)\n    time.sleep(0.5)\n"
        "raise RuntimeError('went on')\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        importlib.import_module("runs_imported")


def test_an_interrupted_run_is_resumed_from_python(tmp_path, monkeypatch):
    """`pr.resume` goes on from the checkpoint, as the command does."""
    written = []

    def stop(self, increment):
        write(self, increment)
        written.append(increment.number)
        if len(written) == 3:
            raise KeyboardInterrupt

    write = module._Run._write
    monkeypatch.setattr(module._Run, "_write", stop)
    with pytest.raises(KeyboardInterrupt):
        pr.run(small(increments=6), tmp_path / "run", quiet=True)
    assert pr.results(tmp_path / "run").status == "interrupted"
    assert pr.resume(tmp_path / "run", quiet=True).status == "completed"
