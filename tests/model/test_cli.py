"""The command line reports in plain text, with an exit code, what is wrong; it starts at once."""

from __future__ import annotations

import subprocess
import sys
import types

import pytest
from typer.testing import CliRunner

import prensa
from prensa.cli import app
from prensa.errors import PrensaError

from .test_mistakes import CASE


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "upsetting.yaml"
    path.write_text(CASE)
    return path


def prensa_does(*words: object, input: str | None = None):
    return CliRunner().invoke(app, [str(w) for w in words], input=input)


@pytest.mark.parametrize("verb", ["check", "run"])
@pytest.mark.parametrize(
    "change",
    [
        "tools.punch.radus=3", "tools.punsh.radius=3", "steps.5.name=x", "steps.pres.name=x", "steps.-1.name=x", "steps.²=3",
        "tools.punch.radius", "=3", "", ".=3", "name.x=3", "bodies.billet.mesh.n=[1,2", "numerics.tol=1", "tools.punch.at.2=1",
    ],
)  # fmt: skip
def test_a_wrong_change_is_a_sentence(case, verb, change):
    """A wrong key, name, index or step, no "=", brackets that stay open: one line, and the exit code of bad input."""
    result = prensa_does(verb, case, "--set", change)
    assert result.exit_code == 2 and isinstance(result.exception, SystemExit)
    assert result.output.startswith(f"--set {change}: ") and len(result.output.strip().splitlines()) == 1


@pytest.mark.parametrize("change", [("friction.mu", "0.2"), ("friction.mu=", "0.2"), ("friction.mu", "=0.2")])
def test_a_blank_in_a_change_is_a_sentence(case, change):
    """With the change that was meant."""
    for words in (("check", case, "--set", *change), ("run", "--set", *change, case), ("sweep", case, "--set", *change)):
        result = prensa_does(*words)
        assert result.exit_code == 2
        assert result.output == f"--set {' '.join(change)}: no blank belongs there; write --set friction.mu=0.2\n"
    assert "write it as path=value, friction.mu=0.2" in prensa_does("check", case, "--set", "friction.mu 0.2").output


def test_a_fillet_for_each_corner_is_checked(case):
    """`fillet` as a list passes the check of lengths; one out of proportion is reported."""
    text = case.read_text().replace(
        "    type: circle\n    radius: 8 cm\n",
        "    type: profile\n    points: [[-12, 3], [0, 0], [12, 3]]\n    fillet: [0, 1, 0]\n",
    )
    case.write_text(text)
    result = prensa_does("check", case)
    assert result.exit_code == 0 and "against bodies" not in result.output
    result = prensa_does("check", case, "--set", "tools.punch.fillet=[0, 0.001, 0]")
    assert "tools.punch.fillet: 0.001 mm against bodies" in result.output


def test_help_and_version_come_at_once():
    """The verbs are listed without loading what they do."""
    code = "import sys, prensa.cli as c; c.app(['--help'], standalone_mode=False); print(sorted(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    for verb in ("check", "run", "resume", "verify"):
        assert f"  {verb} " in out
    assert not any(f"'{heavy}'" in out for heavy in ("numpy", "numba", "pydantic", "ruamel.yaml", "matplotlib", "pint"))
    assert prensa.__version__ in prensa_does("--version").stdout


def test_the_first_iteration_waits_for_nothing_that_it_does_not_need(case, tmp_path):
    """What draws, writes fields and checkpoints, reads meshes or looks up rare units is loaded when it is needed."""
    code = """
import logging, os, sys

class Leave(logging.Handler):
    def emit(self, record):
        if ", iteration 0:" in record.getMessage() or ", iteration 1:" in record.getMessage():
            print(sorted(sys.modules), flush=True)
            os._exit(0)

logging.getLogger("prensa").addHandler(Leave())
from prensa.cli import main
main()
"""
    words = ["run", str(case), "--out", str(tmp_path / "out"), "--quiet"]
    out = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True).stdout
    assert "'prensa.solver.newton'" in out
    late = ("h5py", "jinja2", "matplotlib", "meshio", "pint", "prensa.mesh.read", "scipy.interpolate", "scipy.spatial")
    assert [name for name in late if f"'{name}'" in out] == []


def test_check_says_what_would_run(case):
    """Bodies, placed tools, contacts, steps and the size are printed, and nothing is solved."""
    result = prensa_does("check", case, "--set", "bodies.billet.mesh.n=[4, 6]")
    assert result.exit_code == 0, result.output
    for words in (
        "24 elements q4_fbar, 35 nodes",
        "tool punch: circle, reference point at (0, 95)",
        "contact billet.top+billet.right-punch: 11 candidate points",
        "step press: time 0 … 1; move {punch: {y: -7.5}}, 50 increments",
        "73 unknowns",
    ):
        assert words in result.stdout


def test_bad_input_is_two_and_plain(case):
    """Mistakes of the case go to stderr as lines of file, line and column, without a traceback."""
    case.write_text(CASE.replace("radius:", "radus:"))
    for verb in ("check", "run"):
        result = prensa_does(verb, case)
        assert result.exit_code == 2
        assert result.stderr.startswith(f"{case}:11:5: unknown key 'radus'")
        assert "Traceback" not in result.output and result.stdout == ""
    assert prensa_does("check", case.with_name("none.yaml")).exit_code == 2


def test_what_cannot_be_meshed_or_placed_is_bad_input(case):
    """A mistake that only the mesh shows is reported in the same way."""
    result = prensa_does("check", case, "--set", "bodies.billet.mesh.origin=[-3, 0]")
    assert result.exit_code == 2 and "bodies.billet.mesh" in result.stderr


def test_warnings_are_reported_and_do_no_harm(case):
    """A likely slip is one line on stderr; the check goes on."""
    result = prensa_does("check", case, "--set", "bodies.billet.material.E=70")
    assert result.exit_code == 0 and ".yaml:7:5: warning: bodies.billet.material: E = 70" in result.stderr


# ------------------------------------------------------------------------------------------ verbs that others carry out
@pytest.fixture
def carried_out(monkeypatch):
    """A stand-in for the modules that run and verify, which records what it is asked for."""
    asked = []

    def stand_in(name, **functions):
        monkeypatch.setitem(sys.modules, name, types.SimpleNamespace(**functions))

    def prepare(error: BaseException | None = None):
        def answer(*args, **options):
            asked.append((args, options))
            if error is not None:
                raise error
            return 1

        stand_in("prensa.output.run", run=answer, resume=answer)
        return asked

    return prepare


def test_run_hands_over_the_case_and_the_folder(case, carried_out, tmp_path):
    """The case with its changes goes to the writer; results/<name> unless said otherwise."""
    asked = carried_out()
    assert prensa_does("run", case, "--set", "tools.punch.radius=5", "--out", tmp_path / "o", "--quiet").exit_code == 0
    (loaded,), options = asked[0]
    assert loaded.problem.tools["punch"].radius == 5
    assert options.pop("bar")._quiet
    assert options == {"out": tmp_path / "o", "source": case, "force": False}
    prensa_does("run", case)
    assert str(asked[1][1]["out"]).endswith("results/upsetting")
    prensa_does("resume", tmp_path / "o")
    assert asked[2][0] == (tmp_path / "o",)


def test_a_failed_run_is_one(case, carried_out):
    """When the time stepping gives up, or the disk is full, the exit code is 1; other errors of prensa are bad input, 2."""
    stepping = pytest.importorskip("prensa.solver.time_stepping")
    for error, code in ((stepping.SolveError("no convergence"), 1), (OSError("disk full"), 1), (PrensaError("bad"), 2)):
        carried_out(error)
        result = prensa_does("run", case)
        assert result.exit_code == code
        assert str(error) in result.stderr and "Traceback" not in result.stderr


def test_an_interrupted_run_says_what_it_left(case, carried_out, tmp_path):
    """Ctrl-C leaves 130 and one line about the results on disk and how to go on."""
    carried_out(KeyboardInterrupt())
    out = tmp_path / "o"
    result = prensa_does("run", case, "--out", out)
    assert result.exit_code == 130 and "no increment was finished" in result.stderr
    out.mkdir()
    (out / "history.csv").write_text("step,increment\npress,1\npress,2\n")
    (out / "checkpoint.h5").touch()
    result = prensa_does("run", case, "--out", out)
    assert f"{out} holds 2 increments; continue with 'prensa resume {out}'" in result.stderr
