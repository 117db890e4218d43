"""Verbs beside the solving ones: starters, pictures, the schema; names in overrides."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from ruamel.yaml import YAML
from typer.testing import CliRunner

from prensa.cli import app
from prensa.model.schema import json_schema, load
from prensa.output.starters import STARTERS, starter

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.yaml"))
SMALL = """
name: small
bodies:
  block: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools: {punch: {type: plane, touching: block.top}}
fixed: {block.bottom: xy}
steps:
  - {name: press, move: {punch: {y: -0.05}}, increments: 2}
  - {name: lift to 0.5 mm, move: {punch: {y: 0}}, increments: 2}
"""


def prensa(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.mark.parametrize("kind", STARTERS)
def test_starters_are_commented_cases_that_load(kind, tmp_path, monkeypatch):
    """Each kind writes a file that opens with words and is a valid case; a second one does not overwrite it."""
    monkeypatch.chdir(tmp_path)
    done = prensa("new", kind)
    assert done.exit_code == 0, done.output
    assert (tmp_path / f"{kind}.yaml").read_text(encoding="utf-8").startswith("#") and starter(kind).count("#") > 1
    assert load(tmp_path / f"{kind}.yaml").problem.steps
    assert prensa("new", kind).exit_code == 2 and prensa("new", "nothing").exit_code == 2
    assert kind in prensa("new").output


def test_the_schema_accepts_every_example_and_no_unknown_key():
    """The schema for editors agrees with what is read: all examples hold, a typing error at any depth does not."""
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json.loads(prensa("schema").output))
    assert validator.schema == json_schema()
    for path in EXAMPLES:
        case = YAML(typ="safe", pure=True).load(path)
        assert not list(validator.iter_errors(case)), path.name
        assert list(validator.iter_errors({**case, "tolls": {}}))
        assert list(validator.iter_errors({**case, "steps": [{**case["steps"][0], "mov": {}}]}))


def test_the_schema_offers_nothing_that_files_refuse():
    """What is described in Python alone is no key, no type and no value to editors."""
    made = json_schema()
    assert not {"body_contacts", "heat"} & set(made["properties"])
    assert not {"BodyContact", "Conductor", "Heat"} & set(made["$defs"])
    assert made["properties"]["space"]["enum"] == ["plane strain", "plane stress", "axisymmetric", "solid"]
    text = json.dumps(made)
    assert set(re.findall(r'"#/\$defs/(\w+)"', text)) <= set(made["$defs"]) and "offered" not in text
    place, _ = made["$defs"]["Circle"]["properties"]["at"]["anyOf"]
    assert "'minItems': 3" in str(place) and "'minItems': 2" in str(place)


def test_entries_of_a_list_are_named_in_overrides(tmp_path):
    """Steps by name, dots and spaces included; an unknown name is reported with the known ones."""
    path = tmp_path / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    steps = load(
        path, ["steps.press.increments=5", "steps.lift to 0.5 mm.increments=7", "steps.1.stabilise=auto"]
    ).problem.steps
    assert [s.increments for s in steps] == [5, 7] and steps[1].stabilise == "auto"
    done = prensa("check", path, "--set", "steps.pres.increments=5")
    assert done.exit_code == 2 and "no entry 'pres' in 'steps'; did you mean 'press'?" in done.output


def test_pictures_films_and_json_of_a_run(tmp_path, monkeypatch):
    """A run reported as JSON alone; its picture at a step, its film, its page; what does not exist is reported."""
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL, encoding="utf-8")
    done = prensa("run", "small.yaml", "--json", "--set", "output.pictures=false")
    assert done.exit_code == 0 and json.loads(done.stdout)["status"] == "completed"
    assert prensa("plot", "results/small", "--step", "press").output.strip().endswith("mises.png")
    assert prensa("plot", "results/small", "--film", "--out", "film.gif").exit_code == 0
    assert Path("film.gif").read_bytes()[:3] == b"GIF" and Path("results/small/mises.png").stat().st_size > 1000
    assert prensa("plot", "results/small", "--field", "force_stroke", "--out", "f.svg").exit_code == 0
    for wrong in (("--field", "nonsense"), ("--step", "never"), ("--out", "picture.txt")):
        done = prensa("plot", "results/small", *wrong)
        assert done.exit_code == 2 and wrong[1] in done.output
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    assert prensa("view", "results/small").exit_code == 0 and opened[0].endswith("results/small/report.html")
    assert prensa("-V").output.startswith("prensa ") and "Usage" in prensa("run", "-h").output


def test_warnings_of_a_run_have_their_place_in_the_file(tmp_path):
    """What is said before a run of a part of the case begins with file, line and column, as in `check`."""
    case = tmp_path / "again.yaml"
    case.write_text(SMALL.replace("move: {punch: {y: 0}}", "move: {punch: {y: -0.05}}"), encoding="utf-8")
    done = prensa("run", case, "-q", "--out", tmp_path / "out", "--set", "output.report=false", "--set", "output.pictures=false")
    assert done.exit_code == 0, done.output
    line = next(line for line in done.stderr.splitlines() if "moves nothing" in line)
    assert line.startswith(f"{case}:9:43:") and ": warning: steps.1.move.punch.y: step 'lift to 0.5 mm' moves nothing" in line
    assert line in prensa("check", case).stderr
    kept = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["warnings"]
    assert [w for w in kept if w.startswith("steps.1.move.punch.y: step")]


def test_bench_without_its_distribution_says_how_to_get_it(monkeypatch):
    """``prensa bench`` is in another distribution: where that is not installed, one sentence says how to get it."""
    monkeypatch.setattr("prensa.cli.find_spec", lambda name: None)
    for words in (["bench"], ["bench", "fuzz", "--count", "3"]):
        refused = prensa(*words)
        assert refused.exit_code == 2 and refused.output.count("\n") <= 2
        assert "pip install ./quality" in " ".join(refused.output.split())
