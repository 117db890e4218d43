# ruff: noqa: E501 (cases with long lines, tables of odd values)
"""Broken inputs of commands: decks, drawings, tables of readings, results folders, and the options of every command.

Beside `prensa_bench.fuzz`, which breaks case files: the same bounds, the same rule: an answer or a `PrensaError` in words.
What a command would compute when its input is good is not computed here, but everything before is.
"""

from __future__ import annotations

import functools
import io
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from prensa.errors import PrensaError
from prensa_bench.fuzz_calls import ODD_PATHS, ODD_VALUES, Attempt, answer

DECK = """\
*HEADING
upsetting of a billet
*NODE, NSET=ALL
1, 0., 0.
2, 5., 0.
3, 10., 0.
4, 0., 15.
5, 5., 15.
6, 10., 15.
9000, 0., 20.
*ELEMENT, TYPE=CAX4R, ELSET=BILLET
1, 1, 2, 5, 4
2, 2, 3, 6, 5
*NSET, NSET=BOTTOM, GENERATE
1, 3, 1
*NSET, NSET=AXIS
1, 4
*SURFACE, NAME=TOP
BILLET, S3
*SURFACE, TYPE=SEGMENTS, NAME=PUNCH, FILLET RADIUS=0.5
START, 30., 25.
LINE, 30., 15.
CIRCL, 20., 15., 25., 15.
LINE, 0., 15.
*RIGID BODY, ANALYTICAL SURFACE=PUNCH, REF NODE=9000
*SOLID SECTION, ELSET=BILLET, MATERIAL=ALU
1.,
*MATERIAL, NAME=ALU
*ELASTIC
70000., 0.33
*PLASTIC
60., 0.
120., 0.1
180., 2.
*DENSITY
2.7e-9,
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.1,
*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE
TOP, PUNCH
*AMPLITUDE, NAME=RAMP
0., 0., 0.5, 0.2, 1., 1.
*BOUNDARY
BOTTOM, 2, 2
AXIS, XSYMM
*STEP, NAME=press, NLGEOM=YES
*STATIC
0.05, 1.
*BOUNDARY, AMPLITUDE=RAMP
9000, 1, 1
9000, 2, 2, -3.
*OUTPUT, FIELD, VARIABLE=PRESELECT
*END STEP
"""
DECK_OF_PARTS = """\
*Heading
*Part, name=Billet
*Node
 1, 0., 0.
 2, 5., 0.
 3, 10., 0.
 4, 0., 15.
 5, 5., 15.
 6, 10., 15.
*Element, type=CAX4R
 1, 1, 2, 5, 4
 2, 2, 3, 6, 5
*Nset, nset=Set-1, generate
 1, 6, 1
*Elset, elset=Set-1, generate
 1, 2, 1
*Solid Section, elset=Set-1, material=Alu
,
*End Part
*Part, name=Die
*Node
 1, 0., 0.
 2, 15., 0.
 3, 30., 0.
 4, 0., -5.
*Element, type=RAX2
 1, 1, 2
 2, 2, 3
*Elset, elset=Die, generate
 1, 2, 1
*End Part
*Part, name=Punch
*End Part
*Assembly, name=Assembly
*Instance, name=Billet-1, part=Billet
 0., 1., 0.
*End Instance
*Instance, name=Die-1, part=Die
 0., 1., 0.
*End Instance
*Instance, name=Punch-1, part=Punch
 0., 21., 0.
 0., 21., 0., 0., 21., 1., 180.
*Node
 1, 0., 5., 0.
*Nset, nset=Punch-1-RefPt_, internal
1,
*Surface, type=SEGMENTS, name=Surf-tool
START, 30., 5.
 LINE, -30., 5.
*Rigid Body, ref node=Punch-1-RefPt_, analytical surface=Surf-tool
*End Instance
*Nset, nset=Set-1, instance=Billet-1
 1, 4
*Nset, nset=Set-2, instance=Punch-1
 1,
*Elset, elset=_Top_S3, internal, instance=Billet-1
 1, 2
*Surface, type=ELEMENT, name=Top
_Top_S3, S3
*Elset, elset=_Low_S1, internal, instance=Billet-1
 1, 2
*Surface, type=ELEMENT, name=Low
_Low_S1, S1
*Elset, elset=_Die_SPOS, internal, instance=Die-1, generate
 1, 2, 1
*Surface, type=ELEMENT, name=Die
_Die_SPOS, SPOS
*Rigid Body, ref node=Die-1.4, elset=Die-1.Die
*End Assembly
*Amplitude, name=Amp-1
 0., 0., 2., 1.
*Material, name=Alu
*Elastic
70000., 0.33
*Plastic
 60., 0.
180., 2.
*Surface Interaction, name=IntProp-1
1.,
*Friction, slip tolerance=0.005
 0.1,
*Boundary
Set-1, XSYMM
Die-1.4, ENCASTRE
*Contact Pair, interaction=IntProp-1
Top, Punch-1.Surf-tool
Low, Die
*Step, name=Press, nlgeom=YES
*Static
0.05, 2.
*Boundary, amplitude=Amp-1
Set-2, 1, 1
Set-2, 2, 2, -3.
*End Step
*Step, name=Lift, nlgeom=YES
*Static
0.05, 1.
*Boundary, op=NEW
Set-1, XSYMM
Set-2, 1, 2
*End Step
"""
CASE = """\
name: press
units: {length: mm, force: N}
bodies:
  block:
    mesh: {type: rectangle, size: [40, 10], n: [8, 2], origin: [-20, 0]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: swift, K: 20, e0: 0.01, n: 0.2}}
tools: {punch: {type: profile, points: POINTS, touching: block.top}}
friction: {mu: 0.1}
fixed: {block.bottom: xy}
steps: [{name: press, move: {punch: {y: -0.1}}, increments: 2}]
"""
GOOD = CASE.replace("POINTS", "[[-10, 30], [-10, 0], [10, 0], [10, 30]]")
PROFILE = "x,y\n-10,30\n-10,2\n-8,0,-9.41421356,0.58578644\n10,0\n10,30\n"
DXF = """\
0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\n-10\n20\n30\n11\n-10\n21\n2
0\nARC\n8\n0\n10\n-8\n20\n2\n40\n2\n50\n180\n51\n270\n0\nLINE\n8\n0\n10\n-8\n20\n0\n11\n10\n21\n0
0\nLINE\n8\n0\n10\n10\n20\n30\n11\n10\n21\n0\n0\nENDSEC\n0\nEOF
"""
SLIP_TABLE = "# measured\nslip (um), mu\n0, 0.1\n1.5; 0.2\n40, 0.12\n"
READINGS = "travel [mm],force [N],width [mm]\n0,0,40\n0.02,1.5,40.1\n0.05,3,40.2\n0.08,,40.3\n0.1,6,\n"
LISTED = ("-1", "0", "1e3", "1e400", "nan", "inf", "", " ", "x", "ö", "a" * 3000, "lin(0,0.3,7)", "lin(0,0.3,1000000000)", "lin(0,1)",
          "lin(1,1,3)", "log(0,1,5)", "log(0.1,10,5)", "normal(0.1,0.01)", "normal(0.1,-1)", "uniform(2,1)", "normal(nan,1)", "0,0.1,0.2", "0,,1",
          "0.1,x", "lin(", "lin)", ")(", "[[0,1],[2]]", "{mu: 0.1},null", "0.1 mm,0.2 mm", "1,1", "lin(0,0.3,-2)", "lin(0,0.3,2.5)", "triangular(0,1,2)",
          "null", "true,false", "lin(0,1,3),5", "normal(1,1),normal(2,1)", "0.02..0.5", "0.5..0.02", "..", "0..", "1e400..2", "2%", "-2%", "%", "0.02 mm")  # fmt: skip
MEASURED = ("punch.fy", "punch.force.y", "max(punch.fy)", "max()", "max(", "mean(punch.fy)", "at(0.5, punch.fy)", "punch.fz", "punch", "", " ", ".", "block.top.x",
            "block.right.x at y=5", "block.right.x at y=", "block.right.x at y=1e400", "block.right.x at z=1", "height", "block.height", "block.volume",
            "energy.plastic", "time", "max(max(punch.fy))", "punch.fy at 0.5", "punch.fy @ 9", "block.top-punch.pressure", "block.top-punch.length", "1", "nan",
            "punch.fy+1", "__import__('os')", "ö", "a" * 3000, "punch.fy\n", "(" * 500, "punch.moment", "block.top.angle", "-punch.uy", "punch.uy")  # fmt: skip
CALIBRATION = """\
name: fit of a press
tests:
  - case: case.yaml
    set: [steps.0.increments=2]
    data: data.csv
    along: -punch.uy
    column: travel
    scale: 1
    offset: 0 mm
    name: wide
    observe:
      force: {measure: punch.fy, sigma: 2 %, scale: 1, shift: 0.01, gain: 3 %}
      width: block.right.x at y=5
  - {case: case.yaml, data: data.csv, along: -punch.uy, observe: {force: punch.force.y}}
parameters:
  friction.mu: [0.02, 0.5]
  bodies.block.material.flow.K: null
starts: 2
seed: 4
refine: false
compare: false
profiles: false
"""
STARTED = """\
name: again
units: {length: mm, force: N}
start: {run: run}
bodies:
  block:
    mesh: {type: rectangle, size: [40, 10], n: [8, 2], origin: [-20, 0]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: swift, K: 20, e0: 0.01, n: 0.2}}
  more: {mesh: {type: rectangle, size: [4, 1], n: [2, 2], origin: [50, 0]}, material: {type: elastic, E: 10, nu: 0.3}}
tools:
  punch: {type: profile, points: [[-10, 30], [-10, 0], [10, 0], [10, 30]], touching: block.top}
  other: {type: circle, radius: 30, above: block.top}
friction: {mu: 0.1}
no_contact: [{surface: more, against: punch}, {surface: more, against: other}]
fixed: {block.bottom: xy, more.bottom: xy}
steps: [{name: up, by: {punch: {y: 1}}, duration: 2 s}, {name: on, by: {other: {y: -0.2}}, until: {force: {other: {y: 5}}}}]
"""
VERBS = ("check", "run", "resume", "sweep", "calibrate", "identify", "converge", "gradient", "report", "plot", "new", "schema", "import",
         "verify", "bench")
OPTIONS = ("--set", "--out", "--quiet", "-q", "--force", "--json", "--measure", "--samples", "--sampling", "--seed", "--jobs", "--memory", "--cluster", "--data",
           "--observe", "--fit", "--along", "--sigma", "--starts", "--rows", "--mesh", "--step", "--field", "--film", "--only", "--count", "--family", "--of", "--by", "--x", "-x", "--")  # fmt: skip

App = Callable[..., Any]
Check = Callable[[], Any]


def commands(app: App, count: int, seed: int, folder: Path) -> Iterator[Attempt]:
    """Attempts of all kinds in turn, each with its input broken in a way of its own; *app*: what takes command lines."""
    rng = np.random.default_rng(seed)
    kinds = (_deck, _profile, _slips, _readings, _options, functools.partial(_line, app), _folder, _calibration, _started)
    run = _a_run(folder / "run")
    for number in range(count):
        here = folder / "here"
        here.mkdir(exist_ok=True)
        kind = kinds[number % len(kinds)]
        given, attempt = kind(rng, here, run)
        yield given, functools.partial(_answer, attempt)


def _answer(attempt: Check) -> str:
    try:
        return answer(attempt)
    except OSError as error:  # the system's words, which name the file, are those of the command line too
        if error.filename is None:
            raise
        return "refused"
    except SystemExit as end:
        raise AssertionError(f"the process was ended ({end.code})") from end


def _broken(rng: np.random.Generator, text: str) -> str:
    from prensa_bench.fuzz import mutate_size, mutate_text

    return mutate_size(rng, text) if rng.random() < 0.01 else mutate_text(rng, text)


def _written(rng: np.random.Generator, path: Path, text: str) -> str:
    """What was written to *path*: a broken text, or one in twenty times bytes that are none."""
    changed = _broken(rng, text)
    data = changed.encode("utf-8", errors="replace")
    if rng.random() < 0.05:
        data = bytes(rng.integers(0, 256, int(rng.integers(1, 400)), dtype=np.uint8)) + data[: int(rng.integers(len(data) + 1))]
    path.write_bytes(data)
    return changed


# --------------------------------------------------------------------------------------------------- files of commands
def _deck(rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """`prensa import`, and the case that it writes."""
    given = _written(rng, here / "deck.inp", DECK if rng.random() < 0.5 else DECK_OF_PARTS)

    def attempt() -> None:
        from prensa.importers.imported import case_text
        from prensa_bench.fuzz import read

        text, _ = case_text(here / "deck.inp", here)
        if read(text, here) == "refused":
            raise PrensaError("the case of the deck is refused in words")

    return given, attempt


def _profile(rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """A tool's profile out of a drawing or a table."""
    name, text = (("profile.dxf", DXF), ("profile.csv", PROFILE))[rng.integers(2)]
    given = _written(rng, here / name, text)
    points = name if name.endswith("csv") or rng.random() < 0.6 else f"{{path: {name}, layer: '{ODD_VALUES[rng.integers(len(ODD_VALUES))]}'}}"

    def attempt() -> None:
        from prensa_bench.fuzz import read

        if read(CASE.replace("POINTS", points), here) == "refused":
            raise PrensaError("refused in words")

    return f"{points}: {given}", attempt


def _slips(rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """A table of friction over slip, and what a case calls it."""
    given = _written(rng, here / "mu.csv", SLIP_TABLE)
    name = "mu.csv" if rng.random() < 0.8 else str(_one(rng, (*LISTED, *ODD_VALUES)))

    def attempt() -> None:
        import json

        from prensa_bench.fuzz import read

        if read(GOOD.replace("{mu: 0.1}", f"{{mu: {json.dumps(name)}}}"), here) == "refused":
            raise PrensaError("refused in words")

    return f"{name!r}: {given}", attempt


def _readings(rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """A table of readings against a case, and what its columns are said to be."""
    given = READINGS
    if rng.random() < 0.7:
        given = _written(rng, here / "data.csv", READINGS)
    else:
        (here / "data.csv").write_text(READINGS, encoding="utf-8")
    columns, errors = ["force=punch.fy", "width=block.right.x at y=5"], ["force=2%"]
    along = "-punch.uy" if rng.random() < 0.7 else str(_one(rng, MEASURED))
    if given is READINGS or rng.random() < 0.3:
        columns[rng.integers(2)] = f"{_one(rng, ('force', 'width', 'travel', '', 'x'))}={_one(rng, MEASURED)}"
        errors = [f"{_one(rng, ('force', 'width', ''))}={_one(rng, LISTED)}"]

    def attempt() -> None:
        from prensa.inverse.commands import observed
        from prensa.inverse.experiment import Test, ready
        from prensa.model.schema import loads

        case = loads(GOOD, "case.yaml", here)
        ready(Test(case, here / "data.csv", observed(columns, errors), along), 1)

    return f"{columns} {errors} {along!r}: {given}", attempt


def _calibration(rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """A calibration file, its tree or its text broken, beside a good case and a good table."""
    from prensa_bench.fuzz import mutate_tree
    from prensa_bench.fuzz_yaml import mutate_yaml

    (here / "case.yaml").write_text(GOOD, encoding="utf-8")
    (here / "data.csv").write_text(READINGS, encoding="utf-8")
    (here / "fit.yaml").unlink(missing_ok=True)
    if rng.random() < 0.5:
        given = (mutate_tree, mutate_yaml)[rng.integers(2)](rng, CALIBRATION)
        (here / "fit.yaml").write_text(given, encoding="utf-8", errors="replace")
    else:
        given = _written(rng, here / "fit.yaml", CALIBRATION)
    changes = [f"{_one(rng, ODD_PATHS)}={_one(rng, ODD_VALUES)}"] if rng.random() < 0.2 else []

    def attempt() -> None:
        from prensa.inverse.files import read_calibration

        read_calibration(here / "fit.yaml", changes)

    return f"calibration {changes}: {given}", attempt


def _started(rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """A case that starts from a run: its tree or its text broken, or the run's folder."""
    from prensa_bench.fuzz import mutate_tree

    there, given, damage = here / "run", STARTED, "whole"
    shutil.rmtree(there, ignore_errors=True)
    shutil.copytree(run, there)
    if rng.random() < 0.6:
        given = mutate_tree(rng, STARTED) if rng.random() < 0.6 else _broken(rng, STARTED)
    else:
        damage = _damaged(rng, there, ("checkpoint.h5", "case.yaml", "summary.json", "history.csv"))

    def attempt() -> None:
        from prensa_bench.fuzz import read

        if read(given, here) == "refused":
            raise PrensaError("refused in words")

    return f"start from a run, {damage}: {given}", attempt


# ----------------------------------------------------------------------------------------------------- words of commands
def _options(rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """What studies and calibrations are asked for: values, measures, levels, parameters."""
    path = str(_one(rng, ("friction.mu", "bodies.block.material.E", "steps.0.move.punch.y", *ODD_PATHS)))
    values, measure = str(_one(rng, (*LISTED, *ODD_VALUES))), str(_one(rng, MEASURED))
    levels = str(_one(rng, ("auto", "1,2", "0.5,1,2", "1,1", *LISTED)))

    def attempt() -> None:
        from prensa.inverse.commands import bounds_of
        from prensa.model.schema import loads
        from prensa.study.quantities import quantities
        from prensa.study.values import factors_of, levels_of, split_changes

        case = loads(GOOD, "case.yaml", here)
        refused = []
        for what in (
            lambda: factors_of(split_changes([f"{path}={values}"])),
            lambda: quantities([measure], case.problem),
            lambda: levels_of("mesh", levels),
            lambda: bounds_of([f"{path}={values}"]),
        ):
            try:
                what()
            except PrensaError as error:
                refused.append(error)
        if refused:
            raise refused[0]

    return f"{path!r} = {values!r}, {measure!r}, {levels!r}", attempt


def _line(app: App, rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """A command line: a verb, a file or folder that may be there, options that may be its own."""
    (here / "case.yaml").write_text(CASE.replace("POINTS", "nothing.csv"), encoding="utf-8")  # nothing runs with it
    places = ("case.yaml", "none.yaml", ".", "", "/dev/null", "run", "deck.inp", "ö", "\udcff", "x" * 300, "ring", "nothing")
    words = [str(_one(rng, VERBS)) if rng.random() < 0.9 else str(_one(rng, ODD_VALUES))]
    if words[0] in ("verify", "bench"):
        words += ["--only", "none at all"] if words[0] == "verify" else [str(_one(rng, ("nothing", "all", "")))]
    else:
        words += [p if p in ("", "nothing") else str(run if p == "run" else here / p) for p in [str(_one(rng, places))]]
    for _ in range(int(rng.integers(0, 4))):
        words.append(str(_one(rng, OPTIONS)))
        if rng.random() < 0.7:
            words.append(str(_one(rng, (*LISTED, *ODD_VALUES, *MEASURED))))
    out = here / "out"
    if words[0] in ("run", "sweep", "calibrate", "converge", "gradient", "plot", "new", "import") and "--out" not in words:
        words += ["--out", str(out / {"plot": "x.png", "gradient": "x.csv"}.get(words[0], ""))]

    def attempt() -> None:
        said = io.StringIO()
        with chdir(here), redirect_stdout(said), redirect_stderr(said):  # an odd '--out' stays inside the folder
            try:
                code = app(words, standalone_mode=True)
            except SystemExit as end:
                code = end.code
        if code:
            if not said.getvalue().strip():
                raise AssertionError("a command that failed without words")
            raise PrensaError(said.getvalue())

    return f"prensa {words!r}", attempt


# ---------------------------------------------------------------------------------------------------- folders of results
def _a_run(folder: Path) -> Path:
    """The folder of a small run."""
    from prensa.model.schema import loads
    from prensa.output.run import run

    case = loads(GOOD + "output: {pictures: false, fields: 1}\n", "case.yaml")
    run(case, out=folder, quiet=True)
    return folder


def _folder(rng: np.random.Generator, here: Path, run: Path) -> tuple[str, Check]:
    """A results folder of which one file is broken, cut off, empty, missing, or a folder; read back and resumed."""
    broken = here / "broken"
    shutil.rmtree(broken, ignore_errors=True)
    shutil.copytree(run, broken)
    files = sorted(str(p.relative_to(broken)) for p in broken.rglob("*") if p.is_file() and p.suffix != ".html")
    damage = _damaged(rng, broken, files)
    readers = [_read_back, _looked_at, _gone_on]
    reader = readers[rng.integers(3)]
    return f"{damage}, {reader.__name__[1:]}", functools.partial(reader, broken)


def _damaged(rng: np.random.Generator, folder: Path, names: Sequence[str]) -> str:
    """Break one of the files *names* of a folder of results, and say how; nothing where it is not there."""
    path = folder / names[int(rng.integers(len(names)))]
    if not path.is_file():
        return f"no {path.name}"
    data = bytearray(path.read_bytes())
    way = int(rng.integers(6))
    match way:
        case 0:
            path.unlink()
        case 1:
            path.unlink()
            path.mkdir()
        case 2:
            path.write_bytes(b"")
        case 3:
            path.write_bytes(data[: int(rng.integers(len(data) + 1))])
        case 4 if path.suffix in (".csv", ".json", ".yaml", ".log", ".txt", ".pvd"):
            path.write_text(_broken(rng, path.read_text(encoding="utf-8", errors="replace")), encoding="utf-8", errors="replace")
        case _:
            for _ in range(int(rng.choice([1, 1, 3, 30]))):
                if data:
                    data[rng.integers(len(data))] = int(rng.integers(256))
            path.write_bytes(data)
    return f"{path.relative_to(folder)} broken in way {way}"


def _read_back(folder: Path) -> None:
    from prensa.output.result import results

    run = results(folder)
    _ = run.history, run.iterations, run.maxima()
    for increment in run.increments:
        _ = increment.bodies, increment.contacts


def _looked_at(folder: Path) -> None:
    from prensa.output.result import results

    run = results(folder)
    run.at("largest force").force("punch")
    run.at("press")


def _gone_on(folder: Path) -> None:
    from prensa.output.run import resume

    resume(folder, quiet=True)


def _one(rng: np.random.Generator, among: tuple[Any, ...]) -> Any:
    return among[rng.integers(len(among))]
