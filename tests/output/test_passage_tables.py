import shutil

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.output.passages import read_passages, restored
from prensa.output.progress import ProgressBar
from prensa.output.report import read_summary
from prensa.output.run import resume, run
from problems import pressed_block, stroke


def dragged() -> pr.Case:
    """An elastic block of elements 0.5 long, pressed and dragged by a circle over 1.5 of them."""
    drag = pr.Motion(x=0.75, y=-0.05)
    problem = pressed_block(
        stroke(-0.05, increments=2, tool="roller"), pr.Step("drag", move={"roller": drag}, increments=12),
        tools={"roller": pr.Circle(radius=2.0, at=(1.0, 3.0))}, material=pr.NeoHooke(1e3, 0.3), size=(4, 1), n=(8, 2),
        body="block", friction=pr.Coulomb(0.1),
    )  # fmt: skip
    return pr.Case(problem, output=pr.Output(pictures=False))


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    return run(dragged(), tmp_path_factory.mktemp("passages") / "whole", quiet=True)


def test_means_of_the_last_passage_are_reported_everywhere(done):
    """Table, increment, measure, summary and report hold the same mean and ripple; before a passage there is none."""
    table, inc = read_passages(done.directory), done.increment
    assert np.isnan(table["roller.fy.mean"][table["step"] == "press"]).all()
    mean, ripple = inc.means["roller.fy"]
    assert (mean, ripple) == (table["roller.fy.mean"][-1], table["roller.fy.ripple"][-1])
    assert mean == inc.measure("mean(roller.fy)") and ripple == inc.measure("ripple(roller.fy)") > 0
    assert read_summary(done.directory)["passage_means"]["drag"]["roller.fy"] == {"mean": mean, "ripple": ripple}
    assert "Means over a passage" in (done.directory / "report.html").read_text()
    assert max(inc.passages.values()) == pytest.approx(1.5, abs=0.1)
    assert mean == pytest.approx(done.history["roller.fy"][-8:].mean(), rel=0.1)


def test_a_stopped_run_ends_with_the_same_table(done, tmp_path, monkeypatch):
    """Stopped in the middle of a passage and resumed, the table of means is the same bit for bit."""
    call = ProgressBar.__call__

    def interrupted(self, sign):
        if sign.number == 9 and sign.event == "iteration":
            raise KeyboardInterrupt
        call(self, sign)

    with monkeypatch.context() as m:
        m.setattr(ProgressBar, "__call__", interrupted)
        with pytest.raises(KeyboardInterrupt):
            run(dragged(), tmp_path, quiet=True)
    resume(tmp_path, quiet=True)
    for name in ("passages.csv", "history.csv"):
        assert (tmp_path / name).read_bytes() == (done.directory / name).read_bytes()


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("history.csv", "press,", "mm,", "have a step 'mm', which the case has not"),
        ("history.csv", "roller.mz", "roller.mx", "have no column 'roller.mz'"),
        ("passages.csv", ".passages", ".passings", "have no column '.*passages'"),
    ],
)
def test_tables_of_another_case_are_not_gone_on_with(done, tmp_path, file, old, new, words):
    """Steps or columns that are not the case's are reported before anything of a stopped run is taken over."""
    shutil.copytree(done.directory, tmp_path / "run")
    path = tmp_path / "run" / file
    path.write_text(path.read_text().replace(old, new))
    system = pr.discretise(dragged().problem)
    with pytest.raises(PrensaError, match=words):
        restored(tmp_path / "run", system, done.increment.state.clock)


def test_a_plane_has_no_passages(tmp_path):
    """Nothing passes through a contact without an end: there is no table, and a second run removes the old one."""
    (tmp_path / "passages.csv").write_text("old")
    plane = pressed_block(stroke(-0.01, increments=1), material=pr.NeoHooke(1e3, 0.3), size=(4, 1), n=(8, 2))
    done = run(pr.Case(plane, output=pr.Output(pictures=False)), tmp_path, quiet=True, force=True)
    assert not (tmp_path / "passages.csv").exists()
    assert read_summary(tmp_path)["passage_means"] == {} and not done.increment.means
