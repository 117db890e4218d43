"""A file and a script describe the same thing: every class of the vocabulary survives writing and reading."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

import prensa as pr
from prensa.model import problem as vocabulary
from prensa.model.schema import Case, brief, dump, load, loads
from prensa.model.text import read, write
from prensa.model.unsaid import space_left_out

UPSETTING = """\
name: upsetting
units: {length: mm, force: N}
space: axisymmetric
bodies:
  billet:
    mesh: {type: rectangle, size: [10, 15], n: [20, 30]}
    material: {type: j2, E: 70 GPa, nu: 0.33, flow: {type: voce, s0: 60, Q: 120, b: 8}}
tools: {punch: {type: plane, touching: billet.top}}
contacts:
  - {surface: [billet.top, billet.right], against: punch, friction: {type: coulomb, mu: 0.3}}   # the free side folds
fixed: {billet.bottom: y}
steps: [{name: press, move: {punch: {y: -7.5}}, increments: 50}]
"""

HERTZ = """\
name: cylinder on a block
space: plane strain
kinematics: small
contact_geometry: reference
bodies:
  block:
    mesh: {type: rectangle, size: [80, 40], n: [80, 40], grade: top-left}
    material: {type: elastic, E: 10e3, nu: 0.3}
tools: {cylinder: {type: circle, radius: 80, touching: block.top}}
contacts: [{surface: block.top, against: cylinder}]
fixed: {block.bottom: y, block.left: x}
steps: [{name: press, move: {cylinder: {y: -2.0}}, increments: 20}]
"""


def upsetting() -> pr.Problem:
    flow = pr.Voce(s0=60, Q=120, b=8)
    mesh = pr.Rectangle(size=(10, 15), n=(20, 30))
    return pr.Problem(
        "upsetting",
        space="axisymmetric",
        bodies={"billet": pr.Body(mesh, pr.J2(E=70e3, nu=0.33, flow=flow))},
        tools={"punch": pr.Plane(touching="billet.top")},
        contacts=[pr.Contact(["billet.top", "billet.right"], "punch", friction=pr.Coulomb(mu=0.3))],
        fixed={"billet.bottom": "y"},
        steps=[pr.Step("press", move={"punch": {"y": -7.5}}, increments=50)],
    )


def hertz() -> pr.Problem:
    mesh = pr.Rectangle(size=(80, 40), n=(80, 40), grade="top-left")
    return pr.Problem(
        "cylinder on a block",
        space="plane strain",
        kinematics="small",
        contact_geometry="reference",
        bodies={"block": pr.Body(mesh, pr.Elastic(E=10e3, nu=0.3))},
        tools={"cylinder": pr.Circle(radius=80, touching="block.top")},
        contacts=[pr.Contact("block.top", "cylinder")],
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=[pr.Step("press", move={"cylinder": {"y": -2.0}}, increments=20)],
    )


@pytest.mark.parametrize(("text", "problem"), [(UPSETTING, upsetting()), (HERTZ, hertz())], ids=["upsetting", "hertz"])
def test_a_file_equals_its_script(text, problem, tmp_path):
    """The examples of the guide are equal to the same problems in Python, read as text, as a file and written again."""
    assert loads(text).problem == problem
    path = tmp_path / "case.yaml"
    path.write_text("\ufeff" + text.replace("\n", "\r\n"), encoding="utf-8")
    assert load(path).problem == pr.load(path).problem == problem
    assert loads(dump(problem)).problem == problem
    assert loads(dump(loads(text))) == loads(text)
    assert dump(loads(dump(problem))) == dump(problem)


# ------------------------------------------------------------------------------- any description, drawn from its types
def values(annotation: object) -> st.SearchStrategy:
    """Plain data that may stand for a type of the vocabulary: numbers small and positive suit most bounds."""
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Annotated:
        return values(args[0])
    if origin in (typing.Union, types.UnionType):
        return st.one_of([values(a) for a in args])
    if origin is Literal:
        return st.sampled_from(args)
    if origin is tuple:
        if args[-1] is Ellipsis:
            return st.lists(values(args[0]), min_size=2, max_size=3)
        return st.tuples(*map(values, args)).map(list)
    if origin is Mapping:
        return st.dictionaries(st.sampled_from(["b.top", "b.left", "b", "t"]), values(args[1]), max_size=2)
    if dataclasses.is_dataclass(annotation):
        return descriptions(annotation)
    numbers = st.floats(1e-5, 0.49) | st.floats(-1e6, 1e6, allow_subnormal=False) | st.integers(-5, 5)
    return {float: numbers, int: st.integers(1, 9), bool: st.booleans(), type(None): st.none()}.get(
        annotation, st.sampled_from(["b.top", "b.left", "t", "a b", "y", "1e3", "null", 'say "no": {#}', "é\n"])
    )


@st.composite
def descriptions(draw, cls):
    """The keys of one class, the optional ones now and then."""
    hints = typing.get_type_hints(cls, include_extras=True)
    optional = [f.name for f in dataclasses.fields(cls) if _optional(f)]
    given = draw(st.sets(st.sampled_from(optional), max_size=2)) if optional else set()
    names = [f.name for f in dataclasses.fields(cls) if f.name == "type" or f.name not in optional or f.name in given]
    return {name: draw(values(hints[name])) for name in names}


def _optional(field: dataclasses.Field) -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


CLASSES = [
    c for c in map(vars(vocabulary).get, vocabulary.__all__) if c not in (pr.Problem, pr.Case)
]  # those two are composed of all the others
FLOW_TABLE = {"type": "table", "points": [[0, 60.0], [0.1, 80], [0.5, 1e2]]}
FILE = {
    "path": str(Path(vocabulary.__file__).parents[1] / "verify" / "meshes" / "block.msh"),
    "part": ["block"],
    "unit": "m",
}
MU_TABLE = {"kappa": [0.0, 0.5, 2], "mu": [0.3, 0.2, 0.1]}


@pytest.mark.parametrize("cls", CLASSES, ids=lambda c: c.__name__)
@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(data=st.data())
def test_every_class_survives_writing_and_reading(tmp_path_factory, cls, data):
    """What is written of a description is read back as an equal one, whatever its values and optional keys."""
    run = {"run": str(tmp_path_factory.getbasetemp())}
    (tmp_path_factory.getbasetemp() / "checkpoint.h5").touch()
    plain = {pr.FlowTable: FLOW_TABLE, pr.MuTable: MU_TABLE, pr.File: FILE, pr.Start: run}.get(cls) or data.draw(
        descriptions(cls)
    )
    adapter = TypeAdapter(vocabulary.FixedValue if cls is pr.Fixed else cls)  # 'xy' is read where it is used
    try:
        description = adapter.validate_python(plain, context={"units": {"length": "mm", "force": "N"}})
    except ValidationError:
        assume(False)
    tree, mistakes = read(f"a: {brief(description)}", "brief")
    assert not mistakes
    assert adapter.validate_python(tree.plain()["a"]) == description


def test_a_whole_case_of_everything_survives():
    """One case with every section, short form, table and unusual name is read back equal, and so are its numerics."""
    square = pr.Points(
        points=((0, 0), (1, 0), (1, 1), (0, 1)), cells=((0, 1, 2, 3),), boundaries={"top": (2, 3), "corner": (0,)}
    )
    block = pr.Body(pr.Rectangle((2, 1), (4, 2), origin=(0, -1), grade=pr.Grade(x=(0.5,), ratio=3)), pr.Elastic(1e3, 0))
    problem = pr.Problem(
        'odd: "name" #1',
        bodies={"yes": block, "two words": pr.Body(square, pr.NeoHooke(1e3, 0.3), element="q4")},
        tools={
            "no": pr.Circle(radius=1.5, above="yes.top"),
            "8": pr.Stamp(width=3, fillet=0.1, facing=(0, 1), below="yes.bottom"),
        },
        contacts=[
            pr.Contact("yes.top", "no", pr.Coulomb(mu=pr.MuTable(**MU_TABLE)), pr.Augmented(tolerance=1e-3)),
            pr.Contact(("yes.right", "yes.bottom"), "8", enforcement=pr.Penalty(k_n=1e5)),
        ],
        friction=pr.Coulomb(mu=pr.MuLinear(mu0=0.1, slope=0.2, limit=0.5)),
        fixed={"yes.left": "xy", "two words.top": {"x": "held", "y": [[0, 0], [1, 0.5]]}},
        loads={"yes.right": pr.Load(pressure=3, follower=False)},
        body_force={"yes": (0.0, [[0, 0], [1, -9.81]])},
        steps=[
            pr.Step("a", move={"no": {"x": 1, "rz": [[0, 0], [1, math.pi]]}}, push={"8": {"y": -1e-9, "m": 3}}),
            pr.Step(
                "b", velocity={"no": {"x": 1e22}}, fixed={"yes.left": "free", "yes.bottom": {"free": True, "y": 2}}
            ),
            pr.Step("c", friction={"yes.top-no": None}, loads={"yes.right": {"traction": [1, [[0, 0], [3, 1]]]}}),
        ],
        units=pr.Units(length="inch", force="lbf"),
        thickness=0.25,
    )
    case = Case(problem, pr.Numerics(tolerance=1e-6, line_search=False), pr.Output(fields=0))
    assert loads(dump(problem)) == Case(problem)
    assert loads(dump(case)) == case


def test_a_stated_space_survives_though_it_is_the_default():
    """What asks whether 'space' was stated answers alike of a case that was written back: a resumed run, a point of a study."""
    billet = UPSETTING.replace("fixed: {", "fixed: {billet.left: x, ")
    for text, named in (
        (billet.replace("space: axisymmetric\n", ""), ["bodies.billet: 'space' is missing"]),
        (billet.replace("axisymmetric", "plane strain"), []),
        (billet.replace("axisymmetric", "plane stress"), []),
        (billet, []),
    ):
        case = loads(text)
        again = loads(dump(case))
        assert again == case and dump(again) == dump(case)
        for problem in (case.problem, again.problem, loads(dump(case.problem)).problem):
            assert [words.partition(",")[0] for words in space_left_out(problem)] == named
    stated = loads(billet.replace("space: axisymmetric\n", ""), overrides=["space=plane strain"])
    assert not space_left_out(loads(dump(stated)).problem)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.dictionaries(st.text(), st.text() | st.booleans() | st.none() | st.lists(st.text()), min_size=1, max_size=3))
def test_any_text_can_be_a_name(data):
    """Names with quotes, colons, line ends or other scripts are written so that they are read back as they were."""
    assume(all(ord(c) < 0xD800 or ord(c) > 0xDFFF for c in str(data)))  # halves of surrogate pairs are no characters
    tree, mistakes = read(write(data), "names")
    assert not mistakes
    assert tree.plain() == data


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_any_number_is_written_to_the_last_bit(number):
    """A number is read back as the same number."""
    assert read(write({"a": number}), "number")[0].plain() == {"a": number}


def test_words_and_numbers_are_those_of_yaml_1_2():
    """`y` and `on` are text, `10e3` and `1e-3` numbers, a quoted number is text."""
    tree, _ = read("{y: y, on: no, a: 10e3, b: 1e-3, c: .5, d: 1_000, e: '3', f: 0x10, g: 12, h: ~, i: +1.}", "words")
    assert tree.plain() == {
        "y": "y", "on": "no", "a": 10e3, "b": 1e-3, "c": 0.5, "d": "1_000",
        "e": "3", "f": 16, "g": 12, "h": None, "i": 1.0,
    }  # fmt: skip
    assert type(tree.plain()["a"]) is float and type(tree.plain()["g"]) is int


def test_an_alias_stands_for_its_value():
    """An anchor saves writing a value twice, and the two are changed apart."""
    text = HERTZ.replace("{type: circle, radius: 80, touching: block.top}", "&c {type: circle, radius: 80, at: [0, 0]}")
    text = text.replace("at: [0, 0]}}", "at: [0, 0]}, other: *c}")
    tools = loads(text, overrides=["tools.other.radius=3"]).problem.tools
    assert (tools["cylinder"].radius, tools["other"].radius) == (80, 3)
