"""What was written too shortly in a case file is answered by how to write it."""

from pathlib import Path

import pytest

from prensa.cli import BAD_INPUT, main
from prensa.errors import CaseError
from prensa.model.schema import loads

CASE = """\
name: upset
space: axisymmetric
bodies:
  billet:
    mesh: {type: rectangle, size: [15 mm, 40 mm], n: [8, 20]}
    material: {type: j2, E: 200 GPa, nu: 0.3, flow: {type: ludwik, s0: 250 MPa, K: 500 MPa, n: 0.3}}
tools:
  punch: {type: plane, touching: billet.top, press: 1 MN}
  anvil: {type: plane, touching: billet.bottom, normal: [0, 1]}
friction: {type: coulomb, mu: 0.1}
steps:
  - {name: press, move: {punch: {y: -20 mm}}}
"""
STEEL = "{type: j2, E: 200 GPa, nu: 0.3, flow: {type: ludwik, s0: 250 MPa, K: 500 MPa, n: 0.3}}"
FLOW = "{type: ludwik, s0: 250 MPa, K: 500 MPa, n: 0.3}"
MOVE = "{punch: {y: -20 mm}}"
SHORT = [
    ("[15 mm, 40 mm]", "15 mm, 40 mm", "a list of 2 lengths is expected; write [15 mm, 40 mm]"),
    ("[15 mm, 40 mm]", "15x40", "write [15, 40]"),
    ("[15 mm, 40 mm]", "(15, 40)", "write [15, 40]"),
    ("[8, 20]", "20", "write [20, 20]"),
    ("1 MN", "250 t", "'250 t' is a mass, and a force is meant: its weight is '2452 kN'"),
    ("{type: coulomb, mu: 0.1}", "0.1", "{type: coulomb, mu: 0.1}"),
    (STEEL, "AISI4135", "a metal of the library is {type: j2, of: AISI4135}"),
    (FLOW, "250 MPa", "a constant flow stress is {type: perfect, s0: 250 MPa}"),
    ("nu: 0.3, flow", "nu: 0.3, yield: 250 MPa, flow", "the yield stress is one of 'flow'"),
    (MOVE, "{punch: -20 mm}", "name the axis, such as {y: -20 mm}"),
    (MOVE, f"{MOVE}, until: {{force: 100 kN}}", "name the tool and the axis, such as {punch: {y: 100 kN}}"),
    (MOVE, f"{MOVE}, until: 100 kN", "such as {force: {punch: {y: 100 kN}}}"),
    (MOVE, f"{MOVE}, increments: auto", "leave it out, and their number is found on the way"),
    ("steps:", "fixed: billet.left\nsteps:", "such as {billet.left: x}"),
    ("space: axisymmetric", "space: 3D", "did you mean 'solid'?"),
    ("space: axisymmetric", "space: axi", "did you mean 'axisymmetric'?"),
    ("space: axisymmetric\n", "", "give 'thickness', how long the part is, or 'space: axisymmetric' of a round part"),
]


@pytest.mark.parametrize(("old", "new", "words"), SHORT)
def test_the_answer_is_how_to_write_it(old, new, words):
    """One mistake, one sentence, with what to write instead."""
    with pytest.raises(CaseError) as error:
        loads(CASE.replace(old, new, 1))
    assert words in str(error.value) and len(str(error.value).splitlines()) == 1


def test_commands_without_a_verb_and_files_for_folders(tmp_path, monkeypatch, capsys):
    """A case alone, a case for the folder of its run, and a tool without 'tools'."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "upset.yaml").write_text(CASE)
    for arguments, words in [
        (["upset.yaml"], "did you mean 'prensa run upset.yaml'?"),
        (["view", "upset.yaml"], f"name the folder of a run, such as {Path('results') / 'upset'}"),
        (["resume", "upset.yaml"], f"name the folder of a run, such as {Path('results') / 'upset'}"),
        (["check", "upset.yaml", "--set", "punch.press=2MN"], "did you mean 'tools.punch.press'?"),
    ]:
        with pytest.raises(SystemExit) as left:
            monkeypatch.setattr("sys.argv", ["prensa", *arguments])
            main()
        assert left.value.code == BAD_INPUT and words in " ".join(capsys.readouterr().err.split())


def test_keys_that_are_numbers_of_another_place():
    """A diameter in place of a radius, lengths in place of a size."""
    with pytest.raises(CaseError, match="lengths are given as 'size'"):
        loads(CASE.replace("size: [15 mm, 40 mm]", "diameter: 30 mm"))
    with pytest.raises(CaseError, match="give 'radius', half of it"):
        loads(CASE.replace("type: plane, touching: billet.top", "type: circle, diameter: 30 mm, touching: billet.top"))
