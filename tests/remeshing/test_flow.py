"""Material that is followed through meshes, in one body and in two."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.output.run import run
from prensa.system.discretise import discretise, on_meshes
from prensa.verify.balance import imbalance

STEEL = pr.J2(E=200e3, nu=0.3, flow=pr.Ludwik(s0=250.0, K=500.0, n=0.3))


def stack(travel: float = 0.25, to: float = -1.0) -> pr.Problem:
    """Two billets side by side, one of them elastic on quadrilaterals, under a frictionless plane; plane strain."""
    soft = pr.Body(pr.Rectangle(size=(4.0, 4.0), n=(4, 4)), STEEL, element="t6")
    hard = pr.Body(pr.Rectangle(size=(4.0, 2.9), n=(3, 3), origin=(20.0, 0.0)), pr.Elastic(E=200e3, nu=0.3))
    fixed = {f"{b}.{s}": {axis: "held"} for b in ("soft", "hard") for s, axis in (("bottom", "y"), ("left", "x"))}
    return pr.Problem(
        "stack", {"soft": soft, "hard": hard}, (pr.Step("press", move={"punch": pr.Motion(y=to)}),),
        {"punch": pr.Plane(touching="soft.top")}, contacts=(pr.Contact("soft.top", "punch"), pr.Contact("hard.top", "punch")),
        fixed=fixed, remesh=pr.Remesh(size=pr.Sizes(far=1.2), when=pr.When(travel=travel)),
    )  # fmt: skip


def test_particles_go_where_homogeneous_flow_takes_them() -> None:
    """In plane strain without friction: y by the height, x by its inverse but for the elastic volume; through four meshes."""
    points = np.array([[1.0, 1.0], [2.5, 3.0], [0.0, 4.0], [3.7, 0.2]])
    last = list(pr.solve(stack()))[-1]
    assert last.remeshings >= 3
    there = pr.particles(last, "soft", points)
    assert there[:, 1] == pytest.approx(points[:, 1] * 0.75, rel=1e-4, abs=1e-6)
    assert there[:, 0] == pytest.approx(points[:, 0] / 0.75, rel=3e-3, abs=1e-6)
    with pytest.raises(PrensaError, match="unknown body 'sof'; did you mean 'soft'"):
        pr.particles(last, "sof", points)
    with pytest.raises(PrensaError, match="'hard' is not made of T6"):
        pr.particles(last, "hard", points)


def test_bodies_that_do_not_flow_keep_their_meshes() -> None:
    """The elastic one beside has its elements, its displacements and, where it is touched at all, its forces."""
    problem = stack(travel=0.4, to=-1.12)
    base, touched = discretise(problem), False
    for increment in pr.solve(base):
        remeshed = increment.state.remeshed
        system = base if remeshed is None else on_meshes(base, remeshed)
        assert max(imbalance(system, increment)) < 1e-8
        assert increment.bodies["hard"].cells.shape == (9, 4)
        touched |= increment.contacts["hard.top-punch"].area > 0
    assert touched and increment.remeshings >= 2
    assert np.abs(increment.bodies["hard"].X - discretise(problem).meshes["hard"].points).max() < 1e-12


def test_a_run_draws_its_flow_lines(tmp_path: Path) -> None:
    """Pictures of a run on meshes made anew, and the report that shows them."""
    case = pr.Case(replace(stack(to=-0.4, travel=0.1)), output=pr.Output(fields=1))
    result = run(case, tmp_path / "run", quiet=True)
    assert (result.directory / "pictures" / "flow_lines.png").stat().st_size > 5000
    assert (result.directory / "pictures" / "remeshing.png").stat().st_size > 5000
    assert not [w for w in result.summary["warnings"] if "could not be drawn" in w]
    assert "a square grid that was drawn" in (result.directory / "report.html").read_text(encoding="utf-8")
