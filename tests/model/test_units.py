"""Unit strings are converted to the case's own system, exactly, and only in files."""

from __future__ import annotations

import pytest

import prensa as pr
from prensa.errors import CaseError, PrensaError
from prensa.model.schema import loads
from prensa.model.units import _SI, factor

from .test_mistakes import CASE

LENGTH, STRESS, FORCE, NUMBER = (0, 1), (1, -2), (1, 0), (0, 0)
QUANTITIES = [
    ("8 cm", "mm", "N", LENGTH, 80.0),
    ("0.1 mm", "mm", "N", LENGTH, 0.1),
    ("1in", "mm", "N", LENGTH, 25.4),
    ("2.5e-1 m", "mm", "N", LENGTH, 250.0),
    ("5 µm", "mm", "N", LENGTH, 0.005),
    ("10 GPa", "mm", "N", STRESS, 10e3),
    ("70 GPa", "mm", "N", STRESS, 70e3),
    ("200 MPa", "mm", "N", STRESS, 200.0),
    ("200 MPa", "m", "N", STRESS, 200e6),
    ("3 N/mm^2", "mm", "N", STRESS, 3.0),
    ("3 N/mm²", "m", "N", STRESS, 3e6),
    ("3 N mm**-2", "m", "kN", STRESS, 3e3),
    ("30 ksi", "inch", "lbf", STRESS, 30e3),
    ("30e6 psi", "inch", "lbf", STRESS, 30e6),
    ("2 kN", "mm", "N", FORCE, 2000.0),
    ("1 kip", "inch", "lbf", FORCE, 1000.0),
    ("180 deg", "mm", "N", NUMBER, 3.141592653589793),
    ("0.2 %", "mm", "N", NUMBER, 0.002),
    ("7", "mm", "N", LENGTH, 7.0),
    ("0.2 1/mm", "m", "N", (0, -1), 200.0),
    ("0.2 /mm", "mm", "N", (0, -1), 0.2),
    ("3 m/min", "mm", "N", (0, 1, -1), 50.0),
    ("20 ms", "mm", "N", (0, 0, 1), 0.02),
    ("60 1/min", "mm", "N", (0, 0, -1), 1.0),
    ("1 kg*m/s^2", "mm", "kN", FORCE, 0.001),
]


@pytest.mark.parametrize(("text", "length", "force", "dimension", "value"), QUANTITIES, ids=lambda v: str(v))
def test_a_quantity_is_converted_exactly(text, length, force, dimension, value):
    """The value in the case's system is the nearest float, without an error of the conversion."""
    assert factor(text, length, force, dimension) == value


def test_the_units_are_those_of_pint():
    """The table of units, kept for its speed and exactness, agrees with the larger library."""
    pint = pytest.importorskip("pint")
    ureg = pint.UnitRegistry(cache_folder=None)
    for name, (value, force, length, time) in _SI.items():
        unit = ureg.newton**force * ureg.meter**length * ureg.second**time
        assert ureg.Quantity(1.0, "percent" if name == "%" else name).to(unit).magnitude == pytest.approx(float(value))
    assert factor("1 dyn", "mm", "N", FORCE) == pytest.approx(1e-5)
    assert factor("1 yard", "mm", "N", LENGTH) == pytest.approx(914.4)


def test_an_imperial_case_is_read_in_its_own_system():
    """In inch and lbf plain numbers are taken as they are and metric strings are converted."""
    case = loads(CASE.replace("{length: mm, force: N}", "{length: inch, force: lbf}")).problem
    assert case.bodies["billet"].mesh.size == (10, 15)
    assert case.tools["punch"].radius == pytest.approx(80 / 25.4, rel=1e-15)
    modulus = case.bodies["billet"].material.E
    assert modulus == pytest.approx(70e9 / 6894.757293168361, rel=1e-14)


def test_strings_work_where_numbers_do():
    """Lists, tables, velocities, angles and body forces take unit strings too."""
    steps = "  - {name: a, velocity: {punch: {y: -100 mm/s}}, body_force: {billet: [0, 77 kN/m^3]}}\n"
    steps += "  - {name: b, move: {punch: {y: [[1, 0], [2, 1 cm]]}}, loads: {billet.left: {pressure: 3 MPa}}}\n"
    problem = loads(CASE.replace("[10, 15]", "[1 cm, 15]").replace("steps:\n", "steps:\n" + steps)).problem
    assert problem.bodies["billet"].mesh.size == (10, 15)
    assert problem.steps[0].velocity["punch"].y == -100
    assert problem.steps[0].body_force["billet"] == (0, 77e-6)
    assert problem.steps[1].move["punch"].y == ((1, 0), (2, 10))
    plane = CASE.replace("axisymmetric", "plane strain").replace("{y: -7.5}", "{rz: 180 deg}")
    assert loads(plane).problem.steps[0].move["punch"].rz == pytest.approx(3.141592653589793, rel=1e-15)


def test_strings_are_refused_in_python():
    """A description in Python has no file whose units could apply."""
    with pytest.raises(CaseError, match="in Python give a number"):
        pr.Circle(radius="8 cm")


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), True], ids=str)
def test_numbers_are_finite_and_no_truths(bad):
    """NaN, infinity and True are refused in Python as in files."""
    with pytest.raises(CaseError):
        pr.Circle(radius=bad)
    with pytest.raises(CaseError):
        pr.Numerics(tolerance=bad)


def test_tables_state_their_units(tmp_path):
    """A friction table says the unit of its slip in its first line; one that is no length is reported."""
    law = CASE.replace("friction: {type: coulomb, mu: 0.3}", "friction: {type: coulomb, mu: friction.csv}")
    assert law != CASE
    for head, last in (("slip, mu", 400), ("slip (um), mu", 0.4), ("slip (cm), mu", 4000)):
        (tmp_path / "friction.csv").write_text(f"{head}\n0, 0.1\n400, 0.2\n", encoding="utf-8")
        kappa = loads(law, folder=tmp_path).problem.contacts[0].friction.mu.kappa
        assert kappa == pytest.approx((0, last), rel=1e-15)
    (tmp_path / "friction.csv").write_text("slip (MPa), mu\n0, 0.1\n400, 0.2\n")
    with pytest.raises(CaseError, match="states no unit of length"):
        loads(law, folder=tmp_path)


@pytest.mark.parametrize(
    "change", ["mu: 12 deg", "mu: 12 mm", "{y: -100 mm/s}", "stabilise: 1 mm", "{y: -3 s}"]
)  # fmt: skip
def test_numbers_of_another_kind_are_refused(change):
    """A share is no angle, a displacement no velocity, and neither are reported as files that are missing."""
    text = CASE.replace("{y: -7.5}", change) if change.startswith("{") else CASE.replace("mu: 0.3", change)
    if change.startswith("stabilise"):
        text = f"{CASE}\n{change}\n"
    with pytest.raises(CaseError) as refused:
        loads(text)
    assert "there is no such file" not in str(refused.value)


@pytest.mark.parametrize(("written", "meant"), [("Mpa", "MPa"), ("mpa", "MPa"), ("gpa", "GPa"), ("Kn", "kN")])
def test_units_in_other_letters_name_those_that_people_mean(written, meant):
    """A stress in millipascal is nobody's."""
    with pytest.raises(PrensaError, match=f"did you mean '{meant}'"):
        loads(f"name: u\nspace: plane strain\nbodies: {{b: {{mesh: {{type: rectangle, size: [1 {written}, 1], n: [1, 1]}}, "
              "material: {type: elastic, E: 1, nu: 0.3}}}\nsteps: [{name: s}]\n")
