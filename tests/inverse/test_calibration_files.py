"""Calibration files: read with their cases and tables, checked with line and column, and fitted end to end on measured data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.errors import CaseError, PrensaError
from prensa.inverse.files import read_calibration
from prensa.model.schema import has_tests, load

EXAMPLES = Path(__file__).parents[2] / "examples" / "calibration"
FILES = sorted(EXAMPLES.glob("*_fit.yaml"))

FLOW = "bodies.bar.material.flow"
CASE = """
name: block
space: axisymmetric
bodies:
  block:
    mesh: {type: rectangle, size: [4, 3], n: [2, 2]}
    material: {type: j2, E: 200 GPa, nu: 0.3, flow: {type: ludwik, s0: 250, K: 450, n: 0.25}}
tools: {die: {type: plane, touching: block.top}}
friction: {type: coulomb, mu: 0.1}
fixed: {block.bottom: y}
steps: [{name: press, move: {die: {y: -0.6}}, increments: 4}]
"""
TABLE = "travel [mm],force [kN]\n" + "\n".join(f"{0.1 * k:.1f},{22 + 2 * k:.2f}" for k in range(1, 6)) + "\n"
FIT = """
tests:
  - case: case.yaml
    data: data.csv
    along: -die.uy
    observe: {force: {measure: die.force.y, sigma: 1 %}}
parameters:
  friction.mu: [0.01, 0.5]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A case, a table and a calibration file that belong together."""
    for name, text in (("case.yaml", CASE), ("data.csv", TABLE), ("fit.yaml", FIT)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_examples_are_read_and_checked(path: Path) -> None:
    """Every calibration in examples/ has its case and table, says what it shows, and passes `prensa check`."""
    found = read_calibration(path)
    assert all(e.count > len(found.parameters) for e in found.experiments)
    result = CliRunner().invoke(app, ["check", str(path)])
    assert result.exit_code == 0, result.output
    assert "readings" in result.output
    assert has_tests(path)
    for test in found.tests:
        assert Path(str(test.data)).read_text(encoding="utf-8").startswith("# ")


def test_a_case_is_no_calibration(folder: Path) -> None:
    """Cases, files that are missing and files that are no YAML are left to the reader of cases."""
    assert not has_tests(folder / "case.yaml")
    assert not has_tests(folder / "none.yaml")
    (folder / "broken.yaml").write_text("tests: [", encoding="utf-8")
    assert not has_tests(folder / "broken.yaml")


MISTAKES = {
    "no tests": (("tests:", "texts:"), r"a calibration needs 'tests'"),
    "unknown key": (("along:", "alogn:"), r"fit.yaml:5:5: unknown key 'alogn' in a test; did you mean 'along'"),
    "no table": (("data.csv", "dada.csv"), r"fit.yaml:3:5: .*dada.csv: cannot be read"),
    "no case": (("case: case.yaml", "case: cas.yaml"), r"cas.yaml: there is no such file; did you mean"),
    "no column": (("observe: {force:", "observe: {farce:"), r"no column 'farce'; did you mean 'force'"),
    "no measure": (("die.force.y", "die.farce.y"), r"fit.yaml:3:5: .*did you mean"),
    "no motion": (("-die.uy", "-dye.uy"), r"'dye.uy' is none; did you mean 'die.uy'"),
    "sigma": (("sigma: 1 %", "sigma: [1]"), r"fit.yaml:6:52: sigma is a list; write a number or a share"),
    "sigma of nothing": (("sigma: 1 %", "sigma: 0"), r"the error of 'force' is 0; it has to be greater than 0"),
    "bounds": (("[0.01, 0.5]", "[0.5]"), r"fit.yaml:8:16: friction.mu has bounds a list; write two numbers"),
    "bounds apart": (("[0.01, 0.5]", "[0.2, 0.5]"), r"fit.yaml:8:3: .*starts from 0.1, outside its bounds"),
    "no parameter": (("friction.mu:", "friction.my:"), r"fit.yaml:8:3: .*no number at 'friction.my'.*did you mean 'friction.mu'"),
    "flag": (("parameters:", "refine: perhaps\nparameters:"), r"fit.yaml:7:9: refine is 'perhaps'; write true or false"),
    "starts": (("parameters:", "starts: 0\nparameters:"), r"starts is 0; write a whole number, 1 or more"),
    "a mapping": (("{measure: die.force.y, sigma: 1 %}", "[1]"), r"a column is a list; write a text"),
    "a list": (("parameters:\n  friction.mu: [0.01, 0.5]", "parameters: 3"), r"parameters is 3; give bounds by path"),
    "mistake of the case": (("    along:", "    set: steps.0.increments=0\n    along:"), "increments"),
}


@pytest.mark.parametrize(("change", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_reported_with_their_place(folder: Path, change: tuple[str, str], message: str) -> None:
    """File, line, column, value and remedy; `prensa check` and `prensa calibrate` leave with code 2 and no traceback."""
    (folder / "fit.yaml").write_text(FIT.replace(*change), encoding="utf-8")
    if has_tests(folder / "fit.yaml"):
        with pytest.raises(CaseError, match=message):
            read_calibration(folder / "fit.yaml")
        result = CliRunner().invoke(app, ["check", str(folder / "fit.yaml")])
        assert result.exit_code == 2
    with pytest.raises(CaseError, match=message):
        read_calibration(folder / "fit.yaml")


def test_options_that_the_file_has_are_refused(folder: Path) -> None:
    """And those that a case needs are asked for."""
    run = CliRunner()
    result = run.invoke(app, ["calibrate", str(folder / "fit.yaml"), "--fit", "friction.mu"])
    assert result.exit_code == 2
    assert "leave --fit out" in result.output
    result = run.invoke(app, ["calibrate", str(folder / "case.yaml"), "--fit", "friction.mu"])
    assert result.exit_code == 2
    assert "give --data" in result.output


STRANGE = {
    "unit": ("force [kN]", "force", r"'force' is up to 32 .* give the unit in the first row"),
    "sign": (",2", ",-2", "opposite sign .* 'scale: -1'"),
}


@pytest.mark.parametrize(("old", "new", "message"), STRANGE.values(), ids=STRANGE)
def test_units_and_signs_that_cannot_be_are_reported(folder: Path, old: str, new: str, message: str) -> None:
    """Readings a hundred times off, or of the other sign, are refused before anything is bent to them."""
    text = TABLE.replace(old, new) if old != ",2" else TABLE.replace(",", ",-").replace(",-force", ",force")
    (folder / "data.csv").write_text(text, encoding="utf-8")
    found = read_calibration(folder / "fit.yaml")
    with pytest.raises(PrensaError, match=message):
        pr.calibrate(tests=found.tests, parameters=found.parameters)


HABITS = {
    "time first": ("time,travel [mm],force [kN]\n1,0.1,24\n2,0.2,26\n", r"is 'time', .* give 'column', .* column: travel, or"),
    "nothing but time": ("time,force [kN]\n1,24\n2,26\n", r"first column is 'time', .* '-die.uy', or write 'along: time'"),
    "columns swapped": ("force [kN],travel [mm]\n24,0.1\n26,0.2\n", r"'force' is in 'kN', but mm is measured .* column: travel"),
    "strokes in metres": ("travel,force [kN]\n1e-4,24\n5e-4,26\n", r"has no unit and goes to 0.0005 mm .*'travel \[m\]'"),
}


@pytest.mark.parametrize(("table", "message"), HABITS.values(), ids=HABITS)
def test_columns_taken_for_others_are_reported_with_the_key_that_names_them(folder: Path, table: str, message: str) -> None:
    """A table that runs along something else than its first column, and strokes without their unit."""
    (folder / "data.csv").write_text(table, encoding="utf-8")
    with pytest.raises(CaseError, match=message):
        read_calibration(folder / "fit.yaml")


def test_a_small_stroke_with_its_unit_is_taken_at_its_word(folder: Path) -> None:
    """Rows of the first elastic micrometres are no mistake where the table says that they are in millimetres."""
    (folder / "data.csv").write_text("travel [mm],force [kN]\n1e-4,1\n5e-4,5\n", encoding="utf-8")
    assert read_calibration(folder / "fit.yaml").experiments[0].stroke == pytest.approx([-1e-4, -5e-4])


def test_a_column_of_times_is_what_is_asked_for_where_it_is_named(folder: Path) -> None:
    """'column' names the column that a table runs along, wherever it stands."""
    (folder / "data.csv").write_text("time [s],travel [mm],force [kN]\n1,0.1,24\n2,0.2,26\n", encoding="utf-8")
    (folder / "fit.yaml").write_text(FIT.replace("    along:", "    column: travel\n    along:"), encoding="utf-8")
    assert read_calibration(folder / "fit.yaml").experiments[0].stroke == pytest.approx([-0.1, -0.2])


@pytest.mark.parametrize("sigma", ["200 %", "40"])
def test_an_error_as_large_as_what_is_read_is_refused(folder: Path, sigma: str) -> None:
    """A share written as a number, or a number in another unit, would leave every value as good as another."""
    (folder / "fit.yaml").write_text(FIT.replace("sigma: 1 %", f"sigma: {sigma}"), encoding="utf-8")
    with pytest.raises(CaseError, match=r"the error of 'force' is .* not less than its largest reading, 32000"):
        read_calibration(folder / "fit.yaml")


def test_the_same_readings_do_not_count_twice(folder: Path) -> None:
    """A test copied to make another, its data left as they were, is refused; another column of the same table is not."""
    test = FIT[FIT.index("  - case") : FIT.index("parameters:")]
    (folder / "fit.yaml").write_text(FIT.replace("parameters:", test + "parameters:"), encoding="utf-8")
    with pytest.raises(CaseError, match=r"tests 1 \(data\) and 2 \(data\) have the same readings of 'force'.* leave one out"):
        read_calibration(folder / "fit.yaml")
    rows = [row + (",bulge [mm]" if k == 0 else f",{4 + 0.01 * k}") for k, row in enumerate(TABLE.splitlines())]
    (folder / "data.csv").write_text("\n".join(rows), encoding="utf-8")
    other = test.replace("{force: {measure: die.force.y, sigma: 1 %}}", "{bulge: {measure: die.uy, sigma: 0.1}}")
    (folder / "fit.yaml").write_text(FIT.replace("parameters:", other + "parameters:"), encoding="utf-8")
    assert len(read_calibration(folder / "fit.yaml").experiments) == 2


def test_rows_that_go_back_come_twice_or_come_by_thousands(folder: Path) -> None:
    """Noise of the travel is borne, unloading refused where the case has none; doubles count once; records are thinned."""

    def notes(rows: list[tuple[float, float]], **more: object) -> tuple[int, list[str]]:
        text = "travel [mm],force [kN]\n" + "\n".join(f"{a:.6g},{b:.6g}" for a, b in rows)
        (folder / "data.csv").write_text(text, encoding="utf-8")
        e = read_calibration(folder / "fit.yaml").experiments[0]
        return e.count, e.notes

    count, words = notes([(0.1, 24), (0.2, 26), (0.199, 26.1), (0.3, 28)])
    assert count == 4
    assert any("goes back by up to 0.001" in n for n in words)
    with pytest.raises(CaseError, match=r"data.csv:4: travel goes back by 0\.1 .* leave out the unloading"):
        notes([(0.1, 24), (0.3, 26), (0.2, 25)])
    count, words = notes([(0.1, 24), (0.2, 26), (0.2, 26), (0.2, 27)])
    assert count == 3
    assert any("data.csv:4: repeats the row above" in n for n in words)
    count, words = notes([(0.5 * k / 4000, 22 + k / 4000) for k in range(1, 4001)])
    assert count == 100
    assert any("of 4000 rows 100 are fitted" in n for n in words)


def test_a_test_that_unloads_is_followed(folder: Path) -> None:
    """Rows there and back are compared with the case there and back."""
    case = CASE.replace("}]", "}, {name: back, move: {die: {y: -0.5}}, increments: 4}]")
    (folder / "case.yaml").write_text(case, encoding="utf-8")
    (folder / "data.csv").write_text("travel [mm],force [kN]\n0.3,24\n0.6,30\n0.59,10\n", encoding="utf-8")
    e = read_calibration(folder / "fit.yaml").experiments[0]
    assert e.times == pytest.approx([0.5, 1.0, 1.1])
    assert e.pace == pytest.approx([-1 / 0.6, e.pace[1], 10.0])


def test_a_measured_tension_test_is_fitted_end_to_end(tmp_path: Path) -> None:
    """304L until it necks, stored readings: the curve between guesses, a misfit of about the scatter, and what it misses."""
    found = read_calibration(EXAMPLES / "tension_304L_fit.yaml", [f"{FLOW}.Q=470", f"{FLOW}.H=650", f"{FLOW}.s0=260"])
    fit = pr.calibrate(tests=found.tests, parameters=found.parameters, refine=False, profiles=False)
    strain, stress, _ = fit.bands[FLOW]
    # by hand: true stress F (L/A₀L₀) of readings before the largest force, of which necking knows nothing
    rows = np.loadtxt(EXAMPLES / "tension_304L.csv", delimiter=",", skiprows=5)
    before = rows[: int(rows[:, 1].argmax()) - 2]
    stretch = 1 + before[:, 0] / 19.235
    true = before[:, 1] * 1000 * stretch / (np.pi * 3.175**2)
    plastic = np.log(stretch) - true / 200e3
    inside = (strain >= plastic[0]) & (strain <= plastic[-1])
    assert inside.sum() >= 4
    assert stress[inside] == pytest.approx(np.interp(strain[inside], plastic, true), rel=0.025)  # what Voce's curve misses
    assert 1.0 < fit.channels[0].misfit < 1.4
    assert fit.channels[0].runs < 0.01
    assert any("long runs of one sign" in w for w in fit.words)
    assert any("trade" in w for w in fit.words)
    (path,) = fit.write_cases(tmp_path)
    assert load(path).problem == fit.case
