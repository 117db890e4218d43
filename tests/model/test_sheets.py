"""Tables that a case names by file: friction, flow curves and profiles are read alike."""

from __future__ import annotations

from pathlib import Path

import pytest

import prensa as pr
from prensa.errors import CaseError
from prensa.model.schema import loads

CASE = """
name: upset
bodies:
  billet:
    mesh: {type: rectangle, size: [10, 10], n: [2, 2]}
    material: {type: j2, E: 200 GPa, nu: 0.3, flow: {type: table, points: FLOW}}
tools: {punch: {type: profile, points: PROFILE, touching: billet.top}}
friction: {type: coulomb, mu: FRICTION}
fixed: {billet.bottom: xy}
steps: [{name: press, move: {punch: {y: -1}}}]
"""
FLOW = "[[0, 400], [0.02, 420], [0.2, 500]]"

WRITINGS = {
    "plain": "0,400\n0.02,420\n0.2,500\n",
    "head": "strain,stress\n0,400\n0.02,420\n0.2,500\n",
    "units in brackets": "strain (%),stress [GPa]\n0,.4\n2,.42\n20,.5\n",
    "units in a row": "strain;stress\n-;MPa\n0;400\n0,02;420\n0,2;500\n",
    "decimal commas, per cent": "# tensile test\n\nstrain\tstress\n%\tMPa\n0\t400,0\n2,0\t420\n20\t500\n",
    "empty columns of a spreadsheet": "strain;stress;;\n0;400;;\n0,02;420;;\n0,2;500;;\n;;;\n",
    "an empty column without names": "0,0;400;\n0,02;420;\n0,2;500;\n",
    "an empty column in some rows": "0,400\n0.02,420,\n0.2,500,,\n",
    "names with commas over semicolons": "strain, stress (MPa)\n0;400\n0,02;420\n0,2;500\n",
    "separator said first": "sep=;\nstrain;stress\n0;400\n0,02;420\n0,2;500\n",
}


def case(folder: Path, flow: str = FLOW, profile: str = "[[-20, 0], [20, 0]]", friction: str = "0.1") -> pr.Problem:
    text = CASE.replace("FLOW", flow).replace("PROFILE", profile).replace("FRICTION", friction)
    return loads(text, "case.yaml", folder).problem


@pytest.mark.parametrize("text", WRITINGS.values(), ids=WRITINGS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_flow_curve_is_read_from_a_file(tmp_path: Path, text: str, encoding: str) -> None:
    """However the table is written, the curve is that of the points written into the case."""
    (tmp_path / "flow.csv").write_text(text, encoding=encoding)
    read, written = (case(tmp_path, flow).bodies["billet"].material.flow for flow in ("flow.csv", FLOW))
    assert [x for p in read.points for x in p] == pytest.approx([x for p in written.points for x in p], rel=1e-15)
    problem = case(tmp_path, "flow.csv")
    assert loads(pr.dump(problem), "again").problem == problem


def test_tables_of_friction_and_profiles_are_read_by_the_same_reader(tmp_path: Path) -> None:
    """Decimal commas, units in a row of their own."""
    (tmp_path / "mu.csv").write_text("slip;mu\num;%\n0;10,5\n1500,0;20\n")
    (tmp_path / "punch.csv").write_text("x;y;through x;through y\ncm;cm;cm;cm\n-2;0\n-1;0\n1;0;0;-0,25\n2;0\n")
    (tmp_path / "flat.csv").write_text("-20,0;0;\n20,0;0;\n")
    (tmp_path / "even.csv").write_text("0,0;0,1;\n1,5;0,2;\n")
    spread = case(tmp_path, friction="even.csv", profile="flat.csv")
    assert spread.tools["punch"].points == ((-20, 0), (20, 0))
    assert (spread.contacts[0].friction or spread.friction).mu.mu == (0.1, 0.2)
    problem = case(tmp_path, friction="mu.csv", profile="punch.csv")
    law = problem.contacts[0].friction or problem.friction
    assert law.mu.kappa == pytest.approx((0, 1.5)) and law.mu.mu == pytest.approx((0.105, 0.2))
    assert problem.tools["punch"].points == ((-20, 0), (-10, 0), pr.Arc(through=(0, -2.5), to=(10, 0)), (20, 0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0,400\n0.2,five\n", r"flow\.csv:2: column 2 is 'five'; a number is expected"),
        ("0;400;\n0.1;450;7\n0.2;500;\n", "expected two columns .* it has 3 in 3"),
        ("0,400,\n0.2,,\n", r"flow\.csv:2: a cell is empty"),
        ("0,400\n0.2\n", r"flow\.csv:2: 1 cells, but 2 columns"),
        ("0,02;400\n0.2;500\n", "have decimal points; write all alike"),
        ("0,400,1\n0.2,500,2\n", "expected two columns of finite numbers, plastic strain and flow stress, .* it has 3 in 2"),
        ("strain,stress\n0,400\n0.2,\n", r"flow\.csv:3: a cell is empty"),
        ("strain (mm),stress\n0,400\n0.2,500\n", "flow curve: 'mm' states no unit of strain"),
        ("strain,stress (kN)\n0,400\n0.2,500\n", "flow curve: 'kN' states no unit of stress"),
        ("0,400\n0.2,500\n0.1,510\n", "increase strictly"),
        ("", "there are no rows"),
    ],
)  # fmt: skip
def test_what_is_no_flow_curve_is_refused_at_its_line(tmp_path: Path, text: str, words: str) -> None:
    """File, line and remedy, at the place in the case."""
    (tmp_path / "flow.csv").write_text(text)
    with pytest.raises(CaseError, match=words) as caught:
        case(tmp_path, "flow.csv")
    assert str(caught.value).startswith("case.yaml:6:")
    with pytest.raises(CaseError, match=r"no such file; the folder has flow\.csv"):
        case(tmp_path, "flwo.csv")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x (mm),y (cm)\n0,0\n1,1\n", "several units, cm, mm"),
        ("x,y,a,b\n0,0\n1,1,,2\n", r"punch\.csv:3: 1, 1, nan, 2 is not x, y"),
    ],
)
def test_a_profile_with_two_units_or_a_hole_in_a_row_is_refused(tmp_path: Path, text: str, words: str) -> None:
    """A column in another unit, and half a point of an arc."""
    (tmp_path / "punch.csv").write_text(text)
    with pytest.raises(CaseError, match=words):
        case(tmp_path, profile="punch.csv")
