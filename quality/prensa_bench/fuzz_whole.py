# ruff: noqa: E501 (tables of odd values)
"""Odd but whole inputs: cases put together from parts of others, names that nobody foresaw, command lines that do run.

Beside `prensa_bench.fuzz`, which breaks good inputs. Here every part is good by itself; what is odd is how parts meet.
"""

from __future__ import annotations

import copy
import functools
import io
import shutil
from collections.abc import Callable, Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from prensa.errors import PrensaError
from prensa_bench.fuzz_calls import ODD_VALUES, Attempt, answer

LIMITS = (60.0, 120.0)  # processor seconds within which an input that is run is done, and after which it is abandoned
ENTRIES = ("bodies", "tools", "measures", "units", "friction", "fixed", "loads", "body_force", "numerics", "output", "remesh")
LISTS = ("contacts", "no_contact", "ties", "steps")
ODD_NAMES = (
    "a b", "a/b", "a_b", "../up", "..", "con", "NUL", "x" * 120, "x" * 300, "ö", "Ö", "\u00f6", "o\u0308", "日本", "\U0001f528", "-x", "--out", "1", "0.5", "1e3",
    "true", "null", "time", "step", "increment", "fx", "energy", "max(a)", "a,b", "a;b", "a'b", 'a"b', "a`b", "<b>", "&amp;", "{x}", "%s", "$HOME", "#x", "a:b", "a=b",
    "a|b", "a*", "~", " a", "a ", "\ta", "a\nb", "a\u2028b", "\u202eab", "\u200b", "history", "summary", "checkpoint", "fields", "case", "self", "symmetry", "body", "tool",
    "block", "block.top", ".a", "a.", "A", "a", "top", "__class__", "x at y", "mean", "height",
)  # fmt: skip
PLAIN_CASE = """\
name: CASE
units: {length: mm, force: N}
bodies:
  BODY:
    mesh: {type: rectangle, size: [40, 10], n: [4, 1], origin: [-20, 0]}
    material: {type: j2, E: 1000, nu: 0.3, flow: {type: swift, K: 20, e0: 0.01, n: 0.2}}
  OTHER: {mesh: {type: rectangle, size: [4, 1], n: [1, 1], origin: [50, 0]}, material: {type: elastic, E: 10, nu: 0.3}}
tools: {TOOL: {type: profile, points: [[-10, 30], [-10, 0], [10, 0], [10, 30]], touching: BODY.top}}
contacts: [{surface: BODY.top, against: TOOL, friction: {mu: 0.1}}]
no_contact: [{surface: [BODY.left, BODY.right, BODY.bottom], against: TOOL}, {surface: OTHER, against: TOOL}]
fixed: {BODY.bottom: xy, OTHER.bottom: xy}
measures: {MEASURE: TOOL.fy}
steps: [{name: STEP, move: {TOOL: {y: -0.1}}, increments: 1}, {name: AFTER, by: {TOOL: {y: 0.2}}, increments: 2}]
output: {pictures: false, fields: 1, report: false}
"""
PLACEHOLDERS = ("CASE", "BODY", "OTHER", "TOOL", "MEASURE", "STEP", "AFTER")
USUAL_NAMES = {"CASE": "press", "BODY": "block", "OTHER": "more", "TOOL": "punch", "MEASURE": "force", "STEP": "down", "AFTER": "up"}
SET_IN_LINES = (
    "friction.mu=0.2", "contacts.0.friction.mu=0", "steps.0.increments=2", "steps.down.increments=1", "steps.0.move.punch.y=-0.2", "bodies.block.mesh.n=[6, 2]",
    "bodies.block.element=q8", "bodies.block.element=t3", "tools.punch.fillet=0.5", "numerics.time_rule=bdf2", "output.fields=0", "output.report=true",
    "steps.0.by.punch.y=-0.1", "stabilise=auto", "space=plane stress", "kinematics=small", "units.length=m", "bodies.block.material.E=0", "steps.1=null",
)  # fmt: skip
MEASURED_IN_LINES = ("punch.fy", "max(punch.fy)", "force", "block.height", "block.top.x", "punch", "", "nothing", "mean(force)")
DIFFERENTIATED = (
    "friction.mu", "contacts.0.friction.mu", "bodies.block.material.E", "bodies.block.material.flow.K", "bodies.block.mesh.size.0", "bodies.block.mesh.n.0",
    "steps.down.move.punch.y", "steps.0.increments", "tools.punch.points.1.1", "nothing", "", "name",
)  # fmt: skip
OPTIONS_OF = {
    "run": ("--force", "--json", "--quiet", "--out"),
    "check": ("--json", "--quiet"),
    "plot": ("--field", "--film", "--step", "--json", "--out"),
    "report": ("--json", "--quiet"),
    "resume": ("--json", "--quiet"),
    "sweep": ("--measure", "--sampling", "--seed", "--retry", "--force", "--reports", "--json"),
    "converge": ("--measure", "--mesh", "--step", "--penalty", "--retry", "--force", "--json"),
    "gradient": ("--of", "--by", "--step", "--out", "--json", "--quiet"),
}

App = Callable[..., Any]


def crossed(count: int, seed: int, folder: Path, *, solved: bool = False) -> Iterator[Attempt]:
    """Cases with parts of others: values of a key that both have, entries of sections; read, or ``solved`` a little way."""
    from prensa.model import text as yaml
    from prensa_bench.fuzz import FORMING, corpus, read
    from prensa_bench.fuzz_runs import begun

    rng = np.random.default_rng(seed)
    trees = [yaml.read(text, "<fuzz>")[0].plain() for text in (*FORMING, *corpus())]
    for _ in range(count):
        tree = copy.deepcopy(trees[rng.integers(len(trees))])
        for _ in range(int(rng.choice([1, 1, 2, 3]))):
            _mixed(rng, tree, copy.deepcopy(trees[rng.integers(len(trees))]))
        text = yaml.write(tree)
        if solved:
            yield text, functools.partial(answer, functools.partial(begun, text, folder))
        else:
            yield text, functools.partial(read, text, folder)


def _mixed(rng: np.random.Generator, tree: dict[str, Any], other: dict[str, Any]) -> None:
    """Put a part of another case into a case."""
    from prensa_bench.fuzz import spots_of

    if rng.random() < 0.4:
        section = str(rng.choice([k for k in other if k in ENTRIES + LISTS] or ["steps"]))
        theirs = other.get(section)
        if section not in tree or not isinstance(theirs, dict | list) or type(theirs) is not type(tree[section]):
            tree[section] = theirs
        elif isinstance(theirs, dict):
            tree[section] |= theirs
        else:
            tree[section] = tree[section] + theirs if rng.random() < 0.5 else theirs + tree[section]
        return
    mine, theirs_ = ([(h, k) for h, k in spots_of(t) if isinstance(k, str)] for t in (tree, other))
    shared = sorted({k for _, k in mine} & {k for _, k in theirs_})
    if shared:
        key = str(rng.choice(shared))
        holders, others = [h for h, k in mine if k == key], [h for h, k in theirs_ if k == key]
        holders[rng.integers(len(holders))][key] = others[rng.integers(len(others))][key]


def named(count: int, seed: int, folder: Path) -> Iterator[Attempt]:
    """A small case whose parts bear odd names, written out, run into files, read back, drawn and gone on with."""
    from prensa.model import text as yaml

    rng = np.random.default_rng(seed)
    for _ in range(count):
        names = USUAL_NAMES | {w: str(ODD_NAMES[rng.integers(len(ODD_NAMES))]) for w in rng.choice(PLACEHOLDERS, int(rng.choice([1, 1, 2, 3])), replace=False)}
        tree = _renamed(yaml.read(PLAIN_CASE, "<fuzz>")[0].plain(), names)
        try:
            text = yaml.write(tree)
        except PrensaError:
            continue
        yield f"{names}", functools.partial(answer, functools.partial(_run_and_read, text, folder / "named"))


def _renamed(tree: Any, names: dict[str, str]) -> Any:
    """A tree with the words of `PLACEHOLDERS` replaced, keys too."""

    def word(text: str) -> str:
        first, dot, rest = text.partition(".")
        return names.get(first, first) + dot + rest

    if isinstance(tree, dict):
        return {word(str(key)): _renamed(value, names) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_renamed(value, names) for value in tree]
    return word(tree) if isinstance(tree, str) else tree


def _run_and_read(text: str, folder: Path) -> None:
    from prensa.model.schema import loads
    from prensa.output.result import results
    from prensa.output.run import resume, run

    shutil.rmtree(folder, ignore_errors=True)
    run(loads(text, "case.yaml", folder.parent), out=folder, quiet=True)
    found = results(folder)
    if len(found.increments) != 3:
        raise AssertionError(f"{len(found.increments)} increments read of three")
    _ = found.history, found.iterations, found.maxima(), repr(found)
    for increment in found.increments:
        _ = increment.bodies, increment.contacts
    resume(folder, quiet=True)
    outside = {p.name for p in folder.parent.iterdir()} - {"named", "here", "run", "mesh.msh"}
    if outside:
        raise AssertionError(f"written beside the folder of the run: {outside}")


def lines(app: App, count: int, seed: int, folder: Path) -> Iterator[Attempt]:
    """Command lines with a good case, good changes among odd ones, and folders that were used before: they do run."""
    rng = np.random.default_rng(seed)
    here = folder / "lines"
    here.mkdir()
    text = functools.reduce(lambda t, w: t.replace(w, USUAL_NAMES[w]), PLACEHOLDERS, PLAIN_CASE)
    (here / "good.yaml").write_text(text, encoding="utf-8")
    for words in (["run", "good.yaml", "--out", "out"], ["plot", "out", "--out", "x.png"], ["report", "out"]):
        _typed(app, words, here)  # loads the libraries of pictures: what they take is no input's fault
    for _ in range(count):
        verb = str(rng.choice(list(OPTIONS_OF)))
        words = [verb, "good.yaml" if verb not in ("plot", "report", "resume") else "out" if rng.random() < 0.8 else "study"]
        if verb in ("run", "check", "sweep", "converge", "gradient"):
            for _ in range(int(rng.integers(0, 3))):
                words += ["--set", _one(rng, SET_IN_LINES)]
        if verb == "sweep":
            words += ["--set", _one(rng, ("friction.mu=0.1,0.2", "contacts.0.friction.mu=lin(0,0.3,2)", "bodies.block.material.E=normal(1000,10)", "steps.0.increments=1,2"))]
            words += ["--samples", "2"] if "normal" in words[-1] else []  # more is no defect: its time is due to its size
        if verb in ("sweep", "converge"):
            words += ["--jobs", "1", "--out", "study", "--measure", _one(rng, MEASURED_IN_LINES)]
        elif verb == "gradient":
            words += ["--of", _one(rng, MEASURED_IN_LINES), "--by", _one(rng, DIFFERENTIATED)]
        elif verb == "run":
            words += ["--out", _one(rng, ("out", "out", "study", "new", "good.yaml"))]
        for _ in range(int(rng.choice([0, 0, 1, 2]))):
            option = _one(rng, OPTIONS_OF[verb])
            words.append(option)
            if option in ("--out", "--field", "--step", "--measure", "--samples", "--sampling", "--seed", "--mesh", "--penalty", "--set", "--of", "--by"):
                words.append(_one(rng, ("0", "1", "2", "3", "0.5,1", "1,2", "auto", "lhs", "out", "stress", "plastic_strain", "down", "x.png", "", "-1", "x", *ODD_VALUES[:12])))
        yield f"prensa {words!r}", functools.partial(answer, functools.partial(_typed, app, words, here))


def _typed(app: App, words: list[str], here: Path) -> None:
    said = io.StringIO()
    with chdir(here), redirect_stdout(said), redirect_stderr(said):
        try:
            code = app(words, standalone_mode=True)
        except SystemExit as end:
            code = end.code
    if "Traceback (most recent" in said.getvalue():
        raise AssertionError(said.getvalue()[-300:])
    if code:
        if not said.getvalue().strip():
            raise AssertionError("a command that failed without words")
        raise PrensaError(said.getvalue())


def _one(rng: np.random.Generator, among: tuple[str, ...]) -> str:
    return among[rng.integers(len(among))]
