"""`prensa gradient`: slopes on the command line, backwards, forwards and in all increments, and what is refused."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.sensitivity.parameters import value_of, with_values
from rings import MU, RING, K, ring

FEW = "steps.0.increments=2"


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A ring test in a file."""
    path = tmp_path_factory.mktemp("case") / "ring.yaml"
    path.write_text(RING, encoding="utf-8")
    return str(path)


def test_slopes_are_those_of_python_and_in_a_table_of_all_increments(case: str, tmp_path: Path) -> None:
    """Two measures by two parameters: as `pr.gradient` has them backwards, and forwards with a table whose last row they are."""
    asked = ["gradient", case, "--set", FEW, "--of", "die.force.y", "--of", "ring.left.x at y=0", "--by", MU, "--by", K]
    result = CliRunner().invoke(app, [*asked, "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    expected = pr.gradient(ring(FEW), ["die.force.y", "ring.left.x at y=0"], [MU, K])
    force = found["measures"]["die.force.y"]
    assert (force["value"], force["unit"]) == (expected.values[0], "N")
    assert list(force["slopes"].values()) == expected.slopes[0].tolist()
    assert list(found["measures"]["ring.left.x at y=0"]["slopes"].values()) == expected.slopes[1].tolist()
    assert (found["followed"], found["parameters"]) == ("backwards", {MU: 0.1, K: 500.0})
    table = tmp_path / "new" / "slopes.csv"
    result = CliRunner().invoke(app, [*asked, "--out", str(table)])
    assert result.exit_code == 0, result.output
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert [row["step"] for row in rows] == ["press"] * len(rows)
    assert len(rows) >= 2
    assert float(rows[-1][f"d(die.force.y)/d({MU})"]) == pytest.approx(expected.slopes[0, 0], rel=1e-9)
    assert f"slope {expected.slopes[0, 0]:.6g} at 0.1" in result.stdout


TABLE_OF_FRICTION = "friction={type: coulomb, mu: {kappa: [0, 0.1, 1], mu: [0.05, 0.15, 0.2]}}"


@pytest.mark.parametrize(
    ("changes", "of", "by", "why"),
    [
        (["bodies.ring.element=q4_enhanced"], "die.force.y", MU, "no enhanced modes"),
        ([TABLE_OF_FRICTION], "die.force.y", "friction.mu.mu.1", "changes a table of friction"),
        ([], "ring.max.plastic_strain", K, "has no derivative with respect to positions and forces"),
    ],
)
def test_what_cannot_go_backwards_goes_forwards(case: str, changes: list[str], of: str, by: str, why: str) -> None:
    """Elements, friction and measures without a way back: the command says why, and has the slopes of the run forwards."""
    changes = [*changes, FEW]
    asked = ["gradient", case, "--of", of, "--by", by, *(w for c in changes for w in ("--set", c))]
    result = CliRunner().invoke(app, [*asked, "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["followed"] == "forwards"
    last = list(pr.solve(ring(*changes), derivatives=[by]))[-1]
    assert found["measures"][of]["slopes"][by] == last.derivative(of)[by]
    result = CliRunner().invoke(app, asked)
    assert why in result.stderr


def test_steps_are_parts_of_a_path_by_their_name() -> None:
    """What ``--set steps.press.…`` names, a parameter names too: the same number as by the number of the step."""
    path = "steps.press.move.die.y"
    assert value_of(ring(), path) == value_of(ring(), "steps.0.move.die.y") == -0.6
    assert with_values(ring(), {path: -0.5}) == with_values(ring(), {"steps.0.move.die.y": -0.5})
    slopes = [pr.gradient(ring(FEW), "die.force.y", [p])[p] for p in (path, "steps.0.move.die.y")]
    assert slopes[0] == slopes[1] != 0.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--of", "die.forc.y", "--by", MU], "did you mean 'die.force.y'"),
        (["--of", "die.force.y", "--by", "friction.nu"], "did you mean 'friction.mu'"),
        (["--of", "die.force.y", "--by", MU, "--step", "pres"], "there is no step 'pres'"),
        (["--of", "die.force.y", "--by", MU, "--step", "pres", "--out", "a.csv"], "there is no step 'pres'"),
        (["--of", "die.force.y", "--by", MU, "--by", MU], "--by friction.mu is given twice"),
        (["--of", "die.force.y", "--of", "die.force.y", "--by", MU], "--of die.force.y is given twice"),
        (["--of", "die.force.y", "--by", MU, "--out", "."], "is a folder"),
        (["--by", MU], "--of"),
        (["--of", "die.force.y", "--by", MU, "--set", "contacts.0.enforcement={type: augmented}"], "is augmented"),
    ],
)
def test_wrong_options_are_reported_before_anything_is_solved(case: str, options: list[str], words: str) -> None:
    """Measures, paths, steps and files that there are not: exit code 2 and a line."""
    result = CliRunner().invoke(app, ["gradient", case, *options])
    assert result.exit_code == 2, result.output
    assert words in result.output.replace("\n", " ")
