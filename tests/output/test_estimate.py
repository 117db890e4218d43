"""What `prensa check` says that a run in space will take, before anything starts."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.linear import iterative
from prensa.linear.reduction import Reduced
from prensa.output.estimate import estimate
from prensa.output.progress import ProgressBar
from prensa.output.vtk import write_fields
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step

NUMERICS = pr.Numerics(solver="ldlt", threads=1)


def block(n=6, increments=4):
    """A block of n³ bricks under a plane."""
    return pr.Problem(
        "block", space="solid", bodies={"b": pr.Body(pr.Box((1.0, 1.0, 1.0), (n, n, n)), pr.Elastic(1000.0, 0.3))},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"},
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.05)}, increments=increments),),
    )  # fmt: skip


def test_memory_and_disk_are_those_of_what_is_there(tmp_path):
    """Factors as rslab says they are, matrices beside them; fields no smaller than the file of an increment, for all of them."""
    system = discretise(block())
    found = {s: estimate(system, pr.Numerics(solver=s, threads=1), pr.Output()) for s in ("rslab", "ldlt", "multigrid")}
    assert [f.solver for f in found.values()] == ["lu", "ldlt", "multigrid"]
    assert {f.unknowns for f in found.values()} == {6 * 7 * 7 * 3}
    free = 6 * 7 * 7 * 3
    values = 8 * free * 60
    assert all(values < f.memory < 40 * values for f in found.values())
    fixed = plan_step(system, 0, np.zeros(system.ndof)).fixed
    sizes = [Reduced.of(system, fixed, pr.Numerics(solver=s)).factorisation.size for s in ("rslab", "ldlt")]
    assert values < 2.5 * sizes[1] and 2.5 * sizes[1] < sizes[0] < found["rslab"].memory
    *_, last = pr.solve(block(increments=1), NUMERICS)
    size = write_fields(tmp_path / "0001.vtu", last).stat().st_size
    one = found["ldlt"]
    assert 0.5 * size < one.fields and one.disk == 4 * one.fields
    assert estimate(system, NUMERICS, replace(pr.Output(), fields=0)).disk == one.fields
    assert estimate(discretise(block(increments=None)), NUMERICS, pr.Output()).disk is None
    assert all(f.seconds is not None and 0.0 < f.seconds < 60.0 for f in found.values())
    lines = "\n".join(one.lines())
    assert "882 free unknowns, by GMRES with LDLᵀ of the symmetric part" in lines and "an increment of 5 iterations" in lines


def test_what_does_not_fit_is_not_tried(monkeypatch):
    """Beyond the memory of the machine nothing is factored, and the line says what to do."""
    monkeypatch.setattr(iterative, "machine_memory", lambda: 1e5)
    found = estimate(discretise(block(3)), NUMERICS, pr.Output())
    assert found.seconds is None
    assert any("this machine has 1 MB: use fewer elements" in line for line in found.lines())


def test_check_prints_it_in_space(tmp_path):
    """Lines and data of `prensa check`."""
    path = tmp_path / "case.yaml"
    path.write_text(pr.dump(pr.Case(block(3), NUMERICS)), encoding="utf-8")
    answer = CliRunner().invoke(app, ["check", str(path), "--json"])
    assert answer.exit_code == 0, answer.output
    data = json.loads(answer.stdout)["estimate"]
    assert data["solver"] == "ldlt" and data["free_unknowns"] == 3 * 4 * 4 * 3 and np.isfinite(data["memory_bytes"])
    answer = CliRunner().invoke(app, ["check", str(path)])
    assert "linear systems: 144 free unknowns" in answer.output and "disk: fields of at most" in answer.output
    assert pytest.approx(data["disk_bytes"]) == 4 * data["disk_bytes_per_increment"]


def test_a_run_counts_krylov_iterations(tmp_path):
    """Progress, log, history and summary say how many iterations of GMRES increments took, and by what."""
    shown = io.StringIO()
    case = pr.Case(block(3, increments=2), NUMERICS, pr.Output(pictures=False, report=False))
    found = pr.run(case, tmp_path / "out", bar=ProgressBar(console=Console(file=shown)))
    counted = found.history["krylov"]
    assert (counted > 0).all()
    assert found.summary["linear_solver"] == {"solver": "ldlt", "krylov_iterations": int(counted.sum())}
    for text in (shown.getvalue(), (tmp_path / "out" / "run.log").read_text(encoding="utf-8")):
        assert f"{counted[-1]} Krylov iterations" in text
