"""Calibration: known parameters are found again with intervals that hold them, and data that cannot be used are reported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.errors import ArgumentError, PrensaError
from prensa.inverse.experiment import ready
from prensa.inverse.meshes import finer
from prensa.inverse.objective import Objective, Parameter
from prensa.inverse.result import runs_test
from prensa.inverse.tables import DataError, read_table
from prensa.model.problem import Problem
from prensa.model.schema import dump, load, loads
from prensa.sensitivity.parameters import value_of, with_values
from rings import MU, K, N, ring

TRUTH = {MU: 0.12, K: 450.0, N: 0.25}
SEEN = {"force": "die.force.y", "bore": pr.Observe("ring.left.x at y=0", sigma=0.004)}


def true(*changes: str) -> Problem:
    """The ring test with the values that are sought, and changes."""
    return ring(*(f"{path}={value}" for path, value in TRUTH.items()), "steps.0.move.die.y=-0.9", *changes)


def guessed() -> Problem:
    """The ring test with poor values of what is sought."""
    return with_values(true(), {MU: 0.2, K: 700.0, N: 0.4})


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Readings of the ring on a finer mesh with the true values, 1 % and 4 µm of noise, in other units; a bore is missing."""
    rng = np.random.default_rng(2)
    lines = ["# a test", "travel [m],force [kN],bore [mm]"]
    increments = list(pr.solve(true("bodies.ring.mesh.n=[6, 4]")))
    largest = increments[-1].measure("die.force.y")
    for k, i in enumerate(increments):
        force = i.measure("die.force.y") + 0.01 * largest * rng.standard_normal()
        bore = f"{i.measure('ring.left.x at y=0') + 0.004 * rng.standard_normal():.8g}" if k != 3 else ""
        lines.append(f"{-1e-3 * i.measure('die.uy'):.10g},{1e-3 * force:.8g},{bore}")
    path = tmp_path_factory.mktemp("data") / "ring.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def test_known_parameters_are_found_within_their_intervals(table: Path, tmp_path: Path) -> None:
    """Friction and flow curve from one ring test: right within the intervals, kept runs used again, a page and a case."""
    lines: list[str] = []
    fit = pr.calibrate(
        guessed(), table, SEEN, {MU: (0.02, 0.5), K: None, N: None}, along="-die.uy", keep=tmp_path, report=lines.append
    )
    for path, true in TRUTH.items():
        assert fit.parameters[path].low < true < fit.parameters[path].high
        assert abs(fit.parameters[path].mesh) > 0.0
    assert fit.parameters[MU].noise < 0.02 * 0.12
    assert 0.2 < fit.reduced < 2.5
    assert fit.freedom == 11 - 3
    assert any("trade" in w for w in fit.words)
    strain, stress, half = fit.bands["bodies.ring.material.flow"]
    true = 250 + 450 * strain**0.25
    assert (np.abs(stress - true)[2:] < 2 * half[2:] + 0.01 * true[2:]).all()
    assert loads(fit.write_case(tmp_path / "case.yaml").read_text(encoding="utf-8")).problem == fit.case
    assert value_of(fit.case, MU) == fit.parameters[MU].value
    page = fit.report(tmp_path / "fit.html").read_text(encoding="utf-8")
    assert page.count("<img") == 3
    assert "bodies.ring.material.flow.K" in page
    assert str(fit).count("\n") >= 4
    # the same again from what was kept: not one run
    again = pr.calibrate(
        guessed(), table, SEEN, {MU: (0.02, 0.5), K: None, N: None}, along="-die.uy", keep=tmp_path, report=lines.append
    )
    assert again.runs == 0
    assert again.values == fit.values


def test_the_derivatives_of_the_objective_are_its_derivatives(table: Path) -> None:
    """J of parameters, gain and offset against differences of the residuals."""
    seen = {"force": pr.Observe("die.force.y", gain="2 %"), "bore": SEEN["bore"]}
    e = ready(pr.Test(true(), table, seen, "-die.uy", offset=1e-5), 1)
    o = Objective([e], [Parameter.of(p, v, None) for p, v in TRUTH.items()])
    x = np.array([*(p.inner(p.start) for p in o.parameters), 0.3, -0.2])
    at = o.at(x)
    assert at is not None
    for k in range(5):
        step = 1e-4 * np.eye(5)[k]
        above, below = o.at(x + step), o.at(x - step)
        assert above is not None
        assert below is not None
        assert at.J[:, k] == pytest.approx((above.r - below.r) / 2e-4, rel=2e-3, abs=2e-3 * np.abs(at.J[:, k]).max())


def test_a_gain_that_is_not_known_costs_the_strength_its_digits(table: Path) -> None:
    """A load cell known to 5 % leaves friction as it was, and the flow curve ten times less sure."""
    found = [
        pr.calibrate(true(), table, {"force": pr.Observe("die.force.y", gain=gain), "bore": SEEN["bore"]},
                     {MU: None, K: None}, "-die.uy", refine=False, profiles=False)
        for gain in (None, "5 %")
    ]  # fmt: skip
    assert found[1].parameters[K].noise > 4 * found[0].parameters[K].noise
    assert found[1].parameters[MU].noise < 1.5 * found[0].parameters[MU].noise
    assert found[1].instruments["ring: gain of force"] == pytest.approx(1.0, abs=0.1)
    assert any("error of the mesh is not known" in w for w in found[0].words)


def test_intervals_hold_the_truth_as_often_as_they_say(table: Path) -> None:
    """On the mesh of the truth 95 % intervals hold it in 90 to 99 of 100 noises (each of three parameters)."""
    e = ready(pr.Test(true(), table, SEEN, "-die.uy"), 1)
    o = Objective([e], [Parameter.of(p, v, None) for p, v in TRUTH.items()])
    x = np.array([p.inner(p.start) for p in o.parameters])
    at = o.at(x)
    assert at is not None
    rng, inside = np.random.default_rng(5), np.zeros(3)
    # noise moves the fit along the linearised problem: one Gauss-Newton step from the truth, 100 times
    for _ in range(100):
        noise = rng.standard_normal(len(at.r))
        step, *_ = np.linalg.lstsq(at.J, noise, rcond=None)
        left = noise - at.J @ step
        freedom = len(noise) - 3
        spread = np.sqrt(np.diag(np.linalg.inv(at.J.T @ at.J)) * max(left @ left / freedom, 1.0))
        inside += np.abs(step) < 2.18 * spread
    assert (inside >= 90).all()


def test_several_tests_and_starts_lead_to_one_answer(table: Path) -> None:
    """Two tables of one material, two starts: the same least χ², and more sure than from one test."""
    test = pr.Test(true(), table, {"force": "die.force.y"}, "-die.uy")
    other = pr.Test(true(), table, {"bore": SEEN["bore"]}, "-die.uy", name="bores")
    fit = pr.calibrate(parameters={MU: (0.05, 0.3)}, tests=[test, other], starts=2, refine=False, profiles=False, compare=False)
    assert len(fit.starts) == 2
    assert fit.starts[-1] == pytest.approx(fit.starts[0], rel=1e-2)
    assert "2 of 2 starts led to this answer" in fit.words
    assert {c.test for c in fit.channels} == {"ring", "bores"}


@pytest.mark.parametrize(
    ("text", "observe", "message"),
    [
        ("travel,force\n0.001,1", {"bore": "die.force.y"}, "no column 'bore'.*; it has travel, force"),
        ("travel [mm],force [mm]\n0.1,1", {"force": "die.force.y"}, "'force' is in 'mm', but N is measured"),
        (
            "travel [mm],force [kN]\n0.1,1\n2.5,2",
            {"force": "die.force.y"},
            "travel reaches -2.5 .* goes from -0.9 to 0",
        ),
        ("travel [mm],force [kN]\n0.1,1", {"force": "die.force.y"}, "1 readings cannot determine 2 parameters"),
        ("travel [mm],force [kN]\n0.1", {"force": "die.force.y"}, ":2: 1 cells, but 2 columns"),
        ("travel [mm],force [kN]\n0.1,1,2", {"force": "die.force.y"}, ":2: 3 cells, but 2 columns"),
        ("travel [mm],force [kN]\n0.1,much", {"force": "die.force.y"}, ":2: force is 'much'; a number is expected"),
        ("travel [mm],force [kN]\n0.1,", {"force": "die.force.y"}, "'force' has no readings"),
        ("travel [mm],force [kN]\n,1", {"force": "die.force.y"}, "'travel' has empty cells"),
        ("0.1,1\n0.2,2", {"force": "die.force.y"}, "first row has to name every column"),
        ("travel", {"force": "die.force.y"}, "there are no rows"),
        (
            "travel [mm],force [kN]\n0.1,1",
            {"force": pr.Observe("die.force.y", sigma="some")},
            "write a number or a share",
        ),
        ("travel [mm],force [kN]\n0.1,1", {"force": "die.farce.y"}, "did you mean"),
    ],
)
def test_bad_data_are_reported_in_a_line(
    tmp_path: Path, text: str, observe: dict[str, pr.Observe | str], message: str
) -> None:
    """Missing columns, wrong units, strokes beyond the case, too few readings: which, where, and what to do."""
    (tmp_path / "d.csv").write_text(text, encoding="utf-8")
    with pytest.raises(PrensaError, match=message) as caught:
        pr.calibrate(guessed(), tmp_path / "d.csv", observe, {MU: None, K: None}, along="-die.uy")
    assert "\n" not in str(caught.value)


def test_forces_of_a_strip_of_some_thickness_are_whole_ones(tmp_path: Path) -> None:
    """A strip of 5 mm: its table in kN gives back the strength that made it; per millimetre of thickness is refused."""
    body = pr.Body(pr.Rectangle((4, 2), (6, 3)), pr.J2(70e3, 0.33, pr.Linear(100, 200)))
    case = Problem(
        "strip", bodies={"strip": body}, tools={"die": pr.Plane(touching="strip.top")}, friction=pr.Coulomb(0.1), thickness=5.0,
        fixed={"strip.bottom": "y", "strip.left": "x"}, steps=[pr.Step("press", move={"die": {"y": -0.2}}, increments=4)],
    )  # fmt: skip
    rows = [f"{-i.measure('die.uy')!r},{i.measure('die.fy') / 1e3!r}" for i in pr.solve(case)]
    strength = "bodies.strip.material.flow.H"
    for unit in ("kN", "kN/mm"):
        (tmp_path / "d.csv").write_text("\n".join([f"travel [mm],force [{unit}]", *rows]), encoding="utf-8")
        guess = loads(dump(case), [f"{strength}=300"]).problem if unit == "kN" else case
        args = guess, tmp_path / "d.csv", {"force": "die.fy"}, {strength: None}
        if unit == "kN":
            fit = pr.calibrate(*args, along="-die.uy", refine=False, profiles=False, compare=False)
            assert fit.values[strength] == pytest.approx(200.0, rel=1e-3)
        else:
            with pytest.raises(PrensaError, match="'force' is in 'kN/mm', but N is measured"):
                pr.calibrate(*args, along="-die.uy")


def test_a_column_that_no_parameter_moves_is_reported_before_the_fit(table: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The travel of the tool is prescribed: a column of it is reported after the first run, before the steps of the fit.

    Who gives nothing to tell it to sees it as a warning.
    """
    lines: list[str] = []
    text = table.read_text(encoding="utf-8").splitlines()
    rows = [f"{row},{-1e3 * float(row.split(',')[0]):.8g}" for row in text[2:]]
    data = table.with_name("idle.csv")
    data.write_text("\n".join([f"{text[1]},way [mm]", *rows]), encoding="utf-8")
    seen = SEEN | {"way": pr.Observe("die.uy", sigma=0.01)}
    fit = pr.calibrate(guessed(), data, seen, {MU: (0.02, 0.5)}, "-die.uy", refine=False, compare=False, report=lines.append)
    assert "at the start no parameter affects 'way'" in lines[1]
    assert sum("no parameter affects" in line for line in lines) == 1
    assert any("no parameter affects 'way'" in w for w in fit.words)
    pr.calibrate(guessed(), data, seen, {MU: (0.02, 0.5)}, "-die.uy", refine=False, compare=False, profiles=False)
    warnings = [r for r in caplog.records if "no parameter affects 'way'" in r.getMessage()]
    assert [r.levelname for r in warnings] == ["WARNING"]


def test_what_the_fit_cannot_use_is_reported(table: Path, tmp_path: Path) -> None:
    """A parameter that moves nothing is said to; starts outside bounds, no parameters and no file are refused."""
    along = "bodies.ring.mesh.origin.1"  # where the ring lies does not matter
    parameters, force = {along: None, MU: None}, {"force": "die.force.y"}
    fit = pr.calibrate(true(), table, force, parameters, "-die.uy", refine=False, compare=False)
    assert fit.parameters[along].profile is None
    assert any(f"{along} affects nothing that was measured" in w for w in fit.words)
    with pytest.raises(ArgumentError, match="outside its bounds"):
        pr.calibrate(guessed(), table, SEEN, {MU: (0.3, 0.5)}, along="-die.uy")
    with pytest.raises(ArgumentError, match="nothing to fit"):
        pr.calibrate(guessed(), table, SEEN, {})
    with pytest.raises(DataError, match="cannot be read"):
        read_table(tmp_path / "none.csv")
    with pytest.raises(DataError, match="along the time or a motion of a tool"):
        pr.calibrate(guessed(), table, SEEN, {MU: None}, along="die.force.y")


def test_runs_of_one_sign() -> None:
    """Residuals that keep their sign are improbable, those that change it are not (Wald and Wolfowitz; 6 of each in 3 runs)."""
    assert runs_test(np.array([1, 1, 1, 1, -1, -1, -1, -1, -1, -1, 1, 1.0])) == pytest.approx((2 + 5 + 5) / 924)
    assert runs_test(np.array([1.0, -1.0] * 6)) == 1.0


def test_a_mesh_is_refined_by_its_counts() -> None:
    """One and a half times the elements; a mesh from a file stays, and is said to."""
    mesh = finer(true())
    assert mesh is not None
    assert mesh.bodies["ring"].mesh.n == (6, 4)  # type: ignore[union-attr]


def test_what_an_experiment_would_tell() -> None:
    """The bore gives friction, the force the strength; one last bore is nearly as good as all; nothing determines E."""
    found = pr.identify(true(), SEEN, [MU, K, N], rows=8)
    halves = found.plans
    assert halves["without bore"][0] > 20 * halves["all readings"][0]
    assert halves["without force"][1] > 10 * halves["all readings"][1]
    assert halves["only the last bore"][0] < 3 * halves["all readings"][0]
    assert (halves["stopped at 50 % of the time"] > halves["all readings"]).all()
    assert "stopped at 25 %" in str(found)
    with pytest.raises(ArgumentError, match="rows"):
        pr.identify(guessed(), SEEN, [MU], rows=1)


def test_the_command_line_does_the_same(table: Path, tmp_path: Path) -> None:
    """Prensa calibrate leaves a page and a case with the found values; prensa identify prints its table."""
    case = tmp_path / "ring.yaml"
    case.write_text(dump(true()), encoding="utf-8")
    asked = [
        str(case),
        "--observe",
        "force=die.force.y",
        "--observe",
        "bore=ring.left.x at y=0",
        "--sigma",
        "bore=0.004",
    ]
    run = CliRunner()
    result = run.invoke(
        app, ["calibrate", *asked, "--data", str(table), "--along=-die.uy", "--fit", f"{MU}=0.02..0.5",
              "--out", str(tmp_path / "fit"), "--no-refine", "--quiet", "--set", "friction.mu=0.15"],
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert value_of(load(tmp_path / "fit" / "case.yaml").problem, MU) == pytest.approx(0.12, rel=0.02)
    assert (tmp_path / "fit" / "fit.html").is_file()
    result = run.invoke(app, ["identify", *asked, "--fit", MU, "--rows", "4"])
    assert result.exit_code == 0, result.output
    assert "all readings" in result.output
    result = run.invoke(app, ["identify", str(case), "--observe", "force", "--fit", MU])
    assert result.exit_code != 0
