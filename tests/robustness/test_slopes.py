"""Derivatives by random numbers of random problems: none may be wrong where it is said to be exact."""

from __future__ import annotations

from typing import Any

import pytest
from typer.testing import CliRunner

from prensa.cli import app
from prensa_bench.robustness import slopes
from prensa_bench.robustness.running import judged


@pytest.mark.parametrize(
    ("family", "number"),
    [
        pytest.param("rolls", 5, marks=pytest.mark.slow),  # forces are released in the second of four steps
        ("plastic", 6),  # closed forms know a parameter in the second step, but not in the first
        pytest.param("thin", 1, marks=pytest.mark.slow),
        ("slender", 0),  # a contact whose penetration is round-off of its place
    ],
)
def test_derivatives_of_random_problems(family: str, number: int) -> None:
    """They are the differences of whole runs, on one side or the other."""
    outcome = judged(family, 991, number, slopes=True)
    assert (outcome.status, outcome.words) == ("right", "")


@pytest.mark.slow
def test_the_judge_can_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Derivatives a thousandth off are noticed, and so is a crash; what has none is reported."""
    right = slopes._slopes
    with monkeypatch.context() as patched:
        patched.setattr(slopes, "_slopes", lambda *a: 1.001 * right(*a))
        assert judged("tied", 991, 1, slopes=True).status == "wrong"

    def crash(*_: Any) -> Any:
        raise KeyError("lost")

    with monkeypatch.context() as patched:
        patched.setattr(slopes, "_slopes", crash)
        assert (judged("thin", 991, 1, slopes=True).status, judged("thin", 991, 1, slopes=True).reason) == ("wrong", "Crashed")
    with monkeypatch.context() as patched:
        patched.setattr(slopes, "with_slopes", lambda problem: problem)
        refused = judged("forgings", 991, 0, slopes=True)
    assert refused.status == "reported" and "a new mesh has other nodes" in refused.words


@pytest.mark.slow
def test_derivatives_are_judged_from_the_command_line() -> None:
    """As the answers are; they are not for broken inputs."""
    line = ["bench", "robustness", "--derivatives", "--family", "thin", "--seed", "991", "--first", "1", "--count", "1"]
    done = CliRunner().invoke(app, line)
    assert done.exit_code == 0 and "thin: 1 problems, seed 991: right 100.0%" in done.output
    assert CliRunner().invoke(app, ["bench", "fuzz", "--derivatives"]).exit_code == 2
