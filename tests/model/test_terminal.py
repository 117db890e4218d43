"""Output of the command line: where a case comes from, what goes to which stream, JSON, lines, completion."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from prensa.cli import app
from prensa.output.terminal import wrapped

SMALL = """
name: a small block
bodies:
  block: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools: {punch: {type: plane, touching: block.top}}
fixed: {block.bottom: xy}
steps:
  - {name: press, move: {punch: {y: -0.05}}, increments: 2}
output: {pictures: false, report: false}
"""
VERBS = typer.main.get_command(app).commands


def prensa(*arguments, text=None):
    return CliRunner().invoke(app, [str(a) for a in arguments], input=text)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_knows_the_same_options(verb):
    """-h, -q, -v and --json mean the same everywhere."""
    known = {name for parameter in VERBS[verb].params for name in parameter.opts}
    assert {"--quiet", "-q", "--verbose", "-v", "--json"} <= known
    assert prensa(verb, "-h").exit_code == 0


def test_a_case_comes_from_standard_input(tmp_path, monkeypatch):
    """- stands for what is piped in: checked, run under its name, mistakes with line and column, tables beside us."""
    monkeypatch.chdir(tmp_path)
    done = prensa("check", "-", "--set", "steps.press.increments=3", text=SMALL)
    assert done.exit_code == 0 and "3 increments" in done.stdout
    wrong = prensa("check", "-", text=SMALL.replace("block.top", "block.topp"))
    assert wrong.exit_code == 2 and wrong.stderr.startswith("<standard input>:5:") and "'top'" in wrong.stderr
    assert prensa("run", "-", text=SMALL).exit_code == 0
    summary = json.loads(Path("results/a_small_block/summary.json").read_text(encoding="utf-8"))
    assert summary["source"] == "standard input" and summary["status"] == "completed"
    Path("friction.csv").write_text("0, 0.1\n1, 0.2\n")
    own = SMALL + "friction: {type: coulomb, mu: friction.csv}\n"
    assert prensa("check", "-", text=own).exit_code == 0
    assert prensa("check", "-", text="").exit_code == 2


def test_results_go_to_one_stream_and_all_else_to_the_other(tmp_path, monkeypatch):
    """Scripts read standard output; progress, remarks and warnings never stand there; -q leaves only warnings."""
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL, encoding="utf-8")
    done = prensa("run", "small.yaml")
    assert done.stdout == "" and "completed: 2 increments" in done.stderr
    done = prensa("run", "small.yaml", "-q")
    assert done.stdout == done.stderr == ""
    done = prensa("run", "small.yaml", "-v")
    assert done.stdout == "" and "iteration 1: residual" in done.stderr and "increment 2 accepted" in done.stderr
    assert not logging.getLogger("prensa").handlers
    assert prensa("check", "small.yaml", "-q").output == ""
    verbose = prensa("check", "small.yaml", "-v", "--set", "steps.0.name=")
    assert verbose.exit_code == 2 and "Traceback" in verbose.stderr and verbose.stdout == ""


def test_what_other_cases_left_stays(tmp_path, monkeypatch):
    """A folder of another case is refused and untouched; --force takes it."""
    monkeypatch.chdir(tmp_path)
    assert prensa("run", "-", "--out", "r", "-q", text=SMALL).exit_code == 0
    before = Path("r/history.csv").read_bytes()
    other = SMALL.replace("a small block", "another")
    refused = prensa("run", "-", "--out", "r", text=other)
    assert refused.exit_code == 2 and "--force" in refused.stderr and Path("r/history.csv").read_bytes() == before
    assert prensa("run", "-", "--out", "r", "-q", "--force", text=other).exit_code == 0


@pytest.mark.slow
def test_results_as_json(tmp_path, monkeypatch):
    """One document on standard output, and nothing on standard error, of every verb that ends at once."""
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL, encoding="utf-8")
    Path("deck.inp").write_text(
        "*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n*ELEMENT,TYPE=CPE4,ELSET=B\n1,1,2,3,4\n*NSET,NSET=BOTTOM\n1,2\n"
        "*MATERIAL,NAME=M\n*ELASTIC\n1000,0.3\n*SOLID SECTION,ELSET=B,MATERIAL=M\n*BOUNDARY\nBOTTOM,1,2\n"
        "*STEP\n*STATIC\n*END STEP\n"
    )

    def given(*words):
        done = prensa(*words, "--json")
        assert done.exit_code == 0 and (done.stderr == "" or words[0] == "import"), done.output
        return json.loads(done.stdout)

    checked = given("check", "small.yaml")
    assert checked["bodies"]["block"] == {"elements": 8, "nodes": 15, "element": "q4_fbar"} and checked["unknowns"] == 33
    ran = given("run", "small.yaml")
    assert ran["status"] == "completed" and ran["folder"] == "results/small"
    assert given("resume", "results/small")["totals"]["increments"] == 2
    assert Path(given("report", "results/small")["report"]).is_file()
    assert Path(given("plot", "results/small")["picture"]).is_file()
    assert "ring" in given("new") and Path(given("new", "hertz")["case"]).is_file()
    assert "steps" in given("schema")["properties"] and "bodies" in given("import", "deck.inp")["text"]
    assert given("verify", "--only", "wedge")["passed"]
    swept = given("sweep", "small.yaml", "--set", "steps.press.increments=1,2", "--measure", "punch.fy", "--jobs", "1")
    assert [row["status"] for row in swept["cases"]] == ["completed"] * 2 and swept["cases"][0]["punch.fy"] > 0
    families = given("bench", "--count", "1", "--family", "elastic")["families"]
    assert families[0]["family"] == "elastic" and families[0]["problems"] == 1


# ---------------------------------------------------------------------------------------------------------------- lines
@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(st.lists(st.text("abc/.-:;,", min_size=1, max_size=30), min_size=1, max_size=30), st.integers(1, 120))
def test_wrapped_lines_hold_the_same_words(words, width):
    """Lines are broken at blanks only: words and paths stay whole, none is lost, no line is wider without need."""
    text = wrapped(" ".join(words), width)
    assert text.split() == words
    for line in text.split("\n"):
        assert len(line) <= max(width, 40) or len(line.split()) == 1


def test_a_path_with_blanks_stays_whole():
    """Neither what is quoted nor a path that is known is broken, wherever it ends up."""
    path = "my cases/a long name of a case.yaml"
    text = wrapped(f"{path}:3:5: unknown key 'the name of it'; did you mean 'another name of it', or something else?", 40, [path])
    for whole in (f"{path}:3:5:", "'the name of it';", "'another name of it',"):
        assert any(whole in line for line in text.split("\n"))
    assert wrapped("one\n  two", 80) == "one\n  two" and wrapped("", 80) == ""


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_messages_fit_the_terminal(tmp_path):
    """On a terminal of 60 columns no line of a message is longer unless it is one path; in a pipe it is one line."""
    import pty

    case = tmp_path / "case with blanks.yaml"
    case.write_text(SMALL.replace("block.top}", "block.topp, arount: 3}"), encoding="utf-8")
    command = [sys.executable, "-m", "prensa", "check", str(case)]
    piped = subprocess.run(command, capture_output=True, text=True).stderr
    ours, theirs = pty.openpty()
    done = subprocess.run(command, stdout=theirs, stderr=theirs, env={**os.environ, "COLUMNS": "60"})
    os.close(theirs)
    shown = os.read(ours, 100_000).decode().replace("\r\n", "\n")
    os.close(ours)
    assert done.returncode == 2 and shown.split() == piped.split() and len(shown.splitlines()) > len(piped.splitlines())
    assert all(len(line) <= 60 or str(case) in line for line in shown.splitlines())
    assert shown.count(str(case)) == piped.count(str(case))


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (["ch"], ["check"]),
        (["new", "v"], ["v-bend"]),
        (["bench", "f"], ["fuzz"]),
        (["run", "small.yaml", "--set", "steps.press."], ["steps.press.name=", "steps.press.move.", "steps.press.increments="]),
        (["check", "small.yaml", "--set", "too"], ["tools."]),
        (["check", "nothing.yaml", "--set", "too"], []),
        (["plot", "r", "--field", "pl"], ["plastic_strain"]),
        (["plot", "r", "--step", ""], ["last", "largest force"]),
    ],
)  # fmt: skip
def test_words_are_completed(words, found, tmp_path, monkeypatch):
    """Verbs, kinds, fields, and paths into the case that is named before."""
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL, encoding="utf-8")
    env = {"_PRENSA_COMPLETE": "complete_bash", "COMP_WORDS": " ".join(["prensa", *words]), "COMP_CWORD": str(len(words))}
    done = CliRunner().invoke(app, [], env=env, prog_name="prensa")
    assert [line for line in done.output.splitlines() if line] == found


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_completion_can_be_installed(shell):
    """The script for each shell asks this program."""
    done = CliRunner().invoke(app, [], prog_name="prensa", env={"_PRENSA_COMPLETE": f"source_{shell}"})
    assert done.exit_code == 0 and f"complete_{shell}" in done.output
