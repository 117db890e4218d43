import io

from rich.console import Console

from prensa.output.progress import ProgressBar
from prensa.result.increment import Force, Progress


def output(terminal: bool, quiet: bool = False) -> str:
    """What a bar shows of two iterations, a cut, a note and an accepted increment."""
    file = io.StringIO()
    force = {"punch": Force(1.0, -250.0, 0.0)}
    with ProgressBar(quiet, Console(file=file, force_terminal=terminal, width=150)) as bar:
        bar(Progress("press", 1, 4, 0.2, 1.0, 1, 1e-2, force))
        bar(Progress("press", 1, 4, 0.2, 1.0, 2, 1e-5, force))
        bar(Progress("press", 1, 4, 0.2, 1.0, 2, 1e-5, force, "rejected", "no convergence"))
        bar(Progress("press", 1, 4, 0.1, 1.0, 0, float("nan"), {}, "note", "first touch of [punch]"))
        bar(Progress("press", 1, 4, 0.1, 1.0, 5, 1e-11, force, "accepted"))
    return file.getvalue()


def test_without_a_terminal_there_is_one_line_per_accepted_increment():
    """A log file gets accepted increments, cuts and notes, a line each, and no control characters."""
    assert output(terminal=False).splitlines() == [
        "press: increment cut: no convergence",
        "press: first touch of [punch]",
        "press: increment 4, time 0.1 of 1, 5 iterations, residual 1.0e-11, punch y -250",
    ]


def test_on_a_terminal_there_is_a_bar():
    """A terminal sees step, increment, residual, share and the largest force."""
    text = output(terminal=True)
    for part in ("press", "increment 4", "residual 1.0e-11", "10 %", "punch y -250"):
        assert part in text


def test_quiet_is_silent():
    """Nothing at all is shown when asked to be quiet."""
    assert output(terminal=False, quiet=True) == output(terminal=True, quiet=True) == ""
