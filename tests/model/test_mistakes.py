"""Every mistake of a case file is reported with its line, what is wrong and what to write instead."""

from __future__ import annotations

import time

import pytest

from prensa.errors import CaseError, PrensaError
from prensa.model.schema import load, loads

CASE = """\
name: upsetting
units: {length: mm, force: N}
space: axisymmetric
bodies:
  billet:
    mesh: {type: rectangle, size: [10, 15], n: [20, 30]}
    material: {type: j2, E: 70 GPa, nu: 0.33, flow: {type: voce, s0: 60, Q: 120, b: 8}}
tools:
  punch:
    type: circle
    radius: 8 cm
    touching: billet.top
contacts:
  - {surface: [billet.top, billet.right], against: punch, friction: {type: coulomb, mu: 0.3}}
fixed: {billet.bottom: y}
steps:
  - name: press
    move: {punch: {y: -7.5}}
    increments: 50
"""

FIXED, LOADS, STEP = "fixed: {billet.bottom: y}", "loads: {billet.left: ", "steps:\n"

# old text, new text, where the message must point, what it must contain
MISTAKES = [
    # names of keys and kinds
    ("radius:", "radus:", "11:5", ["'radus'", "tool 'punch' (circle)", "did you mean 'radius'?"]),
    ("type: circle", "type: cirle", "10:11", ["unknown tool 'cirle'", "did you mean 'circle'?"]),
    ("type: circle", "type: cylinder", "10:11", ["unknown tool 'cylinder'", "'plane'", "'stamp'"]),
    ("type: circle", "type: cylinder", "10:11", ["did you mean 'circle'?", "'plane'"]),
    ("nu: 0.33", "poisson: 0.33", "7:37", ["unknown key 'poisson'", "did you mean 'nu'?"]),
    ("y: -7.5", "angle: 3 deg", "18:20", ["unknown key 'angle'", "did you mean 'rz'?"]),
    ("    radius:", "    thickness: 2\n    radius:", "11:5", ["unknown key 'thickness' in tool 'punch'", "a key of the case"]),
    (FIXED, f"{FIXED}\nuntil: {{force: 3}}", "16:1", ["unknown key 'until'; 'until' is a key of a step"]),
    ("    type: circle\n", "", "9:3", ["tool 'punch' needs a 'type'", "'circle'"]),
    ("coulomb", "colomb", "14:76", ["unknown friction 'colomb'", "did you mean 'coulomb'?"]),
    ("voce", "vocce", "7:60", ["unknown flow 'vocce'", "did you mean 'voce'?"]),
    ("type: j2", "type: j3", "7:22", ["unknown material 'j3'", "'j2'"]),
    ("rectangle", "rectangel", "6:18", ["unknown mesh 'rectangel'", "did you mean 'rectangle'?"]),
    ("axisymmetric", "plane", "3:8", ["unknown space 'plane'", "'plane strain', 'plane stress', 'axisymmetric', 'solid'"]),
    ("space:", "spcae:", "3:1", ["unknown key 'spcae'", "did you mean 'space'?"]),
    ("length: mm", "lenght: mm", "2:9", ["unknown key 'lenght' in units", "'length'"]),
    (
        "    increments: 50",
        "    vanish: true",
        "19:5",
        ["unknown key 'vanish' in step 'press'", "known:", "'increments'"],
    ),
    ("y: -7.5", "z: -7.5", "18:20", ["'z' is an axis of 'space: solid'", "'rz'"]),
    ("y: -7.5", "z: -7.5", "18:20", ["In axisymmetry x is the radius and y the axis"]),
    ("nu: 0.33", "nu:0.33", "7:37", ["a blank is missing after the colon: write 'nu: 0.33'"]),
    ("y: -7.5", "y: -7,5", "18:26", ["unknown key", "numbers have a decimal point"]),
    ("units:", "name:glued\nunits:", "2:1", ["a blank is missing after the colon"]),
    # missing
    ("name: upsetting\n", "", "1:1", ["the case needs 'name'", "text"]),
    ("    radius: 8 cm\n", "", "9:3", ["tool 'punch' (circle) needs 'radius', a length"]),
    ("name: press\n    move", "move", "17:5", ["step 0 needs 'name'"]),
    ("    touching: billet.top\n", "", "9:3", ["tool 'punch' has no position", "'touching'"]),
    ("mu: 0.3", "mu: {mu0: 0.3, mu_inf: 0.1}", "14:85", ["needs 'u0', a length"]),
    # values
    ("8 cm", "0", "11:13", ["radius of tool 'punch' (circle) is 0", "greater than 0"]),
    ("8 cm", "-8 cm", "11:13", ["'-8 cm'", "greater than 0"]),
    ("8 cm", "true", "11:13", ["is true", "a length is expected"]),
    ("8 cm", "[1, 2]", "11:5", ["is a list", "a length is expected"]),
    ("8 cm", "", "11:5", ["is empty", "a length is expected"]),
    ("8 cm", ".nan", "11:13", [".nan is not a finite number"]),
    ("8 cm", "-.inf", "11:13", ["-.inf is not a finite number"]),
    ("8 cm", "1e999", "11:13", ["1e999", "too large"]),
    ("nu: 0.33", "nu: 0.5", "7:41", ["nu of material of body 'billet' (j2) is 0.5", "less than 0.5"]),
    ("mu: 0.3", "mu: -0.3", "14:89", ["is -0.3", "at least 0"]),
    ("mu: 0.3", "mu: {mu0: 0.3, slope: -1}", "14:85", ["softening", "'limit'"]),
    ("[20, 30]", "[20]", "6:45", ["has 1 value", "a list of 2 whole numbers"]),
    ("[20, 30]", "[20, 30, 2]", "6:45", ["has 3 values", "a list of 2 whole numbers"]),
    ("[20, 30]", "[20, 0]", "6:53", ["n[1] of mesh of body 'billet' (rectangle) is 0", "at least 1"]),
    ("[20, 30]", "20", "6:48", ["n of mesh", "is 20", "a list of 2 whole numbers"]),
    ("increments: 50", "increments: 2.5", "19:17", ["is 2.5", "a whole number"]),
    ("increments: 50", "increments: many", "19:17", ["is 'many'", "a whole number"]),
    ("name: press", "name: 3", "17:11", ["is 3", "text is expected", "put it in quotes"]),
    ("y: -7.5", "y: [[0, 0], [1, 2, 3]]", "18:32", ["y[1]", "has 3 values", "[number, length]"]),
    ("y: -7.5", "y: [[0, 1]]", "18:20", ["has 1 value", "at least 2"]),
    ("{y: -7.5}", "-7.5", "18:19", ["is -7.5", "x, y, rz, z, rx and ry"]),
    ("flow: {type: voce, s0: 60, Q: 120, b: 8}", "flow: 60", "7:53", ["is 60", "linear, ludwik"]),
    ("[billet.top, billet.right]", "[]", "14:6", ["surface of contact 0 is empty", "'body.boundary'"]),
    (FIXED, "fixed: {billet.bottom: z}", "15:24", ["'z'", "'x', 'y', 'xy'"]),
    (FIXED, "fixed: {billet.bottom: 0}", "15:24", ["is 0", "x, y, free, z and normal"]),
    (FIXED, "fixed: [billet.bottom]", "15:1", ["fixed is a list", "a mapping"]),
    (FIXED, f"{FIXED}\n{LOADS}{{}}}}", "16:9", ["give either 'traction' or 'pressure'"]),
    (FIXED, f"{FIXED}\n{LOADS}{{traction: [1]}}}}", "16:23", ["has 1 value"]),
    ("bodies:", "numerics: {tolerance: 1}\nbodies:", "4:23", ["tolerance of numerics is 1", "at most 0.0001"]),
    ("bodies:", "output: {pictures: 3}\nbodies:", "4:20", ["pictures of output is 3", "true or false"]),
    ("voce, s0: 60, Q: 120, b: 8", "table, points: [[0, 60], [0, 70]]", "7:47", ["increase strictly"]),
    # units
    ("8 cm", "8 kg", "11:13", ["'8 kg' is not a length", "'8 cm'"]),
    ("8 cm", "8 N", "11:13", ["'8 N' is not a length"]),
    ("8 cm", "8 Cm", "11:13", ["unknown unit 'Cm'", "did you mean 'cm'?"]),
    ("70 GPa", "70 N", "7:29", ["'70 N' is not a stress", "'10 GPa'"]),
    ("8 cm", "eight", "11:13", ["'eight' is not a length"]),
    ("8 cm", "9**9**9**9 mm", "11:13", ["cannot read the unit"]),
    ("length: mm", "length: mmm", "2:17", ["unknown unit 'mmm'", "did you mean 'mm'?"]),
    ("length: mm", "length: N", "2:17", ["'N' is not the unit of a length", "inch"]),
    (STEP, f"{STEP}  - {{name: a, velocity: {{punch: {{y: 3 mm}}}}}}\n", "17:26", ["not a velocity", "'100 mm/s'"]),
    # names of things
    ("touching: billet.top", "touching: bilet.top", "12:15", ["unknown body 'bilet'", "did you mean 'billet'?"]),
    ("touching: billet.top", "touching: billet.tpo", "12:15", ["unknown boundary 'tpo'", "did you mean 'top'?"]),
    ("touching: billet.top", "touching: top", "12:15", ["'top' is not a boundary", "'body.boundary'"]),
    ("billet.right]", "bilet.right]", "14:28", ["unknown body 'bilet'"]),
    ("against: punch", "against: punsh", "14:52", ["unknown tool 'punsh'", "did you mean 'punch'?"]),
    ("{punch: {y", "{pnuch: {y", "18:12", ["unknown tool 'pnuch'", "did you mean 'punch'?"]),
    ("{punch: {y", "{punch: {x", "18:20", ["in axisymmetry", "y only"]),
    (FIXED, "fixed: {bilet.bottom: y}", "15:9", ["unknown body 'bilet'", "did you mean 'billet'?"]),
    (STEP, f"{STEP}  - {{name: press}}\n", "18:11", ["two steps are called 'press'"]),
    (
        STEP,
        f"{STEP}  - {{name: a, friction: {{foo: null}}}}\n",
        "17:26",
        ["unknown contact 'foo'", "billet.right-punch"],
    ),
    (
        "    increments",
        "    push: {punch: {y: 3}}\n    increments",
        "19:20",
        ["y of tool 'punch'", "'move'", "'push'", "keep one"],
    ),
    ("bodies:", "contact_geometry: reference\nbodies:", "4:19", ["'reference'", "'kinematics: small'"]),
    ("    touching", "    above: billet.top\n    touching", "9:3", ["placed twice", "only one of"]),
    ("8 cm", "8'000 mm", "11:13", ["has something between its thousands", "write '8000 mm'"]),
    ("8 cm", "\u22128 cm", "11:13", ["begins with a dash (U+2212)", "write '-8 cm'"]),
    ("space: axisymmetric", "space: 2D", "3:8", ["unknown space '2D'; known: 'plane strain'"]),
    ("force: N}", "force: N, time: s}", "2:31", ["unknown key 'time' in units; it takes 'length' and 'force' alone"]),
    # YAML
    ("    radius", "    \u00a0radius", "11:5", ["'\\xa0radius'", "blank of web pages (U+00A0)"]),
    ("name: upsetting\n", "name: a\nname: b\n", "2:1", ["'name' appears twice", "line 1"]),
    ("increments: 50\n", "increments: 50\nsteps: [{name: b}]\n", "20:1", ["twice (first at line 16)", "under one 'steps:'"]),
    (FIXED, f"{FIXED}\nmeasures: {{edge: billet.x near (10, 0), far: punch.y}}", "16:18",
     ["between braces a text with commas stands in quotes; write 'billet.x near (10, 0)'"]),
    ("{type: coulomb, mu: 0.3}", "{mu: 0.3, m: 0.5}", "14:79", ["unknown key 'm'", "'type: capped' or ", "beside it"]),
    ("size: [10, 15]", "size: [10; 15]", "6:36", ["commas separate the entries of a list, not semicolons; write 10, 15"]),
    ("steps:\n", "output: {mirror: [lft]}\nsteps:\n", "16:19", ["'lft' is no side; write 'left'"]),
    (FIXED, "fixed: {billet.bottom: clamped}", "15:24", ["'clamped' is not 'x'", "in space also 'z'"]),
    ("mu: 0.3", "mu: 0,3", "14:91", ["unknown key '3'", "numbers have a decimal point"]),
    ("mu: 0.3}}", "mu: 0.3}", "15:1", ["',' or a closing bracket is missing"]),
    ("    radius", "\tradius", "11:1", ["a tab", "spaces"]),
    ("name: upsetting", "name: a: b", "1:8", ["unexpected ':'"]),
    ("8 cm", "!!python/object:os.system x", "11:13", ["the tag '!!python/object", "not allowed"]),
    ("8 cm", "*size", "11:13", ["'*size' has no anchor"]),
    ("increments: 50\n", "increments: 50\n---\na: 1\n", "20:1", ["second document"]),
    ("steps:\n", "<<: 1\nsteps:\n", "16:1", ["merge keys"]),
]


def mistakes_of(text: str, **options: object) -> CaseError:
    with pytest.raises(CaseError) as caught:
        loads(text, "u.yaml", **options)  # type: ignore[arg-type]
    return caught.value


def test_the_case_without_mistakes_loads():
    """The case that the mistakes are made in has none itself."""
    assert loads(CASE).problem.tools["punch"].radius == 80.0


@pytest.mark.parametrize(("old", "new", "place", "words"), MISTAKES, ids=[f"{a}→{b}"[:50] for a, b, *_ in MISTAKES])
def test_a_mistake_is_reported_with_place_and_remedy(old, new, place, words):
    """One mistake gives exactly one line: its place in the file, the value and what to write instead."""
    assert old in CASE
    error = mistakes_of(CASE.replace(old, new, 1))
    lines = str(error).splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith(f"u.yaml:{place}: ")
    for word in words:
        assert word in lines[0]


def test_all_mistakes_of_a_file_are_reported_together_in_its_order():
    """Fields and cross-references are reported at once; what follows from another mistake is not repeated."""
    text = CASE.replace("nu: 0.33", "nu: 0.7").replace("radius:", "radus:").replace("against: punch", "against: p")
    lines = str(mistakes_of(text)).splitlines()
    assert [line.split(": ")[0] for line in lines] == ["u.yaml:7:41", "u.yaml:11:5", "u.yaml:14:52"]


def test_a_section_that_cannot_be_read_makes_no_name_unknown():
    """A list where the tools should be is one mistake: the contacts' tools are not called unknown as well."""
    text = CASE.replace("  punch:\n    type: circle\n    radius: 8 cm\n    touching: billet.top\n", "  - punch\n")
    assert len(mistakes_of(text).mistakes) == 1
    assert "bodies" in str(mistakes_of("name: a\nsteps: [{name: s, fixed: {b.top: x}}]\n"))
    assert len(mistakes_of("name: a\nsteps: [{name: s, fixed: {b.top: x}}]\n").mistakes) == 1


def test_a_case_error_is_a_value_error_and_an_error_of_prensa():
    """Scripts may catch either."""
    error = mistakes_of("name: 3")
    assert isinstance(error, ValueError) and isinstance(error, PrensaError)
    assert error.mistakes[0].mark.line == 1


# ------------------------------------------------------------------------------------------------------------- hostile
LAUGHS = "a: &a [1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"{b}: &{b} [{', '.join(['*' + a] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi")
)
HOSTILE = {
    "empty": ("", "empty"),
    "only a comment": ("# nothing\n", "empty"),
    "a list": ("- 1\n", "mapping"),
    "a word": ("hello", "mapping"),
    "recursive alias": ("name: &a [*a]\n", "contains itself"),
    "recursive alias in a mapping": ("name: &a {b: *a}\n", "contains itself"),
    "billion laughs": (LAUGHS, "aliases stand for more than"),
    "deep flow": ("[" * 100_000, "deeper than"),
    "deep mappings": ("{a: " * 20_000, "deeper than"),
    "deep dashes": ("- " * 50_000, "deeper than"),
    "deep block": ("".join(" " * i + "a:\n" for i in range(400)), "deeper than"),
    "deep aliases": (
        "a: &a " + "[" * 30 + "]" * 30 + "\nb: &b " + "[" * 30 + "*a" + "]" * 30 + "\n",
        "deeper than",
    ),
    "one long line": ("a" * 3_000_000, "characters"),
    "control characters": ("name: a\x07b\n", "U+0007"),
    "NaN": ("name: a\nthickness: .NaN\n", "finite"),
    "huge integer": ("name: a\nthickness: " + "9" * 5000 + "\n", "too large"),
    "complex key": ("? [1]\n: 2\n", "key"),
    "unbalanced": ("}}}}", "YAML"),
    "long quantity": ("name: a\nthickness: 1 mm" + " * mm" * 15_000 + "\n", "not a length"),
}


def rows(row: str, count: int) -> str:
    return f"        - {row}\n" * count


def inline(points: str, cells: str, end: str = "") -> str:
    """A case with its mesh written out."""
    return (
        f"name: a\nbodies:\n  b:\n    mesh:\n      type: points\n      points:\n{points}      cells:\n{cells}"
        f"      boundaries: {{top: [0, 1]}}\n    material: {{type: elastic, E: 1, nu: 0.3}}\nsteps: [{{name: s}}]\n{end}"
    )


MEGABYTES = 3_000_000
HUGE = {
    kind: ((start + unit * (MEGABYTES // len(unit)))[:MEGABYTES], words)
    for kind, start, unit, words in (
        ("open list", "name: [", "1, 2,\n", "characters besides rows of numbers"),
        ("block list", "name:\n", "- 1\n", "more than 40000 numbers in rows"),
        ("words", "name:\n", "- a\n", "characters besides rows"),
        ("mappings", "name:\n", "- {a: 1}\n", "characters besides rows"),
        ("keys", "", "a: 1\n", "characters besides rows"),
        ("open quotes", 'name: "', "a\n ", "characters besides rows"),
        ("comments", "", "# a\n", "characters besides rows"),
        ("empty lines", "", "\n", "characters besides rows"),
        ("literal text", "name: |\n", "  a\n", "characters besides rows"),
        ("aliases", "a: &a 1\nb: [", "*a,\n", "characters besides rows"),
        ("colons", "", ":\n", "characters besides rows"),
        ("tabs", "", "\t\n", "characters besides rows"),
        ("brackets", "a: ", "[\n", "deeper than"),
    )
} | {
    # as much as is read at all
    "values": ("a: [" + "b,\n" * 30_000, "u.yaml:7998:1: more than 8000 keys and values"),
    "keys of one letter": (":\n" * 40_000, "mistakes more"),
    "wrong rows": (inline(rows("[0, 1, 2]", 10_000), rows("[0, 1, 2]", 3000)), "points[0] of mesh of body 'b' (points) has 3"),
    "wrong numbers": (inline(rows("[0, 1]", 10_000), rows("[0.5, 1, 2]", 6000)), "whole number"),
    "numbers too large": (inline(rows("[0, 1e999]", 14_000), rows("[0, 1, 2]", 3000)), "u.yaml:7:11: 1e999 is too large"),
    "mesh with a mistake after it": (inline(rows("[0, 1]", 10_000), rows("[0, 1, 2]", 6000), "friction: [\n"), "as YAML"),
    "wrong tables": ("name: a\nsteps:\n" + rows("[1, 2]", 19_000), "step 0 is a list"),
    "many steps": ("name: a\nsteps:\n" + rows("{nme: a}", 2600), "unknown key 'nme' in step 0"),
    "many tools": ("name: a\ntools:\n" + "".join(f"  t{i}: {{type: x}}\n" for i in range(1900)), "unknown tool 'x'"),
}  # fmt: skip


AT_MOST = 60.0  # processor seconds: all take less than one; a text that is read in exponential time takes for ever


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_an_error_within_a_second(name):
    """Nothing that a file may contain hangs, fills the memory or escapes as another error."""
    text, words = HOSTILE[name]
    start = time.process_time()
    assert words in str(mistakes_of(text))
    assert time.process_time() - start < AT_MOST


@pytest.mark.parametrize("name", HUGE)
def test_a_huge_file_is_an_error_at_once(name):
    """Megabytes of anything, and the most of what is read at all, are refused quickly and in few words."""
    text, words = HUGE[name]
    start = time.process_time()
    error = mistakes_of(text)
    assert time.process_time() - start < AT_MOST
    assert words in str(error)
    assert len(str(error)) < 20_000


def test_files_that_are_not_text_are_refused(tmp_path):
    """Binary, huge, missing files and folders are reported by name."""
    path = tmp_path / "case.yaml"
    for content, words in ((b"\x89PNG\r\n\x1a\n\xff\xfe\x00", "UTF-8"), (b" " * ((4 << 20) + 1), "4 MiB")):
        path.write_bytes(content)
        with pytest.raises(CaseError, match=words):
            load(path)
    with pytest.raises(CaseError, match=r"cse\.yaml: there is no such file; did you mean .*case\.yaml"):
        load(tmp_path / "cse.yaml")
    with pytest.raises(CaseError, match="folder"):
        load(tmp_path)
    with pytest.raises(CaseError, match="no folder"):
        load(tmp_path / "nowhere" / "case.yaml")


@pytest.mark.parametrize(
    ("more", "column", "words"),
    [
        ("output: {mirror: left}", 18, "cannot name 'left' or 'right' in axisymmetry"),
        ("output: {wear: {punsh: {}}}", 17, "names the tool 'punsh', which there is not; tools: 'punch'"),
        ("numerics: {solver: ldlt}", 20, "'numerics.solver' is 'ldlt', which is of 'space: solid'"),
    ],
)
def test_what_output_and_numerics_ask_of_a_problem_that_has_it_not_has_its_line(more, column, words):
    """What concerns two parts of a file stands at the one that is to be changed."""
    with pytest.raises(CaseError) as caught:
        loads(f"{CASE}{more}\n")
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"<text>:{len(CASE.splitlines()) + 1}:{column}: ") and words in line
