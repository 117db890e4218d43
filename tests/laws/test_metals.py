"""Metals by name: their constants are those of their sources, arrive in the units of the case, and say where they end."""

from __future__ import annotations

import json
import logging
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.materials.flow_curve import stress_at
from prensa.materials.metals import library, read_metal
from prensa.model.plausibility import warnings_of
from prensa.model.schema import dump, json_schema, load, loads
from prensa.output.metals import flow_curves, lines_of
from prensa.sensitivity.parameters import numbers, with_values
from problems import single_block

CASE = """\
name: upsetting
units: {length: UNIT, force: N}
space: axisymmetric
bodies: {billet: {mesh: {type: rectangle, size: [10 mm, 15 mm], n: [2, 3]}, material: MATERIAL}}
tools: {punch: {type: plane, touching: billet.top}}
fixed: {billet.bottom: y}
steps: [{name: press, move: {punch: {y: -3 mm}}, increments: 5, duration: 2}]
"""
OWN = """\
E: 206 GPa
nu: 0.3
flow: {type: table, points: [[0, 200 MPa], [0.1, 300], [0.5, 400]]}
strain: [0, 0.5]
rate: [0, 0.01]
source: tensile tests of 3 March
"""


def case(material: str, unit: str = "mm") -> str:
    return CASE.replace("UNIT", unit).replace("MATERIAL", material)


def material_of(text: str, folder: Path | None = None) -> pr.J2:
    return loads(text, "case.yaml", folder).problem.bodies["billet"].material


HOT = {  # Weiner & Renzing, PyRolL, materials.py, with a base strain and rate of 0.1: A, m1, m2, m3, m4, m5, m7, m8, m9
    "C22-hot": (3304.39, -0.00281, 0.34766, 0, 0.00002, -0.00130, 0.07632, 0.000148, 0),
    "C45-hot": (3268.49, -0.00267855, 0.34446, 0, 0.000551814, -0.00132042, 0.0166334, 0.000149907, 0),
    "S355J2-hot": (2852.66, -0.00244, 0.41934, 0, 0.00088, -0.00149, 0.12169, 0.000127, 0),
    "11SMn30-hot": (1473.43, -0.00239, 0.22924, 0, -0.00870, 0.00010, -0.44065, 0.000161, 0),
    "BSt500-hot": (4877.12, -0.00273339, 0.302309, -0.0407581, 0.000222222, -0.000383134, -0.492672, 0.000175044, -0.0611783),
}


@pytest.mark.parametrize("name", HOT)
@pytest.mark.parametrize(("T", "strain", "rate"), [(1100.0, 0.3, 1.0), (950.0, 1.0, 20.0)])
def test_hot_flow_stresses_are_those_of_the_printed_constants(name, T, strain, rate):
    """At the temperature of the file and, with another T, at that one."""
    A, m1, m2, m3, m4, m5, m7, m8, m9 = HOT[name]
    flow, e, r = replace(read_metal(name)[1].flow, T=T), strain + 0.1, rate + 0.1
    factors = (math.exp(m1 * T), T**m9, e**m2, math.exp(m4 / e), (1 + e) ** (m5 * T), math.exp(m7 * e), r ** (m3 + m8 * T))
    assert stress_at(flow, np.array([strain]), np.array([rate]))[0] == pytest.approx(A * math.prod(factors), rel=1e-12)


# Constants as the sources print them: Johnson & Cook (1983), Table 1 (A, B, n, C); Kalpakjian & Schmid, Table 2.3, and Callister
# (2005), page 199 (K, n).
PRINTED = {
    "Cu-OFHC": (90, 292, 0.31, 0.025), "Armco-iron": (175, 380, 0.32, 0.06), "AISI1006": (350, 275, 0.36, 0.022),
    "AA2024-T351": (265, 426, 0.34, 0.015), "AISI4340-QT": (792, 510, 0.26, 0.014), "CuZn30-JC": (112, 505, 0.42, 0.009),
    "AA6061-O": (205, 0.20), "AA1100-O": (180, 0.20), "CuZn30": (900, 0.49), "AISI304": (1275, 0.45), "AISI410": (960, 0.10),
    "low-carbon-steel": (530, 0.26), "AISI4135": (1015, 0.17), "AZ31B-O": (450, 0.16), "CuZn39Sn1": (585, 0.21),
}  # fmt: skip


@pytest.mark.parametrize("name", PRINTED)
def test_flow_stresses_are_those_of_the_printed_constants(name):
    """At a true strain of a tenth, and at ten per second, the flow stress is that of the source's formula."""
    _, file = read_metal(name)
    if len(PRINTED[name]) == 4:
        A, B, n, C = PRINTED[name]
        strain, rate, expected = 0.1, 10.0, (A + B * 0.1**n) * (1 + C * math.log(10.0))
    else:  # of total strain; σ/E of it is elastic, which the prestrain stands for at first yield
        K, n = PRINTED[name]
        strain, rate, expected = 0.1 - (K / file.E) ** (1 / (1 - n)), 0.0, K * 0.1**n
    assert stress_at(file.flow, np.array([strain]), np.array([rate]))[0] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("name", library())
def test_every_metal_states_its_source_and_a_range_that_can_be_derived(name):
    """Source, address and range are stated; the range is where a tensile test stays uniform (Considère, dσ/dε = σ)."""
    metal, file = read_metal(name)
    assert file.what and file.source and file.elastic and file.see.startswith("https://")
    hot = file.flow.type == "hensel_spittel"
    assert file.temperature == ((file.flow.T, file.flow.T) if hot else (20, 20))
    assert name in metal.words() and metal.source in metal.words()
    end, h = file.strain[1], 1e-6
    rate = np.full(2, 1.0)
    low, high = stress_at(file.flow, np.array([end - h, end + h]), rate)
    if file.note.startswith("Hollomon's law"):  # of total strain: n
        assert end == file.flow.n
        assert file.flow.K * file.flow.e0**file.flow.n == pytest.approx(file.E * file.flow.e0, rel=1e-4)
    else:
        assert (high - low) / (2 * h) == pytest.approx((low + high) / 2, rel=0.08)  # of two digits


@pytest.mark.parametrize("name", library())
def test_no_metal_of_the_library_is_doubted(name):
    """Not for the flow stress at which Hollomon's law begins, next to nothing, either: the proof stress is looked at."""
    step = pr.Step("press", duration=1.0)
    body = pr.Body(pr.Rectangle((1.0, 1.0), (1, 1)), pr.J2(of=name))
    assert not warnings_of(pr.Problem("p", space="plane strain", bodies={"b": body}, fixed={"b.bottom": "xy"}, steps=[step]))


def test_every_metal_says_on_what_terms_its_numbers_are_here() -> None:
    """Numbers are facts: whose the source is, and that nothing else of it is copied."""
    assert all(m.licence.startswith("constants are facts") and "is copied" in m.licence for m in library().values())


def test_there_are_twenty_metals_and_their_names_are_unique():
    """No name, of another standard either, stands for two metals."""
    names = [n.casefold() for k, m in library().items() for n in {k, *m.also}]
    assert len(library()) >= 20 and len(names) == len(set(names))


@pytest.mark.parametrize(("unit", "by"), [("mm", 1.0), ("m", 1e6), ("inch", 25.4**2)])
def test_stresses_arrive_in_the_units_of_the_case(unit, by):
    """E, the flow stresses, and those of a table are converted; strains are not."""
    metal = material_of(case("{type: j2, of: 34crmo4}", unit))
    assert (metal.of.name, metal.of.changed) == ("AISI4135", ())
    np.testing.assert_allclose([metal.E, metal.flow.K], [207e3 * by, 1015 * by])
    assert metal.flow.n == 0.17 and metal.nu == 0.292
    hot = material_of(case("{type: j2, of: C45-hot, flow: {T: 1000}}", unit))
    np.testing.assert_allclose([hot.flow.A, hot.flow.T, hot.flow.rate0], [3268.49 * by, 1000.0, 0.1])


@pytest.mark.parametrize("T", [20, 779, 1441])
def test_a_temperature_at_which_a_hot_metal_is_another_is_refused(T):
    """By a key or by --set, with its line and the range that the file of the metal states; a curve of one's own is not."""
    said = rf"^case.yaml:\d+:\d+: T is {T} °C, and the flow curve of 'C45-hot' is stated for 780 to 1440 °C; take a temperature"
    with pytest.raises(pr.CaseError, match=said):
        loads(case(f"{{type: j2, of: C45-hot, flow: {{T: {T}}}}}"), "case.yaml")
    with pytest.raises(pr.CaseError, match=f"T is {T} °C"):
        loads(case("{type: j2, of: C45-hot, flow: {T: 900}}"), overrides=[f"bodies.billet.material.flow.T={T}"])
    assert material_of(case("{type: j2, of: C45-hot, flow: {T: 780}}")).flow.T == 780


def test_the_temperatures_of_hot_metals_are_those_of_austenite():
    """From Andrews' Ac3 = 910 - 203 √C at 0.45 % carbon, 774 °C, upwards; the file's own curve lies within."""
    assert 774 <= library()["C45-hot"].holds[0] < 784
    hot = {k: m for k, m in library().items() if k.endswith("-hot")}
    assert len(hot) == 5 and all(m.holds[0] < m.temperature[0] == m.flow.T < m.holds[1] for m in hot.values())


def test_what_the_case_states_besides_takes_the_place_of_that_number():
    """A constant of the curve, by --set too, or another curve; the rest stays, and what is changed is listed."""
    metal = material_of(case("{type: j2, of: AISI304, E: 200 GPa, flow: {n: 0.4}}"))
    assert (metal.E, metal.flow.K, metal.flow.n, metal.of.changed) == (200e3, 1275, 0.4, ("E", "flow.n"))
    changed = loads(case("{type: j2, of: AISI304}"), overrides=["bodies.billet.material.flow.K=1300 MPa"])
    assert changed.problem.bodies["billet"].material.flow.K == 1300
    with pytest.raises(pr.CaseError, match="nothing of the metal 'AISI304' is used; leave them out, or 'of'"):
        pr.J2(200e3, 0.3, pr.Perfect(s0=300), of="AISI304")
    other = material_of(case("{type: j2, of: AISI304, flow: {type: perfect, s0: 300}}"))
    assert (other.flow, other.of.changed) == (pr.Perfect(s0=300), ("flow",))


def test_a_written_case_holds_the_numbers_and_their_source(tmp_path):
    """It is the same problem where the library is another one, or the user's file is gone."""
    (tmp_path / "own.yaml").write_text(OWN, encoding="utf-8")
    (tmp_path / "case.yaml").write_text(case("{type: j2, of: own.yaml}", "m"), encoding="utf-8")
    problem = load(tmp_path / "case.yaml").problem
    assert problem.bodies["billet"].material.flow.points[1] == (0.1, pytest.approx(300e6))
    (tmp_path / "own.yaml").unlink()
    assert loads(dump(problem)).problem == problem
    assert "tensile tests of 3 March" in dump(problem)


def test_unknown_metals_are_refused_in_one_line(tmp_path):
    """With the place in the case and the nearest names; a missing file likewise."""
    with pytest.raises(pr.CaseError) as refused:
        loads(case("{type: j2, of: AISI4136}"), "case.yaml")
    assert str(refused.value).startswith("case.yaml:4:")
    assert "unknown metal 'AISI4136'; the closest names are 'AISI4135'" in str(refused.value)
    assert "\n" not in str(refused.value)
    with pytest.raises(pr.CaseError, match=r"the closest names are 'AISI1045-hot'"):  # before those of a like number
        loads(case("{type: j2, of: aisi1045}"), "case.yaml")
    with pytest.raises(pr.CaseError, match=r"J2: unknown metal 'steel'; .*prensa materials"):
        pr.J2(of="steel")
    with pytest.raises(pr.CaseError, match=r"there is no file 'none.yaml'; paths are relative to the case file"):
        loads(case("{type: j2, of: none.yaml}"), "case.yaml", tmp_path)


@pytest.mark.parametrize(
    ("written", "instead", "words"),
    [
        ("flow: {type: table", "flow: {type: tabel", r"own.yaml:3:14: unknown flow 'tabel'; did you mean 'table'"),
        ("source: tensile tests of 3 March\n", "", r"own.yaml:1:1: .* needs 'source'"),
        ("[0, 0.5]\nrate", "[0.5, 0]\nrate", r"own.yaml:4:1: strain of the metal: it must be a range"),
        ("E: 206 GPa", "E: 206 kN", r"own.yaml:1:4: .*'206 kN' is not a stress"),
        ("E: 206 GPa\n", "E: 206 GPa\nE: 1\n", r"own.yaml:2:1: the key 'E' appears twice"),
    ],
)
def test_mistakes_in_a_file_of_ones_own_have_their_place_there(tmp_path, written, instead, words):
    """Line and column are those of the metal's file."""
    (tmp_path / "own.yaml").write_text(OWN.replace(written, instead), encoding="utf-8")
    with pytest.raises(pr.CaseError, match=words):
        loads(case("{type: j2, of: own.yaml}"), "case.yaml", tmp_path)


def test_a_script_in_other_units_is_refused():
    """In Python, where units are not known yet, stresses are in N/mm²."""
    body = pr.Body(pr.Rectangle(size=(1, 1), n=(1, 1)), pr.J2(of="AISI304"))
    assert pr.Problem("p", bodies={"b": body}, steps=[pr.Step("s")]).bodies["b"].material.E == 190e3
    with pytest.raises(pr.CaseError, match=r"bodies.b.material: the stresses of 'AISI304' are not in N/m²"):
        pr.Problem("p", bodies={"b": body}, steps=[pr.Step("s")], units=pr.Units("m", "N"))


@pytest.mark.parametrize(("strain", "rate", "duration", "reported"), [
    ((0.0, 0.05), None, None, ["up to a plastic strain of 0.05"]), ((0.0, 0.5), (0.0, 0.01), None, []),
    ((0.0, 0.5), (0.0, 0.01), 2.0, ["measured at 0 to 0.01 /s"]), ((0.0, 0.5), (0.0, 0.01), 200.0, []),
    ((0.0, 0.5), (1.0, 10.0), 2.0, ["measured at 1 to 10 /s"]),
])  # fmt: skip
def test_a_run_that_leaves_the_range_of_the_tests_says_so(strain, rate, duration, reported, caplog):
    """One warning at the end of the run with the largest strain, or strain rate where the step says how long it lasts."""
    caplog.set_level(logging.WARNING, "prensa")
    metal = replace(pr.J2(of="AA1100-O"), of=pr.Metal(name="AA1100-O", source="tests", strain=strain, rate=rate))
    step = pr.Step("pull", fixed={"b.right": pr.Fixed(x=0.4)}, increments=4, duration=duration)
    increments = list(pr.solve(single_block(step, material=metal, n=(2, 1))))
    said = [r.getMessage() for r in caplog.records]
    assert len(said) == len(reported) and all(words in text for words, text in zip(reported, said)), said
    plastic = [inc.bodies["b"].plastic_strain.max() for inc in increments]
    largest = {"strain": plastic[-1], "rate": np.diff([0.0, *plastic]).max() / (duration or 1.0) * 4}
    for text in said:
        assert f"up to {largest['rate' if 'rates' in text else 'strain']:.3g}" in text


def test_check_and_summary_name_the_metal_with_its_source(tmp_path):
    """Both say what was used, its range, and what the case changed."""
    (tmp_path / "case.yaml").write_text(case("{type: j2, of: X12Cr13, flow: {n: 0.15}}"), encoding="utf-8")
    checked = CliRunner().invoke(app, ["check", str(tmp_path / "case.yaml")])
    assert "of AISI410 (plastic strain 0 to 0.1, 20 °C; flow.n of the case): Kalpakjian & Schmid" in checked.output
    data = json.loads(CliRunner().invoke(app, ["check", "--json", str(tmp_path / "case.yaml")]).stdout)
    assert data["metals"]["billet"]["name"] == "AISI410"
    ran = pr.run(load(tmp_path / "case.yaml"), out=tmp_path / "out")
    assert ran.summary["metals"] == data["metals"]


def test_a_parameter_that_is_varied_is_no_longer_that_of_the_source():
    """Where derivatives and calibrations put in another number, the metal says so; its source has no numbers to vary."""
    problem = loads(case("{type: j2, of: AISI304}")).problem
    path = "bodies.billet.material.flow.K"
    assert path in numbers(problem) and not [p for p in numbers(problem) if ".material.of" in p]
    metal = with_values(problem, {path: 1300.0}).bodies["billet"].material
    assert (metal.flow.K, metal.of.changed) == (1300.0, ("flow.K",))
    assert "flow.K of the case" in metal.of.words()


def test_editors_accept_a_material_of_a_metal():
    """What the metal gives may be left out by the schema of case files; of other materials nothing may."""
    about = json_schema()["$defs"]
    assert not {"E", "nu", "flow"} & set(about["J2"].get("required", ()))
    assert {"E", "nu"} <= set(about["Elastic"]["required"])


def test_the_list_has_every_metal_and_the_picture_every_curve():
    """Names, sources and ranges are in the list; solid up to the end of the tests, dashed beyond."""
    both = {name: read_metal(name) for name in ("AISI304", "Cu-OFHC")}
    assert [line.split()[0] for line in lines_of(both, whole=False)] == ["AISI304", "Cu-OFHC"]
    assert any("Johnson & Cook (1983)" in line for line in lines_of(both, whole=True))
    axes = flow_curves(both).axes[0]
    solid = [line for line in axes.lines if line.get_linestyle() == "-"]
    assert [line.get_xdata()[-1] for line in solid] == [0.45, 0.21]
    assert solid[1].get_ydata()[0] == 90.0
