"""What a user does with damage: case files, measures, ends of steps, the answer of a run, files, derivatives, stages."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import prensa as pr
from damaged import STEEL, billet, largest, upset
from prensa.materials.solids.elastic import Elastic
from prensa.measures import parse
from prensa.output.edges import _past, _turned
from problems import stroke

CASE = """\
name: upsetting
units: {{length: mm, force: N}}
space: axisymmetric
bodies:
  billet:
    mesh: {{type: rectangle, size: [10, 15], n: [4, 6]}}
    material: {material}
    damage: {damage}
tools: {{die: {{type: plane, touching: billet.top}}}}
friction: {{type: coulomb, mu: 0.3}}
fixed: {{billet.bottom: y}}
steps: [{{name: press, move: {{die: {{y: -8}}}}, increments: 12, until: {{damage: {until}}}}}]
measures: {{equator: billet.right.damage at y=0, most: max(billet.max.damage), place: billet.max.damage.place.x}}
"""
PLASTIC = "{type: j2, E: 200 GPa, nu: 0.3, flow: {type: ludwik, s0: 250 MPa, K: 500, n: 0.3}}"


def case(tmp_path: Path, damage: str, until: str = "{billet: limit}", material: str = PLASTIC) -> Path:
    path = tmp_path / "case.yaml"
    path.write_text(CASE.format(damage=damage, until=until, material=material), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A step that ends at the limit of the first of two laws."""
    folder = tmp_path_factory.mktemp("run")
    path = case(folder, "[{type: cockcroft_latham, limit: 0.1}, {type: freudenthal, limit: 900 MPa}]")
    return pr.run(pr.load(path), folder / "out", quiet=True)


def test_a_step_ends_where_a_limit_is_reached(run: Any) -> None:
    """Exactly there, before its time; the answer has where and when, and so has the summary."""
    table = run.history
    assert table["billet.damage.cockcroft_latham"][-1] == pytest.approx(0.1, rel=1e-7) and table["time"][-1] < 1
    assert table["billet.damage.cockcroft_latham.y"][-1] == 0.0
    first, second = run.summary["damage"]
    x, y = first["reached"]["place"]
    assert x == pytest.approx(table["billet.damage.cockcroft_latham.x"][-1]) and y == 0.0
    assert first["reached"]["travel"] == pytest.approx(-table["die.uy"][-1], rel=1e-6) and first["reached"]["tool"] == "die"
    assert second["law"] == "freudenthal" and second["reached"] is None and second["unit"] == "MPa"
    text = "\n".join(run.summary["answer"])
    assert "as damage cockcroft_latham of 'billet' has reached 0.1" in text
    assert "damage of billet (Cockcroft-Latham, normalised) reaches its limit 0.1 after" in text
    assert "% of the limit 900 MPa" in text
    assert json.loads((run.directory / "summary.json").read_text(encoding="utf-8"))["damage"][0]["limit"] == 0.1


def test_where_and_when_lie_between_increments(tmp_path: Path) -> None:
    """A limit that is passed within an increment: the time by linear interpolation, the place at its end."""
    path = case(tmp_path, "{type: cockcroft_latham, limit: 0.02}", "{billet: 0.05}")
    loaded = replace(pr.load(path), output=pr.Output(pictures=False, report=False))
    run = pr.run(loaded, tmp_path / "out", quiet=True)
    table, (found,) = run.history, run.summary["damage"]
    values = table["billet.damage.cockcroft_latham"]
    k = int(np.argmax(values >= 0.02))
    assert 0 < k < len(values) - 1 and found["reached"]["increment"] == table["increment"][k]
    assert found["reached"]["time"] == pytest.approx(np.interp(0.02, values[k - 1 : k + 1], table["time"][k - 1 : k + 1]))
    assert any("in the end 0.05" in line for line in run.summary["answer"])


BLOCK = pr.Body(pr.Rectangle((4.0, 2.0), (16, 8)), STEEL, damage=pr.Freudenthal())
SHARP = pr.Problem(
    "punch", bodies={"b": BLOCK}, tools={"t": pr.Stamp(width=2.2, touching="b.top", at=(0.0, 2.0))},
    contacts=[pr.Contact("b.top", "t")], fixed={"b.bottom": "y", "b.left": "x"}, steps=[stroke(-0.05, 8)],
)  # fmt: skip
SIZES = pr.Remesh(size=pr.Sizes(far=1.2, near_tools=1.2), when=pr.When(travel=1.5))
FOLDED = billet(0.3, pr.Freudenthal(), by=-5.0, remesh=SIZES)
OF_T6 = replace(
    billet(0.3, by=-5.0),
    bodies={"billet": pr.Body(pr.Rectangle((10.0, 15.0), (6, 9)), STEEL, "t6", damage=pr.Freudenthal())},
)
OF_Q8 = replace(
    billet(0.3, by=-5.0),
    bodies={"billet": pr.Body(pr.Rectangle((10.0, 15.0), (6, 9)), STEEL, "q8", damage=pr.Freudenthal())},
)
ROUND = replace(SHARP, tools={"t": pr.Stamp(width=2.0, fillet=0.4, touching="b.top", at=(0.0, 2.0))})


@pytest.mark.parametrize(
    ("problem", "edge_of"),
    [
        (billet(damage=pr.Freudenthal(), by=-6.5), "die"), (billet(damage=pr.CockcroftLatham(), by=-5.0), ""),
        (SHARP, "t"), (ROUND, ""), (FOLDED, "die"), (OF_T6, "die"), (OF_Q8, "die"),
        (billet(0.3, by=-5.0, remesh=SIZES), ""),
    ],
    ids=["rim", "equator", "punch", "fillet", "folded on new meshes", "t6", "q8", "equator on new meshes"],
)  # fmt: skip
def test_the_answer_says_that_the_largest_is_at_a_sharp_edge(tmp_path: Path, problem: pr.Problem, edge_of: str) -> None:
    """The rim of a billet, by all elements and where its side has come down on new meshes, and the corner of a punch.

    Not the equator, on new meshes neither, and not the fillet of a round punch.
    """
    run = pr.run(pr.Case(problem, output=pr.Output(pictures=False, report=False)), tmp_path, quiet=True)
    (found,) = run.summary["damage"]
    assert found["at"]["edge_of"] == edge_of, found
    line = next(text for text in run.summary["answer"] if text.startswith("largest damage"))
    assert ("a sharp edge of the contact" in line) == bool(edge_of)


def test_ends_of_contacts_are_edges_where_a_side_has_come_down() -> None:
    """Of a contact past a corner of the body both ends but the corner itself; of one that ends before it none."""
    chained, corners = np.ones(7, dtype=bool), np.arange(8) == 4
    for closed, ends in (([1, 1, 1, 1, 1, 1, 0, 0], [0, 5]), ([1, 1, 1, 1, 1, 0, 0, 0], [0]), ([1, 1, 0, 0, 0, 0, 0, 0], [])):
        assert np.flatnonzero(_past(corners, np.array(closed, dtype=bool), chained)).tolist() == ends
    chained[4] = False  # another surface begins
    assert np.flatnonzero(_past(corners, np.arange(8) < 6, chained)).tolist() == [0]
    flat = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.02], [3.0, 0.2], [4.0, 0.4]])
    assert np.flatnonzero(_turned(flat, np.ones(4, dtype=bool))).tolist() == [2]


def test_files_hold_what_was_found(run: Any) -> None:
    """Fields read back, measures of the case and pictures; a field that there is not is refused."""
    last, table = run.increments[-1], run.history
    stored = last.bodies["billet"]
    assert set(stored.damage) == {"cockcroft_latham", "freudenthal"}
    assert stored.damage["cockcroft_latham"].max() == pytest.approx(table["billet.damage.cockcroft_latham"][-1], rel=1e-12)
    assert run.summary["measures"]["equator"]["last"] == pytest.approx(0.1, rel=1e-7)
    assert run.summary["measures"]["place"]["last"] == pytest.approx(stored.x[:, 0].max())
    assert (run.directory / "pictures/damage.png").stat().st_size > 5000
    assert "damage (Freudenthal)" in [m.what for m in run.maxima()]
    run.plot("damage.freudenthal")
    with pytest.raises(pr.PrensaError, match=r"unknown field 'damage.oyan'.*'damage.freudenthal'|unknown field 'damage.oyan'"):
        run.plot("damage.oyan")


def test_measures_of_damage() -> None:
    """By law and place, with the units of the law."""
    increment = upset()[-1]
    problem, body = increment.problem, increment.bodies["billet"]
    for text, value in {
        "billet.max.damage": largest(increment), "billet.max.damage.oyane": body.damage["oyane"].max(),
        "billet.right.min.damage": body.damage["cockcroft_latham"][np.isclose(body.X[:, 0], 10)].min(),
        "billet.bottom-right.damage": largest(increment), "billet.damage.oyane": body.damage["oyane"].max(),
        "billet.max.damage.place.x": body.x[:, 0].max(), "billet.right.max.damage.oyane.place.y": 0.0,
    }.items():  # fmt: skip
        assert parse(text, problem).value(increment) == pytest.approx(value, rel=1e-12, abs=1e-12), text
    assert parse("b.max.damage", replace_body(pr.Freudenthal())).unit == "MPa"


def replace_body(*laws: Any, material: Any = STEEL, **more: Any) -> pr.Problem:
    body = pr.Body(pr.Rectangle((1.0, 1.0), (1, 1)), material, damage=laws)
    fixed = {"b.bottom": "y", "b.left": "x", "b.top": {"y": 0.01}}
    return pr.Problem("one", bodies={"b": body}, fixed=fixed, **{"steps": [pr.Step("s", increments=2)]} | more)


@pytest.mark.parametrize(
    ("damage", "until", "material", "said"),
    [
        ("{limit: 0.4}", "{billet: limit}", PLASTIC, ":8:13: damage of body 'billet' needs a 'type'; known: 'ayada', "),
        ("{type: cockroft}", "{billet: 1}", PLASTIC, "unknown damage law 'cockroft'; did you mean 'cockcroft_latham'?"),
        ("{type: ayada}", "{billet: 1}", "{type: elastic, E: 200, nu: 0.3}", "elastic has none; use 'j2', or leave 'damage' out"),
        ("{type: ayada}", "{billet: limit}", PLASTIC, "no damage law of body 'billet' has a limit; give it one"),
        ("[{type: ayada}, {type: ayada}]", "{billet: 1}", PLASTIC, "two damage laws 'ayada'; a body has one of each"),
        ("[{type: ayada}, {type: brozzo}]", "{billet: 1}", PLASTIC, "has 2 damage laws, of which a number says none"),
        ("{type: ayada}", "{bilet: 1}", PLASTIC, "unknown body 'bilet'; did you mean 'billet'?"),
        ("[]", "{billet: limit}", PLASTIC, "body 'billet' has no damage law to reach a limit; give it one, like"),
        ("{type: freudenthal, limit: 3 mm}", "{billet: limit}", PLASTIC, "limit of damage of body 'billet' (freudenthal)"),
        ("{type: ayada}", "{billet: 0}", PLASTIC, "damage of 'billet' that ends the step is 0, and damage begins at 0: it must"),
        ("{type: ayada}", "{billet: -1}, energy: {die: -5}", PLASTIC, "'die' in energy is -5; it must be greater than 0"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_a_line(tmp_path: Path, damage: str, until: str, material: str, said: str) -> None:
    """With file, line, value and remedy."""
    path = case(tmp_path, damage, until, material)
    with pytest.raises(pr.CaseError) as error:
        pr.load(path)
    lines = [line for line in str(error.value).splitlines() if said in line]
    assert len(lines) == 1 and lines[0].startswith(str(path)), str(error.value)


def test_other_refusals() -> None:
    """A target of another unit, measures of bodies without a law, a law that the material cannot have."""
    until = [pr.Step("s", increments=2, until=pr.Until(damage={"b": "3 mm"}))]
    with pytest.raises(pr.PrensaError, match=r"steps.0.until.damage.b: '3 mm' has the wrong unit.*or write 'limit'"):
        list(pr.solve(replace_body(pr.Ayada(), steps=until)))
    until = [pr.Step("s", increments=2, until=pr.Until(damage={"b": "0 MPa"}))]
    with pytest.raises(pr.PrensaError, match=r"steps.0.until.damage.b: .*'b' that ends the step is 0 MPa.*greater than 0; give"):
        list(pr.solve(replace_body(pr.Freudenthal(), steps=until)))
    with pytest.raises(pr.PrensaError, match=r"body 'b' has no damage law; give it one, as in"):
        parse("b.max.damage", replace_body())
    with pytest.raises(pr.PrensaError, match=r"body 'b' has no damage law 'ayda'; did you mean 'ayada'"):
        parse("b.max.damage.ayda", replace_body(pr.Ayada()))
    with pytest.raises(pr.CaseError, match="elastic has none"):
        replace_body(pr.Ayada(), material=Elastic(1.0, 0.3))


def test_a_step_that_begins_beyond_its_damage_is_refused() -> None:
    """What an earlier step has left is more than what the next one waits for."""
    steps = [stroke(-4.0, 8, tool="die"), stroke(-5.0, 4, tool="die", name="on", until=pr.Until(damage={"billet": 0.01}))]
    with pytest.raises(pr.SolveError, match=r"until.damage.billet is met when the step begins"):
        list(pr.solve(billet(steps=steps)))


USERS = """\
import numpy as np
import prensa as pr

class Squared(pr.DamageLaw):
    A: float

    def rate(self, at):
        return self.A * np.maximum(at.first / at.equivalent, 0) ** 2
"""


def test_a_users_law_stands_in_a_case_file(tmp_path: Path) -> None:
    """By its module; columns and measures have the name of its class."""
    (tmp_path / "my_laws.py").write_text(USERS, encoding="utf-8")
    loaded = pr.load(case(tmp_path, "{type: 'my_laws:Squared', A: 2, limit: 0.01}"))
    *_, last = pr.solve(loaded.problem)
    assert last.bodies["billet"].damage["Squared"].max() == pytest.approx(0.01, rel=1e-7)
    assert parse("billet.damage.Squared", loaded.problem).value(last) == pytest.approx(0.01, rel=1e-7)


def test_a_second_stage_goes_on_from_the_damage_of_the_first(tmp_path: Path) -> None:
    """As one case of two steps; other laws are refused, another limit is not."""
    first = [stroke(-2.0, 6, tool="die")]
    pr.run(pr.Case(billet(steps=first), output=pr.Output(pictures=False, report=False)), tmp_path / "first", quiet=True)
    again = stroke(-3.0, 6, tool="die", name="again")  # the place, on from −2
    start = pr.Start(str(tmp_path / "first"))
    *_, last = pr.solve(billet(damage=pr.CockcroftLatham(limit=0.3), steps=[again], start=start))
    *_, middle, end = (i for i in pr.solve(billet(steps=[*first, again])) if i.end_of_step)
    assert largest(last) == pytest.approx(largest(end), rel=1e-9)
    assert largest(end) > 1.3 * largest(middle) > 0.005
    with pytest.raises(pr.PrensaError, match=r"has other damage laws in the earlier run; .* equal, except for their limits"):
        list(pr.solve(billet(damage=pr.Ayada(), steps=[again], start=start)))


def test_damage_has_derivatives() -> None:
    """By friction and hardening, against central differences of whole runs: 1e-4."""
    def at(mu: float = 0.3, K: float = 500.0) -> pr.Problem:
        problem = billet(mu, by=-2.0)
        body = pr.Body(pr.Rectangle((10.0, 15.0), (4, 6)), replace(STEEL, flow=pr.Ludwik(250.0, K, 0.3)), damage=pr.Freudenthal())
        return replace(problem, bodies={"billet": body})

    paths = {"contacts.0.friction.mu": ("mu", 0.3, 1e-4), "bodies.billet.material.flow.K": ("K", 500.0, 0.1)}
    *_, last = pr.solve(at(), derivatives=list(paths))
    found = last.derivative("billet.bottom-right.damage")
    for path, (name, value, step) in paths.items():
        ends = []
        for sign in (1, -1):
            *_, beside = pr.solve(at(**{name: value + sign * step}))
            ends.append(parse("billet.bottom-right.damage", beside.problem).value(beside))
        assert found[path] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-4), path


@pytest.mark.slow
def test_extrusion_that_bursts_along_the_axis() -> None:
    """A small reduction at a steep die draws the core: the largest damage is on the axis, four times that of the skin."""
    radius, angle = 5.0 * np.sqrt(0.9), np.tan(np.radians(30.0))
    die = [[7, 1 + (7 - radius) / angle], [radius, 1], [radius, 0], [radius + 1, -20]]
    nose = pr.Nose(length=6, thickness=2 * radius - 0.1)
    mesh = pr.Wire(length=20, diameter=10, n=(30, 6), nose=nose, front=-2)
    wire = pr.Body(mesh, STEEL, damage=pr.CockcroftLatham())
    problem = pr.Problem(
        "extrusion", space="axisymmetric", bodies={"bar": wire}, tools={"die": pr.Profile(die, fillet=0.5, at=(0, 0))},
        contacts=[pr.Contact("bar.right", "die", pr.Shear(0.1))], steps=[pr.Step("push", by={"bar.bottom": {"y": 12.0}})],
    )  # fmt: skip
    *_, last = pr.solve(problem)
    body = last.bodies["bar"]
    damage = body.damage["cockcroft_latham"]
    assert damage.max() > 0.03 and body.X[np.argmax(damage), 0] < 1e-9
    drawn = (body.x[:, 1] > 1) & (body.X[:, 1] < body.X[:, 1].max() - 7)  # without the nose, which fits the die
    skin, core = (drawn & (body.X[:, 0] > 4.99)), drawn & (body.X[:, 0] < 1e-9)
    assert skin.sum() >= 2 and damage[skin].max() < 0.25 * damage[core].min()
