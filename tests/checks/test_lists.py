"""The protocol of checks: what a list holds is asked, what it finds is reported, and what refuses ends the run."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import prensa as pr
from prensa.checks import run
from prensa.checks.before import preflight
from prensa.checks.check import ended_by, warning
from prensa.errors import Finding, PreflightError, Severity, SolveError
from prensa.system.failure import NotReached


def pressed():
    """A block under a plane, three increments."""
    return pr.Problem(
        "pressed", bodies={"b": pr.Body(pr.Rectangle(size=(2, 1), n=(2, 1)), pr.Elastic(E=1000.0, nu=0.3))},
        tools={"die": pr.Plane(touching="b.top")}, contacts=[pr.Contact("b.top", "die")], fixed={"b.bottom": "y", "b.left": "x"},
        steps=[pr.Step("press", move={"die": {"y": -0.01}}, increments=3)], kinematics="small",
    )  # fmt: skip


def with_entry(monkeypatch, name, check):
    """Every run has one check more in a list."""
    made = run.RunChecks.__init__

    def init(self, *arguments):
        made(self, *arguments)
        getattr(self, name).append(check)

    monkeypatch.setattr(run.RunChecks, "__init__", init)


def test_every_check_of_a_description_is_in_the_list():
    """A function of a system that yields findings, in a file of its own subject, is asked by `preflight`."""
    listed = {check.__name__ for check in preflight.CHECKS}
    for path in Path(preflight.__file__).parent.glob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                given = [ast.unparse(a.annotation) for a in node.args.args if a.annotation]
                if given == ["System"] and ast.unparse(node.returns) == "Iterator[Finding]":
                    assert node.name in listed, f"{path.name}: {node.name}"


def test_a_further_check_of_a_description_is_reported_and_refuses(monkeypatch, caplog):
    """One entry is enough: a warning is logged with its place, a refusal is an error with the same line."""
    for severity in (Severity.WARN, Severity.REFUSE):
        found = Finding("steps.0", "it is too slow; go faster", severity)
        monkeypatch.setattr(preflight, "CHECKS", (lambda system: [found],))  # noqa: B023
        if severity is Severity.WARN:
            assert len(list(pr.solve(pressed()))) == 3
            assert [r.getMessage() for r in caplog.records] == ["steps.0: it is too slow; go faster"]
        else:
            with pytest.raises(PreflightError, match=r"^steps\.0: it is too slow; go faster$"):
                list(pr.solve(pressed()))


@pytest.mark.parametrize("moment", ["solved", "committed"])
def test_a_further_check_of_increments_ends_the_run(monkeypatch, moment):
    """A finding that refuses the second increment ends the run after the first, with its reason."""
    reason = NotReached("it is too slow")

    def check(given):
        if given.context.state.clock.number == 1:
            yield ended_by(reason)

    with_entry(monkeypatch, moment, check)
    done = []
    with pytest.raises(SolveError, match="it is too slow") as failed:
        for increment in pr.solve(pressed()):
            done.append(increment)
    assert failed.value.reason is reason
    assert [increment.number for increment in done] == [1]


def test_warnings_of_a_run_are_reported_where_their_check_looks(monkeypatch, caplog):
    """At the end of a step and of the run, once each."""
    with_entry(monkeypatch, "step_ends", lambda given: [warning(f"step {given.context.plan.name} ended")])
    with_entry(monkeypatch, "run_ends", lambda given: [warning(f"touched: {', '.join(given.touched)}")])
    list(pr.solve(pressed()))
    assert [r.getMessage() for r in caplog.records] == ["step press ended", "touched: die"]
