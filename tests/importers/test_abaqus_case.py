"""Whole cases out of Abaqus decks: the answer is that of the case written by hand, what is not read is refused with its line."""

from __future__ import annotations

import re

import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.model.schema import load

NX, NY, R, H = 4, 6, 10.0, 15.0


def deck(
    kind="CAX4R", more="", segments="START, 30., 15.\nLINE, 0., 15.", interaction="*FRICTION\n0.1,", step="NLGEOM=YES"
):
    """An upsetting as a preprocessor writes it: billet, analytical rigid punch above, friction, one step."""
    nodes = [f"{1 + i + j * (NX + 1)}, {R * i / NX}, {H * j / NY}" for j in range(NY + 1) for i in range(NX + 1)]
    cells = [
        f"{1 + i + j * NX}, {n}, {n + 1}, {n + NX + 2}, {n + NX + 1}"
        for j in range(NY)
        for i in range(NX)
        for n in [1 + i + j * (NX + 1)]
    ]
    top = NY * (NX + 1)
    return "\n".join(
        [
            "*HEADING", "upsetting of a billet", "*NODE, NSET=ALL", *nodes, "*NODE, NSET=PUNCHREF", "9000, 0., 20.",
            f"*ELEMENT, TYPE={kind}, ELSET=BILLET", *cells,
            "*NSET, NSET=BOTTOM, GENERATE", f"1, {NX + 1}, 1", "*NSET, NSET=AXIS, GENERATE", f"1, {top + 1}, {NX + 1}",
            "*ELSET, ELSET=UP, GENERATE", f"{(NY - 1) * NX + 1}, {NY * NX}, 1", "*SURFACE, NAME=TOP", "UP, S3",
            "*SURFACE, TYPE=SEGMENTS, NAME=PUNCH", segments, "*RIGID BODY, ANALYTICAL SURFACE=PUNCH, REF NODE=9000",
            "*SOLID SECTION, ELSET=BILLET, MATERIAL=ALU", "1.,", "*MATERIAL, NAME=ALU", "*ELASTIC", "70000., 0.33",
            "*PLASTIC", "60., 0.", "120., 0.1", "160., 0.5", "180., 2.", "*DENSITY", "2.7e-9,", more,
            "*SURFACE INTERACTION, NAME=DRY", interaction,
            "*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE", "TOP, PUNCH",
            "*BOUNDARY", "BOTTOM, 2, 2", "AXIS, XSYMM",
            f"*STEP, NAME=press, {step}", "*STATIC", "0.05, 1.", "*BOUNDARY", "9000, 1, 1", "9000, 6, 6", "9000, 2, 2, -3.",
            "*OUTPUT, FIELD, VARIABLE=PRESELECT", "*END STEP", "",
        ]
    )  # fmt: skip


def imported(tmp_path, text):
    (tmp_path / "billet.inp").write_text(text)
    done = CliRunner().invoke(app, ["import", str(tmp_path / "billet.inp"), "--out", str(tmp_path / "case.yaml")])
    assert done.exit_code == 0, done.output
    return load(tmp_path / "case.yaml").problem


def by_hand():
    points = [[0.0, 60.0], [0.1, 120.0], [0.5, 160.0], [2.0, 180.0]]
    return pr.Problem(
        "by hand", space="axisymmetric",
        bodies={"billet": pr.Body(pr.Rectangle((R, H), (NX, NY)), pr.J2(70e3, 0.33, pr.FlowTable(points)))},
        tools={"punch": pr.Plane(touching="billet.top")},
        contacts=[pr.Contact("billet.top", "punch", friction=pr.Coulomb(0.1))],
        fixed={"billet.bottom": "y", "billet.left": "x"},
        steps=[pr.Step("press", move={"punch": {"y": -3.0}})],
    )  # fmt: skip


@pytest.mark.parametrize("segments", ["START, 30., 15.\nLINE, 0., 15.", "START, -1., 15.\nLINE, 30., 15."])
def test_a_deck_gives_the_force_of_the_case_by_hand(tmp_path, segments):
    """Whichever way its rigid surface is walked, the side of the billet is outside."""
    (*_, ours) = pr.solve(imported(tmp_path, deck(segments=segments)))
    (*_, want) = pr.solve(by_hand())
    assert ours.force("PUNCH").y == pytest.approx(want.force("punch").y, rel=1e-9)


def test_arcs_amplitudes_loads_and_pushes_are_read(tmp_path):
    """CIRCL about its centre, a table stretched to the step, pressure on a set, a force on the reference node."""
    text = deck(
        kind="CPE4I", segments="START, 8., 23.\nCIRCL, 0., 15., 0., 23.", interaction="*FRICTION\n0.,",
        more="*AMPLITUDE, NAME=RAMP\n0., 0., 2., 0.5, 4., 1.",
    ).replace("9000, 2, 2, -3.", "").replace("0.05, 1.", "0.05, 4.")  # fmt: skip
    text = text.replace("*OUTPUT", "*CLOAD, AMPLITUDE=RAMP\n9000, 2, -100.\n*DSLOAD\nTOP, P, 2.\n*OUTPUT")
    problem = imported(tmp_path, text)
    assert problem.space == "plane strain" and problem.bodies["BILLET"].element == "q4_enhanced"
    punch, step = problem.tools["PUNCH"], problem.steps[0]
    assert punch.at == (0.0, 20.0) and punch.points[0] == pytest.approx(
        (0.0, -5.0)
    )  # walked from the middle to the right
    arc = punch.points[1]
    assert arc.to == pytest.approx((8.0, 3.0)) and sum(
        (a - b) ** 2 for a, b in zip(arc.through, (0, 3))
    ) == pytest.approx(64.0)
    assert step.push["PUNCH"].y == ((0.0, 0.0), (0.5, -50.0), (1.0, -100.0))
    assert step.loads["BILLET.TOP"].pressure == 2.0 and problem.contacts[0].friction is None


def test_a_side_that_an_amplitude_moves_is_read(tmp_path):
    """The motion of a side is a table over the step, beside which nothing is held."""
    text = deck(more="*AMPLITUDE, NAME=RAMP\n0., 0., 0.5, 0.2, 1., 1.")
    text = text.replace("9000, 2, 2, -3.", "9000, 2, 2, -3.\n*BOUNDARY, AMPLITUDE=RAMP\nBOTTOM, 2, 2, 0.5")
    (step,) = imported(tmp_path, text).steps
    assert step.fixed["BILLET.BOTTOM"].y == ((0.0, 0.0), (0.5, 0.1), (1.0, 0.5))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("*ELASTIC\n", "*ELASTIC, TYPE=ORTHOTROPIC\n"), "only isotropic elasticity"),
        (("*PLASTIC\n", "*PLASTIC, HARDENING=KINEMATIC\n"), "only isotropic hardening"),
        (("TOP, PUNCH", "TOP, DIE"), "'DIE' is not an analytical rigid surface"),
        (("*FRICTION\n", "*FRICTION, TAUMAK=50.\n"), r"TAUMAK of \*FRICTION is not read; did you mean TAUMAX\?"),
        (("LINE, 0., 15.", "PARAB, 0., 15., 1., 2."), "is not START x, y; LINE x, y or CIRCL"),
        (("BOTTOM, 2, 2", "BOTOM, 2, 2"), "'BOTOM' is not a set of nodes or surface of this deck; did you mean 'BOTTOM'"),
        (("MATERIAL=ALU", "MATERIAL=STEEL"), "material 'STEEL' has no"),
        (("120., 0.1", "120., 0."), "plastic strains of a flow curve must increase: 0 after 0"),
        (("*END STEP\n", "*END STEP\n*STEP, NAME=press\n*END STEP\n"), r"two steps are called 'press', the other in line \d+"),
    ],
)
def test_what_matters_and_is_not_read_is_refused_with_its_line(tmp_path, change, message):
    """No answer of another problem."""
    text = deck()
    assert change[0] in text
    (tmp_path / "billet.inp").write_text(text.replace(*change))
    done = CliRunner().invoke(app, ["import", str(tmp_path / "billet.inp")])
    assert done.exit_code == 2 and re.search(rf"billet\.inp: line \d+: .*{message}", done.output), done.output


def test_what_is_passed_over_is_reported_and_nothing_is_overwritten(tmp_path):
    """Unknown keywords are named with their line; an existing case stays."""
    (tmp_path / "billet.inp").write_text(deck(more="*DAMPING, ALPHA=0.1"))
    done = CliRunner().invoke(app, ["import", str(tmp_path / "billet.inp")])
    assert done.exit_code == 0 and re.search(r"line \d+: \*DAMPING is not read", done.stderr)
    (tmp_path / "case.yaml").write_text("mine")
    done = CliRunner().invoke(app, ["import", str(tmp_path / "billet.inp"), "--out", str(tmp_path / "case.yaml")])
    assert done.exit_code == 2 and "exists" in done.output and (tmp_path / "case.yaml").read_text() == "mine"


@pytest.mark.parametrize(("given", "share"), [("STABILIZE", "auto"), ("STABILIZE=0.001", 0.001)])
def test_the_share_of_the_work_that_viscous_forces_dissipate_is_read(tmp_path, given, share):
    """STABILIZE has it as its value; without one both programs take theirs."""
    (step,) = imported(tmp_path, deck().replace("*STATIC\n", f"*STATIC, {given}\n")).steps
    assert step.stabilise == share


@pytest.mark.parametrize(("kind", "nodes"), [("B21", "1, 2"), ("B22", "1, 2, 3"), ("B23", "1, 2"), ("SAX1", "1, 2")])
def test_beams_have_a_middle_node_only_where_they_are_quadratic(tmp_path, kind, nodes):
    """Cubic beams have two."""
    text = deck().replace("*NSET, NSET=BOTTOM", f"*ELEMENT, TYPE={kind}, ELSET=WIRE\n901, {nodes}\n*NSET, NSET=BOTTOM")
    assert imported(tmp_path, text).steps
