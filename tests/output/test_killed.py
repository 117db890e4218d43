"""Runs that are still going or were killed: viewed, plotted and reported as far as they came; resumed to the same bits."""

import os
import signal
import subprocess
import sys
import time

import matplotlib.pyplot as plt
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.model.schema import dump
from prensa.output.report import write_report
from prensa.output.run import resume, run
from problems import stroke, upset_block

pytestmark = pytest.mark.skipif(os.name != "posix", reason="processes are stopped and killed by their signals")


def small() -> pr.Case:
    """An elastic-plastic block under a plane with friction, in many increments."""
    problem = upset_block(
        stroke(-0.2, increments=200, tool="punch"), material=pr.J2(70e3, 0.3, pr.Linear(100, 500)), size=(4, 3), n=(4, 3),
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


def test_a_folder_that_holds_only_the_beginning_of_a_run_says_so(tmp_path):
    """A log and no table: one sentence."""
    (tmp_path / "run.log").write_text("")
    for ask in (pr.results, write_report):
        with pytest.raises(PrensaError, match="killed: no increment was completed; there is nothing to show"):
            ask(tmp_path)
