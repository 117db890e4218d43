"""What a run answered: the same at the end of the terminal, in summary.json and at the top of the report."""

from __future__ import annotations

import html
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import prensa as pr
from prensa.errors import Finding, PrensaError, Severity, SolveError
from prensa.model.problem import Output
from prensa.output import answer
from prensa.output.progress import ProgressBar
from prensa.output.report import read_summary, write_report
from prensa.output.run import resume, run
from prensa.output.runlog import Warnings
from prensa.output.whole import shares_of
from prensa.result.increment import Force, Place, Progress
from stopped import stop_at


def problem(space: str = "plane strain", **more) -> pr.Problem:
    """A block under a punch that goes down by 1, then back; thickness 10 in the plane."""
    steps = (pr.Step("press", move={"punch": pr.Motion(y=-1.0)}, increments=4), pr.Step("back", by={"punch": pr.Motion(y=0.5)}))
    given = {"steps": steps, "fixed": {"block.bottom": "y", "block.left": "x"}, "measures": {"width": "block.right.max.x"},
             "tools": {"punch": pr.Plane(touching="block.top")}} | more  # fmt: skip
    return pr.Problem(
        "small", space=space, bodies={"block": pr.Body(pr.Rectangle((4, 3), (4, 3)), pr.J2(70e3, 0.3, pr.Linear(100, 500)))},
        **given, **({} if space == "axisymmetric" else {"thickness": 10.0}),
    )  # fmt: skip


def table(tool: str = "punch", **columns) -> dict:
    """A history by hand: what is not given is zero."""
    n = len(next(iter(columns.values())))
    zero = {f"{tool}.{c}": np.zeros(n) for c in ("ux", "uy", "rz", "fx", "fy", "mz")}
    given = {f"{tool}.{c}": np.array(v, dtype=float) for c, v in columns.items()}
    return {"step": np.array(["press"] * n), "increment": np.arange(1, n + 1), "time": np.arange(1, n + 1) / n} | zero | given


def shown_by(case: pr.Case, directory, width: int = 0, **options) -> tuple[str, object]:
    """What is on the screen at the end of a run, and its result or None."""
    file = io.StringIO()
    console = Console(file=file, force_terminal=bool(width), width=width or 200)
    try:
        result = run(case, directory, bar=ProgressBar(console=console), **options)
    except (PrensaError, KeyboardInterrupt):
        result = None
    return file.getvalue(), result


def top_of(directory) -> list[str]:
    """The lines at the top of a report."""
    page = (directory / "report.html").read_text(encoding="utf-8")
    found = re.search(r'<ul class="answer">(.*?)</ul>', page, re.S)
    assert found is not None and found.start() < page.index("<h2>")
    return [html.unescape(line) for line in re.findall(r"<li>(.*?)</li>", found[1])]


# --------------------------------------------------------------------------------------------------------- whole runs
def test_terminal_summary_and_report_give_the_same_answer(tmp_path):
    """The largest force with its travel, read from history.csv by hand, and the case's own measure, in all three places."""
    text, result = shown_by(pr.Case(problem(), output=Output(pictures=False)), tmp_path)
    force, travel = result.history["punch.fy"], result.history["punch.uy"]
    k = int(np.argmax(force))
    said = f"largest force of punch: {force[k] / 1e3:.4g} kN ({force[k]:.0f} N) at {-travel[k]:.4g} mm"
    assert force[k] > 1e3 > force[-1] and travel[k] == pytest.approx(-1)
    width = f"width: {result.summary['measures']['width']['last']:.4g} mm"
    assert text.splitlines()[-3:] == [f"completed: {len(force)} increments, {tmp_path}", said, width]
    assert result.summary["answer"] == read_summary(tmp_path)["answer"] == ["completed", said, width]
    assert top_of(tmp_path) == [said, width]
    peak = result.summary["largest_force"][0]
    assert (peak["tool"], peak["value"], peak["unit"], peak["axis"]) == ("punch", force[k], "N", "y")
    assert f"punch y {force[k] / 1e3:.4g} kN at 1 mm" in text


def test_what_ended_a_step_is_said_with_the_travel(tmp_path):
    """A force of 2 kN in a step of 1 mm: stopped there, after the travel in the last row of history.csv; resumed the same."""
    until = pr.Step("press", move={"punch": pr.Motion(y=-1.0)}, until=pr.Until(force={"punch": {"y": 2000.0}}))
    case = pr.Case(problem(steps=(until,)), output=Output(pictures=False))
    text, result = shown_by(case, tmp_path)
    gone = -result.history["punch.uy"][-1]
    assert 0 < gone < 1 and result.history["punch.fy"][-1] == pytest.approx(2000, rel=1e-3)
    said = f"stopped at 2 kN after {gone:.4g} mm of 1"
    assert said in text.splitlines() and top_of(tmp_path)[0] == said
    assert result.summary["status"] == "completed" and result.summary["answer"][0] == said
    assert resume(tmp_path, quiet=True).summary["answer"] == result.summary["answer"]


@pytest.mark.parametrize("error, word", [(SolveError("nothing fits"), "failed"), (KeyboardInterrupt(), "interrupted")])
def test_a_run_that_is_cut_off_says_where(error, word, tmp_path, monkeypatch):
    """Two of four increments to 1 mm are done, so 0.5 mm of 1; nothing is said twice of the error itself."""
    stop_at(monkeypatch, 3, error)
    text, _ = shown_by(pr.Case(problem(), output=Output(pictures=False)), tmp_path)
    said = f"{word} at time 0.5 of 2, in step 'press', after 0.5 mm of 1"
    assert said in text.splitlines() and read_summary(tmp_path)["answer"][0] == top_of(tmp_path)[0] == said
    assert "nothing fits" not in text  # the error goes on to the caller, who shows it


def test_a_run_cut_off_before_its_first_increment_says_so(tmp_path, monkeypatch):
    """Nothing was computed: there is no force to be named."""
    stop_at(monkeypatch, 1, SolveError("no"))
    text, _ = shown_by(pr.Case(problem(measures={}), output=Output(pictures=False)), tmp_path)
    assert text.splitlines()[-1] == "failed before an increment was completed" == top_of(tmp_path)[0]


def test_lines_fit_a_narrow_terminal(tmp_path):
    """At 44 columns no line of the answer is longer, none of its words is lost, and the bar keeps the force."""
    text, result = shown_by(pr.Case(problem(), output=Output(pictures=False, report=False, mirror=("left",))), tmp_path, 44)
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)
    end = plain[plain.index("largest force") :]
    assert "whole part: twice" in " ".join(end.split()) and max(map(len, end.splitlines())) <= 44
    assert " ".join(end.split()).startswith(result.summary["answer"][1]) and "punch y" in plain


def test_a_page_of_an_older_run_is_still_written(tmp_path):
    """A summary without the new keys is enough: forces come from history.csv."""
    import json

    result = run(pr.Case(problem(), output=Output(pictures=False)), tmp_path, quiet=True)
    new = {"answer", "largest_force", "stopped_by", "warnings_about"}
    old = {key: value for key, value in result.summary.items() if key not in new}
    (tmp_path / "summary.json").write_text(json.dumps(old))
    write_report(tmp_path)
    assert top_of(tmp_path) == result.summary["answer"][1:]


# ------------------------------------------------------------------------------------------------------------- forces
def test_in_axisymmetry_radial_forces_are_no_force(tmp_path):
    """A sum of radial forces over a ring, however large, is neither the answer nor the force of the progress bar."""
    case = pr.Case(problem("axisymmetric"))
    rows = table(ux=[0, 0], uy=[-1, -2], fx=[9e6, 0], fy=[10, -20])
    (peak,) = answer.peaks(rows, case, {})
    assert (peak.axis, peak.value, peak.travel) == ("y", -20, 2)
    file = io.StringIO()
    with ProgressBar(console=Console(file=file, width=200)) as bar:
        bar.problem = case.problem
        force, place = {"punch": Force(9e6, -5e4, 0)}, {"punch": Place(0, -2, 0)}
        bar(Progress("press", 1, 4, 0.1, 1.0, 5, 1e-11, force, "accepted", places=place))
    assert file.getvalue().endswith("punch y -50 kN at 2 mm\n")


def test_progress_shows_the_tool_that_moves(tmp_path):
    """Between a punch and an anvil the force is one: it is shown along the way of the punch, whichever rounds to more."""
    file = io.StringIO()
    with ProgressBar(console=Console(file=file, width=200)) as bar:
        bar.problem = problem()
        for punch in (49_999.0, 0.0):
            force = {"punch": Force(0, punch, 0), "anvil": Force(0, -5e4, 0)}
            place = {"punch": Place(0, -2, 0), "anvil": Place(0, 0, 0)}
            bar(Progress("press", 1, 4, 0.1, 1.0, 5, 1e-11, force, "accepted", places=place))
    shown = [line.rpartition(", ")[2] for line in file.getvalue().splitlines()]
    assert shown == ["punch y 50 kN at 2 mm", "anvil y -50 kN"]


@pytest.mark.parametrize(
    "mirror, columns, whole",
    [(("left",), {"uy": [-1], "fy": [8]}, 2), (("bottom",), {"uy": [-1], "fy": [8]}, 1), ((), {"uy": [-1], "fy": [8]}, 1),
     (("left", "bottom"), {"uy": [-1], "fy": [8]}, 2), (("bottom",), {"ux": [1], "fx": [8]}, 2),
     (("left",), {"ux": [1], "fx": [8]}, 1), (("left",), {"ux": [1], "uy": [1], "fx": [8]}, None)],
)  # fmt: skip
def test_a_mirror_doubles_the_force_that_lies_along_it(mirror, columns, whole):
    """Of a half the press gives twice the force; two dies with a mirror between them press against each other, once."""
    way = {c.removeprefix("u"): v[-1] for c, v in columns.items() if c[0] == "u"}
    steps = (pr.Step("press", by={"punch": pr.Motion(**way)}),)
    cases = [pr.Case(problem(steps=steps), output=Output(mirror=mirror))]  # the output says it, or a press of one axis
    if len(way) == 1:
        punch = pr.Plane(touching="block.top", press=pr.Press(energy=1.0, mirror=mirror))
        cases.append(pr.Case(problem(tools={"punch": punch}, steps=steps)))
    for case in cases:
        shares = shares_of(pr.discretise(case.problem), case)
        (peak,) = answer.peaks(table(**columns), case, {tool: share._asdict() for tool, share in shares.items()})
        assert peak.whole == whole
        assert ("whole part: twice, 16 N" in answer.sentence(peak)) == (whole == 2)


def test_only_tools_that_move_are_named_and_turning_ones_have_a_moment():
    """A die at rest bears as much and is left out; a roll that turns has its force at an angle, and a moment."""
    die = {f"die.{c}": v for c, v in (("fx", np.zeros(2)), ("fy", np.array([-50.0, -60.0])))}
    die |= {f"die.{c}": np.zeros(2) for c in ("ux", "uy", "rz", "mz")}
    tools = {"punch": pr.Plane(touching="block.top"), "die": pr.Plane(normal=(0, 1), at=(0, 0))}
    case = pr.Case(problem(tools=tools))
    moved = answer.peaks(table(rz=[-0.1, -0.2], fx=[3, 3], fy=[4, 0], mz=[-7, 0]) | die, case, {})
    assert [(p.tool, p.what, p.value, p.travel, p.travel_unit) for p in moved] == [
        ("punch", "force", 5.0, 0.1, "rad"), ("punch", "moment", -7.0, 0.1, "rad")]  # fmt: skip
    at_rest = answer.peaks(table(fy=[60, 50]) | die, case, {})
    said = ["largest force of punch: 60 N at time 0.5", "largest force of die: 60 N at time 1"]
    assert [answer.sentence(p) for p in at_rest] == said


@pytest.mark.parametrize(
    "value, unit, words",
    [(78630, "N", "78.63 kN (78630 N)"), (999.4, "N", "999.4 N"), (-16872.5, "N/mm", "-16.87 kN/mm (-16872 N/mm)"),
     (5.2e8, "Pa", "520 MPa (5.2e+08 Pa)"), (1200, "MPa", "1200 MPa"), (3000, "kN", "3000 kN"),
     (2500, "N mm", "2.5 kN mm (2500 N mm)"), (4e4, "", "40000"), (0.0, "N", "0 N")],
)  # fmt: skip
def test_large_numbers_have_their_common_unit_beside_them(value, unit, words):
    """N in kN and Pa in MPa from where they are large; other units stay as they are."""
    assert answer.shown(value, unit) == words


@pytest.mark.parametrize("kind, words", [("by", "after 0.4 mm of 0.9"), ("move", "after 0.4 mm of 0.7")])
def test_travel_in_a_later_step_counts_from_its_start(kind, words):
    """'by' is measured from the start of the step, 'move' from the first place: 0.2 mm had been gone before."""
    second = pr.Step("more", **{kind: {"punch": pr.Motion(y=-0.9)}}, until=pr.Until(travel={"punch": {"y": -0.6}}))
    rows = table(uy=[-0.2, -0.4, -0.6]) | {"step": np.array(["press", "more", "more"]), "time": np.array([1.0, 1.2, 1.4])}
    summary = {"status": "interrupted"}
    said = answer.ending(rows, replace(problem(), steps=(problem().steps[0], second)), summary)
    assert said == f"interrupted at time 1.4 of 2, in step 'more', {words}"


@pytest.mark.parametrize(
    ("driven", "words"),
    [
        ({"velocity": {"punch": pr.Motion(y=-3.0)}, "duration": 0.5}, "after 0.4 mm of 1.5"),
        ({"velocity": {"punch": pr.Motion(y=((0.0, 0.0), (1.0, -4.0)))}}, "after 0.4 mm of 2"),
        ({"crank": {"punch": pr.Crank(stroke=10.0, height=2.5)}}, "after 0.4 mm of 2.5"),
        ({"push": {"punch": pr.Push(y=-2000.0)}}, "after 0.4 mm, at 750 N of 2 kN"),
        ({"push": {"punch": pr.Push(x=0.0)}}, "after 0.4 mm"),
    ],
)
def test_the_travel_planned_of_velocities_cranks_and_pushes(driven, words):
    """Velocities times seconds, also of tables; the way of a crank; of a push, which plans no travel, its force."""
    rows = table(uy=[-0.2, -0.4], fy=[300.0, 750.0]) | {"time": np.array([0.2, 0.4])}
    said = answer.ending(rows, replace(problem(), steps=(pr.Step("press", **driven),)), {"status": "interrupted"})
    assert said == f"interrupted at time 0.4 of 1, in step 'press', {words}"


# ----------------------------------------------------------------------------------------------------------- warnings
def test_warnings_are_ordered_by_their_weight():
    """What fails first, then the result, the case, and pictures; among equals in the order in which they came."""
    import logging

    log, heard = logging.Logger("here"), []
    handler = Warnings(["of the case"], heard.append)
    log.addHandler(handler)
    log.warning("%s", "a picture", extra={"about": "files"})
    log.warning("%s", Finding("tools.punch", "of a key"))
    log.warning("%s", "of the result; do this")
    log.warning("%s", Finding("", "nothing comes of it", Severity.REFUSE))
    log.error("%s %s", "failed", "here")
    ordered = answer.weighed(handler.texts, handler.about)
    assert ordered[:3] == ["nothing comes of it", "failed here", "of the result; do this"]
    assert ordered[3:] == ["of the case", "tools.punch: of a key", "a picture"]
    short = ["6 warnings, the most severe first:", "  nothing comes of it", "  failed here", "  of the result"]
    assert list(answer.in_short(ordered))[:4] == short
    assert list(answer.in_short([])) == [] and len(heard) == 5
    handler.held = []  # at the end of a run, whose last lines show what is warned of then, in full
    log.warning("%s", "energy; do that")
    assert len(heard) == 5 and handler.texts[-1] == "energy; do that"
    assert list(answer.in_short(answer.weighed(handler.texts, handler.about), handler.held))[4] == "  energy; do that"


def test_the_last_lines_list_the_warnings_of_the_summary(tmp_path, capsys):
    """That of the energy too, which comes after the last increment, once and with its remedy; quiet runs show it alone."""
    step = pr.Step("press", move={"punch": pr.Motion(y=-0.1)}, increments=1)
    case = pr.Case(problem(steps=(step,)), output=Output(pictures=False, report=False))
    made = pr.run(case, out=tmp_path / "a").summary
    (words,) = [w for w in made["warnings"] if w.startswith("energy balance off by")]
    said = capsys.readouterr().err
    listed = said[said.index("completed: ") :].splitlines()
    assert said.count("energy balance off by") == 1 and f"  {words}" in listed
    count = len(made["warnings"])
    assert listed[1].startswith(f"{count} warning") and sum(line.startswith("  ") for line in listed) == count
    pr.run(case, out=tmp_path / "b", quiet=True)
    assert capsys.readouterr().err.count("energy balance off by") == 1


# -------------------------------------------------------------------------------------------------------------- manual
def test_the_page_on_the_first_case_shows_what_its_run_prints(tmp_path):
    """The last lines of `prensa run` of the file on that page, as they are printed there."""
    page = (Path(__file__).parents[2] / "docs" / "guide" / "first-case.md").read_text(encoding="utf-8")
    blocks = dict((m[1], m[2]) for m in re.finditer(r"```(yaml|text)\n((?:name|completed).*?)```", page, re.S))
    case = tmp_path / "cylinder.yaml"
    case.write_text(blocks["yaml"], encoding="utf-8")
    made = pr.load(case, ["output.pictures=false", "output.report=false"])
    text, _ = shown_by(made, tmp_path / "results" / "cylinder")
    assert text.replace(str(tmp_path) + "/", "").endswith(blocks["text"])
